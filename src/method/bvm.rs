//! Boundary-value method: the gap outside contact is the unknown, found by projected conjugate gradients without restart
//! (Bugnicourt, Sainsot, Dureisseix, Gauthier & Lubrecht, Tribology Letters 66 (2018) 29).
//!
//! One iteration is one and a half transform pairs: the curvature along the search direction is a sum over its spectrum
//! and needs no way back. Two guards are added to the published scheme for loads control with adhesion: negative
//! curvature and a rising energy are answered with gradient steps of safe length.

use super::operator::{Build, ConvergenceMonitor, Operator, Outcome, Residuals, curvature_of, dispatch, kkt};
use super::{
    Card, ContactMethod, Criterion, Heights, Kind, Load, Needs, Observer, Plan, Problem, Run, SolverSnapshot, Started,
    State, Stop,
};
use crate::Result;
use crate::grid::{Real, Transform};
use crate::interface::{Adhesion, Kernel, Law, Wall};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::time::Instant;

pub struct Bvm;

static CARD: Card = Card {
    id: "bvm",
    paper_name: "FFT-BVM",
    family: "boundary value",
    kind: Kind::Solver,
    needs: Needs::Heights,
    criterion: Criterion::ZeroGap,
    calibrated_on: None,
    summary: "gap outside contact as unknown, projected conjugate gradients",
    supports: super::card::fields,
    dois: &["10.1007/s11249-017-0980-z", "10.1007/s11249-017-0900-2"],
    papers: &[],
};

/// Quarterings of a step that raised the energy of a law that is not convex.
const RETREATS: usize = 8;

/// Gradient steps of safe length after a rise of the energy.
const SAFE_STEPS: usize = 4;

impl ContactMethod for Bvm {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn plan(&self, problem: &Problem) -> Plan {
        // Gap, residual and direction in working precision, the gap before a step with adhesion, heights where they must
        // be converted or made from a series, and one half spectrum.
        let fields = 3
            + u64::from(problem.adhesion != Adhesion::None || problem.wall != Wall::Hard)
            + u64::from(problem.precision == super::Precision::F32 || matches!(problem.heights, Heights::Series(_)));
        let spectrum = match problem.precision {
            super::Precision::F32 => Transform::<f32>::spectrum_bytes(problem.grid),
            super::Precision::F64 => Transform::<f64>::spectrum_bytes(problem.grid),
        };
        // 101 to 257 iterations were counted for 512² to 2048² at p* = 0.01.
        let iterations = (6.0 * (problem.grid.nx.max(problem.grid.ny) as f64).sqrt()) as usize + 50;
        Plan {
            bytes: fields * problem.grid.points() as u64 * problem.precision.bytes() + spectrum,
            iterations: iterations * super::adhesion_effort(problem),
            pairs_per_iteration: 1.5,
            seconds: 0.0,
        }
    }

    fn start<'p>(&self, problem: &'p Problem<'p>, observer: &'p dyn Observer) -> Result<Started<'p>> {
        problem.expect_periodic(CARD.id)?;
        Ok(Started::Solver(dispatch(problem, Start(problem, observer))))
    }
}

struct Start<'p>(&'p Problem<'p>, &'p dyn Observer);

impl<'p> Build<'p> for Start<'p> {
    type Built = Box<dyn Run + 'p>;

    fn build<T: Real, K: Kernel + 'p, L: Law + 'p>(self, kernel: K, law: L) -> Self::Built {
        let operator = Operator::<T, K, L>::new(self.0, kernel, law);
        let gap = operator.first_touch();
        let residual = vec![T::default(); gap.len()];
        let direction = vec![T::default(); gap.len()];
        Box::new(Solver { operator, observer: self.1, gap, previous: Vec::new(), residual, direction, paused: None })
    }
}

struct Solver<'p, T: Real, K, L> {
    operator: Operator<'p, T, K, L>,
    observer: &'p dyn Observer,
    gap: Vec<T>,
    /// Gap before a step, for laws whose energy is not convex; empty without one.
    previous: Vec<T>,
    /// KKT residual of the last evaluation; interfacial stress once a load is done.
    residual: Vec<T>,
    direction: Vec<T>,
    /// What gap and direction go on from.
    paused: Option<Pause>,
}

/// What the search knows beside gap and direction, at the beginning of an iteration.
#[derive(Clone, Serialize, Deserialize)]
struct Pause {
    iterations: usize,
    /// Share of the last direction in the next one.
    beta: f64,
    /// Gradient steps of safe length that are still to be taken.
    safe: usize,
    progress: ConvergenceMonitor,
}

impl<T: Real, K: Kernel, L: Law> Solver<'_, T, K, L> {
    /// Moves the gap by `step` along the direction, projects, and evaluates there. Returns the balance, `⟨r r⟩` and
    /// `⟨r r_old⟩`.
    fn advance(&mut self, step: f64) -> (Residuals, f64, f64) {
        let (nx, direction, step) = (self.operator.problem.grid.nx, &self.direction, T::of(step));
        let update = |y: usize, gap: &mut [T]| {
            for (g, &d) in gap.iter_mut().zip(&direction[y * nx..]) {
                *g += step * d;
                if L::HARD {
                    *g = g.max(T::zero());
                }
            }
        };
        let visit = |gap: &[T], t: &[T], residual: &mut [T]| {
            let mut sum = [0.0; 2];
            for ((r, &t), &g) in residual.iter_mut().zip(t).zip(gap) {
                let new = kkt::<L, T>(g, t);
                sum[0] += new.wide() * new.wide();
                sum[1] += new.wide() * r.wide();
                *r = new;
            }
            sum
        };
        let (residuals, [rr, rr_old]) = self.operator.evaluate(&mut self.gap, &mut self.residual, update, visit);
        let n = self.gap.len() as f64;
        (residuals, rr / n, rr_old / n)
    }

    /// New direction `-r + β d`, zero where the wall holds the gap closed. Returns `⟨r d⟩` and `⟨d H d⟩`.
    fn direct(&mut self, beta: f64) -> (f64, f64) {
        let nx = self.operator.problem.grid.nx;
        let (residual, gap, law, beta) = (&self.residual, &self.gap, self.operator.law, T::of(beta));
        let update = |y: usize, direction: &mut [T]| {
            let mut sum = [0.0; 2];
            for ((d, &r), &g) in direction.iter_mut().zip(&residual[y * nx..]).zip(&gap[y * nx..]) {
                let held = L::HARD && g <= T::zero() && r >= T::zero();
                *d = if held { T::zero() } else { -r + beta * *d };
                sum[0] += r.wide() * d.wide();
                if L::ACTIVE {
                    sum[1] += law.slope(g.wide()) * d.wide() * d.wide();
                }
            }
            sum
        };
        let (elastic, [rd, law_curvature]) = self.operator.curvature(&mut self.direction, update);
        let n = self.gap.len() as f64;
        (rd / n, curvature_of(elastic, law_curvature / n))
    }
}

impl<T: Real, K: Kernel, L: Law> Run for Solver<'_, T, K, L> {
    fn set_gap(&mut self, gap: &[f64]) {
        self.gap = gap.iter().map(|&g| T::of(g)).collect();
    }

    fn resume(&mut self, snapshot: SolverSnapshot) -> Result<()> {
        let (gap, direction, pause) = snapshot.restore_pair(self.operator.problem.grid, CARD.id)?;
        self.set_gap(&gap);
        self.direction = direction.into_iter().map(T::of).collect();
        self.paused = Some(pause);
        Ok(())
    }

    fn equilibrate(&mut self, load: Load) -> Result<State<'_>> {
        let clock = Instant::now();
        let pairs_before = self.operator.pairs;
        self.operator.set_load(load, CARD.id)?;
        let problem = self.operator.problem;
        let pressure = self.operator.pressure;
        let scale = Problem::stress_scale(pressure);
        let floor = problem.rounding_floor(self.operator.rms_height, pressure);
        let fresh = Pause { iterations: 0, beta: 0.0, safe: 0, progress: ConvergenceMonitor::new() };
        let Pause { mut iterations, mut beta, mut safe, mut progress } = self.paused.take().unwrap_or(fresh);
        let (mut residuals, ..) = self.advance(0.0);
        let (stop, error_estimates) = loop {
            // Before it hears of this iteration.
            let known = progress.mark();
            let error_estimates = progress.error_estimates(&residuals);
            if self.operator.converged(&residuals, &error_estimates) {
                break (Stop::Converged, error_estimates);
            }
            if iterations >= problem.max_iterations {
                break (Stop::IterationLimit, error_estimates);
            }
            let residual = residuals.residual / scale;
            if let Some(stop) = progress.stalled(residual, floor) {
                break (stop, error_estimates);
            }
            if residuals.separated(pressure, self.operator.law.range()) {
                break (Stop::Detached, error_estimates);
            }
            let pause = || Pause { iterations, beta, safe, progress: progress.at(&known) };
            if self.operator.checkpoint_or_interrupt(
                self.observer,
                (iterations, residual),
                (&self.gap, &self.direction),
                pause,
            ) {
                break (Stop::Interrupted, error_estimates);
            }
            let (mut rd, mut curvature) = self.direct(if safe > 0 { 0.0 } else { beta });
            if rd >= 0.0 {
                (rd, curvature) = self.direct(0.0);
            }
            let step = if safe > 0 || curvature <= 0.0 {
                // Negative curvature (adhesion) has no minimum along the line; the gradient step always descends.
                if curvature <= 0.0 && safe == 0 && beta != 0.0 {
                    (rd, _) = self.direct(0.0);
                }
                1.0 / self.operator.stiffest(&self.gap)
            } else {
                -rd / curvature
            };
            let energy = residuals.energy(pressure);
            // Rounding of an energy of order E*·h_rms² must not count as a rise.
            let noise = 64.0 * problem.precision.epsilon() * residuals.magnitude(pressure);
            let (mut retreated, mut exhausted, was_safe) = (false, false, safe > 0);
            if L::ACTIVE {
                self.previous.resize(self.gap.len(), T::zero());
                self.previous.par_iter_mut().zip(&self.gap).for_each(|(p, &g)| *p = g);
            }
            let (mut new, mut new_rr, mut rr_old) = self.advance(step);
            if L::ACTIVE {
                // The energy is not convex: a step that raises it may have jumped into another valley, where the search
                // would go on. It is taken back and shortened.
                let mut shorter = step;
                for retreat in 1..=RETREATS {
                    if new.energy(pressure) <= energy + noise {
                        break;
                    }
                    // The last resort is to stay, and to go on with gradient steps of safe length.
                    shorter = if retreat == RETREATS { 0.0 } else { 0.25 * shorter };
                    self.gap.copy_from_slice(&self.previous);
                    (new, new_rr, rr_old) = self.advance(shorter);
                    retreated = true;
                    exhausted = shorter == 0.0;
                }
            }
            // After a retreat the residual before this step is no longer known.
            beta = if rd < 0.0 && !retreated { ((new_rr - rr_old) / -rd).max(0.0) } else { 0.0 };
            // Rounding of an energy of order E*·h_rms² must not count as a rise.
            let noise = 64.0 * problem.precision.epsilon() * residuals.magnitude(pressure);
            safe = if retreated || new.energy(pressure) > energy + noise {
                SAFE_STEPS
            } else {
                usize::saturating_sub(safe, 1)
            };
            residuals = new;
            iterations += 1;
            if exhausted && was_safe {
                // Not even a gradient step of safe length descends.
                let stop = if residual <= 10.0 * floor { Stop::RoundingFloor } else { Stop::NoDescent };
                break (stop, error_estimates);
            }
        };
        let residuals = self.operator.stress(&mut self.gap, &mut self.residual);
        let pairs = self.operator.pairs - pairs_before;
        Ok(self.operator.state(
            Outcome { load, stop, iterations, pairs, clock, residuals, error_estimates },
            &self.gap,
            &self.residual,
        ))
    }
}
