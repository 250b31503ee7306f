//! Errors of a setting relative to the reference.

use crate::Result;
use crate::compare::accuracy::{
    Masses, at_nodes_of, decades, finest_error, map_l2, map_mismatch, richardson, rms, wasserstein,
};
use crate::record::tradeoff::{Errors, Extrapolation, LoadErrors, ReferenceLoad};
use crate::scene::Case;
use asperity_contact::method::MethodKind;
use asperity_contact::observe::Distribution;
use asperity_contact::quantity::Quantity;
use asperity_contact::state::{Observed, State};
use asperity_surface::files::npy;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Scales of the surface that make deviations relative.
#[derive(Debug, Clone, Copy)]
pub(super) struct Roughness {
    /// Pressure at p* = 1, Pa.
    pub stress: f64,
    /// rms height, m.
    pub height: f64,
    /// Metres of one unit of stored maps.
    pub map_unit: f64,
}

/// Smallest scale of deviations of the mean gap, over the rms height. Near full contact a deviation relative to the
/// mean gap itself is meaningless: such values reached 1e4. The challenge's mean gap falls below this scale between p*
/// = 0.14 and 1.
const NARROW: f64 = 0.01;

impl Roughness {
    pub(super) fn of(case: &Case) -> Self {
        let (length, modulus) = (case.scales.length_m, case.scales.modulus_pa);
        let height = case.surface().rms_height() * length;
        Roughness { stress: case.gradient * modulus, height, map_unit: length }
    }

    /// Scale of deviations of gaps, m.
    fn gap(self, mean_gap: f64) -> f64 {
        mean_gap.abs().max(NARROW * self.height)
    }

    /// Scale of deviations of a quantity with this value.
    fn number(self, quantity: Quantity, value: f64) -> f64 {
        if quantity == Quantity::MeanGap { self.gap(value) } else { value.abs() }
    }
}

/// Errors of the maps of a load, evaluated before the maps are deleted.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct MapErrors {
    gap: Option<f64>,
    contact: Option<f64>,
}

/// Contact map of a state: that of the method, or, for a solver, the nodes at zero gap.
fn contact(root: &Path, kind: MethodKind, state: &State) -> Result<Option<npy::NpyMap<f64>>> {
    if let Some(file) = state.contact_file() {
        return npy::read(&root.join(file)).map(Some);
    }
    // Gaps of estimators may be those of undeformed bodies, whose overlap is not the contact.
    let Some(file) = state.gap_file().filter(|_| kind == MethodKind::Solver) else { return Ok(None) };
    let mut map = npy::read(&root.join(file))?;
    map.values.iter_mut().for_each(|g| *g = f64::from(u8::from(*g <= 0.0)));
    Ok(Some(map))
}

/// Errors of the maps of a state relative to the reference solution, if both have maps. `kind`: kind of the method. A
/// block of atoms (`is_block`) has its own grid, and the reference is interpolated to its nodes.
pub(super) fn maps(
    root: &Path,
    (kind, is_block): (MethodKind, bool),
    state: &State,
    reference: &State,
    rough: Roughness,
) -> Result<MapErrors> {
    let on_nodes = |map: npy::NpyMap<f64>, grid_of: &npy::NpyMap<f64>, nearest: bool| match is_block {
        true => at_nodes_of(&map, grid_of.nx, grid_of.ny, nearest),
        false => map,
    };
    let gap = match (state.gap_file(), reference.gap_file(), reference.mean_gap) {
        (Some(a), Some(b), Some(mean_gap)) => {
            let a = npy::read(&root.join(a))?;
            map_l2(&a, &on_nodes(npy::read(&root.join(b))?, &a, false), rough.gap(mean_gap) / rough.map_unit)
        }
        _ => None,
    };
    let contact = match (contact(root, kind, state)?, contact(root, MethodKind::Solver, reference)?) {
        (Some(a), Some(b)) => map_mismatch(&a, &on_nodes(b, &a, true)),
        _ => None,
    };
    Ok(MapErrors { gap, contact })
}

fn number(state: &State, quantity: Quantity) -> Option<f64> {
    match quantity {
        Quantity::ContactArea => Some(state.contact_area),
        Quantity::MeanGap => state.mean_gap,
        Quantity::Stiffness => state.stiffness,
        _ => None,
    }
}

/// Share of the excess of counted nodes that counts as uncertainty of a reference's area, at least.
const EDGES: f64 = 1.0 / 3.0;

/// Numbers of the reference at each load, extrapolated from its grids (`levels`, coarse to fine).
pub(super) fn numbers(levels: &[&[State]]) -> Vec<ReferenceLoad> {
    let finest = levels.last().copied().unwrap_or_default();
    let numbers_at = |(i, state): (usize, &State)| {
        let mut numbers = BTreeMap::new();
        for quantity in Quantity::NUMBERS {
            let values: Option<Vec<f64>> =
                levels.iter().map(|states| states.get(i).and_then(|s| number(s, quantity))).collect();
            // Without a value on every coarser grid, the finest grid is used alone.
            let values = values.unwrap_or_else(|| number(state, quantity).into_iter().collect());
            if let Some(mut extrapolation) = richardson(&values) {
                let area = state.contact_area;
                if let Some(u) = extrapolation.uncertainty.as_mut().filter(|_| quantity == Quantity::ContactArea) {
                    *u = u.max(EDGES * (state.contact_nodes.unwrap_or(area) - area).abs());
                }
                numbers.insert(quantity, extrapolation);
            }
        }
        ReferenceLoad { p_star: state.p_star, numbers }
    };
    finest.iter().enumerate().map(numbers_at).collect()
}

/// Errors at each load. `maps`: errors of the maps relative to the same reference.
pub(super) fn errors(
    (found, maps): (&[State], &[MapErrors]),
    reference: &[State],
    numbers: &[ReferenceLoad],
    rough: Roughness,
) -> Vec<LoadErrors> {
    let states = found.iter().zip(reference).zip(numbers);
    states
        .enumerate()
        .map(|(i, ((state, reference), load))| LoadErrors {
            p_star: reference.p_star,
            errors: of_load(state, reference, &load.numbers, maps.get(i).copied().unwrap_or_default(), rough),
        })
        .collect()
}

fn of_load(
    state: &State,
    reference: &State,
    numbers: &BTreeMap<Quantity, Extrapolation>,
    maps: MapErrors,
    rough: Roughness,
) -> Errors {
    let seen = || state.observed.as_ref().zip(reference.observed.as_ref());
    let distance = |of: fn(&Observed) -> Option<&Distribution>, lowest: Option<f64>, scale: f64| {
        let (a, b) = seen()?;
        Some(wasserstein(&Masses::of(of(a)?, lowest), &Masses::of(of(b)?, lowest))? / scale)
    };
    let error_of = |quantity: Quantity| match quantity {
        Quantity::ContactArea | Quantity::MeanGap | Quantity::Stiffness => {
            let (value, reference) = (number(state, quantity)?, numbers.get(&quantity)?.value);
            Some((value - reference).abs() / rough.number(quantity, reference))
        }
        Quantity::GapMap => maps.gap,
        Quantity::ContactMap => maps.contact,
        Quantity::GapPdf => distance(|o| o.gap_logarithmic.as_ref(), Some(0.0), rough.gap(reference.mean_gap?)),
        Quantity::StressPdf => distance(|o| o.stress.as_ref(), None, rough.stress),
        Quantity::ClusterArea => {
            let (a, b) = seen()?;
            wasserstein(&Masses::of_clusters(&a.cluster_area), &Masses::of_clusters(&b.cluster_area))
        }
        Quantity::MedianClusterArea => {
            let (a, b) = seen()?;
            decades(a.median_cluster_area?, b.median_cluster_area?)
        }
        Quantity::StressMap | Quantity::ClusterPdf => None,
    };
    let finite = |m: Quantity| error_of(m).filter(|e| e.is_finite()).map(|e| (m, e));
    Quantity::COMPARED.into_iter().filter_map(finite).collect()
}

/// Root mean square over the loads with a value.
pub(super) fn over_loads(loads: &[LoadErrors]) -> Errors {
    let at_loads = |m: Quantity| loads.iter().filter_map(|l| l.errors.get(&m).copied()).collect::<Vec<_>>();
    let rms_of = |m: Quantity| rms(&at_loads(m)).map(|e| (m, e));
    Quantity::COMPARED.into_iter().filter_map(rms_of).collect()
}

/// Relative uncertainty of the reference at each load. For numbers it is that of the extrapolation. For maps and
/// distributions it is estimated from the errors of the grids with 1/2 and 1/4 of the points per side (`coarser`, in
/// this order).
pub(super) fn uncertainty(numbers: &[ReferenceLoad], coarser: &[Vec<LoadErrors>], rough: Roughness) -> Vec<LoadErrors> {
    let errors_at = |(i, load): (usize, &ReferenceLoad)| {
        let error = |grid: usize, m: Quantity| coarser.get(grid)?.get(i)?.errors.get(&m).copied();
        let relative = |m: Quantity| match load.numbers.get(&m) {
            Some(n) => Some(n.uncertainty?.abs() / rough.number(m, n.value)),
            None => error(0, m).map(|half| finest_error(error(1, m), half)),
        };
        let known = |m: Quantity| relative(m).filter(|e| e.is_finite()).map(|e| (m, e));
        LoadErrors { p_star: load.p_star, errors: Quantity::COMPARED.into_iter().filter_map(known).collect() }
    };
    numbers.iter().enumerate().map(errors_at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Near full contact, deviations of the mean gap are relative to the rms height. Deviations of areas and larger
    /// gaps are relative to their own values.
    #[test]
    fn deviations_of_closed_gaps_are_relative_to_the_roughness() {
        let rough = Roughness { stress: 1.0, height: 0.02, map_unit: 1.0 };
        assert_eq!(rough.number(Quantity::MeanGap, 0.01), 0.01);
        assert_eq!(rough.number(Quantity::MeanGap, 1e-9), NARROW * 0.02);
        assert_eq!(rough.number(Quantity::ContactArea, 1e-9), 1e-9);
        assert_eq!(rough.number(Quantity::Stiffness, -2.0), 2.0);
    }
}
