//! Input files and the text that is quoted from them.

use asperity_grid::error::{Error, Result};
use std::path::Path;

/// First bytes of a zip archive, which `.npz` and x3p are.
pub(super) const ARCHIVE: &[u8] = b"PK\x03\x04";

/// Longest quotation of a file in a message, in characters.
const QUOTED: usize = 60;

/// Packed data that unfold beyond this size, in bytes, are checked against [`LARGEST_RATIO`].
pub(super) const SMALL: u64 = 64 << 20;

/// Largest accepted ratio of unfolded to stored bytes. Measured and synthesised heights are packed to a third at best; deflate reaches
/// 1032 for zeros, and an HDF5 data set that was never written has no bound.
pub(super) const LARGEST_RATIO: u64 = 100;

/// Refuses an array that claims far more numbers than the file has bytes for, before memory is allocated.
pub(super) fn check_ratio(path: &Path, name: &str, unfolded: u64, stored_bytes: u64) -> Result<()> {
    if unfolded <= SMALL || unfolded / LARGEST_RATIO <= stored_bytes {
        return Ok(());
    }
    let found = format!("array {} of {unfolded} bytes, stored in {stored_bytes}", quoted(name));
    let accepted = format!("at most {LARGEST_RATIO} times the stored bytes: store a height map without compression");
    Err(Error::format(path, found, accepted))
}

/// A word of a file for a message: in quotation marks, cut to 60 characters, control characters escaped.
pub(super) fn quoted(word: &str) -> String {
    format!("{:?}", cut(word, QUOTED))
}

/// A name that was requested of a file that has none.
pub(super) fn without_names(path: &Path, name: &str) -> Error {
    let found = format!("--dataset (surface.dataset) = {} for a file without names", quoted(name));
    Error::format(path, found, "the name only with a file that names its channels or arrays")
}

/// Names of arrays or channels for a message; at most ten.
pub(super) fn list(names: &[String]) -> String {
    const MOST: usize = 10;
    let mut words: Vec<String> = names.iter().take(MOST).map(|n| plain(n, QUOTED)).collect();
    if names.len() > MOST {
        words.push(format!("and {} more", names.len() - MOST));
    }
    words.join(", ")
}

/// Text of a file for one line of output: at most `longest` characters; control characters and marks of writing direction are escaped.
pub(super) fn plain(text: &str, longest: usize) -> String {
    let hidden = |c: char| {
        c.is_control() || matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    let escape = |c: char| if hidden(c) { c.escape_default().to_string() } else { c.to_string() };
    cut(text, longest).chars().map(escape).collect()
}

fn cut(text: &str, longest: usize) -> String {
    match text.char_indices().nth(longest) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotations_are_short_and_harmless() {
        assert_eq!(quoted("oak"), "\"oak\"");
        assert_eq!(quoted("\u{1b}[2J"), "\"\\u{1b}[2J\"");
        assert_eq!(plain("a\nb\u{202e}c", 99), "a\\nb\\u{202e}c");
        assert_eq!(quoted(&"9".repeat(900)).chars().count(), QUOTED + 3);
        assert_eq!(list(&vec!["a".to_string(); 12]), "a, a, a, a, a, a, a, a, a, a, and 2 more");
    }

    #[test]
    fn claims_without_bytes_are_refused() {
        let path = Path::new("a.npz");
        assert!(check_ratio(path, "a", SMALL, 0).is_ok() && check_ratio(path, "a", 1 << 30, 1 << 24).is_ok());
        let said = check_ratio(path, "a", 1 << 30, 875_000).unwrap_err().to_string();
        assert!(said.contains("1073741824 bytes, stored in 875000"), "{said}");
    }
}
