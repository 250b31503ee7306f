//! Properties of the crystal of a potential at 0 K, measured with LAMMPS.
//!
//! The scripts are `lammps-inputs/properties/*.in`; each prints its results as lines `RES name value` and can be run
//! by hand. [`measure`] runs the same files.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde::{Deserialize, Serialize};

use crate::atoms::lammps_command::without_relative_libraries;
use crate::atoms::potential::SetflHeader;
use crate::error::{Error, LammpsFailure, Result};
use crate::interface::Cubic;
use crate::sys;
use crate::units::J_M2_PER_EV_A2;

/// Runs LAMMPS scripts: the program, or a replay of recorded output.
pub trait RunScript {
    /// Runs `script` (an absolute path) in the working directory `folder`, with `-var name words...` for each of
    /// `vars`; several words define an index variable. Returns the screen output of LAMMPS.
    fn run(&self, folder: &Path, script: &Path, vars: &[(&str, String)]) -> Result<String>;
}

/// LAMMPS as a single process without a time limit.
#[derive(Debug, Clone)]
pub struct LmpCommand {
    pub program: PathBuf,
}

impl RunScript for LmpCommand {
    fn run(&self, folder: &Path, script: &Path, vars: &[(&str, String)]) -> Result<String> {
        let log = script.file_stem().map_or("log.lammps".into(), |s| format!("{}.log", s.to_string_lossy()));
        let mut command = Command::new(&self.program);
        // One thread: the cells are too small for more, and LAMMPS warns if the variable is not set.
        command.current_dir(folder).env("OMP_NUM_THREADS", "1").stdin(Stdio::null());
        command.arg("-in").arg(script).arg("-log").arg(log);
        without_relative_libraries(&mut command);
        sys::die_with_parent(&mut command);
        for (name, value) in vars {
            command.arg("-var").arg(name).args(value.split_whitespace());
        }
        let output = command.output().map_err(|source| match source.kind() {
            ErrorKind::NotFound if folder.is_dir() => Error::MissingProgram {
                program: self.program.display().to_string(),
                how: "install LAMMPS, or name its program".into(),
            },
            _ => Error::io("run", &self.program)(source),
        })?;
        let printed = String::from_utf8_lossy(&output.stdout).into_owned();
        let complaint = |text: &str| text.lines().find(|l| l.starts_with("ERROR")).map(str::to_owned);
        let failed = |failure| Error::Lammps { folder: folder.to_path_buf(), failure };
        if let Some(line) = complaint(&printed).or_else(|| complaint(&String::from_utf8_lossy(&output.stderr))) {
            return Err(failed(LammpsFailure::Message(line)));
        }
        match (output.status.code(), output.status.signal()) {
            (Some(0), _) if printed.contains("Total wall time") => Ok(printed),
            (Some(0), _) => Err(failed(LammpsFailure::Unfinished)),
            (Some(code), _) => Err(failed(LammpsFailure::Status(code))),
            (None, signal) => Err(failed(LammpsFailure::Signal(signal.unwrap_or(0)))),
        }
    }
}

/// Values of all lines `RES name value` of the output.
///
/// # Errors
/// `Error::Lammps` if a value is not a finite number.
pub fn results(folder: &Path, printed: &str) -> Result<BTreeMap<String, f64>> {
    let mut found = BTreeMap::new();
    for line in printed.lines().filter(|l| l.starts_with("RES ")) {
        let mut words = line.split_whitespace().skip(1);
        match (words.next(), words.next().and_then(|v| v.parse::<f64>().ok()).filter(|v| v.is_finite())) {
            (Some(name), Some(value)) => found.insert(name.to_owned(), value),
            _ => {
                let failure = LammpsFailure::Output(format!("its result line '{line}' has no finite value"));
                return Err(Error::Lammps { folder: folder.to_path_buf(), failure });
            }
        };
    }
    Ok(found)
}

/// Properties of the fcc crystal of a potential at 0 K.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Properties {
    pub a0_angstrom: f64,
    /// Energy per atom of isolated atoms minus that of the crystal, eV.
    pub cohesive_energy_ev: f64,
    pub c11_gpa: f64,
    pub c12_gpa: f64,
    pub c44_gpa: f64,
    /// Contact modulus E* of the (001) surface, computed from the elastic constants, GPa.
    pub contact_modulus_gpa: f64,
    /// Vacancy formation energy, relaxed at fixed volume, eV.
    pub vacancy_ev: f64,
    /// Surface energy of (100), relaxed, J/m².
    pub surface_j_m2: f64,
    /// Intrinsic (stable) and unstable stacking-fault energy on (111), relaxed along the normal, J/m².
    pub stacking_fault_j_m2: f64,
    pub unstable_fault_j_m2: f64,
    /// Energy per atom of hcp minus that of fcc, eV.
    pub hcp_minus_fcc_ev: f64,
}

/// Strain of the central differences. Relative errors: 1e-6 from third-order elastic constants (strain squared), 1e-7
/// from rounding of the printed stresses.
const STRAIN: f64 = 1e-3;
const GPA_PER_BAR: f64 = 1e-4;
/// File name of the copy of the table in `folder`; LAMMPS splits paths at spaces.
const TABLE: &str = "potential.eam.alloy";

const SCRIPTS: [(&str, &str); 5] = [
    ("lattice.in", include_str!("../../lammps-inputs/properties/lattice.in")),
    ("elastic.in", include_str!("../../lammps-inputs/properties/elastic.in")),
    ("vacancy.in", include_str!("../../lammps-inputs/properties/vacancy.in")),
    ("surface.in", include_str!("../../lammps-inputs/properties/surface.in")),
    ("stacking_fault.in", include_str!("../../lammps-inputs/properties/stacking_fault.in")),
];

/// Measures the fcc crystal of `element` in the table `setfl`; `a0_angstrom` is the initial value of the lattice
/// constant. Scripts, a copy of the table and the logs remain in `folder`, which is created if necessary. Takes
/// seconds on one core.
///
/// # Errors
/// `Error::Format` if the table is damaged or lacks the element; `Error::Lammps` if LAMMPS fails or a result is
/// missing; `Error::Input` if the measured elastic constants violate crystal stability.
pub fn measure(
    lammps: &dyn RunScript,
    folder: &Path,
    setfl: &Path,
    element: &str,
    a0_angstrom: f64,
) -> Result<Properties> {
    SetflHeader::read(setfl)?.element(setfl, element)?;
    std::fs::create_dir_all(folder).map_err(Error::io("make", folder))?;
    let folder = &folder.canonicalize().map_err(Error::io("open", folder))?;
    std::fs::copy(setfl, folder.join(TABLE)).map_err(Error::io("copy", setfl))?;

    let mut measured = BTreeMap::new();
    let mut a0 = a0_angstrom;
    for (name, text) in SCRIPTS {
        let script = folder.join(name);
        std::fs::write(&script, text).map_err(Error::io("write", &script))?;
        let vars = [
            ("potential", TABLE.to_owned()),
            ("element", element.to_owned()),
            ("a0", format!("{a0:.10}")),
            ("strain", STRAIN.to_string()),
        ];
        measured.extend(results(folder, &lammps.run(folder, &script, &vars)?)?);
        // `lattice.in` comes first: the other scripts use the relaxed lattice constant.
        a0 = measured.get("a0").copied().unwrap_or(a0);
    }
    derive(folder, &measured)
}

/// Converts the script results (bar, eV, eV/Å²) to [`Properties`].
fn derive(folder: &Path, measured: &BTreeMap<String, f64>) -> Result<Properties> {
    let get = |name: &str| {
        measured.get(name).copied().ok_or_else(|| Error::Lammps {
            folder: folder.to_path_buf(),
            failure: LammpsFailure::Output(format!("it printed no line 'RES {name}'")),
        })
    };
    // Stress is minus the pressure tensor.
    let constant = |c: &str| -> Result<f64> {
        Ok(-(get(&format!("{c}_plus"))? - get(&format!("{c}_minus"))?) / (2.0 * STRAIN) * GPA_PER_BAR)
    };
    let (c11_gpa, c12_gpa, c44_gpa) = (constant("xx")?, constant("yy")?, constant("xy")?);
    let slide = (1..=10).map(|k| get(&format!("fault_{k}"))).collect::<Result<Vec<f64>>>()?;
    // The fault is a minimum at the end of the path. Along -[11-2] the energy rises all the way, to 0.0125 instead of
    // 0.0003 eV/Å², as planes end above each other.
    if slide[9] >= slide[8] {
        let output = "the energy of its stacking fault rises to the end of the slip: the direction is not [11-2]";
        return Err(Error::Lammps { folder: folder.to_path_buf(), failure: LammpsFailure::Output(output.into()) });
    }
    Ok(Properties {
        a0_angstrom: get("a0")?,
        cohesive_energy_ev: -get("energy")?,
        c11_gpa,
        c12_gpa,
        c44_gpa,
        contact_modulus_gpa: Cubic::new(c11_gpa, c12_gpa, c44_gpa)?.contact_modulus(),
        vacancy_ev: get("vacancy")?,
        surface_j_m2: get("surface")? * J_M2_PER_EV_A2,
        stacking_fault_j_m2: slide[9] * J_M2_PER_EV_A2,
        unstable_fault_j_m2: slide.iter().fold(0.0f64, |a, &b| a.max(b)) * J_M2_PER_EV_A2,
        hcp_minus_fcc_ev: get("energy_hcp")? - get("energy")?,
    })
}

/// Card of a potential (`potentials/Ca.toml`): provenance and measured properties.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Card {
    pub file: String,
    /// BLAKE3 hash of the table, hexadecimal.
    pub blake3: String,
    pub licence: String,
    pub element: String,
    pub style: String,
    pub units: String,
    /// Functional form and reference of the fit.
    pub source: String,
    pub measured: Measured,
    /// Stated values, and tolerances of a measurement in the same units.
    pub properties: Properties,
    pub tolerance: Properties,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measured {
    pub date: String,
    pub lammps: String,
}

impl Card {
    /// The card of the generated calcium-like potential.
    ///
    /// # Errors
    /// `Error::Format` if the embedded file is not a valid card.
    pub fn calcium() -> Result<Card> {
        let text = include_str!("../../potentials/Ca.toml");
        toml::from_str(text).map_err(|e| Error::format("potentials/Ca.toml", e.message(), "a potential's card"))
    }

    /// One sentence for each property of `found` that deviates from the stated value by more than its tolerance.
    pub fn deviations(&self, found: &Properties) -> Vec<String> {
        let columns = [found, &self.properties, &self.tolerance].map(named);
        let mut list = Vec::new();
        for ((found, stated), tolerance) in columns[0].iter().zip(columns[1]).zip(columns[2]) {
            // Also true for NaN.
            if (found.1 - stated.1).abs().partial_cmp(&tolerance.1).is_none_or(|o| o.is_gt()) {
                list.push(format!("{} is {}, stated {} ± {}", found.0, found.1, stated.1, tolerance.1));
            }
        }
        list
    }
}

fn named(p: &Properties) -> [(&'static str, f64); 11] {
    [
        ("a0_angstrom", p.a0_angstrom),
        ("cohesive_energy_ev", p.cohesive_energy_ev),
        ("c11_gpa", p.c11_gpa),
        ("c12_gpa", p.c12_gpa),
        ("c44_gpa", p.c44_gpa),
        ("contact_modulus_gpa", p.contact_modulus_gpa),
        ("vacancy_ev", p.vacancy_ev),
        ("surface_j_m2", p.surface_j_m2),
        ("stacking_fault_j_m2", p.stacking_fault_j_m2),
        ("unstable_fault_j_m2", p.unstable_fault_j_m2),
        ("hcp_minus_fcc_ev", p.hcp_minus_fcc_ev),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Output of LAMMPS for the calcium-type potential, by script.
    const RECORDED: [(&str, &str); 5] = [
        ("lattice.in", "noise\nRES a0 5.5883981287\nRES energy -1.8400004595\nRES energy_hcp -1.8382084265\n"),
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

    /// Replays `RECORDED`, with one replacement.
    struct Replay(&'static str, &'static str);

    impl RunScript for Replay {
        fn run(&self, folder: &Path, script: &Path, vars: &[(&str, String)]) -> Result<String> {
            assert!(script.is_absolute() && script.is_file() && folder.join(TABLE).is_file());
            let name = script.file_name().unwrap().to_str().unwrap();
            // The relaxed lattice constant reaches the later scripts.
            let a0 = &vars.iter().find(|(n, _)| *n == "a0").unwrap().1;
            assert_eq!(a0, if name == "lattice.in" { "5.6000000000" } else { "5.5883981287" });
            let text = RECORDED.iter().find(|(n, _)| *n == name).unwrap().1;
            Ok(text.replace(self.0, self.1))
        }
    }

    fn table() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("potentials/Ca.eam.alloy")
    }

    #[test]
    fn printed_results_become_properties_with_units() {
        let folder = tempfile::tempdir().unwrap();
        let found = measure(&Replay("noise", ""), &folder.path().join("new"), &table(), "Ca", 5.6).unwrap();
        let card = Card::calcium().unwrap();
        assert!(card.deviations(&found).is_empty(), "{:?}", card.deviations(&found));
        let wrong = Properties { vacancy_ev: f64::NAN, a0_angstrom: 5.6, ..found };
        let list = card.deviations(&wrong);
        assert!(list.len() == 2 && list[0].starts_with("a0_angstrom is 5.6, stated 5.5884 ± "), "{list:?}");
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
            let message = measure(&Replay(good, bad), folder.path(), &table(), "Ca", 5.6).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
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
        let message = measure(&Never, folder.path(), &table(), "Cu", 3.6).unwrap_err().to_string();
        assert!(message.contains("table of Ca, without Cu"), "{message}");
    }

    #[test]
    fn a_missing_program_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let script = folder.path().join("x.in");
        let error = LmpCommand { program: "/no/such/lmp".into() }.run(folder.path(), &script, &[]).unwrap_err();
        assert_eq!(error.exit_code(), 5, "{error}");
        // Programs that end without the output of LAMMPS: `true` does not finish the script, `false` returns status
        // 1.
        for (program, failure) in [("true", LammpsFailure::Unfinished), ("false", LammpsFailure::Status(1))] {
            match (LmpCommand { program: program.into() }).run(folder.path(), &script, &[]) {
                Err(Error::Lammps { failure: found, .. }) => assert_eq!(found, failure),
                other => panic!("{other:?}"),
            }
        }
    }
}
