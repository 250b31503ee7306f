//! Lines of text in UTF-8, UTF-16 with a byte order mark, or Latin-1.

use crate::files::atomic_file::open_regular;
use asperity_grid::error::{Error, Result};
use std::io::{BufRead, BufReader, Cursor, Read};
use std::path::Path;

/// UTF-8 byte order mark, which some editors write.
pub(super) const BOM: &[u8] = b"\xEF\xBB\xBF";

/// Whether a file starts with the byte order mark of UTF-16.
pub(super) fn is_utf16(start: &[u8]) -> bool {
    start.starts_with(b"\xFF\xFE") || start.starts_with(b"\xFE\xFF")
}

/// Text of UTF-16 with a byte order mark.
fn of_utf16(path: &Path, bytes: &[u8]) -> Result<String> {
    let little = bytes.starts_with(b"\xFF\xFE");
    let (pairs, remainder) = bytes[2..].as_chunks::<2>();
    let words = pairs.iter().map(|b| if little { u16::from_le_bytes(*b) } else { u16::from_be_bytes(*b) });
    let text: Option<String> = char::decode_utf16(words).map(|c| c.ok()).collect();
    text.filter(|_| remainder.is_empty()).ok_or_else(|| Error::format(path, "damaged UTF-16", "whole text"))
}

/// The first bytes of a text file in UTF-8, for the recognition of its kind.
pub(super) fn start_of_text(path: &Path, start: &[u8]) -> String {
    if is_utf16(start) {
        let even = &start[..start.len() & !1];
        return of_utf16(path, even).unwrap_or_default();
    }
    String::from_utf8_lossy(start.strip_prefix(BOM).unwrap_or(start)).into_owned()
}

/// Lines of a text file, read one by one.
pub(super) struct TextLines {
    source: Box<dyn BufRead>,
    path: std::path::PathBuf,
    bytes: Vec<u8>,
    /// Where the next line begins in `bytes`: old programs end lines with a carriage return alone.
    start: usize,
    /// Number of the line that was read last, from 1.
    pub(super) number: usize,
    /// Whether that line ends in a line break.
    pub(super) ended: bool,
}

impl TextLines {
    /// Opens a text file. UTF-16 is decoded as a whole, other text line by line.
    pub(super) fn open(path: &Path) -> Result<Self> {
        let (file, _) = open_regular(path)?;
        let mut source = BufReader::with_capacity(1 << 18, file);
        let start = source.fill_buf().map_err(Error::io("read", path))?;
        let source: Box<dyn BufRead> = if is_utf16(start) {
            let mut bytes = Vec::new();
            source.read_to_end(&mut bytes).map_err(Error::io("read", path))?;
            Box::new(Cursor::new(of_utf16(path, &bytes)?))
        } else {
            if start.starts_with(BOM) {
                source.consume(BOM.len());
            }
            Box::new(source)
        };
        Ok(TextLines { source, path: path.to_path_buf(), bytes: Vec::new(), start: 0, number: 0, ended: true })
    }

    /// Replaces `line` by the next line, without its line break; `false` at the end of the file. A line that is not UTF-8 is Latin-1,
    /// in which instruments write `µ`.
    pub(super) fn next(&mut self, line: &mut String) -> Result<bool> {
        line.clear();
        if self.start == self.bytes.len() {
            self.bytes.clear();
            self.start = 0;
            if self.source.read_until(b'\n', &mut self.bytes).map_err(Error::io("read", &self.path))? == 0 {
                return Ok(false);
            }
        }
        self.number += 1;
        let rest = &self.bytes[self.start..];
        let end = rest.iter().position(|b| matches!(b, b'\n' | b'\r')).unwrap_or(rest.len());
        let (bytes, after) = rest.split_at(end);
        let returns = after.iter().take_while(|b| **b == b'\r').count();
        let breaks = if after.get(returns) == Some(&b'\n') { returns + 1 } else { returns.min(1) };
        self.ended = breaks > 0;
        self.start += end + breaks;
        match std::str::from_utf8(bytes) {
            Ok(text) => line.push_str(text),
            Err(_) => line.extend(bytes.iter().map(|b| char::from(*b))),
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(bytes: &[u8]) -> Result<Vec<String>> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        std::fs::write(&path, bytes).unwrap();
        let mut lines = TextLines::open(&path)?;
        let (mut line, mut all) = (String::new(), Vec::new());
        while lines.next(&mut line)? {
            all.push(line.clone());
        }
        assert_eq!(lines.number, all.len());
        Ok(all)
    }

    #[test]
    fn four_encodings_give_the_same_lines() {
        let text = "# unit: µm\r\n1 2\n3";
        let utf16 = |little: bool| -> Vec<u8> {
            let word = |w: u16| if little { w.to_le_bytes() } else { w.to_be_bytes() };
            std::iter::once(0xFEFF).chain(text.encode_utf16()).flat_map(word).collect()
        };
        let latin: Vec<u8> = text.chars().map(|c| c as u8).collect();
        for bytes in [text.as_bytes().to_vec(), [BOM, text.as_bytes()].concat(), latin, utf16(true), utf16(false)] {
            assert_eq!(lines(&bytes).unwrap(), ["# unit: µm", "1 2", "3"]);
        }
        assert_eq!(lines(b"1 2\r3 4\r\r\n5\n\n6\r").unwrap(), ["1 2", "3 4", "5", "", "6"]);
        let cut = &utf16(true)[..9];
        assert!(lines(cut).unwrap_err().to_string().contains("damaged UTF-16"));
    }
}
