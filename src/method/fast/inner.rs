//! The linear problem of a Newton step on a fixed free set, by conjugate gradients preconditioned with the inverse
//! stiffness restricted to that set, in f32 whatever the precision of the state.
//!
//! An iteration is two column passes and two row sweeps. The step length and the conjugation need inner products that
//! are sums over spectra (`⟨d K d⟩` and `⟨r K⁻¹ r⟩`), known before the rows are transformed back; so a row goes back,
//! through the pointwise update, and forward again while it is in cache, and the preconditioned residual is never stored.

use crate::grid::{Filter, Grid, Real, Transform, block_sums};
use crate::interface::{Kernel, Law};
use rayon::prelude::*;
use rustfft::num_complex::Complex;

/// `K` with `mean` in place of the mean mode's zero, or its inverse.
struct Metric<K> {
    grid: Grid,
    kernel: K,
    mean: f64,
    inverse: bool,
}

impl<K: Kernel> Filter<f32> for Metric<K> {
    fn apply(&self, i: usize, column: &mut [Complex<f32>]) -> f64 {
        let per_point = 1.0 / self.grid.points() as f64;
        let qx = self.grid.qx(i);
        let mut sum = 0.0;
        for (j, c) in column.iter_mut().enumerate() {
            let qy = self.grid.qy(j);
            let rigid = qx == 0.0 && qy == 0.0;
            let factor = match (self.inverse, rigid) {
                (false, true) => 0.0,
                (false, false) => self.kernel.stiffness(qx, qy),
                (true, true) => 1.0 / self.mean,
                (true, false) => 1.0 / self.kernel.stiffness(qx, qy),
            };
            sum += factor * c.norm_sqr().wide();
            *c = c.scale((factor * per_point) as f32);
        }
        self.grid.column_weight(i) * per_point * per_point * sum
    }
}

/// Working arrays of the steps of one level.
pub(super) struct Inner {
    transform: Transform<f32>,
    spectrum: Vec<Complex<f32>>,
    /// Step: what the gap is to be changed by.
    pub step: Vec<f32>,
    /// Gradient `t` of the state; residual of the linear problem while it is being solved.
    pub residual: Vec<f32>,
    pub direction: Vec<f32>,
    /// Nodes whose gap may change.
    pub free: Vec<bool>,
    pub pairs: f64,
}

impl Inner {
    pub fn new(grid: Grid) -> Self {
        let transform = Transform::<f32>::new(grid);
        let n = grid.points();
        Inner {
            spectrum: transform.spectrum(),
            transform,
            step: vec![0.0; n],
            residual: vec![0.0; n],
            direction: vec![0.0; n],
            free: vec![false; n],
            pairs: 0.0,
        }
    }

    /// Bytes for a grid.
    pub fn bytes(grid: Grid) -> u64 {
        13 * grid.points() as u64 + Transform::<f32>::spectrum_bytes(grid)
    }

    /// Direction `-t + β d` on the free nodes (steepest descent or conjugate gradients in the plain metric), copied to the
    /// step. Returns `⟨t d⟩` and `⟨d H d⟩`; half a pair.
    pub fn plain<T: Real, K: Kernel, L: Law>(&mut self, beta: f64, gap: &[T], kernel: K, law: &L) -> (f64, f64) {
        let grid = self.transform.grid();
        let (nx, half, beta) = (grid.nx, grid.half(), beta as f32);
        let rows: Vec<[f64; 2]> = self
            .spectrum
            .par_chunks_mut(half)
            .zip(self.direction.par_chunks_mut(nx))
            .zip(self.step.par_chunks_mut(nx))
            .zip(self.residual.par_chunks(nx))
            .zip(self.free.par_chunks(nx))
            .zip(gap.par_chunks(nx))
            .map_init(
                || self.transform.worker(),
                |worker, (((((spectrum, direction), step), t), free), gap)| {
                    let mut sum = [0.0; 2];
                    for i in 0..direction.len() {
                        let d = if free[i] { beta * direction[i] - t[i] } else { 0.0 };
                        (direction[i], step[i], worker.row[i]) = (d, d, d);
                        sum[0] += f64::from(t[i]) * f64::from(d);
                        if L::ACTIVE && d != 0.0 {
                            sum[1] += law.slope(gap[i].wide()) * f64::from(d) * f64::from(d);
                        }
                    }
                    worker.forward(spectrum);
                    sum
                },
            )
            .collect();
        let metric = Metric { grid, kernel, mean: 0.0, inverse: false };
        let elastic = self.transform.columns_forward(&mut self.spectrum, &metric);
        self.pairs += 0.5;
        let [td, curvature] = block_sums(&rows);
        let n = grid.points() as f64;
        (td / n, elastic + curvature / n)
    }

    /// Solves `H x = -t` on the free nodes until the residual has fallen to `forcing` of its first value, into `step`.
    /// `mean` is the stiffness that the preconditioner gives to the mean mode. Stops at negative curvature with what it
    /// has. Returns the number of iterations; two pairs each.
    pub fn newton<T: Real, K: Kernel, L: Law>(
        &mut self,
        gap: &[T],
        kernel: K,
        law: &L,
        (mean, forcing, limit): (f64, f64, usize),
    ) -> usize {
        let grid = self.transform.grid();
        let n = grid.points() as f64;
        let stiffness = Metric { grid, kernel, mean, inverse: false };
        let inverse = Metric { grid, kernel, mean, inverse: true };
        let first = self.begin();
        let mut rz = self.transform.filter_columns(&mut self.spectrum, &inverse);
        let mut beta = 0.0;
        for iteration in 1..=limit {
            let law_curvature = self.conjugate(beta, gap, law);
            let elastic = self.transform.filter_columns(&mut self.spectrum, &stiffness);
            let curvature = elastic + law_curvature / n;
            self.pairs += 2.0;
            if curvature <= 0.0 || rz <= 0.0 {
                if iteration == 1 {
                    // The preconditioned gradient still points downhill; how far is for the line search to find.
                    self.step.par_iter_mut().zip(&self.direction).for_each(|(x, &d)| *x = d);
                }
                return iteration;
            }
            let alpha = rz / curvature;
            let rr = self.descend(alpha, gap, law);
            if rr.sqrt() <= forcing * first.sqrt() || iteration == limit {
                return iteration;
            }
            let old = rz;
            rz = self.transform.filter_columns(&mut self.spectrum, &inverse);
            beta = rz / old;
        }
        limit
    }

    /// Residual `-t` on the free nodes, its rows into the spectrum; step and direction zero. Returns `Σ r²`.
    fn begin(&mut self) -> f64 {
        let (nx, half) = (self.transform.grid().nx, self.transform.grid().half());
        let rows: Vec<[f64; 1]> = self
            .spectrum
            .par_chunks_mut(half)
            .zip(self.residual.par_chunks_mut(nx))
            .zip(self.step.par_chunks_mut(nx))
            .zip(self.direction.par_chunks_mut(nx))
            .zip(self.free.par_chunks(nx))
            .map_init(
                || self.transform.worker(),
                |worker, ((((spectrum, residual), step), direction), free)| {
                    step.fill(0.0);
                    direction.fill(0.0);
                    let mut sum = 0.0;
                    for (r, &f) in residual.iter_mut().zip(free) {
                        *r = if f { -*r } else { 0.0 };
                        sum += f64::from(*r) * f64::from(*r);
                    }
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
    fn conjugate<T: Real, L: Law>(&mut self, beta: f64, gap: &[T], law: &L) -> f64 {
        let (nx, half, beta) = (self.transform.grid().nx, self.transform.grid().half(), beta as f32);
        let rows: Vec<[f64; 1]> = self
            .spectrum
            .par_chunks_mut(half)
            .zip(self.direction.par_chunks_mut(nx))
            .zip(self.free.par_chunks(nx))
            .zip(gap.par_chunks(nx))
            .map_init(
                || self.transform.worker(),
                |worker, (((spectrum, direction), free), gap)| {
                    worker.inverse(spectrum);
                    let mut sum = 0.0;
                    for i in 0..direction.len() {
                        let d = if free[i] { worker.row[i] + beta * direction[i] } else { 0.0 };
                        (direction[i], worker.row[i]) = (d, d);
                        if L::ACTIVE && d != 0.0 {
                            sum += law.slope(gap[i].wide()) * f64::from(d) * f64::from(d);
                        }
                    }
                    worker.forward(spectrum);
                    [sum]
                },
            )
            .collect();
        let [sum] = block_sums(&rows);
        sum
    }

    /// Rows of `K d` back, `x += α d`, `r -= α H d` on the free nodes, rows of `r` forward. Returns `Σ r²`.
    fn descend<T: Real, L: Law>(&mut self, alpha: f64, gap: &[T], law: &L) -> f64 {
        let (nx, half, alpha) = (self.transform.grid().nx, self.transform.grid().half(), alpha as f32);
        let rows: Vec<[f64; 1]> = self
            .spectrum
            .par_chunks_mut(half)
            .zip(self.step.par_chunks_mut(nx))
            .zip(self.residual.par_chunks_mut(nx))
            .zip(self.direction.par_chunks(nx))
            .zip(self.free.par_chunks(nx))
            .zip(gap.par_chunks(nx))
            .map_init(
                || self.transform.worker(),
                |worker, (((((spectrum, step), residual), direction), free), gap)| {
                    worker.inverse(spectrum);
                    let mut sum = 0.0;
                    for i in 0..step.len() {
                        if free[i] {
                            let d = direction[i];
                            let mut h = worker.row[i];
                            if L::ACTIVE {
                                h += law.slope(gap[i].wide()) as f32 * d;
                            }
                            step[i] += alpha * d;
                            residual[i] -= alpha * h;
                            sum += f64::from(residual[i]) * f64::from(residual[i]);
                        }
                    }
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
