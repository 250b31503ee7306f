//! What a scene asks for besides contact: plastic flow, flow through the gap, stress below the surface. Each is a table and a figure.

use super::curves::load_axis;
use super::distributions::LOOKS;
use super::prelude::*;
use crate::report::number::si_with_error;
use asperity_contact::observe::{Leakage, Plasticity};
use asperity_contact::state::{Peak, SubsurfaceResults};

pub(super) fn section(writer: &FigureWriter, c: &ContinuumResults) -> Result<Markup> {
    Ok(html! { (plastic_flow(writer, c)?) (flow_through_the_gap(writer, c)?) (stress_below(writer, c)?) })
}

/// States that have a quantity.
fn with<'a, T>(c: &'a ContinuumResults, of: impl Fn(&'a State) -> Option<T>) -> Vec<(&'a State, T)> {
    c.states.iter().filter_map(|s| Some((s, of(s)?))).collect()
}

/// Empty for an elastic body.
fn plastic_flow(writer: &FigureWriter, c: &ContinuumResults) -> Result<Markup> {
    let Some(hardness) = c.hardness else { return Ok(html! {}) };
    let largest = match &c.hardness_map {
        None => format!("the hardness of {}", stress(hardness, 3)),
        Some(map) => {
            let [lowest, mean, highest] = [map.lowest, hardness, map.highest].map(|h| stress(h, 3));
            format!("the hardness of the node, {lowest} to {highest} with a mean of {mean}")
        }
    };
    let states = with(c, |s| s.plasticity);
    let loading: Vec<_> = states.iter().filter(|(s, _)| s.branch == Branch::Loading).collect();
    let figure = (loading.len() > 1).then(|| {
        let shares = |of: fn(&Plasticity) -> f64| loading.iter().map(move |(s, p)| (s.p_star, 100.0 * of(p)));
        // Both agree where the load only rises: the dotted line is drawn over the other.
        let displaced = Curve::line("displaced", HARD, shares(|p| p.displaced));
        let curves = vec![Curve::new("flowing", LABORATORY, shares(|p| p.flowing)), displaced];
        let plot = Plot::new(load_axis(c), linear("nodes (% of the cell)"), curves).against(writer.loads);
        let caption = "Nodes that flow at a load, and nodes with a plastic displacement, on loading.";
        Figure::new("plastic-flow", caption, plot)
    });
    Ok(html! {
        h3 { "Plastic flow" }
        (columns!("numbers", &states, |(s, p)| {
            writer.loads.head() => load(s, writer.loads),
            "flowing" => percent(p.flowing),
            "displaced" => percent(p.displaced),
            "mean plastic displacement" => length(p.displacement, 3),
            "plastic work" => work(p.work),
        }))
        p.quiet { "The contact stress is at most " (largest) ". Flowing: nodes whose plastic displacement grows in this load; displaced: "
            "nodes that have one. Unloading is elastic." }
        (writer.figures(figure)?)
    })
}

/// Directions of the flow, with their curves.
const DIRECTIONS: [(&str, Style); 2] = [("along x", LABORATORY), ("along y", WITHOUT)];

fn flow_through_the_gap(writer: &FigureWriter, c: &ContinuumResults) -> Result<Markup> {
    let states = with(c, |s| s.leakage);
    if states.is_empty() {
        return Ok(html! {});
    }
    let gap = |flow: &Leakage, along: usize| match flow.hydraulic_gaps()[along] {
        0.0 => "sealed".into(),
        gap => si_with_error(gap, flow.gap_errors.map(|e| e[along]), "m"),
    };
    let loading: Vec<_> = states.iter().filter(|(s, _)| s.branch == Branch::Loading).collect();
    let figure = (loading.len() > 1).then(|| {
        let largest = loading.iter().flat_map(|(_, f)| f.hydraulic_gaps()).fold(0.0, f64::max);
        let (scale, prefix) = si_scale(largest);
        let along = |(i, (name, style)): (usize, (&str, Style))| {
            let points = loading.iter().map(|(s, f)| (s.p_star, f.hydraulic_gaps()[i] / scale));
            let errors = loading.iter().map(|(_, f)| f.gap_errors.map_or(f64::NAN, |e| e[i] / scale)).collect();
            Curve { errors, ..Curve::new(name, style, points) }
        };
        let medium = loading.iter().map(|(s, f)| (s.p_star, f.effective_medium.cbrt() / scale));
        let curves = DIRECTIONS.into_iter().enumerate().map(along);
        let curves = curves.chain([Curve::new("effective medium", EXPECTED, medium)]).collect();
        let plot = Plot::new(load_axis(c), log(format!("hydraulic gap ({prefix}m)")), curves).against(writer.loads);
        Figure::new(
            "hydraulic-gap",
            "Hydraulic gap against load, on loading; bars are its error. Sealed directions are left out.",
            plot,
        )
    });
    Ok(html! {
        h3 { "Flow through the gap" }
        (columns!("numbers", &states, |(s, flow)| {
            writer.loads.head() => load(s, writer.loads),
            "hydraulic gap along x" => gap(flow, 0),
            "along y" => gap(flow, 1),
            "effective medium" => match flow.effective_medium {
                0.0 => "sealed".into(),
                cubed => length(cubed.cbrt(), 3),
            },
        }))
        p.quiet { "Hydraulic gap: uniform gap with the same flow, from the Reynolds equation solved on the gap; sealed where no open path leads along the "
            "direction. The effective medium (Bruggeman) seals at half contact." }
        (writer.figures(figure)?)
    })
}

fn stress_below(writer: &FigureWriter, c: &ContinuumResults) -> Result<Markup> {
    let states = with(c, |s| s.subsurface.as_ref());
    let Some((_, first)) = states.first() else { return Ok(html! {}) };
    let at = |peak: &Peak| format!("{} at a depth of {}", stress(peak.value, 3), length(peak.depth, 3));
    let poisson = trimmed(first.poisson, 3);
    let deepest = first.slices.iter().map(|s| s.depth).fold(0.0, f64::max);
    let strongest = states.iter().map(|(_, b)| b.von_mises.value).fold(0.0, f64::max);
    let ((depth_scale, depth_prefix), (scale, prefix)) = (si_scale(deepest), si_scale(strongest));
    let below = |b: &SubsurfaceResults| -> Vec<(f64, f64)> {
        let mut points: Vec<_> = b.slices.iter().map(|s| (s.depth / depth_scale, s.von_mises.value / scale)).collect();
        points.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        points
    };
    let figure = (first.slices.len() > 1).then(|| {
        let shown = LOOKS.into_iter().zip(spread(states.len(), LOOKS.len()));
        let curve = |(look, i): (Style, usize)| {
            let (state, body) = states[i];
            Curve::new(
                writer.loads.label(state.p_star) + back(state),
                Style { marker: Marker::Disc, ..look },
                below(body),
            )
        };
        let (x, y) =
            (linear(format!("depth ({depth_prefix}m)")), linear(format!("largest von Mises stress ({prefix}Pa)")));
        let plot = Plot::new(x, y, shown.map(curve).collect());
        Figure::new("stress-below", "Largest equivalent stress of each depth.", plot)
    });
    Ok(html! {
        h3 { "Stress below the surface" }
        (columns!("numbers", &states, |(s, body)| {
            writer.loads.head() => load(s, writer.loads),
            "largest von Mises stress" => at(&body.von_mises),
            "largest shear stress" => {
                let over = body.shear_over_strength.map(|r| format!(", {} of the strength", significant(r, 3)));
                at(&body.shear) + &over.unwrap_or_default()
            },
        }))
        p.quiet { "Of the depths that the scene names, with Poisson’s ratio " (poisson) ". The largest value over a depth grows with the resolution of the stress "
            "at the surface. Where the shear stress exceeds the strength, the body yields, which is not part of the solution." }
        @if states.len() > LOOKS.len() { p.quiet { "The figure shows " (LOOKS.len()) " of " (states.len()) " loads." } }
        (writer.figures(figure)?)
    })
}
