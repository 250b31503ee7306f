//! The program: parse, run one command, say what went wrong in one place.

use std::process::ExitCode;

fn main() -> ExitCode {
    match asperity::cli::run(std::env::args_os()) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("asperity: error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}
