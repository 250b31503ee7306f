//! Stages of the continuum: the surface in numbers, and equilibria along the load path.

use super::Listener;
use crate::grid::{Field, Grid};
use crate::method::{self, Iteration, Load, Problem, State, Stop};
use crate::observe::{Connectivity, contact_area, contact_map, patch_sizes};
use crate::record::npy;
use crate::record::results::{ContinuumResults, PsdPoint, StateResults, Statistic, SurfaceResults};
use crate::scene::{Case, Surface};
use crate::surface::{Expected, moments, psd, range};
use crate::{Error, Result};
use std::ops::ControlFlow;
use std::path::Path;

/// Name of a stage folder's file as `results.json` names it, relative to the run folder.
fn in_stage(stage: &str, file: &str) -> String {
    format!("{stage}/{file}")
}

/// Statistics of heights, expected against realised, and their spectrum; heights go to `heights.npy`.
pub(super) fn surface(case: &Case, heights: &[f64], folder: &Path, stage: &str) -> Result<SurfaceResults> {
    npy::write(&folder.join("heights.npy"), case.grid.nx, case.grid.ny, heights.iter().copied())?;
    Ok(SurfaceResults {
        origin: case.surface.origin(),
        nx: case.grid.nx,
        ny: case.grid.ny,
        aspect: case.grid.ly / case.grid.lx,
        heights: in_stage(stage, "heights.npy"),
        statistics: statistics(&case.surface, case.grid, heights, case.scales.length_m * 1e6),
        psd: spectrum(&case.surface, case.grid, heights),
    })
}

/// The table "expected against realised" of heights on their grid. Expected values are those of the whole spectrum, beside
/// those of the modes that the grid holds, where it does not hold all.
pub fn statistics(surface: &Surface, grid: Grid, heights: &[f64], length_um: f64) -> Vec<Statistic> {
    let (m, r) = (moments(grid, heights), range(heights));
    let (expected, held) = match surface {
        Surface::Synthesised { spectrum, modes, .. } => (
            Some(spectrum.expected(grid.ly / grid.lx, 0.0)),
            (!modes.held_by(grid)).then(|| spectrum.expected_on(grid)),
        ),
        Surface::Imported { .. } => (None, None),
    };
    let line = |name: &str, symbol: &str, unit: &str, of: Option<&dyn Fn(&Expected) -> f64>, realised: f64| Statistic {
        name: name.into(),
        symbol: symbol.into(),
        unit: unit.into(),
        expected: of.and_then(|of| expected.as_ref().map(of)),
        held: of.and_then(|of| held.as_ref().map(of)),
        realised,
        band: None,
    };
    let um = length_um;
    let band = held.as_ref().or(expected.as_ref()).map(|e| e.rms_height_band * um);
    vec![
        Statistic { band, ..line("rms height", "h_rms", "µm", Some(&|e| e.rms_height * um), m.rms_height * um) },
        line("rms gradient", "ḡ", "1", Some(&|e| e.rms_gradient), m.rms_gradient),
        line(
            "curvature radius",
            "R_c",
            "nm",
            Some(&|e| e.curvature_radius * um * 1e3),
            m.curvature_radius() * um * 1e3,
        ),
        line("profile moment m0", "m0", "µm²", Some(&|e| e.m0 * um * um), m.m0 * um * um),
        line("profile moment m2", "m2", "1", Some(&|e| e.m2), m.m2),
        line("profile moment m4", "m4", "µm⁻²", Some(&|e| e.m4 / um / um), m.m4 / um / um),
        line("Nayak's bandwidth parameter", "α", "1", Some(&|e| e.nayak()), m.nayak()),
        line("mean minus lowest height (first-touch mean gap)", "h̄ - h_min", "µm", None, (r.mean - r.min) * um),
        line("range of heights", "h_max - h_min", "µm", None, (r.max - r.min) * um),
        line(
            "elastic energy of full contact",
            "U_el",
            "µm E*",
            Some(&|e| e.full_contact_energy * um),
            m.full_contact_energy * um,
        ),
    ]
}

fn spectrum(surface: &Surface, grid: Grid, heights: &[f64]) -> Vec<PsdPoint> {
    let power = match surface {
        Surface::Synthesised { spectrum, .. } => {
            let scale = spectrum.expected(grid.ly / grid.lx, 0.0).power_scale;
            Some(move |n: f64| spectrum.relative_power(n) * scale)
        }
        Surface::Imported { .. } => None,
    };
    let bins = psd(grid, heights, |n| power.as_ref().map_or(0.0, |p| p(n)));
    bins.iter()
        .map(|b| PsdPoint { mode: b.mode, realised: b.power, expected: power.as_ref().map(|_| b.expected) })
        .collect()
}

/// "soft wall, load-1" is for people.
fn file_name(name: &str) -> String {
    name.replace(", ", "-").replace(' ', "-")
}

/// Which of the fields of a state are kept.
#[derive(Debug, Clone, Copy)]
pub(super) struct Keep {
    pub gap: bool,
    pub stress: bool,
}

/// What to solve, with what, and how its results are labelled.
pub(super) struct LoadPath<'a> {
    pub problem: Problem<'a>,
    pub method: &'a str,
    /// p* and the pressure over E* of each load.
    pub loads: Vec<(f64, f64)>,
    /// Gap at and below which a node counts as touching.
    pub threshold: f64,
    pub criterion: String,
    pub keep: Keep,
}

/// Equilibria along a load path, fields into `folder`. A state that is not converged is kept beside the others under a
/// name that says so, and ends the stage with its error. `tag` tells several paths of one stage apart.
pub(super) fn load_path(
    path: &LoadPath,
    folder: &Path,
    stage: &str,
    tag: &str,
    listener: &dyn Listener,
) -> Result<ContinuumResults> {
    let method = method::find(path.method).expect("checked with the scene");
    let problem = &path.problem;
    let plan = method.plan(problem);
    let have = crate::sys::available_memory_bytes();
    if plan.bytes > have {
        return Err(Error::Memory {
            what: format!(
                "{} on {} x {} points in {:?}",
                method.card().id,
                problem.grid.nx,
                problem.grid.ny,
                problem.precision
            ),
            need: plan.bytes,
            have,
            advice: "a coarser surface.grid or continuum.precision = \"f32\" needs less".into(),
        });
    }
    let of = path.loads.len();
    let (said, prefix) = match tag {
        "" => (String::new(), String::new()),
        tag => (format!("{tag}: "), format!("{}-", tag.replace(' ', "-"))),
    };
    let current = std::sync::atomic::AtomicUsize::new(0);
    let watch = |step: Iteration| {
        if step.iteration.is_multiple_of(10) {
            let load = current.load(std::sync::atomic::Ordering::Relaxed);
            // Residuals fall about exponentially from 1: their logarithm is the share done.
            let share = (step.residual.min(1.0).ln() / step.tolerance.ln()).clamp(0.0, 1.0);
            let message = format!(
                "{said}load {} of {of}, iteration {}, residual {:.1e}",
                load + 1,
                step.iteration,
                step.residual
            );
            listener.progress(Some((load as f64 + share) / of as f64), &message);
        }
        if listener.stopping() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let mut run = method.start(problem, &watch)?;
    let mut states = Vec::new();
    for (i, &(p_star, pressure)) in path.loads.iter().enumerate() {
        current.store(i, std::sync::atomic::Ordering::Relaxed);
        let state = run.equilibrate(Load::Pressure(pressure))?;
        let kind = if state.stop == Stop::Converged { "load" } else { "partial" };
        let name = format!("{prefix}{kind}-{}", i + 1);
        let grid = problem.grid;
        let write = |quantity: &str, field: Field| -> Result<String> {
            let file = format!("{}-{quantity}.npy", file_name(&name));
            npy::write(&folder.join(&file), grid.nx, grid.ny, (0..field.len()).map(|i| field.at(i)))?;
            Ok(in_stage(stage, &file))
        };
        let partial = state.stop != Stop::Converged;
        let gap = if path.keep.gap || partial { Some(write("gap", state.gap)?) } else { None };
        let stress = if path.keep.stress { Some(write("stress", state.stress)?) } else { None };
        match state.stop {
            Stop::Converged => {}
            Stop::Interrupted => return Err(Error::Interrupted),
            stop => {
                return Err(Error::NotConverged {
                    method: method.card().id,
                    why: stop.to_string(),
                    iterations: state.iterations,
                    residual: state.residual,
                    tolerance: problem.tolerance,
                    partial: Some(folder.join(format!("{}-gap.npy", file_name(&name)))),
                });
            }
        }
        states.push(summary(&state, grid, (p_star, pressure), (path.threshold, &path.criterion), gap, stress));
    }
    Ok(ContinuumResults {
        method: method.card().id.into(),
        kernel: problem.kernel.to_string(),
        adhesion: problem.adhesion.to_string(),
        wall: problem.wall.to_string(),
        nx: problem.grid.nx,
        ny: problem.grid.ny,
        states,
    })
}

/// A state in numbers.
fn summary(
    state: &State,
    grid: Grid,
    (p_star, pressure): (f64, f64),
    (threshold, criterion): (f64, &str),
    gap: Option<String>,
    stress: Option<String>,
) -> StateResults {
    let area = contact_area(grid, state.gap, threshold);
    let patches = patch_sizes(&contact_map(state.gap, threshold), grid.nx, Connectivity::Eight).len();
    StateResults {
        p_star,
        pressure,
        criterion: criterion.into(),
        contact_fraction: area.fraction,
        contact_fraction_corrected: area.corrected,
        mean_gap: state.mean_gap,
        patches,
        energy: state.energy,
        interaction_energy: state.interaction_energy,
        load_error: state.load_error,
        residual: state.residual,
        complementarity: state.complementarity,
        stop: state.stop.to_string(),
        iterations: state.iterations,
        fft_pairs: state.fft_pairs,
        seconds: state.seconds,
        gap,
        stress,
    }
}

/// The laboratory-scale problem of a case.
pub(super) fn laboratory(
    case: &Case,
    heights: &[f64],
    folder: &Path,
    stage: &str,
    listener: &dyn Listener,
) -> Result<ContinuumResults> {
    let path = LoadPath {
        problem: case.problem(heights.into()),
        method: &case.scene.continuum.method,
        loads: case.scene.load.p_star.iter().copied().zip(case.pressures()).collect(),
        threshold: 0.0,
        criterion: "zero gap".into(),
        keep: Keep { gap: true, stress: true },
    };
    load_path(&path, folder, stage, "", listener)
}
