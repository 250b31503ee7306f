//! Continuum against atoms at the same loads, in the terms of `results.json`.

use super::continuum::ContinuumResults;
use crate::observe::Distribution;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ComparisonResults {
    /// Continuum on the full heights of the scene's grid, with the atoms' kernel and load and a hard wall; none in older files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub full_heights: Option<ContinuumResults>,
    /// Continuum on the atoms' own heights, kernel and load, with a hard wall.
    pub hard_wall: ContinuumResults,
    /// With the law of the atoms' wall as atoms feel it instead of the hard one, on what a ball feels of the heights: its gaps and
    /// mean gaps count from there.
    pub compliant_wall: ContinuumResults,
    pub loads: Vec<LoadComparison>,
    /// `[n]` position and gap columns per load, in the section x = L/2.
    pub sections: Vec<Section>,
    /// Sentences on the causes of the differences, each with its numbers.
    pub findings: Vec<String>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct LoadComparison {
    pub p_star: f64,
    /// Best periodic shift of the atoms' map against the continuum's, pixels (0, 0 when they are registered).
    pub registration: [i64; 2],
    pub atoms: CriterionArea,
    /// One line per continuum criterion, the plain one first.
    pub continuum: Vec<CriterionMatch>,
    pub atoms_mean_gap_angstrom: f64,
    pub hard_wall_mean_gap_angstrom: f64,
    pub compliant_wall_mean_gap_angstrom: f64,
    pub atoms_patches: usize,
    pub hard_wall_patches: usize,
    /// rms difference of the gap maps outside both contacts, Å.
    pub gap_rms_difference_angstrom: f64,
    /// File of the soft wall's gap up to the heights themselves, as the atoms' gaps count, units of L; none in older files.
    pub compliant_wall_gap: String,
    /// Stepwise comparison from the full heights to the atoms.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub model_chain: Vec<ModelChainStep>,
    /// Contact against the contact distance: d_c (Å), fractions of atoms, matched hard wall and soft wall.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub area_vs_distance: Vec<[f64; 4]>,
    /// Contact of the hard and of the soft wall against the gap up to which a point counts: gap (Å), two fractions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub area_vs_gap: Vec<[f64; 3]>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct CriterionArea {
    pub criterion: String,
    pub contact_fraction: f64,
}

/// The continuum's contact under one criterion, against the atoms' contact at the same surface sites.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct CriterionMatch {
    /// "hard_wall", "offset_wall" or "compliant_wall".
    pub id: String,
    pub criterion: String,
    /// Offset of the atoms on the continuum's surface before the distance criterion is applied, Å.
    pub offset_angstrom: f64,
    pub contact_fraction: f64,
    pub overlap: Overlap,
    /// The same numbers for the map shifted by a third and a fifth of the cell: what chance gives.
    pub shifted: Overlap,
    /// The continuum's contact on the grid of the comparison, one value per surface atom spread over its nodes; none in
    /// results of an earlier version.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub map: Option<String>,
}

impl CriterionMatch {
    /// Name for captions.
    pub fn label(&self) -> &str {
        match self.id.as_str() {
            "hard_wall" => "hard wall",
            "offset_wall" => "offset wall",
            "compliant_wall" => "compliant wall",
            other => other,
        }
    }
}

/// Agreement of two boolean maps; the second is the reference. NaN-free: an empty union has Jaccard 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Overlap {
    pub jaccard: f64,
    pub precision: f64,
    pub recall: f64,
    /// Cohen's κ.
    pub kappa: f64,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Section {
    pub p_star: f64,
    /// Position along y over L, rigid surface, and gaps in Å; NaN-free.
    pub y: Vec<f64>,
    pub atoms_gap_angstrom: Vec<f64>,
    pub hard_wall_gap_angstrom: Vec<f64>,
    pub compliant_wall_gap_angstrom: Vec<f64>,
    /// Of the continuum on the full heights; empty in older files.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub full_heights_gap_angstrom: Vec<f64>,
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
