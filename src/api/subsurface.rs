//! Stress below the surface of an isotropic body, from the pressure `[ny, nx]` on it.

use super::arrays::{grid_of, map, row_major};
use crate::{Error, Result};
use asperity_contact::interface::{Elastic, Layer, NonPeriodic, Subsurface, SubsurfaceRequest};
use asperity_contact::path;
use asperity_contact::problem::Body;
use asperity_grid::Field;
use asperity_grid::sys::expect_memory;
use asperity_surface::Cell;
use ndarray::{Array2, ArrayView2};

/// Named in errors.
const PLACE: &str = "subsurface";

/// Stresses at a depth, in the unit of the pressure.
#[derive(Debug, Clone, PartialEq)]
pub struct SubsurfaceStress {
    /// Depth, in the unit of the cell.
    pub depth: f64,
    /// Equivalent stress after von Mises.
    pub von_mises: StressMap,
    /// Largest shear stress: half the difference of the largest and the smallest principal stress.
    pub shear: StressMap,
}

/// A stress at all nodes of a depth, and its maximum.
#[derive(Debug, Clone, PartialEq)]
pub struct StressMap {
    /// Values `[ny, nx]`.
    pub values: Array2<f64>,
    /// The largest of them.
    pub max: f64,
    /// Where it is, along x and along y, in the unit of the cell.
    pub at: [f64; 2],
}

/// Stresses below a pressure `[ny, nx]` (compression positive) at `depths` from 0 to the thickness of the body, in the unit of
/// the cell. `poisson` is that of a half-space; a layer has its own. The mean strain along a periodic surface is zero, as in
/// Westergaard, J. Appl. Mech. 6 (1939) A49; below a surface that is not periodic each node is a rectangle under uniform pressure.
///
/// # Errors
/// `Input` for a depth outside of the body, a Poisson's ratio outside of 0 to 0.5, and a crystal; `Memory`.
///
/// ```
/// use asperity::{Body, Cell, subsurface};
/// use ndarray::Array2;
/// use std::f64::consts::TAU;
///
/// // Below p cos(qx) the stresses across the surface and along x are -p (1 + qz) e^(-qz) and -p (1 - qz) e^(-qz): the largest
/// // shear stress, p qz e^(-qz) below the crest, peaks at qz = 1.
/// let pressure = Array2::from_shape_fn((16, 16), |(_, x)| (TAU * x as f64 / 16.0).cos());
/// let cell = Cell { x: 1.0, y: 1.0 };
/// let found = subsurface(pressure.view(), cell, Body::HalfSpace, &[1.0 / TAU], Some(0.3))?;
/// assert!((found[0].shear.max - (-1.0_f64).exp()).abs() < 1e-12);
/// # Ok::<(), asperity::Error>(())
/// ```
pub fn subsurface(
    pressure: ArrayView2<f64>,
    cell: Cell,
    body: Body,
    depths: &[f64],
    poisson: Option<f64>,
) -> Result<Vec<SubsurfaceStress>> {
    let grid = grid_of(cell, &pressure);
    let kernel = match body {
        Body::HalfSpace => Elastic::HalfSpace,
        Body::Layer { thickness, poisson, base } => {
            Elastic::Layer(Layer { thickness: thickness / cell.x, poisson, base })
        }
        Body::NonPeriodic => Elastic::NonPeriodic(NonPeriodic::of_region(grid.lx, grid.ly)),
        Body::Cubic { .. } => return Err(Error::input(PLACE, "body", "a cubic crystal", path::ISOTROPIC)),
    };
    let poisson = poisson_of(body, poisson)?;
    let reduced = depths.iter().map(|&depth| depth_in(body, cell, depth)).collect::<Result<_>>()?;
    if pressure.is_empty() || pressure.iter().any(|p| !p.is_finite()) {
        let found = format!("an array of {:?} with values that are not finite, or none", pressure.dim());
        return Err(Error::input(PLACE, "pressure", found, "finite pressures [ny, nx]"));
    }
    let kept = (2 * depths.len() * size_of::<f64>() * grid.points()) as u64;
    expect_memory(PLACE.into(), Subsurface::bytes(grid, kernel) + kept, "fewer depths or nodes need less")?;
    let request = SubsurfaceRequest { depths: reduced, poisson, shear_strength: None };
    let pressure = row_major(pressure);
    let mut maps = Vec::new();
    let results = path::subsurface(&request, (grid, kernel), Field::F64(&pressure), |_, _, values| {
        maps.push(map(grid, values.to_vec()));
        Ok(None)
    })?;
    let mut maps = maps.into_iter();
    let slices = results.slices.into_iter().zip(depths).map(|(slice, &depth)| {
        let [von_mises, shear] = [slice.von_mises, slice.shear].map(|peak| StressMap {
            values: maps.next().expect("a map of each quantity and depth"),
            max: peak.value,
            at: [peak.x * cell.x, peak.y * cell.x],
        });
        SubsurfaceStress { depth, von_mises, shear }
    });
    Ok(slices.collect())
}

fn poisson_of(body: Body, value: Option<f64>) -> Result<f64> {
    let refused = |found: String, accepted: String| Err(Error::input(PLACE, "poisson", found, accepted));
    match (body, value) {
        (Body::Layer { poisson, .. }, None) => Ok(poisson),
        (Body::Layer { poisson, .. }, Some(nu)) => refused(nu.to_string(), format!("none: the layer's own, {poisson}")),
        (_, Some(nu)) if (0.0..=0.5).contains(&nu) => Ok(nu),
        (_, Some(nu)) => refused(nu.to_string(), "a Poisson's ratio from 0 to 0.5".into()),
        (_, None) => refused("not given".into(), "the Poisson's ratio of the half-space".into()),
    }
}

/// A depth over the extent of the cell.
fn depth_in(body: Body, cell: Cell, depth: f64) -> Result<f64> {
    let largest = if let Body::Layer { thickness, .. } = body { thickness } else { f64::MAX };
    if (0.0..=largest).contains(&depth) {
        // Rounding does not take it out of the layer.
        return Ok((depth / cell.x).min(largest / cell.x));
    }
    let accepted = match body {
        Body::Layer { .. } => format!("depths from 0 to {largest}, the thickness of the layer"),
        _ => "finite depths from 0 on".into(),
    };
    Err(Error::input(PLACE, "depths", depth, accepted))
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_contact::interface::Base;

    #[test]
    fn values_outside_of_the_body_are_refused() {
        let pressure = Array2::from_elem((8, 8), 1.0);
        let layer = Body::Layer { thickness: 2.0, poisson: 0.2, base: Base::Bonded };
        let crystal = Body::Cubic { c11: 2.0, c12: 1.0, c44: 1.0 };
        for (body, depth, poisson, words) in [
            (Body::HalfSpace, -1.0, Some(0.3), "depths = -1"),
            (Body::HalfSpace, f64::NAN, Some(0.3), "depths = NaN"),
            (Body::HalfSpace, f64::INFINITY, Some(0.3), "finite depths"),
            (Body::HalfSpace, 1.0, None, "poisson = not given"),
            (Body::NonPeriodic, 1.0, Some(0.6), "poisson = 0.6"),
            (layer, 2.5, None, "0 to 2"),
            (layer, 1.0, Some(0.2), "the layer's own, 0.2"),
            (crystal, 1.0, Some(0.2), "an isotropic body"),
        ] {
            let cell = Cell { x: 4.0, y: 4.0 };
            let error = subsurface(pressure.view(), cell, body, &[depth], poisson).expect_err(words).to_string();
            assert!(error.contains(words), "{error}");
        }
    }

    /// A cell of another extent and aspect: depth and position have its unit, also at the base of a layer.
    #[test]
    fn lengths_have_the_unit_of_the_cell() {
        let mut pressure = Array2::zeros((16, 32));
        pressure[(5, 9)] = 1.0;
        let layer = Body::Layer { thickness: 0.3, poisson: 0.2, base: Base::Bonded };
        let slices_at = |scale: f64| {
            let body = match layer {
                Body::Layer { thickness, poisson, base } => Body::Layer { thickness: thickness * scale, poisson, base },
                other => other,
            };
            let cell = Cell { x: scale, y: scale / 2.0 };
            subsurface(pressure.view(), cell, body, &[0.1 * scale, 0.3 * scale], None).expect("within the layer")
        };
        let (one, seven) = (slices_at(1.0), slices_at(7.0));
        for (a, b) in one.iter().zip(&seven) {
            for (a, b) in [(&a.von_mises, &b.von_mises), (&a.shear, &b.shear)] {
                let difference = (&a.values - &b.values).mapv(f64::abs);
                // Rounding of the scaled lengths.
                assert!(difference.iter().all(|d| *d < 1e-13 * a.max), "{difference:?}");
                assert!(a.max == a.values.iter().copied().fold(0.0, f64::max));
            }
        }
        let peak = &seven[0].von_mises;
        assert_eq!(peak.at, [9.0 / 32.0 * 7.0, 5.0 / 32.0 * 7.0]);
        assert_eq!((seven[1].depth, peak.values[(5, 9)]), (0.3 * 7.0, peak.max));
    }
}
