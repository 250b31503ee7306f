//! First screen: the answer in one sentence, the maps, the area–load curve, four numbers, warnings.

use crate::load::Branch;
use maud::{Markup, html};

use super::compare::{SAME_LOAD, at_load, deviation, matched};
use super::definitions::{Term, term};
use super::figures::FigureWriter;
use super::uncertainty::parts;
use super::{challenge, curves, explorer};
use crate::error::Result;
use crate::record::advice::AccuracyChoice;
use crate::record::quantity::Quantity;
use crate::record::results::{ComparisonResults, ContinuumResults, LoadComparison, Results, StateResults};
use crate::report::number::{count, duration, error_of, percent, si, significant, trimmed};

/// One of the four numbers. `exact`: the number of `results.json` that is shown, if it is one.
struct Tile {
    name: Markup,
    value: String,
    exact: Option<f64>,
    error: String,
    note: String,
}

pub(super) fn section(writer: &FigureWriter, results: &Results) -> Result<Markup> {
    let maps = explorer::section(writer, results)?;
    let curve = curves::first_screen(writer, results)?;
    let many = |n: usize| format!("{n} warning{}", if n == 1 { "" } else { "s" });
    Ok(html! {
        @if !results.acceptance.is_empty() { p.found { (challenge::conclusion(results)) } }
        @if let Some(answer) = answer(results) { p.found { (answer) } }
        @if let Some(c) = &results.accuracy { p { (chosen(c)) } }
        div.stage {
            @if let Some(maps) = maps { div.explorer id="explorer" { (maps) } }
            div.beside {
                @if let Some(curve) = curve { (curve) }
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
        @if !results.warnings.is_empty() {
            details.warnings open {
                summary { (many(results.warnings.len())) }
                ul { @for w in &results.warnings { li { (w) } } }
            }
        }
    })
}

/// The setting chosen for the accuracy that the scene requests.
fn chosen(c: &AccuracyChoice) -> String {
    let a = &c.advice;
    let requested = match (c.error, c.budget_s) {
        (Some(error), _) => format!("within {}", percent(error)),
        (None, s) => format!("within a time of {}", duration(s.unwrap_or(0.0))),
    };
    let beyond = if a.extrapolated.is_empty() {
        String::new()
    } else {
        format!(" Extrapolated: {}.", a.extrapolated.join("; "))
    };
    format!(
        "Requested: the {0} {requested}. Chosen from measured tables ({1}): {2} on an {3} × {3} grid, {4} to {5:e}; expected error {6}.{beyond} \
         Quantities that this does not need were neither computed nor stored.",
        c.quantity.name(),
        c.tables,
        a.method,
        a.grid,
        a.precision,
        a.tolerance,
        error_of(c.quantity, a.expected_error)
    )
}

/// The main result in one sentence with its uncertainty.
fn answer(results: &Results) -> Option<Markup> {
    match &results.comparison {
        Some(c) => comparison_found(c),
        None => results.continuum.as_ref().and_then(|c| continuum_found(results, c)).map(|s| html! { (s) }),
    }
}

/// `lowest to highest` of formatted values, or a single value if both are formatted alike.
fn span(values: impl Iterator<Item = f64>, show: impl Fn(f64) -> String) -> String {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    let (low, high) = (show(low), show(high));
    if low == high { low } else { format!("{low} to {high}") }
}

/// Relative uncertainty of a quantity at a load: the sum of the known components; `None` if none is known.
fn relative(s: &StateResults, quantity: Quantity) -> Option<f64> {
    let known = parts(s, quantity);
    (!known.is_empty()).then(|| known.iter().map(|p| p.1).sum())
}

/// Relative uncertainty of the matched continuum's contact area at a load.
fn matched_uncertainty(c: &ComparisonResults, load: &LoadComparison) -> Option<f64> {
    let state = at_load(&c.compliant_wall.states, load.p_star, |s: &StateResults| s.numbers.p_star)?;
    relative(state, Quantity::ContactArea)
}

fn comparison_found(c: &ComparisonResults) -> Option<Markup> {
    let matches: Vec<_> = c.loads.iter().filter_map(|l| Some((l, matched(l)?))).collect();
    let best = matches.first()?.1;
    let loads = span(c.loads.iter().map(|l| l.p_star), |p| trimmed(p, 4));
    let off = matches.iter().filter_map(|(l, m)| Some((deviation(l, m)?, matched_uncertainty(c, l))));
    let (off, doubt) = off.max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))?;
    let lowest = matches.iter().map(|(_, m)| m.overlap.kappa).fold(f64::INFINITY, f64::min);
    let shifted = matches.iter().map(|(_, m)| m.shifted.kappa.abs()).fold(0.0, f64::max);
    let atoms = span(c.loads.iter().map(|l| l.atoms.contact_fraction), percent);
    let continuum = span(matches.iter().map(|(_, m)| m.contact_fraction), percent);
    let within = match doubt {
        Some(d) if off.abs() <= d => "within the uncertainty",
        Some(_) => "more than the uncertainty",
        None => "not compared with the uncertainty",
    };
    let doubt = doubt.map_or("not known".into(), |d| format!("± {}", percent(d)));
    Some(html! {
        strong { "The contact areas of atoms and continuum differ by at most " (percent(off.abs())) ", and the maps agree with " (term(Term::Kappa)) " ≥ "
            (significant(lowest, 2)) }
        " (misaligned maps: |κ| ≤ " (significant(shifted, 2)) "). The difference is " (within) " of the continuum there (" (doubt) "). At "
        (term(Term::Load)) " = " (loads) ", " (atoms) " of the surface atoms are in " (term(Term::Contact)) " and " (continuum) " of the continuum ("
        (best.label()) ")."
    })
}

pub(super) fn continuum_found(results: &Results, c: &ContinuumResults) -> Option<String> {
    let first = c.states.first()?;
    let gap = |gap: f64| si(gap * results.scales.length_m, "m", 3);
    let missed = c.states.iter().filter(|s| s.numbers.stop != "converged").count();
    let stops = if missed == 0 { "all loads converged".into() } else { format!("{missed} loads did not converge") };
    let scale = if results.atoms.is_some() { "At the laboratory scale " } else { "" };
    let of = |pick: fn(&StateResults) -> f64| c.states.iter().filter(|s| s.numbers.stop != "detached").map(pick);
    let path = if c.states.len() == 1 {
        format!(
            "the contact fraction is {}{} at p* = {}, the mean gap {}{}",
            percent(first.contact_fraction_corrected),
            plus_minus(first, Quantity::ContactArea),
            trimmed(first.numbers.p_star, 4),
            gap(first.mean_gap),
            plus_minus(first, Quantity::MeanGap)
        )
    } else {
        let loads = span(of(|s| s.numbers.p_star), |p| trimmed(p, 4));
        let contact = span(of(|s| s.contact_fraction_corrected), percent);
        let both = turned(c).map_or(String::new(), |(loading, back)| {
            format!(
                "; at p* = {} it is {} on loading and {} on unloading",
                trimmed(back.numbers.p_star, 4),
                percent(loading.contact_fraction_corrected),
                percent(back.contact_fraction_corrected)
            )
        });
        format!(
            "at p* = {loads} the mean gap is {}{} and the contact {contact}{}{both}",
            span(of(|s| -s.mean_gap), |g| gap(-g)),
            largest(c, Quantity::MeanGap),
            largest(c, Quantity::ContactArea)
        )
    };
    let sentence = format!("{scale}{path} ({}, {}, perimeter-corrected; {stops}).", c.method, first.criterion);
    Some(super::figures::capitalised(&sentence))
}

/// ` (± 3.2 % of it)`; empty if no component is known.
fn plus_minus(s: &StateResults, quantity: Quantity) -> String {
    relative(s, quantity).map_or(String::new(), |r| format!(" (± {} of it)", percent(r)))
}

/// ` (± 3.2 % of it or less)`: the largest relative uncertainty over the loads.
fn largest(c: &ContinuumResults, quantity: Quantity) -> String {
    let known = c.states.iter().filter(|s| s.numbers.stop != "detached").filter_map(|s| relative(s, quantity));
    known.reduce(f64::max).map_or(String::new(), |r| format!(" (± {} of it or less)", percent(r)))
}

/// The last unloading state with a loading state at the same load: (loading, unloading).
fn turned(c: &ContinuumResults) -> Option<(&StateResults, &StateResults)> {
    let pair = |i: usize| {
        let back = &c.states[i];
        let mut loading = c.states[..i].iter().filter(|s| s.branch == Branch::Loading);
        let same =
            |s: &&StateResults| (s.numbers.p_star - back.numbers.p_star).abs() <= SAME_LOAD * back.numbers.p_star.abs();
        (back.branch == Branch::Unloading && back.numbers.stop == "converged").then_some(())?;
        let loading = loading.rfind(same)?;
        // Without hysteresis both branches have the same area.
        let alike = percent(loading.contact_fraction_corrected) == percent(back.contact_fraction_corrected);
        (!alike).then_some((loading, back))
    };
    (0..c.states.len()).rev().find_map(pair)
}

/// ` ± 0.2 %`: an absolute error of a value with a relative one.
fn error(value: f64, relative: Option<f64>, show: impl Fn(f64) -> String) -> String {
    relative.map_or(" ± not known".into(), |r| format!(" ± {}", show((r * value).abs())))
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
        // The continuum at laboratory scale keeps contact and gap.
        tiles.truncate(2);
        tiles.extend(comparison_tiles(c));
    } else if let Some((atoms, state)) = results.atoms.as_ref().and_then(|a| Some((a, a.states.last()?))) {
        tiles.truncate(3);
        tiles.push(Tile {
            name: html! { "atoms in contact at p* = " (trimmed(state.p_star, 4)) },
            value: percent(state.contact_fraction),
            exact: Some(state.contact_fraction),
            error: String::new(),
            note: format!("of the surface layer of {} moving atoms", count(atoms.deformable)),
        });
    }
    tiles
}

/// Two digits of an error in per cent.
fn two_digits(share: f64) -> String {
    format!("{}\u{a0}%", significant(100.0 * share, 2))
}

fn continuum_tiles(results: &Results, c: &ContinuumResults, s: &StateResults) -> Vec<Tile> {
    let (metres, pascal) = (results.scales.length_m, results.scales.modulus_pa);
    let at = format!("p* = {}", trimmed(s.numbers.p_star, 4));
    let scale = if results.comparison.is_some() { ", laboratory scale" } else { "" };
    let area = relative(s, Quantity::ContactArea);
    let mut tiles = vec![
        Tile {
            name: html! { (term(Term::Contact)) " at " (at) (scale) },
            // One unit for value and error: `8.10 ± 0.18 %` is no relative error.
            value: match area {
                Some(_) => significant(100.0 * s.contact_fraction_corrected, 3),
                None => percent(s.contact_fraction_corrected),
            },
            exact: Some(s.contact_fraction_corrected),
            error: error(s.contact_fraction_corrected, area, two_digits),
            note: format!("of the cell, perimeter-corrected; {}", c.method),
        },
        Tile {
            name: html! { "mean " (term(Term::Gap)) " at " (at) (scale) },
            value: si(s.mean_gap * metres, "m", 3),
            exact: Some(s.mean_gap),
            error: error(s.mean_gap * metres, relative(s, Quantity::MeanGap), |e| si(e, "m", 2)),
            note: format!("under {}", si(s.numbers.pressure * pascal, "Pa", 3)),
        },
    ];
    if let Some(p) = &c.pull_off {
        tiles.push(Tile {
            name: html! { "pull-off stress" },
            value: si(-p.pressure * pascal, "Pa", 3),
            exact: Some(p.pressure),
            error: format!(" ± {}", si(p.pressure_error * pascal, "Pa", 2)),
            note: format!("at a mean gap of {}", si(p.mean_gap * metres, "m", 3)),
        });
    }
    if let Some(p) = s.observed.as_ref().and_then(|o| o.mean_contact_pressure) {
        tiles.push(Tile {
            name: html! { "mean contact pressure at " (at) },
            value: si(p * pascal, "Pa", 3),
            exact: Some(p),
            error: error(p * pascal, area, |e| si(e, "Pa", 2)),
            note: "over the contact; its uncertainty is that of the area".into(),
        });
    }
    if let Some(k) = s.numbers.stiffness {
        let unit = pascal / metres;
        tiles.push(Tile {
            name: html! { "contact stiffness at " (at) },
            value: si(k * unit, "Pa/m", 3),
            exact: Some(k),
            error: s
                .numbers
                .stiffness_error
                .map_or(" ± not known".into(), |e| format!(" ± {}", si(e * unit, "Pa/m", 2))),
            note: "derivative of the mean pressure by the mean gap".into(),
        });
    }
    tiles.truncate(4);
    tiles
}

/// Deviation of the areas and agreement of the maps at the highest load.
fn comparison_tiles(c: &ComparisonResults) -> Vec<Tile> {
    let Some((load, m)) = c.loads.last().and_then(|l| Some((l, matched(l)?))) else { return Vec::new() };
    let at = format!("p* = {}", trimmed(load.p_star, 4));
    let ratio = deviation(load, m).map(|off| Tile {
        name: html! { "contact of the atoms over the continuum’s at " (at) },
        value: significant(1.0 + off, 4),
        exact: None,
        error: error(1.0 + off, matched_uncertainty(c, load), |e| significant(e, 2)),
        note: format!(
            "{} of the atoms, {} of the continuum",
            percent(load.atoms.contact_fraction),
            percent(m.contact_fraction)
        ),
    });
    let kappa = Tile {
        name: html! { "agreement of the maps, " (term(Term::Kappa)) ", at " (at) },
        value: significant(m.overlap.kappa, 2),
        exact: Some(m.overlap.kappa),
        error: String::new(),
        note: format!(
            "1: identical maps; misaligned by a third and a fifth of the cell: {}",
            significant(m.shifted.kappa, 2)
        ),
    };
    ratio.into_iter().chain([kappa]).collect()
}
