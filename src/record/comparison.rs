//! Comparison of continuum and atoms at the same loads, as in `results.json`.

use asperity_contact::observe::Distribution;
use asperity_contact::results::ContinuumResults;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Continuum and atoms on one profile. The continuum is in SI units at the scale of the block.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct ComparisonResults {
    /// Continuum with a hard wall on the full heights of the scene's grid, with the kernel and loads of the atoms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub full_heights: Option<ContinuumResults>,
    /// Continuum with a hard wall on the heights, kernel and loads of the atoms.
    pub hard_wall: ContinuumResults,
    /// Continuum with the compliant wall (the repulsion law of the indenter with the compliance of single atoms) on
    /// the dilated heights. Its gaps and mean gaps are measured from the dilated heights.
    pub compliant_wall: ContinuumResults,
    /// The same with the crystal's hardness; absent if the scene gives none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub yielding_wall: Option<ContinuumResults>,
    /// One for each load.
    pub loads: Vec<LoadComparison>,
    /// Gap profiles in the section x = L/2, one per load.
    pub sections: Vec<GapSection>,
    /// Sentences on the causes of the differences, with numbers.
    pub findings: Vec<String>,
}

/// Atoms and continuum at one load.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct LoadComparison {
    /// Load.
    pub p_star: f64,
    /// Periodic shift of the atoms' map with the best agreement, pixels; (0, 0) if the maps are registered.
    pub registration: [i64; 2],
    /// Contact area of the atoms under each criterion.
    pub atoms: CriterionArea,
    /// One entry per continuum criterion, the hard wall first.
    pub continuum: Vec<CriterionMatch>,
    /// Mean gap of the atoms, Å.
    pub atoms_mean_gap_angstrom: f64,
    /// Of the continuum with a hard wall, Å.
    pub hard_wall_mean_gap_angstrom: f64,
    /// Of the continuum with the compliant wall, Å.
    pub compliant_wall_mean_gap_angstrom: f64,
    /// The same with the hardness of the crystal, Å.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub yielding_wall_mean_gap_angstrom: Option<f64>,
    /// Number of contact clusters of the atoms.
    pub atoms_clusters: usize,
    /// Of the continuum with the compliant wall.
    pub compliant_wall_clusters: usize,
    /// rms difference of the gap maps out of contact in both maps, Å; absent where every site is in contact in one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gap_rms_difference_angstrom: Option<f64>,
    /// File of the compliant wall's gap measured from the original heights, as the gap of the atoms, units of L.
    pub compliant_wall_gap: String,
    /// Stepwise comparison from the full heights to the atoms.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub model_chain: Vec<ModelChainStep>,
    /// Contact fraction against contact distance: d_c (Å), fractions of atoms, offset wall (shifted for each distance) and compliant wall.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub area_vs_distance: Vec<[f64; 4]>,
    /// Contact fraction against gap threshold: gap (Å), fractions of hard wall and compliant wall.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub area_vs_gap: Vec<[f64; 3]>,
}

impl LoadComparison {
    /// Mean gap of the solution to which the criterion `id` is applied, Å. `None` for a criterion that was not applied.
    #[must_use]
    pub fn mean_gap_angstrom(&self, id: &str) -> Option<f64> {
        match id {
            "hard_wall" | "offset_wall" => Some(self.hard_wall_mean_gap_angstrom),
            "compliant_wall" => Some(self.compliant_wall_mean_gap_angstrom),
            "yielding_wall" => self.yielding_wall_mean_gap_angstrom,
            _ => None,
        }
    }
}

/// Contact area under one criterion.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct CriterionArea {
    /// In words.
    pub criterion: String,
    /// Over the area of the cell.
    pub contact_area: f64,
}

/// Contact of the continuum under one criterion, compared with the contact of the atoms at the same surface sites.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct CriterionMatch {
    /// "hard_wall", "offset_wall", "compliant_wall" or "yielding_wall".
    pub id: String,
    /// In words.
    pub criterion: String,
    /// Offset of the atoms from the surface of the continuum before the distance criterion is applied, Å.
    pub offset_angstrom: f64,
    /// Over the area of the cell.
    pub contact_area: f64,
    /// Agreement with the atoms.
    pub overlap: Overlap,
    /// Agreement of a map shifted by a third and a fifth of the cell: chance agreement.
    pub shifted: Overlap,
    /// File of the continuum's contact map on the comparison grid; each surface site covers its nodes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub map: Option<String>,
}

impl CriterionMatch {
    /// Name in captions.
    pub fn label(&self) -> &str {
        match self.id.as_str() {
            "hard_wall" => "hard wall",
            "offset_wall" => "offset wall",
            "compliant_wall" => "compliant wall",
            "yielding_wall" => "compliant wall with hardness",
            other => other,
        }
    }
}

/// Agreement of two boolean maps; the second is the reference. All values are finite: an empty union has Jaccard
/// index 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Overlap {
    /// Nodes of both maps over nodes of either.
    pub jaccard: f64,
    /// Nodes of both maps over those of the first.
    pub precision: f64,
    /// Nodes of both maps over those of the second.
    pub recall: f64,
    /// Cohen's κ.
    pub kappa: f64,
}

/// Gaps along y in the section in the middle of the cell, Å.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct GapSection {
    /// Load.
    pub p_star: f64,
    /// Place along y over the extent in x.
    pub y: Vec<f64>,
    /// Gap of the atoms, Å.
    pub atoms_gap_angstrom: Vec<f64>,
    /// Gap of the continuum with a hard wall, Å.
    pub hard_wall_gap_angstrom: Vec<f64>,
    /// Gap of the continuum with the compliant wall, Å.
    pub compliant_wall_gap_angstrom: Vec<f64>,
    /// Gap of the continuum on the full heights, Å.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub full_heights_gap_angstrom: Vec<f64>,
}

/// One step of the model chain at one load. All steps are evaluated at the block's surface sites, so their resolution
/// is equal; stresses are smoothed by the same Gaussian as those of the atoms.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ModelChainStep {
    /// "full_heights", "hard_wall", "offset_wall", "compliant_wall" or "atoms".
    pub id: String,
    /// In words.
    pub criterion: String,
    /// Over the area of the cell.
    pub contact_area: f64,
    /// Mean gap, Å.
    pub mean_gap_angstrom: f64,
    /// Mean pressure over the contact fraction, GPa; absent without contact.
    pub contact_stress_gpa: Option<f64>,
    /// Number of contact clusters.
    pub clusters: usize,
    /// Area-weighted median of the cluster areas, nm²; absent without contact.
    pub median_cluster_area_nm2: Option<f64>,
    /// Cluster area (nm²), fraction of the contact in clusters up to this area.
    pub cluster_area: Vec<[f64; 2]>,
    /// Distribution of gaps in Å; contact is the delta.
    pub gap: Distribution,
    /// Distribution of the smoothed normal stress in GPa, over the whole cell.
    pub stress: Distribution,
}
