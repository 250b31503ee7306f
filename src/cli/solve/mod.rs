//! `solve`: one surface under one load path, in consistent units, without a run folder.

mod accuracy;
mod cache;
mod curve;
mod estimated;
mod fields;
mod flags;
mod followers;
mod loads;
mod reporter;
mod solved;
mod units;

pub(super) use flags::SolveArgs;

use super::file::COMMAND_LINE;
use super::{output, progress::TerminalProgress};
use crate::pipeline::checkpoint::{Checkpoint, CheckpointWriter};
use crate::pipeline::{Listener, ProgressReporter, StageKey, impose_contact};
use crate::record::load_table::{ForceUnit, ResultUnits};
use crate::report::number::{memory, trimmed};
use crate::scene::{Case, Dimensional, GivenUnits, Quantity, rename_keys, rename_keys_in};
use crate::{Error, Result};
use asperity_contact::load::Load;
use asperity_contact::method::{ContactMethod, Device, MethodKind, Precision, ReducedProblem, Stop};
use asperity_contact::observe::leakage_bytes;
use asperity_contact::path::{InitialState, LoadPathSolver, subsurface_bytes};
use asperity_contact::problem::{AccuracyResults, LentHeights};
use asperity_contact::state::State;
use asperity_grid::Grid;
use asperity_grid::sys::ranks::Ranks;
use asperity_grid::units::{Dimension, Measure, Measures, Scales};
use asperity_surface::files::beneath::guard;
use asperity_surface::files::hashed::file_hash;
use cache::SolveCache;
use fields::file_name;
use followers::{CHECKPOINT, FolderState};
use reporter::{Before, SolveReporter};
use serde_json::{Value, json};
use solved::Solved;
use std::path::{Path, PathBuf};

impl SolveArgs {
    /// Units of the results, where they are known.
    fn units(&self, case: &Case) -> ResultUnits {
        let unit = |m: Option<Measure>| m.and_then(|m| m.unit).map(|unit| unit.to_string());
        let length = match self.challenge {
            Some(_) => unit(self.map.length),
            None => case.provenance().and_then(|p| p.unit.clone()),
        };
        let stress = self.stress_unit().map(|unit| unit.to_string());
        let units = ResultUnits { length, stress, force: None };
        let of_force = |given: &Measures| {
            let unit = given.0.iter().find_map(|m| m.unit);
            let of_unit = match unit {
                None => 1.0,
                // Lengths and stresses have units, too.
                Some(unit) => units.si(Dimension::Work)? * units.si(Dimension::Length)? / unit.si,
            };
            let of_pressure = case.problem.surface.mapped_area() * of_unit;
            Some(ForceUnit { unit: unit.map(|unit| unit.to_string()), of_pressure })
        };
        let force = self.loads.force.as_ref().and_then(of_force);
        ResultUnits { force, ..units }
    }

    /// Units in which errors and warnings are written: those of the flags.
    fn given_units(&self, case: &Case) -> GivenUnits {
        let (units, loads) = (self.units(case), &self.loads);
        let first = |list: &Option<Measures>| list.as_ref()?.0.first().copied();
        let length = first(&loads.mean_gap).or(first(&loads.displacement)).or(self.map.length);
        // Without a flag in the unit that the file declares.
        let declared = || units.length.as_ref().and_then(|unit| format!("1{unit}").parse().ok());
        let length = length.filter(|m| m.unit.is_some()).or_else(declared);
        let young = self.body.first().map(|body| body.young);
        let stress = first(&loads.pressure).or(self.hardness).or(self.modulus).or(young);
        let si = |given: Option<Measure>, dimension| given?.unit.and(units.si(dimension));
        let scales = Scales {
            length_m: case.scales.length_m * si(length, Dimension::Length).unwrap_or(1.0),
            modulus_pa: case.scales.modulus_pa * si(stress, Dimension::Stress).unwrap_or(1.0),
        };
        fn like<D: Dimensional>(given: Option<Measure>) -> Quantity<D> {
            given.and_then(Quantity::written).unwrap_or(Quantity::plain(1.0))
        }
        case.given_units().shown_as(scales, (like(length), like(stress), like(self.work_of_adhesion)))
    }

    /// A state with its stresses in the unit in which pressures were given.
    fn in_unit_of_loads(&self, state: &State, units: &ResultUnits) -> (State, ResultUnits) {
        let given = self.loads.pressure.iter().flat_map(|list| &list.0).find_map(|m| m.unit);
        match given.zip(units.si(Dimension::Stress)) {
            Some((unit, of_stress)) => {
                let units = ResultUnits { stress: Some(unit.to_string()), ..units.clone() };
                (state.clone().in_units(1.0, of_stress / unit.si), units)
            }
            None => (state.clone(), units.clone()),
        }
    }

    /// Contact modulus of the bodies, and the shares of two in the deformation.
    fn of_bodies(&self, case: &Case) -> String {
        let lab = &case.laboratory;
        let unit = self.units(case).stress.map_or(String::new(), |unit| format!(" {unit}"));
        let modulus = format!("contact modulus {}{unit}", trimmed(lab.modulus().value(), 4));
        match lab.shares()[..] {
            [first, second] => {
                let [first, second] = [first, second].map(|share| trimmed(100.0 * share, 3));
                format!("{modulus}; the first body has {first} % of the deformation, the second {second} %")
            }
            _ => modulus,
        }
    }

    /// The case of these flags, checked and resolved as that of a scene.
    fn case(&self) -> Result<Case> {
        let case = Case::resolve(self.scene()?, Path::new(COMMAND_LINE));
        case.map_err(|error| {
            let mut error = rename_keys(error, &|key| self.flag_of(key));
            let missing = [
                ("--grid", self.grid.is_none()),
                ("--range", self.range.is_none()),
                ("--modulus", self.modulus.is_none() && self.body.is_empty()),
            ];
            if let Error::Input { list, .. } = &mut error {
                let absent = |key: &str| missing.iter().any(|(flag, absent)| *flag == key && *absent);
                list.iter_mut().filter(|c| absent(&c.key)).for_each(|c| c.found = "not given".into());
                let modulus = list.iter_mut().filter(|c| c.key == "--modulus" && c.found == "not given");
                modulus.for_each(|c| c.accepted = units::MODULUS.into());
                let non_periodic = list.iter_mut().filter(|c| c.key == "--non-periodic");
                non_periodic.for_each(|c| c.found = c.found.replacen("false", "given", 1));
            }
            error
        })
    }

    /// Bytes planned; printed with --dry-run.
    ///
    /// # Errors
    /// Where they do not fit.
    fn planned(
        &self,
        case: &Case,
        method: &'static dyn ContactMethod,
        problem: &ReducedProblem,
        loads: &[Load],
    ) -> Result<u64> {
        // What only the first rank does, of whole fields.
        let gathered = |problem: &ReducedProblem| match problem.ranks.are_several() {
            true => (size_of::<f64>() * problem.grid.points()) as u64,
            false => 0,
        };
        let flow =
            |problem: &ReducedProblem| if self.leakage { leakage_bytes(problem.grid) + gathered(problem) } else { 0 };
        let below = |problem: &ReducedProblem| match self.subsurface.is_none() {
            true => 0,
            false => subsurface_bytes(problem) + gathered(problem),
        };
        let planned = |problem: ReducedProblem| {
            let moved =
                if self.body.len() == 2 && self.out.is_some() { size_of::<f64>() * problem.grid.points() } else { 0 };
            let after = if problem.ranks.is_first() { flow(&problem) + below(&problem) + moved as u64 } else { 0 };
            let path = LoadPathSolver::new(problem, method, case.model.resolution, 0.0, loads).with_stiffness();
            let maps = case.scene.accuracy().is_some_and(|accuracy| accuracy.errors.has_maps());
            let path = path.with_map_errors(maps);
            path.plan(self.pull_off).bytes + after
        };
        // Ranks on one machine share its memory.
        let need = problem.ranks.sum_on_this_machine(planned(problem.clone()));
        let available = asperity_grid::sys::available_memory_bytes();
        self.print_plan(method, problem.grid, need, available)?;
        if need > available {
            let advice = fitting(planned, problem, available);
            return Err(Error::Memory { what: method.card().id.into(), need, have: available, advice });
        }
        Ok(need)
    }

    /// The output of --dry-run.
    fn print_plan(&self, method: &'static dyn ContactMethod, grid: Grid, required: u64, available: u64) -> Result<()> {
        if self.dry_run && self.json {
            return output::json_line(&json!({ "bytes": required, "available_bytes": available }));
        }
        if self.dry_run {
            let (id, required, available) = (method.card().id, memory(required), memory(available));
            let Grid { nx, ny, .. } = grid;
            output::print(&format!("{id} on {nx} x {ny} points needs {required} of memory; {available} are available"));
        }
        Ok(())
    }

    /// Key of a checkpoint: these flags and the contents of the files that they name, and the nodes of one of several grids.
    fn key(&self, nodes: Option<[usize; 2]>) -> Result<String> {
        let files = [self.surface_file(), self.initial_gap.as_deref()].map(|f| f.map(StageKey::of_file).transpose());
        let [heights, initial_gap] = files;
        let mut scene = self.scene()?;
        // What is an error does not change the results.
        scene.surface.strict = false;
        // The contents of the maps, wherever they are.
        if let Some(other) = &mut scene.surface.other {
            other.heights = file_hash(&other.heights)?.into();
        }
        scene.continuum.hardness_map = self.hardness_map.as_deref().map(file_hash).transpose()?.map(PathBuf::from);
        let own = (scene, self.resolution, self.elastic_stress);
        Ok(StageKey::new("solve", &(own, heights?, initial_gap?, nodes), &[])?.with(""))
    }

    /// Opens the folder of results.
    ///
    /// # Errors
    /// If it contains other files, or the results of another solve without --overwrite.
    fn open_folder(&self, out: &Path, key: &str) -> Result<()> {
        cache::open(out)?;
        match SolveCache::difference(out, key, &self.scene()?)? {
            Some(difference) if !self.overwrite => {
                let difference = rename_keys_in(&difference, &|key| self.flag_of(key));
                let found = format!("{} (contains another solve: {difference})", out.display());
                let accepted = "a new folder, or --overwrite to replace these results";
                Err(Error::input(COMMAND_LINE, "--out", found, accepted))
            }
            _ => Ok(()),
        }
    }

    /// Marks the results in the folder as complete.
    fn finish(&self, out: &Path, key: String, solved: &Solved, accuracy: Option<AccuracyResults>) -> Result<()> {
        let scene = serde_json::to_value(self.scene()?).unwrap_or_default();
        let (states, pull_off) = (solved.lines.clone(), solved.pull_off.clone());
        SolveCache::write(out, &SolveCache { key, scene, states, pull_off, accuracy })
    }

    pub(super) fn execute(self, ranks: &Ranks) -> Result<()> {
        let mut case = self.case()?;
        let progress = TerminalProgress::new();
        let names = |key: &str| self.flag_of(key);
        let method = asperity_methods::find(&self.method).expect("checked with the scene");
        self.check_ranks(&case, method, ranks)?;
        let units = self.given_units(&case);
        Device::check(&case.planned_problem(), method.card()).map_err(|e| units.rewrite(e))?;
        let accuracy = case.scene.accuracy();
        // Of several grids the last one warns.
        let warnings = case.warnings.iter().filter(|_| accuracy.is_none());
        warnings.for_each(|w| progress.warn(&rename_keys_in(&units.text(w), &names)));
        if let Some(provenance) = case.provenance() {
            progress.note(&provenance.to_string());
        }
        if !self.body.is_empty() {
            progress.note(&self.of_bodies(&case));
        }
        if let Some(accuracy) = accuracy {
            return self.solve_within(&case, &accuracy, &progress);
        }
        if !self.dry_run {
            impose_contact(&mut case, units, &asperity_contact::method::NoObserver)
                .map_err(|e| rename_keys(e, &names))?;
        }
        self.solve(&case, (ranks, true), &progress).map(drop)
    }

    /// Solves on one grid. `shows`: the states are printed as they are solved.
    fn solve(&self, case: &Case, (ranks, shows): (&Ranks, bool), progress: &TerminalProgress) -> Result<Solved> {
        let method = asperity_methods::find(&self.method).expect("checked with the scene");
        let heights = LentHeights::of(case.surface(), case.model.grid, ranks);
        if method.card().kind == MethodKind::Estimate {
            let shown = estimated::run(self, case, heights.get(), progress).map(|()| Solved::default());
            return shown.map_err(|e| self.given_units(case).rewrite(e));
        }
        let loads: Vec<Load> = case.load_steps().iter().map(|step| step.target).collect();
        let problem = ReducedProblem { ranks, ..case.problem(heights.get()) };
        let previous = Before::now(self.planned(case, method, &problem, &loads)?);
        if self.dry_run {
            return Ok(Solved::default());
        }
        let path = LoadPathSolver::new(problem.clone(), method, case.model.resolution, 0.0, &loads);
        let maps = case.scene.accuracy().is_some_and(|accuracy| accuracy.errors.has_maps());
        let path = path.with_stiffness().with_leakage(self.leakage).with_map_errors(maps);
        if !ranks.is_first() {
            // As the first one, which opens it.
            self.out.iter().for_each(|out| guard(out));
            return self.follow(case, &path, ranks).map(|()| Solved::default());
        }
        let mut reporter = SolveReporter::new((self, shows), case, &problem, &path, loads.len(), previous);
        let Some(out) = &self.out else {
            let begin = self.initial_gap(case)?;
            let pull_off = self.walk((case, &path), begin, None, &mut reporter, progress)?;
            return Ok(reporter.solved(pull_off));
        };
        let grid = case.model.grid;
        let key = self.key((!shows).then_some([grid.nx, grid.ny]))?;
        // Another build of the program solves a finished load again.
        let solved_by = format!("{key} {}", StageKey::of_program()?);
        self.open_folder(out, &key)?;
        let finished = SolveCache::find(out, &solved_by, !self.no_verify, &|w| progress.warn(w));
        if let Some(finished) = finished {
            FolderState::Finished.of_first(ranks);
            if shows {
                progress.note(&format!("finished already: results read from {}", out.display()));
            }
            finished.states.into_iter().try_for_each(|line| reporter.again(line))?;
            reporter.doubtful().iter().for_each(|w| progress.warn(w));
            finished.pull_off.iter().try_for_each(|line| reporter.pull_off_again(line))?;
            let solved = reporter.solved(finished.pull_off);
            let seconds = solved.states.iter().map(|state| state.seconds).sum();
            return Ok(Solved { earlier_seconds: Some(seconds), ..solved });
        }
        let checkpoint = self.resume(out, &key, &mut reporter, progress)?;
        if checkpoint.is_some() { FolderState::Checkpoint } else { FolderState::Nothing }.of_first(ranks);
        let finished = checkpoint.as_ref().map_or(Vec::new(), |c| c.finished.clone());
        let writer = CheckpointWriter::new(out, CHECKPOINT, key, finished).on(ranks);
        let begin = match checkpoint {
            Some(checkpoint) => {
                SolveCache::forget(out);
                Some(checkpoint.begin(ranks)?)
            }
            None => {
                let begin = self.initial_gap(case)?;
                cache::clear(out, self.initial_gap.as_deref())?;
                begin
            }
        };
        let pull_off = self.walk((case, &path), begin, Some(&writer), &mut reporter, progress)?;
        let solved = reporter.solved(pull_off);
        self.finish(out, solved_by, &solved, None)?;
        writer.remove_files();
        Ok(solved)
    }

    /// The gap that --initial-gap names, over the cell's extent.
    fn initial_gap(&self, case: &Case) -> Result<Option<InitialState>> {
        let Some(file) = &self.initial_gap else { return Ok(None) };
        let gap = crate::pipeline::start(file, case.model.grid)?;
        Ok(Some(InitialState::Gap(gap.into_iter().map(|g| g / case.scales.length_m).collect())))
    }

    /// The checkpoint of an interrupted solve with this key, if there is one; its finished loads are reported.
    fn resume(
        &self,
        out: &Path,
        key: &str,
        reporter: &mut SolveReporter,
        progress: &TerminalProgress,
    ) -> Result<Option<Checkpoint>> {
        let checkpoint = Checkpoint::find(out, CHECKPOINT, key, &|w| progress.warn(w));
        if !self.overwrite && Checkpoint::is_of_another(out, CHECKPOINT, key) {
            let found = format!("{} (holds the checkpoint of another solve)", out.display());
            let accepted = "another folder, that solve's own command to finish it, or --overwrite to replace it";
            return Err(Error::input(COMMAND_LINE, "--out", found, accepted));
        }
        let finished = checkpoint.as_ref().map_or(Vec::new(), |c| c.finished.clone());
        if checkpoint.is_some() {
            let loads = reporter.loads;
            progress.note(&match finished.len() {
                n if n < loads => format!("resuming at load {} of {loads}", n + 1),
                _ => "resuming at the pull-off".to_string(),
            });
        }
        finished.iter().try_for_each(|line| reporter.again(line.clone()))?;
        Ok(checkpoint)
    }

    /// Solves load by load, then the pull-off if requested, whose line of JSON is returned.
    fn walk(
        &self,
        (case, path): (&Case, &LoadPathSolver),
        begin: Option<InitialState>,
        writer: Option<&CheckpointWriter>,
        reporter: &mut SolveReporter,
        progress: &TerminalProgress,
    ) -> Result<Option<Value>> {
        let (grid, tolerance, id) = (path.problem().grid, path.problem().tolerance, path.method().card().id);
        progress.begin("solve", &format!("{id} on {} x {} points", grid.nx, grid.ny));
        let loads = reporter.loads;
        let observer = ProgressReporter::new(progress, writer, "", (reporter.lines.len(), loads));
        let pulled = path.walk(begin, self.pull_off, &observer, |i, reached| {
            let state = &reached.state;
            let line = reporter.state(i, &reached)?;
            match state.stop {
                Stop::Converged => {
                    writer.iter().for_each(|k| k.load_finished(line.clone()));
                    Ok(())
                }
                stop => {
                    let file = self.out.as_ref().map(|o| o.join(file_name(i, loads, stop, "gap.npy")));
                    let number = i + 1;
                    let why = match stop {
                        Stop::Detached => {
                            let load = self.given_units(case).load(&case.load_steps()[i]);
                            format!("contact is lost at load {number} of {loads}, {load}")
                        }
                        stop => format!("load {number} of {loads}: {stop}"),
                    };
                    Err(state.not_converged(id, why, tolerance, file))
                }
            }
        });
        let pulled = pulled.map_err(|e| self.given_units(case).rewrite(e))?;
        reporter.doubtful().iter().for_each(|w| progress.warn(w));
        pulled.map(|p| reporter.pull_off(&p)).transpose()
    }
}

/// The largest grids of the problem's shape that fit into `have` bytes; `bytes` plans a problem with all that is also stored.
fn fitting<'p>(bytes: impl Fn(ReducedProblem<'p>) -> u64, problem: &ReducedProblem<'p>, available: u64) -> String {
    let Grid { nx, ny, .. } = problem.grid;
    let largest_grid = |precision| {
        let grid = |n: usize| Grid { nx: n, ny: (n * ny / nx).max(1), ..problem.grid };
        let fits = |n| bytes(ReducedProblem { grid: grid(n), precision, ..problem.clone() }) <= available;
        // Bisection: one more point never needs less.
        let (mut low, mut high) = (0, nx + 1);
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            if fits(middle) { low = middle } else { high = middle }
        }
        format!("{} x {} points", low, if low == 0 { 0 } else { grid(low).ny })
    };
    match problem.precision {
        Precision::F32 => format!("{} fit", largest_grid(Precision::F32)),
        Precision::F64 => {
            format!("{} fit, with --precision f32 {}", largest_grid(Precision::F64), largest_grid(Precision::F32))
        }
    }
}
