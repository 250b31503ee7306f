use crate::atoms::cost::{self, LoadingMode, memory_bytes};
use crate::atoms::nvt::MD_STEP_COST_RATIO;
use crate::atoms::unloading::STEP_REFINEMENT;
use crate::interface::Adhesion;
use crate::method;
use crate::path::{EstimatorInput, LoadPath};
use crate::record::results::AuditLine;
use crate::scene::{AtomsCase, Case, Start};
use crate::{Error, Result};
use serde::Serialize;

/// Seconds per point and transform pair with everything around it, one thread, f64: 190 ms for a pair at 4096² and half
/// as much again for vector passes. An order of magnitude for `--dry-run`, no promise.
pub(super) const SECONDS_PER_POINT_PAIR: f64 = 17e-9;

/// Maps, pictures and curves of a load, s, and what its points add: three loads took 0.54, 0.63 and 1.2 s with 512², 1024² and 2048².
const TELLING: (f64, f64) = (0.17, 6e-8);

/// The same of atoms with the comparison: three loads took 2.0, 2.8 and 11 s with 132², 396² and 1540² points.
const COMPARING: (f64, f64) = (0.6, 1.5e-6);

/// Share of the first-touch mean gap that is closed at a few per cent of p*: ū falls from 2.63 to 0.58 µm at p* = 0.03.
const CLOSED: f64 = 0.8;

/// LoadingMode in shorter steps, in ranges of the adhesion.
const PULLED_RANGES: f64 = 4.0;

/// What a run will do and take, before it starts.
#[derive(Debug, Serialize)]
pub struct RunPlan {
    pub stages: Vec<PlannedStage>,
    /// Largest memory of any stage, bytes.
    pub bytes: u64,
    pub seconds: f64,
    pub atoms: Option<PlannedAtoms>,
    pub audit: Vec<AuditLine>,
    pub warnings: Vec<String>,
}

#[derive(Debug, Serialize)]
pub struct PlannedStage {
    pub name: &'static str,
    pub what: String,
    pub bytes: u64,
    pub seconds: f64,
}

#[derive(Debug, Clone, Copy, Serialize)]
pub struct PlannedAtoms {
    pub deformable: u64,
    pub fixed: u64,
    pub indenter: u64,
    /// Processor time of a force evaluation, s an atom, and whether it was measured here.
    pub seconds_per_evaluation: f64,
    pub measured: bool,
}

impl RunPlan {
    /// # Errors
    /// `Memory` when this machine has less than the plan takes.
    pub fn fits(&self) -> Result<()> {
        let have = crate::sys::available_memory_bytes();
        if self.bytes <= have {
            return Ok(());
        }
        let advice = "a smaller surface.grid or atoms.cells needs less".into();
        Err(Error::Memory { what: "the scene".into(), need: self.bytes, have, advice })
    }
}

/// Loads of the way there, each counted once, and those of the way back.
fn loads_of_atoms(case: &Case) -> usize {
    case.rising_steps().len() + case.unloading_steps().len()
}

/// Steps of a ladder: those of the way down, on the way back as many, and the shorter ones in which a pull is followed.
fn steps_of_ladder(atoms: &AtomsCase, step_angstrom: f64) -> f64 {
    let down = CLOSED * atoms.first_touch_gap_angstrom / step_angstrom;
    let range = atoms.adhesion.map_or(0.0, |a| 1.0 / a.pair.kappa_per_angstrom);
    match atoms.unload {
        true => 2.0 * down + PULLED_RANGES * range / step_angstrom * STEP_REFINEMENT as f64,
        false => down,
    }
}

/// Plans a case on `threads` threads. `evaluation` is what LAMMPS takes here, s an atom and force evaluation
/// ([`super::speed`]); without it that of another machine.
pub fn plan(case: &Case, threads: usize, evaluation: Option<f64>) -> Result<RunPlan> {
    let loads = case.scene.load.count();
    let method = method::find(&case.scene.continuum.method).expect("checked with the scene");
    let empty: &[f64] = &[];
    let points = case.grid.points() as f64;
    let heights_bytes = 8 * case.grid.points() as u64;
    let solve = |grid: crate::grid::Grid, of: usize| {
        let problem = crate::method::Problem { grid, ..case.problem(empty.into()) };
        let p = method.plan(&problem);
        let pairs = p.iterations as f64 * p.pairs_per_iteration * of as f64;
        (p.bytes + 8 * grid.points() as u64, pairs * grid.points() as f64 * SECONDS_PER_POINT_PAIR / threads as f64)
    };
    let (own, seconds) = solve(case.grid, loads);
    // Coarser grids that the path takes with it, and what a pull-off holds.
    let problem = case.problem(empty.into());
    let path: Vec<_> = case.load_steps().iter().map(|s| s.target).collect();
    let alone = method.plan(&problem).bytes;
    let beside = LoadPath::new(problem, method, case.range(), 0.0, &path).plan(case.scene.load.pull_off).bytes;
    let bytes = own + (beside - alone);
    let mut stages = vec![PlannedStage {
        name: "surface",
        what: format!("{} x {} heights, statistics", case.grid.nx, case.grid.ny),
        bytes: 3 * heights_bytes,
        seconds: 40e-9 * points,
    }];
    if case.solves() {
        stages.push(PlannedStage {
            name: "continuum",
            what: format!("{} at {loads} load{}, {}", method.card().id, if loads == 1 { "" } else { "s" }, case.kernel),
            bytes,
            seconds,
        });
    }
    let scene = &case.scene;
    let there = case.loading_steps().len();
    let mut variant = |name: &'static str, what: String, method: &dyn method::ContactMethod, loads: usize| {
        let problem = crate::method::Problem { adhesion: Adhesion::None, ..case.problem(empty.into()) };
        let p = method.plan(&problem);
        let pairs = p.iterations as f64 * p.pairs_per_iteration * loads as f64;
        let bytes = p.bytes.max(own);
        stages.push(PlannedStage {
            name,
            what,
            bytes,
            seconds: pairs * points * SECONDS_PER_POINT_PAIR / threads as f64,
        });
    };
    if case.solves() && case.solves_nonadhesive() {
        variant("non-adhesive", format!("{} without adhesion, {there} loads", method.card().id), method, there);
    }
    for nm in scene.adhesion.iter().flat_map(|a| &a.other_ranges_nm) {
        variant("range", format!("{} with a range of {nm} nm, {there} loads", method.card().id), method, there);
    }
    if let Some(second) = scene.challenge.as_ref().and_then(|c| method::find(&c.cross_check_method)) {
        variant("cross-check", format!("{} at the reference load, without adhesion", second.card().id), second, 1);
    }
    for beside in super::methods::all(case) {
        let adhesion = if beside.adhesive { case.adhesion } else { Adhesion::None };
        let p = EstimatorInput::plan(&crate::method::Problem { adhesion, ..case.problem(empty.into()) }, beside.method);
        let pairs = p.iterations as f64 * p.pairs_per_iteration * there as f64;
        stages.push(PlannedStage {
            name: "method",
            what: format!("{}, {there} loads", beside.words()),
            bytes: p.bytes + heights_bytes,
            // Sums of estimates are on one thread, or nearly so.
            seconds: pairs * points * SECONDS_PER_POINT_PAIR / threads as f64 + p.seconds * there as f64,
        });
    }
    let mut atoms = None;
    if let (Some(a), Some(scene)) = (&case.atoms, &case.scene.atoms) {
        let indenter = (a.points * a.points) as u64;
        let each = evaluation.unwrap_or(cost::SECONDS_PER_ATOM_EVALUATION);
        let counts = PlannedAtoms {
            deformable: a.block.deformable(),
            fixed: a.block.fixed(),
            indenter,
            seconds_per_evaluation: each,
            measured: evaluation.is_some(),
        };
        let total = counts.deformable + counts.fixed + counts.indenter;
        let (way, words) = match a.start {
            Start::Touch => {
                let steps = steps_of_ladder(a, scene.step_or_default());
                let back = if a.unload { ", there and back" } else { "" };
                (
                    LoadingMode::RampSteps(steps),
                    format!("about {steps:.0} steps of {} Å{back}", scene.step_or_default()),
                )
            }
            Start::Continuum => {
                let number = loads_of_atoms(case);
                let words = format!("{number} load{} from the continuum", if number == 1 { "" } else { "s" });
                (LoadingMode::PrescribedLoads { number, force_tolerance: scene.force_tolerance_ev_per_angstrom }, words)
            }
        };
        let evaluations = cost::evaluations(a.block.cells, a.block.depth_cells, way);
        let (bytes, matched_seconds) = solve(a.matched, if scene.depth_error { 3 } else { 2 } * loads);
        let full = case.requested_outputs().distributions;
        let (full_bytes, full_seconds) = if full { solve(case.grid, loads) } else { (0, 0.0) };
        stages.push(PlannedStage {
            name: "matched",
            what: format!(
                "{} on the atoms' heights, {} x {} points, hard and soft wall{}",
                method.card().id,
                a.matched.nx,
                a.matched.ny,
                if full { ", and on the full heights" } else { "" }
            ),
            bytes: bytes.max(full_bytes),
            seconds: matched_seconds + full_seconds,
        });
        stages.push(PlannedStage {
            name: "lammps",
            what: format!("{total} atoms, {words}, about {evaluations:.0} force evaluations"),
            bytes: memory_bytes(total, scene.ranks, a.start == Start::Touch),
            seconds: cost::seconds(total, evaluations, way, each, scene.ranks),
        });
        stages.push(PlannedStage {
            name: "atoms",
            what: "contact, gap and frames at the asked loads".into(),
            bytes: 200 * total,
            seconds: 2e-6 * total as f64 * loads as f64,
        });
        if let Some(hold) = &a.nvt {
            let there = case.rising_steps().len();
            let steps = hold.steps() * there;
            stages.push(PlannedStage {
                name: super::nvt::STAGE,
                what: format!(
                    "{there} load{} at {} K, {} ps each, {steps} time steps",
                    if there == 1 { "" } else { "s" },
                    hold.temperature_k,
                    hold.time_ps
                ),
                bytes: memory_bytes(total, scene.ranks, true),
                seconds: MD_STEP_COST_RATIO * total as f64 * each * steps as f64 / scene.ranks as f64,
            });
        }
        atoms = Some(counts);
    }
    let (what, told, (a_load, a_point)) = match &case.atoms {
        Some(a) => ("comparison, pictures and curves", a.matched.points(), COMPARING),
        None => ("pictures and curves", case.grid.points(), TELLING),
    };
    stages.push(PlannedStage {
        name: "report",
        what: what.into(),
        bytes: 24 * told as u64,
        seconds: loads as f64 * (a_load + a_point * told as f64),
    });
    Ok(RunPlan {
        bytes: stages.iter().map(|s| s.bytes).max().unwrap_or(0),
        seconds: stages.iter().map(|s| s.seconds).sum(),
        stages,
        atoms,
        audit: case.atoms.as_ref().map_or(Vec::new(), |a| a.audit.clone()),
        warnings: case.warnings.clone(),
    })
}
