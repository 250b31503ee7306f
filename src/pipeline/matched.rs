//! The matched continuum: solutions for the atoms' heights, elastic layer and loads, with which the atoms are compared.

use super::continuum::{Keep, PathRequest, load_path};
use super::folder::StageKey;
use super::laboratory::solve_cost;
use super::stage::{EstimatedCost, MachineSpeed, Stage, StageContext, StageKeys};
use crate::scene::{AtomsCase, AtomsScene, Case};
use crate::{Error, Result};
use asperity_contact::interface::{Elastic, NodalHardness, RangeChoice, Wall};
use asperity_contact::method::{Precision, ReducedProblem};
use asperity_contact::quantity::Quantity;
use asperity_contact::results::ContinuumResults;
use asperity_contact::state::State;
use asperity_contact::uncertainty::{UncertaintyComponent, UncertaintySource};
use asperity_grid::Grid;
use serde::{Deserialize, Serialize};

/// Tolerance of the matched solutions: rms KKT residual over the pressure. Gaps are then accurate to 0.001 Å.
const MATCHED_TOLERANCE: f64 = 1e-8;

/// Continuum solutions at the atoms' loads on their elastic layer: hard wall on the full heights, hard wall on the
/// atoms' heights, and compliant wall.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Matched {
    /// None if it did not converge.
    pub full: Option<ContinuumResults>,
    pub hard: ContinuumResults,
    pub compliant: ContinuumResults,
    /// Of [`YieldingStage`].
    #[serde(skip)]
    pub yielding: Option<ContinuumResults>,
}

/// Solves the matched continuum, and the continuum on the full heights if distributions are requested.
pub(super) struct MatchedStage<'a> {
    pub case: &'a Case,
    pub atoms: &'a AtomsCase,
    pub scene: &'a AtomsScene,
}

impl Stage for MatchedStage<'_> {
    type Input<'i> = ();
    type Output = Matched;

    fn name(&self) -> String {
        "matched".into()
    }

    fn what(&self) -> String {
        let (id, grid) = (self.case.method().id, self.atoms.matched);
        let depth = if self.case.judges_depth() { ", on a half-space" } else { "" };
        format!(
            "{id} on the atoms' heights, {} x {} points, hard and compliant wall{depth}, and on the full heights",
            grid.nx, grid.ny
        )
    }

    fn cost(&self, machine: MachineSpeed) -> EstimatedCost {
        let loads = self.case.load_steps().len();
        let solves = if self.case.judges_depth() { 3 } else { 2 };
        let own = solve_cost(self.case, self.atoms.matched, solves * loads, machine);
        let full = solve_cost(self.case, self.case.model.grid, loads, machine);
        EstimatedCost { bytes: own.bytes.max(full.bytes), seconds: own.seconds + full.seconds }
    }

    fn keys(&self, dependencies: &[&StageKey]) -> Result<StageKeys> {
        let (scene, continuum) = (self.scene, &self.case.scene.continuum);
        // The foundation enters the continuum only through the total depth.
        let layer = (profile_key(scene), scene.depth_cells + scene.foundation_depth());
        let method = (&continuum.method, &self.case.scene.methods, continuum.max_iterations);
        let (pair, crystal) = (pair_key(self.case), crystal_key(scene, self.atoms));
        let depends = (&self.case.scene.load, pair, method, layer, crystal, self.case.judges_depth());
        StageKey::new("matched", &depends, dependencies).map(StageKeys::continued)
    }

    fn run(&self, (): (), context: &StageContext) -> Result<Matched> {
        let (case, atoms) = (self.case, self.atoms);
        let (kernel, wall) = (atoms.kernel(), Wall::Hard);
        let (hardness, is_compliant) = (None, false);
        let hard = Matching { kernel, wall, hardness, is_compliant, tag: "hard wall", criterion: "zero gap" };
        // The full heights on the scene's grid, without low-pass filter and stretch factor.
        let whole = case.surface().heights(case.model.grid, 0.0);
        let full = Matching { tag: "full heights", ..hard };
        let full = match solve(case, atoms, (case.model.grid, &whole), full, context) {
            // This solution is auxiliary, and is omitted if it does not converge.
            Err(e @ Error::NotConverged { .. }) => {
                context.listener.warn(&format!("the continuum on the full heights is left out: {e}"));
                None
            }
            other => Some(other?),
        };
        let heights = reduced(atoms, atoms.heights_angstrom(case.surface(), atoms.matched));
        let mut matched = solve(case, atoms, (atoms.matched, &heights), hard, context)?;
        if case.judges_depth() {
            let deep = Matching { kernel: Elastic::HalfSpace, tag: "half-space", ..hard };
            let deep = match solve(case, atoms, (atoms.matched, &heights), deep, context) {
                // Auxiliary, too.
                Err(e @ Error::NotConverged { .. }) => {
                    context.listener.warn(&format!("what the depth of the block changes is not known: {e}"));
                    None
                }
                other => Some(other?),
            };
            let deep = |i: usize| deep.as_ref().and_then(|deep| deep.states.get(i));
            let states = matched.states.iter_mut().enumerate();
            states.for_each(|(i, state)| state.add_uncertainty(of_depth(state, deep(i))));
        }
        let compliant = compliant_wall(case, atoms, context)?;
        Ok(Matched { full, hard: matched, compliant, yielding: None })
    }
}

/// Solves the compliant-wall continuum with the crystal's hardness. A stage of its own, on which no atoms depend.
pub(super) struct YieldingStage<'a> {
    pub case: &'a Case,
    pub atoms: &'a AtomsCase,
    pub hardness_gpa: f64,
}

impl Stage for YieldingStage<'_> {
    type Input<'i> = ();
    /// None if it did not converge or the load exceeds the hardness.
    type Output = Option<ContinuumResults>;

    fn name(&self) -> String {
        "yielding".into()
    }

    fn what(&self) -> String {
        format!("the compliant wall with a hardness of {} GPa", self.hardness_gpa)
    }

    fn cost(&self, machine: MachineSpeed) -> EstimatedCost {
        solve_cost(self.case, self.atoms.matched, self.case.load_steps().len(), machine)
    }

    /// `dependencies`: key of the matched continuum.
    fn keys(&self, dependencies: &[&StageKey]) -> Result<StageKeys> {
        StageKey::new("yielding", &self.hardness_gpa, dependencies).map(StageKeys::continued)
    }

    fn run(&self, (): (), context: &StageContext) -> Result<Option<ContinuumResults>> {
        match yielding_wall(self.case, self.atoms, self.hardness_gpa, context) {
            // This solution is auxiliary, and is omitted if there is none.
            Err(e @ (Error::NotConverged { .. } | Error::Input { .. })) => {
                context.listener.warn(&format!("the compliant wall with hardness is left out: {e}"));
                Ok(None)
            }
            matched => matched.map(Some),
        }
    }
}

/// Parameters of the height profile of the atoms and of the matched continuum.
pub(super) fn profile_key(scene: &AtomsScene) -> impl Serialize + use<> {
    (scene.cells, scene.slope, scene.low_pass, scene.adhesion_range)
}

/// Resolved parameters of the crystal and of the indenter's repulsion.
pub(super) fn crystal_key<'a>(scene: &'a AtomsScene, atoms: &AtomsCase) -> impl Serialize + use<'a> {
    let r = atoms.wall.repulsion;
    let repulsion = [r.epsilon_ev, r.sigma_angstrom, r.contact_distance_angstrom];
    (&scene.element, atoms.block.a0, atoms.modulus_gpa, repulsion)
}

/// Adhesion parameters of the scene. The atoms have its work of adhesion, and its range enters the scaling audit. The
/// atoms' own range is part of [`profile_key`].
pub(super) fn pair_key(case: &Case) -> impl Serialize + use<> {
    case.scene.adhesion.as_ref().map(|a| (a.work_of_adhesion, a.range, a.law))
}

/// Effect of the block's finite depth on contact area and mean gap: relative difference from the half-space, if that is known.
fn of_depth(state: &State, deep: Option<&State>) -> [UncertaintyComponent; 2] {
    let part = |quantity, value: f64, deep: Option<f64>| {
        let relative = deep.map(|deep| (value / deep - 1.0).abs()).filter(|r| r.is_finite());
        UncertaintyComponent { quantity, source: UncertaintySource::Depth, relative, is_bound: false }
    };
    [
        part(Quantity::ContactArea, state.contact_area, deep.map(|s| s.contact_area)),
        part(Quantity::MeanGap, state.mean_gap.unwrap_or(f64::NAN), deep.and_then(|s| s.mean_gap)),
    ]
}

/// Solves the compliant-wall continuum at every load, and stores its gaps in the stage folder.
pub(super) fn compliant_wall(case: &Case, atoms: &AtomsCase, context: &StageContext) -> Result<ContinuumResults> {
    on_dilated_heights(case, atoms, ("compliant wall", None), context)
}

/// The same with a contact stress of at most the crystal's hardness.
fn yielding_wall(case: &Case, atoms: &AtomsCase, gpa: f64, context: &StageContext) -> Result<ContinuumResults> {
    on_dilated_heights(case, atoms, ("yielding wall", Some(gpa / atoms.modulus_gpa)), context)
}

fn on_dilated_heights(
    case: &Case,
    atoms: &AtomsCase,
    (tag, hardness): (&'static str, Option<f64>),
    context: &StageContext,
) -> Result<ContinuumResults> {
    let (kernel, wall, criterion) = (atoms.kernel(), Wall::Tabulated(atoms.compliant_law()), "the wall repels");
    let matching = Matching { kernel, wall, hardness, is_compliant: true, tag, criterion };
    // The wall law acts vertically. The dilated heights account for contact on slopes, where the nearest indenter atom
    // is not directly above.
    let heights = reduced(atoms, atoms.dilated_heights_angstrom(case.surface()));
    solve(case, atoms, (atoms.matched, &heights), matching, context)
}

/// Converts heights from Å to units of L.
pub(super) fn reduced(atoms: &AtomsCase, mut heights: Vec<f64>) -> Vec<f64> {
    heights.iter_mut().for_each(|h| *h /= atoms.block.length());
    heights
}

/// Kernel, wall and contact criterion of a matched solution.
#[derive(Clone, Copy)]
struct Matching {
    kernel: Elastic,
    wall: Wall,
    /// Over E*.
    hardness: Option<f64>,
    is_compliant: bool,
    tag: &'static str,
    criterion: &'static str,
}

fn solve(
    case: &Case,
    atoms: &AtomsCase,
    (grid, heights): (Grid, &[f64]),
    matching: Matching,
    context: &StageContext,
) -> Result<ContinuumResults> {
    let problem = ReducedProblem {
        kernel: matching.kernel,
        adhesion: atoms.matched_adhesion(matching.is_compliant),
        wall: matching.wall,
        hardness: matching.hardness.map(NodalHardness::Uniform),
        precision: Precision::F64,
        tolerance: MATCHED_TOLERANCE,
        max_iterations: case.scene.continuum.max_iterations,
        ..ReducedProblem::new(grid, heights)
    };
    let request = PathRequest {
        problem,
        hardness_map: None,
        method: &case.scene.continuum.method,
        // The range is that of the atoms' pair adhesion on any grid.
        range: RangeChoice::True,
        steps: case.load_steps(),
        pull_off: false,
        start: None,
        gradient: case.gradient,
        scales: atoms.scales,
        units: case.given_units().with(atoms.scales),
        outlasts_contact: false,
        hysteresis: false,
        threshold: 0.0,
        leakage: false,
        map_errors: false,
        subsurface: None,
        criterion: matching.criterion.into(),
        keep: &|_| Keep { gap: true, stress: true },
    };
    load_path(request, context, matching.tag)
}
