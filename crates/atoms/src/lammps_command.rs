//! How LAMMPS is started on a machine.

use super::search_path::search_path;
use super::styles::Styles;
use asperity_grid::sys::group::End;
use asperity_grid::{Error, Result, sys};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Place of the number of ranks in a launcher.
const RANKS: &str = "{ranks}";

/// Flags of LAMMPS that choose accelerated styles.
const SUFFIX: [&str; 2] = ["-sf", "-suffix"];

/// Key of an error about the arguments.
pub const ARGUMENTS: &str = "arguments";

/// Most MPI ranks of a launcher.
const MOST_RANKS: usize = 65_536;

/// Program, ranks, launcher and arguments of LAMMPS. They belong to a machine: results do not depend on them.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LammpsCommand {
    /// Default: that of the scene, or `lmp` or `lammps` of the search path.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub program: Option<PathBuf>,
    /// MPI ranks. Default: those of the scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ranks: Option<usize>,
    /// Words before the program, separated by spaces; `{ranks}` is replaced by the number of ranks. Default: `mpirun -np {ranks}` for
    /// more than one rank.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub launcher: Option<String>,
    /// Further arguments of LAMMPS.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub args: Vec<String>,
}

/// Whether arguments choose styles that may keep positions and forces on a device; those with the suffix `opt` do not.
pub(super) fn is_accelerated(args: &[String]) -> bool {
    args.windows(2).any(|pair| SUFFIX.contains(&pair[0].as_str()) && pair[1] != "opt")
}

impl LammpsCommand {
    /// What another command sets is replaced by it.
    #[must_use]
    pub fn overruled_by(&self, other: &LammpsCommand) -> LammpsCommand {
        LammpsCommand {
            program: other.program.clone().or_else(|| self.program.clone()),
            ranks: other.ranks.or(self.ranks),
            launcher: other.launcher.clone().or_else(|| self.launcher.clone()),
            args: if other.args.is_empty() { self.args.clone() } else { other.args.clone() },
        }
    }

    pub(super) fn ranks(&self) -> usize {
        self.ranks.unwrap_or(1)
    }

    /// How LAMMPS is ended: a launcher ends processes that it started elsewhere.
    pub(super) fn end(&self) -> End {
        if self.launcher.is_some() || self.ranks() > 1 { End::Gently } else { End::AtOnce }
    }

    /// Whether the arguments choose the accelerated styles.
    pub(super) fn chooses_styles(&self) -> bool {
        self.args.iter().any(|a| SUFFIX.contains(&a.as_str()))
    }

    /// Whether a LAMMPS with these styles can run jobs with the accelerator that the arguments choose.
    ///
    /// # Errors
    /// `Input` with what is missing.
    pub(super) fn check_accelerator(&self, styles: &Styles) -> Result<()> {
        let given = |flags: [&str; 2], value: &str| {
            self.args.windows(2).any(|arguments| flags.contains(&arguments[0].as_str()) && arguments[1] == value)
        };
        let (kokkos, gpu) = (given(SUFFIX, "kk") || given(["-k", "-kokkos"], "on"), given(SUFFIX, "gpu"));
        let accepted = match () {
            () if kokkos && !styles.has("package", "KOKKOS") => "a LAMMPS with the package KOKKOS, or no -k and -sf kk",
            // Other minimisers keep no momentum, and a style without KOKKOS stops LAMMPS.
            () if kokkos && !styles.has("minimize", "fire/kk") => {
                "a LAMMPS with the minimize style fire/kk, a later one, or no -k and -sf kk"
            }
            () if gpu && !styles.has("package", "GPU") => "a LAMMPS with the package GPU, or no -sf gpu",
            // Lists built on the GPU do not leave out pairs of types, which hybrid styles do.
            () if gpu && !given(["neigh", "neigh"], "no") => {
                "-sf gpu -pk gpu N neigh no, with N GPUs: hybrid pair styles need neighbour lists of the processor"
            }
            () => return Ok(()),
        };
        Err(Error::input("LAMMPS", ARGUMENTS, self.args.join(" "), accepted))
    }

    /// The whole command, for people.
    pub fn line(&self, program: &Path) -> String {
        let command = self.start(program);
        let arguments = [command.get_program()].into_iter().chain(command.get_args()).map(|w| w.to_string_lossy());
        arguments.chain(self.args.iter().map(|a| a.into())).collect::<Vec<_>>().join(" ")
    }

    /// Whether this machine can start that many ranks. A launcher may start them on other machines.
    ///
    /// # Errors
    /// `Input` for more ranks than cores without a launcher; `MissingProgram` without the launcher's first word.
    pub(super) fn check(&self) -> Result<()> {
        let (ranks, cores) = (self.ranks(), std::thread::available_parallelism().map_or(1, |c| c.get()));
        let (largest, explanation) = match &self.launcher {
            Some(launcher) => (MOST_RANKS, format!("started by {launcher:?}")),
            None => (cores, "the cores of this machine; a launcher may start more".to_string()),
        };
        if ranks == 0 || ranks > largest {
            return Err(Error::input("LAMMPS", "ranks", ranks, format!("1 to {largest}, {explanation}")));
        }
        let first = match &self.launcher {
            Some(launcher) => launcher.split_whitespace().next(),
            None => (ranks > 1).then_some("mpirun"),
        };
        match first.filter(|word| launcher_program(word).is_none()) {
            Some("mpirun") => {
                let remedy = "install an MPI (Debian: apt install openmpi-bin) or run one rank".into();
                Err(Error::MissingProgram { program: "mpirun".into(), how: remedy })
            }
            Some(word) => {
                let remedy = "give the launcher of LAMMPS as a program of the search path or with its path".into();
                Err(Error::MissingProgram { program: word.into(), how: remedy })
            }
            None => Ok(()),
        }
    }

    /// The command up to and including the program.
    pub(super) fn start(&self, program: &Path) -> Command {
        let ranks = self.ranks().to_string();
        let launcher = match &self.launcher {
            Some(launcher) => launcher.clone(),
            None if self.ranks() > 1 => format!("mpirun -np {RANKS}"),
            None => String::new(),
        };
        let mut tokens = launcher.split_whitespace().map(|word| word.replace(RANKS, &ranks));
        let Some(first) = tokens.next() else { return Command::new(program) };
        // The run has another working folder.
        let mut command = Command::new(launcher_program(&first).unwrap_or_else(|| first.into()));
        if sys::is_root() {
            // Open MPI refuses to run as root without these variables; other launchers ignore them.
            command.env("OMPI_ALLOW_RUN_AS_ROOT", "1").env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1");
        }
        command.args(tokens).arg(program);
        command
    }
}

/// Path of the first word of a launcher: a file, if it has a separator, otherwise a program of the search path.
fn launcher_program(word: &str) -> Option<PathBuf> {
    let path = Path::new(word);
    let found = if word.contains('/') { path.is_file().then(|| path.to_path_buf()) } else { search_path(path) };
    std::path::absolute(found?).ok()
}

/// Removes empty and relative folders from the search path of libraries: they are the working folder, a job folder that may come from others.
pub(super) fn without_relative_libraries(command: &mut std::process::Command) {
    if let Some(folders) = std::env::var_os("LD_LIBRARY_PATH") {
        let absolute = std::env::split_paths(&folders).filter(|f| f.is_absolute());
        command.env("LD_LIBRARY_PATH", std::env::join_paths(absolute).unwrap_or_default());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(lammps: &LammpsCommand) -> Vec<String> {
        lammps.line(Path::new("/opt/lmp")).split(' ').map(str::to_string).collect()
    }

    #[test]
    fn the_launcher_receives_the_ranks() {
        let with = |ranks, launcher: Option<&str>| LammpsCommand {
            ranks: Some(ranks),
            launcher: launcher.map(str::to_string),
            ..LammpsCommand::default()
        };
        let launched = words(&with(4, Some("no-such-launcher --mpi=pmix -n {ranks}")));
        assert_eq!(launched, ["no-such-launcher", "--mpi=pmix", "-n", "4", "/opt/lmp"]);
        assert_eq!(words(&with(2, None))[1..], ["-np", "2", "/opt/lmp"]);
        assert_eq!(words(&with(1, None)), ["/opt/lmp"]);
    }

    /// The run has another working folder, so a path from here is made absolute.
    #[test]
    fn a_launcher_may_be_a_file() {
        let here = std::env::current_dir().expect("a folder");
        let file = tempfile::NamedTempFile::new_in(&here).expect("made");
        let name = file.path().file_name().and_then(|n| n.to_str()).expect("UTF-8");
        let command = |launcher: String| LammpsCommand { launcher: Some(launcher), ..LammpsCommand::default() };
        let relative = command(format!("./{name} -n {{ranks}}"));
        relative.check().expect("a file");
        assert_eq!(words(&relative)[0], here.join(name).display().to_string());
        assert!(command("./no-such-launcher".into()).check().is_err());
        assert!(words(&command("sh".into()))[0].starts_with('/'));
    }

    /// Cores of this machine bound the ranks without a launcher only.
    #[test]
    fn a_launcher_may_start_more_ranks_than_cores() {
        let command_of = |launcher: Option<&str>| LammpsCommand {
            ranks: Some(4096),
            launcher: launcher.map(str::to_string),
            ..LammpsCommand::default()
        };
        assert!(command_of(Some("env")).check().is_ok());
        assert!(command_of(None).check().expect_err("too many").to_string().contains("the cores of this machine"));
        let missing = command_of(Some("no-such-launcher -n {ranks}")).check().expect_err("missing").to_string();
        assert!(missing.contains("no-such-launcher"), "{missing}");
    }

    /// A program that has the package without the minimiser, as KOKKOS had before fire/kk, is refused with it.
    #[test]
    fn accelerators_that_cannot_run_jobs_are_refused_with_the_remedy() {
        let with = |args: &str, packages: &str, minimizers: &str| {
            let help =
                format!("Installed packages:\n\n{packages}\n\nList of styles\n\n* Minimize styles:\n\n{minimizers}\n");
            let args = args.split_whitespace().map(str::to_string).collect();
            LammpsCommand { args, ..LammpsCommand::default() }.check_accelerator(&Styles::parse(&help))
        };
        for (args, packages, minimizers, part) in [
            ("-k on g 1 -sf kk", "OPT", "fire", "the package KOKKOS"),
            ("-k on t 4", "KOKKOS", "fire", "fire/kk"),
            ("-sf gpu -pk gpu 1 neigh no", "OPT", "fire", "the package GPU"),
            ("-suffix gpu -pk gpu 1", "GPU", "fire", "neigh no"),
        ] {
            let refused = with(args, packages, minimizers).expect_err(args).to_string();
            assert!(refused.contains(part) && refused.contains(args), "{refused}");
        }
        for (args, packages, minimizers) in [
            ("-k on g 1 -sf kk", "KOKKOS", "fire fire/kk"),
            ("-sf gpu -pk gpu 1 neigh no", "GPU", "fire"),
            ("-sf omp -pk omp 4", "OPENMP", "fire"),
            ("-k off", "OPT", "fire"),
        ] {
            with(args, packages, minimizers).expect(args);
        }
    }

    #[test]
    fn what_is_set_overrules() {
        let scene = LammpsCommand { ranks: Some(2), program: Some("lmp".into()), ..LammpsCommand::default() };
        let machine =
            LammpsCommand { ranks: Some(8), args: vec!["-sf".into(), "omp".into()], ..LammpsCommand::default() };
        let combined = scene.overruled_by(&machine);
        assert_eq!((combined.ranks, combined.program, combined.args.len()), (Some(8), Some("lmp".into()), 2));
    }
}
