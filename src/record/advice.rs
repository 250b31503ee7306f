//! Advised settings, stored with the results of a scene that requests an accuracy.

use super::quantity::Quantity;
use serde::{Deserialize, Serialize};

/// A setting with its expected error and cost.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Advice {
    pub method: String,
    /// Points per side.
    pub grid: usize,
    pub precision: String,
    pub tolerance: f64,
    /// Root mean square over the loads, of the surface that it is largest on.
    pub expected_error: f64,
    /// Of single loads.
    pub error_range: [f64; 2],
    /// Wall time of all loads, on the machine and the threads that the table was measured on.
    pub expected_seconds: f64,
    /// One standard error of the exponent with which cost grows, either way; none where it rests on two grids or on none.
    pub seconds_range: Option<[f64; 2]>,
    pub exponent: Option<f64>,
    pub threads: usize,
    /// How many surfaces were measured in this setting.
    pub surfaces: usize,
    /// In which respects it is extrapolated from the measurements.
    pub extrapolated: Vec<String>,
}

/// How a scene's accuracy was resolved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AccuracyChoice {
    pub quantity: Quantity,
    /// Accepted error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<f64>,
    /// Wall time budget, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub budget_s: Option<f64>,
    /// Provenance of the tables.
    pub tables: String,
    pub advice: Advice,
}
