//! Sums that are bit-identical for any number of threads.
//!
//! The reductions of rayon combine partial sums in an order that depends on work stealing. Here every row is summed
//! in order, and the row sums are added in order.

use super::Real;
use crate::sys::ranks::Ranks;
use rayon::prelude::*;

/// `K` sums at once over rows `0..rows`, each row giving its own partial sums.
pub fn sum_rows<const K: usize>(rows: usize, row: impl Fn(usize) -> [f64; K] + Sync) -> [f64; K] {
    // Through a pointer: rayon's part is compiled once for each number of sums.
    let row: &(dyn Fn(usize) -> [f64; K] + Sync) = &row;
    let partial: Vec<[f64; K]> = (0..rows).into_par_iter().map(row).collect();
    block_sums(&partial)
}

/// Adds partial sums in order.
pub fn block_sums<const K: usize>(partial: &[[f64; K]]) -> [f64; K] {
    let mut total = [0.0; K];
    for p in partial {
        for (t, v) in total.iter_mut().zip(p) {
            *t += v;
        }
    }
    total
}

/// The sums of all rows in order, given those of the rows of this rank, of `ny`.
pub fn sums_of_ranks<const K: usize>(ranks: &Ranks, ny: usize, local: &[[f64; K]]) -> [f64; K] {
    if !ranks.are_several() {
        return block_sums(local);
    }
    block_sums(ranks.gather(local.as_flattened(), &ranks.shares(ny, K)).as_chunks::<K>().0)
}

/// Runs a loop compiled for the widest vector instructions of this machine; `work` must be inlined. Results are
/// bit-identical on all machines: operations are neither contracted nor reordered.
#[inline(always)]
pub fn vectorised<R>(work: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(work)
}

/// Number of independent partial sums, so that additions can overlap.
const LANES: usize = 8;

/// Elements per chunk: the results of a loop over nodes or modes are still in cache when they are summed.
pub const CHUNK: usize = 64;

/// `Σ a` in a vectorisable order of additions.
#[inline(always)]
pub fn total(a: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    let a = a.chunks_exact(LANES);
    let remainder_sum: f64 = a.remainder().iter().sum();
    for a in a {
        for l in 0..LANES {
            lanes[l] += a[l];
        }
    }
    lanes.iter().sum::<f64>() + remainder_sum
}

/// `Σ a b` in a vectorisable order of additions.
#[inline(always)]
pub fn dot<A: Real, B: Real>(a: &[A], b: &[B]) -> f64 {
    let mut lanes = [0.0; LANES];
    let (a, b) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let remainder_sum: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a.wide() * b.wide()).sum();
    for (a, b) in a.zip(b) {
        for l in 0..LANES {
            lanes[l] += a[l].wide() * b[l].wide();
        }
    }
    lanes.iter().sum::<f64>() + remainder_sum
}

/// Length of the blocks in which a flat field is summed.
const BLOCK: usize = 4096;

/// Mean of a field.
pub fn mean<T: Real>(field: &[T]) -> f64 {
    let [s] = sum_rows(field.len().div_ceil(BLOCK), |b| [block(field, b).iter().map(|v| v.wide()).sum()]);
    s / field.len() as f64
}

/// Mean of a field of `len` values that is not stored; the same as that of the stored one.
pub fn mean_of(len: usize, value: impl Fn(usize) -> f64 + Sync) -> f64 {
    let [s] = sum_rows(len.div_ceil(BLOCK), |b| [(b * BLOCK..((b + 1) * BLOCK).min(len)).map(&value).sum()]);
    s / len as f64
}

/// Smallest value of a field; the order of comparisons does not matter.
pub fn lowest<T: Real>(field: &[T]) -> T {
    field.par_iter().copied().reduce(T::infinity, T::min)
}

/// Lowest and highest of finite numbers; (∞, −∞) of an empty slice.
pub fn extent(values: &[f64]) -> (f64, f64) {
    let (lanes, remainder) = values.as_chunks::<LANES>();
    let (mut low, mut high) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
    let mut include = |l: usize, v: f64| {
        // `f64::min` handles NaN, for which there is no vector instruction.
        low[l] = if v < low[l] { v } else { low[l] };
        high[l] = if v > high[l] { v } else { high[l] };
    };
    lanes.iter().for_each(|lane| (0..LANES).for_each(|l| include(l, lane[l])));
    remainder.iter().for_each(|&v| include(0, v));
    (low.into_iter().fold(f64::INFINITY, f64::min), high.into_iter().fold(f64::NEG_INFINITY, f64::max))
}

/// Root mean square deviation of a field from its mean, of finite values of any size.
pub fn rms<T: Real>(field: &[T]) -> f64 {
    let m = mean(field);
    let over = |unit: f64| {
        let square = |v: &T| ((v.wide() - m) / unit).powi(2);
        let [s] = sum_rows(field.len().div_ceil(BLOCK), |b| [block(field, b).iter().map(square).sum()]);
        (s / field.len() as f64).sqrt()
    };
    root_of_squares(over, || field.iter().map(|v| (v.wide() - m).abs()).fold(0.0, f64::max))
}

/// `root(1)`, a root mean square divided by its argument, computed again over the `largest` value if squares under- or
/// overflow.
pub(super) fn root_of_squares(root: impl Fn(f64) -> f64, largest: impl Fn() -> f64) -> f64 {
    /// Between these roots no square that matters is below 1e-300, none above 1e300.
    const SAFE: std::ops::Range<f64> = 1e-140..1e140;
    let plain = root(1.0);
    if SAFE.contains(&plain) || plain.is_nan() {
        return plain;
    }
    let unit = largest();
    if unit > 0.0 && unit.is_finite() { unit * root(unit) } else { plain }
}

fn block<T>(field: &[T], b: usize) -> &[T] {
    &field[b * BLOCK..field.len().min((b + 1) * BLOCK)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectorised_sums_include_every_element() {
        for n in [0, 1, 7, 8, 9, 40, 43] {
            let a: Vec<f32> = (0..n).map(|i| i as f32).collect();
            let b: Vec<f64> = (0..n).map(|i| f64::from(i) + 1.0).collect();
            let direct: f64 = (0..n).map(|i| f64::from(i) * (f64::from(i) + 1.0)).sum();
            assert_eq!(vectorised(|| dot(&a, &b)), direct, "{n}");
            assert_eq!(vectorised(|| total(&b)), f64::from(n * (n + 1) / 2), "{n}");
        }
    }

    /// The root mean square of ±1 and of the same times any double is that double.
    #[test]
    fn rms_of_values_of_any_size() {
        for size in [1e-307, 1e-200, 1e-100, 1.0, 1e100, 1e200, 1e307] {
            assert!((rms(&[size, -size, size, -size]) / size - 1.0).abs() < 1e-15, "{size:e}");
        }
        assert_eq!((rms(&[3.0, 3.0]), rms(&[f64::INFINITY, 0.0]).is_finite()), (0.0, false));
        assert!(rms(&[f64::NAN, 1.0]).is_nan());
    }

    #[test]
    fn extent_includes_every_element() {
        for n in [7, 8, 9, 43] {
            for (low, high) in [(0, n - 1), (n / 2, n / 3), (n - 1, n / 2)] {
                let mut values = vec![0.5; n];
                (values[high], values[low]) = (2.0, -3.0);
                assert_eq!(extent(&values), (-3.0, 2.0), "{n}");
            }
        }
        assert_eq!(extent(&[2.0]), (2.0, 2.0));
        assert_eq!(extent(&[]), (f64::INFINITY, f64::NEG_INFINITY));
    }

    #[test]
    fn sums_do_not_depend_on_the_number_of_threads() {
        let field: Vec<f64> = (0..100_000).map(|i| (i as f64 * 0.7).sin() * 1e3f64.powi(i % 5)).collect();
        let on = |n| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
            pool.install(|| (mean(&field).to_bits(), rms(&field).to_bits()))
        };
        assert_eq!(on(1), on(2));
        assert_eq!(on(1), on(7));
    }
}
