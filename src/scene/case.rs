use super::atoms::LaboratoryProblem;
use super::check::{complaints, missing_files};
use super::given_units::GivenUnits;
use super::hardness::HardnessFile;
use super::model::relative_to;
use super::names::Keys;
use super::other_body::OtherFile;
use super::source::{self, ResolvedSurface};
use super::surface_file::{SurfaceFile, preparation_keys};
use super::{ALL_METHODS, AtomsCase, LaboratoryScene, Length, Scene, problem};
use crate::{Error, Result};
use asperity_atoms::lammps_command::LammpsCommand;
use asperity_contact::interface::{AttractionLaw, HardnessMap, SubsurfaceRequest};
use asperity_contact::load::{Load, LoadStep};
use asperity_contact::method::{ContactMethod, Heights, MethodCard, MethodKind, ReducedProblem};
use asperity_contact::problem::{
    Accuracy, Body, Field, Hardness, Loads, Names, Problem, ReducedModel, Reduction, StatedQuantity,
};
use asperity_contact::results::HardnessMapResults;
use asperity_grid::error::Complaint;
use asperity_grid::units::Scales;
use asperity_methods::REGISTRY;
use asperity_surface::provenance::Provenance;
use asperity_surface::{HeightSource, Spectrum, Surface};
use std::path::{Path, PathBuf};

/// A scene, checked and resolved: its problem, and the same in reduced numbers.
#[derive(Debug, Clone)]
pub struct Case {
    pub scene: Scene,
    /// The scene file, for messages and relative paths.
    pub file: PathBuf,
    /// The scene's scales, with the extents of the prepared cell.
    pub laboratory: LaboratoryScene,
    pub scales: Scales,
    pub problem: Problem,
    pub model: ReducedModel,
    /// rms gradient of the whole spectrum: p* is pressure over E* times this.
    pub gradient: f64,
    /// See [`Case::load_steps`].
    pub(crate) load_steps: Vec<LoadStep>,
    /// Of a hardness that is a map.
    pub hardness_map: Option<HardnessMapResults>,
    pub atoms: Option<AtomsCase>,
    /// How LAMMPS is started here; it overrules `atoms.program` and `atoms.ranks` of the scene.
    pub lammps: LammpsCommand,
    pub warnings: Vec<String>,
}

/// Tables of a scene, in the order of complaints about them.
const TABLES: [&str; 9] =
    ["name", "description", "laboratory", "surface", "load", "challenge", "adhesion", "continuum", "accuracy"];

/// Adds complaints, one for each key and what was found there.
fn add(list: &mut Vec<Complaint>, more: Vec<Complaint>) {
    for complaint in more {
        if list.iter().all(|c| (&c.key, &c.found) != (&complaint.key, &complaint.found)) {
            list.push(complaint);
        }
    }
    let table = |c: &Complaint| TABLES.iter().position(|t| c.key.starts_with(t)).unwrap_or(TABLES.len());
    list.sort_by_key(table);
}

/// What is wrong with the problem of a scene on whatever surface.
fn issues_on_any_surface(scene: &Scene) -> Vec<Complaint> {
    let surface = Surface::flat(scene.laboratory.length().si());
    let any = || HardnessMap::new(1, 1, vec![1.0]).expect("positive");
    let map = scene.continuum.hardness_map.as_ref().map(|_| Hardness::from(any()));
    let mut list = problem::problem(scene, &scene.laboratory, surface, map).issues(&scene.load.loads(), &Keys(scene));
    // The modulus of bodies is positive unless one of them is refused.
    let of_bodies = scene.laboratory.modulus.is_none() && !scene.laboratory.bodies.is_empty();
    list.retain(|c| !of_bodies || c.key != Keys(scene).name(Field::Modulus));
    list
}

impl Case {
    /// Reads, checks and resolves a scene file.
    pub fn read(file: &Path) -> Result<Case> {
        Self::resolve(Scene::read(file)?, file)
    }

    /// `file` is named in messages and is what relative paths are relative to.
    pub fn resolve(mut scene: Scene, file: &Path) -> Result<Case> {
        let place = file.display().to_string();
        let mut list = missing_files(&scene, file);
        let missing = list.len();
        // A wrong key may be the reason.
        let is_wrong = || missing + complaints(&scene).len() + issues_on_any_surface(&scene).len() > 0;
        let mut source = match SurfaceFile::read(&scene.surface, file) {
            Err(_) if is_wrong() => None,
            read => read?,
        };
        let mut other = match OtherFile::read(&scene, file) {
            Err(_) if is_wrong() => None,
            read => read?,
        };
        // What the files do not declare is reported together with everything else.
        let mut undeclared: Vec<Complaint> = source.iter_mut().flat_map(|s| s.complete(&mut scene)).collect();
        undeclared.extend(other.iter_mut().flat_map(|o| o.complete(&scene, source.as_ref())));
        // What the file declares is checked as what is given.
        add(&mut list, complaints(&scene));
        add(&mut list, undeclared);
        let keys = Keys(&scene);
        if !list.is_empty() {
            add(&mut list, issues_on_any_surface(&scene));
            return Err(Error::Input { place, list });
        }
        let ResolvedSurface { surface, laboratory, warnings } = source::resolve(&scene, source, other, &place)?;
        let map = HardnessFile::read(&scene.continuum, &laboratory, surface.grid(), file)?;
        let (map, about) = map.map_or((None, None), |f| (Some(Hardness::from(f.map)), Some((f.path, f.hash))));
        let problem = problem::problem(&scene, &laboratory, surface, map);
        add(&mut list, problem.issues(&scene.load.loads(), &keys));
        if let Some(accuracy) = scene.accuracy() {
            add(&mut list, accuracy.issues(&problem, &scene.load.loads(), scene.continuum.leakage, &keys));
            if scene.continuum.initial_gap.is_some() {
                let accepted = "none with accuracy.error, which solves on several grids";
                list.push(Complaint::new("continuum.initial_gap", "given", accepted));
            }
        }
        if !list.is_empty() {
            return Err(Error::Input { place, list });
        }
        let gradient = gradient(&scene, &problem, &place)?;
        let reduction = problem.reduced(&scene.load.loads(), gradient, (&place, &keys))?;
        let hardness_map = about.map(|(path, hash)| {
            let (lowest, highest) = match &reduction.model.hardness {
                Some(Hardness::Map(map)) => map.extent(),
                _ => unreachable!("a map stays one"),
            };
            HardnessMapResults { file: path.display().to_string(), hash, lowest, highest }
        });
        let mut case = Case {
            scales: laboratory.scales(),
            laboratory,
            load_steps: Vec::new(),
            model: reduction.model.clone(),
            gradient,
            problem,
            hardness_map,
            scene,
            file: file.to_path_buf(),
            atoms: None,
            lammps: LammpsCommand::default(),
            warnings,
        };
        case.warn(&reduction)?;
        case.load_steps = reduction.steps;
        case.mark_maps();
        case.resolve_atoms()?;
        Ok(case)
    }

    /// The same case on other nodes of its surface, with the tolerance that an accuracy needs there. `coarsest`: see
    /// [`Problem::on_nodes`].
    ///
    /// # Errors
    /// `Input`, where a number over- or underflows on this grid; those of the atoms.
    pub fn on_nodes(&self, nodes: [usize; 2], coarsest: &Surface, accuracy: &Accuracy) -> Result<Case> {
        let (loads, place) = (self.scene.load.loads(), self.file.display().to_string());
        let reduced = |problem: &Problem| problem.reduced(&loads, self.gradient, (&place, &Keys(&self.scene)));
        // What is doubtful about a map is so on all its grids.
        let is_map = matches!(self.surface(), HeightSource::Imported { .. });
        let warnings = |problem: &Problem, reduction: &Reduction| {
            let of_surface = if is_map { Vec::new() } else { problem.surface_warnings(reduction) };
            let of_surface = of_surface.iter().map(|text| preparation_keys(text));
            of_surface.chain(problem.load_warnings(reduction, &self.given_units())).collect::<Vec<_>>()
        };
        let mut problem = self.problem.on_nodes(nodes, coarsest);
        problem.tolerance = self.problem.tolerance.or(Some(accuracy.tolerance(&problem)));
        let (before, reduction) = (reduced(&self.problem)?, reduced(&problem)?);
        let [mut old, new] = [(&self.problem, &before), (&problem, &reduction)].map(|(p, r)| warnings(p, r));
        let of_atoms =
            |atoms: &AtomsCase| atoms.warnings(self.gradient, self.scene.atoms.as_ref().map_or(1, |a| a.ranks));
        old.extend(self.atoms.iter().flat_map(of_atoms));
        let kept = self.warnings.iter().filter(|text| !old.contains(text)).cloned();
        let mut case = Case {
            problem,
            model: reduction.model,
            load_steps: reduction.steps,
            warnings: kept.chain(new).collect(),
            ..self.clone()
        };
        case.mark_maps();
        if case.atoms.is_some() {
            case.resolve_atoms()?;
        }
        Ok(case)
    }

    /// Grid and tolerance of a case that [`Case::on_nodes`] made; others have those of the scene.
    pub fn solved_grid(&self) -> Option<([usize; 2], f64)> {
        let (grid, tolerance) = (self.model.grid, self.model.tolerance);
        self.scene.accuracy().map(|_| ([grid.nx, grid.ny], tolerance))
    }

    /// Collects what is doubtful.
    ///
    /// # Errors
    /// `Input` with the warnings about the surface, if the scene says so.
    fn warn(&mut self, reduction: &Reduction) -> Result<()> {
        let of_surface = self.problem.surface_warnings(reduction);
        self.warnings.extend(of_surface.iter().map(|text| preparation_keys(text)));
        // Another grid than that of the scene may be the result.
        let settled = self.scene.accuracy().is_none() || matches!(self.surface(), HeightSource::Imported { .. });
        if self.scene.surface.strict && settled && !self.warnings.is_empty() {
            let accepted = "a surface without this warning, or surface.strict = false";
            let complaint = |w: &String| Complaint::new("surface.strict", format!("true, but {w}"), accepted);
            let list = self.warnings.iter().map(complaint).collect();
            return Err(Error::Input { place: self.file.display().to_string(), list });
        }
        self.warnings.extend(self.problem.load_warnings(reduction, &self.given_units()));
        Ok(())
    }

    /// Marks the steps whose maps the scene requests.
    fn mark_maps(&mut self) {
        let load = &self.scene.load;
        if let Some(list) = &load.maps_at {
            let stored: Vec<usize> = list.iter().flat_map(|p| load.indices_of(*p)).collect();
            self.load_steps.iter_mut().for_each(|step| step.maps = stored.contains(&step.index));
        }
    }

    fn resolve_atoms(&mut self) -> Result<()> {
        let Some(atoms) = &self.scene.atoms else { return Ok(()) };
        let ranks = atoms.ranks;
        let resolved = AtomsCase::resolve(&LaboratoryProblem {
            scene: &self.scene,
            file: &self.file,
            surface: self.surface(),
            grid: self.model.grid,
            gradient: self.gradient,
            adhesion: self.model.adhesion,
            highest_p_star: self.highest_p_star(),
        })?;
        self.warnings.extend(resolved.warnings(self.gradient, ranks));
        self.atoms = Some(resolved);
        Ok(())
    }

    /// How messages of solvers write numbers of this scene.
    pub fn given_units(&self) -> GivenUnits {
        GivenUnits::of(&self.scene, self.scales)
    }

    /// Where the heights come from.
    pub fn surface(&self) -> &HeightSource {
        self.problem.surface.source()
    }

    /// Of an imported surface.
    pub fn provenance(&self) -> Option<&Provenance> {
        self.problem.surface.provenance()
    }

    /// Whether the surface is a non-periodic map. A synthesised surface is periodic even on a non-periodic half-space.
    pub fn is_non_periodic(&self) -> bool {
        !self.scene.continuum.is_periodic() && matches!(self.surface(), HeightSource::Imported { .. })
    }

    /// The load path, the unloading branch of a closed path included.
    pub fn load_steps(&self) -> &[LoadStep] {
        &self.load_steps
    }

    /// The load path without the unloading branch of a closed one.
    pub fn loading_steps(&self) -> &[LoadStep] {
        &self.load_steps[..self.scene.load.loads().loading_count()]
    }

    /// The unloading branch of a closed load path.
    pub fn unloading_steps(&self) -> &[LoadStep] {
        &self.load_steps[self.scene.load.loads().loading_count()..]
    }

    /// The loading steps as atoms are given them: rising, one of each load.
    pub fn rising_steps(&self) -> Vec<&LoadStep> {
        let p_star = |s: &LoadStep| s.imposed_p_star();
        let mut steps: Vec<&LoadStep> = self.loading_steps().iter().collect();
        steps.dedup_by(|a, b| p_star(a) == p_star(b));
        steps
    }

    /// p* of the loading steps; empty where the mean gap is imposed.
    pub fn loading_p_star(&self) -> Vec<f64> {
        self.loading_steps().iter().filter_map(|s| s.p_star).collect()
    }

    /// Whether a mean gap is imposed.
    pub fn imposes_gaps(&self) -> bool {
        self.load_steps.iter().any(|step| matches!(step.target, Load::MeanGap(_)))
    }

    /// Highest p* of the load path, at least 0.
    pub fn highest_p_star(&self) -> f64 {
        self.load_steps.iter().filter_map(|s| s.p_star).fold(0.0, f64::max)
    }

    /// Whether the loads are solved without the scene's adhesion, too: on request, or as the reference of a compared method without
    /// adhesion.
    pub fn solves_nonadhesive(&self) -> bool {
        let attracts = self.scene.adhesion.is_some();
        self.solves_all_nonadhesive()
            || attracts && self.comparison_methods().iter().any(|m| !m.card().supports_adhesion())
    }

    /// Whether every method repeats the loads without the scene's adhesion.
    pub fn solves_all_nonadhesive(&self) -> bool {
        self.scene.challenge.is_some() || self.scene.adhesion.as_ref().is_some_and(|a| a.also_nonadhesive)
    }

    /// Whether the scene's own method is a solver. An estimate runs as the compared methods do.
    pub fn solves(&self) -> bool {
        self.method().kind == MethodKind::Solver
    }

    /// Whether the matched continuum is solved on a half-space, too: on request, or to judge the depth of the block against targets of area or
    /// mean gap. A layer is no half-space.
    pub fn judges_depth(&self) -> bool {
        let on_request = self.scene.atoms.as_ref().is_some_and(|a| a.depth_error);
        (on_request || self.has_target_of_depth()) && !matches!(self.problem.body, Body::Layer { .. })
    }

    /// Whether the accuracy has targets of quantities that the depth of the atoms' block changes: contact area and mean gap.
    pub fn has_target_of_depth(&self) -> bool {
        let judged = [StatedQuantity::ContactArea, StatedQuantity::MeanGap];
        self.scene.accuracy().is_some_and(|a| judged.iter().any(|q| a.errors.of(*q).is_some()))
    }

    /// Card of the scene's own method.
    pub fn method(&self) -> &'static MethodCard {
        asperity_methods::find(&self.scene.continuum.method).expect("checked with the scene").card()
    }

    /// Methods that are compared with the scene's own at the same loads, in the order of the registry.
    pub fn comparison_methods(&self) -> Vec<&'static dyn ContactMethod> {
        let (own, also) = (self.method().id, &self.scene.continuum.compare_with);
        let is_named = |id: &str| also.iter().any(|a| asperity_methods::find(a).is_some_and(|m| m.card().id == id));
        // "all" are those that model what the scene contains.
        let models = |card: &MethodCard| self.problem.hardness.is_none() || card.capabilities.hardness;
        let is_of_all = |card: &MethodCard| also.iter().any(|a| a == ALL_METHODS) && models(card);
        let runs = |card: &MethodCard| {
            if card.id == own { !self.solves() && models(card) } else { is_named(card.id) || is_of_all(card) }
        };
        REGISTRY.iter().copied().filter(|m| runs(m.card())).collect()
    }

    /// The scene's adhesion with another range.
    pub fn adhesion_of_range(&self, range: Length) -> AttractionLaw {
        let Scales { length_m, modulus_pa } = self.scales;
        let law = self.scene.adhesion.as_ref().map(|a| problem::adhesion(a, range));
        law.map_or(AttractionLaw::None, |law| law.reduced(length_m, modulus_pa))
    }

    /// The laboratory-scale problem on the scene's grid, with the scene's own range of adhesion.
    pub fn problem<'a>(&'a self, heights: Heights<'a>) -> ReducedProblem<'a> {
        self.model.problem(heights)
    }

    /// The same for a plan, before the heights are made.
    pub fn planned_problem(&self) -> ReducedProblem<'_> {
        self.problem(Heights::Planned(self.surface().series_bytes()))
    }

    /// Imposes these pressures (E*) in place of the contact areas of the scene.
    pub fn impose_pressures(&mut self, pressures: &[f64]) {
        let modulus = self.laboratory.modulus();
        self.scene.load.contact = Vec::new();
        self.scene.load.pressure = pressures.iter().map(|p| modulus.with(p * modulus.value())).collect();
        let path = Loads { values: pressures.to_vec(), ..self.scene.load.loads() }.path();
        for (step, pressure) in self.load_steps.iter_mut().zip(path) {
            step.impose(pressure, self.gradient);
        }
    }

    /// What is computed below the surface, if it is requested.
    pub fn subsurface(&self) -> Option<SubsurfaceRequest> {
        let (s, lab) = (self.scene.continuum.subsurface.as_ref()?, &self.laboratory);
        Some(SubsurfaceRequest {
            depths: s.depths.iter().map(|d| lab.reduced(*d).min(self.model.kernel.thickness())).collect(),
            // Of a layer its own.
            poisson: s.poisson.unwrap_or_default(),
            shear_strength: s.shear_strength.map(|t| lab.reduced_stress(t)),
        })
    }

    /// The scene with its paths made absolute, so that it means the same wherever it is read from.
    pub fn portable_scene(&self) -> Scene {
        let absolute = |p: &Path| std::path::absolute(self.resolve_path(p)).unwrap_or_else(|_| self.resolve_path(p));
        let mut scene = self.scene.clone();
        scene.inputs_mut().into_iter().for_each(|(_, path)| *path = absolute(path));
        if let Some(atoms) = &mut scene.atoms {
            // A bare name is looked for on the search path.
            atoms.program =
                atoms.program.as_ref().map(|p| if p.components().count() > 1 { absolute(p) } else { p.clone() });
        }
        scene
    }

    /// How LAMMPS is started: as the scene says, unless `self.lammps` says otherwise.
    pub fn lammps_command(&self) -> LammpsCommand {
        self.scene.lammps_command(&self.file, &self.lammps)
    }

    /// MPI ranks of LAMMPS.
    pub fn ranks(&self) -> usize {
        self.lammps_command().ranks.unwrap_or(1)
    }

    /// Path as the scene file means it.
    pub fn resolve_path(&self, path: &Path) -> PathBuf {
        relative_to(&self.file, path)
    }
}

/// rms gradient of the whole spectrum, of which p* is a multiple.
///
/// # Errors
/// `Input` for a flat surface. In consistent units nothing is given or reported as p*.
fn gradient(scene: &Scene, problem: &Problem, place: &str) -> Result<f64> {
    let gradient = problem.gradient();
    if gradient == 0.0 && !scene.laboratory.is_plain() {
        let accepted = "a rough surface: p* is pressure over E* times rms gradient";
        let key = Keys(scene).name(scene.load.loads().kind.field());
        return Err(Error::input(place, key, "a flat surface, rms gradient 0", accepted));
    }
    // A coarse file of the challenge's surface lacks gradient, not load.
    Ok(if scene.challenge.is_some() { Spectrum::CHALLENGE.rms_gradient } else { gradient })
}
