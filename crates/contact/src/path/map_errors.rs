//! Errors of the maps of gap and contact by the grid.

use crate::observe::ContactArea;
use crate::state::MapErrors;
use asperity_grid::{Field, Grid};

/// Changes of the gap from the grid with half of the points along each side that are its error. On 152 surfaces of `scripts/errors_cases.py`
/// (seed 962: hard wall, adhesion, hardness, layers, penalty, steps) this many cover the truth on a grid four times finer in 151. Of 106 others
/// (seed 963) the errors of gap and contact cover 104 each, 13 and 14 of 15 with steps. `make errors` repeats it on its own maps.
const GAP_CHANGES: f64 = 1.5;

/// Nodes per boundary edge that are the error of the contact besides its change: a node is on one side or the other of an edge, and two grids
/// may agree by chance. With both 149 of those 152 cases are covered, with the change alone 123.
const NODES_PER_EDGE: f64 = 0.1;

/// Least mean gap that errors are relative to, over the rms height.
const LEAST_GAP: f64 = 0.01;

/// Least contact nodes on the coarser grid.
const FEW_NODES: usize = 10;

/// Errors of a gap `[ny, nx]` and its contact from the gap on the grid with half of the points along each side. `None` for other grids, few
/// nodes in contact, and a gap that is no larger than its error: nearly closed ones between steps changed by ten times as much on finer grids.
pub(super) fn map_errors(
    (grid, gap, mean_gap): (Grid, Field, f64),
    (coarser, coarse_gap): (Grid, &[f64]),
    (threshold, rms_height, area): (f64, f64, &ContactArea),
) -> Option<MapErrors> {
    if [grid.nx, grid.ny] != [2 * coarser.nx, 2 * coarser.ny] || gap.len() != grid.points() {
        return None;
    }
    let (mut squares, mut coarse, mut both, mut any) = (0.0, 0, 0, 0);
    for (k, there) in coarse_gap.iter().enumerate() {
        let here = gap.at(2 * (k / coarser.nx) * grid.nx + 2 * (k % coarser.nx));
        squares += (here - there) * (here - there);
        let touches = [here <= threshold, *there <= threshold];
        coarse += usize::from(touches[1]);
        both += usize::from(touches == [true; 2]);
        any += usize::from(touches != [false; 2]);
    }
    let scale = mean_gap.max(LEAST_GAP * rms_height);
    let error = GAP_CHANGES * (squares / coarser.points() as f64).sqrt() / scale;
    let edges = NODES_PER_EDGE * area.free_edges as f64 / area.count as f64;
    let contact = (1.0 - both as f64 / any as f64) + edges;
    (coarse >= FEW_NODES && error < 1.0).then_some(MapErrors { gap: error, contact })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of contact that is a node wider on the coarser grid, and a gap that is a tenth larger there.
    #[test]
    fn errors_are_those_of_the_common_nodes() {
        let (fine, coarse) = (Grid::unit(32, 16), Grid::unit(16, 8));
        let gap_of = |grid: Grid, width: f64, gap: f64| -> Vec<f64> {
            let x = |k: usize| (k % grid.nx) as f64 / grid.nx as f64;
            (0..grid.points()).map(|k| if x(k) < width { 0.0 } else { gap }).collect()
        };
        let (here, there) = (gap_of(fine, 0.25, 1.0), gap_of(coarse, 0.3, 1.1));
        let area = ContactArea { count: 128, free_edges: 32, ..ContactArea::default() };
        let found = map_errors((fine, Field::F64(&here), 0.75), (coarse, &there), (0.0, 0.1, &area)).expect("half");
        // Columns at 0 to 3/16 touch on both grids, that at 4/16 on the coarser one.
        assert!((found.contact - (0.2 + 0.1 * 0.25)).abs() < 1e-12, "{found:?}");
        let square = (1.0 + 11.0 * 0.01) / 16.0;
        assert!((found.gap - 1.5 * f64::sqrt(square) / 0.75).abs() < 1e-12, "{found:?}");
        let other = Grid::unit(15, 8);
        assert_eq!(map_errors((fine, Field::F64(&here), 0.75), (other, &there), (0.0, 0.1, &area)), None);
        let large = gap_of(coarse, 0.3, 2.0);
        assert_eq!(map_errors((fine, Field::F64(&here), 0.75), (coarse, &large), (0.0, 0.1, &area)), None);
        let open = gap_of(coarse, 0.0, 1.0);
        assert_eq!(map_errors((fine, Field::F64(&here), 0.75), (coarse, &open), (0.0, 0.1, &area)), None);
    }
}
