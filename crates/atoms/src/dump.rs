//! Reads LAMMPS text dumps frame by frame.
//!
//! The headers of the file determine its format: columns in any order; wrapped, unwrapped or scaled coordinates;
//! types or element names; forces along z; any number of frames; plain text, gzip or zstd. Image flags are ignored, because the cell
//! is periodic in x and y. Any other format is an error.

use std::collections::HashMap;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use flate2::bufread::MultiGzDecoder;

use asperity_grid::{Error, Result};
use asperity_surface::files::atomic_file::open_regular;

/// Limit of the line length, so that a file without line ends is not read into memory as a whole.
const MAX_LINE_BYTES: u64 = 64 * 1024;

/// Limit of the number of atoms for which memory is allocated before they are read: a damaged header may state any
/// number.
const MAX_PROMISE: usize = 1 << 20;

/// Types of a dump whose elements are remembered.
const MAX_NAMED_TYPES: usize = 1 << 12;

/// First bytes of compressed files.
const ZSTD: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];
const GZIP: [u8; 2] = [0x1f, 0x8b];

/// LAMMPS unit systems with lengths in Å, and their units of force, eV/Å. A dump that names none is taken to be the first.
const UNITS_IN_ANGSTROM: [(&str, f64); 2] = [("metal", 1.0), ("real", 0.043_364_104)];

/// One frame; atoms in ascending order of their ids.
#[derive(Debug, Clone, PartialEq)]
pub struct DumpFrame {
    /// File of the frame, for messages.
    pub source: PathBuf,
    pub timestep: u64,
    /// `ITEM: TIME`, in the units of the run.
    pub time: Option<f64>,
    /// Lower and upper bound per axis, Å.
    pub bounds: [[f64; 2]; 3],
    pub periodic: [bool; 3],
    /// Ascending and unique.
    pub ids: Vec<u32>,
    /// Type number, or index into `elements`; empty if the dump has neither column.
    pub species: Vec<u32>,
    /// Whether the dump has types.
    pub has_types: bool,
    /// Element names, if the dump has them: of the types, empty for those that do not appear, or without types in order of appearance.
    pub elements: Vec<String>,
    /// Unwrapped positions as in the file, Å.
    pub positions: Vec<[f64; 3]>,
    /// Forces along z, eV/Å; empty if the dump has no column `fz`, NaN where that is no number.
    pub forces_z: Vec<f64>,
    /// Whether the file names its units.
    pub has_units: bool,
}

impl DumpFrame {
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// Element of atoms of this species, if the dump has element names.
    pub fn element(&self, species: u32) -> Option<&str> {
        self.elements.get(species as usize).map(String::as_str).filter(|name| !name.is_empty())
    }

    /// Position of an atom, Å; `None` if it is not in the frame.
    pub fn position(&self, id: u32) -> Option<[f64; 3]> {
        self.ids.binary_search(&id).ok().map(|k| self.positions[k])
    }

    pub fn length(&self, axis: usize) -> f64 {
        self.bounds[axis][1] - self.bounds[axis][0]
    }

    /// The element of a type. Types beyond those of any run keep their numbers.
    fn name_type(&mut self, species: u32, name: &str) {
        let index = species as usize;
        if index >= MAX_NAMED_TYPES {
            return;
        }
        if self.elements.len() <= index {
            self.elements.resize(index + 1, String::new());
        }
        if self.elements[index].is_empty() {
            self.elements[index] = name.to_owned();
        }
    }

    /// Keeps the atoms of these indices, in their order.
    fn pick(&mut self, order: &[usize]) {
        fn picked<T: Copy>(column: &mut Vec<T>, order: &[usize]) {
            if !column.is_empty() {
                *column = order.iter().map(|&k| column[k]).collect();
            }
        }
        picked(&mut self.ids, order);
        picked(&mut self.species, order);
        picked(&mut self.positions, order);
        picked(&mut self.forces_z, order);
    }

    /// Keeps the atoms with these ids.
    pub fn retain(&mut self, keep: impl Fn(u32) -> bool) {
        let order: Vec<usize> = (0..self.len()).filter(|&k| keep(self.ids[k])).collect();
        self.pick(&order);
    }
}

/// Iterator over the frames of a dump. It ends after the first error.
pub struct DumpReader {
    source: PathBuf,
    input: Box<dyn BufRead>,
    line: Vec<u8>,
    line_number: u64,
    truncated: bool,
    finished: bool,
    /// Of the units that the file names, which LAMMPS does before its first frame only.
    force_unit: Option<f64>,
}

impl DumpReader {
    /// Opens a dump; the compression is detected from the first bytes.
    ///
    /// # Errors
    /// `Io` when the file cannot be opened, `Format` for a binary dump.
    pub fn open(file: impl AsRef<Path>) -> Result<Self> {
        let file = file.as_ref();
        let (handle, _) = open_regular(file)?;
        let mut raw = BufReader::new(handle);
        let start = raw.fill_buf().map_err(Error::io("read", file))?;
        if start.starts_with(&ZSTD) {
            let decoder = zstd::Decoder::with_buffer(raw).map_err(Error::io("decompress", file))?;
            return Ok(Self::new(Box::new(BufReader::new(decoder)), file));
        }
        if start.starts_with(&GZIP) {
            // LAMMPS appends to a gzip file by adding members.
            return Ok(Self::new(Box::new(BufReader::new(MultiGzDecoder::new(raw))), file));
        }
        if start.contains(&0) {
            return Err(Error::format(file, "a binary dump", "text, plain or compressed with gzip or zstd"));
        }
        Ok(Self::new(Box::new(raw), file))
    }

    pub fn new(input: Box<dyn BufRead>, source: impl AsRef<Path>) -> Self {
        let source = source.as_ref().to_path_buf();
        DumpReader {
            source,
            input,
            line: Vec::new(),
            line_number: 0,
            truncated: false,
            finished: false,
            force_unit: None,
        }
    }

    /// Whether the file ended inside a frame; the frames before it are complete.
    pub fn truncated(&self) -> bool {
        self.truncated
    }

    /// The next frame, `None` after the last.
    ///
    /// # Errors
    /// `Format`, with the line number, for a damaged, non-orthogonal or truncated frame.
    pub fn next_frame(&mut self) -> Result<Option<DumpFrame>> {
        if self.finished {
            return Ok(None);
        }
        let frame = self.read_frame();
        self.finished = !matches!(frame, Ok(Some(_)));
        frame
    }

    fn read_frame(&mut self) -> Result<Option<DumpFrame>> {
        let (mut timestep, mut time, mut count, mut bounds) = (None, None, None, None);
        let mut start = false;
        loop {
            if !self.read_line()? {
                return if start { Err(self.cut("in its header".into())) } else { Ok(None) };
            }
            let line = self.text()?.to_owned();
            let Some(item) = line.strip_prefix("ITEM: ") else {
                if line.trim().is_empty() && !start {
                    continue;
                }
                return Err(self.bad(&line, "a line that starts with 'ITEM: '"));
            };
            start = true;
            if item.starts_with("UNITS") {
                let units = self.header_line()?;
                let known = UNITS_IN_ANGSTROM.iter().find(|(name, _)| *name == units.trim());
                let accepted = "units metal or real, whose lengths are in angstrom";
                let (_, force) = known.ok_or_else(|| self.bad(&format!("units {units}"), accepted))?;
                self.force_unit = Some(*force);
            } else if item.starts_with("TIMESTEP") {
                timestep = Some(self.header_value::<u64>("a timestep")?);
            } else if item.starts_with("TIME") {
                time = Some(self.header_value::<f64>("a time")?);
            } else if item.starts_with("NUMBER OF ATOMS") {
                count = Some(self.header_value::<usize>("a number of atoms")?);
            } else if let Some(tokens) = item.strip_prefix("BOX BOUNDS") {
                bounds = Some(self.read_bounds(tokens)?);
            } else if let Some(tokens) = item.strip_prefix("ATOMS") {
                let (Some(timestep), Some(count), Some((bounds, periodic))) = (timestep, count, bounds) else {
                    return Err(self.bad(&line, "TIMESTEP, NUMBER OF ATOMS and BOX BOUNDS before ATOMS"));
                };
                let columns = self.columns(tokens)?;
                let mut frame = DumpFrame {
                    source: self.source.clone(),
                    timestep,
                    time,
                    bounds,
                    periodic,
                    ids: Vec::with_capacity(count.min(MAX_PROMISE)),
                    species: Vec::new(),
                    has_types: columns.types.is_some(),
                    elements: Vec::new(),
                    positions: Vec::with_capacity(count.min(MAX_PROMISE)),
                    forces_z: Vec::new(),
                    has_units: self.force_unit.is_some(),
                };
                self.read_atoms(&columns, count, &mut frame)?;
                let unit = self.force_unit.unwrap_or(UNITS_IN_ANGSTROM[0].1);
                frame.forces_z.iter_mut().for_each(|f| *f *= unit);
                return self.sorted(frame).map(Some);
            } else {
                return Err(self.bad(&line, "UNITS, TIME, TIMESTEP, NUMBER OF ATOMS, BOX BOUNDS or ATOMS"));
            }
        }
    }

    fn read_bounds(&mut self, tokens: &str) -> Result<([[f64; 2]; 3], [bool; 3])> {
        let tokens: Vec<&str> = tokens.split_whitespace().collect();
        if tokens.iter().any(|w| matches!(*w, "xy" | "abc" | "origin")) {
            return Err(self.bad("a triclinic box", "an orthogonal box, which a flat contact needs"));
        }
        let mut periodic = [false; 3];
        for (axis, flag) in periodic.iter_mut().enumerate() {
            *flag = tokens.get(axis).is_some_and(|w| *w == "pp");
        }
        let mut bounds = [[0.0; 2]; 3];
        for pair in &mut bounds {
            let line = self.header_line()?;
            let values: Vec<f64> = line.split_whitespace().map_while(|w| w.parse().ok()).collect();
            match values[..] {
                [low, high] if low.is_finite() && high.is_finite() && low < high => *pair = [low, high],
                _ => return Err(self.bad(&line, "two finite numbers, the lower bound first")),
            }
        }
        Ok((bounds, periodic))
    }

    fn columns(&self, tokens: &str) -> Result<DumpColumns> {
        let names: Vec<&str> = tokens.split_whitespace().collect();
        let find = |name: &str| names.iter().position(|n| *n == name);
        let id = find("id").ok_or_else(|| self.bad(tokens, "an id column"))?;
        let mut axes = [PositionColumn { column: 0, scaled: false }; 3];
        for (axis, letter) in axes.iter_mut().zip(["x", "y", "z"]) {
            let choices = [("", false), ("u", false), ("s", true), ("su", true)];
            let positions = choices.iter().find_map(|(end, scaled)| {
                Some(PositionColumn { column: find(&format!("{letter}{end}"))?, scaled: *scaled })
            });
            *axis = positions
                .ok_or_else(|| self.bad(tokens, &format!("a column {letter}, {letter}u, {letter}s or {letter}su")))?;
        }
        let (types, elements) = (find("type"), find("element"));
        Ok(DumpColumns { count: names.len(), id, axes, types, elements, force_z: find("fz") })
    }

    fn read_atoms(&mut self, columns: &DumpColumns, count: usize, frame: &mut DumpFrame) -> Result<()> {
        let mut names: HashMap<String, u32> = HashMap::new();
        for finished in 0..count {
            let end = |timestep| format!("(timestep {timestep}) after {finished} of {count} atoms");
            // A last line without a line end may be truncated within a number.
            if !self.read_line()? || self.line.last() != Some(&b'\n') {
                return Err(self.cut(end(frame.timestep)));
            }
            let line = self.text()?;
            let tokens: Vec<&str> = line.split_whitespace().collect();
            if tokens.len() < columns.count {
                let line = line.to_owned();
                return Err(self.bad(&line, &format!("{} columns", columns.count)));
            }
            let id = tokens[columns.id].parse::<u32>().ok().filter(|id| *id > 0);
            let mut position = [0.0; 3];
            let mut good = id.is_some();
            for (axis, place) in columns.axes.iter().enumerate() {
                let value: f64 = tokens[place.column].parse().unwrap_or(f64::NAN);
                let [low, high] = frame.bounds[axis];
                position[axis] = if place.scaled { low + value * (high - low) } else { value };
                good &= position[axis].is_finite();
            }
            let species = match (columns.types, columns.elements) {
                (None, None) => Some(None),
                (Some(types), elements) => {
                    let species = tokens[types].parse::<u32>().ok();
                    if let Some((species, column)) = species.zip(elements) {
                        frame.name_type(species, tokens[column]);
                    }
                    species.map(Some)
                }
                (None, Some(column)) => {
                    let next = names.len() as u32;
                    let name = tokens[column];
                    let index = *names.entry(name.to_owned()).or_insert_with(|| {
                        frame.elements.push(name.to_owned());
                        next
                    });
                    Some(Some(index))
                }
            };
            let force_z = columns.force_z.map(|column| tokens[column].parse().unwrap_or(f64::NAN));
            match (id, species) {
                (Some(id), Some(species)) if good => {
                    frame.ids.push(id);
                    frame.positions.push(position);
                    frame.species.extend(species);
                    frame.forces_z.extend(force_z);
                }
                _ => {
                    let line = line.to_owned();
                    return Err(self.bad(&line, "a positive id, a type, finite coordinates"));
                }
            }
        }
        Ok(())
    }

    fn sorted(&self, mut frame: DumpFrame) -> Result<DumpFrame> {
        if !frame.ids.is_sorted() {
            let mut order: Vec<usize> = (0..frame.len()).collect();
            order.sort_by_key(|&k| frame.ids[k]);
            frame.pick(&order);
        }
        match frame.ids.windows(2).find(|pair| pair[0] == pair[1]) {
            Some(pair) => Err(self.bad(&format!("atom {} twice in one frame", pair[0]), "every id once")),
            None => Ok(frame),
        }
    }

    fn header_value<T: std::str::FromStr>(&mut self, description: &str) -> Result<T> {
        let line = self.header_line()?;
        line.trim().parse().map_err(|_| self.bad(&line, description))
    }

    fn header_line(&mut self) -> Result<String> {
        if !self.read_line()? {
            return Err(self.cut("in its header".into()));
        }
        self.text().map(str::to_owned)
    }

    /// Reads a line; false at the end of the file.
    fn read_line(&mut self) -> Result<bool> {
        self.line.clear();
        let read = self.input.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', &mut self.line);
        match read {
            Ok(bytes) => {
                self.line_number += 1;
                if bytes as u64 == MAX_LINE_BYTES && self.line.last() != Some(&b'\n') {
                    return Err(self.bad("a line without an end", "a text dump"));
                }
                Ok(bytes > 0)
            }
            // Both decoders report a truncated file by this kind.
            Err(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
                Err(self.cut("inside its compressed data".into()))
            }
            Err(e) => Err(Error::io("read", &self.source)(e)),
        }
    }

    fn text(&self) -> Result<&str> {
        std::str::from_utf8(&self.line)
            .map(|t| t.trim_end_matches(['\n', '\r']))
            .map_err(|_| self.bad("bytes that are not text", "a text dump"))
    }

    fn cut(&mut self, place: String) -> Error {
        self.truncated = true;
        Error::format(&self.source, format!("the last frame ends {place}"), "complete frames")
    }

    fn bad(&self, found: &str, accepted: &str) -> Error {
        let found: String = found.chars().take(120).collect();
        Error::format(&self.source, format!("line {}: {}", self.line_number, found.trim()), accepted)
    }
}

impl Iterator for DumpReader {
    type Item = Result<DumpFrame>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_frame().transpose()
    }
}

/// Reads a file with a single frame.
///
/// # Errors
/// As [`DumpReader`]; `Format` when there is no frame.
pub fn read_frame(file: impl AsRef<Path>) -> Result<DumpFrame> {
    let file = file.as_ref();
    DumpReader::open(file)?.next_frame()?.ok_or_else(|| Error::format(file, "no frame", "a LAMMPS text dump"))
}

#[derive(Clone, Copy)]
struct PositionColumn {
    column: usize,
    scaled: bool,
}

struct DumpColumns {
    count: usize,
    id: usize,
    axes: [PositionColumn; 3],
    types: Option<usize>,
    elements: Option<usize>,
    force_z: Option<usize>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    const PLAIN: &str = "ITEM: TIMESTEP\n7\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS pp pp ff\n0 10\n-5 15\n0.0e+00 4.0e+01\n\
                         ITEM: ATOMS id type x y z\n2 1 1.5 -0.25 3\n1 3 1 2 3.5e+00\n";

    fn reader(text: impl Into<Vec<u8>>) -> DumpReader {
        DumpReader::new(Box::new(Cursor::new(text.into())), "test.dump")
    }

    fn all(text: &str) -> Result<Vec<DumpFrame>> {
        reader(text).collect()
    }

    fn unavailable_reason(text: &str) -> String {
        all(text).expect_err("refused").to_string()
    }

    #[test]
    fn unsorted_ids_are_sorted() {
        let frames = all(PLAIN).expect("good");
        assert_eq!(frames.len(), 1);
        let f = &frames[0];
        assert_eq!((f.timestep, &f.ids[..], &f.species[..]), (7, &[1, 2][..], &[3, 1][..]));
        assert_eq!(f.position(2), Some([1.5, -0.25, 3.0]));
        assert_eq!(f.position(3), None);
        assert_eq!(f.bounds, [[0.0, 10.0], [-5.0, 15.0], [0.0, 40.0]]);
        assert_eq!(f.periodic, [true, true, false]);
    }

    #[test]
    fn columns_are_found_by_name() {
        let text = "ITEM: UNITS\nmetal\nITEM: TIME\n0.25\nITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n2\n\
                    ITEM: BOX BOUNDS pp pp ff\n0 10\n-5 15\n0 40\n\
                    ITEM: ATOMS iz zsu element ys ix id xu\n0 0.5 Ca 0.25 1 4 12.5\n0 0.25 X -0.1 0 3 1\n";
        let f = &all(text).expect("good")[0];
        assert_eq!(f.time, Some(0.25));
        assert_eq!(f.positions, vec![[1.0, -7.0, 10.0], [12.5, 0.0, 20.0]]);
        assert_eq!((&f.elements[..], &f.species[..]), (&["Ca".to_string(), "X".to_string()][..], &[1, 0][..]));
    }

    #[test]
    fn several_frames_and_windows_line_ends() {
        let twice = format!("{PLAIN}{PLAIN}").replace('\n', "\r\n");
        assert_eq!(all(&twice).expect("good").len(), 2);
        assert!(all("").expect("empty").is_empty());
    }

    #[test]
    fn a_truncated_dump_is_refused_wherever_it_ends() {
        let text = format!("{PLAIN}{PLAIN}");
        for cut in PLAIN.len() + 1..text.len() {
            let mut reader = reader(&text.as_bytes()[..cut]);
            assert!(reader.next_frame().expect("first").is_some(), "cut at {cut}");
            assert!(reader.next_frame().is_err(), "cut at {cut}");
            assert!(reader.next_frame().expect("ended").is_none());
            if cut > PLAIN.len() + 130 {
                assert!(reader.truncated(), "cut at {cut}");
            }
        }
        let short = reader(&PLAIN.as_bytes()[..PLAIN.len() - 5]).next_frame().expect_err("cut");
        assert!(short.to_string().contains("(timestep 7) after 1 of 2 atoms"), "{short}");
    }

    #[test]
    fn what_cannot_be_read_faithfully_is_refused() {
        let bad = |from: &str, to: &str| unavailable_reason(&PLAIN.replacen(from, to, 1));
        assert!(bad("pp pp ff\n0 10", "xy xz yz pp pp ff\n0 10 0").contains("triclinic"));
        assert!(bad("pp pp ff\n0 10", "abc origin pp pp ff\n0 10 0 0").contains("triclinic"));
        assert!(bad("3.5e+00", "nan").contains("line 11"));
        assert!(bad("3.5e+00", "-inf").contains("finite"));
        assert!(bad("3.5e+00", "").contains("5 columns"));
        assert!(bad("ATOMS id", "ATOMS tag").contains("id column"));
        assert!(bad(" y z", " y q").contains("a column z, zu, zs or zsu"));
        assert!(bad("2 1 1.5", "1 1 1.5").contains("atom 1 twice"));
        assert!(bad("2 1 1.5", "-2 1 1.5").contains("positive id"));
        assert!(bad("2 1 1.5", "2 Ca 1.5").contains("a type"));
        assert!(bad("0 10", "10 0").contains("lower bound first"));
        assert!(bad("ITEM: NUMBER OF ATOMS\n2", "ITEM: NUMBER OF ATOMS\n-2").contains("number of atoms"));
        assert!(bad("ITEM: NUMBER OF ATOMS\n2\n", "").contains("before ATOMS"));
        assert!(bad("ITEM: TIMESTEP", "ITEM: GRID").contains("line 1"));
        assert!(unavailable_reason("units metal\n").contains("line 1"));
        assert!(reader(vec![b'x'; 200_000]).next_frame().is_err());
        assert!(reader(vec![0xff, 0xfe, b'\n']).next_frame().is_err());
        // More atoms stated than memory can store.
        assert!(bad("ATOMS\n2\n", "ATOMS\n9000000000000000\n").contains("after 2 of"));
    }

    #[test]
    fn zstd_is_read_and_a_cut_one_reported() {
        let folder = tempfile::tempdir().expect("scratch");
        let file = folder.path().join("frame.dump.zst");
        let bytes = zstd::encode_all(PLAIN.as_bytes(), 3).expect("compressed");
        std::fs::write(&file, &bytes).expect("written");
        assert_eq!(read_frame(&file).expect("good").len(), 2);
        std::fs::write(&file, &bytes[..bytes.len() / 2]).expect("written");
        let mut reader = DumpReader::open(&file).expect("opened");
        assert!(reader.next_frame().is_err() && reader.truncated());
        assert!(DumpReader::open(folder.path().join("none.dump")).is_err());
    }
}
