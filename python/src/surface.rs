//! Surfaces from arrays, files and spectra.

use crate::arrays::{EnteredMap, expect_memory};
use crate::errors::{Raise, choice, exception, in_python, optional};
use crate::pool::in_pool;
use asperity::grid::units::Measure;
use asperity::grid::{Error, Grid};
use asperity::scene::DetrendScene;
use asperity::surface::import;
use asperity::surface::{
    AtDistance, Axis, Placement, PowerSpectra, Tip, areal, correlation_length, power_spectra, reconstruct,
    scale_dependent, tip_cutoff,
};
use asperity::{Amplitudes, Detrend, FileOptions, MapOptions, Preparation, Spectrum, SynthesisOptions, Touching};
use ndarray::Array2;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::path::PathBuf;

/// Named in errors.
const PLACE: &str = "surface";

/// Name, extensions, and for those that are not read what is accepted instead.
#[pyfunction]
pub(crate) fn formats() -> Vec<(&'static str, &'static str, Option<&'static str>)> {
    let read = import::formats().map(|(name, extensions)| (name, extensions, None));
    read.chain(import::not_read().map(|(name, accepted)| (name, "", Some(accepted)))).collect()
}

/// Of one or two bodies, each Young's modulus and Poisson's ratio.
#[pyfunction]
pub(crate) fn contact_modulus(bodies: Vec<[f64; 2]>) -> f64 {
    asperity::contact::problem::contact_modulus(&bodies)
}

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
    filter: Option<String>,
    resample: Option<[usize; 2]>,
    edges: Option<String>,
    extend_to: Option<f64>,
    isotropic_map: Option<bool>,
    seed: Option<u64>,
}

impl Steps {
    fn preparation(&self, py: Python<'_>) -> PyResult<Preparation> {
        Ok(Preparation {
            crop: self.crop,
            remove_outliers: self.remove_outliers,
            fill: optional(py, PLACE, "fill", self.fill.as_ref())?,
            detrend: self.detrend.as_ref().map(|text| form(py, text)).transpose()?,
            low_pass: self.low_pass,
            high_pass: self.high_pass,
            filter: optional(py, PLACE, "filter", self.filter.as_ref())?,
            resample: self.resample,
            edges: optional(py, PLACE, "edges", self.edges.as_ref())?,
            extend_to: self.extend_to,
            isotropic_map: self.isotropic_map.unwrap_or_default(),
            seed: self.seed.unwrap_or_default(),
            unit: String::new(),
        })
    }
}

/// The form of its text. Lengths are numbers in the unit of the surface.
fn form(py: Python<'_>, text: &str) -> PyResult<Detrend> {
    let parsed =
        text.parse::<DetrendScene<Measure>>().and_then(|form| match form.lengths().iter().all(|m| m.unit.is_none()) {
            true => Ok(form.form(|m| m.value)),
            false => Err("expected numbers without a unit, in that of the surface".into()),
        });
    parsed.map_err(|why| {
        let accepted = why.strip_prefix("expected ").unwrap_or(&why);
        exception(py, &Error::input(PLACE, "detrend", format!("{text:?}"), accepted))
    })
}

type TipMaps<'py> = (Option<f64>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<bool>>);

fn no_axis(py: Python<'_>, axis: &str, accepted: &str) -> PyErr {
    exception(py, &Error::input(PLACE, "axis", format!("{axis:?}"), accepted))
}

impl Surface {
    /// A value of the heights, in the unit of the length, and of whether they repeat.
    fn of_heights<V: Send>(&self, py: Python<'_>, value: impl FnOnce(Grid, &[f64], bool) -> V + Send) -> PyResult<V> {
        let grid = self.0.grid();
        // Of a patch the autocorrelation takes four times the area; with its spectrum.
        let bytes = (10 * size_of::<f64>() as u64).saturating_mul(grid.points() as u64);
        expect_memory(py, format!("statistics of {} x {} nodes", grid.nx, grid.ny), bytes)?;
        in_pool(py, 0, || {
            let cell = self.0.cell();
            let heights = self.0.heights();
            let nodes = heights.as_slice().expect("row by row");
            value(Grid { lx: cell.x, ly: cell.y, ..grid }, nodes, self.0.is_periodic())
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
        source: (Option<String>, Option<PathBuf>, bool, Option<String>),
        steps: Steps,
    ) -> PyResult<Self> {
        let (dataset, python, profile, unit) = source;
        let touching = optional(py, PLACE, "touching", touching.as_ref())?;
        let preparation = steps.preparation(py)?;
        let options = FileOptions { length, touching, dataset, profile, python, unit, preparation };
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

    fn facing(&self, py: Python<'_>, other: &Self, placement: (bool, u8, [f64; 2])) -> PyResult<Self> {
        let (turned_over, quarter_turns, shift) = placement;
        let placement = Placement { turned_over, quarter_turns, shift };
        Ok(Surface(in_pool(py, 0, || self.0.facing(&other.0, &placement))?.raise(py)?))
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

    /// Parameters of ISO 25178-2, by their symbols in lower case.
    fn areal(&self, py: Python<'_>) -> PyResult<Vec<(&'static str, Option<f64>)>> {
        self.of_heights(py, |grid, heights, periodic| {
            let p = areal(grid, heights, periodic);
            let length = correlation_length(grid, heights, periodic);
            vec![
                ("sa", Some(p.sa)),
                ("ssk", Some(p.ssk)),
                ("sku", Some(p.sku)),
                ("sdq", Some(p.sdq)),
                ("sdr", Some(p.sdr).filter(|sdr| sdr.is_finite())),
                ("sal", length.map(|l| l.fastest)),
                ("str", length.and_then(|l| l.aspect)),
            ]
        })
    }

    /// Wave numbers and power spectral densities, of a patch under a Hann window.
    fn power_spectrum<'py>(&self, py: Python<'py>, axis: &str) -> PyResult<[Bound<'py, PyArray1<f64>>; 2]> {
        let one_of = |spectra: PowerSpectra| match axis {
            "x" => Some(spectra.x),
            "y" => Some(spectra.y),
            "radius" => Some(spectra.radial),
            _ => None,
        };
        let list = self.of_heights(py, |grid, heights, periodic| one_of(power_spectra(grid, heights, periodic)))?;
        let list = list.ok_or_else(|| no_axis(py, axis, "\"x\", \"y\" or \"radius\""))?;
        let (q, density) = list.iter().map(|p| (p.q, p.density)).unzip();
        Ok([q, density].map(|values: Vec<f64>| PyArray1::from_vec(py, values)))
    }

    /// Distance, structure function, slope, curvature (NaN where there is none).
    fn scale_dependent<'py>(&self, py: Python<'py>, axis: &str) -> PyResult<[Bound<'py, PyArray1<f64>>; 4]> {
        let axis = match axis {
            "x" => Axis::X,
            "y" => Axis::Y,
            other => return Err(no_axis(py, other, "\"x\" or \"y\"")),
        };
        let list = self.of_heights(py, |grid, heights, periodic| scale_dependent(grid, heights, axis, periodic))?;
        let column = |value: &dyn Fn(&AtDistance) -> f64| PyArray1::from_iter(py, list.iter().map(value));
        Ok([
            column(&|p| p.distance),
            column(&|p| p.structure_function),
            column(&|p| p.slope),
            column(&|p| p.curvature.unwrap_or(f64::NAN)),
        ])
    }

    /// Cut-off, reconstructed heights and touched points of a tip.
    fn tip<'py>(&self, py: Python<'py>, radius: f64, half_angle: f64) -> PyResult<TipMaps<'py>> {
        let tip = Tip { radius, half_angle };
        let (cutoff, found) = self.of_heights(py, |grid, heights, periodic| {
            (tip_cutoff(grid, heights, radius, periodic), reconstruct(grid, heights, tip, periodic))
        })?;
        let shape = self.0.shape();
        let heights = Array2::from_shape_vec(shape, found.heights).expect("a value per node");
        let touched = Array2::from_shape_vec(shape, found.touched).expect("a value per node");
        Ok((cutoff, PyArray2::from_owned_array(py, heights), PyArray2::from_owned_array(py, touched)))
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
