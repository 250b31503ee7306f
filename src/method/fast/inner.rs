//! The linear problem of a Newton step on a fixed free set: conjugate gradients preconditioned with the inverse
//! stiffness restricted to that set, in f32 for any precision of the state.
//!
//! An iteration takes two column passes and two row sweeps. Step length and conjugation need inner products that are
//! sums over spectra (`⟨d K d⟩` and `⟨r K⁻¹ r⟩`), known before the inverse row transforms. A row is therefore
//! transformed back, updated and transformed forward while it is in cache, and the preconditioned residual is not
//! stored.

use super::column::{Factor, multiply};
use super::rows;
use super::window::Window;
use crate::grid::{Filter, Grid, Real, Transform};
use crate::interface::{Kernel, Law};
use crate::method::residuals::{RowLaw, curvature_of};
use crate::method::sweep::{each_row, sweep_sums};
use half::bf16;
use rayon::prelude::*;
use rustfft::num_complex::Complex;

/// `K`, or its inverse with the stiffness `mean` for the mean mode. `spring` is the stiffness of the mean mode in `K`.
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

/// Working arrays of one level. Transforms use the spectrum of the level.
pub(super) struct Inner {
    pub transform: Transform<f32>,
    window: Window,
    /// Change of the gap.
    pub step: Vec<f32>,
    /// Accepted multiple of the step that the next sweep adds to the gap.
    pub pending: f64,
    /// Gradient `t` of the state; residual of the linear problem while it is being solved.
    pub residual: Vec<f32>,
    /// Search direction. Low precision suffices, since all products use the stored values. Negative zero marks closed
    /// nodes.
    direction: Vec<bf16>,
    pub pairs: f64,
}

/// Operators of the linear problem: kernel, law, and stiffness of a rigid approach.
#[derive(Clone, Copy)]
pub(super) struct Body<K, L> {
    pub kernel: K,
    pub law: L,
    /// Stiffness imposed on the mean gap (mean-gap control), 0 under load control.
    pub spring: f64,
}

impl Inner {
    /// Without the arrays, which are needed only during iterations.
    pub(super) fn idle(grid: Grid, window: Window) -> Self {
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

    pub(super) fn allocate(&mut self) {
        let n = self.transform.grid().points();
        (self.step, self.residual, self.direction) = (vec![0.0; n], vec![0.0; n], vec![bf16::ZERO; n]);
    }

    pub(super) fn release(&mut self) {
        (self.step, self.residual, self.direction) = Default::default();
    }

    /// Bytes for a grid.
    pub(super) fn bytes(grid: Grid) -> u64 {
        ((2 * size_of::<f32>() + size_of::<bf16>()) * grid.points()) as u64
    }

    /// Adds the pending step to the gap.
    pub(super) fn apply_pending<T: Real, L: Law>(&mut self, gap: &mut [T]) {
        let scale = T::of(std::mem::take(&mut self.pending));
        let (nx, window) = (self.transform.grid().nx, self.window);
        if scale != T::zero() {
            let step = &self.step;
            each_row(gap, nx, |y, gap| {
                rows::apply_step::<L, T>(window.inside(y, nx), gap, scale, &step[y * nx..][..nx]);
            });
        }
    }

    /// Direction `-t + β d` on the free nodes (steepest descent or conjugate gradients in the plain metric), copied
    /// to the step. Returns `⟨t d⟩` and `⟨d H d⟩`; half a transform pair.
    pub(super) fn plain<T: Real, K: Kernel, L: Law>(
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
            .zip(self.residual.par_chunks_mut(nx).zip(gap.par_chunks_mut(nx)));
        let [td, law_curvature] = sweep_sums(&self.transform, spectrum, fields, |worker, y, spectrum, fields| {
            let ((direction, step), (t, gap)) = fields;
            let moving = (gap, pending, step);
            let law = RowLaw::of(&body.law, y, window.nx);
            let sums = rows::plain(law, window.inside(y, nx), moving, (direction, beta, t), &mut worker.row);
            worker.forward(spectrum);
            sums
        });
        let metric = Metric { grid, kernel: body.kernel, mean: 0.0, spring: body.spring, inverse: false };
        let elastic = self.transform.sum_columns(spectrum, &metric);
        self.pairs += 0.5;
        let n = grid.points() as f64;
        (td / n, curvature_of(elastic, law_curvature / n))
    }

    /// Solves `H x = -t` on the free nodes for the step, until the residual is `forcing` times its first value or at
    /// most `limit` iterations of two transform pairs. `mean` is the stiffness of the mean mode in the
    /// preconditioner. Ends at negative curvature with the present iterate. Returns `⟨t M⁻¹ t⟩` on the free nodes;
    /// without adhesion half of it estimates the energy above the minimum, as the inverse of the restricted stiffness
    /// is bounded by the restriction of the inverse, except for the mean mode. `None` if stopped, with an unusable
    /// step.
    pub(super) fn newton<T: Real, K: Kernel, L: Law>(
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
        let first = self.begin(gap, spectrum, &body.law);
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
            // Neither is a number after an overflow.
            if curvature <= 0.0 || rz <= 0.0 || curvature.is_nan() || rz.is_nan() {
                if iteration == 1 {
                    // The preconditioned gradient is a descent direction; the line search finds the length.
                    self.step.iter_mut().zip(&self.direction).for_each(|(x, d)| *x = rows::wide(*d));
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

    /// Applies the pending step; sets residual `-t` on the free nodes, transforms its rows, and sets step and
    /// direction to zero. Returns `Σ r²`.
    fn begin<T: Real, L: Law>(&mut self, gap: &mut [T], spectrum: &mut [Complex<f32>], law: &L) -> f64 {
        let (nx, window) = (self.transform.grid().nx, self.window);
        let pending = T::of(std::mem::take(&mut self.pending));
        let fields = (self.residual.par_chunks_mut(nx).zip(self.step.par_chunks_mut(nx)))
            .zip(self.direction.par_chunks_mut(nx).zip(gap.par_chunks_mut(nx)));
        let [sum] = sweep_sums(&self.transform, spectrum, fields, |worker, y, spectrum, fields| {
            let ((residual, step), (direction, gap)) = fields;
            let law = RowLaw::of(law, y, window.nx);
            let sum = rows::begin(law, window.inside(y, nx), (gap, pending, step), residual, direction);
            worker.row.copy_from_slice(residual);
            worker.forward(spectrum);
            [sum]
        });
        sum
    }

    /// Inverse row transforms of the preconditioned residual `z`, `d = z + β d` on the free nodes, forward transforms
    /// of `d`. Returns `Σ v'' d²`.
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

    /// Inverse row transforms of `K d`, `x += α d` and `r -= α H d` on the free nodes, forward transforms of `r`.
    /// Returns `Σ r²`.
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
