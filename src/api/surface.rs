//! Rough surfaces from arrays, spectra and files.

use super::arrays::{Cell, map};
use crate::grid::{Grid, Series};
use crate::method::{Heights, Problem};
use crate::record::heights::{HeightMap, Sign};
use crate::scene::{self, Laboratory, SurfaceScene, Touching, Units, slope_warning};
use crate::surface::{Modes, Spectrum, quality_warnings};
use crate::{Error, Result};
use ndarray::{Array2, ArrayView2};
use std::path::Path;

/// A rough surface on a periodic cell: a height map, or the waves of a spectrum on a grid.
#[derive(Debug, Clone)]
pub struct Surface {
    source: scene::Surface,
    /// In reduced units: the cell has the extent 1 along x.
    grid: Grid,
    length: f64,
}

/// How a spectrum becomes a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SynthesisOptions {
    /// Nodes along x and along y.
    pub nodes: usize,
    /// Extent of the cell, in any unit: results have the same.
    pub length: f64,
    /// Seed of the phases; one seed gives the same waves on every grid.
    pub seed: u64,
}

/// What a file of heights does not contain.
#[derive(Debug, Clone, PartialEq)]
pub struct FileOptions {
    /// Extent of the map along x, in any unit: results have the same.
    pub length: f64,
    /// One unit of the stored heights in the unit of `length`: 0.001 for heights in nm and a length in µm.
    pub height_unit: f64,
    /// Which points touch the other body first.
    pub touching: Touching,
    /// Name of the array, in a file with several.
    pub dataset: Option<String>,
}

impl Surface {
    /// A surface of `heights` `[ny, nx]`, x fastest, in the unit of `length`, the extent along x. Pixels are square;
    /// [`Surface::with_length_y`] changes that.
    ///
    /// # Errors
    /// If a height is not finite, the array is empty, or `length` is not positive.
    ///
    /// ```
    /// use asperity::{Surface, Touching};
    /// use ndarray::array;
    ///
    /// let heights = array![[3.0, 1.0], [2.0, 2.0]];
    /// let surface = Surface::from_array(heights.view(), 10.0, Touching::HighPoints)?;
    /// // Inside the crate low points touch first, and the lowest is at 0.
    /// assert_eq!(surface.heights(), array![[0.0, 2.0], [1.0, 1.0]]);
    /// # Ok::<(), asperity::Error>(())
    /// ```
    pub fn from_array(heights: ArrayView2<f64>, length: f64, touching: Touching) -> Result<Self> {
        positive("length", length)?;
        let (ny, nx) = heights.dim();
        let mut map = HeightMap::new("heights", nx, ny, heights.iter().copied().collect())?.low_first(sign(touching));
        let unit = 1.0 / length;
        map.heights.iter_mut().for_each(|h| *h *= unit);
        let (grid, origin) = (Grid::unit(nx, ny), "array".into());
        Ok(Self::of(scene::Surface::Imported { grid, heights: map.heights, origin }, grid, length))
    }

    /// A realisation of a self-affine spectrum. The seed determines the phases of the waves, whatever the grid.
    ///
    /// # Errors
    /// If `nodes` is zero or `length` is not positive.
    ///
    /// ```
    /// use asperity::{Spectrum, Surface, SynthesisOptions};
    ///
    /// let spectrum = Spectrum { rms_gradient: 0.1, lambda_s: 1.0 / 16.0, ..Spectrum::CHALLENGE };
    /// let surface = Surface::from_spectrum(spectrum, SynthesisOptions { nodes: 64, length: 1e-4, seed: 1 })?;
    /// assert!((surface.rms_gradient() - 0.1).abs() < 1e-12);
    /// # Ok::<(), asperity::Error>(())
    /// ```
    pub fn from_spectrum(spectrum: Spectrum, options: SynthesisOptions) -> Result<Self> {
        let SynthesisOptions { nodes, length, seed } = options;
        positive("length", length)?;
        if nodes == 0 {
            return Err(Error::input(PLACE, "nodes", 0, "at least 1"));
        }
        let modes = Modes::new(spectrum, seed, 1.0);
        Ok(Self::of(scene::Surface::Synthesised { modes, spectrum, seed }, Grid::unit(nodes, nodes), length))
    }

    /// Reads a height map: `.npy`, `.npz`, HDF5, NetCDF, an ASCII matrix with one row per line, or lines of x y h.
    ///
    /// # Errors
    /// Those of reading the file, with the place in it; a sign in the file other than `touching`; Fourier coefficients, for which
    /// there is `asperity surface`.
    pub fn from_file(path: impl AsRef<Path>, options: &FileOptions) -> Result<Self> {
        let path = path.as_ref();
        positive("length", options.length)?;
        positive("height_unit", options.height_unit)?;
        let table = SurfaceScene {
            heights: Some(path.to_path_buf()),
            heights_unit_um: options.height_unit,
            dataset: options.dataset.clone(),
            touching: Some(options.touching),
            ..SurfaceScene::default()
        };
        let laboratory = Laboratory { length_um: options.length, units: Units::Consistent, ..Laboratory::default() };
        let source = scene::Surface::resolve(&table, &laboratory, Path::new(PLACE))?;
        match source {
            scene::Surface::Imported { grid, .. } => Ok(Self::of(source, grid, options.length)),
            _ => {
                Err(Error::format(path, "Fourier coefficients", "a height map (`asperity surface` makes one of them)"))
            }
        }
    }

    /// The same surface with this extent along y.
    ///
    /// # Errors
    /// If it is not positive, or the surface is made from a spectrum, whose cell is square.
    pub fn with_length_y(mut self, length_y: f64) -> Result<Self> {
        positive("length_y", length_y)?;
        if !matches!(self.source, scene::Surface::Imported { .. }) {
            return Err(Error::input(PLACE, "length_y", length_y, "none: the cell of a spectrum is square"));
        }
        self.grid.ly = length_y / self.length;
        Ok(self)
    }

    fn of(source: scene::Surface, grid: Grid, length: f64) -> Self {
        Surface { source, grid, length }
    }

    /// Extent of the cell.
    pub fn cell(&self) -> Cell {
        Cell { x: self.length, y: self.grid.ly * self.length }
    }

    /// Shape of its maps, `(ny, nx)`.
    pub fn shape(&self) -> (usize, usize) {
        (self.grid.ny, self.grid.nx)
    }

    /// Heights `[ny, nx]` in the unit of the length: low points touch first, the lowest is at 0.
    pub fn heights(&self) -> Array2<f64> {
        let heights = self.source.heights(Grid::unit(self.grid.nx, self.grid.ny), 0.0);
        map(self.grid, heights).mapv_into(|h| h * self.length)
    }

    /// Root mean square of the gradient of all waves that the grid resolves.
    pub fn rms_gradient(&self) -> f64 {
        self.with_heights(false, |heights| Problem::new(self.grid, heights).resolved_gradient())
    }

    /// Root mean square of the heights about their mean.
    pub fn rms_height(&self) -> f64 {
        self.with_heights(false, |heights| heights.rms()) * self.length
    }

    /// What limits the results on this surface: unresolved waves, steep slopes, quantised heights.
    pub fn warnings(&self) -> Vec<String> {
        let mut list = match &self.source {
            scene::Surface::Synthesised { modes, .. } => modes.left_out_by(self.grid).into_iter().collect(),
            scene::Surface::Imported { heights, .. } => quality_warnings(self.grid, heights),
            scene::Surface::Fourier { .. } => Vec::new(),
        };
        list.extend(slope_warning(self.rms_gradient()));
        list
    }

    pub(super) fn grid(&self) -> Grid {
        self.grid
    }

    pub(super) fn length(&self) -> f64 {
        self.length
    }

    /// Lends the heights: as waves where the surface has them or `as_waves` requires them, else on the nodes.
    pub(super) fn with_heights<R>(&self, as_waves: bool, then: impl FnOnce(Heights) -> R) -> R {
        match &self.source {
            scene::Surface::Synthesised { modes, .. } => then(Heights::Series(&modes.series())),
            scene::Surface::Fourier { modes, .. } => then(Heights::Series(modes.series())),
            scene::Surface::Imported { heights, .. } if as_waves => {
                then(Heights::Series(&Series::from_nodes(self.grid, heights)))
            }
            scene::Surface::Imported { heights, .. } => then(Heights::Nodes(heights)),
        }
    }
}

/// Named in errors.
const PLACE: &str = "surface";

fn positive(key: &str, value: f64) -> Result<()> {
    match value.is_finite() && value > 0.0 {
        true => Ok(()),
        false => Err(Error::input(PLACE, key, value, "a positive number")),
    }
}

fn sign(touching: Touching) -> Sign {
    match touching {
        Touching::LowPoints => Sign::LowFirst,
        Touching::HighPoints => Sign::HighFirst,
    }
}
