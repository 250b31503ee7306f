//! The atomistic simulation: block, scaling audit, load steps, states.

use super::figures::symbol;
use super::prelude::*;
use super::{criteria, nvt, unloading};
use crate::report::relaxation::relaxation_sentence;

pub(super) fn section(writer: &FigureWriter, atoms: &AtomsResults) -> Result<Markup> {
    Ok(html! {
        p { "The same dimensionless problem on a cell of " (trimmed(atoms.length_angstrom / 10.0, 4)) " nm: a block of "
            (atoms.cells) " × " (atoms.cells) " × " (atoms.depth_cells) " lattice cells (lattice constant "
            (trimmed(atoms.a0_angstrom, 5)) " Å), " (count(atoms.deformable)) " deformable atoms on " (count(atoms.fixed))
            @if atoms.elastic_base {
                " that move with the forces of the crystal missing below them, " (atoms.foundation_cells) " lattice constants down to a rigid plane"
            } @else if atoms.foundation_cells > 0 {
                " that an elastic foundation of " (atoms.foundation_cells) " lattice constants moves"
            } @else { " that do not" }
            ", under a rigid rough indenter of " (count(atoms.indenter)) " atoms. Potential: "
            (atoms.potential) ". Repulsion between indenter and block: Lennard-Jones, ε = "
            (trimmed(atoms.repulsion.epsilon_ev, 5)) " eV, σ = " (trimmed(atoms.repulsion.sigma_angstrom, 5))
            " Å, cut off at its minimum; an atom is in contact within d_c = "
            (trimmed(atoms.repulsion.contact_distance_angstrom, 5)) " Å. Engine: " (atoms.engine) "." }
        @if !atoms.audit.is_empty() { h3 { "Scaling audit" } (audit(&atoms.audit)) }
        h3 { @if atoms.from_continuum { "Loads" } @else { "Load steps" } }
        @if writer.loads.quantity != LoadQuantity::PStar {
            p.quiet { "Loads are named as the scene gives them, at the laboratory scale; the block has the same p*, under other pressures." }
        }
        @if let Some(steps) = load_steps(writer, atoms)? { (steps) }
        @if !atoms.states.is_empty() {
            h3 { "States at the requested loads" }
            (columns!("words", &atoms.states, |s| {
                writer.loads.head() => writer.loads.value(s.p_star),
                "contact" => percent(s.contact_area),
                "contact atoms" => count(s.contacts),
                "of these below the surface" => count(s.contacts_below_surface),
                "mean gap" => with_unit(s.mean_gap_angstrom, 4, "Å"),
                "contact stress" => with_unit(s.contact_stress_gpa, 3, "GPa"),
                "frame" => or_dash(s.frame.as_ref().map(|frame| html! { code { (frame) } })),
            }))
            p.quiet { "Contact: fraction of the surface layer’s atoms in contact. More than a few contact atoms from below "
                "the surface indicate plastic flow, which no elastic method describes." }
        }
        @if let Some(unloading) = &atoms.unloading { (unloading::section(writer, atoms, unloading)?) }
        @if let Some(run) = &atoms.nvt { (nvt::section(writer, atoms, run)?) }
        (criteria::section(writer, atoms)?)
        (criteria::plasticity(writer, atoms)?)
    })
}

fn audit(lines: &[AuditLine]) -> Markup {
    html! {
        p { "Dimensionless groups: the target of the scene (at its highest load) and the actual value of the simulation. "
            "Where they differ, the comparison below uses the atoms’ values on both sides." }
        (columns!("words", lines, |l| {
            "group" => html! { (l.group) " " (symbol(&l.symbol)) },
            "target" => significant(l.target, 4),
            "actual" => significant(l.actual, 4),
            "status" => if l.status == "kept" { l.status.render() } else { bad(&l.status) },
            "reason" => quiet(&l.reason),
        }))
    }
}

/// Load and number of contact atoms against displacement, on loading and unloading.
fn load_steps(writer: &FigureWriter, atoms: &AtomsResults) -> Result<Option<Markup>> {
    let (steps, turn) = (&atoms.load_steps, atoms.unloading.as_ref().map(|u| u.reversal_step));
    let draw = |name: &str, label: &str, value: &dyn Fn(&LoadStepResults) -> f64| {
        let curves = unloading::branch_curves(steps, turn, |s| (s.displacement_angstrom, value(s)));
        let plot = Plot::new(linear("displacement of the indenter (Å)"), linear(label), curves);
        writer.curves(name, &Plot { proportion: 0.36, ..plot })
    };
    let (of_p_star, label) = writer.loads.axis(steps.iter().map(|s| s.p_star.abs()).fold(0.0, f64::max));
    let load = draw("load-steps-load", &label, &|s| of_p_star * s.p_star)?;
    let contacts = draw("load-steps-contacts", "contact atoms", &|s| s.contacts as f64)?;
    let (Some(load), Some(contacts)) = (load, contacts) else { return Ok(None) };
    let worst = steps.iter().map(|s| s.max_force_ev_per_angstrom).fold(0.0, f64::max);
    let evaluations: usize = steps.iter().map(|s| s.force_evaluations).sum();
    Ok(Some(figure(
        html! { (load) (contacts) },
        html! { @if atoms.from_continuum {
            "The load acts on the indenter while the block is relaxed. LAMMPS alone starts each load from the state of the previous one, displaced by "
            "the difference between the continuum solutions; the harmonic relaxation starts from that state itself"
            @if let Some(t) = turn { ". " (t + 1) " points are on loading, the others on unloading" }
        } @else {
            "The indenter comes down in " (turn.map_or(steps.len(), |t| t + 1)) " steps"
            @if let Some(t) = turn { " and rises in " (steps.len() - 1 - t) } "; the block is relaxed at each"
        }
        " (" (count(evaluations)) " force evaluations in all, largest residual force " (significant(worst, 2)) " eV/Å). "
        (relaxation_sentence(steps))
        @if steps.iter().any(|s| s.p_star < 0.0) { " Negative loads are tension, by adhesion." }
        @if !atoms.from_continuum { " States at requested loads are interpolated between steps." } },
    )))
}
