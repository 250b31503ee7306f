//! The atoms' way back from the highest load: contact against load, the loads once more, the largest pull.

use maud::{Markup, html};

use super::figures::{FigureWriter, figure, numbers, text};
use crate::error::Result;
use crate::record::results::{AtomPullOff, AtomsResults, LoadStepResults, Unloading};
use crate::report::number::{count, percent, significant, trimmed};
use crate::report::plot::{ATOMS, Axis, BACK, Curve, Plot};

/// Curves over the load steps: the loading branch, and the unloading branch from step `turn` on.
pub fn there_and_back(
    steps: &[LoadStepResults],
    turn: Option<usize>,
    of: impl Fn(&LoadStepResults) -> (f64, f64),
) -> Vec<Curve> {
    let curve = |label: &str, style, steps: &[LoadStepResults]| Curve {
        label: label.into(),
        style,
        points: steps.iter().map(&of).collect(),
    };
    match turn.filter(|t| *t < steps.len()) {
        None => vec![curve("", ATOMS, steps)],
        Some(t) => vec![curve("there", ATOMS, &steps[..=t]), curve("back", BACK, &steps[t..])],
    }
}

pub fn section(writer: &FigureWriter, atoms: &AtomsResults, back: &Unloading) -> Result<Markup> {
    let curves = there_and_back(&atoms.load_steps, Some(back.reversal_step), |s| (s.p_star, s.contacts as f64));
    let plot = Plot { proportion: 0.5, ..Plot::new((Axis::Linear, Axis::Linear), ("p*", "contact atoms"), curves) };
    let curve = writer.curves("unloading-contacts", &plot)?;
    let rows = back
        .changes
        .iter()
        .map(|c| {
            let change = match c.contact_fraction_loading {
                0.0 => "–".to_string(),
                there => percent(c.contact_fraction_unloading / there - 1.0),
            };
            vec![
                text(trimmed(c.p_star, 4)),
                text(percent(c.contact_fraction_loading)),
                text(percent(c.contact_fraction_unloading)),
                text(change),
                text(format!("{}\u{a0}Å", significant(c.mean_gap_angstrom, 3))),
            ]
        })
        .collect();
    let head = ["p*", "contact there", "contact back", "change of the contact", "change of the mean gap"];
    Ok(html! {
        h3 { "The way back" }
        @if let Some(curve) = curve {
            (figure(curve, html! { "Contact against load, there and back. Without adhesion and yield both ways are one." }))
        }
        @if !back.changes.is_empty() { (numbers(&head, rows)) }
        @if let Some(p) = &back.pull_off { (pull_off(p)) }
        @else if back.separated == Some(true) { p { "On the way back nothing pulls." } }
        @if back.separated == Some(false) {
            p { span.bad { "The indenter did not come free: " } "atoms touched it still where the way back ended." }
        }
    })
}

fn pull_off(p: &AtomPullOff) -> Markup {
    html! {
        p { "The largest pull is " strong { (significant(-p.force_nn, 4)) " nN" } " (" (significant(-p.force_ev_per_angstrom, 4))
            " ± " (significant(p.error_ev_per_angstrom, 2)) " eV/Å, p* = " (significant(p.p_star, 3)) "), with the indenter "
            (significant(p.displacement_angstrom, 4)) " Å below its start and " (count(p.contacts)) " atoms in contact. The error is "
            "what the pull grew by on the step to it, of " (significant(p.step_angstrom, 2)) " Å." }
    }
}
