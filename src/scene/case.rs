use super::check::{complaints, missing_files};
use super::model::relative_to;
use super::{ALL_METHODS, AdhesionScene, AtomsCase, Laboratory, RequestedOutputs, Scene, Surface, Units};
use crate::grid::Grid;
use crate::interface::{Adhesion, CubicHalfSpace, Elastic, Layer, NonPeriodic, PenaltyWall, RangeChoice, Wall};
use crate::load::{Load, LoadStep};
use crate::method::{self, Card, ContactMethod, Heights, Kind, Problem, REGISTRY};
use crate::record::advice::AccuracyChoice;
use crate::surface::{Spectrum, moments, non_periodic_gradient, quality_warnings};
use crate::units::Scales;
use crate::{Error, Result};
use std::path::{Path, PathBuf};

/// rms gradient above which a warning is given. That of the challenge, 1, is at the limit of small-slope theory.
const STEEP: f64 = 3.0;

/// A warning for a surface so steep that its unit of length is in doubt.
pub fn slope_warning(rms_gradient: f64) -> Option<String> {
    (rms_gradient > STEEP).then(|| {
        format!(
            "the rms gradient is {rms_gradient:.3}: the theory assumes small slopes, and so steep a surface suggests a wrong unit of length"
        )
    })
}

/// A scene, checked and resolved into reduced numbers.
#[derive(Debug, Clone)]
pub struct Case {
    pub scene: Scene,
    /// The scene file, for messages and relative paths.
    pub file: PathBuf,
    pub scales: Scales,
    pub surface: Surface,
    pub grid: Grid,
    /// rms gradient of the whole spectrum: p* is pressure over E* times this.
    pub gradient: f64,
    /// See [`Case::load_steps`].
    pub(crate) load_steps: Vec<LoadStep>,
    pub kernel: Elastic,
    pub adhesion: Adhesion,
    pub wall: Wall,
    pub atoms: Option<AtomsCase>,
    /// The setting chosen for the scene's `[accuracy]`, if it has one.
    pub chosen: Option<AccuracyChoice>,
    pub warnings: Vec<String>,
}

impl Case {
    /// Reads, checks and resolves a scene file.
    pub fn read(file: &Path) -> Result<Case> {
        Self::resolve(Scene::read(file)?, file)
    }

    /// `file` is named in messages and is what relative paths are relative to.
    pub fn resolve(scene: Scene, file: &Path) -> Result<Case> {
        let place = file.display().to_string();
        let list = [complaints(&scene), missing_files(&scene, file)].concat();
        if !list.is_empty() {
            return Err(Error::Input { place, list });
        }
        let lab = &scene.laboratory;
        let scales = lab.scales();
        let surface = Surface::resolve(&scene.surface, lab, file)?;
        let grid = grid(&scene, &surface, &place)?;
        let gradient = gradient(&scene, &surface, &place)?;
        let adhesion = scene.adhesion.as_ref().map_or(Adhesion::None, |a| adhesion(lab, a, a.range_nm));
        let wall = match scene.continuum.penalty_length_nm {
            Some(nm) => Wall::Penalty(PenaltyWall { length: lab.reduced_nm(nm) }),
            None => Wall::Hard,
        };
        let mut case = Case {
            load_steps: load_steps(&scene, gradient),
            kernel: kernel(&scene, grid)?,
            scene,
            file: file.to_path_buf(),
            scales,
            surface,
            grid,
            gradient,
            adhesion,
            wall,
            atoms: None,
            chosen: None,
            warnings: Vec::new(),
        };
        case.warnings = case.surface_warnings();
        case.refuse_closed()?;
        if case.scene.atoms.is_some() {
            case.atoms = Some(AtomsCase::resolve(&case)?);
            let ranks = case.scene.atoms.as_ref().map_or(1, |a| a.ranks);
            case.warnings.extend(case.atoms.iter().flat_map(|a| a.warnings(case.gradient, ranks)));
        }
        Ok(case)
    }

    /// What the grid leaves out of the spectrum, slopes and maps that suggest a wrong unit, a range of the adhesion that the grid
    /// does not resolve.
    fn surface_warnings(&self) -> Vec<String> {
        let of_surface = match &self.surface {
            Surface::Synthesised { modes, .. } => modes.left_out_by(self.grid).into_iter().collect(),
            Surface::Imported { grid, heights, .. } => quality_warnings(*grid, heights),
            Surface::Fourier { .. } => Vec::new(),
        };
        let of_range = self.range().resolution_warning(self.adhesion, self.grid.dx().max(self.grid.dy()));
        of_surface.into_iter().chain(slope_warning(self.gradient)).chain(of_range).collect()
    }

    /// Behind a hard wall every pressure from that of full contact on has the mean gap zero, so that it determines no load.
    fn refuse_closed(&self) -> Result<()> {
        let zero = self.scene.load.mean_gap_um.iter().position(|g| *g == 0.0);
        let Some(i) = zero.filter(|_| self.wall == Wall::Hard) else { return Ok(()) };
        let mut accepted = "a positive number".to_string();
        if self.adhesion == Adhesion::None && fits(self.grid) {
            let heights = self.surface.heights(self.grid, 0.0);
            let full = self.problem((&heights).into()).full_contact_pressure();
            let load = match self.scene.laboratory.units {
                Units::Named => format!("load.p_star = {}", full / self.gradient),
                Units::Consistent => format!("load.pressure_mpa {}", full * self.scales.modulus_pa),
            };
            accepted += &format!("; full contact from {load} on");
        }
        Err(Error::input(self.file.display(), format!("load.mean_gap_um[{i}]"), 0, accepted))
    }

    /// Whether the surface is a non-periodic map. A synthesised surface is periodic even on a non-periodic half-space.
    pub fn is_non_periodic(&self) -> bool {
        !self.scene.continuum.periodic && matches!(self.surface, Surface::Imported { .. })
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

    /// Outputs of the run: those that `[accuracy]` needs, or all.
    pub fn requested_outputs(&self) -> RequestedOutputs {
        self.scene.accuracy.as_ref().map_or(RequestedOutputs::EVERYTHING, |a| RequestedOutputs::of(a.quantity))
    }

    /// Whether the maps of a load are stored.
    pub fn stores_maps(&self, step: &LoadStep) -> bool {
        self.requested_outputs().maps && step.maps
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
        self.method().kind == Kind::Solver
    }

    /// Card of the scene's own method.
    pub fn method(&self) -> &'static Card {
        method::find(&self.scene.continuum.method).expect("checked with the scene").card()
    }

    /// Methods that are compared with the scene's own at the same loads, in the order of the registry.
    pub fn comparison_methods(&self) -> Vec<&'static dyn ContactMethod> {
        let (own, also) = (self.method().id, &self.scene.continuum.compare_with);
        let wanted =
            |id: &str| also.iter().any(|a| a == ALL_METHODS || method::find(a).is_some_and(|m| m.card().id == id));
        let runs = |id: &str| if id == own { !self.solves() } else { wanted(id) };
        REGISTRY.iter().copied().filter(|m| runs(m.card().id)).collect()
    }

    /// Treatment of a range that the grid does not resolve.
    pub fn range(&self) -> RangeChoice {
        self.scene.adhesion.as_ref().map_or(RangeChoice::default(), |a| a.range)
    }

    /// The scene's adhesion with another range.
    pub fn adhesion_of_range(&self, nm: f64) -> Adhesion {
        self.scene.adhesion.as_ref().map_or(Adhesion::None, |a| adhesion(&self.scene.laboratory, a, nm))
    }

    /// Range of a law on the scene's grid, units of L: enlarged where the grid does not resolve it.
    pub fn range_used(&self, adhesion: Adhesion) -> f64 {
        self.range().law(adhesion, self.grid.dx().max(self.grid.dy())).range()
    }

    /// The laboratory-scale problem on the scene's grid, with the scene's own range of adhesion.
    pub fn problem<'a>(&self, heights: Heights<'a>) -> Problem<'a> {
        let c = &self.scene.continuum;
        Problem {
            kernel: self.kernel,
            adhesion: self.adhesion,
            wall: self.wall,
            precision: c.precision,
            tolerance: c.tolerance_or_default(self.grid),
            targets: c.targets(),
            max_iterations: c.max_iterations,
            settings: self.scene.methods,
            ..Problem::new(self.grid, heights)
        }
    }

    /// The surface, for a caller that stores its heights in another form. An empty map is left.
    pub fn take_surface(&mut self) -> Surface {
        let empty = Surface::Imported { grid: self.grid, heights: Vec::new(), origin: String::new() };
        std::mem::replace(&mut self.surface, empty)
    }

    /// The scene with its paths made absolute, so that it means the same wherever it is read from.
    pub fn portable_scene(&self) -> Scene {
        let whole = |p: &PathBuf| std::path::absolute(self.resolve_path(p)).unwrap_or_else(|_| self.resolve_path(p));
        let mut scene = self.scene.clone();
        scene.surface.heights = scene.surface.heights.as_ref().map(whole);
        scene.continuum.initial_gap = scene.continuum.initial_gap.as_ref().map(whole);
        if let Some(accuracy) = &mut scene.accuracy {
            accuracy.tables = accuracy.tables.iter().map(whole).collect();
        }
        if let Some(atoms) = &mut scene.atoms {
            atoms.potential = atoms.potential.as_ref().map(whole);
            // A bare name is looked for on the search path.
            atoms.program =
                atoms.program.as_ref().map(|p| if p.components().count() > 1 { whole(p) } else { p.clone() });
        }
        scene
    }

    /// Path as the scene file means it.
    pub fn resolve_path(&self, path: &Path) -> PathBuf {
        relative_to(&self.file, path)
    }
}

/// The grid on which the surface is solved.
fn grid(scene: &Scene, surface: &Surface, place: &str) -> Result<Grid> {
    let n = scene.surface.grid;
    match surface {
        Surface::Imported { grid, .. } => Ok(*grid),
        Surface::Fourier { modes, .. } if !modes.held_by(Grid::unit(n.max(1), n.max(1))) => {
            let least = modes.smallest_grid();
            let accepted =
                format!("at least {least}, which holds every wave, or surface.low_pass_um that leaves fewer");
            Err(Error::input(place, "surface.grid", n, accepted))
        }
        Surface::Synthesised { .. } | Surface::Fourier { .. } => Ok(Grid::unit(n, n)),
    }
}

/// Whether a transform of the heights fits into memory: heights, a spectrum and one more field.
fn fits(grid: Grid) -> bool {
    3 * 8 * grid.points() as u64 <= crate::sys::available_memory_bytes()
}

/// rms gradient of the whole spectrum.
fn gradient(scene: &Scene, surface: &Surface, place: &str) -> Result<f64> {
    let consistent = scene.laboratory.units == Units::Consistent;
    let found = match surface {
        // In consistent units the gradient serves a warning only; the memory plan of the solver comes later.
        Surface::Imported { grid, .. } if consistent && !fits(*grid) => return Ok(f64::NAN),
        Surface::Synthesised { spectrum, .. } => spectrum.rms_gradient,
        Surface::Fourier { modes, .. } => modes.rms_gradient(),
        Surface::Imported { grid, heights, .. } if !scene.continuum.periodic => non_periodic_gradient(*grid, heights),
        Surface::Imported { grid, heights, .. } => moments(*grid, heights).rms_gradient,
    };
    // In consistent units nothing is given or reported as p*.
    if found == 0.0 && !consistent {
        let accepted = "a rough surface: p* is pressure over E* times rms gradient";
        return Err(Error::input(place, "load.p_star", "a flat surface, rms gradient 0", accepted));
    }
    // A coarse file of the challenge's surface lacks gradient, not load.
    Ok(if scene.challenge.is_some() { Spectrum::CHALLENGE.rms_gradient } else { found })
}

/// The elastic body.
fn kernel(scene: &Scene, grid: Grid) -> Result<Elastic> {
    let c = &scene.continuum;
    Ok(match (&c.layer, &c.crystal) {
        (Some(l), _) => {
            let thickness = l.thickness_um / scene.laboratory.length_um;
            Elastic::Layer(Layer { thickness, poisson: l.poisson, base: l.base })
        }
        (None, Some(c)) => Elastic::Cubic(CubicHalfSpace::new(c.c11_gpa, c.c12_gpa, c.c44_gpa)?),
        (None, None) if !c.periodic => Elastic::NonPeriodic(NonPeriodic::of_region(grid.lx, grid.ly)),
        (None, None) => Elastic::HalfSpace,
    })
}

/// The load steps of a scene. `gradient`: rms gradient, to which p* refers.
fn load_steps(scene: &Scene, gradient: f64) -> Vec<LoadStep> {
    let (lab, load) = (&scene.laboratory, &scene.load);
    let p_star = load.p_star_path();
    let pressures = load.pressure_mpa.iter().map(|p| p / lab.contact_modulus_mpa);
    let pressures = p_star.iter().map(|p| p * gradient).chain(pressures).map(Load::Pressure);
    let gaps = load.mean_gap_path().into_iter().map(|um| Load::MeanGap(lab.reduced_um(um)));
    let targets: Vec<Load> = pressures.chain(gaps).collect();
    let mut steps = LoadStep::path(&targets, &p_star, load.loading_count());
    if let Some(list) = &load.maps_at {
        let stored: Vec<usize> = list.iter().flat_map(|p| load.indices_of(*p)).collect();
        steps.iter_mut().for_each(|step| step.maps = stored.contains(&step.index));
    }
    steps
}

/// The law of a scene, with a range that may be another than its own.
fn adhesion(lab: &Laboratory, a: &AdhesionScene, range_nm: f64) -> Adhesion {
    a.law.adhesion(lab.reduced_work(a.work_of_adhesion_mj_m2), lab.reduced_nm(range_nm))
}
