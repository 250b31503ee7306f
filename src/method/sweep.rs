//! A sweep over the rows of fields and of their half spectrum, between the row and the column passes of a transform.

use crate::grid::{Real, Transform, Worker, block_sums};
use rayon::prelude::*;
use rustfft::num_complex::Complex;

/// Calls `row(worker, y, spectrum, fields)` for every row `y` in parallel, with the transform's worker of the thread,
/// that row of the half spectrum and that row of the fields (`par_chunks` of `nx` nodes, zipped). The worker
/// transforms the row in either direction, so a field is read and written once while it is in cache. Returns the
/// values of the rows in order.
pub(super) fn sweep<T: Real, F: Send, S: Send>(
    transform: &Transform<T>,
    spectrum: &mut [Complex<T>],
    fields: impl IndexedParallelIterator<Item = F>,
    row: impl Fn(&mut Worker<'_, T>, usize, &mut [Complex<T>], F) -> S + Sync + Send,
) -> Vec<S> {
    spectrum
        .par_chunks_mut(transform.grid().pitch())
        .zip(fields)
        .enumerate()
        .map_init(|| transform.worker(), |worker, (y, (spectrum, fields))| row(worker, y, spectrum, fields))
        .collect()
}

/// As [`sweep`]; the values of the rows are summed in order.
pub(super) fn sweep_sums<T: Real, F: Send, const K: usize>(
    transform: &Transform<T>,
    spectrum: &mut [Complex<T>],
    fields: impl IndexedParallelIterator<Item = F>,
    row: impl Fn(&mut Worker<'_, T>, usize, &mut [Complex<T>], F) -> [f64; K] + Sync + Send,
) -> [f64; K] {
    block_sums(&sweep(transform, spectrum, fields, row))
}
