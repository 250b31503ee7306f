//! Definition of a LAMMPS job, stored in `job.json`: interaction, relaxation and loading protocol.

use serde::{Deserialize, Serialize};

use super::block::Block;
use super::initial_configuration::PrescribedLoads;
use super::interaction::Interaction;
use super::nvt::NvtRun;
use asperity_grid::{Error, Result};

/// Default of [`RelaxationSettings::force_tolerance`], eV/Å. With a larger tolerance, steps at prescribed load end by
/// the balance of the forces on indenter and base (`prescribed_load.in`).
pub const FORCE_TOLERANCE: f64 = 2e-3;

/// Layers of the block in every frame: the first determines contact, two more show plastic flow.
pub const FRAME_LAYERS: usize = 3;

/// Relaxation of the load steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Minimizer {
    /// The harmonic relaxation where the library of LAMMPS can be loaded. Without it, and at steps at which the crystal slips: LAMMPS's own
    /// minimisers, which are FIRE at prescribed loads and conjugate gradients in displacement ramps.
    #[default]
    Auto,
    /// The harmonic relaxation. A missing library is an error, and so is a step that it does not relax.
    Harmonic,
    /// LAMMPS's own minimisers.
    Fire,
}

impl Minimizer {
    /// Whether the harmonic relaxation may relax a step.
    pub fn may_be_harmonic(self) -> bool {
        self != Minimizer::Fire
    }
}

/// Relaxation and output of each load step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RelaxationSettings {
    /// Convergence criterion: largest force component on a free atom, eV/Å.
    pub force_tolerance: f64,
    pub minimizer: Minimizer,
    /// Load at p* = 1: cell area × E* × rms gradient, eV/Å.
    pub load_unit: f64,
    /// Distance to an indenter atom below which an atom is in contact, Å.
    pub contact_angstrom: f64,
    /// Layers of the block, from the top, in every frame.
    pub frame_layers: usize,
    /// Keep the restart files of all steps, not only of the last two.
    pub keep_restarts: bool,
}

/// Displacement-controlled loading in equal steps, starting just before first contact.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DisplacementRamp {
    /// Displacement per step, Å.
    pub step_angstrom: f64,
    /// Loading ends with the first step whose load reaches this value, eV/Å.
    pub max_load: f64,
    pub max_steps: usize,
    /// After the peak load the indenter rises until the surfaces are separated.
    pub unload: bool,
}

/// Loading protocol.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LoadingProtocol {
    /// The indenter is displaced step by step.
    Ramp(DisplacementRamp),
    /// Each step has a given load and starts from the continuum's displacement field.
    Prescribed(PrescribedLoads),
    /// Relaxed states of prescribed loads are sampled at constant temperature.
    Nvt(NvtRun),
}

impl LoadingProtocol {
    pub fn ramp(&self) -> Option<&DisplacementRamp> {
        match self {
            LoadingProtocol::Ramp(ramp) => Some(ramp),
            _ => None,
        }
    }

    pub fn ramp_mut(&mut self) -> Option<&mut DisplacementRamp> {
        match self {
            LoadingProtocol::Ramp(ramp) => Some(ramp),
            _ => None,
        }
    }

    pub fn prescribed(&self) -> Option<&PrescribedLoads> {
        match self {
            LoadingProtocol::Prescribed(loads) => Some(loads),
            _ => None,
        }
    }

    pub fn nvt(&self) -> Option<&NvtRun> {
        match self {
            LoadingProtocol::Nvt(run) => Some(run),
            _ => None,
        }
    }
}

/// Contents of `job.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JobSpec {
    pub element: String,
    #[serde(flatten)]
    pub block: Block,
    pub deformable: u64,
    pub fixed: u64,
    pub indenter: u64,
    pub indenter_points: usize,
    pub indenter_spacing_angstrom: f64,
    pub indenter_start_z_angstrom: f64,
    pub frame_depth_angstrom: f64,
    pub interaction: Interaction,
    pub settings: RelaxationSettings,
    pub protocol: LoadingProtocol,
    /// BLAKE3 hashes of the input files; a different hash makes a different job.
    pub data_hash: String,
    pub script_hash: String,
    pub potential_hash: String,
}

impl JobSpec {
    /// Whether the finished steps of `earlier` are also steps of this job. `common_loads`: the lists of prescribed
    /// loads have their first loads in common.
    pub(super) fn shares_steps_with(&self, earlier: JobSpec, common_loads: bool) -> bool {
        let mut settings = earlier.settings;
        // Additional restart files do not change the steps.
        settings.keep_restarts &= self.settings.keep_restarts;
        // The end of a loading ramp does not change its steps. An unloading branch depends on the peak load.
        if !earlier.protocol.ramp().is_some_and(|ramp| ramp.unload) {
            settings.load_unit = self.settings.load_unit;
        }
        let protocol = match (earlier.protocol, &self.protocol) {
            (LoadingProtocol::Ramp(then), LoadingProtocol::Ramp(now)) if !then.unload => {
                LoadingProtocol::Ramp(DisplacementRamp { max_load: now.max_load, max_steps: now.max_steps, ..then })
            }
            (_, LoadingProtocol::Prescribed(now)) if common_loads => LoadingProtocol::Prescribed(now.clone()),
            (then, _) => then,
        };
        JobSpec { settings, protocol, ..earlier } == *self
    }
}

pub(super) fn check(
    interaction: &Interaction,
    settings: &RelaxationSettings,
    ramp: Option<&DisplacementRamp>,
    element: &str,
    mass_u: f64,
) -> Result<()> {
    let context = "LAMMPS job";
    let mut list = vec![
        ("epsilon", interaction.epsilon_ev),
        ("sigma", interaction.sigma_angstrom),
        ("mass", mass_u),
        ("load at p* = 1", settings.load_unit),
        ("force tolerance", settings.force_tolerance),
        ("contact distance", settings.contact_angstrom),
    ];
    if let Some(ramp) = ramp {
        list.push(("step", ramp.step_angstrom));
        list.push(("largest load", ramp.max_load));
    }
    if let Some(yukawa) = interaction.adhesion {
        list.push(("kappa", yukawa.kappa_per_angstrom));
        list.push(("Yukawa cut-off", yukawa.cutoff_angstrom));
        if !yukawa.amplitude_ev_angstrom.is_finite() {
            return Err(Error::input(context, "amplitude", yukawa.amplitude_ev_angstrom, "a finite number"));
        }
    }
    for (key, value) in list {
        if !(value.is_finite() && value > 0.0) {
            return Err(Error::input(context, key, value, "a positive number"));
        }
    }
    if settings.contact_angstrom < interaction.touch_angstrom() {
        let accepted = format!("at least {}, where the repulsion begins", interaction.touch_angstrom());
        return Err(Error::input(context, "contact distance", settings.contact_angstrom, accepted));
    }
    if !is_symbol(element) {
        return Err(Error::input(context, "element", element, "a chemical symbol"));
    }
    Ok(())
}

/// Whether a text can be a chemical symbol: one word, which LAMMPS takes as it is.
pub(super) fn is_symbol(element: &str) -> bool {
    !element.is_empty() && element.chars().all(|c| c.is_ascii_alphanumeric())
}
