//! Frames of LAMMPS runs of which only positions and types are known: contact, gap and continuum, and what is refused.

use crate::lammps::lammps;
use crate::program::{asperity, json_line, stderr};
use asperity::atoms::dump::{DumpFrame, read_frame};
use asperity::atoms::load_history::frame_file;
use asperity::grid::Grid;
use asperity::scene::{Case, Scene};
use asperity::surface::files::npy;
use serde_json::Value;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Output;

const SURFACE: &str = "name = \"own\"\n[surface]\ngrid = 32\nroll_off_mode = 2\ncut_off_mode = 8\nrms_gradient = 0.3\n[load]\np_star = [0.01, 0.03]\n";
const BLOCK: &str = "[atoms]\ncells = 10\ndepth_cells = 6\n";

/// d_c and r_m of the challenge, Å.
const D_C: f64 = 4.0354;
const R_M: f64 = 4.032_671;

/// An atom of a dump: id, type, position, force along z.
type Atom = (usize, usize, [f64; 3], f64);

/// A dump in a box from these corners, with scaled coordinates, atoms in no order.
fn dump(atoms: &[Atom], bounds: [[f64; 2]; 3], columns: &str) -> String {
    let mut text = format!("ITEM: TIMESTEP\n500\nITEM: NUMBER OF ATOMS\n{}\nITEM: BOX BOUNDS pp pp ff\n", atoms.len());
    bounds.iter().for_each(|[low, high]| writeln!(text, "{low} {high}").expect("a string"));
    writeln!(text, "ITEM: ATOMS {columns}").expect("a string");
    for (id, kind, position, force) in atoms {
        let scaled = |axis: usize| (position[axis] - bounds[axis][0]) / (bounds[axis][1] - bounds[axis][0]);
        let words = columns.split(' ').map(|column| match column {
            "id" => id.to_string(),
            "type" => kind.to_string(),
            "element" => ["", "Cu", "C"][*kind].to_string(),
            "fz" => force.to_string(),
            // Some cells away, as unwrapped coordinates of a long run.
            "xu" => (position[0] + (id % 3) as f64 * (bounds[0][1] - bounds[0][0])).to_string(),
            "xs" => format!("{:.12}", scaled(0)),
            "ys" => format!("{:.12}", scaled(1)),
            "zs" => format!("{:.12}", scaled(2)),
            "y" => position[1].to_string(),
            _ => position[2].to_string(),
        });
        writeln!(text, "{}", words.collect::<Vec<_>>().join(" ")).expect("a string");
    }
    text
}

fn put(folder: &Path, name: &str, text: &str) -> PathBuf {
    let file = folder.join(name);
    std::fs::write(&file, text).expect("written");
    file
}

/// `atoms read` of these frames with these flags.
fn read(scene: &Path, frames: &[PathBuf], flags: &str) -> Output {
    let mut command = asperity();
    command
        .args(["atoms", "read"])
        .arg(scene)
        .args(flags.split_whitespace())
        .arg("--json")
        .arg("--frames")
        .args(frames);
    command.output().expect("started")
}

fn states(output: &Output) -> Vec<Value> {
    assert!(output.status.success(), "{}", stderr(output));
    json_line(output)["states"].as_array().expect("states").clone()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn map(file: PathBuf) -> Vec<f64> {
    npy::read(&file).expect("a map").values
}

/// A finished job of asperity's own, and what `--job` reads in it.
struct OwnJob {
    folder: PathBuf,
    scene: PathBuf,
    states: Vec<Value>,
    /// Ids and positions of the indenter's atoms at the start, and edge of the block.
    indenter: Vec<(u32, [f64; 3])>,
    length: f64,
}

impl OwnJob {
    fn run(folder: &Path) -> Self {
        let (scene, job) = (put(folder, "scene.toml", &format!("{SURFACE}{BLOCK}")), folder.join("job"));
        let run = |words: &[&Path]| {
            let output = asperity().arg("atoms").args(words).arg("--json").output().expect("started");
            assert!(output.status.success(), "{}", stderr(&output));
            output
        };
        run(&[Path::new("build"), &scene, Path::new("--out"), &job]);
        run(&[Path::new("run"), &job]);
        let states = states(&run(&[Path::new("read"), &scene, Path::new("--job"), &job]));
        let text = std::fs::read_to_string(job.join("block.data")).expect("a data file");
        let rows = text.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
        let parse = |word: &str| word.parse::<f64>().expect("a number");
        let (mut indenter, mut length) = (Vec::new(), 0.0);
        for row in rows {
            match row[..] {
                [id, "2", x, y, z] => indenter.push((id.parse().expect("an id"), [x, y, z].map(parse))),
                [_, high, "xlo", "xhi"] => length = parse(high),
                _ => {}
            }
        }
        OwnJob { folder: job, scene, states, indenter, length }
    }

    fn values(&self, k: usize, what: &str) -> Vec<f64> {
        map(self.folder.join(format!("read/load-{}-{what}.npy", k + 1)))
    }

    /// Frame of load k, with the indenter's descent from the start, Å.
    fn frame(&self, k: usize) -> (DumpFrame, f64) {
        let frame = read_frame(frame_file(&self.folder, k + 1).expect("a frame")).expect("good");
        let steps = std::fs::read_to_string(self.folder.join("load_curve.csv")).expect("steps");
        let row: Vec<&str> = steps.lines().nth(k + 2).expect("a step").split(',').collect();
        let shift = number(&self.states[k]["indenter_shift_angstrom"]);
        (frame, row[1].parse::<f64>().expect("a displacement") + shift)
    }

    /// The same frame as of a stranger: other ids, in no order, other types, and another corner of the box. With the ids of the block's
    /// surface atoms in it, in the order of the block's.
    fn strange(&self, k: usize, with_indenter: bool, columns: &str) -> (String, Vec<usize>) {
        let (frame, down) = self.frame(k);
        let first = self.indenter[0].0;
        let block = frame.ids.iter().zip(&frame.positions).filter(|(id, _)| **id < first).map(|(id, p)| (*id, 1, *p));
        let rigid = self.indenter.iter().map(|(id, [x, y, z])| (*id, 2, [*x, *y, z - down])).filter(|_| with_indenter);
        let all: Vec<_> = block.chain(rigid).collect();
        // 7919 is a prime, larger than the number of atoms has factors.
        let new = |rank: usize| 1 + (rank * 7919 + 17) % all.len();
        let moved = |(rank, &(_, kind, [x, y, z])): (usize, &(u32, usize, [f64; 3]))| {
            (new(rank), kind, [x - 3.5, y + 11.0, z + 70.25], 0.0)
        };
        let atoms: Vec<Atom> = all.iter().enumerate().map(moved).collect();
        let bounds = [[-3.5, self.length - 3.5], [11.0, self.length + 11.0], [60.0, 190.0]];
        let sites = self.values(k, "site-gap").len();
        let surface = (first as usize - sites..first as usize)
            .map(|id| new(all.iter().position(|a| a.0 as usize == id).expect("a surface atom of the frame")));
        (dump(&atoms, bounds, columns), surface.collect())
    }
}

/// The rank of each of these ids: the order of sites in the maps.
fn ranks(ids: &[usize]) -> Vec<usize> {
    let mut sorted = ids.to_vec();
    sorted.sort_unstable();
    ids.iter().map(|id| sorted.binary_search(id).expect("one of them")).collect()
}

/// A job of asperity's own read as a stranger's dump: with the indenter's atoms as those of another type, and without, at a height.
#[test]
fn a_strangers_dump_of_the_block_has_its_contact_and_gaps() {
    let Some(_lammps) = lammps(1) else { return };
    let scratch = tempfile::tempdir().expect("scratch");
    let job = OwnJob::run(scratch.path());
    for (name, with_indenter, columns) in [
        ("types", true, "type xs zs ys id"),
        ("elements", true, "id element xu y z"),
        ("height", false, "id type xs ys zs"),
    ] {
        let dumps: Vec<(String, Vec<usize>)> = (0..2).map(|k| job.strange(k, with_indenter, columns)).collect();
        let files: Vec<PathBuf> =
            dumps.iter().enumerate().map(|(k, d)| put(scratch.path(), &format!("{name}-{k}"), &d.0)).collect();
        let mean = job.indenter.iter().map(|(_, p)| p[2]).sum::<f64>() / job.indenter.len() as f64;
        let z = |k: usize| mean - job.frame(k).1 + 70.25;
        let flags = match name {
            "types" => "--indenter-types 2 --load scene".to_string(),
            "elements" => "--indenter-types C --substrate-types Cu".to_string(),
            _ => format!("--indenter-z {},{}", z(0), z(1)),
        };
        let out = scratch.path().join(format!("out-{name}"));
        let found = states(&read(&job.scene, &files, &format!("{flags} --out {}", out.display())));
        assert_eq!(found.len(), 2);
        for (k, state) in found.iter().enumerate() {
            let order = ranks(&dumps[k].1);
            let values = |what: &str| map(out.join(format!("frame-{}-{what}.npy", k + 1)));
            let ([own, theirs], [touch, touched]) = (
                [values("site-gap"), job.values(k, "site-gap")],
                [values("site-contact"), job.values(k, "site-contact")],
            );
            assert_eq!(own.len(), theirs.len(), "{name}: surface atoms");
            for (site, rank) in order.iter().enumerate() {
                let difference = own[*rank] + D_C - R_M - theirs[site];
                let tolerance = if with_indenter { 1e-4 } else { 0.02 };
                assert!(difference.abs() < tolerance, "{name}: gap differs by {difference}");
                // A wall touches where one of its atoms does.
                assert!(
                    touch[*rank] == touched[site] || !with_indenter && touch[*rank] > touched[site],
                    "{name}: {site}"
                );
            }
            assert!((number(&state["indenter_z_angstrom"]) - z(k)).abs() < 0.01, "{name}");
            if with_indenter {
                assert_eq!(state["contacts"], job.states[k]["contacts"], "{name}");
                assert_eq!(state["contact_area"], job.states[k]["contact_area"], "{name}");
            }
            let (continuum, area) = (&state["continuum"], number(&state["contact_area"]));
            let [kappa, chance] = ["overlap", "shifted"].map(|w| number(&continuum["contact"][w]["kappa"]));
            assert!(kappa > 0.6 && chance < 0.3, "{name}: {continuum}");
            let p_star = number(&continuum["p_star"]);
            match name {
                "types" => assert!((p_star / number(&job.states[k]["p_star"]) - 1.0).abs() < 1e-9, "{continuum}"),
                _ => assert!((number(&continuum["contact_area"]) / area - 1.0).abs() < 0.02, "{continuum}"),
            }
        }
    }
}

/// A (100) face of a bcc crystal with lattice constant 3 Å, 60 Å wide, under two layers of carbon that follow the surface.
fn other_crystal(z: f64, force: f64) -> (Vec<Atom>, [[f64; 2]; 3]) {
    let (n, m, edge) = (20, 40, 60.0);
    let file = Path::new("own.toml");
    let case = Case::resolve(Scene::parse(SURFACE, file).expect("a scene"), file).expect("a case");
    let heights = case.surface().heights(Grid::unit(m, m), 0.0);
    let mean = heights.iter().sum::<f64>() / heights.len() as f64;
    let mut atoms: Vec<Atom> = Vec::new();
    for k in 0..6 * n * n {
        let (layer, row, column) = (k / (n * n), k / n % n, k % n);
        let half = 0.5 * (layer % 2) as f64;
        let at = [column as f64 + half, row as f64 + half, 0.5 * layer as f64 - 2.5].map(|c| 3.0 * c);
        atoms.push((1 + (k * 7) % (6 * n * n), 1, at, 0.0));
    }
    for k in 0..2 * m * m {
        let (layer, node) = (k / (m * m), k % (m * m));
        let lift = z + (heights[node] - mean) * edge + 2.0 * layer as f64;
        let over = |c: usize| c as f64 * edge / m as f64;
        atoms.push((10_000 - k, 2, [over(node % m), over(node / m), lift], force / (2 * m * m) as f64));
    }
    (atoms, [[0.0, edge], [0.0, edge], [-20.0, 40.0]])
}

/// Contact atoms of another crystal under an indenter of another type by a search of all pairs, and its load by its forces.
#[test]
fn an_indenter_of_another_type_on_another_crystal() {
    let scratch = tempfile::tempdir().expect("scratch");
    let scene = put(scratch.path(), "own.toml", &format!("{SURFACE}[laboratory]\nmodulus = \"100 GPa\"\n"));
    let (d_c, z, mut files) = (2.8, [4.5, 3.5], Vec::new());
    for (k, z) in z.into_iter().enumerate() {
        let (atoms, bounds) = other_crystal(z, 3.0 * (k + 1) as f64);
        files.push(put(scratch.path(), &format!("{k}.dump"), &dump(&atoms, bounds, "id type xs ys zs fz")));
    }
    let flags = format!("--indenter-types 2 --contact-distance {d_c} --load fz");
    let found = states(&read(&scene, &files, &flags));
    for (k, state) in found.iter().enumerate() {
        let (atoms, _) = other_crystal(z[k], 0.0);
        let image = |d: f64| d - (d / 60.0).round() * 60.0;
        let distance = |a: &[f64; 3], b: &[f64; 3]| image(a[0] - b[0]).hypot(image(a[1] - b[1])).hypot(a[2] - b[2]);
        let (below, above): (Vec<&Atom>, Vec<&Atom>) = atoms.iter().partition(|a| a.1 == 1);
        let touching = below.iter().filter(|a| above.iter().any(|b| distance(&a.2, &b.2) < d_c)).count();
        assert!(touching > 10 && touching < 300, "{touching}");
        assert_eq!(state["contacts"], touching);
        assert_eq!(
            number(&state["contact_area"]),
            (touching as f64 - number(&state["contacts_below_surface"])) / 400.0
        );
        assert!((number(&state["indenter_z_angstrom"]) - z[k]).abs() < 0.02);
        // A flat crystal: its mean gap is the height of the mean plane less d_c.
        assert!((number(&state["mean_gap_angstrom"]) - (z[k] - d_c)).abs() < 0.1);
        let force = 3.0 * (k + 1) as f64;
        assert!((number(&state["load_ev_per_angstrom"]) / force - 1.0).abs() < 1e-9);
        let p_star = force / 3600.0 * 160.217_663_4 / 100.0 / 0.3;
        assert!((number(&state["p_star"]) / p_star - 1.0).abs() < 0.02, "{state}");
    }
    // The default folder, and a frame that OVITO reads.
    let frame = std::fs::read_to_string(scratch.path().join("read/frame-2.xyz")).expect("a frame");
    assert!(frame.starts_with("5600\n") && frame.contains("p_star="));
    assert_eq!(map(scratch.path().join("read/frame-1-gap.npy")).len(), 32 * 32);
}

/// Frames before contact and in tension have no continuum, and the others keep theirs. Atoms are named by type or by element where a dump
/// has both, and results of more frames than now do not stay.
#[test]
fn frames_without_a_continuum_leave_that_of_the_others() {
    let scratch = tempfile::tempdir().expect("scratch");
    let scene = put(scratch.path(), "own.toml", &format!("{SURFACE}[laboratory]\nmodulus = \"100 GPa\"\n"));
    let frame = |(k, (z, force)): (usize, (f64, f64))| {
        let (atoms, bounds) = other_crystal(z, force);
        put(scratch.path(), &format!("{k}.dump"), &dump(&atoms, bounds, "id type element xs ys zs fz"))
    };
    let files: Vec<PathBuf> =
        [(20.0, 0.0), (4.5, 3.0), (4.6, -3.0), (3.5, 6.0)].into_iter().enumerate().map(frame).collect();
    let flags = "--contact-distance 2.8 --load fz --indenter-types";
    let output = read(&scene, &files, &format!("{flags} C"));
    let (said, found) = (stderr(&output), json_line(&output)["states"].as_array().expect("states").clone());
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("the dumps name no units: forces are taken to be eV/Å (metal)"), "{said}");
    assert!(said.contains("no continuum of frame 3: ") && said.matches("no continuum").count() == 1, "{said}");
    assert!([0, 2].iter().all(|k| found[*k]["continuum"].is_null()));
    assert!(found[0]["p_star"] == 0.0 && number(&found[2]["p_star"]) == -number(&found[1]["p_star"]));
    let alone = states(&read(&scene, &[files[1].clone(), files[3].clone()], &format!("{flags} 2")));
    for (of_all, alone) in [(&found[1], &alone[0]), (&found[3], &alone[1])] {
        assert_eq!(of_all["contacts"], alone["contacts"]);
        let areas = [of_all, alone].map(|s| number(&s["continuum"]["contact_area"]));
        assert!((areas[0] / areas[1] - 1.0).abs() < 1e-6, "{areas:?}");
    }
    let left = std::fs::read_dir(scratch.path().join("read")).expect("a folder");
    let names: Vec<String> = left.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    assert!(
        names.iter().all(|n| n.starts_with("frame-1") || n.starts_with("frame-2")) && names.len() == 14,
        "{names:?}"
    );
}

/// A wall at a height over a box of 60 Å x 30 Å whose corner is not the origin: gaps by the formula of the surface.
#[test]
fn a_wall_at_a_height_over_a_rectangular_box() {
    let scratch = tempfile::tempdir().expect("scratch");
    let wave = |x: f64, y: f64| {
        let phase = |kx: f64, ky: f64| std::f64::consts::TAU * (kx * x / 60.0 + ky * y / 30.0);
        0.7 * phase(1.0, 0.0).cos() + 0.4 * phase(2.0, 1.0).cos()
    };
    let node = |k: usize| wave((k % 64) as f64 * 60.0 / 64.0, (k / 64) as f64 * 30.0 / 32.0);
    let rows = (0..32).map(|j| (0..64).map(|i| format!("{:.9}", node(64 * j + i))).collect::<Vec<_>>().join(" "));
    put(scratch.path(), "wave.txt", &rows.collect::<Vec<_>>().join("\n"));
    let scene = "name = \"wave\"\n[surface]\nheights = \"wave.txt\"\nunit = \"Å\"\ntouching = \"low-points\"\n\
                 [laboratory]\nlength = \"60 Å\"\nmodulus = \"100 GPa\"\n[load]\npressure = [\"1 GPa\"]\n";
    let scene = put(scratch.path(), "wave.toml", scene);
    let (z, d_c) = (-3.6, 2.8);
    let lattice = |k: usize| [(k % 20) as f64 * 3.0 + 5.0, (k / 20) as f64 * 3.0 - 2.0, -7.2];
    let atoms: Vec<Atom> = (0..200).map(|k| (200 - k, 1, lattice(k), 0.0)).collect();
    let frame = dump(&atoms, [[5.0, 65.0], [-2.0, 28.0], [-9.0, 40.0]], "id type xs ys zs");
    let file = put(scratch.path(), "wall.dump", &frame);
    let found = states(&read(&scene, &[file], &format!("--indenter-z {z} --contact-distance {d_c} --load scene")));
    let gaps = map(scratch.path().join("read/frame-1-site-gap.npy"));
    for (id, gap) in (1..).zip(&gaps) {
        let [x, y, height] = lattice(200 - id);
        let exact = z + wave(x - 5.0, y + 2.0) - height - d_c;
        assert!((gap - exact).abs() < 1e-3, "{id}: {gap} {exact}");
    }
    // Atoms under slopes touch before the surface above them is d_c away.
    let vertical = gaps.iter().filter(|gap| **gap < 0.0).count();
    let contacts = found[0]["contacts"].as_u64().expect("a number") as usize;
    assert!((vertical..vertical + 10).contains(&contacts) && vertical > 5, "{contacts} {vertical}");
    assert_eq!(found[0]["continuum"]["at"], "load");
    assert_eq!(npy::read(&scratch.path().join("read/frame-1-contact.npy")).expect("a map").values.len(), 64 * 32);
}

/// Each is refused in a line that says what is accepted, and nothing is written.
#[test]
fn what_does_not_fit_is_refused() {
    let scratch = tempfile::tempdir().expect("scratch");
    let scene = put(scratch.path(), "own.toml", SURFACE);
    let (atoms, bounds) = other_crystal(5.0, 0.0);
    let good = dump(&atoms, bounds, "id type xs ys zs fz");
    let upside_down: Vec<Atom> = atoms
        .iter()
        .map(|&(id, kind, [x, y, z], f)| (id, kind, [x, y, if kind == 2 { 14.0 - z } else { z }], f))
        .collect();
    let one: Vec<Atom> = atoms.iter().copied().filter(|a| a.1 == 1 || a.0 == 10_000).collect();
    let types = "--indenter-types 2 --contact-distance 2.8";
    let height = "--substrate-types 1 --contact-distance 2.8 --indenter-z";
    let with = |flags: &str| format!("{types} {flags}");
    let cases = [
        (
            good.clone(),
            "--indenter-types 3 --contact-distance 2.8".into(),
            "--indenter-types = 3; accepted: types or elements of timestep 500: 1, 2",
        ),
        (good.clone(), "--indenter-types 1,2 --contact-distance 2.8".into(), "types that leave atoms to the substrate"),
        (
            good.clone(),
            "--indenter-types 2".into(),
            "--contact-distance = not given; accepted: a length from 0.5 to 50 Å",
        ),
        (
            good.clone(),
            "--indenter-types 2 --contact-distance 2.8GPa".into(),
            "--contact-distance = 2.8GPa; accepted: a length",
        ),
        (
            good.clone(),
            "--contact-distance 2.8".into(),
            "--contact-distance = given; accepted: only with --indenter-z or --indenter-types",
        ),
        (good.replace("pp pp ff", "pp ff ff"), with(""), "a box that is not periodic along y"),
        (good.replacen("0 60", "0 61", 1), with(""), "a box of 61.0000 x 60.0000 Å"),
        (good.replace("BOUNDS pp", "BOUNDS xy xz yz pp"), with(""), "a triclinic box"),
        (good.clone(), with("--load fz"), "forces fz of the indenter's atoms that are zero in all frames"),
        (
            dump(&other_crystal(5.0, f64::NAN).0, bounds, "id type xs ys zs fz"),
            with("--load fz"),
            "timestep 500: forces fz of the indenter's atoms that are no numbers",
        ),
        (
            good.clone(),
            "--indenter-types 2 --substrate-types 2 --contact-distance 2.8".into(),
            "--substrate-types = 1, 2; accepted: types that are not those of the indenter",
        ),
        (dump(&atoms, bounds, "id type xs ys zs"), with("--load fz"), "timestep 500: no column fz"),
        (
            good.clone(),
            with("--load scene"),
            "load = 2 loads for 1 frames; accepted: with --load scene a load for each frame",
        ),
        (good.clone(), format!("{height} 5 --load fz"), "--load = fz; accepted: scene, or --indenter-types"),
        (
            dump(&other_crystal(5.0, 1.0).0, bounds, "id type xs ys zs fz"),
            with("--load fz"),
            "laboratory.modulus = not given; accepted: with --load fz the E* of the substrate",
        ),
        (
            good.clone(),
            format!("{height} 5,4"),
            "--indenter-z = 2 heights, 1 frames; accepted: one height for all frames, or one for each",
        ),
        (format!("{good}{good}{good}"), format!("{height} 5,4"), "--indenter-z = 2 heights, more frames"),
        (
            good.clone(),
            format!("{height} -9"),
            "above the indenter's surface; accepted: a substrate below it: --indenter-z",
        ),
        (dump(&upside_down, bounds, "id type xs ys zs"), with(""), "off the scene's surface, whose rms height is"),
        (dump(&one, bounds, "id type xs ys zs"), with(""), "1 lowest atoms of the indenter, one per 60.0 Å x 60.0 Å"),
    ];
    for (text, flags, said) in cases {
        let file = put(scratch.path(), "bad.dump", &text);
        let output = read(&scene, &[file], &flags);
        let message = stderr(&output);
        assert!(message.contains(said), "{flags}: {message}");
        let errors = message.lines().filter(|line| !line.starts_with("warning")).count();
        assert!(output.status.code() == Some(2) && errors == 1, "{flags}: {message}");
        assert!(!scratch.path().join("read").exists(), "{flags}");
    }
}
