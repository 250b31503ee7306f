use super::atoms::LaboratoryProblem;
use super::check::{complaints, missing_files};
use super::model::relative_to;
use super::source::ResolvedSurface;
use super::surface_file::{SurfaceFile, preparation_keys, rounded};
use super::{ALL_METHODS, AdhesionScene, AtomsCase, CaseHardness, HeightSource, LaboratoryScene, Length, Scene};
use crate::{Error, Result};
use asperity_atoms::lammps_command::LammpsCommand;
use asperity_contact::interface::{
    AttractionLaw, Elastic, Law, Layer, NonPeriodic, PenaltyWall, RangeChoice, SubsurfaceRequest, Wall,
};
use asperity_contact::load::{Load, LoadStep};
use asperity_contact::method::{ContactMethod, Heights, MethodCard, MethodKind, ReducedProblem};
use asperity_contact::path::estimated_p_star;
use asperity_grid::Grid;
use asperity_grid::error::Complaint;
use asperity_grid::units::Scales;
use asperity_methods::REGISTRY;
use asperity_surface::provenance::Provenance;
use asperity_surface::{
    Edges, Spectrum, moments, non_periodic_gradient, quality_warnings, seam_warning, slope_warnings,
};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Load over that of full contact from which on it is no study of full contact but a wrong unit.
const FAR_BEYOND: f64 = 10.0;

/// Full-contact pressure of a random surface over its rms gradient: the stress of full contact has an rms of half the gradient, and its
/// largest value on 10⁹ nodes is 6.5 times that.
const RANDOM_FULL_CONTACT: f64 = 3.3;

/// A scene, checked and resolved into reduced numbers.
#[derive(Debug, Clone)]
pub struct Case {
    pub scene: Scene,
    /// The scene file, for messages and relative paths.
    pub file: PathBuf,
    /// The scene's scales, with the extents of the prepared cell.
    pub laboratory: LaboratoryScene,
    pub scales: Scales,
    pub surface: HeightSource,
    /// Mean gap at first contact, units of L; `None` for a synthesised surface without imposed displacements.
    pub first_touch: Option<f64>,
    /// Of an imported surface.
    pub provenance: Option<Provenance>,
    pub grid: Grid,
    /// rms gradient of the whole spectrum: p* is pressure over E* times this.
    pub gradient: f64,
    /// See [`Case::load_steps`].
    pub(crate) load_steps: Vec<LoadStep>,
    pub kernel: Elastic,
    pub adhesion: AttractionLaw,
    pub wall: Wall,
    /// Largest contact stress, units of E*; `None` for an elastic body.
    pub hardness: Option<CaseHardness>,
    pub atoms: Option<AtomsCase>,
    /// How LAMMPS is started here; it overrules `atoms.program` and `atoms.ranks` of the scene.
    pub lammps: LammpsCommand,
    pub warnings: Vec<String>,
}

impl Case {
    /// Reads, checks and resolves a scene file.
    pub fn read(file: &Path) -> Result<Case> {
        Self::resolve(Scene::read(file)?, file)
    }

    /// `file` is named in messages and is what relative paths are relative to.
    pub fn resolve(mut scene: Scene, file: &Path) -> Result<Case> {
        let place = file.display().to_string();
        let refuse = |list: Vec<Complaint>| match list.is_empty() {
            true => Ok(()),
            false => Err(Error::Input { place: place.clone(), list }),
        };
        let mut list = [complaints(&scene), missing_files(&scene, file)].concat();
        let mut source = match SurfaceFile::read(&scene.surface, file) {
            // A wrong key may be the reason.
            Err(_) if !list.is_empty() => None,
            read => read?,
        };
        // What the file does not declare is reported together with everything else, once for each key.
        for complaint in source.iter_mut().flat_map(|s| s.complete(&mut scene)) {
            if list.iter().all(|c| c.key != complaint.key) {
                list.push(complaint);
            }
        }
        refuse(list)?;
        if source.is_some() {
            // What the file declares is checked as what is given.
            refuse(complaints(&scene))?;
        }
        let surface = HeightSource::resolve(&scene, source, &place)?;
        Self::on_surface(scene, file, surface, None)
    }

    /// The case of a scene without a surface file, on a surface that exists already; `[surface]` has its grid.
    /// `hardness`: values `[ny, nx]` in place of the file of a hardness map.
    pub(crate) fn of_surface(
        scene: Scene,
        place: &'static str,
        surface: ResolvedSurface,
        hardness: Option<Vec<f64>>,
    ) -> Result<Case> {
        match complaints(&scene) {
            list if list.is_empty() => Self::on_surface(scene, Path::new(place), surface, hardness),
            list => Err(Error::Input { place: place.into(), list }),
        }
    }

    /// Resolves a checked scene.
    fn on_surface(scene: Scene, file: &Path, surface: ResolvedSurface, hardness: Option<Vec<f64>>) -> Result<Case> {
        let place = file.display().to_string();
        let ResolvedSurface { surface, laboratory: lab, provenance, warnings } = surface;
        let scales = lab.scales();
        let grid = grid(&scene, &surface, &place)?;
        let gradient = gradient(&scene, &surface, &place)?;
        let first_touch = first_touch(&scene, &lab, &surface, grid, &place)?;
        let adhesion = scene.adhesion.as_ref().map_or(AttractionLaw::None, |a| adhesion(&lab, a, a.range));
        let wall = match scene.continuum.penalty_length {
            Some(length) => Wall::Penalty(PenaltyWall { length: lab.reduced(length) }),
            None => Wall::Hard,
        };
        let hardness = CaseHardness::resolve(&scene.continuum, &lab, grid, (file, hardness))?;
        let mut case = Case {
            load_steps: load_steps(&scene, &lab, grid, gradient, first_touch.unwrap_or(f64::NAN)),
            kernel: kernel(&scene, &lab, grid)?,
            laboratory: lab,
            first_touch,
            provenance,
            scene,
            file: file.to_path_buf(),
            scales,
            surface,
            grid,
            gradient,
            adhesion,
            wall,
            hardness,
            atoms: None,
            lammps: LammpsCommand::default(),
            warnings,
        };
        case.warnings.extend(case.surface_warnings());
        if case.scene.surface.strict {
            let accepted = "a surface without this warning, or surface.strict = false";
            let list =
                case.warnings.iter().map(|w| Complaint::new("surface.strict", format!("true, but {w}"), accepted));
            let list: Vec<Complaint> = list.collect();
            if !list.is_empty() {
                return Err(Error::Input { place, list });
            }
        }
        case.warnings.extend(case.mirrored_force_warning());
        case.warnings.extend(case.far_load_warning());
        case.warnings.extend(case.hardness_warning());
        case.refuse_closed()?;
        case.refuse_unrepresentable()?;
        if case.scene.atoms.is_some() {
            case.atoms = Some(AtomsCase::resolve(&LaboratoryProblem {
                scene: &case.scene,
                file: &case.file,
                surface: &case.surface,
                grid: case.grid,
                gradient: case.gradient,
                adhesion: case.adhesion,
                highest_p_star: case.highest_p_star(),
            })?);
            let ranks = case.scene.atoms.as_ref().map_or(1, |a| a.ranks);
            case.warnings.extend(case.atoms.iter().flat_map(|a| a.warnings(case.gradient, ranks)));
        }
        Ok(case)
    }

    /// A force on a map that is mirrored acts on the whole periodic cell.
    fn mirrored_force_warning(&self) -> Option<String> {
        let mirrored = self.scene.surface.edges == Some(Edges::Mirror) && !self.scene.load.force.is_empty();
        mirrored.then(|| {
            "load.force acts on the mirrored cell, which has four times the area of the map: give four times the force on the map"
                .to_string()
        })
    }

    /// A load so far beyond full contact that a unit is probably wrong.
    fn far_load_warning(&self) -> Option<String> {
        let pressures = self.load_steps.iter().map(|step| match step.target {
            Load::Pressure(p) => p,
            Load::MeanGap(_) => 0.0,
        });
        let highest = pressures.fold(0.0, f64::max);
        // Cheap to see for nearly all loads; the exact pressure takes two transforms.
        if highest <= FAR_BEYOND * RANDOM_FULL_CONTACT * self.gradient {
            return None;
        }
        let full = match fits(self.grid) {
            true => {
                // The parts of a surface that is not periodic need at most the pressure of its periodic repetition.
                let kernel = match self.kernel {
                    Elastic::NonPeriodic(_) => Elastic::HalfSpace,
                    kernel => kernel,
                };
                let heights = self.surface.heights(self.grid, 0.0);
                ReducedProblem { kernel, ..ReducedProblem::new(self.grid, &heights) }.full_contact_pressure()
            }
            false => RANDOM_FULL_CONTACT * self.gradient,
        };
        // A flat surface is in full contact under any load.
        (full > 0.0 && highest > FAR_BEYOND * full).then(|| {
            let times = highest / full;
            format!(
                "the highest load, a mean pressure of {highest:.3e} E*, is {times:.2e} times the pressure of full contact, {full:.3e} E*: check the \
                 units of load and modulus"
            )
        })
    }

    /// Where the body flows it carries the hardness and the attraction, of which the range used on the grid decides.
    fn hardness_warning(&self) -> Option<String> {
        let used = self.range().law(self.adhesion, self.grid.dx().max(self.grid.dy()));
        self.hardness.as_ref().filter(|_| used != self.adhesion)?;
        let [wanted, used] = [self.adhesion, used].map(|law| law.traction(0.0));
        // A law without attraction at contact has nothing that depends on the range there.
        (wanted != used).then(|| format!(
            "hardness with adhesion: the body flows at a net stress of the hardness on any grid, but its contact stress there, the hardness \
             plus the attraction at contact, depends on the range that this grid uses: an attraction of {used:.3e} E*, with the requested range \
             {wanted:.3e} E*"
        ))
    }

    /// What the grid leaves out of the spectrum, slopes and maps that suggest a wrong unit, a range of the adhesion that the grid
    /// does not resolve.
    fn surface_warnings(&self) -> Vec<String> {
        let of_surface = match &self.surface {
            HeightSource::Synthesised { modes, .. } => modes.left_out_by(self.grid).into_iter().collect(),
            HeightSource::Imported { grid, heights, .. } => {
                let seam = seam_warning(*grid, heights).filter(|_| self.scene.continuum.is_periodic());
                let list = quality_warnings(*grid, heights).into_iter().chain(seam);
                list.map(|text| preparation_keys(&text)).collect()
            }
            HeightSource::Fourier { .. } => Vec::new(),
        };
        let of_range = self.range().resolution_warning(self.adhesion, self.grid.dx().max(self.grid.dy()));
        of_surface.into_iter().chain(slope_warnings(self.gradient)).chain(of_range).collect()
    }

    /// Behind a hard wall every pressure from that of full contact on has the mean gap zero, so that it determines no load.
    fn refuse_closed(&self) -> Result<()> {
        let zero = self.scene.load.mean_gap.iter().position(|g| g.value() == 0.0);
        let Some(i) = zero.filter(|_| self.wall == Wall::Hard) else { return Ok(()) };
        let mut accepted = "a positive number".to_string();
        if self.adhesion == AttractionLaw::None && fits(self.grid) {
            let heights = self.surface.heights(self.grid, 0.0);
            let full = self.problem((&heights).into()).full_contact_pressure();
            accepted += &format!("; full contact from load.p_star = {} on", full / self.gradient);
        }
        Err(Error::input(self.file.display(), format!("load.mean_gap[{i}]"), self.scene.load.mean_gap[i], accepted))
    }

    /// Values that over- or underflow in reduced units, and units whose products do.
    fn refuse_unrepresentable(&self) -> Result<()> {
        let Scales { length_m, modulus_pa } = self.scales;
        let (lab, c) = (&self.laboratory, &self.scene.continuum);
        let modulus = lab.modulus();
        let mut values = vec![("laboratory.modulus".to_string(), modulus.value(), modulus_pa * length_m)];
        let lists = self.scene.load.lists();
        let loads = lists.iter().flat_map(|(key, list)| list.iter().map(move |v| (key, *v)));
        for ((i, (key, value)), step) in loads.enumerate().zip(&self.load_steps) {
            let (Load::Pressure(reduced) | Load::MeanGap(reduced)) = step.target;
            values.push((format!("{key}[{i}]"), value, reduced));
        }
        if let Some(a) = &self.scene.adhesion {
            let work = a.work_of_adhesion.value();
            values.push(("adhesion.work_of_adhesion".into(), work, self.adhesion.work_of_adhesion()));
            if work != 0.0 {
                values.push(("adhesion.range".into(), a.range.value(), self.adhesion.range()));
            }
        }
        if let (Some(length), Wall::Penalty(wall)) = (c.penalty_length, self.wall) {
            values.push(("continuum.penalty_length".into(), length.value(), wall.length));
        }
        for reduced in self.hardness.iter().flat_map(|h| h.extent()) {
            let key = if c.hardness_map.is_some() { "hardness_map" } else { "hardness" };
            values.push((format!("continuum.{key}"), reduced * modulus.value(), reduced));
        }
        match values
            .into_iter()
            .find(|(_, given_value, reduced)| !asperity_contact::method::is_representable(*given_value, *reduced))
        {
            None => Ok(()),
            Some((key, found, _)) => {
                let accepted =
                    "a number that neither over- nor underflows over or times laboratory.modulus and laboratory.length";
                Err(Error::input(self.file.display(), key, format!("{found:e}"), accepted))
            }
        }
    }

    /// Whether the surface is a non-periodic map. A synthesised surface is periodic even on a non-periodic half-space.
    pub fn is_non_periodic(&self) -> bool {
        !self.scene.continuum.is_periodic() && matches!(self.surface, HeightSource::Imported { .. })
    }

    /// The load path, the unloading branch of a closed path included.
    pub fn load_steps(&self) -> &[LoadStep] {
        &self.load_steps
    }

    /// The load path without the unloading branch of a closed one.
    pub fn loading_steps(&self) -> &[LoadStep] {
        &self.load_steps[..self.scene.load.loading_count()]
    }

    /// The unloading branch of a closed load path.
    pub fn unloading_steps(&self) -> &[LoadStep] {
        &self.load_steps[self.scene.load.loading_count()..]
    }

    /// The loading steps as atoms are given them: rising, one of each load.
    pub fn rising_steps(&self) -> Vec<&LoadStep> {
        let p_star = |s: &LoadStep| s.imposed_p_star();
        let mut steps: Vec<&LoadStep> = self.loading_steps().iter().collect();
        steps.sort_by(|a, b| p_star(a).total_cmp(&p_star(b)));
        steps.dedup_by(|a, b| p_star(a) == p_star(b));
        steps
    }

    /// p* of the loading steps; empty where the mean gap is imposed.
    pub fn loading_p_star(&self) -> Vec<f64> {
        self.loading_steps().iter().filter_map(|s| s.p_star).collect()
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

    /// Card of the scene's own method.
    pub fn method(&self) -> &'static MethodCard {
        asperity_methods::find(&self.scene.continuum.method).expect("checked with the scene").card()
    }

    /// Methods that are compared with the scene's own at the same loads, in the order of the registry.
    pub fn comparison_methods(&self) -> Vec<&'static dyn ContactMethod> {
        let (own, also) = (self.method().id, &self.scene.continuum.compare_with);
        let requested = |id: &str| {
            also.iter().any(|a| a == ALL_METHODS || asperity_methods::find(a).is_some_and(|m| m.card().id == id))
        };
        let runs = |id: &str| if id == own { !self.solves() } else { requested(id) };
        // "all" are those that model what the scene contains.
        let models = |card: &MethodCard| self.hardness.is_none() || card.capabilities.hardness;
        REGISTRY.iter().copied().filter(|m| runs(m.card().id) && models(m.card())).collect()
    }

    /// Treatment of a range that the grid does not resolve.
    pub fn range(&self) -> RangeChoice {
        self.scene.adhesion.as_ref().map_or(RangeChoice::default(), |a| a.resolution)
    }

    /// The scene's adhesion with another range.
    pub fn adhesion_of_range(&self, range: Length) -> AttractionLaw {
        self.scene.adhesion.as_ref().map_or(AttractionLaw::None, |a| adhesion(&self.laboratory, a, range))
    }

    /// Range of a law on the scene's grid, units of L: enlarged where the grid does not resolve it.
    pub fn range_used(&self, adhesion: AttractionLaw) -> f64 {
        self.range().law(adhesion, self.grid.dx().max(self.grid.dy())).range()
    }

    /// The laboratory-scale problem on the scene's grid, with the scene's own range of adhesion.
    pub fn problem<'a>(&'a self, heights: Heights<'a>) -> ReducedProblem<'a> {
        let c = &self.scene.continuum;
        ReducedProblem {
            kernel: self.kernel,
            adhesion: self.adhesion,
            wall: self.wall,
            hardness: self.hardness.as_ref().map(CaseHardness::lend),
            precision: c.precision,
            tolerance: c.tolerance_or_default(self.grid),
            targets: c.targets(),
            max_iterations: c.max_iterations,
            settings: self.scene.methods,
            ..ReducedProblem::new(self.grid, heights)
        }
    }

    /// The same for a plan, before the heights are made.
    pub fn planned_problem(&self) -> ReducedProblem<'_> {
        self.problem(Heights::Planned(self.surface.series_bytes()))
    }

    /// Imposes these pressures (E*) in place of the contact areas of the scene.
    pub fn impose_pressures(&mut self, pressures: &[f64]) {
        let modulus = self.laboratory.modulus();
        self.scene.load.contact = Vec::new();
        self.scene.load.pressure = pressures.iter().map(|p| modulus.with(p * modulus.value())).collect();
        let first_touch = self.first_touch.unwrap_or(f64::NAN);
        self.load_steps = load_steps(&self.scene, &self.laboratory, self.grid, self.gradient, first_touch);
        // Without the rounding of the unit.
        let path = self.scene.load.with_unloading(pressures);
        for (step, pressure) in self.load_steps.iter_mut().zip(path) {
            step.target = Load::Pressure(pressure);
            step.p_star = step.p_star.map(|_| pressure / self.gradient);
        }
    }

    /// What is computed below the surface, if it is requested.
    pub fn subsurface(&self) -> Option<SubsurfaceRequest> {
        let (s, lab) = (self.scene.continuum.subsurface.as_ref()?, &self.laboratory);
        Some(SubsurfaceRequest {
            depths: s.depths.iter().map(|d| lab.reduced(*d).min(self.kernel.thickness())).collect(),
            // Of a layer its own.
            poisson: s.poisson.unwrap_or_default(),
            shear_strength: s.shear_strength.map(|t| lab.reduced_stress(t)),
        })
    }

    /// The surface, for a caller that stores its heights in another form. An empty map is left.
    pub fn take_surface(&mut self) -> HeightSource {
        let empty = HeightSource::Imported { grid: self.grid, heights: Arc::default(), origin: String::new() };
        std::mem::replace(&mut self.surface, empty)
    }

    /// The scene with its paths made absolute, so that it means the same wherever it is read from.
    pub fn portable_scene(&self) -> Scene {
        let is_whole = |p: &PathBuf| std::path::absolute(self.resolve_path(p)).unwrap_or_else(|_| self.resolve_path(p));
        let mut scene = self.scene.clone();
        scene.surface.heights = scene.surface.heights.as_ref().map(is_whole);
        scene.continuum.initial_gap = scene.continuum.initial_gap.as_ref().map(is_whole);
        scene.continuum.hardness_map = scene.continuum.hardness_map.as_ref().map(is_whole);
        if let Some(atoms) = &mut scene.atoms {
            atoms.potential = atoms.potential.as_ref().map(is_whole);
            // A bare name is looked for on the search path.
            atoms.program =
                atoms.program.as_ref().map(|p| if p.components().count() > 1 { is_whole(p) } else { p.clone() });
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

/// The grid on which the surface is solved.
fn grid(scene: &Scene, surface: &HeightSource, context: &str) -> Result<Grid> {
    let n = scene.surface.grid;
    match surface {
        HeightSource::Imported { grid, .. } => Ok(*grid),
        HeightSource::Fourier { modes, .. } if !modes.resolved_on(Grid::unit(n.max(1), n.max(1))) => {
            let smallest = modes.smallest_grid();
            let accepted =
                format!("at least {smallest}, which resolves every wave, or surface.low_pass that leaves fewer");
            Err(Error::input(context, "surface.grid", n, accepted))
        }
        HeightSource::Synthesised { .. } | HeightSource::Fourier { .. } => Ok(Grid::unit(n, n)),
    }
}

/// Whether a transform of the heights fits into memory: heights, a spectrum and one more field.
fn fits(grid: Grid) -> bool {
    3 * 8 * grid.points() as u64 <= asperity_grid::sys::available_memory_bytes()
}

/// rms gradient of the whole spectrum.
fn gradient(scene: &Scene, surface: &HeightSource, context: &str) -> Result<f64> {
    let consistent = scene.laboratory.is_plain();
    let gradient = match surface {
        // In consistent units the gradient serves a warning only; the memory plan of the solver comes later.
        HeightSource::Imported { grid, .. } if consistent && !fits(*grid) => return Ok(f64::NAN),
        HeightSource::Synthesised { spectrum, .. } => spectrum.rms_gradient,
        HeightSource::Fourier { modes, .. } => modes.rms_gradient(),
        HeightSource::Imported { grid, heights, .. } if !scene.continuum.is_periodic() => {
            non_periodic_gradient(*grid, heights)
        }
        HeightSource::Imported { grid, heights, .. } => moments(*grid, heights).rms_gradient,
    };
    // In consistent units nothing is given or reported as p*.
    if gradient == 0.0 && !consistent {
        let accepted = "a rough surface: p* is pressure over E* times rms gradient";
        return Err(Error::input(context, "load.p_star", "a flat surface, rms gradient 0", accepted));
    }
    // A coarse file of the challenge's surface lacks gradient, not load.
    Ok(if scene.challenge.is_some() { Spectrum::CHALLENGE.rms_gradient } else { gradient })
}

/// Mean gap at first contact: of imported maps, and where displacements are imposed.
fn first_touch(
    scene: &Scene,
    lab: &LaboratoryScene,
    surface: &HeightSource,
    grid: Grid,
    context: &str,
) -> Result<Option<f64>> {
    let displacements = &scene.load.displacement;
    let gap = match surface {
        HeightSource::Imported { heights, .. } => asperity_grid::mean(heights),
        _ if displacements.is_empty() => return Ok(None),
        _ => asperity_grid::mean(&surface.heights(grid, 0.0)),
    };
    match displacements.iter().position(|d| lab.reduced(*d) >= gap) {
        None => Ok(Some(gap)),
        Some(i) => {
            let given = displacements[i];
            let largest = rounded(given.with(gap / lab.reduced(given.with(1.0))));
            let accepted = format!("less than {largest}, the mean gap at first contact: there the gap is closed");
            Err(Error::input(context, format!("load.displacement[{i}]"), given, accepted))
        }
    }
}

/// The elastic body.
fn kernel(scene: &Scene, lab: &LaboratoryScene, grid: Grid) -> Result<Elastic> {
    let c = &scene.continuum;
    Ok(match (&c.layer, &c.crystal) {
        (Some(l), _) => {
            let thickness = lab.reduced(l.thickness);
            Elastic::Layer(Layer { thickness, poisson: l.poisson, base: l.base })
        }
        (None, Some(c)) => Elastic::Cubic(c.half_space()?),
        (None, None) if !c.is_periodic() => Elastic::NonPeriodic(NonPeriodic::of_region(grid.lx, grid.ly)),
        (None, None) => Elastic::HalfSpace,
    })
}

/// The load steps of a scene. `gradient`: rms gradient, to which p* refers; `first_touch`: mean gap at first contact. Contact fractions
/// have estimated pressures ([`Case::impose_pressures`]).
fn load_steps(scene: &Scene, lab: &LaboratoryScene, grid: Grid, gradient: f64, first_touch: f64) -> Vec<LoadStep> {
    let load = &scene.load;
    let pressures: Vec<f64> = [
        load.pressure.iter().map(|p| lab.reduced_stress(*p)).collect::<Vec<f64>>(),
        load.force.iter().map(|f| lab.reduced_force(*f, grid.ly)).collect(),
        load.contact.iter().map(|area| gradient * estimated_p_star(*area)).collect(),
    ]
    .concat();
    let pressures = load.with_unloading(&pressures);
    let mut p_star = load.p_star_path();
    let imposed = p_star.iter().map(|p| p * gradient).chain(pressures.iter().copied()).map(Load::Pressure);
    let gaps = load.mean_gap.iter().map(|g| lab.reduced(*g));
    let gaps: Vec<f64> = gaps.chain(load.displacement.iter().map(|d| first_touch - lab.reduced(*d))).collect();
    let gaps = load.with_unloading(&gaps);
    let targets: Vec<Load> = imposed.chain(gaps.into_iter().map(Load::MeanGap)).collect();
    // A flat surface has no p*.
    if gradient > 0.0 && !lab.is_plain() {
        p_star.extend(pressures.iter().map(|p| p / gradient));
    }
    let mut steps = LoadStep::path(&targets, &p_star, load.loading_count());
    if let Some(list) = &load.maps_at {
        let stored: Vec<usize> = list.iter().flat_map(|p| load.indices_of(*p)).collect();
        steps.iter_mut().for_each(|step| step.maps = stored.contains(&step.index));
    }
    steps
}

/// The law of a scene, with a range that may be another than its own.
fn adhesion(lab: &LaboratoryScene, a: &AdhesionScene, range: Length) -> AttractionLaw {
    a.adhesion(lab.reduced_work(a.work_of_adhesion), lab.reduced(range))
}
