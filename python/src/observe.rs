//! Observables of maps, and the list of methods.

use crate::arrays::EnteredMap;
use crate::errors::Raise;
use crate::pool::in_pool;
use asperity::{Cell, Connectivity, Distribution, Overlap};
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;

#[pyfunction]
pub(crate) fn contact_area(
    gap: EnteredMap<'_, f64>,
    threshold: f64,
    cell: (f64, f64),
    periodic: bool,
) -> (f64, f64, f64, usize) {
    let area = asperity::contact_area(gap.view(), threshold, Cell { x: cell.0, y: cell.1 }, periodic);
    (area.contact_area, area.contact_nodes, area.perimeter, area.count)
}

#[pyfunction]
pub(crate) fn clusters<'py>(
    py: Python<'py>,
    contact: EnteredMap<'py, bool>,
    corners: bool,
    periodic: bool,
) -> (Bound<'py, PyArray2<i64>>, Vec<usize>, Option<usize>) {
    let connectivity = if corners { Connectivity::Eight } else { Connectivity::Four };
    let found = asperity::clusters(contact.view(), connectivity, periodic);
    let median = found.median_size();
    (PyArray2::from_owned_array(py, found.labels.mapv(|l| l as i64)), found.sizes, median)
}

#[pyfunction]
pub(crate) fn percolation(contact: EnteredMap<'_, bool>, periodic: bool) -> (bool, bool) {
    let found = asperity::percolation(contact.view(), periodic);
    (found.x, found.y)
}

/// Fractions of the bins, of the delta function, below and above the bins.
type Histogram = (Vec<f64>, f64, f64, f64);

fn histogram(found: Distribution) -> Histogram {
    (found.fractions, found.delta, found.below, found.above)
}

#[pyfunction]
pub(crate) fn gap_distribution(
    py: Python<'_>,
    gap: EnteredMap<'_, f64>,
    threshold: f64,
    edges: Vec<f64>,
) -> PyResult<Histogram> {
    let gap = gap.view();
    in_pool(py, 0, || asperity::gap_distribution(gap, threshold, &edges)).map(histogram)
}

#[pyfunction]
pub(crate) fn stress_distribution(
    py: Python<'_>,
    stress: EnteredMap<'_, f64>,
    contact: EnteredMap<'_, bool>,
    edges: Vec<f64>,
) -> PyResult<(Histogram, Histogram)> {
    let (stress, contact) = (stress.view(), contact.view());
    let found = in_pool(py, 0, || asperity::stress_distribution(stress, contact, &edges))?;
    Ok((histogram(found.all), histogram(found.contact)))
}

#[pyfunction]
pub(crate) fn hydraulic_gap(py: Python<'_>, gap: EnteredMap<'_, f64>, threshold: f64) -> PyResult<f64> {
    let gap = gap.view();
    in_pool(py, 0, || asperity::hydraulic_gap(gap, threshold))
}

fn overlap(found: Overlap) -> (f64, f64, f64, f64) {
    (found.jaccard, found.precision, found.recall, found.kappa)
}

/// Jaccard index, precision, recall and κ of the maps and of the shifted control, and the best shift.
type Agreement = ((f64, f64, f64, f64), (f64, f64, f64, f64), [i64; 2]);

#[pyfunction]
pub(crate) fn compare_maps(
    py: Python<'_>,
    map: EnteredMap<'_, bool>,
    reference: EnteredMap<'_, bool>,
) -> PyResult<Agreement> {
    let (map, reference) = (map.view(), reference.view());
    let found = in_pool(py, 0, || asperity::compare_maps(map, reference))?.raise(py)?;
    Ok((overlap(found.aligned), overlap(found.shifted), found.best_shift))
}

#[pyfunction]
pub(crate) fn methods(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    let entry = |method: asperity::Method| {
        let dict = PyDict::new(py);
        dict.set_item("id", method.id)?;
        dict.set_item("paper_name", method.paper_name)?;
        dict.set_item("family", method.family)?;
        dict.set_item("solves", method.solves)?;
        dict.set_item("adhesion", method.adhesion)?;
        dict.set_item("criterion", method.criterion)?;
        dict.set_item("calibrated_on", method.calibrated_on)?;
        dict.set_item("summary", method.summary)?;
        dict.set_item("references", method.references)?;
        Ok(dict)
    };
    asperity::methods().into_iter().map(entry).collect()
}
