//! The surface in numbers, in the terms of `results.json`.

use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SurfaceResults {
    /// What made it: "synthesised, seed 1" or the imported file.
    pub origin: String,
    pub nx: usize,
    pub ny: usize,
    /// Extent in y over extent in x.
    pub aspect: f64,
    /// Whether the cell repeats. If not, statistics and spectrum are those of a patch: see [`Self::note`].
    pub periodic: bool,
    /// What statistics and spectrum assume, where that is not the periodic cell.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub note: String,
    /// `[ny, nx]` f64 heights, low points touch first, min = 0.
    /// Absent where no map was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heights: Option<String>,
    pub statistics: Vec<Statistic>,
    /// Radial power spectral density; absent `expected` for an imported surface.
    pub psd: Vec<PsdPoint>,
}

/// Symbols of [`Statistic`]s that others look up.
pub const RMS_HEIGHT: &str = "h_rms";

pub const CURVATURE_RADIUS: &str = "R_c";

pub const FIRST_TOUCH: &str = "h̄ - h_min";

pub const HEIGHT_RANGE: &str = "h_max - h_min";

impl SurfaceResults {
    /// The statistic with a symbol, if the surface has it.
    pub fn statistic(&self, symbol: &str) -> Option<&Statistic> {
        self.statistics.iter().find(|s| s.symbol == symbol)
    }
}

/// One line of the table "expected against realised".
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Statistic {
    pub name: String,
    pub symbol: String,
    /// Unit of both values, for people ("µm", "nm", "1").
    pub unit: String,
    /// Ensemble value of the spectrum; none for an imported surface.
    pub expected: Option<f64>,
    /// The same of the modes that the grid holds, where it does not hold the whole spectrum.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expected_on_grid: Option<f64>,
    pub realised: f64,
    /// Half-width of the band in which a realisation is expected (two standard deviations), where known.
    pub band: Option<f64>,
}

#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct PsdPoint {
    /// Mode number |n| (wave vector over 2π/L).
    pub mode: f64,
    /// Power per mode, units of L².
    pub realised: f64,
    pub expected: Option<f64>,
}
