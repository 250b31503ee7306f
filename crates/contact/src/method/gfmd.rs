//! Green's-function molecular dynamics, the reference of the challenge: every surface mode is a damped oscillator,
//! all with the same mass; after each step nodes that crossed the hard wall are moved back onto it (Campañá & Müser,
//! Phys. Rev. B 74 (2006) 075420; Prodanov, Dapp & Müser, Tribology Letters 53 (2014) 433).
//!
//! With one mass for all modes the Verlet step is the same in real and in Fourier space. The state is stored in real
//! space, where the wall acts, and one transform pair gives the elastic force. Masses proportional to the stiffness
//! would converge in fewer steps but to another fixed point: the clamp is a projection only in the metric of uniform
//! masses (1-D Westergaard at half its full-contact pressure: contact fraction 0.605 instead of 0.5).

use super::equilibrium_check::Ending;
use super::iteration::{ConvergenceMonitor, IterationControl, LoadSolution};
use super::operator::{Build, Operator, dispatch};
use super::plastic::{PlasticFlow, WithPlastic};
use super::residuals::{Residuals, RowLaw, kkt_row};
use super::sweep::{sweep, sweep_sums};
use super::{
    Capabilities, ContactMethod, Criterion, Equilibrium, Load, MethodCard, MethodKind, Needs, Observer, ReducedProblem,
    SolvePlan, SolverRun, SolverSnapshot, StartedMethod, Stop,
};
use crate::interface::{Kernel, Law};
use asperity_grid::Result;
use asperity_grid::{Real, Transform};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub struct Gfmd;

static CARD: MethodCard = MethodCard {
    id: "gfmd",
    paper_name: "GFMD",
    family: "boundary value",
    kind: MethodKind::Solver,
    needs: Needs::Heights,
    criterion: Criterion::ZeroGap,
    calibrated_on: None,
    summary: "damped dynamics of the surface modes, uniform masses; the reference",
    supports: super::card::fields,
    capabilities: Capabilities::HARDNESS,
    dois: &["10.1007/s11249-017-0900-2", "10.1103/PhysRevB.74.075420", "10.1007/s11249-013-0288-4"],
    papers: &[],
    measured_errors: None,
};

/// Square of the time step times the highest frequency. Verlet is stable up to 4; the paper's choices are 0.25 to 1.
/// At 512², p* = 0.01, the number of steps is inversely proportional to the time step; 1.6 leaves a margin for
/// impacts on the wall.
const STEP_SQUARED: f64 = 1.6;
/// The same for soft walls, on which nodes bounce: on a rough 128² surface the larger step does not converge for
/// walls 14 times stiffer than the stiffest mode of the grid; this one converges for walls 90 times stiffer.
const STEP_SQUARED_SOFT: f64 = 0.4;

/// Damping over the critical damping of the slowest mode; slightly underdamped, as in the paper.
const DAMPING: f64 = 0.7;

impl ContactMethod for Gfmd {
    fn card(&self) -> &'static MethodCard {
        &CARD
    }

    fn plan(&self, problem: &ReducedProblem) -> SolvePlan {
        // Heights, gap and velocity in working precision, and one half spectrum.
        let spectrum = match problem.precision {
            super::Precision::F32 => Transform::<f32>::spectrum_bytes(problem.grid),
            super::Precision::F64 => Transform::<f64>::spectrum_bytes(problem.grid),
        };
        SolvePlan {
            bytes: 3 * problem.grid.points() as u64 * problem.precision.bytes()
                + spectrum
                + PlasticFlow::<f64>::bytes(problem)
                + PlasticFlow::<f64>::nodes_bytes(problem),
            iterations: (40.0 * (problem.grid.nx.max(problem.grid.ny) as f64).sqrt()) as usize
                * problem.adhesion_effort(),
            pairs_per_iteration: 1.0,
            seconds: 0.0,
        }
    }

    fn prepare<'p>(&self, problem: &'p ReducedProblem<'p>, observer: &'p dyn Observer) -> Result<StartedMethod<'p>> {
        problem.expect_periodic(CARD.id)?;
        Ok(StartedMethod::Solver(dispatch(problem, GfmdStart(problem, observer))))
    }
}

struct GfmdStart<'p>(&'p ReducedProblem<'p>, &'p dyn Observer);

impl<'p> Build<'p> for GfmdStart<'p> {
    type Built = Box<dyn SolverRun + 'p>;

    fn build<T: Real, K: Kernel + 'p, L: Law + 'p>(self, kernel: K, law: L) -> Self::Built {
        let operator = Operator::<T, K, L>::new(self.0, kernel, law);
        let gap = operator.first_touch();
        let velocity = vec![T::default(); gap.len()];
        let flow = PlasticFlow::default();
        Box::new(GfmdRun { operator, observer: self.1, gap, velocity, flow, paused: None })
    }
}

struct GfmdRun<'p, T: Real, K, L> {
    operator: Operator<'p, T, K, L>,
    observer: &'p dyn Observer,
    gap: Vec<T>,
    /// Gap minus the previous gap; interfacial stress once a load is done.
    velocity: Vec<T>,
    /// Flow of the finished loads, contained in the heights.
    flow: PlasticFlow<T>,
    /// Set by a snapshot.
    paused: Option<GfmdSnapshot>,
}

/// State of the dynamics in addition to gap and velocity.
#[derive(Clone, Serialize, Deserialize)]
struct GfmdSnapshot {
    iterations: usize,
    /// Transform pairs of this load.
    #[serde(default)]
    fft_pairs: f64,
    progress: ConvergenceMonitor,
}

/// Gap after a move by `inertia - step t`. A hard wall stops it at zero; with a hardness it is moved back by at most the
/// step of that stress (the proximal operator of the contact energy, of which the clamp is the limit).
#[inline(always)]
fn stepped<L: Law, T: Real>(hardness: f64, g: T, inertia: T, step: T, t: T) -> T {
    if !(L::HARD && L::YIELDS) {
        let next = g + inertia - step * t;
        return if L::HARD { next.max(T::zero()) } else { next };
    }
    let hardness = T::of(hardness);
    let stress = if g.is_sign_negative() { t + hardness } else { t };
    let next = g + inertia - step * stress;
    if next > T::zero() { next } else { (next + step * hardness).min(T::zero()) + T::zero() }
}

impl<T: Real, K: Kernel, L: Law> GfmdRun<'_, T, K, L> {
    /// Sets the velocity to zero and starts the transform pair of the next step.
    fn rest(&mut self) {
        self.velocity.fill(T::zero());
        self.transform_displacement();
    }

    /// Transforms the rows of `gap - height` into the spectrum.
    fn transform_displacement(&mut self) {
        self.operator.allocate_spectrum();
        let Operator { transform, spectrum, heights, offset, .. } = &mut self.operator;
        let offset = *offset;
        let nx = transform.grid().nx;
        let fields = self.gap.par_chunks(nx).zip(heights.par_chunks(nx));
        sweep(transform, spectrum, fields, |worker, _, spectrum, (gap, heights)| {
            for ((w, &g), &h) in worker.row.iter_mut().zip(gap).zip(heights) {
                *w = g - (h - offset);
            }
            worker.forward(spectrum);
        });
    }

    /// One step: elastic force of the displacement in the spectrum, residuals, Verlet update and clamp; the rows of
    /// the new displacement are transformed in the same sweep.
    fn step(&mut self, inertia: f64, step: f64) -> Residuals {
        let elastic = {
            let Operator { transform, spectrum, stiffness, .. } = &mut self.operator;
            0.5 * transform.filter_columns(spectrum, stiffness)
        };
        let Operator { transform, spectrum, heights, offset, law, pressure, .. } = &mut self.operator;
        let offset = *offset;
        let nx = transform.grid().nx;
        let (pressure, inertia, step) = (T::of(*pressure), T::of(inertia), T::of(step));
        let fields = self.gap.par_chunks_mut(nx).zip(self.velocity.par_chunks_mut(nx)).zip(heights.par_chunks(nx));
        let sums = sweep_sums(transform, spectrum, fields, |worker, y, spectrum, ((gap, velocity), heights)| {
            worker.inverse(spectrum);
            worker.row.iter_mut().for_each(|t| *t += pressure);
            let law = RowLaw::of(law, y, nx);
            let sums = kkt_row(law, gap, &mut worker.row);
            for (i, (((t, g), v), &h)) in worker.row.iter_mut().zip(gap).zip(velocity).zip(heights).enumerate() {
                let next = stepped::<L, T>(law.hardness.at(i), *g, inertia * *v, step, *t);
                *v = next - *g;
                *g = next;
                *t = next - (h - offset);
            }
            worker.forward(spectrum);
            sums
        });
        self.operator.fft_pairs += 1.0;
        Residuals::new(self.gap.len(), elastic, &sums)
    }
}

impl<T: Real, K: Kernel, L: Law> SolverRun for GfmdRun<'_, T, K, L> {
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
        let (gap, velocity, pause) = snapshot.restore_pair(self.operator.problem.grid, CARD.id)?;
        self.set_gap(&gap);
        self.velocity = velocity.into_iter().map(T::of).collect();
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
        // Softest modes: the longest wave, and the rigid approach, whose stiffness dp/dū is about p over half the rms
        // height (Persson's exponential law).
        let (wave, _) = self.operator.problem.stiffness_range();
        let approach = control.scale / (0.5 * self.operator.rms_height).max(f64::MIN_POSITIVE);
        // A hard wall is touched by one node at least; one that yields carries no more.
        let one_node = if L::HARD && !L::ACTIVE && !L::YIELDS { self.operator.stiffness_of_one_node() } else { 0.0 };
        let slowest = wave.min(approach.max(one_node));
        match self.paused.take() {
            None => self.rest(),
            Some(GfmdSnapshot { iterations, fft_pairs, progress }) => {
                fft_pairs_before -= fft_pairs;
                control.resume(iterations, progress);
                self.transform_displacement();
            }
        }
        let (ending, residuals) = loop {
            let squared = if L::HARD { STEP_SQUARED } else { STEP_SQUARED_SOFT };
            let step = squared / self.operator.stiffest(&self.gap);
            let inertia = (-2.0 * DAMPING * (slowest * step).sqrt()).exp();
            let residuals = self.step(inertia, step);
            control.record(&residuals);
            if control.converged(&residuals) {
                // The residuals are those of the state before the step, and an oscillation may pass through
                // equilibrium: the state after the step must meet the criteria.
                let final_residuals = self.operator.stress(&mut self.gap, &mut self.velocity);
                if control.converged(&final_residuals) {
                    break (Ending::Met, final_residuals);
                }
                self.rest();
            }
            if let Some(ending) = control.failed(&residuals) {
                break (ending, residuals);
            }
            let fft_pairs = self.operator.fft_pairs - fft_pairs_before;
            let pause = |c: &IterationControl| GfmdSnapshot {
                iterations: c.iterations + 1,
                fft_pairs,
                progress: c.monitor.clone(),
            };
            if control.checkpoint_or_interrupt(&residuals, (&self.gap, &self.velocity), pause) {
                break (Ending::Stopped(Stop::Interrupted), residuals);
            }
            control.iterations += 1;
        };
        let mut residuals = match ending {
            Ending::Met => residuals,
            // Those of the present state, not of the one before the last step.
            _ => self.operator.stress(&mut self.gap, &mut self.velocity),
        };
        let fft_pairs = self.operator.fft_pairs - fft_pairs_before;
        let outcome = control.finish(ending, residuals, fft_pairs);
        let plasticity = self.operator.yielded(&mut flow, (&mut self.gap, ending == Ending::Met), &mut residuals);
        self.flow = flow;
        let outcome = LoadSolution { residuals, ..outcome };
        Ok(Equilibrium { plastic: self.flow.lend(), plasticity, ..outcome.state(&self.gap, &self.velocity) })
    }
}
