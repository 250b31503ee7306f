//! Stages of a run. The plan lists them, and the run executes them.

use super::Listener;
use super::folder::{RunFolder, StageKey};
use crate::Result;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A stage as listed in a plan: name, description, memory (bytes) and time (s).
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PlannedStage {
    pub name: String,
    pub what: String,
    pub bytes: u64,
    pub seconds: f64,
}

/// Estimated memory (bytes) and time (s) of a stage, to an order of magnitude.
#[derive(Debug, Clone, Copy)]
pub(super) struct EstimatedCost {
    pub bytes: u64,
    pub seconds: f64,
}

/// Machine parameters of the time estimates.
#[derive(Debug, Clone, Copy)]
pub(super) struct MachineSpeed {
    pub threads: usize,
    /// CPU time of LAMMPS, s per atom and force evaluation.
    pub seconds_per_evaluation: f64,
}

/// Keys of a stage.
pub(super) struct StageKeys {
    /// Key of the results.
    pub key: StageKey,
    /// Key of interrupted attempts that the stage can continue; None if it always restarts. It may depend on fewer
    /// inputs than `key`.
    pub resumes: Option<StageKey>,
}

impl StageKeys {
    /// Keys of a stage that restarts after an interruption.
    pub(super) fn restarted(key: StageKey) -> Self {
        StageKeys { key, resumes: None }
    }

    /// Keys of a stage that continues an interrupted attempt with the same key.
    pub(super) fn continued(key: StageKey) -> Self {
        StageKeys { resumes: Some(key.clone()), key }
    }
}

/// Working folder, key and listener of a stage.
#[derive(Clone, Copy)]
pub(super) struct StageContext<'a> {
    pub folder: &'a Path,
    /// Path of the folder relative to the run folder, as in `results.json`.
    pub stage: &'a str,
    pub key: &'a StageKey,
    pub listener: &'a dyn Listener,
}

/// One stage of a run, with its own subfolder, identified by a key.
pub(super) trait Stage {
    /// Output of earlier stages.
    type Input<'i>;
    type Output: Serialize + DeserializeOwned;

    /// Name of the stage and of its folder.
    fn name(&self) -> String;

    /// Description for the plan and for progress messages.
    fn what(&self) -> String;

    fn cost(&self, machine: MachineSpeed) -> EstimatedCost;

    /// `after`: keys of the stages that it depends on.
    fn keys(&self, after: &[&StageKey]) -> Result<StageKeys>;

    fn run(&self, input: Self::Input<'_>, context: &StageContext) -> Result<Self::Output>;

    fn plan(&self, machine: MachineSpeed) -> PlannedStage {
        let EstimatedCost { bytes, seconds } = self.cost(machine);
        PlannedStage { name: self.name(), what: self.what(), bytes, seconds }
    }
}

impl RunFolder {
    /// Runs a stage, or reads its output if it is complete. Returns the output and the key.
    pub(super) fn execute<S: Stage>(
        &mut self,
        stage: &S,
        after: &[&StageKey],
        input: S::Input<'_>,
        listener: &dyn Listener,
    ) -> Result<(S::Output, StageKey)> {
        let (name, StageKeys { key, resumes }) = (stage.name(), stage.keys(after)?);
        let output = self.stage(listener, (&name, &stage.what()), &key, resumes.as_ref(), |folder| {
            stage.run(input, &StageContext { folder, stage: &name, key: &key, listener })
        })?;
        Ok((output, key))
    }
}
