//! Predicted cost on a finer grid from the measured costs on coarser grids.

use asperity_grid::bisect;

/// Measured cost of a method on one grid, at fixed precision and tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ran {
    pub points: f64,
    /// FFT pairs of all loads; 0 for methods without transforms.
    pub pairs: f64,
    pub seconds: f64,
}

impl Ran {
    fn work(&self) -> f64 {
        self.points * self.pairs
    }
}

/// Bounds of the exponent of the cost in the number of points, for methods without transforms: from nearly constant
/// cost to interactions of pairs of summits found by neighbour search.
const EXPONENTS: [f64; 2] = [0.01, 1.5];

/// Relative difference below which two times count as equal.
const NOISE: f64 = 0.05;

/// Predicted wall time, s, on a grid of `points` points: a + b W. The work W is the number of points times FFT pairs.
/// For methods without transforms W is a power of the number of points: with the exponent of the finest three grids, or
/// 1 for two grids or if the time does not increase.
///
/// The number of FFT pairs is extrapolated as a power law of the finest two grids. The non-negative a and b minimise
/// the squared relative deviations on all grids. `None` for fewer than two grids. On 61 grid series of 15 methods the
/// prediction was within 30 % for 41, compared with 38 for a constant plus N log N, 32 for the local exponent of the
/// time and 13 for a power law through all grids. For methods without transforms it is too high where the cost depends
/// on bands or summits rather than on points.
pub fn forecast(ran: &[Ran], points: f64) -> Option<f64> {
    let mut ran: Vec<Ran> = ran.iter().copied().filter(|r| r.seconds > 0.0 && r.points > 0.0).collect();
    ran.sort_by(|a, b| a.points.total_cmp(&b.points));
    let [.., previous, last] = ran[..] else { return None };
    let counts_pairs = ran.iter().all(|r| r.pairs > 0.0);
    if let (false, [.., first, _, _]) = (counts_pairs, &ran[..])
        && let Some(power) = power_from_start([*first, previous, last], points)
    {
        return Some(power);
    }
    let pairs = if counts_pairs {
        let exponent = (last.pairs / previous.pairs).ln() / (last.points / previous.points).ln();
        last.pairs * (points / last.points).powf(exponent)
    } else {
        ran.iter_mut().for_each(|r| r.pairs = 1.0);
        1.0
    };
    let target = Ran { points, pairs, seconds: 0.0 };
    let (constant, slope) = line(&ran);
    Some(constant + slope * target.work()).filter(|s| s.is_finite())
}

/// a + b Nᶜ through three grids, from coarse to fine, with c limited to [`EXPONENTS`] (then through the finer two).
/// `None` if the time does not increase from each grid to the next.
fn power_from_start([first, previous, last]: [Ran; 3], points: f64) -> Option<f64> {
    let rises = [previous.seconds - first.seconds, last.seconds - previous.seconds];
    if rises[0] <= NOISE * previous.seconds || rises[1] <= NOISE * last.seconds {
        return None;
    }
    let rise = |from: f64, to: f64, c: f64| (to / last.points).powf(c) - (from / last.points).powf(c);
    let ratio = |c: f64| rise(previous.points, last.points, c) / rise(first.points, previous.points, c);
    // The ratio of the increases grows with the exponent.
    let below = |c: f64| ratio(c) < rises[1] / rises[0];
    let (_, high) = bisect(EXPONENTS[0], EXPONENTS[1], f64::MANTISSA_DIGITS as usize, below);
    Some(last.seconds + rises[1] / rise(previous.points, last.points, high) * rise(last.points, points, high))
}

/// Non-negative constant and slope of time against work that minimise the squared relative deviations.
fn line(ran: &[Ran]) -> (f64, f64) {
    let sum = |value: fn(f64, f64) -> f64| ran.iter().map(|r| value(r.work(), r.seconds)).sum::<f64>();
    let (s0, s1, s2) = (sum(|_, t| 1.0 / (t * t)), sum(|w, t| w / (t * t)), sum(|w, t| w * w / (t * t)));
    let (t0, t1) = (sum(|_, t| 1.0 / t), sum(|w, t| w / t));
    let determinant = s0 * s2 - s1 * s1;
    let (constant, slope) = ((s2 * t0 - s1 * t1) / determinant, (s0 * t1 - s1 * t0) / determinant);
    // If one is negative, only the other is used (the slope through the finest grid). Equal work on all grids gives
    // NaN.
    if constant < 0.0 {
        (0.0, ran.last().map_or(0.0, |r| r.seconds / r.work()))
    } else if slope >= 0.0 {
        (constant, slope)
    } else {
        (t0 / s0, 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of the normal equations, whose terms span the square of the range of work.
    const ROUNDING: f64 = 1e-9;

    fn ran(n: f64, pairs: f64, seconds: f64) -> Ran {
        Ran { points: n * n, pairs, seconds }
    }

    fn close(actual: Option<f64>, expected: f64) {
        assert!(actual.is_some_and(|f| (f / expected - 1.0).abs() < ROUNDING), "{actual:?} is not {expected}");
    }

    /// Constant part of 20 ms, and FFT pairs that grow as the square root of the points per side, as for a solver.
    #[test]
    fn the_cost_of_a_solver_is_predicted() {
        let pairs = |n: f64| 30.0 * n.sqrt();
        let cost = |n: f64| 0.02 + 1e-8 * n * n * pairs(n);
        let grids = |list: &[f64]| list.iter().map(|&n| ran(n, pairs(n), cost(n))).collect::<Vec<_>>();
        close(forecast(&grids(&[64.0, 128.0]), 256.0 * 256.0), cost(256.0));
        close(forecast(&grids(&[512.0, 64.0, 128.0, 256.0]), 1024.0 * 1024.0), cost(1024.0));
        // Without the number of pairs the prediction is too low.
        let blind: Vec<Ran> = grids(&[128.0, 256.0]).iter().map(|r| Ran { pairs: 0.0, ..*r }).collect();
        assert!(forecast(&blind, 512.0 * 512.0).is_some_and(|t| t < 0.8 * cost(512.0)));
    }

    #[test]
    fn costs_without_transforms_are_predicted() {
        let cost = |n: f64| 0.01 + 3e-8 * n * n;
        let all: Vec<Ran> = [32.0, 64.0, 128.0].map(|n| ran(n, 0.0, cost(n))).to_vec();
        close(forecast(&all, 256.0 * 256.0), cost(256.0));
        // Exponents of bands, whose number grows with the logarithm of the number of points, and of interacting
        // neighbours.
        for exponent in [0.1, 0.5, 1.4] {
            let cost = |n: f64| 0.001 + 0.003 * (n * n).powf(exponent);
            let all: Vec<Ran> = [48.0, 64.0, 128.0, 256.0].map(|n| ran(n, 0.0, cost(n))).to_vec();
            close(forecast(&all, 512.0 * 512.0), cost(512.0));
        }
        // The exponent is limited to 1.5, even for noisy times.
        let leaps = [ran(32.0, 0.0, 1.0), ran(64.0, 0.0, 1.1), ran(128.0, 0.0, 2.0)];
        close(forecast(&leaps, 256.0 * 256.0), 2.0 + 0.9 * (8.0 - 1.0) / (1.0 - 0.125));
        // Without a significant increase no exponent is determined; the linear prediction is used.
        let flat = [ran(32.0, 0.0, 1.0), ran(64.0, 0.0, 1.001), ran(128.0, 0.0, 1.1)];
        assert!(forecast(&flat, 256.0 * 256.0).is_some_and(|t| (1.1..1.6).contains(&t)));
        // Equal or decreasing times: the prediction is at least the last time, without growth.
        close(forecast(&[ran(32.0, 0.0, 0.5), ran(64.0, 0.0, 0.5)], 128.0 * 128.0), 0.5);
        let falls = forecast(&[ran(32.0, 0.0, 0.5), ran(64.0, 0.0, 0.4)], 128.0 * 128.0).expect("two grids");
        assert!((0.4..0.5).contains(&falls), "{falls}");
        // Time that grows faster than the number of points: the constant part is zero.
        close(forecast(&[ran(32.0, 0.0, 0.01), ran(64.0, 0.0, 0.1)], 128.0 * 128.0), 0.4);
    }

    #[test]
    fn one_grid_gives_no_forecast() {
        assert_eq!(forecast(&[ran(32.0, 5.0, 1.0)], 4096.0), None);
        assert_eq!(forecast(&[], 4096.0), None);
        // A grid with zero time does not count.
        assert_eq!(forecast(&[ran(32.0, 5.0, 1.0), ran(64.0, 5.0, 0.0)], 4096.0), None);
    }
}
