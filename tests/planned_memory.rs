//! Memory as methods plan it, against what the process took beyond what was there before, each in a process of its own.

#[path = "common/program.rs"]
mod program;

use asperity::method::{REGISTRY, find};
use program::{asperity, json_line, stderr};

/// What a first solve takes whatever its grid: pages of the program that are read for the first time, plans of transforms,
/// stacks of threads. 3 MB were found.
const FIXED: f64 = 6e6;

/// Beyond that. Plans count whole fields; lists of nodes and rows of threads are left out.
const FACTOR: f64 = 1.25;

/// A plan may exceed what is measured by so much: pages that a short search never writes are not resident.
const UNUSED: f64 = 1.5;

/// Least that can be measured: the kernel tells a thread's pages 64 at a time, so that 6 kB were found to be anything from nothing to
/// 0.4 MB.
const UNTOLD: f64 = 64.0 * 4096.0;

/// Sixteen fields of this grid are 34 MB, far beyond what is fixed.
const POINTS: &str = "512";

fn planned_and_measured(id: &str, more: &[&str]) -> (f64, f64) {
    let surface = ["solve", "--challenge", POINTS, "--cut-off", "0.02", "--pressure", "0.01"];
    let output = asperity()
        .args(surface)
        .args(["--json", "--threads", "1", "--method", id])
        .args(more)
        .output()
        .expect("started");
    // A solver that is stopped early has taken all that it takes, and says so by its exit code.
    assert!(matches!(output.status.code(), Some(0 | 3)), "{id}: {}", stderr(&output));
    let line = json_line(&output);
    let number = |key: &str| line[key].as_f64().unwrap_or_else(|| panic!("{id}: {key} of {line}"));
    (number("planned_bytes"), number("measured_bytes"))
}

#[test]
fn plans_are_what_is_taken() {
    let mut faults = Vec::new();
    for id in REGISTRY.iter().map(|m| m.card().id).filter(|id| *id != "all-atom") {
        // Estimates are no answer when they are stopped.
        let estimates = find(id).is_some_and(|m| m.card().kind == asperity::method::Kind::Estimate);
        let few = ["--max-iterations", "3"];
        let (planned, measured) = planned_and_measured(id, if estimates { &[] } else { &few });
        if measured > FACTOR * planned + FIXED || planned > UNUSED * measured.max(UNTOLD) {
            faults.push(format!("{id}: planned {:.1} MB, measured {:.1} MB", planned / 1e6, measured / 1e6));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
