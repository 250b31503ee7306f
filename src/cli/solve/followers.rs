//! `solve` on several ranks: what they cannot do, and the ranks that follow the first.

use super::flags::Solve;
use crate::cli::file::COMMAND_LINE;
use crate::load::Load;
use crate::method::{ContactMethod, NoObserver, Stop};
use crate::path::{Begin, Checkpoint, LoadPath};
use crate::scene::Case;
use crate::sys::ranks::Ranks;
use crate::{Error, Result};
use std::path::Path;

/// Stem of the files of a checkpoint.
pub(super) const CHECKPOINT: &str = "checkpoint";

/// What the first rank finds in the folder of results.
#[derive(Clone, Copy, PartialEq)]
#[repr(u8)]
pub(super) enum Found {
    Nothing,
    Checkpoint,
    Finished,
}

impl Found {
    /// What the first rank has found.
    pub(super) fn of_first(self, ranks: &Ranks) -> Found {
        match ranks.first_says(self as u8) {
            0 => Found::Nothing,
            1 => Found::Checkpoint,
            _ => Found::Finished,
        }
    }
}

impl Solve {
    /// Refuses what several ranks cannot share.
    ///
    /// # Errors
    /// `Input` with all of it.
    pub(super) fn check_ranks(&self, case: &Case, method: &'static dyn ContactMethod, ranks: &Ranks) -> Result<()> {
        if !ranks.are_several() {
            return Ok(());
        }
        let continuum = &case.scene.continuum;
        let mean_gap = case.load_steps().iter().any(|step| matches!(step.target, Load::MeanGap(_)));
        let refused = [
            ("--method", method.card().id != "fast", "fast"),
            ("--non-periodic", !continuum.is_periodic(), "a periodic body"),
            ("--hardness", case.hardness.is_some(), "an elastic body"),
            ("--pull-off", self.pull_off, "loads without a pull-off"),
            ("--contact", !case.scene.load.contact.is_empty(), "pressures"),
            ("--mean-gap", mean_gap, "pressures"),
        ];
        match refused.into_iter().find(|(_, is_given, _)| *is_given) {
            None => Ok(()),
            Some((flag, _, accepted)) => {
                let found = format!("given on {} ranks", ranks.count());
                Err(Error::input(COMMAND_LINE, flag, found, format!("{accepted}, or one rank")))
            }
        }
    }

    /// The part of a rank that neither prints nor writes files. What the first rank reports of a load is no error here.
    ///
    /// # Errors
    /// Those of this rank alone, such as a checkpoint that it cannot read.
    pub(super) fn follow(&self, case: &Case, path: &LoadPath, ranks: &Ranks) -> Result<()> {
        let begin = match &self.out {
            None => self.initial_gap(case)?,
            Some(out) => match Found::Nothing.of_first(ranks) {
                Found::Finished => return Ok(()),
                Found::Nothing => self.initial_gap(case)?,
                Found::Checkpoint => Some(self.same_checkpoint(out, ranks)?),
            },
        };
        let mut last = Stop::Converged;
        let ended = path.walk(begin, false, &NoObserver, |_, reached| {
            last = reached.state.stop;
            if last == Stop::Converged { Ok(()) } else { Err(Error::Interrupted) }
        });
        // The first rank says why, and ends all.
        if last == Stop::Converged { ended.map(|_| ()) } else { Ok(()) }
    }

    /// The checkpoint from which the first rank continues.
    fn same_checkpoint(&self, out: &Path, ranks: &Ranks) -> Result<Begin> {
        match Checkpoint::find(out, CHECKPOINT, &self.key()?, &|_| {}) {
            Some(checkpoint) => Ok(Begin::Checkpoint(Box::new(checkpoint))),
            None => {
                let found = format!("{} (the checkpoint is not readable on rank {})", out.display(), ranks.own());
                Err(Error::input(COMMAND_LINE, "--out", found, "a folder that all ranks share"))
            }
        }
    }
}
