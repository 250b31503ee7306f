//! Reads and writes height maps: `.npy`, ASCII matrices, and blocks of `x y h` lines.
//!
//! An ASCII matrix has one line per y, from y = 0, with the heights along x separated by blanks; `#` starts a comment
//! and blank lines are ignored. The numbers do not determine the sign convention, so the caller states it.
//! [`write()`] stores it in a comment (`# sign: low points touch first`) or, for `NAME.npy`, in `NAME.npy.json`, and
//! [`read`] returns it. Heights are not flipped or shifted unless [`HeightMap::low_first`] is called.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::atomic_file::write_atomic;
pub use super::height_map::{HeightMap, Sign};
use super::{json, npy, xyz_text};
use crate::error::{Error, Result};

/// Sign and unit stated in a file; empty for files from other programs.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Declared {
    pub sign: Option<Sign>,
    pub unit: Option<String>,
}

/// JSON sidecar of a `.npy` height map.
#[derive(Debug, Serialize, Deserialize)]
struct Sidecar {
    nx: usize,
    ny: usize,
    sign: Sign,
    unit: String,
    layout: String,
}

const LAYOUT: &str = "[ny, nx], row = constant y, x fastest";

fn sidecar_path(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_os_string();
    name.push(".json");
    PathBuf::from(name)
}

/// Writes `.npy` (f64, with a JSON sidecar) if the name has this extension, otherwise an ASCII matrix.
///
/// `unit` is a label ("m", "µm", "cell extent in x"). ASCII numbers are read back exactly.
pub fn write(path: &Path, map: &HeightMap, sign: Sign, unit: &str) -> Result<()> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("npy")) {
        npy::write(path, map.nx, map.ny, map.heights.iter().copied())?;
        let sidecar = Sidecar { nx: map.nx, ny: map.ny, sign, unit: unit.to_string(), layout: LAYOUT.to_string() };
        return json::write(&sidecar_path(path), &sidecar);
    }
    write_atomic(path, |w| {
        writeln!(w, "# heights {LAYOUT}; ny = {}, nx = {}", map.ny, map.nx)?;
        writeln!(w, "# sign: {}", sign.words())?;
        writeln!(w, "# unit: {}", unit.replace(['\n', '\r'], " "))?;
        for row in map.heights.chunks_exact(map.nx) {
            for (x, h) in row.iter().enumerate() {
                write!(w, "{}{h:e}", if x == 0 { "" } else { " " })?;
            }
            writeln!(w)?;
        }
        Ok(())
    })
}

/// Reads a `.npy` file, detected by its first bytes, or an ASCII file, with the sign and unit that it states. For
/// other formats see [`super::import`].
///
/// Integers are converted to f64 without scaling.
///
/// # Errors
/// [`Error::Height`] for NaN and infinite heights; [`Error::Format`] for ragged, empty or truncated files.
pub fn read(path: &Path) -> Result<(HeightMap, Declared)> {
    let file = std::fs::File::open(path).map_err(Error::io("open", path))?;
    let mut source = BufReader::with_capacity(1 << 18, file);
    let start = source.fill_buf().map_err(Error::io("read", path))?;
    if start.starts_with(b"\x93NUMPY") {
        return read_npy(path);
    }
    if start.contains(&0) {
        return Err(Error::format(path, "a binary file of a kind that is not known", KINDS));
    }
    if start.starts_with(BOM) {
        source.consume(BOM.len());
    }
    let (map, declared, _) = read_ascii(path, source, false)?;
    Ok((map, declared))
}

/// Accepted formats of height files.
pub(super) const KINDS: &str = "text (a matrix, lines of x y h, or qX qY Re Im), .npy, .npz, HDF5 or NetCDF";

/// UTF-8 byte order mark, which some editors write.
pub(super) const BOM: &[u8] = b"\xEF\xBB\xBF";

/// Error for a line of text that could not be read.
pub(super) fn unread(path: &Path, line: usize, e: std::io::Error) -> Error {
    if e.kind() == std::io::ErrorKind::InvalidData {
        let accepted = "text in UTF-8 or ASCII (iconv -f LATIN1 -t UTF-8 makes it of Latin-1)";
        return Error::format(path, format!("line {line} is not UTF-8"), accepted);
    }
    Error::io("read", path)(e)
}

/// Layout of a text file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Layout {
    Matrix,
    XyzLines,
}

pub(super) fn read_npy(path: &Path) -> Result<(HeightMap, Declared)> {
    let field = npy::read(path)?;
    let map = HeightMap::new(&path.display().to_string(), field.nx, field.ny, field.values)?;
    let sidecar = sidecar_path(path);
    if !sidecar.exists() {
        return Ok((map, Declared::default()));
    }
    let said: Sidecar = json::read(&sidecar)?;
    if (said.nx, said.ny) != (map.nx, map.ny) {
        let found = format!("shape [{}, {}]", said.ny, said.nx);
        return Err(Error::format(sidecar, found, format!("the shape of its field, [{}, {}]", map.ny, map.nx)));
    }
    Ok((map, Declared { sign: Some(said.sign), unit: Some(said.unit) }))
}

/// Splits a line into words separated by blanks or commas.
///
/// # Errors
/// Some words are separated by commas alone and others by blanks alone, as in `1,5 2,5`: these may be decimal commas.
pub(super) fn numbers<'a>(path: &Path, line: usize, text: &'a str) -> Result<impl Iterator<Item = &'a str>> {
    let blanks: Vec<&str> = text.split_whitespace().collect();
    let inside = blanks.iter().any(|w| w.trim_matches(',').contains(','));
    if inside && blanks.windows(2).any(|w| !w[0].ends_with(',') && !w[1].starts_with(',')) {
        let found = format!("commas inside of what blanks set apart, on line {line}");
        return Err(Error::format(path, found, "numbers with points (1.5), apart by blanks or by commas"));
    }
    Ok(text.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty()))
}

/// Reads a text file. With `heights_only` three columns are always heights, never `x y h`.
pub(super) fn read_ascii(
    path: &Path,
    source: impl BufRead,
    heights_only: bool,
) -> Result<(HeightMap, Declared, Layout)> {
    let mut heights = Vec::new();
    let (mut nx, mut ny) = (0, 0);
    let mut declared = Declared::default();
    // Number of lines of each block; blank lines between blocks indicate the `x y h` format.
    let (mut blocks, mut in_block): (Vec<usize>, _) = (Vec::new(), false);
    for (number, line) in (1..).zip(source.lines()) {
        let line = line.map_err(|e| unread(path, number, e))?;
        let (text, comment) = line.split_once('#').map_or((line.as_str(), ""), |(t, c)| (t, c.trim()));
        declared.hear(path, number, comment)?;
        let before = heights.len();
        for (x, word) in numbers(path, number, text)?.enumerate() {
            let h: f64 = word
                .parse()
                .map_err(|_| Error::format(path, format!("{word:?} on line {number}, column {}", x + 1), "a number"))?;
            if !h.is_finite() {
                return Err(Error::Height { place: path.display().to_string(), row: ny, column: x, value: h });
            }
            heights.push(h);
        }
        let found = heights.len() - before;
        if found == 0 {
            in_block &= !line.trim().is_empty();
            continue;
        }
        if !in_block {
            blocks.push(0);
            in_block = true;
        }
        *blocks.last_mut().expect("the one of this line") += 1;
        if nx != 0 && found != nx {
            let found = format!("{found} heights on line {number}");
            return Err(Error::format(path, found, format!("{nx}, as on the lines before (or the file is cut off)")));
        }
        (nx, ny) = (found, ny + 1);
    }
    if ny == 0 {
        return Err(Error::format(path, "no heights", "an ASCII matrix, one line per y"));
    }
    // Lines of `x y h` without blank lines, as instruments write them.
    if nx == 3
        && !heights_only
        && blocks.len() == 1
        && let Some(map) = xyz_text::list(path, &heights)
    {
        return Ok((map?, declared, Layout::XyzLines));
    }
    // Three columns with blank lines are `x y h`, unless `heights_only` is set.
    if nx == 3 && !heights_only && blocks.len() > 1 {
        return Ok((xyz_text::map(path, &heights, &blocks)?, declared, Layout::XyzLines));
    }
    Ok((HeightMap::new(&path.display().to_string(), nx, ny, heights)?, declared, Layout::Matrix))
}

impl Declared {
    /// The stated unit in µm, if it is a known unit of length.
    pub fn unit_um(&self) -> Option<f64> {
        match self.unit.as_deref()?.trim() {
            "m" => Some(1e6),
            "mm" => Some(1e3),
            // Micro sign, and Greek letter mu.
            "um" | "\u{b5}m" | "\u{3bc}m" => Some(1.0),
            "nm" => Some(1e-3),
            _ => None,
        }
    }

    fn hear(&mut self, path: &Path, number: usize, comment: &str) -> Result<()> {
        if let Some(words) = comment.strip_prefix("sign:").map(str::trim) {
            let known = [Sign::LowFirst, Sign::HighFirst].into_iter().find(|s| s.words() == words);
            self.sign = Some(known.ok_or_else(|| {
                let accepted = "low points touch first, or high points touch first";
                Error::format(path, format!("sign {words:?} on line {number}"), accepted)
            })?);
        }
        if let Some(unit) = comment.strip_prefix("unit:") {
            self.unit = Some(unit.trim().to_string());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reads(text: &str) -> Result<(HeightMap, Declared)> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.txt");
        std::fs::write(&path, text).unwrap();
        read(&path)
    }

    fn complaint(text: &str) -> String {
        reads(text).unwrap_err().to_string()
    }

    #[test]
    fn both_formats_come_back_to_the_bit_with_their_sign() {
        let folder = tempfile::tempdir().unwrap();
        let map = HeightMap::new("here", 3, 2, vec![0.1, 1.0 / 3.0, -7e-300, 1e22, 5e-324, 0.0]).unwrap();
        for (name, sign) in [("map.npy", Sign::HighFirst), ("map.txt", Sign::LowFirst)] {
            let path = folder.path().join(name);
            write(&path, &map, sign, "µm").unwrap();
            let (back, declared) = read(&path).unwrap();
            assert_eq!(back, map);
            assert_eq!(declared, Declared { sign: Some(sign), unit: Some("µm".into()) });
        }
    }

    #[test]
    fn a_sidecar_of_another_field_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.npy");
        write(&path, &HeightMap::new("here", 2, 2, vec![0.0; 4]).unwrap(), Sign::LowFirst, "m").unwrap();
        npy::write(&path, 4, 1, [0.0_f64; 4]).unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("map.npy.json: shape [2, 2]"));
    }

    #[test]
    fn ascii_as_people_write_it() {
        let (map, declared) = reads("# a profile\n1 2.5e0\t3 # first\n# between\n  4,5, 6\n").unwrap();
        assert_eq!(map, HeightMap { nx: 3, ny: 2, heights: vec![1.0, 2.5, 3.0, 4.0, 5.0, 6.0] });
        assert_eq!(declared, Declared::default());
        for text in ["1,2\n3,4\n", "1 ,2\n3, 4,\n", "1 2\n3 4\n"] {
            assert_eq!(reads(text).unwrap().0.heights, [1.0, 2.0, 3.0, 4.0], "{text}");
        }
        // Decimal commas are rejected, not read as two numbers.
        for text in ["1,5 2,5\n3,5 4,5\n", "1 2,5\n3 4\n", "1,5\t2\n"] {
            assert!(complaint(text).contains("on line 1; accepted: numbers with points"), "{}", complaint(text));
        }
    }

    /// Blocks of constant y and blocks of constant x give the same map, with rows of constant y.
    #[test]
    fn triples_are_laid_by_their_coordinates() {
        let map = HeightMap { nx: 3, ny: 2, heights: vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0] };
        let rows = "# x y h\n0 0 1\n.5 0 2\n1 0 3\n\n0 .5 4\n.5 .5 5\n1 .5 6\n";
        let columns = "2 7 1\n2 8 4\n \n3 7 2\n3 8 5\n\n4 7 3\n4 8 6\n\n";
        let bare = |text: &str| text.replace("\n \n", "\n").replace("\n\n", "\n");
        for text in [rows, columns, &bare(rows), &bare(columns)] {
            assert_eq!(reads(text).unwrap().0, map, "{text}");
        }
        // Descending x, y or both.
        for text in ["0 1 4\n1 1 5\n2 1 6\n0 0 1\n1 0 2\n2 0 3\n", "2 1 6\n1 1 5\n0 1 4\n\n2 0 3\n1 0 2\n0 0 1\n"] {
            assert_eq!(reads(text).unwrap().0, map, "{text}");
        }
    }

    /// Coordinates slightly off an even grid are an error, not heights; values that form no grid are heights.
    #[test]
    fn three_columns_are_a_matrix_only_where_they_are_no_coordinates() {
        let grid = |skip: usize| -> String {
            (0..12).filter(|i| *i != skip).map(|i| format!("{} {} {}\n", i % 4, i / 4, i * i % 7)).collect()
        };
        assert_eq!(reads(&grid(12)).unwrap().0.nx, 4);
        for (text, says) in [
            ("0 0 1\n0 1 2\n0 3 1\n1 0 1\n".to_string(), "1 lines in block 2 and 3 in the first"),
            (grid(11), "3 lines in block 3 and 4 in the first"),
            (grid(5), "3 lines in block 2"),
            (grid(12).replace("2 1 ", "2.2 1 "), "x = 2.2e0"),
            ("0 0 1\n1 1 2\n1 0 2\n0 1 4\n".into(), "neither stays"),
        ] {
            let told = complaint(&text);
            assert!(told.contains(says) && told.contains("--fourier none"), "{told}");
        }
        let heights = ["1 2 3\n4 5 6\n", "0 0 1\n0 0 2\n0 1 1\n1 0 1\n", "1 5 2\n3 4 8\n2 2 1\n5 9 2\n7 1 1\n"];
        for text in heights {
            assert_eq!(reads(text).unwrap().0.nx, 3, "{text}");
        }
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        assert!(complaint("1 2\n3\n").contains("1 heights on line 2; accepted: 2"));
        assert!(complaint("# nothing\n\n").contains("no heights"));
        assert!(complaint("1 2\n3 oak\n").contains("\"oak\" on line 2, column 2"));
        assert!(complaint("# sign: both\n1 2\n").contains("line 1"));
        for (text, says) in [
            ("0 0 1\n1 0 2\n\n0 1 3\n", "1 lines in block 2 and 2 in the first"),
            ("0 0 1\n1 0 2\n\n0 2 3\n1 2 4\n", "accepted: the same spacing along x and y"),
            ("1 0 1\n0 0 2\n\n1 0 3\n0 0 4\n", "coordinates that stay"),
            (
                "0 0 1\n1 0 2\n2 0 0\n\n0 1 3\n1.5 1 4\n2 1 0\n",
                "x = 1.5e0, y = 1e0 in line 2 of block 2; accepted: 1e0 and 1e0",
            ),
            ("0 0 1\n\n0 1 3\n", "2 blocks of 1 lines"),
        ] {
            assert!(complaint(text).contains(says), "{}", complaint(text));
        }
        assert!(complaint("1 2\0\n").contains("binary"));
        assert!(
            complaint("1 1e308\n-1e308 0\n").contains("heights from -1e308 to 1e308; accepted: heights whose range")
        );
        assert_eq!(reads("\u{feff}1 2\n3 4\n").unwrap().0.heights, [1.0, 2.0, 3.0, 4.0]);
        match reads("1 2\n\n3 nan\n") {
            Err(Error::Height { row: 1, column: 1, value, .. }) => assert!(value.is_nan()),
            other => panic!("{other:?}"),
        }
        assert!(matches!(reads("1 -inf\n"), Err(Error::Height { row: 0, column: 1, .. })));
    }
}
