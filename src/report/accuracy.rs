//! What was reached of an accuracy, in words.

use crate::report::number::{duration, significant};
use asperity_contact::problem::{AccuracyResults, ErrorCost, LastGrid, SolvedGrid};
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
