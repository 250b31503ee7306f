//! Solves at an imposed mean gap, and in a machine.

use super::FastRun;
use super::descent::{DescentSnapshot, Ended, GapSearch, Task, iterate};
use super::level::Level;
use crate::interface::Law;
use crate::method::equilibrium_check::{Ending, EquilibriumCheck, equilibrium_check};
use crate::method::{Load, Stop, sweep};
use asperity_grid::{Real, mean};

/// Largest number of pressure corrections on a coarse grid under mean-gap control.
const COARSE_CORRECTIONS: usize = 4;

/// Corrections that do not halve an error at the level of rounding, after which the gap is given its mean, and how often
/// it is.
const STALLED: usize = 3;
const IMPOSED: usize = 50;

impl<T: Real, L: Law> FastRun<'_, T, L> {
    /// Solves at the load. Under mean-gap control the pressure is the multiplier of the constraint: the force of the
    /// spring is added to it until the spring is relaxed (method of multipliers).
    pub(super) fn solve_at(
        &self,
        level: &mut Level<T, L>,
        load: Load,
        tolerance: f64,
        iterations: &mut usize,
        mut pause: Option<DescentSnapshot>,
    ) -> Ended {
        let Load::MeanGap(target) = load else {
            return iterate(&self.task(load), level, tolerance, iterations, pause);
        };
        // The stiffness of the spring depends on the grid.
        let pressure = level.pressure;
        self.set_load(level, load);
        level.pressure = pressure;
        // Where a coarse mesh pins contact lines, no pressure may give this mean gap.
        let coarse = level.grid() != self.cell.grid;
        let mut search = pause.as_ref().map_or_else(GapSearch::default, |pause| pause.search);
        let rounded = EquilibriumCheck::load_tolerance(tolerance) * self.rms_height.max(target.abs());
        let within = if coarse { rounded } else { self.gap_tolerance(target) };
        loop {
            let (pressure, start) = (level.pressure, *iterations);
            let task = Task { search, ..self.task(load) };
            let ended = iterate(&task, level, tolerance, iterations, pause.take());
            let miss = level.last.mean_gap - target;
            level.pressure += level.spring.stiffness * miss;
            search.corrections += 1;
            if ended.ending != Ending::Met || miss.abs() <= within {
                return ended;
            }
            if coarse && search.corrections == COARSE_CORRECTIONS {
                return Ended { ending: Ending::Stopped(Stop::IterationLimit), ..ended };
            }
            if search.imposed > IMPOSED {
                let stop = if miss.abs() <= rounded { Stop::RoundingFloor } else { Stop::IterationLimit };
                return Ended { ending: Ending::Stopped(stop), ..ended };
            }
            let moved = *iterations > start;
            if moved {
                search.note(pressure, miss, level.spring.stiffness);
            }
            if let Some(stiffness) = search.secant {
                level.pressure = pressure + stiffness * miss;
            }
            let hidden = !moved || miss.abs() <= rounded && search.stalled >= STALLED;
            // Adhesion holds closed surfaces until the tension exceeds it.
            let held = self.law.range() > 0.0 && level.last.mean_gap == 0.0;
            if hidden && !coarse && !held {
                (search.imposed, search.stalled) = (search.imposed + 1, 0);
                self.impose(level, target);
            }
        }
    }

    /// Solves under the spring of a machine, whose force becomes part of the pressure.
    pub(super) fn pulled(&self, level: &mut Level<T, L>, load: Load, tolerance: f64, iterations: &mut usize) -> Ended {
        self.set_load(level, load);
        let ended = iterate(&Task { pulled: true, ..self.task(load) }, level, tolerance, iterations, None);
        let (spring, facing) = (level.spring, self.facing_share());
        let mean_gap = level.last.mean_separation + self.cell.mean_mode(level.pressure).1;
        level.pressure += spring.stiffness * (mean_gap - spring.target) / facing;
        ended
    }

    /// Largest error of an imposed mean gap, L.
    pub(super) fn gap_tolerance(&self, target: f64) -> f64 {
        let check = equilibrium_check(self.problem, L::HARD, self.rms_height, 1.0);
        EquilibriumCheck::load_tolerance(self.problem.tolerance) * check.gap_scale(target)
    }

    /// Gives the gap its imposed mean where the residual does not feel the difference: above a hard wall the gap is
    /// scaled, and one that is closed everywhere is opened where the stress is lowest; behind a soft wall it is shifted.
    pub(super) fn impose(&self, level: &mut Level<T, L>, target: f64) {
        let mean_gap = mean(level.gap());
        if !L::HARD {
            let shift = T::of(target - mean_gap);
            sweep::shift(level.gap_mut(), shift);
        } else if mean_gap > 0.0 {
            let factor = T::of(target / mean_gap);
            level.gap_mut().iter_mut().for_each(|g| *g *= factor);
        } else {
            let spring = std::mem::take(&mut level.spring);
            let (_, stress) = level.stress();
            level.spring = spring;
            level.prepare();
            let smallest = (0..stress.len()).min_by(|&i, &j| stress[i].wide().total_cmp(&stress[j].wide()));
            let Some(smallest) = smallest else { return };
            // The lowest pressure of full contact.
            level.pressure -= stress[smallest].wide();
            level.gap_mut()[smallest] = T::of(target * stress.len() as f64);
        }
    }
}
