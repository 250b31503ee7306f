//! Surface and its statistics, as in `results.json`.

use asperity_surface::provenance::Provenance;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The surface that was solved.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct SurfaceResults {
    /// Origin: "synthesised, seed 1" or the imported file.
    pub origin: String,
    /// File, declared properties and preparation of an imported surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub provenance: Option<Provenance>,
    /// Points along x.
    pub nx: usize,
    /// Points along y.
    pub ny: usize,
    /// Extent in y over extent in x.
    pub aspect: f64,
    /// Whether the surface is periodic. If not, statistics and spectrum are those of a finite patch: see
    /// [`Self::note`].
    pub periodic: bool,
    /// Assumption of statistics and spectrum for a non-periodic surface.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub note: String,
    /// File of the `[ny, nx]` f64 heights, low points in contact first, min = 0. Absent if no map was requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heights: Option<String>,
    /// Expected and realised.
    pub statistics: Vec<SurfaceStatistic>,
    /// Radial power spectral density; without `expected` for an imported surface.
    pub psd: Vec<PsdPoint>,
}

/// Symbols of [`SurfaceStatistic`]s that other modules use.
pub const RMS_HEIGHT: &str = "h_rms";

pub const CURVATURE_RADIUS: &str = "R_c";

pub const FIRST_TOUCH: &str = "h̄ - h_min";

pub const HEIGHT_RANGE: &str = "h_max - h_min";

impl SurfaceResults {
    /// The statistic with a symbol, if the surface has it.
    pub fn statistic(&self, symbol: &str) -> Option<&SurfaceStatistic> {
        self.statistics.iter().find(|s| s.symbol == symbol)
    }
}

/// One statistic: expected and realised value.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct SurfaceStatistic {
    /// In words.
    pub name: String,
    /// Symbol.
    pub symbol: String,
    /// Unit of both values, for display ("µm", "nm", "1").
    pub unit: String,
    /// Ensemble average of the spectrum; absent for an imported surface.
    pub expected: Option<f64>,
    /// Ensemble average of the modes on the grid, if the grid does not resolve the whole spectrum.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expected_on_grid: Option<f64>,
    /// Of the map.
    pub realised: f64,
    /// Two standard deviations of the realisations, where known.
    pub band: Option<f64>,
}

/// Power spectrum at one mode number.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, JsonSchema)]
pub struct PsdPoint {
    /// Mode number |n| (wave vector over 2π/L).
    pub mode: f64,
    /// Power per mode, units of L².
    pub realised: f64,
    /// Ensemble average of the spectrum, units of L².
    pub expected: Option<f64>,
}
