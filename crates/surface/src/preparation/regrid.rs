//! Resampling to another number of points.

use super::rows::along_both;
use crate::resample;
use asperity_grid::error::{Error, Result};
use asperity_grid::sys::expect_memory;
use asperity_grid::{Grid, mean};

/// How a map would be resampled, in words.
pub(super) fn method(grid: Grid, points: [usize; 2], periodic: bool) -> &'static str {
    match [points[0] < grid.nx, points[1] < grid.ny] {
        _ if periodic => "Fourier interpolation",
        [true, true] => "averages over pixels",
        [false, false] => "cubic interpolation",
        [true, false] => "averages over pixels along x, cubic interpolation along y",
        [false, true] => "cubic interpolation along x, averages over pixels along y",
    }
}

/// The map on `[columns, rows]` points of the same extents. A periodic map keeps its first node and its waves that both grids resolve.
/// The pixels of a patch tile its extents: along an axis that is refined, heights at their centres are interpolated by cubic
/// convolution; along one that is coarsened, they are means over the new pixels.
pub(crate) fn regrid(grid: Grid, heights: Vec<f64>, points: [usize; 2], periodic: bool) -> Result<(Grid, Vec<f64>)> {
    let [nx, ny] = points;
    if nx == 0 || ny == 0 {
        let found = format!("{nx} x {ny} points");
        return Err(Error::input("preparation", "--resample", found, "at least one column and one row"));
    }
    // Heights, their transposed copies and a spectrum.
    const COPIES: u64 = 4;
    let need = COPIES.saturating_mul(size_of::<f64>() as u64).saturating_mul(nx as u64).saturating_mul(ny as u64);
    expect_memory(format!("a map of {nx} x {ny} points"), need, "--resample accepts fewer points")?;
    let new = Grid { nx, ny, ..grid };
    if [nx, ny] == [grid.nx, grid.ny] {
        return Ok((new, heights));
    }
    if periodic {
        let mean = mean(&heights);
        let mut resampled = resample(grid, &heights, new, 0.0);
        resampled.iter_mut().for_each(|h| *h += mean);
        return Ok((new, resampled));
    }
    let weights = [taps(grid.nx, nx), taps(grid.ny, ny)];
    Ok((new, weighted(grid, &heights, &weights)))
}

/// Heights at positions along x and along y, in pixels from the first centre, by cubic convolution.
pub(crate) fn sampled(grid: Grid, heights: &[f64], at: [&[f64]; 2]) -> Vec<f64> {
    let taps = |axis: usize, n: usize| at[axis].iter().map(|u| cubic(*u, n)).collect();
    weighted(grid, heights, &[taps(0, grid.nx), taps(1, grid.ny)])
}

/// Old points and their weights, for each new point of a line.
type Taps = Vec<Vec<(usize, f64)>>;

/// Sums along x, then along y.
fn weighted(grid: Grid, heights: &[f64], taps: &[Taps; 2]) -> Vec<f64> {
    let apply = |axis: usize, from: &[f64], to: &mut [f64]| {
        // Relative to the first value, as weights add up to one but for rounding.
        let base = from[0];
        for (t, taps) in to.iter_mut().zip(&taps[axis]) {
            *t = base + taps.iter().map(|(i, weight)| weight * (from[*i] - base)).sum::<f64>();
        }
    };
    along_both(grid.nx, heights, [taps[0].len(), taps[1].len()], apply)
}

/// Those of `new` pixels on a line of `old` ones.
fn taps(old: usize, new: usize) -> Taps {
    let ratio = old as f64 / new as f64;
    (0..new)
        .map(|i| if new < old { mean_over(i, ratio, old) } else { cubic((i as f64 + 0.5) * ratio - 0.5, old) })
        .collect()
}

/// Shares of the old pixels in the new pixel `i` of `ratio` times their side.
fn mean_over(i: usize, ratio: f64, old: usize) -> Vec<(usize, f64)> {
    let (from, to) = (i as f64 * ratio, (i + 1) as f64 * ratio);
    let shares = (from as usize..old).map(|k| (k, ((k + 1) as f64).min(to) - (k as f64).max(from)));
    let shares: Vec<_> = shares.take_while(|(_, fraction)| *fraction > 0.0).collect();
    let total: f64 = shares.iter().map(|s| s.1).sum();
    shares.into_iter().map(|(k, fraction)| (k, fraction / total)).collect()
}

/// Weights of cubic convolution at `u`, in old pixels from the first centre (Keys, IEEE Trans. ASSP 29 (1981) 1153): quadratic
/// polynomials are exact and slopes continuous. Values beyond the ends are those of the quadratic through the last three.
fn cubic(u: f64, n: usize) -> Vec<(usize, f64)> {
    let order = n.min(3);
    let lagrange = |first: usize| -> Vec<(usize, f64)> {
        let factor = |i: usize, k: usize| (u - k as f64) / (i as f64 - k as f64);
        let points = first..first + order;
        points.clone().map(|i| (i, points.clone().filter(|k| *k != i).map(|k| factor(i, k)).product())).collect()
    };
    if u < 0.0 || n < 3 {
        return lagrange(0);
    }
    let i = u.floor() as usize;
    if i + 1 >= n {
        return lagrange(n - order);
    }
    let t = u - i as f64;
    let weights = [
        ((2.0 - t) * t - 1.0) * t / 2.0,
        ((3.0 * t - 5.0) * t * t + 2.0) / 2.0,
        ((4.0 - 3.0 * t) * t + 1.0) * t / 2.0,
        (t - 1.0) * t * t / 2.0,
    ];
    let mut taps = vec![(i, weights[1]), (i + 1, weights[2])];
    // 3 h0 - 3 h1 + h2 continues a quadratic.
    let beyond = |ends: [usize; 3], w: f64| ends.into_iter().zip([3.0 * w, -3.0 * w, w]);
    if i == 0 {
        taps.extend(beyond([0, 1, 2], weights[0]))
    } else {
        taps.push((i - 1, weights[0]))
    }
    if i + 2 == n {
        taps.extend(beyond([n - 1, n - 2, n - 3], weights[3]))
    } else {
        taps.push((i + 2, weights[3]))
    }
    taps
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn on(grid: Grid, value: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let centre = |i: usize, d: f64| (i as f64 + 0.5) * d;
        (0..grid.points()).map(|i| value(centre(i % grid.nx, grid.dx()), centre(i / grid.nx, grid.dy()))).collect()
    }

    /// Waves of two points are those of no coarser or finer grid, but of their own.
    #[test]
    fn the_own_grid_changes_nothing() {
        let grid = Grid { nx: 6, ny: 4, lx: 3.0, ly: 2.0 };
        let board: Vec<f64> = (0..24).map(|i| [1.0, -1.0][(i % 6 + i / 6) % 2]).collect();
        for periodic in [true, false] {
            assert_eq!(regrid(grid, board.clone(), [6, 4], periodic).expect("points"), (grid, board.clone()));
        }
    }

    /// Quadratics are refined exactly up to the edges.
    #[test]
    fn refined_quadratics_are_exact() {
        /// Rounding of heights up to 10.
        const TOLERANCE: f64 = 1e-14;
        let value_of = |x: f64, y: f64| 9.0 + x - 2.0 * x * x + 0.5 * x * y + y * y;
        let coarse = Grid { nx: 7, ny: 3, lx: 1.4, ly: 1.2 };
        for points in [[7, 3], [8, 3], [20, 11], [29, 4]] {
            let (fine, heights) = regrid(coarse, on(coarse, value_of), points, false).unwrap();
            let exact = on(fine, value_of);
            assert!(heights.iter().zip(&exact).all(|(h, e)| (h - e).abs() < TOLERANCE), "{points:?}");
        }
    }

    /// Errors of a wave fall as the third power of the pixel.
    #[test]
    fn refinement_is_of_third_order() {
        let value_of = |x: f64, _: f64| (TAU * x + 0.4).sin();
        let error = |n: usize| {
            let (fine, heights) = regrid(Grid::unit(n, 1), on(Grid::unit(n, 1), value_of), [7 * n, 1], false).unwrap();
            heights.iter().zip(on(fine, value_of)).map(|(h, e)| (h - e).abs()).fold(0.0, f64::max)
        };
        let ratio = error(40) / error(80);
        assert!((7.5..8.5).contains(&ratio), "{ratio}");
    }

    /// Each new pixel is the mean over its area, and their mean is that of the map.
    #[test]
    fn coarsened_pixels_are_means() {
        let grid = Grid { nx: 6, ny: 4, lx: 6.0, ly: 4.0 };
        let heights: Vec<f64> = (0..24).map(|i| f64::from(i * i % 17)).collect();
        let (_, halved) = regrid(grid, heights.clone(), [3, 2], false).unwrap();
        for (k, h) in halved.iter().enumerate() {
            let index = 2 * (k % 3) + 12 * (k / 3);
            assert!(
                (h - (heights[index] + heights[index + 1] + heights[index + 6] + heights[index + 7]) / 4.0).abs()
                    < 1e-14
            );
        }
        let (_, uneven) = regrid(grid, heights.clone(), [5, 3], false).unwrap();
        assert!((mean(&uneven) - mean(&heights)).abs() < 1e-14);
        let (_, single) = regrid(grid, heights.clone(), [1, 1], false).unwrap();
        assert!((single[0] - mean(&heights)).abs() < 1e-14);
        assert!(regrid(grid, heights.clone(), [0, 4], false).unwrap_err().to_string().contains("--resample = 0 x 4"));
        assert!(regrid(grid, heights, [1 << 30, 1 << 30], false).unwrap_err().to_string().contains("memory"));
    }

    /// Waves of a periodic map, and its mean, are kept.
    #[test]
    fn periodic_waves_are_kept() {
        let wave = |grid: Grid| -> Vec<f64> {
            (0..grid.points())
                .map(|i| {
                    4.0 + (TAU * (2.0 * (i % grid.nx) as f64 / grid.nx as f64 - (i / grid.nx) as f64 / grid.ny as f64))
                        .sin()
                })
                .collect()
        };
        let (fine, heights) = regrid(Grid::unit(10, 8), wave(Grid::unit(10, 8)), [25, 5], true).unwrap();
        assert!(heights.iter().zip(wave(fine)).all(|(h, e)| (h - e).abs() < 1e-14));
    }
}
