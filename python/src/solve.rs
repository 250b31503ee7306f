//! Load paths and estimates. Solves run in a thread of their own without the interpreter's lock, so that the calling thread handles
//! signals and shows the progress.

use crate::arrays::EnteredMap;
use crate::errors::{Raise, choice, exception, in_python, optional};
use crate::law::TabulatedLaw;
use crate::pool::{self, in_pool};
use crate::surface::Surface;
use asperity::contact::observe::WorkPoint;
use asperity::{
    Accuracy, Adhesion, AdhesionLaw, Body, Branch, Cell, Complaint, Error, ErrorTargets, Hardness, HardnessMap,
    LoadKind, Loads, Map, Monitor, Plasticity, Precision, Problem, Progress, PullOff, RangeChoice, State,
};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// Named in errors.
const PLACE: &str = "problem";

/// Interval at which signals are handled and the progress is shown.
const TICK: Duration = Duration::from_millis(50);

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct BodySettings {
    kind: String,
    thickness: f64,
    poisson: f64,
    base: Option<String>,
    constants: [f64; 3],
}

impl BodySettings {
    fn body(&self, py: Python<'_>) -> PyResult<Body> {
        let base = optional(py, PLACE, "body.base", self.base.as_ref())?;
        let (thickness, poisson, [c11, c12, c44]) = (self.thickness, self.poisson, self.constants);
        Ok(match (self.kind.as_str(), base) {
            ("layer", Some(base)) => Body::Layer { thickness, poisson, base },
            ("cubic", _) => Body::Cubic { c11, c12, c44 },
            ("non-periodic", _) => Body::NonPeriodic,
            _ => Body::HalfSpace,
        })
    }
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Settings<'py> {
    body: BodySettings,
    /// Work of adhesion and range.
    adhesion: Option<(f64, f64)>,
    law: String,
    /// In place of `law`.
    table: Option<Bound<'py, TabulatedLaw>>,
    resolution: String,
    penalty_length: Option<f64>,
    hardness: Option<f64>,
    hardness_map: Option<EnteredMap<'py, f64>>,
    method: String,
    precision: String,
    tolerance: Option<f64>,
    max_iterations: Option<usize>,
    initial_gap: Option<EnteredMap<'py, f64>>,
}

impl Settings<'_> {
    fn problem(&self, py: Python<'_>, surface: &Surface, modulus: f64) -> PyResult<Problem> {
        let law: AdhesionLaw = choice(py, PLACE, "adhesion.law", &self.law)?;
        let resolution: RangeChoice = choice(py, PLACE, "adhesion.resolution", &self.resolution)?;
        let precision: Precision = choice(py, PLACE, "precision", &self.precision)?;
        let default = Problem::new(surface.0.clone(), modulus);
        Ok(Problem {
            body: self.body.body(py)?,
            adhesion: self.adhesion.map(|(work_of_adhesion, range)| Adhesion {
                work_of_adhesion,
                range,
                law,
                resolution,
                table: self.table.as_ref().map(|table| table.get().0.clone()),
            }),
            penalty_length: self.penalty_length,
            hardness: match &self.hardness_map {
                Some(map) => Some(hardness(py, surface, map)?),
                None => self.hardness.map(Hardness::Uniform),
            },
            method: asperity::method(&self.method).raise(py)?,
            precision,
            tolerance: self.tolerance,
            max_iterations: self.max_iterations.unwrap_or(default.max_iterations),
            initial_gap: self.initial_gap.as_ref().map(|gap| of_shape(py, surface, gap, "initial_gap")).transpose()?,
            ..default
        })
    }
}

fn loads_of((kind, values): (String, Vec<f64>), pull_off: bool) -> Loads {
    let kind = match kind.as_str() {
        "p_star" => LoadKind::PStar,
        "mean_gap" => LoadKind::MeanGap,
        "displacement" => LoadKind::Displacement,
        "contact" => LoadKind::Contact,
        _ => LoadKind::Pressure,
    };
    Loads { pull_off, ..Loads::new(kind, values) }
}

/// The values of a map of the shape of a surface, row by row.
fn of_shape(py: Python<'_>, surface: &Surface, map: &EnteredMap<'_, f64>, name: &str) -> PyResult<Vec<f64>> {
    let (map, shape) = (map.view(), surface.0.shape());
    if map.dim() == shape {
        return Ok(map.iter().copied().collect());
    }
    let (found, accepted) = (format!("an array of {:?}", map.dim()), format!("values {shape:?}, as the surface has"));
    Err(Error::input(PLACE, name, found, accepted)).raise(py)
}

/// The map of the hardness of a surface.
fn hardness(py: Python<'_>, surface: &Surface, map: &EnteredMap<'_, f64>) -> PyResult<Hardness> {
    let (ny, nx) = surface.0.shape();
    let refused = |complaint: Complaint| Error::Input { place: PLACE.into(), list: vec![complaint] };
    let map = HardnessMap::new(nx, ny, of_shape(py, surface, map, "hardness")?);
    map.map(Hardness::from).map_err(refused).raise(py)
}

/// What the solving and the calling thread share.
#[derive(Default)]
struct Shared {
    stop: AtomicBool,
    states: Mutex<Vec<State>>,
    latest: Mutex<Option<Progress>>,
    warnings: Mutex<Vec<String>>,
}

impl Monitor for Shared {
    fn progress(&self, progress: Progress) -> ControlFlow<()> {
        *self.latest.lock().expect("no panic while it is held") = Some(progress);
        if self.stop_requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn stop_requested(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn warnings(&self, list: &[String]) {
        self.warnings.lock().expect("no panic while it is held").extend_from_slice(list);
    }
}

impl Shared {
    /// Handles signals, passes on what is new, and calls `progress` with the progress of the present load.
    fn tick(&self, py: Python<'_>, callbacks: &Callbacks<'_>) -> PyResult<()> {
        py.check_signals()?;
        self.pass_on(py, callbacks)?;
        let Some(callback) = &callbacks.progress else { return Ok(()) };
        let latest = self.latest.lock().expect("no panic while it is held").take();
        if let Some(Progress { iteration, residual, fraction }) = latest {
            callback.call1((fraction, iteration, residual))?;
        }
        Ok(())
    }

    /// Passes new warnings to `warn` and every new state to `visit`, also after an exception of it.
    fn pass_on(&self, py: Python<'_>, callbacks: &Callbacks<'_>) -> PyResult<()> {
        let list = std::mem::take(&mut *self.warnings.lock().expect("no panic while it is held"));
        let mut outcome = list.iter().try_for_each(|text| callbacks.warn.call1((in_python(text),)).map(drop));
        let states = std::mem::take(&mut *self.states.lock().expect("no panic while it is held"));
        for state in states {
            let visited = state_dict(py, state).and_then(|dict| callbacks.visit.call1((dict,)));
            outcome = outcome.and(visited.map(drop));
        }
        outcome
    }
}

#[derive(FromPyObject)]
pub(crate) struct Callbacks<'py> {
    #[pyo3(item)]
    warn: Bound<'py, PyAny>,
    #[pyo3(item)]
    visit: Bound<'py, PyAny>,
    #[pyo3(item)]
    progress: Option<Bound<'py, PyAny>>,
}

/// Pull-off, the grids of an accuracy as JSON, and the exception that ended the path.
type Solved<'py> = (Option<Bound<'py, PyDict>>, Option<String>, Option<Py<PyAny>>);

/// Errors that are accepted, as text, and a time in s.
fn accuracy_of(py: Python<'_>, (errors, budget_seconds): (String, Option<f64>)) -> PyResult<Accuracy> {
    let refused = |accepted: String| Error::input(PLACE, "error", &errors, accepted);
    let parsed = if errors.is_empty() { Ok(ErrorTargets::default()) } else { errors.parse().map_err(refused) };
    if let Some(seconds) = budget_seconds.filter(|s| !(s.is_finite() && *s > 0.0)) {
        return Err(exception(py, &Error::input(PLACE, "budget", seconds, "seconds above zero")));
    }
    Ok(Accuracy { errors: parsed.raise(py)?, budget_seconds })
}

/// Runs `f` in a pool of its own while signals are handled, and what is shared is passed on to the callbacks. With the exception of a
/// signal or a callback, after which `f` is stopped.
///
/// # Errors
/// Those of [`pool::threads`].
fn watched<R: Send>(
    py: Python<'_>,
    (shared, threads): (&Shared, usize),
    callbacks: Option<&Callbacks<'_>>,
    f: impl FnOnce() -> R + Send,
) -> PyResult<(R, Option<PyErr>)> {
    let pool = pool::threads(py, threads)?;
    let mut stopped = None;
    let found = std::thread::scope(|scope| {
        let (finished, wait) = channel::<()>();
        let wait = Mutex::new(wait);
        let solver = scope.spawn(|| {
            // Dropped at the end, also by a panic.
            let _finished = finished;
            pool.install(f)
        });
        while py.detach(|| wait.lock().expect("one thread waits").recv_timeout(TICK)) == Err(RecvTimeoutError::Timeout)
        {
            let tick = || match callbacks {
                Some(callbacks) => shared.tick(py, callbacks),
                None => py.check_signals(),
            };
            if stopped.is_none()
                && let Err(error) = tick()
            {
                shared.stop.store(true, Ordering::Relaxed);
                stopped = Some(error);
            }
        }
        solver.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    });
    Ok((found, stopped))
}

#[pyfunction]
pub(crate) fn solve<'py>(
    py: Python<'py>,
    body: (Bound<'py, Surface>, f64),
    loads: (String, Vec<f64>),
    asked: (bool, Option<(String, Option<f64>)>),
    settings: Settings<'py>,
    threads: usize,
    callbacks: Callbacks<'py>,
) -> PyResult<Solved<'py>> {
    let (pull_off, accuracy) = asked;
    let accuracy = accuracy.map(|asked| accuracy_of(py, asked)).transpose()?;
    let problem = settings.problem(py, body.0.get(), body.1)?;
    let (loads, shared) = (loads_of(loads, pull_off), Shared::default());
    let (found, stopped) = watched(py, (&shared, threads), Some(&callbacks), || {
        let visit = |state| shared.states.lock().expect("no panic while it is held").push(state);
        match &accuracy {
            None => problem.visit_load_path(&loads, &shared, visit).map(|pull_off| (pull_off, None)),
            Some(accuracy) => problem.load_path_within(accuracy, &loads, &shared).map(|(path, reached)| {
                path.states.into_iter().for_each(visit);
                (path.pull_off, Some(reached))
            }),
        }
    })?;
    // What is new since the last tick; a state is kept after an interrupt, too.
    let last = shared.pass_on(py, &callbacks).err();
    let raised = |error: PyErr| error.into_value(py).into_any();
    Ok(match (found, stopped.or(last)) {
        (_, Some(error)) => (None, None, Some(raised(error))),
        (Err(error), None) => (None, None, Some(raised(exception(py, &error)))),
        (Ok((pull_off, reached)), None) => {
            let reached = reached.map(|reached| serde_json::to_string(&reached).expect("plain numbers"));
            (pull_off.map(|p| pull_off_dict(py, &p)).transpose()?, reached, None)
        }
    })
}

fn state_dict(py: Python<'_>, state: State) -> PyResult<Bound<'_, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("branch", if state.branch == Branch::Loading { "loading" } else { "unloading" })?;
    dict.set_item("iterations", state.iterations)?;
    let flow = |of: fn(Plasticity) -> f64| Some(state.plasticity.map_or(0.0, of));
    for (key, value) in [
        ("pressure", Some(state.pressure)),
        ("mean_gap", state.mean_gap),
        ("mean_gap_error", state.mean_gap_error),
        ("displacement", state.displacement),
        ("contact_area", Some(state.contact_area)),
        ("contact_area_error", state.contact_area_error),
        ("contact_nodes", state.contact_nodes),
        ("stiffness", state.stiffness),
        ("stiffness_error", state.stiffness_error),
        ("perimeter", state.perimeter),
        ("energy", state.energy),
        ("elastic_energy", state.elastic_energy),
        ("interaction_energy", state.interaction_energy),
        ("flowing_fraction", flow(|p| p.flowing)),
        ("displaced_fraction", flow(|p| p.displaced)),
        ("mean_plastic_displacement", flow(|p| p.displacement)),
        ("plastic_work", flow(|p| p.work)),
        ("load_error", Some(state.load_error)),
        ("residual", state.residual),
        ("seconds", Some(state.seconds)),
    ] {
        dict.set_item(key, value)?;
    }
    dict.set_item("gap", array(py, state.gap_map)?)?;
    dict.set_item("stress", array(py, state.stress_map)?)?;
    dict.set_item("contact", array(py, state.contact_map)?)?;
    dict.set_item("plastic_displacement", array(py, state.plastic_map)?)?;
    Ok(dict)
}

/// A map in memory as an array.
fn array<T: numpy::Element>(py: Python<'_>, map: Option<Map<T>>) -> PyResult<Option<Bound<'_, PyAny>>> {
    match map {
        Some(Map::Values { nx, ny, values }) => fixed(py, PyArray1::from_vec(py, values).reshape([ny, nx])?).map(Some),
        Some(Map::File(_)) | None => Ok(None),
    }
}

/// The array, not writeable: states are results.
fn fixed<'py, T: numpy::Element>(py: Python<'py>, array: Bound<'py, PyArray2<T>>) -> PyResult<Bound<'py, PyAny>> {
    let array = array.into_bound_py_any(py)?;
    array.call_method("setflags", (), Some(&[("write", false)].into_py_dict(py)?))?;
    Ok(array)
}

fn pull_off_dict<'py>(py: Python<'py>, found: &PullOff) -> PyResult<Bound<'py, PyDict>> {
    [
        ("pressure", Some(found.pressure)),
        ("pressure_error", found.pressure_error),
        ("force", found.force),
        ("mean_gap", Some(found.mean_gap)),
        ("mean_gap_error", found.mean_gap_error),
    ]
    .into_py_dict(py)
}

#[pyfunction]
pub(crate) fn estimate<'py>(
    py: Python<'py>,
    body: (Bound<'py, Surface>, f64),
    pressure: f64,
    settings: Settings<'py>,
    threads: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let problem = settings.problem(py, body.0.get(), body.1)?;
    let shared = Shared::default();
    let (found, stopped) = watched(py, (&shared, threads), None, || problem.watched_estimate(pressure, &shared))?;
    let found = stopped.map_or_else(|| found.raise(py), Err)?;
    let dict = PyDict::new(py);
    dict.set_item("method", problem.method.card().id)?;
    dict.set_item("criterion", found.criterion)?;
    dict.set_item("contact_area", found.contact_area)?;
    dict.set_item("mean_gap", found.mean_gap)?;
    let missing = found.missing.into_iter().map(|(quantity, reason)| (quantity.id(), reason));
    dict.set_item("missing", missing.collect::<Vec<_>>().into_py_dict(py)?)?;
    dict.set_item("gap", array(py, found.gap_map)?)?;
    dict.set_item("stress", array(py, found.stress_map)?)?;
    dict.set_item("contact", array(py, found.contact_map)?)?;
    dict.set_item("seconds", found.seconds)?;
    Ok(dict)
}

/// Energy per area that a path dissipates: pressure, displacement, stored energy and plastic work of each state.
#[pyfunction]
pub(crate) fn dissipation(path: Vec<[f64; 4]>, adhesive: bool) -> f64 {
    let point = |[pressure, displacement, stored, plastic_work]: [f64; 4]| WorkPoint {
        pressure,
        displacement,
        stored,
        plastic_work,
    };
    asperity::contact::observe::dissipation(&path.into_iter().map(point).collect::<Vec<_>>(), adhesive)
}

/// Values `[ny, nx]`, the largest of them, and where it is along x and y.
type StressMap<'py> = (Bound<'py, PyAny>, f64, [f64; 2]);

/// Equivalent stress after von Mises and largest shear stress, depth by depth.
#[pyfunction]
pub(crate) fn subsurface<'py>(
    py: Python<'py>,
    pressure: EnteredMap<'py, f64>,
    cell: (f64, f64),
    body: BodySettings,
    depths: Vec<f64>,
    poisson: Option<f64>,
) -> PyResult<Vec<(StressMap<'py>, StressMap<'py>)>> {
    let (body, cell, pressure) = (body.body(py)?, Cell { x: cell.0, y: cell.1 }, pressure.view());
    let found = in_pool(py, 0, || asperity::subsurface(pressure, cell, body, &depths, poisson))?.raise(py)?;
    let stress = |map: asperity::StressMap| -> PyResult<StressMap<'py>> {
        Ok((fixed(py, PyArray2::from_owned_array(py, map.values))?, map.max, map.at))
    };
    found.into_iter().map(|s| Ok((stress(s.von_mises)?, stress(s.shear)?))).collect()
}

/// Memory of a solve besides the surface, bytes.
#[pyfunction]
pub(crate) fn memory<'py>(py: Python<'py>, body: (Bound<'py, Surface>, f64), settings: Settings<'py>) -> PyResult<u64> {
    let problem = settings.problem(py, body.0.get(), body.1)?;
    in_pool(py, 0, || problem.memory())?.raise(py)
}
