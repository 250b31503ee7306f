//! Waves that a map does not have: a realisation of its own spectrum, continued.

use super::digits::{digits, exact, in_unit};
use super::filter::{FilterKind, complement};
use super::regrid::regrid;
use crate::non_periodic::hann_windowed;
use crate::statistics::of_mode_columns;
use crate::{Amplitudes, Modes, Spectrum};
use asperity_grid::sys::expect_memory;
use asperity_grid::{Error, Grid, Result, bisect};
use std::f64::consts::TAU;

/// The spectrum is fitted from the cut-off to this many cut-off wavelengths, or to fewer where it is no power law.
const FITTED: f64 = 8.0;

/// Factor of wavelengths below which the range is not divided further.
const NARROWEST: f64 = 2.0;

/// Difference of the exponents of both halves of a range, over its standard error, from which on the spectrum is no power law.
const DIFFERENT: f64 = 3.0;

/// Standard errors in the stated error of H, which covers it in 19 of 20 cases. With two it was 94 % where a roll-off
/// shortens the range, as the same waves choose it.
const STATED: f64 = 2.3;

/// Stated error of H from which on a warning says so: the power of waves of a tenth of the cut-off is uncertain by a factor of four.
const UNCERTAIN: f64 = 0.3;

/// Fewest waves that a power law is fitted to.
const FEWEST_WAVES: usize = 8;

/// Points per shortest wave of the extended map.
const POINTS_PER_WAVE: f64 = 4.0;

/// Least wavelength over the extent of a map, whose grid would have more points than any memory, and of a profile.
const SHORTEST: f64 = 1e-4;
const SHORTEST_OF_PROFILE: f64 = 1e-7;

/// Longest wave of a patch that is fitted, over its shorter side: the window spreads waves over one or two modes.
const LONGEST_OF_PATCH: f64 = 0.25;

/// Standard errors of a patch over those of as many independent waves, as a window makes neighbours alike: 2.0 on the 20 patches of the test.
const WINDOWED: f64 = 2.0;

/// Least Hurst exponent. That of a surface is above 0.
const LEAST_HURST: f64 = 0.01;

/// Changes the seed: waves of a synthesised map of the same seed have other phases.
const OWN_STREAM: u64 = 0x0065_7874_656e_6400;

/// A self-affine spectrum: A |a|² = `density` (q/q_c)^(-2-2H) of the waves of a map of area A, L |a|² with the exponent -1-2H of a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SelfAffine {
    /// H, between `LEAST_HURST` and 1.
    hurst: f64,
    /// H of the slope itself.
    slope: f64,
    /// Of the slope: it covers H in 19 of 20 cases.
    error: f64,
    /// At the cut-off, for `hurst`.
    density: f64,
    /// Longest wavelength that was fitted.
    longest: f64,
}

/// 1 + H is half of the exponent of a map, 1/2 + H of a profile.
fn of_profile(grid: Grid) -> f64 {
    if grid.nx.min(grid.ny) == 1 { 0.5 } else { 0.0 }
}

fn measure(grid: Grid) -> f64 {
    grid.lx * if of_profile(grid) > 0.0 { 1.0 } else { grid.ly }
}

/// Waves as (ln(q_c/q), |a|²).
type Waves = [(f64, f64)];

/// The exponent of the power law with the largest likelihood, and its standard error: |a|² are distributed exponentially about C(q) (Whittle,
/// Ark. Mat. 2 (1953) 423).
fn exponent(waves: &Waves) -> [f64; 2] {
    /// Exponents that are searched.
    const RANGE: [f64; 2] = [-4.0, 12.0];
    const HALVINGS: usize = 40;
    let n = waves.len() as f64;
    let mean = waves.iter().map(|w| w.0).sum::<f64>() / n;
    // n ln Σ |a|² exp(-β x) + β Σ x has its minimum where the weighted mean of x is the plain one.
    let below = |beta: f64| waves.iter().map(|(x, p)| p * (-beta * (x - mean)).exp() * (x - mean)).sum::<f64>() > 0.0;
    let (low, high) = bisect(RANGE[0], RANGE[1], HALVINGS, below);
    let squares: f64 = waves.iter().map(|w| (w.0 - mean).powi(2)).sum();
    [(low + high) / 2.0, 1.0 / squares.sqrt()]
}

/// The self-affine spectrum of the waves above `cut_off`, the low-pass filter that the map has passed.
///
/// # Errors
/// Too few waves.
pub(super) fn fit(
    (kind, cut_off): (FilterKind, f64),
    grid: Grid,
    heights: &[f64],
    periodic: bool,
) -> Result<SelfAffine> {
    let windowed = (!periodic).then(|| hann_windowed(grid, heights));
    let longest = if periodic { f64::INFINITY } else { LONGEST_OF_PATCH * grid.lx.min(grid.ly) };
    let range = FITTED.min(longest / cut_off);
    let highest = TAU / cut_off;
    let waves = of_mode_columns(grid, windowed.as_deref().unwrap_or(heights), |i, column| {
        let waves = column.iter().enumerate().map(|(j, a)| (grid.qx(i).hypot(grid.qy(j)), a.norm_sqr()));
        // Of the first column both signs of qy are there, which are one wave.
        let waves = waves.take(if i == 0 { grid.ny / 2 + 1 } else { grid.ny });
        let fitted = waves.filter(|(q, p)| (highest / range..=highest).contains(q) && *p > 0.0);
        fitted.map(|(q, p)| ((highest / q).ln(), p / kind.transfer(q / highest).powi(2))).collect::<Vec<_>>()
    });
    let mut waves = waves.concat();
    if waves.len() < FEWEST_WAVES {
        let accepted = format!("a shorter --low-pass, with {FEWEST_WAVES} waves up to {FITTED} times its length");
        return Err(Error::input("preparation", "--extend-to", format!("{} waves to fit", waves.len()), accepted));
    }
    let mut range = range.ln();
    while range > NARROWEST.ln() {
        let (short, long): (Vec<_>, Vec<_>) = waves.iter().partition(|w| w.0 <= range / 2.0);
        if short.len().min(long.len()) < FEWEST_WAVES {
            break;
        }
        let [[a, da], [b, db]] = [exponent(&short), exponent(&long)];
        if (a - b).abs() <= DIFFERENT * da.hypot(db) {
            break;
        }
        (waves, range) = (short, range / 2.0);
    }
    let shift = of_profile(grid);
    let [exponent, error] = exponent(&waves);
    let error = if periodic { error } else { WINDOWED * error };
    let (slope, error) = (exponent / 2.0 - 1.0 + shift, STATED * error / 2.0);
    let hurst = slope.clamp(LEAST_HURST, 1.0);
    // Next to the cut-off where H is not that of the slope.
    let power = |(x, p): &(f64, f64)| p * (-2.0 * (1.0 + hurst - shift) * x).exp();
    let near: Vec<f64> = waves.iter().filter(|w| w.0 <= NARROWEST.ln()).map(power).collect();
    let near = if near.len() < FEWEST_WAVES { waves.iter().map(power).collect() } else { near };
    let density = measure(grid) * near.iter().sum::<f64>() / near.len() as f64;
    Ok(SelfAffine { hurst, slope, error, density, longest: cut_off * range.exp() })
}

impl SelfAffine {
    /// What makes the extension a guess.
    pub(super) fn warning(&self, unit: &str) -> Option<String> {
        let (slope, error) = (self.slope, self.error);
        let why = if self.hurst != slope {
            format!("their spectrum has the slope of H = {}, which is that of no self-affine surface", digits(slope))
        } else if error > UNCERTAIN {
            format!("their H = {} has an error of {}", digits(slope), digits(error))
        } else {
            return None;
        };
        let longest = in_unit(digits(self.longest), unit);
        Some(format!(
            "waves are added by --extend-to as those up to {longest} have it, but {why}: the extension is a guess"
        ))
    }

    /// The map with waves down to the length `to`, a realisation of this spectrum. The power of each wave is what the filter has left, and of
    /// the fit what it has taken: 1 - T².
    ///
    /// # Errors
    /// A wavelength that is not between a ten-thousandth of the extent and the cut-off; a map that does not hold the cut-off; no memory.
    pub(super) fn extend(
        &self,
        (kind, cut_off, unit): (FilterKind, f64, &str),
        (to, seed): (f64, u64),
        grid: Grid,
        heights: Vec<f64>,
        periodic: bool,
    ) -> Result<(Grid, Vec<f64>, String)> {
        let refused =
            |key: &str, found: String, accepted: String| Err(Error::input("preparation", key, found, accepted));
        let shift = of_profile(grid);
        let shortest = if shift > 0.0 { SHORTEST_OF_PROFILE } else { SHORTEST };
        let least = shortest * grid.lx.max(grid.ly);
        if !(least..cut_off).contains(&to) {
            let [least, cut_off] = [least, cut_off].map(|length| in_unit(digits(length), unit));
            let accepted = format!("{least} ({shortest} of the extent) to below --low-pass = {cut_off}");
            return refused("--extend-to", in_unit(exact(to), unit), accepted);
        }
        let axes = [(grid.nx, grid.lx), (grid.ny, grid.ly)];
        let pixel = axes.iter().filter(|(n, _)| *n > 1).map(|(n, length)| length / *n as f64).fold(0.0, f64::max);
        if 2.0 * pixel > cut_off {
            let cut_off = in_unit(digits(cut_off), unit);
            let accepted = format!("points that hold waves of --low-pass = {cut_off} with --extend-to");
            return refused("--resample", format!("{} x {}", grid.nx, grid.ny), accepted);
        }
        let points = axes.map(|(n, length)| {
            let even = 2 * (POINTS_PER_WAVE / 2.0 * length / to).ceil() as usize;
            // A profile is uniform along y.
            if n == 1 { 1 } else { n.max(even) }
        });
        // Heights, new waves, and their spectra.
        let bytes = 4 * size_of::<f64>() as u64 * points[0] as u64 * points[1] as u64;
        expect_memory(
            format!("a map of {} x {} points", points[0], points[1]),
            bytes,
            "a longer --extend-to needs fewer",
        )?;
        let old = [grid.nx, grid.ny];
        let (grid, mut heights) =
            if points == old { (grid, heights) } else { regrid(grid, heights, points, periodic)? };
        let aspect = grid.ly / grid.lx;
        // Without a plateau in the cell.
        let spectrum = Spectrum {
            hurst: self.hurst - shift,
            lambda_r: aspect.max(1.0),
            lambda_s: to / grid.lx,
            rms_gradient: 1.0,
            amplitudes: Amplitudes::Gaussian,
        };
        let scale = (self.density / measure(grid) / spectrum.relative_power(grid.lx / cut_off)).sqrt();
        let cell = Grid { ly: aspect, ..Grid::unit(grid.nx, grid.ny) };
        let waves = Modes::new(spectrum, seed ^ OWN_STREAM, aspect).scaled_heights(cell, 0.0, scale);
        let waves = complement(kind, cut_off, grid, &waves);
        heights.iter_mut().zip(waves).for_each(|(h, w)| *h += w);
        let (slope, error) = (digits(self.slope), digits(self.error));
        let line = format!(
            "extend from {} to {}: waves of seed {seed}, H = {} (fit {slope} ± {error} up to {}), {} x {} points",
            in_unit(exact(cut_off), unit),
            in_unit(exact(to), unit),
            digits(self.hurst),
            in_unit(digits(self.longest), unit),
            grid.nx,
            grid.ny
        );
        Ok((grid, heights, line))
    }
}

#[cfg(test)]
mod tests {
    use super::super::filter::{self, PassBand};
    use super::*;
    use crate::moments;

    /// Deviation of the mean over eight surfaces of rms height, gradient and curvature from those of the whole ones: of single ones H has an
    /// error of 0.03 to 0.1.
    const MEAN: f64 = 0.08;

    const CUT_OFF: f64 = 1.0 / 32.0;
    const END: f64 = 1.0 / 128.0;

    fn surface(seed: u64, grid: Grid, (hurst, lambda_r): (f64, f64)) -> Vec<f64> {
        let spectrum = Spectrum { hurst, lambda_r, lambda_s: END, rms_gradient: 0.2, amplitudes: Amplitudes::Gaussian };
        Modes::new(spectrum, seed, grid.ly).heights(grid, 0.0)
    }

    /// A profile has |a|² as q^(-1-2H): the waves along x of a map with H - 1/2.
    fn profile(seed: u64, grid: Grid, hurst: f64) -> Vec<f64> {
        let unit = Grid { ly: grid.ly / grid.lx, ..Grid::unit(grid.nx, 1) };
        let (lambda_r, lambda_s, amplitudes) = (0.5, END / grid.lx, Amplitudes::Gaussian);
        let spectrum = Spectrum { hurst: hurst - 0.5, lambda_r, lambda_s, rms_gradient: 1.0, amplitudes };
        Modes::new(spectrum, seed, unit.ly).scaled_heights(unit, 0.0, 1.0)
    }

    fn extended(
        kind: FilterKind,
        seed: u64,
        grid: Grid,
        heights: &[f64],
        periodic: bool,
    ) -> (Grid, Vec<f64>, SelfAffine) {
        let fit = fit((kind, CUT_OFF), grid, heights, periodic).unwrap();
        let (new, heights, _) = fit.extend((kind, CUT_OFF, ""), (END, seed), grid, heights.to_vec(), periodic).unwrap();
        (new, heights, fit)
    }

    /// Means over eight surfaces of the ratios of rms height, gradient and curvature of an extended map and the whole. The seed of the added
    /// waves is that of the surface.
    fn ratios(kind: FilterKind, grid: Grid, law: (f64, f64)) -> [f64; 3] {
        const SEEDS: u64 = 8;
        let mut means = [0.0; 3];
        for seed in 0..SEEDS {
            let whole = surface(seed, grid, law);
            let mut cut = whole.clone();
            filter::apply(kind, PassBand::Long(CUT_OFF), grid, &mut cut, true);
            let (new, heights, _) = extended(kind, seed, grid, &cut, true);
            let (a, b, short) = (moments(new, &heights), moments(grid, &whole), moments(grid, &cut));
            assert!(short.rms_gradient < 0.9 * b.rms_gradient);
            let ratios = [a.rms_height / b.rms_height, a.rms_gradient / b.rms_gradient, (a.m4 / b.m4).sqrt()];
            means.iter_mut().zip(ratios).for_each(|(m, r)| *m += r / SEEDS as f64);
            if kind == FilterKind::Sharp {
                let mut long = heights;
                filter::apply(kind, PassBand::Long(CUT_OFF), new, &mut long, true);
                assert!(long.iter().zip(&cut).all(|(a, b)| (a - b).abs() < 1e-12));
            }
        }
        means
    }

    /// Height, gradient and curvature of maps come back in the mean, with a roll-off within the fitted range, too, and of oblong cells; the long
    /// waves are those of the map.
    #[test]
    fn an_extended_map_has_the_gradient_of_the_whole() {
        let square = Grid::unit(512, 512);
        let oblong = [Grid { ly: 0.25, ..Grid::unit(512, 128) }, Grid { ly: 4.0, ..Grid::unit(512, 2048) }];
        for (kind, grid, law) in [
            (FilterKind::Gaussian, square, (0.5, 0.25)),
            (FilterKind::Gaussian, square, (0.8, 1.0)),
            (FilterKind::Gaussian, square, (0.8, 0.125)),
            (FilterKind::Sharp, square, (0.8, 0.125)),
            (FilterKind::Sharp, square, (0.3, 0.25)),
            (FilterKind::Gaussian, oblong[0], (0.8, 0.25)),
            (FilterKind::Gaussian, oblong[1], (0.8, 0.25)),
        ] {
            let means = ratios(kind, grid, law);
            assert!(means.iter().all(|m| (m - 1.0).abs() < MEAN), "{kind:?} {grid:?} {law:?}: {means:?}");
        }
    }

    /// Of a profile the power of the added waves is that of the whole in the mean over many, as one has few waves to fit.
    #[test]
    fn an_extended_profile_has_the_gradient_of_the_whole() {
        const SEEDS: u64 = 24;
        let grid = Grid { nx: 8192, ny: 1, lx: 16.0, ly: 1.0 / 512.0 };
        for hurst in [0.3, 0.8] {
            let mut sum = [0.0; 2];
            for seed in 0..SEEDS {
                let whole = profile(seed, grid, hurst);
                let mut cut = whole.clone();
                filter::apply(FilterKind::Gaussian, PassBand::Long(CUT_OFF), grid, &mut cut, true);
                let (new, heights, fit) = extended(FilterKind::Gaussian, seed, grid, &cut, true);
                assert!((fit.slope - hurst).abs() < 2.0 * fit.error && fit.warning("um").is_none(), "{fit:?}");
                sum[0] += moments(new, &heights).m2;
                sum[1] += moments(grid, &whole).m2;
            }
            assert!((sum[0] / sum[1] - 1.0).abs() < 0.15, "{hurst}: {sum:?}");
        }
    }

    /// The stated error of H covers it in 19 of 20 cases of each kind: maps, with a roll-off within the fitted range, patches and profiles.
    #[test]
    fn the_error_of_the_exponent_covers_it() {
        const SEEDS: u64 = 200;
        let grid = Grid::unit(256, 256);
        let half = Grid { nx: 128, ny: 128, lx: 0.5, ly: 0.5 };
        let line = Grid { nx: 4096, ny: 1, lx: 16.0, ly: 1.0 / 256.0 };
        let fitted = |grid: Grid, heights: &[f64], periodic: bool, hurst: f64| {
            let fit = fit((FilterKind::Gaussian, CUT_OFF), grid, heights, periodic).unwrap();
            usize::from((fit.slope - hurst).abs() < fit.error)
        };
        for hurst in [0.3, 0.8] {
            let mut covered = [0; 4];
            for seed in 9000..9000 + SEEDS {
                for (k, lambda_r) in [(0, 1.0), (1, 0.125)] {
                    let mut cut = surface(seed, grid, (hurst, lambda_r));
                    filter::apply(FilterKind::Gaussian, PassBand::Long(CUT_OFF), grid, &mut cut, true);
                    covered[k] += fitted(grid, &cut, true, hurst);
                    if k == 0 {
                        let part: Vec<f64> = (0..128 * 128).map(|i| cut[i / 128 * 256 + i % 128]).collect();
                        covered[2] += fitted(half, &part, false, hurst);
                    }
                }
                let mut cut = profile(seed, line, hurst);
                filter::apply(FilterKind::Gaussian, PassBand::Long(CUT_OFF), line, &mut cut, true);
                covered[3] += fitted(line, &cut, true, hurst);
            }
            assert!(covered.iter().all(|n| 20 * n >= 19 * SEEDS as usize), "H = {hurst}: {covered:?} of {SEEDS}");
        }
    }

    /// A spectrum that is no power law is a warning, and a flat map is refused.
    #[test]
    fn what_is_not_self_affine_is_named() {
        let grid = Grid::unit(512, 512);
        let of = |heights: &[f64]| fit((FilterKind::Gaussian, CUT_OFF), grid, heights, true);
        // White noise.
        let mut random = 1u64;
        let noise: Vec<f64> = std::iter::repeat_with(|| {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (random >> 11) as f64 / (1u64 << 53) as f64
        })
        .take(grid.points())
        .collect();
        assert!(of(&noise).unwrap().warning("um").is_some_and(|w| w.contains("no self-affine surface")));
        assert!(of(&vec![0.0; grid.points()]).unwrap_err().to_string().contains("0 waves to fit"));
    }

    /// A coarse map gets the points that its shortest new waves need; a profile along x only.
    #[test]
    fn coarse_maps_are_refined() {
        let heights = surface(3, Grid::unit(64, 64), (0.8, 0.25));
        let law = (FilterKind::Gaussian, 0.08, "");
        for (ny, points) in [(64, 400), (1, 1)] {
            let grid = Grid { nx: 64, ny, lx: 1.0, ly: ny as f64 / 64.0 };
            let heights = heights[..64 * ny].to_vec();
            let fit = SelfAffine { hurst: 0.8, slope: 0.8, error: 0.1, density: 1e-8, longest: 0.5 };
            let (new, ..) = fit.extend(law, (0.01, 1), grid, heights, true).unwrap();
            assert_eq!((new.nx, new.ny), (400, points));
        }
    }

    #[test]
    fn what_cannot_be_extended_is_refused() {
        let (grid, heights) = (Grid::unit(64, 64), surface(3, Grid::unit(64, 64), (0.8, 0.25)));
        let fit = SelfAffine { hurst: 0.8, slope: 0.8, error: 0.1, density: 1e-8, longest: 0.5 };
        let said = |cut_off: f64, to: f64| {
            fit.extend((FilterKind::Gaussian, cut_off, "um"), (to, 1), grid, heights.clone(), true)
                .unwrap_err()
                .to_string()
        };
        assert!(said(0.1, 0.1).contains("to below --low-pass = 0.1 um"));
        assert!(said(0.1, 1e-5).contains("(0.0001 of the extent)"));
        assert!(said(0.03, 0.01).contains("--resample = 64 x 64"));
    }
}
