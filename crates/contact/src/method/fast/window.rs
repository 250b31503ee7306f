//! Nodes that face the rigid surface: all of a periodic cell, or those in one corner of a padded cell.

use crate::interface::Elastic;
use crate::method::ReducedProblem;
use asperity_grid::{Grid, next_fast_len};

/// The periodic cell that a problem is solved in.
#[derive(Debug, Clone, Copy)]
pub(super) struct ComputationCell {
    pub grid: Grid,
    /// Distance from the first to the last facing node along each axis, in a padded cell.
    patch: Option<(f64, f64)>,
    /// Compliance of the mean mode, for a non-periodic body.
    compliance: f64,
    /// Mean height of the cell above the lowest facing node, the origin of the approach.
    pub mean_height: f64,
}

/// Facing nodes of a grid: the first `nx` of the first `ny` rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Window {
    pub nx: usize,
    pub ny: usize,
}

impl Window {
    /// Number of facing nodes in row `y` of `nx` nodes.
    #[inline]
    pub(super) fn inside(&self, y: usize, nx: usize) -> usize {
        if y < self.ny { self.nx.min(nx) } else { 0 }
    }

    pub(super) fn points(&self) -> usize {
        self.nx * self.ny
    }

    /// Values at the facing nodes of a field with `nx` points per row.
    pub(super) fn cut<T: Copy>(&self, field: &[T], nx: usize) -> Vec<T> {
        field.chunks(nx).take(self.ny).flat_map(|row| row[..self.nx].iter().copied()).collect()
    }
}

impl ComputationCell {
    pub(super) fn of(problem: &ReducedProblem) -> Self {
        let grid = problem.grid;
        let Elastic::NonPeriodic(kernel) = problem.kernel else {
            return ComputationCell { grid, patch: None, compliance: 0.0, mean_height: 0.0 };
        };
        let (dx, dy) = (grid.dx(), grid.dy());
        let padded = |n: usize, d: f64| next_fast_len(n + (kernel.padding() / d).ceil() as usize);
        let (nx, ny) = (padded(grid.nx, dx), padded(grid.ny, dy));
        ComputationCell {
            grid: Grid { nx, ny, lx: nx as f64 * dx, ly: ny as f64 * dy },
            patch: Some(((grid.nx - 1) as f64 * dx, (grid.ny - 1) as f64 * dy)),
            compliance: kernel.mean_compliance(),
            mean_height: 0.0,
        }
    }

    pub(super) fn is_padded(&self) -> bool {
        self.patch.is_some()
    }

    /// Facing nodes on a grid of this cell.
    pub(super) fn window(&self, grid: Grid) -> Window {
        // Rounding error of an integer ratio.
        const WHOLE: f64 = 1e-6;
        let nodes = |extent: f64, d: f64| (extent / d + WHOLE) as usize + 1;
        match self.patch {
            None => Window { nx: grid.nx, ny: grid.ny },
            Some((x, y)) => Window { nx: nodes(x, grid.dx()), ny: nodes(y, grid.dy()) },
        }
    }

    /// Grid of the facing nodes, on a grid of this cell.
    pub(super) fn facing(&self, grid: Grid) -> Grid {
        let Window { nx, ny } = self.window(grid);
        Grid { nx, ny, lx: nx as f64 * grid.dx(), ly: ny as f64 * grid.dy() }
    }

    /// Extends a field of the facing nodes continuously over the padding.
    pub(super) fn continued(&self, patch: &[f64]) -> Vec<f64> {
        let Window { nx, ny } = self.window(self.grid);
        let blend = |k: usize, from: usize, n: usize, last: f64, first: f64| {
            let t = (k + 1 - from) as f64 / (n + 1 - from) as f64;
            last + (first - last) * t * t * (3.0 - 2.0 * t)
        };
        let mut field = vec![0.0; self.grid.points()];
        for (y, row) in patch.chunks(nx).enumerate() {
            let to = &mut field[y * self.grid.nx..][..self.grid.nx];
            to[..nx].copy_from_slice(row);
            for (x, h) in to.iter_mut().enumerate().skip(nx) {
                *h = blend(x, nx, self.grid.nx, row[nx - 1], row[0]);
            }
        }
        let (rows, padding) = field.split_at_mut(ny * self.grid.nx);
        let (first, last) = (&rows[..self.grid.nx], &rows[(ny - 1) * self.grid.nx..]);
        for (k, row) in padding.chunks_mut(self.grid.nx).enumerate() {
            for (x, h) in row.iter_mut().enumerate() {
                *h = blend(ny + k, ny, self.grid.ny, last[x], first[x]);
            }
        }
        field
    }

    /// Compliance of the mean mode of a padded cell, else 0.
    pub(super) fn mean_compliance(&self) -> f64 {
        self.compliance
    }

    /// Elastic energy of the mean mode per facing area under a pressure on the facing nodes, and the mean gap of the
    /// cell at zero approach, from which the work of the load is counted.
    pub(super) fn mean_mode(&self, pressure: f64) -> (f64, f64) {
        let spread = pressure * self.window(self.grid).points() as f64 / self.grid.points() as f64;
        let lift = spread * self.compliance;
        (0.5 * pressure * lift, lift + self.mean_height)
    }
}
