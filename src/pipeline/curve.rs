//! `curve.csv` and `pull-off.csv` of a run: the loads of its continuum in µm and MPa.

use crate::Result;
use crate::record::given_loads::LoadQuantity;
use crate::record::load_table::{self, ForceUnit, ResultUnits};
use crate::record::results::Results;
use asperity_contact::state::State;
use std::path::Path;

/// Micrometres and megapascals of an SI unit.
const UNITS: [f64; 2] = [1e6, 1e-6];

/// Writes one row per load with all scalars, and the curve of the pull-off if there is one.
pub(super) fn write(out: &Path, results: &Results) -> Result<()> {
    let Some(continuum) = &results.continuum else { return Ok(()) };
    let [um, mpa] = UNITS;
    let states: Vec<State> = continuum.states.iter().map(|s| s.clone().in_units(um, mpa)).collect();
    let p_star_of_pressure = states.iter().map(|s| s.p_star / s.pressure).find(|ratio| ratio.is_finite());
    let force = match results.loads.quantity {
        LoadQuantity::Force => p_star_of_pressure
            .map(|ratio| ForceUnit { unit: Some("N".into()), of_pressure: results.loads.of_p_star * ratio }),
        _ => None,
    };
    let units = ResultUnits { length: Some("um".into()), stress: Some("MPa".into()), force };
    load_table::write(out, &states, &units)?;
    let Some(pull_off) = &continuum.pull_off else { return Ok(()) };
    load_table::write_pull_off(out, &pull_off.clone().in_units(um, mpa).curve, &units)
}
