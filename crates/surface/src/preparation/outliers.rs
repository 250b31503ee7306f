//! Spikes: points far from the median of their neighbourhood, in units of the usual distance.

use super::trend::{Degree, Trend};
use asperity_grid::error::{Error, Result};
use asperity_grid::{Grid, extent};
use rayon::prelude::*;

/// Half of the side of a neighbourhood of 5 x 5 points.
const REACH: usize = 2;

/// Median absolute deviation of a normal distribution to its standard deviation.
const TO_DEVIATION: f64 = 1.4826;

/// Points from which the scale is estimated; more change it by less than 1 %.
const SAMPLES: usize = 1 << 16;

/// Deviations up to this part of the range of heights are no spikes: an exact shape has deviations of rounding only.
const ROUNDING: f64 = 1e-9;

/// Robust standard deviations from which on a point is suspected. Of 100 periodic self-affine surfaces (H from 0.3 to 0.8,
/// 256² points, shortest wave of 2 to 8 points), the largest deviation was 6.8.
pub(crate) const SUSPECT: f64 = 10.0;

/// Makes the points beyond `threshold` robust standard deviations missing (NaN), and returns their number.
pub(super) fn remove(grid: Grid, heights: &mut [f64], periodic: bool, threshold: f64) -> Result<usize> {
    if !(threshold > 0.0 && threshold.is_finite()) {
        let accepted =
            format!("a positive number of robust standard deviations; {SUSPECT} is beyond any wave of a rough surface");
        return Err(Error::input("preparation", "--remove-outliers", threshold, accepted));
    }
    let removed = outliers(grid, heights, periodic, threshold);
    removed.iter().for_each(|&node| heights[node] = f64::NAN);
    Ok(removed.len())
}

/// Nodes of a map `[ny, nx]` that deviate from the median of their 5 x 5 neighbourhood by more than ten robust standard
/// deviations of these differences. NaN are points that were not measured.
pub(crate) fn suspected_outliers(grid: Grid, heights: &[f64], periodic: bool) -> Vec<usize> {
    outliers(grid, heights, periodic, SUSPECT)
}

fn outliers(grid: Grid, heights: &[f64], periodic: bool, threshold: f64) -> Vec<usize> {
    // On a steep tilt the median is nearly always the point itself.
    let mut level = heights.to_vec();
    Trend::fit(Degree::Plane, grid, heights).subtract(grid, &mut level);
    let heights = &level[..];
    let deviation = |node: usize, window: &mut Vec<f64>| {
        neighbourhood(grid, heights, periodic, node, window);
        heights[node] - median(window)
    };
    let Some(scale) = scale(heights, deviation) else { return Vec::new() };
    let (low, high) = extent(heights);
    let far = (threshold * scale).max(ROUNDING * (high - low));
    let rows = (0..grid.ny).into_par_iter().flat_map_iter(|y| {
        let mut window = Vec::with_capacity((2 * REACH + 1).pow(2));
        (y * grid.nx..(y + 1) * grid.nx).filter(move |&node| {
            if heights[node].is_nan() || surely_near(grid, heights, node, far) {
                return false;
            }
            neighbourhood(grid, heights, periodic, node, &mut window);
            (heights[node] - median(&mut window)).abs() > far
        })
    });
    rows.collect()
}

/// Whether the median around an inner point is surely near it: most of the 25 points are at most a little above, and most at most a
/// little below. The same then holds without the pairs of which one is missing. Nearly all points of a map are passed here, without
/// a search for their median.
fn surely_near(grid: Grid, heights: &[f64], node: usize, far: f64) -> bool {
    const SIDE: usize = 2 * REACH + 1;
    let (reach, height) = (REACH * grid.nx + REACH, heights[node]);
    let first = node.checked_sub(reach).filter(|_| (REACH..grid.nx.saturating_sub(REACH)).contains(&(node % grid.nx)));
    let Some(rows) = first.and_then(|first| heights.get(first..=node + reach)) else { return false };
    let (mut above, mut below) = (0, 0);
    for row in 0..SIDE {
        for h in &rows[row * grid.nx..][..SIDE] {
            below += usize::from(*h <= height + far);
            above += usize::from(*h >= height - far);
        }
    }
    2 * below > SIDE * SIDE && 2 * above > SIDE * SIDE
}

/// Robust standard deviation of the deviations, without those that are zero: on terraces of digitised heights they are most.
/// `None` if there are no others.
fn scale(heights: &[f64], deviation: impl Fn(usize, &mut Vec<f64>) -> f64 + Sync) -> Option<f64> {
    // An odd step visits all columns.
    let step = (heights.len() / SAMPLES).max(1) | 1;
    let samples =
        (0..heights.len().div_ceil(step)).into_par_iter().map(|k| k * step).filter(|&node| !heights[node].is_nan());
    let mut sizes: Vec<f64> = samples.map_init(Vec::new, |window, node| deviation(node, window).abs()).collect();
    sizes.retain(|d| *d > 0.0);
    (!sizes.is_empty()).then(|| TO_DEVIATION * median(&mut sizes))
}

/// Heights of a point and of the measured pairs of opposite points in its 5 x 5 neighbourhood. Without its opposite, at an edge or at
/// a hole, a point would shift the median of a slope.
fn neighbourhood(grid: Grid, heights: &[f64], periodic: bool, node: usize, window: &mut Vec<f64>) {
    let (nx, ny) = (grid.nx, grid.ny);
    let (x, y) = (node % nx, node / nx);
    let inside = |i: usize, n: usize| REACH.min(i).min(n - 1 - i);
    let reach = |i: usize, n: usize| if periodic { REACH.min((n - 1) / 2) } else { inside(i, n) };
    let (rx, ry) = (reach(x, nx), reach(y, ny));
    let wraps = rx > inside(x, nx) || ry > inside(y, ny);
    window.clear();
    window.push(heights[node]);
    for j in 0..=ry {
        // Offsets (i - rx, j); of the own row, those to the right.
        for i in if j == 0 { rx + 1 } else { 0 }..=2 * rx {
            let [ahead, behind] = if wraps {
                let there = (y + j) % ny * nx + (x + nx + i - rx) % nx;
                [there, (y + ny - j) % ny * nx + (x + nx + rx - i) % nx]
            } else {
                [node + j * nx + i - rx, node + rx - j * nx - i]
            };
            let pair = [heights[ahead], heights[behind]];
            if !(pair[0].is_nan() || pair[1].is_nan()) {
                window.extend(pair);
            }
        }
    }
}

/// The median of at least one number; of an even count, the upper of the two in the middle.
pub(crate) fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { nx: 60, ny: 50, lx: 6.0, ly: 5.0 };

    fn tilted(i: usize) -> f64 {
        let (x, y) = ((i % 60) as f64, (i / 60) as f64);
        20.0 * x - 7.0 * y + (0.9 * x).sin() * (0.8 * y).cos() + 0.1 * (((i * 7919) % 1009) as f64 / 1009.0 - 0.5)
    }

    /// Spikes are found, and nothing else: not in the steps of a tilted map at its edges, nor with other points missing.
    #[test]
    fn spikes_of_a_tilted_map_are_removed() {
        let mut heights: Vec<f64> = (0..GRID.points()).map(tilted).collect();
        assert!(suspected_outliers(GRID, &heights, false).is_empty());
        let spikes = [0, 59, 61 + 60 * 7, 1234, 1235, 60 * 48 + 30];
        spikes.iter().for_each(|&s| heights[s] += 60.0);
        heights[1233] = f64::NAN;
        assert_eq!(remove(GRID, &mut heights, false, SUSPECT).unwrap(), 4);
        let missing: Vec<usize> = (0..heights.len()).filter(|&i| heights[i].is_nan()).collect();
        // Corners have no neighbourhood.
        assert_eq!(missing, [481, 1233, 1234, 1235, 2910]);
        assert!(remove(GRID, &mut heights, false, 0.0).unwrap_err().to_string().contains("--remove-outliers = 0"));
    }

    /// Holes of a smooth map do not make their neighbours outliers.
    #[test]
    fn holes_have_no_outliers_around_them() {
        let smooth = |i: usize| ((i % 60) as f64 * 0.11).sin() * ((i / 60) as f64 * 0.13).cos();
        let holed = |i: usize| if (i * 7919) % 1009 < 40 { f64::NAN } else { smooth(i) };
        let heights: Vec<f64> = (0..GRID.points()).map(holed).collect();
        assert!(suspected_outliers(GRID, &heights, false).is_empty());
    }

    /// Maps without noise to compare with, and digitised ones.
    #[test]
    fn terraces_and_flats_have_no_outliers() {
        let count = |value: &dyn Fn(usize) -> f64| {
            suspected_outliers(GRID, &(0..GRID.points()).map(value).collect::<Vec<_>>(), true).len()
        };
        assert_eq!(count(&|_| 3.0), 0);
        assert_eq!(count(&|i| 1e3 + 0.7 * (i % 60) as f64 - 0.3 * (i / 60) as f64), 0);
        assert_eq!(count(&|i| f64::from(u8::from(i % 60 > 30))), 0);
        assert_eq!(count(&|i| (2.0 * (i as f64 * 0.37).sin()).round()), 0);
        assert_eq!(count(&|i| if i == 777 { 50.0 } else { (i as f64 * 0.037).sin().round() }), 1);
    }
}
