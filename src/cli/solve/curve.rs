//! The loads of a solve as a table: one row per load, on the terminal and in `curve.csv`.

use crate::Result;
use crate::method::Stop;
use crate::record::csv;
use crate::report::number::{percent, significant};
use serde_json::Value;
use std::path::Path;

/// Units of the command line, where it or the file states them.
#[derive(Debug, Clone, Default)]
pub(super) struct ResultUnits {
    pub length: Option<String>,
    pub stress: Option<String>,
}

/// Dimension of a column.
#[derive(Clone, Copy)]
enum Dimension {
    None,
    Length,
    Stress,
    /// Energy per area.
    Work,
    Time,
}

/// Columns of `curve.csv`, each a key of the line of JSON of a load.
const COLUMNS: [(&str, Dimension); 22] = [
    ("pressure", Dimension::Stress),
    ("p_star", Dimension::None),
    ("contact_fraction", Dimension::None),
    ("contact_fraction_corrected", Dimension::None),
    ("contact_fraction_compressive", Dimension::None),
    ("mean_gap", Dimension::Length),
    ("displacement", Dimension::Length),
    ("hydraulic_gap_x", Dimension::Length),
    ("hydraulic_gap_y", Dimension::Length),
    ("hydraulic_gap_effective_medium", Dimension::Length),
    ("energy", Dimension::Work),
    ("elastic_energy", Dimension::Work),
    ("adhesion_energy", Dimension::Work),
    ("flowing_fraction", Dimension::None),
    ("displaced_fraction", Dimension::None),
    ("mean_plastic_displacement", Dimension::Length),
    ("plastic_work", Dimension::Work),
    ("load_error", Dimension::None),
    ("residual", Dimension::None),
    ("iterations", Dimension::None),
    ("fft_pairs", Dimension::None),
    ("seconds", Dimension::Time),
];

impl ResultUnits {
    /// The unit of a dimension; `None` for numbers and for units that are not known.
    fn of(&self, dimension: Dimension) -> Option<String> {
        match dimension {
            Dimension::None => None,
            Dimension::Length => self.length.clone(),
            Dimension::Stress => self.stress.clone(),
            Dimension::Work => Some(format!("{}_{}", self.stress.as_ref()?, self.length.as_ref()?)),
            Dimension::Time => Some("s".into()),
        }
    }

    /// A length with its unit, for people.
    pub(super) fn length(&self, value: f64) -> String {
        with_unit(significant(value, 6), self.length.as_deref())
    }

    pub(super) fn stress(&self, value: f64) -> String {
        with_unit(significant(value, 6), self.stress.as_deref())
    }

    pub(super) fn work(&self, value: f64) -> String {
        with_unit(significant(value, 6), self.of(Dimension::Work).map(|u| u.replace('_', " ")).as_deref())
    }
}

fn with_unit(number: String, unit: Option<&str>) -> String {
    match unit {
        Some(unit) => format!("{number} {unit}"),
        None => number,
    }
}

/// Writes `curve.csv`: load number and all scalars of each load, with units in the header where they are known.
pub(super) fn write(folder: &Path, lines: &[Value], units: &ResultUnits) -> Result<()> {
    let numbers: Vec<f64> = (1..=lines.len()).map(|n| n as f64).collect();
    let mut columns = vec![("load".to_string(), numbers)];
    for (key, dimension) in COLUMNS {
        let values: Vec<Option<f64>> = lines.iter().map(|line| line[key].as_f64()).collect();
        // A column that no load has is left out.
        if values.iter().any(Option::is_some) {
            let header = units.of(dimension).map_or(key.to_string(), |unit| format!("{key}_{unit}"));
            columns.push((header, values.into_iter().map(|v| v.unwrap_or(f64::NAN)).collect()));
        }
    }
    let columns: Vec<(&str, &[f64])> = columns.iter().map(|(h, v)| (h.as_str(), v.as_slice())).collect();
    csv::write(&folder.join("curve.csv"), &columns)
}

/// Writes `pull-off.csv`: mean gap and mean pressure along the separation.
pub(super) fn write_pull_off(folder: &Path, curve: &[[f64; 2]], units: &ResultUnits) -> Result<()> {
    let header = |key: &str, dimension| units.of(dimension).map_or(key.to_string(), |unit| format!("{key}_{unit}"));
    let [gaps, pressures] = [0, 1].map(|i| curve.iter().map(|point| point[i]).collect::<Vec<f64>>());
    let (gap, pressure) = (header("mean_gap", Dimension::Length), header("pressure", Dimension::Stress));
    csv::write(&folder.join("pull-off.csv"), &[(&gap, &gaps), (&pressure, &pressures)])
}

/// Width of the columns on the terminal.
const WIDTH: usize = 18;

/// Head of the table on the terminal, of several loads.
pub(super) fn head(units: &ResultUnits) -> String {
    let named = |name: &str, dimension| units.of(dimension).map_or(name.to_string(), |unit| format!("{name} / {unit}"));
    let cells = [
        "load".to_string(),
        named("pressure", Dimension::Stress),
        "contact".into(),
        "corrected".into(),
        named("mean gap", Dimension::Length),
        "load error".into(),
        "residual".into(),
        "iterations".into(),
    ];
    row(&cells)
}

/// A load as a row of that table.
pub(super) fn line(number: usize, state: &Value) -> String {
    let number_of = |key: &str| state[key].as_f64();
    let dash = || "–".to_string();
    // Separated surfaces have no equilibrium: the last iterate is no result.
    let separated = state["stop"] == Stop::Detached.to_string();
    let result = |key: &str| number_of(key).filter(|_| !separated);
    let text = |key: &str, show: &dyn Fn(f64) -> String| result(key).map_or_else(dash, show);
    let power = |v: f64| format!("{v:.1e}");
    row(&[
        number.to_string(),
        number_of("pressure").map_or_else(dash, |v| significant(v, 6)),
        text("contact_fraction", &percent),
        text("contact_fraction_corrected", &percent),
        text("mean_gap", &|v| significant(v, 6)),
        text("load_error", &power),
        text("residual", &power),
        state["iterations"].as_u64().map_or_else(dash, |n| n.to_string()),
    ])
}

fn row(cells: &[String; 8]) -> String {
    let [first, rest @ ..] = cells;
    rest.iter().fold(format!("{first:>5}"), |row, cell| format!("{row} {cell:>WIDTH$}"))
}
