//! Names of settings and methods, shared by the tables and charts.

use crate::record::tradeoff::{Setting, TradeoffResults};
use crate::report::number::trimmed;
use crate::report::page::figures::distinct;

/// Method and grid of a setting.
pub(super) fn short(s: &Setting) -> String {
    match s.block {
        Some(block) => format!("{}, a block of {block} cells", s.method),
        None => format!("{} on {} × {} points", s.method, s.nx, s.ny),
    }
}

/// Precision and tolerance of a setting.
pub(super) fn accuracy(s: &Setting) -> String {
    format!("{} to\u{a0}{}", s.precision, trimmed(s.tolerance, 2))
}

/// Name of a setting.
pub(super) fn words(s: &Setting) -> String {
    if s.block.is_some() { short(s) } else { format!("{}, {}", short(s), accuracy(s)) }
}

/// Methods with results in the order of the table, and whether they include adhesion.
pub(super) fn methods(tradeoff: &TradeoffResults) -> Vec<(&str, bool)> {
    let known = tradeoff.points.iter().filter(|p| p.unavailable_reason.is_none());
    distinct(known.map(|p| (p.setting.method.as_str(), p.setting.adhesive)))
}
