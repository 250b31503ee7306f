//! The compiled program, started as a user starts it.

mod accuracy;
mod challenge;
mod cli;
mod extremes;
mod import;
#[path = "../common/lammps.rs"]
mod lammps;
mod library;
mod methods;
mod pipeline;
#[path = "../common/program.rs"]
mod program;
mod quickstart;
mod scenes;
mod solve;
mod tradeoff;
