//! The program: parse, run one command, say what went wrong in one place.

use asperity::atoms::lammps_host;
use asperity::cli::{self, bug, output};
use std::process::ExitCode;

fn main() -> ExitCode {
    lammps_host::use_this_program();
    bug::guarded(|| {
        cli::run(std::env::args_os()).unwrap_or_else(|error| {
            output::eprint(&format!("asperity: error: {error}"));
            ExitCode::from(error.exit_code())
        })
    })
}
