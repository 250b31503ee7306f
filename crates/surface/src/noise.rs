//! White noise of an instrument in the spectrum of a map.

use crate::statistics::{SpectralDensity, power_spectra};
use asperity_grid::Grid;
use std::f64::consts::TAU;

/// The spectrum is judged over this factor of wave numbers below the highest one along both axes: an octave has three bins.
const JUDGED: f64 = 2.1;

/// Exponent of the density over the wave number, above which the end of a spectrum is flat: white noise has 0. Self-affine surfaces have
/// -2 - 2H; where short waves are folded back by the sampling, -1.5 was the largest at H = 0.3, -2.0 at 0.5 (see the test).
const FLAT: f64 = -0.7;

/// Density over that of the noise from which on a wave is one of the surface: as much of each.
const STANDS_OUT: f64 = 2.0;

/// A flat end of a spectrum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseFloor {
    /// Shortest wavelength that stands out of it, in the unit of the extents.
    pub wavelength: f64,
    /// rms height of white noise with this density on all waves.
    pub rms_height: f64,
}

/// White noise in the heights `[ny, nx]`, if the spectrum ends flat.
pub fn noise_floor(grid: Grid, heights: &[f64], periodic: bool) -> Option<NoiseFloor> {
    let highest = TAU / (2.0 * grid.dx().max(grid.dy()));
    let radial: Vec<SpectralDensity> =
        power_spectra(grid, heights, periodic).radial.into_iter().filter(|d| d.q <= highest).collect();
    let end: Vec<(f64, f64)> = radial
        .iter()
        .filter(|d| d.q > highest / JUDGED && d.density > 0.0)
        .map(|d| (d.q.ln(), d.density.ln()))
        .collect();
    let n = end.len() as f64;
    if end.len() < 3 {
        return None;
    }
    let (x, y) = (end.iter().map(|p| p.0).sum::<f64>() / n, end.iter().map(|p| p.1).sum::<f64>() / n);
    let slope =
        end.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / end.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>();
    // The lowest bin has the least of the surface.
    let density = end.iter().map(|p| p.1.exp()).fold(f64::INFINITY, f64::min);
    let shortest = radial.iter().rev().find(|d| d.density > STANDS_OUT * density)?;
    // Of white noise the density is its mean square times the area of a point.
    let rms_height = (density / (grid.dx() * grid.dy())).sqrt();
    (slope > FLAT).then_some(NoiseFloor { wavelength: TAU / shortest.q, rms_height })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Amplitudes, Modes, Spectrum};
    use rand::{Rng, SeedableRng, rngs::ChaCha8Rng};

    /// Waves of a surface on 1024² points, of which every fourth is taken: short ones are folded back.
    fn sampled(hurst: f64, seed: u64) -> (Grid, Vec<f64>) {
        let spectrum = Spectrum {
            hurst,
            lambda_r: 0.25,
            lambda_s: 1.0 / 500.0,
            rms_gradient: 0.2,
            amplitudes: Amplitudes::Gaussian,
        };
        let fine: Vec<f64> = Modes::new(spectrum, seed, 1.0).heights(Grid::unit(1024, 1024), 0.0);
        let heights = (0..256 * 256).map(|i| fine[(i / 256 * 4) * 1024 + i % 256 * 4]).collect();
        (Grid::unit(256, 256), heights)
    }

    /// Noise is found with its rms height and the wavelength at which both spectra cross; a surface alone has none, whatever its exponent,
    /// whether it repeats or not.
    #[test]
    fn noise_and_roughness_differ() {
        // The noise stands out of the shortest waves.
        for (hurst, share) in [(0.3, 2.0), (0.5, 0.5), (0.8, 0.3), (1.0, 0.2)] {
            for (seed, periodic) in [(1, true), (2, true), (3, false)] {
                let (grid, clean) = sampled(hurst, seed);
                assert_eq!(noise_floor(grid, &clean, periodic), None, "{hurst} {seed}");
                let rms = share * (clean.iter().map(|h| h * h).sum::<f64>() / clean.len() as f64).sqrt();
                let mut random = ChaCha8Rng::seed_from_u64(seed);
                let mut uniform = || f64::from(random.next_u32()) / f64::from(u32::MAX) - 0.5;
                let noisy: Vec<f64> = clean.iter().map(|h| h + rms * 12f64.sqrt() * uniform()).collect();
                let noise = noise_floor(grid, &noisy, periodic).expect("noise");
                assert!((noise.rms_height / rms - 1.0).abs() < 0.25, "{hurst} {seed}: {noise:?} {rms}");
                assert!((1.0 / 128.0..0.2).contains(&noise.wavelength), "{noise:?}");
            }
        }
    }

    #[test]
    fn maps_of_few_points_have_no_noise_floor() {
        assert_eq!(noise_floor(Grid::unit(4, 4), &[0.0; 16], true), None);
    }
}
