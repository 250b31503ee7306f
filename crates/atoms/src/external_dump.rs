//! Frames of a block from any LAMMPS run, in any LAMMPS text dump format.
//!
//! Only frames are needed: the displacement of the indenter follows from its atoms, and the load from the forces of
//! the indenter on the block ([`indenter_forces`]). The first pass computes both for every frame; the second pass
//! reads the two frames that bracket a load.

use std::path::PathBuf;

use super::block::Block;
use super::dump::{DumpFrame, DumpReader};
use super::forces::indenter_forces;
use super::indenter::Indenter;
use super::interaction::Interaction;
use super::load_history::{Between, Bracket, between, bracket};
use asperity_grid::{Error, Result, extent};

/// Tolerance of the heights of indenter atoms relative to a rigid indenter, Å: dumps have six digits by default, that
/// is three decimals in a box of 100 nm.
const RIGID_ANGSTROM: f64 = 5e-3;

/// Relative tolerance of the size of the box.
const BOX: f64 = 1e-4;

/// Relative tolerance within which a single frame is used for a load.
const NEAR: f64 = 0.02;

/// Location of a frame, its load and displacement.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    pub file: PathBuf,
    /// Index in its file, from 0.
    pub index: usize,
    pub timestep: u64,
    /// Normal force on the indenter, eV/Å.
    pub load: f64,
    /// Displacement of the indenter, downwards, Å.
    pub displacement_angstrom: f64,
}

/// All frames of a block, in the order of their files.
#[derive(Debug, Clone, PartialEq)]
pub struct DumpTrajectory {
    pub places: Vec<Place>,
    block: Block,
}

impl DumpTrajectory {
    /// Reads all frames once. An incomplete last frame causes a call of `warn` and is ignored.
    ///
    /// # Errors
    /// `Io`; `Format` for a frame that cannot be read, belongs to another block, or has no indenter atom; `Input`
    /// without any frame.
    pub fn scan(
        files: &[PathBuf],
        block: &Block,
        indenter: &Indenter,
        interaction: &Interaction,
        warn: &mut dyn FnMut(&str),
    ) -> Result<DumpTrajectory> {
        let mut places = Vec::new();
        for_each_frame(files, warn, &mut |index, frame| {
            check_box(&frame, block)?;
            let displacement_angstrom = lowered(&frame, block, indenter)?;
            let (file, timestep) = (frame.source.clone(), frame.timestep);
            let load =
                indenter_forces(&of_block(frame, block), indenter, displacement_angstrom, interaction, 0.0).load();
            places.push(Place { file, index, timestep, load, displacement_angstrom });
            Ok(())
        })?;
        Ok(DumpTrajectory { places, block: *block })
    }

    /// The atoms at `load` (eV/Å): interpolated between the first two frames that bracket the load, or a frame whose
    /// load differs by less than 2 %.
    ///
    /// # Errors
    /// `Input` if no two frames bracket the load and no frame is near it; errors of [`DumpReader`].
    pub fn at_load(&self, load: f64) -> Result<Between> {
        let loads: Vec<f64> = self.places.iter().map(|p| p.load).collect();
        if let Some(found) = bracket(&loads, load) {
            let (a, b) = (&self.places[found.lower], &self.places[found.lower + 1]);
            let ends = [a.displacement_angstrom, b.displacement_angstrom];
            return Ok(between(found, &self.frame(a)?, &self.frame(b)?, ends));
        }
        let deviation = |p: &Place| (p.load - load).abs();
        let (lower, nearest) = self
            .places
            .iter()
            .enumerate()
            .min_by(|a, b| deviation(a.1).total_cmp(&deviation(b.1)))
            .expect("scanned: not empty");
        if deviation(nearest) > NEAR * load.abs() {
            let (smallest, largest) = extent(&loads);
            let found = format!("frames with loads from {smallest:.4} to {largest:.4} eV/angstrom");
            let accepted = format!("frames around {load:.4} eV/angstrom, or one within {:.0} % of it", 100.0 * NEAR);
            return Err(Error::input("command line", "--frames", found, accepted));
        }
        let displacement_angstrom = nearest.displacement_angstrom;
        Ok(Between { bracket: Bracket { lower, weight: 0.0 }, frame: self.frame(nearest)?, displacement_angstrom })
    }

    fn frame(&self, place: &Place) -> Result<DumpFrame> {
        let frame = DumpReader::open(&place.file)?.nth(place.index);
        let gone =
            || Error::format(&place.file, "fewer frames than at the first reading", "a file that stays as it is");
        Ok(of_block(frame.ok_or_else(gone)??, &self.block))
    }
}

/// Visits all frames of these files in order, each with its index in its file. An incomplete last frame causes a call of `warn` and is
/// ignored.
///
/// # Errors
/// `Io`; `Format` for a frame that cannot be read; `Input` without any frame; those of `visit`.
pub fn for_each_frame(
    files: &[PathBuf],
    warn: &mut dyn FnMut(&str),
    visit: &mut dyn FnMut(usize, DumpFrame) -> Result<()>,
) -> Result<()> {
    let mut any = false;
    for file in files {
        let mut reader = DumpReader::open(file)?;
        for index in 0.. {
            match reader.next_frame() {
                Ok(Some(frame)) => visit(index, frame)?,
                Ok(None) => break,
                Err(e) if reader.truncated() && index > 0 => {
                    warn(&format!("{e}; this frame is left out, the {index} before it are read"));
                    break;
                }
                Err(e) => return Err(e),
            }
            any = true;
        }
    }
    let none = || Error::input("command line", "--frames", "files without a frame", "LAMMPS text dumps");
    any.then_some(()).ok_or_else(none)
}

/// The deformable atoms of a frame; the base does not interact with the indenter.
fn of_block(mut frame: DumpFrame, block: &Block) -> DumpFrame {
    frame.retain(|id| u64::from(id) > block.fixed() && u64::from(id) <= block.atoms());
    frame
}

fn check_box(frame: &DumpFrame, block: &Block) -> Result<()> {
    let length = block.length();
    for (axis, name) in ["x", "y"].into_iter().enumerate() {
        let [low, _] = frame.bounds[axis];
        let deviation = (frame.length(axis) / length - 1.0).abs().max(low.abs() / length);
        if deviation > BOX || !frame.periodic[axis] {
            let kind = if frame.periodic[axis] { "periodic" } else { "not periodic" };
            let found = format!("a box from {low} to {} along {name}, {kind}", frame.bounds[axis][1]);
            let accepted = format!("the scene's block: 0 to {length:.4} angstrom, periodic");
            return Err(Error::format(&frame.source, found, accepted));
        }
    }
    Ok(())
}

/// Displacement of the indenter, downwards, Å.
fn lowered(frame: &DumpFrame, block: &Block, indenter: &Indenter) -> Result<f64> {
    let first = block.atoms() as u32 + 1;
    let start = frame.ids.partition_point(|id| *id < first);
    let points = indenter.heights().len();
    let down: Vec<f64> = frame.ids[start..]
        .iter()
        .zip(&frame.positions[start..])
        .filter(|(id, _)| ((**id - first) as usize) < points)
        .map(|(id, [_, _, z])| indenter.start_z() + indenter.heights()[(id - first) as usize] - z)
        .collect();
    let name = format!("timestep {}", frame.timestep);
    if down.is_empty() {
        let found = format!("{name}: no atom of the indenter");
        let accepted = format!("at least one (ids from {first} on): it gives the displacement of the indenter");
        return Err(Error::format(&frame.source, found, accepted));
    }
    let (smallest, largest) = extent(&down);
    if largest - smallest > 2.0 * RIGID_ANGSTROM {
        let found = format!("{name}: indenter atoms that descended by {smallest:.4} to {largest:.4} angstrom");
        return Err(Error::format(&frame.source, found, "the scene's profile, moved as one"));
    }
    Ok(down.iter().sum::<f64>() / down.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write as _;
    use std::io::Write as _;
    use std::path::Path;

    const SIX_DIGITS: f64 = 1e-3;

    fn setting() -> (Block, Indenter, Interaction) {
        let block = Block::new(5, 2, 5.5884, 7.0).expect("valid");
        let heights: Vec<f64> = (0..121).map(|k| f64::from((k * 37) % 41) / 30.0).collect();
        let indenter = Indenter::above(&block, 11, heights, 4.0327).expect("valid");
        (block, indenter, Interaction { epsilon_ev: 0.2145, sigma_angstrom: 3.5927, adhesion: None })
    }

    /// One frame of the perfect lattice under the indenter with these `columns`; atoms in reversed order.
    fn text(lowered: f64, columns: &str) -> String {
        let (block, indenter, _) = setting();
        let (l, top) = (block.length(), 60.0);
        let mut all: Vec<(u32, u32, [f64; 3])> = block.sites().map(|s| (s.id, 1, s.position)).collect();
        let rigid = (block.atoms() as u32 + 1..).zip(indenter.positions());
        all.extend(rigid.map(|(id, [x, y, z])| (id, 2, [x, y, z - lowered])));
        let mut out = format!(
            "ITEM: TIMESTEP\n{}\nITEM: NUMBER OF ATOMS\n{}\nITEM: BOX BOUNDS pp pp ff\n0 {l}\n0 {l}\n0 {top}\nITEM: ATOMS {columns}\n",
            (1e3 * lowered) as u64,
            all.len()
        );
        for (id, kind, [x, y, z]) in all.iter().rev() {
            for (k, column) in columns.split(' ').enumerate() {
                let gap = if k > 0 { " " } else { "" };
                let box_of = |c: &str| if c.starts_with('z') { top } else { l };
                let value = match column.chars().next().expect("a name") {
                    'x' => *x,
                    'y' => *y,
                    _ => *z,
                };
                match column {
                    "id" => write!(out, "{gap}{id}"),
                    "type" => write!(out, "{gap}{kind}"),
                    "element" => write!(out, "{gap}{}", ["Ca", "Ind"][*kind as usize - 1]),
                    "ix" | "iy" | "iz" => write!(out, "{gap}0"),
                    // Unwrapped atoms may be any number of cells away.
                    "xu" => write!(out, "{gap}{:.6}", x + l * f64::from(id % 3)),
                    "xsu" => write!(out, "{gap}{:.8}", x / l - f64::from(id % 2)),
                    "xs" | "ys" | "zs" | "ysu" | "zsu" => write!(out, "{gap}{:.8}", value / box_of(column)),
                    _ => write!(out, "{gap}{value:.6}"),
                }
                .expect("a string");
            }
            out.push('\n');
        }
        out
    }

    fn scan(files: &[PathBuf]) -> Result<(DumpTrajectory, Vec<String>)> {
        let (block, indenter, interaction) = setting();
        let mut warnings = Vec::new();
        let actual =
            DumpTrajectory::scan(files, &block, &indenter, &interaction, &mut |w| warnings.push(w.to_string()))?;
        Ok((actual, warnings))
    }

    fn put(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
        let path = folder.join(name);
        std::fs::write(&path, bytes).expect("written");
        path
    }

    #[test]
    fn all_dump_formats_of_the_same_frames_give_the_same_loads() {
        let folder = tempfile::tempdir().expect("scratch");
        let (block, indenter, interaction) = setting();
        let perfect: DumpFrame = {
            let file = put(folder.path(), "one", text(0.4, "id type x y z").as_bytes());
            of_block(crate::dump::read_frame(file).expect("read"), &block)
        };
        let expected = indenter_forces(&perfect, &indenter, 0.4, &interaction, 0.0).load();
        assert!(expected > 0.1);
        for columns in [
            "id type x y z",
            "z y x type id",
            "type zs ys xs id element",
            "id type xu yu zu ix iy iz",
            "element id xsu ysu zsu",
            "id x xs y yu z vx",
        ] {
            let both = text(0.2, columns) + &text(0.4, columns);
            let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
            packed.write_all(both.as_bytes()).expect("packed");
            let packed = packed.finish().expect("packed");
            let zst = zstd::encode_all(both.as_bytes(), 3).expect("packed");
            // The compression is detected from the first bytes, not from the name.
            for (name, bytes) in
                [("a.lammpstrj", both.as_bytes()), ("b.gz", &packed), ("c.dump", &packed), ("d.dump", &zst)]
            {
                let (actual, warnings) = scan(&[put(folder.path(), name, bytes)]).expect(columns);
                assert_eq!((actual.places.len(), warnings.len()), (2, 0));
                let last = &actual.places[1];
                assert_eq!((last.index, last.timestep), (1, 400));
                assert!((last.displacement_angstrom - 0.4).abs() < 1e-5, "{columns}: {last:?}");
                assert!((last.load / expected - 1.0).abs() < SIX_DIGITS, "{columns}: {} {expected}", last.load);
            }
        }
    }

    #[test]
    fn an_incomplete_last_frame_is_reported_and_ignored() {
        let folder = tempfile::tempdir().expect("scratch");
        let (one, two) = (text(0.2, "id type x y z"), text(0.4, "id type x y z"));
        let cut = one.clone() + &two[..two.len() - 40];
        let (actual, warnings) = scan(&[put(folder.path(), "cut", cut.as_bytes())]).expect("one frame");
        assert_eq!(actual.places.len(), 1);
        assert!(
            warnings[0].contains("the last frame ends (timestep 400) after") && warnings[0].contains("left out"),
            "{warnings:?}"
        );
        // A file with an incomplete frame only is an error.
        let error = scan(&[put(folder.path(), "cut", &two.as_bytes()[..two.len() - 40])]).expect_err("no frame");
        assert!(error.to_string().contains("ends (timestep 400)"), "{error}");
        let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        packed.write_all((one + &two).as_bytes()).expect("packed");
        let packed = packed.finish().expect("packed");
        let (actual, warnings) =
            scan(&[put(folder.path(), "cut.gz", &packed[..packed.len() - 200])]).expect("one frame");
        assert_eq!((actual.places.len(), warnings.len()), (1, 1));
    }

    #[test]
    fn loads_are_interpolated_between_frames_of_several_files() {
        let folder = tempfile::tempdir().expect("scratch");
        let files = [0.2, 0.4, 0.5].map(|d| put(folder.path(), &format!("f{d}"), text(d, "id x y z").as_bytes()));
        let (actual, _) = scan(&files).expect("good");
        let (a, b) = (&actual.places[1], &actual.places[2]);
        let middle = actual.at_load(0.5 * (a.load + b.load)).expect("between");
        assert!((0.4..0.5).contains(&middle.displacement_angstrom) && middle.bracket.lower == 1);
        let near = actual.at_load(1.01 * b.load).expect("near");
        assert!((near.displacement_angstrom - 0.5).abs() < 1e-5 && near.frame.len() == 200);
        let error = actual.at_load(2.0 * b.load).expect_err("too far").to_string();
        assert!(error.contains("frames around") && error.contains("within 2 %"), "{error}");
    }

    #[test]
    fn frames_of_another_block_are_refused_with_the_reason() {
        let folder = tempfile::tempdir().expect("scratch");
        let good = text(0.4, "id type x y z");
        let refused =
            |text: String| scan(&[put(folder.path(), "bad", text.as_bytes())]).expect_err("refused").to_string();
        let l = format!("0 {}", setting().0.length());
        let wide = refused(good.replacen(&l, "0 28.2", 1));
        assert!(wide.contains("28.2 along x") && wide.contains("0 to 27.9420"), "{wide}");
        assert!(refused(good.replace("pp pp ff", "pp ff ff")).contains("along y, not periodic"));
        let sheared = good.replace("BOUNDS pp", "BOUNDS xy xz yz pp");
        assert!(refused(sheared).contains("triclinic box"));
        let units = format!("ITEM: UNITS\nlj\n{good}");
        assert!(refused(units).contains("units lj"));
        // Block atoms alone do not determine the position of the indenter.
        let lines: Vec<&str> = good.lines().collect();
        let kept: Vec<&str> = lines[9..].iter().copied().filter(|w| w.split(' ').nth(1) == Some("1")).collect();
        let head = lines[..9].join("\n").replace(&(lines.len() - 9).to_string(), &kept.len().to_string());
        let alone = refused(format!("{head}\n{}\n", kept.join("\n")));
        assert!(alone.contains("no atom of the indenter") && alone.contains("displacement of the indenter"), "{alone}");
        // One indenter atom is displaced relative to the others.
        let (id, moved) = (setting().0.atoms() + 5, |line: &&str| {
            let mut tokens: Vec<String> = line.split(' ').map(str::to_string).collect();
            tokens[4] = format!("{}", tokens[4].parse::<f64>().expect("z") + 0.5);
            tokens.join(" ")
        });
        let bent: Vec<String> = lines
            .iter()
            .map(|line| if line.starts_with(&format!("{id} ")) { moved(line) } else { (*line).to_string() })
            .collect();
        assert!(refused(bent.join("\n") + "\n").contains("moved as one"));
    }
}
