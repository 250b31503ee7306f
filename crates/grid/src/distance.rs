//! The nearest marked node of every node, on the periodic cell.
//!
//! Exact Euclidean distances in two passes over the field, one along each axis (Felzenszwalb & Huttenlocher, Theory of
//! Computing 8 (2012) 415): down the columns the nearest marked row, then along each row the lower envelope of the
//! parabolas given by the columns' results. The time is linear in the number of nodes.

use super::Grid;
use rayon::prelude::*;

/// Result where no node is marked.
pub const NO_NODE: u32 = u32::MAX;

/// For each node `[ny, nx]` the index of the nearest marked one (nonzero in `map`); [`NO_NODE`] if none is.
pub fn nearest_marked(grid: Grid, map: &[u8]) -> Vec<u32> {
    let (nx, ny) = (grid.nx, grid.ny);
    let mut nearest = nearest_rows(nx, ny, map);
    let (dx, dy) = (grid.dx(), grid.dy());
    nearest.par_chunks_mut(nx).enumerate().for_each_init(Envelope::default, |envelope, (y, row)| {
        // Squares of the distances along y, of columns that have a marked node.
        let column = |x: usize| {
            (row[x] != NO_NODE).then(|| {
                let d = dy * around(row[x] as usize, y, ny);
                d * d
            })
        };
        envelope.raise(nx, dx, column);
        let rows: Vec<u32> = row.to_vec();
        for (x, out) in row.iter_mut().enumerate() {
            if let Some(from) = envelope.lowest_at(x as i64, dx) {
                let from = from.rem_euclid(nx as i64) as usize;
                *out = rows[from] * nx as u32 + from as u32;
            }
        }
    });
    nearest
}

/// Vector from node `from` to the nearest periodic image of node `to`, units of L.
pub fn minimum_image(grid: Grid, from: usize, to: usize) -> [f64; 2] {
    let (nx, ny) = (grid.nx, grid.ny);
    let steps = |a: usize, b: usize, n: usize| super::signed_mode((b + n - a) % n, n) as f64;
    [grid.dx() * steps(from % nx, to % nx, nx), grid.dy() * steps(from / nx, to / nx, ny)]
}

/// Steps between two of `n` places on a ring.
fn around(a: usize, b: usize, n: usize) -> f64 {
    let d = a.abs_diff(b);
    d.min(n - d) as f64
}

/// For each node the nearest row of its column with a marked node; of two at the same distance, the one found by
/// increasing rows.
fn nearest_rows(nx: usize, ny: usize, map: &[u8]) -> Vec<u32> {
    let mut rows = vec![NO_NODE; nx * ny];
    // Two passes in each direction: the first one has no data beyond the periodic boundary.
    let mut last = vec![NO_NODE; nx];
    for y in (0..ny).chain(0..ny) {
        for x in 0..nx {
            if map[y * nx + x] != 0 {
                last[x] = y as u32;
            }
            rows[y * nx + x] = last[x];
        }
    }
    for y in (0..ny).rev().chain((0..ny).rev()) {
        for x in 0..nx {
            if map[y * nx + x] != 0 {
                last[x] = y as u32;
            }
            let row = &mut rows[y * nx + x];
            if last[x] != NO_NODE && around(last[x] as usize, y, ny) < around(*row as usize, y, ny) {
                *row = last[x];
            }
        }
    }
    rows
}

/// Lower envelope of parabolas `(x dx - k dx)² + f(k)` along a row and half a row to either side of it.
#[derive(Default)]
struct Envelope {
    /// Column, its f, and start (in columns) of the interval in which its parabola is the lowest.
    parts: Vec<(i64, f64, f64)>,
    /// Index of the part at the last column.
    current: usize,
}

impl Envelope {
    fn raise(&mut self, nx: usize, dx: f64, f: impl Fn(usize) -> Option<f64>) {
        self.parts.clear();
        self.current = 0;
        let (n, half) = (nx as i64, nx as i64 / 2 + 1);
        for k in -half..n + half {
            let Some(height) = f(k.rem_euclid(n) as usize) else { continue };
            let mut from = f64::NEG_INFINITY;
            while let Some(&(last, last_height, last_from)) = self.parts.last() {
                // Where the new parabola passes below the last one.
                let (a, b) = (last as f64, k as f64);
                from = 0.5 * (a + b) + (height - last_height) / (2.0 * dx * dx * (b - a));
                if from > last_from {
                    break;
                }
                self.parts.pop();
                from = f64::NEG_INFINITY;
            }
            self.parts.push((k, height, from));
        }
    }

    /// Column whose parabola is the lowest at column x; x increases from call to call.
    fn lowest_at(&mut self, x: i64, dx: f64) -> Option<i64> {
        while self.current + 1 < self.parts.len() && self.parts[self.current + 1].2 <= x as f64 {
            self.current += 1;
        }
        // At intersections of parabolas, rounding may have selected a neighbour of the lowest.
        let value = |part: &(i64, f64, f64)| (dx * (x - part.0) as f64).powi(2) + part.1;
        let near = self.parts.get(self.current.saturating_sub(1)..self.parts.len().min(self.current + 2))?;
        near.iter().min_by(|a, b| value(a).total_cmp(&value(b))).map(|part| part.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against all pairs, on square and oblong pixels, with few and with many marked nodes.
    #[test]
    fn distances_equal_those_of_all_pairs() {
        for (nx, ny, ly) in [(17, 12, 12.0 / 17.0), (16, 16, 0.4), (1, 9, 2.0), (8, 1, 0.1)] {
            let grid = Grid { nx, ny, lx: 1.0, ly };
            for every in [1, 3, 11, 60] {
                let map: Vec<u8> = (0..nx * ny).map(|i| u8::from((i * i + 7 * i) % every == 0 || i == 5)).collect();
                let square = |i: usize, j: usize| {
                    let [x, y] = minimum_image(grid, i, j);
                    x * x + y * y
                };
                for (i, &actual) in nearest_marked(grid, &map).iter().enumerate() {
                    let marked = (0..map.len()).filter(|&j| map[j] != 0);
                    let exact = marked.map(|j| square(i, j)).fold(f64::INFINITY, f64::min);
                    assert!(map[actual as usize] != 0);
                    assert!((square(i, actual as usize) - exact).abs() < 1e-14, "{nx}x{ny} node {i}");
                }
            }
        }
        assert!(nearest_marked(Grid::unit(4, 3), &[0; 12]).iter().all(|f| *f == NO_NODE));
    }
}
