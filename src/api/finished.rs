//! Results of a finished run.

use crate::record::results;
use crate::record::written::WrittenFolder;
use crate::{Error, Result};
use asperity_contact::state::State;
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
    /// One for each load, in their order, with the names of their stored maps.
    pub states: Vec<State>,
    /// Warnings of the run.
    pub warnings: Vec<String>,
    folder: WrittenFolder,
    heights: Option<String>,
}

impl FinishedRun {
    /// Reads `results.json` of a run folder; maps are read, and compared with the hashes that the run wrote, when they are requested.
    ///
    /// # Errors
    /// If the folder has no results, those of another schema, or a file that is not as the run wrote it.
    pub fn read(folder: impl AsRef<Path>) -> Result<Self> {
        let (folder, results) = WrittenFolder::run(folder.as_ref())?;
        Ok(FinishedRun {
            name: results.name,
            description: results.description,
            method: results.continuum.as_ref().map_or(String::new(), |c| c.method.clone()),
            length_m: results.scales.length_m,
            modulus_pa: results.scales.modulus_pa,
            states: results.continuum.map_or(Vec::new(), |c| c.states),
            warnings: results.warnings,
            folder,
            heights: results.surface.heights,
        })
    }

    /// Heights `[ny, nx]`, m, low points in contact first; none if the run stored no maps.
    ///
    /// # Errors
    /// Those of reading the file.
    pub fn heights(&self) -> Result<Option<Array2<f64>>> {
        self.map(self.heights.as_deref(), self.length_m)
    }

    /// Gap `[ny, nx]` of a state, m; none if the run did not store it.
    ///
    /// # Errors
    /// Those of reading the file.
    pub fn gap(&self, state: &State) -> Result<Option<Array2<f64>>> {
        self.map(state.gap_file(), self.length_m)
    }

    /// Interfacial stress `[ny, nx]` of a state, Pa, compression positive; none if the run did not store it.
    ///
    /// # Errors
    /// Those of reading the file.
    pub fn stress(&self, state: &State) -> Result<Option<Array2<f64>>> {
        self.map(state.stress_file(), self.modulus_pa)
    }

    /// All of `results.json`, as docs/result-files.md describes it.
    ///
    /// # Errors
    /// Those of reading the file.
    pub fn json(&self) -> Result<serde_json::Value> {
        asperity_surface::files::json::read(&self.file(results::FILE)?)
    }

    /// Path of a file of the run, such as `results.nc` or a frame of the atoms, relative to its folder.
    ///
    /// # Errors
    /// If it is not as the run wrote it.
    pub fn file(&self, name: &str) -> Result<PathBuf> {
        self.folder.file(name)
    }

    fn map(&self, file: Option<&str>, unit: f64) -> Result<Option<Array2<f64>>> {
        let Some(file) = file else { return Ok(None) };
        let path = self.file(file)?;
        let field = npy::read(&path)?;
        let values = field.values.into_iter().map(|v| v * unit).collect();
        let shaped = Array2::from_shape_vec((field.ny, field.nx), values);
        shaped.map(Some).map_err(|e| Error::format(&path, e, "a map [ny, nx]"))
    }
}
