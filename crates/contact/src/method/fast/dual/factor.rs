//! Sparse inverse Cholesky factor of the compliance between the nodes in contact.
//!
//! The stress that displaces the contact nodes by `r` solves `C z = r`, with the compliance `C` restricted to these
//! nodes. With the nodes in an order from coarse to fine, a row of the inverse factor `W` is computed from the compliance
//! between its node and the preceding ones within [`RADIUS`] spacings of its level: for this pattern `S = WᵀW ≈ C⁻¹`
//! minimises the Kullback-Leibler divergence from the exact inverse (Schäfer, Katzfuss & Owhadi, SIAM J. Sci. Comput. 43
//! (2021) A2019). A product takes no transform; the coarse nodes transmit the long waves.

use super::hierarchy::Hierarchy;
use crate::interface::{Elastic, Kernel};
use asperity_grid::{Grid, Transform, vectorised};
use rayon::prelude::*;
use rustfft::num_complex::Complex;
use std::f64::consts::PI;

/// Radius of the neighbourhood of a node, in spacings of its level. With 4 a solve of 1024² at p* = 0.01 takes a fifth fewer transform
/// pairs, and a product twice the time.
const RADIUS: usize = 3;

/// Most entries of a row: half of the nodes within the radius, of all if they are coarser, and the node itself.
pub(super) const MOST_ENTRIES: usize = 29;

/// Nodes per task.
const TASK: usize = 512;

/// Displacement (L) of a node under a stress of E* on another one, by their distance along either axis in pixels.
pub(super) struct ComplianceTable {
    width: usize,
    values: Vec<f32>,
}

impl ComplianceTable {
    /// `wall`: compliance of a soft wall, L/E*.
    pub(super) fn new(grid: Grid, kernel: &Elastic, wall: f64) -> Self {
        let transform = Transform::<f32>::new(grid);
        let (mut spectrum, mut field) = (transform.spectrum(), vec![0.0_f32; grid.points()]);
        let per_point = 1.0 / grid.points() as f64;
        transform.inverse_after(&mut spectrum, &mut field, &|i: usize, column: &mut [Complex<f32>]| {
            for (j, c) in column.iter_mut().enumerate() {
                let compliance = per_point / kernel.stiffness(grid.qx(i), grid.qy(j));
                *c = Complex::new(if i + j == 0 { 0.0 } else { compliance as f32 }, 0.0);
            }
            0.0
        });
        let (width, height) = (grid.nx / 2 + 1, grid.ny / 2 + 1);
        // The stiffness of the mean mode is free. With half of the displacement of a half-space at the largest distance, the matrix is
        // positive definite.
        let farthest = (0.5 * grid.lx).hypot(0.5 * grid.ly);
        let corner = f64::from(field[(grid.ny / 2) * grid.nx + grid.nx / 2]);
        let offset = (0.5 * grid.dx() * grid.dy() / (PI * farthest) - corner) as f32;
        let rows = field.chunks(grid.nx).take(height);
        let mut values: Vec<f32> = rows.flat_map(|row| row[..width].iter().map(|c| c + offset)).collect();
        values[0] += wall as f32;
        ComplianceTable { width, values }
    }

    #[inline(always)]
    fn at(&self, [dy, dx]: [usize; 2]) -> f32 {
        self.values[dy * self.width + dx]
    }
}

/// Rows of a sparse matrix.
struct Rows {
    starts: Vec<u32>,
    columns: Vec<u32>,
    values: Vec<f32>,
}

impl Rows {
    fn empty() -> Self {
        Rows { starts: vec![0], columns: Vec::new(), values: Vec::new() }
    }

    /// The rows of all parts, which are released one by one.
    fn joined(parts: Vec<Rows>) -> Self {
        let mut rows = Rows::empty();
        let entries = parts.iter().map(|part| part.columns.len()).sum();
        rows.columns.reserve_exact(entries);
        rows.values.reserve_exact(entries);
        rows.starts.reserve_exact(parts.iter().map(Rows::len).sum());
        parts.into_iter().for_each(|part| rows.append(&part));
        rows
    }

    fn append(&mut self, part: &Rows) {
        let before = self.columns.len() as u32;
        self.starts.extend(part.starts[1..].iter().map(|start| start + before));
        self.columns.extend_from_slice(&part.columns);
        self.values.extend_from_slice(&part.values);
    }

    fn len(&self) -> usize {
        self.starts.len() - 1
    }

    fn push(&mut self, columns: &[u32], values: &[f32]) {
        self.columns.extend_from_slice(columns);
        self.values.extend_from_slice(values);
        self.starts.push(self.columns.len() as u32);
    }

    #[inline(always)]
    fn row(&self, i: usize) -> (&[u32], &[f32]) {
        let range = self.starts[i] as usize..self.starts[i + 1] as usize;
        (&self.columns[range.clone()], &self.values[range])
    }

    /// Row `i` times a vector.
    #[inline(always)]
    fn times(&self, i: usize, x: &[f64]) -> f64 {
        let (columns, values) = self.row(i);
        columns.iter().zip(values).map(|(j, v)| f64::from(*v) * x[*j as usize]).sum()
    }

    /// Adds `by` times row `i` to a vector.
    #[inline(always)]
    fn add(&self, i: usize, by: f64, x: &mut [f64]) {
        let (columns, values) = self.row(i);
        columns.iter().zip(values).for_each(|(j, v)| x[*j as usize] += f64::from(*v) * by);
    }

    fn product(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.len()];
        y.par_chunks_mut(TASK).enumerate().for_each(|(task, y)| {
            y.iter_mut().enumerate().for_each(|(k, y)| *y = self.times(task * TASK + k, x));
        });
        y
    }

    /// Of a square matrix.
    fn transposed(&self) -> Rows {
        let n = self.len();
        let mut starts = vec![0_u32; n + 1];
        self.columns.iter().for_each(|j| starts[*j as usize + 1] += 1);
        (0..n).for_each(|i| starts[i + 1] += starts[i]);
        let mut next = starts.clone();
        let (mut columns, mut values) = (vec![0; self.columns.len()], vec![0.0; self.values.len()]);
        for i in 0..n {
            let (row, entries) = self.row(i);
            for (j, v) in row.iter().zip(entries) {
                let at = &mut next[*j as usize];
                (columns[*at as usize], values[*at as usize]) = (i as u32, *v);
                *at += 1;
            }
        }
        Rows { starts, columns, values }
    }
}

/// `S = WᵀW` on a set of nodes, numbered in the order in which they came.
pub(super) struct InverseFactor<'t> {
    table: &'t ComplianceTable,
    pub nodes: Hierarchy,
    /// Of the nodes of the first set, with its transpose, and of those that came later.
    first: Rows,
    transposed: Rows,
    later: Rows,
    /// `S 1`, and its sum.
    pub ones: Vec<f64>,
    pub ones_sum: f64,
}

impl<'t> InverseFactor<'t> {
    /// Of these nodes `y nx + x`.
    pub(super) fn new(table: &'t ComplianceTable, grid: Grid, nodes: &[u32]) -> Self {
        let nodes = Hierarchy::new(grid, nodes);
        let tasks: Vec<Rows> = (0..nodes.len().div_ceil(TASK))
            .into_par_iter()
            .map(|task| rows_of(table, &nodes, task * TASK..((task + 1) * TASK).min(nodes.len())))
            .collect();
        let first = Rows::joined(tasks);
        let transposed = first.transposed();
        let mut factor =
            InverseFactor { table, nodes, first, transposed, later: Rows::empty(), ones: Vec::new(), ones_sum: 0.0 };
        factor.set_ones();
        factor
    }

    fn set_ones(&mut self) {
        self.ones = self.product(&vec![1.0; self.nodes.len()]);
        self.ones_sum = self.ones.iter().sum();
    }

    /// Adds nodes.
    pub(super) fn extend(&mut self, nodes: &[u32]) {
        nodes.iter().for_each(|index| self.nodes.push(*index));
        let count = self.nodes.len();
        let rows = rows_of(self.table, &self.nodes, count - nodes.len()..count);
        self.later.append(&rows);
        self.set_ones();
    }

    /// Number of nodes that came after the first set.
    pub(super) fn later(&self) -> usize {
        self.later.len()
    }

    /// `S r`.
    pub(super) fn product(&self, r: &[f64]) -> Vec<f64> {
        let mut z = self.transposed.product(&self.first.product(r));
        z.resize(r.len(), 0.0);
        (0..self.later.len()).for_each(|i| self.later.add(i, self.later.times(i, r), &mut z));
        z
    }

    /// `S r` on the nodes of `subset` (ascending numbers), where `r` is zero on all others. `work` is zero and remains so.
    pub(super) fn product_on(&self, subset: &[u32], r: &[f64], (work, all): (&mut [f64], &mut [f64])) -> Vec<f64> {
        let first = self.first.len();
        let of_first = subset.partition_point(|i| (*i as usize) < first);
        for (i, r) in subset[..of_first].iter().zip(r) {
            self.transposed.add(*i as usize, *r, work);
        }
        let mut product: Vec<f64> =
            subset[..of_first].iter().map(|i| self.transposed.times(*i as usize, work)).collect();
        for i in &subset[..of_first] {
            self.transposed.row(*i as usize).0.iter().for_each(|k| work[*k as usize] = 0.0);
        }
        product.resize(subset.len(), 0.0);
        if self.later.len() > 0 {
            let (values, sums) = all.split_at_mut(all.len() / 2);
            subset.iter().zip(r).for_each(|(i, r)| values[*i as usize] = *r);
            (0..self.later.len()).for_each(|i| {
                let by = self.later.times(i, values);
                if by != 0.0 {
                    self.later.add(i, by, sums);
                }
            });
            subset.iter().zip(&mut product).for_each(|(i, p)| *p += sums[*i as usize]);
            subset.iter().for_each(|i| values[*i as usize] = 0.0);
            self.later.columns.iter().for_each(|i| sums[*i as usize] = 0.0);
        }
        product
    }
}

/// Rows of the factor for these nodes.
fn rows_of(table: &ComplianceTable, nodes: &Hierarchy, range: std::ops::Range<usize>) -> Rows {
    let (mut rows, mut found, mut matrix, mut row) = (Rows::empty(), Vec::new(), Vec::new(), Vec::new());
    vectorised(
        #[inline(always)]
        || {
            for i in range {
                nodes.preceding(i, RADIUS, &mut found);
                // The node itself comes last.
                found.push(i as u32);
                let n = found.len();
                matrix.clear();
                matrix.resize(n * n, 0.0);
                for (a, column) in matrix.chunks_mut(n).enumerate() {
                    for (b, to) in column.iter_mut().enumerate().skip(a) {
                        *to = table.at(nodes.distance(found[a], found[b]));
                    }
                }
                last_row_of_inverse(&mut matrix, n, &mut row);
                rows.push(&found, &row);
            }
        },
    );
    rows
}

/// The last row of the inverse of the Cholesky factor of a symmetric matrix of `n` rows, of which the columns from the diagonal down
/// are given. They are overwritten.
#[inline(always)]
fn last_row_of_inverse(matrix: &mut [f32], n: usize, row: &mut Vec<f32>) {
    for j in 0..n {
        let (done, rest) = matrix.split_at_mut((j + 1) * n);
        let column = &mut done[j * n + j..];
        let scale = 1.0 / column[0].max(f32::MIN_POSITIVE).sqrt();
        column.iter_mut().for_each(|l| *l *= scale);
        for (k, next) in rest.chunks_mut(n).enumerate() {
            let below = &column[k + 1..];
            let factor = below[0];
            next[j + k + 1..].iter_mut().zip(below).for_each(|(a, l)| *a -= factor * l);
        }
    }
    // Lᵀ w = e of the last.
    row.clear();
    row.resize(n, 0.0);
    for i in (0..n).rev() {
        let column = &matrix[i * n + i..(i + 1) * n];
        let known: f32 = column[1..].iter().zip(&row[i + 1..]).map(|(l, w)| l * w).sum();
        row[i] = (if i == n - 1 { 1.0 } else { -known }) / column[0];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { nx: 24, ny: 18, lx: 1.0, ly: 0.75 };

    /// `C z` of the table.
    fn compressed(factor: &InverseFactor, z: &[f64]) -> Vec<f64> {
        let n = z.len() as u32;
        let between = |a: u32, b: u32| f64::from(factor.table.at(factor.nodes.distance(a, b)));
        (0..n).map(|a| (0..n).map(|b| between(a, b) * z[b as usize]).sum()).collect()
    }

    /// A few nodes near each other, across the edges of the cell, too: each conditions on all that precede it, and the factor is that of
    /// the exact inverse, also for nodes that join it.
    #[test]
    fn near_nodes_have_the_exact_inverse() {
        /// Entries are stored in f32.
        const ROUNDING: f64 = 1e-5;
        let table = ComplianceTable::new(GRID, &Elastic::HalfSpace, 0.01);
        let index = |y: u32, x: u32| y * GRID.nx as u32 + x;
        let first = [index(0, 0), index(0, 1), index(1, 23), index(17, 0)];
        let mut factor = InverseFactor::new(&table, GRID, &first);
        for joined in [&[][..], &[index(17, 23), index(0, 23)], &[index(1, 1)]] {
            factor.extend(joined);
            let z: Vec<f64> = (0..factor.nodes.len()).map(|i| (i as f64 * 1.7).sin()).collect();
            let found = factor.product(&compressed(&factor, &z));
            for (found, expected) in found.iter().zip(&z) {
                assert!((found - expected).abs() < ROUNDING, "{} nodes: {found} {expected}", z.len());
            }
        }
    }

    /// Products on a subset are those of the whole, for the first nodes and those that joined.
    #[test]
    fn products_on_a_subset_are_those_of_all_nodes() {
        let table = ComplianceTable::new(GRID, &Elastic::HalfSpace, 0.0);
        let nodes: Vec<u32> = (0..GRID.points() as u32).filter(|i| i * 7919 % 5 < 2).collect();
        let mut factor = InverseFactor::new(&table, GRID, &nodes);
        factor.extend(&[2, 200]);
        let n = factor.nodes.len();
        let subset: Vec<u32> = (0..n as u32).filter(|i| i % 3 == 0 || *i as usize > n - 3).collect();
        let mut whole = vec![0.0; n];
        let values: Vec<f64> = subset.iter().map(|i| f64::from(*i).cos()).collect();
        subset.iter().zip(&values).for_each(|(i, v)| whole[*i as usize] = *v);
        let expected = factor.product(&whole);
        let (mut work, mut all) = (vec![0.0; n], vec![0.0; 2 * n]);
        for _ in 0..2 {
            let found = factor.product_on(&subset, &values, (&mut work, &mut all));
            for (i, found) in subset.iter().zip(found) {
                assert!((found - expected[*i as usize]).abs() < 1e-12 * expected[*i as usize].abs().max(1.0), "{i}");
            }
        }
    }

    /// On a patch of contact with holes the model is close to the inverse: conjugate gradients that it preconditions
    /// gain at least a factor of two per iteration.
    #[test]
    fn the_model_preconditions_the_compliance() {
        let table = ComplianceTable::new(GRID, &Elastic::HalfSpace, 0.0);
        let nodes: Vec<u32> = (0..GRID.points() as u32).filter(|i| i % 24 < 15 && i * 7919 % 11 > 1).collect();
        let factor = InverseFactor::new(&table, GRID, &nodes);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut r: Vec<f64> = (0..nodes.len()).map(|i| ((i * i) as f64).sin()).collect();
        let mut z = factor.product(&r);
        let (mut d, first) = (z.clone(), dot(&r, &z));
        let mut rz = first;
        for _ in 0..10 {
            let q = compressed(&factor, &d);
            let alpha = rz / dot(&d, &q);
            r.iter_mut().zip(&q).for_each(|(r, q)| *r -= alpha * q);
            z = factor.product(&r);
            let old = rz;
            rz = dot(&r, &z);
            d.iter_mut().zip(&z).for_each(|(d, z)| *d = z + rz / old * *d);
        }
        assert!((rz / first).sqrt() < 0.5_f64.powi(10), "{:e}", (rz / first).sqrt());
    }
}
