//! SVG of a map with axes and colour bar.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::number::{si_scale, trimmed};
use super::picture::{self, BLACK, ColourRange, Picture, Rgb};
use super::scale::round_step;
use super::svg::{self, DrawingSize, Ticks, css, escaped, half_width, text};

/// Widths on the page of a frame alone, and of one of several in a row, px.
pub(super) const ALONE: f64 = 500.0;
pub(super) const IN_A_ROW: f64 = 235.0;

/// Label of heights: those of results have the sign of the solver, whatever the file has.
pub(super) const HEIGHT: &str = "height, low points touch first";

const STOPS: u32 = 24;

/// Quantity and unit of a colour bar.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Bar {
    pub quantity: &'static str,
    /// Range in `unit`, values of the map per `unit`, and whether some values exceed the end of the range.
    pub range: ColourRange,
    pub unit: String,
    pub factor: f64,
    pub clipped: bool,
    /// Contact is black.
    pub over_contact: bool,
}

impl Bar {
    /// Of values in `unit`: a metre or a pascal gets the SI prefix that suits the upper end.
    pub(super) fn new(quantity: &'static str, range: ColourRange, unit: &str) -> Self {
        let prefixed = ["m", "Pa"].contains(&unit);
        let (factor, prefix) = if prefixed { si_scale(range.low.abs().max(range.high.abs())) } else { (1.0, "") };
        let range = ColourRange { low: range.low / factor, high: range.high / factor };
        Bar { quantity, range, unit: format!("{prefix}{unit}"), factor, clipped: false, over_contact: false }
    }

    /// `gap (µm)`.
    pub(super) fn label(&self) -> String {
        if self.unit.is_empty() { self.quantity.into() } else { format!("{} ({})", self.quantity, self.unit) }
    }
}

/// A map with the data of its frame.
pub(super) struct MapFigure<'a> {
    /// Unique name on the page, for the id of the colour gradient.
    pub name: &'a str,
    pub alt: &'a str,
    pub picture: &'a Picture,
    /// Extents of the cell along x and y, m.
    pub cell_m: [f64; 2],
    /// Without a colour bar the caption explains the colours.
    pub bar: Option<Bar>,
}

impl MapFigure<'_> {
    pub(super) fn svg(&self, png: &[u8], format: DrawingSize) -> String {
        let (t, width) = (format.text, format.width);
        let (scale, prefix) = si_scale(self.cell_m[0]);
        let [x_ticks, y_ticks] = self.cell_m.map(|l| ticks(l / scale));
        // A label at the right edge is centred at it.
        let last = x_ticks.last().map_or(0, |v| trimmed(*v, 4).chars().count());
        let (left, right, top) = (3.4 * t, (half_width(last) + 0.2) * t, 0.5 * t);
        let across = width - left - right;
        let down = across * self.cell_m[1] / self.cell_m[0];
        let below = top + down;
        let key = self.picture.key;
        let rows = self.bar.as_ref().map_or(KEY_ROW * key.len() as f64, |bar| if bar.over_contact { 5.3 } else { 4.1 });
        let mut svg = format.open(below + (2.9 + rows) * t, &escaped(self.alt));
        // Writing into a string does not fail.
        let _ = write!(
            svg,
            "<image x=\"{left:.2}\" y=\"{top:.2}\" width=\"{across:.2}\" height=\"{down:.2}\" preserveAspectRatio=\"none\" \
             style=\"image-rendering:pixelated\" href=\"data:image/png;base64,{}\"/>",
            STANDARD.encode(png)
        );
        let outline = format!("M{left:.2} {top:.2}h{across:.2}v{down:.2}h{:.2}z", -across);
        let at_x = |v: f64| left + across * v * scale / self.cell_m[0];
        let at_y = |v: f64| below - down * v * scale / self.cell_m[1];
        let ticks = |list: &[f64], at: &dyn Fn(f64) -> f64, axis: &str| Ticks {
            places: list.iter().map(|v| (at(*v), trimmed(*v, 4))).collect(),
            label: format!("{axis} ({prefix}m)"),
        };
        let axis_ticks = [&ticks(&x_ticks, &at_x, "x"), &ticks(&y_ticks, &at_y, "y")];
        svg::axes(&mut svg, t, &outline, [left, left + across, top, below], axis_ticks);
        if let Some(bar) = &self.bar {
            self.draw_bar(&mut svg, bar, t, (left, below + 3.3 * t, across));
        }
        for (row, (colour, meaning)) in (0..).zip(key) {
            key_entry(&mut svg, (left, below + (3.3 + KEY_ROW * f64::from(row)) * t), t, (*colour, meaning));
        }
        svg.push_str("</svg>");
        svg
    }

    fn draw_bar(&self, svg: &mut String, bar: &Bar, t: f64, (left, top, across): (f64, f64, f64)) {
        let colour = if bar.over_contact { picture::over_contact } else { picture::colour };
        let _ = write!(svg, "<defs><linearGradient id=\"ramp-{}\">", escaped(self.name));
        for i in 0..=STOPS {
            let share = f64::from(i) / f64::from(STOPS);
            let _ = write!(svg, "<stop offset=\"{share:.4}\" stop-color=\"{}\"/>", css(colour(share)));
        }
        let (name, high, line) = (escaped(self.name), 0.8 * t, 0.06 * t);
        let _ = write!(
            svg,
            "</linearGradient></defs><rect x=\"{left:.2}\" y=\"{top:.2}\" width=\"{across:.2}\" height=\"{high:.2}\" \
             fill=\"url(#ramp-{name})\" stroke=\"currentColor\" stroke-width=\"{line:.2}\"/>"
        );
        let labels = top + 2.0 * t;
        text(svg, (left, labels), "start", &trimmed(bar.range.low, 3));
        let high = format!("{}{}", if bar.clipped { "≥ " } else { "" }, trimmed(bar.range.high, 3));
        text(svg, (left + across, labels), "end", &high);
        text(svg, (left + 0.5 * across, labels + 1.2 * t), "middle", &bar.label());
        if bar.over_contact {
            key_entry(svg, (left, labels + 1.8 * t), t, (BLACK, "contact"));
        }
    }
}

/// Height of an entry of a key, in text heights.
const KEY_ROW: f64 = 1.3;

/// A colour and its meaning.
fn key_entry(svg: &mut String, (left, top): (f64, f64), t: f64, (colour, meaning): (Rgb, &str)) {
    let (side, line, colour) = (0.8 * t, 0.06 * t, css(colour));
    let _ = write!(
        svg,
        "<rect x=\"{left:.2}\" y=\"{top:.2}\" width=\"{side:.2}\" height=\"{side:.2}\" fill=\"{colour}\" stroke=\"#888\" stroke-width=\"{line:.2}\"/>"
    );
    text(svg, (left + 1.2 * t, top + 0.75 * t), "start", meaning);
}

/// At most six round numbers from zero to an extent.
fn ticks(extent: f64) -> Vec<f64> {
    let step = round_step(extent / 5.0);
    (0..=(extent / step + 1e-9).floor() as usize).map(|i| i as f64 * step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::downsample::DownsampledMap;

    #[test]
    fn ticks_are_round_and_within() {
        assert_eq!(ticks(100.0), [0.0, 20.0, 40.0, 60.0, 80.0, 100.0]);
        assert_eq!(ticks(25.1), [0.0, 10.0, 20.0]);
        assert_eq!(ticks(9.78), [0.0, 2.0, 4.0, 6.0, 8.0]);
    }

    #[test]
    fn a_frame_tells_lengths_values_and_contact() {
        let picture = picture::contact(&DownsampledMap { nx: 1, ny: 1, factor: 1, values: vec![0.0] }, BLACK);
        let svg = |bar| {
            MapFigure { name: "gap-1", alt: "gap at p* < 1", picture: &picture, cell_m: [1e-4, 5e-5], bar }
                .svg(b"not looked at", DrawingSize::page(IN_A_ROW))
        };
        let bar = Bar::new("gap", ColourRange { low: 0.0, high: 2.5e-6 }, "m");
        let svg_of_gap = svg(Some(Bar { clipped: true, over_contact: true, ..bar }));
        for piece in [
            "x (µm)",
            "y (µm)",
            ">100<",
            ">40<",
            ">≥ 2.5<",
            ">gap (µm)<",
            ">contact<",
            "p* &lt; 1",
            "id=\"ramp-gap-1\"",
        ] {
            assert!(svg_of_gap.contains(piece), "{piece}: {svg_of_gap}");
        }
        assert!(!svg(None).contains("linearGradient"));
        let keyed = picture.clone().keyed(&[(BLACK, "both")]);
        let cell_m = [1e-4, 5e-5];
        let keyed = MapFigure { name: "both", alt: "", picture: &keyed, cell_m, bar: None };
        assert!(keyed.svg(b"", DrawingSize::page(IN_A_ROW)).contains(">both<"));
    }
}
