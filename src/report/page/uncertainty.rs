//! Grid convergence, uncertainty budget, and pull-off.

use super::prelude::*;
use crate::report::number::{change, si_with_error};
use crate::scene::REFERENCE_LOAD;
use asperity_contact::uncertainty::UncertaintySource;

pub(super) fn section(writer: &FigureWriter, c: &ContinuumResults) -> Result<Markup> {
    Ok(html! {
        @if let Some(r) = c.range {
            p { "Adhesion: "
                "work γ = " (significant(r.gamma * 1e3, 4)) " mJ/m², "
                "range ρ = " (length(r.requested, 4)) " requested, " (length(r.used, 4)) " used." }
        }
        @if let Some(r) = c.range.filter(|r| r.used != r.requested) {
            p { "The range of adhesion of " (length(r.requested, 3)) " is enlarged "
                (significant(r.used / r.requested, 3)) " times because this grid does not resolve it: cohesive resolution "
                (significant(r.resolution_requested, 2)) " instead of " (significant(r.resolution_used, 2)) "." }
        }
        @if c.states.iter().any(|s| s.discretisation.is_some()) { h3 { "Error by the grid" } (errors(c, writer.loads)) }
        (budgets("Uncertainty budget", c, writer.loads))
        (pull_off(writer, c)?)
    })
}

fn errors(c: &ContinuumResults, loads: GivenLoads) -> Markup {
    let extrapolated = c.states.iter().any(|s| s.extrapolated.is_some());
    let branches = c.states.iter().any(|s| s.branch == Branch::Unloading);
    let mut head = vec![loads.head()];
    head.extend(branches.then_some("branch"));
    head.extend(["relative error of contact area", "relative error of mean gap", "energy above its minimum"]);
    if extrapolated {
        head.extend(["contact at the requested range", "mean gap at the requested range"]);
    }
    let row = |s: &State| {
        let mut row = row![loads.value(s.p_star)];
        row.extend(branches.then(|| if s.branch == Branch::Unloading { "unloading" } else { "loading" }.render()));
        let d = s.discretisation;
        row.extend(row![
            change(d.and_then(|d| d.area), d.is_some_and(|d| d.area_is_bound)),
            change(d.and_then(|d| d.mean_gap), d.is_some_and(|d| d.mean_gap_is_bound)),
            or_dash(s.energy_bound.map(|e| significant(e, 2))),
        ]);
        let area = s.extrapolated.map(|e| {
            let [area, error] = [(e.area.value, 3), (e.area.error, 2)].map(|(v, n)| significant(100.0 * v, n));
            format!("({area} ± {error})\u{a0}% of the cell")
        });
        let gap = s.extrapolated.and_then(|e| e.mean_gap);
        let gap = gap.map(|g| format!("{} ± {}", length(g.value, 4), length(g.error, 2)));
        row.extend([or_dash(area), or_dash(gap)].into_iter().filter(|_| extrapolated));
        row
    };
    html! {
        (table("numbers", &head, c.states.iter().map(row)))
        p.quiet { "Relative errors of contact area and mean gap, from the changes to the grid with half the points per side. “Below”: a "
            "bound, because the coarser solution was less converged than the difference. –: not known. Energy above its minimum: "
            "relative, at most."
            @if extrapolated { " At the requested range: extrapolated from three grids, each with the shortest range that it resolves; "
                "errors are absolute, of the contact in percentage points; –: error as large as the value." } }
    }
}

/// Colours of the components of a bar, in the order of [`UncertaintySource::ALL`].
const COLOURS: [&str; 6] = ["#0072b2", "#56b4e9", "#cc79a7", "#009e73", "#e69f00", "#d55e00"];

/// Uncertainty budget of area and mean gap: a bar chart for the load nearest to the reference, and a table of all
/// loads. `title`: the heading.
pub(super) fn budgets(title: &str, c: &ContinuumResults, loads: GivenLoads) -> Markup {
    let near = |s: &&State| (s.p_star / REFERENCE_LOAD).ln().abs();
    let known = c.states.iter().filter(|s| !s.uncertainty.is_empty() && s.p_star > 0.0);
    let Some(shown) = known.min_by(|a, b| near(a).total_cmp(&near(b))) else { return html! {} };
    let quantities = [Quantity::ContactArea, Quantity::MeanGap];
    // Without left-out waves, and at laboratory scale without a finite depth, there is no such component.
    let parts_of = |s: &State| s.uncertainty.clone().into_iter().filter(|p| quantities.contains(&p.quantity));
    let has = |source| c.states.iter().flat_map(parts_of).any(|p| p.source == source);
    let [waves, depth] = [UncertaintySource::Waves, UncertaintySource::Depth].map(has);
    let shows = |source: &UncertaintySource| match source {
        UncertaintySource::Waves => waves,
        UncertaintySource::Depth => depth,
        _ => true,
    };
    let sources = || UncertaintySource::ALL.into_iter().filter(shows);
    let row = |s: &State, quantity: Quantity| {
        let part = |source| s.uncertainty.iter().find(|p| p.quantity == quantity && p.source == source);
        let known = |r: Option<f64>, bound| r.map_or("not known".into(), |r| change(Some(r), bound));
        let parts = sources().map(|source| or_dash(part(source).map(|p| known(p.relative, p.is_bound))));
        row![load(s, loads), quantity.name()].into_iter().chain(parts).collect()
    };
    let head: Vec<&str> = [loads.head(), "of"].into_iter().chain(sources().map(UncertaintySource::name)).collect();
    let longest = quantities.map(|q| parts(shown, q).iter().map(|p| p.1).sum()).into_iter().fold(0.0, f64::max);
    html! {
        h3 { (title) }
        p.key { @for source in sources() { span { i style={ "background:" (colour(source)) } {} (source.name()) } } }
        @for quantity in quantities { (bar(shown, quantity, longest)) }
        details {
            summary { "All loads" }
            (table("numbers", &head, c.states.iter().flat_map(|s| quantities.map(|q| row(s, q)))))
        }
        p.quiet { "At " (loads.label(shown.p_star)) ", relative. Grid: from the change to the grid with half the points per side. " @if waves { "Waves beyond the grid: from the rms gradient and height that "
            "they have. " } "Solver and "
            "precision: the effect of a load error as large as the residual, or as the round-off of the fields. " @if depth { "Finite depth: the change from a "
            "half-space. " } "Unknown components are not in the bars." }
    }
}

fn colour(source: UncertaintySource) -> &'static str {
    UncertaintySource::ALL.iter().zip(COLOURS).find(|(s, _)| **s == source).map_or("", |(_, colour)| colour)
}

/// Known components of the relative uncertainty of a quantity.
fn parts(s: &State, quantity: Quantity) -> Vec<(UncertaintySource, f64)> {
    s.uncertainty.iter().filter(|p| p.quantity == quantity).filter_map(|p| Some((p.source, p.relative?))).collect()
}

/// Relative error of a quantity; `None` if a component is not known.
pub(super) fn total(s: &State, quantity: Quantity) -> Option<f64> {
    asperity_contact::uncertainty::total(&s.uncertainty, quantity)
}

/// Stacked bar of one quantity's components, in fractions of the longest bar.
fn bar(s: &State, quantity: Quantity, longest: f64) -> Markup {
    let parts = parts(s, quantity);
    let total: f64 = parts.iter().map(|p| p.1).sum();
    html! {
        @if total > 0.0 {
            div.budget {
                span { (capitalised(quantity.name())) ", " (percent(total)) }
                div { @for (source, fraction) in &parts {
                    i style={ "width:" (format!("{:.3}", 100.0 * fraction / longest)) "%;background:" (colour(*source)) }
                        title={ (source.name()) " " (percent(*fraction)) } {}
                } }
            }
        }
    }
}

fn pull_off(writer: &FigureWriter, c: &ContinuumResults) -> Result<Markup> {
    let Some(pulled) = &c.pull_off else { return Ok(html! {}) };
    let (um, kpa) = (UM, 1e-3);
    let lowest = (pulled.mean_gap * um, pulled.pressure * kpa);
    let curves = vec![
        Curve::new("unloading", LABORATORY, pulled.curve.iter().map(|[g, p]| (g * um, p * kpa))),
        Curve::new("pull-off", POINTED_OUT, [lowest]),
    ];
    let plot = Plot::new(linear("mean gap (µm)"), linear("mean pressure (kPa)"), curves);
    let plot = Plot { include: vec![(lowest.0, 0.0)], ..plot };
    let caption = "Pressure over mean gap on the way apart. Where it is lowest, a pulled weight lets go.";
    let of_force = pulled.relative_error();
    Ok(html! {
        p { "Pull-off: the contact sustains a tensile stress of at most "
            strong { (si_with_error(-pulled.pressure, pulled.pressure_error, "Pa")) }
            @if let Some(force) = pulled.force {
                ", a force of " (si_with_error(-force, of_force.map(|e| -force * e), "N")) " on the map"
            }
            ", at a mean gap of " (si_with_error(pulled.mean_gap, pulled.mean_gap_error, "m")) ". "
            @match pulled.coarser {
                Some([nx, ny]) => { "The errors are estimates, from the changes to a grid of " (nx) " × " (ny) " nodes." }
                None => { "The error by the grid is not known." }
            } }
        (writer.figures([Figure::new("pull-off", caption, plot)])?)
    })
}
