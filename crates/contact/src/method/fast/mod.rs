//! The default field method: nested iteration with projected Newton steps whose linear problems are solved in f32.
//!
//! The problem is solved on grids from coarse to fine, each starting from the Fourier interpolation of the
//! displacement on the previous one. The interpolation error is concentrated at contact lines, in the shortest waves,
//! and is removed by a few conjugate-gradient steps in the plain metric (smoothing). The remaining error is global
//! and is reduced by Newton steps on the free set. Their linear problems are preconditioned by the inverse stiffness
//! in Fourier space, restricted to the free set on both sides; a restriction on one side would have another fixed
//! point. With adhesion the range is adapted to each grid, so that no grid pins contact lines.

mod column;
mod contact_stress;
mod descent;
mod dual;
mod fields;
mod flow;
mod gpu;
mod host;
mod level;
mod mean_gap;
mod method;
mod nested;
mod rows;
mod shared;
pub(super) mod tangent;
mod window;

use super::equilibrium_check::{Ending, EquilibriumCheck, equilibrium_check};
use super::iteration::LoadSolution;
use super::plastic::PlasticFlow;
use super::require::{self, refused};
use super::residuals::Residuals;
use super::sweep;
use super::{Equilibrium, ErrorEstimates, Load, Machine, Observer, ReducedProblem, SolverRun, SolverSnapshot, Stop};
use crate::interface::Law;
use asperity_grid::{Error, Result};
use asperity_grid::{Grid, Real, Series, mean};
use descent::{DescentSnapshot, Ended, GapSearch, Task};
use fields::Spring;
use gpu::GpuLevels;
use host::LevelProblem;
use level::{Level, TANGENT_ACCURACY, TANGENT_BOUND};
use shared::{Agreed, agreed, own_nodes};
use std::cell::OnceCell;
use std::time::Instant;
use window::{ComputationCell, Window};

pub struct Fast;

/// Of the card, and in errors.
const ID: &str = "fast";

/// Imbalance over the tolerance of the load balance above which the pressure of an imposed mean gap is taken from the
/// final fields: the force of the spring contains the rounding error of the mean gap times a stiffness. Near separation
/// it reached 1.5 of the tolerance on 512².
const MULTIPLIER: f64 = 0.1;

/// Stiffness of the mean-gap control over that of the stiffest mode of the grid: far above the contact stiffness, so
/// that few corrections of the pressure suffice, and no stiffer than modes that the solver handles anyway.
const SPRING: f64 = 0.25;

/// Largest residual over the pressure at which rounding on a padded cell counts as convergence: far below the
/// discretisation error of any contact.
const ROUNDED: f64 = 1e-5;

/// Margin of the rounding error of a padded cell: the residual of a sphere on 128² under 1e-6 E* stalls at the bare
/// estimate.
const ROUNDING_MARGIN: f64 = 3.0;

impl<'p, T: Real, L: Law> FastRun<'p, T, L> {
    fn new(problem: &'p ReducedProblem<'p>, observer: &'p dyn Observer, law: L) -> Result<Self> {
        let mut cell = ComputationCell::of(problem);
        let (heights, rms_height) = Self::heights_of(problem, &mut cell, &PlasticFlow::default());
        let (gap, stress) = (Vec::new(), Vec::new());
        Ok(FastRun {
            gpu: GpuLevels::open(problem)?,
            problem,
            cell,
            observer: Agreed { observer, ranks: problem.ranks },
            law,
            heights,
            rms_height,
            lent: Default::default(),
            pressure: 0.0,
            gap,
            stress,
            earlier_pairs: std::cell::Cell::new(0.0),
            first_touch: OnceCell::new(),
            flow: PlasticFlow::default(),
            resumed: None,
        })
    }
}

struct FastRun<'p, T: Real, L> {
    problem: &'p ReducedProblem<'p>,
    cell: ComputationCell,
    observer: Agreed<'p>,
    gpu: Option<GpuLevels>,
    law: L,
    heights: Series<T>,
    rms_height: f64,
    /// Gap and stress of the last state on the facing nodes of a padded cell.
    lent: (Vec<T>, Vec<T>),
    /// Pressure of the last load, the initial value of the next one under mean-gap control.
    pressure: f64,
    /// Gap of the last load; empty before the first.
    gap: Vec<T>,
    stress: Vec<T>,
    /// Transform pairs of the coarser grids, in pairs of the problem's grid.
    earlier_pairs: std::cell::Cell<f64>,
    /// Mean gap at first contact, computed when a mean gap is imposed.
    first_touch: OnceCell<f64>,
    /// Flow of the finished loads, contained in the heights.
    flow: PlasticFlow<T>,
    /// State of a snapshot: grid, gap and iteration.
    resumed: Option<(Grid, Vec<T>, DescentSnapshot)>,
}

impl<'p, T: Real, L: Law> FastRun<'p, T, L> {
    /// The law on a grid of the cell, with what a coarser one resolves.
    fn law_on(&self, grid: Grid) -> L {
        if grid == self.cell.grid {
            return self.law;
        }
        let Window { nx, ny } = self.cell.window(grid);
        self.law.on_mesh(grid.dx().max(grid.dy())).on_nodes(nx, ny)
    }

    fn body(&self, grid: Grid) -> LevelProblem<'_, T, L> {
        let ReducedProblem { kernel, ranks, .. } = self.problem;
        let (law, window) = (self.law_on(grid), self.cell.window(grid));
        LevelProblem { kernel: *kernel, law, heights: &self.heights, window, ranks }
    }

    fn at_first_contact(&self, grid: Grid) -> Level<'_, T, L> {
        Level::at_first_contact(grid, self.body(grid), self.cell, self.gpu.as_ref())
    }

    /// Tolerance of the residual. On a padded cell at least the rounding error of its free surface, which under light
    /// loads exceeds the problem's tolerance, up to [`ROUNDED`].
    fn tolerance(&self, load: Load) -> f64 {
        self.problem.tolerance.max(self.rounding(load).min(ROUNDED))
    }

    /// Rounding error of the residual by the free surface of a padded cell, else 0.
    fn rounding(&self, load: Load) -> f64 {
        let Load::Pressure(p) = load else { return 0.0 };
        let facing = self.cell.window(self.cell.grid).points() as f64;
        // The residual counts the nodes of the cell per facing node.
        let nodes = (self.cell.grid.points() as f64 / facing).sqrt();
        match self.cell.is_padded() {
            true => ROUNDING_MARGIN * nodes * self.problem.rounding_floor(self.rms_height, p),
            false => 0.0,
        }
    }

    fn task(&self, load: Load) -> Task<'_> {
        Task {
            problem: self.problem,
            plastic: self.flow.lend(),
            observer: &self.observer,
            load,
            rms_height: self.rms_height,
            range: self.law.range(),
            points: self.cell.grid.points(),
            earlier_pairs: self.earlier_pairs.get(),
            search: GapSearch::default(),
            pulled: false,
        }
    }

    /// Facing nodes over all of the cell.
    fn facing_share(&self) -> f64 {
        self.cell.window(self.cell.grid).points() as f64 / self.cell.grid.points() as f64
    }

    /// Stiffness of the spring that controls the mean gap on a grid.
    fn spring(&self, grid: Grid) -> f64 {
        SPRING * ReducedProblem { grid, ..self.problem.clone() }.stiffest_mode()
    }

    fn set_load(&self, level: &mut Level<T, L>, load: Load) {
        match load {
            Load::Pressure(p) => level.pressure = p,
            Load::MeanGap(target) => {
                level.pressure = self.pressure;
                level.spring = Spring { stiffness: self.spring(level.grid()), target };
            }
        }
    }

    /// The state and its ending at a load without adhesion at which no contact pressure acts.
    fn without_contact(&self, load: Load) -> Option<(Level<'_, T, L>, Ending)> {
        let untouched = || {
            self.earlier_pairs.set(0.0);
            self.at_first_contact(self.cell.grid)
        };
        match load {
            _ if self.law.range() > 0.0 => None,
            // First contact at zero pressure, separation under tension.
            Load::Pressure(p) if p <= 0.0 => {
                let mut level = untouched();
                level.pressure = p;
                Some((level, if p < 0.0 { Ending::Stopped(Stop::Detached) } else { Ending::Met }))
            }
            // Mean gaps at or beyond first contact; a law that acts at open gaps is solved.
            Load::MeanGap(target) if self.law.cutoff() <= 0.0 => {
                let touch = *self.first_touch.get_or_init(|| mean(untouched().gap()));
                // Means of nodes and of the series through them differ by rounding, measured up to 10 epsilon.
                let (difference, rounding) = (target - touch, 64.0 * T::epsilon().wide() * touch);
                (difference >= -rounding).then(|| {
                    let mut level = untouched();
                    sweep::shift(level.gap_mut(), T::of(if difference > rounding { difference } else { 0.0 }));
                    (level, Ending::Met)
                })
            }
            _ => None,
        }
    }

    /// Residuals and interfacial stress of a level. Under mean-gap control the pressure becomes the one that balances the
    /// stress on open nodes; in a machine, whose force it is, only where the imbalance exceeds the tolerance.
    fn balanced(&self, level: &mut Level<T, L>, (load, pulled): (Load, Option<f64>)) -> (Residuals, Vec<T>) {
        let (residuals, stress) = level.stress();
        // Behind a soft wall no node is closed.
        let open = if L::HARD { 1.0 - residuals.contact } else { 1.0 };
        let scale = self.task(load).scale(level.pressure, &residuals);
        let allowed = match pulled {
            Some(tolerance) => EquilibriumCheck::load_tolerance(tolerance) * scale,
            None => MULTIPLIER * EquilibriumCheck::load_tolerance(self.tolerance(load)) * scale,
        };
        let kept = matches!(load, Load::Pressure(_)) || self.cell.is_padded() || open == 0.0;
        if kept || residuals.imbalance.abs() <= allowed {
            return (residuals, stress);
        }
        drop(stress);
        level.pressure -= residuals.imbalance / open;
        level.stress()
    }
}

impl<T: Real, L: Law> SolverRun for FastRun<'_, T, L> {
    fn resume(&mut self, snapshot: SolverSnapshot) -> Result<()> {
        if let Some(displacement) = &snapshot.plastic {
            self.set_plastic_displacement(displacement);
        }
        // A snapshot may be of a coarser grid of the same cell.
        let grid = Grid { nx: snapshot.grid.nx, ny: snapshot.grid.ny, ..self.cell.grid };
        let own = own_nodes(self.problem.ranks, grid);
        let (gap, pause) = snapshot.restore_rows(grid, own.len() / grid.nx, ID)?;
        self.resumed = Some((grid, gap.into_iter().map(T::of).collect(), pause));
        Ok(())
    }

    fn set_plastic_displacement(&mut self, displacement: &[f64]) {
        self.flow.set(displacement);
        self.displace();
    }

    fn set_gap(&mut self, gap: &[f64]) {
        let narrow = |gap: &[f64]| gap.iter().map(|&g| T::of(g)).collect();
        let own = own_nodes(self.problem.ranks, self.cell.grid);
        self.gap = if self.cell.is_padded() { narrow(&self.cell.continued(gap)) } else { narrow(&gap[own]) };
    }

    fn machine(&self) -> Option<Machine> {
        if self.problem.ranks.are_several() {
            return None;
        }
        let (facing, spring) = (self.facing_share(), self.spring(self.cell.grid));
        Some(Machine { stiffness: spring / facing, compliance: facing * (1.0 / spring - self.cell.mean_compliance()) })
    }

    fn pull(&mut self, grip: f64, tolerance: f64) -> Result<Equilibrium<'_>> {
        if !L::ACTIVE || self.gap.is_empty() {
            return Err(refused(ID, "pull-off", "no state of adhesive surfaces", "a load before it"));
        }
        // The spring pulls with the tension of the last state and what the distance from its separation adds.
        let last = self.facing_share() * self.pressure / self.spring(self.cell.grid);
        let target = grip + self.cell.mean_height + last;
        // Of a padded cell at least the rounding error.
        let tolerance = if self.cell.is_padded() {
            tolerance.max(self.tolerance(Load::Pressure(self.pressure)))
        } else {
            tolerance
        };
        self.reach(Load::MeanGap(target), Some(tolerance))
    }

    fn equilibrate(&mut self, load: Load) -> Result<Equilibrium<'_>> {
        if let Load::MeanGap(g) = load
            && !(g.is_finite() && (g > 0.0 || g == 0.0 && !L::HARD))
        {
            let accepted = "a positive length; a hard wall allows a zero mean gap only under an imposed pressure";
            return Err(refused(ID, "mean gap", format!("{g:e} L"), accepted));
        }
        if matches!(load, Load::MeanGap(_)) && self.cell.is_padded() {
            return Err(Error::input("method fast", "load", "a mean gap with a non-periodic body", "a pressure"));
        }
        if matches!(load, Load::MeanGap(_)) && self.problem.ranks.are_several() {
            return Err(refused(ID, "load", "a mean gap on several ranks", "a pressure, or one rank"));
        }
        require::below_hardness(load, self.law.max_pressure(), ID)?;
        self.reach(load, None)
    }
}

impl<T: Real, L: Law> FastRun<'_, T, L> {
    /// Solves at a load. `pulled`: the tolerance in a machine, whose spring acts from the mean gap of the load, which is not met, on top
    /// of the last pressure.
    fn reach(&mut self, load: Load, pulled: Option<f64>) -> Result<Equilibrium<'_>> {
        let (clock, problem, before) = (Instant::now(), self.problem, self.pressure);
        (self.stress, self.lent) = Default::default();
        let mut iterations = 0;
        // With adhesion the solve continues on the branch of the load path. Without it the solution is unique, and
        // nested iteration is faster than the start from the last load.
        let warm = L::ACTIVE && !self.takes_stress(load) && !self.gap.is_empty();
        let previous = std::mem::take(&mut self.gap);
        let start = if warm { previous } else { Vec::new() };
        let resumed = self.resumed.take();
        let (mut level, ended) = if let Some((level, ending)) = self.without_contact(load) {
            (level, Ended { ending, error_estimates: ErrorEstimates::default() })
        } else if warm && resumed.is_none() {
            self.earlier_pairs.set(0.0);
            let mut level =
                Level::with_gap(self.cell.grid, self.body(self.cell.grid), self.cell, self.gpu.as_ref(), start);
            self.set_load(&mut level, load);
            level.prepare();
            let ended = match pulled {
                Some(tolerance) => self.pulled(&mut level, load, tolerance, &mut iterations),
                None => self.solve_at(&mut level, load, self.tolerance(load), &mut iterations, None),
            };
            (level, ended)
        } else {
            self.nested(load, &mut iterations, resumed)
        };
        // The pressure now includes the force of the spring.
        level.spring = Spring::default();
        // Before the stress, which takes the place of the working arrays.
        let stiffness = match ended.ending {
            Ending::Met if pulled.is_some() => self.stiffness(&mut level, load, TANGENT_BOUND),
            Ending::Met if problem.stiffness => self.stiffness(&mut level, load, TANGENT_ACCURACY),
            _ => None,
        };
        let (mut residuals, stress) = self.balanced(&mut level, (load, pulled));
        let (gap, fft_pairs, pressure) =
            (std::mem::take(level.gap_mut()), level.fft_pairs + self.earlier_pairs.get(), level.pressure);
        drop(level);
        if let Some(failure) = self.gpu.as_ref().and_then(GpuLevels::failure) {
            return Err(failure);
        }
        let scale = |pressure| self.task(load).scale(pressure, &residuals);
        let scale = if pulled.is_some() { scale(pressure).max(scale(before)) } else { scale(pressure) };
        (self.gap, self.stress, self.pressure) = (gap, stress, pressure);
        let plasticity = self.yielded(&mut residuals, ended.ending == Ending::Met);
        let (gap, stress) = if self.cell.is_padded() {
            let (grid, window) = (self.cell.grid, self.cell.window(self.cell.grid));
            self.lent = (window.cut(&self.gap, grid.nx), window.cut(&self.stress, grid.nx));
            (&self.lent.0, &self.lent.1)
        } else {
            (&self.gap, &self.stress)
        };
        let Ended { ending, error_estimates } = ended;
        let tolerance = pulled.unwrap_or_else(|| self.tolerance(load));
        let load = match pulled {
            Some(_) if residuals.mean_gap != 0.0 && !self.cell.is_padded() => Load::MeanGap(residuals.mean_gap),
            Some(_) => Load::Pressure(pressure),
            None => load,
        };
        let judged = ReducedProblem { tolerance, ..problem.clone() };
        let check = equilibrium_check(&judged, L::HARD, self.rms_height, scale);
        let outcome =
            LoadSolution { load, pressure, check, ending, iterations, fft_pairs, clock, residuals, error_estimates };
        let state = outcome.state(gap, stress);
        let stop = agreed(problem.ranks, state.stop);
        Ok(Equilibrium { plastic: self.flow.lend(), plasticity, stop, stiffness, ..state })
    }
}
