use super::column::{Factor, multiply};
use super::inner::{Body, Inner, moved};
use crate::grid::{CHUNK, Filter, Grid, Real, Series, Transform, block_sums, lowest, vectorised};
use crate::interface::{Kernel, Law};
use crate::method::operator::{Balance, KKT, Nodes, kkt, kkt_row};
use rayon::prelude::*;
use rustfft::num_complex::Complex;

/// Control of the mean gap by a spring that pulls it to a target; under load control there is none.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Spring {
    pub stiffness: f64,
    pub target: f64,
}

/// One grid of the hierarchy: the state on it, and what is needed to improve it.
///
/// The heights are nowhere stored on nodes: `K(g - h)` is the transform of the gap minus the heights' Fourier series,
/// which the column pass subtracts.
pub(super) struct Level<'h, T: Real, K, L> {
    pub transform: Transform<T>,
    /// Of the state and, in its first bytes, of the linear problem.
    spectrum: Vec<Complex<T>>,
    pub body: Body<K, L>,
    heights: &'h Series<T>,
    pub gap: Vec<T>,
    pub inner: Inner,
    pub pressure: f64,
    pub spring: Spring,
    pub pairs: f64,
    /// Balance of the state that the last improvement ended in.
    pub last: Balance,
}

/// A trial state: its balance, and the inner products of its KKT residual with itself and with the one before.
pub(super) struct Trial {
    pub balance: Balance,
    pub rr: f64,
    pub rr_old: f64,
}

/// Multiplication of the displacement `g - h` by the kernel, from the transform of the gap.
struct Displaced<'h, T, K> {
    grid: Grid,
    kernel: K,
    heights: &'h Series<T>,
    spring: Spring,
}

impl<T: Real, K: Kernel> Filter<T> for Displaced<'_, T, K> {
    fn apply(&self, i: usize, column: &mut [Complex<T>]) -> f64 {
        let points = self.grid.points() as f64;
        self.heights.add_to(i, self.grid, column, T::of(-points));
        if i == 0 {
            column[0] -= T::of(points * self.spring.target);
        }
        multiply((&self.kernel, Factor::Stiffness, self.spring.stiffness), self.grid, i, column)
    }
}

impl<'h, T: Real, K: Kernel, L: Law> Level<'h, T, K, L> {
    /// A level whose gap is still to be given.
    fn empty(grid: Grid, (kernel, law): (K, L), heights: &'h Series<T>, spectrum: Vec<Complex<T>>) -> Self {
        Level {
            spectrum,
            transform: Transform::new(grid),
            body: Body { kernel, law, spring: 0.0 },
            heights,
            gap: Vec::new(),
            inner: Inner::idle(grid),
            pressure: 0.0,
            spring: Spring::default(),
            pairs: 0.0,
            last: Balance::default(),
        }
    }

    /// No displacement: the surfaces at first touch.
    pub fn touching(grid: Grid, body: (K, L), heights: &'h Series<T>) -> Self {
        let transform = Transform::<T>::new(grid);
        let mut level = Self::empty(grid, body, heights, transform.spectrum());
        level.gap = heights.on_nodes(&transform, &mut level.spectrum);
        let least = lowest(&level.gap);
        level.gap.par_iter_mut().for_each(|g| *g -= least);
        level
    }

    /// A given gap.
    pub fn with_gap(grid: Grid, body: (K, L), heights: &'h Series<T>, gap: Vec<T>) -> Self {
        let mut level = Self::empty(grid, body, heights, Transform::<T>::new(grid).spectrum());
        level.gap = gap;
        level
    }

    /// Displacement of a coarser level, as its Fourier series, on this grid; the gap is what it leaves open. In Fourier
    /// space that is the coarse gap where the coarse grid holds the mode, and the heights where it does not.
    pub fn refined(grid: Grid, law: L, coarse: Level<'h, T, K, L>) -> Self {
        let Level { transform: from, spectrum: mut known, body, heights, gap, pressure, spring, .. } = coarse;
        from.forward(&gap, &mut known);
        drop(gap);
        let old = from.grid();
        let held = |k: usize, n: usize| k == 0 || 2 * k < n;
        let transform = Transform::<T>::new(grid);
        let mut level = Self::empty(grid, (body.kernel, law), heights, transform.spectrum());
        level.gap = vec![T::zero(); grid.points()];
        let per_point = T::of(1.0 / old.points() as f64);
        // Modes that both grids hold below their Nyquist modes.
        let top = (0..=grid.ny / 2).rev().find(|&k| held(k, old.ny) && held(k, grid.ny)).unwrap_or(0);
        let fill = |i: usize, column: &mut [Complex<T>]| {
            column.fill(Complex::default());
            heights.add_to(i, grid, column, T::one());
            if held(i, old.nx) && held(i, grid.nx) {
                let at = |row: usize| known[row * old.half() + i].scale(per_point);
                (0..=top).for_each(|k| column[k] = at(k));
                (1..=top).for_each(|k| column[grid.ny - k] = at(old.ny - k));
            }
            0.0
        };
        transform.inverse_after(&mut level.spectrum, &mut level.gap, &fill);
        drop(known);
        if L::HARD {
            level.gap.par_iter_mut().for_each(|g| *g = g.max(T::zero()));
        }
        (level.pressure, level.spring) = (pressure, spring);
        level
    }

    /// Allocates the working arrays.
    pub fn prepare(&mut self) {
        self.inner.allocate();
        self.body.spring = self.spring.stiffness;
    }

    pub fn grid(&self) -> Grid {
        self.transform.grid()
    }

    /// Bytes of a level, the heights' series left out.
    pub fn bytes(grid: Grid) -> u64 {
        (grid.points() * size_of::<T>()) as u64 + Transform::<T>::spectrum_bytes(grid) + Inner::bytes(grid)
    }

    fn displaced(&self) -> Displaced<'h, T, K> {
        Displaced { grid: self.grid(), kernel: self.body.kernel, heights: self.heights, spring: self.spring }
    }

    /// See [`Inner::plain`].
    pub fn plain(&mut self, beta: f64) -> (f64, f64) {
        let spectrum = bytemuck::cast_slice_mut(&mut self.spectrum);
        let len = self.transform.grid().ny * self.transform.grid().half();
        self.inner.plain(beta, &mut self.gap, &mut spectrum[..len], &self.body)
    }

    /// See [`Inner::newton`].
    pub fn newton(&mut self, accuracy: (f64, f64, usize), stopping: &dyn Fn() -> bool) -> Option<f64> {
        let spectrum = bytemuck::cast_slice_mut(&mut self.spectrum);
        let len = self.transform.grid().ny * self.transform.grid().half();
        self.inner.newton(&mut self.gap, &mut spectrum[..len], &self.body, accuracy, stopping)
    }

    /// Balance and gradient where the gap is changed by `scale` times the step; the gap itself stays. One pair.
    pub fn trial(&mut self, scale: f64) -> Trial {
        let grid = self.grid();
        let (nx, half) = (grid.nx, grid.half());
        let filter = self.displaced();
        let (transform, law) = (&self.transform, &self.body.law);
        let (pressure, scale) = (T::of(self.pressure), T::of(scale));
        self.spectrum
            .par_chunks_mut(half)
            .zip(self.gap.par_chunks(nx))
            .zip(self.inner.step.par_chunks(nx))
            .for_each_init(
                || transform.worker(),
                |worker, ((spectrum, gap), step)| {
                    vectorised(
                        #[inline(always)]
                        || {
                            for ((w, &g), &s) in worker.row.iter_mut().zip(gap).zip(step) {
                                *w = moved::<L, T>(g, scale, s);
                            }
                        },
                    );
                    worker.forward(spectrum);
                },
            );
        let elastic = 0.5 * transform.filter_columns(&mut self.spectrum, &filter);
        let rows: Vec<[f64; KKT]> = self
            .spectrum
            .par_chunks_mut(half)
            .zip(self.gap.par_chunks(nx))
            .zip(self.inner.step.par_chunks(nx))
            .zip(self.inner.residual.par_chunks_mut(nx))
            .map_init(
                || transform.worker(),
                |worker, (((spectrum, gap), step), residual)| {
                    worker.inverse(spectrum);
                    let row = &worker.row[..];
                    vectorised(
                        #[inline(always)]
                        || {
                            let mut sums = [0.0; KKT];
                            let chunks = gap.chunks(CHUNK).zip(step.chunks(CHUNK)).zip(row.chunks(CHUNK));
                            for (((gap, step), row), residual) in chunks.zip(residual.chunks_mut(CHUNK)) {
                                let mut nodes = Nodes::new();
                                for ((to, &g), &s) in nodes.gap.iter_mut().zip(gap).zip(step) {
                                    *to = moved::<L, T>(g, scale, s);
                                }
                                for ((old, g), r) in nodes.old.iter_mut().zip(gap).zip(&*residual) {
                                    *old = f64::from(kkt::<L, f32>(g.wide() as f32, *r));
                                }
                                nodes.imbalance.iter_mut().zip(row).for_each(|(t, &r)| *t = r + pressure);
                                nodes.add_to(gap.len(), law, &mut sums);
                                residual.iter_mut().zip(&nodes.imbalance).for_each(|(r, t)| *r = t.wide() as f32);
                            }
                            sums
                        },
                    )
                },
            )
            .collect();
        self.pairs += 1.0;
        let sums = block_sums(&rows);
        let n = grid.points() as f64;
        Trial { balance: Balance::new(grid.points(), elastic, &sums), rr: sums[0] / n, rr_old: sums[6] / n }
    }

    /// Makes the last trial the state.
    pub fn accept(&mut self, scale: f64) {
        self.inner.pending = scale;
    }

    /// The gap with what is pending.
    pub fn settle(&mut self) {
        self.inner.settle::<T, L>(&mut self.gap);
    }

    /// Transforms done, in pairs of this grid.
    pub fn pairs(&self) -> f64 {
        self.pairs + self.inner.pairs
    }

    /// Interfacial stress `p + K(g - h)` at the gap as it is, with the balance there; one pair. The working arrays go first.
    pub fn stress(&mut self) -> (Balance, Vec<T>) {
        self.settle();
        self.inner.release();
        let grid = self.grid();
        let (nx, half) = (grid.nx, grid.half());
        let filter = self.displaced();
        let (transform, law) = (&self.transform, &self.body.law);
        let pressure = T::of(self.pressure);
        self.spectrum.par_chunks_mut(half).zip(self.gap.par_chunks(nx)).for_each_init(
            || transform.worker(),
            |worker, (spectrum, gap)| {
                worker.row.copy_from_slice(gap);
                worker.forward(spectrum);
            },
        );
        let elastic = 0.5 * transform.filter_columns(&mut self.spectrum, &filter);
        let mut stress = vec![T::zero(); grid.points()];
        let rows: Vec<[f64; KKT]> = self
            .spectrum
            .par_chunks_mut(half)
            .zip(self.gap.par_chunks(nx))
            .zip(stress.par_chunks_mut(nx))
            .map_init(
                || transform.worker(),
                |worker, ((spectrum, gap), stress)| {
                    worker.inverse(spectrum);
                    for (w, s) in worker.row.iter_mut().zip(stress) {
                        *w += pressure;
                        *s = *w;
                    }
                    kkt_row(law, gap, &mut worker.row)
                },
            )
            .collect();
        self.pairs += 1.0;
        (Balance::new(grid.points(), elastic, &block_sums(&rows)), stress)
    }
}
