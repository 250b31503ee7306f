//! What was advised, and why: kept with the results of a scene that asked for an accuracy.

use super::quantity::Quantity;
use serde::{Deserialize, Serialize};

/// A setting, and what is to be expected of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Advice {
    pub method: String,
    /// Points a side.
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
    /// What of this lies beyond what was measured.
    pub extrapolated: Vec<String>,
}

/// How a scene's accuracy was resolved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AccuracyChoice {
    pub quantity: Quantity,
    /// Error that was good enough.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<f64>,
    /// Wall time that there was, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub budget_s: Option<f64>,
    /// Where the tables are from.
    pub tables: String,
    pub advice: Advice,
}
