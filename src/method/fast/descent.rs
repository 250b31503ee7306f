//! Iterations on one grid.

use super::level::{Level, Trial};
use super::{Ended, Solver};
use crate::grid::Real;
use crate::interface::{Kernel, Law};
use crate::method::iteration::{ConvergenceMonitor, MonitorMark};
use crate::method::residuals::Residuals;
use crate::method::{ErrorEstimates, Iteration, Load, Precision, Problem, SnapshotRef, Stop, Targets};
use serde::{Deserialize, Serialize};

/// Plain steps after an interpolation, after a Newton step (whose change of the free set leaves its error at contact lines,
/// too: with two, 52 pairs instead of 68 bring 2048² to 1e-3 of the pressure), and after a failed line search.
const SMOOTHING: usize = 4;
const SMOOTHING_AFTER_NEWTON: usize = 2;
const FALLBACK: usize = 10;

/// Pairs of a plain step.
const PLAIN_PAIRS: f64 = 1.5;

/// Residual over the tolerance up to which plain steps are trusted to go on as they did: farther off they slow down, and take
/// half as many pairs again to 1e-8.
const NEAR: f64 = 4.0;

/// Residual over the tolerance below which nothing can be left even in long waves.
const NEGLIGIBLE: f64 = 1e-3;

/// Shortenings of a step that raises the energy, and their factor.
const SHORTENINGS: usize = 5;
const SHORTER: f64 = 0.4;
/// The same for a gradient step that follows a failed plain one: down to 1e-12 of a step that should already be safe.
const CAREFUL_SHORTENINGS: usize = 30;

/// Rise of the energy, over the size of its terms, that a falling residual excuses: laws with a wall lose this much in the
/// difference of their large terms.
const ENERGY_DIGITS: f64 = 1e-10;

/// Curvature over that of the stiffest mode below which a direction counts as flat: f32 transforms leave 1e-14 of it, and
/// the softest wave of any grid has 1e-5.
const FLAT: f64 = 1e-10;

/// Bounds of how far a linear problem is solved, over its first residual: at most and, by whether a law is active, at least. Without
/// one, Newton's problem is linear but for the free set, and once that is found the last problem may go all the way: 0.02 takes 7 to
/// 13 % more pairs to 1e-7. With one, what is solved further than 0.02 the law takes back: 0.001 takes 6 to 16 % more to 1e-6.
const ROUGHEST: f64 = 0.3;
const FINEST: [f64; 2] = [0.001, 0.02];

/// Residual over the one that rounding leaves in f32, above which a grid's trials up to its first Newton step's are made in f32
/// whatever the state is in: half the cost. Not with a law, whose branches lie close.
const ROUGH: f64 = 20.0;

/// Iterations of one linear problem.
const INNER_LIMIT: usize = 40;

/// Fall of the residual over a cycle at and above which it says nothing about what is to come.
const SLOWEST_RATE: f64 = 0.9;

/// The state before the last Newton step, and the energy that step had in reach.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Cycle {
    before: Residuals,
    excess: f64,
}

/// What has followed the last Newton step: plain steps, in which contact lines come to rest.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct SmoothingPhase {
    /// Pairs of the Newton step.
    newton: f64,
    /// Residual after it; none before it is known.
    first: Option<f64>,
    plain: i32,
}

impl SmoothingPhase {
    /// Whether plain steps promise to reach `tolerance` for fewer pairs than another Newton step would take, if they go on as they
    /// did on average. A Newton step first raises the residual, by its new contact lines, and then lets it fall: near the end it
    /// costs more than it brings. At 4096² with adhesion this takes 37 pairs instead of 85 (f32, 1e-2).
    fn is_promising(&self, residual: f64, tolerance: f64) -> bool {
        let near = residual > tolerance && residual < NEAR * tolerance;
        let Some(first) = self.first.filter(|f| near && residual < *f) else { return false };
        let rate = (residual / first).ln() / f64::from(self.plain);
        PLAIN_PAIRS * (tolerance / residual).ln() / rate < self.newton
    }
}

impl Cycle {
    /// What is still to come, if the next changes shrink as the residual did over the last cycle: a geometric series. Of area
    /// and mean gap at least as much as the last cycle brought, since long waves, which carry the mean gap, weigh little in
    /// the residual: without this, 256² stopped 1.5e-4 off at an estimate of 0.6e-4. The energy above the minimum, quadratic
    /// in the error, falls faster than the residual; that it has fallen as much is safe to say.
    fn error_estimates(&self, now: &Residuals, pressure: f64) -> ErrorEstimates {
        let rate = (now.residual / self.before.residual).min(SLOWEST_RATE);
        let rest = |now: f64, then: f64| {
            (now - then).abs() / now.abs().max(f64::MIN_POSITIVE) * (rate / (1.0 - rate)).max(1.0)
        };
        ErrorEstimates {
            energy: Some(0.5 * self.excess * rate / now.energy(pressure).abs().max(f64::MIN_POSITIVE)),
            area: Some(rest(now.contact, self.before.contact)),
            mean_gap: Some(rest(now.mean_gap, self.before.mean_gap)),
        }
    }
}

/// What a descent knows beside its gap, where no direction is to be kept: there it can be left and taken up again, with the
/// same bits to follow.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Pause {
    pub pressure: f64,
    iterations: usize,
    /// Of this level; and of those below, in pairs of the problem's grid.
    pairs: f64,
    pub earlier_pairs: f64,
    smoothing: usize,
    careful: bool,
    /// Precision of the last trial, if not that of the problem.
    #[serde(default)]
    precision: Option<Precision>,
    /// Residual before the last Newton step.
    last: f64,
    phase: Option<SmoothingPhase>,
    cycle: Option<Cycle>,
    progress: ConvergenceMonitor,
}

impl<T: Real, K: Kernel, L: Law> Solver<'_, T, K, L> {
    /// Iterates on one grid until tolerance and goals are met.
    pub(super) fn improve(
        &self,
        level: &mut Level<T, K, L>,
        (load, tolerance, targets): (Load, f64, Targets),
        iterations: &mut usize,
        resumed: Option<Pause>,
    ) -> Ended {
        let mut descent = Descent::begin(self, level, (load, tolerance), iterations, resumed);
        loop {
            descent.confirm();
            let error_estimates = descent.error_estimates();
            if let Some(stop) = descent.ended(&targets, &error_estimates) {
                return Ended { stop, error_estimates };
            }
            let plain = descent.takes_plain_step();
            if descent.checkpoint_or_interrupt(plain) {
                return Ended { stop: Stop::Interrupted, error_estimates };
            }
            *descent.iterations += 1;
            let precision = descent.enough();
            let length = if plain { descent.plain_step() } else { descent.newton_step() };
            if let Some(stop) = length.and_then(|length| descent.advance(length, plain, precision)) {
                return Ended { stop, error_estimates };
            }
        }
    }
}

/// Iterations on one grid, as they stand.
struct Descent<'a, 'p, 'h, T: Real, K, L> {
    solver: &'a Solver<'p, T, K, L>,
    level: &'a mut Level<'h, T, K, L>,
    load: Load,
    tolerance: f64,
    iterations: &'a mut usize,
    pressure: f64,
    stiffest_mode: f64,
    /// The state: the last trial that was accepted, and the precision that it was made in.
    now: Trial,
    precision: Precision,
    /// Nothing has been done to the state that was given.
    untouched: bool,
    /// Plain steps that are still to be taken.
    smoothing: usize,
    /// Set by a failed plain step: the next is a gradient step of safe length, shortened as far as it takes.
    careful: bool,
    /// Residual before the last Newton step.
    last: f64,
    phase: Option<SmoothingPhase>,
    cycle: Option<Cycle>,
    progress: ConvergenceMonitor,
    /// The same before it heard of this iteration.
    known: MonitorMark,
    /// Share of the last direction in the next plain one.
    beta: f64,
    stopping: bool,
}

impl<'a, 'p, 'h, T: Real, K: Kernel, L: Law> Descent<'a, 'p, 'h, T, K, L> {
    fn begin(
        solver: &'a Solver<'p, T, K, L>,
        level: &'a mut Level<'h, T, K, L>,
        (load, tolerance): (Load, f64),
        iterations: &'a mut usize,
        resumed: Option<Pause>,
    ) -> Self {
        let pressure = level.pressure;
        let stiffest_mode = Problem { grid: level.grid(), ..solver.problem.clone() }.stiffest_mode();
        // What the last improvement ended with.
        level.settle();
        level.inner.step.fill(0.0);
        let precision = resumed.as_ref().and_then(|pause| pause.precision).unwrap_or(solver.problem.precision);
        let now = level.trial(0.0, precision);
        level.accept(0.0);
        let untouched = resumed.is_none();
        let fresh = Pause {
            pressure,
            iterations: *iterations,
            pairs: 0.0,
            earlier_pairs: 0.0,
            smoothing: SMOOTHING,
            careful: false,
            precision: None,
            last: 0.0,
            phase: None,
            cycle: None,
            progress: ConvergenceMonitor::new(),
        };
        let Pause { smoothing, careful, last, phase, cycle, progress, iterations: done, pairs, .. } =
            resumed.unwrap_or(fresh);
        *iterations = done;
        level.pairs += pairs;
        Descent {
            solver,
            level,
            load,
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

    /// What residuals are divided by.
    fn scale(&self) -> f64 {
        self.solver.scale(self.load, self.pressure, &self.now.residuals)
    }

    fn residual(&self) -> f64 {
        self.now.residuals.residual / self.scale()
    }

    /// Residual that rounding leaves.
    fn floor(&self) -> f64 {
        self.solver.problem.rounding_floor(self.solver.rms_height, self.scale())
    }

    /// Precision in which the next trial is made.
    fn enough(&self) -> Precision {
        let problem = self.solver.problem;
        let narrow = Problem { precision: Precision::F32, grid: self.level.grid(), ..problem.clone() };
        let floor = narrow.rounding_floor(self.solver.rms_height, self.scale());
        let rough = !L::ACTIVE && !self.careful && self.cycle.is_none() && self.residual() > ROUGH * floor;
        if rough { Precision::F32 } else { problem.precision }
    }

    fn error_estimates(&self) -> ErrorEstimates {
        self.cycle
            .as_ref()
            .map_or_else(ErrorEstimates::default, |c| c.error_estimates(&self.now.residuals, self.pressure))
    }

    /// What may end a solve is seen in the precision that was asked for.
    fn confirm(&mut self) {
        let narrow = self.precision != self.solver.problem.precision;
        let whole = self.cycle.is_some() || self.residual() < NEGLIGIBLE * self.tolerance;
        if narrow && whole && self.now.residuals.meets(self.tolerance, self.scale()) {
            self.precision = self.solver.problem.precision;
            self.now = self.level.trial(self.level.inner.pending, self.precision);
        }
    }

    /// Whether and why there is nothing more to be done.
    fn ended(&mut self, targets: &Targets, error_estimates: &ErrorEstimates) -> Option<Stop> {
        let (scale, residual) = (self.scale(), self.residual());
        let (solver, residuals) = (self.solver, self.now.residuals);
        self.level.last = residuals;
        // Plain steps alone may bring the residual down and leave the long waves, and the mean gap with them, where they are:
        // at 4096² and a residual of 2 % it was 5e-4 off. A start that is good as it is needs no step at all.
        let whole =
            self.cycle.is_some() || std::mem::take(&mut self.untouched) || residual < NEGLIGIBLE * self.tolerance;
        if whole && residuals.meets(self.tolerance, scale) && targets.met(error_estimates) {
            return Some(Stop::Converged);
        }
        if *self.iterations >= solver.problem.max_iterations {
            return Some(Stop::IterationLimit);
        }
        self.known = self.progress.mark();
        let floor = self.floor();
        if let Some(stop) = self.progress.stalled(residual, floor) {
            return Some(stop);
        }
        let separated =
            matches!(self.load, Load::Pressure(_)) && residuals.separated(self.pressure, self.level.body.law.range());
        separated.then_some(Stop::Detached)
    }

    fn takes_plain_step(&self) -> bool {
        self.smoothing > 0 || self.phase.is_some_and(|s| s.is_promising(self.residual(), self.tolerance))
    }

    /// Tells the observer how it goes; keeps the state where that is asked for; true where the observer wants to stop here. Only the
    /// gap is worth a file: with a direction to keep, a few plain steps more cost less.
    fn checkpoint_or_interrupt(&mut self, plain: bool) -> bool {
        let (observer, residual) = (self.solver.observer, self.residual());
        let grid_fraction = self.level.grid().points() as f64 / self.solver.cell.grid.points() as f64;
        let step = Iteration { iteration: *self.iterations, residual, tolerance: self.tolerance, grid_fraction };
        self.stopping |= observer.iteration(step).is_break() || observer.stop_requested();
        let resumable = self.beta == 0.0 || !plain;
        if resumable && (self.stopping || observer.snapshot_due()) {
            self.level.settle();
            let pause = Pause {
                pressure: self.pressure,
                iterations: *self.iterations,
                pairs: self.level.pairs(),
                earlier_pairs: self.solver.earlier_pairs.get(),
                smoothing: self.smoothing,
                careful: self.careful,
                precision: Some(self.precision),
                last: self.last,
                phase: self.phase,
                cycle: self.cycle,
                progress: self.progress.at(&self.known),
            };
            observer.snapshot(SnapshotRef {
                grid: self.level.grid(),
                gap: T::lend(&self.level.gap),
                auxiliary: None,
                progress: serde_json::to_value(pause).expect("plain numbers"),
            });
        }
        resumable && self.stopping
    }

    /// Stiffness of the rigid approach: about the pressure over half the rms height. A flat surface has no such stiffness; any
    /// finite one will do.
    fn mean_stiffness(&self) -> f64 {
        let facing = self.level.window.points() as f64 / self.level.grid().points() as f64;
        let approach = facing * self.scale() / (0.5 * self.solver.rms_height).max(f64::MIN_POSITIVE);
        approach.min(self.stiffest_mode.max(1.0)) + self.level.spring.stiffness
    }

    /// A direction of conjugate gradients in the plain metric, and how far to go along it.
    fn plain_step(&mut self) -> Option<f64> {
        self.smoothing = self.smoothing.saturating_sub(1);
        let (mut slope, mut curvature) = self.level.plain(self.beta);
        if slope >= 0.0 {
            (slope, curvature) = self.level.plain(0.0);
        }
        let stiffest = self.stiffest_mode + self.level.body.law.max_slope_at_pressure(4.0 * self.pressure.max(0.25));
        // Along the rigid approach there is no curvature but rounding's, from which no length follows.
        let flat = curvature <= FLAT * stiffest * slope.abs();
        Some(match flat {
            _ if self.careful => 1.0 / stiffest,
            false => -slope / curvature,
            true if L::HARD => 1.0 / stiffest,
            true => (1.0 / self.mean_stiffness()).max(1.0 / stiffest),
        })
    }

    /// The step of Newton's method on the free set. None where it was stopped half-way and given up: what follows it is the
    /// state before it, whose gradient is made again.
    fn newton_step(&mut self) -> Option<f64> {
        let residual = self.residual();
        // Forcing term after Eisenstat & Walker: as exact as the last step was successful, and no more than the end needs. The
        // first knows least: 0.02 there costs a third more pairs in all than 0.3.
        let finest = FINEST[usize::from(L::ACTIVE)];
        let enough = (0.25 * self.tolerance / residual).min(ROUGHEST);
        let forcing = (residual / self.last).powi(2).clamp(finest, ROUGHEST).max(enough);
        let accuracy = (self.mean_stiffness(), forcing, INNER_LIMIT);
        let (pairs, observer) = (self.level.pairs(), self.solver.observer);
        let Some(excess) = self.level.newton(accuracy, &|| observer.stop_requested()) else {
            self.level.inner.step.fill(0.0);
            self.now = self.level.trial(0.0, self.precision);
            self.progress = self.progress.at(&self.known);
            *self.iterations -= 1;
            return None;
        };
        self.phase = Some(SmoothingPhase { newton: self.level.pairs() - pairs, first: None, plain: 0 });
        self.cycle = Some(Cycle { before: self.now.residuals, excess });
        self.smoothing = SMOOTHING_AFTER_NEWTON;
        self.last = residual;
        Some(1.0)
    }

    /// Goes along the direction as far as the energy falls. A stop where not even the gradient descends.
    fn advance(&mut self, mut length: f64, plain: bool, precision: Precision) -> Option<Stop> {
        let (pressure, residuals, old_rr) = (self.pressure, self.now.residuals, self.now.rr);
        let energy = residuals.energy(pressure);
        let epsilon = precision.epsilon().max(self.precision.epsilon());
        let noise = 64.0 * epsilon * residuals.magnitude(pressure);
        // Near the end the energy no longer tells two states apart, but the residual still does.
        let blind = ENERGY_DIGITS * residuals.magnitude(pressure);
        let rises = |next: &Trial| {
            let rise = next.residuals.energy(pressure) - energy;
            rise > noise && !(next.rr < old_rr && rise < blind)
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
        self.level.accept(length);
        (self.now, self.precision) = (next, precision);
        None
    }
}
