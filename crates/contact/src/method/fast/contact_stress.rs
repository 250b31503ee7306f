//! Behind a stiff wall, and under a patch that is not periodic, a grid is first solved for the contact stress.

use super::FastRun;
use super::descent::{DescentSnapshot, Ended};
use super::dual::{Contact, ContactStress, LIMIT, Solved, transferred};
use super::level::Level;
use super::window::{ComputationCell, Window};
use crate::interface::{AttractionLaw, Elastic, Law, PenaltyWall, Wall};
use crate::method::equilibrium_check::Ending;
use crate::method::sweep::each_row;
use crate::method::{ErrorEstimates, Iteration, Load, Observer, ReducedProblem, SnapshotRef};
use asperity_grid::sys::ranks::ALONE;
use asperity_grid::{Grid, Real, mean};
use std::ops::ControlFlow;

/// Largest share of nodes in contact, above which a product with the sparse model costs more than a transform pair.
const CONTACT: f64 = 0.5;

/// The same for a hard wall and a patch that is not periodic. The solve for the stress takes a third of the transforms, on a cell that is six
/// times the patch, and half of the time where up to 2 % of 128² to 512² points are in contact; with 19 % as much time, with 40 % twice.
const CONTACT_OF_HARD: f64 = 0.1;

/// Compliance of a wall times the stiffness of the stiffest wave up to which it counts as stiff. Behind stiff walls the solver for the gap
/// takes 2 to 20 times the pairs.
const STIFF: f64 = 4.0;

/// Share of the nodes that carry the load at first, on the coarsest grid.
const LOWEST: f64 = 0.1;

/// Largest ratio of the sides of a pixel.
const OBLONG: f64 = 2.0;

/// Estimated residual over the tolerance at which the state is left to the solver for the gap, which evaluates it.
const ACCURATE: f64 = 0.5;

/// Share of the nodes in contact that memory is planned for, and bytes that are taken without a plan.
const PLANNED: f64 = 0.05;
const UNPLANNED: f64 = 6.7e7;

/// Compliance (L/E*) of a stiff linear wall without attraction and hardness, behind which the grids of a problem are solved for the contact
/// stress under a pressure; of a hard wall 0, on a patch that is not periodic. `None` for other walls, and with several ranks and oblong pixels.
fn wall_compliance(problem: &ReducedProblem) -> Option<f64> {
    let length = match (problem.wall, problem.kernel) {
        (Wall::Penalty(PenaltyWall { length }), _) => length,
        (Wall::Hard, Elastic::NonPeriodic(_)) => 0.0,
        _ => return None,
    };
    let ratio = problem.grid.dx() / problem.grid.dy();
    let alone = problem.adhesion == AttractionLaw::None && problem.hardness.is_none();
    let points = ComputationCell::of(problem).grid.points();
    let fits = points < u32::MAX as usize && ratio.max(1.0 / ratio) <= OBLONG;
    let takes = alone && fits && !problem.ranks.are_several() && length * problem.stiffest_mode() <= STIFF;
    takes.then_some(length)
}

/// Bytes of a solve for the contact stress on the grid of a problem's cell, without the series of the heights; 0 where there is none.
pub(super) fn bytes(problem: &ReducedProblem, real: usize) -> u64 {
    if wall_compliance(problem).is_none() {
        return 0;
    }
    // Gap, spectrum, and the gap of the coarser grid.
    let state = 2.25 * real as f64;
    let of_cell = (state + Contact::<f64>::BYTES) * ComputationCell::of(problem).grid.points() as f64;
    let of_contact = PLANNED * Contact::<f64>::BYTES_OF_CONTACT * problem.grid.points() as f64;
    (of_cell + of_contact) as u64
}

/// The facing nodes `y nx + x` whose gap is so low.
fn nodes_below<T: Real>(gap: &[T], (window, nx): (Window, usize), is_low: impl Fn(T) -> bool) -> Vec<u32> {
    let rows = gap.chunks(nx).enumerate();
    let facing = rows.flat_map(|(y, row)| row[..window.inside(y, nx)].iter().zip((y * nx) as u32..));
    facing.filter(|(g, _)| is_low(**g)).map(|(_, i)| i).collect()
}

/// State of a coarser grid.
pub(super) struct CoarseContact<T> {
    grid: Grid,
    gap: Vec<T>,
    stress: Vec<T>,
    /// From which the next grid may continue.
    snapshot: DescentSnapshot,
}

/// A grid that was solved for the contact stress.
pub(super) struct StressSolved<'s, T: Real, L> {
    pub level: Level<'s, T, L>,
    pub error_estimates: ErrorEstimates,
    /// `Break` where the observer stopped the solve.
    pub stopped: ControlFlow<()>,
}

impl<'s, T: Real, L> StressSolved<'s, T, L> {
    pub(super) fn untouched(level: Level<'s, T, L>) -> Self {
        StressSolved { level, error_estimates: ErrorEstimates::default(), stopped: ControlFlow::Continue(()) }
    }
}

impl<T: Real, L: Law> FastRun<'_, T, L> {
    /// Whether grids are solved for the contact stress at a load.
    pub(super) fn takes_stress(&self, load: Load) -> bool {
        let pressed = matches!(load, Load::Pressure(p) if p > 0.0);
        // The solver for the gap meets a load that rounding hides more accurately.
        let hidden = self.problem.wall == Wall::Hard && self.rounding(load) > self.problem.tolerance;
        pressed && !hidden && self.gpu.is_none() && wall_compliance(self.problem).is_some()
    }

    /// Whether so many nodes in contact are few enough on the problem's grid, for time and for memory.
    fn is_small(&self, contact: f64) -> bool {
        let nodes = contact * self.cell.window(self.cell.grid).points() as f64;
        let fits = contact <= PLANNED || nodes * Contact::<f64>::BYTES_OF_CONTACT <= UNPLANNED;
        let most = if self.problem.wall == Wall::Hard { CONTACT_OF_HARD } else { CONTACT };
        contact > 0.0 && contact <= most && fits && nodes < Contact::<f64>::MOST_NODES
    }

    /// The coarsest grid, from first contact: the lowest nodes carry the load.
    pub(super) fn first_solved_for_stress<'s>(
        &'s self,
        mut level: Level<'s, T, L>,
        load: Load,
        iterations: &mut usize,
    ) -> StressSolved<'s, T, L> {
        if !self.takes_stress(load) {
            return StressSolved::untouched(level);
        }
        let (window, nx) = (level.window(), level.grid().nx);
        let mut sorted = window.cut(level.gap(), nx);
        let count = ((LOWEST * sorted.len() as f64) as usize).min(sorted.len() - 1);
        let (_, &mut limit, _) = sorted.select_nth_unstable_by(count, |a, b| a.wide().total_cmp(&b.wide()));
        let nodes = nodes_below(level.gap(), (window, nx), |g| g <= limit);
        let start = ContactStress { values: vec![level.pressure; nodes.len()], nodes };
        self.solved_from(level, &start, None, iterations)
    }

    /// The state of a grid from which the next one is solved for the contact stress; `None` where it is not, and at large contact and
    /// after a grid that was not solved.
    pub(super) fn coarse_contact(
        &self,
        level: &mut Level<T, L>,
        (load, ended): (Load, &Ended),
        iterations: usize,
    ) -> Option<CoarseContact<T>> {
        let met = ended.ending == Ending::Met;
        if !met || !self.is_small(level.last.contact) || !self.takes_stress(load) {
            return None;
        }
        let grid = level.grid();
        let pairs = (level.fft_pairs, self.earlier_pairs.get());
        let snapshot = DescentSnapshot::after(level.pressure, iterations, pairs, ended.error_estimates);
        let stress = level.stress().1;
        Some(CoarseContact { grid, gap: level.gap().to_vec(), stress, snapshot })
    }

    /// Solves a grid for the contact stress, from that of a coarser one.
    pub(super) fn solved_for_stress<'s>(
        &'s self,
        mut level: Level<'s, T, L>,
        mut coarse: CoarseContact<T>,
        iterations: &mut usize,
    ) -> StressSolved<'s, T, L> {
        let (window, nx) = (level.window(), level.grid().nx);
        let nodes = nodes_below(level.gap(), (window, nx), |g| g < T::zero() || L::HARD && g <= T::zero());
        if nodes.is_empty() {
            return StressSolved::untouched(level);
        }
        let start = transferred((coarse.grid, &coarse.stress), (level.grid(), nodes), level.pressure);
        coarse.stress = Vec::new();
        self.solved_from(level, &start, Some(coarse), iterations)
    }

    /// The same from an initial stress. A snapshot is that of the coarser grid.
    fn solved_from<'s>(
        &'s self,
        level: Level<'s, T, L>,
        start: &ContactStress,
        coarse: Option<CoarseContact<T>>,
        iterations: &mut usize,
    ) -> StressSolved<'s, T, L> {
        let (grid, pressure, wall) = (level.grid(), level.pressure, wall_compliance(self.problem).unwrap_or(0.0));
        drop(level);
        let facing = self.cell.window(grid);
        let spread = pressure * facing.points() as f64 / grid.points() as f64;
        let (kernel, heights) = (&self.problem.kernel, &self.heights);
        let contact = Contact { grid, facing, kernel, heights, wall, pressure: spread };
        let tolerance = self.goal(grid, Load::Pressure(pressure));
        let grid_fraction = grid.points() as f64 / self.cell.grid.points() as f64;
        let before = *iterations;
        let mut watch = |iteration: usize, residual: f64| {
            let step = Iteration { iteration: before + iteration, residual, tolerance, grid_fraction };
            let stopped = self.observer.iteration(step).is_break() || self.observer.stop_requested();
            if let Some(coarse) = coarse.as_ref().filter(|_| stopped || self.observer.snapshot_due()) {
                self.observer.snapshot(SnapshotRef {
                    grid: coarse.grid,
                    ranks: &ALONE,
                    gap: T::lend(&coarse.gap),
                    auxiliary: None,
                    plastic: self.flow.lend(),
                    progress: serde_json::to_value(&coarse.snapshot).expect("plain numbers"),
                });
            }
            if stopped { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let mut solve = |start: &ContactStress, target: f64, iterations: &mut usize| {
            let left = self.problem.max_iterations.saturating_sub(*iterations).min(LIMIT);
            let Solved { gap, stress, error_estimates, fft_pairs, iterations: done, stopped } =
                contact.solve(start, (target, left), &mut watch);
            *iterations += done;
            let finite = stress.values.iter().all(|s| s.is_finite()) && mean(&gap).is_finite();
            let state = finite.then(|| self.at_gap(grid, (gap, &stress), wall));
            (state, stress, (error_estimates, fft_pairs, stopped))
        };
        let (mut state, stress, (mut error_estimates, mut fft_pairs, mut stopped)) =
            solve(start, ACCURATE * tolerance, iterations);
        // The solver for the gap takes more transforms for what is missing.
        if let Some(level) = state.as_mut().filter(|_| stopped.is_continue()) {
            level.pressure = pressure;
            level.evaluate(self.problem.precision);
            let missing = level.last.residual / (pressure * tolerance);
            fft_pairs += 1.0;
            if missing > 1.0 && missing.is_finite() {
                let pairs;
                drop(state.take());
                (state, _, (error_estimates, pairs, stopped)) =
                    solve(&stress, ACCURATE * tolerance / missing, iterations);
                fft_pairs += pairs;
            }
        }
        let mut level = match (state, coarse) {
            (Some(level), _) => level,
            (None, Some(coarse)) => self.interpolated(grid, coarse),
            (None, None) => self.at_first_contact(grid),
        };
        (level.pressure, level.fft_pairs) = (pressure, fft_pairs);
        StressSolved { level, error_estimates, stopped }
    }

    fn interpolated(&self, grid: Grid, coarse: CoarseContact<T>) -> Level<'_, T, L> {
        let level = Level::with_gap(coarse.grid, self.body(coarse.grid), self.cell, None, coarse.gap);
        Level::refined(grid, self.law_on(grid), level)
    }

    /// A level with the gap of a contact stress: compressed where the stress acts, open elsewhere.
    fn at_gap(&self, grid: Grid, (mut gap, stress): (Vec<T>, &ContactStress), wall: f64) -> Level<'_, T, L> {
        let window = self.cell.window(grid);
        each_row(&mut gap, grid.nx, |y, gap| {
            gap[..window.inside(y, grid.nx)].iter_mut().for_each(|g| *g = g.max(T::zero()));
        });
        stress.nodes.iter().zip(&stress.values).for_each(|(i, s)| gap[*i as usize] = T::of(-wall * s));
        Level::with_gap(grid, self.body(grid), self.cell, None, gap)
    }
}
