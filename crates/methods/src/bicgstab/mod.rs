//! Newton's method on a smooth law, its linear systems solved by stabilised bi-conjugate gradients (Wu, in Müser et
//! al., Tribology Letters 65 (2017) 118, BICGSTAB).
//!
//! Wall and cohesion are one law, the 9-3 traction `(8γ/3ρ)[(ρ/z)⁹ - (ρ/z)³]` of eq. (3) of that paper (which calls
//! it an energy) at the distance `z = g + ρ`. The gap `g` is counted from the zero of force, so that contact, defined
//! by compressive stress, is `g < 0`. An exponential law of range ρ is replaced by the range 1.026 ρ, which keeps the
//! largest tension γ/ρ. Without adhesion only the repulsive branch is used, with a range in mesh spacings and a strength
//! in E*, both times the rms gradient; the hard wall is its limit.
//!
//! `F(g) = K(g-h) + p + t(g) = 0` is solved by steps `(K + t')d = -F`, the inner systems conditioned by
//! `1/(k(q) + c)`. A step is shortened until distances stay positive and the energy decreases, and replaced by the
//! preconditioned gradient where it is not a descent direction: with attraction `K + t'` may be indefinite. The first
//! load is solved by continuation in the range, starting at about the rms height.

mod inner;

use crate::prelude::*;
use asperity_contact::interface::{PowerLaw93, PowerLawWall, WithAdhesion};
use asperity_contact::method::fields::{Convolution, Symbol, each, inner as product, means};
use asperity_contact::method::iteration::ConvergenceMonitor;
use asperity_grid::{bisect, extent};
use inner::BiCgStab;

pub(super) struct Bicgstab;

static CARD: MethodCard = MethodCard {
    id: "bicgstab",
    paper_name: "BICGSTAB",
    family: "boundary value",
    kind: MethodKind::Solver,
    needs: Needs::Heights,
    criterion: Criterion::CompressiveStress,
    calibrated_on: None,
    summary: "9-3 law as wall and cohesion, Newton with stabilised bi-conjugate gradients",
    supports,
    capabilities: Capabilities::NONE,
    dois: &["10.1007/s11249-017-0900-2", "10.1137/0913035"],
    papers: &[],
    measured_errors: None,
};

fn supports(quantity: Quantity) -> Support {
    use Quantity::*;
    match quantity {
        GapMap | GapPdf | MeanGap => Support::Only("measured from the zero of force of the repulsive wall"),
        ContactArea | ContactMap | ClusterPdf | ClusterArea | MedianClusterArea => {
            Support::Only("area under compression")
        }
        StressMap | StressPdf => Support::Only("with the range enlarged to the mesh"),
        Stiffness => asperity_contact::method::card::fields(quantity),
    }
}

/// Range of the 9-3 law over that of the exponential one with the same γ and the same largest tension.
const SAME_TENSION: f64 = 1.026_4;

/// Largest fraction of its distance from the singularity by which a node approaches it in one step.
const CLOSER: f64 = 0.6;

/// Largest relative residual of a linear system, and its largest number of iterations.
const FORCING: f64 = 0.1;
const INNER_MOST: usize = 200;

/// Residual over the pressure at which the continuation halves the range.
const STAGE: f64 = 1e-2;

/// Halvings of a step that raises the energy, and the fraction of the predicted decrease that is required (Armijo).
const RETREATS: usize = 30;
const ARMIJO: f64 = 1e-4;

impl ContactMethod for Bicgstab {
    fn card(&self) -> &'static MethodCard {
        &CARD
    }

    fn adhesion(&self, problem: &ReducedProblem) -> AttractionLaw {
        replacement(problem).map_or(problem.adhesion, AttractionLaw::PowerLaw93)
    }

    fn plan(&self, problem: &ReducedProblem) -> SolvePlan {
        let grid = problem.grid;
        // Heights, gap, previous gap, trial, step, stress, traction, forces and slopes, and the fields of the linear
        // solver.
        let bytes = ((9 + BiCgStab::FIELDS) * grid.points() * size_of::<f64>()) as u64 + Convolution::bytes(grid, 2);
        // Newton steps with tens of linear iterations of four pairs each.
        SolvePlan { bytes, iterations: 15 * problem.adhesion_effort(), pairs_per_iteration: 160.0, seconds: 0.0 }
    }

    fn prepare<'p>(&self, problem: &'p ReducedProblem<'p>, observer: &'p dyn Observer) -> Result<StartedMethod<'p>> {
        let heights = fields::heights(problem, CARD.id)?;
        if problem.wall != Wall::Hard {
            let accepted = "the hard wall, which this method replaces by the 9-3 law";
            return Err(require::refused(CARD.id, "wall", problem.wall, accepted));
        }
        let settings = problem.settings.bicgstab;
        require::positive(settings.wall_range, CARD.id, "bicgstab.wall_range")?;
        require::positive(settings.wall_strength, CARD.id, "bicgstab.wall_strength")?;
        let resolution = settings.min_resolution;
        if !(resolution >= 0.0 && resolution.is_finite()) {
            let accepted = "zero or a positive number";
            return Err(require::refused(CARD.id, "bicgstab.min_resolution", resolution, accepted));
        }
        let PowerLaw93 { gamma, rho } = match problem.adhesion {
            AttractionLaw::None => {
                // Scaled with the surface: flatter asperities press less. Any wall will do on a flat surface.
                let gradient = Some(problem.resolved_gradient()).filter(|g| *g > 0.0).unwrap_or(1.0);
                let rho = settings.wall_range * problem.grid.dx() * gradient;
                let wall = move |rho| PowerLawWall { gamma: settings.wall_strength * gradient * rho, rho };
                return Ok(StartedMethod::Solver(Box::new(BicgstabRun::new(problem, observer, heights, rho, wall))));
            }
            other => replacement(problem)
                .ok_or_else(|| require::refused(CARD.id, "adhesion", other, "none, the exponential or the 9-3 law"))?,
        };
        let law = move |rho| WithAdhesion { wall: PowerLawWall { gamma, rho }, adhesion: PowerLaw93 { gamma, rho } };
        Ok(StartedMethod::Solver(Box::new(BicgstabRun::new(problem, observer, heights, rho, law))))
    }
}

/// The 9-3 law that replaces the adhesion of the problem, with a range that the mesh resolves; none without adhesion
/// and for laws that are not supported.
fn replacement(problem: &ReducedProblem) -> Option<PowerLaw93> {
    let law = match problem.adhesion {
        AttractionLaw::Exponential(a) => PowerLaw93 { gamma: a.gamma, rho: SAME_TENSION * a.rho },
        AttractionLaw::PowerLaw93(a) => a,
        AttractionLaw::None | AttractionLaw::Dugdale(_) | AttractionLaw::Tabulated(_) => return None,
    };
    let enlarged = problem.settings.bicgstab.min_resolution / law.cohesive_resolution(problem.grid.dx());
    Some(PowerLaw93 { rho: law.rho * enlarged.max(1.0), ..law })
}

struct BicgstabRun<'p, L, M> {
    problem: &'p ReducedProblem<'p>,
    observer: &'p dyn Observer,
    /// The law as a function of its range, and the final range.
    law_of: M,
    rho: f64,
    law: L,
    heights: Vec<f64>,
    rms_height: f64,
    convolution: Convolution,
    stiffness: Symbol,
    condition: Symbol,
    newton: BiCgStab,
    gap: Vec<f64>,
    trial: Vec<f64>,
    step: Vec<f64>,
    /// Elastic stress plus pressure.
    stress: Vec<f64>,
    traction: Vec<f64>,
    /// -F.
    force: Vec<f64>,
    slope: Vec<f64>,
    /// Whether a gap to start from exists.
    begun: bool,
}

impl<'p, L: Law, M: Fn(f64) -> L> BicgstabRun<'p, L, M> {
    fn new(
        problem: &'p ReducedProblem<'p>,
        observer: &'p dyn Observer,
        heights: Vec<f64>,
        rho: f64,
        law_of: M,
    ) -> Self {
        let convolution = Convolution::new(problem.grid);
        let kernel = problem.kernel;
        let stiffness = convolution.symbol(|qx, qy| kernel.stiffness(qx, qy));
        let zero = || vec![0.0; heights.len()];
        BicgstabRun {
            problem,
            observer,
            law: law_of(rho),
            law_of,
            rho,
            rms_height: rms(&heights),
            condition: stiffness.map(|k| k),
            stiffness,
            convolution,
            newton: BiCgStab::new(heights.len()),
            gap: zero(),
            trial: zero(),
            step: zero(),
            stress: zero(),
            traction: zero(),
            force: zero(),
            slope: zero(),
            begun: false,
            heights,
        }
    }

    /// Stress, traction, forces and residuals at the gap.
    fn evaluate(&mut self, pressure: f64) -> Residuals {
        let BicgstabRun { heights, gap, trial, stress, traction, force, convolution, stiffness, law, .. } = self;
        each(trial, |i, _| gap[i] - heights[i]);
        convolution.apply(stiffness, trial, stress);
        let elastic = 0.5 * product(trial, stress);
        each(stress, |_, s| s + pressure);
        each(traction, |i, _| law.traction(gap[i]));
        each(force, |i, _| -(stress[i] + traction[i]));
        let [energy] = means(gap.len(), |i| [law.energy(gap[i])]);
        fields::residuals(gap, stress, traction, false, (elastic, energy))
    }

    /// Gap of rigid surfaces at the approach where the law carries the pressure.
    fn rigid(&mut self, pressure: f64) {
        let BicgstabRun { heights, gap, law, .. } = self;
        let (low, high) = extent(heights);
        let carried = |approach: f64| means(heights.len(), |i| [-law.traction(heights[i] - approach)])[0];
        // Sixty halvings exhaust the precision.
        let (_, upper) = bisect(low, high + self.rho, 60, |approach| carried(approach) <= pressure);
        each(gap, |i, _| heights[i] - upper);
    }

    /// One Newton step from a state with these residuals. False if no step lowers the energy.
    fn advance(&mut self, residuals: &mut Residuals, pressure: f64, rho: f64, forcing: f64) -> bool {
        let BicgstabRun { gap, slope, step, force, convolution, stiffness, condition, newton, law, problem, .. } = self;
        each(slope, |i, _| law.slope(gap[i]));
        let [mean] = means(slope.len(), |i| [slope[i].max(0.0)]);
        // Mean stiffness of the law, at least that of the longest wave.
        let shift = mean.max(problem.stiffness_range().0);
        let points = problem.grid.points() as f64;
        // The symbols contain 1/N: k/N here, 1/(N(k + c)) in the preconditioner.
        condition.set(stiffness, |k| 1.0 / (points * (points * k + shift)));
        let shared = std::cell::RefCell::new(convolution);
        newton.solve(
            force,
            step,
            (forcing, INNER_MOST),
            |y, to| shared.borrow_mut().apply(condition, y, to),
            |y, to| {
                shared.borrow_mut().apply(stiffness, y, to);
                each(to, |i, t| t + slope[i] * y[i]);
            },
        );
        let mut predicted = product(force, step);
        if !(predicted > 0.0 && predicted.is_finite()) {
            shared.borrow_mut().apply(condition, force, step);
            predicted = product(force, step);
        }
        let (energy, previous) = (residuals.energy(pressure), self.gap.clone());
        let noise = 64.0 * f64::EPSILON * residuals.magnitude(pressure);
        let mut length = 1.0;
        for _ in 0..RETREATS {
            let BicgstabRun { gap, step, .. } = self;
            // Distances stay positive.
            each(gap, |i, _| (previous[i] + length * step[i]).max(-rho + (1.0 - CLOSER) * (previous[i] + rho)));
            *residuals = self.evaluate(pressure);
            if residuals.energy(pressure) <= energy - ARMIJO * length * predicted + noise {
                return true;
            }
            length *= 0.5;
        }
        self.gap.copy_from_slice(&previous);
        *residuals = self.evaluate(pressure);
        false
    }
}

impl<L: Law, M: Fn(f64) -> L> SolverRun for BicgstabRun<'_, L, M> {
    fn set_gap(&mut self, gap: &[f64]) {
        self.gap.copy_from_slice(gap);
        self.begun = true;
    }

    fn equilibrate(&mut self, load: Load) -> Result<Equilibrium<'_>> {
        let problem = self.problem;
        let pressure = require::pressure(load, self.law.range() > 0.0, CARD.id)?;
        let fft_pairs_before = self.convolution.fft_pairs;
        // Continuation in the range, halved from about the rms height down to the final one.
        let mut rho = self.rho;
        if !self.begun && pressure > 0.0 {
            while 2.0 * rho <= self.rms_height {
                rho *= 2.0;
            }
            self.law = (self.law_of)(rho);
            self.rigid(pressure);
        } else if !self.begun {
            let ground = asperity_grid::lowest(&self.heights);
            let BicgstabRun { gap, heights, .. } = self;
            each(gap, |i, _| heights[i] - ground);
        }
        self.begun = true;
        let rms_height = self.rms_height;
        let case = LoadCase { pressure, range: self.law.range(), rms_height, hard: false };
        let mut control = IterationControl::new(problem, self.observer, case).without_stall_limit();
        let mut residuals = self.evaluate(pressure);
        let ending = loop {
            control.record(&residuals);
            let (last, residual) = (rho <= self.rho, control.relative(&residuals));
            if last && control.converged(&residuals) {
                break Ending::Met;
            }
            if let Some(ending) = control.failed(&residuals) {
                break ending;
            }
            if control.interrupted(&residuals) {
                break Ending::Stopped(Stop::Interrupted);
            }
            if !last && residual <= STAGE {
                // Gaps under compression scale with the range, so that the pressure stays about the same.
                rho = (0.5 * rho).max(self.rho);
                self.law = (self.law_of)(rho);
                control.set_range(self.law.range());
                each(&mut self.gap, |_, g| if g < 0.0 { 0.5 * g } else { g });
                (residuals, control.monitor) = (self.evaluate(pressure), ConvergenceMonitor::default());
                continue;
            }
            let forcing = FORCING.min(residual).max(0.1 * problem.tolerance);
            control.iterations += 1;
            if !self.advance(&mut residuals, pressure, rho, forcing) {
                let rounded = residual <= 10.0 * control.floor;
                break Ending::Stopped(if rounded { Stop::RoundingFloor } else { Stop::NoDescent });
            }
        };
        let fft_pairs = self.convolution.fft_pairs - fft_pairs_before;
        Ok(control.finish(ending, residuals, fft_pairs).state(&self.gap, &self.stress))
    }
}
