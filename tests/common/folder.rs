//! Folders that a command wrote: their files, and what two runs of the same scene have in common.

use serde_json::Value;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

/// Keys whose values are times, memory, or say how a stage was obtained.
const OF_THE_MACHINE: [&str; 12] = [
    "seconds",
    "earlier_seconds",
    "cpu_seconds",
    "wall_seconds",
    "peak_rss_bytes",
    "measured_bytes",
    "planned_bytes",
    "transformed_nodes",
    "reused",
    "key",
    "spent_seconds",
    "cpu_over_reference",
];

/// A value without what differs between two runs of the same scene.
pub(crate) fn of_the_scene(value: &Value) -> Value {
    match value {
        Value::Object(map) => {
            let kept = map.iter().filter(|(k, _)| !OF_THE_MACHINE.contains(&k.as_str()));
            kept.map(|(k, v)| (k.clone(), of_the_scene(v))).collect()
        }
        Value::Array(list) => list.iter().map(of_the_scene).collect(),
        other => other.clone(),
    }
}

/// All files below a folder, relative to it.
pub(crate) fn files(folder: &Path) -> Vec<PathBuf> {
    let mut list = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(&next).expect("listed").flatten() {
            if entry.path().is_dir() {
                folders.push(entry.path());
            } else {
                list.push(entry.path().strip_prefix(folder).expect("below").to_path_buf());
            }
        }
    }
    list.sort();
    list
}

/// Files that hold numbers, and their bytes: fields, and the frames and load steps of LAMMPS.
pub(crate) fn fields(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let numbers = |f: &PathBuf| {
        let name = f.file_name().and_then(OsStr::to_str).unwrap_or_default();
        name.ends_with(".npy") || name.starts_with("frame.") && !name.ends_with(".b3") || name == "load_steps.csv"
    };
    let read = |f: PathBuf| {
        let bytes = fs::read(folder.join(&f)).expect("read");
        (f, bytes)
    };
    files(folder).into_iter().filter(numbers).map(read).collect()
}
