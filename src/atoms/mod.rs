//! The scaled-down block of atoms: potential, block, rigid rough indenter, the LAMMPS run and its frames.

pub mod audit;
pub mod block;
pub mod centro_symmetry;
pub mod compliant_wall;
pub mod contact;
pub mod cost;
pub mod dump;
pub mod engine;
pub mod external_dump;
pub mod forces;
pub mod indenter;
pub mod initial_configuration;
pub mod job;
pub mod load_history;
pub mod minimizer_checkpoint;
pub mod nvt;
pub mod potential;
pub mod properties;
pub mod replay;
pub mod speed;
mod styles;
pub mod unloading;
pub mod voronoi;
pub mod wall;
