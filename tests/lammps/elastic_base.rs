//! A shallow block on the forces of the crystal missing below it, compared with the deep block that it replaces.

use crate::jobs::{
    A0, CUTOFF, RAMP, RELAXATION, built, case, command, on, on_two_ranks, potential, ramp, surface, written,
};
use crate::lammps::lammps;
use asperity::atoms::block::{Block, FLOOR_GAP_ANGSTROM};
use asperity::atoms::dump::read_frame;
use asperity::atoms::engine::{Finished, LammpsEngine};
use asperity::atoms::force_constants::{ForceConstantInput, ForceConstants, reach};
use asperity::atoms::job_spec::{DisplacementRamp, RelaxationSettings};
use asperity::atoms::load_history::frame_file;
use asperity::atoms::potential::CALCIUM_C11_GPA;
use asperity::atoms::scripts::DISPLACEMENT_RAMP_RELAX;
use asperity::grid::units::GPA_PER_EV_A3;
use asperity::scene::Case;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::Command;

const LOADS: [f64; 3] = [0.01, 0.02, 0.06];
/// Depth of the deep block, and of the deformable part of the shallow one above its four elastic layers, lattice constants.
const DEEP: usize = 6;
const SHALLOW: usize = 2;
/// So that forces left in the blocks do not hide a difference: eV/Å.
const TIGHT: &str = "force_tolerance = \"1e-4 eV/Å\"\n";

/// Blocks of one depth, and one without the foundation.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Deep,
    Elastic,
    Shallow,
}

fn of(kind: Kind, load: &str, tables: &str, atoms: &str) -> Case {
    let mut text = atoms.to_string();
    if kind == Kind::Elastic {
        text += &format!("base = \"elastic\"\nfoundation_cells = {}\n", DEEP - SHALLOW);
    }
    let case = case(load, tables, &text);
    let mut scene = case.scene;
    scene.atoms.as_mut().expect("atoms").depth_cells = if kind == Kind::Deep { DEEP } else { SHALLOW };
    Case::resolve(scene, Path::new("smooth.toml")).expect("a case")
}

fn loads() -> String {
    format!("p_star = {LOADS:?}")
}

fn farthest(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let apart = |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt();
    a.iter().zip(b).map(apart).fold(0.0, f64::max)
}

/// Largest distance of a surface atom from its place on the deep block, Å: the boundary is linear about the mean strain. Measured: 0.0003,
/// 0.0010 and 0.0021 Å.
const APART: f64 = 3e-3;
/// At least, on a rigid base in place of the elastic one, Å.
const RIGID: f64 = 10.0 * APART;
/// Of the indenter's displacement, Å. Measured: at most 0.0016 Å.
const HEIGHT: f64 = 2e-3;

#[test]
fn an_elastic_base_equals_the_missing_depth() {
    let Some(engine) = lammps(1) else { return };
    let run = |kind: Kind| {
        let (case, folder) = (of(kind, &loads(), "", TIGHT), tempfile::tempdir().expect("scratch"));
        let found = engine.run(&built(&case, folder.path()), &mut on).expect("a clean run");
        assert!(found.unconverged.is_empty());
        (case, folder, found)
    };
    let (deep, elastic, rigid) = (run(Kind::Deep), run(Kind::Elastic), run(Kind::Shallow));
    for (k, p_star) in LOADS.iter().enumerate() {
        let step = k + 1;
        let [a, b] = [&deep.2, &elastic.2].map(|f| f.history.steps[step].clone());
        let [whole, with, without] =
            [&deep, &elastic, &rigid].map(|(case, folder, _)| surface(case, folder.path(), step));
        let (apart, of_rigid) = (farthest(&whole, &with), farthest(&whole, &without));
        let height = b.displacement_angstrom - a.displacement_angstrom;
        eprintln!(
            "p* = {p_star}: {} and {} touch; surface {apart:.5} Å ({of_rigid:.5} Å on a rigid base), indenter {height:.5} Å apart",
            a.contacts, b.contacts
        );
        assert_eq!(a.contacts, b.contacts, "p* = {p_star}");
        assert!(apart < APART && height.abs() < HEIGHT, "p* = {p_star}: {apart} and {height} Å");
        assert!(of_rigid > RIGID, "p* = {p_star}: the missing depth makes no difference, {of_rigid} Å");
    }
}

/// Lattice constants of the block and of the shallow one that replaces it: two deformable cells and four layers that move.
const COMPLIANT: (usize, usize) = (20, 2);
/// Amplitudes of forces on the surface atoms, eV/Å: displacements of some 0.01 Å. And the force tolerance, 1e-4 of them.
const WAVE: f64 = 5e-3;
const BALANCED: f64 = 5e-7;
/// Of the compliance of a wave, relative.
const COMPLIANCE: f64 = 5e-4;

/// Amplitudes of the surface, Å, under normal forces of the waves 1, 2 and 3 along x.
fn response(engine: &LammpsEngine, block: Block) -> [f64; 3] {
    let folder = tempfile::tempdir().expect("scratch");
    let settings = RelaxationSettings { force_tolerance: BALANCED, ..RELAXATION };
    let ramp = DisplacementRamp { max_steps: 1, max_load: 1.0, ..RAMP };
    let setting = written(folder.path(), block, |_, _, _| 0.0, None, ramp, settings);
    let script = setting.job.folder.join(DISPLACEMENT_RAMP_RELAX.file);
    let text = std::fs::read_to_string(&script).expect("read");
    let push = format!(
        "fix site block store/state 0 x z\n\
         variable w equal 2.0*PI/lx\n\
         variable waves atom {WAVE}*(cos(v_w*f_site[1])+cos(2.0*v_w*f_site[1])+cos(3.0*v_w*f_site[1]))\n\
         variable push atom v_waves*(f_site[2]>{:.3})\n\
         variable work atom -v_push*z\n\
         fix push block addforce 0.0 0.0 v_push energy v_work\n\
         fix_modify push energy yes\n\
         minimize      0.0",
        block.top_z() - 0.25 * A0
    );
    let changed = text.replacen("minimize      0.0", &push, 1);
    assert_ne!(changed, text);
    std::fs::write(&script, changed).expect("written");
    engine.run(&setting.job, &mut on).expect("a clean run");
    let frame = read_frame(frame_file(folder.path(), 0).expect("a frame")).expect("good");
    let sites = block.surface();
    std::array::from_fn(|k| {
        let wave = std::f64::consts::TAU * (k + 1) as f64 / block.length();
        let part = |i: usize| {
            let at = frame.position(sites.first_id() + i as u32).expect("in the frame");
            (at[2] - block.top_z()) * (wave * sites.xy(i)[0]).cos()
        };
        2.0 / sites.len() as f64 * (0..sites.len()).map(part).sum::<f64>()
    })
}

#[test]
fn the_surface_is_as_compliant_as_that_of_the_deep_block() {
    let Some(engine) = lammps(1) else { return };
    let (deep, shallow) = COMPLIANT;
    let of = |depth: usize| Block::new(10, depth, A0, CUTOFF).expect("valid");
    let whole = response(&engine, of(deep));
    let elastic = response(&engine, of(shallow).on_elastic_base(deep - shallow, CUTOFF).expect("valid"));
    let rigid = response(&engine, of(shallow + 2));
    for k in 0..3 {
        let [error, without] = [elastic[k], rigid[k]].map(|u| u / whole[k] - 1.0);
        eprintln!(
            "wave {}: {:.5} Å, {error:.1e} of it more on the elastic base, {without:.3} on a rigid one",
            k + 1,
            whole[k]
        );
        assert!(error.abs() < COMPLIANCE, "wave {}: {error}", k + 1);
        assert!(k > 0 || without < -0.05, "the missing depth makes no difference: {without}");
    }
}

/// Of the largest tension, relative. Measured: 2e-4.
const PULL_OFF: f64 = 2e-3;

/// A history with adhesion: descent, return and pull-off.
#[test]
fn a_descent_and_pull_off_on_an_elastic_base_equal_those_of_the_deep_block() {
    let Some(engine) = lammps(1) else { return };
    let adhesive = "[adhesion]\nwork_of_adhesion = \"500 mJ/m2\"\nrange = \"2 nm\"\n";
    let run = |kind: Kind, stop: Option<usize>| {
        let case = of(kind, "p_star = [0.02]\npull_off = true", adhesive, TIGHT);
        let folder = tempfile::tempdir().expect("scratch");
        let mut job = built(&case, folder.path());
        ramp(&mut job).step_angstrom = 0.3;
        if let Some(last) = stop {
            let interrupted = engine.run(&job, &mut |p| match p.record {
                Some(r) if r.step >= last => ControlFlow::Break(()),
                _ => ControlFlow::Continue(()),
            });
            assert!(matches!(interrupted, Err(asperity::Error::Interrupted)));
        }
        engine.run(&job, &mut on).expect("a clean run")
    };
    let (deep, shallow, resumed) = (run(Kind::Deep, None), run(Kind::Elastic, None), run(Kind::Elastic, Some(4)));
    assert_eq!(shallow.history, resumed.history);
    let lowest = |f: &Finished| f.history.steps.iter().map(|r| r.load).fold(0.0, f64::min);
    let highest = |f: &Finished| f.history.steps.iter().map(|r| r.load).fold(0.0, f64::max);
    eprintln!("pull-off {} and {}, peak {} and {}", lowest(&deep), lowest(&shallow), highest(&deep), highest(&shallow));
    assert!(lowest(&deep) < 0.0, "no pull-off");
    assert!((lowest(&shallow) / lowest(&deep) - 1.0).abs() < PULL_OFF);
    assert_eq!(deep.history.steps.len(), shallow.history.steps.len());
    let same = deep.history.steps.iter().zip(&shallow.history.steps).filter(|(a, b)| a.contacts == b.contacts).count();
    assert!(same + 1 >= deep.history.steps.len(), "{same} of {} steps with equal contacts", deep.history.steps.len());
}

#[test]
fn a_run_on_an_elastic_base_that_was_stopped_continues_bit_identically() {
    let Some(engine) = lammps(1) else { return };
    let (whole, stopped) = (tempfile::tempdir().expect("scratch"), tempfile::tempdir().expect("scratch"));
    let case = of(Kind::Elastic, &loads(), "", "");
    let expected = engine.run(&built(&case, whole.path()), &mut on).expect("a clean run");
    let job = built(&case, stopped.path());
    let interrupted = engine.run(&job, &mut |p| match p.record {
        Some(r) if r.step >= 1 => ControlFlow::Break(()),
        _ => ControlFlow::Continue(()),
    });
    assert!(matches!(interrupted, Err(asperity::Error::Interrupted)));
    let finished = engine.run(&built(&case, stopped.path()), &mut on).expect("the rest");
    assert_eq!((finished.resumed_from.is_some(), &finished.history), (true, &expected.history));
    for record in &expected.history.steps {
        let read = |folder: &Path| std::fs::read(frame_file(folder, record.step).expect("a frame")).expect("read");
        assert!(read(whole.path()) == read(stopped.path()), "step {}", record.step);
    }
}

/// Two relaxations to the force tolerance, Å.
const RANKS: f64 = HEIGHT;

#[test]
fn two_ranks_reach_the_states_of_one() {
    let Some(one) = lammps(2) else { return };
    let Some(two) = on_two_ranks(&one) else { return };
    let case = of(Kind::Elastic, "p_star = [0.02]", "", TIGHT);
    let run = |engine: &LammpsEngine| {
        let folder = tempfile::tempdir().expect("scratch");
        engine.run(&built(&case, folder.path()), &mut on).expect("a clean run").history.steps[1].clone()
    };
    let (a, b) = (run(&one), run(&two));
    assert_eq!(a.contacts, b.contacts);
    assert!((a.displacement_angstrom - b.displacement_angstrom).abs() < RANKS, "{a:?} {b:?}");
}

/// C11 of the secant from zero strain, which the crystal's stiffening raises: 1 % at a strain of 0.002.
const SECANT: f64 = 0.02;

/// A tension over C11, within the measured strains.
const TENSION: f64 = 0.01;

#[test]
fn force_constants_are_those_of_the_crystal() {
    let Some(engine) = lammps(1) else { return };
    let folder = tempfile::tempdir().expect("scratch");
    std::fs::copy(potential(), folder.path().join("table")).expect("copied");
    let highest_pressure = 0.002 * CALCIUM_C11_GPA / GPA_PER_EV_A3;
    let crystal = ForceConstantInput {
        table: "table",
        element: "Ca",
        a0_angstrom: A0,
        cutoff_angstrom: CUTOFF,
        highest_pressure,
    };
    let found = ForceConstants::measure(&command(&engine), folder.path(), crystal, engine.describe(), &mut || Ok(()))
        .expect("measured");
    assert_eq!(reach(CUTOFF, A0), 4);
    for share in [0.3, 1.0] {
        let (pressure, strain) =
            (share * highest_pressure, found.strain_at(share * highest_pressure).expect("measured"));
        let c11 = pressure / strain * GPA_PER_EV_A3;
        assert!((c11 / CALCIUM_C11_GPA - 1.0).abs() < SECANT, "{c11} GPA at {strain}");
        // The forces of the cut carry the pressure: that on a site of area a0²/2.
        let carried: f64 = -found.at(strain).cut_force.iter().sum::<f64>() / (0.5 * A0 * A0);
        assert!((carried / pressure - 1.0).abs() < 1e-4, "{carried} instead of {pressure}");
    }
    // Softer under tension, which the cut carries as well.
    let tension = -TENSION * CALCIUM_C11_GPA / GPA_PER_EV_A3;
    let strain = found.strain_at(tension).expect("measured");
    assert!(strain < -TENSION && strain > -2.0 * TENSION, "{strain}");
    let carried: f64 = -found.at(strain).cut_force.iter().sum::<f64>() / (0.5 * A0 * A0);
    assert!((carried / tension - 1.0).abs() < 1e-3, "{carried} instead of {tension}");
    assert!(found.strain_at(3.0 * tension).is_err());
    let crushed = ForceConstantInput { highest_pressure: 100.0 * highest_pressure, ..crystal };
    let refused = ForceConstants::measure(&command(&engine), folder.path(), crushed, engine.describe(), &mut || Ok(()))
        .expect_err("refused");
    let message = refused.to_string();
    assert!(message.contains("mean pressure = ") && message.contains("GPa"), "{message}");
}

/// Lattice constants of a foundation whose compression exceeds the free space below the atoms, in a descent.
const DEEP_FOUNDATION: usize = 100;

#[test]
fn a_descent_on_a_deep_foundation_keeps_its_atoms() {
    let Some(engine) = lammps(1) else { return };
    let text = format!("base = \"elastic\"\nfoundation_cells = {DEEP_FOUNDATION}\nstep = \"0.4 Å\"\n");
    let case = case("p_star = [0.06]", "", &text);
    let folder = tempfile::tempdir().expect("scratch");
    let job = built(&case, folder.path());
    let found = engine.run(&job, &mut on).expect("a clean run");
    let last = found.history.last().expect("steps");
    let block = case.atoms.as_ref().expect("atoms").block;
    // The compression of the foundation alone is more than the box is free below the atoms.
    let strain = last.load / block.length().powi(2) * GPA_PER_EV_A3 / CALCIUM_C11_GPA;
    assert!(strain * block.height_of(0) > 2.0 * FLOOR_GAP_ANGSTROM, "{strain}");
    assert!(last.load >= 0.06 * job.spec.settings.load_unit && last.atoms == job.atoms(), "{last:?}");
}

#[test]
fn a_program_of_another_name_runs_a_block_on_an_elastic_base() {
    let Some(_lammps) = lammps(1) else { return };
    let folder = tempfile::tempdir().expect("scratch");
    let program = folder.path().join("asperity-0.1");
    std::fs::copy(env!("CARGO_BIN_EXE_asperity"), &program).expect("copied");
    let job = built(&of(Kind::Elastic, "p_star = [0.01]", "", ""), &folder.path().join("job"));
    let output = Command::new(&program).args(["atoms", "run"]).arg(&job.folder).output().expect("started");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Exit code of files that cannot be read.
const IO: i32 = 2;

#[test]
fn a_missing_library_and_another_version_are_named() {
    let Some(_lammps) = lammps(1) else { return };
    let folder = tempfile::tempdir().expect("scratch");
    let case = of(Kind::Elastic, "p_star = [0.02]", "", "");
    let job = built(&case, folder.path());
    let host = |library: &str, date: &str| {
        let output = Command::new(env!("CARGO_BIN_EXE_asperity"))
            .args([
                "lammps-host",
                "--library",
                library,
                "--version-date",
                date,
                "--",
                "-log",
                "none",
                "-screen",
                "none",
            ])
            .current_dir(&job.folder)
            .output()
            .expect("started");
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    // Without force constants there is nothing to run.
    let (code, text) = host("liblammps.so.0", "20210929");
    assert_eq!(code, Some(IO), "{text}");
    assert!(text.contains("force_constants.json"), "{text}");
    std::fs::copy(potential(), folder.path().join("table")).expect("copied");
    let engine = LammpsEngine::find(None).expect("LAMMPS");
    let crystal = ForceConstantInput {
        table: "table",
        element: "Ca",
        a0_angstrom: A0,
        cutoff_angstrom: CUTOFF,
        highest_pressure: 1e-3,
    };
    let found = ForceConstants::measure(&command(&engine), folder.path(), crystal, engine.describe(), &mut || Ok(()))
        .expect("measured");
    let file = job.folder.join("force_constants.json");
    std::fs::write(file, serde_json::to_string(&found).expect("text")).expect("written");
    let (code, text) = host("/no/such/liblammps.so", "20210929");
    assert!(code == Some(5) && text.starts_with("ERROR: ") && text.contains("apt install lammps"), "{code:?}: {text}");
    let (code, text) = host("libc.so.6", "20210929");
    assert!(code == Some(5) && text.contains("lacks the function lammps_open_no_mpi"), "{code:?}: {text}");
    let (code, text) = host("liblammps.so.0", "19990101");
    assert!(code == Some(4) && text.contains("two installations"), "{code:?}: {text}");
}
