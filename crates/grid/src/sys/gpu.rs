//! A GPU of NVIDIA: memory, kernels compiled at run time, and real transforms in two dimensions. CUDA's libraries are
//! opened when a GPU is first used; nothing of them is needed to build.

use cudarc::cufft::{result as fft, sys as fft_sys};
use cudarc::driver::{
    CudaContext, CudaFunction, CudaSlice, CudaStream, DevicePtr, LaunchConfig, PinnedHostSlice, PushKernelArg,
};
use cudarc::nvrtc::{CompileError, CompileOptions, compile_ptx_with_opts};
use rayon::prelude::*;
use std::cell::RefCell;
use std::collections::HashMap;
use std::fmt::Display;
use std::sync::Arc;

/// Why an operation failed, in CUDA's words.
pub type Failure = String;

/// Threads of a block.
const THREADS: u32 = 256;
/// Blocks of a kernel at most: enough for the largest cards, few enough that sums over blocks cost nothing.
const BLOCKS: u32 = 2048;
/// Blocks along a row at most.
const WIDE: u32 = 32;
/// Sums of a kernel at most.
const SUMS: usize = 8;
/// Bytes that are copied at once through pinned memory, and bytes of them that a thread copies on.
const STAGED: usize = 64 << 20;
const SHARE: usize = 1 << 20;

/// Memory of the GPU.
pub struct Buffer {
    bytes: CudaSlice<u8>,
}

impl Buffer {
    fn address(&self) -> u64 {
        self.bytes.device_ptr(self.bytes.stream()).0
    }
}

/// An argument of a kernel.
#[derive(Clone, Copy)]
pub enum Argument<'b> {
    Int(i32),
    F32(f32),
    F64(f64),
    Buffer(&'b Buffer),
    Null,
}

pub struct Gpu {
    stream: Arc<CudaStream>,
    functions: HashMap<&'static str, CudaFunction>,
    /// Sums of the blocks of a kernel.
    sums: Buffer,
    /// Memory of the host that the card copies without the driver's help.
    staging: RefCell<PinnedHostSlice<u8>>,
}

fn words(error: impl Display) -> Failure {
    error.to_string()
}

/// Name and memory of the first GPU.
///
/// # Errors
/// If a library of CUDA, a GPU or its driver is missing.
pub fn card() -> Result<String, Failure> {
    if let Some(library) = missing_library() {
        return Err(format!("{library} is missing"));
    }
    let context = CudaContext::new(0).map_err(words)?;
    let (name, bytes) = (context.name().map_err(words)?, context.total_mem().map_err(words)?);
    Ok(format!("{name}, {:.0} GB", bytes as f64 / 1e9))
}

/// A library of CUDA that is not found.
pub fn missing_library() -> Option<&'static str> {
    // SAFETY: opening a library runs its initialisation only.
    let present = unsafe {
        [
            ("the driver's library libcuda.so", cudarc::driver::sys::is_culib_present()),
            ("the library libnvrtc.so of the CUDA toolkit", cudarc::nvrtc::sys::is_culib_present()),
            ("the library libcufft.so of the CUDA toolkit", fft_sys::is_culib_present()),
        ]
    };
    present.into_iter().find(|(_, present)| !present).map(|(library, _)| library)
}

thread_local! {
    /// GPUs of this thread with their kernels, by definitions. They are never released: the driver may end before them.
    static OPENED: RefCell<Vec<(String, &'static Gpu)>> = const { RefCell::new(Vec::new()) };
}

impl Gpu {
    /// The first GPU with the kernels of a source, compiled for it with `-D…` definitions, or as compiled before by this
    /// thread.
    ///
    /// # Errors
    /// Without a GPU, and for a source that does not compile. The libraries are there ([`missing_library`]).
    pub fn with_kernels(source: &str, definitions: &str, kernels: &[&'static str]) -> Result<&'static Self, Failure> {
        let known = OPENED.with_borrow(|all| all.iter().find(|(key, _)| key == definitions).map(|(_, gpu)| *gpu));
        if let Some(gpu) = known {
            return Ok(gpu);
        }
        let gpu: &'static Gpu = Box::leak(Box::new(Self::open(source, definitions, kernels)?));
        OPENED.with_borrow_mut(|all| all.push((definitions.into(), gpu)));
        Ok(gpu)
    }

    fn open(source: &str, definitions: &str, kernels: &[&'static str]) -> Result<Self, Failure> {
        let context = CudaContext::new(0).map_err(words)?;
        // SAFETY: all work is on one stream.
        unsafe { context.disable_event_tracking() };
        let (major, minor) = context.compute_capability().map_err(words)?;
        let mut options: Vec<String> = definitions.split(' ').map(Into::into).collect();
        options.push(format!("--gpu-architecture=compute_{major}{minor}"));
        let compiled = compile_ptx_with_opts(source, CompileOptions { options, ..Default::default() });
        let module = context.load_module(compiled.map_err(|e| match e {
            CompileError::CompileError { log, .. } => log.to_string_lossy().into_owned(),
            other => words(other),
        })?);
        let module = module.map_err(words)?;
        let load = |name: &&'static str| Ok((*name, module.load_function(name).map_err(words)?));
        let functions = kernels.iter().map(load).collect::<Result<_, Failure>>()?;
        let stream = context.default_stream();
        let sums = allocate(&stream, BLOCKS as usize * SUMS * size_of::<f64>())?;
        // SAFETY: bytes have no invalid values. Without flags the processor reads through its caches.
        let staging = unsafe { context.alloc_pinned_with_flags::<u8>(STAGED, 0) }.map_err(words)?;
        Ok(Gpu { stream, functions, sums, staging: RefCell::new(staging) })
    }

    /// Name of the card.
    pub fn name(&self) -> String {
        self.stream.context().name().unwrap_or_else(|_| "GPU".into())
    }

    /// Free memory, bytes.
    ///
    /// # Errors
    /// If CUDA does not say.
    pub fn free_bytes(&self) -> Result<u64, Failure> {
        self.stream.context().mem_get_info().map(|(free, _)| free as u64).map_err(words)
    }

    /// Uninitialised memory.
    ///
    /// # Errors
    /// If the card has too little.
    pub fn allocate(&self, bytes: usize) -> Result<Buffer, Failure> {
        allocate(&self.stream, bytes)
    }

    /// Memory of zeros.
    ///
    /// # Errors
    /// If the card has too little.
    pub fn zeros(&self, bytes: usize) -> Result<Buffer, Failure> {
        let mut buffer = self.allocate(bytes)?;
        self.clear(&mut buffer)?;
        Ok(buffer)
    }

    /// Sets memory to zeros.
    ///
    /// # Errors
    /// Of the card.
    pub fn clear(&self, buffer: &mut Buffer) -> Result<(), Failure> {
        self.stream.memset_zeros(&mut buffer.bytes).map_err(words)
    }

    /// Copies values to a buffer of their size.
    ///
    /// # Errors
    /// Of the card.
    pub fn upload<T: bytemuck::Pod>(&self, values: &[T], to: &mut Buffer) -> Result<(), Failure> {
        let mut staging = self.staging.borrow_mut();
        let staging = staging.as_mut_slice().map_err(words)?;
        for (k, from) in bytemuck::cast_slice::<T, u8>(values).chunks(STAGED).enumerate() {
            let staged = &mut staging[..from.len()];
            copy(from, staged);
            let mut to = to.bytes.slice_mut(k * STAGED..k * STAGED + from.len());
            self.stream.memcpy_htod(&*staged, &mut to).map_err(words)?;
            self.stream.synchronize().map_err(words)?;
        }
        Ok(())
    }

    /// Copies the first bytes of a buffer.
    ///
    /// # Errors
    /// Of the card.
    pub fn download<T: bytemuck::Pod>(&self, from: &Buffer, to: &mut [T]) -> Result<(), Failure> {
        let mut staging = self.staging.borrow_mut();
        let staging = staging.as_mut_slice().map_err(words)?;
        for (k, to) in bytemuck::cast_slice_mut::<T, u8>(to).chunks_mut(STAGED).enumerate() {
            let staged = &mut staging[..to.len()];
            let from = from.bytes.slice(k * STAGED..k * STAGED + to.len());
            self.stream.memcpy_dtoh(&from, staged).map_err(words)?;
            self.stream.synchronize().map_err(words)?;
            copy(staged, to);
        }
        Ok(())
    }

    /// Starts a kernel on rows of `width` elements; its first arguments are those given.
    ///
    /// # Errors
    /// Of the card.
    pub fn launch(&self, kernel: &str, (width, rows): (usize, usize), arguments: &[Argument]) -> Result<(), Failure> {
        self.start(kernel, (width, rows), arguments, false).map(|_| ())
    }

    /// As [`Gpu::launch`], of a kernel whose last argument is the array of sums over a block. Returns the sums over all.
    ///
    /// # Errors
    /// Of the card.
    pub fn sums<const K: usize>(
        &self,
        kernel: &str,
        (width, rows): (usize, usize),
        arguments: &[Argument],
    ) -> Result<[f64; K], Failure> {
        let blocks = self.start(kernel, (width, rows), arguments, true)?;
        let mut values = vec![[0.0; K]; blocks];
        self.download(&self.sums, values.as_flattened_mut())?;
        let mut sums = [0.0; K];
        for block in values {
            sums.iter_mut().zip(block).for_each(|(sum, value)| *sum += value);
        }
        Ok(sums)
    }

    /// Returns the number of blocks, which depends on the size alone.
    fn start(
        &self,
        kernel: &str,
        (width, rows): (usize, usize),
        arguments: &[Argument],
        sums: bool,
    ) -> Result<usize, Failure> {
        let function = &self.functions[kernel];
        let across = (width as u32).div_ceil(THREADS).min(WIDE);
        let grid_dim = (across, (BLOCKS / across).min(rows as u32), 1);
        let config = LaunchConfig { grid_dim, block_dim: (THREADS, 1, 1), shared_mem_bytes: 0 };
        let null = 0_u64;
        let address = |a: &Argument| if let Argument::Buffer(b) = a { b.address() } else { null };
        let addresses: Vec<u64> = arguments.iter().map(address).collect();
        let out = self.sums.address();
        let mut launch = self.stream.launch_builder(function);
        for (argument, address) in arguments.iter().zip(&addresses) {
            match argument {
                Argument::Int(value) => launch.arg(value),
                Argument::F32(value) => launch.arg(value),
                Argument::F64(value) => launch.arg(value),
                Argument::Buffer(_) | Argument::Null => launch.arg(address),
            };
        }
        if sums {
            launch.arg(&out);
        }
        // SAFETY: the callers pass the arguments in the order and of the types of the source, and buffers of the size of
        // the grid.
        unsafe { launch.launch(config) }.map_err(words)?;
        Ok((grid_dim.0 * grid_dim.1) as usize)
    }
}

/// Copies with all threads: the pages of a new field are mapped while they are written.
fn copy(from: &[u8], to: &mut [u8]) {
    to.par_chunks_mut(SHARE).zip(from.par_chunks(SHARE)).for_each(|(to, from)| to.copy_from_slice(from));
}

fn allocate(stream: &Arc<CudaStream>, bytes: usize) -> Result<Buffer, Failure> {
    // SAFETY: read only after it was written, which the callers see to.
    let bytes = unsafe { stream.alloc::<u8>(bytes) };
    Ok(Buffer { bytes: bytes.map_err(words)? })
}

/// A plan of cuFFT.
struct FftPlan(fft_sys::cufftHandle);

impl FftPlan {
    /// Of one direction, between rows of real and of complex elements, and the bytes of scratch memory that it needs.
    fn new(
        gpu: &Gpu,
        [mut n, mut from, mut to]: [[i64; 2]; 3],
        kind: fft_sys::cufftType,
    ) -> Result<(Self, usize), Failure> {
        let (previous, after) = (from[0] * from[1], to[0] * to[1]);
        let [n, from, to] = [&mut n, &mut from, &mut to].map(|a| a.as_mut_ptr());
        let plan = FftPlan(fft::create().map_err(words)?);
        // SAFETY: the arrays live through the call, and the stream longer than the plan.
        unsafe {
            fft::set_auto_allocation(plan.0, false).map_err(words)?;
            let bytes = fft::make_plan_many64(plan.0, 2, n, from, 1, previous, to, 1, after, kind, 1);
            let bytes = bytes.map_err(words)?;
            fft::set_stream(plan.0, gpu.stream.cu_stream().cast()).map_err(words)?;
            Ok((plan, bytes))
        }
    }
}

impl Drop for FftPlan {
    fn drop(&mut self) {
        // SAFETY: created by `new` and destroyed once. An error leaves memory allocated, no more.
        let _ = unsafe { fft::destroy(self.0) };
    }
}

/// Un-normalised real transforms in place of `ny` rows of `nx` values, `2 (nx/2 + 1)` apart.
pub struct GpuTransform {
    forward: FftPlan,
    inverse: FftPlan,
    double: bool,
}

impl GpuTransform {
    /// Plans in f32, or in f64 if `double`, and the bytes of scratch memory that both need.
    ///
    /// # Errors
    /// For a size that cuFFT does not transform.
    pub fn new(gpu: &Gpu, (nx, ny): (usize, usize), double: bool) -> Result<(Self, usize), Failure> {
        use fft_sys::cufftType::{CUFFT_C2R, CUFFT_D2Z, CUFFT_R2C, CUFFT_Z2D};
        gpu.stream.context().bind_to_thread().map_err(words)?;
        let (r2c, c2r) = if double { (CUFFT_D2Z, CUFFT_Z2D) } else { (CUFFT_R2C, CUFFT_C2R) };
        let (half, rows) = ((nx / 2 + 1) as i64, ny as i64);
        let (n, real, complex) = ([rows, nx as i64], [rows, 2 * half], [rows, half]);
        let (forward, bytes) = FftPlan::new(gpu, [n, real, complex], r2c)?;
        let (inverse, more) = FftPlan::new(gpu, [n, complex, real], c2r)?;
        Ok((GpuTransform { forward, inverse, double }, bytes.max(more)))
    }

    /// The scratch memory, which must live as long as the plans.
    ///
    /// # Errors
    /// Of cuFFT.
    pub fn set_scratch(&self, scratch: &Buffer) -> Result<(), Failure> {
        for plan in [&self.forward, &self.inverse] {
            // SAFETY: the buffer is as large as the plans need.
            unsafe { fft::set_work_area(plan.0, scratch.address() as *mut _) }.map_err(words)?;
        }
        Ok(())
    }

    /// # Errors
    /// Of cuFFT.
    pub fn forward(&self, data: &Buffer) -> Result<(), Failure> {
        let address = data.address();
        // SAFETY: the buffer has the rows of the plan.
        let done = unsafe {
            match self.double {
                true => fft::exec_d2z(self.forward.0, address as *mut _, address as *mut _),
                false => fft::exec_r2c(self.forward.0, address as *mut _, address as *mut _),
            }
        };
        done.map_err(words)
    }

    /// # Errors
    /// Of cuFFT.
    pub fn inverse(&self, data: &Buffer) -> Result<(), Failure> {
        let address = data.address();
        // SAFETY: the buffer has the rows of the plan.
        let done = unsafe {
            match self.double {
                true => fft::exec_z2d(self.inverse.0, address as *mut _, address as *mut _),
                false => fft::exec_c2r(self.inverse.0, address as *mut _, address as *mut _),
            }
        };
        done.map_err(words)
    }
}
