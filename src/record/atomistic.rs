//! What is told of the atoms beside their contact by distance, and of each version of the compared problem.

use super::uncertainty::ValueWithError;
use crate::load::{AtLoad, Branch};
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
    /// At the load step nearest to the load.
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

/// One load step.
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

/// The atoms at one load, for a displacement ramp interpolated between two load steps.
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
    /// The load step with the peak load.
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

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct AtomsResults {
    pub potential: String,
    /// The LAMMPS version line.
    pub engine: String,
    pub cells: usize,
    pub depth_cells: usize,
    /// Of the elastic foundation below; 0 for a rigid base.
    #[serde(default, skip_serializing_if = "crate::record::json::is_default")]
    pub foundation_cells: usize,
    pub a0_angstrom: f64,
    pub length_angstrom: f64,
    /// Contact modulus E* of the block, for stresses in GPa; files without it show them in units of E*.
    pub modulus_gpa: f64,
    pub deformable: usize,
    pub fixed: usize,
    pub indenter: usize,
    pub audit: Vec<AuditLine>,
    /// Whether each load began from the load before, moved by what lies between the continuum's solutions, and not from a step of the
    /// indenter.
    #[serde(default, skip_serializing_if = "crate::record::json::is_default")]
    pub from_continuum: bool,
    pub load_steps: Vec<LoadStepResults>,
    pub states: Vec<AtomState>,
    /// Only where the loads come back or the bodies are pulled apart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unloading: Option<Unloading>,
    /// Only where the scene requests an NVT run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nvt: Option<NvtResults>,
    /// Only where the scene asks for it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plasticity: Option<PlasticityResults>,
}

/// One dimensionless group of the scale-down: what was asked, what the atoms run with, and why they differ if they do.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct AuditLine {
    pub group: String,
    pub symbol: String,
    pub target: f64,
    pub actual: f64,
    /// "kept", "changed" or "unreachable".
    pub status: String,
    pub reason: String,
}
