//! The program with extreme input: units of any size, maps of any size, invalid files.
//!
//! `evidence/extremes.md` lists all cases and their results.

use crate::flags::dimensionless;
use crate::program::{asperity, json_line, stderr};
use asperity::surface::files::npy;
use std::io::Write;
use std::path::Path;
use std::process::Output;

fn solve(file: &Path, more: &[&str]) -> Output {
    let flags = [&["solve", "--json", "--heights", file.to_str().expect("UTF-8")], more].concat();
    asperity().args(dimensionless(&flags)).output().expect("started")
}

fn challenge(n: &str, more: &[&str]) -> Output {
    asperity().args(["solve", "--pressure", "0.01", "--challenge", n]).args(more).output().expect("started")
}

/// The command fails with this exit code and one line on standard error that contains `says`.
fn refused(output: &Output, code: i32, says: &str) {
    let said = stderr(output);
    assert_eq!(output.status.code(), Some(code), "{said}");
    assert_eq!(said.trim_end().lines().count(), 1, "{said}");
    assert!(said.starts_with("asperity: error: ") && said.contains(says), "{said} lacks {says}");
}

/// Lengths and stresses in units from 1e-12 to 1e12 of the others give the same contact in the same iterations.
#[test]
fn units_of_any_size() {
    /// Scaled inputs are rounded differently; the solutions are equal apart from rounding.
    const ROUNDING: f64 = 1e-10;
    let scratch = tempfile::tempdir().expect("scratch");
    let (n, file) = (48, scratch.path().join("h.npy"));
    let wave = |x: f64, y: f64| (6.3 * x).sin() * (12.6 * y).cos() + 0.3 * (25.1 * (x + y)).cos();
    let run = |length: f64, stress: f64, precision: &str| {
        let at = |i: usize| wave((i % n) as f64 / n as f64, (i / n) as f64 / n as f64);
        npy::write(&file, n, n, (0..n * n).map(|i| 0.02 * length * at(i))).expect("written");
        let values = [length, stress, 0.02 * stress, 1e-4 * length * stress, 0.01 * length].map(|v| format!("{v:e}"));
        let flags = ["--length", "--modulus", "--pressure", "--gamma", "--rho"];
        let mut arguments: Vec<&str> = flags.iter().zip(&values).flat_map(|(f, v)| [*f, v.as_str()]).collect();
        arguments.extend(["--precision", precision]);
        let output = solve(&file, &arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        let answer = json_line(&output);
        let units = [1.0, length, length * stress, length * stress, 1.0 / length];
        let keys = ["contact_area", "mean_gap", "energy", "interaction_energy", "perimeter"];
        let number = |key: &str| answer[key].as_f64().expect("a number");
        keys.iter().zip(units).map(|(key, unit)| number(key) / unit).collect::<Vec<f64>>()
    };
    for precision in ["f64", "f32"] {
        let reduced = run(1.0, 1.0, precision);
        for (length, stress) in [(1e12, 1e-12), (1e-12, 1e12), (1e12, 1e12), (1e-12, 1e-12)] {
            for (found, expected) in run(length, stress, precision).into_iter().zip(&reduced) {
                // In f32 the different rounding leads to other iterates, and the solve stops at 1e-3 of the pressure.
                let bound = if precision == "f32" { 1e-4 } else { ROUNDING };
                assert!(
                    (found / expected - 1.0).abs() < bound,
                    "{precision} {length:e} {stress:e}: {found} {expected}"
                );
            }
        }
    }
}

/// Grids of the challenge's surface that are too large for any machine or invalid: a one-line error with the largest
/// grid that fits.
#[test]
fn grids_beyond_the_memory_are_refused_with_what_fits() {
    for n in ["0", "1048577", "5000000000", "18446744073709551615"] {
        refused(&challenge(n, &[]), 2, "accepted: 1 to 1048576 points per side");
    }
    for (method, n) in ["fast", "bvm", "gfmd"].into_iter().flat_map(|m| [(m, 65_536usize), (m, 1 << 20)]) {
        // At least the memory of fields and spectrum.
        if asperity::grid::sys::available_memory_bytes() > 24 * (n * n) as u64 {
            println!("not tested: this machine has the memory");
            continue;
        }
        let output = challenge(&n.to_string(), &["--cut-off", "0.02", "--method", method]);
        refused(&output, 5, " points fit, with --precision f32 ");
        let said = stderr(&output);
        let fits: Vec<usize> = said.split(" x ").skip(1).filter_map(|w| w.split(' ').next()?.parse().ok()).collect();
        assert!(fits.len() == 2 && 1000 < fits[0] && fits[0] < fits[1] && fits[1] < n, "{method}: {said}");
    }
    // A valid sparse file of more than 2^31 points is refused before it is read.
    let scratch = tempfile::tempdir().expect("scratch");
    let file = scratch.path().join("large.npy");
    let points = 1u64 << 34;
    if asperity::grid::sys::available_memory_bytes() < 8 * points {
        let header = format!("{{'descr': '|u1', 'fortran_order': False, 'shape': ({0}, {0}), }}", 1 << 17);
        let mut map = std::fs::File::create(&file).expect("made");
        map.write_all(b"\x93NUMPY\x01\x00\x76\x00").expect("written");
        map.write_all(format!("{header:117}\n").as_bytes()).expect("written");
        map.set_len(128 + points).expect("a file with a hole");
        refused(&solve(&file, &["--pressure", "0.01"]), 5, "large.npy needs 137.44 GB of memory");
    }
}

/// Invalid spectra are refused; the unresolved part of a spectrum is reported.
#[test]
fn cut_offs_of_the_challenge() {
    let (short, long) = ("a wavelength of at least 1e-4 of the cell", "no longer than the roll-off wavelength");
    for (cut_off, accepted) in
        [("0", short), ("-1", short), ("nan", short), ("1e-5", short), ("inf", long), ("0.21", long), ("2", long)]
    {
        refused(&challenge("32", &["--cut-off", cut_off]), 2, accepted);
    }
    let (coarse, held) = (challenge("32", &["--cut-off", "0.02"]), challenge("128", &["--cut-off", "0.02"]));
    assert!(coarse.status.success() && held.status.success());
    let said = stderr(&coarse);
    assert!(
        said.contains("warning  the grid of 32² points does not resolve λ_s") && said.contains("is resolved"),
        "{said}"
    );
    assert!(!stderr(&held).contains("warning"), "{}", stderr(&held));
    // A single wavelength, and a single pixel.
    for (n, cut_off) in [("64", "0.2"), ("1", "0.2"), ("2", "0.2"), ("3", "0.2")] {
        assert!(challenge(n, &["--cut-off", cut_off]).status.success(), "{n}");
    }
}

/// Files that contain no map.
#[test]
fn maps_that_are_none() {
    let scratch = tempfile::tempdir().expect("scratch");
    let solve = |name: &str, contents: &[u8], more: &[&str]| {
        let file = scratch.path().join(name);
        std::fs::write(&file, contents).expect("written");
        solve(&file, &[&["--pressure", "0.01"], more].concat())
    };
    for (name, contents, says) in [
        ("empty.txt", &b""[..], "no heights"),
        ("empty.npy", b"", "no heights"),
        ("comment.txt", b"# nothing\n", "no heights"),
        ("header.npy", b"\x93NUMPY\x01\x00", "a .npy file"),
        ("ragged.txt", b"1 2\n3\n", "1 heights on line 2; accepted: 2"),
        ("nan.txt", b"1 2\n3 nan\n", "1 of 4 points were not measured, the first in row 2, column 2"),
        ("infinite.txt", b"1 2\n-inf 3\n", "\"-inf\" on line 2, column 1"),
        ("overflow.txt", b"1 1e400\n2 3\n", "\"1e400\" on line 1, column 2"),
        ("word.txt", b"1 two\n", "\"two\" on line 1, column 2"),
        ("far.txt", b"1e308 -1e308\n0 0\n", "heights from -1e308 to 1e308"),
    ] {
        refused(&solve(name, contents, &[]), 2, says);
    }
    // Heights in their own unit, in which rounding hides so small a load.
    let output = solve("large.txt", b"1e200 0\n0 0\n", &[]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("pressure = 0.01; accepted: at least"), "{}", stderr(&output));
    // In a suitable length unit they are valid heights; the smallest doubles are flat.
    for (heights, length) in
        [(&b"1e200 0\n0 0\n"[..], "1e200"), (b"1e-310 0\n0 0\n", "1"), (b"5\n", "1"), (b"5 5 5\n", "1")]
    {
        let output = solve("fits.txt", heights, &["--length", length]);
        assert!(output.status.success() && json_line(&output)["energy"].is_f64(), "{}", stderr(&output));
    }
    for flag in ["--length", "--length-y", "--modulus", "--pressure", "--range", "--thickness"] {
        // A pressure of zero is first contact.
        for value in ["0", "-1", "nan", "inf"].into_iter().filter(|value| (flag, *value) != ("--pressure", "0")) {
            let mut more = if flag == "--pressure" { vec![] } else { vec!["--pressure", "0.01"] };
            more.extend(if flag == "--range" { vec!["--gamma", "1e-3"] } else { vec![] });
            let file = scratch.path().join("fits.txt");
            refused(&self::solve(&file, &[&more[..], &[flag, value]].concat()), 2, &format!("{flag} = "));
        }
    }
}

/// Ranges down to 1e-300 L give finite results, with a warning if the grid does not resolve the adhesion.
#[test]
fn ranges_that_no_grid_resolves_are_warned_of() {
    let scratch = tempfile::tempdir().expect("scratch");
    let (n, file) = (32, scratch.path().join("h.npy"));
    let wave = |i: usize| (std::f64::consts::TAU * i as f64 / n as f64).cos();
    npy::write(&file, n, n, (0..n * n).map(|i| 0.05 * wave(i % n) * wave(i / n))).expect("written");
    for rho in ["1e-300", "1e-5", "0.003"] {
        let output = solve(&file, &["--pressure", "0.02", "--gamma", "1e-3", "--rho", rho]);
        assert!(output.status.success(), "{rho}: {}", stderr(&output));
        assert!(stderr(&output).contains("does not resolve the adhesion"), "{}", stderr(&output));
        let answer = json_line(&output);
        assert!(answer["cohesive_resolution"].as_f64().is_some_and(|c| c < 1.4), "{answer}");
        assert!(["energy", "mean_gap", "interaction_energy"].iter().all(|k| answer[*k].is_f64()), "{answer}");
    }
    for (rho, warning) in
        [("0.01", None), ("1", None), ("20", Some("range of the adhesion, 20, is longer than the cell, 1: "))]
    {
        let output = solve(&file, &["--pressure", "0.02", "--gamma", "1e-3", "--rho", rho]);
        let said = stderr(&output);
        assert!(output.status.success() && said.contains("warning") == warning.is_some(), "{said}");
        assert!(warning.is_none_or(|text| said.contains(text)), "{said}");
    }
}

/// The residual of a light load is met before the load is: the message names what is not.
#[test]
fn a_load_that_rounding_hides_is_named() {
    let flags = ["solve", "--json", "--challenge", "128", "--p-star", "1e-6", "--method", "gfmd"];
    let done = asperity().args(flags).output().expect("started");
    let said = stderr(&done);
    assert_eq!(done.status.code(), Some(3), "{said}");
    assert!(said.contains("rounding floor of the precision, load error "), "{said}");
}
