//! One chart per quantity: error against cost, with the Pareto front.

use super::labels::methods;
use crate::compare::pareto::front;
use crate::error::Result;
use crate::record::quantity::Quantity;
use crate::record::tradeoff::{Tradeoff, TradeoffPoint};
use crate::report::page::figures::{FigureWriter, capitalised, figure};
use crate::report::page::method_style::method_style;
use crate::report::picture;
use crate::report::plot::{Axis, Curve, Dash, Marker, Plot, Style};
use maud::{Markup, html};

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
pub(super) fn section(writer: &FigureWriter, tradeoff: &Tradeoff) -> Result<(Vec<Markup>, Markup)> {
    let (mut first, mut others) = (Vec::new(), Vec::new());
    for quantity in Quantity::COMPARED {
        if let Some(drawn) = chart(writer, tradeoff, quantity)? {
            let caption = html! { (capitalised(quantity.name())) ": " (quantity.error_definition()) "." };
            let list = if FIRST.contains(&quantity) { &mut first } else { &mut others };
            list.push(figure(drawn, caption));
        }
    }
    let section = html! {
        p { "Each mark is a setting: a grid, a precision and a tolerance of one method. The line joins the Pareto-optimal settings; "
            "grey lines are the uncertainty of the reference. Methods that do not deliver a quantity are absent; "
            "the reasons are in the " a href="#settings" { "list of settings" } ". Contact area and mean gap are at the top of the page." }
        @for f in &others { (f) }
    };
    Ok((first, section))
}

fn chart(writer: &FigureWriter, tradeoff: &Tradeoff, quantity: Quantity) -> Result<Option<Markup>> {
    let place = |p: &TradeoffPoint| {
        Some((p.cost.cpu_seconds.max(LEAST_SECONDS), tradeoff.error(p, quantity).filter(|e| *e > 0.0)?))
    };
    let all: Vec<(f64, f64)> = tradeoff.points.iter().filter_map(place).collect();
    let (Some(least), Some(most)) =
        (all.iter().map(|p| p.0).reduce(f64::min), all.iter().map(|p| p.0).reduce(f64::max))
    else {
        return Ok(None);
    };
    let mut curves = Vec::new();
    for r in &tradeoff.references {
        if let Some(&u) = r.uncertainty.get(&quantity).filter(|u| **u > 0.0) {
            let (label, style) = match tradeoff.references.len() {
                1 => ("uncertainty of the reference", UNCERTAIN),
                _ if r.setting.adhesive => ("uncertainty of the reference", UNCERTAIN),
                _ => ("uncertainty without adhesion", UNCERTAIN_WITHOUT),
            };
            curves.push(Curve { label: label.into(), style, points: vec![(least, u), (most, u)] });
        }
    }
    let points = front(&all).into_iter().map(|i| all[i]).collect();
    curves.push(Curve { label: "Pareto front".into(), style: FRONT, points });
    for (method, adhesive) in methods(tradeoff) {
        let of = |p: &&TradeoffPoint| p.setting.method == method && p.setting.adhesive == adhesive;
        let points: Vec<(f64, f64)> = tradeoff.points.iter().filter(of).filter_map(place).collect();
        if !points.is_empty() {
            curves.push(Curve { label: method.into(), style: method_style(method), points });
        }
    }
    let label = format!("error: {}{}", quantity.name(), if quantity.in_decades() { " (decades)" } else { "" });
    let errors = || all.iter().map(|p| p.1);
    let ends = [errors().fold(f64::INFINITY, f64::min) / ROOM, errors().fold(0.0, f64::max) * ROOM];
    let include = ends.map(|e| (least, e)).to_vec();
    let plot = Plot { include, ..Plot::new((Axis::Log, Axis::Log), ("processor time (s)", &label), curves) };
    writer.curves(&format!("tradeoff-{}", quantity.id().replace('_', "-")), &plot)
}
