//! Surfaces from arrays, files and spectra.

use crate::arrays::{EnteredMap, expect_memory};
use crate::errors::{Raise, choice, in_python, optional};
use crate::pool::in_pool;
use asperity::{Amplitudes, FileOptions, MapOptions, Preparation, Spectrum, SynthesisOptions, Touching};
use numpy::PyArray2;
use pyo3::prelude::*;
use std::path::PathBuf;

/// Named in errors.
const PLACE: &str = "surface";

#[pyclass(frozen, module = "asperity._asperity")]
pub(crate) struct Surface(pub(crate) asperity::Surface);

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Steps {
    crop: Option<[usize; 4]>,
    remove_outliers: Option<f64>,
    fill: Option<String>,
    detrend: Option<String>,
    low_pass: Option<f64>,
    high_pass: Option<f64>,
    filter: String,
    resample: Option<[usize; 2]>,
    edges: Option<String>,
}

impl Steps {
    fn preparation(&self, py: Python<'_>) -> PyResult<Preparation> {
        Ok(Preparation {
            crop: self.crop,
            remove_outliers: self.remove_outliers,
            fill: optional(py, PLACE, "fill", self.fill.as_ref())?,
            detrend: optional(py, PLACE, "detrend", self.detrend.as_ref())?,
            low_pass: self.low_pass,
            high_pass: self.high_pass,
            filter: choice(py, PLACE, "filter", &self.filter)?,
            resample: self.resample,
            edges: optional(py, PLACE, "edges", self.edges.as_ref())?,
        })
    }
}

#[pymethods]
impl Surface {
    #[staticmethod]
    fn from_array(
        py: Python<'_>,
        heights: EnteredMap<'_, f64>,
        lengths: (f64, Option<f64>),
        touching: &str,
        periodic: bool,
        steps: Steps,
    ) -> PyResult<Self> {
        let (length, length_y) = lengths;
        let touching: Touching = choice(py, PLACE, "touching", touching)?;
        let preparation = steps.preparation(py)?;
        let options = MapOptions { length_y, periodic, preparation, ..MapOptions::new(length, touching) };
        let heights = heights.view();
        Ok(Surface(in_pool(py, 0, || asperity::Surface::from_map(heights, &options))?.raise(py)?))
    }

    #[staticmethod]
    fn from_file(
        py: Python<'_>,
        path: PathBuf,
        length: Option<f64>,
        touching: Option<String>,
        dataset: Option<String>,
        steps: Steps,
    ) -> PyResult<Self> {
        let touching = optional(py, PLACE, "touching", touching.as_ref())?;
        let options = FileOptions { length, touching, dataset, preparation: steps.preparation(py)? };
        Ok(Surface(in_pool(py, 0, || asperity::read_surface(&path, &options))?.raise(py)?))
    }

    #[staticmethod]
    fn from_spectrum(
        py: Python<'_>,
        spectrum: (f64, f64, f64, f64),
        amplitudes: &str,
        grid: (usize, f64, u64),
    ) -> PyResult<Self> {
        let ((hurst, lambda_r, lambda_s, rms_gradient), (nodes, length, seed)) = (spectrum, grid);
        let amplitudes: Amplitudes = choice(py, PLACE, "amplitudes", amplitudes)?;
        let spectrum = Spectrum { hurst, lambda_r, lambda_s, rms_gradient, amplitudes };
        let options = SynthesisOptions { nodes, length, seed };
        Ok(Surface(in_pool(py, 0, || asperity::Surface::from_spectrum(spectrum, options))?.raise(py)?))
    }

    fn heights<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (ny, nx) = self.0.shape();
        // The map, and the buffers of its transform.
        let bytes = (4 * size_of::<f64>() as u64).saturating_mul(nx as u64).saturating_mul(ny as u64);
        expect_memory(py, format!("heights of {nx} x {ny} nodes"), bytes)?;
        Ok(PyArray2::from_owned_array(py, in_pool(py, 0, || self.0.heights())?))
    }

    /// Extents along x and y.
    fn cell(&self) -> (f64, f64) {
        let cell = self.0.cell();
        (cell.x, cell.y)
    }

    fn is_periodic(&self) -> bool {
        self.0.is_periodic()
    }

    fn shape(&self) -> (usize, usize) {
        self.0.shape()
    }

    fn rms_height(&self, py: Python<'_>) -> PyResult<f64> {
        in_pool(py, 0, || self.0.rms_height())
    }

    fn rms_gradient(&self, py: Python<'_>) -> PyResult<f64> {
        in_pool(py, 0, || self.0.rms_gradient())
    }

    fn warnings(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        Ok(in_pool(py, 0, || self.0.warnings())?.iter().map(|text| in_python(text)).collect())
    }

    fn preparation_steps(&self) -> Vec<String> {
        self.0.preparation_steps().to_vec()
    }

    /// JSON of file, declared properties and preparation.
    fn provenance(&self) -> Option<String> {
        self.0.provenance().map(|p| serde_json::to_string(p).expect("plain values"))
    }
}
