//! Rows of a map as runs of marked nodes: sets of connected nodes need an entry per run, not per node.

use asperity_grid::{Offset, UnionFind};
use std::ops::Range;

/// Runs of marked nodes of a map, row by row.
pub(super) struct Runs {
    nx: usize,
    /// First column and the one after the last.
    columns: Vec<[u32; 2]>,
    /// First run of each row, and the number of runs.
    first: Vec<usize>,
}

impl Runs {
    /// Of the nodes of rows of `nx` whose value is `marked`.
    pub(super) fn of(map: &[u8], nx: usize, marked: impl Fn(u8) -> bool) -> Self {
        let (mut columns, mut first) = (Vec::new(), vec![0]);
        for row in map.chunks(nx.max(1)) {
            let mut x = 0;
            while let Some(from) = row[x..].iter().position(|m| marked(*m)) {
                let start = x + from;
                x = row[start..].iter().position(|m| !marked(*m)).map_or(nx, |n| start + n);
                columns.push([start as u32, x as u32]);
            }
            first.push(columns.len());
        }
        Runs { nx, columns, first }
    }

    pub(super) fn len(&self) -> usize {
        self.columns.len()
    }

    /// Nodes of a run.
    pub(super) fn nodes(&self, run: usize) -> usize {
        let [from, to] = self.columns[run];
        (to - from) as usize
    }

    /// Columns of a run, and its row.
    pub(super) fn iter(&self) -> impl Iterator<Item = (Range<usize>, usize)> + '_ {
        let rows = self.first.windows(2).enumerate();
        rows.flat_map(|(y, ends)| self.columns[ends[0]..ends[1]].iter().map(move |&[a, b]| (a as usize..b as usize, y)))
    }

    /// Sets of connected runs. `corners`: whether corner neighbours are connected. `periodic`: nodes on opposite sides of the map are
    /// neighbours. `step` makes the offset between the
    /// first nodes of two runs from columns and rows; `around` is called with that of each closed loop.
    pub(super) fn connected<D: Offset>(
        &self,
        (corners, periodic): (bool, bool),
        step: impl Fn(i64, i32) -> D,
        mut around: impl FnMut(D),
    ) -> UnionFind<D> {
        let (nx, rows, reach) = (self.nx as i64, self.first.len() - 1, u32::from(corners));
        let mut sets = UnionFind::new(self.len());
        // From run `a` to run `b`, a row below or in the same one, across the seam in x by `turns`.
        let mut join = |a: usize, b: usize, turns: i64, down: i32| {
            let along = i64::from(self.columns[b][0]) - i64::from(self.columns[a][0]) + turns * nx;
            if let Err(loop_offset) = sets.join(a as u32, b as u32, step(along, down)) {
                around(loop_offset);
            }
        };
        let row = |y: usize| self.first[y]..self.first[y + 1];
        // First and last run of a row, if they touch the seam.
        let at_start = |r: &Range<usize>| r.clone().next().filter(|&k| self.columns[k][0] == 0);
        let at_end = |r: &Range<usize>| r.clone().next_back().filter(|&k| self.columns[k][1] as usize == self.nx);
        for y in 0..rows {
            let here = row(y);
            if let Some((last, first)) = at_end(&here).zip(at_start(&here)).filter(|_| periodic) {
                join(last, first, 1, 0);
            }
            if !periodic && y + 1 == rows {
                break;
            }
            let below = row((y + 1) % rows);
            let mut next = below.start;
            for a in here.clone() {
                let [from, to] = self.columns[a];
                // Runs that end before this one begin before the next ones, too.
                while next < below.end && self.columns[next][1] + reach <= from {
                    next += 1;
                }
                let touching = (next..below.end).take_while(|&b| self.columns[b][0] < to + reach);
                touching.for_each(|b| join(a, b, 0, 1));
            }
            if corners && periodic {
                if let Some((a, b)) = at_end(&here).zip(at_start(&below)) {
                    join(a, b, 1, 1);
                }
                if let Some((a, b)) = at_start(&here).zip(at_end(&below)) {
                    join(a, b, -1, 1);
                }
            }
        }
        sets
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Connectivity, cluster_sizes, clusters, percolates};
    use asperity_grid::UnionFind;

    /// Sizes of the connected sets of nodes by their first node, and whether loops wind around the cell or sets lead from side to side,
    /// node by node.
    fn by_nodes(map: &[u8], nx: usize, corners: bool, periodic: bool) -> (Vec<usize>, [bool; 2]) {
        let ny = map.len() / nx;
        let mut sets: UnionFind<[i32; 2]> = UnionFind::new(map.len());
        let mut around = [false; 2];
        let neighbours: &[[i32; 2]] = if corners { &[[1, 0], [0, 1], [1, 1], [-1, 1]] } else { &[[1, 0], [0, 1]] };
        for i in (0..map.len()).filter(|&i| map[i] != 0) {
            for &[dx, dy] in neighbours {
                let x = (i % nx) as i64 + i64::from(dx);
                if !periodic && (x < 0 || x >= nx as i64 || i / nx + dy as usize >= ny) {
                    continue;
                }
                let other = (i / nx + dy as usize) % ny * nx + x.rem_euclid(nx as i64) as usize;
                if map[other] != 0
                    && let Err(winding) = sets.join(i as u32, other as u32, [dx, dy])
                {
                    around = [around[0] || winding[0] != 0, around[1] || winding[1] != 0];
                }
            }
        }
        if !periodic {
            let mut leads = |from: usize, to: usize| {
                map[from] != 0 && map[to] != 0 && sets.find(from as u32).0 == sets.find(to as u32).0
            };
            let row_ends = |x: usize| (0..ny).map(move |y| y * nx + x);
            let column_ends = |y: usize| (0..nx).map(move |x| y * nx + x);
            around = [
                row_ends(0).any(|a| row_ends(nx - 1).any(|b| leads(a, b))),
                column_ends(0).any(|a| column_ends(ny - 1).any(|b| leads(a, b))),
            ];
        }
        let mut sizes = vec![0; map.len()];
        (0..map.len()).filter(|&i| map[i] != 0).for_each(|i| sizes[sets.find(i as u32).0 as usize] += 1);
        sizes.retain(|s| *s > 0);
        (sizes, around)
    }

    /// Random maps of few and of many marked nodes, down to a single row or column.
    #[test]
    fn runs_are_connected_as_their_nodes_are() {
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            state >> 24
        };
        for (nx, ny) in (1..8).flat_map(|nx| (1..8).map(move |ny| (nx, ny))) {
            for _ in 0..60 {
                let fraction = random();
                let map: Vec<u8> = (0..nx * ny).map(|_| u8::from(random() <= fraction)).collect();
                let neighbours = [(Connectivity::Four, false), (Connectivity::Eight, true)];
                for ((connectivity, corners), periodic) in neighbours.into_iter().flat_map(|n| [(n, true), (n, false)])
                {
                    let (sizes, around) = by_nodes(&map, nx, corners, periodic);
                    let actual = clusters(&map, nx, connectivity, periodic);
                    let case = format!("{nx} x {ny}, periodic {periodic}: {map:?}");
                    assert_eq!(cluster_sizes(&map, nx, connectivity, periodic), sizes, "{case}");
                    assert_eq!(actual.sizes, sizes, "{case}");
                    assert!(actual.label.iter().zip(&map).all(|(l, m)| (*m != 0) == (*l < sizes.len() as u32)));
                    assert_eq!(percolates(&map, nx, (1, corners), periodic), around, "{case}");
                }
            }
        }
    }
}
