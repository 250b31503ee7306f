//! `curve.csv` and `pull-off.csv`: one row per load, with the same columns for `run` and `solve`.

use crate::Result;
use asperity_contact::load::Branch;
use asperity_contact::state::State;
use asperity_grid::units::Unit;
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

/// Dimension of a column.
#[derive(Debug, Clone, Copy)]
pub enum Dimension {
    None,
    Length,
    Stress,
    Force,
    /// Energy per area.
    Work,
    /// Stress per length.
    Stiffness,
    Time,
}

type Column = (&'static str, Dimension, fn(&State) -> Option<f64>);

/// Columns of `curve.csv`.
const COLUMNS: [Column; 29] = [
    ("unloading", Dimension::None, |s| Some(f64::from(u8::from(s.branch == Branch::Unloading)))),
    ("pressure", Dimension::Stress, |s| Some(s.pressure)),
    ("p_star", Dimension::None, |s| Some(s.p_star)),
    ("contact_area", Dimension::None, |s| Some(s.contact_area)),
    ("contact_area_error", Dimension::None, |s| s.contact_area_error),
    ("contact_nodes", Dimension::None, |s| s.contact_nodes),
    ("contact_nodes_compressive", Dimension::None, |s| s.contact_nodes_compressive),
    ("mean_gap", Dimension::Length, |s| s.mean_gap),
    ("mean_gap_error", Dimension::Length, |s| s.mean_gap_error),
    ("displacement", Dimension::Length, |s| s.displacement),
    ("stiffness", Dimension::Stiffness, |s| s.stiffness),
    ("stiffness_error", Dimension::Stiffness, |s| s.stiffness_error),
    ("hydraulic_gap_x", Dimension::Length, |s| s.leakage.map(|l| l.hydraulic_gaps()[0])),
    ("hydraulic_gap_x_error", Dimension::Length, |s| s.leakage?.gap_errors.map(|e| e[0])),
    ("hydraulic_gap_y", Dimension::Length, |s| s.leakage.map(|l| l.hydraulic_gaps()[1])),
    ("hydraulic_gap_y_error", Dimension::Length, |s| s.leakage?.gap_errors.map(|e| e[1])),
    ("hydraulic_gap_effective_medium", Dimension::Length, |s| s.leakage.map(|l| l.effective_medium.cbrt())),
    ("energy", Dimension::Work, |s| s.energy),
    ("elastic_energy", Dimension::Work, |s| s.elastic_energy),
    ("interaction_energy", Dimension::Work, |s| s.interaction_energy),
    ("flowing_fraction", Dimension::None, |s| s.plasticity.map(|p| p.flowing)),
    ("displaced_fraction", Dimension::None, |s| s.plasticity.map(|p| p.displaced)),
    ("mean_plastic_displacement", Dimension::Length, |s| s.plasticity.map(|p| p.displacement)),
    ("plastic_work", Dimension::Work, |s| s.plasticity.map(|p| p.work)),
    ("load_error", Dimension::None, |s| Some(s.load_error)),
    ("residual", Dimension::None, |s| s.residual),
    ("iterations", Dimension::None, |s| Some(s.iterations as f64)),
    ("fft_pairs", Dimension::None, |s| Some(s.fft_pairs)),
    ("seconds", Dimension::Time, |s| Some(s.seconds)),
];

impl ResultUnits {
    /// The unit of a dimension; `None` for numbers and for units that are not known.
    pub fn of(&self, dimension: Dimension) -> Option<String> {
        let joined = |between: &str| Some(format!("{}{between}{}", self.stress.as_ref()?, self.length.as_ref()?));
        match dimension {
            Dimension::None => None,
            Dimension::Length => self.length.clone(),
            Dimension::Stress => self.stress.clone(),
            Dimension::Force => joined("_").map(|work| work + "2"),
            Dimension::Work => joined("_"),
            Dimension::Stiffness => joined("_per_"),
            Dimension::Time => Some("s".into()),
        }
    }

    /// SI units of one unit of a dimension, where it is known.
    pub fn si(&self, dimension: Dimension) -> Option<f64> {
        let [length, stress] = [&self.length, &self.stress].map(|unit| Some(Unit::find(unit.as_ref()?)?.si));
        match dimension {
            Dimension::None | Dimension::Time => Some(1.0),
            Dimension::Length => length,
            Dimension::Stress => stress,
            Dimension::Force => Some(stress? * length? * length?),
            Dimension::Work => Some(stress? * length?),
            Dimension::Stiffness => Some(stress? / length?),
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
pub fn write(folder: &Path, states: &[State], units: &ResultUnits) -> Result<()> {
    let numbers: Vec<f64> = (1..=states.len()).map(|n| n as f64).collect();
    let mut columns = vec![("load".to_string(), numbers)];
    if let Some(force) = &units.force {
        let head = force.unit.as_ref().map_or("force".to_string(), |unit| format!("force_{unit}"));
        columns.push((head, states.iter().map(|s| force.of(s)).collect()));
    }
    for (key, dimension, of) in COLUMNS {
        let values: Vec<Option<f64>> = states.iter().map(of).collect();
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
