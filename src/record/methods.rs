//! Results of the methods that are compared with the scene's own, in the terms of `results.json`.

use super::continuum::{ContinuumResults, RangeResults, StateResults};
use super::state_numbers::StateNumbers;
use crate::load::{AtLoad, Branch};
use crate::observe::Distribution;
use serde::{Deserialize, Serialize};

/// One method at the loads of the loading branch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MethodResults {
    /// An id of `asperity methods`, and its name in the paper.
    pub method: String,
    pub paper_name: String,
    pub criterion: String,
    /// What its constants were fitted to; none without such constants.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibrated_on: Option<String>,
    /// Whether it was given the scene's adhesion.
    pub adhesive: bool,
    /// Of an estimate only where requested and used range differ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<RangeResults>,
    /// Why there are no states: the method refused the scene or did not converge.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unavailable_reason: Option<String>,
    pub missing: Vec<Missing>,
    pub states: Vec<MethodState>,
    /// Memory planned for it, and processor time of all its loads, s.
    pub planned_bytes: u64,
    pub cpu_seconds: f64,
}

/// A quantity that a method does not deliver, and why: an empty cell of a table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Missing {
    /// Its id in `asperity methods --json`.
    pub quantity: String,
    pub reason: String,
}

/// Results of a method at one load. Lengths in L, areas in L², stresses in E*; quantities that it does not deliver are absent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MethodState {
    #[serde(flatten)]
    pub numbers: StateNumbers,
    /// Perimeter-corrected, for methods whose contact is a map of nodes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_fraction_corrected: Option<f64>,
    /// Nodes in contact under compression, for solvers with adhesion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_fraction_compressive: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_gap: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub median_cluster_area: Option<f64>,
    /// Of the contact under compression, for solvers with adhesion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub median_cluster_area_compressive: Option<f64>,
    /// Pr(a): area, density, number. CPr(a): area, fraction of the contact.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub patch_density: Vec<[f64; 3]>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub patch_area: Vec<[f64; 2]>,
    /// Pr(u), in bins of equal ratio where the method's gaps are a field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gap: Option<Distribution>,
    /// Pr(σ), and the part of it from contact.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stress: Option<Distribution>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_stress: Option<Distribution>,
    /// `[ny, nx]` u8 file, if stored.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_map: Option<String>,
}

impl AtLoad for MethodState {
    fn index(&self) -> usize {
        self.numbers.index
    }
}

impl MethodState {
    /// A solver's state in the same terms.
    pub fn of(s: &StateResults) -> Self {
        let o = s.observed.as_ref();
        MethodState {
            numbers: s.numbers.clone(),
            contact_fraction_corrected: Some(s.contact_fraction_corrected),
            contact_fraction_compressive: o.and_then(|o| Some(o.compressive?.fraction)),
            mean_gap: Some(s.mean_gap),
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

    /// Contact fraction to compare: corrected where the method has it.
    pub fn area(&self) -> f64 {
        self.contact_fraction_corrected.unwrap_or(self.numbers.contact_fraction)
    }
}

/// The loading branch of a solver's results.
pub fn loading_states(c: &ContinuumResults) -> Vec<MethodState> {
    c.states.iter().filter(|s| s.branch == Branch::Loading).map(MethodState::of).collect()
}
