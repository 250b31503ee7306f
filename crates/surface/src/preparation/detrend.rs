//! Forms that are subtracted from a map.

use super::facets;
use super::lines::Lines;
use super::three_points;
use super::trend::{Degree, Trend};
use asperity_grid::{Grid, Result};
use serde::{Deserialize, Serialize};

/// Form that is subtracted from the heights, fitted to the measured points. Scan lines are rows of the map: lines along x.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Detrend {
    /// The mean height.
    Mean,
    /// The mean plane: removes tilt.
    Plane,
    /// The polynomial of second order in x and y: removes tilt and curvature.
    Quadratic,
    /// The plane in which most of the surface lies: levels terraces, and ground between grains.
    Facets,
    /// The median of each scan line, about the slope along x that all have: removes steps between lines, and tilt.
    LineMedian,
    /// A straight line of each scan line.
    LineLinear,
    /// A parabola of each scan line: removes bow, too.
    LineQuadratic,
    /// The plane through three points, in lengths along x and y from the first point of the map, or of the part that is kept: through the means of
    /// the measured points that are at most 2.5 points away.
    #[serde(skip)]
    ThreePoints([[f64; 2]; 3]),
}

impl Detrend {
    /// The forms without parameters, and their words.
    pub const FORMS: [(Detrend, &str); 7] = [
        (Detrend::Mean, "mean"),
        (Detrend::Plane, "plane"),
        (Detrend::Quadratic, "quadratic"),
        (Detrend::Facets, "facets"),
        (Detrend::LineMedian, "line-median"),
        (Detrend::LineLinear, "line-linear"),
        (Detrend::LineQuadratic, "line-quadratic"),
    ];

    /// Its word.
    pub fn word(self) -> &'static str {
        Self::FORMS.iter().find(|(form, _)| *form == self).map_or("three-points", |(_, word)| word)
    }
}

/// Subtracts a form from the measured points of a map `[ny, nx]`; points that were not measured (NaN) stay so. Returns its line of the
/// history, with the name of the unit of lengths and heights, if it is not empty.
///
/// # Errors
/// Three points outside of the map, where nothing was measured, or on one line.
pub fn subtract_form(kind: Detrend, grid: Grid, heights: &mut [f64], unit: &str) -> Result<String> {
    let form = Form::fit(kind, (grid, unit), heights)?;
    form.subtract(grid, heights);
    Ok(form.line(unit))
}

/// A form with its coefficients.
pub(super) struct Form {
    kind: Detrend,
    shape: Shape,
    /// Where it was fitted, if not everywhere.
    place: Option<String>,
}

enum Shape {
    Map(Trend),
    Lines(Lines),
}

impl Form {
    /// Fits the form to the heights that are not NaN.
    pub(super) fn fit(kind: Detrend, (grid, unit): (Grid, &str), heights: &[f64]) -> Result<Self> {
        let mut place = None;
        let map = |degree| Shape::Map(Trend::fit(degree, grid, heights));
        let shape = match kind {
            Detrend::Mean => map(Degree::Mean),
            Detrend::Plane => map(Degree::Plane),
            Detrend::Quadratic => map(Degree::Quadratic),
            Detrend::Facets => Shape::Map(Trend::plane(facets::slopes(grid, heights), grid, heights)),
            Detrend::LineMedian => Shape::Lines(Lines::medians(grid, heights)),
            Detrend::LineLinear => Shape::Lines(Lines::polynomials(2, grid, heights)),
            Detrend::LineQuadratic => Shape::Lines(Lines::polynomials(3, grid, heights)),
            Detrend::ThreePoints(points) => {
                let (trend, words) = three_points::plane((grid, unit), heights, points)?;
                place = Some(words);
                Shape::Map(trend)
            }
        };
        Ok(Form { kind, shape, place })
    }

    pub(super) fn subtract(&self, grid: Grid, heights: &mut [f64]) {
        match &self.shape {
            Shape::Map(trend) => trend.subtract(grid, heights),
            Shape::Lines(lines) => lines.subtract(heights),
        }
    }

    /// The line of the history.
    pub(super) fn line(&self, unit: &str) -> String {
        let words = match &self.shape {
            Shape::Map(trend) => trend.words(unit),
            Shape::Lines(lines) => lines.words(unit),
        };
        let place = self.place.as_ref().map_or(String::new(), |place| format!(", {place}"));
        format!("detrend {}: {words}{place}", self.kind.word())
    }
}
