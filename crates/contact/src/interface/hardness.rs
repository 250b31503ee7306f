//! The largest contact stress of every node: one number, or a map.

use asperity_grid::error::Complaint;
use asperity_grid::{CHUNK, extent, mean};
use std::sync::OnceLock;

/// Hardness of every node of a grid, units of E*, and its restrictions to coarser grids.
#[derive(Debug)]
pub struct HardnessMap {
    nx: usize,
    ny: usize,
    nodes: Vec<f64>,
    mean: f64,
    extent: (f64, f64),
    /// The next of the restrictions made so far.
    next: OnceLock<Box<HardnessMap>>,
}

impl HardnessMap {
    /// From values `[ny, nx]`.
    ///
    /// # Errors
    /// A complaint about `hardness`, if the number of values is not `nx ny`, or one is not finite and positive.
    pub fn new(nx: usize, ny: usize, nodes: Vec<f64>) -> Result<Self, Complaint> {
        if nodes.is_empty() || nodes.len() != nx * ny {
            let accepted = format!("a value for each of {nx} x {ny} points");
            return Err(Complaint::new("hardness", format!("{} values", nodes.len()), accepted));
        }
        if let Some(i) = nodes.iter().position(|h| !(h.is_finite() && *h > 0.0)) {
            let found = format!("{} in row {}, column {} (counted from 1)", nodes[i], i / nx + 1, i % nx + 1);
            return Err(Complaint::new("hardness", found, "positive, finite values"));
        }
        Ok(Self::of_checked(nx, ny, nodes))
    }

    fn of_checked(nx: usize, ny: usize, nodes: Vec<f64>) -> Self {
        let (low, high) = extent(&nodes);
        // The mean of equal values is that value, to the last bit.
        let mean = if low == high { low } else { mean(&nodes) };
        HardnessMap { nx, ny, mean, extent: (low, high), nodes, next: OnceLock::new() }
    }

    /// The map in another unit.
    ///
    /// # Errors
    /// As [`HardnessMap::new`].
    pub fn converted(&self, convert: impl Fn(f64) -> f64) -> Result<Self, Complaint> {
        Self::new(self.nx, self.ny, self.nodes.iter().map(|h| convert(*h)).collect())
    }

    /// Lowest and highest value.
    pub fn extent(&self) -> (f64, f64) {
        self.extent
    }

    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Whether the map has this many points along x and y.
    pub fn is_on(&self, nx: usize, ny: usize) -> bool {
        (self.nx, self.ny) == (nx, ny)
    }

    /// The map on another grid of the same area: the mean over each of its cells, made once.
    ///
    /// The mean keeps the load that the whole area carries when every node flows. Every load below it has an equilibrium on
    /// all grids, which a sample of the nodes does not guarantee.
    fn on(&self, nx: usize, ny: usize) -> &HardnessMap {
        let mut map = self;
        while !map.is_on(nx, ny) {
            map = map.next.get_or_init(|| Box::new(self.restricted(nx, ny)));
        }
        map
    }

    /// Means over the cells of a grid of `nx` by `ny` points.
    pub fn restricted(&self, nx: usize, ny: usize) -> HardnessMap {
        let (columns, rows) = (shares(self.nx, nx), shares(self.ny, ny));
        let mut nodes = vec![0.0; nx * ny];
        for (row, to) in rows.iter().zip(nodes.chunks_mut(nx)) {
            for &(y, weight) in row {
                let from = &self.nodes[y * self.nx..][..self.nx];
                for (column, to) in columns.iter().zip(&mut *to) {
                    *to += weight * column.iter().map(|&(x, weight)| weight * from[x]).sum::<f64>();
                }
            }
        }
        Self::of_checked(nx, ny, nodes)
    }

    /// Bytes of the restrictions of a map of `points` values, each to half the points along each side.
    pub fn restriction_bytes(points: usize) -> u64 {
        (points * size_of::<f64>()) as u64 / 3
    }
}

/// For each of `to` equal intervals of a line of `from` equal intervals: those that it covers, and the shares of its length.
fn shares(from: usize, to: usize) -> Vec<Vec<(usize, f64)>> {
    // In units of 1/(from to) of the line.
    let interval = |k: usize| {
        let (first, last) = (k * from, (k + 1) * from);
        let covered = first / to..last.div_ceil(to);
        let fraction = |i: usize| ((last.min((i + 1) * to) - first.max(i * to)) as f64) / from as f64;
        covered.map(|i| (i, fraction(i))).collect()
    };
    (0..to).map(interval).collect()
}

/// Largest contact stress of nodes, units of E*.
#[derive(Debug, Clone, Copy)]
pub enum NodalHardness<'m> {
    /// The same at all nodes; infinite for an elastic body.
    Uniform(f64),
    /// A value for each node of a grid, from the node `first` on, over `unit`, and `added_stress`.
    Map { map: &'m HardnessMap, first: usize, unit: f64, added_stress: f64 },
}

impl From<f64> for NodalHardness<'_> {
    fn from(value: f64) -> Self {
        NodalHardness::Uniform(value)
    }
}

impl<'m> From<&'m HardnessMap> for NodalHardness<'m> {
    /// Of equal values the number, with the same results to the last bit.
    fn from(map: &'m HardnessMap) -> Self {
        match map.extent {
            (low, high) if low == high => NodalHardness::Uniform(low),
            _ => NodalHardness::Map { map, first: 0, unit: 1.0, added_stress: 0.0 },
        }
    }
}

impl<'m> NodalHardness<'m> {
    /// No bound of the contact stress.
    pub const NONE: Self = NodalHardness::Uniform(f64::INFINITY);

    /// Mean over all nodes.
    pub fn mean(&self) -> f64 {
        match self {
            NodalHardness::Uniform(value) => *value,
            NodalHardness::Map { map, unit, added_stress, .. } => map.mean / unit + added_stress,
        }
    }

    /// Of node `i`, counted from the first.
    #[inline(always)]
    pub fn at(&self, i: usize) -> f64 {
        match self {
            NodalHardness::Uniform(value) => *value,
            NodalHardness::Map { map, first, unit, added_stress } => map.nodes[first + i] / unit + added_stress,
        }
    }

    /// Of the chunk of nodes from `i` on; infinite past the end.
    #[inline(always)]
    pub fn chunk(&self, i: usize) -> [f64; CHUNK] {
        match self {
            NodalHardness::Uniform(value) => [*value; CHUNK],
            NodalHardness::Map { map, first, unit, added_stress } => {
                let mut values = [f64::INFINITY; CHUNK];
                let from = map.nodes.get(first + i..).unwrap_or(&[]);
                values.iter_mut().zip(from).for_each(|(to, h)| *to = h / unit + added_stress);
                values
            }
        }
    }

    /// Of the nodes from `i` on.
    #[inline(always)]
    pub fn from_node(self, i: usize) -> Self {
        match self {
            NodalHardness::Map { map, first, unit, added_stress } => {
                NodalHardness::Map { map, first: first + i, unit, added_stress }
            }
            uniform => uniform,
        }
    }

    /// On another grid of the same area.
    pub fn on_nodes(self, nx: usize, ny: usize) -> Self {
        match self {
            NodalHardness::Map { map, unit, added_stress, .. } => {
                NodalHardness::Map { map: map.on(nx, ny), first: 0, unit, added_stress }
            }
            uniform => uniform,
        }
    }

    /// In multiples of `by`, a power of two.
    pub fn in_units(self, by: f64) -> Self {
        match self {
            NodalHardness::Uniform(value) => NodalHardness::Uniform(value / by),
            NodalHardness::Map { map, first, unit, added_stress } => {
                NodalHardness::Map { map, first, unit: unit * by, added_stress: added_stress / by }
            }
        }
    }

    /// Higher by this stress at all nodes.
    #[inline(always)]
    pub fn raised(self, by: f64) -> Self {
        match self {
            NodalHardness::Uniform(value) => NodalHardness::Uniform(value + by),
            NodalHardness::Map { map, first, unit, added_stress } => {
                NodalHardness::Map { map, first, unit, added_stress: added_stress + by }
            }
        }
    }

    /// The map, if the values differ.
    pub fn map(&self) -> Option<&'m HardnessMap> {
        match self {
            NodalHardness::Uniform(_) => None,
            NodalHardness::Map { map, .. } => Some(map),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(nx: usize, ny: usize, value: impl Fn(usize) -> f64) -> HardnessMap {
        HardnessMap::new(nx, ny, (0..nx * ny).map(value).collect()).expect("positive values")
    }

    /// On any grid the mean is kept, values stay within those of the map, and a grid of half the points has the means of four.
    #[test]
    fn restrictions_keep_the_mean() {
        let fine = map(12, 10, |i| 1.0 + ((7 * i) % 11) as f64);
        for (nx, ny) in [(6, 5), (7, 5), (12, 3), (1, 1), (12, 10)] {
            let coarse = fine.on(nx, ny);
            assert!((coarse.mean() / fine.mean() - 1.0).abs() < 1e-15, "{nx} {ny}");
            assert!(coarse.extent().0 >= fine.extent().0 && coarse.extent().1 <= fine.extent().1 * (1.0 + 1e-15));
            assert!(std::ptr::eq(coarse, fine.on(nx, ny)), "made once");
        }
        let four = [0, 1, 12, 13].map(|i| fine.nodes[i]).iter().sum::<f64>() / 4.0;
        assert!((fine.on(6, 5).nodes[0] - four).abs() < 1e-15);
    }

    #[test]
    fn planned_memory_counts_all_restrictions() {
        let fine = map(64, 64, |i| 1.0 + i as f64);
        let values: usize = [32, 16, 8, 4, 2, 1].iter().map(|n| fine.on(*n, *n).nodes.len()).sum();
        let ratio = HardnessMap::restriction_bytes(64 * 64) as f64 / (8 * values) as f64;
        assert!((1.0..1.01).contains(&ratio), "{ratio}");
    }

    #[test]
    fn chunks_and_units() {
        let fine = map(9, 10, |i| (i + 1) as f64);
        let hardness = NodalHardness::from(&fine).from_node(9).in_units(2.0);
        assert_eq!((hardness.at(3), hardness.chunk(3)[2], hardness.mean()), (6.5, 7.5, 22.75));
        assert_eq!(hardness.chunk(27)[53..56], [45.0, f64::INFINITY, f64::INFINITY]);
        assert!(matches!(NodalHardness::from(&map(2, 2, |_| 0.3)), NodalHardness::Uniform(h) if h == 0.3));
    }

    #[test]
    fn values_that_are_no_hardness_are_refused() {
        for (nx, values, word) in [
            (2, vec![1.0; 3], "3 values"),
            (0, Vec::new(), "0 values"),
            (2, vec![1.0, 2.0, 0.0, 1.0], "0 in row 2, column 1"),
            (2, vec![1.0, -2.0, 1.0, 1.0], "-2 in row 1, column 2"),
            (2, vec![1.0, f64::NAN, 1.0, 1.0], "NaN"),
            (2, vec![f64::INFINITY, 1.0, 1.0, 1.0], "inf"),
        ] {
            let complaint = HardnessMap::new(nx, 2, values).expect_err("refused").to_string();
            assert!(complaint.starts_with("hardness = ") && complaint.contains(word), "{complaint}");
        }
    }
}
