//! Half-space loaded on a finite area, without periodic images.

use super::Kernel;
use super::kernel::length;
use std::sync::OnceLock;

/// Half-space loaded on a rectangle, solved in a periodic cell that contains the rectangle and padding.
///
/// The displacement under a unit force, 1/(πE*r), is cut off beyond the largest distance inside the rectangle and
/// before its nearest image. Inside the rectangle the periodic sum then equals the free one (Vico, Greengard &
/// Ferrando, J. Comput. Phys. 323 (2016) 191), up to 1e-10 from a table. The cut-off is smooth, between 1 and
/// [`NonPeriodic::REACH`] diagonals, so the compliance (2/E*q) F(q·diagonal) converges rapidly to that of the
/// half-space. As a mean of sharp cut-offs, whose F is ∫J₀, it is positive for every wave, so its inverse, the
/// stiffness, exists.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NonPeriodic {
    /// Diagonal of the rectangle, units of L.
    pub diagonal: f64,
}

/// F and its slope over a step of the table, at 0, 1/64, 2/64, ….
static TABLE: OnceLock<Vec<[f64; 2]>> = OnceLock::new();

impl NonPeriodic {
    /// End of the cut-off, in diagonals; also the width of the padding.
    pub const REACH: f64 = 1.1;

    /// Table entries per unit; the error of cubic interpolation is 1e-10.
    const FINENESS: f64 = 64.0;

    /// Bump from -1 to 1 whose transform is below 1e-13 beyond this wave number: e^(β(√(1 - s²) - 1)).
    const BETA: f64 = 30.0;

    /// Number of sharp cut-offs that are averaged for the smooth one.
    const CUTS: usize = 32;

    /// Argument from which on F is 1.
    const END: f64 = 1.04 * Self::BETA / (0.5 * (Self::REACH - 1.0));

    /// Half-space for a loaded rectangle of these extents, units of L.
    pub fn of_region(lx: f64, ly: f64) -> Self {
        NonPeriodic { diagonal: lx.hypot(ly) }
    }

    /// Width of the padding, units of L.
    pub fn padding(&self) -> f64 {
        Self::REACH * self.diagonal
    }

    /// Compliance of the mean mode, in L/E*: the mean displacement under a mean pressure of one.
    pub fn mean_compliance(&self) -> f64 {
        // The cut-offs are symmetric about their mean.
        (1.0 + Self::REACH) * self.diagonal
    }

    fn table() -> &'static [[f64; 2]] {
        TABLE.get_or_init(|| {
            let mean_cut = 0.5 * (1.0 + Self::REACH);
            let cuts: Vec<(f64, f64)> = (0..Self::CUTS)
                .map(|j| {
                    let s = (2 * j + 1) as f64 / Self::CUTS as f64 - 1.0;
                    (mean_cut + (mean_cut - 1.0) * s, (Self::BETA * ((1.0 - s * s).sqrt() - 1.0)).exp())
                })
                .collect();
            let total: f64 = cuts.iter().map(|c| c.1).sum();
            let slope = |x: f64| cuts.iter().map(|(r, w)| w * r * libm::j0(x * r)).sum::<f64>() / total;
            let h = 1.0 / Self::FINENESS;
            // Three-point Gauss quadrature.
            let node = 0.6f64.sqrt();
            let step = |x: f64| {
                let value_at = |s: f64| slope(x + 0.5 * h * (1.0 + s));
                h * (5.0 * value_at(-node) + 8.0 * value_at(0.0) + 5.0 * value_at(node)) / 18.0
            };
            let entries = (Self::END * Self::FINENESS).ceil() as usize + 2;
            let mut value = 0.0;
            (0..entries)
                .map(|k| {
                    let x = k as f64 * h;
                    let entry = [value, h * slope(x)];
                    value += step(x);
                    entry
                })
                .collect()
        })
    }

    /// Compliance over that of the half-space, at `x` = q times the diagonal.
    fn compliance_ratio(x: f64) -> f64 {
        if x >= Self::END {
            return 1.0;
        }
        let scaled = x * Self::FINENESS;
        let k = scaled as usize;
        let (s, table) = (scaled - k as f64, Self::table());
        let ([a, da], [b, db]) = (table[k], table[k + 1]);
        let rise = b - a;
        a + s * (da + s * (3.0 * rise - 2.0 * da - db + s * (da + db - 2.0 * rise)))
    }
}

impl Kernel for NonPeriodic {
    #[inline]
    fn stiffness(&self, qx: f64, qy: f64) -> f64 {
        let q = length(qx, qy);
        if q == 0.0 { 0.0 } else { 0.5 * q / Self::compliance_ratio(q * self.diagonal) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_grid::{Grid, Transform};
    use rustfft::num_complex::Complex;
    use std::f64::consts::PI;

    /// A pressure e^(-r²/2s²) displaces the surface of an unbounded half-space by √(2π) s e^(-t) I₀(t), t = r²/4s².
    #[test]
    fn periodic_images_have_no_effect() {
        /// Error over the displacement at the centre: interpolation of the table, and pressure beyond the Nyquist
        /// modes of the grid.
        const TOLERANCE: f64 = 1e-9;
        let (n, s) = (64usize, 0.05f64);
        for (lx, ly) in [(1.0, 1.0), (1.0, 0.75)] {
            let kernel = NonPeriodic::of_region(lx, ly);
            let dx = lx / n as f64;
            let cells = |l: f64| ((l + kernel.padding()) / dx).ceil() as usize;
            let (nx, ny) = (cells(lx), cells(ly));
            let grid = Grid { nx, ny, lx: nx as f64 * dx, ly: ny as f64 * dx };
            // Near a corner of the patch, so that the opposite corner is at the largest distance.
            let square = |i: usize, j: usize| {
                let (x, y) = (i as f64 * dx - 0.3 * lx, j as f64 * dx - 0.4 * ly);
                x * x + y * y
            };
            let pressure: Vec<f64> =
                (0..grid.points()).map(|i| (-0.5 * square(i % nx, i / nx) / (s * s)).exp()).collect();
            let transform = Transform::<f64>::new(grid);
            let (mut spectrum, mut lifted) = (transform.spectrum(), vec![0.0; grid.points()]);
            transform.forward(&pressure, &mut spectrum);
            let per_point = 1.0 / grid.points() as f64;
            transform.inverse_after(&mut spectrum, &mut lifted, &|i: usize, column: &mut [Complex<f64>]| {
                for (j, c) in column.iter_mut().enumerate() {
                    let stiffness = kernel.stiffness(grid.qx(i), grid.qy(j));
                    let compliance = if i + j == 0 { kernel.mean_compliance() } else { 1.0 / stiffness };
                    *c *= compliance * per_point;
                }
                0.0
            });
            let highest = (2.0 * PI).sqrt() * s;
            for (i, j) in (0..n).flat_map(|i| (0..(ly / dx) as usize).map(move |j| (i, j))) {
                let t = 0.25 * square(i, j) / (s * s);
                let deviation = lifted[j * nx + i] / highest - scaled_bessel(t);
                assert!(deviation.abs() < TOLERANCE, "{lx} x {ly}, {i}, {j}: {deviation}");
            }
        }
    }

    /// e^(-t) I₀(t), as the mean of e^(t(cos φ - 1)).
    fn scaled_bessel(t: f64) -> f64 {
        let n = 2000;
        (0..n).map(|k| (t * ((2.0 * PI * f64::from(k) / f64::from(n)).cos() - 1.0)).exp()).sum::<f64>() / f64::from(n)
    }
}
