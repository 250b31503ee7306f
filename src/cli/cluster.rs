//! Sweeps and commands on a cluster: submit, one turn of a task, state, collected results, cancel.

use super::machine::own_command;
use super::output;
use super::point::PointCommand;
use super::progress;
use crate::cluster::{
    EndedPoint, FOLDER, Machine, QueueState, Scripts, Slurm, Submission, SubmittedCommand, SubmittedPoint, TURNS, Turn,
    TurnOutcome, collect_name, forget_end, job_name, pack, progress_of, record_end,
};
use crate::pipeline::sweep::{self, PointFolder, Sweep};
use crate::pipeline::{self, RunFolder};
use crate::record::ensemble::PointStatus;
use crate::report::number::{memory, significant};
use crate::scene::Case;
use crate::{Error, Result};
use asperity_grid::sys;
use asperity_surface::files::atomic_file::{create_folder, put};
use serde_json::json;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU8, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Exit code of a turn without progress: a longer turn is needed (`EX_TEMPFAIL` of sysexits.h).
const NO_PROGRESS: u8 = 75;

/// Exit code of a table that lacks points which wait, as of an interrupted sweep.
const INTERRUPTED: u8 = 130;

/// Exit code of points whose tasks ended without a result, as of a missing program: the machine is the cause.
const WITHOUT_END: u8 = 5;

/// Failed points that `status` prints.
const MOST_SHOWN: usize = 20;

/// Shortest time between two looks at the queue.
const WATCH: Duration = Duration::from_secs(10);

/// A sweep that is to be submitted.
pub(super) struct Request<'a> {
    pub sweep: &'a Sweep,
    pub out: &'a Path,
    pub machine: (String, Machine),
    pub flags: Vec<String>,
    pub overwrite: bool,
    /// Without reading fields and stages of finished points.
    pub no_verify: bool,
    pub dry_run: bool,
    pub json: bool,
}

impl Request<'_> {
    /// Submits the points that are not done, or prints what would be submitted.
    pub(super) fn submit(self) -> Result<()> {
        let (sweep, out) = (self.sweep, self.out);
        let program = program_of(&self.machine.1)?;
        let machine = with_ranks(self.machine, sweep.ranks());
        let mut submission = Submission::new(&sweep.name, &sweep.keys, machine, self.flags);
        submission.points = sweep.points.iter().map(submitted).collect();
        let missing: Vec<(usize, f64)> = (submission.points.iter().enumerate())
            .filter(|(_, p)| is_missing(&submission, p, out, self.no_verify))
            .map(|(i, p)| (i, p.seconds))
            .collect();
        submission.tasks = pack(&missing, &submission.machine);
        let largest = submission.tasks.iter().map(Vec::len).max().unwrap_or(1);
        let at_once = Submission::at_once(&submission.machine, largest) as u64;
        let bytes = at_once * sweep.points.iter().map(|p| p.bytes).max().unwrap_or_default();
        let scripts = Scripts::new(&submission.machine, &sweep.name, &program, submission.tasks.len(), bytes);
        if self.dry_run {
            let scripts = [("points.sh", &scripts.points), ("collect.sh", &scripts.collect)];
            return plan(&submission, &missing, &scripts, bytes, self.json);
        }
        let _locked = sweep::open(sweep, out, self.overwrite, &output::warn)?;
        refuse_queued(out, &sweep.name)?;
        create_folders(out)?;
        for &(i, _) in &missing {
            let point = &sweep.points[i];
            forget_end(out, &point.label)?;
            PointFolder::of(out, &point.label).write_scene(&point.scene)?;
        }
        let files =
            [write_script(out, "points.sh", &scripts.points)?, write_script(out, "collect.sh", &scripts.collect)?];
        // Tasks read it as soon as they start.
        submission.write(out)?;
        if !missing.is_empty() {
            let folder = std::path::absolute(out).map_err(Error::io("find", out))?;
            let (of_points, of_tables) = (job_name(&sweep.name), collect_name(&sweep.name));
            let job = Slurm.submit(&files[0], &folder, &of_points, None)?;
            submission.job = Some(job.clone());
            // An interruption from here on leaves a number to cancel.
            submission.write(out)?;
            let collect = Slurm.submit(&files[1], &folder, &of_tables, Some(&job)).inspect_err(|_| {
                // Without the table nobody waits for the points.
                let _ = Slurm.cancel(&job, &of_points);
            })?;
            submission.collect_job = Some(collect);
            submission.write(out)?;
        }
        let finished = submission.points.len() - missing.len();
        if self.json {
            return output::json_line(&json!({
                "out": output::path(out), "points": submission.points.len(), "done": finished, "failed": 0,
                "submitted": missing.len(), "tasks": submission.tasks.len(), "job": submission.job,
            }));
        }
        match &submission.job {
            Some(job) => output::print(&format!(
                "{} in {} of job {job}, {finished} done before; asperity status {} shows their state",
                number(missing.len(), "point"),
                number(submission.tasks.len(), "task"),
                out.display()
            )),
            None => output::print(&format!("all {finished} points are done; asperity collect {}", out.display())),
        }
        Ok(())
    }
}

/// Whether a point is not done, or damaged since, of which it warns.
fn is_missing(submission: &Submission, point: &SubmittedPoint, out: &Path, no_verify: bool) -> bool {
    let done = submission.end_of(out, point).is_some_and(|end| end.outcome == TurnOutcome::Done);
    if !done || no_verify {
        return !done;
    }
    let damage = submission.damage_of(out, point);
    if let Some(what) = &damage {
        output::warn(&format!("{}: {what}", point.label));
    }
    damage.is_some()
}

/// The machine with the ranks of the scene, where it has none of its own: tasks need as many cores.
fn with_ranks((name, mut machine): (String, Machine), ranks: usize) -> (String, Machine) {
    machine.lammps.ranks = machine.lammps.ranks.or((ranks > 1).then_some(ranks));
    (name, machine)
}

/// The program that tasks of the machine run.
pub(super) fn program_of(machine: &Machine) -> Result<PathBuf> {
    match &machine.program {
        Some(program) => Ok(program.clone()),
        None => std::env::current_exe().map_err(Error::io("find", Path::new("asperity"))),
    }
}

fn create_folders(out: &Path) -> Result<()> {
    ["points", TURNS].iter().try_for_each(|folder| create_folder(&out.join(FOLDER).join(folder)))
}

fn write_script(out: &Path, name: &str, text: &str) -> Result<PathBuf> {
    put(&out.join(FOLDER), name, text)
}

/// A command that is to be submitted as a job of its own.
pub(super) struct CommandRequest<'a> {
    /// What it solves, for memory and time.
    pub case: &'a Case,
    pub out: &'a Path,
    pub machine: (String, Machine),
    /// Name of the file that it leaves when it is done.
    pub results: &'a str,
    /// Planned time, s. Default: that of `asperity run`.
    pub seconds: Option<f64>,
    pub dry_run: bool,
    pub json: bool,
}

impl CommandRequest<'_> {
    /// Submits the command, or prints what would be submitted. Finished parts are reused by the command itself.
    pub(super) fn submit(self) -> Result<()> {
        let CommandRequest { case, out, .. } = self;
        let (name, planned) = (&case.scene.name, pipeline::plan(case, self.machine.1.cpus, None)?);
        let (bytes, seconds) = (planned.bytes, self.seconds.unwrap_or(planned.seconds));
        let command = own_command(self.results)?;
        let label = command.arguments.first().cloned().unwrap_or_default();
        let mut submission = Submission::new(name, &[], with_ranks(self.machine, case.ranks()), Vec::new());
        let text = command.arguments.join("\0");
        let scene = blake3::hash(text.as_bytes()).to_hex().to_string();
        submission.points = vec![SubmittedPoint { label: label.clone(), values: Vec::new(), scene, seconds }];
        submission.tasks = vec![vec![0]];
        submission.command = Some(command);
        let script = Scripts::new(&submission.machine, name, &program_of(&submission.machine)?, 1, bytes).points;
        if self.dry_run {
            return plan(&submission, &[(0, seconds)], &[(COMMAND_SCRIPT, &script)], bytes, self.json);
        }
        // Before the lock, which the job holds while it runs.
        refuse_queued(out, name)?;
        // Marks the folder as that of a run, which the job continues.
        drop(RunFolder::open(out)?);
        create_folders(out)?;
        forget_end(out, &label)?;
        let script = write_script(out, COMMAND_SCRIPT, &script)?;
        submission.write(out)?;
        let folder = std::path::absolute(out).map_err(Error::io("find", out))?;
        let job = Slurm.submit(&script, &folder, &job_name(name), None)?;
        submission.job = Some(job.clone());
        submission.write(out)?;
        if self.json {
            return output::json_line(&json!({ "out": output::path(out), "submitted": 1, "tasks": 1, "job": job }));
        }
        output::print(&format!("job {job}; asperity status {} shows its state", out.display()));
        Ok(())
    }
}

const COMMAND_SCRIPT: &str = "command.sh";

/// `1 point`, `2 points`.
pub(super) fn number(n: usize, of: &str) -> String {
    format!("{n} {of}{}", if n == 1 { "" } else { "s" })
}

fn submitted(point: &sweep::SweepPoint) -> SubmittedPoint {
    SubmittedPoint {
        label: point.label.clone(),
        values: sweep::json_values(point),
        scene: blake3::hash(point.scene.as_bytes()).to_hex().to_string(),
        seconds: point.seconds,
    }
}

/// The earlier submission of a folder is replaced; one that is damaged does not know its job, which is then looked for by its name.
///
/// # Errors
/// `Input` while tasks of an earlier submission wait or run.
fn refuse_queued(out: &Path, name: &str) -> Result<()> {
    if !Submission::exists(out) {
        return Ok(());
    }
    let job = match Submission::read(out) {
        Ok(submission) => submission.job,
        Err(e) => {
            output::warn(&format!("{e}; it is written again"));
            let folder = std::path::absolute(out).map_err(Error::io("find", out))?;
            Slurm.find(&job_name(name), &folder)?
        }
    };
    let Some(job) = job else { return Ok(()) };
    match Slurm.tasks(&job)?.len() {
        0 => Ok(()),
        n => {
            let found = format!("{} (job {job} has {n} tasks in the queue)", out.display());
            let accepted = "a folder without tasks in the queue: wait, or asperity cancel it";
            Err(Error::input("command line", "--out", found, accepted))
        }
    }
}

/// Core hours of the planned seconds of points.
fn core_hours(seconds: f64, machine: &Machine) -> f64 {
    seconds * machine.cpus as f64 / Submission::at_once(machine, usize::MAX) as f64 / 3600.0
}

fn plan(
    submission: &Submission,
    missing: &[(usize, f64)],
    scripts: &[(&str, &String)],
    bytes: u64,
    json: bool,
) -> Result<()> {
    let hours = core_hours(missing.iter().map(|m| m.1).sum(), &submission.machine);
    if json {
        return output::json_line(&json!({
            "points": submission.points.len(), "to_submit": missing.len(), "tasks": submission.tasks.len(),
            "bytes_of_largest": bytes, "core_hours": hours,
        }));
    }
    for (name, text) in scripts {
        output::print(&format!("{name}:\n{text}"));
    }
    output::print(&format!(
        "{} of {} in {}, {} each, about {} core hours (an order of magnitude)",
        missing.len(),
        number(submission.points.len(), "point"),
        number(submission.tasks.len(), "task"),
        memory(bytes),
        significant(hours, 2)
    ));
    Ok(())
}

/// One turn of a task. Batch scripts call it.
#[derive(Debug, clap::Args)]
pub(super) struct SlurmTaskArgs {
    /// Folder of the sweep or of the command.
    folder: PathBuf,
    /// Index of the task.
    task: usize,
}

impl SlurmTaskArgs {
    pub(super) fn execute(self) -> Result<ExitCode> {
        sys::note_user_signal();
        progress::compute();
        let out = &self.folder;
        let submission = Submission::read(out)?;
        let Some(points) = submission.tasks.get(self.task) else {
            let accepted = format!("less than {}", submission.tasks.len());
            return Err(Error::input("command line", "TASK", self.task, accepted));
        };
        let started = Instant::now();
        let node = std::env::var("SLURMD_NODENAME").unwrap_or_else(|_| "unknown".into());
        let folders: Vec<PathBuf> = points.iter().map(|&i| submission.place(out, &submission.points[i]).0).collect();
        let continues = submission.command.as_ref().is_none_or(SubmittedCommand::continues_stages);
        let progress = || folders.iter().map(|f| progress_of(f, continues)).fold(0, u64::wrapping_add);
        let previous = progress();
        output::eprint(&format!("{} on {node}", number(points.len(), "point")));
        let (worst, interrupted) = run_points(&submission, points, out)?;
        let outcome = match interrupted {
            0 if worst == 0 => "done",
            0 => "failed",
            _ => "interrupted",
        };
        let turn = Turn { node, seconds: started.elapsed().as_secs_f64(), outcome };
        turn.append(out, self.task)?;
        if interrupted == 0 {
            return Ok(ExitCode::from(worst));
        }
        if !sys::user_signal() {
            return Err(Error::Interrupted);
        }
        if progress() == previous {
            let (seconds, machine) = (started.elapsed().as_secs_f64(), &submission.machine);
            let reason = format!(
                "no progress within a turn of {seconds:.0} s: increase time ({}) of the machine, of which margin_seconds ({}) are not used",
                machine.time, machine.margin_seconds
            );
            for &i in points.iter() {
                let point = &submission.points[i];
                if submission.end_of(out, point).is_some_and(|end| end.outcome == TurnOutcome::Interrupted) {
                    let end = ended(point, TurnOutcome::Failed, NO_PROGRESS, Some(reason.clone()));
                    record_end(out, &point.label, &end)?;
                }
            }
            output::eprint(&reason);
            return Ok(ExitCode::from(NO_PROGRESS));
        }
        let job = std::env::var("SLURM_ARRAY_JOB_ID").ok().or(submission.job).unwrap_or_default();
        output::eprint("the time limit is near: the next turn continues");
        Slurm.requeue(&job, self.task)?;
        Ok(ExitCode::from(INTERRUPTED))
    }
}

fn ended(point: &SubmittedPoint, outcome: TurnOutcome, code: u8, reason: Option<String>) -> EndedPoint {
    EndedPoint { scene: point.scene.clone(), outcome, code, reason }
}

fn run_point(
    submission: &Submission,
    point: &SubmittedPoint,
    command: &PointCommand,
    out: &Path,
) -> (sweep::PointOutcome, u8) {
    match &submission.command {
        Some(given) => {
            let arguments: Vec<&OsStr> = given.arguments.iter().map(OsStr::new).collect();
            command.execute(&arguments, &given.folder, &submission.place(out, point).1, &sys::user_signal)
        }
        None => command.run(&PointFolder::of(out, &point.label), &sys::user_signal),
    }
}

/// Runs the points of a task that are not done. Returns the highest exit code, and how many were interrupted.
fn run_points(submission: &Submission, points: &[usize], out: &Path) -> Result<(u8, usize)> {
    let machine = &submission.machine;
    let missing = submission.missing(out, points);
    let at_once = Submission::at_once(machine, missing.len());
    let program = std::env::current_exe().map_err(Error::io("find", Path::new("asperity")))?;
    let threads = (machine.cpus / at_once).max(1);
    let command = PointCommand::new(program, &submission.flags, threads, &machine.lammps);
    let (next, worst, interrupted) = (AtomicUsize::new(0), AtomicU8::new(0), AtomicUsize::new(0));
    let failure: Mutex<Option<Error>> = Mutex::new(None);
    let work = || {
        while let Some(point) = missing.get(next.fetch_add(1, Ordering::Relaxed)) {
            let end = match progress::stopping() || sys::user_signal() {
                true => (sweep::PointOutcome::Interrupted, 130),
                false => run_point(submission, point, &command, out),
            };
            let end = match end {
                (sweep::PointOutcome::Done, code) => {
                    worst.fetch_max(code, Ordering::Relaxed);
                    ended(point, TurnOutcome::Done, code, None)
                }
                (sweep::PointOutcome::Interrupted, _) => {
                    interrupted.fetch_add(1, Ordering::Relaxed);
                    ended(point, TurnOutcome::Interrupted, 130, None)
                }
                (sweep::PointOutcome::Failed(why), code) => {
                    worst.fetch_max(code, Ordering::Relaxed);
                    output::eprint(&format!("{}: {why}", point.label));
                    ended(point, TurnOutcome::Failed, code, Some(why))
                }
            };
            if let Err(e) = record_end(out, &point.label, &end) {
                failure.lock().expect("no panic").get_or_insert(e);
            }
        }
    };
    std::thread::scope(|scope| (0..at_once).for_each(|_| drop(scope.spawn(work))));
    match failure.into_inner().expect("no panic") {
        Some(e) => Err(e),
        None => Ok((worst.into_inner(), interrupted.into_inner())),
    }
}

/// Write tables and report of a sweep that a cluster runs, of the points that are done.
#[derive(Debug, clap::Args)]
pub(super) struct CollectArgs {
    /// Folder of the sweep.
    folder: PathBuf,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

impl CollectArgs {
    pub(super) fn execute(self) -> Result<ExitCode> {
        let out = &self.folder;
        let submission = Submission::read(out)?;
        if submission.command.is_some() {
            let accepted = "the folder of a sweep: a single command writes its own report";
            return Err(Error::input("command line", "FOLDER", out.display(), accepted));
        }
        let (mut worst, mut waiting) = (0, false);
        // Without an answer of the queue points may wait.
        let queue = submission.job.as_deref().map_or(Ok(Vec::new()), |job| Slurm.tasks(job)).ok();
        let points = submission.points.iter().zip(submission.task_of()).map(|(p, task)| {
            let end = submission.end_of(out, p);
            let in_queue = queue.as_ref().is_none_or(|q| q.iter().any(|q| Some(q.task) == task));
            let (status, reason) = match end.map(|e| (e.outcome, e)) {
                Some((TurnOutcome::Done, end)) => {
                    worst = end.code.max(worst);
                    (PointStatus::Done, None)
                }
                Some((TurnOutcome::Failed, end)) => {
                    worst = end.code.max(worst);
                    (PointStatus::Failed, end.reason)
                }
                _ if in_queue => {
                    waiting = true;
                    (PointStatus::Waiting, None)
                }
                _ => {
                    worst = WITHOUT_END.max(worst);
                    (PointStatus::Failed, Some(without_end(out, &submission, task)))
                }
            };
            sweep::point((&p.label, p.values.clone()), status, reason, out)
        });
        let points = points.collect::<Result<Vec<_>>>()?;
        let (ensemble, page) = sweep::write_tables(out, (&submission.name, &submission.keys), points)?;
        super::sweep_table::print(&ensemble, out, &page, self.json)?;
        // As a local sweep that was interrupted.
        Ok(ExitCode::from(if worst == 0 && waiting { INTERRUPTED } else { worst }))
    }
}

/// Show the state of a sweep or command on a cluster: done, running, waiting, failed with the reason; core hours.
#[derive(Debug, clap::Args)]
pub(super) struct StatusArgs {
    /// Folder of the sweep or of the command.
    folder: PathBuf,
    /// Repeat every 10 s until nothing waits or runs.
    #[arg(long)]
    watch: bool,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

/// State of the points of a sweep, or of a command.
struct QueueStatus {
    /// Points by state of their task in the queue, as `running` and `pending`.
    queued: Vec<(String, usize)>,
    done: usize,
    /// Label and reason.
    failed: Vec<(String, String)>,
    core_hours: [f64; 2],
}

/// Reasons of squeue for tasks that start by themselves.
const USUAL_REASONS: [&str; 7] = ["", "None", "Priority", "Resources", "BeginTime", "JobArrayTaskLimit", "Dependency"];

/// Why a point has neither an end nor a task in the queue.
fn without_end(out: &Path, submission: &Submission, task: Option<usize>) -> String {
    let log = task.map(|t| PathBuf::from(FOLDER).join(format!("task-{t}.log")));
    let reason = match log {
        _ if submission.job.is_none() => "it was not submitted: sbatch refused the job".into(),
        Some(log) if out.join(&log).exists() => {
            format!("its task ended without a result: cancelled, or killed, for which see {}", log.display())
        }
        _ => "its task did not begin: cancelled, or see scontrol show job".into(),
    };
    format!("{reason}; the same command submits it again")
}

impl QueueStatus {
    fn read(out: &Path) -> Result<QueueStatus> {
        let submission = Submission::read(out)?;
        let has_ended = |p: &SubmittedPoint| {
            submission.end_of(out, p).is_some_and(|end| matches!(end.outcome, TurnOutcome::Done | TurnOutcome::Failed))
        };
        // The folder has the state of a submission that has ended.
        let job = submission.job.as_deref().filter(|_| !submission.points.iter().all(has_ended));
        let queue = job.map_or(Ok(Vec::new()), |job| Slurm.tasks(job))?;
        let of_task = |task: Option<usize>| -> Option<&QueueState> { queue.iter().find(|q| Some(q.task) == task) };
        let (mut finished, mut failed, mut queued, mut left) = (0, Vec::new(), Vec::<(String, usize)>::new(), 0.0);
        for (point, task) in submission.points.iter().zip(submission.task_of()) {
            let end = submission.end_of(out, point);
            match (end.as_ref().map(|e| e.outcome), of_task(task)) {
                (Some(TurnOutcome::Done), _) => finished += 1,
                (Some(TurnOutcome::Failed), _) => {
                    failed.push((point.label.clone(), end.and_then(|e| e.reason).unwrap_or_default()));
                }
                (_, Some(in_queue)) => {
                    left += point.seconds;
                    let mut state = in_queue.state.to_lowercase();
                    if state == "pending" && !USUAL_REASONS.contains(&in_queue.reason.as_str()) {
                        state += &format!(" ({})", in_queue.reason);
                    }
                    match queued.iter_mut().find(|q| q.0 == state) {
                        Some(entry) => entry.1 += 1,
                        None => queued.push((state, 1)),
                    }
                }
                (_, None) => failed.push((point.label.clone(), without_end(out, &submission, task))),
            }
        }
        let machine = &submission.machine;
        let used = Turn::total_seconds(out) * machine.cpus as f64 / 3600.0;
        Ok(QueueStatus { queued, done: finished, failed, core_hours: [used, core_hours(left, machine)] })
    }

    fn print(&self, out: &Path, json: bool) -> Result<()> {
        let queued: usize = self.queued.iter().map(|q| q.1).sum();
        let points = queued + self.done + self.failed.len();
        let [used, left] = self.core_hours;
        if json {
            let by_state: serde_json::Map<_, _> = self.queued.iter().map(|(s, n)| (s.clone(), json!(n))).collect();
            let failures: Vec<_> =
                self.failed.iter().map(|(l, reason)| json!({ "point": l, "reason": reason })).collect();
            return output::json_line(&json!({
                "out": output::path(out), "points": points, "done": self.done, "failed": self.failed.len(),
                "queued": queued, "states": by_state, "failures": failures,
                "core_hours_used": used, "core_hours_left": left,
            }));
        }
        let states: Vec<String> = self.queued.iter().map(|(s, n)| format!("{n} {s}")).collect();
        let states =
            [vec![format!("{} done", self.done)], states, vec![format!("{} failed", self.failed.len())]].concat();
        output::print(&format!("{}: {}", number(points, "point"), states.join(", ")));
        output::print(&format!("core hours: {} used, about {} left", significant(used, 2), significant(left, 2)));
        for (label, reason) in self.failed.iter().take(MOST_SHOWN) {
            output::print(&format!("failed: {label}: {reason}"));
        }
        if self.failed.len() > MOST_SHOWN {
            output::print(&format!("and {} more (--json lists all)", self.failed.len() - MOST_SHOWN));
        }
        Ok(())
    }
}

impl StatusArgs {
    pub(super) fn execute(self) -> Result<()> {
        loop {
            let state = QueueStatus::read(&self.folder)?;
            state.print(&self.folder, self.json)?;
            if !self.watch || state.queued.is_empty() {
                return Ok(());
            }
            let started = Instant::now();
            while started.elapsed() < WATCH {
                if progress::stopping() {
                    return Err(Error::Interrupted);
                }
                std::thread::sleep(Duration::from_millis(100));
            }
        }
    }
}
