//! Filters that remove short or long waves.

use super::digits::{exact, in_unit};
use super::rows::along_both;
use asperity_grid::error::{Error, Result};
use asperity_grid::{Grid, Real, Transform, mean, next_fast_len};
use rustfft::num_complex::Complex;
use serde::{Deserialize, Serialize};
use std::f64::consts::{LN_2, PI, TAU};

/// Transfer function of a filter.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum FilterKind {
    /// ISO 16610-61: half of the amplitude passes at the cut-off wavelength.
    #[default]
    Gaussian,
    /// All waves up to the cut-off pass, none beyond it.
    Sharp,
}

impl FilterKind {
    pub(super) fn word(self) -> &'static str {
        match self {
            FilterKind::Gaussian => "gaussian",
            FilterKind::Sharp => "sharp",
        }
    }

    /// Share of the amplitude of a wave that passes, by the number of waves per cut-off wavelength.
    pub(super) fn transfer(self, n: f64) -> f64 {
        match self {
            FilterKind::Gaussian => (-LN_2 * n * n).exp(),
            FilterKind::Sharp => f64::from(u8::from(n <= 1.0 + 1e-9)),
        }
    }
}

/// The waves that pass, by the cut-off wavelength.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum PassBand {
    /// Long waves: a low-pass filter.
    Long(f64),
    /// Short waves: a high-pass filter.
    Short(f64),
}

impl PassBand {
    fn cut_off(self) -> f64 {
        let (PassBand::Long(cut_off) | PassBand::Short(cut_off)) = self;
        cut_off
    }

    pub(super) fn words(self, unit: &str) -> String {
        match self {
            PassBand::Long(cut_off) => format!("low-pass {}", in_unit(exact(cut_off), unit)),
            PassBand::Short(cut_off) => format!("high-pass {}", in_unit(exact(cut_off), unit)),
        }
    }
}

/// Shortest cut-off in points (of the longer pixel side). A wave has at least two. The weights of a patch are samples of the Gaussian:
/// with four, the transfer at the cut-off is 0.502 instead of 0.5, with two it would be 0.89.
const FEWEST_POINTS: f64 = 2.0;
const FEWEST_POINTS_OF_PATCH: f64 = 4.0;

/// Weights are included as far as they exceed 1e-16 of the central one: that many cut-off wavelengths.
const REACH: f64 = 1.62;

/// The filter. Refuses one without a cut-off, cut-offs that the map does not resolve, an empty band, and a sharp filter of a patch.
pub(super) fn check(
    given: Option<FilterKind>,
    [low, high]: [Option<f64>; 2],
    (grid, unit): (Grid, &str),
    periodic: bool,
) -> Result<FilterKind> {
    let refuse = |key: &str, found: String, accepted: String| Err(Error::input("preparation", key, found, accepted));
    let kind = given.unwrap_or_default();
    if given.is_some() && low.is_none() && high.is_none() {
        let accepted = "only together with a cut-off wavelength, --low-pass or --high-pass";
        return refuse("--filter", kind.word().to_string(), accepted.to_string());
    }
    if kind == FilterKind::Sharp && !periodic {
        let accepted = "gaussian, which respects edges: the waves of a map that does not repeat are not known";
        return refuse("--filter", "sharp".to_string(), accepted.to_string());
    }
    let points = if periodic { FEWEST_POINTS } else { FEWEST_POINTS_OF_PATCH };
    let (shortest, longest) = (points * grid.dx().max(grid.dy()), grid.lx.max(grid.ly));
    for (key, cut_off) in [("--low-pass", low), ("--high-pass", high)] {
        if let Some(cut_off) = cut_off.filter(|c| !(shortest..=longest).contains(c)) {
            let [shortest, longest] = [shortest, longest].map(|length| in_unit(exact(length), unit));
            let accepted = format!("{shortest} ({points} points) to {longest} (the extent)");
            return refuse(key, in_unit(exact(cut_off), unit), accepted);
        }
    }
    match (low, high) {
        (Some(low), Some(high)) if low >= high => {
            let [low, high] = [low, high].map(|cut_off| in_unit(exact(cut_off), unit));
            refuse("--low-pass", low, format!("less than --high-pass = {high}, so that waves between them pass"))
        }
        _ => Ok(kind),
    }
}

/// Lets the waves of a band pass. The mean belongs to the long waves.
pub(super) fn apply(kind: FilterKind, band: PassBand, grid: Grid, heights: &mut [f64], periodic: bool) {
    let cut_off = band.cut_off();
    let smooth = match periodic {
        true => waves(|qx, qy| kind.transfer(cut_off * qx.hypot(qy) / TAU), grid, heights),
        false => regression(cut_off, grid, heights),
    };
    heights.iter_mut().zip(smooth).for_each(|(h, s)| {
        *h = match band {
            PassBand::Long(_) => s,
            PassBand::Short(_) => *h - s,
        }
    });
}

/// The waves of a map that repeats with the power which a low-pass filter takes: 1 - T².
pub(super) fn complement(kind: FilterKind, cut_off: f64, grid: Grid, heights: &[f64]) -> Vec<f64> {
    waves(|qx, qy| (1.0 - kind.transfer(cut_off * qx.hypot(qy) / TAU).powi(2)).sqrt(), grid, heights)
}

/// A map that repeats, shifted along x and y by its Fourier coefficients.
pub(crate) fn shifted(shift: [f64; 2], grid: Grid, heights: &[f64]) -> Vec<f64> {
    let nyquist =
        [(grid.nx, grid.dx()), (grid.ny, grid.dy())].map(|(n, d)| if n % 2 == 0 { PI / d } else { f64::INFINITY });
    let along = |axis: usize, q: f64| match q.abs() < nyquist[axis] * (1.0 - 1e-9) {
        true => Complex::cis(-q * shift[axis]),
        // Both signs of a Nyquist wave are one.
        false => Complex::from((q * shift[axis]).cos()),
    };
    waves(|qx, qy| along(0, qx) * along(1, qy), grid, heights)
}

/// The waves of a map that repeats, each multiplied by its transfer, by its Fourier coefficients.
fn waves<T>(transfer: impl Fn(f64, f64) -> T + Sync, grid: Grid, heights: &[f64]) -> Vec<f64>
where
    Complex<f64>: std::ops::MulAssign<T>,
    T: std::ops::Mul<f64, Output = T>,
{
    let fraction = 1.0 / grid.points() as f64;
    let transform = Transform::<f64>::new(grid);
    let mut spectrum = transform.spectrum();
    // Without the mean, so that it costs the waves no digits.
    let mean = mean(heights);
    let filter = |i: usize, column: &mut [Complex<f64>]| {
        for (j, a) in column.iter_mut().enumerate() {
            *a *= transfer(grid.qx(i), grid.qy(j)) * fraction;
        }
        0.0
    };
    transform.forward_of(
        &|y, row| row.iter_mut().zip(&heights[y * grid.nx..]).for_each(|(r, h)| *r = h - mean),
        &mut spectrum,
    );
    let mut smooth = vec![0.0; heights.len()];
    transform.inverse_after(&mut spectrum, &mut smooth, &filter);
    smooth.iter_mut().for_each(|h| *h += mean);
    smooth
}

/// The long waves of a patch: the Gaussian regression of order zero, whose weights add up to one also near the edges. On a rectangle
/// it is one regression along x after another along y.
fn regression(cut_off: f64, grid: Grid, heights: &[f64]) -> Vec<f64> {
    let mean = mean(heights);
    let lines = [(grid.nx, grid.dx()), (grid.ny, grid.dy())].map(|(n, d)| Smoothing::new(n, cut_off / d));
    let centred: Vec<f64> = heights.iter().map(|h| h - mean).collect();
    let apply = |axis: usize, from: &[f64], to: &mut [f64]| lines[axis].apply(from, to);
    let mut smooth = along_both(grid.nx, &centred, [grid.nx, grid.ny], apply);
    smooth.iter_mut().for_each(|h| *h += mean);
    smooth
}

/// The regression on a line, as a product of Fourier coefficients on a line that is longer by the reach of the weights.
struct Smoothing {
    forward: std::sync::Arc<dyn realfft::RealToComplex<f64>>,
    inverse: std::sync::Arc<dyn realfft::ComplexToReal<f64>>,
    /// Coefficients of the weights, over the number of points.
    transfer: Vec<f64>,
    /// Sum of the weights that are on the line, for each of its points.
    sums: Vec<f64>,
}

impl Smoothing {
    /// `cut_off` in points.
    fn new(n: usize, cut_off: f64) -> Self {
        let reach = ((REACH * cut_off).ceil() as usize).min(n - 1);
        let long = next_fast_len(n + reach);
        let alpha = (LN_2 / PI).sqrt();
        let weight = |k: usize| (-PI * (k as f64 / (alpha * cut_off)).powi(2)).exp();
        let (forward, inverse) = f64::plan_real(long);
        let mut line = forward.make_input_vec();
        line[0] = weight(0);
        for k in 1..=reach {
            line[k] = weight(k);
            line[long - k] = weight(k);
        }
        // Sums of the weights to one side, with the central one.
        let one_side: Vec<f64> = (0..n)
            .scan(0.0, |sum, k| {
                *sum += if k <= reach { weight(k) } else { 0.0 };
                Some(*sum)
            })
            .collect();
        let sums = (0..n).map(|i| one_side[i] + one_side[n - 1 - i] - weight(0)).collect();
        let mut spectrum = forward.make_output_vec();
        forward.process(&mut line, &mut spectrum).expect("line and spectrum have the plan's lengths");
        let transfer = spectrum.iter().map(|a| a.re / long as f64).collect();
        Smoothing { forward, inverse, transfer, sums }
    }

    fn apply(&self, from: &[f64], to: &mut [f64]) {
        const LENGTHS: &str = "line and spectrum have the plan's lengths";
        let (mut line, mut spectrum) = (self.forward.make_input_vec(), self.forward.make_output_vec());
        line[..from.len()].copy_from_slice(from);
        self.forward.process(&mut line, &mut spectrum).expect(LENGTHS);
        spectrum.iter_mut().zip(&self.transfer).for_each(|(a, t)| *a *= t);
        // Their imaginary parts are rounding, and exactly zero where the line is.
        for real in [0, spectrum.len() - 1] {
            spectrum[real].im = 0.0;
        }
        self.inverse.process(&mut spectrum, &mut line).expect(LENGTHS);
        to.iter_mut().zip(&line).zip(&self.sums).for_each(|((t, l), s)| *t = l / s);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUT_OFF: f64 = 0.25;

    fn wave(grid: Grid, kx: f64, ky: f64) -> Vec<f64> {
        let phase = |i: usize| TAU * (kx * (i % grid.nx) as f64 * grid.dx() + ky * (i / grid.nx) as f64 * grid.dy());
        (0..grid.points()).map(|i| 3.0 + phase(i).cos()).collect()
    }

    /// Waves of a periodic map are multiplied by the transfer function: half at the cut-off.
    #[test]
    fn periodic_waves_have_the_transfer_of_the_standard() {
        let grid = Grid { nx: 30, ny: 48, lx: 1.0, ly: 2.0 };
        for (kx, ky, gaussian, sharp) in
            [(4.0, 0.0, 0.5, 1.0), (0.0, 2.0, 0.5f64.powf(0.25), 1.0), (4.0, 0.5, 0.5f64.powf(65.0 / 64.0), 0.0)]
        {
            for (kind, transfer) in [(FilterKind::Gaussian, gaussian), (FilterKind::Sharp, sharp)] {
                let previous = wave(grid, kx, ky);
                let filtered = |band| {
                    let mut h = previous.clone();
                    apply(kind, band, grid, &mut h, true);
                    h
                };
                let (long, short) = (filtered(PassBand::Long(CUT_OFF)), filtered(PassBand::Short(CUT_OFF)));
                for (i, h) in previous.iter().enumerate() {
                    let expected = 3.0 + transfer * (h - 3.0);
                    assert!((long[i] - expected).abs() < 1e-13, "{kind:?} {kx} {ky}: {} {expected}", long[i]);
                    assert!((short[i] - (h - expected)).abs() < 1e-13);
                }
            }
        }
    }

    /// Far from the edges the regression has the same transfer. Its error vanishes faster than any power of the pixel: it is that of
    /// the sampled Gaussian, 2^(1 - (points)² + 2 points) to leading order.
    #[test]
    fn the_regression_converges_to_the_transfer_of_the_standard() {
        let error = |points: usize| {
            // Eight waves of the cut-off's length; the middle is four from the edges.
            let grid = Grid { nx: 8 * points, ny: 1, lx: 8.0 * CUT_OFF, ly: 1.0 };
            let smooth = regression(CUT_OFF, grid, &wave(grid, 1.0 / CUT_OFF, 0.0));
            (smooth[grid.nx / 2] - 3.5).abs()
        };
        let leading = |points: usize| 0.5f64.powi((points * points - 2 * points) as i32 + 1);
        for points in [4, 5, 6] {
            let (error, leading) = (error(points), leading(points));
            assert!((error / leading - 1.0).abs() < 0.02, "{points}: {error:e} {leading:e}");
        }
        // Rounding of the truncated weights.
        assert!(error(12) < 1e-15, "{:e}", error(12));
    }

    /// Against sums over all points with weights that add up to one, up to the corners; constants are unchanged.
    #[test]
    fn the_regression_is_the_weighted_mean() {
        let grid = Grid { nx: 13, ny: 22, lx: 1.3, ly: 4.4 };
        let heights: Vec<f64> = (0..grid.points()).map(|i| 5.0 + ((i * i * 13 + i) % 31) as f64 / 31.0).collect();
        let cut_off = 0.8;
        let smooth = regression(cut_off, grid, &heights);
        let weight = |d: f64| (-PI * d * d / (LN_2 / PI * cut_off * cut_off)).exp();
        for (node, smooth) in smooth.iter().enumerate() {
            let (mut sum, mut sum_of_weights) = (0.0, 0.0);
            for (i, h) in heights.iter().enumerate() {
                let difference = |a: usize, b: usize, d: f64| (a as f64 - b as f64) * d;
                let (x, y) = (difference(node % 13, i % 13, grid.dx()), difference(node / 13, i / 13, grid.dy()));
                let w = weight(x) * weight(y);
                sum += w * h;
                sum_of_weights += w;
            }
            assert!((smooth - sum / sum_of_weights).abs() < 1e-13, "{node}");
        }
        let mut level = vec![1e6; grid.points()];
        apply(FilterKind::Gaussian, PassBand::Long(cut_off), grid, &mut level, false);
        assert!(level.iter().all(|h| *h == 1e6));
    }

    #[test]
    fn cut_offs_that_cannot_be_filtered_are_refused() {
        let grid = Grid { nx: 100, ny: 50, lx: 10.0, ly: 10.0 };
        let says =
            |kind, low, high, periodic| check(Some(kind), [low, high], (grid, "um"), periodic).unwrap_err().to_string();
        let (gaussian, sharp) = (FilterKind::Gaussian, FilterKind::Sharp);
        assert!(says(sharp, Some(1.0), None, false).contains("--filter = sharp; accepted: gaussian"));
        assert!(
            says(gaussian, Some(0.5), None, false)
                .contains("--low-pass = 0.5 um; accepted: 0.8 um (4 points) to 10 um")
        );
        assert!(
            says(gaussian, None, Some(11.0), true)
                .contains("--high-pass = 11 um; accepted: 0.4 um (2 points) to 10 um")
        );
        assert!(
            says(gaussian, Some(3.0), Some(2.0), true)
                .contains("--low-pass = 3 um; accepted: less than --high-pass = 2 um")
        );
        assert!(says(gaussian, Some(f64::NAN), None, true).contains("NaN"));
        assert!(
            check(Some(gaussian), [Some(0.5), Some(2.0)], (grid, ""), true).is_ok_and(|kind| kind == gaussian)
                && check(None, [None, Some(2.0)], (grid, ""), false).is_ok_and(|kind| kind == gaussian)
                && check(None, [None, None], (grid, ""), false).is_ok()
        );
    }
}
