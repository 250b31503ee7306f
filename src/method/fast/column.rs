//! Multiplication of a column of the spectrum, written for vectors.

use crate::grid::{CHUNK, Grid, Real, dot, vectorised};
use crate::interface::Kernel;
use rustfft::num_complex::Complex;

/// What modes are multiplied by.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Factor {
    Stiffness,
    Compliance,
}

/// Multiplies column `i` by stiffness or compliance and by the transform's 1/(nx ny), the mean mode by `rigid` instead.
/// Returns the column's share of `Σ factor |c|²` over the spectrum.
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
            // Up to the middle of the column modes are positive, and negative from there.
            let middle = (grid.ny / 2 + 1).min(grid.ny);
            let step = grid.qy_step();
            for (range, shift) in [(first..middle.max(first), 0.0), (middle.max(first)..grid.ny, -(grid.ny as f64))] {
                let mut mode = range.start as f64 + shift;
                for chunk in column[range].chunks_mut(CHUNK) {
                    let (mut factors, mut squares) = ([0.0; CHUNK], [0.0; CHUNK]);
                    kernel.along(qx, mode, step, &mut factors[..chunk.len()]);
                    if factor == Factor::Compliance {
                        factors.iter_mut().for_each(|f| *f = 1.0 / *f);
                    }
                    for ((c, f), s) in chunk.iter_mut().zip(&factors).zip(&mut squares) {
                        *s = c.norm_sqr().wide();
                        *c = c.scale(T::of(f * per_point));
                    }
                    sum += dot(&factors[..chunk.len()], &squares[..chunk.len()]);
                    mode += CHUNK as f64;
                }
            }
            sum
        },
    );
    grid.column_weight(i) * per_point * per_point * sum
}
