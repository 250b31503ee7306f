use super::inner::Inner;
use crate::grid::{Grid, Real, Transform, block_sums, interpolate, lowest};
use crate::interface::{Kernel, Law};
use crate::method::operator::{Balance, KKT, Stiffness, kkt};
use rayon::prelude::*;
use rustfft::num_complex::Complex;
use std::borrow::Cow;

/// One grid of the hierarchy: the state on it, and what is needed to improve it.
pub(super) struct Level<'h, T: Real, K, L> {
    pub transform: Transform<T>,
    pub spectrum: Vec<Complex<T>>,
    pub stiffness: Stiffness<K>,
    pub law: L,
    /// The finest level borrows what the problem lends where precisions agree.
    pub heights: Cow<'h, [T]>,
    pub offset: T,
    pub gap: Vec<T>,
    pub inner: Inner,
    pub pressure: f64,
    pub pairs: f64,
}

/// A trial state: its balance, and the inner products of its KKT residual with itself and with the one before.
pub(super) struct Trial {
    pub balance: Balance,
    pub rr: f64,
    pub rr_old: f64,
}

impl<'h, T: Real, K: Kernel, L: Law> Level<'h, T, K, L> {
    pub fn new(grid: Grid, kernel: K, law: L, (heights, offset): (Cow<'h, [T]>, T), pressure: f64) -> Self {
        let transform = Transform::new(grid);
        Level {
            spectrum: transform.spectrum(),
            transform,
            stiffness: Stiffness { grid, kernel },
            law,
            gap: Vec::new(),
            heights,
            offset,
            inner: Inner::new(grid),
            pressure,
            pairs: 0.0,
        }
    }

    pub fn grid(&self) -> Grid {
        self.transform.grid()
    }

    /// Bytes of a level, what it copies of the heights included.
    pub fn bytes(grid: Grid) -> u64 {
        // Heights are borrowed in f64 and converted in f32.
        let fields = if T::NAME == "f32" { 2 } else { 1 };
        fields * (grid.points() * size_of::<T>()) as u64 + Transform::<T>::spectrum_bytes(grid) + Inner::bytes(grid)
    }

    /// No displacement: the surfaces at first touch.
    pub fn touch(&mut self) {
        let lowest = lowest(&self.heights);
        self.gap = self.heights.par_iter().map(|&h| h - lowest).collect();
    }

    /// Displacement of a coarser level, as its Fourier series, on this grid; the gap is what it leaves open.
    pub fn take_over(&mut self, coarse: Level<'_, T, K, L>) {
        let Level { transform: from, mut spectrum, heights, offset, mut gap, .. } = coarse;
        gap.par_iter_mut().zip(heights.par_iter()).for_each(|(g, &h)| *g = h - offset - *g);
        from.forward(&gap, &mut spectrum);
        self.gap = vec![T::zero(); self.grid().points()];
        interpolate(&from, &spectrum, &self.transform, &mut self.spectrum, &mut self.gap, |_, _| true);
        let offset = self.offset;
        self.gap.par_iter_mut().zip(self.heights.par_iter()).for_each(|(g, &h)| {
            *g = h - offset - *g;
            if L::HARD {
                *g = g.max(T::zero());
            }
        });
    }

    /// Balance and gradient where the gap is changed by `scale` times the step; the gap itself stays. One pair.
    pub fn trial(&mut self, scale: f64) -> Trial {
        let grid = self.grid();
        let (nx, half) = (grid.nx, grid.half());
        let (transform, law, offset) = (&self.transform, &self.law, self.offset);
        let (pressure, scale) = (T::of(self.pressure), T::of(scale));
        let moved = |g: T, step: f32| {
            let g = g + scale * T::of(f64::from(step));
            if L::HARD { g.max(T::zero()) } else { g }
        };
        self.spectrum
            .par_chunks_mut(half)
            .zip(self.gap.par_chunks(nx))
            .zip(self.heights.par_chunks(nx))
            .zip(self.inner.step.par_chunks(nx))
            .for_each_init(
                || transform.worker(),
                |worker, (((spectrum, gap), heights), step)| {
                    for (i, w) in worker.row.iter_mut().enumerate() {
                        *w = moved(gap[i], step[i]) - (heights[i] - offset);
                    }
                    worker.forward(spectrum);
                },
            );
        let elastic = 0.5 * transform.filter_columns(&mut self.spectrum, &self.stiffness);
        let rows: Vec<[f64; KKT + 2]> = self
            .spectrum
            .par_chunks_mut(half)
            .zip(self.gap.par_chunks(nx))
            .zip(self.inner.step.par_chunks(nx))
            .zip(self.inner.residual.par_chunks_mut(nx))
            .map_init(
                || transform.worker(),
                |worker, (((spectrum, gap), step), residual)| {
                    worker.inverse(spectrum);
                    let mut sum = [0.0; KKT + 2];
                    for i in 0..gap.len() {
                        let g = moved(gap[i], step[i]);
                        let mut t = worker.row[i] + pressure;
                        if L::ACTIVE {
                            t += T::of(law.traction(g.wide()));
                            sum[4] += law.energy(g.wide());
                        }
                        let (r, old) = (kkt::<L, T>(g, t).wide(), kkt::<L, f32>(gap[i].wide() as f32, residual[i]));
                        sum[0] += r * r;
                        sum[1] += r;
                        sum[2] += (t.wide() * g.wide()).abs();
                        sum[3] += g.wide();
                        sum[KKT] += r * f64::from(old);
                        residual[i] = t.wide() as f32;
                    }
                    sum
                },
            )
            .collect();
        self.pairs += 1.0;
        let sums = block_sums(&rows);
        let n = grid.points() as f64;
        Trial { balance: Balance::new(grid.points(), elastic, &sums), rr: sums[0] / n, rr_old: sums[KKT] / n }
    }

    /// Makes the last trial the state, and finds which nodes may move from there: open ones, and closed ones under
    /// tension.
    pub fn accept(&mut self, scale: f64) {
        let scale = T::of(scale);
        self.gap.par_iter_mut().zip(&self.inner.step).zip(&self.inner.residual).zip(&mut self.inner.free).for_each(
            |(((g, &step), &t), free)| {
                *g += scale * T::of(f64::from(step));
                if L::HARD {
                    *g = g.max(T::zero());
                }
                *free = !L::HARD || *g > T::zero() || t < 0.0;
            },
        );
    }

    /// Transforms done, in pairs of this grid.
    pub fn pairs(&self) -> f64 {
        self.pairs + self.inner.pairs
    }
}
