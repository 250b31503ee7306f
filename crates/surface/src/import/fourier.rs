use super::comments::comment_apart;
use super::decode::TextLines;
use super::fields::split;
use super::source::quoted;
use crate::Wave;
use asperity_grid::error::{Error, Result};
use std::path::Path;

/// Largest accepted wave number; it requires a grid of 65537 × 65537 points.
const LARGEST: f64 = 32_768.0;

/// Whether four columns could be Fourier coefficients: all values of the first two columns are integers, and most
/// pairs are distinct.
pub(super) fn may_be(columns: &[f64]) -> bool {
    let pair = |line: &[f64]| Some((whole(line[0])?, whole(line[1])?));
    let Some(mut pairs) = columns.chunks_exact(4).map(pair).collect::<Option<Vec<_>>>() else { return false };
    let lines = pairs.len();
    pairs.sort_unstable();
    pairs.dedup();
    2 * pairs.len() > lines
}

fn whole(value: f64) -> Option<i32> {
    (value.fract() == 0.0 && value.abs() <= LARGEST).then_some(value as i32)
}

/// Fourier coefficients from four columns; errors count lines from 1.
pub(super) fn of_columns(path: &Path, columns: &[f64]) -> Result<Vec<Wave>> {
    let lines = columns.chunks_exact(4).zip(1..);
    lines.map(|(line, n)| wave(path, n, [line[0], line[1], line[2], line[3]])).collect()
}

fn wave(path: &Path, line: usize, [kx, ky, re, im]: [f64; 4]) -> Result<Wave> {
    let mode = |name: &str, value: f64| {
        whole(value).ok_or_else(|| {
            let accepted = format!("whole numbers up to {LARGEST} in size, in units of 2π over the cell's extent");
            Error::format(path, format!("{name} = {value} on line {line}"), accepted)
        })
    };
    for (name, value) in [("Re", re), ("Im", im)] {
        if !value.is_finite() {
            return Err(Error::format(path, format!("{name} = {value} on line {line}"), "finite numbers"));
        }
    }
    Ok(Wave { kx: mode("qX", kx)?, ky: mode("qY", ky)?, re, im })
}

/// Fourier coefficients from lines of text, read one by one.
pub(super) fn read_text(path: &Path) -> Result<Vec<Wave>> {
    let mut waves = Vec::new();
    let (mut lines, mut text) = (TextLines::open(path)?, String::new());
    while lines.next(&mut text)? {
        let number = lines.number;
        let (fields, _) = split(comment_apart(&text).0);
        let mut columns = [0.0; 4];
        for (k, word) in fields.iter().enumerate() {
            let value = word.parse().map_err(|_| {
                let found = format!("{} on line {number}, column {} (counted from 1)", quoted(word), k + 1);
                Error::format(path, found, "a number with a decimal point")
            })?;
            if let Some(column) = columns.get_mut(k) {
                *column = value;
            }
        }
        match fields.len() {
            0 => {}
            4 => waves.push(wave(path, number, columns)?),
            count => {
                let found = format!("{count} numbers on line {number}");
                return Err(Error::format(path, found, "four, qX qY Re Im (or the file is cut off)"));
            }
        }
    }
    if waves.is_empty() { Err(Error::format(path, "no waves", "lines of qX qY Re Im")) } else { Ok(waves) }
}
