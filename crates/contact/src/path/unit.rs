//! Load paths in the unit of the surface's heights ([`ProblemScale`]).

use super::{InitialState, LoadPathSolver, Reached};
use crate::method::{CoarseState, Iteration, Load, Observer, ProblemScale, SeparationStep, SnapshotRef, Stop};
use crate::results::PullOff;
use crate::state::Extrapolated;
use crate::uncertainty::ValueWithError;
use asperity_grid::Field;
use asperity_grid::{Error, Result};
use std::ops::ControlFlow;

impl LoadPathSolver<'_> {
    /// Solves the loads in order and passes each state to `visit`. The path ends at the first load that does not
    /// converge. If `pulls_off`, the surfaces are then separated to find the pull-off pressure.
    ///
    /// Heights far from ordinary size are solved in a unit of theirs, so that results depend on pressure over
    /// gradient alone.
    ///
    /// # Errors
    /// Loads that the method does not support, that are not representable over the heights or below
    /// [`least_pressure`](crate::method::ReducedProblem::least_pressure), and the errors of `visit`.
    pub fn walk(
        &self,
        begin: Option<InitialState>,
        pulls_off: bool,
        observer: &dyn Observer,
        mut visit: impl FnMut(usize, Reached) -> Result<()>,
    ) -> Result<Option<PullOff>> {
        let grid = self.problem.grid;
        let mut visit = |i: usize, reached: Reached| {
            observer.load_ended();
            if reached.state.stop == Stop::Interrupted {
                observer.interrupted(grid, &reached.state);
                return Err(Error::Interrupted);
            }
            visit(i, reached)
        };
        let scale = ProblemScale::of(&self.problem.heights);
        let loads = scale.loads(&self.problem, self.loads)?;
        self.check_rounding()?;
        if scale.is_one() {
            return self.walk_in_unit(scale, begin, pulls_off, observer, visit);
        }
        let heights = scale.heights(&self.problem.heights);
        let path = LoadPathSolver {
            problem: scale.problem(&self.problem, &heights),
            requested: scale.adhesion(self.requested),
            method: self.method,
            range: self.range,
            threshold: scale.divide(self.threshold),
            loads: &loads,
            with_error: self.with_error,
            leakage: self.leakage,
            maps: self.maps,
        };
        let begin = begin.map(|begin| match begin {
            InitialState::Gap(gap) => InitialState::Gap(scale.gap(&gap).into_owned()),
            // Converted where it is read.
            checkpoint => checkpoint,
        });
        let inside = InUnit { observer, scale };
        let pulled = path.walk_in_unit(scale, begin, pulls_off, &inside, |i, reached| {
            let fields = [scale.field(reached.state.gap), scale.field(reached.state.stress)];
            let plastic = reached.state.plastic.map(|field| scale.field(field));
            let fields = ([&fields[0][..], &fields[1]], plastic.as_deref());
            let state = scale.state(&reached.state, self.loads[i], fields);
            let extrapolated = reached.extrapolated.map(|e| extrapolated(scale, e));
            let displacement = scale.multiply(reached.displacement);
            let coarser_gaps =
                reached.coarser_gaps.map(|(gaps, fraction)| (gaps.map(|gap| scale.multiply(gap)), fraction));
            visit(i, Reached { state, extrapolated, displacement, coarser_gaps, ..reached })
        })?;
        Ok(pulled.map(|separation| pull_off(scale, separation)))
    }
}

impl LoadPathSolver<'_> {
    /// # Errors
    /// `Input` for a pressure above zero that rounding of the heights exceeds.
    fn check_rounding(&self) -> Result<()> {
        let smallest = self.problem.least_pressure(self.problem.heights.rms());
        let below = |load: &&Load| matches!(load, Load::Pressure(p) if *p > 0.0 && *p < smallest);
        let Some(Load::Pressure(pressure)) = self.loads.iter().find(below) else { return Ok(()) };
        let accepted = match smallest.is_finite() {
            true => format!(
                "at least {smallest:.1e} E*: rounding of the heights hides smaller stresses; check the units of load and modulus"
            ),
            false => "none, since the stress of the shortest wave is no finite number; check the units of heights, length and \
                      thickness"
                .into(),
        };
        Err(Error::input("problem", "pressure", format!("{pressure:e} E*"), accepted))
    }
}

fn extrapolated(scale: ProblemScale, extrapolated: Extrapolated) -> Extrapolated {
    let length = |v: ValueWithError| ValueWithError { value: scale.multiply(v.value), error: scale.multiply(v.error) };
    Extrapolated { mean_gap: extrapolated.mean_gap.map(length), ..extrapolated }
}

fn pull_off(scale: ProblemScale, pull_off: PullOff) -> PullOff {
    PullOff {
        pressure: scale.multiply(pull_off.pressure),
        pressure_error: pull_off.pressure_error.map(|e| scale.multiply(e)),
        mean_gap: scale.multiply(pull_off.mean_gap),
        mean_gap_error: pull_off.mean_gap_error.map(|e| scale.multiply(e)),
        curve: pull_off.curve.into_iter().map(|point| point.map(|v| scale.multiply(v))).collect(),
        ..pull_off
    }
}

/// Passes the events of a solve in this unit on to an observer of the problem.
struct InUnit<'a> {
    observer: &'a dyn Observer,
    scale: ProblemScale,
}

impl Observer for InUnit<'_> {
    fn iteration(&self, step: Iteration) -> ControlFlow<()> {
        self.observer.iteration(step)
    }

    fn stop_requested(&self) -> bool {
        self.observer.stop_requested()
    }

    fn separated(&self, step: SeparationStep) {
        self.observer.separated(step);
    }

    fn coarse_grid_done(&self, state: CoarseState) {
        let CoarseState { gap, pressure, mean_gap, energy, range, .. } = state;
        let gap = self.scale.field(gap);
        self.observer.coarse_grid_done(CoarseState {
            gap: Field::F64(&gap),
            pressure: self.scale.multiply(pressure),
            mean_gap: self.scale.multiply(mean_gap),
            energy: self.scale.multiply(self.scale.multiply(energy)),
            range: self.scale.multiply(range),
            ..state
        });
    }

    fn snapshot_due(&self) -> bool {
        self.observer.snapshot_due()
    }

    /// A gap without the state of a solver has the unit of the problem. With it, it stays as it is: small velocities
    /// would lose digits.
    fn snapshot(&self, snapshot: SnapshotRef) {
        if !snapshot.progress.is_null() {
            return self.observer.snapshot(snapshot);
        }
        let gap = self.scale.field(snapshot.gap);
        let plastic = snapshot.plastic.map(|field| self.scale.field(field));
        let plastic = plastic.as_deref().map(Field::F64);
        self.observer.snapshot(SnapshotRef { gap: Field::F64(&gap), plastic, ..snapshot });
    }
}
