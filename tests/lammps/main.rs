//! Blocks of atoms in the real LAMMPS.

mod by_hand;
mod elastic_base;
mod failures;
mod foundation;
mod harmonic;
mod initial_states;
mod jobs;
#[path = "../common/lammps.rs"]
mod lammps;
mod load_steps;
mod modulus;
mod nvt;
#[path = "../common/pair_crystal.rs"]
mod pair_crystal;
mod potential;
mod repulsion;
#[path = "../common/similar_crystal.rs"]
mod similar_crystal;
mod table;
#[path = "../common/tools.rs"]
mod tools;
mod unloading;
