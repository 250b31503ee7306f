//! Numbers on a line of text: what separates them, decimal commas, and signs of missing heights.

use super::halves::CommaHalves;
use super::marks::{infinity, is_missing};
use super::source::quoted;
use asperity_grid::error::{Error, Result};
use std::path::Path;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Separator {
    Blank,
    Tab,
    Comma,
    Semicolon,
}

/// Whether blanks inside a field separate numbers; words may have blanks (`height [nm]`).
fn has_numbers_apart(field: &str) -> bool {
    field.trim().contains(char::is_whitespace)
        && field.split_whitespace().all(|w| w.parse::<f64>().is_ok() || is_missing(w))
}

/// Splits a line into its fields. Semicolons separate before commas, commas before tabs and blanks, unless the commas are inside of what
/// blanks separate on both sides (`1,5 2,5`): then they are decimal commas. Between quotation marks nothing separates. A last separator
/// without a field is ignored.
pub(super) fn split(line: &str) -> (Vec<&str>, Separator) {
    let line = line.trim_matches(|c: char| c.is_whitespace() && c != '\t');
    for (separator, kind) in [(';', Separator::Semicolon), (',', Separator::Comma), ('\t', Separator::Tab)] {
        if !line.contains(separator) {
            continue;
        }
        let fields = unquoted(line, separator);
        if fields.len() == 1 || kind == Separator::Comma && are_decimal(line) {
            continue;
        }
        if kind != Separator::Semicolon && fields.iter().any(|f| has_numbers_apart(f)) {
            if kind == Separator::Tab {
                break;
            }
            return (line.split([',', ' ', '\t']).filter(|w| !w.is_empty()).collect(), kind);
        }
        return (closed(fields), kind);
    }
    (line.split_whitespace().collect(), Separator::Blank)
}

/// Whether commas are inside of what blanks separate on both sides.
fn are_decimal(line: &str) -> bool {
    let tokens: Vec<&str> = line.split_whitespace().collect();
    let inside = tokens.iter().any(|w| w.trim_matches(',').contains(','));
    let blank_between = tokens.windows(2).any(|w| !w[0].ends_with(',') && !w[1].starts_with(','));
    let begins = |w: &&str| w.starts_with(|c: char| c.is_ascii_digit() || "+-.,".contains(c)) || is_missing(w);
    inside && blank_between && tokens.iter().all(begins)
}

/// The parts of a line between separators that are outside of quotation marks.
fn unquoted(line: &str, separator: char) -> Vec<&str> {
    let mut quoted = false;
    let outside = |c: char| {
        quoted ^= c == '"';
        c == separator && !quoted
    };
    line.split(outside).collect()
}

/// Fields without blanks and quotation marks around them, and without an empty last one.
fn closed(fields: Vec<&str>) -> Vec<&str> {
    let mut fields: Vec<&str> = fields.into_iter().map(|f| f.trim().trim_matches('"').trim()).collect();
    fields.pop_if(|last| last.is_empty());
    fields
}

/// How the numbers of a file are written, as far as it was read.
#[derive(Debug, Default)]
pub(super) struct Notation {
    points: bool,
    /// First number with a decimal comma, and its line.
    comma: Option<(String, usize)>,
    /// Whether a comma cannot separate thousands.
    decimal: bool,
    /// Of whole rows, and of rows without their first field, which may be a label.
    halves: [CommaHalves; 2],
}

impl Notation {
    /// The number of a field; NaN for a missing height; `None` if it is neither.
    pub(super) fn number(&mut self, field: &str, line: usize) -> Option<f64> {
        if let Ok(value) = field.parse() {
            self.points |= field.contains('.');
            return Some(value);
        }
        if let Some((whole, fraction)) = field.split_once(',')
            && !fraction.contains([',', '.', '+'])
            && !whole.contains('.')
            && let Ok(value) = format!("{whole}.{fraction}").parse()
        {
            let digits = whole.trim_start_matches(['-', '+']);
            let thousands = (1..=3).contains(&digits.len()) && !digits.starts_with('0') && fraction.len() == 3;
            self.decimal |= !thousands;
            self.comma.get_or_insert_with(|| (field.to_string(), line));
            return Some(value);
        }
        // Fortran writes double precision with the exponent letter D.
        if let Some((mantissa, exponent)) = field.split_once(['D', 'd'])
            && let (Ok(_), Ok(_)) = (mantissa.parse::<f64>(), exponent.parse::<i32>())
        {
            self.points = true;
            return format!("{mantissa}e{exponent}").parse().ok();
        }
        // The typographic minus sign.
        if field.contains('\u{2212}') {
            return self.number(&field.replace('\u{2212}', "-"), line);
        }
        infinity(field).or(is_missing(field).then_some(f64::NAN))
    }

    /// Takes in a whole row.
    pub(super) fn row(&mut self, fields: &[&str], separator: Separator, line: usize) {
        if separator == Separator::Comma {
            self.halves.iter_mut().enumerate().for_each(|(k, halves)| halves.row(&fields[k.min(fields.len())..], line));
        }
    }

    /// A warning where commas may be decimal.
    ///
    /// # Errors
    /// Decimal points and decimal commas in one file; commas that may separate thousands, or may be decimal between separating ones.
    pub(super) fn check(&self, path: &Path) -> Result<Option<String>> {
        let halves = || Ok(self.halves[0].check(path)?.or(self.halves[1].check(path)?));
        let Some((word, line)) = &self.comma else { return halves() };
        let separators = match (self.points, self.decimal) {
            (true, _) => format!("{} on line {line} and decimal points elsewhere", quoted(word)),
            (_, false) => format!("{} on line {line}, a decimal comma or a separator of thousands", quoted(word)),
            _ => return halves(),
        };
        let accepted = "numbers with decimal points (1.5), apart by blanks, tabs, commas or semicolons";
        Err(Error::format(path, separators, accepted))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of one line; NaN is printed as such.
    fn numbers(line: &str) -> Option<Vec<String>> {
        let mut notation = Notation::default();
        let (fields, _) = split(line);
        fields.iter().map(|f| Some(notation.number(f, 1)?.to_string())).collect()
    }

    #[test]
    fn separators_are_recognised() {
        for (line, expected) in [
            ("1 2.5e0\t3", "1 2.5 3"),
            ("  4,5, 6", "4 5 6"),
            ("1 ,2", "1 2"),
            ("3, 4,", "3 4"),
            ("1 2, 3 4", "1 2 3 4"),
            ("1,5 2,5", "1.5 2.5"),
            ("1,5\t2", "1.5 2"),
            ("1,5;2;-0,25", "1.5 2 -0.25"),
            ("1,5; ;2", "1.5 NaN 2"),
            ("1,,3", "1 NaN 3"),
            ("1\t\t3", "1 NaN 3"),
            ("\"1,5\";\"2\"", "1.5 2"),
            ("1 *** bad N/A --", "1 NaN NaN NaN NaN"),
            ("1.5D+02 2d0", "150 2"),
            ("1e3\t2\t", "1000 2"),
            ("1 2\t3 4", "1 2 3 4"),
            ("1,5 NaN 2,5", "1.5 NaN 2.5"),
            ("\"26,33\",\"-53,4\"", "26.33 -53.4"),
            ("\u{2212}1.5 2 \u{2212}3", "-1.5 2 -3"),
            ("1.#QNAN 2 1.#INF", "NaN 2 inf"),
            ("1,2,#N/A", "1 2 NaN"),
        ] {
            assert_eq!(numbers(line).expect(line).join(" "), expected, "{line}");
        }
        for line in ["1 oak", "1.234,5 2", "1,2,3 4,5,6"] {
            assert_eq!(numbers(line), None, "{line}");
        }
    }

    #[test]
    fn words_may_have_blanks() {
        for (line, separator) in [("y (um)\\x (um),0.5,1", Separator::Comma), ("height [nm]\t0\t1", Separator::Tab)] {
            let (fields, actual) = split(line);
            assert_eq!((fields.len(), actual), (3, separator), "{line}");
        }
    }

    #[test]
    fn ambiguous_commas_are_refused() {
        let check = |lines: &[&str]| {
            let mut notation = Notation::default();
            for line in lines {
                let (fields, _) = split(line);
                fields.iter().for_each(|f| assert!(notation.number(f, 1).is_some()));
            }
            notation.check(Path::new("a.txt")).map_err(|e| e.to_string())
        };
        assert!(check(&["1,234;2,345"]).unwrap_err().contains("separator of thousands"));
        assert!(check(&["1,5;2.5"]).unwrap_err().contains("decimal points elsewhere"));
        for lines in [&["1,234;0,345"][..], &["1,234;2,34"], &["1.5;2"], &["1234,567 2"]] {
            assert_eq!(check(lines), Ok(None), "{lines:?}");
        }
    }
}
