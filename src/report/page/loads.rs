//! Continuum states: table of loads, maps of gap and stress.

use super::prelude::*;
use super::{profile, requested, uncertainty};
use crate::report::hysteresis::hysteresis_sentence;

/// Maximum side of pictures of single loads, which are shown in a row, pixels.
pub(super) const PANEL_SIDE: usize = 400;
/// Fraction of a map that may exceed the end of the colour bar.
pub(super) const CLIPPED: f64 = 0.002;
/// Number of loads with maps in the page; maps of the other loads are only written to files.
const LOADS_SHOWN: usize = 4;

pub(super) fn section(writer: &FigureWriter, continuum: &ContinuumResults) -> Result<Markup> {
    Ok(html! {
        (setting(continuum))
        (states(continuum, writer.loads, &|gap| length(gap, 4)))
        @if let Some(said) = hysteresis_sentence(continuum, writer.loads) { p { (said) } }
        (requested::section(writer, continuum)?)
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

/// Relative difference of equal pressures: solvers meet a load to 10⁻³ or better.
const SAME_PRESSURE: f64 = 0.01;

/// The table of states; `gap` formats a mean gap, m.
pub(super) fn states(c: &ContinuumResults, loads: GivenLoads, gap: &dyn Fn(f64) -> String) -> Markup {
    // Separated surfaces have no equilibrium, so the last iterate is meaningless.
    let known = |s: &State, number: String| or_dash((s.stop != Stop::Detached).then_some(number));
    let mut criteria: Vec<&str> = c.states.iter().map(|s| s.criterion.as_str()).collect();
    criteria.dedup();
    // Of p* and the mean pressure, the one that the loads are not named by. On the heights of the atoms the pressure is another one.
    let own = |s: &State| s.pressure != 0.0 && (loads.of_p_star * s.p_star / s.pressure - 1.0).abs() < SAME_PRESSURE;
    let by_pressure = loads.quantity == LoadQuantity::Pressure && c.states.iter().any(own);
    let other = if by_pressure { "p*" } else { "mean pressure" };
    let second = |s: &State| if by_pressure { trimmed(s.p_star, 4) } else { stress(s.pressure, 3) };
    html! {
        (columns!("numbers", &c.states, |s| {
            loads.head() => load(s, loads),
            other => second(s),
            "contact area" => known(s, {
                let error = s.contact_area_error.map_or(String::new(), |e| format!(" ± {}", significant(100.0 * e, 2)));
                format!("{}{error} %", significant(100.0 * s.contact_area, 3))
            }),
            "contact nodes" => or_dash(s.contact_nodes.map(|n| known(s, percent(n)))),
            "mean gap" => or_dash(s.mean_gap.map(|g| known(s, gap(g)))),
            "clusters" => or_dash(s.clusters.map(|n| known(s, count(n)))),
            "solver" => stop(s),
            "load error" => known(s, significant(s.load_error, 2)),
            "residual" => or_dash(s.residual.map(|r| known(s, significant(r, 2)))),
            "steps" => count(s.iterations),
            "FFT pairs" => count(s.fft_pairs.round() as usize),
            "time" => duration(s.seconds),
        }))
        p.quiet { "Contact criterion: " (criteria.join("; ")) ". Contact area: nodes without the excess that they count along the edges of "
            "clusters, with the error. Clusters connect by edges or corners. Load error: relative deviation of the integrated stress from "
            "the target load; residual: rms violation of equilibrium over the mean pressure. FFT pair: one forward and one "
            "inverse transform." }
    }
}

fn stop(s: &State) -> Markup {
    if s.stop == Stop::Converged { "converged".render() } else { bad(s.stop.to_string()) }
}

/// Tensile stresses below this fraction of the largest stress are rounding errors; the colour bar then starts at
/// zero.
const NO_TENSION: f64 = 1e-6;

/// Indices of the loads shown: all, or a few spread over the path including both ends.
fn shown(states: &[State]) -> Vec<usize> {
    let with_maps: Vec<usize> = (0..states.len()).filter(|&i| has_maps(&states[i])).collect();
    spread(with_maps.len(), LOADS_SHOWN).into_iter().map(|i| with_maps[i]).collect()
}

fn has_maps(s: &State) -> bool {
    s.gap_map.is_some() || s.stress_map.is_some()
}

pub(super) fn of_gap<'a>(values: impl IntoIterator<Item = &'a f64>) -> ColourRange {
    ColourRange { low: 0.0, ..ColourRange::of(values, CLIPPED) }
}

pub(super) fn of_stress<'a>(values: impl IntoIterator<Item = &'a f64>) -> ColourRange {
    let range = ColourRange::of(values, CLIPPED);
    if -range.low < NO_TENSION * range.high { ColourRange { low: 0.0, ..range } } else { range }
}

/// Colour ranges of gap and stress over the loads shown; `None` if every map has its own.
fn common_ranges(writer: &FigureWriter, c: &ContinuumResults) -> Result<Option<[ColourRange; 2]>> {
    if writer.own_ranges() {
        return Ok(None);
    }
    let (mut gaps, mut stresses) = (Vec::new(), Vec::new());
    for state in shown(&c.states).into_iter().map(|i| &c.states[i]) {
        if let Some(file) = state.gap_file() {
            gaps.extend(writer.load(file, PANEL_SIDE, |v| v * writer.scales.length_m)?.values);
        }
        if let Some(file) = state.stress_file() {
            stresses.extend(writer.load(file, PANEL_SIDE, |v| v * writer.scales.modulus_pa)?.values);
        }
    }
    Ok(Some([of_gap(&gaps), of_stress(&stresses)]))
}

fn gallery(writer: &FigureWriter, c: &ContinuumResults) -> Result<Markup> {
    let shown = shown(&c.states);
    if profile::is_profile(c.ny) {
        return profile::fields(writer, &shown.iter().map(|&i| &c.states[i]).collect::<Vec<_>>());
    }
    let mut rows: [Vec<Markup>; 3] = Default::default();
    let length_m = writer.scales.length_m;
    let ranges = common_ranges(writer, c)?;
    for (i, state) in c.states.iter().enumerate() {
        let title = |description: &str| {
            let mark = if state.stop == Stop::Converged { "" } else { " (not converged)" };
            format!("{description} at {}{}{mark}", writer.loads.label(state.p_star), back(state))
        };
        let mut add = |row: usize, title: &str, image: Markup, below: Markup| {
            rows[row].extend(shown.contains(&i).then(|| panel(title, image, below)));
        };
        if let Some(file) = state.gap_file() {
            let small = &writer.load(file, PANEL_SIDE, |v| v * length_m)?;
            let contact = writer.closed(file, PANEL_SIDE)?;
            let range = ranges.map_or_else(|| of_gap(&small.values), |[gap, _]| gap);
            let (name, words) = (format!("gap-{}", i + 1), title("Gap"));
            let gap = Values { quantity: "gap", unit: "m", small, range, contact: Some(&contact) };
            add(1, &words, writer.values((&name, &words), &gap, length_m)?, html! {});
            let (name, words) = (format!("contact-{}", i + 1), title("Contact"));
            let image = writer.map((&name, &words), &picture::contact(&contact, BLACK), length_m)?;
            add(
                0,
                &words,
                image,
                html! { (or_dash(state.contact_nodes.map(percent))) " of the nodes in contact (black)" },
            );
        }
        if let Some(file) = state.stress_file() {
            let small = &writer.load(file, PANEL_SIDE, |v| v * writer.scales.modulus_pa)?;
            let range = ranges.map_or_else(|| of_stress(&small.values), |[_, stress]| stress);
            let (name, words) = (format!("stress-{}", i + 1), title("Stress"));
            let stress = Values { quantity: "normal stress", unit: "Pa", small, range, contact: None };
            add(2, &words, writer.values((&name, &words), &stress, length_m)?, html! {});
        }
    }
    if rows.iter().all(Vec::is_empty) {
        return Ok(html! {});
    }
    // Two loads take half of the page width.
    let row = shown.len().max(3);
    Ok(figure(
        html! { @for list in &rows { @if !list.is_empty() { (panels(row, list)) } } },
        html! {
            "Contact; gap, black in contact; normal stress, compression positive. Dark is low. " (writer.range_note())
            " Large grids are shown as block means, which smooth single peaks, and as contact where at least half of a block is "
            "in contact."
            @if shown.len() < c.states.iter().filter(|s| has_maps(s)).count() { " The other maps are in figures/." }
        },
    ))
}
