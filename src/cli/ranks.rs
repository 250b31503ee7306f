//! Commands that a launcher of MPI has started several times: which ones share their work, who prints, and how an error ends all.

use super::file::COMMAND_LINE;
use super::output;
use crate::{Error, Result};
use asperity_grid::sys::ranks::Ranks;
use std::time::Duration;

#[cfg(feature = "mpi")]
mod mpi;

/// Time in which the first rank reports an error that all ranks have.
const GRACE: Duration = Duration::from_secs(10);

/// Exit code of all ranks after a panic of one (`EX_SOFTWARE` of sysexits.h).
const PANICKED: u8 = 70;

/// How processes of a launcher work independently.
const APART: &str = "for work of its own in each process unset OMPI_COMM_WORLD_SIZE, PMI_SIZE and MV2_COMM_WORLD_SIZE";

/// Variables in which launchers of MPI hand their processes the number of their rank, and of all ranks. Where a launcher hands no
/// count, MPI knows it.
const LAUNCHERS: [(&str, Option<&str>); 4] = [
    ("OMPI_COMM_WORLD_RANK", Some("OMPI_COMM_WORLD_SIZE")),
    ("PMI_RANK", Some("PMI_SIZE")),
    ("MV2_COMM_WORLD_RANK", Some("MV2_COMM_WORLD_SIZE")),
    ("PMIX_RANK", None),
];

/// Number of this process and of all processes that a launcher of MPI has started with it: (0, 1) without a launcher.
fn launched() -> (usize, usize) {
    let number = |name: &str| std::env::var(name).ok()?.parse().ok();
    LAUNCHERS.iter().find_map(|(rank, count)| Some((number(rank)?, number((*count)?)?))).unwrap_or((0, 1))
}

/// Whether a launcher of MPI has started this process.
#[cfg(feature = "mpi")]
fn is_launched() -> bool {
    LAUNCHERS.iter().any(|(rank, _)| std::env::var_os(rank).is_some())
}

/// Silences this process if it is not the first that a launcher has started.
fn first_reports() {
    if launched().0 > 0 {
        output::silence();
    }
}

/// Refuses a command that several ranks cannot share.
///
/// # Errors
/// `Input` if a launcher has started several processes, in a build with MPI.
pub(super) fn expect_one() -> Result<()> {
    match launched() {
        (_, count) if count > 1 && cfg!(feature = "mpi") => {
            first_reports();
            let accepted = format!("`solve` with the method `fast`, or one rank; {APART}");
            Err(Error::input(COMMAND_LINE, "ranks", format!("{count} for this command"), accepted))
        }
        _ => Ok(()),
    }
}

/// The ranks that a launcher of MPI has started, or one. `None` if this build has no MPI and there are several.
fn start() -> Option<Ranks> {
    #[cfg(feature = "mpi")]
    if is_launched() {
        return Some(Ranks::of(std::sync::Arc::new(mpi::start()?)));
    }
    (launched().1 == 1).then(Ranks::default)
}

/// Ends all ranks after a panic of this one, for which the others would wait.
struct EndsAll<'r>(&'r Ranks);

impl Drop for EndsAll<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.abort(PANICKED);
        }
    }
}

/// Runs `work` on all ranks. The first prints. An error of any rank ends all of them with one message.
///
/// # Errors
/// Those of `work` on one rank; several ranks that this build cannot start.
pub(super) fn share(work: impl FnOnce(&Ranks) -> Result<()>) -> Result<()> {
    let Some(ranks) = start() else {
        first_reports();
        let accepted = format!("one: this program was built without MPI (cargo build --features mpi); {APART}");
        return Err(Error::input(COMMAND_LINE, "ranks", launched().1, accepted));
    };
    let ranks = &ranks;
    let _guard = EndsAll(ranks);
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
