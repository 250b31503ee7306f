//! Errors of a setting relative to the reference.

use crate::Result;
use crate::compare::accuracy::{
    Masses, at_nodes_of, decades, finest_error, map_l2, map_mismatch, richardson, rms, wasserstein,
};
use crate::record::methods::MethodState;
use crate::record::tradeoff::{Errors, Extrapolation, LoadErrors, ReferenceLoad};
use crate::scene::Case;
use asperity_contact::method::MethodKind;
use asperity_contact::observe::Distribution;
use asperity_contact::quantity::Quantity;
use asperity_surface::files::npy;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Scales of the surface that make deviations relative.
#[derive(Debug, Clone, Copy)]
pub(super) struct Roughness {
    /// rms gradient.
    pub gradient: f64,
    /// rms height, units of L.
    pub height: f64,
}

/// Smallest scale of deviations of the mean gap, over the rms height. Near full contact a deviation relative to the
/// mean gap itself is meaningless: such values reached 1e4. The challenge's mean gap falls below this scale between p*
/// = 0.14 and 1.
const NARROW: f64 = 0.01;

impl Roughness {
    pub(super) fn of(case: &Case) -> Self {
        Roughness { gradient: case.gradient, height: case.surface().rms_height() }
    }

    /// Scale of deviations of gaps, units of L.
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
fn contact(root: &Path, kind: MethodKind, state: &MethodState) -> Result<Option<npy::NpyMap<f64>>> {
    if let Some(file) = &state.contact_map {
        return npy::read(&root.join(file)).map(Some);
    }
    // Gaps of estimators may be those of undeformed bodies, whose overlap is not the contact.
    let Some(file) = state.numbers.gap_map.as_ref().filter(|_| kind == MethodKind::Solver) else { return Ok(None) };
    let mut map = npy::read(&root.join(file))?;
    map.values.iter_mut().for_each(|g| *g = f64::from(u8::from(*g <= 0.0)));
    Ok(Some(map))
}

/// Errors of the maps of a state relative to the reference solution, if both have maps. `kind`: kind of the method. A
/// block of atoms (`is_block`) has its own grid, and the reference is interpolated to its nodes.
pub(super) fn maps(
    root: &Path,
    (kind, is_block): (MethodKind, bool),
    found: &MethodState,
    reference: &MethodState,
    rough: Roughness,
) -> Result<MapErrors> {
    let on_nodes = |map: npy::NpyMap<f64>, of: &npy::NpyMap<f64>, nearest: bool| match is_block {
        true => at_nodes_of(&map, of.nx, of.ny, nearest),
        false => map,
    };
    let gap = match (&found.numbers.gap_map, &reference.numbers.gap_map, reference.mean_gap) {
        (Some(a), Some(b), Some(mean_gap)) => {
            let a = npy::read(&root.join(a))?;
            map_l2(&a, &on_nodes(npy::read(&root.join(b))?, &a, false), rough.gap(mean_gap))
        }
        _ => None,
    };
    let contact = match (contact(root, kind, found)?, contact(root, MethodKind::Solver, reference)?) {
        (Some(a), Some(b)) => map_mismatch(&a, &on_nodes(b, &a, true)),
        _ => None,
    };
    Ok(MapErrors { gap, contact })
}

fn number(state: &MethodState, quantity: Quantity) -> Option<f64> {
    match quantity {
        Quantity::ContactArea => Some(state.numbers.contact_area),
        Quantity::MeanGap => state.mean_gap,
        Quantity::Stiffness => state.numbers.stiffness,
        _ => None,
    }
}

/// Share of the excess of counted nodes that counts as uncertainty of a reference's area, at least.
const EDGES: f64 = 1.0 / 3.0;

/// Numbers of the reference at each load, extrapolated from its grids (`levels`, coarse to fine).
pub(super) fn numbers(levels: &[&[MethodState]]) -> Vec<ReferenceLoad> {
    let finest = levels.last().copied().unwrap_or_default();
    let value_of = |(i, state): (usize, &MethodState)| {
        let mut numbers = BTreeMap::new();
        for quantity in Quantity::NUMBERS {
            let values: Option<Vec<f64>> =
                levels.iter().map(|states| states.get(i).and_then(|s| number(s, quantity))).collect();
            // Without a value on every coarser grid, the finest grid is used alone.
            let values = values.unwrap_or_else(|| number(state, quantity).into_iter().collect());
            if let Some(mut extrapolation) = richardson(&values) {
                let area = state.numbers.contact_area;
                if let Some(u) = extrapolation.uncertainty.as_mut().filter(|_| quantity == Quantity::ContactArea) {
                    *u = u.max(EDGES * (state.contact_nodes.unwrap_or(area) - area).abs());
                }
                numbers.insert(quantity, extrapolation);
            }
        }
        ReferenceLoad { p_star: state.numbers.p_star, numbers }
    };
    finest.iter().enumerate().map(value_of).collect()
}

/// Errors at each load. `maps`: errors of the maps relative to the same reference.
pub(super) fn errors(
    (found, maps): (&[MethodState], &[MapErrors]),
    reference: &[MethodState],
    numbers: &[ReferenceLoad],
    rough: Roughness,
) -> Vec<LoadErrors> {
    let states = found.iter().zip(reference).zip(numbers);
    states
        .enumerate()
        .map(|(i, ((state, reference), load))| LoadErrors {
            p_star: reference.numbers.p_star,
            errors: of_load(state, reference, &load.numbers, maps.get(i).copied().unwrap_or_default(), rough),
        })
        .collect()
}

fn of_load(
    state: &MethodState,
    reference: &MethodState,
    numbers: &BTreeMap<Quantity, Extrapolation>,
    maps: MapErrors,
    rough: Roughness,
) -> Errors {
    let distance = |a: &Option<Distribution>, b: &Option<Distribution>, lowest: Option<f64>, scale: f64| {
        let moved = wasserstein(&Masses::of(a.as_ref()?, lowest), &Masses::of(b.as_ref()?, lowest))?;
        Some(moved / scale)
    };
    let value_of = |quantity: Quantity| match quantity {
        Quantity::ContactArea | Quantity::MeanGap | Quantity::Stiffness => {
            let (value, reference) = (number(state, quantity)?, numbers.get(&quantity)?.value);
            Some((value - reference).abs() / rough.number(quantity, reference))
        }
        Quantity::GapMap => maps.gap,
        Quantity::ContactMap => maps.contact,
        Quantity::GapPdf => distance(&state.gap, &reference.gap, Some(0.0), rough.gap(reference.mean_gap?)),
        Quantity::StressPdf => distance(&state.stress, &reference.stress, None, rough.gradient),
        Quantity::PatchArea => {
            wasserstein(&Masses::of_patches(&state.patch_area), &Masses::of_patches(&reference.patch_area))
        }
        Quantity::MedianClusterArea => decades(state.median_cluster_area?, reference.median_cluster_area?),
        Quantity::StressMap | Quantity::PatchPdf => None,
    };
    let finite = |m: Quantity| value_of(m).filter(|e| e.is_finite()).map(|e| (m, e));
    Quantity::COMPARED.into_iter().filter_map(finite).collect()
}

/// Root mean square over the loads with a value.
pub(super) fn over_loads(loads: &[LoadErrors]) -> Errors {
    let at_loads = |m: Quantity| loads.iter().filter_map(|l| l.errors.get(&m).copied()).collect::<Vec<_>>();
    let total = |m: Quantity| rms(&at_loads(m)).map(|e| (m, e));
    Quantity::COMPARED.into_iter().filter_map(total).collect()
}

/// Relative uncertainty of the reference at each load. For numbers it is that of the extrapolation. For maps and
/// distributions it is estimated from the errors of the grids with 1/2 and 1/4 of the points per side (`coarser`, in
/// this order).
pub(super) fn uncertainty(numbers: &[ReferenceLoad], coarser: &[Vec<LoadErrors>], rough: Roughness) -> Vec<LoadErrors> {
    let value_of = |(i, load): (usize, &ReferenceLoad)| {
        let error = |grid: usize, m: Quantity| coarser.get(grid)?.get(i)?.errors.get(&m).copied();
        let relative = |m: Quantity| match load.numbers.get(&m) {
            Some(n) => Some(n.uncertainty?.abs() / rough.number(m, n.value)),
            None => error(0, m).map(|half| finest_error(error(1, m), half)),
        };
        let known = |m: Quantity| relative(m).filter(|e| e.is_finite()).map(|e| (m, e));
        LoadErrors { p_star: load.p_star, errors: Quantity::COMPARED.into_iter().filter_map(known).collect() }
    };
    numbers.iter().enumerate().map(value_of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Near full contact, deviations of the mean gap are relative to the rms height. Deviations of areas and larger
    /// gaps are relative to their own values.
    #[test]
    fn deviations_of_closed_gaps_are_relative_to_the_roughness() {
        let rough = Roughness { gradient: 1.0, height: 0.02 };
        assert_eq!(rough.number(Quantity::MeanGap, 0.01), 0.01);
        assert_eq!(rough.number(Quantity::MeanGap, 1e-9), NARROW * 0.02);
        assert_eq!(rough.number(Quantity::ContactArea, 1e-9), 1e-9);
        assert_eq!(rough.number(Quantity::Stiffness, -2.0), 2.0);
    }
}
