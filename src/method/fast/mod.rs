//! The default field method: nested iteration with projected Newton steps whose linear problems are solved in f32.
//!
//! The surface is solved on grids from coarse to fine, each starting from the Fourier interpolation of the displacement
//! found before. What interpolation leaves wrong sits at contact lines, in the shortest waves: a few steps in the plain
//! metric remove it. What remains is global, and is solved for by Newton steps on the free set, with the stiffness
//! inverted in Fourier space as preconditioner, masked on both sides. Masking on one side only would have another fixed
//! point. With adhesion the range follows the mesh from grid to grid, so that no grid pins contact lines.

mod column;
mod descent;
mod inner;
mod level;
mod rows;
mod window;

use super::iteration::Outcome;
use super::operator::{Build, dispatch};
use super::require::refused;
use super::residuals::{LOAD_BALANCE, LOAD_SHARE, Residuals};
use super::{
    Card, CoarseState, ContactMethod, Criterion, ErrorEstimates, Heights, Kind, Load, Needs, Observer, Plan, Precision,
    Problem, Run, SolverSnapshot, Started, State, Stop, Targets,
};
use crate::grid::{Grid, Real, Series, lowest, mean, next_fast_len, rms};
use crate::interface::{HalfSpace, HardWall, Kernel, Law};
use crate::{Error, Result};
use descent::Pause;
use level::{Level, Spring};
use rayon::prelude::*;
use std::cell::OnceCell;
use std::time::Instant;
use window::Cell;

pub struct Fast;

static CARD: Card = Card {
    id: "fast",
    paper_name: "-",
    family: "boundary value",
    kind: Kind::Solver,
    needs: Needs::Heights,
    criterion: Criterion::ZeroGap,
    calibrated_on: None,
    summary: "nested grids, projected Newton steps preconditioned in Fourier space; the default",
    supports: super::card::fields,
    dois: &["10.1007/s11249-017-0900-2"],
    papers: &[],
};

/// Points along a side below which a grid is not halved.
const COARSEST: usize = 64;

/// Residual over the pressure at which a coarse grid is left: a better one leaves the work on the next grid unchanged. With 5e-2 it
/// takes 3 to 13 % fewer pairs in all, but its mean gap is too rough for an estimate of the grid's error, two to three times as
/// large then.
const COARSE_TOLERANCE: f64 = 1e-2;

/// Corrections of the pressure on a coarse grid, under mean-gap control, after which the next grid may do better.
const COARSE_CORRECTIONS: usize = 4;

/// Shares of E* h_rms/L, which is about what flattens the longest waves: a stress below the first is none, one above the
/// second is one.
const NO_STRESS: [f64; 2] = [1e-6, 1e-2];

/// Stiffness that mean-gap control gives the mean gap, over the grid's stiffest mode: far above any contact's, so that few
/// corrections of the pressure bring the mean gap to its target, and no stiffer than what the solver copes with anyway.
const SPRING: f64 = 0.25;

impl ContactMethod for Fast {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn plan(&self, problem: &Problem) -> Plan {
        let grid = Cell::of(problem).grid;
        let (level, real) = match problem.precision {
            Precision::F32 => (Level::<f32, HalfSpace, HardWall>::bytes(grid), size_of::<f32>()),
            Precision::F64 => (Level::<f64, HalfSpace, HardWall>::bytes(grid), size_of::<f64>()),
        };
        // The series, beside the one lent; one through the nodes is as large as a field, and made from a spectrum in f64.
        let series = match problem.heights {
            Heights::Series(s) if grid == problem.grid => s.bytes() / size_of::<f64>() as u64 * real as u64,
            _ => (real * grid.points()) as u64,
        };
        Plan { bytes: level + series, iterations: 20, pairs_per_iteration: 4.0, seconds: 0.0 }
    }

    fn start<'p>(&self, problem: &'p Problem<'p>, observer: &'p dyn Observer) -> Result<Started<'p>> {
        Ok(Started::Solver(dispatch(problem, Start { problem, observer })))
    }
}

struct Start<'p> {
    problem: &'p Problem<'p>,
    observer: &'p dyn Observer,
}

impl<'p> Build<'p> for Start<'p> {
    type Built = Box<dyn Run + 'p>;

    fn build<T: Real, K: Kernel + 'p, L: Law + 'p>(self, kernel: K, law: L) -> Self::Built {
        let Start { problem, observer } = self;
        let mut cell = Cell::of(problem);
        let (heights, rms_height) = match problem.heights {
            heights if cell.is_padded() => {
                let nodes = heights.on_nodes(problem.grid);
                let field = cell.continued(&nodes);
                cell.mean_height = mean(&field) - lowest(&nodes);
                (Series::from_nodes(cell.grid, &field), rms(&nodes))
            }
            Heights::Nodes(nodes) => of_wave(Series::<T>::from_nodes(problem.grid, nodes)),
            Heights::Series(series) => of_wave(series.converted()),
        };
        let (gap, stress) = (Vec::new(), Vec::new());
        Box::new(Solver {
            problem,
            cell,
            observer,
            kernel,
            law,
            heights,
            rms_height,
            patch: Default::default(),
            pressure: 0.0,
            gap,
            stress,
            earlier_pairs: std::cell::Cell::new(0.0),
            first_touch: OnceCell::new(),
            resumed: None,
        })
    }
}

/// A series with its rms.
fn of_wave<T: Real>(series: Series<T>) -> (Series<T>, f64) {
    let rms = series.rms();
    (series, rms)
}

struct Solver<'p, T: Real, K, L> {
    problem: &'p Problem<'p>,
    cell: Cell,
    observer: &'p dyn Observer,
    kernel: K,
    law: L,
    heights: Series<T>,
    rms_height: f64,
    /// Gap and stress on the patch, where the cell is padded.
    patch: (Vec<T>, Vec<T>),
    /// Pressure of the last load: under mean-gap control, where the next one starts from.
    pressure: f64,
    /// Gap of the last load; empty before the first.
    gap: Vec<T>,
    stress: Vec<T>,
    /// Pairs that the grids below the one at work have taken, in pairs of the problem's.
    earlier_pairs: std::cell::Cell<f64>,
    /// Mean gap of bodies that just touch, once a mean gap has been asked for.
    first_touch: OnceCell<f64>,
    /// A state to go on from: its grid, gap and descent.
    resumed: Option<(Grid, Vec<T>, Pause)>,
}

/// How a grid was left.
struct Ended {
    stop: Stop,
    error_estimates: ErrorEstimates,
}

/// The grid below: half the points along every side longer than the coarsest, rounded up to a size that transforms fast.
fn coarser(grid: Grid) -> Option<Grid> {
    let half = |n: usize| if n >= 2 * COARSEST { next_fast_len(n.div_ceil(2)) } else { n };
    let coarse = Grid { nx: half(grid.nx), ny: half(grid.ny), ..grid };
    (coarse.points() < grid.points()).then_some(coarse)
}

impl<T: Real, K: Kernel, L: Law> Solver<'_, T, K, L> {
    /// From the coarsest grid up, or from where a solve was left.
    fn nested(
        &self,
        load: Load,
        iterations: &mut usize,
        resumed: Option<(Grid, Vec<T>, Pause)>,
    ) -> (Level<'_, T, K, L>, Ended) {
        let problem = self.problem;
        let mut grids = vec![self.cell.grid];
        while let Some(next) = coarser(grids[grids.len() - 1]) {
            grids.push(next);
        }
        let law = |grid: Grid, law: L| {
            if grid == self.cell.grid { law } else { law.on_mesh(grid.dx().max(grid.dy())) }
        };
        let own = self.law;
        let body = |grid: Grid, kernel: K| (kernel, law(grid, own));
        let (mut level, mut pause) = match resumed {
            Some((grid, gap, pause)) => {
                let mut level = Level::with_gap(grid, body(grid, self.kernel), &self.heights, self.cell, gap);
                self.set_load(&mut level, load);
                level.pressure = pause.pressure;
                self.earlier_pairs.set(pause.earlier_pairs);
                (level, Some(pause))
            }
            None => {
                let grid = grids[grids.len() - 1];
                let mut level = Level::touching(grid, body(grid, self.kernel), &self.heights, self.cell);
                self.set_load(&mut level, load);
                self.earlier_pairs.set(0.0);
                (level, None)
            }
        };
        let first = level.grid();
        let (mut cut, mut error_estimates): (Option<Ended>, _) = (None, ErrorEstimates::default());
        // A coarse grid, whose stretched range attracts less, may part where the next one holds.
        let (mut separated, mut converged) = (false, false);
        for &grid in grids.iter().rev().skip_while(|g| **g != first) {
            if grid != first {
                level.settle();
                if converged {
                    let residuals = level.last;
                    let cut = self.cell.is_padded().then(|| level.window.cut(&level.gap, level.grid().nx));
                    self.observer.coarse_grid_done(CoarseState {
                        grid: self.cell.facing(level.grid()),
                        gap: T::lend(cut.as_ref().unwrap_or(&level.gap)),
                        mean_gap: residuals.mean_gap,
                        energy: residuals.energy(level.pressure),
                        range: level.body.law.range(),
                        error_estimates,
                    });
                }
                let share = level.grid().points() as f64 / self.cell.grid.points() as f64;
                self.earlier_pairs.set(self.earlier_pairs.get() + level.pairs() * share);
                level = if separated {
                    let mut level = Level::touching(grid, body(grid, self.kernel), &self.heights, self.cell);
                    self.set_load(&mut level, load);
                    level
                } else {
                    Level::refined(grid, law(grid, own), level)
                };
            }
            level.prepare();
            let (tolerance, targets) = if grid == self.cell.grid {
                (problem.tolerance, problem.targets)
            } else {
                (COARSE_TOLERANCE.max(problem.tolerance), Targets::default())
            };
            // Once a coarse grid has been interrupted, the finer ones only carry its state.
            if cut.is_none() {
                let ended = self.hold(&mut level, load, (tolerance, targets), iterations, pause.take());
                error_estimates = ended.error_estimates;
                (separated, converged) = (ended.stop == Stop::Detached, ended.stop == Stop::Converged);
                if grid == self.cell.grid || ended.stop == Stop::Interrupted {
                    cut = Some(ended);
                }
            }
        }
        (level, cut.expect("the last grid is the problem's"))
    }

    /// What residuals are divided by. Where the pressure is not imposed it may pass through zero; what the bodies then do to
    /// each other is of the size of their attraction, for an exponential its energy over its range. Once they have parted
    /// nothing is left.
    fn scale(&self, load: Load, pressure: f64, residuals: &Residuals) -> f64 {
        let pull = if self.law.range() > 0.0 { residuals.interaction.abs() / self.law.range() } else { 0.0 };
        match load {
            Load::Pressure(p) => Problem::stress_scale(p),
            Load::MeanGap(target) => {
                // Where rounding leaves more than the tolerance asks for, there is no stress either.
                let height = self.rms_height.max(target);
                let rounded = 10.0 * self.problem.rounding_floor(height, 1.0) / self.problem.tolerance;
                let [least, most] = NO_STRESS.map(|share| share * height);
                Problem::stress_scale((pressure.abs() + pull).max(rounded.clamp(least, most)))
            }
        }
    }

    fn set_load(&self, level: &mut Level<T, K, L>, load: Load) {
        match load {
            Load::Pressure(p) => level.pressure = p,
            Load::MeanGap(target) => {
                level.pressure = self.pressure;
                let stiffness = SPRING * Problem { grid: level.grid(), ..self.problem.clone() }.stiffest_mode();
                level.spring = Spring { stiffness, target };
            }
        }
    }

    /// Improves until the load is met, too. Under mean-gap control the pressure is the multiplier of the constraint: the
    /// spring's force is added to it until the spring is slack (method of multipliers).
    fn hold(
        &self,
        level: &mut Level<T, K, L>,
        load: Load,
        (tolerance, targets): (f64, Targets),
        iterations: &mut usize,
        mut pause: Option<Pause>,
    ) -> Ended {
        let Load::MeanGap(target) = load else {
            return self.improve(level, (load, tolerance, targets), iterations, pause);
        };
        // A finer grid has a stiffer stiffest mode.
        let pressure = level.pressure;
        self.set_load(level, load);
        level.pressure = pressure;
        level.prepare();
        // Where a coarse mesh pins the contact line, no pressure may hold the asked mean gap.
        let coarse = level.grid() != self.cell.grid;
        let mut corrections = 0;
        loop {
            let ended = self.improve(level, (load, tolerance, targets), iterations, pause.take());
            let miss = level.last.mean_gap - target;
            level.pressure += level.spring.stiffness * miss;
            let within = LOAD_BALANCE.max(LOAD_SHARE * tolerance) * self.rms_height.max(target.abs());
            corrections += 1;
            if ended.stop != Stop::Converged || miss.abs() <= within {
                return ended;
            }
            if coarse && corrections == COARSE_CORRECTIONS {
                return Ended { stop: Stop::IterationLimit, ..ended };
            }
        }
    }
}

impl<T: Real, K: Kernel, L: Law> Run for Solver<'_, T, K, L> {
    fn resume(&mut self, snapshot: SolverSnapshot) -> Result<()> {
        // Of any grid on the way; its cell is this one.
        let grid = Grid { nx: snapshot.grid.nx, ny: snapshot.grid.ny, ..self.cell.grid };
        let (gap, pause) = snapshot.restore(grid, CARD.id)?;
        self.resumed = Some((grid, gap.into_iter().map(T::of).collect(), pause));
        Ok(())
    }

    fn set_gap(&mut self, gap: &[f64]) {
        let narrow = |gap: &[f64]| gap.iter().map(|&g| T::of(g)).collect();
        self.gap = if self.cell.is_padded() { narrow(&self.cell.continued(gap)) } else { narrow(gap) };
    }

    fn equilibrate(&mut self, load: Load) -> Result<State<'_>> {
        let clock = Instant::now();
        let problem = self.problem;
        if let Load::MeanGap(g) = load
            && !(g.is_finite() && (g > 0.0 || g == 0.0 && !L::HARD))
        {
            let accepted = "a positive length: behind a hard wall only pressures close all of the gap";
            return Err(refused(CARD.id, "mean gap", g, accepted));
        }
        if matches!(load, Load::MeanGap(_)) && self.cell.is_padded() {
            return Err(Error::input(
                "method fast",
                "load",
                "a mean gap under a body that is not periodic",
                "a pressure",
            ));
        }
        self.stress = Vec::new();
        let mut iterations = 0;
        // With adhesion the branch that the path has led to is kept; without it, the answer does not depend on the path
        // and coarse grids find it sooner than the last load does.
        let warm = L::ACTIVE && !self.gap.is_empty();
        let start = std::mem::take(&mut self.gap);
        let resumed = self.resumed.take();
        let free = || {
            self.earlier_pairs.set(0.0);
            Level::touching(self.cell.grid, (self.kernel, self.law), &self.heights, self.cell)
        };
        // Nothing but a push brings the bodies together where nothing attracts.
        let unpressed = match load {
            _ if self.law.range() > 0.0 => None,
            // Without one they touch, with a pull they part.
            Load::Pressure(p) if p <= 0.0 => {
                let mut level = free();
                level.pressure = p;
                Some((level, if p < 0.0 { Stop::Detached } else { Stop::Converged }))
            }
            // As far apart as they are at first touch, or farther, they need none.
            Load::MeanGap(target) if L::HARD => {
                let touch = *self.first_touch.get_or_init(|| mean(&free().gap));
                (target >= touch).then(|| {
                    let mut level = free();
                    let farther = T::of(target - touch);
                    level.gap.par_iter_mut().for_each(|g| *g += farther);
                    (level, Stop::Converged)
                })
            }
            _ => None,
        };
        let (mut level, ended) = if let Some((level, stop)) = unpressed {
            (level, Ended { stop, error_estimates: ErrorEstimates::default() })
        } else if warm && resumed.is_none() {
            self.earlier_pairs.set(0.0);
            let mut level = Level::with_gap(self.cell.grid, (self.kernel, self.law), &self.heights, self.cell, start);
            self.set_load(&mut level, load);
            level.prepare();
            let ended = self.hold(&mut level, load, (problem.tolerance, problem.targets), &mut iterations, None);
            (level, ended)
        } else {
            self.nested(load, &mut iterations, resumed)
        };
        // Its force has become part of the pressure.
        level.spring = Spring::default();
        let (residuals, stress) = level.stress();
        let (gap, pairs, pressure) =
            (std::mem::take(&mut level.gap), level.pairs() + self.earlier_pairs.get(), level.pressure);
        drop(level);
        let scale = self.scale(load, pressure, &residuals);
        (self.gap, self.stress, self.pressure) = (gap, stress, pressure);
        let (gap, stress) = if self.cell.is_padded() {
            let (window, nx) = (self.cell.window(self.cell.grid), self.cell.grid.nx);
            self.patch = (window.cut(&self.gap, nx), window.cut(&self.stress, nx));
            (&self.patch.0, &self.patch.1)
        } else {
            (&self.gap, &self.stress)
        };
        let Ended { stop, error_estimates } = ended;
        let rms_height = self.rms_height;
        let outcome =
            Outcome { load, pressure, scale, rms_height, stop, iterations, pairs, clock, residuals, error_estimates };
        Ok(outcome.state(gap, stress))
    }
}
