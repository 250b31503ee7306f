//! Cost against error: Pareto front, and growth of the cost with the grid.

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

/// A power law through costs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CostExponent {
    pub exponent: f64,
    /// Standard error of the exponent; `None` for two sizes.
    pub error: Option<f64>,
    /// Number of sizes in the fit.
    pub sizes: usize,
}

/// Exponent of the cost in the number of points by least squares of the logarithms. `None` for fewer than two sizes.
pub fn growth(sizes: &[(f64, f64)]) -> Option<CostExponent> {
    let logs: Vec<(f64, f64)> =
        sizes.iter().map(|(n, c)| (n.ln(), c.ln())).filter(|(n, c)| n.is_finite() && c.is_finite()).collect();
    let n = logs.len() as f64;
    let mean = |value: fn(&(f64, f64)) -> f64| logs.iter().map(value).sum::<f64>() / n;
    let (mx, my) = (mean(|l| l.0), mean(|l| l.1));
    let spread: f64 = logs.iter().map(|l| (l.0 - mx).powi(2)).sum();
    if logs.len() < 2 || spread == 0.0 {
        return None;
    }
    let exponent = logs.iter().map(|l| (l.0 - mx) * (l.1 - my)).sum::<f64>() / spread;
    let residual: f64 = logs.iter().map(|l| (l.1 - my - exponent * (l.0 - mx)).powi(2)).sum();
    let error = (logs.len() > 2).then(|| (residual / (n - 2.0) / spread).sqrt());
    Some(CostExponent { exponent, error, sizes: logs.len() })
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

    #[test]
    fn a_power_law_is_found() {
        let law = |n: f64| 3.0 * n.powf(1.5);
        let actual = growth(&[64.0, 256.0, 1024.0].map(|n| (n, law(n)))).expect("three sizes");
        assert!((actual.exponent - 1.5).abs() < 1e-12 && actual.error.is_some_and(|e| e < 1e-9) && actual.sizes == 3);
        let two = growth(&[(64.0, 1.0), (256.0, 4.0)]).expect("two sizes");
        assert!((two.exponent - 1.0).abs() < 1e-12 && two.error.is_none(), "{two:?}");
        assert_eq!(growth(&[(64.0, 1.0), (64.0, 4.0)]), None);
        // The middle one of three points is off the line by a factor of e.
        let bent = growth(&[(1.0, 1.0), (std::f64::consts::E, std::f64::consts::E), (1f64.exp().powi(2), 1.0)]);
        // Residuals of -1/3, 2/3 and -1/3 over a spread of 2: a variance of 2/3, over 2.
        let error = (1.0 / 3f64).sqrt();
        assert!(
            bent.is_some_and(|g| g.exponent.abs() < 1e-12 && g.error.is_some_and(|e| (e - error).abs() < 1e-12)),
            "{bent:?}"
        );
    }
}
