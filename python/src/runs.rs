//! Folders of finished runs.

use crate::errors::Raise;
use asperity::State;
use numpy::PyArray2;
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use std::path::PathBuf;

#[pyclass(frozen, module = "asperity._asperity")]
pub(crate) struct FinishedRun(asperity::FinishedRun);

/// A map, or none where the run stored none.
type Map<'py> = Option<Bound<'py, PyArray2<f64>>>;

impl FinishedRun {
    fn state(&self, index: usize) -> PyResult<&State> {
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

    /// Path of a file of the run, as the run wrote it.
    fn file(&self, py: Python<'_>, name: &str) -> PyResult<PathBuf> {
        self.0.file(name).raise(py)
    }

    /// Extent of the cell along x, m, and contact modulus, Pa.
    fn scales(&self) -> (f64, f64) {
        (self.0.length_m, self.0.modulus_pa)
    }

    fn heights<'py>(&self, py: Python<'py>) -> PyResult<Map<'py>> {
        Ok(self.0.heights().raise(py)?.map(|map| PyArray2::from_owned_array(py, map)))
    }

    fn gap<'py>(&self, py: Python<'py>, index: usize) -> PyResult<Map<'py>> {
        Ok(self.0.gap(self.state(index)?).raise(py)?.map(|map| PyArray2::from_owned_array(py, map)))
    }

    fn stress<'py>(&self, py: Python<'py>, index: usize) -> PyResult<Map<'py>> {
        Ok(self.0.stress(self.state(index)?).raise(py)?.map(|map| PyArray2::from_owned_array(py, map)))
    }
}
