//! The scaled-down block of atoms: potential, block, rigid rough indenter, the LAMMPS run and its frames.

pub mod audit;
pub mod modulus;
pub mod potential;
pub mod properties;
pub mod wall;
