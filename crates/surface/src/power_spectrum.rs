use crate::Spectrum;
use asperity_grid::{Grid, Series, signed_mode};
use std::f64::consts::TAU;

/// Isotropic power spectrum of a surface, in shells about |q| = 1, 2, … times 2π: the input of statistical theories.
/// Unit of length: the cell's extent in x.
#[derive(Debug, Clone, PartialEq)]
pub struct PowerSpectrum {
    /// Non-empty shells, by increasing wave number.
    pub shells: Vec<Shell>,
    /// Anisotropy of the gradients: the larger of the second and fourth angular harmonic of q²C over its mean; 0 for
    /// an isotropic spectrum.
    pub anisotropy: f64,
}

/// Modes with similar wave numbers.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Shell {
    /// Effective wave number: rms gradient over rms height.
    pub q: f64,
    /// Mean square height.
    pub height: f64,
    /// Mean square gradient.
    pub gradient: f64,
    /// Mean square of h_xx over both axes: the contribution to the profile moment m4.
    pub curvature: f64,
}

impl PowerSpectrum {
    /// Spectrum of the modes of a series that a grid resolves.
    pub fn from_series(series: &Series<f64>, grid: Grid) -> Self {
        Self::of_waves(series, grid, |_, _| true)
    }

    /// The same of the waves (kx, ky) that `keep` accepts.
    pub fn of_waves(series: &Series<f64>, grid: Grid, keep: impl Fn(i64, i64) -> bool) -> Self {
        let mut tally = Tally::of_cell(grid.lx.max(grid.ly));
        for i in 0..grid.half() {
            let (up, down) = series.column(i, grid);
            let weight = grid.column_weight(i);
            // Together the two parts are a column in FFT order.
            let rows = grid.ny.max(up.len() + down.len());
            let first = rows - down.len();
            let waves = up.iter().enumerate().chain(down.iter().enumerate().map(|(j, c)| (first + j, c)));
            for (j, c) in waves {
                let ky = signed_mode(j, rows);
                if keep(i as i64, ky) {
                    tally.add(grid.qx(i), TAU / grid.ly * ky as f64, weight * c.norm_sqr());
                }
            }
        }
        tally.power()
    }

    /// Spectrum of heights `[ny, nx]`.
    pub fn from_nodes(grid: Grid, heights: &[f64]) -> Self {
        Self::from_series(&Series::from_nodes(grid, heights), grid)
    }

    /// Ensemble average for a self-affine spectrum in a cell of aspect `ly/lx`, summed over its modes.
    pub fn expected(spectrum: &Spectrum, aspect: f64) -> Self {
        let scale = spectrum.expected(aspect, 0.0).power_prefactor;
        let (kx_max, ky_max) = spectrum.largest_modes(aspect);
        let mut tally = Tally::of_cell(aspect.max(1.0));
        for kx in 0..=kx_max {
            for ky in 0..=ky_max {
                let (nx, ny) = (kx as f64, ky as f64 / aspect);
                let weight = f64::from(1 + u8::from(kx > 0)) * f64::from(1 + u8::from(ky > 0));
                let power = spectrum.relative_power(nx.hypot(ny));
                if power > 0.0 {
                    tally.add(TAU * nx, TAU * ny, weight * scale * power);
                }
            }
        }
        // Only one quadrant was summed, so its angular harmonics are meaningless.
        PowerSpectrum { anisotropy: 0.0, ..tally.power() }
    }

    /// Sum of `part` over the shells.
    pub fn sum(&self, part: impl Fn(&Shell) -> f64) -> f64 {
        self.shells.iter().map(part).sum()
    }

    pub fn rms_height(&self) -> f64 {
        self.sum(|s| s.height).sqrt()
    }

    pub fn rms_gradient(&self) -> f64 {
        self.sum(|s| s.gradient).sqrt()
    }

    /// Profile moments m0, m2 and m4, as [`super::Moments`] has them.
    pub fn moments(&self) -> (f64, f64, f64) {
        (self.sum(|s| s.height), 0.5 * self.sum(|s| s.gradient), self.sum(|s| s.curvature))
    }
}

struct Tally {
    /// Distance of the shells: the wave number of the longest wave of the cell.
    width: f64,
    shells: Vec<Shell>,
    /// Real and imaginary parts of the angular harmonics of q²C.
    harmonics: [f64; 4],
}

impl Tally {
    /// Of a cell of this extent along its longer side.
    fn of_cell(longest: f64) -> Self {
        Tally { width: TAU / longest, shells: Vec::new(), harmonics: [0.0; 4] }
    }

    fn add(&mut self, qx: f64, qy: f64, power: f64) {
        let q2 = qx * qx + qy * qy;
        if q2 == 0.0 || power == 0.0 {
            return;
        }
        let shell = (q2.sqrt() / self.width).round() as usize;
        if shell >= self.shells.len() {
            self.shells.resize(shell + 1, Shell::default());
        }
        let s = &mut self.shells[shell];
        s.height += power;
        s.gradient += q2 * power;
        s.curvature += 0.5 * (qx.powi(4) + qy.powi(4)) * power;
        let (cos, sin) = ((qx * qx - qy * qy) / q2, 2.0 * qx * qy / q2);
        let fourth = (cos * cos - sin * sin, 2.0 * cos * sin);
        for (sum, part) in self.harmonics.iter_mut().zip([cos, sin, fourth.0, fourth.1]) {
            *sum += part * q2 * power;
        }
    }

    fn power(self) -> PowerSpectrum {
        let gradient: f64 = self.shells.iter().map(|s| s.gradient).sum();
        let [c2, s2, c4, s4] = self.harmonics;
        let anisotropy = if gradient > 0.0 { c2.hypot(s2).max(c4.hypot(s4)) / gradient } else { 0.0 };
        let shell = |s: &Shell| Shell { q: (s.gradient / s.height).sqrt(), ..*s };
        PowerSpectrum { shells: self.shells.iter().filter(|s| s.height > 0.0).map(shell).collect(), anisotropy }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Modes, moments};

    /// Shells of a cell and of the transposed one, whose unit is its own extent along x, are the same.
    #[test]
    fn shells_do_not_depend_on_the_orientation() {
        let (grid, turned) = (Grid { nx: 40, ny: 8, lx: 1.0, ly: 0.2 }, Grid { nx: 8, ny: 40, lx: 1.0, ly: 5.0 });
        let spectrum = Spectrum { lambda_s: 1.0 / 16.0, ..Spectrum::CHALLENGE };
        let heights = Modes::new(spectrum, 3, 0.2).heights(grid, 0.0);
        let transposed: Vec<f64> = (0..320).map(|i| heights[i % 8 * 40 + i / 8]).collect();
        let [plain, other] = [(grid, &heights), (turned, &transposed)]
            .map(|(grid, heights)| PowerSpectrum::from_nodes(grid, heights).shells);
        assert_eq!(plain.len(), other.len());
        // Wave numbers are over the extent along x. Shells of rounding alone differ.
        let total: f64 = plain.iter().map(|s| s.height).sum();
        for (a, b) in plain.iter().zip(&other).filter(|(a, _)| a.height > 1e-12 * total) {
            assert!((a.q / (5.0 * b.q) - 1.0).abs() < 1e-9 && (a.height / b.height - 1.0).abs() < 1e-9, "{a:?} {b:?}");
        }
    }

    /// Shells from nodes and from a series add up to the moments of the nodes and to the ensemble averages.
    #[test]
    fn shells_add_up_to_the_moments() {
        let spectrum = Spectrum { lambda_s: 1.0 / 24.0, ..Spectrum::CHALLENGE };
        for (nx, ny) in [(64, 64), (72, 54), (65, 63)] {
            let grid = Grid { nx, ny, lx: 1.0, ly: ny as f64 / nx as f64 };
            let modes = Modes::new(spectrum, 3, grid.ly);
            let heights = modes.heights::<f64>(grid, 0.0);
            let m = moments(grid, &heights);
            for power in [PowerSpectrum::from_nodes(grid, &heights), PowerSpectrum::from_series(modes.series(), grid)] {
                let close = |actual: f64, exact: f64| assert!((actual / exact - 1.0).abs() < 1e-10, "{actual} {exact}");
                let (m0, m2, m4) = power.moments();
                close(m0, m.m0);
                close(m2, m.m2);
                close(m4, m.m4);
                close(power.rms_gradient(), m.rms_gradient);
            }
            let e = spectrum.expected(grid.ly, 0.0);
            let expected = PowerSpectrum::expected(&spectrum, grid.ly);
            assert!((expected.rms_height() / e.rms_height - 1.0).abs() < 1e-12);
            assert!((expected.moments().2 / e.m4 - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn ridges_are_anisotropic_and_random_surfaces_are_not() {
        let grid = Grid::unit(64, 64);
        let wave = |f: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
            (0..grid.points()).map(|i| f(TAU * (i % 64) as f64 / 64.0, TAU * (i / 64) as f64 / 64.0)).collect()
        };
        let anisotropy = |h: &[f64]| PowerSpectrum::from_nodes(grid, h).anisotropy;
        assert!(anisotropy(&wave(&|x, _| x.cos())) > 0.99);
        // Alike along x and y, but not between them.
        assert!(anisotropy(&wave(&|x, y| x.cos() + y.cos())) > 0.99);
        let spectrum = Spectrum { lambda_s: 1.0 / 24.0, ..Spectrum::CHALLENGE };
        assert!(anisotropy(&Modes::new(spectrum, 3, 1.0).heights::<f64>(grid, 0.0)) < 0.15);
    }
}
