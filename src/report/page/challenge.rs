//! Acceptance checks of the challenge, and figures 1 to 12 of its paper.

use super::bands;
use super::curves::{branches, formula, theory};
use super::paper::{self, Data, PaperFigure, column, density};
use super::prelude::*;
use super::surface::psd;
use super::uncertainty;
use crate::challenge::{SIZE_EXPONENT, reference, summary};
use crate::record::acceptance::{AcceptanceCheck, CheckScope, CheckStatus};
use crate::report::picture::{LONGEST_SIDE, Picture};

/// Table of the acceptance checks.
pub(super) fn checks(list: &[AcceptanceCheck]) -> Markup {
    let status = |j: &AcceptanceCheck| match (j.status, j.scope) {
        (CheckStatus::Pass, CheckScope::Setup) => quiet("by set-up"),
        (CheckStatus::Pass, _) => j.status.to_string().render(),
        (CheckStatus::Fail, CheckScope::LongerRange) => bad(format!("{}, longer range", j.status)),
        (CheckStatus::Fail, _) => bad(j.status.to_string()),
        (CheckStatus::NotAssessed, _) => quiet(j.status.to_string()),
    };
    let caption = "Value (dot), expected value (line) and accepted range (band) of every assessed statement, each \
                   on its own axis; open ranges end at the other side of the expected value.";
    html! {
        p { "Statements of the paper compared with this run: " (summary(list)) "." }
        @if let Some(chart) = bands::chart(list) { (figure(chart, caption)) }
        (columns!("words", list, |j| {
            "" => j.id,
            "statement" => j.statement,
            "found" => found(j),
            "reference" => or_dash(j.reference.map(|v| in_unit(v, j))),
            "accepted" => or_dash(j.accepted(|v| in_unit(v, j))),
            "status" => status(j),
            "reason" => j.reason,
        }))
    }
}

/// A value in the unit of a check.
pub(super) fn in_unit(v: f64, check: &AcceptanceCheck) -> String {
    format!("{} {}", significant(v, 4), of_unit(&check.unit)).trim_end().to_string()
}

/// The value of a check with its error.
fn found(check: &AcceptanceCheck) -> String {
    let Some(v) = check.value else { return "–".into() };
    let (value, error) = match check.error {
        Some(e) if e > 0.0 && e < 1e-4 * v.abs() => (significant(v, 4), format!(" ± {}", significant(e, 1))),
        // The values have units with their prefix.
        Some(e) if e > 0.0 => with_error(v, e, ""),
        Some(_) => return format!("{} (exact)", in_unit(v, check)),
        None => return in_unit(v, check),
    };
    format!("{value}{error} {}", of_unit(&check.unit)).trim_end().to_string()
}

/// The figures of the paper.
pub(super) fn figures(writer: &FigureWriter, results: &Results) -> Result<Markup> {
    let (Some(adhesive), Some(without)) = (&results.continuum, &results.non_adhesive) else { return Ok(html! {}) };
    let both = Both { with: adhesive, without };
    let mut figures = Vec::new();
    let mut add = |number: usize, drawing: Option<Markup>, caption: &str| {
        figures.extend(drawing.map(|drawing| (number, drawing, caption.to_string())));
    };
    let spectrum = writer.curves("figure-01", &psd(writer, results, "prescribed"))?;
    add(1, spectrum, "Spectrum of the surface: realised and prescribed.");
    if let Some(file) = &results.surface.heights {
        let heights = writer.load(file, LONGEST_SIDE, |h| h * writer.scales.length_m)?;
        let map = writer.heights(("figure-02", "height map of the challenge’s surface"), &heights)?;
        add(2, Some(map), "The surface; dark areas touch first.");
    }
    let caption = "True contact at the reference load, without adhesion and with it, and both superposed.";
    add(3, contacts(writer, &both)?, caption);
    for kind in &paper::FIGURES {
        let plot = both.plot(writer, results, kind)?;
        let load_note = match kind.number {
            11 => ", loading and unloading",
            12 => "; the triangle marks first contact, without deformation",
            _ if kind.is_path() => "",
            _ => ", at the reference load",
        };
        let drawing = writer.curves(&format!("figure-{:02}", kind.number), &plot)?;
        add(kind.number, drawing, &format!("{}{load_note}.", kind.caption));
    }
    Ok(html! {
        p { "The figures of the challenge’s paper, from this run: with and without adhesion, loading and unloading. "
            "Loads are p* = p/(E* ḡ), the reference load is p* = 0.01." }
        @for (number, drawing, caption) in &figures {
            (figure(drawing, html! {
                (caption) " (The paper’s figure " (number) ".)"
                @if *number == 4 { br; (both.line_means(writer)?) }
                @for claim in claims(&results.acceptance, *number) { br; (claim) }
            }))
        }
    })
}

/// Statements that figures 1 to 12 of the paper support; those with letters are numbered alike.
const CLAIMS: [&[&str]; 12] = [
    &["A03"],
    &["S04"],
    &["S05", "S06"],
    &[],
    &["S14"],
    &["S15", "S16"],
    &["S17", "S18"],
    &["S21"],
    &["S22", "S23", "S24"],
    &["S05", "S06", "S07", "S10"],
    &["S08", "S09"],
    &["S11", "S12", "S13", "A01", "A02"],
];

/// Claims of a figure with our values.
fn claims(list: &[AcceptanceCheck], number: usize) -> Vec<Markup> {
    let about = |check: &&AcceptanceCheck| CLAIMS[number - 1].iter().any(|id| check.id.starts_with(id));
    let line = |j: &AcceptanceCheck| {
        let value = |v: f64| in_unit(v, j);
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

/// The solutions with adhesion and without.
struct Both<'a> {
    with: &'a ContinuumResults,
    without: &'a ContinuumResults,
}

/// Colours of their superposed contact maps.
const BOTH: [(Rgb, &str); 3] = [(BLACK, "both"), (ORANGE, "only without adhesion"), (BLUE, "only with adhesion")];

fn contacts(writer: &FigureWriter, both: &Both) -> Result<Option<Markup>> {
    let gap_of = |c| reference(c).and_then(|s| s.gap_file()).map(|file| writer.closed(file, LONGEST_SIDE));
    let (Some(plain), Some(adhesive)) = (gap_of(both.without).transpose()?, gap_of(both.with).transpose()?) else {
        return Ok(None);
    };
    let draw = |part: &str, title: &str, picture: &Picture| -> Result<Markup> {
        let map = writer.map((&format!("figure-03-{part}"), title), picture, writer.scales.length_m)?;
        Ok(panel(title, map, ""))
    };
    let maps = [
        draw("without", "Without adhesion", &picture::contact(&plain, ORANGE))?,
        draw("with", "With adhesion", &picture::contact(&adhesive, BLUE))?,
        draw("superposed", "Superposed", &picture::superposed(&plain, &adhesive)?.keyed(&BOTH))?,
    ];
    Ok(Some(panels(maps.len(), &maps)))
}

impl Both<'_> {
    /// A figure of the paper with its theory.
    fn plot(&self, writer: &FigureWriter, results: &Results, kind: &PaperFigure) -> Result<Plot> {
        let mut curves = Vec::new();
        for (c, label, style) in [(self.with, "with adhesion", ATOMS), (self.without, "without", WITHOUT)] {
            match kind.data {
                Data::Path(of) => {
                    let point = |s: &State| (s.p_star, of(s).unwrap_or(f64::NAN));
                    curves.extend(branches(c, (label, style), &point));
                }
                Data::State(of) => {
                    let points = reference(c).map(|s| of(writer, s)).transpose()?;
                    curves.push(Curve::line(label, style, points.unwrap_or_default()));
                }
            }
        }
        match kind.number {
            6 => curves.extend(middle_slope(&curves[0])),
            9 => {
                let part =
                    reference(self.with).and_then(|s| s.observed.as_ref()).and_then(|o| o.contact_stress.as_ref());
                let curve = density(part, 1.0 / writer.scales.modulus_pa);
                curves.extend(part.map(|_| Curve::line("with adhesion, contact only", HARD, curve)));
            }
            10 => {
                let (label, theory) = theory(self.without, writer.scales.modulus_pa);
                curves.push(formula((&label, EXPECTED), &curves, true, theory));
            }
            12 => {
                curves.push(formula(("0.3 µm exp(−8 p*)", EXPECTED), &curves, false, |p| 0.3 * (-8.0 * p).exp()));
                let touch = results.surface.statistic(FIRST_TOUCH).map(|s| s.realised);
                let arrow = Style { dash: Dash::None, marker: Marker::Triangle, ..HARD };
                curves.extend(touch.map(|h| Curve::new("first contact, undeformed", arrow, [(0.0, h)])));
                // First contact is at no load.
                return Ok(Plot { x: linear(kind.x.1), ..kind.plot(curves) });
            }
            _ => {}
        }
        Ok(kind.plot(curves))
    }

    /// Mean gaps along the line of figure 4, with the relative uncertainty of the mean gap of the cell.
    fn line_means(&self, writer: &FigureWriter) -> Result<Markup> {
        let mean = |c: &ContinuumResults| -> Result<Option<String>> {
            let Some(state) = reference(c) else { return Ok(None) };
            let points = column(writer, state.gap_file(), writer.scales.length_m * UM)?;
            let mean = points.iter().map(|p| p.1).sum::<f64>() / points.len().max(1) as f64;
            let text = match uncertainty::total(state, Quantity::MeanGap) {
                Some(r) => {
                    let (value, error) = with_error(mean, r * mean, "");
                    format!("{value}{error} µm")
                }
                None => format!("{} µm (error not known)", significant(mean, 3)),
            };
            Ok((!points.is_empty()).then_some(text))
        };
        Ok(html! {
            @if let (Some(adhesive), Some(without)) = (mean(self.with)?, mean(self.without)?) {
                "Mean gap along this line: " strong { (adhesive) } " with adhesion, " strong { (without) } " without; the errors are the relative "
                "uncertainty of the mean gap of the cell."
            }
        })
    }
}

/// The exponent of the paper, through the middle point of a curve.
fn middle_slope(curve: &Curve) -> Option<Curve> {
    let middle = curve.points.get(curve.points.len() / 2)?;
    let point_at = |p: &(f64, f64)| (p.0, middle.1 * (p.0 / middle.0).powf(SIZE_EXPONENT));
    Some(Curve::new("a^−1.45", EXPECTED, curve.points.iter().map(point_at)))
}
