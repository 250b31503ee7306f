//! Nested iteration: each grid starts from the Fourier interpolation of the displacement on the one before.

use super::FastRun;
use super::contact_stress::StressSolved;
use super::descent::{DescentSnapshot, Ended};
use super::level::{Level, TANGENT_ACCURACY};
use crate::interface::Law;
use crate::method::equilibrium_check::Ending;
use crate::method::{CoarseState, ErrorEstimates, Load, Observer, Stop};
use asperity_grid::{Grid, Real, next_fast_len};

/// Grids with fewer than twice this number of points along a side are not halved along it.
const COARSEST: usize = 64;

/// Tolerance of the residual on coarse grids; a smaller one does not reduce the work on the next grid.
const COARSE_TOLERANCE: f64 = 1e-2;

/// On the grid next to the problem's own, whose state serves the error of the result: 1e-2 makes errors up to a fifth larger, 1e-4 needs
/// 2 % more transform pairs in all.
const NEXT_TOLERANCE: f64 = 1e-3;

/// Fewest points of a side that is halved: those of a uniform strip are not.
const FEWEST: usize = 4;

/// The next coarser grid: half the points along both sides, rounded up to a fast transform length, until the longer one is the coarsest. Where
/// the shorter one alone kept its points, changes between the grids were no error of both directions.
fn coarser(grid: Grid) -> Option<Grid> {
    let half = |n: usize| if n >= FEWEST { next_fast_len(n.div_ceil(2)) } else { n };
    (grid.nx.max(grid.ny) >= 2 * COARSEST).then(|| Grid { nx: half(grid.nx), ny: half(grid.ny), ..grid })
}

/// The grids of a cell, from coarse to fine.
fn grids(finest: Grid) -> Vec<Grid> {
    let mut grids: Vec<Grid> = std::iter::successors(Some(finest), |grid| coarser(*grid)).collect();
    grids.reverse();
    grids
}

impl<T: Real, L: Law> FastRun<'_, T, L> {
    /// Nested iteration from the coarsest grid, or from a snapshot.
    pub(super) fn nested(
        &self,
        load: Load,
        iterations: &mut usize,
        resumed: Option<(Grid, Vec<T>, DescentSnapshot)>,
    ) -> (Level<'_, T, L>, Ended) {
        let grids = grids(self.cell.grid);
        let (mut level, mut ended) = match resumed {
            Some(snapshot) => {
                let (mut level, pause) = self.continued(load, snapshot);
                let ended = match pause.finished() {
                    Some((error_estimates, done, fft_pairs)) => {
                        level.evaluate(self.problem.precision);
                        (level.fft_pairs, *iterations) = (fft_pairs, done);
                        Ended { ending: Ending::Met, error_estimates }
                    }
                    None => self.solve_on(&mut level, load, iterations, Some(pause)),
                };
                (level, ended)
            }
            None => {
                let solved = self.first_solved_for_stress(self.begun(grids[0], load), load, iterations);
                self.evaluated(solved, load, iterations)
            }
        };
        let first = level.grid();
        for grid in grids.into_iter().skip_while(|grid| *grid != first).skip(1) {
            // After an interruption on a coarse grid its state is only interpolated to the finer ones.
            let interrupted = ended.ending == Ending::Stopped(Stop::Interrupted);
            self.conclude(&mut level, load, &ended);
            let coarse = if interrupted { None } else { self.coarse_contact(&mut level, (load, &ended), *iterations) };
            level = self.finer(grid, level, load, &ended);
            if interrupted {
                continue;
            }
            let solved = match coarse {
                Some(coarse) => self.solved_for_stress(level, coarse, iterations),
                None => StressSolved::untouched(level),
            };
            (level, ended) = self.evaluated(solved, load, iterations);
        }
        (level, ended)
    }

    /// Solves a grid for the gap, from the state of a solve for the contact stress.
    fn evaluated<'s>(
        &'s self,
        solved: StressSolved<'s, T, L>,
        load: Load,
        iterations: &mut usize,
    ) -> (Level<'s, T, L>, Ended) {
        let StressSolved { mut level, error_estimates, stopped } = solved;
        if stopped.is_break() {
            return (level, Ended { ending: Ending::Stopped(Stop::Interrupted), error_estimates });
        }
        let mut ended = self.solve_on(&mut level, load, iterations, None);
        // Those of the solve for the stress, where the gap needed no step.
        if ended.error_estimates == ErrorEstimates::default() {
            ended.error_estimates = error_estimates;
        }
        (level, ended)
    }

    /// At first contact, under the load.
    fn begun(&self, grid: Grid, load: Load) -> Level<'_, T, L> {
        let mut level = self.at_first_contact(grid);
        self.set_load(&mut level, load);
        level
    }

    fn continued(
        &self,
        load: Load,
        (grid, gap, pause): (Grid, Vec<T>, DescentSnapshot),
    ) -> (Level<'_, T, L>, DescentSnapshot) {
        let mut level = Level::with_gap(grid, self.body(grid), self.cell, self.gpu.as_ref(), gap);
        self.set_load(&mut level, load);
        level.pressure = pause.pressure;
        self.earlier_pairs.set(pause.earlier_pairs);
        (level, pause)
    }

    /// Tolerance of the residual on a grid.
    pub(super) fn goal(&self, grid: Grid, load: Load) -> f64 {
        if grid == self.cell.grid {
            return self.tolerance(load);
        }
        let coarse = if self.is_next(grid) { NEXT_TOLERANCE } else { COARSE_TOLERANCE };
        coarse.max(self.tolerance(load))
    }

    fn solve_on(
        &self,
        level: &mut Level<T, L>,
        load: Load,
        iterations: &mut usize,
        pause: Option<DescentSnapshot>,
    ) -> Ended {
        let goal = self.goal(level.grid(), load);
        level.prepare();
        self.solve_at(level, load, goal, iterations, pause)
    }

    /// Applies the last step of a coarse grid and reports its state.
    fn conclude(&self, level: &mut Level<T, L>, load: Load, ended: &Ended) {
        level.apply_pending();
        if ended.ending == Ending::Met && !level.has_failed() {
            self.report(level, load, ended.error_estimates);
        }
    }

    /// The next finer grid, from the state on a coarser one.
    fn finer<'s>(&'s self, grid: Grid, level: Level<'s, T, L>, load: Load, ended: &Ended) -> Level<'s, T, L> {
        let fraction = level.grid().points() as f64 / self.cell.grid.points() as f64;
        self.earlier_pairs.set(self.earlier_pairs.get() + level.fft_pairs * fraction);
        match ended.ending {
            // With its enlarged range a coarse grid may separate at a load at which the next one stays in contact.
            Ending::Stopped(Stop::Detached) => self.begun(grid, load),
            _ => Level::refined(grid, self.law_on(grid), level),
        }
    }

    /// Whether a grid is the next coarser one of the problem's own, which serves the error of the result.
    fn is_next(&self, grid: Grid) -> bool {
        coarser(self.cell.grid) == Some(grid)
    }

    /// Reports the state of a coarse grid.
    fn report(&self, level: &mut Level<T, L>, load: Load, error_estimates: ErrorEstimates) {
        let stiffness = match self.problem.stiffness && self.is_next(level.grid()) {
            true => self.stiffness(level, load, TANGENT_ACCURACY),
            false => None,
        };
        let (residuals, window, coarse) = (level.last, level.window(), level.grid());
        let (energy, range) = (residuals.energy(level.pressure), level.law().range());
        let (ranks, pressure) = (level.ranks(), level.pressure);
        let gap = level.gap();
        let cut = self.cell.is_padded().then(|| window.cut(gap, coarse.nx));
        self.observer.coarse_grid_done(CoarseState {
            grid: self.cell.facing(coarse),
            ranks,
            gap: T::lend(cut.as_deref().unwrap_or(gap)),
            pressure,
            mean_gap: residuals.mean_gap,
            stiffness,
            energy,
            range,
            error_estimates,
        });
    }
}
