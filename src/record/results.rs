//! `results.json`: everything a run found, in one plain structure.
//!
//! The report, the comparison tables and every figure are drawn from this file and the field files it names, so that a
//! number in a report is never typed and a report can be drawn again without running anything. Paths are relative to
//! the run folder. Lengths are reduced (unit: the cell's extent in x) unless the name carries a unit; `p_star` is the
//! mean pressure over E* times the full spectrum's rms gradient.

pub use super::atomistic::{
    AtomPullOff, AtomState, AtomStress, AtomsResults, AuditLine, BranchChange, ContactByCriterion, DefectAtoms,
    LoadStepResults, NvtResults, NvtState, PlasticityResults, Unloading,
};
pub use super::comparison::{
    ComparisonResults, CriterionArea, CriterionMatch, LoadComparison, ModelChainStep, Overlap, Section,
};
pub use super::continuum::{
    Compressive, ContinuumResults, Discretisation, Extrapolated, Hysteresis, Observed, PullOff, RangeResults,
    StateResults,
};
pub use super::state_numbers::StateNumbers;
pub use super::surface::{
    CURVATURE_RADIUS, FIRST_TOUCH, HEIGHT_RANGE, PsdPoint, RMS_HEIGHT, Statistic, SurfaceResults,
};
pub use super::uncertainty::ValueWithError;

use super::acceptance::AcceptanceCheck;
use super::advice::AccuracyChoice;
use super::json;
use super::methods::MethodResults;
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Raised when a field changes its name or meaning; a reader accepts no other.
pub const SCHEMA: u32 = 2;

/// Name of the file in a run folder.
pub const FILE: &str = "results.json";

/// Scene, versions, times and memory of the run.
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
    /// Other methods at the same loads.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub methods: Vec<MethodResults>,
    /// Auxiliary problems that could not be solved, and why.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub failures: Vec<String>,
    /// Statements of the challenge compared with the results.
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

    /// Writes `results.json` into a run folder. NaN and infinity, which JSON does not have, are refused.
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
