//! `asperity sweep` and `asperity ensemble`: points, statistics, resuming, failing points.

use crate::program::{asperity, json_line, stderr};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// A continuum that is solved in a fraction of a second.
const SCENE: &str = "name = \"small\"\n[surface]\ngrid = 32\ncut_off_mode = 8\n[load]\np_star = [0.02, 0.1]\n";

fn written(folder: &Path, name: &str, text: &str) -> std::path::PathBuf {
    let path = folder.join(name);
    fs::write(&path, text).expect("written");
    path
}

fn swept(command: &str, file: &Path, out: &Path, flags: &[&str]) -> (Option<i32>, Value, String) {
    let output = asperity().arg(command).arg(file).args(flags).arg("--out").arg(out).arg("--json").output();
    let output = output.expect("started");
    let line = if output.stdout.is_empty() { Value::Null } else { json_line(&output) };
    (output.status.code(), line, stderr(&output))
}

fn ensemble(out: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(out.join("ensemble.json")).expect("read")).expect("JSON")
}

/// Mean and standard error of the file are those of the runs of its points.
#[test]
fn means_are_those_of_the_runs() {
    let scratch = tempfile::tempdir().expect("scratch");
    let (scene, out) = (written(scratch.path(), "small.toml", SCENE), scratch.path().join("out"));
    let (code, line, said) = swept("ensemble", &scene, &out, &["--seeds", "1..3"]);
    assert_eq!(
        (code, &line["points"], &line["done"], &line["failed"]),
        (Some(0), &3.into(), &3.into(), &0.into()),
        "{said}"
    );
    let areas: Vec<f64> = (1..=3)
        .map(|seed| {
            let text = fs::read_to_string(out.join(format!("points/seed-{seed}/results.json"))).expect("a run");
            let results: Value = serde_json::from_str(&text).expect("JSON");
            results["continuum"]["states"][1]["contact_area"].as_f64().expect("a number")
        })
        .collect();
    let mean = areas.iter().sum::<f64>() / 3.0;
    let error = (areas.iter().map(|a| (a - mean).powi(2)).sum::<f64>() / 2.0 / 3.0).sqrt();
    assert!(error > 1e-4, "three seeds are three surfaces");
    let found = ensemble(&out);
    let is = |s: &&Value| s["source"] == "continuum" && s["load"] == 1 && s["quantity"] == "contact_area";
    let statistic = found["statistics"].as_array().expect("a list").iter().find(is).expect("the area");
    let number = |key: &str| statistic[key].as_f64().expect("a number");
    assert!((number("mean") - mean).abs() < 1e-15 && (number("standard_error") - error).abs() < 1e-15);
    assert_eq!(number("realisations"), 3.0);
    let csv = fs::read_to_string(out.join("statistics.csv")).expect("read");
    assert!(
        csv.starts_with("source,load,branch,quantity,unit,p_star,realisations,mean,standard_deviation,standard_error")
    );
    let page = fs::read_to_string(out.join("report.html")).expect("read");
    assert!(page.contains("3 of 3 points over surface.seed are done") && page.contains("<svg"));
    assert!(page.contains("3 realisations") && page.contains("standard errors do not contain the uncertainty"));
    // The same command adds what is missing and leaves the rest.
    let log = |seed: u32| fs::read_to_string(out.join(format!("logs/seed-{seed}.log"))).expect("a log");
    let (code, line, _) = swept("ensemble", &scene, &out, &["--seeds", "1..4"]);
    assert_eq!((code, &line["done"]), (Some(0), &4.into()));
    assert!(log(1).contains("done before") && !log(4).contains("done before"), "{}", log(1));
    let page = fs::read(out.join("report.html")).expect("read");
    fs::remove_file(out.join("report.html")).expect("removed");
    let report = asperity().arg("report").arg(&out).output().expect("started");
    assert!(report.status.success(), "{}", stderr(&report));
    assert!(fs::read(out.join("report.html")).expect("drawn") == page, "the same table gave another report");
    let refused = asperity().arg("compare").arg(&out).output().expect("started");
    assert!(refused.status.code() == Some(2) && stderr(&refused).contains("that of a sweep"), "{}", stderr(&refused));
}

/// A product of two keys; one point that fails leaves the others, with its reason and exit code.
#[test]
fn a_failing_point_leaves_the_others() {
    let scratch = tempfile::tempdir().expect("scratch");
    written(scratch.path(), "small.toml", SCENE);
    let text = "scene = \"small.toml\"\n[over]\nsurface.seed = \"1..2\"\ncontinuum.max_iterations = [3, 50000]\n";
    let (file, out) = (written(scratch.path(), "sweep.toml", text), scratch.path().join("out"));
    let (code, line, said) = swept("sweep", &file, &out, &["--jobs", "2"]);
    assert_eq!((code, &line["done"], &line["failed"]), (Some(3), &2.into(), &2.into()), "{said}");
    let found = ensemble(&out);
    let failed: Vec<&Value> =
        found["points"].as_array().expect("a list").iter().filter(|p| p["status"] == "failed").collect();
    assert!(failed.iter().all(|p| p["values"][0] == 3 && p["reason"].as_str().expect("words").contains("converging")));
    let groups = found["statistics"].as_array().expect("a list");
    assert!(groups.iter().all(|s| s["group"] == serde_json::json!([["continuum.max_iterations", 50000]])));
}

/// The process that runs a point.
fn process_of(point: &Path) -> Option<String> {
    std::fs::read_dir("/proc").ok()?.filter_map(Result::ok).find_map(|entry| {
        let words = std::fs::read(entry.path().join("cmdline")).ok()?;
        let is_run = words.split(|b| *b == 0).any(|word| word == point.as_os_str().as_encoded_bytes());
        entry.file_name().into_string().ok().filter(|_| is_run)
    })
}

/// As by a system that has run out of memory.
#[test]
fn a_killed_point_is_no_bug() {
    let scratch = tempfile::tempdir().expect("scratch");
    let scene = written(scratch.path(), "large.toml", &SCENE.replace("grid = 32", "grid = 512"));
    let out = scratch.path().join("out");
    let ended = std::thread::scope(|scope| {
        let sweep = scope.spawn(|| swept("ensemble", &scene, &out, &["--seeds", "1..2", "--jobs", "1"]));
        let point = loop {
            assert!(!sweep.is_finished(), "the sweep ended before its point was killed");
            match process_of(&out.join("points/seed-1")) {
                Some(point) => break point,
                None => std::thread::sleep(std::time::Duration::from_millis(2)),
            }
        };
        assert!(std::process::Command::new("kill").args(["-9", &point]).status().expect("sent").success());
        sweep.join().expect("ended")
    });
    let (code, line, said) = ended;
    assert_eq!((code, &line["done"], &line["failed"]), (Some(5), &1.into(), &1.into()), "{said}");
    assert!(said.contains("killed by signal 9, as by a machine without free memory"), "{said}");
}

/// Values of a load belong to one curve, and realisations share an uncertainty that their scatter does not have.
#[test]
fn combinations_share_a_figure_and_a_warning() {
    let scratch = tempfile::tempdir().expect("scratch");
    written(scratch.path(), "small.toml", SCENE);
    let text = "scene = \"small.toml\"\n[over]\nsurface.hurst = [0.5, 0.8]\nload.p_star = [[0.01], [0.03]]\n";
    let (file, out) = (written(scratch.path(), "sweep.toml", text), scratch.path().join("out"));
    let (code, _, said) = swept("sweep", &file, &out, &[]);
    assert_eq!(code, Some(0), "{said}");
    let drawing = fs::read_to_string(out.join("figures/ensemble-contact_area.svg")).expect("drawn");
    for hurst in ["surface.hurst = 0.5", "surface.hurst = 0.8"] {
        assert_eq!(drawing.matches(&format!(">{hurst}<")).count(), 1, "{hurst}");
    }
    // Single loads have no figures of their own.
    assert!(
        out.join("figures/ensemble-mean_gap.svg").exists() && !out.join("figures/ensemble-0-mean_gap-0.svg").exists()
    );
    let found = ensemble(&out);
    let uncertain = |p: &Value| p["area_uncertainty"].as_f64().is_some_and(|u| u > 0.0);
    // Contacts of fewer than ten nodes on the coarser grid have no error.
    assert!(found["points"].as_array().expect("a list").iter().any(uncertain), "{found}");
    // Of a single surface there are no realisations, means and errors.
    let page = fs::read_to_string(out.join("report.html")).expect("drawn");
    let page = page.split("<body").nth(1).expect("a body").to_lowercase();
    assert!(page.contains("the numbers do not state the uncertainty of each contact area"));
    for word in ["realisation", "standard error", "standard deviation", "extremes", "mean difference", "all means"] {
        assert!(!page.contains(word), "{word}");
    }
    let again = asperity().arg("sweep").arg(&file).arg("--out").arg(&out).output().expect("started");
    let printed = String::from_utf8_lossy(&again.stdout);
    assert!(printed.contains(" value ") && !printed.contains("standard"), "{printed}");
}

/// Waiting ranks spin: points whose ranks take all cores run one after the other.
#[test]
fn points_with_many_ranks_run_one_at_a_time() {
    let scratch = tempfile::tempdir().expect("scratch");
    written(scratch.path(), "small.toml", &format!("{SCENE}[atoms]\ncells = 10\ndepth_cells = 6\n"));
    let text = "scene = \"small.toml\"\n[over]\nsurface.seed = \"1..4\"\n";
    let file = written(scratch.path(), "sweep.toml", text);
    let (code, line, said) = swept("sweep", &file, &scratch.path().join("out"), &["--dry-run", "--ranks", "4096"]);
    assert_eq!((code, &line["at_once"]), (Some(0), &1.into()), "{said}");
}

/// A killed sweep ends with the tables of an undisturbed one.
#[test]
fn a_killed_sweep_resumes_with_the_same_tables() {
    let scratch = tempfile::tempdir().expect("scratch");
    let scene = written(scratch.path(), "small.toml", SCENE);
    let (whole, killed) = (scratch.path().join("whole"), scratch.path().join("killed"));
    assert_eq!(swept("ensemble", &scene, &whole, &["--seeds", "1..4", "--jobs", "1"]).0, Some(0));
    let mut child = asperity();
    child.arg("ensemble").arg(&scene).args(["--seeds", "1..4", "--jobs", "1", "--out"]).arg(&killed);
    let mut child = child.stderr(std::process::Stdio::null()).spawn().expect("started");
    while !killed.join("points/seed-2").exists() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child.kill().expect("killed");
    child.wait().expect("ended");
    assert!(!killed.join("ensemble.json").exists());
    assert_eq!(swept("ensemble", &scene, &killed, &["--seeds", "1..4", "--jobs", "1"]).0, Some(0));
    for table in ["ensemble.json", "numbers.csv", "statistics.csv", "differences.csv"] {
        let read = |folder: &Path| fs::read(folder.join(table)).expect("read");
        assert!(read(&whole) == read(&killed), "{table}");
    }
}

/// A sweep that is told to stop leaves the tables of what is done, and ends as an undisturbed one when it is continued.
#[test]
fn a_sweep_that_is_stopped_leaves_its_tables() {
    let scratch = tempfile::tempdir().expect("scratch");
    let scene = written(scratch.path(), "small.toml", SCENE);
    let out = scratch.path().join("out");
    let mut child = asperity();
    child.arg("ensemble").arg(&scene).args(["--seeds", "1..40", "--jobs", "1", "--out"]).arg(&out);
    let child =
        child.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::piped()).spawn().expect("started");
    while !out.join("points/seed-2").exists() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    asperity_grid::sys::group::terminate(child.id());
    let ended = child.wait_with_output().expect("ended");
    let said = String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.code() == Some(130) && said.contains("stopping after the current step"), "{said}");
    let states = |found: &Value, status: &str| {
        found["points"].as_array().expect("a list").iter().filter(|p| p["status"] == status).count()
    };
    let left = ensemble(&out);
    assert!(states(&left, "done") >= 1 && states(&left, "waiting") >= 1 && states(&left, "failed") == 0, "{left}");
    assert_eq!(swept("ensemble", &scene, &out, &["--seeds", "1..40", "--jobs", "1"]).0, Some(0));
    assert_eq!(states(&ensemble(&out), "done"), 40);
}

/// Points of another scene are refused before anything is written, as a run is.
#[test]
fn a_sweep_of_another_scene_leaves_the_folder_as_it_is() {
    let scratch = tempfile::tempdir().expect("scratch");
    let (scene, out) = (written(scratch.path(), "small.toml", SCENE), scratch.path().join("out"));
    assert_eq!(swept("ensemble", &scene, &out, &["--seeds", "1..2"]).0, Some(0));
    let kept = |name: &str| fs::read(out.join(name)).expect("a file");
    let files = ["ensemble.json", "numbers.csv", "statistics.csv", "report.html", "scenes/seed-1.toml"];
    let before = files.map(kept);
    let other =
        written(scratch.path(), "small.toml", &SCENE.replace("cut_off_mode = 8", "cut_off_mode = 8\nhurst = 0.6"));
    let (code, _, said) = swept("ensemble", &other, &out, &["--seeds", "1..2"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("--out = ") && said.contains("hurst = 0.6") && said.contains("--overwrite"), "{said}");
    assert_eq!(said.lines().filter(|line| line.contains("error")).count(), 1, "{said}");
    assert!(files.map(kept) == before, "files were written");
    // What no result depends on is no other scene.
    let strict = written(scratch.path(), "small.toml", &SCENE.replace("[surface]", "[surface]\nstrict = true"));
    assert_eq!(swept("ensemble", &strict, &out, &["--seeds", "1..2"]).0, Some(0));
    let other =
        written(scratch.path(), "small.toml", &SCENE.replace("cut_off_mode = 8", "cut_off_mode = 8\nhurst = 0.6"));
    let (code, line, said) = swept("ensemble", &other, &out, &["--seeds", "1..2", "--overwrite"]);
    assert_eq!((code, &line["done"]), (Some(0), &2.into()), "{said}");
}

#[test]
fn wrong_sweeps_are_refused_in_one_line() {
    let scratch = tempfile::tempdir().expect("scratch");
    written(scratch.path(), "small.toml", SCENE);
    for (over, says) in [
        ("surface.sead = [1]", "surface.sead"),
        ("surface.seed = 3", "a list of values"),
        ("surface.seed = \"x\"", "1..12"),
        ("surface.seed = []", "at least one value"),
        ("surface.seed = [1, 1]", "each combination of values once"),
        ("surface.seed = [-1]", "surface.seed = -1"),
        ("surface.hurst = \"lin:0.1:0.9:1\"", "2 to 10000"),
    ] {
        let text = format!("scene = \"small.toml\"\n[over]\n{over}\n");
        let (file, out) = (written(scratch.path(), "sweep.toml", &text), scratch.path().join("out"));
        let (code, _, said) = swept("sweep", &file, &out, &[]);
        assert_eq!(code, Some(2), "{over}");
        assert!(
            said.contains(says) && said.contains("sweep.toml") && said.trim().lines().count() == 1,
            "{over}: {said}"
        );
        assert!(!out.exists(), "{over}: nothing is written");
    }
    let (file, out) = (scratch.path().join("small.toml"), scratch.path().join("out"));
    assert_eq!(swept("ensemble", &file, &out, &["--seeds", "3..1"]).0, Some(2));
    assert_eq!(swept("ensemble", &file, &out, &["--seeds", "1"]).0, Some(0));
    let other = written(scratch.path(), "sweep.toml", "scene = \"small.toml\"\n[over]\nsurface.hurst = [0.5]\n");
    let (code, _, said) = swept("sweep", &other, &out, &[]);
    assert!(code == Some(2) && said.contains("contains the sweep small over surface.seed"), "{said}");
}
