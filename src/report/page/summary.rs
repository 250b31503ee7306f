//! Summary at the top of the page: key numbers, warnings, definitions.

use crate::load::Branch;
use maud::{Markup, html};

use super::compare::{SAME_LOAD, deviation, matched};
use super::uncertainty::parts;
use crate::record::advice::AccuracyChoice;
use crate::record::quantity::Quantity;
use crate::record::results::{ComparisonResults, ContinuumResults, Results, StateResults};
use crate::record::uncertainty::UncertaintySource;
use crate::report::number::{change, count, duration, error_of, memory, percent, si, si_given, significant, trimmed};

struct Tile {
    name: String,
    value: String,
    note: String,
}

pub(super) fn section(results: &Results) -> Markup {
    html! {
        @for sentence in found(results) { p.found { (sentence) } }
        @if let Some(c) = &results.accuracy { p { (chosen(c)) } }
        div.tiles {
            @for t in tiles(results) {
                div.tile { div.name { (t.name) } div.value { (t.value) } div.note { (t.note) } }
            }
        }
        @if !results.warnings.is_empty() {
            div.warnings { h3 { "Warnings" } ul { @for w in &results.warnings { li { (w) } } } }
        }
        (words(results))
    }
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

/// Main results, one sentence per scale.
fn found(results: &Results) -> Vec<String> {
    let continuum = results.continuum.as_ref().and_then(|c| continuum_found(results, c));
    let comparison = results.comparison.as_ref().and_then(comparison_found);
    comparison.into_iter().chain(continuum).collect()
}

/// `lowest to highest` of formatted values, or a single value if both are formatted alike.
fn span(values: impl Iterator<Item = f64>, show: impl Fn(f64) -> String) -> String {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    let (low, high) = (show(low), show(high));
    if low == high { low } else { format!("{low} to {high}") }
}

fn comparison_found(c: &ComparisonResults) -> Option<String> {
    let matches: Vec<_> = c.loads.iter().filter_map(|l| Some((l, matched(l)?))).collect();
    let best = matches.first()?.1;
    let p_star = span(c.loads.iter().map(|l| l.p_star), |p| trimmed(p, 4));
    let atoms = span(c.loads.iter().map(|l| l.atoms.contact_fraction), percent);
    let continuum = span(matches.iter().map(|(_, m)| m.contact_fraction), percent);
    let off = matches.iter().filter_map(|(l, m)| deviation(l, m)).fold(0.0, |a: f64, d| a.max(d.abs()));
    let kappa = span(matches.iter().map(|(_, m)| m.overlap.kappa), |k| significant(k, 2));
    let shifted = matches.iter().map(|(_, m)| m.shifted.kappa.abs()).fold(0.0, f64::max);
    Some(format!(
        "At p* = {p_star}, {atoms} of the surface atoms are in contact; the continuum on the same profile has a contact fraction of \
         {continuum} ({}). The areas differ by at most {}; the maps agree with κ = {kappa} (|κ| ≤ {} for a misaligned map).",
        best.label(),
        percent(off),
        significant(shifted, 2),
    ))
}

fn continuum_found(results: &Results, c: &ContinuumResults) -> Option<String> {
    let first = c.states.first()?;
    let gap = |gap: f64| si(gap * results.scales.length_m, "m", 3);
    let missed = c.states.iter().filter(|s| s.numbers.stop != "converged").count();
    let stops = if missed == 0 { "all loads converged".into() } else { format!("{missed} loads did not converge") };
    let scale = if results.atoms.is_some() { "At the laboratory scale " } else { "" };
    let of = |pick: fn(&StateResults) -> f64| c.states.iter().filter(|s| s.numbers.stop != "detached").map(pick);
    let path = if c.states.len() == 1 {
        format!(
            "the contact fraction is {} at p* = {}, the mean gap {}",
            percent(first.contact_fraction_corrected),
            trimmed(first.numbers.p_star, 4),
            gap(first.mean_gap)
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
            "at p* = {loads} the mean gap is {} and the contact {contact}{both}",
            span(of(|s| -s.mean_gap), |g| gap(-g))
        )
    };
    let sentence = format!("{scale}{path} ({}, {}, perimeter-corrected; {stops}).", c.method, first.criterion);
    Some(super::figures::capitalised(&sentence))
}

/// Largest known uncertainty of a quantity over the loads, and its main source.
fn uncertain(c: &ContinuumResults, quantity: Quantity) -> Option<String> {
    let total = |parts: &[(UncertaintySource, f64)]| parts.iter().map(|p| p.1).sum::<f64>();
    let loading = c.states.iter().filter(|s| s.numbers.stop != "detached");
    let worst = loading.map(|s| parts(s, quantity)).max_by(|a, b| total(a).total_cmp(&total(b)))?;
    let (source, _) = worst.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let share = if total(&worst) > 1.0 {
        change(Some(total(&worst)), false)
    } else {
        format!("up to {}", percent(total(&worst)))
    };
    Some(format!("{share}, mostly due to the {}", source.name()))
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

fn tiles(results: &Results) -> Vec<Tile> {
    let mut tiles = Vec::new();
    let surface = &results.surface;
    tiles.push(Tile {
        name: "surface".into(),
        value: format!("{} × {}", count(surface.nx), count(surface.ny)),
        note: format!("nodes, L = {}", si_given(results.scales.length_m, "m")),
    });
    tiles.extend(results.continuum.iter().filter(|c| !c.states.is_empty()).flat_map(|c| continuum_tiles(results, c)));
    tiles.extend(atoms_tiles(results));
    if !results.stages.is_empty() {
        let peak = results.stages.iter().map(|s| s.peak_rss_bytes).max().unwrap_or(0);
        tiles.push(Tile {
            name: "cost".into(),
            value: duration(results.stages.iter().map(|s| s.seconds).sum()),
            note: format!("wall time; peak memory {}", memory(peak)),
        });
    }
    tiles
}

fn continuum_tiles(results: &Results, c: &ContinuumResults) -> Vec<Tile> {
    let of = |pick: fn(&StateResults) -> f64| c.states.iter().filter(|s| s.numbers.stop != "detached").map(pick);
    let loads = span(of(|s| s.numbers.p_star), |p| trimmed(p, 4));
    let branches = |pick: fn(&StateResults) -> f64, show: &dyn Fn(f64) -> String| {
        turned(c).map_or(String::new(), |(loading, back)| {
            let load = trimmed(back.numbers.p_star, 4);
            format!("; at p* = {load} {} on loading, {} on unloading", show(pick(loading)), show(pick(back)))
        })
    };
    let scale = if results.atoms.is_some() { ", laboratory scale" } else { "" };
    let (contact, gap) = (|s: &StateResults| s.contact_fraction_corrected, |s: &StateResults| s.mean_gap);
    let length = |g: f64| si(g * results.scales.length_m, "m", 3);
    let pressure = span(of(|s| s.numbers.pressure), |p| si(p * results.scales.modulus_pa, "Pa", 3));
    let doubt = |of| uncertain(c, of).map_or(String::new(), |u| format!("; uncertainty {u}"));
    let mut tiles = vec![
        Tile {
            name: format!("contact at p* = {loads}{scale}"),
            value: span(of(contact), percent),
            note: format!(
                "of the cell, perimeter-corrected{}{}",
                branches(contact, &percent),
                doubt(Quantity::ContactArea)
            ),
        },
        Tile {
            name: format!("mean gap at p* = {loads}{scale}"),
            value: span(of(gap), length),
            note: format!("under {pressure}{}{}", branches(gap, &length), doubt(Quantity::MeanGap)),
        },
    ];
    if let Some(p) = &c.pull_off {
        let of = |p: f64, n: usize| si(p * results.scales.modulus_pa, "Pa", n);
        let error = format!("± {}, ", of(p.pressure_error, 2));
        tiles.push(Tile {
            name: "pull-off stress".into(),
            value: of(-p.pressure, 3),
            note: format!("{error}at a mean gap of {}", length(p.mean_gap)),
        });
    }
    tiles
}

/// Contact of the atoms, and its agreement with the continuum at the highest load.
fn atoms_tiles(results: &Results) -> Vec<Tile> {
    let mut tiles = Vec::new();
    if let Some(load) = results.comparison.as_ref().and_then(|c| c.loads.last()) {
        let plain = load.continuum.first().map(|m| percent(m.contact_fraction));
        tiles.push(Tile {
            name: format!("atoms in contact at p* = {}", trimmed(load.p_star, 4)),
            value: percent(load.atoms.contact_fraction),
            note: plain.map_or(String::new(), |p| format!("hard wall, zero gap, same profile: {p}")),
        });
        if let Some(m) = matched(load) {
            tiles.push(Tile {
                name: "agreement of the maps".into(),
                value: format!("κ = {}", significant(m.overlap.kappa, 2)),
                note: format!(
                    "at p* = {}, {}; a misaligned map gives {}",
                    trimmed(load.p_star, 4),
                    m.label(),
                    significant(m.shifted.kappa, 2)
                ),
            });
        }
    } else if let Some((atoms, state)) = results.atoms.as_ref().and_then(|a| Some((a, a.states.last()?))) {
        tiles.push(Tile {
            name: format!("atoms in contact at p* = {}", trimmed(state.p_star, 4)),
            value: percent(state.contact_fraction),
            note: format!("of the surface layer of {} moving atoms", count(atoms.deformable)),
        });
    }
    tiles
}

/// Definitions of the symbols that the page uses.
fn words(results: &Results) -> Markup {
    let modulus = si_given(results.scales.modulus_pa, "Pa");
    let length = si_given(results.scales.length_m, "m");
    html! {
        h3 { "Definitions" }
        dl {
            dt { "L, E*" }
            dd { "Extent of the cell in x, here " (length) ", and contact modulus E/(1 − ν²), here " (modulus)
                ". They are the units of length and of stress of the dimensionless problem."
                @if let Some(atoms) = &results.atoms {
                    " The atoms solve the same problem on a smaller cell of " (si_given(atoms.length_angstrom * 1e-10, "m"))
                    " with E* = " (trimmed(atoms.modulus_gpa, 4)) " GPa."
                } }
            dt { "p*" }
            dd { "Reduced load: mean pressure over E* times the rms gradient of the surface. Loads are compared in it "
                "because contact area grows with p* alike for all surfaces of small slope. The gradient is always that of "
                "the whole spectrum: a grid or block that resolves less of it has more contact at the same p*." }
            dt { "Gap" }
            dd { "Distance between the two surfaces along z; zero where they touch. The mean gap is over the whole cell."
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
