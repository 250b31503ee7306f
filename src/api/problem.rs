//! Solves contact problems.

use super::estimate::Estimate;
use super::state::{LoadPath, PullOff, State};
use crate::{Error, Result};
use asperity_contact::load::{Load, LoadStep};
use asperity_contact::method::{MethodCard, MethodKind, NoObserver, Observer, ReducedProblem, Stop};
use asperity_contact::path::{self, InitialState};
use asperity_contact::problem::{Arguments, Body, LentHeights, LoadKind, Loads, Problem, Reduction};
use asperity_grid::sys::ranks::ALONE;
use std::ops::ControlFlow;

/// Progress of a load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Iteration of the present grid.
    pub iteration: usize,
    /// Residual over the mean pressure.
    pub residual: f64,
    /// Estimated fraction of this load that is done.
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

    /// Called once before the first load, with the warnings of [`Solve::warnings`].
    fn warnings(&self, _list: &[String]) {}
}

impl<F: Fn(Progress) -> ControlFlow<()> + Sync> Monitor for F {
    fn progress(&self, progress: Progress) -> ControlFlow<()> {
        self(progress)
    }
}

struct Monitored<'m>(&'m dyn Monitor);

impl Observer for Monitored<'_> {
    fn iteration(&self, step: asperity_contact::method::Iteration) -> ControlFlow<()> {
        let fraction = step.progress();
        self.0.progress(Progress { iteration: step.iteration, residual: step.residual, fraction })
    }

    fn stop_requested(&self) -> bool {
        self.0.stop_requested()
    }
}

/// The method with an id of [`methods()`](crate::methods()); `auto` is the fastest that solves for the fields.
///
/// # Errors
/// `Input` for an unknown id.
pub fn method(id: &str) -> Result<&'static dyn asperity_contact::method::ContactMethod> {
    let accepted = || asperity_methods::ids().join(", ");
    asperity_methods::find(id).ok_or_else(|| Error::input(PLACE, "method", format!("{id:?}"), accepted()))
}

/// Solves a [`Problem`].
pub trait Solve {
    /// The equilibrium under a mean pressure, from first contact.
    ///
    /// # Errors
    /// `Input` for values out of their range, for methods that do not solve for the fields and for those that cannot solve this
    /// problem; `Memory`; `NotConverged`.
    ///
    /// ```
    /// use asperity::{Problem, Solve, Spectrum, Surface, SynthesisOptions};
    ///
    /// let spectrum = Spectrum { lambda_s: 1.0 / 8.0, ..Spectrum::CHALLENGE };
    /// let surface = Surface::from_spectrum(spectrum, SynthesisOptions { nodes: 32, length: 1.0, seed: 1 })?;
    /// let state = Problem::new(surface, 1.0).solve(0.05)?;
    /// assert!((state.pressure.mean().unwrap() - 0.05).abs() < 1e-9);
    /// assert!(state.gap.iter().all(|g| *g >= 0.0));
    /// # Ok::<(), asperity::Error>(())
    /// ```
    fn solve(&self, mean_pressure: f64) -> Result<State>;

    /// Equilibria under `loads`, one after another: with adhesion, loading and unloading lead to different states.
    ///
    /// # Errors
    /// As [`Solve::solve`]; `Input` for a pull-off without adhesion.
    fn load_path(&self, loads: &Loads) -> Result<LoadPath>;

    /// As [`Solve::load_path`], with each state passed to `visit` when it is solved: a long path then needs the memory of one
    /// state, and those before an error or interrupt are kept. `monitor` receives the progress and stops the solver.
    ///
    /// # Errors
    /// As [`Solve::load_path`]; `Interrupted` where the monitor stopped the solver.
    ///
    /// ```
    /// use asperity::{Error, LoadKind, Loads, Problem, Progress, Solve, Spectrum, Surface, SynthesisOptions};
    /// use std::ops::ControlFlow;
    ///
    /// let spectrum = Spectrum { lambda_s: 1.0 / 8.0, ..Spectrum::CHALLENGE };
    /// let surface = Surface::from_spectrum(spectrum, SynthesisOptions { nodes: 32, length: 1.0, seed: 1 })?;
    /// let problem = Problem::new(surface, 1.0);
    /// let first = |_: Progress| ControlFlow::Break(());
    /// let stopped = problem.visit_load_path(&Loads::new(LoadKind::PStar, [0.05]), &first, |_| ());
    /// assert!(matches!(stopped, Err(Error::Interrupted)));
    /// # Ok::<(), asperity::Error>(())
    /// ```
    fn visit_load_path(
        &self,
        loads: &Loads,
        monitor: &dyn Monitor,
        visit: impl FnMut(State),
    ) -> Result<Option<PullOff>>;

    /// The contact under a mean pressure by any method, those included that do not solve for the fields.
    ///
    /// # Errors
    /// As [`Solve::solve`].
    fn estimate(&self, mean_pressure: f64) -> Result<Estimate>;

    /// Bytes that solving for a load takes besides the surface.
    ///
    /// # Errors
    /// As [`Solve::solve`].
    fn memory(&self) -> Result<u64>;

    /// Warnings about this problem: what the grid does not resolve, slopes and heights that suggest a wrong unit, a load beyond full
    /// contact.
    ///
    /// # Errors
    /// As [`Solve::solve`].
    fn warnings(&self, loads: &Loads) -> Result<Vec<String>>;
}

impl Solve for Problem {
    fn solve(&self, mean_pressure: f64) -> Result<State> {
        let mut path = self.load_path(&Loads::new(LoadKind::Pressure, [mean_pressure]))?;
        Ok(path.states.remove(0))
    }

    fn load_path(&self, loads: &Loads) -> Result<LoadPath> {
        let mut states = Vec::new();
        let pull_off = walk(self, reduced(self, loads)?, loads, &NoObserver, |state| states.push(state))?;
        Ok(LoadPath { states, pull_off, is_adhesive: self.adhesion.is_some() })
    }

    fn visit_load_path(
        &self,
        loads: &Loads,
        monitor: &dyn Monitor,
        visit: impl FnMut(State),
    ) -> Result<Option<PullOff>> {
        let reduction = reduced(self, loads)?;
        monitor.warnings(&warnings(self, &reduction));
        walk(self, reduction, loads, &Monitored(monitor), visit)
    }

    fn estimate(&self, mean_pressure: f64) -> Result<Estimate> {
        if self.method.card().kind == MethodKind::Solver {
            return Ok(Estimate::of_state(self.solve(mean_pressure)?, self.method, &self.settings));
        }
        let Reduction { model, steps, .. } = reduced(self, &Loads::new(LoadKind::Pressure, [mean_pressure]))?;
        let heights = LentHeights::of(self.surface.source(), &ALONE);
        let input = path::EstimatorInput::new(model.problem(heights.get()), self.method)?;
        let mut completed = None;
        input.walk((&targets(&steps), 0), &NoObserver, |_, problem, estimate| {
            completed = Some(Estimate::new((self.surface.length(), self.modulus), self.method, problem, estimate));
            Ok(())
        })?;
        Ok(completed.expect("a path that ends without an error has visited its load"))
    }

    fn memory(&self) -> Result<u64> {
        // Any load that is small.
        let Reduction { model, .. } = reduced(self, &Loads::new(LoadKind::Pressure, [1e-6 * self.modulus]))?;
        let heights = LentHeights::of(self.surface.source(), &ALONE);
        let path = path::LoadPathSolver::new(model.problem(heights.get()), self.method, model.resolution, 0.0, &[]);
        Ok(path.plan(false).bytes)
    }

    fn warnings(&self, loads: &Loads) -> Result<Vec<String>> {
        Ok(warnings(self, &reduced(self, loads)?))
    }
}

/// Named in errors.
const PLACE: &str = "problem";

/// The problem and its loads, checked.
fn reduced(problem: &Problem, loads: &Loads) -> Result<Reduction> {
    let list = problem.issues(loads, &Arguments);
    match list.is_empty() {
        true => problem.reduced(loads, problem.gradient(), (PLACE, &Arguments)),
        false => Err(Error::Input { place: PLACE.into(), list }),
    }
}

fn warnings(problem: &Problem, reduction: &Reduction) -> Vec<String> {
    let mut list = [problem.surface_warnings(reduction), problem.load_warnings(reduction)].concat();
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
    problem: &Problem,
    Reduction { model, mut steps, gradient }: Reduction,
    loads: &Loads,
    observer: &dyn Observer,
    mut visit: impl FnMut(State),
) -> Result<Option<PullOff>> {
    let (method, card) = (problem.method, problem.method.card());
    if card.kind != MethodKind::Solver {
        let accepted = "a method that solves for the fields, or `Solve::estimate`";
        return Err(Error::input(PLACE, "method", card.id, accepted));
    }
    let heights = LentHeights::of(problem.surface.source(), &ALONE);
    let reduced: ReducedProblem = model.problem(heights.get());
    if loads.kind == LoadKind::Contact {
        let pressures = path::pressures_of_contact(&loads.values, &reduced, method, gradient, observer)?;
        let found = Loads { kind: LoadKind::Pressure, values: pressures, ..loads.clone() }.path();
        steps.iter_mut().zip(found).for_each(|(step, pressure)| step.target = Load::Pressure(pressure));
    }
    let targets = targets(&steps);
    let begin = problem
        .initial_gap
        .as_ref()
        .map(|gap| InitialState::Gap(gap.iter().map(|g| g / problem.surface.length()).collect()));
    let path = path::LoadPathSolver::new(reduced, method, model.resolution, 0.0, &targets);
    let (need, have) = (path.plan(loads.pull_off).bytes, asperity_grid::sys::available_memory_bytes());
    if need > have {
        let advice = "a surface with fewer nodes or Precision::F32 needs less".into();
        return Err(Error::Memory { what: card.id.into(), need, have, advice });
    }
    let path = path.with_stiffness();
    let pulled = path.walk(begin, loads.pull_off, observer, |i, reached| {
        require_converged(&reached, card, path.problem().tolerance, [i + 1, targets.len()])?;
        let mut state = State::new((&problem.surface, problem.modulus, problem.body), &steps[i], &reached);
        if problem.adhesion.is_none() {
            state.clear_open_pressure();
        }
        visit(state);
        Ok(())
    })?;
    Ok(pulled.map(|p| PullOff::new(problem.surface.length(), problem.modulus, &p)))
}

fn require_converged(
    reached: &path::Reached,
    card: &MethodCard,
    tolerance: f64,
    [load, loads]: [usize; 2],
) -> Result<()> {
    match reached.state.stop {
        Stop::Converged => Ok(()),
        Stop::Interrupted => Err(Error::Interrupted),
        stop => {
            let reason = match stop {
                Stop::Detached => "the tension separates the surfaces, and no equilibrium exists".to_string(),
                stop => stop.to_string(),
            };
            Err(reached.state.not_converged(card.id, format!("load {load} of {loads}: {reason}"), tolerance, None))
        }
    }
}
