//! Folders that somebody else may have filled, and results that are not as they were written.

use crate::folder::files;
use crate::program::{asperity, stderr};
use serde_json::Value;
use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// One load on a grid of 16² points, and a sweep over it.
const SCENE: &str = "name = \"small\"\n[surface]\ngrid = 16\ncut_off_mode = 6\n[load]\np_star = [0.02]\n";
const SWEEP: &str = "scene = \"scene.toml\"\n[over]\nsurface.seed = \"1..2\"\n";

struct Scratch(tempfile::TempDir);

impl Scratch {
    fn new() -> Scratch {
        let scratch = Scratch(tempfile::tempdir().expect("scratch"));
        let machine = "[cluster]\nengine = \"slurm\"\npack_minutes = 0.0\n";
        for (name, text) in [("scene.toml", SCENE), ("sweep.toml", SWEEP), ("machines.toml", machine)] {
            fs::write(scratch.path(name), text).expect("written");
        }
        scratch
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn call(&self, arguments: &[&str]) -> Output {
        self.with_path(arguments, &std::env::var("PATH").unwrap_or_default())
    }

    fn with_path(&self, arguments: &[&str], path: &str) -> Output {
        let mut command = asperity();
        command.args(arguments).current_dir(self.0.path()).env("PATH", path).output().expect("started")
    }

    fn done(&self, arguments: &[&str]) -> String {
        let output = self.call(arguments);
        assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
        stderr(&output)
    }

    /// Exit code 2 and one line, which holds all `words`.
    fn refused(&self, arguments: &[&str], words: &[&str]) {
        let output = self.call(arguments);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.trim().lines().count() == 1 && words.iter().all(|w| said.contains(w)), "{arguments:?}: {said}");
    }

    /// Programs in place of Slurm's, which are found first.
    fn stand_ins(&self, programs: &[(&str, &str)]) -> String {
        for (name, text) in programs {
            let path = self.path(name);
            fs::write(&path, format!("#!/bin/sh\n{text}\n")).expect("written");
            fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("executable");
        }
        format!("{}:{}", self.0.path().display(), std::env::var("PATH").unwrap_or_default())
    }
}

fn flip(file: &Path) {
    let mut bytes = fs::read(file).expect("read");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(file, bytes).expect("written");
}

/// A victim outside of the folder is neither emptied nor changed, whatever link leads to it, and no pipe is waited for.
#[test]
fn links_and_pipes_in_a_folder_are_refused_and_not_followed() {
    let scratch = Scratch::new();
    scratch.done(&["run", "scene.toml", "--out", "run"]);
    scratch.done(&["sweep", "sweep.toml", "--out", "sweep"]);
    scratch.done(&["solve", "--challenge", "16", "--cut-off", "0.15", "--pressure", "0.01", "--out", "solve"]);
    let (victim, folder) = (scratch.path("victim"), scratch.path("victims"));
    fs::create_dir(&folder).expect("made");
    for (kept, commands) in [
        ("run", &[&["report", "run"][..], &["run", "scene.toml", "--out", "run"]][..]),
        ("sweep", &[&["report", "sweep"], &["sweep", "sweep.toml", "--out", "sweep"]]),
        ("solve", &[&["solve", "--challenge", "16", "--cut-off", "0.15", "--pressure", "0.02", "--out", "solve"]]),
    ] {
        let names: Vec<PathBuf> =
            files(&scratch.path(kept)).into_iter().filter(|f| !f.starts_with("figures")).collect();
        let more = [".asperity", "report.html", "new.npy", "logs/seed-1.log"].map(PathBuf::from);
        for name in names.iter().chain(&more) {
            let place = scratch.path(kept).join(name);
            if !place.parent().is_some_and(Path::is_dir) {
                continue;
            }
            let aside = scratch.path("aside");
            let _ = fs::rename(&place, &aside);
            fs::write(&victim, "precious").expect("written");
            symlink(&victim, &place).expect("linked");
            for command in commands {
                scratch.refused(command, &[name.to_str().expect("UTF-8"), "a link", "put a copy in its place"]);
            }
            assert_eq!(fs::read_to_string(&victim).expect("read"), "precious", "{kept}/{}", name.display());
            fs::remove_file(&place).expect("removed");
            let _ = fs::rename(&aside, &place);
        }
        for command in commands {
            let place = scratch.path(kept).join("pipe");
            assert!(Command::new("mkfifo").arg(&place).status().expect("started").success());
            scratch.refused(command, &["pipe"]);
            fs::remove_file(&place).expect("removed");
            symlink(&folder, &place).expect("linked");
            scratch.refused(command, &["a link"]);
            fs::remove_file(&place).expect("removed");
        }
    }
    assert_eq!(fs::read_dir(&folder).expect("listed").count(), 0);
    // The folder itself may be reached by a link.
    symlink(scratch.path("run"), scratch.path("way")).expect("linked");
    scratch.done(&["report", "way"]);
}

/// Signs results again, as somebody may who wants them to be read.
fn signed(folder: &Path, change: impl Fn(&mut Value)) {
    let file = folder.join("results.json");
    let mut results: Value = serde_json::from_slice(&fs::read(&file).expect("read")).expect("JSON");
    change(&mut results);
    fs::write(&file, results.to_string()).expect("written");
    let sums = fs::read_to_string(folder.join("checksums.b3")).expect("read");
    let hash = asperity::surface::files::hashed::file_hash(&file).expect("hashed");
    let line =
        |l: &str| if l.ends_with("  results.json") { format!("{hash}  results.json\n") } else { format!("{l}\n") };
    fs::write(folder.join("checksums.b3"), sums.lines().map(line).collect::<String>()).expect("written");
}

#[test]
fn fields_outside_of_the_folder_or_of_no_stage_are_not_read() {
    let scratch = Scratch::new();
    scratch.done(&["run", "scene.toml", "--out", "run"]);
    let run = scratch.path("run");
    fs::copy(run.join("continuum/load-1-gap.npy"), scratch.path("gap.npy")).expect("copied");
    fs::copy(run.join("continuum/load-1-gap.npy"), run.join("gap.npy")).expect("copied");
    let absolute = scratch.path("gap.npy").to_str().expect("UTF-8").to_string();
    for (name, word) in [
        (absolute.as_str(), "inside the run folder"),
        ("../gap.npy", "inside the run folder"),
        ("gap.npy", "no done.json"),
    ] {
        signed(&run, |results| results["continuum"]["states"][0]["gap_map"] = name.into());
        scratch.refused(&["report", "run"], &[name, word]);
        assert!(asperity::FinishedRun::read(&run).expect_err("refused").to_string().contains(word));
    }
}

/// One bit of each file that something reads is refused by the report and the library, with the file and the remedy.
#[test]
fn damaged_results_are_used_by_nobody() {
    let scratch = Scratch::new();
    scratch.done(&["run", "scene.toml", "--out", "run"]);
    let run = scratch.path("run");
    let state = |run: &Path| {
        let found = asperity::FinishedRun::read(run)?;
        let gap = found.gap(&found.states[0])?;
        found.heights().map(|heights| (gap, heights))
    };
    state(&run).expect("whole");
    for name in
        ["results.json", "checksums.b3", "continuum/done.json", "continuum/load-1-gap.npy", "surface/heights.npy"]
    {
        let whole = fs::read(run.join(name)).expect("read");
        for removed in [false, true] {
            match removed {
                // Another line may be the changed one.
                false if name == "checksums.b3" => continue,
                false => flip(&run.join(name)),
                true => fs::remove_file(run.join(name)).expect("removed"),
            }
            if name != "results.json" || !removed {
                scratch.refused(&["report", "run"], &["computes again"]);
            }
            assert!(state(&run).is_err(), "{name} removed: {removed}");
            fs::write(run.join(name), &whole).expect("written");
        }
    }
    scratch.done(&["report", "run"]);
}

/// Tables of a sweep are verified by the report and made again by the sweep, which knows its folder without its marker.
#[test]
fn a_damaged_sweep_is_repaired_by_its_command() {
    let scratch = Scratch::new();
    let sweep = ["sweep", "sweep.toml", "--out", "out"];
    scratch.done(&sweep);
    let table = |name: &str| fs::read(scratch.path("out").join(name)).expect("read");
    let whole = ["ensemble.json", "statistics.csv"].map(table);
    for name in ["ensemble.json", "checksums.b3", ".asperity", "points/seed-1/results.json", "points/seed-2/.asperity"]
    {
        for removed in [false, true] {
            let path = scratch.path("out").join(name);
            match fs::metadata(&path).expect("there").len() {
                0 if !removed => continue,
                // Another line may be the changed one.
                _ if !removed && name == "checksums.b3" => continue,
                _ if removed => fs::remove_file(&path).expect("removed"),
                _ => flip(&path),
            }
            if ["ensemble.json", "checksums.b3"].contains(&name) && !(removed && name == "ensemble.json") {
                scratch.refused(&["report", "out"], &["ensemble.json", "computes again"]);
            }
            let said = scratch.done(&sweep);
            assert_eq!(
                said.contains("made again from the points"),
                name == "ensemble.json" && !removed || name == "checksums.b3"
            );
            assert_eq!(["ensemble.json", "statistics.csv"].map(table), whole, "{name}");
            scratch.done(&["report", "out"]);
        }
    }
}

/// A point of Slurm whose results changed does not reach the statistics: it has failed, and is submitted again.
#[test]
fn damaged_points_of_a_cluster_are_not_collected() {
    let scratch = Scratch::new();
    let tools = [("sbatch", "echo 7"), ("squeue", "exit 0"), ("scancel", "echo \"$@\" >> cancelled")];
    let path = scratch.stand_ins(&tools);
    let call = |arguments: &[&str]| scratch.with_path(arguments, &path);
    let submit = ["sweep", "sweep.toml", "--machine", "cluster", "--out", "out", "--json"];
    assert!(call(&submit).status.success());
    for task in ["0", "1"] {
        let turn = call(&["slurm-task", "out", task]);
        assert!(turn.status.success(), "{}", stderr(&turn));
    }
    assert!(call(&["collect", "out"]).status.success());
    flip(&scratch.path("out/points/seed-1/results.json"));
    let status = String::from_utf8(call(&["status", "out"]).stdout).expect("UTF-8");
    assert!(status.contains("1 done, 1 failed") && status.contains("results.json: changed"), "{status}");
    assert_eq!(call(&["collect", "out"]).status.code(), Some(2));
    let text = fs::read_to_string(scratch.path("out/ensemble.json")).expect("read");
    let ensemble: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(
        (&ensemble["points"][0]["status"], &ensemble["points"][1]["status"]),
        (&"failed".into(), &"done".into())
    );
    let again = call(&submit);
    assert!(String::from_utf8_lossy(&again.stdout).contains("\"submitted\":1"), "{}", stderr(&again));
    // Without a submission that can be read there is nothing to trust, but for a job of this name in the queue.
    let file = scratch.path("out/slurm/submission.json");
    flip(&file);
    for command in [&["status", "out"][..], &["collect", "out"], &["cancel", "out"], &["slurm-task", "out", "0"]] {
        let refused = call(command);
        assert_eq!(refused.status.code(), Some(2), "{command:?}");
        assert!(stderr(&refused).contains("writes it again"), "{command:?}: {}", stderr(&refused));
    }
    assert!(!scratch.path("cancelled").exists());
    let here = fs::canonicalize(scratch.path("out")).expect("there");
    let queued = format!("case \"$*\" in *--name*) echo '9|{}' ;; *) echo '9 0 RUNNING None' ;; esac", here.display());
    scratch.stand_ins(&[("squeue", &queued)]);
    let refused = call(&submit);
    assert!(stderr(&refused).contains("job 9 has 1 tasks in the queue"), "{}", stderr(&refused));
    scratch.stand_ins(&[("squeue", "exit 0")]);
    let said = stderr(&call(&submit));
    assert!(said.contains("it is written again"), "{said}");
    assert!(call(&["status", "out"]).status.success());
}

/// The command that submitted a sweep submits a point again whose stages or fields changed, as the message of those who refuse it says.
#[test]
fn damaged_stages_of_a_cluster_are_submitted_again() {
    let scratch = Scratch::new();
    let path = scratch.stand_ins(&[("sbatch", "echo 7"), ("squeue", "exit 0")]);
    let call = |arguments: &[&str]| scratch.with_path(arguments, &path);
    let submitted = |points: usize| {
        let answer = call(&["sweep", "sweep.toml", "--machine", "cluster", "--out", "out", "--json"]);
        let said = String::from_utf8_lossy(&answer.stdout).into_owned();
        assert!(said.contains(&format!("\"submitted\":{points}")), "{said} {}", stderr(&answer));
        for task in (0..points).map(|task| task.to_string()) {
            assert!(call(&["slurm-task", "out", &task]).status.success());
        }
        assert!(call(&["collect", "out"]).status.success());
        stderr(&answer)
    };
    submitted(2);
    submitted(0);
    for file in ["continuum/done.json", "continuum/load-1-gap.npy"] {
        flip(&scratch.path("out/points/seed-1").join(file));
        let said = submitted(1);
        assert!(said.contains("seed-1: ") && said.contains(file.rsplit_once('/').expect("a file").1), "{said}");
    }
    submitted(0);
}

/// Only a job with a number, the name and the folder of the submission is cancelled.
#[test]
fn only_the_own_job_is_cancelled() {
    use asperity::surface::files::hashed;
    let scratch = Scratch::new();
    let path =
        scratch.stand_ins(&[("sbatch", "echo 7"), ("squeue", "exit 0"), ("scancel", "echo \"$@\" >> cancelled")]);
    let call = |arguments: &[&str]| scratch.with_path(arguments, &path);
    assert!(call(&["sweep", "sweep.toml", "--machine", "cluster", "--out", "out"]).status.success());
    let file = scratch.path("out/slurm/submission.json");
    let whole: Value = serde_json::from_slice(&fs::read(&file).expect("read")).expect("JSON");
    let with = |change: &dyn Fn(&mut serde_json::Map<String, Value>)| {
        let mut object = whole.as_object().expect("an object").clone();
        object.remove("blake3");
        object.remove("files");
        change(&mut object);
        hashed::write(&file, &object, &[]).expect("written");
    };
    let refused = |word: &str| {
        for command in [&["cancel", "out"][..], &["status", "out"], &["collect", "out"], &["slurm-task", "out", "0"]] {
            let output = call(command);
            let said = stderr(&output);
            assert_eq!(output.status.code(), Some(2), "{command:?} {word}: {said}");
            assert!(said.contains(word), "{command:?}: {said}");
        }
        assert!(!scratch.path("cancelled").exists(), "{word}");
    };
    for job in ["--me", "7 8", "", "7;cluster", "-u root"] {
        with(&|o| drop(o.insert("job".into(), job.into())));
        refused("the job");
        with(&|o| drop(o.insert("collect_job".into(), job.into())));
        refused("the job");
    }
    for label in ["../../victim", "a/b", "", ".."] {
        with(&|o| o["points"][0]["label"] = label.into());
        refused("the name");
    }
    with(&|o| o["tasks"][0][0] = 5.into());
    refused("point 5 of 2");
    // The number of another job of this cluster.
    with(&|_| ());
    for (name, place) in [("other", scratch.path("out")), ("asperity-small", scratch.path("elsewhere"))] {
        scratch.stand_ins(&[("squeue", &format!("echo '{name}|{}'", place.display()))]);
        let output = call(&["cancel", "out"]);
        assert!(stderr(&output).contains(name) && output.status.code() == Some(2), "{}", stderr(&output));
        assert!(!scratch.path("cancelled").exists());
    }
    scratch.stand_ins(&[("squeue", "exit 0")]);
    assert!(call(&["cancel", "out"]).status.success());
    let cancelled = fs::read_to_string(scratch.path("cancelled")).expect("read");
    // The name is compared by scancel itself, too.
    assert!(cancelled.lines().all(|l| l.contains("--me --name asperity-small") && l.ends_with(" 7")), "{cancelled}");
    // Slurm replaces these in the names of logs.
    for folder in ["50%", "a\\b"] {
        let output = call(&["sweep", "sweep.toml", "--machine", "cluster", "--out", folder]);
        assert!(stderr(&output).contains("--out") && output.status.code() == Some(2), "{}", stderr(&output));
    }
}

/// A file system object that is no result at all, of a kind that no reader may wait for or read to its end.
#[test]
fn endless_files_are_not_read() {
    let scratch = Scratch::new();
    scratch.done(&["run", "scene.toml", "--out", "run"]);
    for name in ["results.json", "checksums.b3", "continuum/done.json", "scene.toml"] {
        let path = scratch.path("run").join(name);
        let whole = fs::read(&path).expect("read");
        // A hole of many terabytes.
        let file = fs::File::options().write(true).open(&path).expect("opened");
        if file.set_len(1 << 43).is_err() {
            return;
        }
        let output = scratch.call(&["report", "run"]);
        let code = output.status.code();
        assert!(code == Some(2) || code == Some(5), "{name}: {code:?} {}", stderr(&output));
        fs::write(&path, whole).expect("written");
    }
    scratch.done(&["report", "run"]);
}

/// Two loads of a block that LAMMPS's own minimisers relax.
const ATOMS: &str = "name = \"atoms\"\n[surface]\ngrid = 16\ncut_off_mode = 6\n[load]\np_star = [0.01, 0.02]\n\
                     [atoms]\ncells = 10\ndepth_cells = 4\nminimizer = \"fire\"\n";

/// What LAMMPS, or something in its place, left of a table or a frame is verified, computed again from there on, and said once.
#[test]
fn damaged_load_tables_never_stick() {
    let Some(_lammps) = crate::lammps::lammps(1) else { return };
    let scratch = Scratch::new();
    fs::write(scratch.path("atoms.toml"), ATOMS).expect("written");
    let run = |out: &str, lammps: &str| scratch.call(&["run", "atoms.toml", "--out", out, "--lammps", lammps]);
    let good = |out: &str| {
        let output = run(out, "lmp");
        assert!(output.status.success(), "{}", stderr(&output));
        stderr(&output)
    };
    let fields = |out: &str| crate::folder::fields(&scratch.path(out).join("atoms"));
    good("whole");
    let expected = fields("whole");

    // A bit of the table of a stage that was interrupted at its end.
    let table = scratch.path("whole/lammps/load_steps.csv");
    let whole = fs::read(&table).expect("read");
    for part in 0..8 {
        let mut bytes = whole.clone();
        bytes[part * whole.len() / 8 + 3] ^= 1 << (part % 7);
        fs::write(&table, bytes).expect("written");
        let _ = fs::remove_file(scratch.path("whole/lammps/done.json"));
        let said = good("whole");
        assert_eq!(said.matches("computes the steps from there on again").count(), 1, "{part}: {said}");
        assert!(fields("whole") == expected, "{part}");
    }

    // A LAMMPS that changes its table, or cuts a frame, after it has finished.
    for (k, change) in ["sed -i '$s/,[^,]*,/,nan,/' load_steps.csv", "f=$(ls frame.*.zst | tail -1); truncate -s 50 $f"]
        .iter()
        .enumerate()
    {
        scratch.stand_ins(&[(
            "bad",
            &format!("lmp \"$@\"; code=$?; [ -f load_steps.csv ] && {{ {change}; }}; exit $code"),
        )]);
        let out = format!("bad-{k}");
        let failed = run(&out, scratch.path("bad").to_str().expect("UTF-8"));
        assert_eq!(failed.status.code(), Some(4), "{change}: {}", stderr(&failed));
        good(&out);
        assert!(fields(&out) == expected, "{change}");
    }
}
