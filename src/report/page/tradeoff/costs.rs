//! Growth of the cost of a method with its grid, and costs stated in the paper.

use super::labels::{grows, methods};
use crate::compare::pareto::CostExponent;
use crate::record::tradeoff::{TradeoffPoint, TradeoffResults};
use crate::report::page::method_style::method_style;
use crate::report::page::prelude::*;

pub(super) const SOURCE: &str = "Müser et al., Meeting the contact-mechanics challenge, Tribology Letters 65 (2017) 118, \
                          doi:10.1007/s11249-017-0900-2: the paper’s own figures of cost.";

/// Müser et al. 2017: grids and costs stated for the reference solution: name and number of the points along each side,
/// iterations, time in words and seconds, memory.
const PAPER: [(&str, f64, usize, &str, f64, &str); 3] = [
    ("1k", 1024.0, 200, "1 min", 60.0, "–"),
    ("4k", 4096.0, 700, "1 h", 3600.0, "–"),
    ("32k", 32768.0, 3000, "three weeks", 21.0 * 86400.0, "150 GB"),
];

pub(super) fn section(writer: &FigureWriter, tradeoff: &TradeoffResults) -> Result<Markup> {
    let mut solved: Vec<(&str, Vec<&TradeoffPoint>)> =
        methods(tradeoff).into_iter().map(|(method, _)| (method, tradeoff.grids(method))).collect();
    solved.retain(|(_, points)| !points.is_empty());
    let curve = |(method, points): &(&str, Vec<&TradeoffPoint>)| {
        let style = Style { dash: Dash::Solid, ..method_style(method) };
        let place = |p: &&TradeoffPoint| ((p.setting.nx * p.setting.ny) as f64, p.cost.cpu_seconds);
        Curve::new(*method, style, points.iter().map(place))
    };
    let curves = solved.iter().map(curve).collect();
    let growth = Figure::new(
        "tradeoff-growth",
        "Processor time for all loads against the points of the grid.",
        Plot::new(log("points of the grid"), log("processor time (s)"), curves),
    );
    // Coarse to fine.
    solved.iter_mut().for_each(|(_, points)| points.sort_by_key(|p| p.setting.nx));
    let paper = PAPER.iter().enumerate().map(|(i, row)| {
        let (_, n, .., seconds, _) = row;
        let previous = i.checked_sub(1).map(|i| &PAPER[i]);
        (row, previous.map(|(_, m, .., earlier, _)| (seconds / earlier).ln() / (2.0 * (n / m).ln())))
    });
    Ok(html! {
        p { "Exponent e of a cost that grows as (number of points)ᵉ, fitted to the grids of a method in one precision and to "
            "one tolerance. The exponent of two grids has no error; on small grids start-up costs dominate." }
        (columns!("numbers", &solved, |(method, points)| {
            "method" => method,
            "exponent" => or_dash(grows(tradeoff, method).map(exponent)),
            "grids" => join(points, |p| p.setting.nx.to_string()),
            "CPU" => join(points, |p| duration(p.cost.cpu_seconds)),
            "FFT pairs" => join(points, |p| significant(p.cost.fft_pairs, 3)),
            "iterations" => join(points, |p| p.cost.iterations.to_string()),
            "memory" => join(points, |p| memory(p.cost.measured_bytes)),
        }))
        (writer.figures([growth])?)
        h3 { "Costs stated in the paper" }
        (columns!("numbers", paper, |((side, _, iterations, time, _, memory), exponent)| {
            "grid" => format!("{side} × {side}"),
            "iterations" => iterations,
            "time" => time,
            "memory" => memory,
            "exponent" => or_dash(exponent.map(|e| significant(e, 2))),
        }))
        p.quiet { "Reference solution, on other machines; the exponent is that of the time against the number of points, from the "
            "row above." }
    })
}

/// The values of the grids of a method, separated by bars.
fn join(points: &[&TradeoffPoint], of: impl Fn(&TradeoffPoint) -> String) -> String {
    points.iter().map(|p| of(p)).collect::<Vec<_>>().join(" | ")
}

fn exponent(growth: CostExponent) -> String {
    let error = growth.error.map_or(String::new(), |e| format!(" ± {}", significant(e, 1)));
    format!("{}{error} ({} grids)", significant(growth.exponent, 2), growth.sizes)
}
