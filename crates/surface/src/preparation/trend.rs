//! Polynomials of the whole map.

use super::digits::{digits, in_unit};
use asperity_grid::{Grid, sum_rows};
use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

/// Functions of the basis: 1, u, v, P₂(u), P₂(v), uv; the first of them are the mean, and the plane.
const TERMS: usize = 6;

/// Degree of a polynomial in x and y.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Degree {
    Mean,
    Plane,
    Quadratic,
}

impl Degree {
    fn terms(self) -> usize {
        match self {
            Degree::Mean => 1,
            Degree::Plane => 3,
            Degree::Quadratic => TERMS,
        }
    }
}

/// Eigenvalue of the normal equations, over the largest, below which the measured points do not determine a combination of terms
/// (a single row has no slope along y). Rounding leaves 1e-15; a map whose measured points are all in a tenth of its width has 1e-6.
const UNDETERMINED: f64 = 1e-12;

/// The normal equations square the condition of the fit, so the remainder is fitted again.
const PASSES: usize = 2;

/// A polynomial in Legendre polynomials of coordinates from -1 to 1 over the map: orthogonal there up to the pixel size, whatever
/// the unit. Heights enter relative to one of them, so that a large offset costs no digits.
pub(super) struct Trend {
    degree: Degree,
    grid: Grid,
    offset: f64,
    coefficients: SVector<f64, TERMS>,
}

impl Trend {
    /// Fits the polynomial by least squares to the heights that are not NaN.
    pub(super) fn fit(degree: Degree, grid: Grid, heights: &[f64]) -> Self {
        let used = degree.terms();
        let offset = heights.iter().copied().find(|h| h.is_finite()).unwrap_or_default();
        let mut trend = Trend { degree, grid, offset, coefficients: SVector::zeros() };
        let products = SMatrix::<f64, TERMS, TERMS>::from_row_slice(&sum_rows(grid.ny, |y| {
            let mut sum = [0.0; TERMS * TERMS];
            for x in (0..grid.nx).filter(|x| !heights[y * grid.nx + x].is_nan()) {
                let basis = basis(grid, x, y);
                for (i, a) in basis.iter().take(used).enumerate() {
                    basis.iter().take(used).enumerate().for_each(|(j, b)| sum[i * TERMS + j] += a * b);
                }
            }
            sum
        }));
        let eigen = products.symmetric_eigen();
        let largest = eigen.eigenvalues.max();
        let inverse = eigen.eigenvalues.map(|e| if e > UNDETERMINED * largest { e.recip() } else { 0.0 });
        for _ in 0..PASSES {
            let moments: [f64; TERMS] = sum_rows(grid.ny, |y| {
                let mut sum = [0.0; TERMS];
                for x in 0..grid.nx {
                    let basis = basis(grid, x, y);
                    let residual = heights[y * grid.nx + x] - offset - trend.at(&basis);
                    if !residual.is_nan() {
                        sum.iter_mut().zip(basis).take(used).for_each(|(s, b)| *s += b * residual);
                    }
                }
                sum
            });
            let along = eigen.eigenvectors.transpose() * SVector::from(moments);
            trend.coefficients += eigen.eigenvectors * along.component_mul(&inverse);
        }
        trend
    }

    /// The plane of given slopes through the mean of the heights that are not NaN.
    pub(super) fn plane([x, y]: [f64; 2], grid: Grid, heights: &[f64]) -> Self {
        let mut trend = Trend { degree: Degree::Plane, grid, offset: 0.0, coefficients: SVector::zeros() };
        (trend.coefficients[1], trend.coefficients[2]) = (x * grid.lx / 2.0, y * grid.ly / 2.0);
        let mut level = heights.to_vec();
        trend.subtract(grid, &mut level);
        trend.offset = Trend::fit(Degree::Mean, grid, &level).mean();
        trend
    }

    /// The plane of given slopes through a height at a point, in lengths from the first one of the map.
    pub(super) fn plane_through([sx, sy]: [f64; 2], [x, y]: [f64; 2], height: f64, grid: Grid) -> Self {
        let centre = |n: usize, step: f64| 0.5 * (n - 1) as f64 * step;
        let (cx, cy) = (centre(grid.nx, grid.dx()), centre(grid.ny, grid.dy()));
        let offset = height + sx * (cx - x) + sy * (cy - y);
        let mut trend = Trend { degree: Degree::Plane, grid, offset, coefficients: SVector::zeros() };
        (trend.coefficients[1], trend.coefficients[2]) = (sx * grid.lx / 2.0, sy * grid.ly / 2.0);
        trend
    }

    fn mean(&self) -> f64 {
        self.offset + self.coefficients[0]
    }

    fn at(&self, basis: &[f64; TERMS]) -> f64 {
        self.coefficients.iter().zip(basis).map(|(c, b)| c * b).sum()
    }

    pub(super) fn subtract(&self, grid: Grid, heights: &mut [f64]) {
        heights.par_chunks_mut(grid.nx).enumerate().for_each(|(y, row)| {
            for (x, h) in row.iter_mut().enumerate() {
                *h = *h - self.offset - self.at(&basis(grid, x, y));
            }
        });
    }

    /// Its values for the history. Slopes are those at the centre.
    pub(super) fn words(&self, unit: &str) -> String {
        let c = &self.coefficients;
        // u = 2x/lx about the centre, P₂ = (3u² - 1)/2.
        let (per_x, per_y) = (2.0 / self.grid.lx, 2.0 / self.grid.ly);
        let slopes = format!("slopes {} in x, {} in y", digits(c[1] * per_x), digits(c[2] * per_y));
        match self.degree {
            Degree::Mean => in_unit(digits(self.mean()), unit),
            Degree::Plane => slopes,
            Degree::Quadratic => format!(
                "{slopes}, curvatures {} in x, {} in y, twist {}{}",
                digits(3.0 * c[3] * per_x * per_x),
                digits(3.0 * c[4] * per_y * per_y),
                digits(c[5] * per_x * per_y),
                if unit.is_empty() { String::new() } else { format!(" (per {unit})") }
            ),
        }
    }
}

/// The basis at the centre of a pixel.
fn basis(grid: Grid, x: usize, y: usize) -> [f64; TERMS] {
    let centred = |i: usize, n: usize| (2.0 * i as f64 - (n - 1) as f64) / n as f64;
    let (u, v) = (centred(x, grid.nx), centred(y, grid.ny));
    [1.0, u, v, 1.5 * u * u - 0.5, 1.5 * v * v - 0.5, u * v]
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { nx: 31, ny: 22, lx: 3.1, ly: 4.4 };

    fn wavy(i: usize) -> f64 {
        let (x, y) = ((i % GRID.nx) as f64, (i / GRID.nx) as f64);
        (0.9 * x).sin() * (0.7 * y + 0.3).cos() + 0.01 * x - 0.02 * y + 3e-4 * x * x + 2e-4 * x * y
    }

    fn heights(unit: f64, offset: f64, hole: bool) -> Vec<f64> {
        let measured = |i: usize| !hole || i % GRID.nx > 4 || i / GRID.nx > 9;
        (0..GRID.points()).map(|i| if measured(i) { offset + unit * wavy(i) } else { f64::NAN }).collect()
    }

    /// After the fit no multiple of a term lowers the sum of squares, in any unit, with an offset, and with missing points.
    #[test]
    fn remainders_are_orthogonal_to_the_form() {
        /// Rounding of sums over 700 points.
        const ROUNDING: f64 = 1e-13;
        /// An offset of 1e6 leaves ten digits of the heights.
        const OFFSET: f64 = 1e6;
        for (unit, offset, hole) in [(1.0, 0.0, false), (1e-9, 0.0, true), (1e6, 0.0, true), (1.0, OFFSET, true)] {
            for (kind, used) in [(Degree::Mean, 1), (Degree::Plane, 3), (Degree::Quadratic, 6)] {
                let mut h = heights(unit, offset, hole);
                let trend = Trend::fit(kind, GRID, &h);
                trend.subtract(GRID, &mut h);
                for term in 0..used {
                    let value_of = |i: usize| basis(GRID, i % GRID.nx, i / GRID.nx)[term];
                    let sum: f64 = (0..h.len()).filter(|&i| !h[i].is_nan()).map(|i| h[i] * value_of(i)).sum();
                    let mean = sum / h.len() as f64;
                    assert!(mean.abs() < ROUNDING * unit, "{kind:?} {unit} {offset} term {term}: {mean:e}");
                }
                let mut again = h.clone();
                Trend::fit(kind, GRID, &h).subtract(GRID, &mut again);
                let changed = h.iter().zip(&again).map(|(h, a)| (h - a).abs()).fold(0.0, f64::max);
                assert!(changed < 10.0 * ROUNDING * unit, "{kind:?} {unit} {offset}: {changed:e}");
            }
        }
    }

    /// A polynomial is removed to rounding, and its slopes and curvatures are written.
    #[test]
    fn a_polynomial_is_its_own_form() {
        let value_at = |i: usize| {
            let x = ((i % GRID.nx) as f64 + 0.5) * GRID.dx() - GRID.lx / 2.0;
            let y = ((i / GRID.nx) as f64 + 0.5) * GRID.dy() - GRID.ly / 2.0;
            5.0 + 0.012 * x - 0.003 * y + 0.5 * 0.2 * x * x - 0.5 * 0.1 * y * y + 0.04 * x * y
        };
        let mut h: Vec<f64> = (0..GRID.points()).map(value_at).collect();
        let trend = Trend::fit(Degree::Quadratic, GRID, &h);
        let line = "slopes 0.012 in x, -0.003 in y, curvatures 0.2 in x, -0.1 in y, twist 0.04";
        assert_eq!(trend.words(""), line);
        trend.subtract(GRID, &mut h);
        assert!(h.iter().all(|h| h.abs() < 1e-14), "{h:?}");
    }

    /// A profile has no slope along y, and a single measured point no slope at all.
    #[test]
    fn undetermined_terms_vanish() {
        let row = Grid { nx: 20, ny: 1, lx: 1.0, ly: 0.05 };
        let mut h: Vec<f64> = (0..20).map(|i| 2.0 + 0.1 * f64::from(i)).collect();
        let trend = Trend::fit(Degree::Plane, row, &h);
        trend.subtract(row, &mut h);
        assert!(h.iter().all(|h| h.abs() < 1e-14), "{h:?}");
        assert_eq!(trend.words(""), "slopes 2 in x, 0 in y");
        let mut one = vec![f64::NAN; GRID.points()];
        one[100] = 3.0;
        let trend = Trend::fit(Degree::Quadratic, GRID, &one);
        trend.subtract(GRID, &mut one);
        assert!(one[100].abs() < 1e-14);
    }
}
