//! `results.json`: all results of a run in one structure.
//!
//! Report, comparison tables and figures are generated from this file and the field files that it names, so a report
//! can be regenerated without solving anything. Paths are relative to the run folder. States are in SI units; `p_star` is the mean
//! pressure over E* times the rms gradient of the full spectrum.

pub use super::comparison::{
    ComparisonResults, CriterionArea, CriterionMatch, GapSection, LoadComparison, ModelChainStep, Overlap,
};
pub use super::surface::{
    CURVATURE_RADIUS, FIRST_TOUCH, HEIGHT_RANGE, PsdPoint, RMS_HEIGHT, SurfaceResults, SurfaceStatistic,
};

use super::acceptance::AcceptanceCheck;
use super::given_loads::GivenLoads;
use super::methods::MethodResults;
use asperity_atoms::results::AtomsResults;
use asperity_contact::problem::AccuracyResults;
use asperity_contact::results::ContinuumResults;
use asperity_grid::error::{Error, Result};
use asperity_surface::files::json;
use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Schema version, increased when a field changes its name or meaning; other versions cannot be read.
pub const SCHEMA: u32 = 7;

/// Name of the file in a run folder.
pub const FILE: &str = "results.json";

/// Scene, versions, times and memory of the run.
pub const MANIFEST_FILE: &str = "manifest.json";
/// Name of the table of a trade-off, whose folder has no results.
pub(super) const TRADEOFF_FILE: &str = "tradeoff.json";

/// All results of a run.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct Results {
    /// Version of this file; readers accept their own only.
    pub schema: u32,
    /// Of the scene.
    pub name: String,
    /// Description in the scene, printed at the top of the report.
    pub description: String,
    /// What makes the problem dimensionless.
    pub scales: ScalesSi,
    /// How loads are named.
    pub loads: GivenLoads,
    /// Its statistics and spectrum.
    pub surface: SurfaceResults,
    /// The laboratory-scale problem of the scene.
    pub continuum: Option<ContinuumResults>,
    /// The grids that were solved where the scene asks for an accuracy; the last one has the results.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<AccuracyResults>,
    /// The same loads without adhesion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub non_adhesive: Option<ContinuumResults>,
    /// The same loads with other ranges of the adhesion.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub other_ranges: Vec<ContinuumResults>,
    /// The reference load without adhesion, solved by a second method.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cross_check: Option<ContinuumResults>,
    /// Other methods at the same loads.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub methods: Vec<MethodResults>,
    /// Auxiliary problems without a solution, with reasons.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub failures: Vec<String>,
    /// Statements of the challenge compared with the results.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub acceptance: Vec<AcceptanceCheck>,
    /// What LAMMPS computed.
    pub atoms: Option<AtomsResults>,
    /// Atoms and continuum on the same profile.
    pub comparison: Option<ComparisonResults>,
    /// Times and memory.
    pub stages: Vec<StageCost>,
    /// Warnings: unresolved wavelengths, enlarged ranges, yield.
    pub warnings: Vec<String>,
    /// Papers and data used, printed at the end of the report.
    pub sources: Vec<String>,
}

impl Results {
    /// JSON Schema of `results.json` as it is written.
    pub fn schema() -> serde_json::Value {
        let settings = SchemaSettings::draft2020_12().for_serialize();
        let mut schema = settings.into_generator().into_root_schema_for::<Results>().to_value();
        plain_descriptions(&mut schema);
        schema
    }

    /// Reads `results.json` of a run folder.
    ///
    /// # Errors
    /// A folder without results; results of another schema.
    pub fn read(run_folder: &Path) -> Result<Self> {
        let path = run_folder.join(FILE);
        if !path.exists() {
            return Err(no_run(run_folder));
        }
        json::read_schema(&path, SCHEMA)
    }

    /// Writes `results.json` into a run folder. NaN and infinity are an error, because JSON has neither.
    pub fn write(&self, run_folder: &Path) -> Result<()> {
        let path = run_folder.join(FILE);
        // They become `null`, which only optional fields accept.
        let readable = serde_json::to_string(self).and_then(|text| serde_json::from_str::<Results>(&text).map(|_| ()));
        readable.map_err(|e| Error::format(&path, format!("a value that is not finite ({e})"), "finite numbers"))?;
        json::write(&path, self)
    }
}

/// Descriptions without what serves readers of the source: examples, and links to other items.
fn plain_descriptions(node: &mut serde_json::Value) {
    if let Some(serde_json::Value::String(text)) = node.get_mut("description") {
        text.truncate(text.find("```").unwrap_or(text.len()));
        *text = text.trim_end().replace("[`", "`").replace("`]", "`").replace("Self::", "").replace("State::", "");
    }
    match node {
        serde_json::Value::Array(list) => list.iter_mut().for_each(plain_descriptions),
        serde_json::Value::Object(keys) => keys.values_mut().for_each(plain_descriptions),
        _ => {}
    }
}

/// Error for a folder without results; it names the command that wrote the folder, or the missing files.
fn no_run(folder: &Path) -> Error {
    let has = |file: &str| folder.join(file).exists();
    let missing: Vec<&str> = [FILE, MANIFEST_FILE].into_iter().filter(|f| !has(f)).collect();
    let verb = if missing.len() > 1 { "are" } else { "is" };
    let found = match std::fs::metadata(folder) {
        Err(_) => "not a run folder: there is no such folder".to_string(),
        Ok(m) if !m.is_dir() => "not a run folder but a file".to_string(),
        Ok(_) if has(super::ensemble::FILE) => "not a run folder but that of a sweep".to_string(),
        Ok(_) if has(TRADEOFF_FILE) => "not a run folder but that of `asperity tradeoff`".to_string(),
        // A stage of a run has no table of loads.
        Ok(_) if has(asperity_surface::files::hashed::DONE_FILE) && has(super::load_table::FILE) => {
            "not a run folder but that of `asperity solve`, which has no report".to_string()
        }
        Ok(_) => format!("not a run folder, or one whose run has not ended: {} {verb} missing", missing.join(" and ")),
    };
    Error::format(folder, found, "the folder of a run that `asperity run` has finished")
}

/// Length and stress that make the problem dimensionless.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, JsonSchema)]
pub struct ScalesSi {
    /// Extent of the cell in x.
    pub length_m: f64,
    /// Contact modulus E*.
    pub modulus_pa: f64,
}

/// Time and memory of a stage.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct StageCost {
    /// Its folder.
    pub name: String,
    /// Hash of all that determines it.
    pub key: String,
    /// Computing time including earlier attempts.
    pub seconds: f64,
    /// Computing time of the interrupted attempts that the last one continued.
    pub earlier_seconds: f64,
    /// Largest resident memory, of the process or of one that it started.
    pub peak_rss_bytes: u64,
    /// Number of transformed nodes, forward and inverse.
    pub transformed_nodes: u64,
    /// Whether the results of an earlier run with the same key were used.
    pub reused: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A key that nobody explains is one that everybody looks up in the source.
    #[test]
    fn every_key_has_a_description() {
        let schema = Results::schema();
        let types = schema["$defs"].as_object().expect("definitions").iter().map(|(name, node)| (name.as_str(), node));
        for (name, node) in types.chain([("Results", &schema)]) {
            for (key, value) in node["properties"].as_object().into_iter().flatten() {
                assert!(value["description"].as_str().is_some_and(|text| !text.is_empty()), "{name}.{key}");
            }
        }
    }
}
