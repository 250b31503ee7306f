//! Faults of disk, files, scenes and programs: what evidence/reliability.md promises.

use crate::folder::{fields, files, of_the_scene};
use crate::lammps::lammps;
use crate::measure;
use crate::program::{asperity, json_line, stderr};
use crate::tools;
use serde_json::Value;
use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Time in which a request that is refused is answered. A debug build on a busy machine takes several times that of a
/// release build, which needs less than a second.
const ANSWERED: Duration = Duration::from_secs(10);

/// One load of two methods on a grid of 16² points, whose report has few figures.
const SCENE: &str = "name = \"small\"\n[laboratory]\nlength = \"100 um\"\nmodulus = \"25 MPa\"\n\
                     [surface]\ngrid = 16\ncut_off_mode = 6\n[load]\np_star = [0.02]\n\
                     [continuum]\nmethod = \"fast\"\ncompare_with = [\"winkler\"]\n";

/// A scene with atoms, up to the path of LAMMPS.
const ATOMS: &str = "name = \"a\"\n[surface]\ngrid = 16\ncut_off_mode = 6\n[load]\np_star = [0.01]\n\
                     [atoms]\ncells = 10\ndepth_cells = 4\nprogram = ";

#[derive(Debug, Clone, Copy, PartialEq)]
enum Damage {
    Flipped,
    Truncated,
    Removed,
}

const DAMAGES: [Damage; 3] = [Damage::Flipped, Damage::Truncated, Damage::Removed];

fn damage(file: &Path, how: Damage) {
    let mut bytes = fs::read(file).expect("read");
    match how {
        Damage::Flipped => {
            let middle = bytes.len() / 2;
            bytes.get_mut(middle).into_iter().for_each(|b| *b ^= 1);
        }
        Damage::Truncated => bytes.truncate(bytes.len() / 2),
        Damage::Removed => return fs::remove_file(file).expect("removed"),
    }
    fs::write(file, bytes).expect("written");
}

fn copy(from: &Path, to: &Path) {
    for file in files(from) {
        let target = to.join(&file);
        fs::create_dir_all(target.parent().expect("has one")).expect("made");
        fs::copy(from.join(&file), target).expect("copied");
    }
}

fn scene(folder: &Path) -> PathBuf {
    let file = folder.join("small.toml");
    fs::write(&file, SCENE).expect("written");
    file
}

/// What is compared of a folder: the bytes of its fields, and results.
type Found = (Vec<(PathBuf, Vec<u8>)>, Value);

/// [`fields`] of a folder, and the results in one of its JSON files.
fn contents(folder: &Path, results: &str) -> Found {
    let text = fs::read(folder.join(results)).expect("results");
    (fields(folder), of_the_scene(&serde_json::from_slice(&text).expect("JSON")))
}

/// Damages files of a finished folder and runs the command again: the results are those of the whole folder, and files
/// that a stage reads back are named. Each group of files is damaged together.
fn survives_damage(
    command: &dyn Fn(&Path) -> Command,
    found: &dyn Fn(&Path) -> Found,
    verified: &dyn Fn(&Path) -> bool,
    groups: fn(Vec<PathBuf>) -> Vec<Vec<PathBuf>>,
) {
    let scratch = tempfile::tempdir().expect("scratch");
    let (whole, out) = (scratch.path().join("whole"), scratch.path().join("out"));
    let run = |out: &Path| {
        let output = command(out).output().expect("started");
        // Statements of the challenge fail on a coarse grid.
        assert!(output.status.code().is_some_and(|c| c < 2), "{}", stderr(&output));
        stderr(&output)
    };
    run(&whole);
    let expected = found(&whole);
    // Figures are drawn again by every run, which reads none.
    let all: Vec<PathBuf> = files(&whole).into_iter().filter(|f| !f.starts_with("figures")).collect();
    assert!(all.len() > 3, "{all:?}");
    for (group, how) in groups(all).iter().flat_map(|g| DAMAGES.map(|how| (g, how))) {
        if out.exists() {
            fs::remove_dir_all(&out).expect("removed");
        }
        copy(&whole, &out);
        group.iter().for_each(|file| damage(&out.join(file), how));
        let said = run(&out);
        let after = found(&out);
        assert_eq!(after.1, expected.1, "{how:?} {group:?}: {said}");
        assert!(after.0 == expected.0, "{how:?} {group:?}: a field differs: {said}");
        for file in group.iter().filter(|f| verified(f)) {
            assert!(said.contains(file.to_str().expect("UTF-8")), "{how:?} {}: {said}", file.display());
        }
    }
}

fn each_alone(files: Vec<PathBuf>) -> Vec<Vec<PathBuf>> {
    files.into_iter().map(|f| vec![f]).collect()
}

/// One file of each stage at a time: stages are damaged, and computed again, independently. Files of the folder itself alone:
/// without its marker and all records of stages it is no run folder.
fn one_of_each_stage(files: Vec<PathBuf>) -> Vec<Vec<PathBuf>> {
    let mut stages: BTreeMap<PathBuf, Vec<PathBuf>> = BTreeMap::new();
    let (own, of_stages): (Vec<_>, Vec<_>) = files.into_iter().partition(|f| f.components().count() == 1);
    for file in of_stages {
        stages.entry(file.parent().expect("has one").to_path_buf()).or_default().push(file);
    }
    let most = stages.values().map(Vec::len).max().unwrap_or(0);
    let groups = (0..most).map(|k| stages.values().filter_map(|s| s.get(k).cloned()).collect());
    each_alone(own).into_iter().chain(groups).collect()
}

/// Whether a damage of this file of a stage leads to a warning that names it. Files of attempts are not read back.
fn is_listed(file: &Path) -> bool {
    let name = file.file_name().and_then(OsStr::to_str).expect("a name");
    let in_stage = file.components().count() > 1;
    in_stage && !["done.json", "key.json", "spent.json"].contains(&name)
}

#[test]
fn a_damaged_run_folder_gives_the_results_of_a_whole_one() {
    let scratch = tempfile::tempdir().expect("scratch");
    let scene = scene(scratch.path());
    let command = |out: &Path| {
        let mut command = asperity();
        command.arg("run").arg(&scene).arg("--json").arg("--out").arg(out);
        command
    };
    survives_damage(&command, &|out| contents(out, "results.json"), &is_listed, each_alone);
}

#[test]
fn a_damaged_tradeoff_folder_gives_the_results_of_a_whole_one() {
    let scratch = tempfile::tempdir().expect("scratch");
    let scene = scene(scratch.path());
    let command = |out: &Path| {
        let mut command = asperity();
        command.arg("tradeoff").arg(&scene).args(["--methods", "fast,scgw", "--grids", "16", "--repeats", "1"]);
        command.arg("--out").arg(out);
        command
    };
    // Costs are measured again.
    let found = |out: &Path| {
        let (fields, value) = contents(out, "tradeoff.json");
        let points = value["points"].as_array().expect("points").iter();
        (
            fields,
            points
                .map(|p| [&p["method"], &p["tolerance"], &p["errors"]].map(Value::clone).into_iter().collect::<Value>())
                .collect(),
        )
    };
    survives_damage(&command, &found, &is_listed, each_alone);
}

#[test]
fn a_damaged_challenge_gives_the_results_of_a_whole_one() {
    let command = |out: &Path| {
        let mut command = asperity();
        command.args(["challenge", "--grid", "32", "--out"]).arg(out);
        command
    };
    survives_damage(&command, &|out| contents(out, "results.json"), &is_listed, one_of_each_stage);
}

/// A damaged solve is solved again, and the fields of an undamaged one are reused.
#[test]
fn a_damaged_solve_folder_gives_the_results_of_a_whole_one() {
    let command = |out: &Path| {
        let mut command = asperity();
        command.args(["solve", "--challenge", "16", "--cut-off", "0.15", "--pressure", "0.01,0.02", "--json"]);
        command.args(["--method", "fast"]).arg("--out").arg(out);
        command
    };
    let listed = |file: &Path| file.extension() == Some(OsStr::new("npy")) || file.ends_with("load-1-solve.json");
    survives_damage(&command, &|out| contents(out, "load-2-solve.json"), &listed, each_alone);
    let scratch = tempfile::tempdir().expect("scratch");
    let out = scratch.path().join("out");
    let run = |flags: &[&str]| stderr(&command(&out).args(flags).output().expect("started"));
    run(&[]);
    assert!(run(&[]).contains("finished already"));
    damage(&out.join("load-1-gap.npy"), Damage::Flipped);
    assert!(run(&["--no-verify"]).contains("finished already"), "verified in spite of --no-verify");
    let said = run(&[]);
    assert!(said.contains("load-1-gap.npy changed") && said.contains("solved again"), "{said}");
}

/// `report` and `compare` do not compute: they refuse a damaged folder and say how to repair it.
#[test]
fn the_report_of_a_damaged_folder_is_refused_with_the_remedy() {
    let scratch = tempfile::tempdir().expect("scratch");
    let (scene, out) = (scene(scratch.path()), scratch.path().join("out"));
    let run = || asperity().arg("run").arg(&scene).arg("--out").arg(&out).output().expect("started");
    assert!(run().status.success());
    let report = || asperity().arg("report").arg(&out).output().expect("started");
    assert!(report().status.success());
    for file in ["results.json", "scene.toml", "surface/heights.npy"] {
        damage(&out.join(file), Damage::Flipped);
        let refused = report();
        assert_eq!(refused.status.code(), Some(2), "{}", stderr(&refused));
        let said = stderr(&refused);
        assert!(said.contains(file) && said.contains("computes again"), "{said}");
        let repaired = run();
        assert!(repaired.status.success() && stderr(&repaired).contains(file), "{}", stderr(&repaired));
        assert!(report().status.success());
    }
}

/// Shapes whose product, size in bytes or single length exceeds every memory, and a header longer than its file.
#[test]
fn hostile_headers_are_refused() {
    let scratch = tempfile::tempdir().expect("scratch");
    let file = scratch.path().join("h.npy");
    let header = |shape: &str| format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n");
    let name = file.to_str().expect("UTF-8");
    let arguments = ["solve", name, "--pressure", "1", "--modulus", "1", "--touching", "low-points", "--length", "1"];
    for shape in
        ["(1, 9223372036854775808)", "(4294967296, 4294967296)", "(9223372036854775808, 2)", "(-1, 2)", "(2, 3)"]
    {
        let text = header(shape);
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((text.len() as u16).to_le_bytes());
        bytes.extend(text.as_bytes());
        fs::write(&file, &bytes).expect("written");
        refused_quickly(&arguments, "h.npy");
    }
    for version in [2, 3] {
        let mut bytes = b"\x93NUMPY".to_vec();
        bytes.extend([version, 0, 0xff, 0xff, 0xff, 0xff]);
        bytes.extend(header("(2, 2)").as_bytes());
        fs::write(&file, &bytes).expect("written");
        refused_quickly(&arguments, "a damaged header (its length is 4294967295 bytes");
    }
}

/// Files that have no end, or whose opening may not.
#[test]
fn pipes_and_devices_are_refused() {
    let scratch = tempfile::tempdir().expect("scratch");
    let pipe = scratch.path().join("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().expect("started").success());
    let folder = scratch.path().join("folder");
    fs::create_dir(&folder).expect("made");
    fs::rename(&pipe, folder.join("results.json")).expect("moved");
    let pipe = folder.join("results.json");
    let [pipe, folder] = [&pipe, &folder].map(|p| p.to_str().expect("UTF-8"));
    let out = scratch.path().join("out");
    let out = out.to_str().expect("UTF-8");
    for file in ["/dev/zero", pipe] {
        for arguments in [
            &["run", file, "--out", out][..],
            &["run", file, "--dry-run"],
            &["sweep", file, "--out", out],
            &["ensemble", file, "--seeds", "1..2", "--out", out],
            &["tradeoff", file, "--out", out],
            &["surface", file],
            &["surface", "--heights", file, "--touching", "low-points"],
            &["potential", "--potential", file],
        ] {
            refused_quickly(arguments, file);
        }
    }
    refused_quickly(&["report", folder], pipe);
}

/// Every command that takes long is killed at a random time, and repeated. `cargo bench --bench measure -- kills` does
/// so 200 times, with larger problems.
#[test]
fn killed_commands_end_with_the_results_of_undisturbed_ones() {
    let arguments = ["measure", "kills", "--small", "--kills", "5", "run", "solve", "sweep", "tradeoff", "challenge"];
    measure::run(arguments.map(OsString::from)).expect("identical results");
    if lammps(1).is_some() {
        let arguments = ["measure", "kills", "--small", "--kills", "2", "run-atoms", "atoms-run"];
        measure::run(arguments.map(OsString::from)).expect("identical results");
    }
}

/// A random file or folder of what a command left is damaged. `cargo bench --bench measure -- folders` does so any number of times.
#[test]
fn damaged_folders_are_repaired_or_refused() {
    let arguments = ["measure", "folders", "--damages", "40"];
    measure::run(arguments.map(OsString::from)).expect("no damage is used");
}

/// A command that fails with exit code 2 within [`ANSWERED`]; its message names `what`.
fn refused_quickly(arguments: &[&str], what: &str) -> String {
    let begun = Instant::now();
    let output = asperity().args(arguments).output().expect("started");
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains(what), "{said}");
    assert!(begun.elapsed() < ANSWERED, "took {:?}", begun.elapsed());
    said
}

#[test]
fn excessive_requests_are_refused_quickly() {
    let scratch = tempfile::tempdir().expect("scratch");
    let file = scratch.path().join("a.toml");
    let path = file.to_str().expect("UTF-8");
    let put = |text: String| fs::write(&file, text).expect("written");
    put((0..20_000).map(|i| format!("key{i} = {i}\n")).collect::<String>() + SCENE);
    let said = refused_quickly(&["run", path], "is no key");
    assert!(said.lines().count() < 50 && said.contains("only the first 20"), "{} lines", said.lines().count());
    put(format!("description = \"{}\"\n{SCENE}", "a".repeat(100_000)));
    refused_quickly(&["run", path], "description = 100000 bytes");
    refused_quickly(&["schema", "--threads", "100000"], "--threads = 100000");
}

/// 64 stacks of 8 MiB are more than the address space that the shell leaves.
#[test]
fn threads_that_cannot_be_started_are_an_error_of_the_machine() {
    let limited = "ulimit -v 400000; exec \"$0\" schema --threads 64";
    let program = asperity().get_program().to_owned();
    let output = Command::new("sh").args(["-c", limited]).arg(program).output().expect("started");
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(5), "{said}");
    assert!(said.contains("threads: ") && said.contains("fewer threads"), "{said}");
}

/// Only a reader that has gone away is no error.
#[test]
fn output_that_cannot_be_written_is_an_error() {
    let full = || fs::File::options().write(true).open("/dev/full").expect("Linux");
    for arguments in [&["schema"][..], &["methods", "--json"], &["--help"], &["doctor", "--json"]] {
        let output = asperity().args(arguments).stdout(full()).stderr(Stdio::piped()).output().expect("started");
        assert_eq!(output.status.code(), Some(5), "{arguments:?}: {}", stderr(&output));
    }
    let mut child = asperity().arg("schema").stdout(Stdio::piped()).spawn().expect("started");
    drop(child.stdout.take());
    assert!(child.wait().expect("ended").success(), "a closed pipe is no error");
}

/// A name with an escape sequence and a byte that is no UTF-8, in an error and in JSON.
#[test]
fn names_do_not_reach_the_terminal_as_they_are() {
    let scratch = tempfile::tempdir().expect("scratch");
    let folder = scratch.path().join(OsStr::from_bytes(b"x\x1b[31m\xff"));
    fs::create_dir(&folder).expect("made");
    let missing = asperity().arg("run").arg(folder.join("no.toml")).output().expect("started");
    assert_eq!(missing.status.code(), Some(2));
    let said = stderr(&missing);
    assert!(said.contains("\\u{1b}[31m") && !said.contains('\u{1b}'), "{said:?}");
    let unknown = asperity().args(["run", "--n\u{1b}[31m"]).output().expect("started");
    assert!(!stderr(&unknown).contains('\u{1b}'), "{:?}", stderr(&unknown));
    let heights = folder.join("h.txt");
    fs::write(&heights, "0 1 0 1\n1 2 1 2\n0 1 0 1\n1 2 1 2\n").expect("written");
    let mut command = asperity();
    command.arg("surface").arg(&heights).args([
        "--unit",
        "um",
        "--length",
        "1um",
        "--touching",
        "low-points",
        "--json",
    ]);
    let output = command.output().expect("started");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(!output.stdout.contains(&0x1b) && json_line(&output).is_object());
}

/// A script as `lmp` that leaves a mark when it is executed.
fn marking_program(folder: &Path) -> PathBuf {
    let program = folder.join("lmp");
    fs::write(&program, "#!/bin/sh\ntouch \"$(dirname \"$0\")/executed\"\n").expect("written");
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).expect("executable");
    program
}

#[test]
fn a_program_of_a_scene_is_executed_on_request_only() {
    let scratch = tempfile::tempdir().expect("scratch");
    let program = marking_program(scratch.path());
    let (file, out) = (scratch.path().join("a.toml"), scratch.path().join("out"));
    fs::write(&file, format!("{ATOMS}{program:?}\n")).expect("written");
    let run = |flags: &[&str]| -> Output {
        asperity().arg("run").arg(&file).arg("--out").arg(&out).args(flags).output().expect("started")
    };
    let executed = || scratch.path().join("executed").exists();
    let planned = run(&["--dry-run"]);
    assert!(planned.status.success() && !executed(), "{}", stderr(&planned));
    assert!(!run(&["--dry-run", "--allow-program"]).stdout.is_empty() && !executed());
    let refused = run(&[]);
    assert_eq!(refused.status.code(), Some(2), "{}", stderr(&refused));
    assert!(stderr(&refused).contains("--allow-program") && !executed() && !out.exists(), "{}", stderr(&refused));
    // It is no LAMMPS, which is found by executing it.
    let allowed = run(&["--allow-program"]);
    assert!(allowed.status.code() == Some(5) && executed(), "{}", stderr(&allowed));
    fs::write(&program, "#!/bin/sh\necho 'lmp: no room' >&2\nexit 127\n").expect("written");
    let broken = stderr(&run(&["--allow-program"]));
    assert!(broken.contains("lmp: no room") && !broken.contains("not found"), "{broken}");
    fs::write(&file, format!("{ATOMS}\"-in\"\n")).expect("written");
    let dashed = run(&["--allow-program"]);
    assert_eq!(dashed.status.code(), Some(2), "{}", stderr(&dashed));
    assert!(stderr(&dashed).contains("atoms.program = -in"), "{}", stderr(&dashed));
}

/// A script of LAMMPS can start any program; those of a job folder may come from anywhere.
#[test]
fn a_changed_script_of_a_job_is_not_executed() {
    let scratch = tempfile::tempdir().expect("scratch");
    let (file, job) = (scratch.path().join("a.toml"), scratch.path().join("job"));
    fs::write(&file, ATOMS.replace("program = ", "")).expect("written");
    let build = || asperity().args(["atoms", "build"]).arg(&file).arg("--out").arg(&job).output().expect("started");
    assert!(build().status.success());
    let executed = scratch.path().join("executed");
    for name in ["prescribed_load.in", "setup.in"] {
        let script = job.join(name);
        let text = fs::read_to_string(&script).expect("read");
        fs::write(&script, format!("shell touch {}\n{text}", executed.display())).expect("written");
        let path = job.to_str().expect("UTF-8");
        let said = refused_quickly(&["atoms", "run", path], name);
        assert!(said.contains("atoms build") && !executed.exists(), "{said}");
        assert!(build().status.success());
    }
}

/// The first SIGTERM ends a run that waits for a program before it computes, and the program with it.
#[test]
fn a_run_that_has_not_begun_ends_at_the_first_signal() {
    let scratch = tempfile::tempdir().expect("scratch");
    let program = scratch.path().join("lmp");
    fs::write(&program, "#!/bin/sh\necho $$ > \"$(dirname \"$0\")/pid\"\nexec sleep 60\n").expect("written");
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).expect("executable");
    let file = scratch.path().join("a.toml");
    fs::write(&file, format!("{ATOMS}{program:?}\n")).expect("written");
    let mut command = asperity();
    command.arg("run").arg(&file).arg("--allow-program").arg("--out").arg(scratch.path().join("out"));
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("started");
    let pid = scratch.path().join("pid");
    let begun = Instant::now();
    let started = || fs::read_to_string(&pid).ok().filter(|t| t.ends_with('\n'));
    let probed = loop {
        match started() {
            Some(text) => break text.trim().to_string(),
            None => assert!(begun.elapsed() < ANSWERED, "the program was not started"),
        }
        std::thread::sleep(Duration::from_millis(10));
    };
    let signalled = Command::new("kill").args(["-TERM", &child.id().to_string()]).status().expect("sent");
    assert!(signalled.success());
    assert_eq!(child.wait().expect("ended").code(), Some(130));
    assert!(begun.elapsed() < ANSWERED);
    // A killed process stays as a zombie until its new parent collects it.
    let gone = || fs::read_to_string(format!("/proc/{probed}/stat")).is_ok_and(|s| !s.contains(") Z")).then_some(());
    let deadline = Instant::now() + ANSWERED;
    while gone().is_some() {
        assert!(Instant::now() < deadline, "the probed program outlived its parent");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Processes that work in a folder.
fn working_in(folder: &Path) -> usize {
    let processes = fs::read_dir("/proc").expect("listed").filter_map(Result::ok);
    processes.filter(|p| fs::read_link(p.path().join("cwd")).is_ok_and(|at| at == folder)).count()
}

/// Behind a launcher that does not `exec`, and behind `mpirun`, whose ranks have process groups of their own.
#[test]
fn lammps_does_not_outlive_a_killed_run() {
    let Some(_lammps) = lammps(2) else { return };
    let scratch = tempfile::tempdir().expect("scratch");
    let folder = scratch.path().canonicalize().expect("there");
    let launcher = folder.join("launcher");
    fs::write(&launcher, "#!/bin/sh\n\"$@\"\n").expect("written");
    fs::set_permissions(&launcher, fs::Permissions::from_mode(0o755)).expect("executable");
    let file = folder.join("a.toml");
    fs::write(&file, ATOMS.replace("program = ", "").replace("cells = 10\n", "cells = 24\n")).expect("written");
    let cores = std::thread::available_parallelism().map_or(1, |c| c.get());
    let ranks = ["--ranks", "2"];
    let ways =
        [Some(["--launcher", "./launcher"]), (cores > 1 && tools::program(&["mpirun"]).is_some()).then_some(ranks)];
    for (way, flags) in ways.into_iter().flatten().enumerate() {
        let out = folder.join(format!("out{way}"));
        let mut command = asperity();
        command.arg("run").arg(&file).arg("--out").arg(&out).args(flags).current_dir(&folder);
        let mut first = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("started");
        let job = out.join("lammps");
        // The launcher and what it started.
        while working_in(&job) < 2 {
            assert_eq!(first.try_wait().expect("asked"), None, "{flags:?}: it ended before it was killed");
            std::thread::sleep(Duration::from_millis(10));
        }
        first.kill().and_then(|()| first.wait()).expect("killed");
        let output = command.stderr(Stdio::piped()).output().expect("started");
        assert!(output.status.success(), "{flags:?}: {}", stderr(&output));
        assert_eq!(working_in(&job), 0, "{flags:?}");
    }
}

/// A frame of a finished LAMMPS run, and the load table of an interrupted one.
#[test]
fn damaged_frames_and_load_tables_are_computed_again() {
    let Some(_lammps) = lammps(1) else { return };
    let scratch = tempfile::tempdir().expect("scratch");
    let (file, out) = (scratch.path().join("a.toml"), scratch.path().join("out"));
    fs::write(&file, ATOMS.replace("program = ", "")).expect("written");
    let run = || {
        let output = asperity().arg("run").arg(&file).arg("--out").arg(&out).output().expect("started");
        assert!(output.status.success(), "{}", stderr(&output));
        stderr(&output)
    };
    run();
    let contents = || {
        let (fields, results) = contents(&out, "results.json");
        // Peak memory of LAMMPS and times of its steps differ between runs.
        (fields, results["atoms"]["states"].clone(), results["comparison"].clone())
    };
    let whole = contents();
    let lammps = out.join("lammps");
    let frame = files(&lammps).into_iter().find(|f| f.to_string_lossy().starts_with("frame.1.dump")).expect("a frame");
    damage(&lammps.join(&frame), Damage::Flipped);
    let said = run();
    assert!(said.contains("frame.1.dump") && said.contains("lammps is computed again"), "{said}");
    assert!(contents() == whole, "other results after a damaged frame");
    fs::remove_file(lammps.join("done.json")).expect("removed");
    damage(&lammps.join("load_steps.csv"), Damage::Flipped);
    let said = run();
    assert!(said.contains("load_steps.csv"), "{said}");
    assert!(contents() == whole, "other results after a damaged table");
}
