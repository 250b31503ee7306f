//! Harmonic crystal of a block with a free surface: displacements under given forces, exact for the force constants of the crystal.
//!
//! The block's layers are coupled over the reach of an atom, so that at each wave vector the dynamical matrix is block-tridiagonal in
//! groups of that many layers. The groups are eliminated from the base upwards, `S_g = D_gg - V S_{g-1}⁻¹ Vᵀ`, and the displacements
//! follow downwards. The base is rigid, or a crystal ([`LayerBase`]).
//!
//! Sites of a layer are a chequerboard on the grid of half lattice constants: amplitudes at q and q + (n, n) are the same apart from the sign,
//! and the zone |kx| + |ky| ≤ n has all of them. By the mirrors of the (001) face it is reduced to 0 ≤ b ≤ a, a + b ≤ n, in whose waves the
//! matrices are real ([`super::LatticeBoundary`]). The modes of one such wave, at most four, are eight real columns of one multiplication.

use nalgebra::DMatrix;
use rayon::prelude::*;
use rustfft::num_complex::Complex;

use super::lattice_constants::LatticeConstants;
use super::lattice_waves::{LayerGroups, Symmetry, symmetric};
use asperity_grid::{Grid, Real, Result, Transform, vectorised};

/// Real and imaginary parts of the modes of a wave, of which at most four are equivalent by symmetry.
pub(super) const LANES: usize = 8;

/// Relative change of a Schur complement per group from which on the groups above have the same: rounding in single precision.
const REPEATED: f64 = 1e-9;

/// Waves that one thread takes at a time in sums over fields: its part of a field stays in the cache. The parts do not depend on the number of threads.
const WAVES_OF_A_PART: usize = 32;

/// What is below the lowest moving layer of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LayerBase {
    /// Layers at rest.
    Rigid,
    /// So many moving layers, then layers at rest.
    Crystal { missing: usize },
}

/// Amplitudes of a field of three components on all sites of a block, by wave of the reduced zone, layer and component.
#[derive(Debug, Clone, PartialEq)]
pub struct Amplitudes<T> {
    rows: usize,
    lanes: Vec<[T; LANES]>,
}

impl<T: Real> Amplitudes<T> {
    /// `factor` times the field.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let factor = T::of(factor);
        Amplitudes { rows: self.rows, lanes: self.lanes.par_iter().map(|a| a.map(|a| factor * a)).collect() }
    }

    /// The field less two others.
    #[must_use]
    pub fn less(&self, other: &Self, another: &Self) -> Self {
        let lanes = self.lanes.par_iter().zip(&other.lanes).zip(&another.lanes);
        let less = |((a, b), c): ((&[T; LANES], &[T; LANES]), &[T; LANES])| std::array::from_fn(|k| a[k] - b[k] - c[k]);
        Amplitudes { rows: self.rows, lanes: lanes.map(less).collect() }
    }

    /// Adds `factors` times other fields.
    pub fn add<'a>(&mut self, factors: &[f64], others: impl Iterator<Item = &'a Amplitudes<T>>) {
        let terms: Vec<(T, &[[T; LANES]])> = factors.iter().map(|f| T::of(*f)).zip(others.map(|o| &*o.lanes)).collect();
        let part = WAVES_OF_A_PART * self.rows;
        self.lanes.par_chunks_mut(part).enumerate().for_each(|(k, to)| {
            vectorised(|| {
                for (factor, from) in &terms {
                    for (to, from) in to.iter_mut().zip(&from[k * part..]) {
                        (0..LANES).for_each(|lane| to[lane] += *factor * from[lane]);
                    }
                }
            });
        });
    }
}

/// A mode of the half spectrum on the grid of half lattice constants.
pub(super) struct Mode {
    pub(super) index: usize,
    pub(super) symmetry: Symmetry,
    /// Of its square in sums over the sites.
    weight: f64,
    /// In the sum of waves at a site.
    share: f64,
}

/// The harmonic crystal of `cells` × `cells` lattice constants.
pub struct HarmonicBlock<T: Real> {
    layers: usize,
    /// Layers of a group, and rows of the matrices of a group.
    reach: usize,
    pub(super) size: usize,
    pub(super) groups: usize,
    pub(super) waves: Vec<Vec<Mode>>,
    /// Inverse Schur complements by wave and group from the lowest.
    pub(super) inverses: Vec<T>,
    /// By wave: coupling of a group to the next below, and its transpose.
    couplings: Vec<T>,
    pub(super) transform: Transform<T>,
}

impl<T: Real> HarmonicBlock<T> {
    /// A block of `layers` moving layers on `base`.
    ///
    /// # Errors
    /// `Input` for force constants of an unstable crystal.
    pub fn new(cells: usize, layers: usize, constants: &LatticeConstants, base: LayerBase) -> Result<Self> {
        let reach = constants.reach;
        let (size, groups) = (3 * reach, layers.div_ceil(reach));
        let transform = Transform::new(Grid::unit(2 * cells, 2 * cells));
        let zone: Vec<(usize, usize)> = (0..=cells).flat_map(|a| (0..=a.min(cells - a)).map(move |b| (a, b))).collect();
        let waves = zone.iter().map(|&wave| modes(cells, wave, transform.grid())).collect();
        let mut inverses = vec![T::default(); zone.len() * groups * size * size];
        let mut couplings = vec![T::default(); zone.len() * 2 * size * size];
        let at_rest = groups * reach - layers;
        inverses
            .par_chunks_mut(groups * size * size)
            .zip(couplings.par_chunks_mut(2 * size * size))
            .zip(&zone)
            .try_for_each(|((inverses, couplings), &wave)| {
                let crystal = LayerGroups::new(constants, cells, wave);
                copy(&crystal.to_below, &mut couplings[..size * size]);
                copy(&crystal.to_below.transpose(), &mut couplings[size * size..]);
                eliminate_groups(&crystal, groups, at_rest, base, inverses)
            })?;
        Ok(HarmonicBlock { layers, reach, size, groups, waves, inverses, couplings, transform })
    }

    /// Bytes of the matrices and of the spectra of a group, and of one field of amplitudes.
    pub fn bytes(cells: usize, layers: usize, reach: usize) -> [u64; 2] {
        let waves = (0..=cells).map(|a| a.min(cells - a) as u64 + 1).sum::<u64>();
        let (size, groups) = (3 * reach as u64, layers.div_ceil(reach) as u64);
        let number = size_of::<T>() as u64;
        let spectra = size * Transform::<T>::spectrum_bytes(Grid::unit(2 * cells, 2 * cells));
        [number * waves * (groups + 2) * size * size + spectra, number * waves * groups * size * LANES as u64]
    }

    /// Layers that move.
    pub fn layers(&self) -> usize {
        self.layers
    }

    /// Layers to which an atom is coupled, above and below.
    pub fn reach(&self) -> usize {
        self.reach
    }

    fn rows(&self) -> usize {
        self.groups * self.size
    }

    /// Layers of the lowest group that are below the block: their amplitudes are zero.
    fn padding(&self) -> usize {
        self.groups * self.reach - self.layers
    }

    /// A field that is zero.
    fn zero(&self) -> Amplitudes<T> {
        Amplitudes { rows: self.rows(), lanes: vec![[T::default(); LANES]; self.waves.len() * self.rows()] }
    }

    /// The amplitudes of a field: `fill` writes a component (x, y, z) of a layer (from the lowest) to the grid of half lattice constants
    /// by rows of constant y, on which it finds zeros. `layers`: those that are not zero.
    pub fn analyse(
        &self,
        layers: std::ops::Range<usize>,
        fill: impl Fn(usize, usize, &mut [T]) + Sync,
    ) -> Amplitudes<T> {
        let grid = self.transform.grid();
        let (rows, padding) = (self.rows(), self.padding());
        let mut to = self.zero();
        let mut spectra: Vec<_> = (0..self.size).map(|_| self.transform.spectrum()).collect();
        for first in layers.clone().step_by(self.reach) {
            let some = first..(first + self.reach).min(layers.end);
            let fields = 3 * some.len();
            spectra[..fields].par_iter_mut().enumerate().for_each_init(
                || vec![T::default(); grid.points()],
                |field, (k, spectrum)| {
                    field.fill(T::default());
                    fill(some.start + k / 3, k % 3, field);
                    self.transform.forward(field, spectrum);
                },
            );
            to.lanes.par_chunks_mut(rows).zip(&self.waves).for_each(|(lanes, modes)| {
                for (k, mode) in modes.iter().enumerate() {
                    for l in 0..fields / 3 {
                        let mut v: [Complex<T>; 3] = std::array::from_fn(|c| spectra[3 * l + c][mode.index]);
                        mode.symmetry.reduce(&mut v);
                        let row = 3 * (padding + some.start + l);
                        for (lanes, v) in lanes[row..].iter_mut().zip(v) {
                            (lanes[2 * k], lanes[2 * k + 1]) = (v.re, v.im);
                        }
                    }
                }
            });
        }
        to
    }

    /// The field of amplitudes: `read` gets each component of the layers on the grid of half lattice constants, of which the values off
    /// the sites are meaningless.
    pub fn synthesise<R: Send>(
        &self,
        from: &Amplitudes<T>,
        layers: std::ops::Range<usize>,
        read: impl Fn(usize, usize, &[T]) -> R + Sync,
    ) -> Vec<R> {
        let (rows, padding, start) = (self.rows(), self.padding(), 3 * layers.start);
        let fields = start..3 * layers.end;
        let work = || (self.transform.spectrum(), vec![T::default(); self.transform.grid().points()]);
        fields
            .into_par_iter()
            .map_init(work, |(spectrum, field), k| {
                self.fill_spectrum(&from.lanes, rows, 3 * padding + k, spectrum);
                self.transform.inverse(spectrum, field);
                read(k / 3, k % 3, field)
            })
            .collect()
    }

    /// The half spectrum of one component of a layer: row `k` of the `rows` of each wave.
    pub(super) fn fill_spectrum(&self, lanes: &[[T; LANES]], rows: usize, k: usize, spectrum: &mut [Complex<T>]) {
        let (first, component) = (k - k % 3, k % 3);
        spectrum.fill(Complex::default());
        for (lanes, modes) in lanes.chunks(rows).zip(&self.waves) {
            let row = &lanes[first..first + 3];
            for (m, mode) in modes.iter().enumerate() {
                let mut v: [Complex<T>; 3] = std::array::from_fn(|c| Complex::new(row[c][2 * m], row[c][2 * m + 1]));
                mode.symmetry.restore(&mut v);
                spectrum[mode.index] = v[component] * T::of(mode.share);
            }
        }
    }

    /// Sums over all sites of the products of some fields with another one.
    pub fn products<'a>(&self, fields: impl Iterator<Item = &'a Amplitudes<T>>, with: &Amplitudes<T>) -> Vec<f64> {
        let fields: Vec<&[[T; LANES]]> = fields.map(|f| &*f.lanes).collect();
        let rows = self.rows();
        let of_part = |part: usize| -> Vec<f64> {
            let waves = part * WAVES_OF_A_PART..self.waves.len().min((part + 1) * WAVES_OF_A_PART);
            let of_wave = |field: &[[T; LANES]], wave: usize| {
                let mut sums = [0.0; LANES];
                vectorised(|| {
                    let product = |(a, b): (&[T; LANES], &[T; LANES])| {
                        (0..LANES).for_each(|lane| sums[lane] += (a[lane] * b[lane]).wide());
                    };
                    field[wave * rows..][..rows].iter().zip(&with.lanes[wave * rows..][..rows]).for_each(product);
                });
                self.weighted(wave, &sums)
            };
            fields.iter().map(|field| waves.clone().map(|wave| of_wave(field, wave)).sum()).collect()
        };
        let parts = 0..self.waves.len().div_ceil(WAVES_OF_A_PART);
        let parts: Vec<Vec<f64>> = parts.into_par_iter().map(of_part).collect();
        (0..fields.len()).map(|k| parts.iter().map(|part| part[k]).sum()).collect()
    }

    /// Sum over the sites from the sums of the lanes of a wave.
    fn weighted(&self, wave: usize, sums: &[f64; LANES]) -> f64 {
        self.waves[wave].iter().enumerate().map(|(k, mode)| mode.weight * (sums[2 * k] + sums[2 * k + 1])).sum()
    }

    /// First half of a solution: forces to the right-hand sides of the groups, from the lowest upwards. Returns the energy that the crystal
    /// has under these forces.
    pub fn eliminate(&self, forces: &mut Amplitudes<T>) -> f64 {
        let (rows, size) = (self.rows(), self.size);
        let square = size * size;
        let one = |(wave, lanes): (usize, &mut [[T; LANES]])| {
            let inverses = &self.inverses[wave * self.groups * square..][..self.groups * square];
            let to_below = &self.couplings[2 * wave * square..][..square];
            let mut sums = [0.0; LANES];
            vectorised(|| {
                let mut solved = vec![[T::default(); LANES]; size];
                for g in 0..self.groups {
                    let group = &mut lanes[g * size..][..size];
                    if g > 0 {
                        multiply_add(to_below, &solved, -T::one(), group);
                    }
                    solved.fill([T::default(); LANES]);
                    multiply_add(&inverses[g * square..][..square], group, T::one(), &mut solved);
                    for (a, b) in group.iter().zip(&solved) {
                        (0..LANES).for_each(|lane| sums[lane] += (a[lane] * b[lane]).wide());
                    }
                }
            });
            0.5 * self.weighted(wave, &sums)
        };
        forces.lanes.par_chunks_mut(rows).enumerate().map(one).collect::<Vec<f64>>().iter().sum()
    }

    /// Second half: the displacements from the right-hand sides of the groups, in their place.
    pub fn substitute(&self, fields: &mut Amplitudes<T>) {
        let (rows, size) = (self.rows(), self.size);
        let square = size * size;
        fields.lanes.par_chunks_mut(rows).enumerate().for_each(|(wave, lanes)| {
            let inverses = &self.inverses[wave * self.groups * square..][..self.groups * square];
            let to_above = &self.couplings[(2 * wave + 1) * square..][..square];
            vectorised(|| {
                let mut solved = vec![[T::default(); LANES]; size];
                for g in (0..self.groups).rev() {
                    let group = &mut lanes[g * size..][..size];
                    if g + 1 < self.groups {
                        multiply_add(to_above, &solved, -T::one(), group);
                    }
                    solved.fill([T::default(); LANES]);
                    multiply_add(&inverses[g * square..][..square], group, T::one(), &mut solved);
                    group.copy_from_slice(&solved);
                }
            });
        });
    }
}

/// Inverse Schur complements of all groups, of which the lowest has `at_rest` layers below the block.
fn eliminate_groups<T: Real>(
    crystal: &LayerGroups,
    groups: usize,
    at_rest: usize,
    base: LayerBase,
    inverses: &mut [T],
) -> Result<()> {
    let size = crystal.within.nrows();
    // Layers of the lowest group below the block are missing layers that move, as far as there are any.
    let (mut below, at_rest): (Option<DMatrix<f64>>, usize) = match base {
        LayerBase::Rigid => (None, at_rest),
        LayerBase::Crystal { missing } if missing < at_rest => (None, at_rest - missing),
        LayerBase::Crystal { missing } => (Some(crystal.below(missing - at_rest)?), 0),
    };
    let mut repeated: Option<DMatrix<f64>> = None;
    for g in 0..groups {
        let to = &mut inverses[g * size * size..][..size * size];
        let top = g + 1 == groups;
        if let Some(inverse) = repeated.as_ref().filter(|_| !top) {
            copy(inverse, to);
            continue;
        }
        let mut matrix = if top { crystal.surface.clone() } else { crystal.within.clone() };
        if let Some(s) = &below {
            matrix += s;
        }
        // Layers that do not move have no rows and columns.
        let from = if g == 0 { 3 * at_rest } else { 0 };
        let moving = matrix.view((from, from), (size - from, size - from)).into_owned();
        let mut inverse = DMatrix::zeros(size, size);
        inverse
            .view_mut((from, from), (size - from, size - from))
            .copy_from(&symmetric(&crystal.factor(moving)?.inverse()));
        copy(&inverse, to);
        let next = symmetric(&(-(&crystal.to_below * &inverse * crystal.to_below.transpose())));
        let same = below.as_ref().is_some_and(|s| (&next - s).amax() <= REPEATED * next.amax());
        repeated = same.then_some(inverse);
        below = Some(next);
    }
    Ok(())
}

/// A matrix by rows in working precision.
fn copy<T: Real>(matrix: &DMatrix<f64>, to: &mut [T]) {
    let columns = matrix.ncols();
    to.iter_mut().enumerate().for_each(|(k, to)| *to = T::of(matrix[(k / columns, k % columns)]));
}

/// `to += factor matrix from`, the matrix by rows.
#[inline(always)]
pub(super) fn multiply_add<T: Real>(matrix: &[T], from: &[[T; LANES]], factor: T, to: &mut [[T; LANES]]) {
    for (row, to) in matrix.chunks_exact(from.len()).zip(to) {
        let mut sums = [T::default(); LANES];
        for (element, from) in row.iter().zip(from) {
            (0..LANES).for_each(|lane| sums[lane] += *element * from[lane]);
        }
        (0..LANES).for_each(|lane| to[lane] += factor * sums[lane]);
    }
}

/// The modes of the half spectrum that the mirrors take into a wave of the reduced zone.
fn modes(cells: usize, (a, b): (usize, usize), grid: Grid) -> Vec<Mode> {
    let n = cells as i64;
    let (a, b) = (a as i64, b as i64);
    let mut list: Vec<(i64, i64)> = vec![(a, b), (a, -b), (b, a), (b, -a)];
    // Modes -n and n of an axis are the same.
    list.iter_mut().for_each(|(_, y)| *y = if *y == -n { n } else { *y });
    list.sort_unstable();
    list.dedup();
    let points = grid.points() as f64;
    let mode = |(x, y): (i64, i64)| {
        // Modes on the edge of the zone are there twice, at q and at q + (n, n).
        let twice = if x + y.abs() == n { 1.0 } else { 2.0 };
        Mode {
            index: y.rem_euclid(2 * n) as usize * grid.pitch() + x as usize,
            symmetry: Symmetry::of(x as usize, y),
            weight: twice * grid.column_weight(x as usize) / points,
            share: twice / points,
        }
    };
    list.into_iter().map(mode).collect()
}

#[cfg(test)]
mod tests {
    use super::super::lattice_springs::{crystal, neighbours, sites, spring};
    use super::*;
    use nalgebra::DVector;

    /// Rounding of a dense solution with some hundred unknowns, in double precision.
    const ROUNDING: f64 = 1e-11;
    const CELLS: usize = 3;

    /// The sites (x, y, layer) of a block of moving layers; the surface layer has x + y even.
    fn block_sites(layers: usize) -> Vec<[i32; 3]> {
        let of = |l: usize| sites(CELLS, layers - 1 - l).into_iter().map(move |[x, y]| [x, y, l as i32]);
        (0..layers).flat_map(of).collect()
    }

    /// Displacements of all sites under forces, by a dense solution in real space.
    fn direct(layers: usize, forces: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let (index, across) = (block_sites(layers), 2 * CELLS as i32);
        let number = |r: [i32; 3]| index.iter().position(|s| *s == r);
        let dof = 3 * index.len();
        let mut k = DMatrix::zeros(dof, dof);
        for (a, s) in index.iter().enumerate() {
            for (r, stiffness) in neighbours() {
                let to = [(s[0] + r[0]).rem_euclid(across), (s[1] + r[1]).rem_euclid(across), s[2] + r[2]];
                if to[2] >= layers as i32 {
                    continue;
                }
                let phi = spring(r, stiffness);
                for (i, j) in (0..9).map(|m| (m / 3, m % 3)) {
                    k[(3 * a + i, 3 * a + j)] -= phi[i][j];
                    if let Some(b) = number(to) {
                        k[(3 * a + i, 3 * b + j)] += phi[i][j];
                    }
                }
            }
        }
        let u = k.lu().solve(&DVector::from_fn(dof, |m, _| forces[m / 3][m % 3])).expect("regular");
        u.as_slice().chunks(3).map(|u| [u[0], u[1], u[2]]).collect()
    }

    /// Deterministic forces between -1 and 1.
    fn forces(layers: std::ops::Range<usize>, all: usize) -> Vec<[f64; 3]> {
        let force = |(k, s): (usize, [i32; 3])| -> [f64; 3] {
            let inside = f64::from(u8::from(layers.contains(&(s[2] as usize))));
            std::array::from_fn(|c| inside * (0.7 + 12.9898 * (3 * k + c) as f64).sin())
        };
        block_sites(all).into_iter().enumerate().map(force).collect()
    }

    fn at(site: [i32; 3]) -> usize {
        site[1] as usize * 2 * CELLS + site[0] as usize
    }

    fn solved<T: Real>(block: &HarmonicBlock<T>, forces: &[[f64; 3]]) -> (Vec<[f64; 3]>, f64) {
        let index = block_sites(block.layers());
        let fill = |layer: usize, c: usize, to: &mut [T]| {
            let own = index.iter().zip(forces).filter(|(s, _)| s[2] as usize == layer);
            own.for_each(|(s, f)| to[at(*s)] = T::of(f[c]));
        };
        let mut field = block.analyse(0..block.layers(), fill);
        let start = field.clone();
        let energy = block.eliminate(&mut field);
        block.substitute(&mut field);
        assert!((0.5 * block.products(std::iter::once(&start), &field)[0] / energy - 1.0).abs() < 1e-5);
        let parts = block.synthesise(&field, 0..block.layers(), |_, _, values| values.to_vec());
        let u = index.iter().map(|s| std::array::from_fn(|c| parts[3 * s[2] as usize + c][at(*s)].wide())).collect();
        (u, energy)
    }

    /// With every number of layers, groups that are padded and one that is whole; both precisions.
    #[test]
    fn displacements_are_those_of_a_dense_solution() {
        for layers in 1..=7 {
            let f = forces(0..layers, layers);
            let exact = direct(layers, &f);
            let block = HarmonicBlock::<f64>::new(CELLS, layers, &crystal(), LayerBase::Rigid).expect("stable");
            let (u, energy) = solved(&block, &f);
            let largest = |a: &[[f64; 3]]| a.as_flattened().iter().fold(0.0f64, |m, v| m.max(v.abs()));
            let error = |u: &[[f64; 3]]| {
                u.as_flattened().iter().zip(exact.as_flattened()).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()))
            };
            assert!(error(&u) < ROUNDING * largest(&exact), "{layers} layers: {}", error(&u));
            let work: f64 = f.as_flattened().iter().zip(exact.as_flattened()).map(|(f, u)| 0.5 * f * u).sum();
            assert!((energy / work - 1.0).abs() < ROUNDING, "{layers} layers: {energy} instead of {work}");
            let single = HarmonicBlock::<f32>::new(CELLS, layers, &crystal(), LayerBase::Rigid).expect("stable");
            assert!(error(&solved(&single, &f).0) < 1e-5 * largest(&exact), "{layers} layers, single precision");
        }
    }

    /// A shallow block on missing layers is the upper part of a deep one under forces on its layers.
    #[test]
    fn missing_layers_stand_for_a_deep_block() {
        for (shallow, missing) in (3..=5).flat_map(|shallow| [0, 1, 2, 3, 6].map(|missing| (shallow, missing))) {
            let deep = shallow + missing;
            let exact = direct(deep, &forces(missing..deep, deep));
            let base = LayerBase::Crystal { missing };
            let block = HarmonicBlock::<f64>::new(CELLS, shallow, &crystal(), base).expect("stable");
            let first = block_sites(deep).iter().position(|s| s[2] as usize == missing).expect("there");
            let u = solved(&block, &forces(missing..deep, deep)[first..]).0;
            for (a, b) in u.as_flattened().iter().zip(exact[first..].as_flattened()) {
                assert!((a - b).abs() < ROUNDING, "{shallow} layers, {missing} missing: {a} instead of {b}");
            }
        }
    }

    #[test]
    fn planned_memory_counts_matrices_and_amplitudes() {
        let block = HarmonicBlock::<f32>::new(4, 7, &crystal(), LayerBase::Rigid).expect("stable");
        let spectra = 6 * Transform::<f32>::spectrum_bytes(Grid::unit(8, 8));
        let matrices = 4 * (block.inverses.len() + block.couplings.len()) as u64 + spectra;
        let field = 4 * LANES as u64 * block.zero().lanes.len() as u64;
        assert_eq!(HarmonicBlock::<f32>::bytes(4, 7, 2), [matrices, field]);
    }
}
