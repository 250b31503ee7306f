use asperity_grid::Grid;
use asperity_grid::error::{Error, Result};

/// The part of a map from a column and a row on, with so many columns and rows; pixels keep their size.
pub(super) fn crop(grid: Grid, heights: &[f64], [column, row, columns, rows]: [usize; 4]) -> Result<(Grid, Vec<f64>)> {
    let inside =
        |first: usize, count: usize, all: usize| count > 0 && first.checked_add(count).is_some_and(|e| e <= all);
    if !inside(column, columns, grid.nx) || !inside(row, rows, grid.ny) {
        let found = format!("{columns} x {rows} points from column {}, row {}", column + 1, row + 1);
        let accepted = format!("a part of the map of {} columns and {} rows, at least one of each", grid.nx, grid.ny);
        return Err(Error::input("preparation", "--crop", found, accepted));
    }
    let part = Grid { nx: columns, ny: rows, lx: grid.dx() * columns as f64, ly: grid.dy() * rows as f64 };
    let kept = heights.chunks(grid.nx).skip(row).take(rows).flat_map(|r| &r[column..column + columns]);
    Ok((part, kept.copied().collect()))
}
