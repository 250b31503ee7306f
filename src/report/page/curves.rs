//! Contact and mean gap against load, by branch.

use super::method_style::{method_style, model_style};
use super::prelude::*;
use crate::record::methods::MethodResults;
use crate::report::number::unit_of_stiffness;

/// Ratio of highest to lowest load above which the contact fraction is plotted on logarithmic axes.
const LONG_PATH: f64 = 30.0;

/// The figures; `None` without any load.
pub(super) fn section(writer: &FigureWriter, results: &Results) -> Result<Option<Markup>> {
    let compared = results.comparison.is_some();
    let caption = html! { "Contact area against load"
    @if compared { "; at the atoms’ scale fractions of the surface sites, for comparison with the atoms" }
    ". erf: Persson’s theory without adhesion, at the rms gradient that the grid" @if compared { " or the block of atoms" } " resolves." };
    let area = Figure::new("area", caption, area_plot(results).against(results.loads));
    let gap = results.continuum.as_ref().map(|c| mean_gap(c, results.non_adhesive.as_ref(), results.loads));
    let stiffness = results.continuum.as_ref().and_then(|c| contact_stiffness(c, results));
    let figures = writer.figures([Some(area), gap, stiffness].into_iter().flatten())?;
    Ok(Some(figures).filter(|f| !f.0.is_empty()))
}

/// Curves of a load path, one per branch, each starting at the first state of its branch. States that did not
/// converge form a separate curve.
pub(super) fn branches(
    c: &ContinuumResults,
    (label, look): (&str, Style),
    of: &dyn Fn(&State) -> (f64, f64),
) -> Vec<Curve> {
    let converged: Vec<&State> = c.states.iter().filter(|s| s.stop == Stop::Converged).collect();
    let has_unloading = converged.iter().any(|s| s.branch == Branch::Unloading);
    let mut curves: Vec<Curve> = Vec::new();
    let mut last: Option<&State> = None;
    for state in converged {
        if last.is_none_or(|l| l.branch != state.branch) {
            let (style, name) = match state.branch {
                Branch::Loading => (look, if has_unloading { format!("{label}, loading") } else { label.to_string() }),
                Branch::Unloading => (BACK, format!("{label}, unloading")),
            };
            // One legend entry per branch.
            let is_known = curves.iter().any(|c| c.label == name);
            curves.push(Curve::new(if is_known { String::new() } else { name }, style, last.map(of)));
        }
        curves.last_mut().expect("one for the first state").points.push(of(state));
        last = Some(state);
    }
    let missed = c.states.iter().filter(|s| s.stop != Stop::Converged && s.stop != Stop::Detached);
    curves.push(Curve::new("not converged", UNCONVERGED, missed.map(of)));
    curves
}

/// Whether a method was run without the adhesion of the others.
pub(super) fn leaves_out_adhesion(results: &Results, m: &MethodResults) -> bool {
    let attracts = || results.continuum.as_ref().is_some_and(|c| c.range.is_some());
    !m.adhesive && (attracts() || results.methods.iter().any(|other| other.adhesive))
}

/// Contact fraction (%) against p*, for all solutions, methods and criteria, with the theory of the challenge's paper.
fn area_plot(results: &Results) -> Plot {
    let value = |s: &State| (s.p_star, 100.0 * s.contact_area);
    let mut curves = Vec::new();
    if let Some(c) = &results.continuum {
        let scale = if results.comparison.is_some() { ", laboratory scale" } else { "" };
        curves.extend(branches(c, (&format!("{}{scale}", c.method), LABORATORY), &value));
    }
    curves.extend(results.non_adhesive.iter().map(|c| without(c, value)));
    for m in results.methods.iter().filter(|m| !m.states.is_empty()) {
        let label = format!("{}{}", m.method, if leaves_out_adhesion(results, m) { ", without adhesion" } else { "" });
        let points = m.states.iter().map(|s| (s.p_star, 100.0 * s.contact_area));
        curves.push(Curve::new(label, method_style(&m.method), points));
    }
    curves.extend(results.comparison.iter().flat_map(criteria));
    if let Some(a) = &results.atoms {
        curves.push(Curve::new("atoms", ATOMS, a.states.iter().map(|s| (s.p_star, 100.0 * s.contact_area))));
        let star = Style { marker: Marker::Star, ..POINTED_OUT };
        curves.extend(first_yield(a).map(|point| Curve::new("first yield", star, [point])));
    }
    let all = || curves.iter().flat_map(|c| &c.points);
    let ((lower, largest), (smallest, _)) = (ends(all().map(|p| p.0)), ends(all().map(|p| p.1)));
    // On linear axes the low loads of a long load path would not be distinguishable.
    let axis = if lower > 0.0 && smallest > 0.0 && largest > LONG_PATH * lower { log::<&str> } else { linear };
    // Labelled by the loads.
    let x = axis("");
    let include = if x.log { vec![] } else { vec![(0.0, 0.0)] };
    let matched = results.comparison.as_ref().map(|c| &c.hard_wall);
    let laboratory = results.continuum.iter().map(|c| (c, EXPECTED, results.scales.modulus_pa));
    let block = results.atoms.as_ref().map_or(f64::NAN, |a| a.modulus_gpa * 1e9);
    for (c, style, pascal) in laboratory.chain(matched.map(|c| (c, MATCHED, block))) {
        let (label, theory) = theory(c, pascal);
        let theory = formula((&label, style), &curves, x.log, |p| 100.0 * theory(p));
        if !theory.points.is_empty() && !curves.iter().any(|c| c.label == theory.label) {
            curves.push(theory);
        }
    }
    let contact = if results.atoms.is_some() { "contact (% of cell or sites)" } else { "contact (% of the cell)" };
    Plot { include, ..Plot::new(x, axis(contact), curves) }
}

fn without(c: &ContinuumResults, of: impl Fn(&State) -> (f64, f64)) -> Curve {
    Curve::new("without adhesion", WITHOUT, c.states.iter().map(of))
}

/// The axis of the load, which [`Plot::against`] labels: logarithmic unless some loads are tensile.
pub(super) fn load_axis(c: &ContinuumResults) -> AxisScale {
    if c.states.iter().all(|s| s.p_star > 0.0) { log("") } else { linear("") }
}

/// Contact stiffness of the solved states against p*, with bars of its error.
fn contact_stiffness(c: &ContinuumResults, results: &Results) -> Option<Figure> {
    let available: Vec<State> = c.states.iter().filter(|s| s.stiffness.is_some()).cloned().collect();
    if available.len() < 2 {
        return None;
    }
    let (of_si, unit) = unit_of_stiffness(results.scales.length_m);
    let value = |s: &State| s.stiffness.map_or(f64::NAN, |k| of_si * k);
    let (scale, prefix) = si_scale(available.iter().map(value).fold(0.0, f64::max));
    let point_at = |s: &State, k: f64| (s.p_star, k / scale);
    let solved = ContinuumResults { states: available, ..c.clone() };
    let mut curves = branches(&solved, (&c.method, LABORATORY), &|s| point_at(s, value(s)));
    for s in &solved.states {
        let error = s.stiffness_error.map(|e| of_si * e).filter(|e| *e < value(s));
        curves
            .extend(error.map(|e| Curve::new("", EXPECTED, [-1.0, 1.0].map(|side| point_at(s, value(s) + side * e)))));
    }
    let caption = "Contact stiffness: derivative of the mean pressure by the approach, without change of the contact. Bars: its error.";
    let label = format!("contact stiffness ({prefix}{unit})");
    let y = if load_axis(c).log { log(label) } else { linear(label) };
    Some(Figure::new("stiffness", caption, Plot::new(load_axis(c), y, curves).against(results.loads)))
}

/// The theory at the rms gradient that the atoms' scale resolves.
const MATCHED: Style = Style { dash: Dash::Dotted, ..EXPECTED };

/// Label and formula of the contact fraction by Persson's theory without adhesion. As in statement S07 of the challenge,
/// p* is divided by the fraction of the rms gradient that the grid resolves. `modulus`: E*, Pa.
pub(super) fn theory(c: &ContinuumResults, modulus: f64) -> (String, impl Fn(f64) -> f64) {
    let root = std::f64::consts::PI.sqrt();
    // The gradient on which p* is based.
    let whole = c.states.iter().map(|s| s.pressure / modulus / s.p_star).find(|g| g.is_finite() && *g > 0.0);
    let gradient = c.resolved_gradient.unwrap_or(1.0) / whole.unwrap_or(1.0);
    let label = if gradient > 0.99 { "erf(√π p*)".into() } else { format!("erf(√π p*/{gradient:.2})") };
    (label, move |p| libm::erf(root * p / gradient))
}

/// Number of points of a curve given by a formula.
const FINE: usize = 200;

/// A formula evaluated over the load range of the curves.
pub(super) fn formula((label, style): (&str, Style), over: &[Curve], log: bool, value: impl Fn(f64) -> f64) -> Curve {
    let (low, high) = ends(over.iter().flat_map(|c| &c.points).map(|p| p.0));
    let low = if log { low } else { low.max(0.0) };
    let point_at = |i: usize| {
        let fraction = i as f64 / FINE as f64;
        let p = if log { low * (high / low).powf(fraction) } else { low + fraction * (high - low) };
        (p, value(p))
    };
    Curve::new(label, style, (0..=FINE).filter(|_| low < high).map(point_at))
}

/// Contact fraction (%) of the matched continuum under each criterion.
fn criteria(c: &ComparisonResults) -> Vec<Curve> {
    let all = || c.loads.iter().flat_map(|l| l.continuum.iter().map(|m| (l.p_star, m)));
    let curve = |id: &String| {
        let of_criterion = || all().filter(|(_, m)| m.id == *id);
        // The other criteria of contact are in the labels.
        let zero = if id == "hard_wall" { ", gap = 0" } else { "" };
        let label = of_criterion().next().map_or(String::new(), |(_, m)| format!("{}{zero}", m.label()));
        Curve::new(label, model_style(id), of_criterion().map(|(p, m)| (p, 100.0 * m.contact_area)))
    };
    distinct(all().map(|(_, m)| &m.id)).into_iter().map(curve).collect()
}

/// The area–load curve of the first screen.
pub(super) fn first_screen(writer: &FigureWriter, results: &Results) -> Result<Option<Markup>> {
    writer.curves("first-area", &Plot { width: FIRST, proportion: 0.72, ..area_plot(results).against(results.loads) })
}

/// Width of the curve of the first screen, px.
const FIRST: f64 = 430.0;

/// p* of first yield and the atoms' contact there (%), between the loads around it.
fn first_yield(a: &AtomsResults) -> Option<(f64, f64)> {
    let p_star = a.plasticity.as_ref()?.first_yield?;
    let point = |s: &AtomState| (s.p_star, 100.0 * s.contact_area);
    let above = a.states.iter().position(|s| s.p_star >= p_star)?;
    let ((p1, a1), (p0, a0)) =
        (point(&a.states[above]), above.checked_sub(1).map_or((0.0, 0.0), |k| point(&a.states[k])));
    Some((p_star, a0 + (a1 - a0) * (p_star - p0) / (p1 - p0)))
}

/// Mean gap against the logarithm of the load, on which rough surfaces follow nearly a straight line.
fn mean_gap(c: &ContinuumResults, other: Option<&ContinuumResults>, loads: GivenLoads) -> Figure {
    let (scale, prefix) = si_scale(c.states.iter().filter_map(|s| s.mean_gap).fold(0.0, f64::max));
    let point = |s: &State| (s.p_star, s.mean_gap.unwrap_or(f64::NAN) / scale);
    let mut curves = branches(c, (&c.method, LABORATORY), &point);
    curves.extend(other.map(|c| without(c, point)));
    let plot = Plot::new(load_axis(c), linear(format!("mean gap ({prefix}m)")), curves).against(loads);
    let caption = html! { "Mean gap against load."
    @if plot.x.log { " At light loads the mean gap is about linear in the logarithm of the load." } };
    Figure::new("mean-gap", caption, plot)
}
