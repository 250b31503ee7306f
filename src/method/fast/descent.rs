//! Iterations on one grid.

use super::level::{Level, Trial};
use super::{Ended, Solver};
use crate::grid::Real;
use crate::interface::{Kernel, Law};
use crate::method::operator::{Balance, Progress};
use crate::method::{Goals, Iteration, Load, Problem, Settled, Stop};

/// Plain steps after an interpolation, after a Newton step (whose change of the free set leaves its error at contact lines,
/// too: with two, 52 pairs instead of 68 bring 2048² to 1e-3 of the pressure), and after a failed line search.
const SMOOTHING: usize = 4;
const SMOOTHING_AFTER_NEWTON: usize = 2;
const FALLBACK: usize = 10;

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

/// Iterations of one linear problem.
const INNER_LIMIT: usize = 40;

/// Fall of the residual over a cycle at and above which it says nothing about what is to come.
const SLOWEST_RATE: f64 = 0.9;

/// The state before the last Newton step, and the energy that step had in reach.
struct Cycle {
    before: Balance,
    excess: f64,
}

impl Cycle {
    /// What is still to come, if the next changes shrink as the residual did over the last cycle: a geometric series. The
    /// energy above the minimum, quadratic in the error, falls faster than the residual; that it has fallen as much is
    /// safe to say.
    fn settled(&self, now: &Balance, pressure: f64) -> Settled {
        let rate = (now.residual / self.before.residual).min(SLOWEST_RATE);
        let rest = |now: f64, then: f64| (now - then).abs() / now.abs().max(f64::MIN_POSITIVE) * rate / (1.0 - rate);
        Settled {
            energy: Some(0.5 * self.excess * rate / now.energy(pressure).abs().max(f64::MIN_POSITIVE)),
            area: Some(rest(now.contact, self.before.contact)),
            mean_gap: Some(rest(now.mean_gap, self.before.mean_gap)),
        }
    }
}

impl<T: Real, K: Kernel, L: Law> Solver<'_, T, K, L> {
    /// Iterates on one grid until tolerance and goals are met.
    pub(super) fn improve(
        &self,
        level: &mut Level<T, K, L>,
        (load, tolerance, goals): (Load, f64, Goals),
        iterations: &mut usize,
    ) -> Ended {
        let problem = self.problem;
        let pressure = level.pressure;
        let law = level.body.law;
        let stiffest_mode = Problem { grid: level.grid(), ..problem.clone() }.stiffest_mode();
        let mut progress = Progress::new();
        level.inner.step.fill(0.0);
        let mut now = level.trial(0.0);
        level.accept(0.0);
        let (mut smoothing, mut beta, mut last) = (SMOOTHING, 0.0, 0.0);
        let mut cycle: Option<Cycle> = None;
        // Set by a failed plain step: the next is a gradient step of safe length, shortened as far as it takes.
        let mut careful = false;
        let (stop, settled) = loop {
            let scale = self.scale(load, pressure, &now.balance);
            let residual = now.balance.residual / scale;
            let settled = cycle.as_ref().map_or_else(Settled::default, |c| c.settled(&now.balance, pressure));
            level.last = now.balance;
            if now.balance.meets(tolerance, scale) && goals.met(&settled) {
                break (Stop::Converged, settled);
            }
            if *iterations >= problem.max_iterations {
                break (Stop::IterationLimit, settled);
            }
            let floor = problem.rounding_floor(self.rms_height, scale);
            if let Some(stop) = progress.stalled(residual, floor) {
                break (stop, settled);
            }
            if now.balance.parted(pressure, law.range()) {
                break (Stop::Detached, settled);
            }
            if self.watch.iteration(Iteration { iteration: *iterations, residual, tolerance }).is_break() {
                break (Stop::Interrupted, settled);
            }
            *iterations += 1;
            // The rigid approach is about as stiff as the pressure over half the rms height. A flat surface has no such
            // stiffness; any finite one will do.
            let approach = scale / (0.5 * self.rms_height).max(f64::MIN_POSITIVE);
            let mean = approach.min(stiffest_mode.max(1.0)) + level.spring.stiffness;
            let plain = smoothing > 0;
            let mut length = if plain {
                smoothing -= 1;
                let (mut slope, mut curvature) = level.plain(beta);
                if slope >= 0.0 {
                    (slope, curvature) = level.plain(0.0);
                }
                let stiffest = stiffest_mode + law.stiffest(4.0 * pressure.max(0.25));
                // Along the rigid approach there is no curvature but rounding's, from which no length follows.
                let flat = curvature <= FLAT * stiffest * slope.abs();
                match flat {
                    _ if careful => 1.0 / stiffest,
                    false => -slope / curvature,
                    true if L::HARD => 1.0 / stiffest,
                    true => (1.0 / mean).max(1.0 / stiffest),
                }
            } else {
                // Forcing term after Eisenstat & Walker: as exact as the last step was successful, and no more than the end
                // needs. The first knows least: 0.02 there costs a third more pairs in all than 0.3.
                let forcing = (residual / last).powi(2).clamp(0.02, 0.3).max((0.25 * tolerance / residual).min(0.3));
                cycle = Some(Cycle { before: now.balance, excess: level.newton((mean, forcing, INNER_LIMIT)) });
                smoothing = SMOOTHING_AFTER_NEWTON;
                last = residual;
                1.0
            };
            let energy = now.balance.energy(pressure);
            let noise = 64.0 * problem.precision.epsilon() * now.balance.magnitude(pressure);
            let old_rr = now.rr;
            // Near the end the energy no longer tells two states apart, but the residual still does.
            let blind = ENERGY_DIGITS * now.balance.magnitude(pressure);
            let rises = |next: &Trial| {
                let rise = next.balance.energy(pressure) - energy;
                rise > noise && !(next.rr < old_rr && rise < blind)
            };
            let mut next = level.trial(length);
            let mut tries = 0;
            let shortenings = if careful { CAREFUL_SHORTENINGS } else { SHORTENINGS };
            while rises(&next) && tries < shortenings {
                length *= SHORTER;
                next = level.trial(length);
                tries += 1;
            }
            if rises(&next) {
                if careful {
                    // Not even the gradient descends.
                    level.trial(0.0);
                    let stop = if residual <= 10.0 * floor { Stop::RoundingFloor } else { Stop::NoDescent };
                    break (stop, settled);
                }
                (smoothing, careful) = (FALLBACK, plain);
                (beta, length) = (0.0, 0.0);
                next = level.trial(0.0);
            } else {
                careful = false;
                beta = if plain && tries == 0 { ((next.rr - next.rr_old) / old_rr).max(0.0) } else { 0.0 };
            }
            level.accept(length);
            now = next;
        };
        Ended { stop, settled }
    }
}
