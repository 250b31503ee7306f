//! What a reader should know after half a minute: the numbers in tiles, the warnings, the words.

use maud::{Markup, html};

use super::compare::matched;
use crate::record::results::Results;
use crate::report::number::{count, duration, memory, percent, si, si_given, significant, trimmed};

struct Tile {
    name: String,
    value: String,
    note: String,
}

pub fn section(results: &Results) -> Markup {
    html! {
        div.tiles {
            @for t in tiles(results) {
                div.tile { div.name { (t.name) } div.value { (t.value) } div.note { (t.note) } }
            }
        }
        @if !results.warnings.is_empty() {
            div.warnings { h3 { "Read these first" } ul { @for w in &results.warnings { li { (w) } } } }
        }
        (words(results))
    }
}

fn tiles(results: &Results) -> Vec<Tile> {
    let mut tiles = Vec::new();
    let surface = &results.surface;
    tiles.push(Tile {
        name: "surface".into(),
        value: format!("{} × {}", count(surface.nx), count(surface.ny)),
        note: format!("nodes, L = {}", si_given(results.scales.length_m, "m")),
    });
    if let Some(s) = results.continuum.as_ref().and_then(|c| c.states.last()) {
        tiles.push(Tile {
            name: format!("touches at p* = {}", trimmed(s.p_star, 4)),
            value: percent(s.contact_fraction_corrected),
            note: format!("of the cell (perimeter-corrected; {} raw)", percent(s.contact_fraction)),
        });
        tiles.push(Tile {
            name: format!("mean gap at p* = {}", trimmed(s.p_star, 4)),
            value: si(s.mean_gap * results.scales.length_m, "m", 3),
            note: format!("under {}", si(s.pressure * results.scales.modulus_pa, "Pa", 3)),
        });
    }
    if let Some(load) = results.comparison.as_ref().and_then(|c| c.loads.last()) {
        let plain = load.continuum.first().map(|m| percent(m.contact_fraction));
        tiles.push(Tile {
            name: format!("atoms in contact at p* = {}", trimmed(load.p_star, 4)),
            value: percent(load.atoms.contact_fraction),
            note: plain.map_or(String::new(), |p| format!("plain continuum at the atoms’ scale: {p}")),
        });
        if let Some(m) = matched(load) {
            tiles.push(Tile {
                name: "agreement of the maps".into(),
                value: format!("κ = {}", significant(m.overlap.kappa, 2)),
                note: format!("criterion “{}”; a shifted map gives {}", m.id, significant(m.shifted.kappa, 2)),
            });
        }
    } else if let Some((atoms, state)) = results.atoms.as_ref().and_then(|a| Some((a, a.states.last()?))) {
        tiles.push(Tile {
            name: format!("atoms in contact at p* = {}", trimmed(state.p_star, 4)),
            value: percent(state.contact_fraction),
            note: format!("of the surface layer of {} moving atoms", count(atoms.deformable)),
        });
    }
    if !results.stages.is_empty() {
        let peak = results.stages.iter().map(|s| s.peak_rss_bytes).max().unwrap_or(0);
        tiles.push(Tile {
            name: "cost".into(),
            value: duration(results.stages.iter().map(|s| s.seconds).sum()),
            note: format!("wall time, {} of memory at most", memory(peak)),
        });
    }
    tiles
}

/// The symbols of this page, each once. Only those that the page uses.
fn words(results: &Results) -> Markup {
    let modulus = si_given(results.scales.modulus_pa, "Pa");
    let length = si_given(results.scales.length_m, "m");
    html! {
        h3 { "How to read the numbers" }
        dl {
            dt { "L, E*" }
            dd { "Extent of the periodic cell in x, here " (length) ", and contact modulus E/(1 − ν²), here " (modulus)
                ". They are the units of length and of stress of the dimensionless problem."
                @if let Some(atoms) = &results.atoms {
                    " The atoms solve the same problem on a smaller cell of " (si_given(atoms.length_angstrom * 1e-10, "m"))
                    @if let Some(e) = atoms.modulus_gpa { " with E* = " (trimmed(e, 4)) " GPa" } "."
                } }
            dt { "p*" }
            dd { "Reduced load: mean pressure over E* times the rms gradient of the surface. Loads are compared in it "
                "because contact area grows with p* alike for all surfaces of small slope." }
            dt { "Gap" }
            dd { "Distance between the two surfaces along z; zero where they touch." }
            dt { "Contact" }
            dd { "Share of the cell that touches. It means little without its " em { "criterion" } ": a zero gap for a "
                "hard wall, a distance below a threshold for atoms, which have no sharp surface. Every number here names "
                "its criterion." }
            @if results.comparison.is_some() {
                dt { "κ, Jaccard" }
                dd { "Agreement of two contact maps site by site. Jaccard is the sites touching in both over those touching "
                    "in either; κ (Cohen) is the agreement beyond chance: 1 for equal maps, 0 for chance. "
                    "Each stands beside its value for a map shifted by a third and a fifth of the cell, which has the "
                    "same patches in the wrong places." }
            }
        }
    }
}
