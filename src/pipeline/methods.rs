//! Comparison methods at the loads of the scene: solvers and estimators.

use super::continuum::range_results;
use super::folder::StageKey;
use super::laboratory::{
    SECONDS_PER_POINT_PAIR, SolvedHeights, Variant, is_elastic_in, laboratory, path_bytes, variant_key,
};
use super::stage::{EstimatedCost, MachineSpeed, Stage, StageContext, StageKeys};
use super::{Listener, ProgressReporter};
use crate::record::methods::MethodResults;
use crate::scene::Case;
use crate::{Error, Result};
use asperity_atoms::results::AtomsResults;
use asperity_contact::estimated::{never_delivered, set_stiffness, state_of};
use asperity_contact::interface::AttractionLaw;
use asperity_contact::load::{Branch, Load};
use asperity_contact::method::{ContactMethod, Heights, MethodEstimate, MethodKind, ReducedProblem, Settings};
use asperity_contact::path::EstimatorInput;
use asperity_contact::state::{Map, State};
use asperity_grid::{Field, Grid};
use asperity_methods::all_atom;
use asperity_surface::files::atomic_file::remove;
use asperity_surface::files::hashed::{self, Stored};
use asperity_surface::files::npy;
use std::path::{Path, PathBuf};

/// A method, with or without the scene's adhesion.
#[derive(Clone, Copy)]
pub(super) struct MethodRun {
    pub method: &'static dyn ContactMethod,
    pub adhesive: bool,
}

impl MethodRun {
    /// The problem that the method solves: without adhesion, and without a hardness, where it models none.
    fn problem<'a>(&self, case: &'a Case, heights: Heights<'a>) -> ReducedProblem<'a> {
        let mut problem = case.problem(heights);
        if !self.adhesive {
            problem.adhesion = AttractionLaw::None;
        }
        if is_elastic_in(case, self.method.card().id) {
            problem.hardness = None;
        }
        problem
    }

    /// Description for progress messages and warnings.
    pub(super) fn label(&self, case: &Case) -> String {
        let leaves_out = !self.adhesive && case.model.adhesion != AttractionLaw::None;
        format!("{}{}", self.method.card().id, if leaves_out { ", without adhesion" } else { "" })
    }
}

/// Runs of all comparison methods: with the scene's adhesion if the method supports it; without adhesion if that is
/// requested, if the method does not support it, or if the scene has none.
pub(super) fn all(case: &Case) -> Vec<MethodRun> {
    let attracts = case.model.adhesion != AttractionLaw::None;
    let without = !attracts || case.solves_all_nonadhesive();
    let runs_of = |method: &'static dyn ContactMethod| {
        let with_adhesion = attracts && method.card().supports_adhesion() && !method.card().capabilities.atoms;
        let with = with_adhesion.then_some(MethodRun { method, adhesive: true });
        with.into_iter().chain((without || !with_adhesion).then_some(MethodRun { method, adhesive: false }))
    };
    let atoms = |m: &&'static dyn ContactMethod| case.atoms.is_some() && m.card().capabilities.atoms;
    case.comparison_methods().into_iter().filter(|m| !atoms(m)).flat_map(runs_of).collect()
}

/// Runs one of the comparison methods.
pub(super) struct MethodStage<'a> {
    pub case: &'a Case,
    pub method_run: MethodRun,
}

impl Stage for MethodStage<'_> {
    type Input<'i> = &'i SolvedHeights<'i>;
    type Output = MethodResults;

    fn name(&self) -> String {
        format!(
            "method-{}{}",
            self.method_run.method.card().id,
            if self.method_run.adhesive { "" } else { "-non-adhesive" }
        )
    }

    fn what(&self) -> String {
        let (n, grid) = (self.case.loading_steps().len(), self.case.model.grid);
        let loads = if n == 1 { "load" } else { "loads" };
        format!("{} at {n} {loads} on {} x {} points", self.method_run.label(self.case), grid.nx, grid.ny)
    }

    fn cost(&self, machine: MachineSpeed) -> EstimatedCost {
        let (case, loads) = (self.case, self.case.loading_steps().len() as f64);
        let problem = self.method_run.problem(case, Heights::Planned(case.surface().series_bytes()));
        let plan = EstimatorInput::plan(&problem, self.method_run.method);
        let points = case.model.grid.points();
        let pairs = plan.iterations as f64 * plan.pairs_per_iteration * loads;
        // Estimators run nearly serially, so their time is not divided by the number of threads.
        let seconds = pairs * points as f64 * SECONDS_PER_POINT_PAIR / machine.threads as f64 + plan.seconds * loads;
        EstimatedCost { bytes: plan.bytes + 8 * points as u64, seconds }
    }

    fn keys(&self, dependencies: &[&StageKey]) -> Result<StageKeys> {
        let variant = Variant::Comparison(self.method_run.method.card().id, self.method_run.adhesive);
        variant_key(self.case, &self.name(), variant, dependencies).map(StageKeys::continued)
    }

    fn run(&self, heights: &SolvedHeights, context: &StageContext) -> Result<MethodResults> {
        run(self.case, self.method_run, heights.get(), context)
    }
}

/// Whether the atoms of the case are listed among the comparison methods.
pub(super) fn wants_atoms(case: &Case) -> bool {
    case.atoms.is_some() && case.comparison_methods().iter().any(|m| m.card().capabilities.atoms)
}

/// Results of the atoms in the form of a comparison method. `seconds`: time of LAMMPS, s.
pub(super) fn of_atoms(
    case: &Case,
    atoms: &AtomsResults,
    seconds: f64,
    (root, folder, stage): (&Path, &Path, &str),
) -> Result<MethodResults> {
    let card = all_atom::AllAtom.card();
    let adhesive = case.model.adhesion != AttractionLaw::None;
    let block = case.atoms.as_ref().expect("a case with atoms has their results");
    let sites = block.block.surface();
    let site_area = sites.site_area() / atoms.length_angstrom.powi(2);
    let mut results = nothing(&all_atom::AllAtom, &case.scene.methods, adhesive);
    results.cpu_seconds = seconds;
    // The card has the challenge's d_c.
    results.criterion = block.contact_criterion();
    for s in &atoms.states {
        let map = npy::read(&root.join(&s.contact_map))?;
        let contact: Vec<u8> = map.values.iter().map(|v| *v as u8).collect();
        // Gaps of atoms are measured from the distance at which the repulsion begins, and are negative below it.
        let gap = npy::read(&root.join(&s.gap_map))?
            .values
            .iter()
            .map(|g| (g / atoms.length_angstrom).max(0.0))
            .collect::<Vec<_>>();
        let grid = Grid::unit(map.nx, map.ny);
        let touching = npy::read_flags_on(&root.join(s.per_site("contact")), [sites.len(), 1])?;
        let touching: Vec<bool> = touching.iter().map(|flag| *flag != 0).collect();
        let patches = sites.cluster_sizes(&touching).into_iter().map(|n| n as f64 * site_area).collect();
        let problem = ReducedProblem { adhesion: case.model.adhesion, ..ReducedProblem::new(grid, &[][..]) };
        let pressure = s.p_star * case.gradient;
        let estimate = MethodEstimate {
            contact_area: s.contact_area,
            mean_gap: Some(s.mean_gap_angstrom / atoms.length_angstrom),
            contact: Some(&contact),
            gap: Some(&gap),
            clusters: Some(patches),
            ..MethodEstimate::at(pressure)
        };
        let step = &case.load_steps()[s.index];
        let state = state_of(card, &problem, (step, case.gradient, &results.criterion), &estimate);
        let file = format!("load-{}-gap.npy", s.index + 1);
        npy::write(&folder.join(&file), grid.nx, grid.ny, gap.iter().copied())?;
        let gap_map = Some(Map::File(format!("{stage}/{file}")));
        let state = State { gap_map, contact_map: Some(Map::File(s.contact_map.clone())), ..state };
        // At the scale of the scene, which the block represents.
        results.states.push(state.in_units(case.scales.length_m, case.scales.modulus_pa));
    }
    set_stiffness(&mut results.states);
    Ok(results)
}

/// Results of a method without states: its description, and the quantities that it does not give.
fn nothing(method: &dyn ContactMethod, settings: &Settings, adhesive: bool) -> MethodResults {
    let card = method.card();
    MethodResults {
        method: card.id.into(),
        paper_name: card.paper_name.into(),
        criterion: method.criterion(settings).to_string(),
        calibrated_on: method.calibrated_on(settings).map(Into::into),
        warning: card.warning(),
        measured_errors: card.measured_errors.cloned(),
        adhesive,
        range: None,
        unavailable_reason: None,
        missing: never_delivered(card, adhesive),
        states: Vec::new(),
        planned_bytes: 0,
        cpu_seconds: 0.0,
    }
}

/// Runs a method at the loads of the loading branch. Invalid input, lack of memory and missing convergence are recorded
/// in the results as `unavailable_reason`.
pub(super) fn run(
    case: &Case,
    method_run: MethodRun,
    heights: Heights,
    context: &StageContext,
) -> Result<MethodResults> {
    let &StageContext { folder, stage, listener, .. } = context;
    let (method, adhesive) = (method_run.method, method_run.adhesive);
    let card = method.card();
    let mut results = nothing(method, &case.scene.methods, adhesive);
    if card.capabilities.atoms {
        // In a scene with [atoms], the results are added after the LAMMPS run.
        return Ok(MethodResults {
            unavailable_reason: Some("runs in scenes with [atoms], and in `asperity tradeoff --atoms`".into()),
            ..results
        });
    }
    if is_elastic_in(case, card.id) {
        let own = results.warning.iter().map(|w| format!("; it {w}")).collect::<String>();
        results.warning = Some(format!("models no plastic flow: its body is elastic{own}"));
    }
    let cpu = asperity_grid::sys::cpu_seconds();
    let problem = method_run.problem(case, heights);
    let adhesion = problem.adhesion;
    let ended = match card.kind {
        MethodKind::Solver => {
            results.planned_bytes = path_bytes(case, problem, method, false);
            laboratory(case, Variant::Comparison(card.id, adhesive), heights, context)
                .map(|c| (results.states, results.range) = (of_loading(c.states), c.range))
        }
        MethodKind::Estimate => EstimatorInput::new(problem.clone(), method).and_then(|input| {
            results.planned_bytes = path_bytes(case, problem.clone(), method, false);
            let range = input.changed_adhesion().and_then(|used| range_results(adhesion, used, case.model.grid));
            results.range = range.map(|r| r.in_units(case.scales.length_m, case.scales.modulus_pa));
            let criterion = results.criterion.clone();
            estimate(case, &input, (folder, stage, &criterion), listener, &mut results.states)
        }),
    };
    match ended.map_err(|e| case.given_units().rewrite(e)) {
        Ok(()) => {
            if let Some(reason) = &results.warning {
                listener.warn(&format!("{}: {reason}", method_run.label(case)));
            }
        }
        Err(e @ (Error::Input { .. } | Error::NotConverged { .. } | Error::Memory { .. })) => {
            let reason = e.to_string().replace('\n', " ");
            listener.warn(&format!("{}: {reason}", method_run.label(case)));
            results.unavailable_reason = Some(reason);
        }
        Err(e) => return Err(e),
    }
    for i in 0..case.loading_steps().len() {
        // Only estimators write these files; a missing file is no error.
        let _ = remove(&finished(folder, i));
    }
    results.cpu_seconds = asperity_grid::sys::cpu_seconds() - cpu;
    Ok(results)
}

fn of_loading(states: Vec<State>) -> Vec<State> {
    states.into_iter().filter(|s| s.branch == Branch::Loading).collect()
}

/// File of a finished load, from which an interrupted estimator continues. It is removed when all loads are finished.
fn finished(folder: &Path, i: usize) -> PathBuf {
    folder.join(format!("load-{}.json", i + 1))
}

/// State of a finished load of an earlier attempt, if its files are as they were written.
fn finished_state(folder: &Path, i: usize, listener: &dyn Listener) -> Option<State> {
    match hashed::read(&finished(folder, i), true) {
        Stored::Valid(state) => Some(state),
        Stored::Absent => None,
        Stored::Damaged(what) => {
            listener.warn(&format!("{what}; load {} is estimated again", i + 1));
            None
        }
    }
}

/// Runs an estimator load by load, after the loads that an earlier attempt finished.
fn estimate(
    case: &Case,
    input: &EstimatorInput,
    (folder, stage, criterion): (&Path, &str, &str),
    listener: &dyn Listener,
    states: &mut Vec<State>,
) -> Result<()> {
    let steps = case.loading_steps();
    let loads: Vec<Load> = steps.iter().map(|s| s.target).collect();
    states.extend((0..loads.len()).map_while(|i| finished_state(folder, i, listener)));
    let watch = ProgressReporter::new(listener, None, "", (states.len(), loads.len()));
    input.walk((&loads, states.len()), &watch, |i, problem, estimate| {
        let state = state_of(input.card(), problem, (&steps[i], case.gradient, criterion), estimate);
        let mut state = state.in_units(case.scales.length_m, case.scales.modulus_pa);
        if steps[i].maps {
            let grid = problem.grid;
            let name = |quantity: &str| format!("load-{}-{quantity}.npy", i + 1);
            for (quantity, field, kept) in
                [("gap", estimate.gap, &mut state.gap_map), ("stress", estimate.stress, &mut state.stress_map)]
            {
                if let Some(field) = field {
                    let file = name(quantity);
                    npy::write_field(&folder.join(&file), grid.nx, grid.ny, Field::F64(field), 1.0)?;
                    *kept = Some(Map::File(format!("{stage}/{file}")));
                }
            }
            if let Some(map) = estimate.contact {
                let file = name("contact");
                npy::write(&folder.join(&file), grid.nx, grid.ny, map.iter().copied())?;
                state.contact_map = Some(Map::File(format!("{stage}/{file}")));
            }
        }
        let own = format!("load-{}-", i + 1);
        let fields = hashed::hashes(folder, &|name| name.starts_with(&own))?;
        hashed::write(&finished(folder, i), &state, &fields)?;
        states.push(state);
        watch.next();
        Ok(())
    })?;
    set_stiffness(states);
    Ok(())
}
