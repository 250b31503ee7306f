//! `curve.csv` and `pull-off.csv` of a run: the loads of its continuum in laboratory units.

use crate::Result;
use crate::load::Branch;
use crate::record::csv;
use crate::record::results::{ContinuumResults, Results, StateResults};
use std::path::Path;

pub(super) const FILE: &str = "curve.csv";
pub(super) const PULL_OFF_FILE: &str = "pull-off.csv";

/// Writes one row per load with all scalars, and the curve of the pull-off if there is one.
pub(super) fn write(out: &Path, results: &Results) -> Result<()> {
    let Some(continuum) = &results.continuum else { return Ok(()) };
    let (um, mpa) = (results.scales.length_m * 1e6, results.scales.modulus_pa * 1e-6);
    states(out, continuum, um, mpa)?;
    let Some(pull_off) = &continuum.pull_off else { return Ok(()) };
    let gaps: Vec<f64> = pull_off.curve.iter().map(|[gap, _]| gap * um).collect();
    let pressures: Vec<f64> = pull_off.curve.iter().map(|[_, pressure]| pressure * mpa).collect();
    csv::write(&out.join(PULL_OFF_FILE), &[("mean_gap_um", &gaps), ("pressure_mpa", &pressures)])
}

/// Header and values of a column.
type Column<'a> = (&'a str, &'a dyn Fn(&StateResults) -> f64);

fn states(out: &Path, continuum: &ContinuumResults, um: f64, mpa: f64) -> Result<()> {
    let work = um * mpa;
    let columns: [Column; 21] = [
        ("load", &|s| (s.numbers.index + 1) as f64),
        ("unloading", &|s| f64::from(u8::from(s.branch == Branch::Unloading))),
        ("p_star", &|s| s.numbers.p_star),
        ("pressure_mpa", &|s| s.numbers.pressure * mpa),
        ("contact_fraction", &|s| s.numbers.contact_fraction),
        ("contact_fraction_corrected", &|s| s.contact_fraction_corrected),
        ("mean_gap_um", &|s| s.mean_gap * um),
        ("displacement_um", &|s| s.numbers.displacement.map_or(f64::NAN, |d| d * um)),
        ("stiffness_mpa_per_um", &|s| s.numbers.stiffness.map_or(f64::NAN, |k| k * mpa / um)),
        ("hydraulic_gap_x_um", &|s| s.leakage.map_or(f64::NAN, |l| l.hydraulic_gaps()[0] * um)),
        ("hydraulic_gap_y_um", &|s| s.leakage.map_or(f64::NAN, |l| l.hydraulic_gaps()[1] * um)),
        ("energy_j_per_m2", &|s| s.energy * work),
        ("load_error", &|s| s.numbers.load_error),
        ("residual", &|s| s.residual),
        ("iterations", &|s| s.numbers.iterations as f64),
        ("fft_pairs", &|s| s.numbers.fft_pairs),
        ("seconds", &|s| s.numbers.seconds),
        ("flowing_fraction", &|s| s.plasticity.map_or(f64::NAN, |p| p.flowing)),
        ("displaced_fraction", &|s| s.plasticity.map_or(f64::NAN, |p| p.displaced)),
        ("mean_plastic_displacement_um", &|s| s.plasticity.map_or(f64::NAN, |p| p.displacement * um)),
        ("plastic_work_j_per_m2", &|s| s.plasticity.map_or(f64::NAN, |p| p.work * work)),
    ];
    // The last four are of bodies with a hardness.
    let count = columns.len() - if continuum.hardness.is_some() { 0 } else { 4 };
    let columns: Vec<(&str, Vec<f64>)> =
        columns[..count].iter().map(|(header, of)| (*header, continuum.states.iter().map(of).collect())).collect();
    let columns: Vec<(&str, &[f64])> = columns.iter().map(|(header, values)| (*header, values.as_slice())).collect();
    csv::write(&out.join(FILE), &columns)
}
