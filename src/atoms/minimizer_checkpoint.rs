//! States within a load, for blocks whose loads take long: LAMMPS writes one of two files in turn while it relaxes, and a run that was
//! stopped goes on from the newer of those that are whole.
//!
//! What such a run ends in is within the force tolerance of what it would have been, not the same to the last bit: the minimiser
//! begins again without its momentum.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use super::cost::SECONDS_PER_ATOM_EVALUATION;
use crate::{Error, Result};

/// What a kill may lose. A state of three million atoms is written in a second.
pub const INTERVAL: Duration = Duration::from_secs(60);

/// LAMMPS begins and ends a restart file with this.
const MARK: &[u8] = b"LammpS RestartT";

/// Start of the names of all such files.
pub(super) const PREFIX: &str = "checkpoint.";

/// Iterations between two states.
pub fn iterations(interval: Duration, atoms: u64, ranks: usize) -> usize {
    let one = atoms as f64 * SECONDS_PER_ATOM_EVALUATION / ranks as f64;
    (interval.as_secs_f64() / one).clamp(1.0, 1e6) as usize
}

/// The files of a step.
fn files(folder: &Path, step: usize) -> [PathBuf; 2] {
    ["a", "b"].map(|end| folder.join(format!("{PREFIX}{step}.{end}")))
}

/// The newest whole state of a step.
pub fn newest(folder: &Path, step: usize) -> Option<PathBuf> {
    let written = |file: &PathBuf| -> Option<SystemTime> {
        let whole = is_whole(file).unwrap_or(false);
        whole.then(|| std::fs::metadata(file).and_then(|m| m.modified()).ok()).flatten()
    };
    let found = files(folder, step).into_iter().filter_map(|f| Some((written(&f)?, f)));
    found.max().map(|(_, file)| file)
}

/// LAMMPS does not say when a full disk has cut a file short; a kill may do the same.
fn is_whole(file: &Path) -> std::io::Result<bool> {
    let mut handle = File::open(file)?;
    let mut tail = [0; 64];
    let length = handle.metadata()?.len();
    handle.seek(SeekFrom::Start(length.saturating_sub(tail.len() as u64)))?;
    let read = handle.read(&mut tail)?;
    Ok(tail[..read].windows(MARK.len()).any(|w| w == MARK))
}

/// Removes the states of all steps but one.
///
/// # Errors
/// `Io`.
pub fn keep_only(folder: &Path, step: usize) -> Result<()> {
    keep(folder, |of| of == step)
}

/// Keeps the states of the first so many steps.
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
    fn the_newer_whole_file_is_taken_and_other_steps_are_cleared_away() {
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
        // Cut while it was written.
        put("checkpoint.2.b", &whole[..300], 5);
        assert_eq!(newest(folder.path(), 2), Some(path("checkpoint.2.a")));
        put("checkpoint.2.a", b"", 0);
        assert_eq!(newest(folder.path(), 2), None);
        put("restart.1", &whole, 0);
        keep_only(folder.path(), 2).expect("removed");
        assert!(!path("checkpoint.1.a").exists() && path("checkpoint.2.a").exists() && path("restart.1").exists());
    }

    #[test]
    fn the_papers_block_keeps_a_state_every_few_dozen_iterations_and_a_small_one_hardly_ever() {
        assert_eq!(iterations(INTERVAL, 3_400_000, 1), 39);
        assert!(iterations(INTERVAL, 20_000, 1) > 5000);
        assert_eq!(iterations(Duration::ZERO, 20_000, 1), 1);
    }
}
