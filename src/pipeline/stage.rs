//! A stage of a run, described once: the plan lists it, the run executes it.

use super::Listener;
use super::folder::{Key, ResumePolicy, RunFolder};
use crate::Result;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What a stage is called, what it does and what it takes.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PlannedStage {
    pub name: String,
    pub what: String,
    pub bytes: u64,
    pub seconds: f64,
}

/// Memory and time of a stage, orders of magnitude.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cost {
    pub bytes: u64,
    pub seconds: f64,
}

/// What the times of a plan depend on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Machine {
    pub threads: usize,
    /// Processor time of LAMMPS, s per atom and force evaluation.
    pub seconds_per_evaluation: f64,
}

/// Keys of a stage.
pub(super) struct StageKeys {
    /// Of its results.
    pub key: Key,
    /// Of attempts that it continues, where it can continue any: it may depend on less than the results do.
    pub resumes: Option<Key>,
}

impl StageKeys {
    /// Of a stage that starts anew after an interruption.
    pub fn restarted(key: Key) -> Self {
        StageKeys { key, resumes: None }
    }

    /// Of a stage that continues an interrupted attempt at the same key.
    pub fn continued(key: Key) -> Self {
        StageKeys { resumes: Some(key.clone()), key }
    }
}

/// Where a stage works.
#[derive(Clone, Copy)]
pub(super) struct StageContext<'a> {
    pub folder: &'a Path,
    /// Name of the folder as results name it, relative to the run folder.
    pub stage: &'a str,
    pub key: &'a Key,
    pub listener: &'a dyn Listener,
}

/// One stage of a run: a folder of the run folder, known by its key.
pub(super) trait Stage {
    /// What earlier stages provide.
    type Input<'i>;
    type Output: Serialize + DeserializeOwned;

    /// Name of the stage and of its folder.
    fn name(&self) -> String;

    /// What it does, for the plan and for progress.
    fn what(&self) -> String;

    fn cost(&self, machine: Machine) -> Cost;

    /// `after`: keys of the stages that it depends on.
    fn keys(&self, after: &[&Key]) -> Result<StageKeys>;

    fn run(&self, input: Self::Input<'_>, at: &StageContext) -> Result<Self::Output>;

    fn plan(&self, machine: Machine) -> PlannedStage {
        let Cost { bytes, seconds } = self.cost(machine);
        PlannedStage { name: self.name(), what: self.what(), bytes, seconds }
    }
}

impl RunFolder {
    /// Runs a stage, or reads its output where it is complete. Returns its key, too.
    pub(super) fn execute<S: Stage>(
        &mut self,
        stage: &S,
        after: &[&Key],
        input: S::Input<'_>,
        listener: &dyn Listener,
    ) -> Result<(S::Output, Key)> {
        let (name, StageKeys { key, resumes }) = (stage.name(), stage.keys(after)?);
        let policy = resumes.as_ref().map_or(ResumePolicy::Restart, ResumePolicy::ContinueFrom);
        let output = self.stage(listener, (&name, &stage.what()), &key, policy, |folder| {
            stage.run(input, &StageContext { folder, stage: &name, key: &key, listener })
        })?;
        Ok((output, key))
    }
}
