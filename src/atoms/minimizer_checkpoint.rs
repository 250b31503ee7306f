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

/// The newest complete checkpoint of a step, of those that interrupt a minimisation.
///
/// LAMMPS also writes one where a minimisation has ended, at any iteration. A run continued from there would relax a
/// state again that is already relaxed, so that a kill in this instant would change the results. Checkpoints are
/// therefore used only at multiples of their interval, `checkpoint.STEP.INTERVAL.a` and `.b`.
pub fn newest(folder: &Path, step: usize) -> Option<PathBuf> {
    let written = |file: &Path| -> Option<SystemTime> {
        let name = file.file_name()?.to_str()?;
        let interval: u64 = name.strip_prefix(&format!("{PREFIX}{step}."))?.split('.').next()?.parse().ok()?;
        let used = iteration(file).ok()??.checked_rem(interval)? == 0;
        used.then(|| std::fs::metadata(file).and_then(|m| m.modified()).ok()).flatten()
    };
    let paths = std::fs::read_dir(folder).ok()?.flatten().map(|entry| entry.path());
    paths.filter_map(|file| Some((written(&file)?, file))).max().map(|(_, file)| file)
}

/// The iteration of a complete restart file. After a kill or on a full disk LAMMPS may leave a truncated file without an
/// error; it lacks the end marker.
fn iteration(file: &Path) -> std::io::Result<Option<u64>> {
    let mut handle = File::open(file)?;
    let mut head = Vec::new();
    (&mut handle).take(512).read_to_end(&mut head)?;
    let length = handle.metadata()?.len();
    handle.seek(SeekFrom::Start(length.saturating_sub(64)))?;
    let mut tail = Vec::new();
    handle.read_to_end(&mut tail)?;
    let whole = tail.windows(MARK.len()).any(|w| w == MARK);
    Ok(if whole { iteration_in(&head) } else { None })
}

/// The iteration in the header of a restart file (`read_restart.cpp` of LAMMPS): after the marker, the byte order and the
/// revision, pairs of a key and a value, each key of four bytes. Texts begin with their length.
fn iteration_in(head: &[u8]) -> Option<u64> {
    const TEXTS: [i32; 2] = [0, 4];
    const ITERATION: i32 = 5;
    let int = |at: usize| Some(i32::from_ne_bytes(head.get(at..at + 4)?.try_into().ok()?));
    let mut at = MARK.len() + 1 + 8;
    loop {
        let (key, value) = (int(at)?, at + 4);
        match key {
            ITERATION => return Some(u64::from_ne_bytes(head.get(value..value + 8)?.try_into().ok()?)),
            _ if TEXTS.contains(&key) => at = value + 4 + usize::try_from(int(value)?).ok()?,
            _ => at = value + 4,
        }
    }
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

    /// Header of LAMMPS 29Sep2021: version, four sizes of integers, units, iteration.
    fn restart_file(iteration: u64) -> Vec<u8> {
        let ints = |list: &[i32]| list.iter().flat_map(|n| n.to_ne_bytes()).collect::<Vec<u8>>();
        let mut file = [MARK, &[0], &ints(&[1, 2, 0, 12]), b"29 Sep 2021\0"].concat();
        file.extend(ints(&[1, 4, 0x30, 4, 2, 4, 3, 8, 4, 6]));
        file.extend(b"metal\0");
        file.extend(ints(&[5]));
        file.extend(iteration.to_ne_bytes());
        file.extend([0; 400]);
        file.extend(MARK);
        file
    }

    #[test]
    fn the_newest_complete_file_within_a_minimisation_is_used_and_other_steps_are_removed() {
        let folder = tempfile::tempdir().expect("scratch");
        let path = |name: &str| folder.path().join(name);
        let put = |name: &str, bytes: &[u8], age: u64| {
            std::fs::write(path(name), bytes).expect("written");
            let time = SystemTime::now() - Duration::from_secs(age);
            File::options().write(true).open(path(name)).and_then(|f| f.set_modified(time)).expect("dated");
        };
        assert_eq!(newest(folder.path(), 2), None);
        put("checkpoint.1.50.a", &restart_file(100), 0);
        put("checkpoint.2.50.a", &restart_file(250), 20);
        put("checkpoint.2.50.b", &restart_file(300), 10);
        assert_eq!(newest(folder.path(), 2), Some(path("checkpoint.2.50.b")));
        // Written where the minimisation ended; another interval, as with another number of ranks.
        put("checkpoint.2.50.b", &restart_file(317), 5);
        assert_eq!(newest(folder.path(), 2), Some(path("checkpoint.2.50.a")));
        put("checkpoint.2.317.a", &restart_file(317), 3);
        assert_eq!(newest(folder.path(), 2), Some(path("checkpoint.2.317.a")));
        // Truncated during writing.
        put("checkpoint.2.317.a", &restart_file(317)[..300], 2);
        assert_eq!(newest(folder.path(), 2), Some(path("checkpoint.2.50.a")));
        put("checkpoint.2.50.a", b"", 0);
        assert_eq!(newest(folder.path(), 2), None);
        put("restart.1", &restart_file(100), 0);
        keep_only(folder.path(), 2).expect("removed");
        let exists = |name: &str| path(name).exists();
        assert!(!exists("checkpoint.1.50.a") && exists("checkpoint.2.50.a") && exists("restart.1"));
    }

    #[test]
    fn large_blocks_are_checkpointed_every_few_dozen_iterations_and_small_ones_rarely() {
        assert_eq!(iterations(INTERVAL, 3_400_000, 1), 39);
        assert!(iterations(INTERVAL, 20_000, 1) > 5000);
        assert_eq!(iterations(Duration::ZERO, 20_000, 1), 1);
    }
}
