//! Files from which an interrupted path goes on.

use crate::grid::Grid;
use crate::method::{Run, SnapshotRef, SolverSnapshot, State};
use crate::record::{json, npy};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// A solve is kept this often, or less often where keeping it would take more than a twentieth of the time.
const EVERY: Duration = Duration::from_secs(60);
const SHARE: u32 = 20;

/// Where a path was left.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Checkpoint {
    /// What it is a state of: another problem or load path must not go on from it.
    key: String,
    /// Results of the loads that are done, as who follows the path has put them.
    pub finished: Vec<Value>,
    nx: usize,
    ny: usize,
    /// File of the gap `[ny, nx]`, in the same folder.
    gap: String,
    /// File of the second field that the method goes on from, if it needs one.
    #[serde(default)]
    auxiliary: Option<String>,
    /// The method's own; `null` where it begins its load anew from the gap.
    progress: Value,
    #[serde(skip)]
    folder: PathBuf,
}

impl Checkpoint {
    /// `STEM.json` of a folder, if there is one of this key.
    pub fn find(folder: &Path, stem: &str, key: &str) -> Option<Checkpoint> {
        let found: Checkpoint = json::read(&folder.join(format!("{stem}.json"))).ok()?;
        (found.key == key).then(|| Checkpoint { folder: folder.to_path_buf(), ..found })
    }

    /// The gap that was kept.
    pub(super) fn gap(&self) -> Result<Vec<f64>> {
        self.field(&self.gap)
    }

    fn field(&self, name: &str) -> Result<Vec<f64>> {
        let path = self.folder.join(name);
        let field = npy::read(&path)?;
        if (field.nx, field.ny) != (self.nx, self.ny) {
            let found = format!("{} x {} values", field.nx, field.ny);
            return Err(Error::format(&path, found, format!("{} x {}, as its checkpoint says", self.nx, self.ny)));
        }
        Ok(field.values)
    }

    /// Puts a run where this one was.
    pub(super) fn resume(&self, run: &mut dyn Run) -> Result<()> {
        let gap = self.gap()?;
        match &self.progress {
            Value::Null => {
                run.set_gap(&gap);
                Ok(())
            }
            progress => run.resume(SolverSnapshot {
                grid: Grid::unit(self.nx, self.ny),
                gap,
                auxiliary: self.auxiliary.as_deref().map(|name| self.field(name)).transpose()?,
                progress: progress.clone(),
            }),
        }
    }
}

/// Writes checkpoints into a folder.
pub struct CheckpointWriter {
    folder: PathBuf,
    stem: String,
    key: String,
    inner: Mutex<Inner>,
}

struct Inner {
    finished: Vec<Value>,
    /// When the next one is due.
    due: Instant,
    /// Checkpoints written so far: each has files of its own, so that the one before is whole until the next one is.
    count: usize,
    error: Option<Error>,
    /// Whether the load at hand has been kept.
    kept: bool,
}

impl CheckpointWriter {
    /// Writes `STEM.json` and its fields.
    pub fn new(folder: &Path, stem: &str, key: String, finished: Vec<Value>) -> Self {
        // The file of the checkpoint that is gone on from stays until the next one is whole.
        let first = Checkpoint::find(folder, stem, &key).is_some_and(|c| c.gap.ends_with("-0.npy"));
        let inner =
            Inner { finished, due: Instant::now() + EVERY, count: usize::from(first), error: None, kept: false };
        CheckpointWriter { folder: folder.to_path_buf(), stem: stem.into(), key, inner: Mutex::new(inner) }
    }

    fn inner(&self) -> std::sync::MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// For [`Observer::snapshot_due`].
    pub fn is_due(&self) -> bool {
        Instant::now() >= self.inner().due
    }

    /// A load is done.
    pub fn load_finished(&self, result: Value) {
        let mut inner = self.inner();
        inner.finished.push(result);
        inner.kept = false;
    }

    /// The path stopped in a load whose method has offered no snapshot: its gap is kept.
    pub fn write_interrupted(&self, grid: Grid, state: &State) {
        let kept = self.inner().kept;
        if !kept {
            self.write(&SnapshotRef { grid, gap: state.gap, auxiliary: None, progress: Value::Null });
        }
    }

    /// What went wrong with writing, once.
    pub fn take_error(&self) -> Option<Error> {
        self.inner().error.take()
    }

    /// For [`Observer::snapshot`]. A file that cannot be written is reported by [`CheckpointWriter::take_error`] and does not end the solve.
    pub fn write(&self, snapshot: &SnapshotRef) {
        let clock = Instant::now();
        let mut inner = self.inner();
        let turn = inner.count % 2;
        let Grid { nx, ny, .. } = snapshot.grid;
        let field_to = |name: &str, field| npy::write_field(&self.folder.join(name), nx, ny, field, 1.0);
        let gap = format!("{}-{turn}.npy", self.stem);
        let auxiliary = snapshot.auxiliary.map(|field| (format!("{}-auxiliary-{turn}.npy", self.stem), field));
        let written = field_to(&gap, snapshot.gap).and_then(|()| match &auxiliary {
            Some((name, field)) => field_to(name, *field),
            None => Ok(()),
        });
        let checkpoint = Checkpoint {
            key: self.key.clone(),
            finished: inner.finished.clone(),
            nx,
            ny,
            gap,
            auxiliary: auxiliary.map(|(name, _)| name),
            progress: snapshot.progress.clone(),
            folder: PathBuf::new(),
        };
        match written.and_then(|()| json::write(&self.folder.join(format!("{}.json", self.stem)), &checkpoint)) {
            // Where this one failed, the next one takes its turn: the files that the last whole one names are not touched.
            Ok(()) => (inner.kept, inner.count) = (true, inner.count + 1),
            Err(e) => inner.error = Some(e),
        }
        inner.due = Instant::now() + EVERY.max(SHARE * clock.elapsed());
    }

    /// The path is done: nothing is to go on from.
    pub fn remove_files(&self) {
        for end in [".json", "-0.npy", "-1.npy", "-auxiliary-0.npy", "-auxiliary-1.npy"] {
            // What is not there need not go.
            let _ = std::fs::remove_file(self.folder.join(format!("{}{end}", self.stem)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Result;
    use crate::grid::Field;
    use crate::method::Load;

    /// Takes up what was kept.
    #[derive(Default)]
    struct Taken(Option<SolverSnapshot>);

    impl Run for Taken {
        fn equilibrate(&mut self, _: Load) -> Result<State<'_>> {
            unreachable!("nothing is solved here")
        }

        fn resume(&mut self, kept: SolverSnapshot) -> Result<()> {
            self.0 = Some(kept);
            Ok(())
        }

        fn set_gap(&mut self, _: &[f64]) {
            unreachable!("a snapshot is more than a gap")
        }
    }

    fn taken(folder: &Path) -> SolverSnapshot {
        let mut run = Taken::default();
        Checkpoint::find(folder, "c", "key").expect("a checkpoint").resume(&mut run).expect("whole");
        run.0.expect("taken up")
    }

    /// Both fields are those of the last checkpoint that was written whole, also after one that could not be; and all go in the end.
    #[test]
    fn both_fields_are_of_the_last_whole_checkpoint() {
        let folder = tempfile::tempdir().unwrap();
        let writer = CheckpointWriter::new(folder.path(), "c", "key".into(), Vec::new());
        let keep = |n: f64| {
            let (gap, auxiliary) = ([n, n + 0.1], [n + 0.2, n + 0.3]);
            writer.write(&SnapshotRef {
                grid: Grid::unit(2, 1),
                gap: Field::F64(&gap),
                auxiliary: Some(Field::F64(&auxiliary)),
                progress: Value::from(n),
            });
        };
        let is = |n: f64| {
            let SolverSnapshot { gap, auxiliary, progress, .. } = taken(folder.path());
            assert_eq!((gap, auxiliary, progress), (vec![n, n + 0.1], Some(vec![n + 0.2, n + 0.3]), Value::from(n)));
        };
        keep(1.0);
        is(1.0);
        keep(2.0);
        is(2.0);
        // A folder in place of a file cannot be written over.
        let first = folder.path().join("c-auxiliary-0.npy");
        std::fs::remove_file(&first).unwrap();
        std::fs::create_dir(&first).unwrap();
        for n in [3.0, 4.0] {
            keep(n);
            assert!(writer.take_error().is_some());
            is(2.0);
        }
        std::fs::remove_dir(&first).unwrap();
        keep(5.0);
        is(5.0);
        writer.remove_files();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
