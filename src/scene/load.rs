//! `[load]`: the load path.

use super::quantity::{Dimensional, Force, Length, List, Quantity, Stress, dimension, fractions, list, numbers};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The load path.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LoadScene {
    /// Mean pressures over E* times the rms gradient of the whole spectrum, in the order in which they are applied. With
    /// adhesion, loading and unloading are different branches, and pressures may be negative (tension).
    #[serde(default, deserialize_with = "numbers", skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "List<dimension::Number>")]
    pub p_star: Vec<f64>,
    /// Such loads at equal ratios instead of a list.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p_star_range: Option<LoadRange>,
    /// Mean pressures instead.
    #[serde(default, deserialize_with = "list", skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "List<dimension::Stress>")]
    pub pressure: Vec<Stress>,
    /// Normal forces on the cell instead.
    #[serde(default, deserialize_with = "list", skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "List<dimension::Force>")]
    pub force: Vec<Force>,
    /// Mean gaps instead. They reach states that are unstable under a prescribed pressure.
    #[serde(default, deserialize_with = "list", skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "List<dimension::Length>")]
    pub mean_gap: Vec<Length>,
    /// Displacements of the rough surface from first contact towards the mean plane of the elastic one instead: mean gap at first
    /// contact minus mean gap.
    #[serde(default, deserialize_with = "list", skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "List<dimension::Length>")]
    pub displacement: Vec<Length>,
    /// Contact fractions instead. The pressures that give them are found first.
    #[serde(default, deserialize_with = "fractions", skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "List<dimension::Fraction>")]
    pub contact: Vec<f64>,
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
    /// First load.
    pub from: f64,
    /// Last load.
    pub to: f64,
    /// Loads per factor of ten. Both ends are loads, so the ratio may be slightly smaller.
    pub per_decade: usize,
}

impl LoadRange {
    /// Widest accepted range of loads.
    pub const DECADES: f64 = 20.0;
    /// Accepted loads per factor of ten.
    pub const PER_DECADE: std::ops::RangeInclusive<usize> = 1..=100;

    /// The loads; none where the ends are no positive numbers, or the range is not accepted.
    fn loads(&self) -> Vec<f64> {
        let decades = self.to.log10() - self.from.log10();
        let accepted = decades.abs() <= Self::DECADES && Self::PER_DECADE.contains(&self.per_decade);
        if !(decades.is_finite() && accepted) {
            return Vec::new();
        }
        let steps = (decades.abs() * self.per_decade as f64 - 1e-9).ceil().max(1.0);
        // Exact powers of ten where the range contains them.
        let value_at = |k: f64| self.from * 10f64.powf(decades * k / steps);
        (0..=steps as usize).map(|k| if k as f64 == steps { self.to } else { value_at(k as f64) }).collect()
    }
}

/// The numbers of quantities.
fn values<D: Dimensional>(list: &[Quantity<D>]) -> Vec<f64> {
    list.iter().map(|q| q.value()).collect()
}

impl LoadScene {
    /// The loads `p*` in the order of their application, unloading included; empty where other loads are imposed.
    pub fn p_star_path(&self) -> Vec<f64> {
        let up = self.p_star_range.map_or_else(|| self.p_star.clone(), |r| r.loads());
        self.with_unloading(&up)
    }

    /// A list of loads and, if the scene has one, its unloading branch.
    pub fn with_unloading<T: Copy>(&self, list: &[T]) -> Vec<T> {
        let unloading = list.iter().rev().skip(1).filter(|_| self.unload);
        list.iter().chain(unloading).copied().collect()
    }

    /// Whether the path rises to its highest load and returns by the same loads, by `unload` or by its list.
    pub fn is_closed(&self) -> bool {
        let lists = [self.p_star_path(), values(&self.pressure), values(&self.force)];
        let mirrored = |path: &Vec<f64>| {
            let (half, n) = (path.len() / 2, path.len());
            n % 2 == 1 && n > 1 && path.iter().eq(path.iter().rev()) && path[..=half].is_sorted_by(|a, b| a < b)
        };
        self.unload || lists.iter().any(mirrored)
    }

    /// The loads of each kind by their key, unloading included: all but one list are empty.
    pub fn lists(&self) -> [(&'static str, Vec<f64>); 6] {
        [
            ("load.p_star", self.p_star_path()),
            ("load.pressure", self.with_unloading(&values(&self.pressure))),
            ("load.force", self.with_unloading(&values(&self.force))),
            ("load.contact", self.with_unloading(&self.contact)),
            ("load.mean_gap", self.with_unloading(&values(&self.mean_gap))),
            ("load.displacement", self.with_unloading(&values(&self.displacement))),
        ]
    }

    pub fn count(&self) -> usize {
        self.lists().iter().map(|(_, list)| list.len()).sum()
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
