use asperity_grid::{Field, Grid};

/// Column of the grid nearest to the position `x` (units of L).
pub fn column_at(grid: Grid, x: f64) -> usize {
    (x / grid.dx()).round() as usize % grid.nx
}

/// Values of a field along y in one column: pairs of position (units of L) and value.
pub fn along_y(grid: Grid, field: Field, column: usize) -> Vec<(f64, f64)> {
    (0..grid.ny).map(|y| (y as f64 * grid.dy(), field.at(y * grid.nx + column))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The nearest column, across the periodic boundary as well; positions along it are multiples of the spacing.
    #[test]
    fn columns_are_the_nearest() {
        let grid = Grid { nx: 4, ny: 2, lx: 1.0, ly: 0.5 };
        assert_eq!([0.0, 0.37, 0.38, 0.9].map(|x| column_at(grid, x)), [0, 1, 2, 0]);
        let field: Vec<f64> = (0..8).map(f64::from).collect();
        assert_eq!(along_y(grid, Field::F64(&field), 2), [(0.0, 2.0), (0.25, 6.0)]);
    }
}
