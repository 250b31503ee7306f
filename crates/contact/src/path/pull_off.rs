use crate::interface::{Law, Wall};
use crate::method::{
    Equilibrium, Iteration, Machine, Observer, Precision, ProblemScale, ReducedProblem, SeparationStep, SnapshotRef,
    SolverRun, Stop, cannot_pull,
};
use crate::results::PullOff;
use asperity_grid::sys::ranks::ALONE;
use asperity_grid::{Error, Result};
use asperity_grid::{Field, Grid};
use serde_json::Value;
use std::ops::ControlFlow;
use std::rc::Rc;

/// Step of the grip during separation: the first, over the larger of mean gap and range, and the growth factor.
const FIRST_STEP: f64 = 0.02;
const GROWTH: f64 = 1.2;
/// Largest number of steps of the scan, which would reach 10¹⁵ times the first one, and of intervals that are halved.
const MOST_STEPS: usize = 200;
const MOST_HALVINGS: usize = 400;

/// Largest residuals of the states of the scan and of those that narrow its intervals: the largest tension of the scan of a rough 128² map
/// changes by 3e-4 between 1e-3 and 1e-4, the pull-off by 5e-5 between 1e-5 and 1e-8. At 1e-4 states close to full contact, with few open
/// nodes, pass for equilibria that are none.
const SCAN: f64 = 1e-3;
const NARROWED: f64 = 1e-6;

/// The search ends where no interval can hold a tension that is larger by this fraction.
const RESOLVED: f64 = 1e-3;

/// Loss of tension of the accurate state against that of the search, over it, above which the latter was no equilibrium.
const REFUTED: f64 = 1e-2;

/// States that the progress expects: rough maps of 64² to 512² took 24 to 73. And its last estimate.
const EXPECTED_STATES: f64 = 45.0;
const LAST_PROGRESS: f64 = 0.99;

/// The separation ends when there is no contact and the tension has fallen to this fraction of the maximum.
const PASSED: f64 = 0.3;

/// Intervals that are kept for later: with more the newest are halved first, which on 16 maps left 10 at most.
const MOST_OPEN: usize = 6;
const PLANNED_OPEN: u64 = 10;

/// Number of f64 fields in memory that a search is planned with: the initial state, the last one of the scan, that of the largest tension,
/// the one from which an interval is halved, the new one, and those of open intervals.
pub(super) const FIELDS: u64 = 5 + PLANNED_OPEN;

/// A state of the separation curve.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SeparationPoint {
    /// Displacement of the grip, L.
    grip: f64,
    mean_gap: f64,
    pressure: f64,
    /// Growth of the tension with the grip at constant contact; where the state is stable only in the machine, on the way to it, or none.
    rise: f64,
}

impl SeparationPoint {
    fn tension(&self) -> f64 {
        -self.pressure
    }
}

/// A state with its gap, from which the surfaces are pulled further.
#[derive(Clone)]
struct Pulled {
    point: SeparationPoint,
    gap: Rc<Vec<f64>>,
}

/// Part of the curve between two states.
struct Interval {
    from: Pulled,
    to: SeparationPoint,
}

impl Interval {
    /// Largest tension that it may hold, at a jump near its end. Contacts that have opened carry no more, so that the tension grows no
    /// faster than at the beginning; or, where a contact that is about to open softens the others, than at the end.
    fn bound(&self) -> f64 {
        let (from, to) = (&self.from.point, &self.to);
        from.tension() + from.rise.max(to.rise) * (to.grip - from.grip)
    }
}

/// Initial state of a separation.
pub(super) struct SeparationStart {
    pub mean_gap: f64,
    pub pressure: f64,
    separation: f64,
    /// Contact stiffness, if known.
    stiffness: Option<f64>,
    pub gap: Rc<Vec<f64>>,
    /// Lowest contact stress of surfaces that are closed everywhere: the first node opens when the pressure falls by it.
    opens: Option<f64>,
}

impl SeparationStart {
    pub(super) fn of(state: &Equilibrium, problem: &ReducedProblem) -> Self {
        // Around a non-periodic body the free surface moves, too.
        let closed = problem.kernel.is_periodic() && problem.wall == Wall::Hard && state.mean_gap == 0.0;
        let lowest = || (0..state.stress.len()).map(|i| state.stress.at(i)).fold(f64::INFINITY, f64::min);
        let opens = closed.then(|| lowest() + problem.adhesion.traction(0.0));
        let &Equilibrium { mean_gap, pressure, separation, stiffness, .. } = state;
        SeparationStart { mean_gap, pressure, separation, stiffness, gap: Rc::new(state.gap.to_vec()), opens }
    }

    /// For a checkpoint before the search.
    pub(super) fn snapshot(&self, grid: Grid) -> SnapshotRef<'_> {
        let gap = Field::F64(&self.gap);
        // A separation with a hardness, or on several ranks, is refused.
        SnapshotRef { grid, ranks: &ALONE, gap, auxiliary: None, plastic: None, progress: Value::Null }
    }
}

/// Separates the surfaces from the current state of `run` and finds the largest tension. They are pulled by a machine that is much
/// stiffer than the contact: then states that are unstable under an imposed pressure have an equilibrium, too. `scale` is the unit of
/// the problem, for messages.
///
/// A scan with growing steps leads to separation. Each of its intervals has a bound of the tension, from the contact stiffness at its
/// beginning; those that may hold the largest one are halved, highest bound first, each from the state at its beginning, until none is left
/// (branch and bound). Surfaces may jump within an interval.
pub(super) fn search(
    run: &mut dyn SolverRun,
    problem: &ReducedProblem,
    (scale, observer): (ProblemScale, &dyn Observer),
    from: SeparationStart,
) -> Result<PullOff> {
    let range = problem.adhesion.range();
    if range == 0.0 {
        return Err(Error::input("pull-off", "adhesion", "none", "an adhesion, without which there is no tension"));
    }
    let Some(machine) = run.machine() else {
        return Err(cannot_pull());
    };
    let accurate = match problem.precision {
        Precision::F32 => problem.tolerance,
        Precision::F64 => problem.tolerance.min(NARROWED),
    };
    let loose = [SCAN, NARROWED].map(|tolerance| tolerance.max(accurate));
    let mut search = Search::begin(run, (scale, observer), (machine, range), &from, loose);
    search.cover()?;
    if loose != [accurate; 2] {
        let found = search.best.clone();
        search.best = search.pulled(&found, 0.0, accurate)?;
        if search.best.point.tension() < (1.0 - REFUTED) * found.point.tension() {
            // Beyond a jump, to which looser solves came close.
            search = Search::begin(search.run, (scale, observer), (machine, range), &from, [accurate; 2]);
            search.cover()?;
        }
    }
    search.result()
}

/// Scan of the separation curve.
struct Search<'a> {
    run: &'a mut dyn SolverRun,
    scale: ProblemScale,
    observer: &'a dyn Observer,
    machine: Machine,
    opens: Option<f64>,
    /// Largest residuals of states of the scan and of those that narrow its intervals.
    tolerances: [f64; 2],
    step: f64,
    /// States so far.
    curve: Vec<SeparationPoint>,
    /// The state of the largest tension.
    best: Pulled,
    /// The last state of the scan.
    last: Pulled,
    /// Gap of the last state of the solver.
    at: Rc<Vec<f64>>,
    /// Intervals that may hold a larger tension, and how many were halved.
    open: Vec<Interval>,
    halved: usize,
    /// Largest bound of the intervals that were discarded.
    bound: f64,
}

impl<'a> Search<'a> {
    fn begin(
        run: &'a mut dyn SolverRun,
        (scale, observer): (ProblemScale, &'a dyn Observer),
        (machine, range): (Machine, f64),
        start: &SeparationStart,
        tolerances: [f64; 2],
    ) -> Self {
        let SeparationStart { mean_gap, pressure, separation, stiffness, ref gap, opens } = *start;
        let unknown = if mean_gap == 0.0 { machine.stiffness } else { 0.0 };
        let rise = stiffness.map_or(unknown, |contact| machine.rise(contact));
        let point = SeparationPoint { grip: machine.grip(separation, pressure), mean_gap, pressure, rise };
        let start = Pulled { point, gap: gap.clone() };
        Search {
            run,
            scale,
            observer,
            machine,
            opens,
            tolerances,
            step: FIRST_STEP * mean_gap.max(range),
            curve: vec![point],
            at: start.gap.clone(),
            best: start.clone(),
            last: start,
            open: Vec::new(),
            halved: 0,
            bound: point.tension(),
        }
    }

    /// Separates the surfaces and narrows the intervals that may hold the largest tension.
    fn cover(&mut self) -> Result<()> {
        // Until the first node opens, closed surfaces stay closed.
        if let Some(stress) = self.opens {
            let pressure = self.last.point.pressure - stress;
            let (grip, rise) = (self.machine.grip(0.0, pressure), self.machine.stiffness);
            let point = SeparationPoint { grip, mean_gap: 0.0, pressure, rise };
            self.curve.push(point);
            self.accept(Pulled { point, ..self.last.clone() })?;
        } else if self.last.point.rise == 0.0 {
            // The contact stiffness was not requested, or there is none.
            let start = self.last.clone();
            self.last = self.pulled(&start, 0.0, self.tolerances[1])?;
        }
        for _ in 0..MOST_STEPS {
            if !self.advance()? {
                continue;
            }
            while !self.open.is_empty() {
                self.narrow()?;
            }
            return Ok(());
        }
        let [pull, mean_gap] = [self.best.point.tension(), self.last.point.mean_gap].map(|v| self.scale.multiply(v));
        let found = format!("still a pull of {pull:.3e} E* at a mean gap of {mean_gap:.3e} L");
        Err(Error::input("pull-off", "search", found, "an adhesion that ends"))
    }

    /// The state at which the grip is further away by `step`.
    fn pulled(&mut self, from: &Pulled, step: f64, tolerance: f64) -> Result<Pulled> {
        if !Rc::ptr_eq(&self.at, &from.gap) {
            self.run.set_gap(&from.gap);
        }
        let state = self.run.pull(from.point.grip + step, tolerance)?;
        match state.stop {
            Stop::Converged => {
                let (grip, gap) = (from.point.grip + step, Rc::new(state.gap.to_vec()));
                let grown = if step > 0.0 { (from.point.pressure - state.pressure) / step } else { 0.0 };
                let rise = state.stiffness.map_or(grown.max(0.0), |contact| self.machine.rise(contact));
                let point = SeparationPoint { grip, mean_gap: state.mean_gap, pressure: state.pressure, rise };
                self.at = gap.clone();
                self.curve.push(point);
                self.report(point);
                Ok(Pulled { point, gap })
            }
            Stop::Interrupted => Err(Error::Interrupted),
            stop => Err(unconverged(tolerance, self.scale, &state, stop)),
        }
    }

    fn report(&self, point: SeparationPoint) {
        let (states, largest) = (self.curve.len(), self.best.point.tension().max(point.tension()));
        let tension = if largest > 0.0 { point.tension() / largest } else { 0.0 };
        let progress = (states as f64 / EXPECTED_STATES).min(LAST_PROGRESS);
        self.observer.separated(SeparationStep { states, tension, progress });
    }

    /// Continues the scan from its next state.
    fn accept(&mut self, next: Pulled) -> Result<()> {
        let from = std::mem::replace(&mut self.last, next.clone());
        self.note(&next);
        self.bounded(Interval { from, to: next.point });
        while self.open.len() > MOST_OPEN {
            self.narrow()?;
        }
        Ok(())
    }

    fn note(&mut self, state: &Pulled) {
        if state.point.tension() > self.best.point.tension() {
            self.best = state.clone();
            let all = std::mem::take(&mut self.open);
            all.into_iter().for_each(|interval| self.bounded(interval));
        }
    }

    /// Keeps an interval if it may hold a larger tension.
    fn bounded(&mut self, interval: Interval) {
        let (bound, best) = (interval.bound(), self.best.point.tension());
        // Before the first tension none is missed in compression.
        if bound <= (best + RESOLVED * best.abs()).max(0.0) {
            self.leave(&interval);
        } else {
            self.open.push(interval);
        }
    }

    /// Halves the open interval with the highest bound; of many the newest, whose halves are the first to be discarded.
    fn narrow(&mut self) -> Result<()> {
        let all = 0..self.open.len();
        let chosen = match self.open.len() <= MOST_OPEN {
            true => all.max_by(|&i, &j| self.open[i].bound().total_cmp(&self.open[j].bound())),
            false => all.last(),
        };
        let Some(chosen) = chosen else { return Ok(()) };
        let interval = self.open.remove(chosen);
        if self.halved == MOST_HALVINGS {
            self.leave(&interval);
            return Ok(());
        }
        self.halved += 1;
        let Interval { from, to } = interval;
        let middle = self.pulled(&from, 0.5 * (to.grip - from.point.grip), self.tolerances[1])?;
        self.note(&middle);
        self.bounded(Interval { from, to: middle.point });
        self.bounded(Interval { from: middle, to });
        Ok(())
    }

    /// Leaves an interval as it is: its bound is part of the error.
    fn leave(&mut self, interval: &Interval) {
        self.bound = self.bound.max(interval.bound());
    }

    /// One step of the scan. True when the surfaces have separated.
    fn advance(&mut self) -> Result<bool> {
        let from = self.last.clone();
        let next = self.pulled(&from, self.step, self.tolerances[0])?;
        // A rough surface separates asperity by asperity, and the last one may have the largest tension. The scan
        // therefore ends only without contact and at a small tension.
        let parted = next.gap.iter().all(|g| *g > 0.0);
        self.accept(next)?;
        self.step *= GROWTH;
        Ok(parted && self.last.point.tension() < PASSED * self.best.point.tension() && self.curve.len() > 3)
    }

    /// # Errors
    /// `Input` if the tension falls from the initial pressure on.
    fn result(mut self) -> Result<PullOff> {
        let (best, initial) = (self.best.point, self.curve[0]);
        if best.grip <= initial.grip {
            let found = format!("a pull of {:.3e} E*, from which on it falls", self.scale.multiply(initial.tension()));
            return Err(Error::input("pull-off", "last load", found, "a load before the largest tension"));
        }
        // Without less accurate states of a larger tension; of several states at one mean gap the last.
        self.curve.retain(|point| point.tension() <= best.tension() && point.mean_gap != best.mean_gap);
        self.curve.reverse();
        self.curve.sort_by(|a, b| a.mean_gap.total_cmp(&b.mean_gap));
        self.curve.dedup_by(|a, b| a.mean_gap == b.mean_gap);
        let at = self.curve.partition_point(|point| point.mean_gap < best.mean_gap);
        let width = |other: Option<&SeparationPoint>| other.map_or(0.0, |p| (p.mean_gap - best.mean_gap).abs());
        let left = at.checked_sub(1).and_then(|i| self.curve.get(i));
        let mean_gap_error = width(left).max(width(self.curve.get(at)));
        self.curve.insert(at, best);
        Ok(PullOff {
            pressure: best.pressure,
            force: None,
            mean_gap: best.mean_gap,
            mean_gap_error: Some(mean_gap_error),
            pressure_error: Some((self.bound - best.tension()).max(0.0)),
            coarser: None,
            curve: self.curve.iter().map(|p| [p.mean_gap, p.pressure]).collect(),
        })
    }
}

/// Share of the search on the problem's own grid in the time of both.
pub(super) const FINE_SHARE: f64 = 0.8;

/// Passes on the progress of a search that is a part of two.
pub(super) struct PartOfSearch<'a> {
    pub observer: &'a dyn Observer,
    pub share: [f64; 2],
}

impl Observer for PartOfSearch<'_> {
    fn iteration(&self, step: Iteration) -> ControlFlow<()> {
        self.observer.iteration(step)
    }

    fn separated(&self, step: SeparationStep) {
        let [from, to] = self.share;
        self.observer.separated(SeparationStep { progress: from + (to - from) * step.progress, ..step });
    }
}

/// Changes from the coarser grid that are the error of a pull-off, in addition to what its search leaves.
const CHANGES: f64 = 3.0;

/// `pull_off` with the errors of its search and of the change from the coarser grid.
pub(super) fn compared(pull_off: PullOff, grid: Grid, coarse: PullOff) -> PullOff {
    let change = (pull_off.pressure - coarse.pressure).abs();
    PullOff {
        pressure_error: pull_off.pressure_error.map(|e| e + CHANGES * change),
        mean_gap_error: pull_off.mean_gap_error.map(|e| e + CHANGES * (pull_off.mean_gap - coarse.mean_gap).abs()),
        coarser: Some([grid.nx, grid.ny]),
        ..pull_off
    }
}

/// The error of a state of the search, or before it, that did not meet its tolerance.
pub(super) fn unconverged(tolerance: f64, scale: ProblemScale, state: &Equilibrium, stop: Stop) -> Error {
    let reason = format!("{stop}, while separating at a mean gap of {:.6e} L", scale.multiply(state.mean_gap));
    state.not_converged("fast", reason, tolerance, None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interface::AttractionLaw;
    use crate::method::{ErrorEstimates, Heights, Load, NoObserver};
    use asperity_grid::Field;

    /// A separation curve in place of a solver: tension rises to sharp maxima, at each of which an asperity detaches.
    struct SawtoothCurve {
        /// Mean gap and tension of the maxima, in order; the tension after each is `AFTER` of it.
        maxima: Vec<(f64, f64)>,
        gap: [f64; 1],
    }

    const AFTER: f64 = 0.6;

    impl SawtoothCurve {
        fn tension(&self, mean_gap: f64) -> f64 {
            let (mut from, mut low) = (0.0, 0.0);
            for &(at, largest) in &self.maxima {
                if mean_gap <= at {
                    return low + (largest - low) * (mean_gap - from) / (at - from);
                }
                (from, low) = (at, AFTER * largest);
            }
            low * (-(mean_gap - from) / 0.05).exp()
        }
    }

    impl SawtoothCurve {
        /// Growth of the tension up to the next maximum.
        fn slope(&self, mean_gap: f64) -> f64 {
            let (mut from, mut low) = (0.0, 0.0);
            for &(at, largest) in &self.maxima {
                if mean_gap <= at {
                    return (largest - low) / (at - from);
                }
                (from, low) = (at, AFTER * largest);
            }
            0.1 * low
        }
    }

    impl SolverRun for SawtoothCurve {
        fn machine(&self) -> Option<Machine> {
            Some(Machine { stiffness: 1e9, compliance: 1e-9 })
        }

        fn equilibrate(&mut self, _: Load) -> Result<Equilibrium<'_>> {
            panic!("a machine pulls")
        }

        fn pull(&mut self, grip: f64, _: f64) -> Result<Equilibrium<'_>> {
            // So stiff that the grip is where the surface is.
            let (mean_gap, load) = (grip, Load::MeanGap(grip));
            let pressure = -self.tension(mean_gap);
            self.gap = [if mean_gap > self.maxima[self.maxima.len() - 1].0 { mean_gap } else { 0.0 }];
            Ok(Equilibrium {
                ranks: &ALONE,
                plastic: None,
                plasticity: None,
                load,
                pressure,
                gap: Field::F64(&self.gap),
                stress: Field::F64(&[0.0]),
                mean_gap,
                separation: mean_gap,
                stiffness: Some(self.slope(mean_gap)),
                energy: 0.0,
                elastic_energy: 0.0,
                interaction_energy: 0.0,
                load_error: 0.0,
                residual: 0.0,
                complementarity: 0.0,
                error_estimates: ErrorEstimates::default(),
                stop: Stop::Converged,
                iterations: 1,
                fft_pairs: 1.0,
                seconds: 0.0,
            })
        }

        fn set_gap(&mut self, _: &[f64]) {}
    }

    /// The largest of two sharp maxima, wherever it lies between the steps, within the stated errors.
    #[test]
    fn every_sharp_maximum_is_found() {
        let heights = [0.0];
        let problem = ReducedProblem {
            adhesion: AttractionLaw::exponential(1e-4, 0.01),
            ..ReducedProblem::new(Grid::unit(1, 1), Heights::Nodes(&heights))
        };
        for k in 0..40 {
            let first = 0.05 + 0.0007 * f64::from(k);
            for (maxima, expected) in [
                (vec![(first, 0.003443), (first + 0.03, 0.0032)], (first, 0.003443)),
                (vec![(first, 0.0032), (first + 0.03, 0.003443)], (first + 0.03, 0.003443)),
            ] {
                let mut curve = SawtoothCurve { maxima, gap: [0.0] };
                let pressure = -curve.tension(0.02);
                let from = SeparationStart {
                    mean_gap: 0.02,
                    separation: 0.02,
                    pressure,
                    stiffness: Some(curve.slope(0.02)),
                    gap: Rc::new(vec![0.0]),
                    opens: None,
                };
                let actual = search(&mut curve, &problem, (ProblemScale::of(&problem.heights), &NoObserver), from)
                    .expect("a maximum");
                let miss = [actual.pressure + expected.1, actual.mean_gap - expected.0].map(f64::abs);
                let [pressure_error, mean_gap_error] =
                    [actual.pressure_error, actual.mean_gap_error].map(|e| e.expect("of the search"));
                assert!(miss[0] <= pressure_error + 1e-15, "{k}: {miss:?} {actual:?}");
                assert!(miss[1] <= mean_gap_error + 1e-15, "{k}: {miss:?} {actual:?}");
                assert!(pressure_error < 2e-3 * expected.1, "{k}: {pressure_error}");
            }
        }
    }
}
