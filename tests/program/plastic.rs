//! Hardness of every point, and stress below the surface, as flags and as keys.

use crate::program::{asperity, stderr};
use asperity::surface::files::npy;
use serde_json::Value;
use std::fs;
use std::path::Path;

/// Points per side of the challenge's surface here.
const N: usize = 64;

fn number(line: &Value, key: &str) -> f64 {
    line[key].as_f64().unwrap_or_else(|| panic!("{key} in {line}"))
}

fn solve(more: &[&str]) -> std::process::Output {
    let base = ["solve", "--challenge", "64", "--length", "1m", "--cut-off", "0.06m", "--modulus", "2GPa"];
    asperity().args(base).args(more).output().expect("started")
}

fn lines(found: &std::process::Output) -> Vec<Value> {
    assert!(found.status.success(), "{}", stderr(found));
    String::from_utf8_lossy(&found.stdout).lines().map(|l| serde_json::from_str(l).expect("JSON")).collect()
}

/// Two hardnesses in halves, GPa.
fn halves(x: usize) -> f64 {
    if x < N / 2 { 0.15 } else { 0.3 }
}

fn write_map(path: &Path, value: impl Fn(usize, usize) -> f64) {
    npy::write(path, N, N, (0..N * N).map(|i| value(i % N, i / N))).expect("written");
}

/// The crystal yields at its highest load, which counts although the load that is measured there may be above the imposed one by rounding.
#[test]
fn the_hardness_of_a_crystal_is_the_stress_of_the_states_that_yield() {
    let Some(_lammps) = crate::lammps::lammps(1) else { return };
    let scratch = tempfile::tempdir().expect("scratch");
    let scene = "name = \"yields\"\n[surface]\ngrid = 128\nseed = 5\nroll_off_mode = 2\ncut_off_mode = 8\nrms_gradient = 0.7\n\
                 [load]\np_star = [0.01, 0.05]\n[atoms]\ncells = 11\ndepth_cells = 6\nplasticity = true\n";
    fs::write(scratch.path().join("scene.toml"), scene).expect("written");
    let run = asperity().current_dir(scratch.path()).args(["run", "scene.toml", "--out", "r"]).output();
    let run = run.expect("started");
    assert!(run.status.success(), "{}", stderr(&run));
    let text = fs::read_to_string(scratch.path().join("r/results.json")).expect("results");
    let atoms = &serde_json::from_str::<Value>(&text).expect("JSON")["atoms"];
    let state = |i: usize| &atoms["states"][i];
    let (noise, defects) =
        (number(&atoms["plasticity"], "noise_atoms"), |i: usize| number(&state(i)["defects"], "atoms"));
    assert!(defects(0) <= noise && defects(1) > noise, "{} {}", defects(0), defects(1));
    assert_eq!(number(&atoms["plasticity"], "hardness_gpa"), number(state(1), "contact_stress_gpa"));
}

/// Methods without plastic flow are compared with the one that has it: they solve the elastic body, and say so.
#[test]
fn elastic_methods_are_compared_with_plastic_flow() {
    let scratch = tempfile::tempdir().expect("scratch");
    let results = |name: &str, hardness: &str| -> Value {
        let scene = format!(
            "name = \"{name}\"\n[laboratory]\nmodulus = \"2 GPa\"\n[surface]\ngrid = 64\nroll_off_mode = 2\ncut_off_mode = 12\nrms_gradient = 0.1\n\
             [continuum]\ncompare_with = [\"bicgstab\", \"persson\", \"bvm\"]\n{hardness}\n[load]\npressure = \"20 MPa\"\n"
        );
        let (file, out) = (scratch.path().join(format!("{name}.toml")), scratch.path().join(name));
        fs::write(&file, scene).expect("written");
        let ran = asperity().arg("run").arg(&file).arg("--out").arg(&out).output().expect("started");
        assert!(ran.status.success(), "{}", stderr(&ran));
        assert_eq!(stderr(&ran).contains("persson: models no plastic flow"), !hardness.is_empty(), "{}", stderr(&ran));
        serde_json::from_str(&fs::read_to_string(out.join("results.json")).expect("written")).expect("JSON")
    };
    let (plastic, elastic) = (results("plastic", "hardness = \"120 MPa\""), results("elastic", ""));
    let of = |found: &Value, id: &str| -> Value {
        let list = found["methods"].as_array().expect("methods");
        assert_eq!(list.len(), 3);
        list.iter().find(|m| m["method"] == id).expect(id).clone()
    };
    let area = |found: &Value, id: &str| number(&of(found, id)["states"][0], "contact_area");
    for id in ["bicgstab", "persson"] {
        assert_eq!(area(&plastic, id), area(&elastic, id), "{id}");
        assert!(of(&plastic, id)["warning"].as_str().expect("said").starts_with("models no plastic flow"));
    }
    assert!(area(&plastic, "bvm") > 1.05 * area(&elastic, "bvm") && of(&plastic, "bvm")["warning"].is_null());
}

/// A map as `.npy` or text, in the unit of the modulus or another: no stress above the hardness of its point. One of equal values
/// is the number, to the last bit. The results name file and hash.
#[test]
fn a_hardness_map_bounds_the_stress_of_each_point() {
    let scratch = tempfile::tempdir().expect("scratch");
    let path = |name: &str| scratch.path().join(name);
    let text = |name: &str| path(name).to_str().expect("UTF-8").to_string();
    write_map(&path("halves.npy"), |x, _| halves(x));
    let rows: Vec<String> =
        (0..N).map(|_| (0..N).map(|x| (1e3 * halves(x)).to_string()).collect::<Vec<_>>().join(" ")).collect();
    fs::write(path("halves.txt"), rows.join("\n")).expect("written");
    write_map(&path("equal.npy"), |_, _| 0.2);
    let of = |hardness: &[&str], out: &str| {
        let out = text(out);
        let flags = [hardness, &["--pressure", "20MPa,60MPa", "--json", "--out", &out]].concat();
        lines(&solve(&flags))
    };
    let found = of(&["--hardness-map", &text("halves.npy")], "a");
    let stress = npy::read(&path("a/load-2-stress.npy")).expect("a field").values;
    for (i, s) in stress.iter().enumerate() {
        assert!(*s <= halves(i % N) * (1.0 + 1e-6), "{i}: {s}");
    }
    for half in [0.15, 0.3] {
        let flows = |i: usize| halves(i % N) == half && (stress[i] / half - 1.0).abs() < 1e-6;
        assert!((0..stress.len()).filter(|i| flows(*i)).count() > 3, "{half}");
    }
    let map = &found[1]["hardness_map"];
    assert!((number(&found[1], "hardness") - 0.225).abs() < 1e-12);
    assert!((number(map, "lowest") - 0.15).abs() < 1e-12 && (number(map, "highest") - 0.3).abs() < 1e-12);
    assert!(
        map["file"].as_str().is_some_and(|f| f.ends_with("halves.npy"))
            && map["hash"].as_str().map(str::len) == Some(64)
    );
    // In MPa, as text.
    of(&["--hardness-map", &text("halves.txt"), "--hardness-map-unit", "MPa"], "b");
    let other = npy::read(&path("b/load-2-stress.npy")).expect("a field").values;
    assert!(stress.iter().zip(&other).all(|(a, b)| (a - b).abs() < 1e-9));
    let bytes = |name: &str| fs::read(path(name)).expect("a field");
    of(&["--hardness-map", &text("equal.npy")], "c");
    of(&["--hardness", "0.2GPa"], "d");
    for field in ["load-1-gap.npy", "load-2-gap.npy", "load-2-stress.npy", "load-2-plastic.npy"] {
        assert_eq!(bytes(&format!("c/{field}")), bytes(&format!("d/{field}")), "{field}");
    }
    // Another map at the same place is another problem.
    write_map(&path("halves.npy"), |x, _| 1.1 * halves(x));
    let again = solve(&["--hardness-map", &text("halves.npy"), "--pressure", "20MPa,60MPa", "--out", &text("a")]);
    assert!(stderr(&again).contains("contains another solve"), "{}", stderr(&again));
}

#[test]
fn maps_that_are_no_hardness_are_refused() {
    let scratch = tempfile::tempdir().expect("scratch");
    let path = |name: &str| scratch.path().join(name);
    let text = |name: &str| path(name).to_str().expect("UTF-8").to_string();
    write_map(&path("zero.npy"), |x, y| if (x, y) == (3, 5) { 0.0 } else { 0.2 });
    write_map(&path("negative.npy"), |x, _| halves(x) - 0.2);
    write_map(&path("nan.npy"), |x, y| if (x, y) == (0, 1) { f64::NAN } else { 0.2 });
    write_map(&path("infinite.npy"), |x, y| if (x, y) == (0, 1) { f64::INFINITY } else { 0.2 });
    write_map(&path("good.npy"), |x, _| halves(x));
    npy::write(&path("small.npy"), 32, 32, vec![0.2; 1024]).expect("written");
    fs::write(path("words.txt"), "not a map\n").expect("written");
    let good = text("good.npy");
    for (hardness, more, words) in [
        (text("zero.npy"), &[][..], "0 in row 6, column 4"),
        (text("negative.npy"), &[], "row 1, column 1"),
        (text("nan.npy"), &[], "NaN in row 2, column 1"),
        (text("infinite.npy"), &[], "inf in row 2, column 1"),
        (text("small.npy"), &[], "32 x 32 values; accepted: 64 x 64"),
        (text("words.txt"), &[], "words.txt"),
        (text("absent.npy"), &[], "no such file"),
        (good.clone(), &["--hardness-map-unit", "um"], "a stress with its unit"),
        (good.clone(), &["--wall", "penalty", "--penalty-length", "1mm"], "soft wall"),
        (good.clone(), &["--method", "winkler"], "models plastic flow"),
        (good.clone(), &["--pressure", "230MPa"], "at which every node flows"),
        (good.clone(), &["--hardness", "200MPa"], "cannot be used with"),
    ] {
        let pressure: &[&str] = if more.contains(&"--pressure") { &[] } else { &["--pressure", "20MPa"] };
        let refused = solve(&[&["--hardness-map", &hardness], pressure, more].concat());
        assert_ne!(refused.status.code(), Some(0), "{hardness} {more:?}");
        let said = stderr(&refused);
        let errors = said.lines().filter(|line| line.contains("error: ")).count();
        assert!(said.contains(words) && errors == 1, "{hardness} {more:?}: {said}");
    }
}

/// `--subsurface`: maps and largest values at each depth, below a wave as Westergaard has them.
#[test]
fn stresses_below_the_surface() {
    let scratch = tempfile::tempdir().expect("scratch");
    let path = |name: &str| scratch.path().join(name);
    let text = |name: &str| path(name).to_str().expect("UTF-8").to_string();
    // Full contact with a wave: the pressure is p (1 + cos) with p = E* q h/2 or more.
    let wave = |x: usize| 0.001 * (std::f64::consts::TAU * x as f64 / N as f64).cos();
    write_map(&path("wave.npy"), |x, _| wave(x));
    let out = text("out");
    let below = |more: &[&str]| {
        let base = ["solve", &text("wave.npy"), "--touching", "low-points", "--length", "1", "--modulus", "1"];
        asperity().args(base).args(["--pressure", "0.004"]).args(more).output().expect("started")
    };
    let flags =
        ["--subsurface", "lin:0:0.2:3", "--poisson", "0.3", "--shear-strength", "0.001", "--json", "--out", &out];
    let line = lines(&below(&flags)).remove(0);
    let found = &line["subsurface"];
    let amplitude = std::f64::consts::PI * 0.001;
    for (k, slice) in found["slices"].as_array().expect("slices").iter().enumerate() {
        let q_depth = std::f64::consts::TAU * 0.1 * k as f64;
        let of = |x: usize| {
            let (s, c) = (std::f64::consts::TAU * x as f64 / N as f64).sin_cos();
            let fades = amplitude * (-q_depth).exp();
            let xx = -0.004 * 0.3 / 0.7 + (1.0 - q_depth) * fades * c;
            let yy = -0.004 * 0.3 / 0.7 + 0.6 * fades * c;
            let zz = -0.004 + (1.0 + q_depth) * fades * c;
            let xz = q_depth * fades * s;
            let (centre, radius) = (0.5 * (xx + zz), (0.5 * (xx - zz)).hypot(xz));
            let principal = [centre + radius, centre - radius, yy];
            let [high, low] =
                [f64::max as fn(f64, f64) -> f64, f64::min].map(|of| principal.into_iter().reduce(of).unwrap());
            0.5 * (high - low)
        };
        let expected = (0..N).map(of).fold(0.0, f64::max);
        let shear = number(&slice["shear"], "value");
        assert!((shear / expected - 1.0).abs() < 1e-6, "{k}: {shear} {expected}");
        assert!((number(slice, "depth") - 0.1 * k as f64).abs() < 1e-15);
        let name = slice["shear"]["map"].as_str().expect("a file");
        assert_eq!(name, format!("shear-depth-{}.npy", k + 1));
        let map = npy::read(&path("out").join(name)).expect("a field").values;
        assert_eq!(map.iter().copied().fold(0.0, f64::max), shear);
        assert!(path("out").join(format!("von-mises-depth-{}.npy", k + 1)).exists());
    }
    let share = number(found, "shear_over_strength");
    assert!((share - number(&found["shear"], "value") / 0.001).abs() < 1e-12);
    // The finished solve is read from the folder, and its maps are its own.
    assert!(stderr(&below(&flags)).contains("finished already"));
    let table = String::from_utf8_lossy(&below(&flags[..6]).stdout).into_owned();
    assert!(table.contains("largest shear stress below") && table.contains("over the shear strength"), "{table}");
    for (more, words) in [
        (&["--subsurface", "0.1"][..], "--poisson = not given"),
        (&["--subsurface", "0.1", "--poisson", "0.6"], "--poisson = 0.6"),
        (&["--subsurface=-0.1", "--poisson", "0.3"], "--subsurface = -0.1"),
        (&["--subsurface", "0.1,1mm", "--poisson", "0.3"], "--subsurface"),
        (&["--subsurface", "0.3", "--thickness", "0.2"], "the thickness of the layer"),
        (&["--subsurface", "0.1", "--poisson", "0.3", "--crystal", "2,1,0.8"], "an isotropic body"),
        (&["--subsurface", "0.1", "--poisson", "0.3", "--shear-strength", "-1"], "--shear-strength"),
        (&["--subsurface", "0.1", "--poisson", "0.3", "--method", "winkler"], "a solver of the fields"),
        (&["--poisson", "0.3"], "--thickness or --subsurface"),
    ] {
        let refused = below(more);
        assert_eq!(refused.status.code(), Some(2), "{more:?}: {}", stderr(&refused));
        assert!(stderr(&refused).contains(words), "{more:?}: {}", stderr(&refused));
    }
}

/// The keys of scenes: results state the map with its hash, the stresses below the surface and the onset of plasticity. A changed
/// map is solved again.
#[test]
fn a_scene_has_a_hardness_map_and_stresses_below() {
    let scratch = tempfile::tempdir().expect("scratch");
    let path = |name: &str| scratch.path().join(name);
    write_map(&path("hardness.npy"), |x, _| 1e3 * halves(x));
    let scene = "name = \"plastic\"\n[laboratory]\nlength = \"100.0 um\"\nmodulus = \"2000.0 MPa\"\n\
                 [surface]\ngrid = 64\ncut_off = \"6.0 um\"\nrms_gradient = 0.5\n[load]\np_star = [1e-5, 0.01, 0.05]\n\
                 [continuum]\nhardness_map = \"hardness.npy\"\n\
                 [continuum.subsurface]\ndepths = [\"0.5 um\", \"1.0 um\", \"5.0 um\"]\npoisson = 0.3\nshear_strength = \"60.0 MPa\"\n";
    fs::write(path("scene.toml"), scene).expect("written");
    let run = || {
        let mut command = asperity();
        command.current_dir(scratch.path()).args(["run", "scene.toml", "--out", "out"]).output().expect("started")
    };
    let first = run();
    assert!(first.status.success(), "{}", stderr(&first));
    let results = || -> Value {
        serde_json::from_str(&fs::read_to_string(path("out/results.json")).expect("results")).expect("JSON")
    };
    let found = results()["continuum"].clone();
    let modulus = number(&results()["scales"], "modulus_pa");
    assert!((number(&found["hardness_map"], "highest") / modulus - 0.15).abs() < 1e-12, "{}", found["hardness_map"]);
    let [before, after] = [0, 1].map(|k| found["onset"]["hardness"][k].as_f64().expect("a load"));
    let flows = |k: usize| number(&found["states"][k], "displaced_fraction") > 0.0;
    let first_with = (0..3).find(|k| flows(*k)).expect("flow");
    assert_eq!(after, number(&found["states"][first_with], "p_star"));
    assert!(before < after);
    let share = |k: usize| number(&found["states"][k]["subsurface"], "shear_over_strength");
    assert!(share(0) < share(2) && share(2) > 1.0, "{} {}", share(0), share(2));
    assert!(found["onset"]["shear_strength"].is_array());
    let slice = &found["states"][2]["subsurface"]["slices"][1];
    let map = npy::read(&path("out").join(slice["von_mises"]["map"].as_str().expect("a file"))).expect("a field");
    assert_eq!(map.values.iter().copied().fold(0.0, f64::max) * modulus, number(&slice["von_mises"], "value"));
    let hash = found["hardness_map"]["hash"].clone();
    write_map(&path("hardness.npy"), |x, _| 2e3 * halves(x));
    let second = run();
    assert!(second.status.success(), "{}", stderr(&second));
    let changed = results()["continuum"].clone();
    assert_ne!(changed["hardness_map"]["hash"], hash);
    assert!((number(&changed["hardness_map"], "highest") / modulus - 0.3).abs() < 1e-12);
    for (key, value, words) in [
        (
            "hardness_map = \"hardness.npy\"",
            "hardness_map = \"hardness.npy\"\nhardness = \"3.0 MPa\"",
            "one of the two",
        ),
        ("hardness_map = \"hardness.npy\"", "hardness_map_unit = \"2.0 MPa\"", "only together with"),
        ("hardness_map = \"hardness.npy\"", "hardness_map = \"absent.npy\"", "no such file"),
        ("depths = [\"0.5 um\", \"1.0 um\", \"5.0 um\"]", "depths = []", "at least one"),
        ("poisson = 0.3", "", "the Poisson's ratio of the half-space"),
        // Together with what is wrong elsewhere.
        ("p_star = [1e-5, 0.01, 0.05]", "mean_gap = [\"1.0 um\"]\nmaps_at = [0.5]", "given with a mean gap"),
    ] {
        fs::write(path("bad.toml"), scene.replace(key, value)).expect("written");
        let mut command = asperity();
        let refused =
            command.current_dir(scratch.path()).args(["run", "bad.toml", "--dry-run"]).output().expect("started");
        assert_eq!(refused.status.code(), Some(2), "{value}");
        assert!(stderr(&refused).contains(words), "{value}: {}", stderr(&refused));
    }
}
