//! The hardness of a scene: one value, or a map from a file.

use super::laboratory::LaboratoryScene;
use super::model::{ContinuumScene, relative_to};
use asperity_contact::interface::{HardnessMap, NodalHardness};
use asperity_contact::results::HardnessMapResults;
use asperity_grid::Grid;
use asperity_grid::error::{Complaint, Error, Result};
use asperity_surface::files::hashed::file_hash;
use asperity_surface::import::{self, Content, Fourier, ImportOptions};
use std::path::Path;
use std::sync::Arc;

/// Largest contact stress of a case, units of E*.
#[derive(Debug, Clone)]
pub enum CaseHardness {
    Uniform(f64),
    /// With what the results state about a map.
    Map(Arc<HardnessMap>, HardnessMapResults),
}

impl CaseHardness {
    /// The hardness of a scene. `file`: the scene file, to which a map's path is relative; `given`: the values `[ny, nx]` of a map
    /// that is in no file.
    ///
    /// # Errors
    /// Those of reading the map; a map on another grid; values that are not positive and finite.
    pub(super) fn resolve(
        c: &ContinuumScene,
        lab: &LaboratoryScene,
        grid: Grid,
        (file, given): (&Path, Option<Vec<f64>>),
    ) -> Result<Option<Self>> {
        let Some(map) = &c.hardness_map else {
            return Ok(c.hardness.map(|h| CaseHardness::Uniform(lab.reduced_stress(h))));
        };
        let (unit, modulus) = (c.hardness_map_unit.map_or(1.0, |unit| unit.to("MPa")), lab.modulus().to("MPa"));
        let path = relative_to(file, map);
        let reduced = |values: Vec<f64>| values.into_iter().map(|h| h * unit / modulus).collect::<Vec<f64>>();
        let (map, file, hash) = match given {
            Some(values) => {
                let map = HardnessMap::new(grid.nx, grid.ny, reduced(values));
                let refused = |complaint| Error::Input { place: file.display().to_string(), list: vec![complaint] };
                (map.map_err(refused)?, String::new(), String::new())
            }
            None => {
                let map = HardnessMap::new(grid.nx, grid.ny, reduced(values(&path, grid)?));
                let refused = |complaint: Complaint| Error::format(&path, complaint.found, complaint.accepted);
                (map.map_err(refused)?, path.display().to_string(), file_hash(&path)?)
            }
        };
        let (lowest, highest) = map.extent();
        Ok(Some(CaseHardness::Map(Arc::new(map), HardnessMapResults { file, hash, lowest, highest })))
    }

    pub fn lend(&self) -> NodalHardness<'_> {
        match self {
            CaseHardness::Uniform(value) => (*value).into(),
            CaseHardness::Map(map, _) => NodalHardness::from(&**map),
        }
    }

    /// What the results state about a map.
    pub fn about_map(&self) -> Option<&HardnessMapResults> {
        match self {
            CaseHardness::Uniform(_) => None,
            CaseHardness::Map(_, about) => Some(about),
        }
    }

    /// The smallest and the largest value.
    pub(super) fn extent(&self) -> [f64; 2] {
        match self {
            CaseHardness::Uniform(value) => [*value; 2],
            CaseHardness::Map(_, about) => [about.lowest, about.highest],
        }
    }
}

/// Values `[ny, nx]` of a file of a hardness on this grid.
fn values(path: &Path, grid: Grid) -> Result<Vec<f64>> {
    // Three or four columns are values, too.
    let options = ImportOptions { fourier: Some(Fourier::None), ..ImportOptions::default() };
    let found = match import::read(path, options) {
        Err(Error::Height { row, column, value, .. }) => {
            let found = format!("{value} in row {}, column {} (counted from 1)", row + 1, column + 1);
            Err(Error::format(path, found, "positive, finite values"))
        }
        found => found,
    }?;
    match found.content {
        Content::Map(map) if (map.nx, map.ny) == (grid.nx, grid.ny) => Ok(map.heights),
        Content::Map(map) => {
            let accepted = format!("{} x {}, the grid of the surface", grid.nx, grid.ny);
            Err(Error::format(path, format!("{} x {} values", map.nx, map.ny), accepted))
        }
        Content::Waves(_) => Err(Error::format(path, "Fourier coefficients", "values [ny, nx]")),
    }
}
