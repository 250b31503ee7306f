//! Planned memory of the methods against the measured increase in a separate process for each.

#[path = "common/program.rs"]
mod program;

use asperity::methods::REGISTRY;
use program::{asperity, json_line, stderr};

/// Memory (bytes) of a first solve that does not depend on the grid: FFT plans, thread stacks. Measured: 0.5 MB.
const FIXED: f64 = 1e6;

/// Tolerance in addition to the fixed memory. Plans count whole fields, without lists of nodes and row buffers of
/// threads.
const FACTOR: f64 = 1.1;

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
    assert!(output.status.success(), "{id}: {}", stderr(&output));
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
        // Converged, as the contact stiffness is that of a solved state, but soon.
        judge(id, planned_and_measured(id, &["--tolerance", "0.05"]));
    }
    // Converged, as flow is moved to the heights.
    judge("fast with a hardness", planned_and_measured("fast", &["--hardness", "0.1"]));
    let patch = ["--non-periodic", "--hardness", "0.1"];
    judge("fast with a hardness on a patch", planned_and_measured("fast", &patch));
    let wall = ["--wall", "penalty", "--penalty-length", "1e-4"];
    judge("fast behind a stiff wall", planned_and_measured("fast", &wall));
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Plan of `run` for a scene of `points` per side in f32, by stage: name and bytes.
fn plan_of_run(folder: &std::path::Path, points: usize) -> Vec<(String, f64)> {
    let scene = folder.join(format!("{points}.toml"));
    let text = format!(
        "name = \"memory\"\n[surface]\ngrid = {points}\ncut_off = \"2.0 um\"\n[load]\np_star = [0.02]\n[continuum]\nprecision = \"f32\"\n"
    );
    std::fs::write(&scene, text).expect("written");
    let output = asperity().arg("run").arg(&scene).args(["--dry-run", "--json"]).output().expect("started");
    let line = json_line(&output);
    let stages = line["stages"].as_array().expect("stages");
    stages.iter().map(|s| (s["name"].as_str().expect("a name").into(), s["bytes"].as_f64().expect("bytes"))).collect()
}

/// `run` needs the memory of the solve at any size, and its stages use what is planned.
#[test]
fn a_run_takes_the_memory_of_its_solve() {
    /// The waves of the surface, which do not depend on the grid.
    const WAVES: f64 = 0.02;
    let scratch = tempfile::tempdir().expect("scratch");
    for points in [8192_usize, 65_536] {
        let solve = ["solve", "--challenge", &points.to_string(), "--cut-off", "0.02", "--pressure", "0.01"];
        let output =
            asperity().args(solve).args(["--precision", "f32", "--dry-run", "--json"]).output().expect("started");
        let alone = json_line(&output)["bytes"].as_f64().expect("bytes");
        for (stage, bytes) in plan_of_run(scratch.path(), points) {
            assert!(bytes <= (1.0 + WAVES) * alone, "{points}, {stage}: {bytes:e}, the solve {alone:e}");
        }
    }
    // The program itself takes what a small grid does.
    let (planned, found) = (plan_of_run(scratch.path(), 2048), peaks_of_run(scratch.path(), 2048));
    plan_of_run(scratch.path(), 64);
    let small = peaks_of_run(scratch.path(), 64);
    for (stage, bytes) in planned.iter().filter(|(name, _)| name != "report") {
        let own = found[stage].as_f64().expect("a peak") - small[stage].as_f64().expect("a peak");
        assert!(own <= FACTOR * bytes + FIXED, "{stage}: planned {bytes:e}, measured {own:e}");
        assert!(*bytes <= UNUSED * own, "{stage}: planned {bytes:e}, measured {own:e}");
    }
}

/// Largest resident memory of the stages of the planned run, bytes by stage.
fn peaks_of_run(folder: &std::path::Path, points: usize) -> serde_json::Map<String, serde_json::Value> {
    let (scene, out) = (folder.join(format!("{points}.toml")), folder.join(points.to_string()));
    let run = asperity().args(["--threads", "1", "run"]).arg(scene).arg("--out").arg(&out).output();
    assert!(run.as_ref().is_ok_and(|o| o.status.success()), "{run:?}");
    let results = std::fs::read(out.join("results.json")).expect("results");
    let results: serde_json::Value = serde_json::from_slice(&results).expect("JSON");
    let stages = results["stages"].as_array().expect("stages");
    stages.iter().map(|s| (s["name"].as_str().expect("a name").into(), s["peak_rss_bytes"].clone())).collect()
}
