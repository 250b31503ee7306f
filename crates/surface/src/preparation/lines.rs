//! Forms of single scan lines.

use super::digits::{digits, in_unit};
use super::outliers::median;
use asperity_grid::{Grid, mean, rms};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

/// Eigenvalue of a line's normal equations, over the largest, below which its measured points do not determine a term.
const UNDETERMINED: f64 = 1e-12;

/// A polynomial of every row, in Legendre polynomials of a coordinate from -1 to 1 along it, relative to one of its heights.
pub(super) struct Lines {
    nx: usize,
    /// Height that enters first, and coefficients of 1, u, P₂(u); NaN and 0 of a row without measured points.
    rows: Vec<(f64, [f64; 3])>,
}

impl Lines {
    /// The slope that all rows have along x, and the medians of their measured points about it: on a slope a scar or a hole would shift the
    /// median of its row. A row without measured points keeps its place.
    pub(super) fn medians(grid: Grid, heights: &[f64]) -> Self {
        let slope = slope(grid.nx, heights);
        let of_row = |row: &[f64]| {
            let about = |(x, h): (usize, &f64)| h - slope * basis(x, grid.nx)[1];
            let mut measured: Vec<f64> = row.iter().enumerate().map(about).filter(|h| !h.is_nan()).collect();
            (if measured.is_empty() { f64::NAN } else { median(&mut measured) }, [0.0, slope, 0.0])
        };
        Lines { nx: grid.nx, rows: heights.par_chunks(grid.nx).map(of_row).collect() }
    }

    /// Least squares with two terms (linear) or three (quadratic), over the measured points.
    pub(super) fn polynomials(terms: usize, grid: Grid, heights: &[f64]) -> Self {
        let of_row = |row: &[f64]| {
            let offset = row.iter().copied().find(|h| !h.is_nan()).unwrap_or(f64::NAN);
            let (mut products, mut moments) = (Matrix3::zeros(), Vector3::zeros());
            for (x, h) in row.iter().enumerate().filter(|(_, h)| !h.is_nan()) {
                let basis = Vector3::from_fn(|k, _| if k < terms { basis(x, grid.nx)[k] } else { 0.0 });
                products += basis * basis.transpose();
                moments += basis * (h - offset);
            }
            let eigen = products.symmetric_eigen();
            let least = UNDETERMINED * eigen.eigenvalues.max();
            let inverse = eigen.eigenvalues.map(|e| if e > least { e.recip() } else { 0.0 });
            let along: Vector3<f64> = eigen.eigenvectors.transpose() * moments;
            (offset, (eigen.eigenvectors * along.component_mul(&inverse)).into())
        };
        Lines { nx: grid.nx, rows: heights.par_chunks(grid.nx).map(of_row).collect() }
    }

    pub(super) fn subtract(&self, heights: &mut [f64]) {
        heights.par_chunks_mut(self.nx).zip(&self.rows).for_each(|(row, (offset, coefficients))| {
            for (x, h) in row.iter_mut().enumerate() {
                let form: f64 = coefficients.iter().zip(basis(x, self.nx)).map(|(c, b)| c * b).sum();
                *h = *h - offset - form;
            }
        });
    }

    /// The levels of the lines, for the history.
    pub(super) fn words(&self, unit: &str) -> String {
        let levels: Vec<f64> =
            self.rows.iter().map(|(offset, c)| offset + c[0]).filter(|level| !level.is_nan()).collect();
        let steps: Vec<f64> = levels.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let (level, step) = (mean(&levels), if steps.is_empty() { 0.0 } else { rms(&steps) });
        let [level, step] = [level, step].map(|height| in_unit(digits(height), unit));
        format!("{} measured lines of mean level {level}, steps {step} (rms)", levels.len())
    }
}

/// The median slope of pairs of points in a row, a quarter of it apart, over the coordinate from -1 to 1: steps between rows are not in it,
/// and neither features nor digits of the heights decide it.
fn slope(nx: usize, heights: &[f64]) -> f64 {
    let apart = nx / 4;
    if apart == 0 {
        return 0.0;
    }
    let pairs = heights.par_chunks(nx).flat_map_iter(|row| row[apart..].iter().zip(row).map(|(h, before)| h - before));
    let mut differences: Vec<f64> = pairs.filter(|d| !d.is_nan()).collect();
    if differences.is_empty() { 0.0 } else { median(&mut differences) * nx as f64 / (2.0 * apart as f64) }
}

/// The basis at the centre of a pixel.
fn basis(x: usize, nx: usize) -> [f64; 3] {
    let u = (2.0 * x as f64 - (nx - 1) as f64) / nx as f64;
    [1.0, u, 1.5 * u * u - 0.5]
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { nx: 40, ny: 12, lx: 4.0, ly: 1.2 };

    /// Lines with offset, tilt and bow of their own, of which some points are missing, and one line as a whole.
    fn bowed(offset: f64, order: usize) -> Vec<f64> {
        let value = |x: usize, y: usize| {
            let [a, b, c] = [1, 2, 3].map(|k| ((7 * k + 5 * y) as f64).sin());
            let [_, u, bow] = basis(x, GRID.nx);
            offset + [a, b * u, c * bow][..order].iter().sum::<f64>()
        };
        let missing = |x: usize, y: usize| y == 7 || (x + 3 * y).is_multiple_of(11);
        let all = (0..GRID.points()).map(|i| (i % GRID.nx, i / GRID.nx));
        all.map(|(x, y)| if missing(x, y) { f64::NAN } else { value(x, y) }).collect()
    }

    #[test]
    fn lines_of_each_order_are_removed_to_rounding() {
        for (order, terms) in [(1, 1), (1, 2), (2, 2), (3, 3)] {
            let lines =
                |h: &[f64]| if terms == 1 { Lines::medians(GRID, h) } else { Lines::polynomials(terms, GRID, h) };
            for offset in [0.0, 1e6] {
                let mut h = bowed(offset, order);
                let missing = h.iter().filter(|h| h.is_nan()).count();
                lines(&h).subtract(&mut h);
                // An offset of 1e6 leaves ten digits.
                let rounding = 1e-14_f64.max(1e-16 * 10.0 * offset);
                assert!(h.iter().all(|h| h.is_nan() || h.abs() < rounding), "{order} {offset}");
                assert_eq!(h.iter().filter(|h| h.is_nan()).count(), missing);
            }
        }
        let mut curved = bowed(0.0, 3);
        Lines::polynomials(2, GRID, &curved).subtract(&mut curved);
        assert!(curved.iter().any(|h| h.abs() > 0.1));
    }

    /// On a tilt, scars and holes of less than half of their line leave it where it is.
    #[test]
    fn scarred_lines_of_a_tilted_map_are_level() {
        let offset = |y: usize| ((7 * y) as f64).sin();
        let tilted = |i: usize| offset(i / GRID.nx) + 3.0 * basis(i % GRID.nx, GRID.nx)[1];
        let mut h: Vec<f64> = (0..GRID.points()).map(tilted).collect();
        (25..40).for_each(|x| h[3 * GRID.nx + x] += 50.0);
        (0..18).for_each(|x| h[8 * GRID.nx + x] = f64::NAN);
        Lines::medians(GRID, &h).subtract(&mut h);
        // An even number of points has the upper one of both in the middle.
        let is_level = |(i, h): (usize, &f64)| h.is_nan() || h.abs() < 1e-12 || (i / GRID.nx == 3 && i % GRID.nx >= 25);
        assert!(h.iter().enumerate().all(is_level), "{h:?}");
    }

    /// A median does not follow a high feature that a mean would follow.
    #[test]
    fn medians_ignore_features() {
        let mut h = bowed(0.0, 1);
        (0..GRID.points()).filter(|i| i % GRID.nx < 10).for_each(|i| h[i] += 100.0);
        Lines::medians(GRID, &h).subtract(&mut h);
        let flat = h.iter().enumerate().filter(|(i, h)| i % GRID.nx >= 10 && !h.is_nan()).all(|(_, h)| h.abs() < 1e-14);
        assert!(flat, "{h:?}");
    }
}
