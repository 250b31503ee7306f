use crate::method::ReducedProblem;
use crate::observe::Leakage;
use asperity_grid::Field;

/// The flow through a gap of this problem: of a periodic cell, or between opposite sides of a non-periodic surface. `coarser`: hydraulic
/// gaps on the next coarser grid ([`Reached::coarser_gaps`](super::Reached::coarser_gaps)), for the errors.
pub fn leakage(
    problem: &ReducedProblem,
    gap: Field,
    threshold: f64,
    coarser: Option<([f64; 2], f64)>,
) -> Option<Leakage> {
    Some(crate::observe::leakage(problem.grid, gap, threshold, problem.kernel.is_periodic())?.with_errors_from(coarser))
}
