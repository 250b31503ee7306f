//! What a grid costs that was not run, from those that were.

/// A grid that a method ran on in one precision and to one tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ran {
    pub points: f64,
    /// Transform pairs of all loads; 0 of a method that counts none.
    pub pairs: f64,
    pub seconds: f64,
}

impl Ran {
    fn work(&self) -> f64 {
        self.points * self.pairs
    }
}

/// Exponents of the points that a cost which counts no pairs may grow with: from that of a few numbers, whatever the grid, to that
/// of pairs of summits that are found through neighbours.
const EXPONENTS: [f64; 2] = [0.01, 1.5];

/// Part of a time below which two do not differ.
const NOISE: f64 = 0.05;

/// Seconds on a grid of so many points: a + b W, where the work W is points times transform pairs, or, for methods that count
/// none, a power of the points: the one that the finest three grids show, or the first where there are two, or where the time
/// does not rise.
///
/// Pairs follow the power law of the finest two grids; a and b, neither below zero, have the least relative squares on all grids,
/// or are those of the finest three. None of fewer than two grids. Of the laws that were tried on 61 ladders of 15 methods the line
/// was within 30 % most often: on 41, against 38 with a constant and N log N, 32 with the local exponent of the time, 13 with a
/// power law through all grids. Of what counts no pairs it foretold too much where costs are of bands or summits and not of points.
pub fn forecast(ran: &[Ran], points: f64) -> Option<f64> {
    let mut ran: Vec<Ran> = ran.iter().copied().filter(|r| r.seconds > 0.0 && r.points > 0.0).collect();
    ran.sort_by(|a, b| a.points.total_cmp(&b.points));
    let [.., before, last] = ran[..] else { return None };
    let counts_pairs = ran.iter().all(|r| r.pairs > 0.0);
    if let (false, [.., first, _, _]) = (counts_pairs, &ran[..])
        && let Some(found) = power_from_start([*first, before, last], points)
    {
        return Some(found);
    }
    let pairs = if counts_pairs {
        let exponent = (last.pairs / before.pairs).ln() / (last.points / before.points).ln();
        last.pairs * (points / last.points).powf(exponent)
    } else {
        ran.iter_mut().for_each(|r| r.pairs = 1.0);
        1.0
    };
    let asked = Ran { points, pairs, seconds: 0.0 };
    let (constant, slope) = line(&ran);
    Some(constant + slope * asked.work()).filter(|s| s.is_finite())
}

/// a + b Nᶜ through three grids, coarse to fine, with c within [`EXPONENTS`] (then through the finer two). None where the time
/// does not rise from each to the next.
fn power_from_start([first, before, last]: [Ran; 3], points: f64) -> Option<f64> {
    let rises = [before.seconds - first.seconds, last.seconds - before.seconds];
    if rises[0] <= NOISE * before.seconds || rises[1] <= NOISE * last.seconds {
        return None;
    }
    let rise = |from: f64, to: f64, c: f64| (to / last.points).powf(c) - (from / last.points).powf(c);
    let ratio = |c: f64| rise(before.points, last.points, c) / rise(first.points, before.points, c);
    // The ratio of the rises grows with the exponent.
    let [mut low, mut high] = EXPONENTS;
    for _ in 0..f64::MANTISSA_DIGITS {
        let middle = 0.5 * (low + high);
        if ratio(middle) < rises[1] / rises[0] { low = middle } else { high = middle }
    }
    Some(last.seconds + rises[1] / rise(before.points, last.points, high) * rise(last.points, points, high))
}

/// Constant and slope, neither below zero, of the line through seconds over work with the least relative squares.
fn line(ran: &[Ran]) -> (f64, f64) {
    let sum = |of: fn(f64, f64) -> f64| ran.iter().map(|r| of(r.work(), r.seconds)).sum::<f64>();
    let (s0, s1, s2) = (sum(|_, t| 1.0 / (t * t)), sum(|w, t| w / (t * t)), sum(|w, t| w * w / (t * t)));
    let (t0, t1) = (sum(|_, t| 1.0 / t), sum(|w, t| w / t));
    let determinant = s0 * s2 - s1 * s1;
    let (constant, slope) = ((s2 * t0 - s1 * t1) / determinant, (s0 * t1 - s1 * t0) / determinant);
    // Of a negative one the other alone, a slope through the finest; not a number where all work is the same.
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

    fn close(found: Option<f64>, expected: f64) {
        assert!(found.is_some_and(|f| (f / expected - 1.0).abs() < ROUNDING), "{found:?} is not {expected}");
    }

    /// A start of 20 ms, and pairs that grow as the root of the points a side: what a solver is like.
    #[test]
    fn a_solver_is_foreseen() {
        let pairs = |n: f64| 30.0 * n.sqrt();
        let cost = |n: f64| 0.02 + 1e-8 * n * n * pairs(n);
        let grids = |list: &[f64]| list.iter().map(|&n| ran(n, pairs(n), cost(n))).collect::<Vec<_>>();
        close(forecast(&grids(&[64.0, 128.0]), 256.0 * 256.0), cost(256.0));
        close(forecast(&grids(&[512.0, 64.0, 128.0, 256.0]), 1024.0 * 1024.0), cost(1024.0));
        // Without its pairs the same costs are underestimated: the law is what makes the difference.
        let blind: Vec<Ran> = grids(&[128.0, 256.0]).iter().map(|r| Ran { pairs: 0.0, ..*r }).collect();
        assert!(forecast(&blind, 512.0 * 512.0).is_some_and(|t| t < 0.8 * cost(512.0)));
    }

    #[test]
    fn what_counts_no_pairs_is_foreseen() {
        let cost = |n: f64| 0.01 + 3e-8 * n * n;
        let all: Vec<Ran> = [32.0, 64.0, 128.0].map(|n| ran(n, 0.0, cost(n))).to_vec();
        close(forecast(&all, 256.0 * 256.0), cost(256.0));
        // Of bands, whose number grows with the logarithm of the points; of pairs of neighbours.
        for exponent in [0.1, 0.5, 1.4] {
            let cost = |n: f64| 0.001 + 0.003 * (n * n).powf(exponent);
            let all: Vec<Ran> = [48.0, 64.0, 128.0, 256.0].map(|n| ran(n, 0.0, cost(n))).to_vec();
            close(forecast(&all, 512.0 * 512.0), cost(512.0));
        }
        // No steeper than pairs of neighbours, whatever noise says.
        let leaps = [ran(32.0, 0.0, 1.0), ran(64.0, 0.0, 1.1), ran(128.0, 0.0, 2.0)];
        close(forecast(&leaps, 256.0 * 256.0), 2.0 + 0.9 * (8.0 - 1.0) / (1.0 - 0.125));
        // What is no rise has no exponent: the line, which lies between.
        let flat = [ran(32.0, 0.0, 1.0), ran(64.0, 0.0, 1.001), ran(128.0, 0.0, 1.1)];
        assert!(forecast(&flat, 256.0 * 256.0).is_some_and(|t| (1.1..1.6).contains(&t)));
        // The same on every grid, or less on finer ones: no less than it was, and no growth.
        close(forecast(&[ran(32.0, 0.0, 0.5), ran(64.0, 0.0, 0.5)], 128.0 * 128.0), 0.5);
        let falls = forecast(&[ran(32.0, 0.0, 0.5), ran(64.0, 0.0, 0.4)], 128.0 * 128.0).expect("two grids");
        assert!((0.4..0.5).contains(&falls), "{falls}");
        // Faster than its points: no start below zero.
        close(forecast(&[ran(32.0, 0.0, 0.01), ran(64.0, 0.0, 0.1)], 128.0 * 128.0), 0.4);
    }

    #[test]
    fn one_grid_tells_nothing() {
        assert_eq!(forecast(&[ran(32.0, 5.0, 1.0)], 4096.0), None);
        assert_eq!(forecast(&[], 4096.0), None);
        // Nor one of which no time was counted.
        assert_eq!(forecast(&[ran(32.0, 5.0, 1.0), ran(64.0, 5.0, 0.0)], 4096.0), None);
    }
}
