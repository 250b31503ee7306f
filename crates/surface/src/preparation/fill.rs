//! Points that were not measured.

use super::digits::digits;
use super::harmonic::harmonic;
use asperity_grid::Grid;
use asperity_grid::error::{Error, Result};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Largest share of missing points that is filled. Filled points are smooth: at this share they lower the rms gradient, to which
/// pressures are relative, by 5 % (1 - √0.9).
pub const MAX_FILLED_SHARE: f64 = 0.1;

/// How points that were not measured are filled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Fill {
    /// The height of the nearest measured point.
    Nearest,
    /// The harmonic function with the measured heights as boundary values.
    Harmonic,
}

impl Fill {
    pub(super) fn word(self) -> &'static str {
        match self {
            Fill::Nearest => "nearest",
            Fill::Harmonic => "harmonic",
        }
    }
}

/// What messages about missing points need: the place of the part in the whole map, and how many points were removed from it.
pub(super) struct Origin {
    pub column: usize,
    pub row: usize,
    pub removed: usize,
}

/// Fills the points that are NaN and returns their number.
pub(super) fn fill(kind: Option<Fill>, grid: Grid, heights: &mut [f64], periodic: bool, from: Origin) -> Result<usize> {
    let missing = heights.iter().filter(|h| h.is_nan()).count();
    let fraction = missing as f64 / heights.len() as f64;
    let found = || {
        let first = heights.iter().position(|h| h.is_nan()).expect("a point is missing");
        let (row, column) = (from.row + first / grid.nx + 1, from.column + first % grid.nx + 1);
        let outliers =
            if from.removed > 0 { format!("{} of them removed as outliers, ", from.removed) } else { String::new() };
        let fraction = digits(100.0 * fraction);
        format!(
            "{missing} of {} points were not measured, {outliers}the first in row {row}, column {column} (counted from 1): {fraction} %",
            heights.len()
        )
    };
    let refused = |accepted: String| Err(Error::input("preparation", "heights", found(), accepted));
    match kind {
        _ if missing == 0 => {}
        None => return refused("none, or `--fill nearest|harmonic`".to_string()),
        Some(_) if fraction > MAX_FILLED_SHARE => {
            let limit = 100.0 * MAX_FILLED_SHARE;
            return refused(format!("up to {limit} %, as filled points are smooth: `--crop` to a part with fewer"));
        }
        Some(Fill::Nearest) => nearest(grid, heights, periodic),
        Some(Fill::Harmonic) => harmonic(grid, heights, periodic),
    }
    Ok(missing)
}

/// Distance to the nearest measured row, of columns without one.
const NONE: i32 = i32::MAX;

/// Fills each missing point with the nearest measured height; of several at the same distance, that of the lowest row, then of the
/// lowest column. Across the edge of a periodic map, rows and columns are counted on.
fn nearest(grid: Grid, heights: &mut [f64], periodic: bool) {
    let rows = nearest_rows(grid, heights, periodic);
    let (nx, ny) = (grid.nx as i64, grid.ny as i64);
    let filled: Vec<(usize, f64)> = (0..heights.len())
        .into_par_iter()
        .filter(|&node| heights[node].is_nan())
        .map(|node| {
            let (x, y) = ((node % grid.nx) as i64, (node / grid.nx) as i64);
            let mut best = (f64::INFINITY, NONE, 0);
            let reach = if periodic { nx / 2 } else { nx };
            for k in 0..=reach {
                let along_x = (k as f64 * grid.dx()).powi(2);
                if along_x > best.0 {
                    break;
                }
                for i in [-k, k] {
                    if !periodic && !(0..nx).contains(&(x + i)) {
                        continue;
                    }
                    let j = rows[(y * nx + (x + i).rem_euclid(nx)) as usize];
                    if j != NONE {
                        let candidate = (along_x + (f64::from(j) * grid.dy()).powi(2), j, i);
                        if candidate < best {
                            best = candidate;
                        }
                    }
                }
            }
            let (_, j, i) = best;
            let from = (y + i64::from(j)).rem_euclid(ny) * nx + (x + i).rem_euclid(nx);
            (node, heights[from as usize])
        })
        .collect();
    filled.into_iter().for_each(|(node, height)| heights[node] = height);
}

/// For every point the signed distance in rows to the nearest measured point of its column; of two, the one above.
fn nearest_rows(grid: Grid, heights: &[f64], periodic: bool) -> Vec<i32> {
    let (nx, ny) = (grid.nx, grid.ny);
    let mut rows = vec![NONE; heights.len()];
    // A second pass in each direction continues across the edge of a periodic map.
    let passes = if periodic { 2 } else { 1 };
    let mut since = vec![NONE; nx];
    let step = |since: &mut i32, h: f64| *since = if h.is_nan() { since.saturating_add(1) } else { 0 };
    for y in (0..passes).flat_map(|_| 0..ny) {
        for x in 0..nx {
            step(&mut since[x], heights[y * nx + x]);
            rows[y * nx + x] = if since[x] == NONE { NONE } else { -since[x] };
        }
    }
    since.fill(NONE);
    for y in (0..passes).flat_map(|_| (0..ny).rev()) {
        for x in 0..nx {
            step(&mut since[x], heights[y * nx + x]);
            let row = &mut rows[y * nx + x];
            if since[x].unsigned_abs() < row.unsigned_abs() {
                *row = since[x];
            }
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHOLE: Origin = Origin { column: 0, row: 0, removed: 0 };

    /// Heights that name their point; a third of the points are missing, with one empty column and a large hole.
    fn holed(grid: Grid) -> Vec<f64> {
        let hole = |i: usize| {
            let (x, y) = (i % grid.nx, i / grid.nx);
            x == 2 || (i * i * 7 + 3 * i) % 11 < 2 || (5..11).contains(&x) && (4..9).contains(&y)
        };
        (0..grid.points()).map(|i| if hole(i) { f64::NAN } else { i as f64 }).collect()
    }

    /// Against a search over all points and their images, with square and rectangular pixels: ties by row, then column.
    #[test]
    fn the_nearest_point_is_that_of_a_search_over_all() {
        for (lx, ly) in [(17.0, 13.0), (17.0, 26.0), (8.5, 13.0)] {
            let grid = Grid { nx: 17, ny: 13, lx, ly };
            for periodic in [false, true] {
                let previous = holed(grid);
                let mut after = previous.clone();
                nearest(grid, &mut after, periodic);
                let images: &[i64] = if periodic { &[-1, 0, 1] } else { &[0] };
                for node in (0..grid.points()).filter(|&i| previous[i].is_nan()) {
                    let (x, y) = ((node % 17) as i64, (node / 17) as i64);
                    let mut best = (f64::INFINITY, 0, 0, 0);
                    for from in (0..grid.points()).filter(|&i| !previous[i].is_nan()) {
                        for (ix, iy) in images.iter().flat_map(|&ix| images.iter().map(move |&iy| (ix, iy))) {
                            let (u, v) = ((from % 17) as i64 + 17 * ix - x, (from / 17) as i64 + 13 * iy - y);
                            let square = (u as f64 * grid.dx()).powi(2) + (v as f64 * grid.dy()).powi(2);
                            if (square, v, u, from) < best {
                                best = (square, v, u, from);
                            }
                        }
                    }
                    assert_eq!(after[node], previous[best.3], "{lx} {ly} {periodic} ({x}, {y})");
                }
            }
        }
    }

    #[test]
    fn missing_points_are_refused_with_their_place() {
        let grid = Grid::unit(30, 20);
        let mut heights = vec![1.0; 600];
        heights[2 * 30 + 16] = f64::NAN;
        heights[400] = f64::NAN;
        let origin = Origin { column: 100, row: 10, removed: 1 };
        let text = fill(None, grid, &mut heights, false, origin).unwrap_err().to_string();
        assert_eq!(
            text,
            "preparation: heights = 2 of 600 points were not measured, 1 of them removed as outliers, the first in row 13, column 117 \
             (counted from 1): 0.333 %; accepted: none, or `--fill nearest|harmonic`"
        );
        heights[..61].fill(f64::NAN);
        let text = fill(Some(Fill::Nearest), grid, &mut heights, false, WHOLE).unwrap_err().to_string();
        assert!(text.contains("63 of 600 points were not measured, the first in row 1, column 1 (counted from 1): 10.5 %; accepted: up to 10 %"), "{text}");
    }
}
