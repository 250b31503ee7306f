//! Elastic boundary of a crystal: forces on the lowest atomic layers of a shallow block from the layers missing below them.
//!
//! The missing layers respond harmonically. With the force constants `Φ(R)` of the crystal, `D_d(q) = Σ Φ(R) exp(i q·R)` over the
//! bonds to layer d; an atom couples to M layers above and below, its reach. Groups of M layers are eliminated one after another from
//! the rigid plane upwards: `S ← -V (H + S)⁻¹ Vᵀ`, where H couples the layers of a group, and V a group to the next below. The
//! boundary adds `K = H + S - C` to the cut block, where C couples the lowest M layers of a block that is cut there, and takes off the
//! forces of the cut: `f = -f_cut - K u`, the static condensation of the missing layers, exact to first order in u. Campañá and Müser
//! (Phys. Rev. B 74 (2006) 075420) derive such a boundary from thermal fluctuations; here it follows from the force constants.
//!
//! Layers of the (001) face of an fcc crystal are chequerboards on a grid of half lattice constants. Seen from an atom the
//! bonds have the symmetry of a square: a half turn makes `W D W†` with W = diag(i, i, 1) a real symmetric matrix, and mirrors reduce
//! wave vectors to one eighth of the zone. Only that is stored.

use std::f64::consts::TAU;

use nalgebra::DMatrix;
use rayon::prelude::*;
use rustfft::num_complex::Complex;

use asperity_grid::{Error, Result};
use asperity_grid::{Grid, HalfSpectrum, Transform, signed_mode};

/// Relative change of S per group below which further groups change nothing. The longest
/// wave decays by exp(-2 q 2 a0) per group of four layers, on 175 cells 0.87: the remainder is below 1e-12.
const CONDENSED: f64 = 1e-13;

/// Force constants between an atom and one other, eV/Å²: second derivatives of the energy.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Bond {
    /// Layer of the other atom: relative to the atom's in the crystal, counted from the lowest in a cut block.
    pub layer: i32,
    /// In-plane offset, half lattice constants.
    pub dx: i32,
    pub dy: i32,
    pub phi: [[f64; 3]; 3],
}

/// Force constants of a crystal and of a block that is cut at a (001) plane.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LatticeConstants {
    /// Layers above and below an atom to which it is coupled.
    pub reach: usize,
    /// Bonds of an atom of the crystal, its own included.
    pub bulk: Vec<Bond>,
    /// Bonds of an atom in each of the lowest `reach` layers of the cut block to atoms of these layers.
    pub cut: Vec<Vec<Bond>>,
    /// Normal force on an atom of each of these layers in the cut block with all atoms at crystal sites, eV/Å.
    pub cut_force: Vec<f64>,
}

impl LatticeConstants {
    /// `Σ weights[k] sets[k]`: interpolation between states of strain. The sets must come from one crystal.
    #[must_use]
    pub fn combination(sets: &[&LatticeConstants], weights: &[f64]) -> LatticeConstants {
        let mut sum = sets[0].clone();
        let blend = |get: &dyn Fn(&LatticeConstants) -> f64| sets.iter().zip(weights).map(|(s, w)| w * get(s)).sum();
        let bond = |b: &mut Bond, get: &dyn Fn(&LatticeConstants) -> Bond| {
            for (i, row) in b.phi.iter_mut().enumerate() {
                row.iter_mut().enumerate().for_each(|(j, p)| *p = blend(&|s| get(s).phi[i][j]));
            }
        };
        sum.bulk.iter_mut().enumerate().for_each(|(k, b)| bond(b, &|s| s.bulk[k]));
        for (l, list) in sum.cut.iter_mut().enumerate() {
            list.iter_mut().enumerate().for_each(|(k, b)| bond(b, &|s| s.cut[l][k]));
        }
        sum.cut_force.iter_mut().enumerate().for_each(|(l, f)| *f = blend(&|s| s.cut_force[l]));
        sum
    }
}

/// Boundary of a periodic block of `cells` × `cells` lattice constants.
pub struct LatticeBoundary {
    cells: usize,
    reach: usize,
    cut_force: Vec<f64>,
    /// `W K W†` of the wave vectors 0 ≤ b ≤ a ≤ cells, by rows of a; symmetric matrices of `size` by rows.
    stiffness: Vec<f64>,
    transform: Transform<f64>,
    spectra: Vec<HalfSpectrum<f64>>,
}

impl LatticeBoundary {
    /// `missing`: layers between the block and a rigid plane of the crystal.
    ///
    /// # Errors
    /// `Input` for force constants of which the condensation does not exist: an unstable crystal.
    pub fn new(cells: usize, missing: usize, constants: &LatticeConstants) -> Result<Self> {
        let size = 3 * constants.reach;
        let waves: Vec<(usize, usize)> = (0..=cells).flat_map(|a| (0..=a).map(move |b| (a, b))).collect();
        let mut stiffness = vec![0.0; waves.len() * size * size];
        stiffness.par_chunks_mut(size * size).zip(&waves).try_for_each(|(to, &wave)| {
            let k = condensed(constants, cells, wave, missing)?;
            to.copy_from_slice(k.as_slice());
            Ok::<(), Error>(())
        })?;
        let transform = Transform::new(Grid::unit(2 * cells, 2 * cells));
        let spectra = (0..size).map(|_| transform.spectrum()).collect();
        Ok(LatticeBoundary {
            cells,
            reach: constants.reach,
            cut_force: constants.cut_force.clone(),
            stiffness,
            transform,
            spectra,
        })
    }

    /// Bytes of the boundary and of its displacements.
    pub fn bytes(cells: usize, reach: usize) -> u64 {
        let (n, size) = (cells as u64, 3 * reach as u64);
        8 * size * (size * (n + 1) * (n + 2) / 2 + 4 * n * n)
            + size * Transform::<f64>::spectrum_bytes(Grid::unit(2 * cells, 2 * cells))
    }

    /// Layers with forces.
    pub fn reach(&self) -> usize {
        self.reach
    }

    /// Replaces the displacements of the lowest layers by the forces of the boundary and returns its energy, eV. `fields`: component c of
    /// layer l (from the lowest) is field 3 l + c, on a grid of half lattice constants by rows of constant y, zero where no site is;
    /// Å, then eV/Å. Forces off the sites are meaningless.
    pub fn forces(&mut self, fields: &mut [Vec<f64>]) -> f64 {
        let (across, size) = (2 * self.cells, 3 * self.reach);
        let points = (across * across) as f64;
        let previous: f64 = (0..self.reach).map(|l| self.cut_force[l] * fields[3 * l + 2].iter().sum::<f64>()).sum();
        for (field, spectrum) in fields.iter().zip(&mut self.spectra) {
            self.transform.forward(field, spectrum);
        }
        let (grid, mut twice) = (self.transform.grid(), 0.0);
        let (mut u, mut f) = (vec![Complex::default(); size], vec![Complex::default(); size]);
        for j in 0..across {
            let ky = signed_mode(j, across);
            for i in 0..grid.half() {
                let index = j * grid.pitch() + i;
                let wave = Symmetry::of(i, ky);
                self.spectra.iter().zip(&mut u).for_each(|(s, u)| *u = s[index]);
                u.chunks_exact_mut(3).for_each(|v| wave.reduce(v));
                let first = (wave.a * (wave.a + 1) / 2 + wave.b) * size * size;
                let matrix = &self.stiffness[first..first + size * size];
                for (f, row) in f.iter_mut().zip(matrix.chunks_exact(size)) {
                    *f = row.iter().zip(&u).fold(Complex::default(), |sum, (k, u)| sum + *u * *k);
                }
                let work: f64 = u.iter().zip(&f).map(|(u, f)| (u.conj() * f).re).sum();
                twice += grid.column_weight(i) * work;
                f.chunks_exact_mut(3).for_each(|v| wave.restore(v));
                self.spectra.iter_mut().zip(&f).for_each(|(s, f)| s[index] = -*f / points);
            }
        }
        for (k, (field, spectrum)) in fields.iter_mut().zip(&mut self.spectra).enumerate() {
            self.transform.inverse(spectrum, field);
            if k % 3 == 2 {
                let push = self.cut_force[k / 3];
                field.iter_mut().for_each(|f| *f -= push);
            }
        }
        previous + 0.5 * twice / points
    }
}

/// The mirrors that take a wave vector into the stored part of the zone, 0 ≤ b ≤ a.
struct Symmetry {
    a: usize,
    b: usize,
    mirrored: bool,
    swapped: bool,
}

impl Symmetry {
    fn of(kx: usize, ky: i64) -> Self {
        let (x, y) = (kx, ky.unsigned_abs() as usize);
        Symmetry { a: x.max(y), b: x.min(y), mirrored: ky < 0, swapped: y > x }
    }

    /// Amplitude of the wave (x, y, z) to that of the stored one, multiplied by W.
    fn reduce(&self, v: &mut [Complex<f64>]) {
        if self.mirrored {
            v[1] = -v[1];
        }
        if self.swapped {
            v.swap(0, 1);
        }
        v[0] *= Complex::i();
        v[1] *= Complex::i();
    }

    fn restore(&self, v: &mut [Complex<f64>]) {
        v[0] *= -Complex::i();
        v[1] *= -Complex::i();
        if self.swapped {
            v.swap(0, 1);
        }
        if self.mirrored {
            v[1] = -v[1];
        }
    }
}

/// Sums bonds into the 3×3 blocks of `matrix` (`W D W†`): the block of a bond is chosen by `place`.
fn sum_bonds(
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

/// `W K W†` at the wave vector (a, b)/cells, in units of 2π over the lattice constant.
fn condensed(constants: &LatticeConstants, cells: usize, wave: (usize, usize), missing: usize) -> Result<DMatrix<f64>> {
    let m = constants.reach;
    let size = 3 * m;
    let (mut h, mut v) = (DMatrix::zeros(size, size), DMatrix::zeros(size, size));
    let mut c = DMatrix::zeros(size, size);
    let layer = |k: i64| usize::try_from(k).ok().filter(|k| *k < m);
    for l in 0..m {
        let on_wave = (cells, wave);
        sum_bonds(&constants.bulk, on_wave, &mut h, |d| layer(l as i64 + i64::from(d)).map(|k| (l, k)));
        sum_bonds(&constants.bulk, on_wave, &mut v, |d| layer(l as i64 + i64::from(d) + m as i64).map(|k| (l, k)));
        sum_bonds(&constants.cut[l], on_wave, &mut c, |k| layer(i64::from(k)).map(|k| (l, k)));
    }
    // Central differences leave an asymmetry of rounding.
    let symmetric = |x: &DMatrix<f64>| 0.5 * (x + x.transpose());
    let (h, c) = (symmetric(&h), symmetric(&c));
    let mut s = DMatrix::zeros(size, size);
    let over = |h: DMatrix<f64>, v: &DMatrix<f64>| -> Result<DMatrix<f64>> {
        let inverse = h.cholesky().ok_or_else(|| {
            let found = format!("not positive definite at the wave ({}, {})", wave.0, wave.1);
            Error::input("elastic boundary", "force constants", found, "those of a stable crystal")
        })?;
        Ok(symmetric(&(-(v * inverse.solve(&v.transpose())))))
    };
    let rest = 3 * (missing % m);
    if rest > 0 {
        // The lowest layers of this group belong to the rigid plane and below.
        let from = size - rest;
        s = over(h.view((from, from), (rest, rest)).into_owned(), &v.columns(from, rest).into_owned())?;
    }
    for _ in 0..missing / m {
        let next = over(&h + &s, &v)?;
        let change = (&next - &s).amax();
        s = next;
        if change <= CONDENSED * s.amax() {
            break;
        }
    }
    Ok(h + s - c)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interface::Cubic;
    use nalgebra::DVector;

    /// Stiffness of the springs between first and second neighbours, eV/Å², and the lattice constant, Å.
    const SPRINGS: [f64; 2] = [1.3, 0.4];
    const A0: f64 = 4.0;
    /// Rounding of a dense solution with a few hundred unknowns.
    const ROUNDING: f64 = 1e-11;

    /// Offsets (x, y, layer) of the neighbours with springs, half lattice constants.
    fn neighbours() -> Vec<([i32; 3], f64)> {
        let mut list = Vec::new();
        for axis in 0..3 {
            for s in [-1, 1] {
                let mut second = [0; 3];
                second[axis] = 2 * s;
                list.push((second, SPRINGS[1]));
                for t in [-1, 1] {
                    let mut first = [s; 3];
                    (first[axis], first[(axis + 1) % 3]) = (0, t);
                    list.push((first, SPRINGS[0]));
                }
            }
        }
        list
    }

    fn spring([x, y, z]: [i32; 3], k: f64) -> [[f64; 3]; 3] {
        let r = [x, y, z].map(f64::from);
        let r2: f64 = r.iter().map(|c| c * c).sum();
        std::array::from_fn(|i| std::array::from_fn(|j| -k * r[i] * r[j] / r2))
    }

    /// Bonds of an atom whose neighbours exist in layers for which `exists` holds (relative to the atom).
    fn bonds(exists: impl Fn(i32) -> bool) -> Vec<Bond> {
        let mut own = [[0.0; 3]; 3];
        let mut list = Vec::new();
        for (r, k) in neighbours().into_iter().filter(|(r, _)| exists(r[2])) {
            let phi = spring(r, k);
            own.iter_mut().flatten().zip(phi.iter().flatten()).for_each(|(o, p)| *o -= p);
            list.push(Bond { layer: r[2], dx: r[0], dy: r[1], phi });
        }
        list.push(Bond { layer: 0, dx: 0, dy: 0, phi: own });
        list
    }

    fn crystal() -> LatticeConstants {
        let cut = |l: i32| {
            let moved = bonds(|d| l + d >= 0).into_iter().map(|b| Bond { layer: l + b.layer, ..b });
            moved.filter(|b| b.layer < 2).collect()
        };
        LatticeConstants { reach: 2, bulk: bonds(|_| true), cut: vec![cut(0), cut(1)], cut_force: vec![0.0; 2] }
    }

    /// Sites of a layer on the grid of half lattice constants: (x, y).
    fn sites(cells: usize, layer: usize) -> Vec<[i32; 2]> {
        let across = 2 * cells as i32;
        let all = (0..across).flat_map(|y| (0..across).map(move |x| [x, y]));
        all.filter(|[x, y]| (x + y + layer as i32) % 2 == 0).collect()
    }

    /// Deterministic displacements between -1 and 1 at the sites of the lowest two layers.
    fn displaced(cells: usize) -> Vec<Vec<f64>> {
        let across = 2 * cells;
        let mut fields = vec![vec![0.0; across * across]; 6];
        for l in 0..2 {
            for [x, y] in sites(cells, l) {
                for c in 0..3 {
                    let k = (y as usize) * across + x as usize;
                    fields[3 * l + c][k] = (0.7 + 12.9898 * (k + 57 * c + 131 * l) as f64).sin();
                }
            }
        }
        fields
    }

    /// Forces on the lowest two layers from springs to `missing` further layers on a rigid plane, which are at rest: a dense solution in
    /// real space. Layers of the block keep their parity.
    fn direct(cells: usize, missing: usize, fields: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let across = 2 * cells as i32;
        let below = |l: i32| missing as i32 + l; // layers are counted from the rigid plane, which is -1
        let index: Vec<[i32; 3]> = (0..missing as i32)
            .flat_map(|l| {
                sites(cells, (l - missing as i32).rem_euclid(2) as usize).into_iter().map(move |[x, y]| [x, y, l])
            })
            .collect();
        let number = |r: [i32; 3]| index.iter().position(|s| *s == r).expect("a site");
        let wrap = |s: [i32; 3], r: [i32; 3]| {
            [(s[0] + r[0]).rem_euclid(across), (s[1] + r[1]).rem_euclid(across), s[2] + r[2]]
        };
        let moved = |s: [i32; 3]| -> [f64; 3] {
            let k = (s[1] * across + s[0]) as usize;
            std::array::from_fn(|c| fields[3 * (s[2] - below(0)) as usize + c][k])
        };
        let dof = 3 * index.len();
        let (mut k, mut f) = (DMatrix::zeros(dof, dof), DVector::zeros(dof));
        for (a, &s) in index.iter().enumerate() {
            for (r, spring_constant) in neighbours() {
                let (t, phi) = (wrap(s, r), spring(r, spring_constant));
                for i in 0..3 {
                    for j in 0..3 {
                        k[(3 * a + i, 3 * a + j)] -= phi[i][j];
                        if (0..missing as i32).contains(&t[2]) {
                            k[(3 * a + i, 3 * number(t) + j)] += phi[i][j];
                        } else if t[2] >= below(0) && t[2] < below(2) {
                            f[3 * a + i] -= phi[i][j] * moved(t)[j];
                        }
                    }
                }
            }
        }
        let u = if dof > 0 { k.lu().solve(&f).expect("regular") } else { f };
        let mut forces = vec![vec![0.0; fields[0].len()]; 6];
        for l in 0..2 {
            for [x, y] in sites(cells, l) {
                let s = [x, y, below(l as i32)];
                for (r, spring_constant) in neighbours().into_iter().filter(|(r, _)| l as i32 + r[2] < 0) {
                    let (t, phi) = (wrap(s, r), spring(r, spring_constant));
                    let other: [f64; 3] =
                        if t[2] >= 0 { std::array::from_fn(|j| u[3 * number(t) + j]) } else { [0.0; 3] };
                    for i in 0..3 {
                        let pull: f64 = (0..3).map(|j| -phi[i][j] * (other[j] - moved(s)[j])).sum();
                        forces[3 * l + i][(y * across + x) as usize] += pull;
                    }
                }
            }
        }
        forces
    }

    #[test]
    fn forces_equal_those_of_the_missing_layers() {
        let cells = 3;
        for missing in [0, 1, 2, 3, 4, 7] {
            let mut fields = displaced(cells);
            let exact = direct(cells, missing, &fields);
            let u = fields.clone();
            let energy = LatticeBoundary::new(cells, missing, &crystal()).expect("stable").forces(&mut fields);
            let mut work = 0.0;
            for l in 0..2 {
                for [x, y] in sites(cells, l) {
                    let k = y as usize * 2 * cells + x as usize;
                    for c in 3 * l..3 * l + 3 {
                        let difference = (fields[c][k] - exact[c][k]).abs();
                        assert!(difference < ROUNDING, "{missing} layers: {} instead of {}", fields[c][k], exact[c][k]);
                        work -= 0.5 * exact[c][k] * u[c][k];
                    }
                }
            }
            assert!((energy / work - 1.0).abs() < ROUNDING, "{missing} layers: {energy} instead of {work}");
        }
    }

    /// Compliance of the surface of an eight-layer block on a half-space under a pressure wave along x, over that of elasticity.
    fn compliance(cells: usize) -> f64 {
        let (m, size) = (2, 6);
        let constants = crystal();
        let k = condensed(&constants, cells, (1, 0), 40 * cells).expect("stable");
        let layers = 8;
        let mut block = DMatrix::zeros(3 * layers, 3 * layers);
        for l in 0..layers as i32 {
            let inside = |d: &i32| (0..layers as i32).contains(&(l + *d));
            let list: Vec<Bond> = bonds(|d| inside(&d));
            sum_bonds(&list, (cells, (1, 0)), &mut block, |d| Some((l as usize, (l + d) as usize)));
        }
        let mut part = block.view_mut((0, 0), (size, size));
        part += k;
        assert_eq!(constants.reach, m);
        let mut force = DVector::zeros(3 * layers);
        force[3 * layers - 1] = 1.0;
        let u = block.lu().solve(&force).expect("regular")[3 * layers - 1];
        let (k1, k2) = (SPRINGS[0], SPRINGS[1]);
        let crystal = Cubic::new((2.0 * k1 + 4.0 * k2) / A0, k1 / A0, k1 / A0).expect("stable");
        let (q, area) = (TAU / (cells as f64 * A0), 0.5 * A0 * A0);
        u / (2.0 / (crystal.directional_modulus(0.0) * q) / area)
    }

    /// Long waves respond as the cubic half-space; the error of a surface of atoms is of first order in q, and of second at short waves.
    #[test]
    fn long_waves_approach_the_elastic_half_space() {
        let errors: Vec<f64> = [128, 256, 512].map(|n| compliance(n) - 1.0).to_vec();
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!((0.85..1.15).contains(&order), "{errors:?}");
        }
        assert!(errors[2].abs() < 2e-4, "{errors:?}");
    }

    #[test]
    fn forces_are_the_slope_of_the_energy_with_a_cut_under_pressure() {
        let constants = LatticeConstants { cut_force: vec![0.3, -0.1], ..crystal() };
        let mut boundary = LatticeBoundary::new(3, 5, &constants).expect("stable");
        let start = displaced(3);
        let mut forces = start.clone();
        boundary.forces(&mut forces);
        let step = 1e-4;
        for (field, site) in [(0, 0), (2, 14), (4, 3), (5, 1)] {
            let mut energy = |by: f64| {
                let mut fields = start.clone();
                fields[field][site] += by;
                boundary.forces(&mut fields)
            };
            let slope = -(energy(step) - energy(-step)) / (2.0 * step);
            // The energy is quadratic, so that only rounding is left.
            assert!((slope - forces[field][site]).abs() < 1e-9, "{slope} instead of {}", forces[field][site]);
        }
    }

    #[test]
    fn planned_memory_counts_matrices_fields_and_spectra() {
        let boundary = LatticeBoundary::new(3, 2, &crystal()).expect("stable");
        let fields: usize = displaced(3).iter().map(Vec::len).sum();
        let spectra = 6 * Transform::<f64>::spectrum_bytes(Grid::unit(6, 6));
        assert_eq!(LatticeBoundary::bytes(3, 2), 8 * (boundary.stiffness.len() + fields) as u64 + spectra);
    }

    /// A quarter of a crystal and three quarters of one that is twice as stiff.
    #[test]
    fn combinations_weigh_every_constant() {
        /// Rounding of sums of some eV/Å².
        const SUMS: f64 = 1e-13;
        let one = LatticeConstants { cut_force: vec![0.4, -0.8], ..crystal() };
        let mut two = one.clone();
        let stiffer =
            |list: &mut Vec<Bond>| list.iter_mut().flat_map(|b| b.phi.as_flattened_mut()).for_each(|p| *p *= 2.0);
        stiffer(&mut two.bulk);
        two.cut.iter_mut().for_each(stiffer);
        two.cut_force.iter_mut().for_each(|f| *f *= 2.0);
        let sum = LatticeConstants::combination(&[&one, &two], &[0.25, 0.75]);
        let values = |c: &LatticeConstants| -> Vec<f64> {
            let bonds = c.bulk.iter().chain(c.cut.iter().flatten()).flat_map(|b| b.phi.as_flattened().to_vec());
            bonds.chain(c.cut_force.iter().copied()).collect()
        };
        for (actual, one) in values(&sum).iter().zip(values(&one)) {
            assert!((actual - 1.75 * one).abs() < SUMS, "{actual} {one}");
        }
    }

    #[test]
    fn an_unstable_crystal_is_refused() {
        let mut constants = crystal();
        constants.bulk.iter_mut().for_each(|b| b.phi.iter_mut().flatten().for_each(|p| *p = -*p));
        let message = LatticeBoundary::new(3, 4, &constants).err().expect("unstable").to_string();
        assert!(message.contains("not positive definite"), "{message}");
    }
}
