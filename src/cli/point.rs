//! Runs a point of a sweep, or another command, in a process of its own, with its output in a log.

use super::{bug, progress};
use crate::pipeline::sweep::{PointFolder, PointOutcome};
use crate::record::results::Results;
use crate::record::written::WrittenFolder;
use crate::report::accuracy::missed_by;
use asperity_atoms::lammps_command::LammpsCommand;
use asperity_contact::method::Device;
use asperity_contact::results::ContinuumResults;
use asperity_grid::error::Error;
use asperity_surface::files::atomic_file;
use asperity_surface::files::atomic_file::read_bytes;
use asperity_surface::files::beneath;
use std::ffi::OsStr;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Interval between looks at a running point.
const POLL: Duration = Duration::from_millis(20);

/// Exit code of a run that has not found all that its scene asks for.
const NOT_CONVERGED: u8 = 3;

/// SIGKILL, which the kernel sends when memory runs out.
const KILL: i32 = 9;

/// How points are run.
pub(super) struct PointCommand {
    program: PathBuf,
    arguments: Vec<String>,
}

impl PointCommand {
    /// `program` is asperity; `flags` are those of the command.
    pub(super) fn new(program: PathBuf, flags: &[String], threads: usize, lammps: &LammpsCommand) -> Self {
        PointCommand { program, arguments: Self::arguments(flags, threads, lammps) }
    }

    /// Arguments of a command after its own.
    pub(super) fn arguments(flags: &[String], threads: usize, lammps: &LammpsCommand) -> Vec<String> {
        let mut arguments = flags.to_vec();
        arguments.extend(["--threads".into(), threads.to_string()]);
        if Device::chosen() == Device::Cuda {
            arguments.extend(["--device".into(), "cuda".into()]);
        }
        arguments.extend(Self::of_lammps(lammps));
        arguments
    }

    /// Flags that start LAMMPS in this way.
    pub(super) fn of_lammps(lammps: &LammpsCommand) -> Vec<String> {
        let values = [
            ("--lammps", lammps.program.as_ref().map(|p| p.display().to_string())),
            ("--ranks", lammps.ranks.map(|n| n.to_string())),
            ("--launcher", lammps.launcher.clone()),
            ("--lammps-args", (!lammps.args.is_empty()).then(|| lammps.args.join(" "))),
        ];
        values.into_iter().filter_map(|(flag, value)| Some(format!("{flag}={}", value?))).collect()
    }

    /// Runs the point; stops it when `stopping` says so. A failure comes with the exit code, and so do results that are not all that the scene
    /// asks for.
    pub(super) fn run(&self, point: &PointFolder, stopping: &dyn Fn() -> bool) -> (PointOutcome, u8) {
        let arguments = ["run".as_ref(), point.scene.as_os_str(), "--out".as_ref(), point.out.as_os_str()];
        match self.execute(&arguments, Path::new("."), &point.log, stopping) {
            (PointOutcome::Failed(_), code) if code == NOT_CONVERGED && has_results(&point.out) => {
                (PointOutcome::Done, code)
            }
            end => end,
        }
    }

    /// The same with these arguments, in the working folder `from`.
    pub(super) fn execute(
        &self,
        arguments: &[&OsStr],
        from: &Path,
        log: &Path,
        stopping: &dyn Fn() -> bool,
    ) -> (PointOutcome, u8) {
        let failed = |cause: String, code: u8| (PointOutcome::Failed(cause), code);
        let doubled = |file: std::fs::File| Ok((file.try_clone().map_err(Error::io("create", log))?, file));
        let opened = atomic_file::create(log).and_then(doubled);
        let (stdout, stderr) = match opened {
            Ok(both) => both,
            Err(e) => return failed(e.to_string(), 2),
        };
        let mut command = Command::new(&self.program);
        command.args(arguments).args(&self.arguments).current_dir(from);
        command.stdin(Stdio::null()).stdout(stdout).stderr(stderr);
        beneath::share(&mut command, log);
        asperity_grid::sys::group::die_with_parent(&mut command);
        let mut child = match command.spawn() {
            Ok(child) => child,
            Err(e) => return failed(format!("cannot start {}: {e}", self.program.display()), 5),
        };
        let status = loop {
            match child.try_wait() {
                Ok(Some(status)) => break status,
                Ok(None) if stopping() || progress::stopping() => {
                    // Its own checkpoints are complete at any time.
                    asperity_grid::sys::group::terminate(child.id());
                    let _ = child.wait();
                    return (PointOutcome::Interrupted, 130);
                }
                Ok(None) => std::thread::sleep(POLL),
                Err(e) => return failed(format!("cannot wait for the run: {e}"), 5),
            }
        };
        match status.code() {
            // 1: a statement of the challenge failed; the results are complete.
            Some(0 | 1) => (PointOutcome::Done, 0),
            Some(130) if stopping() || progress::stopping() => (PointOutcome::Interrupted, 130),
            Some(code) => {
                let code = u8::try_from(code).unwrap_or(bug::EXIT_CODE);
                failed(reason(log).unwrap_or_else(|| status.to_string()), code)
            }
            None => {
                let signal = status.signal().unwrap_or_default();
                let cause = if signal == KILL { ", as by a machine without free memory" } else { "" };
                failed(format!("killed by signal {signal}{cause}; the same command runs it again"), 5)
            }
        }
    }
}

/// Whether a run that ends with this code has results: of the loads before the surfaces separated, all but the pull-off or an auxiliary solve, or
/// those of a coarser accuracy.
/// Their warnings say so.
fn has_results(folder: &Path) -> bool {
    let is_partial = |results: &Results| {
        let solved = results.continuum.as_ref();
        let failed = |c: &ContinuumResults| c.contact_lost.is_some() || c.pull_off_failure.is_some();
        let is_inaccurate = missed_by(results).is_some();
        !results.failures.is_empty() || is_inaccurate || solved.is_some_and(failed)
    };
    WrittenFolder::run(folder).is_ok_and(|(_, results)| is_partial(&results))
}

/// The last error of a log.
fn reason(log: &Path) -> Option<String> {
    let text = String::from_utf8_lossy(&read_bytes(log).ok()?).into_owned();
    let last = text.lines().rfind(|l| l.contains("error: "))?;
    Some(last.split_once("error: ").map_or(last, |(_, reason)| reason).to_string())
}
