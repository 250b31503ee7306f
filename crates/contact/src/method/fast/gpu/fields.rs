use super::super::fields::{LevelFields, Metric, Spring, StateSums};
use super::super::host::LevelProblem;
use super::kernels::Kernels;
use crate::interface::{Elastic, Kernel, Law};
use crate::method::residuals::KKT;
use crate::method::{Precision, ReducedProblem};
use asperity_grid::sys::gpu::Argument::{self, F32, F64, Int, Null};
use asperity_grid::sys::gpu::{Buffer, Failure, GpuTransform};
use asperity_grid::{Grid, Real, Series};
use rayon::prelude::*;
use rustfft::num_complex::Complex;

type Tried<V> = Result<V, Failure>;

/// Rows of a spectrum that are gathered at once.
const ROWS: usize = 8;

/// Which copy of the gap is the newer one.
#[derive(Clone, Copy, PartialEq)]
enum Newer {
    Host,
    Gpu,
    Neither,
}

/// Fourier series of the heights on a grid: rows of positive and of negative modes.
struct Waves {
    coefficients: Buffer,
    width: usize,
    up: usize,
    down: usize,
}

/// Memory of a level on the GPU.
struct Arrays {
    gap: Buffer,
    /// Empty until the iteration begins.
    working: Option<Working>,
    /// Transformed in place.
    work: Buffer,
    /// Stiffness of the modes; `None` for a half-space, whose stiffness is computed.
    table: Option<Buffer>,
    waves: Waves,
    state: GpuTransform,
    /// Plans of the linear problem in f32, if the state has another precision.
    linear: Option<GpuTransform>,
    /// Scratch memory of the transforms.
    _scratch: Buffer,
}

struct Working {
    step: Buffer,
    residual: Buffer,
    direction: Buffer,
}

/// Fields of a level in the memory of a GPU.
pub(super) struct OnGpu<'h, T: Real> {
    kernels: &'h Kernels,
    grid: Grid,
    kernel: Elastic,
    heights: &'h Series<T>,
    /// γ and ρ of the attraction on this grid.
    law: [f64; 2],
    /// The host's copy of the gap; empty until it is needed.
    gap: Vec<T>,
    newer: Newer,
    arrays: Option<Arrays>,
}

/// An argument of the precision of the state.
fn real<T: Real>(value: f64) -> Argument<'static> {
    if size_of::<T>() == size_of::<f64>() { F64(value) } else { F32(value as f32) }
}

/// Bytes of the array that is transformed.
fn work_bytes<T: Real>(grid: Grid) -> usize {
    grid.ny * grid.half() * size_of::<Complex<T>>()
}

impl<'h, T: Real> OnGpu<'h, T> {
    pub(super) fn new<L: Law>(kernels: &'h Kernels, grid: Grid, body: LevelProblem<'h, T, L>, gap: Vec<T>) -> Self {
        let law = [kernels.work_of_adhesion, body.law.range()];
        let LevelProblem { kernel, heights, .. } = body;
        OnGpu { kernels, grid, kernel, heights, law, gap, newer: Newer::Host, arrays: None }
    }

    /// Bytes of the finest level with the scratch memory of its plans. The gap, spectrum and scratch memory of the next
    /// coarser grid are there before its working arrays, which are larger.
    pub(super) fn bytes(kernels: &Kernels, problem: &ReducedProblem) -> Tried<u64> {
        let grid = problem.grid;
        let fields = (size_of::<T>() + 2 * size_of::<f32>() + size_of::<u16>()) * grid.points();
        let modes = grid.half() * (grid.ny / 2 + 1);
        let table = if problem.kernel == Elastic::HalfSpace { 0 } else { modes * size_of::<T>() };
        let waves = match problem.heights.series_bytes() {
            Some(bytes) => bytes as usize / size_of::<f64>() * size_of::<T>(),
            None => work_bytes::<T>(grid),
        };
        let (_, _, scratch) = Self::plans(kernels, grid)?;
        Ok((fields + work_bytes::<T>(grid) + table + waves + scratch) as u64)
    }

    /// Plans of the state, and of the linear problem if they are others; bytes of scratch memory for all.
    fn plans(kernels: &Kernels, grid: Grid) -> Tried<(GpuTransform, Option<GpuTransform>, usize)> {
        let (size, double) = ((grid.nx, grid.ny), size_of::<T>() == size_of::<f64>());
        let (state, bytes) = GpuTransform::new(kernels.gpu, size, double)?;
        if !double {
            return Ok((state, None, bytes));
        }
        let (linear, more) = GpuTransform::new(kernels.gpu, size, false)?;
        Ok((state, Some(linear), bytes.max(more)))
    }

    /// Memory and plans on the GPU.
    fn arrays(&self) -> Tried<Arrays> {
        let (gpu, grid) = (self.kernels.gpu, self.grid);
        let (state, linear, scratch) = Self::plans(self.kernels, grid)?;
        // A buffer has an address.
        let scratch = gpu.allocate(scratch.max(1))?;
        state.set_scratch(&scratch)?;
        linear.as_ref().map_or(Ok(()), |transform| transform.set_scratch(&scratch))?;
        Ok(Arrays {
            gap: gpu.allocate(grid.points() * size_of::<T>())?,
            working: None,
            work: gpu.allocate(work_bytes::<T>(grid))?,
            table: self.table()?,
            waves: self.waves()?,
            state,
            linear,
            _scratch: scratch,
        })
    }

    /// Stiffness of the modes with `ky >= 0`, row by row.
    fn table(&self) -> Tried<Option<Buffer>> {
        if self.kernel == Elastic::HalfSpace {
            return Ok(None);
        }
        let (grid, kernel) = (self.grid, &self.kernel);
        let mut table = vec![T::zero(); grid.half() * (grid.ny / 2 + 1)];
        table.par_chunks_mut(grid.half()).enumerate().for_each(|(j, row)| {
            row.iter_mut().enumerate().for_each(|(i, f)| *f = T::of(kernel.stiffness(grid.qx(i), grid.qy(j))));
        });
        self.uploaded(&table).map(Some)
    }

    fn uploaded<V: bytemuck::Pod>(&self, values: &[V]) -> Tried<Buffer> {
        let mut buffer = self.kernels.gpu.allocate(size_of_val(values).max(1))?;
        if !values.is_empty() {
            self.kernels.gpu.upload(values, &mut buffer)?;
        }
        Ok(buffer)
    }

    /// The heights' coefficients on this grid, row by row.
    fn waves(&self) -> Tried<Waves> {
        let (heights, grid) = (self.heights, self.grid);
        let columns = (0..grid.half()).map(|i| heights.column(i, grid));
        let columns: Vec<_> = columns.take_while(|(positive, _)| !positive.is_empty()).collect();
        let (up, down) = columns.first().map_or((0, 0), |(positive, negative)| (positive.len(), negative.len()));
        let width = columns.len();
        let mut rows = vec![Complex::<T>::default(); width * (up + down)];
        // Some rows at a time, as neighbours in a column share cache lines.
        rows.par_chunks_mut(ROWS * width.max(1)).enumerate().for_each(|(block, to)| {
            for (i, (positive, negative)) in columns.iter().enumerate() {
                for (row, to) in to.chunks_mut(width).enumerate() {
                    let row = block * ROWS + row;
                    to[i] = if row < up { positive[row] } else { negative[row - up] };
                }
            }
        });
        Ok(Waves { coefficients: self.uploaded(&rows)?, width, up, down })
    }

    /// The arrays, with the newest gap.
    fn ready(&mut self) -> Tried<()> {
        if self.arrays.is_none() {
            self.arrays = Some(self.arrays()?);
        }
        if self.newer == Newer::Host {
            let arrays = self.arrays.as_mut().ok_or("no arrays")?;
            self.kernels.gpu.upload(&self.gap, &mut arrays.gap)?;
            self.newer = Newer::Neither;
        }
        Ok(())
    }

    /// `action` with the arrays; `otherwise` after a failure.
    fn attempt<V>(&mut self, otherwise: V, action: impl FnOnce(&Self, &Arrays, &Working) -> Tried<V>) -> V {
        let kernels = self.kernels;
        kernels.attempt(otherwise, || {
            self.ready()?;
            let arrays = self.arrays.as_ref().ok_or("no arrays")?;
            action(self, arrays, arrays.working.as_ref().ok_or("no working arrays")?)
        })
    }

    fn nodes(&self) -> (usize, usize) {
        (self.grid.nx, self.grid.ny)
    }

    fn modes(&self) -> (usize, usize) {
        (self.grid.half(), self.grid.ny)
    }

    /// Size of the fields; with the distance of rows of the transformed array.
    fn size(&self) -> [Argument<'static>; 3] {
        let Grid { nx, ny, .. } = self.grid;
        [Int(nx as i32), Int(ny as i32), Int(2 * self.grid.half() as i32)]
    }

    fn attraction(&self) -> [Argument<'static>; 2] {
        self.law.map(real::<T>)
    }

    /// Stiffness of the modes: wave numbers and table.
    fn stiffness<'b>(&self, arrays: &'b Arrays) -> [Argument<'b>; 5] {
        let grid = self.grid;
        let table = arrays.table.as_ref().map_or(Null, Argument::Buffer);
        [Int(grid.nx as i32), Int(grid.ny as i32), F64(grid.qx(1)), F64(grid.qy_step()), table]
    }

    fn linear<'b>(&self, arrays: &'b Arrays) -> &'b GpuTransform {
        arrays.linear.as_ref().unwrap_or(&arrays.state)
    }

    /// Multiplies the transformed array by a metric, or only sums. Returns the product.
    fn product(&self, arrays: &Arrays, metric: Metric, write: bool) -> Tried<f64> {
        let (inverse, mean_stiffness) = match metric {
            Metric::Stiffness { mean_stiffness } => (0, mean_stiffness),
            Metric::Compliance { mean_stiffness } => (1, 1.0 / mean_stiffness),
        };
        let n = self.grid.points() as f64;
        let rest = [Int(inverse), Int(i32::from(write)), F64(mean_stiffness), F64(n), Argument::Buffer(&arrays.work)];
        let arguments = [&self.stiffness(arrays)[..], &rest].concat();
        let [product] = self.kernels.gpu.sums("multiplied", self.modes(), &arguments)?;
        Ok(product / n / n)
    }

    /// Elastic stress of the gap in the transformed array. Returns the elastic energy.
    fn elastic(&self, arrays: &Arrays, spring: Spring) -> Tried<f64> {
        let (n, waves) = (self.grid.points() as f64, &arrays.waves);
        arrays.state.forward(&arrays.work)?;
        let rest = [
            Argument::Buffer(&waves.coefficients),
            Int(waves.width as i32),
            Int(waves.up as i32),
            Int(waves.down as i32),
            F64(spring.stiffness),
            F64(spring.target),
            F64(n),
            Argument::Buffer(&arrays.work),
        ];
        let arguments = [&self.stiffness(arrays)[..], &rest].concat();
        let [product] = self.kernels.gpu.sums("displaced", self.modes(), &arguments)?;
        arrays.state.inverse(&arrays.work)?;
        Ok(0.5 * product / n / n)
    }

    /// See [`GpuLevels::refined`](super::GpuLevels::refined).
    pub(super) fn interpolate(&mut self, old: Grid, gap: &[T]) {
        let kernels = self.kernels;
        kernels.attempt((), || {
            let arrays = self.arrays()?;
            let gpu = kernels.gpu;
            let (coarse, known) = (self.uploaded(gap)?, gpu.allocate(work_bytes::<T>(old))?);
            let (transform, scratch) = GpuTransform::new(gpu, (old.nx, old.ny), size_of::<T>() == size_of::<f64>())?;
            let scratch = gpu.allocate(scratch.max(1))?;
            transform.set_scratch(&scratch)?;
            let size = [Int(old.nx as i32), Int(old.ny as i32), Int(2 * old.half() as i32)];
            let rest = [Argument::Buffer(&coarse), Argument::Buffer(&known)];
            gpu.launch("copy_to_work", (old.nx, old.ny), &[&size[..], &rest].concat())?;
            transform.forward(&known)?;
            let (grid, waves) = (self.grid, &arrays.waves);
            // Modes below the Nyquist modes of both grids.
            let [right, top] = [old.nx.min(grid.nx), old.ny.min(grid.ny)].map(|n| (n.max(1) - 1) / 2);
            let arguments = [
                Int(grid.nx as i32),
                Int(grid.ny as i32),
                Argument::Buffer(&waves.coefficients),
                Int(waves.width as i32),
                Int(waves.up as i32),
                Int(waves.down as i32),
                Argument::Buffer(&known),
                Int(old.nx as i32),
                Int(old.ny as i32),
                Int(right as i32),
                Int(top as i32),
                real::<T>(1.0 / old.points() as f64),
                Argument::Buffer(&arrays.work),
            ];
            gpu.launch("refined", self.modes(), &arguments)?;
            arrays.state.inverse(&arrays.work)?;
            let rest = [Argument::Buffer(&arrays.work), Argument::Buffer(&arrays.gap)];
            gpu.launch("clipped", self.nodes(), &[&self.size()[..], &rest].concat())?;
            (self.arrays, self.newer) = (Some(arrays), Newer::Gpu);
            Ok(())
        });
    }

    /// Sums of a state in the order of [`KKT`], from those of a kernel: without flow, with the product with the last
    /// residual.
    fn ordered(sums: &[f64], old: f64) -> [f64; KKT + 1] {
        let mut all = [0.0; KKT + 1];
        all[..6].copy_from_slice(&sums[..6]);
        all[KKT - 1] = old;
        all
    }
}

/// Sums after a failure: the iteration ends at once.
const FAILED: StateSums = (f64::NAN, [f64::NAN; KKT + 1]);

impl<T: Real> LevelFields<T> for OnGpu<'_, T> {
    fn grid(&self) -> Grid {
        self.grid
    }

    fn gap(&mut self) -> &[T] {
        if self.newer == Newer::Gpu {
            if self.gap.len() != self.grid.points() {
                self.gap = vec![T::zero(); self.grid.points()];
            }
            let (kernels, arrays, gap) = (self.kernels, &self.arrays, &mut self.gap);
            let copied = kernels.attempt(false, || {
                let arrays = arrays.as_ref().ok_or("no arrays")?;
                kernels.gpu.download(&arrays.gap, gap).map(|()| true)
            });
            self.newer = if copied { Newer::Neither } else { Newer::Gpu };
        }
        &self.gap
    }

    fn gap_mut(&mut self) -> &mut Vec<T> {
        self.gap();
        self.newer = Newer::Host;
        &mut self.gap
    }

    fn into_gap(mut self: Box<Self>) -> Vec<T> {
        std::mem::take(self.gap_mut())
    }

    fn has_failed(&self) -> bool {
        self.kernels.has_failed()
    }

    /// A state in f64 is tried in f64.
    fn tries_in_f32(&self) -> bool {
        size_of::<T>() == size_of::<f32>()
    }

    fn allocate(&mut self) {
        let (kernels, n) = (self.kernels, self.grid.points());
        kernels.attempt((), || {
            self.ready()?;
            let (gpu, arrays) = (kernels.gpu, self.arrays.as_mut().ok_or("no arrays")?);
            // Those of an earlier solve are released first.
            arrays.working = None;
            let working = Working {
                step: gpu.zeros(n * size_of::<f32>())?,
                residual: gpu.zeros(n * size_of::<f32>())?,
                direction: gpu.zeros(n * size_of::<u16>())?,
            };
            arrays.working = Some(working);
            Ok(())
        });
    }

    fn apply(&mut self, pending: f64) {
        self.attempt((), |fields, arrays, working| {
            let [nx, ny, _] = fields.size();
            let arguments =
                [nx, ny, Argument::Buffer(&arrays.gap), real::<T>(pending), Argument::Buffer(&working.step)];
            fields.kernels.gpu.launch("apply_step", fields.nodes(), &arguments)
        });
        self.newer = Newer::Gpu;
    }

    fn clear_step(&mut self) {
        let kernels = self.kernels;
        kernels.attempt((), || {
            let working = self.arrays.as_mut().and_then(|arrays| arrays.working.as_mut());
            working.map_or(Ok(()), |working| kernels.gpu.clear(&mut working.step))
        });
    }

    fn trial(&mut self, scale: f64, pressure: f64, spring: Spring, _: Precision) -> StateSums {
        self.attempt(FAILED, |fields, arrays, working| {
            let gpu = fields.kernels.gpu;
            let state = [Argument::Buffer(&arrays.gap), real::<T>(scale), Argument::Buffer(&working.step)];
            let work = Argument::Buffer(&arrays.work);
            gpu.launch("shifted", fields.nodes(), &[&fields.size()[..], &state, &[work]].concat())?;
            let elastic = fields.elastic(arrays, spring)?;
            let rest = [work, real::<T>(pressure), Argument::Buffer(&working.residual)];
            let arguments = [&fields.size()[..], &state, &rest, &fields.attraction()].concat();
            let sums: [f64; 7] = gpu.sums("trial", fields.nodes(), &arguments)?;
            Ok((elastic, Self::ordered(&sums, sums[6])))
        })
    }

    fn plain(&mut self, pending: f64, beta: f64, spring: f64) -> ([f64; 2], f64) {
        let sums = self.attempt(([f64::NAN; 2], f64::NAN), |own, arrays, working| {
            let fields = [
                Argument::Buffer(&arrays.gap),
                real::<T>(pending),
                Argument::Buffer(&working.step),
                Argument::Buffer(&working.direction),
                F32(beta as f32),
                Argument::Buffer(&working.residual),
                Argument::Buffer(&arrays.work),
            ];
            let arguments = [&own.size()[..], &fields, &own.attraction()].concat();
            let sums = own.kernels.gpu.sums("plain", own.nodes(), &arguments)?;
            own.linear(arrays).forward(&arrays.work)?;
            Ok((sums, own.product(arrays, Metric::Stiffness { mean_stiffness: spring }, false)?))
        });
        self.newer = Newer::Gpu;
        sums
    }

    fn set_gradient(&mut self, value: f32) {
        let (kernels, n) = (self.kernels, self.grid.points());
        kernels.attempt((), || {
            let working = self.arrays.as_mut().and_then(|arrays| arrays.working.as_mut());
            working.map_or(Ok(()), |working| kernels.gpu.upload(&vec![value; n], &mut working.residual))
        });
    }

    fn begin(&mut self, pending: f64) -> [f64; 2] {
        let squared_residual = self.attempt(f64::NAN, |own, arrays, working| {
            let fields = [
                Argument::Buffer(&arrays.gap),
                real::<T>(pending),
                Argument::Buffer(&working.step),
                Argument::Buffer(&working.direction),
                Argument::Buffer(&working.residual),
                Argument::Buffer(&arrays.work),
            ];
            let [squared_residual] =
                own.kernels.gpu.sums("begin", own.nodes(), &[&own.size()[..], &fields].concat())?;
            Ok(squared_residual)
        });
        self.newer = Newer::Gpu;
        // Soft walls are refused.
        [squared_residual, 0.0]
    }

    fn multiply(&mut self, metric: Metric) -> f64 {
        self.attempt(f64::NAN, |fields, arrays, _| {
            fields.linear(arrays).forward(&arrays.work)?;
            let product = fields.product(arrays, metric, true)?;
            fields.linear(arrays).inverse(&arrays.work)?;
            Ok(product)
        })
    }

    fn conjugate(&mut self, beta: f64) -> f64 {
        self.attempt(f64::NAN, |own, arrays, working| {
            let fields = [
                Argument::Buffer(&arrays.gap),
                Argument::Buffer(&working.direction),
                F32(beta as f32),
                Argument::Buffer(&arrays.work),
            ];
            let arguments = [&own.size()[..], &fields, &own.attraction()].concat();
            let [law_curvature] = own.kernels.gpu.sums("conjugate", own.nodes(), &arguments)?;
            Ok(law_curvature)
        })
    }

    fn descend(&mut self, alpha: f64) -> [f64; 2] {
        let squared_residual = self.attempt(f64::NAN, |own, arrays, working| {
            let fields = [
                Argument::Buffer(&arrays.gap),
                Argument::Buffer(&working.direction),
                F32(alpha as f32),
                Argument::Buffer(&working.step),
                Argument::Buffer(&working.residual),
                Argument::Buffer(&arrays.work),
            ];
            let arguments = [&own.size()[..], &fields, &own.attraction()].concat();
            let [squared_residual] = own.kernels.gpu.sums("descend", own.nodes(), &arguments)?;
            Ok(squared_residual)
        });
        [squared_residual, 0.0]
    }

    fn step_along_direction(&mut self) {
        self.attempt((), |fields, _, working| {
            let [nx, ny, _] = fields.size();
            let arguments = [nx, ny, Argument::Buffer(&working.direction), Argument::Buffer(&working.step)];
            fields.kernels.gpu.launch("step_along_direction", fields.nodes(), &arguments)
        });
    }

    fn stress(&mut self, pressure: f64, spring: Spring) -> (StateSums, Vec<T>) {
        let (kernels, n) = (self.kernels, self.grid.points());
        if let Some(arrays) = self.arrays.as_mut() {
            arrays.working = None;
        }
        let mut stress = vec![T::zero(); n];
        let sums = kernels.attempt(FAILED, || {
            self.ready()?;
            let (gpu, arrays) = (kernels.gpu, self.arrays.as_ref().ok_or("no arrays")?);
            let (gap, work) = (Argument::Buffer(&arrays.gap), Argument::Buffer(&arrays.work));
            gpu.launch("copy_to_work", self.nodes(), &[&self.size()[..], &[gap, work]].concat())?;
            let elastic = self.elastic(arrays, spring)?;
            let field = gpu.allocate(n * size_of::<T>())?;
            let rest = [gap, work, real::<T>(pressure), Argument::Buffer(&field)];
            let arguments = [&self.size()[..], &rest, &self.attraction()].concat();
            let sums: [f64; 6] = gpu.sums("stress", self.nodes(), &arguments)?;
            gpu.download(&field, &mut stress)?;
            Ok((elastic, Self::ordered(&sums, 0.0)))
        });
        (sums, stress)
    }
}
