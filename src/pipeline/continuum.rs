//! Equilibria of the continuum along a load path.

use super::ProgressReporter;
use super::stage::StageContext;
use crate::pipeline::checkpoint::{Checkpoint, CheckpointWriter};
use crate::report::number::SiNotation;
use crate::scene::GivenUnits;
use crate::{Error, Result};
use asperity_contact::interface::{AttractionLaw, RangeChoice, SubsurfaceRequest};
use asperity_contact::load::{Branch, Load, LoadStep};
use asperity_contact::method::{ReducedProblem, Stop};
use asperity_contact::observe::{Leakage, WorkPoint, dissipation, leakage_bytes};
use asperity_contact::observed::observed;
use asperity_contact::path::{self, InitialState, LoadPathSolver, Reached};
use asperity_contact::results::{ContinuumResults, HardnessMapResults, Onset, RangeResults};
use asperity_contact::state::{Hysteresis, Map, State};
use asperity_grid::sys::expect_memory;
use asperity_grid::units::Scales;
use asperity_grid::{Field, Grid};
use asperity_surface::files::npy;
use std::path::Path;

/// Path of a stage's file relative to the run folder, as in `results.json`.
pub(super) fn in_stage(stage: &str, file: &str) -> String {
    format!("{stage}/{file}")
}

/// Which fields of a state are stored.
#[derive(Debug, Clone, Copy)]
pub(super) struct Keep {
    pub gap: bool,
    pub stress: bool,
}

/// Problem, method and load path of a continuum solution, and labels of its results.
pub(super) struct PathRequest<'a> {
    /// Its adhesion has the requested range, before adaptation to the grid.
    pub problem: ReducedProblem<'a>,
    /// Of the problem's hardness, if it is a map.
    pub hardness_map: Option<HardnessMapResults>,
    pub method: &'a str,
    pub range: RangeChoice,
    pub steps: &'a [LoadStep],
    pub pull_off: bool,
    /// Initial gap, units of L.
    pub start: Option<Vec<f64>>,
    /// Pressure over E* at p* = 1.
    pub gradient: f64,
    /// Units of the results over those of the problem.
    pub scales: Scales,
    /// Those in which errors are written.
    pub units: GivenUnits,
    /// Whether the states before a tension that separates the surfaces are results, or that tension is an error.
    pub outlasts_contact: bool,
    /// Whether the unloading branch is compared with the loading branch.
    pub hysteresis: bool,
    /// Largest gap of a node in contact, units of L.
    pub threshold: f64,
    /// Whether the flow through the gap is solved.
    pub leakage: bool,
    /// Whether the errors of the maps are asked for.
    pub map_errors: bool,
    pub subsurface: Option<SubsurfaceRequest>,
    pub criterion: String,
    /// Which fields of a load's state are stored.
    pub keep: &'a dyn Fn(&LoadStep) -> Keep,
}

/// Solves the equilibria along a load path, and writes fields into the stage folder. A state without convergence is
/// stored under a separate name, and ends the stage with an error. An interrupted path continues from its checkpoint,
/// which is identified by the key of the stage and `tag`. `tag` distinguishes the load paths of one stage.
pub(super) fn load_path(request: PathRequest, context: &StageContext, tag: &str) -> Result<ContinuumResults> {
    let &StageContext { folder, key, listener, .. } = context;
    let method = asperity_methods::find(request.method).expect("checked with the scene");
    let loads: Vec<Load> = request.steps.iter().map(|s| s.target).collect();
    let path = LoadPathSolver::new(request.problem.clone(), method, request.range, request.threshold, &loads);
    let path = path.with_stiffness().with_leakage(request.leakage).with_map_errors(request.map_errors);
    let problem = path.problem();
    let grid = problem.grid;
    check_memory(&path, &request)?;
    let (label, prefix) = match tag {
        "" => (String::new(), String::new()),
        tag => (format!("{tag}: "), format!("{}-", tag.replace(' ', "-"))),
    };
    let (key, stem) = (key.with(tag), format!("{prefix}checkpoint"));
    let checkpoint = Checkpoint::find(folder, &stem, &key, &|w| listener.warn(w));
    let finished = checkpoint.as_ref().map_or(Vec::new(), |c| c.finished.clone());
    let mut states = states_of(&finished, folder)?;
    let writer = CheckpointWriter::new(folder, &stem, key, finished);
    let begin = match checkpoint {
        Some(checkpoint) => Some(checkpoint.begin(problem.ranks)?),
        None => request.start.clone().map(InitialState::Gap),
    };
    let watch = ProgressReporter::new(listener, Some(&writer), &label, (states.len(), loads.len()));
    let mut contact_lost = None;
    let walked = path.walk(begin, request.pull_off, &watch, |i, reached| {
        if reached.state.stop == Stop::Detached && request.outlasts_contact && !states.is_empty() {
            let load = request.units.load(&request.steps[i]);
            let why = format!("contact is lost at load {} of {}, {load}", i + 1, loads.len());
            contact_lost = Some(why.clone());
            return Err(reached.state.not_converged(method.card().id, why, path.problem().tolerance, None));
        }
        let state = stored_state(&request, &request.steps[i], &path, &reached, context, &prefix)?;
        writer.load_finished(serde_json::to_value(&state).map_err(|e| Error::format(folder, e, "finite numbers"))?);
        states.push(state);
        Ok(())
    });
    let (pull_off, pull_off_failure) = match walked.map_err(|e| request.units.rewrite(e)) {
        Ok(state) => (state, None),
        Err(_) if contact_lost.is_some() => (None, None),
        // All loads are solved and remain valid; only the pull-off failed.
        Err(why @ (Error::NotConverged { .. } | Error::Input { .. }))
            if request.pull_off && states.len() == loads.len() =>
        {
            (None, Some(why.to_string().trim_start_matches("pull-off: ").to_string()))
        }
        Err(e) => return Err(e),
    };
    writer.remove_files();
    let (percolation, onset) = (percolation(&states), Onset::of(&states));
    let steps = &request.steps[..states.len()];
    if request.hysteresis {
        compare_branches(&mut states, steps);
    }
    let adhesive = request.problem.adhesion != AttractionLaw::None;
    let has_history = adhesive || problem.hardness.is_some();
    let work_points: Vec<WorkPoint> = states.iter().filter_map(State::work_point).collect();
    let dissipation = has_history.then(|| dissipation(&work_points, adhesive));
    let range = range_results(request.problem.adhesion, path.adhesion(), grid);
    let Scales { length_m: length, modulus_pa: modulus } = request.scales;
    Ok(ContinuumResults {
        method: method.card().id.into(),
        kernel: problem.kernel.described(&SiNotation(request.scales)),
        adhesion: path.adhesion().described(&SiNotation(request.scales)),
        wall: problem.wall.described(&SiNotation(request.scales)),
        hardness: problem.hardness.map(|h| h.mean() * modulus),
        hardness_map: request.hardness_map.map(|map| map.in_units(modulus)),
        nx: grid.nx,
        ny: grid.ny,
        range: range.map(|r| r.in_units(length, modulus)),
        resolved_gradient: Some(problem.resolved_gradient()),
        states,
        dissipation,
        percolation,
        onset,
        pull_off: pull_off.map(|p| p.in_units(length, modulus)),
        contact_lost,
        pull_off_failure,
    })
}

/// The states that a checkpoint has of finished loads.
///
/// # Errors
/// `Format`.
fn states_of(finished: &[serde_json::Value], folder: &Path) -> Result<Vec<State>> {
    let accepted = "results of loads, as this program writes them";
    let state = |value: &serde_json::Value| serde_json::from_value(value.clone());
    finished.iter().map(|value| state(value).map_err(|e| Error::format(folder, e, accepted))).collect()
}

/// Memory that flow through the gap and stress below the surface need in addition to the solver.
pub(super) fn observed_bytes(problem: &ReducedProblem, leakage: bool, subsurface: bool) -> u64 {
    let flow = if leakage { leakage_bytes(problem.grid) } else { 0 };
    flow + if subsurface { path::subsurface_bytes(problem) } else { 0 }
}

/// Checks the available memory.
///
/// # Errors
/// `Memory` if the path needs more.
fn check_memory(path: &LoadPathSolver, request: &PathRequest) -> Result<()> {
    let after = observed_bytes(path.problem(), request.leakage, request.subsurface.is_some());
    let (problem, id) = (path.problem(), path.method().card().id);
    let what = format!("{id} on {} x {} points in {:?}", problem.grid.nx, problem.grid.ny, problem.precision);
    let advice = "a coarser surface.grid or continuum.precision = \"f32\" needs less";
    expect_memory(what, path.plan(request.pull_off).bytes + after, advice)
}

/// Stores the requested fields of a state, and returns its numbers.
///
/// # Errors
/// `NotConverged`, with the file of the gap; `Io`.
fn stored_state(
    request: &PathRequest,
    step: &LoadStep,
    path: &LoadPathSolver,
    reached: &Reached,
    context: &StageContext,
    prefix: &str,
) -> Result<State> {
    let (problem, state) = (path.problem(), &reached.state);
    let grid = problem.grid;
    let partial = state.stop != Stop::Converged;
    let name = format!("{prefix}{}-{}", if partial { "partial" } else { "load" }, step.number());
    let write = |quantity: &str, field: Field| -> Result<String> {
        let file = format!("{name}-{quantity}.npy");
        npy::write_field(&context.folder.join(&file), grid.nx, grid.ny, field, 1.0)?;
        Ok(in_stage(context.stage, &file))
    };
    let extrapolates = request.range == RangeChoice::Extrapolate && request.problem.adhesion != problem.adhesion;
    if extrapolates && !partial && reached.extrapolated.is_none() {
        context.listener.warn(&format!(
            "load {}: no extrapolation to the true range: three grids as coarse as these differ by too much",
            step.number()
        ));
    }
    let keep = (request.keep)(step);
    let plastic = match state.plastic {
        Some(field) if keep.gap && !partial => Some(write("plastic", field)?),
        _ => None,
    };
    let gap = if keep.gap || partial { Some(write("gap", state.gap)?) } else { None };
    if partial {
        let file = Some(context.folder.join(format!("{name}-gap.npy")));
        let reason = format!("load {}: {}", step.index + 1, state.stop);
        return Err(state.not_converged(path.method().card().id, reason, problem.tolerance, file));
    }
    let stress = match keep.stress {
        true if problem.adhesion == AttractionLaw::None => {
            let file = format!("{name}-stress.npy");
            npy::write_contact_pressure(
                state.ranks,
                &context.folder.join(&file),
                [grid.nx, grid.ny],
                state.gap,
                state.stress,
                1.0,
            )?;
            Some(in_stage(context.stage, &file))
        }
        true => Some(write("stress", state.stress)?),
        false => None,
    };
    let subsurface = match &request.subsurface {
        Some(requested) => {
            Some(path::subsurface(requested, (grid, problem.kernel), state.stress, |depth, quantity, values| {
                if !keep.stress {
                    return Ok(None);
                }
                write(&path::subsurface_map(quantity, depth), Field::F64(values)).map(Some)
            })?)
        }
        None => None,
    };
    let adhesive = problem.adhesion != AttractionLaw::None;
    let kind = (adhesive, reached.periodic);
    let (observed, compressive) = observed(grid, state, request.threshold, reached.area.contact_area, kind);
    let numbers = State {
        contact_nodes_compressive: compressive,
        clusters: Some(observed.clusters()),
        observed: Some(observed),
        leakage: flow(request, problem, reached, context, step),
        subsurface,
        gap_map: gap.map(Map::File),
        stress_map: stress.map(Map::File),
        plastic_map: plastic.map(Map::File),
        ..reached.numbers(step, request.gradient, &request.criterion)
    };
    Ok(numbers.in_units(request.scales.length_m, request.scales.modulus_pa))
}

/// The flow through the gap of a state, if requested. Without convergence of the flow a warning.
fn flow(
    request: &PathRequest,
    problem: &ReducedProblem,
    reached: &Reached,
    context: &StageContext,
    step: &LoadStep,
) -> Option<Leakage> {
    if !request.leakage {
        return None;
    }
    let leakage = reached.leakage(problem, reached.state.gap, request.threshold, step);
    if leakage.is_none() {
        context.listener.warn(&format!("load {}: the flow through the gap did not converge", step.number()));
    }
    leakage
}

/// Requested and used range of an adhesion law; None without adhesion.
pub(super) fn range_results(requested: AttractionLaw, used: AttractionLaw, grid: Grid) -> Option<RangeResults> {
    let spacing = grid.dx().max(grid.dy());
    let (resolution_requested, resolution_used) = requested.resolution_on(spacing).zip(used.resolution_on(spacing))?;
    Some(RangeResults {
        gamma: used.work_of_adhesion(),
        requested: requested.range(),
        used: used.range(),
        resolution_requested,
        resolution_used,
    })
}

/// Loads p* between which the gap ceases to percolate on the loading branch: the last load at which it percolates along
/// both x and y, and the next load.
fn percolation(states: &[State]) -> Option<[f64; 2]> {
    let loading: Vec<(f64, bool)> = states
        .iter()
        .take_while(|s| s.branch == Branch::Loading)
        .filter_map(|s| Some((s.p_star, s.observed.as_ref()?.gap_percolates? == [true; 2])))
        .collect();
    loading.windows(2).rfind(|w| w[0].1 && !w[1].1).map(|w| [w[0].0, w[1].0])
}

/// Sets the changes of the unloading states relative to the loading states at the same load.
fn compare_branches(states: &mut [State], steps: &[LoadStep]) {
    let change = |now: f64, then: f64| if now == then { 0.0 } else { (now - then) / then.abs().max(f64::MIN_POSITIVE) };
    for step in steps {
        let Some(same) = step.counterpart else { continue };
        let (area, loading_gap) = (states[same].contact_area, states[same].mean_gap);
        let state = &mut states[step.index];
        let gaps = state.mean_gap.zip(loading_gap);
        state.hysteresis = gaps.map(|(gap, loading)| Hysteresis {
            area: change(state.contact_area, area),
            mean_gap: change(gap, loading),
        });
    }
}

/// Reads an initial gap, units of L.
///
/// # Errors
/// `Format` for another grid or values that are not finite; `Io`.
pub fn start(file: &Path, grid: Grid) -> Result<Vec<f64>> {
    npy::read_on(file, [grid.nx, grid.ny]).map(|field| field.values)
}
