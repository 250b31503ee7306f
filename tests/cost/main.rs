//! Transforms, allocated bytes and written files of scenes that request one quantity. The counters belong to the
//! process, so that these tests have a separate binary and run one at a time.

mod atoms;
mod continuum;
#[path = "../common/lammps.rs"]
mod lammps;
#[path = "../common/tools.rs"]
mod tools;

use std::sync::{Mutex, MutexGuard, PoisonError};

static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Waits for the other test, ignoring its failure.
fn alone() -> MutexGuard<'static, ()> {
    ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner)
}
