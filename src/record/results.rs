//! `results.json`: everything a run found, in one plain structure.
//!
//! The report, the comparison tables and every figure are drawn from this file and the field files it names, so that a
//! number in a report is never typed and a report can be drawn again without running anything. Paths are relative to
//! the run folder. Lengths are reduced (unit: the cell's extent in x) unless the name carries a unit; `p_star` is the
//! mean pressure over E* times the full spectrum's rms gradient.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::acceptance::AcceptanceCheck;
use super::advice::AccuracyChoice;
pub use super::atomistic::{
    AtomPullOff, AtomState, AtomStress, BranchChange, ContactByCriterion, DefectAtoms, LoadStepResults, ModelChainStep,
    NvtResults, NvtState, PlasticityResults, Unloading, ValueWithError,
};
use super::json;
use super::methods::MethodResults;
use super::uncertainty::UncertaintyComponent;
use crate::error::{Error, Result};
use crate::load::{AtLoad, Branch};
use crate::observe::Distribution;

/// Raised when a field changes its name or meaning; a reader accepts no other.
pub const SCHEMA: u32 = 2;

/// Name of the file in a run folder.
pub const FILE: &str = "results.json";
/// What ran, on what, for how long, beside it.
pub const MANIFEST_FILE: &str = "manifest.json";

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Results {
    pub schema: u32,
    pub name: String,
    /// One paragraph from the scene, printed at the top of the report.
    pub description: String,
    pub scales: ScalesSi,
    pub surface: SurfaceResults,
    /// How the scene's accuracy chose grid, method, precision and tolerance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<AccuracyChoice>,
    /// The laboratory-scale problem of the scene.
    pub continuum: Option<ContinuumResults>,
    /// The loads there, without adhesion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub non_adhesive: Option<ContinuumResults>,
    /// The loads there, with other ranges of the adhesion.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub other_ranges: Vec<ContinuumResults>,
    /// The reference load without adhesion, by the method that is compared with.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cross_check: Option<ContinuumResults>,
    /// What other methods tell of the same loads.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub methods: Vec<MethodResults>,
    /// What was to be solved beside the asked problem and could not be, and why.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub failures: Vec<String>,
    /// What the challenge says, held against what was found.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub acceptance: Vec<AcceptanceCheck>,
    pub atoms: Option<AtomsResults>,
    pub comparison: Option<ComparisonResults>,
    pub stages: Vec<StageCost>,
    /// Sentences a reader must see: unresolved wavelengths, regularised ranges, yield.
    pub warnings: Vec<String>,
    /// Papers and data behind the numbers, as printed at the end of the report.
    pub sources: Vec<String>,
}

impl Results {
    /// Reads `results.json` of a run folder.
    ///
    /// # Errors
    /// A folder without results, results of another schema.
    pub fn read(run_folder: &Path) -> Result<Self> {
        let path = run_folder.join(FILE);
        if !path.exists() {
            return Err(no_run(run_folder));
        }
        json::read_schema(&path, SCHEMA)
    }

    /// Writes `results.json` into a run folder. A NaN or an infinity has no place in JSON and is refused here, where the
    /// stage that made it can still be told.
    pub fn write(&self, run_folder: &Path) -> Result<()> {
        let path = run_folder.join(FILE);
        // Such numbers become `null`, which no field but an optional one accepts.
        let readable = serde_json::to_string(self).and_then(|text| serde_json::from_str::<Results>(&text).map(|_| ()));
        readable.map_err(|e| Error::format(&path, format!("a value that is not finite ({e})"), "finite numbers"))?;
        json::write(&path, self)
    }
}

/// A folder without results, told by what it lacks.
fn no_run(folder: &Path) -> Error {
    let missing: Vec<&str> = [FILE, MANIFEST_FILE].into_iter().filter(|f| !folder.join(f).exists()).collect();
    let verb = if missing.len() > 1 { "are" } else { "is" };
    let found = match std::fs::metadata(folder) {
        Err(_) => "not a run folder: there is no such folder".to_string(),
        Ok(m) if !m.is_dir() => "not a run folder but a file".to_string(),
        Ok(_) => format!("not a run folder, or one whose run has not ended: {} {verb} missing", missing.join(" and ")),
    };
    Error::format(folder, found, "the folder of a run that `asperity run` has finished")
}

#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct ScalesSi {
    pub length_m: f64,
    pub modulus_pa: f64,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SurfaceResults {
    /// What made it: "synthesised, seed 1" or the imported file.
    pub origin: String,
    pub nx: usize,
    pub ny: usize,
    /// Extent in y over extent in x.
    pub aspect: f64,
    /// Whether the cell repeats. If not, statistics and spectrum are those of a patch: see [`Self::note`].
    pub periodic: bool,
    /// What statistics and spectrum assume, where that is not the periodic cell.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub note: String,
    /// `[ny, nx]` f64 heights, low points touch first, min = 0.
    /// Absent where no map was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heights: Option<String>,
    pub statistics: Vec<Statistic>,
    /// Radial power spectral density; absent `expected` for an imported surface.
    pub psd: Vec<PsdPoint>,
}

/// Symbols of [`Statistic`]s that others look up.
pub const RMS_HEIGHT: &str = "h_rms";
pub const CURVATURE_RADIUS: &str = "R_c";
pub const FIRST_TOUCH: &str = "h̄ - h_min";
pub const HEIGHT_RANGE: &str = "h_max - h_min";

impl SurfaceResults {
    /// The statistic with a symbol, if the surface has it.
    pub fn statistic(&self, symbol: &str) -> Option<&Statistic> {
        self.statistics.iter().find(|s| s.symbol == symbol)
    }
}

/// One line of the table "expected against realised".
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Statistic {
    pub name: String,
    pub symbol: String,
    /// Unit of both values, for people ("µm", "nm", "1").
    pub unit: String,
    /// Ensemble value of the spectrum; none for an imported surface.
    pub expected: Option<f64>,
    /// The same of the modes that the grid holds, where it does not hold the whole spectrum.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expected_on_grid: Option<f64>,
    pub realised: f64,
    /// Half-width of the band in which a realisation is expected (two standard deviations), where known.
    pub band: Option<f64>,
}

#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct PsdPoint {
    /// Mode number |n| (wave vector over 2π/L).
    pub mode: f64,
    /// Power per mode, units of L².
    pub realised: f64,
    pub expected: Option<f64>,
}

/// Continuum states of one problem along its load path.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ContinuumResults {
    pub method: String,
    /// "half-space" or "layer 0.143 L thick, bonded, nu = 0.30".
    pub kernel: String,
    /// "none" or "exponential, gamma = 2e-5 E*L, rho = 2.07e-5 L".
    pub adhesion: String,
    /// "hard wall" or the soft wall's name.
    pub wall: String,
    pub nx: usize,
    pub ny: usize,
    /// Range of the adhesion that the scene asks for and the one that the grid was given, units of L, and how well the grid
    /// resolves each (ρ/√(γ dx/E*) for the exponential law); none without adhesion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<RangeResults>,
    /// rms gradient that the grid resolves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resolved_gradient: Option<f64>,
    pub states: Vec<StateResults>,
    /// What a loop of loads, there and back, takes per area: -∮ p dū, units of E* L.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hysteresis_work: Option<f64>,
    /// Loads p* on the way there between which the gap stops to lead around the cell along x and along y: the percolation load
    /// lies between them. None where the path does not hold it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub percolation: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pull_off: Option<PullOff>,
    /// Why there is none, where one was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pull_off_failure: Option<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RangeResults {
    /// Work of adhesion, units of E*·L; none in files that tell it only in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gamma: Option<f64>,
    pub requested: f64,
    pub used: f64,
    pub resolution_requested: f64,
    pub resolution_used: f64,
}

/// How much the answer changes from the grid of half the points a side to this one, over the value on this one. What
/// converges at first order has as much of an error left, what converges faster has less.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Discretisation {
    /// Of the perimeter-corrected contact fraction; no less than a third of the correction. None where so little touches
    /// that its share of a change says nothing.
    pub area: Option<f64>,
    /// Whether the area's is only a bound: the coarser grid was left while it was still to change by more than the grids
    /// differ.
    pub area_is_bound: bool,
    /// None where the mean gap was imposed, or is next to nothing.
    pub mean_gap: Option<f64>,
    pub mean_gap_is_bound: bool,
    /// Points of the coarser grid along x and y.
    pub coarser: [usize; 2],
}

/// A number with its error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    pub value: f64,
    pub error: f64,
}

/// What the true range of the adhesion would give, from grids that are each given the shortest they resolve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Extrapolated {
    /// The true range over the one that this grid was given.
    pub range: f64,
    /// Contact fraction, perimeter-corrected.
    pub area: Estimate,
    /// Units of L; none where it was imposed.
    pub mean_gap: Option<Estimate>,
}

/// The largest pull that the contact holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PullOff {
    /// Lowest mean pressure of an equilibrium on the way apart, over E*: negative.
    pub pressure: f64,
    /// There, units of L.
    pub mean_gap: f64,
    /// Change of the pressure from the grid of half the points a side, or within the last bracket if that is more; none in
    /// files that do not tell it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressure_error: Option<f64>,
    /// The same of the mean gap.
    pub mean_gap_error: f64,
    /// Points of the coarser grid along x and y; none where only the bracket is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coarser: Option<[usize; 2]>,
    /// Mean gap and pressure of what was passed, in the order of the mean gap.
    pub curve: Vec<[f64; 2]>,
}

/// One equilibrium.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct StateResults {
    /// Of its load step, from 0.
    pub index: usize,
    pub branch: Branch,
    pub p_star: f64,
    /// Mean pressure over E*.
    pub pressure: f64,
    pub criterion: String,
    pub contact_fraction: f64,
    pub contact_fraction_corrected: f64,
    pub mean_gap: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub patches: Option<usize>,
    pub energy: f64,
    /// Part of the energy that is the interaction's; 0 without one.
    pub interaction_energy: f64,
    pub load_error: f64,
    pub residual: f64,
    pub complementarity: f64,
    /// "converged", or why not.
    pub stop: String,
    pub iterations: usize,
    pub fft_pairs: f64,
    pub seconds: f64,
    /// Relative energy above the minimum, and changes of area and mean gap still to come, as the method estimates them; none
    /// where it cannot.
    pub energy_error_estimate: Option<f64>,
    pub area_error_estimate: Option<f64>,
    pub mean_gap_error_estimate: Option<f64>,
    /// What the grid leaves uncertain: the change from the grid of half the points a side.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub discretisation: Option<Discretisation>,
    /// What the true range of the adhesion would give.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub extrapolated: Option<Extrapolated>,
    /// What area and mean gap are uncertain by, part by part.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub uncertainty: Vec<UncertaintyComponent>,
    /// Contact stiffness dp/dū, E*/L, from the neighbouring loads of the same branch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<f64>,
    /// Relative changes of contact fraction and mean gap from the same load on the way there, for loads on the way back.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hysteresis: Option<Hysteresis>,
    /// Distributions, patches and what follows from them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub observed: Option<Observed>,
    /// `[ny, nx]` files, if stored.
    pub gap: Option<String>,
    pub stress: Option<String>,
}

impl AtLoad for StateResults {
    fn index(&self) -> usize {
        self.index
    }
}

/// How far a state on the way back is from that of the same load on the way there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Hysteresis {
    pub area: f64,
    pub mean_gap: f64,
}

impl Hysteresis {
    /// What solvers leave of an area is below this.
    const NOTHING: f64 = 1e-3;

    /// Whether the two states are different ones: this hangs on the branch that it came by.
    pub fn is_significant(&self) -> bool {
        self.area.abs() > Self::NOTHING
    }
}

/// Contact counted where the stress is compressive, as methods that smear the wall or the adhesion have it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Compressive {
    pub fraction: f64,
    pub patches: usize,
    /// Half of it lies in patches up to this area; none without contact.
    pub median_cluster_area: Option<f64>,
}

/// What a state says beyond its sums. Lengths in L, areas in L², stresses in E*.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Observed {
    /// Mean pressure over the contact fraction, as counted; none without contact.
    pub mean_contact_pressure: Option<f64>,
    /// Pr(u) in bins of equal width, and of equal ratio; contact is the delta.
    pub gap: Distribution,
    pub gap_logarithmic: Distribution,
    /// Pr(σ), compression positive; without adhesion all nodes out of contact are the delta. And the contact's share of it.
    pub stress: Distribution,
    pub contact_stress: Distribution,
    /// Pr(a): area of a patch, density, number in the bin.
    pub patch_density: Vec<[f64; 3]>,
    /// CPr(a): area of a patch, share of the contact in patches up to it.
    pub patch_area: Vec<[f64; 2]>,
    /// Where that share is one half.
    pub median_cluster_area: Option<f64>,
    /// With adhesion, where parts of the contact are under tension; without, contact and compression are one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compressive: Option<Compressive>,
    /// Electrical conductance times resistivity, units of L: patches as circular spots side by side.
    pub constriction_conductance: f64,
    /// Even gap that leaks as much, in Bruggeman's effective medium.
    pub hydraulic_gap: f64,
    /// Whether contact (by edges and corners) and gap (by edges) lead around the cell, along x and y.
    pub contact_percolates: [bool; 2],
    pub gap_percolates: [bool; 2],
}

impl Observed {
    /// How many patches there are.
    pub fn patches(&self) -> usize {
        self.patch_density.iter().map(|[.., n]| *n as usize).sum()
    }
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct AtomsResults {
    pub potential: String,
    /// The LAMMPS version line.
    pub engine: String,
    pub cells: usize,
    pub depth_cells: usize,
    /// Of the elastic foundation below; 0 for a rigid base.
    #[serde(default, skip_serializing_if = "crate::record::is_default")]
    pub foundation_cells: usize,
    pub a0_angstrom: f64,
    pub length_angstrom: f64,
    /// Contact modulus E* of the block, for stresses in GPa; files without it show them in units of E*.
    pub modulus_gpa: Option<f64>,
    pub deformable: usize,
    pub fixed: usize,
    pub indenter: usize,
    pub audit: Vec<AuditLine>,
    /// Whether each load began from the load before, moved by what lies between the continuum's solutions, and not from a step of the
    /// indenter.
    #[serde(default, skip_serializing_if = "crate::record::is_default")]
    pub from_continuum: bool,
    pub load_steps: Vec<LoadStepResults>,
    pub states: Vec<AtomState>,
    /// Only where the loads come back or the bodies are pulled apart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unloading: Option<Unloading>,
    /// Only where the scene asks for a hold at a temperature.
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
    /// Sentences that say why they differ, each with its numbers.
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
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compliant_wall_gap: Option<String>,
    /// The same quantities of each version of the problem, from the full heights to the atoms.
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
    /// How far atoms on the continuum's surface were raised before they were asked what touches, Å.
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

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct StageCost {
    pub name: String,
    pub key: String,
    /// All that was spent on it, earlier attempts included.
    pub seconds: f64,
    /// What attempts that were stopped had spent on what the last one went on from.
    pub earlier_seconds: f64,
    pub peak_rss_bytes: u64,
    /// Nodes that went through a transform, forward or inverse.
    pub transformed_nodes: u64,
    /// Taken from an earlier run with the same key.
    pub reused: bool,
}
