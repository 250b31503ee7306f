//! `curve.csv` and `pull-off.csv`: one row per load, with the same columns for `run` and `solve`.

use crate::Result;
use asperity_surface::files::csv;
use serde_json::Value;
use std::path::Path;

pub const FILE: &str = "curve.csv";
pub const PULL_OFF_FILE: &str = "pull-off.csv";

/// Units of lengths and stresses, where they are known.
#[derive(Debug, Clone, Default)]
pub struct ResultUnits {
    pub length: Option<String>,
    pub stress: Option<String>,
}

/// Dimension of a column.
#[derive(Debug, Clone, Copy)]
pub enum Dimension {
    None,
    Length,
    Stress,
    /// Energy per area.
    Work,
    /// Stress per length.
    Stiffness,
    Time,
}

/// Columns of `curve.csv`, each a key of a row.
const COLUMNS: [(&str, Dimension); 29] = [
    ("unloading", Dimension::None),
    ("pressure", Dimension::Stress),
    ("p_star", Dimension::None),
    ("contact_area", Dimension::None),
    ("contact_area_error", Dimension::None),
    ("contact_nodes", Dimension::None),
    ("contact_nodes_compressive", Dimension::None),
    ("mean_gap", Dimension::Length),
    ("mean_gap_error", Dimension::Length),
    ("displacement", Dimension::Length),
    ("stiffness", Dimension::Stiffness),
    ("stiffness_error", Dimension::Stiffness),
    ("hydraulic_gap_x", Dimension::Length),
    ("hydraulic_gap_x_error", Dimension::Length),
    ("hydraulic_gap_y", Dimension::Length),
    ("hydraulic_gap_y_error", Dimension::Length),
    ("hydraulic_gap_effective_medium", Dimension::Length),
    ("energy", Dimension::Work),
    ("elastic_energy", Dimension::Work),
    ("interaction_energy", Dimension::Work),
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
    pub fn of(&self, dimension: Dimension) -> Option<String> {
        let both = |between: &str| Some(format!("{}{between}{}", self.stress.as_ref()?, self.length.as_ref()?));
        match dimension {
            Dimension::None => None,
            Dimension::Length => self.length.clone(),
            Dimension::Stress => self.stress.clone(),
            Dimension::Work => both("_"),
            Dimension::Stiffness => both("_per_"),
            Dimension::Time => Some("s".into()),
        }
    }

    /// A name with the unit of its dimension.
    fn header(&self, name: &str, dimension: Dimension) -> String {
        self.of(dimension).map_or(name.to_string(), |unit| format!("{name}_{unit}"))
    }
}

/// Writes `curve.csv`: load number, and the scalars of each load, with units in the header where they are known. A column that no load has
/// is left out.
///
/// # Errors
/// `Io`.
pub fn write(folder: &Path, rows: &[Value], units: &ResultUnits) -> Result<()> {
    let numbers: Vec<f64> = (1..=rows.len()).map(|n| n as f64).collect();
    let mut columns = vec![("load".to_string(), numbers)];
    for (key, dimension) in COLUMNS {
        let values: Vec<Option<f64>> = rows.iter().map(|row| row[key].as_f64()).collect();
        if values.iter().any(Option::is_some) {
            let values = values.into_iter().map(|v| v.unwrap_or(f64::NAN)).collect();
            columns.push((units.header(key, dimension), values));
        }
    }
    let columns: Vec<(&str, &[f64])> = columns.iter().map(|(h, v)| (h.as_str(), v.as_slice())).collect();
    csv::write(&folder.join(FILE), &columns)
}

/// Writes `pull-off.csv`: mean gap and mean pressure along the separation.
///
/// # Errors
/// `Io`.
pub fn write_pull_off(folder: &Path, curve: &[[f64; 2]], units: &ResultUnits) -> Result<()> {
    let [gaps, pressures] = [0, 1].map(|i| curve.iter().map(|point| point[i]).collect::<Vec<f64>>());
    let (gap, pressure) = (units.header("mean_gap", Dimension::Length), units.header("pressure", Dimension::Stress));
    csv::write(&folder.join(PULL_OFF_FILE), &[(&gap, &gaps), (&pressure, &pressures)])
}
