//! Runs the points of a sweep, several at once, and collects their results.

use super::collect::numbers;
use super::files;
use super::points::{Sweep, SweepPoint};
use crate::compare::ensemble::evaluate;
use crate::pipeline::RunFolder;
use crate::pipeline::run::{expect_same, list_files};
use crate::record::ensemble::{Ensemble, EnsemblePoint, FILE, PointStatus};
use crate::record::given_loads::Imposed;
use crate::record::results;
use crate::record::written::{self, WrittenFolder};
use crate::report;
use crate::scene::Scene;
use asperity_contact::quantity::Quantity;
use asperity_contact::uncertainty::total;
use asperity_grid::error::{Error, Result};
use asperity_surface::files::atomic_file::{create_folder, read_bytes, write_atomic};
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

impl PointFolder {
    /// Those of the point `label` in the folder of a sweep.
    pub fn of(sweep: &Path, label: &str) -> PointFolder {
        PointFolder {
            scene: sweep.join("scenes").join(format!("{label}.toml")),
            out: sweep.join("points").join(label),
            log: sweep.join("logs").join(format!("{label}.log")),
        }
    }

    /// Writes the scene unless the file has it.
    ///
    /// # Errors
    /// `Io`.
    pub fn write_scene(&self, text: &str) -> Result<()> {
        if read_bytes(&self.scene).is_ok_and(|earlier| earlier == text.as_bytes()) {
            return Ok(());
        }
        write_atomic(&self.scene, |w| w.write_all(text.as_bytes()))
    }
}

/// Runs the scene of a point in its folder.
pub type PointRunner<'a> = dyn Fn(&PointFolder) -> PointOutcome + Sync + 'a;

/// How a point ended.
pub enum PointOutcome {
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

    fn warn(&self, text: &str);
}

/// Creates the folder of a sweep, and locks it. Tables that changed since they were written are named to `warn`: they are made again
/// from the points.
///
/// # Errors
/// `Input` for the results of another sweep or other files in the folder; a folder in use; I/O errors.
pub fn open(sweep: &Sweep, out: &Path, overwrite: bool, warn: &dyn Fn(&str)) -> Result<RunFolder> {
    let locked = RunFolder::open(out)?;
    if out.join(FILE).exists() && !overwrite {
        let known = written::unchanged(out, FILE).and_then(|()| Ensemble::read(out));
        if let Err(e) = &known {
            warn(&format!("{e}; the tables are made again from the points"));
        }
        if let Ok(known) = known
            && (known.keys != sweep.keys || known.name != sweep.name)
        {
            let found = format!("{} (contains the sweep {} over {})", out.display(), known.name, known.keys.join(", "));
            let accepted = "another folder, or --overwrite to replace its tables";
            return Err(Error::input("command line", "--out", found, accepted));
        }
    }
    if !overwrite {
        sweep.points.iter().try_for_each(|point| expect_scene(point, out))?;
    }
    for folder in ["points", "scenes", "logs"] {
        create_folder(&out.join(folder))?;
    }
    Ok(locked)
}

/// Refuses to replace a finished point by that of another scene.
fn expect_scene(swept: &SweepPoint, out: &Path) -> Result<()> {
    let folder = PointFolder::of(out, &swept.label);
    let scenes = || Some((Scene::read(&folder.scene).ok()?, Scene::parse(&swept.scene, &folder.scene).ok()?));
    let finished = folder.out.join(results::FILE).exists();
    let Some((earlier, new)) = finished.then(scenes).flatten() else { return Ok(()) };
    expect_same((&earlier, &new), out, &format!("{} has", swept.label))
}

/// Runs all points that are not done, `at_once` at a time, and writes results, tables and report into `out`. Points that fail do not
/// stop the others. Returns the path of the report, too.
///
/// # Errors
/// `Interrupted`; I/O errors; the results of another sweep or other files in the folder; a folder in use.
pub fn run(
    sweep: &Sweep,
    out: &Path,
    (at_once, overwrite): (usize, bool),
    runner: &PointRunner,
    listener: &dyn SweepListener,
) -> Result<(Ensemble, PathBuf)> {
    let _locked = open(sweep, out, overwrite, &|text| listener.warn(text))?;
    let (next, ended) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let reached: Mutex<Vec<Option<EnsemblePoint>>> = Mutex::new(vec![None; sweep.points.len()]);
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
    let reached = reached.into_inner().expect("no panic");
    let waiting = |p: &SweepPoint| point((&p.label, json_values(p)), PointStatus::Waiting, None, out);
    let points = reached.into_iter().zip(&sweep.points).map(|(outcome, p)| outcome.map_or_else(|| waiting(p), Ok));
    let points = points.collect::<Result<Vec<EnsemblePoint>>>()?;
    let is_interrupted = points.iter().any(|p| p.status == PointStatus::Waiting);
    let written = write_tables(out, (&sweep.name, &sweep.keys), points)?;
    if is_interrupted { Err(Error::Interrupted) } else { Ok(written) }
}

/// Evaluates the points, and writes results, tables and report into the folder of the sweep.
///
/// # Errors
/// `Io`.
pub fn write_tables(
    out: &Path,
    (name, keys): (&str, &[String]),
    points: Vec<EnsemblePoint>,
) -> Result<(Ensemble, PathBuf)> {
    // Points differ in values, and not in kinds of loads.
    let scene = points.iter().find_map(|p| Scene::read(&PointFolder::of(out, &p.label).scene).ok());
    let imposed = scene.and_then(|scene| Imposed::of(scene.load.loads().kind));
    let mut ensemble = Ensemble::new(name.to_string(), keys.to_vec(), imposed, points);
    evaluate(&mut ensemble);
    ensemble.write(out)?;
    files::write(out, &ensemble)?;
    let page = report::write(out)?;
    list_files(out)?;
    Ok((ensemble, page))
}

/// A point with its numbers, which are read from its run folder if it is done.
///
/// # Errors
/// `Io` or `Format` for results that cannot be read.
pub fn point(
    (label, values): (&str, Vec<serde_json::Value>),
    status: PointStatus,
    reason: Option<String>,
    out: &Path,
) -> Result<EnsemblePoint> {
    let (label, folder) = (label.to_string(), PointFolder::of(out, label).out);
    let empty = EnsemblePoint {
        label,
        values,
        status,
        reason,
        numbers: Vec::new(),
        warnings: Vec::new(),
        area_uncertainty: None,
    };
    if status != PointStatus::Done {
        return Ok(empty);
    }
    let (_, results) = WrittenFolder::run(&folder)?;
    let states = results.continuum.iter().flat_map(|c| &c.states);
    let uncertain = states.filter_map(|s| total(&s.uncertainty, Quantity::ContactArea));
    let area_uncertainty = uncertain.reduce(f64::max);
    Ok(EnsemblePoint { numbers: numbers(&results), warnings: results.warnings, area_uncertainty, ..empty })
}

/// `None` if it was interrupted.
fn run_point(swept: &SweepPoint, out: &Path, runner: &PointRunner) -> Result<Option<EnsemblePoint>> {
    let folder = PointFolder::of(out, &swept.label);
    folder.write_scene(&swept.scene)?;
    let (status, reason) = match runner(&folder) {
        PointOutcome::Interrupted => return Ok(None),
        PointOutcome::Failed(reason) => (PointStatus::Failed, Some(reason)),
        PointOutcome::Done => (PointStatus::Done, None),
    };
    point((&swept.label, json_values(swept)), status, reason, out).map(Some)
}

/// The varied values of a point, as in its results.
pub fn json_values(point: &SweepPoint) -> Vec<serde_json::Value> {
    point.values.iter().map(|v| serde_json::to_value(v).unwrap_or_default()).collect()
}
