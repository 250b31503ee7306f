//! Iterations on one grid.

use super::level::{Level, Trial};
use super::{Ended, Solver};
use crate::grid::Real;
use crate::interface::{Kernel, Law};
use crate::method::operator::{Balance, Progress};
use crate::method::{Goals, Iteration, Load, Problem, Settled, Snapshot, Stop};
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

/// Iterations of one linear problem.
const INNER_LIMIT: usize = 40;

/// Fall of the residual over a cycle at and above which it says nothing about what is to come.
const SLOWEST_RATE: f64 = 0.9;

/// The state before the last Newton step, and the energy that step had in reach.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Cycle {
    before: Balance,
    excess: f64,
}

/// What has followed the last Newton step: plain steps, in which contact lines come to rest.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Spell {
    /// Pairs of the Newton step.
    newton: f64,
    /// Residual after it; none before it is known.
    first: Option<f64>,
    plain: i32,
}

impl Spell {
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
    fn settled(&self, now: &Balance, pressure: f64) -> Settled {
        let rate = (now.residual / self.before.residual).min(SLOWEST_RATE);
        let rest = |now: f64, then: f64| {
            (now - then).abs() / now.abs().max(f64::MIN_POSITIVE) * (rate / (1.0 - rate)).max(1.0)
        };
        Settled {
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
    /// Residual before the last Newton step.
    last: f64,
    spell: Option<Spell>,
    cycle: Option<Cycle>,
    progress: Progress,
}

impl<T: Real, K: Kernel, L: Law> Solver<'_, T, K, L> {
    /// Iterates on one grid until tolerance and goals are met.
    pub(super) fn improve(
        &self,
        level: &mut Level<T, K, L>,
        (load, tolerance, goals): (Load, f64, Goals),
        iterations: &mut usize,
        resumed: Option<Pause>,
    ) -> Ended {
        let problem = self.problem;
        let pressure = level.pressure;
        let law = level.body.law;
        let stiffest_mode = Problem { grid: level.grid(), ..problem.clone() }.stiffest_mode();
        // What the last improvement ended with.
        level.settle();
        level.inner.step.fill(0.0);
        let mut now = level.trial(0.0);
        level.accept(0.0);
        let mut untouched = resumed.is_none();
        // `careful` is set by a failed plain step: the next is a gradient step of safe length, shortened as far as it takes.
        let Pause { mut smoothing, mut careful, mut last, mut spell, mut cycle, mut progress, .. } = match resumed {
            Some(pause) => {
                *iterations = pause.iterations;
                level.pairs += pause.pairs;
                pause
            }
            None => Pause {
                pressure,
                iterations: 0,
                pairs: 0.0,
                earlier_pairs: 0.0,
                smoothing: SMOOTHING,
                careful: false,
                last: 0.0,
                spell: None,
                cycle: None,
                progress: Progress::new(),
            },
        };
        let (mut beta, mut stopping) = (0.0, false);
        let share = level.grid().points() as f64 / self.cell.grid.points() as f64;
        let facing = level.window.points() as f64 / level.grid().points() as f64;
        let (stop, settled) = loop {
            let scale = self.scale(load, pressure, &now.balance);
            let residual = now.balance.residual / scale;
            let settled = cycle.as_ref().map_or_else(Settled::default, |c| c.settled(&now.balance, pressure));
            level.last = now.balance;
            // Plain steps alone may bring the residual down and leave the long waves, and the mean gap with them, where they are:
            // at 4096² and a residual of 2 % it was 5e-4 off. A start that is good as it is needs no step at all.
            let whole = cycle.is_some() || std::mem::take(&mut untouched) || residual < NEGLIGIBLE * tolerance;
            if whole && now.balance.meets(tolerance, scale) && goals.met(&settled) {
                break (Stop::Converged, settled);
            }
            if *iterations >= problem.max_iterations {
                break (Stop::IterationLimit, settled);
            }
            let floor = problem.rounding_floor(self.rms_height, scale);
            let known = progress.clone();
            if let Some(stop) = progress.stalled(residual, floor) {
                break (stop, settled);
            }
            if matches!(load, Load::Pressure(_)) && now.balance.parted(pressure, law.range()) {
                break (Stop::Detached, settled);
            }
            stopping |=
                self.watch.iteration(Iteration { iteration: *iterations, residual, tolerance, share }).is_break()
                    || self.watch.stopping();
            let plain = smoothing > 0 || spell.is_some_and(|s| s.is_promising(residual, tolerance));
            // Only the gap is worth a file: with a direction to keep, a few plain steps more cost less.
            let resumable = beta == 0.0 || !plain;
            if resumable && (stopping || self.watch.wants_snapshot()) {
                level.settle();
                let (iterations, earlier_pairs, pairs) = (*iterations, self.earlier_pairs.get(), level.pairs());
                let pause = Pause {
                    pressure,
                    iterations,
                    pairs,
                    earlier_pairs,
                    smoothing,
                    careful,
                    last,
                    spell,
                    cycle,
                    progress: known.clone(),
                };
                self.watch.snapshot(Snapshot {
                    grid: level.grid(),
                    gap: T::lend(&level.gap),
                    progress: serde_json::to_value(pause).expect("plain numbers"),
                });
            }
            if resumable && stopping {
                break (Stop::Interrupted, settled);
            }
            *iterations += 1;
            // The rigid approach is about as stiff as the pressure over half the rms height. A flat surface has no such
            // stiffness; any finite one will do.
            let approach = facing * scale / (0.5 * self.rms_height).max(f64::MIN_POSITIVE);
            let mean = approach.min(stiffest_mode.max(1.0)) + level.spring.stiffness;
            let mut length = if plain {
                smoothing = smoothing.saturating_sub(1);
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
                let accuracy = (mean, forcing, INNER_LIMIT);
                let pairs = level.pairs();
                let Some(excess) = level.newton(accuracy, &|| self.watch.stopping()) else {
                    // The half-done step is given up. What follows it is the state before it, whose gradient must be made again.
                    level.inner.step.fill(0.0);
                    now = level.trial(0.0);
                    progress = known;
                    *iterations -= 1;
                    continue;
                };
                spell = Some(Spell { newton: level.pairs() - pairs, first: None, plain: 0 });
                cycle = Some(Cycle { before: now.balance, excess });
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
                (smoothing, careful, spell) = (FALLBACK, plain, None);
                (beta, length) = (0.0, 0.0);
                next = level.trial(0.0);
            } else {
                careful = false;
                let well = plain && tries == 0;
                beta = if well { ((next.rr - next.rr_old) / old_rr).max(0.0) } else { 0.0 };
                if let Some(spell) = spell.as_mut() {
                    spell.plain += i32::from(plain);
                    spell.first = spell.first.or(Some(next.balance.residual / scale));
                }
            }
            level.accept(length);
            now = next;
        };
        Ended { stop, settled }
    }
}
