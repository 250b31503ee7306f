//! First screen: the answer in one sentence, the maps, the area–load curve, warnings.

use super::compare::{
    SAME_LOAD, at_load, deviation, differs, matched, matched_uncertainty, more_or_less, state_at, yielding,
};
use super::definitions::{Term, term};
use super::prelude::*;
use super::uncertainty::total;
use super::{challenge, curves, explorer, profile, tiles};
use crate::record::given_loads::Imposed;
use asperity_grid::units::ANGSTROM_M;

pub(super) fn section(writer: &FigureWriter, results: &Results) -> Result<Markup> {
    let flat = profile::is_profile(results.surface.ny);
    let maps = if flat { None } else { explorer::section(writer, results)? };
    let surfaces = if flat { profile::surfaces(writer, results)? } else { None };
    let curve = curves::first_screen(writer, results)?;
    Ok(html! {
        @if let Some(subject) = subject(results) { p.subject { (subject) } }
        @if !results.acceptance.is_empty() { p.found { (challenge::conclusion(results)) } }
        @if let Some(answer) = answer(results) { p.found { (answer) } }
        div.stage {
            @if let Some(maps) = maps { div.explorer id="explorer" { (maps) } }
            @if let Some(surfaces) = surfaces { (surfaces) }
            div.numbers {
                @if let Some(curve) = curve { (curve) }
                (tiles::section(results))
            }
        }
        (warnings(&results.warnings))
    })
}

/// Messages of the terminal with the subscripts of their symbols; empty without any.
pub(super) fn warnings<T: AsRef<str>>(list: &[T]) -> Markup {
    // Letters that no file name has.
    let indexed = |text: String| PreEscaped(text.replace("λ_s", "λ<sub>s</sub>").replace("λ_r", "λ<sub>r</sub>"));
    html! {
        @if !list.is_empty() {
            details.warnings open {
                summary { (list.len()) @if list.len() == 1 { " warning" } @else { " warnings" } }
                ul { @for w in list { li { (indexed(w.as_ref().render().0)) } } }
            }
        }
    }
}

/// What was solved, in one line.
fn subject(results: &Results) -> Option<String> {
    if let (Some(atoms), Some(_)) = (&results.atoms, &results.comparison) {
        return Some(format!(
            "Atoms: {}, a block of {}, {} moving atoms. Continuum: the same heights, loads and depth, E* = {}.",
            atoms.potential,
            si_given(atoms.length_angstrom * ANGSTROM_M, "m"),
            count(atoms.moving()),
            si_given(atoms.modulus_gpa * 1e9, "Pa")
        ));
    }
    let c = results.continuum.as_ref()?;
    let [x, y] = [1.0, results.surface.aspect].map(|l| si_given(l * results.scales.length_m, "m"));
    let (modulus, nodes) = (si_given(results.scales.modulus_pa, "Pa"), format!("{} × {}", count(c.nx), count(c.ny)));
    Some(format!("{x} × {y}, {nodes} nodes; elastic body: {}, E* = {modulus}; adhesion: {}.", c.kernel, c.adhesion))
}

/// The main result in one sentence with its uncertainty.
fn answer(results: &Results) -> Option<Markup> {
    match &results.comparison {
        Some(c) => {
            let hardness = results.atoms.as_ref().and_then(|atoms| hardness_found(atoms, c, results.loads));
            hardness.or_else(|| comparison_found(results.atoms.as_ref(), c, results.loads))
        }
        None => results.continuum.as_ref().and_then(|c| continuum_found(results, c)).map(|s| html! { (s) }),
    }
}

/// `lowest to highest` of formatted values, or a single value if both are formatted alike.
fn span(values: impl Iterator<Item = f64>, show: impl Fn(f64) -> String) -> String {
    let (low, high) = ends(values);
    let (low, high) = (show(low), show(high));
    if low == high { low } else { format!("{low} to {high}") }
}

/// Why the elastic continuum differs from the atoms, and what a hardness explains; `None` without a solution with hardness.
fn hardness_found(atoms: &AtomsResults, c: &ComparisonResults, named: GivenLoads) -> Option<Markup> {
    let hardness = c.yielding_wall.as_ref()?.hardness?;
    let (few, enough): (Vec<_>, Vec<_>) = c.loads.iter().partition(|l| has_few_contacts(Some(atoms), l));
    let pairs: Vec<_> = enough.into_iter().filter_map(|l| Some((l, matched(l)?, yielding(l)?))).collect();
    let worst = |value: &dyn Fn(&LoadComparison, &CriterionMatch, &CriterionMatch) -> Option<f64>| {
        let all = pairs.iter().filter_map(|(l, e, h)| Some((*l, *e, value(l, e, h)?)));
        all.max_by(|a, b| a.2.abs().total_cmp(&b.2.abs()))
    };
    let (load, elastic, mismatch) = worst(&|l, e, _| deviation(l, e))?;
    let (_, _, left) = worst(&|l, _, h| deviation(l, h))?;
    let state = state_at(&c.compliant_wall, load)?;
    let stress = state.pressure / elastic.contact_area;
    let lowest = |value: fn(&CriterionMatch) -> f64, hard: bool| {
        pairs.iter().map(|(_, e, h)| value(if hard { h } else { e })).fold(f64::INFINITY, f64::min)
    };
    let kappa = |hard| significant(lowest(|m| m.overlap.kappa, hard), 2);
    let shifted = pairs.iter().map(|(_, _, h)| h.shifted.kappa.abs()).fold(0.0, f64::max);
    let loads = span(pairs.iter().map(|(l, ..)| l.p_star), |p| named.value(p));
    let fraction = span(pairs.iter().map(|(l, ..)| l.atoms.contact_area), percent);
    let verb = if stress > hardness { "exceeds" } else { "is below" };
    let explains = if left.abs() < 0.5 * mismatch.abs() { "explains it" } else { "does not explain it" };
    Some(html! {
        strong { "The atoms have " (if differs(mismatch) { "up to " } else { "" }) (more_or_less(mismatch)) " " (term(Term::Contact))
            (if differs(mismatch) { " than" } else { " as" }) " the elastic continuum, and the crystal’s hardness " (explains) }
        ". The elastic contact stress of " (si(stress, "Pa", 3)) " at " (of_load(named)) (named.value(load.p_star)) " " (verb) " the hardness of "
        (si(hardness, "Pa", 3)) "; with it the areas differ by at most " (percent(left.abs())) ", and the maps agree with "
        (term(Term::Kappa)) " ≥ " (kappa(true)) " (elastic: " (kappa(false)) "; misaligned maps: |κ| ≤ " (significant(shifted, 2)) "). At " (named.quantity.symbol())
        (loads) ", " (fraction) " of the surface atoms are in contact" (left_out(&few, named)) "."
    })
}

/// What a load follows: p* with its definition, or nothing.
fn of_load(named: GivenLoads) -> Markup {
    html! { @if named.quantity == LoadQuantity::PStar { (term(Term::Load)) " = " } }
}

/// What a sentence says of loads that it leaves out.
fn left_out(few: &[&LoadComparison], named: GivenLoads) -> String {
    let loads = few.iter().map(|l| named.value(l.p_star)).collect::<Vec<_>>().join(", ");
    if few.is_empty() { loads } else { format!("; at {}{loads} too few atoms to compare", named.quantity.symbol()) }
}

/// Whether a load has too few contact atoms to be compared.
fn has_few_contacts(atoms: Option<&AtomsResults>, load: &LoadComparison) -> bool {
    let state = atoms.and_then(|a| at_load(&a.states, load.p_star, |s| s.p_star));
    state.is_some_and(AtomState::has_few_contacts)
}

fn comparison_found(atoms: Option<&AtomsResults>, c: &ComparisonResults, named: GivenLoads) -> Option<Markup> {
    let (few, enough): (Vec<_>, Vec<_>) = c.loads.iter().partition(|l| has_few_contacts(atoms, l));
    if enough.is_empty() {
        let of_load = |l: &&LoadComparison| at_load(&atoms?.states, l.p_star, |s| s.p_star).map(|s| s.contacts);
        let most = few.iter().filter_map(of_load).max()?;
        return Some(html! {
            strong { "The atoms are in contact at " (count(most)) " sites at most: too few for a comparison" }
            " with the continuum. Higher loads or a larger block have more."
        });
    }
    let matches: Vec<_> = enough.into_iter().filter_map(|l| Some((l, matched(l)?))).collect();
    let best = matches.first()?.1;
    let loads = span(matches.iter().map(|(l, _)| l.p_star), |p| named.value(p));
    let mismatch = matches.iter().filter_map(|(l, m)| Some((deviation(l, m)?, *l)));
    let (mismatch, worst) = mismatch.max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))?;
    let doubt = matched_uncertainty(c, worst);
    let (smallest, m) = matches.iter().min_by(|a, b| a.1.overlap.kappa.total_cmp(&b.1.overlap.kappa))?;
    // The load is named again only where it is another one.
    let elsewhere = (smallest.p_star != worst.p_star).then(|| format!(" (least at {})", named.label(smallest.p_star)));
    let shifted = matches.iter().map(|(_, m)| m.shifted.kappa.abs()).fold(0.0, f64::max);
    let atoms = span(matches.iter().map(|(l, _)| l.atoms.contact_area), percent);
    let continuum = span(matches.iter().map(|(_, m)| m.contact_area), percent);
    let within = match doubt {
        Some(d) if mismatch.abs() <= d => "within the uncertainty",
        Some(_) => "more than the uncertainty",
        None => "not compared with the uncertainty",
    };
    let doubt = doubt.map_or("not known".into(), |d| format!("± {} of it", percent(d)));
    Some(html! {
        strong { "Atoms and continuum differ most at " (named.label(worst.p_star)) ", where the atoms have " (more_or_less(mismatch)) " " (term(Term::Contact))
            "; the maps agree with " (term(Term::Kappa)) " ≥ " (significant(m.overlap.kappa, 2)) (elsewhere.unwrap_or_default()) }
        " (misaligned maps: |κ| ≤ " (significant(shifted, 2)) "). The difference is " (within) " of the continuum’s area there (" (doubt)
        "); that of the atoms is not known. At " (of_load(named)) (loads) ", " (atoms) " of the surface atoms and " (continuum)
        " of the continuum (" (best.label()) ") are in contact" (left_out(&few, named)) "."
    })
}

pub(super) fn continuum_found(results: &Results, c: &ContinuumResults) -> Option<String> {
    let first = c.states.first()?;
    let missed = c.states.iter().filter(|s| s.stop != Stop::Converged).count();
    let stops = if missed == 0 { "all loads converged".into() } else { format!("{missed} loads did not converge") };
    let scale = if results.atoms.is_some() { "At the laboratory scale " } else { "" };
    let values_of = |pick: fn(&State) -> f64| c.states.iter().filter(|s| s.stop != Stop::Detached).map(pick);
    let path = if c.states.len() == 1 {
        // The error is left out if no component is known.
        let error = |q| total(first, q).map_or(String::new(), |r| format!(" (± {} of it)", percent(r)));
        let [of_area, of_gap] = [Quantity::ContactArea, Quantity::MeanGap].map(error);
        let (contact, at) = (percent(first.contact_area), results.loads.label(first.p_star));
        format!(
            "the contact fraction is {contact}{of_area} at {at}, the mean gap {}{of_gap}",
            first.mean_gap.map_or("–".into(), |g| length(g, 3))
        )
    } else {
        let named = results.loads;
        let loads = span(values_of(|s| s.p_star), |p| named.value(p));
        let contact = span(values_of(|s| s.contact_area), percent);
        let both = turned(c).map_or(String::new(), |(loading, unloading)| {
            let [up, down] = [loading, unloading].map(|s| percent(s.contact_area));
            format!("; at {} it is {up} on loading and {down} on unloading", named.label(unloading.p_star))
        });
        let [of_area, of_gap] = [Quantity::ContactArea, Quantity::MeanGap].map(|q| largest(c, q));
        let gaps = span(values_of(|s| -s.mean_gap.unwrap_or(f64::NAN)), |g| length(-g, 3));
        if let Some(ends) = unstable(c, named).filter(|_| named.imposed.is_some_and(Imposed::is_gap)) {
            return Some(capitalised(&format!("{scale}{ends} ({}, {}; {stops}).", c.method, first.criterion)));
        }
        format!(
            "at {}{loads} the mean gap is {gaps}{of_gap} and the contact {contact}{of_area}{both}",
            named.quantity.symbol()
        )
    };
    let sentence = format!("{scale}{path} ({}, {}; {stops}).", c.method, first.criterion);
    Some(capitalised(&sentence))
}

/// States between the largest and the smallest mean gap, if the pressure does not rise as the gap falls: those of imposed gaps, of which some
/// are unstable under a pressure.
fn unstable(c: &ContinuumResults, named: GivenLoads) -> Option<String> {
    // Gaps that rise are those of an unloading branch, which then is all of the path.
    let loading = c.states.iter().filter(|s| s.branch == Branch::Loading).count();
    let is_shown = |s: &&State| s.stop != Stop::Detached && (loading < 2 || s.branch == Branch::Loading);
    let shown = c.states.iter().filter(is_shown);
    let mut states: Vec<(&State, f64)> = shown.filter_map(|s| Some((s, s.mean_gap?))).collect();
    states.sort_by(|a, b| b.1.total_cmp(&a.1));
    let falls = states.windows(2).any(|pair| pair[1].0.p_star < pair[0].0.p_star);
    let [(open, widest), .., (closed, least)] = states[..] else { return None };
    let lowest = states.iter().map(|s| s.0.p_star).fold(f64::INFINITY, f64::min);
    let [at_widest, at_least, at_lowest] = [open.p_star, closed.p_star, lowest].map(|p| named.label(p));
    let [from, to] = [open, closed].map(|s| percent(s.contact_area));
    falls.then(|| {
        format!(
            "from a mean gap of {} at {at_widest} to {} at {at_least} the contact changes from {from} to {to}; the lowest load is {at_lowest}",
            length(widest, 3),
            length(least, 3)
        )
    })
}

/// ` (± 3.2 % of it or less)`: the largest relative uncertainty over the loads, and whether it is known at all of them.
fn largest(c: &ContinuumResults, quantity: Quantity) -> String {
    let all = c.states.iter().filter(|s| s.stop != Stop::Detached).map(|s| total(s, quantity));
    let unknown = if all.clone().any(|r| r.is_none()) { "; not known at some loads" } else { "" };
    all.flatten().reduce(f64::max).map_or(String::new(), |r| format!(" (± {} of it or less{unknown})", percent(r)))
}

/// The last unloading state with a loading state at the same load: (loading, unloading).
fn turned(c: &ContinuumResults) -> Option<(&State, &State)> {
    let pair = |i: usize| {
        let unloading = &c.states[i];
        let mut loading = c.states[..i].iter().filter(|s| s.branch == Branch::Loading);
        let same = |s: &&State| (s.p_star - unloading.p_star).abs() <= SAME_LOAD * unloading.p_star.abs();
        (unloading.branch == Branch::Unloading && unloading.stop == Stop::Converged).then_some(())?;
        let loading = loading.rfind(same)?;
        // Without hysteresis both branches have the same area.
        let alike = percent(loading.contact_area) == percent(unloading.contact_area);
        (!alike).then_some((loading, unloading))
    };
    (0..c.states.len()).rev().find_map(pair)
}
