//! What files of other programs declare (`fixtures/make_declared.py`) is what SurfaceTopography reads from them: extents, unit, missing
//! points, heights. Damaged twins of these files are refused.

use crate::program::asperity;
use asperity::surface::height_map::HeightMap;
use asperity::surface::import::{self, Content, ImportOptions, ImportedFile};
use nalgebra::{DMatrix, DVector};
use serde::Deserialize;
use std::io::Write;
use std::path::{Path, PathBuf};

/// An entry of `declared.json`.
#[derive(Deserialize)]
struct Stated {
    file: String,
    dataset: Option<String>,
    points: [usize; 2],
    length_m: [f64; 2],
    unit_m: f64,
    missing: usize,
    rms_m: f64,
    periodic: Option<bool>,
}

/// Text has ten digits, and one file is in single precision; a swapped axis or a lost factor is off by far more.
const TOLERANCE: f64 = 1e-6;

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures")
}

fn stated() -> Vec<Stated> {
    let text = std::fs::read_to_string(fixtures().join("declared.json")).expect("declared.json");
    serde_json::from_str(&text).expect("its entries")
}

fn read(path: &Path) -> asperity::Result<ImportedFile> {
    import::read(path, ImportOptions::default())
}

fn map(found: ImportedFile) -> HeightMap {
    match found.content {
        Content::Map(map) => map,
        Content::Waves(_) => panic!("a map"),
    }
}

/// rms height of the measured points after the plane of least squares is removed.
fn plane_free_rms(map: &HeightMap) -> f64 {
    let points: Vec<usize> = (0..map.heights.len()).filter(|i| !map.heights[*i].is_nan()).collect();
    let columns = DMatrix::from_fn(points.len(), 3, |k, column| match column {
        0 => 1.0,
        1 => (points[k] % map.nx) as f64,
        _ => (points[k] / map.nx) as f64,
    });
    let heights = DVector::from_fn(points.len(), |k, _| map.heights[points[k]]);
    let plane = columns.clone().svd(true, true).solve(&heights, 1e-12).expect("a plane");
    ((heights - columns * plane).norm_squared() / points.len() as f64).sqrt()
}

#[test]
fn files_declare_what_other_programs_read() {
    for s in stated() {
        let path = fixtures().join("declared").join(&s.file);
        let options = ImportOptions { dataset: s.dataset.as_deref(), ..ImportOptions::default() };
        let found = import::read(&path, options).unwrap_or_else(|e| panic!("{e}"));
        assert!(found.warnings.is_empty(), "{}: {:?}", s.file, found.warnings);
        let off = |a: f64, b: f64| (a / b - 1.0).abs();
        let unit = found.declared.unit_m().unwrap_or_else(|| panic!("{}: no unit", s.file));
        let length = found.declared.extent_m().unwrap_or_else(|| panic!("{}: no extent", s.file));
        assert!(off(unit, s.unit_m) < TOLERANCE, "{}: unit {unit}, not {}", s.file, s.unit_m);
        assert!(
            (0..2).all(|k| off(length[k], s.length_m[k]) < TOLERANCE),
            "{}: {length:?}, not {:?}",
            s.file,
            s.length_m
        );
        assert_eq!(found.declared.periodic, s.periodic, "{}", s.file);
        let map = map(found);
        assert_eq!(([map.nx, map.ny], map.missing()), (s.points, s.missing), "{}", s.file);
        let rms = plane_free_rms(&map) * unit;
        assert!(off(rms, s.rms_m) < TOLERANCE, "{}: rms {rms:e}, not {:e}", s.file, s.rms_m);
    }
}

/// Coordinates that decrease give the map of those that increase, and the layout says so.
#[test]
fn descending_coordinates_are_reversed() {
    let declared = fixtures().join("declared");
    let bits = |found: ImportedFile| map(found).heights.iter().map(|h| h.to_bits()).collect::<Vec<_>>();
    let ascending = bits(read(&declared.join("xarray.nc")).expect("read"));
    for (name, axes) in [
        ("descending-y.nc", "reversed along y, which decreases"),
        ("descending.nc", "reversed along x and y, which decreases"),
        ("descending.h5", "reversed along y, which decreases"),
        ("descending.npz", "reversed along x, which decreases"),
    ] {
        let found = read(&declared.join(name)).expect(name);
        assert!(found.layout.ends_with(axes), "{name}: {}", found.layout);
        assert_eq!(bits(found), ascending, "{name}");
    }
}

/// Files that are recognised and not read say what they are and how to convert them.
#[test]
fn foreign_files_are_named_with_the_remedy() {
    let scratch = tempfile::tempdir().expect("scratch");
    let path = scratch.path().join("foreign");
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    archive.start_file("[Content_Types].xml", zip::write::SimpleFileOptions::default()).expect("an entry");
    let workbook = archive.finish().expect("closed").into_inner();
    for (bytes, what, remedy) in [
        (&b"Wyko ASCII Data File Format 0\t0\t1\nX Size\t4\n"[..], "Wyko ASCII", "Gwyddion"),
        (b"VK4_\0\0\0", "Keyence VK4", "Gwyddion"),
        (b"\x88\x1b\x03\x6f\0", "Zygo MetroPro", "python -m asperity.convert FILE out.nc"),
        (b"MATLAB 5.0 MAT-file, Platform: GLNXA64", "a MATLAB file before version 7.3", "-v7.3"),
        (b"\x89PNG\r\n\x1a\n\0", "a PNG image", "no heights"),
        (&workbook, "a workbook or document of Office", "CSV"),
        (b"\x01\0\0\0\0", "a kind that is not known", "Gwyddion"),
    ] {
        std::fs::write(&path, bytes).expect("written");
        let said = read(&path).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(said.contains(what) && said.contains("; accepted: ") && said.contains(remedy), "{said}");
        // The command does not take such a file for a scene.
        let output = asperity().arg("surface").arg(&path).output().expect("started");
        assert!(String::from_utf8_lossy(&output.stderr).contains(what));
    }
}

/// What a header states under a name that is not known is quoted where it may be what is missing.
#[test]
fn statements_that_are_not_understood_are_quoted() {
    let scratch = tempfile::tempdir().expect("scratch");
    let path = scratch.path().join("map.txt");
    std::fs::write(&path, "# Auflagefläche: 30 µm\n# z unit: nm\n1 2 3\n4 5 7\n").expect("written");
    let output = asperity().arg("surface").arg(&path).args(["--touching", "high-points"]).output().expect("started");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("--length = not given") && said.contains("Auflagefläche = \"30 µm\" on line 1"), "{said}");
    std::fs::write(&path, "# Z magnification scale: 0.1\n# unit: nm\n1 2 3\n4 5 7\n").expect("written");
    let found = read(&path).expect("read");
    assert!(found.warnings.iter().any(|w| w.contains("heights are not multiplied by it")), "{:?}", found.warnings);
}

/// Binary files that end early are refused wherever they end, not read as another map.
#[test]
fn cut_files_are_refused() {
    let scratch = tempfile::tempdir().expect("scratch");
    for s in stated().iter().filter(|s| [".nc", ".h5", ".npz"].iter().any(|e| s.file.ends_with(e))) {
        let whole = std::fs::read(fixtures().join("declared").join(&s.file)).expect("read");
        let path = scratch.path().join(&s.file);
        // Every length near the end, and every 97th before.
        for length in (1..whole.len()).filter(|l| l % 97 == 1 || whole.len() - l < 40) {
            std::fs::write(&path, &whole[..length]).expect("written");
            if let Ok(found) = read(&path) {
                panic!("{} of {} bytes of {} are read as {}", length, whole.len(), s.file, found.layout);
            }
        }
    }
}

/// A data set with dimension scales that cannot be found is refused, because x and y could be swapped.
#[test]
fn lost_dimension_scales_are_refused() {
    let said = read(&fixtures().join("declared/no-scales.h5")).unwrap_err().to_string();
    assert!(said.contains("dimension scales of heights are damaged") && said.contains("DIMENSION_LIST"), "{said}");
}

/// Text that declares its size is refused without its last line, and every file without the last number.
#[test]
fn cut_text_is_refused() {
    let scratch = tempfile::tempdir().expect("scratch");
    let path = scratch.path().join("cut.txt");
    for name in ["spip.asc", "nova.txt", "attocube.asc", "matrix.txt", "gwyddion.txt", "points.xyz"] {
        let text = std::fs::read_to_string(fixtures().join("declared").join(name)).expect("text");
        let cut = |length: usize| {
            std::fs::write(&path, &text[..length]).expect("written");
            read(&path).map(|found| map(found).missing())
        };
        let last_line = text.trim_end().rfind('\n').expect("lines") + 1;
        let last_number = text.trim_end().rfind(['\t', ' ']).expect("numbers");
        assert!(cut(last_number).unwrap_err().to_string().contains("cut off"), "{name}");
        if text.to_lowercase().contains("x-pixels") || text.contains("NX =") {
            assert!(cut(last_line).unwrap_err().to_string().contains("as the header declares"), "{name}");
        }
        if name != "points.xyz" {
            assert!(cut(text.trim_end().len() - 1).unwrap_err().to_string().contains("cut off"), "{name}");
        }
    }
}

#[test]
fn spoilt_headers_are_refused() {
    let scratch = tempfile::tempdir().expect("scratch");
    for (name, from, to, says) in [
        ("spip.asc", "x-pixels = 7", "x-pixels = 5", "5 lines of 7 numbers; accepted: 5 lines of 5"),
        ("nova.txt", "Unit X = um", "Unit X = volt", "Unit X = \"volt\" on line 6; accepted: a unit of length"),
        ("nova.txt", "Unit Data = nm", "Unit Data = pA", "values in \"pA\" on line 8, which are no heights"),
        ("attocube.asc", "x-length: 30", "x-length: 0", "x-length = \"0\" on line 4; accepted: a positive number"),
        ("gwyddion.txt", "10.00 µm", "10.00 µV", "Width = \"10.00 µV\" on line 2"),
        ("points.csv", "Z[nm]", "Z[nm];note", "5 words on line 1 and 4 numbers below"),
        ("points.csv", "3,0;1,0;", "3,1;1,0;", "X"),
        ("matrix.txt", "# Height: 20.0 um", "# Periodic: maybe", "Periodic = \"maybe\" on line 2; accepted: yes or no"),
        ("factor.txt", "pixel size = 2.0 um", "pixel size = -2.0 um", "accepted: a positive number"),
    ] {
        let text = std::fs::read_to_string(fixtures().join("declared").join(name)).expect("text");
        assert!(text.contains(from), "{name} lacks {from:?}");
        let path = scratch.path().join(name);
        std::fs::write(&path, text.replacen(from, to, 1)).expect("written");
        let said = read(&path).err().map(|e| e.to_string().to_lowercase()).unwrap_or_default();
        assert!(said.contains(&says.to_lowercase()) && said.contains("; accepted: "), "{name}: {said}");
    }
}

/// Statements that cannot be used are reported with what to do instead.
#[test]
fn unknown_units_of_coordinates_are_reported() {
    let scratch = tempfile::tempdir().expect("scratch");
    let path = scratch.path().join("degrees.nc");
    let mut bytes = std::fs::read(fixtures().join("declared/open.nc")).expect("read");
    let unit = b"unit\0\0\0\x02\0\0\0\x02um";
    let places: Vec<usize> = (0..bytes.len() - unit.len()).filter(|i| bytes[*i..].starts_with(unit)).collect();
    assert!(places.len() > 2, "units of x, y and heights");
    places.iter().for_each(|i| bytes[i + unit.len() - 2..][..2].copy_from_slice(b"qq"));
    std::fs::write(&path, &bytes).expect("written");
    let found = read(&path).expect("read");
    assert_eq!((&found.declared.extent, found.declared.unit_m()), (&None, None));
    assert!(
        found.warnings.iter().any(|w| w.contains("extents in \"qq\"") && w.contains("--length")),
        "{:?}",
        found.warnings
    );
}

/// Coordinates without a unit are in that with which the given extent is theirs; any other extent is refused.
#[test]
fn coordinates_may_have_another_unit_than_heights() {
    let scratch = tempfile::tempdir().expect("scratch");
    let path = scratch.path().join("points.txt");
    let point = |i: u32| format!("{} {} {}\n", 0.5 * f64::from(i % 24), 0.5 * f64::from(i / 24), i * i % 97);
    std::fs::write(&path, (0..480).map(point).collect::<String>()).expect("written");
    let surface = |length: &str| {
        let command = ["--touching", "high-points", "--unit", "nm", "--length", length];
        asperity().arg("surface").arg(&path).args(command).output().expect("started")
    };
    let output = surface("12um");
    let (said, warned) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(said.contains("24 x 20 points on 12 x 10 µm"), "{said}{warned}");
    assert!(warned.contains("have no unit: along x they are 12 um, as --length has it"), "{warned}");
    let refused = surface("13um");
    assert!(!refused.status.success() && String::from_utf8_lossy(&refused.stderr).contains("accepted: 0.012 um"));
}

/// Files that claim far more numbers than they have bytes for are refused before memory is allocated.
#[test]
fn claims_without_bytes_are_refused() {
    let said = read(&fixtures().join("declared/claim.h5")).unwrap_err().to_string();
    assert!(said.contains("array \"surface\" of 4294967296 bytes, stored in 1400"), "{said}");
    let scratch = tempfile::tempdir().expect("scratch");
    let path = scratch.path().join("zeros.npz");
    let mut archive = zip::ZipWriter::new(std::fs::File::create(&path).expect("created"));
    let options = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Deflated);
    archive.start_file("a.npy", options).expect("an entry");
    let (nx, ny) = (4096, 2100);
    let shape = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({ny}, {nx}), }}");
    let header = format!("{shape:<117}\n");
    archive.write_all(b"\x93NUMPY\x01\x00\x76\x00").expect("written");
    archive.write_all(header.as_bytes()).expect("written");
    (0..ny).for_each(|_| archive.write_all(&vec![0; 8 * nx]).expect("written"));
    archive.finish().expect("closed");
    let said = read(&path).unwrap_err().to_string();
    assert!(said.contains("68812928 bytes, stored in") && said.contains("without compression"), "{said}");
}

/// A pipe would block, and a folder or a device is no file of heights.
#[cfg(unix)]
#[test]
fn only_regular_files_are_read() {
    let scratch = tempfile::tempdir().expect("scratch");
    let pipe = scratch.path().join("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("started").success());
    for (path, kind) in [(&*pipe, "a pipe"), (scratch.path(), "a folder"), (Path::new("/dev/zero"), "or device")] {
        let said = read(path).unwrap_err().to_string();
        assert!(said.contains(kind) && said.contains("accepted: a regular file"), "{said}");
        assert!(import::holds_numbers(path).is_err());
        let mut command = asperity();
        let output =
            command.args(["solve", "--pressure", "1", "--touching", "high-points", "--heights"]).arg(path).output();
        assert_eq!(output.expect("started").status.code(), Some(2));
    }
}

/// Foreign files are quoted in short, without the control characters of a terminal.
#[test]
fn quotations_are_short_and_printable() {
    let scratch = tempfile::tempdir().expect("scratch");
    let path = scratch.path().join("foreign.txt");
    for text in ["\u{1b}[2J\u{1b}]0;title\u{7} 1 2\n", "%PDF-1.4\n%\u{e2}\u{e3}\n1 0 obj\n", &"oak 1 2 ".repeat(200)] {
        std::fs::write(&path, text).expect("written");
        let said = read(&path).unwrap_err().to_string();
        assert!(said.len() < 400 && !said.contains(|c: char| c.is_control()), "{said:?}");
    }
}
