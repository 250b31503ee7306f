//! Contact and mean gap against load, by branch.

use crate::load::Branch;
use maud::{Markup, html};

use super::figures::{FigureWriter, figure};
use super::method_style::method_style;
use crate::error::Result;
use crate::record::results::{
    AtomState, AtomsResults, ComparisonResults, ContinuumResults, LoadComparison, Results, StateResults,
};
use crate::report::number::si_scale;
use crate::report::plot::{
    ATOMS, Axis, BACK, Curve, Dash, EXPECTED, HARD, LABORATORY, Marker, POINTED_OUT, Plot, SOFT, Style, THRESHOLD,
    UNCONVERGED, WITHOUT, YIELDING,
};

/// Ratio of highest to lowest load above which the contact fraction is plotted on logarithmic axes.
const LONG_PATH: f64 = 30.0;

/// The figures; `None` without any load.
pub(super) fn section(writer: &FigureWriter, results: &Results) -> Result<Option<Markup>> {
    let area = area(writer, results)?;
    let gap = match &results.continuum {
        Some(c) => mean_gap(writer, c, results.non_adhesive.as_ref())?,
        None => None,
    };
    let stiffness = match &results.continuum {
        Some(c) => contact_stiffness(writer, c)?,
        None => None,
    };
    let figures: Vec<Markup> = [area, gap, stiffness].into_iter().flatten().collect();
    Ok((!figures.is_empty()).then(|| html! { @for figure in &figures { (figure) } }))
}

/// Curves of a load path, one per branch, each starting at the first state of its branch. States that did not
/// converge form a separate curve.
pub(super) fn branches(
    c: &ContinuumResults,
    (label, look): (&str, Style),
    of: &dyn Fn(&StateResults) -> (f64, f64),
) -> Vec<Curve> {
    let converged: Vec<&StateResults> = c.states.iter().filter(|s| s.numbers.stop == "converged").collect();
    let both = converged.iter().any(|s| s.branch == Branch::Unloading);
    let mut curves: Vec<Curve> = Vec::new();
    let mut last: Option<&StateResults> = None;
    for state in converged {
        if last.is_none_or(|l| l.branch != state.branch) {
            let (style, name) = match state.branch {
                Branch::Loading => (look, if both { format!("{label}, loading") } else { label.to_string() }),
                Branch::Unloading => (BACK, format!("{label}, unloading")),
            };
            // One legend entry per branch.
            let known = curves.iter().any(|c| c.label == name);
            let label = if known { String::new() } else { name };
            curves.push(Curve { label, style, points: last.iter().map(|l| of(l)).collect() });
        }
        if let Some(curve) = curves.last_mut() {
            curve.points.push(of(state));
        }
        last = Some(state);
    }
    let missed = c.states.iter().filter(|s| s.numbers.stop != "converged" && s.numbers.stop != "detached");
    curves.push(Curve { label: "not converged".into(), style: UNCONVERGED, points: missed.map(of).collect() });
    curves
}

/// Contact fraction (%) against p*, for all solutions, methods and criteria, with the theory of the challenge's paper.
fn area_plot(results: &Results) -> Plot {
    let mut curves = Vec::new();
    if let Some(c) = &results.continuum {
        let scale = if results.comparison.is_some() { ", laboratory scale" } else { "" };
        let label = format!("{}{scale}", c.method);
        curves.extend(branches(c, (&label, LABORATORY), &|s| (s.numbers.p_star, 100.0 * s.numbers.contact_area)));
    }
    if let Some(c) = &results.non_adhesive {
        let points = c.states.iter().map(|s| (s.numbers.p_star, 100.0 * s.numbers.contact_area)).collect();
        curves.push(Curve { label: "without adhesion".into(), style: WITHOUT, points });
    }
    for m in results.methods.iter().filter(|m| !m.states.is_empty()) {
        let label = format!("{}{}", m.method, if m.adhesive { "" } else { ", without adhesion" });
        let points = m.states.iter().map(|s| (s.numbers.p_star, 100.0 * s.numbers.contact_area)).collect();
        curves.push(Curve { label, style: method_style(&m.method), points });
    }
    if let Some(c) = &results.comparison {
        curves.extend(criteria(c));
    }
    if let Some(a) = &results.atoms {
        let points = a.states.iter().map(|s| (s.p_star, 100.0 * s.contact_area)).collect();
        curves.push(Curve { label: "atoms".into(), style: ATOMS, points });
        curves.extend(first_yield(a).map(|point| Curve {
            label: "first yield".into(),
            style: Style { marker: Marker::Star, ..POINTED_OUT },
            points: vec![point],
        }));
    }
    let points = || curves.iter().flat_map(|c| &c.points);
    let span = |of: fn(&(f64, f64)) -> f64| {
        points().map(of).fold((f64::INFINITY, 0.0_f64), |(low, high), v| (low.min(v), high.max(v)))
    };
    let ((least, most), (smallest, _)) = (span(|p| p.0), span(|p| p.1));
    // On linear axes the low loads of a long load path would not be distinguishable.
    let axis = if least > 0.0 && smallest > 0.0 && most > LONG_PATH * least { Axis::Log } else { Axis::Linear };
    let include = if axis == Axis::Linear { vec![(0.0, 0.0)] } else { vec![] };
    let matched = results.comparison.as_ref().map(|c| &c.hard_wall);
    for (c, style) in results.continuum.iter().map(|c| (c, EXPECTED)).chain(matched.map(|c| (c, MATCHED))) {
        let (label, theory) = theory(c);
        let theory = formula((&label, style), &curves, axis, |p| 100.0 * theory(p));
        if !theory.points.is_empty() && !curves.iter().any(|c| c.label == theory.label) {
            curves.push(theory);
        }
    }
    let contact = if results.atoms.is_some() { "contact (% of cell or sites)" } else { "contact (% of the cell)" };
    Plot { include, ..Plot::new((axis, axis), ("reduced load p*", contact), curves) }
}

/// Contact stiffness of the solved states against p*, with bars of its error.
fn contact_stiffness(writer: &FigureWriter, c: &ContinuumResults) -> Result<Option<Markup>> {
    let unit = writer.scales.modulus_pa / writer.scales.length_m;
    let known: Vec<&StateResults> = c.states.iter().filter(|s| s.numbers.stiffness.is_some()).collect();
    if known.len() < 2 {
        return Ok(None);
    }
    let value = |s: &StateResults| s.numbers.stiffness.unwrap_or(f64::NAN);
    let largest = known.iter().map(|s| value(s)).fold(0.0, f64::max) * unit;
    let (scale, prefix) = si_scale(largest);
    let solved = ContinuumResults { states: known.iter().map(|s| (*s).clone()).collect(), ..c.clone() };
    let at = |s: &StateResults, k: f64| (s.numbers.p_star, k * unit / scale);
    let mut curves = branches(&solved, (&c.method, LABORATORY), &|s| at(s, value(s)));
    for s in &known {
        let Some(error) = s.numbers.stiffness_error.filter(|e| *e < value(s)) else { continue };
        let points = [-1.0, 1.0].map(|side| at(s, value(s) + side * error)).into();
        curves.push(Curve { label: String::new(), style: EXPECTED, points });
    }
    let axis = if c.states.iter().all(|s| s.numbers.p_star > 0.0) { Axis::Log } else { Axis::Linear };
    let label = format!("contact stiffness ({prefix}Pa/m)");
    let Some(svg) = writer.curves("stiffness", &Plot::new((axis, axis), ("reduced load p*", &label), curves))? else {
        return Ok(None);
    };
    Ok(Some(figure(
        svg,
        html! { "Contact stiffness: derivative of the mean pressure by the approach, without change of the contact. Bars: its error." },
    )))
}

/// The theory at the rms gradient that the atoms' scale resolves.
const MATCHED: Style = Style { dash: Dash::Dotted, ..EXPECTED };

/// Label and formula of the contact fraction by Persson's theory without adhesion. As in statement S07 of the challenge,
/// p* is divided by the fraction of the rms gradient that the grid resolves.
pub(super) fn theory(c: &ContinuumResults) -> (String, impl Fn(f64) -> f64) {
    let root = std::f64::consts::PI.sqrt();
    // The gradient on which p* is based.
    let whole = c.states.iter().map(|s| s.numbers.pressure / s.numbers.p_star).find(|g| g.is_finite() && *g > 0.0);
    let gradient = c.resolved_gradient.unwrap_or(1.0) / whole.unwrap_or(1.0);
    let label = if gradient > 0.99 { "erf(√π p*)".into() } else { format!("erf(√π p*/{gradient:.2})") };
    (label, move |p| libm::erf(root * p / gradient))
}

/// Number of points of a curve given by a formula.
const FINE: usize = 200;

/// A formula evaluated over the load range of the curves.
pub(super) fn formula((label, style): (&str, Style), over: &[Curve], axis: Axis, of: impl Fn(f64) -> f64) -> Curve {
    let loads = || over.iter().flat_map(|c| &c.points).map(|p| p.0);
    let (low, high) = (loads().fold(f64::INFINITY, f64::min), loads().fold(0.0, f64::max));
    let low = if axis == Axis::Log { low } else { low.max(0.0) };
    let at = |i: usize| {
        let share = i as f64 / FINE as f64;
        let p = if axis == Axis::Log { low * (high / low).powf(share) } else { low + share * (high - low) };
        (p, of(p))
    };
    let points = if low < high { (0..=FINE).map(at).collect() } else { Vec::new() };
    Curve { label: label.into(), style, points }
}

/// Contact fraction (%) of the matched continuum under each criterion.
fn criteria(c: &ComparisonResults) -> Vec<Curve> {
    let mut ids: Vec<&str> = Vec::new();
    for m in c.loads.iter().flat_map(|l| &l.continuum) {
        if !ids.contains(&m.id.as_str()) {
            ids.push(&m.id);
        }
    }
    let curve = |id: &str| {
        let of =
            |l: &LoadComparison| l.continuum.iter().find(|m| m.id == id).map(|m| (l.p_star, 100.0 * m.contact_area));
        let (style, label): (Style, String) = match id {
            "hard_wall" => (HARD, "hard wall, gap = 0".into()),
            "offset_wall" => (THRESHOLD, "offset wall".into()),
            "compliant_wall" => (SOFT, "compliant wall".into()),
            "yielding_wall" => (YIELDING, "compliant wall with hardness".into()),
            other => (THRESHOLD, other.into()),
        };
        Curve { label, style, points: c.loads.iter().filter_map(of).collect() }
    };
    ids.into_iter().map(curve).collect()
}

/// The area–load curve of the first screen.
pub(super) fn first_screen(writer: &FigureWriter, results: &Results) -> Result<Option<Markup>> {
    writer.curves("first-area", &Plot { width: FIRST, proportion: 0.72, ..area_plot(results) })
}

/// Width of the curve of the first screen, px.
const FIRST: f64 = 430.0;

fn area(writer: &FigureWriter, results: &Results) -> Result<Option<Markup>> {
    let Some(svg) = writer.curves("area", &area_plot(results))? else { return Ok(None) };
    Ok(Some(figure(
        svg,
        html! { "Contact area against reduced load"
        @if results.comparison.is_some() { "; at the atoms’ scale fractions of the surface sites, for comparison "
            "with the atoms" } ". erf: Persson’s theory without adhesion, at the rms gradient that the grid"
        @if results.comparison.is_some() { " or the block of atoms" } " resolves." },
    )))
}

/// p* of first yield and the atoms' contact there (%), between the loads around it.
fn first_yield(a: &AtomsResults) -> Option<(f64, f64)> {
    let p_star = a.plasticity.as_ref()?.first_yield?;
    let area = |s: &AtomState| 100.0 * s.contact_area;
    let above = a.states.iter().position(|s| s.p_star >= p_star)?;
    let (s1, (p0, a0)) = (
        &a.states[above],
        match above {
            0 => (0.0, 0.0),
            k => (a.states[k - 1].p_star, area(&a.states[k - 1])),
        },
    );
    Some((p_star, a0 + (area(s1) - a0) * (p_star - p0) / (s1.p_star - p0)))
}

/// Mean gap against the logarithm of the load, on which rough surfaces follow nearly a straight line; on a linear
/// axis if some loads are tensile.
fn mean_gap(writer: &FigureWriter, c: &ContinuumResults, without: Option<&ContinuumResults>) -> Result<Option<Markup>> {
    let highest = c.states.iter().map(|s| s.mean_gap).fold(0.0, f64::max) * writer.scales.length_m;
    let (scale, prefix) = si_scale(highest);
    let mut curves =
        branches(c, (&c.method, LABORATORY), &|s| (s.numbers.p_star, s.mean_gap * writer.scales.length_m / scale));
    curves.extend(without.map(|c| Curve {
        label: "without adhesion".into(),
        style: WITHOUT,
        points: c.states.iter().map(|s| (s.numbers.p_star, s.mean_gap * writer.scales.length_m / scale)).collect(),
    }));
    let pressed = c.states.iter().all(|s| s.numbers.p_star > 0.0);
    let axis = if pressed { Axis::Log } else { Axis::Linear };
    let plot = Plot::new((axis, Axis::Linear), ("p*", &format!("mean gap ({prefix}m)")), curves);
    let Some(svg) = writer.curves("mean-gap", &plot)? else { return Ok(None) };
    Ok(Some(figure(
        svg,
        html! { "Mean gap against reduced load at the laboratory scale."
        @if pressed { " At light loads the mean gap is about linear in the logarithm of the load." } },
    )))
}
