use std::f64::consts::PI;

/// What the periodic images of a point load add to its own displacement `F/(πE*r)`, the mean of all being zero: the part of
/// the periodic half-space's response that closed forms of a single load lack. `[ny, nx]` cells repeat on extents lx by ly.
///
/// Ewald's sum of `1/r` in two dimensions (long waves `2π erfc(q/2α)/q`), tabulated on a quarter of the cell, in which it
/// is smooth, and read linearly.
#[derive(Debug, Clone)]
pub struct Images {
    lx: f64,
    ly: f64,
    table: Vec<f64>,
}

impl Images {
    /// Intervals of the table along each axis: read between its points it is off by 1e-4 of the interaction over half a
    /// cell.
    const INTERVALS: usize = 64;

    pub fn new(lx: f64, ly: f64) -> Self {
        let n = Self::INTERVALS;
        let place = |k: usize, l: f64| 0.5 * l * k as f64 / n as f64;
        let table = (0..(n + 1) * (n + 1)).map(|k| response(lx, ly, place(k % (n + 1), lx), place(k / (n + 1), ly)));
        Images { lx, ly, table: table.collect() }
    }

    /// Shortest way between two places of the cell.
    #[inline]
    pub fn shortest(&self, (dx, dy): (f64, f64)) -> (f64, f64) {
        (dx - self.lx * (dx / self.lx).round(), dy - self.ly * (dy / self.ly).round())
    }

    /// Displacement by the images of a unit load, at the shortest way from it.
    #[inline]
    pub fn displacement(&self, (dx, dy): (f64, f64)) -> f64 {
        let n = Self::INTERVALS;
        let (u, v) = (2.0 * n as f64 * dx.abs() / self.lx, 2.0 * n as f64 * dy.abs() / self.ly);
        let (i, j) = ((u as usize).min(n - 1), (v as usize).min(n - 1));
        let (fx, fy) = (u - i as f64, v - j as f64);
        let at = |i: usize, j: usize| self.table[j * (n + 1) + i];
        (1.0 - fy) * ((1.0 - fx) * at(i, j) + fx * at(i + 1, j))
            + fy * ((1.0 - fx) * at(i, j + 1) + fx * at(i + 1, j + 1))
    }
}

/// The whole periodic response less `1/(πr)`.
fn response(lx: f64, ly: f64, x: f64, y: f64) -> f64 {
    /// erfc is below 1e-16 from here on.
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

    /// The square lattice's constant at the load, and symmetry.
    #[test]
    fn a_square_lattice_of_loads() {
        let images = Images::new(1.0, 1.0);
        assert!((images.displacement((0.0, 0.0)) * PI + 3.900_264_92).abs() < 1e-7);
        assert_eq!(images.displacement((0.2, -0.4)), images.displacement((-0.2, 0.4)));
        // Two cells side by side are one of twice the length with two loads.
        let double = |x: f64, y: f64| {
            response(2.0, 1.0, x, y) + response(2.0, 1.0, 1.0 - x, y) + 1.0 / (PI * (1.0 - x).hypot(y))
        };
        for (x, y) in [(0.1, 0.0), (0.3, 0.2), (0.0, 0.5)] {
            assert!((double(x, y) - response(1.0, 1.0, x, y)).abs() < 1e-12, "{x} {y}");
            assert!((images.displacement((x, y)) - response(1.0, 1.0, x, y)).abs() < 1e-3, "{x} {y}");
        }
    }

    /// Against the sum over waves of a smooth load, a Gaussian narrow beside the distance: the same away from it.
    #[test]
    fn waves_add_up_to_it() {
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
        let exact = 1.0 / (PI * f64::hypot(x, y)) + response(1.0, 1.0, x, y);
        // The Gaussian's own width shows in the second order, σ²/(2πr³).
        assert!((sum - exact).abs() < 4e-3, "{sum} {exact}");
    }
}
