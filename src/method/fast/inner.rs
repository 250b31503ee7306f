//! The linear problem of a Newton step on a fixed free set, by conjugate gradients preconditioned with the inverse
//! stiffness restricted to that set, in f32 whatever the precision of the state.
//!
//! An iteration is two column passes and two row sweeps. The step length and the conjugation need inner products that
//! are sums over spectra (`⟨d K d⟩` and `⟨r K⁻¹ r⟩`), known before the rows are transformed back; so a row goes back,
//! through the pointwise update, and forward again while it is in cache, and the preconditioned residual is never stored.

use super::column::{Factor, multiply};
use crate::grid::{CHUNK, Filter, Grid, Real, Transform, block_sums, dot, vectorised};
use crate::interface::{Kernel, Law};
use crate::method::operator::{curvature_of, each};
use half::bf16;
use rayon::prelude::*;
use rustfft::num_complex::Complex;

/// `K` with `mean` in place of the mean mode's zero, or its inverse. `spring` is the mean mode's own stiffness.
struct Metric<K> {
    grid: Grid,
    kernel: K,
    mean: f64,
    spring: f64,
    inverse: bool,
}

impl<K: Kernel> Filter<f32> for Metric<K> {
    fn apply(&self, i: usize, column: &mut [Complex<f32>]) -> f64 {
        let factor = if self.inverse {
            (&self.kernel, Factor::Compliance, 1.0 / self.mean)
        } else {
            (&self.kernel, Factor::Stiffness, self.spring)
        };
        multiply(factor, self.grid, i, column)
    }
}

/// Working arrays of the steps of one level. The spectrum they are transformed in is the level's.
pub(super) struct Inner {
    transform: Transform<f32>,
    /// What the gap is to be changed by.
    pub step: Vec<f32>,
    /// Part of the step that has been accepted but not yet added to the gap: the next sweep does it on its way.
    pub pending: f64,
    /// Gradient `t` of the state; residual of the linear problem while it is being solved.
    pub residual: Vec<f32>,
    /// Search direction. Eight digits of it would be of no use, since every product is taken with what is stored. Negative
    /// zero marks nodes that are held closed.
    direction: Vec<bf16>,
    pub pairs: f64,
}

/// The mark of nodes that are held closed.
const HELD: bf16 = bf16::NEG_ZERO;

#[inline(always)]
fn is_held(d: bf16) -> bool {
    d.to_bits() == HELD.to_bits()
}

/// The nearest direction that is not the mark. `bf16::from_f32` looks for NaNs on its way, at four times the cost.
#[inline(always)]
fn free(d: f32) -> bf16 {
    let bits = d.to_bits();
    let rounded = (bits.wrapping_add(0x7fff + (bits >> 16 & 1)) >> 16) as u16;
    bf16::from_bits(if rounded == HELD.to_bits() { 0 } else { rounded })
}

#[inline(always)]
fn wide(d: bf16) -> f32 {
    f32::from_bits(u32::from(d.to_bits()) << 16)
}

/// The gap after `scale` times a step, in front of the wall.
#[inline(always)]
pub(super) fn moved<L: Law, T: Real>(g: T, scale: T, step: f32) -> T {
    let g = g + scale * T::of(f64::from(step));
    if L::HARD { g.max(T::zero()) } else { g }
}

/// Whether a node may move from here: open ones, and closed ones under tension.
#[inline(always)]
fn may_move<L: Law, T: Real>(g: T, t: f32) -> bool {
    !L::HARD || g > T::zero() || t < 0.0
}

/// `v'' d` at the nodes of a chunk.
#[inline(always)]
fn forces<T: Real, L: Law>(law: &L, gap: &[T], direction: &[f32; CHUNK]) -> [f64; CHUNK] {
    if !L::ACTIVE {
        return [0.0; CHUNK];
    }
    let mut gaps = [f64::INFINITY; CHUNK];
    gaps.iter_mut().zip(gap).for_each(|(wide, g)| *wide = g.wide());
    let mut forces = each(
        law,
        &gaps,
        #[inline(always)]
        |law, g| law.slope(g),
    );
    forces.iter_mut().zip(direction).for_each(|(f, &d)| *f *= f64::from(d));
    forces
}

/// `Σ v'' d²`: what the law takes from the stiffness along a direction.
#[inline(always)]
fn softening<T: Real, L: Law>(law: &L, gap: &[T], direction: &[f32]) -> f64 {
    if !L::ACTIVE {
        return 0.0;
    }
    let mut sum = 0.0;
    for (gap, direction) in gap.chunks(CHUNK).zip(direction.chunks(CHUNK)) {
        let mut d = [0.0; CHUNK];
        d[..direction.len()].copy_from_slice(direction);
        sum += dot(&forces(law, gap, &d), &d);
    }
    sum
}

/// What the linear problem is about: the kernel, the law, and the stiffness of a rigid approach.
#[derive(Clone, Copy)]
pub(super) struct Body<K, L> {
    pub kernel: K,
    pub law: L,
    /// Stiffness imposed on the mean gap (mean-gap control), 0 under load control.
    pub spring: f64,
}

impl Inner {
    /// Without its arrays, which a level does not need before it is improved and after.
    pub fn idle(grid: Grid) -> Self {
        Inner {
            transform: Transform::<f32>::new(grid),
            step: Vec::new(),
            pending: 0.0,
            residual: Vec::new(),
            direction: Vec::new(),
            pairs: 0.0,
        }
    }

    pub fn allocate(&mut self) {
        let n = self.transform.grid().points();
        (self.step, self.residual, self.direction) = (vec![0.0; n], vec![0.0; n], vec![bf16::ZERO; n]);
    }

    pub fn release(&mut self) {
        (self.step, self.residual, self.direction) = Default::default();
    }

    /// Bytes for a grid.
    pub fn bytes(grid: Grid) -> u64 {
        ((2 * size_of::<f32>() + size_of::<bf16>()) * grid.points()) as u64
    }

    /// Adds what has been accepted to the gap.
    pub fn settle<T: Real, L: Law>(&mut self, gap: &mut [T]) {
        let scale = T::of(std::mem::take(&mut self.pending));
        gap.par_iter_mut().zip(&self.step).for_each(|(g, &s)| *g = moved::<L, T>(*g, scale, s));
    }

    /// Direction `-t + β d` on the free nodes (steepest descent or conjugate gradients in the plain metric), copied to the
    /// step. Returns `⟨t d⟩` and `⟨d H d⟩`; half a pair.
    pub fn plain<T: Real, K: Kernel, L: Law>(
        &mut self,
        beta: f64,
        gap: &mut [T],
        spectrum: &mut [Complex<f32>],
        body: &Body<K, L>,
    ) -> (f64, f64) {
        let grid = self.transform.grid();
        let (nx, half, beta) = (grid.nx, grid.half(), beta as f32);
        let pending = T::of(std::mem::take(&mut self.pending));
        let rows: Vec<[f64; 2]> = spectrum
            .par_chunks_mut(half)
            .zip(self.direction.par_chunks_mut(nx))
            .zip(self.step.par_chunks_mut(nx))
            .zip(self.residual.par_chunks(nx))
            .zip(gap.par_chunks_mut(nx))
            .map_init(
                || self.transform.worker(),
                |worker, ((((spectrum, direction), step), t), gap)| {
                    let sum = vectorised(
                        #[inline(always)]
                        || {
                            let row = &mut worker.row[..];
                            let chunks = direction.chunks_mut(CHUNK).zip(step.chunks_mut(CHUNK)).zip(t.chunks(CHUNK));
                            for ((((direction, step), t), gap), row) in
                                chunks.zip(gap.chunks_mut(CHUNK)).zip(row.chunks_mut(CHUNK))
                            {
                                let (mut to, mut marked) = ([0.0; CHUNK], [HELD; CHUNK]);
                                gap.iter_mut().zip(&*step).for_each(|(g, s)| *g = moved::<L, T>(*g, pending, *s));
                                for ((((to, m), &d), &t), &g) in
                                    to.iter_mut().zip(&mut marked).zip(&*direction).zip(t).zip(&*gap)
                                {
                                    let moves = may_move::<L, T>(g, t);
                                    *to = if moves { beta * wide(d) - t } else { 0.0 };
                                    *m = if moves { free(*to) } else { HELD };
                                }
                                let n = row.len();
                                direction.copy_from_slice(&marked[..n]);
                                step.copy_from_slice(&to[..n]);
                                row.copy_from_slice(&to[..n]);
                            }
                            [dot(t, row), softening(&body.law, gap, row)]
                        },
                    );
                    worker.forward(spectrum);
                    sum
                },
            )
            .collect();
        let metric = Metric { grid, kernel: body.kernel, mean: 0.0, spring: body.spring, inverse: false };
        let elastic = self.transform.columns_forward(spectrum, &metric);
        self.pairs += 0.5;
        let [td, law_curvature] = block_sums(&rows);
        let n = grid.points() as f64;
        (td / n, curvature_of(elastic, law_curvature / n))
    }

    /// Solves `H x = -t` on the free nodes until the residual has fallen to `forcing` of its first value, into `step`.
    /// `mean` is the stiffness that the preconditioner gives to the mean mode. Stops at negative curvature with what it
    /// has. Two pairs an iteration. Returns `⟨t M⁻¹ t⟩` of the free nodes: half of it bounds, without adhesion, the energy
    /// above the minimum of these nodes, since the inverse stiffness of a part is less than the part of the inverse. `None` where it was stopped: what is in the step is
    /// then of no use.
    pub fn newton<T: Real, K: Kernel, L: Law>(
        &mut self,
        gap: &mut [T],
        spectrum: &mut [Complex<f32>],
        body: &Body<K, L>,
        (mean, forcing, limit): (f64, f64, usize),
        stopping: &dyn Fn() -> bool,
    ) -> Option<f64> {
        let grid = self.transform.grid();
        let n = grid.points() as f64;
        let stiffness = Metric { grid, kernel: body.kernel, mean, spring: body.spring, inverse: false };
        let inverse = Metric { grid, kernel: body.kernel, mean, spring: body.spring, inverse: true };
        let first = self.begin::<T, L>(gap, spectrum);
        let mut rz = self.transform.filter_columns(spectrum, &inverse);
        let excess = rz;
        let mut beta = 0.0;
        for iteration in 1..=limit {
            if stopping() {
                return None;
            }
            let law_curvature = self.conjugate(beta, gap, spectrum, &body.law);
            let elastic = self.transform.filter_columns(spectrum, &stiffness);
            let curvature = curvature_of(elastic, law_curvature / n);
            self.pairs += 2.0;
            if curvature <= 0.0 || rz <= 0.0 {
                if iteration == 1 {
                    // The preconditioned gradient still points downhill; how far is for the line search to find.
                    self.step.par_iter_mut().zip(&self.direction).for_each(|(x, d)| *x = d.to_f32());
                }
                break;
            }
            let alpha = rz / curvature;
            let rr = self.descend(alpha, gap, spectrum, &body.law);
            if rr.sqrt() <= forcing * first.sqrt() || iteration == limit {
                break;
            }
            let old = rz;
            rz = self.transform.filter_columns(spectrum, &inverse);
            beta = rz / old;
        }
        Some(excess)
    }

    /// The gap with what is pending, residual `-t` on the free nodes, its rows into the spectrum; step and direction zero.
    /// Returns `Σ r²`.
    fn begin<T: Real, L: Law>(&mut self, gap: &mut [T], spectrum: &mut [Complex<f32>]) -> f64 {
        let (nx, half) = (self.transform.grid().nx, self.transform.grid().half());
        let pending = T::of(std::mem::take(&mut self.pending));
        let rows: Vec<[f64; 1]> = spectrum
            .par_chunks_mut(half)
            .zip(self.residual.par_chunks_mut(nx))
            .zip(self.step.par_chunks_mut(nx))
            .zip(self.direction.par_chunks_mut(nx))
            .zip(gap.par_chunks_mut(nx))
            .map_init(
                || self.transform.worker(),
                |worker, ((((spectrum, residual), step), direction), gap)| {
                    let sum = vectorised(
                        #[inline(always)]
                        || {
                            gap.iter_mut().zip(&*step).for_each(|(g, s)| *g = moved::<L, T>(*g, pending, *s));
                            step.fill(0.0);
                            for ((r, d), &g) in residual.iter_mut().zip(direction).zip(&*gap) {
                                let moves = may_move::<L, T>(g, *r);
                                *r = if moves { -*r } else { 0.0 };
                                *d = if moves { bf16::ZERO } else { HELD };
                            }
                            dot(residual, residual)
                        },
                    );
                    worker.row.copy_from_slice(residual);
                    worker.forward(spectrum);
                    [sum]
                },
            )
            .collect();
        let [sum] = block_sums(&rows);
        sum
    }

    /// Rows of the preconditioned residual back, `d = z + β d` on the free nodes, rows of `d` forward. Returns
    /// `Σ v'' d²`.
    fn conjugate<T: Real, L: Law>(&mut self, beta: f64, gap: &[T], spectrum: &mut [Complex<f32>], law: &L) -> f64 {
        let (nx, half, beta) = (self.transform.grid().nx, self.transform.grid().half(), beta as f32);
        let rows: Vec<[f64; 1]> = spectrum
            .par_chunks_mut(half)
            .zip(self.direction.par_chunks_mut(nx))
            .zip(gap.par_chunks(nx))
            .map_init(
                || self.transform.worker(),
                |worker, ((spectrum, direction), gap)| {
                    worker.inverse(spectrum);
                    let sum = vectorised(
                        #[inline(always)]
                        || {
                            let row = &mut worker.row[..];
                            for (d, r) in direction.iter_mut().zip(&mut *row) {
                                let held = is_held(*d);
                                let to = free(*r + beta * wide(*d));
                                (*d, *r) = if held { (HELD, 0.0) } else { (to, wide(to)) };
                            }
                            softening(law, gap, row)
                        },
                    );
                    worker.forward(spectrum);
                    [sum]
                },
            )
            .collect();
        let [sum] = block_sums(&rows);
        sum
    }

    /// Rows of `K d` back, `x += α d`, `r -= α H d` on the free nodes, rows of `r` forward. Returns `Σ r²`.
    fn descend<T: Real, L: Law>(&mut self, alpha: f64, gap: &[T], spectrum: &mut [Complex<f32>], law: &L) -> f64 {
        let (nx, half, alpha) = (self.transform.grid().nx, self.transform.grid().half(), alpha as f32);
        let rows: Vec<[f64; 1]> = spectrum
            .par_chunks_mut(half)
            .zip(self.step.par_chunks_mut(nx))
            .zip(self.residual.par_chunks_mut(nx))
            .zip(self.direction.par_chunks(nx))
            .zip(gap.par_chunks(nx))
            .map_init(
                || self.transform.worker(),
                |worker, ((((spectrum, step), residual), direction), gap)| {
                    worker.inverse(spectrum);
                    let sum = vectorised(
                        #[inline(always)]
                        || {
                            let chunks =
                                step.chunks_mut(CHUNK).zip(residual.chunks_mut(CHUNK)).zip(direction.chunks(CHUNK));
                            for ((((step, residual), direction), gap), row) in
                                chunks.zip(gap.chunks(CHUNK)).zip(worker.row.chunks(CHUNK))
                            {
                                let mut d = [0.0; CHUNK];
                                d.iter_mut().zip(direction).for_each(|(d, stored)| *d = wide(*stored));
                                step.iter_mut().zip(&d).for_each(|(s, d)| *s += alpha * d);
                                let softened = forces(law, gap, &d);
                                for (((r, &stored), &stress), &soft) in
                                    residual.iter_mut().zip(direction).zip(row).zip(&softened)
                                {
                                    let left = *r - alpha * (stress + soft as f32);
                                    *r = if is_held(stored) { 0.0 } else { left };
                                }
                            }
                            dot(residual, residual)
                        },
                    );
                    worker.row.copy_from_slice(residual);
                    worker.forward(spectrum);
                    [sum]
                },
            )
            .collect();
        let [sum] = block_sums(&rows);
        sum
    }
}
