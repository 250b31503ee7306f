//! Who uses a file or a folder, from `/proc`: nobody is found where the system has none, or belongs to another user.

use std::path::{Path, PathBuf};

/// Number and name of a process other than this that has the file open.
pub fn with_file(path: &Path) -> Option<String> {
    let file = path.canonicalize().ok()?;
    first(|process| {
        let open = std::fs::read_dir(process.join("fd")).ok();
        open.is_some_and(|open| {
            open.filter_map(Result::ok).any(|entry| std::fs::read_link(entry.path()).is_ok_and(|to| to == file))
        })
    })
}

/// Number and name of a process other than this that works in the folder and was started with the argument.
pub fn working_in(folder: &Path, argument: &str) -> Option<String> {
    let folder = folder.canonicalize().ok()?;
    first(|process| {
        std::fs::read_link(process.join("cwd")).is_ok_and(|to| to == folder)
            && std::fs::read(process.join("cmdline"))
                .is_ok_and(|words| words.split(|b| *b == 0).any(|word| word == argument.as_bytes()))
    })
}

fn first(is_sought: impl Fn(&Path) -> bool) -> Option<String> {
    let own = std::process::id();
    let entries = std::fs::read_dir("/proc").ok()?.filter_map(Result::ok);
    let mut numbers: Vec<u32> = entries.filter_map(|e| e.file_name().to_str()?.parse().ok()).collect();
    numbers.sort_unstable();
    numbers.into_iter().filter(|number| *number != own).find_map(|number| {
        let process = PathBuf::from(format!("/proc/{number}"));
        let name = std::fs::read_to_string(process.join("comm")).ok().filter(|_| is_sought(&process))?;
        Some(format!("process {number} ({})", name.trim()))
    })
}

#[cfg(test)]
#[cfg(target_os = "linux")]
mod tests {
    use super::*;
    use std::process::{Command, Stdio};

    #[test]
    fn processes_are_found_by_their_files_and_folders() {
        let folder = tempfile::tempdir().expect("scratch");
        let path = folder.path().join("file");
        let file = std::fs::File::create(&path).expect("created");
        assert_eq!([with_file(&path), working_in(folder.path(), "60")], [None, None], "this process does not count");
        let mut sleep = Command::new("sleep");
        sleep.arg("60").current_dir(folder.path()).stdin(Stdio::from(file));
        let mut sleep = sleep.spawn().expect("started");
        // The name of a process changes after its files are closed for the new program.
        let name = format!("/proc/{}/comm", sleep.id());
        while std::fs::read_to_string(&name).expect("it runs") != "sleep\n" {
            assert!(sleep.try_wait().expect("waited").is_none(), "it has ended");
        }
        let found = Some(format!("process {} (sleep)", sleep.id()));
        assert_eq!([with_file(&path), working_in(folder.path(), "60")], [found.clone(), found]);
        assert_eq!(working_in(folder.path(), "61"), None);
        sleep.kill().and_then(|()| sleep.wait()).expect("killed");
        assert_eq!(working_in(folder.path(), "60"), None);
    }
}
