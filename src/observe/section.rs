use crate::grid::{Field, Grid};

/// Column of the grid nearest to the position `x` (units of L).
pub fn column_at(grid: Grid, x: f64) -> usize {
    (x / grid.dx()).round() as usize % grid.nx
}

/// Values of a field along y in one column: pairs of position (units of L) and value.
pub fn along_y(grid: Grid, field: Field, column: usize) -> Vec<(f64, f64)> {
    (0..grid.ny).map(|y| (y as f64 * grid.dy(), field.at(y * grid.nx + column))).collect()
}
