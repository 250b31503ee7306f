//! Common parts of the iteration loops of the field solvers: stop criteria and their order, reports to the observer,
//! snapshots, and the final state.

use super::equilibrium_check::{Ending, EquilibriumCheck, equilibrium_check};
use super::residuals::Residuals;
use super::{Equilibrium, ErrorEstimates, Iteration, Load, Observer, ReducedProblem, SnapshotRef, Stop};
use asperity_grid::Real;
use asperity_grid::sys::ranks::ALONE;
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Result of a load, from which the [`Equilibrium`] is made.
pub struct LoadSolution<'p> {
    pub load: Load,
    /// Mean pressure, E*.
    pub pressure: f64,
    pub check: EquilibriumCheck<'p>,
    pub ending: Ending,
    pub iterations: usize,
    /// Transform pairs of this load.
    pub fft_pairs: f64,
    pub clock: Instant,
    pub residuals: Residuals,
    pub error_estimates: ErrorEstimates,
}

impl<'p> LoadSolution<'p> {
    /// State with gap and interfacial stress `[ny, nx]`, and the stop reason of the check.
    pub fn state<'a, T: Real>(self, gap: &'a [T], stress: &'a [T]) -> Equilibrium<'a>
    where
        'p: 'a,
    {
        let LoadSolution { load, pressure, check, residuals, .. } = self;
        let EquilibriumCheck { scale, rms_height, .. } = check;
        let balance = residuals.imbalance.abs() / scale;
        let mut state = Equilibrium {
            load,
            pressure,
            error_estimates: self.error_estimates,
            ranks: check.ranks,
            gap: T::lend(gap),
            stress: T::lend(stress),
            mean_gap: residuals.mean_gap,
            separation: residuals.mean_separation,
            stiffness: None,
            energy: residuals.energy(pressure),
            elastic_energy: residuals.elastic,
            interaction_energy: residuals.interaction,
            load_error: match load {
                Load::Pressure(_) => balance,
                // Not `f64::max`, which drops a NaN.
                Load::MeanGap(target) => {
                    let miss = (residuals.mean_gap - target).abs() / check.gap_scale(target);
                    if miss > balance || miss.is_nan() { miss } else { balance }
                }
            },
            residual: residuals.residual / scale,
            // A flat surface has neither height nor gap; the smallest positive number avoids 0/0.
            plastic: None,
            plasticity: None,
            complementarity: residuals.complementarity / (scale * rms_height.max(f64::MIN_POSITIVE)),
            stop: Stop::Interrupted,
            iterations: self.iterations,
            fft_pairs: self.fft_pairs,
            seconds: 0.0,
        };
        state.stop = check.decide(self.ending, &state, gap, stress);
        state.seconds = self.clock.elapsed().as_secs_f64();
        state
    }
}

/// Load and scales of one solve.
#[derive(Debug, Clone, Copy)]
pub struct LoadCase {
    /// Mean pressure, E*.
    pub pressure: f64,
    /// Range of the attraction, L; 0 without adhesion.
    pub range: f64,
    /// rms height of the surface, L.
    pub rms_height: f64,
    /// Gaps are not negative.
    pub hard: bool,
}

/// Counts the iterations of a solve and decides when it stops.
pub struct IterationControl<'o, 'p> {
    problem: &'p ReducedProblem<'p>,
    observer: &'o dyn Observer,
    case: LoadCase,
    /// Stress by which residuals are divided, E*.
    pub scale: f64,
    /// Relative residual due to rounding.
    pub floor: f64,
    /// Whether an iteration that no longer improves near its rounding ends.
    stalls: bool,
    clock: Instant,
    pub iterations: usize,
    pub monitor: ConvergenceMonitor,
    /// The monitor before the present iteration.
    before: MonitorMark,
    pub error_estimates: ErrorEstimates,
}

impl<'o, 'p> IterationControl<'o, 'p> {
    pub fn new(problem: &'p ReducedProblem<'p>, observer: &'o dyn Observer, case: LoadCase) -> Self {
        let monitor = ConvergenceMonitor::default();
        let floor = problem.rounding_floor(case.rms_height, case.pressure);
        IterationControl {
            problem,
            observer,
            case,
            scale: problem.stress_scale(case.rms_height, case.pressure),
            floor,
            stalls: true,
            clock: Instant::now(),
            iterations: 0,
            before: monitor.mark(),
            monitor,
            error_estimates: ErrorEstimates::default(),
        }
    }

    /// Without the stall criterion, for a method whose line search detects the rounding floor itself.
    pub fn without_stall_limit(self) -> Self {
        IterationControl { stalls: false, ..self }
    }

    /// Continues the iteration of a snapshot.
    pub fn resume(&mut self, iterations: usize, monitor: ConvergenceMonitor) {
        (self.iterations, self.monitor) = (iterations, monitor);
    }

    /// Continues with an attraction of another range.
    pub fn set_range(&mut self, range: f64) {
        self.case.range = range;
    }

    /// Residual over the stress scale.
    pub fn relative(&self, residuals: &Residuals) -> f64 {
        residuals.residual / self.scale
    }

    /// Records the state of this iteration.
    pub fn record(&mut self, residuals: &Residuals) {
        self.before = self.monitor.mark();
        self.error_estimates = self.monitor.error_estimates(residuals);
    }

    /// The monitor as it was before the present iteration was recorded.
    pub fn monitor_before(&self) -> ConvergenceMonitor {
        self.monitor.at(&self.before)
    }

    /// Whether tolerance and load balance are met.
    pub fn converged(&self, residuals: &Residuals) -> bool {
        residuals.meets(self.problem.tolerance, self.scale)
    }

    /// Whether a tensile load has separated the surfaces.
    pub fn separated(&self, residuals: &Residuals) -> bool {
        residuals.separated(self.case.pressure, self.case.range)
    }

    /// Stop reason of a state that has not converged: iteration limit, divergence or rounding floor, separation.
    pub fn failed(&mut self, residuals: &Residuals) -> Option<Ending> {
        if self.iterations >= self.problem.max_iterations {
            return Some(Ending::Stopped(Stop::IterationLimit));
        }
        let LoadCase { pressure, rms_height, .. } = self.case;
        let floor = if self.stalls { self.problem.stall_floor(rms_height, residuals.mean_gap, pressure) } else { 0.0 };
        let stalled = self.monitor.stalled(self.relative(residuals), floor, self.problem.tolerance);
        stalled.or_else(|| self.separated(residuals).then_some(Stop::Detached)).map(Ending::Stopped)
    }

    /// Records a state and returns how the iteration ends there, if it does.
    pub fn ended(&mut self, residuals: &Residuals) -> Option<Ending> {
        self.record(residuals);
        if self.converged(residuals) { Some(Ending::Met) } else { self.failed(residuals) }
    }

    fn report(&self, residuals: &Residuals) -> Iteration {
        Iteration {
            iteration: self.iterations,
            residual: self.relative(residuals),
            tolerance: self.problem.tolerance,
            grid_fraction: 1.0,
        }
    }

    /// Reports the iteration. True where the observer stops the solve.
    pub fn interrupted(&self, residuals: &Residuals) -> bool {
        self.observer.stop_requested() || self.observer.iteration(self.report(residuals)).is_break()
    }

    /// Reports the iteration and, if the observer requests a snapshot or stops the solve, passes on the two fields
    /// and the `progress` from which [`SolverRun::resume`](super::SolverRun::resume) continues. True if the observer stops the
    /// solve.
    pub fn checkpoint_or_interrupt<T: Real, P: Serialize>(
        &self,
        residuals: &Residuals,
        (gap, auxiliary): (&[T], &[T]),
        progress: impl FnOnce(&Self) -> P,
    ) -> bool {
        let stop = self.observer.iteration(self.report(residuals)).is_break();
        if stop || self.observer.snapshot_due() {
            self.observer.snapshot(SnapshotRef {
                grid: self.problem.grid,
                ranks: &ALONE,
                gap: T::lend(gap),
                auxiliary: Some(T::lend(auxiliary)),
                plastic: None,
                progress: serde_json::to_value(progress(self)).expect("plain numbers"),
            });
        }
        stop
    }

    /// Result after `fft_pairs` transform pairs.
    pub fn finish(self, ending: Ending, residuals: Residuals, fft_pairs: f64) -> LoadSolution<'p> {
        let LoadCase { pressure, rms_height, hard, .. } = self.case;
        LoadSolution {
            load: Load::Pressure(pressure),
            pressure,
            check: equilibrium_check(self.problem, hard, rms_height, self.scale),
            ending,
            iterations: self.iterations,
            fft_pairs,
            clock: self.clock,
            residuals,
            error_estimates: self.error_estimates,
        }
    }
}

/// Change from `then` over the value now; `None` for a change to zero, as of the mean gap at full contact.
pub fn relative_change(now: f64, then: f64) -> Option<f64> {
    if now == then { Some(0.0) } else { (now != 0.0).then(|| ((now - then) / now).abs()) }
}

/// Detects that the residual has stalled, and estimates how much area and mean gap still change.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct ConvergenceMonitor {
    /// Lowest residual so far; `None` before the first iteration.
    best: Option<f64>,
    since: usize,
    /// Contact fraction and mean gap of every iteration.
    history: Vec<(f64, f64)>,
}

/// A point in the history of a [`ConvergenceMonitor`].
#[derive(Debug, Clone, Copy)]
pub struct MonitorMark {
    best: Option<f64>,
    since: usize,
    len: usize,
}

impl ConvergenceMonitor {
    /// Iterations without an improvement by a tenth after which a residual at the rounding floor is final.
    const PATIENCE: usize = 100;
    /// The same far above that floor, where the tolerance is hardly above it: an estimate of rounding may be too small. Half a minute and
    /// 50 000 iterations of a patch that is not periodic, with a terrace under p* = 1e-9, stayed at 400 times the floor.
    const LONG_PATIENCE: usize = 2000;
    /// Iterations needed for an estimate.
    const FEWEST: usize = 10;

    /// The present point in the history.
    pub fn mark(&self) -> MonitorMark {
        MonitorMark { best: self.best, since: self.since, len: self.history.len() }
    }

    /// The monitor as it was at a mark.
    pub fn at(&self, mark: &MonitorMark) -> ConvergenceMonitor {
        ConvergenceMonitor { best: mark.best, since: mark.since, history: self.history[..mark.len].to_vec() }
    }

    /// Records a state and compares it with that of a fifth of the iterations ago.
    pub fn error_estimates(&mut self, residuals: &Residuals) -> ErrorEstimates {
        self.history.push((residuals.contact, residuals.mean_gap));
        let previous = self.history[4 * (self.history.len() - 1) / 5];
        let enough = self.history.len() >= Self::FEWEST;
        let drift = |now: f64, then: f64| relative_change(now, then).filter(|_| enough);
        ErrorEstimates { area: drift(residuals.contact, previous.0), mean_gap: drift(residuals.mean_gap, previous.1) }
    }

    /// Stop reason if `residual` (over the pressure) is not finite, or has stalled below ten times `floor`, or for long with a `tolerance`
    /// below that.
    pub fn stalled(&mut self, residual: f64, floor: f64, tolerance: f64) -> Option<Stop> {
        if !residual.is_finite() {
            return Some(Stop::Diverged);
        }
        let best = self.best.unwrap_or(f64::INFINITY);
        if residual < 0.9 * best {
            (self.best, self.since) = (Some(residual), 0);
        } else {
            self.since += 1;
        }
        let patience = if best < 10.0 * floor { Self::PATIENCE } else { Self::LONG_PATIENCE };
        (self.since > patience && best.min(tolerance) < 10.0 * floor).then_some(Stop::RoundingFloor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mean gap of zero has no relative change, at full contact from a gap before it.
    #[test]
    fn a_change_to_zero_has_no_ratio() {
        assert_eq!(
            [(0.0, 1e-9), (0.0, 0.0), (2.0, 1.0)].map(|(now, then)| relative_change(now, then)),
            [None, Some(0.0), Some(0.5)]
        );
        assert!(relative_change(f64::NAN, 1.0).is_some_and(f64::is_nan));
    }
}
