//! Runs the points of a sweep, several at once, and collects their results.

use super::collect::numbers;
use super::files;
use super::points::{Sweep, SweepPoint};
use crate::compare::ensemble::evaluate;
use crate::error::{Error, Result};
use crate::pipeline::RunFolder;
use crate::record::atomic_file::write_atomic;
use crate::record::ensemble::{Ensemble, FILE, Point, PointStatus};
use crate::record::results::Results;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Files of a point.
pub struct PointFolder {
    pub scene: PathBuf,
    pub out: PathBuf,
    pub log: PathBuf,
}

/// Runs the scene of a point in its folder.
pub type PointRunner<'a> = dyn Fn(&PointFolder) -> Outcome + Sync + 'a;

/// How a point ended.
pub enum Outcome {
    Done,
    /// With the reason.
    Failed(String),
    Interrupted,
}

/// Receives the progress of a sweep.
pub trait SweepListener: Sync {
    /// A point ended: its label, its reason if it failed, and how many of all have ended.
    fn ended(&self, label: &str, failure: Option<&str>, done: usize, all: usize);

    fn stopping(&self) -> bool;
}

/// Runs all points that are not done, `at_once` at a time, and writes results and tables into `out`. Points that fail do not stop the
/// others.
///
/// # Errors
/// `Interrupted`; I/O errors; the results of another sweep or other files in the folder; a folder in use.
pub fn run(
    sweep: &Sweep,
    out: &Path,
    (at_once, overwrite): (usize, bool),
    runner: &PointRunner,
    listener: &dyn SweepListener,
) -> Result<Ensemble> {
    if out.join(FILE).exists() && !overwrite {
        let known = Ensemble::read(out)?;
        if known.keys != sweep.keys || known.name != sweep.name {
            let found = format!("{} (contains the sweep {} over {})", out.display(), known.name, known.keys.join(", "));
            let accepted = "another folder, or --overwrite to replace its tables";
            return Err(Error::input("command line", "--out", found, accepted));
        }
    }
    let _locked = RunFolder::open(out)?;
    for folder in ["points", "scenes", "logs"] {
        let path = out.join(folder);
        std::fs::create_dir_all(&path).map_err(Error::io("create", &path))?;
    }
    let (next, ended) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let reached: Mutex<Vec<Option<Point>>> = Mutex::new(vec![None; sweep.points.len()]);
    let failure: Mutex<Option<Error>> = Mutex::new(None);
    let work = || {
        while !listener.stopping() {
            let i = next.fetch_add(1, Ordering::Relaxed);
            let Some(point) = sweep.points.get(i) else { return };
            match run_point(point, out, runner) {
                Ok(Some(point)) => {
                    let done = ended.fetch_add(1, Ordering::Relaxed) + 1;
                    listener.ended(&point.label, point.reason.as_deref(), done, sweep.points.len());
                    reached.lock().expect("no panic")[i] = Some(point);
                }
                Ok(None) => return,
                Err(e) => {
                    failure.lock().expect("no panic").get_or_insert(e);
                    return;
                }
            }
        }
    };
    std::thread::scope(|scope| {
        (0..at_once.clamp(1, sweep.points.len().max(1))).for_each(|_| {
            scope.spawn(work);
        });
    });
    if let Some(e) = failure.into_inner().expect("no panic") {
        return Err(e);
    }
    let waiting = |p: &SweepPoint| Point {
        label: p.label.clone(),
        values: values(p),
        status: PointStatus::Waiting,
        reason: None,
        numbers: Vec::new(),
    };
    let reached = reached.into_inner().expect("no panic");
    let points: Vec<Point> =
        reached.into_iter().zip(&sweep.points).map(|(found, p)| found.unwrap_or_else(|| waiting(p))).collect();
    let is_interrupted = points.iter().any(|p| p.status == PointStatus::Waiting);
    let mut ensemble = Ensemble::new(sweep.name.clone(), sweep.keys.clone(), points);
    evaluate(&mut ensemble);
    ensemble.write(out)?;
    files::write(out, &ensemble)?;
    if is_interrupted { Err(Error::Interrupted) } else { Ok(ensemble) }
}

/// `None` if it was interrupted.
fn run_point(point: &SweepPoint, out: &Path, runner: &PointRunner) -> Result<Option<Point>> {
    let folder = PointFolder {
        scene: out.join("scenes").join(format!("{}.toml", point.label)),
        out: out.join("points").join(&point.label),
        log: out.join("logs").join(format!("{}.log", point.label)),
    };
    write_atomic(&folder.scene, |w| w.write_all(point.scene.as_bytes()))?;
    let (status, reason, numbers) = match runner(&folder) {
        Outcome::Interrupted => return Ok(None),
        Outcome::Failed(reason) => (PointStatus::Failed, Some(reason), Vec::new()),
        Outcome::Done => (PointStatus::Done, None, numbers(&Results::read(&folder.out)?)),
    };
    Ok(Some(Point { label: point.label.clone(), values: values(point), status, reason, numbers }))
}

fn values(point: &SweepPoint) -> Vec<serde_json::Value> {
    point.values.iter().map(|v| serde_json::to_value(v).unwrap_or_default()).collect()
}
