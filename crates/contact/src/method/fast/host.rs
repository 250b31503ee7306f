//! Arrays of a level in the memory of the host, swept by all threads.
//!
//! An iteration of the linear problem takes two column passes and two row sweeps. Step length and conjugation need inner
//! products that are sums over spectra (`⟨d K d⟩` and `⟨r K⁻¹ r⟩`), known before the inverse row transforms. A row is
//! therefore transformed back, updated and transformed forward while it is in cache, and the preconditioned residual is
//! not stored.

use super::column::{Factor, multiply};
use super::fields::{LevelFields, Metric, Spring, StateSums};
use super::rows;
use super::window::Window;
use crate::interface::{Elastic, Kernel, Law};
use crate::method::Precision;
use crate::method::residuals::RowLaw;
use crate::method::sweep::{each_row, sweep, sweep_sums};
use asperity_grid::sys::ranks::Ranks;
use asperity_grid::{
    Grid, HalfSpectrum, Real, Series, SharedSpectrum, SpectralFilter, SpectrumColumns, Transform, sharing,
};
use half::bf16;
use rayon::prelude::*;
use rustfft::num_complex::Complex;
use std::f64::consts::{PI, TAU};

/// A metric on the spectrum of a grid.
struct Multiplied<'k> {
    grid: Grid,
    kernel: &'k Elastic,
    metric: Metric,
}

impl SpectralFilter<f32> for Multiplied<'_> {
    fn apply(&self, i: usize, column: &mut [Complex<f32>]) -> f64 {
        let (factor, mean_stiffness) = match self.metric {
            Metric::Stiffness { mean_stiffness } => (Factor::Stiffness, mean_stiffness),
            Metric::Compliance { mean_stiffness } => (Factor::Compliance, 1.0 / mean_stiffness),
        };
        multiply((self.kernel, factor, mean_stiffness), self.grid, i, column)
    }
}

/// Multiplies the displacement `g - h` by the stiffness, given the transform of the gap.
struct Displaced<'h, T> {
    grid: Grid,
    kernel: Elastic,
    heights: &'h Series<T>,
    spring: Spring,
}

impl<T: Real, W: Real> SpectralFilter<W> for Displaced<'_, T> {
    fn apply(&self, i: usize, column: &mut [Complex<W>]) -> f64 {
        let points = self.grid.points() as f64;
        self.heights.add_to(i, self.grid, column, W::of(-points));
        if i == 0 {
            column[0] -= W::of(points * self.spring.target);
        }
        multiply((&self.kernel, Factor::Stiffness, self.spring.stiffness), self.grid, i, column)
    }
}

/// What a level consists of: elastic body, law of its grid, heights, and the nodes that face them.
#[derive(Clone, Copy)]
pub(super) struct LevelProblem<'h, T, L> {
    pub kernel: Elastic,
    pub law: L,
    /// Not stored on nodes: the column pass subtracts their Fourier series from the transform of the gap in `K(g - h)`.
    pub heights: &'h Series<T>,
    pub window: Window,
    /// Those that share the problem.
    pub ranks: &'h Ranks,
}

impl<'h, T, L> LevelProblem<'h, T, L> {
    /// The ranks that share a grid.
    pub(super) fn sharing(&self, grid: Grid) -> &'h Ranks {
        sharing(self.ranks, grid)
    }
}

/// On several ranks, the arrays have the rows of this one.
pub(super) struct Host<'h, T: Real, L> {
    body: LevelProblem<'h, T, L>,
    transform: Transform<T>,
    /// Of the linear problem, which is solved in f32 for any precision of the state.
    narrow: Transform<f32>,
    /// Shared by the state and, in its first bytes, the linear problem.
    spectrum: HalfSpectrum<T>,
    gap: Vec<T>,
    /// Change of the gap.
    step: Vec<f32>,
    /// Gradient `t` of the state; residual of the linear problem while it is being solved.
    residual: Vec<f32>,
    /// Search direction. Low precision suffices, since all products use the stored values. Negative zero marks closed
    /// nodes.
    direction: Vec<bf16>,
}

impl<'h, T: Real, L: Law> Host<'h, T, L> {
    /// With this gap, which may be empty until it is set, and without the working arrays.
    pub(super) fn new(grid: Grid, body: LevelProblem<'h, T, L>, gap: Vec<T>) -> Self {
        let ranks = body.sharing(grid);
        let transform = Transform::<T>::shared(grid, ranks);
        Host {
            body,
            spectrum: transform.spectrum(),
            transform,
            narrow: Transform::<f32>::shared(grid, ranks),
            gap,
            step: Vec::new(),
            residual: Vec::new(),
            direction: Vec::new(),
        }
    }

    /// With the heights on the nodes as gap.
    pub(super) fn undeformed(grid: Grid, body: LevelProblem<'h, T, L>) -> Self {
        let mut host = Self::new(grid, body, Vec::new());
        host.gap = body.heights.on_nodes(&host.transform, &mut host.spectrum);
        host
    }

    /// Fourier interpolation of the displacement of a coarser grid with this gap. In Fourier space the
    /// gap is that of the coarse grid for the modes that it resolves, and the heights for the others.
    pub(super) fn refined(grid: Grid, body: LevelProblem<'h, T, L>, (old, gap): (Grid, Vec<T>)) -> Self {
        let transform = Transform::shared(old, body.sharing(old));
        let mut known = transform.spectrum();
        transform.forward(&gap, &mut known);
        drop(gap);
        let resolves = |k: usize, n: usize| k == 0 || 2 * k < n;
        let mut host = Self::new(grid, body, Vec::new());
        host.gap = vec![T::zero(); host.transform.own_points()];
        let per_point = T::of(1.0 / old.points() as f64);
        // Modes below the Nyquist modes of both grids.
        let top = (0..=grid.ny / 2).rev().find(|&k| resolves(k, old.ny) && resolves(k, grid.ny)).unwrap_or(0);
        let fill = |i: usize, known: &SpectrumColumns<'_, T>, column: &mut [Complex<T>]| {
            column.fill(Complex::default());
            body.heights.add_to(i, grid, column, T::one());
            if resolves(i, old.nx) && resolves(i, grid.nx) {
                let coefficient = |row: usize| known.at(row, i).scale(per_point);
                (0..=top).for_each(|k| column[k] = coefficient(k));
                (1..=top).for_each(|k| column[grid.ny - k] = coefficient(old.ny - k));
            }
        };
        let source = SharedSpectrum { grid: old, ranks: body.sharing(old), values: &known };
        host.transform.inverse_filled(&mut host.spectrum, &mut host.gap, Some(source), &fill);
        host
    }

    /// Bytes for a grid, without the series of the heights.
    pub(super) fn bytes(grid: Grid) -> u64 {
        let nodes = size_of::<T>() + 2 * size_of::<f32>() + size_of::<bf16>();
        (nodes * grid.points()) as u64 + Transform::<T>::spectrum_bytes(grid)
    }

    /// Stiffness of a node whose neighbours rest, E*/L: about half of that of the stiffest wave, which on a thin incompressible layer is the
    /// longest.
    fn node_stiffness(&self) -> f64 {
        let (grid, kernel) = (self.grid(), &self.body.kernel);
        let corner = kernel.stiffness(PI / grid.dx(), PI / grid.dy());
        let longest = kernel.stiffness(TAU / grid.lx, 0.0).max(kernel.stiffness(0.0, TAU / grid.ly));
        0.5 * corner.max(longest)
    }

    fn displaced(&self, spring: Spring) -> Displaced<'h, T> {
        let LevelProblem { kernel, heights, .. } = self.body;
        Displaced { grid: self.grid(), kernel, heights, spring }
    }
}

/// The first bytes of a spectrum, as a spectrum in f32.
pub(super) fn first_bytes<T: Real>(spectrum: &mut HalfSpectrum<T>) -> &mut [Complex<f32>] {
    let len = spectrum.len();
    &mut bytemuck::cast_slice_mut(spectrum)[..len]
}

impl<T: Real, L: Law> LevelFields<T> for Host<'_, T, L> {
    fn grid(&self) -> Grid {
        self.transform.grid()
    }

    fn gap(&mut self) -> &[T] {
        &self.gap
    }

    fn gap_mut(&mut self) -> &mut Vec<T> {
        &mut self.gap
    }

    fn into_gap(self: Box<Self>) -> Vec<T> {
        self.gap
    }

    fn allocate(&mut self) {
        let n = self.transform.own_points();
        // Those of an earlier solve are released first.
        (self.step, self.residual, self.direction) = Default::default();
        (self.step, self.residual, self.direction) = (vec![0.0; n], vec![0.0; n], vec![bf16::ZERO; n]);
    }

    fn apply(&mut self, pending: f64) {
        let scale = T::of(pending);
        let (nx, window, step) = (self.grid().nx, self.body.window, &self.step);
        if scale != T::zero() {
            each_row(&mut self.gap, nx, |y, gap| {
                rows::apply_step::<L, T>(window.inside(y, nx), gap, scale, &step[y * nx..][..nx]);
            });
        }
    }

    fn clear_step(&mut self) {
        self.step.fill(0.0);
    }

    fn trial(&mut self, scale: f64, pressure: f64, spring: Spring, precision: Precision) -> StateSums {
        let filter = self.displaced(spring);
        let Host { body, transform, narrow, spectrum, gap, step, residual, .. } = self;
        let state = (&gap[..], T::of(scale), &step[..], T::of(pressure));
        match precision {
            Precision::F32 => tried((narrow, &filter), first_bytes(spectrum), body, state, residual),
            Precision::F64 => tried((transform, &filter), spectrum, body, state, residual),
        }
    }

    fn plain(&mut self, pending: f64, beta: f64, spring: f64) -> ([f64; 2], f64) {
        let nx = self.grid().nx;
        let Host { body: LevelProblem { law, window, .. }, narrow, spectrum, gap, step, residual, direction, .. } =
            self;
        let (pending, beta) = (T::of(pending), beta as f32);
        let fields = (direction.par_chunks_mut(nx).zip(step.par_chunks_mut(nx)))
            .zip(residual.par_chunks_mut(nx).zip(gap.par_chunks_mut(nx)));
        let sums = sweep_sums(narrow, first_bytes(spectrum), fields, |worker, y, spectrum, fields| {
            let ((direction, step), (t, gap)) = fields;
            let (law, moving) = (RowLaw::of(law, y, window.nx), (gap, pending, step));
            let sums = rows::plain(law, window.inside(y, nx), moving, (direction, beta, t), &mut worker.row);
            worker.forward(spectrum);
            sums
        });
        let (grid, metric) = (self.grid(), Metric::Stiffness { mean_stiffness: spring });
        let filter = Multiplied { grid, kernel: &self.body.kernel, metric };
        let elastic = self.narrow.sum_columns(first_bytes(&mut self.spectrum), &filter);
        (sums, elastic)
    }

    fn begin(&mut self, pending: f64) -> [f64; 2] {
        let (nx, node_stiffness) = (self.grid().nx, self.node_stiffness());
        let Host { body: LevelProblem { law, window, .. }, narrow, spectrum, gap, step, residual, direction, .. } =
            self;
        let pending = T::of(pending);
        let fields = (residual.par_chunks_mut(nx).zip(step.par_chunks_mut(nx)))
            .zip(direction.par_chunks_mut(nx).zip(gap.par_chunks_mut(nx)));
        sweep_sums(narrow, first_bytes(spectrum), fields, |worker, y, spectrum, fields| {
            let ((residual, step), (direction, gap)) = fields;
            let law = (RowLaw::of(law, y, window.nx), node_stiffness);
            let moving = (gap, pending, step);
            let sums = rows::begin(law, window.inside(y, nx), moving, (residual, direction), &mut worker.row);
            worker.forward(spectrum);
            sums
        })
    }

    fn set_gradient(&mut self, value: f32) {
        self.residual.fill(value);
    }

    fn multiply(&mut self, metric: Metric) -> f64 {
        let filter = Multiplied { grid: self.grid(), kernel: &self.body.kernel, metric };
        self.narrow.filter_columns(first_bytes(&mut self.spectrum), &filter)
    }

    fn conjugate(&mut self, beta: f64) -> f64 {
        let (nx, beta, node_stiffness) = (self.grid().nx, beta as f32, self.node_stiffness());
        let Host { body: LevelProblem { law, window, .. }, narrow, spectrum, gap, residual, direction, .. } = self;
        let fields = direction.par_chunks_mut(nx).zip(gap.par_chunks(nx).zip(residual.par_chunks(nx)));
        let [law_curvature] =
            sweep_sums(narrow, first_bytes(spectrum), fields, |worker, y, spectrum, (direction, nodes)| {
                worker.inverse(spectrum);
                let (inside, to) = (window.inside(y, nx), (direction, beta));
                let law_curvature = rows::conjugate((law, node_stiffness), inside, nodes, to, &mut worker.row);
                worker.forward(spectrum);
                [law_curvature]
            });
        law_curvature
    }

    fn descend(&mut self, alpha: f64) -> [f64; 2] {
        let (nx, alpha, node_stiffness) = (self.grid().nx, alpha as f32, self.node_stiffness());
        let Host { body: LevelProblem { law, window, .. }, narrow, spectrum, gap, step, residual, direction, .. } =
            self;
        let fields = (step.par_chunks_mut(nx).zip(residual.par_chunks_mut(nx)))
            .zip(direction.par_chunks(nx).zip(gap.par_chunks(nx)));
        sweep_sums(narrow, first_bytes(spectrum), fields, |worker, y, spectrum, fields| {
            let ((step, residual), (direction, gap)) = fields;
            worker.inverse(spectrum);
            let (inside, along, to) = (window.inside(y, nx), (direction, alpha), (step, residual));
            let sums = rows::descend((law, node_stiffness), inside, gap, along, to, &mut worker.row);
            worker.forward(spectrum);
            sums
        })
    }

    fn step_along_direction(&mut self) {
        self.step.iter_mut().zip(&self.direction).for_each(|(x, d)| *x = rows::wide(*d));
    }

    fn stress(&mut self, pressure: f64, spring: Spring) -> (StateSums, Vec<T>) {
        (self.step, self.residual, self.direction) = Default::default();
        let (filter, nx, pressure) = (self.displaced(spring), self.grid().nx, T::of(pressure));
        let Host { body: LevelProblem { law, window, .. }, transform, spectrum, gap, .. } = self;
        sweep(transform, spectrum, gap.par_chunks(nx), |worker, _, spectrum, gap| {
            worker.row.copy_from_slice(gap);
            worker.forward(spectrum);
        });
        let elastic = 0.5 * transform.filter_columns(spectrum, &filter);
        let mut stress = vec![T::zero(); gap.len()];
        let fields = gap.par_chunks(nx).zip(stress.par_chunks_mut(nx));
        let sums = sweep_sums(transform, spectrum, fields, |worker, y, spectrum, (gap, stress)| {
            worker.inverse(spectrum);
            for (w, s) in worker.row.iter_mut().zip(stress) {
                *w += pressure;
                *s = *w;
            }
            rows::residuals(RowLaw::of(law, y, window.nx), window.inside(y, nx), gap, &mut worker.row)
        });
        ((elastic, sums), stress)
    }
}

/// Transform pair of a trial in precision `W`: gap, multiple of the step, step, and pressure.
fn tried<T: Real, W: Real, L: Law>(
    (transform, filter): (&Transform<W>, &Displaced<'_, T>),
    spectrum: &mut [Complex<W>],
    LevelProblem { law, window, .. }: &LevelProblem<'_, T, L>,
    (gap, scale, step, pressure): (&[T], T, &[f32], T),
    residual: &mut [f32],
) -> StateSums {
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
