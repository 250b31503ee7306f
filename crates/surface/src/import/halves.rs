//! Decimal commas between separating commas: `26,33,53,41` may be two numbers. Rows of whole numbers are watched for it.

use super::marks::is_missing;
use super::source::quoted;
use asperity_grid::error::{Error, Result};
use std::path::Path;

/// Rows of a file whose fields are apart by commas, as far as they were read.
#[derive(Debug, Default)]
pub(super) struct CommaHalves {
    /// Whether a field is no whole number, so that commas only separate.
    fractions: bool,
    /// Whether a row cannot be pairs: an odd number of fields, a sign in a second half, or halves of other lengths.
    unpaired: bool,
    /// A whole number with a zero in front.
    zero: Option<(String, usize)>,
    /// Signs of first halves.
    signs: usize,
    /// Whether a first half has another number of digits than the second ones.
    uneven: bool,
    /// Digits of the second halves by their column.
    digits: Vec<usize>,
    fields: usize,
    first_line: usize,
}

impl CommaHalves {
    /// Takes in a row of numbers and marks; a mark stands for both halves.
    pub(super) fn row(&mut self, fields: &[&str], line: usize) {
        if self.fractions {
            return;
        }
        let fields: Vec<&&str> = fields.iter().filter(|f| !is_missing(f)).collect();
        let unsigned =
            |field: &str| field.strip_prefix(['-', '+', '\u{2212}']).map_or(field.to_string(), str::to_string);
        let mantissa = |field: &str| unsigned(field).split(['e', 'E', 'd', 'D']).next().unwrap_or_default().to_string();
        let digits = |field: &str| mantissa(field).len();
        let is_whole = |f: &&&str| digits(f) > 0 && mantissa(f).bytes().all(|b| b.is_ascii_digit());
        let has_exponent = |f: &str| digits(f) < unsigned(f).len();
        let is_number = |f: &&&str| f.parse::<f64>().is_ok_and(f64::is_finite);
        if fields.len() < 2 || fields.iter().any(|f| is_number(f) && !is_whole(f) || f.contains(',')) {
            self.fractions |= fields.len() > 1;
            return;
        }
        let whole = || fields.iter().filter(|f| is_whole(f));
        if let Some(word) = whole().find(|f| digits(f) > 1 && mantissa(f).starts_with('0')) {
            self.zero.get_or_insert((word.to_string(), line));
        }
        if self.fields == 0 {
            self.first_line = line;
            self.digits = fields.iter().skip(1).step_by(2).map(|f| digits(f)).collect();
        }
        self.fields += fields.len();
        let seconds = fields.iter().skip(1).step_by(2);
        let paired = fields.len().is_multiple_of(2)
            && seconds.zip(&self.digits).all(|(f, n)| is_whole(f) && digits(f) == *n && unsigned(f) == ***f);
        let firsts = || fields.iter().step_by(2);
        self.unpaired |= !paired || firsts().any(|f| is_whole(f) && has_exponent(f));
        self.signs += firsts().filter(|f| unsigned(f) != ***f).count();
        self.uneven |= paired && fields.iter().any(|f| is_whole(f) && has_exponent(f));
        self.uneven |= firsts().zip(&self.digits).any(|(f, n)| is_whole(f) && digits(f) != *n);
    }

    /// A warning where the whole numbers may be halves.
    ///
    /// # Errors
    /// Whole numbers that are probably halves.
    pub(super) fn check(&self, path: &Path) -> Result<Option<String>> {
        /// Signs that are all in first halves: a chance of 1 in 64 for numbers of their own.
        const SIGNS: usize = 6;
        /// Fields from which on equally short halves are no chance, and their digits.
        const MANY: usize = 32;
        const SHORT: usize = 2;
        if self.fractions || self.fields == 0 {
            return Ok(None);
        }
        let says = match &self.zero {
            Some((word, line)) => format!("{} on line {line}", quoted(word)),
            None if self.unpaired => return Ok(None),
            None => format!("from line {} on each second number has the same number of digits", self.first_line),
        };
        let short = self.fields >= MANY && self.digits.iter().all(|n| *n <= SHORT);
        if self.zero.is_some() || self.signs >= SIGNS || self.uneven || short {
            let found = format!("{says}, among whole numbers that commas separate: these may be decimal commas");
            return Err(Error::format(
                path,
                found,
                "decimal points, or decimal commas between semicolons, tabs or blanks",
            ));
        }
        let plain = self.digits.iter().any(|n| *n > 1);
        Ok(plain
            .then(|| format!("{says}: if they are decimal commas, separate the numbers by semicolons, tabs or blanks")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimal_commas_between_separating_commas() {
        let check = |lines: &[&str]| {
            let mut halves = CommaHalves::default();
            let rows = lines.iter().zip(1..);
            rows.for_each(|(line, n)| halves.row(&line.split(',').collect::<Vec<_>>(), n));
            halves.check(Path::new("a.csv")).map_err(|e| e.to_string())
        };
        for (lines, says) in [
            (&["26,33,53,41", "-0,76,19,03"][..], "\"03\" on line 2"),
            (&["26,33,NA,53,07", "1,20,NA,3,41"], "\"07\" on line 1"),
            (&["-26,3,-53,4", "-1,2,-9,3", "-2,2,-1,3"], "each second number"),
            (&["126,3,53,4", "17,2,9,3"], "each second number"),
            (&["2,193e2,2,272e2", "1,650e2,2,168e2"], "each second number"),
        ] {
            assert!(check(lines).unwrap_err().contains(says), "{lines:?}");
        }
        for lines in [
            &["1,2", "3,4"][..],
            &["1.5,20", "7,03"],
            &["10,200,7", "3,4,12"],
            &["7,-4", "3,2"],
            &["1,10", "2,9"],
            &["1e2,2e2", "3e2,1e2"],
        ] {
            let unwarned = check(lines) == Ok(None);
            assert!(unwarned || lines[0] == "1,2", "{lines:?}: {:?}", check(lines));
        }
        assert!(check(&["26,33,53,41", "19,13,43,61"]).unwrap().is_some());
    }
}
