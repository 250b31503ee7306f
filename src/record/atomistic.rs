//! What is told of the atoms beside their contact by distance, and of each version of the compared problem.

use crate::observe::Distribution;
use serde::{Deserialize, Serialize};

/// The atoms' contact area under one criterion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContactWay {
    /// "distance", "pressed", "loaded" or "area".
    pub id: String,
    pub criterion: String,
    /// Atoms that touch, wherever they started.
    pub atoms: usize,
    /// Share of the cell: atoms of the surface layer over all of that layer, for "area" the touching atoms' own shares.
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
pub struct PlasticState {
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
    pub noise: usize,
    /// p* and number of atoms of every step.
    pub steps: Vec<[f64; 2]>,
    /// p* of the first step above the noise; none where there is none.
    pub first_yield: Option<f64>,
    /// Mean stress in the contact at the asked loads beyond it, on average, GPa.
    pub hardness_gpa: Option<f64>,
}

/// One version of the problem at one load. All are read at the block's surface sites, so that none has a finer map than
/// another; stresses are smoothed by the atoms' Gaussian.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Version {
    /// "full heights", "hard wall", "raised", "soft wall" or "atoms".
    pub id: String,
    pub criterion: String,
    pub contact_fraction: f64,
    pub mean_gap_angstrom: f64,
    /// Mean pressure over the contact fraction; none without contact.
    pub contact_stress_gpa: Option<f64>,
    pub patches: usize,
    /// Half of the contact lies in patches up to this area; none without contact.
    pub typical_patch_nm2: Option<f64>,
    /// Patch area (nm²), share of the contact in patches up to it.
    pub patch_area: Vec<[f64; 2]>,
    /// Of gaps in Å; what touches is the delta.
    pub gap: Distribution,
    /// Of the smoothed normal stress in GPa, over the whole cell.
    pub stress: Distribution,
}
