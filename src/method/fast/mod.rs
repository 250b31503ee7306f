//! The default field method: nested iteration with projected Newton steps whose linear problems are solved in f32.
//!
//! The surface is solved on grids from coarse to fine, each starting from the Fourier interpolation of the displacement
//! found before. What interpolation leaves wrong sits at contact lines, in the shortest waves: a few steps in the plain
//! metric remove it. What remains is global, and is solved for by Newton steps on the free set, with the stiffness
//! inverted in Fourier space as preconditioner, masked on both sides. Masking on one side only would have another fixed
//! point. With adhesion the range follows the mesh from grid to grid, so that no grid pins contact lines.

mod inner;
mod level;

use super::operator::{Build, Operator, Outcome, Progress, dispatch};
use super::{Card, ContactMethod, Criterion, Iteration, Load, Plan, Precision, Problem, Run, State, Stop, Watch};
use crate::Result;
use crate::grid::{Grid, Real, Transform, interpolate};
use crate::interface::{Kernel, Law};
use level::{Level, Trial};
use std::borrow::Cow;
use std::time::Instant;

pub struct Fast;

static CARD: Card = Card {
    id: "fast",
    paper_name: "-",
    family: "boundary value",
    needs: "heights",
    criterion: Criterion::ZeroGap,
    calibrated_on: None,
    summary: "nested grids, projected Newton steps preconditioned in Fourier space; the default",
    supports: super::card::fields,
    dois: &["10.1007/s11249-017-0900-2"],
};

/// Points along a side below which a grid is not halved.
const COARSEST: usize = 64;

/// Residual over the pressure at which a coarse grid is left: a better one leaves the work on the next grid unchanged.
const COARSE_TOLERANCE: f64 = 1e-2;

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

impl ContactMethod for Fast {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn plan(&self, problem: &Problem) -> Plan {
        let bytes = match problem.precision {
            Precision::F32 => {
                Level::<f32, crate::interface::HalfSpace, crate::interface::HardWall>::bytes(problem.grid)
            }
            Precision::F64 => {
                Level::<f64, crate::interface::HalfSpace, crate::interface::HardWall>::bytes(problem.grid)
            }
        };
        // While the finest level is set up the one below is still there, with the heights of all coarse ones.
        Plan { bytes: bytes + bytes / 3, iterations: 20, pairs_per_iteration: 4.0 }
    }

    fn start<'p>(&self, problem: &'p Problem<'p>, watch: &'p dyn Watch) -> Result<Box<dyn Run + 'p>> {
        Ok(dispatch(problem, Start(watch)))
    }
}

struct Start<'p>(&'p dyn Watch);

impl<'p> Build<'p> for Start<'p> {
    type Built = Box<dyn Run + 'p>;

    fn build<T: Real, K: Kernel + 'p, L: Law + 'p>(self, operator: Operator<'p, T, K, L>) -> Self::Built {
        Box::new(Solver { operator, watch: self.0, gap: Vec::new(), stress: Vec::new() })
    }
}

struct Solver<'p, T: Real, K, L> {
    operator: Operator<'p, T, K, L>,
    watch: &'p dyn Watch,
    /// Gap of the last load; empty before the first.
    gap: Vec<T>,
    stress: Vec<T>,
}

/// The grid below: half the points along every side longer than the coarsest, rounded up to a size that transforms fast.
fn coarser(grid: Grid) -> Option<Grid> {
    let half = |n: usize| if n >= 2 * COARSEST { smooth(n.div_ceil(2)) } else { n };
    let coarse = Grid { nx: half(grid.nx), ny: half(grid.ny), ..grid };
    (coarse.points() < grid.points()).then_some(coarse)
}

/// The smallest even number from `n` on without prime factors above 5.
fn smooth(n: usize) -> usize {
    let is_smooth = |mut k: usize| {
        for f in [2, 3, 5] {
            while k.is_multiple_of(f) {
                k /= f;
            }
        }
        k == 1
    };
    (n..).find(|&k| k.is_multiple_of(2) && is_smooth(k)).expect("powers of two have no end")
}

impl<T: Real, K: Kernel, L: Law> Solver<'_, T, K, L> {
    /// From the coarsest grid up.
    fn nested(&mut self, iterations: &mut usize) -> (Level<'_, T, K, L>, Stop) {
        let problem = self.operator.problem;
        let mut grids = vec![problem.grid];
        while let Some(next) = coarser(grids[grids.len() - 1]) {
            grids.push(next);
        }
        let coarse_heights = self.coarse_heights(&grids);
        let this = &*self;
        let mut coarse: Option<Level<T, K, L>> = None;
        let mut pairs = 0.0;
        for (grid, heights) in grids[1..].iter().zip(coarse_heights).rev() {
            let law = this.operator.law.on_mesh(grid.dx().max(grid.dy()));
            let heights = (Cow::Owned(heights), T::zero());
            let mut level = this.level(*grid, law, heights, coarse.take());
            let stop = this.improve(&mut level, COARSE_TOLERANCE.max(problem.tolerance), iterations);
            pairs += level.pairs() * grid.points() as f64 / problem.grid.points() as f64;
            coarse = Some(level);
            if stop == Stop::Interrupted {
                break;
            }
        }
        let mut finest = this.finest(coarse);
        finest.pairs += pairs;
        let stop = this.improve(&mut finest, problem.tolerance, iterations);
        (finest, stop)
    }

    fn level<'h>(
        &self,
        grid: Grid,
        law: L,
        heights: (Cow<'h, [T]>, T),
        coarse: Option<Level<'_, T, K, L>>,
    ) -> Level<'h, T, K, L> {
        let mut level = Level::new(grid, self.operator.stiffness.kernel, law, heights, self.operator.pressure);
        match coarse {
            Some(coarse) => level.take_over(coarse),
            None => level.touch(),
        }
        level
    }

    fn finest(&self, coarse: Option<Level<'_, T, K, L>>) -> Level<'_, T, K, L> {
        let heights = (Cow::Borrowed(&self.operator.heights[..]), self.operator.offset);
        self.level(self.operator.problem.grid, self.operator.law, heights, coarse)
    }

    /// Heights of all grids but the finest, each from its Fourier series; a third of a field together.
    fn coarse_heights(&mut self, grids: &[Grid]) -> Vec<Vec<T>> {
        let offset = self.operator.offset;
        let Operator { transform, heights: fine, .. } = &self.operator;
        let mut spectrum = transform.spectrum();
        transform.forward_of(
            |y, row| {
                let start = y * row.len();
                row.iter_mut().zip(&fine[start..]).for_each(|(w, &h)| *w = h - offset);
            },
            &mut spectrum,
        );
        grids[1..]
            .iter()
            .map(|&grid| {
                let to = Transform::new(grid);
                let mut heights = vec![T::zero(); grid.points()];
                interpolate(transform, &spectrum, &to, &mut to.spectrum(), &mut heights, |_, _| true);
                heights
            })
            .collect()
    }

    /// Iterates on one grid until its tolerance is met.
    fn improve(&self, level: &mut Level<'_, T, K, L>, tolerance: f64, iterations: &mut usize) -> Stop {
        let problem = self.operator.problem;
        let pressure = self.operator.pressure;
        let scale = Problem::stress_scale(pressure);
        let finest = level.grid() == problem.grid;
        let kernel = level.stiffness.kernel;
        let law = level.law;
        // The rigid approach is about as stiff as the pressure over half the rms height.
        let mean = scale / (0.5 * self.operator.rms_height).max(f64::MIN_POSITIVE);
        // A flat surface has no such stiffness; any finite one will do.
        let mean = mean.min(Problem { grid: level.grid(), ..problem.clone() }.stiffest_mode().max(1.0));
        let floor = problem.rounding_floor(self.operator.rms_height, pressure);
        let mut progress = Progress::new();
        level.inner.step.fill(0.0);
        let mut now = level.trial(0.0);
        level.accept(0.0);
        let stiffest_mode = Problem { grid: level.grid(), ..problem.clone() }.stiffest_mode();
        let (mut smoothing, mut beta, mut last) = (SMOOTHING, 0.0, f64::INFINITY);
        // Set by a failed plain step: the next is a gradient step of safe length, shortened as far as it takes.
        let mut careful = false;
        loop {
            let residual = now.balance.residual / scale;
            let done = if finest { self.operator.converged(&now.balance) } else { residual <= tolerance };
            if done {
                return Stop::Converged;
            }
            if *iterations >= problem.max_iterations {
                return Stop::IterationLimit;
            }
            if let Some(stop) = progress.stalled(residual, floor) {
                return stop;
            }
            if self.watch.iteration(Iteration { iteration: *iterations, residual, tolerance }).is_break() {
                return Stop::Interrupted;
            }
            *iterations += 1;
            let plain = smoothing > 0;
            let mut length = if plain {
                smoothing -= 1;
                let (mut slope, mut curvature) = level.inner.plain(beta, &level.gap, kernel, &law);
                if slope >= 0.0 {
                    (slope, curvature) = level.inner.plain(0.0, &level.gap, kernel, &law);
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
                // Forcing term after Eisenstat & Walker: as exact as the last step was successful.
                let forcing = (residual / last).powi(2).clamp(0.02, 0.3);
                level.inner.newton(&level.gap, kernel, &law, (mean, forcing, INNER_LIMIT));
                smoothing = SMOOTHING_AFTER_NEWTON;
                1.0
            };
            if !plain {
                last = residual;
            }
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
                    return if residual <= 10.0 * floor { Stop::RoundingFloor } else { Stop::NoDescent };
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
        }
    }
}

impl<T: Real, K: Kernel, L: Law> Run for Solver<'_, T, K, L> {
    fn equilibrate(&mut self, load: Load) -> Result<State<'_>> {
        let clock = Instant::now();
        self.operator.set_load(load);
        self.operator.pairs = 0.0;
        self.stress = Vec::new();
        let mut iterations = 0;
        // With adhesion the branch that the path has led to is kept; without it, the answer does not depend on the path
        // and coarse grids find it sooner than the last load does.
        let (gap, pairs, stop) = if L::ACTIVE && !self.gap.is_empty() {
            let gap = std::mem::take(&mut self.gap);
            let mut level = self.finest(None);
            level.gap = gap;
            let stop = self.improve(&mut level, self.operator.problem.tolerance, &mut iterations);
            (std::mem::take(&mut level.gap), level.pairs(), stop)
        } else {
            let (mut level, stop) = self.nested(&mut iterations);
            (std::mem::take(&mut level.gap), level.pairs(), stop)
        };
        self.gap = gap;
        // Only now, when the working arrays of the finest level are gone.
        self.stress = vec![T::zero(); self.gap.len()];
        let balance = self.operator.stress(&mut self.gap, &mut self.stress);
        self.operator.spectrum = Vec::new();
        self.operator.pairs += pairs;
        let outcome = Outcome { load, stop, iterations, pairs_before: 0.0, clock, balance };
        Ok(self.operator.state(outcome, &self.gap, &self.stress))
    }
}
