//! Results of the compared methods, as in `results.json`.

use asperity_contact::measured_errors::MeasuredErrors;
use asperity_contact::results::RangeResults;
use asperity_contact::state::{Missing, State};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Results of one method at the loads of the loading branch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MethodResults {
    /// Id in `asperity methods`.
    pub method: String,
    /// Name in the paper.
    pub paper_name: String,
    /// What counts as contact.
    pub criterion: String,
    /// Data to which constants of the method were fitted; absent without fitted constants.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibrated_on: Option<String>,
    /// Quantities in which the method is known to deviate by much.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub warning: Option<String>,
    /// Measured errors of an estimate, and the surface on which they were measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured_errors: Option<MeasuredErrors>,
    /// Whether the method was run with the scene's adhesion.
    pub adhesive: bool,
    /// For estimates only if requested and used range differ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<RangeResults>,
    /// Reason for missing states: the method does not support the scene or did not converge.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unavailable_reason: Option<String>,
    /// Quantities that the method never delivers.
    pub missing: Missing,
    /// One for each load of the loading branch.
    pub states: Vec<State>,
    /// Planned memory.
    pub planned_bytes: u64,
    /// Processor time of all loads, s.
    pub cpu_seconds: f64,
}
