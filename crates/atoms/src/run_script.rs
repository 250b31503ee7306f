//! LAMMPS scripts that print their results: run as one process, output read.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::lammps_command::without_relative_libraries;
use asperity_grid::error::{Error, LammpsFailure, Result};
use asperity_grid::sys::group;
use asperity_surface::files::beneath::reach_folder;

/// Runs LAMMPS scripts: the program, or a replay of recorded output.
pub trait RunScript {
    /// Runs `script` (an absolute path) in the working directory `folder`, with `-var name words...` for each of
    /// `vars`; several words define an index variable. Returns the screen output of LAMMPS.
    fn run(&self, folder: &Path, script: &Path, vars: &[(&str, String)]) -> Result<String>;
}

/// Most bytes that a script may print: the largest prints 100 KB.
const MOST_BYTES: u64 = 64 << 20;

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
        let place = reach_folder(folder).map_err(Error::io("open", folder))?;
        command.current_dir(&place).env("OMP_NUM_THREADS", "1");
        command.arg("-in").arg(script).arg("-log").arg(log);
        without_relative_libraries(&mut command);
        for (name, value) in vars {
            command.arg("-var").arg(name).args(value.split_whitespace());
        }
        let output = group::probe(command, None, MOST_BYTES).map_err(|source| match source.kind() {
            ErrorKind::NotFound if folder.is_dir() => Error::MissingProgram {
                program: self.program.display().to_string(),
                how: "install LAMMPS, or name its program".into(),
            },
            _ => Error::io("run", &self.program)(source),
        })?;
        let printed = String::from_utf8_lossy(&output.stdout).into_owned();
        let complaint = |text: &str| text.lines().find(|l| l.starts_with("ERROR")).map(str::to_owned);
        let failed = |failure: LammpsFailure| Error::lammps(folder, failure);
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
    let mut results = BTreeMap::new();
    for line in printed.lines().filter(|l| l.starts_with("RES ")) {
        let mut tokens = line.split_whitespace().skip(1);
        match (tokens.next(), tokens.next().and_then(|v| v.parse::<f64>().ok()).filter(|v| v.is_finite())) {
            (Some(name), Some(value)) => results.insert(name.to_owned(), value),
            _ => {
                return Err(Error::lammps(folder, format!("its result line '{line}' has no finite value")));
            }
        };
    }
    Ok(results)
}

#[cfg(test)]
mod tests {
    use super::*;

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
