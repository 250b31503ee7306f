//! Results in other programs: Python readers and a browser.

mod browser;
#[path = "../common/program.rs"]
mod program;
mod python;
