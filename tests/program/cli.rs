//! All commands on small inputs, as in scripts.

use crate::flags::dimensionless;
use crate::lammps::lammps;
use crate::program::{asperity, json_line, stderr};
use approx::assert_relative_eq;
use asperity::surface::files::npy;
use predicates::prelude::*;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Output;

/// Points per side of the small surface: eight per shortest wavelength, L/8.
const N: usize = 64;
const LENGTH_UM: f64 = 100.0;

/// Relative difference of solutions of the same problem in other units: the iterations are the same, apart from
/// rounding of doubles.
const ROUNDING: f64 = 1e-10;

/// Relative difference of energies and gaps of two maps solved to a KKT residual of 1e-8 of the pressure; areas are
/// equal.
const SOLVED: f64 = 1e-6;

/// Relative accuracy of f32 solves to 1e-3 of the pressure.
const SINGLE: f64 = 1e-2;

/// Keys of `solve --json` that scripts rely on.
const SOLVE_KEYS: [&str; 18] = [
    "method",
    "nx",
    "ny",
    "pressure",
    "contact_area",
    "contact_area_error",
    "contact_nodes",
    "stiffness",
    "mean_gap",
    "load_error",
    "residual",
    "complementarity",
    "energy",
    "stop",
    "iterations",
    "fft_pairs",
    "seconds",
    "peak_rss_bytes",
];

fn call(arguments: &[&str]) -> Output {
    asperity().args(dimensionless(arguments)).output().expect("started")
}

/// The JSON output of a successful command.
fn answer(arguments: &[&str]) -> Value {
    let output = call(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
    json_line(&output)
}

/// The one-line error message of a command that fails with the exit code `code`.
fn error_message(arguments: &[&str], code: i32) -> String {
    let output = call(arguments);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    assert_eq!(said.matches("asperity: error: ").count(), 1, "{arguments:?}: {said}");
    said
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} of {value}"))
}

fn word(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

struct Scratch(tempfile::TempDir);

impl Scratch {
    fn new() -> Self {
        Scratch(tempfile::tempdir().expect("scratch"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// The small rough surface, heights in µm.
    fn surface(&self, name: &str) -> PathBuf {
        let (file, n) = (self.path(name), N.to_string());
        let smooth = ["--seed", "3", "--roll-off", "50um", "--cut-off", "12.5um"];
        let flags = [&["surface", "--grid", &n, "--out", word(&file), "--json"], &smooth[..]].concat();
        let found = answer(&flags);
        assert_eq!((number(&found, "nx"), number(&found, "ny")), (N as f64, N as f64));
        assert_eq!(found["sign"], "low points touch first");
        file
    }

    fn map(&self, name: &str, nx: usize, ny: usize, height: impl Fn(f64, f64) -> f64) -> PathBuf {
        let file = self.path(name);
        let at = |i: usize| height((i % nx) as f64 / nx as f64, (i / nx) as f64 / ny as f64);
        npy::write(&file, nx, ny, (0..nx * ny).map(at)).expect("written");
        file
    }
}

/// The output of `solve` without values that vary between runs.
fn lasting(mut solved: Value) -> Value {
    let all = solved.as_object_mut().expect("an object");
    all.remove("provenance");
    ["seconds", "cpu_seconds", "measured_bytes", "peak_rss_bytes", "threads"]
        .iter()
        .for_each(|k| assert!(all.remove(*k).is_some(), "{k}"));
    solved
}

#[test]
fn a_surface_goes_through_files_unchanged() {
    let scratch = Scratch::new();
    let (binary, text) = (scratch.surface("h.npy"), scratch.surface("h.txt"));
    let solved = [&binary, &text].map(|file| {
        lasting(answer(&["solve", "--heights", word(file), "--length", "100", "--pressure", "0.05", "--json"]))
    });
    assert_eq!(solved[0], solved[1], "ASCII and npy heights differ");
    let again = scratch.path("again.npy");
    let flags = ["--touching", "low-points", "--out", word(&again), "--json"];
    let found = answer(&[&["surface", "--heights", word(&text)], &flags[..]].concat());
    let names: Vec<&str> =
        found["statistics"].as_array().expect("a list").iter().filter_map(|s| s["name"].as_str()).collect();
    assert!(names.contains(&"rms height") && names.contains(&"curvature radius"), "{names:?}");
    let (first, second) = (npy::read(&binary).expect("read"), npy::read(&again).expect("read"));
    for (a, b) in first.values.iter().zip(&second.values) {
        assert_relative_eq!(a, b, epsilon = 1e-12 * LENGTH_UM);
    }
}

#[test]
fn the_surface_of_a_scene_is_the_scene_s() {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scenes/good/cut-offs-by-mode.toml");
    let found = answer(&["surface", word(&scene), "--json"]);
    assert_eq!(number(&found, "nx"), 64.0);
    let plain = call(&["surface", word(&scene)]);
    let table = predicate::str::contains("rms gradient").and(predicate::str::contains("seed 18"));
    assert!(table.eval(&String::from_utf8_lossy(&plain.stdout)), "{plain:?}");
    assert!(error_message(&["surface", word(&scene), "--hurst", "2"], 2).contains("--hurst = 2"));
    let said = error_message(&["surface", "--heights", "nowhere.npy", "--touching", "low-points"], 2);
    assert!(said.contains("--heights = nowhere.npy (no such file)"), "{said}");
}

#[test]
fn output_of_solve_for_scripts() {
    let scratch = Scratch::new();
    let file = scratch.surface("h.npy");
    for method in ["gfmd", "bvm"] {
        let flags = ["--length", "100", "--modulus", "25", "--pressure", "0.25", "--method", method, "--json"];
        let out = scratch.path(method);
        let solved = answer(&[&["solve", "--heights", word(&file), "--out", word(&out)], &flags[..]].concat());
        for key in SOLVE_KEYS {
            assert!(!solved[key].is_null(), "{method}: {key} is missing in {solved}");
        }
        assert_eq!((solved["method"].as_str(), solved["stop"].as_str()), (Some(method), Some("converged")));
        assert!((0.005..0.5).contains(&number(&solved, "contact_area")), "{solved}");
        assert!(number(&solved, "residual") <= 1e-8 && number(&solved, "load_error").abs() < 1e-9, "{solved}");
        // The files agree with the output.
        let (gap, contact) =
            (npy::read(&out.join("gap.npy")).expect("read"), npy::read_flags(&out.join("contact.npy")).expect("read"));
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        assert_relative_eq!(mean(&gap.values), number(&solved, "mean_gap"), max_relative = ROUNDING);
        let touching = contact.values.iter().map(|c| f64::from(*c)).sum::<f64>() / contact.values.len() as f64;
        assert_relative_eq!(touching, number(&solved, "contact_nodes"), max_relative = ROUNDING);
        let stress = npy::read(&out.join("stress.npy")).expect("read");
        assert_relative_eq!(mean(&stress.values), 0.25, max_relative = 1e-9);
        let kept: Value = serde_json::from_slice(&std::fs::read(out.join("solve.json")).expect("read")).expect("JSON");
        assert_eq!(lasting(kept), lasting(solved));
    }
    let plain = call(&["solve", "--heights", word(&file), "--length", "100", "--pressure", "0.01"]);
    let table = predicate::str::contains("zero gap").and(predicate::str::contains("converged"));
    assert!(table.eval(&String::from_utf8_lossy(&plain.stdout)), "{plain:?}");
}

#[test]
fn the_methods_agree() {
    let scratch = Scratch::new();
    let file = scratch.surface("h.npy");
    let solved = ["gfmd", "bvm"].map(|method| {
        answer(&[
            "solve",
            "--heights",
            word(&file),
            "--length",
            "100",
            "--pressure",
            "0.02",
            "--method",
            method,
            "--json",
        ])
    });
    assert_eq!(solved[0]["contact_area"], solved[1]["contact_area"]);
    for key in ["mean_gap", "energy"] {
        assert_relative_eq!(number(&solved[0], key), number(&solved[1], key), max_relative = SOLVED);
    }
}

#[test]
fn units_change_nothing() {
    const LENGTHS: f64 = 1e-6;
    const STRESSES: f64 = 1e9;
    let scratch = Scratch::new();
    let wave = |x: f64, y: f64| (6.3 * x).sin() * (12.6 * y).cos() + 0.3 * (25.1 * (x + y)).cos();
    let reduced = scratch.map("reduced.npy", N, N, |x, y| 0.02 * wave(x, y));
    let scaled = scratch.map("scaled.npy", N, N, |x, y| LENGTHS * 0.02 * wave(x, y));
    for adhesive in [false, true] {
        let solve = |file: &Path, length: f64, stress: f64| {
            let value = |v: f64| v.to_string();
            let (gamma, rho) = (value(if adhesive { 1e-4 * length * stress } else { 0.0 }), value(0.01 * length));
            let (length, modulus, pressure) = (value(length), value(stress), value(0.02 * stress));
            let flags = ["--length", &length, "--modulus", &modulus, "--pressure", &pressure, "--json"];
            answer(&[&["solve", "--heights", word(file), "--gamma", &gamma, "--rho", &rho], &flags[..]].concat())
        };
        let (a, b) = (solve(&reduced, 1.0, 1.0), solve(&scaled, LENGTHS, STRESSES));
        assert_eq!(a["contact_area"], b["contact_area"]);
        assert_relative_eq!(number(&a, "mean_gap"), number(&b, "mean_gap") / LENGTHS, max_relative = ROUNDING);
        let energy = number(&b, "energy") / (LENGTHS * STRESSES);
        assert_relative_eq!(number(&a, "energy"), energy, max_relative = ROUNDING);
        assert_relative_eq!(number(&a, "perimeter"), number(&b, "perimeter") * LENGTHS, max_relative = ROUNDING);
        assert_eq!(number(&a, "interaction_energy") < 0.0, adhesive, "{a}");
    }
}

#[test]
fn adhesion_pulls() {
    let scratch = Scratch::new();
    let file = scratch.map("h.npy", N, N, |x, y| 0.02 * ((6.3 * x).sin() + (6.3 * y).cos()));
    let plain = ["solve", "--heights", word(&file), "--pressure", "0.01", "--json"];
    let free = answer(&plain);
    let adhesive = answer(&[&plain[..], &["--gamma", "1e-4", "--rho", "0.01"]].concat());
    assert!(number(&adhesive, "contact_area") > number(&free, "contact_area"), "{adhesive} {free}");
    assert!(number(&adhesive, "mean_gap") < number(&free, "mean_gap"), "{adhesive} {free}");
    // All inputs that mean no adhesion give the same result.
    let zero = answer(&[&plain[..], &["--gamma", "0", "--rho", "0.01"]].concat());
    assert_eq!(lasting(zero), lasting(free));
}

#[test]
fn lines_and_rectangles_are_solved() {
    let scratch = Scratch::new();
    let profile = |x: f64| 0.01 * ((6.3 * x).cos() + 0.5 * (18.8 * x).sin());
    let line = scratch.map("line.npy", 128, 1, |x, _| profile(x));
    let strip = scratch.map("strip.npy", 128, 8, |x, _| profile(x));
    let solve = |file: &Path, more: &[&str]| {
        answer(&[&["solve", "--heights", word(file), "--pressure", "0.004", "--json"], more].concat())
    };
    let (one, two) = (solve(&line, &[]), solve(&strip, &[]));
    assert_eq!((number(&one, "nx"), number(&one, "ny")), (128.0, 1.0));
    assert_eq!((number(&two, "nx"), number(&two, "ny")), (128.0, 8.0));
    // A profile that is constant along y is the same problem on a strip of any width.
    for other in [&two, &solve(&strip, &["--length-y", "3"])] {
        assert_eq!(one["contact_area"], other["contact_area"]);
        assert_relative_eq!(number(&one, "mean_gap"), number(other, "mean_gap"), max_relative = SOLVED);
    }
    // A wave along y is stiffer in the shorter cell.
    let bumps = scratch.map("bumps.npy", 64, 32, |x, y| 0.01 * ((6.3 * x).cos() + (6.3 * y).cos()));
    let (square_pixels, square_cell) = (solve(&bumps, &[]), solve(&bumps, &["--length-y", "1"]));
    assert!(number(&square_pixels, "mean_gap") > number(&square_cell, "mean_gap"), "{square_pixels} {square_cell}");
}

#[test]
fn high_points_touch_first() {
    let scratch = Scratch::new();
    let height = |x: f64, y: f64| 0.02 * ((6.3 * x).cos().exp() + 0.4 * (12.6 * y + 6.3 * x).sin());
    let (low, high) = (scratch.map("low.npy", N, N, height), scratch.map("high.npy", N, N, |x, y| -height(x, y)));
    let solve = |file: &Path, more: &[&str]| {
        answer(&[&["solve", "--heights", word(file), "--pressure", "0.01", "--json"], more].concat())
    };
    let (straight, inverted) = (solve(&low, &[]), solve(&high, &["--touching", "high-points"]));
    assert_eq!(straight["contact_area"], inverted["contact_area"]);
    assert_relative_eq!(number(&straight, "mean_gap"), number(&inverted, "mean_gap"), max_relative = ROUNDING);
    let other_side = solve(&low, &["--touching", "high-points"]);
    assert_ne!(straight["contact_area"], other_side["contact_area"], "the side does nothing");
    // A sign declared in a file is used, and another is refused.
    let declared = scratch.surface("declared.npy");
    let said =
        error_message(&["solve", "--heights", word(&declared), "--pressure", "0.01", "--touching", "high-points"], 2);
    assert!(
        said.contains("--touching = high-points; accepted: low-points, as ") && said.contains("declares"),
        "{said}"
    );
}

#[test]
fn single_precision_is_single() {
    let scratch = Scratch::new();
    let file = scratch.surface("h.npy");
    let plain = ["solve", "--heights", word(&file), "--length", "100", "--pressure", "0.02", "--json"];
    let (double, single) = (answer(&plain), answer(&[&plain[..], &["--precision", "f32"]].concat()));
    assert_eq!(single["precision"], "f32");
    assert_relative_eq!(number(&double, "contact_area"), number(&single, "contact_area"), max_relative = SINGLE);
    assert_relative_eq!(number(&double, "mean_gap"), number(&single, "mean_gap"), max_relative = SINGLE);
    assert_ne!(double["mean_gap"], single["mean_gap"], "f32 is f64 in disguise");
}

#[test]
fn threads_change_no_bit() {
    let scratch = Scratch::new();
    let file = scratch.surface("h.npy");
    for method in ["gfmd", "bvm"] {
        let solved = ["1", "2"].map(|threads| {
            let out = scratch.path(&format!("{method}-{threads}"));
            let flags = ["--length", "100", "--pressure", "0.02", "--method", method, "--threads", threads, "--json"];
            let found = answer(&[&["solve", "--heights", word(&file), "--out", word(&out)], &flags[..]].concat());
            assert_eq!(found["threads"].as_u64(), threads.parse().ok());
            let fields = ["gap.npy", "stress.npy", "contact.npy"].map(|f| std::fs::read(out.join(f)).expect("read"));
            (lasting(found), fields)
        });
        assert!(solved[0] == solved[1], "{method}: {} {}", solved[0].0, solved[1].0);
    }
}

#[test]
fn a_state_without_convergence_is_marked_and_stored() {
    let scratch = Scratch::new();
    let (file, out) = (scratch.surface("h.npy"), scratch.path("out"));
    let flags = ["--length", "100", "--pressure", "0.01", "--max-iterations", "3", "--json"];
    let output = call(&[&["solve", "--heights", word(&file), "--out", word(&out)], &flags[..]].concat());
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    let found = json_line(&output);
    assert_ne!(found["stop"], "converged");
    assert!(number(&found, "residual") > 1e-8, "{found}");
    let said = stderr(&output);
    assert!(said.contains("without converging") && said.contains("partial-gap.npy"), "{said}");
    assert_eq!(npy::read(&out.join("partial-gap.npy")).expect("kept").values.len(), N * N);
    assert!(!out.join("gap.npy").exists(), "a partial state under the name of a converged one");
}

#[test]
fn bad_arguments_are_refused_together() {
    let scratch = Scratch::new();
    let file = scratch.map("h.npy", 8, 8, |x, y| x + y);
    let file = word(&file);
    let solve = ["solve", "--heights", file, "--pressure"];
    let said = error_message(&[&solve[..], &["nan", "--length", "0", "--method", "guess", "--gamma", "1"]].concat(), 2);
    for piece in ["--pressure = NaN", "--length = 0", "--method = \"guess\"; accepted: ", "--range = not given"] {
        assert!(said.contains(piece), "{said}");
    }
    assert!(error_message(&["solve", "--heights", "nowhere.npy", "--pressure", "1"], 2).contains("nowhere.npy"));
    assert!(error_message(&[&solve[..], &["0.1,-1"]].concat(), 2).contains("--pressure = -1"));
    // Negative values are values, of every flag.
    let negative = [
        &solve[..],
        &["-10MPa", "--modulus", "-2GPa", "--hardness", "-2GPa", "--length", "-1um", "--unit", "um", "--tol", "-1e-8"],
    ]
    .concat();
    let said = error_message(&negative, 2);
    for piece in ["--modulus = -2GPa", "--hardness = -2GPa", "--length = -1um", "--tolerance = -"] {
        assert!(said.contains(piece), "{said}");
    }
    // Errors found by clap.
    for bad in [&["solve", "--heights", file][..], &["solve", "--presure", "1"], &["guess"], &[]] {
        assert_eq!(call(bad).status.code(), Some(2), "{bad:?}");
    }
    // Flags that would have no effect.
    let challenge = ["solve", "--challenge", "16", "--cut-off", "0.2", "--pressure", "0.1"];
    for (flags, from) in [
        (&["--touching", "high-points"][..], &challenge[..]),
        (&["--length-y", "1"], &challenge),
        (&["--rho", "1"], &challenge),
        (&["--law", "dugdale"], &challenge),
        (&["--poisson", "0.4"], &challenge),
        (&["--base", "bonded"], &challenge),
        (&["--non-periodic", "--thickness", "1"], &challenge),
    ] {
        assert_eq!(call(&[from, flags].concat()).status.code(), Some(2), "{flags:?}");
    }
    let sticky = ["--gamma", "1e-4", "--rho", "0.1", "--resolution", "extrapolate"];
    for (more, expected) in [
        (&["--initial-gap", "nowhere.npy"][..], "--resolution = \"extrapolate\" with --initial-gap"),
        (&["--non-periodic"], "--non-periodic = given with --resolution extrapolate"),
    ] {
        let message = error_message(&[&challenge[..], &sticky, more].concat(), 2);
        assert!(message.contains(expected), "{message}");
    }
    for good in ["--help", "--version"] {
        assert_eq!(call(&[good]).status.code(), Some(0));
    }
}

#[test]
fn methods_schema_and_doctor_answer() {
    let found = answer(&["methods", "--json"]);
    let ids: Vec<&str> = found["methods"].as_array().expect("a list").iter().filter_map(|m| m["id"].as_str()).collect();
    assert!(ids.contains(&"gfmd") && ids.contains(&"bvm"), "{ids:?}");
    assert!(String::from_utf8_lossy(&call(&["methods"]).stdout).contains("bvm"));

    let schema: Value = serde_json::from_slice(&call(&["schema"]).stdout).expect("JSON");
    for table in ["surface", "load", "adhesion", "continuum", "atoms", "laboratory"] {
        assert!(schema["properties"].get(table).is_some(), "the schema lacks {table}");
    }
    assert_eq!(schema["additionalProperties"], false);

    let output = call(&["doctor", "--json"]);
    let found = json_line(&output);
    assert_eq!(output.status.code(), Some(if found["good"] == true { 0 } else { 5 }));
    let output = call(&["doctor", "--lammps", "/nonexistent/lmp", "--json"]);
    assert_eq!((output.status.code(), json_line(&output)["good"].as_bool()), (Some(5), Some(false)));
}

#[test]
fn the_potential_is_written_and_checked() {
    let scratch = Scratch::new();
    let file = scratch.path("Ca.eam.alloy");
    let written = answer(&["potential", "--out", word(&file), "--json"]);
    let checked = answer(&["potential", "--potential", word(&file), "--json"]);
    assert_eq!(written, checked);
    assert_eq!(checked["element"], "Ca");
    let said = error_message(&["potential", "--potential", word(&file), "--element", "Al"], 2);
    assert!(said.contains("without Al"), "{said}");
    assert!(error_message(&["potential", "--potential", "nowhere"], 2).contains("nowhere"));
    error_message(&["potential", "--potential", word(&file), "--out", "x"], 2);
}

/// A scene with a block of 10 × 10 × 6 cells.
fn tiny(scratch: &Scratch, atoms: bool) -> PathBuf {
    let mut text = "name = \"tiny\"\n[surface]\ngrid = 32\n[load]\np_star = [0.01, 0.02]\n".to_string();
    if atoms {
        text += "[atoms]\ncells = 10\ndepth_cells = 6\nstep = \"0.5 Å\"\n";
    }
    let file = scratch.path("tiny.toml");
    std::fs::write(&file, text).expect("written");
    file
}

#[test]
fn a_run_without_atoms_leaves_a_report() {
    let scratch = Scratch::new();
    let (scene, out) = (tiny(&scratch, false), scratch.path("run"));
    let found = answer(&["run", word(&scene), "--out", word(&out), "--json"]);
    assert_eq!(found["results"]["continuum"]["states"].as_array().map(Vec::len), Some(2));
    for file in ["report.html", "results.json", "results.nc", "manifest.json", "scene.toml"] {
        assert!(out.join(file).metadata().expect(file).len() > 0);
    }
    let page = out.join("report.html");
    let first = std::fs::read(&page).expect("read");
    std::fs::remove_file(&page).expect("removed");
    let found = answer(&["report", word(&out), "--json"]);
    assert_eq!(found["report"].as_str(), Some(word(&page)));
    assert!(std::fs::read(&page).expect("drawn") == first, "the same results gave another report");
    // A run without atoms has nothing to compare.
    assert!(error_message(&["compare", word(&out)], 2).contains("[atoms]"));
    assert!(error_message(&["report", word(&scratch.path("nowhere"))], 2).contains("nowhere"));
    assert!(error_message(&["atoms", "build", word(&scene), "--out", word(&scratch.path("job"))], 2).contains("atoms"));
}

/// If pull-off is not found, the loads are kept: results and report contain them with a message, and the exit code is
/// "not converged".
#[test]
fn a_failing_pull_off_keeps_the_loads() {
    let scratch = Scratch::new();
    let (scene, out) = (scratch.path("behind.toml"), scratch.path("run"));
    // The second mean gap is beyond the maximum tension.
    let text = "name = \"behind\"\n[surface]\ngrid = 64\ncut_off_mode = 8\nroll_off_mode = 4\n[load]\nmean_gap = [\"5 um\", \"11 um\"]\n\
                pull_off = true\n[adhesion]\nwork_of_adhesion = \"5000 mJ/m2\"\nrange = \"1200 nm\"\n[continuum]\ntolerance = 1e-6\n";
    std::fs::write(&scene, text).expect("written");
    for attempt in ["solved", "taken from the run before"] {
        let output = call(&["run", word(&scene), "--out", word(&out), "--json"]);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(3), "{attempt}: {said}");
        assert!(said.contains("the pull-off was not found") && said.contains("report.html"), "{attempt}: {said}");
        let continuum = &json_line(&output)["results"]["continuum"];
        assert_eq!(continuum["states"].as_array().map(Vec::len), Some(2), "{attempt}: {continuum}");
        assert!(continuum["pull_off_failure"].as_str().is_some_and(|w| w.contains("from which on it falls")));
    }
    let page = std::fs::read_to_string(out.join("report.html")).expect("drawn");
    assert_eq!(page.matches("the pull-off was not found").count(), 1);
}

#[test]
fn folders_that_are_no_runs_are_refused() {
    let scratch = Scratch::new();
    let (empty, file, nowhere) = (scratch.path("empty"), scratch.path("file"), scratch.path("nowhere"));
    std::fs::create_dir(&empty).expect("made");
    std::fs::write(&file, "a file").expect("written");
    let solved = scratch.path("solved");
    let solve = ["solve", "--challenge", "32", "--pressure", "0.01", "--out", word(&solved)];
    assert!(call(&solve).status.success());
    for command in ["report", "compare"] {
        for (folder, piece) in [
            (&empty, "results.json and manifest.json are missing"),
            (&file, "not a run folder but a file"),
            (&nowhere, "there is no such folder"),
            (&solved, "that of `asperity solve`, which has no report"),
        ] {
            let said = error_message(&[command, word(folder)], 2);
            assert!(said.contains("not a run folder") && said.contains(piece) && said.contains(word(folder)), "{said}");
        }
    }
    assert!(!solved.join("report.html").exists());
    assert_eq!(std::fs::read_dir(&empty).expect("there").count(), 0, "something was left in a foreign folder");
    assert!(!nowhere.exists());
}

/// Methods are named by their id, also if the program chose them, and tables are aligned.
#[test]
fn plans_and_progress_are_for_people() {
    let scratch = Scratch::new();
    let scene = tiny(&scratch, true);
    let plan = call(&["run", word(&scene), "--dry-run"]);
    let said = String::from_utf8_lossy(&plan.stdout).into_owned();
    assert!(said.contains("fast at 2 loads") && !said.contains("auto"), "{said}");
    // The columns of the scaling audit start below their headings.
    let lines: Vec<Vec<char>> = said.lines().map(|l| l.chars().collect()).collect();
    let head =
        lines.iter().position(|l| l.iter().collect::<String>().trim_start().starts_with("group")).expect("a head");
    let column = said.lines().nth(head).and_then(|l| l.find("status")).expect("a column");
    let audit: Vec<&Vec<char>> = lines[head + 1..].iter().take_while(|l| l.first() == Some(&' ')).collect();
    assert!(audit.len() > 3, "{said}");
    for line in audit {
        assert!(line[column - 1] == ' ' && line[column] != ' ', "{}", line.iter().collect::<String>());
    }
    let continuum = call(&["run", word(&tiny(&scratch, false)), "--out", word(&scratch.path("run"))]);
    let said = stderr(&continuum);
    assert!(said.contains("fast at 2 loads on 32 x 32 points") && !said.contains("auto"), "{said}");
    let pairs = String::from_utf8_lossy(&continuum.stdout).into_owned();
    assert!(pairs.contains("FFT pairs"), "{pairs}");
}

/// Statistics of a surface on a coarse grid are compared with the part of the spectrum that the grid resolves.
#[test]
fn a_coarse_grid_is_refused_with_the_resolved_waves() {
    let found = answer(&["surface", "--grid", "64", "--json"]);
    let of = |symbol: &str| {
        let all = found["statistics"].as_array().expect("a list");
        all.iter().find(|s| s["symbol"] == symbol).unwrap_or_else(|| panic!("no {symbol}")).clone()
    };
    for symbol in ["ḡ", "R_c", "m2", "m4"] {
        let line = of(symbol);
        assert_relative_eq!(number(&line, "realised"), number(&line, "expected_on_grid"), max_relative = 0.1);
        assert!((number(&line, "realised") / number(&line, "expected") - 1.0).abs() > 0.3, "{line}");
    }
    let fine = answer(&["surface", "--grid", "64", "--cut-off", "5um", "--json"]);
    assert!(
        fine["statistics"].as_array().is_some_and(|all| all.iter().all(|s| s.get("expected_on_grid").is_none())),
        "{fine}"
    );
}

#[test]
fn integer_heights_are_heights() {
    let scratch = Scratch::new();
    let height = |i: usize| ((i % 16) * (i / 16) % 7) as i16 - 3;
    let (whole, real) = (scratch.path("whole.npy"), scratch.path("real.npy"));
    let map = ndarray::Array2::from_shape_fn((16, 16), |(y, x)| height(16 * y + x));
    ndarray_npy::write_npy(&whole, &map).expect("written");
    npy::write(&real, 16, 16, (0..256).map(|i| f64::from(height(i)))).expect("written");
    let solved = [&whole, &real].map(|file| {
        lasting(answer(&["solve", "--heights", word(file), "--length", "500", "--pressure", "0.01", "--json"]))
    });
    assert_eq!(solved[0], solved[1]);
}

#[test]
fn atoms_are_built_run_and_read_by_hand() {
    let scratch = Scratch::new();
    let (scene, job) = (tiny(&scratch, true), scratch.path("job"));
    let built = answer(&["atoms", "build", word(&scene), "--out", word(&job), "--json"]);
    assert_eq!(built["job"]["deformable"].as_u64(), Some(2 * 10 * 10 * 2 * 6));
    assert!(built["audit"].as_array().is_some_and(|lines| !lines.is_empty()), "{built}");
    assert!(job.join("job.json").exists());
    let missing = call(&["atoms", "run", word(&job), "--lammps", "/nonexistent/lmp"]);
    assert_eq!(missing.status.code(), Some(5), "{}", stderr(&missing));
    let nowhere = scratch.path("nowhere");
    error_message(&["atoms", "read", word(&scene), "--job", word(&nowhere)], 2);
    assert!(!nowhere.exists());
    let read = ["atoms", "read", word(&scene), "--job", word(&job), "--json"];
    error_message(&read, 2);
    let Some(_lammps) = lammps(1) else { return };
    let ran = answer(&["atoms", "run", word(&job), "--json"]);
    let steps = ran["steps"].as_array().expect("steps");
    assert!(steps.len() > 2 && number(&steps[steps.len() - 1], "p_star") >= 0.02, "{ran}");
    let states = answer(&read);
    let states = states["states"].as_array().expect("states").clone();
    let contacts: Vec<f64> = states.iter().map(|s| number(s, "contacts")).collect();
    assert!(contacts.len() == 2 && contacts[0] > 0.0 && contacts[1] > contacts[0], "{contacts:?}");
    let named = states[0]["contact_map"].as_str().expect("a file");
    assert!(job.join("read").join(named).exists(), "{named}");
}
