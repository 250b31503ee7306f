//! What grids coarser than the problem's say about its error.

use crate::Result;
use crate::grid::{Grid, Series};
use crate::interface::{Law, RangeChoice};
use crate::method::{
    CoarseState, ContactMethod, Goals, Heights, Iteration, Load, Problem, Run, Settled, Snapshot, Stop, Watch, find,
};
use crate::observe::{ContactArea, contact_area};
use crate::record::results::{Discretisation, Estimate, Extrapolated};
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// Grids that an extrapolation in the range takes, the problem's own among them: a parabola's worth.
pub(super) const EXTRAPOLATION: usize = 3;

/// Residual over the pressure on the coarser grids: a hundredth of what they are compared for.
const TOLERANCE: f64 = 1e-3;

/// The method for coarser grids: what they are asked does not depend on it.
pub(super) fn method() -> &'static dyn ContactMethod {
    find("fast").expect("it is registered")
}

/// Up to `count` grids below `grid`, each of half the points a side, finest first.
pub(super) fn grids(grid: Grid, count: usize) -> Vec<Grid> {
    let half = |g: Grid| Grid { nx: g.nx.div_ceil(2), ny: g.ny.div_ceil(2), ..g };
    let finer_than_nothing = |g: &Grid| g.nx.max(g.ny) >= 8;
    std::iter::successors(Some(half(grid)), |g| Some(half(*g))).take_while(finer_than_nothing).take(count).collect()
}

/// A state on one grid, in the numbers that are compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Level {
    pub grid: Grid,
    pub range: f64,
    /// Contact fraction: nodes counted, and perimeter-corrected.
    pub counted: f64,
    pub area: f64,
    pub mean_gap: f64,
    /// What may still have been to come.
    pub settled: Settled,
}

impl Level {
    pub fn new(grid: Grid, range: f64, area: &ContactArea, mean_gap: f64, settled: Settled) -> Self {
        Level { grid, range, counted: area.fraction, area: area.corrected, mean_gap, settled }
    }
}

/// Part of the perimeter correction that an area is in doubt by whatever coarser grids say: factors fitted to solved contacts
/// lie between 0.098 and 0.16, where the printed one is 0.118, and areas of two grids may agree by chance.
const CORRECTION: f64 = 1.0 / 3.0;

/// The change from a coarser grid, or what that grid was still to change by, if that is more.
pub(super) fn discretisation(coarse: &Level, fine: &Level) -> Discretisation {
    let change = |c: f64, f: f64| if f == c { 0.0 } else { (f - c).abs() / f.abs().max(f64::MIN_POSITIVE) };
    Discretisation {
        area: change(coarse.area, fine.area)
            .max(CORRECTION * change(fine.counted, fine.area))
            .max(coarse.settled.area.unwrap_or(0.0)),
        mean_gap: Some(change(coarse.mean_gap, fine.mean_gap).max(coarse.settled.mean_gap.unwrap_or(0.0))),
        coarser: [coarse.grid.nx, coarse.grid.ny],
    }
}

/// What a range would give that is shorter than those of `levels`, which go from coarse to fine. The value is half-way between the line through the last two and the parabola through the
/// last three: on the challenge's spectrum the truth lies between them or beside them by less than they differ, and their
/// difference is the error.
pub(super) fn extrapolated(range: f64, levels: &[Level]) -> Option<Extrapolated> {
    let fine = levels.last()?;
    let estimate = |of: fn(&Level) -> f64| {
        let points: Vec<(f64, f64)> = levels.iter().map(|l| (l.range, of(l))).collect();
        let [.., a, b] = points[..] else { return None };
        let line = b.1 + (range - b.0) * (b.1 - a.1) / (b.0 - a.0);
        let Some(&c) = points.len().checked_sub(3).map(|i| &points[i]) else {
            return Some(Estimate { value: line, error: (line - b.1).abs() });
        };
        // Newton's form, from the finest point on.
        let bend = ((b.1 - a.1) / (b.0 - a.0) - (a.1 - c.1) / (a.0 - c.0)) / (b.0 - c.0);
        let parabola = line + bend * (range - b.0) * (range - a.0);
        Some(Estimate { value: 0.5 * (line + parabola), error: (line - parabola).abs() })
    };
    Some(Extrapolated { range: range / fine.range, area: estimate(|l| l.area)?, mean_gap: estimate(|l| l.mean_gap) })
}

/// Notes the grids that a method comes by, and passes everything on.
pub(super) struct Levels<'a> {
    watch: &'a dyn Watch,
    threshold: f64,
    passed: Mutex<Vec<Level>>,
    /// Whether the loads are done, so that nothing is kept any more.
    done: AtomicBool,
}

impl<'a> Levels<'a> {
    pub fn new(watch: &'a dyn Watch, threshold: f64) -> Self {
        Levels { watch, threshold, passed: Mutex::default(), done: AtomicBool::new(false) }
    }

    /// Keeps the state after the last load, from which a pull-off is done anew, and no other from now on.
    pub fn finish(&self, snapshot: Snapshot) {
        self.watch.snapshot(snapshot);
        self.done.store(true, Relaxed);
    }

    /// The finest since the last call.
    pub fn take(&self) -> Option<Level> {
        std::mem::take(&mut *self.passed.lock().unwrap_or_else(|e| e.into_inner())).pop()
    }
}

impl Watch for Levels<'_> {
    fn iteration(&self, step: Iteration) -> ControlFlow<()> {
        self.watch.iteration(step)
    }

    fn stopping(&self) -> bool {
        self.watch.stopping()
    }

    fn level(&self, state: CoarseState) {
        let area = contact_area(state.grid, state.gap, self.threshold);
        let level = Level::new(state.grid, state.range, &area, state.mean_gap, state.settled);
        self.passed.lock().unwrap_or_else(|e| e.into_inner()).push(level);
        self.watch.level(state);
    }

    fn wants_snapshot(&self) -> bool {
        !self.done.load(Relaxed) && self.watch.wants_snapshot()
    }

    fn snapshot(&self, snapshot: Snapshot) {
        if !self.done.load(Relaxed) {
            self.watch.snapshot(snapshot);
        }
    }
}

/// Stops when the path is to stop, and tells nothing.
pub(super) struct Silent<'a>(pub &'a dyn Watch);

impl Watch for Silent<'_> {
    fn iteration(&self, _: Iteration) -> ControlFlow<()> {
        if self.0.stopping() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn stopping(&self) -> bool {
        self.0.stopping()
    }
}

/// The same problem on a coarser grid.
pub(super) fn coarsened<'s>(
    problem: &Problem,
    grid: Grid,
    heights: &'s Series<f64>,
    law: crate::interface::Adhesion,
) -> Problem<'s> {
    Problem {
        grid,
        heights: Heights::Series(heights),
        kernel: problem.kernel,
        adhesion: RangeChoice::Mesh.law(law, grid.dx().max(grid.dy())),
        wall: problem.wall,
        precision: problem.precision,
        tolerance: TOLERANCE.max(problem.tolerance),
        goals: Goals::default(),
        max_iterations: problem.max_iterations,
    }
}

/// A coarser grid that follows the same path.
pub(super) struct Companion<'s> {
    problem: &'s Problem<'s>,
    run: Box<dyn Run + 's>,
    threshold: f64,
}

impl<'s> Companion<'s> {
    pub fn start(problem: &'s Problem<'s>, threshold: f64, watch: &'s dyn Watch) -> Result<Self> {
        Ok(Companion { problem, run: method().start(problem, watch)?, threshold })
    }

    /// `None` where this grid has no equilibrium to offer, or no time: the problem's own solve stops at once then, and keeps
    /// what is worth keeping.
    pub fn follow(&mut self, load: Load) -> Result<Option<Level>> {
        let grid = self.problem.grid;
        let state = self.run.equilibrate(load)?;
        match state.stop {
            Stop::Converged => {
                let area = contact_area(grid, state.gap, self.threshold);
                Ok(Some(Level::new(grid, self.problem.adhesion.range(), &area, state.mean_gap, state.settled)))
            }
            _ => Ok(None),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level(n: usize, range: f64, area: f64) -> Level {
        Level { grid: Grid::unit(n, n), range, counted: area, area, mean_gap: 1.0, settled: Settled::default() }
    }

    /// A parabola in the range is met half-way between its chord and itself, with their distance as the error.
    #[test]
    fn a_parabola_is_extrapolated() {
        let area = |rho: f64| 0.03 - 0.2 * rho + 0.7 * rho * rho;
        let levels: Vec<Level> = [(64, 0.08), (128, 0.06), (256, 0.04)].map(|(n, r)| level(n, r, area(r))).into();
        let found = extrapolated(0.01, &levels).expect("three levels");
        let line = area(0.04) - 0.03 * (area(0.06) - area(0.04)) / 0.02;
        assert!((found.area.value - 0.5 * (line + area(0.01))).abs() < 1e-15, "{found:?}");
        assert!((found.area.error - (line - area(0.01)).abs()).abs() < 1e-15);
        assert_eq!((found.range, found.mean_gap), (0.25, Some(Estimate { value: 1.0, error: 0.0 })));
        // Two levels have a line, and all of what it adds in doubt.
        let two = extrapolated(0.01, &levels[1..]).expect("two levels");
        assert!((two.area.value - line).abs() < 1e-15 && (two.area.error - (line - area(0.04)).abs()) < 1e-15);
        assert!(extrapolated(0.01, &levels[2..]).is_none());
    }

    #[test]
    fn coarser_grids_halve() {
        let sizes =
            |n: usize, count: usize| -> Vec<usize> { grids(Grid::unit(n, n), count).iter().map(|g| g.nx).collect() };
        assert_eq!(sizes(512, 2), [256, 128]);
        assert_eq!(sizes(15, 2), [8]);
        assert!(sizes(1, 2).is_empty());
    }

    #[test]
    fn changes_are_relative() {
        let d = discretisation(&level(64, 0.0, 0.033), &level(128, 0.0, 0.03));
        assert!((d.area - 0.1).abs() < 1e-12 && d.mean_gap == Some(0.0) && d.coarser == [64, 64]);
        // Equal areas of two grids are no proof: a third of the correction stays in doubt.
        let fine = Level { counted: 0.036, ..level(128, 0.0, 0.03) };
        assert!((discretisation(&level(64, 0.0, 0.03), &fine).area - 0.2 / 3.0).abs() < 1e-12);
    }
}
