//! Displacement by the periodic images of a load.

use std::f64::consts::PI;

/// Displacement by the periodic images of a unit load at the position (x, y) from it, without its own `1/(πE*r)`; the
/// mean of the total is zero. The cell is lx by ly; E* = 1.
///
/// Ewald summation of `1/r` in two dimensions to rounding, with the long waves `2π erfc(q/2α)/q`, for single
/// positions and as the reference for [`super::ewald`].
pub(super) fn images(lx: f64, ly: f64, (x, y): (f64, f64)) -> f64 {
    /// erfc is below 1e-16 beyond this argument.
    const NEGLIGIBLE: f64 = 6.0;
    let area = lx * ly;
    let alpha = (PI / area).sqrt();
    let r = x.hypot(y);
    // The load itself: erfc(αr)/r - 1/r.
    let mut near = if r == 0.0 { -2.0 * alpha / PI.sqrt() } else { -libm::erf(alpha * r) / r };
    let reach = |l: f64| (NEGLIGIBLE / (alpha * l)).ceil() as i64 + 1;
    for n in -reach(ly)..=reach(ly) {
        for m in -reach(lx)..=reach(lx) {
            if (m, n) != (0, 0) {
                let d = (x + m as f64 * lx).hypot(y + n as f64 * ly);
                near += libm::erfc(alpha * d) / d;
            }
        }
    }
    near -= 2.0 * PI.sqrt() / (alpha * area);
    let (qx, qy) = (2.0 * PI / lx, 2.0 * PI / ly);
    let modes = |q: f64| (2.0 * alpha * NEGLIGIBLE / q).ceil() as i64;
    let mut far = 0.0;
    for n in -modes(qy)..=modes(qy) {
        for m in -modes(qx)..=modes(qx) {
            if (m, n) != (0, 0) {
                let (kx, ky) = (qx * m as f64, qy * n as f64);
                let q = kx.hypot(ky);
                far += 2.0 / (q * area) * libm::erfc(0.5 * q / alpha) * (kx * x + ky * y).cos();
            }
        }
    }
    near / PI + far
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lattice constant of the square lattice, symmetry, and a doubled cell.
    #[test]
    fn square_lattice_of_loads() {
        let unit = |x: f64, y: f64| images(1.0, 1.0, (x, y));
        assert!((unit(0.0, 0.0) * PI + 3.900_264_92).abs() < 1e-7);
        assert!((unit(0.2, -0.4) - unit(-0.2, 0.4)).abs() < 1e-14);
        // Two adjacent cells equal one of twice the length with two loads.
        let double = |x: f64, y: f64| {
            images(2.0, 1.0, (x, y)) + images(2.0, 1.0, (1.0 - x, y)) + 1.0 / (PI * (1.0 - x).hypot(y))
        };
        for (x, y) in [(0.1, 0.0), (0.3, 0.2), (0.0, 0.5)] {
            assert!((double(x, y) - unit(x, y)).abs() < 1e-12, "{x} {y}");
        }
    }

    /// Comparison with the Fourier sum for a Gaussian load that is narrow compared with the distance.
    #[test]
    fn images_equal_the_fourier_sum() {
        let width: f64 = 0.02;
        let (x, y) = (0.3, 0.1);
        let mut sum = 0.0;
        for m in -60..=60 {
            for n in -60..=60 {
                if (m, n) != (0, 0) {
                    let (kx, ky) = (2.0 * PI * f64::from(m), 2.0 * PI * f64::from(n));
                    let q = kx.hypot(ky);
                    sum += 2.0 / q * (-0.5 * (q * width).powi(2)).exp() * (kx * x + ky * y).cos();
                }
            }
        }
        let exact = 1.0 / (PI * f64::hypot(x, y)) + images(1.0, 1.0, (x, y));
        // The width of the Gaussian contributes σ²/(2πr³).
        assert!((sum - exact).abs() < 4e-3, "{sum} {exact}");
    }
}
