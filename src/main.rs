//! The program: parse, run one command, say what went wrong in one place.

use std::io::Write;
use std::process::ExitCode;

fn main() -> ExitCode {
    match asperity::cli::run(std::env::args_os()) {
        Ok(code) => code,
        Err(error) => {
            // A reader that has gone away is no error of ours.
            let _ = writeln!(std::io::stderr(), "asperity: error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}
