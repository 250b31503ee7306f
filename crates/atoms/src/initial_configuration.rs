//! Initial configurations of prescribed loads: every deformable atom is displaced by the field inside an elastic
//! layer under the pressure of the continuum solution.
//!
//! The field is evaluated one atomic layer at a time. The sites of a layer are two square lattices of `cells` ×
//! `cells`, so that six small transforms give all three components at all sites, including waves beyond the lattices'
//! Nyquist limits.

use std::f64::consts::TAU;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use rustfft::num_complex::Complex;
use serde::{Deserialize, Serialize};

use super::block::{BaseKind, Block};
use super::indenter::Indenter;
use super::job_files::Hashing;
use asperity_contact::interface::{Kernel, Layer};
use asperity_grid::{Error, Result};
use asperity_grid::{Grid, Transform, mean, signed_mode};

/// Shortest wave of the field, lattice constants: two rows of atoms. With 1.4 the number of force evaluations of a 25
/// nm block is unchanged (230); with 2 that of an 8 nm block is 69 to 81 instead of 78 to 84.
const SHORTEST_WAVE_CELLS: f64 = 1.0;

/// Mass of an indenter atom over that of a block atom. The indenter then oscillates on its contacts ten times faster
/// than the block below, and the load converges to 1e-3 in some fifty steps. With a tenth of this mass the time step
/// was too long: no convergence after 250 steps instead of 190 (25 nm, p/E* = 0.01).
pub const INDENTER_MASS: f64 = 0.01;

/// Relative tolerance of the load; contact areas are proportional to the load.
pub const LOAD_TOLERANCE: f64 = 1e-3;

/// Displacement field of an elastic layer under a surface pressure. Lengths in units of the cell, stresses in units
/// of E*.
#[derive(Debug, Clone)]
pub struct LayerDisplacementField {
    layer: Layer,
    /// Compression of the layer per unit mean pressure.
    compression: f64,
    mean: f64,
    /// One mode of each pair (k, -k).
    modes: Vec<Mode>,
}

/// One wave: mode numbers, and the amplitude of its pressure over E*.
#[derive(Debug, Clone, Copy)]
struct Mode {
    kx: i64,
    ky: i64,
    pressure: Complex<f64>,
}

/// A load with the continuum's displacement field and indenter position.
#[derive(Debug, Clone)]
pub struct InitialConfiguration {
    /// Load, eV/Å.
    pub load: f64,
    pub pressed: LayerDisplacementField,
    /// Displacement of the indenter since the start of the job, downwards, Å.
    pub displacement_angstrom: f64,
}

/// Prescribed loads of a job; part of `job.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PrescribedLoads {
    /// Height of the indenter's lowest atom in the data file, Å.
    pub indenter_zmin_angstrom: f64,
    pub indenter_mass_u: f64,
    /// Stiffness of the deformable atoms, and of an elastic base with them, under uniform compression, eV/Å².
    pub compression_stiffness_ev_per_angstrom2: f64,
    /// Displacement of the lowest layer of an elastic base over that of the surface under uniform compression.
    #[serde(default)]
    pub base_share: f64,
    /// Rising, then falling with an unloading branch.
    pub loads: Vec<PrescribedLoad>,
    /// Further loads of an earlier, longer list in the same folder, whose states may still exist.
    pub earlier: Vec<PrescribedLoad>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PrescribedLoad {
    /// Load, eV/Å.
    pub load: f64,
    /// Displacement of the indenter from the previous load, downwards, Å.
    pub dz_angstrom: f64,
    /// BLAKE3 hash of the file of displacements from the previous load.
    pub move_hash: String,
}

/// File of displacements from load `k` - 1 to load `k` (from 1).
pub fn move_file(k: usize) -> String {
    format!("move.{k}.dump")
}

impl LayerDisplacementField {
    /// The field under the pressure that corresponds to a `gap` over `heights` (both `[ny, nx]` on `grid`, units of
    /// L) at the mean pressure `pressure`; waves that the `block` cannot represent are omitted.
    pub fn under(
        block: &Block,
        (layer, compression): (Layer, f64),
        grid: Grid,
        (gap, heights): (&[f64], &[f64]),
        pressure: f64,
    ) -> Self {
        let transform = Transform::<f64>::new(grid);
        let mut spectrum = transform.spectrum();
        let lowered = mean(gap) - mean(heights);
        let fill = |y: usize, row: &mut [f64]| {
            let first = y * grid.nx;
            row.iter_mut().enumerate().for_each(|(x, u)| *u = gap[first + x] - heights[first + x] - lowered);
        };
        transform.forward_of(&fill, &mut spectrum);
        let largest_mode = block.cells as f64 / SHORTEST_WAVE_CELLS;
        let mut modes = Vec::new();
        for j in 0..grid.ny {
            let ky = signed_mode(j, grid.ny);
            for kx in 0..grid.half() as i64 {
                let first_of_pair = kx > 0 || ky > 0;
                let resolved = 2 * kx < grid.nx as i64 && 2 * ky.abs() < grid.ny as i64;
                let k = ((kx * kx + ky * ky) as f64).sqrt();
                if first_of_pair && resolved && k <= largest_mode {
                    let stiffness = layer.stiffness(TAU * kx as f64, TAU * ky as f64);
                    let displacement = spectrum[j * grid.pitch() + kx as usize] / grid.points() as f64;
                    modes.push(Mode { kx, ky, pressure: displacement * stiffness });
                }
            }
        }
        LayerDisplacementField { layer, compression, mean: pressure, modes }
    }

    /// The difference from `previous`, a field on the same grid and block.
    pub fn since(&self, previous: &LayerDisplacementField) -> LayerDisplacementField {
        let modes = self.modes.iter().zip(&previous.modes);
        LayerDisplacementField {
            mean: self.mean - previous.mean,
            modes: modes.map(|(a, b)| Mode { pressure: a.pressure - b.pressure, ..*a }).collect(),
            ..*self
        }
    }

    /// Mean displacement of the surface, downwards, units of L.
    pub fn compressed(&self) -> f64 {
        self.mean * self.compression
    }

    /// Displacements of the atoms of a layer of the block in the order of their ids, Å.
    ///
    /// # Errors
    /// `Input` for a layer that is not bonded to its base.
    fn of_layer(&self, block: &Block, index: usize, transform: &Transform<f64>) -> Result<Vec<[f64; 3]>> {
        let (n, length) = (block.cells, block.length());
        let z = block.height_of(index) / length;
        let even = -self.mean * self.compression * z / self.layer.thickness;
        let bonded = || Error::input("block of atoms", "layer", "not bonded to its base", "a bonded layer");
        let inside = self.modes.iter().map(|m| {
            let k = ((m.kx * m.kx + m.ky * m.ky) as f64).sqrt();
            let inside = self.layer.displacement_at(TAU * k, z).ok_or_else(bonded)?;
            let aside = m.pressure * Complex::i() * inside.tangential / k;
            Ok((*m, [aside * m.kx as f64, aside * m.ky as f64, -m.pressure * inside.normal]))
        });
        let inside: Vec<(Mode, [Complex<f64>; 3])> = inside.collect::<Result<_>>()?;
        let mut moved = vec![[0.0; 3]; block.atoms_per_layer() as usize];
        let grid = transform.grid();
        let (mut spectrum, mut field) = (transform.spectrum(), vec![0.0; n * n]);
        for odd in 0..2 {
            // Rows of one parity are a square lattice with this first site.
            let [x, y] = block.lattice_xy(index, odd as i64, 0).map(|c| TAU * c / length);
            for axis in 0..3 {
                spectrum.fill(Complex::default());
                for (m, u) in &inside {
                    let value = u[axis] * Complex::from_polar(1.0, m.kx as f64 * x + m.ky as f64 * y);
                    for (kx, ky, value) in [(m.kx, m.ky, value), (-m.kx, -m.ky, value.conj())] {
                        // On the lattice, waves are aliased to the lattice's own modes.
                        let [i, j] = [kx, ky].map(|k| k.rem_euclid(n as i64) as usize);
                        if i < grid.half() {
                            spectrum[j * grid.pitch() + i] += value;
                        }
                    }
                }
                transform.inverse(&mut spectrum, &mut field);
                for (j, row) in field.chunks(n).enumerate() {
                    let first = (2 * j + odd) * n;
                    let even = if axis == 2 { even } else { 0.0 };
                    moved[first..first + n].iter_mut().zip(row).for_each(|(to, u)| to[axis] = (u + even) * length);
                }
            }
        }
        Ok(moved)
    }

    /// Writes the displacements of all deformable atoms, and of the base on a foundation, Å, as velocities of a
    /// LAMMPS dump, the format in which a script can read a vector per atom. Returns the hash of the file.
    ///
    /// # Errors
    /// `Io`.
    pub fn write_moves(&self, block: &Block, path: &Path) -> Result<String> {
        let mut file = asperity_surface::files::atomic_file::AtomicFile::open(path)?;
        let transform = Transform::new(Grid::unit(block.cells, block.cells));
        let hashing = Hashing { file: &mut file, hasher: blake3::Hasher::new() };
        let mut out = BufWriter::with_capacity(1 << 18, hashing);
        let failed = |e: io::Error| Error::io("write", path)(e);
        let length = block.length();
        let top = block.top_z();
        let lowest = if block.foundation_cells > 0 { 0 } else { block.base_layers };
        let fixed_atoms = lowest as u64 * block.atoms_per_layer();
        write!(
            out,
            "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n{}\nITEM: BOX BOUNDS pp pp ff\n0 {length}\n0 {length}\n0 {top}\n\
             ITEM: ATOMS id vx vy vz\n",
            block.atoms() - fixed_atoms
        )
        .map_err(failed)?;
        let mut id = fixed_atoms + 1;
        for index in lowest..block.layers() {
            for [x, y, z] in self.of_layer(block, index, &transform)? {
                writeln!(out, "{id} {x:.6} {y:.6} {z:.6}").map_err(failed)?;
                id += 1;
            }
        }
        let hash = out.into_inner().map_err(|e| failed(e.into_error()))?.hasher.finalize();
        file.commit()?;
        Ok(hash.to_hex().to_string())
    }
}

impl InitialConfiguration {
    /// `standoff_angstrom`: distance between the planes of indenter and surface atoms at zero gap. `offset_angstrom`:
    /// height of `heights` (units of L) above the indenter's own heights.
    pub fn new(
        block: &Block,
        indenter: &Indenter,
        (load, pressed): (f64, LayerDisplacementField),
        (gap, heights): (&[f64], &[f64]),
        (standoff_angstrom, offset_angstrom): (f64, f64),
    ) -> Self {
        let mean_rise = (mean(gap) - mean(heights) - pressed.compressed()) * block.length();
        let stands = block.top_z() + standoff_angstrom + mean_rise + offset_angstrom;
        InitialConfiguration { load, pressed, displacement_angstrom: indenter.start_z() - stands }
    }
}

impl PrescribedLoads {
    /// Writes the files of displacements, each from the previous load, into a job folder.
    ///
    /// # Errors
    /// `Io`.
    pub fn write(
        folder: &Path,
        block: &Block,
        indenter: &Indenter,
        mass_u: f64,
        list: &[InitialConfiguration],
    ) -> Result<Self> {
        let mut loads = Vec::with_capacity(list.len());
        for (k, approach) in list.iter().enumerate() {
            let previous = k.checked_sub(1).map(|b| &list[b]);
            let file = folder.join(move_file(k + 1));
            let move_hash = match previous {
                Some(b) => approach.pressed.since(&b.pressed).write_moves(block, &file)?,
                None => approach.pressed.write_moves(block, &file)?,
            };
            let dz_angstrom = approach.displacement_angstrom - previous.map_or(0.0, |b| b.displacement_angstrom);
            loads.push(PrescribedLoad { load: approach.load, dz_angstrom, move_hash });
        }
        let elastic = block.base == BaseKind::Elastic;
        let fraction = if elastic { 1.0 } else { block.deformable_thickness() / block.thickness() };
        let stiffness = |a: &InitialConfiguration| a.load / (a.pressed.compressed() * fraction * block.length());
        Ok(PrescribedLoads {
            indenter_zmin_angstrom: indenter.lowest_z(),
            indenter_mass_u: INDENTER_MASS * mass_u,
            compression_stiffness_ev_per_angstrom2: list.first().map_or(f64::MAX, stiffness),
            base_share: if elastic { block.height_of(0) / block.thickness() } else { 0.0 },
            loads,
            earlier: Vec::new(),
        })
    }

    /// Step of the highest load, from 1.
    pub fn peak(&self) -> usize {
        let highest = self.loads.iter().map(|l| l.load).fold(f64::NEG_INFINITY, f64::max);
        self.loads.iter().position(|l| l.load == highest).map_or(0, |k| k + 1)
    }

    /// Number of leading loads in common with the list of an earlier run in the same folder, whose states can be
    /// reused. If all loads are in common, the additional loads of that run are stored in `earlier`. `None` if the
    /// jobs differ otherwise.
    pub(super) fn go_on_after(&mut self, other: &PrescribedLoads) -> Option<usize> {
        let bare = |l: &PrescribedLoads| PrescribedLoads { loads: Vec::new(), earlier: Vec::new(), ..*l };
        let all: Vec<&PrescribedLoad> = other.loads.iter().chain(&other.earlier).collect();
        if bare(self) != bare(other) {
            return None;
        }
        let common = self.loads.iter().zip(&all).take_while(|(a, b)| a == *b).count();
        if common < self.loads.len() {
            return Some(common);
        }
        self.earlier = all[common..].iter().copied().cloned().collect();
        Some(all.len())
    }

    /// `-var` pairs of the script.
    pub fn variables(&self) -> Vec<(String, String)> {
        let mut list = vec![
            ("indenter_zmin".to_string(), self.indenter_zmin_angstrom.to_string()),
            ("steps".to_string(), self.loads.len().to_string()),
            ("compression_stiffness".to_string(), self.compression_stiffness_ev_per_angstrom2.to_string()),
            ("indenter_mass".to_string(), self.indenter_mass_u.to_string()),
            ("load_tol".to_string(), LOAD_TOLERANCE.to_string()),
        ];
        for (k, prescribed) in self.loads.iter().enumerate() {
            list.push((format!("load{}", k + 1), prescribed.load.to_string()));
            list.push((format!("dz{}", k + 1), prescribed.dz_angstrom.to_string()));
        }
        list
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_contact::interface::Base;

    const A0: f64 = 5.5884;

    fn block() -> Block {
        Block::new(6, 3, A0, 7.0).expect("valid")
    }

    /// A gap over a flat profile with one wave, cosine of `phase` at the origin, and the surface displacement.
    fn wave(block: &Block, (kx, ky): (f64, f64), phase: f64) -> (LayerDisplacementField, impl Fn(f64, f64) -> f64) {
        let grid = Grid::unit(24, 24);
        let value = move |x: f64, y: f64| 0.01 * (TAU * (kx * x + ky * y) + phase).cos();
        let value_at = |k: usize| value((k % 24) as f64 / 24.0, (k / 24) as f64 / 24.0);
        let gap: Vec<f64> = (0..grid.points()).map(|k| 0.2 + value_at(k)).collect();
        let layer = Layer { thickness: block.thickness() / block.length(), poisson: 0.3, base: Base::Bonded };
        (LayerDisplacementField::under(block, (layer, 0.4), grid, (&gap, &vec![0.0; grid.points()]), 0.02), value)
    }

    /// Waves longer and shorter than the two lattices of a layer represent, in any direction.
    #[test]
    fn surface_atoms_follow_the_surface_displacement_and_the_base_is_fixed() {
        let block = block();
        let transform = Transform::new(Grid::unit(6, 6));
        for (k, phase) in
            [((1.0, 0.0), 0.3), ((0.0, 2.0), 1.0), ((3.0, -4.0), 0.7), ((5.0, 1.0), 2.0), ((-2.0, 5.0), 0.1)]
        {
            let (pressed, sunk) = wave(&block, k, phase);
            let moved = pressed.of_layer(&block, block.layers() - 1, &transform).expect("bonded");
            for (index, actual) in moved.iter().enumerate() {
                let [x, y] = block.surface().xy(index).map(|c| c / block.length());
                let expected = -(sunk(x, y) + 0.02 * 0.4) * block.length();
                assert!((actual[2] - expected).abs() < 1e-10, "{k:?} {index}: {actual:?} {expected}");
            }
            let base = pressed.of_layer(&block, block.base_layers - 1, &transform).expect("bonded");
            assert!(base.iter().flatten().all(|u| u.abs() < 1e-12));
        }
    }

    /// Atoms inside the layer follow the interior field; the tangential displacement is a quarter wave ahead.
    #[test]
    fn inner_atoms_follow_the_interior_field() {
        let block = block();
        let (k, phase, index) = ((2.0, 1.0), 0.4, block.base_layers + 3);
        let (pressed, _) = wave(&block, k, phase);
        let moved = pressed.of_layer(&block, index, &Transform::new(Grid::unit(6, 6))).expect("bonded");
        let q = TAU * 5f64.sqrt();
        let z = block.height_of(index) / block.length();
        let inside = pressed.layer.displacement_at(q, z).expect("bonded");
        let top = pressed.layer.displacement_at(q, pressed.layer.thickness).expect("bonded").normal;
        let first = 1 + block.fixed() as u32 + (index - block.base_layers) as u32 * block.atoms_per_layer() as u32;
        for (rank, actual) in moved.iter().enumerate() {
            let [x, y, _] = block.site(first + rank as u32).expect("of the block").position.map(|c| c / block.length());
            let angle = TAU * (k.0 * x + k.1 * y) + phase;
            let down = 0.01 * inside.normal / top * angle.cos() + 0.02 * 0.4 * z / pressed.layer.thickness;
            let aside = -0.01 * inside.tangential / top * angle.sin();
            let expected = [aside * k.0 / 5f64.sqrt(), aside * k.1 / 5f64.sqrt(), -down].map(|u| u * block.length());
            assert!(actual.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-10), "{rank}: {actual:?} {expected:?}");
        }
    }

    /// Under the same pressure, a block of half the depth on a foundation of the other half is displaced as the upper
    /// half of the whole block, including its base.
    #[test]
    fn on_a_foundation_the_base_follows_the_field_of_the_whole_layer() {
        let whole = Block::new(6, 6, A0, 7.0).expect("valid");
        let founded = block().on_foundation(3).expect("valid");
        let transform = Transform::new(Grid::unit(6, 6));
        let displacements_of = |block: &Block, layer: usize| {
            wave(block, (2.0, -1.0), 0.7).0.of_layer(block, layer, &transform).expect("bonded")
        };
        // Six half cells: the rows of the layers are shifted alike.
        let deeper = whole.layers() - founded.layers();
        for layer in 0..founded.layers() {
            for (a, b) in displacements_of(&founded, layer).iter().zip(displacements_of(&whole, layer + deeper)) {
                assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-10), "{layer}: {a:?} {b:?}");
            }
        }
        let folder = tempfile::tempdir().expect("scratch");
        let file = folder.path().join(move_file(1));
        wave(&founded, (2.0, -1.0), 0.7).0.write_moves(&founded, &file).expect("written");
        let text = std::fs::read_to_string(&file).expect("read");
        let ids = text.lines().skip(9).map(|l| l.split(' ').next().and_then(|w| w.parse::<u64>().ok()).expect("an id"));
        assert!(ids.eq(1..=founded.atoms()));
    }

    #[test]
    fn displacements_are_written_for_every_deformable_atom_and_add_up() {
        let block = block();
        let folder = tempfile::tempdir().expect("scratch");
        let read = |pressed: &LayerDisplacementField| -> Vec<(u64, [f64; 3])> {
            let file = folder.path().join(move_file(1));
            let hash = pressed.write_moves(&block, &file).expect("written");
            let text = std::fs::read_to_string(&file).expect("read");
            assert_eq!(hash, blake3::hash(text.as_bytes()).to_hex().to_string());
            let tokens = text.lines().skip(9).map(|l| l.split(' ').map(|w| w.parse().expect("a number")).collect());
            tokens.map(|w: Vec<f64>| (w[0] as u64, [w[1], w[2], w[3]])).collect()
        };
        let (a, b) = (wave(&block, (1.0, 2.0), 0.0).0, wave(&block, (1.0, 2.0), 1.5).0);
        let (first, second, between) = (read(&a), read(&b), read(&b.since(&a)));
        assert!(first.iter().map(|f| f.0).eq(block.fixed() + 1..=block.atoms()));
        for ((f, s), d) in first.iter().zip(&second).zip(&between) {
            // Six decimals each.
            assert!((0..3).all(|c| (f.1[c] + d.1[c] - s.1[c]).abs() < 1.6e-6));
        }
    }
}
