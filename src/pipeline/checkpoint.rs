//! Checkpoints of load paths.

use crate::{Error, Result};
use asperity_contact::method::{Equilibrium, SnapshotRef, SolverSnapshot};
use asperity_contact::path::{InitialState, is_subsurface_map};
use asperity_grid::sys::ranks::{ALONE, Ranks};
use asperity_grid::{Grid, sharing};
use asperity_surface::files::atomic_file::remove;
use asperity_surface::files::hashed::{self, FileHash, Stored};
use asperity_surface::files::npy;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Shortest interval between checkpoints; it is longer if writing would take more than a twentieth of the time.
const EVERY: Duration = Duration::from_secs(60);
const SHARE: u32 = 20;

/// Files of a path of one load, besides its maps of the stress below the surface.
const OF_ONE_LOAD: [&str; 6] =
    ["gap.npy", "plastic.npy", "stress.npy", "elastic-stress.npy", "contact.npy", "solve.json"];

/// State of an interrupted path.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Checkpoint {
    /// Identifies problem and load path; a checkpoint with another key is ignored.
    key: String,
    /// Results of the finished loads, in the caller's format.
    pub finished: Vec<Value>,
    nx: usize,
    ny: usize,
    /// File of the gap `[ny, nx]`, in the same folder.
    gap: String,
    /// File of the auxiliary field of the method, if it has one.
    #[serde(default)]
    auxiliary: Option<String>,
    /// File of the plastic displacement of the loads before, if there was any.
    #[serde(default)]
    plastic: Option<String>,
    /// Internal state of the method; `null` if the solve of the current load restarts from the gap.
    progress: Value,
    #[serde(skip)]
    folder: PathBuf,
}

impl Checkpoint {
    /// Reads `STEM.json` in `folder` if it exists and has this key. A damaged one is not used; `warn` is called with the reason.
    pub fn find(folder: &Path, stem: &str, key: &str, warn: &dyn Fn(&str)) -> Option<Checkpoint> {
        match hashed::read::<Checkpoint>(&folder.join(format!("{stem}.json")), true) {
            Stored::Valid(found) if found.key == key => Some(Checkpoint { folder: folder.to_path_buf(), ..found }),
            Stored::Damaged(what) => {
                warn(&format!("{what}; the loads are solved from the first"));
                None
            }
            Stored::Valid(_) | Stored::Absent => None,
        }
    }

    /// As [`Checkpoint::find`], without reading the files that it names.
    pub fn unverified(folder: &Path, stem: &str, key: &str) -> Option<Checkpoint> {
        let checkpoint = hashed::read::<Checkpoint>(&folder.join(format!("{stem}.json")), false).valid();
        checkpoint.filter(|c| c.key == key).map(|c| Checkpoint { folder: folder.to_path_buf(), ..c })
    }

    /// Whether `STEM.json` in `folder` is the checkpoint of another path than that of `key`.
    pub fn is_of_another(folder: &Path, stem: &str, key: &str) -> bool {
        let checkpoint = hashed::read::<Checkpoint>(&folder.join(format!("{stem}.json")), false).valid();
        checkpoint.is_some_and(|c| c.key != key)
    }

    /// The rows of this rank.
    fn field(&self, name: &str, ranks: &Ranks) -> Result<Vec<f64>> {
        let path = self.folder.join(name);
        let reader = npy::NpyReader::open(&path)?;
        if (reader.nx, reader.ny) != (self.nx, self.ny) {
            let found = format!("{} x {} values", reader.nx, reader.ny);
            return Err(Error::format(&path, found, format!("{} x {}, as its checkpoint says", self.nx, self.ny)));
        }
        reader.rows(ranks.share(self.ny))
    }

    /// The stored state on these ranks.
    pub fn begin(&self, ranks: &Ranks) -> Result<InitialState> {
        let grid = Grid::unit(self.nx, self.ny);
        let rows = if self.progress.is_null() { &ALONE } else { sharing(ranks, grid) };
        let whole = |name: &Option<String>| name.as_deref().map(|name| self.field(name, &ALONE)).transpose();
        let snapshot = SolverSnapshot {
            grid,
            gap: self.field(&self.gap, rows)?,
            auxiliary: whole(&self.auxiliary)?,
            plastic: whole(&self.plastic)?,
            progress: self.progress.clone(),
        };
        Ok(InitialState::Snapshot { finished: self.finished.len(), snapshot: Box::new(snapshot) })
    }
}

impl WriterState {
    /// Adds the files of finished loads that are not listed yet. Those of later loads may come from an earlier attempt.
    fn list_fields(&mut self, folder: &Path, prefix: &str) -> Result<()> {
        let listed = |name: &str| self.fields.iter().any(|f| f.name == name);
        let finished = |name: &str| {
            let Some(own) = name.strip_prefix(prefix) else { return false };
            let number = own.strip_prefix("load-").and_then(|l| l.split('-').next()).and_then(|n| n.parse().ok());
            // The files of a single load have no number.
            let number = number.or((OF_ONE_LOAD.contains(&own) || is_subsurface_map(own)).then_some(1));
            number.is_some_and(|n: usize| n <= self.finished.len())
        };
        let new = hashed::hashes(folder, &|name| finished(name) && !listed(name))?;
        self.fields.extend(new);
        Ok(())
    }
}

/// Writes checkpoints into a folder. On several ranks each writes its rows of shared grids, and the first all else; every rank has a writer
/// of the same files, whose calls are collective.
pub struct CheckpointWriter {
    ranks: Ranks,
    folder: PathBuf,
    stem: String,
    key: String,
    inner: Mutex<WriterState>,
}

struct WriterState {
    finished: Vec<Value>,
    /// Files of the finished loads, which a continued path does not write again.
    fields: Vec<FileHash>,
    /// Time from which the next checkpoint is due.
    due: Instant,
    /// Number of checkpoints written. File names alternate, so that the previous checkpoint stays complete while the
    /// next is written.
    count: usize,
    error: Option<Error>,
    /// Whether a checkpoint of the current load has been written.
    kept: bool,
}

impl CheckpointWriter {
    /// A writer of `STEM.json` and its fields.
    pub fn new(folder: &Path, stem: &str, key: String, finished: Vec<Value>) -> Self {
        // The checkpoint that a run continues from is not overwritten before the next one is complete.
        let first = Checkpoint::unverified(folder, stem, &key).is_some_and(|c| c.gap.ends_with("-0.npy"));
        let inner = WriterState {
            finished,
            fields: Vec::new(),
            due: Instant::now() + EVERY,
            count: usize::from(first),
            error: None,
            kept: false,
        };
        CheckpointWriter {
            ranks: Ranks::default(),
            folder: folder.to_path_buf(),
            stem: stem.into(),
            key,
            inner: Mutex::new(inner),
        }
    }

    /// The writer of one of several ranks.
    pub fn on(self, ranks: &Ranks) -> Self {
        CheckpointWriter { ranks: ranks.clone(), ..self }
    }

    fn inner(&self) -> std::sync::MutexGuard<'_, WriterState> {
        self.inner.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// For [`Observer::snapshot_due`].
    pub fn is_due(&self) -> bool {
        Instant::now() >= self.inner().due
    }

    /// Adds the result of a finished load.
    pub fn load_finished(&self, result: Value) {
        let mut inner = self.inner();
        inner.finished.push(result);
        inner.kept = false;
    }

    /// Writes the gap of an interrupted load if its method has provided no snapshot.
    pub fn write_interrupted(&self, grid: Grid, state: &Equilibrium) {
        let kept = self.ranks.first_says(self.inner().kept.into()) == 1;
        if !kept {
            let Equilibrium { ranks, gap, plastic, .. } = *state;
            self.write(&SnapshotRef { grid, ranks, gap, auxiliary: None, plastic, progress: Value::Null });
        }
    }

    /// The last error of writing; later calls return `None` until another write fails.
    pub fn take_error(&self) -> Option<Error> {
        self.inner().error.take()
    }

    /// For [`Observer::snapshot`]. A file that cannot be written is reported by [`CheckpointWriter::take_error`] and
    /// does not end the solve.
    pub fn write(&self, snapshot: &SnapshotRef) {
        let clock = Instant::now();
        let mut inner = self.inner();
        let turn = self.ranks.first_says((inner.count % 2) as u8);
        let Grid { nx, ny, .. } = snapshot.grid;
        let field_to = |name: &str, field| {
            npy::write_field_on_ranks(snapshot.ranks, &self.folder.join(name), [nx, ny], field, 1.0)
        };
        let gap = format!("{}-{turn}.npy", self.stem);
        let auxiliary = snapshot.auxiliary.map(|field| (format!("{}-auxiliary-{turn}.npy", self.stem), field));
        let plastic = snapshot.plastic.map(|field| (format!("{}-plastic-{turn}.npy", self.stem), field));
        let mut more = auxiliary.iter().chain(&plastic);
        if !self.ranks.is_first() && !snapshot.ranks.are_several() {
            return;
        }
        let written =
            field_to(&gap, snapshot.gap).and_then(|()| more.try_for_each(|(name, field)| field_to(name, *field)));
        if !self.ranks.is_first() {
            // The first has the error of every rank.
            return;
        }
        let checkpoint = Checkpoint {
            key: self.key.clone(),
            finished: inner.finished.clone(),
            nx,
            ny,
            gap,
            auxiliary: auxiliary.map(|(name, _)| name),
            plastic: plastic.map(|(name, _)| name),
            progress: snapshot.progress.clone(),
            folder: PathBuf::new(),
        };
        let prefix = self.stem.trim_end_matches("checkpoint");
        let written = written.and_then(|()| inner.list_fields(&self.folder, prefix));
        let own = [Some(&checkpoint.gap), checkpoint.auxiliary.as_ref(), checkpoint.plastic.as_ref()];
        let stored = written.and_then(|()| {
            let hash = |name: &String| FileHash::of(&self.folder, name);
            let mut files = own.into_iter().flatten().map(hash).collect::<Result<Vec<_>>>()?;
            files.extend(inner.fields.iter().cloned());
            hashed::write(&self.folder.join(format!("{}.json", self.stem)), &checkpoint, &files)
        });
        match stored {
            // After a failed write the next checkpoint uses the same file names; the files of the last complete one are
            // not overwritten.
            Ok(()) => (inner.kept, inner.count) = (true, inner.count + 1),
            Err(e) => inner.error = Some(e),
        }
        inner.due = Instant::now() + EVERY.max(SHARE * clock.elapsed());
    }

    /// Removes all checkpoint files after the end of the path.
    pub fn remove_files(&self) {
        let fields =
            ["", "-auxiliary", "-plastic"].into_iter().flat_map(|kind| [0, 1].map(|turn| format!("{kind}-{turn}.npy")));
        for end in fields.chain([".json".to_string()]) {
            // Missing files are not an error.
            let _ = remove(&self.folder.join(format!("{}{end}", self.stem)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_grid::Field;

    fn taken(folder: &Path) -> SolverSnapshot {
        let checkpoint = Checkpoint::find(folder, "c", "key", &|w| panic!("{w}")).expect("a checkpoint");
        match checkpoint.begin(&ALONE).expect("whole") {
            InitialState::Snapshot { snapshot, .. } => *snapshot,
            InitialState::Gap(_) => unreachable!("a snapshot is more than a gap"),
        }
    }

    /// One byte of a file of a finished load, of those that a path of one load has before its pull-off, of a field, and of the
    /// checkpoint itself.
    #[test]
    fn a_damaged_checkpoint_is_not_used() {
        let of_one_load = ["gap.npy", "stress.npy", "von-mises-depth-1.npy", "shear-depth-12.npy"];
        let others = ["load-1-gap.npy", "load-1-shear-depth-1.npy", "checkpoint-0.npy", "checkpoint.json"];
        for damaged in of_one_load.into_iter().chain(others) {
            let folder = tempfile::tempdir().unwrap();
            let path = |name: &str| folder.path().join(name);
            let field = Field::F64(&[1.0, 2.0]);
            let snapshot = SnapshotRef {
                grid: Grid::unit(2, 1),
                ranks: &ALONE,
                gap: field,
                auxiliary: None,
                plastic: None,
                progress: Value::Null,
            };
            let writer = CheckpointWriter::new(folder.path(), "checkpoint", "key".into(), Vec::new());
            let numbered = ["load-1-gap.npy", "load-1-shear-depth-1.npy", "load-2-gap.npy"];
            for name in of_one_load.into_iter().chain(numbered) {
                npy::write_field(&path(name), 2, 1, field, 1.0).unwrap();
            }
            writer.load_finished(Value::from(1));
            writer.write(&snapshot);
            assert!(writer.take_error().is_none());
            let find = || {
                let heard = std::cell::RefCell::new(Vec::new());
                let actual =
                    Checkpoint::find(folder.path(), "checkpoint", "key", &|w| heard.borrow_mut().push(w.to_string()));
                (actual.is_some(), heard.into_inner())
            };
            // The second load is of an earlier attempt, and is solved again.
            std::fs::remove_file(path("load-2-gap.npy")).unwrap();
            assert_eq!(find(), (true, vec![]));
            assert!(Checkpoint::is_of_another(folder.path(), "checkpoint", "other"));
            let mut bytes = std::fs::read(path(damaged)).unwrap();
            let middle = bytes.len() / 2;
            bytes[middle] ^= 1;
            std::fs::write(path(damaged), bytes).unwrap();
            let (actual, heard) = find();
            assert!(!actual && heard.len() == 1 && heard[0].contains(damaged), "{heard:?}");
            assert!(!damaged.ends_with("json") || !Checkpoint::is_of_another(folder.path(), "checkpoint", "other"));
        }
    }

    /// After a failed write both fields are still those of the last complete checkpoint. At the end all files are
    /// removed.
    #[test]
    fn both_fields_are_of_the_last_whole_checkpoint() {
        let folder = tempfile::tempdir().unwrap();
        let writer = CheckpointWriter::new(folder.path(), "c", "key".into(), Vec::new());
        let keep = |n: f64| {
            let (gap, auxiliary) = ([n, n + 0.1], [n + 0.2, n + 0.3]);
            writer.write(&SnapshotRef {
                grid: Grid::unit(2, 1),
                ranks: &ALONE,
                gap: Field::F64(&gap),
                auxiliary: Some(Field::F64(&auxiliary)),
                plastic: None,
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
        // A directory with the name of the file makes writing fail.
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
