//! Surfaces from files of other programs (`fixtures/make.py`): all formats give the same heights. Damaged, ambiguous
//! and unsupported files are refused in one line with exit code 2.

use crate::program::{asperity, json_line, stderr};
use asperity::surface::files::npy;
use asperity::surface::import::{self, Content, Fourier, ImportOptions};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::process::Output;

const NX: usize = 6;
const NY: usize = 4;

/// The surface of `make.py` at node (x, y).
fn height(x: usize, y: usize) -> f64 {
    let (u, v) = (TAU * x as f64 / NX as f64, TAU * y as f64 / NY as f64);
    1.0 + 0.5 * u.cos() - 0.25 * (u + v).sin() + 0.125 * (2.0 * u).sin()
}

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

/// Unit and length for files that do not declare them, unless the flags have them.
fn defaults(flags: &[&str]) -> Vec<&'static str> {
    let unit: &[&str] = if flags.contains(&"--unit") { &[] } else { &["--unit", "um"] };
    let length: &[&str] = if flags.contains(&"--length") { &[] } else { &["--length", "100um"] };
    [unit, length].concat()
}

/// `surface` of a file on 100 µm, with heights in µm unless the flags say otherwise.
fn surface(name: &str, flags: &[&str]) -> Output {
    asperity()
        .arg("surface")
        .arg(fixture(name))
        .args(["--touching", "low-points"])
        .args(defaults(flags))
        .args(flags)
        .output()
        .expect("started")
}

/// Rounding of the formats: double, float, and integers in units of a thousandth.
const DOUBLE: f64 = 1e-11;
const SINGLE: f64 = 1e-6;
const THOUSANDTHS: f64 = 5.1e-4;

#[test]
fn every_format_gives_the_same_heights() {
    for (name, dataset, tolerance, says) in [
        ("plain.h5", None, DOUBLE, "HDF5 data set surface [ny, nx]"),
        ("chunked.h5", None, SINGLE, "HDF5 data set surface [ny, nx]"),
        ("big-endian.h5", None, DOUBLE, "HDF5 data set deep/any-name [ny, nx]"),
        ("usual-name.h5", None, DOUBLE, "HDF5 data set surface [ny, nx]"),
        ("several.h5", Some("first"), DOUBLE, "HDF5 data set first [ny, nx]"),
        ("matlab.mat", None, DOUBLE, "MATLAB matrix h, one row per y"),
        ("matlab-two.mat", Some("a"), DOUBLE, "MATLAB matrix a, one row per y"),
        ("surfacetopography.nc", None, DOUBLE, "NetCDF variable heights [nx, ny], the first index is x"),
        ("netcdf4-xy.nc", None, DOUBLE, "HDF5 data set heights [nx, ny], the first index is x"),
        ("netcdf4-yx.nc", None, DOUBLE, "HDF5 data set heights [ny, nx]"),
        ("stored.npz", None, DOUBLE, ".npz array heights [ny, nx]"),
        ("deflated.npz", None, SINGLE, ".npz array a [ny, nx]"),
        ("several.npz", Some("b"), DOUBLE, ".npz array b [ny, nx]"),
        ("matrix.txt", None, DOUBLE, "text, one line per y"),
        ("triples.txt", None, DOUBLE, "text, lines of x y h"),
        ("konfig.dat", None, DOUBLE, "konfig of contMech, lines of x y h"),
    ] {
        let found = import::read(&fixture(name), ImportOptions { dataset, ..ImportOptions::default() }).expect(name);
        assert_eq!(found.layout, says, "{name}");
        let Content::Map(map) = found.content else { panic!("{name}") };
        assert_eq!((map.nx, map.ny), (NX, NY), "{name}");
        for (i, h) in map.heights.iter().enumerate() {
            let exact = height(i % NX, i / NX);
            assert!((h - exact).abs() < tolerance, "{name}: {h} at {i}, not {exact}");
        }
    }
}

#[test]
fn integers_are_the_numbers_of_their_file() {
    let found = import::read(&fixture("integers.h5"), ImportOptions::default()).expect("read");
    let Content::Map(map) = found.content else { panic!("a map") };
    let off = |(i, h): (usize, &f64)| (h / 1000.0 - height(i % NX, i / NX)).abs();
    assert!(map.heights.iter().enumerate().map(off).fold(0.0, f64::max) < THOUSANDTHS);
}

/// MATLAB's vectors x and y give the extent; without them it is required. Two matrices, and files that end early, are refused.
#[test]
fn matlab_files_are_read_or_refused() {
    let read = |name: &str| import::read(&fixture(name), ImportOptions::default());
    let extent = read("matlab.mat").expect("read").declared.extent.expect("coordinates");
    assert_eq!((extent.x, extent.y), (12.0, 8.0));
    let two = read("matlab-two.mat").expect_err("two matrices").to_string();
    assert!(two.contains("2 two-dimensional arrays (a of ") && two.contains("--dataset"), "{two}");
    let cut = read("truncated.mat").expect_err("cut").to_string();
    assert!(cut.contains("bytes, damaged: its header states"), "{cut}");
}

/// Heights stored as two-byte integers with scale and offset are restored.
#[test]
fn packed_heights_are_scaled_and_shifted() {
    for (name, unit) in [("packed.nc", Some("um")), ("packed4.nc", None), ("packed.h5", None)] {
        let found = import::read(&fixture(name), ImportOptions::default()).expect(name);
        assert_eq!(found.declared.unit.as_deref(), unit, "{name}");
        let Content::Map(map) = found.content else { panic!("{name}") };
        assert_eq!((map.nx, map.ny), (NX, NY), "{name}");
        let off = |(i, h): (usize, &f64)| (h - height(i % NX, i / NX)).abs();
        assert!(map.heights.iter().enumerate().map(off).fold(0.0, f64::max) < THOUSANDTHS, "{name}");
    }
}

/// Circular links are followed once, with and without a dataset name.
#[test]
fn links_in_circles_come_to_an_end() {
    for dataset in [None, Some("deep/surface"), Some("/deep/hard3/soft1/deep/surface")] {
        let found =
            import::read(&fixture("circles.h5"), ImportOptions { dataset, ..ImportOptions::default() }).expect("read");
        let Content::Map(map) = found.content else { panic!("a map") };
        assert!((map.heights[1] - height(1, 0)).abs() < DOUBLE);
    }
}

/// The surface of the fixtures' coefficients, with the lowest node of the grid at 0.
fn waves(n: usize) -> Vec<f64> {
    let at = |i: usize| {
        let (u, v) = (TAU * (i % n) as f64 / n as f64, TAU * (i / n) as f64 / n as f64);
        0.5 * u.cos() - 0.25 * (u + v).sin() + 0.125 * (2.0 * u - 3.0 * v).sin()
    };
    let heights: Vec<f64> = (0..n * n).map(at).collect();
    let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
    heights.iter().map(|h| h - low).collect()
}

/// Heights on the grid of the coefficients, on a finer one, and on the smallest one that resolves them; heights are in
/// µm.
#[test]
fn coefficients_give_heights_on_any_grid() {
    let scratch = tempfile::tempdir().expect("scratch");
    let out = scratch.path().join("h.npy");
    let out = out.to_str().expect("UTF-8");
    let series: &[&str] = &["--fourier", "series"];
    let fftw: &[&str] = &["--fourier", "fftw", "--fourier-points", "8"];
    for (name, flags) in [("series.dat", series), ("half.dat", series), ("fourier.h5", series), ("fftw.dat", fftw)] {
        for n in ["8", "7", "12"] {
            let output = surface(name, &[flags, &["--grid", n, "--out", out, "--json"]].concat());
            assert!(output.status.success(), "{name}: {}", stderr(&output));
            let said = json_line(&output);
            let origin = said["origin"].as_str().expect("words");
            assert!(origin.contains("h(r) = Σ a exp(iq·r)") && origin.contains("low points touch first"), "{origin}");
            let found = npy::read(Path::new(out)).expect("written").values;
            let exact = waves(n.parse().expect("a number"));
            assert_eq!(found.len(), exact.len());
            let off = found.iter().zip(&exact).map(|(f, e)| (f - e).abs()).fold(0.0, f64::max);
            assert!(off < 1e-12, "{name} on {n}: {off:e}");
        }
    }
    // Only wavelengths of at least 0.9 L remain: cos u.
    let output = surface("series.dat", &["--fourier", "series", "--low-pass", "90um", "--grid", "4", "--out", out]);
    assert!(output.status.success(), "{}", stderr(&output));
    let cosine = npy::read(Path::new(out)).expect("written").values;
    assert!(cosine[..4].iter().zip([1.0, 0.5, 0.0, 0.5]).all(|(f, e)| (f - e).abs() < 1e-12), "{cosine:?}");
}

/// With `high-points` in contact a written map has the same heights, and declares the sign.
#[test]
fn coefficients_are_turned_with_their_sign() {
    let scratch = tempfile::tempdir().expect("scratch");
    let out = scratch.path().join("h.npy");
    let mut command = asperity();
    command.arg("surface").arg(fixture("series.dat")).args(["--touching", "high-points", "--fourier", "series"]);
    command.args(["--unit", "um", "--length", "100"]);
    let output = command.args(["--grid", "8", "--out"]).arg(&out).output().expect("started");
    assert!(output.status.success(), "{}", stderr(&output));
    let (found, upright) = (npy::read(&out).expect("written").values, waves(8));
    let sidecar = std::fs::read_to_string(scratch.path().join("h.npy.json")).expect("a sidecar");
    assert!(sidecar.contains("high points touch first"), "{sidecar}");
    // The written map keeps the sign of its file; its lowest point is at 0.
    let low = upright.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(found.iter().zip(&upright).all(|(f, u)| (f - (u - low)).abs() < 1e-12));
}

/// `solve` gives the same result for coefficients and for the heights from which NumPy computed them.
#[test]
fn solving_on_coefficients_is_solving_on_their_heights() {
    let solved = |name: &str, flags: &[&str]| {
        let common = ["--pressure", "0.2", "--json"];
        let dimensionless = ["--length", "1", "--modulus", "1", "--touching", "low-points"];
        let mut command = asperity();
        command.arg("solve").arg(fixture(name)).args(common).args(dimensionless).args(flags);
        let output = command.output().expect("started");
        assert!(output.status.success(), "{name}: {}", stderr(&output));
        json_line(&output)
    };
    let waves = solved("series.dat", &["--fourier", "series", "--grid", "8"]);
    let map = solved("square.npy", &[]);
    assert_eq!(waves["nx"], 8);
    for key in ["contact_area", "mean_gap"] {
        let [a, b] = [&waves, &map].map(|v| v[key].as_f64().expect("a number"));
        assert!((a - b).abs() < 1e-6 * b.abs().max(1e-3), "{key}: {a} and {b}");
    }
}

/// A scene with coefficients keeps their unit, sign and grid in the results.
#[test]
fn a_scene_takes_coefficients() {
    let scratch = tempfile::tempdir().expect("scratch");
    let scene = scratch.path().join("waves.toml");
    let file = fixture("fftw.dat");
    let text = format!(
        "name = \"waves\"\n[laboratory]\nlength = \"100 um\"\nmodulus = \"25 MPa\"\n[surface]\nheights = {file:?}\nunit = \"0.5 um\"\ntouching = \"low-points\"\n\
         fourier = \"fftw\"\nfourier_points = 8\ngrid = 16\n[load]\np_star = [0.05]\n"
    );
    std::fs::write(&scene, text).expect("written");
    let out = scratch.path().join("run");
    let output = asperity().arg("run").arg(&scene).arg("--out").arg(&out).output().expect("started");
    assert!(output.status.success(), "{}", stderr(&output));
    let stored = npy::read(&out.join("surface/heights.npy")).expect("heights").values;
    // In units of the cell, 100 µm.
    assert!(stored.iter().zip(waves(16)).all(|(f, e)| (f * 200.0 - e).abs() < 1e-12));
}

/// Exit code 2 and one line that names the file or the flag and the accepted values.
fn refused(output: &Output, names: &str, pieces: &[&str]) {
    let said = stderr(output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert_eq!(said.trim_end().lines().count(), 1, "{said}");
    assert!(output.stdout.is_empty() && said.contains("; accepted: ") && said.contains(names), "{said}");
    pieces.iter().for_each(|p| assert!(said.contains(p), "{said:?} lacks {p:?}"));
}

/// Fill values of all types, NetCDF's own included, mask variables and NaN are missing heights.
#[test]
fn heights_that_were_not_measured_are_missing() {
    for (name, row, column) in [
        ("holes.nc", 1, 4),
        ("unwritten-f4.nc", 2, 3),
        ("unwritten-f8.nc", 2, 3),
        ("unwritten-i2.nc", 2, 3),
        ("unwritten-i4.nc", 2, 3),
        ("unwritten4-f4.nc", 2, 3),
        ("fill-i1.nc", 2, 3),
        ("fill-i2.nc", 2, 3),
        ("fill-u4.nc", 2, 3),
        ("fill-i8.nc", 2, 3),
        ("nan.h5", 2, 5),
    ] {
        let found = import::read(&fixture(name), ImportOptions::default()).expect(name);
        let Content::Map(map) = found.content else { panic!("{name}") };
        assert_eq!((map.missing(), map.first_missing()), (1, Some([row, column])), "{name}");
    }
}

#[test]
fn what_is_damaged_or_ambiguous_is_refused() {
    let series: &[&str] = &["--fourier", "series", "--grid", "8"];
    for (name, flags, pieces) in [
        ("several.h5", &[][..], &["2 two-dimensional arrays (first of ", "--dataset"][..]),
        ("several.h5", &["--dataset", "third"], &["named \"third\"", "accepted: first of ", ", second of "]),
        ("several.npz", &[], &["2 two-dimensional arrays (a of ", "--dataset"]),
        ("cube.h5", &[], &["2 two-dimensional arrays (surface[0] of 3 x 4, surface[1] of 3 x 4)", "--dataset"]),
        ("complex.h5", &[], &["no two-dimensional array of numbers"]),
        ("line.npz", &[], &["no two-dimensional array of numbers"]),
        ("lzf.h5", &[], &["filter"]),
        ("truncated.h5", &[], &["damaged"]),
        ("truncated.nc", &[], &["damaged"]),
        (
            "holes.nc",
            &["--length", "6"],
            &["1 of 24 points were not measured, the first in row 2, column 5 (counted from 1)"],
        ),
        ("nan.h5", &[], &["1 of 24 points were not measured, the first in row 3, column 6 (counted from 1)"]),
        ("packed-words.nc", &[], &["scale_factor of heights = \"0.001\"", "one finite number"]),
        ("circles.h5", &["--dataset", "deep/hard0/none"], &["named \"deep/hard0/none\"", "accepted: deep/surface"]),
        ("large-chunk.h5", &[], &["in chunks of 8192x8192 (536870912 bytes)", "h5repack -l surface:CHUNK=4x6"]),
        ("plain.h5", &["--grid", "8"], &["--grid = 8", "is a height map"]),
        ("square.npy", &["--dataset", "a"], &["without names"]),
        ("series.dat", &[], &["qX qY Re Im, or a map 4 points wide", "--fourier"]),
        ("fourier.h5", &[], &["qX qY Re Im, or a map 4 points wide", "--fourier"]),
        ("plain.h5", series, &["[4, 6] numbers", "four columns qX qY Re Im"]),
        ("square.npy", series, &["[8, 8] numbers", "four columns qX qY Re Im"]),
        ("konfig.dat", series, &["[4, 6] numbers", "four columns qX qY Re Im"]),
        ("triples.txt", series, &["3 numbers on line 1", "four, qX qY Re Im"]),
        ("contradiction.dat", series, &["q = (-1, -1) and (1, 1) that contradict"]),
        ("series.dat", &["--fourier", "series", "--grid", "6"], &["--grid = 6", "at least 7"]),
        ("series.dat", &["--fourier", "fftw"], &["--fourier-points = not given"]),
        ("series.dat", &["--fourier", "series", "--fourier-points", "8"], &["--fourier-points = 8"]),
        ("fftw.dat", &["--fourier", "fftw", "--fourier-points", "6", "--grid", "8"], &["q = (2, -3)", "half of the 6"]),
        ("plain.h5", &["--low-pass", "3um"], &["accepted: 33.3", "--low-pass = 3", "2 points"]),
    ] {
        let about = if pieces[0].starts_with("--") { "command line" } else { name };
        refused(&surface(name, flags), about, pieces);
    }
    let solve = |flags: &[&str]| {
        asperity()
            .arg("solve")
            .arg(fixture("series.dat"))
            .args(["--pressure", "1", "--length", "1", "--modulus", "1", "--touching", "low-points"])
            .args(flags)
            .output()
            .expect("started")
    };
    refused(&solve(&["--fourier", "series"]), "--grid", &["not given", "at least 7"]);
    refused(&solve(&["--grid", "8"]), "--grid", &["is a height map with points of its own"]);
    refused(&solve(&["--fourier", "fftw", "--grid", "8"]), "--fourier-points", &["not given"]);
    let challenge = ["solve", "--challenge", "16", "--pressure", "1", "--cut-off", "0.2", "--fourier", "series"];
    refused(&asperity().args(challenge).output().expect("started"), "--fourier", &["only together with a file"]);
}

/// Invalid text files, each created by one change in a valid file.
#[test]
fn text_that_is_spoilt_is_refused_with_its_line() {
    let scratch = tempfile::tempdir().expect("scratch");
    let path = scratch.path().join("spoilt.dat");
    let spoil = |name: &str, from: &str, to: &str, flags: &[&str], pieces: &[&str]| {
        let text = std::fs::read_to_string(fixture(name)).expect("text");
        assert!(text.contains(from), "{name} lacks {from:?}");
        std::fs::write(&path, text.replacen(from, to, 1)).expect("written");
        let mut command = asperity();
        let output = command
            .arg("surface")
            .arg(&path)
            .args(["--touching", "low-points"])
            .args(defaults(flags))
            .args(flags)
            .output()
            .expect("started");
        refused(&output, "spoilt.dat", pieces);
    };
    let series: &[&str] = &["--fourier", "series", "--grid", "8"];
    spoil("series.dat", "1 0 2.5", "1 0.5 2.5", series, &["qY = 0.5 on line 2", "whole numbers"]);
    spoil("series.dat", "2.5000000000000000e-01", "nan", series, &["Re = NaN on line 2", "finite"]);
    spoil("series.dat", "2.5000000000000000e-01", "oak", series, &["\"oak\" on line 2, column 3"]);
    spoil("series.dat", "1 0 2.5000000000000000e-01", "1 0", series, &["3 numbers on line 2", "cut off"]);
    spoil("series.dat", "1 0 ", "99999 0 ", series, &["qX = 99999 on line 2", "32768"]);
    spoil("series.dat", "-1 0 ", "1 0 ", series, &["q = (1, 0) twice"]);
    spoil("konfig.dat", "#6 4", "#4 6", &[], &["7 x 5 points after the header #4 6", "5 x 7"]);
    spoil("konfig.dat", "#6 4\n0\t0\t1.5\n", "#6 4\n", &[], &["34 of 35 points"]);
    spoil("matrix.txt", "1.500000000000000000e+00 ", "", &[], &["6 heights on line 2", "5, as on the lines before"]);
    spoil("matrix.txt", "1.500000000000000000e+00", "nought", &[], &["\"nought\" on line 1, column 1"]);
    spoil(
        "triples.txt",
        "0 0 1.5\n",
        "",
        &["--length", "6"],
        &["1 of 24 points were not measured, the first in row 1, column 1"],
    );
    let last = "1\t0.666666666667\t1.5\n";
    spoil("konfig.dat", last, "1\t0.666666666667\t1.6\n", &[], &["1.6e0 at the repeated point x = 6, y = 4", "1.5e0"]);
}

/// Four columns of integers are a map if this is specified.
#[test]
fn a_table_of_four_columns_is_a_map_on_request() {
    let scratch = tempfile::tempdir().expect("scratch");
    let path = scratch.path().join("narrow.txt");
    std::fs::write(&path, "1 2 3 4\n2 3 4 1\n0 1 2 2\n").expect("written");
    let read = |fourier| import::read(&path, ImportOptions { fourier, ..ImportOptions::default() });
    assert!(read(None).is_err());
    let Content::Map(map) = read(Some(Fourier::None)).expect("a map").content else { panic!("a map") };
    assert_eq!((map.nx, map.ny), (4, 3));
}

/// Text files that are heights or not, each with the reported kind.
#[test]
fn layouts_of_text_are_recognised() {
    let scratch = tempfile::tempdir().expect("scratch");
    let path = scratch.path().join("some.txt");
    let read = |bytes: &[u8], fourier| {
        std::fs::write(&path, bytes).expect("written");
        import::read(&path, ImportOptions { fourier, ..ImportOptions::default() }).map(|found| match found.content {
            Content::Map(map) => [map.nx, map.ny],
            Content::Waves(waves) => [waves.len(), 0],
        })
    };
    let matrix = "1 2 3 4 5\n2 3 4 5 6\n3 4 5 6 9\n";
    for header in ["", "\u{feff}", "# 5 3\n", "# 3 5\n", "\u{feff}# 5 3\n", "# 18446744073709551615 3\n"] {
        assert_eq!(read(format!("{header}{matrix}").as_bytes(), None).expect(header), [5, 3]);
    }
    assert!(read(format!("# 5 4\n{matrix}").as_bytes(), None).is_err());
    assert_eq!(read("\u{feff}0 1 1 0\n".as_bytes(), Some(Fourier::Series)).expect("waves"), [1, 0]);
    for (latin, fourier) in [(&b"# unit: \xb5m\n1 2\n3 4\n"[..], None), (b"# \xb5m\n1 0 2 3\n", Some(Fourier::Series))]
    {
        assert_eq!(read(latin, fourier).expect("Latin-1"), if fourier.is_none() { [2, 2] } else { [1, 0] });
    }
    // The last line of x y h is missing: the file is no map three points wide, unless this is specified.
    let list = b"0 0 1\n1 0 2\n2 0 3\n0 1 4\n1 1 5\n";
    assert_eq!(read(list, None).expect("with a missing point"), [3, 2]);
    assert_eq!(read(list, Some(Fourier::None)).expect("said"), [3, 5]);
    assert_eq!(read(b"0 1 4\n1 1 5\n2 1 6\n0 0 1\n1 0 2\n2 0 3\n", None).expect("downwards"), [3, 2]);
    // A map four points wide with integer heights, but no coefficients.
    let wide: String = (0..12).map(|i| format!("{} {} {}\n", i % 4, i / 4, i * i % 7)).collect();
    assert_eq!(read(wide.as_bytes(), None).expect("a list"), [4, 3]);
    let said = read(b"1e308 0\n-1e308 0\n", None).unwrap_err().to_string();
    assert!(said.contains("heights from -1e308 to 1e308"), "{said}");
}

/// A unit declared in a file is not overridden; `solve` uses lengths in the unit of the file.
#[test]
fn a_declared_unit_is_compared() {
    let nm = &["--unit", "nm"];
    refused(
        &surface("packed.nc", nm),
        "command line",
        &["--unit = nm; accepted: um (1 µm), as ", "packed.nc declares"],
    );
    let scratch = tempfile::tempdir().expect("scratch");
    let path = scratch.path().join("nm.txt");
    std::fs::write(&path, "# unit: nm\n1 2\n3 4\n").expect("written");
    let path = path.to_str().expect("UTF-8");
    refused(&surface(path, &[]), "command line", &["--unit = um; accepted: nm (0.001 µm), as "]);
    assert!(surface(path, nm).status.success());
    let flags = ["--touching", "low-points", "--length", "1", "--modulus", "1", "--pressure", "0.1", "--json"];
    let solve = asperity().args(["solve", path]).args(flags).output().expect("started");
    assert!(solve.status.success(), "{}", stderr(&solve));
}
