//! Failures of LAMMPS runs, with error message and exit code.
//!
//! Without LAMMPS these tests print a warning and pass.

use crate::jobs::{A0, CUTOFF, RAMP, RELAXATION, on, ramp, written};
use crate::lammps::lammps;
use std::io::Write;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use asperity::atoms::block::{BaseKind, Block};
use asperity::atoms::engine::{Finished, LammpsEngine};
use asperity::atoms::job::Job;
use asperity::atoms::job_spec::DisplacementRamp;
use asperity::atoms::load_history::frame_file;
use asperity::atoms::progress::Progress;

/// Steps of these runs: contact starts in the second.
const STEPS: usize = 5;
/// Tolerance of loads after a change of the number of ranks, eV/Å: the uncertainty of the load at a force tolerance of
/// 2e-3 eV/Å.
const LOAD_NOISE: f64 = 2e-2;

/// Rigid, and elastic in a host of LAMMPS's library.
const BASES: [BaseKind; 2] = [BaseKind::Rigid, BaseKind::Elastic];
/// Cells of the elastic foundation.
const FOUNDATION: usize = 3;

fn job(folder: &Path) -> Job {
    job_on(BaseKind::Rigid, folder)
}

/// 6 × 6 × 3 cells under a wave of 1.4 Å.
fn job_on(base: BaseKind, folder: &Path) -> Job {
    let height = |x: usize, y: usize, points: usize| {
        let wave = |k: usize| (2.0 * std::f64::consts::PI * k as f64 / points as f64).sin();
        0.7 + 0.4 * wave(x) + 0.3 * wave(y)
    };
    let block = Block::new(6, 3, A0, CUTOFF).expect("valid");
    let block = match base {
        BaseKind::Elastic => block.on_elastic_base(FOUNDATION, CUTOFF).expect("valid"),
        _ => block,
    };
    // Below the strains of an elastic base, above the loads of these steps.
    let ramp = DisplacementRamp { step_angstrom: 0.2, max_steps: STEPS, max_load: 20.0, ..RAMP };
    written(folder, block, height, None, ramp, RELAXATION).job
}

/// The error message of a run that fails.
fn said(engine: &LammpsEngine, job: &Job) -> String {
    message_of(engine, job, &mut on)
}

fn message_of(engine: &LammpsEngine, job: &Job, watch: &mut dyn FnMut(Progress) -> ControlFlow<()>) -> String {
    failure(job, engine.run(job, watch).expect_err("a failure"))
}

fn failure(job: &Job, error: asperity::Error) -> String {
    assert_eq!(error.exit_code(), 4, "{error}");
    assert!(error.to_string().contains(&job.folder.display().to_string()), "{error}");
    error.to_string()
}

/// Replaces a line of the script for one failing run.
fn with_script(engine: &LammpsEngine, job: &Job, line: &str, by: &str) -> String {
    watched_with_script(engine, job, (line, by), &mut on)
}

fn watched_with_script(
    engine: &LammpsEngine,
    job: &Job,
    line: (&str, &str),
    watch: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> String {
    failure(job, run_with_script(engine, job, line, watch))
}

fn run_with_script(
    engine: &LammpsEngine,
    job: &Job,
    (line, by): (&str, &str),
    watch: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> asperity::Error {
    let parts = ["start", "relax", "end"].map(|part| job.folder.join(format!("displacement_ramp_{part}.in")));
    let texts = parts.map(|script| (std::fs::read_to_string(&script).expect("read"), script));
    let (text, script) = texts.into_iter().find(|(text, _)| text.contains(line)).expect("one has the line");
    std::fs::write(&script, text.replacen(line, by, 1)).expect("written");
    let error = engine.run(job, watch).expect_err("a failure");
    std::fs::write(&script, text).expect("written");
    error
}

const MINIMIZE: &str = "minimize      0.0";

/// A file for which a run changed by [`waiting_at`] waits, for at most 30 s.
const GO: &str = "go";
const WAIT: &str = "i=0; while [ ! -e go ] && [ $i -lt 600 ]; do sleep 0.05; i=$((i + 1)); done\n";

/// Makes the run wait before a step relaxes, so that the test acts in time on a busy machine as well.
fn waiting_at(job: &Job, step: usize) -> String {
    std::fs::write(job.folder.join("wait.sh"), WAIT).expect("written");
    format!("if \"$k == {step}\" then \"shell sh wait.sh\"\n{MINIMIZE}")
}

#[test]
fn changed_inputs_of_a_job_are_refused() {
    let Some(engine) = lammps(1) else { return };
    for name in ["block.data", "potential.eam.alloy"] {
        let folder = tempfile::tempdir().expect("scratch");
        let job = job(folder.path());
        let file = folder.path().join(name);
        let mut bytes = std::fs::read(&file).expect("read");
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        std::fs::write(&file, bytes).expect("written");
        let refused = engine.run(&job, &mut on).expect_err("refused").to_string();
        assert!(refused.contains(name) && refused.contains("atoms build"), "{refused}");
    }
}

/// The third of the strains at which the force constants are measured.
const THIRD: usize = 3;

#[test]
fn a_run_ends_while_its_elastic_base_is_measured() {
    let Some(engine) = lammps(1) else { return };
    let folder = tempfile::tempdir().expect("scratch");
    let job = job_on(BaseKind::Elastic, folder.path());
    let mut calls = 0;
    let mut until_third = |_: Progress| {
        calls += 1;
        if calls < THIRD { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    };
    let error = engine.run(&job, &mut until_third).expect_err("interrupted");
    assert!(matches!(error, asperity::Error::Interrupted), "{error}");
    let message =
        failure(&job, engine.clone().with_time_limit(Some(Duration::ZERO)).run(&job, &mut on).expect_err("late"));
    assert!(message.contains("time limit"), "{message}");
    assert!(!folder.path().join("log.0").exists(), "the load steps have not begun");
}

#[test]
fn lammps_errors_are_reported() {
    let Some(engine) = lammps(1) else { return };
    BASES.into_iter().for_each(|base| errors_are_reported_on(&engine, base));
}

fn errors_are_reported_on(engine: &LammpsEngine, base: BaseKind) {
    let folder = tempfile::tempdir().expect("scratch");
    let mut job = job_on(base, folder.path());
    let atoms = job.atoms();

    let lost = with_script(engine, &job, MINIMIZE, "displace_atoms block move 0 0 500 units box\nminimize      0.0");
    assert!(lost.contains(&format!("the atom count changed from {atoms} to ")), "{lost}");

    let hot = "velocity block create 1.0e7 4928\nfix move block nve\ntimestep 0.05\nrun 400\nminimize      0.0";
    let blown = with_script(engine, &job, MINIMIZE, hot);
    assert!(blown.contains("the atom count changed") || blown.contains("it stopped with"), "{blown}");

    if base == BaseKind::Elastic {
        let left =
            with_script(engine, &job, MINIMIZE, "displace_atoms base move 0 0 -500 units box\nminimize      0.0");
        assert!(left.contains("atoms left the elastic base") && left.contains("depth_cells"), "{left}");
    }

    let unknown = with_script(engine, &job, MINIMIZE, "minimise      0.0");
    assert!(unknown.contains("Unknown command: minimise"), "{unknown}");

    ramp(&mut job).step_angstrom = f64::NAN;
    let step = said(engine, &job);
    match base {
        BaseKind::Elastic => assert!(step.contains("Expected floating point parameter"), "{step}"),
        _ => assert!(step.contains("its load steps cannot be read") && step.contains("0,nan"), "{step}"),
    }
    ramp(&mut job).step_angstrom = 0.2;

    std::fs::rename(folder.path().join("potential.eam.alloy"), folder.path().join("gone")).expect("moved");
    let missing = engine.run(&job, &mut on).expect_err("a failure").to_string();
    let expected = match base {
        // The program reads the range of the potential first.
        BaseKind::Elastic => "potential.eam.alloy: No such file",
        _ => "cannot open eam/alloy potential file potential.eam.alloy",
    };
    assert!(missing.contains(expected), "{missing}");
    std::fs::rename(folder.path().join("gone"), folder.path().join("potential.eam.alloy")).expect("moved");

    // After these failures the same folder runs.
    assert_eq!(engine.run(&job, &mut on).expect("a clean run").history.steps.len(), STEPS + 1);
}

/// The job's own LAMMPS, by its working folder.
fn process_of(folder: &Path) -> Option<String> {
    let folder = folder.canonicalize().ok()?;
    std::fs::read_dir("/proc").ok()?.filter_map(Result::ok).find_map(|entry| {
        let pid = entry.file_name().into_string().ok().filter(|n| n.bytes().all(|b| b.is_ascii_digit()))?;
        (std::fs::read_link(entry.path().join("cwd")).ok()? == folder).then_some(pid)
    })
}

#[test]
fn a_killed_or_timed_out_run_can_be_continued() {
    let Some(engine) = lammps(1) else { return };
    BASES.into_iter().for_each(|base| killed_and_timed_out_on(&engine, base));
}

fn killed_and_timed_out_on(engine: &LammpsEngine, base: BaseKind) {
    let (whole, folder) = (tempfile::tempdir().expect("scratch"), tempfile::tempdir().expect("scratch"));
    let expected = engine.run(&job_on(base, whole.path()), &mut on).expect("a clean run");
    let job = job_on(base, folder.path());
    let wait = waiting_at(&job, 3);
    let killed = watched_with_script(engine, &job, (MINIMIZE, &wait), &mut |p| {
        if p.is_new && p.record.is_some_and(|r| r.step == 1) {
            let pid = process_of(folder.path()).expect("LAMMPS runs");
            assert!(Command::new("kill").args(["-9", &pid]).status().expect("kill").success());
        }
        ControlFlow::Continue(())
    });
    assert!(killed.contains("killed by signal 9"), "{killed}");

    // The limit has passed when the fourth step begins to relax.
    let timer = "if \"$k > 2\" then \"timer timeout 0:00:01 every 1\" \"shell sleep 2\"\nminimize      0.0";
    let timed = with_script(engine, &job, MINIMIZE, timer);
    assert!(timed.contains("timer timeout") && timed.contains("resumes at the last step"), "{timed}");

    let finished = engine.run(&job, &mut on).expect("the rest");
    assert_eq!(finished.resumed_from, Some(2));
    assert_eq!(finished.history, expected.history);
}

/// Time without a word of LAMMPS, which waits for up to 30 s.
const SILENCE: Duration = Duration::from_millis(500);

#[test]
fn a_run_that_hangs_is_named() {
    let Some(engine) = lammps(1) else { return };
    for base in BASES {
        let folder = tempfile::tempdir().expect("scratch");
        let job = job_on(base, folder.path());
        let wait = waiting_at(&job, 2);
        let mut silent = None;
        let mut watch = |p: Progress| {
            let waits = p.record.as_ref().is_some_and(|r| r.step == 1);
            silent = silent.or(p.silent_s.filter(|_| waits));
            if silent.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let stopped = run_with_script(&engine.clone().with_silence_limit(SILENCE), &job, (MINIMIZE, &wait), &mut watch);
        assert_eq!(stopped.exit_code(), 130, "{stopped}");
        assert!(silent.is_some_and(|s| s > SILENCE.as_secs_f64()), "{silent:?}");
    }
}

/// Makes writing a file of a later step fail as on a full disk.
fn fill(folder: &Path, name: &str) {
    std::os::unix::fs::symlink("/dev/full", folder.join(name)).expect("linked");
}

#[test]
fn a_full_disk_is_reported_and_truncated_steps_are_repeated() {
    let Some(engine) = lammps(1) else { return };
    BASES.into_iter().for_each(|base| a_full_disk_on(&engine, base));
}

fn a_full_disk_on(engine: &LammpsEngine, base: BaseKind) {
    let (whole, folder) = (tempfile::tempdir().expect("scratch"), tempfile::tempdir().expect("scratch"));
    let expected = engine.run(&job_on(base, whole.path()), &mut on).expect("a clean run");
    let packed = frame_file(whole.path(), 3).expect("a frame").extension().is_some_and(|e| e == "zst");
    let job = job_on(base, folder.path());
    let path = folder.path();
    let at_first = |name: String| {
        move |p: Progress| {
            if p.is_new && p.record.is_some_and(|r| r.step == 0) {
                fill(path, &name);
                std::fs::write(path.join(GO), "").expect("written");
            }
            ControlFlow::Continue(())
        }
    };
    // LAMMPS detects this failure...
    let wait = waiting_at(&job, 1);
    let restart = watched_with_script(engine, &job, (MINIMIZE, &wait), &mut at_first("restart.3".into()));
    assert!(restart.contains("I/O error while writing restart"), "{restart}");
    std::fs::remove_dir_all(path).expect("removed");
    let job = job_on(base, path);
    // ...but writes a truncated frame without an error.
    let end = if packed { ".zst" } else { "" };
    let wait = waiting_at(&job, 1);
    let full = format!("frame.3.dump{end}");
    let frame = watched_with_script(engine, &job, (MINIMIZE, &wait), &mut at_first(full));
    assert!(frame.contains("what step 3 left is not complete") && frame.contains("is the disk full?"), "{frame}");
    let finished = engine.run(&job, &mut on).expect("the rest");
    assert_eq!(finished.history, expected.history);
}

/// Stops a run after a step.
fn stopped_after(engine: &LammpsEngine, job: &Job, step: usize) {
    let wait = waiting_at(job, step + 1);
    let stopped = run_with_script(engine, job, (MINIMIZE, &wait), &mut |p| {
        let there = p.is_new && p.record.is_some_and(|r| r.step >= step);
        if there { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert_eq!(stopped.exit_code(), 130);
}

#[test]
fn a_damaged_restart_file_is_not_used() {
    let Some(engine) = lammps(1) else { return };
    let (whole, folder) = (tempfile::tempdir().expect("scratch"), tempfile::tempdir().expect("scratch"));
    let expected = engine.run(&job(whole.path()), &mut on).expect("a clean run");
    let job = job(folder.path());
    stopped_after(&engine, &job, 2);
    let last = std::fs::read_to_string(folder.path().join("load_steps.csv")).expect("read").lines().count() - 2;
    let file = folder.path().join(format!("restart.{last}"));
    let mut bytes = std::fs::read(&file).expect("read");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x40;
    std::fs::write(&file, bytes).expect("written");
    let finished: Finished = engine.run(&job, &mut on).expect("the rest");
    assert_eq!(finished.resumed_from, Some(last - 1));
    assert_eq!(finished.history, expected.history);
}

#[test]
fn a_run_can_be_continued_with_another_number_of_ranks() {
    let Some(engine) = lammps(2) else { return };
    let Ok(two) = engine.clone().with_ranks(2) else {
        let _ = writeln!(std::io::stderr(), "\n*** NOT TESTED: no second core, or no mpirun ***\n");
        return;
    };
    let (whole, folder) = (tempfile::tempdir().expect("scratch"), tempfile::tempdir().expect("scratch"));
    let expected = engine.run(&job(whole.path()), &mut on).expect("a clean run");
    let job = job(folder.path());
    stopped_after(&engine, &job, 2);
    let finished = two.run(&job, &mut on).expect("the rest");
    assert!(finished.resumed_from.is_some_and(|k| k >= 2));
    for (a, b) in finished.history.steps.iter().zip(&expected.history.steps) {
        assert!((a.load - b.load).abs() < LOAD_NOISE, "{} {}", a.load, b.load);
        assert_eq!(a.atoms, b.atoms);
    }
    assert_eq!(finished.history.steps.len(), STEPS + 1);
}
