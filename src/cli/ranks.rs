//! Commands that a launcher of MPI has started several times: which ones share their work, who prints, and how an error ends all.

use super::file::COMMAND_LINE;
use super::output;
use crate::{Error, Result};
use asperity_grid::sys::ranks::{self, Ranks};
use std::time::Duration;

/// Time in which the first rank reports an error that all ranks have.
const GRACE: Duration = Duration::from_secs(10);

/// How processes of a launcher work independently.
const APART: &str = "for work of its own in each process unset OMPI_COMM_WORLD_SIZE, PMI_SIZE and MV2_COMM_WORLD_SIZE";

/// Silences this process if it is not the first that a launcher has started.
fn first_reports() {
    if ranks::launched().0 > 0 {
        output::silence();
    }
}

/// Refuses a command that several ranks cannot share.
///
/// # Errors
/// `Input` if a launcher has started several processes, in a build with MPI.
pub(super) fn expect_one() -> Result<()> {
    match ranks::launched() {
        (_, count) if count > 1 && cfg!(feature = "mpi") => {
            first_reports();
            let accepted = format!("`solve` with the method `fast`, or one rank; {APART}");
            Err(Error::input(COMMAND_LINE, "ranks", format!("{count} for this command"), accepted))
        }
        _ => Ok(()),
    }
}

/// Runs `work` on all ranks. The first prints. An error of any rank ends all of them with one message.
///
/// # Errors
/// Those of `work` on one rank; several ranks that this build cannot start.
pub(super) fn share(work: impl FnOnce(&Ranks) -> Result<()>) -> Result<()> {
    let Some(started) = ranks::start() else {
        first_reports();
        let accepted = format!("one: this program was built without MPI (cargo build --features mpi); {APART}");
        return Err(Error::input(COMMAND_LINE, "ranks", ranks::launched().1, accepted));
    };
    let ranks = started.ranks();
    if !ranks.is_first() {
        output::silence();
    }
    let ended = work(ranks).and_then(|()| output::written());
    if !ranks.is_first() {
        // The launcher ends this rank where the first has failed.
        asperity_grid::sys::end_at_termination();
    }
    if ranks.are_several()
        && let Err(error) = &ended
    {
        let own = match ranks.own() {
            0 => String::new(),
            rank => {
                std::thread::sleep(GRACE);
                format!(" on rank {rank}")
            }
        };
        output::complain(&format!("asperity: error{own}: {error}"));
        ranks.abort(error.exit_code());
    }
    ended
}
