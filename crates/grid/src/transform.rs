//! Two-dimensional real transform in three passes: rows, columns (forward, filter and inverse while a column is in
//! cache), rows.
//!
//! A solver owns one half spectrum (see [`HalfSpectrum`]) and its real fields; transforms allocate no fields. The
//! solver processes rows one by one with a [`Worker`], so the pointwise law and the sums are evaluated while a row is
//! in cache, between the inverse row transforms of one pair and the forward row transforms of the next.
//!
//! Several ranks share a grid as slabs: each has some of the rows of every field and of the half spectrum. Only the column pass
//! exchanges data (see [`Slab`]); results have the same bits on any number of ranks.

use super::columns::{Direction, FillColumn, SharedSpectrum, SpectralFilter, SpectrumColumns};
use super::rows::Rows;
use super::slab::{ColumnMatrix, Slab};
use super::{COLUMNS, Grid, HalfSpectrum, Real, sums_of_ranks};
use crate::sys::ColumnBlocks;
use crate::sys::ranks::Ranks;
use rayon::prelude::*;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftDirection};
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Distance of the prefetch in rows: rows are a page apart, which hardware prefetchers do not follow. At 2048² in
/// f32, 8 rows save a third of the time, 16 half of it, 32 two thirds.
const AHEAD: usize = 32;
/// Columns of a block are `ny + PAD` elements apart, so that they do not share cache sets at power-of-two heights.
const PAD: usize = 8;

/// Nodes transformed since the program started.
static TRANSFORMED: AtomicU64 = AtomicU64::new(0);

/// Number of nodes transformed, forward or inverse, since the program started: the cost of solving without the noise
/// of a clock.
pub fn transformed_nodes() -> u64 {
    TRANSFORMED.load(Ordering::Relaxed)
}

/// Plans for one grid, shared by all threads; with several ranks, each for its rows.
pub struct Transform<T: Real> {
    grid: Grid,
    slab: Slab<T>,
    rows: Rows<T>,
    forward_column: Arc<dyn Fft<T>>,
    inverse_column: Arc<dyn Fft<T>>,
}

/// Scratch space of one thread for row transforms, and a row for the caller's data.
pub struct Worker<'t, T: Real> {
    transform: &'t Transform<T>,
    scratch: Vec<Complex<T>>,
    /// Real row of `nx` points for the caller's data.
    pub row: Vec<T>,
}

impl<T: Real> Transform<T> {
    pub fn new(grid: Grid) -> Self {
        Self::shared(grid, &Ranks::default())
    }

    /// The same, of a grid whose rows these ranks share.
    pub fn shared(grid: Grid, ranks: &Ranks) -> Self {
        Transform {
            grid,
            slab: Slab::new(grid, ranks),
            rows: Rows::new(grid.nx),
            forward_column: T::plan(grid.ny, FftDirection::Forward),
            inverse_column: T::plan(grid.ny, FftDirection::Inverse),
        }
    }

    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// The ranks that share the grid.
    pub fn ranks(&self) -> &Ranks {
        self.slab.ranks()
    }

    /// The rows of this rank: all where the grid is not shared.
    pub fn own_rows(&self) -> Range<usize> {
        self.slab.rows()
    }

    /// Nodes in the rows of this rank.
    pub fn own_points(&self) -> usize {
        self.own_rows().len() * self.grid.nx
    }

    /// The rows of all ranks of a field, on the first rank; nothing on the others.
    pub fn gather_on_first<V: bytemuck::Pod>(&self, local: &[V]) -> Vec<V> {
        self.ranks().gather_on_first(local, &self.ranks().shares(self.grid.ny, self.grid.nx))
    }

    /// Adds the sums of all rows in order, given those of the rows of this rank.
    pub fn sum_rows<const K: usize>(&self, local: &[[f64; K]]) -> [f64; K] {
        sums_of_ranks(self.ranks(), self.grid.ny, local)
    }

    /// A zeroed half spectrum.
    pub fn spectrum(&self) -> HalfSpectrum<T> {
        HalfSpectrum::of(self.own_rows().len() * self.grid.pitch())
    }

    /// Bytes of a half spectrum.
    pub fn spectrum_bytes(grid: Grid) -> u64 {
        (grid.ny * grid.pitch() * size_of::<Complex<T>>()) as u64
    }

    pub fn worker(&self) -> Worker<'_, T> {
        Worker { transform: self, scratch: self.rows.scratch(), row: vec![T::default(); self.grid.nx] }
    }

    /// The column pass: forward, `filter`, inverse. Returns the ordered sum of the filter's results.
    pub fn filter_columns(&self, spectrum: &mut [Complex<T>], filter: &dyn SpectralFilter<T>) -> f64 {
        self.columns(spectrum, filter, Direction::Both)
    }

    /// The ordered sum of the filter's results over the columns of a spectrum whose rows are transformed already. The
    /// spectrum is unchanged.
    pub fn sum_columns(&self, spectrum: &mut [Complex<T>], filter: &dyn SpectralFilter<T>) -> f64 {
        self.columns(spectrum, filter, Direction::Sum)
    }

    /// Real field to half spectrum, un-normalised (`Σ f e^{-iqr}`).
    pub fn forward(&self, field: &[T], spectrum: &mut [Complex<T>]) {
        self.forward_filtered(field, spectrum, &|_: usize, _: &mut [Complex<T>]| 0.0);
    }

    /// As [`Transform::forward`], for a field whose rows `fill` writes.
    pub fn forward_of(&self, fill: &(dyn Fn(usize, &mut [T]) + Sync), spectrum: &mut [Complex<T>]) {
        let top = self.own_rows().start;
        spectrum.par_chunks_mut(self.grid.pitch()).enumerate().for_each_init(
            || self.worker(),
            |worker, (y, spec)| {
                fill(top + y, &mut worker.row);
                worker.forward(spec);
            },
        );
        self.columns(spectrum, &|_: usize, _: &mut [Complex<T>]| 0.0, Direction::Forward);
    }

    /// As [`Transform::forward`], then applies `filter` to every column. Returns the ordered sum of its results.
    pub fn forward_filtered(&self, field: &[T], spectrum: &mut [Complex<T>], filter: &dyn SpectralFilter<T>) -> f64 {
        let (nx, pitch) = (self.grid.nx, self.grid.pitch());
        spectrum.par_chunks_mut(pitch).zip(field.par_chunks(nx)).for_each_init(
            || self.worker(),
            |worker, (spec, row)| {
                worker.row.copy_from_slice(row);
                worker.forward(spec);
            },
        );
        self.columns(spectrum, filter, Direction::Forward)
    }

    /// Half spectrum to real field, un-normalised; the spectrum is overwritten.
    pub fn inverse(&self, spectrum: &mut [Complex<T>], field: &mut [T]) {
        self.inverse_after(spectrum, field, &|_: usize, _: &mut [Complex<T>]| 0.0);
    }

    /// As [`Transform::inverse`], with `filter` applied to every column first.
    pub fn inverse_after(&self, spectrum: &mut [Complex<T>], field: &mut [T], filter: &dyn SpectralFilter<T>) {
        self.columns(spectrum, filter, Direction::Inverse);
        self.inverse_rows(spectrum, field);
    }

    fn inverse_rows(&self, spectrum: &mut [Complex<T>], field: &mut [T]) {
        let (nx, pitch) = (self.grid.nx, self.grid.pitch());
        spectrum.par_chunks_mut(pitch).zip(field.par_chunks_mut(nx)).for_each_init(
            || self.worker(),
            |worker, (spec, row)| {
                worker.inverse(spec);
                row.copy_from_slice(&worker.row);
            },
        );
    }

    /// Half spectrum to real field, un-normalised, of a spectrum that `fill` sets column by column from that of `source`, a grid
    /// shared by the same ranks or by none. The spectrum is overwritten.
    pub fn inverse_filled(
        &self,
        spectrum: &mut [Complex<T>],
        field: &mut [T],
        source: Option<SharedSpectrum<'_, T>>,
        fill: &FillColumn<'_, T>,
    ) {
        let pass = |matrix: ColumnMatrix<'_, T>, known: &SpectrumColumns<'_, T>| {
            let filter = |i: usize, column: &mut [Complex<T>]| {
                fill(i, known, column);
                0.0
            };
            self.pass(matrix, &filter, Direction::Inverse);
        };
        if self.ranks().are_several() {
            self.slab.fill_columns(spectrum, source, &pass);
        } else {
            let known = source.as_ref().map_or(SpectrumColumns::NONE, SharedSpectrum::columns);
            pass((&mut *spectrum, self.grid.pitch(), 0), &known);
        }
        self.inverse_rows(spectrum, field);
    }

    fn columns(&self, spectrum: &mut [Complex<T>], filter: &dyn SpectralFilter<T>, direction: Direction) -> f64 {
        let sums = match self.ranks().are_several() {
            true => {
                let pass = |matrix: ColumnMatrix<'_, T>| self.pass(matrix, filter, direction);
                self.slab.columns(spectrum, direction != Direction::Sum, &pass)
            }
            false => self.pass((spectrum, self.grid.pitch(), 0), filter, direction),
        };
        sums.iter().sum()
    }

    /// Transforms the columns of a matrix of `ny` rows, `pitch` elements apart, whose first column has the number `first`. Returns the
    /// sum of each block of columns. Compiled once for all filters.
    fn pass(
        &self,
        (matrix, pitch, first): ColumnMatrix<'_, T>,
        filter: &dyn SpectralFilter<T>,
        direction: Direction,
    ) -> Vec<f64> {
        let (ny, half) = (self.grid.ny, (self.grid.half() - first).min(pitch));
        let times = if direction == Direction::Both { 2 } else { 1 };
        let nodes = (ny * self.grid.nx * half).div_ceil(self.grid.half());
        TRANSFORMED.fetch_add(times * nodes as u64, Ordering::Relaxed);
        let stride = ny + PAD;
        let scratch = self.forward_column.get_inplace_scratch_len().max(self.inverse_column.get_inplace_scratch_len());
        let buffers = || (vec![Complex::default(); COLUMNS * stride], vec![Complex::default(); scratch]);
        let blocks = ColumnBlocks::new(matrix, pitch, COLUMNS);
        blocks.map_init(buffers, |(columns, scratch), mut block| {
            for y in 0..ny {
                block.fetch(y + AHEAD);
                let row = block.row(y);
                match row.first_chunk::<COLUMNS>() {
                    Some(row) => (0..COLUMNS).for_each(|c| columns[c * stride + y] = row[c]),
                    None => row.iter().enumerate().for_each(|(c, value)| columns[c * stride + y] = *value),
                }
            }
            let mut sum = 0.0;
            for (c, column) in columns.chunks_mut(stride).take(half - block.first()).enumerate() {
                let column = &mut column[..ny];
                if direction != Direction::Inverse {
                    self.forward_column.process_with_scratch(column, scratch);
                }
                sum += filter.apply(first + block.first() + c, column);
                if matches!(direction, Direction::Both | Direction::Inverse) {
                    self.inverse_column.process_with_scratch(column, scratch);
                }
            }
            if direction != Direction::Sum {
                for y in 0..ny {
                    let row = block.row(y);
                    match row.first_chunk_mut::<COLUMNS>() {
                        Some(row) => (0..COLUMNS).for_each(|c| row[c] = columns[c * stride + y]),
                        None => row.iter_mut().enumerate().for_each(|(c, value)| *value = columns[c * stride + y]),
                    }
                }
            }
            sum
        })
    }
}

impl<T: Real> Worker<'_, T> {
    /// Transforms `row`, which is overwritten, to a row of the spectrum.
    pub fn forward(&mut self, spectrum: &mut [Complex<T>]) {
        let Transform { grid, rows, .. } = self.transform;
        rows.forward(&mut self.row, &mut spectrum[..grid.half()], &mut self.scratch);
    }

    /// Transforms a row of the spectrum, which is overwritten, to `row`.
    pub fn inverse(&mut self, spectrum: &mut [Complex<T>]) {
        let Transform { grid, rows, .. } = self.transform;
        rows.inverse(&mut spectrum[..grid.half()], &mut self.row, &mut self.scratch);
    }
}

/// The smallest even number from `smallest` (and 2) on without prime factors above 5, for which transforms are fast.
pub fn next_fast_len(smallest: usize) -> usize {
    let is_smooth = |mut n: usize| {
        for factor in [2, 3, 5] {
            while n.is_multiple_of(factor) {
                n /= factor;
            }
        }
        n == 1
    };
    (smallest.max(2)..).find(|&n| n.is_multiple_of(2) && is_smooth(n)).expect("powers of two have no end")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signed_mode;
    use std::f64::consts::PI;

    #[test]
    fn fast_lengths_have_small_prime_factors() {
        assert_eq!([0, 3, 128, 129, 256, 257].map(next_fast_len), [2, 4, 128, 144, 256, 270]);
    }

    fn sample(grid: Grid) -> Vec<f64> {
        (0..grid.points()).map(|i| ((i * i + 7 * i) % 101) as f64 / 17.0 - 2.0).collect()
    }

    /// Round trip, and every coefficient against the direct sum, on even, odd, prime, flat and single-point grids,
    /// and on rows long enough to be folded and gathered in batches, with and without a remainder.
    #[test]
    fn transforms_equal_the_direct_sum() {
        /// Rounding of a sum of at most 144 terms of size 4.
        const TOLERANCE: f64 = 1e-11;
        for (nx, ny) in [(1, 1), (2, 1), (1, 7), (8, 6), (9, 5), (13, 4), (6, 20), (66, 2), (72, 2), (70, 1)] {
            let grid = Grid::unit(nx, ny);
            let transform = Transform::<f64>::new(grid);
            let field = sample(grid);
            let mut spectrum = transform.spectrum();
            transform.forward(&field, &mut spectrum);
            for j in 0..ny {
                for i in 0..grid.half() {
                    let mut direct = Complex::new(0.0, 0.0);
                    for y in 0..ny {
                        for x in 0..nx {
                            let phase = -2.0
                                * PI
                                * (i as f64 * x as f64 / nx as f64 + signed_mode(j, ny) as f64 * y as f64 / ny as f64);
                            direct += Complex::from_polar(field[y * nx + x], phase);
                        }
                    }
                    let actual: Complex<f64> = spectrum[j * grid.pitch() + i];
                    assert!((actual - direct).norm() < TOLERANCE, "{nx}x{ny} mode {i},{j}: {actual} {direct}");
                }
            }
            let mut restored = vec![0.0; grid.points()];
            transform.inverse(&mut spectrum, &mut restored);
            for (b, f) in restored.iter().zip(&field) {
                assert!((b / grid.points() as f64 - f).abs() < TOLERANCE);
            }
        }
    }

    #[test]
    fn results_do_not_depend_on_the_number_of_threads() {
        let grid = Grid::unit(96, 50);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let transform = Transform::<f64>::new(grid);
                let mut spectrum = transform.spectrum();
                transform.forward(&sample(grid), &mut spectrum);
                let sum = transform.filter_columns(&mut spectrum, &|i: usize, column: &mut [Complex<f64>]| {
                    column.iter().map(|c| c.norm_sqr() * i as f64).sum()
                });
                (spectrum.iter().map(|c| (c.re.to_bits(), c.im.to_bits())).collect::<Vec<_>>(), sum.to_bits())
            })
        };
        assert_eq!(run(1), run(2));
        assert_eq!(run(1), run(5));
    }
}
