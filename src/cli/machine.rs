//! Where a command runs and how it starts LAMMPS there, and its arguments for a job.

use crate::cluster::{Engine, Machine, SubmittedCommand, find};
use crate::{Error, Result};
use asperity_atoms::lammps_command::LammpsCommand;
use std::path::{Path, PathBuf};

/// Where a command runs.
#[derive(Debug, Clone, Default, clap::Args)]
pub(super) struct MachineFlags {
    /// Run on this machine of machines.toml: here, or as jobs of Slurm (docs/cluster.md).
    #[arg(long, value_name = "NAME")]
    machine: Option<String>,
    /// File of machines. Default: machines.toml here, then in ~/.config/asperity.
    #[arg(long, value_name = "FILE", requires = "machine")]
    machines: Option<PathBuf>,
}

/// How LAMMPS is started. These belong to the machine, and results do not depend on them.
#[derive(Debug, Clone, Default, clap::Args)]
pub(super) struct LammpsFlags {
    /// LAMMPS, instead of atoms.program: a program of the search path, or a path.
    #[arg(long, value_name = "PROGRAM")]
    lammps: Option<PathBuf>,
    /// MPI ranks of LAMMPS, instead of atoms.ranks.
    #[arg(long, value_name = "N")]
    ranks: Option<usize>,
    /// Words before LAMMPS, as "srun --mpi=pmix -n {ranks}". Default: mpirun -np {ranks} for more than one rank.
    #[arg(long, value_name = "WORDS")]
    launcher: Option<String>,
    /// Further arguments of LAMMPS, separated by spaces.
    #[arg(long, value_name = "ARGS", allow_hyphen_values = true)]
    lammps_args: Option<String>,
}

impl LammpsFlags {
    pub(super) fn command(&self) -> LammpsCommand {
        let args = self.lammps_args.as_deref().unwrap_or_default().split_whitespace().map(str::to_string).collect();
        LammpsCommand { program: self.lammps.clone(), ranks: self.ranks, launcher: self.launcher.clone(), args }
    }
}

/// Flags with a value that belong to a machine, of which a task has its own, or say what to do instead of running.
const OF_MACHINE: [&str; 9] = [
    "--machine",
    "--machines",
    "--threads",
    "--device",
    "--lammps",
    "--ranks",
    "--launcher",
    "--lammps-args",
    "--export",
];

impl MachineFlags {
    /// Name and settings of the machine; flags overrule how it starts LAMMPS. Default: this machine.
    ///
    /// # Errors
    /// Those of [`find`].
    pub(super) fn find(&self, lammps: &LammpsFlags) -> Result<(String, Machine)> {
        let mut machine = match &self.machine {
            Some(name) => find(name, self.machines.as_deref())?,
            None => Machine::default(),
        };
        machine.lammps = machine.lammps.overruled_by(&lammps.command());
        // Points and tasks have other working folders.
        for program in [&mut machine.program, &mut machine.lammps.program].into_iter().flatten() {
            if program.components().count() > 1 {
                *program = std::path::absolute(&*program).map_err(Error::io("find", &*program))?;
            }
        }
        Ok((self.machine.clone().unwrap_or_default(), machine))
    }
}

/// Whether the machine runs commands as jobs.
pub(super) fn submits(machine: &Machine) -> bool {
    machine.engine == Engine::Slurm
}

/// The command line of this process, for a job that leaves the file `results` in its folder.
///
/// # Errors
/// `Input` for arguments that are no text; `Io` without a working folder.
pub(super) fn own_command(results: &str) -> Result<SubmittedCommand> {
    let folder = std::env::current_dir().map_err(Error::io("find", Path::new(".")))?;
    let text = |word: std::ffi::OsString| {
        let shown = word.to_string_lossy().into_owned();
        word.into_string().map_err(|_| Error::input("command line", "argument", shown, "text in UTF-8"))
    };
    let arguments = std::env::args_os().skip(1).map(text).collect::<Result<Vec<_>>>()?;
    Ok(SubmittedCommand { folder, arguments: without_machine(arguments), results: results.into() })
}

/// Arguments without the flags that choose where and how they run.
fn without_machine(words: Vec<String>) -> Vec<String> {
    let mut retained = Vec::new();
    let mut words = words.into_iter();
    while let Some(word) = words.next() {
        let flag = word.split('=').next().unwrap_or_default();
        if !OF_MACHINE.contains(&flag) {
            retained.push(word);
        } else if !word.contains('=') {
            words.next();
        }
    }
    retained
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tasks have another working folder than the command that submits them.
    #[test]
    fn programs_become_absolute() {
        let program_of = |program: &str| {
            let flags = LammpsFlags { lammps: Some(program.into()), ..LammpsFlags::default() };
            MachineFlags::default().find(&flags).expect("this machine").1.lammps.program.expect("given")
        };
        assert!(program_of("bin/lmp").is_absolute() && program_of("bin/lmp").ends_with("bin/lmp"));
        assert_eq!(program_of("lmp"), Path::new("lmp"));
    }

    #[test]
    fn flags_of_the_machine_are_left_out() {
        let arguments = "run --machine cluster a.toml --ranks=4 --lammps-args -echo --out=b --threads 2 --json";
        let kept = without_machine(arguments.split(' ').map(str::to_string).collect());
        assert_eq!(kept, ["run", "a.toml", "--out=b", "--json"]);
    }
}
