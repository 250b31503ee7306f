use crate::non_periodic::hann_windowed;
use asperity_grid::{Grid, Transform, extent, mean, signed_mode};
use rustfft::num_complex::Complex;
use std::f64::consts::PI;
use std::sync::Mutex;

/// Spectral statistics of a sampled surface, from its discrete Fourier coefficients (reduced units).
#[derive(Debug, Clone, Copy)]
pub struct Moments {
    pub rms_height: f64,
    pub rms_gradient: f64,
    /// Moments of the profiles along both axes: m0 = ⟨h²⟩, m2 = ⟨|∇h|²⟩/2, m4 = (⟨h_xx²⟩ + ⟨h_yy²⟩)/2. Those of a single line are its own.
    pub m0: f64,
    pub m2: f64,
    pub m4: f64,
    /// Elastic energy per area of full contact, units of E*·L.
    pub full_contact_energy: f64,
}

impl Moments {
    /// R_c = [(⟨h_xx²⟩ + ⟨h_yy²⟩)/2]^(-1/2).
    pub fn curvature_radius(&self) -> f64 {
        self.m4.sqrt().recip()
    }

    /// Nayak's bandwidth parameter α = m0·m4/m2².
    pub fn nayak(&self) -> f64 {
        self.m0 * self.m4 / self.m2.powi(2)
    }
}

/// Lowest, mean and highest height.
#[derive(Debug, Clone, Copy)]
pub struct HeightRange {
    pub min: f64,
    pub mean: f64,
    pub max: f64,
}

pub fn range(heights: &[f64]) -> HeightRange {
    let (min, max) = extent(heights);
    HeightRange { min, mean: mean(heights), max }
}

/// Moments of heights `[ny, nx]`.
pub fn moments(grid: Grid, heights: &[f64]) -> Moments {
    let [m0, gradient, m4, energy] = spectral_sums(grid, heights, |qx, qy, power| {
        let q2 = qx * qx + qy * qy;
        [power, q2 * power, (qx.powi(4) + qy.powi(4)) / 2.0 * power, q2.sqrt() / 4.0 * power]
    });
    // A single line is its own profile.
    let profiles = if grid.nx.min(grid.ny) == 1 { 1.0 } else { 2.0 };
    Moments {
        rms_height: m0.sqrt(),
        rms_gradient: gradient.sqrt(),
        m0,
        m2: gradient / profiles,
        m4: m4 * 2.0 / profiles,
        full_contact_energy: energy,
    }
}

/// A logarithmic bin of the radial power spectral density.
#[derive(Debug, Clone, Copy)]
pub struct PsdBin {
    /// Geometric mean of the bin's limits in |n| = |q| L/2π.
    pub mode: f64,
    /// Mean of |a|² over the bin's modes, units of L².
    pub power: f64,
    /// Mean of `expected` over the same modes.
    pub expected: f64,
}

/// Radial power spectral density of heights `[ny, nx]` in about ten bins per decade, with the mean of `expected(n)`
/// over the same modes. Empty bins and modes beyond the axes' Nyquist mode are omitted.
pub fn psd(grid: Grid, heights: &[f64], expected: impl Fn(f64) -> f64 + Sync) -> Vec<PsdBin> {
    const PER_DECADE: f64 = 10.0;
    let last = (grid.nx as f64 / 2.0).min(grid.ny as f64 / 2.0 * grid.lx / grid.ly).max(1.0);
    // In a cell that is longer along y the longest waves have modes below 1.
    let first = (grid.lx / grid.ly).min(1.0);
    let below = (-first.log10() * PER_DECADE).ceil();
    let bins = below as usize + (last.log10() * PER_DECADE).ceil() as usize + 1;
    let bin = |n: f64| (n.log10() * PER_DECADE + 0.5 + below).floor() as usize;
    // One small histogram per column, added in column order.
    let columns = of_mode_columns(grid, heights, |i, column| {
        let mut shells: Vec<(usize, [f64; 3])> = Vec::new();
        for (j, a) in column.iter().enumerate() {
            let n = grid.qx(i).hypot(grid.qy(j)) * grid.lx / (2.0 * PI);
            if n < 0.5 * first || n > last {
                continue;
            }
            let (b, w) = (bin(n), grid.column_weight(i));
            let add = [w, w * a.norm_sqr(), w * expected(n)];
            match shells.iter_mut().find(|(k, _)| *k == b) {
                Some((_, sum)) => sum.iter_mut().zip(add).for_each(|(s, v)| *s += v),
                None => shells.push((b, add)),
            }
        }
        shells
    });
    let mut sums = vec![[0.0; 3]; bins + 1];
    for (b, add) in columns.into_iter().flatten() {
        sums[b].iter_mut().zip(add).for_each(|(s, v)| *s += v);
    }
    sums.iter()
        .enumerate()
        .filter(|(_, s)| s[0] > 0.0)
        .map(|(b, s)| PsdBin {
            mode: 10f64.powf((b as f64 - below) / PER_DECADE),
            power: s[1] / s[0],
            expected: s[2] / s[0],
        })
        .collect()
}

/// A wave number and the power spectral density there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpectralDensity {
    pub q: f64,
    pub density: f64,
}

/// Power spectral densities of heights on their cell (doi:10.1088/2051-672X/aa51f8), of their Fourier coefficients a.
#[derive(Debug, Clone, PartialEq)]
pub struct PowerSpectra {
    /// C1D(q) = L |a|² of the profiles along x, averaged over all of them and over q and -q, below the Nyquist wave.
    pub x: Vec<SpectralDensity>,
    /// Likewise along y.
    pub y: Vec<SpectralDensity>,
    /// C2D(q) = A |a|², averaged over the waves of about ten bins per decade, at their mean wave number.
    pub radial: Vec<SpectralDensity>,
}

/// Spectra of heights `[ny, nx]`, of a patch about its mean plane under a Hann window along both axes.
pub fn power_spectra(grid: Grid, heights: &[f64], periodic: bool) -> PowerSpectra {
    let windowed = (!periodic).then(|| hann_windowed(grid, heights));
    let heights = windowed.as_deref().unwrap_or(heights);
    let columns = of_mode_columns(grid, heights, |_, column| column.iter().map(Complex::norm_sqr).collect::<Vec<_>>());
    let x = columns.iter().map(|column| column.iter().sum()).collect::<Vec<f64>>();
    let mut y = vec![0.0; grid.ny / 2 + 1];
    for (i, column) in columns.iter().enumerate() {
        // Of both signs half.
        let half = 0.5 * grid.column_weight(i);
        column.iter().enumerate().for_each(|(j, c)| y[signed_mode(j, grid.ny).unsigned_abs() as usize] += half * c);
    }
    let profile = |power: Vec<f64>, n: usize, length: f64| {
        let density = |k: usize| SpectralDensity { q: 2.0 * PI * k as f64 / length, density: length * power[k] };
        (1..n.div_ceil(2)).map(density).collect()
    };
    // The mean wave number of a bin is the mean of what is expected of its waves.
    let radial = psd(grid, heights, |n| n)
        .into_iter()
        .map(|bin| SpectralDensity { q: 2.0 * PI * bin.expected / grid.lx, density: bin.power * grid.lx * grid.ly })
        .collect();
    PowerSpectra { x: profile(x, grid.nx, grid.lx), y: profile(y, grid.ny, grid.ly), radial }
}

/// Ordered sums of `term(qx, qy, |a|²)` over every mode but the mean.
fn spectral_sums<const K: usize>(
    grid: Grid,
    heights: &[f64],
    term: impl Fn(f64, f64, f64) -> [f64; K] + Sync,
) -> [f64; K] {
    asperity_grid::block_sums(&of_mode_columns(grid, heights, |i, column| {
        let mut sum = [0.0; K];
        for (j, a) in column.iter().enumerate() {
            if i == 0 && signed_mode(j, grid.ny) == 0 {
                continue;
            }
            let terms = term(grid.qx(i), grid.qy(j), grid.column_weight(i) * a.norm_sqr());
            sum.iter_mut().zip(terms).for_each(|(s, v)| *s += v);
        }
        sum
    }))
}

/// A value of every column of the half spectrum, by its normalised amplitudes.
pub(crate) fn of_mode_columns<V: Send>(
    grid: Grid,
    heights: &[f64],
    value: impl Fn(usize, &[Complex<f64>]) -> V + Sync,
) -> Vec<V> {
    let (per_point, columns) = (1.0 / grid.points() as f64, Mutex::new(Vec::with_capacity(grid.half())));
    let transform = Transform::<f64>::new(grid);
    let visit = |i: usize, column: &mut [Complex<f64>]| {
        column.iter_mut().for_each(|c| *c *= per_point);
        let value = value(i, column);
        columns.lock().expect("no panic while a column is stored").push((i, value));
        0.0
    };
    transform.forward_filtered(heights, &mut transform.spectrum(), &visit);
    let mut columns = columns.into_inner().expect("no panic while a column is stored");
    columns.sort_unstable_by_key(|(i, _)| *i);
    columns.into_iter().map(|(_, value)| value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In a cell four times as long along y, the longest wave has |n| = 1/4.
    #[test]
    fn the_longest_waves_of_a_tall_cell_have_their_own_bin() {
        let grid = Grid { ly: 4.0, ..Grid::unit(16, 64) };
        let heights: Vec<f64> = (0..grid.points()).map(|i| (2.0 * PI * (i / 16) as f64 / 64.0).cos()).collect();
        let bins = psd(grid, &heights, |_| 0.0);
        let powerful: Vec<&PsdBin> = bins.iter().filter(|b| b.power > 1e-3).collect();
        let [bin] = powerful[..] else { panic!("{bins:?}") };
        // A bin is a tenth of a decade wide. Both waves of the cosine have |a|² = 1/4.
        assert!((bin.mode / 0.25).log10().abs() <= 0.05 && (bin.power - 0.25).abs() < 1e-12, "{bin:?}");
    }

    /// h = A cos(2π·3x) cos(2π·2y): every moment in closed form.
    #[test]
    fn moments_of_a_sinusoid() {
        let grid = Grid { ly: 1.0, ..Grid::unit(32, 24) };
        let (a, kx, ky) = (0.1, 2.0 * PI * 3.0, 2.0 * PI * 2.0);
        let heights: Vec<f64> = (0..grid.points())
            .map(|i| a * (kx * (i % 32) as f64 / 32.0).cos() * (ky * (i / 32) as f64 / 24.0).cos() + 5.0)
            .collect();
        let m = moments(grid, &heights);
        let close = |actual: f64, exact: f64| assert!((actual / exact - 1.0).abs() < 1e-10, "{actual} {exact}");
        close(m.rms_height, a / 2.0);
        close(m.rms_gradient, a / 2.0 * kx.hypot(ky));
        close(m.m4, a * a / 4.0 * (kx.powi(4) + ky.powi(4)) / 2.0);
        close(m.full_contact_energy, kx.hypot(ky) / 4.0 * a * a / 4.0);
    }
}
