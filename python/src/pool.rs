//! Threads for a call.

use crate::errors::Raise;
use pyo3::prelude::*;

/// A pool of `count` threads, 0 for the default. One that outlives the call would hang in a forked process.
///
/// # Errors
/// `InputError` for more threads than are accepted; if they cannot be started.
pub(crate) fn threads(py: Python<'_>, count: usize) -> PyResult<rayon::ThreadPool> {
    let builder = asperity::grid::sys::threads::pool("problem", "threads", count).raise(py)?;
    builder.build().map_err(|error| pyo3::exceptions::PyOSError::new_err(format!("threads = {count}: {error}")))
}

/// Runs `f` without the interpreter's lock in a pool of its own.
///
/// # Errors
/// Those of [`threads`].
pub(crate) fn in_pool<R: Send>(py: Python<'_>, count: usize, f: impl FnOnce() -> R + Send) -> PyResult<R> {
    let pool = threads(py, count)?;
    py.detach(|| {
        let found = pool.install(f);
        drop(pool);
        Ok(found)
    })
}
