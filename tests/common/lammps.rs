//! LAMMPS, or a loud word that a test is skipped.

use asperity::atoms::engine::LammpsEngine;
use std::io::Write;

pub fn there_is_lammps(test: &str) -> bool {
    match LammpsEngine::find(None) {
        Ok(_) => true,
        Err(error) => {
            // Past the test harness, which swallows what a passing test prints.
            let words = format!("\n*** SKIPPED: {test}: {error}. NOTHING WAS CHECKED. ***\n");
            let _ = writeln!(std::io::stderr(), "{words}");
            false
        }
    }
}
