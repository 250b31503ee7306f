//! Transforms, allocated bytes and written files of scenes that request one quantity. The counters are those of the process, so
//! these tests have a binary of their own and run one at a time.

mod atoms;
mod continuum;
#[path = "../common/lammps.rs"]
mod lammps;

use std::sync::{Mutex, MutexGuard, PoisonError};

static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Waits for the other test. A failure there is none here.
fn alone() -> MutexGuard<'static, ()> {
    ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner)
}
