//! `--error` and `--budget`: grids from coarse to fine until the stated errors are small enough.

use crate::program::{asperity, json_line, stderr};
use asperity::record::results::Results;
use asperity_contact::problem::AccuracyResults;
use asperity_contact::quantity::Quantity;
use asperity_contact::uncertainty::UncertaintySource;
use serde_json::Value;
use std::path::Path;
use std::process::Output;

/// The challenge's spectrum with a cut-off at L/16: 256 points have 16 points per shortest wave.
const SURFACE: [&str; 8] = ["solve", "--challenge", "64", "--cut-off", "0.0625", "--pressure", "0.03", "--json"];

fn solve(flags: &[&str]) -> Output {
    asperity().args(SURFACE).args(flags).output().expect("started")
}

/// The lines of JSON: each state, and the accuracy.
fn lines(output: &Output) -> Vec<Value> {
    assert!(output.status.success(), "{}", stderr(output));
    String::from_utf8_lossy(&output.stdout).lines().map(|l| serde_json::from_str(l).expect("JSON")).collect()
}

fn errors(state: &Value) -> [f64; 3] {
    [("contact_area_error", "contact_area"), ("mean_gap_error", "mean_gap"), ("stiffness_error", "stiffness")]
        .map(|(error, value)| state[error].as_f64().expect("an error") / state[value].as_f64().expect("a value"))
}

/// The result has the errors that were asked for, that of the next coarser grid has not, and a plain solve on its grid states the same.
#[test]
fn the_coarsest_grid_with_these_errors_is_the_result() {
    let found = lines(&solve(&["--error", "10%"]));
    let [state, accuracy] = &found[..] else { panic!("{found:?}") };
    assert!(accuracy["met"] == true && errors(state).iter().all(|e| *e <= 0.1), "{state}");
    let grids = accuracy["accuracy"]["grids"].as_array().expect("grids");
    assert!(grids.len() > 1 && grids.last().expect("one")["nx"] == state["nx"], "{accuracy}");
    let before = &grids[grids.len() - 2]["errors"];
    let within = |e: &Value| e.as_f64().is_some_and(|e| e <= 0.1);
    assert!(!before.as_object().expect("errors").values().all(within), "{before}");
    let points = state["nx"].to_string();
    let plain =
        ["solve", "--challenge", &points, "--cut-off", "0.0625", "--pressure", "0.03", "--json", "--tolerance", "1e-4"];
    let plain = json_line(&asperity().args(plain).output().expect("started"));
    for key in ["contact_area", "contact_area_error", "mean_gap", "stiffness_error"] {
        assert_eq!(plain[key], state[key], "{key}");
    }
    // Ten times the error costs no more; a tenth of it is on no grid of this surface, or an estimate.
    let seconds = accuracy["seconds"].as_f64().expect("seconds");
    let ten_times = &accuracy["ten_times_the_error"];
    assert!(ten_times["measured"] == true && ten_times["seconds"].as_f64().is_some_and(|s| s <= seconds), "{accuracy}");
    let tenth = &accuracy["a_tenth_of_the_error"];
    assert!(tenth.is_null() || tenth["seconds"].as_f64().is_some_and(|s| s > seconds), "{accuracy}");
}

/// A named quantity is judged alone, on a coarser grid than all of them.
#[test]
fn errors_of_single_quantities() {
    let points = |flags: &[&str]| lines(&solve(flags))[0]["nx"].as_u64().expect("points");
    assert!(points(&["--error", "mean_gap=5%"]) < points(&["--error", "5%"]));
    let found = lines(&solve(&["--error", "leakage=30%", "--leakage"]));
    assert!(found[1]["met"] == true && found[1]["errors"]["leakage"].as_f64().is_some_and(|e| e <= 0.3), "{found:?}");
}

/// A map ends with its own points: the results are complete, the warning says what was reached, and --strict makes it an error.
#[test]
fn an_error_that_a_map_does_not_reach() {
    let scratch = tempfile::tempdir().expect("scratch");
    let out = scratch.path().join("out");
    let wave = |i: usize| -0.1 * (std::f64::consts::TAU * i as f64 / 64.0).cos();
    let rows = (0..64).map(|y| (0..64).map(|x| format!("{:.9}", wave(x) + wave(y))).collect::<Vec<_>>().join(" "));
    let map = scratch.path().join("map.txt");
    std::fs::write(&map, rows.collect::<Vec<_>>().join("\n")).expect("written");
    let run = |more: &[&str]| {
        let mut command = asperity();
        command.arg("solve").arg(&map);
        command.args([
            "--touching",
            "low-points",
            "--length",
            "1",
            "--modulus",
            "1",
            "--pressure",
            "0.01",
            "--error",
            "0.1%",
        ]);
        command.args(more).output().expect("started")
    };
    let warned = run(&["--out", out.to_str().expect("UTF-8")]);
    assert!(warned.status.success(), "{}", stderr(&warned));
    let said = stderr(&warned);
    assert!(
        said.contains("an error of 0.1 % is not reached: contact area") && said.contains("on 64 x 64 points"),
        "{said}"
    );
    let names: Vec<String> =
        std::fs::read_dir(&out).expect("a folder").flatten().map(|e| e.file_name().to_string_lossy().into()).collect();
    assert!(names.iter().any(|n| n == "gap.npy") && names.iter().all(|n| !n.starts_with("grid-")), "{names:?}");
    // The same command reads the results, and says the same of them.
    let again = run(&["--out", out.to_str().expect("UTF-8")]);
    assert!(stderr(&again).contains("finished already") && again.stdout == warned.stdout, "{}", stderr(&again));
    let strict = run(&["--strict"]);
    assert_eq!(strict.status.code(), Some(3), "{}", stderr(&strict));
}

/// No finer grid is begun that would exceed the time.
#[test]
fn a_budget_ends_the_refinement() {
    let found = lines(&solve(&["--budget", "1ms"]));
    assert!(found[1]["accuracy"]["last"] == "budget" && found[1]["accuracy"]["budget_seconds"] == 0.001, "{found:?}");
    let found = lines(&solve(&["--budget", "10min"]));
    assert!(found[1]["accuracy"]["last"] == "waves" && found[0]["nx"] == 256, "{}", found[1]);
}

#[test]
fn what_is_no_error_is_refused() {
    for (flags, says) in [
        (&["--error", "5"][..], "did you mean 5%?"),
        (&["--error", "500%"], "below 100%"),
        (&["--error", "0"], "between 0 and 100%"),
        (&["--error", "-1"], "between 0 and 100%"),
        (&["--error", "volume=5%"], "contact_area, mean_gap"),
        (&["--error", "leakage=5%"], "where the leakage is solved"),
        (&["--error", "pull_off=5%"], "where the pull-off is searched for"),
        (&["--error", "5%", "--method", "persson"], "solves for the fields"),
        (&["--budget", "0s"], "a time above zero"),
    ] {
        let output = solve(flags);
        let said = stderr(&output);
        assert!(
            output.status.code() == Some(2) && said.contains(says) && said.lines().count() == 1,
            "{flags:?}: {said}"
        );
    }
    let contact =
        asperity().args(["solve", "--challenge", "64", "--contact", "0.1", "--error", "5%"]).output().expect("started");
    assert!(contact.status.code() == Some(2) && stderr(&contact).contains("--contact"), "{}", stderr(&contact));
}

/// Scenes ask in their own table; `run` uses the grid for everything, and says it in results and report.
#[test]
fn a_scene_asks_for_an_accuracy() {
    let scratch = tempfile::tempdir().expect("scratch");
    let scene = |accuracy: &str| {
        let file = scratch.path().join("scene.toml");
        let text = "name = \"accuracy\"\n[surface]\ngrid = 64\ncut_off_mode = 16\n[load]\np_star = [0.03, 0.1]\n[continuum]\ncompare_with = [\"persson\"]\n";
        std::fs::write(&file, format!("{text}[accuracy]\n{accuracy}\n")).expect("written");
        file
    };
    let out = scratch.path().join("out");
    let run = |scene: &Path, flags: &[&str]| {
        asperity().arg("run").arg(scene).arg("--out").arg(&out).args(flags).output().expect("started")
    };
    let file = scene("error = { area = \"10 %\", mean_gap = 0.05 }");
    let output = run(&file, &[]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(String::from_utf8_lossy(&output.stdout).contains("within contact area 10 %, mean gap 5 %: contact area"));
    let results = Results::read(&out).expect("results");
    let (accuracy, solved) = (results.accuracy.expect("an accuracy"), results.continuum.expect("a continuum"));
    assert!(accuracy.is_met() && accuracy.grids.last().is_some_and(|g| g.nx == solved.nx), "{accuracy:?}");
    assert_eq!((results.surface.nx, results.methods[0].method.as_str()), (solved.nx, "persson"));
    for state in &solved.states {
        assert!(state.contact_area_error.is_some_and(|e| e <= 0.1 * state.contact_area), "{state:?}");
    }
    let page = std::fs::read_to_string(out.join("report.html")).expect("a page");
    assert!(page.contains("was asked for, and reached"));
    // The same scene again solves nothing; another error is another scene.
    let again = run(&file, &[]);
    let said = stderr(&again);
    assert!(again.status.success() && said.contains("accuracy  done before") && !said.contains("done in"), "{said}");
    assert!(std::fs::read_dir(out.join("accuracy")).expect("a stage").flatten().all(|e| e.path().is_file()));
    // Without its last word the stage goes on, with the grids that are finished.
    std::fs::remove_file(out.join("accuracy/done.json")).expect("removed");
    assert!(run(&file, &[]).status.success());
    let other = run(&file, &["--error", "area=30%"]);
    assert!(other.status.code() == Some(2) && stderr(&other).contains("accuracy.error"), "{}", stderr(&other));
    for (wrong, says) in [
        ("error = 5", "did you mean 5%?"),
        ("error = { volume = 0.1 }", "contact_area"),
        ("budget = \"-3 s\"", "accuracy.budget"),
    ] {
        let output = run(&scene(wrong), &[]);
        assert!(output.status.code() == Some(2) && stderr(&output).contains(says), "{wrong}: {}", stderr(&output));
    }
}

/// A shallow block misses an error that the same atoms on a half-space reach.
#[test]
fn the_depth_of_the_atoms_is_judged() {
    let Some(_lammps) = crate::lammps::lammps(1) else { return };
    let scratch = tempfile::tempdir().expect("scratch");
    let run = |base: &str, flags: &[&str]| {
        let file = scratch.path().join("scene.toml");
        let text = format!(
            "name = \"depth\"\n[surface]\ngrid = 64\nroll_off_mode = 1\ncut_off_mode = 8\nrms_gradient = 0.3\n[load]\np_star = [0.02, 0.05]\n\
             [accuracy]\nerror = {{ mean_gap = \"5 %\" }}\n[atoms]\ncells = 10\ndepth_cells = 2\n{base}"
        );
        std::fs::write(&file, text).expect("written");
        let out = scratch.path().join(if base.is_empty() { "rigid" } else { "elastic" });
        let output = asperity().arg("run").arg(&file).arg("--out").arg(&out).args(flags).output().expect("started");
        (
            output,
            Results::read(&out).expect("results"),
            std::fs::read_to_string(out.join("report.html")).expect("a page"),
        )
    };
    let depth = |results: &Results| -> f64 {
        let hard = &results.comparison.as_ref().expect("compared").hard_wall;
        let parts = hard.states.iter().flat_map(|s| &s.uncertainty);
        let of_depth = parts.filter(|p| p.source == UncertaintySource::Depth && p.quantity == Quantity::MeanGap);
        of_depth.map(|p| p.relative.expect("known")).reduce(f64::max).expect("judged")
    };
    let (output, results, page) = run("", &[]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(results.accuracy.as_ref().is_some_and(AccuracyResults::is_met) && depth(&results) > 0.05);
    let said = stderr(&output);
    assert!(said.contains("is not reached by the atoms") && said.contains("atoms.foundation_cells"), "{said}");
    assert!(results.warnings.iter().any(|w| w.contains("is not reached by the atoms")), "{:?}", results.warnings);
    assert!(page.contains("relative to a half-space") && page.contains("not reached"));
    let (output, ..) = run("", &["--strict"]);
    let said = stderr(&output);
    assert!(
        output.status.code() == Some(3) && said.contains("error: an error of mean gap 5 % is not reached by"),
        "{said}"
    );
    let (output, results, _) = run("foundation_cells = \"half-space\"\nbase = \"elastic\"\n", &["--strict"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(depth(&results) < 1e-3 && !stderr(&output).contains("is not reached by"), "{}", depth(&results));
}
