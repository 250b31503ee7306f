//! Discretisation errors from grids coarser than the problem's.

use super::leakage::leakage;
use crate::interface::{AttractionLaw, RangeChoice};
use crate::method::{
    CoarseState, ContactMethod, Equilibrium, ErrorEstimates, Fast, Heights, Iteration, Observer, ReducedProblem,
    SnapshotRef, SolverSnapshot,
};
use crate::observe::{ContactArea, ELASTIC_EDGE};
use crate::state::{Discretisation, Extrapolated};
use crate::uncertainty::ValueWithError;
use asperity_grid::sys::ranks::Ranks;
use asperity_grid::{Error, Result};
use asperity_grid::{Field, Grid, Series};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// Number of grids in an extrapolation to the requested range, including the problem's own: a parabola needs three.
pub(super) const EXTRAPOLATION: usize = 3;

/// Largest residual on coarser grids, relative to the pressure.
const TOLERANCE: f64 = 1e-3;

/// Method for coarser grids.
pub(super) fn method() -> &'static dyn ContactMethod {
    &Fast
}

/// Up to `count` coarser grids, finest first; each has half as many points per side as the one before.
pub(super) fn grids(grid: Grid, count: usize) -> Vec<Grid> {
    let half = |g: Grid| Grid { nx: g.nx.div_ceil(2), ny: g.ny.div_ceil(2), ..g };
    let large_enough = |g: &Grid| g.nx.max(g.ny) >= 8;
    std::iter::successors(Some(half(grid)), |g| Some(half(*g))).take_while(large_enough).take(count).collect()
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Grid")]
struct StoredGrid {
    nx: usize,
    ny: usize,
    lx: f64,
    ly: f64,
}

/// Results of one state on one grid, for comparison between grids.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct GridResult {
    #[serde(with = "StoredGrid")]
    pub grid: Grid,
    pub range: f64,
    /// Contact area, and its uncertainty by edges.
    pub area: f64,
    pub edges: f64,
    pub mean_gap: f64,
    /// Contact stiffness, if known, E*/L.
    pub stiffness: Option<f64>,
    /// Hydraulic gaps along x and y, if requested.
    pub gaps: Option<[f64; 2]>,
    /// Remaining iteration errors.
    pub error_estimates: ErrorEstimates,
}

impl GridResult {
    pub(super) fn new(state: &Equilibrium, grid: Grid, range: f64, area: &ContactArea) -> Self {
        let &Equilibrium { mean_gap, stiffness, error_estimates, .. } = state;
        let (area, edges) = (area.contact_area, edge_uncertainty(area, grid));
        GridResult { grid, range, area, edges, mean_gap, stiffness, gaps: None, error_estimates }
    }
}

/// Hydraulic gaps of a coarse grid; of several ranks on the first.
pub(super) fn flow_gaps(problem: &ReducedProblem, (ranks, gap): (&Ranks, Field), threshold: f64) -> Option<[f64; 2]> {
    let hydraulic_gaps_of = |gap: Field| leakage(problem, gap, threshold, None).map(|flow| flow.hydraulic_gaps());
    if !ranks.are_several() {
        return hydraulic_gaps_of(gap);
    }
    let whole = ranks.gather_on_first(&gap.to_vec(), &ranks.shares(problem.grid.ny, problem.grid.nx));
    if ranks.is_first() { hydraulic_gaps_of(Field::F64(&whole)) } else { None }
}

/// Uncertainty of the area per boundary edge, in areas of a node: a third of the excess of an elastic edge, of any kind of edge but steps.
/// Factors fitted to solved contacts range from 0.098 to 0.16, and the areas of two grids may agree by chance.
const EDGE_UNCERTAINTY: f64 = ELASTIC_EDGE / 3.0;

/// The same for edges that are one point each, of a profile: their excess is 0.19, not 0.118, and does not average out as that of edges in all
/// directions. Fitted to 194 solved profiles against grids sixteen times finer: too large by 0.075 per edge, with a scatter of 0.5 nodes times
/// the root of the edges. `scripts/errors.py --kind profile --kind grooves` tests these three constants on others.
const POINT_EDGE_UNCERTAINTY: f64 = 0.08;
const POINT_EDGE_SCATTER: f64 = 0.8;

/// Mean length of straight edges, in nodes, up to which edges have the excess of many directions: those of random contacts have 1 to 3.
const STRAIGHT: f64 = 4.0;

/// Scatter of such edges, in nodes: the grooves of a texture are alike, and so are their errors.
const STRAIGHT_EDGE_SCATTER: f64 = 1.3;

/// The uncertainty of a counted area by its edges, over the area of the cell. Edges in a straight line, as of grooves, move together.
pub fn edge_uncertainty(area: &ContactArea, grid: Grid) -> f64 {
    let (edges, ends) = (area.free_edges as f64, (area.free_edges - area.straight_edges) as f64);
    let nodes = if grid.ny == 1 {
        POINT_EDGE_UNCERTAINTY * edges + POINT_EDGE_SCATTER * edges.sqrt()
    } else {
        let length = (edges / ends).min(grid.nx.max(grid.ny) as f64);
        let straight = (edges * (length - STRAIGHT).max(0.0)).sqrt();
        EDGE_UNCERTAINTY * edges + STRAIGHT_EDGE_SCATTER * straight
    };
    nodes / grid.points() as f64
}

/// Minimum number of contact nodes on the coarser grid for a relative change of the area.
const FEW_NODES: f64 = 10.0;

/// Minimum mean gap over the rms height for a relative change of the mean gap.
const CLOSED: f64 = 1e-6;

/// Changes from the grid with half of the points along each side that are the error of a result, besides [`EDGE_UNCERTAINTY`]: most of a change
/// is the error of the coarser grid. Fitted to 300 surfaces of seeds 950 and 951 (self-affine, anisotropic, plateau-honed, noisy, stepped,
/// single bumps; with adhesion, hardness, layers) against grids four times finer, and to the cases of `make errors` of seeds 901 and 902; it
/// tests them on others.
#[derive(Debug, Clone, Copy)]
pub(super) struct ErrorFactors {
    area: f64,
    mean_gap: f64,
    /// Share of the relative error of the area that the mean gap has besides: the gaps of two grids may agree by chance.
    gap_by_area: f64,
    stiffness: f64,
}

impl ErrorFactors {
    const ELASTIC: ErrorFactors = ErrorFactors { area: 0.5, mean_gap: 1.0, gap_by_area: 0.03, stiffness: 1.0 };

    pub(super) fn of(problem: &ReducedProblem) -> Self {
        let mut factors = ErrorFactors::ELASTIC;
        if problem.adhesion != AttractionLaw::None {
            // Edges jump.
            (factors.area, factors.stiffness) = (1.0, 3.0);
        }
        if problem.hardness.is_some() {
            // The flow differs from grid to grid, too.
            (factors.mean_gap, factors.gap_by_area) = (2.0, 0.3);
        }
        if !problem.kernel.is_periodic() {
            // The nodes of two grids cover other areas.
            factors.mean_gap = 2.0;
        }
        factors
    }
}

/// Relative errors of the finer grid, from its changes to the coarser. If the estimated iteration error of the coarse result exceeds the
/// change, the sum of both is reported as a bound.
pub(super) fn discretisation(
    coarse: &GridResult,
    fine: &GridResult,
    (rms_height, factors): (f64, ErrorFactors),
) -> Discretisation {
    let relative = |c: f64, f: f64, error_estimates: Option<f64>| {
        let (difference, remaining) = ((f - c).abs(), error_estimates.unwrap_or(0.0) * c.abs());
        let bound = remaining > difference;
        (if bound { difference + remaining } else { difference } / f.abs(), bound)
    };
    let area = relative(coarse.area, fine.area, coarse.error_estimates.area);
    let gap = relative(coarse.mean_gap, fine.mean_gap, coarse.error_estimates.mean_gap);
    let touches = fine.area * coarse.grid.points() as f64 >= FEW_NODES;
    let edges = fine.edges / fine.area;
    let area_error = factors.area * area.0 + edges;
    let open = fine.mean_gap > CLOSED * rms_height;
    Discretisation {
        area: touches.then_some(area_error),
        area_is_bound: touches && area.1,
        mean_gap: (open && touches).then_some(factors.mean_gap * gap.0 + factors.gap_by_area * area_error),
        mean_gap_is_bound: open && touches && gap.1,
        stiffness: coarse
            .stiffness
            .zip(fine.stiffness)
            .filter(|_| touches)
            .map(|(c, f)| factors.stiffness * (f - c).abs() / f + edges),
        coarser: [coarse.grid.nx, coarse.grid.ny],
    }
}

/// Relative error of the contact area by the grid above which it says little.
const UNRESOLVED: f64 = 0.3;

/// Whether a grid does not resolve a contact of this area.
pub(crate) fn is_unresolved(contact_area: f64, d: &Discretisation) -> bool {
    contact_area > 0.0 && contact_area < 1.0 && d.area.is_none_or(|a| a > UNRESOLVED)
}

/// A warning for loads whose contact the grid does not resolve. `loads`: name, contact fraction and change of each; `kind` comes before
/// the names.
pub fn unresolved_contact<'a>(
    kind: &str,
    loads: impl Iterator<Item = (String, f64, Option<&'a Discretisation>)>,
) -> Option<String> {
    let mut names: Vec<String> =
        loads.filter(|(_, contact, d)| d.is_some_and(|d| is_unresolved(*contact, d))).map(|l| l.0).collect();
    // A load of both branches is named once.
    let mut named = BTreeSet::new();
    names.retain(|name| named.insert(name.clone()));
    (!names.is_empty()).then(|| {
        format!(
            "{kind}{}: the grid does not resolve the contact: the error of its area by the grid is above 30 %, \
             or the coarser grid has fewer than {FEW_NODES} nodes in contact; a finer grid (surface.grid of a spectrum, surface.resample of a map), or a map without its shortest waves \
             (surface.low_pass), resolves it",
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

/// A quantity that is extrapolated in a variable without bounds, so that it stays within its own.
struct Bounded {
    of: fn(&GridResult) -> f64,
    variable: fn(f64) -> f64,
    value: fn(f64) -> f64,
    /// Its error over that of [`in_variable`]: by `make errors`, 91 % of 44 areas were within one time that error, and 95 % of 41 others within 1.5.
    widened: f64,
}

/// Contact area between 0 and 1 by its logit.
const AREA: Bounded =
    Bounded { of: |l| l.area, variable: |a| (a / (1.0 - a)).ln(), value: |y| 1.0 / (1.0 + (-y).exp()), widened: 1.5 };

/// Mean gap above 0 by its logarithm.
const MEAN_GAP: Bounded = Bounded { of: |l| l.mean_gap, variable: f64::ln, value: f64::exp, widened: 1.0 };

/// Share of the relative error of the extrapolated area that the mean gap has at least: consistent grids say nothing of what the finest lacks.
const EXTRAPOLATED_GAP_BY_AREA: f64 = 0.2;

/// Linear and quadratic extrapolation to `range` from `levels`, ordered from coarse to fine. `resolved`: whether
/// the coarsest grid resolves the roughness.
///
/// The value is the mean of the line through the last two results and the parabola through the last three, in the variable of
/// [`Bounded`]. The error there is the difference of line and parabola, or half of the change from the finest grid if that is larger.
/// If the results are not consistent (slopes of different sign or differing by more than a factor of 1.5) or the coarsest grid does
/// not resolve the roughness, the error is the sum of that difference and the larger of the full change and the
/// differences between the grids. The error of the quantity is the larger of its changes by the error of the variable up and down; that
/// of the area also includes its uncertainty by edges, that of the mean gap a share of the relative error of the area.
///
/// `None` for a quantity at a bound, and if the error is as large as the value.
pub(super) fn extrapolated(range: f64, levels: &[GridResult], resolved: bool) -> Option<Extrapolated> {
    let fine = levels.last()?;
    let estimate = |quantity: &Bounded, smallest: f64| {
        let extrapolation = in_variable(range, levels, quantity, resolved)?;
        let value = (quantity.value)(extrapolation.value);
        let change = |by: f64| ((quantity.value)(extrapolation.value + by) - value).abs();
        let by = quantity.widened * extrapolation.error;
        let error = change(by).max(change(-by)) + smallest;
        (value.is_finite() && error < value).then_some(ValueWithError { value, error })
    };
    let area = estimate(&AREA, fine.edges)?;
    let smallest = EXTRAPOLATED_GAP_BY_AREA * fine.mean_gap * area.error / area.value;
    Some(Extrapolated { range: range / fine.range, area, mean_gap: estimate(&MEAN_GAP, smallest) })
}

/// The same in the variable of a quantity; `None` if it is not finite.
fn in_variable(range: f64, levels: &[GridResult], quantity: &Bounded, resolved: bool) -> Option<ValueWithError> {
    let points: Vec<(f64, f64)> = levels.iter().map(|l| (l.range, (quantity.variable)((quantity.of)(l)))).collect();
    let [.., a, b] = points[..] else { return None };
    if points.iter().any(|p| !p.1.is_finite()) {
        return None;
    }
    let slope = (b.1 - a.1) / (b.0 - a.0);
    let line = b.1 + (range - b.0) * slope;
    let Some(&c) = points.len().checked_sub(3).map(|i| &points[i]) else {
        return Some(ValueWithError { value: line, error: (line - b.1).abs() + (b.1 - a.1).abs() });
    };
    // Newton's form of the parabola.
    let previous = (a.1 - c.1) / (a.0 - c.0);
    let bend = (slope - previous) / (b.0 - c.0);
    let parabola = line + bend * (range - b.0) * (range - a.0);
    let value = 0.5 * (line + parabola);
    let (spread, change) = ((line - parabola).abs(), (value - b.1).abs());
    let consistent =
        slope == previous || (slope * previous > 0.0 && (1.0 / CONSISTENT..=CONSISTENT).contains(&(slope / previous)));
    let error = if resolved && consistent {
        spread.max(REMAINING_ERROR * change)
    } else {
        // For an extrapolation over a small fraction of the grids' ranges, a corresponding fraction of their
        // differences.
        let fraction = ((b.0 - range) / (REMAINING_ERROR * (c.0 - b.0))).min(1.0);
        spread + change.max(fraction * ((b.1 - a.1).abs() + (a.1 - c.1).abs()))
    };
    Some(ValueWithError { value, error })
}

/// Records the results of coarser grids that a nested method reports, and forwards all events to `observer`.
pub(super) struct CoarseGridResults<'a> {
    observer: &'a dyn Observer,
    problem: &'a ReducedProblem<'a>,
    threshold: f64,
    leakage: bool,
    passed: Mutex<Vec<GridResult>>,
    /// Whether all loads are finished; later snapshots are discarded.
    done: AtomicBool,
}

/// Scalars of a snapshot, with the results of the coarser grids of its load: a resumed solve has the error of an uninterrupted one.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ProgressWithGrids {
    coarser: Vec<GridResult>,
    method: serde_json::Value,
}

impl<'a> CoarseGridResults<'a> {
    pub(super) fn new(
        observer: &'a dyn Observer,
        problem: &'a ReducedProblem<'a>,
        (threshold, leakage): (f64, bool),
    ) -> Self {
        CoarseGridResults {
            observer,
            problem,
            threshold,
            leakage,
            passed: Mutex::default(),
            done: AtomicBool::new(false),
        }
    }

    /// Saves the state after the last load, from which a search for pull-off restarts, and discards later snapshots.
    pub(super) fn finish(&self, snapshot: SnapshotRef) {
        self.observer.snapshot(snapshot);
        self.done.store(true, Relaxed);
    }

    /// Takes the results of coarser grids out of a snapshot, which the method then resumes.
    ///
    /// # Errors
    /// `Input` for a snapshot of something else.
    pub(super) fn resumed(&self, snapshot: SolverSnapshot) -> Result<SolverSnapshot> {
        let SolverSnapshot { progress, .. } = &snapshot;
        let foreign = |e| Error::input("checkpoint", "progress", e, "that of a load path");
        let ProgressWithGrids { coarser, method } = serde_json::from_value(progress.clone()).map_err(foreign)?;
        self.passed.lock().unwrap_or_else(|e| e.into_inner()).extend(coarser);
        Ok(SolverSnapshot { progress: method, ..snapshot })
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
        let CoarseState { ranks, grid, gap, pressure, mean_gap, stiffness, error_estimates, range, .. } = state;
        let problem = ReducedProblem { grid, ..self.problem.clone() };
        let area = problem.contact_area_of_iterate((ranks, gap), pressure, self.threshold);
        let (area, edges) = (area.contact_area, edge_uncertainty(&area, grid));
        // Of the next coarser grid alone, which has at least a quarter of the points.
        let next = 4 * grid.points() >= self.problem.grid.points();
        let gaps = if self.leakage && next { flow_gaps(&problem, (ranks, gap), self.threshold) } else { None };
        let level = GridResult { grid, range, area, edges, mean_gap, stiffness, gaps, error_estimates };
        self.passed.lock().unwrap_or_else(|e| e.into_inner()).push(level);
        self.observer.coarse_grid_done(state);
    }

    fn snapshot_due(&self) -> bool {
        !self.done.load(Relaxed) && self.observer.snapshot_due()
    }

    fn snapshot(&self, snapshot: SnapshotRef) {
        if self.done.load(Relaxed) {
            return;
        }
        // A state without that of a solver begins its load anew.
        let progress = match snapshot.progress {
            serde_json::Value::Null => serde_json::Value::Null,
            method => {
                let coarser = self.passed.lock().unwrap_or_else(|e| e.into_inner()).clone();
                serde_json::to_value(ProgressWithGrids { coarser, method }).expect("plain numbers")
            }
        };
        self.observer.snapshot(SnapshotRef { progress, ..snapshot });
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
    problem: &ReducedProblem<'s>,
    grid: Grid,
    heights: &'s Series<f64>,
    law: AttractionLaw,
) -> ReducedProblem<'s> {
    ReducedProblem {
        kernel: problem.kernel,
        adhesion: RangeChoice::Mesh.law(law, grid.dx().max(grid.dy())),
        wall: problem.wall,
        hardness: problem.hardness.map(|h| h.on_nodes(grid.nx, grid.ny)),
        precision: problem.precision,
        tolerance: TOLERANCE.max(problem.tolerance),
        max_iterations: problem.max_iterations,
        stiffness: problem.stiffness,
        ranks: problem.ranks,
        ..ReducedProblem::new(grid, Heights::Series(heights))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level(n: usize, range: f64, area: f64) -> GridResult {
        GridResult {
            grid: Grid::unit(n, n),
            range,
            area,
            edges: 0.0,
            mean_gap: 1.0,
            stiffness: None,
            gaps: None,
            error_estimates: ErrorEstimates::default(),
        }
    }

    /// For a logit on a parabola the value is the mean of line and parabola. The error is 1.5 times their difference, or half of
    /// the change from the finest grid if that is larger.
    #[test]
    fn a_parabola_is_extrapolated() {
        let logit = |rho: f64| -3.0 - 20.0 * rho + 70.0 * rho * rho;
        let levels: Vec<GridResult> =
            [(64, 0.08), (128, 0.06), (256, 0.04)].map(|(n, r)| level(n, r, (AREA.value)(logit(r)))).into();
        let actual = extrapolated(0.01, &levels, true).expect("three levels");
        let line = logit(0.04) - 0.03 * (logit(0.06) - logit(0.04)) / 0.02;
        let value = 0.5 * (line + logit(0.01));
        assert!((actual.area.value - (AREA.value)(value)).abs() < 1e-15, "{actual:?}");
        let error = AREA.widened * (line - logit(0.01)).abs().max(0.5 * (value - logit(0.04)).abs());
        assert!((actual.area.error - ((AREA.value)(value + error) - (AREA.value)(value))).abs() < 1e-14);
        let smallest = 0.2 * actual.area.error / actual.area.value;
        assert_eq!((actual.range, actual.mean_gap), (0.25, Some(ValueWithError { value: 1.0, error: smallest })));
        assert!(extrapolated(0.01, &levels[2..], true).is_none());
    }

    /// Areas that rise steeply towards full contact stay below it, and gaps that fall towards zero above it.
    #[test]
    fn values_stay_within_their_bounds() {
        for areas in [[0.5, 0.7, 0.9], [0.9, 0.95, 0.999], [1e-4, 0.1, 0.9999], [0.9, 0.2, 1e-3]] {
            let level_with = |(&(n, r), a): (&(usize, f64), f64)| GridResult { mean_gap: 1.0 - a, ..level(n, r, a) };
            let levels: Vec<GridResult> =
                [(64, 0.08), (128, 0.06), (256, 0.04)].iter().zip(areas).map(level_with).collect();
            for actual in [0.03, 0.01, 1e-4].iter().filter_map(|range| extrapolated(*range, &levels, true)) {
                assert!((0.0..=1.0).contains(&actual.area.value) && actual.mean_gap.is_none_or(|g| g.value > 0.0));
            }
        }
        // Full contact has no logit.
        let full = [level(64, 0.08, 0.9), level(128, 0.06, 0.95), level(256, 0.04, 1.0)];
        assert!(extrapolated(0.01, &full, true).is_none());
    }

    /// The error includes the full change if the coarsest grid does not resolve the surface, if the results are not
    /// monotonic, and for two grids only. There is no estimate if the error is as large as the value.
    #[test]
    fn inconsistent_grids_have_larger_errors() {
        let levels_with = |logits: [f64; 3]| -> Vec<GridResult> {
            let levels = [(64, 0.08), (128, 0.06), (256, 0.04)];
            levels.iter().zip(logits).map(|(&(n, r), y)| level(n, r, (AREA.value)(y))).collect()
        };
        let steady = levels_with([-1.4, -1.3, -1.2]);
        let error = |levels: &[GridResult], resolved: bool| extrapolated(0.02, levels, resolved).map(|e| e.area.error);
        // From the value of the logit and its error.
        let close = |actual: Option<f64>, value: f64, by: f64| {
            let expected = (AREA.value)(value + AREA.widened * by) - (AREA.value)(value);
            assert!(actual.is_some_and(|f| (f - expected).abs() < 1e-12), "{actual:?} {expected}");
        };
        close(error(&steady, true), -1.1, 0.05);
        close(error(&steady, false), -1.1, 0.2);
        close(error(&steady[1..], true), -1.1, 0.2);
        // Line and parabola end at -1.1 and -0.9.
        close(error(&levels_with([-1.2, -1.3, -1.2]), true), -1.0, 0.2 + 0.2);
        assert_eq!(error(&levels_with([-4.0, -1.2, -1.3]), true), None);
    }

    #[test]
    fn coarser_grids_halve() {
        let sizes =
            |n: usize, count: usize| -> Vec<usize> { grids(Grid::unit(n, n), count).iter().map(|g| g.nx).collect() };
        assert_eq!(sizes(512, 2), [256, 128]);
        assert_eq!(sizes(15, 2), [8]);
        assert!(sizes(1, 2).is_empty());
    }

    const FACTORS: ErrorFactors = ErrorFactors::ELASTIC;

    /// rms height, and an elastic body.
    const ELASTIC: (f64, ErrorFactors) = (1.0, FACTORS);

    #[test]
    fn changes_are_relative() {
        let d = discretisation(&level(64, 0.0, 0.033), &level(128, 0.0, 0.03), ELASTIC);
        let relative = |d: Discretisation| d.area.expect("enough touches");
        assert!((relative(d) - FACTORS.area * 0.1).abs() < 1e-12 && d.coarser == [64, 64]);
        // The mean gap is equal on both grids; a share of the error of the area remains, a larger one where the body flows.
        assert!(d.mean_gap.is_some_and(|g| (g - FACTORS.gap_by_area * relative(d)).abs() < 1e-12), "{d:?}");
        let flow = ErrorFactors { gap_by_area: 0.2, ..FACTORS };
        let flowing = discretisation(&level(64, 0.0, 0.033), &level(128, 0.0, 0.03), (1.0, flow));
        assert!(flowing.mean_gap.is_some_and(|g| (g - 0.2 * relative(d)).abs() < 1e-12));
        // Equal areas on two grids: the uncertainty by edges remains.
        let fine = GridResult { edges: 0.002, ..level(128, 0.0, 0.03) };
        assert!((relative(discretisation(&level(64, 0.0, 0.03), &fine, ELASTIC)) - 0.2 / 3.0).abs() < 1e-12);
        let [coarse, fine] = [10.0, 8.0].map(|k| GridResult { stiffness: Some(k), ..level(128, 0.0, 0.03) });
        assert_eq!(discretisation(&coarse, &fine, ELASTIC).stiffness, Some(FACTORS.stiffness * 0.25));
    }

    /// The iteration error of the coarser grid makes the change a bound. Very small contacts and mean gaps have no
    /// relative change.
    #[test]
    fn a_coarser_grid_with_an_iteration_error_gives_a_bound() {
        let error_estimates = ErrorEstimates { area: Some(0.04), mean_gap: Some(1e-9) };
        let coarse = GridResult { mean_gap: 1.1, error_estimates, ..level(64, 0.0, 0.0301) };
        let d = discretisation(&coarse, &level(128, 0.0, 0.03), ELASTIC);
        assert!(d.area_is_bound && !d.mean_gap_is_bound && d.coarser == [64, 64], "{d:?}");
        let area = FACTORS.area * (0.0001 + 0.04 * 0.0301) / 0.03;
        assert!(d.area.is_some_and(|a| (a - area).abs() < 1e-12), "{d:?}");
        assert!(d.mean_gap.is_some_and(|g| (g - 0.1 - FACTORS.gap_by_area * area).abs() < 1e-12), "{d:?}");
        let touching = discretisation(&level(64, 0.0, 9e-4), &level(128, 0.0, 1e-4), ELASTIC);
        assert_eq!((touching.area, touching.area_is_bound), (None, false));
        let closed = GridResult { mean_gap: 1e-9, ..level(128, 0.0, 1.0) };
        assert_eq!(discretisation(&coarse, &closed, ELASTIC).mean_gap, None);
    }
}
