//! Compact limited-memory BFGS update of the inverse of the harmonic crystal, from pairs of displacements and changes of force.
//!
//! `H = D⁻¹ + X M Xᵀ` with X = \[S, D⁻¹Y\] and `M = [[R⁻ᵀ (diag(SᵀY) + Yᵀ D⁻¹ Y) R⁻¹, -R⁻ᵀ], [-R⁻¹, 0]]`, R the upper triangle of SᵀY (Byrd, Nocedal
//! and Schnabel, Math. Program. 63 (1994) 129). Of each pair S and D⁻¹Y are kept: Y itself is not needed.

use nalgebra::{DMatrix, DVector};

use asperity_contact::interface::{Amplitudes, HarmonicBlock};
use asperity_grid::{Real, vectorised};

/// Smallest curvature `s·y` of a pair over `y·D⁻¹y`: with less the update would not be positive definite to rounding. 0.05 keeps all pairs of
/// elastic loads.
const SMALLEST_CURVATURE: f64 = 0.05;

/// A displacement and the change of the force that it brought.
pub(super) struct Pair<T> {
    /// s, and its part on the surface layers.
    pub displacement: Amplitudes<T>,
    pub displacement_surface: Vec<[f64; 3]>,
    /// q = D⁻¹ y of the change y of the force, and its part on the surface layers.
    pub response: Amplitudes<T>,
    pub response_surface: Vec<[f64; 3]>,
}

impl<T> Pair<T> {
    /// `s·f` and `q·f` of forces on the surface layers.
    pub(super) fn project_surface(&self, forces: &[[f64; 3]]) -> [f64; 2] {
        [dot(&self.displacement_surface, forces), dot(&self.response_surface, forces)]
    }
}

/// The kept pairs, oldest first.
pub(super) struct Pairs<T> {
    limit: usize,
    pairs: Vec<Pair<T>>,
    /// `s_i · y_k` and `y_i · q_k`.
    s_y: Vec<Vec<f64>>,
    y_q: Vec<Vec<f64>>,
    middle: DMatrix<f64>,
}

/// Sum of the products of two fields of vectors.
pub(super) fn dot(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    vectorised(|| asperity_grid::dot(a.as_flattened(), b.as_flattened()))
}

/// Adds `factor` times a field of vectors.
pub(super) fn add_scaled(to: &mut [[f64; 3]], factor: f64, from: &[[f64; 3]]) {
    to.as_flattened_mut().iter_mut().zip(from.as_flattened()).for_each(|(to, from)| *to += factor * from);
}

impl<T: Real> Pairs<T> {
    pub(super) fn new(limit: usize) -> Self {
        Pairs { limit, pairs: Vec::new(), s_y: Vec::new(), y_q: Vec::new(), middle: DMatrix::zeros(0, 0) }
    }

    /// Whether a pair with these products `s·y` and `q·y` is one to keep.
    pub(super) fn accepts(&self, [curvature, harmonic]: [f64; 2]) -> bool {
        harmonic > 0.0 && curvature >= SMALLEST_CURVATURE * harmonic
    }

    /// Removes the oldest pair where there is no room for another one; whether there was none.
    pub(super) fn make_room(&mut self) -> bool {
        let full = self.pairs.len() == self.limit;
        if full {
            self.pairs.remove(0);
            for table in [&mut self.s_y, &mut self.y_q] {
                table.remove(0);
                for row in table.iter_mut() {
                    row.remove(0);
                }
            }
        }
        full
    }

    /// Takes a pair; `products` are those of the change y of its force with the kept pairs and with itself.
    pub(super) fn push(&mut self, pair: Pair<T>, products: &[[f64; 2]]) {
        let earlier = self.pairs.len();
        self.s_y.push(vec![0.0; earlier]);
        let row = products[..earlier].iter().map(|[_, q_y]| *q_y).collect();
        self.y_q.push(row);
        for (k, [s_y, q_y]) in products.iter().enumerate() {
            self.s_y[k].push(*s_y);
            self.y_q[k].push(*q_y);
        }
        self.pairs.push(pair);
        self.middle = self.compact();
    }

    /// M.
    fn compact(&self) -> DMatrix<f64> {
        let m = self.pairs.len();
        let r = DMatrix::from_fn(m, m, |i, k| if i <= k { self.s_y[i][k] } else { 0.0 });
        // Its diagonal is positive.
        let inverse = r.try_inverse().unwrap_or_else(|| DMatrix::zeros(m, m));
        let mut d = DMatrix::from_fn(m, m, |i, k| self.y_q[i][k]);
        (0..m).for_each(|i| d[(i, i)] += self.s_y[i][i]);
        let mut all = DMatrix::zeros(2 * m, 2 * m);
        all.view_mut((0, 0), (m, m)).copy_from(&(inverse.transpose() * d * &inverse));
        all.view_mut((0, m), (m, m)).copy_from(&-inverse.transpose());
        all.view_mut((m, 0), (m, m)).copy_from(&-inverse);
        all
    }

    /// The coefficients `M v` of the columns of X: of s, then of q.
    pub(super) fn coefficients(&self, projections: &[[f64; 2]]) -> DVector<f64> {
        let (s, q) = (projections.iter().map(|p| p[0]), projections.iter().map(|p| p[1]));
        &self.middle * DVector::from_iterator(2 * projections.len(), s.chain(q))
    }

    /// `s·f` and `q·f` of forces on all layers for each pair.
    pub(super) fn project(&self, crystal: &HarmonicBlock<T>, forces: &Amplitudes<T>) -> Vec<[f64; 2]> {
        let columns = self.pairs.iter().flat_map(|p| [&p.displacement, &p.response]);
        crystal.products(columns, forces).chunks_exact(2).map(|p| [p[0], p[1]]).collect()
    }

    /// The same of forces on the surface layers.
    pub(super) fn project_surface(&self, forces: &[[f64; 3]]) -> Vec<[f64; 2]> {
        self.pairs.iter().map(|p| p.project_surface(forces)).collect()
    }

    /// The parts of the pairs on some atoms of the surface layers.
    pub(super) fn at(&self, atoms: &[usize]) -> Vec<[Vec<[f64; 3]>; 2]> {
        let part = |of: &[[f64; 3]]| atoms.iter().map(|k| of[*k]).collect();
        self.pairs.iter().map(|p| [part(&p.displacement_surface), part(&p.response_surface)]).collect()
    }

    /// Adds `X c` on all layers.
    pub(super) fn add(&self, coefficients: &DVector<f64>, to: &mut Amplitudes<T>) {
        let (s, q) = (self.pairs.iter().map(|p| &p.displacement), self.pairs.iter().map(|p| &p.response));
        to.add(coefficients.as_slice(), s.chain(q));
    }

    /// Adds `X c` on the surface layers.
    pub(super) fn add_surface(&self, coefficients: &DVector<f64>, to: &mut [[f64; 3]]) {
        let (s, q) =
            (self.pairs.iter().map(|p| &p.displacement_surface), self.pairs.iter().map(|p| &p.response_surface));
        s.chain(q).zip(coefficients.iter()).for_each(|(x, c)| add_scaled(to, *c, x));
    }
}
