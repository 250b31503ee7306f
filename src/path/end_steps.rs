//! Small load steps next to loads without a neighbour on their branch, for the contact stiffness there.

#[cfg(doc)]
use crate::method::State;
use crate::method::{ContactMethod, Load, Observer, Problem, Stop};
use crate::{Error, Result};

/// Relative step of the load. The stiffness from this step and the far neighbour is of second order in it; a smaller step
/// counts single nodes that come into contact.
const STEP: f64 = 0.05;

/// Fields of f64 that the solve of a step holds in addition to that of the path: heights, gap and stress.
pub(super) const FIELDS: u64 = 3;

/// Pressure (E*) and separation (L, [`State::separation`]) of `problem` at a small step from load `i` on each side on
/// which its branch has no load. A step that does not converge is left out.
///
/// # Errors
/// `Interrupted`, and the errors of the method.
pub(super) fn solve(
    method: &dyn ContactMethod,
    problem: &Problem,
    loads: &[Load],
    i: usize,
    observer: &dyn Observer,
) -> Result<Vec<[f64; 2]>> {
    let mut found = Vec::new();
    for factor in missing_sides(loads, i) {
        let load = match loads[i] {
            Load::Pressure(p) => Load::Pressure(p * factor),
            Load::MeanGap(g) => Load::MeanGap(g * factor),
        };
        let mut run = method.start(problem, observer)?.solver()?;
        let state = run.equilibrate(load)?;
        match state.stop {
            Stop::Converged => found.push([state.pressure, state.separation]),
            Stop::Interrupted => return Err(Error::Interrupted),
            _ => {}
        }
    }
    Ok(found)
}

/// Factors of load `i` on the sides without a neighbour.
fn missing_sides(loads: &[Load], i: usize) -> Vec<f64> {
    let value = |load: &Load| match load {
        Load::Pressure(v) | Load::MeanGap(v) => *v,
    };
    let here = value(&loads[i]);
    if here <= 0.0 {
        return Vec::new();
    }
    let before = i.checked_sub(1).map(|k| value(&loads[k]));
    let after = loads.get(i + 1).map(value);
    match (before, after) {
        (None, None) => vec![1.0 - STEP, 1.0 + STEP],
        (Some(other), None) | (None, Some(other)) => vec![if other < here { 1.0 + STEP } else { 1.0 - STEP }],
        // At a reversal both neighbours are on one side.
        (Some(a), Some(b)) if a < here && b < here => vec![1.0 + STEP],
        (Some(a), Some(b)) if a > here && b > here => vec![1.0 - STEP],
        _ => Vec::new(),
    }
}
