//! How what a method costs grows with its grid, beside the paper's own figures.

use super::charts;
use super::labels::{dash, grows, methods};
use crate::compare::pareto::Growth;
use crate::error::Result;
use crate::record::tradeoff::{FORECAST_TOLERANCE, Forecast, Tradeoff, TradeoffPoint};
use crate::report::number::{duration, memory, significant};
use crate::report::page::figures::{FigureWriter, figure, numbers, text};
use crate::report::plot::{Axis, Curve, Dash, Plot, Style};
use maud::{Markup, html};

pub const SOURCE: &str = "Müser et al., Meeting the contact-mechanics challenge, Tribology Letters 65 (2017) 118, \
                          doi:10.1007/s11249-017-0900-2: the paper’s own figures of cost.";

/// A solution that the paper tells the cost of.
struct Told {
    side: &'static str,
    /// Points a side.
    n: f64,
    iterations: usize,
    time: &'static str,
    seconds: f64,
    memory: &'static str,
}

/// Müser et al. 2017: the reference solution by its own method, on the grids it names.
const PAPER: [Told; 3] = [
    Told { side: "1k", n: 1024.0, iterations: 200, time: "1 min", seconds: 60.0, memory: "–" },
    Told { side: "4k", n: 4096.0, iterations: 700, time: "1 h", seconds: 3600.0, memory: "–" },
    Told { side: "32k", n: 32768.0, iterations: 3000, time: "three weeks", seconds: 21.0 * 86400.0, memory: "150 GB" },
];

pub fn section(writer: &FigureWriter, told: &Tradeoff) -> Result<Markup> {
    let mut curves = Vec::new();
    let mut rows = Vec::new();
    for (method, _) in methods(told) {
        let points = told.grids(method);
        if points.is_empty() {
            continue;
        }
        let style = Style { dash: Dash::Solid, ..charts::style(method) };
        let places = points.iter().map(|p| ((p.setting.nx * p.setting.ny) as f64, p.cost.cpu_seconds)).collect();
        curves.push(Curve { label: method.into(), style, points: places });
        let foreseen = points.iter().find_map(|p| told.forecast(p));
        rows.push(row(method, &points, grows(told, method), foreseen));
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
        p { "Exponent e of a cost that grows as (number of points)ᵉ, fitted to the grids on which a method ran in one precision to "
            "one tolerance. Two grids have an exponent and no error of it; small grids tell what starting costs." }
        (numbers(&["method", "exponent", "grids", "CPU", "foreseen", "ratio", "twice the grid", "FFT pairs", "iterations", "memory"], rows))
        @if !told.forecasts.is_empty() {
            p { "Foreseen is the finest grid’s processor time as the grids below it tell it: a constant and a slope in the work, "
                "points times FFT pairs, whose number follows a power law (points alone where none are counted). The ratio is "
                "that over what was measured, and " (told.forecasts.iter().filter(|f| f.holds()).count()) " of "
                (told.forecasts.len()) " methods keep it within " (significant(100.0 * FORECAST_TOLERANCE, 2)) "\u{a0}%. The last "
                "grid counted, the same law tells what twice its points a side will take." }
        }
        @if let Some(drawn) = drawn { (figure(drawn, html! { "Processor time for all loads against the points of the grid." })) }
        h3 { "The paper’s own figures" }
        (numbers(&["grid", "iterations", "time", "memory", "exponent"], paper.collect()))
        p.quiet { "Of the reference solution, on other machines than this; the exponent is that of the time from the row before "
            "in the number of points." }
    })
}

/// Of a method: numbers of its grids, coarse to fine, apart by bars.
fn row(method: &str, points: &[&TradeoffPoint], found: Option<Growth>, foreseen: Option<&Forecast>) -> Vec<Markup> {
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
        foreseen.map_or_else(dash, |f| text(duration(f.predicted_cpu_seconds))),
        foreseen.map_or_else(dash, |f| text(significant(f.ratio, 2))),
        foreseen.and_then(|f| f.doubled_grid_cpu_seconds).map_or_else(dash, |s| text(duration(s))),
        each(&|p| significant(p.cost.fft_pairs, 3)),
        each(&|p| p.cost.iterations.to_string()),
        each(&|p| memory(p.cost.measured_bytes)),
    ]
}
