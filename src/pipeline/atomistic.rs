//! Building blocks of the atomistic stages: potential file, job folder, LAMMPS run, and analysis of its frames.

use super::frame_analysis::FrameAnalyzer;
use super::initial_states::initial_configurations;
use super::matched::compliant_wall;
use super::stage::StageContext;
use super::unloading::unloading;
use super::{Listener, StageKey, frame_analysis};
use crate::scene::{AtomsCase, AtomsStart, Case};
use crate::{Error, Result};
use asperity_atoms::block::{BaseKind, SurfaceSites};
use asperity_atoms::cost::{Relaxer, evaluations_from_continuum};
use asperity_atoms::dump::read_frame;
use asperity_atoms::engine::{Finished, LammpsEngine};
use asperity_atoms::external_dump::DumpTrajectory;
use asperity_atoms::indenter::Indenter;
use asperity_atoms::job::{Job, JobCrystal, Loading, POTENTIAL_FILE};
use asperity_atoms::job_spec::{DisplacementRamp, FRAME_LAYERS, LoadingProtocol, RelaxationSettings};
use asperity_atoms::lammps_command::{ARGUMENTS, LammpsCommand};
use asperity_atoms::load_history::StepRecord;
use asperity_atoms::potential::Potential;
use asperity_atoms::progress::Progress;
use asperity_atoms::results::{AtomState, AtomsResults, DefectAtoms, LoadStepResults, PlasticityResults};
use asperity_atoms::run_script::LmpCommand;
use asperity_atoms::{centro_symmetry, damage, load_history, speed as measured};
use asperity_contact::results::ContinuumResults;
use asperity_grid::Grid;
use asperity_surface::files::atomic_file::{create_folder, write_atomic};
use asperity_surface::files::csv;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Ramp steps beyond the displacement that closes the mean gap at first contact.
const SPARE_STEPS: usize = 40;

/// Subfolder of a job for the continuum solution that gives the initial configurations.
const CONTINUUM: &str = "continuum";

/// Writes the job folder of a case: data file, script, potential and variables. For a start from the continuum it
/// solves the continuum first, and adds the initial displacements of each load.
pub fn build_job(case: &Case, atoms: &AtomsCase, folder: &Path, listener: &dyn Listener) -> Result<Job> {
    if atoms.start == AtomsStart::Touch {
        return write_job(case, atoms, folder, None);
    }
    let inside = folder.join(CONTINUUM);
    create_folder(&inside)?;
    let key = StageKey::new(CONTINUUM, &case.portable_scene(), &[])?;
    let solved = compliant_wall(case, atoms, &StageContext { folder: &inside, stage: CONTINUUM, key: &key, listener })?;
    write_job(case, atoms, folder, Some((&solved, folder)))
}

/// Writes the job folder. `solved`: the continuum solution that gives the initial configurations, and the folder to
/// which its file names are relative; None for a displacement ramp.
pub(super) fn write_job(
    case: &Case,
    atoms: &AtomsCase,
    folder: &Path,
    solved: Option<(&ContinuumResults, &Path)>,
) -> Result<Job> {
    let scene = case.scene.atoms.as_ref().expect("an atoms case comes from a scene with atoms");
    create_folder(folder)?;
    let potential = potential_file(atoms, folder)?;
    let grid = Grid::unit(atoms.points, atoms.points);
    let heights = atoms.heights_angstrom(case.surface(), grid);
    let interaction = frame_analysis::interaction(atoms);
    let indenter = Indenter::above(&atoms.block, atoms.points, heights, interaction.touch_angstrom())?;
    let highest = case.highest_p_star();
    // A deep foundation is compressed by more than the mean gap.
    let compressed = highest * case.gradient * atoms.compression() * atoms.block.length();
    let approach_steps = (atoms.first_touch_gap_angstrom + compressed) / scene.step_or_default();
    let settings = RelaxationSettings {
        force_tolerance: scene.force_tolerance.to("eV/Å"),
        minimizer: scene.minimizer,
        load_unit: atoms.load_unit,
        contact_angstrom: atoms.wall.repulsion.contact_distance_angstrom,
        // Slip can start at any depth below the contact.
        frame_layers: if scene.plasticity { 2 * atoms.block.depth_cells } else { FRAME_LAYERS },
        keep_restarts: atoms.nvt.is_some(),
    };
    let ramp = DisplacementRamp {
        step_angstrom: scene.step_or_default(),
        // The ramp ends at the first step beyond the highest load, which is interpolated between two steps.
        max_load: highest * atoms.load_unit,
        max_steps: approach_steps.ceil() as usize + SPARE_STEPS,
        unload: atoms.unload,
    };
    let configurations = solved.map(|s| initial_configurations(case, atoms, &indenter, s)).transpose()?;
    let loading = configurations.as_deref().map_or(Loading::Ramp(ramp), Loading::Prescribed);
    let crystal = JobCrystal { potential: &potential, element: &atoms.element, mass_u: atoms.mass_u };
    Job::write(folder, &atoms.block, &indenter, crystal, interaction, settings, loading)
}

/// Path of the scene's potential, or of the shipped one, which is written into `folder`.
fn potential_file(atoms: &AtomsCase, folder: &Path) -> Result<PathBuf> {
    if let Some(path) = &atoms.potential {
        return Ok(path.clone());
    }
    let path = folder.join(POTENTIAL_FILE);
    write_atomic(&path, |w| Potential::calcium().write_setfl(w))?;
    Ok(path)
}

/// LAMMPS with the program, ranks and time limit of the scene.
pub fn engine(case: &Case) -> Result<LammpsEngine> {
    let scene = case.scene.atoms.as_ref().expect("a scene with atoms");
    let command = case.lammps_command();
    let engine = find_engine(&command, &case.file)?.with_command(command).map_err(|e| match &e {
        // Arguments belong to the machine, not to the scene.
        Error::Input { list, .. } if list.iter().any(|c| c.key == ARGUMENTS) => e,
        _ => e.with_context(case.file.display(), Some("atoms.ranks")),
    })?;
    Ok(engine.with_time_limit(scene.time_limit.map(|t| Duration::from_secs_f64(t.to("s")))))
}

/// The LAMMPS of a command of the scene `file`, as one process without arguments.
pub(super) fn find_engine(command: &LammpsCommand, file: &Path) -> Result<LammpsEngine> {
    LammpsEngine::find(command.program.as_deref()).map_err(|e| match e {
        Error::MissingProgram { program, .. } => Error::MissingProgram {
            program,
            how: format!(
                "install LAMMPS (Debian: apt-get install lammps) or give its path with --lammps, as lammps.program in machines.toml, or as atoms.program in {}",
                file.display()
            ),
        },
        other => other.with_context(file.display(), Some("atoms.program")),
    })
}

/// The LAMMPS of this machine, as far as it concerns the time of a run.
#[derive(Debug, Clone, Copy)]
pub struct LammpsSpeed {
    /// CPU time, s per atom and force evaluation.
    pub seconds_per_evaluation: f64,
    pub relaxer: Relaxer,
}

/// Measures LAMMPS on this machine with the potential of a case with atoms, and looks for its library. Takes about a second.
///
/// # Errors
/// `MissingProgram` if LAMMPS is not found; `Io`; `Lammps`.
pub fn speed(case: &Case) -> Result<LammpsSpeed> {
    let atoms = case.atoms.as_ref().expect("a case with atoms");
    let scene = case.scene.atoms.as_ref().expect("a scene with atoms");
    let engine = engine(case)?;
    let lammps = LmpCommand { program: engine.program().to_path_buf() };
    let scratch = tempfile::tempdir().map_err(Error::io("make", std::env::temp_dir()))?;
    let potential = potential_file(atoms, scratch.path())?;
    // LAMMPS splits a path at spaces, so the potential is copied into the working folder.
    let copy = scratch.path().join(POTENTIAL_FILE);
    if potential != copy {
        std::fs::copy(&potential, &copy).map_err(Error::io("copy", &potential))?;
    }
    let seconds_per_evaluation =
        measured::measure(&lammps, scratch.path(), (POTENTIAL_FILE, &atoms.element, atoms.block.a0))?;
    Ok(LammpsSpeed { seconds_per_evaluation, relaxer: engine.relaxer(scene.minimizer) })
}

/// Output of the LAMMPS stage.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct LammpsOutcome {
    pub engine: String,
    pub steps: Vec<LoadStepResults>,
    /// Steps whose largest force exceeds the tolerance, or whose load was not reached.
    pub unconverged: Vec<usize>,
    /// Peak resident memory of the last call, bytes; 0 if unknown.
    #[serde(default)]
    pub peak_bytes: u64,
}

/// Upper limit of the progress reported within a load: some loads take several times the expected iterations.
const NEARLY: f64 = 0.9;

/// Runs a job with LAMMPS, or continues it, and writes `load_curve.csv`.
pub fn run_lammps(engine: &LammpsEngine, job: &Job, listener: &dyn Listener) -> Result<LammpsOutcome> {
    if let Some(damage) = damage::remove_damaged(&job.folder)? {
        listener.warn(&format!("{damage}; LAMMPS computes the steps from there on again"));
    }
    let mut reversed = job.reversal_step(&load_history::LoadHistory::read(&job.folder)?.steps).is_some();
    let relaxer = engine.relaxer(job.spec.settings.minimizer);
    let mut was_silent = false;
    let mut watch = |p: Progress| {
        if let Some(seconds) = p.silent_s.filter(|_| !was_silent) {
            listener.warn(&format!(
                "LAMMPS in {} has written nothing for {:.0} min and may hang; Ctrl-C stops it, and the same command resumes",
                job.folder.display(),
                seconds / 60.0
            ));
        }
        was_silent = p.silent_s.is_some();
        if let Some(record) = &p.record {
            let (done, words) = progress_of((job, relaxer), &p, record, &mut reversed);
            listener.progress(done, &words);
        }
        if listener.stopping() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let mut finished = engine.run(job, &mut watch)?;
    // Steps of an earlier run beyond the end of this job are not part of the results.
    let end = job.end(&finished.history.steps);
    finished.steps.truncate(end.map_or(usize::MAX, |last| last + 1));
    finished.unconverged.retain(|step| *step < finished.steps.len());
    if let Some(step) = finished.resumed_from {
        listener.warn(&format!("resumed at load step {step} of an earlier run"));
    }
    if let Some(reason) = &finished.not_harmonic {
        listener.warn(&format!("LAMMPS's own minimisers relax the atoms, in many more force evaluations: {reason}"));
    }
    let column = |value: fn(&LoadStepResults) -> f64| finished.steps.iter().map(value).collect::<Vec<f64>>();
    csv::write(
        &job.folder.join("load_curve.csv"),
        &[
            ("step", &column(|s| s.step as f64)),
            ("displacement_angstrom", &column(|s| s.displacement_angstrom)),
            ("load_ev_per_angstrom", &column(|s| s.load_ev_per_angstrom)),
            ("p_star", &column(|s| s.p_star)),
            ("contacts", &column(|s| s.contacts as f64)),
            ("energy_ev", &column(|s| s.energy_ev)),
            ("force_evaluations", &column(|s| s.force_evaluations as f64)),
            ("max_force_ev_per_angstrom", &column(|s| s.max_force_ev_per_angstrom)),
        ],
    )?;
    let Finished { steps, unconverged, peak_bytes, .. } = finished;
    Ok(LammpsOutcome { engine: engine.describe().to_string(), steps, unconverged, peak_bytes })
}

/// Completed fraction of a job, and a message about its last step. Sets `reversed` when the job starts to unload.
fn progress_of(
    (job, relaxer): (&Job, Relaxer),
    p: &Progress,
    record: &StepRecord,
    reversed: &mut bool,
) -> (Option<f64>, String) {
    let atoms = if record.contacts == 1 { "atom" } else { "atoms" };
    let state = format!("p* = {:.5}, {} {atoms} in contact", p.p_star, record.contacts);
    match &job.spec.protocol {
        LoadingProtocol::Ramp(ramp) => {
            // The load is roughly proportional to the square of the displacement.
            let loaded = (record.load / ramp.max_load).clamp(0.0, 1.0).sqrt();
            *reversed |= ramp.unload && (record.load >= ramp.max_load || record.step >= ramp.max_steps);
            let (done, branch) = match (ramp.unload, *reversed) {
                (false, _) => (loaded, ""),
                (true, false) => (0.5 * loaded, ""),
                (true, true) => (1.0 - 0.5 * loaded, ", unloading"),
            };
            (Some(done), format!("step {}{branch}, {state}", record.step))
        }
        LoadingProtocol::Prescribed(loads) => {
            let spec = &job.spec;
            let expected = evaluations_from_continuum(
                spec.block.cells,
                job.block().relaxing_cells(),
                spec.settings.force_tolerance,
                relaxer,
            );
            let (total, next) = (loads.loads.len(), record.step + 1);
            let part = (p.iterations as f64 / expected).min(NEARLY);
            let within = if next > total || p.is_new { 0.0 } else { part };
            let now = if next > total { String::new() } else { format!(", iteration {} of the next", p.iterations) };
            (
                Some((record.step as f64 + within) / total as f64),
                format!("load {} of {total}, {state}{now}", record.step),
            )
        }
        LoadingProtocol::Nvt(_) => (None, format!("load {}, {state}", record.step)),
    }
}

/// Analyses external LAMMPS dump files of the scene's block. File names in the results are relative to `out`.
pub fn read_frames(
    case: &Case,
    atoms: &AtomsCase,
    files: &[PathBuf],
    out: &Path,
    warn: &mut dyn FnMut(&str),
) -> Result<(DumpTrajectory, AtomsResults)> {
    let reader = FrameAnalyzer::new(case, atoms, out, ".")?;
    let frames =
        DumpTrajectory::scan(files, &atoms.block, &reader.indenter, &frame_analysis::interaction(atoms), warn)?;
    let mut states = Vec::new();
    for step in case.loading_steps() {
        states.push(reader.state(step, &frames.at_load(atoms.load(step))?)?);
    }
    let outcome = LammpsOutcome { engine: "unknown".into(), ..LammpsOutcome::default() };
    let atoms_results = results(atoms, &reader, &outcome, states);
    Ok((frames, atoms_results))
}

/// Analyses a finished job folder outside a run folder. File names in the results are relative to `out`.
pub fn read_atoms(case: &Case, atoms: &AtomsCase, job: &Job, out: &Path) -> Result<AtomsResults> {
    let outcome = LammpsOutcome { engine: "unknown".into(), ..LammpsOutcome::default() };
    read(case, atoms, job, &outcome, out, ".")
}

/// Analyses the atoms at every load of the path: contact, gap, maps on the comparison grid, and a frame for OVITO.
pub(super) fn read(
    case: &Case,
    atoms: &AtomsCase,
    job: &Job,
    outcome: &LammpsOutcome,
    folder: &Path,
    stage: &str,
) -> Result<AtomsResults> {
    let reader = FrameAnalyzer::new(case, atoms, folder, stage)?;
    let records = load_history::LoadHistory::read(&job.folder)?;
    let mut states = Vec::new();
    for step in case.loading_steps() {
        states.push(reader.state(step, &job.at_load(&records, atoms.load(step))?)?);
    }
    let mut unloading = unloading(case, atoms, job, &records, (&reader, &states))?;
    let scene = case.scene.atoms.as_ref().expect("an atoms case comes from a scene with atoms");
    let back = unloading.as_mut().map(|u| u.states.as_mut_slice()).unwrap_or_default();
    let plasticity = scene.plasticity.then(|| plasticity(atoms, job, &records, &mut states, back)).transpose()?;
    Ok(AtomsResults { unloading, plasticity, ..results(atoms, &reader, outcome, states) })
}

/// Counts the defect atoms (centro-symmetry) at every step. Each state receives the count of the step with the nearest
/// load.
fn plasticity(
    atoms: &AtomsCase,
    job: &Job,
    records: &load_history::LoadHistory,
    states: &mut [AtomState],
    back: &mut [AtomState],
) -> Result<PlasticityResults> {
    let end = job.end(&records.steps).map_or(records.steps.len(), |last| last + 1);
    let mut steps: Vec<[f64; 2]> = Vec::new();
    let mut lowest = None;
    for record in &records.steps[..end] {
        let frame = read_frame(load_history::frame_file(&job.folder, record.step)?)?;
        let defects = centro_symmetry::defect_atoms(&frame, &atoms.block)?;
        steps.push([record.load / atoms.load_unit, defects.len() as f64]);
        if defects.len() > centro_symmetry::NOISE {
            let layer = defects.first().and_then(|id| atoms.block.layer_of(*id));
            lowest = lowest.into_iter().chain(layer).min();
        }
    }
    let atom_nm3 = 1e-3 * atoms.block.a0.powi(3) / 4.0;
    let turn = job.reversal_step(&records.steps).unwrap_or(end - 1);
    for (states, steps) in [(&mut *states, &steps[..=turn]), (back, &steps[turn..])] {
        for state in states.iter_mut() {
            let distance = |s: &[f64; 2]| (s[0] - state.p_star).abs();
            let nearest = steps.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
            state.defects = nearest.map(|s| DefectAtoms { atoms: s[1] as usize, volume_nm3: s[1] * atom_nm3 });
        }
    }
    let yielded = steps.iter().position(|s| s[1] > centro_symmetry::NOISE as f64);
    let first_yield = yielded.map(|k| steps[k][0]);
    // Step 0 is unloaded; its recorded load is a remainder within the force tolerance.
    let last_elastic = yielded.and_then(|k| k.checked_sub(1)).map(|k| if k == 0 { 0.0 } else { steps[k][0] });
    // Not by p*: that of a state is the imposed one, and those of the steps are measured.
    let yields = |s: &&AtomState| s.defects.is_some_and(|d| d.atoms > centro_symmetry::NOISE) && s.contacts > 0;
    let beyond: Vec<f64> = states.iter().filter(yields).map(|s| s.contact_stress_gpa).collect();
    Ok(PlasticityResults {
        atoms: centro_symmetry::analysed_atoms(&atoms.block) as usize,
        masked_layers: centro_symmetry::MASKED_LAYERS,
        threshold: centro_symmetry::THRESHOLD,
        noise_atoms: centro_symmetry::NOISE,
        steps,
        first_yield,
        last_elastic,
        layers_above_base: lowest.map(|l| l.saturating_sub(atoms.block.base_layers)),
        hardness_gpa: (!beyond.is_empty()).then(|| beyond.iter().sum::<f64>() / beyond.len() as f64),
    })
}

/// Results of the atoms with these states.
fn results(atoms: &AtomsCase, reader: &FrameAnalyzer, outcome: &LammpsOutcome, states: Vec<AtomState>) -> AtomsResults {
    AtomsResults {
        potential: atoms.potential.as_ref().map_or("shipped calcium-like EAM".into(), |p| p.display().to_string()),
        engine: outcome.engine.clone(),
        cells: atoms.block.cells,
        depth_cells: atoms.block.depth_cells,
        foundation_cells: atoms.block.foundation_cells,
        elastic_base: atoms.block.base == BaseKind::Elastic,
        a0_angstrom: atoms.block.a0,
        modulus_gpa: atoms.modulus_gpa,
        length_angstrom: atoms.block.length(),
        deformable: atoms.block.deformable() as usize,
        fixed: atoms.block.fixed() as usize,
        indenter: reader.indenter.atoms() as usize,
        repulsion: atoms.wall.repulsion,
        audit: atoms.audit.clone(),
        from_continuum: atoms.start == AtomsStart::Continuum,
        load_steps: outcome.steps.clone(),
        states,
        unloading: None,
        nvt: None,
        plasticity: None,
    }
}

/// Positions of the surface sites in units of the block's length, in the order of their contact flags.
pub(super) fn site_positions(sites: &SurfaceSites) -> impl Iterator<Item = [f64; 2]> {
    let length = sites.length();
    (0..sites.len()).map(move |i| sites.xy(i).map(|c| (c / length).rem_euclid(1.0)))
}
