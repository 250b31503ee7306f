//! The folder of a solve, and the results of a finished one, which the same command reports instead of solving again.

use crate::record::load_table;
use crate::scene::Scene;
use crate::{Error, Result};
use asperity_contact::path::is_subsurface_map;
use asperity_contact::problem::AccuracyResults;
use asperity_surface::files::atomic_file::{PARTIAL, create_folder, is_empty, list, remove, remove_folder};
use asperity_surface::files::hashed::{self, Stored};
use asperity_surface::files::inside::expect_plain;
use asperity_surface::files::{file_lock, json};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// Marks a folder that solves may clear.
const MARKER: &str = ".asperity-solve";

const FILE: &str = hashed::DONE_FILE;

/// Start of the names of folders with the solves of single grids.
pub(super) const GRID: &str = "grid-";

/// Files of a state, and of the pull-off.
const OF_STATES: [&str; 9] = [
    "gap.npy",
    "plastic.npy",
    "stress.npy",
    "elastic-stress.npy",
    "contact.npy",
    "solve.json",
    "pull-off.json",
    load_table::PULL_OFF_FILE,
    load_table::FILE,
];

/// The file of these that each report of the results writes again.
const REWRITTEN: &str = load_table::FILE;

#[derive(Serialize, Deserialize)]
pub(super) struct SolveCache {
    pub key: String,
    /// Scene of the solve, for the message about another one.
    #[serde(default)]
    pub scene: Value,
    /// Line of JSON of each load, and of the pull-off.
    pub states: Vec<Value>,
    pub pull_off: Option<Value>,
    /// The grids that were solved, where an accuracy was asked for.
    #[serde(default)]
    pub accuracy: Option<AccuracyResults>,
}

/// Creates the folder, if need be.
///
/// # Errors
/// If it contains files that no solve wrote.
pub(super) fn open(folder: &Path) -> Result<()> {
    create_folder(folder)?;
    let marker = folder.join(MARKER);
    let own = || marker.exists() || SolveCache::read(folder, false).valid().is_some();
    if !is_empty(folder)? && !own() {
        let found = format!("{} (contains files that no solve wrote)", folder.display());
        return Err(Error::input("command line", "--out", found, "a new or empty folder, or that of an earlier solve"));
    }
    expect_plain(folder)?;
    file_lock::open(&marker).map(drop).map_err(Error::io("write", &marker))
}

/// Removes the states of an earlier solve, whole or partial, except the gap from which this one starts.
pub(super) fn clear(folder: &Path, start: Option<&Path>) -> Result<()> {
    remove_grids(folder)?;
    clear_states(folder, start)
}

/// The same without the solves of single grids.
pub(super) fn clear_states(folder: &Path, start: Option<&Path>) -> Result<()> {
    SolveCache::forget(folder);
    let start = start.and_then(|file| fs::canonicalize(file).ok());
    for (name, path) in list(folder)? {
        let is_start = || start.is_some() && fs::canonicalize(&path).ok() == start;
        // What an interrupted write has left.
        if (is_result(&name) || name.starts_with(PARTIAL)) && !is_start() {
            remove(&path)?;
        }
    }
    Ok(())
}

/// Whether a name is that of a result, of whatever load.
pub(super) fn is_result(name: &str) -> bool {
    is_of_state(of_state(name.strip_prefix("partial-").unwrap_or(name)))
}

/// Removes the solves of single grids.
pub(super) fn remove_grids(folder: &Path) -> Result<()> {
    for (name, path) in list(folder)? {
        if name.starts_with(GRID) && path.join(MARKER).exists() {
            remove_folder(&path)?;
        }
    }
    Ok(())
}

/// Whether a name is that of a state's file, without the numbers of load and depth.
fn is_of_state(name: &str) -> bool {
    OF_STATES.contains(&name) || is_subsurface_map(name)
}

/// Name of a state's file without the number of its load.
fn of_state(name: &str) -> &str {
    let numbered = name.strip_prefix("load-").and_then(|remainder| remainder.split_once('-'));
    numbered.filter(|(n, _)| n.parse::<usize>().is_ok()).map_or(name, |(_, name)| name)
}

impl SolveCache {
    fn read(folder: &Path, verify: bool) -> Stored<SolveCache> {
        hashed::read(&folder.join(FILE), verify)
    }

    /// The results in a folder, if they have this key. Damaged ones are not used; `warn` is called with the reason.
    pub(super) fn find(folder: &Path, key: &str, verify: bool, warn: &dyn Fn(&str)) -> Option<SolveCache> {
        match Self::read(folder, verify) {
            Stored::Damaged(what) => {
                warn(&format!("{what}; solved again"));
                None
            }
            other => other.valid().filter(|cache| cache.key == key),
        }
    }

    /// What differs between the finished solve in a folder and this one, in words; `None` if there is none or it is the same.
    pub(super) fn difference(folder: &Path, key: &str, scene: &Scene) -> Result<Option<String>> {
        let Some(cache) = Self::read(folder, false).valid() else { return Ok(None) };
        // The key ends with the hash of the program: another build solves again.
        if cache.key.starts_with(key) {
            return Ok(None);
        }
        let now = serde_json::to_value(scene).map_err(|e| Error::format(folder, e, "values that JSON can hold"))?;
        let list = json::differences(&cache.scene, &now);
        Ok(Some(if list.is_empty() { "the contents of its files changed".into() } else { list }))
    }

    /// Before any of its fields is replaced.
    pub(super) fn forget(folder: &Path) {
        // A missing file is fine.
        let _ = remove(&folder.join(FILE));
    }

    pub(super) fn write(folder: &Path, cache: &SolveCache) -> Result<()> {
        let own = |name: &str| is_of_state(of_state(name)) && name != REWRITTEN;
        hashed::write(&folder.join(FILE), cache, &hashed::hashes(folder, &own)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clear_removes_states_only() {
        let folder = tempfile::tempdir().expect("scratch");
        let path = |name: &str| folder.path().join(name);
        open(folder.path()).expect("empty");
        let states = [
            "gap.npy",
            "partial-stress.npy",
            "load-12-contact.npy",
            "partial-load-2-solve.json",
            "pull-off.json",
            ".partial-7-gap.npy",
        ];
        let others = ["my-gap.npy", "load-x-gap.npy", "heights.npy"];
        states.iter().chain(&others).for_each(|name| fs::write(path(name), "x").expect("written"));
        clear(folder.path(), Some(&path("load-12-contact.npy"))).expect("cleared");
        assert!(path("load-12-contact.npy").exists());
        clear(folder.path(), None).expect("cleared");
        assert!(states.iter().all(|name| !path(name).exists()) && others.iter().all(|name| path(name).exists()));
        // The marker stays, so the folder is a solve's still.
        open(folder.path()).expect("its own");
        fs::remove_file(path(MARKER)).expect("removed");
        fs::write(path(FILE), "{}").expect("written");
        let refused = open(folder.path()).expect_err("no solve's").to_string();
        assert!(refused.contains("--out") && refused.contains("earlier solve"), "{refused}");
    }
}
