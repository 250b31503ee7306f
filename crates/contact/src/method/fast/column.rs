//! Vectorised multiplication of a column of the spectrum.

use crate::interface::Kernel;
use asperity_grid::{CHUNK, Grid, Real, dot, vectorised};
use rustfft::num_complex::Complex;

/// Factor of a mode.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Factor {
    Stiffness,
    Compliance,
}

/// Multiplies column `i` by stiffness or compliance (`rigid` for the mean mode) and by the 1/(nx ny) of the
/// transform. Returns the contribution of the column to `Σ factor |c|²` over the spectrum.
pub(super) fn multiply<T: Real, K: Kernel>(
    (kernel, factor, rigid): (&K, Factor, f64),
    grid: Grid,
    i: usize,
    column: &mut [Complex<T>],
) -> f64 {
    let per_point = 1.0 / grid.points() as f64;
    let qx = grid.qx(i);
    let sum = vectorised(
        #[inline(always)]
        || {
            let mut sum = 0.0;
            let mut first = 0;
            if i == 0 {
                sum += rigid * column[0].norm_sqr().wide();
                column[0] = column[0].scale(T::of(rigid * per_point));
                first = 1;
            }
            // The first half of the column holds positive modes, the second half the negative modes in reverse order.
            let middle = (grid.ny / 2 + 1).min(grid.ny);
            let (up, down) = column.split_at_mut(middle);
            let step = grid.qy_step();
            let mut mode = first;
            while mode < middle {
                let n = CHUNK.min(middle - mode);
                let mut factors = [0.0; CHUNK];
                kernel.along(qx, mode as f64, step, &mut factors[..n]);
                if factor == Factor::Compliance {
                    factors.iter_mut().for_each(|f| *f = 1.0 / *f);
                }
                sum += scale_by(&factors, per_point, up[mode..mode + n].iter_mut());
                // The mean along y and the Nyquist mode have no negative counterpart.
                let (start, end) = (mode.max(1), (mode + n).min(down.len() + 1));
                if start < end {
                    let all = down.len();
                    let negatives = &mut down[all + 1 - end..=all - start];
                    sum += scale_by(&factors[start - mode..], per_point, negatives.iter_mut().rev());
                }
                mode += n;
            }
            sum
        },
    );
    grid.column_weight(i) * per_point * per_point * sum
}

/// Multiplies modes by their factors and by `per_point`. Returns `Σ factor |c|²` of the original modes.
#[inline(always)]
fn scale_by<'c, T: Real>(
    factors: &[f64],
    per_point: f64,
    modes: impl ExactSizeIterator<Item = &'c mut Complex<T>>,
) -> f64 {
    let n = modes.len();
    let mut squares = [0.0; CHUNK];
    for ((c, f), s) in modes.zip(factors).zip(&mut squares) {
        *s = c.norm_sqr().wide();
        *c = c.scale(T::of(f * per_point));
    }
    dot(&factors[..n], &squares[..n])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interface::{CubicHalfSpace, HalfSpace};

    /// Positive and negative modes at any position in a chunk, and the sum.
    #[test]
    fn modes_are_multiplied_by_their_stiffness() {
        /// Rounding of sums of at most 260 terms.
        const ROUNDING: f64 = 1e-13;
        fn check(kernel: impl Kernel, factor: Factor, grid: Grid, i: usize) {
            let rigid = 0.7;
            let previous: Vec<Complex<f64>> =
                (0..grid.ny).map(|j| Complex::new((j as f64).sin() + 2.0, (3 * j) as f64 % 7.0)).collect();
            let mut column = previous.clone();
            let sum = multiply((&kernel, factor, rigid), grid, i, &mut column);
            let per_point = 1.0 / grid.points() as f64;
            let mut direct = 0.0;
            for (j, (actual, was)) in column.iter().zip(&previous).enumerate() {
                let stiffness = kernel.stiffness(grid.qx(i), grid.qy(j));
                let by = match factor {
                    _ if i == 0 && j == 0 => rigid,
                    Factor::Stiffness => stiffness,
                    Factor::Compliance => 1.0 / stiffness,
                };
                direct += by * was.norm_sqr();
                let miss = (*actual - was.scale(by * per_point)).norm();
                assert!(miss <= ROUNDING * actual.norm(), "{} rows, column {i}, mode {j}", grid.ny);
            }
            direct *= grid.column_weight(i) * per_point * per_point;
            assert!((sum / direct - 1.0).abs() < ROUNDING, "{} rows, column {i}: {sum} {direct}", grid.ny);
        }
        for ny in [1, 2, 3, 8, 9, 127, 128, 129, 130, 131, 260] {
            for i in [0, 1, 4] {
                for factor in [Factor::Stiffness, Factor::Compliance] {
                    check(HalfSpace, factor, Grid::unit(8, ny), i);
                    check(CubicHalfSpace::new(2.0, 1.0, 0.8).expect("stable"), factor, Grid::unit(8, ny), i);
                }
            }
        }
    }
}
