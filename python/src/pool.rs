//! Threads for a call.

use pyo3::prelude::*;

/// Runs `f` without the interpreter's lock in a pool of its own: one that outlives the call would hang in a forked process.
///
/// # Errors
/// If the threads cannot be started.
pub(crate) fn in_pool<R: Send>(py: Python<'_>, threads: usize, f: impl FnOnce() -> R + Send) -> PyResult<R> {
    py.detach(|| rayon::ThreadPoolBuilder::new().num_threads(threads).build().map(|pool| pool.install(f)))
        .map_err(|error| pyo3::exceptions::PyOSError::new_err(format!("threads = {threads}: {error}")))
}
