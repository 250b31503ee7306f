//! LAMMPS for tests that need it.

use crate::tools;
use asperity::atoms::engine::LammpsEngine;
use std::ops::Deref;
use std::sync::{Condvar, Mutex, PoisonError};

/// Cores reserved for LAMMPS by tests of this binary.
static RESERVED: Mutex<usize> = Mutex::new(0);
static RELEASED: Condvar = Condvar::new();

/// LAMMPS, with one reserved core per rank. All tests of a binary together never use more cores than the machine has.
pub(crate) struct Lammps {
    engine: LammpsEngine,
    ranks: usize,
}

/// Waits until `ranks` cores are free for LAMMPS. `None` if LAMMPS is not installed. A test calls this once.
pub(crate) fn lammps(ranks: usize) -> Option<Lammps> {
    if tools::program(&["lmp", "lammps"]).is_none() {
        tools::skip("lammps", "LAMMPS is not installed");
        return None;
    }
    let engine = LammpsEngine::find(None).expect("LAMMPS works").with_host(env!("CARGO_BIN_EXE_asperity").into());
    let cores = std::thread::available_parallelism().map_or(1, |c| c.get());
    let reserved = RESERVED.lock().unwrap_or_else(PoisonError::into_inner);
    // A test with more ranks than cores runs when no other test uses LAMMPS.
    let is_busy = |reserved: &mut usize| *reserved > 0 && *reserved + ranks > cores;
    *RELEASED.wait_while(reserved, is_busy).unwrap_or_else(PoisonError::into_inner) += ranks;
    Some(Lammps { engine, ranks })
}

impl Deref for Lammps {
    type Target = LammpsEngine;

    fn deref(&self) -> &LammpsEngine {
        &self.engine
    }
}

impl Drop for Lammps {
    fn drop(&mut self) {
        *RESERVED.lock().unwrap_or_else(PoisonError::into_inner) -= self.ranks;
        RELEASED.notify_all();
    }
}
