//! Runs a job with LAMMPS as a library in this process, which relaxes the steps (`host_relaxation`) and gives an elastic base its forces at
//! every evaluation.
//!
//! The process is a child of the program that monitors the run ([`super::engine`]), because builds of LAMMPS without exceptions end the
//! process at an error. It takes the arguments of the `lmp` program, prints what that prints, and writes the same files. Under `mpirun`
//! each rank computes the forces of the whole base.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use super::block::BaseKind;
use super::elastic_base::ElasticBase;
use super::force_constants::{self, ForceConstantInput, ForceConstants};
use super::host_relaxation::HostRelaxation;
use super::job::{Job, POTENTIAL_FILE};
use super::lammps_command::{LammpsCommand, is_accelerated};
use super::load_history::LoadHistory;
use super::potential::SetflHeader;
use super::run_script::LmpCommand;
use super::scripts::{SETUP, Script};
use super::search_path::search_path;
use crate::lammps_library::{self, LammpsInstance};
use asperity_grid::{Error, Result};
use asperity_surface::files::beneath::guard;
use asperity_surface::files::json;

/// Id of the fix of the base in `setup.in`.
const FIX: &str = "base";

/// Library and arguments of a run in the working folder.
#[derive(Debug, Clone)]
pub struct HostRun {
    /// Path of the shared library, or a name that the loader finds.
    pub library: PathBuf,
    /// Date of the version of the `lmp` program, as 20210929.
    pub version: i32,
    /// MPI ranks that the launcher starts.
    pub ranks: usize,
    /// Arguments of `lmp`, without `-in`.
    pub args: Vec<String>,
}

impl HostRun {
    /// Runs the job in the working folder to its end.
    ///
    /// # Errors
    /// `MissingProgram` without a library, `Lammps` if LAMMPS reports an error or has another version, `Format`, `Io`.
    pub fn run(&self) -> Result<()> {
        let folder = Path::new(".");
        guard(folder);
        let job = Job::open(folder)?;
        let constants: ForceConstants = json::read(&folder.join(force_constants::FILE))?;
        let mut lammps = LammpsInstance::open(&self.library, &self.args).map_err(missing_library)?;
        let failed = |description: String| Error::lammps(folder, description);
        let version = lammps.version();
        if version != self.version {
            let description = format!(
                "its library has the version {version}, its program {}: they belong to two installations",
                self.version
            );
            return Err(failed(description));
        }
        // Otherwise each rank would run the whole job in the same folder.
        if usize::try_from(lammps.ranks()) != Ok(self.ranks) {
            let description = format!(
                "its library runs on {} ranks of {}: it was built with another MPI than the launcher's",
                lammps.ranks(),
                self.ranks
            );
            return Err(failed(description));
        }
        let script = job.script();
        let step = script.step().ok_or_else(|| failed("no script of load steps".into()))?;
        let history = LoadHistory::read(folder)?;
        let mut load = history.last().map_or(0.0, |r| r.load);
        let mut next = history.last().map_or(0, |r| r.step + 1);
        header(&script).try_for_each(|line| lammps.command(line)).map_err(failed)?;
        let relaxation = HostRelaxation::new(&job, &constants, is_accelerated(&self.args));
        relaxation.begin(&mut lammps)?;
        loop {
            let pressure = job.pressure_at(next, load);
            let set_up = |lammps: &mut LammpsInstance| set_up(lammps, &job, &constants, pressure);
            relaxation.step(&mut lammps, &set_up, &step, (next, pressure))?;
            let (reached, done) = lammps.step_ended().map_err(failed)?;
            if done {
                break;
            }
            load = reached;
            next += 1;
        }
        lammps.close();
        Ok(())
    }
}

/// Brings LAMMPS to the state before a step, with an elastic base under the mean pressure `pressure`, eV/Å³.
fn set_up(lammps: &mut LammpsInstance, job: &Job, constants: &ForceConstants, pressure: f64) -> Result<()> {
    let failed = |description: String| Error::lammps(&job.folder, description);
    // Frees the boundary of the previous step.
    lammps.clear().map_err(failed)?;
    lammps.file(SETUP.file).map_err(failed)?;
    if job.spec.block.base == BaseKind::Elastic {
        let mut base = ElasticBase::new(&job.block(), constants, pressure)?;
        let atoms = base.atoms();
        let evaluate = Box::new(move |x: &[[f64; 3]], f: &mut [[f64; 3]]| base.forces(x, f));
        lammps.set_boundary(FIX, atoms, evaluate).map_err(failed)?;
    }
    Ok(())
}

/// Name of the program, which has the hidden command `lammps-host`.
const PROGRAM: &str = "asperity";

/// The running program, where it has the command `lammps-host`.
static OWN_PROGRAM: OnceLock<PathBuf> = OnceLock::new();

/// Makes the running program the default host, whatever the name of its file is. `main` calls it: another program that uses the library has
/// no such command.
pub fn use_this_program() {
    if let Ok(program) = std::env::current_exe() {
        OWN_PROGRAM.get_or_init(|| program);
    }
}

/// The running program after [`use_this_program`], otherwise `asperity` of the search path.
///
/// # Errors
/// `MissingProgram`.
fn host_program() -> Result<PathBuf> {
    let own = OWN_PROGRAM.get().cloned();
    let program = own.or_else(|| search_path(Path::new(PROGRAM))).ok_or_else(|| Error::MissingProgram {
        program: PROGRAM.into(),
        how: "an elastic base and the harmonic relaxation run LAMMPS as a library in this program: put it into the search path".into(),
    })?;
    // The run has another working folder.
    std::path::absolute(&program).map_err(Error::io("find", &program))
}

/// A program that runs LAMMPS as a library, and its arguments before those of LAMMPS.
pub(super) struct HostCommand {
    pub program: PathBuf,
    pub arguments: Vec<OsString>,
}

impl HostCommand {
    /// The host for the LAMMPS `program` of this version: `host`, or the running program. `elastic`: for an elastic base; `is_open`: the job can
    /// do without.
    ///
    /// # Errors
    /// `MissingProgram` without host or library, for a version that is no date, and for accelerated styles without an elastic base.
    pub(super) fn find(
        host: Option<&Path>,
        program: &Path,
        version: &str,
        start: &LammpsCommand,
        (elastic, is_open): (bool, bool),
    ) -> Result<HostCommand> {
        if !elastic && start.chooses_styles() {
            return Err(Error::MissingProgram {
                program: "the harmonic relaxation with accelerated styles of LAMMPS".into(),
                how: "it needs positions and forces on the processor".into(),
            });
        }
        // A job that can do without uses no library of another installation.
        let library = if is_open { find_own_library(program, version) } else { find_library(program) };
        let arguments = arguments(&library.map_err(missing_library)?, version, start.ranks())?;
        Ok(HostCommand { program: host.map_or_else(host_program, |host| Ok(host.to_path_buf()))?, arguments })
    }
}

/// The program's arguments before those of LAMMPS with this library and version.
///
/// # Errors
/// `MissingProgram` for a version that is no date.
fn arguments(library: &Path, version: &str, ranks: usize) -> Result<Vec<OsString>> {
    let no_date = || missing_library(format!("its program has the version {version:?}, which is no date"));
    let date = version_number(version).ok_or_else(no_date)?.to_string();
    // Each of several ranks has a core of its own.
    let threads = if ranks > 1 { 1 } else { rayon::current_num_threads() }.to_string();
    let ranks = ranks.to_string();
    let words = ["lammps-host", "--threads", &threads, "--version-date", &date, "--ranks", &ranks, "--library"];
    Ok(words.map(OsString::from).into_iter().chain([library.into(), "--".into()]).collect())
}

fn missing_library(reason: String) -> Error {
    Error::MissingProgram {
        program: format!("the shared library of LAMMPS ({reason})"),
        how: "an elastic base and the harmonic relaxation need it in addition to the program (Debian: apt install lammps has both)".into(),
    }
}

/// Writes the force constants of the crystal of a job to its folder. `proceed` is called before they are measured.
///
/// # Errors
/// Those of `proceed` and of [`ForceConstants::measure`].
pub(super) fn prepare(
    job: &Job,
    lammps: &Path,
    lammps_version: &str,
    proceed: &mut dyn FnMut() -> Result<()>,
) -> Result<()> {
    let table = job.folder.join(POTENTIAL_FILE);
    let crystal = ForceConstantInput {
        table: POTENTIAL_FILE,
        element: &job.spec.element,
        a0_angstrom: job.spec.block.a0,
        cutoff_angstrom: SetflHeader::read(&table)?.cutoff_angstrom,
        highest_pressure: job.highest_pressure(),
    };
    let lammps = LmpCommand { program: lammps.to_path_buf() };
    let constants = ForceConstants::measure(&lammps, &job.folder, crystal, lammps_version, proceed)?;
    json::write(&job.folder.join(force_constants::FILE), &constants)
}

/// Commands before the loop of steps.
fn header(script: &Script) -> impl Iterator<Item = &'static str> {
    let lines = script.text.lines().take_while(|l| *l != "label step");
    lines.filter(|l| !l.trim_start().starts_with('#') && !l.trim().is_empty())
}

/// Candidates for the library of a program: in its folder, in `lib` and `lib64` next to that, and as the loader finds it.
fn libraries(program: &Path) -> Vec<PathBuf> {
    let names = ["liblammps.so.0", "liblammps.so"];
    let own = program.canonicalize().ok().and_then(|p| Some(p.parent()?.to_path_buf()));
    let folders = own.iter().flat_map(|f| [f.clone(), f.join("../lib"), f.join("../lib64")]);
    let installed = folders.flat_map(|f| names.map(|n| f.join(n))).filter(|p| p.is_file());
    installed.chain(names.map(PathBuf::from)).collect()
}

/// Name of the shared library of a LAMMPS program, which an elastic base and the harmonic relaxation use.
///
/// # Errors
/// One line: why none can be used.
pub fn find_library(program: &Path) -> std::result::Result<PathBuf, String> {
    first_usable(libraries(program))
}

/// The same, where the library is that of the program with this version: one next to it that names the version, or the loader's if the
/// program loads it, too.
///
/// # Errors
/// As [`find_library`], and for a version that is no date.
pub fn find_own_library(program: &Path, version: &str) -> std::result::Result<PathBuf, String> {
    if version_number(version).is_none() {
        return Err(format!("the program's version {version:?} is no date"));
    }
    let has = |file: &Path, word: &str| std::fs::read(file).is_ok_and(|bytes| contains(&bytes, word.as_bytes()));
    let date = version.split(" - ").next().unwrap_or(version);
    let loads_it = has(program, "liblammps.so");
    let own = |library: &PathBuf| if library.components().count() > 1 { has(library, date) } else { loads_it };
    first_usable(libraries(program).into_iter().filter(own))
}

fn contains(text: &[u8], word: &[u8]) -> bool {
    text.windows(word.len()).any(|w| w == word)
}

fn first_usable(libraries: impl IntoIterator<Item = PathBuf>) -> std::result::Result<PathBuf, String> {
    let mut reason = String::from("none");
    for library in libraries {
        match lammps_library::check(&library) {
            Ok(()) => return Ok(library),
            Err(e) => reason = e,
        }
    }
    Err(reason)
}

/// Date of a version of LAMMPS ("29 Sep 2021 - Update 2") as 20210929.
fn version_number(version: &str) -> Option<i32> {
    const MONTHS: &str = "JanFebMarAprMayJunJulAugSepOctNovDec";
    let mut tokens = version.split_whitespace();
    let (day, month, year) = (tokens.next()?, tokens.next()?, tokens.next()?);
    let month = MONTHS.find(month.get(..3)?).filter(|node| node % 3 == 0)? / 3 + 1;
    Some(year.parse::<i32>().ok()? * 10_000 + month as i32 * 100 + day.parse::<i32>().ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scripts::{DISPLACEMENT_RAMP, NVT, PRESCRIBED_LOAD};

    #[test]
    fn a_version_that_is_no_date_is_refused() {
        let library = Path::new("/usr/lib/liblammps.so.0");
        let actual = arguments(library, "2 Aug 2023", 2).expect("a date");
        assert!(actual.contains(&library.into()) && actual.contains(&"20230802".into()), "{actual:?}");
        let error = arguments(library, "unknown", 1).expect_err("refused");
        assert!(error.exit_code() == 5 && error.to_string().contains("no date"), "{error}");
    }

    #[test]
    fn versions_are_dates() {
        assert_eq!(version_number("29 Sep 2021 - Update 2"), Some(20_210_929));
        assert_eq!(version_number("2 Aug 2023"), Some(20_230_802));
        assert_eq!(version_number("unknown"), None);
    }

    /// The loop of the scripts is the one that the host runs.
    #[test]
    fn scripts_are_a_loop_of_setup_and_step() {
        for script in [DISPLACEMENT_RAMP, PRESCRIBED_LOAD] {
            let step = script.step().expect("a loop");
            let lines: Vec<&str> = script.text.lines().skip_while(|l| *l != "label step").collect();
            let included = format!("include {}", step.file);
            let expected = [
                "label step",
                "clear",
                "include setup.in",
                &included,
                "if \"${done}\" then \"jump SELF finished\"",
                "jump SELF step",
                "label finished",
            ];
            assert_eq!(lines, expected, "{}", script.file);
            // Continued lines would be several commands.
            assert!(header(&script).all(|l| l.starts_with("variable ") && !l.ends_with('&')), "{}", script.file);
        }
        assert_eq!(NVT.step(), None);
    }
}
