//! The scaled-down block of atoms: potential, block, rigid rough indenter, the LAMMPS run and its frames.

pub mod audit;
pub mod block;
pub mod contact;
pub mod cost;
pub mod dump;
pub mod engine;
pub mod forces;
pub mod foreign;
pub mod giving;
pub mod hold;
pub mod indenter;
pub mod job;
pub mod ladder;
pub mod midway;
pub mod order;
pub mod potential;
pub mod properties;
pub mod replay;
pub mod speed;
pub mod start;
mod styles;
pub mod unload;
pub mod voronoi;
pub mod wall;
