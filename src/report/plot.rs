//! Curves as SVG: linear or logarithmic axes, a legend above the frame, and a dash pattern and a marker for every
//! curve, so that curves can also be distinguished in greyscale.

use plotters::coord::Shift;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::number::{superscript, trimmed};
use super::picture::{self, Rgb};

/// Width of a figure. The backend rounds coordinates to integers; at twice the displayed size the rounding is below
/// half a pixel.
pub const WHOLE: u32 = 1440;
/// Width of one of several figures in a row; its text is displayed at the same size.
pub const PANEL: u32 = 640;
const TEXT: i32 = 33;
const LEGEND_ROW: i32 = 46;
/// Mean character width over the nominal font size, sans-serif; used only for line breaks of the legend and tick
/// labels.
const CHARACTER: f64 = 0.45;
/// Length of a line sample in the legend, and the room between its entries.
const SAMPLE: i32 = 84;

type Drawn = Result<(), Box<dyn std::error::Error>>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Axis {
    Linear,
    Log,
}

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

impl Marker {
    /// Markers that can be distinguished in greyscale, filled and open in turn.
    pub const DISTINCT: [Marker; 14] = [
        Marker::Disc,
        Marker::Frame,
        Marker::Triangle,
        Marker::OpenDiamond,
        Marker::Cross,
        Marker::Square,
        Marker::Ring,
        Marker::Down,
        Marker::OpenTriangle,
        Marker::Plus,
        Marker::Diamond,
        Marker::OpenDown,
        Marker::Star,
        Marker::Target,
    ];
}

/// Style of a curve. With the constants below an object has the same style in all figures of a report.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Style {
    pub colour: Rgb,
    pub dash: Dash,
    pub marker: Marker,
}

pub const ATOMS: Style = Style { colour: picture::BLUE, dash: Dash::Solid, marker: Marker::Disc };
pub const HARD: Style = Style { colour: picture::ORANGE, dash: Dash::Dashed, marker: Marker::Square };
pub const THRESHOLD: Style = Style { colour: picture::GREEN, dash: Dash::Dashed, marker: Marker::Ring };
pub const SOFT: Style = Style { colour: picture::VERMILION, dash: Dash::Dotted, marker: Marker::Triangle };
/// Compliant wall with hardness.
pub const YIELDING: Style = Style { colour: picture::BLACK, dash: Dash::Dotted, marker: Marker::Star };
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

    fn shape(self, width: u32) -> ShapeStyle {
        let [r, g, b] = self.colour;
        RGBColor(r, g, b).stroke_width(width)
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    pub label: String,
    pub style: Style,
    /// Points outside the domain of an axis (not finite, or not positive on a logarithmic axis) are omitted and
    /// interrupt the line.
    pub points: Vec<(f64, f64)>,
}

/// A frame with its curves.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    pub x: Axis,
    pub y: Axis,
    /// Axis labels with the unit in brackets.
    pub x_label: String,
    pub y_label: String,
    pub curves: Vec<Curve>,
    /// Points that the axes must include.
    pub include: Vec<(f64, f64)>,
    /// Height over width of the whole figure.
    pub proportion: f64,
    /// [`WHOLE`] or [`PANEL`].
    pub width: u32,
}

impl Plot {
    /// A frame of default proportions around its curves; labels include units.
    pub fn new((x, y): (Axis, Axis), (x_label, y_label): (&str, &str), curves: Vec<Curve>) -> Self {
        let (x_label, y_label) = (x_label.into(), y_label.into());
        Plot { x, y, x_label, y_label, curves, include: Vec::new(), proportion: 0.55, width: WHOLE }
    }

    /// SVG text; `None` if no curve has a point in the domain of the axes.
    pub fn svg(&self) -> Option<String> {
        let curves: Vec<Curve> = self.curves.iter().filter_map(|c| self.shown(c)).collect();
        if curves.is_empty() {
            return None;
        }
        let include = Curve { label: String::new(), style: EXPECTED, points: self.include.clone() };
        let include = self.shown(&include);
        let spread = |pick: fn(&(f64, f64)) -> f64| -> Vec<f64> {
            curves.iter().chain(&include).flat_map(|c| &c.points).filter(|p| is_seen(p)).map(pick).collect()
        };
        let x = Scale::new(self.x, &spread(|p| p.0));
        let y = Scale::new(self.y, &spread(|p| p.1));
        let mut text = String::new();
        // Drawing into a string fails only in the backend; an incomplete figure is discarded.
        self.draw(&mut text, &curves, &x, &y).ok()?;
        Some(text)
    }

    /// The curve in axis coordinates (logarithms on logarithmic axes).
    fn shown(&self, curve: &Curve) -> Option<Curve> {
        let along = |axis: Axis, v: f64| if axis == Axis::Log { v.log10() } else { v };
        let points: Vec<(f64, f64)> = curve.points.iter().map(|p| (along(self.x, p.0), along(self.y, p.1))).collect();
        points.iter().any(is_seen).then(|| Curve { label: curve.label.clone(), style: curve.style, points })
    }

    fn draw(&self, text: &mut String, curves: &[Curve], x: &Scale, y: &Scale) -> Drawn {
        let rows = legend_rows(curves, self.width);
        let legend = LEGEND_ROW * rows.len() as i32 + 10;
        let height = (self.proportion * f64::from(self.width)) as i32 + legend;
        let root = SVGBackend::with_string(text, (self.width, height as u32)).into_drawing_area();
        root.fill(&plotters::style::WHITE)?;
        let (top, frame) = root.split_vertically(legend);
        draw_legend(&top, &rows)?;
        // Space for the longest horizontal tick label: about half a font size per character.
        let y_room =
            y.labels().map(|l| l.chars().count()).max().unwrap_or(1).max(5) as f64 * CHARACTER * f64::from(TEXT);
        let mut chart = ChartBuilder::on(&frame)
            // The rotated axis label starts at the edge; accents and brackets extend above its capitals.
            .margin_left(8)
            .margin_right(60)
            .margin_top(14)
            .x_label_area_size(92)
            .y_label_area_size(y_room as i32 + 92)
            .build_cartesian_2d(x.clone(), y.clone())?;
        chart
            .configure_mesh()
            .bold_line_style(RGBColor(214, 214, 214).stroke_width(2))
            .light_line_style(RGBColor(240, 240, 240).stroke_width(2))
            .axis_style(BLACK.stroke_width(2))
            .label_style(("sans-serif", TEXT).into_font().color(&BLACK))
            .axis_desc_style(("sans-serif", TEXT + 2).into_font().color(&BLACK))
            .set_tick_mark_size(LabelAreaPosition::Left, 10)
            .set_tick_mark_size(LabelAreaPosition::Bottom, 10)
            .x_labels(x.ticks.len())
            .y_labels(y.ticks.len())
            .x_desc(format!("{}{}", self.x_label, x.factor_note()))
            .y_desc(format!("{}{}", self.y_label, y.factor_note()))
            .draw()?;
        for curve in curves {
            for piece in curve.points.split(|p| !is_seen(p)).filter(|piece| !piece.is_empty()) {
                let (points, line) = (piece.iter().copied(), curve.style.shape(4));
                match (curve.style.dash, piece) {
                    // A line with a single point is drawn as a dot.
                    (Dash::Solid | Dash::Dashed | Dash::Dotted, [alone]) => {
                        root.draw(&Circle::new(chart.backend_coord(alone), 3, line.filled()))?;
                    }
                    (Dash::Solid, _) => chart.draw_series(LineSeries::new(points, line)).map(|_| ())?,
                    (Dash::Dashed, _) => {
                        chart.draw_series(DashedLineSeries::new(points, 22, 12, line)).map(|_| ())?;
                    }
                    (Dash::Dotted, _) => chart.draw_series(DashedLineSeries::new(points, 6, 10, line)).map(|_| ())?,
                    (Dash::None, _) => (),
                }
                for point in piece {
                    mark(&root, chart.backend_coord(point), curve.style)?;
                }
            }
        }
        root.present()?;
        Ok(())
    }
}

/// Whether a point in axis coordinates can be drawn.
fn is_seen(point: &(f64, f64)) -> bool {
    point.0.is_finite() && point.1.is_finite()
}

/// A marker centred at a pixel.
fn mark(area: &Area, (x, y): (i32, i32), style: Style) -> Drawn {
    const R: i32 = 9;
    let fill = style.shape(1).filled();
    let square = |r: i32| vec![(x - r, y - r), (x + r, y - r), (x + r, y + r), (x - r, y + r)];
    let triangle = |up: i32| vec![(x, y - up * (R + 2)), (x + R + 1, y + up * R), (x - R - 1, y + up * R)];
    let diamond = || vec![(x, y - R - 3), (x + R + 3, y), (x, y + R + 3), (x - R - 3, y)];
    let open = |mut outline: Vec<(i32, i32)>| -> Drawn {
        area.draw(&Polygon::new(outline.clone(), plotters::style::WHITE.filled()))?;
        outline.push(outline[0]);
        Ok(area.draw(&PathElement::new(outline, style.shape(4)))?)
    };
    let strokes = |ends: &[[(i32, i32); 2]]| -> Drawn {
        for line in ends {
            area.draw(&PathElement::new(line.to_vec(), style.shape(5)))?;
        }
        Ok(())
    };
    let cross = [[(x - R, y - R), (x + R, y + R)], [(x + R, y - R), (x - R, y + R)]];
    let plus = [[(x, y - R - 2), (x, y + R + 2)], [(x - R - 2, y), (x + R + 2, y)]];
    match style.marker {
        Marker::None => (),
        Marker::Disc => area.draw(&Circle::new((x, y), R, fill))?,
        Marker::Ring | Marker::Target => {
            area.draw(&Circle::new((x, y), R, plotters::style::WHITE.filled()))?;
            area.draw(&Circle::new((x, y), R, style.shape(4)))?;
            if style.marker == Marker::Target {
                area.draw(&Circle::new((x, y), R / 3, fill))?;
            }
        }
        Marker::Square => area.draw(&Polygon::new(square(R - 1), fill))?,
        Marker::Frame => open(square(R - 1))?,
        Marker::Triangle => area.draw(&Polygon::new(triangle(1), fill))?,
        Marker::OpenTriangle => open(triangle(1))?,
        Marker::Down => area.draw(&Polygon::new(triangle(-1), fill))?,
        Marker::OpenDown => open(triangle(-1))?,
        Marker::Diamond => area.draw(&Polygon::new(diamond(), fill))?,
        Marker::OpenDiamond => open(diamond())?,
        Marker::Cross => strokes(&cross)?,
        Marker::Plus => strokes(&plus)?,
        Marker::Star => {
            strokes(&cross)?;
            strokes(&plus)?;
        }
    }
    Ok(())
}

/// Legend entries, broken into rows that fit the width.
fn legend_rows(curves: &[Curve], whole: u32) -> Vec<Vec<(i32, &Curve)>> {
    let mut rows: Vec<Vec<(i32, &Curve)>> = Vec::new();
    let mut at = whole as i32;
    for curve in curves.iter().filter(|c| !c.label.is_empty()) {
        let width = SAMPLE + 16 + (curve.label.chars().count() as f64 * CHARACTER * f64::from(TEXT)) as i32 + 44;
        if at + width > whole as i32 - 20 {
            rows.push(Vec::new());
            at = 30;
        }
        if let Some(row) = rows.last_mut() {
            row.push((at, curve));
        }
        at += width;
    }
    rows
}

fn draw_legend(area: &Area, rows: &[Vec<(i32, &Curve)>]) -> Drawn {
    let words = ("sans-serif", TEXT).into_font().color(&BLACK).pos(Pos::new(HPos::Left, VPos::Center));
    for (number, row) in (0..).zip(rows) {
        let y = LEGEND_ROW / 2 + 6 + LEGEND_ROW * number;
        for &(x, curve) in row {
            let line = [(x, y), (x + SAMPLE, y)];
            let dash = |on: i32, off: i32| -> Drawn {
                let mut from = x;
                while from < x + SAMPLE {
                    let piece = vec![(from, y), ((from + on).min(x + SAMPLE), y)];
                    area.draw(&PathElement::new(piece, curve.style.shape(4)))?;
                    from += on + off;
                }
                Ok(())
            };
            match curve.style.dash {
                Dash::Solid => area.draw(&PathElement::new(line.to_vec(), curve.style.shape(4)))?,
                Dash::Dashed => dash(22, 12)?,
                Dash::Dotted => dash(6, 10)?,
                Dash::None => (),
            }
            mark(area, (x + SAMPLE / 2, y), curve.style)?;
            area.draw(&Text::new(curve.label.clone(), (x + SAMPLE + 16, y), words.clone()))?;
        }
    }
    Ok(())
}

/// Number of decades below which multiples of powers of ten are also labelled.
const FEW_DECADES: f64 = 3.0;

/// Range and ticks of an axis, in axis coordinates.
#[derive(Debug, Clone, PartialEq)]
struct Scale {
    axis: Axis,
    low: f64,
    high: f64,
    ticks: Vec<f64>,
    minor: Vec<f64>,
    step: f64,
    /// Power of ten factored out of the labels of a linear axis.
    power: i32,
}

impl Scale {
    fn new(axis: Axis, values: &[f64]) -> Self {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        match axis {
            Axis::Linear => Self::linear(low, high),
            Axis::Log => Self::logarithmic(low, high),
        }
    }

    fn linear(low: f64, high: f64) -> Self {
        // A single value gets a margin on both sides.
        let half = if high > low { 0.0 } else { (0.1 * low.abs()).max(1e-12) };
        let (low, high) = (low - half, high + half);
        let rough = (high - low) / 6.0;
        let decade = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 2.5, 5.0, 10.0]
            .into_iter()
            .map(|m| m * decade)
            .find(|s| *s >= 0.999_999 * rough)
            .unwrap_or(rough);
        let room = 0.03 * (high - low);
        // An axis that would start close to zero starts at zero, without a margin below data that are never negative.
        let low = if low >= 0.0 && low < 0.3 * high { 0.0 } else { low - room };
        let high = high + room;
        let (first, last) = ((low / step).ceil() as i64, (high / step + 1e-9).floor() as i64);
        let largest = low.abs().max(high.abs());
        let power = if (1e-2..1e5).contains(&largest) { 0 } else { largest.log10().floor() as i32 };
        let ticks = (first..=last).map(|i| i as f64 * step).collect();
        Scale { axis: Axis::Linear, low, high, ticks, minor: Vec::new(), step, power }
    }

    fn logarithmic(low: f64, high: f64) -> Self {
        let room = (0.03 * (high - low)).max(0.05);
        let (low, high) = (low - room, high + room);
        let (first, last) = (low.ceil() as i32, high.floor() as i32);
        let every = ((last - first) / 8 + 1).max(1);
        let within = |v: &f64| *v >= low && *v <= high;
        let multiples = |of: &[f64]| -> Vec<f64> {
            (first - 1..=last).flat_map(|d| of.iter().map(move |m| f64::from(d) + m.log10())).filter(within).collect()
        };
        let decades = (first..=last).filter(|d| (d - first) % every == 0).map(f64::from).collect::<Vec<f64>>();
        // Over fewer than three decades, powers of ten alone are too few labels.
        let ticks = if high - low < FEW_DECADES { multiples(&[1.0, 2.0, 5.0]) } else { decades };
        let minor = if every == 1 { multiples(&[2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]) } else { Vec::new() };
        Scale { axis: Axis::Log, low, high, ticks, minor, step: 1.0, power: 0 }
    }

    fn label(&self, v: f64) -> String {
        match self.axis {
            // If multiples are labelled, powers of ten have the same format.
            Axis::Log if self.high - self.low >= FEW_DECADES && v.fract() == 0.0 && !(-2.0..=4.0).contains(&v) => {
                format!("10{}", superscript(v as i32))
            }
            Axis::Log => trimmed(10f64.powf(v), 2),
            Axis::Linear => {
                let factor = 10f64.powi(self.power);
                let step = self.step / factor;
                // A step of 2.5 needs one more decimal than its decade.
                let mantissa = step / 10f64.powf(step.log10().floor());
                let whole = (mantissa - mantissa.round()).abs() < 1e-6;
                let decimals = (-(step.log10().floor()) + if whole { 0.0 } else { 1.0 }).max(0.0) as usize;
                let text = format!("{:.decimals$}", v / factor);
                // A negative rounding error must not be printed as "−0.0".
                if text.trim_matches(['-', '0', '.']).is_empty() { "0".into() } else { text.replace('-', "−") }
            }
        }
    }

    fn labels(&self) -> impl Iterator<Item = String> {
        self.ticks.iter().map(|t| self.label(*t))
    }

    fn factor_note(&self) -> String {
        if self.power == 0 { String::new() } else { format!(" × 10{}", superscript(-self.power)) }
    }
}

impl Ranged for Scale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let share = (value - self.low) / (self.high - self.low);
        limit.0 + (share * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() { self.minor.clone() } else { self.ticks.clone() }
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.low..self.high
    }
}

impl ValueFormatter<f64> for Scale {
    fn format_ext(&self, value: &f64) -> String {
        self.label(*value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: Axis, low: f64, high: f64) -> Vec<String> {
        Scale::new(axis, &[low, high]).labels().collect()
    }

    #[test]
    fn ticks_people_would_choose() {
        assert_eq!(labels(Axis::Linear, 0.01, 0.1), ["0", "0.02", "0.04", "0.06", "0.08", "0.10"]);
        assert_eq!(labels(Axis::Linear, -1.0, 1.0), ["−1.0", "−0.5", "0", "0.5", "1.0"]);
        assert_eq!(labels(Axis::Log, -1.0, 2.0), ["0.1", "1", "10", "100"]);
        assert_eq!(labels(Axis::Log, -8.0, -5.0), ["10⁻⁸", "10⁻⁷", "10⁻⁶", "10⁻⁵"]);
        let path = ["0.001", "0.002", "0.005", "0.01", "0.02", "0.05", "0.1", "0.2"];
        assert_eq!(labels(Axis::Log, -3.0, 0.3_f64.log10()), path);
        assert_eq!(labels(Axis::Log, 0.02_f64.log10(), 0.09_f64.log10()), ["0.02", "0.05", "0.1"]);
        let small = Scale::new(Axis::Linear, &[0.0, 3e-5]);
        assert_eq!(small.factor_note(), " × 10⁵");
        assert!(small.labels().any(|l| l == "1.0"), "{:?}", small.labels().collect::<Vec<_>>());
        assert_eq!(labels(Axis::Linear, 5.0, 5.0).len(), 5);
    }

    #[test]
    fn a_plot_shows_what_it_can_and_nothing_of_the_rest() {
        let plot = |points: Vec<(f64, f64)>| {
            let curves = vec![Curve { label: "atoms & wall".into(), style: ATOMS, points }];
            Plot::new((Axis::Log, Axis::Linear), ("mode", "a < b"), curves)
        };
        let svg = plot(vec![(1.0, 2.0), (10.0, 4.0), (0.0, 1.0), (5.0, f64::NAN)]).svg().unwrap();
        assert_eq!(svg.matches("<circle").count(), 3, "two points and one in the legend");
        let lines = |svg: &str| svg.matches("<polyline").count();
        let mut points = vec![(1.0, 2.0), (2.0, 2.0), (4.0, 2.0), (5.0, 2.0)];
        let whole = plot(points.clone()).svg().unwrap();
        points.insert(2, (3.0, f64::NAN));
        assert_eq!(lines(&plot(points).svg().unwrap()), lines(&whole) + 1, "a line in two pieces");
        assert!(svg.contains("atoms &amp; wall") && svg.contains("a &lt; b"));
        assert_eq!(plot(vec![(-1.0, 2.0)]).svg(), None);
    }
}
