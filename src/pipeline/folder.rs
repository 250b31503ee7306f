use super::Listener;
use crate::grid::transformed_nodes;
use crate::record::json;
use crate::record::results::StageCost;
use crate::{Error, Result, sys};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Raised when what a stage writes changes its meaning, so that older folders are not taken for done.
const FORMAT: u32 = 2;

/// Locked while a run uses a folder, and the mark of a run folder.
const MARKER: &str = ".asperity";

/// What a stage depends on, hashed: its name, the resolved parameters it reads, the keys of the stages before it, and
/// the contents of its input files. Never times.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Key(String);

impl Key {
    /// `parameters` is hashed as canonical JSON (fields in the order of their declaration).
    pub fn new(stage: &str, parameters: &impl Serialize, after: &[&Key]) -> Result<Key> {
        let text = serde_json::to_string(parameters)
            .map_err(|e| Error::format("stage parameters", e, "values that JSON can hold"))?;
        let mut hasher = blake3::Hasher::new();
        for part in [stage, &FORMAT.to_string(), env!("CARGO_PKG_VERSION"), &text] {
            hasher.update(part.as_bytes()).update(&[0]);
        }
        for key in after {
            hasher.update(key.0.as_bytes()).update(&[0]);
        }
        Ok(Key(hasher.finalize().to_hex().to_string()))
    }

    /// The key as text, distinguished by `tag` from others of the same stage.
    pub fn with(&self, tag: &str) -> String {
        format!("{} {tag}", self.0)
    }

    /// Hash of a file's contents, to be part of the parameters.
    pub fn of_file(path: &Path) -> Result<String> {
        let mut hasher = blake3::Hasher::new();
        let file = File::open(path).map_err(Error::io("read", path))?;
        hasher.update_reader(file).map_err(Error::io("read", path))?;
        Ok(hasher.finalize().to_hex().to_string())
    }

    /// Hash of the running program, for stages whose results another build may change.
    pub fn of_program() -> Result<String> {
        let program = std::env::current_exe().map_err(Error::io("find", "this program"))?;
        Self::of_file(&program)
    }
}

/// Digits of a key that people are shown.
const KEY_SHOWN: usize = 12;

/// Whether what an earlier attempt left behind is of use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResumePolicy<'a> {
    Restart,
    /// If the attempt was at this key, which may depend on less than the stage's own.
    ContinueFrom(&'a Key),
}

#[derive(Serialize, Deserialize)]
struct Done {
    key: String,
    /// All attempts together, and those before the last one.
    seconds: f64,
    #[serde(default)]
    earlier_seconds: f64,
    peak_rss_bytes: u64,
    #[serde(default)]
    transformed_nodes: u64,
}

/// Seconds that stopped attempts have spent on what a stage folder holds.
const SPENT: &str = "spent.json";
const KEY: &str = "key.json";
const DONE: &str = "done.json";

/// The folder of one run, locked for as long as this value lives.
pub struct RunFolder {
    root: PathBuf,
    pub costs: Vec<StageCost>,
    _lock: File,
}

impl RunFolder {
    /// Creates the folder if need be and locks it; a second run in the same folder is refused.
    pub fn open(root: &Path) -> Result<Self> {
        fs::create_dir_all(root).map_err(Error::io("create the run folder", root))?;
        let path = root.join(MARKER);
        // Stages clear their folders: they must not meet folders that somebody else made.
        let mut entries = fs::read_dir(root).map_err(Error::io("read the run folder", root))?;
        if !path.exists() && entries.next().is_some() {
            let accepted = "a new or empty folder, or that of an earlier run";
            return Err(Error::input(root.display(), "--out", "a folder with other contents", accepted));
        }
        Self::lock(root)
    }

    /// Locks a folder that is known to be a run's.
    pub fn lock(root: &Path) -> Result<Self> {
        let path = root.join(MARKER);
        let lock = File::create(&path).map_err(Error::io("write in the run folder", &path))?;
        let taken = |_| Error::format(root, "in use by another run", "a folder that no other run is using");
        lock.try_lock().map_err(taken)?;
        Ok(RunFolder { root: root.to_path_buf(), costs: Vec::new(), _lock: lock })
    }

    pub fn path(&self) -> &Path {
        &self.root
    }

    /// Whether a stage is done.
    pub fn holds(&self, name: &str, key: &Key) -> bool {
        json::read::<Done>(&self.root.join(name).join(DONE)).is_ok_and(|done| done.key == key.0)
    }

    /// Runs a stage in its folder, or reads what it gave when its key is done already.
    pub fn stage<T: Serialize + DeserializeOwned>(
        &mut self,
        listener: &dyn Listener,
        (name, what): (&str, &str),
        key: &Key,
        policy: ResumePolicy<'_>,
        work: impl FnOnce(&Path) -> Result<T>,
    ) -> Result<T> {
        let folder = self.root.join(name);
        let (done_file, key_file, output_file) = (folder.join(DONE), folder.join(KEY), folder.join("output.json"));
        if let Ok(done) = json::read::<Done>(&done_file)
            && done.key == key.0
            && let Ok(output) = json::read::<T>(&output_file)
        {
            self.finish(listener, name, &done, true);
            return Ok(output);
        }
        let kept = match policy {
            ResumePolicy::Restart => key,
            ResumePolicy::ContinueFrom(part) => part,
        };
        let same = json::read::<String>(&key_file).is_ok_and(|k| k == kept.0);
        if folder.exists() && !(same && policy != ResumePolicy::Restart) {
            fs::remove_dir_all(&folder).map_err(Error::io("clear", &folder))?;
        }
        fs::create_dir_all(&folder).map_err(Error::io("create", &folder))?;
        let earlier = spent(&folder);
        json::write(&folder.join(SPENT), &earlier)?;
        // Its time is when this attempt began.
        json::write(&key_file, &kept.0)?;
        // From here on the folder's contents are no longer those of another key.
        if done_file.exists() {
            fs::remove_file(&done_file).map_err(Error::io("remove", &done_file))?;
        }
        if listener.stopping() {
            return Err(Error::Interrupted);
        }
        listener.begin(name, what);
        sys::reset_peak_rss();
        let children_before = sys::children_peak_rss_bytes();
        let (clock, before) = (Instant::now(), transformed_nodes());
        let output = work(&folder)?;
        // The kernel reports the largest child so far: one of this stage, if the number has risen.
        let child = Some(sys::children_peak_rss_bytes()).filter(|c| *c > children_before).unwrap_or(0);
        let done = Done {
            key: key.0.clone(),
            seconds: earlier + clock.elapsed().as_secs_f64(),
            earlier_seconds: earlier,
            peak_rss_bytes: sys::peak_rss_bytes().max(child),
            transformed_nodes: transformed_nodes() - before,
        };
        json::write(&output_file, &output)?;
        json::write(&done_file, &done)?;
        self.finish(listener, name, &done, false);
        Ok(output)
    }

    fn finish(&mut self, listener: &dyn Listener, name: &str, done: &Done, reused: bool) {
        let cost = StageCost {
            name: name.into(),
            key: done.key.get(..KEY_SHOWN).unwrap_or(&done.key).into(),
            seconds: done.seconds,
            earlier_seconds: done.earlier_seconds,
            peak_rss_bytes: done.peak_rss_bytes,
            transformed_nodes: done.transformed_nodes,
            reused,
        };
        listener.end(&cost);
        self.costs.push(cost);
    }
}

/// What went into a stage folder before this attempt, seconds. A killed attempt leaves no word of its end: it is the time
/// of its last file, less that of its key, with which it began.
fn spent(folder: &Path) -> f64 {
    if let Ok(done) = json::read::<Done>(&folder.join(DONE)) {
        return done.seconds;
    }
    let written = |path: &Path| fs::metadata(path).and_then(|m| m.modified()).ok();
    let Some(begun) = written(&folder.join(KEY)) else { return 0.0 };
    let files = fs::read_dir(folder).into_iter().flatten().flatten();
    let last = files.filter_map(|f| written(&f.path())).max().unwrap_or(begun);
    let earlier = json::read::<f64>(&folder.join(SPENT)).unwrap_or(0.0);
    earlier + last.duration_since(begun).map_or(0.0, |d| d.as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::Silent;

    /// A stopped attempt counts from its key to its last file; what is done counts as it says.
    #[test]
    fn a_stage_that_goes_on_costs_the_sum_of_its_parts() {
        let scratch = tempfile::tempdir().expect("scratch");
        let mut run = RunFolder::open(&scratch.path().join("run")).expect("a new folder");
        let key = |text: &str| Key::new("ladder", &text, &[]).expect("a key");
        let (part, first, second) = (key("part"), key("first"), key("second"));
        let stage = |run: &mut RunFolder, key: &Key, fails: bool| {
            run.stage(&Silent, ("ladder", "steps"), key, ResumePolicy::ContinueFrom(&part), |folder| {
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
        // Another end of the same ladder goes on from what is there.
        stage(&mut run, &second, false).expect("done");
        let more = run.costs.last().expect("two").clone();
        assert!(more.earlier_seconds == cost.seconds && !more.reused, "{more:?}");
        // Nothing of another ladder is left.
        let other = key("other");
        run.stage(&Silent, ("ladder", "steps"), &other, ResumePolicy::Restart, |_| Ok(0)).expect("done");
        assert_eq!(run.costs.last().expect("three").earlier_seconds, 0.0);
    }

    /// Stages clear their folders; a folder that somebody else filled is refused before anything in it is touched.
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
}
