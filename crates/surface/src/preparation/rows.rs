//! Operations along rows, then along columns.

use rayon::prelude::*;

/// Columns that are transposed at once: a cache line.
const STRIP: usize = 8;

/// Applies an operation to every row (axis 0), then to every column (axis 1). `points`: those of a new row and of a new column.
pub(super) fn along_both(
    nx: usize,
    heights: &[f64],
    points: [usize; 2],
    apply: impl Fn(usize, &[f64], &mut [f64]) + Sync,
) -> Vec<f64> {
    let each_row = |axis: usize, n: usize, values: &[f64]| {
        let mut changed = vec![0.0; values.len() / n * points[axis]];
        let pairs = changed.par_chunks_mut(points[axis]).zip(values.par_chunks(n));
        pairs.for_each(|(to, from)| apply(axis, from, to));
        changed
    };
    let rows = each_row(0, nx, heights);
    let columns = each_row(1, heights.len() / nx, &transposed(points[0], &rows));
    transposed(points[1], &columns)
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
        let keep = |_: usize, from: &[f64], to: &mut [f64]| to.copy_from_slice(from);
        let sum = |axis: usize, from: &[f64], to: &mut [f64]| match axis {
            0 => to[0] = from.iter().sum(),
            _ => keep(axis, from, to),
        };
        let of_rows = along_both(9, &heights, [1, 11], sum);
        assert_eq!(of_rows, heights.chunks(9).map(|r| r.iter().sum()).collect::<Vec<f64>>());
        let same = along_both(9, &heights, [9, 11], keep);
        assert_eq!(same, heights);
    }
}
