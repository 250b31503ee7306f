//! Agreement of two contact maps.

use super::arrays::{flags, row_major};
use crate::compare::{MISALIGNMENT, overlap, registration};
use crate::record::results::Overlap;
use crate::{Error, Result};
use asperity_grid::Grid;
use ndarray::ArrayView2;

/// Agreement of two contact maps, with a control that shows what chance alone would give.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapAgreement {
    /// Agreement of the maps as they are.
    pub aligned: Overlap,
    /// Control: the first map shifted by a third of the cell along x and a fifth along y. Its κ is about 0 where the agreement of
    /// the aligned maps is not by chance.
    pub shifted: Overlap,
    /// Periodic shift of the first map in nodes, along x and along y, that fits best: `[0, 0]` for maps of the same surface at the
    /// same position.
    pub best_shift: [i64; 2],
}

/// Compares a contact map with a reference on the same grid.
///
/// # Errors
/// If the maps differ in shape or are empty.
///
/// ```
/// use asperity::compare_maps;
/// use ndarray::Array2;
///
/// let reference = Array2::from_shape_fn((30, 30), |(y, x)| x < 10 && y < 6);
/// let mut map = reference.clone();
/// map[(0, 0)] = false;
/// let agreement = compare_maps(map.view(), reference.view())?;
/// assert!((agreement.aligned.jaccard - 59.0 / 60.0).abs() < 1e-12);
/// assert!(agreement.aligned.kappa > 0.98 && agreement.shifted.kappa < 0.0);
/// assert_eq!(agreement.best_shift, [0, 0]);
/// # Ok::<(), asperity::Error>(())
/// ```
pub fn compare_maps(map: ArrayView2<bool>, reference: ArrayView2<bool>) -> Result<MapAgreement> {
    let (ny, nx) = reference.dim();
    if map.dim() != (ny, nx) || map.is_empty() {
        let found = format!("{} x {} nodes", map.nrows(), map.ncols());
        let accepted = format!("the shape of the reference, {ny} x {nx} nodes, at least one");
        return Err(Error::input("compare_maps", "map", found, accepted));
    }
    let (a, b) = (row_major(map), row_major(reference));
    let [dx, dy] = [nx / MISALIGNMENT[0], ny / MISALIGNMENT[1]];
    let shifted: Vec<bool> = (0..ny * nx).map(|i| a[(i / nx + dy) % ny * nx + (i % nx + dx) % nx]).collect();
    Ok(MapAgreement {
        aligned: overlap(&a, &b),
        shifted: overlap(&shifted, &b),
        best_shift: registration(Grid::unit(nx, ny), &flags(map), &flags(reference)),
    })
}
