//! Contact and mean gap against load, by branch.

use crate::load::Branch;
use maud::{Markup, html};

use super::figures::{FigureWriter, figure};
use crate::error::Result;
use crate::record::results::{AtomState, AtomsResults, ContinuumResults, LoadComparison, Results, StateResults};
use crate::report::number::si_scale;
use crate::report::plot::{
    ATOMS, Axis, BACK, Curve, HARD, LABORATORY, Marker, POINTED_OUT, Plot, SOFT, Style, THRESHOLD, UNCONVERGED,
    YIELDING,
};

/// Ratio of highest to lowest load above which the contact fraction is plotted on logarithmic axes.
const LONG_PATH: f64 = 30.0;

/// Both figures; `None` without any load.
pub(super) fn section(writer: &FigureWriter, results: &Results) -> Result<Option<Markup>> {
    let area = area(writer, results)?;
    let gap = match &results.continuum {
        Some(c) => mean_gap(writer, c, results.non_adhesive.as_ref())?,
        None => None,
    };
    Ok((area.is_some() || gap.is_some()).then(|| html! { @for figure in [area, gap].iter().flatten() { (figure) } }))
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

/// Contact fraction against p*, for all solutions and criteria.
fn area(writer: &FigureWriter, results: &Results) -> Result<Option<Markup>> {
    let mut curves = Vec::new();
    if let Some(c) = &results.continuum {
        let label = format!("{}, laboratory scale", c.method);
        curves.extend(branches(c, (&label, LABORATORY), &|s| (s.numbers.p_star, 100.0 * s.contact_fraction_corrected)));
    }
    if let Some(c) = &results.non_adhesive {
        let points = c.states.iter().map(|s| (s.numbers.p_star, 100.0 * s.contact_fraction_corrected)).collect();
        curves.push(Curve { label: "without adhesion".into(), style: HARD, points });
    }
    if let Some(c) = &results.comparison {
        let mut ids: Vec<&str> = Vec::new();
        for m in c.loads.iter().flat_map(|l| &l.continuum) {
            if !ids.contains(&m.id.as_str()) {
                ids.push(&m.id);
            }
        }
        for id in ids {
            let of = |l: &LoadComparison| {
                l.continuum.iter().find(|m| m.id == id).map(|m| (l.p_star, 100.0 * m.contact_fraction))
            };
            let (style, label): (Style, String) = match id {
                "hard_wall" => (HARD, "hard wall, gap = 0".into()),
                "offset_wall" => (THRESHOLD, "offset wall".into()),
                "compliant_wall" => (SOFT, "compliant wall".into()),
                "yielding_wall" => (YIELDING, "compliant wall with hardness".into()),
                other => (THRESHOLD, other.into()),
            };
            curves.push(Curve { label, style, points: c.loads.iter().filter_map(of).collect() });
        }
    }
    if let Some(a) = &results.atoms {
        let points = a.states.iter().map(|s| (s.p_star, 100.0 * s.contact_fraction)).collect();
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
    let plot = Plot { include, ..Plot::new((axis, axis), ("p*", "contact (%)"), curves) };
    let Some(svg) = writer.curves("area", &plot)? else { return Ok(None) };
    Ok(Some(figure(
        svg,
        html! { "Contact fraction against reduced load. The curve at the laboratory scale is perimeter-corrected"
        @if results.comparison.is_some() { "; those at the atoms’ scale are fractions of the surface sites, for comparison "
            "with the atoms" } "." },
    )))
}

/// p* of first yield and the atoms' contact there (%), between the loads around it.
fn first_yield(a: &AtomsResults) -> Option<(f64, f64)> {
    let p_star = a.plasticity.as_ref()?.first_yield?;
    let area = |s: &AtomState| 100.0 * s.contact_fraction;
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
        style: HARD,
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
