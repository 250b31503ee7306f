//! The documented interface of the crate: its examples run, and its results are those of `asperity solve`.

use crate::program::{asperity, stderr};
use asperity::{
    Adhesion, Body, FileOptions, LoadKind, Loads, Monitor, Problem, Progress, StateMaps, Surface, Touching, method,
    read_surface,
};
use ndarray::Array2;
use serde_json::Value;
use std::ops::ControlFlow;
use std::path::Path;

/// Includes a program of `examples/`, whose `main` verifies its results.
macro_rules! example {
    ($name:ident, $file:literal) => {
        mod $name {
            include!($file);

            #[test]
            fn runs_and_verifies_its_results() -> asperity::Result<()> {
                main()
            }
        }
    };
}

example!(solve_a_map, "../../examples/solve_a_map.rs");
example!(adhesive_load_path, "../../examples/adhesive_load_path.rs");
example!(all_methods, "../../examples/all_methods.rs");
example!(own_observable, "../../examples/own_observable.rs");

#[allow(dead_code, reason = "the test calls what `main` calls")]
mod read_a_run {
    include!("../../examples/read_a_run.rs");

    #[test]
    fn reads_the_run_of_a_scene() -> asperity::Result<()> {
        let folder = tempfile::tempdir().expect("scratch");
        let (scene, out) = (folder.path().join("scene.toml"), folder.path().join("run"));
        let text = "name = \"small\"\nsurface = { grid = 32, cut_off_mode = 8 }\nload = { p_star = [0.02, 0.05] }\n";
        std::fs::write(&scene, text).expect("written");
        let run = crate::program::asperity().arg("run").arg(&scene).arg("--out").arg(&out).output().expect("started");
        assert!(run.status.success(), "{}", crate::program::stderr(&run));
        print(&out)
    }
}

const MAP: &str = "configs/own-surface.txt";

/// JSON lines of `asperity solve` for the shipped map, with its fields in the folder `out`.
fn solve(arguments: &[&str], out: &Path) -> Vec<Value> {
    let mut command = asperity();
    command
        .args(["solve", "--json", "--touching", "high-points", "--length", "20000", "--modulus", "25"])
        .args(arguments);
    let output = command.arg("--out").arg(out).arg(MAP).output().expect("started");
    assert!(output.status.success(), "{}", stderr(&output));
    let lines = String::from_utf8(output.stdout).expect("UTF-8");
    lines.lines().map(|l| serde_json::from_str(l).expect("JSON")).collect()
}

/// Pressures, and then the pull-off.
fn pulled(pressures: &[f64]) -> Loads {
    Loads { pull_off: true, ..Loads::new(LoadKind::Pressure, pressures) }
}

fn problem() -> Problem {
    let options = FileOptions { length: Some(20000.0), touching: Some(Touching::HighPoints), ..FileOptions::default() };
    Problem::new(read_surface(MAP, &options).expect("a map"), 25.0)
}

fn stored(file: &Path) -> Array2<f64> {
    let field = asperity::surface::files::npy::read(file).expect("a field");
    Array2::from_shape_vec((field.ny, field.nx), field.values).expect("its shape")
}

/// Lengths in nm and pressures in MPa, as in the command line below.
#[test]
fn states_have_the_bits_of_the_command_line() {
    let out = tempfile::tempdir().expect("scratch");
    let lines = solve(&["--pressure", "0.5"], out.path());
    let state = problem().solve(0.5).expect("solved");
    let number = |key: &str| lines[0][key].as_f64();
    assert_eq!(Some(state.contact_area), number("contact_area"));
    assert_eq!(state.contact_area_error, number("contact_area_error"));
    assert_eq!(state.contact_nodes, number("contact_nodes"));
    assert_eq!(state.perimeter, number("perimeter"));
    assert_eq!(state.mean_gap, number("mean_gap"));
    assert_eq!(state.mean_gap_error, number("mean_gap_error"));
    assert_eq!((state.stiffness, state.stiffness_error), (number("stiffness"), number("stiffness_error")));
    assert!(
        state.contact_area_error.is_some()
            && state.stiffness_error.is_some()
            && state.contact_nodes.is_some_and(|nodes| state.contact_area < nodes)
    );
    assert_eq!(state.energy, number("energy"));
    assert_eq!(Some(state.pressure), number("pressure"));
    assert!(state.gap().expect("a map") == stored(&out.path().join("gap.npy")));
    assert!(state.stress().expect("a map") == stored(&out.path().join("stress.npy")));
}

/// One state by `solve`, its `curve.csv`, `run`, its `curve.csv` and `results.json`, and the library: the same number under the same name.
#[test]
fn a_state_has_the_same_numbers_on_every_face() {
    /// Conversion of units, and the solver's tolerance, where the unit of the heights differs.
    const CONVERTED: f64 = 1e-6;
    let folder = tempfile::tempdir().expect("scratch");
    let line = solve(&["--pressure", "0.5"], &folder.path().join("solve")).remove(0);
    let state = problem().solve(0.5).expect("solved");
    let map = std::fs::canonicalize(MAP).expect("a path");
    let scene = format!(
        "name = \"faces\"\n[laboratory]\nlength = \"20 um\"\nmodulus = \"25 MPa\"\n[surface]\nheights = {map:?}\n\
         unit = \"nm\"\ntouching = \"high-points\"\n[load]\npressure = [\"0.5 MPa\"]\n"
    );
    std::fs::write(folder.path().join("faces.toml"), scene).expect("written");
    let out = folder.path().join("run");
    let run =
        asperity().arg("run").arg(folder.path().join("faces.toml")).arg("--out").arg(&out).output().expect("started");
    assert!(run.status.success(), "{}", stderr(&run));
    let results: Value =
        serde_json::from_slice(&std::fs::read(out.join("results.json")).expect("there")).expect("JSON");
    let finished = asperity::FinishedRun::read(&out).expect("a run").states.remove(0);
    let column = |folder: &Path, name: &str| -> f64 {
        let text = std::fs::read_to_string(folder.join("curve.csv")).expect("a table");
        let mut lines = text.lines().filter(|l| !l.starts_with('#'));
        let at = lines.next().expect("a head").split(',').position(|h| h.trim() == name);
        let at = at.unwrap_or_else(|| panic!("no {name} in {text}"));
        lines.next().expect("a load").split(',').nth(at).expect("a value").trim().parse().expect("a number")
    };
    let of = |value: Option<f64>| value.expect("known");
    for (name, library, read) in [
        ("contact_area", state.contact_area, finished.contact_area),
        ("contact_area_error", of(state.contact_area_error), of(finished.contact_area_error)),
        ("contact_nodes", of(state.contact_nodes), of(finished.contact_nodes)),
    ] {
        let stored = &results["continuum"]["states"][0][name];
        let [solved, stored] = [&line[name], stored].map(|v| v.as_f64().expect("a number"));
        assert_eq!((solved, read), (library, stored), "{name}");
        for found in [stored, column(&folder.path().join("solve"), name), column(&out, name)] {
            assert!((found / library - 1.0).abs() < CONVERTED, "{name}: {found} {library}");
        }
    }
}

#[test]
fn adhesive_load_paths_have_the_bits_of_the_command_line() {
    let out = tempfile::tempdir().expect("scratch");
    let flags = ["--pressure", "0.5,1,0.5", "--work-of-adhesion", "50", "--range", "40", "--pull-off"];
    let lines = solve(&flags, out.path());
    let adhesion = Adhesion { work_of_adhesion: 50.0, range: 40.0, ..Adhesion::default() };
    let problem = Problem { adhesion: Some(adhesion), ..problem() };
    let path = problem.load_path(&pulled(&[0.5, 1.0, 0.5])).expect("solved");
    for (state, line) in path.states.iter().zip(&lines) {
        assert_eq!(Some(state.contact_area), line["contact_area"].as_f64());
        assert_eq!(state.mean_gap, line["mean_gap"].as_f64());
    }
    let pull_off = path.pull_off.expect("it was requested");
    assert_eq!(Some(pull_off.pressure), lines[3]["pull_off_pressure"].as_f64());
    assert_eq!(pull_off.force, lines[3]["pull_off_force"].as_f64());
    assert_eq!(pull_off.force, Some(pull_off.pressure * problem.surface.mapped_area()));
}

/// Loads of other kinds and a map that does not repeat.
#[test]
fn contact_areas_have_the_bits_of_the_command_line() {
    let out = tempfile::tempdir().expect("scratch");
    let lines = solve(&["--contact", "0.05", "--non-periodic"], out.path());
    let problem = Problem { body: Body::NonPeriodic, ..problem() };
    let path = problem.load_path(&Loads::new(LoadKind::Contact, [0.05])).expect("solved");
    assert_eq!(Some(path.states[0].pressure), lines[0]["pressure"].as_f64());
    assert!(path.states[0].gap().expect("a map") == stored(&out.path().join("gap.npy")));
}

/// p* of a contact area belongs to the pressure that was found; an area that is given again has the same pressure; heights in another unit
/// change nothing.
#[test]
fn contact_areas_do_not_depend_on_the_size_of_the_heights() {
    let areas = Loads::new(LoadKind::Contact, [0.05, 0.1, 0.05]);
    // A power of two, which costs no digits.
    let path_of = |size: f64| {
        let height = |x: usize, y: usize| size * ((7 * x * x + 5 * y * x + 3 * y) % 31) as f64 / 31.0;
        let map = Array2::from_shape_fn((32, 32), |(y, x)| height(x, y));
        let problem =
            Problem::new(Surface::from_array(map.view(), 100.0, Touching::HighPoints).expect("a surface"), 25.0);
        (problem.load_path(&areas).expect("solved").states, 25.0 * problem.gradient())
    };
    let (states, unit) = path_of(1.0);
    for state in &states {
        assert!((state.p_star * unit / state.pressure - 1.0).abs() < 1e-14, "{} {}", state.p_star, state.pressure);
    }
    assert_eq!(states[0].pressure, states[2].pressure);
    let size = 2f64.powi(-60);
    let (small, _) = path_of(size);
    for (small, state) in small.iter().zip(&states) {
        // The logarithm of the first guess is rounded.
        assert!((small.p_star / state.p_star - 1.0).abs() < 1e-12, "{} {}", small.p_star, state.p_star);
        assert!((small.pressure / (size * state.pressure) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn methods_that_estimate_have_the_bits_of_the_command_line() {
    let out = tempfile::tempdir().expect("scratch");
    for id in ["winkler", "persson"] {
        let lines = solve(&["--pressure", "0.5", "--method", id], &out.path().join(id));
        let found = Problem { method: method(id).expect("known"), ..problem() }.estimate(0.5).expect("estimated");
        let line = &lines[0];
        assert_eq!(Some(found.contact_area), line["contact_area"].as_f64(), "{id}");
        assert_eq!(found.mean_gap, line["mean_gap"].as_f64(), "{id}");
    }
}

#[test]
fn errors_name_the_value_and_the_remedy() {
    let refused = |problem: &Problem| problem.solve(0.5).expect_err("refused").to_string();
    let text = refused(&Problem { modulus: -1.0, ..problem() });
    assert!(text.contains("modulus") && text.contains("-1") && text.contains("a positive number"), "{text}");
    let text = refused(&Problem { method: method("persson").expect("known"), ..problem() });
    assert!(text.contains("persson") && text.contains("Problem::estimate"), "{text}");
    let text = method("unknown").err().expect("refused").to_string();
    assert!(text.contains("unknown") && text.contains("fast"), "{text}");
    let pulled = problem().load_path(&pulled(&[0.5])).expect_err("refused").to_string();
    assert!(pulled.contains("adhesion"), "{pulled}");
}

/// First contact by pressure and by displacement, and the warning of a load in a wrong unit.
#[test]
fn first_contact_and_far_loads_are_those_of_the_command_line() {
    let states = [LoadKind::Pressure, LoadKind::Displacement, LoadKind::PStar]
        .map(|kind| Loads::new(kind, [0.0]))
        .map(|loads| problem().load_path(&loads).expect("solved").states.remove(0));
    for state in &states {
        assert_eq!((state.pressure, state.contact().expect("a map").iter().filter(|c| **c).count()), (0.0, 1));
        assert_eq!(state.mean_gap, states[0].mean_gap);
    }
    let far = |p: f64| problem().warnings(&Loads::new(LoadKind::Pressure, [0.1, p, p])).expect("warnings");
    let count = |list: Vec<String>| list.iter().filter(|w| w.contains("check the units of load and modulus")).count();
    assert_eq!((count(far(1e6)), count(far(1.0))), (1, 0));
    // Beyond first contact nothing touches, unless the surfaces attract each other.
    let touch = states[0].mean_gap.expect("a gap");
    let apart = |problem: &Problem, gaps: &[f64]| {
        let said = Warned::default();
        problem.visit_load_path(&Loads::new(LoadKind::MeanGap, gaps), &said, |_| ()).expect("solved");
        let list = said.0.into_inner().expect("no panic");
        list.into_iter().filter(|w| w.contains("without adhesion nothing touches")).collect::<Vec<_>>()
    };
    assert!(apart(&problem(), &[0.5 * touch, 0.9 * touch]).is_empty());
    let both = ["load 2, 3: the mean gap is beyond first contact, where without adhesion nothing touches"];
    assert_eq!(apart(&problem(), &[0.5 * touch, 2.0 * touch, 3.0 * touch]), both);
    let adhesion = Adhesion { work_of_adhesion: 50.0, range: 40.0, ..Adhesion::default() };
    assert!(apart(&Problem { adhesion: Some(adhesion), ..problem() }, &[0.5 * touch, 2.0 * touch]).is_empty());
}

/// Full contact of its own accord is explained; that of a pressure is not, nor is partial contact.
#[test]
fn adhesion_that_closes_the_gap_is_named() {
    let said = |work: f64| {
        let adhesion = Adhesion { work_of_adhesion: work, range: 40.0, ..Adhesion::default() };
        let (warned, problem) = (Warned::default(), Problem { adhesion: Some(adhesion), ..problem() });
        problem.visit_load_path(&Loads::new(LoadKind::Pressure, [1e-3, 1e-2]), &warned, |_| ()).expect("solved");
        let list = warned.0.into_inner().expect("no panic");
        list.into_iter().filter(|w| w.contains("adhesion closes the gap")).collect::<Vec<_>>()
    };
    let closed = said(1e6);
    assert!(matches!(&closed[..], [text] if text.starts_with("load 1, 2: ")), "{closed:?}");
    assert!(said(1e-3).is_empty());
    // A pressure far above that of full contact.
    let adhesion = Adhesion { work_of_adhesion: 1e-3, range: 40.0, ..Adhesion::default() };
    let (warned, problem) = (Warned::default(), Problem { adhesion: Some(adhesion), ..problem() });
    let mut area = 0.0;
    problem
        .visit_load_path(&Loads::new(LoadKind::Pressure, [500.0]), &warned, |s| area = s.contact_area)
        .expect("solved");
    assert_eq!(area, 1.0);
    assert!(!warned.0.into_inner().expect("no panic").iter().any(|w| w.contains("adhesion closes the gap")));
}

/// The warnings of a solve.
#[derive(Default)]
struct Warned(std::sync::Mutex<Vec<String>>);

impl Monitor for Warned {
    fn progress(&self, _: Progress) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    fn warnings(&self, list: &[String]) {
        self.0.lock().expect("no panic").extend_from_slice(list);
    }
}
