//! One file per command. Solves run the program `asperity`.

mod damage;
mod folders;
mod kills;
mod long;
mod methods;
mod times;

use asperity::grid::sys;
use asperity::{Error, Result};
use clap::{Parser, Subcommand};
use serde::de::DeserializeOwned;
use std::ffi::OsString;
use std::process::{Command, ExitCode, Stdio};

/// The surface that evidence/performance.md was measured on.
const SEED: &str = "1";

/// Load of every solve, over E*.
const PRESSURE: &str = "0.01";

/// Times of transforms and methods, damaged files and folders, killed runs.
#[derive(Parser)]
#[command(name = "measure", max_term_width = 110)]
struct Arguments {
    /// Given by `cargo bench`.
    #[arg(long, global = true, hide = true)]
    bench: bool,
    #[command(subcommand)]
    command: Measurement,
}

#[derive(Subcommand)]
enum Measurement {
    Damage(damage::Damage),
    Folders(folders::Folders),
    Kills(kills::Kills),
    Times(times::Times),
    Methods(methods::Methods),
}

/// Runs the command line `arguments` (the program's name first).
pub(crate) fn run(arguments: impl IntoIterator<Item = OsString>) -> Result<ExitCode> {
    match Arguments::parse_from(arguments).command {
        Measurement::Damage(c) => c.execute(),
        Measurement::Folders(c) => c.execute(),
        Measurement::Kills(c) => c.execute(),
        Measurement::Times(c) => c.execute(),
        Measurement::Methods(c) => c.execute(),
    }?;
    Ok(ExitCode::SUCCESS)
}

/// One load on the challenge's surface with `size` points per side, by `asperity solve` in a process of its own: its
/// processor time and peak memory are then those of this solve. `None` if it failed; the reason is on stderr.
fn solve<T: DeserializeOwned>(size: usize, flags: &[&str], threads: usize) -> Result<Option<T>> {
    let program = env!("CARGO_BIN_EXE_asperity");
    let mut command = Command::new(program);
    command.args(["solve", "--challenge", &size.to_string(), "--seed", SEED, "--pressure", PRESSURE]);
    command.args(flags).args(["--json", "--threads", &threads.to_string()]);
    command.stdin(Stdio::null()).stderr(Stdio::inherit());
    sys::group::die_with_parent(&mut command);
    let output = command.output().map_err(Error::io("start", program))?;
    // A solve that stopped above its tolerance (3) has results nevertheless: f32 on large grids.
    if !matches!(output.status.code(), Some(0 | 3)) {
        return Ok(None);
    }
    serde_json::from_slice(&output.stdout).map(Some).map_err(|e| Error::format(program, e, "the JSON of a solve"))
}

/// Of an even number, the mean of the middle two.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match sorted.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => sorted[middle],
        _ => 0.5 * (sorted[middle - 1] + sorted[middle]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_methods_are_refused() {
        let refused = run(["measure", "methods", "bvn", "--bench"].map(OsString::from)).expect_err("unknown");
        assert!(refused.to_string().contains("methods = bvn; accepted: all, auto, fast"), "{refused}");
    }

    #[test]
    fn medians() {
        assert_eq!(median([3.0, 1.0, 2.0].into_iter()), 2.0);
        assert_eq!(median([4.0, 1.0, 2.0, 3.0].into_iter()), 2.5);
    }
}
