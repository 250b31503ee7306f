//! `curve.csv` and `pull-off.csv` of a run: the loads of its continuum in µm and MPa.

use crate::Result;
use crate::record::load_table::{self, ResultUnits};
use crate::record::results::Results;
use asperity_contact::load::Branch;
use asperity_contact::results::StateResults;
use serde_json::{Value, json};
use std::path::Path;

/// Writes one row per load with all scalars, and the curve of the pull-off if there is one.
pub(super) fn write(out: &Path, results: &Results) -> Result<()> {
    let Some(continuum) = &results.continuum else { return Ok(()) };
    let (um, mpa) = (results.scales.length_m * 1e6, results.scales.modulus_pa * 1e-6);
    let units = ResultUnits { length: Some("um".into()), stress: Some("MPa".into()) };
    let rows: Vec<Value> = continuum.states.iter().map(|state| row(state, um, mpa)).collect();
    load_table::write(out, &rows, &units)?;
    let Some(pull_off) = &continuum.pull_off else { return Ok(()) };
    let curve: Vec<[f64; 2]> = pull_off.curve.iter().map(|[gap, pressure]| [gap * um, pressure * mpa]).collect();
    load_table::write_pull_off(out, &curve, &units)
}

fn row(s: &StateResults, um: f64, mpa: f64) -> Value {
    let (n, work) = (&s.numbers, um * mpa);
    let gaps = s.leakage.map(|l| l.hydraulic_gaps());
    let errors = s.leakage.and_then(|l| l.gap_errors);
    json!({
        "unloading": u8::from(s.branch == Branch::Unloading),
        "pressure": n.pressure * mpa,
        "p_star": n.p_star,
        "contact_area": n.contact_area,
        "contact_area_error": n.contact_area_error,
        "contact_nodes": s.contact_nodes,
        "mean_gap": s.mean_gap * um,
        "mean_gap_error": s.mean_gap_error.map(|e| e * um),
        "displacement": n.displacement.map(|d| d * um),
        "stiffness": n.stiffness.map(|k| k * mpa / um),
        "stiffness_error": n.stiffness_error.map(|k| k * mpa / um),
        "hydraulic_gap_x": gaps.map(|g| g[0] * um),
        "hydraulic_gap_x_error": errors.map(|g| g[0] * um),
        "hydraulic_gap_y": gaps.map(|g| g[1] * um),
        "hydraulic_gap_y_error": errors.map(|g| g[1] * um),
        "energy": s.energy * work,
        "elastic_energy": s.elastic_energy * work,
        "interaction_energy": s.interaction_energy * work,
        "flowing_fraction": s.plasticity.map(|p| p.flowing),
        "displaced_fraction": s.plasticity.map(|p| p.displaced),
        "mean_plastic_displacement": s.plasticity.map(|p| p.displacement * um),
        "plastic_work": s.plasticity.map(|p| p.work * work),
        "load_error": n.load_error,
        "residual": s.residual,
        "iterations": n.iterations,
        "fft_pairs": n.fft_pairs,
        "seconds": n.seconds,
    })
}
