//! Every reader with changed copies of valid files: an answer in time, without a panic, with memory in proportion.
//! `cargo bench --bench measure -- damage` does the same for any number of copies.

#[path = "../fuzz/mod.rs"]
mod fuzz;

use fuzz::{driver, targets};
use std::time::Duration;

#[global_allocator]
static ALLOCATOR: peak_alloc::PeakAlloc = peak_alloc::PeakAlloc;

/// Changed copies for each reader; a debug build reads some hundred to some thousand in a second.
const INPUTS: u64 = 100;

/// A debug build on a busy machine takes many times the time of a release build, whose limit is 2 s.
const LIMIT: Duration = Duration::from_secs(30);

/// One test: the allocator counts for the whole process.
#[test]
fn changed_inputs_are_answered_in_time_and_in_proportion() {
    let failures = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    for target in targets::TARGETS {
        let outcome = driver::run(target, 0, INPUTS, LIMIT, failures).unwrap_or_else(|e| panic!("{e}"));
        assert!(outcome.read > 0, "{}: not even its valid files are read", target.name);
        assert!(outcome.refused > 0, "{}: every changed copy was read: {}", target.name, outcome.read);
    }
}
