//! `asperity lammps-host`: runs the job in the working folder with LAMMPS as a library. `run` and `atoms run` start it in place of `lmp` for
//! a block on an elastic base.

use super::output;
use crate::{Error, Result};
use asperity_atoms::lammps_host::HostRun;
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
pub(super) struct LammpsHostArgs {
    /// The shared library: its path, or a name that the loader finds.
    #[arg(long, value_name = "FILE")]
    library: PathBuf,
    /// Date of the version of the lmp program, as 20210929.
    #[arg(long, value_name = "DATE")]
    version_date: i32,
    /// MPI ranks that the launcher starts.
    #[arg(long, default_value_t = 1, value_name = "N")]
    ranks: usize,
    /// Arguments of lmp without -in.
    #[arg(last = true)]
    args: Vec<String>,
}

impl LammpsHostArgs {
    /// Reports errors as LAMMPS does, for the program that reads its output.
    pub(super) fn execute(self) -> Result<ExitCode> {
        let run = HostRun { library: self.library, version: self.version_date, ranks: self.ranks, args: self.args };
        let Err(error) = run.run() else { return Ok(ExitCode::SUCCESS) };
        let what = match &error {
            Error::Lammps { failure, .. } => failure.to_string(),
            other => other.to_string(),
        };
        output::eprint(&format!("ERROR: {what}"));
        Ok(ExitCode::from(error.exit_code()))
    }
}
