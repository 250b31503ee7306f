//! Comparison of methods: tables of all loads, and figures 4 to 12 of the paper.

use std::collections::BTreeMap;

use super::curves::leaves_out_adhesion;
use super::paper::{FIGURES, PaperFigure};
use super::prelude::*;
use crate::record::methods::MethodResults;
use crate::scene::REFERENCE_LOAD;
use asperity_contact::load::at_step;

/// Style of the scene's own method in every panel, with and without adhesion.
const OWN: Style = Style { colour: picture::GREY, dash: Dash::Solid, marker: Marker::None };
const OWN_WITHOUT: Style = Style { dash: Dash::Dashed, ..OWN };

/// Panels per row, and height over width of a panel.
const ROW: usize = 4;
const PROPORTION: f64 = 0.7;
/// Axis range beyond the values of the scene's own method: in decades (logarithmic), or over their range (linear).
const BEYOND_DECADES: f64 = 1.0;
const BEYOND: f64 = 0.5;

/// States of the scene's own method.
struct Own {
    with: Vec<State>,
    without: Vec<State>,
}

impl Own {
    fn of(results: &Results) -> Self {
        let states = |c: &Option<ContinuumResults>| c.iter().flat_map(ContinuumResults::loading).cloned().collect();
        let (first, second) = (states(&results.continuum), states(&results.non_adhesive));
        match results.continuum.as_ref().is_some_and(|c| c.range.is_some()) {
            true => Own { with: first, without: second },
            false => Own { with: Vec::new(), without: first },
        }
    }

    fn like(&self, adhesive: bool) -> &[State] {
        if adhesive { &self.with } else { &self.without }
    }
}

/// Number of loads with figures; a page with more is slow in browsers.
const DRAWN: usize = 4;

/// Index and p* of the loads of all methods, and position of the load nearest to the reference load.
fn loads(results: &Results) -> (Vec<(usize, f64)>, usize) {
    let states = results.methods.iter().flat_map(|m| &m.states);
    let loads: BTreeMap<usize, f64> = states.map(|s| (s.index, s.p_star)).collect();
    let mut loads: Vec<(usize, f64)> = loads.into_iter().collect();
    loads.sort_by(|a, b| a.1.total_cmp(&b.1));
    let deviation = |p: f64| (p.max(f64::MIN_POSITIVE) / REFERENCE_LOAD).ln().abs();
    let nearest =
        (0..loads.len()).min_by(|&a, &b| deviation(loads[a].1).total_cmp(&deviation(loads[b].1))).unwrap_or(0);
    (loads, nearest)
}

/// Whether figures of load `k` are drawn: the load nearest to the reference, and others at equal intervals.
fn is_drawn(k: usize, nearest: usize, count: usize) -> bool {
    let others = DRAWN - 1;
    let place = if k < nearest { k } else { k.saturating_sub(1) };
    count <= DRAWN || k == nearest || (0..others).any(|d| place == d * (count - 2) / (others - 1))
}

pub(super) fn section(writer: &FigureWriter, results: &Results) -> Result<Markup> {
    let own = Own::of(results);
    let page = Page { writer, results, own: &own };
    let (loads, nearest) = loads(results);
    let mut of_loads = Vec::new();
    for (k, &(index, p)) in loads.iter().enumerate() {
        let shown = FIGURES.iter().filter(|f| !f.is_path() && is_drawn(k, nearest, loads.len()));
        let figures = shown.map(|kind| page.figure(kind, Some((index, p)))).collect::<Result<Vec<_>>>()?;
        of_loads.push(html! {
            details open[k == nearest] {
                summary { (writer.loads.label(p)) @if figures.is_empty() { " (table only)" } }
                (page.numbers(Some(index)))
                (each(&figures))
            }
        });
    }
    let paths = FIGURES.iter().filter(|f| f.is_path() || loads.is_empty());
    let paths = paths.map(|kind| page.figure(kind, None)).collect::<Result<Vec<_>>>()?;
    Ok(html! {
        p { "Deviations are from " (own_name(results))
            " Areas are by each method’s own criterion." }
        p.quiet { "Blue, solid: with the scene’s adhesion; orange, dashed: without. Below each figure: what it does not show, and why." }
        @if loads.is_empty() { (page.numbers(None)) }
        (each(&of_loads))
        (notes(results))
        (each(&paths))
    })
}

/// What all figures and tables of the comparison share.
struct Page<'a> {
    writer: &'a FigureWriter<'a>,
    results: &'a Results,
    own: &'a Own,
}

impl Page<'_> {
    /// A figure with a panel for each method.
    fn figure(&self, kind: &PaperFigure, load: Option<(usize, f64)>) -> Result<Markup> {
        let (mut drawn, mut empty): (Vec<Markup>, Vec<(String, Vec<String>)>) = Default::default();
        for id in distinct(self.results.methods.iter().map(|m| &m.method)) {
            let runs: Vec<_> = self.results.methods.iter().filter(|m| m.method == *id).collect();
            match self.cell(kind, load, &runs)? {
                FigurePanel::Panel(panel) => drawn.push(panel),
                FigurePanel::Empty { title, why } => match empty.iter_mut().find(|e| e.0 == why) {
                    Some((_, titles)) => titles.push(title),
                    None => empty.push((why, vec![title])),
                },
            }
        }
        let caption = html! {
            (kind.caption) @if let Some((_, p)) = load { ", at " (self.writer.loads.label(p)) }
            ". Grey: " (own_name(self.results)) " (The paper’s figure " (kind.number) ".)"
            @for (why, titles) in &empty { br; "Not available (" (why) "): " (titles.join(", ")) "." }
        };
        Ok(figure(panels(ROW, &drawn), caption))
    }

    /// Table of all methods at one load.
    fn numbers(&self, index: Option<usize>) -> Markup {
        let Page { writer, results, own } = self;
        let micron = |g: f64| format!("{} µm", significant(g * UM, 3));
        let reduced = |k: f64| significant(k / writer.scales.stiffness(), 3);
        let area = |a: f64| format!("{} µm²", significant(a * UM * UM, 3));
        let off = |value: f64, reference: Option<f64>| match reference.filter(|r| *r != 0.0) {
            None => String::new(),
            Some(r) if (value / r - 1.0).abs() < 0.005 => " (0 %)".into(),
            Some(r) => format!(" ({:+.0} %)", 100.0 * (value / r - 1.0)).replace('-', "−"),
        };
        let median = |s: &State| s.observed.as_ref()?.median_cluster_area;
        let adhesion = |with: bool| if with { "with" } else { "without" };
        let own_row = |adhesive: bool| {
            let s = at_step(own.like(adhesive), index?)?;
            let mut solved = results.continuum.iter().chain(&results.non_adhesive);
            let solved = solved.find(|c| c.range.is_some() == adhesive);
            let error = solved.and_then(|c| at_step(&c.states, index?)?.discretisation?.area);
            let error = error.map(|e| format!(" ± {} by the grid", percent(e * s.contact_area)));
            Some(row![
                html! { strong { (results.continuum.as_ref().map_or("", |c| &c.method)) } },
                adhesion(adhesive),
                results.continuum.iter().flat_map(|c| &c.states).next().map_or("", |s| &s.criterion),
                html! { (percent(s.contact_area)) (quiet(error.unwrap_or_default())) },
                or_dash(s.mean_gap.map(micron)),
                or_dash(s.stiffness.map(reduced)),
                or_dash(median(s).map(area)),
                "",
            ])
        };
        let row = |m: &MethodResults| {
            let state_of = |states| index.and_then(|index| at_step(states, index));
            let (here, reference) = (state_of(m.states.as_slice()), state_of(own.like(m.adhesive)));
            type Of<'a> = &'a dyn Fn(&State) -> Option<f64>;
            let with = |quantity: Quantity, of: Of, show: &dyn Fn(f64) -> String| match here.and_then(of) {
                Some(v) => html! { (show(v)) (quiet(off(v, reference.and_then(of)))) },
                None => {
                    let missing = here.and_then(|s| s.missing.get(&quantity)).or_else(|| m.missing.get(&quantity));
                    html! { "–" @if let Some(reason) = missing { " " (quiet(format!("({reason})"))) } }
                }
            };
            let mut cells =
                row![html! { (m.method) @if m.calibrated_on.is_some() { "*" } }, adhesion(m.adhesive), m.criterion];
            if here.is_none() && !m.states.is_empty() {
                cells.push(quiet("no result at this load"));
            } else if here.is_some() {
                let presses = here.and_then(|s| s.contact_nodes_compressive);
                let presses = presses.map(|presses| quiet(format!(" ({} under compression)", percent(presses))));
                cells.extend(row![
                html! { (with(Quantity::ContactArea, &|s| Some(s.contact_area), &percent)) (presses.unwrap_or_default()) },
                with(Quantity::MeanGap, &|s| s.mean_gap, &micron),
                with(Quantity::Stiffness, &|s| s.stiffness, &reduced),
                with(Quantity::ClusterPdf, &median, &area),
                duration(m.cpu_seconds),
            ]);
            }
            cells
        };
        let [first, last] = [
            ["method", "adhesion", "criterion", "contact"],
            ["mean gap", "stiffness (E*/L)", "median cluster area", "CPU, all loads"],
        ];
        let own_rows = [true, false].into_iter().filter_map(own_row);
        table("words", &[first, last].concat(), own_rows.chain(results.methods.iter().map(row)))
    }

    /// Panel of a method at one load or over all loads; if there is none, the reason.
    fn cell(&self, kind: &PaperFigure, load: Option<(usize, f64)>, runs: &[&MethodResults]) -> Result<FigurePanel> {
        let points = |states| kind.points(self.writer, load.map(|(index, _)| index), states);
        let first = runs.first().expect("ids are those of runs");
        let title = format!("{}: {}", first.method, first.paper_name);
        let mut drawn_curves = Vec::new();
        for run in runs {
            let style = if run.adhesive { ATOMS } else { WITHOUT };
            let style = if kind.is_path() { style } else { style.without_marker() };
            drawn_curves.push(Curve::new("", style, points(&run.states)?));
        }
        drawn_curves.retain(|curve| !curve.points.is_empty());
        let missing = |run: &MethodResults| run.missing.get(&kind.needs).cloned();
        let reasons =
            distinct(runs.iter().filter_map(|run| run.unavailable_reason.clone().or_else(|| missing(run)))).join("; ");
        if drawn_curves.is_empty() {
            let unknown = "its maps are not kept at this load, or have nothing on this line".into();
            return Ok(FigurePanel::Empty { title, why: if reasons.is_empty() { unknown } else { reasons } });
        }
        let mut curves = Vec::new();
        for (style, states) in [(OWN, &self.own.with), (OWN_WITHOUT, &self.own.without)] {
            curves.push(Curve::new("", style, points(states)?));
        }
        let plot = kind.plot(Vec::new());
        let bounds = [bounds(&plot.x, &curves, |p| p.0), bounds(&plot.y, &curves, |p| p.1)];
        for curve in &mut drawn_curves {
            let inside = |v: f64, [low, high]: [f64; 2]| (low..=high).contains(&v);
            curve.points.retain(|p| inside(p.0, bounds[0]) && inside(p.1, bounds[1]));
        }
        curves.extend(drawn_curves);
        let plot = Plot { width: PANEL, proportion: PROPORTION, curves, ..plot };
        let plot = if kind.is_path() { plot.against(self.writer.loads) } else { plot };
        let of_load = load.map_or(String::new(), |(k, _)| format!("-load-{}", k + 1));
        Ok(match self.writer.curves(&format!("methods-{}-{}{of_load}", kind.name, first.method), &plot)? {
            Some(drawn) => FigurePanel::Panel(panel(&title, drawn, reasons)),
            None => FigurePanel::Empty { title, why: "no values in the range of the axes".into() },
        })
    }
}

/// Name of the grey curves.
fn own_name(results: &Results) -> String {
    match results.continuum.as_ref() {
        Some(c) if c.range.is_some() => format!("{} of the scene, dashed without adhesion.", c.method),
        Some(c) => format!("{} of the scene.", c.method),
        None => "nothing: no solver ran.".into(),
    }
}

/// Notes for all loads: unavailable methods, ranges of adhesion, fitted constants.
fn notes(results: &Results) -> Markup {
    let calibrated =
        results.methods.iter().filter_map(|m| Some(format!("{}: {}", m.method, m.calibrated_on.as_ref()?)));
    let fitted = distinct(calibrated);
    html! {
        @for m in &results.methods {
            @if let Some(reason) = &m.warning { p.quiet { (m.method) " " (reason) "." } }
            @if let Some(reason) = &m.unavailable_reason { p.quiet { (m.method) @if leaves_out_adhesion(results, m) { " without adhesion" } ": not available: " (reason) "." } }
        }
        @for (m, range) in results.methods.iter().filter_map(|m| Some((m, m.range?))).filter(|(_, r)| r.used != r.requested) {
            p.quiet { (m.method) " uses a range of adhesion of " (length(range.used, 3))
                " on this grid; requested: " (length(range.requested, 3)) "." }
        }
        @if !fitted.is_empty() { p.quiet { "*: with fitted constants. " (fitted.join("; ")) "." } }
    }
}

/// Panel of a figure.
enum FigurePanel {
    Panel(Markup),
    Empty { title: String, why: String },
}

/// Axis limits around the values of the scene's own method; unlimited if it has none.
fn bounds(axis: &AxisScale, own: &[Curve], value: fn(&(f64, f64)) -> f64) -> [f64; 2] {
    let shown = |v: &f64| v.is_finite() && (!axis.log || *v > 0.0);
    match ends(own.iter().flat_map(|c| &c.points).map(value).filter(shown)) {
        (low, high) if low > high => [f64::NEG_INFINITY, f64::INFINITY],
        (low, high) if axis.log => [low * 10f64.powf(-BEYOND_DECADES), high * 10f64.powf(BEYOND_DECADES)],
        (low, high) => [low - BEYOND * (high - low), high + BEYOND * (high - low)],
    }
}
