//! Load paths: sequences of equilibria, each with its discretisation error. The branch depends on the order of the
//! loads.

mod coarse_solver;
mod coarser_grids;
mod contact_target;
mod energy_bound;
mod estimator_input;
mod leakage;
mod map_errors;
mod pull_off;
mod subsurface;
mod uncertainty;
mod unit;

pub(crate) use coarser_grids::is_unresolved;
pub use coarser_grids::{edge_uncertainty, unresolved_contact};
pub use contact_target::{estimated_p_star, pressures_of_contact};
pub use estimator_input::EstimatorInput;
pub use leakage::leakage;
pub use subsurface::{ISOTROPIC, is_subsurface_map, subsurface, subsurface_bytes, subsurface_map};

use crate::interface::{AttractionLaw, RangeChoice};
use crate::method::{
    ContactMethod, Equilibrium, Heights, Load, Observer, ProblemScale, ReducedProblem, SolvePlan, SolverRun,
    SolverSnapshot, Stop, contact_stiffness,
};
use crate::observe::ContactArea;
use crate::quantity::Quantity;
use crate::results::PullOff;
use crate::state::{Discretisation, Extrapolated, MapErrors};
use crate::uncertainty::{UncertaintyComponent, total};
use asperity_grid::{Error, Result};
use asperity_grid::{Grid, Series, Transform, lowest, mean, sharing};
use coarse_solver::CoarseSolver;
use coarser_grids::{CoarseGridResults, ErrorFactors, GridResult, StopOnly, coarsened};
use energy_bound::EnergyBound;
use pull_off::{FINE_SHARE, PartOfSearch, SeparationStart};
use uncertainty::LeftOutWaves;

/// Displacement from first contact; zero where it is the rounding of two means of heights of this size in a precision of this `epsilon`.
fn displacement(touch: f64, separation: f64, (size, epsilon): (f64, f64)) -> f64 {
    /// Measured: up to 10.
    const ROUNDING: f64 = 64.0;
    let moved = touch - separation;
    if moved.abs() <= ROUNDING * epsilon * size { 0.0 } else { moved }
}

/// A problem and its sequence of loads.
pub struct LoadPathSolver<'p> {
    /// The problem with the adhesion law used on its grid.
    problem: ReducedProblem<'p>,
    /// The adhesion as requested.
    requested: AttractionLaw,
    method: &'static dyn ContactMethod,
    range: RangeChoice,
    threshold: f64,
    loads: &'p [Load],
    /// Whether the discretisation error is estimated.
    with_error: bool,
    /// Whether the flow through the gap of the next coarser grid is solved.
    leakage: bool,
    /// Whether the maps of the next coarser grid are compared.
    maps: bool,
}

/// A state of the load path; the last one may not have converged.
pub struct Reached<'a> {
    pub state: Equilibrium<'a>,
    pub area: ContactArea,
    /// Whether the body repeats with its cell.
    pub periodic: bool,
    /// Discretisation error; `None` if this state or the coarser grid's did not converge.
    pub discretisation: Option<Discretisation>,
    pub extrapolated: Option<Extrapolated>,
    /// Displacement of the far field from first contact, L: with a periodic body the mean gap at first contact minus the
    /// mean gap, plus the mean plastic displacement, else the rigid approach.
    pub displacement: f64,
    /// Hydraulic gaps along x and y on the next coarser grid, L, and the relative change of the mean gap from it, if the flow was
    /// requested; `None` if the grid leaves out waves or enlarges the range: how much that changes the flow was not measured.
    pub coarser_gaps: Option<([f64; 2], f64)>,
    /// Errors of the maps of gap and contact, if requested.
    pub map_errors: Option<MapErrors>,
    /// See [`State::energy_bound`](crate::state::State::energy_bound).
    pub energy_bound: Option<f64>,
    /// What the numbers are uncertain by.
    pub uncertainty: Vec<UncertaintyComponent>,
}

impl Reached<'_> {
    /// Error of the contact area over the area of the cell; `None` where a part of it is not known.
    pub fn contact_area_error(&self) -> Option<f64> {
        total(&self.uncertainty, Quantity::ContactArea).map(|fraction| fraction * self.area.contact_area)
    }

    /// Error of the mean gap, of the same unit.
    pub fn mean_gap_error(&self) -> Option<f64> {
        total(&self.uncertainty, Quantity::MeanGap).map(|fraction| fraction * self.state.mean_gap.abs())
    }

    /// Error of the contact stiffness, of the same unit.
    pub fn stiffness_error(&self) -> Option<f64> {
        total(&self.uncertainty, Quantity::Stiffness).zip(self.state.stiffness).map(|(fraction, k)| fraction * k)
    }
}

/// Initial state of a path other than first contact.
pub enum InitialState {
    /// Initial gap `[ny, nx]`, units of L.
    Gap(Vec<f64>),
    /// Continuation of an interrupted path after so many finished loads. Without the method's `progress` (`null`) the next load is
    /// solved from the gap, which then is that of all rows.
    Snapshot { finished: usize, snapshot: Box<SolverSnapshot> },
}

impl<'p> LoadPathSolver<'p> {
    /// `problem` has the adhesion as requested; nodes whose gap is at most `threshold` count as contact.
    pub fn new(
        problem: ReducedProblem<'p>,
        method: &'static dyn ContactMethod,
        range: RangeChoice,
        threshold: f64,
        loads: &'p [Load],
    ) -> Self {
        let requested = problem.adhesion;
        let adhesion = range.law(requested, problem.grid.dx().max(problem.grid.dy()));
        LoadPathSolver {
            problem: ReducedProblem { adhesion, ..problem },
            requested,
            method,
            range,
            threshold,
            loads,
            with_error: true,
            leakage: false,
            maps: false,
        }
    }

    /// Without the coarser grids that serve only the error estimate.
    pub fn without_error(self) -> Self {
        LoadPathSolver { with_error: false, ..self }
    }

    /// With the flow through the gaps of the next coarser grid, for the errors of the leakage.
    pub fn with_leakage(self, requested: bool) -> Self {
        LoadPathSolver { leakage: requested, ..self }
    }

    /// With the errors of the maps of gap and contact, for which the path is also followed on a coarser grid.
    pub fn with_map_errors(self, requested: bool) -> Self {
        LoadPathSolver { maps: requested && !self.problem.ranks.are_several(), ..self }
    }

    /// With the contact stiffness of each state.
    pub fn with_stiffness(self) -> Self {
        LoadPathSolver { problem: ReducedProblem { stiffness: true, ..self.problem }, ..self }
    }

    /// Whether a state depends on the loads before it.
    fn has_history(&self) -> bool {
        self.requested != AttractionLaw::None || self.problem.hardness.is_some()
    }

    /// Whether the method solves coarser grids itself.
    fn is_nested(&self) -> bool {
        self.method.card().id == coarser_grids::method().card().id
    }

    /// The problem with the adhesion law used on its grid.
    pub fn problem(&self) -> &ReducedProblem<'p> {
        &self.problem
    }

    pub fn method(&self) -> &'static dyn ContactMethod {
        self.method
    }

    /// The adhesion law that the method uses.
    pub fn adhesion(&self) -> AttractionLaw {
        self.method.adhesion(&self.problem)
    }

    fn extrapolates(&self) -> bool {
        self.range == RangeChoice::Extrapolate && self.requested != self.problem.adhesion
    }

    /// Coarser grids solved in addition to the problem's own, finest first. Nested methods report coarser grids
    /// themselves and need none.
    fn coarser_grids_followed(&self, pulls_off: bool) -> Vec<Grid> {
        let count = match () {
            // The heights of a non-periodic map have no Fourier series to restrict to a coarser grid.
            () if !self.problem.kernel.is_periodic() => 0,
            () if self.extrapolates() => coarser_grids::EXTRAPOLATION - 1,
            () if !self.with_error => 0,
            () if self.maps => 1,
            // Pull-off is also computed on a coarser grid, which is the only measure of its discretisation error.
            // A path with plastic flow is followed on a coarser grid: the flow is the error of that grid, too.
            () if self.is_nested() && !pulls_off && (!self.has_history() || self.loads.len() == 1) => 0,
            () => 1,
        };
        coarser_grids::grids(self.problem.grid, count)
    }

    /// [`Equilibrium::separation`] at first contact of the rigid surfaces.
    fn separation_at_first_contact(&self) -> f64 {
        if !self.problem.kernel.is_periodic() {
            return 0.0;
        }
        match self.problem.heights {
            Heights::Nodes(nodes) => mean(nodes) - lowest(nodes),
            // A series has no mean.
            Heights::Series(series) => {
                let transform = Transform::<f64>::shared(self.problem.grid, self.problem.ranks);
                let own = series.on_nodes(&transform, &mut transform.spectrum());
                -self.problem.ranks.lowest(lowest(&own))
            }
            Heights::Planned(_) => unreachable!("a solve has heights"),
        }
    }

    /// Memory and work of the path, including coarser grids and the states stored during separation.
    pub fn plan(&self, pulls_off: bool) -> SolvePlan {
        let own = self.method.plan(&self.problem);
        let coarse =
            |&grid: &Grid| coarser_grids::method().plan(&ReducedProblem { grid, ..self.problem.clone() }).bytes;
        let grids = self.coarser_grids_followed(pulls_off);
        let field = (size_of::<f64>() * self.problem.grid.points()) as u64;
        // A Fourier series of the nodes has the size of one field.
        let series = match self.problem.heights.series_bytes() {
            None if !grids.is_empty() => field,
            _ => 0,
        };
        let separation = if pulls_off { pull_off::FIELDS * field } else { 0 };
        let shared = sharing(self.problem.ranks, self.problem.grid).count() as u64;
        // Heights in their own unit, and the fields of a state converted back.
        let converted = if ProblemScale::of(&self.problem.heights).is_one() { 0 } else { 3 * field / shared };
        let coarser = grids.iter().map(coarse).sum::<u64>();
        // The method of coarser grids solves its tangent in its own fields.
        let kept = if self.maps { grids.iter().map(|g| (size_of::<f64>() * g.points()) as u64).sum() } else { 0 };
        let tangent = if self.problem.stiffness && !self.is_nested() { coarse(&self.problem.grid) } else { 0 };
        SolvePlan { bytes: own.bytes + series + separation + converted + coarser + kept + tangent, ..own }
    }

    /// This load on the next coarser grid, if no other solve has provided it: for a solve from a given gap or a
    /// checkpoint.
    fn coarse(&self, load: Load, observer: &dyn Observer) -> Result<Option<GridResult>> {
        if !self.with_error || !self.problem.kernel.is_periodic() {
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
            Heights::Planned(_) => unreachable!("a solve has heights"),
        };
        let problem = coarsened(&self.problem, grid, series, self.requested);
        CoarseSolver::start(&problem, (self.threshold, self.leakage), false, observer)?.follow(load)
    }

    /// [`LoadPathSolver::walk`] of a path in the unit `scale`, which the gap of a checkpoint may not have.
    fn walk_in_unit(
        &self,
        scale: ProblemScale,
        begin: Option<InitialState>,
        pulls_off: bool,
        observer: &dyn Observer,
        mut visit: impl FnMut(usize, Reached) -> Result<()>,
    ) -> Result<Option<PullOff>> {
        let (coarse_results, silent) =
            (CoarseGridResults::new(observer, &self.problem, (self.threshold, self.leakage)), StopOnly(observer));
        // From a given gap, coarser grids might end on another branch.
        let given = matches!(begin, Some(InitialState::Gap(_))) && self.problem.adhesion != AttractionLaw::None;
        let grids = if given { Vec::new() } else { self.coarser_grids_followed(pulls_off) };
        let made: Series<f64>;
        let series = match self.problem.heights {
            Heights::Series(series) => Some(series),
            Heights::Nodes(nodes) if !grids.is_empty() => {
                made = Series::from_nodes(self.problem.grid, nodes);
                Some(&made)
            }
            Heights::Nodes(_) | Heights::Planned(_) => None,
        };
        let problems: Vec<ReducedProblem> = grids
            .iter()
            .filter_map(|&grid| series.map(|s| coarsened(&self.problem, grid, s, self.requested)))
            .collect();
        let mut coarse_solvers = self.coarse_solvers(&problems, pulls_off, &silent)?;
        let resolved =
            grids.last().zip(series).is_some_and(|(&g, s)| coarser_grids::resolves_roughness(s, g, self.problem.grid));
        let (touch, rms_height) = (self.separation_at_first_contact(), self.problem.heights.rms());
        let (waves, bound) = (LeftOutWaves::of(&self.problem), EnergyBound::of(&self.problem, self.method.card()));
        let rounding = (touch.abs().max(rms_height), self.problem.precision.epsilon());
        let mut run = self.method.start(&self.problem, &coarse_results)?.solver()?;
        let (first, mut last) = self.begin((begin, scale), &mut *run, &mut coarse_solvers, &coarse_results)?;
        for (i, &load) in self.loads.iter().enumerate().skip(first) {
            let mut coarse: Vec<GridResult> = Vec::new();
            for solver in &mut coarse_solvers {
                coarse.extend(solver.follow(load)?);
            }
            let mut state = run.equilibrate(load)?;
            let converged = state.stop == Stop::Converged;
            if converged && self.problem.stiffness && !self.is_nested() {
                state.stiffness = contact_stiffness(&self.problem, &state)?;
            }
            let area = self.problem.contact_area(&state, self.threshold);
            let next = match self.next_coarser(coarse_results.take(), coarse.first().copied()) {
                None if converged && coarse_solvers.is_empty() && !given => self.coarse(load, &silent)?,
                known => known.filter(|_| converged),
            };
            let converged = self.is_complete(&state, observer)?;
            let map_errors = self.map_errors(converged, (&state, &area), coarse_solvers.first(), (rms_height, waves));
            let coarser_gaps = next
                .filter(|_| self.is_as_requested(waves))
                .and_then(|next| Some((next.gaps?, (next.mean_gap / state.mean_gap - 1.0).abs())));
            let fine = GridResult::new(&state, self.problem.grid, self.problem.adhesion.range(), &area);
            let errors = converged.then(|| self.errors(load, next, &coarse, fine, (rms_height, resolved)));
            let (discretisation, extrapolated) = errors.unwrap_or_default();
            if pulls_off && converged && i + 1 == self.loads.len() {
                last = Some(SeparationStart::of(&state, &self.problem));
            }
            let reached = Reached {
                uncertainty: self.uncertainty((&state, &area), (rms_height, waves), (discretisation, extrapolated)),
                energy_bound: bound.as_ref().and_then(|bound| bound.at(self.problem.grid, &state)),
                displacement: displacement(touch, state.separation, rounding),
                state,
                area,
                periodic: self.problem.kernel.is_periodic(),
                discretisation,
                extrapolated,
                coarser_gaps,
                map_errors,
            };
            visit(i, reached)?;
            if !converged {
                return Ok(None);
            }
        }
        let Some(last) = last.filter(|_| pulls_off) else { return Ok(None) };
        coarse_results.finish(last.snapshot(self.problem.grid));
        self.separate((&mut *run, last), coarse_solvers.first_mut(), (scale, observer)).map(Some)
    }

    /// Solvers that follow the path on these grids. Pull-off, flow and maps are those of the finest of them only.
    fn coarse_solvers<'s>(
        &self,
        problems: &'s [ReducedProblem<'s>],
        pulls_off: bool,
        observer: &'s dyn Observer,
    ) -> Result<Vec<CoarseSolver<'s>>> {
        let start = |(i, problem)| {
            let is_finest = i == 0;
            let flow = (self.threshold, self.leakage && is_finest);
            let solver = CoarseSolver::start(problem, flow, pulls_off && is_finest, observer)?;
            Ok(solver.keeping_gap(self.maps && is_finest))
        };
        problems.iter().enumerate().map(start).collect()
    }

    /// Errors of the maps of a state; `None` where they were not requested, and where the grid leaves out waves or the range of adhesion is
    /// another one than requested: how much these change the maps was not measured.
    fn map_errors(
        &self,
        converged: bool,
        (state, area): (&Equilibrium, &ContactArea),
        coarser: Option<&CoarseSolver>,
        (rms_height, waves): (f64, LeftOutWaves),
    ) -> Option<MapErrors> {
        if !converged || !self.is_as_requested(waves) {
            return None;
        }
        let fine = (self.problem.grid, state.gap, state.mean_gap);
        map_errors::map_errors(fine, coarser?.gap()?, (self.threshold, rms_height, area))
    }

    /// Whether the problem is the requested one: two grids say nothing of another range, or of waves that both leave out.
    fn is_as_requested(&self, waves: LeftOutWaves) -> bool {
        self.adhesion() == self.requested && !waves.any()
    }

    /// Whether a state has converged.
    ///
    /// # Errors
    /// `Interrupted` after a stop, which may have left out its stiffness or its errors: its load is solved again, from
    /// the last checkpoint. All ranks stop if the first one does.
    fn is_complete(&self, state: &Equilibrium, observer: &dyn Observer) -> Result<bool> {
        let converged = state.stop == Stop::Converged;
        if converged && self.problem.ranks.first_says(u8::from(observer.stop_requested())) == 1 {
            return Err(Error::Interrupted);
        }
        Ok(converged)
    }

    /// Separates the surfaces from a state, here and on the coarser grid.
    fn separate(
        &self,
        (run, last): (&mut dyn SolverRun, SeparationStart),
        coarser: Option<&mut CoarseSolver>,
        (scale, observer): (ProblemScale, &dyn Observer),
    ) -> Result<PullOff> {
        let both = coarser.is_some();
        let part = |share: [f64; 2]| PartOfSearch { observer, share };
        let pull_off =
            pull_off::search(run, &self.problem, (scale, &part([0.0, if both { FINE_SHARE } else { 1.0 }])), last)?;
        let coarse = coarser.map(|coarse| coarse.pull_off(scale, &part([FINE_SHARE, 1.0]))).transpose()?.flatten();
        // What the search leaves says nothing of the grid.
        Ok(match coarse {
            Some((grid, pull)) if self.is_as_requested(LeftOutWaves::of(&self.problem)) => {
                pull_off::compared(pull_off, grid, pull)
            }
            _ => PullOff { pressure_error: None, mean_gap_error: None, ..pull_off },
        })
    }

    /// What the numbers of a state are uncertain by.
    fn uncertainty(
        &self,
        (state, area): (&Equilibrium, &ContactArea),
        (rms_height, waves): (f64, LeftOutWaves),
        (discretisation, extrapolated): (Option<Discretisation>, Option<Extrapolated>),
    ) -> Vec<UncertaintyComponent> {
        let problem = &self.problem;
        // A method may use another range than that of the grid.
        let enlarges = self.adhesion() != self.requested;
        uncertainty::components(&uncertainty::UncertaintyInput {
            problem,
            enlarges,
            rms_height,
            state,
            area,
            discretisation,
            waves,
            extrapolated,
        })
    }

    /// The result of the next coarser grid: of the nested method's own grids, or of a solve that follows the path. With plastic
    /// flow the former start from the flow on this grid.
    fn next_coarser(&self, nested: Option<GridResult>, followed: Option<GridResult>) -> Option<GridResult> {
        match self.problem.hardness {
            Some(_) if self.loads.len() > 1 => followed,
            _ => nested.or(followed),
        }
    }

    /// Discretisation error of `fine` from the `next` coarser grid, and the extrapolation over all `coarse` grids.
    fn errors(
        &self,
        load: Load,
        next: Option<GridResult>,
        coarse: &[GridResult],
        fine: GridResult,
        (rms_height, resolved): (f64, bool),
    ) -> (Option<Discretisation>, Option<Extrapolated>) {
        let factors = ErrorFactors::of(&self.problem);
        let discretisation = next.map(|next| coarser_grids::discretisation(&next, &fine, (rms_height, factors)));
        let extrapolated = self.extrapolated(coarse, fine, resolved);
        match load {
            // An imposed mean gap has no error.
            Load::MeanGap(_) => (
                discretisation.map(|d| Discretisation { mean_gap: None, ..d }),
                extrapolated.map(|e| Extrapolated { mean_gap: None, ..e }),
            ),
            Load::Pressure(_) => (discretisation, extrapolated),
        }
    }

    /// Extrapolation to the requested range. `resolved`: whether the coarsest grid resolves the roughness.
    fn extrapolated(&self, coarse: &[GridResult], fine: GridResult, resolved: bool) -> Option<Extrapolated> {
        let all: Vec<GridResult> = coarse.iter().rev().copied().chain([fine]).collect();
        let extrapolated = || coarser_grids::extrapolated(self.requested.range(), &all, resolved);
        self.extrapolates().then(extrapolated).flatten()
    }

    /// Sets the initial state of the path. Returns the number of finished loads and, if these are all loads, the state
    /// from which an interrupted separation restarts.
    fn begin(
        &self,
        (begin, scale): (Option<InitialState>, ProblemScale),
        run: &mut dyn SolverRun,
        coarse_solvers: &mut [CoarseSolver],
        coarse_results: &CoarseGridResults,
    ) -> Result<(usize, Option<SeparationStart>)> {
        let (finished, snapshot) = match begin {
            None => return Ok((0, None)),
            Some(InitialState::Gap(gap)) => {
                run.set_gap(&gap);
                return Ok((0, None));
            }
            Some(InitialState::Snapshot { finished, snapshot }) => (finished, *snapshot),
        };
        for &load in &self.loads[..finished] {
            for solver in &mut *coarse_solvers {
                solver.follow(load)?;
            }
        }
        let unfinished = finished < self.loads.len();
        if unfinished && !snapshot.progress.is_null() {
            run.resume(coarse_results.resumed(snapshot)?)?;
            return Ok((finished, None));
        }
        if let Some(plastic) = &snapshot.plastic {
            run.set_plastic_displacement(&scale.gap(plastic));
        }
        run.set_gap(&scale.gap(&snapshot.gap));
        if unfinished {
            return Ok((finished, None));
        }
        let Some(&load) = self.loads.last() else { return Ok((finished, None)) };
        let state = run.equilibrate(load)?;
        match state.stop {
            Stop::Converged => Ok((finished, Some(SeparationStart::of(&state, &self.problem)))),
            Stop::Interrupted => Err(Error::Interrupted),
            stop => Err(pull_off::unconverged(self.problem.tolerance, scale, &state, stop)),
        }
    }
}
