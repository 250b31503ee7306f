use std::f64::consts::PI;

/// Gauss-Legendre points and weights on -1 to 1: exact for polynomials of degree 2n - 1.
pub(super) fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    /// Newton steps from the asymptotic roots; four reach rounding for n up to 100.
    const STEPS: usize = 6;
    (0..n)
        .map(|k| {
            let mut x = -(PI * (k as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..STEPS {
                let (mut p, mut previous) = (x, 1.0);
                for m in 2..=n {
                    let m = m as f64;
                    (p, previous) = (((2.0 * m - 1.0) * x * p - (m - 1.0) * previous) / m, p);
                }
                slope = n as f64 * (x * p - previous) / (x * x - 1.0);
                x -= p / slope;
            }
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// Integral from `a` to `b` by the points of a rule.
pub(super) fn integral(rule: &[(f64, f64)], a: f64, b: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    half * rule.iter().map(|(x, w)| w * f(middle + half * x)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_integrated_exactly() {
        for n in [2, 3, 16, 48] {
            let rule = gauss_legendre(n);
            let degree = 2 * n as i32 - 2;
            let actual = integral(&rule, -1.0, 2.0, |x| x.powi(degree));
            let exact = (2f64.powi(degree + 1) + 1.0) / f64::from(degree + 1);
            assert!((actual / exact - 1.0).abs() < 1e-12, "{n}: {actual} {exact}");
        }
        // The rule is not exact for the next higher degree.
        let two = gauss_legendre(2);
        assert!((integral(&two, 0.0, 1.0, |x| x.powi(4)) - 0.2).abs() > 1e-3);
    }
}
