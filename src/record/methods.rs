//! Results of the compared methods, as in `results.json`.

use asperity_contact::load::{AtLoad, Branch};
use asperity_contact::measured_errors::MeasuredErrors;
use asperity_contact::observe::Distribution;
use asperity_contact::results::{ContinuumResults, RangeResults, StateResults};
use asperity_contact::state_numbers::StateNumbers;
use serde::{Deserialize, Serialize};

/// Results of one method at the loads of the loading branch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MethodResults {
    /// Id in `asperity methods`, and name in the paper.
    pub method: String,
    pub paper_name: String,
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
    pub missing: Vec<Missing>,
    pub states: Vec<MethodState>,
    /// Estimated memory, and processor time of all loads, s.
    pub planned_bytes: u64,
    pub cpu_seconds: f64,
}

/// A quantity that a method does not provide, at all or at one load, and the reason.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Missing {
    /// Id in `asperity methods --json`.
    pub quantity: String,
    pub reason: String,
}

/// Results of a method at one load. Lengths in L, areas in L², stresses in E*; quantities that the method does not
/// provide are absent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MethodState {
    #[serde(flatten)]
    pub numbers: StateNumbers,
    /// Contact nodes over all nodes, for methods with a contact map.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_nodes: Option<f64>,
    /// Fraction of nodes in contact under compression, for solvers with adhesion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_nodes_compressive: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_gap: Option<f64>,
    /// What the method delivers at other loads, but not at this one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<Missing>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub median_cluster_area: Option<f64>,
    /// Median cluster area of the contact under compression, for solvers with adhesion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub median_cluster_area_compressive: Option<f64>,
    /// Pr(a): area, density, number; CPr(a): area, fraction of the contact.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub patch_density: Vec<[f64; 3]>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub patch_area: Vec<[f64; 2]>,
    /// Pr(u); in bins of equal ratio for methods with a gap field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gap: Option<Distribution>,
    /// Pr(σ), and its contribution from contact.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stress: Option<Distribution>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_stress: Option<Distribution>,
    /// File of the `[ny, nx]` u8 map, if stored.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_map: Option<String>,
}

impl AtLoad for MethodState {
    fn index(&self) -> usize {
        self.numbers.index
    }
}

impl MethodState {
    /// Converts a state of a solver.
    pub fn of(s: &StateResults) -> Self {
        let o = s.observed.as_ref();
        MethodState {
            numbers: s.numbers.clone(),
            contact_nodes: Some(s.contact_nodes),
            contact_nodes_compressive: o.and_then(|o| Some(o.compressive?.contact_nodes)),
            mean_gap: Some(s.mean_gap),
            missing: Vec::new(),
            median_cluster_area: o.and_then(|o| o.median_cluster_area),
            median_cluster_area_compressive: o.and_then(|o| o.compressive?.median_cluster_area),
            patch_density: o.map_or(Vec::new(), |o| o.patch_density.clone()),
            patch_area: o.map_or(Vec::new(), |o| o.patch_area.clone()),
            gap: o.map(|o| o.gap_logarithmic.clone()),
            stress: o.map(|o| o.stress.clone()),
            contact_stress: o.map(|o| o.contact_stress.clone()),
            contact_map: None,
        }
    }
}

/// The loading branch of a solver's results.
pub fn loading_states(c: &ContinuumResults) -> Vec<MethodState> {
    c.states.iter().filter(|s| s.branch == Branch::Loading).map(MethodState::of).collect()
}
