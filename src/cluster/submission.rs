//! What was submitted, and how its points ended: files in `slurm/` of the folder of a sweep, or of a command.

use super::machine::Machine;
use crate::pipeline::sweep::PointFolder;
use crate::record::written::WrittenFolder;
use crate::record::{results, written};
use asperity_grid::error::{Error, Result};
use asperity_surface::files::atomic_file::{append, list, read_text, remove};
use asperity_surface::files::hashed::{self, Stored};
use asperity_surface::files::inside::expect_plain_in;
use asperity_surface::files::json;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Folder of the files of the cluster in that of the sweep.
pub const FOLDER: &str = "slurm";

const FILE: &str = "submission.json";
const SCHEMA: u32 = 1;

/// What is accepted in place of a damaged submission, and the remedy.
const AS_SUBMITTED: &str =
    "a file as the submission wrote it; the command that submitted writes it again, and `squeue --me` shows its jobs";

/// Exit code of a point whose result is not as it was written.
const DAMAGED: u8 = 2;

/// Whether a text is the number of a job, as sbatch prints it.
pub(super) fn is_number(job: &str) -> bool {
    !job.is_empty() && job.len() <= 20 && job.bytes().all(|b| b.is_ascii_digit())
}

/// One command of asperity, submitted instead of the points of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SubmittedCommand {
    /// Its working folder.
    pub folder: PathBuf,
    /// Without the program, and without what belongs to the machine.
    pub arguments: Vec<String>,
    /// Name of the file that it leaves when it is done.
    pub results: String,
}

impl SubmittedCommand {
    /// Whether it continues a stage that was interrupted. Each setting of a trade-off begins anew: its time counts.
    pub fn continues_stages(&self) -> bool {
        self.arguments.first().is_none_or(|command| command != "tradeoff")
    }
}

/// A submitted sweep, or a command with one point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Submission {
    pub schema: u32,
    pub name: String,
    /// The varied keys, the slowest first.
    pub keys: Vec<String>,
    pub machine_name: String,
    pub machine: Machine,
    /// Flags of `asperity run` for every point.
    pub flags: Vec<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command: Option<SubmittedCommand>,
    pub points: Vec<SubmittedPoint>,
    /// Points of each task of the array, by index.
    pub tasks: Vec<Vec<usize>>,
    /// Number of the array, and of the job that collects the results; `None` if every point was done.
    pub job: Option<String>,
    pub collect_job: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SubmittedPoint {
    pub label: String,
    pub values: Vec<serde_json::Value>,
    /// BLAKE3 hash of its scene.
    pub scene: String,
    /// Planned time, an order of magnitude, s.
    pub seconds: f64,
}

/// How a turn left a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TurnOutcome {
    Done,
    Failed,
    Interrupted,
}

/// How the last turn left a point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EndedPoint {
    /// Hash of the scene that was run.
    pub scene: String,
    pub outcome: TurnOutcome,
    /// Exit code of its run.
    pub code: u8,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

impl Submission {
    pub fn new(name: &str, keys: &[String], machine: (String, Machine), flags: Vec<String>) -> Submission {
        let (machine_name, machine) = machine;
        Submission {
            schema: SCHEMA,
            name: name.into(),
            keys: keys.to_vec(),
            machine_name,
            machine,
            flags,
            command: None,
            points: Vec::new(),
            tasks: Vec::new(),
            job: None,
            collect_job: None,
        }
    }

    /// # Errors
    /// `Input` without the file; `Format` for another schema, damage, what no submission writes, and a link in the folder.
    pub fn read(out: &Path) -> Result<Submission> {
        if !Submission::exists(out) {
            let accepted =
                "the folder of a sweep or command that was submitted to a cluster; others have their results in them";
            return Err(Error::input("command line", "FOLDER", out.display(), accepted));
        }
        expect_plain_in(out, &[FOLDER, "logs", "scenes"])?;
        expect_plain_in(&out.join("points"), &[])?;
        let file = out.join(FOLDER).join(FILE);
        let refused = |found: String| Error::format(&file, found, AS_SUBMITTED);
        let read = match hashed::read::<Submission>(&file, true) {
            Stored::Valid(read) if read.schema == SCHEMA => read,
            Stored::Valid(read) => return Err(refused(format!("schema {}", read.schema))),
            Stored::Damaged(what) => return Err(refused(what)),
            Stored::Absent => return Err(refused("another form, or no hash of its own".into())),
        };
        match read.fault() {
            Some(found) => Err(refused(found)),
            None => Ok(read),
        }
    }

    /// What no submission holds, in words: these values become paths, jobs that are cancelled, and indices.
    fn fault(&self) -> Option<String> {
        let a_name = |name: &str| {
            !name.is_empty()
                && !name.starts_with('.')
                && !name.contains(['/', '\\'])
                && !name.chars().any(char::is_control)
        };
        let results = self.command.iter().map(|c| c.results.as_str());
        let mut names = self.points.iter().map(|p| p.label.as_str()).chain(results);
        let mut jobs = [&self.job, &self.collect_job].into_iter().flatten();
        let mut points = self.tasks.iter().flatten();
        None.or_else(|| names.find(|name| !a_name(name)).map(|name| format!("the name {name:?}")))
            .or_else(|| jobs.find(|job| !is_number(job)).map(|job| format!("the job {job:?}")))
            .or_else(|| {
                points.find(|&&i| i >= self.points.len()).map(|i| format!("point {i} of {}", self.points.len()))
            })
    }

    /// Whether the folder has one.
    pub fn exists(out: &Path) -> bool {
        out.join(FOLDER).join(FILE).exists()
    }

    /// # Errors
    /// `Io`.
    pub fn write(&self, out: &Path) -> Result<()> {
        hashed::write(&out.join(FOLDER).join(FILE), self, &[])
    }

    /// Folder and log of a point.
    pub fn place(&self, out: &Path, point: &SubmittedPoint) -> (PathBuf, PathBuf) {
        match &self.command {
            Some(_) => (out.to_path_buf(), out.join(FOLDER).join(format!("{}.log", point.label))),
            None => {
                let folder = PointFolder::of(out, &point.label);
                (folder.out, folder.log)
            }
        }
    }

    /// How the last turn left a point; `None` for another scene, or a result that is gone. A result that is not as the turn wrote it
    /// counts as failed.
    pub fn end_of(&self, out: &Path, point: &SubmittedPoint) -> Option<EndedPoint> {
        let end: EndedPoint =
            json::read(&end_file(out, &point.label)).ok().filter(|e: &EndedPoint| e.scene == point.scene)?;
        if end.outcome != TurnOutcome::Done {
            return Some(end);
        }
        let file = self.command.as_ref().map_or(results::FILE, |c| &c.results);
        let folder = self.place(out, point).0;
        if !folder.join(file).exists() {
            return None;
        }
        let damage = written::damage_of(&folder, file).map(|what| format!("{what}; the same command submits it again"));
        Some(match damage {
            Some(reason) => EndedPoint { outcome: TurnOutcome::Failed, code: DAMAGED, reason: Some(reason), ..end },
            None => end,
        })
    }

    /// What of results, fields and other files of the stages of a point is not as its run wrote it, in words. All are read.
    pub fn damage_of(&self, out: &Path, point: &SubmittedPoint) -> Option<String> {
        let verified = WrittenFolder::run(&self.place(out, point).0).and_then(|(folder, _)| folder.verify());
        verified.err().map(|e| e.to_string())
    }

    /// Points that are not done.
    pub fn missing<'a>(&'a self, out: &Path, points: &[usize]) -> Vec<&'a SubmittedPoint> {
        let point_at = |&i: &usize| &self.points[i];
        let is_done = |p: &&SubmittedPoint| self.end_of(out, p).is_some_and(|end| end.outcome == TurnOutcome::Done);
        points.iter().map(point_at).filter(|p| !is_done(p)).collect()
    }

    /// Task of each point; `None` for points that were done before.
    pub fn task_of(&self) -> Vec<Option<usize>> {
        let mut tasks = vec![None; self.points.len()];
        for (task, points) in self.tasks.iter().enumerate() {
            points.iter().for_each(|&i| tasks[i] = Some(task));
        }
        tasks
    }

    /// Points of a task that run at once: each has the ranks of LAMMPS.
    pub fn at_once(machine: &Machine, points: usize) -> usize {
        (machine.cpus / machine.lammps.ranks.unwrap_or(1).max(1)).clamp(1, points.max(1))
    }
}

/// Puts points (their planned seconds) into tasks, in their order.
pub fn pack(seconds: &[(usize, f64)], machine: &Machine) -> Vec<Vec<usize>> {
    let limit = 60.0 * machine.pack_minutes * Submission::at_once(machine, usize::MAX) as f64;
    let total: f64 = seconds.iter().map(|s| s.1).sum();
    let largest = machine.most_tasks.max(1);
    // A task that exceeds the limit holds one point more than fits, so that twice the mean load suffices.
    let limit = if seconds.len() > largest { limit.max(2.0 * total / largest as f64) } else { limit };
    let at_least = seconds.len().div_ceil(largest);
    let mut tasks: Vec<(f64, Vec<usize>)> = Vec::new();
    for &(point, s) in seconds {
        match tasks.last_mut() {
            Some((sum, points)) if *sum + s <= limit || points.len() < at_least => {
                *sum += s;
                points.push(point);
            }
            _ => tasks.push((s, vec![point])),
        }
    }
    tasks.into_iter().map(|t| t.1).collect()
}

fn end_file(out: &Path, label: &str) -> PathBuf {
    out.join(FOLDER).join("points").join(format!("{label}.json"))
}

/// Removes how earlier turns left a point, before it is submitted again.
///
/// # Errors
/// `Io`.
pub fn forget_end(out: &Path, label: &str) -> Result<()> {
    remove(&end_file(out, label))
}

/// # Errors
/// `Io`.
pub fn record_end(out: &Path, label: &str, end: &EndedPoint) -> Result<()> {
    json::write(&end_file(out, label), end)
}

/// Folder with a table of turns for each task.
pub const TURNS: &str = "turns";

/// A turn of a task.
#[derive(Debug, Clone, PartialEq)]
pub struct Turn {
    pub node: String,
    pub seconds: f64,
    pub outcome: &'static str,
}

impl Turn {
    /// Appends the turn to the table of its task, which no other process writes.
    ///
    /// # Errors
    /// `Io`.
    pub fn append(&self, out: &Path, task: usize) -> Result<()> {
        let file = out.join(FOLDER).join(TURNS).join(format!("{task}.csv"));
        append(&file, format!("{},{:.1},{}\n", self.node, self.seconds, self.outcome))
    }

    /// Seconds of all turns of all tasks.
    pub fn total_seconds(out: &Path) -> f64 {
        let Ok(tables) = list(&out.join(FOLDER).join(TURNS)) else { return 0.0 };
        let tables = tables.iter().filter_map(|(_, file)| read_text(file).ok());
        let seconds_in = |table: String| {
            table
                .lines()
                .filter_map(|l| l.split(',').nth(1)?.parse::<f64>().ok())
                .filter(|s| s.is_finite())
                .sum::<f64>()
        };
        tables.map(seconds_in).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sizes(points: usize, seconds: f64, machine: &Machine) -> Vec<usize> {
        let list: Vec<(usize, f64)> = (0..points).map(|i| (i, seconds)).collect();
        let tasks = pack(&list, machine);
        assert_eq!(tasks.concat(), (0..points).collect::<Vec<_>>());
        tasks.iter().map(Vec::len).collect()
    }

    #[test]
    fn short_points_share_a_task() {
        let machine = Machine { pack_minutes: 1.0, ..Machine::default() };
        assert_eq!(sizes(7, 20.0, &machine), [3, 3, 1]);
        assert_eq!(sizes(2, 1e6, &machine), [1, 1]);
        // Four points run at once.
        assert_eq!(sizes(12, 20.0, &Machine { cpus: 4, ..machine.clone() }), [12]);
        assert_eq!(sizes(3, 20.0, &Machine { pack_minutes: 0.0, ..machine }), [1, 1, 1]);
    }

    #[test]
    fn an_array_has_no_more_tasks_than_slurm_takes() {
        let machine = Machine { pack_minutes: 0.0, most_tasks: 10, ..Machine::default() };
        for points in [9, 10, 11, 95, 1000] {
            for seconds in [0.0, 1.0, 1e5] {
                assert!(sizes(points, seconds, &machine).len() <= 10, "{points} points of {seconds} s");
            }
        }
        // One long point and many short ones.
        let list: Vec<(usize, f64)> = (0..100).map(|i| (i, if i == 50 { 1e6 } else { 1.0 })).collect();
        assert!(pack(&list, &machine).len() <= 10);
    }
}
