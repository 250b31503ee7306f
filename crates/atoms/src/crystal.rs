//! The crystal of a potential at 0 K, measured with LAMMPS: which of fcc, bcc and hcp has the lowest energy, its lattice
//! constant, and of a cubic one the elastic constants and the contact modulus of its (001) face.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_4, SQRT_2};
use std::fmt;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::potential::SetflHeader;
use super::run_script::{RunScript, results};
use asperity_contact::interface::Cubic;
use asperity_grid::error::{Error, Result};
use asperity_surface::files::atomic_file::put;

/// Energy per atom, eV, by which fcc may lie above another crystal and still be the crystal of the potential. Published
/// potentials of fcc metals have hcp up to 0.6 meV lower (copper of `AlCu.eam.alloy`): their range hardly distinguishes the two.
/// Those of hcp metals have fcc 7 (cobalt) to 54 meV higher, and those of bcc metals 120 meV and more.
pub const DEGENERATE_EV: f64 = 2e-3;

/// Volumes per atom among which minima of the energy are looked for, Å³: from half of beryllium's to more than caesium's, in steps of 8
/// per cent.
const VOLUMES: (f64, f64, usize) = (4.0, 150.0, 48);

/// Strain of the central differences. Relative errors: 1e-6 from third-order elastic constants (strain squared), 1e-7
/// from rounding of the printed stresses.
const STRAIN: f64 = 1e-3;
const GPA_PER_BAR: f64 = 1e-4;

/// File name of the copy of the table in the folder; LAMMPS splits paths at spaces.
pub(super) const TABLE: &str = "potential.eam.alloy";

const SCAN: (&str, &str) = ("energy_volume.in", include_str!("../lammps-inputs/properties/energy_volume.in"));
const LATTICE: (&str, &str) = ("lattice.in", include_str!("../lammps-inputs/properties/lattice.in"));
const ELASTIC: (&str, &str) = ("elastic.in", include_str!("../lammps-inputs/properties/elastic.in"));

/// A crystal structure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Structure {
    Fcc,
    Bcc,
    Hcp,
}

impl Structure {
    pub const ALL: [Structure; 3] = [Structure::Fcc, Structure::Bcc, Structure::Hcp];

    /// Its name, as LAMMPS has it.
    pub fn name(self) -> &'static str {
        match self {
            Structure::Fcc => "fcc",
            Structure::Bcc => "bcc",
            Structure::Hcp => "hcp",
        }
    }

    /// Lattice constant at a volume per atom; of hcp with the ideal c/a.
    fn lattice_constant(self, volume: f64) -> f64 {
        let cube = match self {
            Structure::Fcc => 4.0 * volume,
            Structure::Bcc => 2.0 * volume,
            Structure::Hcp => SQRT_2 * volume,
        };
        cube.cbrt()
    }
}

impl fmt::Display for Structure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Elastic constants of a cubic crystal, GPa.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ElasticConstants {
    pub c11_gpa: f64,
    pub c12_gpa: f64,
    pub c44_gpa: f64,
}

/// Contact moduli E* of a (001) face, GPa. Waves of pressure meet another modulus in each direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FaceModuli {
    /// Harmonic mean over all directions in the face: that of axisymmetric and of isotropically rough contacts.
    pub mean_gpa: f64,
    /// For waves along \[100\] and along \[110\].
    pub along_100_gpa: f64,
    pub along_110_gpa: f64,
}

impl ElasticConstants {
    /// # Errors
    /// `Error::Input` for constants of an unstable crystal.
    pub fn face(&self) -> Result<FaceModuli> {
        let crystal = Cubic::new(self.c11_gpa, self.c12_gpa, self.c44_gpa)?;
        Ok(FaceModuli {
            mean_gpa: crystal.contact_modulus(),
            along_100_gpa: crystal.directional_modulus(0.0),
            along_110_gpa: crystal.directional_modulus(FRAC_PI_4),
        })
    }
}

/// The crystal of a potential.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasuredCrystal {
    /// That of the lowest energy among fcc, bcc and hcp; fcc up to [`DEGENERATE_EV`] above it.
    pub structure: Structure,
    /// Lattice constant a, and c of hcp over it.
    pub a0_angstrom: f64,
    pub c_over_a: Option<f64>,
    /// Energies per atom, eV, of the structures that have a minimum.
    pub energies_ev: BTreeMap<Structure, f64>,
    /// `None` for hcp, whose elasticity is hexagonal.
    pub elastic_constants: Option<ElasticConstants>,
}

impl MeasuredCrystal {
    /// Energy per atom, eV, of another structure minus that of this one.
    pub fn excess_ev(&self, other: Structure) -> Option<f64> {
        Some(self.energies_ev.get(&other)? - self.energies_ev.get(&self.structure)?)
    }

    /// Energy per atom of isolated atoms minus that of the crystal, eV.
    pub fn cohesive_energy_ev(&self) -> f64 {
        -self.energies_ev.get(&self.structure).copied().unwrap_or(f64::NAN)
    }

    /// Contact moduli of the (001) face of a cubic crystal.
    ///
    /// # Errors
    /// As [`ElasticConstants::face`].
    pub fn face(&self) -> Result<Option<FaceModuli>> {
        self.elastic_constants.as_ref().map(ElasticConstants::face).transpose()
    }

    /// Structure, lattice constants, and the energies of the other structures, in words.
    pub fn describe(&self) -> String {
        let ratio = self.c_over_a.map_or(String::new(), |r| format!(", c/a = {r:.4}"));
        let others = Structure::ALL.into_iter().filter(|s| *s != self.structure);
        let others = others.map(|s| match self.excess_ev(s) {
            Some(ev) => format!("{s} {:+.2} meV per atom", 1e3 * ev),
            None => format!("{s} without a minimum"),
        });
        format!("{}, a0 = {:.5} Å{ratio}; {}", self.structure, self.a0_angstrom, others.collect::<Vec<_>>().join(", "))
    }
}

/// A folder with a copy of a table, in which LAMMPS runs the scripts.
pub(super) struct MeasurementFolder<'a> {
    lammps: &'a dyn RunScript,
    folder: PathBuf,
    element: &'a str,
}

impl<'a> MeasurementFolder<'a> {
    /// # Errors
    /// `Error::Format` if the table is damaged or lacks the element; `Error::Io`.
    pub(super) fn new(lammps: &'a dyn RunScript, folder: &Path, setfl: &Path, element: &'a str) -> Result<Self> {
        SetflHeader::read(setfl)?.element(setfl, element)?;
        std::fs::create_dir_all(folder).map_err(Error::io("make", folder))?;
        let folder = folder.canonicalize().map_err(Error::io("open", folder))?;
        std::fs::copy(setfl, folder.join(TABLE)).map_err(Error::io("copy", setfl))?;
        Ok(MeasurementFolder { lammps, folder, element })
    }

    /// What LAMMPS prints.
    fn print(&self, (name, text): (&str, &str), vars: &[(&str, String)]) -> Result<String> {
        let script = put(&self.folder, name, text)?;
        let own = [("potential", TABLE.to_owned()), ("element", self.element.to_owned())];
        self.lammps.run(&self.folder, &script, &[&own, vars].concat())
    }

    /// Results of a script on the crystal of a lattice constant.
    pub(super) fn of_crystal(
        &self,
        script: (&str, &str),
        (structure, a0): (Structure, f64),
    ) -> Result<BTreeMap<String, f64>> {
        let vars =
            [("lattice", structure.name().to_owned()), ("a0", format!("{a0:.10}")), ("strain", STRAIN.to_string())];
        self.measured(script, &vars)
    }

    /// Results of a script.
    pub(super) fn measured(&self, script: (&str, &str), vars: &[(&str, String)]) -> Result<BTreeMap<String, f64>> {
        results(&self.folder, &self.print(script, vars)?)
    }

    /// A result that must be there.
    pub(super) fn get(&self, measured: &BTreeMap<String, f64>, name: &str) -> Result<f64> {
        measured.get(name).copied().ok_or_else(|| self.failed(format!("it printed no line 'RES {name}'")))
    }

    pub(super) fn failed(&self, description: String) -> Error {
        Error::lammps(&self.folder, description)
    }
}

/// Measures the crystal of `element` in the table `setfl`, in about three seconds on one core. Of several minima of a structure the one
/// nearest to the lattice constant `near` counts, or the lowest. Scripts, a copy of the table and the logs remain in `folder`, which is
/// created if necessary.
///
/// # Errors
/// `Error::Format` if the table is damaged, lacks the element or binds none of the structures; `Error::Lammps` if LAMMPS fails or a
/// result is missing; `Error::Input` if the measured elastic constants violate crystal stability.
pub fn measure(
    lammps: &dyn RunScript,
    folder: &Path,
    setfl: &Path,
    element: &str,
    near: Option<f64>,
) -> Result<MeasuredCrystal> {
    measure_on(&MeasurementFolder::new(lammps, folder, setfl, element)?, setfl, near)
}

pub(super) fn measure_on(bench: &MeasurementFolder, setfl: &Path, guess: Option<f64>) -> Result<MeasuredCrystal> {
    let (smallest, largest, volumes) = VOLUMES;
    let vars = [("least", smallest.to_string()), ("most", largest.to_string()), ("volumes", volumes.to_string())];
    let printed = bench.print(SCAN, &vars)?;
    let scanned = energies(&printed);
    let mut relaxed = BTreeMap::new();
    for structure in Structure::ALL {
        let Some(start) = start(&scanned, structure, guess) else { continue };
        let relaxation = bench.of_crystal(LATTICE, (structure, start))?;
        let [a0, c0, energy] = ["a0", "c0", "energy"].map(|name| bench.get(&relaxation, name));
        let energy = energy?;
        // Isolated atoms have the energy zero.
        if energy < 0.0 {
            relaxed.insert(structure, (a0?, c0?, energy));
        }
    }
    let energies_ev: BTreeMap<Structure, f64> = relaxed.iter().map(|(s, r)| (*s, r.2)).collect();
    let Some(structure) = ground_state(&energies_ev) else {
        let found = format!(
            "a table that binds {} in none of the crystals fcc, bcc and hcp of {smallest} to {largest} Å³ per atom",
            bench.element
        );
        return Err(Error::format(setfl, found, "a table of a metal (eam/alloy, units metal)"));
    };
    let (a0_angstrom, c0, _) = relaxed[&structure];
    let (c_over_a, elastic_constants) = match structure {
        Structure::Hcp => (Some(c0 / a0_angstrom), None),
        Structure::Fcc | Structure::Bcc => (None, Some(elastic(bench, (structure, a0_angstrom))?)),
    };
    let crystal = MeasuredCrystal { structure, a0_angstrom, c_over_a, energies_ev, elastic_constants };
    crystal.face().map_err(|e| e.with_context(format!("{}: {structure} {}", setfl.display(), bench.element), None))?;
    Ok(crystal)
}

/// The structure of the lowest energy; fcc if it is hardly higher.
fn ground_state(energies: &BTreeMap<Structure, f64>) -> Option<Structure> {
    let (lowest, energy) = energies.iter().min_by(|a, b| a.1.total_cmp(b.1))?;
    let fcc = energies.get(&Structure::Fcc).is_some_and(|fcc| fcc - energy <= DEGENERATE_EV);
    Some(if fcc { Structure::Fcc } else { *lowest })
}

/// Energies that a scan prints. An energy that is no number, as of overlapping atoms, is above any other.
fn energies(printed: &str) -> BTreeMap<&str, f64> {
    let lines = printed.lines().filter_map(|l| l.strip_prefix("RES ")?.trim().split_once(' '));
    let number = |text: &str| text.parse().ok().filter(|v: &f64| v.is_finite()).unwrap_or(f64::INFINITY);
    lines.map(|(name, value)| (name, number(value))).collect()
}

/// Lattice constant of a minimum of the scanned energies: the one nearest to `near`, or the lowest.
fn start(scanned: &BTreeMap<&str, f64>, structure: Structure, guess: Option<f64>) -> Option<f64> {
    let (smallest, largest, volumes) = VOLUMES;
    let energy = |k: usize| scanned.get(format!("{structure}_{k}").as_str()).copied();
    let minimum = |k: &usize| {
        let energies = [k - 1, *k, k + 1].map(energy);
        matches!(energies, [Some(before), Some(here), Some(after)] if here < before && here <= after)
    };
    let constant = |k: usize| {
        structure.lattice_constant(smallest * (largest / smallest).powf((k - 1) as f64 / (volumes - 1) as f64))
    };
    let rank = |k: &usize| match guess {
        Some(a0) => (constant(*k) / a0).ln().abs(),
        None => energy(*k).unwrap_or(f64::INFINITY),
    };
    (2..volumes).filter(minimum).min_by(|a, b| rank(a).total_cmp(&rank(b))).map(constant)
}

/// Elastic constants from the stresses of strained crystals, bar.
fn elastic(bench: &MeasurementFolder, crystal: (Structure, f64)) -> Result<ElasticConstants> {
    let printed = bench.of_crystal(ELASTIC, crystal)?;
    // Stress is minus the pressure tensor.
    let constant = |c: &str| -> Result<f64> {
        let [plus, minus] = ["plus", "minus"].map(|side| bench.get(&printed, &format!("{c}_{side}")));
        Ok(-(plus? - minus?) / (2.0 * STRAIN) * GPA_PER_BAR)
    };
    Ok(ElasticConstants { c11_gpa: constant("xx")?, c12_gpa: constant("yy")?, c44_gpa: constant("xy")? })
}

/// Text of the scripts: results of others are not comparable.
pub fn scripts() -> String {
    [SCAN, LATTICE, ELASTIC].map(|(_, text)| text).concat()
}
