//! The scaled-down block of atoms: potential, block, rigid rough indenter, the LAMMPS run and its frames.

pub mod block;
pub mod contact;
pub mod dump;
pub mod indenter;
pub mod ladder;
