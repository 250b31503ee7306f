//! Adhesion laws from callables of Python.

use crate::errors::Raise;
use pyo3::prelude::*;
use std::sync::Arc;

#[pyclass(frozen, module = "asperity._asperity")]
pub(crate) struct TabulatedLaw(pub(crate) Arc<asperity::TabulatedLaw>);

#[pymethods]
impl TabulatedLaw {
    #[new]
    fn new(py: Python<'_>, traction: &Bound<'_, PyAny>, cutoff: f64) -> PyResult<Self> {
        let mut raised = None;
        let table = asperity::TabulatedLaw::new(cutoff, |gap| {
            if raised.is_some() {
                return f64::NAN;
            }
            traction.call1((gap,)).and_then(|value| value.extract()).unwrap_or_else(|error| {
                raised = Some(error);
                f64::NAN
            })
        });
        match raised {
            Some(error) => Err(error),
            None => Ok(TabulatedLaw(Arc::new(table.raise(py)?))),
        }
    }

    /// Work of adhesion, range, and error over the largest traction.
    fn numbers(&self) -> (f64, f64, f64) {
        (self.0.work_of_adhesion(), self.0.range(), self.0.error())
    }

    fn tractions(&self, gaps: Vec<f64>) -> Vec<f64> {
        gaps.into_iter().map(|gap| self.0.traction(gap)).collect()
    }
}
