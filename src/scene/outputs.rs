//! Requested outputs of a run, and the accuracy that can be requested in place of a grid.

use crate::record::quantity::Quantity;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// One quantity to an error or within a time, instead of `surface.grid`, `continuum.method`, `precision` and `tolerance`: the
/// cheapest setting that measured tables support is taken, and nothing is kept or counted that the quantity does not need.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AccuracyScene {
    #[serde(deserialize_with = "compared_quantity")]
    pub quantity: Quantity,
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

/// Outputs of a run besides areas and mean gaps.
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
    pub fn of(quantity: Quantity) -> RequestedOutputs {
        let maps = matches!(quantity, Quantity::GapMap | Quantity::ContactMap);
        let counted = matches!(
            quantity,
            Quantity::GapPdf | Quantity::StressPdf | Quantity::PatchArea | Quantity::MedianClusterArea
        );
        RequestedOutputs { maps, distributions: counted, grid_error: false, spectrum: false }
    }
}

/// A quantity that errors are known of.
fn compared_quantity<'de, D: serde::Deserializer<'de>>(from: D) -> Result<Quantity, D::Error> {
    let quantity = Quantity::deserialize(from)?;
    if Quantity::COMPARED.contains(&quantity) {
        return Ok(quantity);
    }
    let accepted = Quantity::COMPARED.map(Quantity::id).join(", ");
    Err(serde::de::Error::custom(format!("no errors are known of {}; expected one of {accepted}", quantity.id())))
}
