//! `asperity sweep` and `asperity ensemble`: one scene with varied keys.

use super::run::StageFlags;
use super::{output, progress};
use crate::pipeline::sweep::{self, Outcome, PointFolder, RANGE, Sweep as Points, SweepListener, whole_numbers};
use crate::record::ensemble::{Ensemble, PointStatus};
use crate::report::number::{duration, memory, significant};
use crate::scene::Scene;
use crate::{Error, Result};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::Duration;

#[derive(Debug, clap::Args)]
pub(super) struct Sweep {
    /// File of the sweep (TOML): scene = "FILE" and the keys that vary under [over].
    file: PathBuf,
    #[command(flatten)]
    flags: SweepFlags,
}

#[derive(Debug, clap::Args)]
pub(super) struct EnsembleArguments {
    /// Scene file (TOML).
    scene: PathBuf,
    /// Seeds of the surface: "1..12" or "1,5,7".
    #[arg(long, value_name = "SEEDS")]
    seeds: String,
    #[command(flatten)]
    flags: SweepFlags,
}

#[derive(Debug, clap::Args)]
struct SweepFlags {
    /// Folder of the sweep. Default: runs/NAME-sweep.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Points that run at once. Default: one for each core, as many as memory permits.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Replace the tables of another sweep in that folder, and the results of points whose scene has changed.
    #[arg(long)]
    overwrite: bool,
    #[command(flatten)]
    stages: StageFlags,
    /// Leave out the atoms.
    #[arg(long)]
    no_atoms: bool,
    /// Print the points with their memory and time, without running them.
    #[arg(long)]
    dry_run: bool,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

impl Sweep {
    pub(super) fn execute(self) -> Result<ExitCode> {
        let points = Points::read(&self.file, &|scene| self.flags.change(scene))?;
        self.flags.execute(&points)
    }
}

impl EnsembleArguments {
    pub(super) fn execute(self) -> Result<ExitCode> {
        let wrong = || Error::input("command line", "--seeds", &self.seeds, RANGE);
        let seeds = whole_numbers(&self.seeds).filter(|s| s.iter().all(|s| *s >= 0)).ok_or_else(wrong)?;
        if let Some(heights) = Scene::read(&self.scene)?.surface.heights {
            let found = format!("{} with surface.heights = {}", self.scene.display(), heights.display());
            return Err(Error::input("command line", "--seeds", found, "a scene with a synthesised surface"));
        }
        let points = Points::ensemble(&self.scene, &seeds, &|scene| self.flags.change(scene))?;
        self.flags.execute(&points)
    }
}

impl SweepFlags {
    fn change(&self, scene: &mut Scene) {
        if self.no_atoms {
            scene.atoms = None;
        }
    }

    fn execute(&self, sweep: &Points) -> Result<ExitCode> {
        let bytes = sweep.points.iter().map(|p| p.bytes).max().unwrap_or_default().max(1);
        let have = crate::sys::available_memory_bytes();
        let cores = std::thread::available_parallelism().map_or(1, |c| c.get());
        let fit = usize::try_from(have / bytes).unwrap_or(usize::MAX).max(1);
        let at_once = self.jobs.map_or(cores.min(fit), usize::from).min(sweep.points.len()).max(1);
        if self.dry_run {
            return self.plan(sweep, at_once).map(|()| ExitCode::SUCCESS);
        }
        let out = self.out.clone().unwrap_or_else(|| PathBuf::from("runs").join(format!("{}-sweep", sweep.name)));
        let program = std::env::current_exe().map_err(Error::io("find", Path::new("asperity")))?;
        let (worst, threads) = (AtomicU8::new(0), (cores / at_once).max(1));
        let runner = |point: &PointFolder| self.run_point(&program, point, threads, &worst);
        let ensemble = sweep::run(sweep, &out, (at_once, self.overwrite), &runner, &Lines(Mutex::new(())))?;
        let page = crate::report::write(&out)?;
        self.print(&ensemble, &out, &page)?;
        Ok(ExitCode::from(worst.load(Ordering::Relaxed)))
    }

    /// `asperity run` of a point in a process of its own, with its output in the point's log.
    fn run_point(&self, program: &Path, point: &PointFolder, threads: usize, worst: &AtomicU8) -> Outcome {
        let failed = |why: String, code: u8| {
            worst.fetch_max(code, Ordering::Relaxed);
            Outcome::Failed(why)
        };
        let log = File::create(&point.log).and_then(|log| Ok((log.try_clone()?, log)));
        let (stdout, stderr) = match log {
            Ok(both) => both,
            Err(e) => return failed(format!("cannot create {}: {e}", point.log.display()), 2),
        };
        let mut command = Command::new(program);
        command.arg("run").arg(&point.scene).arg("--out").arg(&point.out).args(["--threads", &threads.to_string()]);
        let flags = [
            ("--overwrite", self.overwrite),
            ("--no-verify", self.stages.no_verify),
            ("--allow-program", self.stages.allow_program),
        ];
        command.args(flags.iter().filter(|f| f.1).map(|f| f.0));
        command.stdin(Stdio::null()).stdout(stdout).stderr(stderr);
        crate::sys::die_with_parent(&mut command);
        let mut child = match command.spawn() {
            Ok(child) => child,
            Err(e) => return failed(format!("cannot start {}: {e}", program.display()), 5),
        };
        let status = loop {
            match child.try_wait() {
                Ok(Some(status)) => break status,
                Ok(None) if progress::stopping() => {
                    // Its own checkpoints are complete at any time.
                    crate::sys::terminate(child.id());
                    let _ = child.wait();
                    return Outcome::Interrupted;
                }
                Ok(None) => std::thread::sleep(POLL),
                Err(e) => return failed(format!("cannot wait for the run: {e}"), 5),
            }
        };
        match status.code() {
            // 1: a statement of the challenge failed; the results are complete.
            Some(0 | 1) => Outcome::Done,
            Some(130) if progress::stopping() => Outcome::Interrupted,
            code => {
                let code = code.and_then(|c| u8::try_from(c).ok()).unwrap_or(70);
                failed(reason(&point.log).unwrap_or_else(|| status.to_string()), code)
            }
        }
    }

    fn plan(&self, sweep: &Points, at_once: usize) -> Result<()> {
        let (bytes, seconds) =
            sweep.points.iter().fold((0, 0.0), |(b, s), p| (p.bytes.max(b), s + p.seconds / at_once as f64));
        if self.json {
            return output::json_line(&serde_json::json!({
                "points": sweep.points.len(), "at_once": at_once, "bytes_of_largest": bytes, "seconds": seconds,
            }));
        }
        let rows = sweep.points.iter().map(|p| vec![p.label.clone(), memory(p.bytes), duration(p.seconds)]);
        output::print(&output::table(&["point", "memory", "time"], rows));
        output::print(&format!(
            "{} points, {at_once} at once: about {} (an order of magnitude)",
            sweep.points.len(),
            duration(seconds)
        ));
        Ok(())
    }

    fn print(&self, ensemble: &Ensemble, out: &Path, page: &Path) -> Result<()> {
        let count = |status: PointStatus| ensemble.points.iter().filter(|p| p.status == status).count();
        let (done, failed) = (count(PointStatus::Done), count(PointStatus::Failed));
        if self.json {
            return output::json_line(&serde_json::json!({
                "out": output::path(out),
                "report": output::path(page),
                "points": ensemble.points.len(),
                "done": done,
                "failed": failed,
            }));
        }
        let shown = ["contact_fraction", "mean_gap", "kappa"];
        let rows = ensemble.statistics.iter().filter(|s| shown.contains(&s.of.quantity.as_str())).map(|s| {
            let group: Vec<String> = s.group.iter().map(|(k, v)| format!("{k} = {v}")).collect();
            let error = s.sample.standard_error.map_or("-".into(), |e| significant(e, 2));
            let scatter = s.sample.standard_deviation.map_or("-".into(), |e| significant(e, 2));
            let (p_star, mean) = (significant(s.p_star, 3), significant(s.sample.mean, 4));
            let n = s.sample.realisations.to_string();
            let (source, quantity) = (s.of.source.clone(), s.of.quantity.clone());
            vec![group.join(", "), source, p_star, quantity, mean, error, scatter, n, s.of.unit.clone()]
        });
        let head = ["", "source", "p*", "quantity", "mean", "standard error", "standard deviation", "n", "unit"];
        output::print(&output::table(&head, rows));
        let failures = ensemble.points.iter().filter_map(|p| Some((&p.label, p.reason.as_ref()?)));
        failures.for_each(|(label, why)| output::print(&format!("failed: {label}: {why}")));
        output::print(&format!("{done} of {} points done, {failed} failed", ensemble.points.len()));
        output::print(&format!("report: {}", page.display()));
        Ok(())
    }
}

/// Interval between looks at a running point.
const POLL: Duration = Duration::from_millis(20);

/// The last error of a log.
fn reason(log: &Path) -> Option<String> {
    let text = String::from_utf8_lossy(&std::fs::read(log).ok()?).into_owned();
    let last = text.lines().rfind(|l| l.contains("error: "))?;
    Some(last.split_once("error: ").map_or(last, |(_, why)| why).to_string())
}

/// One line on stderr for each point.
struct Lines(Mutex<()>);

impl SweepListener for Lines {
    fn ended(&self, label: &str, failure: Option<&str>, done: usize, all: usize) {
        let _one_at_a_time = self.0.lock();
        let how = failure.map_or("done".into(), |why| format!("failed: {why}"));
        output::eprint(&format!("  {done} of {all}: {label} {how}"));
    }

    fn stopping(&self) -> bool {
        progress::stopping()
    }
}
