//! Solves a problem along its loads.

use super::{Arguments, Body, LentHeights, LoadKind, Loads, Problem, Reduction};
use crate::estimated::{never_delivered, state_of};
use crate::interface::{AttractionLaw, PlainNotation, in_notation};
use crate::load::{Branch, Load, LoadStep};
use crate::method::{Iteration, MethodCard, MethodKind, NoObserver, Observer, SeparationStep, Stop};
use crate::observe::{WorkPoint, dissipation};
use crate::path::{EstimatorInput, InitialState, LoadPathSolver, Reached, pressures_of_contact};
use crate::results::PullOff;
use crate::state::{State, TrivialLoads};
use asperity_grid::sys::expect_memory;
use asperity_grid::sys::ranks::ALONE;
use asperity_grid::{Error, Result};
use std::ops::ControlFlow;
use std::sync::Mutex;

/// Equilibria of a load path.
#[derive(Debug, Clone)]
pub struct LoadPath {
    /// One for each load, in their order.
    pub states: Vec<State>,
    /// The largest tensile pressure, where it was requested.
    pub pull_off: Option<PullOff>,
    is_adhesive: bool,
}

impl LoadPath {
    /// States of one branch, in the order of the loads.
    pub fn branch(&self, branch: Branch) -> impl Iterator<Item = &State> {
        self.states.iter().filter(move |s| s.branch == branch)
    }

    /// Energy per area that the path dissipates, open or closed: the work of the load less the change of the stored energy. With
    /// adhesion an estimate by trapezoids from the first load on, otherwise the plastic work since first contact.
    pub fn dissipation(&self) -> f64 {
        let path: Vec<WorkPoint> = self.states.iter().filter_map(State::work_point).collect();
        dissipation(&path, self.is_adhesive)
    }
}

/// Progress of a load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Iteration of the present grid.
    pub iteration: usize,
    /// Residual over the mean pressure.
    pub residual: f64,
    /// Estimated fraction of this load, or of the search for the pull-off after all loads, that is done.
    pub fraction: f64,
}

/// Receives the progress of a solve, and stops it. Closures from [`Progress`] to `ControlFlow` are monitors.
pub trait Monitor: Sync {
    /// Called once in each iteration, from any thread; `Break` stops the solver.
    fn progress(&self, progress: Progress) -> ControlFlow<()>;

    /// Whether the solver is to stop. Queried within iterations, too.
    fn stop_requested(&self) -> bool {
        false
    }

    /// Called before the first load with the warnings of [`Problem::warnings`], and after the last one where nothing touches at some of
    /// them.
    fn warnings(&self, _list: &[String]) {}
}

impl<F: Fn(Progress) -> ControlFlow<()> + Sync> Monitor for F {
    fn progress(&self, progress: Progress) -> ControlFlow<()> {
        self(progress)
    }
}

struct Monitored<'m> {
    monitor: &'m dyn Monitor,
    /// Fraction of a search for the pull-off.
    separated: Mutex<Option<f64>>,
}

impl Observer for Monitored<'_> {
    fn iteration(&self, step: Iteration) -> ControlFlow<()> {
        let separated = *self.separated.lock().unwrap_or_else(|e| e.into_inner());
        let fraction = separated.unwrap_or_else(|| step.progress());
        self.monitor.progress(Progress { iteration: step.iteration, residual: step.residual, fraction })
    }

    fn stop_requested(&self) -> bool {
        self.monitor.stop_requested()
    }

    fn separated(&self, step: SeparationStep) {
        *self.separated.lock().unwrap_or_else(|e| e.into_inner()) = Some(step.progress);
    }
}

impl Problem {
    /// The equilibrium under a mean pressure, from first contact.
    ///
    /// # Errors
    /// `Input` for values out of their range, for methods that do not solve for the fields and for those that cannot solve this
    /// problem; `Memory`; `NotConverged`.
    ///
    /// ```
    /// use asperity_contact::problem::Problem;
    /// use asperity_surface::{Spectrum, Surface, SynthesisOptions};
    ///
    /// let spectrum = Spectrum { lambda_s: 1.0 / 8.0, ..Spectrum::CHALLENGE };
    /// let surface = Surface::from_spectrum(spectrum, SynthesisOptions { nodes: 32, length: 1.0, seed: 1 })?;
    /// let state = Problem::new(surface, 1.0).solve(0.05)?;
    /// assert!((state.pressure - 0.05).abs() < 1e-9 && state.mean_gap.is_some_and(|gap| gap > 0.0));
    /// # Ok::<(), asperity_contact::Error>(())
    /// ```
    pub fn solve(&self, mean_pressure: f64) -> Result<State> {
        let mut path = self.load_path(&Loads::new(LoadKind::Pressure, [mean_pressure]))?;
        Ok(path.states.remove(0))
    }

    /// Equilibria under `loads`, one after another: with adhesion, loading and unloading lead to different states.
    ///
    /// # Errors
    /// As [`Problem::solve`]; `Input` for a pull-off without adhesion.
    pub fn load_path(&self, loads: &Loads) -> Result<LoadPath> {
        let mut states = Vec::new();
        let pull_off = walk((self, false), reduced(self, loads)?, loads, &NoObserver, |state| states.push(state))?;
        Ok(LoadPath { states, pull_off, is_adhesive: self.adhesion.is_some() })
    }

    /// As [`Problem::load_path`], with a monitor, and with the errors of maps if they are asked for.
    pub(super) fn watched_load_path(&self, loads: &Loads, map_errors: bool, monitor: &dyn Monitor) -> Result<LoadPath> {
        let mut states = Vec::new();
        let pull_off = self.visit_states(loads, map_errors, monitor, |state| states.push(state))?;
        Ok(LoadPath { states, pull_off, is_adhesive: self.adhesion.is_some() })
    }

    /// As [`Problem::load_path`], with each state passed to `visit` when it is solved: a long path then needs the memory of one
    /// state, and those before an error or interrupt are kept. `monitor` receives the progress and stops the solver.
    ///
    /// # Errors
    /// As [`Problem::load_path`]; `Interrupted` where the monitor stopped the solver.
    ///
    /// ```
    /// use asperity_contact::Error;
    /// use asperity_contact::problem::{LoadKind, Loads, Problem, Progress};
    /// use asperity_surface::{Spectrum, Surface, SynthesisOptions};
    /// use std::ops::ControlFlow;
    ///
    /// let spectrum = Spectrum { lambda_s: 1.0 / 8.0, ..Spectrum::CHALLENGE };
    /// let surface = Surface::from_spectrum(spectrum, SynthesisOptions { nodes: 32, length: 1.0, seed: 1 })?;
    /// let problem = Problem::new(surface, 1.0);
    /// let first = |_: Progress| ControlFlow::Break(());
    /// let stopped = problem.visit_load_path(&Loads::new(LoadKind::PStar, [0.05]), &first, |_| ());
    /// assert!(matches!(stopped, Err(Error::Interrupted)));
    /// # Ok::<(), asperity_contact::Error>(())
    /// ```
    pub fn visit_load_path(
        &self,
        loads: &Loads,
        monitor: &dyn Monitor,
        visit: impl FnMut(State),
    ) -> Result<Option<PullOff>> {
        self.visit_states(loads, false, monitor, visit)
    }

    fn visit_states(
        &self,
        loads: &Loads,
        map_errors: bool,
        monitor: &dyn Monitor,
        visit: impl FnMut(State),
    ) -> Result<Option<PullOff>> {
        let reduction = reduced(self, loads)?;
        monitor.warnings(&warnings(self, &reduction));
        let (mut visit, mut trivial) = (visit, TrivialLoads::default());
        let monitored = Monitored { monitor, separated: Mutex::default() };
        let pull_off = walk((self, map_errors), reduction, loads, &monitored, |state| {
            trivial.add(&state);
            visit(state);
        })?;
        if let texts @ [_, ..] = &trivial.warnings()[..] {
            monitor.warnings(texts);
        }
        Ok(pull_off)
    }

    /// The contact under a mean pressure by any method, those included that do not solve for the fields.
    ///
    /// # Errors
    /// As [`Problem::solve`].
    pub fn estimate(&self, mean_pressure: f64) -> Result<State> {
        self.watched_estimate(mean_pressure, &|_: Progress| ControlFlow::Continue(()))
    }

    /// As [`Problem::estimate`], with a monitor.
    ///
    /// # Errors
    /// As [`Problem::visit_load_path`].
    pub fn watched_estimate(&self, mean_pressure: f64, monitor: &dyn Monitor) -> Result<State> {
        let loads = Loads::new(LoadKind::Pressure, [mean_pressure]);
        if self.method.card().kind == MethodKind::Solver {
            return self.watched_load_path(&loads, false, monitor).map(|mut path| path.states.remove(0));
        }
        let Reduction { model, steps, gradient } = reduced(self, &loads)?;
        let monitored = Monitored { monitor, separated: Mutex::default() };
        let heights = LentHeights::of(self.surface.source(), self.surface.grid(), &ALONE);
        let input = EstimatorInput::new(model.problem(heights.get()), self.method);
        let input = input.map_err(|error| in_own_units(error, self))?;
        let (card, adhesive) = (self.method.card(), model.adhesion != AttractionLaw::None);
        let criterion = self.method.criterion(&self.settings).to_string();
        let mut completed = None;
        let walked = input.walk((&targets(&steps), 0), &monitored, |i, problem, estimate| {
            let mut state = state_of(card, problem, (&steps[i], gradient, &criterion), estimate);
            state.missing.extend(never_delivered(card, adhesive));
            let state = state.with_maps_of(problem.grid, estimate);
            completed = Some(state.in_units(self.surface.length(), self.modulus));
            Ok(())
        });
        walked.map_err(|error| in_own_units(error, self))?;
        Ok(completed.expect("a path that ends without an error has visited its load"))
    }

    /// Bytes that solving for a load takes besides the surface.
    ///
    /// # Errors
    /// As [`Problem::solve`].
    pub fn memory(&self) -> Result<u64> {
        // Any load that is small.
        let Reduction { model, .. } = reduced(self, &Loads::new(LoadKind::Pressure, [1e-6 * self.modulus]))?;
        let heights = LentHeights::of(self.surface.source(), self.surface.grid(), &ALONE);
        let path =
            LoadPathSolver::new(model.problem(heights.get()), self.method, model.resolution, 0.0, &[]).with_stiffness();
        Ok(path.plan(false).bytes)
    }

    /// Warnings about this problem: what the grid does not resolve, slopes and heights that suggest a wrong unit, a load beyond full
    /// contact.
    ///
    /// # Errors
    /// As [`Problem::solve`].
    pub fn warnings(&self, loads: &Loads) -> Result<Vec<String>> {
        Ok(warnings(self, &reduced(self, loads)?))
    }
}

/// Named in errors.
const PLACE: &str = "problem";

/// As plain numbers in the units of the problem.
fn own_units(problem: &Problem) -> PlainNotation {
    PlainNotation { length: problem.surface.length(), modulus: problem.modulus }
}

/// A solver's error in the units of the problem.
fn in_own_units(error: Error, problem: &Problem) -> Error {
    error.rewritten(|text| in_notation(text, &own_units(problem)))
}

/// The problem and its loads, checked.
fn reduced(problem: &Problem, loads: &Loads) -> Result<Reduction> {
    let list = problem.issues(loads, &Arguments);
    match list.is_empty() {
        true => problem.reduced(loads, problem.gradient(), (PLACE, &Arguments)),
        false => Err(Error::Input { place: PLACE.into(), list }),
    }
}

fn warnings(problem: &Problem, reduction: &Reduction) -> Vec<String> {
    let mut list =
        [problem.surface_warnings(reduction), problem.load_warnings(reduction, &own_units(problem))].concat();
    if !problem.surface.is_periodic() && problem.body != Body::NonPeriodic {
        let text = "the map is not periodic and is taken as periodic; `Body::NonPeriodic` or a preparation of the edges avoids that";
        list.push(text.into());
    }
    list
}

fn targets(steps: &[LoadStep]) -> Vec<Load> {
    steps.iter().map(|step| step.target).collect()
}

fn walk(
    (problem, map_errors): (&Problem, bool),
    Reduction { model, mut steps, gradient }: Reduction,
    loads: &Loads,
    observer: &dyn Observer,
    mut visit: impl FnMut(State),
) -> Result<Option<PullOff>> {
    let (method, card) = (problem.method, problem.method.card());
    if card.kind != MethodKind::Solver {
        let accepted = "a method that solves for the fields, or `Problem::estimate`";
        return Err(Error::input(PLACE, "method", card.id, accepted));
    }
    let heights = LentHeights::of(problem.surface.source(), problem.surface.grid(), &ALONE);
    let reduced = model.problem(heights.get());
    if loads.kind == LoadKind::Contact {
        let pressures = pressures_of_contact(&loads.values, &reduced, method, gradient, observer);
        let pressures = pressures.map_err(|error| in_own_units(error, problem))?;
        let pressure_loads = Loads { kind: LoadKind::Pressure, values: pressures, ..loads.clone() }.path();
        steps.iter_mut().zip(pressure_loads).for_each(|(step, pressure)| step.impose(pressure, gradient));
    }
    let targets = targets(&steps);
    let begin = problem
        .initial_gap
        .as_ref()
        .map(|gap| InitialState::Gap(gap.iter().map(|g| g / problem.surface.length()).collect()));
    let path = LoadPathSolver::new(reduced, method, model.resolution, 0.0, &targets);
    let path = path.with_stiffness().with_map_errors(map_errors);
    let advice = "a surface with fewer nodes or Precision::F32 needs less";
    // Besides the solve: the heights, and the maps of a state.
    let maps = 4 * size_of::<f64>() as u64 * path.problem().grid.points() as u64;
    expect_memory(card.id.into(), path.plan(loads.pull_off).bytes.saturating_add(maps), advice)?;
    let criterion = method.criterion(&model.settings).to_string();
    let pulled = path.walk(begin, loads.pull_off, observer, |i, reached| {
        require_converged(&reached, card, path.problem().tolerance, [i + 1, targets.len()])?;
        let numbers = reached.numbers(&steps[i], gradient, &criterion);
        let state = numbers.with_maps(model.grid, &reached.state, problem.adhesion.is_some());
        visit(state.in_units(problem.surface.length(), problem.modulus));
        Ok(())
    });
    let pulled = pulled.map_err(|error| in_own_units(error, problem))?;
    Ok(pulled.map(|p| p.in_units(problem.surface.length(), problem.modulus).on(&problem.surface)))
}

fn require_converged(reached: &Reached, card: &MethodCard, tolerance: f64, [load, loads]: [usize; 2]) -> Result<()> {
    match reached.state.stop {
        Stop::Converged => Ok(()),
        stop => {
            let reason = match stop {
                Stop::Detached => "the tension separates the surfaces, and no equilibrium exists".to_string(),
                stop => stop.to_string(),
            };
            Err(reached.state.not_converged(card.id, format!("load {load} of {loads}: {reason}"), tolerance, None))
        }
    }
}
