//! Names of columns (`X[µm];Y[µm];Z[nm]`), and labels of rows and columns around a matrix.

use super::unit::length_unit;

/// Names of columns and their units.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Headings {
    names: Vec<String>,
    units: Vec<Option<String>>,
}

/// Columns of a list of points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Columns {
    pub(super) x: usize,
    pub(super) y: usize,
    pub(super) height: usize,
}

impl Headings {
    pub(super) fn of(fields: &[&str]) -> Self {
        let (names, units) = fields.iter().map(|f| name_and_unit(f)).unzip();
        Headings { names, units }
    }

    pub(super) fn len(&self) -> usize {
        self.names.len()
    }

    /// The columns of a list of points: exactly one named as x, one as y, one as height.
    pub(super) fn columns(&self) -> Option<Columns> {
        let one = |known: &[&str]| {
            let mut found = self.names.iter().enumerate().filter(|(_, n)| known.contains(&n.as_str())).map(|(i, _)| i);
            found.next().filter(|_| found.next().is_none())
        };
        Some(Columns {
            x: one(&["x", "x coordinate", "x position", "x pos", "pos x", "x axis"])?,
            y: one(&["y", "y coordinate", "y position", "y pos", "pos y", "y axis"])?,
            height: one(&[
                "z",
                "h",
                "height",
                "heights",
                "höhe",
                "z coordinate",
                "z position",
                "topography",
                "elevation",
            ])?,
        })
    }

    pub(super) fn unit(&self, column: usize) -> Option<String> {
        self.units.get(column).cloned().flatten()
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

/// `X[µm]`, `x (um)`, `Z / nm`, `z_nm`: the name in lower case, and the unit if it is one of length.
fn name_and_unit(field: &str) -> (String, Option<String>) {
    let field = field.trim().trim_matches('"').trim_end_matches(':');
    let at = field
        .find(['[', '(', '/'])
        .or_else(|| field.rfind(['_', ' ']).filter(|i| length_unit(&field[i + 1..]).is_some()));
    let (name, unit) = match at {
        Some(i) => (&field[..i], length_unit(field[i + 1..].trim().trim_end_matches([']', ')']))),
        None => (field, None),
    };
    (name.trim().to_lowercase().replace(['-', '_'], " "), unit)
}

/// The spacing of labels that increase in even steps; at least three.
pub(super) fn even(labels: &[f64]) -> Option<f64> {
    /// Tolerance of a label over the spacing: rounding by the writing program.
    const OFF: f64 = 1e-2;
    let steps = labels.len().checked_sub(1).filter(|n| *n >= 2)?;
    let step = (labels[steps] - labels[0]) / steps as f64;
    let near = |(i, v): (usize, &f64)| (v - labels[0] - i as f64 * step).abs() <= OFF * step;
    (step > 0.0 && labels.iter().enumerate().all(near)).then_some(step)
}

/// Whether numbers count from 0 or 1: indices, not coordinates.
pub(super) fn counts(labels: &[f64]) -> bool {
    [0.0, 1.0].iter().any(|first| labels.iter().enumerate().all(|(i, v)| *v == first + i as f64))
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
        assert!(counts(&[1.0, 2.0]) && !counts(&[0.0, 0.5]));
    }
}
