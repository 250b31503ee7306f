//! A sweep over the rows of fields and of their half spectrum, between the row and the column passes of a transform.

use crate::grid::{Real, Transform, Worker, block_sums};
use rayon::prelude::*;
use rustfft::num_complex::Complex;

/// What [`sweep`] does with a row.
type Row<'r, T, F, S> = dyn Fn(&mut Worker<'_, T>, usize, &mut [Complex<T>], F) -> S + Sync + 'r;

/// Calls `row(worker, y, spectrum, fields)` for every row `y` in parallel, with the transform's worker of the thread,
/// that row of the half spectrum and that row of the fields (`par_chunks` of `nx` nodes, zipped). The worker
/// transforms the row in either direction, so a field is read and written once while it is in cache. Returns the
/// values of the rows in order.
pub(super) fn sweep<T: Real, F: Send, S: Send>(
    transform: &Transform<T>,
    spectrum: &mut [Complex<T>],
    fields: impl IndexedParallelIterator<Item = F>,
    row: impl Fn(&mut Worker<'_, T>, usize, &mut [Complex<T>], F) -> S + Sync,
) -> Vec<S> {
    // Called through a pointer: rayon's part is then compiled once for all laws, not once for each.
    let row: &Row<'_, T, F, S> = &row;
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
    row: impl Fn(&mut Worker<'_, T>, usize, &mut [Complex<T>], F) -> [f64; K] + Sync,
) -> [f64; K] {
    block_sums(&sweep(transform, spectrum, fields, row))
}

/// Calls `row(y, values)` for every row of `nx` values of a field, in parallel.
pub(super) fn each_row<T: Send>(field: &mut [T], nx: usize, row: impl Fn(usize, &mut [T]) + Sync) {
    let row: &(dyn Fn(usize, &mut [T]) + Sync) = &row;
    field.par_chunks_mut(nx).enumerate().for_each(|(y, values)| row(y, values));
}

/// Adds `by` to every value of a field.
pub(super) fn shift<T: Real>(field: &mut [T], by: T) {
    field.par_iter_mut().for_each(|v| *v += by);
}

/// Number of values `v` of a field with `v < limit` and with `v <= limit`.
pub(super) fn count_below<T: Real>(field: &[T], limit: T) -> [usize; 2] {
    let is = |of: fn(&T, &T) -> bool| field.par_iter().filter(|v| of(v, &limit)).count();
    [is(T::lt), is(T::le)]
}
