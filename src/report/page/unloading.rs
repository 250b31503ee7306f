//! Unloading of the atoms: contact against load, comparison with loading, pull-off.

use maud::{Markup, html};

use super::figures::{FigureWriter, figure, numbers, text};
use crate::error::Result;
use crate::record::results::{AtomPullOff, AtomsResults, LoadStepResults, Unloading};
use crate::report::number::{count, percent, significant, trimmed};
use crate::report::plot::{ATOMS, Axis, BACK, Curve, Plot};

/// Curves over the load steps, one per branch; `reversal`: last step of loading.
pub(super) fn branch_curves(
    steps: &[LoadStepResults],
    reversal: Option<usize>,
    of: impl Fn(&LoadStepResults) -> (f64, f64),
) -> Vec<Curve> {
    let curve = |label: &str, style, steps: &[LoadStepResults]| Curve {
        label: label.into(),
        style,
        points: steps.iter().map(&of).collect(),
    };
    match reversal.filter(|t| *t < steps.len()) {
        None => vec![curve("", ATOMS, steps)],
        Some(t) => vec![curve("loading", ATOMS, &steps[..=t]), curve("unloading", BACK, &steps[t..])],
    }
}

pub(super) fn section(writer: &FigureWriter, atoms: &AtomsResults, back: &Unloading) -> Result<Markup> {
    let curves = branch_curves(&atoms.load_steps, Some(back.reversal_step), |s| (s.p_star, s.contacts as f64));
    let plot = Plot { proportion: 0.5, ..Plot::new((Axis::Linear, Axis::Linear), ("p*", "contact atoms"), curves) };
    let curve = writer.curves("unloading-contacts", &plot)?;
    let rows = back
        .changes
        .iter()
        .map(|c| {
            let change = match c.contact_area_loading {
                0.0 => "–".to_string(),
                loading => percent(c.contact_area_unloading / loading - 1.0),
            };
            vec![
                text(trimmed(c.p_star, 4)),
                text(percent(c.contact_area_loading)),
                text(percent(c.contact_area_unloading)),
                text(change),
                text(format!("{}\u{a0}Å", significant(c.mean_gap_angstrom, 3))),
            ]
        })
        .collect();
    let head = ["p*", "contact, loading", "contact, unloading", "change of contact", "change of mean gap"];
    Ok(html! {
        h3 { "Unloading" }
        @if let Some(curve) = curve {
            (figure(curve, html! { "Contact against load on loading and unloading. Without adhesion and plasticity both branches coincide." }))
        }
        @if !back.changes.is_empty() { (numbers(&head, rows)) }
        @if let Some(p) = &back.pull_off { (pull_off(p)) }
        @else if back.separated == Some(true) { p { "No tensile load occurs on unloading." } }
        @if back.separated == Some(false) {
            p { span.bad { "The surfaces did not separate: " } "atoms were still in contact at the last unloading step." }
        }
    })
}

fn pull_off(p: &AtomPullOff) -> Markup {
    html! {
        p { "The pull-off force is " strong { (significant(-p.force_nn, 4)) " nN" } " (" (significant(-p.force_ev_per_angstrom, 4))
            " ± " (significant(p.error_ev_per_angstrom, 2)) " eV/Å, p* = " (significant(p.p_star, 3)) "), with the indenter "
            (significant(p.displacement_angstrom, 4)) " Å below its initial position and " (count(p.contacts)) " atoms in contact. The error is "
            "the increase of the tension over the last step, of " (significant(p.step_angstrom, 2)) " Å." }
    }
}
