//! Files of instruments (`fixtures/surfaces/make.py`): the heights are those that other programs read. Damaged and unsupported
//! files are refused in one line; no change of their bytes ends in a panic.

use crate::program::{asperity, stderr};
use asperity::surface::heights::HeightMap;
use asperity::surface::import::{self, Content, ImportOptions, ImportedFile};
use nalgebra::{Matrix3, Vector3};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use serde::Deserialize;
use std::fs::File;
use std::io::{Seek, Write};
use std::path::{Path, PathBuf};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

/// One entry of `expected.json`.
#[derive(Deserialize)]
struct Expected {
    file: String,
    dataset: Option<String>,
    nx: usize,
    ny: usize,
    extent_m: [f64; 2],
    missing: usize,
    /// `None` where programs disagree on the zero of the heights.
    mean_m: Option<f64>,
    rms_without_plane_m: f64,
    /// x, y, height.
    heights_m: Vec<(usize, usize, f64)>,
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/surfaces")
}

fn expected() -> Vec<Expected> {
    let text = std::fs::read_to_string(folder().join("expected.json")).expect("read");
    serde_json::from_str(&text).expect("JSON")
}

fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(folder().join(name)).expect(name)
}

fn map(found: &ImportedFile) -> &HeightMap {
    let Content::Map(map) = &found.content else { panic!("a map") };
    map
}

/// Root mean square of the measured heights after subtraction of their least-squares plane.
fn rms_without_plane(map: &HeightMap) -> f64 {
    let measured = || {
        let points = map.heights.iter().enumerate().filter(|(_, h)| !h.is_nan());
        points.map(|(i, h)| (Vector3::new(1.0, (i % map.nx) as f64, (i / map.nx) as f64), *h))
    };
    let normal: Matrix3<f64> = measured().map(|(p, _)| p * p.transpose()).sum();
    let right: Vector3<f64> = measured().map(|(p, h)| p * h).sum();
    let plane = normal.cholesky().expect("points off a line").solve(&right);
    let squares: f64 = measured().map(|(p, h)| (h - plane.dot(&p)).powi(2)).sum();
    (squares / measured().count() as f64).sqrt()
}

/// Relative to the value, or to the rms height for single heights. Programs differ by the rounding of spacings in f32 (6e-8)
/// and of conversions between units.
const TOLERANCE: f64 = 1e-6;

#[test]
fn instruments_files_give_the_heights_of_other_programs() {
    for e in expected() {
        let name = &e.file;
        let options = ImportOptions { dataset: e.dataset.as_deref(), ..ImportOptions::default() };
        let found = import::read(&folder().join(name), options).expect(name);
        let map = map(&found);
        assert_eq!((map.nx, map.ny, map.missing()), (e.nx, e.ny, e.missing), "{name}");
        let declared = &found.declared;
        assert_eq!((declared.sign, declared.periodic), (None, None), "{name}");
        let unit = declared.unit_m().expect("a known unit");
        let extent = declared.extent_m().expect("an extent");
        let rms = rms_without_plane(map) * unit;
        let near = |a: f64, b: f64, size: f64| assert!((a - b).abs() <= TOLERANCE * size, "{name}: {a:e}, not {b:e}");
        near(rms, e.rms_without_plane_m, rms);
        (0..2).for_each(|i| near(extent[i], e.extent_m[i], extent[i]));
        let at = |x: usize, y: usize| map.heights[y * map.nx + x] * unit;
        let (x0, y0, first) = e.heights_m[0];
        let zero = if e.mean_m.is_some() { 0.0 } else { at(x0, y0) - first };
        if let Some(mean) = e.mean_m {
            let measured = map.heights.iter().filter(|h| !h.is_nan());
            near(measured.sum::<f64>() * unit / (map.heights.len() - e.missing) as f64, mean, rms);
        }
        for (x, y, height) in e.heights_m {
            near(at(x, y), height + zero, rms);
        }
    }
}

#[test]
fn layouts_and_channels_are_named() {
    let read = |name: &str, dataset| {
        import::read(&folder().join(name), ImportOptions { dataset, ..ImportOptions::default() }).expect(name)
    };
    for (name, says, unit) in [
        ("int16.x3p", "x3p (ISO 25178-72), int16 [ny, nx]", "m"),
        ("text.sdf", "surface data file aISO-1.0 (ISO 25178-71), float64 [ny, nx]", "m"),
        ("int16.sur", "Digital Surf surface, 16 bits [ny, nx]", "nm"),
        ("compressed.sur", "Digital Surf surface, compressed, 32 bits [ny, nx]", "µm"),
        ("one.gwy", "Gwyddion channel 0 \"Topography\" [ny, nx]", "m"),
    ] {
        let found = read(name, None);
        assert_eq!((found.layout.as_str(), found.declared.unit.as_deref()), (says, Some(unit)), "{name}");
    }
    let several = read("several.gwy", Some("Retrace")).declared;
    assert_eq!(several.channel.as_deref(), Some("Retrace"));
    assert_eq!(several.channels, ["Height", "Height", "Retrace"]);
}

/// The same heights in the variants that no program at hand writes: the names of the format before the standard, the header of
/// Olympus, 32 bits for the numbers of points.
#[test]
fn dialects_of_surface_data_files_read_alike() {
    let scratch = tempfile::tempdir().expect("scratch");
    let path = scratch.path().join("map");
    let read = || import::read(&path, ImportOptions::default()).map(|f| map(&f).heights.clone());
    for name in ["text.sdf", "int16.sdf"] {
        let original = bytes(name);
        std::fs::write(&path, &original).expect("written");
        let exact = read().expect("read");
        let alike = |found: Vec<f64>| found.iter().zip(&exact).all(|(a, b)| a.to_bits() == b.to_bits());
        for dialect in ["BCR-1.0", "BCR-0.0"] {
            let renamed = [&original[..1], dialect.as_bytes(), &original[8..]].concat();
            std::fs::write(&path, renamed).expect("written");
            assert!(alike(read().expect(dialect)), "{name} as {dialect}");
        }
        if name == "int16.sdf" {
            let olympus = [&original[..81], &[5, 0, 0, 0, 1, 0, 0, 0], &original[81..]].concat();
            std::fs::write(&path, olympus).expect("written");
            assert!(alike(read().expect("Olympus")));
            let (nx, ny) = (&original[42..44], &original[44..46]);
            let second = [b"bISO-2.0", &original[8..42], nx, &[0; 2], ny, &[0; 2], &original[46..]].concat();
            std::fs::write(&path, second).expect("written");
            assert!(alike(read().expect("second edition")));
        }
    }
}

/// Inverted heights, and the order of x or y with them, as the header of Digital Surf states.
#[test]
fn inverted_surfaces_are_inverted() {
    let scratch = tempfile::tempdir().expect("scratch");
    let path = scratch.path().join("map");
    let mut file = bytes("int16.sur");
    let mut read = |inverted: u8| {
        file[290] = inverted;
        std::fs::write(&path, &file).expect("written");
        map(&import::read(&path, ImportOptions::default()).expect("read")).clone()
    };
    let (plain, z, flip, flop) = (read(0), read(1), read(2), read(3));
    let (nx, ny) = (plain.nx, plain.ny);
    for (x, y) in (0..ny).flat_map(|y| (0..nx).map(move |x| (x, y))) {
        let at = |map: &HeightMap, x: usize, y: usize| map.heights[y * nx + x];
        let height = -at(&plain, x, y);
        assert_eq!([at(&z, x, y), at(&flip, nx - 1 - x, y), at(&flop, x, ny - 1 - y)], [height; 3]);
    }
}

/// The archive with its files changed, by name and content.
fn rebuilt(archive: &[u8], mut change: impl FnMut(String, Vec<u8>) -> Option<(String, Vec<u8>)>) -> Vec<u8> {
    let mut source = ZipArchive::new(std::io::Cursor::new(archive)).expect("an archive");
    let mut target = ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    for i in 0..source.len() {
        let mut entry = source.by_index(i).expect("an entry");
        let own = entry.name().expect("a name").into_owned();
        let mut content = Vec::new();
        std::io::Read::read_to_end(&mut entry, &mut content).expect("read");
        if let Some((name, content)) = change(own, content) {
            target.start_file(name, options).expect("started");
            target.write_all(&content).expect("written");
        }
    }
    target.finish().expect("finished").into_inner()
}

/// The archive with one file changed.
fn repacked(archive: &[u8], name: &str, mut change: impl FnMut(Vec<u8>) -> Vec<u8>) -> Vec<u8> {
    rebuilt(archive, |own, content| {
        let content = if own == name { change(content) } else { content };
        Some((own, content))
    })
}

/// Programs put the files of x3p into a folder of the archive, and write infinities for points that were not measured.
#[test]
fn folders_and_infinities_of_x3p_are_read() {
    let scratch = tempfile::tempdir().expect("scratch");
    let path = scratch.path().join("map");
    let heights = |file: Vec<u8>| {
        std::fs::write(&path, file).expect("written");
        map(&import::read(&path, ImportOptions::default()).expect("read")).clone()
    };
    let original = bytes("float32.x3p");
    let exact = heights(original.clone());
    let packed = rebuilt(&original, |name, content| Some((format!("a folder/{name}"), content)));
    let same = |a: &f64, b: &f64| a == b || a.is_nan() && b.is_nan();
    assert!(heights(packed).heights.iter().zip(&exact.heights).all(|(a, b)| same(a, b)));
    let lost = rebuilt(&original, |name, mut content| {
        if name.ends_with(".bin") {
            content[..8].copy_from_slice(&[f32::INFINITY.to_le_bytes(), f32::NEG_INFINITY.to_le_bytes()].concat());
        }
        let text = || String::from_utf8(content.clone()).expect("UTF-8").replace("MD5ChecksumPointData", "Other");
        let content = if name == "main.xml" { text().into_bytes() } else { content };
        (name != "md5checksum.hex").then_some((name, content))
    });
    let holes = heights(lost);
    assert!(holes.heights[..2].iter().all(|h| h.is_nan()));
    assert!(holes.heights[2..].iter().zip(&exact.heights[2..]).all(|(a, b)| same(a, b)));
}

/// A channel without a unit is read where no other has a unit of length; its unit is given.
#[test]
fn gwyddion_channels_without_a_unit_are_read() {
    let scratch = tempfile::tempdir().expect("scratch");
    let path = scratch.path().join("map.gwy");
    std::fs::write(&path, replaced("one.gwy", "si_unit_z", "si_unit_x")).expect("written");
    let found = import::read(&path, ImportOptions::default()).expect("read");
    assert_eq!((map(&found).nx, found.declared.unit.as_deref()), (24, None));
}

/// float32.x3p with other words in main.xml.
fn reworded(from: &str, to: &str) -> Vec<u8> {
    repacked(&bytes("float32.x3p"), "main.xml", |xml| {
        let text = String::from_utf8(xml).expect("UTF-8");
        assert!(text.contains(from), "{from}");
        text.replace(from, to).into_bytes()
    })
}

/// A fixture with other bytes at a place.
fn patched(name: &str, at: usize, with: &[u8]) -> Vec<u8> {
    let mut file = bytes(name);
    file[at..at + with.len()].copy_from_slice(with);
    file
}

fn cut(name: &str, length: usize) -> Vec<u8> {
    bytes(name)[..length].to_vec()
}

fn replaced(name: &str, from: &str, to: &str) -> Vec<u8> {
    let file = bytes(name);
    let at = file.windows(from.len()).position(|w| w == from.as_bytes()).expect(from);
    [&file[..at], to.as_bytes(), &file[at + from.len()..]].concat()
}

fn many_texts() -> Vec<u8> {
    let inside: String = (0..20_000).map(|i| format!("<t{i}>1</t{i}>")).collect();
    format!("<root>{inside}</root>").into_bytes()
}

/// An archive that states 48 MiB for its main.xml of some kB.
fn forged_size() -> Vec<u8> {
    let mut file = bytes("deflated.x3p");
    let entry = |w: &[u8]| w.starts_with(b"PK\x01\x02") && w.ends_with(b"main.xml");
    let at = file.windows(46 + 8).position(entry).expect("the entry of the directory");
    file[at + 24..at + 28].copy_from_slice(&(48_u32 << 20).to_le_bytes());
    file
}

/// Files that are refused, and words of the message.
fn bad_files() -> Vec<(&'static str, Vec<u8>, &'static str)> {
    let bomb = |length: usize| repacked(&bytes("float32.x3p"), "bindata/data.bin", |_| vec![0; length]);
    let huge = 4 * 100_000 * 100_000_u64;
    let mut declared = reworded("<SizeX>24</SizeX>", "<SizeX>100000</SizeX>");
    declared = repacked(&declared, "main.xml", |xml| {
        let text = String::from_utf8(xml).expect("UTF-8");
        text.replace("<SizeY>17</SizeY>", "<SizeY>100000</SizeY>").into_bytes()
    });
    assert!(huge > declared.len() as u64);
    vec![
        ("cut.x3p", cut("float32.x3p", 2000), "a damaged archive"),
        ("declared.x3p", declared, "for 100000 x 100000 points"),
        ("bomb.x3p", bomb(100_000_000), "\"bindata/data.bin\" of 100000000 bytes"),
        ("list.x3p", repacked(&bytes("list.x3p"), "md5checksum.hex", |_| b"0123 *main.xml".to_vec()), "MD5 sum"),
        (
            "deep.x3p",
            repacked(&bytes("list.x3p"), "main.xml", |_| b"<a>".repeat(100_000)),
            "elements within each other",
        ),
        ("texts.x3p", repacked(&bytes("list.x3p"), "main.xml", |_| many_texts()), "more than 10000 texts"),
        ("ratio.x3p", forged_size(), "compressed at most 1032-fold"),
        (
            "size.x3p",
            reworded("<SizeX>24</SizeX>", "<SizeX>23</SizeX>"),
            "\" of 1632 bytes; accepted: 1564, for 23 x 17 points",
        ),
        ("no-size.x3p", reworded("SizeY", "Rows"), "SizeY = \"\""),
        ("layers.x3p", reworded("<SizeZ>1</SizeZ>", "<SizeZ>2</SizeZ>"), "2 layers"),
        ("type.x3p", reworded("<DataType>F<", "<DataType>Q<"), "DataType \"Q\" of CZ"),
        ("profile.x3p", reworded(">SUR<", ">PRF<"), "profiles (FeatureType PRF); accepted: a surface"),
        ("cloud.x3p", reworded(">SUR<", ">PCL<"), "a point cloud"),
        ("absolute.x3p", reworded("<AxisType>I<", "<AxisType>A<"), "save as .gwy"),
        ("sum.x3p", reworded("<MD5ChecksumPointData>", "<MD5ChecksumPointData>0"), "MD5 sum"),
        ("unclosed.x3p", reworded("</Record4>", ""), "main.xml: "),
        ("link.x3p", reworded("<PointDataLink>bin", "<PointDataLink>gone"), "no \"gonedata/data.bin\" in the archive"),
        ("cut.sdf", cut("binary.sdf", 3000), "the file is cut off"),
        ("header.sdf", cut("binary.sdf", 60), "the header should be"),
        ("size.sdf", patched("int16.sdf", 42, &[0xFF, 0xFF]), "65535 x 17 points"),
        ("type.sdf", patched("int16.sdf", 79, &[9]), "DataType = 9"),
        ("compressed.sdf", patched("int16.sdf", 78, &[1]), "Compression = 1: compressed heights"),
        ("check.sdf", patched("int16.sdf", 80, &[1]), "CheckType = 1"),
        ("cut-text.sdf", cut("text.sdf", 3000), "the file is cut off"),
        ("points.sdf", replaced("text.sdf", "NumPoints = 24", "NumPoints = 25"), "408 heights; accepted: 425"),
        ("huge.sdf", replaced("text.sdf", "NumPoints = 24", "NumPoints = 4000000000"), "characters of heights"),
        ("word.sdf", replaced("text.sdf", "BAD", "bed"), "height 1 of 408 = \"bed\""),
        ("key.sdf", replaced("text.sdf", "Zscale", "Ascale"), "no Zscale in the header"),
        ("cut.sur", cut("plain.sur", 2000), "the file is cut off"),
        ("size.sur", patched("plain.sur", 108, &[0xFF, 0xFF, 0xFF, 0x7F]), "2147483647 x 17 points"),
        ("type.sur", patched("plain.sur", 98, &[24]), "points of 24 bits"),
        ("order.sur", patched("plain.sur", 12, &[1, 1]), "format 257"),
        ("series.sur", patched("plain.sur", 18, &[5]), "a series of surfaces"),
        ("cut-stream.sur", cut("compressed.sur", 2000), "the file is cut off"),
        ("stream.sur", patched("compressed.sur", 600, &[0; 40]), "compressed stream"),
        (
            "bomb.sur",
            {
                let square =
                    [&1_000_000_i32.to_le_bytes()[..], &2000_i32.to_le_bytes(), &2_000_000_000_i32.to_le_bytes()];
                patched("compressed.sur", 108, &square.concat())
            },
            "1000000 x 2000 points",
        ),
        ("profile.pro", bytes("profile.pro"), "(profiles); accepted: a surface"),
        ("cut.gwy", cut("one.gwy", 5000), "the file is cut off"),
        ("size.gwy", replaced("one.gwy", "xres\0i\u{18}", "xres\0i\u{19}"), "408 numbers in a field of 25 x 17 points"),
        ("type.gwy", replaced("one.gwy", "xres\0i", "xres\0z"), "\"xres\" of type 'z'"),
        (
            "mask.gwy",
            {
                let file = bytes("one.gwy");
                let last = file.windows(5).rposition(|w| w == b"yres\0").expect("of the mask");
                patched("one.gwy", last + 6, &[18])
            },
            "a mask of 24 x 18 points",
        ),
        (
            "several.gwy",
            bytes("several.gwy"),
            "(1 \"Height\", 2 \"Height\", 3 \"Retrace\"); accepted: the title or number",
        ),
    ]
}

#[test]
fn bad_files_are_refused_in_one_line_that_names_them() {
    let scratch = tempfile::tempdir().expect("scratch");
    for (name, file, says) in bad_files() {
        let path = scratch.path().join(name);
        std::fs::write(&path, file).expect("written");
        let Err(error) = import::read(&path, ImportOptions::default()) else { panic!("{name} was read") };
        let message = error.to_string();
        assert!(message.contains(says) && message.contains(name) && !message.contains('\n'), "{name}: {message}");
        assert_eq!(error.exit_code(), 2, "{name}");
    }
}

#[test]
fn ambiguous_and_unsuitable_channels_are_refused() {
    for (name, dataset, says) in [
        ("several.gwy", "Height", "2 channels with the title \"Height\"; accepted: the number"),
        ("several.gwy", "Current", "channel 4 \"Current\" in \"A\"; accepted: a channel with a unit of length: 1"),
        ("several.gwy", "7", "no channel \"7\""),
        ("plain.sur", "Height", "for a file without names"),
        ("int16.x3p", "Height", "for a file without names"),
    ] {
        let options = ImportOptions { dataset: Some(dataset), ..ImportOptions::default() };
        let message = import::read(&folder().join(name), options).expect_err(name).to_string();
        assert!(message.contains(says), "{message}");
    }
}

/// The program reads them, too, recognised by their contents.
#[test]
fn the_program_reads_instruments_files() {
    let scratch = tempfile::tempdir().expect("scratch");
    for (name, unit) in [("float32.x3p", "m"), ("int16.sur", "nm")] {
        let path = scratch.path().join("map.txt");
        std::fs::copy(folder().join(name), &path).expect("copied");
        let out = scratch.path().join("out.npy");
        let mut command = asperity();
        command.arg("surface").arg(&path).args(["--touching", "high-points", "--unit", unit, "--out"]);
        let output = command.arg(&out).output().expect("started");
        assert!(output.status.success(), "{name}: {}", stderr(&output));
    }
}

/// Random changes per file.
const FLIPS: usize = 2000;

/// Steps between the lengths of cut files, prime.
const STEP: usize = 7;

/// Points of the largest map that a fixture of 20 kB can contain: deflate expands at most 1032-fold.
const MOST_POINTS: usize = 20_000 * 1032;

/// A file that is rewritten in place and read: some file systems write a file that is truncated and written anew to the disk,
/// 2 ms each.
struct Target {
    path: PathBuf,
    file: File,
    _folder: tempfile::TempDir,
}

impl Target {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("scratch");
        let path = folder.path().join("file");
        Target { file: File::create(&path).expect("created"), path, _folder: folder }
    }

    /// Reading gives a map or an error of one line.
    fn check(&mut self, content: &[u8]) {
        self.file.rewind().and_then(|()| self.file.write_all(content)).expect("written");
        self.file.set_len(content.len() as u64).expect("cut");
        match import::read(&self.path, ImportOptions::default()) {
            Ok(found) => assert!(map(&found).heights.len() <= MOST_POINTS),
            Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
        }
    }
}

/// Changes up to three of the first `most` bytes.
fn changed(mut file: Vec<u8>, most: usize, random: &mut ChaCha8Rng) -> Vec<u8> {
    for _ in 0..random.random_range(1..4) {
        file[random.random_range(0..most)] = random.random();
    }
    file
}

#[test]
fn no_change_of_a_file_ends_in_a_panic() {
    let mut target = Target::new();
    let mut names: Vec<String> = expected().into_iter().map(|e| e.file).collect();
    names.push("profile.pro".into());
    names.dedup();
    for name in names {
        let original = bytes(&name);
        (0..original.len()).step_by(STEP).for_each(|length| target.check(&original[..length]));
        let mut random = ChaCha8Rng::seed_from_u64(original.len() as u64);
        for _ in 0..FLIPS {
            // Half of the changes in the first bytes, where the headers are.
            let most = if random.random() { original.len() } else { original.len().min(600) };
            target.check(&changed(original.clone(), most, &mut random));
        }
    }
}

/// Bytes of a part of main.xml that replaces another: some elements.
const LONGEST_PART: usize = 100;

/// Changes of main.xml that the checksum of the archive does not reveal.
#[test]
fn no_change_of_a_description_ends_in_a_panic() {
    let mut target = Target::new();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for name in ["int16.x3p", "list.x3p"] {
        let original = repacked(&bytes(name), "md5checksum.hex", |_| Vec::new());
        for _ in 0..FLIPS {
            // A part of the description is replaced by another part, or single bytes are changed.
            target.check(&repacked(&original, "main.xml", |xml| {
                if random.random() {
                    let most = xml.len();
                    return changed(xml, most, &mut random);
                }
                let [from, to] = [(); 2].map(|()| random.random_range(0..xml.len() - LONGEST_PART));
                let [length, gap] = [(); 2].map(|()| random.random_range(0..LONGEST_PART));
                [&xml[..to], &xml[from..from + length], &xml[to + gap..]].concat()
            }));
        }
    }
}
