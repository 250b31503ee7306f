//! Contact stiffness of solved states.

use super::FastRun;
use super::level::{Level, TANGENT_ACCURACY};
use crate::interface::{Kernel, Law};
use crate::method::operator::{Build, dispatch};
use crate::method::{Equilibrium, Load, NoObserver, Observer, ReducedProblem, SolverRun};
use asperity_grid::Real;
use asperity_grid::Result;

/// Contact stiffness of a state of any method ([`Equilibrium::stiffness`]).
///
/// # Errors
/// As [`ContactMethod::start`](crate::method::ContactMethod::start).
pub fn contact_stiffness(problem: &ReducedProblem, state: &Equilibrium) -> Result<Option<f64>> {
    dispatch(problem, Tangent { problem, state })
}

struct Tangent<'p, 's> {
    problem: &'p ReducedProblem<'p>,
    state: &'s Equilibrium<'s>,
}

impl<'p> Build<'p> for Tangent<'p, '_> {
    type Built = Result<Option<f64>>;

    fn build<T: Real, K: Kernel + 'p, L: Law + 'p>(self, _: K, law: L) -> Self::Built {
        let Tangent { problem, state } = self;
        let mut solver = FastRun::<T, L>::new(problem, &NoObserver, law)?;
        solver.set_gap(&state.gap.to_vec());
        let grid = solver.cell.grid;
        let gap = std::mem::take(&mut solver.gap);
        let mut level = Level::with_gap(grid, solver.body(grid), solver.cell, None, gap);
        (level.pressure, level.last.contact) = (state.pressure, 1.0);
        level.prepare();
        Ok(solver.stiffness(&mut level, state.load, TANGENT_ACCURACY))
    }
}

impl<T: Real, L: Law> FastRun<'_, T, L> {
    /// Contact stiffness of a level. Flowing nodes are held, as closed ones: the body unloads elastically.
    pub(super) fn stiffness(&self, level: &mut Level<'_, T, L>, load: Load, accuracy: f64) -> Option<f64> {
        let touches = level.last.contact > 0.0 || self.law.range() > 0.0;
        if !touches {
            return None;
        }
        level.apply_pending();
        // Of the rigid approach: the stiffness at small loads is about the pressure over half the rms height.
        let scale = self.task(load).scale(level.pressure, &level.last);
        let approach = scale / (0.5 * self.rms_height).max(f64::MIN_POSITIVE);
        let mean = approach.min(self.problem.stiffest_mode().max(1.0));
        let stopping = || self.observer.stop_requested();
        if !(L::HARD && L::YIELDS) {
            return level.stiffness((mean, accuracy), &stopping);
        }
        let held = level.gap().iter().map(|g| g.max(T::zero())).collect();
        let mut held = Level::with_gap(level.grid(), self.body(level.grid()), self.cell, None, held);
        held.prepare();
        held.stiffness((mean, accuracy), &stopping)
    }
}
