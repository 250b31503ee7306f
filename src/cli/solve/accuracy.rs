//! `solve --error`: grid after grid, each an ordinary solve, of which the last one is shown and kept.

use super::SolveArgs;
use super::cache::{self, SolveCache};
use super::reporter::{doubtful, show_pull_off, show_states};
use super::solved::Solved;
use crate::cli::output;
use crate::cli::progress::TerminalProgress;
use crate::pipeline::{Listener, StageKey};
use crate::report::accuracy::{missed, summary};
use crate::scene::{Case, rename_keys_in};
use crate::{Error, Result};
use asperity_contact::load::Load;
use asperity_contact::method::Device;
use asperity_contact::problem::{Accuracy, AccuracyResults, ErrorCost, SolvedGrid};
use asperity_grid::sys::ranks::ALONE;
use asperity_surface::files::atomic_file::{list, rename};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Folder of a grid's solve in that of the results, while it is not known whether it is the last.
fn of_grid(out: &Path, [nx, ny]: [usize; 2]) -> PathBuf {
    out.join(format!("{}{nx}x{ny}", cache::GRID))
}

impl SolveArgs {
    /// Solves to an accuracy.
    ///
    /// # Errors
    /// Those of a solve; `Inaccurate` with --strict.
    pub(super) fn solve_within(&self, case: &Case, accuracy: &Accuracy, progress: &TerminalProgress) -> Result<()> {
        let refinements = case.problem.surface.refinements();
        // The series of a map is made once.
        let [nx, ny] = refinements[0];
        let coarsest = case.problem.surface.on_nodes(nx, ny);
        if self.dry_run {
            for nodes in &refinements {
                match self.plan(&case.on_nodes(*nodes, &coarsest, accuracy)?) {
                    // Beyond the memory no grid is tried.
                    Err(Error::Memory { .. }) if *nodes != refinements[0] => break,
                    planned => planned?,
                }
            }
            return Ok(());
        }
        let key = self.key(None)?;
        let solved_by = format!("{key} {}", StageKey::of_program()?);
        if let Some(out) = &self.out {
            self.open_folder(out, &key)?;
            if let Some(finished) = SolveCache::find(out, &solved_by, !self.no_verify, &|w| progress.warn(w)) {
                progress.note(&format!("finished already: results read from {}", out.display()));
                let solved = Solved::read(finished.states, finished.pull_off)?;
                let reached = finished.accuracy.unwrap_or_default();
                let nodes = reached.grids.last().map_or(refinements[0], |grid| [grid.nx, grid.ny]);
                return self.end(&case.on_nodes(nodes, &coarsest, accuracy)?, &solved, &reached, progress);
            }
        }
        let mut last = None;
        let reached = accuracy.refine(&case.problem.surface, |nodes| {
            let case = case.on_nodes(nodes, &coarsest, accuracy)?;
            let out = self.out.as_ref().map(|out| of_grid(out, nodes));
            let solved = SolveArgs { out, ..self.clone() }.solve(&case, (&ALONE, false), progress)?;
            let errors = accuracy.errors_of(case.imposes_gaps(), &solved.states, solved.pull_off_error());
            let earlier = solved.earlier_seconds;
            last = Some((case, solved));
            Ok((errors, earlier))
        })?;
        let (case, solved) = last.expect("one grid at least is solved");
        if let Some(out) = &self.out {
            let SolvedGrid { nx, ny, .. } = reached.grids.last().expect("one grid at least is solved");
            keep(out, &of_grid(out, [*nx, *ny]))?;
            self.finish(out, solved_by, &solved, Some(reached.clone()))?;
            cache::remove_grids(out)?;
        }
        self.end(&case, &solved, &reached, progress)
    }

    /// Shows the results, and how they were reached.
    ///
    /// # Errors
    /// `Inaccurate`, with --strict.
    fn end(&self, case: &Case, solved: &Solved, reached: &AccuracyResults, progress: &TerminalProgress) -> Result<()> {
        let given = self.given_units(case);
        let warn = |text: &str| progress.warn(&rename_keys_in(&given.text(text), &|key| self.flag_of(key)));
        case.warnings.iter().for_each(|text| warn(text));
        doubtful(&solved.states).iter().for_each(|text| warn(text));
        let units = self.units(case);
        show_states(self, &units, &solved.states, &solved.lines)?;
        solved.pull_off.iter().try_for_each(|line| show_pull_off(self.json, &units, line))?;
        if self.json {
            output::json_line(&line(reached))?;
        } else {
            output::print(&summary(reached));
        }
        match missed(reached) {
            Some(missed) if case.scene.surface.strict => Err(Error::Inaccurate(missed)),
            Some(missed) => {
                progress.warn(&missed);
                Ok(())
            }
            None => Ok(()),
        }
    }

    /// Memory of a solve on one grid, for --dry-run.
    fn plan(&self, case: &Case) -> Result<()> {
        let method = asperity_methods::find(&self.method).expect("checked with the scene");
        Device::check(&case.planned_problem(), method.card())?;
        let loads: Vec<Load> = case.load_steps().iter().map(|step| step.target).collect();
        self.planned(case, method, &case.planned_problem(), &loads).map(drop)
    }
}

/// Moves the results of the last grid into the folder, and removes those of the others.
fn keep(out: &Path, last: &Path) -> Result<()> {
    cache::clear_states(out, None)?;
    let mut results = list(last)?.into_iter().filter(|(name, _)| cache::is_result(name));
    results.try_for_each(|(name, path)| rename(&path, &out.join(name)))
}

/// The line of JSON.
fn line(reached: &AccuracyResults) -> Value {
    let cost = |factor: f64| match reached.cost_of(factor) {
        Some(ErrorCost::Measured(seconds)) => json!({ "seconds": seconds, "measured": true }),
        Some(ErrorCost::Estimated(seconds)) => json!({ "seconds": seconds, "measured": false }),
        None => Value::Null,
    };
    json!({
        "accuracy": reached,
        "met": (!reached.requested.is_empty()).then_some(reached.is_met()),
        "errors": reached.grids.last().map(|grid| &grid.errors),
        "seconds": reached.seconds(),
        "ten_times_the_error": cost(10.0),
        "a_tenth_of_the_error": cost(0.1),
    })
}
