//! A rough surface from a profile to atoms and back.
//!
//! The crate answers one question: *given a rough surface, a load and adhesion, where are the surfaces in contact, and how much
//! accuracy does a cheaper method, or an atomistic model, lose?*
//!
//! Data flows one way, and imports run downwards only:
//!
//! ```text
//! cli → pipeline → report → challenge → compare → path → scene → method → atoms → interface, surface → record → observe → grid → load, units, sys, error
//! ```
//!
//! * [`scene`]: a TOML file and flags, checked and resolved into one [`Case`](scene::Case).
//! * [`surface`]: power spectra, realisations that depend on the seed alone, statistics.
//! * [`interface`]: elastic kernels, adhesion laws, walls.
//! * [`method`]: the contact solvers and estimates behind one trait. They read a `Problem`, never a scene.
//! * [`atoms`]: potential, block, indenter, the LAMMPS run and its dump frames.
//! * [`path`]: a sequence of loads, with error estimates, checkpoints and pull-off.
//! * [`observe`]: contact area, clusters and distributions of one state. [`compare`]: differences between two.
//! * [`challenge`]: the statements of the contact-mechanics challenge, tested against results.
//! * [`record`]: files for other programs. [`report`]: figures and pages for people.
//! * [`pipeline`]: stages, their cache and the run folder. [`cli`]: the commands of the program.
//! * [`grid`], [`load`], [`units`], [`sys`]: fields and transforms, loads, units, the operating system.

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
