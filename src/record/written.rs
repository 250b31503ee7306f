//! The one reader of finished folders for the report, comparisons, sweeps, Python and Rust: files are used as the command wrote them, or
//! refused with the remedy.

use super::results::{self, Results};
use super::{ensemble, tradeoff};
use asperity_grid::error::{Error, Result};
use asperity_surface::files::atomic_file::expect_to_hold;
use asperity_surface::files::hashed::{self, CHECKSUMS, DONE_FILE, FileHash, Stored};
use asperity_surface::files::inside::{expect_plain, expect_plain_in, inside};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What is accepted in place of a damaged file, and the remedy.
const AS_WRITTEN: &str = "a file as the run wrote it; the command that made the folder computes again what is damaged";

/// Keys of results that name a field or a frame, besides those that end with `_map`.
const NAMES: [&str; 4] = ["heights", "map", "frame", "compliant_wall_gap"];

/// A folder that a run, a trade-off or a sweep has finished.
#[derive(Debug, Clone)]
pub struct WrittenFolder {
    root: PathBuf,
    /// Files of the stages, by their path in the folder.
    files: BTreeMap<String, FileHash>,
}

impl WrittenFolder {
    /// The folder of a run, with its results. Fields are verified when they are used ([`WrittenFolder::file`]).
    ///
    /// # Errors
    /// `Format` for a folder without results, those of another schema or changed ones, a field that they name and no stage lists, and
    /// anything but files and folders in it.
    pub fn run(root: &Path) -> Result<(WrittenFolder, Results)> {
        if root.join(results::FILE).symlink_metadata().is_ok() {
            expect_plain(root)?;
            unchanged(root, results::FILE)?;
        }
        let results = Results::read(root)?;
        let folder = WrittenFolder::stages(root)?;
        folder.named(&results)?;
        Ok((folder, results))
    }

    /// The fields and frames that results name.
    ///
    /// # Errors
    /// `Format` for one that no stage lists.
    pub fn named(&self, results: &Results) -> Result<Vec<String>> {
        let value =
            serde_json::to_value(results).map_err(|e| Error::format(self.root.join(results::FILE), e, "results"))?;
        let mut named = Vec::new();
        names_of_files(&value, &mut named);
        named.into_iter().map(|name| self.hash(name).map(|_| name.to_string())).collect()
    }

    /// Whether another folder lists the same contents under a name.
    pub fn is_same(&self, other: &WrittenFolder, name: &str) -> bool {
        self.files.get(name).is_some_and(|own| other.files.get(name) == Some(own))
    }

    /// The files of the complete stages of a folder.
    ///
    /// # Errors
    /// `Format` for a damaged list; `Io`.
    pub fn stages(root: &Path) -> Result<WrittenFolder> {
        Ok(WrittenFolder { root: root.to_path_buf(), files: files_of_stages(root)? })
    }

    /// The file, after its contents were compared with what its stage, or the list of the folder, says.
    ///
    /// # Errors
    /// `Format` for a file that nothing lists, or that changed.
    pub fn file(&self, name: &str) -> Result<PathBuf> {
        let path = inside(&self.root, results::FILE, name)?;
        if !name.contains('/') {
            return as_listed(&self.root, name).map(|()| path);
        }
        let (stage, hash) = self.hash(name)?;
        match hash.damage(&self.root.join(stage)) {
            Some(what) => Err(Error::format(&self.root, what, AS_WRITTEN)),
            None => Ok(path),
        }
    }

    /// Verifies the files of all stages.
    ///
    /// # Errors
    /// `Format`, which names the first file that is not as it was written.
    pub fn verify(&self) -> Result<()> {
        self.files.keys().try_for_each(|name| self.file(name).map(drop))
    }

    /// The stage of a file, and what it lists.
    fn hash<'a>(&self, name: &'a str) -> Result<(&'a str, &FileHash)> {
        inside(&self.root, results::FILE, name)?;
        let stage = name.split_once('/').map(|(stage, _)| stage);
        match stage.zip(self.files.get(name)) {
            Some(found) => Ok(found),
            None => {
                let found = format!("no {DONE_FILE} lists it, so that damage cannot be recognised");
                Err(Error::format(self.root.join(name), found, AS_WRITTEN))
            }
        }
    }
}

/// Verifies the table of a trade-off or a sweep.
///
/// # Errors
/// `Format` for a changed one, and for anything but files and folders in the folder.
pub fn expect_table(root: &Path, file: &str) -> Result<()> {
    debug_assert!([ensemble::FILE, tradeoff::FILE].contains(&file));
    expect_plain(root)?;
    unchanged(root, file)
}

/// Verifies the results of a folder, without its fields; `Some` with what is wrong, in words.
pub fn damage_of(root: &Path, file: &str) -> Option<String> {
    expect_plain_in(root, &[]).and_then(|()| unchanged(root, file)).err().map(|e| e.to_string())
}

/// Refuses a file outside the stages that differs from what the command listed, or that memory cannot hold.
///
/// # Errors
/// `Format`, which names the remedy; `Memory`.
pub fn unchanged(root: &Path, name: &str) -> Result<()> {
    expect_to_hold(&root.join(name))?;
    as_listed(root, name)
}

fn as_listed(root: &Path, name: &str) -> Result<()> {
    let found = match hashed::as_listed(root, name) {
        Some(true) => return Ok(()),
        Some(false) => "changed since the run wrote it".to_string(),
        None => format!("{CHECKSUMS} does not list it, so that damage cannot be recognised"),
    };
    Err(Error::format(root.join(name), found, AS_WRITTEN))
}

fn files_of_stages(root: &Path) -> Result<BTreeMap<String, FileHash>> {
    let mut files = BTreeMap::new();
    for (stage, path) in asperity_surface::files::atomic_file::list(root)? {
        match hashed::listed(&path.join(DONE_FILE)) {
            Stored::Valid(list) => files.extend(list.into_iter().map(|f| (format!("{stage}/{}", f.name), f))),
            Stored::Damaged(what) => return Err(Error::format(root, what, AS_WRITTEN)),
            Stored::Absent => {}
        }
    }
    Ok(files)
}

/// Names of fields and frames in results.
fn names_of_files<'a>(value: &'a Value, names: &mut Vec<&'a str>) {
    match value {
        Value::Array(list) => list.iter().for_each(|v| names_of_files(v, names)),
        Value::Object(map) => {
            // Quantities that a method does not deliver have reasons in place of files.
            for (key, value) in map.iter().filter(|(key, _)| *key != "missing") {
                match value {
                    Value::String(text) if NAMES.contains(&key.as_str()) || key.ends_with("_map") => names.push(text),
                    _ => names_of_files(value, names),
                }
            }
        }
        _ => {}
    }
}
