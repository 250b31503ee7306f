use super::super::fields::{Fields, Metric, Spring, StateSums};
use super::super::host::Body;
use super::kernels::Kernels;
use crate::grid::{Grid, HalfSpectrum, Real, Series, Transform};
use crate::interface::{Elastic, Kernel, Law};
use crate::method::residuals::KKT;
use crate::method::{Heights, Precision, Problem};
use crate::sys::gpu::Argument::{self, F32, F64, Int, Null};
use crate::sys::gpu::{Buffer, Failure, GpuTransform};
use rayon::prelude::*;
use rustfft::num_complex::Complex;

type Outcome<V> = Result<V, Failure>;

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
    /// Of the linear problem in f32, if the state has another precision.
    linear: Option<GpuTransform>,
    /// Of the transforms.
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
    /// Of the host; it may be empty while the GPU has the newer copy.
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
    pub(super) fn new<L: Law>(kernels: &'h Kernels, grid: Grid, body: Body<'h, T, L>, gap: Vec<T>) -> Self {
        let law = [kernels.work_of_adhesion, body.law.range()];
        let Body { kernel, heights, .. } = body;
        OnGpu { kernels, grid, kernel, heights, law, gap, newer: Newer::Host, arrays: None }
    }

    /// Bytes of the finest level, of the gap of the next coarser one, and of cuFFT's scratch memory, which was at most the
    /// size of the transformed array.
    pub(super) fn bytes(problem: &Problem) -> u64 {
        let grid = problem.grid;
        let fields = (size_of::<T>() + 2 * size_of::<f32>() + size_of::<u16>()) * grid.points();
        let table =
            if problem.kernel == Elastic::HalfSpace { 0 } else { grid.half() * (grid.ny / 2 + 1) * size_of::<T>() };
        let waves = match problem.heights {
            Heights::Series(waves) => waves.bytes() as usize / size_of::<f64>() * size_of::<T>(),
            Heights::Nodes(_) => work_bytes::<T>(grid),
        };
        (fields + 2 * work_bytes::<T>(grid) + table + waves) as u64
    }

    /// Memory and plans on the GPU.
    fn arrays(&self) -> Outcome<Arrays> {
        let (gpu, grid) = (&self.kernels.gpu, self.grid);
        let size = (grid.nx, grid.ny);
        let (state, mut scratch) = GpuTransform::new(gpu, size, size_of::<T>() == size_of::<f64>())?;
        let mut linear = None;
        if size_of::<T>() == size_of::<f64>() {
            let (transform, bytes) = GpuTransform::new(gpu, size, false)?;
            scratch = scratch.max(bytes);
            linear = Some(transform);
        }
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
    fn table(&self) -> Outcome<Option<Buffer>> {
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

    fn uploaded<V: bytemuck::Pod>(&self, values: &[V]) -> Outcome<Buffer> {
        let mut buffer = self.kernels.gpu.allocate(size_of_val(values).max(1))?;
        if !values.is_empty() {
            self.kernels.gpu.upload(values, &mut buffer)?;
        }
        Ok(buffer)
    }

    /// The heights' coefficients on this grid, row by row.
    fn waves(&self) -> Outcome<Waves> {
        let (heights, grid) = (self.heights, self.grid);
        let (up, down) = heights.column(0, grid);
        let (up, down) = (up.len(), down.len());
        let width = (0..grid.half()).find(|&i| heights.column(i, grid).0.is_empty()).unwrap_or(grid.half());
        let mut rows = vec![Complex::<T>::default(); width * (up + down)];
        rows.par_chunks_mut(width.max(1)).enumerate().for_each(|(row, to)| {
            for (i, c) in to.iter_mut().enumerate() {
                let (positive, negative) = heights.column(i, grid);
                *c = if row < up { positive[row] } else { negative[row - up] };
            }
        });
        Ok(Waves { coefficients: self.uploaded(&rows)?, width, up, down })
    }

    /// The arrays, with the newest gap.
    fn ready(&mut self) -> Outcome<()> {
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
    fn attempt<V>(&mut self, otherwise: V, action: impl FnOnce(&Self, &Arrays, &Working) -> Outcome<V>) -> V {
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
    fn body<'b>(&self, arrays: &'b Arrays) -> [Argument<'b>; 5] {
        let grid = self.grid;
        let table = arrays.table.as_ref().map_or(Null, Argument::Buffer);
        [Int(grid.nx as i32), Int(grid.ny as i32), F64(grid.qx(1)), F64(grid.qy_step()), table]
    }

    fn linear<'b>(&self, arrays: &'b Arrays) -> &'b GpuTransform {
        arrays.linear.as_ref().unwrap_or(&arrays.state)
    }

    /// Multiplies the transformed array by a metric, or only sums. Returns the product.
    fn product(&self, arrays: &Arrays, metric: Metric, write: bool) -> Outcome<f64> {
        let (inverse, mean) = match metric {
            Metric::Stiffness { mean } => (0, mean),
            Metric::Compliance { mean } => (1, 1.0 / mean),
        };
        let n = self.grid.points() as f64;
        let rest = [Int(inverse), Int(i32::from(write)), F64(mean), F64(n), Argument::Buffer(&arrays.work)];
        let arguments = [&self.body(arrays)[..], &rest].concat();
        let [sum] = self.kernels.gpu.sums("multiplied", self.modes(), &arguments)?;
        Ok(sum / n / n)
    }

    /// Elastic stress of the gap in the transformed array. Returns the elastic energy.
    fn elastic(&self, arrays: &Arrays, spring: Spring) -> Outcome<f64> {
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
        let arguments = [&self.body(arrays)[..], &rest].concat();
        let [sum] = self.kernels.gpu.sums("displaced", self.modes(), &arguments)?;
        arrays.state.inverse(&arrays.work)?;
        Ok(0.5 * sum / n / n)
    }

    /// See [`GpuSolver::refined`](super::GpuSolver::refined).
    pub(super) fn interpolate(&mut self, old: Grid, gap: &[T]) {
        let kernels = self.kernels;
        kernels.attempt((), || {
            let arrays = self.arrays()?;
            let gpu = &kernels.gpu;
            let (coarse, known) = (self.uploaded(gap)?, gpu.allocate(work_bytes::<T>(old))?);
            let (transform, scratch) = GpuTransform::new(gpu, (old.nx, old.ny), size_of::<T>() == size_of::<f64>())?;
            let scratch = gpu.allocate(scratch.max(1))?;
            transform.set_scratch(&scratch)?;
            let size = [Int(old.nx as i32), Int(old.ny as i32), Int(2 * old.half() as i32)];
            let rest = [Argument::Buffer(&coarse), Argument::Buffer(&known)];
            gpu.launch("padded", (old.nx, old.ny), &[&size[..], &rest].concat())?;
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

impl<T: Real> Fields<T> for OnGpu<'_, T> {
    fn grid(&self) -> Grid {
        self.grid
    }

    fn gap(&mut self) -> &[T] {
        if self.newer == Newer::Gpu {
            if self.gap.len() != self.grid.points() {
                self.gap = vec![T::zero(); self.grid.points()];
            }
            let (arrays, gap) = (&self.arrays, &mut self.gap);
            self.kernels.attempt((), || {
                let arrays = arrays.as_ref().ok_or("no arrays")?;
                self.kernels.gpu.download(&arrays.gap, gap)
            });
            self.newer = Newer::Neither;
        }
        &self.gap
    }

    fn gap_mut(&mut self) -> &mut Vec<T> {
        self.gap();
        self.newer = Newer::Host;
        &mut self.gap
    }

    fn transformed(mut self: Box<Self>) -> HalfSpectrum<T> {
        let transform = Transform::new(self.grid);
        let mut spectrum = transform.spectrum();
        transform.forward(self.gap(), &mut spectrum);
        spectrum
    }

    fn allocate(&mut self) {
        let (kernels, n) = (self.kernels, self.grid.points());
        kernels.attempt((), || {
            self.ready()?;
            let gpu = &kernels.gpu;
            let working = Working {
                step: gpu.zeros(n * size_of::<f32>())?,
                residual: gpu.zeros(n * size_of::<f32>())?,
                direction: gpu.zeros(n * size_of::<u16>())?,
            };
            self.arrays.as_mut().ok_or("no arrays")?.working = Some(working);
            Ok(())
        });
    }

    fn apply(&mut self, pending: f64) {
        self.attempt((), |own, arrays, working| {
            let [nx, ny, _] = own.size();
            let arguments =
                [nx, ny, Argument::Buffer(&arrays.gap), real::<T>(pending), Argument::Buffer(&working.step)];
            own.kernels.gpu.launch("apply_step", own.nodes(), &arguments)
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
        self.attempt(FAILED, |own, arrays, working| {
            let gpu = &own.kernels.gpu;
            let state = [Argument::Buffer(&arrays.gap), real::<T>(scale), Argument::Buffer(&working.step)];
            let work = Argument::Buffer(&arrays.work);
            gpu.launch("shifted", own.nodes(), &[&own.size()[..], &state, &[work]].concat())?;
            let elastic = own.elastic(arrays, spring)?;
            let rest = [work, real::<T>(pressure), Argument::Buffer(&working.residual)];
            let arguments = [&own.size()[..], &state, &rest, &own.attraction()].concat();
            let sums: [f64; 7] = gpu.sums("trial", own.nodes(), &arguments)?;
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
            Ok((sums, own.product(arrays, Metric::Stiffness { mean: spring }, false)?))
        });
        self.newer = Newer::Gpu;
        sums
    }

    fn begin(&mut self, pending: f64) -> f64 {
        let sum = self.attempt(f64::NAN, |own, arrays, working| {
            let fields = [
                Argument::Buffer(&arrays.gap),
                real::<T>(pending),
                Argument::Buffer(&working.step),
                Argument::Buffer(&working.direction),
                Argument::Buffer(&working.residual),
                Argument::Buffer(&arrays.work),
            ];
            let [sum] = own.kernels.gpu.sums("begin", own.nodes(), &[&own.size()[..], &fields].concat())?;
            own.linear(arrays).forward(&arrays.work)?;
            Ok(sum)
        });
        self.newer = Newer::Gpu;
        sum
    }

    fn multiply(&mut self, metric: Metric) -> f64 {
        self.attempt(f64::NAN, |own, arrays, _| {
            let product = own.product(arrays, metric, true)?;
            own.linear(arrays).inverse(&arrays.work)?;
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
            let [sum] = own.kernels.gpu.sums("conjugate", own.nodes(), &arguments)?;
            own.linear(arrays).forward(&arrays.work)?;
            Ok(sum)
        })
    }

    fn descend(&mut self, alpha: f64) -> f64 {
        self.attempt(f64::NAN, |own, arrays, working| {
            let fields = [
                Argument::Buffer(&arrays.gap),
                Argument::Buffer(&working.direction),
                F32(alpha as f32),
                Argument::Buffer(&working.step),
                Argument::Buffer(&working.residual),
                Argument::Buffer(&arrays.work),
            ];
            let arguments = [&own.size()[..], &fields, &own.attraction()].concat();
            let [sum] = own.kernels.gpu.sums("descend", own.nodes(), &arguments)?;
            own.linear(arrays).forward(&arrays.work)?;
            Ok(sum)
        })
    }

    fn step_along_direction(&mut self) {
        self.attempt((), |own, _, working| {
            let [nx, ny, _] = own.size();
            let arguments = [nx, ny, Argument::Buffer(&working.direction), Argument::Buffer(&working.step)];
            own.kernels.gpu.launch("step_along_direction", own.nodes(), &arguments)
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
            let (gpu, arrays) = (&kernels.gpu, self.arrays.as_ref().ok_or("no arrays")?);
            let (gap, work) = (Argument::Buffer(&arrays.gap), Argument::Buffer(&arrays.work));
            gpu.launch("padded", self.nodes(), &[&self.size()[..], &[gap, work]].concat())?;
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
