//! What a map is, and what is no map: parts, columns, edges, and numbers without an error.

use crate::program::{asperity, json_line, stderr};
use crate::scratch::Scratch;
use serde_json::Value;

fn call(arguments: &[&str]) -> std::process::Output {
    asperity().args(arguments).output().expect("started")
}

/// The message of a refusal.
fn refused(arguments: &[&str]) -> String {
    let output = call(arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", stderr(&output));
    stderr(&output)
}

const FLAGS: [&str; 6] = ["--length", "10um", "--unit", "um", "--touching", "high-points"];

fn wave(i: usize, n: usize) -> f64 {
    0.1 * (std::f64::consts::TAU * i as f64 / n as f64).cos()
}

#[test]
fn a_single_column_is_no_map() {
    let scratch = Scratch::new();
    let column = scratch.map("column.npy", [1, 32], |_, y| wave(y, 32));
    let map = scratch.map("map.npy", [32, 32], |x, y| wave(x, 32) + wave(y, 32));
    let solve = [&["solve", "--modulus", "5MPa", "--pressure", "10kPa"][..], &FLAGS].concat();
    let part = [&[&map[..], "--crop", "3,0,1,32"][..], &solve[1..]].concat();
    for arguments in [[&solve[..], &[&column]].concat(), [&["solve"], &part[..]].concat()] {
        let said = refused(&arguments);
        assert!(said.contains("one column of 32 points") && said.contains("--profile"), "{said}");
    }
    let profile = call(&[&solve[..], &[&column, "--profile", "--json"]].concat());
    assert!(profile.status.success(), "{}", stderr(&profile));
    assert_eq!((&json_line(&profile)["nx"], &json_line(&profile)["ny"]), (&32.into(), &1.into()));
}

/// A part of a map that repeats is not declared to repeat.
#[test]
fn a_part_of_a_periodic_map_declares_nothing() {
    let scratch = Scratch::new();
    let map = scratch.map("map.npy", [32, 32], |x, y| wave(x, 32) + wave(y, 32));
    let [whole, part] = ["whole.npy", "part.npy"].map(|name| scratch.word(name));
    let periodic = |file: &str| -> Value {
        let text = std::fs::read_to_string(format!("{file}.json")).expect("a sidecar");
        serde_json::from_str::<Value>(&text).expect("JSON")["periodic"].clone()
    };
    let mirrored = [&["surface", &map, "--edges", "mirror", "--out", &whole][..], &FLAGS].concat();
    assert!(call(&mirrored).status.success());
    assert_eq!(periodic(&whole), true);
    assert!(call(&["surface", &whole, "--crop", "0,0,20,24", "--out", &part]).status.success());
    assert_eq!(periodic(&part), Value::Null);
}

#[test]
fn edges_that_repeat_contradict_a_body_that_does_not() {
    let scratch = Scratch::new();
    let map = scratch.map("map.npy", [32, 32], |x, y| wave(x, 20) + wave(y, 17));
    for edges in ["mirror", "taper"] {
        let flags = ["solve", &map, "--modulus", "5MPa", "--pressure", "10kPa", "--non-periodic", "--edges", edges];
        let said = refused(&[&flags[..], &FLAGS].concat());
        assert!(said.contains("edges") && said.contains("repeats"), "{said}");
    }
}

/// Where the grid enlarges the range, or leaves out waves, two grids do not tell how far pull-off and leakage are from the requested ones.
#[test]
fn numbers_of_another_problem_have_no_error() {
    let problem = ["solve", "--challenge", "64", "--modulus", "1", "--pressure", "0.01", "--work-of-adhesion", "1e-3"];
    let errors_are_stated = |more: &[&str]| {
        let output = call(&[&problem[..], &["--length", "1", "--pull-off", "--leakage", "--json"], more].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        let lines = String::from_utf8(output.stdout).expect("UTF-8");
        let read = |line: &str| -> Value { serde_json::from_str(line).expect("JSON") };
        let (state, last) = (read(lines.lines().next().expect("lines")), read(lines.lines().last().expect("lines")));
        assert!(last["pull_off_pressure"].as_f64().is_some_and(|p| p < 0.0), "{last}");
        assert!(state["leakage"]["conductivity"][0].as_f64().is_some_and(|flow| flow > 0.0), "{state}");
        [last["pull_off_pressure_error"].is_number(), state["leakage"]["gap_errors"].is_array()]
    };
    assert_eq!(errors_are_stated(&["--cut-off", "0.125", "--range", "2e-2"]), [true; 2]);
    assert_eq!(errors_are_stated(&["--cut-off", "0.125", "--range", "1e-4"]), [false; 2]);
    assert_eq!(errors_are_stated(&["--cut-off", "0.0125", "--range", "2e-2"]), [false; 2]);
}

/// Refusals name the work of adhesion as it was given, also where the lengths are those that a file declares.
#[test]
fn refusals_show_the_works_of_adhesion_that_were_given() {
    let scratch = Scratch::new();
    let map = scratch.map("map.npy", [32, 32], |x, y| wave(x, 32) + wave(y, 32));
    let declared = scratch.word("declared.npy");
    assert!(call(&[&["surface", &map, "--out", &declared][..], &FLAGS].concat()).status.success());
    let adhesion = ["--method", "winkler", "--work-of-adhesion", "20mJ/m2", "--range", "5nm"];
    let said = refused(&[&["solve", &declared, "--modulus", "2GPa", "--pressure", "20MPa"][..], &adhesion].concat());
    assert!(said.contains("γ = 20 mJ/m2") && said.contains("ρ = 0.005 um"), "{said}");
}

/// A profile has no width on which a force acts, whether a flag calls it a profile or the file has one line. Of an isotropic map that is made of
/// a mirrored profile the force acts on the whole cell.
#[test]
fn forces_act_on_maps() {
    let scratch = Scratch::new();
    let profile = scratch.map("profile.npy", [64, 1], |x, _| wave(x, 50) + 0.2 * wave(7 * x, 64));
    let mirrored = scratch.word("mirrored.npy");
    let surface = [&["surface", &profile, "--profile", "--edges", "mirror", "--out", &mirrored][..], &FLAGS].concat();
    assert!(call(&surface).status.success());
    let force = ["--modulus", "1GPa", "--force", "100uN"];
    let said = refused(&[&["solve", &mirrored][..], &force].concat());
    assert!(said.contains("--force") && said.contains("no width"), "{said}");
    let isotropic = ["--profile", "--isotropic-map", "--seed", "1", "--json"];
    let output = call(&[&["solve", &mirrored][..], &force, &isotropic].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    let pressure = json_line(&output)["pressure"].as_f64().expect("a number");
    // 100 µN on 20 µm x 20 µm, GPa.
    assert!((pressure / 2.5e-4 - 1.0).abs() < 1e-6, "{pressure}");
}
