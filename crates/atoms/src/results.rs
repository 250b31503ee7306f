//! Results of the atomistic simulation, in the terms of `results.json`.

use super::repulsion::Repulsion;
use asperity_contact::load::{AtLoad, Branch};
use asperity_contact::uncertainty::ValueWithError;
use serde::{Deserialize, Serialize};

/// Contact area of the atoms under one criterion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct ContactByCriterion {
    /// "distance", "compressed", "force_threshold" or "voronoi_area".
    pub id: String,
    /// In words.
    pub criterion: String,
    /// Number of contact atoms, all layers.
    pub atoms: usize,
    /// Contact atoms of the surface layer over all atoms of that layer; for "voronoi_area": Voronoi area of the
    /// contact atoms over the area of the cell.
    pub contact_area: f64,
}

/// Normal force of the indenter on the atoms as a smooth stress field.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct AtomStress {
    /// Standard deviation of the Gaussian that distributes each force, Å.
    pub width_angstrom: f64,
    /// Relative deviation of the integrated field from the load.
    pub load_error: f64,
    /// Largest compressive stress, GPa.
    pub highest_gpa: f64,
    /// `[ny, nx]` f64 map on the comparison grid, GPa.
    pub map: String,
}

/// Defect atoms (centro-symmetry) at one load.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct DefectAtoms {
    /// Number of defect atoms at the nearest load step.
    pub atoms: usize,
    /// Their volume in the crystal, nm³.
    pub volume_nm3: f64,
}

/// Onset of plasticity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct PlasticityResults {
    /// Number of atoms analysed per step: the deformable ones below the masked layers, without the lowest layer.
    pub atoms: usize,
    /// Layers of the surface, whose atoms are not counted.
    pub masked_layers: usize,
    /// Centro-symmetry parameter over a0² above which an atom is a defect atom.
    pub threshold: f64,
    /// Largest number of defect atoms without yield.
    pub noise_atoms: usize,
    /// p* and number of defect atoms of every step.
    pub steps: Vec<[f64; 2]>,
    /// p* of the first step above the noise; absent without yield.
    pub first_yield: Option<f64>,
    /// p* of the step before first yield: yield occurs between the two.
    pub last_elastic: Option<f64>,
    /// Layers between the base and the lowest defect atom of any step beyond the noise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layers_above_base: Option<usize>,
    /// Mean contact stress over the requested loads beyond first yield, GPa.
    pub hardness_gpa: Option<f64>,
}

/// Minimiser that relaxed a step; the words are those of `load_steps.csv`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum StepMinimizer {
    #[serde(rename = "harmonic")]
    Harmonic,
    /// The harmonic relaxation, ended by FIRE.
    #[serde(rename = "harmonic+fire")]
    HarmonicFire,
    /// The harmonic relaxation, ended by conjugate gradients.
    #[serde(rename = "harmonic+cg")]
    HarmonicCg,
    #[serde(rename = "fire")]
    Fire,
    /// Conjugate gradients.
    #[serde(rename = "cg")]
    Cg,
    /// No minimiser: a state sampled at constant temperature.
    #[serde(rename = "none")]
    Sampled,
}

impl StepMinimizer {
    pub const ALL: [StepMinimizer; 6] = {
        use StepMinimizer::*;
        [Harmonic, HarmonicFire, HarmonicCg, Fire, Cg, Sampled]
    };

    /// The word in files.
    pub fn word(self) -> &'static str {
        match self {
            StepMinimizer::Harmonic => "harmonic",
            StepMinimizer::HarmonicFire => "harmonic+fire",
            StepMinimizer::HarmonicCg => "harmonic+cg",
            StepMinimizer::Fire => "fire",
            StepMinimizer::Cg => "cg",
            StepMinimizer::Sampled => "none",
        }
    }

    /// The minimiser of a word.
    pub fn of_word(word: &str) -> Option<Self> {
        StepMinimizer::ALL.into_iter().find(|m| m.word() == word)
    }
}

/// One load step.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct LoadStepResults {
    /// Number of the step.
    pub step: usize,
    /// Descent of the indenter from its initial position.
    pub displacement_angstrom: f64,
    /// Normal force on the indenter, repulsion positive.
    pub load_ev_per_angstrom: f64,
    /// Load.
    pub p_star: f64,
    /// Number of contact atoms.
    pub contacts: usize,
    /// Potential energy, eV. With an elastic base that of the missing layers counts from the mean strain of the step: differences between steps are
    /// not work.
    pub energy_ev: f64,
    /// Force evaluations of LAMMPS.
    pub force_evaluations: usize,
    /// Largest force on an atom at the end, eV/Å.
    pub max_force_ev_per_angstrom: f64,
    /// What relaxed the step.
    pub minimizer: StepMinimizer,
    /// Steps that the harmonic relaxation rejected.
    pub rejected: usize,
    /// Decrease of the energy that the harmonic crystal still predicts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub predicted_decrease_ev: Option<f64>,
}

impl AtomsResults {
    /// Number of atoms that move: the deformable ones, and those of an elastic base.
    pub fn moving(&self) -> usize {
        self.deformable + if self.elastic_base { self.fixed } else { 0 }
    }
}

impl AtomState {
    /// Contact atoms below which a comparison is hardly more than a count: the counting error of 30 is 18 %, twice the difference between
    /// atoms and continuum that many surfaces show (8 to 10 %).
    pub const FEW_CONTACTS: usize = 30;

    /// File with one value per surface site, of its `contact` or its `gap`.
    pub fn per_site(&self, quantity: &str) -> String {
        self.contact_map.replace("contact.npy", &format!("site-{quantity}.npy"))
    }

    /// Whether the state has fewer contact atoms than [`AtomState::FEW_CONTACTS`].
    pub fn has_few_contacts(&self) -> bool {
        self.contacts < Self::FEW_CONTACTS
    }
}

/// The atoms at one load; for a displacement ramp interpolated between two load steps.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct AtomState {
    /// Index of the load step, from 0.
    pub index: usize,
    /// Loading or unloading.
    pub branch: Branch,
    /// Load p* as it was imposed.
    pub p_star: f64,
    /// Contact atoms of the surface layer over all atoms of that layer.
    pub contact_area: f64,
    /// Number of contact atoms.
    pub contacts: usize,
    /// Contact atoms that were initially below the surface layer: more than a few indicate plastic flow.
    pub contacts_below_surface: usize,
    /// Mean gap over the surface sites, Å.
    pub mean_gap_angstrom: f64,
    /// Mean normal stress over the contact atoms' area.
    pub contact_stress_gpa: f64,
    /// File of the contact, u8 `[ny, nx]` on the comparison grid.
    pub contact_map: String,
    /// File of the gap, f64 `[ny, nx]` on the comparison grid, Å.
    pub gap_map: String,
    /// Extended XYZ file of the frame.
    pub frame: Option<String>,
    /// Correction of the interpolated indenter displacement that balances the load, Å.
    pub indenter_shift_angstrom: f64,
    /// Contact area under each criterion.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub criteria: Vec<ContactByCriterion>,
    /// Contact distance d_c (Å) and the contact fraction with it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sensitivity: Vec<[f64; 2]>,
    /// Normal stress, where requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stress: Option<AtomStress>,
    /// Defect atoms, where requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub defects: Option<DefectAtoms>,
}

impl AtLoad for AtomState {
    fn index(&self) -> usize {
        self.index
    }
}

/// Unloading from the peak load.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Unloading {
    /// Load step of the peak load.
    pub reversal_step: usize,
    /// The requested loads in decreasing order.
    pub states: Vec<AtomState>,
    /// Changes from the loading branch at the same loads, in the order of `states`.
    pub changes: Vec<BranchChange>,
    /// Whether the surfaces separated; for displacement ramps only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub separated: Option<bool>,
    /// Pull-off force, with adhesion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pull_off: Option<AtomPullOff>,
}

/// Change from loading to unloading at one load.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct BranchChange {
    /// Load.
    pub p_star: f64,
    /// Contact area over the area of the cell on loading.
    pub contact_area_loading: f64,
    /// The same on unloading.
    pub contact_area_unloading: f64,
    /// Mean gap on unloading minus mean gap on loading, Å.
    pub mean_gap_angstrom: f64,
}

/// Largest tensile load of the atoms on unloading.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct AtomPullOff {
    /// Number of the load step.
    pub step: usize,
    /// Pull-off force (negative).
    pub force_ev_per_angstrom: f64,
    /// Increase of the tensile load over the last step: an upper bound of the error.
    pub error_ev_per_angstrom: f64,
    /// The same, nN.
    pub force_nn: f64,
    /// Load of that step.
    pub p_star: f64,
    /// Displacement of the indenter from its initial position, downwards, Å.
    pub displacement_angstrom: f64,
    /// Rise of the indenter over the last step, Å.
    pub step_angstrom: f64,
    /// Number of contact atoms.
    pub contacts: usize,
}

/// NVT runs from the relaxed states.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct NvtResults {
    /// Temperature, K.
    pub temperature_k: f64,
    /// Lattice constant at the temperature, to which the cell is expanded, Å.
    pub lattice_constant_angstrom: f64,
    /// Equilibration time and averaging time at each load, and time step, ps.
    pub equilibration_ps: f64,
    /// Time over which means are taken, ps.
    pub averaging_ps: f64,
    /// Time step, ps.
    pub timestep_ps: f64,
    /// Number of time blocks; errors are computed from the scatter of the block averages.
    pub blocks: usize,
    /// One for each load.
    pub states: Vec<NvtState>,
}

/// NVT run at one load. Errors are standard errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct NvtState {
    /// Index of the load step, from 0.
    pub index: usize,
    /// Load.
    pub p_star: f64,
    /// Temperature of the deformable atoms.
    pub temperature_k: ValueWithError,
    /// Load on the indenter over the prescribed load.
    pub load: ValueWithError,
    /// Contact probability averaged over the surface layer.
    pub contact_area: ValueWithError,
    /// Mean gap over the surface sites, Å.
    pub mean_gap_angstrom: ValueWithError,
    /// Fraction of the surface atoms with a contact probability above one half.
    pub majority_contact: f64,
    /// Fraction of the surface atoms in contact in at least one sample.
    pub any_contact: f64,
    /// File of the `[ny, nx]` f64 map of the contact probability on the comparison grid.
    pub probability_map: String,
    /// File of the contact probability of each surface site.
    pub site_probability: String,
    /// File of the standard errors of these probabilities.
    pub site_error: String,
}

/// What LAMMPS computed for the block under the indenter.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct AtomsResults {
    /// Name of the potential.
    pub potential: String,
    /// Version line of LAMMPS.
    pub engine: String,
    /// Lattice constants along x and y.
    pub cells: usize,
    /// Lattice constants in depth that move.
    pub depth_cells: usize,
    /// Thickness of the elastic foundation, lattice constants; 0 for a rigid base.
    #[serde(default, skip_serializing_if = "asperity_surface::files::json::is_default")]
    pub foundation_cells: usize,
    /// Whether the lowest layers move under the forces of the crystal missing below them.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub elastic_base: bool,
    /// Lattice constant, Å.
    pub a0_angstrom: f64,
    /// Extent of the block in x, Å.
    pub length_angstrom: f64,
    /// Contact modulus E* of the (001) face of the block, GPa: the harmonic mean over the directions in it.
    pub modulus_gpa: f64,
    /// Number of deformable atoms.
    pub deformable: usize,
    /// Number of atoms of the base: they are fixed, follow the continuum, or move with an elastic base.
    pub fixed: usize,
    /// Number of atoms of the indenter.
    pub indenter: usize,
    /// Wall between indenter and crystal.
    pub repulsion: Repulsion,
    /// Constants of the set-up against those intended.
    pub audit: Vec<AuditLine>,
    /// True for prescribed loads started from the continuum's displacement field; false for a displacement ramp.
    #[serde(default, skip_serializing_if = "asperity_surface::files::json::is_default")]
    pub from_continuum: bool,
    /// Every step of LAMMPS.
    pub load_steps: Vec<LoadStepResults>,
    /// One for each load of the scene.
    pub states: Vec<AtomState>,
    /// Only with an unloading branch or pull-off.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unloading: Option<Unloading>,
    /// Only where the scene requests an NVT run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nvt: Option<NvtResults>,
    /// Only where the scene requests it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plasticity: Option<PlasticityResults>,
}

/// One dimensionless group of the scaling audit: target value of the scene, actual value of the simulation, and
/// reason of a difference.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct AuditLine {
    /// What it belongs to.
    pub group: String,
    /// Symbol.
    pub symbol: String,
    /// Intended value, with its unit.
    pub target: f64,
    /// Value of the set-up.
    pub actual: f64,
    /// "kept", "changed" or "unreachable".
    pub status: String,
    /// Why they may differ.
    pub reason: String,
}
