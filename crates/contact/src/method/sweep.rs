//! A sweep over the rows of fields and of their half spectrum, between the row and the column passes of a transform.

use asperity_grid::{Real, Transform, Worker, sum_rows};
use rayon::prelude::*;
use rustfft::num_complex::Complex;

/// What [`sweep`] does with a row.
type Row<'r, T, F, S> = dyn Fn(&mut Worker<'_, T>, usize, &mut [Complex<T>], F) -> S + Sync + 'r;

/// Calls `row(worker, y, spectrum, fields)` for every row `y` (of this rank) in parallel, with the transform's worker of the thread,
/// that row of the half spectrum and that row of the fields (`par_chunks` of `nx` nodes, zipped). The worker
/// transforms the row in either direction, so a field is read and written once while it is in cache. Returns the
/// values of the rows in order.
pub(super) fn sweep<T: Real, F: Send, S: Send>(
    transform: &Transform<T>,
    spectrum: &mut [Complex<T>],
    fields: impl IndexedParallelIterator<Item = F>,
    row: impl Fn(&mut Worker<'_, T>, usize, &mut [Complex<T>], F) -> S + Sync,
) -> Vec<S> {
    each(transform, spectrum, fields, &row)
}

/// A function of its own: closures have the type parameters of the function that they are in, and rayon's part would be compiled
/// once for each law (332 times in place of 64).
fn each<T: Real, F: Send, S: Send>(
    transform: &Transform<T>,
    spectrum: &mut [Complex<T>],
    fields: impl IndexedParallelIterator<Item = F>,
    row: &Row<'_, T, F, S>,
) -> Vec<S> {
    let top = transform.own_rows().start;
    spectrum
        .par_chunks_mut(transform.grid().pitch())
        .zip(fields)
        .enumerate()
        .map_init(|| transform.worker(), |worker, (y, (spectrum, fields))| row(worker, top + y, spectrum, fields))
        .collect()
}

/// As [`sweep`]; the values of the rows of all ranks are summed in order.
pub(super) fn sweep_sums<T: Real, F: Send, const K: usize>(
    transform: &Transform<T>,
    spectrum: &mut [Complex<T>],
    fields: impl IndexedParallelIterator<Item = F>,
    row: impl Fn(&mut Worker<'_, T>, usize, &mut [Complex<T>], F) -> [f64; K] + Sync,
) -> [f64; K] {
    transform.sum_rows(&sweep(transform, spectrum, fields, row))
}

/// Calls `row(y, values)` for every row of `nx` values of a field, in parallel.
pub(super) fn each_row<T: Send>(field: &mut [T], nx: usize, row: impl Fn(usize, &mut [T]) + Sync) {
    // See `each`.
    fn through<T: Send>(field: &mut [T], nx: usize, row: &(dyn Fn(usize, &mut [T]) + Sync)) {
        field.par_chunks_mut(nx).enumerate().for_each(|(y, values)| row(y, values));
    }
    through(field, nx, &row);
}

/// Adds `by` to every value of a field.
pub(super) fn shift<T: Real>(field: &mut [T], by: T) {
    field.par_iter_mut().for_each(|v| *v += by);
}

/// Weights of the values `v` of a field of rows of `nx` with `v < limit` and with `v <= limit`.
pub(super) fn weight_below<T: Real>(
    (field, nx): (&[T], usize),
    limit: T,
    weight: impl Fn(usize) -> f64 + Sync,
) -> [f64; 2] {
    sum_rows(field.len() / nx, |y| {
        let mut sums = [0.0; 2];
        for (x, v) in field[y * nx..][..nx].iter().enumerate().filter(|(_, v)| **v <= limit) {
            let weight = weight(y * nx + x);
            sums[0] += if *v < limit { weight } else { 0.0 };
            sums[1] += weight;
        }
        sums
    })
}

/// Smallest value of a field up to which the weights add up to more than `sum`, or the highest value.
pub(super) fn weighted_quantile<T: Real>(field: &[T], weight: impl Fn(usize) -> f64, sum: f64) -> T {
    /// Digits of a key: four, from the highest.
    const BITS: u32 = 16;
    const SIGN: u64 = 1 << 63;
    // Unsigned numbers in the order of the values.
    let key = |v: T| match v.wide().to_bits() {
        bits if bits & SIGN == 0 => bits | SIGN,
        bits => !bits,
    };
    let (mut quantile_bits, mut below) = (0_u64, 0.0);
    let mut weights = vec![0.0; 1 << BITS];
    for shift in [48, 32, 16, 0] {
        weights.fill(0.0);
        // Those with the digits found so far.
        let same = |k: u64| (k ^ quantile_bits).checked_shr(shift + BITS).unwrap_or(0) == 0;
        let mut highest = 0;
        for (i, &v) in field.iter().enumerate() {
            let k = key(v);
            if same(k) {
                let digit = (k >> shift) as usize & ((1 << BITS) - 1);
                weights[digit] += weight(i);
                highest = highest.max(digit);
            }
        }
        let mut digit = 0;
        while digit < highest && below + weights[digit] <= sum {
            below += weights[digit];
            digit += 1;
        }
        quantile_bits |= (digit as u64) << shift;
    }
    T::of(f64::from_bits(if quantile_bits & SIGN == 0 { !quantile_bits } else { quantile_bits & !SIGN }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As the sorted field has it, at every rank, with signs, zeros and repeated values; weights count as repetitions.
    #[test]
    fn quantiles_are_those_of_the_sorted_field() {
        let mut field: Vec<f64> = (0..997).map(|i| ((i * 619) % 211) as f64 * 1e-3 - 0.1).collect();
        field.extend([0.0, -0.0, 1e-300, -1e-300, 3.0]);
        let mut sorted = field.clone();
        sorted.sort_by(f64::total_cmp);
        for (rank, expected) in sorted.iter().enumerate().step_by(7) {
            for fraction in [0.0, 0.5] {
                assert_eq!(weighted_quantile(&field, |_| 1.0, rank as f64 + fraction), *expected);
            }
        }
        assert_eq!(weighted_quantile(&field, |_| 1.0, 1e9), 3.0);
        let weight = |i: usize| [1.0, 3.0][i % 2];
        let mut repeated: Vec<f64> = field.iter().enumerate().flat_map(|(i, v)| vec![*v; weight(i) as usize]).collect();
        repeated.sort_by(f64::total_cmp);
        for rank in (0..repeated.len()).step_by(17) {
            assert_eq!(weighted_quantile(&field, weight, rank as f64 + 0.5), repeated[rank]);
        }
        let [under, up_to] = weight_below((&field[..1000], 10), 0.0, |_| 1.0);
        assert_eq!((under, up_to), {
            let count = |value: fn(&f64) -> bool| field[..1000].iter().filter(|v| value(v)).count() as f64;
            (count(|v| *v < 0.0), count(|v| *v <= 0.0))
        });
    }
}
