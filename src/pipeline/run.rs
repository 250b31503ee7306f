//! Execution of a run: the stages of a case in order, and the files of the run folder.

use super::atom_stages::{AtomStages, CompareStage, FramesStage, LAMMPS, LammpsStage};
use super::comparison::compare;
use super::curve;
use super::findings::few_contact_atoms;
use super::folder::{AS_WRITTEN, OutFolder, RunFolder, StageKey};
use super::laboratory::{SolveStage, SolvedHeights, Variant, variants};
use super::matched::Matched;
use super::methods::{self, MethodStage};
use super::run_files::{Manifest, RECORDING_FILE, record, sources};
use super::stage::Stage;
use super::surface::SurfaceStage;
use super::{Listener, engine};
use crate::record::methods::MethodResults;
use crate::record::results::{self, ComparisonResults, MANIFEST_FILE, Results, SCHEMA, ScalesSi, SurfaceResults};
use crate::record::{load_table, netcdf, tradeoff};
use crate::report::number::trimmed;
use crate::scene::{AtomsScene, Case, Scene};
use crate::{Error, Result, challenge, report};
use asperity_atoms::results::AtomsResults;
use asperity_contact::method::Device;
use asperity_contact::path::unresolved_contact;
use asperity_contact::results::ContinuumResults;
use asperity_surface::files::atomic_file::write_atomic;
use asperity_surface::files::{hashed, json};
use std::path::{Path, PathBuf};

/// The scene of a run, in its folder.
const SCENE_FILE: &str = "scene.toml";

/// Files of a run or a benchmark outside its stages.
const OUTSIDE_STAGES: [&str; 10] = [
    SCENE_FILE,
    results::FILE,
    load_table::FILE,
    load_table::PULL_OFF_FILE,
    MANIFEST_FILE,
    netcdf::run::FILE,
    RECORDING_FILE,
    tradeoff::FILE,
    tradeoff::CSV_FILE,
    report::PAGE,
];

/// Folder of the comparison of atoms and continuum.
const COMPARE: &str = "compare";

/// Runs all stages of a case in a folder, and writes results and report. Returns the results and the path of the
/// report.
///
/// # Errors
/// `MissingProgram` and `Memory` before anything is written; errors of the stages.
pub fn run<'a>(case: &Case, out: impl Into<OutFolder<'a>>, listener: &dyn Listener) -> Result<(Results, PathBuf)> {
    let out = out.into();
    // LAMMPS is looked up first: a missing program then costs no computing time and leaves no folder.
    let engine = case.atoms.as_ref().map(|_| engine(case)).transpose()?;
    if case.solves() {
        Device::check(&case.problem((&[][..]).into()), case.method())?;
    }
    super::plan(case, rayon::current_num_threads(), None)?.fits()?;
    let folder = RunFolder::open(out)?;
    let out = out.path;
    case.warnings.iter().for_each(|w| listener.warn(w));
    keep_scene(case, out, listener)?;
    // The key of the geometry does not depend on the executable, so LAMMPS steps remain valid after a new build; other
    // results do not. The job folder determines which of its steps are valid.
    let geometry = StageKey::new("geometry", &(&case.scene.laboratory, &case.scene.surface, heights_hash(case)?), &[])?;
    let mut run = Running { case, listener, folder, geometry, warnings: case.warnings.clone(), failures: Vec::new() };
    let (surface, surface_key) = run.execute(&SurfaceStage { case }, &[&run.geometry.clone()], ())?;
    let mut laboratory = run.laboratory(&surface, &surface_key, out)?;
    let atoms = AtomStages::of(case, engine.as_ref());
    let atoms = atoms.map(|stages| run.atoms(stages, &surface_key, out)).transpose()?;
    let (atoms, comparison, all_atom) = atoms.map_or((None, None, None), |(a, c, m)| (Some(a), Some(c), m));
    laboratory.methods.extend(all_atom);
    let mut results = Results {
        schema: SCHEMA,
        name: case.scene.name.clone(),
        description: case.scene.description.clone(),
        scales: ScalesSi { length_m: case.scales.length_m, modulus_pa: case.scales.modulus_pa },
        surface,
        continuum: laboratory.primary,
        non_adhesive: laboratory.non_adhesive,
        other_ranges: laboratory.other_ranges,
        cross_check: laboratory.cross_check,
        methods: laboratory.methods,
        failures: run.failures,
        acceptance: Vec::new(),
        atoms,
        comparison,
        stages: run.folder.costs.clone(),
        warnings: run.warnings,
        sources: sources(case),
    };
    if case.scene.challenge.is_some() {
        results.acceptance = challenge::assess(&results);
    }
    results.write(out)?;
    curve::write(out, &results)?;
    json::write(&out.join(MANIFEST_FILE), &Manifest::of(case, &results, engine.as_ref().map(|e| e.describe())))?;
    netcdf::run::write_run(out, &results)?;
    record(case, &results, out)?;
    let page = report::write(out)?;
    list_files(out)?;
    Ok((results, page))
}

/// Writes the hashes of the files outside the stages.
pub(super) fn list_files(out: &Path) -> Result<()> {
    hashed::write_checksums(out, &OUTSIDE_STAGES)
}

/// State of a run.
struct Running<'a> {
    case: &'a Case,
    listener: &'a dyn Listener,
    folder: RunFolder,
    /// Key of the surface's heights, independent of the requested statistics.
    geometry: StageKey,
    warnings: Vec<String>,
    failures: Vec<String>,
}

/// Results at laboratory scale.
#[derive(Default)]
struct LaboratoryOutputs {
    primary: Option<ContinuumResults>,
    non_adhesive: Option<ContinuumResults>,
    other_ranges: Vec<ContinuumResults>,
    cross_check: Option<ContinuumResults>,
    methods: Vec<MethodResults>,
}

impl Running<'_> {
    fn execute<S: Stage>(
        &mut self,
        stage: &S,
        dependencies: &[&StageKey],
        input: S::Input<'_>,
    ) -> Result<(S::Output, StageKey)> {
        self.folder.execute(stage, dependencies, input, self.listener)
    }

    fn warn(&mut self, text: String) {
        self.listener.warn(&text);
        self.warnings.push(text);
    }

    /// Solves the scene's problem and its variants, and runs the comparison methods.
    fn laboratory(
        &mut self,
        surface: &SurfaceResults,
        surface_key: &StageKey,
        out: &Path,
    ) -> Result<LaboratoryOutputs> {
        let case = self.case;
        let heights = SolvedHeights::new(case, out, surface);
        let mut laboratory = LaboratoryOutputs::default();
        if case.solves() {
            let stage = SolveStage { case, variant: Variant::Primary };
            let solved = self.execute(&stage, &[surface_key], &heights)?.0;
            let loads = solved.states.iter().map(|s| (trimmed(s.p_star, 4), s.contact_area, s.discretisation.as_ref()));
            unresolved_contact("p* = ", loads).into_iter().for_each(|text| self.warn(text));
            laboratory.primary = Some(solved);
        }
        let (variants, left_out) = variants(case);
        left_out.into_iter().for_each(|text| self.warn(text));
        for stage in variants {
            let solved = match self.execute(&stage, &[surface_key], &heights) {
                Ok((solved, _)) => solved,
                // A variant without convergence does not invalidate the solution of the scene's own problem.
                Err(e @ Error::NotConverged { .. }) => {
                    let failure = format!("{}: {e}", stage.label());
                    self.failures.push(failure.clone());
                    self.warn(failure);
                    continue;
                }
                Err(e) => return Err(e),
            };
            match stage.variant {
                Variant::NonAdhesive => laboratory.non_adhesive = Some(solved),
                Variant::Range(_) => laboratory.other_ranges.push(solved),
                Variant::CrossCheck => laboratory.cross_check = Some(solved),
                Variant::Primary | Variant::Comparison(..) => {}
            }
        }
        for method_run in methods::all(case) {
            laboratory.methods.push(self.execute(&MethodStage { case, of: method_run }, &[surface_key], &heights)?.0);
        }
        Ok(laboratory)
    }

    /// Runs the atoms, and compares them with the matched continuum. If requested, lists the atoms among the comparison
    /// methods.
    fn atoms(
        &mut self,
        stages: AtomStages,
        surface_key: &StageKey,
        out: &Path,
    ) -> Result<(AtomsResults, ComparisonResults, Option<MethodResults>)> {
        let (mut matched, matched_key) = self.execute(&stages.matched(), &[surface_key], ())?;
        let geometry = self.geometry.clone();
        let (outcome, lammps_key) = self.execute(&LammpsStage(stages), &[&geometry, &matched_key], (&matched, out))?;
        for step in &outcome.unconverged {
            self.warn(format!(
                "load step {step} of the atoms stopped above the force tolerance or off its load; states taken from it are not equilibria"
            ));
        }
        let (mut results, atoms_key) = self.execute(&FramesStage(stages), &[&lammps_key], (&outcome, out))?;
        if let Some(stage) = stages.nvt() {
            results.nvt = Some(self.execute(&stage, &[&lammps_key], out)?.0);
        }
        few_contact_atoms(&results.states).into_iter().for_each(|text| self.warn(text));
        let mut dependencies = vec![matched_key, atoms_key.clone()];
        if let Some(stage) = stages.yielding() {
            let (yielding, key) = self.execute(&stage, &[&dependencies[0]], ())?;
            matched.yielding = yielding;
            dependencies.push(key);
        }
        let dependencies: Vec<&StageKey> = dependencies.iter().collect();
        let (compared, _) = self.execute(&CompareStage(stages), &dependencies, (&results, &matched, out))?;
        let Some(stage) = stages.all_atom() else { return Ok((results, compared, None)) };
        let seconds = self.folder.costs.iter().filter(|c| c.name == LAMMPS).map(|c| c.seconds).sum();
        let (all_atom, _) = self.execute(&stage, &[&atoms_key], (&results, seconds, out))?;
        Ok((results, compared, Some(all_atom)))
    }
}

/// What differs between the scene whose results are in a folder and this one, in words; `None` if there is no difference or there are no
/// results.
pub fn other_scene(case: &Case, out: &Path) -> Option<String> {
    // A damaged scene says nothing about the results; the run writes it again.
    if !out.join(results::FILE).exists() || !hashed::changed(out, &[SCENE_FILE]).is_empty() {
        return None;
    }
    let earlier = Scene::read(&out.join(SCENE_FILE)).ok()?;
    let values = [&earlier, &case.portable_scene()].map(of_results);
    Some(json::differences(&values[0], &values[1])).filter(|text| !text.is_empty())
}

/// The keys of a scene on which its results depend: all but those of the machine.
fn of_results(scene: &Scene) -> serde_json::Value {
    let mut scene = scene.clone();
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
    if std::fs::read_to_string(&file).is_ok_and(|earlier| earlier == text) {
        return Ok(());
    }
    let results = [results::FILE, MANIFEST_FILE, netcdf::run::FILE, RECORDING_FILE, report::PAGE];
    for name in [hashed::CHECKSUMS].into_iter().chain(results) {
        let path = out.join(name);
        match std::fs::remove_file(&path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(Error::io("remove", &path)(e)),
            _ => {}
        }
    }
    write_atomic(&file, |w| std::io::Write::write_all(w, text.as_bytes()))
}

/// Repeats the comparison from the stored results of a run folder, without new solutions, and writes results and
/// report.
pub fn rebuild_comparison(out: &Path) -> Result<(Results, PathBuf)> {
    let (mut results, folder) = checked(out)?;
    let case = Case::read(&out.join(SCENE_FILE))?;
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
    let has = |file: &str| out.join(file).exists();
    if has(crate::record::ensemble::FILE) && !has(results::FILE) {
        return report::write_with(out, options);
    }
    if has(tradeoff::FILE) && !has(results::FILE) {
        unchanged(out, &[tradeoff::FILE, SCENE_FILE])?;
        let page = report::write_with(out, options)?;
        list_files(out)?;
        return Ok(page);
    }
    let _locked = checked(out)?;
    let page = report::write_with(out, options)?;
    list_files(out)?;
    Ok(page)
}

/// Refuses a folder in which one of `names` differs from the hash that the run wrote.
fn unchanged(out: &Path, names: &[&str]) -> Result<()> {
    match hashed::changed(out, names).first() {
        Some(name) => Err(Error::format(out.join(name), "changed since the run wrote it", AS_WRITTEN)),
        None => Ok(()),
    }
}

/// Reads the results of a finished run folder, whose files are as they were written, and locks it.
///
/// # Errors
/// `Format`, which names the file and the remedy; `Io`.
fn checked(out: &Path) -> Result<(Results, RunFolder)> {
    unchanged(out, &[results::FILE, SCENE_FILE])?;
    // Before the lock, which leaves a file: a folder without results is none of ours.
    let results = Results::read(out)?;
    let folder = RunFolder::lock(out)?;
    folder.check()?;
    Ok((results, folder))
}

pub(super) fn heights_hash(case: &Case) -> Result<Option<String>> {
    case.scene.surface.heights.as_ref().map(|p| StageKey::of_file(&case.resolve_path(p))).transpose()
}
