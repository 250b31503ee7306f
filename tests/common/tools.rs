//! Programs that some tests need. Without its program such a test passes unchecked; it says so on standard error and in
//! `target/tmp/skipped`, which `make test` prints last. `ASPERITY_REQUIRE=lammps,python,browser,slurm,mpi,qemu` makes a missing program a
//! failure. A program that exists and does not work is always one.

use asperity::atoms::search_path::search_path;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Records that the current test was not run, or fails where `tool` is required.
pub(crate) fn skip(tool: &str, reason: &str) {
    let test = std::thread::current().name().unwrap_or("a test").to_string();
    let required = std::env::var("ASPERITY_REQUIRE").unwrap_or_default();
    assert!(!required.split(',').any(|r| r == tool), "ASPERITY_REQUIRE={required}, but {reason}");
    // The harness captures the output of `eprintln!` in passing tests, but not direct writes to standard error.
    let _ = writeln!(std::io::stderr(), "\n*** SKIPPED: {test}: {reason}. NOTHING WAS CHECKED. ***\n");
    let list = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("skipped");
    let mut file = std::fs::OpenOptions::new().create(true).append(true).open(list).expect("the list of skipped tests");
    writeln!(file, "{test}: {reason}").expect("written");
}

/// The first of `names` in the search path.
pub(crate) fn program(names: &[&str]) -> Option<PathBuf> {
    names.iter().find_map(|name| search_path(Path::new(name)))
}
