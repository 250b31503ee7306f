//! The quantity in which loads are named.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A quantity of loads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LoadQuantity {
    PStar,
    /// Mean pressure, Pa.
    Pressure,
    /// Normal force on the map, N.
    Force,
}

/// Loads are named as the scene gave them: by p*, pressure or force at the laboratory scale. Atoms have the same p* under another pressure.
/// Where it gave gaps, displacements or contact areas, loads are named by the pressures that came out.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GivenLoads {
    /// In which they are named.
    pub quantity: LoadQuantity,
    /// The load p* = 1: 1, in Pa or in N.
    pub of_p_star: f64,
}

impl GivenLoads {
    pub const P_STAR: Self = GivenLoads { quantity: LoadQuantity::PStar, of_p_star: 1.0 };
}
