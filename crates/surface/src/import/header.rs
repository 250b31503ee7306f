//! Headers of text files: `key = value` or `key: value`, in comments or on lines before the heights. The keys are those of
//! Gwyddion (in the languages of its interface), SPIP, Nova, ESRI grids and this program.

use super::fields::split;
use super::header_key::{HeaderAxis, HeaderKey, key};
use super::source::{plain, quoted};
use super::unit::{self, length_unit};
use crate::declared::{Declared, DeclaredExtent};
use crate::height_map::Touching;
use asperity_grid::error::{Error, Result};
use asperity_grid::units::metres_per;
use std::path::Path;

/// Key and value of a line, apart by `=` or `:`.
fn pair(line: &str) -> Option<(&str, &str)> {
    line.split_once(['=', ':', '：'])
}

/// Likewise for a line outside of comments, where a number may also follow a known key after blanks (`ncols 480`). In comments such words
/// may be prose.
fn bare_pair(line: &str) -> Option<(&str, &str)> {
    pair(line).or_else(|| {
        let end = line.find(|c: char| c.is_ascii_digit() || matches!(c, '-' | '+' | '.')).filter(|i| *i > 0)?;
        let name = line[..end].trim_end_matches(|c: char| c.is_whitespace() || matches!(c, ';' | ','));
        // A label `h0`, or labels `h 0 1 2`, are no such pair.
        let alone = name.len() < end && split(&line[end..]).0.len() <= 2;
        key(name).filter(|_| alone).map(|_| (name, &line[end..]))
    })
}

/// The statements of a line: `h=20 w=24`, `Width: 12 um, Height: 10 um`. A further one begins with a known key behind a value.
fn statements(line: &str) -> Vec<&str> {
    let known = |name: &str| key(without_unit(name).0);
    let is_text = |key| matches!(key, HeaderKey::Channel | HeaderKey::History | HeaderKey::Sign);
    if pair(line).and_then(|(name, _)| known(name)).is_none_or(is_text) {
        return vec![line];
    }
    let signs: Vec<usize> = line.match_indices(['=', ':']).map(|(i, _)| i).collect();
    let mut parts = Vec::new();
    let mut start = 0;
    for ends in signs.windows(2) {
        let [from, to] = [ends[0] + 1, ends[1]];
        let between = &line[from..to];
        let is_border = |c: char| c.is_whitespace() || matches!(c, ',' | ';' | '|');
        let begins = |&(i, border): &(usize, &str)| {
            let name = &between[i + border.len()..];
            !between[..i].trim_matches(is_border).is_empty() && !name.starts_with(is_border) && known(name).is_some()
        };
        if let Some((i, border)) = between.match_indices(is_border).find(begins) {
            parts.push(line[start..from + i].trim_end_matches(is_border));
            start = from + i + border.len();
        }
    }
    parts.push(&line[start..]);
    parts
}

/// Whether a line outside of comments belongs to the header of a height file.
pub(super) fn is_known(line: &str) -> bool {
    bare_pair(line).is_some_and(|(name, _)| key(without_unit(name).0).is_some())
}

/// `height conversion factor (-> m)` is a name with a unit.
fn without_unit(name: &str) -> (&str, Option<&str>) {
    match name.split_once(['(', '[']) {
        Some((name, unit)) => {
            (name, Some(unit.trim_start_matches("->").trim_start_matches('→').trim().trim_end_matches([')', ']'])))
        }
        None => (name, None),
    }
}

/// `0.5 µm/px`, `0.1 nm per count`: the unit of one point or of one step of the digitiser.
fn per_point(unit: &str) -> &str {
    const POINTS: [&str; 10] = ["px", "pixel", "pixels", "point", "count", "counts", "digit", "bit", "lsb", "punkt"];
    let parts = unit.split_once('/').or_else(|| unit.split_once(" per ")).or_else(|| unit.split_once(" pro "));
    match parts {
        Some((unit, of)) if POINTS.contains(&of.trim().to_lowercase().as_str()) => unit.trim(),
        _ => unit,
    }
}

/// Whether a unit counts points.
fn is_points(unit: &str) -> bool {
    matches!(unit, "px" | "pixel" | "pixels" | "Pixel" | "points" | "Punkte")
}

/// Numbers of a value and the unit behind them: `10,00 µm`, `10 x 20 um`, `[10, 20] nm`.
pub(super) fn quantity(value: &str) -> (Vec<f64>, String) {
    let (mut numbers, mut units) = (Vec::new(), Vec::new());
    let mut rest = value.trim();
    while let Some(first) = rest.chars().next() {
        let starts = first.is_ascii_digit()
            || (matches!(first, '+' | '-' | '.') && rest[1..].starts_with(|c: char| c.is_ascii_digit() || c == '.'));
        let end = if starts { number_end(rest) } else { 0 };
        if let Ok(number) = rest[..end].replace(',', ".").parse() {
            numbers.push(number);
            rest = &rest[end..];
            continue;
        }
        let end = rest
            .find(|c: char| c.is_whitespace() || c.is_ascii_digit() || c == ',')
            .unwrap_or(rest.len())
            .max(first.len_utf8());
        let word = rest[..end].trim_matches(['(', ')', '[', ']', ',', ';', '"']);
        if !matches!(word, "" | "x" | "×" | "*" | "by") && !units.contains(&word) {
            units.push(word);
        }
        rest = rest[end..].trim_start();
    }
    (numbers, units.join(" "))
}

/// Length of the number at the start of a text; a comma belongs to it if a digit follows and it is the first.
fn number_end(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digit = |i: usize| bytes.get(i).is_some_and(u8::is_ascii_digit);
    let (mut end, mut separators) = (usize::from(matches!(bytes[0], b'+' | b'-')), 0);
    loop {
        match bytes.get(end) {
            Some(b) if b.is_ascii_digit() => end += 1,
            Some(b'.' | b',') if separators == 0 && (digit(end + 1) || bytes[end] == b'.') => {
                (end, separators) = (end + 1, 1)
            }
            Some(b'e' | b'E')
                if digit(end + 1) || (matches!(bytes.get(end + 1), Some(b'+' | b'-')) && digit(end + 2)) =>
            {
                end += 2;
                separators = 1;
            }
            _ => return end,
        }
    }
}

/// Relative deviation of two statements of the same extent: instruments print four digits.
const TWICE: f64 = 1e-3;

/// What the header of one channel states.
#[derive(Debug, Clone, Default)]
pub(super) struct ChannelHeader {
    pub(super) channel: Option<String>,
    pub(super) points: [Option<usize>; 2],
    pub(super) missing: Option<f64>,
    /// Unit of numbers that are no heights, and its line.
    pub(super) no_length: Option<(String, usize)>,
    pub(super) warnings: Vec<String>,
    /// Statements of a length or a factor under names that are not known.
    pub(super) not_understood: Vec<String>,
    /// Whether an extent may be a number of points: it has no unit.
    countable: [bool; 2],
    length: [Option<f64>; 2],
    spacing: [Option<f64>; 2],
    lateral: [Option<String>; 2],
    unit: Option<String>,
    /// Unit after the last statement that is of the heights alone.
    stated_unit: Option<Option<String>>,
    factor: Option<f64>,
    /// Whether the factor makes heights of numbers that are none.
    is_converted: bool,
    to_nanometres: Option<f64>,
    nanometres: bool,
    periodic: Option<bool>,
    sign: Option<Touching>,
    history: Vec<String>,
}

impl ChannelHeader {
    /// The name of the channel that a line begins, if it does.
    pub(super) fn channel_of(line: &str) -> Option<&str> {
        pair(line).filter(|(name, _)| key(name) == Some(HeaderKey::Channel)).map(|(_, value)| value.trim())
    }

    /// Takes in a line, `bare` if it is no comment; whether its first key is known.
    ///
    /// # Errors
    /// Values that are not of their kind: units of length that are not known, signs of extents, counts that are not whole.
    pub(super) fn read_key(&mut self, path: &Path, line: usize, text: &str, bare: bool) -> Result<bool> {
        let mut known = false;
        for statement in statements(text) {
            known |= self.read_statement(path, line, statement, bare)?;
        }
        Ok(known)
    }

    fn read_statement(&mut self, path: &Path, line: usize, text: &str, bare: bool) -> Result<bool> {
        let Some((name, value)) = (if bare { bare_pair(text) } else { pair(text) }) else { return Ok(false) };
        // `(-> m)`: the unit of the product, whatever the numbers are.
        let converts = name.contains("->") || name.contains('→');
        let (name, unit_of_name) = without_unit(name);
        let value = value.trim();
        let Some(key) = key(name) else {
            self.note_unknown(name, unit_of_name, value, line);
            return Ok(false);
        };
        let wrong = |accepted: &str| {
            let found = format!("{} = {} on line {line}", plain(name.trim(), 40), quoted(value));
            Error::format(path, found, accepted)
        };
        let (numbers, mut unit) = quantity(value);
        if unit.is_empty() {
            unit = unit_of_name.unwrap_or_default().to_string();
        }
        unit = per_point(&unit).to_string();
        let key = match key {
            HeaderKey::Length(axis) | HeaderKey::Size(axis) if is_points(&unit) => HeaderKey::Points(axis),
            other => other,
        };
        match key {
            HeaderKey::Channel => self.channel = Some(value.to_string()).filter(|v| !v.is_empty()),
            HeaderKey::History => self.history.push(value.to_string()),
            HeaderKey::Other => {}
            HeaderKey::FileFormat => self.nanometres = value.eq_ignore_ascii_case("ascii"),
            HeaderKey::Sign => self.sign = Some(Touching::of_words(value).ok_or_else(|| wrong(Touching::WORDS))?),
            HeaderKey::Periodic => {
                let known = match value.to_ascii_lowercase().as_str() {
                    "yes" | "true" | "1" | "ja" => true,
                    "no" | "false" | "0" | "nein" => false,
                    _ => return Err(wrong("yes or no")),
                };
                self.periodic = Some(known);
            }
            HeaderKey::Unit => self.any_unit(value, line),
            HeaderKey::LateralUnit(axis) => {
                let unit = length_unit(value).ok_or_else(|| wrong(unit::ACCEPTED))?;
                axis.places().iter().for_each(|k| self.lateral_unit(*k, unit.clone()));
            }
            HeaderKey::HeightUnit => self.height_unit(value, &numbers, &unit, line).map_err(|why| wrong(&why))?,
            HeaderKey::Missing if numbers.len() == 1 => self.missing = Some(numbers[0]),
            HeaderKey::Factor | HeaderKey::ToNanometres
                if numbers.len() == 1 && numbers[0].is_finite() && numbers[0] != 0.0 =>
            {
                if key == HeaderKey::ToNanometres {
                    self.to_nanometres = Some(numbers[0]);
                } else {
                    self.factor = Some(numbers[0]);
                    if !unit.is_empty() {
                        self.unit = Some(length_unit(&unit).ok_or_else(|| wrong(unit::ACCEPTED))?);
                        if converts {
                            (self.is_converted, self.no_length) = (true, None);
                        }
                    }
                }
            }
            HeaderKey::Points(axis) => {
                let whole: Vec<usize> =
                    numbers.iter().filter(|n| n.fract() == 0.0 && **n > 0.0).map(|n| *n as usize).collect();
                self.points =
                    each(axis, &whole, self.points).ok_or_else(|| wrong("a whole number, or two for both axes"))?;
            }
            HeaderKey::Length(axis) | HeaderKey::Size(axis) | HeaderKey::Spacing(axis) if !numbers.is_empty() => {
                if !matches!(key, HeaderKey::Spacing(_)) {
                    let countable = matches!(key, HeaderKey::Size(_)) && unit::is_none(&unit);
                    axis.places().iter().for_each(|k| self.countable[*k] = countable);
                }
                self.extent(axis, matches!(key, HeaderKey::Spacing(_)), &numbers, &unit, value).map_err(wrong)?;
            }
            _ => {
                let (name, value) = (plain(name.trim(), 40), quoted(value));
                self.warnings
                    .push(format!("{name} = {value} on line {line} has no number that could be used: it is left out"));
            }
        }
        Ok(true)
    }

    /// The unit of the heights, if it is one of length.
    fn any_unit(&mut self, value: &str, line: usize) {
        if self.is_converted {
            return;
        }
        self.unit = Some(length_unit(value).unwrap_or_else(|| value.to_string())).filter(|v| !v.is_empty());
        if metres_per(value).is_none() && length_unit(value).is_none() {
            let (value, accepted) = (quoted(value), unit::ACCEPTED);
            self.warnings.push(format!("unit {value} on line {line} is not {accepted}: it is not used"));
        }
    }

    /// Remembers what is not understood, for a message about what the file does not declare.
    fn note_unknown(&mut self, name: &str, unit_of_name: Option<&str>, value: &str, line: usize) {
        const MOST: usize = 4;
        let (numbers, unit) = quantity(value);
        let unit = per_point(Some(&*unit).filter(|u| !u.is_empty()).or(unit_of_name).unwrap_or_default());
        let lower = name.to_lowercase();
        let factor = ["factor", "faktor", "scale", "skal"].iter().any(|w| lower.contains(w)) && numbers != [1.0];
        if numbers.is_empty() || self.not_understood.len() == MOST || !(factor || length_unit(unit).is_some()) {
            return;
        }
        let statement = format!("{} = {} on line {line}", plain(name.trim(), 40), quoted(value));
        if factor {
            self.warnings
                .push(format!("{statement} is not understood: it is left out, and heights are not multiplied by it"));
        }
        self.not_understood.push(statement);
    }

    /// The length or, if `spaced`, the spacing along `axis`; on an error, what is accepted.
    fn extent(
        &mut self,
        axis: HeaderAxis,
        spaced: bool,
        numbers: &[f64],
        unit: &str,
        value: &str,
    ) -> std::result::Result<(), &'static str> {
        let single = axis == HeaderAxis::Both && numbers.len() == 1;
        if single && value.contains(',') && !value.trim_start().starts_with("0,") {
            return Err("one number, or two apart by a blank");
        }
        // One number for a map stands for its extent along x; that along y follows from square pixels.
        let axis = if single && !spaced { HeaderAxis::X } else { axis };
        let target = if spaced { &mut self.spacing } else { &mut self.length };
        let fits = numbers.iter().all(|n| n.is_finite() && *n > 0.0);
        let extents = Some(numbers).filter(|_| fits).and_then(|n| each(axis, n, *target));
        let extents = extents.ok_or("a positive number with its unit, or one for each axis")?;
        let previous = std::mem::replace(target, extents);
        let unit = if unit::is_none(unit) { None } else { Some(length_unit(unit).ok_or(unit::ACCEPTED)?) };
        for &k in axis.places() {
            let changed = previous[k].zip(extents[k]).is_some_and(|(old, new)| (old / new - 1.0).abs() > TWICE);
            if changed && (unit.is_none() || unit == self.lateral[k]) {
                return Err("one statement of each extent: an earlier line has another value");
            }
            if let Some(unit) = unit.clone() {
                // The number just read has this unit already.
                let number = if spaced { self.spacing[k].take() } else { self.length[k].take() };
                self.lateral_unit(k, unit);
                *(if spaced { &mut self.spacing[k] } else { &mut self.length[k] }) = number;
            }
        }
        Ok(())
    }

    /// Sets the unit of an axis, in which extents that were given in another one are then.
    fn lateral_unit(&mut self, k: usize, unit: String) {
        let factor = |old: &String| metres_per(old).zip(metres_per(&unit)).map(|(old, new)| old / new);
        if let Some(factor) = self.lateral[k].as_ref().filter(|old| **old != unit).and_then(factor) {
            let extents = [&mut self.length[k], &mut self.spacing[k]];
            extents.into_iter().flatten().for_each(|extent| *extent *= factor);
        }
        self.lateral[k] = Some(unit);
    }

    /// `nm`, or a factor with its unit (`0.1 nm`).
    ///
    /// # Errors
    /// What is accepted, for another unit than on an earlier line.
    fn height_unit(
        &mut self,
        value: &str,
        numbers: &[f64],
        unit: &str,
        line: usize,
    ) -> std::result::Result<(), String> {
        if self.is_converted {
            return Ok(());
        }
        if numbers.len() == 1 && numbers[0].is_finite() && numbers[0] > 0.0 && !unit.is_empty() {
            self.factor = Some(numbers[0]);
        }
        match length_unit(if numbers.is_empty() { value } else { unit }) {
            Some(unit) => (self.unit, self.no_length) = (Some(unit), None),
            None if unit::is_none(value) => {}
            None => self.no_length = Some((value.to_string(), line)),
        }
        match self.stated_unit.replace(self.unit.clone()).filter(|earlier| *earlier != self.unit) {
            Some(earlier) => {
                let earlier = earlier.unwrap_or_else(|| "none".into());
                Err(format!("one unit of the heights: that of an earlier line is {earlier}"))
            }
            None => Ok(()),
        }
    }

    /// Factor from the numbers of the file to heights in [`Declared::unit`].
    pub(super) fn factor(&self) -> f64 {
        self.factor.or(self.to_nanometres.filter(|_| self.unit.is_none())).unwrap_or(1.0)
    }

    /// Units that column names state, where the header has none.
    pub(super) fn take_units(&mut self, lateral: [Option<String>; 2], height: Option<String>) {
        let [x, y] = lateral;
        self.lateral = [self.lateral[0].take().or(x), self.lateral[1].take().or(y)];
        self.unit = self.unit.take().or(height);
    }

    /// # Errors
    /// Numbers of points that are not those of the map; lengths that are not those of the spacings.
    fn check_size(&self, path: &Path, counts: [usize; 2], lengths: [Option<f64>; 2]) -> Result<()> {
        let [nx, ny] = counts;
        let refuse = |found: String, accepted: String| Err(Error::format(path, found, accepted));
        for (k, axis) in ["x", "y"].into_iter().enumerate() {
            // Of a list its lines may be counted, of a profile its points along x.
            let n = self.points[k].filter(|n| *n != nx * ny && !(k == 1 && ny == 1));
            if let Some(n) = n.filter(|n| *n != counts[k]) {
                let found = format!("{} points along {axis}", counts[k]);
                return refuse(found, format!("{n}, as the header declares (or the file is cut off)"));
            }
            // A program may count the spacing once less.
            let n = counts[k] as f64;
            let of_spacing = self.spacing[k].map(|s| s * n);
            if let Some((length, sum)) = lengths[k].zip(of_spacing)
                && (length / sum - 1.0).abs() > 1.01 / n
            {
                let unit = self.lateral[k].as_deref().unwrap_or("(no unit)");
                let [length, sum] = [length, sum].map(shown);
                let found = format!("a length of {length} {unit} along {axis} in the header");
                return refuse(found, format!("that of {n} points with the spacing in the header, {sum} {unit}"));
            }
        }
        Ok(())
    }

    /// What the file states of a map of `nx` by `ny` points. `coordinates`: extents that coordinates of the points give.
    ///
    /// # Errors
    /// Extents that differ from those of the coordinates.
    pub(super) fn declared(
        &self,
        path: &Path,
        [nx, ny]: [usize; 2],
        coordinates: Option<[f64; 2]>,
    ) -> Result<Declared> {
        let nanometres = || Some("nm".to_string());
        let unit = self.unit.clone().or_else(|| self.to_nanometres.and_then(|_| nanometres()));
        let lateral = |k: usize| {
            let named = self.lateral[k].clone().or_else(|| self.lateral[1 - k].clone());
            if self.nanometres { named.or_else(nanometres) } else { named }
        };
        let (x_unit, y_unit) = (lateral(0), lateral(1));
        // Extent along y in the unit of x.
        let to_x = match (&x_unit, &y_unit) {
            (Some(x), Some(y)) if x != y => metres_per(y).zip(metres_per(x)).map_or(1.0, |(y, x)| y / x),
            _ => 1.0,
        };
        // "Width: 512" of a map of 512 points is a number of points.
        let count = |k: usize, n: usize| self.countable[k] && self.length[k] == Some(n as f64);
        let counts = count(0, nx) && (count(1, ny) || self.length[1].is_none());
        let length = |k: usize| self.length[k].filter(|_| !counts);
        let stated = |k: usize, n: usize| length(k).or(self.spacing[k].map(|s| s * n as f64));
        self.check_size(path, [nx, ny], [length(0), length(1)])?;
        let square = |x: f64| x / nx as f64 * ny as f64;
        let stated = match (stated(0, nx), stated(1, ny)) {
            (Some(x), Some(y)) => Some([x, y * to_x]),
            (Some(x), None) => Some([x, square(x)]),
            (None, Some(y)) => Some([y * to_x / ny as f64 * nx as f64, y * to_x]),
            (None, None) => None,
        };
        let coordinates = coordinates.map(|[x, y]| [x, y * to_x]);
        if let (Some(stated), Some(spans)) = (stated, coordinates) {
            // A program may count the spacing once less.
            let deviation = |k: usize, n: usize| (stated[k] / spans[k] - 1.0).abs() > 1.01 / n as f64;
            if deviation(0, nx) || deviation(1, ny) {
                let unit = x_unit.as_deref().unwrap_or("(no unit)");
                let words = |[x, y]: [f64; 2]| match ny {
                    1 => format!("{} {unit}", shown(x)),
                    _ => format!("{} x {} {unit}", shown(x), shown(y)),
                };
                let found = format!("extents of {} in the header", words(stated));
                let accepted = format!("those of the coordinates, {}", words(spans));
                return Err(Error::format(path, found, accepted));
            }
        }
        let extent = coordinates.or(stated).map(|[x, y]| DeclaredExtent { x, y, unit: x_unit });
        Ok(Declared {
            sign: self.sign,
            unit,
            extent,
            periodic: self.periodic,
            channel: self.channel.clone(),
            channels: Vec::new(),
            history: self.history.clone(),
        })
    }
}

/// With six digits.
fn shown(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

/// Values for the axes: two for both, one for one axis or for both.
fn each<T: Copy>(axis: HeaderAxis, values: &[T], previous: [Option<T>; 2]) -> Option<[Option<T>; 2]> {
    match (axis, values) {
        (HeaderAxis::X, [x]) => Some([Some(*x), previous[1]]),
        (HeaderAxis::Y, [y]) => Some([previous[0], Some(*y)]),
        (HeaderAxis::Both, [both]) => Some([Some(*both); 2]),
        (HeaderAxis::Both, [x, y]) => Some([Some(*x), Some(*y)]),
        _ => None,
    }
}
