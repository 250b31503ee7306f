//! The page of a ladder of methods: error against cost, what is cheapest, how costs grow.

mod charts;
mod costs;
mod labels;
mod tables;

use super::document::{Section, document, linked};
use super::figures::FigureWriter;
use crate::error::Result;
use crate::record::tradeoff::{FILE, Tradeoff};
use crate::report::number::{duration, trimmed};
use labels::methods;
use maud::{Markup, html};

pub fn page(writer: &FigureWriter, told: &Tradeoff) -> Result<Markup> {
    let mut sections = Vec::new();
    let mut add = |anchor, title, body| sections.push(Section { anchor, title, body });
    add("front", "Error against cost", charts::section(writer, told)?);
    add("cheapest", "The cheapest that is good enough", tables::cheapest(told));
    add("growth", "How costs grow", costs::section(writer, told)?);
    if told.points.iter().any(|p| p.resolved.is_some()) {
        add("atoms", "Blocks of atoms", tables::atoms(told));
    }
    add("reference", "The reference", tables::references(told));
    add("settings", "All settings", tables::settings(told));
    if !told.skipped.is_empty() {
        add("left-out", "What was left out", tables::left_out(told));
    }
    add("sources", "Sources", html! { ol { li { (linked(costs::SOURCE)) } } });
    let name = format!("{}: accuracy and its cost", told.name);
    Ok(document((&name, &lead(told)), top(told), &sections, FILE))
}

fn lead(told: &Tradeoff) -> String {
    let settings = told.points.iter().filter(|p| p.unavailable_reason.is_none()).count();
    let (methods, loads) = (methods(told).len(), told.p_star.len().max(1));
    let many = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    let against = told.references.first().map_or("nothing".into(), |r| {
        format!("{} in {} on {} × {} points", r.setting.method, r.setting.precision, r.setting.nx, r.setting.ny)
    });
    let (settings, methods, loads) = (many(settings, "setting"), many(methods, "method"), many(loads, "load"));
    format!("{settings} of {methods}, each at {loads}, against {against}.")
}

fn top(told: &Tradeoff) -> Markup {
    let loads: Vec<String> = told.p_star.iter().map(|p| trimmed(*p, 4)).collect();
    html! {
        @if !told.warnings.is_empty() {
            div.warnings { h3 { "Read these first" } ul { @for w in &told.warnings { li { (w) } } } }
        }
        p { "Surface " (told.surface) "; " (told.kernel) "; adhesion " (told.adhesion)
            @if !loads.is_empty() { "; loads p* = " (loads.join(", ")) } ". On " (told.threads)
            @if told.threads == 1 { " thread" } @else { " threads" } ", " (runs(told)) "; " (duration(told.spent_seconds)) " in all"
            @if let Some(b) = told.budget_seconds { " of a budget of " (duration(b)) } "." }
        p { "Costs are those of all loads, with what any run counts of its states (distributions, patches, maps, and the coarser "
            "grid that solvers follow for their error): seconds of processor time, all threads together. Errors are root mean "
            "squares over the loads, against the reference; none is told that is smaller than what is uncertain of the "
            "reference itself." }
    }
}

/// How often settings were run.
fn runs(told: &Tradeoff) -> String {
    match told.repeats {
        Some(1) => "one run each".into(),
        Some(n) => format!("the least of {n} runs each"),
        None => "one run each, and the least of three to thirty where they take less than a second".into(),
    }
}
