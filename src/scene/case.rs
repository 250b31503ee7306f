use super::check::{complaints, cut_offs, missing_files};
use super::{
    ALL_METHODS, AdhesionScene, AtomsCase, LoadScene, RequestedOutputs, Scene, Surface, SurfaceFile, SurfaceScene,
    Touching,
};
use crate::grid::Grid;
use crate::interface::{Adhesion, CubicHalfSpace, Elastic, Layer, NonPeriodic, PenaltyWall, RangeChoice, Wall};
use crate::load::{Load, LoadStep};
use crate::method::{self, Card, ContactMethod, Heights, Kind, Problem, REGISTRY};
use crate::record::advice::AccuracyChoice;
use crate::record::heights::Sign;
use crate::record::import::ImportOptions;
use crate::surface::{Spectrum, moments, non_periodic_gradient, quality_warnings};
use crate::units::Scales;
use crate::{Error, Result};
use std::path::{Path, PathBuf};

/// rms gradient from which a surface is called steep; the challenge's, 1, is at the edge of what linear theory is used for.
const STEEP: f64 = 3.0;

/// What is to be said of a surface so steep.
pub fn slope_warning(rms_gradient: f64) -> Option<String> {
    (rms_gradient > STEEP).then(|| {
        format!(
            "the rms gradient is {rms_gradient:.3}: the theory is one of small slopes, and so steep a surface is more likely a wrong \
             unit of length"
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
    /// How the scene's accuracy was resolved, where it asks for one.
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
        let mut warnings = Vec::new();
        let lab = &scene.laboratory;
        let scales = Scales { length_m: lab.length_um * 1e-6, modulus_pa: lab.contact_modulus_mpa * 1e6 };
        let surface = surface(&scene, file)?;
        let (grid, gradient) = match &surface {
            Surface::Synthesised { modes, spectrum, .. } => {
                let grid = Grid::unit(scene.surface.grid, scene.surface.grid);
                warnings.extend(modes.left_out_by(grid));
                (grid, spectrum.rms_gradient)
            }
            Surface::Fourier { modes, .. } => {
                let n = scene.surface.grid;
                if !modes.held_by(Grid::unit(n, n)) {
                    let least = modes.smallest_grid();
                    let accepted =
                        format!("at least {least}, which holds every wave, or surface.low_pass_um that leaves fewer");
                    return Err(Error::input(place, "surface.grid", n, accepted));
                }
                (Grid::unit(n, n), modes.rms_gradient())
            }
            Surface::Imported { grid, heights, .. } if !scene.continuum.periodic => {
                (*grid, non_periodic_gradient(*grid, heights))
            }
            Surface::Imported { grid, heights, .. } => (*grid, moments(*grid, heights).rms_gradient),
        };
        if gradient == 0.0 {
            let found = "a flat surface, rms gradient 0";
            return Err(Error::input(
                place,
                "load.p_star",
                found,
                "a rough surface: p* is pressure over E* times rms gradient",
            ));
        }
        // A coarse file of the challenge's surface lacks gradient, not load.
        let gradient = if scene.challenge.is_some() { Spectrum::CHALLENGE.rms_gradient } else { gradient };
        warnings.extend(slope_warning(gradient));
        if let Surface::Imported { grid, heights, .. } = &surface {
            warnings.extend(quality_warnings(*grid, heights));
        }
        let adhesion = scene.adhesion.as_ref().map_or(Adhesion::None, |a| adhesion(a, a.range_nm, scales));
        let range = scene.adhesion.as_ref().map_or(RangeChoice::default(), |a| a.range);
        warnings.extend(range.resolution_warning(adhesion, grid.dx()));
        let kernel = match (&scene.continuum.layer, &scene.continuum.crystal) {
            (Some(l), _) => {
                Elastic::Layer(Layer { thickness: l.thickness_um / lab.length_um, poisson: l.poisson, base: l.base })
            }
            (None, Some(c)) => Elastic::Cubic(CubicHalfSpace::new(c.c11_gpa, c.c12_gpa, c.c44_gpa)?),
            (None, None) if !scene.continuum.periodic => Elastic::NonPeriodic(NonPeriodic::of_region(grid.lx, grid.ly)),
            (None, None) => Elastic::HalfSpace,
        };
        let wall = match scene.continuum.penalty_length_nm {
            Some(nm) => Wall::Penalty(PenaltyWall { length: nm * 1e-9 / scales.length_m }),
            None => Wall::Hard,
        };
        let mut case = Case {
            load_steps: load_steps(&scene.load, gradient, scales),
            scene,
            file: file.to_path_buf(),
            scales,
            surface,
            grid,
            gradient,
            kernel,
            adhesion,
            wall,
            atoms: None,
            chosen: None,
            warnings,
        };
        case.refuse_closed()?;
        if case.scene.atoms.is_some() {
            case.atoms = Some(AtomsCase::resolve(&case)?);
            let ranks = case.scene.atoms.as_ref().map_or(1, |a| a.ranks);
            case.warnings.extend(case.atoms.iter().flat_map(|a| a.warnings(case.gradient, ranks)));
        }
        Ok(case)
    }

    /// Behind a hard wall a mean gap of zero is reached by any pressure from one on, so that it asks for none.
    fn refuse_closed(&self) -> Result<()> {
        let zero = self.scene.load.mean_gap_um.iter().position(|g| *g == 0.0);
        let Some(i) = zero.filter(|_| self.wall == Wall::Hard) else { return Ok(()) };
        let mut accepted = "a positive number".to_string();
        // Heights, a spectrum and the stress.
        let fits = 3 * 8 * self.grid.points() as u64 <= crate::sys::available_memory_bytes();
        if self.adhesion == Adhesion::None && fits {
            let heights = self.surface.heights(self.grid, 0.0);
            let full = self.problem((&heights).into()).full_contact_pressure() / self.gradient;
            accepted += &format!("; all of the surface touches from load.p_star = {full} on");
        }
        Err(Error::input(self.file.display(), format!("load.mean_gap_um[{i}]"), 0, accepted))
    }

    /// Whether the surface is a map that does not repeat. One made from its spectrum does, whatever lies around it.
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

    /// What is kept and counted: what an accuracy is asked of needs, or everything.
    pub fn requested_outputs(&self) -> RequestedOutputs {
        self.scene.accuracy.as_ref().map_or(RequestedOutputs::EVERYTHING, |a| RequestedOutputs::of(a.quantity))
    }

    /// Whether the maps of a load are stored.
    pub fn stores_maps(&self, step: &LoadStep) -> bool {
        self.requested_outputs().maps && step.maps
    }

    /// Whether the loads are solved without the scene's adhesion, too: where that is asked for, and where a method beside knows
    /// no adhesion and is to be held against something.
    pub fn solves_nonadhesive(&self) -> bool {
        let attracts = self.scene.adhesion.is_some();
        self.solves_all_nonadhesive()
            || attracts && self.comparison_methods().iter().any(|m| !m.card().supports_adhesion())
    }

    /// Whether all that solves or estimates does so without the scene's adhesion, too.
    pub fn solves_all_nonadhesive(&self) -> bool {
        self.scene.challenge.is_some() || self.scene.adhesion.as_ref().is_some_and(|a| a.also_nonadhesive)
    }

    /// Whether the scene's own method solves for the fields. One that estimates runs as those beside it do.
    pub fn solves(&self) -> bool {
        self.method().kind == Kind::Solver
    }

    /// Card of the scene's own method.
    pub fn method(&self) -> &'static Card {
        method::find(&self.scene.continuum.method).expect("checked with the scene").card()
    }

    /// Methods that are given the same loads beside the scene's own, in the order of the registry.
    pub fn comparison_methods(&self) -> Vec<&'static dyn ContactMethod> {
        let (own, also) = (self.method().id, &self.scene.continuum.compare_with);
        let wanted =
            |id: &str| also.iter().any(|a| a == ALL_METHODS || method::find(a).is_some_and(|m| m.card().id == id));
        let runs = |id: &str| if id == own { !self.solves() } else { wanted(id) };
        REGISTRY.iter().copied().filter(|m| runs(m.card().id)).collect()
    }

    /// Which range grids are given.
    pub fn range(&self) -> RangeChoice {
        self.scene.adhesion.as_ref().map_or(RangeChoice::default(), |a| a.range)
    }

    /// The scene's adhesion with another range.
    pub fn adhesion_of_range(&self, nm: f64) -> Adhesion {
        self.scene.adhesion.as_ref().map_or(Adhesion::None, |a| adhesion(a, nm, self.scales))
    }

    /// The range that the grid is given of a law, units of L.
    pub fn range_used(&self, adhesion: Adhesion) -> f64 {
        self.range().law(adhesion, self.grid.dx().max(self.grid.dy())).range()
    }

    /// The laboratory-scale problem on the scene's grid, with the adhesion as asked for.
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

/// The load steps of a scene. `gradient`: rms gradient, to which p* refers.
fn load_steps(scene: &LoadScene, gradient: f64, scales: Scales) -> Vec<LoadStep> {
    let p_star = scene.p_star_path();
    let pressures = p_star.iter().map(|p| Load::Pressure(p * gradient));
    let gaps = scene.mean_gap_path().into_iter().map(|um| Load::MeanGap(um * 1e-6 / scales.length_m));
    let targets: Vec<Load> = pressures.chain(gaps).collect();
    let mut steps = LoadStep::path(&targets, &p_star, scene.loading_count());
    if let Some(list) = &scene.maps_at {
        let stored: Vec<usize> = list.iter().flat_map(|p| scene.indices_of(*p)).collect();
        steps.iter_mut().for_each(|step| step.maps = stored.contains(&step.index));
    }
    steps
}

/// The law of a scene, with a range that may be another than its own.
fn adhesion(a: &AdhesionScene, range_nm: f64, scales: Scales) -> Adhesion {
    let gamma = scales.reduced_energy_per_area(a.work_of_adhesion_mj_m2 * 1e-3);
    a.law.adhesion(gamma, range_nm * 1e-9 / scales.length_m)
}

pub(super) fn relative_to(file: &Path, path: &Path) -> PathBuf {
    file.parent().unwrap_or(Path::new("")).join(path)
}

fn surface(scene: &Scene, file: &Path) -> Result<Surface> {
    let s: &SurfaceScene = &scene.surface;
    if let Some(path) = &s.heights {
        let path = relative_to(file, path);
        let sign = match s.touching {
            Some(Touching::HighPoints) => Sign::HighFirst,
            _ => Sign::LowFirst,
        };
        let length_um = scene.laboratory.length_um;
        return Surface::read(
            &path,
            SurfaceFile {
                asked: ImportOptions { dataset: s.dataset.as_deref(), fourier: s.fourier },
                fourier_points: s.fourier_points,
                sign,
                unit: s.heights_unit_um / length_um,
                low_pass: s.low_pass_um.map_or(0.0, |um| um / length_um),
                low_pass_key: "surface.low_pass_um",
                sign_key: ("surface.touching", &format!("{:?}", s.touching)),
                unit_um: Some((s.heights_unit_um, "surface.heights_unit_um (--heights-unit-um)")),
                place: &file.display().to_string(),
                unit_words: &format!("in units of {} µm", s.heights_unit_um),
            },
        );
    }
    let (lambda_r, lambda_s) = cut_offs(s, scene.laboratory.length_um);
    let spectrum =
        Spectrum { hurst: s.hurst, lambda_r, lambda_s, rms_gradient: s.rms_gradient, amplitudes: s.amplitudes };
    Ok(Surface::synthesised(spectrum, s.seed))
}
