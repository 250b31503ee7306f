//! The exponential attraction integrated over two triangles per pixel, on which the gap is linear. By the
//! Hermite-Genocchi formula the mean of `exp(-x)` over a triangle is twice its divided difference at the corners; the
//! derivative with respect to a corner is twice the difference in which that corner appears twice.

use asperity_contact::interface::Exponential;
use asperity_grid::Grid;

/// Cutoff in ranges, as in the pointwise law.
const FAR: f64 = 40.0;

/// Points closer than this are expanded in a series; for others the difference formula loses less than a digit.
const CLOSE: f64 = 1.0;

/// Divided difference of the exponential function at points in ascending order.
pub(super) fn difference(z: &[f64]) -> f64 {
    let n = z.len();
    let spread = z[n - 1] - z[0];
    if n == 1 {
        z[0].exp()
    } else if spread > CLOSE {
        (difference(&z[1..]) - difference(&z[..n - 1])) / spread
    } else {
        series(z)
    }
}

/// `e^c Σ h_k(z - c)/(n - 1 + k)!` with the complete homogeneous polynomials `h_k`, about the midpoint of the range.
fn series(z: &[f64]) -> f64 {
    /// Offsets of at most one half: the next term is below 1e-17 of the first.
    const TERMS: usize = 14;
    let n = z.len();
    let middle = 0.5 * (z[0] + z[n - 1]);
    // Coefficients of 1/Π(1 - x z), factor by factor.
    let mut complete = [0.0; TERMS];
    complete[0] = 1.0;
    for z in z {
        for k in 1..TERMS {
            complete[k] += (z - middle) * complete[k - 1];
        }
    }
    let mut factorial: f64 = (1..n).map(|k| k as f64).product();
    let mut sum = 0.0;
    for (k, h) in complete.iter().enumerate() {
        if k > 0 {
            factorial *= (n - 1 + k) as f64;
        }
        sum += h / factorial;
    }
    middle.exp() * sum
}

/// Divided difference of `exp(-x)` at three corners, times two: the mean over their triangle.
fn mean(x: [f64; 3]) -> f64 {
    let mut z = x.map(|x| -x);
    z.sort_by(f64::total_cmp);
    2.0 * difference(&z)
}

/// Minus the derivative of half the mean by the first corner.
fn load(x: [f64; 3]) -> f64 {
    let mut z = [-x[0], -x[0], -x[1], -x[2]];
    z.sort_by(f64::total_cmp);
    difference(&z)
}

/// Corners of the six triangles around a node, as steps from it; all pixels are divided along the same diagonal.
const AROUND: [[(usize, usize); 2]; 6] = [
    [(1, 0), (0, 1)],
    [(0, 1), (NONE, 1)],
    [(NONE, 1), (NONE, 0)],
    [(NONE, 0), (0, NONE)],
    [(0, NONE), (1, NONE)],
    [(1, NONE), (1, 0)],
];
/// A step back, on a periodic grid.
const NONE: usize = usize::MAX;

/// Index after a step from `k` on a ring of `n`.
fn step(k: usize, by: usize, n: usize) -> usize {
    if by == NONE { (k + n - 1) % n } else { (k + by) % n }
}

/// Traction at node `i` (E*, attraction positive), the derivative of the energy; at most γ/ρ.
pub(super) fn traction(grid: Grid, law: Exponential, gap: &[f64], i: usize) -> f64 {
    let (x, y) = (i % grid.nx, i / grid.nx);
    let value_at = |(dx, dy): (usize, usize)| gap[step(y, dy, grid.ny) * grid.nx + step(x, dx, grid.nx)] / law.rho;
    let here = gap[i] / law.rho;
    let sum: f64 = AROUND
        .iter()
        .map(|[a, b]| [here, value_at(*a), value_at(*b)])
        .filter(|x| x.iter().any(|x| *x < FAR))
        .map(load)
        .sum();
    law.gamma / law.rho * sum
}

/// Energy per area of the two triangles to the right of and below node `i` (E*·L).
pub(super) fn energy(grid: Grid, law: Exponential, gap: &[f64], i: usize) -> f64 {
    let (x, y) = (i % grid.nx, i / grid.nx);
    let value_at = |dx, dy| gap[step(y, dy, grid.ny) * grid.nx + step(x, dx, grid.nx)] / law.rho;
    let pair = [[value_at(0, 0), value_at(1, 0), value_at(0, 1)], [value_at(1, 0), value_at(0, 1), value_at(1, 1)]];
    -law.gamma * 0.5 * pair.into_iter().filter(|x| x.iter().any(|x| *x < FAR)).map(mean).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Comparison with the sum over many small triangles, and the limit of a uniform gap.
    #[test]
    fn divided_differences_are_triangle_means() {
        for x in [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0 + 1e-9], [0.0, 0.5, 1.5], [0.0, 7.0, 0.3], [3.0, 3.0, 30.0]] {
            const N: usize = 400;
            let mut sum = 0.0;
            for i in 0..N {
                for j in 0..N - i {
                    let value_at = |a: f64, b: f64| {
                        let (a, b) = ((i as f64 + a) / N as f64, (j as f64 + b) / N as f64);
                        (-(x[0] + a * (x[1] - x[0]) + b * (x[2] - x[0]))).exp()
                    };
                    sum += value_at(1.0 / 3.0, 1.0 / 3.0);
                    if i + j + 1 < N {
                        sum += value_at(2.0 / 3.0, 2.0 / 3.0);
                    }
                }
            }
            let actual = mean(x);
            assert!((actual / (sum / (N * N) as f64) - 1.0).abs() < 2e-4, "{x:?}: {actual} {}", sum / (N * N) as f64);
        }
        assert!((mean([2.0; 3]) / (-2f64).exp() - 1.0).abs() < 1e-15);
    }

    /// Series and difference formula agree at the changeover and, for coinciding points, with the derivative.
    #[test]
    fn differences_are_smooth_in_their_points() {
        for spread in [0.999_999, 1.000_001, 1e-7, 2.5, 39.0] {
            let z = [-spread, -0.7 * spread, -0.2 * spread, 0.0];
            let direct = (difference(&z[1..]) - difference(&z[..3])) / spread;
            // Cancellation in the numerator of the direct difference.
            let lost = 1e-15 / spread.powi(3).min(1.0) / spread.min(1.0).powi(2);
            assert!((difference(&z) / direct - 1.0).abs() < 1e-13 + lost, "{spread}: {} {direct}", difference(&z));
        }
        assert!((difference(&[0.3; 4]) / (0.3f64.exp() / 6.0) - 1.0).abs() < 1e-14);
        let (below, above) =
            (difference(&[-1.0 + 1e-12, -0.4, -0.3, 0.0]), difference(&[-1.0 - 1e-12, -0.4, -0.3, 0.0]));
        assert!((below / above - 1.0).abs() < 1e-11, "{below} {above}");
    }

    /// Tractions are derivatives of the energy, at most γ/ρ, and those of a uniform gap are the law's.
    #[test]
    fn tractions_are_derivatives_of_the_energy() {
        let grid = Grid::unit(5, 4);
        let law = Exponential { gamma: 2e-4, rho: 1e-3 };
        let mut gap: Vec<f64> = (0..20).map(|i| 3e-4 * ((i * 7) % 11) as f64).collect();
        let total = |gap: &[f64]| (0..20).map(|i| energy(grid, law, gap, i)).sum::<f64>();
        for i in 0..20 {
            let (kept, h) = (gap[i], 1e-7);
            gap[i] = kept + h;
            let up = total(&gap);
            gap[i] = kept - h;
            let slope = (up - total(&gap)) / (2.0 * h);
            gap[i] = kept;
            let actual = traction(grid, law, &gap, i);
            assert!((actual / slope - 1.0).abs() < 1e-6, "{i}: {actual} {slope}");
            assert!(actual <= law.gamma / law.rho);
        }
        let flat = [5e-4; 20];
        assert!((traction(grid, law, &flat, 3) / (0.2 * (-0.5f64).exp()) - 1.0).abs() < 1e-14);
        assert!((total(&flat) / 20.0 / (-2e-4 * (-0.5f64).exp()) - 1.0).abs() < 1e-14);
    }
}
