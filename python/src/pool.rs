//! Threads for a call.

use crate::errors::Raise;
use asperity::grid::sys::threads::{not_started, pool};
use pyo3::prelude::*;

/// A pool of `count` threads, 0 for the default. One that outlives the call would hang in a forked process.
///
/// # Errors
/// `InputError` for more threads than are accepted, `ResourceError` if they cannot be started.
pub(crate) fn threads(py: Python<'_>, count: usize) -> PyResult<rayon::ThreadPool> {
    let builder = pool("problem", "threads", count).raise(py)?;
    builder.build().map_err(|error| not_started(&error)).raise(py)
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
