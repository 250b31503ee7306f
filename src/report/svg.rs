//! Text and frames of SVG drawings.

use std::fmt::Write;

use super::picture::Rgb;

/// Size of a drawing: width and text height in units of `unit`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawingSize {
    pub width: f64,
    pub text: f64,
    /// Width of the drawing in the file, with its unit ("84mm"); `None` on the page, whose style sheet sets it.
    pub printed_mm: Option<f64>,
}

/// Points per millimetre.
const POINTS: f64 = 72.0 / 25.4;

impl DrawingSize {
    /// Text height on the page, px.
    pub const PAGE_TEXT: f64 = 13.0;
    /// Text height in printed figures, points.
    pub const PRINTED_TEXT: f64 = 8.0;

    /// For the page, px.
    pub fn page(width: f64) -> Self {
        DrawingSize { width, text: Self::PAGE_TEXT, printed_mm: None }
    }

    /// For print, points.
    pub fn printed(width_mm: f64) -> Self {
        DrawingSize { width: width_mm * POINTS, text: Self::PRINTED_TEXT, printed_mm: Some(width_mm) }
    }

    /// Start of the drawing.
    pub(super) fn open(self, height: f64, alt: &str) -> String {
        let size = match self.printed_mm {
            Some(mm) => format!(" width=\"{mm}mm\" height=\"{:.3}mm\"", height / POINTS),
            None => format!(" style=\"max-width:{:.0}px\"", self.width),
        };
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\"{size} viewBox=\"0 0 {:.2} {height:.2}\" role=\"img\" aria-label=\"{alt}\" \
             font-family=\"'Helvetica Neue', Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif\" font-size=\"{}\"><title>{alt}</title>",
            self.width, self.text
        )
    }
}

/// Upper bound of half the width of a label, in text heights: digits of wide sans-serif fonts have 0.64.
pub(super) fn half_width(characters: usize) -> f64 {
    0.32 * characters as f64
}

pub(super) fn css([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Mean character width in text heights, sans-serif; used only for line breaks of the legend and room for labels.
pub(super) const CHARACTER: f64 = 0.55;

/// Ticks of an axis, each with its place and label, and the label of the axis.
pub(super) struct Ticks {
    pub places: Vec<(f64, String)>,
    pub label: String,
}

/// The outline of a frame with ticks and labels below and to the left of it. `frame`: its edges left, right, top, bottom.
pub(super) fn axes(svg: &mut String, t: f64, outline: &str, frame: [f64; 4], [x, y]: [&Ticks; 2]) {
    let [left, right, top, bottom] = frame;
    let width = 0.08 * t;
    let _ = write!(svg, "<path fill=\"none\" stroke=\"currentColor\" stroke-width=\"{width:.2}\" d=\"{outline}");
    for (at, _) in &x.places {
        let _ = write!(svg, "M{at:.2} {bottom:.2}v{:.2}", 0.35 * t);
    }
    for (at, _) in &y.places {
        let _ = write!(svg, "M{left:.2} {at:.2}h{:.2}", -0.35 * t);
    }
    svg.push_str("\"/>");
    // Labels that would touch their left neighbour are omitted.
    let mut free = f64::NEG_INFINITY;
    for (at, label) in &x.places {
        let half = 0.5 * CHARACTER * t * label.chars().count() as f64;
        if at - half >= free {
            text(svg, (*at, bottom + 1.3 * t), "middle", label);
            free = at + half + 0.3 * t;
        }
    }
    for (at, label) in &y.places {
        text(svg, (left - 0.5 * t, at + 0.35 * t), "end", label);
    }
    text(svg, (0.5 * (left + right), bottom + 2.6 * t), "middle", &x.label);
    let _ = write!(
        svg,
        "<text transform=\"translate({t:.2} {:.2}) rotate(-90)\" text-anchor=\"middle\" fill=\"currentColor\">{}</text>",
        0.5 * (top + bottom),
        escaped(&y.label)
    );
}

/// A text at its base line; `anchor`: "start", "middle" or "end".
pub(super) fn text(svg: &mut String, (x, y): (f64, f64), anchor: &str, tokens: &str) {
    // Writing into a string does not fail.
    let _ = write!(
        svg,
        "<text x=\"{x:.2}\" y=\"{y:.2}\" text-anchor=\"{anchor}\" fill=\"currentColor\">{}</text>",
        escaped(tokens)
    );
}
