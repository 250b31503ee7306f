//! A rough surface from a profile to atoms and back.
//!
//! The crate answers one question: *given this rough surface, this load and this adhesion, what touches, and how much
//! accuracy is lost by asking a cheaper method, or atoms?*
//!
//! Data flows one way, and imports run downwards only:
//!
//! ```text
//! cli → pipeline → report → compare → path → observe → scene → method → atoms, interface, surface → grid, record, load, units, sys
//! ```
//!
//! * [`scene`]: a TOML file and flags become a checked, hashed, plain description.
//! * [`surface`]: spectra, synthesis keyed by wave vector, statistics.
//! * [`interface`]: elastic kernels, adhesion laws, walls.
//! * [`method`]: the contact solvers behind one trait; they see a `Problem`, never a scene.
//! * [`atoms`]: potential, block, indenter, the LAMMPS run, its frames.
//! * [`path`]: loads one after another, with errors, checkpoints and pull-off.
//! * [`observe`] and [`compare`]: what a state says, and what two states say about each other.
//! * [`record`]: files that others read. [`report`]: pictures and pages for people.
//! * [`pipeline`]: stages, their cache and the run folder.

pub mod atoms;
pub mod challenge;
pub mod cli;
pub mod compare;
pub mod error;
pub mod grid;
pub mod interface;
pub mod load;
pub mod method;
pub mod observe;
pub mod path;
pub mod pipeline;
pub mod record;
pub mod report;
pub mod scene;
pub mod surface;
pub mod sys;
pub mod units;

pub use error::{Error, Result};
