//! Damage of a job folder between two runs.

use super::job_files::lock;
use super::load_history::{
    HEADER, LOAD_STEPS_FILE, StepRecord, frame_file, hashes_of_step, roll_back, seen_steps, verified_file, verify_step,
};
use asperity_grid::Result;
use asperity_surface::files::atomic_file::{read_bytes, read_text, remove};
use std::path::Path;

/// Removes the steps from the first damaged one on: one whose line cannot be read, or whose line or frame is not as
/// `load_history::verify_step` found it, or was not seen by it. Steps behind the last one that was, which LAMMPS finished before it was
/// stopped, or all of a job that `run.sh` ran by hand, are verified here as far as they can be: their frames are read whole. Returns what
/// was damaged, in words that name the file.
///
/// # Errors
/// `Io`; `Lammps` if another program runs this job.
pub fn remove_damaged(folder: &Path) -> Result<Option<String>> {
    if !folder.join(LOAD_STEPS_FILE).is_file() {
        return Ok(None);
    }
    let _lock = lock(folder)?;
    repair(folder)
}

/// As [`remove_damaged`], in a folder that is locked.
///
/// # Errors
/// `Io`.
pub(super) fn repair(folder: &Path) -> Result<Option<String>> {
    let table = folder.join(LOAD_STEPS_FILE);
    if !table.is_file() {
        return Ok(None);
    }
    let text = read_bytes(&table)?;
    let mut lines = text.split_inclusive(|b| *b == b'\n').take_while(|line| line.ends_with(b"\n"));
    let head = lines.next();
    let mut damage = None;
    let steps: Vec<&[u8]> = lines.collect();
    let seen = seen_steps(folder, steps.len());
    if head.is_some_and(|line| line.trim_ascii_end() != HEADER.as_bytes()) {
        damage = Some((0, format!("{} is damaged in its first line", table.display())));
    }
    for (step, line) in steps.into_iter().enumerate() {
        if damage.is_some() {
            break;
        }
        let record = std::str::from_utf8(line).ok().and_then(StepRecord::parse);
        let frame = frame_file(folder, step);
        let recorded = read_text(&verified_file(folder, step)).ok();
        damage = if record.is_none_or(|r| r.step != step) {
            Some((step, format!("{} is damaged at step {step}", table.display())))
        } else if let Ok(frame) = &frame {
            changed_step(folder, (step, line), (frame, &table), recorded, step >= seen)?.map(|what| (step, what))
        } else {
            Some((step, format!("the frame of step {step} is missing in {}", folder.display())))
        };
    }
    let Some((step, description)) = damage else { return Ok(None) };
    // A table with a damaged first line has no step that could be kept.
    if step == 0 {
        remove(&table)?;
    }
    roll_back(folder, step)?;
    Ok(Some(description))
}

/// What of a step is not as it was when it was finished, or cannot be known to be.
fn changed_step(
    folder: &Path,
    (step, line): (usize, &[u8]),
    (frame, table): (&Path, &Path),
    recorded: Option<String>,
    is_behind: bool,
) -> Result<Option<String>> {
    let Some(recorded) = recorded else {
        let unknown = format!("{} is missing or no text", verified_file(folder, step).display());
        let read = if is_behind { verify_step(folder, step).map_err(|e| e.to_string()) } else { Err(unknown) };
        return Ok(read.err());
    };
    let hashes = hashes_of_step(frame, line)?;
    let same_line = recorded.rsplit(' ').next() == hashes.rsplit(' ').next();
    let file = if same_line { frame } else { table };
    Ok((recorded != hashes).then(|| format!("{} changed since step {step} was finished", file.display())))
}

#[cfg(test)]
mod tests {
    use super::super::load_history::{LoadHistory, verify_step};
    use super::*;

    fn job_of_three_steps() -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("scratch");
        let path = |name: &str| folder.path().join(name);
        let line = |k| format!("{k},0.3,{k},-100.5,12,1.5e-03,{k},44.5,45.5,200,1,cg,0,\n");
        let whole = format!("{HEADER}\n{}", (0..3).map(line).collect::<String>());
        std::fs::write(path(LOAD_STEPS_FILE), &whole).expect("written");
        for k in 0..3 {
            let frame = format!(
                "ITEM: TIMESTEP\n{k}\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS pp pp ff\n0 10\n0 10\n0 50\n\
                 ITEM: ATOMS id type x y z\n1 1 5 5 20\n"
            );
            std::fs::write(path(&format!("frame.{k}.dump")), frame).expect("written");
            std::fs::write(path(&format!("restart.{k}")), "state").expect("written");
            verify_step(folder.path(), k).expect("whole");
        }
        folder
    }

    /// A step whose hashes are missing, or no text, is not known to be whole: it is computed again. The last steps may have none, as LAMMPS
    /// finished them before it was stopped, or all, as `run.sh` ran them by hand: their frames are read.
    #[test]
    fn steps_without_hashes_are_removed() {
        let folder = job_of_three_steps();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("frame.2.b3"), [0xFF, 0xFE]).expect("written");
        let what = remove_damaged(folder.path()).expect("repaired").expect("damaged");
        assert!(what.contains("frame.2.b3 is missing or no text"), "{what}");
        remove(&path("frame.1.b3")).expect("removed");
        assert_eq!(remove_damaged(folder.path()).expect("whole"), None);
        assert!(path("frame.1.b3").exists() && LoadHistory::read(folder.path()).expect("good").steps.len() == 2);
        remove(&path("frame.0.b3")).expect("removed");
        let what = remove_damaged(folder.path()).expect("repaired").expect("damaged");
        assert!(what.contains("frame.0.b3") && !path(LOAD_STEPS_FILE).exists(), "{what}");
        let folder = job_of_three_steps();
        let path = |name: &str| folder.path().join(name);
        (0..3).for_each(|k| remove(&path(&format!("frame.{k}.b3"))).expect("removed"));
        assert_eq!(remove_damaged(folder.path()).expect("whole"), None);
        assert!((0..3).all(|k| path(&format!("frame.{k}.b3")).exists()));
        std::fs::write(path("frame.1.dump"), "ITEM: TIMESTEP").expect("written");
        (0..3).for_each(|k| remove(&path(&format!("frame.{k}.b3"))).expect("removed"));
        assert!(remove_damaged(folder.path()).expect("repaired").is_some());
        assert_eq!(LoadHistory::read(folder.path()).expect("good").steps.len(), 1);
    }

    /// A changed digit of a frame or of the table is found, although both can be read; the steps before it stay.
    #[test]
    fn steps_from_a_damaged_one_on_are_removed() {
        for (damaged, from, to, kept) in [
            ("frame.1.dump", "5 5 20", "5 5 21", 1),
            (LOAD_STEPS_FILE, ",2,-100", ",3,-100", 2),
            (LOAD_STEPS_FILE, "step,", "stop,", 0),
        ] {
            let folder = job_of_three_steps();
            let path = |name: &str| folder.path().join(name);
            assert_eq!(remove_damaged(folder.path()).expect("whole"), None);
            let text = std::fs::read_to_string(path(damaged)).expect("read");
            assert!(text.contains(from), "{text}");
            std::fs::write(path(damaged), text.replacen(from, to, 1)).expect("written");
            let what = remove_damaged(folder.path()).expect("repaired").expect("damaged");
            assert!(what.contains(damaged), "{what}");
            assert_eq!(LoadHistory::read(folder.path()).expect("good").steps.len(), kept, "{damaged}");
            assert!(!path(&format!("frame.{kept}.dump")).exists() && !path(&format!("frame.{kept}.b3")).exists());
            assert_eq!(remove_damaged(folder.path()).expect("whole"), None);
        }
    }

    /// A job that is written again with fewer loads keeps the steps that both have, whatever became of the table meanwhile.
    #[test]
    fn a_damaged_table_is_cut_and_not_refused() {
        let folder = tempfile::tempdir().expect("scratch");
        let path = |name: &str| folder.path().join(name);
        for k in 0..4 {
            std::fs::write(path(&format!("frame.{k}.dump")), "frame").expect("written");
        }
        std::fs::write(path(LOAD_STEPS_FILE), format!("{HEADER}\nnan\n1,\n\u{1}\n3,0\n")).expect("written");
        super::super::load_history::keep_first(folder.path(), 2).expect("cut");
        assert_eq!(std::fs::read_to_string(path(LOAD_STEPS_FILE)).expect("read"), format!("{HEADER}\nnan\n1,\n"));
        assert!(path("frame.1.dump").exists() && !path("frame.2.dump").exists());
        assert!(remove_damaged(folder.path()).expect("repaired").expect("damaged").contains("at step 0"));
        assert!(!path(LOAD_STEPS_FILE).exists() && !path("frame.0.dump").exists());
    }
}
