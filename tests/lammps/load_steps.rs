//! Displacement ramps in LAMMPS. Without LAMMPS these tests print a warning and pass.

use crate::jobs::{A0, CUTOFF, D_C, RAMP, RELAXATION, Setting, on, ramp, written};
use crate::lammps::lammps;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Duration;

use asperity::Error;
use asperity::atoms::block::Block;
use asperity::atoms::centro_symmetry::{NOISE, defect_atoms};
use asperity::atoms::contact::contact;
use asperity::atoms::dump::read_frame;
use asperity::atoms::engine::{Finished, LammpsEngine};
use asperity::atoms::forces::indenter_forces;
use asperity::atoms::interaction::Yukawa;
use asperity::atoms::job_spec::{DisplacementRamp, FRAME_LAYERS, RelaxationSettings};
use asperity::atoms::load_history::frame_file;

/// E* of the potential, eV/Å³ (28.57 GPa).
const MODULUS: f64 = 28.57 / 160.217_663_4;
/// p/E* at the end of the ramps: some 50 of the 200 surface atoms are in contact.
const P_STAR: f64 = 0.02;

/// Uncertainty of the load of this cell at a force tolerance of 2e-3 eV/Å, measured against 2e-4, eV/Å; a step in
/// contact changes the load by more than 1 eV/Å.
const LOAD_NOISE: f64 = 2e-2;

/// Tolerance of loads computed from a frame: relative, and absolute for coordinates of six decimals at 1 eV/Å² per
/// pair, eV/Å.
const SAME_LOAD: (f64, f64) = (1e-6, 1e-5);

/// 10 × 10 × 6 cells under two crossed waves: peaks of 2.4 Å, all indenter atoms at different heights.
fn setting(folder: &Path, adhesion: Option<Yukawa>) -> Setting {
    steeper(folder, adhesion, 1.0, FRAME_LAYERS)
}

/// The same with steeper waves, and more layers in the frames.
fn steeper(folder: &Path, adhesion: Option<Yukawa>, factor: f64, frame_layers: usize) -> Setting {
    let block = Block::new(10, 6, A0, CUTOFF).expect("valid");
    let height = |x: usize, y: usize, points: usize| {
        let wave = |k: f64| (2.0 * std::f64::consts::PI * k / points as f64).sin();
        let (x, y) = (x as f64, y as f64);
        factor * (1.2 + 0.7 * wave(x + 0.3) + 0.3 * wave(2.0 * y - x) + 0.2 * wave(3.0 * y + 0.7))
    };
    let load_unit = block.length().powi(2) * MODULUS;
    written(
        folder,
        block,
        height,
        adhesion,
        DisplacementRamp { max_load: P_STAR * load_unit, ..RAMP },
        RelaxationSettings { load_unit, frame_layers, ..RELAXATION },
    )
}

/// All files that later stages read.
fn results(folder: &Path, finished: &Finished) -> Vec<Vec<u8>> {
    let mut files = vec![folder.join("load_steps.csv")];
    files.extend(finished.history.steps.iter().map(|r| frame_file(folder, r.step).expect("a frame")));
    files.iter().map(|f| std::fs::read(f).expect("read")).collect()
}

#[test]
fn loads_increase_and_contact_agrees_with_lammps() {
    let Some(engine) = lammps(1) else { return };
    let folder = tempfile::tempdir().expect("scratch");
    let Setting { block, indenter, job } = setting(folder.path(), None);
    let mut steps = Vec::new();
    let finished = engine
        .run(&job, &mut |p| {
            if p.is_new {
                steps.push(p.record.expect("a new step").step);
            }
            ControlFlow::Continue(())
        })
        .expect("a clean run");
    let records = &finished.history.steps;
    assert_eq!(steps, (0..records.len()).collect::<Vec<_>>());
    assert!(finished.unconverged.is_empty(), "{:?}", finished.unconverged);
    // No load before contact, except for the relaxation of the surface.
    assert!(records[0].load.abs() < 0.1, "{}", records[0].load);
    assert!(records.windows(2).all(|w| w[1].load > w[0].load - LOAD_NOISE));
    let last = records.last().expect("steps");
    let max_load = job.spec.protocol.ramp().expect("a displacement ramp").max_load;
    assert!(last.load >= max_load && records[records.len() - 2].load < max_load);
    assert!(records.iter().all(|r| r.atoms == job.atoms()));
    assert!(finished.steps.iter().skip(1).all(|s| s.force_evaluations > 0));
    assert!((indenter.lowest_z() - records[0].indenter_low_angstrom).abs() < 1e-6);

    let surface = block.surface();
    let mut most = 0;
    for record in records {
        let frame = read_frame(frame_file(folder.path(), record.step).expect("a frame")).expect("good");
        let found = contact(&frame, &indenter, record.displacement_angstrom, &surface, D_C);
        assert_eq!(found.ids.len(), record.contacts, "step {}", record.step);
        let load = indenter_forces(&frame, &indenter, record.displacement_angstrom, &job.spec.interaction, 0.0).load();
        let slack = SAME_LOAD.0 * record.load.abs() + SAME_LOAD.1;
        assert!((load - record.load).abs() < slack, "step {}: {load} for {}", record.step, record.load);
        most = most.max(record.contacts);
    }
    assert!(most > 20, "only {most} contacts");

    let load = 0.5 * P_STAR;
    let at = job.at_load(&finished.history, load * job.spec.settings.load_unit).expect("reached");
    let found = contact(&at.frame, &indenter, at.displacement_angstrom, &surface, D_C);
    let between = records[at.bracket.lower].contacts..=records[at.bracket.lower + 1].contacts;
    assert!(between.contains(&found.ids.len()), "{} not in {between:?}", found.ids.len());

    // A finished job does not run again.
    let before = std::fs::read(folder.path().join("log.0")).expect("log");
    let again = engine.run(&job, &mut on).expect("nothing to do");
    assert_eq!(again.history, finished.history);
    assert_eq!(std::fs::read(folder.path().join("log.0")).expect("log"), before);
}

#[test]
fn a_killed_ramp_continues_bit_identically() {
    let Some(engine) = lammps(1) else { return };
    let (whole, killed) = (tempfile::tempdir().expect("scratch"), tempfile::tempdir().expect("scratch"));
    // Many short steps, so that a machine that polls late still finds the ramp unfinished.
    let fine = |folder: &Path| {
        let mut setting = setting(folder, None);
        ramp(&mut setting.job).step_angstrom = 0.1;
        setting
    };
    let reference = fine(whole.path());
    let expected = engine.run(&reference.job, &mut on).expect("a clean run");
    let broken = fine(killed.path());
    for stop in [2, 5] {
        // Interrupted within a later step; `Break` kills the process group with SIGKILL.
        let error = engine.run(&broken.job, &mut |p| {
            let after = p.record.is_some_and(|r| r.step >= stop);
            if after { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        assert!(matches!(error, Err(Error::Interrupted)));
    }
    let finished = engine.run(&broken.job, &mut on).expect("the rest");
    assert!(finished.resumed_from.is_some_and(|k| k >= 5));
    assert_eq!(finished.history, expected.history);
    // The logs of the parts have the same total counts as the log of the uninterrupted run.
    assert_eq!(serde_json::to_value(&finished.steps).ok(), serde_json::to_value(&expected.steps).ok());
    assert!(results(whole.path(), &expected) == results(killed.path(), &finished), "other bytes after resuming");
}

#[test]
fn adhesion_gives_a_tensile_load_before_contact() {
    let Some(engine) = lammps(1) else { return };
    let folder = tempfile::tempdir().expect("scratch");
    let weak = Yukawa { amplitude_ev_angstrom: -60.0, kappa_per_angstrom: 2.0, cutoff_angstrom: 7.0 };
    let Setting { indenter, mut job, .. } = setting(folder.path(), Some(weak));
    ramp(&mut job).max_steps = 1;
    let finished = engine.run(&job, &mut on).expect("a clean run");
    for record in &finished.history.steps {
        let frame = read_frame(frame_file(folder.path(), record.step).expect("a frame")).expect("good");
        let load = indenter_forces(&frame, &indenter, record.displacement_angstrom, &job.spec.interaction, 0.0).load();
        assert!(
            (load - record.load).abs() < SAME_LOAD.0 * record.load.abs() + SAME_LOAD.1,
            "{load} for {}",
            record.load
        );
    }
    assert!(finished.history.steps[0].load < -1e-3, "{}", finished.history.steps[0].load);
}

/// Waves with an rms gradient of about 0.1 leave the crystal elastic; waves ten times as steep cause plastic flow.
#[test]
fn a_steep_profile_yields_and_a_gentle_one_does_not() {
    let Some(engine) = lammps(1) else { return };
    for (factor, yields) in [(1.0, false), (10.0, true)] {
        let folder = tempfile::tempdir().expect("scratch");
        let Setting { block, job, .. } = steeper(folder.path(), None, factor, 2 * 6);
        let finished = engine.run(&job, &mut on).expect("a clean run");
        let frame = |step| read_frame(frame_file(folder.path(), step).expect("a frame")).expect("good");
        let left = |step| defect_atoms(&frame(step), &block).expect("every atom").len();
        assert_eq!(left(0), 0, "before contact");
        let last = finished.history.last().expect("steps").step;
        let found = left(last);
        assert_eq!(found > NOISE, yields, "slope x {factor}: {found} atoms at step {last}");
        assert!(yields || found == 0, "{found}");
    }
}

#[test]
fn failures_are_reported_with_their_exit_code() {
    let Some(engine) = lammps(1) else { return };
    let folder = tempfile::tempdir().expect("scratch");
    let job = setting(folder.path(), None).job;
    let said = |engine: &LammpsEngine| {
        let error = engine.run(&job, &mut on).expect_err("a failure");
        assert_eq!(error.exit_code(), 4, "{error}");
        error.to_string()
    };
    let limited = engine.clone().with_time_limit(Some(Duration::from_millis(1)));
    assert!(said(&limited).contains("time limit of 0.001 s"));

    let [relax, script] = ["relax", "step"].map(|part| folder.path().join(format!("displacement_ramp_{part}.in")));
    let text = std::fs::read_to_string(&relax).expect("read");
    std::fs::write(&relax, text.replace("min_style", "max_style")).expect("written");
    let message = said(&engine);
    assert!(message.contains("Unknown command: max_style"), "{message}");
    std::fs::write(&relax, text).expect("written");
    let text = std::fs::read_to_string(&script).expect("read");
    // A script that ends early exits normally, but its result is refused.
    std::fs::write(&script, format!("{text}\nquit\n")).expect("written");
    let message = said(&engine);
    assert!(message.contains("stops at step 0") || message.contains("did not finish"), "{message}");
    std::fs::write(&script, text).expect("written");

    std::fs::remove_file(folder.path().join("potential.eam.alloy")).expect("removed");
    let message = said(&engine);
    assert!(message.contains("cannot open eam/alloy potential file"), "{message}");
}
