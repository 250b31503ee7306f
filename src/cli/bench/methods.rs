//! What every method takes: processor time and how it grows with the points, memory as planned and as measured.

use super::{Bench, PRESSURE, SEED, median};
use crate::cli::output;
use crate::method::{self, REGISTRY, all_atom};
use crate::report::number::{memory, significant};
use crate::scene::ALL_METHODS;
use crate::{Error, Result, sys};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::process::{Command, ExitCode, Stdio};

/// What `solve --json` says of a method that solves or estimates.
#[derive(Debug, Clone, Deserialize)]
struct Told {
    contact_fraction: f64,
    cpu_seconds: f64,
    planned_bytes: u64,
    measured_bytes: u64,
}

#[derive(Debug, Serialize)]
struct Taken {
    method: &'static str,
    runs: Vec<Run>,
    /// Power of the number of points with which the processor time grows; none of one size.
    exponent: Option<f64>,
}

#[derive(Debug, Serialize)]
struct Run {
    size: usize,
    contact_fraction: f64,
    cpu_seconds: f64,
    planned_bytes: u64,
    measured_bytes: u64,
}

/// Methods one after another, each solve in a process of its own on one thread.
pub(super) fn measure(bench: &Bench) -> Result<ExitCode> {
    let wanted = |id: &str| {
        let named = |n: &String| n == ALL_METHODS && id != all_atom::ID;
        bench.methods.iter().any(|n| named(n) || method::find(n).is_some_and(|m| m.card().id == id))
    };
    let mut taken = Vec::new();
    for method in REGISTRY.iter().filter(|m| wanted(m.card().id)) {
        let id = method.card().id;
        let mut runs = Vec::new();
        for &n in &bench.sizes {
            let mut told = Vec::new();
            for round in 1..=bench.repeats {
                eprintln!("{id} on {n}²: round {round} of {}", bench.repeats);
                told.extend(run(id, n, bench.cut_off)?);
            }
            let Some(first) = told.first() else { continue };
            runs.push(Run {
                size: n,
                contact_fraction: first.contact_fraction,
                cpu_seconds: median(told.iter().map(|t| t.cpu_seconds)),
                planned_bytes: first.planned_bytes,
                measured_bytes: told.iter().map(|t| t.measured_bytes).max().unwrap_or(0),
            });
        }
        let points: Vec<(f64, f64)> = runs.iter().map(|r| ((r.size * r.size) as f64, r.cpu_seconds)).collect();
        taken.push(Taken { method: id, exponent: exponent(&points), runs });
    }
    if bench.json {
        output::json_line(
            &json!({ "version": env!("CARGO_PKG_VERSION"), "cut_off": bench.cut_off, "methods": taken }),
        )?;
    } else {
        tell(&taken, bench.cut_off);
    }
    Ok(ExitCode::SUCCESS)
}

/// A load by a method; none where it ended without an answer, of which it has said why on stderr.
fn run(id: &str, n: usize, cut_off: f64) -> Result<Option<Told>> {
    let program = std::env::current_exe().map_err(Error::io("find", "the program itself"))?;
    let mut command = Command::new(&program);
    command.args(["solve", "--challenge", &n.to_string(), "--seed", SEED, "--pressure", PRESSURE, "--method", id]);
    command.args(["--cut-off", &cut_off.to_string(), "--json", "--threads", "1"]);
    command.stdin(Stdio::null()).stderr(Stdio::inherit());
    sys::die_with_parent(&mut command);
    let output = command.output().map_err(Error::io("start", &program))?;
    if !output.status.success() {
        return Ok(None);
    }
    serde_json::from_slice(&output.stdout).map(Some).map_err(|e| Error::format(&program, e, "the JSON of a solve"))
}

/// Slope of a line through the logarithms, by least squares; none of fewer than two points.
fn exponent(points: &[(f64, f64)]) -> Option<f64> {
    let logs: Vec<(f64, f64)> = points.iter().filter(|p| p.1 > 0.0).map(|p| (p.0.ln(), p.1.ln())).collect();
    let n = logs.len() as f64;
    let (x, y) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
    let spread: f64 = logs.iter().map(|p| (p.0 - x).powi(2)).sum();
    let rise: f64 = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    (logs.len() > 1 && spread > 0.0).then(|| rise / spread)
}

fn tell(taken: &[Taken], cut_off: f64) {
    output::print(&format!(
        "one load, p = {PRESSURE} E*, of the challenge's surface with waves down to {cut_off} L, on one thread; memory beyond the heights"
    ));
    let head =
        ["method", "points", "contact", "CPU / s", "CPU / s a point", "planned", "measured", "planned / measured"];
    output::print(&output::table(
        &head,
        taken.iter().flat_map(|t| t.runs.iter().map(|r| (t.method, r))).map(|(method, r)| {
            vec![
                method.into(),
                format!("{}²", r.size),
                significant(r.contact_fraction, 3),
                significant(r.cpu_seconds, 2),
                format!("{:.1e}", r.cpu_seconds / (r.size * r.size) as f64),
                memory(r.planned_bytes),
                memory(r.measured_bytes),
                significant(r.planned_bytes as f64 / r.measured_bytes.max(1) as f64, 2),
            ]
        }),
    ));
    for t in taken {
        if let Some(power) = t.exponent {
            output::print(&format!(
                "{}: CPU time grows as the points to the power {}",
                t.method,
                significant(power, 3)
            ));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponents_of_powers_are_found() {
        let points: Vec<(f64, f64)> = [1e4, 1e5, 1e6].iter().map(|n: &f64| (*n, 3e-7 * n.powf(1.25))).collect();
        assert!((exponent(&points).expect("three points") - 1.25).abs() < 1e-12);
        assert_eq!(exponent(&points[..1]), None);
        assert_eq!(exponent(&[(1e4, 1.0), (1e4, 2.0)]), None);
    }
}
