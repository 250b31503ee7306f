//! Definitions of the terms of a report: on hover or tap of a term, and as a list at the end of the page.

use super::prelude::*;

/// A term that is explained where it occurs.
#[derive(Debug, Clone, Copy)]
pub(super) enum Term {
    Load,
    Gap,
    Contact,
    Kappa,
}

const LOAD: &str = "Reduced load: mean pressure over E* times the rms gradient of the surface.";
const GAP: &str = "Distance between the two surfaces along z; zero where they touch.";

/// The term with its definition, which opens on hover, tap or keyboard focus, without JavaScript.
pub(super) fn term(term: Term) -> Markup {
    let (name, meaning) = match term {
        Term::Load => ("p*", LOAD),
        Term::Gap => ("gap", GAP),
        Term::Contact => {
            ("contact", "Fraction of the cell, or of the surface atoms, in contact. It depends on the criterion.")
        }
        Term::Kappa => ("κ", "Cohen’s κ: agreement of two contact maps beyond chance; 1 for equal maps, 0 for chance."),
    };
    html! { span.term tabindex="0" { (name) span.meaning role="note" { (meaning) " " a href="#definitions" { "All definitions" } } } }
}

/// Definitions of all symbols that the page uses.
pub(super) fn section(results: &Results) -> Markup {
    let modulus = si_given(results.scales.modulus_pa, "Pa");
    let length = si_given(results.scales.length_m, "m");
    html! {
        dl {
            dt { "L, E*" }
            dd {
                @if let Some(atoms) = &results.atoms {
                    "Extent of the cell in x and contact modulus E/(1 − ν²), the units of length and of stress of the dimensionless problem. "
                    "Atoms and the continuum that they are compared with: " (si_given(atoms.length_angstrom * 1e-10, "m"))
                    " and " (trimmed(atoms.modulus_gpa, 4)) " GPa, that of the crystal of their potential (" (atoms.potential)
                    "), the harmonic mean over the directions of waves in its (001) face. The continuum at laboratory scale: "
                    (length) " and " (modulus) ", [laboratory] of the scene or its defaults."
                } @else {
                    "Extent of the cell in x, here " (length) ", and contact modulus E/(1 − ν²), here " (modulus)
                    ". They are the units of length and of stress of the dimensionless problem."
                } }
            dt { "p*" }
            dd { (LOAD) " Contact area grows with p* alike for all surfaces of small slope. The gradient is always that of "
                "the whole spectrum: a grid or block that resolves less of it has more contact at the same p*."
                @if results.loads.quantity != LoadQuantity::PStar { " Here p* = 1 is " (results.loads.label(1.0)) @if results.atoms.is_some() { " at the laboratory scale" } "." } }
            dt { "Gap" }
            dd { (GAP) " The mean gap is over the whole cell."
                @if results.atoms.is_some() {
                    " For atoms and the compliant wall the gap is measured from the distance at which the repulsion begins; it is "
                    "negative where the load presses them closer."
                } }
            dt { "Contact" }
            dd { "Fraction of the cell in contact. It depends on the " em { "criterion" } ": zero gap for a hard wall, a distance "
                "below a threshold for atoms, which have no sharp surface. Every contact fraction is given with its criterion." }
            @if let Some(load) = results.comparison.as_ref().and_then(|c| c.loads.first()) {
                dt { "Criteria" }
                dd { em { "Atoms" } ": " (load.atoms.criterion) " (that distance is d_c). " em { "Hard wall" } ": zero gap at a hard "
                    "wall. " em { "Compliant wall" } ": the continuum uses the atoms’ own repulsion law; contact where a surface atom at "
                    "the continuum’s surface is within d_c of an indenter atom. " em { "Offset wall" } ": the same with "
                    "a hard wall, the surface shifted by the wall’s compression under the mean contact stress. "
                    "No parameter is fitted to the atoms." }
                dt { "κ, Jaccard" }
                dd { "Agreement of two contact maps site by site. Jaccard: sites in contact in both over sites in contact "
                    "in either; κ (Cohen): agreement beyond chance, 1 for equal maps, 0 for chance. "
                    "Each is given with its value for a map misaligned by a third and a fifth of the cell: the same clusters "
                    "in the wrong places." }
            }
        }
    }
}
