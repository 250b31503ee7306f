//! Text and frames of SVG drawings.

use std::fmt::Write;

use super::picture::Rgb;

/// Size of a drawing: width and text height in units of `unit`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Format {
    pub width: f64,
    pub text: f64,
    /// Width of the drawing in the file, with its unit ("84mm"); `None` on the page, whose style sheet sets it.
    pub printed_mm: Option<f64>,
}

/// Points per millimetre.
const POINTS: f64 = 72.0 / 25.4;

impl Format {
    /// Text height on the page, px.
    pub const PAGE_TEXT: f64 = 13.0;
    /// Text height in printed figures, points.
    pub const PRINTED_TEXT: f64 = 8.0;

    /// For the page, px.
    pub fn page(width: f64) -> Self {
        Format { width, text: Self::PAGE_TEXT, printed_mm: None }
    }

    /// For print, points.
    pub fn printed(width_mm: f64) -> Self {
        Format { width: width_mm * POINTS, text: Self::PRINTED_TEXT, printed_mm: Some(width_mm) }
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

/// A text at its base line; `anchor`: "start", "middle" or "end".
pub(super) fn text(svg: &mut String, (x, y): (f64, f64), anchor: &str, words: &str) {
    // Writing into a string does not fail.
    let _ = write!(
        svg,
        "<text x=\"{x:.2}\" y=\"{y:.2}\" text-anchor=\"{anchor}\" fill=\"currentColor\">{}</text>",
        escaped(words)
    );
}
