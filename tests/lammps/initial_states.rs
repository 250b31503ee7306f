//! Prescribed loads started from the continuum solution reach the states of a displacement ramp.

use crate::jobs::{built, case, on, ramp};
use crate::lammps::lammps;
use asperity::atoms::block::SurfaceSites;
use asperity::atoms::contact::{ContactAtoms, contact};
use asperity::atoms::dump::read_frame;
use asperity::atoms::engine::Finished;
use asperity::atoms::indenter::Indenter;
use asperity::atoms::job::Job;
use asperity::atoms::load_history::frame_file;
use asperity::atoms::minimizer_checkpoint;
use asperity::atoms::scripts::PRESCRIBED_LOAD_RELAX;
use asperity::grid::Grid;
use asperity::scene::Case;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Duration;

const LOADS: [f64; 2] = [0.02, 0.06];

fn smooth_case(atoms: &str) -> Case {
    case(&format!("p_star = {LOADS:?}"), "", atoms)
}

fn touching(case: &Case, job: &Job, finished: &Finished, step: usize) -> ContactAtoms {
    let atoms = case.atoms.as_ref().expect("atoms");
    let heights = atoms.heights_angstrom(case.surface(), Grid::unit(atoms.points, atoms.points));
    let touch = atoms.wall.minimum_angstrom();
    let indenter = Indenter::above(&atoms.block, atoms.points, heights, touch).expect("an indenter");
    let frame = read_frame(frame_file(&job.folder, step).expect("a frame")).expect("good");
    let sites: SurfaceSites = atoms.block.surface();
    let down = finished.history.steps[step].displacement_angstrom;
    contact(&frame, &indenter, down, &sites, job.spec.settings.contact_angstrom)
}

/// Relative tolerance of loads. Both runs stop at a largest force of 2e-3 eV/Å, which leaves the load of this small
/// cell uncertain by 2e-2 eV/Å, half a per cent of the lower load.
const SAME_LOAD: f64 = 0.01;
/// Atoms at the edge of contact that may differ.
const AT_THE_EDGE: usize = 1;
/// Force evaluations over those of the ramp. Measured: 122 of 188 and 219 of 348 here; 252 of 1397 on the 25 nm block.
const SAVED: f64 = 0.7;

#[test]
fn prescribed_loads_reach_the_states_of_a_ramp_at_lower_cost() {
    let Some(engine) = lammps(1) else { return };
    let (warm, cold) = (tempfile::tempdir().expect("scratch"), tempfile::tempdir().expect("scratch"));
    let from_continuum = smooth_case("");
    let job = built(&from_continuum, warm.path());
    let found = engine.run(&job, &mut on).expect("a clean run");
    assert!(found.unconverged.is_empty());
    assert_eq!(found.history.steps.len(), 1 + LOADS.len());
    let unit = job.spec.settings.load_unit;
    for (record, p_star) in found.history.steps[1..].iter().zip(LOADS) {
        assert!((record.load / (p_star * unit) - 1.0).abs() < 1e-3, "{} of {}", record.load / unit, p_star);
        // Evaluated at its own step, without interpolation between steps.
        let at = job.at_load(&found.history, p_star * unit).expect("reached");
        assert_eq!((at.bracket.lower, at.bracket.weight), (record.step, 0.0));
    }
    for (k, record) in found.history.steps.iter().enumerate().skip(1) {
        // A displacement ramp to the same height, in equal steps of at most the usual length.
        let steps = (record.displacement_angstrom / 0.3).ceil();
        let step = record.displacement_angstrom / steps;
        let touch = smooth_case(&format!("step = \"{step} Å\""));
        let mut history = built(&touch, &cold.path().join(k.to_string()));
        let settings = ramp(&mut history);
        (settings.max_steps, settings.max_load) = (steps as usize, f64::MAX);
        let outcome = engine.run(&history, &mut on).expect("a clean run");
        let last = outcome.history.last().expect("steps");
        assert!((last.load / record.load - 1.0).abs() < SAME_LOAD, "{} and {}", last.load, record.load);
        let (a, b) = (touching(&from_continuum, &job, &found, k), touching(&touch, &history, &outcome, steps as usize));
        let differ = a.sites.iter().zip(&b.sites).filter(|(a, b)| a != b).count();
        assert!(
            a.ids.len() > 10 && differ <= AT_THE_EDGE,
            "{} and {} touch, {differ} not in both",
            a.ids.len(),
            b.ids.len()
        );
        let sum = |f: &Finished, upto: usize| f.steps[..=upto].iter().map(|s| s.force_evaluations).sum::<usize>();
        let (less, more) = (sum(&found, k), sum(&outcome, steps as usize));
        assert!(less as f64 <= SAVED * more as f64, "load {k}: {less} and {more} force evaluations");
        eprintln!(
            "p* = {}: {less} force evaluations from the continuum, {more} from first contact",
            record.load / unit
        );
    }
}

/// Remaining displacement of the indenter after load and base agree with the prescribed load to 1e-3 but before the
/// forces reach the default tolerance, Å. Measured at 25 nm: 0.0002 Å.
const LEFT_TO_GO: f64 = 2e-3;

#[test]
fn a_loose_tolerance_suffices_where_load_and_base_agree() {
    let Some(engine) = lammps(1) else { return };
    let ran = |atoms: &str| {
        let folder = tempfile::tempdir().expect("scratch");
        let case = smooth_case(atoms);
        let job = built(&case, folder.path());
        let finished = engine.run(&job, &mut on).expect("a clean run");
        let sites: Vec<_> = (1..=LOADS.len()).map(|k| touching(&case, &job, &finished, k).sites).collect();
        (finished, sites, job.spec.settings.load_unit)
    };
    let ((tight, sites, unit), (loose, loose_sites, _)) = (ran(""), ran("force_tolerance = \"0.4 eV/Å\""));
    assert!(loose.unconverged.is_empty());
    for (k, p_star) in (1..).zip(LOADS) {
        let (a, b) = (&tight.history.steps[k], &loose.history.steps[k]);
        assert!((b.load / (p_star * unit) - 1.0).abs() < 1e-3, "{} of {p_star}", b.load / unit);
        assert!(b.max_force <= 0.1 && b.load_converged, "{b:?}");
        assert!((a.displacement_angstrom - b.displacement_angstrom).abs() < LEFT_TO_GO, "{a:?} {b:?}");
        let differ = sites[k - 1].iter().zip(&loose_sites[k - 1]).filter(|(a, b)| a != b).count();
        assert!(differ <= AT_THE_EDGE, "load {k}: {differ}");
    }
    let all = |f: &Finished| f.history.steps[1..].iter().map(|r| r.iterations).sum::<usize>();
    assert!(all(&loose) < all(&tight), "{} and {}", all(&loose), all(&tight));
}

#[test]
fn a_run_killed_between_loads_continues_bit_identically() {
    let Some(engine) = lammps(1) else { return };
    let (whole, killed) = (tempfile::tempdir().expect("scratch"), tempfile::tempdir().expect("scratch"));
    let case = smooth_case("");
    let expected = engine.run(&built(&case, whole.path()), &mut on).expect("a clean run");
    let job = built(&case, killed.path());
    for stop in [0, 1] {
        let error = engine.run(&job, &mut |p| {
            let after = p.record.is_some_and(|r| r.step >= stop);
            if after { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        assert!(matches!(error, Err(asperity::Error::Interrupted)));
    }
    // The job is written again, as the same command does.
    let finished = engine.run(&built(&case, killed.path()), &mut on).expect("the rest");
    assert!(finished.resumed_from.is_some_and(|k| k >= 1));
    assert_eq!(finished.history, expected.history);
    for record in &expected.history.steps {
        let read = |folder: &Path| std::fs::read(frame_file(folder, record.step).expect("a frame")).expect("read");
        assert!(read(whole.path()) == read(killed.path()), "step {}", record.step);
    }
}

/// Iteration of the second load at which the run is stopped; the forces first converge after some forty.
const STOPPED: usize = 20;

#[test]
fn a_run_stopped_within_a_load_continues_from_its_checkpoint() {
    let Some(lammps) = lammps(1) else { return };
    let engine = lammps.clone().with_checkpoint_interval(Duration::ZERO);
    let (whole, stopped) = (tempfile::tempdir().expect("scratch"), tempfile::tempdir().expect("scratch"));
    let case = smooth_case("minimizer = \"fire\"");
    let expected = engine.run(&built(&case, whole.path()), &mut on).expect("a clean run");
    let left = |folder: &Path| -> Vec<String> {
        let names = std::fs::read_dir(folder).expect("listed").map(|e| e.expect("an entry").file_name());
        names.filter_map(|n| n.into_string().ok()).filter(|n| n.starts_with("checkpoint.")).collect()
    };
    assert_eq!(left(whole.path()), Vec::<String>::new());

    let job = built(&case, stopped.path());
    let relax = "minimize      0.0 ${load_ftol} ${max_iterations} 100000\n";
    let cut = format!("if \"$k == 2\" then \"minimize 0.0 ${{load_ftol}} {STOPPED} 100000\" \"quit 9\"\n{relax}");
    assert!(PRESCRIBED_LOAD_RELAX.text.contains(relax));
    std::fs::write(job.folder.join(PRESCRIBED_LOAD_RELAX.file), PRESCRIBED_LOAD_RELAX.text.replace(relax, &cut))
        .expect("written");
    engine.run(&job, &mut on).expect_err("stopped");
    assert_eq!(left(stopped.path()).len(), 2);
    let state = minimizer_checkpoint::newest(stopped.path(), 2, 0).expect("a state");

    // The job is written again, as the same command does.
    let finished = engine.run(&built(&case, stopped.path()), &mut on).expect("the rest");
    let log = std::fs::read_to_string(stopped.path().join("log.2")).expect("a log");
    let name = state.file_name().and_then(|n| n.to_str()).expect("a name");
    assert!(log.contains(&format!("read_restart {name}")));
    assert_eq!(left(stopped.path()), Vec::<String>::new());
    assert_eq!((finished.resumed_from, finished.history.steps.len()), (Some(1), 3));
    assert_eq!(finished.history.steps[..2], expected.history.steps[..2]);
    let (a, b) = (&finished.history.steps[2], &expected.history.steps[2]);
    // Iterations before and after the interruption; the same state within the tolerance.
    assert!(a.iterations > STOPPED && finished.steps[2].force_evaluations >= a.iterations, "{a:?}");
    assert!((a.load / b.load - 1.0).abs() < 2e-3 && a.contacts.abs_diff(b.contacts) <= AT_THE_EDGE, "{a:?} {b:?}");
    assert!((a.displacement_angstrom - b.displacement_angstrom).abs() < 0.01, "{a:?} {b:?}");
}

/// LAMMPS also writes a checkpoint where a minimisation ends; a small block that is killed before its frame is written does not continue
/// from it.
#[test]
fn a_load_stopped_after_its_relaxation_repeats_it_with_the_same_results() {
    let Some(engine) = lammps(1) else { return };
    let (whole, stopped) = (tempfile::tempdir().expect("scratch"), tempfile::tempdir().expect("scratch"));
    let case = smooth_case("minimizer = \"fire\"");
    let expected = engine.run(&built(&case, whole.path()), &mut on).expect("a clean run");
    let job = built(&case, stopped.path());
    let relax = "minimize      0.0 ${load_ftol} ${max_iterations} 100000\n";
    let cut = format!("{relax}if \"$k == 1\" then \"quit 9\"\n");
    let script = PRESCRIBED_LOAD_RELAX.text.replace(relax, &cut);
    std::fs::write(job.folder.join(PRESCRIBED_LOAD_RELAX.file), script).expect("written");
    engine.run(&job, &mut on).expect_err("stopped");
    let written = |file: std::fs::DirEntry| file.file_name().to_string_lossy().starts_with("checkpoint.1.");
    assert!(std::fs::read_dir(stopped.path()).expect("listed").flatten().any(written));
    let finished = engine.run(&built(&case, stopped.path()), &mut on).expect("the rest");
    assert_eq!(finished.history.steps, expected.history.steps);
}
