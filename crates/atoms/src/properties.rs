//! Properties of the crystal of a potential at 0 K, measured with LAMMPS.
//!
//! The scripts are `lammps-inputs/properties/*.in`; each prints its results as lines `RES name value` and can be run
//! by hand. [`measure`] runs the same files.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::crystal::{self, MeasuredCrystal, MeasurementFolder, Structure};
use crate::potential::{CALCIUM_ELEMENT, SetflHeader};
use crate::run_script::RunScript;
use asperity_grid::error::{Error, Result};
use asperity_grid::units::J_M2_PER_EV_A2;

/// Properties of the cubic crystal of a potential at 0 K.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Properties {
    pub a0_angstrom: f64,
    /// Energy per atom of isolated atoms minus that of the crystal, eV.
    pub cohesive_energy_ev: f64,
    pub c11_gpa: f64,
    pub c12_gpa: f64,
    pub c44_gpa: f64,
    /// Contact modulus E* of the (001) face, computed from the elastic constants, GPa: the harmonic mean over the directions in the
    /// face, and for waves along \[100\] and \[110\].
    pub contact_modulus_gpa: f64,
    pub contact_modulus_100_gpa: f64,
    pub contact_modulus_110_gpa: f64,
    /// Vacancy formation energy, relaxed at fixed volume, eV.
    pub vacancy_ev: f64,
    /// Surface energy of (100), relaxed, J/m².
    pub surface_j_m2: f64,
    /// Intrinsic (stable) and unstable stacking-fault energy on (111) of fcc, relaxed along the normal, J/m².
    pub stacking_fault_j_m2: Option<f64>,
    pub unstable_fault_j_m2: Option<f64>,
    /// Energy per atom of bcc and of hcp minus that of fcc, eV; `None` for a structure without a minimum.
    pub bcc_minus_fcc_ev: Option<f64>,
    pub hcp_minus_fcc_ev: Option<f64>,
}

impl Properties {
    /// What a property is, for people.
    pub fn meaning(key: &str) -> &'static str {
        match key {
            "a0_angstrom" => "lattice constant",
            "cohesive_energy_ev" => "energy per atom of isolated atoms minus that of the crystal",
            "c11_gpa" | "c12_gpa" | "c44_gpa" => "elastic constant",
            "contact_modulus_gpa" => "E* of the (001) face, harmonic mean over the directions of waves in it",
            "contact_modulus_100_gpa" => "E* of the (001) face for waves along [100]",
            "contact_modulus_110_gpa" => "E* of the (001) face for waves along [110]",
            "vacancy_ev" => "formation energy of a vacancy",
            "surface_j_m2" => "energy of the (100) surface",
            "stacking_fault_j_m2" => "energy of the intrinsic stacking fault on (111); of fcc only",
            "unstable_fault_j_m2" => "highest energy on the way to it",
            "bcc_minus_fcc_ev" => "energy per atom of bcc minus that of fcc",
            "hcp_minus_fcc_ev" => "energy per atom of hcp minus that of fcc",
            _ => "",
        }
    }
}

const VACANCY: (&str, &str) = ("vacancy.in", include_str!("../lammps-inputs/properties/vacancy.in"));
const SURFACE: (&str, &str) = ("surface.in", include_str!("../lammps-inputs/properties/surface.in"));
const EXPANSION: (&str, &str) = ("expansion.in", include_str!("../lammps-inputs/expansion.in"));
const FAULT: (&str, &str) = ("stacking_fault.in", include_str!("../lammps-inputs/properties/stacking_fault.in"));

/// Measures the crystal of `element` in the table `setfl` as [`crystal::measure`] does, and if it is cubic its defects. Scripts, a copy of
/// the table and the logs remain in `folder`, which is created if necessary. Takes seconds on one core.
///
/// # Errors
/// Those of [`crystal::measure`].
pub fn measure(
    lammps: &dyn RunScript,
    folder: &Path,
    setfl: &Path,
    element: &str,
    near: Option<f64>,
) -> Result<(MeasuredCrystal, Option<Properties>)> {
    let bench = MeasurementFolder::new(lammps, folder, setfl, element)?;
    let crystal = crystal::measure_on(&bench, setfl, near)?;
    let Some((c, face)) = crystal.elastic_constants.zip(crystal.face()?) else { return Ok((crystal, None)) };
    let lattice = (crystal.structure, crystal.a0_angstrom);
    let value_of = |script, name| bench.get(&bench.of_crystal(script, lattice)?, name);
    let faults = match crystal.structure {
        Structure::Fcc => Some(stacking_faults(&bench, lattice)?),
        Structure::Bcc | Structure::Hcp => None,
    };
    let above_fcc = |s| Some(crystal.excess_ev(s)? - crystal.excess_ev(Structure::Fcc)?);
    let properties = Properties {
        a0_angstrom: crystal.a0_angstrom,
        cohesive_energy_ev: crystal.cohesive_energy_ev(),
        c11_gpa: c.c11_gpa,
        c12_gpa: c.c12_gpa,
        c44_gpa: c.c44_gpa,
        contact_modulus_gpa: face.mean_gpa,
        contact_modulus_100_gpa: face.along_100_gpa,
        contact_modulus_110_gpa: face.along_110_gpa,
        vacancy_ev: value_of(VACANCY, "vacancy")?,
        surface_j_m2: value_of(SURFACE, "surface")? * J_M2_PER_EV_A2,
        stacking_fault_j_m2: faults.map(|f| f[0] * J_M2_PER_EV_A2),
        unstable_fault_j_m2: faults.map(|f| f[1] * J_M2_PER_EV_A2),
        bcc_minus_fcc_ev: above_fcc(Structure::Bcc),
        hcp_minus_fcc_ev: above_fcc(Structure::Hcp),
    };
    Ok((crystal, Some(properties)))
}

/// Lattice constant of an fcc crystal at a temperature and zero pressure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ExpandedLattice {
    /// Mean of the run.
    pub temperature_k: f64,
    pub lattice_constant_angstrom: f64,
    /// Its standard error.
    pub error_angstrom: f64,
}

/// Time step of calcium (40.08 u), ps; it is proportional to the square root of the mass, and not longer than this.
const CALCIUM_TIMESTEP_PS: f64 = 0.004;

/// Strain beyond which a cell is no crystal any more: metals melt at a strain of about 2 % (Grüneisen's rule).
const MOST_EXPANSION: f64 = 0.04;

/// Averaging time, ps. `asperity potential --measure --temperature 300,600` states standard errors of 0.0002 and 0.0006 Å for calcium.
const AVERAGED_PS: f64 = 40.0;

/// Measures the lattice constant of an fcc crystal, `a0` Å at 0 K, at a temperature: 864 atoms for 50 ps, about half a minute on one core.
///
/// # Errors
/// As [`measure`].
pub fn expand(
    lammps: &dyn RunScript,
    folder: &Path,
    setfl: &Path,
    (element, a0): (&str, f64),
    temperature_k: f64,
) -> Result<ExpandedLattice> {
    let mass_u = SetflHeader::read(setfl)?.element(setfl, element)?.mass_u;
    let bench = MeasurementFolder::new(lammps, folder, setfl, element)?;
    let timestep = CALCIUM_TIMESTEP_PS * (mass_u / CALCIUM_ELEMENT.2).sqrt().min(1.0);
    let vars = [("a0", a0), ("temperature", temperature_k), ("timestep", timestep), ("time", AVERAGED_PS)];
    let printed = bench.measured(EXPANSION, &vars.map(|(name, value)| (name, value.to_string())))?;
    let value_of = |name| bench.get(&printed, name);
    let expansion = value_of("lattice_constant")? / a0 - 1.0;
    if expansion.abs() > MOST_EXPANSION {
        let percent = 100.0 * expansion;
        return Err(bench.failed(format!(
            "at {temperature_k} K the cell is {percent:.1} % longer than at 0 K: the crystal has melted or is about to"
        )));
    }
    Ok(ExpandedLattice {
        temperature_k: value_of("temperature")?,
        lattice_constant_angstrom: value_of("lattice_constant")?,
        error_angstrom: value_of("error")?,
    })
}

/// Stable and unstable stacking-fault energy, eV/Å².
fn stacking_faults(bench: &MeasurementFolder, lattice: (Structure, f64)) -> Result<[f64; 2]> {
    let printed = bench.of_crystal(FAULT, lattice)?;
    let slide = (1..=10).map(|k| bench.get(&printed, &format!("fault_{k}"))).collect::<Result<Vec<f64>>>()?;
    // The fault is a minimum at the end of the path. Along -[11-2] the energy rises all the way, to 0.0125 instead of
    // 0.0003 eV/Å², as planes end above each other.
    if slide[9] >= slide[8] {
        let what = "the energy of its stacking fault rises to the end of the slip: the direction is not [11-2]";
        return Err(bench.failed(what.into()));
    }
    Ok([slide[9], slide.iter().fold(0.0f64, |a, &b| a.max(b))])
}

/// Card of a potential (`potentials/Ca.toml`): provenance and measured properties.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PotentialCard {
    pub file: String,
    /// BLAKE3 hash of the table, hexadecimal.
    pub blake3: String,
    pub licence: String,
    pub element: String,
    pub style: String,
    pub units: String,
    /// Functional form and reference of the fit.
    pub source: String,
    pub measured: MeasurementOrigin,
    /// Stated values, and tolerances of a measurement in the same units.
    pub properties: Properties,
    pub tolerance: Properties,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasurementOrigin {
    pub date: String,
    pub lammps: String,
}

impl PotentialCard {
    /// The card of the generated calcium-like potential.
    ///
    /// # Errors
    /// `Error::Format` if the embedded file is not a valid card.
    pub fn calcium() -> Result<PotentialCard> {
        let text = include_str!("../potentials/Ca.toml");
        toml::from_str(text).map_err(|e| Error::format("potentials/Ca.toml", e.message(), "a potential's card"))
    }

    /// One sentence for each property of `measured` that deviates from the stated value by more than its tolerance.
    pub fn deviations(&self, measured: &Properties) -> Vec<String> {
        let columns = [measured, &self.properties, &self.tolerance].map(named);
        let mut list = Vec::new();
        for ((measured, stated), tolerance) in columns[0].iter().zip(&columns[1]).zip(&columns[2]) {
            // Also true for NaN, which stands for what was not measured.
            if (measured.1 - stated.1).abs().partial_cmp(&tolerance.1).is_none_or(|o| o.is_gt()) {
                list.push(format!("{} is {}, stated {} ± {}", measured.0, measured.1, stated.1, tolerance.1));
            }
        }
        list
    }
}

fn named(p: &Properties) -> Vec<(String, f64)> {
    let all = serde_json::to_value(p).ok().and_then(|p| p.as_object().cloned()).unwrap_or_default();
    all.into_iter().map(|(key, value)| (key, value.as_f64().unwrap_or(f64::NAN))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::crystal::TABLE;
    use std::path::PathBuf;

    /// Output of LAMMPS for the calcium-type potential, by script and, of several crystals, by crystal.
    const RECORDED: [(&str, &str); 8] = [
        // Energies around 48 volumes of which these are the minima and their neighbours.
        (
            "energy_volume.in",
            "noise\nRES fcc_31 -1.80\nRES fcc_32 -1.84\nRES fcc_33 -1.81\nRES bcc_32 -1.81\nRES bcc_33 -1.82\nRES bcc_34 -1.80\n\
             RES hcp_31 -1.79\nRES hcp_32 -1.83\nRES hcp_33 nan\nRES hcp_1 -9.0\nRES hcp_2 inf\n",
        ),
        ("lattice.in fcc", "RES a0 5.5883981287\nRES c0 5.5883981287\nRES energy -1.8400004595\n"),
        ("lattice.in bcc", "RES a0 4.5788502799\nRES c0 4.5788502799\nRES energy -1.8255822198\n"),
        ("lattice.in hcp", "RES a0 3.9460139697\nRES c0 6.5014218723\nRES energy -1.8382084265\n"),
        (
            "elastic.in",
            "RES xx_plus -304.873865\nRES yy_plus -199.3435637\nRES xy_plus -179.0509565\n\
             RES xx_minus 305.9771257\nRES yy_minus 200.4794338\nRES xy_minus 179.0509565\n",
        ),
        ("vacancy.in", "RES vacancy 1.211796\n"),
        ("surface.in", "RES surface 0.02810262514\n"),
        (
            "stacking_fault.in",
            "RES fault_1 0.0004290\nRES fault_2 0.001547\nRES fault_3 0.003022\nRES fault_4 0.004265\nRES fault_5 0.004726674\n\
             RES fault_6 0.004295\nRES fault_7 0.003119\nRES fault_8 0.001733\nRES fault_9 0.0006843\nRES fault_10 0.0002809383\n",
        ),
    ];

    /// Replays `RECORDED`, with one replacement; the crystal and the lattice constant that the later scripts receive.
    struct Replay(&'static str, &'static str, Structure, &'static str);

    impl RunScript for Replay {
        fn run(&self, folder: &Path, script: &Path, vars: &[(&str, String)]) -> Result<String> {
            assert!(script.is_absolute() && script.is_file() && folder.join(TABLE).is_file());
            let name = script.file_name().unwrap().to_str().unwrap();
            let value_of = |name: &str| vars.iter().find(|(n, _)| *n == name).map_or("", |(_, value)| value);
            // The relaxed lattice constant reaches the later scripts.
            let expected = match (name, value_of("lattice")) {
                ("energy_volume.in", _) => "",
                // 43.68 Å³ per atom, of bcc 47.18.
                ("lattice.in", "fcc") => "5.5903",
                ("lattice.in", "bcc") => "4.5525",
                ("lattice.in", _) => "3.9529",
                (_, lattice) if lattice == self.2.name() => self.3,
                other => panic!("{other:?}"),
            };
            assert!(value_of("a0").starts_with(expected), "{name} {}: {}", value_of("lattice"), value_of("a0"));
            let named = |n: &str| n == name || n == format!("{name} {}", value_of("lattice"));
            let text = RECORDED.iter().find(|(n, _)| named(n)).unwrap().1;
            Ok(text.replace(self.0, self.1))
        }
    }

    /// The fcc crystal with one replacement in what LAMMPS prints.
    fn fcc(good: &'static str, bad: &'static str) -> Replay {
        Replay(good, bad, Structure::Fcc, "5.5883981287")
    }

    fn table() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("potentials/Ca.eam.alloy")
    }

    #[test]
    fn printed_results_become_properties_with_units() {
        let folder = tempfile::tempdir().unwrap();
        let actual = measure(&fcc("noise", ""), &folder.path().join("new"), &table(), "Ca", None).unwrap();
        let actual = actual.1.unwrap();
        let card = PotentialCard::calcium().unwrap();
        assert!(card.deviations(&actual).is_empty(), "{:?}", card.deviations(&actual));
        let wrong = Properties { vacancy_ev: f64::NAN, a0_angstrom: 5.6, ..actual };
        let list = card.deviations(&wrong);
        assert!(list.len() == 2 && list[0].starts_with("a0_angstrom is 5.6, stated 5.5884 ± "), "{list:?}");
    }

    #[test]
    fn an_expanded_lattice_has_its_error_and_light_atoms_a_shorter_step() {
        /// What LAMMPS prints, and the time step that it gets.
        struct Printed(&'static str, &'static str);
        impl RunScript for Printed {
            fn run(&self, _: &Path, script: &Path, vars: &[(&str, String)]) -> Result<String> {
                assert!(script.ends_with("expansion.in"));
                let value_of = |name: &str| vars.iter().find(|(n, _)| *n == name).map(|(_, v)| v.as_str());
                let given = (value_of("a0"), value_of("temperature"), value_of("timestep"));
                assert_eq!(given, (Some("5.5884"), Some("300"), Some(self.1)));
                Ok(format!("RES temperature 299.4\nRES lattice_constant {}\nRES error 0.0004\n", self.0))
            }
        }
        let folder = tempfile::tempdir().unwrap();
        let measured =
            |printed, step, table: &Path| expand(&Printed(printed, step), folder.path(), table, ("Ca", 5.5884), 300.0);
        let stated =
            ExpandedLattice { temperature_k: 299.4, lattice_constant_angstrom: 5.6317, error_angstrom: 0.0004 };
        assert_eq!(measured("5.6317", "0.004", &table()).unwrap(), stated);
        // A quarter of the mass.
        let light = folder.path().join("light.eam.alloy");
        std::fs::write(&light, std::fs::read_to_string(table()).unwrap().replacen("40.078", "10.0195", 1)).unwrap();
        assert_eq!(measured("5.6317", "0.002", &light).unwrap(), stated);
        let melted = measured("5.9", "0.004", &table()).unwrap_err().to_string();
        assert!(melted.contains("5.6 % longer") && melted.contains("melted"), "{melted}");
    }

    #[test]
    fn missing_or_infinite_results_name_themselves() {
        let folder = tempfile::tempdir().unwrap();
        for (good, bad, expected) in [
            ("RES vacancy", "RE vacancy", "no line 'RES vacancy'"),
            ("fault_7", "fault_77", "no line 'RES fault_7'"),
            ("1.211796", "inf", "'RES vacancy inf'"),
            ("xy_plus -179", "xy_plus 179", "C44 = "),
            ("fault_9 0.0006843", "fault_9 0.0002", "direction is not [11-2]"),
        ] {
            let message = measure(&fcc(good, bad), folder.path(), &table(), "Ca", None).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
    }

    /// Only what is measured of a structure is stated: a bcc crystal has no stacking fault of fcc, a hcp one no cubic elasticity.
    #[test]
    fn the_structure_of_the_lowest_energy_is_measured() {
        let folder = tempfile::tempdir().unwrap();
        let measured_with = |replay: &Replay| measure(replay, folder.path(), &table(), "Ca", None);
        let (crystal, actual) =
            measured_with(&Replay("energy -1.8255822198", "energy -1.8425", Structure::Bcc, "4.5788502799")).unwrap();
        let actual = actual.expect("cubic");
        assert_eq!((crystal.structure, actual.a0_angstrom), (Structure::Bcc, 4.5788502799));
        assert_eq!((actual.stacking_fault_j_m2, actual.cohesive_energy_ev), (None, 1.8425));
        assert!(actual.bcc_minus_fcc_ev.is_some_and(|ev| (ev + 0.0025).abs() < 1e-6), "{actual:?}");
        let (crystal, actual) =
            measured_with(&Replay("energy -1.8382084265", "energy -1.8425", Structure::Hcp, "")).unwrap();
        assert!(actual.is_none() && crystal.structure == Structure::Hcp);
        assert!(crystal.c_over_a.is_some_and(|c| (c - 1.6476).abs() < 1e-4), "{crystal:?}");
        assert_eq!(
            crystal.describe(),
            "hcp, a0 = 3.94601 Å, c/a = 1.6476; fcc +2.50 meV per atom, bcc +16.92 meV per atom"
        );
        // 1.9 meV is within what potentials of fcc metals leave.
        let (crystal, _) = measured_with(&fcc("energy -1.8382084265", "energy -1.8419")).unwrap();
        assert!(crystal.structure == Structure::Fcc && crystal.excess_ev(Structure::Hcp).unwrap() < 0.0);
    }

    #[test]
    fn a_table_that_binds_no_crystal_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let refused = measure(&fcc("RES", "RE"), folder.path(), &table(), "Ca", None).unwrap_err();
        assert!(refused.exit_code() == 2 && refused.to_string().contains("binds Ca in none"), "{refused}");
    }

    #[test]
    fn a_table_without_the_element_is_refused_before_anything_runs() {
        struct Never;
        impl RunScript for Never {
            fn run(&self, _: &Path, _: &Path, _: &[(&str, String)]) -> Result<String> {
                panic!("LAMMPS was started")
            }
        }
        let folder = tempfile::tempdir().unwrap();
        let message = measure(&Never, folder.path(), &table(), "Cu", None).unwrap_err().to_string();
        assert!(message.contains("table of Ca, without Cu"), "{message}");
    }
}
