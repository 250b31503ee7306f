//! Unloading of the atoms: contact against load, comparison with loading, pull-off.

use super::prelude::*;

/// Curves over the load steps, one per branch; `reversal`: last step of loading.
pub(super) fn branch_curves(
    steps: &[LoadStepResults],
    reversal: Option<usize>,
    of: impl Fn(&LoadStepResults) -> (f64, f64),
) -> Vec<Curve> {
    match reversal.filter(|t| *t < steps.len()) {
        None => vec![Curve::new("", ATOMS, steps.iter().map(of))],
        Some(t) => vec![
            Curve::new("loading", ATOMS, steps[..=t].iter().map(&of)),
            Curve::new("unloading", BACK, steps[t..].iter().map(&of)),
        ],
    }
}

pub(super) fn section(writer: &FigureWriter, atoms: &AtomsResults, unloading: &Unloading) -> Result<Markup> {
    let curves = branch_curves(&atoms.load_steps, Some(unloading.reversal_step), |s| (s.p_star, s.contacts as f64));
    let contacts = Figure::new(
        "unloading-contacts",
        "Contact against load on loading and unloading. Without adhesion and plasticity both branches coincide.",
        Plot { proportion: 0.5, ..Plot::new(linear(""), linear("contact atoms"), curves).against(writer.loads) },
    );
    let change = |loading: f64, unloading: f64| (loading != 0.0).then(|| percent(unloading / loading - 1.0));
    Ok(html! {
        h3 { "Unloading" }
        (writer.figures([contacts])?)
        @if !unloading.changes.is_empty() {
            (columns!("numbers", &unloading.changes, |c| {
                writer.loads.head() => writer.loads.value(c.p_star),
                "contact, loading" => percent(c.contact_area_loading),
                "contact, unloading" => percent(c.contact_area_unloading),
                "change of contact" => or_dash(change(c.contact_area_loading, c.contact_area_unloading)),
                "change of mean gap" => with_unit(c.mean_gap_angstrom, 3, "Å"),
            }))
        }
        @if let Some(p) = &unloading.pull_off { (pull_off(p, writer.loads)) }
        @else if unloading.separated == Some(true) { p { "No tensile load occurs on unloading." } }
        @if unloading.separated == Some(false) {
            p { (bad("The surfaces did not separate: ")) "atoms were still in contact at the last unloading step." }
        }
    })
}

fn pull_off(p: &AtomPullOff, loads: GivenLoads) -> Markup {
    html! {
        p { "The pull-off force is " strong { (significant(-p.force_nn, 4)) " nN" } " (" (significant(-p.force_ev_per_angstrom, 4))
            " ± " (significant(p.error_ev_per_angstrom, 2)) " eV/Å, " (loads.label(p.p_star)) "), with the indenter "
            (significant(p.displacement_angstrom, 4)) " Å below its initial position and " (count(p.contacts)) " atoms in contact. The error is "
            "the increase of the tension over the last step, of " (significant(p.step_angstrom, 2)) " Å." }
    }
}
