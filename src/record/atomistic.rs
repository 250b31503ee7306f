//! Results of the atomistic simulation, in the terms of `results.json`.

use super::uncertainty::ValueWithError;
use crate::load::{AtLoad, Branch};
use serde::{Deserialize, Serialize};

/// The atoms' contact area under one criterion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContactByCriterion {
    /// "distance", "compressed", "force_threshold" or "voronoi_area".
    pub id: String,
    pub criterion: String,
    /// Contact atoms, of any layer.
    pub atoms: usize,
    /// Contact atoms of the surface layer over all of that layer; for "voronoi_area" the contact atoms' Voronoi areas over the cell.
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

/// Defect atoms (centro-symmetry) at one load.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DefectAtoms {
    /// At the load step nearest to the load.
    pub atoms: usize,
    pub volume_nm3: f64,
}

/// Onset of plasticity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlasticityResults {
    /// Atoms analysed per step: those below the masked layers.
    pub atoms: usize,
    pub masked_layers: usize,
    /// Centro-symmetry over a0² from which an atom counts.
    pub threshold: f64,
    /// Largest number of defect atoms without yield.
    pub noise_atoms: usize,
    /// p* and number of atoms of every step.
    pub steps: Vec<[f64; 2]>,
    /// p* of the first step above the noise; none where there is none.
    pub first_yield: Option<f64>,
    /// p* of the step before it: the crystal yields between the two.
    pub last_elastic: Option<f64>,
    /// Mean contact stress over the requested loads beyond it, GPa.
    pub hardness_gpa: Option<f64>,
}

/// One load step.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct LoadStepResults {
    pub step: usize,
    /// Descent of the indenter from its initial position.
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
    /// Contact atoms that were initially below the surface layer: more than a few indicate plastic flow.
    pub contacts_below_surface: usize,
    pub mean_gap_angstrom: f64,
    /// Mean normal stress over the contact atoms' area.
    pub contact_stress_gpa: f64,
    /// `[ny, nx]` u8 and f64 (Å) maps on the comparison grid.
    pub contact_map: String,
    pub gap_map: String,
    /// Extended XYZ of the frame.
    pub frame: Option<String>,
    /// Displacement of the indenter beyond the interpolated one that balances the load, Å.
    pub indenter_shift_angstrom: f64,
    /// The contact area under each criterion.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub criteria: Vec<ContactByCriterion>,
    /// Contact distance d_c, Å, and contact fraction with it.
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

/// Unloading from the highest load.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Unloading {
    /// The load step with the peak load.
    pub reversal_step: usize,
    /// The requested loads in decreasing order.
    pub states: Vec<AtomState>,
    /// Changes from the loading branch at the same loads, in the order of `states`.
    pub changes: Vec<BranchChange>,
    /// For runs from first touch: whether the surfaces separated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub separated: Option<bool>,
    /// With adhesion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pull_off: Option<AtomPullOff>,
}

/// Change from loading to unloading at one load.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BranchChange {
    pub p_star: f64,
    pub contact_fraction_loading: f64,
    pub contact_fraction_unloading: f64,
    /// Mean gap on unloading minus that on loading, Å.
    pub mean_gap_angstrom: f64,
}

/// The largest tensile load of the atoms on unloading.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AtomPullOff {
    pub step: usize,
    /// Negative.
    pub force_ev_per_angstrom: f64,
    /// Increase of the tension over the last step: an upper bound of the error.
    pub error_ev_per_angstrom: f64,
    pub force_nn: f64,
    pub p_star: f64,
    /// Displacement of the indenter below its initial position, and its rise over the last step.
    pub displacement_angstrom: f64,
    pub step_angstrom: f64,
    pub contacts: usize,
}

/// NVT runs from relaxed states.
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

/// NVT run at one load. Errors are standard errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NvtState {
    /// Of its load step, from 0.
    pub index: usize,
    pub p_star: f64,
    /// Of the deformable atoms.
    pub temperature_k: ValueWithError,
    /// On the indenter, over the one asked for.
    pub load: ValueWithError,
    /// Contact probability of the surface atoms, averaged over the layer.
    pub contact_fraction: ValueWithError,
    pub mean_gap_angstrom: ValueWithError,
    /// Fraction of the surface atoms with a contact probability above one half.
    pub majority_contact: f64,
    /// Fraction of them in contact at any time.
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
    /// Contact modulus E* of the block.
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

/// One dimensionless group of the scaling audit: target of the scene, actual value of the simulation, and reason of a difference.
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
