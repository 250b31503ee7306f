//! Every method that ran beside the scene's own, against it: the numbers of a load, and the paper's figures 4 to 12.

use maud::{Markup, html};

use super::desk::{self, Desk, figure, panel, panels, text};
use crate::error::Result;
use crate::grid::Grid;
use crate::method::Quantity;
use crate::observe::column_at;
use crate::record::methods::{MethodResults, MethodState, states_of};
use crate::record::npy;
use crate::record::results::{ContinuumResults, Results};
use crate::report::number::{duration, percent, si, significant, trimmed};
use crate::report::picture;
use crate::report::plot::{self, Axis, Curve, Dash, Marker, PANEL, Plot, Style};
use crate::scene::REFERENCE_LOAD;

/// The scene's own method in every panel, with its adhesion and without.
const OWN: Style = Style { colour: picture::GREY, dash: Dash::Solid, marker: Marker::None };
const OWN_WITHOUT: Style = Style { dash: Dash::Dashed, ..OWN };
const WITH: Style = plot::ATOMS;
const WITHOUT: Style = plot::HARD;

/// Panels in a row.
const ROW: usize = 3;
/// Position of the sections, over L.
const SECTION: f64 = 0.5;
/// Stresses over the mean pressure below which a line has none.
const NOISE: f64 = 1e-3;
/// How far a panel shows what lies beyond the scene's own curve: so many decades, or times its extent.
const BEYOND_DECADES: f64 = 1.0;
const BEYOND: f64 = 0.5;

/// What is drawn of a method.
#[derive(Clone, Copy)]
enum Shown {
    /// Along the section.
    Gap,
    Stress,
    /// Pr(a), CPr(a), Pr(u), Pr(σ).
    Sizes,
    Shares,
    Gaps,
    Stresses,
    /// Against the load.
    Area,
    Pressure,
    MeanGap,
}

/// A figure of the paper, for one method in each panel.
struct Figure {
    /// Number in the paper.
    number: usize,
    shows: Shown,
    name: &'static str,
    caption: &'static str,
    needs: Quantity,
    axes: (Axis, Axis),
    labels: (&'static str, &'static str),
    /// Of all loads, or of the reference load alone.
    path: bool,
}

const FIGURES: [Figure; 9] = [
    Figure {
        number: 4,
        shows: Shown::Gap,
        name: "gap-section",
        caption: "Gap along y at x = L/2",
        needs: Quantity::GapField,
        axes: (Axis::Linear, Axis::Linear),
        labels: ("y (µm)", "gap u (µm)"),
        path: false,
    },
    Figure {
        number: 5,
        shows: Shown::Stress,
        name: "stress-section",
        caption: "Interfacial stress along y at x = L/2",
        needs: Quantity::StressField,
        axes: (Axis::Linear, Axis::Linear),
        labels: ("y (µm)", "stress σ/E*"),
        path: false,
    },
    Figure {
        number: 6,
        shows: Shown::Sizes,
        name: "patch-sizes",
        caption: "Pr(a), density of patches of an area",
        needs: Quantity::PatchPdf,
        axes: (Axis::Log, Axis::Log),
        labels: ("area a (µm²)", "Pr(a) (1/µm²)"),
        path: false,
    },
    Figure {
        number: 7,
        shows: Shown::Shares,
        name: "patch-area",
        caption: "CPr(a), share of the contact in patches up to an area",
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

/// States of the scene's own method, in the terms of those beside it.
struct Own {
    with: Vec<MethodState>,
    without: Vec<MethodState>,
}

impl Own {
    fn of(results: &Results) -> Self {
        let states = |c: &Option<ContinuumResults>| c.as_ref().map(states_of).unwrap_or_default();
        let (first, second) = (states(&results.continuum), states(&results.without));
        match results.continuum.as_ref().is_some_and(|c| c.range.is_some()) {
            true => Own { with: first, without: second },
            false => Own { with: Vec::new(), without: first },
        }
    }

    fn like(&self, adhesive: bool) -> &[MethodState] {
        if adhesive { &self.with } else { &self.without }
    }
}

/// The reference load's state, or where the path has none the one next to it.
fn at_reference(states: &[MethodState]) -> Option<&MethodState> {
    let off = |s: &MethodState| (s.p_star.max(f64::MIN_POSITIVE) / REFERENCE_LOAD).ln().abs();
    states.iter().min_by(|a, b| off(a).total_cmp(&off(b)))
}

pub fn section(desk: &Desk, results: &Results) -> Result<Markup> {
    let own = Own::of(results);
    let mut ids: Vec<&str> = Vec::new();
    for m in &results.methods {
        if !ids.contains(&m.method.as_str()) {
            ids.push(&m.method);
        }
    }
    let p_star = results.methods.iter().find_map(|m| at_reference(&m.states)).map(|s| s.p_star);
    let mut figures = Vec::new();
    for kind in &FIGURES {
        let mut drawn = Vec::new();
        for id in &ids {
            drawn.push(cell(desk, kind, &own, results.methods.iter().filter(|m| m.method == *id).collect())?);
        }
        let load = match p_star {
            Some(p) if !kind.path => format!(", at p* = {}", trimmed(p, 4)),
            _ => String::new(),
        };
        let caption =
            html! { (kind.caption) (load) ". Grey: " (own_name(results)) " (The paper’s figure " (kind.number) ".)" };
        figures.push(figure(panels(ROW, &drawn), caption));
    }
    Ok(html! {
        @if let Some(p) = p_star { p { "At p* = " (trimmed(p, 4)) ". Deviations are from " (own_name(results))
            " Areas count as each method’s own criterion has it; where contact is a map of nodes they are perimeter-corrected." } }
        (table(desk, results, &own))
        p.quiet { "Blue, solid: with the scene’s adhesion; orange, dashed: without. What a method does not tell, its panel says why." }
        @for f in &figures { (f) }
    })
}

/// What the grey curves are.
fn own_name(results: &Results) -> String {
    match results.continuum.as_ref() {
        Some(c) if c.range.is_some() => format!("{} of the scene, dashed without adhesion.", c.method),
        Some(c) => format!("{} of the scene.", c.method),
        None => "nothing: no solver ran.".into(),
    }
}

fn table(desk: &Desk, results: &Results, own: &Own) -> Markup {
    let um = desk.scales.length_m * 1e6;
    let off = |found: f64, reference: Option<f64>| match reference.filter(|r| *r != 0.0) {
        None => String::new(),
        Some(r) if (found / r - 1.0).abs() < 0.005 => " (0 %)".into(),
        Some(r) => format!(" ({:+.0} %)", 100.0 * (found / r - 1.0)).replace('-', "−"),
    };
    let grid = |adhesive: bool| {
        let solved = results.continuum.iter().chain(&results.without).find(|c| c.range.is_some() == adhesive)?;
        let change =
            solved.states.iter().find(|s| Some(s.p_star) == at_reference(own.like(adhesive)).map(|s| s.p_star));
        change?.discretisation?.area
    };
    let own_row = |adhesive: bool| {
        let s = at_reference(own.like(adhesive))?;
        let error = grid(adhesive).map_or(String::new(), |e| format!(" ± {} by the grid", percent(e * s.area())));
        Some(vec![
            html! { strong { (results.continuum.as_ref().map_or("", |c| &c.method)) } },
            text(if adhesive { "with" } else { "without" }),
            text(results.continuum.iter().flat_map(|c| &c.states).next().map_or("", |s| &s.criterion)),
            html! { (percent(s.area())) span.quiet { (error) } },
            text(s.mean_gap.map_or("–".into(), |g| format!("{} µm", significant(g * um, 3)))),
            text(s.stiffness.map_or("–".into(), |k| significant(k, 3))),
            text(s.typical_patch.map_or("–".into(), |a| format!("{} µm²", significant(a * um * um, 3)))),
            text(""),
        ])
    };
    let row = |m: &MethodResults| {
        let (here, reference) = (at_reference(&m.states), at_reference(own.like(m.adhesive)));
        // A method that ended early is not held against another load.
        let reference = reference.filter(|r| here.is_some_and(|h| h.p_star == r.p_star));
        type Of<'a> = &'a dyn Fn(&MethodState) -> Option<f64>;
        let with = |quantity: Quantity, of: Of, show: &dyn Fn(f64) -> String| match here.and_then(of) {
            Some(v) => html! { (show(v)) span.quiet { (off(v, reference.and_then(of))) } },
            None => match m.missing.iter().find(|m| m.quantity == quantity.id()) {
                Some(missing) => html! { "– " span.quiet { "(" (missing.reason) ")" } },
                None => text("–"),
            },
        };
        let mut cells = vec![
            html! { (m.method) @if m.calibrated_on.is_some() { "*" } },
            text(if m.adhesive { "with" } else { "without" }),
            text(&m.criterion),
        ];
        if !m.states.is_empty() {
            cells.extend([
                html! {
                    (with(Quantity::ContactArea, &|s| Some(s.area()), &percent))
                    @if let Some(presses) = here.and_then(|s| s.contact_fraction_compressive) {
                        span.quiet { " (" (percent(presses)) " under compression)" }
                    }
                },
                with(Quantity::MeanGap, &|s| s.mean_gap, &|g| format!("{} µm", significant(g * um, 3))),
                with(Quantity::Stiffness, &|s| s.stiffness, &|k| significant(k, 3)),
                with(Quantity::PatchPdf, &|s| s.typical_patch, &|a| format!("{} µm²", significant(a * um * um, 3))),
                text(duration(m.cpu_seconds)),
            ]);
        }
        cells
    };
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
    let head = [
        "method",
        "adhesion",
        "contact is",
        "contact",
        "mean gap",
        "stiffness (E*/L)",
        "typical patch",
        "CPU, all loads",
    ];
    html! {
        (desk::table(&head, [true, false].into_iter().filter_map(own_row).chain(results.methods.iter().map(row)).collect()))
        @for m in &results.methods {
            @if let Some(why) = &m.refusal { p.quiet { (m.method) @if !m.adhesive { " without adhesion" } " tells nothing: " (why) "." } }
        }
        @for (m, range) in results.methods.iter().filter_map(|m| Some((m, m.range?))).filter(|(_, r)| r.used != r.asked) {
            p.quiet { (m.method) " works with a range of the adhesion of " (si(range.used * desk.scales.length_m, "m", 3))
                " on this grid, where " (si(range.asked * desk.scales.length_m, "m", 3)) " is asked for." }
        }
        @if !fitted.is_empty() { p.quiet { "* has constants that were fitted. " (fitted.join("; ")) "." } }
    }
}

/// Panel of a method, or the reason why it is empty.
fn cell(desk: &Desk, kind: &Figure, own: &Own, runs: Vec<&MethodResults>) -> Result<Markup> {
    let Some(first) = runs.first() else { return Ok(html! {}) };
    let title = format!("{}: {}", first.method, first.paper_name);
    let mut found = Vec::new();
    for run in &runs {
        let points = points(desk, kind, &run.states)?;
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
        reasons.extend(run.refusal.clone().or(missing).filter(|why| !reasons.contains(why)));
    }
    if found.is_empty() {
        let why = if reasons.is_empty() {
            "its maps are not kept at this load, or have nothing on this line".into()
        } else {
            reasons.join("; ")
        };
        return Ok(panel(&title, html! { p.empty { (why) } }, html! {}));
    }
    let mut curves = Vec::new();
    for (style, states) in [(OWN, &own.with), (OWN_WITHOUT, &own.without)] {
        curves.push(Curve { label: String::new(), style, points: points(desk, kind, states)? });
    }
    let bounds = [bounds(kind.axes.0, &curves, |p| p.0), bounds(kind.axes.1, &curves, |p| p.1)];
    for curve in &mut found {
        let inside = |v: f64, [low, high]: [f64; 2]| (low..=high).contains(&v);
        curve.points.retain(|p| inside(p.0, bounds[0]) && inside(p.1, bounds[1]));
    }
    curves.extend(found);
    let plot = Plot { width: PANEL, proportion: 0.75, ..Plot::new(kind.axes, kind.labels, curves) };
    let drawn = desk.curves(&format!("methods-{}-{}", kind.name, first.method), &plot)?;
    Ok(panel(
        &title,
        drawn.unwrap_or_else(|| html! { p.empty { "nothing that these axes could show" } }),
        html! { (reasons.join("; ")) },
    ))
}

/// What of an axis is shown: around what the scene's own method found, if it found anything.
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

/// What a figure shows of a method.
fn points(desk: &Desk, kind: &Figure, states: &[MethodState]) -> Result<Vec<(f64, f64)>> {
    let um = desk.scales.length_m * 1e6;
    let along = |of: &dyn Fn(&MethodState) -> Option<f64>| -> Vec<(f64, f64)> {
        states.iter().filter_map(|s| Some((s.p_star, of(s)?))).collect()
    };
    let Some(here) = at_reference(states) else { return Ok(Vec::new()) };
    Ok(match kind.shows {
        Shown::Gap => column(desk, here.gap_map.as_deref(), um)?,
        Shown::Stress => {
            let found = column(desk, here.stress_map.as_deref(), 1.0)?;
            // A line that touches nowhere has what rounding leaves of stresses, and nothing to be drawn.
            let most = found.iter().map(|p| p.1.abs()).fold(0.0, f64::max);
            if most < NOISE * here.pressure.abs() { Vec::new() } else { found }
        }
        Shown::Sizes => here.patch_density.iter().map(|[a, d, _]| (a * um * um, d / (um * um))).collect(),
        Shown::Shares => here.patch_area.iter().map(|[a, share]| (a * um * um, *share)).collect(),
        Shown::Gaps => here.gap.as_ref().map_or(Vec::new(), |d| d.density_in(um)),
        Shown::Stresses => here.stress.as_ref().map_or(Vec::new(), |d| d.density_in(1.0)),
        Shown::Area => along(&|s| Some(s.area())),
        Shown::Pressure => along(&|s| (s.area() > 0.0).then(|| s.p_star / s.area())),
        Shown::MeanGap => along(&|s| s.mean_gap.map(|g| g * um)),
    })
}

/// A column of a stored map, µm along it.
pub fn column(desk: &Desk, file: Option<&str>, unit: f64) -> Result<Vec<(f64, f64)>> {
    let Some(file) = file else { return Ok(Vec::new()) };
    let um = desk.scales.length_m * 1e6;
    // Row by row: a map may be far larger than its one column.
    let map = npy::Reader::open(&desk.field(file)?)?;
    let grid = Grid { nx: map.nx, ny: map.ny, lx: 1.0, ly: desk.aspect };
    let at = column_at(grid, SECTION);
    let mut points = Vec::with_capacity(grid.ny);
    map.for_each_row(|y, row| points.push((y as f64 * grid.dy() * um, row[at] * unit)))?;
    Ok(points)
}
