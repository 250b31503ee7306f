//! Rough surfaces from arrays, spectra and files.

use super::arrays::{Cell, map};
use crate::scene::{
    self, LaboratoryScene, Length, ResolvedSurface, Scene, Stress, SurfaceFile, SurfaceScene, Touching,
};
use crate::{Error, Result};
use asperity_contact::method::{Heights, ReducedProblem};
use asperity_grid::{Grid, Series};
use asperity_surface::heights::{HeightMap, TouchingPoints};
use asperity_surface::import::Content;
use asperity_surface::provenance::Provenance;
use asperity_surface::{Modes, Preparation, PreparedMap, Spectrum, quality_warnings, slope_warnings};
use ndarray::{Array2, ArrayView2};
use std::path::Path;
use std::sync::Arc;

/// A rough surface on a periodic cell: a height map, or the waves of a spectrum on a grid.
#[derive(Debug, Clone)]
pub struct Surface {
    source: scene::HeightSource,
    /// In reduced units: the cell has the extent 1 along x.
    grid: Grid,
    length: f64,
    periodic: bool,
    provenance: Option<Provenance>,
    /// Steps of preparation of a map from an array.
    steps: Vec<String>,
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

/// What a file of heights does not declare, and the preparation of its map. Lengths are in the unit of the heights.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FileOptions {
    /// Extent of the map along x. `None`: what the file declares.
    pub length: Option<f64>,
    /// Which points touch the other body first. `None`: what the file declares.
    pub touching: Option<Touching>,
    /// Name of the array or channel, in a file with several.
    pub dataset: Option<String>,
    /// Steps that the map goes through before it is solved.
    pub preparation: Preparation,
}

/// Extent, sign and preparation of a map of heights. Lengths are in the unit of the heights.
#[derive(Debug, Clone, PartialEq)]
pub struct MapOptions {
    /// Extent along x.
    pub length: f64,
    /// Extent along y. `None`: square pixels.
    pub length_y: Option<f64>,
    /// Which points touch the other body first.
    pub touching: Touching,
    /// Whether the map repeats: filters, resampling and fill then continue across its edges.
    pub periodic: bool,
    /// Steps that the map goes through before it is solved.
    pub preparation: Preparation,
}

impl MapOptions {
    /// A map that repeats, with square pixels and without preparation.
    pub fn new(length: f64, touching: Touching) -> Self {
        MapOptions { length, length_y: None, touching, periodic: true, preparation: Preparation::default() }
    }
}

impl Surface {
    /// A surface of `heights` `[ny, nx]`, x fastest, in the unit of `length`, the extent along x. Pixels are square;
    /// [`Surface::from_map`] takes others.
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
        Self::from_map(heights, &MapOptions::new(length, touching))
    }

    /// A surface of a measured map `[ny, nx]`, x fastest, with the steps of its preparation. Points that were not measured are NaN;
    /// [`Preparation::fill`] replaces them.
    ///
    /// # Errors
    /// As [`Surface::from_array`], and those of the preparation.
    ///
    /// ```
    /// use asperity::{Detrend, MapOptions, Preparation, Surface, Touching};
    /// use ndarray::Array2;
    ///
    /// let tilted = Array2::from_shape_fn((8, 8), |(y, x)| 0.5 * x as f64 + if (x, y) == (3, 4) { 0.1 } else { 0.0 });
    /// let preparation = Preparation { detrend: Some(Detrend::Plane), ..Preparation::default() };
    /// let options = MapOptions { preparation, ..MapOptions::new(8.0, Touching::HighPoints) };
    /// let surface = Surface::from_map(tilted.view(), &options)?;
    /// assert!(surface.rms_height() < 0.1 && surface.preparation_steps()[0].starts_with("detrend plane"));
    /// # Ok::<(), asperity::Error>(())
    /// ```
    pub fn from_map(heights: ArrayView2<f64>, options: &MapOptions) -> Result<Self> {
        let MapOptions { length, length_y, touching, periodic, ref preparation } = *options;
        positive("length", length)?;
        length_y.iter().try_for_each(|l| positive("length_y", *l))?;
        let (ny, nx) = heights.dim();
        let map = HeightMap::with_missing("heights", nx, ny, heights.iter().copied().collect())?;
        let extent = [length, length_y.unwrap_or(length * ny as f64 / nx as f64)];
        let PreparedMap { map, extent, history, .. } = preparation.apply(map, extent, periodic)?;
        let mut map = map.low_first(sign(touching));
        let unit = 1.0 / extent[0];
        map.heights.iter_mut().for_each(|h| *h *= unit);
        let grid = Grid { ly: extent[1] / extent[0], ..Grid::unit(map.nx, map.ny) };
        let source = scene::HeightSource::Imported { grid, heights: Arc::new(map.heights), origin: "array".into() };
        let periodic = periodic || preparation.edges.is_some();
        Ok(Surface { periodic, steps: history, ..Self::of(source, grid, extent[0]) })
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
        Ok(Self::of(scene::HeightSource::Synthesised { modes, spectrum, seed }, Grid::unit(nodes, nodes), length))
    }

    /// Reads a height map: text, `.npy`, `.npz`, HDF5, NetCDF, `.x3p`, `.sdf`, `.sur` or `.gwy`.
    ///
    /// # Errors
    /// Those of reading the file, with the place in it; a length or sign that neither file nor options have, or that differ between
    /// them; those of the preparation; Fourier coefficients, for which there is `asperity surface`.
    pub fn from_file(path: impl AsRef<Path>, options: &FileOptions) -> Result<Self> {
        let path = path.as_ref();
        let table = SurfaceScene {
            heights: Some(path.to_path_buf()),
            dataset: options.dataset.clone(),
            touching: options.touching,
            fill: options.preparation.fill,
            crop: options.preparation.crop,
            remove_outliers: options.preparation.remove_outliers,
            detrend: options.preparation.detrend,
            low_pass: options.preparation.low_pass.map(Length::plain),
            high_pass: options.preparation.high_pass.map(Length::plain),
            filter: Some(options.preparation.filter),
            resample: options.preparation.resample,
            edges: options.preparation.edges,
            ..SurfaceScene::default()
        };
        let mut scene = Scene::new("surface", table);
        // A plain modulus: lengths are in the unit of the heights.
        let (length, modulus) = (options.length.map(Length::plain), Some(Stress::plain(1.0)));
        scene.laboratory = LaboratoryScene { length, modulus, ..LaboratoryScene::default() };
        options.length.iter().try_for_each(|l| positive("length", *l))?;
        let Some(mut file) = SurfaceFile::read(&scene.surface, Path::new(""))? else { unreachable!("it has a file") };
        if !matches!(file.found.content, Content::Map(_)) {
            let accepted = "a height map (`asperity surface` makes one of them)";
            return Err(Error::format(path, "Fourier coefficients", accepted));
        }
        let mut list = file.complete(&mut scene);
        // Options have the last words of the scene's keys.
        for complaint in &mut list {
            complaint.key = scene::last_part(&complaint.key).into();
        }
        if !list.is_empty() {
            return Err(Error::Input { place: PLACE.into(), list });
        }
        let resolved = scene::HeightSource::resolve(&scene, Some(file), PLACE)?;
        let scene::HeightSource::Imported { grid, .. } = resolved.surface else { unreachable!("a map") };
        let length = resolved.laboratory.length().value();
        let periodic = resolved.provenance.as_ref().is_none_or(|p| p.periodic);
        Ok(Surface { periodic, provenance: resolved.provenance, ..Self::of(resolved.surface, grid, length) })
    }

    fn of(source: scene::HeightSource, grid: Grid, length: f64) -> Self {
        Surface { source, grid, length, periodic: true, provenance: None, steps: Vec::new() }
    }

    /// File, declared properties and preparation of a surface from a file.
    pub fn provenance(&self) -> Option<&Provenance> {
        self.provenance.as_ref()
    }

    /// Whether the map repeats, or was made to by its preparation. A map that does not is solved as periodic, with a warning, unless
    /// the body is [`Body::NonPeriodic`](crate::Body::NonPeriodic).
    pub fn is_periodic(&self) -> bool {
        self.periodic
    }

    /// Steps of preparation that were applied to the map, with their parameters.
    pub fn preparation_steps(&self) -> &[String] {
        self.provenance.as_ref().map_or(&self.steps, |p| &p.preparation)
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
        self.with_heights(false, |heights| ReducedProblem::new(self.grid, heights).resolved_gradient())
    }

    /// Root mean square of the heights about their mean.
    pub fn rms_height(&self) -> f64 {
        self.with_heights(false, |heights| heights.rms()) * self.length
    }

    /// What limits the results on this surface: unresolved waves, steep slopes, quantised heights.
    pub fn warnings(&self) -> Vec<String> {
        let mut list = match &self.source {
            scene::HeightSource::Synthesised { modes, .. } => modes.left_out_by(self.grid).into_iter().collect(),
            scene::HeightSource::Imported { heights, .. } => quality_warnings(self.grid, heights),
            scene::HeightSource::Fourier { .. } => Vec::new(),
        };
        list.extend(slope_warnings(self.rms_gradient()));
        list
    }

    pub(super) fn length(&self) -> f64 {
        self.length
    }

    /// The surface as a scene describes it: its table `[surface]`, and the heights with the extents of the cell, in the
    /// unit of length of this surface.
    pub(super) fn scene_parts(&self) -> (SurfaceScene, ResolvedSurface) {
        let laboratory = LaboratoryScene {
            length: Some(Length::plain(self.length)),
            length_y: Some(Length::plain(self.grid.ly * self.length)),
            ..LaboratoryScene::default()
        };
        let table = SurfaceScene { grid: self.grid.nx, ..SurfaceScene::default() };
        let surface = match &self.source {
            scene::HeightSource::Imported { heights, origin, .. } => {
                scene::HeightSource::Imported { grid: self.grid, heights: heights.clone(), origin: origin.clone() }
            }
            other => other.clone(),
        };
        let provenance = self.provenance.clone();
        (table, ResolvedSurface { surface, laboratory, provenance, warnings: Vec::new() })
    }

    /// Lends the heights: as waves where the surface has them or `as_waves` requires them, else on the nodes.
    pub(super) fn with_heights<R>(&self, as_waves: bool, then: impl FnOnce(Heights) -> R) -> R {
        match &self.source {
            scene::HeightSource::Synthesised { modes, .. } => then(Heights::Series(&modes.series())),
            scene::HeightSource::Fourier { modes, .. } => then(Heights::Series(modes.series())),
            scene::HeightSource::Imported { heights, .. } if as_waves => {
                then(Heights::Series(&Series::from_nodes(self.grid, heights)))
            }
            scene::HeightSource::Imported { heights, .. } => then(Heights::Nodes(heights)),
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

fn sign(touching: Touching) -> TouchingPoints {
    match touching {
        Touching::LowPoints => TouchingPoints::LowFirst,
        Touching::HighPoints => TouchingPoints::HighFirst,
    }
}
