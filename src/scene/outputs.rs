//! What is to be kept and counted of a run, and the accuracy that may be asked for in place of a grid.

use crate::record::tradeoff::Measure;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// One quantity to an error or within a time, instead of `surface.grid`, `continuum.method`, `precision` and `tolerance`: the
/// cheapest setting that measured tables support is taken, and nothing is kept or counted that the quantity does not need.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AccuracyScene {
    pub quantity: Measure,
    /// Error that is good enough, as a relative deviation: 0.05.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<f64>,
    /// Wall time that there is instead, s: the most accurate setting within it is taken.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub budget_s: Option<f64>,
    /// Tables of `asperity tradeoff` or `asperity merge-tables`, relative to the scene file. Default: those that come with the program.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tables: Vec<PathBuf>,
    /// Go beyond what was measured, too.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub extrapolate: bool,
}

/// What a run keeps and counts beside areas and mean gaps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct RequestedOutputs {
    /// Maps of heights, gaps and stresses.
    pub maps: bool,
    /// Distributions, patches, what leads around the cell.
    pub distributions: bool,
    /// The same loads on a coarser grid, where the method does not come by way of one.
    pub grid_error: bool,
    /// The surface's power spectrum and moments.
    pub spectrum: bool,
}

impl RequestedOutputs {
    pub const EVERYTHING: RequestedOutputs =
        RequestedOutputs { maps: true, distributions: true, grid_error: true, spectrum: true };

    /// What a quantity needs. The error of the grid is that of the table which chose it.
    pub fn of(measure: Measure) -> RequestedOutputs {
        let maps = matches!(measure, Measure::GapMap | Measure::ContactMap);
        let counted =
            matches!(measure, Measure::GapPdf | Measure::StressPdf | Measure::PatchArea | Measure::MedianClusterArea);
        RequestedOutputs { maps, distributions: counted, grid_error: false, spectrum: false }
    }
}
