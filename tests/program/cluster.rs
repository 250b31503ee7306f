//! Sweeps on a Slurm of two nodes that the tests start on this machine.

use crate::program::{asperity, json_line, stderr};
use crate::tools::{program, skip};
use serde_json::Value;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// A continuum that is solved in a fraction of a second, and the same with a limit that it exceeds.
const SCENE: &str = "name = \"small\"\n[surface]\ngrid = 32\ncut_off_mode = 8\n[load]\np_star = [0.02, 0.1]\n";
const SWEEP: &str = "scene = \"scene.toml\"\n[over]\nsurface.seed = \"1..2\"\ncontinuum.max_iterations = [50000, 3]\n";

/// Sixteen steps and some seconds of LAMMPS.
const ATOMS: &str = "name = \"atoms\"\n[surface]\ngrid = 32\n[load]\np_star = [0.01, 0.02]\n\
                     [atoms]\ncells = 10\ndepth_cells = 6\nstep = \"0.1 Å\"\n";
const SEEDS: &str = "scene = \"scene.toml\"\n[over]\nsurface.seed = \"1..2\"\n";

/// Limit of waiting. A lost node is noticed after half a minute, and a requeued job starts after six seconds; with six busy processes on the
/// two cores a test took 140 s.
const PATIENCE: Duration = Duration::from_secs(600);

/// The daemons, which end when this is dropped, and a folder with the files of a sweep.
struct Cluster {
    folder: tempfile::TempDir,
    ports: u16,
}

/// First of the ports of a cluster: other ones for each test and for each process.
fn ports(index: u16) -> u16 {
    let process = u16::try_from(std::process::id() % 900).expect("below 900");
    assert!(index < 5, "ten ports for each of five tests");
    20_000 + 50 * process + 10 * index
}

impl Cluster {
    /// `index`: a number of its own for each test, because they run at the same time. None without Slurm.
    fn start(index: u16, scene: &str, sweep: &str) -> Option<Cluster> {
        let daemons = ["slurmctld", "slurmd", "munged"];
        // Debian has them where only root's search path looks.
        let missing = |name: &&str| !Path::new("/usr/sbin").join(name).exists() && program(&[name]).is_none();
        if let Some(name) = daemons.iter().find(|n| missing(n)).or(program(&["sbatch"]).is_none().then_some(&"sbatch"))
        {
            skip(
                "slurm",
                &format!("{name} was not found (Debian: apt-get install slurmctld slurmd slurm-client munge)"),
            );
            return None;
        }
        let cluster = Cluster { folder: tempfile::tempdir().expect("scratch"), ports: ports(index) };
        for (name, text) in [
            ("scene.toml", scene),
            ("sweep.toml", sweep),
            ("machines.toml", "[cluster]\nengine = \"slurm\"\ntime = \"10\"\npack_minutes = 0.0\n"),
        ] {
            fs::write(cluster.path(name), text).expect("written");
        }
        cluster.daemons(&["up"]);
        Some(cluster)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn state(&self) -> PathBuf {
        self.path("slurm-state")
    }

    fn daemons(&self, arguments: &[&str]) {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/common/slurm.sh");
        let mut command = Command::new(script);
        command.args(arguments).env("SLURM_STATE", self.state()).env("SLURM_PORTS", self.ports.to_string());
        let output = command.output().expect("started");
        assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
    }

    /// asperity in the folder of the sweep.
    fn call(&self, arguments: &[&str]) -> Output {
        let mut command = asperity();
        command.args(arguments).current_dir(self.folder.path()).env("SLURM_CONF", self.state().join("slurm.conf"));
        command.output().expect("started")
    }

    fn json(&self, arguments: &[&str]) -> Value {
        let output = self.call(&[arguments, &["--json"]].concat());
        assert!(!output.stdout.is_empty(), "{arguments:?}: {}", stderr(&output));
        json_line(&output)
    }

    fn submit(&self) -> Value {
        self.json(&["sweep", "sweep.toml", "--machine", "cluster", "--out", "out"])
    }

    fn status(&self) -> Value {
        self.json(&["status", "out"])
    }

    /// Waits for the table that the last job writes.
    fn collected(&self) -> Value {
        let log = self.path("out/slurm/collect.log");
        self.wait("the collected results", || fs::read_to_string(&log).is_ok_and(|t| t.contains("report: ")));
        self.ensemble("out")
    }

    fn ensemble(&self, out: &str) -> Value {
        let text = fs::read_to_string(self.path(out).join("ensemble.json")).expect("read");
        serde_json::from_str(&text).expect("JSON")
    }

    /// The results of the same sweep as processes of this machine.
    fn local(&self) -> Value {
        self.call(&["sweep", "sweep.toml", "--out", "local"]);
        self.ensemble("local")
    }

    fn slurm(&self, command: &str, arguments: &[&str]) {
        let mut command = Command::new(command);
        let output =
            command.args(arguments).env("SLURM_CONF", self.state().join("slurm.conf")).output().expect("started");
        assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
    }

    fn wait(&self, what: &str, good: impl Fn() -> bool) {
        let begun = Instant::now();
        while !good() {
            let status = || String::from_utf8_lossy(&self.call(&["status", "out"]).stdout).into_owned();
            assert!(begun.elapsed() < PATIENCE, "waited for {what}: {}", status());
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Waits until LAMMPS has finished some steps in a run folder.
    fn wait_for_steps(&self, run: &str) {
        let table = self.path(run).join("lammps/load_steps.csv");
        self.wait("load steps", || fs::read_to_string(&table).is_ok_and(|t| t.lines().count() > 3));
    }

    /// Stops the processes of the jobs during what Slurm is called for: on a busy machine it takes longer than the few seconds of LAMMPS.
    fn hold(&self, call: impl FnOnce(&[String])) {
        let stopped = self.processes();
        let send = |signal: &str| {
            let mut command = Command::new("kill");
            command.arg(signal).args(&stopped).stderr(Stdio::null()).status().expect("started");
        };
        send("-STOP");
        call(&stopped);
        send("-CONT");
    }

    /// Signals a job as Slurm does before the time limit.
    fn warn(&self, job: &str) {
        self.hold(|stopped| {
            self.slurm("scancel", &["--batch", "--signal=USR1", &format!("{job}_0")]);
            self.wait("a pending signal", || stopped.iter().any(|process| waits_for_user_signal(process)));
        });
    }

    /// Processes that work in the folder of the results.
    fn processes(&self) -> Vec<String> {
        let out = self.path("out").canonicalize().expect("a folder");
        let all = fs::read_dir("/proc").expect("Linux").map(|entry| entry.expect("an entry"));
        let inside = all.filter(|p| fs::read_link(p.path().join("cwd")).is_ok_and(|folder| folder.starts_with(&out)));
        inside.map(|process| process.file_name().into_string().expect("a number")).collect()
    }

    /// How the turns of a task ended, with their nodes.
    fn turns(&self, task: usize) -> Vec<String> {
        let table = fs::read_to_string(self.path(&format!("out/slurm/turns/{task}.csv"))).unwrap_or_default();
        table.lines().filter_map(|l| l.rsplit(',').next()).map(str::to_string).collect()
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        self.daemons(&["down"]);
    }
}

/// Whether SIGUSR1 was sent to a process that has not taken it.
fn waits_for_user_signal(process: &str) -> bool {
    const USR1: u64 = 1 << 9;
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let pending = status.lines().find_map(|line| line.strip_prefix("ShdPnd:"));
    pending.is_some_and(|mask| u64::from_str_radix(mask.trim(), 16).is_ok_and(|mask| mask & USR1 != 0))
}

/// Points without the words of a failure, which hold paths.
fn points(ensemble: &Value) -> Vec<Value> {
    let mut list = ensemble["points"].as_array().expect("a list").clone();
    list.iter_mut().filter_map(Value::as_object_mut).for_each(|p| drop(p.remove("reason")));
    list
}

#[test]
fn a_sweep_on_slurm_gives_the_results_of_a_local_one() {
    let Some(cluster) = Cluster::start(0, SCENE, SWEEP) else { return };
    let submitted = cluster.submit();
    assert_eq!((&submitted["points"], &submitted["submitted"], &submitted["tasks"]), (&4.into(), &4.into(), &4.into()));
    let found = cluster.collected();
    let status = cluster.status();
    assert_eq!((&status["done"], &status["failed"], &status["queued"]), (&2.into(), &2.into(), &0.into()));
    let why = status["failures"][0]["reason"].as_str().expect("a reason");
    assert!(why.contains("stopped without converging"), "{why}");
    assert!(status["core_hours_used"].as_f64().expect("hours") > 0.0);
    assert_eq!(points(&found), points(&cluster.local()));
    assert_eq!(found["statistics"], cluster.ensemble("local")["statistics"]);

    // Only what failed is submitted again; another sweep is refused while it is in the queue.
    let again = cluster.submit();
    assert_eq!((&again["done"], &again["submitted"]), (&2.into(), &2.into()));
    let refused = cluster.call(&["sweep", "sweep.toml", "--machine", "cluster", "--out", "out"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(stderr(&refused).contains("tasks in the queue"), "{}", stderr(&refused));
    assert!(cluster.call(&["cancel", "out"]).status.success());
    cluster.wait("an empty queue", || cluster.status()["queued"] == 0);
    assert_eq!(cluster.status()["done"], 2);
}

#[test]
fn a_turn_that_ends_early_is_continued() {
    let Some(cluster) = Cluster::start(1, ATOMS, SEEDS) else { return };
    let Some(_lammps) = crate::lammps::lammps(1) else { return };
    let job = cluster.submit()["job"].as_str().expect("a job").to_string();
    cluster.wait_for_steps("out/points/seed-1");
    cluster.warn(&job);
    let found = cluster.collected();
    assert_eq!(cluster.turns(0), ["interrupted", "done"], "{found}");
    assert_eq!(cluster.turns(1), ["done"], "{found}");
    let log = fs::read_to_string(cluster.path("out/logs/seed-1.log")).expect("a log");
    assert!(log.contains("resumed at load step"), "{log}");
    assert_eq!(points(&found), points(&cluster.local()));
}

#[test]
fn points_of_a_killed_node_run_again() {
    let Some(cluster) = Cluster::start(2, ATOMS, SEEDS) else { return };
    let Some(_lammps) = crate::lammps::lammps(1) else { return };
    cluster.submit();
    cluster.wait_for_steps("out/points/seed-1");
    cluster.hold(|_| cluster.daemons(&["kill", "n1"]));
    let found = cluster.collected();
    assert_eq!(cluster.status()["done"], 2);
    assert_eq!(points(&found), points(&cluster.local()));
}

#[test]
fn a_run_on_slurm_gives_the_results_of_a_local_one() {
    let Some(cluster) = Cluster::start(4, ATOMS, SEEDS) else { return };
    let Some(_lammps) = crate::lammps::lammps(1) else { return };
    let run = ["run", "scene.toml", "--machine", "cluster", "--out", "out"];
    let job = cluster.json(&run)["job"].as_str().expect("a job").to_string();
    let refused = cluster.call(&run);
    assert_eq!(refused.status.code(), Some(2));
    assert!(stderr(&refused).contains("tasks in the queue"), "{}", stderr(&refused));
    cluster.wait_for_steps("out");
    cluster.warn(&job);
    cluster.wait("the end of the job", || cluster.status()["done"] == 1);
    assert_eq!(cluster.turns(0), ["interrupted", "done"]);
    let log = fs::read_to_string(cluster.path("out/slurm/run.log")).expect("a log");
    assert!(log.contains("resumed at load step"), "{log}");
    assert!(cluster.call(&["run", "scene.toml", "--out", "local"]).status.success());
    let states = |out: &str| -> Value {
        let text = fs::read_to_string(cluster.path(out).join("results.json")).expect("read");
        let results: Value = serde_json::from_str(&text).expect("JSON");
        results["atoms"]["states"].clone()
    };
    assert!(!states("out").as_array().expect("a list").is_empty());
    assert_eq!(states("out"), states("local"));
    let refused = cluster.call(&["collect", "out"]);
    assert!(stderr(&refused).contains("a single command writes its own report"), "{}", stderr(&refused));
}

#[test]
fn a_cancelled_sweep_is_submitted_again() {
    let Some(cluster) = Cluster::start(3, ATOMS, SEEDS) else { return };
    let Some(_lammps) = crate::lammps::lammps(1) else { return };
    cluster.submit();
    cluster.wait_for_steps("out/points/seed-1");
    cluster.hold(|_| assert!(cluster.call(&["cancel", "out"]).status.success()));
    cluster.wait("an empty queue", || cluster.status()["queued"] == 0);
    let status = cluster.status();
    let why = status["failures"][0]["reason"].as_str().expect("a reason").to_string();
    assert!(why.contains("cancelled") && why.contains("submits it again"), "{status}");
    cluster.submit();
    let found = cluster.collected();
    assert_eq!(points(&found), points(&cluster.local()));
}

/// Writes programs in place of Slurm's into a folder. Returns the search path that finds them first.
fn stand_ins(folder: &Path, programs: &[(&str, &str)]) -> String {
    for (name, text) in programs {
        let path = folder.join(name);
        fs::write(&path, format!("#!/bin/sh\n{text}\n")).expect("written");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("executable");
    }
    format!("{}:{}", folder.display(), std::env::var("PATH").unwrap_or_default())
}

/// Points that were not submitted, whose tasks did not begin, wait for ever, or vanished.
#[test]
fn points_without_a_result_are_named_with_their_state() {
    let folder = tempfile::tempdir().expect("scratch");
    for (name, text) in [
        ("scene.toml", SCENE),
        ("sweep.toml", SEEDS),
        ("machines.toml", "[cluster]\nengine = \"slurm\"\npack_minutes = 0.0\n"),
    ] {
        fs::write(folder.path().join(name), text).expect("written");
    }
    let call = |sbatch: &str, squeue: &str, arguments: &[&str]| {
        let path = stand_ins(folder.path(), &[("sbatch", sbatch), ("squeue", squeue), ("scancel", "exit 0")]);
        asperity().args(arguments).current_dir(folder.path()).env("PATH", path).output().expect("started")
    };
    let submit = ["sweep", "sweep.toml", "--machine", "cluster", "--out", "out"];
    let refused = call("echo 'invalid partition' >&2; exit 1", "exit 1", &submit);
    assert!(stderr(&refused).contains("invalid partition (options of the machine"), "{}", stderr(&refused));
    let status = ["status", "out", "--json"];
    let reason = |status: &Value| status["failures"][0]["reason"].as_str().expect("a reason").to_string();
    // Nothing is in the queue of a job that was never submitted, and a controller that is down does not matter.
    let never = json_line(&call("exit 1", "exit 1", &status));
    assert!(reason(&never).starts_with("it was not submitted"), "{never}");

    assert!(call("echo 7", "exit 0", &submit).status.success());
    let waiting = json_line(&call("exit 1", "echo 7 0 PENDING PartitionConfig; echo 7 1 PENDING Priority", &status));
    assert_eq!(waiting["states"], serde_json::json!({ "pending (PartitionConfig)": 1, "pending": 1 }));
    let gone = json_line(&call("exit 1", "exit 0", &status));
    assert!(reason(&gone).starts_with("its task did not begin"), "{gone}");
    let collected = call("exit 1", "exit 0", &["collect", "out", "--json"]);
    assert_eq!((collected.status.code(), &json_line(&collected)["failed"]), (Some(5), &2.into()));
    let later = call("exit 1", "echo 7 0 RUNNING None; echo 7 1 PENDING Priority", &["collect", "out", "--json"]);
    assert_eq!((later.status.code(), &json_line(&later)["failed"]), (Some(130), &0.into()));

    let cancel = |squeue: &str| String::from_utf8(call("exit 1", squeue, &["cancel", "out"]).stdout).expect("text");
    assert_eq!(cancel("exit 0"), "nothing waits or runs\n");
    assert!(cancel("echo 7 0 RUNNING None").starts_with("cancelled 1 task of job 7; "));
    assert!(cancel("exit 1").starts_with("cancelled the tasks of job 7; "));
}

/// A turn whose time is up before anything is finished would not get further the next time.
#[test]
fn a_turn_without_progress_ends_with_the_reason() {
    let Some(_lammps) = crate::lammps::lammps(1) else { return };
    let folder = tempfile::tempdir().expect("scratch");
    let path = |name: &str| folder.path().join(name);
    // LAMMPS takes many seconds for a load of this block, and writes a checkpoint each minute.
    let scene = format!("{SCENE}[atoms]\ncells = 30\ndepth_cells = 12\n");
    for (name, text) in [
        ("scene.toml", scene.as_str()),
        ("sweep.toml", "scene = \"scene.toml\"\n[over]\nsurface.seed = \"1..1\"\n"),
        ("machines.toml", "[cluster]\nengine = \"slurm\"\n"),
    ] {
        fs::write(path(name), text).expect("written");
    }
    let search_path =
        stand_ins(folder.path(), &[("sbatch", "echo 1"), ("scontrol", "[ \"$1 $2\" = \"requeue 1_0\" ]")]);
    let call = |arguments: &[&str]| {
        let mut command = asperity();
        command.args(arguments).current_dir(folder.path()).env("PATH", &search_path);
        command
    };
    let submitted = call(&["sweep", "sweep.toml", "--machine", "cluster", "--out", "out"]).output().expect("started");
    assert!(submitted.status.success(), "{}", stderr(&submitted));
    // The signal comes when LAMMPS begins: the first turn has finished earlier stages, the second finishes nothing.
    let turn = || {
        let _ = fs::remove_file(path("out/logs/seed-1.log"));
        let task = call(&["slurm-task", "out", "0"]).stderr(Stdio::piped()).spawn().expect("started");
        let begun = Instant::now();
        while !fs::read_to_string(path("out/logs/seed-1.log")).unwrap_or_default().contains(" lammps  ") {
            assert!(begun.elapsed() < PATIENCE, "LAMMPS has not begun");
            std::thread::sleep(Duration::from_millis(5));
        }
        assert!(Command::new("kill").args(["-USR1", &task.id().to_string()]).status().expect("kill").success());
        task.wait_with_output().expect("ended")
    };
    let first = turn();
    assert_eq!(first.status.code(), Some(130), "{}", stderr(&first));
    assert!(stderr(&first).contains("the next turn continues"), "{}", stderr(&first));
    let second = turn();
    assert_eq!(second.status.code(), Some(75), "{}", stderr(&second));
    let why = stderr(&second);
    assert!(why.contains("no progress within a turn of ") && why.contains("increase time (60)"), "{why}");
    let ended = fs::read_to_string(path("out/slurm/points/seed-1.json")).expect("how it ended");
    assert!(ended.contains("\"failed\"") && ended.contains("no progress"), "{ended}");
}

#[test]
fn a_dry_run_prints_the_scripts_and_submits_nothing() {
    let folder = tempfile::tempdir().expect("scratch");
    for (name, text) in [
        ("scene.toml", SCENE),
        ("sweep.toml", SWEEP),
        (
            "machines.toml",
            "[cluster]\nengine = \"slurm\"\nsetup = [\"module load lammps\"]\nsbatch = [\"--partition=short\"]\n",
        ),
    ] {
        fs::write(folder.path().join(name), text).expect("written");
    }
    let call = |flags: &[&str]| {
        let mut command = asperity();
        command.args(["sweep", "sweep.toml", "--machine", "cluster", "--out", "out", "--dry-run"]).args(flags);
        command.current_dir(folder.path()).output().expect("started")
    };
    let text = String::from_utf8(call(&[]).stdout).expect("text");
    for part in [
        "#SBATCH --partition=short\n",
        "set -e\nmodule load lammps\nexec ",
        "#SBATCH --array=0-0\n",
        "4 of 4 points in 1 task,",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert_eq!(json_line(&call(&["--json"]))["to_submit"], 4);
    assert!(!folder.path().join("out").exists());
    let jobs = call(&["--jobs", "2"]);
    assert_eq!(jobs.status.code(), Some(2));
    assert!(stderr(&jobs).contains("at_once of the machine cluster"), "{}", stderr(&jobs));
}

#[test]
fn tasks_have_the_cores_of_the_scene_s_ranks() {
    let folder = tempfile::tempdir().expect("scratch");
    fs::write(folder.path().join("scene.toml"), format!("{ATOMS}ranks = 2\n")).expect("written");
    fs::write(folder.path().join("sweep.toml"), SEEDS).expect("written");
    fs::write(folder.path().join("machines.toml"), "[cluster]\nengine = \"slurm\"\n").expect("written");
    for arguments in [["sweep", "sweep.toml"], ["run", "scene.toml"]] {
        let mut command = asperity();
        command.args(arguments).args(["--machine", "cluster", "--out", "out", "--dry-run"]).current_dir(folder.path());
        let text = String::from_utf8(command.output().expect("started").stdout).expect("text");
        assert!(text.contains("#SBATCH --ntasks=2\n#SBATCH --cpus-per-task=1\n"), "{arguments:?}: {text}");
    }
}

#[test]
fn single_commands_are_jobs_of_their_own() {
    let folder = tempfile::tempdir().expect("scratch");
    fs::write(folder.path().join("scene.toml"), SCENE).expect("written");
    fs::write(folder.path().join("machines.toml"), "[cluster]\nengine = \"slurm\"\ncpus = 4\nlammps.ranks = 2\n")
        .expect("written");
    let call = |arguments: &[&str]| {
        let mut command = asperity();
        command.args(arguments).args(["--machine", "cluster", "--dry-run"]).current_dir(folder.path());
        let output = command.output().expect("started");
        assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
        String::from_utf8(output.stdout).expect("text")
    };
    // A challenge has no atoms, and so no ranks.
    let [ranks, threads] =
        ["#SBATCH --ntasks=2\n#SBATCH --cpus-per-task=2\n", "#SBATCH --ntasks=1\n#SBATCH --cpus-per-task=4\n"];
    for (arguments, tasks) in [
        (&["run", "scene.toml"][..], ranks),
        (&["challenge", "--grid", "64"], threads),
        (&["tradeoff", "scene.toml"], ranks),
    ] {
        let text = call(arguments);
        for part in ["#SBATCH --array=0-0\n", tasks, "1 of 1 point in 1 task,"] {
            assert!(text.contains(part), "{arguments:?}: {part}: {text}");
        }
    }
    // Here they have a plan.
    fs::write(folder.path().join("machines.toml"), "[cluster]\ncpus = 4\n").expect("written");
    for (arguments, part) in
        [(&["challenge", "--grid", "64"][..], "cross-check"), (&["tradeoff", "scene.toml"], "reference")]
    {
        let text = call(arguments);
        assert!(text.contains(part) && text.contains("estimated time"), "{arguments:?}: {text}");
    }
    assert!(!folder.path().join("runs").exists());
}

#[test]
fn a_sweep_is_exported_for_workflow_programs() {
    let folder = tempfile::tempdir().expect("scratch");
    for (name, text) in [("scene.toml", SCENE), ("sweep.toml", SWEEP)] {
        fs::write(folder.path().join(name), text).expect("written");
    }
    let call = |arguments: &[&str]| {
        let mut command = asperity();
        let output = command.args(arguments).current_dir(folder.path()).output().expect("started");
        assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
        output
    };
    for (format, file) in [("snakemake", "Snakefile"), ("row", "workflow.toml")] {
        let written = json_line(&call(&["sweep", "sweep.toml", "--out", "out", "--export", format, "--json"]));
        assert_eq!((&written["points"], &written["file"]), (&4.into(), &format!("out/{file}").into()));
        // The scene of a point runs where the workflow runs it, and the sweep finds its results.
        let label = "max-iterations-50000_seed-1";
        let text = fs::read_to_string(folder.path().join("out").join(file)).expect("written");
        assert!(format == "row" || text.contains(label), "{text}");
        call(&["run", &format!("out/scenes/{label}.toml"), "--out", &format!("out/points/{label}")]);
    }
    let mut sweep = asperity();
    sweep.args(["sweep", "sweep.toml", "--out", "out"]).current_dir(folder.path());
    let text = stderr(&sweep.output().expect("started"));
    assert!(text.contains("4 of 4"), "{text}");
    let log = fs::read_to_string(folder.path().join("out/logs/max-iterations-50000_seed-1.log")).expect("a log");
    assert!(log.contains("done before"), "{log}");
}

/// LAMMPS of a cluster is that of its set-up lines; arguments that it cannot run are refused with the remedy.
#[test]
fn the_doctor_examines_the_lammps_of_a_machine() {
    let scratch = tempfile::tempdir().expect("scratch");
    let folder = scratch.path().join("bin");
    let program = folder.join("lmp-of-the-cluster");
    fs::create_dir(&folder).expect("made");
    let help = "Large-scale Atomic/Molecular Massively Parallel Simulator - 1 Jan 2030\n\nInstalled packages:\n\n\
                KOKKOS OPT\n\nList of styles\n\n* Minimize styles:\n\ncg fire\n";
    fs::write(&program, format!("#!/bin/sh\ncat <<'END'\n{help}END\n")).expect("written");
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).expect("executable");
    let machines = scratch.path().join("machines.toml");
    let cluster = |setup: &str, args: &str| {
        let lammps = "program = \"lmp-of-the-cluster\"\nranks = 64";
        let text =
            format!("[a]\nengine = \"slurm\"\ncpus = 64\nsetup = [{setup:?}]\n[a.lammps]\n{lammps}\nargs = {args}\n");
        fs::write(&machines, text).expect("written");
        asperity().args(["doctor", "--machine", "a", "--json", "--machines"]).arg(&machines).output().expect("started")
    };
    let path = format!("echo loaded; export PATH={}:$PATH", folder.display());
    let finding = |output: &Output, what: &str| -> String {
        let list = json_line(output)["findings"].as_array().expect("a list").clone();
        let of = list.iter().find(|f| f["what"] == what).expect("a finding");
        of["found"].as_str().expect("text").to_string()
    };
    let output = cluster(&path, "[]");
    assert_eq!(finding(&output, "LAMMPS"), "LAMMPS 1 Jan 2030");
    assert_eq!(finding(&output, "LAMMPS packages"), "OPT, KOKKOS");
    assert!(finding(&output, "LAMMPS command").ends_with("lmp-of-the-cluster"));
    let output = cluster(&path, "[\"-k\", \"on\", \"-sf\", \"kk\"]");
    assert!(finding(&output, "LAMMPS command").contains("fire/kk") && output.status.code() == Some(5));
    assert_eq!(cluster("no-such-command-of-a-cluster", "[]").status.code(), Some(127));
}

/// Points of a statistical method are planned without their surfaces, and share a task.
#[test]
fn a_thousand_points_of_a_statistical_method_are_one_task() {
    let scratch = tempfile::tempdir().expect("scratch");
    for (name, text) in [
        ("machines.toml", "[a]\nengine = \"slurm\"\n"),
        (
            "scene.toml",
            "name = \"a\"\n[surface]\ngrid = 128\n[load]\np_star = [0.01]\n[continuum]\nmethod = \"persson\"\n",
        ),
        ("sweep.toml", "scene = \"scene.toml\"\n[over]\nsurface.seed = \"1..1000\"\n"),
    ] {
        fs::write(scratch.path().join(name), text).expect("written");
    }
    let mut command = asperity();
    command.args(["sweep", "sweep.toml", "--machine", "a", "--out", "out", "--dry-run"]).current_dir(scratch.path());
    let output = command.output().expect("started");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("1000 of 1000 points in 1 task"), "{text}{}", stderr(&output));
    assert!(text.contains("--array=0-0"), "{text}");
}
