//! `curve.csv` and `pull-off.csv`: one row per load, with the same columns for `run` and `solve`.

use crate::Result;
use asperity_contact::scalars;
use asperity_contact::state::State;
use asperity_grid::units::{Dimension, Unit};
use asperity_surface::files::csv;
use std::path::Path;

pub const FILE: &str = "curve.csv";
pub const PULL_OFF_FILE: &str = "pull-off.csv";

/// Units of lengths and stresses, where they are known.
#[derive(Debug, Clone, Default)]
pub struct ResultUnits {
    pub length: Option<String>,
    pub stress: Option<String>,
    /// Where forces were given.
    pub force: Option<ForceUnit>,
}

/// Normal forces on the map: their unit, and the force under a pressure of one.
#[derive(Debug, Clone)]
pub struct ForceUnit {
    pub unit: Option<String>,
    pub of_pressure: f64,
}

impl ForceUnit {
    /// The force of a state.
    pub fn of(&self, s: &State) -> f64 {
        s.pressure * self.of_pressure
    }
}

impl ResultUnits {
    /// The unit of a dimension; `None` for numbers and for units that are not known.
    pub fn of(&self, dimension: Dimension) -> Option<String> {
        let (stress, length) = (self.stress.as_ref(), self.length.as_ref());
        match dimension.powers() {
            [0, 0] => (dimension == Dimension::Time).then(|| "s".into()),
            [0, 1] => length.cloned(),
            [0, n] => Some(format!("{}{n}", length?)),
            [_, 0] => stress.cloned(),
            [_, -1] => Some(format!("{}_per_{}", stress?, length?)),
            [_, 1] => Some(format!("{}_{}", stress?, length?)),
            [_, n] => Some(format!("{}_{}{n}", stress?, length?)),
        }
    }

    /// SI units of one unit of a dimension, where it is known.
    pub fn si(&self, dimension: Dimension) -> Option<f64> {
        let si = |unit: &Option<String>, power: i32| match power {
            0 => Some(1.0),
            n => Some(Unit::find(unit.as_ref()?)?.si.powi(n)),
        };
        let [of_stress, of_length] = dimension.powers();
        Some(si(&self.stress, of_stress)? * si(&self.length, of_length)?)
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
pub fn write(folder: &Path, states: &[State], units: &ResultUnits) -> Result<()> {
    let numbers: Vec<f64> = (1..=states.len()).map(|n| n as f64).collect();
    let mut columns = vec![("load".to_string(), numbers)];
    if let Some(force) = &units.force {
        let head = force.unit.as_ref().map_or("force".to_string(), |unit| format!("force_{unit}"));
        columns.push((head, states.iter().map(|s| force.of(s)).collect()));
    }
    columns
        .extend(scalars::columns(states).map(|(scalar, values)| (units.header(scalar.key, scalar.dimension), values)));
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
