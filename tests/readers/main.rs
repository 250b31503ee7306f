//! Results in other programs: Python's readers and a browser.

mod browser;
#[path = "../common/program.rs"]
mod program;
mod python;
