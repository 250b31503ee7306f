//! Execution of a run: the stages of a case in order, and the files of the run folder.

use super::atom_stages::AtomStages;
use super::comparison::compare;
use super::curve;
use super::folder::{OutFolder, RunFolder, StageKey};
use super::given_loads::given_loads;
use super::laboratory::{SolveStage, SolvedHeights, Variant, variant_key};
use super::matched::Matched;
use super::run_files::{Manifest, write_ovito_script};
use super::sources::{Ran, sources};
use super::stage::Stage;
use super::stages::{self, Made, Visitor};
use super::surface::SurfaceStage;
use super::{Listener, engine};
use crate::record::results::{self, MANIFEST_FILE, Results, SCHEMA, ScalesSi};
use crate::record::written::{self, WrittenFolder};
use crate::record::{ensemble, load_table, netcdf, tradeoff, xdmf};
use crate::report::accuracy;
use crate::scene::{AtomsScene, Case, Scene};
use crate::{Error, Result, challenge, report};
use asperity_contact::method::Device;
use asperity_contact::problem::{Accuracy, AccuracyResults, GridErrors, SolvedGrid};
use asperity_contact::results::PullOff;
use asperity_surface::files::atomic_file::{list, read_text, remove, remove_folder, rename, write_atomic};
use asperity_surface::files::{hashed, json};
use std::path::{Path, PathBuf};

/// The scene of a run, in its folder.
pub(super) const SCENE_FILE: &str = "scene.toml";

/// Metadata of an RO-Crate.
pub(super) const CRATE_FILE: &str = "ro-crate-metadata.json";

/// Folder of copies of the files that the scene names, in an RO-Crate.
pub(super) const INPUTS: &str = "inputs";

/// Files of a run, a trade-off or a sweep outside its stages.
pub(super) const OUTSIDE_STAGES: [&str; 14] = [
    SCENE_FILE,
    results::FILE,
    load_table::FILE,
    load_table::PULL_OFF_FILE,
    MANIFEST_FILE,
    netcdf::run::FILE,
    xdmf::FILE,
    tradeoff::FILE,
    tradeoff::CSV_FILE,
    ensemble::FILE,
    ensemble::NUMBERS_FILE,
    ensemble::STATISTICS_FILE,
    ensemble::DIFFERENCES_FILE,
    report::PAGE,
];

/// Folder of the comparison of atoms and continuum.
const COMPARE: &str = "compare";

/// Runs all stages of a case in a folder, and writes results and report. Returns the results and the path of the
/// report.
///
/// # Errors
/// Those of [`expect_scene`], `MissingProgram` and `Memory` before anything is written; errors of the stages.
pub fn run<'a>(case: &Case, out: impl Into<OutFolder<'a>>, listener: &dyn Listener) -> Result<(Results, PathBuf)> {
    let out = out.into();
    expect_scene(case, out)?;
    // LAMMPS is looked up first: a missing program then costs no computing time and leaves no folder.
    let engine = case.atoms.as_ref().map(|_| engine(case)).transpose()?;
    if case.solves() {
        Device::check(&case.planned_problem(), case.method()).map_err(|e| case.given_units().rewrite(e))?;
    }
    if case.scene.accuracy().is_none() {
        super::plan(case, rayon::current_num_threads(), None)?.fits()?;
    }
    let verify = out.verify;
    let folder = RunFolder::open(out)?;
    let out = out.path;
    keep_scene(case, out, listener)?;
    // The key of the geometry does not depend on the executable, so LAMMPS steps remain valid after a new build; other
    // results do not. The job folder determines which of its steps are valid.
    let geometry = StageKey::new("geometry", &(&case.scene.laboratory, &case.scene.surface, heights_hash(case)?), &[])?;
    let mut run = Running { listener, folder, warnings: Vec::new(), failures: Vec::new() };
    let settle = |accuracy| settle(case, &accuracy, &geometry, &mut run, (out, verify));
    let settled = case.scene.accuracy().map(settle).transpose()?;
    let case = settled.as_ref().map_or(case, |(case, _)| case);
    let accuracy = settled.as_ref().map(|(_, reached)| reached.clone());
    run.warnings.splice(..0, case.warnings.iter().cloned());
    case.warnings.iter().for_each(|w| listener.warn(w));
    if let Some(missed) = accuracy.as_ref().and_then(accuracy::missed) {
        run.warn(missed);
    }
    let stages = AtomStages::of(case, engine.as_ref());
    let made = stages::visit((case, stages), out, Some(&geometry), &mut run)?;
    let mut results = Results {
        schema: SCHEMA,
        name: case.scene.name.clone(),
        description: case.scene.description.clone(),
        scales: ScalesSi { length_m: case.scales.length_m, modulus_pa: case.scales.modulus_pa },
        loads: given_loads(case),
        surface: made.surface.expect("every run has this stage"),
        continuum: made.primary,
        accuracy,
        non_adhesive: made.non_adhesive,
        other_ranges: made.other_ranges,
        cross_check: made.cross_check,
        methods: made.methods,
        failures: run.failures,
        acceptance: Vec::new(),
        atoms: made.atoms,
        comparison: made.comparison,
        stages: run.folder.costs.clone(),
        warnings: run.warnings,
        sources: Vec::new(),
    };
    results.sources = sources(Ran { case, atoms: results.atoms.as_ref() });
    if case.scene.challenge.is_some() {
        results.acceptance = challenge::assess(&results);
    }
    results.write(out)?;
    curve::write(out, &results)?;
    let manifest = Manifest::of(case, &results, engine.as_ref().map(|e| e.describe()))?;
    json::write(&out.join(MANIFEST_FILE), &manifest)?;
    netcdf::run::write_run(out, &results)?;
    xdmf::write(out, &results)?;
    write_ovito_script(&results, out)?;
    let page = report::write(out)?;
    list_files(out)?;
    Ok((results, page))
}

/// Folder of the grids that are solved for an accuracy.
const ACCURACY: &str = "accuracy";

/// The case on the grid on which its accuracy is reached. Each grid is solved in a folder of its own, in which an interrupted one continues;
/// the stages of the last one then become those of the run.
///
/// # Errors
/// Those of the stages.
fn settle(
    case: &Case,
    accuracy: &Accuracy,
    geometry: &StageKey,
    run: &mut Running,
    (out, verify): (&Path, bool),
) -> Result<(Case, AccuracyResults)> {
    let surface = &case.problem.surface;
    let [nx, ny] = surface.refinements()[0];
    // The series of a map is made once.
    let coarsest = surface.on_nodes(nx, ny);
    let all = variant_key(case, ACCURACY, Variant::Primary, &[geometry])?;
    let key = StageKey::new(ACCURACY, &(&case.scene.accuracy, StageKey::of_program()?), &[&all])?;
    let listener = run.listener;
    let work = |folder: &Path| {
        let mut last = folder.to_path_buf();
        let reached = accuracy.refine(surface, |nodes| {
            let case = case.on_nodes(nodes, &coarsest, accuracy)?;
            super::plan(&case, rayon::current_num_threads(), None)?.fits()?;
            let own = folder.join(format!("{}x{}", nodes[0], nodes[1]));
            let (errors, seconds) =
                solve_grid(&case, accuracy, geometry, listener, OutFolder { verify, ..OutFolder::from(&own) })?;
            last = own;
            Ok((errors, Some(seconds)))
        })?;
        for stage in [SurfaceStage { case }.name(), SolveStage { case, variant: Variant::Primary }.name()] {
            let to = out.join(&stage);
            if to.exists() {
                remove_folder(&to)?;
            }
            rename(&last.join(&stage), &to)?;
        }
        for (_, path) in list(folder)?.into_iter().filter(|(_, path)| path.is_dir()) {
            remove_folder(&path)?;
        }
        Ok(reached)
    };
    let what = ("accuracy", "grids from coarse to fine");
    let reached: AccuracyResults = run.folder.stage(listener, what, &key, Some(&key), work)?;
    let SolvedGrid { nx, ny, .. } = *reached.grids.last().expect("one grid at least is solved");
    Ok((case.on_nodes([nx, ny], &coarsest, accuracy)?, reached))
}

/// Errors of the scene's own problem on the grid of a case, and the time of its solve.
fn solve_grid(
    case: &Case,
    accuracy: &Accuracy,
    geometry: &StageKey,
    listener: &dyn Listener,
    out: OutFolder,
) -> Result<(GridErrors, f64)> {
    let mut folder = RunFolder::open(out)?;
    let (_, surface) = folder.execute(&SurfaceStage { case }, &[geometry], (), listener)?;
    let heights = SolvedHeights::new(case);
    let stage = SolveStage { case, variant: Variant::Primary };
    let (solved, _) = folder.execute(&stage, &[&surface], &heights, listener)?;
    let pull_off = solved.pull_off.as_ref().map(PullOff::relative_error);
    let seconds = folder.costs.iter().map(|cost| cost.seconds).sum();
    let mut errors = accuracy.errors_of(case.imposes_gaps(), &solved.states, pull_off);
    if solved.contact_lost.is_some() {
        // A finer grid may keep the contact.
        errors.values_mut().for_each(|error| *error = None);
    }
    Ok((errors, seconds))
}

/// Writes the hashes of the files outside the stages. Metadata of earlier ones are removed.
pub(super) fn list_files(out: &Path) -> Result<()> {
    remove(&out.join(CRATE_FILE))?;
    hashed::write_checksums(out, &OUTSIDE_STAGES)
}

/// Executes the stages of a run.
struct Running<'a> {
    listener: &'a dyn Listener,
    folder: RunFolder,
    warnings: Vec<String>,
    failures: Vec<String>,
}

impl Visitor for Running<'_> {
    fn visit<S: Stage>(
        &mut self,
        stage: &S,
        after: &[&StageKey],
        input: Option<S::Input<'_>>,
    ) -> Result<Made<S::Output>> {
        let input = input.expect("the stages before have outputs");
        self.folder.execute(stage, after, input, self.listener).map(Some)
    }

    fn warn(&mut self, text: String) {
        self.listener.warn(&text);
        self.warnings.push(text);
    }

    fn failed(&mut self, text: String) {
        self.failures.push(text.clone());
        self.warn(text);
    }

    fn seconds(&self, stage: &str) -> f64 {
        self.folder.costs.iter().filter(|c| c.name == stage).map(|c| c.seconds).sum()
    }
}

/// Refuses to replace the results of another scene, unless the folder says so.
///
/// # Errors
/// `Input` with the difference.
pub fn expect_scene(case: &Case, out: OutFolder) -> Result<()> {
    // A damaged scene says nothing about the results; the run writes it again.
    let finished = [results::FILE, tradeoff::FILE].iter().any(|file| out.path.join(file).exists());
    if out.overwrite || !finished || !hashed::changed(out.path, &[SCENE_FILE]).is_empty() {
        return Ok(());
    }
    let Ok(earlier) = Scene::read(&out.path.join(SCENE_FILE)) else { return Ok(()) };
    expect_same((&earlier, &case.portable_scene()), out.path, "contains")
}

/// Refuses a scene whose results are not those of an earlier one. `has`: in words, what has the earlier ones.
///
/// # Errors
/// `Input` with the difference.
pub(super) fn expect_same((earlier, scene): (&Scene, &Scene), out: &Path, has: &str) -> Result<()> {
    let difference = json::differences(&of_results(earlier), &of_results(scene));
    if difference.is_empty() {
        return Ok(());
    }
    let found = format!("{} ({has} the results of another scene: {difference})", out.display());
    let accepted = "another folder, or --overwrite to replace these results (stages that do not depend on the difference are kept)";
    Err(Error::input("command line", "--out", found, accepted))
}

/// The keys of a scene on which its results depend: not those of the machine, nor what is done about warnings.
fn of_results(scene: &Scene) -> serde_json::Value {
    let mut scene = scene.clone();
    scene.surface.strict = false;
    let usual = AtomsScene::default();
    if let Some(atoms) = &mut scene.atoms {
        (atoms.program, atoms.ranks, atoms.time_limit) = (usual.program, usual.ranks, usual.time_limit);
    }
    serde_json::to_value(scene).unwrap_or_default()
}

/// Writes the scene into the run folder. Removes the results of a different scene, which `report` and `compare` would
/// read as those of this one. Warns of files that changed since the last run wrote them.
pub(super) fn keep_scene(case: &Case, out: &Path, listener: &dyn Listener) -> Result<()> {
    let changed = hashed::changed(out, &OUTSIDE_STAGES);
    if !changed.is_empty() {
        let names = changed.join(", ");
        listener.warn(&format!("{}: {names} changed since the last run; written again", out.display()));
    }
    let text = toml::to_string_pretty(&case.portable_scene())
        .map_err(|e| Error::format("scene", e, "a scene that TOML can hold"))?;
    let file = out.join(SCENE_FILE);
    if read_text(&file).is_ok_and(|earlier| earlier == text) {
        return Ok(());
    }
    let results = [results::FILE, tradeoff::FILE, MANIFEST_FILE, netcdf::run::FILE, xdmf::FILE, report::PAGE];
    for name in [hashed::CHECKSUMS, CRATE_FILE].into_iter().chain(results) {
        remove(&out.join(name))?;
    }
    let copies = out.join(INPUTS);
    if copies.exists() {
        remove_folder(&copies)?;
    }
    write_atomic(&file, |w| std::io::Write::write_all(w, text.as_bytes()))
}

/// Repeats the comparison from the stored results of a run folder, without new solutions, and writes results and
/// report.
pub fn rebuild_comparison(out: &Path) -> Result<(Results, PathBuf)> {
    let (mut results, folder) = checked(out)?;
    let mut case = Case::read(&out.join(SCENE_FILE))?;
    if let (Some(accuracy), Some(solved)) = (case.scene.accuracy(), &results.continuum) {
        let coarsest = case.problem.surface.on_nodes(solved.nx, solved.ny);
        case = case.on_nodes([solved.nx, solved.ny], &coarsest, &accuracy)?;
    }
    let lacking = || Error::format(out, "a run without atoms", "the folder of a run whose scene has [atoms]");
    let (a, atoms) = case.atoms.as_ref().zip(results.atoms.as_ref()).ok_or_else(lacking)?;
    let earlier = results.comparison.as_ref().ok_or_else(lacking)?;
    let matched = Matched {
        full: earlier.full_heights.clone(),
        hard: earlier.hard_wall.clone(),
        compliant: earlier.compliant_wall.clone(),
        yielding: earlier.yielding_wall.clone(),
    };
    results.comparison = Some(compare(&case, a, atoms, &matched, out, COMPARE)?);
    results.write(out)?;
    folder.list_again(COMPARE)?;
    let page = report::write(out)?;
    list_files(out)?;
    Ok((results, page))
}

/// Draws the report of a run, a trade-off or a sweep again. Returns its path.
///
/// # Errors
/// `Format` for a folder without results, or with a file that is not as the run wrote it; `Io`.
pub fn redraw(out: &Path, options: &report::ReportOptions) -> Result<PathBuf> {
    let has = |file: &str| out.join(file).exists() && !out.join(results::FILE).exists();
    let _locked = match [ensemble::FILE, tradeoff::FILE].into_iter().find(|file| has(file)) {
        Some(table) => {
            written::expect_table(out, table)?;
            RunFolder::lock(out)?
        }
        None => checked(out)?.1,
    };
    let page = report::write_with(out, options)?;
    list_files(out)?;
    Ok(page)
}

/// Reads the results of a finished run folder, whose files are as they were written, and locks it.
///
/// # Errors
/// `Format`, which names the file and the remedy; `Io`.
fn checked(out: &Path) -> Result<(Results, RunFolder)> {
    // Before the lock, which leaves a file: a folder without results is none of ours.
    let (written, results) = WrittenFolder::run(out)?;
    written::unchanged(out, SCENE_FILE)?;
    let folder = RunFolder::lock(out)?;
    written.verify()?;
    Ok((results, folder))
}

/// Of the files of the surface and of the other rough body.
pub(super) fn heights_hash(case: &Case) -> Result<Option<String>> {
    let hash = |path: &PathBuf| StageKey::of_file(&case.resolve_path(path));
    let surface = &case.scene.surface;
    let own = surface.heights.as_ref().map(hash).transpose()?;
    let other = surface.other.as_ref().map(|o| hash(&o.heights)).transpose()?;
    Ok(own.map(|own| own + &other.unwrap_or_default()))
}
