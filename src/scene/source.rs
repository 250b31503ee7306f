//! The surface of a scene.

use super::check::{cut_offs, word};
use super::model::relative_to;
use super::{Laboratory, SurfaceScene, Touching, Units};
use crate::grid::{Grid, rms};
use crate::record::heights::Sign;
use crate::record::import::{self, Content, Fourier, ImportOptions, Wave};
use crate::surface::{FourierModes, Modes, Spectrum, lower_to_zero, resample};
use crate::{Error, Result};
use std::path::Path;

/// Source of heights: a spectrum or series that gives them on any grid, or a map that is resampled.
#[derive(Debug, Clone)]
pub enum Surface {
    Synthesised {
        modes: Modes,
        spectrum: Spectrum,
        seed: u64,
    },
    /// Reduced heights (unit: the cell's extent in x), low points touch first.
    Imported {
        grid: Grid,
        heights: Vec<f64>,
        origin: String,
    },
    /// Fourier coefficients, which give heights on any grid that resolves them.
    Fourier {
        modes: FourierModes,
        origin: String,
    },
}

/// Relative deviation that a unit may have from the one that a file declares.
const UNIT_TOLERANCE: f64 = 1e-9;

impl Surface {
    /// The surface of a scene's table: synthesised, or read from its file with the lowest point at 0 and low points touching first. `file` is
    /// the scene file.
    ///
    /// # Errors
    /// Those of [`import::read`] and [`FourierModes::new`], a sign or unit that contradicts the file, waves that the transform's own
    /// grid does not hold, a low pass for a height map.
    pub fn resolve(s: &SurfaceScene, laboratory: &Laboratory, file: &Path) -> Result<Self> {
        let Some(path) = &s.heights else {
            let (lambda_r, lambda_s) = cut_offs(s, laboratory.length_um);
            let spectrum =
                Spectrum { hurst: s.hurst, lambda_r, lambda_s, rms_gradient: s.rms_gradient, amplitudes: s.amplitudes };
            return Ok(Surface::Synthesised { modes: Modes::new(spectrum, s.seed, 1.0), spectrum, seed: s.seed });
        };
        let path = relative_to(file, path);
        let found = import::read(&path, ImportOptions { dataset: s.dataset.as_deref(), fourier: s.fourier })?;
        let place = file.display().to_string();
        let sign = match s.touching {
            Some(Touching::HighPoints) => Sign::HighFirst,
            _ => Sign::LowFirst,
        };
        if let Some(declared) = found.declared.sign.filter(|declared| *declared != sign) {
            let given = s.touching.map_or("not given".into(), |t| word(&t));
            let accepted = format!("what {} declares: {}", path.display(), declared.words());
            return Err(Error::input(place, "surface.touching", given, accepted));
        }
        let (um, named) = (s.heights_unit_um, laboratory.units == Units::Named);
        if let Some(declared) = found.declared.unit_um().filter(|_| named)
            && (um / declared - 1.0).abs() > UNIT_TOLERANCE
        {
            let unit = found.declared.unit.as_deref().unwrap_or_default();
            let accepted = format!("{declared}, as {} declares its heights in {unit}", path.display());
            return Err(Error::input(place, "surface.heights_unit_um", um, accepted));
        }
        let unit = if named { format!("in units of {um} µm") } else { "as they are".to_string() };
        let declared = found.declared.unit.map_or(String::new(), |u| format!(" (the file declares {u:?})"));
        let origin =
            |what: String| format!("read from {}: {what}; heights {unit}{declared}, {}", path.display(), sign.words());
        let length_um = laboratory.length_um;
        match found.content {
            Content::Map(_) if s.low_pass_um.is_some() => {
                let accepted = format!("none: {} is a height map", path.display());
                Err(Error::input(place, "surface.low_pass_um", "given", accepted))
            }
            Content::Map(map) => {
                let mut map = map.low_first(sign);
                map.heights.iter_mut().for_each(|h| *h *= um / length_um);
                let mut grid = Grid::unit(map.nx, map.ny);
                grid.ly = laboratory.length_y_um.map_or(grid.ly, |y| y / length_um);
                Ok(Surface::Imported { grid, heights: map.heights, origin: origin(found.layout) })
            }
            Content::Waves(waves) => {
                let (modes, sum) = series(s, laboratory.length_um, &path, &waves, sign)?;
                let origin = origin(format!("{}, {sum}, {}", found.layout, modes.summary()));
                Ok(Surface::Fourier { modes, origin })
            }
        }
    }

    /// Heights `[ny, nx]`, lowest at 0, with the modes whose wavelength is at least `low_pass` (0 for all that the grid
    /// holds).
    pub fn heights(&self, grid: Grid, low_pass: f64) -> Vec<f64> {
        let mut heights: Vec<f64> = match self {
            Surface::Synthesised { modes, .. } => modes.heights(grid, low_pass),
            Surface::Imported { grid: own, heights, .. } if *own == grid && low_pass == 0.0 => heights.clone(),
            Surface::Imported { grid: own, heights, .. } => resample(*own, heights, grid, low_pass),
            Surface::Fourier { modes, .. } => modes.heights(grid, low_pass),
        };
        lower_to_zero(&mut heights);
        heights
    }

    /// Root mean square about the mean, over L; of a spectrum what is expected of it.
    pub fn rms_height(&self) -> f64 {
        match self {
            Surface::Synthesised { spectrum, .. } => spectrum.expected(1.0, 0.0).rms_height,
            Surface::Imported { heights, .. } => rms(heights),
            Surface::Fourier { modes, .. } => modes.series().rms(),
        }
    }

    /// One line for the report.
    pub fn origin(&self) -> String {
        match self {
            Surface::Synthesised { seed, .. } => format!("synthesised from its spectrum, seed {seed}"),
            Surface::Imported { origin, .. } | Surface::Fourier { origin, .. } => origin.clone(),
        }
    }
}

/// Fourier coefficients of a file over the cell's extent, and the sum that they are the coefficients of.
fn series(s: &SurfaceScene, length_um: f64, path: &Path, waves: &[Wave], sign: Sign) -> Result<(FourierModes, String)> {
    let points = s.fourier_points.filter(|_| s.fourier == Some(Fourier::Fftw));
    let beyond = |w: &&Wave| points.is_some_and(|n| 2 * w.kx.unsigned_abs().max(w.ky.unsigned_abs()) as usize >= n);
    if let (Some(n), Some(w)) = (points, waves.iter().find(beyond)) {
        let found = format!("q = ({}, {})", w.kx, w.ky);
        return Err(Error::format(
            path,
            found,
            format!("waves below half of the {n} points of surface.fourier_points (--fourier-points)"),
        ));
    }
    let sign = if sign == Sign::HighFirst { -1.0 } else { 1.0 };
    let scale = points.map_or(1.0, |n| (n as f64).powi(-2));
    let low_pass = s.low_pass_um.map_or(0.0, |um| um / length_um);
    let modes = FourierModes::new(path, waves, sign * scale * (s.heights_unit_um / length_um), low_pass)?;
    let sum = match points {
        None => "coefficients a of h(r) = Σ a exp(iq·r)".to_string(),
        Some(n) => format!("n² a of h(r) = Σ a exp(iq·r), n = {n}"),
    };
    Ok((modes, sum))
}
