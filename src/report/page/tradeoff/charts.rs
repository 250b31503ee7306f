//! One chart per quantity: error against cost, with the Pareto front.

use super::labels::methods;
use crate::compare::pareto::front;
use crate::record::tradeoff::{TradeoffPoint, TradeoffResults};
use crate::report::page::method_style::method_style;
use crate::report::page::prelude::*;

/// Smallest cost of a chart, s: shorter processor times cannot be measured.
const LEAST_SECONDS: f64 = 1e-4;

/// Factor by which the error axis extends beyond the data on both sides, so that similar errors appear similar.
const ROOM: f64 = 1.6;

const FRONT: Style = Style { colour: picture::BLACK, dash: Dash::Solid, marker: Marker::None };
const UNCERTAIN: Style = Style { colour: picture::GREY, dash: Dash::Dashed, marker: Marker::None };
const UNCERTAIN_WITHOUT: Style = Style { dash: Dash::Dotted, ..UNCERTAIN };

/// Quantities whose charts are on the first screen.
const FIRST: [Quantity; 2] = [Quantity::ContactArea, Quantity::MeanGap];

/// Charts of the first screen, and the section with the others.
pub(super) fn section(writer: &FigureWriter, tradeoff: &TradeoffResults) -> Result<(Markup, Markup)> {
    let charts = |shown: &dyn Fn(&Quantity) -> bool| {
        writer.figures(Quantity::COMPARED.into_iter().filter(shown).filter_map(|q| chart(tradeoff, q)))
    };
    let (first, others) = (charts(&|q| FIRST.contains(q))?, charts(&|q| !FIRST.contains(q))?);
    let section = html! {
        p { "Each mark is a setting: a grid, a precision and a tolerance of one method. The line joins the Pareto-optimal settings; "
            "grey lines are the uncertainty of the reference. Methods that do not deliver a quantity are absent; "
            "the reasons are in the " a href="#settings" { "list of settings" } ". Contact area and mean gap are at the top of the page." }
        (others)
    };
    Ok((first, section))
}

fn chart(tradeoff: &TradeoffResults, quantity: Quantity) -> Option<Figure> {
    let place = |p: &TradeoffPoint| {
        Some((p.cost.cpu_seconds.max(LEAST_SECONDS), tradeoff.error(p, quantity).filter(|e| *e > 0.0)?))
    };
    let all: Vec<(f64, f64)> = tradeoff.points.iter().filter_map(place).collect();
    let ((smallest, largest), (lowest, highest)) = (ends(all.iter().map(|p| p.0)), ends(all.iter().map(|p| p.1)));
    if all.is_empty() {
        return None;
    }
    let mut curves = Vec::new();
    for r in &tradeoff.references {
        if let Some(&u) = r.uncertainty.get(&quantity).filter(|u| **u > 0.0) {
            let (label, style) = match tradeoff.references.len() {
                1 => ("uncertainty of the reference", UNCERTAIN),
                _ if r.setting.adhesive => ("uncertainty of the reference", UNCERTAIN),
                _ => ("uncertainty without adhesion", UNCERTAIN_WITHOUT),
            };
            curves.push(Curve::new(label, style, [(smallest, u), (largest, u)]));
        }
    }
    curves.push(Curve::new("Pareto front", FRONT, front(&all).into_iter().map(|i| all[i])));
    for (method, adhesive) in methods(tradeoff) {
        let matches = |p: &&TradeoffPoint| p.setting.method == method && p.setting.adhesive == adhesive;
        curves.push(Curve::new(method, method_style(method), tradeoff.points.iter().filter(matches).filter_map(place)));
    }
    // A method without the quantity is not in the data of the printed figure.
    curves.retain(|c| !c.points.is_empty());
    let label = format!("error: {}{}", quantity.name(), if quantity.in_decades() { " (decades)" } else { "" });
    let include = [lowest / ROOM, highest * ROOM].map(|e| (smallest, e)).to_vec();
    let plot = Plot { include, ..Plot::new(log("processor time (s)"), log(label), curves) };
    let caption = html! { (capitalised(quantity.name())) ": " (quantity.error_definition()) "." };
    Some(Figure::new(format!("tradeoff-{}", quantity.id().replace('_', "-")), caption, plot))
}
