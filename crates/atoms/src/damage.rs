//! Damage of a job folder between two runs.

use super::job_files::lock;
use super::load_history::{HEADER, LOAD_STEPS_FILE, StepRecord, frame_file, hashes_of_step, roll_back};
use asperity_grid::{Error, Result};
use asperity_surface::files::atomic_file::remove;
use std::path::Path;

/// Removes the steps from the first damaged one on: one whose line cannot be read, or whose line or frame is not as
/// `load_history::verify_step` found it. Returns what was damaged, in words that name the file.
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
    let text = std::fs::read(&table).map_err(Error::io("read", &table))?;
    let mut lines = text.split_inclusive(|b| *b == b'\n').take_while(|line| line.ends_with(b"\n"));
    let head = lines.next();
    let mut damage = None;
    if head.is_some_and(|line| line.trim_ascii_end() != HEADER.as_bytes()) {
        damage = Some((0, format!("{} is damaged in its first line", table.display())));
    }
    for (step, line) in lines.enumerate() {
        if damage.is_some() {
            break;
        }
        let record = std::str::from_utf8(line).ok().and_then(StepRecord::parse);
        let frame = frame_file(folder, step);
        let recorded = std::fs::read_to_string(folder.join(format!("frame.{step}.b3"))).ok();
        damage = if record.is_none_or(|r| r.step != step) {
            Some((step, format!("{} is damaged at step {step}", table.display())))
        } else if let Ok(frame) = &frame {
            let hashes = hashes_of_step(frame, line)?;
            recorded.filter(|recorded| *recorded != hashes).map(|recorded| {
                let same_line = recorded.rsplit(' ').next() == hashes.rsplit(' ').next();
                let file = if same_line { frame } else { &table };
                (step, format!("{} changed since step {step} was finished", file.display()))
            })
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

#[cfg(test)]
mod tests {
    use super::super::load_history::{LoadHistory, verify_step};
    use super::*;

    /// A changed digit of a frame or of the table is found, although both can be read; the steps before it stay.
    #[test]
    fn steps_from_a_damaged_one_on_are_removed() {
        for (damaged, from, to, kept) in [
            ("frame.1.dump", "5 5 20", "5 5 21", 1),
            (LOAD_STEPS_FILE, ",2,-100", ",3,-100", 2),
            (LOAD_STEPS_FILE, "step,", "stop,", 0),
        ] {
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
