//! Iterations on one grid.

use super::level::{Level, Trial};
use crate::interface::Law;
use crate::method::equilibrium_check::Ending;
use crate::method::iteration::{ConvergenceMonitor, MonitorMark, relative_change};
use crate::method::residuals::Residuals;
use crate::method::{ErrorEstimates, Iteration, Load, Observer, Precision, ReducedProblem, SnapshotRef, Stop};
use asperity_grid::{Field, Real};
use serde::{Deserialize, Serialize};

/// Plain (smoothing) steps after an interpolation, after a Newton step, and after a failed line search. A Newton step
/// changes the free set and leaves errors at contact lines: with two plain steps 2048² takes 52 instead of 68
/// transform pairs to 1e-3 of the pressure.
const SMOOTHING: usize = 4;
const SMOOTHING_AFTER_NEWTON: usize = 2;
const FALLBACK: usize = 10;

/// Transform pairs of a plain step.
const PLAIN_PAIRS: f64 = 1.5;

/// Residual over the tolerance up to which the convergence rate of plain steps is extrapolated; above it they slow
/// down, and take half as many transform pairs again to 1e-8.
const NEAR: f64 = 4.0;

/// Residual over the tolerance below which long waves have converged, too.
const NEGLIGIBLE: f64 = 1e-3;

/// Shortenings of a step that raises the energy, and their factor.
const SHORTENINGS: usize = 5;
const SHORTER: f64 = 0.4;
/// The same for a gradient step after a failed plain step: down to 1e-12 of a step of safe length.
const CAREFUL_SHORTENINGS: usize = 30;

/// Rise of the energy over the magnitude of its terms that is accepted if the residual decreases: laws with a soft
/// wall lose this precision in the difference of large terms.
const ENERGY_DIGITS: f64 = 1e-10;

/// Curvature over that of the stiffest mode below which a direction counts as flat; rounding in f32 is 1e-14 of it,
/// the softest wave of any grid has 1e-5.
const FLAT: f64 = 1e-10;

/// Bounds of the relative residual of a linear problem: the largest, and the smallest without and with an active law.
/// Without a law the problem is linear except for the free set, and the last linear problem can be solved accurately:
/// 0.02 takes 7 to 13 % more transform pairs to 1e-7. With a law nonlinearity limits the gain: 0.001 takes 6 to 16 %
/// more to 1e-6.
const ROUGHEST: f64 = 0.3;
const FINEST: [f64; 2] = [0.001, 0.02];

/// Residual over the rounding level of f32 above which trials before the first Newton step of a grid are evaluated in
/// f32, at half the cost. Not with a law, whose branches may be close.
const ROUGH: f64 = 20.0;

/// Iterations per linear problem at most.
const INNER_LIMIT: usize = 40;

/// Largest convergence rate per cycle that error estimates use.
const SLOWEST_RATE: f64 = 0.9;

/// Remaining changes over the last ones, as of a geometric series with the rate of the residual, and at least 1.
pub(super) fn remaining(now: f64, before: f64) -> f64 {
    let rate = (now / before).min(SLOWEST_RATE);
    (rate / (1.0 - rate)).max(1.0)
}

/// Bounds of the stress scale under mean-gap control, over E* h_rms/L, the stress that flattens the longest waves.
const STRESS_SCALE_BOUNDS: [f64; 2] = [1e-6, 1e-2];

/// Ratio of successive errors of an imposed mean gap above which the next correction of the pressure is a secant: near
/// full contact the contact is stiffer than the spring, whose corrections then are too small.
const SLOW: f64 = 0.25;

/// Search for the pressure of an imposed mean gap on one grid.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct GapSearch {
    pub corrections: usize,
    /// Corrections in succession that did not halve the error.
    pub stalled: usize,
    /// How often the gap was given its mean.
    pub imposed: usize,
    /// Pressure without the force of the spring, and the error at it.
    previous: Option<(f64, f64)>,
    /// Pressure per error, where corrections by the spring are slow.
    pub secant: Option<f64>,
}

impl GapSearch {
    /// Notes the error `miss` at a pressure under a spring of this stiffness.
    pub(super) fn note(&mut self, pressure: f64, miss: f64, spring: f64) {
        if let Some((previous, error)) = self.previous.replace((pressure, miss)) {
            let stiffness = (pressure - previous) / (error - miss);
            let slow = miss.abs() > SLOW * error.abs() && stiffness.is_finite();
            self.secant = Some(stiffness).filter(|s| *s > spring).or(self.secant).filter(|_| slow);
            self.stalled = if miss.abs() > 0.5 * error.abs() { self.stalled + 1 } else { 0 };
        }
    }
}

/// Data of a solve that the iterations on all its grids share.
pub(super) struct Task<'p> {
    pub problem: &'p ReducedProblem<'p>,
    pub observer: &'p dyn Observer,
    /// Plastic displacement of the loads before this one.
    pub plastic: Option<Field<'p>>,
    pub load: Load,
    /// rms height of the surface, L.
    pub rms_height: f64,
    /// Range of the attraction on the finest grid, L; 0 without adhesion.
    pub range: f64,
    /// Points of the finest grid.
    pub points: usize,
    /// Transform pairs of the coarser grids so far, in pairs of the finest grid.
    pub earlier_pairs: f64,
    pub search: GapSearch,
    /// The initial state is that before a machine pulled on: no result, however small the residual of its few open nodes is.
    pub pulled: bool,
}

impl Task<'_> {
    /// Stress by which residuals are divided. Under mean-gap control the pressure may pass through zero; the
    /// attraction, estimated as energy over range, then sets the scale. Both vanish for separated surfaces, so the
    /// scale has a lower bound.
    pub(super) fn scale(&self, pressure: f64, residuals: &Residuals) -> f64 {
        let pull = if self.range > 0.0 { residuals.interaction.abs() / self.range } else { 0.0 };
        match self.load {
            Load::Pressure(p) => self.problem.stress_scale(self.rms_height, p),
            Load::MeanGap(target) => {
                // Stresses for which rounding exceeds the tolerance count as zero.
                let height = self.rms_height.max(target);
                let rounded = 10.0 * self.problem.rounding_floor(height, 1.0) / self.problem.tolerance;
                let [least, largest] = STRESS_SCALE_BOUNDS.map(|bound| bound * height);
                (pressure.abs() + pull).max(rounded.clamp(least, largest))
            }
        }
    }
}

/// Result on one grid.
pub(super) struct Ended {
    pub ending: Ending,
    pub error_estimates: ErrorEstimates,
}

/// The state before the last Newton step.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Cycle {
    before: Residuals,
}

/// Plain steps since the last Newton step, which smooth the errors at contact lines.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct SmoothingPhase {
    /// Transform pairs of the Newton step.
    newton: f64,
    /// Residual after it; `None` before its evaluation.
    first: Option<f64>,
    plain: i32,
}

impl SmoothingPhase {
    /// Whether plain steps, at their average rate, reach `tolerance` in fewer transform pairs than another Newton
    /// step. A Newton step first increases the residual at new contact lines; near convergence it costs more than it
    /// gains. At 4096² with adhesion this criterion saves 48 of 85 pairs (f32, 1e-2).
    fn is_promising(&self, residual: f64, tolerance: f64) -> bool {
        let near = residual > tolerance && residual < NEAR * tolerance;
        let Some(first) = self.first.filter(|f| near && residual < *f) else { return false };
        let rate = (residual / first).ln() / f64::from(self.plain);
        PLAIN_PAIRS * (tolerance / residual).ln() / rate < self.newton
    }
}

impl Cycle {
    /// Remaining changes, extrapolated as a geometric series with the rate of the residual over the last cycle. For
    /// area and mean gap at least the change of the last cycle, since long waves, which determine the mean gap, weigh
    /// little in the residual: without this bound 256² stopped with an error of 1.5e-4 at an estimate of 0.6e-4.
    fn error_estimates(&self, now: &Residuals) -> ErrorEstimates {
        let factor = remaining(now.residual, self.before.residual);
        let rest = |now: f64, then: f64| relative_change(now, then).map(|change| change * factor);
        ErrorEstimates {
            area: rest(now.contact, self.before.contact),
            mean_gap: rest(now.mean_gap, self.before.mean_gap),
        }
    }
}

/// State of the iteration in addition to the gap, at points without a stored direction. Resuming from it is
/// bit-identical.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct DescentSnapshot {
    pub pressure: f64,
    iterations: usize,
    /// Transform pairs of this level; and of the coarser ones, in pairs of the problem's grid.
    #[serde(rename = "pairs")]
    fft_pairs: f64,
    pub earlier_pairs: f64,
    smoothing: usize,
    careful: bool,
    /// Of an imposed mean gap.
    #[serde(default)]
    pub search: GapSearch,
    /// Precision of the last trial, if not that of the problem.
    #[serde(default)]
    precision: Option<Precision>,
    /// Residual before the last Newton step.
    last: f64,
    phase: Option<SmoothingPhase>,
    cycle: Option<Cycle>,
    progress: ConvergenceMonitor,
    /// Of a grid that is finished: the next one continues from its state.
    #[serde(default)]
    finished: Option<ErrorEstimates>,
}

impl DescentSnapshot {
    /// Of a finished grid, after this number of iterations.
    pub(super) fn after(
        pressure: f64,
        iterations: usize,
        (fft_pairs, earlier_pairs): (f64, f64),
        error_estimates: ErrorEstimates,
    ) -> Self {
        DescentSnapshot {
            fft_pairs,
            earlier_pairs,
            finished: Some(error_estimates),
            ..Self::fresh(pressure, iterations)
        }
    }

    fn fresh(pressure: f64, iterations: usize) -> Self {
        DescentSnapshot {
            pressure,
            iterations,
            fft_pairs: 0.0,
            earlier_pairs: 0.0,
            search: GapSearch::default(),
            smoothing: SMOOTHING,
            careful: false,
            precision: None,
            last: 0.0,
            phase: None,
            cycle: None,
            progress: ConvergenceMonitor::default(),
            finished: None,
        }
    }

    /// Error estimates, number of iterations and transform pairs of a finished grid.
    pub(super) fn finished(&self) -> Option<(ErrorEstimates, usize, f64)> {
        self.finished.map(|estimates| (estimates, self.iterations, self.fft_pairs))
    }
}

/// Iterates on one grid until the tolerance is met.
pub(super) fn iterate<T: Real, L: Law>(
    task: &Task,
    level: &mut Level<T, L>,
    tolerance: f64,
    iterations: &mut usize,
    resumed: Option<DescentSnapshot>,
) -> Ended {
    let mut descent = Descent::begin(task, level, tolerance, iterations, resumed);
    loop {
        descent.approach_rigidly();
        descent.confirm();
        let error_estimates = descent.error_estimates();
        if let Some(ending) = descent.ended() {
            return Ended { ending, error_estimates };
        }
        let plain = descent.takes_plain_step();
        if descent.checkpoint_or_interrupt(plain) {
            return Ended { ending: Ending::Stopped(Stop::Interrupted), error_estimates };
        }
        *descent.iterations += 1;
        let precision = descent.trial_precision();
        let length = if plain { descent.plain_step() } else { descent.newton_step() };
        if let Some(stop) = length.and_then(|length| descent.advance(length, plain, precision)) {
            return Ended { ending: Ending::Stopped(stop), error_estimates };
        }
    }
}

/// State of the iteration on one grid.
struct Descent<'a, 'p, 'h, T: Real, L> {
    task: &'a Task<'p>,
    level: &'a mut Level<'h, T, L>,
    tolerance: f64,
    iterations: &'a mut usize,
    pressure: f64,
    stiffest_mode: f64,
    /// The present state, the last accepted trial, and the precision of its evaluation.
    now: Trial,
    precision: Precision,
    /// No step has been taken from the initial state.
    untouched: bool,
    /// Remaining plain steps.
    smoothing: usize,
    /// Set by a failed plain step: the next is a gradient step of safe length with many shortenings.
    careful: bool,
    /// Residual before the last Newton step.
    last: f64,
    phase: Option<SmoothingPhase>,
    cycle: Option<Cycle>,
    progress: ConvergenceMonitor,
    /// The monitor before the present iteration.
    known: MonitorMark,
    /// Weight of the last direction in the next plain one.
    beta: f64,
    stopping: bool,
}

impl<'a, 'p, 'h, T: Real, L: Law> Descent<'a, 'p, 'h, T, L> {
    fn begin(
        task: &'a Task<'p>,
        level: &'a mut Level<'h, T, L>,
        tolerance: f64,
        iterations: &'a mut usize,
        resumed: Option<DescentSnapshot>,
    ) -> Self {
        let pressure = level.pressure;
        let stiffest_mode = ReducedProblem { grid: level.grid(), ..task.problem.clone() }.stiffest_mode();
        // The pending step of the last solve.
        level.apply_pending();
        level.clear_step();
        let precision = resumed.as_ref().and_then(|pause| pause.precision).unwrap_or(task.problem.precision);
        let now = level.trial(0.0, precision);
        level.pending = 0.0;
        let untouched = resumed.is_none() && !task.pulled;
        // The pairs of a snapshot include those of the trial, which is repeated.
        let counted = if resumed.is_some() { 0.0 } else { level.fft_pairs };
        let DescentSnapshot { smoothing, careful, last, phase, cycle, progress, iterations: done, fft_pairs, .. } =
            resumed.unwrap_or_else(|| DescentSnapshot::fresh(pressure, *iterations));
        *iterations = done;
        level.fft_pairs = counted + fft_pairs;
        Descent {
            task,
            level,
            tolerance,
            iterations,
            pressure,
            stiffest_mode,
            now,
            precision,
            untouched,
            smoothing,
            careful,
            last,
            phase,
            cycle,
            known: progress.mark(),
            progress,
            beta: 0.0,
            stopping: false,
        }
    }

    /// Stress by which residuals are divided.
    fn scale(&self) -> f64 {
        self.task.scale(self.pressure, &self.now.residuals)
    }

    fn residual(&self) -> f64 {
        self.now.residuals.residual / self.scale()
    }

    /// Relative residual due to rounding.
    fn floor(&self) -> f64 {
        self.task.problem.stall_floor(self.task.rms_height, self.now.residuals.mean_gap, self.scale())
    }

    /// Precision of the next trial.
    fn trial_precision(&self) -> Precision {
        let problem = self.task.problem;
        let narrow = ReducedProblem { precision: Precision::F32, grid: self.level.grid(), ..problem.clone() };
        let floor = narrow.rounding_floor(self.task.rms_height, self.scale());
        let rough = self.level.tries_in_f32()
            && !L::ACTIVE
            && !self.careful
            && self.cycle.is_none()
            && self.residual() > ROUGH * floor;
        if rough { Precision::F32 } else { problem.precision }
    }

    fn error_estimates(&self) -> ErrorEstimates {
        self.cycle.as_ref().map_or_else(ErrorEstimates::default, |c| c.error_estimates(&self.now.residuals))
    }

    /// Rigid approach of a state without contact to first contact, and of a periodic body that yields to the balance of its
    /// flow. Under compression a state without contact is no equilibrium: the body has no stiffness against a rigid
    /// approach, which lowers the energy until a node closes, and the linear problem of a Newton step without closed nodes
    /// is singular. Interpolation from a coarser grid may open what is nearly flat.
    fn approach_rigidly(&mut self) {
        let compressed = matches!(self.task.load, Load::Pressure(p) if p > 0.0);
        let flow_balances = L::YIELDS && !self.level.is_padded();
        if L::HARD && compressed && !flow_balances && self.now.residuals.contact == 0.0 {
            self.level.approach(1);
        } else if !self.level.balance_flow() {
            return;
        }
        self.level.clear_step();
        self.precision = self.task.problem.precision;
        self.now = self.level.trial(0.0, self.precision);
        (self.beta, self.phase, self.cycle, self.untouched) = (0.0, None, None, false);
    }

    /// Evaluates a state that may have converged in the precision of the problem.
    fn confirm(&mut self) {
        let narrow = self.precision != self.task.problem.precision;
        let is_complete = self.cycle.is_some() || self.residual() < NEGLIGIBLE * self.tolerance;
        if narrow && is_complete && self.now.residuals.meets(self.tolerance, self.scale()) {
            self.precision = self.task.problem.precision;
            self.now = self.level.trial(self.level.pending, self.precision);
        }
    }

    /// How the iteration ends at the present state, if it does.
    fn ended(&mut self) -> Option<Ending> {
        let (scale, residual) = (self.scale(), self.residual());
        let (task, residuals) = (self.task, self.now.residuals);
        self.level.last = residuals;
        // Plain steps alone may reduce the residual without converging long waves and the mean gap, whose error was
        // 5e-4 at 4096² and a residual of 2 %. An initial state that meets the criteria needs no step.
        let whole =
            self.cycle.is_some() || std::mem::take(&mut self.untouched) || residual < NEGLIGIBLE * self.tolerance;
        if whole && residuals.meets(self.tolerance, scale) {
            return Some(Ending::Met);
        }
        if *self.iterations >= task.problem.max_iterations {
            return Some(Ending::Stopped(Stop::IterationLimit));
        }
        self.known = self.progress.mark();
        let floor = self.floor();
        if let Some(stop) = self.progress.stalled(residual, floor, self.tolerance) {
            return Some(Ending::Stopped(stop));
        }
        let separated =
            matches!(self.task.load, Load::Pressure(_)) && residuals.separated(self.pressure, self.level.law().range());
        separated.then_some(Ending::Stopped(Stop::Detached))
    }

    fn takes_plain_step(&self) -> bool {
        self.smoothing > 0 || self.phase.is_some_and(|s| s.is_promising(self.residual(), self.tolerance))
    }

    /// Reports the iteration and passes a snapshot if one is due. True where the observer stops the solve. Snapshots
    /// contain only the gap: repeating a few plain steps costs less than storing a direction.
    fn checkpoint_or_interrupt(&mut self, plain: bool) -> bool {
        let (observer, residual) = (self.task.observer, self.residual());
        let grid_fraction = self.level.grid().points() as f64 / self.task.points as f64;
        let step = Iteration { iteration: *self.iterations, residual, tolerance: self.tolerance, grid_fraction };
        self.stopping |= observer.iteration(step).is_break() || observer.stop_requested();
        // A search for the pull-off restarts from its initial state.
        let resumable = self.beta == 0.0 || !plain || self.task.pulled;
        if resumable && !self.task.pulled && (self.stopping || observer.snapshot_due()) {
            let grid = self.level.grid();
            let pause = DescentSnapshot {
                pressure: self.pressure,
                iterations: *self.iterations,
                fft_pairs: self.level.fft_pairs,
                earlier_pairs: self.task.earlier_pairs,
                search: self.task.search,
                smoothing: self.smoothing,
                careful: self.careful,
                precision: Some(self.precision),
                last: self.last,
                phase: self.phase,
                cycle: self.cycle,
                progress: self.progress.at(&self.known),
                finished: None,
            };
            observer.snapshot(SnapshotRef {
                grid,
                ranks: self.level.ranks(),
                gap: T::lend(self.level.gap()),
                auxiliary: None,
                plastic: self.task.plastic,
                progress: serde_json::to_value(pause).expect("plain numbers"),
            });
        }
        resumable && self.stopping
    }

    /// Stiffness of the rigid approach, about the pressure over half the rms height; any finite value for a flat
    /// surface.
    fn mean_stiffness(&self) -> f64 {
        let facing = self.level.window().points() as f64 / self.level.grid().points() as f64;
        let approach = facing * self.scale() / (0.5 * self.task.rms_height).max(f64::MIN_POSITIVE);
        approach.min(self.stiffest_mode.max(1.0)) + self.level.spring.stiffness
    }

    /// A conjugate direction in the plain metric. Returns the step length.
    fn plain_step(&mut self) -> Option<f64> {
        self.smoothing = self.smoothing.saturating_sub(1);
        let (mut slope, mut curvature) = self.level.plain(self.beta);
        if slope >= 0.0 {
            (slope, curvature) = self.level.plain(0.0);
        }
        let stiffest = self.stiffest_mode + self.level.law().max_slope_at_pressure(4.0 * self.pressure.max(0.25));
        // The curvature of the rigid approach is zero but for rounding and gives no length.
        let flat = curvature <= FLAT * stiffest * slope.abs();
        Some(match flat {
            _ if self.careful => 1.0 / stiffest,
            false => -slope / curvature,
            true if L::HARD => 1.0 / stiffest,
            true => (1.0 / self.mean_stiffness()).max(1.0 / stiffest),
        })
    }

    /// A Newton step on the free set. None if it was stopped; the state before it is then restored.
    fn newton_step(&mut self) -> Option<f64> {
        let residual = self.residual();
        // Forcing term after Eisenstat & Walker (SIAM J. Sci. Comput. 17 (1996) 16): as accurate as the last step was
        // successful, and no more than the tolerance needs. In the first step 0.02 costs a third more transform pairs
        // in all than 0.3.
        let finest = FINEST[usize::from(L::ACTIVE)];
        let enough = (0.25 * self.tolerance / residual).min(ROUGHEST);
        let forcing = (residual / self.last).powi(2).clamp(finest, ROUGHEST).max(enough);
        let accuracy = (self.mean_stiffness(), forcing, INNER_LIMIT);
        let (fft_pairs, observer) = (self.level.fft_pairs, self.task.observer);
        if !self.level.newton(accuracy, &|| observer.stop_requested()) {
            self.level.clear_step();
            self.now = self.level.trial(0.0, self.precision);
            self.progress = self.progress.at(&self.known);
            *self.iterations -= 1;
            return None;
        }
        self.phase = Some(SmoothingPhase { newton: self.level.fft_pairs - fft_pairs, first: None, plain: 0 });
        self.cycle = Some(Cycle { before: self.now.residuals });
        self.smoothing = SMOOTHING_AFTER_NEWTON;
        self.last = residual;
        Some(1.0)
    }

    /// Line search along the direction for a decrease of the energy. Returns a stop reason if not even the gradient
    /// step descends.
    fn advance(&mut self, mut length: f64, plain: bool, precision: Precision) -> Option<Stop> {
        let (pressure, residuals, old_rr) = (self.pressure, self.now.residuals, self.now.rr);
        let energy = residuals.energy(pressure);
        let epsilon = precision.epsilon().max(self.precision.epsilon());
        let noise = 64.0 * epsilon * residuals.magnitude(pressure);
        // Near convergence rounding hides changes of the energy, but not of the residual.
        let blind = ENERGY_DIGITS * residuals.magnitude(pressure);
        let rises = |next: &Trial| {
            let rise = next.residuals.energy(pressure) - energy;
            // A step whose energy is no number is too long, too.
            rise.is_nan() || rise > noise && !(next.rr < old_rr && rise < blind)
        };
        let mut next = self.level.trial(length, precision);
        let mut tries = 0;
        let shortenings = if self.careful { CAREFUL_SHORTENINGS } else { SHORTENINGS };
        while rises(&next) && tries < shortenings {
            length *= SHORTER;
            next = self.level.trial(length, precision);
            tries += 1;
        }
        if rises(&next) {
            if self.careful {
                self.level.trial(0.0, precision);
                let rounded = self.residual() <= 10.0 * self.floor();
                return Some(if rounded { Stop::RoundingFloor } else { Stop::NoDescent });
            }
            (self.smoothing, self.careful, self.phase) = (FALLBACK, plain, None);
            (self.beta, length) = (0.0, 0.0);
            // A rejected step may not be finite.
            self.level.clear_step();
            next = self.level.trial(0.0, precision);
        } else {
            self.careful = false;
            let well = plain && tries == 0;
            self.beta = if well { ((next.rr - next.rr_old) / old_rr).max(0.0) } else { 0.0 };
            let scale = self.scale();
            if let Some(phase) = self.phase.as_mut() {
                phase.plain += i32::from(plain);
                phase.first = phase.first.or(Some(next.residuals.residual / scale));
            }
        }
        self.level.pending = length;
        (self.now, self.precision) = (next, precision);
        None
    }
}
