//! Waves that a map does not have: a realisation of its own spectrum, continued.

use super::digits::digits;
use super::filter::{FilterKind, complement};
use super::regrid::regrid;
use crate::statistics::{SpectralDensity, power_spectra};
use crate::{Amplitudes, Modes, Spectrum};
use asperity_grid::{Error, Grid, Result};
use std::f64::consts::TAU;

/// The spectrum is fitted from the cut-off to this many cut-off wavelengths.
const FITTED: f64 = 8.0;

/// Fewest bins of the spectrum that a line is fitted to: fewer have no slope that is worth the name.
const FEWEST_BINS: usize = 4;

/// Points per shortest wave of the extended map.
const POINTS_PER_WAVE: f64 = 4.0;

/// Least wavelength over the extent. Random numbers of a mode are keyed by mode numbers; long before their limit the grid is too large.
const SHORTEST: f64 = 1e-4;

/// Least Hurst exponent. That of a surface is above 0.
const LEAST_HURST: f64 = 0.01;

/// A self-affine spectrum C(q) = `density` (q/q_c)^(-2-2H) of a map, or with the exponent -1-2H of a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Fit {
    /// H, between `LEAST_HURST` and 1.
    hurst: f64,
    /// H of the slope itself.
    slope: f64,
    /// At the cut-off, for the exponent of `hurst`.
    density: f64,
}

/// Exponent of q of a profile with the same H, less half of that of a map.
fn of_profile(grid: Grid) -> f64 {
    if grid.nx.min(grid.ny) == 1 { 0.5 } else { 0.0 }
}

/// Line of the densities over the wave numbers, both logarithmic, each bin with equal weight. `transfer`: of the filter that they have passed.
fn fit(grid: Grid, radial: &[SpectralDensity], cut_off: f64, transfer: impl Fn(f64) -> f64) -> Option<Fit> {
    let highest = TAU / cut_off;
    let within = radial.iter().filter(|d| d.density > 0.0 && (highest / FITTED..=highest).contains(&d.q));
    let points: Vec<(f64, f64)> =
        within.map(|d| ((d.q / highest).ln(), (d.density / transfer(d.q / highest).powi(2)).ln())).collect();
    if points.len() < FEWEST_BINS {
        return None;
    }
    let n = points.len() as f64;
    let (x, y) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let squares: f64 = points.iter().map(|p| (p.0 - x).powi(2)).sum();
    let slope = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / squares;
    let shift = of_profile(grid);
    let slope = -slope / 2.0 - 1.0 + shift;
    let hurst = slope.clamp(LEAST_HURST, 1.0);
    Some(Fit { hurst, slope, density: (y + 2.0 * (1.0 + hurst - shift) * x).exp() })
}

/// The map with waves down to the length `to`, a realisation of the self-affine spectrum that is fitted to its waves above `cut_off`, the
/// low-pass filter that it has passed. The power of each wave is what the filter has left, and of the fit what it has taken: 1 - T².
///
/// # Errors
/// A wavelength that is not between a ten-thousandth of the extent and the cut-off; a spectrum with too few bins to be fitted; no memory.
pub(super) fn extend(
    (kind, cut_off): (FilterKind, f64),
    (to, seed): (f64, u64),
    grid: Grid,
    heights: Vec<f64>,
    periodic: bool,
) -> Result<(Grid, Vec<f64>, String)> {
    let refused = |found: String, accepted: String| Err(Error::input("preparation", "--extend-to", found, accepted));
    let least = SHORTEST * grid.lx.max(grid.ly);
    if !(least..cut_off).contains(&to) {
        return refused(
            to.to_string(),
            format!("{least} (a ten-thousandth of the extent) to below --low-pass = {cut_off}"),
        );
    }
    let Some(fit) = fit(grid, &power_spectra(grid, &heights, periodic).radial, cut_off, |n| kind.transfer(n)) else {
        let accepted =
            format!("a --low-pass with {FEWEST_BINS} bins of the spectrum between it and {FITTED} times its length");
        return refused("a spectrum that cannot be fitted".into(), accepted);
    };
    let points = [(grid.nx, grid.lx), (grid.ny, grid.ly)].map(|(n, length)| {
        let even = 2 * (POINTS_PER_WAVE / 2.0 * length / to).ceil() as usize;
        // A profile is uniform along y.
        if n == 1 { 1 } else { n.max(even) }
    });
    let old = [grid.nx, grid.ny];
    let (grid, mut heights) = if points == old { (grid, heights) } else { regrid(grid, heights, points, periodic)? };
    let amplitudes = Amplitudes::Gaussian;
    let hurst = fit.hurst - of_profile(grid);
    let spectrum = Spectrum { hurst, lambda_r: 1.0, lambda_s: to / grid.lx, rms_gradient: 1.0, amplitudes };
    let aspect = grid.ly / grid.lx;
    let power = spectrum.expected(aspect, 0.0).power_prefactor * spectrum.relative_power(grid.lx / cut_off);
    let unit = Grid { ly: aspect, ..Grid::unit(grid.nx, grid.ny) };
    let waves = Modes::new(spectrum, seed, aspect).heights(unit, 0.0);
    let factor = (fit.density / (grid.lx * grid.ly) / power).sqrt();
    let waves = complement(kind, cut_off, grid, &waves);
    heights.iter_mut().zip(waves).for_each(|(h, w)| *h += factor * w);
    let own = if fit.hurst == fit.slope { String::new() } else { format!(" (the slope gives {})", digits(fit.slope)) };
    let line = format!(
        "extend from {} to {}: waves of seed {seed}, H = {}{own} fitted up to {}, {} x {} points",
        digits(cut_off),
        digits(to),
        digits(fit.hurst),
        digits(FITTED * cut_off),
        grid.nx,
        grid.ny
    );
    Ok((grid, heights, line))
}

#[cfg(test)]
mod tests {
    use super::super::filter::{self, PassBand};
    use super::*;
    use crate::moments;

    /// Deviation of the mean over the seeds.
    const MEAN: f64 = 0.06;

    fn surface(seed: u64, n: usize, hurst: f64) -> (Grid, Vec<f64>) {
        let spectrum = Spectrum {
            hurst,
            lambda_r: 0.25,
            lambda_s: 1.0 / 128.0,
            rms_gradient: 0.2,
            amplitudes: Amplitudes::Gaussian,
        };
        (Grid::unit(n, n), Modes::new(spectrum, seed, 1.0).heights(Grid::unit(n, n), 0.0))
    }

    /// Maps are cut at a fourth of their resolution and extended again: height, gradient and curvature come back in the mean, and the long waves
    /// are those of the map.
    #[test]
    fn an_extended_map_has_the_gradient_of_the_whole() {
        const SEEDS: u64 = 8;
        let (cut_off, end) = (1.0 / 32.0, 1.0 / 128.0);
        for (kind, hurst) in [FilterKind::Gaussian, FilterKind::Sharp].into_iter().flat_map(|k| [(k, 0.5), (k, 0.8)]) {
            let mut means = [0.0; 3];
            for seed in 0..SEEDS {
                let (grid, whole) = surface(seed, 512, hurst);
                let mut cut = whole.clone();
                filter::apply(kind, PassBand::Long(cut_off), grid, &mut cut, true);
                let (new, extended, line) =
                    extend((kind, cut_off), (end, seed + 100), grid, cut.clone(), true).unwrap();
                assert!(line.contains("H = 0."), "{line}");
                let (a, b, short) = (moments(new, &extended), moments(grid, &whole), moments(grid, &cut));
                assert!(short.rms_gradient < 0.8 * b.rms_gradient);
                let ratios = [a.rms_height / b.rms_height, a.rms_gradient / b.rms_gradient, (a.m4 / b.m4).sqrt()];
                means.iter_mut().zip(ratios).for_each(|(m, r)| *m += r / SEEDS as f64);
                if kind == FilterKind::Sharp {
                    let mut long = extended;
                    filter::apply(kind, PassBand::Long(cut_off), grid, &mut long, true);
                    assert!(long.iter().zip(&cut).all(|(a, b)| (a - b).abs() < 1e-12));
                }
            }
            assert!(means.iter().all(|m| (m - 1.0).abs() < MEAN), "{kind:?} {hurst}: {means:?}");
        }
    }

    /// A coarse map gets the points that its shortest new waves need; a patch and a profile do, too.
    #[test]
    fn coarse_maps_are_refined() {
        let (grid, mut heights) = surface(3, 64, 0.8);
        for periodic in [true, false] {
            let (new, _, line) =
                extend((FilterKind::Gaussian, 0.08), (0.01, 1), grid, heights.clone(), periodic).unwrap();
            assert_eq!((new.nx, new.ny), (400, 400), "{line}");
        }
        heights.truncate(64);
        let line = Grid { nx: 64, ny: 1, lx: 1.0, ly: 1.0 / 64.0 };
        assert!(
            extend((FilterKind::Gaussian, 0.08), (0.01, 1), line, heights, true).is_ok_and(|(new, ..)| new.ny == 1)
        );
    }

    #[test]
    fn what_cannot_be_extended_is_refused() {
        let (grid, heights) = surface(3, 64, 0.8);
        let said = |cut_off: f64, to: f64| {
            extend((FilterKind::Gaussian, cut_off), (to, 1), grid, heights.clone(), true).unwrap_err().to_string()
        };
        assert!(said(0.1, 0.1).contains("to below --low-pass = 0.1"));
        assert!(said(0.1, 1e-5).contains("a ten-thousandth"));
        assert!(said(0.9, 0.1).contains("cannot be fitted"));
    }
}
