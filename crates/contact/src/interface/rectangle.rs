//! Stress in a half-space under a uniform pressure on a rectangle (Love, Phil. Trans. R. Soc. A 228 (1929) 377).
//!
//! With the potentials `V = ∫∫ dA/r` and `χ = ∫∫ ln(z + r) dA` of the rectangle, z the depth,
//!
//! ```text
//! 2π σx = 2ν ∂V/∂z - (1-2ν) ∂²χ/∂x² - z ∂²V/∂x²      2π τxy = -(1-2ν) ∂²χ/∂x∂y - z ∂²V/∂x∂y
//! 2π σz = ∂V/∂z - z ∂²V/∂z²                           2π τxz = -z ∂²V/∂x∂z
//! ```
//!
//! in units of the pressure, and likewise for y. Each derivative is a sum over the corners.

use std::f64::consts::TAU;

/// Stresses xx, yy, zz, xy, xz, yz (tension positive, z the depth) at the distance `(x, y)` from the centre of a rectangle
/// of extents `dx` by `dy` under a unit pressure.
pub(super) fn stresses(poisson: f64, [x, y, z]: [f64; 3], [dx, dy]: [f64; 2]) -> [f64; 6] {
    let mut sums = [0.0; 6];
    for (sign_x, sign_y) in [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)] {
        let corner = at_corner(poisson, x + 0.5 * sign_x * dx, y + 0.5 * sign_y * dy, z);
        sums.iter_mut().zip(corner).for_each(|(sum, value)| *sum += sign_x * sign_y * value / TAU);
    }
    sums
}

fn at_corner(poisson: f64, x: f64, y: f64, z: f64) -> [f64; 6] {
    let (xz, yz) = (x * x + z * z, y * y + z * z);
    let r = (x * x + yz).sqrt();
    let slope = -(x * y).atan2(z * r);
    let chi = |a: f64, b: f64| (b / a).atan() - (z * b / (a * r)).atan();
    // z times the second derivatives of V, without those along z alone.
    let (v_xx, v_yy) = (-z * x * y / (r * xz), -z * x * y / (r * yz));
    let shear = 1.0 - 2.0 * poisson;
    [
        2.0 * poisson * slope - shear * chi(x, y) - v_xx,
        2.0 * poisson * slope - shear * chi(y, x) - v_yy,
        slope + v_xx + v_yy,
        -shear * (z + r).ln() - z / r,
        z * z * y / (r * xz),
        z * z * x / (r * yz),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    const POISSON: f64 = 0.3;

    fn at(x: f64, y: f64, z: f64) -> [f64; 6] {
        stresses(POISSON, [x, y, z], [0.4, 0.7])
    }

    /// Pressure under the rectangle, none outside it; no shear on the surface.
    #[test]
    fn the_surface_is_loaded_by_the_pressure() {
        for (x, y, pressure) in [(0.1, -0.3, 1.0), (0.0, 0.0, 1.0), (0.5, 0.1, 0.0), (-0.3, 1.0, 0.0)] {
            let [_, _, zz, _, xz, yz] = at(x, y, 0.0);
            assert!((zz + pressure).abs() < 1e-15 && xz == 0.0 && yz == 0.0, "{x} {y}: {zz}");
        }
    }

    /// The stresses are in equilibrium, their trace is harmonic, and a plane carries the load.
    #[test]
    fn the_body_is_in_equilibrium() {
        /// Central differences with this step: third derivatives of some 300 at a distance of 0.15 from the edges give 5e-7.
        const STEP: f64 = 1e-4;
        const DIFFERENCES: f64 = 1e-6;
        /// Second differences: fourth derivatives of some thousands, and 1e-7 of rounding.
        const SECOND_DIFFERENCES: f64 = 1e-5;
        for point in [[0.3, 0.2, 0.15], [-0.1, 0.5, 0.3], [0.9, -0.4, 0.5]] {
            let moved = |axis: usize, by: f64| {
                let mut p = point;
                p[axis] += by;
                at(p[0], p[1], p[2])
            };
            let slope = |axis: usize, k: usize| (moved(axis, STEP)[k] - moved(axis, -STEP)[k]) / (2.0 * STEP);
            for [a, b, c] in [[0, 3, 4], [3, 1, 5], [4, 5, 2]] {
                let sum = slope(0, a) + slope(1, b) + slope(2, c);
                assert!(sum.abs() < DIFFERENCES, "{point:?}: {sum}");
            }
            let trace = |s: [f64; 6]| s[0] + s[1] + s[2];
            let bend = |axis: usize| {
                (trace(moved(axis, STEP)) + trace(moved(axis, -STEP)) - 2.0 * trace(moved(axis, 0.0))) / STEP.powi(2)
            };
            assert!((bend(0) + bend(1) + bend(2)).abs() < SECOND_DIFFERENCES, "{point:?}");
        }
        // Far below it is a point force: σz = -3F/2πz² on the axis.
        let far = at(0.0, 0.0, 40.0)[2] / (-1.5 * 0.28 / std::f64::consts::PI / 1600.0);
        assert!((far - 1.0).abs() < 1e-3, "{far}");
    }
}
