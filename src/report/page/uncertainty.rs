//! Grid convergence, uncertainty budget, and pull-off.

use crate::load::Branch;
use maud::{Markup, html};

use super::figures::{FigureWriter, capitalised, figure, numbers, text};
use crate::error::Result;
use crate::record::quantity::Quantity;
use crate::record::results::{ContinuumResults, StateResults};
use crate::record::uncertainty::UncertaintySource;
use crate::report::number::{change, percent, si, significant, trimmed};
use crate::report::plot::{Axis, Curve, LABORATORY, POINTED_OUT, Plot};
use crate::scene::REFERENCE_LOAD;

pub(super) fn section(writer: &FigureWriter, c: &ContinuumResults) -> Result<Markup> {
    Ok(html! {
        @if let Some(r) = c.range {
            p { "Adhesion: "
                "work γ = " (significant(r.gamma * writer.scales.modulus_pa * writer.scales.length_m * 1e3, 4)) " mJ/m², "
                "range ρ = " (si(r.requested * writer.scales.length_m, "m", 4)) " requested, "
                (si(r.used * writer.scales.length_m, "m", 4)) " used." }
        }
        @if let Some(r) = c.range.filter(|r| r.used != r.requested) {
            p { "The range of adhesion of " (si(r.requested * writer.scales.length_m, "m", 3)) " is enlarged "
                (significant(r.used / r.requested, 3)) " times because this grid does not resolve it: cohesive resolution "
                (significant(r.resolution_requested, 2)) " instead of " (significant(r.resolution_used, 2)) "." }
        }
        @if c.states.iter().any(|s| s.discretisation.is_some()) { (table(writer, c)) }
        (budgets(c))
        @if let Some(why) = &c.pull_off_failure {
            p { span.bad { "The pull-off was not found: " } (why) ". The loads above are not affected." }
        }
        (pull_off(writer, c)?)
    })
}

fn table(writer: &FigureWriter, c: &ContinuumResults) -> Markup {
    let extrapolated = c.states.iter().any(|s| s.extrapolated.is_some());
    let branches = c.states.iter().any(|s| s.branch == Branch::Unloading);
    let mut head = vec!["p*"];
    head.extend(branches.then_some("branch"));
    head.extend(["relative error of contact area", "relative error of mean gap", "energy above its minimum"]);
    if extrapolated {
        head.extend(["contact at the requested range", "mean gap at the requested range"]);
    }
    let row = |s: &StateResults| {
        let mut row = vec![text(trimmed(s.numbers.p_star, 4))];
        row.extend(branches.then(|| text(if s.branch == Branch::Unloading { "unloading" } else { "loading" })));
        let d = s.discretisation;
        row.push(text(change(d.and_then(|d| d.area), d.is_some_and(|d| d.area_is_bound))));
        row.push(text(change(d.and_then(|d| d.mean_gap), d.is_some_and(|d| d.mean_gap_is_bound))));
        row.push(text(s.energy_error_estimate.map_or("–".into(), |e| significant(e, 2))));
        if let Some(e) = s.extrapolated {
            let metres = |v: f64, n: usize| si(v * writer.scales.length_m, "m", n);
            let [area, error] = [(e.area.value, 3), (e.area.error, 2)].map(|(v, n)| significant(100.0 * v, n));
            row.push(text(format!("({area} ± {error})\u{a0}% of the cell")));
            let gap = e.mean_gap.map(|g| format!("{} ± {}", metres(g.value, 4), metres(g.error, 2)));
            row.push(text(gap.unwrap_or("–".into())));
        } else if extrapolated {
            row.extend([text("–"), text("–")]);
        }
        row
    };
    html! {
        (numbers(&head, c.states.iter().map(row).collect()))
        p.quiet { "Relative errors of contact area and mean gap, from the changes to the grid with half the points per side. “Below”: a "
            "bound, because the coarser solution was less converged than the difference. –: not known. Energy above its minimum: "
            "relative, as estimated by the method."
            @if extrapolated { " At the requested range: extrapolated from three grids, each with the shortest range that it resolves; "
                "errors are absolute, of the contact in percentage points; –: error as large as the value." } }
    }
}

/// Colours of the components of a bar, in the order of [`UncertaintySource::ALL`].
const COLOURS: [&str; 5] = ["#0072b2", "#cc79a7", "#009e73", "#e69f00", "#d55e00"];

/// Uncertainty budget of area and mean gap: a bar chart for the load nearest to the reference, and a table of all
/// loads.
pub(super) fn budgets(c: &ContinuumResults) -> Markup {
    let near = |s: &&StateResults| (s.numbers.p_star / REFERENCE_LOAD).ln().abs();
    let known = c.states.iter().filter(|s| !s.uncertainty.is_empty() && s.numbers.p_star > 0.0);
    let Some(shown) = known.min_by(|a, b| near(a).total_cmp(&near(b))) else { return html! {} };
    let quantities = [Quantity::ContactArea, Quantity::MeanGap];
    // Continuum solutions at laboratory scale have no depth component.
    let has = |source: UncertaintySource| {
        source != UncertaintySource::Depth
            || c.states
                .iter()
                .any(|s| s.uncertainty.iter().any(|p| p.source == source && quantities.contains(&p.quantity)))
    };
    let row = |s: &StateResults, quantity: Quantity| {
        let part = |source: UncertaintySource| match s
            .uncertainty
            .iter()
            .find(|p| p.quantity == quantity && p.source == source)
        {
            None => text("–"),
            Some(p) => p.relative.map_or_else(|| text("not known"), |r| text(change(Some(r), p.is_bound))),
        };
        let mut cells = vec![text(trimmed(s.numbers.p_star, 4)), text(quantity.name())];
        cells.extend(UncertaintySource::ALL.into_iter().filter(|s| has(*s)).map(part));
        cells
    };
    let sources = UncertaintySource::ALL.into_iter().filter(|s| has(*s));
    let head: Vec<&str> = ["p*", "of"].into_iter().chain(sources.map(UncertaintySource::name)).collect();
    let longest = quantities.map(|q| parts(shown, q).iter().map(|p| p.1).sum()).into_iter().fold(0.0, f64::max);
    html! {
        h3 { "Uncertainty budget" }
        p.key { @for (source, colour) in UncertaintySource::ALL.iter().zip(COLOURS).filter(|(s, _)| has(**s)) {
            span { i style={ "background:" (colour) } {} (source.name()) }
        } }
        @for quantity in quantities { (bar(shown, quantity, longest)) }
        details {
            summary { "All loads" }
            (numbers(&head, c.states.iter().flat_map(|s| quantities.map(|q| row(s, q))).collect()))
        }
        p.quiet { "At p* = " (trimmed(shown.numbers.p_star, 4)) ", relative. Grid: the change from the grid with half the points per side. Solver and "
            "precision: the effect of a load error as large as the residual, or as the round-off of the fields. " @if has(UncertaintySource::Depth) { "Finite depth: the change from a "
            "half-space. " } "Unknown components are not in the bars." }
    }
}

/// Known components of the relative uncertainty of a quantity.
pub(super) fn parts(s: &StateResults, quantity: Quantity) -> Vec<(UncertaintySource, f64)> {
    s.uncertainty.iter().filter(|p| p.quantity == quantity).filter_map(|p| Some((p.source, p.relative?))).collect()
}

/// Relative error of a quantity; `None` if a component is not known.
pub(super) fn total(s: &StateResults, quantity: Quantity) -> Option<f64> {
    crate::record::uncertainty::total(&s.uncertainty, quantity)
}

/// Stacked bar of one quantity's components, in fractions of the longest bar.
fn bar(s: &StateResults, quantity: Quantity, longest: f64) -> Markup {
    let parts = parts(s, quantity);
    let total: f64 = parts.iter().map(|p| p.1).sum();
    let colour = |source: UncertaintySource| {
        UncertaintySource::ALL.iter().zip(COLOURS).find(|(s, _)| **s == source).map_or("", |(_, colour)| colour)
    };
    html! {
        @if total > 0.0 {
            div.budget {
                span { (capitalised(quantity.name())) ", " (percent(total)) }
                div { @for (source, share) in &parts {
                    i style={ "width:" (format!("{:.3}", 100.0 * share / longest)) "%;background:" (colour(*source)) }
                        title={ (source.name()) " " (percent(*share)) } {}
                } }
            }
        }
    }
}

fn pull_off(writer: &FigureWriter, c: &ContinuumResults) -> Result<Markup> {
    let Some(pulled) = &c.pull_off else { return Ok(html! {}) };
    let (um, kpa) = (writer.scales.length_m * 1e6, writer.scales.modulus_pa * 1e-3);
    let curves = vec![
        Curve {
            label: "unloading".into(),
            style: LABORATORY,
            points: pulled.curve.iter().map(|[g, p]| (g * um, p * kpa)).collect(),
        },
        Curve {
            label: "pull-off".into(),
            style: POINTED_OUT,
            points: vec![(pulled.mean_gap * um, pulled.pressure * kpa)],
        },
    ];
    let error = |e: Option<f64>, unit: &str| e.map_or(String::new(), |e| format!(" ± {}", si(e, unit, 2)));
    let labels = ("mean gap (µm)", "mean pressure (kPa)");
    let include = vec![(pulled.mean_gap * um, 0.0)];
    let plot = Plot { include, ..Plot::new((Axis::Linear, Axis::Linear), labels, curves) };
    let curve = writer.curves("pull-off", &plot)?;
    Ok(html! {
        p { "Pull-off: the contact sustains a tensile stress of at most "
            strong { (si(-pulled.pressure * writer.scales.modulus_pa, "Pa", 4)) }
            (error(pulled.pressure_error.map(|e| e * writer.scales.modulus_pa), "Pa"))
            ", at a mean gap of " (si(pulled.mean_gap * writer.scales.length_m, "m", 4))
            (error(pulled.mean_gap_error.map(|e| e * writer.scales.length_m), "m")) ". "
            @match pulled.coarser {
                Some([nx, ny]) => { "The errors are estimates, from the changes to a grid of " (nx) " × " (ny) " nodes." }
                None => { "The error by the grid is not known." }
            } }
        @if let Some(curve) = curve {
            (figure(curve, html! { "Pressure over mean gap on the way apart. Where it is lowest, a pulled weight lets go." }))
        }
    })
}
