//! Checkpoints within a load, for large blocks: LAMMPS writes two restart files alternately while it relaxes, and a
//! continued run starts from the newest complete one.
//!
//! The result agrees with that of an uninterrupted run within the force tolerance, but not bit by bit: the minimiser
//! restarts without its momentum.

use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use super::cost::SECONDS_PER_ATOM_EVALUATION;
use asperity_grid::Result;
use asperity_surface::files::atomic_file::{list, open_regular, remove, written_at};

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

/// The newest complete checkpoint of a step, of those at iteration `from` or later: the iteration at which the load began plus the
/// interval of checkpoints.
///
/// LAMMPS also writes one where a minimisation ends. Without this limit a small block, whose load takes less than the interval, would be
/// relaxed again from its relaxed state if it is killed before its frame is written, and have other results than without the kill. An
/// earlier state is worth no more than one interval.
pub fn newest(folder: &Path, step: usize, from: u64) -> Option<PathBuf> {
    let written = |file: &PathBuf| -> Option<SystemTime> {
        let used = iteration(file)? >= from;
        used.then(|| written_at(file)).flatten()
    };
    let candidates = files(folder, step).into_iter().filter_map(|file| Some((written(&file)?, file)));
    candidates.max().map(|(_, file)| file)
}

/// The iteration of a complete restart file. After a kill or on a full disk LAMMPS may leave a truncated file without an
/// error; it lacks the end marker.
pub fn iteration(file: &Path) -> Option<u64> {
    let (mut handle, length) = open_regular(file).ok()?;
    let mut ends = || -> std::io::Result<[Vec<u8>; 2]> {
        let (mut head, mut tail) = (Vec::new(), Vec::new());
        (&mut handle).take(512).read_to_end(&mut head)?;
        handle.seek(SeekFrom::Start(length.saturating_sub(64)))?;
        handle.read_to_end(&mut tail)?;
        Ok([head, tail])
    };
    let [head, tail] = ends().ok()?;
    let is_complete = tail.windows(MARK.len()).any(|w| w == MARK);
    if is_complete { iteration_in(&head) } else { None }
}

/// The iteration in the header of a restart file (`read_restart.cpp` of LAMMPS): after the marker, the byte order and the
/// revision, pairs of a key and a value, each key of four bytes. Texts begin with their length.
fn iteration_in(head: &[u8]) -> Option<u64> {
    const TEXTS: [i32; 2] = [0, 4];
    const SIZE: i32 = 3;
    const ITERATION: i32 = 5;
    let int = |offset: usize| Some(i32::from_ne_bytes(head.get(offset..offset + 4)?.try_into().ok()?));
    let (mut offset, mut size) = (MARK.len() + 1 + 8, 8);
    loop {
        let (key, value_offset) = (int(offset)?, offset + 4);
        match key {
            ITERATION if size == 4 => return u64::try_from(int(value_offset)?).ok(),
            ITERATION => return Some(u64::from_ne_bytes(head.get(value_offset..value_offset + 8)?.try_into().ok()?)),
            _ if TEXTS.contains(&key) => offset = value_offset + 4 + usize::try_from(int(value_offset)?).ok()?,
            _ => {
                // Bytes of an iteration: four in builds with small integers.
                size = if key == SIZE { int(value_offset)? } else { size };
                offset = value_offset + 4;
            }
        }
    }
}

/// Removes the checkpoints of all other steps.
///
/// # Errors
/// `Io`.
pub fn keep_only(folder: &Path, step: usize) -> Result<()> {
    keep(folder, |written_step| written_step == step)
}

/// Keeps the checkpoints of the first `steps` steps.
///
/// # Errors
/// `Io`.
pub fn keep_first(folder: &Path, steps: usize) -> Result<()> {
    keep(folder, |written_step| written_step < steps)
}

fn keep(folder: &Path, keep: impl Fn(usize) -> bool) -> Result<()> {
    for (name, path) in list(folder)? {
        let Some(remainder) = name.strip_prefix(PREFIX) else { continue };
        let step = remainder.split('.').next().and_then(|number| number.parse().ok());
        if !step.is_some_and(&keep) {
            remove(&path)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::File;

    /// Header of LAMMPS 29Sep2021: version, four sizes of integers, units, iteration.
    fn restart_file(iteration: u64, size: i32) -> Vec<u8> {
        let ints = |list: &[i32]| list.iter().flat_map(|n| n.to_ne_bytes()).collect::<Vec<u8>>();
        let mut file = [MARK, &[0], &ints(&[1, 2, 0, 12]), b"29 Sep 2021\0"].concat();
        file.extend(ints(&[1, 4, 0x30, 4, 2, 4, 3, size, 4, 6]));
        file.extend(b"metal\0");
        file.extend(ints(&[5]));
        file.extend(&iteration.to_ne_bytes()[..size as usize]);
        file.extend(ints(&[6, 3]));
        file.extend([0; 400]);
        file.extend(MARK);
        file
    }

    #[test]
    fn the_newest_complete_file_beyond_the_first_interval_is_used_and_other_steps_are_removed() {
        let folder = tempfile::tempdir().expect("scratch");
        let path = |name: &str| folder.path().join(name);
        let put = |name: &str, bytes: &[u8], age: u64| {
            std::fs::write(path(name), bytes).expect("written");
            let time = SystemTime::now() - Duration::from_secs(age);
            File::options().write(true).open(path(name)).and_then(|f| f.set_modified(time)).expect("dated");
        };
        let newest = |from: u64| newest(folder.path(), 2, from);
        assert_eq!(newest(0), None);
        put("checkpoint.1.a", &restart_file(90, 8), 0);
        put("checkpoint.2.a", &restart_file(250, 8), 20);
        put("checkpoint.2.b", &restart_file(300, 4), 10);
        assert_eq!(newest(150), Some(path("checkpoint.2.b")));
        assert_eq!((newest(300), newest(301)), (Some(path("checkpoint.2.b")), None));
        // Truncated during writing.
        put("checkpoint.2.b", &restart_file(300, 8)[..300], 5);
        assert_eq!(newest(150), Some(path("checkpoint.2.a")));
        put("checkpoint.2.a", b"", 0);
        assert_eq!(newest(0), None);
        put("restart.1", &restart_file(100, 8), 0);
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
