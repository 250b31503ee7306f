use asperity_contact::method::fields::{add, each, inner};

/// Conjugate gradients for a Newton step, with their scratch fields.
pub(super) struct Newton {
    residual: Vec<f64>,
    direction: Vec<f64>,
    image: Vec<f64>,
    conditioned: Vec<f64>,
}

impl Newton {
    /// Number of scratch fields.
    pub(super) const FIELDS: usize = 4;
    /// Iterations per step at most.
    const MOST: usize = 200;

    pub(super) fn new(points: usize) -> Self {
        let zero = || vec![0.0; points];
        Newton { residual: zero(), direction: zero(), image: zero(), conditioned: zero() }
    }

    /// Solves `A step = -gradient` to a relative residual, or as far as the curvature is positive, so that the step
    /// is a descent direction (Steihaug, SIAM J. Numer. Anal. 20 (1983) 626). `apply(true, …)` applies the
    /// preconditioner `M`, `apply(false, …)` applies `A`.
    pub(super) fn step(
        &mut self,
        gradient: &[f64],
        step: &mut [f64],
        tolerance: f64,
        mut apply: impl FnMut(bool, &[f64], &mut [f64]),
    ) {
        let Newton { residual, direction, image, conditioned } = self;
        step.fill(0.0);
        each(residual, |i, _| -gradient[i]);
        apply(true, residual, conditioned);
        direction.copy_from_slice(conditioned);
        let mut square = inner(residual, conditioned);
        let goal = tolerance * inner(gradient, gradient).sqrt();
        for iteration in 0..Self::MOST {
            apply(false, direction, image);
            let curvature = inner(direction, image);
            if curvature <= 0.0 {
                if iteration == 0 {
                    step.copy_from_slice(direction);
                }
                return;
            }
            let along = square / curvature;
            add(step, along, direction);
            add(residual, -along, image);
            if inner(residual, residual).sqrt() <= goal {
                return;
            }
            apply(true, residual, conditioned);
            let next = inner(residual, conditioned);
            let beta = next / square;
            each(direction, |i, d| conditioned[i] + beta * d);
            square = next;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn step_minimises_a_convex_form_and_descends_otherwise() {
        let solve = |curvature: [f64; 5]| {
            let gradient = [1.0, -2.0, 0.5, 3.0, -1.0];
            let mut step = [0.0; 5];
            Newton::new(5).step(&gradient, &mut step, 1e-12, |condition, d, to| {
                each(to, |i, _| if condition { d[i] } else { curvature[i] * d[i] });
            });
            (gradient, step)
        };
        let convex = [1.0, 4.0, 9.0, 0.5, 20.0];
        let (gradient, step) = solve(convex);
        assert!((0..5).all(|i| (convex[i] * step[i] + gradient[i]).abs() < 1e-10), "{step:?}");
        let (gradient, step) = solve([1.0, -4.0, 9.0, 0.5, 20.0]);
        assert!(inner(&gradient, &step) < 0.0, "{step:?}");
    }
}
