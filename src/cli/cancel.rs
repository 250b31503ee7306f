//! Cancels what a submission has in the queue, and nothing else.

use super::cluster::number;
use super::output;
use crate::cluster::{Slurm, Submission, collect_name, is_same_place, job_name};
use crate::{Error, Result};
use std::path::{Path, PathBuf};

/// Cancel the tasks of a sweep or command that wait or run. What is finished is kept.
#[derive(Debug, clap::Args)]
pub(super) struct CancelArgs {
    /// Folder of the sweep or of the command.
    folder: PathBuf,
}

impl CancelArgs {
    pub(super) fn execute(self) -> Result<()> {
        let submission = Submission::read(&self.folder)?;
        // Without an answer of the queue everything may wait.
        let tasks = submission.job.as_deref().map_or(Ok(Vec::new()), |job| Slurm.tasks(job)).ok();
        let name = &submission.name;
        let own = std::path::absolute(&self.folder).map_err(Error::io("find", &self.folder))?;
        let jobs = [(&submission.collect_job, collect_name(name)), (&submission.job, job_name(name))];
        let jobs = || jobs.iter().filter_map(|(job, name)| job.as_ref().map(|job| (job, name)));
        for (job, name) in jobs() {
            // The number may be that of a job of another folder, or of another cluster.
            match Slurm.place_of(job) {
                Some((found, place)) if found != *name || !is_same_place(Path::new(&place), &own) => {
                    let found = format!("{job}, in the queue of this cluster the job {found} in {place}");
                    let accepted = format!("the job {name} in {}; squeue --me and scancel find it", own.display());
                    return Err(Error::input(self.folder.display(), "job", found, accepted));
                }
                _ => {}
            }
        }
        jobs().try_for_each(|(job, name)| Slurm.cancel(job, name))?;
        let folder = self.folder.display();
        output::print(&match &submission.job {
            Some(job) if tasks.as_ref().is_none_or(|t| !t.is_empty()) => {
                let tables = if submission.command.is_none() {
                    format!("; tables of what is done: asperity collect {folder}")
                } else {
                    String::new()
                };
                let tasks = tasks.map_or("the tasks".into(), |t| number(t.len(), "task"));
                format!("cancelled {tasks} of job {job}{tables}")
            }
            _ => "nothing waits or runs".into(),
        });
        Ok(())
    }
}
