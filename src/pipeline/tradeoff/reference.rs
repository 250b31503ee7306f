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
const LEVELS_BELOW: usize = 2;

/// The reference on `n` points and on coarser grids, as far as these resolve the surface.
pub(super) fn levels(case: &Case, adhesive: bool, n: usize) -> Vec<BenchmarkPoint> {
    let method = find("fast").expect("it is registered");
    let tolerance = benchmark_point::base_tolerance(case).min(REFERENCE_TOLERANCE);
    let point = |n| BenchmarkPoint::on_grid(MethodRun { method, adhesive }, n, Precision::F64, tolerance);
    let coarser = benchmark_point::halves(n, LEVELS_BELOW).into_iter().skip(1);
    let resolved = coarser.take_while(|&n| benchmark_point::on_grid(case, n).is_ok());
    std::iter::once(n).chain(resolved).map(point).collect()
}

/// Solves the reference and its coarser grids. One that fails gives no estimate, nor do those below it.
pub(super) fn solve_reference(
    bench: &mut BenchmarkRunner,
    points: &[BenchmarkPoint],
    out: &Path,
) -> Result<ReferenceSolution> {
    let (&point, coarser) = points.split_first().expect("the finest");
    let measured = bench.measure(&point, None)?;
    if let Some(reason) = &measured.results.unavailable_reason {
        let reason = format!("the reference ({}) is not available: {reason}", point.label());
        return Err(Error::AuxiliarySolve { why: reason, kept: out.to_path_buf() });
    }
    let key = bench.reference_key(&point)?;
    let mut levels = Vec::new();
    for level in coarser {
        let solution = bench.measure(level, Some((&point, (&measured, &key))))?;
        if solution.results.unavailable_reason.is_some() {
            break;
        }
        levels.push((level.n, solution));
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
