//! Trade-off page: error against cost, cheapest settings.

mod charts;
mod labels;
mod tables;

use super::document::{PageSection, document};
use super::prelude::*;
use crate::record::tradeoff::{FILE, TradeoffResults};
use labels::methods;

pub(super) fn page(writer: &FigureWriter, tradeoff: &TradeoffResults) -> Result<Markup> {
    let mut sections = Vec::new();
    let mut add = |anchor, title, body| sections.push(PageSection { anchor, title, body });
    let (first, others) = charts::section(writer, tradeoff)?;
    add("front", "Error against cost", others);
    add("cheapest", "Cheapest setting per error class", tables::cheapest(tradeoff));
    if tradeoff.points.iter().any(|p| p.resolved.is_some()) {
        add("atoms", "Blocks of atoms", tables::atoms(tradeoff));
    }
    add("reference", "The reference", tables::references(tradeoff));
    add("settings", "All settings", tables::settings(tradeoff));
    if !tradeoff.skipped.is_empty() {
        add("skipped", "Settings not run", tables::skipped(tradeoff));
    }
    let name = format!("{}: accuracy and its cost", tradeoff.name);
    document((&name, &lead(tradeoff)), top(tradeoff, &first), &sections, &writer.folder.join(FILE))
}

fn lead(tradeoff: &TradeoffResults) -> String {
    let settings = tradeoff.points.iter().filter(|p| p.unavailable_reason.is_none()).count();
    let (methods, loads) = (methods(tradeoff).len(), tradeoff.p_star.len().max(1));
    let many = |n: usize, description: &str| format!("{n} {description}{}", if n == 1 { "" } else { "s" });
    let against = tradeoff.references.first().map_or("nothing".into(), |r| {
        format!("{} in {} on {} × {} points", r.setting.method, r.setting.precision, r.setting.nx, r.setting.ny)
    });
    let (settings, methods, loads) = (many(settings, "setting"), many(methods, "method"), many(loads, "load"));
    format!("{settings} of {methods}, each at {loads}, against {against}.")
}

/// The conclusion, the charts of area and mean gap, and the setting of the comparison.
fn top(tradeoff: &TradeoffResults, charts: &Markup) -> Markup {
    let loads: Vec<String> = tradeoff.p_star.iter().map(|p| tradeoff.loads.value(*p)).collect();
    html! {
        @if let Some(conclusion) = tables::conclusion(tradeoff) { p.found { (conclusion) } }
        @if !tradeoff.warnings.is_empty() {
            details.warnings open { summary { "Warnings" } ul { @for w in &tradeoff.warnings { li { (w) } } } }
        }
        div.pair { (charts) }
        p { "Surface " (tradeoff.surface) "; " (tradeoff.kernel) "; adhesion " (tradeoff.adhesion)
            @if !loads.is_empty() { "; loads " (tradeoff.loads.quantity.symbol()) (loads.join(", ")) } ". On " (tradeoff.threads)
            @if tradeoff.threads == 1 { " thread" } @else { " threads" } ", " (runs(tradeoff)) "; " (duration(tradeoff.spent_seconds)) " in all"
            @if let Some(b) = tradeoff.budget_seconds { " of a budget of " (duration(b)) } "." }
        p { "Costs are seconds of processor time of all threads, for all loads, including the observables of every run "
            "(distributions, clusters, maps, and the coarser grid of the error estimate). Errors are root mean squares over "
            "the loads, against the reference; no error is given below the uncertainty of the reference." }
    }
}

/// Number of runs per setting.
fn runs(tradeoff: &TradeoffResults) -> String {
    match tradeoff.repeats {
        Some(1) => "one run each".into(),
        Some(n) => format!("the minimum of {n} runs each"),
        None => "one run each, and the minimum of three to thirty for runs shorter than a second".into(),
    }
}
