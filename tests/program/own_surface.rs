//! A person's own surface in `surface`, `solve` and `run` alike: what files declare, preparation, warnings, loads and results.

use crate::program::{asperity, json_line, stderr};
use asperity::surface::files::npy;
use serde_json::Value;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::process::Output;

const NX: usize = 60;
const NY: usize = 40;

/// Rounding of six decimals in the text files of these tests, relative to the rms gradient.
const TEXT: f64 = 1e-4;

/// Relative rounding of results in other units.
const ROUNDING: f64 = 1e-9;

/// Relative deviation of contact from its target: `CONTACT_TOLERANCE` of the program, or one node of `NX` by `NY`.
const CONTACT: f64 = 1e-3;

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} in {value}"))
}

/// Waves that repeat on the cell, µm.
fn waves(x: usize, y: usize) -> f64 {
    let (u, v) = (TAU * x as f64 / NX as f64, TAU * y as f64 / NY as f64);
    0.2 * (2.0 * u).cos() * v.sin() + 0.1 * (3.0 * v + u).sin() + 0.05 * (5.0 * u).cos()
}

/// A Gwyddion export of 30 x 20 µm in m.
fn export(path: &Path, height: impl Fn(usize, usize) -> f64) {
    let mut file = String::from("# Channel: Height\n# Width: 30.00 µm\n# Height: 20.00 µm\n# Value units: m\n");
    for y in 0..NY {
        let row: Vec<String> = (0..NX).map(|x| format!("{:.9e}", 1e-6 * height(x, y))).collect();
        file += &(row.join("\t") + "\n");
    }
    std::fs::write(path, file).expect("written");
}

fn call(arguments: &[&str]) -> Output {
    asperity().args(arguments).output().expect("started")
}

fn answer(arguments: &[&str]) -> Value {
    let output = call(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
    json_line(&output)
}

/// The error of a command that fails with exit code 2.
fn refused(arguments: &[&str], pieces: &[&str]) {
    let output = call(arguments);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
    pieces.iter().for_each(|piece| assert!(said.contains(piece), "{arguments:?}: {said} lacks {piece}"));
}

/// The surface of a file as the three commands read it, with flags and the same keys of a scene.
fn read_by_all(file: &Path, flags: &[&str], keys: &str) -> [Value; 3] {
    let folder = file.parent().expect("a folder");
    let surface = answer(&[&["surface", text(file), "--json"], flags].concat());
    let solve = ["solve", text(file), "--json", "--modulus", "2GPa", "--p-star", "0.01"];
    let solved = answer(&[&solve, flags].concat());
    let scene = folder.join("scene.toml");
    let toml = format!(
        "name = \"own\"\n[laboratory]\nmodulus = \"2000 MPa\"\n[surface]\nheights = {file:?}\n{keys}\n[load]\np_star = [0.01]\n"
    );
    std::fs::write(&scene, toml).expect("written");
    let run = answer(&["run", text(&scene), "--json", "--overwrite", "--out", text(&folder.join("run"))]);
    let states = &run["results"]["continuum"]["states"][0];
    assert_eq!(solved["contact_area"], states["contact_area"]);
    let mut of_run = run["results"]["surface"]["provenance"].clone();
    of_run["rms_gradient"] = solved["resolved_gradient"].clone();
    [surface, solved["provenance"].clone(), of_run]
}

#[test]
fn what_a_file_declares_is_the_same_in_every_command() {
    let scratch = tempfile::tempdir().expect("scratch");
    let file = scratch.path().join("export.txt");
    export(&file, waves);
    let all = read_by_all(&file, &["--touching", "high-points"], "touching = \"high-points\"");
    for read in &all {
        assert!((number(read, "length_x_m") / 30e-6 - 1.0).abs() < ROUNDING, "{read}");
        assert!((number(read, "length_y_m") / 20e-6 - 1.0).abs() < ROUNDING, "{read}");
        assert_eq!((read["unit"].as_str(), read["touching"].as_str()), (Some("m"), Some("high-points")));
        assert_eq!((number(read, "missing_points"), number(read, "filled_points")), (0.0, 0.0));
        assert_eq!((&read["channel"], &read["periodic"]), (&Value::from("Height"), &Value::from(true)));
    }
    // The same map in NetCDF: declared as not periodic by SurfaceTopography.
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/declared/open.nc");
    let copy = scratch.path().join("open.nc");
    std::fs::copy(fixture, &copy).expect("copied");
    for read in read_by_all(&copy, &["--touching", "high-points"], "touching = \"high-points\"") {
        assert!((number(&read, "length_x_m") / 30e-6 - 1.0).abs() < ROUNDING, "{read}");
        assert_eq!((read["unit"].as_str(), &read["periodic"]), (Some("um"), &Value::from(false)));
    }
    // What differs from the file is refused, and what it does not declare is required.
    for command in [&["surface"][..], &["solve", "--modulus", "1MPa", "--p-star", "0.01"]] {
        let with = |flags: &[&'static str]| [&[command[0], text(&file)], &command[1..], flags].concat();
        refused(&with(&[]), &["--touching = not given", "\"low-points\" or \"high-points\""]);
        refused(&with(&["--touching", "low-points", "--unit", "nm"]), &["--unit = nm", "accepted: m ", "declares"]);
        refused(&with(&["--touching", "low-points", "--length", "20um"]), &["--length = ", "accepted: ", "declares"]);
        let plain = scratch.path().join("plain.txt");
        std::fs::write(&plain, "1 2 3\n4 5 6\n7 8 1\n").expect("written");
        let bare = [&[command[0], text(&plain)], &command[1..], &["--touching", "low-points"]].concat();
        refused(&bare, &["--length = not given"]);
    }
}

/// A tilt multiplies the gradient of a map that is taken as periodic: it is named, `--strict` refuses it, and preparation removes it.
#[test]
fn a_tilted_map_is_named_and_levelled() {
    let scratch = tempfile::tempdir().expect("scratch");
    let (level, tilted) = (scratch.path().join("level.txt"), scratch.path().join("tilted.txt"));
    export(&level, waves);
    export(&tilted, |x, y| waves(x, y) + 0.1 * x as f64 - 0.05 * y as f64);
    let sign = ["--touching", "high-points"];
    let surface = |file: &Path, flags: &[&str]| {
        let output = call(&[&["surface", text(file), "--json"], &sign[..], flags].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        (json_line(&output), stderr(&output))
    };
    let (expected, quiet) = surface(&level, &[]);
    assert!(!quiet.contains("does not repeat"), "{quiet}");
    let (_, said) = surface(&tilted, &[]);
    assert!(
        said.contains("does not repeat along x") && said.contains("--detrend") && said.contains("--edges"),
        "{said}"
    );
    refused(&["surface", text(&tilted), "--touching", "high-points", "--strict"], &["--strict", "does not repeat"]);
    refused(
        &["solve", text(&tilted), "--modulus", "1", "--p-star", "0.01", "--touching", "high-points", "--strict"],
        &["--strict", "does not repeat"],
    );
    // The plane takes part of the longest waves, so both maps are levelled.
    let plane = ["--detrend", "plane"];
    let [a, b] = [&level, &tilted].map(|file| number(&surface(file, &plane).0, "rms_gradient"));
    assert!((a / b - 1.0).abs() < TEXT, "{a} {b}");
    assert!((a / number(&expected, "rms_gradient") - 1.0).abs() < 0.5, "{a} {expected}");
    let (prepared, _) = surface(&tilted, &plane);
    assert!(prepared["preparation"][0].as_str().is_some_and(|step| step.contains("plane")), "{prepared}");
}

/// A map on a tilted ground is levelled at three points of it, in the units of the flags and of a scene.
#[test]
fn three_points_level_the_ground() {
    let scratch = tempfile::tempdir().expect("scratch");
    let file = scratch.path().join("step.txt");
    // Steps of 0.5 µm, 30 x 20 µm.
    export(&file, |x, y| 0.02 * x as f64 - 0.01 * y as f64 + if (25..45).contains(&x) { 0.5 } else { 0.0 });
    let points = "three-points=2um,1um;28um,4000nm;5um,18um";
    let flags = ["--touching", "high-points", "--detrend", points];
    for read in read_by_all(&file, &flags, &format!("touching = \"high-points\"\ndetrend = {points:?}")) {
        let step = read["preparation"][0].as_str().expect("a step");
        // Places are in metres where the heights are and lengths have units.
        let [slopes, means] = ["slopes 0.04 in x, -0.02 in y, through 2", "means of 21, 21, 21 points"];
        assert!(step.starts_with("detrend three-points") && step.contains(slopes) && step.ends_with(means), "{step}");
    }
    let level = answer(&[&["surface", text(&file), "--json"], &flags[..]].concat());
    assert!((number(&level, "height_range_m") / 0.5e-6 - 1.0).abs() < TEXT, "{level}");
    for (points, pieces) in [
        ("three-points=2um,1um;28um,4um", &["--detrend", "X1,Y1;X2,Y2;X3,Y3"][..]),
        ("three-points=2um,1um;31um,4um;1um,2um", &["detrend", "31,4", "0 to 30 um along x, 0 to 20 um along y"]),
        ("three-points=2um,1um;4um,2um;6um,3um", &["detrend", "on one line"]),
        ("planes", &["--detrend", "mean, plane, quadratic"]),
    ] {
        refused(&["surface", text(&file), "--touching", "high-points", "--detrend", points], pieces);
    }
}

/// One per cent of the points was not measured: refused with the remedy, or filled and said.
#[test]
fn a_map_with_holes_is_filled_on_request() {
    let scratch = tempfile::tempdir().expect("scratch");
    let file = scratch.path().join("holes.txt");
    export(&file, |x, y| if (x * 7 + y * 13).is_multiple_of(100) { f64::NAN } else { waves(x, y) });
    let missing = (0..NX * NY).filter(|i| (i % NX * 7 + i / NX * 13).is_multiple_of(100)).count() as f64;
    let sign = ["--touching", "high-points"];
    refused(&[&["surface", text(&file)], &sign[..]].concat(), &["holes.txt", "--fill nearest|harmonic", "row "]);
    let solve = ["solve", text(&file), "--modulus", "1", "--p-star", "0.01"];
    refused(&[&solve[..], &sign].concat(), &["holes.txt", "--fill nearest|harmonic"]);
    let scene = scratch.path().join("scene.toml");
    let toml = "name = \"h\"\n[laboratory]\nmodulus = \"1 MPa\"\n[surface]\nheights = \"holes.txt\"\ntouching = \"high-points\"\n\
                [load]\np_star = [0.01]\n";
    std::fs::write(&scene, toml).expect("written");
    refused(&["run", text(&scene)], &["holes.txt", "surface.fill"]);
    for fill in ["nearest", "harmonic"] {
        let flags = ["--touching", "high-points", "--fill", fill];
        for read in read_by_all(&file, &flags, &format!("touching = \"high-points\"\nfill = {fill:?}")) {
            assert_eq!((number(&read, "missing_points"), number(&read, "filled_points")), (missing, missing), "{read}");
            assert!(read["preparation"][0].as_str().is_some_and(|step| step.contains(fill)), "{read}");
        }
    }
}

/// A written prepared map declares all that `solve` needs.
#[test]
fn a_prepared_map_needs_no_flags() {
    let scratch = tempfile::tempdir().expect("scratch");
    let file = scratch.path().join("export.txt");
    export(&file, |x, y| waves(x, y) + 0.1 * x as f64);
    let flags = ["--touching", "high-points", "--detrend", "plane", "--edges", "mirror"];
    let direct =
        answer(&[&["solve", text(&file), "--modulus", "2GPa", "--pressure", "1MPa", "--json"], &flags[..]].concat());
    for name in ["prepared.npy", "prepared.nc", "prepared.txt"] {
        let out = scratch.path().join(name);
        let surface = answer(&[&["surface", text(&file), "--json", "--out", text(&out)], &flags[..]].concat());
        assert_eq!((number(&surface, "nx"), number(&surface, "ny")), (2.0 * NX as f64, 2.0 * NY as f64));
        let solved = answer(&["solve", text(&out), "--modulus", "2GPa", "--pressure", "1MPa", "--json"]);
        assert_eq!(solved["provenance"]["preparation"], surface["preparation"]);
        assert_eq!(solved["provenance"]["touching"], "high-points");
        let [a, b] = [&direct, &solved].map(|s| number(s, "contact_area"));
        assert!((a / b - 1.0).abs() < CONTACT, "{a} {b}");
    }
}

/// The measured file is kept, and periodicity that nobody stated is not declared.
#[test]
fn a_written_map_replaces_and_declares_nothing_unknown() {
    let scratch = tempfile::tempdir().expect("scratch");
    let (file, out) = (scratch.path().join("export.txt"), scratch.path().join("out.npy"));
    export(&file, waves);
    let measured = std::fs::read(&file).expect("there");
    let surface = ["surface", text(&file), "--touching", "high-points", "--out"];
    refused(&[&surface[..], &[text(&file)]].concat(), &["--out = ", "the file that is read"]);
    assert_eq!(std::fs::read(&file).expect("there"), measured);
    let archive = scratch.path().join("out.h5");
    refused(
        &[&surface[..], &[text(&archive)]].concat(),
        &["written as .h5", "accepted: a name that ends in .npy, .nc, .txt"],
    );
    let read = answer(&[&surface[..], &[text(&out), "--json"]].concat());
    assert!(read["origin"].as_str().is_some_and(|o| o.contains("taken as periodic")), "{read}");
    let patch = answer(&["solve", text(&out), "--modulus", "2GPa", "--pressure", "1MPa", "--json", "--non-periodic"]);
    assert_eq!(patch["provenance"]["periodic"], false);
}

/// The same load in different units and quantities is the same state.
#[test]
fn loads_are_pressures_forces_gaps_or_contact_areas() {
    let scratch = tempfile::tempdir().expect("scratch");
    let file = scratch.path().join("export.txt");
    export(&file, waves);
    let solve = |flags: &[&str]| {
        let surface = ["solve", text(&file), "--touching", "high-points", "--json"];
        let output = call(&[&surface, flags].concat());
        assert!(output.status.success(), "{flags:?}: {}", stderr(&output));
        let lines = String::from_utf8(output.stdout).expect("UTF-8");
        lines.lines().map(|l| serde_json::from_str(l).expect("JSON")).collect::<Vec<Value>>()
    };
    let reference = &solve(&["--modulus", "2GPa", "--pressure", "10MPa"])[0];
    let same = |other: &Value| {
        assert_eq!(reference["contact_area"], other["contact_area"]);
        let [a, b] = [reference, other].map(|s| number(s, "mean_gap"));
        assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
    };
    same(&solve(&["--modulus", "2e9", "--pressure", "1e7"])[0]);
    // 10 MPa on 30 x 20 µm are 6 mN.
    same(&solve(&["--modulus", "2GPa", "--force", "6mN"])[0]);
    let p_star = number(reference, "p_star").to_string();
    same(&solve(&["--modulus", "2GPa", "--p-star", &p_star])[0]);
    let [gap, displacement] = ["mean_gap", "displacement"].map(|key| number(reference, key).to_string());
    same(&solve(&["--modulus", "2", "--mean-gap", &gap])[0]);
    same(&solve(&["--modulus", "2", "--displacement", &displacement])[0]);
    // The file has heights in m.
    same(&solve(&["--modulus", "2GPa", "--mean-gap", &format!("{gap} m")])[0]);
    let contact = number(reference, "contact_area");
    let found = number(&solve(&["--modulus", "2GPa", "--contact", &contact.to_string()])[0], "contact_area");
    assert!((found - contact).abs() <= (CONTACT * contact).max(1.0 / (NX * NY) as f64) + ROUNDING, "{found} {contact}");
    let percent = format!("{}%", 100.0 * contact);
    assert_eq!(number(&solve(&["--modulus", "2GPa", "--contact", &percent])[0], "contact_area"), found);
    // The file has heights in m: 50 mJ/m² are 5e-11 GPa m.
    let adhesive = |[modulus, pressure, work, range, thickness]: [&str; 5]| {
        let flags = ["--modulus", modulus, "--pressure", pressure, "--work-of-adhesion", work, "--range", range];
        solve(&[&flags[..], &["--thickness", thickness]].concat())
    };
    let named = adhesive(["2GPa", "10MPa", "50mJ/m2", "200nm", "5um"]);
    let plain = adhesive(["2", "0.01", "5e-11", "2e-7", "5e-6"]);
    for key in ["energy", "mean_gap", "contact_area"] {
        let [named, plain] = [&named, &plain].map(|states| number(&states[0], key));
        assert!((named / plain - 1.0).abs() < ROUNDING, "{key}: {named} {plain}");
    }
    // Loads are shown as they were given; numbers for programs have the units of modulus and heights.
    for (load, head, shown) in [("pressure", "pressure / kPa", "10000.0"), ("force", "force / mN", "6.00000")] {
        let loads = if load == "pressure" { "10000kPa,20000kPa" } else { "6mN,12mN" };
        let out = call(&[
            "solve",
            text(&file),
            "--touching",
            "high-points",
            "--modulus",
            "2GPa",
            &format!("--{load}"),
            loads,
        ]);
        let table = String::from_utf8(out.stdout).expect("UTF-8");
        assert!(table.contains(head) && table.contains(shown), "{table}");
    }
    // Ranges, and the unloading branch.
    let range = solve(&["--modulus", "2GPa", "--pressure", "log:1MPa:100MPa:3", "--work-of-adhesion", "0J/m2"]);
    let pressures: Vec<f64> = range.iter().map(|s| number(s, "pressure")).collect();
    assert!(pressures.iter().zip([1e-3, 1e-2, 1e-1]).all(|(p, gpa)| (p / gpa - 1.0).abs() < 1e-6), "{pressures:?}");
    for (flags, piece) in [
        (&["--modulus", "2", "--pressure", "1MPa"][..], "as --pressure 1 MPa has: all values have units, or none"),
        (&["--modulus", "2GPa", "--pressure", "1um"], "--pressure = 1um; accepted: a stress with its unit"),
        (&["--modulus", "2GPa", "--pressure", "1,5MPa"], "units at all values or at none"),
        (&["--modulus", "2GPa", "--force", "1MPa"], "a force with its unit"),
        (&["--modulus", "2GPa", "--pressure", "log:0MPa:1MPa:3"], "positive ends"),
        (&["--modulus", "2GPa", "--contact", "1.5"], "between 0 and 1"),
        (&["--modulus", "2GPa", "--displacement", "1mm"], "less than"),
        (&["--modulus", "2GPa", "--pressure", "1MPa", "--work-of-adhesion", "50mJ"], "\"mJ\" is no known unit"),
        (&["--modulus", "2", "--pressure", "1", "--work-of-adhesion", "50mJ/m2"], "as --work-of-adhesion 50 mJ/m2 has"),
        (&["--force", "5mN", "--length", "30um"], "--modulus = not given with a unit"),
        (&["--pressure", "5MPa"], "--modulus = not given with a unit; accepted: the contact modulus"),
        (&["--modulus", "2GPa", "--pressure", "1MPa", "--thickness", "5K"], "--thickness = 5K"),
        (&["--modulus", "2GPa", "--pressure", "1MPa", "--hardness", "5K"], "--hardness = 5K"),
    ] {
        refused(&[&["solve", text(&file), "--touching", "high-points"], flags].concat(), &[piece]);
    }
}

/// One row per load, contact pressure without noise, and nothing is overwritten.
#[test]
fn the_folder_of_a_solve_has_a_table_and_clean_pressures() {
    let scratch = tempfile::tempdir().expect("scratch");
    let (file, out) = (scratch.path().join("export.txt"), scratch.path().join("out"));
    export(&file, waves);
    let solve = |pressure: &str, more: &[&str]| {
        let surface = ["solve", text(&file), "--touching", "high-points", "--modulus", "2GPa", "--elastic-stress"];
        call(&[&surface[..], &["--out", text(&out), "--pressure", pressure], more].concat())
    };
    assert!(solve("1MPa,10MPa", &[]).status.success());
    let curve = std::fs::read_to_string(out.join("curve.csv")).expect("a curve");
    let head: Vec<&str> = curve.lines().next().expect("a header").split(',').collect();
    for column in ["load", "pressure_GPa", "p_star", "contact_area", "mean_gap_m", "displacement_m", "energy_GPa_m"] {
        assert!(head.contains(&column), "{head:?}");
    }
    assert_eq!(curve.lines().count(), 3);
    let map = |name: &str| npy::read(&out.join(name)).expect(name).values;
    let (gap, pressure, elastic) = (map("load-2-gap.npy"), map("load-2-stress.npy"), map("load-2-elastic-stress.npy"));
    let open: Vec<usize> = (0..gap.len()).filter(|&i| gap[i] > 0.0).collect();
    assert!(!open.is_empty() && open.len() < gap.len());
    assert!(open.iter().all(|&i| pressure[i] == 0.0), "the contact pressure is zero off contact");
    assert!(open.iter().any(|&i| elastic[i] != 0.0), "the stress as solved has noise there");
    let closed = (0..gap.len()).filter(|&i| gap[i] <= 0.0);
    assert!(closed.into_iter().all(|i| pressure[i] == elastic[i]));
    // Another solve is refused with the difference, and the results stay.
    let other = solve("2MPa", &[]);
    assert_eq!(other.status.code(), Some(2));
    let said = stderr(&other);
    assert!(said.contains("another solve: --pressure") && said.contains("--overwrite"), "{said}");
    assert!(out.join("load-2-gap.npy").exists());
    assert!(solve("1MPa,10MPa", &[]).status.success(), "the same solve is read back");
    assert!(solve("2MPa", &["--overwrite"]).status.success());
    assert!(out.join("gap.npy").exists() && !out.join("load-2-gap.npy").exists());
}

/// Every command for scenes refuses the folder of another one, and keeps its results.
#[test]
fn results_of_another_scene_are_kept() {
    let scratch = tempfile::tempdir().expect("scratch");
    let path = |name: &str| -> PathBuf { scratch.path().join(name) };
    let scene = |p: &str| format!("name = \"s\"\n[surface]\ngrid = 64\ncut_off_mode = 8\n[load]\np_star = [{p}]\n");
    let (first, second) = (path("first.toml"), path("second.toml"));
    std::fs::write(&first, scene("0.01")).expect("written");
    std::fs::write(&second, scene("0.02")).expect("written");
    let tradeoff = ["--methods", "fast", "--grids", "64,32", "--repeats", "1"];
    let commands: [(&str, &[&str], &str); 2] = [("run", &[], "results.json"), ("tradeoff", &tradeoff, "tradeoff.json")];
    for (own, flags, file) in commands {
        let out = path(own);
        let done = call(&[&[own, text(&first), "--out", text(&out)], flags].concat());
        assert!(done.status.success(), "{}", stderr(&done));
        let before = std::fs::read(out.join(file)).expect("written");
        let challenge = ["challenge", "--grid", "32", "--out", text(&out)];
        let others = commands.map(|(name, flags, _)| [&[name, text(&second), "--out", text(&out)], flags].concat());
        for other in others.iter().map(Vec::as_slice).chain([&challenge[..]]) {
            let said = call(other);
            assert_eq!(said.status.code(), Some(2), "{other:?}: {}", stderr(&said));
            assert!(stderr(&said).contains("contains the results of another scene: "), "{}", stderr(&said));
            assert_eq!(std::fs::read(out.join(file)).expect("kept"), before, "{other:?}");
        }
        let replaced = call(&[&others[0][..], &["--overwrite"]].concat());
        assert!(replaced.status.success(), "{}", stderr(&replaced));
        assert!(out.join("results.json").exists() && !out.join("tradeoff.json").exists());
    }
}

#[test]
fn a_run_does_not_replace_another_scene() {
    let scratch = tempfile::tempdir().expect("scratch");
    let path = |name: &str| -> PathBuf { scratch.path().join(name) };
    let scene = |p: &str| format!("name = \"s\"\n[surface]\ngrid = 32\ncut_off_mode = 8\n[load]\np_star = [{p}]\n");
    let run = |more: &[&str]| call(&[&["run", text(&path("s.toml")), "--out", text(&path("run"))], more].concat());
    std::fs::write(path("s.toml"), scene("0.01")).expect("written");
    assert!(run(&[]).status.success());
    std::fs::write(path("s.toml"), scene("0.02")).expect("written");
    let said = stderr(&run(&[]));
    assert!(
        said.contains("another scene: load.p_star = [0.02] (was [0.01])") && said.contains("--overwrite"),
        "{said}"
    );
    assert!(path("run").join("results.json").exists());
    assert!(run(&["--overwrite"]).status.success());
    let curve = std::fs::read_to_string(path("run").join("curve.csv")).expect("a curve");
    assert!(curve.lines().nth(1).is_some_and(|row| row.contains("0.02")), "{curve}");
    // The columns of a solve, with the same names and order.
    let solved = path("solved");
    let solve = ["solve", "--challenge", "32", "--pressure", "0.01"];
    assert!(call(&[&solve[..], &["--out", text(&solved)]].concat()).status.success());
    let columns = |folder: &Path| -> Vec<String> {
        let table = std::fs::read_to_string(folder.join("curve.csv")).expect("a curve");
        table.lines().next().expect("a header").split(',').map(|c| c.replace("_MPa", "").replace("_um", "")).collect()
    };
    let (run, solve) = (columns(&path("run")), columns(&solved));
    let both = |of: &[String], other: &[String]| of.iter().filter(|c| other.contains(c)).cloned().collect::<Vec<_>>();
    assert_eq!(both(&run, &solve), both(&solve, &run));
    for column in ["load", "pressure", "contact_area", "mean_gap", "displacement", "energy", "residual"] {
        assert!(
            run.contains(&column.to_string()) && solve.contains(&column.to_string()),
            "{column}: {run:?} {solve:?}"
        );
    }
}

/// Waves that only the own grid has, touched lightly: half of the points give another contact.
#[test]
fn contact_that_the_grid_does_not_resolve_is_a_warning() {
    for (points, cut_off, modes, warned) in [("64", "0.001", "", true), ("256", "0.05", "cut_off_mode = 20\n", false)] {
        let said = stderr(&call(&["solve", "--challenge", points, "--cut-off", cut_off, "--pressure", "0.001,0.1"]));
        assert_eq!(said.contains("load 1: the grid does not resolve the contact"), warned, "{said}");
        // Loads without stated errors have the warning, too.
        let by_area = stderr(&call(&["solve", "--challenge", points, "--cut-off", cut_off, "--contact", "0.01,0.2"]));
        assert_eq!(by_area.contains("load 1: the grid does not resolve the contact"), warned, "{by_area}");
        assert!(!warned || said.contains("a finer grid (--challenge of a spectrum, --resample of a map)"), "{said}");
        let scratch = tempfile::tempdir().expect("scratch");
        let scene = scratch.path().join("scene.toml");
        let load = "[load]\np_star = [0.001, 0.1]\n";
        std::fs::write(&scene, format!("name = \"s\"\n[surface]\ngrid = {points}\n{modes}{load}")).expect("written");
        let out = scratch.path().join("out");
        let said = stderr(&call(&["run", text(&scene), "--out", text(&out)]));
        assert_eq!(said.contains("p* = 0.001: the grid does not resolve the contact"), warned, "{said}");
    }
}

/// The mirrored cell has four times the area of the map and carries four times the force, also where it was mirrored before.
#[test]
fn a_force_acts_on_the_measured_map() {
    let scratch = tempfile::tempdir().expect("scratch");
    let file = scratch.path().join("map.txt");
    export(&file, |x, y| waves(x, y) + 0.01 * x as f64);
    let pressure = |file: &Path, flags: &[&str]| {
        let map = ["solve", text(file), "--modulus", "1GPa", "--force", "1mN", "--json"];
        let found = answer(&[&map[..], flags].concat());
        number(&found, "pressure")
    };
    // 1 mN on 30 x 20 µm, in GPa.
    let exact = 1e-3 / 600e-12 / 1e9;
    let same = |found: f64, what: &str| assert!((found / exact - 1.0).abs() < ROUNDING, "{what}: {found} {exact}");
    let low = ["--touching", "low-points"];
    same(pressure(&file, &low), "as measured");
    same(pressure(&file, &[&low[..], &["--edges", "mirror"]].concat()), "mirrored");
    for name in ["p.nc", "p.npy", "p.txt"] {
        let prepared = scratch.path().join(name);
        let surface = ["surface", text(&file), "--edges", "mirror", "--out", text(&prepared)];
        assert!(call(&[&surface[..], &low].concat()).status.success());
        same(pressure(&prepared, &[]), name);
        // A quarter of the mirrored cell is a map again.
        same(pressure(&prepared, &["--crop", "0,0,60,40"]), name);
    }
}

/// Before sign, unit and filling are chosen, everything else is said.
#[test]
fn a_survey_precedes_what_is_missing() {
    let scratch = tempfile::tempdir().expect("scratch");
    let file = scratch.path().join("map.txt");
    let row = |y: usize| (0..40).map(|x| format!("{:.6}", waves(x, y) + 0.05 * x as f64)).collect::<Vec<_>>().join(" ");
    let mut rows: Vec<String> = (0..40).map(row).collect();
    rows[3] = rows[3].replacen(' ', " nan ", 1).rsplit_once(' ').expect("fields").0.to_string();
    std::fs::write(&file, rows.join("\n")).expect("written");
    let output = call(&["surface", text(&file)]);
    let (said, listed) = (stderr(&output), String::from_utf8_lossy(&output.stdout).into_owned());
    assert_eq!(output.status.code(), Some(2));
    for piece in ["40 x 40", "not declared (--touching)", "1 of 1600 points", "rms height about the plane"] {
        assert!(listed.contains(piece), "{piece}: {listed}");
    }
    assert!(said.contains("does not repeat") && said.contains("--touching = not given"), "{said}");
    // With --json there is no list.
    assert!(call(&["surface", text(&file), "--json"]).stdout.is_empty());
    let given = ["surface", text(&file), "--touching", "high-points", "--unit", "um", "--length", "30um"];
    let output = call(&given);
    assert!(output.stdout.is_empty() && stderr(&output).contains("--fill"), "the sign was chosen");
    assert!(call(&[&given[..], &["--fill", "nearest"]].concat()).status.success());
}

/// Tables of spectra and differences, in SI units: one wave of 0.2 µm and 10 µm along x.
#[test]
fn functions_of_a_surface_are_written() {
    let scratch = tempfile::tempdir().expect("scratch");
    let (file, folder) = (scratch.path().join("map.txt"), scratch.path().join("functions"));
    export(&file, |x, _| 0.2 * (TAU * 3.0 * x as f64 / NX as f64).cos());
    let surface = ["surface", text(&file), "--touching", "low-points", "--functions", text(&folder), "--json"];
    let found = answer(&surface);
    let statistic = |symbol: &str| {
        let list = found["statistics"].as_array().expect("statistics");
        number(list.iter().find(|s| s["symbol"] == symbol).unwrap_or_else(|| panic!("{symbol}")), "realised")
    };
    let absolute = (0..20).map(|x| 0.01 * (TAU * f64::from(x) / 20.0).cos().abs()).sum::<f64>();
    assert!((statistic("Sa") / absolute - 1.0).abs() < TEXT && (statistic("Sku") / 1.5 - 1.0).abs() < TEXT);
    assert!((statistic("Sal") - 10.0 * 0.2f64.acos() / TAU).abs() < 0.02);
    let table = |name: &str| -> Vec<Vec<f64>> {
        let text = std::fs::read_to_string(folder.join(name)).expect("written");
        text.lines().skip(1).map(|l| l.split(',').map(|v| v.parse().expect("a number")).collect()).collect()
    };
    // Tips more than twice as sharp as the wave's peaks, and as blunt: their radius is 1/(q² A) = 13 µm.
    let with_tip =
        |radius: &str| answer(&["surface", text(&file), "--touching", "low-points", "--tip-radius", radius, "--json"]);
    assert_eq!(with_tip("5um")["tip"]["cutoff_m"], Value::Null);
    let blunt = &with_tip("13um")["tip"];
    assert!((2e-6..10e-6).contains(&number(blunt, "cutoff_m")) && number(blunt, "touched_share") < 0.6, "{blunt}");
    // White noise of 0.01 µm, uniform between equal limits, is found under the wave.
    assert_eq!(found["noise"], Value::Null);
    let mut random = 1u64;
    let noise: Vec<f64> = std::iter::repeat_with(|| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        12f64.sqrt() * 0.01 * ((random >> 11) as f64 / (1u64 << 53) as f64 - 0.5)
    })
    .take(NX * NY)
    .collect();
    let noisy = scratch.path().join("noisy.txt");
    export(&noisy, |x, y| 0.2 * (TAU * 3.0 * x as f64 / NX as f64).cos() + noise[y * NX + x]);
    let noise = &answer(&["surface", text(&noisy), "--touching", "low-points", "--json"])["noise"];
    assert!((number(noise, "rms_height_m") / 1e-8 - 1.0).abs() < 0.3, "{noise}");
    // L |a|² with a = 0.1 µm.
    let wave = &table("power_spectrum_x.csv")[2];
    assert!((wave[1] - 1e-5).abs() < 1e-12 && (wave[2] / (30e-6 * 1e-14) - 1.0).abs() < TEXT, "{wave:?}");
    assert!(table("power_spectrum_y.csv").iter().all(|row| row[2] < 1e-30));
    let radial: f64 = table("power_spectrum_radial.csv").iter().map(|row| row[2]).fold(0.0, f64::max);
    assert!(radial > 0.0);
    // Half a wave apart heights differ by twice the amplitude at most: ⟨Δ²⟩ = A² (1 - cos π).
    let half = table("scale_dependent_x.csv").into_iter().find(|row| (row[0] - 5e-6).abs() < 1e-9).expect("10 pixels");
    assert!((half[1] / (2.0 * 0.04e-12) - 1.0).abs() < TEXT, "{half:?}");
    assert!(table("scale_dependent_y.csv").iter().all(|row| row[1] < 1e-20));
}
