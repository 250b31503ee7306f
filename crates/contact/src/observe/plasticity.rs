use serde::{Deserialize, Serialize};

/// Plastic flow of a load history up to a state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Plasticity {
    /// Fraction of the nodes whose plastic displacement grows in this load; their contact stress is the hardness.
    #[serde(rename = "flowing_fraction")]
    pub flowing: f64,
    /// Fraction of the nodes with a plastic displacement.
    #[serde(rename = "displaced_fraction")]
    pub displaced: f64,
    /// Mean plastic displacement, a length.
    #[serde(rename = "mean_plastic_displacement")]
    pub displacement: f64,
    /// Plastic work per area since the first load, stress times length.
    #[serde(rename = "plastic_work")]
    pub work: f64,
}
