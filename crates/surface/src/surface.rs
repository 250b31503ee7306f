//! Rough surfaces on a cell: from maps and spectra.

use crate::height_map::{HeightMap, Touching};
use crate::height_source::HeightSource;
use crate::preparation::copies;
use crate::provenance::Provenance;
use crate::{
    Facing, FourierModes, Modes, Placement, Preparation, PreparedMap, RoughBody, Spectrum, quality_warnings,
    slope_warnings,
};
use asperity_grid::{Error, Grid, Result, Series, rms};
#[cfg(feature = "files")]
use ndarray::{Array2, ArrayView2};
use std::sync::Arc;

/// Extent of the cell of a map, in the unit of the heights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Extent along x, the fast axis of a map.
    pub x: f64,
    /// Extent along y.
    pub y: f64,
}

/// A rough surface on its cell: a height map, or the waves of a spectrum on a grid. The unit of length is the caller's.
#[derive(Debug, Clone)]
pub struct Surface {
    source: HeightSource,
    /// In reduced units: the cell has the extent 1 along x.
    grid: Grid,
    length: f64,
    periodic: bool,
    provenance: Option<Provenance>,
    /// Steps of preparation of a map from an array, and what is doubtful about them.
    steps: Vec<String>,
    doubts: Vec<String>,
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
    /// Nodes per shortest wave beyond which [`Surface::refinements`] of a series do not go.
    pub const NODES_PER_WAVE: usize = 16;

    /// A surface of `heights` `[ny, nx]`, x fastest, in the unit of `length`, the extent along x. Pixels are square;
    /// [`Surface::from_map`] takes others.
    ///
    /// # Errors
    /// If a height is not finite, the array is empty, or `length` is not positive.
    ///
    /// ```
    /// use asperity_surface::height_map::Touching;
    /// use asperity_surface::Surface;
    /// use ndarray::array;
    ///
    /// let heights = array![[3.0, 1.0], [2.0, 2.0]];
    /// let surface = Surface::from_array(heights.view(), 10.0, Touching::HighPoints)?;
    /// // Inside the crate low points touch first, and the lowest is at 0.
    /// assert_eq!(surface.heights(), array![[0.0, 2.0], [1.0, 1.0]]);
    /// # Ok::<(), asperity_grid::Error>(())
    /// ```
    #[cfg(feature = "files")]
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
    /// use asperity_surface::height_map::Touching;
    /// use asperity_surface::{Detrend, MapOptions, Preparation, Surface};
    /// use ndarray::Array2;
    ///
    /// let tilted = Array2::from_shape_fn((8, 8), |(y, x)| 0.5 * x as f64 + if (x, y) == (3, 4) { 0.1 } else { 0.0 });
    /// let preparation = Preparation { detrend: Some(Detrend::Plane), ..Preparation::default() };
    /// let options = MapOptions { preparation, ..MapOptions::new(8.0, Touching::HighPoints) };
    /// let surface = Surface::from_map(tilted.view(), &options)?;
    /// assert!(surface.rms_height() < 0.1 && surface.preparation_steps()[0].starts_with("detrend plane"));
    /// # Ok::<(), asperity_grid::Error>(())
    /// ```
    #[cfg(feature = "files")]
    pub fn from_map(heights: ArrayView2<f64>, options: &MapOptions) -> Result<Self> {
        let (ny, nx) = heights.dim();
        let values = heights.iter().copied().collect();
        Self::from_height_map(|| HeightMap::with_missing("heights", nx, ny, values), options)
    }

    /// As `from_map`, of a map that is made after the options are checked.
    ///
    /// # Errors
    /// Those of the map; a length that is not positive; those of the preparation.
    pub fn from_height_map(map: impl FnOnce() -> Result<HeightMap>, options: &MapOptions) -> Result<Self> {
        let MapOptions { length, length_y, touching, periodic, ref preparation } = *options;
        positive("length", length)?;
        length_y.iter().try_for_each(|l| positive("length_y", *l))?;
        let map = map()?;
        let extent = [length, length_y.unwrap_or(length * map.ny as f64 / map.nx as f64)];
        let PreparedMap { map, extent, history, warnings, .. } = preparation.apply(map, extent, periodic)?;
        let grid = Grid { nx: map.nx, ny: map.ny, lx: extent[0], ly: extent[1] };
        let body = RoughBody { grid, heights: map.low_first(touching).heights };
        let periodic = preparation.repeats() || periodic && preparation.crop.is_none();
        Ok(Surface { periodic, steps: history, doubts: warnings, ..Self::of_map(body, "array".into(), extent[0]) })
    }

    /// A realisation of a self-affine spectrum. The seed determines the phases of the waves, whatever the grid.
    ///
    /// # Errors
    /// If `nodes` is zero or `length` is not positive.
    ///
    /// ```
    /// use asperity_surface::{Spectrum, Surface, SynthesisOptions};
    ///
    /// let spectrum = Spectrum { rms_gradient: 0.1, lambda_s: 1.0 / 16.0, ..Spectrum::CHALLENGE };
    /// let surface = Surface::from_spectrum(spectrum, SynthesisOptions { nodes: 64, length: 1e-4, seed: 1 })?;
    /// assert!((surface.rms_gradient() - 0.1).abs() < 1e-12);
    /// # Ok::<(), asperity_grid::Error>(())
    /// ```
    pub fn from_spectrum(spectrum: Spectrum, options: SynthesisOptions) -> Result<Self> {
        let SynthesisOptions { nodes, length, seed } = options;
        positive("length", length)?;
        if nodes == 0 {
            return Err(Error::input(PLACE, "nodes", 0, "at least 1"));
        }
        spectrum.check()?;
        let modes = Modes::new(spectrum, seed, 1.0);
        Ok(Self::from_source(HeightSource::Synthesised { modes, spectrum, seed }, Grid::unit(nodes, nodes), length))
    }

    /// Heights over the extent of the cell, which is `length` along x. `grid`: the nodes, on a cell of extent 1 along x.
    pub fn from_source(source: HeightSource, grid: Grid, length: f64) -> Self {
        Surface { source, grid, length, periodic: true, provenance: None, steps: Vec::new(), doubts: Vec::new() }
    }

    /// One node at height 0.
    pub fn flat(length: f64) -> Self {
        let (grid, heights, origin) = (Grid::unit(1, 1), Arc::new(vec![0.0]), "flat".into());
        Self::from_source(HeightSource::Imported { grid, heights, origin }, grid, length)
    }

    /// A surface of a file.
    pub fn with_provenance(self, provenance: Option<Provenance>) -> Self {
        let periodic = provenance.as_ref().is_none_or(|p| p.periodic);
        Surface { periodic, provenance, ..self }
    }

    /// The surface that presses on a flat body as this one presses on `other`: the sum of their heights. Both are in one unit of length.
    /// Where both repeat, the sum does; otherwise it is over the part where one map lies on the other.
    ///
    /// # Errors
    /// Those of [`RoughBody::facing`].
    ///
    /// ```
    /// use asperity_surface::height_map::Touching;
    /// use asperity_surface::{Placement, Surface};
    /// use ndarray::Array2;
    ///
    /// let wave = Array2::from_shape_fn((1, 8), |(_, x)| (std::f64::consts::TAU * x as f64 / 8.0).cos());
    /// let surface = Surface::from_array(wave.view(), 8.0, Touching::HighPoints)?;
    /// let on_itself = surface.facing(&surface, &Placement::default())?;
    /// assert!((on_itself.rms_height() / surface.rms_height() - 2.0).abs() < 1e-12);
    /// # Ok::<(), asperity_grid::Error>(())
    /// ```
    pub fn facing(&self, other: &Surface, placement: &Placement) -> Result<Self> {
        let body = |s: &Surface| RoughBody {
            grid: Grid { lx: s.length, ly: s.grid.ly * s.length, ..s.grid },
            heights: s.source.heights(s.grid, 0.0).iter().map(|h| h * s.length).collect(),
        };
        let periodic = self.periodic && other.periodic;
        let Facing { sum, line } = body(self).facing(body(other), placement, periodic, "")?;
        let length = sum.grid.lx;
        let of_other = other.preparation_steps().iter().map(|step| format!("the other body: {step}"));
        let steps = self.preparation_steps().iter().cloned().chain(of_other).chain([line]).collect();
        Ok(Surface { periodic, steps, ..Self::of_map(sum, "sum of two bodies".into(), length) })
    }

    /// Heights with low points first, over extents in the same unit; the lowest is kept.
    fn of_map(RoughBody { grid, mut heights }: RoughBody, origin: String, length: f64) -> Self {
        let unit = 1.0 / grid.lx;
        heights.iter_mut().for_each(|h| *h *= unit);
        let grid = Grid { ly: grid.ly / grid.lx, ..Grid::unit(grid.nx, grid.ny) };
        Self::from_source(HeightSource::Imported { grid, heights: Arc::new(heights), origin }, grid, length)
    }

    /// The same surface on other nodes of its cell: its waves that they hold. A map is interpolated by its Fourier series.
    pub fn on_nodes(&self, nx: usize, ny: usize) -> Self {
        let grid = Grid { nx, ny, ..self.grid };
        let source = match &self.source {
            HeightSource::Imported { grid: own, heights, origin } if (nx, ny) != (own.nx, own.ny) => {
                HeightSource::Fourier { modes: FourierModes::through(*own, heights), origin: origin.clone() }
            }
            source => source.clone(),
        };
        Surface { source, grid, ..self.clone() }
    }

    /// Nodes along x and y from coarse to fine, each twice as many as those before, of which the surface's own are some. A map ends with its
    /// own, as nothing is known of waves between them; a series goes on to at most [`Surface::NODES_PER_WAVE`].
    pub fn refinements(&self) -> Vec<[usize; 2]> {
        let half = |[nx, ny]: [usize; 2]| [nx.div_ceil(2), ny.div_ceil(2)];
        let double = |[nx, ny]: [usize; 2]| [2 * nx, 2 * ny];
        let own = [self.grid.nx, self.grid.ny];
        let large_enough = |[nx, ny]: &[usize; 2]| *nx.max(ny) >= COARSEST;
        let coarser = std::iter::successors(Some(own), |n| Some(half(*n))).skip(1).take_while(large_enough);
        let mut list: Vec<[usize; 2]> = coarser.collect();
        list.reverse();
        list.push(own);
        let needed = match &self.source {
            HeightSource::Imported { .. } => 0,
            HeightSource::Synthesised { spectrum, .. } => {
                Self::NODES_PER_WAVE * spectrum.largest_modes(self.grid.ly).0 as usize
            }
            HeightSource::Fourier { modes, .. } => Self::NODES_PER_WAVE * (modes.smallest_grid() / 2),
        };
        let finer = std::iter::successors(Some(own), |n| Some(double(*n)).filter(|n| n[0] <= needed)).skip(1);
        list.extend(finer);
        list
    }

    /// File, declared properties and preparation of a surface from a file.
    pub fn provenance(&self) -> Option<&Provenance> {
        self.provenance.as_ref()
    }

    /// Whether the map repeats, or was made to by its preparation. A map that does not is solved as periodic, with a warning, unless
    /// the body is not periodic either.
    pub fn is_periodic(&self) -> bool {
        self.periodic
    }

    /// Steps of preparation that were applied to the map, with their parameters.
    pub fn preparation_steps(&self) -> &[String] {
        self.provenance.as_ref().map_or(&self.steps, |p| &p.preparation)
    }

    /// Copies of the measured map in the cell: four of one that was mirrored, two of a profile, otherwise one, and of a part of a mirrored
    /// one as many as it holds. A force acts on each of them.
    pub fn copies(&self) -> f64 {
        copies(self.preparation_steps())
    }

    /// Area of the measured map, on which a force acts.
    pub fn mapped_area(&self) -> f64 {
        self.length * (self.length * self.grid.ly) / self.copies()
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
    #[cfg(feature = "files")]
    pub fn heights(&self) -> Array2<f64> {
        let heights = self.source.heights(self.grid, 0.0);
        let map = Array2::from_shape_vec(self.shape(), heights).expect("a value per node");
        map.mapv_into(|h| h * self.length)
    }

    /// Root mean square of the gradient of all waves that the grid resolves.
    pub fn rms_gradient(&self) -> f64 {
        match &self.source {
            HeightSource::Synthesised { modes, .. } => modes.series().rms_gradient(self.grid),
            HeightSource::Fourier { modes, .. } => modes.series().rms_gradient(self.grid),
            HeightSource::Imported { heights, .. } => {
                Series::<f64>::from_nodes(self.grid, heights).rms_gradient(self.grid)
            }
        }
    }

    /// Root mean square of the heights about their mean.
    pub fn rms_height(&self) -> f64 {
        let reduced = match &self.source {
            HeightSource::Synthesised { modes, .. } => modes.series().rms(),
            HeightSource::Fourier { modes, .. } => modes.series().rms(),
            HeightSource::Imported { heights, .. } => rms(heights),
        };
        reduced * self.length
    }

    /// What limits the results on this surface: unresolved waves, steep slopes, quantised heights.
    pub fn warnings(&self) -> Vec<String> {
        let mut list = match &self.source {
            HeightSource::Synthesised { modes, .. } => modes.left_out_by(self.grid).into_iter().collect(),
            HeightSource::Imported { heights, .. } => quality_warnings(self.grid, heights),
            HeightSource::Fourier { .. } => Vec::new(),
        };
        list.extend(slope_warnings(self.rms_gradient()));
        list.extend(self.doubts.iter().cloned());
        list
    }

    /// Where the heights come from, over the extent of the cell.
    pub fn source(&self) -> &HeightSource {
        &self.source
    }

    /// The nodes, on a cell of extent 1 along x.
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// Extent of the cell along x.
    pub fn length(&self) -> f64 {
        self.length
    }
}

/// Named in errors.
const PLACE: &str = "surface";

/// Least number of nodes of the coarsest grid along its longer side.
const COARSEST: usize = 32;

fn positive(key: &str, value: f64) -> Result<()> {
    match value.is_finite() && value > 0.0 {
        true => Ok(()),
        false => Err(Error::input(PLACE, key, value, "a positive number")),
    }
}
