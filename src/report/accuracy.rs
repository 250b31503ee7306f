//! What was reached of an accuracy, in words.

use crate::record::results::Results;
use crate::report::number::{duration, significant};
use asperity_contact::problem::{
    ALMOST_FULL, AccuracyResults, ErrorCost, ErrorTargets, LastGrid, SolvedGrid, StatedQuantity,
};
use asperity_contact::results::ContinuumResults;
use asperity_contact::state::State;
use asperity_contact::uncertainty::{UncertaintyComponent, UncertaintySource};
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

/// Largest relative changes of a continuum under the atoms' profile by the finite depth of their block, over the loads of which errors are
/// judged; `None` where one is not known.
fn changes_by_depth(hard: &ContinuumResults) -> Vec<(StatedQuantity, Option<f64>)> {
    let of_quantity = |stated: StatedQuantity| {
        let in_part = |s: &&State| s.contact_area > 0.0 && s.contact_area < ALMOST_FULL;
        let parts = hard.states.iter().filter(in_part).flat_map(|state| &state.uncertainty);
        let of_depth =
            |p: &&UncertaintyComponent| p.source == UncertaintySource::Depth && Some(p.quantity) == stated.quantity();
        let changes: Vec<Option<f64>> = parts.filter(of_depth).map(|p| p.relative).collect();
        let largest = changes.iter().copied().try_fold(0.0f64, |most, change| Some(most.max(change?)));
        (!changes.is_empty()).then_some((stated, largest))
    };
    StatedQuantity::ALL.into_iter().filter_map(of_quantity).collect()
}

fn listed(changes: &[(StatedQuantity, Option<f64>)]) -> String {
    changes.iter().map(|(q, change)| format!("{} {}", q.name(), percent(*change))).collect::<Vec<_>>().join(", ")
}

/// What the finite depth of the atoms' block changes, where it was judged, and whether that is too much.
pub fn depth_sentence(results: &Results) -> Option<String> {
    let hard = &results.comparison.as_ref()?.hard_wall;
    let missed = results.accuracy.as_ref().and_then(|reached| missed_by_depth(&reached.requested, hard));
    let changes = changes_by_depth(hard);
    let all = || {
        format!(
            "change by the depth of the block, relative to a half-space (elastic, largest over the loads): {}",
            listed(&changes)
        )
    };
    missed.or_else(|| (!changes.is_empty()).then(all))
}

/// The changes by the depth of the atoms' block that exceed the requested errors. `hard`: the continuum of the block's depth.
pub fn missed_by_depth(requested: &ErrorTargets, hard: &ContinuumResults) -> Option<String> {
    let exceeds = |(q, change): &(StatedQuantity, Option<f64>)| {
        requested.of(*q).is_some_and(|accepted| change.is_none_or(|change| change > accepted))
    };
    let exceeded: Vec<_> = changes_by_depth(hard).into_iter().filter(exceeds).collect();
    let remedy = match exceeded.iter().all(|(_, change)| change.is_some()) {
        true => {
            "more atoms.depth_cells, or atoms.foundation_cells = \"half-space\" (from first contact with atoms.base = \"elastic\")"
        }
        false => "more continuum.max_iterations, with which the half-space converges",
    };
    (!exceeded.is_empty()).then(|| {
        format!(
            "an error of {requested} is not reached by the atoms: change by the depth of the block, relative to a half-space (elastic, largest over \
             the loads): {}; accepted: {remedy}",
            listed(&exceeded)
        )
    })
}
