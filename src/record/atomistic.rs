//! What is told of the atoms beside their contact by distance, and of each version of the compared problem.

use crate::load::{AtLoad, Branch};
use crate::observe::Distribution;
use serde::{Deserialize, Serialize};

/// The atoms' contact area under one criterion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContactByCriterion {
    /// "distance", "compressed", "force_threshold" or "voronoi_area".
    pub id: String,
    pub criterion: String,
    /// Atoms that touch, wherever they started.
    pub atoms: usize,
    /// Share of the cell: atoms of the surface layer over all of that layer, for "voronoi_area" the touching atoms' own shares.
    pub contact_fraction: f64,
}

/// The indenter's normal force on the atoms as a smooth field.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AtomStress {
    /// Standard deviation of the Gaussian by which each force is spread, Å.
    pub width_angstrom: f64,
    /// Mean of the field times the cell's area over the load, less one.
    pub load_error: f64,
    pub highest_gpa: f64,
    /// `[ny, nx]` f64 map on the comparison grid, GPa.
    pub map: String,
}

/// Atoms that have left the crystal's order at one load.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DefectAtoms {
    /// Of the step of the ladder nearest to the load.
    pub atoms: usize,
    pub volume_nm3: f64,
}

/// Where the crystal stops to be elastic.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlasticityResults {
    /// Atoms looked at per step: those below the masked layers.
    pub atoms: usize,
    pub masked_layers: usize,
    /// Centro-symmetry over a0² from which an atom counts.
    pub threshold: f64,
    /// Up to so many atoms are no yield.
    pub noise_atoms: usize,
    /// p* and number of atoms of every step.
    pub steps: Vec<[f64; 2]>,
    /// p* of the first step above the noise; none where there is none.
    pub first_yield: Option<f64>,
    /// p* of the step before it: the crystal yields between the two.
    pub last_elastic: Option<f64>,
    /// Mean stress in the contact at the asked loads beyond it, on average, GPa.
    pub hardness_gpa: Option<f64>,
}

/// One version of the problem at one load. All are read at the block's surface sites, so that none has a finer map than
/// another; stresses are smoothed by the atoms' Gaussian.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelChainStep {
    /// "full_heights", "hard_wall", "offset_wall", "compliant_wall" or "atoms".
    pub id: String,
    pub criterion: String,
    pub contact_fraction: f64,
    pub mean_gap_angstrom: f64,
    /// Mean pressure over the contact fraction; none without contact.
    pub contact_stress_gpa: Option<f64>,
    pub patches: usize,
    /// Half of the contact lies in patches up to this area; none without contact.
    pub median_cluster_area_nm2: Option<f64>,
    /// Patch area (nm²), share of the contact in patches up to it.
    pub patch_area: Vec<[f64; 2]>,
    /// Of gaps in Å; what touches is the delta.
    pub gap: Distribution,
    /// Of the smoothed normal stress in GPa, over the whole cell.
    pub stress: Distribution,
}

/// One step of the displacement ladder.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct LoadStepResults {
    pub step: usize,
    /// How far the indenter has come down since the start.
    pub displacement_angstrom: f64,
    /// Normal force on the indenter, repulsion positive.
    pub load_ev_per_angstrom: f64,
    pub p_star: f64,
    pub contacts: usize,
    pub energy_ev: f64,
    pub force_evaluations: usize,
    pub max_force_ev_per_angstrom: f64,
}

/// The atoms at one asked load (interpolated between ladder steps).
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct AtomState {
    /// Of its load step, from 0.
    pub index: usize,
    pub branch: Branch,
    pub p_star: f64,
    /// Contact atoms of the surface layer over all atoms of that layer.
    pub contact_fraction: f64,
    pub contacts: usize,
    /// Contact atoms that did not start in the surface layer: more than a few mean that material has flowed.
    pub contacts_below_surface: usize,
    pub mean_gap_angstrom: f64,
    /// Mean normal stress over the contact atoms' area.
    pub contact_stress_gpa: f64,
    /// `[ny, nx]` u8 and f64 (Å) maps on the comparison grid.
    pub contact_map: String,
    pub gap_map: String,
    /// Extended XYZ of the frame.
    pub frame: Option<String>,
    /// How much farther than interpolated the indenter stands, so that the atoms carry the load, Å.
    pub indenter_shift_angstrom: f64,
    /// The contact area under each criterion.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub criteria: Vec<ContactByCriterion>,
    /// Contact distance d_c, Å, and the contact fraction that it would give.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sensitivity: Vec<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stress: Option<AtomStress>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub defects: Option<DefectAtoms>,
}

impl AtLoad for AtomState {
    fn index(&self) -> usize {
        self.index
    }
}

/// The way back from the highest load.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Unloading {
    /// Step of the ladder at which it begins.
    pub reversal_step: usize,
    /// The asked loads once more, falling.
    pub states: Vec<AtomState>,
    /// What the same loads had on the way there, in the order of `states`.
    pub changes: Vec<BranchChange>,
    /// From first touch: whether nothing touched in the end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub separated: Option<bool>,
    /// With adhesion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pull_off: Option<AtomPullOff>,
}

/// A load on the way back against the same load on the way there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BranchChange {
    pub p_star: f64,
    pub contact_fraction_loading: f64,
    pub contact_fraction_unloading: f64,
    /// Mean gap back less mean gap there, Å.
    pub mean_gap_angstrom: f64,
}

/// The largest pull that the atoms' contact holds on the way back.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AtomPullOff {
    pub step: usize,
    /// Negative.
    pub force_ev_per_angstrom: f64,
    /// By how much the pull grew on the step to it: it grows by less within the next.
    pub error_ev_per_angstrom: f64,
    pub force_nn: f64,
    pub p_star: f64,
    /// How far the indenter stood below its start, and how far it had risen from the step before.
    pub displacement_angstrom: f64,
    pub step_angstrom: f64,
    pub contacts: usize,
}

/// A mean over time with its standard error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ValueWithError {
    pub value: f64,
    pub error: f64,
}

/// Relaxed states held at a temperature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NvtResults {
    pub temperature_k: f64,
    /// Of the crystal at the temperature, Å, to which the cell was expanded.
    pub lattice_constant_angstrom: f64,
    /// At each load: time before the average, of the average, and of a step, ps.
    pub equilibration_ps: f64,
    pub averaging_ps: f64,
    pub timestep_ps: f64,
    /// Blocks of time whose scatter gives the errors.
    pub blocks: usize,
    pub states: Vec<NvtState>,
}

/// One load held at a temperature. Errors are standard errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NvtState {
    /// Of its load step, from 0.
    pub index: usize,
    pub p_star: f64,
    /// Of the deformable atoms.
    pub temperature_k: ValueWithError,
    /// On the indenter, over the one asked for.
    pub load: ValueWithError,
    /// Probability that an atom of the surface layer touches, averaged over the layer.
    pub contact_fraction: ValueWithError,
    pub mean_gap_angstrom: ValueWithError,
    /// Share of the surface layer's atoms that touch with a probability above one half.
    pub majority_contact: f64,
    /// Share of them that touched at all.
    pub any_contact: f64,
    /// `[ny, nx]` f64 map of the probability on the comparison grid.
    pub probability_map: String,
    /// Probability and standard error of each surface site.
    pub site_probability: String,
    pub site_error: String,
}
