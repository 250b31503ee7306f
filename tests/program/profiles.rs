//! Profiles as surfaces that are uniform along y, and maps with waves below what was measured.

use crate::program::{asperity, stderr};
use crate::scratch::Scratch;
use serde_json::Value;
use std::f64::consts::TAU;
use std::fs;
use std::process::Output;

fn run(command: &str, flags: &[&str]) -> Output {
    asperity().arg(command).args(flags).output().expect("started")
}

fn json(command: &str, flags: &[&str]) -> Value {
    let found = run(command, &[flags, &["--json"]].concat());
    assert!(found.status.success(), "{flags:?}: {}", stderr(&found));
    serde_json::from_slice(&found.stdout).expect("JSON")
}

fn number(line: &Value, key: &str) -> f64 {
    line[key].as_f64().unwrap_or_else(|| panic!("{key} in {line}"))
}

/// Points of a profile, and their distance in µm.
const N: usize = 240;
const STEP: f64 = 0.25;

/// In µm.
fn height(i: usize) -> f64 {
    let wave = |k: f64, phase: f64| (TAU * k * i as f64 / N as f64 + phase).cos();
    0.2 * wave(1.0, 0.4) + 0.08 * wave(5.0, 1.0) + 0.05 * wave(13.0, 2.0)
}

fn table(separator: &str, header: &str, row: impl Fn(usize) -> (f64, f64)) -> String {
    let line = |i: usize| format!("{:.4}{separator}{:.9}\n", row(i).0, row(i).1);
    header.to_string() + &(0..N).map(line).collect::<String>()
}

/// Tables of positions and heights, with either order and with names of columns, are the line of heights that they hold, and a strip of
/// many such lines.
#[test]
fn a_profile_is_a_surface_uniform_along_y() {
    let files = Scratch::new();
    files.map("strip.npy", [N, 6], |x, _| height(x));
    let plain = |i: usize| (STEP * i as f64, height(i));
    let reversed = |i: usize| (STEP * (N - 1 - i) as f64, height(N - 1 - i));
    files.text("columns.txt", &table("\t", "", plain));
    files.text("named.csv", &table(",", "X_(microns),Z_(microns)\n", plain));
    files.text("reversed.txt", &table(" ", "", reversed));
    files.text("line.txt", &(0..N).map(|i| format!("{:.9} ", height(i))).collect::<String>());
    let usual = ["--touching", "high-points", "--modulus", "10MPa", "--pressure", "0.05MPa", "--unit", "um"];
    let strip = json("solve", &[&[&files.word("strip.npy")[..], "--length", "60um"], &usual[..]].concat());
    let numbered = |i: usize| format!("{} {:.4} {:.9}\n", i + 1, plain(i).0, plain(i).1);
    files.text("index.txt", &(0..N).map(numbered).collect::<String>());
    let quality = |i: usize| format!("{:.4}\t{}\t{:.9}\n", plain(i).0, i % 7, plain(i).1);
    files.text("quality.txt", &("x [um]\tquality\tz [um]\n".to_string() + &(0..N).map(quality).collect::<String>()));
    files.text("blanks.txt", &table("  ", "# x (um)  z (um)\n", plain));
    let along_y = |i: usize| format!("3.5 {:.4} {:.9}\n", plain(i).0, plain(i).1);
    files.text("y.txt", &("# x y z\n".to_string() + &(0..N).map(along_y).collect::<String>()));
    for (name, more) in [
        ("columns.txt", &[][..]),
        ("blanks.txt", &[]),
        ("y.txt", &[]),
        ("index.txt", &[]),
        ("quality.txt", &[]),
        ("named.csv", &[]),
        ("reversed.txt", &[]),
        ("columns.txt", &["--length", "60um"]),
        ("line.txt", &["--length", "60um"]),
    ] {
        let one = json("solve", &[&[&files.word(name)[..], "--profile"], more, &usual[..]].concat());
        assert_eq!((number(&one, "nx"), number(&one, "ny")), (N as f64, 1.0), "{name}");
        for key in ["contact_nodes", "mean_gap", "stiffness"] {
            let (a, b) = (number(&one, key), number(&strip, key));
            assert!((a / b - 1.0).abs() < 1e-6, "{name} {key}: {a} {b}");
        }
    }
    // Rq and Rdq of the sum of three waves, by closed form.
    let flags = [&files.word("columns.txt")[..], "--profile", "--touching", "high-points", "--unit", "um"];
    let surface = json("surface", &flags);
    let waves = [(0.2, 1.0), (0.08, 5.0), (0.05, 13.0)];
    let rms = waves.map(|(a, _): (f64, f64)| a * a / 2.0).iter().sum::<f64>().sqrt() * 1e-6;
    let slope = waves.map(|(a, k)| (TAU * k / (N as f64 * STEP) * a).powi(2) / 2.0).iter().sum::<f64>().sqrt();
    assert!((number(&surface, "rms_height_m") / rms - 1.0).abs() < 1e-6, "{surface}");
    assert!((number(&surface, "rms_gradient") / slope - 1.0).abs() < 1e-6, "{surface}");
    // A run with its report.
    let scene = "name = \"profile\"\n[laboratory]\nmodulus = \"10 MPa\"\n[surface]\nheights = \"columns.txt\"\nprofile = true\nunit = \
                 \"um\"\ntouching = \"high-points\"\n[load]\npressure = \"50 kPa\"\n";
    let scene = files.text("profile.toml", scene);
    let out = files.word("out");
    let results = json("run", &[&scene, "--out", &out]);
    assert!(results.is_object() && files.path("out/report.html").exists());
    // Of one line there are curves in place of maps, which would be slivers.
    for (figure, is_drawn) in [
        ("first-profile", true),
        ("heights", true),
        ("gap-profile", true),
        ("stress-profile", true),
        ("relief", false),
        ("gap-1", false),
        ("first-1", false),
    ] {
        let drawing = fs::read_to_string(files.path(&format!("out/figures/{figure}.svg")));
        assert_eq!(drawing.is_ok_and(|svg| !svg.contains("<image ")), is_drawn, "{figure}");
    }
    let page = fs::read_to_string(files.path("out/report.html")).expect("a report");
    // Nothing is expected of a measured surface.
    assert!(page.contains("<th>value</th>") && !page.contains("<th>expected</th>") && !page.contains("<th>band</th>"));
    let area = fs::read_to_string(files.path("out/results.json")).expect("results");
    let area: Value = serde_json::from_str(&area).expect("JSON");
    let area = number(&area["continuum"]["states"][0], "contact_nodes");
    assert!((area / number(&strip, "contact_nodes") - 1.0).abs() < 1e-6);
    // The scene that `init` writes for one has all that it needs.
    let written = files.word("written.toml");
    let flags = ["--profile", "--touching", "high-points", "--modulus", "10MPa", "--out", &written];
    let init = json("init", &[&[&files.word("blanks.txt")[..]], &flags[..]].concat());
    assert_eq!(init["fill_in"], Value::Array(Vec::new()), "{init}");
    let planned = run("run", &[&written, "--dry-run"]);
    assert!(planned.status.success(), "{}", stderr(&planned));
}

#[test]
fn what_is_no_profile_and_what_none_can_do_is_refused() {
    let files = Scratch::new();
    let profile = files.text("p.txt", &table(" ", "", |i| (STEP * i as f64, height(i))));
    let back = files.text("back.txt", &table(" ", "", |i| (STEP * (i % 7) as f64, height(i))));
    let map = files.text("map.txt", &format!("{}\n", "1 2 3 4 5\n".repeat(9)));
    let three = files.text("three.txt", &table(" ", "", |i| (STEP * i as f64, height(i))).replace('\n', " 5\n"));
    let both = |i: usize| format!("{:.4} {:.4} {:.9}\n", 0.6 * STEP * i as f64, 0.8 * STEP * i as f64, height(i));
    let both = files.text("both.txt", &("# x y z\n".to_string() + &(0..N).map(both).collect::<String>()));
    let usual = ["--touching", "high-points", "--modulus", "1", "--length", "60"];
    for (flags, words) in [
        (vec![&both[..], "--profile", "--pressure", "0.01"], "x and y that both vary"),
        (vec![&profile, "--pressure", "0.01"], "--profile"),
        (vec![&profile, "--profile", "--pressure", "0.01", "--non-periodic"], "it has no edges there"),
        (vec![&profile, "--profile", "--force", "0.01"], "no width on which a force acts"),
        (vec![&back, "--profile", "--pressure", "0.01"], "neither rise nor fall"),
        (vec![&profile, "--profile", "--pressure", "0.01", "--method", "persson"], "roughness along both axes"),
        (vec![&map, "--profile", "--pressure", "0.01"], "a map of 5 x 9 points"),
        (vec![&three, "--profile", "--pressure", "0.01"], "# index x z"),
        (vec![&profile, "--isotropic-map", "--seed", "1", "--pressure", "0.01"], "only together with --profile"),
        (vec![&profile, "--profile", "--isotropic-map", "--edges", "mirror", "--pressure", "0.01"], "which repeats"),
        (vec![&profile, "--profile", "--isotropic-map", "--length-y", "20", "--pressure", "0.01"], "which is a square"),
    ] {
        let refused = run("solve", &[&flags[..], &usual].concat());
        let said = stderr(&refused);
        assert!(refused.status.code() == Some(2) && said.contains(words), "{flags:?}: {said}");
    }
}

/// A map that is known down to a wavelength, alone and with waves below it: less contact under the same pressure, by how much depends on the
/// seed. `ensemble` gives mean and error.
#[test]
fn waves_below_the_measured_ones_reduce_the_contact() {
    let files = Scratch::new();
    let made = ["--grid", "256", "--seed", "5", "--cut-off", "2um", "--rms-gradient", "0.2", "--out"];
    let map = files.word("map.npy");
    let found = run("surface", &[&made[..], &[&map]].concat());
    assert!(found.status.success(), "{}", stderr(&found));
    let solve = |more: &[&str]| {
        let usual = [&map[..], "--modulus", "25MPa", "--pressure", "0.1MPa"];
        number(&json("solve", &[&usual[..], more].concat()), "contact_area")
    };
    let (whole, known) = (solve(&[]), solve(&["--low-pass", "5um"]));
    let extended = ["--low-pass", "5um", "--extend-to", "2um", "--seed"];
    let [one, two, again] = ["1", "2", "1"].map(|seed| solve(&[&extended[..], &[seed]].concat()));
    assert!(one != two && one == again && known > 1.2 * whole, "{whole} {known} {one} {two}");
    // Within the uncertainty of H: few waves are between the cut-off and the roll-off at 20 µm.
    assert!([one, two].iter().all(|area| (area / whole - 1.0).abs() < 0.1), "{whole} {known} {one} {two}");
    let scene = "name = \"afm\"\n[laboratory]\nmodulus = \"25 MPa\"\n[surface]\nheights = \"map.npy\"\nlow_pass = \"5 um\"\nextend_to = \"2 \
                 um\"\n[load]\npressure = \"0.1 MPa\"\n";
    let scene = files.text("afm.toml", scene);
    let found = run("ensemble", &[&scene, "--seeds", "1..2", "--out", &files.word("band")]);
    assert!(found.status.success(), "{}", stderr(&found));
    let text = fs::read_to_string(files.path("band/ensemble.json")).expect("results");
    let all: Value = serde_json::from_str(&text).expect("JSON");
    let of_area = |s: &&Value| s["source"] == "continuum" && s["quantity"] == "contact_area";
    let mean = all["statistics"].as_array().expect("a list").iter().find(of_area).expect("the area")["mean"].as_f64();
    assert!((mean.expect("a number") / ((one + two) / 2.0) - 1.0).abs() < 1e-9, "{mean:?} {one} {two}");
    for (more, words) in [
        (&["--extend-to", "2um", "--seed", "1"][..], "--low-pass"),
        (&["--low-pass", "5um", "--seed", "1"], "--extend-to"),
        (&["--low-pass", "5um", "--extend-to", "6um"], "to below --low-pass"),
        (&["--seed", "1"], "only together with --challenge, --extend-to or --isotropic-map"),
    ] {
        let refused = run("solve", &[&[&map[..], "--modulus", "25MPa", "--pressure", "0.1MPa"], more].concat());
        let said = stderr(&refused);
        assert!(refused.status.code() == Some(2) && said.contains(words), "{more:?}: {said}");
    }
    let refused = run("surface", &[&map[..], "--seed", "1"]);
    assert!(refused.status.code() == Some(2) && stderr(&refused).contains("--extend-to"), "{}", stderr(&refused));
}

/// A profile as one realisation of an isotropic surface: it says so, has the seed's heights, and what needs roughness along both axes is solved.
#[test]
fn a_profile_gives_an_isotropic_map() {
    let files = Scratch::new();
    let made =
        ["--grid", "256", "--seed", "3", "--roll-off", "12.5um", "--cut-off", "2um", "--rms-gradient", "0.1", "--out"];
    let map = files.word("map.txt");
    assert!(run("surface", &[&made[..], &[&map]].concat()).status.success());
    let text = fs::read_to_string(&map).expect("a map");
    let row = text.lines().find(|line| !line.starts_with('#')).expect("a row");
    let step = 100.0 / 256.0;
    let lines = row.split_whitespace().enumerate().map(|(i, z)| format!("{:.5} {z}\n", step * i as f64));
    let profile = files.text("profile.txt", &("# x [um] z [um]\n".to_string() + &lines.collect::<String>()));
    let isotropic =
        [&profile[..], "--profile", "--unit", "um", "--touching", "high-points", "--isotropic-map", "--seed"];
    let surface = |seed: &str| json("surface", &[&isotropic[..], &[seed]].concat());
    let [one, two, again] = ["1", "2", "1"].map(surface);
    assert!(one["rms_height_m"] == again["rms_height_m"] && one["rms_height_m"] != two["rms_height_m"]);
    assert_eq!(
        (number(&one, "nx"), number(&one, "ny"), number(&one, "length_y_m")),
        (256.0, 256.0, number(&one, "length_x_m"))
    );
    assert!((number(&one, "rms_gradient") / 0.1 - 1.0).abs() < 0.3, "{one}");
    let step = one["preparation"][0].as_str().expect("a step");
    for words in ["one realisation, of seed 1", "Hann window", "rms height", "rms gradient"] {
        assert!(step.contains(words), "{step}");
    }
    let loads = ["--modulus", "25MPa", "--pressure", "0.05MPa"];
    for more in [&["--method", "persson"][..], &["--force", "0.1mN"], &[]] {
        let loads = if more.first() == Some(&"--force") { &loads[..2] } else { &loads[..] };
        let solved = json("solve", &[&isotropic[..], &["1"], loads, more].concat());
        assert!((0.001..0.9).contains(&number(&solved, "contact_area")), "{more:?}: {solved}");
    }
}
