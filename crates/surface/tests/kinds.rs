//! Kinds of files that people have besides plain maps: packed ones, archives, arrays in three dimensions, profiles, values that are no
//! heights. Each is read as the map that it is, or refused with the way.
#![cfg(feature = "files")]

use asperity_surface::import::{self, Content, Fourier, ImportOptions, ImportedFile};
use asperity_surface::{MapOptions, Surface, height_map::Touching};
use flate2::Compression;
use flate2::write::GzEncoder;
use ndarray::Array2;
use std::io::{Cursor, Write};
use zip::write::SimpleFileOptions;

fn reads(bytes: &[u8], options: ImportOptions) -> Result<ImportedFile, String> {
    let folder = tempfile::tempdir().expect("scratch");
    let path = folder.path().join("map");
    std::fs::write(&path, bytes).expect("written");
    let found = import::read(&path, options).map_err(|e| e.to_string());
    if let Err(said) = &found {
        assert!(said.starts_with(&path.display().to_string()) && said.contains("; accepted: "), "{said}");
    }
    found
}

fn rows(found: &ImportedFile) -> String {
    let Content::Map(map) = &found.content else { panic!("a map") };
    let row = |r: &[f64]| r.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    map.heights.chunks(map.nx).map(row).collect::<Vec<_>>().join("; ")
}

fn map(bytes: &[u8]) -> String {
    rows(&reads(bytes, ImportOptions::default()).unwrap_or_else(|e| panic!("{e}")))
}

fn refusal(bytes: &[u8]) -> String {
    reads(bytes, ImportOptions::default()).map(|found| rows(&found)).expect_err("refused")
}

fn named(name: &str) -> ImportOptions<'_> {
    ImportOptions { dataset: Some(name), ..ImportOptions::default() }
}

fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut packed = GzEncoder::new(Vec::new(), Compression::default());
    packed.write_all(bytes).expect("packed");
    packed.finish().expect("packed")
}

fn archive(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        archive.start_file(*name, SimpleFileOptions::default()).expect("started");
        archive.write_all(bytes).expect("written");
    }
    archive.finish().expect("finished").into_inner()
}

fn npy(shape: &str, values: &[f64]) -> Vec<u8> {
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
    let header = format!("{header:117}\n");
    let numbers = values.iter().flat_map(|v| v.to_le_bytes());
    b"\x93NUMPY\x01\x00v\x00".iter().copied().chain(header.into_bytes()).chain(numbers).collect()
}

/// A classic NetCDF file with one variable `gap` of doubles, in dimensions of these lengths.
fn netcdf(shape: &[u32], values: &[f64]) -> Vec<u8> {
    let word = |n: u32| n.to_be_bytes().to_vec();
    let dimensions = shape.iter().zip(["t\0\0\0", "y\0\0\0", "x\0\0\0"]);
    let listed = dimensions.flat_map(|(n, name)| [word(1), name.as_bytes().to_vec(), word(*n)].concat());
    let rank = shape.len() as u32;
    let mut head = [b"CDF\x01".to_vec(), word(0), word(10), word(rank), listed.collect(), word(0), word(0)].concat();
    let of = (0..rank).flat_map(word).collect();
    let bytes = 8 * shape.iter().product::<u32>();
    head.extend(
        [word(11), word(1), word(3), b"gap\0".to_vec(), word(rank), of, word(0), word(0), word(6), word(bytes)]
            .concat(),
    );
    let begin = head.len() as u32 + 4;
    head.extend(word(begin));
    head.into_iter().chain(values.iter().flat_map(|v| v.to_be_bytes())).collect()
}

#[test]
fn packed_files_and_archives_are_opened() {
    let text = b"# Value units: nm\n1 2 3\n4 5 6\n";
    let (one, two) = ("1 2 3; 4 5 6", "7 8; 9 7");
    assert_eq!(map(&packed(text)), one);
    assert_eq!(map(&packed(&npy("(2, 3)", &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]))), one);
    assert_eq!(map(&archive(&[("a/map.txt", text), ("__MACOSX/a/._map.txt", b"\0")])), one);
    let several = archive(&[("map.txt", text), ("b.csv", b"7,8\n9,7\n")]);
    let said = refusal(&several);
    assert!(
        said.contains("an archive of 2 files") && said.contains("--dataset") && said.contains("map.txt, b.csv"),
        "{said}"
    );
    assert_eq!(rows(&reads(&several, named("b.csv")).expect("named")), two);
    assert!(reads(&several, named("c.csv")).expect_err("unknown").contains("no file named \"c.csv\""));
    // Several x3p in one archive.
    assert!(refusal(&archive(&[("a/main.xml", b"<a/>"), ("b/main.xml", b"<b/>")])).contains("an archive of 2 files"));
    // Errors name the outer file; what unfolds without bound is refused.
    assert!(refusal(&packed(b"1 2\n3 oak\n")).contains("\"oak\" on line 2"));
    assert!(refusal(&packed(&packed(text))).contains("inside of packed data"));
    assert!(refusal(&packed(text)[..20]).contains("damaged packed data"));
    assert!(refusal(&packed(&vec![b' '; 70 << 20])).contains("more than 67108864 bytes"));
}

#[test]
fn arrays_in_three_dimensions_are_planes() {
    let values: Vec<f64> = (0..12).map(|i| f64::from(i * i % 7)).collect();
    let (first, second) = ("0 1 4; 2 2 4", "1 0 1; 4 2 2");
    assert_eq!(map(&npy("(1, 2, 3)", &values[..6])), first);
    assert_eq!(map(&netcdf(&[1, 2, 3], &values[..6])), first);
    assert_eq!(map(&netcdf(&[2, 3], &values[..6])), first);
    let frames = netcdf(&[2, 2, 3], &values);
    let said = refusal(&frames);
    assert!(said.contains("gap[0] of 2 x 3, gap[1] of 2 x 3") && said.contains("--dataset"), "{said}");
    for (name, plane) in [("gap[0]", first), ("gap[1]", second)] {
        assert_eq!(rows(&reads(&frames, named(name)).expect(name)), plane);
    }
    assert!(reads(&frames, named("gap[2]")).is_err() && reads(&frames, named("gap")).is_err());
    let stack = npy("(2, 2, 3)", &values);
    let said = refusal(&stack);
    assert!(said.contains("array[0] of 2 x 3, array[1] of 2 x 3") && said.contains("--dataset"), "{said}");
    for (name, plane) in [("array[0]", first), ("array[1]", second)] {
        assert_eq!(rows(&reads(&stack, named(name)).expect(name)), plane);
        let found = reads(&packed(&stack), named(name)).expect(name);
        assert_eq!((rows(&found), found.declared.channel.as_deref()), (plane.to_string(), Some(name)));
    }
    assert!(reads(&stack, named("array[2]")).is_err());
    assert!(reads(&npy("(2, 3)", &values[..6]), named("array[0]")).expect_err("one").contains("without names"));
    assert!(reads(&npy("(2, 2, 3)", &values[..11]), named("array[0]")).expect_err("cut").contains("too few"));
    let npz = archive(&[("cube.npy", &npy("(2, 2, 3)", &values))]);
    let said = refusal(&npz);
    assert!(said.contains("cube[0] of 2 x 3, cube[1] of 2 x 3") && said.contains("--dataset"), "{said}");
    for (name, plane) in [("cube[0]", first), ("cube[1]", second)] {
        assert_eq!(rows(&reads(&npz, named(name)).expect(name)), plane);
    }
    assert!(reads(&npz, named("cube[2]")).is_err() && reads(&npz, named("cube")).is_err());
    let four = archive(&[("cube.npy", &npy("(2, 1, 2, 3)", &values))]);
    assert_eq!(rows(&reads(&four, named("cube[1]")).expect("a plane")), second);
    // Each plane has its part of a mask.
    let hole: Vec<f64> = (0..12).map(|i| f64::from(u8::from(i == 6))).collect();
    let masked = archive(&[("cube.npy", &npy("(2, 2, 3)", &values)), ("mask.npy", &npy("(2, 2, 3)", &hole))]);
    assert_eq!(rows(&reads(&masked, named("cube[0]")).expect("a plane")), first);
    assert_eq!(rows(&reads(&masked, named("cube[1]")).expect("a plane")), "NaN 0 1; 4 2 2");
    assert!(!refusal(&masked).contains("mask["), "{}", refusal(&masked));
    // A map beside a stack is the map, and the mask that of the stack.
    let hidden = npy("(2, 2, 3)", &[1.0; 12]);
    let topo = npy("(2, 3)", &values[..6]);
    let both = archive(&[("topo.npy", &topo), ("cube.npy", &npy("(2, 2, 3)", &values))]);
    assert_eq!(map(&both), first);
    assert_eq!(
        map(&archive(&[("topo.npy", &topo), ("cube.npy", &npy("(2, 2, 3)", &values)), ("mask.npy", &hidden)])),
        first
    );
    assert_eq!(rows(&reads(&both, named("cube[1]")).expect("a plane")), second);
    let cut = archive(&[("cube.npy", &npy("(2, 2, 3)", &values[..11]))]);
    assert!(reads(&cut, named("cube[0]")).expect_err("too few").contains("too few"));
}

/// Positions with heights, down, up, and in lines, are refused in every format, unless they are said to be heights.
#[test]
fn profiles_are_no_maps() {
    let height = |i: u32| f64::from(i * i % 7) / 7.0;
    let rows_of = |x: &dyn Fn(u32) -> f64| -> String { (0..30).map(|i| format!("{} {}\n", x(i), height(i))).collect() };
    let up = rows_of(&|i| 0.125 * f64::from(i));
    let down = rows_of(&|i| -0.3 * f64::from(i * i));
    let rounded = rows_of(&|i| (0.7 * f64::from(i)).floor());
    let line: String = (0..30)
        .map(|i| format!("{i} "))
        .chain(["\n".into()])
        .chain((0..30).map(|i| format!("{} ", height(i))))
        .collect();
    let array: Vec<f64> = (0..30).flat_map(|i| [f64::from(i), height(i)]).collect();
    for file in [up.as_bytes(), down.as_bytes(), rounded.as_bytes(), line.as_bytes(), &npy("(30, 2)", &array)] {
        let said = refusal(file);
        assert!(said.contains("probably a profile") && said.contains("--fourier none"), "{said}");
    }
    let options = ImportOptions { fourier: Some(Fourier::None), ..ImportOptions::default() };
    assert!(reads(up.as_bytes(), options).is_ok());
}

/// The size of a table, and units without names, stand above it in exports of profilers.
#[test]
fn sizes_and_units_stand_above_tables() {
    let plain = "1 2 4\n3 5 6\n";
    for size in ["2", "6", "3 2", "2 3"] {
        assert_eq!(map(format!("{size}\n{plain}").as_bytes()), "1 2 4; 3 5 6");
    }
    for size in ["3", "5", "2 2", "0", "2.5", "-2"] {
        assert!(refusal(format!("{size}\n{plain}").as_bytes()).contains("on line"), "{size}");
    }
    assert!(refusal(format!("2\n3 2\n{plain}").as_bytes()).contains("on line 3"));
    let points = "0 0 1\n0.5 0 2\n0 0.5 3\n0.5 0.5 4\n";
    for text in [format!("um um nm\n4\n{points}"), format!("# [um] [um] [nm]\n{points}")] {
        let found = reads(text.as_bytes(), ImportOptions::default()).expect("points");
        let extent = found.declared.extent.as_ref().map(|e| (e.x, e.unit.clone()));
        assert_eq!((rows(&found), extent), ("1 2; 3 4".into(), Some((1.0, Some("um".into())))));
        assert_eq!(found.declared.unit.as_deref(), Some("nm"));
    }
    for text in [format!("um um nm\nx y z\n{points}"), format!("# [um] [um] [nm]\n# x y z\n{points}")] {
        let found = reads(text.as_bytes(), ImportOptions::default()).expect("points");
        assert_eq!((rows(&found), found.declared.unit.as_deref()), ("1 2; 3 4".into(), Some("nm")));
    }
    // Above the names, and both sides of the grid.
    for head in
        ["4\num um nm\n", "2 2\num um nm\n", "4\nx (um),y (um),z (nm)\n", "4\n# x[um] y[um] z[nm]\n", "um um nm\n2 2\n"]
    {
        let found = reads(format!("{head}{points}").as_bytes(), ImportOptions::default()).expect(head);
        let extent = found.declared.extent.as_ref().map(|e| (e.x, e.unit.clone()));
        assert_eq!((rows(&found), extent), ("1 2; 3 4".into(), Some((1.0, Some("um".into())))), "{head}");
        assert_eq!(found.declared.unit.as_deref(), Some("nm"), "{head}");
    }
    for head in ["5\num um nm\n", "3 2\nx y z\n", "# nx: 3\n# ny: 2\n", "# nx: 5\n"] {
        refusal(format!("{head}{points}").as_bytes());
    }
    // As wide as the table: one of its lines, or its size?
    for text in ["2 3\n1 2\n5 3\n2 7\n", "3 2\n1 2\n5 3\n2 7\n", "2 2\n1.5 2\n3 4\n"] {
        assert!(refusal(text.as_bytes()).contains("on line 1, the size of the lines below it"), "{text}");
    }
    assert_eq!(map(b"3 3\n1 2\n5 3\n2 7\n"), "3 3; 1 2; 5 3; 2 7");
    assert!(refusal(b"1\n2 3\n").contains("on line 1"));
    // Heights by their header or by a word of the user, and even positions.
    assert_eq!(map(b"# nx: 2\n# ny: 4\n2 3\n1 2\n5 3\n2 7\n"), "2 3; 1 2; 5 3; 2 7");
    let heights = ImportOptions { fourier: Some(Fourier::None), ..ImportOptions::default() };
    assert_eq!(rows(&reads(b"2 3\n1 2\n5 3\n2 7\n", heights).expect("heights")), "2 3; 1 2; 5 3; 2 7");
    // Words above the names are no units of theirs.
    for text in ["Height_nm scan data\nx y z\n", "z [nm] x [um] y [um]\nx y z\n"] {
        let found = reads(format!("{text}{points}").as_bytes(), ImportOptions::default()).expect("points");
        assert_eq!((found.declared.unit, found.declared.extent.and_then(|e| e.unit)), (None, None), "{text}");
    }
    let profile = ImportOptions { profile: true, ..ImportOptions::default() };
    let counted = reads("3\nx (um)\tz (nm)\n0.5\t7\n1.0\t8\n1.5\t6\n".as_bytes(), profile).expect("a profile");
    assert_eq!((rows(&counted), counted.declared.unit.as_deref()), ("7 8 6".into(), Some("nm")));
    for head in ["# nx: 4\n", "4\nx (um)\tz (nm)\n"] {
        let said = reads(format!("{head}0.5\t7\n1.0\t8\n1.5\t6\n").as_bytes(), profile).expect_err("three points");
        assert!(said.contains("cut off"), "{said}");
    }
    let named = reads("x [um];z [nm]\n2;4\n3;1\n4;2\n5;9\n6;1\n".as_bytes(), profile).expect("even positions");
    assert_eq!(rows(&named), "4 1 2 9 1");
    assert_eq!(rows(&reads("5\n1 2 3 4 7\n".as_bytes(), profile).expect("a line of five")), "1 2 3 4 7");
    let counted = reads("3\n0.5\n1.5\n1\n".as_bytes(), profile).expect_err("a size or a height");
    assert!(counted.contains("the size of the lines below it"), "{counted}");
    let found = reads("µm nm\n3\n0.5 7\n1.0 8\n1.5 6\n".as_bytes(), profile).expect("a profile");
    assert_eq!((rows(&found), found.declared.unit.as_deref()), ("7 8 6".into(), Some("nm")));
    let cut = reads("µm nm\n4\n0.5 7\n1.0 8\n1.5 6\n".as_bytes(), profile).expect_err("three of four lines");
    assert!(cut.contains("cut off"), "{cut}");
}

/// Two statements of one extent or unit agree, whatever their units are, or are refused.
#[test]
fn statements_that_contradict_each_other_are_refused() {
    let table = "1.5 2 3 1\n2 1 2 3\n3 3 1 2\n1 2 2 3\n";
    let read = |head: &str| reads(format!("{head}{table}").as_bytes(), ImportOptions::default());
    for head in [
        "# Width: 4 um\n# pixel size: 1 um\n",
        "# Width: 4 um\n# pixel size: 1000 nm\n",
        "# pixel size: 1000 nm\n# Width: 4 um\n",
        "# Width: 4 um\n# x-unit: nm\n",
        "# Width: 3 um\n# dx: 1 um\n",
        "# Value units: nm\n# z-unit: nm\n",
    ] {
        let found = read(head).expect(head);
        let metres = found.declared.extent.map(|e| e.x * if e.unit.as_deref() == Some("nm") { 1e-3 } else { 1.0 });
        assert!(metres.is_none_or(|x| (x - 4.0).abs() < 1.01), "{head}: {metres:?}");
    }
    for head in [
        "# Width: 4 um\n# pixel size: 0.5 um\n",
        "# Width: 4 um\n# spacing: 2 um\n",
        "# Width: 4 um\n# Height: 4 um\n# dx: 0.5 um\n",
        "# Width: 4 um\n# dy: 500 nm\n# Height: 4 um\n",
        "# dx: 1 nm\n# Width: 4 um\n",
        "# Value units: nm\n# z-unit: um\n",
    ] {
        assert!(read(head).is_err_and(|said| said.contains("header") || said.contains("one unit")), "{head}");
    }
}

#[test]
fn values_that_are_no_heights_are_refused() {
    for unit in ["%", "V", "deg", "nA"] {
        let text = format!("# unit: {unit}\n1 2\n3 4\n");
        assert!(refusal(text.as_bytes()).contains("which are no heights"), "{unit}");
    }
    assert!(reads(b"# unit: counts\n1 2\n3 4\n", ImportOptions::default()).is_ok());
}

/// Texts of instruments, and maps under sections, are no scenes.
#[test]
fn sections_are_told_from_scenes() {
    let folder = tempfile::tempdir().expect("scratch");
    let is_heights = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("written");
        import::holds_numbers(&path).expect("read")
    };
    let sections = "[Header]\nWidth = 12 um\nValue units = nm\n[Data]\n1 2 3\n4 5 7\n";
    assert!(is_heights("map.txt", sections));
    assert_eq!(map(sections.as_bytes()), "1 2 3; 4 5 7");
    let scene = "name = \"a\"\n[surface]\ngrid = 64\n[load]\np_star = [\n  0.01,\n  0.05\n]\n";
    assert!(!is_heights("scene.toml", scene) && !is_heights("scene", scene));
}

/// Waves at the limit of the grid are there, whatever the pixels are.
#[test]
fn heights_of_oblong_pixels_come_back() {
    let heights = Array2::from_shape_fn((6, 8), |(y, x)| f64::from((x * x * 5 + y * x * 3 + y * 7) as u32 % 11));
    for length_y in [0.75, 0.7500005, 1.1] {
        let options = MapOptions { length_y: Some(length_y), ..MapOptions::new(1.0, Touching::LowPoints) };
        let found = Surface::from_map(heights.view(), &options).expect("a map").heights();
        let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
        let off = found.iter().zip(&heights).map(|(a, b)| (a - (b - lowest)).abs()).fold(0.0, f64::max);
        assert!(off < 1e-9, "{length_y}: {off:e}");
    }
}
