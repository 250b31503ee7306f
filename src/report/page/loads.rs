//! Continuum states: the table of loads, maps of gap and stress.

use maud::{Markup, html};

use super::desk::{Desk, colour_bar, figure, panel, table, text};
use crate::error::Result;
use crate::record::reduce::Reduced;
use crate::record::results::{ContinuumResults, StateResults};
use crate::report::number::{count, duration, percent, si, significant, trimmed};
use crate::report::picture::{self, Range};

/// Pictures of single loads; several stand side by side.
pub const PANEL_SIDE: usize = 400;
/// Share of a map that may lie above its colour bar's end.
pub const CLIPPED: f64 = 0.002;
/// Loads shown as maps in the page; the others' pictures are only files.
const LOADS_SHOWN: usize = 4;

pub fn section(desk: &Desk, continuum: &ContinuumResults) -> Result<Markup> {
    Ok(html! {
        (setting(continuum))
        (states(continuum, desk.scales.length_m, desk.scales.modulus_pa))
        (gallery(desk, continuum)?)
    })
}

/// What was solved, in one line.
pub fn setting(c: &ContinuumResults) -> Markup {
    html! {
        p { "Method " strong { (c.method) } " on " (count(c.nx)) " × " (count(c.ny)) " nodes; elastic body: " (c.kernel)
            "; adhesion: " (c.adhesion) "; contact: " (c.wall) "." }
    }
}

/// The table of states of a problem whose unit of length is `length_m`.
pub fn states(c: &ContinuumResults, length_m: f64, modulus_pa: f64) -> Markup {
    let rows = c
        .states
        .iter()
        .map(|s| {
            vec![
                text(trimmed(s.p_star, 4)),
                text(si(s.pressure * modulus_pa, "Pa", 3)),
                text(percent(s.contact_fraction)),
                text(percent(s.contact_fraction_corrected)),
                text(si(s.mean_gap * length_m, "m", 4)),
                text(count(s.patches)),
                stop(s),
                text(format!("{} / {}", significant(s.load_error, 2), significant(s.residual, 2))),
                text(format!("{} ({} FFT pairs)", count(s.iterations), count(s.fft_pairs))),
                text(duration(s.seconds)),
            ]
        })
        .collect();
    let head = [
        "p*",
        "mean pressure",
        "contact",
        "perimeter-corrected",
        "mean gap",
        "patches",
        "solver",
        "error of load / residual",
        "iterations",
        "time",
    ];
    let mut criteria: Vec<&str> = c.states.iter().map(|s| s.criterion.as_str()).collect();
    criteria.dedup();
    html! {
        (table(&head, rows))
        p.quiet { "Contact is counted where: " (criteria.join("; ")) ". The perimeter-corrected share takes off the "
            "half nodes by which a grid overcounts the rim of every patch. The errors are relative to the load and to "
            "the mean pressure." }
    }
}

fn stop(s: &StateResults) -> Markup {
    if s.stop == "converged" {
        text("converged")
    } else {
        html! { span.bad { (s.stop) } }
    }
}

/// Loads worth a picture: all of them, or a few spread over the path with both ends.
fn shown(states: &[StateResults]) -> Vec<usize> {
    let with_maps: Vec<usize> =
        (0..states.len()).filter(|&i| states[i].gap.is_some() || states[i].stress.is_some()).collect();
    if with_maps.len() <= LOADS_SHOWN {
        return with_maps;
    }
    (0..LOADS_SHOWN).map(|i| with_maps[i * (with_maps.len() - 1) / (LOADS_SHOWN - 1)]).collect()
}

fn gallery(desk: &Desk, c: &ContinuumResults) -> Result<Markup> {
    let shown = shown(&c.states);
    let mut maps = Vec::new();
    for (i, state) in c.states.iter().enumerate() {
        let p_star = trimmed(state.p_star, 4);
        let title = |what: &str| {
            let mark = if state.stop == "converged" { "" } else { " (not converged)" };
            format!("{what} at p* = {p_star}{mark}")
        };
        let one = |what: &str, file: &str, name: String, unit: f64, unit_name: &str| -> Result<Markup> {
            let small = picture::load(&desk.field(file)?, PANEL_SIDE, |v| v * unit)?;
            let range = Range::of(&small.values, CLIPPED);
            let image = desk.picture(&name, &title(what), &picture::map(&small, range))?;
            Ok(panel(&title(what), image, colour_bar(range, unit_name, clipped(&small, range))))
        };
        let mut pair = Vec::new();
        if let Some(file) = &state.gap {
            pair.push(one("Gap", file, format!("gap-{}", i + 1), desk.scales.length_m, "m")?);
        }
        if let Some(file) = &state.stress {
            pair.push(one("Stress", file, format!("stress-{}", i + 1), desk.scales.modulus_pa, "Pa")?);
        }
        if shown.contains(&i) {
            maps.extend(pair);
        }
    }
    if maps.is_empty() {
        return Ok(html! {});
    }
    Ok(figure(
        html! { div.panels { @for m in &maps { (m) } } },
        html! {
            "Gap and normal stress (compression positive; tension, where adhesion pulls, is negative). Dark is low: where the "
            "gap is darkest the surfaces touch. Large grids are shown as block means, which smooth single peaks."
            @if shown.len() < c.states.len() { " The other loads are in the folder figures." }
        },
    ))
}

pub fn clipped(small: &Reduced, range: Range) -> bool {
    small.values.iter().any(|v| *v > range.high)
}
