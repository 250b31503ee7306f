//! Names of settings and methods, shared by the tables and charts.

use crate::compare::pareto::{CostExponent, growth};
use crate::record::tradeoff::{Setting, TradeoffPoint, TradeoffResults};
use crate::report::number::trimmed;
use crate::report::page::figures::distinct;

/// Method and grid of a setting.
pub(super) fn short(s: &Setting) -> String {
    match s.block {
        Some(block) => format!("{}, a block of {block} cells", s.method),
        None => format!("{0} on {1} × {1} points", s.method, s.nx),
    }
}

/// Precision, tolerance and layer of a setting.
pub(super) fn accuracy(s: &Setting) -> String {
    let slab = s.layer_thickness.map_or(String::new(), |t| format!(", a layer of {} L", trimmed(t, 3)));
    format!("{} to\u{a0}{}{slab}", s.precision, trimmed(s.tolerance, 2))
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

/// Power-law growth of a method's processor time with the number of grid points.
pub(super) fn grows(tradeoff: &TradeoffResults, method: &str) -> Option<CostExponent> {
    let point = |p: &&TradeoffPoint| ((p.setting.nx * p.setting.ny) as f64, p.cost.cpu_seconds);
    growth(&tradeoff.grids(method).iter().map(point).collect::<Vec<_>>())
}
