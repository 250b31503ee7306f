//! Nodes in contact in an order from coarse to fine.

use asperity_grid::Grid;
use std::collections::HashMap;

/// No node.
const NONE: u32 = u32::MAX;

/// Neighbours of a later node that suffice; where fewer are near, it looks for them at larger distances.
const ENOUGH: usize = 4;

/// Numbers of the nodes of a grid: one bit a point, and the number of nodes before each word.
struct Marks {
    bits: Vec<u64>,
    before: Vec<u32>,
    /// Of nodes that were added to the marked ones.
    later: HashMap<u32, u32>,
}

impl Marks {
    fn new(points: usize, nodes: &[u32]) -> Self {
        let mut bits = vec![0; points.div_ceil(64)];
        nodes.iter().for_each(|i| bits[*i as usize / 64] |= 1_u64 << (i % 64));
        let count = |sum: &mut u32, word: &u64| {
            let before = *sum;
            *sum += word.count_ones();
            Some(before)
        };
        let before = bits.iter().scan(0, count).collect();
        Marks { bits, before, later: HashMap::new() }
    }

    /// Number of the node at a point, or none.
    #[inline(always)]
    fn number(&self, index: usize) -> u32 {
        let (word, bit) = (self.bits[index / 64], 1_u64 << (index % 64));
        if word & bit != 0 {
            return self.before[index / 64] + (word & (bit - 1)).count_ones();
        }
        if self.later.is_empty() { NONE } else { self.later.get(&(index as u32)).copied().unwrap_or(NONE) }
    }
}

/// A level: cells of `2^level` pixels along either axis, each with one of the nodes in it, which represents it.
struct Cells {
    wide: usize,
    high: usize,
    nodes: Vec<u32>,
}

/// Nodes, numbered as they came, and the coarsest level at which each represents its cell. A node precedes those of finer levels,
/// and at its own level those with larger numbers.
pub(super) struct Hierarchy {
    grid: Grid,
    /// Row and column of each node.
    places: Vec<[u32; 2]>,
    level: Vec<u8>,
    /// Numbers of the nodes by their points, the finest level.
    marks: Marks,
    /// The coarser levels.
    cells: Vec<Cells>,
    /// Number of nodes that have a level. Later ones come last.
    ordered: usize,
}

impl Hierarchy {
    /// Of these nodes `y nx + x`.
    pub(super) fn new(grid: Grid, nodes: &[u32]) -> Self {
        let places: Vec<[u32; 2]> = nodes.iter().map(|i| [i / grid.nx as u32, i % grid.nx as u32]).collect();
        let marks = Marks::new(grid.points(), nodes);
        let mut level = vec![0; nodes.len()];
        let mut cells: Vec<Cells> = Vec::new();
        let (mut wide, mut high) = (grid.nx, grid.ny);
        while wide.max(high) > 1 {
            let coarser = match cells.last() {
                None => Cells::of_nodes(grid, &places),
                Some(below) => below.coarser(),
            };
            (wide, high) = (coarser.wide, coarser.high);
            let depth = cells.len() as u8 + 1;
            coarser.nodes.iter().filter(|i| **i != NONE).for_each(|i| level[*i as usize] = depth);
            cells.push(coarser);
        }
        Hierarchy { grid, ordered: places.len(), places, level, marks, cells }
    }

    pub(super) fn len(&self) -> usize {
        self.places.len()
    }

    pub(super) fn contains(&self, index: u32) -> bool {
        self.marks.number(index as usize) != NONE
    }

    /// Adds a node after all others.
    pub(super) fn push(&mut self, index: u32) {
        self.marks.later.insert(index, self.places.len() as u32);
        self.places.push([index / self.grid.nx as u32, index % self.grid.nx as u32]);
        self.level.push(0);
    }

    /// Distance of two nodes along y and along x, in pixels.
    #[inline(always)]
    pub(super) fn distance(&self, a: u32, b: u32) -> [usize; 2] {
        let ([ya, xa], [yb, xb]) = (self.places[a as usize], self.places[b as usize]);
        let (dy, dx) = (ya.abs_diff(yb) as usize, xa.abs_diff(xb) as usize);
        [dy.min(self.grid.ny - dy), dx.min(self.grid.nx - dx)]
    }

    /// The preceding nodes within `radius` spacings of the level of `node`.
    pub(super) fn preceding(&self, node: usize, radius: usize, found: &mut Vec<u32>) {
        found.clear();
        if node < self.ordered {
            let level = self.level[node];
            let precedes = |other: u32| {
                let above = self.level[other as usize];
                (other as usize) < self.ordered && (above > level || above == level && (other as usize) < node)
            };
            self.near(node, usize::from(level), radius, precedes, found);
            return;
        }
        for level in 0..=self.cells.len() {
            found.clear();
            self.near(node, level, radius, |other| (other as usize) < node, found);
            if found.len() >= ENOUGH {
                return;
            }
        }
    }

    /// Appends the nodes within `radius` spacings of a level that represent its cells and that `keep` accepts.
    #[inline(always)]
    fn near(&self, node: usize, level: usize, radius: usize, keep: impl Fn(u32) -> bool, found: &mut Vec<u32>) {
        let above = level.checked_sub(1).map(|above| &self.cells[above]);
        let (wide, high) = above.map_or((self.grid.nx, self.grid.ny), |cells| (cells.wide, cells.high));
        let [y, x] = self.places[node];
        let limit = (radius << level).pow(2);
        // Every cell once; the range ends before twice the number of cells.
        let range = |c: usize, n: usize| match 2 * radius + 1 {
            width if width > n => (0, n),
            width => (if c < radius { c + n - radius } else { c - radius }, width),
        };
        let ((first_y, count_y), (first_x, count_x)) =
            (range(y as usize >> level, high), range(x as usize >> level, wide));
        for cy in first_y..first_y + count_y {
            let row = if cy >= high { cy - high } else { cy } * wide;
            for cx in first_x..first_x + count_x {
                let cell = row + if cx >= wide { cx - wide } else { cx };
                let other = above.map_or_else(|| self.marks.number(cell), |cells| cells.nodes[cell]);
                if other == NONE || other as usize == node || !keep(other) {
                    continue;
                }
                let [dy, dx] = self.distance(node as u32, other);
                if dy * dy + dx * dx <= limit {
                    found.push(other);
                }
            }
        }
    }
}

impl Cells {
    /// Cells of two points along either axis.
    fn of_nodes(grid: Grid, places: &[[u32; 2]]) -> Cells {
        let (wide, high) = (grid.nx.div_ceil(2), grid.ny.div_ceil(2));
        let mut nodes = vec![NONE; wide * high];
        for (number, [y, x]) in (0..).zip(places) {
            let to = &mut nodes[*y as usize / 2 * wide + *x as usize / 2];
            *to = number.min(*to);
        }
        Cells { wide, high, nodes }
    }

    /// Cells of twice the side: each is represented by the first node of those in it.
    fn coarser(&self) -> Cells {
        let (wide, high) = (self.wide.div_ceil(2), self.high.div_ceil(2));
        let mut nodes = vec![NONE; wide * high];
        for (cy, row) in nodes.chunks_mut(wide).enumerate() {
            for below in self.nodes.chunks(self.wide).skip(2 * cy).take(2) {
                for (to, pair) in row.iter_mut().zip(below.chunks(2)) {
                    *to = pair.iter().fold(*to, |found, i| if found == NONE { *i } else { found });
                }
            }
        }
        Cells { wide, high, nodes }
    }
}
