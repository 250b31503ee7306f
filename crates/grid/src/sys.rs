//! The only unsafe code: memory and processor time of this process and its children, process groups, column access to
//! matrices, and calls of LAMMPS's and CUDA's libraries.

#[cfg(feature = "cuda")]
pub mod gpu;
pub mod group;
mod memory;
pub mod ranks;
pub mod threads;

/// Largest resident set of this process so far, bytes (`VmHWM`); 0 where the kernel does not report it.
pub fn peak_rss_bytes() -> u64 {
    status_kib("self", "VmHWM:") * 1024
}

/// Resets [`peak_rss_bytes`] to the present resident set, where the kernel allows it.
pub fn reset_peak_rss() {
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// Returns freed memory to the system. The allocator would otherwise reuse it, and the next measurement would not count it.
pub fn return_freed_memory() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: malloc_trim takes an integer and touches only memory that nobody holds.
    unsafe {
        libc::malloc_trim(0);
    }
}

/// Peak memory since a starting point, beyond what was resident then. Pages of files, as those of the program, are not counted: the system
/// drops them where memory is short.
pub struct MemoryGrowth {
    before: u64,
    files_before: u64,
    earlier_peak: u64,
}

impl MemoryGrowth {
    /// Returns freed memory to the system first (see [`return_freed_memory`]), then starts to count.
    pub fn begin() -> Self {
        let earlier_peak = peak_rss_bytes();
        return_freed_memory();
        reset_peak_rss();
        MemoryGrowth { before: peak_rss_bytes(), files_before: file_bytes(), earlier_peak }
    }

    /// Resident set at the start, bytes.
    pub fn before_bytes(&self) -> u64 {
        self.before
    }

    /// Largest increase since the start, bytes.
    pub fn bytes(&self) -> u64 {
        let of_files = file_bytes().saturating_sub(self.files_before);
        peak_rss_bytes().saturating_sub(self.before + of_files)
    }

    /// Peak of the whole process, bytes, including the time before the start.
    pub fn peak_bytes(&self) -> u64 {
        peak_rss_bytes().max(self.earlier_peak)
    }
}

/// Resident pages of files, bytes.
fn file_bytes() -> u64 {
    status_kib("self", "RssFile:") * 1024
}

/// Largest resident set of any child that has ended, bytes.
pub fn children_peak_rss_bytes() -> u64 {
    usage(libc::RUSAGE_CHILDREN).ru_maxrss.max(0) as u64 * 1024
}

/// Processor time of this process so far, all its threads together, seconds.
pub fn cpu_seconds() -> f64 {
    processor_seconds(usage(libc::RUSAGE_SELF))
}

/// Processor time of all children that have ended, seconds.
pub fn children_cpu_seconds() -> f64 {
    processor_seconds(usage(libc::RUSAGE_CHILDREN))
}

fn processor_seconds(usage: libc::rusage) -> f64 {
    let seconds = |t: libc::timeval| t.tv_sec as f64 + 1e-6 * t.tv_usec as f64;
    seconds(usage.ru_utime) + seconds(usage.ru_stime)
}

fn usage(who: libc::c_int) -> libc::rusage {
    // SAFETY: getrusage fills the plain struct it is handed, for which all-zero bytes are a value.
    unsafe {
        let mut usage: libc::rusage = std::mem::zeroed();
        libc::getrusage(who, &mut usage);
        usage
    }
}

/// Memory that can be taken without swapping, bytes: `MemAvailable`, or what control groups and the limit of address space leave, if
/// that is less; `u64::MAX` where the kernel reports none of them.
pub fn available_memory_bytes() -> u64 {
    let machine = std::fs::read_to_string("/proc/meminfo").ok().and_then(|t| kib_after(&t, "MemAvailable:"));
    machine
        .map(|kib| kib * 1024)
        .into_iter()
        .chain(memory::limit(status_kib("self", "VmRSS:")))
        .min()
        .unwrap_or(u64::MAX)
}

/// Refuses what needs more memory than is available.
///
/// # Errors
/// `Memory`.
pub fn expect_memory(what: String, need: u64, advice: &str) -> crate::Result<()> {
    let have = available_memory_bytes();
    if need > have { Err(crate::Error::Memory { what, need, have, advice: advice.into() }) } else { Ok(()) }
}

/// Whether this process runs as root, which mpirun refuses by default.
pub fn is_root() -> bool {
    use std::os::unix::fs::MetadataExt;
    std::fs::metadata("/proc/self").is_ok_and(|m| m.uid() == 0)
}

/// Largest resident set so far of a running process, bytes; 0 for one that has ended.
pub fn peak_rss_bytes_of(process: u32) -> u64 {
    1024 * status_kib(&process.to_string(), "VmHWM:")
}

fn status_kib(process: &str, key: &str) -> u64 {
    std::fs::read_to_string(format!("/proc/{process}/status")).ok().and_then(|t| kib_after(&t, key)).unwrap_or(0)
}

fn kib_after(text: &str, key: &str) -> Option<u64> {
    text.lines().find_map(|l| l.strip_prefix(key))?.split_whitespace().next()?.parse().ok()
}

/// A mutably borrowed row-major matrix, split into blocks of whole columns for threads.
///
/// The column pass of a two-dimensional transform is parallel over columns, whose elements are interleaved in memory;
/// slices cannot express that split. Each block is handed out once, and blocks cover disjoint columns.
pub struct ColumnBlocks<'a, T> {
    start: *mut T,
    rows: usize,
    stride: usize,
    width: usize,
    matrix: std::marker::PhantomData<&'a mut [T]>,
}

/// The columns `first .. first + width` of every row.
pub struct ColumnBlock<'a, T> {
    start: *mut T,
    rows: usize,
    stride: usize,
    first: usize,
    width: usize,
    matrix: std::marker::PhantomData<&'a mut [T]>,
}

// SAFETY: the pointer stands for an exclusive borrow of a slice of T, and is only used through disjoint blocks.
unsafe impl<T: Send> Sync for ColumnBlocks<'_, T> {}

impl<'a, T: Send> ColumnBlocks<'a, T> {
    /// Splits `matrix` (rows of `stride` elements) into blocks of `width` columns, the last one narrower if need be.
    pub fn new(matrix: &'a mut [T], stride: usize, width: usize) -> Self {
        assert!(stride > 0 && width > 0 && matrix.len().is_multiple_of(stride));
        let rows = matrix.len() / stride;
        ColumnBlocks { start: matrix.as_mut_ptr(), rows, stride, width, matrix: std::marker::PhantomData }
    }

    /// Runs `work` on every block, in parallel. The results are in the order of the columns.
    pub fn map_init<S, R: Send>(
        self,
        init: impl Fn() -> S + Sync + Send,
        work: impl Fn(&mut S, ColumnBlock<'_, T>) -> R + Sync + Send,
    ) -> Vec<R> {
        use rayon::prelude::*;
        let this = &self;
        (0..this.stride.div_ceil(this.width))
            .into_par_iter()
            .map_init(init, |state, b| {
                let first = b * this.width;
                let block = ColumnBlock {
                    start: this.start,
                    rows: this.rows,
                    stride: this.stride,
                    first,
                    width: this.width.min(this.stride - first),
                    matrix: std::marker::PhantomData,
                };
                work(state, block)
            })
            .collect()
    }
}

impl<T> ColumnBlock<'_, T> {
    pub fn first(&self) -> usize {
        self.first
    }

    /// Prefetches this block's part of row `y`. The row need not exist.
    pub fn fetch(&self, y: usize) {
        prefetch(self.start.wrapping_add(y * self.stride + self.first), self.width);
    }

    /// This block's part of row `y`.
    pub fn row(&mut self, y: usize) -> &mut [T] {
        assert!(y < self.rows);
        // SAFETY: row y and columns first..first+width lie inside the borrowed matrix, no other block covers these
        // columns, and `&mut self` keeps this block from lending two rows at once.
        unsafe { std::slice::from_raw_parts_mut(self.start.add(y * self.stride + self.first), self.width) }
    }
}

/// Prefetches `len` elements from `start` on, which need not exist.
#[inline]
pub fn prefetch<T>(start: *const T, len: usize) {
    #[cfg(target_arch = "x86_64")]
    for line in (0..len * size_of::<T>()).step_by(64) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: a prefetch reads nothing that the program sees, and of an address that is not mapped nothing at all.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(start.cast::<i8>().wrapping_add(line)) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (start, len);
}

/// From now on SIGTERM ends this process at once, without a handler.
pub fn end_at_termination() {
    // SAFETY: the default action replaces a handler; no code of this process runs.
    unsafe {
        libc::signal(libc::SIGTERM, libc::SIG_DFL);
    }
}

static USER_SIGNAL: std::sync::atomic::AtomicBool = std::sync::atomic::AtomicBool::new(false);

/// From now on SIGUSR1 is noted instead of ending the program.
pub fn note_user_signal() {
    extern "C" fn note(_: libc::c_int) {
        USER_SIGNAL.store(true, std::sync::atomic::Ordering::Relaxed);
    }
    // SAFETY: the handler only stores into an atomic, which is async-signal-safe.
    unsafe {
        libc::signal(libc::SIGUSR1, note as *const () as libc::sighandler_t);
    }
}

/// Whether SIGUSR1 has come since [`note_user_signal`].
pub fn user_signal() -> bool {
    USER_SIGNAL.load(std::sync::atomic::Ordering::Relaxed)
}
