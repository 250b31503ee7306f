//! Progress of a task within a turn.

use std::path::Path;
use std::time::UNIX_EPOCH;

/// A number that changes when a run folder gains work that a later turn continues: finished stages, load steps of LAMMPS, checkpoints.
pub fn progress_of(run: &Path) -> u64 {
    let Ok(entries) = std::fs::read_dir(run) else { return 0 };
    let of = |entry: std::fs::DirEntry| -> u64 {
        let Ok(meta) = entry.metadata() else { return 0 };
        if meta.is_dir() {
            return progress_of(&entry.path());
        }
        let (path, name) = (entry.path(), entry.file_name());
        let state = match name.to_string_lossy().as_ref() {
            // A continued run writes its load steps anew, without progress.
            "done.json" | "load_steps.csv" => std::fs::read_to_string(&path).unwrap_or_default(),
            name if name.starts_with("checkpoint") => {
                let changed = meta.modified().ok().and_then(|t| t.duration_since(UNIX_EPOCH).ok());
                format!("{} {}", meta.len(), changed.unwrap_or_default().as_nanos())
            }
            _ => return 0,
        };
        let hash = blake3::hash(format!("{} {state}", path.display()).as_bytes());
        u64::from_le_bytes(hash.as_bytes()[..8].try_into().expect("eight bytes"))
    };
    // A sum, so that the order of the entries does not count.
    entries.flatten().map(of).fold(0, u64::wrapping_add)
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
        assert_eq!(progress_of(run.path()), three);
    }
}
