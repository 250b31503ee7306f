//! What methods tell that run beside the scene's own, in the terms of `results.json`.

use super::results::{ContinuumResults, RangeResults, StateResults};
use crate::load::{AtLoad, Branch};
use crate::observe::Distribution;
use serde::{Deserialize, Serialize};

/// One method at the loads of the way there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MethodResults {
    /// An id of `asperity methods`, and what the paper calls it.
    pub method: String,
    pub paper_name: String,
    pub criterion: String,
    /// What its constants were fitted to; none for one that has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibrated_on: Option<String>,
    /// Whether it was given the scene's adhesion.
    pub adhesive: bool,
    /// Range of the adhesion that it was asked for and that it used; of an estimate only where these differ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<RangeResults>,
    /// Why it tells nothing, where it refused the scene or did not converge.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unavailable_reason: Option<String>,
    /// What it does not deliver here, and why.
    pub missing: Vec<Missing>,
    pub states: Vec<MethodState>,
    /// Memory planned for it, and processor time of all its loads, s.
    pub planned_bytes: u64,
    pub cpu_seconds: f64,
}

/// An empty cell of a table, and the reason why it is empty.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Missing {
    /// As `asperity methods --json` names it.
    pub quantity: String,
    pub reason: String,
}

/// What a method tells of a load. Lengths in L, areas in L², stresses in E*; parts that it does not deliver are absent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MethodState {
    /// Of its load step, from 0.
    pub index: usize,
    pub p_star: f64,
    pub pressure: f64,
    /// By the method's own criterion.
    pub contact_fraction: f64,
    /// Less what a grid counts at the rim of patches, for methods whose contact is a map of nodes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_fraction_corrected: Option<f64>,
    /// Nodes in contact whose stress presses, for solvers with adhesion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_fraction_compressive: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_gap: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub patches: Option<usize>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub median_cluster_area: Option<f64>,
    /// Where contact is compression, for methods that tell both.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub median_cluster_area_compressive: Option<f64>,
    /// Pr(a): area, density, number. CPr(a): area, share of the contact.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub patch_density: Vec<[f64; 3]>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub patch_area: Vec<[f64; 2]>,
    /// Pr(u), in bins of equal ratio where the method's gaps are a field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gap: Option<Distribution>,
    /// Pr(σ), and the contact's share of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stress: Option<Distribution>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_stress: Option<Distribution>,
    /// `[ny, nx]` files, if stored: gap, stress, and contact (u8).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gap_map: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stress_map: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_map: Option<String>,
    pub load_error: f64,
    pub stop: String,
    pub iterations: usize,
    pub fft_pairs: f64,
    pub seconds: f64,
}

impl AtLoad for MethodState {
    fn index(&self) -> usize {
        self.index
    }
}

impl MethodState {
    /// A solver's state in the same terms.
    pub fn of(s: &StateResults) -> Self {
        let o = s.observed.as_ref();
        MethodState {
            index: s.index,
            p_star: s.p_star,
            pressure: s.pressure,
            contact_fraction: s.contact_fraction,
            contact_fraction_corrected: Some(s.contact_fraction_corrected),
            contact_fraction_compressive: o.and_then(|o| Some(o.compressive?.fraction)),
            mean_gap: Some(s.mean_gap),
            stiffness: s.stiffness,
            patches: s.patches,
            median_cluster_area: o.and_then(|o| o.median_cluster_area),
            median_cluster_area_compressive: o.and_then(|o| o.compressive?.median_cluster_area),
            patch_density: o.map_or(Vec::new(), |o| o.patch_density.clone()),
            patch_area: o.map_or(Vec::new(), |o| o.patch_area.clone()),
            gap: o.map(|o| o.gap_logarithmic.clone()),
            stress: o.map(|o| o.stress.clone()),
            contact_stress: o.map(|o| o.contact_stress.clone()),
            gap_map: s.gap.clone(),
            stress_map: s.stress.clone(),
            contact_map: None,
            load_error: s.load_error,
            stop: s.stop.clone(),
            iterations: s.iterations,
            fft_pairs: s.fft_pairs,
            seconds: s.seconds,
        }
    }

    /// Contact as others are compared with it: corrected, where it is.
    pub fn area(&self) -> f64 {
        self.contact_fraction_corrected.unwrap_or(self.contact_fraction)
    }
}

/// The states on the way there of what a solver found.
pub fn states_of(c: &ContinuumResults) -> Vec<MethodState> {
    c.states.iter().filter(|s| s.branch == Branch::Loading).map(MethodState::of).collect()
}
