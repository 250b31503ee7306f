//! Tests of job folders: files written, kept and removed, and the steps at which jobs reverse and end.

use super::*;
use crate::interaction::Yukawa;
use crate::job_spec::{FRAME_LAYERS, Minimizer};
use crate::load_history::HEADER;
use crate::results::StepMinimizer;
use crate::scripts::{DISPLACEMENT_RAMP, NVT, PRESCRIBED_LOAD};
use crate::unloading::pull_off;

fn written(folder: &Path, step: f64) -> Result<Job> {
    ramp_job(folder, step, None, false)
}

fn ramp_job(folder: &Path, step: f64, adhesion: Option<Yukawa>, unload: bool) -> Result<Job> {
    let block = Block::new(5, 1, 5.5884, 7.0)?;
    let indenter = Indenter::above(&block, 11, vec![0.5; 121], 4.0327)?;
    let table = folder.join("table");
    std::fs::write(&table, "a table").map_err(Error::io("write", &table))?;
    let interaction = Interaction { epsilon_ev: 0.2145, sigma_angstrom: 3.5927, adhesion };
    let settings = RelaxationSettings {
        force_tolerance: 2e-3,
        minimizer: Minimizer::Auto,
        load_unit: 100.0,
        contact_angstrom: 4.0354,
        frame_layers: FRAME_LAYERS,
        keep_restarts: false,
    };
    let ramp = DisplacementRamp { step_angstrom: step, max_load: 5.0, max_steps: 10, unload };
    let crystal = JobCrystal { potential: &table, element: "Ca", mass_u: 40.078 };
    Job::write(folder.join("job"), &block, &indenter, crystal, interaction, settings, Loading::Ramp(ramp))
}

fn prescribed(job: &Job) -> &PrescribedLoads {
    job.spec.protocol.prescribed().expect("prescribed loads")
}

#[test]
fn the_data_file_has_every_atom_once_and_is_reproducible() {
    let folder = tempfile::tempdir().expect("scratch");
    let job = written(folder.path(), 0.3).expect("written");
    let text = std::fs::read_to_string(job.folder.join(DATA_FILE)).expect("read");
    assert!(text.contains(&format!("\n{} atoms\n3 atom types\n", job.atoms())));
    let lines: Vec<&str> = text.lines().skip_while(|l| !l.starts_with("Atoms")).skip(2).collect();
    assert_eq!(lines.len() as u64, job.atoms());
    let value_of = |kind: &str| lines.iter().filter(|l| l.split(' ').nth(1) == Some(kind)).count() as u64;
    assert_eq!((value_of("1"), value_of("2"), value_of("3")), (job.spec.deformable, job.spec.indenter, job.spec.fixed));
    assert_eq!(lines[0], "1 3 1.3971000000 1.3971000000 2.0000000000");
    let hash = job.spec.data_hash.clone();
    assert_eq!(hash, blake3::hash(text.as_bytes()).to_hex().to_string());
    assert_eq!(written(folder.path(), 0.3).expect("again").spec.data_hash, hash);
    assert_eq!(Job::open(&job.folder).expect("opened"), job);
}

/// The element becomes an argument of LAMMPS, which would take further words as its own.
#[test]
fn a_job_whose_element_is_no_symbol_is_refused() {
    let folder = tempfile::tempdir().expect("scratch");
    let job = written(folder.path(), 0.3).expect("written");
    let file = job.folder.join(SPEC_FILE);
    let text = std::fs::read_to_string(&file).expect("read");
    assert!(text.contains("\"Ca\""));
    std::fs::write(&file, text.replace("\"Ca\"", "\"Ca -in evil.in\"")).expect("written");
    let refused = Job::open(&job.folder).expect_err("refused").to_string();
    assert!(refused.contains("job.json") && refused.contains("a chemical symbol"), "{refused}");
}

#[test]
fn steps_of_the_same_job_are_kept_and_those_of_another_job_removed() {
    let folder = tempfile::tempdir().expect("scratch");
    let job = written(folder.path(), 0.3).expect("written");
    let steps = job.folder.join(LOAD_STEPS_FILE);
    std::fs::write(&steps, "").expect("written");
    written(folder.path(), 0.3).expect("again");
    assert!(steps.exists());
    written(folder.path(), 0.4).expect("another");
    assert!(!steps.exists());
}

/// A list of loads that is shortened and then extended by other loads must not reuse the states of the first list.
#[test]
fn steps_of_common_prescribed_loads_are_kept_and_others_removed() {
    let folder = tempfile::tempdir().expect("scratch");
    let job = written(folder.path(), 0.3).expect("written");
    let path = |name: &str| job.folder.join(name);
    let at_load = |load: f64| PrescribedLoad { load, dz_angstrom: 1.0, move_hash: format!("{load}") };
    let place = |loads: &[f64]| {
        let loads = PrescribedLoads {
            indenter_zmin_angstrom: 40.0,
            indenter_mass_u: 0.4,
            compression_stiffness_ev_per_angstrom2: 10.0,
            base_share: 0.0,
            loads: loads.iter().map(|l| at_load(*l)).collect(),
            earlier: Vec::new(),
        };
        Job::place(&job.folder, JobSpec { protocol: LoadingProtocol::Prescribed(loads), ..job.spec.clone() })
            .expect("placed")
    };
    let run = |from: usize, to: usize| {
        for k in from..=to {
            let previous = std::fs::read_to_string(path(LOAD_STEPS_FILE)).unwrap_or_default();
            let previous = if previous.is_empty() { format!("{HEADER}\n") } else { previous };
            let line = format!("{k},0.3,1,-100.5,12,1.5e-03,{k},44.5,45.5,200,1,fire,0,\n");
            std::fs::write(path(LOAD_STEPS_FILE), previous + &line).expect("written");
            let frame = "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS pp pp ff\n0 10\n0 10\n0 50\n\
                         ITEM: ATOMS id type x y z\n1 1 5 5 20\n";
            std::fs::write(path(&format!("frame.{k}.dump")), frame).expect("written");
            std::fs::write(path(&format!("restart.{k}")), "a state").expect("written");
        }
    };
    let steps = || load_history::LoadHistory::read(&job.folder).expect("read").steps.len();
    place(&[1.0, 3.0]);
    run(0, 2);
    std::fs::write(path("checkpoint.3.a"), "a state").expect("written");
    // A shortened list keeps all states, in case the list is extended again by the same loads.
    let short = place(&[1.0]);
    assert_eq!((steps(), prescribed(&short).earlier.len()), (3, 1));
    assert_eq!((prescribed(&place(&[1.0, 3.0])).earlier.len(), steps()), (0, 3));
    place(&[1.0]);
    // A different second load: the second state of the first list is removed.
    place(&[1.0, 2.0]);
    assert_eq!(steps(), 2);
    assert!(path("restart.1").exists() && !path("restart.2").exists() && !path("checkpoint.3.a").exists());
    run(2, 2);
    place(&[1.0, 2.0, 3.0]);
    assert_eq!(steps(), 3);
    std::fs::write(path("checkpoint.3.a"), "a state").expect("written");
    place(&[1.0, 2.0, 4.0]);
    assert!(steps() == 3 && !path("checkpoint.3.a").exists());
    place(&[0.5]);
    assert_eq!(steps(), 1);
}

#[test]
fn steps_of_another_minimizer_are_removed() {
    let folder = tempfile::tempdir().expect("scratch");
    let job = written(folder.path(), 0.3).expect("written");
    for (minimizer, shares) in [(Minimizer::Auto, true), (Minimizer::Harmonic, false), (Minimizer::Fire, false)] {
        let settings = RelaxationSettings { minimizer, ..job.spec.settings };
        let other = JobSpec { settings, ..job.spec.clone() };
        assert_eq!(other.shares_steps_with(job.spec.clone(), false), shares, "{minimizer:?}");
    }
}

/// Lists of neighbours reach d_c: by the skin of the scripts, or by a larger one in the variables.
#[test]
fn a_contact_distance_beyond_the_skin_enlarges_it() {
    for script in [DISPLACEMENT_RAMP, PRESCRIBED_LOAD, NVT] {
        assert!(script.text.contains(&format!("variable skin index {SKIN_ANGSTROM}\n")), "{}", script.file);
    }
    let folder = tempfile::tempdir().expect("scratch");
    let mut job = written(folder.path(), 0.3).expect("written");
    let reach = job.spec.interaction.touch_angstrom();
    for (beyond, enlarged) in [(0.0, false), (0.3, false), (0.5, true), (2.0, true)] {
        job.spec.settings.contact_angstrom = reach + beyond;
        let skin = job.variables(&[], false).into_iter().find(|(k, _)| k == "skin").map(|(_, v)| v.parse::<f64>());
        assert_eq!(skin.is_some(), enlarged, "{beyond}");
        assert!(skin.is_none_or(|skin| skin.expect("a number") > beyond), "{beyond}");
    }
}

#[test]
fn adhesion_variables_are_set_only_with_adhesion() {
    let folder = tempfile::tempdir().expect("scratch");
    let mut job = written(folder.path(), 0.3).expect("written");
    assert!(!job.variables(&[], false).iter().any(|(k, _)| matches!(k.as_str(), "adhesion" | "kappa")));
    job.spec.interaction.adhesion =
        Some(Yukawa { amplitude_ev_angstrom: -1.0, kappa_per_angstrom: 2.0, cutoff_angstrom: 7.0 });
    let list = job.variables(&[], true);
    assert!(list.contains(&("adhesion".into(), "1".into())) && list.contains(&("start".into(), "-1".into())));
    // The script declares every variable.
    for (key, _) in list {
        assert!(scripts::DISPLACEMENT_RAMP.text.contains(&format!("\nvariable {key} ")), "{key}");
    }
}

#[test]
fn memory_of_the_challenge_block_agrees_with_the_measurement() {
    let folder = tempfile::tempdir().expect("scratch");
    let mut job = written(folder.path(), 0.3).expect("written");
    (job.spec.deformable, job.spec.fixed, job.spec.indenter) = (3_062_500, 0, 148_225);
    let gigabytes = job.memory_bytes(1) as f64 / 1e9;
    assert!((1.93..2.9).contains(&gigabytes), "{gigabytes}");
}

#[test]
fn each_rank_has_the_memory_of_the_harmonic_relaxation() {
    let folder = tempfile::tempdir().expect("scratch");
    let mut job = written(folder.path(), 0.3).expect("written");
    let harmonic = job.memory_bytes(2);
    job.spec.settings.minimizer = Minimizer::Fire;
    assert_eq!(harmonic - job.memory_bytes(2), 2 * library_bytes(&job.block(), true));
    assert!(harmonic > job.memory_bytes(2));
}

#[test]
fn values_without_meaning_are_refused() {
    let folder = tempfile::tempdir().expect("scratch");
    assert!(written(folder.path(), 0.0).is_err());
    assert!(written(folder.path(), f64::NAN).is_err());
}

fn job(adhesion: bool, unload: bool) -> (tempfile::TempDir, Job) {
    let folder = tempfile::tempdir().expect("scratch");
    let yukawa = Yukawa { amplitude_ev_angstrom: -60.0, kappa_per_angstrom: 2.0, cutoff_angstrom: 7.0 };
    let job = ramp_job(folder.path(), 0.3, adhesion.then_some(yukawa), unload).expect("written");
    (folder, job)
}

/// Steps with these displacements, loads and contacts.
fn records(list: &[(f64, f64, usize)]) -> Vec<StepRecord> {
    let record = |(step, &(displacement_angstrom, load, contacts)): (usize, &(f64, f64, usize))| StepRecord {
        step,
        displacement_angstrom,
        load,
        energy_ev: -1.0,
        iterations: 3,
        max_force: 1e-3,
        contacts,
        indenter_low_angstrom: 40.0 - displacement_angstrom,
        indenter_mean_angstrom: 41.0,
        atoms: 9,
        load_converged: true,
        minimizer: StepMinimizer::Cg,
        rejected: 0,
        predicted_decrease_ev: None,
    };
    list.iter().enumerate().map(record).collect()
}

#[test]
fn loading_ends_at_the_maximum_load_and_unloading_at_separation() {
    let steps = records(&[(0.0, 0.0, 0), (0.3, 2.0, 3), (0.6, 5.5, 8), (0.3, 2.0, 3), (0.0, 0.1, 1), (-0.3, 0.0, 0)]);
    let (_folder, down) = job(false, false);
    assert_eq!((down.reversal_step(&steps), down.end(&steps), down.end(&steps[..2])), (None, Some(2), None));
    let (_folder, both) = job(false, true);
    assert_eq!((both.reversal_step(&steps), both.reversal_step(&steps[..2])), (Some(2), None));
    assert_eq!((both.end(&steps), both.end(&steps[..5])), (Some(5), None));
    assert_eq!(both.unloading_state(&steps[..2]), None);
    // Without adhesion no step is refined.
    assert_eq!(
        both.unloading_state(&steps[..5]),
        Some(UnloadingState { reversal_step: 2, refined_from: None, min_load: 0.0, end: None })
    );
    assert_eq!(pull_off(&steps, 2, 100.0), None);
}

/// Loads of the unloading branch are not found at steps of the loading branch, and none is interpolated.
#[test]
fn a_prescribed_load_is_found_at_its_own_step() {
    let at_load = |load| PrescribedLoad { load, dz_angstrom: 1.0, move_hash: String::new() };
    let [loading, unloading] = [[at_load(1.0), at_load(3.0)], [at_load(1.0), at_load(0.5)]];
    let history = LoadHistory { steps: records(&[(0.0, 0.0, 0), (0.1, 1.0, 1), (0.2, 2.9, 2), (0.1, 1.0, 1)]) };
    let value_at = |bracket: Option<Bracket>| bracket.map(|b| (b.lower, b.weight));
    assert_eq!(value_at(own_step(&history, 1, &loading, 1.0)), Some((1, 0.0)));
    // A step that did not reach its load is still the step of that load.
    assert_eq!(value_at(own_step(&history, 1, &loading, 3.0)), Some((2, 0.0)));
    assert_eq!(value_at(own_step(&history, 1, &loading, 2.0)), None);
    assert_eq!(value_at(own_step(&history, 3, &unloading, 1.0)), Some((3, 0.0)));
    // Not finished yet.
    assert_eq!(value_at(own_step(&history, 3, &unloading, 0.5)), None);
}

#[test]
fn with_adhesion_steps_are_refined_until_the_pull_has_decayed() {
    let steps = records(&[
        (0.0, -0.2, 0),
        (0.3, 5.5, 8),
        (0.0, 3.0, 4),
        (-0.3, 1.0, 2),
        (-0.375, -0.5, 1),
        (-0.45, -1.5, 1),
        (-0.525, -2.0, 1),
        (-0.6, -1.9, 0),
        (-0.675, -0.5, 0),
    ]);
    let (_folder, job) = job(true, true);
    let actual = job.unloading_state(&steps).expect("an unloading branch");
    assert_eq!(actual, UnloadingState { reversal_step: 1, refined_from: Some(3), min_load: -2.0, end: Some(8) });
    // Contact is lost, but the tensile load has not yet decayed to `PULL_FRACTION`, so unloading continues.
    assert_eq!(job.end(&steps[..8]), None);
    let pull = pull_off(&steps, 1, 100.0).expect("a pull");
    assert_eq!((pull.step, pull.force_ev_per_angstrom, pull.contacts), (6, -2.0, 1));
    assert!((pull.error_ev_per_angstrom - 0.5).abs() < 1e-12 && (pull.step_angstrom - 0.075).abs() < 1e-12);
    assert!((pull.p_star + 0.02).abs() < 1e-12);
    // Variables of a continued run.
    let variables = job.variables(&steps[..6], false);
    for (key, value) in
        [("start", "5"), ("reversal_step", "1"), ("refined_from", "3"), ("previous_load", "-1.5"), ("min_load", "-1.5")]
    {
        assert!(variables.contains(&(key.into(), value.into())), "{key} in {variables:?}");
    }
    for (key, _) in variables {
        assert!(job.script().text.contains(&format!("\nvariable {key} ")), "{key}");
    }
}

#[test]
fn unloading_without_separation_ends_at_the_maximum_rise() {
    let (_folder, job) = job(true, true);
    let steps = records(&[(0.0, 0.0, 0), (0.3, 6.0, 2), (-6.9, -3.0, 2), (-7.05, -3.1, 2)]);
    assert_eq!((job.end(&steps), job.end(&steps[..3])), (Some(3), None));
}
