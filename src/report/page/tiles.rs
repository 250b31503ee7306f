//! The four numbers of the first screen, with their errors.

use super::compare::{deviation, matched, matched_uncertainty, more_or_less, uncertainty_at, yielding};
use super::definitions::{Term, term};
use super::prelude::*;
use super::uncertainty::total;
use crate::record::given_loads::Imposed;
use crate::report::number::{stiffness, stiffness_with_error};

const UNKNOWN: &str = " ± not known";

pub(super) fn section(results: &Results) -> Markup {
    html! { div.tiles { (each(&tiles(results))) } }
}

/// One of the four numbers: value and error, the number of `results.json` that is shown, if it is one, and a note.
fn tile(name: impl Render, value: (String, String), exact: Option<f64>, note: impl Render) -> Markup {
    html! {
        div.tile {
            div.name { (name) }
            div.value {
                @match exact { Some(v) => { data value=(v) { (value.0) } }, None => { (value.0) } }
                span.error { (value.1) }
            }
            div.note { (note) }
        }
    }
}

/// A fraction in per cent with its relative error, both of the same `whole`.
fn share(value: f64, relative: Option<f64>, whole: &str) -> (String, String) {
    let (value, error) = shown(100.0 * value, relative, "%", |v| percent(v / 100.0));
    (value, if relative.is_some() { format!("{error} {whole}") } else { error })
}

/// A value with its relative error, both in `unit`; without an error the value as `plain` shows it.
fn shown(value: f64, relative: Option<f64>, unit: &str, plain: impl Fn(f64) -> String) -> (String, String) {
    relative.map_or_else(|| (plain(value), UNKNOWN.into()), |r| with_error(value, r * value, unit))
}

/// A value that is stated without error.
fn bare(value: String) -> (String, String) {
    (value, String::new())
}

fn tiles(results: &Results) -> Vec<Markup> {
    let mut tiles = Vec::new();
    if let Some(c) = &results.continuum {
        let pressed = c.states.iter().filter(|s| s.stop != Stop::Detached && s.branch == Branch::Loading);
        if let Some(s) = pressed.max_by(|a, b| a.p_star.total_cmp(&b.p_star)) {
            tiles.extend(continuum_tiles(results, c, s));
        }
    }
    if let Some(c) = &results.comparison {
        match c.loads.last().and_then(|l| Some(hardness_tiles((c, results.loads), l, matched(l)?, yielding(l)?))) {
            Some(four) => return four,
            None => {
                // The continuum at laboratory scale keeps contact and gap.
                tiles.truncate(2);
                tiles.extend(comparison_tiles(c, results.loads));
            }
        }
    } else if let Some((atoms, state)) = results.atoms.as_ref().and_then(|a| Some((a, a.states.last()?))) {
        tiles.truncate(3);
        let name = format!("atoms in contact at {}", results.loads.label(state.p_star));
        let note = format!("of the surface layer of {} moving atoms", count(atoms.moving()));
        tiles.push(tile(name, bare(percent(state.contact_area)), Some(state.contact_area), note));
    }
    tiles
}

fn continuum_tiles(results: &Results, c: &ContinuumResults, s: &State) -> Vec<Markup> {
    let load_label = results.loads.label(s.p_star);
    let scale = if results.comparison.is_some() { ", laboratory scale" } else { "" };
    let area = total(s, Quantity::ContactArea);
    // Why this contact is not that of the comparison.
    let resolved = results.comparison.as_ref().and_then(|m| c.resolved_gradient.zip(m.hard_wall.resolved_gradient));
    let resolved = resolved.map_or(String::new(), |(here, atoms)| {
        format!("; rms gradient {}, in the comparison {}", significant(here, 2), significant(atoms, 2))
    });
    let gap = match s.mean_gap {
        // It was given.
        Some(gap) if results.loads.imposed.is_some_and(Imposed::is_gap) => bare(si(gap, "m", 3)),
        gap => shown(gap.unwrap_or(f64::NAN), total(s, Quantity::MeanGap), "m", |v| si(v, "m", 3)),
    };
    let mut tiles = vec![
        tile(
            html! { (term(Term::Contact)) " at " (load_label) (scale) },
            share(s.contact_area, area, "of the cell"),
            Some(s.contact_area),
            format!("{}{resolved}", c.method),
        ),
        tile(
            html! { "mean " (term(Term::Gap)) " at " (load_label) (scale) },
            gap,
            s.mean_gap,
            format!("under {}", stress(s.pressure, 3)),
        ),
    ];
    if let (Some(hardness), Some(p)) = (c.hardness, s.plasticity) {
        let note = format!("of the cell is at the hardness of {}", stress(hardness, 3));
        tiles.push(tile(format!("plastic flow at {load_label}"), bare(percent(p.flowing)), Some(p.flowing), note));
    }
    if let Some(p) = &c.pull_off {
        let value = match p.pressure_error {
            Some(e) => with_error(-p.pressure, e, "Pa"),
            None => (stress(-p.pressure, 3), UNKNOWN.into()),
        };
        let note = format!("at a mean gap of {}", length(p.mean_gap, 3));
        tiles.push(tile("pull-off stress", value, Some(p.pressure), note));
    }
    if let Some(p) = s.observed.as_ref().and_then(|o| o.mean_contact_pressure) {
        let value = shown(p, area, "Pa", |v| si(v, "Pa", 3));
        let note = "over the contact; its uncertainty is that of the area";
        tiles.push(tile(format!("mean contact pressure at {load_label}"), value, Some(p), note));
    }
    if let Some(k) = s.stiffness {
        let value = match s.stiffness_error {
            Some(error) => stiffness_with_error(k, error, results.scales.length_m),
            None => (stiffness(k, results.scales.length_m, 3), UNKNOWN.into()),
        };
        let note = "derivative of the mean pressure by the approach";
        tiles.push(tile(format!("contact stiffness at {load_label}"), value, Some(k), note));
    }
    tiles.truncate(4);
    tiles
}

/// Agreement of the maps at a load.
fn kappa((load, loads): (&LoadComparison, GivenLoads), m: &CriterionMatch, note: String) -> Markup {
    let name = html! { "agreement of the maps, " (term(Term::Kappa)) ", at " (loads.label(load.p_star)) };
    tile(name, bare(significant(m.overlap.kappa, 2)), Some(m.overlap.kappa), note)
}

/// Deviation of the areas and agreement of the maps at the highest load.
fn comparison_tiles(c: &ComparisonResults, loads: GivenLoads) -> Vec<Markup> {
    let Some((load, m)) = c.loads.last().and_then(|l| Some((l, matched(l)?))) else { return Vec::new() };
    let ratio = deviation(load, m).map(|mismatch| {
        let name = format!("contact of the atoms over the continuum’s at {}", loads.label(load.p_star));
        let value = shown(1.0 + mismatch, matched_uncertainty(c, load), "", |v| significant(v, 4));
        let [atoms, continuum] = [load.atoms.contact_area, m.contact_area].map(percent);
        tile(name, value, None, format!("{atoms} of the atoms, {continuum} of the continuum; ± is the continuum’s"))
    });
    let misaligned = significant(m.shifted.kappa, 2);
    let note = format!("1: identical maps; misaligned by a third and a fifth of the cell: {misaligned} at this load");
    ratio.into_iter().chain([kappa((load, loads), m, note)]).collect()
}

/// Contact of the elastic continuum, of the continuum with hardness and of the atoms at the highest load, and the agreement
/// of the maps.
fn hardness_tiles(
    (c, loads): (&ComparisonResults, GivenLoads),
    load: &LoadComparison,
    elastic: &CriterionMatch,
    hard: &CriterionMatch,
) -> Vec<Markup> {
    let contact = |name: &str, fraction: f64, relative: Option<f64>, note: String| {
        let value = relative.map_or_else(|| bare(percent(fraction)), |r| share(fraction, Some(r), "of the sites"));
        let name = html! { (term(Term::Contact)) " at " (loads.label(load.p_star)) ", " (name) };
        tile(name, value, Some(fraction), note)
    };
    let of_atoms = |m: &CriterionMatch| {
        deviation(load, m).map_or(String::new(), |d| format!("the atoms have {}", more_or_less(d)))
    };
    let of_hard = c.yielding_wall.as_ref().and_then(|y| uncertainty_at(y, load));
    let [of_elastic, misaligned] = [elastic.overlap.kappa, hard.shifted.kappa].map(|k| significant(k, 2));
    vec![
        contact("elastic continuum", elastic.contact_area, matched_uncertainty(c, load), of_atoms(elastic)),
        contact("continuum with hardness", hard.contact_area, of_hard, of_atoms(hard)),
        contact("atoms", load.atoms.contact_area, None, load.atoms.criterion.clone()),
        kappa((load, loads), hard, format!("with hardness; elastic {of_elastic}, misaligned map {misaligned}")),
    ]
}
