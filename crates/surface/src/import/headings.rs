//! Names of columns (`X[µm];Y[µm];Z[nm]`), and labels of rows and columns around a matrix.

use super::unit::length_unit;

/// Names of columns and their units.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Headings {
    names: Vec<String>,
    units: Vec<Option<String>>,
    /// Whether the line has units alone, in the order of the columns.
    are_units: bool,
}

/// Names of a column of heights.
const HEIGHTS: [&str; 9] =
    ["z", "h", "height", "heights", "höhe", "z coordinate", "z position", "topography", "elevation"];

/// Columns of a list of points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PointColumns {
    pub(super) x: usize,
    pub(super) y: usize,
    pub(super) height: usize,
}

impl Headings {
    pub(super) fn of(fields: &[&str]) -> Self {
        let mut headings = Headings { names: Vec::new(), units: Vec::new(), are_units: false };
        for field in fields {
            // Of a name before it, where blanks separate the fields: `x (um) z (um)`.
            let alone = [('(', ')'), ('[', ']')]
                .into_iter()
                .find_map(|(open, close)| length_unit(field.trim().strip_prefix(open)?.strip_suffix(close)?));
            match headings.units.last_mut().filter(|unit| unit.is_none() && alone.is_some()) {
                Some(unit) => *unit = alone,
                None => {
                    let (name, unit) = name_and_unit(field);
                    headings.names.push(name);
                    headings.units.push(unit);
                }
            }
        }
        headings
    }

    pub(super) fn len(&self) -> usize {
        self.names.len()
    }

    /// The only column with one of these names.
    fn one(&self, known: &[&str]) -> Option<usize> {
        let mut matching = self.names.iter().enumerate().filter(|(_, n)| known.contains(&n.as_str())).map(|(i, _)| i);
        matching.next().filter(|_| matching.next().is_none())
    }

    /// The columns of a list of points: exactly one named as x, one as y, one as height.
    pub(super) fn columns(&self) -> Option<PointColumns> {
        Some(PointColumns {
            x: self.one(&["x", "x coordinate", "x position", "x pos", "pos x", "x axis"])?,
            y: self.one(&["y", "y coordinate", "y position", "y pos", "pos y", "y axis"])?,
            height: self.one(&HEIGHTS)?,
        })
    }

    /// The columns of positions and of heights of a profile. Others, such as an index, have other names. Next to x the heights may be
    /// those of y.
    pub(super) fn columns_of_profile(&self) -> Option<[usize; 2]> {
        let positions = ["x", "x coordinate", "x position", "position", "distance", "x axis", "length", "s"];
        let x = self.one(&positions)?;
        let others = || (0..self.len()).filter(|k| *k != x && Some(*k) != self.flags() && !is_index(&self.names[*k]));
        let y = || self.one(&["y"]).filter(|y| others().eq([*y]));
        Some([x, self.one(&HEIGHTS).or_else(y)?])
    }

    /// The names of a table whose columns are different quantities, and none of positions. Those of a map's columns are numbered (`c1`)
    /// or letters (`AB`).
    pub(super) fn of_quantities(&self) -> Option<&[String]> {
        let is_word = |name: &&String| name.len() > 2 && !name.contains(|c: char| c.is_ascii_digit());
        let different = self.names.iter().enumerate().all(|(k, name)| !self.names[..k].contains(name));
        (different && 2 * self.names.iter().filter(is_word).count() > self.names.len()).then_some(&self.names)
    }

    /// The column of flags, 0 where nothing was measured.
    pub(super) fn flags(&self) -> Option<usize> {
        self.one(&["valid", "is valid", "validity"])
    }

    pub(super) fn unit(&self, column: usize) -> Option<String> {
        self.units.get(column).cloned().flatten()
    }

    /// Columns that have units and no names (`um um nm`): those of x, (y) and heights.
    pub(super) fn of_units(fields: &[&str]) -> Option<Self> {
        let names: &[&str] = match fields.len() {
            2 => &["x", "z"],
            3 => &["x", "y", "z"],
            _ => return None,
        };
        let units: Option<Vec<_>> = fields.iter().map(|f| length_unit(f).map(Some)).collect();
        Some(Self { units: units?, are_units: true, ..Self::of(names) })
    }

    /// Takes the units of a line of units above the names, if it has one for each.
    pub(super) fn below_units(mut self, above: &Self) -> Self {
        if above.are_units && above.len() == self.len() && self.units.iter().all(Option::is_none) {
            self.units = above.units.clone();
        }
        self
    }

    /// Takes units from a line below the names (`[mm];[mm];[1/0]`), if all of its fields are in brackets or units of length.
    pub(super) fn take_units(&mut self, fields: &[&str]) -> bool {
        let is_unit = |f: &&str| length_unit(f).is_some() || (f.starts_with('[') && f.ends_with(']'));
        if fields.len() != self.len() || !fields.iter().all(is_unit) {
            return false;
        }
        self.units = fields.iter().map(|f| length_unit(f)).collect();
        true
    }
}

fn is_index(name: &str) -> bool {
    ["", "#", "n", "no.", "no", "nr", "index", "i"].contains(&name)
}

/// `X[µm]`, `x (um)`, `Z / nm`, `z_nm`: the name in lower case, and the unit if it is one of length.
fn name_and_unit(field: &str) -> (String, Option<String>) {
    let field = field.trim().trim_matches('"').trim_end_matches(':');
    let end_of_name = field
        .find(['[', '(', '/'])
        .or_else(|| field.rfind(['_', ' ']).filter(|i| length_unit(&field[i + 1..]).is_some()));
    let (name, unit) = match end_of_name {
        Some(i) => (&field[..i], length_unit(field[i + 1..].trim().trim_end_matches([']', ')']))),
        None => (field, None),
    };
    (name.trim().to_lowercase().replace(['-', '_'], " "), unit)
}

/// What the word between the labels of rows and those of columns states.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Corner {
    /// Units of the labels along x and y.
    pub(super) lateral: [Option<String>; 2],
    pub(super) height: Option<String>,
    pub(super) warning: Option<String>,
}

impl Corner {
    /// `y\x`, `y (mm)\x (mm)`, `x/y [mm]`, `height [nm]`. The first name is that of the labels below it.
    pub(super) fn of(word: &str) -> Self {
        let word = word.trim_start_matches('#');
        let mut corner = Corner::default();
        if let Some(unit) = length_unit(word) {
            let which = "that of the labels or of the heights";
            corner.warning = Some(format!(
                "{unit} in the corner may be {which}: it is not used, give --unit, and --length with a unit"
            ));
            return corner;
        }
        // One unit behind both names.
        let (names, last_unit) = match word.rsplit_once(['[', '(']) {
            Some((names, unit)) => (names, length_unit(unit)),
            None => (word, None),
        };
        let separator = if word.contains('\\') { '\\' } else { '/' };
        let parts: Vec<(String, Option<String>)> = names.split(separator).map(name_and_unit).collect();
        if let [(below, unit), (across, _)] = &parts[..]
            && let Some([down, along]) = axis(below).zip(axis(across)).map(|(a, b)| [a, b]).filter(|[a, b]| a != b)
        {
            corner.lateral[along] = last_unit.clone();
            corner.lateral[down] = unit.clone().or(last_unit);
            if down == 0 {
                let read = "lines are read as those of constant y";
                corner.warning = Some(format!("{word:?} in the corner names x for the labels of the lines: {read}"));
            }
            return corner;
        }
        let (name, unit) = name_and_unit(word);
        match axis(&name) {
            Some(_) => corner.lateral = [unit.clone(), unit],
            None => corner.height = unit,
        }
        corner
    }
}

fn axis(name: &str) -> Option<usize> {
    ["x", "y"].iter().position(|n| *n == name)
}

/// The spacing of labels in even steps, negative where they decrease; at least three.
pub(super) fn even(labels: &[f64]) -> Option<f64> {
    /// Tolerance of a label over the spacing: rounding by the writing program.
    const OFF: f64 = 1e-2;
    let steps = labels.len().checked_sub(1).filter(|n| *n >= 2)?;
    let step = (labels[steps] - labels[0]) / steps as f64;
    let is_close = |(i, v): (usize, &f64)| (v - labels[0] - i as f64 * step).abs() <= OFF * step.abs();
    (step != 0.0 && labels.iter().enumerate().all(is_close)).then_some(step)
}

/// The spacing of labels that are even as far as their digits go, in at least four steps.
pub(super) fn even_as_written(labels: &[f64]) -> Option<f64> {
    let steps = labels.len().checked_sub(1).filter(|n| *n >= 3)?;
    let step = (labels[steps] - labels[0]) / steps as f64;
    let largest = labels.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    if step == 0.0 || labels.iter().any(|v| !v.is_finite()) {
        return None;
    }
    // The last digit that any label has.
    let first = -largest.log10().floor() as i32;
    let is_whole = |v: f64| (v - v.round()).abs() < 1e-4;
    let digit = (first..first + 9).map(|k| 10f64.powi(k)).find(|scale| labels.iter().all(|v| is_whole(v * scale)));
    let exact = 1e-6 * step.abs();
    let tolerance = digit.map(f64::recip).filter(|digit| step.abs() >= 2.0 * digit).unwrap_or(exact);
    let is_close = |(i, v): (usize, &f64)| (v - labels[0] - i as f64 * step).abs() <= tolerance;
    labels.iter().enumerate().all(is_close).then_some(step)
}

/// Whether numbers count from 0 or 1, or down to it: indices, not coordinates.
pub(super) fn counts(labels: &[f64]) -> bool {
    let up = |first: f64| labels.iter().enumerate().all(|(i, v)| *v == first + i as f64);
    let down = |last: f64| labels.iter().rev().enumerate().all(|(i, v)| *v == last + i as f64);
    up(0.0) || up(1.0) || down(0.0) || down(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_units_and_labels() {
        for (fields, unit) in [
            (&["X[µm]", "Y[µm]", "Z[nm]"][..], Some("nm")),
            (&["valid", "x (mm)", "y (mm)", "height / µm"], Some("µm")),
            (&["\"x_um\"", "y_um", "z_um"], Some("um")),
            (&["x", "y", "h"], None),
        ] {
            let headings = Headings::of(fields);
            let columns = headings.columns().expect("columns");
            assert_eq!((columns.x, columns.height), (fields.len() - 3, fields.len() - 1));
            assert_eq!(headings.unit(columns.height).as_deref(), unit);
        }
        let mut bare = Headings::of(&["X", "Y", "valid"]);
        assert!(bare.take_units(&["[mm]", "[um]", "[1/0]"]) && !bare.take_units(&["1", "2", "3"]));
        assert_eq!((bare.unit(1).as_deref(), bare.unit(2), bare.columns()), (Some("um"), None, None));
        assert_eq!(Headings::of(&["x", "x", "y", "z"]).columns(), None);
        assert_eq!([even(&[0.0, 0.5, 1.0]), even(&[0.0, 1.0, 3.0]), even(&[1.0, 2.0])], [Some(0.5), None, None]);
        assert_eq!([even(&[1.0, 0.5, 0.0]), even(&[1.0, 1.0, 1.0])], [Some(-0.5), None]);
        assert!(counts(&[1.0, 2.0]) && counts(&[2.0, 1.0, 0.0]) && !counts(&[0.0, 0.5]));
    }

    #[test]
    fn corners_of_labelled_matrices() {
        let some = |unit: &str| Some(unit.to_string());
        for (word, lateral, height, warns) in [
            ("y\\x", [None, None], None, false),
            ("y (mm)\\x (um)", [some("um"), some("mm")], None, false),
            ("Y/X [mm]", [some("mm"), some("mm")], None, false),
            ("x\\y", [None, None], None, true),
            ("x [µm]", [some("µm"), some("µm")], None, false),
            ("height [nm]", [None, None], some("nm"), false),
            ("Höhe / nm", [None, None], some("nm"), false),
            ("[µm]", [None, None], None, true),
            ("", [None, None], None, false),
        ] {
            let corner = Corner::of(word);
            assert_eq!((corner.lateral, corner.height, corner.warning.is_some()), (lateral, height, warns), "{word}");
        }
    }
}
