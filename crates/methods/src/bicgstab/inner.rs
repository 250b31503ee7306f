use asperity_contact::method::fields::{add, each, inner};

/// Stabilised bi-conjugate gradients with their scratch fields (van der Vorst, SIAM J. Sci. Stat. Comput. 13 (1992)
/// 631).
pub(super) struct BiCgStab {
    residual: Vec<f64>,
    shadow: Vec<f64>,
    direction: Vec<f64>,
    image: Vec<f64>,
    second: Vec<f64>,
    conditioned: Vec<f64>,
}

impl BiCgStab {
    /// Number of scratch fields.
    pub(super) const FIELDS: usize = 6;

    pub(super) fn new(points: usize) -> Self {
        let zero = || vec![0.0; points];
        BiCgStab {
            residual: zero(),
            shadow: zero(),
            direction: zero(),
            image: zero(),
            second: zero(),
            conditioned: zero(),
        }
    }

    /// Solves `A x = right` to a relative residual, or as far as `most` iterations lead: a Newton step need not be
    /// exact. `condition` applies the preconditioner `M`, `image_of` applies `A`.
    pub(super) fn solve(
        &mut self,
        right: &[f64],
        x: &mut [f64],
        (tolerance, most): (f64, usize),
        mut condition: impl FnMut(&[f64], &mut [f64]),
        mut image_of: impl FnMut(&[f64], &mut [f64]),
    ) {
        let BiCgStab { residual, shadow, direction, image, second, conditioned } = self;
        x.fill(0.0);
        residual.copy_from_slice(right);
        shadow.copy_from_slice(right);
        direction.fill(0.0);
        image.fill(0.0);
        let goal = tolerance * inner(right, right).sqrt();
        let (mut rho, mut alpha, mut omega) = (1.0, 1.0, 1.0);
        for _ in 0..most {
            let next = inner(shadow, residual);
            let beta = next / rho * alpha / omega;
            each(direction, |i, p| residual[i] + beta * (p - omega * image[i]));
            condition(direction, conditioned);
            image_of(conditioned, image);
            let along = inner(shadow, image);
            // Breakdown: return the present iterate.
            if !(next / along).is_finite() || along == 0.0 {
                return;
            }
            (rho, alpha) = (next, next / along);
            add(x, alpha, conditioned);
            add(residual, -alpha, image);
            condition(residual, conditioned);
            image_of(conditioned, second);
            let length = inner(second, second);
            if length == 0.0 {
                return;
            }
            omega = inner(second, residual) / length;
            add(x, omega, conditioned);
            add(residual, -omega, second);
            if inner(residual, residual).sqrt() <= goal || omega == 0.0 {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A small unsymmetric system with a known solution.
    #[test]
    fn solves_an_unsymmetric_system() {
        let a = [[4.0, 1.0, -0.5, 0.0], [0.5, 3.0, 0.2, -1.0], [0.0, 1.5, -5.0, 0.3], [1.0, 0.0, 0.7, 2.0]];
        let apply = |x: &[f64], y: &mut [f64]| {
            for (y, row) in y.iter_mut().zip(&a) {
                *y = row.iter().zip(x).map(|(a, x)| a * x).sum();
            }
        };
        let exact = [1.0, -2.0, 0.5, 3.0];
        let (mut right, mut x) = ([0.0; 4], [0.0; 4]);
        apply(&exact, &mut right);
        let diagonal =
            |x: &[f64], y: &mut [f64]| y.iter_mut().zip(x).enumerate().for_each(|(i, (y, x))| *y = x / a[i][i]);
        BiCgStab::new(4).solve(&right, &mut x, (1e-13, 20), diagonal, apply);
        for (x, e) in x.iter().zip(&exact) {
            assert!((x - e).abs() < 1e-10, "{x} {e}");
        }
    }
}
