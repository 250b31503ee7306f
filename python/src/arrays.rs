//! Maps and numbers that enter.

use crate::errors::Raise;
use ndarray::ArrayView2;
use numpy::{Element, PyReadonlyArray2};
use pyo3::prelude::*;

/// A map `[ny, nx]`: row by row, aligned, of this machine's byte order. numpy copies what is not, such as a field of packed records,
/// whose strides are no multiple of the size of a number.
pub(crate) struct EnteredMap<'py, T: Element>(PyReadonlyArray2<'py, T>);

impl<'a, 'py, T: Element + 'a> FromPyObject<'a, 'py> for EnteredMap<'py, T> {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let py = given.py();
        let plain = py.import("numpy")?.call_method1("require", (given, T::get_dtype(py), ["C", "A", "E"]))?;
        Ok(EnteredMap(plain.extract()?))
    }
}

impl<T: Element> EnteredMap<'_, T> {
    pub(crate) fn view(&self) -> ArrayView2<'_, T> {
        self.0.as_array()
    }
}

/// Refuses what needs more memory than is available.
#[pyfunction]
pub(crate) fn expect_memory(py: Python<'_>, what: String, bytes: u64) -> PyResult<()> {
    asperity::grid::sys::expect_memory(what, bytes, "fewer values need less").raise(py)
}
