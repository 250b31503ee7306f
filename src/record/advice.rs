//! Advised settings, stored with the results of a scene that requests an accuracy.

use asperity_contact::quantity::Quantity;
use serde::{Deserialize, Serialize};

/// A setting with its expected error and cost.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Advice {
    pub method: String,
    /// Number of grid points along each side.
    pub grid: usize,
    pub precision: String,
    pub tolerance: f64,
    /// Root mean square over the loads; maximum over the surfaces.
    pub expected_error: f64,
    /// Smallest and largest error of single loads.
    pub error_range: [f64; 2],
    /// Wall time of all loads on the machine and with the number of threads of the table, s.
    pub expected_seconds: f64,
    /// Expected time with the cost exponent one standard error lower and higher, s; absent if the exponent has no
    /// error estimate.
    pub seconds_range: Option<[f64; 2]>,
    pub exponent: Option<f64>,
    pub threads: usize,
    /// Number of surfaces measured with this setting.
    pub surfaces: usize,
    /// Parameters in which the setting is extrapolated from the measurements.
    pub extrapolated: Vec<String>,
}

/// Setting chosen for the accuracy that a scene requests.
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
