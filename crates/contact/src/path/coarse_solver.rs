//! A solver that follows the load path on a coarser grid.

use super::coarser_grids::{GridResult, flow_gaps, method};
use super::pull_off::{self, SeparationStart};
use crate::method::{Load, Observer, ProblemScale, ReducedProblem, SolverRun, Stop};
use crate::results::PullOff;
use asperity_grid::{Error, Grid, Result};

/// A solver that follows the load path on a coarser grid.
pub(super) struct CoarseSolver<'s> {
    problem: &'s ReducedProblem<'s>,
    run: Box<dyn SolverRun + 's>,
    threshold: f64,
    leakage: bool,
    /// State from which the separation starts, if `pulls_off`.
    start: Option<SeparationStart>,
    pulls_off: bool,
    /// Whether the gap is kept.
    keeps_gap: bool,
    gap: Option<Vec<f64>>,
}

impl<'s> CoarseSolver<'s> {
    pub(super) fn start(
        problem: &'s ReducedProblem<'s>,
        (threshold, leakage): (f64, bool),
        pulls_off: bool,
        observer: &'s dyn Observer,
    ) -> Result<Self> {
        Ok(CoarseSolver {
            problem,
            run: method().start(problem, observer)?.solver()?,
            threshold,
            leakage,
            start: None,
            pulls_off,
            keeps_gap: false,
            gap: None,
        })
    }

    /// With the gap of the last load, for the errors of the maps.
    pub(super) fn keeping_gap(self, keeps_gap: bool) -> Self {
        CoarseSolver { keeps_gap, ..self }
    }

    /// Grid and gap of the last load, if they are kept.
    pub(super) fn gap(&self) -> Option<(Grid, &[f64])> {
        Some((self.problem.grid, self.gap.as_deref()?))
    }

    /// `None` if this grid does not converge or the run is interrupted; the solve on the problem's own grid then stops
    /// by itself and writes its checkpoint.
    pub(super) fn follow(&mut self, load: Load) -> Result<Option<GridResult>> {
        let grid = self.problem.grid;
        let state = self.run.equilibrate(load)?;
        self.gap = (self.keeps_gap && state.stop == Stop::Converged).then(|| state.gap.to_vec());
        self.start =
            (self.pulls_off && state.stop == Stop::Converged).then(|| SeparationStart::of(&state, self.problem));
        match state.stop {
            Stop::Converged => {
                let area = self.problem.contact_area(&state, self.threshold);
                let gaps = match self.leakage {
                    true => flow_gaps(self.problem, (state.ranks, state.gap), self.threshold),
                    false => None,
                };
                Ok(Some(GridResult { gaps, ..GridResult::new(&state, grid, self.problem.adhesion.range(), &area) }))
            }
            _ => Ok(None),
        }
    }

    /// Pull-off on this grid; `None` if it has none.
    pub(super) fn pull_off(&mut self, scale: ProblemScale, observer: &dyn Observer) -> Result<Option<(Grid, PullOff)>> {
        let Some(start) = self.start.take() else { return Ok(None) };
        match pull_off::search(&mut *self.run, self.problem, (scale, observer), start) {
            Ok(pull_off) => Ok(Some((self.problem.grid, pull_off))),
            // The result on the problem's own grid remains valid.
            Err(Error::NotConverged { .. } | Error::Input { .. }) => Ok(None),
            Err(e) => Err(e),
        }
    }
}
