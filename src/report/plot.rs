//! Curves as SVG: linear or logarithmic axes, a legend above the frame, and a dash pattern and a marker for every
//! curve, so that curves can also be distinguished in greyscale.
//!
//! All lengths of a drawing are multiples of its text height, so that all figures of one format have one type size.

use std::fmt::Write;

use super::picture::{self, Rgb};
use super::scale::PlotAxis;
pub use super::scale::{AxisScale, linear, log};
use super::svg::{self, CHARACTER, DrawingSize, Ticks, css, escaped, half_width, text};
use crate::record::given_loads::{GivenLoads, LoadQuantity};

/// Height of a row of the legend, and length of a line sample, in text heights.
const LEGEND_ROW: f64 = 1.45;
const SAMPLE: f64 = 2.4;

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Dash {
    Solid,
    Dashed,
    Dotted,
    /// Markers only.
    None,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Marker {
    None,
    Disc,
    Ring,
    Square,
    Frame,
    Triangle,
    OpenTriangle,
    Down,
    OpenDown,
    Diamond,
    OpenDiamond,
    Cross,
    Plus,
    Star,
    Target,
}

/// How an outline is painted; strokes have nothing to fill.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Fill {
    Full,
    White,
    None,
}

/// Corners of an outline, or an end of each stroke through the centre; none for a circle.
type Outline = &'static [(f64, f64)];

const SQUARE: Outline = &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)];
const UP: Outline = &[(0.0, -1.2), (1.1, 1.0), (-1.1, 1.0)];
const DOWN: Outline = &[(0.0, 1.2), (1.1, -1.0), (-1.1, -1.0)];
const DIAMOND: Outline = &[(0.0, -1.3), (1.3, 0.0), (0.0, 1.3), (-1.3, 0.0)];

impl Marker {
    /// Markers that can be distinguished in greyscale, filled and open in turn.
    #[rustfmt::skip]
    pub const DISTINCT: [Marker; 14] = {
        use Marker::*;
        [Disc, Frame, Triangle, OpenDiamond, Cross, Square, Ring, Down, OpenTriangle, Plus, Diamond, OpenDown, Star, Target]
    };

    /// Outline, paint and the name in matplotlib.
    pub(super) fn look(self) -> Option<(Outline, Fill, &'static str)> {
        Some(match self {
            Marker::None => return None,
            Marker::Disc => (&[], Fill::Full, "o"),
            Marker::Ring | Marker::Target => (&[], Fill::White, "o"),
            Marker::Square => (SQUARE, Fill::Full, "s"),
            Marker::Frame => (SQUARE, Fill::White, "s"),
            Marker::Triangle => (UP, Fill::Full, "^"),
            Marker::OpenTriangle => (UP, Fill::White, "^"),
            Marker::Down => (DOWN, Fill::Full, "v"),
            Marker::OpenDown => (DOWN, Fill::White, "v"),
            Marker::Diamond => (DIAMOND, Fill::Full, "D"),
            Marker::OpenDiamond => (DIAMOND, Fill::White, "D"),
            Marker::Cross => (&[(1.0, 1.0), (-1.0, 1.0)], Fill::None, "x"),
            Marker::Plus => (&[(0.0, 1.25), (1.25, 0.0)], Fill::None, "+"),
            Marker::Star => (&[(1.0, 1.0), (-1.0, 1.0), (0.0, 1.25), (1.25, 0.0)], Fill::None, "*"),
        })
    }
}

/// Style of a curve. With the constants below an object has the same style in all figures of a report.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Style {
    pub colour: Rgb,
    pub dash: Dash,
    pub marker: Marker,
}

pub const ATOMS: Style = Style { colour: picture::BLUE, dash: Dash::Solid, marker: Marker::Disc };
/// Without adhesion, where that is the second of two curves.
pub const WITHOUT: Style = Style { colour: picture::ORANGE, dash: Dash::Dashed, marker: Marker::Square };
pub const HARD: Style = Style { colour: picture::VERMILION, dash: Dash::Dotted, marker: Marker::Square };
pub const THRESHOLD: Style = Style { colour: picture::GREEN, dash: Dash::Dashed, marker: Marker::Ring };
/// Compliant wall, without and with hardness: the colours of their maps.
pub const SOFT: Style = Style { colour: picture::ORANGE, dash: Dash::Dashed, marker: Marker::Triangle };
pub const YIELDING: Style = Style { colour: picture::PURPLE, dash: Dash::Dotted, marker: Marker::Star };
pub const LABORATORY: Style = Style { colour: picture::BLACK, dash: Dash::Solid, marker: Marker::Square };
/// Unloading branch, and highlighted points.
pub const BACK: Style = Style { colour: picture::VERMILION, dash: Dash::Dashed, marker: Marker::Ring };
pub const POINTED_OUT: Style = Style { colour: picture::VERMILION, dash: Dash::None, marker: Marker::Disc };
pub const EXPECTED: Style = Style { colour: picture::BLACK, dash: Dash::Dashed, marker: Marker::None };
pub const REALISED: Style = Style { colour: picture::BLUE, dash: Dash::None, marker: Marker::Disc };
pub const UNCONVERGED: Style = Style { colour: picture::PURPLE, dash: Dash::None, marker: Marker::Cross };

impl Style {
    pub fn without_marker(self) -> Self {
        Style { marker: Marker::None, ..self }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    pub label: String,
    pub style: Style,
    /// Points outside the domain of an axis (not finite, or not positive on a logarithmic axis) are omitted and
    /// interrupt the line.
    pub points: Vec<(f64, f64)>,
    /// Standard errors of the points; empty without.
    pub errors: Vec<f64>,
}

impl Curve {
    pub fn new(label: impl Into<String>, style: Style, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Curve { label: label.into(), style, points: points.into_iter().collect(), errors: Vec::new() }
    }

    /// Without markers.
    pub fn line(label: impl Into<String>, style: Style, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Curve::new(label, style.without_marker(), points)
    }
}

/// Widths of a figure on the page, px: alone, and one of several in a row.
pub const WHOLE: f64 = 500.0;
pub const PANEL: f64 = 270.0;

/// A frame with its curves.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    pub x: AxisScale,
    pub y: AxisScale,
    pub curves: Vec<Curve>,
    /// Points that the axes must include.
    pub include: Vec<(f64, f64)>,
    /// Height over width of the whole figure.
    pub proportion: f64,
    /// [`WHOLE`] or [`PANEL`].
    pub width: f64,
}

/// Frame and axes of a drawing.
struct PlotLayout {
    format: DrawingSize,
    /// Edges of the frame: left, right, top, bottom.
    frame: [f64; 4],
    height: f64,
    x: PlotAxis,
    y: PlotAxis,
}

impl PlotLayout {
    fn place(&self, point: &(f64, f64)) -> (f64, f64) {
        let [left, right, top, bottom] = self.frame;
        (left + self.x.place(point.0) * (right - left), bottom - self.y.place(point.1) * (bottom - top))
    }
}

impl Plot {
    /// A plot against p* with the axis of how loads are named.
    pub fn against(self, loads: GivenLoads) -> Self {
        self.with_loads(loads.quantity, loads.of_p_star)
    }

    /// A plot against loads, as p*, in Pa or in N, with their axis.
    pub fn against_quantity(self, quantity: LoadQuantity) -> Self {
        self.with_loads(quantity, 1.0)
    }

    /// `of_x`: the load of x = 1.
    fn with_loads(self, quantity: LoadQuantity, of_x: f64) -> Self {
        let largest = self.curves.iter().flat_map(|c| &c.points).map(|p| p.0.abs()).fold(0.0, f64::max);
        let (unit, label) = quantity.axis(largest * of_x);
        let at = |(x, y): (f64, f64)| (x * of_x / unit, y);
        let in_unit = |curve: Curve| Curve { points: curve.points.into_iter().map(at).collect(), ..curve };
        Plot {
            x: AxisScale { label, ..self.x },
            curves: self.curves.into_iter().map(in_unit).collect(),
            include: self.include.into_iter().map(at).collect(),
            ..self
        }
    }

    /// A frame of default proportions around its curves.
    pub fn new(x: AxisScale, y: AxisScale, curves: Vec<Curve>) -> Self {
        Plot { x, y, curves, include: Vec::new(), proportion: 0.6, width: WHOLE }
    }

    /// The drawing for the page.
    pub fn svg(&self) -> Option<String> {
        self.drawn(DrawingSize::page(self.width))
    }

    /// SVG text; `None` if no curve has a point in the domain of the axes.
    pub fn drawn(&self, format: DrawingSize) -> Option<String> {
        let curves: Vec<Curve> = self.curves.iter().filter_map(|c| self.shown(c)).collect();
        if curves.is_empty() {
            return None;
        }
        let include = self.shown(&Curve::new("", EXPECTED, self.include.clone()));
        let spread = |pick: fn(&(f64, f64)) -> f64| -> Vec<f64> {
            curves.iter().chain(&include).flat_map(|c| &c.points).filter(|p| is_seen(p)).map(pick).collect()
        };
        let (x, y) = (PlotAxis::new(self.x.log, &spread(|p| p.0)), PlotAxis::new(self.y.log, &spread(|p| p.1)));
        let t = format.text;
        let legend = legend_rows(&curves, format);
        let longest = y.labels().map(|l| l.chars().count()).max().unwrap_or(1).max(3) as f64;
        let top = LEGEND_ROW * t * legend.len() as f64 + 0.6 * t;
        let height = (top + self.proportion * format.width).ceil();
        // A label close to the right edge is centred at its tick.
        let last = x.labels().last().map_or(0, |l| l.chars().count());
        let right = format.width - (half_width(last) + 0.2).max(1.2) * t;
        let frame = [(longest * CHARACTER + 2.5) * t, right, top, height - 3.0 * t];
        let layout = PlotLayout { format, frame, height, x, y };
        Some(self.assemble(&layout, &curves, &legend))
    }

    fn assemble(&self, layout: &PlotLayout, curves: &[Curve], legend: &[Vec<(f64, usize)>]) -> String {
        let PlotLayout { frame: [left, right, top, bottom], format, height, x, y } = layout;
        let [x_label, y_label] = [&self.x, &self.y].map(|axis| escaped(&axis.label));
        let mut svg = format.open(*height, &format!("{y_label} against {x_label}"));
        // Axes for scripts: kind, and the values and positions of the ends.
        let axis = |axis: &AxisScale, scale: &PlotAxis| format!("{} {} {}", axis.kind(), scale.low, scale.high);
        let (along, up) = (axis(&self.x, x), axis(&self.y, y));
        let data = format!(
            " class=\"plot\" data-x=\"{along} {left:.2} {right:.2}\" data-y=\"{up} {bottom:.2} {top:.2}\" data-labels=\"{x_label}|{y_label}\""
        );
        svg.insert_str("<svg".len(), &data);
        self.axes(&mut svg, layout);
        for (number, curve) in curves.iter().enumerate() {
            let _ = write!(svg, "<g class=\"curve\" data-curve=\"{number}\" data-label=\"{}\">", escaped(&curve.label));
            self.curve(&mut svg, layout, curve);
            svg.push_str("</g>");
        }
        for (row, entries) in (0..).zip(legend) {
            for &(at, number) in entries {
                let (curve, t) = (&curves[number], format.text);
                let centre = (f64::from(row) + 0.5) * LEGEND_ROW * t + 0.2 * t;
                let _ = write!(svg, "<g class=\"key\" data-curve=\"{number}\">");
                line(&mut svg, &format!("M{at:.2} {centre:.2}h{:.2}", SAMPLE * t), curve.style, t);
                mark(&mut svg, (at + 0.5 * SAMPLE * t, centre), curve.style, t);
                text(&mut svg, (at + (SAMPLE + 0.4) * t, centre + 0.35 * t), "start", &curve.label);
                svg.push_str("</g>");
            }
        }
        svg.push_str("</svg>");
        svg
    }

    fn axes(&self, svg: &mut String, layout: &PlotLayout) {
        let PlotLayout { frame: [left, right, top, bottom], format, x, y, .. } = layout;
        let t = format.text;
        let at_x = |v: &f64| left + x.place(*v) * (right - left);
        let at_y = |v: &f64| bottom - y.place(*v) * (bottom - top);
        for (minor, width) in [(true, 0.04), (false, 0.07)] {
            let _ = write!(
                svg,
                "<path class=\"grid\" fill=\"none\" stroke=\"#dcdcdc\" stroke-width=\"{:.2}\" d=\"",
                width * t
            );
            for v in if minor { &x.minor } else { &x.ticks } {
                let _ = write!(svg, "M{:.2} {top:.2}V{bottom:.2}", at_x(v));
            }
            for v in if minor { &y.minor } else { &y.ticks } {
                let _ = write!(svg, "M{left:.2} {:.2}H{right:.2}", at_y(v));
            }
            svg.push_str("\"/>");
        }
        let ticks = |scale: &PlotAxis, at: &dyn Fn(&f64) -> f64, label: &str| Ticks {
            places: scale.ticks.iter().map(at).zip(scale.labels()).collect(),
            label: format!("{label}{}", scale.factor_note()),
        };
        let axis_ticks = [&ticks(x, &at_x, &self.x.label), &ticks(y, &at_y, &self.y.label)];
        let outline = format!("M{left:.2} {top:.2}V{bottom:.2}H{right:.2}");
        svg::axes(svg, t, &outline, layout.frame, axis_ticks);
    }

    /// Line, error bars and markers of a curve in axis coordinates.
    fn curve(&self, svg: &mut String, layout: &PlotLayout, curve: &Curve) {
        let t = layout.format.text;
        let seen = |p: &(f64, f64)| if is_seen(p) { Some(layout.place(p)) } else { None };
        let mut path = String::new();
        for piece in curve.points.split(|p| !is_seen(p)).filter(|piece| !piece.is_empty()) {
            for (k, (x, y)) in piece.iter().filter_map(seen).enumerate() {
                let _ = write!(path, "{}{x:.2} {y:.2}", if k == 0 { "M" } else { "L" });
            }
            // A line with a single point is drawn as a dot.
            if let ([alone], true) = (piece, curve.style.marker == Marker::None) {
                mark(svg, layout.place(alone), Style { marker: Marker::Disc, ..curve.style }, 0.4 * t);
            }
        }
        line(svg, &path, curve.style, t);
        let value = |v: f64| if self.y.log { 10f64.powf(v) } else { v };
        let mut bars = String::new();
        let known = |(p, e): &(&(f64, f64), &f64)| is_seen(p) && e.is_finite() && **e > 0.0;
        for (point, error) in curve.points.iter().zip(&curve.errors).filter(known) {
            let end = |v: f64| {
                let v = Some(self.y.place(v)).filter(|v| v.is_finite());
                layout.place(&(point.0, v.map_or(layout.y.low, |v| v.clamp(layout.y.low, layout.y.high))))
            };
            let ((x, low), (_, high)) = (end(value(point.1) - error), end(value(point.1) + error));
            let cap = 0.2 * t;
            let _ = write!(bars, "M{x:.2} {low:.2}V{high:.2}M{:.2} {high:.2}h{:.2}", x - cap, 2.0 * cap);
            let _ = write!(bars, "M{:.2} {low:.2}h{:.2}", x - cap, 2.0 * cap);
        }
        if !bars.is_empty() {
            line(svg, &bars, Style { dash: Dash::Solid, ..curve.style }, 0.6 * t);
        }
        curve.points.iter().filter_map(seen).for_each(|point| mark(svg, point, curve.style, t));
    }

    /// The curve in axis coordinates (logarithms on logarithmic axes).
    fn shown(&self, curve: &Curve) -> Option<Curve> {
        let points: Vec<(f64, f64)> = curve.points.iter().map(|p| (self.x.place(p.0), self.y.place(p.1))).collect();
        points.iter().any(is_seen).then(|| Curve { points, ..curve.clone() })
    }
}

/// Whether a point in axis coordinates can be drawn.
fn is_seen(point: &(f64, f64)) -> bool {
    point.0.is_finite() && point.1.is_finite()
}

/// Colour of a style; black follows the colour of the text, which is light on dark pages.
fn paint(style: Style) -> String {
    if style.colour == picture::BLACK { "currentColor".into() } else { css(style.colour) }
}

fn line(svg: &mut String, path: &str, style: Style, t: f64) {
    let dash = match style.dash {
        Dash::Solid => String::new(),
        Dash::Dashed => format!(" stroke-dasharray=\"{:.2} {:.2}\"", 0.7 * t, 0.35 * t),
        Dash::Dotted => format!(" stroke-dasharray=\"{:.2} {:.2}\"", 0.16 * t, 0.28 * t),
        Dash::None => return,
    };
    let _ = write!(
        svg,
        "<path class=\"line\" fill=\"none\" stroke=\"{}\" stroke-width=\"{:.2}\"{dash} d=\"{path}\"/>",
        paint(style),
        0.12 * t
    );
}

/// A marker centred at a point.
fn mark(svg: &mut String, (x, y): (f64, f64), style: Style, t: f64) {
    let r = 0.27 * t;
    let circle = |r: f64| {
        format!("M{:.2} {y:.2}a{r:.2} {r:.2} 0 1 0 {:.2} 0a{r:.2} {r:.2} 0 1 0 {:.2} 0z", x - r, 2.0 * r, -2.0 * r)
    };
    let Some((outline, fill, _)) = style.marker.look() else { return };
    let shape = match fill {
        _ if outline.is_empty() => circle(r),
        Fill::None => outline.iter().fold(String::new(), |d, (dx, dy)| {
            d + &format!("M{:.2} {:.2}L{:.2} {:.2}", x - r * dx, y - r * dy, x + r * dx, y + r * dy)
        }),
        Fill::Full | Fill::White => {
            let corners = outline.iter().map(|(dx, dy)| format!("{:.2} {:.2}", x + r * dx, y + r * dy));
            format!("M{}z", corners.collect::<Vec<_>>().join("L"))
        }
    };
    let (colour, width) = (paint(style), 0.11 * t);
    let stroke = format!("stroke=\"{colour}\" stroke-width=\"{width:.2}\"");
    let _ = match fill {
        Fill::Full => write!(svg, "<path class=\"mark\" fill=\"{colour}\" d=\"{shape}\"/>"),
        Fill::White => write!(svg, "<path class=\"mark open\" fill=\"#fff\" {stroke} d=\"{shape}\"/>"),
        Fill::None => write!(svg, "<path class=\"mark\" fill=\"none\" {stroke} d=\"{shape}\"/>"),
    };
    if style.marker == Marker::Target {
        let _ = write!(svg, "<path fill=\"{colour}\" d=\"{}\"/>", circle(r / 3.0));
    }
}

/// Legend entries (position, index of the curve), broken into rows that fit the width.
fn legend_rows(curves: &[Curve], format: DrawingSize) -> Vec<Vec<(f64, usize)>> {
    let mut rows: Vec<Vec<(f64, usize)>> = Vec::new();
    let (t, mut at) = (format.text, format.width);
    for (number, curve) in curves.iter().enumerate().filter(|(_, c)| !c.label.is_empty()) {
        let width = (SAMPLE + 1.4 + curve.label.chars().count() as f64 * CHARACTER) * t;
        if at + width > format.width {
            rows.push(Vec::new());
            at = t;
        }
        if let Some(row) = rows.last_mut() {
            row.push((at, number));
        }
        at += width;
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_shows_what_it_can_and_nothing_of_the_rest() {
        let plot = |points: Vec<(f64, f64)>| {
            Plot::new(log("mode"), linear("a < b"), vec![Curve::new("atoms & wall", ATOMS, points)])
        };
        let svg = plot(vec![(1.0, 2.0), (10.0, 4.0), (0.0, 1.0), (5.0, f64::NAN)]).svg().unwrap();
        assert_eq!(svg.matches("class=\"mark\"").count(), 3, "two points and one in the legend");
        let lines = |svg: &str| svg.matches("M").count();
        let mut points = vec![(1.0, 2.0), (2.0, 2.0), (4.0, 2.0), (5.0, 2.0)];
        let whole = plot(points.clone()).svg().unwrap();
        points.insert(2, (3.0, f64::NAN));
        assert_eq!(lines(&plot(points).svg().unwrap()), lines(&whole) + 1, "a line in two pieces");
        assert!(svg.contains("atoms &amp; wall") && svg.contains("a &lt; b"));
        assert_eq!(plot(vec![(-1.0, 2.0)]).svg(), None);
    }
}
