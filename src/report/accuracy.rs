//! What was reached of an accuracy, in words.

use crate::record::results::Results;
use crate::report::number::{duration, significant};
use asperity_contact::problem::{AccuracyResults, ErrorCost, ErrorTargets, LastGrid, SolvedGrid, StatedQuantity};
use asperity_contact::results::ContinuumResults;
use asperity_contact::uncertainty::UncertaintySource;
use asperity_surface::Surface;

/// The errors of the results as words.
pub fn reached_errors(reached: &AccuracyResults) -> String {
    let errors = reached.grids.last().into_iter().flat_map(|grid| &grid.errors);
    errors.map(|(quantity, e)| format!("{} {}", quantity.name(), percent(*e))).collect::<Vec<_>>().join(", ")
}

/// An error in percent.
fn percent(error: Option<f64>) -> String {
    match error {
        None => "not known".into(),
        Some(e) if e < 1e-5 => "below 0.001 %".into(),
        Some(e) => format!("{} %", significant(100.0 * e, 3)),
    }
}

/// What was not reached, and why.
pub fn missed(reached: &AccuracyResults) -> Option<String> {
    let SolvedGrid { nx, ny, .. } = reached.grids.last()?;
    let waves = format!("finer grids than {} points per shortest wave are not tried", Surface::NODES_PER_WAVE);
    let reason = match reached.last {
        LastGrid::Met => return None,
        _ if reached.requested.is_empty() => return None,
        LastGrid::Map => "the map has no points between these, and a finer grid would assume its shorter waves",
        LastGrid::Waves => &waves,
        LastGrid::Budget => "a finer grid would exceed the budget",
        LastGrid::Memory => "a finer grid does not fit into memory",
        LastGrid::NotConverged => "finer grids did not converge",
    };
    let exceeded = reached.exceeded().map(|(quantity, e)| format!("{} {}", quantity.name(), percent(e)));
    let exceeded = exceeded.collect::<Vec<_>>().join(", ");
    Some(format!("an error of {} is not reached: {exceeded} on {nx} x {ny} points; {reason}", reached.requested))
}

/// What was reached, and what other errors would have cost, in one line.
pub fn summary(reached: &AccuracyResults) -> String {
    let Some(SolvedGrid { nx, ny, .. }) = reached.grids.last() else { return String::new() };
    let within = if reached.is_met() { format!("within {}: ", reached.requested) } else { String::new() };
    let mut text =
        format!("{within}{} on {nx} x {ny} points in {}", reached_errors(reached), duration(reached.seconds()));
    for (factor, name) in [(10.0, "ten times the error asked for"), (0.1, "a tenth of it")] {
        text += &match reached.cost_of(factor) {
            Some(ErrorCost::Measured(seconds)) => format!("; {name}: {}", duration(seconds)),
            Some(ErrorCost::Estimated(seconds)) => format!("; {name}: about {} (estimate)", duration(seconds)),
            None => String::new(),
        };
    }
    if reached.last == LastGrid::Budget && reached.requested.is_empty() {
        text += "; a finer grid would exceed the budget";
    }
    text
}

/// What was not reached of the accuracy of a run, its atoms included.
pub fn missed_by(results: &Results) -> Option<String> {
    let reached = results.accuracy.as_ref()?;
    let hard = results.comparison.as_ref().map(|c| &c.hard_wall);
    let depth = hard.and_then(|hard| missed_by_depth(&reached.requested, hard));
    missed(reached).into_iter().chain(depth).reduce(|all, next| format!("{all}; {next}"))
}

/// Largest relative changes, over the loads, of a continuum under the atoms' profile by the finite depth of their block.
fn changes_by_depth(hard: &ContinuumResults) -> impl Iterator<Item = (StatedQuantity, f64)> {
    StatedQuantity::ALL.into_iter().filter_map(|stated| {
        let parts = hard.states.iter().flat_map(|state| &state.uncertainty);
        let of_depth = parts.filter(|p| p.source == UncertaintySource::Depth && Some(p.quantity) == stated.quantity());
        Some((stated, of_depth.filter_map(|p| p.relative).reduce(f64::max)?))
    })
}

fn listed(changes: impl Iterator<Item = (StatedQuantity, f64)>) -> Option<String> {
    changes
        .map(|(q, change)| format!("{} by up to {}", q.name(), percent(Some(change))))
        .reduce(|a, b| format!("{a}, {b}"))
}

/// What the finite depth of the atoms' block changes, where it was judged.
pub fn depth_sentence(results: &Results) -> Option<String> {
    let changes = listed(changes_by_depth(&results.comparison.as_ref()?.hard_wall))?;
    Some(format!(
        "by elasticity the depth of the block changes {changes} from a half-space; plastic flow is not judged"
    ))
}

/// The changes by the depth of the atoms' block that exceed the errors asked for. `hard`: the continuum of the block's depth.
pub fn missed_by_depth(requested: &ErrorTargets, hard: &ContinuumResults) -> Option<String> {
    let exceeds = |(q, change): &(StatedQuantity, f64)| requested.of(*q).is_some_and(|accepted| *change > accepted);
    let changes = listed(changes_by_depth(hard).filter(exceeds))?;
    Some(format!(
        "an error of {requested} is not reached by the atoms: by elasticity the depth of their block changes {changes} from a \
         half-space, which atoms.base = \"elastic\" and atoms.foundation_cells = \"half-space\" put below them"
    ))
}
