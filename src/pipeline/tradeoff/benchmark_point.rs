//! Settings of a benchmark: method, grid, precision and tolerance.

use crate::pipeline::laboratory::{SECONDS_PER_POINT_PAIR, path_bytes};
use crate::pipeline::methods::MethodRun;
use crate::record::tradeoff::{BlockSize, Setting};
use crate::scene::{Case, Scene};
use crate::{Error, Result};
use asperity_contact::method::{ContactMethod, Heights, MethodKind, Precision, ReducedProblem};
use asperity_contact::problem::default_tolerance;
use asperity_surface::HeightSource;
use serde::Serialize;

/// Tolerances in addition to the scene's, over the pressure: from a coarse one, with inaccurate areas, to that of the
/// reference.
const TOLERANCES: [f64; 4] = [1e-2, 1e-4, 1e-6, 1e-8];

/// Largest tolerance of the reference: the default of f64.
pub(super) const REFERENCE_TOLERANCE: f64 = 1e-8;

/// Points per side of the coarsest grid that is compared.
pub(super) const COARSEST: usize = 16;

/// Number of default grids below the scene's, each with half the points per side of the previous one.
pub(super) const GRIDS_BELOW: usize = 2;

/// A setting: method, grid, precision and tolerance.
#[derive(Clone, Copy)]
pub(super) struct BenchmarkPoint {
    pub method_run: MethodRun,
    /// Points in x.
    pub n: usize,
    pub precision: Precision,
    pub tolerance: f64,
    /// Block of an atomistic setting. `n` is then the number of indenter points per side, and `tolerance` the force
    /// tolerance in eV/Å.
    pub block: Option<BlockSize>,
    /// Filter of the heights; None for the scene's own heights.
    pub filter: Option<LowPass>,
}

/// Low-pass filter of heights.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct LowPass {
    /// Shortest wavelength that is kept, units of L.
    pub low_pass: f64,
    /// Factor on the filtered heights.
    pub stretch: f64,
}

impl BenchmarkPoint {
    /// A setting with the scene's own heights.
    pub(super) fn on_grid(method_run: MethodRun, n: usize, precision: Precision, tolerance: f64) -> Self {
        BenchmarkPoint { method_run, n, precision, tolerance, block: None, filter: None }
    }

    pub(super) fn id(&self) -> &'static str {
        self.method_run.method.card().id
    }

    /// Name of the stage and of its folder.
    pub(super) fn stage(&self) -> String {
        let adhesive = if self.method_run.adhesive { "-adhesive" } else { "" };
        let filter = self.filter.map_or(String::new(), |f| format!("-low-pass-{:.5}", f.low_pass));
        if let Some(block) = self.block {
            return format!("point-{}{adhesive}-{block}", self.id());
        }
        let (id, precision) = (self.id(), precision_name(self.precision));
        format!("point-{id}{adhesive}-{}-{precision}-{:e}{filter}", self.n, self.tolerance)
    }

    /// Description for progress messages and warnings.
    pub(super) fn label(&self) -> String {
        let with = if self.method_run.adhesive { " with adhesion" } else { "" };
        let waves = self.filter.map_or(String::new(), |f| format!(", waves down to {:.3} L", f.low_pass));
        if let Some(block) = self.block {
            return format!("{}{with}, a block of {block} cells", self.id());
        }
        let (id, precision) = (self.id(), precision_name(self.precision));
        format!("{id}{with}, {} points per side, {precision} to {:e}{waves}", self.n, self.tolerance)
    }

    pub(super) fn setting(&self, ny: usize) -> Setting {
        Setting {
            method: self.id().into(),
            adhesive: self.method_run.adhesive,
            nx: self.n,
            ny,
            precision: precision_name(self.precision).into(),
            tolerance: self.tolerance,
            block: self.block,
        }
    }

    pub(super) fn planned_bytes(&self, case: &Case) -> u64 {
        path_bytes(case, problem(case, &self.method_run), self.method_run.method, false)
    }

    /// Expected time of one run, s, from the plan of the method. An order of magnitude.
    pub(super) fn expected_seconds(&self, case: &Case) -> f64 {
        let plan = self.method_run.method.plan(&problem(case, &self.method_run));
        let pairs = plan.iterations as f64 * plan.pairs_per_iteration;
        let threads = rayon::current_num_threads() as f64;
        let of_pairs = pairs * case.model.grid.points() as f64 * SECONDS_PER_POINT_PAIR / threads;
        case.loading_steps().len() as f64 * (of_pairs + plan.seconds)
    }
}

/// The problem of which a method plans the cost.
pub(super) fn problem<'a>(case: &'a Case, method_run: &MethodRun) -> ReducedProblem<'a> {
    let problem = case.problem(Heights::Planned(None));
    if method_run.adhesive {
        problem
    } else {
        ReducedProblem { adhesion: asperity_contact::interface::AttractionLaw::None, ..problem }
    }
}

/// Name of the precision in JSON.
pub(super) fn precision_name(precision: Precision) -> &'static str {
    match precision {
        Precision::F32 => "f32",
        Precision::F64 => "f64",
    }
}

/// The scene common to all settings: surface, loads and adhesion, without additional solutions.
pub(super) fn bare(case: &Case) -> Scene {
    let mut scene = case.scene.clone();
    scene.atoms = None;
    scene.load.pull_off = false;
    let c = &mut scene.continuum;
    (c.method, c.initial_gap) = ("auto".into(), None);
    c.compare_with.clear();
    if let Some(a) = &mut scene.adhesion {
        (a.also_nonadhesive, a.other_ranges) = (false, Vec::new());
    }
    scene
}

/// The case of a setting.
///
/// # Errors
/// `Input` if the grid does not resolve the surface, or does not fit the height map.
pub(super) fn at(case: &Case, point: &BenchmarkPoint) -> Result<Case> {
    let mut case_at_point = on_grid(case, point.n)?;
    case_at_point.scene.continuum.precision = point.precision;
    case_at_point.scene.continuum.tolerance = Some(point.tolerance);
    (case_at_point.model.precision, case_at_point.model.tolerance) = (point.precision, point.tolerance);
    Ok(case_at_point)
}

/// The case with `n` points in x.
pub(super) fn on_grid(case: &Case, n: usize) -> Result<Case> {
    let full_grid = case.model.grid;
    if n == full_grid.nx {
        return Ok(case.clone());
    }
    match case.surface() {
        HeightSource::Imported { .. } => {
            let ny = n * full_grid.ny / full_grid.nx;
            let even = n < full_grid.nx && full_grid.nx.is_multiple_of(n) && ny * (full_grid.nx / n) == full_grid.ny;
            if !even || case.is_non_periodic() {
                let accepted = if case.is_non_periodic() {
                    format!("{}, the map's own: heights that do not repeat are on no other grid", full_grid.nx)
                } else {
                    format!(
                        "{}, the map's own, or that over a whole number which divides both of its sides",
                        full_grid.nx
                    )
                };
                return Err(Error::input(case.file.display(), "--grids", n, accepted));
            }
            let mut case_on_grid = case.clone();
            (case_on_grid.model.grid.nx, case_on_grid.model.grid.ny) = (n, ny);
            Ok(case_on_grid)
        }
        _ => {
            let mut scene = case.scene.clone();
            scene.surface.grid = n;
            Case::resolve(scene, &case.file)
        }
    }
}

/// `n` and up to `count` successive halves, as long as they are integers and at least [`COARSEST`].
pub(super) fn halves(n: usize, count: usize) -> Vec<usize> {
    let half = |n: &usize| (n.is_multiple_of(2) && n / 2 >= COARSEST).then_some(n / 2);
    std::iter::successors(Some(n), half).take(count + 1).collect()
}

/// Tolerance at which methods and grids are compared: the scene's if it is for f64, or the default.
pub(super) fn base_tolerance(case: &Case) -> f64 {
    match (case.scene.continuum.precision, case.scene.continuum.tolerance) {
        (Precision::F64, Some(t)) => t,
        _ => default_tolerance(Precision::F64, case.model.grid),
    }
}

/// Other precisions and tolerances of a setting; none for estimators.
pub(super) fn refinements(point: &BenchmarkPoint, case: &Case) -> Vec<BenchmarkPoint> {
    let method: &dyn ContactMethod = point.method_run.method;
    if method.card().kind == MethodKind::Estimate {
        return Vec::new();
    }
    // At low loads rounding errors prevent f32 from reaching its default tolerance, so a coarser one is added.
    let single = [default_tolerance(Precision::F32, case.model.grid), TOLERANCES[0]];
    let single = single.map(|tolerance| BenchmarkPoint { precision: Precision::F32, tolerance, ..*point });
    let others = TOLERANCES.into_iter().filter(|t| *t != point.tolerance);
    single.into_iter().chain(others.map(|tolerance| BenchmarkPoint { tolerance, ..*point })).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_halve_as_long_as_they_can() {
        assert_eq!(halves(128, 2), [128, 64, 32]);
        assert_eq!(halves(40, 5), [40, 20]);
        assert_eq!(halves(81, 2), [81]);
    }

    #[test]
    fn solvers_have_an_expected_time_and_other_precisions_and_tolerances() {
        let scene = "name = \"t\"\n[surface]\ngrid = 64\n[load]\np_star = [0.01]\n";
        let file = std::path::Path::new("t.toml");
        let case = Case::resolve(Scene::parse(scene, file).expect("a scene"), file).expect("a case");
        let method = asperity_methods::find("gfmd").expect("registered");
        let point = BenchmarkPoint::on_grid(MethodRun { method, adhesive: false }, 64, Precision::F64, 1e-8);
        assert!(point.expected_seconds(&case) > 0.0);
        let refined = refinements(&point, &case);
        assert_eq!(refined.len(), 5);
        let of =
            |precision| refined.iter().filter(|p| p.precision == precision).map(|p| p.tolerance).collect::<Vec<_>>();
        assert_eq!((of(Precision::F32), of(Precision::F64)), (vec![1e-3, 1e-2], vec![1e-2, 1e-4, 1e-6]));
    }
}
