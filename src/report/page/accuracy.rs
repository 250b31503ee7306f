//! The grids that were solved to reach an accuracy.

use super::prelude::*;
use crate::report::accuracy::{missed_by, reached_errors};
use crate::report::number::duration;
use asperity_contact::problem::StatedQuantity;
use std::collections::BTreeSet;

/// What was asked for and reached; empty for a scene that asks for none.
pub(super) fn section(results: &Results) -> Markup {
    let Some(reached) = &results.accuracy else { return html! {} };
    let asked = match (reached.requested.is_empty(), reached.budget_seconds) {
        (false, _) => format!("An error of {} was asked for", reached.requested),
        (true, seconds) => format!("The least errors within {} were asked for", duration(seconds.unwrap_or_default())),
    };
    let missed = missed_by(results);
    let judged: Vec<StatedQuantity> = reached
        .grids
        .iter()
        .flat_map(|grid| grid.errors.keys().copied())
        .collect::<BTreeSet<_>>()
        .into_iter()
        .collect();
    let head: Vec<&str> = ["nodes", "time"].into_iter().chain(judged.iter().map(|q| q.name())).collect();
    let rows = reached.grids.iter().map(|grid| {
        let error = |q: &StatedQuantity| grid.errors.get(q).copied().flatten();
        let errors = judged.iter().map(|q| or_dash(error(q).map(|e| format!("{} %", significant(100.0 * e, 3)))));
        row![format!("{} × {}", count(grid.nx), count(grid.ny)), duration(grid.seconds)]
            .into_iter()
            .chain(errors)
            .collect()
    });
    html! {
        p { (asked) ", and " @if missed.is_none() { "reached" } @else { strong { "not reached" } }
            ": " (reached_errors(reached)) "." @if let Some(missed) = &missed { " " (capitalised(missed)) "." } }
        details { summary { "Grids, from coarse to fine" } (table("numbers", &head, rows)) }
    }
}
