//! Blocks of atoms in the real LAMMPS. Without LAMMPS these tests print a warning and pass.

mod failures;
mod foundation;
mod initial_states;
mod jobs;
#[path = "../common/lammps.rs"]
mod lammps;
mod load_steps;
mod modulus;
mod nvt;
mod potential;
mod table;
mod unloading;
