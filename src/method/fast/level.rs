use super::column::{Factor, multiply};
use super::inner::{Body, Inner};
use super::rows;
use super::window::{Cell, Window};
use crate::grid::{Filter, Grid, HalfSpectrum, Real, Series, Transform, lowest};
use crate::interface::{Kernel, Law};
use crate::method::Precision;
use crate::method::residuals::{KKT, Residuals, RowLaw};
use crate::method::sweep::{each_row, shift, sweep, sweep_sums, weight_below, weighted_quantile};
use rayon::prelude::*;
use rustfft::num_complex::Complex;

/// Spring that controls the mean gap; zero stiffness under load control.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Spring {
    pub stiffness: f64,
    pub target: f64,
}

/// One grid of the hierarchy with its state and working arrays.
///
/// Heights are not stored on nodes: the column pass subtracts their Fourier series from the transform of the gap in
/// `K(g - h)`.
pub(super) struct Level<'h, T: Real, K, L> {
    pub transform: Transform<T>,
    /// Shared by the state and, in its first bytes, the linear problem in f32.
    spectrum: HalfSpectrum<T>,
    pub body: Body<K, L>,
    heights: &'h Series<T>,
    cell: Cell,
    pub window: Window,
    pub gap: Vec<T>,
    pub inner: Inner,
    pub pressure: f64,
    pub spring: Spring,
    pub pairs: f64,
    /// Residuals of the final state of the last solve.
    pub last: Residuals,
}

/// A trial state: residuals, and the inner products of its KKT residual with itself and with the previous one.
pub(super) struct Trial {
    pub residuals: Residuals,
    pub rr: f64,
    pub rr_old: f64,
}

/// Multiplies the displacement `g - h` by the kernel, given the transform of the gap.
struct Displaced<'h, T, K> {
    grid: Grid,
    kernel: K,
    heights: &'h Series<T>,
    spring: Spring,
}

impl<T: Real, W: Real, K: Kernel> Filter<W> for Displaced<'_, T, K> {
    fn apply(&self, i: usize, column: &mut [Complex<W>]) -> f64 {
        let points = self.grid.points() as f64;
        self.heights.add_to(i, self.grid, column, W::of(-points));
        if i == 0 {
            column[0] -= W::of(points * self.spring.target);
        }
        multiply((&self.kernel, Factor::Stiffness, self.spring.stiffness), self.grid, i, column)
    }
}

impl<'h, T: Real, K: Kernel, L: Law> Level<'h, T, K, L> {
    /// A level without a gap.
    fn empty(grid: Grid, (kernel, law): (K, L), heights: &'h Series<T>, cell: Cell, spectrum: HalfSpectrum<T>) -> Self {
        let window = cell.window(grid);
        Level {
            cell,
            window,
            spectrum,
            transform: Transform::new(grid),
            body: Body { kernel, law, spring: 0.0 },
            heights,
            gap: Vec::new(),
            inner: Inner::idle(grid, window),
            pressure: 0.0,
            spring: Spring::default(),
            pairs: 0.0,
            last: Residuals::default(),
        }
    }

    /// A level at first contact, without displacement.
    pub(super) fn at_first_contact(grid: Grid, body: (K, L), heights: &'h Series<T>, cell: Cell) -> Self {
        let transform = Transform::<T>::new(grid);
        let mut level = Self::empty(grid, body, heights, cell, transform.spectrum());
        level.gap = heights.on_nodes(&transform, &mut level.spectrum);
        let nx = grid.nx;
        let rows = level.gap.chunks(nx).enumerate();
        let least = rows.map(|(y, gap)| lowest(&gap[..level.window.inside(y, nx)])).fold(T::infinity(), T::min);
        shift(&mut level.gap, -least);
        level
    }

    /// A level with this gap.
    pub(super) fn with_gap(grid: Grid, body: (K, L), heights: &'h Series<T>, cell: Cell, gap: Vec<T>) -> Self {
        let mut level = Self::empty(grid, body, heights, cell, Transform::<T>::new(grid).spectrum());
        level.gap = gap;
        level
    }

    /// Fourier interpolation of the displacement of a coarser level to this grid. In Fourier space the gap is that of
    /// the coarse grid for the modes that it resolves, and the heights for the others.
    pub(super) fn refined(grid: Grid, law: L, coarse: Level<'h, T, K, L>) -> Self {
        let Level { transform: from, spectrum: mut known, body, heights, cell, gap, pressure, spring, last, .. } =
            coarse;
        from.forward(&gap, &mut known);
        let old = from.grid();
        let flows: Vec<bool> =
            if L::HARD && L::YIELDS { gap.iter().map(|g| *g < T::zero()).collect() } else { Vec::new() };
        drop(gap);
        let resolves = |k: usize, n: usize| k == 0 || 2 * k < n;
        let transform = Transform::<T>::new(grid);
        let mut level = Self::empty(grid, (body.kernel, law), heights, cell, transform.spectrum());
        level.gap = vec![T::zero(); grid.points()];
        let per_point = T::of(1.0 / old.points() as f64);
        // Modes below the Nyquist modes of both grids.
        let top = (0..=grid.ny / 2).rev().find(|&k| resolves(k, old.ny) && resolves(k, grid.ny)).unwrap_or(0);
        let fill = |i: usize, column: &mut [Complex<T>]| {
            column.fill(Complex::default());
            heights.add_to(i, grid, column, T::one());
            if resolves(i, old.nx) && resolves(i, grid.nx) {
                let at = |row: usize| known[row * old.pitch() + i].scale(per_point);
                (0..=top).for_each(|k| column[k] = at(k));
                (1..=top).for_each(|k| column[grid.ny - k] = at(old.ny - k));
            }
            0.0
        };
        transform.inverse_after(&mut level.spectrum, &mut level.gap, &fill);
        drop(known);
        if L::HARD {
            let window = level.window;
            each_row(&mut level.gap, grid.nx, |y, gap| {
                let facing = &mut gap[..window.inside(y, grid.nx)];
                if flows.is_empty() {
                    return facing.iter_mut().for_each(|g| *g = g.max(T::zero()));
                }
                // Nodes flow where the coarse grid's next node does.
                let row = (y * old.ny / grid.ny) * old.nx;
                for (x, g) in facing.iter_mut().enumerate() {
                    *g = if flows[row + x * old.nx / grid.nx] { -(-*g).max(T::zero()) } else { g.max(T::zero()) };
                }
            });
        }
        (level.pressure, level.spring) = (pressure, spring);
        // Interpolation over a steep edge may lift all contact. The fraction in contact is kept.
        if L::HARD && pressure > 0.0 && level.is_padded() && !level.touches() {
            level.approach((last.contact * level.window.points() as f64).round() as usize);
        }
        level
    }

    /// Whether only a part of the cell faces the rigid surface.
    pub(super) fn is_padded(&self) -> bool {
        self.window.points() < self.grid().points()
    }

    /// Whether a facing node is closed.
    fn touches(&self) -> bool {
        let nx = self.grid().nx;
        let mut rows = self.gap.chunks(nx).enumerate();
        rows.any(|(y, gap)| gap[..self.window.inside(y, nx)].iter().any(|g| *g <= T::zero()))
    }

    /// Shifts the gap rigidly so that (at least) `nodes` facing nodes close, without overlap.
    pub(super) fn approach(&mut self, nodes: usize) {
        self.apply_pending();
        let nx = self.grid().nx;
        let mut facing = self.window.cut(&self.gap, nx);
        let last = nodes.clamp(1, facing.len()) - 1;
        let (_, &mut by, _) = facing.select_nth_unstable_by(last, |a, b| a.wide().total_cmp(&b.wide()));
        let window = self.window;
        each_row(&mut self.gap, nx, |y, gap| {
            let (facing, padding) = gap.split_at_mut(window.inside(y, nx));
            facing.iter_mut().for_each(|g| *g = (*g - by).max(T::zero()));
            padding.iter_mut().for_each(|g| *g -= by);
        });
    }

    /// Exact line search along the rigid approach of a periodic body that yields: only the flow resists it, so that at the
    /// minimum the flowing nodes carry at most the load, and with the closed ones at least the load. True if the gap moved.
    pub(super) fn balance_flow(&mut self) -> bool {
        if !(L::HARD && L::YIELDS) || L::ACTIVE || self.is_padded() || self.spring.stiffness > 0.0 {
            return false;
        }
        self.apply_pending();
        let hardness = self.body.law.hardness();
        // Loads in multiples of that of a node of mean hardness.
        let (mean, uniform) = (hardness.mean(), hardness.map().is_none());
        let weight = |i: usize| if uniform { 1.0 } else { hardness.at(i) / mean };
        let carrying = self.pressure / mean * self.gap.len() as f64;
        let [flowing, closed] = weight_below((&self.gap, self.grid().nx), T::zero(), weight);
        if carrying < 1.0 || flowing <= carrying && carrying <= closed {
            return false;
        }
        let by = weighted_quantile(&self.gap, weight, carrying);
        shift(&mut self.gap, -by);
        by != T::zero()
    }

    /// Allocates the working arrays.
    pub(super) fn prepare(&mut self) {
        self.inner.allocate();
        self.body.spring = self.spring.stiffness;
    }

    pub(super) fn grid(&self) -> Grid {
        self.transform.grid()
    }

    /// Bytes of a level without the series of the heights.
    pub(super) fn bytes(grid: Grid) -> u64 {
        (grid.points() * size_of::<T>()) as u64 + Transform::<T>::spectrum_bytes(grid) + Inner::bytes(grid)
    }

    fn displaced(&self) -> Displaced<'h, T, K> {
        Displaced { grid: self.grid(), kernel: self.body.kernel, heights: self.heights, spring: self.spring }
    }

    /// See [`Inner::plain`].
    pub(super) fn plain(&mut self, beta: f64) -> (f64, f64) {
        let len = self.spectrum.len();
        let spectrum = bytemuck::cast_slice_mut(&mut self.spectrum);
        self.inner.plain(beta, &mut self.gap, &mut spectrum[..len], &self.body)
    }

    /// See [`Inner::newton`].
    pub(super) fn newton(&mut self, accuracy: (f64, f64, usize), stopping: &dyn Fn() -> bool) -> Option<f64> {
        let len = self.spectrum.len();
        let spectrum = bytemuck::cast_slice_mut(&mut self.spectrum);
        let excess = self.inner.newton(&mut self.gap, &mut spectrum[..len], &self.body, accuracy, stopping);
        excess.map(|e| e * self.grid().points() as f64 / self.window.points() as f64)
    }

    /// The pressure on the facing nodes averaged over the whole cell, the mean of the elastic stress.
    fn spread(&self) -> f64 {
        self.pressure * self.window.points() as f64 / self.grid().points() as f64
    }

    /// Residuals and gradient at the gap plus `scale` times the step, without changing the gap. One transform pair,
    /// in f32 where that suffices.
    pub(super) fn trial(&mut self, scale: f64, precision: Precision) -> Trial {
        let filter = self.displaced();
        let (pressure, scale) = (T::of(self.spread()), T::of(scale));
        let (gap, law, window) = (&self.gap, &self.body.law, self.window);
        let (elastic, sums) = match precision {
            Precision::F32 => {
                let len = self.spectrum.len();
                let spectrum = &mut bytemuck::cast_slice_mut(&mut self.spectrum)[..len];
                let Inner { transform, step, residual, .. } = &mut self.inner;
                tried::<T, f32, K, L>(
                    (transform, &filter),
                    spectrum,
                    (gap, scale, step),
                    (law, window, pressure),
                    residual,
                )
            }
            Precision::F64 => {
                let Inner { step, residual, .. } = &mut self.inner;
                let to = (&self.transform, &filter);
                tried::<T, T, K, L>(to, &mut self.spectrum, (gap, scale, step), (law, window, pressure), residual)
            }
        };
        self.pairs += 1.0;
        let n = self.grid().points() as f64;
        Trial { residuals: self.residuals(elastic, &sums), rr: sums[0] / n, rr_old: sums[KKT - 1] / n }
    }

    /// Residuals per area of the facing nodes, from the sums over these and over the padding.
    fn residuals(&self, elastic: f64, sums: &[f64; KKT + 1]) -> Residuals {
        let (facing, all) = (self.window.points(), self.grid().points());
        let (per_facing, mean) = (all as f64 / facing as f64, self.cell.mean_mode(self.pressure));
        let residuals = Residuals::new(facing, per_facing * elastic, &sums[..KKT]);
        if all == facing {
            return residuals;
        }
        let mean_separation = (sums[3] + sums[KKT]) / all as f64 - mean.1;
        Residuals { elastic: residuals.elastic + mean.0, mean_separation, ..residuals }
    }

    /// Accepts the last trial state.
    pub(super) fn accept(&mut self, scale: f64) {
        self.inner.pending = scale;
    }

    /// Applies the pending step to the gap.
    pub(super) fn apply_pending(&mut self) {
        self.inner.apply_pending::<T, L>(&mut self.gap);
    }

    /// Transform pairs on this grid so far.
    pub(super) fn pairs(&self) -> f64 {
        self.pairs + self.inner.pairs
    }

    /// Residuals and interfacial stress `p + K(g - h)` at the present gap; one transform pair. Releases the working
    /// arrays.
    pub(super) fn stress(&mut self) -> (Residuals, Vec<T>) {
        self.apply_pending();
        self.inner.release();
        let grid = self.grid();
        let (nx, window, filter) = (grid.nx, self.window, self.displaced());
        let (transform, law) = (&self.transform, &self.body.law);
        let pressure = T::of(self.spread());
        sweep(transform, &mut self.spectrum, self.gap.par_chunks(nx), |worker, _, spectrum, gap| {
            worker.row.copy_from_slice(gap);
            worker.forward(spectrum);
        });
        let elastic = 0.5 * transform.filter_columns(&mut self.spectrum, &filter);
        let mut stress = vec![T::zero(); grid.points()];
        let fields = self.gap.par_chunks(nx).zip(stress.par_chunks_mut(nx));
        let sums = sweep_sums(transform, &mut self.spectrum, fields, |worker, y, spectrum, (gap, stress)| {
            worker.inverse(spectrum);
            for (w, s) in worker.row.iter_mut().zip(stress) {
                *w += pressure;
                *s = *w;
            }
            rows::residuals(RowLaw::of(law, y, window.nx), window.inside(y, nx), gap, &mut worker.row)
        });
        self.pairs += 1.0;
        (self.residuals(elastic, &sums), stress)
    }
}

/// Transform pair of a trial in precision `W`: elastic energy and the sums of [`rows::trial`].
fn tried<T: Real, W: Real, K: Kernel, L: Law>(
    (transform, filter): (&Transform<W>, &Displaced<'_, T, K>),
    spectrum: &mut [Complex<W>],
    (gap, scale, step): (&[T], T, &[f32]),
    (law, window, pressure): (&L, Window, T),
    residual: &mut [f32],
) -> (f64, [f64; KKT + 1]) {
    let nx = transform.grid().nx;
    let fields = gap.par_chunks(nx).zip(step.par_chunks(nx));
    sweep(transform, spectrum, fields, |worker, y, spectrum, (gap, step)| {
        rows::shifted::<L, T, W>(window.inside(y, nx), gap, scale, step, &mut worker.row);
        worker.forward(spectrum);
    });
    let elastic = 0.5 * transform.filter_columns(spectrum, filter);
    let fields = gap.par_chunks(nx).zip(step.par_chunks(nx)).zip(residual.par_chunks_mut(nx));
    let sums = sweep_sums(transform, spectrum, fields, |worker, y, spectrum, ((gap, step), residual)| {
        worker.inverse(spectrum);
        rows::trial(
            RowLaw::of(law, y, window.nx),
            window.inside(y, nx),
            (gap, scale, step),
            (&worker.row, pressure),
            residual,
        )
    });
    (elastic, sums)
}
