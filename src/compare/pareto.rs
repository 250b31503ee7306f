//! Cost against error: Pareto front.

/// Pareto front of `points` (cost, error), as indices in order of increasing cost.
pub fn front(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> =
        (0..points.len()).filter(|&i| points[i].0.is_finite() && points[i].1.is_finite()).collect();
    order.sort_by(|&a, &b| points[a].0.total_cmp(&points[b].0).then(points[a].1.total_cmp(&points[b].1)));
    let mut smallest = f64::INFINITY;
    order.retain(|&i| {
        let better = points[i].1 < smallest;
        smallest = smallest.min(points[i].1);
        better
    });
    order
}

/// Index of the cheapest point with an error of at most `limit`, which all points have that `is_finer(other, point)` says to be the same
/// method on a finer grid: on a single grid an error may be small by accident.
pub fn cheapest_converged(points: &[(f64, f64)], is_finer: impl Fn(usize, usize) -> bool, limit: f64) -> Option<usize> {
    let is_good = |i: usize| points[i].1 <= limit;
    let holds = |i: &usize| is_good(*i) && (0..points.len()).all(|j| is_good(j) || !is_finer(j, *i));
    let good = (0..points.len()).filter(holds).filter(|&i| points[i].0.is_finite());
    good.min_by(|&a, &b| points[a].0.total_cmp(&points[b].0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_the_pareto_front_decrease_with_cost() {
        let points = [(1.0, 0.5), (2.0, 0.6), (3.0, 0.1), (3.0, 0.2), (0.5, 0.9), (9.0, 0.1), (10.0, f64::NAN)];
        assert_eq!(front(&points), [4, 0, 2]);
        assert!(front(&[]).is_empty());
        let cheapest = |limit: f64| cheapest_converged(&points, |_, _| false, limit);
        assert_eq!([1.0, 0.55, 0.1, 0.01].map(cheapest), [Some(4), Some(0), Some(2), None]);
        // The method of the points 0, 3 and 1, on finer and finer grids, has an error of 0.6 on the finest.
        let finer = |other: usize, point: usize| {
            let grid = |i: usize| [0, 3, 1].iter().position(|k| *k == i);
            grid(other).zip(grid(point)).is_some_and(|(finer, coarser)| finer > coarser)
        };
        assert_eq!([0.55, 0.2, 0.6].map(|l| cheapest_converged(&points, finer, l)), [Some(2), Some(2), Some(0)]);
    }
}
