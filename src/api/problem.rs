//! The contact problem and its solution.

use super::Surface;
use super::arrays::row_major;
use super::body::Body;
use super::loads::Loads;
use super::state::LoadPath;
use crate::pipeline::{never_delivered, state_of};
use crate::scene::{
    AdhesionLaw, AdhesionScene, Case, ContinuumScene, CrystalScene, LayerScene, Length, LoadScene, Scene, Stress,
    WallKind, Work, last_part, rename_keys,
};
use crate::{Error, Result};
use asperity_contact::interface::{AttractionLaw, RangeChoice, TabulatedLaw};
use asperity_contact::load::Load;
use asperity_contact::method::{MethodCard, MethodKind, NoObserver, Observer, Precision, Stop, Targets};
use asperity_contact::path::{self, InitialState};
use asperity_contact::results::PullOff;
use asperity_contact::state::State;
use ndarray::Array2;
use std::ops::ControlFlow;
use std::sync::Arc;

/// A rigid rough surface on an elastic body.
///
/// Units are those of the caller: lengths have the unit of the surface, pressures that of the modulus, and energies per area
/// their product. With 1 for the extent of the cell and for the modulus, all results are in reduced units.
#[derive(Debug, Clone)]
pub struct Problem {
    /// The rough surface.
    pub surface: Surface,
    /// Contact modulus E* = E/(1-ν²).
    pub modulus: f64,
    /// The elastic body.
    pub body: Body,
    /// Attraction between the surfaces; none by default.
    pub adhesion: Option<Adhesion>,
    /// Compliance of the repulsion: the penetration under a pressure of E*. None, the default, is a hard wall.
    pub penalty_length: Option<f64>,
    /// Hardness, in the unit of the modulus: the largest contact pressure. Where it is reached, the surface flows, and keeps its
    /// shape on unloading (methods fast, bvm and gfmd). None, the default, is an elastic body.
    pub hardness: Option<Hardness>,
    /// An id of [`methods()`](crate::methods()); `"auto"`, the default, is the fastest that solves for the fields.
    pub method: String,
    /// Floating-point type of the fields.
    pub precision: Precision,
    /// Largest rms residual over the mean pressure. Default: 1e-8, in single precision what rounding allows.
    pub tolerance: Option<f64>,
    /// Estimated errors at which a solver may stop before the residual has reached the tolerance.
    pub targets: Targets,
    /// Iterations per load after which a solver stops.
    pub max_iterations: usize,
    /// Gap `[ny, nx]` from which the first load starts, in the unit of the surface's length. None, the default, is first contact.
    pub initial_gap: Option<Array2<f64>>,
}

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

    /// Called once before the first load, with the warnings of [`Problem::warnings`].
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

/// Largest contact pressure, in the unit of the modulus.
///
/// ```
/// use asperity::Hardness;
///
/// assert_eq!(Hardness::from(0.3), Hardness::Uniform(0.3));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub enum Hardness {
    /// The same at all nodes.
    Uniform(f64),
    /// Of each node, `[ny, nx]` as the surface has; only with a hard wall.
    Map(Array2<f64>),
}

impl From<f64> for Hardness {
    fn from(value: f64) -> Self {
        Hardness::Uniform(value)
    }
}

/// Attraction between the surfaces.
///
/// ```
/// use asperity::{Adhesion, AdhesionLaw, RangeChoice};
///
/// let adhesion = Adhesion { work_of_adhesion: 0.05, range: 2e-9, ..Adhesion::default() };
/// assert_eq!((adhesion.law, adhesion.resolution), (AdhesionLaw::Exponential, RangeChoice::Mesh));
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Adhesion {
    /// Work of adhesion γ, in units of modulus times length.
    pub work_of_adhesion: f64,
    /// Range ρ, in the unit of the surface's length.
    pub range: f64,
    /// Decay of the attraction with the gap.
    pub law: AdhesionLaw,
    /// What happens where the grid does not resolve the range.
    pub resolution: RangeChoice,
    /// Another decay in place of `law`: the shape of this table, with the work and range above.
    pub table: Option<Arc<TabulatedLaw>>,
}

/// The law of a table, with its own work of adhesion and range.
impl From<TabulatedLaw> for Adhesion {
    fn from(table: TabulatedLaw) -> Self {
        let (work_of_adhesion, range) = (table.work_of_adhesion(), table.range());
        Adhesion { work_of_adhesion, range, table: Some(Arc::new(table)), ..Adhesion::default() }
    }
}

impl Problem {
    /// Contact without adhesion on a half-space of contact modulus E* = E/(1-ν²).
    pub fn new(surface: Surface, modulus: f64) -> Self {
        Problem {
            surface,
            modulus,
            body: Body::HalfSpace,
            adhesion: None,
            penalty_length: None,
            hardness: None,
            method: "auto".into(),
            precision: Precision::F64,
            tolerance: None,
            targets: Targets::default(),
            max_iterations: ContinuumScene::default().max_iterations,
            initial_gap: None,
        }
    }

    /// The equilibrium under a mean pressure, from first contact.
    ///
    /// # Errors
    /// `Input` for values out of their range, for methods that do not solve for the fields and for those that cannot solve this
    /// problem; `Memory`; `NotConverged`.
    ///
    /// ```
    /// use asperity::{Problem, Spectrum, StateMaps, Surface, SynthesisOptions};
    ///
    /// let spectrum = Spectrum { lambda_s: 1.0 / 8.0, ..Spectrum::CHALLENGE };
    /// let surface = Surface::from_spectrum(spectrum, SynthesisOptions { nodes: 32, length: 1.0, seed: 1 })?;
    /// let state = Problem::new(surface, 1.0).solve(0.05)?;
    /// assert!((state.stress().unwrap().mean().unwrap() - 0.05).abs() < 1e-9);
    /// assert!(state.gap().unwrap().iter().all(|g| *g >= 0.0));
    /// # Ok::<(), asperity::Error>(())
    /// ```
    pub fn solve(&self, mean_pressure: f64) -> Result<State> {
        let mut path = self.load_path(&Loads::Pressure(vec![mean_pressure]))?;
        Ok(path.states.remove(0))
    }

    /// Equilibria under `loads`, one after another: with adhesion, loading and unloading lead to different states.
    ///
    /// # Errors
    /// As [`Problem::solve`].
    pub fn load_path(&self, loads: &Loads) -> Result<LoadPath> {
        self.collected(loads, false)
    }

    /// As [`Problem::load_path`]; after the last load the surfaces are separated, and the largest tensile pressure on the way
    /// is found.
    ///
    /// # Errors
    /// As [`Problem::solve`]; `Input` without adhesion.
    pub fn load_path_with_pull_off(&self, loads: &Loads) -> Result<LoadPath> {
        self.collected(loads, true)
    }

    /// As [`Problem::load_path`], with each state passed to `visit` when it is solved: a long path then needs the memory of one
    /// state, and those before an error or interrupt are kept. `monitor` receives the progress and stops the solver. With
    /// `pull_off` the surfaces are separated after the last load, as in [`Problem::load_path_with_pull_off`].
    ///
    /// # Errors
    /// As [`Problem::solve`]; `Interrupted` where the monitor stopped the solver; `Input` for a pull-off without adhesion.
    ///
    /// ```
    /// use asperity::{Error, Loads, Problem, Progress, Spectrum, Surface, SynthesisOptions};
    /// use std::ops::ControlFlow;
    ///
    /// let spectrum = Spectrum { lambda_s: 1.0 / 8.0, ..Spectrum::CHALLENGE };
    /// let surface = Surface::from_spectrum(spectrum, SynthesisOptions { nodes: 32, length: 1.0, seed: 1 })?;
    /// let problem = Problem::new(surface, 1.0);
    /// let first = |_: Progress| ControlFlow::Break(());
    /// let stopped = problem.visit_load_path(&Loads::PStar(vec![0.05]), false, &first, |_| ());
    /// assert!(matches!(stopped, Err(Error::Interrupted)));
    /// # Ok::<(), asperity::Error>(())
    /// ```
    pub fn visit_load_path(
        &self,
        loads: &Loads,
        pull_off: bool,
        monitor: &dyn Monitor,
        visit: impl FnMut(State),
    ) -> Result<Option<PullOff>> {
        let (case, method) = self.case(loads, pull_off)?;
        monitor.warnings(&case.warnings);
        self.path((case, method), pull_off, &Monitored(monitor), visit)
    }

    /// The contact under a mean pressure by any method, those included that do not solve for the fields: [`State::missing`] has what
    /// the method does not deliver.
    ///
    /// # Errors
    /// As [`Problem::solve`].
    pub fn estimate(&self, mean_pressure: f64) -> Result<State> {
        let load = Loads::Pressure(vec![mean_pressure]);
        let (mut case, method) = self.case(&load, false)?;
        let card = method.card();
        if card.kind == MethodKind::Solver {
            return self.solve(mean_pressure);
        }
        let steps = case.load_steps().to_vec();
        let loads: Vec<Load> = steps.iter().map(|step| step.target).collect();
        case.take_surface();
        self.surface.with_heights(false, |heights| {
            let input = path::EstimatorInput::new(case.problem(heights), method)?;
            let mut completed = None;
            input.walk((&loads, 0), &NoObserver, |i, problem, found| {
                let criterion = method.criterion(&problem.settings).to_string();
                let mut state = state_of(card, problem, (&steps[i], case.gradient, &criterion), found);
                state.missing.extend(never_delivered(card, problem.adhesion != AttractionLaw::None));
                completed = Some(state.with_maps_of(problem.grid, found).in_units(self.surface.length(), self.modulus));
                Ok(())
            })?;
            Ok(completed.expect("a path that ends without an error has visited its load"))
        })
    }

    /// Bytes that solving for a load takes besides the surface.
    ///
    /// # Errors
    /// As [`Problem::solve`].
    pub fn memory(&self) -> Result<u64> {
        // Any load that is small.
        let (case, method) = self.case(&Loads::Pressure(vec![1e-6 * self.modulus]), false)?;
        self.surface.with_heights(false, |heights| {
            Ok(path::LoadPathSolver::new(case.problem(heights), method, case.range(), 0.0, &[]).plan(false).bytes)
        })
    }

    /// Warnings about this problem: what the grid does not resolve, slopes and heights that suggest a wrong unit, a load beyond full
    /// contact.
    ///
    /// # Errors
    /// As [`Problem::solve`].
    pub fn warnings(&self, loads: &Loads) -> Result<Vec<String>> {
        Ok(self.case(loads, false)?.0.warnings)
    }

    fn collected(&self, loads: &Loads, pull_off: bool) -> Result<LoadPath> {
        let mut states = Vec::new();
        let case = self.case(loads, pull_off)?;
        let pull_off = self.path(case, pull_off, &NoObserver, |state| states.push(state))?;
        Ok(LoadPath { states, pull_off, is_adhesive: self.adhesion.is_some() })
    }

    fn path(
        &self,
        (mut case, method): (Case, &'static dyn asperity_contact::method::ContactMethod),
        pull_off: bool,
        observer: &dyn Observer,
        mut visit: impl FnMut(State),
    ) -> Result<Option<PullOff>> {
        if method.card().kind != MethodKind::Solver {
            let accepted = "a method that solves for the fields, or `Problem::estimate`";
            return Err(Error::input(PLACE, "method", method.card().id, accepted));
        }
        case.find_contact_pressures(observer).map_err(named)?;
        // The surface lends its heights; the case needs them no longer.
        case.take_surface();
        let targets: Vec<Load> = case.load_steps().iter().map(|step| step.target).collect();
        let begin = self.begin()?;
        // As on the command line: the default method works on waves.
        let as_waves = method.card().capabilities.waves && case.scene.continuum.is_periodic();
        self.surface.with_heights(as_waves, |heights| {
            let path = path::LoadPathSolver::new(case.problem(heights), method, case.range(), 0.0, &targets);
            let (required, available) = (path.plan(pull_off).bytes, asperity_grid::sys::available_memory_bytes());
            if required > available {
                let what = method.card().id.into();
                let advice = "a surface with fewer nodes or Precision::F32 needs less".into();
                return Err(Error::Memory { what, need: required, have: available, advice });
            }
            let path = path.with_stiffness();
            let (length, criterion) = (self.surface.length(), method.criterion(&path.problem().settings).to_string());
            let pulled = path.walk(begin, pull_off, observer, |i, reached| {
                require_converged(&reached, method.card(), path.problem().tolerance, [i + 1, targets.len()])?;
                let numbers = reached.numbers(&case.load_steps()[i], case.gradient, &criterion);
                let state = numbers.with_maps(case.grid, &reached.state, self.adhesion.is_some());
                visit(state.in_units(length, self.modulus));
                Ok(())
            })?;
            Ok(pulled.map(|p| p.in_units(length, self.modulus)))
        })
    }

    /// The initial gap in reduced units.
    fn begin(&self) -> Result<Option<InitialState>> {
        let Some(gap) = &self.initial_gap else { return Ok(None) };
        if self.hardness.is_some() {
            return Err(Error::input(
                PLACE,
                "initial_gap",
                "given with a hardness",
                "none: a gap has no history of flow",
            ));
        }
        let shape = self.surface.shape();
        if gap.dim() != shape || gap.iter().any(|g| !g.is_finite()) {
            let found = format!("an array of {:?}, finite: {}", gap.dim(), gap.iter().all(|g| g.is_finite()));
            return Err(Error::input(
                PLACE,
                "initial_gap",
                found,
                format!("finite gaps {shape:?}, as the surface has"),
            ));
        }
        Ok(Some(InitialState::Gap(gap.iter().map(|g| g / self.surface.length()).collect())))
    }

    /// Values of a map of the hardness, row by row.
    fn nodes(&self, map: &Array2<f64>) -> Result<Vec<f64>> {
        let shape = self.surface.shape();
        if map.dim() != shape {
            let accepted = format!("values {shape:?}, as the surface has");
            return Err(Error::input(PLACE, "hardness", format!("an array of {:?}", map.dim()), accepted));
        }
        Ok(row_major(map.view()).into_owned())
    }

    /// The checked case of this problem, as a scene or the flags of `solve` make it, and its method.
    fn case(
        &self,
        loads: &Loads,
        pull_off: bool,
    ) -> Result<(Case, &'static dyn asperity_contact::method::ContactMethod)> {
        let (hardness, map) = match &self.hardness {
            None => (None, None),
            Some(Hardness::Uniform(value)) => (Some(Stress::plain(*value)), None),
            Some(Hardness::Map(map)) => (None, Some(self.nodes(map)?)),
        };
        let continuum = ContinuumScene {
            method: self.method.clone(),
            precision: self.precision,
            tolerance: self.tolerance,
            max_iterations: self.max_iterations,
            energy_tolerance: self.targets.energy,
            area_tolerance: self.targets.area,
            mean_gap_tolerance: self.targets.mean_gap,
            wall: if self.penalty_length.is_some() { WallKind::Penalty } else { WallKind::Hard },
            penalty_length: self.penalty_length.map(Length::plain),
            hardness,
            hardness_map: map.as_ref().map(|_| PLACE.into()),
            ..ContinuumScene::default()
        };
        let (table, mut surface) = self.surface.scene_parts();
        surface.laboratory.modulus = Some(Stress::plain(self.modulus));
        let scene = Scene {
            laboratory: surface.laboratory.clone(),
            continuum: match self.body {
                Body::HalfSpace => continuum,
                Body::NonPeriodic => ContinuumScene { periodic: Some(false), ..continuum },
                Body::Layer { thickness, poisson, base } => {
                    let thickness = Length::plain(thickness);
                    ContinuumScene { layer: Some(LayerScene { thickness, poisson, base }), ..continuum }
                }
                Body::Cubic { c11, c12, c44 } => {
                    let [c11, c12, c44] = [c11, c12, c44].map(Stress::plain);
                    ContinuumScene { crystal: Some(CrystalScene { c11, c12, c44 }), ..continuum }
                }
            },
            adhesion: self.adhesion.as_ref().map(|a| AdhesionScene {
                law: a.law,
                work_of_adhesion: Work::plain(a.work_of_adhesion),
                range: Length::plain(a.range),
                resolution: a.resolution,
                also_nonadhesive: false,
                other_ranges: Vec::new(),
                table: a.table.clone(),
            }),
            load: LoadScene { pull_off, ..loads.scene() },
            ..Scene::new(PLACE, table)
        };
        let mut case = Case::of_surface(scene, PLACE, surface, map).map_err(named)?;
        if !self.surface.is_periodic() && self.body != Body::NonPeriodic {
            let text = "the map is not periodic and is taken as periodic; `Body::NonPeriodic` or a preparation of the edges avoids that";
            case.warnings.push(text.into());
        }
        Ok((case, asperity_methods::find(&self.method).expect("checked with the case")))
    }
}

/// Named in errors.
const PLACE: &str = "problem";

/// The field or argument that sets a key of scenes.
fn argument_of(key: &str) -> Option<String> {
    let name = last_part(key);
    Some(match key {
        "laboratory.length" => "the surface's length".into(),
        "surface.grid" => "the surface's nodes".into(),
        "continuum.periodic" | "continuum.layer" | "continuum.crystal" => "body".into(),
        "continuum.hardness_map" => "hardness".into(),
        "continuum.energy_tolerance" | "continuum.area_tolerance" | "continuum.mean_gap_tolerance" => {
            format!("targets.{}", name.trim_end_matches("_tolerance"))
        }
        _ if key.starts_with("continuum.layer.") || key.starts_with("continuum.crystal.") => format!("body.{name}"),
        _ if key.starts_with("surface.") || key.starts_with("adhesion.") => return None,
        _ => name.into(),
    })
}

fn named(error: Error) -> Error {
    rename_keys(error, &argument_of)
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
