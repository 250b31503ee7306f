//! Results of a finished run.

use crate::record::results::Results;
use crate::{Error, Result};
use asperity_contact::load::Branch;
use asperity_contact::results::StateResults;
use asperity_surface::files::npy;
use ndarray::Array2;
use std::path::{Path, PathBuf};

/// The folder of a finished `asperity run`, in SI units.
///
/// The states are those of the scene's own continuum problem; [`FinishedRun::json`] has everything else.
#[derive(Debug, Clone)]
pub struct FinishedRun {
    /// Name of the scene.
    pub name: String,
    /// Description in the scene.
    pub description: String,
    /// Id of the method of the states; empty if the scene has no continuum problem.
    pub method: String,
    /// Extent of the cell along x, m.
    pub length_m: f64,
    /// Contact modulus E*, Pa.
    pub modulus_pa: f64,
    /// One for each load, in their order.
    pub states: Vec<FinishedState>,
    /// Warnings of the run.
    pub warnings: Vec<String>,
    folder: PathBuf,
    heights: Option<String>,
}

/// One equilibrium of a finished run.
#[derive(Debug, Clone, PartialEq)]
pub struct FinishedState {
    /// Branch of the load path.
    pub branch: Branch,
    /// Mean pressure over E* times the rms gradient.
    pub p_star: f64,
    /// Mean pressure, Pa.
    pub pressure_pa: f64,
    /// Contact area over the area of the cell: the best value.
    pub contact_area: f64,
    /// Its error, of the same unit; none where a part of it is not known.
    pub contact_area_error: Option<f64>,
    /// Contact nodes over all nodes.
    pub contact_nodes: f64,
    /// Mean gap, m.
    pub mean_gap_m: f64,
    /// Its error, m.
    pub mean_gap_error_m: Option<f64>,
    /// Contact stiffness, Pa/m.
    pub stiffness_pa_per_m: Option<f64>,
    /// Files of the maps in the run folder; `None` if they were not stored.
    gap_file: Option<String>,
    stress_file: Option<String>,
}

impl FinishedRun {
    /// Reads `results.json` of a run folder; maps are read when they are requested.
    ///
    /// # Errors
    /// If the folder has no results, or those of another schema.
    pub fn read(folder: impl AsRef<Path>) -> Result<Self> {
        let folder = folder.as_ref();
        let results = Results::read(folder)?;
        let (length, modulus) = (results.scales.length_m, results.scales.modulus_pa);
        let state = |s: &StateResults| FinishedState {
            branch: s.branch,
            p_star: s.numbers.p_star,
            pressure_pa: s.numbers.pressure * modulus,
            contact_area: s.numbers.contact_area,
            contact_area_error: s.numbers.contact_area_error,
            contact_nodes: s.contact_nodes,
            mean_gap_m: s.mean_gap * length,
            mean_gap_error_m: s.mean_gap_error.map(|e| e * length),
            stiffness_pa_per_m: s.numbers.stiffness.map(|k| k * modulus / length),
            gap_file: s.numbers.gap_map.clone(),
            stress_file: s.numbers.stress_map.clone(),
        };
        let continuum = results.continuum.as_ref();
        Ok(FinishedRun {
            name: results.name,
            description: results.description,
            method: continuum.map_or(String::new(), |c| c.method.clone()),
            length_m: length,
            modulus_pa: modulus,
            states: continuum.iter().flat_map(|c| &c.states).map(state).collect(),
            warnings: results.warnings,
            folder: folder.to_path_buf(),
            heights: results.surface.heights,
        })
    }

    /// Heights `[ny, nx]`, m, low points in contact first; none if the run stored no maps.
    ///
    /// # Errors
    /// Those of reading the file.
    pub fn heights(&self) -> Result<Option<Array2<f64>>> {
        self.map(self.heights.as_ref(), self.length_m)
    }

    /// Gap `[ny, nx]` of a state, m; none if the run did not store it.
    ///
    /// # Errors
    /// Those of reading the file.
    pub fn gap(&self, state: &FinishedState) -> Result<Option<Array2<f64>>> {
        self.map(state.gap_file.as_ref(), self.length_m)
    }

    /// Interfacial pressure `[ny, nx]` of a state, Pa, compression positive; none if the run did not store it.
    ///
    /// # Errors
    /// Those of reading the file.
    pub fn pressure(&self, state: &FinishedState) -> Result<Option<Array2<f64>>> {
        self.map(state.stress_file.as_ref(), self.modulus_pa)
    }

    /// All of `results.json`, as docs/formats.md describes it.
    ///
    /// # Errors
    /// Those of reading the file.
    pub fn json(&self) -> Result<serde_json::Value> {
        asperity_surface::files::json::read(&self.folder.join(crate::record::results::FILE))
    }

    fn map(&self, file: Option<&String>, unit: f64) -> Result<Option<Array2<f64>>> {
        let Some(file) = file else { return Ok(None) };
        let path = self.folder.join(file);
        let field = npy::read(&path)?;
        let values = field.values.into_iter().map(|v| v * unit).collect();
        let shaped = Array2::from_shape_vec((field.ny, field.nx), values);
        shaped.map(Some).map_err(|e| Error::format(&path, e, "a map [ny, nx]"))
    }
}
