//! Comparison of methods: tables of all loads, and figures 4 to 12 of the paper.

use std::collections::BTreeMap;

use maud::{Markup, html};

use super::figures::{self, FigureWriter, figure, panel, panels, text};
use crate::error::Result;
use crate::grid::Grid;
use crate::load::at_step;
use crate::method::Quantity;
use crate::observe::column_at;
use crate::record::methods::{MethodResults, MethodState, loading_states};
use crate::record::npy;
use crate::record::results::{ContinuumResults, Results};
use crate::report::number::{duration, percent, si, significant, trimmed};
use crate::report::picture;
use crate::report::plot::{self, Axis, Curve, Dash, Marker, PANEL, Plot, Style};
use crate::scene::REFERENCE_LOAD;

/// Style of the scene's own method in every panel, with and without adhesion.
const OWN: Style = Style { colour: picture::GREY, dash: Dash::Solid, marker: Marker::None };
const OWN_WITHOUT: Style = Style { dash: Dash::Dashed, ..OWN };
const WITH: Style = plot::ATOMS;
const WITHOUT: Style = plot::WITHOUT;

/// Panels per row, and height over width of a panel.
const ROW: usize = 4;
const PROPORTION: f64 = 0.7;
/// Position of the sections, over L.
const SECTION: f64 = 0.5;
/// Stresses over the mean pressure below which a profile is not drawn.
const NOISE: f64 = 1e-3;
/// Axis range beyond the values of the scene's own method: in decades (logarithmic), or over their range (linear).
const BEYOND_DECADES: f64 = 1.0;
const BEYOND: f64 = 0.5;

/// Plotted quantity.
#[derive(Clone, Copy)]
enum Shown {
    /// Profiles along the section.
    Gap,
    Stress,
    /// Pr(a), CPr(a), Pr(u), Pr(σ).
    Sizes,
    Shares,
    Gaps,
    Stresses,
    /// Curves against the load.
    Area,
    Pressure,
    MeanGap,
}

/// A figure of the paper with one panel per method.
struct Figure {
    /// Number in the paper.
    number: usize,
    shows: Shown,
    name: &'static str,
    caption: &'static str,
    needs: Quantity,
    axes: (Axis, Axis),
    labels: (&'static str, &'static str),
    /// Whether the figure is a curve over all loads; otherwise it shows a single load.
    path: bool,
}

const FIGURES: [Figure; 9] = [
    Figure {
        number: 4,
        shows: Shown::Gap,
        name: "gap-section",
        caption: "Gap along y at x = L/2",
        needs: Quantity::GapMap,
        axes: (Axis::Linear, Axis::Linear),
        labels: ("y (µm)", "gap u (µm)"),
        path: false,
    },
    Figure {
        number: 5,
        shows: Shown::Stress,
        name: "stress-section",
        caption: "Interfacial stress along y at x = L/2",
        needs: Quantity::StressMap,
        axes: (Axis::Linear, Axis::Linear),
        labels: ("y (µm)", "stress σ/E*"),
        path: false,
    },
    Figure {
        number: 6,
        shows: Shown::Sizes,
        name: "cluster-sizes",
        caption: "Pr(a), density of clusters of an area",
        needs: Quantity::PatchPdf,
        axes: (Axis::Log, Axis::Log),
        labels: ("area a (µm²)", "Pr(a) (1/µm²)"),
        path: false,
    },
    Figure {
        number: 7,
        shows: Shown::Shares,
        name: "cluster-area",
        caption: "CPr(a), fraction of the contact in clusters up to an area",
        needs: Quantity::PatchPdf,
        axes: (Axis::Log, Axis::Linear),
        labels: ("area a (µm²)", "CPr(a)"),
        path: false,
    },
    Figure {
        number: 8,
        shows: Shown::Gaps,
        name: "gaps",
        caption: "Pr(u), distribution of the gap out of contact",
        needs: Quantity::GapPdf,
        axes: (Axis::Log, Axis::Log),
        labels: ("gap u (µm)", "Pr(u) (1/µm)"),
        path: false,
    },
    Figure {
        number: 9,
        shows: Shown::Stresses,
        name: "stresses",
        caption: "Pr(σ), distribution of the interfacial stress",
        needs: Quantity::StressPdf,
        axes: (Axis::Linear, Axis::Log),
        labels: ("stress σ/E*", "Pr(σ) E*"),
        path: false,
    },
    Figure {
        number: 10,
        shows: Shown::Area,
        name: "area",
        caption: "Relative contact area against load",
        needs: Quantity::ContactArea,
        axes: (Axis::Log, Axis::Log),
        labels: ("load p*", "area a_r"),
        path: true,
    },
    Figure {
        number: 11,
        shows: Shown::Pressure,
        name: "contact-pressure",
        caption: "Mean contact pressure against load",
        needs: Quantity::ContactArea,
        axes: (Axis::Log, Axis::Linear),
        labels: ("load p*", "p/(a_r E* ḡ)"),
        path: true,
    },
    Figure {
        number: 12,
        shows: Shown::MeanGap,
        name: "mean-gap",
        caption: "Mean gap against load",
        needs: Quantity::MeanGap,
        axes: (Axis::Log, Axis::Log),
        labels: ("load p*", "mean gap ū (µm)"),
        path: true,
    },
];

/// States of the scene's own method.
struct Own {
    with: Vec<MethodState>,
    without: Vec<MethodState>,
}

impl Own {
    fn of(results: &Results) -> Self {
        let states = |c: &Option<ContinuumResults>| c.as_ref().map(loading_states).unwrap_or_default();
        let (first, second) = (states(&results.continuum), states(&results.non_adhesive));
        match results.continuum.as_ref().is_some_and(|c| c.range.is_some()) {
            true => Own { with: first, without: second },
            false => Own { with: Vec::new(), without: first },
        }
    }

    fn like(&self, adhesive: bool) -> &[MethodState] {
        if adhesive { &self.with } else { &self.without }
    }
}

/// Number of loads with figures; a page with more is slow in browsers.
const DRAWN: usize = 4;

/// Index and p* of the loads of all methods, and position of the load nearest to the reference load.
fn loads(results: &Results) -> (Vec<(usize, f64)>, usize) {
    let states = results.methods.iter().flat_map(|m| &m.states);
    let loads: BTreeMap<usize, f64> = states.map(|s| (s.numbers.index, s.numbers.p_star)).collect();
    let mut loads: Vec<(usize, f64)> = loads.into_iter().collect();
    loads.sort_by(|a, b| a.1.total_cmp(&b.1));
    let off = |p: f64| (p.max(f64::MIN_POSITIVE) / REFERENCE_LOAD).ln().abs();
    let nearest = (0..loads.len()).min_by(|&a, &b| off(loads[a].1).total_cmp(&off(loads[b].1))).unwrap_or(0);
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
    let mut ids: Vec<&str> = Vec::new();
    for m in &results.methods {
        if !ids.contains(&m.method.as_str()) {
            ids.push(&m.method);
        }
    }
    let draw = |kind: &Figure, load: Option<(usize, f64)>| -> Result<Markup> {
        let (mut drawn, mut empty): (Vec<Markup>, Vec<(String, Vec<String>)>) = Default::default();
        for id in &ids {
            let runs = results.methods.iter().filter(|m| m.method == *id).collect();
            match cell(writer, kind, load, &own, runs)? {
                Cell::Panel(panel) => drawn.push(panel),
                Cell::Empty { title, why } => match empty.iter_mut().find(|e| e.0 == why) {
                    Some((_, titles)) => titles.push(title),
                    None => empty.push((why, vec![title])),
                },
            }
        }
        let of = load.map_or(String::new(), |(_, p)| format!(", at p* = {}", trimmed(p, 4)));
        let caption = html! {
            (kind.caption) (of) ". Grey: " (own_name(results)) " (The paper’s figure " (kind.number) ".)"
            @for (why, titles) in &empty { br; "Not available (" (why) "): " (titles.join(", ")) "." }
        };
        Ok(figure(panels(ROW, &drawn), caption))
    };
    let (loads, nearest) = loads(results);
    let mut of_loads = Vec::new();
    for (k, &(index, p)) in loads.iter().enumerate() {
        let mut figures = Vec::new();
        for kind in FIGURES.iter().filter(|f| !f.path && is_drawn(k, nearest, loads.len())) {
            figures.push(draw(kind, Some((index, p)))?);
        }
        of_loads.push(html! {
            details open[k == nearest] {
                summary { "p* = " (trimmed(p, 4)) @if figures.is_empty() { " (table only)" } }
                (table(writer, results, &own, Some(index)))
                @for f in &figures { (f) }
            }
        });
    }
    let mut paths = Vec::new();
    for kind in FIGURES.iter().filter(|f| f.path || loads.is_empty()) {
        paths.push(draw(kind, None)?);
    }
    Ok(html! {
        p { "Deviations are from " (own_name(results))
            " Areas are by each method’s own criterion." }
        p.quiet { "Blue, solid: with the scene’s adhesion; orange, dashed: without. Below each figure: what it does not show, and why." }
        @if loads.is_empty() { (table(writer, results, &own, None)) }
        @for load in &of_loads { (load) }
        (notes(writer, results))
        @for f in &paths { (f) }
    })
}

/// Name of the grey curves.
fn own_name(results: &Results) -> String {
    match results.continuum.as_ref() {
        Some(c) if c.range.is_some() => format!("{} of the scene, dashed without adhesion.", c.method),
        Some(c) => format!("{} of the scene.", c.method),
        None => "nothing: no solver ran.".into(),
    }
}

/// Table of all methods at one load.
fn table(writer: &FigureWriter, results: &Results, own: &Own, index: Option<usize>) -> Markup {
    let um = writer.scales.length_m * 1e6;
    let off = |found: f64, reference: Option<f64>| match reference.filter(|r| *r != 0.0) {
        None => String::new(),
        Some(r) if (found / r - 1.0).abs() < 0.005 => " (0 %)".into(),
        Some(r) => format!(" ({:+.0} %)", 100.0 * (found / r - 1.0)).replace('-', "−"),
    };
    let grid = |adhesive: bool| {
        let solved = results.continuum.iter().chain(&results.non_adhesive).find(|c| c.range.is_some() == adhesive)?;
        at_step(&solved.states, index?)?.discretisation?.area
    };
    let own_row = |adhesive: bool| {
        let s = at_step(own.like(adhesive), index?)?;
        let error =
            grid(adhesive).map_or(String::new(), |e| format!(" ± {} by the grid", percent(e * s.numbers.contact_area)));
        Some(vec![
            html! { strong { (results.continuum.as_ref().map_or("", |c| &c.method)) } },
            text(if adhesive { "with" } else { "without" }),
            text(results.continuum.iter().flat_map(|c| &c.states).next().map_or("", |s| &s.criterion)),
            html! { (percent(s.numbers.contact_area)) span.quiet { (error) } },
            text(s.mean_gap.map_or("–".into(), |g| format!("{} µm", significant(g * um, 3)))),
            text(s.numbers.stiffness.map_or("–".into(), |k| significant(k, 3))),
            text(s.median_cluster_area.map_or("–".into(), |a| format!("{} µm²", significant(a * um * um, 3)))),
            text(""),
        ])
    };
    let row = |m: &MethodResults| {
        let at = |states| index.and_then(|index| at_step(states, index));
        let (here, reference) = (at(m.states.as_slice()), at(own.like(m.adhesive)));
        type Of<'a> = &'a dyn Fn(&MethodState) -> Option<f64>;
        let with = |quantity: Quantity, of: Of, show: &dyn Fn(f64) -> String| match here.and_then(of) {
            Some(v) => html! { (show(v)) span.quiet { (off(v, reference.and_then(of))) } },
            None => {
                match here.iter().flat_map(|s| &s.missing).chain(&m.missing).find(|m| m.quantity == quantity.id()) {
                    Some(missing) => html! { "– " span.quiet { "(" (missing.reason) ")" } },
                    None => text("–"),
                }
            }
        };
        let mut cells = vec![
            html! { (m.method) @if m.calibrated_on.is_some() { "*" } },
            text(if m.adhesive { "with" } else { "without" }),
            text(&m.criterion),
        ];
        if here.is_none() && !m.states.is_empty() {
            cells.push(html! { span.quiet { "no result at this load" } });
        } else if here.is_some() {
            cells.extend([
                html! {
                    (with(Quantity::ContactArea, &|s| Some(s.numbers.contact_area), &percent))
                    @if let Some(presses) = here.and_then(|s| s.contact_nodes_compressive) {
                        span.quiet { " (" (percent(presses)) " under compression)" }
                    }
                },
                with(Quantity::MeanGap, &|s| s.mean_gap, &|g| format!("{} µm", significant(g * um, 3))),
                with(Quantity::Stiffness, &|s| s.numbers.stiffness, &|k| significant(k, 3)),
                with(Quantity::PatchPdf, &|s| s.median_cluster_area, &|a| {
                    format!("{} µm²", significant(a * um * um, 3))
                }),
                text(duration(m.cpu_seconds)),
            ]);
        }
        cells
    };
    let head = [
        "method",
        "adhesion",
        "criterion",
        "contact",
        "mean gap",
        "stiffness (E*/L)",
        "median cluster area",
        "CPU, all loads",
    ];
    figures::table(
        &head,
        [true, false].into_iter().filter_map(own_row).chain(results.methods.iter().map(row)).collect(),
    )
}

/// Notes for all loads: unavailable methods, ranges of adhesion, fitted constants.
fn notes(writer: &FigureWriter, results: &Results) -> Markup {
    let fitted: Vec<String> = results
        .methods
        .iter()
        .filter_map(|m| m.calibrated_on.as_ref().map(|what| format!("{}: {what}", m.method)))
        .fold(Vec::new(), |mut all, line| {
            if !all.contains(&line) {
                all.push(line);
            }
            all
        });
    html! {
        @for m in &results.methods {
            @if let Some(why) = &m.warning { p.quiet { (m.method) " " (why) "." } }
            @if let Some(why) = &m.unavailable_reason { p.quiet { (m.method) @if !m.adhesive { " without adhesion" } ": not available: " (why) "." } }
        }
        @for (m, range) in results.methods.iter().filter_map(|m| Some((m, m.range?))).filter(|(_, r)| r.used != r.requested) {
            p.quiet { (m.method) " uses a range of adhesion of " (si(range.used * writer.scales.length_m, "m", 3))
                " on this grid; requested: " (si(range.requested * writer.scales.length_m, "m", 3)) "." }
        }
        @if !fitted.is_empty() { p.quiet { "*: with fitted constants. " (fitted.join("; ")) "." } }
    }
}

/// Panel of a figure.
enum Cell {
    Panel(Markup),
    Empty { title: String, why: String },
}

/// Panel of a method at one load or over all loads; if there is none, the reason.
fn cell(
    writer: &FigureWriter,
    kind: &Figure,
    load: Option<(usize, f64)>,
    own: &Own,
    runs: Vec<&MethodResults>,
) -> Result<Cell> {
    let first = runs.first().expect("ids are those of runs");
    let title = format!("{}: {}", first.method, first.paper_name);
    let mut found = Vec::new();
    for run in &runs {
        let points = points(writer, kind, load, &run.states)?;
        if !points.is_empty() {
            let style = if run.adhesive { WITH } else { WITHOUT };
            let style = if kind.path { style } else { style.without_marker() };
            found.push(Curve { label: String::new(), style, points });
        }
    }
    let quantity = kind.needs.id();
    let mut reasons: Vec<String> = Vec::new();
    for run in &runs {
        let missing = run.missing.iter().find(|m| m.quantity == quantity).map(|m| m.reason.clone());
        reasons.extend(run.unavailable_reason.clone().or(missing).filter(|why| !reasons.contains(why)));
    }
    if found.is_empty() {
        let why = if reasons.is_empty() {
            "its maps are not kept at this load, or have nothing on this line".into()
        } else {
            reasons.join("; ")
        };
        return Ok(Cell::Empty { title, why });
    }
    let mut curves = Vec::new();
    for (style, states) in [(OWN, &own.with), (OWN_WITHOUT, &own.without)] {
        curves.push(Curve { label: String::new(), style, points: points(writer, kind, load, states)? });
    }
    let bounds = [bounds(kind.axes.0, &curves, |p| p.0), bounds(kind.axes.1, &curves, |p| p.1)];
    for curve in &mut found {
        let inside = |v: f64, [low, high]: [f64; 2]| (low..=high).contains(&v);
        curve.points.retain(|p| inside(p.0, bounds[0]) && inside(p.1, bounds[1]));
    }
    curves.extend(found);
    let plot = Plot { width: PANEL, proportion: PROPORTION, ..Plot::new(kind.axes, kind.labels, curves) };
    let of_load = load.map_or(String::new(), |(k, _)| format!("-load-{}", k + 1));
    Ok(match writer.curves(&format!("methods-{}-{}{of_load}", kind.name, first.method), &plot)? {
        Some(drawn) => Cell::Panel(panel(&title, drawn, html! { (reasons.join("; ")) })),
        None => Cell::Empty { title, why: "no values in the range of the axes".into() },
    })
}

/// Axis limits around the values of the scene's own method; unlimited if it has none.
fn bounds(axis: Axis, own: &[Curve], of: fn(&(f64, f64)) -> f64) -> [f64; 2] {
    let shown = |v: &f64| v.is_finite() && (axis == Axis::Linear || *v > 0.0);
    let values = own.iter().flat_map(|c| &c.points).map(of).filter(shown);
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    match axis {
        _ if low > high => [f64::NEG_INFINITY, f64::INFINITY],
        Axis::Log => [low * 10f64.powf(-BEYOND_DECADES), high * 10f64.powf(BEYOND_DECADES)],
        Axis::Linear => [low - BEYOND * (high - low), high + BEYOND * (high - low)],
    }
}

/// Points of a method in a figure, at a load if the figure shows a single load.
fn points(
    writer: &FigureWriter,
    kind: &Figure,
    load: Option<(usize, f64)>,
    states: &[MethodState],
) -> Result<Vec<(f64, f64)>> {
    let um = writer.scales.length_m * 1e6;
    let along = |of: &dyn Fn(&MethodState) -> Option<f64>| -> Vec<(f64, f64)> {
        states.iter().filter_map(|s| Some((s.numbers.p_star, of(s)?))).collect()
    };
    match kind.shows {
        Shown::Area => return Ok(along(&|s| Some(s.numbers.contact_area))),
        Shown::Pressure => {
            return Ok(along(&|s| (s.numbers.contact_area > 0.0).then(|| s.numbers.p_star / s.numbers.contact_area)));
        }
        Shown::MeanGap => return Ok(along(&|s| s.mean_gap.map(|g| g * um))),
        _ => {}
    }
    let Some(here) = load.and_then(|(index, _)| at_step(states, index)) else { return Ok(Vec::new()) };
    Ok(match kind.shows {
        Shown::Gap => column(writer, here.numbers.gap_map.as_deref(), um)?,
        Shown::Stress => {
            let found = column(writer, here.numbers.stress_map.as_deref(), 1.0)?;
            // A section without contact has only rounding errors of stresses.
            let most = found.iter().map(|p| p.1.abs()).fold(0.0, f64::max);
            if most < NOISE * here.numbers.pressure.abs() { Vec::new() } else { found }
        }
        Shown::Sizes => here.patch_density.iter().map(|[a, d, _]| (a * um * um, d / (um * um))).collect(),
        Shown::Shares => here.patch_area.iter().map(|[a, share]| (a * um * um, *share)).collect(),
        Shown::Gaps => here.gap.as_ref().map_or(Vec::new(), |d| d.density_in(um)),
        Shown::Stresses => here.stress.as_ref().map_or(Vec::new(), |d| d.density_in(1.0)),
        Shown::Area | Shown::Pressure | Shown::MeanGap => unreachable!("against the load, above"),
    })
}

/// A column of a stored map: position along y (µm) and value times `unit`.
pub(super) fn column(writer: &FigureWriter, file: Option<&str>, unit: f64) -> Result<Vec<(f64, f64)>> {
    let Some(file) = file else { return Ok(Vec::new()) };
    let um = writer.scales.length_m * 1e6;
    // Read row by row, because the whole map may not fit into memory.
    let map = npy::Reader::open(&writer.field(file)?)?;
    let grid = Grid { nx: map.nx, ny: map.ny, lx: 1.0, ly: writer.aspect };
    let at = column_at(grid, SECTION);
    let mut points = Vec::with_capacity(grid.ny);
    map.for_each_row(|y, row| points.push((y as f64 * grid.dy() * um, row[at] * unit)))?;
    Ok(points)
}
