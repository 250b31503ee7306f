//! Load paths: sequences of equilibria, each with its discretisation error. The branch depends on the order of the
//! loads.

mod checkpoint;
mod coarser_grids;
mod estimator_input;
mod pull_off;

pub use checkpoint::{Checkpoint, CheckpointWriter};
pub use coarser_grids::CORRECTION;
pub use estimator_input::EstimatorInput;

use crate::grid::{Field, Grid, Series};
use crate::interface::{Adhesion, Elastic, RangeChoice};
use crate::method::{ContactMethod, Heights, Load, Observer, Plan, Problem, SnapshotRef, State, Stop};
use crate::observe::{ContactArea, contact_area};
use crate::record::results::{Discretisation, Extrapolated, PullOff};
use crate::{Error, Result};
use coarser_grids::{CoarseGridResults, CoarseSolver, GridResult, StopOnly, coarsened};
use pull_off::SeparationStart;

/// A problem and its sequence of loads.
pub struct LoadPath<'p> {
    /// The problem with the adhesion law used on its grid.
    problem: Problem<'p>,
    asked: Adhesion,
    method: &'static dyn ContactMethod,
    range: RangeChoice,
    threshold: f64,
    loads: &'p [Load],
    tells_error: bool,
}

/// A state of the load path; the last one may not have converged.
pub struct Reached<'a> {
    pub state: State<'a>,
    pub area: ContactArea,
    /// Discretisation error; `None` if this state or the coarser grid's did not converge.
    pub discretisation: Option<Discretisation>,
    pub extrapolated: Option<Extrapolated>,
}

/// Initial state of a path other than first contact.
pub enum Begin {
    /// Initial gap `[ny, nx]`, units of L.
    Gap(Vec<f64>),
    /// Continuation from a checkpoint.
    Checkpoint(Checkpoint),
}

impl<'p> LoadPath<'p> {
    /// `problem` has the adhesion as requested; nodes whose gap is at most `threshold` count as contact.
    pub fn new(
        problem: Problem<'p>,
        method: &'static dyn ContactMethod,
        range: RangeChoice,
        threshold: f64,
        loads: &'p [Load],
    ) -> Self {
        let asked = problem.adhesion;
        let adhesion = range.law(asked, problem.grid.dx().max(problem.grid.dy()));
        LoadPath { problem: Problem { adhesion, ..problem }, asked, method, range, threshold, loads, tells_error: true }
    }

    /// Without the coarser grids that serve only the error estimate.
    pub fn without_error(self) -> Self {
        LoadPath { tells_error: false, ..self }
    }

    /// The problem with the adhesion law used on its grid.
    pub fn problem(&self) -> &Problem<'p> {
        &self.problem
    }

    pub fn method(&self) -> &'static dyn ContactMethod {
        self.method
    }

    /// The adhesion law that the method uses.
    pub fn adhesion(&self) -> Adhesion {
        self.method.adhesion(&self.problem)
    }

    fn extrapolates(&self) -> bool {
        self.range == RangeChoice::Extrapolate && self.asked != self.problem.adhesion
    }

    /// Coarser grids solved in addition to the problem's own, finest first. Nested methods report coarser grids
    /// themselves and need none.
    fn coarser_grids_followed(&self, pulls_off: bool) -> Vec<Grid> {
        let nested = self.method.card().id == coarser_grids::method().card().id;
        let count = match () {
            // The heights of a non-periodic patch have no Fourier series to restrict to a coarser grid.
            () if matches!(self.problem.kernel, Elastic::NonPeriodic(_)) => 0,
            () if self.extrapolates() => coarser_grids::EXTRAPOLATION - 1,
            () if !self.tells_error => 0,
            // Pull-off is also computed on a coarser grid, which is the only measure of its discretisation error.
            () if nested && !pulls_off && (self.asked == Adhesion::None || self.loads.len() == 1) => 0,
            () => 1,
        };
        coarser_grids::grids(self.problem.grid, count)
    }

    /// Memory and work of the path, including coarser grids and the states stored during separation.
    pub fn plan(&self, pulls_off: bool) -> Plan {
        let own = self.method.plan(&self.problem);
        let beside = |&grid: &Grid| coarser_grids::method().plan(&Problem { grid, ..self.problem.clone() }).bytes;
        let grids = self.coarser_grids_followed(pulls_off);
        let field = (size_of::<f64>() * self.problem.grid.points()) as u64;
        // A Fourier series of the nodes has the size of one field.
        let series = match self.problem.heights {
            Heights::Nodes(_) if !grids.is_empty() => field,
            _ => 0,
        };
        let held = if pulls_off { pull_off::FIELDS * field } else { 0 };
        Plan { bytes: own.bytes + series + held + grids.iter().map(beside).sum::<u64>(), ..own }
    }

    /// This load on the next coarser grid, if no other solve has provided it: for a solve from a given gap or a
    /// checkpoint.
    fn coarse(&self, load: Load, observer: &dyn Observer) -> Result<Option<GridResult>> {
        if !self.tells_error || matches!(self.problem.kernel, Elastic::NonPeriodic(_)) {
            return Ok(None);
        }
        let Some(&grid) = coarser_grids::grids(self.problem.grid, 1).first() else { return Ok(None) };
        let made: Series<f64>;
        let series = match self.problem.heights {
            Heights::Series(series) => series,
            Heights::Nodes(nodes) => {
                made = Series::from_nodes(self.problem.grid, nodes);
                &made
            }
        };
        let problem = coarsened(&self.problem, grid, series, self.asked);
        CoarseSolver::start(&problem, self.threshold, false, observer)?.follow(load)
    }

    /// Solves the loads in order and passes each state to `visit`. The path ends at the first load that does not
    /// converge. If `pulls_off`, the surfaces are then separated to find the pull-off pressure.
    ///
    /// # Errors
    /// Loads that the method does not support, and the errors of `visit`.
    pub fn walk(
        &self,
        begin: Option<Begin>,
        pulls_off: bool,
        observer: &dyn Observer,
        mut visit: impl FnMut(usize, Reached) -> Result<()>,
    ) -> Result<Option<PullOff>> {
        let (coarse_results, silent) = (CoarseGridResults::new(observer, self.threshold), StopOnly(observer));
        // From a given gap, coarser grids might end on another branch.
        let given = matches!(begin, Some(Begin::Gap(_))) && self.problem.adhesion != Adhesion::None;
        let grids = if given { Vec::new() } else { self.coarser_grids_followed(pulls_off) };
        let made: Series<f64>;
        let series = match self.problem.heights {
            Heights::Series(series) => Some(series),
            Heights::Nodes(nodes) if !grids.is_empty() => {
                made = Series::from_nodes(self.problem.grid, nodes);
                Some(&made)
            }
            Heights::Nodes(_) => None,
        };
        let problems: Vec<Problem> =
            grids.iter().filter_map(|&grid| series.map(|s| coarsened(&self.problem, grid, s, self.asked))).collect();
        let mut coarse_solvers = Vec::new();
        for problem in &problems {
            // Pull-off is computed only on the finest of the coarser grids.
            let holds = pulls_off && coarse_solvers.is_empty();
            coarse_solvers.push(CoarseSolver::start(problem, self.threshold, holds, &silent)?);
        }
        let held = grids.last().zip(series).is_some_and(|(&g, s)| coarser_grids::holds(s, g, self.problem.grid));
        let rms_height = self.problem.heights.rms();
        let mut run = self.method.start(&self.problem, &coarse_results)?.solver()?;
        let mut last = None;
        let first = match begin {
            None => 0,
            Some(Begin::Gap(gap)) => {
                run.set_gap(&gap);
                0
            }
            Some(Begin::Checkpoint(checkpoint)) => {
                let done = checkpoint.finished.len();
                for &load in &self.loads[..done] {
                    for solver in &mut coarse_solvers {
                        solver.follow(load)?;
                    }
                }
                if done < self.loads.len() {
                    checkpoint.resume(&mut *run)?;
                } else {
                    // The interrupted separation restarts from the state at the last load.
                    run.set_gap(&checkpoint.gap()?);
                    if let Some(&load) = self.loads.last() {
                        let state = run.equilibrate(load)?;
                        match state.stop {
                            Stop::Converged => last = Some(SeparationStart::of(&state)),
                            Stop::Interrupted => return Err(Error::Interrupted),
                            stop => return Err(pull_off::unconverged(&self.problem, &state, stop)),
                        }
                    }
                }
                done
            }
        };
        for (i, &load) in self.loads.iter().enumerate().skip(first) {
            let mut coarse: Vec<GridResult> = Vec::new();
            for solver in &mut coarse_solvers {
                coarse.extend(solver.follow(load)?);
            }
            let state = run.equilibrate(load)?;
            let area = contact_area(self.problem.grid, state.gap, self.threshold);
            let converged = state.stop == Stop::Converged;
            let (discretisation, extrapolated) = if converged {
                let range = self.problem.adhesion.range();
                let fine = GridResult::new(self.problem.grid, range, &area, state.mean_gap, state.error_estimates);
                let below = match coarse_results.take().or(coarse.first().copied()) {
                    None if coarse_solvers.is_empty() && !given => self.coarse(load, &silent)?,
                    known => known,
                };
                let all: Vec<GridResult> = coarse.iter().rev().copied().chain([fine]).collect();
                let imposed = matches!(load, Load::MeanGap(_));
                let keep = |gap: Option<f64>| gap.filter(|_| !imposed);
                let told = below.map(|coarse| coarser_grids::discretisation(&coarse, &fine, rms_height));
                let far =
                    self.extrapolates().then(|| coarser_grids::extrapolated(self.asked.range(), &all, held)).flatten();
                (
                    told.map(|d| Discretisation { mean_gap: keep(d.mean_gap), ..d }),
                    far.map(|e| Extrapolated { mean_gap: e.mean_gap.filter(|_| !imposed), ..e }),
                )
            } else {
                (None, None)
            };
            if pulls_off && converged && i + 1 == self.loads.len() {
                last = Some(SeparationStart::of(&state));
            }
            visit(i, Reached { state, area, discretisation, extrapolated })?;
            if !converged {
                return Ok(None);
            }
        }
        match last {
            Some(last) if pulls_off => {
                coarse_results.finish(SnapshotRef {
                    grid: self.problem.grid,
                    gap: Field::F64(&last.gap),
                    auxiliary: None,
                    progress: serde_json::Value::Null,
                });
                let found = pull_off::search(&mut *run, &self.problem, last)?;
                let coarse = coarse_solvers.first_mut().map(CoarseSolver::pull_off).transpose()?.flatten();
                Ok(Some(match coarse {
                    Some((grid, pull)) => pull_off::compared(found, grid, pull),
                    None => found,
                }))
            }
            _ => Ok(None),
        }
    }
}
