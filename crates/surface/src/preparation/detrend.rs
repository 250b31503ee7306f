//! Forms that are subtracted from a map.

use super::facets;
use super::lines::Lines;
use super::trend::{Degree, Trend};
use asperity_grid::Grid;
use serde::{Deserialize, Serialize};

/// Form that is subtracted from the heights, fitted to the measured points. Scan lines are rows of the map: lines along x.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
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
}

/// Subtracts a form from the measured points of a map `[ny, nx]`; points that were not measured (NaN) stay so. Returns its line of the
/// history.
pub fn subtract_form(kind: Detrend, grid: Grid, heights: &mut [f64]) -> String {
    let form = Form::fit(kind, grid, heights);
    form.subtract(grid, heights);
    form.line()
}

/// A form with its coefficients.
pub(super) struct Form {
    kind: Detrend,
    shape: Shape,
}

enum Shape {
    Map(Trend),
    Lines(Lines),
}

impl Form {
    /// Fits the form to the heights that are not NaN.
    pub(super) fn fit(kind: Detrend, grid: Grid, heights: &[f64]) -> Self {
        let map = |degree| Shape::Map(Trend::fit(degree, grid, heights));
        let shape = match kind {
            Detrend::Mean => map(Degree::Mean),
            Detrend::Plane => map(Degree::Plane),
            Detrend::Quadratic => map(Degree::Quadratic),
            Detrend::Facets => Shape::Map(Trend::plane(facets::slopes(grid, heights), grid, heights)),
            Detrend::LineMedian => Shape::Lines(Lines::medians(grid, heights)),
            Detrend::LineLinear => Shape::Lines(Lines::polynomials(2, grid, heights)),
            Detrend::LineQuadratic => Shape::Lines(Lines::polynomials(3, grid, heights)),
        };
        Form { kind, shape }
    }

    pub(super) fn subtract(&self, grid: Grid, heights: &mut [f64]) {
        match &self.shape {
            Shape::Map(trend) => trend.subtract(grid, heights),
            Shape::Lines(lines) => lines.subtract(heights),
        }
    }

    /// The line of the history.
    pub(super) fn line(&self) -> String {
        let name = match self.kind {
            Detrend::Mean => "mean",
            Detrend::Plane => "plane",
            Detrend::Quadratic => "quadratic",
            Detrend::Facets => "facets",
            Detrend::LineMedian => "line-median",
            Detrend::LineLinear => "line-linear",
            Detrend::LineQuadratic => "line-quadratic",
        };
        let words = match &self.shape {
            Shape::Map(trend) => trend.words(),
            Shape::Lines(lines) => lines.words(),
        };
        format!("detrend {name}: {words}")
    }
}
