//! Boundary elements with cubic B-splines and an augmented Lagrangian (Vorlaufer & Vernes, in Müser et al., Tribology
//! Letters 65 (2017) 118, BEM+B).
//!
//! The displacement is a periodic cubic spline with one coefficient per node. Coefficients and nodal values are
//! proportional mode by mode, `u = b c` with `b = Π(2 + cos qΔ)/3`, so the unknowns here are the nodal gaps. A spline
//! mode consists of a wave and its aliases, with amplitudes `Π sinc⁴(qΔ/2)` of the coefficient. The elastic energy
//! includes the aliases up to the second, so that the stiffness of a nodal mode is
//!
//! ```text
//! K(q) = Σ_m k(q + 2πm/Δ) Π sinc⁸((q + 2πm/Δ)Δ/2) / b(q)²,   |m_x|, |m_y| ≤ 2
//! ```
//!
//! It equals that of the body for long waves, to fourth order, and about half of it for the shortest. Roughness is
//! low-pass filtered to waves that the splines resolve, λ ≥ 4Δ by default (the paper: λ > L/256 on 1024 nodes); gaps
//! are those of the filtered surface. Multipliers prevent overlap at the nodes, `λ ← max(0, λ - r g)`; between their
//! updates Newton steps with conjugate gradients minimise the augmented energy. Adhesion acts at the nodes; for
//! overlapping trial states it has its value at contact.

mod newton;

use crate::prelude::*;
use asperity_contact::method::fields::{Convolution, Symbol, add, each, inner, means};
use asperity_contact::method::settings::BemBsplineSettings;
use asperity_grid::bisect;
use newton::Newton;
use std::f64::consts::PI;

pub(super) struct BemBspline;

static CARD: MethodCard = MethodCard {
    id: "bem-bspline",
    paper_name: "BEM+B",
    family: "boundary value",
    kind: MethodKind::Solver,
    needs: Needs::Heights,
    criterion: Criterion::ZeroGap,
    calibrated_on: None,
    summary: "cubic splines, augmented Lagrangian, wavelengths above four mesh spacings",
    supports,
    capabilities: Capabilities::NONE,
    dois: &["10.1007/s11249-017-0900-2"],
    papers: &[],
    measured_errors: None,
};

fn supports(quantity: Quantity) -> Support {
    match quantity {
        Quantity::Stiffness => asperity_contact::method::card::fields(quantity),
        _ => Support::Only("of roughness with wavelengths above bem-bspline.shortest_wavelength mesh spacings"),
    }
}

/// Aliases of a mode on either side.
const ALIASES: i32 = 2;

/// Residual after a round of Newton steps over that of the state before it.
const ROUND: f64 = 0.1;

/// Smallest relative residual to which a linear system is solved.
const FORCING: f64 = 1e-2;

/// Halvings of a step that raises the energy, and the fraction of the predicted decrease that is required (Armijo).
const RETREATS: usize = 30;
const ARMIJO: f64 = 1e-4;

/// `sin(x)/x` to the fourth power.
fn sinc4(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { (x.sin() / x).powi(4) }
}

/// Stiffness of a mode of nodal values interpolated by a cubic spline.
fn stiffness(kernel: Elastic, grid: Grid, qx: f64, qy: f64) -> f64 {
    let nodal = |q: f64, d: f64| (2.0 + (q * d).cos()) / 3.0;
    let mut sum = 0.0;
    for (mx, my) in (-ALIASES..=ALIASES).flat_map(|mx| (-ALIASES..=ALIASES).map(move |my| (mx, my))) {
        let (kx, ky) = (qx + 2.0 * PI * f64::from(mx) / grid.dx(), qy + 2.0 * PI * f64::from(my) / grid.dy());
        let amplitude = sinc4(0.5 * kx * grid.dx()) * sinc4(0.5 * ky * grid.dy());
        sum += kernel.stiffness(kx, ky) * amplitude * amplitude;
    }
    sum / (nodal(qx, grid.dx()) * nodal(qy, grid.dy())).powi(2)
}

impl ContactMethod for BemBspline {
    fn card(&self) -> &'static MethodCard {
        &CARD
    }

    fn plan(&self, problem: &ReducedProblem) -> SolvePlan {
        let grid = problem.grid;
        // Heights, multipliers, gap, previous gap, gradient, step, stress, traction and scratch, and the fields of
        // the linear solver; stiffness and preconditioner.
        let fields = 9 + Newton::FIELDS;
        let bytes = (fields * grid.points() * size_of::<f64>()) as u64 + Convolution::bytes(grid, 2);
        let iterations = 40 * problem.adhesion_effort();
        SolvePlan { bytes, iterations, pairs_per_iteration: 40.0, seconds: 0.0 }
    }

    fn prepare<'p>(&self, problem: &'p ReducedProblem<'p>, observer: &'p dyn Observer) -> Result<StartedMethod<'p>> {
        let mut heights = fields::heights(problem, CARD.id)?;
        if problem.wall != Wall::Hard {
            return Err(require::refused(CARD.id, "wall", problem.wall, "the hard wall"));
        }
        let BemBsplineSettings { shortest_wavelength, penalty } = problem.settings.bem_bspline;
        if !(shortest_wavelength >= 2.0 && shortest_wavelength.is_finite()) {
            let key = "bem-bspline.shortest_wavelength";
            return Err(require::refused(CARD.id, key, shortest_wavelength, "2 spacings or more"));
        }
        require::positive(penalty, CARD.id, "bem-bspline.penalty")?;
        let (grid, kernel) = (problem.grid, problem.kernel);
        let mut convolution = Convolution::new(grid);
        // At 2 spacings the filter is off, so that the shorter waves along the diagonal are retained.
        if shortest_wavelength > 2.0 {
            let largest = 2.0 * PI / (shortest_wavelength * grid.dx().max(grid.dy())) * (1.0 + f64::EPSILON);
            let kept = convolution.symbol(|qx, qy| f64::from(u8::from(qx.hypot(qy) <= largest)));
            let all = heights.clone();
            convolution.apply(&kept, &all, &mut heights);
        }
        let symbol = convolution.symbol(|qx, qy| stiffness(kernel, grid, qx, qy));
        let points = grid.points() as f64;
        let stiffest = points * symbol.most();
        let zero = || vec![0.0; heights.len()];
        let ground = asperity_grid::lowest(&heights);
        Ok(StartedMethod::Solver(Box::new(BemBsplineRun {
            problem,
            observer,
            law: problem.adhesion,
            rms_height: rms(&heights),
            convolution,
            condition: symbol.map(|k| k),
            stiffness: symbol,
            penalty: penalty * stiffest.max(1.0),
            start: LoadStart::FirstContact,
            newton: Newton::new(heights.len()),
            gap: heights.iter().map(|h| h - ground).collect(),
            multiplier: zero(),
            before: zero(),
            gradient: zero(),
            scratch: zero(),
            step: zero(),
            stress: zero(),
            traction: zero(),
            heights,
        })))
    }
}

struct BemBsplineRun<'p> {
    problem: &'p ReducedProblem<'p>,
    observer: &'p dyn Observer,
    law: AttractionLaw,
    heights: Vec<f64>,
    rms_height: f64,
    convolution: Convolution,
    stiffness: Symbol,
    condition: Symbol,
    /// r, E*/L.
    penalty: f64,
    start: LoadStart,
    newton: Newton,
    gap: Vec<f64>,
    multiplier: Vec<f64>,
    before: Vec<f64>,
    gradient: Vec<f64>,
    scratch: Vec<f64>,
    step: Vec<f64>,
    /// Elastic stress plus pressure.
    stress: Vec<f64>,
    traction: Vec<f64>,
}

/// Start of a load.
enum LoadStart {
    /// First contact.
    FirstContact,
    /// A gap that was set.
    Gap,
    /// The previous state.
    Previous,
}

/// Newton steps without a decrease of the gradient by a tenth, after which a gradient at the level of rounding is final.
const PATIENCE: usize = 20;

/// Outcome of a round.
enum RoundOutcome {
    Done,
    NoDescent,
    Interrupted,
}

impl BemBsplineRun<'_> {
    /// Sets stress and traction of the gap. Returns the elastic energy and that of the law.
    fn respond(&mut self, pressure: f64) -> (f64, f64) {
        let BemBsplineRun { heights, gap, stress, traction, convolution, stiffness, law, scratch, .. } = self;
        let displacement = scratch;
        each(displacement, |i, _| gap[i] - heights[i]);
        convolution.apply(stiffness, displacement, stress);
        let elastic = 0.5 * inner(displacement, stress);
        each(stress, |_, s| s + pressure);
        each(traction, |i, _| law.traction(gap[i].max(0.0)));
        let [energy] = means(gap.len(), |i| [law.energy(gap[i].max(0.0)) + law.traction(0.0) * gap[i].min(0.0)]);
        (elastic, energy)
    }

    /// Returns the augmented energy and sets `gradient`.
    fn augmented(&mut self, pressure: f64) -> f64 {
        let (elastic, energy) = self.respond(pressure);
        let BemBsplineRun { gap, stress, traction, gradient, multiplier, penalty, .. } = self;
        let r = *penalty;
        each(gradient, |i, _| stress[i] + traction[i] - (multiplier[i] - r * gap[i]).max(0.0));
        let [mean_gap, squares] = means(gap.len(), |i| [gap[i], (multiplier[i] - r * gap[i]).max(0.0).powi(2)]);
        elastic + energy + pressure * mean_gap + 0.5 * squares / r
    }

    /// Minimises the augmented energy until its rms gradient is `goal`, or has stalled below `rounded`, where rounding
    /// hides whether the energy decreases.
    fn round(&mut self, pressure: f64, (goal, rounded): (f64, f64), iterations: &mut usize) -> RoundOutcome {
        let mut energy = self.augmented(pressure);
        let r = self.penalty;
        let (mut lowest, mut stalled) = (f64::INFINITY, 0);
        loop {
            let slope = inner(&self.gradient, &self.gradient).sqrt();
            if slope <= goal || *iterations >= self.problem.max_iterations {
                return RoundOutcome::Done;
            }
            (lowest, stalled) = if slope < 0.9 * lowest { (slope, 0) } else { (lowest, stalled + 1) };
            if stalled > PATIENCE && lowest <= rounded {
                return RoundOutcome::NoDescent;
            }
            if self.observer.stop_requested() {
                return RoundOutcome::Interrupted;
            }
            *iterations += 1;
            let BemBsplineRun {
                gap, multiplier, condition, stiffness, problem, newton, gradient, step, scratch, ..
            } = self;
            let (law, convolution) = (self.law, &mut self.convolution);
            // Curvature of multipliers and law, node by node.
            each(scratch, |i, _| {
                let penalty = if multiplier[i] > r * gap[i] { r } else { 0.0 };
                penalty + if gap[i] > 0.0 { law.slope(gap[i]) } else { 0.0 }
            });
            // Mean stiffness of multipliers and law, at least that of the longest wave.
            let [mean] = means(gap.len(), |i| [scratch[i].max(0.0)]);
            let shift = mean.max(problem.stiffness_range().0);
            let points = problem.grid.points() as f64;
            condition.set(stiffness, |k| 1.0 / (points * (points * k + shift)));
            newton.step(gradient, step, FORCING.max(0.5 * goal / slope), |conditioner, d, to| {
                if conditioner {
                    convolution.apply(condition, d, to);
                } else {
                    convolution.apply(stiffness, d, to);
                    each(to, |i, t| t + scratch[i] * d[i]);
                }
            });
            if !self.search(pressure, &mut energy) {
                return RoundOutcome::NoDescent;
            }
        }
    }

    /// Line search: halves the step until the energy decreases sufficiently.
    fn search(&mut self, pressure: f64, energy: &mut f64) -> bool {
        self.before.copy_from_slice(&self.gap);
        let predicted = -inner(&self.gradient, &self.step);
        // Rounding of energies must not count as a rise.
        let noise = 64.0 * f64::EPSILON * (energy.abs() + (pressure * self.rms_height).abs());
        let mut length = 1.0;
        for _ in 0..RETREATS {
            add(&mut self.gap, length, &self.step);
            let next = self.augmented(pressure);
            if next <= *energy - ARMIJO * length * predicted + noise {
                *energy = next;
                return true;
            }
            self.gap.copy_from_slice(&self.before);
            length *= 0.5;
        }
        *energy = self.augmented(pressure);
        false
    }

    /// Starts a load: for the first one, rigid surfaces that overlap until the penalty carries the pressure; for a
    /// gap that was set, multipliers in equilibrium with it.
    fn begin(&mut self, pressure: f64) {
        match self.start {
            LoadStart::Gap => {
                self.respond(pressure);
                let BemBsplineRun { gap, stress, traction, multiplier, .. } = self;
                each(multiplier, |i, _| if gap[i] <= 0.0 { (stress[i] + traction[i]).max(0.0) } else { 0.0 });
            }
            LoadStart::FirstContact if pressure > 0.0 => {
                let BemBsplineRun { heights, gap, penalty, .. } = self;
                let lowest = asperity_grid::lowest(heights);
                let upper = lowest + pressure * heights.len() as f64 / *penalty;
                let carried =
                    |approach: f64| means(heights.len(), |i| [*penalty * (approach - heights[i]).max(0.0)])[0];
                // Sixty halvings exhaust the precision.
                let (_, upper) = bisect(lowest, upper, 60, |approach| carried(approach) <= pressure);
                each(gap, |i, _| heights[i] - upper);
            }
            _ => {}
        }
        self.start = LoadStart::Previous;
    }

    /// Updates the multipliers and closes the gap where they are positive. Returns the residuals of that state.
    fn close(&mut self, pressure: f64) -> Residuals {
        let BemBsplineRun { gap, multiplier, penalty, .. } = self;
        let r = *penalty;
        each(multiplier, |i, m| (m - r * gap[i]).max(0.0));
        each(gap, |i, g| if multiplier[i] > 0.0 { 0.0 } else { g.max(0.0) });
        let energies = self.respond(pressure);
        fields::residuals(&self.gap, &self.stress, &self.traction, true, energies)
    }
}

impl SolverRun for BemBsplineRun<'_> {
    fn set_gap(&mut self, gap: &[f64]) {
        self.gap.copy_from_slice(gap);
        self.start = LoadStart::Gap;
    }

    fn equilibrate(&mut self, load: Load) -> Result<Equilibrium<'_>> {
        let problem = self.problem;
        let pressure = require::pressure(load, self.law.range() > 0.0, CARD.id)?;
        let rms_height = self.rms_height;
        let case = LoadCase { pressure, range: self.law.range(), rms_height, hard: true };
        let mut control = IterationControl::new(problem, self.observer, case);
        let fft_pairs_before = self.convolution.fft_pairs;
        self.begin(pressure);
        let mut goal = ROUND;
        let (ending, residuals) = loop {
            let goals = (goal * control.scale, 10.0 * control.floor * control.scale);
            let round = self.round(pressure, goals, &mut control.iterations);
            let residuals = self.close(pressure);
            control.record(&residuals);
            if control.converged(&residuals) {
                break (Ending::Met, residuals);
            }
            // Checked before the outcome of the round: surfaces that separate have no equilibrium.
            if control.separated(&residuals) {
                break (Ending::Stopped(Stop::Detached), residuals);
            }
            let residual = control.relative(&residuals);
            match round {
                RoundOutcome::Interrupted => break (Ending::Stopped(Stop::Interrupted), residuals),
                RoundOutcome::NoDescent => {
                    let rounded = residual <= 10.0 * control.floor;
                    let stop = if rounded { Stop::RoundingFloor } else { Stop::NoDescent };
                    break (Ending::Stopped(stop), residuals);
                }
                RoundOutcome::Done => {}
            }
            if let Some(ending) = control.failed(&residuals) {
                break (ending, residuals);
            }
            if control.interrupted(&residuals) {
                break (Ending::Stopped(Stop::Interrupted), residuals);
            }
            // No more accurate than the multipliers.
            goal = (ROUND * residual).min(goal).max(0.1 * problem.tolerance);
        };
        let fft_pairs = self.convolution.fft_pairs - fft_pairs_before;
        Ok(control.finish(ending, residuals, fft_pairs).state(&self.gap, &self.stress))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wave through the nodes is `sinc⁴/b = 1 - φ⁴/720` of the spline's, φ = qΔ, and the aliases add less: long
    /// waves lose φ⁴/360 of their stiffness. The shortest is half itself and half its first alias.
    #[test]
    fn stiffness_of_splines() {
        let grid = Grid::unit(64, 64);
        let ratio = |k: f64| {
            let q = 2.0 * PI * k;
            stiffness(Elastic::HalfSpace, grid, q, 0.0) / (0.5 * q) - 1.0
        };
        for k in [1.0, 2.0, 4.0] {
            let phi: f64 = 2.0 * PI * k / 64.0;
            // The next term is of the relative size φ²/5, the aliases' of φ³/100.
            assert!((ratio(k) * -360.0 / phi.powi(4) - 1.0).abs() < 0.25 * phi * phi, "{k}: {}", ratio(k));
        }
        let nyquist = 2.0 * (2.0 / PI).powi(8) * 9.0;
        let more = 2.0 * 3.0 * (2.0 / (3.0 * PI)).powi(8) * 9.0;
        assert!((1.0 + ratio(32.0) - nyquist - more).abs() < 1e-5, "{} {nyquist}", 1.0 + ratio(32.0));
        assert!(stiffness(Elastic::HalfSpace, grid, 0.0, 0.0).abs() < 1e-60);
    }
}
