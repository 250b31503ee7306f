//! Valid scenes are accepted, and invalid ones are refused with a clear error and the documented exit code.
//!
//! The first lines of an invalid scene state the expected error: `# expect CODE: piece` for each line of the message,
//! in order, and `# about: FILE` if the error concerns another file than the scene.

use crate::program::{asperity, json_line, stderr};
use std::path::{Path, PathBuf};
use std::process::Output;

const HEAD: &str = "asperity: error: ";

fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Scene files of a folder; an empty folder fails, because the test would verify nothing.
fn scenes(folder: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(repository().join(folder)).expect("a folder of scenes");
    let mut list: Vec<PathBuf> = entries.map(|e| e.expect("readable").path()).collect();
    list.retain(|p| p.extension().is_some_and(|e| e == "toml"));
    list.sort();
    assert!(!list.is_empty(), "{folder} holds no scenes");
    list
}

fn name(path: &Path) -> String {
    path.file_name().expect("a file").to_string_lossy().into_owned()
}

fn run(scene: &Path, out: &Path, flags: &[&str]) -> Output {
    asperity().arg("run").arg(scene).arg("--out").arg(out).args(flags).output().expect("started")
}

/// The expected error of an invalid scene.
struct Expected {
    code: i32,
    pieces: Vec<String>,
    about: String,
}

impl Expected {
    fn read(scene: &Path) -> Self {
        let text = std::fs::read_to_string(scene).expect("readable");
        let lines = |mark: &'static str| text.lines().filter_map(move |l| l.strip_prefix(mark));
        let expectations: Vec<(i32, String)> = lines("# expect ")
            .map(|l| {
                let (code, piece) = l.split_once(": ").unwrap_or_else(|| panic!("{}: {l}", scene.display()));
                (code.parse().expect("an exit code"), piece.to_string())
            })
            .collect();
        let code = expectations.first().unwrap_or_else(|| panic!("{} expects nothing", scene.display())).0;
        let about = lines("# about: ").next().map_or_else(|| name(scene), str::to_string);
        Expected { code, pieces: expectations.into_iter().map(|(_, p)| p).collect(), about }
    }
}

/// Deviations from the expected message: one head line and one line per error, in order, each with the file and the
/// expected text.
fn refusal_faults(output: &Output, expected: &Expected) -> Vec<String> {
    let said = stderr(output);
    let lines: Vec<&str> = said.trim_end().lines().collect();
    let mut faults = Vec::new();
    let mut unless = |good: bool, fault: String| {
        if !good {
            faults.push(fault)
        }
    };
    unless(output.status.code() == Some(expected.code), format!("{} instead of {}", output.status, expected.code));
    unless(output.stdout.is_empty(), "something on stdout".into());
    unless(said.starts_with(HEAD) && said.matches(HEAD).count() == 1, "not one head line".into());
    unless(lines.len() == expected.pieces.len(), format!("not {} lines", expected.pieces.len()));
    for (line, piece) in lines.iter().zip(&expected.pieces) {
        unless(line.contains(&expected.about), format!("{line:?} does not name {}", expected.about));
        unless(line.contains(piece.as_str()), format!("{line:?} lacks {piece:?}"));
    }
    if faults.is_empty() { faults } else { [vec![format!("{}: {said}", expected.about)], faults].concat() }
}

fn check_refusal(output: &Output, expected: &Expected) {
    let faults = refusal_faults(output, expected);
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn good_scenes_and_shipped_ones_are_planned() {
    for scene in scenes("tests/scenes/good").into_iter().chain(scenes("configs")) {
        let scratch = tempfile::tempdir().expect("scratch");
        let out = scratch.path().join("run");
        let output = run(&scene, &out, &["--dry-run", "--json"]);
        assert!(output.status.success(), "{}", stderr(&output));
        let plan = json_line(&output);
        let stages = plan["stages"].as_array().expect("stages");
        let of = |stage: &serde_json::Value, key: &str| stage[key].as_f64().expect("a number");
        assert!(stages.iter().all(|s| of(s, "bytes") > 0.0 && of(s, "seconds") > 0.0), "{}: {plan}", scene.display());
        let names: Vec<&str> = stages.iter().map(|s| s["name"].as_str().expect("a name")).collect();
        let text = std::fs::read_to_string(&scene).expect("readable");
        if text.lines().any(|l| l.trim() == "[atoms]") {
            let held: &[&str] = if text.lines().any(|l| l.trim() == "[atoms.nvt]") { &["nvt"] } else { &[] };
            let yields: &[&str] = if text.lines().any(|l| l.starts_with("hardness")) { &["yielding"] } else { &[] };
            let expected =
                [&["surface", "continuum", "matched", "lammps", "atoms"], held, yields, &["compare", "report"]]
                    .concat();
            assert_eq!(names, expected, "{}", scene.display());
            let counts = ["deformable", "fixed", "indenter"].map(|k| plan["atoms"][k].as_u64().expect("a count"));
            assert!(counts.iter().all(|n| *n > 0), "{}: {plan}", scene.display());
        } else {
            let others: &[&str] =
                if text.lines().any(|l| l.trim() == "[challenge]") { &["non-adhesive", "cross-check"] } else { &[] };
            assert_eq!(names, [&["surface", "continuum"], others, &["report"]].concat(), "{}", scene.display());
            assert!(plan["atoms"].is_null());
        }
        let most = stages.iter().map(|s| of(s, "bytes")).fold(0.0, f64::max);
        assert_eq!(of(&plan, "bytes"), most);
        assert!(of(&plan, "seconds") > 0.0);
        assert!(!out.exists(), "{}: a dry run has left something", scene.display());
    }
}

#[test]
fn bad_scenes_are_refused_and_leave_nothing() {
    let mut faults = Vec::new();
    for scene in scenes("tests/scenes/bad") {
        let scratch = tempfile::tempdir().expect("scratch");
        let out = scratch.path().join("run");
        faults.extend(refusal_faults(&run(&scene, &out, &["--json"]), &Expected::read(&scene)));
        if out.exists() {
            faults.push(format!("{} has left a run folder", name(&scene)));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// A key of `[surface]` has a meaning for the surface of the scene, or is refused: those of spectra, maps and Fourier coefficients.
#[test]
fn keys_of_other_surfaces_are_refused() {
    const LOAD: &str = "[load]\np_star = [0.01]\n[laboratory]\nmodulus = \"1 GPa\"\n";
    let scratch = tempfile::tempdir().expect("scratch");
    let write = |name: &str, text: &str| std::fs::write(scratch.path().join(name), text).expect("written");
    let rows = (0..16).map(|y| (0..16).map(|x| format!("{} ", (x * 7 + y * 5) % 11)).collect::<String>() + "\n");
    write("map.txt", &rows.collect::<String>());
    write("waves.txt", "1 0 0.5 0\n0 1 0.5 0\n");
    let of_maps = "length = \"1 um\"\n[surface]\nheights = \"map.txt\"\nunit = \"nm\"\ntouching = \"low-points\"\n";
    let of_waves = "length = \"1 um\"\n[surface]\nheights = \"waves.txt\"\nunit = \"nm\"\ntouching = \"low-points\"\nfourier = \"series\"\n";
    // Each key, its value, and whether a spectrum, a map and waves have it.
    let keys = [
        ("grid", "64", [true, false, true]),
        ("seed", "5", [true, false, false]),
        ("hurst", "0.6", [true, false, false]),
        ("roll_off", "\"1 um\"", [true, false, false]),
        ("roll_off_mode", "2", [true, false, false]),
        ("cut_off", "\"0.1 um\"", [true, false, false]),
        ("cut_off_mode", "20", [true, false, false]),
        ("rms_gradient", "0.5", [true, false, false]),
        ("amplitudes", "\"fixed\"", [true, false, false]),
        ("unit", "\"nm\"", [false, true, true]),
        ("dataset", "\"a\"", [false; 3]),
        ("via_python", "true", [false; 3]),
        ("profile", "true", [false; 3]),
        ("fourier", "\"none\"", [false, true, true]),
        ("fourier_points", "8", [false; 3]),
        ("touching", "\"low-points\"", [false, true, true]),
        ("crop", "[0, 0, 8, 8]", [false, true, false]),
        ("remove_outliers", "5", [false, true, false]),
        ("fill", "\"harmonic\"", [false, true, false]),
        ("detrend", "\"plane\"", [false, true, false]),
        ("low_pass", "\"0.2 um\"", [false, true, true]),
        ("high_pass", "\"0.5 um\"", [false, true, false]),
        ("filter", "\"sharp\"", [false; 3]),
        ("resample", "[32, 32]", [false, true, false]),
        ("edges", "\"taper\"", [false, true, false]),
        ("extend_to", "\"0.1 um\"", [false; 3]),
        ("isotropic_map", "true", [false; 3]),
        ("other", "{ heights = \"map.txt\" }", [false, true, false]),
        ("strict", "false", [true, true, true]),
    ];
    let schema: serde_json::Value =
        serde_json::from_slice(&asperity().arg("schema").output().expect("started").stdout).expect("a schema");
    let all = schema["$defs"]["SurfaceScene"]["properties"].as_object().expect("properties");
    let known: Vec<&str> = keys.iter().map(|k| k.0).chain(["heights"]).collect();
    assert!(all.keys().all(|key| known.contains(&key.as_str())) && all.len() == known.len(), "{:?}", all.keys());
    let mut faults = Vec::new();
    for (kind, surface) in ["length = \"1 um\"\n[surface]\n", of_maps, of_waves].into_iter().enumerate() {
        for (key, value, has) in keys {
            // What the file has not is said in words of the file.
            let of_file = ["dataset", "via_python", "profile"].contains(&key);
            let own: String =
                surface.lines().filter(|l| !l.starts_with(&format!("{key} "))).map(|l| format!("{l}\n")).collect();
            write("s.toml", &format!("name = \"s\"\n{LOAD}{own}{key} = {value}\n"));
            let output = run(&scratch.path().join("s.toml"), &scratch.path().join("run"), &["--dry-run"]);
            let said = stderr(&output);
            let refused = !output.status.success() && !said.contains("panicked");
            let named = refused && (kind > 0 && of_file || said.contains(&format!("surface.{key} ")));
            let accepted = output.status.success();
            if !(if has[kind] { accepted } else { named }) {
                faults.push(format!("{kind} {key}: {}", stderr(&output)));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn a_scene_that_is_not_there_is_named() {
    let scratch = tempfile::tempdir().expect("scratch");
    let output = run(&scratch.path().join("nowhere.toml"), &scratch.path().join("run"), &[]);
    let pieces = vec!["cannot read".to_string()];
    check_refusal(&output, &Expected { code: 2, pieces, about: "nowhere.toml".into() });
}

/// The `.npy` file is created here, because the folder of scenes contains only text.
#[test]
fn a_height_that_is_no_number_is_reported_by_row_and_column() {
    const SCENE: &str = "name = \"n\"\n[laboratory]\nlength = \"1 um\"\nmodulus = \"1 MPa\"\n[surface]\nheights = \"h.npy\"\nunit = \"um\"\n\
                         touching = \"low-points\"\n[load]\np_star = [0.01]\n";
    let scratch = tempfile::tempdir().expect("scratch");
    let (nx, ny) = (8, 4);
    for (value, says) in [
        (f64::NAN, "1 of 32 points were not measured, the first in row 3, column 6"),
        (f64::INFINITY, "the height in row 3, column 6 (counted from 1) is inf"),
    ] {
        let heights = (0..nx * ny).map(|i| if i == 2 * nx + 5 { value } else { (i % nx) as f64 });
        asperity::surface::files::npy::write(&scratch.path().join("h.npy"), nx, ny, heights).expect("written");
        let scene = scratch.path().join("n.toml");
        std::fs::write(&scene, SCENE).expect("written");
        let out = scratch.path().join("run");
        let pieces = vec![says.to_string()];
        check_refusal(&run(&scene, &out, &[]), &Expected { code: 2, pieces, about: "h.npy".into() });
        assert!(!out.exists());
    }
}

/// A folder below a regular file cannot be created, even by root.
#[test]
fn a_run_folder_that_cannot_be_written_is_named() {
    let scratch = tempfile::tempdir().expect("scratch");
    let file = scratch.path().join("file");
    std::fs::write(&file, "in the way").expect("written");
    let output = run(&repository().join("tests/scenes/good/cut-offs-by-mode.toml"), &file.join("run"), &[]);
    let pieces = vec!["cannot create the run folder".to_string()];
    check_refusal(&output, &Expected { code: 2, pieces, about: "file/run".into() });
    assert_eq!(std::fs::read_to_string(&file).expect("untouched"), "in the way");
}

/// Refused before memory is allocated, with required and available memory.
#[test]
fn a_scene_that_does_not_fit_is_refused_before_it_starts() {
    let scratch = tempfile::tempdir().expect("scratch");
    let scene = scratch.path().join("huge.toml");
    std::fs::write(&scene, "name = \"huge\"\n[surface]\ngrid = 65536\n[load]\np_star = [0.01]\n").expect("written");
    let out = scratch.path().join("run");
    let plan = json_line(&run(&scene, &out, &["--dry-run", "--json"]));
    let fields = 8.0 * 65536f64.powi(2);
    // At least the memory of heights, gap and stress.
    assert!(plan["bytes"].as_f64().expect("bytes") > 3.0 * fields, "{plan}");
    if plan["bytes"].as_u64() <= Some(asperity::grid::sys::available_memory_bytes()) {
        println!("not tested: this machine has the memory");
        return;
    }
    let output = run(&scene, &out, &[]);
    assert_eq!(output.status.code(), Some(5), "{}", stderr(&output));
    assert!(stderr(&output).contains("the scene needs"), "{}", stderr(&output));
    assert!(!out.exists());
}
