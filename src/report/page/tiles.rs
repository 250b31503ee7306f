//! The four numbers of the first screen, with their errors.

use crate::load::Branch;
use maud::{Markup, html};

use super::compare::{deviation, matched, matched_uncertainty, more_or_less, uncertainty_at, yielding};
use super::definitions::{Term, term};
use super::uncertainty::total;
use crate::record::quantity::Quantity;
use crate::record::results::{
    ComparisonResults, ContinuumResults, CriterionMatch, LoadComparison, Results, StateResults,
};
use crate::report::number::{count, percent, si, significant, stiffness, trimmed, with_error};

/// One of the four numbers. `exact`: the number of `results.json` that is shown, if it is one.
struct Tile {
    name: Markup,
    value: String,
    exact: Option<f64>,
    error: String,
    note: String,
}

pub(super) fn section(results: &Results) -> Markup {
    html! {
        div.tiles {
            @for t in tiles(results) {
                div.tile {
                    div.name { (t.name) }
                    div.value {
                        @match t.exact { Some(v) => { data value=(v) { (t.value) } }, None => { (t.value) } }
                        span.error { (t.error) }
                    }
                    div.note { (t.note) }
                }
            }
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
    match relative {
        Some(r) => with_error(value, r * value, unit),
        None => (plain(value), " ± not known".into()),
    }
}

fn tiles(results: &Results) -> Vec<Tile> {
    let mut tiles = Vec::new();
    if let Some(c) = &results.continuum {
        let pressed = c.states.iter().filter(|s| s.numbers.stop != "detached" && s.branch == Branch::Loading);
        if let Some(s) = pressed.max_by(|a, b| a.numbers.p_star.total_cmp(&b.numbers.p_star)) {
            tiles.extend(continuum_tiles(results, c, s));
        }
    }
    if let Some(c) = &results.comparison {
        let hardness = c.loads.last().and_then(|l| Some(hardness_tiles(c, l, matched(l)?, yielding(l)?)));
        match hardness {
            Some(four) => tiles = four,
            None => {
                // The continuum at laboratory scale keeps contact and gap.
                tiles.truncate(2);
                tiles.extend(comparison_tiles(c));
            }
        }
    } else if let Some((atoms, state)) = results.atoms.as_ref().and_then(|a| Some((a, a.states.last()?))) {
        tiles.truncate(3);
        tiles.push(Tile {
            name: html! { "atoms in contact at p* = " (trimmed(state.p_star, 4)) },
            value: percent(state.contact_area),
            exact: Some(state.contact_area),
            error: String::new(),
            note: format!("of the surface layer of {} moving atoms", count(atoms.deformable)),
        });
    }
    tiles
}

fn continuum_tiles(results: &Results, c: &ContinuumResults, s: &StateResults) -> Vec<Tile> {
    let (metres, pascal) = (results.scales.length_m, results.scales.modulus_pa);
    let at = format!("p* = {}", trimmed(s.numbers.p_star, 4));
    let scale = if results.comparison.is_some() { ", laboratory scale" } else { "" };
    let area = total(s, Quantity::ContactArea);
    let contact = share(s.numbers.contact_area, area, "of the cell");
    // Why this contact is not that of the comparison.
    let resolved = results.comparison.as_ref().and_then(|m| c.resolved_gradient.zip(m.hard_wall.resolved_gradient));
    let resolved = resolved.map_or(String::new(), |(here, atoms)| {
        format!("; rms gradient {}, in the comparison {}", significant(here, 2), significant(atoms, 2))
    });
    let gap = shown(s.mean_gap * metres, total(s, Quantity::MeanGap), "m", |v| si(v, "m", 3));
    let mut tiles = vec![
        Tile {
            name: html! { (term(Term::Contact)) " at " (at) (scale) },
            value: contact.0,
            exact: Some(s.numbers.contact_area),
            error: contact.1,
            note: format!("{}{resolved}", c.method),
        },
        Tile {
            name: html! { "mean " (term(Term::Gap)) " at " (at) (scale) },
            value: gap.0,
            exact: Some(s.mean_gap),
            error: gap.1,
            note: format!("under {}", si(s.numbers.pressure * pascal, "Pa", 3)),
        },
    ];
    if let (Some(hardness), Some(p)) = (c.hardness, s.plasticity) {
        tiles.push(Tile {
            name: html! { "plastic flow at " (at) },
            value: percent(p.flowing),
            exact: Some(p.flowing),
            error: String::new(),
            note: format!("of the cell is at the hardness of {}", si(hardness * pascal, "Pa", 3)),
        });
    }
    if let Some(p) = &c.pull_off {
        let (value, error) = match p.pressure_error {
            Some(e) => with_error(-p.pressure * pascal, e * pascal, "Pa"),
            None => (si(-p.pressure * pascal, "Pa", 3), " ± not known".into()),
        };
        tiles.push(Tile {
            name: html! { "pull-off stress" },
            value,
            exact: Some(p.pressure),
            error,
            note: format!("at a mean gap of {}", si(p.mean_gap * metres, "m", 3)),
        });
    }
    if let Some(p) = s.observed.as_ref().and_then(|o| o.mean_contact_pressure) {
        let (value, error) = shown(p * pascal, area, "Pa", |v| si(v, "Pa", 3));
        tiles.push(Tile {
            name: html! { "mean contact pressure at " (at) },
            value,
            exact: Some(p),
            error,
            note: "over the contact; its uncertainty is that of the area".into(),
        });
    }
    if let Some(k) = s.numbers.stiffness {
        let unit = pascal / metres;
        tiles.push(Tile {
            name: html! { "contact stiffness at " (at) },
            value: stiffness(k * unit, metres, 3),
            exact: Some(k),
            error: s
                .numbers
                .stiffness_error
                .map_or(" ± not known".into(), |e| format!(" ± {}", stiffness(e * unit, metres, 2))),
            note: "derivative of the mean pressure by the approach".into(),
        });
    }
    tiles.truncate(4);
    tiles
}

/// Agreement of the maps at a load.
fn kappa(at: &str, m: &CriterionMatch, note: String) -> Tile {
    Tile {
        name: html! { "agreement of the maps, " (term(Term::Kappa)) ", at " (at) },
        value: significant(m.overlap.kappa, 2),
        exact: Some(m.overlap.kappa),
        error: String::new(),
        note,
    }
}

/// Deviation of the areas and agreement of the maps at the highest load.
fn comparison_tiles(c: &ComparisonResults) -> Vec<Tile> {
    let Some((load, m)) = c.loads.last().and_then(|l| Some((l, matched(l)?))) else { return Vec::new() };
    let at = format!("p* = {}", trimmed(load.p_star, 4));
    let ratio = deviation(load, m).map(|off| {
        let (value, error) = shown(1.0 + off, matched_uncertainty(c, load), "", |v| significant(v, 4));
        Tile {
            name: html! { "contact of the atoms over the continuum’s at " (at) },
            value,
            exact: None,
            error,
            note: format!(
                "{} of the atoms, {} of the continuum; ± is the continuum’s",
                percent(load.atoms.contact_area),
                percent(m.contact_area)
            ),
        }
    });
    let misaligned = significant(m.shifted.kappa, 2);
    let note = format!("1: identical maps; misaligned by a third and a fifth of the cell: {misaligned} at this load");
    ratio.into_iter().chain([kappa(&at, m, note)]).collect()
}

/// Contact of the elastic continuum, of the continuum with hardness and of the atoms at the highest load, and the agreement
/// of the maps.
fn hardness_tiles(
    c: &ComparisonResults,
    load: &LoadComparison,
    elastic: &CriterionMatch,
    hard: &CriterionMatch,
) -> Vec<Tile> {
    let at = format!("p* = {}", trimmed(load.p_star, 4));
    let contact = |name: &str, fraction: f64, relative: Option<f64>, note: String| {
        let (value, error) = match relative {
            Some(_) => share(fraction, relative, "of the sites"),
            None => (percent(fraction), String::new()),
        };
        Tile {
            name: html! { (term(Term::Contact)) " at " (at) ", " (name) },
            value,
            exact: Some(fraction),
            error,
            note,
        }
    };
    let of_atoms = |m: &CriterionMatch| {
        deviation(load, m).map_or(String::new(), |d| format!("the atoms have {}", more_or_less(d)))
    };
    vec![
        contact("elastic continuum", elastic.contact_area, matched_uncertainty(c, load), of_atoms(elastic)),
        contact(
            "continuum with hardness",
            hard.contact_area,
            c.yielding_wall.as_ref().and_then(|y| uncertainty_at(y, load)),
            of_atoms(hard),
        ),
        contact("atoms", load.atoms.contact_area, None, load.atoms.criterion.clone()),
        kappa(
            &at,
            hard,
            format!(
                "with hardness; elastic {}, misaligned map {}",
                significant(elastic.overlap.kappa, 2),
                significant(hard.shifted.kappa, 2)
            ),
        ),
    ]
}
