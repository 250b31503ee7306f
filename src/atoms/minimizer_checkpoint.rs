//! Checkpoints within a load, for large blocks: LAMMPS writes two restart files alternately while it relaxes, and a
//! continued run starts from the newest complete one.
//!
//! The result agrees with that of an uninterrupted run within the force tolerance, but not bit by bit: the minimiser
//! restarts without its momentum.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use super::cost::SECONDS_PER_ATOM_EVALUATION;
use crate::{Error, Result};

/// Computing time between two checkpoints, the most that a kill can lose. Writing three million atoms takes a second.
pub const INTERVAL: Duration = Duration::from_secs(60);

/// Marker at the start and end of a LAMMPS restart file.
const MARK: &[u8] = b"LammpS RestartT";

/// Prefix of the file names.
pub(super) const PREFIX: &str = "checkpoint.";

/// Iterations between two checkpoints.
pub fn iterations(interval: Duration, atoms: u64, ranks: usize) -> usize {
    let one = atoms as f64 * SECONDS_PER_ATOM_EVALUATION / ranks as f64;
    (interval.as_secs_f64() / one).clamp(1.0, 1e6) as usize
}

/// The two files of a step.
fn files(folder: &Path, step: usize) -> [PathBuf; 2] {
    ["a", "b"].map(|end| folder.join(format!("{PREFIX}{step}.{end}")))
}

/// The newest complete checkpoint of a step.
pub fn newest(folder: &Path, step: usize) -> Option<PathBuf> {
    let written = |file: &PathBuf| -> Option<SystemTime> {
        let whole = is_whole(file).unwrap_or(false);
        whole.then(|| std::fs::metadata(file).and_then(|m| m.modified()).ok()).flatten()
    };
    let found = files(folder, step).into_iter().filter_map(|f| Some((written(&f)?, f)));
    found.max().map(|(_, file)| file)
}

/// Checks the end marker: after a kill or on a full disk LAMMPS may leave a truncated file without an error.
fn is_whole(file: &Path) -> std::io::Result<bool> {
    let mut handle = File::open(file)?;
    let mut tail = [0; 64];
    let length = handle.metadata()?.len();
    handle.seek(SeekFrom::Start(length.saturating_sub(tail.len() as u64)))?;
    let read = handle.read(&mut tail)?;
    Ok(tail[..read].windows(MARK.len()).any(|w| w == MARK))
}

/// Removes the checkpoints of all other steps.
///
/// # Errors
/// `Io`.
pub fn keep_only(folder: &Path, step: usize) -> Result<()> {
    keep(folder, |of| of == step)
}

/// Keeps the checkpoints of the first `steps` steps.
///
/// # Errors
/// `Io`.
pub fn keep_first(folder: &Path, steps: usize) -> Result<()> {
    keep(folder, |of| of < steps)
}

fn keep(folder: &Path, kept: impl Fn(usize) -> bool) -> Result<()> {
    for entry in std::fs::read_dir(folder).map_err(Error::io("list", folder))? {
        let path = entry.map_err(Error::io("list", folder))?.path();
        let name = path.file_name().and_then(|n| n.to_str()).unwrap_or_default();
        let Some(rest) = name.strip_prefix(PREFIX) else { continue };
        let step = rest.split('.').next().and_then(|number| number.parse().ok());
        if !step.is_some_and(&kept) {
            std::fs::remove_file(&path).map_err(Error::io("remove", &path))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_complete_file_is_used_and_other_steps_are_removed() {
        let folder = tempfile::tempdir().expect("scratch");
        let path = |name: &str| folder.path().join(name);
        let put = |name: &str, text: &[u8], age: u64| {
            std::fs::write(path(name), text).expect("written");
            let time = SystemTime::now() - Duration::from_secs(age);
            File::options().write(true).open(path(name)).and_then(|f| f.set_modified(time)).expect("dated");
        };
        let whole = [MARK, &[0; 400], MARK, &[0]].concat();
        assert_eq!(newest(folder.path(), 2), None);
        put("checkpoint.1.a", &whole, 0);
        put("checkpoint.2.a", &whole, 20);
        put("checkpoint.2.b", &whole, 10);
        assert_eq!(newest(folder.path(), 2), Some(path("checkpoint.2.b")));
        // Truncated during writing.
        put("checkpoint.2.b", &whole[..300], 5);
        assert_eq!(newest(folder.path(), 2), Some(path("checkpoint.2.a")));
        put("checkpoint.2.a", b"", 0);
        assert_eq!(newest(folder.path(), 2), None);
        put("restart.1", &whole, 0);
        keep_only(folder.path(), 2).expect("removed");
        assert!(!path("checkpoint.1.a").exists() && path("checkpoint.2.a").exists() && path("restart.1").exists());
    }

    #[test]
    fn large_blocks_are_checkpointed_every_few_dozen_iterations_and_small_ones_rarely() {
        assert_eq!(iterations(INTERVAL, 3_400_000, 1), 39);
        assert!(iterations(INTERVAL, 20_000, 1) > 5000);
        assert_eq!(iterations(Duration::ZERO, 20_000, 1), 1);
    }
}
