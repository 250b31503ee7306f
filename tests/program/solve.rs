//! `asperity solve` along load paths, as in scripts.

use crate::flags::dimensionless;
use crate::program::{asperity, json_line, stderr};
use asperity::surface::files::npy;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// The challenge's spectrum with a cut-off at L/16, in units of the cell, with an adhesion that 64 points resolve.
const SURFACE: [&str; 6] = ["solve", "--challenge", "64", "--cut-off", "0.0625", "--json"];
const STICKY: [&str; 4] = ["--gamma", "9e-4", "--rho", "6e-3"];

fn solve(flags: &[&str]) -> std::process::Output {
    asperity().args(SURFACE).args(flags).output().expect("started")
}

/// The output, one JSON object per line.
fn lines(flags: &[&str]) -> Vec<Value> {
    let output = solve(flags);
    assert!(output.status.success(), "{flags:?}: {}", stderr(&output));
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    text.lines().map(|l| serde_json::from_str(l).expect("JSON")).collect()
}

fn number(line: &Value, key: &str) -> f64 {
    line[key].as_f64().unwrap_or_else(|| panic!("{key} in {line}"))
}

/// One line and one set of files per load. Imposing the mean gap found at a pressure returns that pressure.
#[test]
fn loads_one_after_another() {
    let scratch = tempfile::tempdir().expect("scratch");
    let out = scratch.path().join("out");
    let path = [&STICKY[..], &["--pressure", "0.01,0.03", "--out", out.to_str().expect("UTF-8")]].concat();
    let states = lines(&path);
    assert_eq!(states.len(), 2);
    assert!(number(&states[1], "contact_area") > number(&states[0], "contact_area"));
    for (i, state) in states.iter().enumerate() {
        assert!(state["discretisation"]["area"].as_f64().is_some_and(|d| d > 0.0), "{state}");
        for name in ["gap.npy", "stress.npy", "contact.npy", "solve.json"] {
            assert!(out.join(format!("load-{}-{name}", i + 1)).exists(), "{name}");
        }
    }
    assert!(!out.join("checkpoint.json").exists(), "nothing is left to go on with");
    // Finished loads are printed again with the same times, also in text form.
    let again = solve(&path);
    let answer = String::from_utf8_lossy(&again.stdout).into_owned();
    let lines_again: Vec<Value> = answer.lines().map(|l| serde_json::from_str(l).expect("JSON")).collect();
    assert!(lines_again == states && stderr(&again).contains("finished already"), "{}", stderr(&again));
    let words: Vec<&str> = [&SURFACE[..], &path].concat().into_iter().filter(|f| *f != "--json").collect();
    let people = asperity().args(words).output().expect("started");
    let said = String::from_utf8_lossy(&people.stdout).into_owned();
    assert!(
        stderr(&people).contains("finished already")
            && said.matches("residual").count() == 1
            && said.lines().count() == 3,
        "{said}"
    );
    // A load is solved again if its fields are missing.
    std::fs::remove_file(out.join("load-2-gap.npy")).expect("removed");
    assert!(!stderr(&solve(&path)).contains("finished already") && out.join("load-2-gap.npy").exists());
    let gap = number(&states[1], "mean_gap").to_string();
    let start = out.join("load-1-gap.npy");
    let back = lines(&[&STICKY[..], &["--mean-gap", &gap, "--initial-gap", start.to_str().expect("UTF-8")]].concat());
    // Both are solved to a residual of 1e-8 of the pressure.
    assert!((number(&back[0], "pressure") / 0.03 - 1.0).abs() < 1e-6, "{}", back[0]);
}

/// The table of several loads has the flow with `--leakage`, and the plastic flow with a hardness.
#[test]
fn the_table_of_loads_has_flow_and_plastic_flow() {
    let flags = ["--pressure", "0.01,0.03", "--leakage", "--hardness", "0.2"];
    let states = lines(&flags);
    let plain: Vec<&str> = SURFACE.into_iter().filter(|f| *f != "--json").chain(flags).collect();
    let people = asperity().args(plain).output().expect("started");
    let said = String::from_utf8_lossy(&people.stdout).into_owned();
    let rows: Vec<&str> = said.lines().collect();
    for head in ["flow gap x", "flow gap y", "flowing"] {
        assert!(rows[0].contains(head), "{said}");
    }
    for (state, row) in states.iter().zip(&rows[1..]) {
        let cells: Vec<&str> = row.split_whitespace().collect();
        for conductivity in state["leakage"]["conductivity"].as_array().expect("along x and y") {
            // As shown, to the digits of its error.
            let gap = conductivity.as_f64().expect("a number").cbrt();
            let shown = |cell: &&str| cell.parse::<f64>().is_ok_and(|c| (c / gap - 1.0).abs() < 0.02);
            assert!(cells.iter().any(shown), "{gap}: {row}");
        }
        assert!(number(state, "flowing_fraction") > 0.0, "{state}");
        assert_eq!(cells.iter().filter(|cell| cell.ends_with('%')).count(), 2, "contact and flow: {row}");
    }
}

/// The range used on a grid is reported; extrapolation to the requested range is done only if the grid does not resolve
/// it.
#[test]
fn adhesion_ranges_are_reported() {
    let with_range = |range: &str, rho: &str| {
        lines(&["--pressure", "0.01", "--gamma", "9e-4", "--rho", rho, "--resolution", range]).swap_remove(0)
    };
    let mesh = with_range("mesh", "1e-3");
    assert_eq!(mesh["range"]["requested"].as_f64(), Some(1e-3));
    assert!((mesh["range"]["resolution_used"].as_f64().expect("a number") - 1.4).abs() < 1e-12, "{mesh}");
    assert!(number(&mesh, "cohesive_resolution") < 1.0);
    assert_eq!(with_range("true", "1e-3")["range"]["used"].as_f64(), Some(1e-3));
    let far = with_range("extrapolate", "5e-3");
    let found = &far["extrapolated"]["contact_area"];
    assert!(found["error"].as_f64().is_some_and(|e| e > 0.0), "{far}");
    assert!(with_range("extrapolate", "6e-3")["extrapolated"].is_null());
    // If the three grids give no estimate, the output states this.
    let lost = ["--pressure", "0.01", "--gamma", "9e-4", "--rho", "1e-3", "--resolution", "extrapolate"];
    assert!(lines(&lost)[0]["extrapolated"].is_null());
    let words: Vec<&str> = SURFACE.into_iter().filter(|f| *f != "--json").chain(lost).collect();
    let people = asperity().args(words).output().expect("started");
    assert!(String::from_utf8_lossy(&people.stdout).contains("at the true range"), "{people:?}");
    let said = stderr(&solve(&["--pressure", "0.01", "--gamma", "9e-4", "--rho", "1e-3"]));
    assert!(said.contains("does not resolve the adhesion") && said.contains("enlarged"), "{said}");
}

#[test]
fn pulled_off_and_dry_run() {
    let states = lines(&[&STICKY[..], &["--pressure", "0.01", "--pull-off", "--tol", "1e-6"]].concat());
    let pull = number(&states[1], "pull_off_pressure");
    assert!(pull < 0.0, "{}", states[1]);
    let beyond = (1.1 * pull).to_string();
    let output = solve(&[&STICKY[..], &["--pressure", &format!("0.01,{beyond}")]].concat());
    assert_eq!(output.status.code(), Some(3));
    assert!(stderr(&output).contains("contact is lost at load 2 of 2, a pressure of -"), "{}", stderr(&output));
    // The pull-off pressure has an error, and detached states have no results in text form.
    assert!(number(&states[1], "pull_off_pressure_error") > 0.0 && states[1]["coarser"][0] == 32, "{}", states[1]);
    let plain: Vec<&str> = SURFACE.into_iter().filter(|f| *f != "--json").collect();
    let pressures = format!("0.01,{beyond}");
    let people = asperity().args(&plain).args(STICKY).args(["--pressure", &pressures]).output().expect("started");
    let said = String::from_utf8_lossy(&people.stdout).into_owned();
    let last: Vec<&str> = said.lines().last().expect("a table").split_whitespace().collect();
    assert!(last[0] == "2" && last.iter().filter(|cell| **cell == "–").count() == 4, "{said}");
    let people = asperity().args(plain).args(STICKY).args(["--pressure", &beyond]).output().expect("started");
    let alone = String::from_utf8_lossy(&people.stdout).into_owned();
    let row =
        |name: &str| alone.lines().find(|l| l.trim_start().starts_with(name)).map(|l| l.trim_end().ends_with('–'));
    assert_eq!(["contact area", "mean gap", "KKT residual"].map(row), [Some(true); 3], "{alone}");
    // Only a plan is printed, also for a grid that exceeds the memory of common machines.
    assert!(number(&json_line(&solve(&["--pressure", "0.01", "--dry-run"])), "bytes") > 0.0);
    let huge = asperity().args(["solve", "--challenge", "524288", "--pressure", "0.01", "--dry-run"]).output();
    let huge = huge.expect("started");
    assert_eq!(huge.status.code(), Some(5), "{}", stderr(&huge));
    assert!(stderr(&huge).contains("with --precision f32"), "{}", stderr(&huge));
}

/// States that did not converge are marked, and are no points of the curve.
#[test]
fn what_did_not_converge_is_no_point_of_the_curve() {
    let scratch = tempfile::tempdir().expect("scratch");
    let curve = |name: &str, flags: &[&str]| {
        let out = scratch.path().join(name);
        let output = solve(&[flags, &["--out", out.to_str().expect("UTF-8")]].concat());
        assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
        std::fs::read_to_string(out.join("curve.csv")).ok().map(|text| text.lines().count())
    };
    // The head and the first load; no file without a load.
    assert_eq!(curve("detached", &[&STICKY[..], &["--pressure", "0.01,-0.1"]].concat()), Some(2));
    assert_eq!(curve("stopped", &["--pressure", "0.01,0.02", "--max-iterations", "2"]), None);
    let plain: Vec<&str> = SURFACE.into_iter().filter(|f| *f != "--json").collect();
    let few = ["--pressure", "0.01,0.02", "--max-iterations", "2"];
    let said = asperity().args(&plain).args(few).output().expect("started").stdout;
    let said = String::from_utf8_lossy(&said).into_owned();
    assert!(said.lines().last().is_some_and(|l| l.ends_with("not converged: iteration limit")), "{said}");
}

/// A map is solved as the waves it was generated from, in both precisions; the result contains the plan of a dry run.
#[test]
fn a_map_is_its_waves() {
    /// Relative tolerance of mean gap and contact fraction, for the default tolerance of each precision.
    const AGREE: [(&str, f64); 2] = [("f64", 1e-6), ("f32", 2e-3)];
    let scratch = tempfile::tempdir().expect("scratch");
    let map = scratch.path().join("map.npy");
    let map = map.to_str().expect("UTF-8");
    let spectrum = ["--length", "1um", "--roll-off", "0.2um", "--cut-off", "0.0625um", "--seed", "18"];
    let made = asperity().args(["surface", "--grid", "64", "--out", map]).args(spectrum).output().expect("started");
    assert!(made.status.success(), "{}", stderr(&made));
    let waves = &lines(&["--pressure", "0.02"])[0];
    for (precision, agree) in AGREE {
        let of_map = |more: &[&str]| {
            let flags = [&["solve", "--heights", map, "--json", "--precision", precision], more].concat();
            asperity().args(dimensionless(&flags)).output().expect("started")
        };
        let answer = json_line(&of_map(&["--pressure", "0.02"]));
        for key in ["mean_gap", "contact_area", "resolved_gradient"] {
            let (found, expected) = (number(&answer, key), number(waves, key));
            assert!((found / expected - 1.0).abs() < agree, "{precision} {key}: {found} {expected}");
        }
        for more in [&["--pressure", "0.02"][..], &[&STICKY[..], &["--pressure", "0.01,0.02"]].concat()] {
            let plan = json_line(&of_map(&[more, &["--dry-run"]].concat()));
            let solved = of_map(more);
            let solved = String::from_utf8_lossy(&solved.stdout).into_owned();
            let first: Value = serde_json::from_str(solved.lines().next().expect("a load")).expect("JSON");
            assert_eq!(plan["bytes"], first["planned_bytes"], "{precision} {more:?}");
        }
    }
}

/// A folder with other files is refused and not changed; files of an earlier solve are removed. A surface that is very
/// steep because of a wrong unit gives a warning.
#[test]
fn a_folder_is_one_solve() {
    let scratch = tempfile::tempdir().expect("scratch");
    let (foreign, own) = (scratch.path().join("foreign"), scratch.path().join("own"));
    std::fs::create_dir(&foreign).expect("made");
    std::fs::write(foreign.join("gap.npy"), "mine").expect("written");
    let into = |out: &Path, flags: &[&str]| solve(&[flags, &["--out", out.to_str().expect("UTF-8")]].concat());
    for method in ["fast", "persson"] {
        let refused = into(&foreign, &["--pressure", "0.01", "--method", method]);
        assert!(
            refused.status.code() == Some(2) && stderr(&refused).contains("no solve wrote"),
            "{}",
            stderr(&refused)
        );
    }
    assert_eq!(std::fs::read(foreign.join("gap.npy")).expect("there"), b"mine");
    assert!(!into(&own, &["--pressure", "0.01", "--max-iterations", "2"]).status.success());
    assert!(own.join("partial-solve.json").exists());
    assert!(into(&own, &["--pressure", "0.01,0.02"]).status.success(), "an unfinished solve leaves nothing to lose");
    assert!(own.join("load-2-gap.npy").exists() && !own.join("partial-solve.json").exists());
    // The initial gap is a file of the output folder.
    let start = own.join("load-1-gap.npy");
    let again = into(&own, &["--pressure", "0.01", "--overwrite", "--initial-gap", start.to_str().expect("UTF-8")]);
    assert!(again.status.success(), "{}", stderr(&again));
    assert!(own.join("gap.npy").exists() && start.exists() && !own.join("load-2-gap.npy").exists());
    let needle = solve(&["--pressure", "0.01", "--length", "0.01"]);
    assert!(!stderr(&needle).contains("wrong unit"), "lengths of the cell have no unit: {}", stderr(&needle));
    let map = scratch.path().join("map.txt");
    std::fs::write(&map, "0 9 1 8 3\n7 1 9 2 6\n1 8 0 9 1\n9 2 7 1 5\n2 6 1 8 0\n").expect("written");
    let flags = ["solve", map.to_str().expect("UTF-8"), "--pressure", "0.01"];
    let needle = asperity().args(dimensionless(&flags)).output().expect("started");
    assert!(stderr(&needle).contains("wrong unit of length"), "{}", stderr(&needle));
}

/// A plan counts coarser grids and the states stored during separation. A solve that is said to fit does fit.
#[test]
fn plans_count_memory_outside_the_solver() {
    let planned = |more: &[&str]| number(&json_line(&solve(&[&STICKY[..], &["--dry-run"], more].concat())), "bytes");
    let (one, two) = (planned(&["--pressure", "0.01"]), planned(&["--pressure", "0.01,0.02"]));
    let apart = planned(&["--pressure", "0.01,0.02", "--pull-off"]);
    assert!(two > one && apart >= two + 4.0 * 8.0 * 64.0 * 64.0, "{one} {two} {apart}");
    let many = |n: &str| {
        let flags = ["--pressure", "0.01,0.02", "--pull-off", "--dry-run"];
        asperity().args(["solve", "--challenge", n]).args(STICKY).args(flags).output().expect("started")
    };
    let huge = many("524288");
    let said = stderr(&huge);
    assert_eq!(huge.status.code(), Some(5), "{said}");
    let advice = said.rsplit_once("; ").expect("an advice").1;
    let fits: f64 = advice.split(' ').next().and_then(|n| n.parse().ok()).expect("points per side");
    // A little less, because the free memory varies.
    let smaller = many(&format!("{:.0}", 0.95 * fits));
    assert!(smaller.status.success(), "{fits}: {}", stderr(&smaller));
    assert!(String::from_utf8_lossy(&smaller.stdout).contains(" of memory; "), "{smaller:?}");
}

#[test]
fn what_a_path_cannot_do_is_refused() {
    let refused = |flags: &[&str], piece: &str| {
        let output = solve(flags);
        assert_eq!(output.status.code(), Some(2), "{flags:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(piece), "{flags:?}: {}", stderr(&output));
    };
    refused(&["--pressure", "0.01", "--pull-off"], "--pull-off");
    refused(&["--mean-gap", "0.01", "--method", "bvm"], "--method = \"bvm\"; accepted: \"fast\" or \"auto\"");
    refused(&["--mean-gap", "-0.01"], "--mean-gap = -0.01");
    refused(&["--mean-gap", "0.01,0"], "--mean-gap = 0; accepted: a positive number; full contact from --p-star ");
    refused(&["--pressure", "0.01", "--mean-gap", "0.01"], "--mean-gap");
    refused(&["--pressure", "0.01", "--initial-gap", "nowhere.npy"], "nowhere.npy");
    refused(&["--pressure", "0.01,-0.01"], "--pressure = -0.01");
}

/// A flat surface has no p*. Its folder is read again all the same.
#[test]
fn the_folder_of_a_flat_surface_is_read_again() {
    let scratch = tempfile::tempdir().expect("scratch");
    let map = scratch.path().join("flat.npy");
    npy::write(&map, 8, 8, [0.0; 64]).expect("written");
    let out = scratch.path().join("out");
    let run = || {
        let mut command = asperity();
        command.args([
            "solve",
            "--touching",
            "high-points",
            "--length",
            "1",
            "--modulus",
            "1",
            "--pressure",
            "0.1,0.2",
        ]);
        let output = command.arg("--json").arg("--heights").arg(&map).arg("--out").arg(&out).output().expect("started");
        assert!(output.status.success(), "{}", stderr(&output));
        let lines: Vec<Value> =
            output.stdout.split(|b| *b == b'\n').filter_map(|l| serde_json::from_slice(l).ok()).collect();
        lines.iter().map(|line| (line["p_star"].clone(), number(line, "contact_area"))).collect::<Vec<_>>()
    };
    let first = run();
    assert_eq!(first, [(Value::Null, 1.0), (Value::Null, 1.0)]);
    assert_eq!(run(), first);
}

/// First contact is a state: one node touches under no pressure, however the load is given.
#[test]
fn first_contact_is_the_contact_of_one_node() {
    let node = 1.0 / (64.0 * 64.0);
    for flags in [
        &["--displacement", "0"][..],
        &["--pressure", "0"],
        &["--p-star", "0"],
        &["--displacement", "0,1e-4"],
        &["--pressure", "0,0.01"],
        &["--displacement", "0", "--precision", "f32"],
        &["--displacement", "0", "--wall", "penalty", "--penalty-length", "0.01"],
        &["--pressure", "0", "--thickness", "0.1"],
        &["--pressure", "0", "--hardness", "0.1"],
        &["--pressure", "0", "--non-periodic"],
    ] {
        let states = lines(flags);
        let first = &states[0];
        assert_eq!(number(first, "contact_nodes"), node, "{flags:?}: {first}");
        assert_eq!((number(first, "pressure"), number(first, "displacement")), (0.0, 0.0), "{flags:?}");
        assert_eq!(first["stop"], "converged", "{flags:?}");
        assert!(number(first, "mean_gap") > 0.0);
        assert!(states[1..].iter().all(|s| number(s, "pressure") > 0.0), "{flags:?}");
    }
    // Apart, no node touches.
    let gap = number(&lines(&["--pressure", "0"])[0], "mean_gap");
    let apart = &lines(&["--mean-gap", &(1.001 * gap).to_string()])[0];
    assert_eq!((number(apart, "contact_nodes"), number(apart, "pressure")), (0.0, 0.0));
    for (flags, word) in [(["--method", "bvm"], "only the method"), (["--method", "persson"], "only the method")] {
        let refused = solve(&[&["--pressure", "0"][..], &flags].concat());
        assert!(!refused.status.success() && stderr(&refused).contains(word), "{}", stderr(&refused));
    }
}

/// A load far beyond full contact is probably one in another unit than the modulus: one warning, for any number of such loads.
#[test]
fn loads_far_beyond_full_contact_warn_once() {
    let warned = |flags: &[&str]| stderr(&solve(flags)).matches("check the units of load and modulus").count();
    assert_eq!(warned(&["--pressure", "0.01,2"]), 0);
    assert_eq!(warned(&["--pressure", "1e3"]), 1);
    assert_eq!(warned(&["--pressure", "1e3,1e4,1e5"]), 1);
    assert_eq!(warned(&["--p-star", "1e3", "--thickness", "0.1"]), 1);
    assert_eq!(warned(&["--pressure", "1e3", "--method", "persson"]), 1);
    let scratch = tempfile::tempdir().expect("scratch");
    let file = scratch.path().join("far.toml");
    std::fs::write(
        &file,
        "name = \"far\"\nsurface = { grid = 32, cut_off_mode = 8 }\nload = { p_star = [0.1, 500] }\n",
    )
    .expect("written");
    let run = asperity()
        .arg("run")
        .arg(&file)
        .arg("--out")
        .arg(scratch.path().join("far"))
        .arg("--json")
        .output()
        .expect("started");
    assert!(run.status.success(), "{}", stderr(&run));
    let results = json_line(&run)["results"]["warnings"].to_string();
    assert_eq!(results.matches("check the units").count(), 1, "{results}");
    assert_eq!(stderr(&run).matches("check the units").count(), 1, "{}", stderr(&run));
}

/// With a range that the grid does not resolve, hardness and adhesion warn once of what depends on it; the body flows at a net stress of the
/// hardness on every grid.
#[test]
fn hardness_with_adhesion_flows_at_the_hardness() {
    /// Of the hardness, at residuals of 1e-8 of the pressure.
    const STRESS: f64 = 1e-5;
    let coarse = ["--work-of-adhesion", "9e-4", "--range", "1e-3", "--hardness", "0.2", "--pressure", "0.03,0.05"];
    for (flags, warnings) in [(coarse.to_vec(), 1), ([&coarse[..2], &["--range", "1e-2"], &coarse[4..]].concat(), 0)] {
        let scratch = tempfile::tempdir().expect("scratch");
        let out = scratch.path().join("out");
        let output = solve(&[&flags[..], &["--out", out.to_str().expect("UTF-8")]].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        assert_eq!(stderr(&output).matches("hardness with adhesion").count(), warnings, "{}", stderr(&output));
        let stress = asperity::surface::files::npy::read(&out.join("load-2-stress.npy")).expect("a map").values;
        let most = stress.iter().copied().fold(0.0, f64::max);
        assert!((most / 0.2 - 1.0).abs() < STRESS, "{flags:?}: {most}");
    }
}

/// Both commands construct the same case: one map and one load path give the same results and warnings.
#[test]
fn solve_and_run_give_the_same_numbers_and_warnings() {
    /// Rounding of lengths in nm and in the unit of the map.
    const ROUNDING: f64 = 1e-9;
    const SCENE: &str = "name = \"same\"\n[laboratory]\nlength = \"1 um\"\nmodulus = \"1 MPa\"\n[surface]\nheights = \"map.txt\"\nunit = \"um\"\n\
                         touching = \"high-points\"\n[load]\np_star = [0.02, 0.05]\n[adhesion]\nwork_of_adhesion = \"4 mJ/m2\"\n\
                         range = \"1 nm\"\n[continuum.layer]\nthickness = \"0.5 um\"\n";
    let scratch = tempfile::tempdir().expect("scratch");
    let path = |name: &str| scratch.path().join(name).to_str().expect("UTF-8").to_string();
    // A steep map of few points with an unresolved range: three warnings.
    let height =
        |i: usize, j: usize| (0.55 * i as f64).cos() + (0.5 * j as f64).sin() + 0.2 * (1.7 * (i + j) as f64).cos();
    let row = |j: usize| (0..12).map(|i| height(i, j).to_string()).collect::<Vec<_>>().join(" ");
    std::fs::write(path("map.txt"), (0..12).map(row).collect::<Vec<_>>().join("\n")).expect("written");
    std::fs::write(path("same.toml"), SCENE).expect("written");
    let run = asperity().args(["run", &path("same.toml"), "--json", "--out", &path("run")]).output().expect("started");
    assert!(run.status.success(), "{}", stderr(&run));
    let results = json_line(&run);
    let states = results["results"]["continuum"]["states"].as_array().expect("states");
    let [length, modulus] = ["length_m", "modulus_pa"].map(|key| number(&results["results"]["scales"], key));
    let pressures: Vec<String> = states.iter().map(|s| (number(s, "pressure") / modulus).to_string()).collect();
    let flags = ["--touching", "high-points", "--work-of-adhesion", "4e-3", "--range", "1e-3", "--thickness", "0.5"];
    let solved = asperity()
        .args([
            "solve",
            &path("map.txt"),
            "--json",
            "--length",
            "1",
            "--modulus",
            "1",
            "--pressure",
            &pressures.join(","),
        ])
        .args(flags)
        .output()
        .expect("started");
    assert!(solved.status.success(), "{}", stderr(&solved));
    let lines = String::from_utf8(solved.stdout.clone()).expect("UTF-8");
    let lines: Vec<Value> = lines.lines().map(|l| serde_json::from_str(l).expect("JSON")).collect();
    assert_eq!(lines.len(), states.len());
    for (line, state) in lines.iter().zip(states) {
        assert_eq!(line["contact_nodes"], state["contact_nodes"]);
        assert_eq!(line["stop"], state["stop"]);
        let keys = [("pressure", modulus), ("mean_gap", length), ("energy", modulus * length), ("contact_area", 1.0)];
        for (key, unit) in keys {
            let (found, expected) = (number(line, key), number(state, key) / unit);
            assert!((found / expected - 1.0).abs() < ROUNDING, "{key}: {found} {expected}");
        }
    }
    let warnings = |output: &std::process::Output| -> Vec<String> {
        stderr(output).lines().filter(|l| l.trim_start().starts_with("warning")).map(str::to_string).collect()
    };
    assert_eq!(warnings(&solved), warnings(&run));
    assert_eq!(warnings(&solved).len(), 3, "{}", stderr(&solved));
    // The error of `solve` names the flag, that of `run` names the key.
    let wall = ["--wall", "penalty"];
    let map = path("map.txt");
    let flags = [&["solve", &map, "--pressure", "0.1"], &wall[..]].concat();
    let refused = asperity().args(dimensionless(&flags)).output().expect("started");
    assert!(stderr(&refused).contains("command line: --penalty-length = not given"), "{}", stderr(&refused));
    std::fs::write(path("wall.toml"), format!("{SCENE}[continuum]\nwall = \"penalty\"\n")).expect("written");
    let refused = asperity().args(["run", &path("wall.toml"), "--dry-run"]).output().expect("started");
    assert!(stderr(&refused).contains("wall.toml: continuum.penalty_length = not given"), "{}", stderr(&refused));
}

/// Ctrl-C leaves a checkpoint. The same command continues from it, prints all loads, and ends bit-identically.
#[test]
#[cfg(unix)]
fn an_interrupted_path_goes_on() {
    /// Loads of the path, so many that a signal sent after the second one arrives before the last.
    const LOADS: usize = 40;
    let scratch = tempfile::tempdir().expect("scratch");
    let loads: Vec<String> = (1..=LOADS).map(|i| (0.002 * i as f64).to_string()).collect();
    let command = |out: &Path| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_asperity"));
        command.args(["solve", "--challenge", "128", "--cut-off", "0.0625", "--json", "--tol", "1e-6"]);
        command.args(STICKY).arg("--pressure").arg(loads.join(",")).arg("--out").arg(out);
        command
    };
    let (whole, stopped) = (scratch.path().join("whole"), scratch.path().join("stopped"));
    assert!(command(&whole).output().expect("started").status.success());
    let child = command(&stopped).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started");
    let clock = Instant::now();
    while !stopped.join("load-02-solve.json").exists() {
        assert!(clock.elapsed() < Duration::from_secs(120), "the second load takes for ever");
        std::thread::sleep(Duration::from_millis(5));
    }
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill");
    let ended = child.wait_with_output().expect("ended");
    assert!(sent.success() && ended.status.code() == Some(130));
    // The interrupted load is not printed as a result.
    let answer = String::from_utf8_lossy(&ended.stdout).into_owned();
    assert!(answer.lines().count() >= 2 && answer.lines().all(|l| l.contains("\"stop\":\"converged\"")), "{answer}");
    assert!(stopped.join("checkpoint.json").exists() && !stopped.join(format!("load-{LOADS}-gap.npy")).exists());
    let again = command(&stopped).output().expect("started");
    assert!(again.status.success(), "{}", stderr(&again));
    let from = format!("resuming at load {} of {LOADS}", answer.lines().count() + 1);
    assert!(stderr(&again).contains(&from), "{from}: {}", stderr(&again));
    assert_eq!(String::from_utf8_lossy(&again.stdout).lines().count(), LOADS, "every load is reported");
    for i in [2, 3, LOADS] {
        for name in ["gap.npy", "stress.npy"] {
            let read = |folder: &Path| std::fs::read(folder.join(format!("load-{i:02}-{name}"))).expect("written");
            assert!(read(&whole) == read(&stopped), "load {i}: {name}");
        }
    }
    assert!(!stopped.join("checkpoint.json").exists());
}

/// The cut-off wavelength is given, and named in messages, as a fraction of the cell, whatever the length of the cell.
#[test]
fn cut_off_is_a_wavelength() {
    let plan = |flags: &[&str]| {
        let command = ["solve", "--challenge", "16", "--pressure", "1", "--dry-run"];
        asperity().args(command).args(flags).output().expect("started")
    };
    let beyond = plan(&["--length", "100", "--cut-off", "50"]);
    assert_eq!(beyond.status.code(), Some(2));
    assert!(stderr(&beyond).contains("--cut-off = 50 "), "{}", stderr(&beyond));
    // A fifth of the cell, the roll-off.
    let equal = plan(&["--length", "3", "--cut-off", "0.6"]);
    assert!(equal.status.success(), "{}", stderr(&equal));
}

/// `--hardness`: no stress above it, the plastic displacement in a file, its numbers in the line and in curve.csv. What cannot
/// carry the load or models no flow is refused with the remedy.
#[test]
fn a_hardness_bounds_the_contact_stress() {
    /// Residual of the solver, over the hardness.
    const ROUNDING: f64 = 1e-6;
    let scratch = tempfile::tempdir().expect("scratch");
    let out = scratch.path().join("out");
    let solve = |more: &[&str]| {
        let base = ["solve", "--challenge", "64", "--length", "1m", "--cut-off", "0.06m", "--modulus", "2GPa"];
        asperity().args(base).args(more).output().expect("started")
    };
    let flags =
        ["--hardness", "200MPa", "--pressure", "20MPa,60MPa,20MPa", "--json", "--out", out.to_str().expect("UTF-8")];
    let found = solve(&flags);
    assert!(found.status.success(), "{}", stderr(&found));
    let lines: Vec<Value> =
        String::from_utf8_lossy(&found.stdout).lines().map(|l| serde_json::from_str(l).expect("JSON")).collect();
    let of = |k: usize, key: &str| number(&lines[k], key);
    assert!(of(1, "flowing_fraction") > 0.01 && of(2, "flowing_fraction") == 0.0);
    assert_eq!(of(2, "mean_plastic_displacement"), of(1, "mean_plastic_displacement"));
    assert!(of(2, "contact_area") > of(0, "contact_area"));
    let field = |name: &str| asperity::surface::files::npy::read(&out.join(name)).expect("a field").values;
    let (stress, plastic) = (field("load-2-stress.npy"), field("load-2-plastic.npy"));
    let most = stress.iter().copied().fold(0.0, f64::max);
    assert!((most / of(1, "hardness") - 1.0).abs() < ROUNDING, "{most}");
    let mean = plastic.iter().sum::<f64>() / plastic.len() as f64;
    assert!((mean / of(1, "mean_plastic_displacement") - 1.0).abs() < 1e-12);
    let curve = std::fs::read_to_string(out.join("curve.csv")).expect("a table");
    assert!(
        curve.lines().next().expect("a header").contains(",displaced_fraction,mean_plastic_displacement"),
        "{curve}"
    );
    for (more, words) in [
        (&["--hardness", "200MPa", "--pressure", "250MPa"][..], "at which every node flows"),
        (&["--hardness", "200MPa", "--pressure", "20MPa", "--method", "winkler"], "models plastic flow"),
        (&["--hardness", "-1MPa", "--pressure", "20MPa"], "--hardness = -"),
        (&["--hardness", "200MPa", "--contact", "0.1"], "pressure, force or p*"),
        (&["--hardness", "200MPa", "--mean-gap", "0.01m"], "pressure, force or p*"),
        (&["--hardness", "2um", "--pressure", "20MPa"], "a stress with its unit"),
    ] {
        let refused = solve(more);
        assert_eq!(refused.status.code(), Some(2), "{more:?}");
        assert!(stderr(&refused).contains(words), "{more:?}: {}", stderr(&refused));
    }
}

/// A GPU that the program cannot use, and a solver or a law that has no kernels for one.
#[test]
fn what_a_gpu_cannot_do_is_refused() {
    let refused = |flags: &[&str]| {
        let output = solve(&[&["--p-star", "0.01", "--device", "cuda"], flags].concat());
        (output.status.code(), stderr(&output))
    };
    let tradeoff =
        asperity().args(["tradeoff", "configs/continuum.toml", "--device", "cuda"]).output().expect("started");
    assert_eq!(tradeoff.status.code(), Some(2));
    assert!(stderr(&tradeoff).contains("--device = cuda; accepted: cpu: costs of methods"), "{}", stderr(&tradeoff));
    let (code, message) = refused(&[]);
    if cfg!(feature = "cuda") {
        let hardness = refused(&["--hardness", "0.3"]);
        assert!(hardness.0 == Some(2) && hardness.1.contains("hardness = 0.3; accepted: none with"), "{hardness:?}");
        let gfmd = refused(&["--method", "gfmd"]);
        assert!(gfmd.0 == Some(2) && gfmd.1.contains("method gfmd: --device = cuda; accepted: cpu"), "{gfmd:?}");
        assert!(code == Some(0) || code == Some(5) && message.contains("CUDA was not found"), "{message}");
    } else {
        assert_eq!(code, Some(2));
        assert!(message.contains("--device = cuda; accepted: cpu: this program was built without"), "{message}");
    }
}
