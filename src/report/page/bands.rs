//! Acceptance checks as a chart: a row per statement with the accepted band, the expected value and ours.

use std::fmt::Write;

use maud::{Markup, PreEscaped};

use super::figures::of_unit;
use crate::record::acceptance::{AcceptanceCheck, CheckStatus};
use crate::report::number::significant;
use crate::report::picture::{BLUE, VERMILION};
use crate::report::svg::{DrawingSize, css, escaped, text};

/// Width of the chart, px, and of the columns next to the bands.
const WIDTH: f64 = 960.0;
const LEFT: f64 = 520.0;
const RIGHT: f64 = 170.0;
/// Fraction of a row's axis that the band takes.
const BAND: f64 = 0.5;

/// The chart; `None` if no check has a value and a tolerance. Every row has its own axis: the band is in its middle, and
/// values beyond the axis are drawn at its end.
pub(super) fn chart(list: &[AcceptanceCheck]) -> Option<Markup> {
    let rows: Vec<(&AcceptanceCheck, f64, [f64; 2])> = list.iter().filter_map(row).collect();
    if rows.is_empty() {
        return None;
    }
    let format = DrawingSize::page(WIDTH);
    let (t, step) = (format.text, 1.7 * format.text);
    let mut svg = format.open(step * rows.len() as f64 + t, "values, expected values and accepted bands");
    let (from, across) = (LEFT, WIDTH - LEFT - RIGHT);
    for (k, (check, value, [low, high])) in rows.iter().enumerate() {
        let y = step * (k as f64 + 0.5) + 0.3 * t;
        let place = |v: f64| {
            let fraction = (v - low) / (high - low);
            from + across * (0.5 + BAND * (fraction - 0.5)).clamp(0.01, 0.99)
        };
        let (start, end) = (place(*low), place(*high));
        let (top, across, down) = (y - 0.45 * t, end - start, 0.9 * t);
        let band = format!("x=\"{start:.1}\" y=\"{top:.1}\" width=\"{across:.1}\" height=\"{down:.1}\"");
        let _ = write!(svg, "<rect {band} fill=\"#999\" fill-opacity=\"0.35\"/>");
        if let Some(x) = check.reference.map(place) {
            let line = format!("M{x:.1} {:.1}v{t:.1}", y - 0.5 * t);
            let _ = write!(svg, "<path d=\"{line}\" stroke=\"currentColor\" stroke-width=\"2\"/>");
        }
        let (x, r) = (place(*value), 0.35 * t);
        let colour = css(if check.status == CheckStatus::Fail { VERMILION } else { BLUE });
        let _ = write!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{r:.1}\" fill=\"{colour}\"/>");
        let statement = format!("{}  {}", check.id, check.statement);
        let short: String = statement.chars().take(72).collect();
        let more = if short.len() < statement.len() { "…" } else { "" };
        let _ = write!(svg, "<g><title>{}</title>", escaped(&statement));
        text(&mut svg, (0.0, y + 0.35 * t), "start", &format!("{short}{more}"));
        svg.push_str("</g>");
        let mark = if check.status == CheckStatus::Fail { "fail" } else { "pass" };
        let found = format!("{} {}", significant(*value, 4), of_unit(&check.unit));
        text(&mut svg, (WIDTH - RIGHT + t, y + 0.35 * t), "start", &format!("{}, {mark}", found.trim_end()));
    }
    svg.push_str("</svg>");
    Some(PreEscaped(svg))
}

/// An assessed check with its value and the ends of its band; an open end is as far from the reference, or from the
/// value, as the other.
fn row(check: &AcceptanceCheck) -> Option<(&AcceptanceCheck, f64, [f64; 2])> {
    let value = check.value.filter(|_| check.status != CheckStatus::NotAssessed)?;
    let centre = check.reference.unwrap_or(value);
    let (low, high) = match check.tolerance? {
        [Some(low), Some(high)] => (low, high),
        [Some(low), None] => (low, low + 2.0 * (centre - low).abs().max(0.5 * low.abs())),
        [None, Some(high)] => (high - 2.0 * (centre - high).abs().max(0.5 * high.abs()), high),
        [None, None] => return None,
    };
    (high > low).then_some((check, value, [low, high]))
}
