//! The harmonic relaxation: the states of LAMMPS's own minimisers in far fewer force evaluations.

use crate::jobs::{built, case, on, on_two_ranks};
use crate::lammps::lammps;
use asperity::atoms::engine::{Finished, LammpsEngine};
use asperity::atoms::job::Job;
use asperity::atoms::lammps_command::LammpsCommand;
use asperity::atoms::load_history::frame_file;
use asperity::atoms::minimizer_checkpoint;
use asperity::atoms::results::StepMinimizer;
use asperity::atoms::scripts::PRESCRIBED_LOAD_RELAX;
use asperity::scene::{Case, Scene};
use std::path::Path;
use std::time::Duration;

const LOADS: [f64; 3] = [0.01, 0.03, 0.06];
/// Of the force on the indenter: twice the tolerance to which the model is solved.
const MODEL_LOAD: f64 = 4e-5;
/// Force evaluations of a load in an elastic block.
const FEW: usize = 8;
/// Of the indenter's height, Å, and of the energy with the work of the load, eV: both minimisers stop at a residual force.
const HEIGHT: f64 = 2e-3;
const ENERGY: f64 = 1e-3;
/// Atoms at the edge of contact that may differ.
const AT_THE_EDGE: usize = 1;

/// A job of the smooth block with a minimiser, run.
fn ran(load: &str, tables: &str, atoms: &str, minimizer: &str, folder: &Path) -> Option<(Job, Finished)> {
    let engine = lammps(1)?;
    let case = case(load, tables, &format!("minimizer = \"{minimizer}\"\n{atoms}"));
    let job = built(&case, folder);
    let finished = engine.run(&job, &mut on).expect("a clean run");
    Some((job, finished))
}

#[test]
fn loads_have_the_states_of_fire() {
    for base in ["", "base = \"elastic\"\nfoundation_cells = 4\n", "foundation_cells = 4\n"] {
        let (a, b) = (tempfile::tempdir().expect("scratch"), tempfile::tempdir().expect("scratch"));
        let load = &format!("p_star = {LOADS:?}");
        let Some((_, fire)) = ran(load, "", base, "fire", a.path()) else { return };
        let Some((job, harmonic)) = ran(load, "", base, "harmonic", b.path()) else { return };
        assert!(harmonic.unconverged.is_empty() && harmonic.not_harmonic.is_none());
        let steps = fire.history.steps.iter().zip(&harmonic.history.steps).zip(&harmonic.steps);
        for ((f, h), results) in steps.skip(1) {
            let what = format!("{base}step {}: {h:?} {f:?}", h.step);
            assert_eq!((h.minimizer, f.minimizer), (StepMinimizer::Harmonic, StepMinimizer::Fire), "{what}");
            assert!(results.force_evaluations <= FEW, "{} evaluations: {what}", results.force_evaluations);
            // The wall of the model is that of LAMMPS, whose force on the indenter this is.
            let error = h.load / (LOADS[h.step - 1] * job.spec.settings.load_unit) - 1.0;
            assert!(error.abs() < MODEL_LOAD, "{error}: {what}");
            assert!((h.load / f.load - 1.0).abs() < 2e-3 && h.contacts.abs_diff(f.contacts) <= AT_THE_EDGE, "{what}");
            let lift = h.indenter_mean_angstrom - f.indenter_mean_angstrom;
            assert!(lift.abs() < HEIGHT, "{lift} Å: {what}");
            let energy = h.energy_ev - f.energy_ev + h.load * lift;
            assert!(energy < ENERGY, "{energy} eV: {what}");
            assert!(h.predicted_decrease_ev.is_some_and(|bound| bound < ENERGY), "{what}");
        }
    }
}

/// Of the loads of a ramp, relative to its highest: at 2e-3 eV/Å both minimisers leave some residual force.
const LOAD: f64 = 5e-3;

#[test]
fn a_ramp_with_adhesion_and_unloading_has_the_loads_of_conjugate_gradients() {
    let (a, b) = (tempfile::tempdir().expect("scratch"), tempfile::tempdir().expect("scratch"));
    let load = "p_star = [0.02]\nunload = true";
    let tables = "[adhesion]\nwork_of_adhesion = \"0.2 J/m2\"\nrange = \"0.05 nm\"";
    let Some((_, cg)) = ran(load, tables, "", "fire", a.path()) else { return };
    let Some((_, harmonic)) = ran(load, tables, "", "harmonic", b.path()) else { return };
    assert_eq!(cg.history.steps.len(), harmonic.history.steps.len());
    let highest = cg.history.steps.iter().map(|s| s.load).fold(0.0, f64::max);
    for (c, h) in cg.history.steps.iter().zip(&harmonic.history.steps) {
        assert_eq!((c.minimizer, h.minimizer), (StepMinimizer::Cg, StepMinimizer::Harmonic), "{h:?}");
        assert!((h.load - c.load).abs() < LOAD * highest, "{h:?} {c:?}");
    }
    let all = |f: &Finished| f.steps.iter().map(|s| s.force_evaluations).sum::<usize>();
    assert!(2 * all(&harmonic) < all(&cg), "{} and {}", all(&harmonic), all(&cg));
}

#[test]
fn without_a_host_auto_uses_fire_and_says_why_and_harmonic_is_refused() {
    let Some(lammps) = lammps(1) else { return };
    // Accelerated styles may keep positions on a device.
    let args = vec!["-sf".to_string(), "opt".to_string()];
    let command = LammpsCommand { args, ..LammpsCommand::default() };
    let engine = lammps.clone().with_command(command).expect("accepted");
    let run = |minimizer: &str| {
        let folder = tempfile::tempdir().expect("scratch");
        let case = case("p_star = [0.02]", "", &format!("minimizer = \"{minimizer}\""));
        engine.run(&built(&case, folder.path()), &mut on)
    };
    let auto = run("auto").expect("runs");
    assert!(auto.not_harmonic.is_some_and(|reason| reason.contains("accelerated styles")));
    assert!(auto.steps.iter().all(|s| s.minimizer == StepMinimizer::Fire));
    assert_eq!(run("harmonic").expect_err("refused").exit_code(), 5);
    assert_eq!(run("fire").expect("runs").not_harmonic, None);
}

/// A profile under which the crystal slips at the first load.
fn steep(p_star: f64, minimizer: &str) -> Case {
    let text = format!(
        "name = \"steep\"\n[surface]\ngrid = 32\nroll_off_mode = 2\ncut_off_mode = 8\nrms_gradient = 1.0\n\
         [load]\np_star = [{p_star}]\n[atoms]\ncells = 10\ndepth_cells = 6\nminimizer = \"{minimizer}\""
    );
    let file = Path::new("steep.toml");
    Case::resolve(Scene::parse(&text, file).expect("a scene"), file).expect("a case")
}

/// Decrease of energy that is left where FIRE ended, eV.
const AFTER_FIRE: f64 = 0.1;

/// At the lower load the state is handed over, at the higher one, of which the relaxation reaches a tenth, the load starts again.
#[test]
fn a_load_at_which_the_crystal_slips_is_handed_over_to_fire() {
    let Some(engine) = lammps(1) else { return };
    let folder = tempfile::tempdir().expect("scratch");
    for (p_star, restarts) in [(0.05, false), (0.1, true)] {
        let job = built(&steep(p_star, "auto"), &folder.path().join(p_star.to_string()));
        let finished = engine.run(&job, &mut on).expect("a clean run");
        assert!(finished.unconverged.is_empty(), "{finished:?}");
        let (free, load) = (&finished.history.steps[0], &finished.history.steps[1]);
        assert_eq!(free.minimizer, StepMinimizer::Harmonic);
        assert_eq!(load.minimizer, StepMinimizer::HarmonicFire, "{load:?}");
        // FIRE ends by the forces.
        assert!(load.predicted_decrease_ev.is_some_and(|e| e > 0.0 && e < AFTER_FIRE), "{load:?}");
        assert!((load.load / (p_star * job.spec.settings.load_unit) - 1.0).abs() < 1e-3, "{load:?}");
        let log = std::fs::read_to_string(job.folder.join("log.0")).expect("a log");
        assert_eq!(log.matches("print \"load step $k\"").count(), if restarts { 3 } else { 2 }, "p* = {p_star}");
    }
    let strict = built(&steep(0.05, "harmonic"), &folder.path().join("strict"));
    let error = engine.run(&strict, &mut on).expect_err("refused");
    assert_eq!(error.exit_code(), 4, "{error}");
    assert!(error.to_string().contains("the harmonic relaxation of step 1 ended at"), "{error}");
}

/// The other minimiser, to which the load was handed over, is stopped: it goes on from its own checkpoint.
#[test]
fn a_load_stopped_after_it_was_handed_over_continues_with_fire() {
    let Some(lammps) = lammps(1) else { return };
    let engine = lammps.clone().with_checkpoint_interval(Duration::ZERO);
    let folder = tempfile::tempdir().expect("scratch");
    let case = steep(0.05, "auto");
    let job = built(&case, folder.path());
    let relax = "minimize      0.0 ${load_ftol} ${max_iterations} 100000\n";
    let cut = format!("if \"$k == 1\" then \"minimize 0.0 ${{load_ftol}} 40 100000\" \"quit 9\"\n{relax}");
    assert!(PRESCRIBED_LOAD_RELAX.text.contains(relax));
    let script = job.folder.join(PRESCRIBED_LOAD_RELAX.file);
    std::fs::write(script, PRESCRIBED_LOAD_RELAX.text.replace(relax, &cut)).expect("written");
    engine.run(&job, &mut on).expect_err("stopped");
    assert!(minimizer_checkpoint::newest(folder.path(), 1, 0).is_some());
    // The job is written again, as the same command does.
    let finished = engine.run(&built(&case, folder.path()), &mut on).expect("the rest");
    let load = &finished.history.steps[1];
    assert_eq!((finished.resumed_from, load.minimizer), (Some(0), StepMinimizer::HarmonicFire), "{load:?}");
    assert!(load.load_converged && load.iterations > 40, "{load:?}");
    let log = std::fs::read_to_string(folder.path().join("log.1")).expect("a log");
    assert!(log.contains("read_restart checkpoint.1.") && !log.contains("\nharmonic relaxation:"), "{log}");
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let Some(engine) = lammps(2) else { return };
    let case = case("p_star = [0.01, 0.03]", "", "minimizer = \"harmonic\"");
    let run = |threads: usize| {
        let folder = tempfile::tempdir().expect("scratch");
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let finished = pool.install(|| engine.run(&built(&case, folder.path()), &mut on)).expect("a clean run");
        let frame = |k: usize| std::fs::read(frame_file(folder.path(), k).expect("a frame")).expect("read");
        (finished.history, [0, 1, 2].map(frame))
    };
    assert!(run(1) == run(3));
}

#[test]
fn two_ranks_reach_the_states_of_one() {
    let Some(one) = lammps(2) else { return };
    let Some(two) = on_two_ranks(&one) else { return };
    let case = case("p_star = [0.01, 0.03]", "", "minimizer = \"harmonic\"");
    let run = |engine: &LammpsEngine| {
        let folder = tempfile::tempdir().expect("scratch");
        engine.run(&built(&case, folder.path()), &mut on).expect("a clean run").history.steps
    };
    for (a, b) in run(&one).iter().zip(&run(&two)) {
        assert_eq!((a.contacts, a.minimizer), (b.contacts, StepMinimizer::Harmonic), "{a:?} {b:?}");
        assert!((a.indenter_mean_angstrom - b.indenter_mean_angstrom).abs() < HEIGHT, "{a:?} {b:?}");
    }
}
