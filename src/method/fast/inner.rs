//! The linear problem of a Newton step on a fixed free set, by conjugate gradients preconditioned with the inverse
//! stiffness restricted to that set, in f32 whatever the precision of the state.
//!
//! An iteration is two column passes and two row sweeps. The step length and the conjugation need inner products that
//! are sums over spectra (`⟨d K d⟩` and `⟨r K⁻¹ r⟩`), known before the rows are transformed back; so a row goes back,
//! through the pointwise update, and forward again while it is in cache, and the preconditioned residual is never stored.

use super::column::{Factor, multiply};
use super::rows;
use super::window::Window;
use crate::grid::{Filter, Grid, Real, Transform};
use crate::interface::{Kernel, Law};
use crate::method::residuals::curvature_of;
use crate::method::sweep::sweep_sums;
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
    pub transform: Transform<f32>,
    window: Window,
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
    pub fn idle(grid: Grid, window: Window) -> Self {
        Inner {
            window,
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
        let (nx, window) = (self.transform.grid().nx, self.window);
        if scale != T::zero() {
            let rows = gap.par_chunks_mut(nx).zip(self.step.par_chunks(nx)).enumerate();
            rows.for_each(|(y, (gap, step))| rows::settle::<L, T>(window.inside(y, nx), gap, scale, step));
        }
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
        let (nx, beta, window) = (grid.nx, beta as f32, self.window);
        let pending = T::of(std::mem::take(&mut self.pending));
        let fields = (self.direction.par_chunks_mut(nx).zip(self.step.par_chunks_mut(nx)))
            .zip(self.residual.par_chunks(nx).zip(gap.par_chunks_mut(nx)));
        let [td, law_curvature] = sweep_sums(&self.transform, spectrum, fields, |worker, y, spectrum, fields| {
            let ((direction, step), (t, gap)) = fields;
            let moving = (gap, pending, step);
            let sums = rows::plain(&body.law, window.inside(y, nx), moving, (direction, beta, t), &mut worker.row);
            worker.forward(spectrum);
            sums
        });
        let metric = Metric { grid, kernel: body.kernel, mean: 0.0, spring: body.spring, inverse: false };
        let elastic = self.transform.sum_columns(spectrum, &metric);
        self.pairs += 0.5;
        let n = grid.points() as f64;
        (td / n, curvature_of(elastic, law_curvature / n))
    }

    /// Solves `H x = -t` on the free nodes until the residual has fallen to `forcing` of its first value, into `step`.
    /// `mean` is the stiffness that the preconditioner gives to the mean mode. Stops at negative curvature with what it
    /// has. Two pairs an iteration. Returns `⟨t M⁻¹ t⟩` of the free nodes: half of it estimates, without adhesion, the
    /// energy above the minimum of these nodes: the inverse stiffness of a part is less than the part of the inverse, but for
    /// the mean mode, to which the preconditioner gives a stiffness. `None` where it was stopped: what is in the step is then
    /// of no use.
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
                    self.step.par_iter_mut().zip(&self.direction).for_each(|(x, d)| *x = rows::wide(*d));
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
        let (nx, window) = (self.transform.grid().nx, self.window);
        let pending = T::of(std::mem::take(&mut self.pending));
        let fields = (self.residual.par_chunks_mut(nx).zip(self.step.par_chunks_mut(nx)))
            .zip(self.direction.par_chunks_mut(nx).zip(gap.par_chunks_mut(nx)));
        let [sum] = sweep_sums(&self.transform, spectrum, fields, |worker, y, spectrum, fields| {
            let ((residual, step), (direction, gap)) = fields;
            let sum = rows::begin::<L, T>(window.inside(y, nx), (gap, pending, step), residual, direction);
            worker.row.copy_from_slice(residual);
            worker.forward(spectrum);
            [sum]
        });
        sum
    }

    /// Rows of the preconditioned residual back, `d = z + β d` on the free nodes, rows of `d` forward. Returns
    /// `Σ v'' d²`.
    fn conjugate<T: Real, L: Law>(&mut self, beta: f64, gap: &[T], spectrum: &mut [Complex<f32>], law: &L) -> f64 {
        let (nx, window, beta) = (self.transform.grid().nx, self.window, beta as f32);
        let fields = self.direction.par_chunks_mut(nx).zip(gap.par_chunks(nx));
        let [sum] = sweep_sums(&self.transform, spectrum, fields, |worker, y, spectrum, (direction, gap)| {
            worker.inverse(spectrum);
            let sum = rows::conjugate(law, window.inside(y, nx), gap, (direction, beta), &mut worker.row);
            worker.forward(spectrum);
            [sum]
        });
        sum
    }

    /// Rows of `K d` back, `x += α d`, `r -= α H d` on the free nodes, rows of `r` forward. Returns `Σ r²`.
    fn descend<T: Real, L: Law>(&mut self, alpha: f64, gap: &[T], spectrum: &mut [Complex<f32>], law: &L) -> f64 {
        let (nx, window, alpha) = (self.transform.grid().nx, self.window, alpha as f32);
        let fields = (self.step.par_chunks_mut(nx).zip(self.residual.par_chunks_mut(nx)))
            .zip(self.direction.par_chunks(nx).zip(gap.par_chunks(nx)));
        let [sum] = sweep_sums(&self.transform, spectrum, fields, |worker, y, spectrum, fields| {
            let ((step, residual), (direction, gap)) = fields;
            worker.inverse(spectrum);
            let to = (step, &mut *residual);
            let sum = rows::descend(law, window.inside(y, nx), gap, (direction, alpha), to, &worker.row);
            worker.row.copy_from_slice(residual);
            worker.forward(spectrum);
            [sum]
        });
        sum
    }
}
