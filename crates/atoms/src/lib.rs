#![doc = include_str!("../README.md")]

pub mod audit;
pub mod block;
pub mod centro_symmetry;
pub mod compliant_wall;
pub mod contact;
pub mod cost;
pub mod crystal;
pub mod damage;
mod data_file;
pub mod dump;
mod elastic_base;
pub mod engine;
pub mod external_dump;
pub mod force_constants;
pub mod forces;
mod host_relaxation;
pub mod indenter;
pub mod initial_configuration;
pub mod interaction;
pub mod job;
mod job_files;
pub mod job_spec;
pub mod lammps_command;
pub mod lammps_host;
#[allow(unsafe_code, reason = "the library of LAMMPS is called")]
pub mod lammps_library;
pub mod load_history;
pub mod minimizer_checkpoint;
pub mod nvt;
pub mod own_run;
pub mod planar_cells;
pub mod potential;
pub mod progress;
pub mod properties;
mod relaxation;
pub mod repulsion;
pub mod results;
pub mod run_script;
pub mod scripts;
pub mod search_path;
pub mod speed;
mod styles;
pub mod unloading;
pub mod voronoi;
pub mod wall;

pub use asperity_grid::{Error, Result};
