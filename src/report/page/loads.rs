//! Continuum states: table of loads, maps of gap and stress.

use crate::load::Branch;
use maud::{Markup, html};

use super::figures::{FigureWriter, figure, numbers, panel, panels, text};
use super::uncertainty;
use crate::error::Result;
use crate::record::downsample::DownsampledMap;
use crate::record::results::{ContinuumResults, StateResults};
use crate::report::hysteresis::hysteresis_sentence;
use crate::report::map::{Bar, Legend};
use crate::report::number::{count, duration, percent, si, significant, trimmed};
use crate::report::picture::{self, BLACK, Range};

/// Maximum side of pictures of single loads, which are shown in a row, pixels.
pub(super) const PANEL_SIDE: usize = 400;
/// Fraction of a map that may exceed the end of the colour bar.
pub(super) const CLIPPED: f64 = 0.002;
/// Number of loads with maps in the page; maps of the other loads are only written to files.
const LOADS_SHOWN: usize = 4;

pub(super) fn section(writer: &FigureWriter, continuum: &ContinuumResults) -> Result<Markup> {
    let work = writer.scales.modulus_pa * writer.scales.length_m;
    Ok(html! {
        (setting(continuum))
        (states(continuum, &|s| laboratory(writer, s)))
        (plasticity(writer, continuum))
        @if let Some(said) = hysteresis_sentence(continuum, |w| si(w * work, "J/m²", 3)) { p { (said) } }
        (uncertainty::section(writer, continuum)?)
        (gallery(writer, continuum)?)
    })
}

/// One-line description of the problem.
pub(super) fn setting(c: &ContinuumResults) -> Markup {
    html! {
        p { "Method " strong { (c.method) } " on " (count(c.nx)) " × " (count(c.ny)) " nodes; elastic body: " (c.kernel)
            "; adhesion: " (c.adhesion) "; wall: " (c.wall) "." }
    }
}

/// Table of the plastic flow; empty for an elastic body.
fn plasticity(writer: &FigureWriter, c: &ContinuumResults) -> Markup {
    let Some(hardness) = c.hardness else { return html! {} };
    let (length, stress) = (writer.scales.length_m, writer.scales.modulus_pa);
    let most = match &c.hardness_map {
        None => format!("the hardness of {}", si(hardness * stress, "Pa", 3)),
        Some(map) => {
            let [lowest, mean, highest] = [map.lowest, hardness, map.highest].map(|h| si(h * stress, "Pa", 3));
            format!("the hardness of the node, {lowest} to {highest} with a mean of {mean}")
        }
    };
    let row = |s: &StateResults| {
        let p = s.plasticity?;
        Some(vec![
            html! { (trimmed(s.numbers.p_star, 4)) (back(s)) },
            text(percent(p.flowing)),
            text(percent(p.displaced)),
            text(si(p.displacement * length, "m", 3)),
            text(si(p.work * stress * length, "J/m²", 3)),
        ])
    };
    html! {
        h3 { "Plastic flow" }
        (numbers(&["p*", "flowing", "displaced", "mean plastic displacement", "plastic work"], c.states.iter().filter_map(row).collect()))
        p.quiet { "The contact stress is at most " (most) ". Flowing: nodes whose plastic displacement grows in this load; displaced: "
            "nodes that have one. Unloading is elastic." }
    }
}

/// Mean pressure and mean gap in SI units at the scale of the scene.
fn laboratory(writer: &FigureWriter, s: &StateResults) -> [String; 2] {
    [si(s.numbers.pressure * writer.scales.modulus_pa, "Pa", 3), si(s.mean_gap * writer.scales.length_m, "m", 4)]
}

/// The table of states; `units` formats mean pressure and mean gap of a state.
pub(super) fn states(c: &ContinuumResults, units: &dyn Fn(&StateResults) -> [String; 2]) -> Markup {
    let rows = c
        .states
        .iter()
        .map(|s| {
            let [pressure, gap] = units(s);
            // Separated surfaces have no equilibrium, so the last iterate is meaningless.
            let known = |number: String| text(if s.numbers.stop == "detached" { "–".into() } else { number });
            vec![
                html! { (trimmed(s.numbers.p_star, 4)) (back(s)) },
                text(pressure),
                known(
                    with_error(100.0 * s.numbers.contact_area, s.numbers.contact_area_error.map(|e| 100.0 * e)) + " %",
                ),
                known(percent(s.contact_nodes)),
                known(gap),
                s.numbers.patches.map_or_else(|| text("–"), |n| known(count(n))),
                stop(s),
                known(significant(s.numbers.load_error, 2)),
                known(significant(s.residual, 2)),
                text(count(s.numbers.iterations)),
                text(count(s.numbers.fft_pairs.round() as usize)),
                text(duration(s.numbers.seconds)),
            ]
        })
        .collect();
    let head = [
        "p*",
        "mean pressure",
        "contact area",
        "contact nodes",
        "mean gap",
        "clusters",
        "solver",
        "load error",
        "residual",
        "steps",
        "FFT pairs",
        "time",
    ];
    let mut criteria: Vec<&str> = c.states.iter().map(|s| s.criterion.as_str()).collect();
    criteria.dedup();
    html! {
        (numbers(&head, rows))
        p.quiet { "Contact criterion: " (criteria.join("; ")) ". Contact area: nodes without the excess that they count along the edges of "
            "clusters, with the error. Clusters connect by edges or corners. Load error: relative deviation of the integrated stress from "
            "the target load; residual: rms violation of equilibrium over the mean pressure. FFT pair: one forward and one "
            "inverse transform." }
    }
}

/// A value with its error.
fn with_error(value: f64, error: Option<f64>) -> String {
    let error = error.map_or(String::new(), |e| format!(" ± {}", significant(e, 2)));
    format!("{}{error}", significant(value, 3))
}

/// Label of a load on the unloading branch.
pub(super) fn back(s: &StateResults) -> &'static str {
    if s.branch == Branch::Unloading { " (unloading)" } else { "" }
}

fn stop(s: &StateResults) -> Markup {
    if s.numbers.stop == "converged" {
        text("converged")
    } else {
        html! { span.bad { (s.numbers.stop) } }
    }
}

/// Tensile stresses below this fraction of the largest stress are rounding errors; the colour bar then starts at
/// zero.
const NO_TENSION: f64 = 1e-6;

/// Indices of the loads shown: all, or a few spread over the path including both ends.
fn shown(states: &[StateResults]) -> Vec<usize> {
    let with_maps: Vec<usize> = (0..states.len())
        .filter(|&i| states[i].numbers.gap_map.is_some() || states[i].numbers.stress_map.is_some())
        .collect();
    if with_maps.len() <= LOADS_SHOWN {
        return with_maps;
    }
    (0..LOADS_SHOWN).map(|i| with_maps[i * (with_maps.len() - 1) / (LOADS_SHOWN - 1)]).collect()
}

fn of_gap<'a>(values: impl IntoIterator<Item = &'a f64>) -> Range {
    Range { low: 0.0, ..Range::of(values, CLIPPED) }
}

pub(super) fn of_stress<'a>(values: impl IntoIterator<Item = &'a f64>) -> Range {
    let range = Range::of(values, CLIPPED);
    if -range.low < NO_TENSION * range.high { Range { low: 0.0, ..range } } else { range }
}

/// Colour ranges of gap and stress over the loads shown; `None` if every map has its own.
fn common_ranges(writer: &FigureWriter, c: &ContinuumResults) -> Result<(Option<Range>, Option<Range>)> {
    if writer.own_ranges() {
        return Ok((None, None));
    }
    let (mut gaps, mut stresses) = (Vec::new(), Vec::new());
    for state in shown(&c.states).into_iter().map(|i| &c.states[i].numbers) {
        if let Some(file) = &state.gap_map {
            gaps.extend(picture::load(&writer.field(file)?, PANEL_SIDE, |v| v * writer.scales.length_m)?.values);
        }
        if let Some(file) = &state.stress_map {
            stresses.extend(picture::load(&writer.field(file)?, PANEL_SIDE, |v| v * writer.scales.modulus_pa)?.values);
        }
    }
    Ok((Some(of_gap(&gaps)), Some(of_stress(&stresses))))
}

fn gallery(writer: &FigureWriter, c: &ContinuumResults) -> Result<Markup> {
    let shown = shown(&c.states);
    let (mut contacts, mut gaps, mut stresses) = (Vec::new(), Vec::new(), Vec::new());
    let length_m = writer.scales.length_m;
    let (gap_range, stress_range) = common_ranges(writer, c)?;
    for (i, state) in c.states.iter().enumerate() {
        let p_star = trimmed(state.numbers.p_star, 4);
        let title = |what: &str| {
            let mark = if state.numbers.stop == "converged" { "" } else { " (not converged)" };
            format!("{what} at p* = {p_star}{}{mark}", back(state))
        };
        if let Some(file) = &state.numbers.gap_map {
            let file = writer.field(file)?;
            let small = picture::load(&file, PANEL_SIDE, |v| v * length_m)?;
            let contact = picture::load(&file, PANEL_SIDE, |v| f64::from(u8::from(v <= 0.0)))?;
            let range = gap_range.unwrap_or_else(|| of_gap(&small.values));
            let legend = Legend::OverContact(Bar::prefixed("gap", range, "m", clipped(&small, range)));
            let names = (format!("gap-{}", i + 1), title("Gap"));
            let image = writer.map((&names.0, &names.1), &picture::gap(&small, range, &contact), length_m, legend)?;
            gaps.extend(shown.contains(&i).then(|| panel(&names.1, image, html! {})));
            let names = (format!("contact-{}", i + 1), title("Contact"));
            let image = writer.map((&names.0, &names.1), &picture::contact(&contact, BLACK), length_m, Legend::None)?;
            let share = html! { (percent(state.contact_nodes)) " in contact (black)" };
            contacts.extend(shown.contains(&i).then(|| panel(&names.1, image, share)));
        }
        if let Some(file) = &state.numbers.stress_map {
            let small = picture::load(&writer.field(file)?, PANEL_SIDE, |v| v * writer.scales.modulus_pa)?;
            let range = stress_range.unwrap_or_else(|| of_stress(&small.values));
            let legend = Legend::Ramp(Bar::prefixed("normal stress", range, "Pa", clipped(&small, range)));
            let names = (format!("stress-{}", i + 1), title("Stress"));
            let image = writer.map((&names.0, &names.1), &picture::map(&small, range), length_m, legend)?;
            stresses.extend(shown.contains(&i).then(|| panel(&names.1, image, html! {})));
        }
    }
    if gaps.is_empty() && stresses.is_empty() {
        return Ok(html! {});
    }
    // Two loads take half of the page width.
    let row = shown.len().max(3);
    Ok(figure(
        html! {
            @for list in [&contacts, &gaps, &stresses] { @if !list.is_empty() { (panels(row, list)) } }
        },
        html! {
            "Contact; gap, black in contact; normal stress, compression positive. Dark is low. "
            (writer.range_note()) " "
            ""
            "Large grids are shown as block means, which smooth single peaks, and as contact where at least half of a block is "
            "in contact."
            @if shown.len() < c.states.iter().filter(|s| s.numbers.gap_map.is_some() || s.numbers.stress_map.is_some()).count() {
                " The other maps are in figures/."
            }
        },
    ))
}

pub(super) fn clipped(small: &DownsampledMap, range: Range) -> bool {
    small.values.iter().any(|v| *v > range.high)
}
