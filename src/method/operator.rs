//! The energy that every field method minimises, and its gradient, in one transform pair.
//!
//! With gap `g`, heights `h`, stiffness `K`, pressure `p` and interaction `v(g)`, the free energy per area is
//!
//! ```text
//! F(g) = ½⟨(g-h) K (g-h)⟩ + p⟨g⟩ + ⟨v(g)⟩,   t = dF/dg = K(g-h) + p + v'(g)
//! ```
//!
//! and an equilibrium has `t = 0` where the gap is open and `t ≥ 0`, the contact stress, where a hard wall closes it.
//! `K` has no mean mode, so the mean of `t - v'` is the pressure whatever the gap: load balance is a statement about `t`.

use super::{ErrorEstimates, Heights, Iteration, Load, Observer, Problem, SnapshotRef, State, Stop};
use crate::grid::{
    CHUNK, Filter, Grid, HalfSpectrum, Real, Transform, block_sums, dot, lowest, rms, total, vectorised,
};
use crate::interface::{Adhesion, HardWall, Kernel, Law, WithAdhesion};
use crate::{Error, Result};
use rayon::prelude::*;
use rustfft::num_complex::Complex;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::time::Instant;

/// Multiplication by the kernel and by the transform's `1/N`; sums `Σ w K |c|²/N²`, which is `⟨f K f⟩`.
pub(super) struct Stiffness<K> {
    pub grid: Grid,
    pub kernel: K,
}

impl<T: Real, K: Kernel> Filter<T> for Stiffness<K> {
    fn apply(&self, i: usize, column: &mut [Complex<T>]) -> f64 {
        let per_point = 1.0 / self.grid.points() as f64;
        let qx = self.grid.qx(i);
        let mut sum = 0.0;
        for (j, c) in column.iter_mut().enumerate() {
            let qy = self.grid.qy(j);
            let k = self.kernel.stiffness(qx, qy) * per_point;
            sum += k * c.norm_sqr().wide();
            *c = c.scale(T::of(k));
        }
        self.grid.column_weight(i) * per_point * sum
    }
}

/// Sums over one evaluation, all as means over the grid but `tension`.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct Residuals {
    pub elastic: f64,
    pub interaction: f64,
    pub mean_gap: f64,
    /// Mean of the gap over the whole cell, on which the load works: the mean gap, unless some of the cell is padding.
    pub mean_separation: f64,
    /// Closed nodes.
    pub contact: f64,
    /// rms of the KKT residual.
    pub residual: f64,
    /// Mean of the KKT residual: what is missing from the load balance.
    pub imbalance: f64,
    /// Mean of |t g|.
    pub complementarity: f64,
}

/// How a load ended, before it is told as a [`State`].
pub(super) struct Outcome {
    pub load: Load,
    pub stop: Stop,
    pub iterations: usize,
    /// Transforms done for it.
    pub pairs: f64,
    pub clock: Instant,
    pub residuals: Residuals,
    pub error_estimates: ErrorEstimates,
}

impl Outcome {
    /// The state that observers are lent, at a pressure; residuals are told over `scale`.
    pub fn state<'a, T: Real>(
        self,
        (pressure, scale, rms_height): (f64, f64, f64),
        gap: &'a [T],
        stress: &'a [T],
    ) -> State<'a> {
        let Outcome { load, stop, iterations, pairs, clock, residuals, error_estimates } = self;
        State {
            load,
            pressure,
            error_estimates,
            gap: T::lend(gap),
            stress: T::lend(stress),
            mean_gap: residuals.mean_gap,
            energy: residuals.energy(pressure),
            elastic_energy: residuals.elastic,
            interaction_energy: residuals.interaction,
            load_error: residuals.imbalance.abs() / scale,
            residual: residuals.residual / scale,
            // A flat surface has no height to compare with, and no gap either.
            complementarity: residuals.complementarity / (scale * rms_height.max(f64::MIN_POSITIVE)),
            stop,
            iterations,
            fft_pairs: pairs,
            seconds: clock.elapsed().as_secs_f64(),
        }
    }
}

/// A pull is taken to have parted the surfaces where what is left of the attraction, as energy over range, is below this
/// part of it; in equilibrium the two are of one size.
const SEPARATED: f64 = 1e-2;

/// Curvature of the energy along a line over that of the elastic body alone, at and below which it counts as none.
/// On the way to the jumps of an adhesive wave (`adhesive_analytic`) steps left the branch with 0 and no longer with
/// 0.01; 0.05 costs half as many steps again.
const SOFTENED: f64 = 0.01;

/// Curvature along a line, none where attraction leaves next to nothing of the body's: the minimum that so flat a
/// parabola promises is far off, often in another valley, and a step there leaves the branch that a load path is on.
pub(super) fn curvature_of(elastic: f64, law: f64) -> f64 {
    let curvature = elastic + law;
    if curvature <= SOFTENED * elastic { curvature.min(0.0) } else { curvature }
}

/// Number of sums that [`Nodes`] give.
pub(super) const KKT: usize = 7;

/// Residual of the optimality conditions at one node: the imbalance where the gap may move, else tension only.
#[inline(always)]
pub(super) fn kkt<L: Law, T: Real>(gap: T, t: T) -> T {
    if L::HARD && gap <= T::zero() { t.min(T::zero()) } else { t }
}

/// What a law gives at the gaps of a chunk; nothing is computed where all are out of its reach.
#[inline(always)]
pub(super) fn each<L: Law>(law: &L, gaps: &[f64; CHUNK], of: impl Fn(&L, f64) -> f64) -> [f64; CHUNK] {
    let mut values = [0.0; CHUNK];
    let end = law.cutoff();
    if L::ACTIVE && gaps.iter().any(|g| *g < end) {
        values.iter_mut().zip(gaps).for_each(|(v, g)| *v = of(law, *g));
    }
    values
}

/// A chunk of nodes (the last of a row has fewer): gaps and imbalances in, sums out. Elements past the end are ignored.
pub(super) struct Nodes<T> {
    pub gap: [T; CHUNK],
    /// Stress of body and load, to which [`Nodes::add_to`] adds the law's traction.
    pub imbalance: [T; CHUNK],
    /// Residual of an earlier state, for whom it concerns.
    pub old: [f64; CHUNK],
}

impl<T: Real> Nodes<T> {
    #[inline(always)]
    pub fn new() -> Self {
        Nodes { gap: [T::zero(); CHUNK], imbalance: [T::zero(); CHUNK], old: [0.0; CHUNK] }
    }

    /// Adds, for the first `n` nodes, residual², residual, |t g|, g, v(g), closed nodes, residual times the old one.
    #[inline(always)]
    pub fn add_to<L: Law>(&mut self, n: usize, law: &L, sums: &mut [f64; KKT]) {
        let gap = self.gap.map(
            #[inline(always)]
            |g| g.wide(),
        );
        if L::ACTIVE {
            let traction = each(
                law,
                &gap,
                #[inline(always)]
                |law, g| law.traction(g),
            );
            self.imbalance.iter_mut().zip(traction).for_each(|(t, traction)| *t += T::of(traction));
            sums[4] += total(
                &each(
                    law,
                    &gap,
                    #[inline(always)]
                    |law, g| law.energy(g),
                )[..n],
            );
        }
        let (mut residual, mut work, mut closed) = ([0.0; CHUNK], [0.0; CHUNK], [0.0; CHUNK]);
        for i in 0..CHUNK {
            let t = self.imbalance[i].wide();
            residual[i] = kkt::<L, f64>(gap[i], t);
            work[i] = (t * gap[i]).abs();
            closed[i] = if gap[i] <= 0.0 { 1.0 } else { 0.0 };
        }
        sums[0] += dot(&residual[..n], &residual[..n]);
        sums[1] += total(&residual[..n]);
        sums[2] += total(&work[..n]);
        sums[3] += total(&gap[..n]);
        sums[5] += total(&closed[..n]);
        sums[6] += dot(&residual[..n], &self.old[..n]);
    }
}

/// Sums of one row; `t`, the stress of body and load, becomes the imbalance by the law's traction.
pub(super) fn kkt_row<L: Law, T: Real>(law: &L, gap: &[T], t: &mut [T]) -> [f64; KKT] {
    vectorised(
        #[inline(always)]
        || {
            let mut sums = [0.0; KKT];
            for (gap, t) in gap.chunks(CHUNK).zip(t.chunks_mut(CHUNK)) {
                let mut nodes = Nodes::new();
                nodes.gap[..gap.len()].copy_from_slice(gap);
                nodes.imbalance[..t.len()].copy_from_slice(t);
                nodes.add_to(t.len(), law, &mut sums);
                t.copy_from_slice(&nodes.imbalance[..t.len()]);
            }
            sums
        },
    )
}

impl Residuals {
    pub fn new(points: usize, elastic: f64, sums: &[f64]) -> Self {
        let mean = |i: usize| sums[i] / points as f64;
        // The clamp of a hard wall makes a closed gap of what is no number, without any residual; the elastic energy does
        // not forget.
        let residual = if elastic.is_finite() { mean(0).sqrt() } else { f64::NAN };
        Residuals {
            elastic,
            residual,
            imbalance: mean(1),
            complementarity: mean(2),
            mean_gap: mean(3),
            mean_separation: mean(3),
            interaction: mean(4),
            contact: mean(5),
        }
    }

    /// Size of the energy's terms, whose rounding must not count as a rise.
    pub fn magnitude(&self, pressure: f64) -> f64 {
        self.elastic.abs() + self.interaction.abs() + (pressure * self.mean_separation).abs()
    }

    /// Whether the residual is within the tolerance and the forces balance, both over `scale`.
    pub fn meets(&self, tolerance: f64, scale: f64) -> bool {
        let load = LOAD_BALANCE.max(LOAD_SHARE * tolerance);
        self.residual <= tolerance * scale && self.imbalance.abs() <= load * scale
    }

    /// Whether a pull has parted the surfaces, for a law of this range.
    pub fn separated(&self, pressure: f64, range: f64) -> bool {
        pressure < 0.0 && self.interaction.abs() < SEPARATED * -pressure * range
    }

    pub fn energy(&self, pressure: f64) -> f64 {
        self.elastic + self.interaction + pressure * self.mean_separation
    }
}

/// What the solvers share: heights in working precision, transform, kernel, law, and the pressure of the moment.
pub(super) struct Operator<'p, T: Real, K, L> {
    pub problem: &'p Problem<'p>,
    pub transform: Transform<T>,
    /// Allocated when first used ([`Operator::allocate_spectrum`]).
    pub spectrum: HalfSpectrum<T>,
    pub stiffness: Stiffness<K>,
    pub law: L,
    pub heights: Cow<'p, [T]>,
    /// What is to be subtracted from the heights: an offset would cost digits in the transform.
    pub offset: T,
    pub rms_height: f64,
    pub lowest: T,
    pub pressure: f64,
    /// Transforms done, in pairs.
    pub pairs: f64,
}

/// The load balance that the solvers impose, relative to the pressure: at the default tolerance of 1e-8 this, and at
/// looser ones a tenth of the tolerance.
pub(super) const LOAD_BALANCE: f64 = 1e-9;
pub(super) const LOAD_SHARE: f64 = 0.1;

impl<'p, T: Real, K: Kernel, L: Law> Operator<'p, T, K, L> {
    pub fn new(problem: &'p Problem<'p>, kernel: K, law: L) -> Self {
        let grid = problem.grid;
        let transform = Transform::new(grid);
        let (heights, offset) = match problem.heights {
            Heights::Nodes(nodes) => T::heights(nodes, crate::grid::mean(nodes)),
            Heights::Series(series) => (Cow::Owned(series.on_nodes(&transform, &mut transform.spectrum())), T::zero()),
        };
        let lowest = lowest(&heights);
        let rms_height = rms(&heights);
        let stiffness = Stiffness { grid, kernel };
        Operator {
            problem,
            transform,
            spectrum: HalfSpectrum::default(),
            stiffness,
            law,
            heights,
            offset,
            rms_height,
            lowest,
            pressure: 0.0,
            pairs: 0.0,
        }
    }

    /// # Errors
    /// `Input` for any load but a pressure that presses, or with adhesion, be the wall soft or hard, may pull.
    pub fn set_load(&mut self, load: Load, id: &str) -> Result<()> {
        let goal = self.problem.targets.energy;
        match load {
            Load::Pressure(p) if p > 0.0 || self.law.range() > 0.0 => self.pressure = p,
            Load::Pressure(p) => return Err(refused(id, "pressure", p, "a positive one: nothing holds a pull")),
            Load::MeanGap(g) => {
                return Err(refused(id, "mean gap", g, "a pressure; the method `fast` controls the mean gap"));
            }
        }
        match goal {
            Some(g) => Err(refused(
                id,
                "energy goal",
                g,
                "none: this method does not estimate its energy above the minimum (`fast` does)",
            )),
            None => Ok(()),
        }
    }

    /// Tells the observer of an iteration and, where it wants that or stops, keeps the gap, the field beside it and what `pause` gives:
    /// all that the solve goes on from. True where it stops.
    pub fn checkpoint_or_interrupt<P: Serialize>(
        &self,
        observer: &dyn Observer,
        (iteration, residual): (usize, f64),
        (gap, beside): (&[T], &[T]),
        pause: impl FnOnce() -> P,
    ) -> bool {
        let step = Iteration { iteration, residual, tolerance: self.problem.tolerance, grid_fraction: 1.0 };
        let stopping = observer.iteration(step).is_break();
        if stopping || observer.snapshot_due() {
            observer.snapshot(SnapshotRef {
                grid: self.problem.grid,
                gap: T::lend(gap),
                auxiliary: Some(T::lend(beside)),
                progress: serde_json::to_value(pause()).expect("plain numbers"),
            });
        }
        stopping
    }

    /// Allocates the spectrum.
    pub fn allocate_spectrum(&mut self) {
        if self.spectrum.is_empty() {
            self.spectrum = self.transform.spectrum();
        }
    }

    /// The surfaces at first touch: no displacement.
    pub fn first_touch(&self) -> Vec<T> {
        self.heights.par_iter().map(|&h| h - self.lowest).collect()
    }

    /// Gradient `t` at `gap`, one pair. Per row, `update` may first move the gap, and `visit` sees gap and `t`, may keep
    /// something in `store`, and returns sums beyond those of [`Residuals`].
    pub fn evaluate<const M: usize>(
        &mut self,
        gap: &mut [T],
        store: &mut [T],
        update: impl Fn(usize, &mut [T]) + Sync,
        visit: impl Fn(&[T], &[T], &mut [T]) -> [f64; M] + Sync,
    ) -> (Residuals, [f64; M]) {
        self.allocate_spectrum();
        let grid = self.transform.grid();
        let (nx, pitch) = (grid.nx, grid.pitch());
        let offset = self.offset;
        self.spectrum
            .par_chunks_mut(pitch)
            .zip(gap.par_chunks_mut(nx))
            .zip(self.heights.par_chunks(nx))
            .enumerate()
            .for_each_init(
                || self.transform.worker(),
                |worker, (y, ((spectrum, gap), heights))| {
                    update(y, gap);
                    for ((w, &g), &h) in worker.row.iter_mut().zip(gap.iter()).zip(heights) {
                        *w = g - (h - offset);
                    }
                    worker.forward(spectrum);
                },
            );
        let elastic = 0.5 * self.transform.filter_columns(&mut self.spectrum, &self.stiffness);
        let (law, pressure) = (&self.law, T::of(self.pressure));
        let rows: Vec<([f64; KKT], [f64; M])> = self
            .spectrum
            .par_chunks_mut(pitch)
            .zip(gap.par_chunks(nx))
            .zip(store.par_chunks_mut(nx))
            .map_init(
                || self.transform.worker(),
                |worker, ((spectrum, gap), store)| {
                    worker.inverse(spectrum);
                    worker.row.iter_mut().for_each(|t| *t += pressure);
                    (kkt_row(law, gap, &mut worker.row), visit(gap, &worker.row, store))
                },
            )
            .collect();
        self.pairs += 1.0;
        let (sums, more): (Vec<_>, Vec<_>) = rows.into_iter().unzip();
        (Residuals::new(grid.points(), elastic, &block_sums(&sums)), block_sums(&more))
    }

    /// `⟨d K d⟩` (half a pair), with `update` giving each row of `d` first, and its sums.
    pub fn curvature<const M: usize>(
        &mut self,
        direction: &mut [T],
        update: impl Fn(usize, &mut [T]) -> [f64; M] + Sync,
    ) -> (f64, [f64; M]) {
        let (nx, pitch) = (self.transform.grid().nx, self.transform.grid().pitch());
        let rows: Vec<[f64; M]> = self
            .spectrum
            .par_chunks_mut(pitch)
            .zip(direction.par_chunks_mut(nx))
            .enumerate()
            .map_init(
                || self.transform.worker(),
                |worker, (y, (spectrum, direction))| {
                    let sums = update(y, direction);
                    worker.row.copy_from_slice(direction);
                    worker.forward(spectrum);
                    sums
                },
            )
            .collect();
        let curvature = self.transform.sum_columns(&mut self.spectrum, &self.stiffness);
        self.pairs += 0.5;
        (curvature, block_sums(&rows))
    }

    /// Interfacial stress `p + K(g-h)` into `stress`, and the final balance.
    pub fn stress(&mut self, gap: &mut [T], stress: &mut [T]) -> Residuals {
        let law = self.law;
        let (residuals, _) = self.evaluate(
            gap,
            stress,
            |_, _| {},
            |gap, t, stress| {
                for ((s, &t), &g) in stress.iter_mut().zip(t).zip(gap) {
                    *s = if L::ACTIVE { t - T::of(law.traction(g.wide())) } else { t };
                }
                [0.0; 0]
            },
        );
        residuals
    }

    /// The state that observers are lent.
    pub fn state<'a>(&self, outcome: Outcome, gap: &'a [T], stress: &'a [T]) -> State<'a> {
        outcome.state((self.pressure, Problem::stress_scale(self.pressure), self.rms_height), gap, stress)
    }

    /// Whether a balance meets the tolerance, the load balance and the goals.
    pub fn converged(&self, residuals: &Residuals, error_estimates: &ErrorEstimates) -> bool {
        let scale = Problem::stress_scale(self.pressure);
        residuals.meets(self.problem.tolerance, scale) && self.problem.targets.met(error_estimates)
    }

    /// Upper bound of the curvature of the energy around `gap`: what a safe gradient step is the inverse of. A soft wall is
    /// taken where it pushes with E* or four times the mean pressure, beyond what contact spots of slope one carry, or
    /// where it is now, if that is stiffer.
    pub fn stiffest(&self, gap: &[T]) -> f64 {
        let law = if L::HARD {
            self.law.max_slope_at_pressure(0.0)
        } else {
            let lowest = lowest(gap).wide();
            self.law.max_slope_at_pressure(4.0 * self.pressure.max(0.25)).max(self.law.slope(lowest).abs())
        };
        self.problem.stiffest_mode() + law
    }
}

/// A load or goal that a method cannot impose.
pub(super) fn refused(id: &str, key: &str, found: f64, accepted: &str) -> Error {
    Error::input(format!("method {id}"), key, found, accepted)
}

/// Notices that a residual no longer falls, and how much area and mean gap still move.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct ConvergenceMonitor {
    /// None before the first.
    best: Option<f64>,
    since: usize,
    /// Contact fraction and mean gap of every iteration.
    history: Vec<(f64, f64)>,
}

/// A moment of [`ConvergenceMonitor`].
#[derive(Debug, Clone, Copy)]
pub(super) struct MonitorMark {
    best: Option<f64>,
    since: usize,
    len: usize,
}

impl ConvergenceMonitor {
    /// Iterations without a tenth of improvement after which a residual at the rounding floor is final.
    const PATIENCE: usize = 100;
    /// Iterations before which nothing has settled.
    const FEWEST: usize = 10;

    pub fn new() -> Self {
        ConvergenceMonitor { best: None, since: 0, history: Vec::new() }
    }

    /// What it knows now, but for its history, which only grows.
    pub fn mark(&self) -> MonitorMark {
        MonitorMark { best: self.best, since: self.since, len: self.history.len() }
    }

    /// As it was at a mark.
    pub fn at(&self, mark: &MonitorMark) -> ConvergenceMonitor {
        ConvergenceMonitor { best: mark.best, since: mark.since, history: self.history[..mark.len].to_vec() }
    }

    /// Notes a state, and says how it compares with the one a fifth of the iterations ago.
    pub fn error_estimates(&mut self, residuals: &Residuals) -> ErrorEstimates {
        self.history.push((residuals.contact, residuals.mean_gap));
        let before = self.history[4 * (self.history.len() - 1) / 5];
        let enough = self.history.len() >= Self::FEWEST;
        let drift = |now: f64, then: f64| enough.then(|| (now - then).abs() / now.abs().max(f64::MIN_POSITIVE));
        ErrorEstimates {
            energy: None,
            area: drift(residuals.contact, before.0),
            mean_gap: drift(residuals.mean_gap, before.1),
        }
    }

    /// `Some` when `residual` (over the pressure) is no number, or has stalled at no more than ten times `floor`.
    pub fn stalled(&mut self, residual: f64, floor: f64) -> Option<Stop> {
        if !residual.is_finite() {
            return Some(Stop::Diverged);
        }
        let best = self.best.unwrap_or(f64::INFINITY);
        if residual < 0.9 * best {
            (self.best, self.since) = (Some(residual), 0);
        } else {
            self.since += 1;
        }
        (self.since > Self::PATIENCE && best < 10.0 * floor).then_some(Stop::RoundingFloor)
    }
}

/// Builds a solver for the precision, kernel and law of a problem.
pub(super) trait Build<'p> {
    type Built;

    fn build<T: Real, K: Kernel + 'p, L: Law + 'p>(self, kernel: K, law: L) -> Self::Built;
}

/// Chooses the types: precision and law are parameters of the inner loops, not branches in them.
pub(super) fn dispatch<'p, B: Build<'p>>(problem: &'p Problem<'p>, builder: B) -> B::Built {
    match problem.precision {
        super::Precision::F32 => with_law::<f32, B>(problem, builder),
        super::Precision::F64 => with_law::<f64, B>(problem, builder),
    }
}

fn with_law<'p, T: Real, B: Build<'p>>(problem: &'p Problem<'p>, builder: B) -> B::Built {
    let kernel = problem.kernel;
    // What most scenes ask for has solvers of its own; the rest shares two, in which laws are chosen node by node. Each
    // solver that the compiler writes out costs every build.
    match (problem.wall.soft(), problem.adhesion) {
        (None, Adhesion::None) => builder.build::<T, _, _>(kernel, HardWall),
        (None, Adhesion::Exponential(law)) => builder.build::<T, _, _>(kernel, law),
        (None, law) => builder.build::<T, _, _>(kernel, law),
        (Some(wall), adhesion) => builder.build::<T, _, _>(kernel, WithAdhesion { wall, adhesion }),
    }
}
