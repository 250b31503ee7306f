//! Two rough bodies: the sum of their heights, one contact modulus, the softer hardness, as flags and as keys.

use crate::program::{asperity, stderr};
use crate::scratch::{Scratch, field};
use serde_json::Value;
use std::f64::consts::{PI, TAU};
use std::fs;
use std::process::Output;

/// Points per side.
const N: usize = 48;

/// Relative difference of equal problems whose heights differ by rounding.
const ROUNDING: f64 = 1e-6;

fn solve(flags: &[&str]) -> Output {
    asperity().arg("solve").args(flags).output().expect("started")
}

fn states(flags: &[&str]) -> Vec<Value> {
    let found = solve(&[flags, &["--json"]].concat());
    assert!(found.status.success(), "{}", stderr(&found));
    String::from_utf8_lossy(&found.stdout).lines().map(|l| serde_json::from_str(l).expect("JSON")).collect()
}

fn number(line: &Value, key: &str) -> f64 {
    line[key].as_f64().unwrap_or_else(|| panic!("{key} in {line}"))
}

/// Heights of a cell of 10.
fn rough(x: usize, y: usize) -> f64 {
    let wave = |k: f64, l: f64, phase: f64| (TAU * (k * x as f64 + l * y as f64) / N as f64 + phase).cos();
    0.1 * wave(1.0, 0.0, 0.3) + 0.05 * wave(2.0, -3.0, 1.0) + 0.03 * wave(5.0, 4.0, 2.0)
}

/// Half of the surface on half of it, turned over, is the surface on a flat. Of two bodies the displacements have the ratio of the
/// compliances, and together they are the change of the gap.
#[test]
fn two_halves_are_the_whole() {
    let files = Scratch::new();
    let whole = files.map("whole.npy", [N, N], rough);
    let half = files.map("half.npy", [N, N], |x, y| rough(x, y) / 2.0);
    let over = files.map("over.npy", [N, N], |x, y| rough((N - x) % N, y) / 2.0);
    let usual = ["--touching", "high-points", "--length", "10", "--pressure", "0.01,0.1"];
    // 1/E* = 0.75/1.5 + 0.91/1.82 = 1.
    let bodies = ["--body", "1.5,0.5,0.4", "--body", "1.82,0.3,0.15"];
    let [out_pair, out_one] = ["pair", "one"].map(|name| files.word(name));
    let pair = [&[&half[..], "--other", &over, "--out", &out_pair], &usual[..], &bodies].concat();
    let single = [&[&whole[..], "--modulus", "1", "--hardness", "0.15", "--out", &out_one], &usual[..]].concat();
    for (a, b) in states(&pair).iter().zip(states(&single)) {
        for key in ["contact_area", "mean_gap", "stiffness", "hardness"] {
            let (a, b) = (number(a, key), number(&b, key));
            assert!((a / b - 1.0).abs() < ROUNDING, "{key}: {a} {b}");
        }
    }
    let of = |name: &str| field(&files.path(&format!("pair/load-2-{name}.npy")));
    let (gap, plastic, [first, other]) = (of("gap"), of("plastic"), [of("displacement-1"), of("displacement-2")]);
    let heights: Vec<f64> = (0..N * N).map(|i| -rough(i % N, i / N)).collect();
    let change: Vec<f64> = (0..N * N).map(|i| gap[i] - heights[i] - plastic[i]).collect();
    let mean = change.iter().sum::<f64>() / change.len() as f64;
    // Into the bodies, 2/(E* q) times the contact stress, wave by wave.
    let stress = of("stress");
    for (k, l) in [(1, 0), (2, -3), (5, 4)] {
        let wave = |field: &dyn Fn(usize) -> f64| {
            (0..N * N).fold([0.0; 2], |[re, im], i| {
                let phase = TAU * (f64::from(k) * (i % N) as f64 + f64::from(l) * (i / N) as f64) / N as f64;
                [re + field(i) * phase.cos(), im + field(i) * phase.sin()]
            })
        };
        let factor = 2.0 / (TAU / 10.0 * f64::from(k).hypot(f64::from(l)));
        let (moved, pressed) = (wave(&|i| first[i] + other[i]), wave(&|i| factor * stress[i]));
        let size = pressed[0].hypot(pressed[1]);
        assert!((moved[0] - pressed[0]).hypot(moved[1] - pressed[1]) < 1e-5 * size, "{k} {l}: {moved:?} {pressed:?}");
    }
    for i in 0..N * N {
        assert!((first[i] - other[i]).abs() < 1e-15 && (first[i] + other[i] - (change[i] - mean)).abs() < 1e-12, "{i}");
    }
}

/// Two waves along x in phase, of which one is given in nm on half as many points: Westergaard's wave of the sum of their amplitudes
/// (Johnson, Contact Mechanics, 1985, sec. 13.2).
#[test]
fn two_waves_are_westergaards() {
    const POINTS: usize = 512;
    let files = Scratch::new();
    let wave = |n: usize, amplitude: f64| move |x: usize, _| amplitude * (TAU * x as f64 / n as f64).cos();
    let first = files.map("um.npy", [POINTS, 6], wave(POINTS, 0.03));
    let other = files.map("nm.npy", [POINTS / 2, 3], wave(POINTS / 2, 20.0));
    let full_contact = PI * 0.05 / 10.0;
    let pressure = (0.25 * full_contact).to_string() + "GPa";
    // Pixels of the other one are square.
    let extents = ["--length", "10um", "--length-y", "0.1171875um", "--unit", "um", "--touching", "high-points"];
    let of_other = ["--other", &other, "--other-unit", "nm", "--other-length", "10um"];
    let flags = [&[&first[..], "--body", "1GPa,0", "--pressure", &pressure], &extents[..], &of_other].concat();
    let [state] = &states(&flags)[..] else { panic!("one load") };
    // p = p* sin²(π A/2), A = 1/3.
    let area = number(state, "contact_nodes");
    assert!((area - 1.0 / 3.0).abs() < 1.5 / POINTS as f64, "{area}");
}

/// Maps that do not repeat: the common part, at the nodes of the first, then mirrored. A force acts on the part that was measured.
#[test]
fn patches_are_added_where_they_lie_on_each_other() {
    let files = Scratch::new();
    let (first, other) = (
        |x: usize, y: usize| 0.01 * (x * x + y) as f64 % 0.7,
        |x: usize, y: usize| 0.02 * ((3 * x + y * y) % 11) as f64,
    );
    files.map("first.npy", [20, 16], first);
    files.map("other.npy", [20, 16], other);
    // The other one, face down and shifted by 4 and -3 points, and the part that both have.
    files.map("sum.npy", [16, 13], |x, y| first(x + 4, y) + other(19 - x, y + 3));
    let scene = |surface: &str| {
        format!(
            "name = \"two\"\n[laboratory]\nlength = \"LENGTH\"\nmodulus = \"2 GPa\"\n[load]\nforce = \"5 nN\"\n[surface]\nunit = \"nm\"\ntouching = \
             \"low-points\"\nedges = \"mirror\"\n{surface}"
        )
    };
    let two = "heights = \"first.npy\"\n[surface.other]\nheights = \"other.npy\"\nshift = [\"4 nm\", \"-3 nm\"]\n";
    fs::write(files.path("two.toml"), scene(two).replace("LENGTH", "20 nm")).expect("written");
    fs::write(files.path("sum.toml"), scene("heights = \"sum.npy\"\n").replace("LENGTH", "16 nm")).expect("written");
    let run = |name: &str| {
        let scene = files.path(&format!("{name}.toml"));
        let out = files.path(name);
        let found = asperity().args(["run", "--out"]).arg(&out).arg(&scene).output().expect("started");
        assert!(found.status.success(), "{}", stderr(&found));
        let text = fs::read_to_string(out.join("results.json")).expect("results");
        (serde_json::from_str::<Value>(&text).expect("JSON"), stderr(&found))
    };
    let ((two, _), (sum, _)) = (run("two"), run("sum"));
    let loads = |results: &Value| results["continuum"]["states"][0].clone();
    for key in ["p_star", "contact_area", "mean_gap"] {
        let [a, b] = [&two, &sum].map(|results| number(&loads(results), key));
        assert!(a > 0.0 && (a / b - 1.0).abs() < ROUNDING, "{key}: {a} {b}");
    }
    let of_file = &two["surface"]["provenance"];
    let steps: Vec<&str> = of_file["preparation"].as_array().expect("steps").iter().filter_map(Value::as_str).collect();
    assert!(
        steps.iter().any(|s| s.contains("turned over, shifted by 4e-3 x -3e-3 um, 16 x 13 points on 0.65 of")),
        "{steps:?}"
    );
    assert!(of_file["other"]["file"].as_str().is_some_and(|f| f.ends_with("other.npy")), "{of_file}");
    // Another map at the same place is another problem.
    files.map("other.npy", [20, 16], |x, y| 1.2 * other(x, y));
    let (again, _) = run("two");
    assert_ne!(number(&loads(&again), "contact_area"), number(&loads(&two), "contact_area"));
}

/// Steps of preparation change a map as they do alone, whichever of the two bodies it is of; a flat one adds nothing. Profiles are added, too.
#[test]
fn a_flat_body_adds_nothing() {
    let files = Scratch::new();
    let ramp = |x: usize, y: usize| 0.1 * x as f64 + if (x * y).is_multiple_of(3) { 0.2 } else { 0.0 };
    let map = files.map("map.npy", [40, 40], ramp);
    let flat = files.map("flat.npy", [40, 40], |_, _| 0.0);
    let shared = [
        "--touching",
        "high-points",
        "--length",
        "40",
        "--modulus",
        "1",
        "--pressure",
        "0.01",
        "--other-turned-over",
        "false",
    ];
    for steps in [
        &["--non-periodic", "--low-pass", "8"][..],
        &["--detrend", "plane", "--edges", "mirror", "--resample", "20,20"],
    ] {
        let alone = states(&[&[&map[..]], &shared[..8], steps].concat());
        for (first, other) in [(&map, &flat), (&flat, &map)] {
            let pair = states(&[&[&first[..], "--other", other], &shared[..], steps].concat());
            for key in ["contact_area", "mean_gap", "stiffness"] {
                let (a, b) = (number(&pair[0], key), number(&alone[0], key));
                assert!((a / b - 1.0).abs() < ROUNDING, "{steps:?} {key}: {a} {b}");
            }
        }
    }
    let line = |name: &str, n: usize, height: f64| {
        let wave = |x: usize| height * (TAU * x as f64 / n as f64).cos();
        files.map(name, [n, 1], move |x, _| wave(x))
    };
    let (whole, half, coarse) = (line("a.npy", 64, 0.3), line("b.npy", 64, 0.15), line("c.npy", 32, 0.15));
    let usual = ["--profile", "--touching", "high-points", "--length", "10", "--modulus", "1", "--pressure", "0.01"];
    let alone = states(&[&[&whole[..]], &usual[..]].concat());
    for other in [&half, &coarse] {
        let pair = states(&[&[&half[..], "--other", other, "--other-length", "10"], &usual[..]].concat());
        let (a, b) = (number(&pair[0], "mean_gap"), number(&alone[0], "mean_gap"));
        assert!((a / b - 1.0).abs() < ROUNDING, "{a} {b}");
    }
}

#[test]
fn bodies_that_do_not_fit_are_refused() {
    let files = Scratch::new();
    let map = files.map("map.npy", [N, N], rough);
    let small = files.map("small.npy", [N / 2, N / 2], rough);
    let usual = ["--touching", "high-points", "--length", "10", "--pressure", "0.01"];
    for (flags, words) in [
        (vec!["--modulus", "1", "--other", "absent.npy"], "--other"),
        (vec!["--modulus", "1", "--other", &small], "--other-length = not given"),
        (vec!["--modulus", "1", "--other", &small, "--other-length", "5"], "--other-length = a cell of 5 x 5"),
        (
            vec!["--modulus", "1", "--other", &map, "--other-quarter-turns", "5"],
            "--other-quarter-turns = 5; accepted: 0, 1, 2 or 3",
        ),
        (vec!["--modulus", "1", "--other", &map, "--other-shift", "3"], "two: DX,DY"),
        (vec!["--modulus", "1", "--other", &map, "--other-shift", "11,0", "--non-periodic"], "0 x 48 points in common"),
        (vec!["--modulus", "1", "--other-shift", "1,1"], "only together with --other"),
        (vec!["--modulus", "1", "--other-quarter-turns", "1"], "only together with --other"),
        (vec!["--body", "1,0.3", "--modulus", "1"], "cannot be used with"),
        (vec!["--body", "1,0.3", "--body", "1,0.3", "--body", "1,0.3"], "--body = 3 bodies; accepted: one or two"),
        (vec!["--body", "1,0.6"], "a Poisson's ratio from 0 to 0.5"),
        (vec!["--body", "1GPa,0.3", "--body", "2,0.3"], "all values have units"),
        (vec!["--body", "1,0.3", "--thickness", "2"], "coating"),
        (vec!["--body", "1,0.3,0.1", "--hardness", "0.1"], "one of the two"),
        (vec!["--body", "1"], "E,NU"),
    ] {
        let refused = solve(&[&[&map[..]], &usual[..], &flags].concat());
        let said = stderr(&refused);
        assert!(refused.status.code() == Some(2) && said.contains(words), "{flags:?}: {said}");
    }
}
