//! Where heights come from: a spectrum or series that gives them on any grid, or a map that is resampled.

use crate::{FourierModes, Modes, Spectrum, lower_to_zero, resample};
use asperity_grid::{Grid, rms};
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

impl HeightSource {
    /// Bytes of the Fourier series that defines the heights; `None` for a map.
    pub fn series_bytes(&self) -> Option<u64> {
        match self {
            HeightSource::Synthesised { modes, .. } => Some(modes.series_bytes()),
            HeightSource::Fourier { modes, .. } => Some(modes.series().bytes()),
            HeightSource::Imported { .. } => None,
        }
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
