//! Height maps from lines of `x y h`, in any order.

use super::height_map::HeightMap;
use asperity_grid::error::{Error, Result};
use std::path::Path;

/// Tolerance of a coordinate over the spacing: rounding by the writing program.
const OFF: f64 = 1e-2;

/// Coordinates and heights of a list of points.
pub(crate) struct Points {
    x: Vec<f64>,
    y: Vec<f64>,
    heights: Vec<f64>,
}

/// Places of one coordinate on an even grid.
struct GridPositions {
    positions: Vec<u32>,
    count: usize,
    spacing: f64,
}

impl Points {
    /// From lines of `width` numbers; `columns`: those of x, y and the height. Lines without any of them are left out.
    pub(crate) fn of(values: &[f64], width: usize, columns: [usize; 3]) -> Self {
        let lines = || values.chunks_exact(width).map(|line| columns.map(|k| line[k]));
        Self::of_lines(lines().filter(|line| !line.iter().all(|v| v.is_nan())))
    }

    fn of_lines(lines: impl Iterator<Item = [f64; 3]>) -> Self {
        let mut points = Points { x: Vec::new(), y: Vec::new(), heights: Vec::new() };
        for [x, y, height] in lines {
            points.x.push(x);
            points.y.push(y);
            points.heights.push(height);
        }
        points
    }

    /// A height map from three columns without names or blank lines. Returns an error if the first two are inconsistent coordinates, and
    /// `None` if they are heights.
    pub(crate) fn list(&self, path: &Path) -> Option<Result<(HeightMap, [f64; 2])>> {
        if self.x.len() < 4 {
            return None;
        }
        if self.x.iter().chain(&self.y).any(|v| !v.is_finite()) {
            // Coordinates with gaps are refused where they are.
            let lines = (0..self.x.len()).map(|k| [self.x[k], self.y[k], self.heights[k]]);
            let whole = Self::of_lines(lines.filter(|[x, y, _]| x.is_finite() && y.is_finite()));
            return whole.list(path).map(|_| self.grid(path));
        }
        let columns = [levels(&self.x), levels(&self.y)];
        let stays = (0..2).find(|&k| columns[k].0[0] == columns[k].0[1]);
        let runs = stays.map_or(Vec::new(), |k| columns[k].0.chunk_by(|a, b| a == b).map(<[u32]>::len).collect());
        let running = stays.is_some_and(|k| runs_along(&runs, if k == 0 { &self.y } else { &self.x }));
        if !running && !lattice(&columns) {
            return None;
        }
        let read = if stays.is_none() {
            let found = "coordinates of which neither stays from the first line to the second";
            Err(Error::format(path, found, "lines that run along x or along y, or names of the columns (# x y h)"))
        } else {
            self.grid(path)
        };
        Some(read.map_err(|e| match e {
            Error::Format { file, found, accepted } => {
                let or = "or --fourier none (surface.fourier) where all three columns are heights";
                Error::Format {
                    file,
                    found: format!("lines of x y h with {found}"),
                    accepted: format!("{accepted}; {or}"),
                }
            }
            other => other,
        }))
    }

    /// A height map and its extents, points times spacing, along x and y. Both coordinates are on even grids, not necessarily with the same
    /// spacing, and increase in the map; points that the list lacks are missing.
    ///
    /// # Errors
    /// Coordinates that are missing, stay, or are off an even grid; two heights at one point; fewer points than two thirds of the grid.
    pub(crate) fn grid(&self, path: &Path) -> Result<(HeightMap, [f64; 2])> {
        let [x, y] = [places(path, "x", &self.x)?, places(path, "y", &self.y)?];
        let (nx, ny) = (x.count, y.count);
        // A single coordinate off by half a step doubles the columns and leaves at most two thirds filled. The limit also bounds the
        // memory by the length of the file.
        if 3 * (self.heights.len() as u128) <= 2 * nx as u128 * ny as u128 {
            let found = format!("{} points on a grid of {nx} x {ny}", self.heights.len());
            return Err(Error::format(path, found, "x and y on an even grid with more than two thirds of its points"));
        }
        let mut taken = vec![false; nx * ny];
        let mut map = vec![f64::NAN; nx * ny];
        for (k, h) in self.heights.iter().enumerate() {
            let index = y.positions[k] as usize * nx + x.positions[k] as usize;
            if std::mem::replace(&mut taken[index], true) {
                let found = format!("two heights at x = {:e}, y = {:e}", self.x[k], self.y[k]);
                return Err(Error::format(path, found, "one for each point"));
            }
            map[index] = *h;
        }
        let map = HeightMap::with_missing(&path.display().to_string(), nx, ny, map)?;
        Ok((map, [nx as f64 * x.spacing, ny as f64 * y.spacing]))
    }
}

/// Rank of each entry among the distinct values, ascending, and the mean of the entries of each rank. Values closer than a quarter of the
/// widest difference are equal: coordinates differ by a spacing or by rounding.
fn levels(column: &[f64]) -> (Vec<u32>, Vec<f64>) {
    let mut order: Vec<u32> = (0..column.len() as u32).collect();
    order.sort_unstable_by(|&a, &b| column[a as usize].total_cmp(&column[b as usize]));
    let value = |i: usize| column[order[i] as usize];
    let widest = (1..order.len()).map(|i| value(i) - value(i - 1)).fold(0.0, f64::max);
    let (mut ranks, mut means, mut start) = (vec![0; column.len()], Vec::new(), 0);
    for i in 0..order.len() {
        ranks[order[i] as usize] = means.len() as u32;
        if i + 1 == order.len() || value(i + 1) - value(i) > 0.25 * widest {
            // Differences from the first keep the digits of large coordinates.
            let sum: f64 = (start..=i).map(|k| value(k) - value(start)).sum();
            means.push(value(start) + sum / (i + 1 - start) as f64);
            start = i + 1;
        }
    }
    (ranks, means)
}

fn places(path: &Path, name: &str, column: &[f64]) -> Result<GridPositions> {
    if let Some(k) = column.iter().position(|v| !v.is_finite()) {
        let found = format!("{name} = {} at point {} (counted from 1)", column[k], k + 1);
        return Err(Error::format(path, found, "coordinates that are finite numbers"));
    }
    let (ranks, means) = levels(column);
    let mut steps: Vec<f64> = means.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_unstable_by(f64::total_cmp);
    let Some(step) = steps.get(steps.len().saturating_sub(1) / 2).filter(|s| s.is_finite() && **s > 0.0) else {
        let found =
            format!("coordinates that stay ({name} = {:e} at all points)", column.first().copied().unwrap_or(0.0));
        return Err(Error::format(path, found, "x and y on an even grid of at least two points along each"));
    };
    let first = means[0];
    let last = ((means[means.len() - 1] - first) / step).round();
    let spacing = (means[means.len() - 1] - first) / last;
    let place = |v: f64| ((v - first) / spacing).round();
    for (k, v) in column.iter().enumerate() {
        let even = first + place(means[ranks[k] as usize]) * spacing;
        if (v - even).abs() > OFF * spacing {
            let found = format!("{name} = {v:e} at point {} (counted from 1)", k + 1);
            return Err(Error::format(path, found, format!("{even:e}, as even steps of {spacing:e} would have it")));
        }
    }
    if last >= f64::from(u32::MAX) {
        return Err(Error::format(path, format!("{last:e} steps of {name}"), "x and y on an even grid"));
    }
    let positions = ranks.iter().map(|level| place(means[*level as usize]) as u32).collect();
    Ok(GridPositions { positions, count: last as usize + 1, spacing })
}

/// Whether one column is constant in runs while the other, `other`, is monotonic in each run, which is unlikely for heights.
fn runs_along(runs: &[usize], other: &[f64]) -> bool {
    if runs.len() < 2 || runs[..runs.len() - 1].iter().any(|n| *n < 2) {
        return false;
    }
    let up = other[1] > other[0];
    let mut line = 0;
    runs.iter().all(|n| {
        let run = &other[line..line + n];
        line += n;
        run.windows(2).all(|w| if up { w[1] > w[0] } else { w[1] < w[0] })
    })
}

/// Whether the pairs are distinct points of a lattice and fill more than half of it. Pairs of heights either coincide
/// or are on a lattice with about as many rows as there are lines.
fn lattice([(x, xs), (y, ys)]: &[(Vec<u32>, Vec<f64>); 2]) -> bool {
    let mut pairs: Vec<_> = x.iter().zip(y).collect();
    pairs.sort_unstable();
    pairs.dedup();
    xs.len() > 1 && ys.len() > 1 && pairs.len() == x.len() && 2 * x.len() > xs.len() * ys.len()
}
