//! The commands of Slurm.

use super::submission::is_number;
use asperity_grid::error::{Error, Result};
use asperity_grid::sys::group;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// Limits of a command of Slurm, which answers in milliseconds unless its controller is busy.
const LIMIT: Duration = Duration::from_secs(60);
const MOST_BYTES: u64 = 64 << 20;

/// Said of a command that failed without a message.
const NO_REASON: &str = "no reason given";

/// State of a task in the queue, as squeue names it: `RUNNING`, `PENDING` and so on, with the reason of waiting.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct QueueState {
    pub task: usize,
    pub state: String,
    pub reason: String,
}

/// Slurm of this machine.
#[derive(Debug, Clone, Copy)]
pub struct Slurm;

impl Slurm {
    /// Submits the script in the folder `from`, which becomes the working folder of the job; after the end of the job `after`, however
    /// it ends. Returns the number of the job. An sbatch that failed may have submitted it: a job of this name in this folder counts.
    ///
    /// # Errors
    /// `MissingProgram` without sbatch; `Cluster` with the words of sbatch; `Input` for a folder whose path Slurm changes.
    pub fn submit(self, script: &Path, from: &Path, name: &str, after: Option<&str>) -> Result<String> {
        let path = from.display().to_string();
        if path.contains(['%', '\\', '\n']) {
            let accepted = "a path without %, \\ and line breaks, which Slurm replaces in the names of logs";
            return Err(Error::input("command line", "--out", format!("{path:?}"), accepted));
        }
        match self.submit_once(script, from, after) {
            Err(e @ Error::Cluster { .. }) => self.find(name, from).ok().flatten().ok_or(e),
            other => other,
        }
    }

    fn submit_once(self, script: &Path, from: &Path, after: Option<&str>) -> Result<String> {
        let mut command = Command::new("sbatch");
        command.arg("--parsable").arg("--chdir").arg(from);
        if let Some(job) = after {
            command.arg(format!("--dependency=afterany:{job}"));
        }
        command.arg(script);
        let text = call(command).map_err(|e| match e {
            Error::Cluster { program, said } => {
                let said = format!("{said} (options of the machine: sbatch, time, cpus, memory_mb in machines.toml)");
                Error::Cluster { program, said }
            }
            other => other,
        })?;
        // On a federation the name of the cluster follows.
        let job = text.trim().split(';').next().unwrap_or_default();
        if is_number(job) {
            return Ok(job.to_string());
        }
        Err(Error::Cluster { program: "sbatch".into(), said: format!("printed {job:?} in place of a job number") })
    }

    /// The job of this user with this name and working folder that waits or runs.
    ///
    /// # Errors
    /// As [`Slurm::submit`].
    pub fn find(self, name: &str, folder: &Path) -> Result<Option<String>> {
        let mut command = Command::new("squeue");
        command.args(["--me", "--noheader", "--format=%F|%Z", "--name", name]);
        let text = call(command)?;
        let mut jobs = text.lines().filter_map(|line| line.trim().split_once('|'));
        let found = jobs.find(|(job, place)| is_number(job) && is_same_place(Path::new(place), folder));
        Ok(found.map(|(job, _)| job.to_string()))
    }

    /// Name and working folder of a job that waits or runs; `None` without such a job, or without an answer.
    pub fn place_of(self, job: &str) -> Option<(String, String)> {
        let mut command = Command::new("squeue");
        command.args(["--noheader", "--format=%j|%Z", "--jobs", job]);
        let text = call(command).ok()?;
        text.lines().find_map(|line| line.trim().split_once('|')).map(|(name, place)| (name.into(), place.into()))
    }

    /// The tasks of an array that wait or run.
    ///
    /// # Errors
    /// As [`Slurm::submit`]. A job that Slurm has forgotten has no tasks.
    pub fn tasks(self, job: &str) -> Result<Vec<QueueState>> {
        let mut command = Command::new("squeue");
        command.args(["--noheader", "--array", "--format=%F %K %T %r", "--jobs", job]);
        match call(command) {
            Err(Error::Cluster { said, .. }) if said.contains("Invalid job id") => Ok(Vec::new()),
            text => Ok(text?.lines().filter_map(parse).collect()),
        }
    }

    /// Cancels a job of this user with this name; one that has ended is left, as is another one that has its number.
    ///
    /// # Errors
    /// As [`Slurm::submit`].
    pub fn cancel(self, job: &str, name: &str) -> Result<()> {
        let mut command = Command::new("scancel");
        command.args(["--quiet", "--me", "--name", name, job]);
        match call(command) {
            // Where no job matches, it fails without a word.
            Err(Error::Cluster { said, .. }) if said.contains("Invalid job id") || said == NO_REASON => Ok(()),
            other => other.map(|_| ()),
        }
    }

    /// Puts the task in which this process runs back into the queue.
    ///
    /// # Errors
    /// As [`Slurm::submit`].
    pub fn requeue(self, job: &str, task: usize) -> Result<()> {
        let mut command = Command::new("scontrol");
        command.args(["requeue", &format!("{job}_{task}")]);
        call(command).map(|_| ())
    }
}

/// Whether two paths lead to one folder.
pub fn is_same_place(one: &Path, other: &Path) -> bool {
    let found = |path: &Path| std::fs::canonicalize(path).ok();
    one == other || found(one).is_some_and(|place| Some(place) == found(other))
}

/// A line `JOB TASK STATE REASON`; a single job has `N/A` for its task.
fn parse(line: &str) -> Option<QueueState> {
    let mut tokens = line.split_whitespace();
    let (_, task, state) = (tokens.next()?, tokens.next()?, tokens.next()?);
    let task = if task == "N/A" { 0 } else { task.parse().ok()? };
    Some(QueueState { task, state: state.into(), reason: tokens.collect::<Vec<_>>().join(" ") })
}

fn call(command: Command) -> Result<String> {
    let program = command.get_program().to_string_lossy().into_owned();
    let failed = |message: String| Error::Cluster { program: program.clone(), said: message };
    let printed = group::probe(command, Some(LIMIT), MOST_BYTES).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => Error::MissingProgram {
            program: program.clone(),
            how: "run this on a machine where Slurm's commands are installed".into(),
        },
        _ => failed(e.to_string()),
    })?;
    if printed.status.success() {
        return Ok(String::from_utf8_lossy(&printed.stdout).into_owned());
    }
    Err(failed(printed.complaint().unwrap_or_else(|| NO_REASON.into())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_squeue_are_parsed() {
        let waiting = parse("17 3 PENDING JobArrayTaskLimit").expect("a task");
        assert_eq!(
            (waiting.task, waiting.state.as_str(), waiting.reason.as_str()),
            (3, "PENDING", "JobArrayTaskLimit")
        );
        assert_eq!(parse("18 N/A RUNNING None").expect("a job").task, 0);
        assert_eq!(parse("slurm_load_jobs error"), None);
    }
}
