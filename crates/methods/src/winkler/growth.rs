//! Dilation of overlap patches to twice their area.

use asperity_contact::observe::{Connectivity, NO_CLUSTER, clusters};
use asperity_grid::{Grid, Merged, UnionFind, minimum_image, nearest_marked};
use rayon::prelude::*;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Dilates the patches of `map` `[ny, nx]` node by node, closest nodes first, until each has twice its area. Patches
/// that meet (at edges or corners) are merged and double their common area. A patch that fills its Voronoi cell
/// continues in that of a neighbour, as if the two had met. The number of contact nodes doubles, or becomes all
/// nodes.
///
/// `O(N log N)`: one distance transform, one sort per Voronoi cell, and one queue of patches.
pub(super) fn double(grid: Grid, map: &mut [u8]) {
    let cores = clusters(map, grid.nx, Connectivity::Eight, true);
    if cores.sizes.is_empty() || 2 * cores.sizes.iter().sum::<usize>() >= map.len() {
        let all = u8::from(!cores.sizes.is_empty());
        map.iter_mut().for_each(|m| *m = all);
        return;
    }
    PatchGrowth::new(grid, map, cores.label, &cores.sizes).run(map);
}

/// Voronoi cells of the patches: nodes outside the patches, grouped by the nearest patch, sorted by distance.
struct VoronoiCells {
    order: Vec<u32>,
    /// Start of each cell in `order`, and the end of the last.
    start: Vec<usize>,
    /// Nearest node of a patch, for every node.
    nearest: Vec<u32>,
}

impl VoronoiCells {
    fn new(grid: Grid, map: &[u8], label: &[u32], count: usize) -> Self {
        let nearest = nearest_marked(grid, map);
        let outside = |i: &usize| map[*i] == 0;
        let mut start = vec![0; count + 1];
        for i in (0..map.len()).filter(outside) {
            start[label[nearest[i] as usize] as usize + 1] += 1;
        }
        for k in 0..count {
            start[k + 1] += start[k];
        }
        let mut order = vec![0; start[count]];
        let mut next = start.clone();
        for i in (0..map.len()).filter(outside) {
            let position = &mut next[label[nearest[i] as usize] as usize];
            order[*position] = i as u32;
            *position += 1;
        }
        let mut rest: &mut [u32] = &mut order;
        let mut cells = Vec::with_capacity(count);
        for k in 0..count {
            let (cell, others) = rest.split_at_mut(start[k + 1] - start[k]);
            cells.push(cell);
            rest = others;
        }
        cells.into_par_iter().for_each(|cell| cell.sort_unstable_by_key(|&i| (square(grid, &nearest, i), i)));
        VoronoiCells { order, start, nearest }
    }
}

/// Square of the distance to the nearest patch, as bits, which are ordered as the non-negative number.
fn square(grid: Grid, nearest: &[u32], i: u32) -> u64 {
    let [x, y] = minimum_image(grid, i as usize, nearest[i as usize] as usize);
    (x * x + y * y).to_bits()
}

struct PatchGrowth {
    grid: Grid,
    cells: VoronoiCells,
    /// Patch of each contact node.
    label: Vec<u32>,
    /// Merged patches.
    merged: UnionFind,
    /// For each root: number of nodes still to be added, and patches that wait for more.
    room: Vec<usize>,
    parked: Vec<Vec<u32>>,
    cursor: Vec<usize>,
    /// Square of the distance, node, patch; closest first.
    queue: BinaryHeap<Reverse<(u64, u32, u32)>>,
}

impl PatchGrowth {
    fn new(grid: Grid, map: &[u8], label: Vec<u32>, sizes: &[usize]) -> Self {
        let cells = VoronoiCells::new(grid, map, &label, sizes.len());
        let cursor = cells.start[..sizes.len()].to_vec();
        let mut growth = PatchGrowth {
            grid,
            cells,
            label,
            merged: UnionFind::new(sizes.len()),
            room: sizes.to_vec(),
            parked: vec![Vec::new(); sizes.len()],
            cursor,
            queue: BinaryHeap::new(),
        };
        (0..sizes.len() as u32).for_each(|patch| growth.enqueue(patch));
        growth
    }

    /// Queues the next node of the cell of a patch, if there is one.
    fn enqueue(&mut self, patch: u32) {
        let index = self.cursor[patch as usize];
        if index < self.cells.start[patch as usize + 1] {
            let node = self.cells.order[index];
            self.queue.push(Reverse((square(self.grid, &self.cells.nearest, node), node, patch)));
        }
    }

    /// Merges two patches.
    fn merge(&mut self, a: u32, b: u32) {
        let Some(Merged { kept, lost }) = self.merged.unite(a, b) else { return };
        self.room[kept as usize] += self.room[lost as usize];
        let mut waiting = std::mem::take(&mut self.parked[lost as usize]);
        waiting.append(&mut self.parked[kept as usize]);
        if self.room[kept as usize] > 0 {
            waiting.into_iter().for_each(|patch| self.enqueue(patch));
        } else {
            self.parked[kept as usize] = waiting;
        }
    }

    fn run(mut self, map: &mut [u8]) {
        while let Some(Reverse((_, node, patch))) = self.queue.pop() {
            let root = self.merged.root(patch) as usize;
            if self.room[root] == 0 {
                self.parked[root].push(patch);
                continue;
            }
            self.room[root] -= 1;
            let i = node as usize;
            map[i] = 1;
            self.label[i] = patch;
            self.cursor[patch as usize] += 1;
            self.enqueue(patch);
            let around = neighbours(self.grid, i);
            for j in around {
                if self.label[j] != NO_CLUSTER {
                    self.merge(patch, self.label[j]);
                }
            }
            // The last node of a cell is the farthest and lies at the border of another.
            if self.cursor[patch as usize] == self.cells.start[patch as usize + 1] {
                for j in around {
                    let root = self.merged.root(patch);
                    if self.room[root as usize] > 0 {
                        let core = self.cells.nearest[j] as usize;
                        self.merge(patch, self.label[core]);
                    }
                }
            }
        }
    }
}

/// The eight neighbours in the periodic cell; in a cell one node wide a node is its own neighbour.
fn neighbours(grid: Grid, i: usize) -> [usize; 8] {
    let (nx, ny) = (grid.nx, grid.ny);
    let (x, y) = (i % nx, i / nx);
    let (left, right) = ((x + nx - 1) % nx, (x + 1) % nx);
    let (up, down) = (nx * ((y + ny - 1) % ny), nx * ((y + 1) % ny));
    let row = nx * y;
    [up + left, up + x, up + right, row + left, row + right, down + left, down + x, down + right]
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_contact::observe::cluster_sizes;

    fn with(grid: Grid, inside: impl Fn(usize, usize) -> bool) -> Vec<u8> {
        (0..grid.points()).map(|i| u8::from(inside(i % grid.nx, i / grid.nx))).collect()
    }

    /// A disc across the cell boundary becomes the disc of twice the area: no contact node is farther than one outside.
    #[test]
    fn disc_is_dilated_to_a_disc() {
        let grid = Grid::unit(96, 96);
        let r2 = |x: usize, y: usize| {
            let [x, y] = minimum_image(grid, 0, y * 96 + x);
            x * x + y * y
        };
        let mut map = with(grid, |x, y| r2(x, y) < 0.15f64.powi(2));
        let core: usize = map.iter().map(|m| usize::from(*m)).sum();
        double(grid, &mut map);
        assert_eq!(map.iter().map(|m| usize::from(*m)).sum::<usize>(), 2 * core);
        let radius = |keep: u8| {
            (0..96 * 96).filter(move |&i| map[i] == keep).map(|i| r2(i % 96, i / 96).sqrt()).collect::<Vec<_>>()
        };
        let (outer, inner) = (radius.clone()(1), radius(0));
        let (outer, inner) = (outer.into_iter().fold(0.0, f64::max), inner.into_iter().fold(1.0, f64::min));
        assert!(
            (outer / (0.15 * 2f64.sqrt()) - 1.0).abs() < 1.0 / 14.0 && inner > outer - grid.dx(),
            "{outer} {inner}"
        );
    }

    /// Any map gets twice its nodes or all nodes and retains its patches; distant patches double independently.
    #[test]
    fn areas_double() {
        let grid = Grid::unit(60, 48);
        for (every, seed) in [(3, 1), (7, 5), (29, 2), (211, 3)] {
            let core: Vec<u8> = with(grid, |x, y| (x * x * (y + seed) + 13 * y * y + x) % every == 0);
            let previous: usize = core.iter().map(|m| usize::from(*m)).sum();
            let mut map = core.clone();
            double(grid, &mut map);
            let after: usize = map.iter().map(|m| usize::from(*m)).sum();
            assert_eq!(after, (2 * previous).min(grid.points()), "every {every}");
            assert!(core.iter().zip(&map).all(|(c, m)| m >= c));
        }
        let mut map = with(grid, |x, y| (x < 4 && y < 5) || ((30..36).contains(&x) && (20..29).contains(&y)));
        double(grid, &mut map);
        assert_eq!(cluster_sizes(&map, 60, Connectivity::Eight, true), [40, 108]);
        let mut none = vec![0; grid.points()];
        double(grid, &mut none);
        assert!(none.iter().all(|m| *m == 0));
    }

    /// A small patch close to a large one merges with it: one patch of twice the area of both.
    #[test]
    fn patches_that_meet_merge() {
        let grid = Grid::unit(64, 64);
        let mut map = with(grid, |x, y| ((10..30).contains(&x) && (10..30).contains(&y)) || (x, y) == (32, 20));
        double(grid, &mut map);
        assert_eq!(cluster_sizes(&map, 64, Connectivity::Eight, true), [802]);
    }

    /// A patch enclosed by others continues in their cells.
    #[test]
    fn enclosed_patch_continues_in_neighbouring_cells() {
        let grid = Grid::unit(9, 9);
        // Four single nodes enclose a block of nodes.
        let mut map = with(grid, |x, y| {
            ((3..6).contains(&x) && (3..6).contains(&y)) || [(1, 4), (7, 4), (4, 1), (4, 7)].contains(&(x, y))
        });
        double(grid, &mut map);
        assert_eq!(map.iter().map(|m| usize::from(*m)).sum::<usize>(), 26);
    }
}
