//! Deviations between two methods: numbers, maps and distributions.

use super::overlap;
use crate::grid::{Grid, bilinear};
use crate::observe::Distribution;
use crate::record::npy;
use crate::record::tradeoff::Extrapolation;

/// Decades between two positive numbers.
pub fn decades(found: f64, reference: f64) -> Option<f64> {
    Some((found / reference).log10().abs()).filter(|e| e.is_finite())
}

/// Root of the mean square.
pub fn rms(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt())
}

/// Values of two maps of the same cell at the nodes that both have: node (i, j) of n points a side is node (ki, kj) of kn.
/// None where neither grid's points divide the other's.
fn coincident<'a>(
    a: &'a npy::Field<f64>,
    b: &'a npy::Field<f64>,
) -> Option<impl Iterator<Item = (f64, f64)> + use<'a>> {
    let (nx, ny) = (a.nx.min(b.nx), a.ny.min(b.ny));
    if nx == 0 || ny == 0 {
        return None;
    }
    let steps = |map: &npy::Field<f64>| {
        (map.nx.is_multiple_of(nx) && map.ny.is_multiple_of(ny)).then(|| (map.nx / nx, map.ny / ny))
    };
    let ((ax, ay), (bx, by)) = (steps(a)?, steps(b)?);
    let pair = move |j: usize, i: usize| (a.values[j * ay * a.nx + i * ax], b.values[j * by * b.nx + i * bx]);
    Some((0..ny).flat_map(move |j| (0..nx).map(move |i| pair(j, i))))
}

/// A periodic map as it is between its nodes, at those of another grid: values that vary evenly, or, of what is either one or
/// the other, those of the nearest node.
pub fn at_nodes_of(map: &npy::Field<f64>, nx: usize, ny: usize, nearest: bool) -> npy::Field<f64> {
    let own = Grid::unit(map.nx, map.ny);
    let node = |x: f64, n: usize| (x * n as f64).round() as usize % n;
    let at = |k: usize| {
        let (x, y) = ((k % nx) as f64 / nx as f64, (k / nx) as f64 / ny as f64);
        match nearest {
            true => map.values[node(y, map.ny) * map.nx + node(x, map.nx)],
            false => bilinear(own, |k| map.values[k], x, y),
        }
    };
    npy::Field { nx, ny, values: (0..nx * ny).map(at).collect() }
}

/// Root of the mean square difference of two maps at the nodes that both have, over `scale`.
pub fn map_l2(found: &npy::Field<f64>, reference: &npy::Field<f64>, scale: f64) -> Option<f64> {
    let differences: Vec<f64> = coincident(found, reference)?.map(|(a, b)| a - b).collect();
    rms(&differences).map(|d| d / scale).filter(|e| e.is_finite())
}

/// One less Jaccard's index of two contact maps (positive: touches) at the nodes that both have: 0 for the same maps, 1 for
/// maps that share nothing.
pub fn map_mismatch(found: &npy::Field<f64>, reference: &npy::Field<f64>) -> Option<f64> {
    let (a, b): (Vec<bool>, Vec<bool>) = coincident(found, reference)?.map(|(a, b)| (a > 0.0, b > 0.0)).unzip();
    Some(1.0 - overlap(&a, &b).jaccard)
}

/// Probability along a line: parts that lie evenly between two values, or at one.
#[derive(Debug, Clone, PartialEq)]
pub struct Masses(Vec<(f64, f64, f64)>);

impl Masses {
    /// Of a distribution whose delta is at zero, from the lowest value on that there may be: what lies below the bins is
    /// spread from there, or, without one, put at the first border; what lies above is put at the last.
    pub fn of(d: &Distribution, lowest: Option<f64>) -> Self {
        let (Some(&first), Some(&last)) = (d.edges.first(), d.edges.last()) else { return Masses(Vec::new()) };
        let bins = d.edges.windows(2).zip(&d.fractions).map(|(e, share)| (e[0], e[1], *share));
        let beyond = [(0.0, 0.0, d.delta), (lowest.unwrap_or(first).min(first), first, d.below), (last, last, d.above)];
        Masses(bins.chain(beyond).filter(|m| m.2 > 0.0).collect())
    }

    /// Of CPr(a), areas and the fraction of the contact in patches up to them, along log10 a.
    pub fn of_patches(curve: &[[f64; 2]]) -> Self {
        let mut before = 0.0;
        let step = |[area, share]: &[f64; 2]| {
            let (at, mass) = (area.log10(), share - before);
            before = *share;
            (at, at, mass)
        };
        Masses(curve.iter().map(step).filter(|m| m.2 > 0.0).collect())
    }
}

/// Wasserstein's distance: how far the one has to be moved, on average, to become the other; the area between the cumulative
/// curves. In the unit of the line. None where one of them is empty.
pub fn wasserstein(a: &Masses, b: &Masses) -> Option<f64> {
    let total = |m: &Masses| m.0.iter().map(|p| p.2).sum::<f64>();
    let (of_a, of_b) = (total(a), total(b));
    if !(of_a > 0.0 && of_b > 0.0) {
        return None;
    }
    // Where the difference of the curves changes its slope, or jumps.
    let mut events: Vec<(f64, f64, f64)> = Vec::new();
    for (masses, sign) in [(a, 1.0 / of_a), (b, -1.0 / of_b)] {
        for &(from, to, mass) in &masses.0 {
            let slope = sign * mass / (to - from);
            match slope.is_finite() {
                true => events.extend([(from, slope, 0.0), (to, -slope, 0.0)]),
                false => events.push((from, 0.0, sign * mass)),
            }
        }
    }
    events.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let (mut distance, mut at, mut height, mut slope) = (0.0, events[0].0, 0.0, 0.0);
    for (x, steeper, jump) in events {
        let (run, end) = (x - at, height + slope * (x - at));
        distance += between(height, end) * run;
        (at, height, slope) = (x, end + jump, slope + steeper);
    }
    Some(distance).filter(|d: &f64| d.is_finite())
}

/// Mean absolute value of a line between two heights.
fn between(a: f64, b: f64) -> f64 {
    if a * b >= 0.0 { 0.5 * (a + b).abs() } else { 0.5 * (a * a + b * b) / (a - b).abs() }
}

/// Orders of convergence that are taken for one: contact lines make the fields' second order into something between first and
/// second, and three grids whose changes shrink much faster or slower agree by chance.
const ORDERS: std::ops::RangeInclusive<f64> = 0.5..=4.0;

/// Richardson's extrapolation of the finest three of `levels`, coarse to fine, each of twice the points a side. Where they show
/// no order the finest stands. None of no level.
pub fn richardson(levels: &[f64]) -> Option<Extrapolation> {
    let &finest = levels.last()?;
    let before = levels.len().checked_sub(2).map(|i| levels[i]);
    let plain = Extrapolation { value: finest, finest, uncertainty: before.map(|b| (finest - b).abs()), order: None };
    let [.., coarse, middle, _] = *levels else { return Some(plain) };
    let ratio = (middle - coarse) / (finest - middle);
    let order = ratio.log2();
    if !ORDERS.contains(&order) {
        return Some(plain);
    }
    let way = (finest - middle) / (ratio - 1.0);
    Some(Extrapolation { value: finest + way, finest, uncertainty: Some(way.abs()), order: Some(order) })
}

/// Orders with which what is no number (maps, distributions) may go to its end: second where all is smooth, and where it hardly
/// converges the root of the spacing.
const SLOWEST_AND_FASTEST: [f64; 2] = [0.5, 2.0];

/// How far the finest of three grids, each of twice the points a side, is from its end, by how far the coarser two are from
/// it: the errors of all three are taken to be alike and to fall with one order. Without the coarsest that is one.
pub fn finest_error(coarse: Option<f64>, middle: f64) -> f64 {
    let [slowest, fastest] = SLOWEST_AND_FASTEST;
    // Distances of 4ᵖ - 1 and 2ᵖ - 1 errors of the finest: their ratio is 2ᵖ + 1.
    let order = match coarse.map(|c| c / middle) {
        Some(ratio) if ratio.is_finite() => (ratio - 1.0).max(0.0).log2().clamp(slowest, fastest),
        _ => 1.0,
    };
    middle / (order.exp2() - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observe::linear_edges;

    /// Rounding of sums of some hundred.
    const ROUNDING: f64 = 1e-12;

    fn close(found: Option<f64>, expected: f64) {
        assert!(found.is_some_and(|f| (f - expected).abs() < ROUNDING), "{found:?} is not {expected}");
    }

    fn map(n: usize, of: impl Fn(f64, f64) -> f64) -> npy::Field<f64> {
        let at = |k: usize| k as f64 / n as f64;
        npy::Field { nx: n, ny: n, values: (0..n * n).map(|i| of(at(i % n), at(i / n))).collect() }
    }

    #[test]
    fn numbers_deviate() {
        close(decades(0.001, 1.0), 3.0);
        close(decades(20.0, 2.0), 1.0);
        assert_eq!((decades(0.0, 1.0), decades(-1.0, 1.0)), (None, None));
        close(rms(&[3.0, 4.0]), 12.5f64.sqrt());
        assert_eq!(rms(&[]), None);
    }

    /// The same function on two grids is the same map, whichever is the finer; another by a constant is off by that.
    #[test]
    fn maps_meet_at_the_nodes_that_both_have() {
        let wave = |x: f64, y: f64| (6.0 * x).sin() + y * y;
        let (coarse, fine) = (map(8, wave), map(32, wave));
        for (a, b) in [(&coarse, &fine), (&fine, &coarse)] {
            close(map_l2(a, b, 1.0), 0.0);
        }
        close(map_l2(&map(8, |x, y| wave(x, y) + 0.3), &fine, 0.5), 0.6);
        // Half of the nodes off by one.
        close(map_l2(&map(4, |x, _| if x < 0.5 { 1.0 } else { 0.0 }), &map(4, |_, _| 0.0), 1.0), 0.5f64.sqrt());
        assert_eq!(map_l2(&map(6, wave), &map(8, wave), 1.0), None);
        assert_eq!(map_l2(&coarse, &fine, 0.0), None);
    }

    /// Between nodes a map is even, or that of the nearest; at its own nodes itself.
    #[test]
    fn maps_are_read_between_their_nodes() {
        let ramp = map(4, |x, y| 4.0 * x + 40.0 * y);
        let fine = at_nodes_of(&ramp, 8, 8, false);
        assert_eq!(fine.values[..6], [0.0, 0.5, 1.0, 1.5, 2.0, 2.5]);
        assert_eq!((fine.values[8], fine.values[16]), (5.0, 10.0));
        // The last node's neighbour is the first one's.
        assert_eq!(fine.values[7], 1.5);
        let coarse = at_nodes_of(&ramp, 3, 1, true);
        assert_eq!(coarse.values, [0.0, 1.0, 3.0]);
        assert_eq!(at_nodes_of(&ramp, 4, 4, false).values, ramp.values);
    }

    /// Stripes of a half and of a quarter that lie in each other share half of what they cover.
    #[test]
    fn contact_maps_mismatch() {
        let stripe = |to: f64| move |x: f64, _: f64| f64::from(u8::from(x < to));
        close(map_mismatch(&map(8, stripe(0.25)), &map(16, stripe(0.5))), 0.5);
        close(map_mismatch(&map(8, stripe(0.5)), &map(16, stripe(0.5))), 0.0);
        close(map_mismatch(&map(8, stripe(0.5)), &map(8, |x, _| f64::from(u8::from(x >= 0.5)))), 1.0);
        // Nothing touches in either: the same.
        close(map_mismatch(&map(8, |_, _| 0.0), &map(8, |_, _| 0.0)), 0.0);
    }

    fn even(from: f64, to: f64, bins: usize) -> Distribution {
        let edges = linear_edges(from, to, bins);
        Distribution { edges, fractions: vec![1.0 / bins as f64; bins], delta: 0.0, below: 0.0, above: 0.0 }
    }

    /// What is shifted is off by the shift, whatever the bins; what is stretched about its middle by a quarter of the stretch.
    #[test]
    fn wasserstein_of_known_pairs() {
        let masses = |from: f64, to: f64, bins: usize| Masses::of(&even(from, to, bins), None);
        close(wasserstein(&masses(0.0, 1.0, 10), &masses(0.3, 1.3, 7)), 0.3);
        close(wasserstein(&masses(0.0, 1.0, 10), &masses(5.0, 6.0, 10)), 5.0);
        close(wasserstein(&masses(0.0, 1.0, 10), &masses(0.0, 1.0, 3)), 0.0);
        close(wasserstein(&masses(-1.0, 1.0, 4), &masses(-2.0, 2.0, 4)), 0.5);
        assert_eq!(wasserstein(&Masses(Vec::new()), &masses(0.0, 1.0, 1)), None);
    }

    /// Deltas and what lies beyond the bins are masses, too, and fractions that do not add up to one are scaled.
    #[test]
    fn wasserstein_moves_deltas() {
        let half = Distribution { fractions: vec![0.5], delta: 0.5, ..even(1.0, 3.0, 1) };
        let open = even(1.0, 3.0, 1);
        // Half of the whole goes from 0 to an even spread about 2.
        close(wasserstein(&Masses::of(&half, None), &Masses::of(&open, None)), 1.0);
        let twice = Distribution { fractions: vec![2.0], ..open.clone() };
        close(wasserstein(&Masses::of(&twice, None), &Masses::of(&open, None)), 0.0);
        let below = Distribution { fractions: vec![0.0], below: 1.0, ..open.clone() };
        close(wasserstein(&Masses::of(&below, Some(0.0)), &Masses::of(&open, None)), 1.5);
        close(wasserstein(&Masses::of(&below, None), &Masses::of(&open, None)), 1.0);
        let above = Distribution { fractions: vec![0.0], above: 1.0, ..open.clone() };
        close(wasserstein(&Masses::of(&above, None), &Masses::of(&open, None)), 1.0);
    }

    /// Patches ten times as large are a decade off; a share that moves over two decades counts as much as it is.
    #[test]
    fn patches_are_compared_in_decades() {
        let curve = [[1e-4, 0.2], [1e-3, 1.0]];
        let larger = curve.map(|[a, share]| [10.0 * a, share]);
        close(wasserstein(&Masses::of_patches(&curve), &Masses::of_patches(&larger)), 1.0);
        let other = [[1e-5, 0.1], [1e-3, 1.0]];
        // A tenth by one decade, another tenth by one.
        close(wasserstein(&Masses::of_patches(&curve), &Masses::of_patches(&other)), 0.1 + 0.1);
        assert_eq!(wasserstein(&Masses::of_patches(&[]), &Masses::of_patches(&curve)), None);
    }

    #[test]
    fn an_order_is_extrapolated() {
        let at = |h: f64| 3.0 + 0.8 * h * h;
        let found = richardson(&[at(0.4), at(0.2), at(0.1)]).expect("levels");
        assert!((found.value - 3.0).abs() < ROUNDING, "{found:?}");
        assert!(found.order.is_some_and(|o| (o - 2.0).abs() < 1e-9), "{found:?}");
        close(found.uncertainty, at(0.1) - 3.0);
        // Up and down again, or ever larger steps: no order, the finest stands.
        for levels in [[1.0, 2.0, 1.5], [1.0, 1.1, 1.4], [1.0, 1.0, 1.0]] {
            let found = richardson(&levels).expect("levels");
            assert_eq!((found.value, found.order), (levels[2], None));
            close(found.uncertainty, (levels[2] - levels[1]).abs());
        }
        assert_eq!(richardson(&[2.0]).map(|f| (f.value, f.uncertainty)), Some((2.0, None)));
        assert_eq!(richardson(&[]), None);
    }

    /// Errors of 0.16, 0.08 and 0.04 are 0.12 and 0.04 apart from the last.
    #[test]
    fn the_finest_errs_by_what_the_others_show() {
        close(Some(finest_error(Some(0.12), 0.04)), 0.04);
        // Second order: 0.16, 0.04, 0.01.
        close(Some(finest_error(Some(0.15), 0.03)), 0.01);
        // No faster than that, and where nothing converges by more than the last change.
        close(Some(finest_error(Some(30.0), 0.03)), 0.01);
        close(Some(finest_error(Some(0.03), 0.03)), 0.03 / (2f64.sqrt() - 1.0));
        close(Some(finest_error(None, 0.03)), 0.03);
        assert_eq!((finest_error(Some(0.0), 0.0), finest_error(None, 0.0)), (0.0, 0.0));
    }
}
