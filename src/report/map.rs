//! SVG of a map with axes and colour bar.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::number::{si_scale, trimmed};
use super::picture::{self, BLACK, Range, Rgb};

/// Text height in drawing units. It is the same in all frames, so a narrow frame, which is displayed small, has
/// larger text relative to its map.
const TEXT: f64 = 24.0;
const LINE: f64 = 30.0;
/// Widths of a single frame, and of one of several in a row.
pub(super) const ALONE: f64 = 900.0;
pub(super) const IN_A_ROW: f64 = 480.0;

const STOPS: u32 = 24;

/// Meaning of the colours.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Legend {
    /// Colour ramp over a range of values in `unit`; `clipped`: some values exceed the end of the range.
    Ramp { range: Range, unit: String, clipped: bool },
    /// The same, with contact in black.
    OverContact { range: Range, unit: String, clipped: bool },
    /// No colour bar; the caption explains the colours.
    None,
}

impl Legend {
    /// A ramp with the SI prefix that suits the upper end; values in `unit` without prefix.
    pub(super) fn ramp(range: Range, unit: &str, clipped: bool) -> Self {
        let (range, unit) = prefixed(range, unit);
        Legend::Ramp { range, unit, clipped }
    }

    pub(super) fn over_contact(range: Range, unit: &str, clipped: bool) -> Self {
        let (range, unit) = prefixed(range, unit);
        Legend::OverContact { range, unit, clipped }
    }
}

fn prefixed(range: Range, unit: &str) -> (Range, String) {
    let (scale, prefix) = si_scale(range.low.abs().max(range.high.abs()));
    (Range { low: range.low / scale, high: range.high / scale }, format!("{prefix}{unit}"))
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
    pub width: f64,
}

impl Framed<'_> {
    pub(super) fn svg(&self) -> String {
        let (left, right, top) = (3.2 * TEXT, 1.2 * TEXT, 0.5 * TEXT);
        let across = self.width - left - right;
        let down = across * self.cell_m[1] / self.cell_m[0];
        let below = top + down;
        let rows = match self.legend {
            Legend::Ramp { .. } => 2.0,
            Legend::OverContact { .. } => 3.2,
            Legend::None => 0.0,
        };
        let height = below + 2.4 * LINE + rows * LINE;
        let mut svg = String::new();
        let alt = escaped(self.alt);
        // Writing into a string does not fail.
        let _ = write!(
            svg,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {height:.0}\" role=\"img\" aria-label=\"{alt}\" \
             font-family=\"system-ui, 'Segoe UI', 'Helvetica Neue', Arial, sans-serif\" font-size=\"{TEXT}\">\
             <title>{alt}</title>\
             <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\
             <image x=\"{left}\" y=\"{top}\" width=\"{across}\" height=\"{down:.2}\" preserveAspectRatio=\"none\" \
             style=\"image-rendering:pixelated\" href=\"data:image/png;base64,{}\"/>\
             <rect x=\"{left}\" y=\"{top}\" width=\"{across}\" height=\"{down:.2}\" fill=\"none\" stroke=\"#000\" \
             stroke-width=\"1.5\"/>",
            self.width,
            STANDARD.encode(self.png)
        );
        let (scale, prefix) = si_scale(self.cell_m[0]);
        let mut text = |x: f64, y: f64, anchor: &str, words: &str| {
            let words = escaped(words);
            let _ = write!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{words}</text>");
        };
        let [x_ticks, y_ticks] = self.cell_m.map(|l| ticks(l / scale));
        let along = |v: f64, extent: f64| v * scale / extent;
        for v in &x_ticks {
            text(left + across * along(*v, self.cell_m[0]), below + 1.1 * LINE, "middle", &trimmed(*v, 4));
        }
        for v in &y_ticks {
            let y = below - down * along(*v, self.cell_m[1]);
            text(left - 0.5 * TEXT, y + 0.35 * TEXT, "end", &trimmed(*v, 4));
        }
        text(left + 0.5 * across, below + 2.1 * LINE, "middle", &format!("x ({prefix}m)"));
        for v in &x_ticks {
            let x = left + across * along(*v, self.cell_m[0]);
            let _ = write!(svg, "<path d=\"M{x:.1} {below:.1}v8\" stroke=\"#000\"/>");
        }
        for v in &y_ticks {
            let y = below - down * along(*v, self.cell_m[1]);
            let _ = write!(svg, "<path d=\"M{left:.1} {y:.1}h-8\" stroke=\"#000\"/>");
        }
        let (x, y) = (0.95 * TEXT, top + 0.5 * down);
        let _ = write!(
            svg,
            "<text transform=\"translate({x:.1} {y:.1}) rotate(-90)\" text-anchor=\"middle\">y ({prefix}m)</text>"
        );
        self.bar(&mut svg, (left, below + 2.6 * LINE, across));
        svg.push_str("</svg>");
        svg
    }

    fn bar(&self, svg: &mut String, (left, top, across): (f64, f64, f64)) {
        let (range, unit, clipped, over) = match &self.legend {
            Legend::Ramp { range, unit, clipped } => (range, unit, *clipped, false),
            Legend::OverContact { range, unit, clipped } => (range, unit, *clipped, true),
            Legend::None => return,
        };
        let colour = if over { picture::over_contact } else { picture::colour };
        let _ = write!(svg, "<defs><linearGradient id=\"ramp-{}\">", escaped(self.name));
        for i in 0..=STOPS {
            let share = f64::from(i) / f64::from(STOPS);
            let _ = write!(svg, "<stop offset=\"{share:.4}\" stop-color=\"{}\"/>", css(colour(share)));
        }
        let end = format!("{}{} {unit}", if clipped { "≥ " } else { "" }, trimmed(range.high, 3));
        let labels = top + 0.7 * TEXT + LINE;
        let _ = write!(
            svg,
            "</linearGradient></defs><rect x=\"{left}\" y=\"{top:.1}\" width=\"{across}\" height=\"{:.1}\" \
             fill=\"url(#ramp-{})\" stroke=\"#000\"/><text x=\"{left}\" y=\"{labels:.1}\">{}</text>\
             <text x=\"{:.1}\" y=\"{labels:.1}\" text-anchor=\"end\">{}</text>",
            0.7 * TEXT,
            escaped(self.name),
            trimmed(range.low, 3),
            left + across,
            escaped(&end)
        );
        if over {
            let y = labels + 0.4 * LINE;
            let _ = write!(
                svg,
                "<rect x=\"{left}\" y=\"{y:.1}\" width=\"{0:.1}\" height=\"{0:.1}\" fill=\"{1}\"/>\
                 <text x=\"{2:.1}\" y=\"{3:.1}\">contact</text>",
                0.8 * TEXT,
                css(BLACK),
                left + 1.2 * TEXT,
                y + 0.75 * TEXT
            );
        }
    }
}

fn css([r, g, b]: Rgb) -> String {
    format!("rgb({r},{g},{b})")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
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
            width: IN_A_ROW,
        };
        let range = Range { low: 0.0, high: 2.5e-6 };
        let svg = framed(Legend::over_contact(range, "m", true)).svg();
        for piece in ["x (µm)", "y (µm)", ">100<", ">40<", "≥ 2.5 µm", ">contact<", "p* &lt; 1", "id=\"ramp-gap-1\""]
        {
            assert!(svg.contains(piece), "{piece}: {svg}");
        }
        assert!(!framed(Legend::None).svg().contains("linearGradient"));
    }
}
