//! The program: parse, run one command, say what went wrong in one place.

use asperity::cli::{self, bug, output};
use std::process::ExitCode;

fn main() -> ExitCode {
    bug::guarded(|| {
        cli::run(std::env::args_os()).unwrap_or_else(|error| {
            output::eprint(&format!("asperity: error: {error}"));
            ExitCode::from(error.exit_code())
        })
    })
}
