//! Results in other programs: Python readers.

#[path = "../common/lammps.rs"]
mod lammps;
#[path = "../common/program.rs"]
mod program;
mod python;
#[path = "../common/tools.rs"]
mod tools;
