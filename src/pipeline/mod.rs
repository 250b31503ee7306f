//! A run: stages in their order, each keyed by what it depends on, all in one folder.
//!
//! A stage whose key is found in the folder is not run again, so the same command goes on where a killed one stopped, and
//! a changed scene repeats only what the change touches.

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

/// Hears how a run goes, and may ask it to stop. The words for people are the listener's.
pub trait Listener: Sync {
    fn begin(&self, stage: &str, what: &str);

    /// `done` is the completed fraction of the stage, where it is known.
    fn progress(&self, done: Option<f64>, message: &str);

    fn end(&self, cost: &StageCost);

    fn warn(&self, text: &str);

    /// Whether the user wants the run to stop.
    fn stopping(&self) -> bool;
}

/// Hears nothing, and never stops a run.
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
