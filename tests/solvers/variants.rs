//! Methods and precisions of the tests of extreme cases.

use asperity::contact::method::{Precision, ReducedProblem};

pub(crate) const METHODS: [&str; 3] = ["gfmd", "bvm", "fast"];
pub(crate) const PRECISIONS: [Precision; 2] = [Precision::F64, Precision::F32];

pub(crate) fn in_precision<'p>(problem: &ReducedProblem<'p>, precision: Precision) -> ReducedProblem<'p> {
    let tolerance = if precision == Precision::F32 { 1e-3 } else { problem.tolerance };
    ReducedProblem { precision, tolerance, ..problem.clone() }
}
