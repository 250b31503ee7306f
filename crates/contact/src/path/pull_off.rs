use crate::method::{Equilibrium, Load, ProblemScale, ReducedProblem, SnapshotRef, SolverRun, Stop};
use crate::results::PullOff;
use asperity_grid::sys::ranks::ALONE;
use asperity_grid::{Error, Result};
use asperity_grid::{Field, Grid};
use serde_json::Value;

/// Step of the mean gap during separation: the first, over the larger of mean gap and range, and the growth factor.
const FIRST_STEP: f64 = 0.02;
const GROWTH: f64 = 1.2;
/// Growth factor of steps that were shortened, up to the longest step.
const RECOVERY: f64 = 2.0;
/// Reduction of the first step if the tension decreases from the start, and smallest first step over the mean gap.
const SHORTER: f64 = 0.2;
const SHORTEST_STEP: f64 = 1e-5;
/// Largest number of equilibria of the scan.
const MOST_STEPS: usize = 400;

/// Loss of tension against the linear continuation of the last step, over the largest tension, at which a step is
/// repeated with half its length: a sharp maximum may lie within it.
const LOST: f64 = 0.02;

/// Growth of the tension within a step, over the largest tension, at and below which it is not shortened: the error of
/// a maximum at which the surfaces jump.
const RESOLVED: f64 = 1e-3;

/// The separation ends when there is no contact and the tension has fallen to this fraction of the maximum.
const PASSED: f64 = 0.3;

/// Golden-section steps within the bracket of the maximum tension. They reduce the bracket to a hundredth of its width.
const SECTIONS: usize = 10;
const GOLDEN: f64 = 0.618_033_988_749_895;

/// Largest number of f64 fields in memory during a search: the initial state, the current one, the previous one and the
/// one before the maximum tension.
pub(super) const FIELDS: u64 = 4;

/// A state of the separation curve.
#[derive(Clone, Copy)]
struct SeparationPoint {
    mean_gap: f64,
    pressure: f64,
}

/// Initial state of a separation.
pub(super) struct SeparationStart {
    pub mean_gap: f64,
    pub pressure: f64,
    pub gap: Vec<f64>,
}

impl SeparationStart {
    pub(super) fn of(state: &Equilibrium) -> Self {
        SeparationStart { mean_gap: state.mean_gap, pressure: state.pressure, gap: state.gap.to_vec() }
    }

    /// For a checkpoint before the search.
    pub(super) fn snapshot(&self, grid: Grid) -> SnapshotRef<'_> {
        let gap = Field::F64(&self.gap);
        // A separation with a hardness, or on several ranks, is refused.
        SnapshotRef { grid, ranks: &ALONE, gap, auxiliary: None, plastic: None, progress: Value::Null }
    }
}

/// Separates the surfaces from the current state of `run` and finds the maximum tension. The mean gap is imposed: then
/// states that are unstable under an imposed pressure also have an equilibrium. `scale` is the unit of the problem, for
/// messages.
///
/// Steps adapt to the curve, so that none passes over a maximum of the tension: a step within which tension is lost is
/// halved until the tension could only have grown by [`RESOLVED`] of the largest. Every maximum that may be the largest
/// is then bracketed by golden sections.
pub(super) fn search(
    run: &mut dyn SolverRun,
    problem: &ReducedProblem,
    scale: ProblemScale,
    from: SeparationStart,
) -> Result<PullOff> {
    let SeparationStart { mean_gap, pressure, gap } = from;
    let range = problem.adhesion.range();
    if range == 0.0 {
        return Err(Error::input("pull-off", "adhesion", "none", "an adhesion, without which there is no tension"));
    }
    let mut search = Search {
        run,
        problem,
        scale,
        step: FIRST_STEP * mean_gap.max(range),
        longest: 0.0,
        curve: vec![SeparationPoint { mean_gap, pressure }],
        best: None,
        lowest: pressure,
        before: Vec::new(),
        last: gap,
    };
    search.first_step()?;
    for _ in 0..MOST_STEPS {
        if search.advance()? {
            return search.result(pressure);
        }
    }
    let reached = search.curve[search.curve.len() - 1].mean_gap;
    let [pull, mean_gap] = [-search.lowest, reached].map(|v| scale.multiply(v));
    let found = format!("still a pull of {pull:.3e} E* at a mean gap of {mean_gap:.3e} L");
    Err(Error::input("pull-off", "search", found, "an adhesion that ends"))
}

/// A maximum of the tension with its errors.
#[derive(Clone, Copy)]
struct Maximum {
    point: SeparationPoint,
    pressure_error: f64,
    mean_gap_error: f64,
}

/// Scan of the separation curve.
struct Search<'a, 'p> {
    run: &'a mut dyn SolverRun,
    problem: &'a ReducedProblem<'p>,
    scale: ProblemScale,
    step: f64,
    /// Longest step so far.
    longest: f64,
    /// Equilibria of the scan in order; those of the sections follow in `result`.
    curve: Vec<SeparationPoint>,
    /// The largest bracketed maximum.
    best: Option<Maximum>,
    /// Lowest pressure so far.
    lowest: f64,
    /// Gaps of the last equilibrium but one and of the last. Sections start from the former, because a branch that the
    /// surfaces have left is not reached again by a smaller separation.
    before: Vec<f64>,
    last: Vec<f64>,
}

impl Search<'_, '_> {
    /// The first step, shortened while the tension decreases within it: for an initial load close to the maximum
    /// tension it may be too long.
    fn first_step(&mut self) -> Result<()> {
        let SeparationPoint { mean_gap, pressure } = self.curve[0];
        loop {
            let (point, gap) = equilibrium(self.run, (self.problem, self.scale), mean_gap + self.step, None)?;
            if point.pressure < pressure || self.step <= SHORTEST_STEP * mean_gap {
                self.accept(point, gap);
                return Ok(());
            }
            self.step *= SHORTER;
            self.run.set_gap(&self.last);
        }
    }

    fn accept(&mut self, point: SeparationPoint, gap: Vec<f64>) {
        self.lowest = self.lowest.min(point.pressure);
        self.curve.push(point);
        self.before = std::mem::replace(&mut self.last, gap);
    }

    /// One step of the scan, or a shorter second attempt at it. True when the surfaces have separated.
    fn advance(&mut self) -> Result<bool> {
        let [.., earlier, now] = self.curve[..] else { return Ok(false) };
        let slope = (now.pressure - earlier.pressure) / (now.mean_gap - earlier.mean_gap);
        let (next, gap) = equilibrium(self.run, (self.problem, self.scale), now.mean_gap + self.step, None)?;
        let growth = -(slope * self.step).min(0.0);
        let lost = next.pressure - now.pressure + growth.min(-self.lowest);
        // Where asperities detach at a tension below the largest, no maximum is missed.
        let largest = growth - now.pressure >= (1.0 - LOST) * -self.lowest;
        if largest && growth > RESOLVED * -self.lowest && lost > LOST * -self.lowest {
            self.step *= 0.5;
            self.run.set_gap(&self.last);
            return Ok(false);
        }
        let passed = now.pressure < earlier.pressure && next.pressure >= now.pressure;
        if passed && -now.pressure >= (1.0 - LOST) * -self.lowest {
            let end = next.mean_gap;
            let bracketed = self.bracketed([earlier, now], end)?;
            if self.best.is_none_or(|best| bracketed.point.pressure < best.point.pressure) {
                self.best = Some(bracketed);
            }
            self.lowest = self.lowest.min(bracketed.point.pressure);
            self.run.set_gap(&gap);
        }
        // A rough surface separates asperity by asperity, and the last one may have the maximum tension. The scan
        // therefore ends only without contact and at a small tension.
        let separated = gap.iter().all(|g| *g > 0.0) && -next.pressure < PASSED * -self.lowest;
        self.accept(next, gap);
        self.longest = self.longest.max(self.step);
        // Steps recover fast after a jump: rough surfaces have many.
        self.step *= if self.step < self.longest { RECOVERY } else { GROWTH };
        Ok(separated && self.curve.len() > 2)
    }

    /// The maximum between `earlier` and the mean gap `high` by golden sections.
    fn bracketed(&mut self, [earlier, now]: [SeparationPoint; 2], mut high: f64) -> Result<Maximum> {
        let (mut low, mut best) = (earlier.mean_gap, now);
        let slope = (earlier.pressure - now.pressure) / (now.mean_gap - earlier.mean_gap);
        let mut probe = |mean_gap: f64| -> Result<SeparationPoint> {
            let (point, _) = equilibrium(self.run, (self.problem, self.scale), mean_gap, Some(&self.before))?;
            if point.pressure < best.pressure {
                best = point;
            }
            Ok(point)
        };
        let mut left = probe(high - GOLDEN * (high - low))?;
        let mut right = probe(low + GOLDEN * (high - low))?;
        for _ in 0..SECTIONS {
            if left.pressure < right.pressure {
                (high, right) = (right.mean_gap, left);
                left = probe(high - GOLDEN * (high - low))?;
            } else {
                (low, left) = (left.mean_gap, right);
                right = probe(low + GOLDEN * (high - low))?;
            }
        }
        let mean_gap_error = (high - best.mean_gap).max(best.mean_gap - low);
        // At a jump the tension grows up to it at the slope before it, and the ends of the bracket are on two branches.
        let (growth, spread) = (slope * mean_gap_error, left.pressure.max(right.pressure) - best.pressure);
        Ok(Maximum { point: best, pressure_error: growth + spread.min(growth), mean_gap_error })
    }

    /// # Errors
    /// `Input` if the tension falls from the initial pressure on.
    fn result(mut self, initial: f64) -> Result<PullOff> {
        let Some(Maximum { point: best, pressure_error, mean_gap_error }) =
            self.best.filter(|b| b.point.pressure < initial)
        else {
            let found = format!("a pull of {:.3e} E*, from which on it falls", -self.scale.multiply(initial));
            return Err(Error::input("pull-off", "last load", found, "a load before the largest tension"));
        };
        self.curve.push(best);
        self.curve.sort_by(|a, b| a.mean_gap.total_cmp(&b.mean_gap));
        // The maximum may be an equilibrium of the scan.
        self.curve.dedup_by(|a, b| a.mean_gap == b.mean_gap);
        Ok(PullOff {
            pressure: best.pressure,
            mean_gap: best.mean_gap,
            mean_gap_error: Some(mean_gap_error),
            pressure_error: Some(pressure_error),
            coarser: None,
            curve: self.curve.iter().map(|p| [p.mean_gap, p.pressure]).collect(),
        })
    }
}

/// Changes from the coarser grid that are the error of a pull-off, in addition to its bracket.
const CHANGES: f64 = 3.0;

/// `pull_off` with the errors of its bracket and of the change from the coarser grid.
pub(super) fn compared(pull_off: PullOff, grid: Grid, coarse: PullOff) -> PullOff {
    let change = (pull_off.pressure - coarse.pressure).abs();
    PullOff {
        pressure_error: pull_off.pressure_error.map(|e| e + CHANGES * change),
        mean_gap_error: pull_off.mean_gap_error.map(|e| e + CHANGES * (pull_off.mean_gap - coarse.mean_gap).abs()),
        coarser: Some([grid.nx, grid.ny]),
        ..pull_off
    }
}

/// The state at a mean gap and its gap field, from the gap `start` if given.
fn equilibrium(
    run: &mut dyn SolverRun,
    (problem, scale): (&ReducedProblem, ProblemScale),
    mean_gap: f64,
    start: Option<&[f64]>,
) -> Result<(SeparationPoint, Vec<f64>)> {
    if let Some(gap) = start {
        run.set_gap(gap);
    }
    let state = run.equilibrate(Load::MeanGap(mean_gap))?;
    match state.stop {
        Stop::Converged => Ok((SeparationPoint { mean_gap, pressure: state.pressure }, state.gap.to_vec())),
        Stop::Interrupted => Err(Error::Interrupted),
        stop => Err(unconverged(problem, scale, &state, stop)),
    }
}

pub(super) fn unconverged(problem: &ReducedProblem, scale: ProblemScale, state: &Equilibrium, stop: Stop) -> Error {
    let reason = format!("{stop}, while separating at a mean gap of {:.6e} L", scale.multiply(state.mean_gap));
    state.not_converged("fast", reason, problem.tolerance, None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interface::AttractionLaw;
    use crate::method::{ErrorEstimates, Heights};
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

    impl SolverRun for SawtoothCurve {
        fn equilibrate(&mut self, load: Load) -> Result<Equilibrium<'_>> {
            let Load::MeanGap(mean_gap) = load else { panic!("a mean gap is imposed") };
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
                stiffness: None,
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
    fn every_sharp_maximum_is_bracketed() {
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
                let (pressure, gap) = (-curve.tension(0.02), vec![0.0]);
                let from = SeparationStart { mean_gap: 0.02, pressure, gap };
                let actual = search(&mut curve, &problem, ProblemScale::of(&problem.heights), from).expect("a maximum");
                let miss = [actual.pressure + expected.1, actual.mean_gap - expected.0].map(f64::abs);
                let [pressure_error, mean_gap_error] =
                    [actual.pressure_error, actual.mean_gap_error].map(|e| e.expect("of the bracket"));
                assert!(miss[0] <= pressure_error + 1e-15, "{k}: {miss:?} {actual:?}");
                assert!(miss[1] <= mean_gap_error + 1e-15, "{k}: {miss:?} {actual:?}");
                assert!(pressure_error < 2e-3 * expected.1, "{k}: {pressure_error}");
            }
        }
    }
}
