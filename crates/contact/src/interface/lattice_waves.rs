//! A crystal's layers at one wave vector: force constants as real symmetric matrices between groups of layers, and the elimination of the
//! groups below a block.
//!
//! Groups are as thick as the reach of an atom, so that each is coupled to the next above and the next below only.

use std::f64::consts::TAU;

use nalgebra::{Cholesky, DMatrix, Dyn};
use rustfft::num_complex::Complex;

use super::lattice_constants::{Bond, LatticeConstants};
use asperity_grid::{Error, Real, Result};

/// Relative change of S per group below which further groups change nothing. The longest
/// wave decays by exp(-2 q 2 a0) per group of four layers, on 175 cells 0.87: the remainder is below 1e-12.
const CONDENSED: f64 = 1e-13;

/// The mirrors that take a wave vector into the stored part of the zone, 0 ≤ b ≤ a.
pub(super) struct Symmetry {
    pub(super) a: usize,
    pub(super) b: usize,
    mirrored: bool,
    swapped: bool,
}

impl Symmetry {
    pub(super) fn of(kx: usize, ky: i64) -> Self {
        let (x, y) = (kx, ky.unsigned_abs() as usize);
        Symmetry { a: x.max(y), b: x.min(y), mirrored: ky < 0, swapped: y > x }
    }

    /// Amplitude of the wave (x, y, z) to that of the stored one, multiplied by W.
    pub(super) fn reduce<T: Real>(&self, v: &mut [Complex<T>]) {
        if self.mirrored {
            v[1] = -v[1];
        }
        if self.swapped {
            v.swap(0, 1);
        }
        v[..2].iter_mut().for_each(|v| *v = Complex::new(-v.im, v.re));
    }

    pub(super) fn restore<T: Real>(&self, v: &mut [Complex<T>]) {
        v[..2].iter_mut().for_each(|v| *v = Complex::new(v.im, -v.re));
        if self.swapped {
            v.swap(0, 1);
        }
        if self.mirrored {
            v[1] = -v[1];
        }
    }
}

/// Sums bonds into the 3×3 blocks of `matrix` (`W D W†`): the block of a bond is chosen by `place`.
pub(super) fn sum_bonds(
    bonds: &[Bond],
    (cells, (a, b)): (usize, (usize, usize)),
    matrix: &mut DMatrix<f64>,
    place: impl Fn(i32) -> Option<(usize, usize)>,
) {
    let period = 2 * cells as i64;
    for bond in bonds {
        let Some((row, column)) = place(bond.layer) else { continue };
        let turns = (a as i64 * i64::from(bond.dx) + b as i64 * i64::from(bond.dy)).rem_euclid(period);
        let (sin, cos) = (TAU * turns as f64 / period as f64).sin_cos();
        for (c, phi) in bond.phi.iter().enumerate() {
            for (d, phi) in phi.iter().enumerate() {
                let part = match (c == 2, d == 2) {
                    (false, true) => -sin,
                    (true, false) => sin,
                    _ => cos,
                };
                matrix[(3 * row + c, 3 * column + d)] += phi * part;
            }
        }
    }
}

/// Matrices between groups of layers at one wave vector, eV/Å²; rows and columns by layer from the lowest, then x, y, z.
pub(super) struct LayerGroups {
    wave: (usize, usize),
    reach: usize,
    /// Between the layers of a group in the crystal.
    pub(super) within: DMatrix<f64>,
    /// Of a group (rows) to the next below (columns).
    pub(super) to_below: DMatrix<f64>,
    /// Between the lowest layers of a cut block.
    cut: DMatrix<f64>,
    /// Between the highest layers of a block with a free surface, its mirror image.
    pub(super) surface: DMatrix<f64>,
}

/// Central differences leave an asymmetry of rounding.
pub(super) fn symmetric(x: &DMatrix<f64>) -> DMatrix<f64> {
    0.5 * (x + x.transpose())
}

impl LayerGroups {
    /// At the wave vector (a, b)/`cells`, in units of 2π over the lattice constant.
    pub(super) fn new(constants: &LatticeConstants, cells: usize, wave: (usize, usize)) -> LayerGroups {
        let m = constants.reach;
        let size = 3 * m;
        let zero = || DMatrix::zeros(size, size);
        let (mut within, mut to_below, mut cut, mut surface) = (zero(), zero(), zero(), zero());
        let layer = |k: i64| usize::try_from(k).ok().filter(|k| *k < m);
        for l in 0..m {
            let at = (cells, wave);
            sum_bonds(&constants.bulk, at, &mut within, |d| layer(l as i64 + i64::from(d)).map(|k| (l, k)));
            sum_bonds(&constants.bulk, at, &mut to_below, |d| {
                layer(l as i64 + i64::from(d) + m as i64).map(|k| (l, k))
            });
            sum_bonds(&constants.cut[l], at, &mut cut, |k| layer(i64::from(k)).map(|k| (l, k)));
        }
        let (within, cut) = (symmetric(&within), symmetric(&cut));
        for l in 0..m {
            for k in 0..m {
                for c in 0..3 {
                    for d in 0..3 {
                        let sign = if (c == 2) == (d == 2) { 1.0 } else { -1.0 };
                        surface[(3 * l + c, 3 * k + d)] = sign * cut[(3 * (m - 1 - l) + c, 3 * (m - 1 - k) + d)];
                    }
                }
            }
        }
        LayerGroups { wave, reach: m, within, to_below, cut, surface }
    }

    /// Change of the matrix of a group by the elimination of `below`, the matrix of the next group.
    fn eliminated(&self, below: DMatrix<f64>, to_below: &DMatrix<f64>) -> Result<DMatrix<f64>> {
        Ok(symmetric(&(-(to_below * self.factor(below)?.solve(&to_below.transpose())))))
    }

    /// The Cholesky factor of a matrix of this crystal.
    ///
    /// # Errors
    /// `Input` where it is not positive definite: an unstable crystal.
    pub(super) fn factor(&self, matrix: DMatrix<f64>) -> Result<Cholesky<f64, Dyn>> {
        matrix.cholesky().ok_or_else(|| {
            let found = format!("not positive definite at the wave ({}, {})", self.wave.0, self.wave.1);
            Error::input("crystal", "force constants", found, "those of a stable crystal")
        })
    }

    /// What `missing` layers down to a rigid plane add to the matrix of the lowest group of a crystal.
    ///
    /// # Errors
    /// `Input` for an unstable crystal.
    pub(super) fn below(&self, missing: usize) -> Result<DMatrix<f64>> {
        let (m, size) = (self.reach, 3 * self.reach);
        let mut s = DMatrix::zeros(size, size);
        let rest = 3 * (missing % m);
        if rest > 0 {
            // The lowest layers of this group belong to the rigid plane and below.
            let from = size - rest;
            let moving = self.within.view((from, from), (rest, rest)).into_owned();
            s = self.eliminated(moving, &self.to_below.columns(from, rest).into_owned())?;
        }
        for _ in 0..missing / m {
            let next = self.eliminated(&self.within + &s, &self.to_below)?;
            let change = (&next - &s).amax();
            s = next;
            if change <= CONDENSED * s.amax() {
                break;
            }
        }
        Ok(s)
    }

    /// What `missing` layers add to the lowest layers of a block that is cut there.
    ///
    /// # Errors
    /// As [`LayerGroups::below`].
    pub(super) fn condensed(&self, missing: usize) -> Result<DMatrix<f64>> {
        Ok(&self.within + self.below(missing)? - &self.cut)
    }
}
