//! Execution of a run: the stages of a case in order, and the files of the run folder.

use super::atom_stages::{AtomStages, CompareStage, FramesStage, LAMMPS, LammpsStage};
use super::comparison::compare;
use super::folder::{Key, RunFolder};
use super::laboratory::{SolveStage, SolvedHeights, Variant, variants};
use super::matched::Matched;
use super::methods::{self, MethodStage};
use super::run_files::{Manifest, RECORDING_FILE, record, sources};
use super::stage::Stage;
use super::surface::SurfaceStage;
use super::{Listener, engine};
use crate::atoms::engine::Engine;
use crate::record::atomic_file::write_atomic;
use crate::record::methods::MethodResults;
use crate::record::results::{
    self, AtomsResults, ComparisonResults, ContinuumResults, MANIFEST_FILE, Results, SCHEMA, ScalesSi, SurfaceResults,
};
use crate::record::{json, netcdf};
use crate::scene::Case;
use crate::{Error, Result, challenge, report};
use std::path::{Path, PathBuf};

/// Folder of the comparison of atoms and continuum.
const COMPARE: &str = "compare";

/// Runs all stages of a case in a folder, and writes results and report. Returns the results and the path of the
/// report.
///
/// # Errors
/// `MissingProgram` and `Memory` before anything is written; errors of the stages.
pub fn run(case: &Case, out: &Path, listener: &dyn Listener) -> Result<(Results, PathBuf)> {
    // LAMMPS is looked up first: a missing program then costs no computing time and leaves no folder.
    let engine = case.atoms.as_ref().map(|_| engine(case)).transpose()?;
    super::plan(case, rayon::current_num_threads(), None)?.fits()?;
    let folder = RunFolder::open(out)?;
    case.warnings.iter().for_each(|w| listener.warn(w));
    keep_scene(case, out)?;
    // The key of the geometry does not depend on the executable, so LAMMPS steps remain valid after a new build; other
    // results do not. The job folder determines which of its steps are valid.
    let geometry = Key::new("geometry", &(&case.scene.laboratory, &case.scene.surface, heights_hash(case)?), &[])?;
    let mut run = Running { case, listener, folder, geometry, warnings: case.warnings.clone(), failures: Vec::new() };
    let (surface, surface_key) = run.execute(&SurfaceStage { case }, &[&run.geometry.clone()], ())?;
    let mut found = run.laboratory(&surface, &surface_key, out)?;
    let atoms = AtomStages::of(case, engine.as_ref().map(|e| e as &dyn Engine));
    let atoms = atoms.map(|stages| run.atoms(stages, &surface_key, out)).transpose()?;
    let (atoms, comparison, all_atom) = atoms.map_or((None, None, None), |(a, c, m)| (Some(a), Some(c), m));
    found.methods.extend(all_atom);
    let mut results = Results {
        schema: SCHEMA,
        name: case.scene.name.clone(),
        description: case.scene.description.clone(),
        scales: ScalesSi { length_m: case.scales.length_m, modulus_pa: case.scales.modulus_pa },
        surface,
        accuracy: case.chosen.clone(),
        continuum: found.primary,
        non_adhesive: found.non_adhesive,
        other_ranges: found.other_ranges,
        cross_check: found.cross_check,
        methods: found.methods,
        failures: run.failures,
        acceptance: Vec::new(),
        atoms,
        comparison,
        stages: run.folder.costs.clone(),
        warnings: run.warnings,
        sources: sources(case),
    };
    if case.scene.challenge.is_some() {
        results.acceptance = challenge::judge(&results);
    }
    results.write(out)?;
    json::write(&out.join(MANIFEST_FILE), &Manifest::of(case, &results, engine.as_ref().map(|e| e.describe())))?;
    netcdf::run::write_run(out, &results)?;
    record(case, &results, out)?;
    let page = report::write(out)?;
    Ok((results, page))
}

/// State of a run.
struct Running<'a> {
    case: &'a Case,
    listener: &'a dyn Listener,
    folder: RunFolder,
    /// Key of the surface's heights, independent of the requested statistics.
    geometry: Key,
    warnings: Vec<String>,
    failures: Vec<String>,
}

/// Results at laboratory scale.
#[derive(Default)]
struct Laboratory {
    primary: Option<ContinuumResults>,
    non_adhesive: Option<ContinuumResults>,
    other_ranges: Vec<ContinuumResults>,
    cross_check: Option<ContinuumResults>,
    methods: Vec<MethodResults>,
}

impl Running<'_> {
    fn execute<S: Stage>(&mut self, stage: &S, after: &[&Key], input: S::Input<'_>) -> Result<(S::Output, Key)> {
        self.folder.execute(stage, after, input, self.listener)
    }

    fn warn(&mut self, text: String) {
        self.listener.warn(&text);
        self.warnings.push(text);
    }

    /// Solves the scene's problem and its variants, and runs the comparison methods.
    fn laboratory(&mut self, surface: &SurfaceResults, surface_key: &Key, out: &Path) -> Result<Laboratory> {
        let case = self.case;
        let heights = SolvedHeights::new(case, out, surface);
        let mut found = Laboratory::default();
        if case.solves() {
            let stage = SolveStage { case, variant: Variant::Primary };
            found.primary = Some(self.execute(&stage, &[surface_key], &heights)?.0);
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
                Variant::NonAdhesive => found.non_adhesive = Some(solved),
                Variant::Range(_) => found.other_ranges.push(solved),
                Variant::CrossCheck => found.cross_check = Some(solved),
                Variant::Primary | Variant::Comparison(..) => {}
            }
        }
        for of in methods::all(case) {
            found.methods.push(self.execute(&MethodStage { case, of }, &[surface_key], &heights)?.0);
        }
        Ok(found)
    }

    /// Runs the atoms, and compares them with the matched continuum. If requested, lists the atoms among the comparison
    /// methods.
    fn atoms(
        &mut self,
        stages: AtomStages,
        surface_key: &Key,
        out: &Path,
    ) -> Result<(AtomsResults, ComparisonResults, Option<MethodResults>)> {
        let (matched, matched_key) = self.execute(&stages.matched(), &[surface_key], ())?;
        let geometry = self.geometry.clone();
        let (outcome, lammps_key) = self.execute(&LammpsStage(stages), &[&geometry, &matched_key], (&matched, out))?;
        for step in &outcome.unconverged {
            self.warn(format!(
                "load step {step} of the atoms stopped above the force tolerance or off its load; states taken from it are not equilibria"
            ));
        }
        let (mut found, atoms_key) = self.execute(&FramesStage(stages), &[&lammps_key], (&outcome, out))?;
        if let Some(stage) = stages.nvt() {
            found.nvt = Some(self.execute(&stage, &[&lammps_key], out)?.0);
        }
        let (compared, _) =
            self.execute(&CompareStage(stages), &[&matched_key, &atoms_key], (&found, &matched, out))?;
        let Some(stage) = stages.all_atom() else { return Ok((found, compared, None)) };
        let seconds = self.folder.costs.iter().filter(|c| c.name == LAMMPS).map(|c| c.seconds).sum();
        let (all_atom, _) = self.execute(&stage, &[&atoms_key], (&found, seconds, out))?;
        Ok((found, compared, Some(all_atom)))
    }
}

/// Writes the scene into the run folder. Removes the results of a different scene, which `report` and `compare` would
/// read as those of this one.
pub(super) fn keep_scene(case: &Case, out: &Path) -> Result<()> {
    let text = toml::to_string_pretty(&case.portable_scene())
        .map_err(|e| Error::format("scene", e, "a scene that TOML can hold"))?;
    let file = out.join("scene.toml");
    if std::fs::read_to_string(&file).is_ok_and(|earlier| earlier == text) {
        return Ok(());
    }
    for name in [results::FILE, MANIFEST_FILE, netcdf::run::FILE, RECORDING_FILE, report::PAGE] {
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
    let mut results = Results::read(out)?;
    let _locked = RunFolder::lock(out)?;
    let case = Case::read(&out.join("scene.toml"))?;
    let lacking = || Error::format(out, "a run without atoms", "the folder of a run whose scene has [atoms]");
    let (a, found) = case.atoms.as_ref().zip(results.atoms.as_ref()).ok_or_else(lacking)?;
    let earlier = results.comparison.as_ref().ok_or_else(lacking)?;
    let matched = Matched {
        full: earlier.full_heights.clone(),
        hard: earlier.hard_wall.clone(),
        soft: earlier.compliant_wall.clone(),
    };
    results.comparison = Some(compare(&case, a, found, &matched, out, COMPARE)?);
    results.write(out)?;
    let page = report::write(out)?;
    Ok((results, page))
}

pub(super) fn heights_hash(case: &Case) -> Result<Option<String>> {
    case.scene.surface.heights.as_ref().map(|p| Key::of_file(&case.resolve_path(p))).transpose()
}
