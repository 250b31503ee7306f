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

/// Index of the cheapest point with an error of at most `limit`.
pub fn cheapest(points: &[(f64, f64)], limit: f64) -> Option<usize> {
    let good = (0..points.len()).filter(|&i| points[i].1 <= limit && points[i].0.is_finite());
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
        assert_eq!([1.0, 0.55, 0.1, 0.01].map(|l| cheapest(&points, l)), [Some(4), Some(0), Some(2), None]);
    }
}
