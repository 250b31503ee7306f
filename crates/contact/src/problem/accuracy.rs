//! Accuracy as an argument: grids are solved from coarse to fine until the stated errors are within what is asked for.

use super::error_targets::{ErrorTargets, StatedQuantity};
use super::{
    Arguments, Body, Field, Hardness, LoadKind, LoadPath, Loads, Monitor, Names, Problem, Progress, default_tolerance,
};
use crate::method::MethodKind;
use crate::quantity::Quantity;
use crate::results::PullOff;
use crate::state::State;
use crate::uncertainty::total;
use asperity_grid::error::Complaint;
use asperity_grid::{Error, Result};
use asperity_surface::{HeightSource, Surface};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

/// What is asked for: errors, or the least errors within a time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Accuracy {
    /// Largest accepted errors.
    pub errors: ErrorTargets,
    /// Time after which no finer grid is begun, s.
    pub budget_seconds: Option<f64>,
}

/// Why no finer grid is solved.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum LastGrid {
    /// Every error is within what is asked for.
    Met,
    /// There is none: the map has no further nodes, and its waves may go down to two of them.
    #[default]
    Map,
    /// The next one has more than sixteen nodes on the shortest wave ([`Surface::NODES_PER_WAVE`]).
    Waves,
    /// It would take longer than the budget.
    Budget,
    /// It does not fit into memory.
    Memory,
    /// No finer one converged.
    NotConverged,
}

/// Largest relative errors of the states on a grid; `None` where one is not known.
pub type GridErrors = BTreeMap<StatedQuantity, Option<f64>>;

/// A grid that was solved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct SolvedGrid {
    /// Nodes along x.
    pub nx: usize,
    /// Nodes along y.
    pub ny: usize,
    /// Wall time, s.
    pub seconds: f64,
    /// Largest relative errors over the loads, of every quantity that is judged.
    pub errors: GridErrors,
}

/// The grids that were solved to reach an accuracy, from coarse to fine. The last one gives the results.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct AccuracyResults {
    /// Largest accepted errors.
    pub requested: ErrorTargets,
    /// Accepted time, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub budget_seconds: Option<f64>,
    /// From coarse to fine.
    pub grids: Vec<SolvedGrid>,
    /// Why the last grid is the last.
    pub last: LastGrid,
    /// Finer grids that the surface has.
    pub finer: usize,
}

/// Time to reach an error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ErrorCost {
    /// Of the grids up to the first that has it, s.
    Measured(f64),
    /// Extrapolated from the last two grids, s.
    Estimated(f64),
}

impl AccuracyResults {
    /// Whether every error is within what is asked for.
    pub fn is_met(&self) -> bool {
        self.last == LastGrid::Met
    }

    /// The quantities whose error is larger than what is asked for, or not known.
    pub fn exceeded(&self) -> impl Iterator<Item = (StatedQuantity, Option<f64>)> {
        let accepted = |q: StatedQuantity| self.requested.of(q).unwrap_or(f64::INFINITY);
        let errors = self.grids.last().into_iter().flat_map(|grid| &grid.errors).map(|(q, error)| (*q, *error));
        errors.filter(move |(q, error)| error.is_none_or(|e| e > accepted(*q)))
    }

    /// Wall time of all grids, s.
    pub fn seconds(&self) -> f64 {
        self.grids.iter().map(|g| g.seconds).sum()
    }

    /// The largest error over what is accepted; infinite where one is not known.
    fn excess(&self, grid: &SolvedGrid) -> f64 {
        let ratio = |(q, error): (&StatedQuantity, &Option<f64>)| match (error, self.requested.of(*q)) {
            (_, None) => 0.0,
            (None, _) => f64::INFINITY,
            (Some(error), Some(accepted)) => error / accepted,
        };
        grid.errors.iter().map(ratio).fold(0.0, f64::max)
    }

    /// What errors `factor` times those asked for would have cost, where the grids tell it.
    pub fn cost_of(&self, factor: f64) -> Option<ErrorCost> {
        if self.requested.is_empty() {
            return None;
        }
        let mut seconds = 0.0;
        for grid in &self.grids {
            seconds += grid.seconds;
            if self.excess(grid) <= factor {
                return Some(ErrorCost::Measured(seconds));
            }
        }
        let [.., before, last] = &self.grids[..] else { return None };
        let [coarse, fine] = [before, last].map(|grid| self.excess(grid));
        let per_grid = coarse / fine;
        let further = ((fine / factor).ln() / per_grid.ln()).ceil();
        let found = per_grid.is_finite() && per_grid > LEAST_DECREASE && further <= self.finer as f64;
        let more: f64 = (1..=further as i32).map(|k| last.seconds * GROWTH.powi(k)).sum();
        found.then_some(ErrorCost::Estimated(seconds + more))
    }
}

/// Least factor by which a grid decreases the errors, for an extrapolation.
const LEAST_DECREASE: f64 = 1.1;

/// Growth of the time from grid to grid: 4 to 7.7 were measured from 256² to 2048² nodes, the more the less of the fields the caches hold.
const GROWTH: f64 = 5.5;

/// Of four times as many nodes at least.
const LEAST_GROWTH: f64 = 4.0;

/// The same for the next grid, with which the budget is not to be exceeded.
const PLANNED_GROWTH: f64 = 7.0;

/// Residual over the least error: the area changes by less than 1e-8 at a residual of 1e-4, by 1.5e-3 at 1e-3 (1024² nodes of the challenge's
/// surface).
const RESIDUAL_PER_ERROR: f64 = 1e-3;

/// Error for which the residual is chosen where only a time is asked for.
const LEAST_OF_BUDGET: f64 = 1e-3;

impl Accuracy {
    /// The tolerance of the residual that suffices on the grid of a problem. With adhesion the usual one: near an instability a larger
    /// residual loses the branch.
    pub fn tolerance(&self, problem: &Problem) -> f64 {
        let usual = default_tolerance(problem.precision, problem.surface.grid());
        let suffices = RESIDUAL_PER_ERROR * self.errors.least().unwrap_or(LEAST_OF_BUDGET);
        if problem.attracts() { usual } else { suffices.min(1e-4).max(usual) }
    }

    /// Errors of the states on a grid, and of their pull-off, as far as they are asked for.
    /// `gaps_imposed`: the loads are mean gaps. `pull_off`: the relative error of one that was found.
    pub fn errors_of(&self, gaps_imposed: bool, states: &[State], pull_off: Option<Option<f64>>) -> GridErrors {
        let mut errors = GridErrors::new();
        for quantity in StatedQuantity::ALL {
            if self.errors.of(quantity).is_none() && (quantity.is_map() || !self.errors.is_empty()) {
                continue;
            }
            let named = self.errors.names(quantity);
            let mut judged: Vec<Option<f64>> =
                states.iter().filter_map(|state| error_of(state, gaps_imposed, quantity)).collect();
            if quantity == StatedQuantity::PullOff {
                judged.extend(pull_off);
            }
            let largest = judged.iter().copied().try_fold(0.0f64, |most, error| Some(most.max(error?)));
            if !judged.is_empty() || named {
                errors.insert(quantity, if judged.is_empty() { None } else { largest });
            }
        }
        errors
    }

    /// Solves on the [refinements](Surface::refinements) of a surface, one after another, with `solve`, which returns the errors on the
    /// nodes, and the seconds of an earlier solve whose results it read. Grids without convergence are passed over.
    ///
    /// # Errors
    /// Those of `solve`, but too little memory and no convergence only where no grid was solved.
    pub fn refine(
        &self,
        surface: &Surface,
        solve: impl FnMut([usize; 2]) -> Result<(GridErrors, Option<f64>)>,
    ) -> Result<AccuracyResults> {
        let is_map = matches!(surface.source(), HeightSource::Imported { .. });
        self.refine_through(&surface.refinements(), if is_map { LastGrid::Map } else { LastGrid::Waves }, solve)
    }

    /// The same through these grids, of which none is finer for the reason `last`.
    fn refine_through(
        &self,
        refinements: &[[usize; 2]],
        last: LastGrid,
        mut solve: impl FnMut([usize; 2]) -> Result<(GridErrors, Option<f64>)>,
    ) -> Result<AccuracyResults> {
        let begin = Instant::now();
        let (requested, budget_seconds) = (self.errors.clone(), self.budget_seconds);
        let mut results = AccuracyResults { requested, budget_seconds, grids: Vec::new(), last, finer: 0 };
        for (i, &[nx, ny]) in refinements.iter().enumerate() {
            if !results.grids.is_empty() && self.is_over(begin, &results.grids) {
                results.last = LastGrid::Budget;
                break;
            }
            let start = Instant::now();
            let (errors, earlier) = match solve([nx, ny]) {
                Ok(solved) => solved,
                Err(Error::Memory { .. }) if !results.grids.is_empty() => {
                    results.last = LastGrid::Memory;
                    break;
                }
                Err(Error::NotConverged { .. }) if i + 1 < refinements.len() => continue,
                Err(Error::NotConverged { .. }) if !results.grids.is_empty() => {
                    results.last = LastGrid::NotConverged;
                    break;
                }
                Err(error) => return Err(error),
            };
            let seconds = earlier.unwrap_or_else(|| start.elapsed().as_secs_f64());
            results.grids.push(SolvedGrid { nx, ny, seconds, errors });
            results.finer = refinements.len() - 1 - i;
            let last = results.grids.last().expect("pushed");
            if !self.errors.is_empty() && results.excess(last) <= 1.0 {
                results.last = LastGrid::Met;
                break;
            }
        }
        Ok(results)
    }

    /// Whether another grid would exceed the budget.
    fn is_over(&self, begin: Instant, grids: &[SolvedGrid]) -> bool {
        let Some(budget) = self.budget_seconds else { return false };
        let growth = match grids {
            [.., before, last] if last.nx == 2 * before.nx => {
                (last.seconds / before.seconds).clamp(LEAST_GROWTH, PLANNED_GROWTH)
            }
            _ => PLANNED_GROWTH,
        };
        let next = growth * grids.last().map_or(0.0, |g| g.seconds);
        begin.elapsed().as_secs_f64() + next > budget
    }
}

/// Contact area from which on the gap is closed: what is left of it has no relative error.
pub const ALMOST_FULL: f64 = 0.999;

impl Accuracy {
    /// Why a problem cannot be solved to an accuracy. `leakage`: whether the flow through the gap is solved.
    pub fn issues(&self, problem: &Problem, loads: &Loads, leakage: bool, names: &dyn Names) -> Vec<Complaint> {
        let mut list = Vec::new();
        let mut refuse = |is_so: bool, key: String, found: String, accepted: &str| {
            if is_so {
                list.push(Complaint::new(key, found, accepted));
            }
        };
        let given = || "given".to_string();
        let name = |field| names.name(field);
        let with_error = name(Field::Error);
        let card = problem.method.card();
        let of_grids = format!("none with {with_error}, which solves on several grids");
        refuse(problem.initial_gap.is_some(), name(Field::InitialGap), given(), &of_grids);
        let by_pressure = format!("with {with_error} a pressure, force or mean gap, which is the same on every grid");
        let varies = matches!(loads.kind, LoadKind::Contact | LoadKind::Displacement);
        refuse(varies, name(loads.kind.field()), given(), &by_pressure);
        let fields = format!("with {with_error} a method that solves for the fields");
        refuse(card.kind != MethodKind::Solver, name(Field::Method), card.id.into(), &fields);
        let coarser =
            format!("with {with_error} a periodic surface: others have no coarser grids, and no error is stated");
        refuse(problem.body == Body::NonPeriodic, name(Field::Periodic), "not periodic".into(), &coarser);
        let asked = |quantity| self.errors.names(quantity);
        let flow = "an error of it only where the leakage is solved";
        refuse(asked(StatedQuantity::Leakage) && !leakage, with_error.clone(), "leakage".into(), flow);
        let pull = "an error of it only where the pull-off is searched for";
        refuse(asked(StatedQuantity::PullOff) && !loads.pull_off, with_error.clone(), "pull_off".into(), pull);
        let imposed = asked(StatedQuantity::MeanGap) && loads.kind == LoadKind::MeanGap;
        refuse(imposed, with_error, "mean_gap".into(), "no error of the mean gap where it is imposed");
        list
    }
}

/// Relative error of a quantity of a state: `None` where the state has none, as at first contact and at full contact, or an imposed value;
/// `Some(None)` where it is not known.
fn error_of(state: &State, gap_imposed: bool, stated: StatedQuantity) -> Option<Option<f64>> {
    if state.pressure == 0.0 || state.contact_area == 0.0 {
        return None;
    }
    let is_full = state.contact_area >= ALMOST_FULL;
    match stated {
        StatedQuantity::ContactArea => Some(total(&state.uncertainty, Quantity::ContactArea)),
        StatedQuantity::MeanGap => (!gap_imposed && !is_full).then(|| total(&state.uncertainty, Quantity::MeanGap)),
        StatedQuantity::Stiffness => state.stiffness.map(|_| total(&state.uncertainty, Quantity::Stiffness)),
        StatedQuantity::Leakage => {
            state.leakage.filter(|flow| flow.conductivity.iter().all(|c| *c > 0.0)).map(|flow| {
                let [x, y] = flow.hydraulic_gaps();
                flow.gap_errors.map(|[of_x, of_y]| (1.0 + (of_x / x).max(of_y / y)).powi(3) - 1.0)
            })
        }
        StatedQuantity::GapMap => (!is_full).then(|| state.map_errors.map(|e| e.gap)),
        StatedQuantity::ContactMap => (!is_full).then(|| state.map_errors.map(|e| e.contact)),
        StatedQuantity::PullOff => None,
    }
}

/// Named in errors.
const PLACE: &str = "problem";

/// Without the warnings of grids that do not give the results.
struct Quiet<'m>(&'m dyn Monitor);

impl Monitor for Quiet<'_> {
    fn progress(&self, progress: Progress) -> ControlFlow<()> {
        self.0.progress(progress)
    }

    fn stop_requested(&self) -> bool {
        self.0.stop_requested()
    }
}

impl Problem {
    /// Equilibria under `loads` on the coarsest grid whose stated errors are within what is asked for, or on the finest that the surface, the
    /// memory and the budget allow. The grid of the surface is one of those tried; a spectrum goes on to finer ones.
    ///
    /// # Errors
    /// As [`Problem::visit_load_path`]; `Input` for what has no stated error.
    ///
    /// ```
    /// use asperity_contact::problem::{Accuracy, LoadKind, Loads, Problem, Progress};
    /// use asperity_surface::{Spectrum, Surface, SynthesisOptions};
    /// use std::ops::ControlFlow;
    ///
    /// let spectrum = Spectrum { lambda_s: 1.0 / 8.0, ..Spectrum::CHALLENGE };
    /// let surface = Surface::from_spectrum(spectrum, SynthesisOptions { nodes: 64, length: 1.0, seed: 1 })?;
    /// let accuracy = Accuracy { errors: "20%".parse().unwrap(), ..Accuracy::default() };
    /// let loads = Loads::new(LoadKind::PStar, [0.1]);
    /// let watch = |_: Progress| ControlFlow::Continue(());
    /// let (path, reached) = Problem::new(surface, 1.0).load_path_within(&accuracy, &loads, &watch)?;
    /// assert!(reached.is_met() && path.states[0].contact_area_error.unwrap() < 0.2 * path.states[0].contact_area);
    /// # Ok::<(), asperity_contact::Error>(())
    /// ```
    pub fn load_path_within(
        &self,
        accuracy: &Accuracy,
        loads: &Loads,
        monitor: &dyn Monitor,
    ) -> Result<(LoadPath, AccuracyResults)> {
        let list = accuracy.issues(self, loads, false, &Arguments);
        if !list.is_empty() {
            return Err(Error::Input { place: PLACE.into(), list });
        }
        let (quiet, mut found) = (Quiet(monitor), None);
        // The series of a map is made once.
        let [nx, ny] = self.surface.refinements()[0];
        let coarsest = self.surface.on_nodes(nx, ny);
        let reached = accuracy.refine(&self.surface, |nodes| {
            let problem = self.on_nodes(nodes, &coarsest);
            let tolerance = accuracy.tolerance(&problem);
            let problem = Problem { tolerance: self.tolerance.or(Some(tolerance)), ..problem };
            let path = problem.watched_load_path(loads, accuracy.errors.has_maps(), &quiet)?;
            let gaps_imposed = loads.kind == LoadKind::MeanGap;
            let errors =
                accuracy.errors_of(gaps_imposed, &path.states, path.pull_off.as_ref().map(PullOff::relative_error));
            found = Some((problem, path));
            Ok((errors, None))
        })?;
        let (problem, path) = found.expect("one grid at least is solved");
        let is_map = matches!(self.surface.source(), HeightSource::Imported { .. });
        monitor.warnings(&if is_map { self } else { &problem }.warnings(loads)?);
        Ok((path, reached))
    }

    /// The same problem on other nodes, for [`Accuracy::refine`]. `coarsest`: its surface on any nodes but its own, whose series is shared.
    pub fn on_nodes(&self, [nx, ny]: [usize; 2], coarsest: &Surface) -> Self {
        let own = (ny, nx) == self.surface.shape();
        let surface = if own { self.surface.clone() } else { coarsest.on_nodes(nx, ny) };
        let hardness = match &self.hardness {
            Some(Hardness::Map(map)) if !map.is_on(nx, ny) => Some(Hardness::Map(Arc::new(map.restricted(nx, ny)))),
            other => other.clone(),
        };
        Problem { surface, hardness, ..self.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interface::HardnessMap;
    use asperity_surface::{Spectrum, SynthesisOptions};

    fn asked(errors: &str, budget_seconds: Option<f64>) -> Accuracy {
        Accuracy { errors: errors.parse().expect("errors"), budget_seconds }
    }

    fn area(error: f64) -> GridErrors {
        GridErrors::from([(StatedQuantity::ContactArea, Some(error))])
    }

    const GRIDS: [[usize; 2]; 4] = [[32, 32], [64, 64], [128, 128], [256, 256]];

    /// The error is 1/n.
    fn inverse([nx, _]: [usize; 2]) -> Result<(GridErrors, Option<f64>)> {
        Ok((area(1.0 / nx as f64), None))
    }

    #[test]
    fn the_first_grid_with_the_error_gives_the_results() {
        let found = asked("1%", None).refine_through(&GRIDS, LastGrid::Map, inverse).expect("solved");
        assert!(found.is_met() && found.grids.len() == 3 && found.exceeded().count() == 0);
        let found = asked("0.1%", None).refine_through(&GRIDS, LastGrid::Map, inverse).expect("solved");
        assert!(found.last == LastGrid::Map && found.grids.len() == 4);
        // An error that is not known is not met.
        let unknown = |_| Ok((GridErrors::from([(StatedQuantity::ContactArea, None)]), None));
        assert_eq!(
            asked("90%", None).refine_through(&GRIDS, LastGrid::Map, unknown).expect("solved").last,
            LastGrid::Map
        );
    }

    #[test]
    fn memory_and_time_end_the_refinement() {
        let small = |nodes: [usize; 2]| match nodes {
            [256, _] => Err(Error::Memory { what: "fast".into(), need: 2, have: 1, advice: String::new() }),
            nodes => inverse(nodes),
        };
        assert_eq!(
            asked("0.1%", None).refine_through(&GRIDS, LastGrid::Map, small).expect("solved").last,
            LastGrid::Memory
        );
        assert!(matches!(
            asked("0.1%", None).refine_through(&GRIDS[3..], LastGrid::Map, small),
            Err(Error::Memory { .. })
        ));
        let slow = |nodes| {
            std::thread::sleep(std::time::Duration::from_millis(20));
            inverse(nodes)
        };
        let found = asked("0.1%", Some(0.05)).refine_through(&GRIDS, LastGrid::Map, slow).expect("solved");
        assert!(found.last == LastGrid::Budget && found.grids.len() == 1);
    }

    #[test]
    fn grids_without_convergence_are_passed_over() {
        let stopped = || Error::NotConverged {
            method: "fast",
            why: "detached".into(),
            iterations: 1,
            residual: 1.0,
            tolerance: 1e-8,
            partial: None,
        };
        let coarse = |nodes: [usize; 2]| if nodes[0] < 64 { Err(stopped()) } else { inverse(nodes) };
        assert_eq!(asked("2%", None).refine_through(&GRIDS, LastGrid::Map, coarse).expect("solved").grids.len(), 1);
        let fine = |nodes: [usize; 2]| if nodes[0] > 128 { Err(stopped()) } else { inverse(nodes) };
        let found = asked("0.1%", None).refine_through(&GRIDS, LastGrid::Map, fine).expect("solved");
        assert!(found.last == LastGrid::NotConverged && found.grids.len() == 3);
        let never = |_| Err(stopped());
        let found = asked("9%", None).refine_through(&GRIDS, LastGrid::Map, never);
        assert!(matches!(found, Err(Error::NotConverged { .. })));
    }

    /// A map of the hardness is that of the problem on every grid, and not that of the coarsest.
    #[test]
    fn hardness_maps_are_restricted_from_their_own_grid() {
        let values: Vec<f64> = (0..64 * 64).map(|i| 1.0 + (i % 64) as f64).collect();
        let map = Arc::new(HardnessMap::new(64, 64, values).expect("positive"));
        let spectrum = Spectrum { lambda_s: 1.0 / 8.0, ..Spectrum::CHALLENGE };
        let options = SynthesisOptions { nodes: 64, length: 1.0, seed: 1 };
        let surface = Surface::from_spectrum(spectrum, options).expect("a surface");
        let problem = Problem { hardness: Some(Hardness::Map(map.clone())), ..Problem::new(surface.clone(), 1.0) };
        let grids = surface.refinements();
        assert_eq!(grids, [[32, 32], [64, 64], [128, 128]]);
        for nodes in grids {
            let on = problem.on_nodes(nodes, &surface.on_nodes(32, 32));
            let Some(Hardness::Map(found)) = on.hardness else { panic!("a map") };
            assert!(found.is_on(nodes[0], nodes[1]) && (found.mean() / map.mean() - 1.0).abs() < 1e-12);
            assert_eq!(found.extent() == map.extent(), nodes[0] >= 64, "{nodes:?}");
            assert_eq!(on.surface.shape(), (nodes[1], nodes[0]));
        }
    }

    /// Errors of 8, 4, 2 % after 1, 4 and 16 s.
    #[test]
    fn costs_of_other_errors_follow_from_the_grids() {
        let grids = [(64, 1.0, 0.08), (128, 4.0, 0.04), (256, 16.0, 0.02)];
        let grids = grids.map(|(n, seconds, error)| SolvedGrid { nx: n, ny: n, seconds, errors: area(error) });
        let results = AccuracyResults {
            requested: "2%".parse().expect("an error"),
            budget_seconds: None,
            grids: grids.to_vec(),
            last: LastGrid::Met,
            finer: 1,
        };
        assert_eq!(results.cost_of(2.0), Some(ErrorCost::Measured(5.0)));
        assert_eq!(results.cost_of(10.0), Some(ErrorCost::Measured(1.0)));
        // Half of the error needs one grid more, a quarter two, of which there is one.
        assert_eq!(results.cost_of(0.5), Some(ErrorCost::Estimated(21.0 + 16.0 * GROWTH)));
        assert_eq!(results.cost_of(0.25), None);
        assert_eq!(AccuracyResults { requested: ErrorTargets::default(), ..results }.cost_of(2.0), None);
    }
}
