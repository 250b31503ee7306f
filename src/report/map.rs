//! SVG of a map with axes and colour bar.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::number::{si_scale, trimmed};
use super::picture::{self, BLACK, Range};
use super::svg::{Format, css, escaped, half_width, text};

/// Widths on the page of a frame alone, and of one of several in a row, px.
pub(super) const ALONE: f64 = 500.0;
pub(super) const IN_A_ROW: f64 = 235.0;

const STOPS: u32 = 24;

/// Quantity and unit of a colour bar.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Bar {
    pub quantity: &'static str,
    /// Range in `unit`, values of the map per `unit`, and whether some values exceed the end of the range.
    pub range: Range,
    pub unit: String,
    pub factor: f64,
    pub clipped: bool,
}

impl Bar {
    /// With the SI prefix that suits the upper end; values in `unit` without prefix.
    pub(super) fn prefixed(quantity: &'static str, range: Range, unit: &str, clipped: bool) -> Self {
        let (factor, prefix) = si_scale(range.low.abs().max(range.high.abs()));
        let range = Range { low: range.low / factor, high: range.high / factor };
        Bar { quantity, range, unit: format!("{prefix}{unit}"), factor, clipped }
    }

    /// In the given unit.
    pub(super) fn plain(quantity: &'static str, range: Range, unit: &str, clipped: bool) -> Self {
        Bar { quantity, range, unit: unit.into(), factor: 1.0, clipped }
    }

    /// `gap (µm)`.
    pub(super) fn label(&self) -> String {
        if self.unit.is_empty() { self.quantity.into() } else { format!("{} ({})", self.quantity, self.unit) }
    }
}

/// Meaning of the colours.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Legend {
    Ramp(Bar),
    /// The same, with contact in black.
    OverContact(Bar),
    /// No colour bar; the caption explains the colours.
    None,
}

/// A map with the data of its frame.
pub(super) struct Framed<'a> {
    /// Unique name on the page, for the id of the colour gradient.
    pub name: &'a str,
    pub alt: &'a str,
    pub png: &'a [u8],
    /// Extents of the cell along x and y, m.
    pub cell_m: [f64; 2],
    pub legend: Legend,
    pub format: Format,
}

impl Framed<'_> {
    pub(super) fn svg(&self) -> String {
        let (t, width) = (self.format.text, self.format.width);
        let (scale, prefix) = si_scale(self.cell_m[0]);
        let [x_ticks, y_ticks] = self.cell_m.map(|l| ticks(l / scale));
        // A label at the right edge is centred at it.
        let last = x_ticks.last().map_or(0, |v| trimmed(*v, 4).chars().count());
        let (left, right, top) = (3.4 * t, (half_width(last) + 0.2) * t, 0.5 * t);
        let across = width - left - right;
        let down = across * self.cell_m[1] / self.cell_m[0];
        let below = top + down;
        let rows = match self.legend {
            Legend::Ramp(_) => 4.1,
            Legend::OverContact(_) => 5.3,
            Legend::None => 0.0,
        };
        let alt = escaped(self.alt);
        let mut svg = self.format.open(below + (2.9 + rows) * t, &alt);
        // Writing into a string does not fail.
        let _ = write!(
            svg,
            "<image x=\"{left:.2}\" y=\"{top:.2}\" width=\"{across:.2}\" height=\"{down:.2}\" preserveAspectRatio=\"none\" \
             style=\"image-rendering:pixelated\" href=\"data:image/png;base64,{}\"/>\
             <path fill=\"none\" stroke=\"currentColor\" stroke-width=\"{:.2}\" d=\"M{left:.2} {top:.2}h{across:.2}v{down:.2}h{:.2}z",
            STANDARD.encode(self.png),
            0.08 * t,
            -across
        );
        let at_x = |v: f64| left + across * v * scale / self.cell_m[0];
        let at_y = |v: f64| below - down * v * scale / self.cell_m[1];
        for v in &x_ticks {
            let _ = write!(svg, "M{:.2} {below:.2}v{:.2}", at_x(*v), 0.35 * t);
        }
        for v in &y_ticks {
            let _ = write!(svg, "M{left:.2} {:.2}h{:.2}", at_y(*v), -0.35 * t);
        }
        svg.push_str("\"/>");
        for v in &x_ticks {
            text(&mut svg, (at_x(*v), below + 1.3 * t), "middle", &trimmed(*v, 4));
        }
        for v in &y_ticks {
            text(&mut svg, (left - 0.5 * t, at_y(*v) + 0.35 * t), "end", &trimmed(*v, 4));
        }
        text(&mut svg, (left + 0.5 * across, below + 2.5 * t), "middle", &format!("x ({prefix}m)"));
        let _ = write!(
            svg,
            "<text transform=\"translate({t:.2} {:.2}) rotate(-90)\" text-anchor=\"middle\" fill=\"currentColor\">y ({prefix}m)</text>",
            top + 0.5 * down
        );
        match &self.legend {
            Legend::Ramp(bar) => self.bar(&mut svg, bar, false, (left, below + 3.3 * t, across)),
            Legend::OverContact(bar) => self.bar(&mut svg, bar, true, (left, below + 3.3 * t, across)),
            Legend::None => (),
        }
        svg.push_str("</svg>");
        svg
    }

    fn bar(&self, svg: &mut String, bar: &Bar, over: bool, (left, top, across): (f64, f64, f64)) {
        let t = self.format.text;
        let colour = if over { picture::over_contact } else { picture::colour };
        let _ = write!(svg, "<defs><linearGradient id=\"ramp-{}\">", escaped(self.name));
        for i in 0..=STOPS {
            let share = f64::from(i) / f64::from(STOPS);
            let _ = write!(svg, "<stop offset=\"{share:.4}\" stop-color=\"{}\"/>", css(colour(share)));
        }
        let _ = write!(
            svg,
            "</linearGradient></defs><rect x=\"{left:.2}\" y=\"{top:.2}\" width=\"{across:.2}\" height=\"{:.2}\" \
             fill=\"url(#ramp-{})\" stroke=\"currentColor\" stroke-width=\"{:.2}\"/>",
            0.8 * t,
            escaped(self.name),
            0.06 * t
        );
        let labels = top + 2.0 * t;
        text(svg, (left, labels), "start", &trimmed(bar.range.low, 3));
        let high = format!("{}{}", if bar.clipped { "≥ " } else { "" }, trimmed(bar.range.high, 3));
        text(svg, (left + across, labels), "end", &high);
        text(svg, (left + 0.5 * across, labels + 1.2 * t), "middle", &bar.label());
        if over {
            let y = labels + 1.8 * t;
            let _ = write!(
                svg,
                "<rect x=\"{left:.2}\" y=\"{y:.2}\" width=\"{0:.2}\" height=\"{0:.2}\" fill=\"{1}\" stroke=\"#888\" stroke-width=\"{2:.2}\"/>",
                0.8 * t,
                css(BLACK),
                0.06 * t
            );
            text(svg, (left + 1.2 * t, y + 0.75 * t), "start", "contact");
        }
    }
}

/// At most six round numbers from zero to an extent.
fn ticks(extent: f64) -> Vec<f64> {
    let rough = extent / 5.0;
    let decade = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 2.5, 5.0, 10.0].into_iter().map(|m| m * decade).find(|s| *s >= 0.999_999 * rough);
    let step = step.unwrap_or(extent);
    (0..=(extent / step + 1e-9).floor() as usize).map(|i| i as f64 * step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_within() {
        assert_eq!(ticks(100.0), [0.0, 20.0, 40.0, 60.0, 80.0, 100.0]);
        assert_eq!(ticks(25.1), [0.0, 10.0, 20.0]);
        assert_eq!(ticks(9.78), [0.0, 2.0, 4.0, 6.0, 8.0]);
    }

    #[test]
    fn a_frame_tells_lengths_values_and_contact() {
        let framed = |legend| Framed {
            name: "gap-1",
            alt: "gap at p* < 1",
            png: b"not looked at",
            cell_m: [1e-4, 5e-5],
            legend,
            format: Format::page(IN_A_ROW),
        };
        let range = Range { low: 0.0, high: 2.5e-6 };
        let svg = framed(Legend::OverContact(Bar::prefixed("gap", range, "m", true))).svg();
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
            assert!(svg.contains(piece), "{piece}: {svg}");
        }
        assert!(!framed(Legend::None).svg().contains("linearGradient"));
    }
}
