use asperity_grid::sys::ranks::{ALONE, Ranks};
use asperity_grid::{Field, Grid, Real, sum_rows, sums_of_ranks};
use std::f64::consts::LN_2;
use std::f64::consts::PI;

/// Excess of counted contact along the edge of an elastic body under a hard wall, in areas of a node per boundary edge: (π - 1 + ln 2)/24
/// (Yastrebov, Anciaux & Molinari, J. Mech. Phys. Solids 107 (2017) 469, arXiv:1701.02727).
pub const ELASTIC_EDGE: f64 = (PI - 1.0 + LN_2) / 24.0;

/// Contact of a map of nodes. Areas over the area of the cell.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ContactArea {
    /// The best value: the counted nodes without the excess along their edges.
    pub contact_area: f64,
    /// Contact nodes over all nodes.
    pub contact_nodes: f64,
    /// Length of the edges between contact and open nodes over the cell area, units of 1/L.
    pub perimeter: f64,
    /// Number of contact nodes.
    pub count: usize,
    /// Number of boundary edges that are not steps of the surface.
    pub free_edges: usize,
    /// Number of these that go on in a straight line.
    pub straight_edges: usize,
}

/// What is known of the edges of a contact, from which its area is found.
#[derive(Clone, Copy)]
pub struct ContactEdges<'a> {
    /// Largest gap of a contact node.
    pub threshold: f64,
    /// Excess of counted contact per boundary edge, in areas of a node: [`ELASTIC_EDGE`], 0 where nodes are counted without bias.
    pub excess: f64,
    /// Gap of the open node from which on an edge has no excess: the surface has a step there, which ends the contact on every grid.
    pub step: f64,
    /// Whether nodes on opposite sides of the map are neighbours; else its border is no edge of the contact.
    pub periodic: bool,
    /// Which contact nodes flow at the hardness, by their index; for whole fields alone.
    pub flows: Option<&'a (dyn Fn(usize) -> bool + Sync)>,
}

impl ContactEdges<'_> {
    /// Of an elastic body under a hard wall.
    pub const ELASTIC: ContactEdges<'static> = ContactEdges { excess: ELASTIC_EDGE, ..ContactEdges::COUNTED };

    /// Nodes at their count.
    pub const COUNTED: ContactEdges<'static> =
        ContactEdges { threshold: 0.0, excess: 0.0, step: f64::INFINITY, periodic: true, flows: None };

    /// Excess of an edge over that of an elastic one, in halves: of a contact node, the node behind it, and the gap of the open node.
    ///
    /// A node that flows at the edge has none: it carries the hardness wherever its edge lies, and full flow has the area of the load
    /// over the hardness. Where only the node behind flows, the elastic rim of a plastic contact is narrower than a node, and its excess
    /// was 0.203 ± 0.02 per edge on 70 solved contacts, twice that of an elastic edge there (0.099).
    fn halves(&self, contact: usize, behind: usize, open: f64) -> usize {
        match self.flows {
            _ if open >= self.step => 0,
            Some(flows) if flows(contact) => 0,
            Some(flows) if flows(behind) => 4,
            _ => 2,
        }
    }
}

/// Contact area of a map.
pub fn contact_area(grid: Grid, gap: Field, edges: ContactEdges) -> ContactArea {
    contact_area_on_ranks(&ALONE, grid, gap, edges)
}

/// As [`contact_area`], of a gap of which every rank has its rows. Collective: all ranks have the result.
pub fn contact_area_on_ranks(ranks: &Ranks, grid: Grid, gap: Field, edges: ContactEdges) -> ContactArea {
    let [nodes, along_x, along_y, halves, free, straight] = match gap {
        Field::F32(gap) => counted(ranks, grid, gap, edges),
        Field::F64(gap) => counted(ranks, grid, gap, edges),
    };
    let points = grid.points() as f64;
    let perimeter = (along_x * grid.dy() + along_y * grid.dx()) / (grid.lx * grid.ly);
    // A node has at most four edges and eight times the excess is below one: never negative.
    let contact_area = (nodes - 0.5 * edges.excess * halves) / points;
    let [count, free_edges, straight_edges] = [nodes, free, straight].map(|n| n as usize);
    ContactArea { contact_area, contact_nodes: nodes / points, perimeter, count, free_edges, straight_edges }
}

/// Contact nodes, boundary edges crossed along x and along y, halves of an excess, edges that are no steps, and those of them that go on in a
/// straight line.
fn counted<T: Real>(ranks: &Ranks, grid: Grid, gap: &[T], edges: ContactEdges) -> [f64; 6] {
    let (nx, rows) = (grid.nx, gap.len() / grid.nx);
    let next = &first_row_of_next(ranks, &gap[..nx]);
    let touches = |g: T| g.wide() <= edges.threshold;
    // Of four nodes in a line, by gap and index: the edge between the inner two.
    let edge = |inner: [T; 2], [before, i, j, after]: [usize; 4]| -> [usize; 3] {
        let edge_counts = |contact, behind, open: T| {
            let open = open.wide();
            [1, edges.halves(contact, behind, open), usize::from(open < edges.step)]
        };
        match inner.map(touches) {
            [true, false] => edge_counts(i, before, inner[1]),
            [false, true] => edge_counts(j, after, inner[0]),
            _ => [0; 3],
        }
    };
    // Whether there is an edge of the same kind between two nodes.
    let goes_on = |inner: [T; 2], like: [T; 2]| {
        let open = if touches(inner[0]) { inner[1] } else { inner[0] };
        inner.map(touches) == like.map(touches) && open.wide() < edges.step
    };
    let add = |sum: [usize; 4], more: [usize; 4]| std::array::from_fn(|k| sum[k] + more[k]);
    let own = sum_rows(rows, |y| {
        let node_index = |y: usize, x: usize| y % rows * nx + x % nx;
        let row = &gap[y * nx..][..nx];
        let below = if y + 1 < rows { &gap[(y + 1) * nx..][..nx] } else { next };
        let nodes = row.iter().filter(|g| touches(**g)).count();
        // The node behind the border of a map that does not repeat is the border's own.
        let behind = |k: usize, count: usize| match edges.periodic {
            true => [k + count - 1, k, k + 1, k + 2],
            false => [k.saturating_sub(1), k, k + 1, (k + 2).min(count - 1)],
        };
        let columns = if edges.periodic { nx } else { nx - 1 };
        let ends = !edges.periodic && y + 1 == rows && ranks.own() + 1 == ranks.count();
        // An edge, and whether it goes on to the next one of its line.
        let with_next = |[all, halves, free]: [usize; 3], inner: [T; 2], next: Option<[T; 2]>| {
            let straight = free > 0 && next.is_some_and(|next| goes_on(next, inner));
            [all, halves, free, usize::from(straight)]
        };
        let along = (0..columns)
            .map(|x| {
                let (inner, next) = ([row[x], row[(x + 1) % nx]], [below[x], below[(x + 1) % nx]]);
                let own = edge(inner, behind(x, nx).map(|x| node_index(y, x)));
                with_next(own, inner, (!ends).then_some(next))
            })
            .fold([0; 4], add);
        let across = (0..if ends { 0 } else { nx })
            .map(|x| {
                let inner = [row[x], below[x]];
                let own = edge(inner, behind(y, rows).map(|y| node_index(y, x)));
                let (next, is_last) = ((x + 1) % nx, x + 1 == nx && !edges.periodic);
                with_next(own, inner, (!is_last).then_some([row[next], below[next]]))
            })
            .fold([0; 4], add);
        let [_, halves, free, straight] = add(along, across);
        [nodes, along[0], across[0], halves, free, straight].map(|n| n as f64)
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
    use asperity_grid::sys::ranks::on_threads;

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
        let area = contact_area(grid, Field::F64(&gap), ContactEdges::ELASTIC);
        assert_eq!(area.count, 12);
        assert!((area.contact_nodes - 0.15).abs() < 1e-15);
        // Two sides of 3 nodes (dy = 0.05) and two of 4 (dx = 0.1) over a cell of 0.4.
        assert!((area.perimeter - (2.0 * 3.0 * 0.05 + 2.0 * 4.0 * 0.1) / 0.4).abs() < 1e-12);
        // Twelve of 80 nodes, minus 0.1181142 for each of 14 edges.
        assert!((area.contact_area - (12.0 - 14.0 * 0.118_114_159_756_239) / 80.0).abs() < 1e-12);
    }

    /// Of a strip across the cell every edge goes on, of a block of three by two nodes all but one of each side, of single nodes none.
    #[test]
    fn straight_edges_are_counted() {
        let grid = Grid::unit(8, 8);
        let strip = |x: usize, _: usize| (2..4).contains(&x);
        let block = |x: usize, y: usize| (2..5).contains(&x) && (3..5).contains(&y);
        let dots = |x: usize, y: usize| [0, 3].contains(&x) && [0, 3].contains(&y);
        let shapes: [&dyn Fn(usize, usize) -> bool; 3] = [&strip, &block, &dots];
        for (touches, expected) in shapes.into_iter().zip([[16, 16], [10, 6], [16, 0]]) {
            for turned in [false, true] {
                let open = |i: usize| if turned { !touches(i / 8, i % 8) } else { !touches(i % 8, i / 8) };
                let gap: Vec<f64> = (0..64).map(|i| f64::from(u8::from(open(i)))).collect();
                let area = contact_area(grid, Field::F64(&gap), ContactEdges::ELASTIC);
                assert_eq!([area.free_edges, area.straight_edges], expected, "{turned}");
            }
        }
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
            let area = contact_area(grid, Field::F64(&gap), ContactEdges::ELASTIC);
            assert!((area.perimeter - edges / 8.0).abs() < 1e-12, "{nodes:?}");
            assert!((area.contact_area - (nodes.len() as f64 - beta * edges) / 64.0).abs() < 1e-12, "{nodes:?}");
        }
    }

    /// A strip that ends at the periodic boundary has an edge there, in either direction; a gap at the threshold is contact.
    #[test]
    fn edges_at_the_seam_and_gaps_at_the_threshold_count() {
        let grid = Grid { nx: 4, ny: 3, lx: 1.0, ly: 1.0 };
        for touches in [|i: usize| i % 4 >= 2, |i: usize| i / 4 >= 1] {
            let gap: Vec<f64> = (0..12).map(|i| f64::from(u8::from(!touches(i)))).collect();
            // Two edges in each of three rows of height 1/3, or in each of four columns of width 1/4.
            assert!((contact_area(grid, Field::F64(&gap), ContactEdges::ELASTIC).perimeter - 2.0).abs() < 1e-12);
        }
        for (threshold, map) in [(0.0, [1, 0, 1, 0]), (0.1, [1, 1, 1, 0])] {
            assert_eq!(contact_map(Field::F64(&[0.0, 0.1, -0.1, 0.2]), threshold), map);
        }
    }

    #[test]
    fn everything_and_nothing() {
        let grid = Grid::unit(4, 4);
        for gap in [Field::F64(&[0.0; 16]), Field::F32(&[0.0; 16])] {
            let all = contact_area(grid, gap, ContactEdges::ELASTIC);
            assert_eq!((all.contact_nodes, all.contact_area, all.perimeter), (1.0, 1.0, 0.0));
        }
        let none = contact_area(grid, Field::F32(&[1.0; 16]), ContactEdges::ELASTIC);
        assert_eq!((none.contact_nodes, none.contact_area, none.count), (0.0, 0.0, 0));
    }

    /// One row or one column, with a threshold: a node is no neighbour of itself across the periodic boundary.
    #[test]
    fn thin_cells_have_no_edges_across() {
        let gap = [0.1, 0.3, 0.2, 0.4, 0.1];
        for (nx, ny) in [(1, 5), (5, 1)] {
            let grid = Grid { nx, ny, lx: 1.0, ly: 1.0 };
            let area = contact_area(grid, Field::F64(&gap), ContactEdges { threshold: 0.2, ..ContactEdges::ELASTIC });
            assert_eq!((area.count, area.contact_nodes), (3, 0.6), "{nx} x {ny}");
            // Four boundary edges along the five nodes, each as long as the cell is wide.
            assert!((area.perimeter - 4.0).abs() < 1e-14, "{nx} x {ny}: {}", area.perimeter);
        }
        assert_eq!(contact_area(Grid::unit(1, 1), Field::F32(&[0.0]), ContactEdges::ELASTIC).perimeter, 0.0);
    }

    /// The rows of all ranks, with edges between two ranks and across the seam.
    #[test]
    fn areas_are_those_of_one_rank_on_any_number() {
        let grid = Grid { nx: 7, ny: 9, lx: 1.0, ly: 0.7 };
        let gap: Vec<f64> = (0..63).map(|i| f64::from((i * i + 3 * i) % 7) - 2.0).collect();
        let alone = contact_area(grid, Field::F64(&gap), ContactEdges::ELASTIC);
        assert!(alone.count > 0 && alone.perimeter > 0.0);
        for count in [2, 3, 9] {
            let actual = on_threads(count, |ranks| {
                let rows = ranks.share(grid.ny);
                contact_area_on_ranks(
                    &ranks,
                    grid,
                    Field::F64(&gap[rows.start * 7..rows.end * 7]),
                    ContactEdges::ELASTIC,
                )
            });
            assert!(actual.iter().all(|area| *area == alone), "{count} ranks");
        }
    }
}
