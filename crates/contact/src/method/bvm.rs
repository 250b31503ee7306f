//! Boundary-value method: the gap is the unknown, found by projected conjugate gradients without restart
//! (Bugnicourt, Sainsot, Dureisseix, Gauthier & Lubrecht, Tribology Letters 66 (2018) 29).
//!
//! One iteration takes one and a half transform pairs: the curvature along the search direction is a sum over its
//! spectrum and needs no inverse transform. Two safeguards for adhesion under load control are added to the published
//! scheme: after negative curvature or a rise of the energy the method takes gradient steps of safe length.

use super::equilibrium_check::Ending;
use super::iteration::{ConvergenceMonitor, IterationControl, LoadSolution};
use super::operator::{Build, Operator, dispatch};
use super::plastic::{PlasticFlow, WithPlastic};
use super::residuals::{Residuals, RowLaw, curvature_of, kkt, moved};
use super::{
    Capabilities, ContactMethod, Criterion, Equilibrium, Load, MethodCard, MethodKind, Needs, Observer, ReducedProblem,
    SolvePlan, SolverRun, SolverSnapshot, StartedMethod, Stop,
};
use crate::interface::{AttractionLaw, Kernel, Law, Wall};
use asperity_grid::Result;
use asperity_grid::{Real, Transform};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub struct Bvm;

static CARD: MethodCard = MethodCard {
    id: "bvm",
    paper_name: "FFT-BVM",
    family: "boundary value",
    kind: MethodKind::Solver,
    needs: Needs::Heights,
    criterion: Criterion::ZeroGap,
    calibrated_on: None,
    summary: "gap as unknown, projected conjugate gradients",
    supports: super::card::fields,
    capabilities: Capabilities::HARDNESS,
    dois: &["10.1007/s11249-017-0980-z", "10.1007/s11249-017-0900-2"],
    papers: &[],
    measured_errors: None,
};

/// Times a step that raises the energy is divided by four, for laws whose energy is not convex.
const RETREATS: usize = 8;

/// Gradient steps of safe length after a rise of the energy.
const SAFE_STEPS: usize = 4;

impl ContactMethod for Bvm {
    fn card(&self) -> &'static MethodCard {
        &CARD
    }

    fn plan(&self, problem: &ReducedProblem) -> SolvePlan {
        // Gap, residual and direction in working precision; the previous gap with adhesion; heights if they are
        // converted or synthesised; one half spectrum.
        let fields = 3
            + u64::from(problem.adhesion != AttractionLaw::None || problem.wall != Wall::Hard)
            + u64::from(problem.precision == super::Precision::F32 || problem.heights.series_bytes().is_some());
        let spectrum = match problem.precision {
            super::Precision::F32 => Transform::<f32>::spectrum_bytes(problem.grid),
            super::Precision::F64 => Transform::<f64>::spectrum_bytes(problem.grid),
        };
        // Measured: 101 to 257 iterations for 512² to 2048² at p* = 0.01.
        let iterations = (6.0 * (problem.grid.nx.max(problem.grid.ny) as f64).sqrt()) as usize + 50;
        SolvePlan {
            bytes: fields * problem.grid.points() as u64 * problem.precision.bytes()
                + spectrum
                + PlasticFlow::<f64>::bytes(problem)
                + PlasticFlow::<f64>::nodes_bytes(problem),
            iterations: iterations * problem.adhesion_effort(),
            pairs_per_iteration: 1.5,
            seconds: 0.0,
        }
    }

    fn prepare<'p>(&self, problem: &'p ReducedProblem<'p>, observer: &'p dyn Observer) -> Result<StartedMethod<'p>> {
        problem.expect_periodic(CARD.id)?;
        Ok(StartedMethod::Solver(dispatch(problem, BvmStart(problem, observer))))
    }
}

struct BvmStart<'p>(&'p ReducedProblem<'p>, &'p dyn Observer);

impl<'p> Build<'p> for BvmStart<'p> {
    type Built = Box<dyn SolverRun + 'p>;

    fn build<T: Real, K: Kernel + 'p, L: Law + 'p>(self, kernel: K, law: L) -> Self::Built {
        let operator = Operator::<T, K, L>::new(self.0, kernel, law);
        let gap = operator.first_touch();
        let residual = vec![T::default(); gap.len()];
        let direction = vec![T::default(); gap.len()];
        let (flow, previous) = (PlasticFlow::default(), Vec::new());
        Box::new(BvmRun { operator, observer: self.1, gap, previous, residual, direction, flow, paused: None })
    }
}

struct BvmRun<'p, T: Real, K, L> {
    operator: Operator<'p, T, K, L>,
    observer: &'p dyn Observer,
    gap: Vec<T>,
    /// Gap before a step, for laws whose energy is not convex; empty without one.
    previous: Vec<T>,
    /// KKT residual of the last evaluation; interfacial stress once a load is done.
    residual: Vec<T>,
    direction: Vec<T>,
    /// Flow of the finished loads, contained in the heights.
    flow: PlasticFlow<T>,
    /// Set by a snapshot.
    paused: Option<BvmSnapshot>,
}

/// State of the search in addition to gap and direction, at the beginning of an iteration.
#[derive(Clone, Serialize, Deserialize)]
struct BvmSnapshot {
    iterations: usize,
    /// Transform pairs of this load, with that of the present residuals.
    #[serde(default)]
    fft_pairs: f64,
    /// Weight of the last direction in the next one.
    beta: f64,
    /// Remaining gradient steps of safe length.
    safe: usize,
    progress: ConvergenceMonitor,
}

/// Result of a step.
struct StepResult {
    residuals: Residuals,
    /// `⟨r r⟩`, and `⟨r r_old⟩` with the residual before the last evaluation.
    rr: f64,
    rr_old: f64,
    /// The step was undone and shortened, at last to nothing (`exhausted`).
    retreated: bool,
    exhausted: bool,
}

impl<T: Real, K: Kernel, L: Law> BvmRun<'_, T, K, L> {
    /// Moves the gap by `step` along the direction, projects it, and evaluates the residuals. Returns also `⟨r r⟩` and
    /// `⟨r r_old⟩`.
    fn advance(&mut self, step: f64) -> (Residuals, f64, f64) {
        let (nx, direction, step) = (self.operator.problem.grid.nx, &self.direction, T::of(step));
        let update = |y: usize, gap: &mut [T]| {
            for (g, &d) in gap.iter_mut().zip(&direction[y * nx..]) {
                *g = moved::<L, T>(*g, step, d);
            }
        };
        let visit = |law: RowLaw<L>, gap: &[T], t: &[T], residual: &mut [T]| {
            let mut sum = [0.0; 2];
            for (i, ((r, &t), &g)) in residual.iter_mut().zip(t).zip(gap).enumerate() {
                let new = kkt::<L, _>(g, t, law.hardness.at(i));
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

    /// New direction `-r + β d`, zero at nodes in compressive contact. Returns `⟨r d⟩` and `⟨d H d⟩`.
    fn direct(&mut self, beta: f64) -> (f64, f64) {
        if L::HARD && L::YIELDS {
            // The residual of a closed node has the sign of the side on which the node may leave the wall.
            self.gap.par_iter_mut().zip(&self.residual).filter(|(g, _)| **g == T::zero()).for_each(|(g, &r)| {
                *g = if r > T::zero() { -T::zero() } else { T::zero() };
            });
        }
        let nx = self.operator.problem.grid.nx;
        let (residual, gap, law, beta) = (&self.residual, &self.gap, self.operator.law, T::of(beta));
        let update = |y: usize, direction: &mut [T]| {
            let mut sum = [0.0; 2];
            for ((d, &r), &g) in direction.iter_mut().zip(&residual[y * nx..]).zip(&gap[y * nx..]) {
                let closed = L::HARD
                    && if L::YIELDS { g == T::zero() && r == T::zero() } else { g <= T::zero() && r >= T::zero() };
                *d = if closed { T::zero() } else { -r + beta * *d };
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

    /// The next search direction: conjugate with weight `beta`, or, after a rise of the energy (`safe`), the gradient.
    /// Returns `⟨r d⟩` and the step length along it.
    fn choose_step(&mut self, beta: f64, safe: bool) -> (f64, f64) {
        let (mut rd, mut curvature) = self.direct(if safe { 0.0 } else { beta });
        if rd >= 0.0 {
            (rd, curvature) = self.direct(0.0);
        }
        if !safe && curvature > 0.0 {
            return (rd, -rd / curvature);
        }
        // Negative curvature (adhesion) has no minimum along the line; the gradient step always descends.
        if curvature <= 0.0 && !safe && beta != 0.0 {
            (rd, _) = self.direct(0.0);
        }
        (rd, 1.0 / self.operator.stiffest(&self.gap))
    }

    /// A step along the direction. With adhesion, whose energy is not convex, a step that raises the energy above
    /// `highest` may have left the valley, so it is undone and shortened.
    fn advance_downhill(&mut self, step: f64, highest: f64) -> StepResult {
        if L::ACTIVE {
            self.previous.resize(self.gap.len(), T::zero());
            self.previous.copy_from_slice(&self.gap);
        }
        let (mut retreated, mut exhausted) = (false, false);
        let (mut residuals, mut rr, mut rr_old) = self.advance(step);
        if L::ACTIVE {
            let mut shorter = step;
            for retreat in 1..=RETREATS {
                if residuals.energy(self.operator.pressure) <= highest {
                    break;
                }
                // The last retreat returns to the state before the step; gradient steps of safe length follow.
                shorter = if retreat == RETREATS { 0.0 } else { 0.25 * shorter };
                self.gap.copy_from_slice(&self.previous);
                (residuals, rr, rr_old) = self.advance(shorter);
                retreated = true;
                exhausted = shorter == 0.0;
            }
        }
        StepResult { residuals, rr, rr_old, retreated, exhausted }
    }
}

impl<T: Real, K: Kernel, L: Law> SolverRun for BvmRun<'_, T, K, L> {
    fn set_plastic_displacement(&mut self, displacement: &[f64]) {
        self.flow.set(displacement);
        self.operator.displace(&self.flow);
    }

    fn set_gap(&mut self, gap: &[f64]) {
        self.gap = gap.iter().map(|&g| T::of(g)).collect();
    }

    fn resume(&mut self, snapshot: SolverSnapshot) -> Result<()> {
        if let Some(displacement) = &snapshot.plastic {
            self.set_plastic_displacement(displacement);
        }
        let (gap, direction, pause) = snapshot.restore_pair(self.operator.problem.grid, CARD.id)?;
        self.set_gap(&gap);
        self.direction = direction.into_iter().map(T::of).collect();
        self.paused = Some(pause);
        Ok(())
    }

    fn equilibrate(&mut self, load: Load) -> Result<Equilibrium<'_>> {
        let mut fft_pairs_before = self.operator.fft_pairs;
        // A load that is refused must not lose the flow.
        self.operator.control(load, self.observer, CARD.id)?;
        let mut flow = std::mem::take(&mut self.flow);
        let observer = WithPlastic { observer: self.observer, plastic: flow.lend() };
        let mut control = self.operator.control(load, &observer, CARD.id)?;
        let (mut beta, mut safe) = (0.0, 0);
        let paused = self.paused.take().map(|pause| {
            (beta, safe) = (pause.beta, pause.safe);
            control.resume(pause.iterations, pause.progress);
            pause.fft_pairs
        });
        let pressure = self.operator.pressure;
        let (mut residuals, ..) = self.advance(0.0);
        if let Some(fft_pairs) = paused {
            fft_pairs_before = self.operator.fft_pairs - fft_pairs;
        }
        let ending = loop {
            if let Some(ending) = control.ended(&residuals) {
                break ending;
            }
            let fft_pairs = self.operator.fft_pairs - fft_pairs_before;
            let pause = |c: &IterationControl| BvmSnapshot {
                iterations: c.iterations,
                fft_pairs,
                beta,
                safe,
                progress: c.monitor_before(),
            };
            if control.checkpoint_or_interrupt(&residuals, (&self.gap, &self.direction), pause) {
                break Ending::Stopped(Stop::Interrupted);
            }
            let (slope, step) = self.choose_step(beta, safe > 0);
            // Rounding of an energy of order E*·h_rms² must not count as a rise.
            let noise = 64.0 * self.operator.problem.precision.epsilon() * residuals.magnitude(pressure);
            let highest = residuals.energy(pressure) + noise;
            let next = self.advance_downhill(step, highest);
            // After a retreat the residual before this step is no longer known.
            let conjugate = slope < 0.0 && !next.retreated;
            beta = if conjugate { ((next.rr - next.rr_old) / -slope).max(0.0) } else { 0.0 };
            let was_safe = safe > 0;
            safe = if next.retreated || next.residuals.energy(pressure) > highest {
                SAFE_STEPS
            } else {
                usize::saturating_sub(safe, 1)
            };
            let previous = control.relative(&residuals);
            residuals = next.residuals;
            control.iterations += 1;
            if next.exhausted && was_safe {
                // Not even a gradient step of safe length lowers the energy.
                let rounded = previous <= 10.0 * control.floor;
                break Ending::Stopped(if rounded { Stop::RoundingFloor } else { Stop::NoDescent });
            }
        };
        let mut residuals = self.operator.stress(&mut self.gap, &mut self.residual);
        let fft_pairs = self.operator.fft_pairs - fft_pairs_before;
        let outcome = control.finish(ending, residuals, fft_pairs);
        let plasticity = self.operator.yielded(&mut flow, (&mut self.gap, ending == Ending::Met), &mut residuals);
        self.flow = flow;
        let outcome = LoadSolution { residuals, ..outcome };
        Ok(Equilibrium { plastic: self.flow.lend(), plasticity, ..outcome.state(&self.gap, &self.residual) })
    }
}
