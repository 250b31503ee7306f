//! Stages that solve the scene's problem and its variants at laboratory scale.

use super::continuum::{Keep, PathRequest, load_path, observed_bytes, start};
use super::folder::StageKey;
use super::stage::{EstimatedCost, MachineSpeed, Stage, StageContext, StageKeys};
use crate::Result;
use crate::report::number::SiNotation;
use crate::scene::{AdhesionScene, Case, ContinuumScene, Length, REFERENCE_LOAD};
use asperity_contact::interface::{AttractionLaw, RangeChoice};
use asperity_contact::load::{Load, LoadStep};
use asperity_contact::method::{ContactMethod, Heights, MethodKind, ReducedProblem};
use asperity_contact::path::{EstimatorInput, LoadPathSolver};
use asperity_contact::problem::LentHeights;
use asperity_contact::results::ContinuumResults;
use asperity_grid::Grid;
use asperity_grid::sys::ranks::ALONE;
use asperity_surface::files::hashed::file_hash;
use std::cell::OnceCell;
use std::path::PathBuf;

/// Time per grid point and pair of Fourier transforms on one thread in f64, s. At 4096² a pair takes 190 ms, and vector
/// operations half as much again. An order of magnitude for `--dry-run`.
pub(super) const SECONDS_PER_POINT_PAIR: f64 = 17e-9;

/// A problem at laboratory scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Variant {
    /// The scene's own problem.
    Primary,
    /// The loading branch without adhesion.
    NonAdhesive,
    /// The loading branch with another range of adhesion, nm.
    Range(Length),
    /// The challenge's reference load without adhesion, by the cross-check method.
    CrossCheck,
    /// The loading branch by another method (id), with or without the scene's adhesion.
    Comparison(&'static str, bool),
}

/// Planned loads that take as many transform pairs as a pull-off: 34 to 125 on four maps of 64² to 192² points.
const PULL_OFF_LOADS: usize = 50;

/// Heights of a case, made on first use.
pub(super) struct SolvedHeights<'a> {
    case: &'a Case,
    heights: OnceCell<LentHeights<'a>>,
}

impl<'a> SolvedHeights<'a> {
    pub(super) fn new(case: &'a Case) -> Self {
        SolvedHeights { case, heights: OnceCell::new() }
    }

    pub(super) fn get(&self) -> Heights<'_> {
        self.heights.get_or_init(|| LentHeights::of(self.case.surface(), self.case.model.grid, &ALONE)).get()
    }
}

/// Memory and time to solve a case's problem on a grid at `loads` loads, including the heights.
pub(super) fn solve_cost(case: &Case, grid: Grid, loads: usize, machine: MachineSpeed) -> EstimatedCost {
    let method = asperity_methods::find(&case.scene.continuum.method).expect("checked with the scene");
    let cost = method_cost(&ReducedProblem { grid, ..case.problem(Heights::Planned(None)) }, method, loads, machine);
    EstimatedCost { bytes: cost.bytes + 8 * grid.points() as u64, ..cost }
}

/// Memory and time of any problem and method, without the heights.
fn method_cost(
    problem: &ReducedProblem,
    method: &dyn ContactMethod,
    loads: usize,
    machine: MachineSpeed,
) -> EstimatedCost {
    let plan = method.plan(problem);
    let pairs = plan.iterations as f64 * plan.pairs_per_iteration * loads as f64;
    let seconds = pairs * problem.grid.points() as f64 * SECONDS_PER_POINT_PAIR / machine.threads as f64;
    EstimatedCost { bytes: plan.bytes, seconds }
}

/// Memory of a load path, with its coarser grids, the contact stiffness and the pull-off; of an estimate that of its method.
pub(super) fn path_bytes(
    case: &Case,
    problem: ReducedProblem,
    method: &'static dyn ContactMethod,
    pulls_off: bool,
) -> u64 {
    if method.card().kind == MethodKind::Estimate {
        return EstimatorInput::plan(&problem, method).bytes;
    }
    let targets: Vec<_> = case.load_steps().iter().map(|s| s.target).collect();
    let path = LoadPathSolver::new(problem, method, case.model.resolution, 0.0, &targets);
    path.with_stiffness().with_map_errors(asks_for_maps(case)).plan(pulls_off).bytes
}

/// Whether the scene asks for errors of maps.
fn asks_for_maps(case: &Case) -> bool {
    case.scene.accuracy().is_some_and(|accuracy| accuracy.errors.has_maps())
}

/// Key of a stage that solves or estimates a variant.
pub(super) fn variant_key(case: &Case, name: &str, variant: Variant, dependencies: &[&StageKey]) -> Result<StageKey> {
    let scene = &case.scene;
    // Other variants do not affect this problem.
    let alone = scene.adhesion.clone().map(|a| AdhesionScene { also_nonadhesive: false, other_ranges: vec![], ..a });
    // The contents of the map, wherever it is.
    let map = scene.continuum.hardness_map.as_ref().map(|p| file_hash(&case.resolve_path(p))).transpose()?;
    let hardness_map = map.map(PathBuf::from);
    let own = ContinuumScene { compare_with: Vec::new(), hardness_map, ..scene.continuum.clone() };
    let targets: Vec<Load> = case.loading_steps().iter().map(|step| step.target).collect();
    let loading = (targets, &scene.load.maps_at);
    // Definition of p* = 1; with [challenge] the nominal gradient of the challenge's surface, not that of the height
    // file.
    let unit = case.gradient;
    let methods = &(&scene.methods, case.solved_grid());
    match variant {
        Variant::Primary => {
            let initial_gap = scene.continuum.initial_gap.as_ref();
            let initial_gap = initial_gap.map(|p| StageKey::of_file(&case.resolve_path(p))).transpose()?;
            let of_maps = asks_for_maps(case);
            StageKey::new(name, &(&scene.load, &alone, &own, methods, &initial_gap, (unit, of_maps)), dependencies)
        }
        Variant::NonAdhesive => StageKey::new(name, &(&loading, &own, methods, unit), dependencies),
        Variant::Range(range) => {
            let of_range = alone.map(|a| AdhesionScene { range, ..a });
            StageKey::new(name, &(&loading, of_range, &own, methods, unit), dependencies)
        }
        Variant::CrossCheck => StageKey::new(name, &(&scene.challenge, &own, methods, unit), dependencies),
        Variant::Comparison(..) => StageKey::new(name, &(&loading, &alone, &own, methods, unit), dependencies),
    }
}

/// Solves the scene's problem or a variant of it.
pub(super) struct SolveStage<'a> {
    pub case: &'a Case,
    pub variant: Variant,
}

/// Variants that a scene requests, in the order of solution, and messages about omitted ranges of adhesion.
pub(super) fn variants(case: &Case) -> (Vec<SolveStage<'_>>, Vec<String>) {
    let (mut list, mut left_out) = (Vec::new(), Vec::new());
    if case.solves() && case.solves_nonadhesive() {
        list.push(Variant::NonAdhesive);
    }
    let mut used: Vec<f64> = vec![case.model.range_used(case.model.adhesion)];
    for &wanted in case.scene.adhesion.iter().flat_map(|a| &a.other_ranges) {
        let range = case.model.range_used(case.adhesion_of_range(wanted));
        if used.contains(&range) {
            left_out
                .push(format!("range {wanted}: on this grid it becomes the same range as another; it is solved once"));
            continue;
        }
        used.push(range);
        list.push(Variant::Range(wanted));
    }
    if case.scene.challenge.is_some() {
        list.push(Variant::CrossCheck);
    }
    (list.into_iter().map(|variant| SolveStage { case, variant }).collect(), left_out)
}

impl SolveStage<'_> {
    /// Label of the variant; for the primary problem, its kernel.
    pub(super) fn label(&self) -> String {
        match self.variant {
            Variant::Primary => self.case.model.kernel.described(&SiNotation(self.case.scales)),
            Variant::NonAdhesive => "without adhesion".into(),
            Variant::Range(range) => format!("range {range}"),
            Variant::CrossCheck => "the reference load without adhesion".into(),
            Variant::Comparison(id, _) => id.into(),
        }
    }

    fn method(&self) -> &'static dyn ContactMethod {
        let scene = &self.case.scene;
        let id = match (self.variant, &scene.challenge) {
            (Variant::CrossCheck, Some(challenge)) => &challenge.cross_check_method,
            _ => &scene.continuum.method,
        };
        asperity_methods::find(id).expect("checked with the scene")
    }

    fn loads(&self) -> usize {
        match self.variant {
            Variant::Primary => self.case.load_steps().len(),
            Variant::CrossCheck => 1,
            _ => self.case.loading_steps().len(),
        }
    }
}

impl Stage for SolveStage<'_> {
    type Input<'i> = &'i SolvedHeights<'i>;
    type Output = ContinuumResults;

    fn name(&self) -> String {
        match self.variant {
            Variant::Primary => "continuum".into(),
            Variant::NonAdhesive => "non-adhesive".into(),
            Variant::Range(range) => format!("range-{range}").replace(' ', "-"),
            Variant::CrossCheck => "cross-check".into(),
            Variant::Comparison(id, _) => format!("method-{id}"),
        }
    }

    fn what(&self) -> String {
        let (n, grid) = (self.loads(), self.case.model.grid);
        let loads = if n == 1 { "load" } else { "loads" };
        format!("{} at {n} {loads} on {} x {} points, {}", self.method().card().id, grid.nx, grid.ny, self.label())
    }

    fn cost(&self, machine: MachineSpeed) -> EstimatedCost {
        let case = self.case;
        let problem = case.planned_problem();
        let pulls_off = self.variant == Variant::Primary && case.scene.load.pull_off;
        let loads = self.loads() + if pulls_off { PULL_OFF_LOADS } else { 0 };
        let own = method_cost(&problem, self.method(), loads, machine);
        // The plan has a copy of a series in the precision of the solver.
        let heights = problem.heights.series_bytes().unwrap_or(8 * case.model.grid.points() as u64);
        let is_primary = self.variant == Variant::Primary;
        let (leakage, subsurface) =
            (is_primary && case.scene.continuum.leakage, is_primary && case.subsurface().is_some());
        let observed = observed_bytes(&problem, leakage, subsurface);
        EstimatedCost { bytes: heights + observed + path_bytes(case, problem, self.method(), pulls_off), ..own }
    }

    fn keys(&self, dependencies: &[&StageKey]) -> Result<StageKeys> {
        variant_key(self.case, &self.name(), self.variant, dependencies).map(StageKeys::continued)
    }

    fn run(&self, heights: &SolvedHeights, context: &StageContext) -> Result<ContinuumResults> {
        laboratory(self.case, self.variant, heights.get(), context)
    }
}

/// Whether a method for comparison, which models no plastic flow, solves the elastic body in place of one with a hardness.
pub(super) fn is_elastic_in(case: &Case, method: &str) -> bool {
    case.planned_problem().hardness.is_some()
        && asperity_methods::find(method).is_some_and(|m| !m.card().capabilities.hardness)
}

/// Solves a case, or a variant of it, at its loads.
pub(super) fn laboratory(
    case: &Case,
    variant: Variant,
    heights: Heights,
    context: &StageContext,
) -> Result<ContinuumResults> {
    let scene = &case.scene;
    let primary = variant == Variant::Primary;
    let start = match &scene.continuum.initial_gap {
        Some(file) if primary => Some(start(&case.resolve_path(file), case.model.grid)?),
        _ => None,
    };
    let mut problem = case.problem(heights);
    let reference = [LoadStep::single(REFERENCE_LOAD, case.gradient)];
    let mut steps = if primary { case.load_steps() } else { case.loading_steps() };
    let mut method = scene.continuum.method.as_str();
    let (mut range, mut is_elastic) = (case.model.resolution, false);
    match variant {
        Variant::Primary => {}
        Variant::NonAdhesive => problem.adhesion = AttractionLaw::None,
        Variant::Range(range) => problem.adhesion = case.adhesion_of_range(range),
        Variant::CrossCheck => {
            problem.adhesion = AttractionLaw::None;
            method = scene.challenge.as_ref().map_or(method, |c| &c.cross_check_method);
            steps = &reference;
        }
        Variant::Comparison(id, adhesive) => {
            if !adhesive {
                problem.adhesion = AttractionLaw::None;
            }
            is_elastic = is_elastic_in(case, id);
            // The solution by the scene's own method already estimates the error of the range.
            range = if range == RangeChoice::Extrapolate { RangeChoice::Mesh } else { range };
            method = id;
        }
    }
    if is_elastic {
        problem.hardness = None;
    }
    let criterion =
        asperity_methods::find(method).expect("checked with the scene").criterion(&problem.settings).to_string();
    let maps = matches!(variant, Variant::Primary | Variant::NonAdhesive | Variant::Comparison(..));
    let request = PathRequest {
        problem,
        hardness_map: case.hardness_map.clone().filter(|_| !is_elastic),
        method,
        range,
        steps,
        pull_off: primary && scene.load.pull_off,
        start,
        gradient: case.gradient,
        scales: case.scales,
        units: case.given_units(),
        // Atoms are compared with the continuum at every load.
        outlasts_contact: primary && case.atoms.is_none(),
        hysteresis: primary && scene.load.loads().is_closed(),
        threshold: 0.0,
        leakage: primary && scene.continuum.leakage,
        map_errors: primary && asks_for_maps(case),
        subsurface: case.subsurface().filter(|_| primary),
        criterion,
        keep: &|step| {
            let keep = maps && step.maps;
            Keep { gap: keep, stress: keep }
        },
    };
    let mut results = load_path(request, context, "")?;
    results.pull_off = results.pull_off.map(|pull_off| pull_off.on(&case.problem.surface));
    Ok(results)
}
