//! Measurements for developers: `cargo bench --bench measure -- --help` lists them.

#![cfg_attr(test, allow(unused_imports, reason = "without a harness there are no unit tests; tests/program runs them"))]

mod commands;
#[path = "../../tests/common/folder.rs"]
mod folder;
#[path = "../../fuzz/mod.rs"]
mod fuzz;

use std::process::ExitCode;

/// Counts what the readers of `damage` allocate.
#[global_allocator]
static ALLOCATOR: peak_alloc::PeakAlloc = peak_alloc::PeakAlloc;

fn main() -> ExitCode {
    match commands::run(std::env::args_os()) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("measure: error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}
