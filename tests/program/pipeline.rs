//! Complete runs with LAMMPS on a block of 3484 atoms: finished work is not repeated, and after any interruption the
//! same command continues and gives the same results.

use crate::lammps::lammps;
use crate::program::{asperity, json_line, stderr};
use serde_json::Value;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Displacement step, Å: 16 steps and some three seconds of LAMMPS, enough to interrupt it.
const FINE: f64 = 0.1;
/// Displacement step, Å: 64 steps, which take several times as long as the start of LAMMPS.
const FINEST: f64 = 0.025;
/// Displacement step, Å: four steps, one second.
const COARSE: f64 = 0.5;

/// Steps finished before a run is stopped; with fewer steps a continued run looks like a new one.
const STEPS_BEFORE: usize = 3;

/// Limit of waiting times; the whole run takes five seconds on an idle machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// A killed LAMMPS ends after its parent: the signal is immediate, but a busy machine may schedule the process late.
const GONE_WITHIN: Duration = Duration::from_secs(10);

/// Rounding of a number to four digits.
const FOUR_DIGITS: f64 = 5e-4;

const STAGES: [&str; 6] = ["surface", "continuum", "matched", "lammps", "atoms", "compare"];

struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    fn new() -> Self {
        Bench { folder: tempfile::tempdir().expect("scratch") }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes the small scene, with `more` appended to `[atoms]`.
    fn scene(&self, loads: &str, step: f64, more: &str) -> PathBuf {
        let text = format!(
            "name = \"tiny\"\n[surface]\ngrid = 32\n[load]\np_star = {loads}\n\
             [atoms]\ncells = 10\ndepth_cells = 6\nstep = \"{step} Å\"\n{more}"
        );
        let file = self.path("tiny.toml");
        std::fs::write(&file, text).expect("written");
        file
    }

    fn start(&self, scene: &Path, out: &str) -> Child {
        let mut command = asperity();
        command.arg("run").arg(scene).arg("--out").arg(self.path(out)).args(["--json", "--overwrite"]);
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started")
    }

    fn run(&self, scene: &Path, out: &str) -> Output {
        self.start(scene, out).wait_with_output().expect("ended")
    }

    /// Results and standard error of a successful run.
    fn results(&self, scene: &Path, out: &str) -> (Value, String) {
        let output = self.run(scene, out);
        assert!(output.status.success(), "{}", stderr(&output));
        let results = json_line(&output)["results"].clone();
        let file = std::fs::read(self.path(out).join("results.json")).expect("results.json");
        assert_eq!(results, serde_json::from_slice::<Value>(&file).expect("JSON"), "stdout and results.json differ");
        (results, stderr(&output))
    }

    /// Starts a run and returns when LAMMPS has finished some steps.
    fn interrupted_start(&self, scene: &Path, out: &str) -> Child {
        let child = self.start(scene, out);
        let table = self.path(out).join("lammps/load_steps.csv");
        wait_until("finished load steps", PATIENCE, || steps(&table) >= STEPS_BEFORE);
        assert!(!self.processes(out).is_empty(), "no LAMMPS is running in the job's folder");
        child
    }

    /// Processes with the job folder as working directory.
    fn processes(&self, out: &str) -> Vec<PathBuf> {
        let job = self.path(out).join("lammps").canonicalize().expect("a job folder");
        let all = std::fs::read_dir("/proc").expect("/proc").flatten().map(|e| e.path());
        all.filter(|p| std::fs::read_link(p.join("cwd")).is_ok_and(|cwd| cwd == job)).collect()
    }

    /// The same command continues after the last finished step, and its results are those of `reference`.
    fn resumes(&self, scene: &Path, out: &str, reference: &str) {
        wait_until("the end of LAMMPS", GONE_WITHIN, || self.processes(out).is_empty());
        let before = steps(&self.path(out).join("lammps/load_steps.csv"));
        let (results, said) = self.results(scene, out);
        let from = resumed_from(&said).unwrap_or_else(|| panic!("started over: {said}"));
        // At most the step in progress and one more are lost.
        assert!(from + 2 >= before && from > 0, "resumed at {from} of {before} steps");
        let (whole, _) = self.results(scene, reference);
        assert_eq!(lasting(&results), lasting(&whole));
        for state in results["atoms"]["states"].as_array().expect("states") {
            for file in ["contact_map", "gap_map", "frame"].map(|k| state[k].as_str().expect("a file")) {
                let read = |out: &str| std::fs::read(self.path(out).join(file)).expect(file);
                assert!(read(out) == read(reference), "{file} differs");
            }
        }
    }
}

fn wait_until(what: &str, patience: Duration, good: impl Fn() -> bool) {
    let begun = Instant::now();
    while !good() {
        assert!(begun.elapsed() < patience, "waited {patience:?} for {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Number of complete lines after the header.
fn steps(table: &Path) -> usize {
    std::fs::read_to_string(table).map_or(0, |t| t.matches('\n').count().saturating_sub(1))
}

fn resumed_from(said: &str) -> Option<usize> {
    let rest = said.split_once("resumed at load step ")?.1;
    rest.split_whitespace().next()?.parse().ok()
}

/// Results without values that vary between runs: computational costs and times.
fn lasting(results: &Value) -> Value {
    fn clean(value: &mut Value) {
        match value {
            Value::Object(map) => {
                map.remove("seconds");
                map.values_mut().for_each(clean);
            }
            Value::Array(list) => list.iter_mut().for_each(clean),
            _ => {}
        }
    }
    let mut kept = results.clone();
    assert!(kept.as_object_mut().is_some_and(|all| all.remove("stages").is_some()), "results without stages");
    clean(&mut kept);
    kept
}

/// Names of the stages that were run, not reused.
fn worked(results: &Value) -> Vec<&str> {
    let stages = results["stages"].as_array().expect("stages");
    assert_eq!(stages.iter().map(|s| s["name"].as_str().expect("a name")).collect::<Vec<_>>(), STAGES);
    stages.iter().filter(|s| s["reused"] == false).map(|s| s["name"].as_str().expect("a name")).collect()
}

#[test]
fn a_finished_run_is_not_run_again() {
    let Some(_lammps) = lammps(1) else { return };
    let bench = Bench::new();
    let scene = bench.scene("[0.01, 0.02]", COARSE, "");
    let (first, _) = bench.results(&scene, "run");
    assert_eq!(worked(&first), STAGES);
    let (again, said) = bench.results(&scene, "run");
    assert!(worked(&again).is_empty(), "{said}");
    assert_eq!(lasting(&first), lasting(&again));
    // Costs of reused stages are unchanged.
    let costs =
        |r: &Value| r["stages"].as_array().expect("stages").iter().map(|s| s["seconds"].clone()).collect::<Vec<_>>();
    assert_eq!(costs(&first), costs(&again));

    let out = bench.path("run");
    let compared = asperity().arg("compare").arg(&out).arg("--json").output().expect("started");
    assert!(compared.status.success(), "{}", stderr(&compared));
    assert_eq!(json_line(&compared)["comparison"], first["comparison"]);
    for file in ["report.html", "manifest.json"] {
        assert!(out.join(file).metadata().expect(file).len() > 0);
    }
}

#[test]
fn a_hardness_of_the_crystal_repeats_no_atoms_and_lowers_the_mean_gap() {
    let Some(_lammps) = lammps(1) else { return };
    let bench = Bench::new();
    let numbers = |hardness: &str| {
        let scene = bench.scene("[0.05]", COARSE, &format!("hardness = \"{hardness} GPa\"\n"));
        let (results, _) = bench.results(&scene, "run");
        let load = &results["comparison"]["loads"][0];
        let wall = load["continuum"].as_array().expect("criteria").iter().find(|m| m["id"] == "yielding_wall");
        let contact = wall.expect("the wall with hardness")["contact_area"].as_f64().expect("a number");
        let gap = |key: &str| load[key].as_f64().expect("a number");
        let gaps = ["compliant_wall_mean_gap_angstrom", "yielding_wall_mean_gap_angstrom"].map(gap);
        let stages = results["stages"].as_array().expect("stages").clone();
        let repeated: Vec<String> = stages
            .iter()
            .filter(|s| s["reused"] == false)
            .map(|s| s["name"].as_str().expect("a name").into())
            .collect();
        (contact, gaps, repeated)
    };
    let (hard_contact, [elastic, hard], _) = numbers("20.0");
    let (soft_contact, [same, soft], repeated) = numbers("3.0");
    assert_eq!(repeated, ["yielding", "compare"]);
    assert_eq!(elastic, same);
    assert!(soft < hard && hard <= elastic, "{soft} < {hard} <= {elastic}");
    assert!(soft_contact > hard_contact, "{soft_contact} > {hard_contact}");

    // The table of a run has the same numbers.
    let again = asperity().arg("run").arg(bench.path("tiny.toml")).arg("--out").arg(bench.path("run")).output();
    let output = again.expect("started");
    let table = String::from_utf8_lossy(&output.stdout).into_owned();
    let row = table.lines().find(|l| l.contains("compliant wall with hardness")).expect("a row");
    let printed: f64 = row.split_whitespace().last().expect("a column").replace('−', "-").parse().expect("a number");
    assert!((printed - soft).abs() < FOUR_DIGITS * soft.abs(), "{row}: {soft}");
    // The report and its findings state the hardness of the scene.
    let page = std::fs::read_to_string(bench.path("run/report.html")).expect("a report");
    assert!(page.contains("crystal&#39;s hardness of 3.00 GPa") || page.contains("crystal's hardness of 3.00 GPa"));
    assert!(page.contains("the hardness of 3.00\u{a0}GPa"));
}

#[test]
fn a_killed_run_resumes_and_leaves_no_orphan() {
    let Some(_lammps) = lammps(1) else { return };
    let bench = Bench::new();
    let scene = bench.scene("[0.01, 0.02]", FINE, "");
    let mut child = bench.interrupted_start(&scene, "run");
    child.kill().expect("killed");
    child.wait().expect("waited");
    assert!(!bench.path("run/results.json").exists());
    bench.resumes(&scene, "run", "reference");
}

#[test]
fn an_interrupted_run_reports_it_and_resumes() {
    let Some(_lammps) = lammps(1) else { return };
    let bench = Bench::new();
    let scene = bench.scene("[0.01, 0.02]", FINE, "");
    let child = bench.interrupted_start(&scene, "run");
    // The shell's built-in `kill`, because not every system has the program.
    let kill = format!("kill -INT {}", child.id());
    assert!(std::process::Command::new("sh").args(["-c", &kill]).status().expect("a shell").success());
    let output = child.wait_with_output().expect("ended");
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert!(stderr(&output).contains("asperity: error: interrupted"), "{}", stderr(&output));
    assert!(output.stdout.is_empty());
    bench.resumes(&scene, "run", "reference");
}

#[test]
fn a_run_past_its_time_limit_resumes_with_a_longer_one() {
    let Some(_lammps) = lammps(1) else { return };
    let bench = Bench::new();
    let limited = |seconds: f64| bench.scene("[0.01, 0.02]", FINEST, &format!("time_limit = \"{seconds} s\"\n"));
    // On any machine the limit ends before LAMMPS has read its input.
    let mut milliseconds = 50;
    let seconds = |milliseconds: u64| milliseconds as f64 / 1000.0;
    let mut output = bench.run(&limited(seconds(milliseconds)), "run");
    assert_eq!(output.status.code(), Some(4), "{}", stderr(&output));
    let mut before = 0;
    while output.status.code() == Some(4) {
        let limit = format!("time limit of {} s", seconds(milliseconds));
        assert!(stderr(&output).contains(&limit), "{limit}: {}", stderr(&output));
        wait_until("the end of LAMMPS", GONE_WITHIN, || bench.processes("run").is_empty());
        before = steps(&bench.path("run/lammps/load_steps.csv"));
        // By half each time, so that the run ends on a slow machine as well, and the last limit ended within the load steps.
        milliseconds = milliseconds * 3 / 2;
        output = bench.run(&limited(seconds(milliseconds)), "run");
    }
    assert!(output.status.success(), "{}", stderr(&output));
    let from = resumed_from(&stderr(&output));
    assert!(before > 1 && from.is_some_and(|k| k > 0), "{before} steps; {}", stderr(&output));
    let results = json_line(&output)["results"].clone();
    // Only stages that depend on the time limit ran again.
    assert_eq!(worked(&results), ["lammps", "atoms", "compare"]);
    let (whole, _) = bench.results(&bench.scene("[0.01, 0.02]", FINEST, ""), "reference");
    assert_eq!(lasting(&results), lasting(&whole));
}

#[test]
fn other_loads_repeat_only_what_depends_on_them() {
    let Some(_lammps) = lammps(1) else { return };
    let bench = Bench::new();
    let (first, _) = bench.results(&bench.scene("[0.01, 0.02]", FINE, ""), "run");
    let (more, _) = bench.results(&bench.scene("[0.005, 0.02]", FINE, ""), "run");
    assert_eq!(worked(&more), ["continuum", "matched", "atoms", "compare"]);
    // A higher load continues from the last step.
    let (higher, said) = bench.results(&bench.scene("[0.005, 0.03]", FINE, ""), "run");
    assert_eq!(worked(&higher), ["continuum", "matched", "lammps", "atoms", "compare"]);
    let last = |r: &Value| r["atoms"]["load_steps"].as_array().expect("load steps").len() - 1;
    assert_eq!(resumed_from(&said), Some(last(&more)), "{said}");
    assert!(last(&higher) > last(&more));
    // Returning to lower loads gives the earlier results.
    let (back, _) = bench.results(&bench.scene("[0.01, 0.02]", FINE, ""), "run");
    assert_eq!(lasting(&back), lasting(&first));
    let (fresh, _) = bench.results(&bench.scene("[0.005, 0.03]", FINE, ""), "fresh");
    assert_eq!(lasting(&higher), lasting(&fresh));
}

/// Under a load that a single atom carries, and under one of many. Clusters have one number in the comparison, its model chain, and the atoms as
/// a method.
#[test]
fn comparisons_state_numbers_that_exist() {
    let Some(_lammps) = lammps(1) else { return };
    let bench = Bench::new();
    let scene = bench.scene("[1e-5, 0.05]", FINE, "[continuum]\ncompare_with = [\"all-atom\"]\n");
    let (results, _) = bench.results(&scene, "run");
    let findings = results["comparison"]["findings"].to_string();
    assert!(!findings.contains("inf") && !findings.contains("NaN"), "{findings}");
    let loads = results["comparison"]["loads"].as_array().expect("loads");
    for (load, method) in loads.iter().zip(results["methods"][0]["states"].as_array().expect("states")) {
        let chain = load["model_chain"].as_array().expect("steps");
        let of_chain = chain.iter().find(|step| step["id"] == "atoms").map(|step| &step["clusters"]);
        assert!(of_chain.is_none_or(|n| *n == load["atoms_clusters"]), "{load}");
        assert_eq!(method["clusters"], load["atoms_clusters"]);
    }
}

#[test]
fn two_runs_in_one_folder_do_not_mix() {
    let Some(_lammps) = lammps(1) else { return };
    let bench = Bench::new();
    let scene = bench.scene("[0.01, 0.02]", FINE, "");
    let first = bench.interrupted_start(&scene, "run");
    // It may take less time than the second one to start.
    let signal = |signal: &str| Command::new("kill").args([signal, &first.id().to_string()]).status().expect("kill");
    signal("-STOP");
    let second = bench.run(&scene, "run");
    signal("-CONT");
    assert_eq!(second.status.code(), Some(2), "{}", stderr(&second));
    assert!(stderr(&second).contains("in use by process "), "{}", stderr(&second));
    let first = first.wait_with_output().expect("ended");
    assert!(first.status.success(), "{}", stderr(&first));
    assert_eq!(worked(&json_line(&first)["results"]), STAGES);
}

#[test]
fn adhesive_atoms_run_to_the_end() {
    let Some(_lammps) = lammps(1) else { return };
    let bench = Bench::new();
    let (free, _) = bench.results(&bench.scene("[0.01]", COARSE, ""), "free");
    let adhesion = "[adhesion]\nwork_of_adhesion = \"50 mJ/m2\"\nrange = \"2.071 nm\"\n";
    let (sticky, _) = bench.results(&bench.scene("[0.01]", COARSE, adhesion), "sticky");
    let fraction = |r: &Value| r["atoms"]["states"][0]["contact_area"].as_f64().expect("a fraction");
    assert!(fraction(&sticky) > fraction(&free), "{} {}", fraction(&sticky), fraction(&free));
    for kind in ["hard_wall", "compliant_wall"] {
        let law = sticky["comparison"][kind]["adhesion"].as_str().expect("a law").to_string();
        assert!(law.starts_with("exponential"), "{law}");
    }
    // Attraction before contact: the load of the first step is lower than without adhesion.
    let loads = |r: &Value| r["atoms"]["load_steps"][0]["load_ev_per_angstrom"].as_f64().expect("a load");
    assert!(loads(&sticky) < loads(&free), "{} {}", loads(&sticky), loads(&free));
    let page = std::fs::read_to_string(bench.path("sticky/report.html")).expect("a report");
    assert!(page.contains("Tabor"), "the audit of an adhesive run speaks of its range");
}

/// `compare` reads the copy of the scene in the run folder and finds its files without the folder of the scene.
#[test]
fn files_next_to_the_scene_are_found_from_the_run_folder() {
    let Some(_lammps) = lammps(1) else { return };
    let bench = Bench::new();
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("potentials/Ca.eam.alloy");
    std::fs::copy(shipped, bench.path("mine.eam.alloy")).expect("copied");
    let keys = "potential = \"mine.eam.alloy\"\nlattice_constant = \"5.5884 Å\"\nmodulus = \"28.57 GPa\"\n";
    let (results, _) = bench.results(&bench.scene("[0.01]", COARSE, keys), "run");
    let mut compare = asperity();
    compare.arg("compare").arg(bench.path("run")).arg("--json").current_dir("/");
    let compared = compare.output().expect("started");
    assert!(compared.status.success(), "{}", stderr(&compared));
    assert_eq!(json_line(&compared)["comparison"], results["comparison"]);
}

/// Of every kind of load: what depends on the loads is solved again for other loads, and only then.
#[test]
fn variants_are_solved_again_for_other_loads() {
    let bench = Bench::new();
    let file = bench.path("scene.toml");
    let head = "name = \"variants\"\n[surface]\ngrid = 32\ncut_off_mode = 8\n\
                [adhesion]\nwork_of_adhesion = \"1 mJ/m2\"\nrange = \"3 um\"\nalso_nonadhesive = true\n[load]\n";
    for [before, after] in [
        ["p_star = [0.02]", "p_star = [0.04]"],
        ["pressure = [\"0.1 MPa\"]", "pressure = [\"0.2 MPa\"]"],
        ["mean_gap = [\"2 um\"]", "mean_gap = [\"1.5 um\"]"],
        ["displacement = [\"1 um\"]", "displacement = [\"2 um\"]"],
    ] {
        let results = |loads: &str| {
            std::fs::write(&file, format!("{head}{loads}\n")).expect("written");
            let mut command = asperity();
            command.arg("run").arg(&file).arg("--out").arg(bench.path("out")).args(["--overwrite", "--json"]);
            let output = command.output().expect("started");
            assert!(output.status.success(), "{loads}: {}", stderr(&output));
            json_line(&output)["results"].clone()
        };
        let alone = |results: &Value| {
            let state = &results["non_adhesive"]["states"][0];
            [&results["continuum"]["states"][0], state].map(|s| (s["pressure"].clone(), s["displacement"].clone()))
        };
        let (first, second) = (alone(&results(before)), alone(&results(after)));
        assert!(first[0] != second[0] && first[1] != second[1], "{before}, {after}: {first:?} {second:?}");
    }
}

/// Results of an earlier scene must not remain as results of a scene that failed.
#[test]
fn a_failed_run_leaves_no_results_of_another_scene() {
    let Some(_lammps) = lammps(1) else { return };
    let bench = Bench::new();
    bench.results(&bench.scene("[0.01]", COARSE, ""), "run");
    // A LAMMPS that answers `-h` but fails in every run; the higher load needs a run.
    let fake = bench.path("lmp");
    let script = "#!/bin/sh\n[ \"$1\" = -h ] && exec lmp -h\necho 'ERROR: Out of luck (src/luck.cpp:7)'\nexit 1\n";
    std::fs::write(&fake, script).expect("written");
    std::fs::set_permissions(&fake, std::fs::Permissions::from_mode(0o755)).expect("executable");
    let scene = bench.scene("[0.1]", COARSE, "program = \"./lmp\"\n");
    // A program of a scene is executed on request only.
    let refused = bench.run(&scene, "run");
    assert_eq!(refused.status.code(), Some(2), "{}", stderr(&refused));
    assert!(stderr(&refused).contains("--allow-program"), "{}", stderr(&refused));
    let mut allowed = asperity();
    allowed.arg("run").arg(&scene).arg("--out").arg(bench.path("run")).args([
        "--json",
        "--overwrite",
        "--allow-program",
    ]);
    let output = allowed.output().expect("started");
    assert_eq!(output.status.code(), Some(4), "{}", stderr(&output));
    assert!(stderr(&output).contains("it stopped with: Out of luck"), "{}", stderr(&output));
    for file in ["results.json", "report.html", "manifest.json", "results.nc"] {
        assert!(!bench.path("run").join(file).exists(), "{file} of the scene before is still there");
    }
}

#[test]
fn more_ranks_than_cores_are_refused_by_key() {
    let Some(_lammps) = lammps(1) else { return };
    let bench = Bench::new();
    let output = bench.run(&bench.scene("[0.01]", COARSE, "ranks = 1024\n"), "run");
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("tiny.toml: atoms.ranks = 1024"), "{}", stderr(&output));
}
