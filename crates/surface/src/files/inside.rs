//! Folders that somebody else may have filled: what lies inside is read, and nothing outside.

use std::io::ErrorKind;
use std::path::{Component, Path, PathBuf};

use super::beneath::{guard, reach_folder, release};
use asperity_grid::error::{Error, Result};

/// Refuses a folder in which something else than files and folders lies: a link would lead a reader or a writer out of it, a pipe would
/// keep a reader waiting, a device would never end. The folder itself may be reached by a link. Hidden folders belong to other programs.
/// From now on everything in the folder is reached through no link ([`super::beneath`]), whatever becomes of it.
///
/// # Errors
/// `Format`, which names the first; `Io`.
pub fn expect_plain(root: &Path) -> Result<()> {
    guarded(root, || {
        let mut folders = plain_folders(root, root)?;
        while let Some(folder) = folders.pop() {
            folders.extend(plain_folders(root, &folder)?);
        }
        Ok(())
    })
}

/// As [`expect_plain`], of what lies in the folder itself and below those of its folders that `below` names: the others may hold
/// many thousands of files.
///
/// # Errors
/// As [`expect_plain`].
pub fn expect_plain_in(root: &Path, below: &[&str]) -> Result<()> {
    guarded(root, || {
        plain_folders(root, root)?;
        below.iter().try_for_each(|name| expect_plain(&root.join(name)))
    })
}

/// Guards a folder before `check` looks at it, and no longer if it is refused: another part of the program may have to do with its links.
fn guarded(root: &Path, check: impl FnOnce() -> Result<()>) -> Result<()> {
    guard(root);
    check().inspect_err(|_| release(root))
}

/// The folders in a folder, in which nothing else than these and files lies.
fn plain_folders(root: &Path, folder: &Path) -> Result<Vec<PathBuf>> {
    let mut folders = Vec::new();
    let entries = match reach_folder(folder).and_then(|folder| std::fs::read_dir(&folder)) {
        // Those who read the folder say what it lacks.
        Err(e) if [ErrorKind::NotFound, ErrorKind::NotADirectory].contains(&e.kind()) => return Ok(folders),
        entries => entries.map_err(Error::io("list", folder))?,
    };
    for entry in entries {
        let entry = entry.map_err(Error::io("list", folder))?;
        // The file of an unfinished write may be gone already.
        let Ok(kind) = entry.file_type() else { continue };
        if kind.is_dir() {
            if !entry.file_name().as_encoded_bytes().starts_with(b".") {
                folders.push(folder.join(entry.file_name()));
            }
        } else if !kind.is_file() {
            let found = if kind.is_symlink() { "a link" } else { "a pipe, socket or device" };
            let accepted =
                format!("files and folders only below {}: remove it, or put a copy in its place", root.display());
            return Err(Error::format(folder.join(entry.file_name()), found, accepted));
        }
    }
    Ok(folders)
}

/// Path of a file that another one in `folder` names.
///
/// # Errors
/// `Format` for a name that leads out of the folder; `file` is the one that names it.
pub fn inside(folder: &Path, file: &str, name: &str) -> Result<PathBuf> {
    let stays = Path::new(name).components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
    if name.is_empty() || !stays {
        let accepted = "a path inside the run folder, relative to it";
        return Err(Error::format(folder.join(file), format!("the file {name:?}"), accepted));
    }
    Ok(folder.join(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_pipes_and_paths_that_lead_out_are_refused() {
        let scratch = tempfile::tempdir().expect("scratch");
        let (root, victim) = (scratch.path().join("root"), scratch.path().join("victim"));
        std::fs::create_dir_all(root.join("stage/deep")).expect("made");
        std::fs::write(root.join("stage/deep/file"), "text").expect("written");
        std::fs::write(&victim, "text").expect("written");
        expect_plain(&root).expect("files and folders");
        expect_plain(&root.join("none")).expect("nothing");
        std::os::unix::fs::symlink(&root, scratch.path().join("way")).expect("linked");
        expect_plain(&scratch.path().join("way")).expect("reached by a link");
        for (place, to) in [("stage/deep/link", &victim), (".asperity", &victim), ("figures", &root)] {
            std::os::unix::fs::symlink(to, root.join(place)).expect("linked");
            let text = expect_plain(&root).expect_err("a link").to_string();
            assert!(text.contains(place) && text.contains("a link") && text.contains("a copy"), "{text}");
            std::fs::remove_file(root.join(place)).expect("removed");
        }
        let _socket = std::os::unix::net::UnixListener::bind(root.join("stage/socket")).expect("bound");
        assert!(expect_plain(&root).expect_err("a socket").to_string().contains("socket"));
        for name in ["/etc/passwd", "../victim", "stage/../../victim", ""] {
            assert!(inside(&root, "results.json", name).is_err(), "{name}");
        }
        assert!(inside(&root, "results.json", "stage/deep/file").is_ok());
    }

    /// Links below a folder that was refused are followed as before: a notebook may read its own data after a wrong path.
    #[test]
    fn a_refused_folder_is_not_guarded() {
        let scratch = tempfile::tempdir().expect("scratch");
        let (root, data) = (scratch.path().join("root"), scratch.path().join("data"));
        for folder in [&root, &data] {
            std::fs::create_dir(folder).expect("made");
        }
        std::fs::write(data.join("file"), "text").expect("written");
        let read = || super::super::atomic_file::read_text(&root.join("link/file"));
        std::os::unix::fs::symlink(&data, root.join("link")).expect("linked");
        for _ in 0..2 {
            assert!(expect_plain(&root).is_err() && expect_plain_in(&root, &[]).is_err());
            assert_eq!(read().expect("its own link"), "text");
        }
        std::fs::remove_file(root.join("link")).expect("removed");
        expect_plain(&root).expect("plain");
        std::os::unix::fs::symlink(&data, root.join("link")).expect("linked");
        assert!(expect_plain(&root).is_err());
        assert!(read().is_err(), "guarded as long as it is used");
    }
}
