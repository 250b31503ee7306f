//! Papers and data on which the results of a run are based.

use crate::record::bibliography::cited;
use crate::scene::Case;
use asperity_atoms::results::{AtomsResults, StepMinimizer};
use asperity_contact::problem::{AdhesionLaw, Body};

/// A run: its scene, and its atoms.
#[derive(Clone, Copy)]
pub(super) struct Ran<'a> {
    pub case: &'a Case,
    pub atoms: Option<&'a AtomsResults>,
}

/// What a run may use: whether one did, the papers by their keys in `references.bib`, and what they are the source of.
type Feature = (fn(Ran) -> bool, &'static [&'static str], &'static str);

const FEATURES: [Feature; 15] = [
    (|_| true, &["Muser2017"], "the problem, its surface, methods and units"),
    (|_| true, &["Yastrebov2017"], "perimeter correction of the contact area"),
    (|_| true, &["Jacobs2017"], "convention of the power spectral density"),
    (
        |ran| matches!(ran.case.problem.body, Body::Layer { .. }) || ran.case.atoms.is_some(),
        &["Carbone2009"],
        "elastic layer",
    ),
    (|ran| matches!(ran.case.problem.body, Body::Cubic { .. }), &["Vlassak1994"], "half-space of a crystal"),
    (is_non_periodic, &["Vico2016"], "surface that is not periodic"),
    (is_dugdale, &["Dugdale1960", "Maugis1992"], "constant attraction"),
    (has_hardness, &["Almqvist2007"], "hardness as a bound of the stress"),
    (|ran| ran.case.scene.continuum.leakage, &["Reynolds1886"], "flow through the gap"),
    (|ran| has_stress_below(ran) && !is_non_periodic(ran), &["Johnson1985"], "stress below the surface"),
    (|ran| has_stress_below(ran) && is_non_periodic(ran), &["Love1929"], "stress below the surface"),
    (|ran| ran.case.atoms.is_some(), &["Thompson2022"], "LAMMPS, the molecular statics"),
    (is_relaxed_by_harmonic_steps, &["Byrd1994", "Campana2006"], "harmonic relaxation"),
    (counts_defects, &["Kelchner1998"], "centro-symmetry"),
    (is_warm, &["Flyvbjerg1989"], "errors of time averages"),
];

fn is_non_periodic(ran: Ran) -> bool {
    matches!(ran.case.problem.body, Body::NonPeriodic)
}

fn is_dugdale(ran: Ran) -> bool {
    let adhesion = ran.case.problem.adhesion.as_ref();
    adhesion.is_some_and(|a| a.table.is_none() && a.law == AdhesionLaw::Dugdale)
}

/// Also that of the crystal, in the comparison with atoms.
fn has_hardness(ran: Ran) -> bool {
    ran.case.problem.hardness.is_some() || ran.case.scene.atoms.as_ref().is_some_and(|atoms| atoms.hardness.is_some())
}

fn has_stress_below(ran: Ran) -> bool {
    ran.case.scene.continuum.subsurface.is_some()
}

fn counts_defects(ran: Ran) -> bool {
    ran.case.scene.atoms.as_ref().is_some_and(|atoms| atoms.plasticity)
}

fn is_relaxed_by_harmonic_steps(ran: Ran) -> bool {
    use StepMinimizer::{Harmonic, HarmonicCg, HarmonicFire};
    let harmonic = |m| [Harmonic, HarmonicCg, HarmonicFire].contains(&m);
    ran.atoms.is_some_and(|atoms| atoms.load_steps.iter().any(|s| harmonic(s.minimizer)))
}

fn is_warm(ran: Ran) -> bool {
    ran.case.atoms.as_ref().is_some_and(|atoms| atoms.nvt.is_some())
}

/// A line for each feature and method that a run used.
pub(super) fn sources(ran: Ran) -> Vec<String> {
    let (case, used) = (ran.case, FEATURES.iter().filter(|(has, ..)| has(ran)));
    let mut list: Vec<String> = used.map(|(_, keys, of)| line(keys, of)).collect();
    list.extend(of_methods(case));
    if case.atoms.is_some() {
        list.push(match case.scene.atoms.as_ref().and_then(|atoms| atoms.potential.as_ref()) {
            Some(own) => format!("The potential is that of {}.", own.display()),
            None => "The calcium-like potential is asperity's own; potentials/README.md describes fit and properties."
                .to_string(),
        });
    }
    list
}

fn line(keys: &[&str], of: &str) -> String {
    format!("{}: {of}.", keys.iter().map(|key| cited(key)).collect::<Vec<_>>().join("; "))
}

fn of_methods(case: &Case) -> Vec<String> {
    let second = case.scene.challenge.as_ref().and_then(|c| asperity_methods::find(&c.cross_check_method));
    let compared = case.comparison_methods();
    let cards = std::iter::once(case.method()).chain(second.map(|m| m.card())).chain(compared.iter().map(|m| m.card()));
    let (mut named, mut list) = (Vec::new(), Vec::new());
    for card in cards {
        if named.contains(&card.id) {
            continue;
        }
        named.push(card.id);
        list.push(if card.paper_name == "-" {
            format!(
                "Method {}: asperity's own (version {}), described in docs/methods.md; its equations are those of the \
                 challenge.",
                card.id,
                env!("CARGO_PKG_VERSION")
            )
        } else {
            let dois = card.dois.iter().map(|d| format!("doi:{d}"));
            let named = dois.chain(card.papers.iter().map(|p| p.to_string())).collect::<Vec<_>>().join("; ");
            format!("Method {} ({}): {named}.", card.id, card.paper_name)
        });
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A key without an entry would end a run.
    #[test]
    fn features_have_papers_that_are_in_the_bibliography() {
        for (_, keys, of) in FEATURES {
            assert!(!keys.is_empty() && line(keys, of).contains(of), "{of}");
        }
    }
}
