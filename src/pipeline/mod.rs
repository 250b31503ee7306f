//! A run executes its stages in a fixed order, in one folder. The key of a stage is a hash of its inputs.
//!
//! A stage is reused if its folder has the same key. The same command therefore continues an interrupted run, and a
//! changed scene recomputes only the stages that depend on the change.

mod atom_stages;
mod atomistic;
pub mod checkpoint;
mod comparison;
mod contact_loads;
mod continuum;
mod crystals;
mod curve;
mod findings;
mod folder;
mod frame_analysis;
mod given_loads;
mod initial_states;
mod laboratory;
mod listener;
mod matched;
mod methods;
mod nvt;
mod own_continuum;
mod own_frame;
mod own_run;
mod plan;
mod probe_atoms;
mod progress;
mod repetition;
pub mod ro_crate;
mod run;
mod run_files;
mod sources;
mod stage;
mod stages;
mod surface;
pub mod sweep;
mod tradeoff;
mod unloading;
mod versions;

pub use atomistic::{LammpsOutcome, LammpsSpeed, build_job, engine, read_atoms, read_frames, run_lammps, speed};
pub use contact_loads::impose_contact;
pub use continuum::start;
pub use crystals::{Crystals, Said, keep_crystal};
pub use folder::{OutFolder, RunFolder, StageKey};
pub use listener::{Listener, Silent};
pub use own_frame::{OwnLoad, OwnRun};
pub use own_run::{OwnMatch, OwnState, read_own_run};
pub use plan::{RunPlan, plan};
pub use progress::ProgressReporter;
pub use repetition::{FinishedRun, Repetition};
pub use run::{expect_scene, rebuild_comparison, redraw, run};
pub use stage::PlannedStage;
pub use surface::{correlation_statistics, statistics};
pub use tradeoff::{TradeoffRequest, tradeoff, tradeoff_plan};
