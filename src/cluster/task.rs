//! Progress of a task within a turn.

use asperity_atoms::minimizer_checkpoint;
use asperity_surface::files::atomic_file::{list, read_text};
use std::path::{Path, PathBuf};

/// A number that changes when a run folder gains work that a later turn continues: finished stages and, where stages are continued, load
/// steps of LAMMPS, finished loads of estimators, checkpoints.
pub fn progress_of(run: &Path, continues_stages: bool) -> u64 {
    let Ok(entries) = list(run) else { return 0 };
    let progress_in = |(name, path): (String, PathBuf)| -> u64 {
        if path.is_dir() {
            return progress_of(&path, continues_stages);
        }
        let text = || read_text(&path).unwrap_or_default();
        let state = match name.as_str() {
            "done.json" => text(),
            _ if !continues_stages => return 0,
            // A continued run writes these anew, without progress.
            "load_steps.csv" => text(),
            name if name.ends_with("checkpoint.json") || is_load(name) => text(),
            // Of LAMMPS, binary.
            // A turn that only repeats the iterations of the turn before makes none.
            name if name.starts_with("checkpoint.") => format!("{:?}", minimizer_checkpoint::iteration(&path)),
            _ => return 0,
        };
        let hash = blake3::hash(format!("{} {state}", path.display()).as_bytes());
        u64::from_le_bytes(hash.as_bytes()[..8].try_into().expect("eight bytes"))
    };
    // A sum, so that the order of the entries does not count.
    entries.into_iter().map(progress_in).fold(0, u64::wrapping_add)
}

/// Whether a file holds a finished load of an estimator: load-3.json.
fn is_load(name: &str) -> bool {
    let number = name.strip_prefix("load-").and_then(|n| n.strip_suffix(".json"));
    number.is_some_and(|n| n.parse::<usize>().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_work_that_is_continued_is_progress() {
        let run = tempfile::tempdir().expect("scratch");
        let write = |name: &str, text: &str| {
            let path = run.path().join(name);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("created");
            std::fs::write(path, text).expect("written");
        };
        let progress_of = |run: &Path| super::progress_of(run, true);
        let empty = progress_of(run.path());
        write("lammps/spent.json", "1");
        write("lammps/log.0", "text");
        assert_eq!(progress_of(run.path()), empty);
        write("lammps/load_steps.csv", "a\n");
        let one = progress_of(run.path());
        write("lammps/load_steps.csv", "a\n");
        assert_eq!(progress_of(run.path()), one, "the same steps, written again");
        write("lammps/load_steps.csv", "a\nb\n");
        let two = progress_of(run.path());
        write("continuum/checkpoint.json", "{}");
        let three = progress_of(run.path());
        assert!(empty != one && one != two && two != three);
        write("continuum/checkpoint.json", "{}");
        assert_eq!(progress_of(run.path()), three, "the same state, written again");
        let more = ["matched/full-heights-checkpoint.json", "method-persson/load-1.json", "lammps/checkpoint.2.a"];
        for name in more {
            let previous = progress_of(run.path());
            write(name, "{}");
            assert!(progress_of(run.path()) != previous, "{name}");
        }
        // Stages of a trade-off begin anew.
        let finished = super::progress_of(run.path(), false);
        write("lammps/load_steps.csv", "a\nb\nc\n");
        assert_eq!(super::progress_of(run.path(), false), finished);
        write("lammps/done.json", "{}");
        assert!(super::progress_of(run.path(), false) != finished);
    }
}
