//! An isotropic surface whose profiles have the spectrum of a profile: one realisation.
//!
//! The profiles of an isotropic surface with the density C2D(q) have C1D(q_x) = (1/2π) ∫ C2D(√(q_x² + q_y²)) dq_y (Nayak, J. Lubr. Technol. 93
//! (1971) 398; Jacobs, Junge & Pastewka, doi:10.1088/2051-672X/aa51f8), here the sum over the waves of the map, so that its limits are those of
//! the grid. C2D is linear over ln q between knots, not negative, and has the largest likelihood that the waves of the profile, whose |a|² are
//! distributed exponentially about their mean (Whittle, Ark. Mat. 2 (1953) 423), give it.

use super::digits::{digits, in_unit};
use super::trend::{Degree, Trend};
use crate::Amplitudes;
use crate::non_periodic::hann_windowed;
use crate::statistics::{moments, of_mode_columns};
use crate::synthesis::random;
use asperity_grid::sys::expect_memory;
use asperity_grid::{Error, Grid, Result, Transform, signed_mode};
use rayon::prelude::*;

/// Factor of wave numbers between knots, and least distance in waves: closer ones follow the noise of few waves, wider ones smooth the end of
/// a spectrum. Means and scatter of 16 surfaces were alike from 1.12 to 1.41 but at a sharp cut-off, which needs the smaller.
const SPACING: f64 = 1.12;
const LEAST_SPACING: f64 = 2.0;

/// Power law beyond the last knot, in the corners of the grid: that of H = 0.5.
const BEYOND: f64 = 3.0;

/// Steps of the fit, each of which raises the likelihood (Févotte & Idier, Neural Comput. 23 (2011) 2421). A thousand change no digit that counts.
const STEPS: usize = 1000;

/// Least |a|² over the largest: rounding.
const LEAST: f64 = 1e-24;

/// First words of the line of the history.
pub(super) const LINE: &str = "isotropic map";

/// Fewest points of a profile.
const FEWEST: usize = 16;

/// A Hann window adds the neighbours' power: parts of a wave's own, and of each neighbour.
const HANN: [f64; 2] = [2.0 / 3.0, 1.0 / 6.0];

/// Longest waves of a profile, of which it has two or less, in modes; and the share of the mean square height from which on they are doubtful.
const LONGEST: f64 = 3.0;
const DOUBTFUL: f64 = 0.5;

/// Changes the seed: waves that `extend_to` adds have other phases.
const OWN_STREAM: u64 = 0x0069_736f_7472_6f70;

/// C2D over the area at knots, which are wave numbers in modes of the profile.
struct Isotropic {
    knots: Vec<f64>,
    values: Vec<f64>,
}

impl Isotropic {
    /// Knots from the `first` mode to the Nyquist mode of `n` points.
    fn knots(first: f64, n: usize) -> Vec<f64> {
        let last = n as f64 / 2.0;
        let next = |q: &f64| Some((q * SPACING).max(q + LEAST_SPACING));
        let mut knots: Vec<f64> = std::iter::successors(Some(first), next).take_while(|q| *q < last).collect();
        // Not two close ones at the end.
        if knots.len() > 1 && knots[knots.len() - 1] * SPACING.sqrt() > last {
            knots.pop();
        }
        knots.push(last);
        knots
    }

    /// Weights of two knots at a wave number: the value of the first, and of the last with a power law beyond it.
    fn weights(knots: &[f64], q: f64) -> [(usize, f64); 2] {
        let last = knots.len() - 1;
        match knots.partition_point(|k| *k <= q) {
            0 => [(0, 1.0), (0, 0.0)],
            i if i > last => [(last, (knots[last] / q).powf(BEYOND)), (last, 0.0)],
            i => {
                let t = (q / knots[i - 1]).ln() / (knots[i] / knots[i - 1]).ln();
                [(i - 1, 1.0 - t), (i, t)]
            }
        }
    }

    fn at(&self, q: f64) -> f64 {
        Self::weights(&self.knots, q).iter().map(|(i, weight)| weight * self.values[*i]).sum()
    }

    /// Weights of the knots in |a|² of the waves 0, 1, … along x of the profiles of a map of n × n points.
    fn profiles(knots: &[f64], n: usize) -> Vec<Vec<f64>> {
        let waves = (n - 1) / 2;
        let row = |kx: usize| {
            let mut row = vec![0.0; knots.len()];
            for ky in (0..=waves).filter(|ky| kx + ky > 0) {
                let both = if ky == 0 { 1.0 } else { 2.0 };
                for (i, weight) in Self::weights(knots, (kx as f64).hypot(ky as f64)) {
                    row[i] += both * weight;
                }
            }
            row
        };
        (0..=waves).into_par_iter().map(row).collect()
    }

    /// The density of largest likelihood for |a|² of the waves 0, 1, … of a profile of `n` points.
    fn fit(powers: &[f64], n: usize, periodic: bool) -> Self {
        // Mean and slope of a profile that does not repeat are in its first waves.
        let first = if periodic { 1 } else { 2 };
        let knots = Self::knots(first as f64, n);
        let waves = (n - 1) / 2;
        let plain = Self::profiles(&knots, n);
        let row = |k: usize| match periodic {
            true => plain[k].clone(),
            false => {
                let neighbours = [k - 1, (k + 1).min(waves)];
                let of_neighbours = |i: usize| neighbours.iter().map(|k| plain[*k][i]).sum::<f64>();
                (0..knots.len()).map(|i| HANN[0] * plain[k][i] + HANN[1] * of_neighbours(i)).collect()
            }
        };
        let rows: Vec<Vec<f64>> = (first..=waves).map(row).collect();
        let largest = powers[first..=waves].iter().copied().fold(0.0, f64::max);
        if largest == 0.0 {
            return Isotropic { values: vec![0.0; knots.len()], knots };
        }
        let powers: Vec<f64> = powers[first..=waves].iter().map(|p| p.max(LEAST * largest)).collect();
        // From the power of the waves near each knot.
        let start = |q: &f64| {
            let wave = |q: f64| (q as usize).clamp(first, waves) - first;
            let near = &powers[wave(q / SPACING)..=wave(q * SPACING)];
            let sum: f64 = rows[wave(*q)].iter().sum();
            near.iter().sum::<f64>() / near.len() as f64 / sum
        };
        let mut values: Vec<f64> = knots.iter().map(start).collect();
        for _ in 0..STEPS {
            let mut sums = vec![[0.0; 2]; knots.len()];
            for (row, power) in rows.iter().zip(&powers) {
                let mean: f64 = row.iter().zip(&values).map(|(weight, v)| weight * v).sum();
                for (sum, weight) in sums.iter_mut().zip(row) {
                    sum[0] += weight * power / (mean * mean);
                    sum[1] += weight / mean;
                }
            }
            values.iter_mut().zip(sums).for_each(|(v, [up, down])| *v *= (up / down).sqrt());
        }
        Isotropic { knots, values }
    }

    /// Heights of a square map with random phases and moduli, at the points of the profile.
    fn heights(&self, grid: Grid, seed: u64) -> Vec<f64> {
        let transform = Transform::<f64>::new(grid);
        let mut spectrum = transform.spectrum();
        spectrum.par_chunks_mut(grid.pitch()).enumerate().for_each(|(j, row)| {
            let ky = signed_mode(j, grid.ny);
            for (kx, value) in row.iter_mut().enumerate().filter(|(kx, _)| 2 * kx < grid.nx) {
                if 2 * ky.unsigned_abs() as usize >= grid.ny || (kx, ky) == (0, 0) {
                    continue;
                }
                let power = self.at((kx as f64).hypot(ky as f64));
                *value = random((seed ^ OWN_STREAM, Amplitudes::Gaussian), [kx as i64, ky], power, 1.0);
            }
        });
        let mut heights = vec![0.0; grid.points()];
        transform.inverse(&mut spectrum, &mut heights);
        heights
    }

    /// Share of the mean square height in waves of less than [`LONGEST`] modes.
    fn longest(&self, n: usize) -> f64 {
        let waves = (n - 1) / 2;
        let power = |k: usize| -> [f64; 2] {
            let mut sum = [0.0; 2];
            for ky in (0..=waves).filter(|ky| k + ky > 0) {
                let q = (k as f64).hypot(ky as f64);
                let power = self.at(q) * if k == 0 { 1.0 } else { 2.0 } * if ky == 0 { 1.0 } else { 2.0 };
                sum[0] += power;
                sum[1] += if q < LONGEST { power } else { 0.0 };
            }
            sum
        };
        let rows: Vec<[f64; 2]> = (0..=waves).into_par_iter().map(power).collect();
        let [all, long] = asperity_grid::block_sums(&rows);
        if all > 0.0 { long / all } else { 0.0 }
    }
}

/// A map with its line of the history, and what is doubtful about it.
pub(super) type Realisation = (Grid, Vec<f64>, String, Option<String>);

/// A square map, which repeats, at the points of the profile `heights`: a realisation, by `seed`, of the isotropic Gaussian surface whose profiles
/// have its spectrum. Of a profile that does not repeat, about its line, that under a Hann window.
///
/// # Errors
/// A map of several lines, few points, no memory.
pub(super) fn map((grid, unit): (Grid, &str), heights: &[f64], periodic: bool, seed: u64) -> Result<Realisation> {
    let n = grid.nx;
    if grid.ny != 1 || n < FEWEST {
        let found = format!("{} x {} points", grid.nx, grid.ny);
        let accepted = format!("a profile (--profile): one line of at least {FEWEST} points");
        return Err(Error::input("preparation", "--isotropic-map", found, accepted));
    }
    // Heights, and their spectrum.
    let bytes = 4 * size_of::<f64>() as u64 * (n as u64).pow(2);
    expect_memory(format!("a map of {n} x {n} points"), bytes, "a profile of fewer points (--crop, --resample)")?;
    let mut level = heights.to_vec();
    Trend::fit(if periodic { Degree::Mean } else { Degree::Plane }, grid, heights).subtract(grid, &mut level);
    let windowed = (!periodic).then(|| hann_windowed(grid, &level));
    let powers = of_mode_columns(grid, windowed.as_deref().unwrap_or(&level), |_, column| column[0].norm_sqr());
    let slope: f64 = (1..n.div_ceil(2)).map(|k| 2.0 * grid.qx(k).powi(2) * powers[k]).sum::<f64>().sqrt();
    let spectrum = Isotropic::fit(&powers, n, periodic);
    let square = Grid { nx: n, ny: n, lx: grid.lx, ly: grid.lx };
    let made = spectrum.heights(square, seed);
    let m = moments(square, &made);
    let line = format!(
        "{LINE}: one realisation, of seed {seed}, of the random surface whose profiles have this spectrum{}; {n} x {n} points; rms height {} \
         of the profile, {} of the map; rms gradient {} of the profile, {} of the map (√2 times as much in the mean)",
        if periodic { "" } else { " (about its line, under a Hann window)" },
        in_unit(digits(asperity_grid::rms(&level)), unit),
        in_unit(digits(m.rms_height), unit),
        digits(slope),
        digits(m.rms_gradient),
    );
    let share = spectrum.longest(n);
    let doubt = (share > DOUBTFUL).then(|| {
        format!(
            "{:.0} % of the mean square height of the --isotropic-map is in waves of which the profile has less than three: its rms height is a guess; \
             a longer profile has more of these waves, --high-pass removes them",
            100.0 * share
        )
    });
    Ok((square, made, line, doubt))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Modes, Spectrum, power_spectra};
    use std::f64::consts::TAU;

    const SEEDS: u64 = 16;
    const N: usize = 256;

    /// rms height, gradient, and C1D in octaves of all profiles along x.
    fn numbers(grid: Grid, heights: &[f64]) -> [f64; 8] {
        let m = moments(grid, heights);
        let spectrum = power_spectra(grid, heights, true).x;
        let octave = |k: f64| {
            let [low, high] = [0.99 * TAU * k, 1.99 * TAU * k];
            let inside: Vec<f64> = spectrum.iter().filter(|d| (low..high).contains(&d.q)).map(|d| d.density).collect();
            inside.iter().sum::<f64>() / inside.len() as f64
        };
        let [a, b, c, d, e, f] = [2.0, 4.0, 8.0, 16.0, 24.0, 30.0].map(octave);
        [m.rms_height, m.rms_gradient, a, b, c, d, e, f]
    }

    /// Means over surfaces and four profiles of each of the numbers of the map over those of the surface, and the scatter of height and gradient.
    /// `part`: the profile is the half of one of a surface of twice the extent, and does not repeat.
    fn ratios(hurst: f64, lambda_r: f64, part: bool) -> ([f64; 8], [f64; 2]) {
        const LINES: usize = 4;
        let twice = if part { 2.0 } else { 1.0 };
        let (lambda_r, lambda_s) = (lambda_r / twice, 1.0 / 64.0 / twice);
        let spectrum = Spectrum { hurst, lambda_r, lambda_s, rms_gradient: 0.2, amplitudes: Amplitudes::Gaussian };
        let whole = Grid::unit(N * twice as usize, N * twice as usize);
        // Lengths of the map, so that modes of both are compared.
        let scaled = Grid { lx: twice, ly: twice, ..whole };
        let line = Grid { nx: N, ny: 1, lx: 1.0, ly: 1.0 / N as f64 };
        let (mut made, mut exact, mut squares) = ([0.0; 8], [0.0; 8], [0.0; 2]);
        for seed in 1..=SEEDS {
            let surface: Vec<f64> = Modes::new(spectrum, seed, 1.0).heights(whole, 0.0);
            let b = numbers(scaled, &surface);
            for row in (0..LINES).map(|row| row * whole.ny / LINES) {
                let profile = &surface[row * whole.nx..][..N];
                let (grid, heights, ..) = map((line, ""), profile, !part, seed + 100 * row as u64).expect("a map");
                let a = numbers(grid, &heights);
                made.iter_mut().zip(a).for_each(|(sum, v)| *sum += v);
                exact.iter_mut().zip(b).for_each(|(sum, v)| *sum += v);
                (0..2).for_each(|i| squares[i] += (a[i] / b[i] - 1.0).powi(2) / (SEEDS as usize * LINES) as f64);
            }
        }
        (std::array::from_fn(|i| made[i] / exact[i]), squares.map(f64::sqrt))
    }

    /// Of profiles of isotropic surfaces with a roll-off, and of parts of them, rms height, gradient and C1D come back in the mean: measured were
    /// 0.96 to 0.99, 0.96 to 1.01 and in single octaves 0.83 to 1.06 of those of the surfaces. Of a single profile the rms height scatters by 12
    /// to 33 %, the gradient by 7 to 11 %, as it has few long waves: the errors of these means are up to 4 %, and 1.4 %.
    #[test]
    fn maps_have_the_numbers_of_the_surface_of_the_profile() {
        const HEIGHT: f64 = 0.1;
        const GRADIENT: f64 = 0.06;
        /// Factor of C1D in an octave.
        const OCTAVE: f64 = 1.25;
        for (hurst, lambda_r) in [(0.3, 0.25), (0.8, 0.25), (1.0, 0.125)] {
            for part in [false, true] {
                let (means, scatter) = ratios(hurst, lambda_r, part);
                let [height, gradient, octaves @ ..] = means;
                let good = (height - 1.0).abs() < HEIGHT
                    && (gradient - 1.0).abs() < GRADIENT
                    && octaves.iter().all(|r| (1.0 / OCTAVE..OCTAVE).contains(r));
                assert!(good, "{hurst} {lambda_r} {part}: {means:.3?}");
                assert!(scatter[0] < 0.4 && scatter[1] < 0.15, "{hurst} {lambda_r} {part}: {scatter:.3?}");
            }
        }
    }

    /// The same seed gives the same bits, another one another surface; a flat profile is a flat map.
    #[test]
    fn a_seed_is_a_map() {
        let line = Grid { nx: 100, ny: 1, lx: 1.0, ly: 0.01 };
        let profile: Vec<f64> = (0..100).map(|i| (0.3 * f64::from(i)).sin() + (1.1 * f64::from(i)).cos()).collect();
        let [a, b, c] = [1, 1, 2].map(|seed| map((line, ""), &profile, false, seed).expect("a map").1);
        assert!(a == b && a != c && a.len() == 10_000);
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| map((line, ""), &profile, false, 1).expect("a map").1)
        };
        assert!(on(1) == a && on(3) == a);
        assert!(map((line, ""), &[2.0; 100], true, 1).expect("a map").1.iter().all(|h| *h == 0.0));
    }

    #[test]
    fn what_is_no_profile_gives_no_map() {
        let said = |grid: Grid| map((grid, ""), &vec![0.0; grid.points()], true, 1).expect_err("refused").to_string();
        assert!(
            said(Grid::unit(20, 20)).contains("20 x 20 points")
                && said(Grid { ny: 1, ..Grid::unit(15, 1) }).contains("16 points")
        );
    }
}
