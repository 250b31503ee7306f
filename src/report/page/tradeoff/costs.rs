//! Growth of the cost of a method with its grid, and costs stated in the paper.

use super::labels::{dash, grows, methods};
use crate::compare::pareto::Growth;
use crate::error::Result;
use crate::record::tradeoff::{FORECAST_TOLERANCE, Forecast, Tradeoff, TradeoffPoint};
use crate::report::number::{duration, memory, significant};
use crate::report::page::figures::{FigureWriter, figure, numbers, text};
use crate::report::page::method_style::method_style;
use crate::report::plot::{Axis, Curve, Dash, Plot, Style};
use maud::{Markup, html};

pub(super) const SOURCE: &str = "Müser et al., Meeting the contact-mechanics challenge, Tribology Letters 65 (2017) 118, \
                          doi:10.1007/s11249-017-0900-2: the paper’s own figures of cost.";

/// A solution whose cost the paper states.
struct StatedCost {
    side: &'static str,
    /// Points along each side.
    n: f64,
    iterations: usize,
    time: &'static str,
    seconds: f64,
    memory: &'static str,
}

/// Müser et al. 2017: grids and costs stated for the reference solution.
const PAPER: [StatedCost; 3] = [
    StatedCost { side: "1k", n: 1024.0, iterations: 200, time: "1 min", seconds: 60.0, memory: "–" },
    StatedCost { side: "4k", n: 4096.0, iterations: 700, time: "1 h", seconds: 3600.0, memory: "–" },
    StatedCost {
        side: "32k",
        n: 32768.0,
        iterations: 3000,
        time: "three weeks",
        seconds: 21.0 * 86400.0,
        memory: "150 GB",
    },
];

pub(super) fn section(writer: &FigureWriter, tradeoff: &Tradeoff) -> Result<Markup> {
    let mut curves = Vec::new();
    let mut rows = Vec::new();
    for (method, _) in methods(tradeoff) {
        let points = tradeoff.grids(method);
        if points.is_empty() {
            continue;
        }
        let style = Style { dash: Dash::Solid, ..method_style(method) };
        let places = points.iter().map(|p| ((p.setting.nx * p.setting.ny) as f64, p.cost.cpu_seconds)).collect();
        curves.push(Curve { label: method.into(), style, points: places });
        let predicted = points.iter().find_map(|p| tradeoff.forecast(p));
        rows.push(row(method, &points, grows(tradeoff, method), predicted));
    }
    let plot = Plot::new((Axis::Log, Axis::Log), ("points of the grid", "processor time (s)"), curves);
    let drawn = writer.curves("tradeoff-growth", &plot)?;
    let paper = PAPER.iter().enumerate().map(|(i, t)| {
        let before = i.checked_sub(1).map(|i| &PAPER[i]);
        let exponent = before.map(|b| (t.seconds / b.seconds).ln() / (2.0 * (t.n / b.n).ln()));
        vec![
            text(format!("{0} × {0}", t.side)),
            text(t.iterations),
            text(t.time),
            text(t.memory),
            exponent.map_or_else(dash, |e| text(significant(e, 2))),
        ]
    });
    Ok(html! {
        p { "Exponent e of a cost that grows as (number of points)ᵉ, fitted to the grids of a method in one precision and to "
            "one tolerance. The exponent of two grids has no error; on small grids start-up costs dominate." }
        (numbers(&["method", "exponent", "grids", "CPU", "predicted", "ratio", "doubled grid", "FFT pairs", "iterations", "memory"], rows))
        @if !tradeoff.forecasts.is_empty() {
            p { "Predicted: processor time of the finest grid, extrapolated from the coarser ones as a constant plus a term linear in the "
                "work (points times FFT pairs, whose number follows a power law; points alone without FFT). Ratio: predicted over "
                "measured; " (tradeoff.forecasts.iter().filter(|f| f.is_accurate()).count()) " of "
                (tradeoff.forecasts.len()) " methods are within " (significant(100.0 * FORECAST_TOLERANCE, 2)) "\u{a0}%. Doubled grid: prediction from "
                "all grids for twice the points along each side." }
        }
        @if let Some(drawn) = drawn { (figure(drawn, html! { "Processor time for all loads against the points of the grid." })) }
        h3 { "Costs stated in the paper" }
        (numbers(&["grid", "iterations", "time", "memory", "exponent"], paper.collect()))
        p.quiet { "Reference solution, on other machines; the exponent is that of the time against the number of points, from the "
            "row above." }
    })
}

/// Table row of a method: the values of its grids, coarse to fine, separated by bars.
fn row(method: &str, points: &[&TradeoffPoint], found: Option<Growth>, predicted: Option<&Forecast>) -> Vec<Markup> {
    let mut points = points.to_vec();
    points.sort_by_key(|p| p.setting.nx);
    let each =
        |of: &dyn Fn(&TradeoffPoint) -> String| text(points.iter().map(|p| of(p)).collect::<Vec<_>>().join(" | "));
    let exponent = match found {
        None => dash(),
        Some(Growth { exponent, error, sizes }) => {
            let error = error.map_or(String::new(), |e| format!(" ± {}", significant(e, 1)));
            text(format!("{}{error} ({sizes} grids)", significant(exponent, 2)))
        }
    };
    vec![
        text(method),
        exponent,
        each(&|p| p.setting.nx.to_string()),
        each(&|p| duration(p.cost.cpu_seconds)),
        predicted.map_or_else(dash, |f| text(duration(f.predicted_cpu_seconds))),
        predicted.map_or_else(dash, |f| text(significant(f.ratio, 2))),
        predicted.and_then(|f| f.doubled_grid_cpu_seconds).map_or_else(dash, |s| text(duration(s))),
        each(&|p| significant(p.cost.fft_pairs, 3)),
        each(&|p| p.cost.iterations.to_string()),
        each(&|p| memory(p.cost.measured_bytes)),
    ]
}
