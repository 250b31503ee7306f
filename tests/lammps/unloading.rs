//! Unloading from the highest load: reversible without plasticity and adhesion; with a pull-off force with adhesion.

use crate::jobs::{built, case, on};
use crate::lammps::lammps;
use asperity::atoms::engine::Finished;
use asperity::atoms::job::Job;
use asperity::atoms::load_history::frame_file;
use asperity::atoms::results::{AtomsResults, Unloading};
use asperity::grid::units::GPA_PER_EV_A3;
use asperity::pipeline::read_atoms;
use asperity::scene::Case;
use std::ops::ControlFlow;
use std::path::Path;

const LOADS: [f64; 2] = [0.02, 0.06];

fn there_and_back(load: &str, adhesion: &str, atoms: &str) -> Case {
    case(&format!("p_star = {LOADS:?}\n{load}"), adhesion, atoms)
}

/// γ/(E* L) = 2·10⁻⁴: 0.032 J/m² between flats of this block.
const ADHESION: &str = "[adhesion]\nwork_of_adhesion = \"500 mJ/m2\"\nrange = \"2 nm\"\n";

/// Uncertainty of the load of this small cell at a force tolerance of 2e-3 eV/Å, eV/Å.
const LOAD_NOISE: f64 = 2e-2;
/// Tolerance of contact fractions: one of the 200 surface atoms.
const ONE_ATOM: f64 = 1.0 / 200.0;

fn read(case: &Case, job: &Job) -> (AtomsResults, Unloading) {
    let out = tempfile::tempdir().expect("scratch");
    let found = read_atoms(case, case.atoms.as_ref().expect("atoms"), job, out.path()).expect("read");
    let back = found.unloading.clone().expect("an unloading branch");
    (found, back)
}

/// Checks that contact and mean gap are equal on both branches at each load.
fn unloads_along_the_loading_curve(found: &AtomsResults, back: &Unloading) {
    assert_eq!(found.states.len(), LOADS.len());
    assert_eq!(back.states.iter().map(|s| s.p_star).collect::<Vec<_>>(), [LOADS[0]]);
    for change in &back.changes {
        let more = change.contact_area_unloading - change.contact_area_loading;
        assert!(change.contact_area_loading > 0.05 && more.abs() < 1.5 * ONE_ATOM, "{change:?}");
        assert!(change.mean_gap_angstrom.abs() < 0.01, "{change:?}");
    }
    assert_eq!(back.changes.len(), 1);
    assert_eq!(back.pull_off, None);
}

#[test]
fn unloading_without_adhesion_is_reversible() {
    let Some(engine) = lammps(1) else { return };
    let folder = tempfile::tempdir().expect("scratch");
    let case = there_and_back("unload = true", "", "start = \"touch\"");
    let job = built(&case, folder.path());
    let found = engine.run(&job, &mut on).expect("a clean run");
    assert!(found.unconverged.is_empty());
    let records = &found.history.steps;
    let turn = job.reversal_step(records).expect("a turn");
    assert!(records[turn].load >= LOADS[1] * job.spec.settings.load_unit);
    assert_eq!(job.end(records), Some(records.len() - 1));
    let mut met = 0;
    for (there, back) in records[..turn].iter().rev().zip(&records[turn + 1..]) {
        assert!((there.displacement_angstrom - back.displacement_angstrom).abs() < 1e-6);
        let off = (there.load - back.load).abs();
        assert!(off < LOAD_NOISE, "{} and {}", there.load, back.load);
        assert_eq!(there.contacts, back.contacts, "at {} Å", there.displacement_angstrom);
        met += back.contacts;
    }
    assert!(met > 100, "only {met} contacts");
    // The branch ends without contact.
    let last = records.last().expect("steps");
    assert_eq!((last.contacts, last.load), (0, 0.0));
    let (found, back) = read(&case, &job);
    unloads_along_the_loading_curve(&found, &back);
    assert_eq!((back.reversal_step, back.separated), (turn, Some(true)));
}

#[test]
fn prescribed_loads_unload_reversibly() {
    let Some(engine) = lammps(1) else { return };
    let folder = tempfile::tempdir().expect("scratch");
    let case = there_and_back("unload = true", "", "");
    let job = built(&case, folder.path());
    let found = engine.run(&job, &mut on).expect("a clean run");
    let records = &found.history.steps;
    assert!(found.unconverged.is_empty() && records.len() == 4);
    assert_eq!(job.reversal_step(records), Some(2));
    let unit = job.spec.settings.load_unit;
    assert!((records[3].load / (LOADS[0] * unit) - 1.0).abs() < 1e-3);
    assert!((records[3].displacement_angstrom - records[1].displacement_angstrom).abs() < 0.01);
    let (found, back) = read(&case, &job);
    unloads_along_the_loading_curve(&found, &back);
    assert_eq!(back.separated, None);
}

/// The pull-off force with default steps and with steps of two thirds.
#[test]
fn the_pull_off_force_is_found_within_its_error() {
    let Some(engine) = lammps(1) else { return };
    let mut pulls = Vec::new();
    for step in [0.3, 0.2] {
        let folder = tempfile::tempdir().expect("scratch");
        let case = there_and_back("pull_off = true", ADHESION, &format!("step = \"{step} Å\""));
        let job = built(&case, folder.path());
        engine.run(&job, &mut on).expect("a clean run");
        let (_, back) = read(&case, &job);
        assert!(back.states.is_empty() && back.separated == Some(true));
        let pull = back.pull_off.expect("a pull");
        // Steps are refined to a quarter.
        assert!((pull.step_angstrom - 0.25 * step).abs() < 1e-6, "{pull:?}");
        // At most the tension of two flat surfaces at the strength of the law.
        let length = job.spec.block.length();
        let gamma = 2e-4 * 28.57 * length / GPA_PER_EV_A3;
        let flats = gamma / 0.5 * length * length;
        let force = pull.force_ev_per_angstrom;
        assert!(force < -0.1 && force > -flats, "{force} of {flats}");
        pulls.push(pull);
    }
    let off = (pulls[0].force_ev_per_angstrom - pulls[1].force_ev_per_angstrom).abs();
    let error = pulls.iter().map(|p| p.error_ev_per_angstrom).fold(LOAD_NOISE, f64::max);
    assert!(off <= error, "{pulls:?}");
    // The error is a small fraction of the force.
    assert!(error < 0.2 * -pulls[0].force_ev_per_angstrom, "{pulls:?}");
}

fn bytes(folder: &Path, finished: &Finished) -> Vec<Vec<u8>> {
    let mut files = vec![folder.join("load_steps.csv")];
    files.extend(finished.history.steps.iter().map(|r| frame_file(folder, r.step).expect("a frame")));
    files.iter().map(|f| std::fs::read(f).expect("read")).collect()
}

#[test]
fn a_ramp_killed_while_unloading_continues_bit_identically() {
    let Some(engine) = lammps(1) else { return };
    let (whole, killed) = (tempfile::tempdir().expect("scratch"), tempfile::tempdir().expect("scratch"));
    let case = there_and_back("unload = true", ADHESION, "");
    let expected = engine.run(&built(&case, whole.path()), &mut on).expect("a clean run");
    let job = built(&case, killed.path());
    let turn = job.reversal_step(&expected.history.steps).expect("a turn");
    let slow = job.unloading_state(&expected.history.steps).and_then(|w| w.refined_from).expect("shorter steps");
    // At the reversal, before and after the refinement, and at a large tension.
    for stop in [turn, slow - 1, slow, slow + 12] {
        let error = engine.run(&job, &mut |p| {
            let after = p.record.is_some_and(|r| r.step >= stop);
            if after { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        assert!(matches!(error, Err(asperity::Error::Interrupted)));
        // As if LAMMPS had finished the last step after it was looked at for the last time.
        let table = std::fs::read_to_string(killed.path().join("load_steps.csv")).expect("read");
        let last = table.matches('\n').count() - 2;
        let _ = std::fs::remove_file(killed.path().join(format!("frame.{last}.b3")));
    }
    let finished = engine.run(&built(&case, killed.path()), &mut on).expect("the rest");
    assert!(finished.resumed_from.is_some_and(|k| k >= slow + 12));
    assert_eq!(finished.history, expected.history);
    assert!(bytes(whole.path(), &expected) == bytes(killed.path(), &finished), "other bytes after resuming");
}
