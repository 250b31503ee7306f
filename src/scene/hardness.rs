//! The map of the hardness of a scene, from its file.

use super::Stress;
use super::laboratory::LaboratoryScene;
use super::model::{ContinuumScene, relative_to};
use asperity_contact::interface::HardnessMap;
use asperity_grid::Grid;
use asperity_grid::error::{Complaint, Error, Result};
use asperity_surface::files::hashed::file_hash;
use asperity_surface::import::{self, Content, Fourier, ImportOptions};
use std::path::{Path, PathBuf};

/// A map with its file and the BLAKE3 hash of it.
pub(super) struct HardnessFile {
    pub map: HardnessMap,
    pub path: PathBuf,
    pub hash: String,
}

impl HardnessFile {
    /// The map that a scene names, if it does, in SI units. `file`: the scene file, to which its path is relative.
    ///
    /// # Errors
    /// Those of reading the map; a map on another grid; values that are not positive and finite.
    pub(super) fn read(c: &ContinuumScene, lab: &LaboratoryScene, grid: Grid, file: &Path) -> Result<Option<Self>> {
        let Some(map) = &c.hardness_map else { return Ok(None) };
        let usual = if lab.is_plain() { Stress::plain(1.0) } else { Stress::new(1.0, "MPa") };
        let unit = c.hardness_map_unit.unwrap_or(usual).si();
        let path = relative_to(file, map);
        let refused = |complaint: Complaint| Error::format(&path, complaint.found, complaint.accepted);
        // Checked as it is written.
        let written = HardnessMap::new(grid.nx, grid.ny, values(&path, grid)?).map_err(refused)?;
        let map = written.converted(|h| h * unit).map_err(refused)?;
        Ok(Some(HardnessFile { map, hash: file_hash(&path)?, path }))
    }
}

/// Values `[ny, nx]` of a file of a hardness on this grid.
fn values(path: &Path, grid: Grid) -> Result<Vec<f64>> {
    // Three or four columns are values, too.
    let options = ImportOptions { fourier: Some(Fourier::None), ..ImportOptions::default() };
    let imported = match import::read(path, options) {
        Err(Error::Height { row, column, value, .. }) => {
            let found = format!("{value} in row {}, column {} (counted from 1)", row + 1, column + 1);
            Err(Error::format(path, found, "positive, finite values"))
        }
        imported => imported,
    }?;
    match imported.content {
        Content::Map(map) if (map.nx, map.ny) == (grid.nx, grid.ny) => Ok(map.heights),
        Content::Map(map) => {
            let accepted = format!("{} x {}, the grid of the surface", grid.nx, grid.ny);
            Err(Error::format(path, format!("{} x {} values", map.nx, map.ny), accepted))
        }
        Content::Waves(_) => Err(Error::format(path, "Fourier coefficients", "values [ny, nx]")),
    }
}
