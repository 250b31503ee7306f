//! Sweeps and single commands on a cluster: machines, batch scripts of Slurm, the turns of a task, and their state.

mod machine;
mod queue;
mod script;
mod submission;
mod task;
mod workflow;

pub use machine::{Engine, Machine, find};
pub use queue::{QueueState, Slurm, is_same_place};
pub use script::{Scripts, collect_name, job_name, shell_quoted};
pub use submission::{
    EndedPoint, FOLDER, Submission, SubmittedCommand, SubmittedPoint, TURNS, Turn, TurnOutcome, forget_end, pack,
    record_end,
};
pub use task::progress_of;
pub use workflow::{Workflow, WorkflowInput};
