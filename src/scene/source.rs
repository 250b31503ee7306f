use crate::grid::Grid;
use crate::record::heights::HeightMap;
use crate::surface::{Modes, Spectrum, lower_to_zero, resample};

/// Where heights come from: a rule that gives them on any grid, or a map that is resampled.
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
}

impl Surface {
    pub fn synthesised(spectrum: Spectrum, seed: u64) -> Self {
        Surface::Synthesised { modes: Modes::new(spectrum, seed, 1.0), spectrum, seed }
    }

    /// `map` is in lengths of the cell.
    pub fn imported(map: HeightMap, origin: String) -> Self {
        Surface::Imported { grid: Grid::unit(map.nx, map.ny), heights: map.heights, origin }
    }

    /// Heights `[ny, nx]`, lowest at 0, with the modes whose wavelength is at least `low_pass` (0 for all that the grid
    /// holds).
    pub fn heights(&self, grid: Grid, low_pass: f64) -> Vec<f64> {
        let mut heights: Vec<f64> = match self {
            Surface::Synthesised { modes, .. } => modes.heights(grid, low_pass),
            Surface::Imported { grid: own, heights, .. } if *own == grid && low_pass == 0.0 => heights.clone(),
            Surface::Imported { grid: own, heights, .. } => resample(*own, heights, grid, low_pass),
        };
        lower_to_zero(&mut heights);
        heights
    }

    /// One line for the report.
    pub fn origin(&self) -> String {
        match self {
            Surface::Synthesised { seed, .. } => format!("synthesised from its spectrum, seed {seed}"),
            Surface::Imported { origin, .. } => origin.clone(),
        }
    }
}
