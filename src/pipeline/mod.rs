//! A run executes its stages in a fixed order, in one folder. The key of a stage is a hash of its inputs.
//!
//! A stage is reused if its folder has the same key. The same command therefore continues an interrupted run, and a
//! changed scene recomputes only the stages that depend on the change.

mod accuracy;
mod atom_stages;
mod atomistic;
mod budget;
mod comparison;
mod continuum;
mod findings;
mod folder;
mod frame_analysis;
mod initial_states;
mod laboratory;
mod matched;
mod methods;
mod nvt;
mod observed;
mod plan;
mod probe_atoms;
mod progress;
mod run;
mod run_files;
mod stage;
mod surface;
mod tradeoff;
mod unloading;
mod versions;

pub use accuracy::{Unserved, advise, read_tables, resolve_accuracy};
pub use atomistic::{LammpsOutcome, build_job, engine, read_atoms, read_frames, run_lammps, speed};
pub use continuum::start;
pub use folder::{Key, RunFolder};
pub use methods::state_of;
pub use plan::{RunPlan, plan};
pub use progress::Progress;
pub use run::{rebuild_comparison, run};
pub use stage::PlannedStage;
pub use surface::statistics;
use tradeoff::adhesion_words;
pub use tradeoff::{TradeoffRequest, Verification, shortest_wavelength, tradeoff, verify};

use crate::record::results::StageCost;

/// Receives the progress of a run, and can request a stop. The listener formats the output.
pub trait Listener: Sync {
    fn begin(&self, stage: &str, what: &str);

    /// `done` is the completed fraction of the stage, where it is known.
    fn progress(&self, done: Option<f64>, message: &str);

    fn end(&self, cost: &StageCost);

    fn warn(&self, text: &str);

    /// Whether the user has requested a stop.
    fn stopping(&self) -> bool;
}

/// A listener without output, which never requests a stop.
pub struct Silent;

impl Listener for Silent {
    fn begin(&self, _: &str, _: &str) {}
    fn progress(&self, _: Option<f64>, _: &str) {}
    fn end(&self, _: &StageCost) {}
    fn warn(&self, _: &str) {}
    fn stopping(&self) -> bool {
        false
    }
}
