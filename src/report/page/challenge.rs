//! Acceptance checks of the challenge, and figures 1 to 12 of its paper.

use maud::{Markup, html};

use super::bands;
use super::compare::key;
use super::curves::{branches, formula, theory};
use super::figures::{FigureWriter, figure, panel, panels, table, text};
use super::methods::column;
use super::surface::{DENSITY_LABELS, density_units};
use super::uncertainty;
use crate::challenge::{SIZE_EXPONENT, reference, summary};
use crate::error::Result;
use crate::record::acceptance::{AcceptanceCheck, CheckScope, CheckStatus};
use crate::record::downsample::DownsampledMap;
use crate::record::quantity as record;
use crate::record::results::{ContinuumResults, FIRST_TOUCH, Observed, Results, StateResults};
use crate::report::map::{Bar, Legend};
use crate::report::number::{significant, with_error};
use crate::report::picture::{self, BLACK, BLUE, LONGEST_SIDE, ORANGE, Picture, Range};
use crate::report::plot::{self, Axis, Curve, Dash, Marker, Plot, Style};

const WITH: Style = plot::ATOMS;
const WITHOUT: Style = plot::WITHOUT;
const THEORY: Style = plot::EXPECTED;
const PART: Style = Style { marker: Marker::None, ..plot::HARD };

/// Table of the acceptance checks.
pub(super) fn checks(list: &[AcceptanceCheck]) -> Markup {
    let rows = list
        .iter()
        .map(|j| {
            let unit = if j.unit == "1" { "" } else { &j.unit };
            let value = |v: f64| format!("{} {unit}", significant(v, 4));
            vec![
                text(&j.id),
                text(&j.statement),
                text(found(j)),
                text(j.reference.map_or("–".into(), value)),
                text(j.accepted(value).unwrap_or("–".into())),
                match (j.status, j.scope) {
                    (CheckStatus::Pass, CheckScope::Setup) => html! { span.quiet { "by set-up" } },
                    (CheckStatus::Pass, _) => text(j.status),
                    (CheckStatus::Fail, CheckScope::LongerRange) => html! { span.bad { (j.status) ", longer range" } },
                    (CheckStatus::Fail, _) => html! { span.bad { (j.status) } },
                    (CheckStatus::NotAssessed, _) => html! { span.quiet { (j.status) } },
                },
                text(&j.reason),
            ]
        })
        .collect();
    html! {
        p { "Statements of the paper compared with this run: " (summary(list)) "." }
        @if let Some(chart) = bands::chart(list) {
            (figure(chart, html! { "Value (dot), expected value (line) and accepted range (band) of every assessed statement, each "
                "on its own axis; open ranges end at the other side of the expected value." }))
        }
        (table(&["", "statement", "found", "reference", "accepted", "status", "reason"], rows))
    }
}

/// The value of a check with its error.
fn found(check: &AcceptanceCheck) -> String {
    let Some(v) = check.value else { return "–".into() };
    let unit = if check.unit == "1" { "" } else { &check.unit };
    let plain = || format!("{} {unit}", significant(v, 4)).trim_end().to_string();
    match check.error {
        Some(e) if e > 0.0 && e < 1e-4 * v.abs() => {
            format!("{} ± {} {unit}", significant(v, 4), significant(e, 1)).trim_end().to_string()
        }
        Some(e) if e > 0.0 => {
            // The values have units with their prefix.
            let (value, error) = with_error(v, e, "");
            format!("{value}{error} {unit}").trim_end().to_string()
        }
        Some(_) => format!("{} (exact)", plain()),
        None => plain(),
    }
}

/// The figures of the paper.
pub(super) fn figures(writer: &FigureWriter, results: &Results) -> Result<Markup> {
    let (Some(with), Some(without)) = (&results.continuum, &results.non_adhesive) else { return Ok(html! {}) };
    let mut drawn = Vec::new();
    for (number, plot, caption) in [
        (1, spectrum(writer, results), "Spectrum of the surface: realised and prescribed."),
        (4, section(writer, with, without, Quantity::Gap)?, "Gap along y at x = L/2, at the reference load."),
        (
            5,
            section(writer, with, without, Quantity::Stress)?,
            "Interfacial stress along the same section; tension is negative.",
        ),
        (6, sizes(writer, with, without), "Pr(a): density of clusters of an area, at the reference load."),
        (
            7,
            shares(writer, with, without),
            "CPr(a): fraction of the contact in clusters up to an area, at the reference load.",
        ),
        (8, gaps(writer, with, without), "Pr(u): distribution of the gap out of contact, at the reference load."),
        (9, stresses(with, without), "Pr(σ): distribution of the interfacial stress, at the reference load."),
        (10, area(with, without), "Relative contact area against load."),
        (11, contact_pressure(with, without), "Mean contact pressure against load, loading and unloading."),
        (
            12,
            mean_gap(writer, results, with, without),
            "Mean gap against load; the triangle marks first contact, without deformation.",
        ),
    ] {
        drawn.extend(writer.curves(&format!("figure-{number:02}"), &plot)?.map(|curve| (number, curve, caption)));
    }
    if let Some(file) = &results.surface.heights {
        let heights = picture::load(&writer.field(file)?, LONGEST_SIDE, |h| h * writer.scales.length_m)?;
        let range = Range::of(&heights.values, 0.0);
        let legend = Legend::Ramp(Bar::prefixed("height", range, "m", false));
        let names = ("figure-02", "height map of the challenge’s surface");
        let map = writer.large_map(names, &picture::map(&heights, range), writer.scales.length_m, legend)?;
        drawn.push((2, map, "The surface; dark areas touch first."));
    }
    if let Some(maps) = contacts(writer, with, without)? {
        drawn.push((3, maps, "True contact at the reference load, without adhesion and with it, and both superposed."));
    }
    drawn.sort_by_key(|(number, ..)| *number);
    Ok(html! {
        p { "The figures of the challenge’s paper, from this run: with and without adhesion, loading and unloading. "
            "Loads are p* = p/(E* ḡ), the reference load is p* = 0.01." }
        @for (number, drawing, caption) in &drawn {
            (figure(drawing.clone(), html! {
                (caption) " (The paper’s figure " (number) ".)"
                @if *number == 4 { br; (line_means(writer, with, without)?) }
                @for claim in claims(&results.acceptance, *number) { br; (claim) }
            }))
        }
    })
}

/// Statements that the figures of the paper support; those with letters are numbered alike.
const CLAIMS: [(u32, &[&str]); 10] = [
    (1, &["A03"]),
    (2, &["S04"]),
    (3, &["S05", "S06"]),
    (5, &["S14"]),
    (6, &["S15", "S16"]),
    (7, &["S17", "S18"]),
    (8, &["S21"]),
    (9, &["S22", "S23", "S24"]),
    (11, &["S08", "S09"]),
    (12, &["S11", "S12", "S13", "A01", "A02"]),
];
/// The figure of the area, which supports most of them.
const AREA_CLAIMS: (u32, &[&str]) = (10, &["S05", "S06", "S07", "S10"]);

/// Claims of a figure with our values.
fn claims(list: &[AcceptanceCheck], number: u32) -> Vec<Markup> {
    let of = CLAIMS.iter().chain([&AREA_CLAIMS]).find(|c| c.0 == number).map_or(&[] as &[&str], |c| c.1);
    let about = |check: &&AcceptanceCheck| of.iter().any(|id| check.id.starts_with(id));
    let line = |j: &AcceptanceCheck| {
        let unit = if j.unit == "1" { "" } else { &j.unit };
        let value = |v: f64| format!("{} {unit}", significant(v, 4)).trim_end().to_string();
        html! {
            (j.id) ", " (j.statement) ": "
            @match j.value {
                Some(_) => {
                    strong { (found(j)) }
                    @if let Some(r) = j.reference { "; expected " (value(r)) }
                    @if let Some(a) = j.accepted(value) { " (accepted " (a) ")" }
                    ", " (j.status) @if j.status == CheckStatus::NotAssessed { ": " (j.reason) }
                },
                None => { (j.status) ", " (j.reason) },
            } "."
        }
    };
    list.iter().filter(about).map(line).collect()
}

/// What this grid tests, first.
pub(super) fn conclusion(results: &Results) -> Markup {
    let list = &results.acceptance;
    let ids = |is: &dyn Fn(&AcceptanceCheck) -> bool| {
        list.iter().filter(|j| is(j)).map(|j| j.id.as_str()).collect::<Vec<_>>()
    };
    let setup = ids(&|j| j.scope == CheckScope::Setup && j.status == CheckStatus::Pass);
    let untested = ids(&|j| j.status == CheckStatus::NotAssessed);
    let passed = ids(&|j| j.scope != CheckScope::Setup && j.status == CheckStatus::Pass);
    let failed = ids(&|j| j.status == CheckStatus::Fail);
    let named = |ids: &[&str]| if ids.is_empty() { String::new() } else { format!(" ({})", ids.join(", ")) };
    html! {
        strong { "This grid of " (results.surface.nx) " × " (results.surface.ny) " tests " (passed.len() + failed.len()) " of "
            (list.len()) " statements" } ": " (passed.len()) " pass, " (failed.len()) " fail" (named(&failed)) ". "
        (setup.len()) " hold by set-up and test nothing" (named(&setup)) "; " (untested.len()) " cannot be tested here"
        (named(&untested)) "."
    }
}

fn contacts(writer: &FigureWriter, with: &ContinuumResults, without: &ContinuumResults) -> Result<Option<Markup>> {
    let of = |c: &ContinuumResults| -> Result<Option<DownsampledMap>> {
        let Some(file) = reference(c).and_then(|s| s.numbers.gap_map.as_deref()) else { return Ok(None) };
        picture::load(&writer.field(file)?, LONGEST_SIDE, |gap| f64::from(u8::from(gap <= 0.0))).map(Some)
    };
    let (Some(plain), Some(adhesive)) = (of(without)?, of(with)?) else { return Ok(None) };
    let draw = |part: &str, title: &str, picture: &Picture| -> Result<Markup> {
        let name = format!("figure-03-{part}");
        Ok(panel(title, writer.map((&name, title), picture, writer.scales.length_m, Legend::None)?, html! {}))
    };
    let maps = [
        draw("without", "Without adhesion", &picture::contact(&plain, ORANGE))?,
        draw("with", "With adhesion", &picture::contact(&adhesive, BLUE))?,
        draw("superposed", "Superposed", &picture::superposed(&plain, &adhesive))?,
    ];
    Ok(Some(html! {
        (panels(maps.len(), &maps))
        div.key { (key(BLACK, "both")) (key(ORANGE, "only without")) (key(BLUE, "only with adhesion")) }
    }))
}

fn curve(label: &str, style: Style, points: Vec<(f64, f64)>) -> Curve {
    Curve { label: label.into(), style, points }
}

/// Observed values at the reference load, with and without adhesion.
fn observed(
    with: &ContinuumResults,
    without: &ContinuumResults,
    of: &dyn Fn(&Observed) -> Vec<(f64, f64)>,
) -> Vec<Curve> {
    let pick = |c| reference(c).and_then(|s| s.observed.as_ref()).map(of).unwrap_or_default();
    vec![
        curve("with adhesion", WITH.without_marker(), pick(with)),
        curve("without", WITHOUT.without_marker(), pick(without)),
    ]
}

fn spectrum(writer: &FigureWriter, results: &Results) -> Plot {
    let points = &results.surface.psd;
    let (q, c) = density_units(writer);
    Plot::new(
        (Axis::Log, Axis::Log),
        DENSITY_LABELS,
        vec![
            curve("realised", plot::REALISED, points.iter().map(|p| (p.mode * q, p.realised * c)).collect()),
            curve("prescribed", THEORY, points.iter().filter_map(|p| Some((p.mode * q, p.expected? * c))).collect()),
        ],
    )
}

#[derive(Clone, Copy, PartialEq)]
enum Quantity {
    Gap,
    Stress,
}

fn section(writer: &FigureWriter, with: &ContinuumResults, without: &ContinuumResults, what: Quantity) -> Result<Plot> {
    let um = writer.scales.length_m * 1e6;
    let unit = if what == Quantity::Gap { um } else { 1.0 };
    let along = |c: &ContinuumResults| -> Result<Vec<(f64, f64)>> {
        let Some(state) = reference(c) else { return Ok(Vec::new()) };
        let Some(file) = (if what == Quantity::Gap { &state.numbers.gap_map } else { &state.numbers.stress_map })
        else {
            return Ok(Vec::new());
        };
        column(writer, Some(file), unit)
    };
    let curves = vec![
        curve("with adhesion", WITH.without_marker(), along(with)?),
        curve("without", WITHOUT.without_marker(), along(without)?),
    ];
    let label = if what == Quantity::Gap { "gap u (µm)" } else { "stress σ/E* ḡ" };
    Ok(Plot::new((Axis::Linear, Axis::Linear), ("y (µm)", label), curves))
}

/// Mean gaps along the line of figure 4, with the relative uncertainty of the mean gap of the cell.
fn line_means(writer: &FigureWriter, with: &ContinuumResults, without: &ContinuumResults) -> Result<Markup> {
    let mean = |c: &ContinuumResults| -> Result<Option<String>> {
        let Some(state) = reference(c) else { return Ok(None) };
        let points = column(writer, state.numbers.gap_map.as_deref(), 1e6 * writer.scales.length_m)?;
        let mean = points.iter().map(|p| p.1).sum::<f64>() / points.len().max(1) as f64;
        let (value, error) = match uncertainty::total(state, record::Quantity::MeanGap) {
            Some(r) => with_error(mean, r * mean, ""),
            None => (significant(mean, 3), " ± not known".into()),
        };
        Ok((!points.is_empty()).then(|| format!("{value}{error} µm")))
    };
    Ok(html! {
        @if let (Some(with), Some(without)) = (mean(with)?, mean(without)?) {
            "Mean gap along this line: " strong { (with) } " with adhesion, " strong { (without) } " without; the errors are the relative "
            "uncertainty of the mean gap of the cell."
        }
    })
}

fn sizes(writer: &FigureWriter, with: &ContinuumResults, without: &ContinuumResults) -> Plot {
    let um2 = (writer.scales.length_m * 1e6).powi(2);
    let points = |o: &Observed| o.patch_density.iter().map(|[a, d, _]| (a * um2, d / um2)).collect::<Vec<_>>();
    let mut curves = observed(with, without, &points);
    // Passes through the middle point of the observed curve.
    if let Some(middle) = curves[0].points.get(curves[0].points.len() / 2).copied() {
        let at = |p: &(f64, f64)| (p.0, middle.1 * (p.0 / middle.0).powf(SIZE_EXPONENT));
        let line = curves[0].points.iter().map(at).collect();
        curves.push(curve("a^−1.45", THEORY, line));
    }
    Plot::new((Axis::Log, Axis::Log), ("area of a cluster a (µm²)", "Pr(a) (1/µm²)"), curves)
}

fn shares(writer: &FigureWriter, with: &ContinuumResults, without: &ContinuumResults) -> Plot {
    let um2 = (writer.scales.length_m * 1e6).powi(2);
    let points = |o: &Observed| o.patch_area.iter().map(|[a, share]| (a * um2, *share)).collect();
    Plot::new((Axis::Log, Axis::Linear), ("area of a cluster a (µm²)", "CPr(a)"), observed(with, without, &points))
}

fn gaps(writer: &FigureWriter, with: &ContinuumResults, without: &ContinuumResults) -> Plot {
    let um = writer.scales.length_m * 1e6;
    let curves = observed(with, without, &|o| o.gap_logarithmic.density_in(um));
    Plot::new((Axis::Log, Axis::Log), ("gap u (µm)", "Pr(u) (1/µm)"), curves)
}

fn stresses(with: &ContinuumResults, without: &ContinuumResults) -> Plot {
    let mut curves = observed(with, without, &|o| o.stress.density_in(1.0));
    if let Some(o) = reference(with).and_then(|s| s.observed.as_ref()) {
        curves.push(curve("with adhesion, contact only", PART, o.contact_stress.density_in(1.0)));
    }
    Plot::new((Axis::Linear, Axis::Log), ("stress σ/E* ḡ", "Pr(σ) E* ḡ"), curves)
}

/// Curves with adhesion, loading and unloading, and without.
fn paths(with: &ContinuumResults, without: &ContinuumResults, of: impl Fn(&StateResults) -> f64) -> Vec<Curve> {
    let point = |s: &StateResults| (s.numbers.p_star, of(s));
    let mut curves = branches(with, ("with adhesion", WITH), &point);
    curves.extend(branches(without, ("without", WITHOUT), &point));
    curves
}

fn area(with: &ContinuumResults, without: &ContinuumResults) -> Plot {
    let mut curves = paths(with, without, |s| s.numbers.contact_area);
    let (label, theory) = theory(without);
    curves.push(formula((&label, THEORY), &curves, Axis::Log, theory));
    Plot::new((Axis::Log, Axis::Log), ("load p*", "relative contact area a_r"), curves)
}

fn contact_pressure(with: &ContinuumResults, without: &ContinuumResults) -> Plot {
    let curves = paths(with, without, |s| s.numbers.p_star / s.numbers.contact_area);
    Plot::new((Axis::Log, Axis::Linear), ("load p*", "mean contact pressure p/(a_r E* ḡ)"), curves)
}

fn mean_gap(writer: &FigureWriter, results: &Results, with: &ContinuumResults, without: &ContinuumResults) -> Plot {
    let um = writer.scales.length_m * 1e6;
    let mut curves = paths(with, without, |s| s.mean_gap * um);
    curves.push(formula(("0.3 µm exp(−8 p*)", THEORY), &curves, Axis::Linear, |p| 0.3 * (-8.0 * p).exp()));
    let touch = results.surface.statistic(FIRST_TOUCH).map(|s| s.realised);
    let arrow = Style { dash: Dash::None, marker: Marker::Triangle, ..plot::HARD };
    curves.extend(touch.map(|h| curve("first contact, undeformed", arrow, vec![(0.0, h)])));
    Plot::new((Axis::Linear, Axis::Log), ("load p*", "mean gap ū (µm)"), curves)
}
