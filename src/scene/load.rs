//! `[load]`: the load path.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LoadScene {
    /// Mean pressures over E* times the rms gradient of the whole spectrum, in the order in which they are applied. With
    /// adhesion, up and down are different branches, and a pull may be negative.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub p_star: Vec<f64>,
    /// Such loads at equal ratios instead of a list.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p_star_range: Option<LoadRange>,
    /// Mean gaps instead, µm: they reach states that no pressure sustains.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mean_gap_um: Vec<f64>,
    /// Mean pressures instead, MPa. Not a key of scene files.
    #[serde(skip)]
    pub pressure_mpa: Vec<f64>,
    /// Append the unloading branch: the same loads in reverse.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub unload: bool,
    /// Loads p* whose maps of gap and stress are kept. Default: all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub maps_at: Option<Vec<f64>>,
    /// After the last load, separate the surfaces and find the pull-off pressure.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub pull_off: bool,
}

/// Loads p* that a scene gives in two places are the same up to this relative difference.
const SAME_LOAD: f64 = 1e-9;

/// Loads at equal ratios.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LoadRange {
    pub from: f64,
    pub to: f64,
    /// Loads per factor of ten. Both ends are loads, so the ratio may be slightly smaller.
    pub per_decade: usize,
}

impl LoadRange {
    /// Widest accepted range of loads.
    pub const DECADES: f64 = 20.0;

    /// The loads; none where the ends are no positive numbers.
    fn loads(&self) -> Vec<f64> {
        let decades = self.to.log10() - self.from.log10();
        if !(decades.is_finite() && decades.abs() <= Self::DECADES) {
            return Vec::new();
        }
        let steps = (decades.abs() * self.per_decade as f64 - 1e-9).ceil().max(1.0);
        // Exact powers of ten where the range contains them.
        let at = |k: f64| self.from * 10f64.powf(decades * k / steps);
        (0..=steps as usize).map(|k| if k as f64 == steps { self.to } else { at(k as f64) }).collect()
    }
}

impl LoadScene {
    /// The loads `p*` in the order of their application, unloading included; empty where pressures or mean gaps are imposed.
    pub fn p_star_path(&self) -> Vec<f64> {
        let up = self.p_star_range.map_or_else(|| self.p_star.clone(), |r| r.loads());
        self.with_unloading(up)
    }

    /// The mean gaps, µm, likewise.
    pub fn mean_gap_path(&self) -> Vec<f64> {
        self.with_unloading(self.mean_gap_um.clone())
    }

    fn with_unloading(&self, mut path: Vec<f64>) -> Vec<f64> {
        if self.unload {
            path.extend_from_within(..path.len().saturating_sub(1));
            let there = path.len().div_ceil(2);
            path[there..].reverse();
        }
        path
    }

    /// Whether the path rises to its highest load and returns by the same loads, by `unload` or by its list.
    pub fn is_closed(&self) -> bool {
        let path = self.p_star_path();
        let (half, n) = (path.len() / 2, path.len());
        let mirrored = n % 2 == 1 && n > 1 && path.iter().eq(path.iter().rev());
        self.unload || mirrored && path[..=half].is_sorted_by(|a, b| a < b)
    }

    pub fn count(&self) -> usize {
        self.p_star_path().len() + self.mean_gap_path().len() + self.pressure_mpa.len()
    }

    /// How many loads come before the unloading branch of a closed path: all of any other path.
    pub fn loading_count(&self) -> usize {
        if self.is_closed() { self.count().div_ceil(2) } else { self.count() }
    }

    /// Indices of the loads p* that a scene names by their value.
    pub fn indices_of(&self, p_star: f64) -> Vec<usize> {
        let path = self.p_star_path();
        (0..path.len()).filter(|&i| (path[i] - p_star).abs() <= SAME_LOAD * path[i].abs()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_load_path_is_closed_if_its_loads_are_symmetric() {
        let is_closed = |p_star: &[f64]| LoadScene { p_star: p_star.to_vec(), ..LoadScene::default() }.is_closed();
        assert!(is_closed(&[0.01, 0.02, 0.05, 0.02, 0.01]));
        for path in [&[0.01][..], &[0.01, 0.02], &[0.01, 0.02, 0.01, 0.02], &[0.02, 0.01, 0.02], &[0.01, 0.03, 0.02]] {
            assert!(!is_closed(path), "{path:?}");
        }
        assert!(LoadScene { p_star: vec![0.01, 0.02], unload: true, ..LoadScene::default() }.is_closed());
    }
}
