//! Planned memory of the methods against the measured increase in a separate process for each.

#[path = "common/program.rs"]
mod program;

use asperity::method::{REGISTRY, find};
use program::{asperity, json_line, stderr};

/// Memory (bytes) of a first solve that does not depend on the grid: program pages, FFT plans, thread stacks.
/// Measured: 3 MB.
const FIXED: f64 = 6e6;

/// Tolerance in addition to the fixed memory. Plans count whole fields, without lists of nodes and row buffers of
/// threads.
const FACTOR: f64 = 1.25;

/// Largest ratio of planned to measured memory: pages that a short solve never writes are not resident.
const UNUSED: f64 = 1.5;

/// Resolution of the measurement: the kernel counts 64 pages per thread at a time, so that 6 kB appeared as 0 to 0.4
/// MB.
const RESOLUTION: f64 = 64.0 * 4096.0;

/// Sixteen fields of this grid are 34 MB, far above the fixed part.
const POINTS: &str = "512";

fn planned_and_measured(id: &str, more: &[&str]) -> (f64, f64) {
    let surface = ["solve", "--challenge", POINTS, "--cut-off", "0.02", "--pressure", "0.01"];
    let output = asperity()
        .args(surface)
        .args(["--json", "--threads", "1", "--method", id])
        .args(more)
        .output()
        .expect("started");
    // A solver that is stopped early has allocated everything; its exit code is 3.
    assert!(matches!(output.status.code(), Some(0 | 3)), "{id}: {}", stderr(&output));
    let line = json_line(&output);
    let number = |key: &str| line[key].as_f64().unwrap_or_else(|| panic!("{id}: {key} of {line}"));
    (number("planned_bytes"), number("measured_bytes"))
}

#[test]
fn planned_memory_is_what_is_used() {
    let mut faults = Vec::new();
    let mut judge = |what: &str, (planned, measured): (f64, f64)| {
        if measured > FACTOR * planned + FIXED || planned > UNUSED * measured.max(RESOLUTION) {
            faults.push(format!("{what}: planned {:.1} MB, measured {:.1} MB", planned / 1e6, measured / 1e6));
        }
    };
    for id in REGISTRY.iter().map(|m| m.card().id).filter(|id| *id != "all-atom") {
        // Estimates must converge.
        let estimates = find(id).is_some_and(|m| m.card().kind == asperity::method::Kind::Estimate);
        let few = ["--max-iterations", "3"];
        judge(id, planned_and_measured(id, if estimates { &[] } else { &few }));
    }
    // Converged, as flow is moved to the heights.
    judge("fast with a hardness", planned_and_measured("fast", &["--hardness", "0.1"]));
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
