use super::Listener;
use crate::record::results::{self, StageCost};
use crate::record::{ensemble, tradeoff};
use crate::{Error, Result};
use asperity_grid::sys;
use asperity_grid::transformed_nodes;
use asperity_surface::files::atomic_file::{create_folder, is_empty, list, remove, remove_folder, written_at};
use asperity_surface::files::beneath::create_folders;
use asperity_surface::files::hashed::{self, Stored, file_hash};
use asperity_surface::files::inside::expect_plain;
use asperity_surface::files::{file_lock, json, processes};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Version of the stage folders. An increase invalidates all older folders; it is required when the meaning of stored
/// results changes.
const FORMAT: u32 = 3;

/// Lock file of a run. Its presence also identifies a run folder.
const MARKER: &str = ".asperity";

/// Hash of everything that a stage depends on: its name, the versions of program and format, its resolved parameters,
/// the keys of earlier stages, and the contents of input files. Times are not included.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StageKey(String);

impl StageKey {
    /// `parameters` is hashed as JSON with fields in the order of their declaration.
    pub fn new(stage: &str, parameters: &impl Serialize, dependencies: &[&StageKey]) -> Result<StageKey> {
        let text = serde_json::to_string(parameters)
            .map_err(|e| Error::format("stage parameters", e, "values that JSON can hold"))?;
        let mut hasher = blake3::Hasher::new();
        for part in [stage, &FORMAT.to_string(), env!("CARGO_PKG_VERSION"), &text] {
            hasher.update(part.as_bytes()).update(&[0]);
        }
        for key in dependencies {
            hasher.update(key.0.as_bytes()).update(&[0]);
        }
        Ok(StageKey(hasher.finalize().to_hex().to_string()))
    }

    /// The key as text. `tag` distinguishes the load paths of one stage.
    pub fn with(&self, tag: &str) -> String {
        format!("{} {tag}", self.0)
    }

    /// Hash of a file's contents, for use as a parameter.
    pub fn of_file(path: &Path) -> Result<String> {
        file_hash(path)
    }

    /// Hash of the executable, for stages whose results may differ between builds.
    pub fn of_program() -> Result<String> {
        let program = std::env::current_exe().map_err(Error::io("find", "this program"))?;
        Self::of_file(&program)
    }
}

/// Displayed digits of a key.
const KEY_SHOWN: usize = 12;

#[derive(Serialize, Deserialize)]
struct StageRecord {
    key: String,
    /// Time of all attempts; `earlier_seconds` is that of all but the last.
    seconds: f64,
    #[serde(default)]
    earlier_seconds: f64,
    peak_rss_bytes: u64,
    #[serde(default)]
    transformed_nodes: u64,
}

/// Name of the file with the time of interrupted attempts in a stage folder, s.
const SPENT: &str = "spent.json";
const KEY: &str = "key.json";
const DONE: &str = hashed::DONE_FILE;

/// Files of a stage folder that its completion does not list: they describe attempts, or are the list itself.
const OF_ATTEMPTS: [&str; 3] = [DONE, KEY, SPENT];

/// A folder for results.
#[derive(Debug, Clone, Copy)]
pub struct OutFolder<'a> {
    pub path: &'a Path,
    /// Whether the files of finished stages are verified before they are reused.
    pub verify: bool,
    /// Whether results of another scene are replaced.
    pub overwrite: bool,
}

impl<'a> From<&'a Path> for OutFolder<'a> {
    fn from(path: &'a Path) -> Self {
        OutFolder { path, verify: true, overwrite: false }
    }
}

impl<'a> From<&'a PathBuf> for OutFolder<'a> {
    fn from(path: &'a PathBuf) -> Self {
        path.as_path().into()
    }
}

/// The folder of one run, locked during the lifetime of this value.
pub struct RunFolder {
    root: PathBuf,
    verify: bool,
    pub costs: Vec<StageCost>,
    _lock: File,
}

impl RunFolder {
    /// Creates the folder if it does not exist, and locks it.
    ///
    /// # Errors
    /// `Input` for a folder with other contents; `Format` if another run uses the folder; `Io`.
    pub fn open<'a>(folder: impl Into<OutFolder<'a>>) -> Result<Self> {
        let OutFolder { path: root, verify, .. } = folder.into();
        create_folders(root).map_err(Error::io("create the run folder", root))?;
        let path = root.join(MARKER);
        // Stages delete the contents of their subfolders, so a folder with other files is refused.
        if !path.exists() && !is_empty(root)? && !is_ours(root)? {
            let accepted = "a new or empty folder, or that of an earlier run";
            return Err(Error::input(root.display(), "--out", "a folder with other contents", accepted));
        }
        Ok(RunFolder { verify, ..Self::lock(root)? })
    }

    /// Locks an existing run folder.
    ///
    /// # Errors
    /// `Format` if another run uses the folder, or a link lies in it; `Io`.
    pub fn lock(root: &Path) -> Result<Self> {
        expect_plain(root)?;
        let path = root.join(MARKER);
        let lock = file_lock::open(&path).map_err(Error::io("write in the run folder", &path))?;
        if !file_lock::try_lock(&lock).map_err(Error::io("lock", &path))? {
            let holder = processes::with_file(&path).unwrap_or_else(|| "another run".into());
            let accepted = "a folder that no other run is using: wait for its end, or end it";
            return Err(Error::format(root, format!("in use by {holder}"), accepted));
        }
        Ok(RunFolder { root: root.to_path_buf(), verify: true, costs: Vec::new(), _lock: lock })
    }

    pub fn path(&self) -> &Path {
        &self.root
    }

    /// Whether the stage `name` is complete with this key, and its files are as they were written.
    pub fn is_complete(&self, name: &str, key: &StageKey) -> bool {
        let record = hashed::read::<StageRecord>(&self.root.join(name).join(DONE), self.verify);
        record.valid().is_some_and(|record| record.key == key.0)
    }

    /// Lists the files of a complete stage again, after they were written anew.
    pub(super) fn list_again(&self, name: &str) -> Result<()> {
        let folder = self.root.join(name);
        let file = folder.join(DONE);
        hashed::read::<StageRecord>(&file, false).valid().map_or(Ok(()), |record| write_done(&folder, &record))
    }

    /// Runs a stage in its subfolder, or reads its output if it is complete with this key and its files are as they
    /// were written. The files of a damaged stage are removed. `continues`: an interrupted attempt with this key, which may depend on
    /// fewer inputs than that of the stage, is continued.
    pub fn stage<T: Serialize + DeserializeOwned>(
        &mut self,
        listener: &dyn Listener,
        (name, description): (&str, &str),
        key: &StageKey,
        continues: Option<&StageKey>,
        work: impl FnOnce(&Path) -> Result<T>,
    ) -> Result<T> {
        let folder = self.root.join(name);
        let (done_file, key_file, output_file) = (folder.join(DONE), folder.join(KEY), folder.join("output.json"));
        let (mut earlier, mut damage) = (None, None);
        match hashed::read::<StageRecord>(&done_file, self.verify) {
            Stored::Valid(record) => earlier = Some(record),
            Stored::Damaged(description) => damage = Some(description),
            Stored::Absent => {}
        }
        if let Some(record) = earlier.filter(|record| record.key == key.0)
            && let Ok(output) = json::read::<T>(&output_file)
        {
            self.finish(listener, name, &record, true);
            return Ok(output);
        }
        if let Some(description) = &damage {
            listener.warn(&format!("{description}; the stage {name} is computed again"));
        }
        let kept = continues.unwrap_or(key);
        let same = damage.is_none() && json::read::<String>(&key_file).is_ok_and(|k| k == kept.0);
        if folder.exists() && !(same && continues.is_some()) {
            remove_folder(&folder)?;
        }
        create_folder(&folder)?;
        let earlier = spent(&folder);
        json::write(&folder.join(SPENT), &earlier)?;
        // The modification time of this file marks the start of the attempt.
        json::write(&key_file, &kept.0)?;
        // The completed result of another key is no longer valid.
        remove(&done_file)?;
        if listener.stopping() {
            return Err(Error::Interrupted);
        }
        listener.begin(name, description);
        sys::reset_peak_rss();
        let children_before = sys::children_peak_rss_bytes();
        let (clock, previous) = (Instant::now(), transformed_nodes());
        let output = work(&folder)?;
        // The kernel reports the peak of the largest child process so far. An increase comes from a child of this
        // stage.
        let child = Some(sys::children_peak_rss_bytes()).filter(|c| *c > children_before).unwrap_or(0);
        let record = StageRecord {
            key: key.0.clone(),
            seconds: earlier + clock.elapsed().as_secs_f64(),
            earlier_seconds: earlier,
            peak_rss_bytes: sys::peak_rss_bytes().max(child),
            transformed_nodes: transformed_nodes() - previous,
        };
        json::write(&output_file, &output)?;
        write_done(&folder, &record)?;
        self.finish(listener, name, &record, false);
        Ok(output)
    }

    fn finish(&mut self, listener: &dyn Listener, name: &str, record: &StageRecord, reused: bool) {
        let cost = StageCost {
            name: name.into(),
            key: record.key.get(..KEY_SHOWN).unwrap_or(&record.key).into(),
            seconds: record.seconds,
            earlier_seconds: record.earlier_seconds,
            peak_rss_bytes: record.peak_rss_bytes,
            transformed_nodes: record.transformed_nodes,
            reused,
        };
        listener.end(&cost);
        self.costs.push(cost);
    }
}

/// Marks a stage as complete, with the hashes of its files.
fn write_done(folder: &Path, record: &StageRecord) -> Result<()> {
    let files = hashed::hashes(folder, &|name| !OF_ATTEMPTS.contains(&name))?;
    hashed::write(&folder.join(DONE), record, &files)
}

/// Whether a folder without a marker holds what this program wrote: a stage that is complete, results as they are listed, or a point of
/// a sweep.
fn is_ours(root: &Path) -> Result<bool> {
    let tables = [results::FILE, ensemble::FILE, tradeoff::FILE];
    if holds_a_stage(root)? || tables.iter().any(|file| hashed::as_listed(root, file) == Some(true)) {
        return Ok(true);
    }
    let points = list(&root.join("points")).unwrap_or_default().into_iter().map(|(_, point)| point);
    Ok(points.into_iter().any(|point| point.join(MARKER).exists() || holds_a_stage(&point).unwrap_or(false)))
}

/// Whether a folder without a marker holds a stage that this program completed.
fn holds_a_stage(root: &Path) -> Result<bool> {
    let is_stage = |folder: &Path| hashed::read::<StageRecord>(&folder.join(DONE), false).valid().is_some();
    Ok(list(root)?.iter().any(|(_, folder)| is_stage(folder)))
}

/// Time that earlier attempts spent on a stage folder, s. A killed attempt does not record its end: its time is the
/// difference between the modification times of its last file and of its key file.
fn spent(folder: &Path) -> f64 {
    if let Ok(record) = json::read::<StageRecord>(&folder.join(DONE)) {
        return record.seconds;
    }
    let Some(start) = written_at(&folder.join(KEY)) else { return 0.0 };
    let files = list(folder).unwrap_or_default();
    let last = files.iter().filter_map(|(_, file)| written_at(file)).max().unwrap_or(start);
    let earlier = json::read::<f64>(&folder.join(SPENT)).unwrap_or(0.0);
    earlier + last.duration_since(start).map_or(0.0, |d| d.as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::Silent;
    use std::fs;

    /// The time of an interrupted attempt is measured from its key file to its last file; a complete stage has a
    /// recorded time.
    #[test]
    fn a_stage_that_goes_on_costs_the_sum_of_its_parts() {
        let scratch = tempfile::tempdir().expect("scratch");
        let mut run = RunFolder::open(&scratch.path().join("run")).expect("a new folder");
        let key = |text: &str| StageKey::new("stage", &text, &[]).expect("a key");
        let (part, first, second) = (key("part"), key("first"), key("second"));
        let stage = |run: &mut RunFolder, key: &StageKey, fails: bool| {
            run.stage(&Silent, ("stage", "steps"), key, Some(&part), |folder| {
                let file = File::create(folder.join("steps")).expect("written");
                let later = std::time::SystemTime::now() + std::time::Duration::from_secs(100);
                file.set_modified(later).expect("dated");
                if fails { Err(Error::Interrupted) } else { Ok(0) }
            })
        };
        assert!(stage(&mut run, &first, true).is_err());
        assert!(stage(&mut run, &first, true).is_err());
        stage(&mut run, &first, false).expect("done");
        let cost = run.costs.last().expect("one").clone();
        assert!((cost.earlier_seconds - 200.0).abs() < 5.0 && cost.seconds >= cost.earlier_seconds, "{cost:?}");
        // A stage with another key and the same partial key continues the attempt.
        stage(&mut run, &second, false).expect("done");
        let more = run.costs.last().expect("two").clone();
        assert!(more.earlier_seconds == cost.seconds && !more.reused, "{more:?}");
        // A restart with another key discards earlier files.
        let other = key("other");
        run.stage(&Silent, ("stage", "steps"), &other, None, |_| Ok(0)).expect("done");
        assert_eq!(run.costs.last().expect("three").earlier_seconds, 0.0);
    }

    /// A folder with foreign files is refused, and its files are not changed.
    #[test]
    fn foreign_folders_are_refused_untouched() {
        let folder = tempfile::tempdir().expect("scratch");
        let mine = folder.path().join("surface/mine.txt");
        fs::create_dir_all(mine.parent().expect("has one")).expect("made");
        fs::write(&mine, "mine").expect("written");
        assert_eq!(RunFolder::open(folder.path()).err().map(|e| e.exit_code()), Some(2));
        assert!(mine.exists());
        let fresh = folder.path().join("fresh");
        drop(RunFolder::open(&fresh).expect("a new folder"));
        fs::write(fresh.join("results.json"), "{}").expect("written");
        assert!(RunFolder::open(&fresh).is_ok(), "its own folder again");
    }

    /// Keeps the warnings of a run.
    struct Warned(std::sync::Mutex<Vec<String>>);

    impl Listener for Warned {
        fn begin(&self, _: &str, _: &str) {}
        fn progress(&self, _: Option<f64>, _: &str) {}
        fn end(&self, _: &StageCost) {}
        fn warn(&self, text: &str) {
            self.0.lock().expect("no panic").push(text.into());
        }
        fn stopping(&self) -> bool {
            false
        }
    }

    /// A changed file of a complete stage, which a stage that continues would keep, leads to one warning and a new
    /// computation, also after the marker of the run folder was lost.
    #[test]
    fn damaged_stages_are_computed_again_with_one_warning() {
        let scratch = tempfile::tempdir().expect("scratch");
        let root = scratch.path().join("run");
        let key = StageKey::new("ladder", &"key", &[]).expect("a key");
        let computed = std::cell::Cell::new(0);
        let run = |verify: bool| {
            let heard = Warned(Default::default());
            let mut run = RunFolder::open(OutFolder { verify, ..OutFolder::from(&root) }).expect("its folder");
            let policy = Some(&key);
            let work = |folder: &Path| {
                assert!(!folder.join("field.npy").exists(), "the damaged file was kept");
                computed.set(computed.get() + 1);
                fs::write(folder.join("field.npy"), "field").map_err(Error::io("write", folder))?;
                Ok(7)
            };
            assert_eq!(run.stage(&heard, ("ladder", "steps"), &key, policy, work).expect("done"), 7);
            heard.0.into_inner().expect("no panic")
        };
        let field = root.join("ladder/field.npy");
        assert_eq!((run(true), computed.get()), (vec![], 1));
        assert_eq!((run(true), computed.get()), (vec![], 1));
        fs::write(&field, "fiold").expect("written");
        assert_eq!((run(false), computed.get()), (vec![], 1), "not verified on request");
        fs::remove_file(root.join(MARKER)).expect("removed");
        let heard = run(true);
        assert!(heard.len() == 1 && heard[0].contains("field.npy changed") && heard[0].contains("ladder"), "{heard:?}");
        assert_eq!(computed.get(), 2);
        fs::write(root.join("ladder/done.json"), "{").expect("written");
        let heard = run(true);
        assert!(heard.len() == 1 && heard[0].contains("done.json is damaged"), "{heard:?}");
    }
}
