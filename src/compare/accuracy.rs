//! Deviations between two methods: scalars, maps and distributions.

use super::overlap;
use crate::record::tradeoff::Extrapolation;
use asperity_contact::observe::Distribution;
use asperity_grid::{Grid, bilinear};
use asperity_surface::files::npy;

/// Absolute log₁₀ of the ratio of two positive numbers.
pub fn decades(value: f64, reference: f64) -> Option<f64> {
    Some((value / reference).log10().abs()).filter(|e| e.is_finite())
}

/// Root mean square; `None` of no values.
pub fn rms(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt())
}

/// Pairs of values at the nodes common to two maps of the same cell. `None` if the number of nodes of one grid is no
/// multiple of the other's.
fn coincident<'a>(
    a: &'a npy::NpyMap<f64>,
    b: &'a npy::NpyMap<f64>,
) -> Option<impl Iterator<Item = (f64, f64)> + use<'a>> {
    let (nx, ny) = (a.nx.min(b.nx), a.ny.min(b.ny));
    if nx == 0 || ny == 0 {
        return None;
    }
    let steps = |map: &npy::NpyMap<f64>| {
        (map.nx.is_multiple_of(nx) && map.ny.is_multiple_of(ny)).then(|| (map.nx / nx, map.ny / ny))
    };
    let ((ax, ay), (bx, by)) = (steps(a)?, steps(b)?);
    let pair = move |j: usize, i: usize| (a.values[j * ay * a.nx + i * ax], b.values[j * by * b.nx + i * bx]);
    Some((0..ny).flat_map(move |j| (0..nx).map(move |i| pair(j, i))))
}

/// Values of a periodic map at the nodes of an `nx` × `ny` grid: bilinear interpolation, or the nearest node for binary
/// maps.
pub fn at_nodes_of(map: &npy::NpyMap<f64>, nx: usize, ny: usize, nearest: bool) -> npy::NpyMap<f64> {
    let own = Grid::unit(map.nx, map.ny);
    let node = |x: f64, n: usize| (x * n as f64).round() as usize % n;
    let value_at = |k: usize| {
        let (x, y) = ((k % nx) as f64 / nx as f64, (k / nx) as f64 / ny as f64);
        match nearest {
            true => map.values[node(y, map.ny) * map.nx + node(x, map.nx)],
            false => bilinear(own, |k| map.values[k], x, y),
        }
    };
    npy::NpyMap { nx, ny, values: (0..nx * ny).map(value_at).collect() }
}

/// rms difference of two maps at their common nodes, over `scale`.
pub fn map_l2(map: &npy::NpyMap<f64>, reference: &npy::NpyMap<f64>, scale: f64) -> Option<f64> {
    let differences: Vec<f64> = coincident(map, reference)?.map(|(a, b)| a - b).collect();
    rms(&differences).map(|d| d / scale).filter(|e| e.is_finite())
}

/// One minus the Jaccard index of two contact maps (positive: contact) at their common nodes: 0 for equal maps, 1 for
/// disjoint ones.
pub fn map_mismatch(map: &npy::NpyMap<f64>, reference: &npy::NpyMap<f64>) -> Option<f64> {
    let (a, b): (Vec<bool>, Vec<bool>) = coincident(map, reference)?.map(|(a, b)| (a > 0.0, b > 0.0)).unzip();
    Some(1.0 - overlap(&a, &b).jaccard)
}

/// A distribution on a line: entries (from, to, mass) with uniform density between `from` and `to`, or a delta function
/// if they are equal.
#[derive(Debug, Clone, PartialEq)]
pub struct Masses(Vec<(f64, f64, f64)>);

impl Masses {
    /// From a histogram whose delta function is at zero. The mass below the bins is spread uniformly from `lowest` to
    /// the first edge, or placed at the first edge without `lowest`; the mass above is placed at the last edge.
    pub fn of(d: &Distribution, lowest: Option<f64>) -> Self {
        let (Some(&first), Some(&last)) = (d.edges.first(), d.edges.last()) else { return Masses(Vec::new()) };
        let bins = d.edges.windows(2).zip(&d.fractions).map(|(e, fraction)| (e[0], e[1], *fraction));
        let beyond = [(0.0, 0.0, d.delta), (lowest.unwrap_or(first).min(first), first, d.below), (last, last, d.above)];
        Masses(bins.chain(beyond).filter(|m| m.2 > 0.0).collect())
    }

    /// From CPr(a), pairs of cluster area a and fraction of the contact in clusters up to that area, as a distribution
    /// over log₁₀ a.
    pub fn of_clusters(curve: &[[f64; 2]]) -> Self {
        let mut previous = 0.0;
        let step = |[area, fraction]: &[f64; 2]| {
            let (at, mass) = (area.log10(), fraction - previous);
            previous = *fraction;
            (at, at, mass)
        };
        Masses(curve.iter().map(step).filter(|m| m.2 > 0.0).collect())
    }
}

/// Wasserstein-1 distance: the area between the normalised cumulative distributions, in the unit of the axis. `None` if
/// one of them is empty.
pub fn wasserstein(a: &Masses, b: &Masses) -> Option<f64> {
    let total = |m: &Masses| m.0.iter().map(|p| p.2).sum::<f64>();
    let (of_a, of_b) = (total(a), total(b));
    if !(of_a > 0.0 && of_b > 0.0) {
        return None;
    }
    // Points where the difference of the cumulative distributions changes its slope or jumps.
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

/// Mean absolute value of a linear function with the end values `a` and `b`.
fn between(a: f64, b: f64) -> f64 {
    if a * b >= 0.0 { 0.5 * (a + b).abs() } else { 0.5 * (a * a + b * b) / (a - b).abs() }
}

/// Accepted orders of convergence. Contact lines reduce the second order of the fields to between first and second;
/// much smaller or larger apparent orders of three grids are accidental.
const ORDERS: std::ops::RangeInclusive<f64> = 0.5..=4.0;

/// Richardson extrapolation from the last three of `levels`, from coarse to fine with the mesh size halved each time.
/// Without a valid order of convergence the finest value is returned. `None` of no levels.
pub fn richardson(levels: &[f64]) -> Option<Extrapolation> {
    let &finest = levels.last()?;
    let previous = levels.len().checked_sub(2).map(|i| levels[i]);
    let plain = Extrapolation { value: finest, finest, uncertainty: previous.map(|b| (finest - b).abs()), order: None };
    let [.., coarse, middle, _] = *levels else { return Some(plain) };
    let ratio = (middle - coarse) / (finest - middle);
    let order = ratio.log2();
    if !ORDERS.contains(&order) {
        return Some(plain);
    }
    let change = (finest - middle) / (ratio - 1.0);
    Some(Extrapolation { value: finest + change, finest, uncertainty: Some(change.abs()), order: Some(order) })
}

/// Lowest and highest order assumed for the convergence of maps and distributions: second order for smooth fields, and
/// order 1/2 at slow convergence.
const SLOWEST_AND_FASTEST: [f64; 2] = [0.5, 2.0];

/// Estimated error of the finest of three grids, with the mesh size halved each time, from the distances of the coarser
/// two to it. The errors are assumed to follow a power law of the mesh size. Without the coarsest grid first order is
/// assumed.
pub fn finest_error(coarse: Option<f64>, middle: f64) -> f64 {
    let [slowest, fastest] = SLOWEST_AND_FASTEST;
    // With the error e of the finest grid these distances are (4ᵖ - 1) e and (2ᵖ - 1) e; their ratio is 2ᵖ + 1.
    let order = match coarse.map(|c| c / middle) {
        Some(ratio) if ratio.is_finite() => (ratio - 1.0).max(0.0).log2().clamp(slowest, fastest),
        _ => 1.0,
    };
    middle / (order.exp2() - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_contact::observe::linear_edges;

    /// Rounding of sums of some hundred.
    const ROUNDING: f64 = 1e-12;

    fn close(actual: Option<f64>, expected: f64) {
        assert!(actual.is_some_and(|f| (f - expected).abs() < ROUNDING), "{actual:?} is not {expected}");
    }

    fn map(n: usize, value: impl Fn(f64, f64) -> f64) -> npy::NpyMap<f64> {
        let coordinate = |k: usize| k as f64 / n as f64;
        npy::NpyMap { nx: n, ny: n, values: (0..n * n).map(|i| value(coordinate(i % n), coordinate(i / n))).collect() }
    }

    /// x + 10 y on a unit cell.
    fn oblong(nx: usize, ny: usize) -> npy::NpyMap<f64> {
        let value_at = |k: usize| (k % nx) as f64 / nx as f64 + 10.0 * (k / nx) as f64 / ny as f64;
        npy::NpyMap { nx, ny, values: (0..nx * ny).map(value_at).collect() }
    }

    #[test]
    fn numbers_deviate() {
        close(decades(0.001, 1.0), 3.0);
        close(decades(20.0, 2.0), 1.0);
        assert_eq!((decades(0.0, 1.0), decades(-1.0, 1.0)), (None, None));
        close(rms(&[3.0, 4.0]), 12.5f64.sqrt());
        assert_eq!(rms(&[]), None);
    }

    /// Samples of one function on two grids are equal maps, in either order. A constant offset is the distance.
    #[test]
    fn maps_are_compared_at_their_common_nodes() {
        let wave = |x: f64, y: f64| (6.0 * x).sin() + y * y;
        let (coarse, fine) = (map(8, wave), map(32, wave));
        for (a, b) in [(&coarse, &fine), (&fine, &coarse)] {
            close(map_l2(a, b, 1.0), 0.0);
        }
        close(map_l2(&map(8, |x, y| wave(x, y) + 0.3), &fine, 0.5), 0.6);
        // Half of the nodes differ by one.
        close(map_l2(&map(4, |x, _| if x < 0.5 { 1.0 } else { 0.0 }), &map(4, |_, _| 0.0), 1.0), 0.5f64.sqrt());
        // Oblong maps, with other ratios of their nodes along x and y.
        let (coarse, fine) = (oblong(4, 8), oblong(12, 16));
        for (a, b) in [(&coarse, &fine), (&fine, &coarse)] {
            close(map_l2(a, b, 1.0), 0.0);
        }
        assert_eq!(map_l2(&map(6, wave), &map(8, wave), 1.0), None);
        assert_eq!(map_l2(&map(8, wave), &map(32, wave), 0.0), None);
    }

    /// Interpolated and nearest values between nodes; unchanged values at the map's own nodes.
    #[test]
    fn maps_are_read_between_their_nodes() {
        let ramp = map(4, |x, y| 4.0 * x + 40.0 * y);
        let fine = at_nodes_of(&ramp, 8, 8, false);
        assert_eq!(fine.values[..6], [0.0, 0.5, 1.0, 1.5, 2.0, 2.5]);
        assert_eq!((fine.values[8], fine.values[16]), (5.0, 10.0));
        // The last node is interpolated with the first, by periodicity.
        assert_eq!(fine.values[7], 1.5);
        let coarse = at_nodes_of(&ramp, 3, 1, true);
        assert_eq!(coarse.values, [0.0, 1.0, 3.0]);
        assert_eq!(at_nodes_of(&ramp, 4, 4, false).values, ramp.values);
        assert_eq!(at_nodes_of(&oblong(12, 16), 4, 8, true), oblong(4, 8));
    }

    /// Stripes of a half and a quarter of the cell, one inside the other: Jaccard index of one half.
    #[test]
    fn contact_maps_mismatch() {
        let stripe = |to: f64| move |x: f64, _: f64| f64::from(u8::from(x < to));
        close(map_mismatch(&map(8, stripe(0.25)), &map(16, stripe(0.5))), 0.5);
        close(map_mismatch(&map(8, stripe(0.5)), &map(16, stripe(0.5))), 0.0);
        close(map_mismatch(&map(8, stripe(0.5)), &map(8, |x, _| f64::from(u8::from(x >= 0.5)))), 1.0);
        // Two maps without contact are equal.
        close(map_mismatch(&map(8, |_, _| 0.0), &map(8, |_, _| 0.0)), 0.0);
    }

    fn even(from: f64, to: f64, bins: usize) -> Distribution {
        let edges = linear_edges(from, to, bins);
        Distribution { edges, fractions: vec![1.0 / bins as f64; bins], delta: 0.0, below: 0.0, above: 0.0 }
    }

    /// The distance of shifted distributions is the shift, for any bins. Doubling the width of a uniform distribution
    /// on [-1, 1] gives 1/2.
    #[test]
    fn wasserstein_of_known_pairs() {
        let masses = |from: f64, to: f64, bins: usize| Masses::of(&even(from, to, bins), None);
        close(wasserstein(&masses(0.0, 1.0, 10), &masses(0.3, 1.3, 7)), 0.3);
        close(wasserstein(&masses(0.0, 1.0, 10), &masses(5.0, 6.0, 10)), 5.0);
        close(wasserstein(&masses(0.0, 1.0, 10), &masses(0.0, 1.0, 3)), 0.0);
        // The difference changes its sign at an edge, and within a bin.
        close(wasserstein(&masses(-1.0, 1.0, 4), &masses(-2.0, 2.0, 4)), 0.5);
        close(wasserstein(&masses(-1.0, 1.0, 1), &masses(-2.0, 2.0, 1)), 0.5);
        assert_eq!(wasserstein(&Masses(Vec::new()), &masses(0.0, 1.0, 1)), None);
    }

    /// Deltas and the mass outside the bins count as well; distributions are normalised.
    #[test]
    fn wasserstein_moves_deltas() {
        let half = Distribution { fractions: vec![0.5], delta: 0.5, ..even(1.0, 3.0, 1) };
        let open = even(1.0, 3.0, 1);
        // Half of the mass moves from 0 to a uniform distribution around 2.
        close(wasserstein(&Masses::of(&half, None), &Masses::of(&open, None)), 1.0);
        let twice = Distribution { fractions: vec![2.0], ..open.clone() };
        close(wasserstein(&Masses::of(&twice, None), &Masses::of(&open, None)), 0.0);
        let below = Distribution { fractions: vec![0.0], below: 1.0, ..open.clone() };
        close(wasserstein(&Masses::of(&below, Some(0.0)), &Masses::of(&open, None)), 1.5);
        close(wasserstein(&Masses::of(&below, None), &Masses::of(&open, None)), 1.0);
        let above = Distribution { fractions: vec![0.0], above: 1.0, ..open.clone() };
        close(wasserstein(&Masses::of(&above, None), &Masses::of(&open, None)), 1.0);
    }

    /// Clusters of ten times the area are one decade away.
    #[test]
    fn patches_are_compared_in_decades() {
        let curve = [[1e-4, 0.2], [1e-3, 1.0]];
        let larger = curve.map(|[a, fraction]| [10.0 * a, fraction]);
        close(wasserstein(&Masses::of_clusters(&curve), &Masses::of_clusters(&larger)), 1.0);
        let other = [[1e-5, 0.1], [1e-3, 1.0]];
        // A tenth of the mass moves by one decade between 1e-5 and 1e-4, and another tenth between 1e-4 and 1e-3.
        close(wasserstein(&Masses::of_clusters(&curve), &Masses::of_clusters(&other)), 0.1 + 0.1);
        assert_eq!(wasserstein(&Masses::of_clusters(&[]), &Masses::of_clusters(&curve)), None);
    }

    #[test]
    fn an_order_is_extrapolated() {
        let value_at = |h: f64| 3.0 + 0.8 * h * h;
        let actual = richardson(&[value_at(0.4), value_at(0.2), value_at(0.1)]).expect("levels");
        assert!((actual.value - 3.0).abs() < ROUNDING, "{actual:?}");
        assert!(actual.order.is_some_and(|o| (o - 2.0).abs() < 1e-9), "{actual:?}");
        close(actual.uncertainty, value_at(0.1) - 3.0);
        // Values that are not monotonic, and increasing changes: no order, the finest value.
        for levels in [[1.0, 2.0, 1.5], [1.0, 1.1, 1.4], [1.0, 1.0, 1.0]] {
            let actual = richardson(&levels).expect("levels");
            assert_eq!((actual.value, actual.order), (levels[2], None));
            close(actual.uncertainty, (levels[2] - levels[1]).abs());
        }
        // Changes of orders 0.4 and 4.2 are accidental, those of 0.6 and 3.9 are not.
        for (order, is_valid) in [(0.4f64, false), (0.6, true), (3.9, true), (4.2, false)] {
            let actual = richardson(&[0.0, order.exp2(), order.exp2() + 1.0]).expect("levels");
            assert_eq!(actual.order.is_some(), is_valid, "{order}");
        }
        assert_eq!(richardson(&[2.0]).map(|f| (f.value, f.uncertainty)), Some((2.0, None)));
        assert_eq!(richardson(&[]), None);
    }

    /// First order: errors of 0.16, 0.08 and 0.04 have distances of 0.12 and 0.04 to the finest.
    #[test]
    fn the_error_of_the_finest_grid_follows_from_the_coarser_ones() {
        close(Some(finest_error(Some(0.12), 0.04)), 0.04);
        // Second order: errors of 0.16, 0.04 and 0.01.
        close(Some(finest_error(Some(0.15), 0.03)), 0.01);
        // Second order at most, and order 1/2 at least.
        close(Some(finest_error(Some(30.0), 0.03)), 0.01);
        close(Some(finest_error(Some(0.03), 0.03)), 0.03 / (2f64.sqrt() - 1.0));
        close(Some(finest_error(None, 0.03)), 0.03);
        assert_eq!((finest_error(Some(0.0), 0.0), finest_error(None, 0.0)), (0.0, 0.0));
    }
}
