//! Conversion between the arrays of the interface and the flat fields of the crate.

use asperity_grid::Grid;
use asperity_surface::Cell;
use ndarray::{Array2, ArrayView2};
use std::borrow::Cow;

/// The grid of a map in reduced units, in which the cell has the extent 1 along x.
pub(super) fn grid_of<T>(cell: Cell, map: &ArrayView2<T>) -> Grid {
    let (ny, nx) = map.dim();
    Grid { nx, ny, lx: 1.0, ly: cell.y / cell.x }
}

/// Values of a map in the order of the crate's fields: row by row, x fastest.
pub(super) fn row_major<T: Copy>(map: ArrayView2<'_, T>) -> Cow<'_, [T]> {
    match map.to_slice() {
        Some(values) => Cow::Borrowed(values),
        None => Cow::Owned(map.iter().copied().collect()),
    }
}

/// A map of flags as the crate's observers take it.
pub(super) fn flags(map: ArrayView2<bool>) -> Vec<u8> {
    map.iter().map(|&contact| u8::from(contact)).collect()
}

/// A map `[ny, nx]` from a field of the same length.
pub(super) fn map<T>(grid: Grid, values: Vec<T>) -> Array2<T> {
    Array2::from_shape_vec((grid.ny, grid.nx), values).expect("a field has one value per node")
}
