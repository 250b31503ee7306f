//! Force constants of the crystal of a potential, measured with LAMMPS at several uniaxial strains: what the elastic base of a block is
//! made of ([`asperity_contact::interface::LatticeBoundary`]).

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::run_script::{RunScript, results};
use asperity_contact::interface::{Bond, LatticeConstants};
use asperity_grid::units::GPA_PER_EV_A3;
use asperity_grid::{Error, Result, bisect};
use asperity_surface::files::atomic_file::{put, read_text, remove};
use asperity_surface::files::hashed::file_hash;
use asperity_surface::files::user_cache::UserCache;

const SCRIPT: (&str, &str) = ("force_constants.in", include_str!("../lammps-inputs/properties/force_constants.in"));

/// Folder of the user's cache.
const CACHE: &str = "force-constants";

/// File of the force constants in a job folder.
pub const FILE: &str = "force_constants.json";

/// Displacement of the central differences, Å. With half of it the force constants of the calcium-like crystal change by 6e-6 of the
/// largest.
const STEP_ANGSTROM: f64 = 0.004;

/// Strains (compression is positive) at which constants are measured, and interpolated by cubic polynomials between four of them: denser where the loads of most
/// scenes are. They do not depend on the loads of a job, so that a list of loads that is continued has the states of a longer one.
/// The pressure of the calcium-like crystal is interpolated to 2e-4 of itself up to 0.06 and to 1e-3 above; with steps of 0.02 alone it was off by
/// 6e-3 of itself, and the indenter of a 25 nm block by 0.001 Å.
const STRAINS: [f64; 13] = [-0.02, -0.01, 0.0, 0.005, 0.01, 0.015, 0.02, 0.03, 0.04, 0.05, 0.06, 0.08, 0.1];
const NODES: usize = 4;

/// Highest pressure at the largest strain over that of a job: a ramp ends beyond its highest load.
const PRESSURE_MARGIN: f64 = 1.2;

/// Force constants below this fraction of the largest are rounding of the forces: absent bonds.
const ABSENT: f64 = 1e-9;
/// Largest asymmetry of the force constants over the largest one: the error of the central differences.
const ASYMMETRY: f64 = 1e-4;

const EV_A3_PER_BAR: f64 = 1.0 / 1.602_176_634e6;

/// Layers of the (001) face to which an atom is coupled, above and below: its neighbours' neighbours.
pub fn reach(cutoff_angstrom: f64, a0_angstrom: f64) -> usize {
    2 * ((cutoff_angstrom / (0.5 * a0_angstrom * (1.0 - STRAINS[STRAINS.len() - 1]))) as usize).max(1)
}

/// Force constants at several strains.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ForceConstants {
    strained: Vec<Strained>,
}

/// The crystal at one uniaxial compression along \[001\].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Strained {
    /// Normal pressure on (001), eV/Å³.
    pressure: f64,
    constants: LatticeConstants,
}

/// What is measured.
#[derive(Debug, Clone, Copy)]
pub struct ForceConstantInput<'a> {
    /// File name of the table within the folder of the measurement.
    pub table: &'a str,
    pub element: &'a str,
    pub a0_angstrom: f64,
    pub cutoff_angstrom: f64,
    /// Highest mean pressure on the block, eV/Å³.
    pub highest_pressure: f64,
}

impl ForceConstantInput<'_> {
    /// Everything that the measurement depends on, as a hash.
    fn key(&self, folder: &Path, lammps_version: &str) -> Result<String> {
        let numbers = [self.a0_angstrom, self.cutoff_angstrom, STEP_ANGSTROM].into_iter().chain(STRAINS);
        let numbers: Vec<String> = numbers.map(|x| format!("{:016x}", x.to_bits())).collect();
        let table = file_hash(&folder.join(self.table))?;
        let parts = [&table, self.element, SCRIPT.1, lammps_version, &numbers.join(" ")].join("\n");
        Ok(blake3::hash(parts.as_bytes()).to_hex().to_string())
    }
}

impl ForceConstants {
    /// Measures in `folder`, which has the table, unless the same table has been measured before; `lammps_version` is that of the program. Takes a second or
    /// two; `proceed` is called before.
    ///
    /// # Errors
    /// Those of `proceed`; `Lammps` if LAMMPS fails or its forces are not those of a crystal of this range; `Input` for a pressure that compresses the crystal
    /// by more than a tenth; `Io`.
    pub fn measure(
        lammps: &dyn RunScript,
        folder: &Path,
        crystal: ForceConstantInput,
        lammps_version: &str,
        proceed: &mut dyn FnMut() -> Result<()>,
    ) -> Result<Self> {
        proceed()?;
        let (cache, key) = (UserCache::of_user(CACHE), crystal.key(folder, lammps_version)?);
        let constants = match cache.read::<ForceConstants>(&key).filter(|c| c.strained.len() == STRAINS.len()) {
            Some(constants) => constants,
            None => {
                let mut strained = measure_all(lammps, folder, &crystal)?;
                keep_common_bonds(&mut strained);
                let constants = ForceConstants { strained };
                cache.write(&key, &constants);
                constants
            }
        };
        let largest = constants.strained[STRAINS.len() - 1].pressure / PRESSURE_MARGIN;
        if crystal.highest_pressure > largest {
            let [found, largest] = [crystal.highest_pressure, largest].map(|p| GPA_PER_EV_A3 * p);
            let accepted = format!("at most {largest:.2} GPa with this crystal");
            return Err(Error::input("force constants", "mean pressure", format!("{found:.2} GPa"), accepted));
        }
        Ok(constants)
    }

    /// Uniaxial strain under a normal pressure, eV/Å³; negative under tension.
    ///
    /// # Errors
    /// `Input` for a tension or pressure beyond the measured strains.
    pub fn strain_at(&self, pressure: f64) -> Result<f64> {
        let pressure_at =
            |strain: f64| -> f64 { self.weights(strain).iter().zip(&self.strained).map(|(w, s)| w * s.pressure).sum() };
        // The pressure rises with the strain.
        let (low, high) = (STRAINS[0], STRAINS[STRAINS.len() - 1]);
        if !(pressure_at(low)..=pressure_at(high)).contains(&pressure) {
            let [found, smallest, largest] =
                [pressure, pressure_at(low), pressure_at(high)].map(|p| format!("{:.3} GPa", GPA_PER_EV_A3 * p));
            return Err(Error::input("elastic base", "mean pressure", found, format!("{smallest} to {largest}")));
        }
        let (low, high) = bisect(low, high, 60, |strain| pressure_at(strain) < pressure);
        Ok(0.5 * (low + high))
    }

    /// Force constants at a strain.
    pub fn at(&self, strain: f64) -> LatticeConstants {
        let sets: Vec<&LatticeConstants> = self.strained.iter().map(|s| &s.constants).collect();
        LatticeConstants::combination(&sets, &self.weights(strain))
    }

    /// Weights of the measured strains: Lagrange's of the four nearest, otherwise zero.
    fn weights(&self, strain: f64) -> [f64; STRAINS.len()] {
        let below = STRAINS.iter().rposition(|s| *s <= strain).unwrap_or(0);
        let first = below.saturating_sub(1).min(STRAINS.len() - NODES);
        let nodes = first..first + NODES;
        std::array::from_fn(|k| {
            let others = nodes.clone().filter(|i| *i != k);
            let weight = || others.map(|i| (strain - STRAINS[i]) / (STRAINS[k] - STRAINS[i])).product();
            if nodes.contains(&k) { weight() } else { 0.0 }
        })
    }
}

fn measure_all(lammps: &dyn RunScript, folder: &Path, crystal: &ForceConstantInput) -> Result<Vec<Strained>> {
    let folder = &std::path::absolute(folder).map_err(Error::io("open", folder))?;
    let script = put(folder, SCRIPT.0, SCRIPT.1)?;
    let files_of = |number: usize| {
        ["crystal", "cut", "crystal_forces", "cut_forces"].map(|body| folder.join(format!("{body}.{number}.dump")))
    };
    let clear = || (0..STRAINS.len()).flat_map(files_of).for_each(|f| remove(&f).unwrap_or(()));
    clear();
    let reach = reach(crystal.cutoff_angstrom, crystal.a0_angstrom);
    let cells = (4.0 * crystal.cutoff_angstrom / crystal.a0_angstrom) as usize + 1;
    let vars = [
        ("potential", crystal.table.to_owned()),
        ("element", crystal.element.to_owned()),
        ("a0", format!("{:.10}", crystal.a0_angstrom)),
        // A negative strain would be an option of LAMMPS.
        ("stretch", STRAINS.map(|s| format!("{:.12}", 1.0 - s)).join(" ")),
        ("reach", reach.to_string()),
        ("cells", cells.to_string()),
        ("step", STEP_ANGSTROM.to_string()),
    ];
    let printed = results(folder, &lammps.run(folder, &script, &vars)?)?;
    let measured = STRAINS.iter().enumerate().map(|(number, strain)| {
        let bars = printed.get(&format!("pressure{number}"));
        let bars = bars.ok_or_else(|| Error::lammps(folder, format!("it printed no line 'RES pressure{number}'")))?;
        let spacing = 0.5 * crystal.a0_angstrom;
        let shape = CellDimensions { cells, spacing, layer: spacing * (1.0 - strain) };
        let [crystal_sites, cut_sites, crystal_forces, cut_forces] = files_of(number);
        let bulk = DisplacedLattice::read(&crystal_sites, &crystal_forces, shape)?;
        let cut = DisplacedLattice::read(&cut_sites, &cut_forces, shape)?;
        let constants = constants(&bulk, &cut, reach).map_err(|damage| Error::lammps(folder, damage))?;
        Ok(Strained { pressure: bars * EV_A3_PER_BAR, constants })
    });
    let measured = measured.collect::<Result<Vec<_>>>()?;
    clear();
    Ok(measured)
}

/// Measured cell: lattice constants across, spacing of half of one, and of two layers, Å.
#[derive(Clone, Copy)]
struct CellDimensions {
    cells: usize,
    spacing: f64,
    layer: f64,
}

/// Sites, forces at rest, and the force constants of the displaced atoms of a crystal or a cut block.
struct DisplacedLattice {
    shape: CellDimensions,
    /// Half lattice constants in x and y, and the layer from the lowest.
    sites: Vec<[i32; 3]>,
    forces: Vec<[f64; 3]>,
    /// For each displaced atom: its index, and the force constants with every atom.
    rows: Vec<(usize, Vec<[[f64; 3]; 3]>)>,
}

impl DisplacedLattice {
    fn read(sites: &Path, forces: &Path, shape: CellDimensions) -> Result<DisplacedLattice> {
        let rest = frames(sites, 6)?.into_iter().next().unwrap_or_default();
        let unusable =
            |description: &str| Error::format(forces, description, "the forces that force_constants.in writes");
        let lowest = rest.iter().map(|r| r[2]).fold(f64::INFINITY, f64::min);
        let half = |x: f64| ((x / shape.spacing) - 0.5).round() as i32;
        let sites: Vec<[i32; 3]> =
            rest.iter().map(|r| [half(r[0]), half(r[1]), ((r[2] - lowest) / shape.layer).round() as i32]).collect();
        let displaced = frames(forces, 3)?;
        if displaced.is_empty() || displaced.len() % 6 != 0 || displaced.iter().any(|f| f.len() != rest.len()) {
            return Err(unusable("incomplete"));
        }
        let mut rows = Vec::new();
        for frames in displaced.chunks(6) {
            let phi: Vec<[[f64; 3]; 3]> = (0..rest.len())
                .map(|k| {
                    let slope = |c: usize, d: usize| -(frames[2 * c][k][d] - frames[2 * c + 1][k][d]);
                    std::array::from_fn(|c| std::array::from_fn(|d| slope(c, d) / (2.0 * STEP_ANGSTROM)))
                })
                .collect();
            // The displaced atom has the largest restoring force.
            let index = (0..phi.len()).max_by(|&a, &b| phi[a][2][2].total_cmp(&phi[b][2][2]));
            rows.push((index.ok_or_else(|| unusable("no atoms"))?, phi));
        }
        Ok(DisplacedLattice { shape, sites, forces: rest.iter().map(|r| [r[3], r[4], r[5]]).collect(), rows })
    }

    /// Force constants of a row by the offset (half lattice constants) and layer of the other atom. The sum over all atoms vanishes:
    /// the error of the differences is taken off the atom's own.
    fn bonds(&self, row: usize) -> BTreeMap<[i32; 3], [[f64; 3]; 3]> {
        let (own, phi) = &self.rows[row];
        let [x, y, l] = self.sites[*own];
        let (across, half) = (2 * self.shape.cells as i32, self.shape.cells as i32);
        let offset = |d: i32| (d + half - 1).rem_euclid(across) - half + 1;
        let mut list: BTreeMap<[i32; 3], [[f64; 3]; 3]> =
            self.sites.iter().zip(phi).map(|(s, phi)| ([s[2], offset(s[0] - x), offset(s[1] - y)], *phi)).collect();
        let own = [l, 0, 0];
        for c in 0..3 {
            for d in 0..3 {
                let sum: f64 = list.values().map(|p| p[c][d]).sum();
                list.get_mut(&own).expect("its own")[c][d] -= sum;
            }
        }
        list
    }
}

/// Force constants of crystal and cut block, or the reason why they are not those of a crystal with this reach.
fn constants(
    bulk: &DisplacedLattice,
    cut: &DisplacedLattice,
    reach: usize,
) -> std::result::Result<LatticeConstants, String> {
    let largest_of = |phi: &[[f64; 3]; 3]| phi.iter().flatten().fold(0.0f64, |a, b| a.max(b.abs()));
    let (far, layer) = (reach as i32, bulk.sites[bulk.rows[0].0][2]);
    let all = bulk.bonds(0);
    let largest = all.values().map(largest_of).fold(0.0, f64::max);
    let absent = |phi: &[[f64; 3]; 3]| largest_of(phi) <= ABSENT * largest;
    let edge = bulk.shape.cells as i32;
    let mut relative = BTreeMap::new();
    for (&[l, dx, dy], phi) in &all {
        let d = l - layer;
        let inside = d.abs() <= far && dx.abs() < edge && dy.abs() < edge;
        if inside {
            relative.insert([d, dx, dy], *phi);
        } else if !absent(phi) {
            return Err(format!(
                "atoms {d} layers and ({dx}, {dy}) half lattice constants apart are coupled, beyond the cut-off"
            ));
        }
    }
    for (&[d, dx, dy], phi) in &relative {
        let other = relative.get(&[-d, -dx, -dy]).copied().unwrap_or_default();
        for c in 0..3 {
            for e in 0..3 {
                if (phi[c][e] - other[e][c]).abs() > ASYMMETRY * largest {
                    return Err("its force constants are not symmetric: the table is not smooth".into());
                }
            }
        }
    }
    let bond = |(&[layer, dx, dy], phi): (&[i32; 3], &[[f64; 3]; 3])| Bond { layer, dx, dy, phi: *phi };
    let mut lists = Vec::new();
    for l in 0..reach {
        let row = cut.bonds(l);
        for (&[k, dx, dy], phi) in row.iter().filter(|(r, _)| r[0] >= far) {
            let same = relative.get(&[k - l as i32, dx, dy]).copied().unwrap_or_default();
            let changed: [[f64; 3]; 3] = std::array::from_fn(|c| std::array::from_fn(|d| phi[c][d] - same[c][d]));
            if !absent(&changed) {
                return Err(format!(
                    "the cut changes the coupling of layers {l} and {k}, beyond the potential's reach"
                ));
            }
        }
        lists.push(row.iter().filter(|(r, _)| r[0] < far).map(bond).collect());
    }
    let mean_force = |l: usize| {
        let forces: Vec<f64> =
            cut.sites.iter().zip(&cut.forces).filter(|(s, _)| s[2] == l as i32).map(|(_, f)| f[2]).collect();
        forces.iter().sum::<f64>() / forces.len().max(1) as f64
    };
    Ok(LatticeConstants {
        reach,
        bulk: relative.iter().map(bond).collect(),
        cut: lists,
        cut_force: (0..reach).map(mean_force).collect(),
    })
}

/// Removes bonds that are absent at all strains.
fn keep_common_bonds(strained: &mut [Strained]) {
    let largest = |list: &[Bond]| list.iter().flat_map(|b| b.phi.iter().flatten()).fold(0.0f64, |a, b| a.max(b.abs()));
    let smallest = ABSENT * largest(&strained[0].constants.bulk);
    let is_kept = |lists: Vec<&Vec<Bond>>| -> Vec<bool> {
        (0..lists[0].len()).map(|k| lists.iter().any(|l| largest(&l[k..=k]) > smallest)).collect()
    };
    let retain = |list: &mut Vec<Bond>, keep: &[bool]| {
        let mut flags = keep.iter();
        list.retain(|_| *flags.next().unwrap_or(&false));
    };
    let bulk = is_kept(strained.iter().map(|s| &s.constants.bulk).collect());
    strained.iter_mut().for_each(|s| retain(&mut s.constants.bulk, &bulk));
    for l in 0..strained[0].constants.reach {
        let cut = is_kept(strained.iter().map(|s| &s.constants.cut[l]).collect());
        strained.iter_mut().for_each(|s| retain(&mut s.constants.cut[l], &cut));
    }
}

/// All frames of a dump with an id and `columns` numbers per atom.
fn frames(path: &Path, columns: usize) -> Result<Vec<Vec<Vec<f64>>>> {
    let text = read_text(path)?;
    let wrong = |line: &str| Error::format(path, format!("the line {line:?}"), format!("an id and {columns} numbers"));
    let mut list = Vec::new();
    for part in text.split("ITEM: ATOMS").skip(1) {
        let lines = part.lines().skip(1).take_while(|l| !l.starts_with("ITEM:"));
        let frame = lines.map(|line| {
            let numbers: Option<Vec<f64>> =
                line.split_whitespace().skip(1).map(|w| w.parse().ok().filter(|v: &f64| v.is_finite())).collect();
            numbers.filter(|n| n.len() == columns).ok_or_else(|| wrong(line))
        });
        list.push(frame.collect::<Result<Vec<_>>>()?);
    }
    Ok(list)
}
