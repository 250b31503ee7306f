//! Folders of finished runs.

use crate::errors::Raise;
use asperity::{Branch, FinishedState};
use numpy::PyArray2;
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use std::path::PathBuf;

#[pyclass(frozen, module = "asperity._asperity")]
pub(crate) struct FinishedRun(asperity::FinishedRun);

/// Numbers of one load, as a dictionary.
#[derive(IntoPyObject)]
struct RunState {
    branch: &'static str,
    p_star: f64,
    pressure_pa: f64,
    contact_area: f64,
    contact_area_error: Option<f64>,
    contact_nodes: f64,
    mean_gap_m: f64,
    mean_gap_error_m: Option<f64>,
    stiffness_pa_per_m: Option<f64>,
}

/// A map, or none where the run stored none.
type Map<'py> = Option<Bound<'py, PyArray2<f64>>>;

impl FinishedRun {
    fn state(&self, index: usize) -> PyResult<&FinishedState> {
        let count = self.0.states.len();
        self.0
            .states
            .get(index)
            .ok_or_else(|| PyIndexError::new_err(format!("state {index} of {count}, counted from 0")))
    }
}

#[pymethods]
impl FinishedRun {
    #[new]
    fn read(py: Python<'_>, folder: PathBuf) -> PyResult<Self> {
        Ok(FinishedRun(asperity::FinishedRun::read(folder).raise(py)?))
    }

    /// All of `results.json`.
    fn json(&self, py: Python<'_>) -> PyResult<String> {
        Ok(self.0.json().raise(py)?.to_string())
    }

    /// Extent of the cell along x, m, and contact modulus, Pa.
    fn scales(&self) -> (f64, f64) {
        (self.0.length_m, self.0.modulus_pa)
    }

    fn states(&self) -> Vec<RunState> {
        let row = |s: &FinishedState| RunState {
            branch: if s.branch == Branch::Loading { "loading" } else { "unloading" },
            p_star: s.p_star,
            pressure_pa: s.pressure_pa,
            contact_area: s.contact_area,
            contact_area_error: s.contact_area_error,
            contact_nodes: s.contact_nodes,
            mean_gap_m: s.mean_gap_m,
            mean_gap_error_m: s.mean_gap_error_m,
            stiffness_pa_per_m: s.stiffness_pa_per_m,
        };
        self.0.states.iter().map(row).collect()
    }

    fn heights<'py>(&self, py: Python<'py>) -> PyResult<Map<'py>> {
        Ok(self.0.heights().raise(py)?.map(|map| PyArray2::from_owned_array(py, map)))
    }

    fn gap<'py>(&self, py: Python<'py>, index: usize) -> PyResult<Map<'py>> {
        Ok(self.0.gap(self.state(index)?).raise(py)?.map(|map| PyArray2::from_owned_array(py, map)))
    }

    fn pressure<'py>(&self, py: Python<'py>, index: usize) -> PyResult<Map<'py>> {
        Ok(self.0.pressure(self.state(index)?).raise(py)?.map(|map| PyArray2::from_owned_array(py, map)))
    }
}
