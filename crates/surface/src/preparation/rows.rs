//! Operations along rows, then along columns.

use rayon::prelude::*;

/// Columns that are transposed at once: a cache line.
const STRIP: usize = 8;

/// A linear operation on one line: from its values to those of the new line.
pub(super) struct Along<'a> {
    /// Points of the new line.
    pub points: usize,
    pub apply: &'a (dyn Fn(&[f64], &mut [f64]) + Sync),
}

/// Applies an operation along x to every row, then another along y to every column. Rows `[ny, nx]` to
/// `[along_y.points, along_x.points]`.
pub(super) fn along_both(nx: usize, heights: &[f64], along_x: Along, along_y: Along) -> Vec<f64> {
    let ny = heights.len() / nx;
    let rows = each_row(nx, heights, &along_x);
    let columns = each_row(ny, &transposed(along_x.points, &rows), &along_y);
    transposed(along_y.points, &columns)
}

fn each_row(n: usize, values: &[f64], along: &Along) -> Vec<f64> {
    let mut changed = vec![0.0; values.len() / n * along.points];
    let pairs = changed.par_chunks_mut(along.points).zip(values.par_chunks(n));
    pairs.for_each(|(to, from)| (along.apply)(from, to));
    changed
}

/// `[ny, nx]` to `[nx, ny]`.
fn transposed(nx: usize, values: &[f64]) -> Vec<f64> {
    let ny = values.len() / nx;
    let mut turned = vec![0.0; values.len()];
    turned.par_chunks_mut(STRIP * ny).enumerate().for_each(|(strip, columns)| {
        for y in 0..ny {
            for (c, column) in columns.chunks_mut(ny).enumerate() {
                column[y] = values[y * nx + strip * STRIP + c];
            }
        }
    });
    turned
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_and_columns_are_processed_once_each() {
        let heights: Vec<f64> = (0..9 * 11).map(f64::from).collect();
        let sum = |from: &[f64], to: &mut [f64]| to[0] = from.iter().sum();
        let keep = |from: &[f64], to: &mut [f64]| to.copy_from_slice(from);
        let of_rows = along_both(9, &heights, Along { points: 1, apply: &sum }, Along { points: 11, apply: &keep });
        assert_eq!(of_rows, heights.chunks(9).map(|r| r.iter().sum()).collect::<Vec<f64>>());
        let same = along_both(9, &heights, Along { points: 9, apply: &keep }, Along { points: 11, apply: &keep });
        assert_eq!(same, heights);
    }
}
