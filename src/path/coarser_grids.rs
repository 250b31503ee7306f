//! Discretisation errors from grids coarser than the problem's.

use super::pull_off::{self, SeparationStart};
use crate::grid::{Grid, Series};
use crate::interface::RangeChoice;
use crate::method::{
    CoarseState, ContactMethod, ErrorEstimates, Heights, Iteration, Load, Observer, Problem, Run, Scale, SnapshotRef,
    Stop, find,
};
use crate::observe::{ContactArea, contact_area_on_ranks};
use crate::record::results::{Discretisation, Extrapolated, PullOff, ValueWithError};
use crate::{Error, Result};
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// Number of grids in an extrapolation to the requested range, including the problem's own: a parabola needs three.
pub(super) const EXTRAPOLATION: usize = 3;

/// Largest residual on coarser grids, relative to the pressure.
const TOLERANCE: f64 = 1e-3;

/// Method for coarser grids.
pub(super) fn method() -> &'static dyn ContactMethod {
    find("fast").expect("it is registered")
}

/// Up to `count` coarser grids, finest first; each has half as many points per side as the one before.
pub(super) fn grids(grid: Grid, count: usize) -> Vec<Grid> {
    let half = |g: Grid| Grid { nx: g.nx.div_ceil(2), ny: g.ny.div_ceil(2), ..g };
    let large_enough = |g: &Grid| g.nx.max(g.ny) >= 8;
    std::iter::successors(Some(half(grid)), |g| Some(half(*g))).take_while(large_enough).take(count).collect()
}

/// Results of one state on one grid, for comparison between grids.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GridResult {
    pub grid: Grid,
    pub range: f64,
    /// Contact fractions: node count (`counted`) and perimeter-corrected (`area`).
    pub counted: f64,
    pub area: f64,
    pub mean_gap: f64,
    /// Remaining iteration errors.
    pub error_estimates: ErrorEstimates,
}

impl GridResult {
    pub(super) fn new(
        grid: Grid,
        range: f64,
        area: &ContactArea,
        mean_gap: f64,
        error_estimates: ErrorEstimates,
    ) -> Self {
        GridResult { grid, range, counted: area.fraction, area: area.corrected, mean_gap, error_estimates }
    }
}

/// Fraction of the perimeter correction that always counts as uncertainty of the area. Correction factors fitted to
/// solved contacts range from 0.098 to 0.16, while the published factor is 0.118, and the areas of two grids may agree
/// by chance.
pub const CORRECTION: f64 = 1.0 / 3.0;

/// Minimum number of contact nodes on the coarser grid for a relative change of the area.
const FEW_NODES: f64 = 10.0;

/// Minimum mean gap over the rms height for a relative change of the mean gap.
const CLOSED: f64 = 1e-6;

/// Relative changes from a coarser to a finer grid. If the estimated iteration error of the coarse result exceeds the
/// difference, the sum of both is reported as a bound.
pub(super) fn discretisation(coarse: &GridResult, fine: &GridResult, rms_height: f64) -> Discretisation {
    let relative = |c: f64, f: f64, least: f64, error_estimates: Option<f64>| {
        let (difference, remaining) = ((f - c).abs(), error_estimates.unwrap_or(0.0) * c.abs());
        let bound = remaining > difference.max(least);
        (if bound { difference.max(least) + remaining } else { difference.max(least) } / f.abs(), bound)
    };
    let least = CORRECTION * (fine.counted - fine.area).abs();
    let area = relative(coarse.area, fine.area, least, coarse.error_estimates.area);
    let gap = relative(coarse.mean_gap, fine.mean_gap, 0.0, coarse.error_estimates.mean_gap);
    let touches = fine.area * coarse.grid.points() as f64 >= FEW_NODES;
    let open = fine.mean_gap > CLOSED * rms_height;
    Discretisation {
        area: touches.then_some(area.0),
        area_is_bound: touches && area.1,
        mean_gap: open.then_some(gap.0),
        mean_gap_is_bound: open && gap.1,
        coarser: [coarse.grid.nx, coarse.grid.ny],
    }
}

/// Relative change of the contact area from half of the points above which it says little.
const UNRESOLVED: f64 = 0.5;

/// A warning for loads whose contact the grid does not resolve. `loads`: name, contact fraction and change of each; `kind` comes before
/// the names.
pub fn unresolved_contact<'a>(
    kind: &str,
    loads: impl Iterator<Item = (String, f64, Option<&'a Discretisation>)>,
) -> Option<String> {
    let is_unresolved = |contact: f64, d: &Discretisation| contact > 0.0 && d.area.is_none_or(|a| a > UNRESOLVED);
    let names: Vec<String> =
        loads.filter(|(_, contact, d)| d.is_some_and(|d| is_unresolved(*contact, d))).map(|l| l.0).collect();
    (!names.is_empty()).then(|| {
        format!(
            "{kind}{}: the grid does not resolve the contact: with half of the points along each side its area changes by more than half, \
             or is below {FEW_NODES} nodes; a finer surface.grid or surface.resample, or a map without its shortest waves \
             (surface.low_pass_um), resolves it",
            names.join(", ")
        )
    })
}

/// Minimum rms gradient of the coarsest grid over that of the finest for an extrapolation over both.
const RESOLVED: f64 = 0.9;

/// Whether the coarse grid resolves the roughness well enough for an extrapolation.
pub(super) fn resolves_roughness(series: &Series<f64>, coarse: Grid, fine: Grid) -> bool {
    series.rms_gradient(coarse) >= RESOLVED * series.rms_gradient(fine)
}

/// Largest ratio of the last two slopes, and largest inverse ratio, at which the grids count as consistent.
const CONSISTENT: f64 = 1.5;

/// Fraction of the extrapolated change that remains as error for consistent grids.
const REMAINING_ERROR: f64 = 0.5;

/// Linear and quadratic extrapolation to `range` from `levels`, ordered from coarse to fine. `resolved`: whether
/// the coarsest grid resolves the roughness.
///
/// The value is the mean of the line through the last two results and the parabola through the last three. The error is
/// the difference of line and parabola, or half of the change from the finest grid if that is larger. If the results
/// are not consistent (slopes of different sign or differing by more than a factor of 1.5) or the coarsest grid does
/// not resolve the roughness, the error is the sum of that difference and the larger of the full change and the
/// differences between the grids. The error of the area also includes a third of the perimeter correction.
///
/// `None` if the error is as large as the value.
pub(super) fn extrapolated(range: f64, levels: &[GridResult], resolved: bool) -> Option<Extrapolated> {
    let fine = levels.last()?;
    let estimate = |of: fn(&GridResult) -> f64, least: f64| {
        let points: Vec<(f64, f64)> = levels.iter().map(|l| (l.range, of(l))).collect();
        let [.., a, b] = points[..] else { return None };
        let slope = (b.1 - a.1) / (b.0 - a.0);
        let line = b.1 + (range - b.0) * slope;
        let Some(&c) = points.len().checked_sub(3).map(|i| &points[i]) else {
            return Some(ValueWithError { value: line, error: (line - b.1).abs() + (b.1 - a.1).abs() + least });
        };
        // Newton's form of the parabola.
        let before = (a.1 - c.1) / (a.0 - c.0);
        let bend = (slope - before) / (b.0 - c.0);
        let parabola = line + bend * (range - b.0) * (range - a.0);
        let value = 0.5 * (line + parabola);
        let (spread, change) = ((line - parabola).abs(), (value - b.1).abs());
        let consistent =
            slope == before || (slope * before > 0.0 && (1.0 / CONSISTENT..=CONSISTENT).contains(&(slope / before)));
        let error = if resolved && consistent {
            spread.max(REMAINING_ERROR * change)
        } else {
            // For an extrapolation over a small fraction of the grids' ranges, a corresponding fraction of their
            // differences.
            let share = ((b.0 - range) / (REMAINING_ERROR * (c.0 - b.0))).min(1.0);
            spread + change.max(share * ((b.1 - a.1).abs() + (a.1 - c.1).abs()))
        };
        Some(ValueWithError { value, error: error + least })
    };
    let known = |e: &ValueWithError| e.error < e.value;
    let area = estimate(|l| l.area, CORRECTION * (fine.counted - fine.area).abs()).filter(known)?;
    let mean_gap = estimate(|l| l.mean_gap, 0.0).filter(known);
    Some(Extrapolated { range: range / fine.range, area, mean_gap })
}

/// Records the results of coarser grids that a nested method reports, and forwards all events to `observer`.
pub(super) struct CoarseGridResults<'a> {
    observer: &'a dyn Observer,
    threshold: f64,
    passed: Mutex<Vec<GridResult>>,
    /// Whether all loads are finished; later snapshots are discarded.
    done: AtomicBool,
}

impl<'a> CoarseGridResults<'a> {
    pub(super) fn new(observer: &'a dyn Observer, threshold: f64) -> Self {
        CoarseGridResults { observer, threshold, passed: Mutex::default(), done: AtomicBool::new(false) }
    }

    /// Saves the state after the last load, from which a search for pull-off restarts, and discards later snapshots.
    pub(super) fn finish(&self, snapshot: SnapshotRef) {
        self.observer.snapshot(snapshot);
        self.done.store(true, Relaxed);
    }

    /// The finest result since the last call.
    pub(super) fn take(&self) -> Option<GridResult> {
        std::mem::take(&mut *self.passed.lock().unwrap_or_else(|e| e.into_inner())).pop()
    }
}

impl Observer for CoarseGridResults<'_> {
    fn iteration(&self, step: Iteration) -> ControlFlow<()> {
        self.observer.iteration(step)
    }

    fn stop_requested(&self) -> bool {
        self.observer.stop_requested()
    }

    fn coarse_grid_done(&self, state: CoarseState) {
        let area = contact_area_on_ranks(state.ranks, state.grid, state.gap, self.threshold);
        let level = GridResult::new(state.grid, state.range, &area, state.mean_gap, state.error_estimates);
        self.passed.lock().unwrap_or_else(|e| e.into_inner()).push(level);
        self.observer.coarse_grid_done(state);
    }

    fn snapshot_due(&self) -> bool {
        !self.done.load(Relaxed) && self.observer.snapshot_due()
    }

    fn snapshot(&self, snapshot: SnapshotRef) {
        if !self.done.load(Relaxed) {
            self.observer.snapshot(snapshot);
        }
    }
}

/// Forwards requests to stop and discards all other events.
pub(super) struct StopOnly<'a>(pub &'a dyn Observer);

impl Observer for StopOnly<'_> {
    fn iteration(&self, _: Iteration) -> ControlFlow<()> {
        if self.0.stop_requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn stop_requested(&self) -> bool {
        self.0.stop_requested()
    }
}

/// The same problem on a coarser grid.
pub(super) fn coarsened<'s>(
    problem: &Problem<'s>,
    grid: Grid,
    heights: &'s Series<f64>,
    law: crate::interface::Adhesion,
) -> Problem<'s> {
    Problem {
        kernel: problem.kernel,
        adhesion: RangeChoice::Mesh.law(law, grid.dx().max(grid.dy())),
        wall: problem.wall,
        hardness: problem.hardness.map(|h| h.on_nodes(grid.nx, grid.ny)),
        precision: problem.precision,
        tolerance: TOLERANCE.max(problem.tolerance),
        max_iterations: problem.max_iterations,
        ranks: problem.ranks,
        ..Problem::new(grid, Heights::Series(heights))
    }
}

/// A solver that follows the load path on a coarser grid.
pub(super) struct CoarseSolver<'s> {
    problem: &'s Problem<'s>,
    run: Box<dyn Run + 's>,
    threshold: f64,
    /// The state at the last load, for a search for pull-off.
    /// State from which the separation starts, if `pulls_off`.
    start: Option<SeparationStart>,
    pulls_off: bool,
}

impl<'s> CoarseSolver<'s> {
    pub(super) fn start(
        problem: &'s Problem<'s>,
        threshold: f64,
        pulls_off: bool,
        observer: &'s dyn Observer,
    ) -> Result<Self> {
        Ok(CoarseSolver {
            problem,
            run: method().start(problem, observer)?.solver()?,
            threshold,
            start: None,
            pulls_off,
        })
    }

    /// `None` if this grid does not converge or the run is interrupted; the solve on the problem's own grid then stops
    /// by itself and writes its checkpoint.
    pub(super) fn follow(&mut self, load: Load) -> Result<Option<GridResult>> {
        let grid = self.problem.grid;
        let state = self.run.equilibrate(load)?;
        self.start = (self.pulls_off && state.stop == Stop::Converged).then(|| SeparationStart::of(&state));
        match state.stop {
            Stop::Converged => {
                let area = contact_area_on_ranks(state.ranks, grid, state.gap, self.threshold);
                Ok(Some(GridResult::new(
                    grid,
                    self.problem.adhesion.range(),
                    &area,
                    state.mean_gap,
                    state.error_estimates,
                )))
            }
            _ => Ok(None),
        }
    }

    /// Pull-off on this grid; `None` if it has none.
    pub(super) fn pull_off(&mut self, scale: Scale) -> Result<Option<(Grid, PullOff)>> {
        let Some(start) = self.start.take() else { return Ok(None) };
        match pull_off::search(&mut *self.run, self.problem, scale, start) {
            Ok(found) => Ok(Some((self.problem.grid, found))),
            // The result on the problem's own grid remains valid.
            Err(Error::NotConverged { .. } | Error::Input { .. }) => Ok(None),
            Err(e) => Err(e),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level(n: usize, range: f64, area: f64) -> GridResult {
        GridResult {
            grid: Grid::unit(n, n),
            range,
            counted: area,
            area,
            mean_gap: 1.0,
            error_estimates: ErrorEstimates::default(),
        }
    }

    /// For results on a parabola the value is the mean of line and parabola. The error is their difference, or half of
    /// the change from the finest grid if that is larger.
    #[test]
    fn a_parabola_is_extrapolated() {
        let area = |rho: f64| 0.03 - 0.2 * rho + 0.7 * rho * rho;
        let levels: Vec<GridResult> = [(64, 0.08), (128, 0.06), (256, 0.04)].map(|(n, r)| level(n, r, area(r))).into();
        let found = extrapolated(0.01, &levels, true).expect("three levels");
        let line = area(0.04) - 0.03 * (area(0.06) - area(0.04)) / 0.02;
        let value = 0.5 * (line + area(0.01));
        assert!((found.area.value - value).abs() < 1e-15, "{found:?}");
        let error = (line - area(0.01)).abs().max(0.5 * (value - area(0.04)).abs());
        assert!((found.area.error - error).abs() < 1e-15);
        assert_eq!((found.range, found.mean_gap), (0.25, Some(ValueWithError { value: 1.0, error: 0.0 })));
        assert!(extrapolated(0.01, &levels[2..], true).is_none());
    }

    /// The error includes the full change if the coarsest grid does not resolve the surface, if the results are not
    /// monotonic, and for two grids only. There is no estimate if the error is as large as the value.
    #[test]
    fn inconsistent_grids_have_larger_errors() {
        let of = |areas: [f64; 3]| -> Vec<GridResult> {
            [(64, 0.08), (128, 0.06), (256, 0.04)].iter().zip(areas).map(|(&(n, r), a)| level(n, r, a)).collect()
        };
        let steady = of([0.20, 0.21, 0.22]);
        let error = |levels: &[GridResult], resolved: bool| extrapolated(0.02, levels, resolved).map(|e| e.area.error);
        let close = |found: Option<f64>, expected: f64| {
            assert!(found.is_some_and(|f| (f - expected).abs() < 1e-12), "{found:?} {expected}");
        };
        close(error(&steady, true), 0.005);
        close(error(&steady, false), 0.02);
        close(error(&steady[1..], true), 0.02);
        // Line and parabola end at 0.23 and 0.25.
        close(error(&of([0.22, 0.21, 0.22]), true), 0.02 + 0.02);
        assert_eq!(error(&of([0.02, 0.22, 0.21]), true), None);
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
        let d = discretisation(&level(64, 0.0, 0.033), &level(128, 0.0, 0.03), 1.0);
        let relative = |d: Discretisation| d.area.expect("enough touches");
        assert!((relative(d) - 0.1).abs() < 1e-12 && d.mean_gap == Some(0.0) && d.coarser == [64, 64]);
        // Equal areas on two grids: a third of the perimeter correction remains.
        let fine = GridResult { counted: 0.036, ..level(128, 0.0, 0.03) };
        assert!((relative(discretisation(&level(64, 0.0, 0.03), &fine, 1.0)) - 0.2 / 3.0).abs() < 1e-12);
    }

    /// The iteration error of the coarser grid makes the change a bound. Very small contacts and mean gaps have no
    /// relative change.
    #[test]
    fn a_coarser_grid_with_an_iteration_error_gives_a_bound() {
        let error_estimates = ErrorEstimates { energy: None, area: Some(0.04), mean_gap: Some(1e-9) };
        let coarse = GridResult { mean_gap: 1.1, error_estimates, ..level(64, 0.0, 0.0301) };
        let d = discretisation(&coarse, &level(128, 0.0, 0.03), 1.0);
        assert!(d.area_is_bound && !d.mean_gap_is_bound && d.coarser == [64, 64], "{d:?}");
        assert!(d.area.is_some_and(|a| (a - (0.0001 + 0.04 * 0.0301) / 0.03).abs() < 1e-12), "{d:?}");
        assert!(d.mean_gap.is_some_and(|g| (g - 0.1).abs() < 1e-12), "{d:?}");
        let touching = discretisation(&level(64, 0.0, 9e-4), &level(128, 0.0, 1e-4), 1.0);
        assert_eq!((touching.area, touching.area_is_bound), (None, false));
        let closed = GridResult { mean_gap: 1e-9, ..level(128, 0.0, 1.0) };
        assert_eq!(discretisation(&coarse, &closed, 1.0).mean_gap, None);
    }
}
