//! Results in other programs: Python readers and a browser.

mod browser;
#[path = "../common/lammps.rs"]
mod lammps;
#[path = "../common/program.rs"]
mod program;
mod python;
#[path = "../common/tools.rs"]
mod tools;
