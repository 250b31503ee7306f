//! The compiled program, started as a user starts it.

mod accuracy;
mod challenge;
mod cli;
mod cluster;
mod declared;
mod extremes;
mod first_minutes;
mod flags;
#[path = "../common/folder.rs"]
mod folder;
#[path = "../../fuzz/mod.rs"]
mod fuzz;
mod import;
mod instrument_files;
#[path = "../common/lammps.rs"]
mod lammps;
mod library;
mod loads;
mod maps;
#[path = "../../benches/measure/commands/mod.rs"]
mod measure;
mod methods;
mod own_run;
mod own_surface;
#[path = "../common/pair_crystal.rs"]
mod pair_crystal;
mod pipeline;
mod plastic;
mod potentials;
mod processors;
mod profiles;
#[path = "../common/program.rs"]
mod program;
mod quickstart;
mod reliability;
mod repulsion;
mod scenes;
#[path = "../common/scratch.rs"]
mod scratch;
#[path = "../common/similar_crystal.rs"]
mod similar_crystal;
mod solve;
mod strangers;
mod sweep;
#[path = "../common/tools.rs"]
mod tools;
mod tradeoff;
mod two_bodies;
mod verify;
mod via_python;
