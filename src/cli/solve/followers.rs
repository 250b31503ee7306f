//! `solve` on several ranks: what they cannot do, and the ranks that follow the first.

use super::fields::FieldWriter;
use super::flags::SolveArgs;
use crate::cli::file::COMMAND_LINE;
use crate::pipeline::checkpoint::{Checkpoint, CheckpointWriter};
use crate::scene::Case;
use crate::{Error, Result};
use asperity_contact::method::{ContactMethod, Equilibrium, Iteration, Observer, SnapshotRef, Stop};
use asperity_contact::path::{LoadPathSolver, Reached};
use asperity_grid::Grid;
use asperity_grid::sys::ranks::Ranks;
use serde_json::Value;
use std::ops::ControlFlow;
use std::path::Path;

/// Stem of the files of a checkpoint.
pub(super) const CHECKPOINT: &str = "checkpoint";

/// What the first rank finds in the folder of results.
#[derive(Clone, Copy, PartialEq)]
#[repr(u8)]
pub(super) enum FolderState {
    Nothing,
    Checkpoint,
    Finished,
}

impl FolderState {
    /// What the first rank has found.
    pub(super) fn of_first(self, ranks: &Ranks) -> FolderState {
        match ranks.first_says(self as u8) {
            0 => FolderState::Nothing,
            1 => FolderState::Checkpoint,
            _ => FolderState::Finished,
        }
    }
}

impl SolveArgs {
    /// Refuses what several ranks cannot share.
    ///
    /// # Errors
    /// `Input` with all of it.
    pub(super) fn check_ranks(&self, case: &Case, method: &'static dyn ContactMethod, ranks: &Ranks) -> Result<()> {
        if !ranks.are_several() {
            return Ok(());
        }
        let continuum = &case.scene.continuum;
        let refused = [
            ("--method", !method.card().capabilities.ranks, "fast"),
            ("--non-periodic", !continuum.is_periodic(), "a periodic body"),
            ("--hardness", case.problem.hardness.is_some(), "an elastic body"),
            ("--pull-off", self.pull_off, "loads without a pull-off"),
            ("--error or --budget", case.scene.accuracy.is_some(), "one grid"),
            ("--contact", !case.scene.load.contact.is_empty(), "pressures"),
            ("--mean-gap", case.imposes_gaps(), "pressures"),
        ];
        match refused.into_iter().find(|(_, is_given, _)| *is_given) {
            None => Ok(()),
            Some((flag, _, accepted)) => {
                let found = format!("given on {} ranks", ranks.count());
                Err(Error::input(COMMAND_LINE, flag, found, format!("{accepted}, or one rank")))
            }
        }
    }

    /// The part of a rank that does not print: it writes its rows of the fields. What the first rank reports of a load is no error here.
    ///
    /// # Errors
    /// Those of this rank alone, such as a checkpoint that it cannot read.
    pub(super) fn follow(&self, case: &Case, path: &LoadPathSolver, ranks: &Ranks) -> Result<()> {
        let (begin, writer) = match &self.out {
            None => (self.initial_gap(case)?, None),
            Some(out) => {
                let folder_state = FolderState::Nothing.of_first(ranks);
                if folder_state == FolderState::Finished {
                    return Ok(());
                }
                let key = self.key(None)?;
                let checkpoint = match folder_state {
                    FolderState::Checkpoint => Some(same_checkpoint(out, &key, ranks)?.begin(ranks)?),
                    _ => self.initial_gap(case)?,
                };
                (checkpoint, Some(CheckpointWriter::new(out, CHECKPOINT, key, Vec::new()).on(ranks)))
            }
        };
        let fields = FieldWriter::new(self, case, path, case.load_steps().len());
        let ended = path.walk(begin, false, &OwnRows(writer.as_ref()), |i, Reached { state, .. }| {
            fields.state(i, &state)?;
            writer.iter().for_each(|w| w.load_finished(Value::Null));
            if state.stop == Stop::Converged { Ok(()) } else { Err(Error::Interrupted) }
        });
        // The first rank says why, and ends all.
        match ended {
            Err(Error::Interrupted) => Ok(()),
            ended => ended.map(|_| ()),
        }
    }
}

/// Writes the rows of this rank into the checkpoints that the first rank decides on.
struct OwnRows<'a>(Option<&'a CheckpointWriter>);

impl Observer for OwnRows<'_> {
    fn iteration(&self, _: Iteration) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    fn snapshot(&self, snapshot: SnapshotRef) {
        self.0.iter().for_each(|writer| writer.write(&snapshot));
    }

    fn interrupted(&self, grid: Grid, iterate: &Equilibrium) {
        self.0.iter().for_each(|writer| writer.write_interrupted(grid, iterate));
    }
}

/// The checkpoint from which the first rank continues.
fn same_checkpoint(out: &Path, key: &str, ranks: &Ranks) -> Result<Checkpoint> {
    Checkpoint::unverified(out, CHECKPOINT, key).ok_or_else(|| {
        let found = format!("{} (the checkpoint is not readable on rank {})", out.display(), ranks.own());
        Error::input(COMMAND_LINE, "--out", found, "a folder that all ranks share")
    })
}
