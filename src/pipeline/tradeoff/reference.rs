//! The reference solution, with its extrapolated numbers and their uncertainty.

use super::bench::BenchmarkRunner;
use super::benchmark_point::{self, BenchmarkPoint, REFERENCE_TOLERANCE};
use super::errors;
use super::measured::ReferenceSolution;
use crate::pipeline::methods::MethodRun;
use crate::scene::Case;
use crate::{Error, Result};
use asperity_contact::method::Precision;
use asperity_methods::find;
use std::path::Path;

/// Coarser grids of the reference. Three grids in all are the minimum for a test of the order of convergence.
pub(super) const LEVELS_BELOW: usize = 2;

/// Solves the reference and its coarser grids.
pub(super) fn solve_reference(
    bench: &mut BenchmarkRunner,
    case: &Case,
    adhesive: bool,
    n: usize,
    out: &Path,
) -> Result<ReferenceSolution> {
    let fast = find("fast").expect("it is registered");
    let tolerance = benchmark_point::base_tolerance(case).min(REFERENCE_TOLERANCE);
    let point_on =
        |n: usize| BenchmarkPoint::on_grid(MethodRun { method: fast, adhesive }, n, Precision::F64, tolerance);
    let point = point_on(n);
    let measured = bench.measure(&point, None, None)?;
    if let Some(reason) = &measured.results.unavailable_reason {
        let reason = format!("the reference ({}) is not available: {reason}", point.label());
        return Err(Error::AuxiliarySolve { why: reason, kept: out.to_path_buf() });
    }
    let key = bench.reference_key(&point)?;
    let mut levels = Vec::new();
    for n in benchmark_point::halves(n, LEVELS_BELOW).into_iter().skip(1) {
        // A grid that does not resolve the surface, or whose solution fails, gives no estimate; nor do coarser grids.
        if benchmark_point::on_grid(case, n).is_err() {
            break;
        }
        let solution = bench.measure(&point_on(n), Some((&point, (&measured, &key))), None)?;
        if solution.results.unavailable_reason.is_some() {
            break;
        }
        levels.push((n, solution));
    }
    levels.reverse();
    let states: Vec<_> =
        levels.iter().map(|(_, m)| m).chain([&measured]).map(|m| m.results.states.as_slice()).collect();
    let numbers = errors::numbers(&states);
    let rough = bench.rough;
    let below = levels
        .iter()
        .rev()
        .map(|(_, m)| errors::errors((&m.results.states, &m.maps), &measured.results.states, &numbers, rough));
    let uncertainty = errors::uncertainty(&numbers, &below.collect::<Vec<_>>(), rough);
    let coarser = levels.iter().map(|(n, _)| *n).collect();
    Ok(ReferenceSolution { point, measured, numbers, uncertainty, coarser })
}
