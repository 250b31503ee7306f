//! The surface of a scene.

use super::check::cut_offs;
use super::surface_file::{PreparedFile, SurfaceFile};
use super::{LaboratoryScene, Scene};
use crate::{Error, Result};
use asperity_grid::{Grid, rms};
use asperity_surface::Wave;
use asperity_surface::heights::Touching;
use asperity_surface::import::{Content, Fourier};
use asperity_surface::provenance::Provenance;
use asperity_surface::{FourierModes, Modes, Spectrum, lower_to_zero, resample};
use std::sync::Arc;

/// Source of heights: a spectrum or series that gives them on any grid, or a map that is resampled.
#[derive(Debug, Clone)]
pub enum HeightSource {
    Synthesised {
        modes: Modes,
        spectrum: Spectrum,
        seed: u64,
    },
    /// Reduced heights (unit: the cell's extent in x), low points touch first.
    Imported {
        grid: Grid,
        heights: Arc<Vec<f64>>,
        origin: String,
    },
    /// Fourier coefficients, which give heights on any grid that resolves them.
    Fourier {
        modes: FourierModes,
        origin: String,
    },
}

/// A surface with what its file determines beyond the heights.
pub struct ResolvedSurface {
    pub surface: HeightSource,
    /// The scene's, with the extents of the prepared cell.
    pub laboratory: LaboratoryScene,
    /// Of an imported surface.
    pub provenance: Option<Provenance>,
    /// What is doubtful about its file.
    pub warnings: Vec<String>,
}

impl HeightSource {
    /// Bytes of the Fourier series that defines the heights; `None` for a map.
    pub fn series_bytes(&self) -> Option<u64> {
        match self {
            HeightSource::Synthesised { modes, .. } => Some(modes.series_bytes()),
            HeightSource::Fourier { modes, .. } => Some(modes.series().bytes()),
            HeightSource::Imported { .. } => None,
        }
    }

    /// The surface of a scene: synthesised, or that of its file, prepared, with the lowest point at 0 and low points touching first. The
    /// scene is complete ([`SurfaceFile::complete`]).
    ///
    /// # Errors
    /// Those of [`Preparation::apply`](asperity_surface::Preparation::apply) and [`FourierModes::new`], waves that the transform's own grid
    /// does not hold, keys of maps for Fourier coefficients.
    pub fn resolve(scene: &Scene, file: Option<SurfaceFile>, context: &str) -> Result<ResolvedSurface> {
        let (s, mut laboratory) = (&scene.surface, scene.laboratory.clone());
        let Some(file) = file else {
            let (lambda_r, lambda_s) = cut_offs(s, laboratory.length());
            let spectrum =
                Spectrum { hurst: s.hurst, lambda_r, lambda_s, rms_gradient: s.rms_gradient, amplitudes: s.amplitudes };
            let surface =
                HeightSource::Synthesised { modes: Modes::new(spectrum, s.seed, 1.0), spectrum, seed: s.seed };
            return Ok(ResolvedSurface { surface, laboratory, provenance: None, warnings: Vec::new() });
        };
        let sign = match s.touching {
            Some(Touching::HighPoints) => Touching::HighPoints,
            _ => Touching::LowPoints,
        };
        let warnings = file.found.warnings.clone();
        if let Content::Waves(_) = file.found.content {
            let (modes, provenance) = series(scene, file, sign, context)?;
            let origin = format!("read from {provenance}; {}", modes.summary());
            let surface = HeightSource::Fourier { modes, origin };
            return Ok(ResolvedSurface { surface, laboratory, provenance: Some(provenance), warnings });
        }
        let PreparedFile { map, extent: [x, y], provenance } = file.prepare(scene)?;
        (laboratory.length, laboratory.length_y) = (Some(laboratory.of_number(x)), Some(laboratory.of_number(y)));
        let mut map = map.low_first(sign);
        map.heights.iter_mut().for_each(|h| *h *= 1.0 / x);
        let mut grid = Grid::unit(map.nx, map.ny);
        grid.ly = y / x;
        let origin = format!("read from {provenance}");
        let surface = HeightSource::Imported { grid, heights: Arc::new(map.heights), origin };
        Ok(ResolvedSurface { surface, laboratory, provenance: Some(provenance), warnings })
    }

    /// Heights `[ny, nx]`, lowest at 0, with the modes whose wavelength is at least `low_pass` (0 for all that the grid
    /// holds).
    pub fn heights(&self, grid: Grid, low_pass: f64) -> Vec<f64> {
        let mut heights: Vec<f64> = match self {
            HeightSource::Synthesised { modes, .. } => modes.heights(grid, low_pass),
            HeightSource::Imported { grid: own, heights, .. } if *own == grid && low_pass == 0.0 => heights.to_vec(),
            HeightSource::Imported { grid: own, heights, .. } => resample(*own, heights, grid, low_pass),
            HeightSource::Fourier { modes, .. } => modes.heights(grid, low_pass),
        };
        lower_to_zero(&mut heights);
        heights
    }

    /// Root mean square about the mean, over L; of a spectrum what is expected of it.
    pub fn rms_height(&self) -> f64 {
        match self {
            HeightSource::Synthesised { spectrum, .. } => spectrum.expected(1.0, 0.0).rms_height,
            HeightSource::Imported { heights, .. } => rms(heights),
            HeightSource::Fourier { modes, .. } => modes.series().rms(),
        }
    }

    /// One line for the report.
    pub fn origin(&self) -> String {
        match self {
            HeightSource::Synthesised { seed, .. } => format!("synthesised from its spectrum, seed {seed}"),
            HeightSource::Imported { origin, .. } | HeightSource::Fourier { origin, .. } => origin.clone(),
        }
    }
}

/// Fourier coefficients of a file over the cell's extent.
fn series(scene: &Scene, file: SurfaceFile, sign: Touching, context: &str) -> Result<(FourierModes, Provenance)> {
    let (s, lab) = (&scene.surface, &scene.laboratory);
    let of_maps = file.keys_of_maps(s);
    if let Some(key) = of_maps.first() {
        let accepted = format!("none: {} has Fourier coefficients", file.path().display());
        return Err(Error::input(context, *key, "given", accepted));
    }
    let Content::Waves(waves) = &file.found.content else { unreachable!("a map is no series") };
    let points = s.fourier_points.filter(|_| s.fourier == Some(Fourier::Fftw));
    let beyond = |w: &&Wave| points.is_some_and(|n| 2 * w.kx.unsigned_abs().max(w.ky.unsigned_abs()) as usize >= n);
    if let (Some(n), Some(w)) = (points, waves.iter().find(beyond)) {
        let found = format!("q = ({}, {})", w.kx, w.ky);
        return Err(Error::format(
            file.path(),
            found,
            format!("waves below half of the {n} points of surface.fourier_points (--fourier-points)"),
        ));
    }
    let sign = if sign == Touching::HighPoints { -1.0 } else { 1.0 };
    let scale = points.map_or(1.0, |n| (n as f64).powi(-2));
    let low_pass = s.low_pass.map_or(0.0, |length| lab.reduced(length));
    let unit = file.height_unit(scene);
    let modes = FourierModes::new(file.path(), waves, sign * scale * (unit / lab.number(lab.length())), low_pass)?;
    let sum = match points {
        None => "coefficients a of h(r) = Σ a exp(iq·r)".to_string(),
        Some(n) => format!("n² a of h(r) = Σ a exp(iq·r), n = {n}"),
    };
    Ok((modes, file.provenance_of_waves(scene, &sum)?))
}
