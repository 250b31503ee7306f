//! An engine that replays a recorded run step by step, for tests.

use std::io::Write;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use super::engine::{Engine, Finished, Progress, Watcher, check_ladder, failed, is_complete};
use super::job::Job;
use super::job_files::lock;
use super::load_history::{self, HEADER, LOAD_STEPS_FILE, LoadHistory};
use crate::error::LammpsFailure;
use crate::{Error, Result};

/// Replays the folder of a finished run (`load_steps.csv`, frames, logs) into a job's folder.
#[derive(Debug, Clone)]
pub struct ReplayEngine {
    pub recording: PathBuf,
    /// Duration of each step.
    pub pace: Duration,
    pub time_limit: Option<Duration>,
    /// Fails instead of finishing this step.
    pub failure: Option<(usize, LammpsFailure)>,
}

impl ReplayEngine {
    pub fn new(recording: impl Into<PathBuf>) -> Self {
        ReplayEngine { recording: recording.into(), pace: Duration::ZERO, time_limit: None, failure: None }
    }

    fn copy(&self, job: &Job, name: &std::ffi::OsStr) -> Result<()> {
        let from = self.recording.join(name);
        std::fs::copy(&from, job.folder.join(name)).map(drop).map_err(Error::io("copy", &from))
    }
}

impl Engine for ReplayEngine {
    fn describe(&self) -> &str {
        "replay of a recorded LAMMPS run"
    }

    fn run(&self, job: &Job, watch: &mut dyn FnMut(Progress) -> ControlFlow<()>) -> Result<Finished> {
        let begun = Instant::now();
        let _lock = lock(&job.folder)?;
        let played = LoadHistory::read(&job.folder)?.last().map(|r| r.step);
        let mut watcher = Watcher::new(job, begun, played);
        if is_complete(job)? {
            return Finished::collect(job, played, begun);
        }
        let recorded = LoadHistory::read(&self.recording)?;
        let source = self.recording.join(LOAD_STEPS_FILE);
        let text = std::fs::read_to_string(&source).map_err(Error::io("read", &source))?;
        let target = job.folder.join(LOAD_STEPS_FILE);
        for (record, line) in
            recorded.steps.iter().zip(text.split_inclusive('\n').skip(1)).skip(played.map_or(0, |k| k + 1))
        {
            std::thread::sleep(self.pace);
            if let Some(limit) = self.time_limit.filter(|limit| begun.elapsed() > *limit) {
                return Err(failed(job, LammpsFailure::TimeLimit { seconds: limit.as_secs_f64() }));
            }
            if let Some((_, failure)) = self.failure.as_ref().filter(|(step, _)| *step == record.step) {
                return Err(failed(job, failure.clone()));
            }
            if let Some(name) = load_history::frame_file(&self.recording, record.step)?.file_name() {
                self.copy(job, name)?;
            }
            let mut out = std::fs::OpenOptions::new()
                .create(true)
                .append(true)
                .open(&target)
                .map_err(Error::io("open", &target))?;
            let header = if record.step == 0 { format!("{HEADER}\n") } else { String::new() };
            out.write_all(format!("{header}{line}").as_bytes()).map_err(Error::io("write", &target))?;
            if watcher.tell(&LoadHistory::read(&job.folder)?, watch).is_break() {
                return Err(Error::Interrupted);
            }
            if job.end(&recorded.steps[..=record.step]).is_some() {
                break;
            }
        }
        if self.recording.join("log.0").is_file() {
            self.copy(job, "log.0".as_ref())?;
        }
        check_ladder(job)?;
        Finished::collect(job, played, begun)
    }
}
