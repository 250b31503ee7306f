//! NVT runs from relaxed states.

use crate::jobs::{built, case, command, on};
use crate::lammps::lammps;
use asperity::atoms::engine::LammpsEngine;
use asperity::atoms::job::Job;
use asperity::atoms::nvt::{BLOCKS, NvtSamples, NvtSettings};
use asperity::atoms::potential::calcium_lattice_constant;
use asperity::atoms::run_script::RunScript;
use asperity::pipeline::{Silent, run};
use asperity::scene::Case;
use asperity::surface::files::npy;
use std::ops::ControlFlow;
use std::path::Path;

fn nvt_case(loads: &[f64], nvt: &str) -> Case {
    case(&format!("p_star = {loads:?}"), "", &format!("[atoms.nvt]\n{nvt}"))
}

/// Largest deviation of a mean in standard errors.
const MISSES: f64 = 4.0;
/// Relative error of the kinetic temperature due to a time step of 8 fs: (ωΔt)²/8 is 0.8 % for the highest ω of a
/// nearest-neighbour crystal with this C11, about 32/ps.
const STEP_ERROR: f64 = 0.008;

#[test]
fn contact_at_constant_temperature_is_a_probability_with_an_error() {
    let Some(_lammps) = lammps(1) else { return };
    let folder = tempfile::tempdir().expect("scratch");
    let (results, page) = run(&nvt_case(&[0.06], "temperature = \"100 K\"\ntime = \"20 ps\""), folder.path(), &Silent)
        .expect("a clean run");
    let atoms = results.atoms.expect("atoms");
    let (hold, still) = (atoms.nvt.expect("a hold"), &atoms.states[0]);
    assert!((hold.averaging_ps + hold.equilibration_ps - 20.0).abs() < 1.0);
    let state = &hold.states[0];
    assert!((state.p_star / 0.06 - 1.0).abs() < 1e-9);
    let t = state.temperature_k;
    assert!((t.value - 100.0).abs() < MISSES * t.error + STEP_ERROR * 100.0 && t.error < 5.0, "{t:?}");
    assert!((state.load.value - 1.0).abs() < MISSES * state.load.error + 1e-3, "{:?}", state.load);
    // The mean of the contact probabilities of the sites is the contact fraction.
    let site = |name: &str| npy::read(&folder.path().join(name)).expect("a map").values;
    let (probability, error) = (site(&state.site_probability), site(&state.site_error));
    assert_eq!((probability.len(), error.len()), (200, 200));
    assert!(probability.iter().all(|p| (0.0..=1.0).contains(p)) && error.iter().all(|e| (0.0..0.3).contains(e)));
    let mean = probability.iter().sum::<f64>() / 200.0;
    assert!((mean - state.contact_area.value).abs() < 1e-6);
    // Atoms in contact at 0 K are often in contact; atoms 1 Å away never are.
    let touching: Vec<bool> =
        npy::read_flags(&folder.path().join(still.contact_map.replace("contact.npy", "site-contact.npy")))
            .expect("flags")
            .values
            .iter()
            .map(|v| *v != 0)
            .collect();
    let gap = site(&still.gap_map.replace("gap.npy", "site-gap.npy"));
    let of = |contact_by: &dyn Fn(usize) -> bool| -> (f64, usize) {
        let list: Vec<f64> = (0..200).filter(|&i| contact_by(i)).map(|i| probability[i]).collect();
        (list.iter().sum::<f64>() / list.len() as f64, list.len())
    };
    let (near, many) = of(&|i| touching[i]);
    let (far, others) = of(&|i| gap[i] > 1.0);
    assert!(many > 20 && others > 20 && near > 0.75 && far < 0.01, "{near} of {many}, {far} of {others}");
    assert!(state.contact_area.error > 0.0 && state.contact_area.error < 0.05, "{:?}", state.contact_area);
    // Vibrations increase the separation slightly.
    let further = state.mean_gap_angstrom.value - still.mean_gap_angstrom;
    assert!(further.abs() < 0.3 && state.mean_gap_angstrom.error < 0.05, "{further} {:?}", state.mean_gap_angstrom);
    let page = std::fs::read_to_string(page).expect("a report");
    assert!(page.contains("At 100 K") && folder.path().join("figures/probability-1.svg").is_file());
}

/// The relaxed states from which NVT runs start.
fn relaxed(case: &Case, folder: &Path, engine: &LammpsEngine) -> Job {
    let job = built(case, folder);
    engine.run(&job, &mut on).expect("a clean run");
    job
}

#[test]
fn a_killed_nvt_run_continues_and_its_errors_decrease_with_time() {
    let Some(engine) = lammps(1) else { return };
    let folder = tempfile::tempdir().expect("scratch");
    let case = nvt_case(&[0.02, 0.06], "temperature = \"300 K\"\ntime = \"10 ps\"");
    let relaxed = relaxed(&case, &folder.path().join("relaxed"), &engine);
    let atoms = case.atoms.as_ref().expect("atoms");
    let settings: NvtSettings = atoms.nvt.expect("a hold");
    let written = |name: &str, settings: &NvtSettings| {
        Job::write_nvt(&folder.path().join(name), &relaxed, &atoms.block, settings).expect("written")
    };
    let whole = written("whole", &settings);
    engine.run(&whole, &mut on).expect("a clean run");
    let killed = written("killed", &settings);
    let error = engine.run(&killed, &mut |p| {
        if p.record.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert!(matches!(error, Err(asperity::Error::Interrupted)));
    let finished = engine.run(&written("killed", &settings), &mut on).expect("the rest");
    assert_eq!(finished.resumed_from, Some(0));
    for name in ["load_steps.csv", "block_averages.0.txt", "block_averages.1.txt", "sites.0.dump", "sites.1.dump"] {
        let read = |job: &Job| std::fs::read(job.folder.join(name)).expect("read");
        assert!(read(&whole) == read(&killed), "{name}");
    }
    // Four times the time halves the error per site, averaged over sites, because a single error is uncertain by a
    // quarter.
    let long = written("long", &NvtSettings { time_ps: 40.0, ..settings });
    engine.run(&long, &mut on).expect("a clean run");
    let site_error = |job: &Job| {
        let state = NvtSamples::read(&job.folder, job.spec.protocol.nvt().expect("an NVT run"), 1).expect("read");
        assert_eq!(state.blocks.len(), BLOCKS);
        let sites = state.probabilities();
        sites.iter().map(|s| s.error).sum::<f64>() / sites.len() as f64
    };
    let (short, long) = (site_error(&whole), site_error(&long));
    assert!(short > 1.5 * long && short < 2.8 * long, "{short} and {long}");
}

/// Tolerance of the mean over the short run, Å: three standard errors.
const LATTICE_ERROR: f64 = 3e-3;

#[test]
fn thermal_expansion_agrees_with_the_nvt_cell() {
    let Some(engine) = lammps(1) else { return };
    let folder = tempfile::tempdir().expect("scratch");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let vars = [
        ("potential", root.join("potentials/Ca.eam.alloy").display().to_string()),
        ("temperature", "300".to_string()),
        ("time", "20".to_string()),
        ("warm", "5".to_string()),
    ];
    let printed = command(&engine).run(folder.path(), &root.join("lammps-inputs/expansion.in"), &vars);
    let printed = printed.expect("a clean run");
    let value_of = |name: &str| -> f64 {
        let line = printed.lines().find_map(|l| l.strip_prefix(&format!("RES {name} "))).expect("a result");
        line.parse().expect("a number")
    };
    let (lattice, temperature) = (value_of("lattice_constant"), value_of("temperature"));
    assert!((lattice - calcium_lattice_constant(temperature)).abs() < LATTICE_ERROR, "{lattice} at {temperature}");
    // The thermal expansion is three quarters of a per cent.
    assert!((calcium_lattice_constant(300.0) / calcium_lattice_constant(0.0) - 1.00778).abs() < 1e-4);
}
