use crate::grid::{Field, Grid, Real, sum_rows, sums_of_ranks};
use crate::sys::ranks::{ALONE, Ranks};
use std::f64::consts::LN_2;
use std::f64::consts::PI;

/// Contact area over the cell area.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ContactArea {
    /// Contact nodes over all nodes. First order in the mesh size, because boundary nodes count fully.
    pub fraction: f64,
    /// `fraction` minus `(π - 1 + ln 2)/24` times the number of boundary edges over the number of nodes (Yastrebov,
    /// Anciaux & Molinari, J. Mech. Phys. Solids 107 (2017) 469, arXiv:1701.02727).
    pub corrected: f64,
    /// Length of the edges between contact and open nodes over the cell area, units of 1/L.
    pub perimeter: f64,
    pub nodes: usize,
}

/// Contact area of a periodic cell: nodes with a gap of at most `threshold` (0 for a hard wall).
pub fn contact_area(grid: Grid, gap: Field, threshold: f64) -> ContactArea {
    contact_area_on_ranks(&ALONE, grid, gap, threshold)
}

/// As [`contact_area`], of a gap of which every rank has its rows. Collective: all ranks have the result.
pub fn contact_area_on_ranks(ranks: &Ranks, grid: Grid, gap: Field, threshold: f64) -> ContactArea {
    let [nodes, across_x, across_y] = match gap {
        Field::F32(gap) => counted(ranks, grid, gap, |g| f64::from(g) <= threshold),
        Field::F64(gap) => counted(ranks, grid, gap, |g| g <= threshold),
    };
    let (dx, dy) = (grid.dx(), grid.dy());
    let cell = grid.lx * grid.ly;
    let fraction = nodes / grid.points() as f64;
    let perimeter = (across_x * dy + across_y * dx) / cell;
    let beta = (PI - 1.0 + LN_2) / 24.0;
    // A node has at most four edges and 4β is below one: never negative.
    let corrected = fraction - beta * (across_x * dy * dx + across_y * dx * dy) / cell;
    ContactArea { fraction, corrected, perimeter, nodes: nodes as usize }
}

/// Contact nodes, and boundary edges crossed along x and along y.
fn counted<T: Real>(ranks: &Ranks, grid: Grid, gap: &[T], touches: impl Fn(T) -> bool + Sync + Send) -> [f64; 3] {
    let (nx, rows) = (grid.nx, gap.len() / grid.nx);
    let next = &first_row_of_next(ranks, &gap[..nx]);
    let own = sum_rows(rows, |y| {
        let row = &gap[y * nx..][..nx];
        let below = if y + 1 < rows { &gap[(y + 1) * nx..][..nx] } else { next };
        let nodes = row.iter().filter(|g| touches(**g)).count();
        let seam = usize::from(touches(row[nx - 1]) != touches(row[0]));
        let along = row.iter().zip(&row[1..]).filter(|(a, b)| touches(**a) != touches(**b)).count();
        let across = row.iter().zip(below).filter(|(a, b)| touches(**a) != touches(**b)).count();
        [nodes, along + seam, across].map(|n| n as f64)
    });
    sums_of_ranks(ranks, ranks.count(), &[own])
}

/// The row below the last one of this rank: the first of the next, given the first of this one.
fn first_row_of_next<T: Real>(ranks: &Ranks, first: &[T]) -> Vec<T> {
    let (own, count) = (ranks.own(), ranks.count());
    let mut next = first.to_vec();
    if count > 1 {
        let from =
            |rank: usize| (0..count).map(|r| if r == rank % count { first.len() } else { 0 }).collect::<Vec<_>>();
        ranks.exchange((first, &from(own + count - 1)), (&mut next, &from(own + 1)));
    }
    next
}

/// 1 where the gap is at most `threshold`, else 0, as `[ny, nx]`.
pub fn contact_map(gap: Field, threshold: f64) -> Vec<u8> {
    (0..gap.len()).map(|i| u8::from(gap.at(i) <= threshold)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sys::ranks::on_threads;

    /// A rectangle across the periodic boundary.
    #[test]
    fn a_rectangle_across_the_seam() {
        let grid = Grid { nx: 10, ny: 8, lx: 1.0, ly: 0.4 };
        let gap: Vec<f64> = (0..80)
            .map(|i| {
                let (x, y) = (i % 10, i / 10);
                if !(2..8).contains(&x) && (3..6).contains(&y) { 0.0 } else { 1.0 }
            })
            .collect();
        let area = contact_area(grid, Field::F64(&gap), 0.0);
        assert_eq!(area.nodes, 12);
        assert!((area.fraction - 0.15).abs() < 1e-15);
        // Two sides of 3 nodes (dy = 0.05) and two of 4 (dx = 0.1) over a cell of 0.4.
        assert!((area.perimeter - (2.0 * 3.0 * 0.05 + 2.0 * 4.0 * 0.1) / 0.4).abs() < 1e-12);
        // Twelve of 80 nodes, minus 0.1181142 for each of 14 edges.
        assert!((area.corrected - (12.0 - 14.0 * 0.118_114_159_756_239) / 80.0).abs() < 1e-12);
    }

    /// The published correction factor per boundary edge. Nodes marked by their centres inside a given outline have no
    /// bias, so that a drawn disc cannot test the accuracy of the correction; solved contacts do in
    /// `tests/solvers/analytic.rs`.
    #[test]
    fn the_correction_is_a_factor_on_edges() {
        let grid = Grid::unit(8, 8);
        let beta = 0.118_114_159_756_239;
        // Contact nodes (x, y), and their number of boundary edges.
        let shapes: [(&[(usize, usize)], f64); 4] = [
            (&[(3, 3)], 4.0),
            (&[(3, 3), (4, 4)], 8.0),
            (&[(3, 3), (4, 3), (3, 4)], 8.0),
            (&[(2, 2), (3, 2), (4, 2), (2, 3), (4, 3), (2, 4), (3, 4), (4, 4)], 16.0),
        ];
        for (nodes, edges) in shapes {
            let mut gap = [1.0; 64];
            nodes.iter().for_each(|(x, y)| gap[8 * y + x] = 0.0);
            let area = contact_area(grid, Field::F64(&gap), 0.0);
            assert!((area.perimeter - edges / 8.0).abs() < 1e-12, "{nodes:?}");
            assert!((area.corrected - (nodes.len() as f64 - beta * edges) / 64.0).abs() < 1e-12, "{nodes:?}");
        }
    }

    /// A strip that ends at the periodic boundary has an edge there, in either direction; a gap at the threshold is contact.
    #[test]
    fn edges_at_the_seam_and_gaps_at_the_threshold_count() {
        let grid = Grid { nx: 4, ny: 3, lx: 1.0, ly: 1.0 };
        for touches in [|i: usize| i % 4 >= 2, |i: usize| i / 4 >= 1] {
            let gap: Vec<f64> = (0..12).map(|i| f64::from(u8::from(!touches(i)))).collect();
            // Two edges in each of three rows of height 1/3, or in each of four columns of width 1/4.
            assert!((contact_area(grid, Field::F64(&gap), 0.0).perimeter - 2.0).abs() < 1e-12);
        }
        for (threshold, map) in [(0.0, [1, 0, 1, 0]), (0.1, [1, 1, 1, 0])] {
            assert_eq!(contact_map(Field::F64(&[0.0, 0.1, -0.1, 0.2]), threshold), map);
        }
    }

    #[test]
    fn everything_and_nothing() {
        let grid = Grid::unit(4, 4);
        for gap in [Field::F64(&[0.0; 16]), Field::F32(&[0.0; 16])] {
            let all = contact_area(grid, gap, 0.0);
            assert_eq!((all.fraction, all.corrected, all.perimeter), (1.0, 1.0, 0.0));
        }
        let none = contact_area(grid, Field::F32(&[1.0; 16]), 0.0);
        assert_eq!((none.fraction, none.corrected, none.nodes), (0.0, 0.0, 0));
    }

    /// One row or one column, with a threshold: a node is no neighbour of itself across the periodic boundary.
    #[test]
    fn thin_cells_have_no_edges_across() {
        let gap = [0.1, 0.3, 0.2, 0.4, 0.1];
        for (nx, ny) in [(1, 5), (5, 1)] {
            let grid = Grid { nx, ny, lx: 1.0, ly: 1.0 };
            let area = contact_area(grid, Field::F64(&gap), 0.2);
            assert_eq!((area.nodes, area.fraction), (3, 0.6), "{nx} x {ny}");
            // Four boundary edges along the five nodes, each as long as the cell is wide.
            assert!((area.perimeter - 4.0).abs() < 1e-14, "{nx} x {ny}: {}", area.perimeter);
        }
        assert_eq!(contact_area(Grid::unit(1, 1), Field::F32(&[0.0]), 0.0).perimeter, 0.0);
    }

    /// The rows of all ranks, with edges between two ranks and across the seam.
    #[test]
    fn areas_are_those_of_one_rank_on_any_number() {
        let grid = Grid { nx: 7, ny: 9, lx: 1.0, ly: 0.7 };
        let gap: Vec<f64> = (0..63).map(|i| f64::from((i * i + 3 * i) % 7) - 2.0).collect();
        let alone = contact_area(grid, Field::F64(&gap), 0.0);
        assert!(alone.nodes > 0 && alone.perimeter > 0.0);
        for count in [2, 3, 9] {
            let found = on_threads(count, |ranks| {
                let rows = ranks.share(grid.ny);
                contact_area_on_ranks(&ranks, grid, Field::F64(&gap[rows.start * 7..rows.end * 7]), 0.0)
            });
            assert!(found.iter().all(|area| *area == alone), "{count} ranks");
        }
    }
}
