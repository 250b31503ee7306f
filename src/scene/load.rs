//! `[load]`: the load path.

use super::quantity::{
    AnyQuantity, Dimensional, Force, Length, List, Quantity, Stress, dimension, fractions, list, numbers,
};
use asperity_contact::problem::{LoadKind, Loads};
use asperity_grid::units::Dimension;
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
    /// Normal forces on the map instead; a mirrored cell carries four times as much.
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
    /// Loads, as they are given, whose maps of gap and stress are kept. Default: all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub maps_at: Option<Vec<AnyQuantity>>,
    /// After the last load, separate the surfaces and find the pull-off pressure.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub pull_off: bool,
}

/// Loads that a scene gives in two places are the same up to this relative difference.
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

/// The numbers of quantities, in SI units.
fn si<D: Dimensional>(list: &[Quantity<D>]) -> Vec<f64> {
    list.iter().map(|q| q.si()).collect()
}

impl LoadScene {
    /// The loads with their unloading branch and pull-off: the first kind that is given.
    pub fn loads(&self) -> Loads {
        let p_star = self.p_star_range.map_or_else(|| self.p_star.clone(), |r| r.loads());
        let kinds = [
            (LoadKind::Pressure, si(&self.pressure)),
            (LoadKind::Force, si(&self.force)),
            (LoadKind::MeanGap, si(&self.mean_gap)),
            (LoadKind::Displacement, si(&self.displacement)),
            (LoadKind::Contact, self.contact.clone()),
        ];
        let (kind, values) = kinds.into_iter().find(|(_, list)| !list.is_empty()).unwrap_or((LoadKind::PStar, p_star));
        Loads { kind, values, unload: self.unload, pull_off: self.pull_off }
    }

    /// A value as it is given.
    pub(super) fn text(&self, kind: LoadKind, index: usize) -> Option<String> {
        fn text<D: Dimensional>(list: &[Quantity<D>], index: usize) -> Option<String> {
            list.get(index).map(|q| q.in_words())
        }
        match kind {
            LoadKind::Pressure => text(&self.pressure, index),
            LoadKind::Force => text(&self.force, index),
            LoadKind::MeanGap => text(&self.mean_gap, index),
            LoadKind::Displacement => text(&self.displacement, index),
            LoadKind::PStar | LoadKind::Contact => None,
        }
    }

    /// Indices of the loads that a scene names by their value.
    pub fn indices_of(&self, value: AnyQuantity) -> Vec<usize> {
        let Loads { kind, .. } = self.loads();
        let dimension = match kind {
            LoadKind::PStar => Dimension::Number,
            LoadKind::Contact => Dimension::Fraction,
            LoadKind::Pressure => Dimension::Stress,
            LoadKind::Force => Dimension::Force,
            LoadKind::MeanGap | LoadKind::Displacement => Dimension::Length,
        };
        let Some(value) = value.of(dimension) else { return Vec::new() };
        let path = self.loads().path();
        (0..path.len()).filter(|&i| (path[i] - value).abs() <= SAME_LOAD * path[i].abs()).collect()
    }
}
