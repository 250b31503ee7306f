//! Folders whose files are opened relative to them, through no link: another program may put a link in place of a folder after it was looked at.
//! A folder is guarded by its absolute path as it was given: another path to it, as `canonicalize` gives, is not.

use std::collections::BTreeMap;
use std::io;
use std::ops::Deref;
use std::path::{Component, Path, PathBuf};
use std::process::Command;
use std::sync::{LazyLock, PoisonError, RwLock, RwLockWriteGuard};

/// Folders in use, absolute, and how often each was opened. The first is that of the program that started this one.
static ROOTS: LazyLock<RwLock<BTreeMap<PathBuf, usize>>> = LazyLock::new(|| {
    let given = std::env::var_os(VARIABLE).map(PathBuf::from).filter(|root| root.is_absolute());
    RwLock::new(given.into_iter().map(|root| (root, 1)).collect())
});

/// Names the folder to a process that this one starts for a part of its work.
const VARIABLE: &str = "ASPERITY_BENEATH";

fn roots() -> RwLockWriteGuard<'static, BTreeMap<PathBuf, usize>> {
    ROOTS.write().unwrap_or_else(PoisonError::into_inner)
}

/// From now on, whatever lies below `root` is reached through no link. The path to `root`, which the user gave, may hold some.
pub fn guard(root: &Path) {
    if let Ok(root) = std::path::absolute(root) {
        *roots().entry(root).or_default() += 1;
    }
}

/// Takes one [`guard`] back: the folder was refused, and its links are those of its owner.
pub(super) fn release(root: &Path) {
    let Ok(root) = std::path::absolute(root) else { return };
    let mut roots = roots();
    if let Some(count) = roots.get_mut(&root) {
        *count -= 1;
        if *count == 0 {
            roots.remove(&root);
        }
    }
}

/// Guards the same folder in another process of this program, which works on `file`: to it, the folder of a point of a sweep is one that the
/// user gave.
pub fn share(command: &mut Command, file: &Path) {
    if let Some(root) = std::path::absolute(file).ok().and_then(|file| guarded(&file).map(Path::to_path_buf)) {
        command.env(VARIABLE, root);
    }
}

/// The outermost guarded folder of an absolute path, which all below it is relative to.
fn guarded(path: &Path) -> Option<&Path> {
    let roots = ROOTS.read().unwrap_or_else(PoisonError::into_inner);
    path.ancestors().filter(|folder| roots.contains_key(*folder)).last()
}

/// A path for system calls, which must not follow its last part. The folder of a guarded one stays open while this value lives, so that
/// nothing in place of a folder above it changes where the path leads.
#[derive(Debug)]
pub struct Reached {
    path: PathBuf,
    folder: Option<system::Folder>,
}

impl Reached {
    pub fn is_guarded(&self) -> bool {
        self.folder.is_some()
    }
}

impl Deref for Reached {
    type Target = Path;

    fn deref(&self) -> &Path {
        &self.path
    }
}

impl AsRef<Path> for Reached {
    fn as_ref(&self) -> &Path {
        &self.path
    }
}

/// The way to a file or a folder. One that is not below a guarded folder is as it was given.
///
/// # Errors
/// Those of the file system; a link on the way from a guarded folder to the last part of the path.
pub fn reach(path: &Path) -> io::Result<Reached> {
    reach_with(path, system::open)
}

type Open = fn(&Path, &Path) -> io::Result<system::Folder>;

fn reach_with(path: &Path, open: Open) -> io::Result<Reached> {
    let absolute = std::path::absolute(path)?;
    let below = guarded(&absolute).and_then(|root| Some((root, absolute.strip_prefix(root).ok()?)));
    // A path with `..` is the user's: names in files are refused where they hold one.
    let below = below.filter(|(_, below)| below.components().all(|c| matches!(c, Component::Normal(_))));
    let Some((root, (folder, name))) =
        below.and_then(|(root, below)| Some((root, (below.parent()?, below.file_name()?))))
    else {
        return Ok(Reached { path: path.to_path_buf(), folder: None });
    };
    let folder = open(root, folder)?;
    let way = system::way(&folder).map_or(absolute.clone(), |way| way.join(name));
    Ok(Reached { path: way, folder: Some(folder) })
}

/// As [`reach`], of a folder whose entries are read: its last part is no link either.
///
/// # Errors
/// As [`reach`].
pub fn reach_folder(path: &Path) -> io::Result<Reached> {
    // The folder of an entry of any name.
    let reached = reach(&path.join("entry"))?;
    let path =
        if reached.is_guarded() { reached.path.parent().unwrap_or(path).to_path_buf() } else { path.to_path_buf() };
    Ok(Reached { path, ..reached })
}

/// Creates a folder and those above it.
///
/// # Errors
/// Those of the file system; a link in place of one of them, below a guarded folder.
pub fn create_folders(path: &Path) -> io::Result<()> {
    if path.as_os_str().is_empty() || reach(path).is_ok_and(|found| !found.is_guarded()) {
        return std::fs::create_dir_all(path);
    }
    create_guarded(path)
}

fn create_guarded(path: &Path) -> io::Result<()> {
    let reached = match reach(path) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => {
            path.parent().map_or(Ok(()), create_folders)?;
            reach(path)?
        }
        reached => reached?,
    };
    match std::fs::create_dir(&reached) {
        Err(e) if e.kind() == io::ErrorKind::AlreadyExists && reached.symlink_metadata()?.is_dir() => Ok(()),
        created => created,
    }
}

#[cfg(target_os = "linux")]
mod system {
    use rustix::fs::{CWD, Mode, OFlags, ResolveFlags, openat, openat2};
    use rustix::io::Errno;
    use std::io;
    use std::os::fd::{AsRawFd, OwnedFd};
    use std::path::{Path, PathBuf};

    pub(super) type Folder = OwnedFd;

    const FOLDER: OFlags = OFlags::PATH.union(OFlags::DIRECTORY).union(OFlags::CLOEXEC);

    /// A folder below `root`.
    pub(super) fn open(root: &Path, below: &Path) -> io::Result<Folder> {
        let held = openat(CWD, root, FOLDER, Mode::empty())?;
        if below.as_os_str().is_empty() {
            return Ok(held);
        }
        match openat2(&held, below, FOLDER, Mode::empty(), ResolveFlags::BENEATH | ResolveFlags::NO_SYMLINKS) {
            // Before Linux 5.6, in containers that do not know the call, and while something above is renamed.
            Err(Errno::NOSYS | Errno::PERM | Errno::AGAIN) => by_steps(held, below),
            opened => opened.map_err(|e| said(e, below)),
        }
    }

    /// As `openat2`, one part of the path after the other.
    pub(super) fn by_steps(root: Folder, below: &Path) -> io::Result<Folder> {
        below.iter().try_fold(root, |folder, part| {
            openat(&folder, part, FOLDER | OFlags::NOFOLLOW, Mode::empty()).map_err(|e| said(e, below))
        })
    }

    fn said(error: Errno, below: &Path) -> io::Error {
        match error {
            Errno::LOOP => io::Error::other(format!("{} leads through a link", below.display())),
            // Of a link, too, where it is opened by steps.
            Errno::NOTDIR => io::Error::new(
                io::ErrorKind::NotADirectory,
                format!("{} leads through a file or a link", below.display()),
            ),
            other => other.into(),
        }
    }

    /// A path to the folder, whatever is in its former place; none without `/proc`.
    pub(super) fn way(folder: &Folder) -> Option<PathBuf> {
        let way = PathBuf::from(format!("/proc/self/fd/{}", folder.as_raw_fd()));
        way.exists().then_some(way)
    }
}

#[cfg(not(target_os = "linux"))]
mod system {
    use std::io;
    use std::path::{Path, PathBuf};

    pub(super) type Folder = ();

    /// Looks at every folder before the path is used.
    pub(super) fn open(root: &Path, below: &Path) -> io::Result<Folder> {
        let mut folder = root.to_path_buf();
        for part in below {
            folder.push(part);
            if std::fs::symlink_metadata(&folder)?.is_symlink() {
                return Err(io::Error::other(format!("{} leads through a link", below.display())));
            }
        }
        Ok(())
    }

    pub(super) fn way(_: &Folder) -> Option<PathBuf> {
        None
    }
}

#[cfg(test)]
#[cfg(target_os = "linux")]
mod tests {
    use super::super::atomic_file::{self, read_text, write_atomic};
    use super::*;
    use std::fs;
    use std::io::Write;
    use std::os::unix::fs::symlink;

    fn by_steps(root: &Path, below: &Path) -> io::Result<system::Folder> {
        system::by_steps(system::open(root, Path::new(""))?, below)
    }

    /// Neither read nor written, created nor removed, listed nor renamed through a link in place of a folder, at any depth, with and without
    /// `openat2`. What it leads to stays as it is.
    #[test]
    fn nothing_is_reached_through_a_link_below_a_guarded_folder() {
        let scratch = tempfile::tempdir().expect("scratch");
        let (real, victim) = (scratch.path().join("real"), scratch.path().join("victim"));
        fs::create_dir_all(real.join("a/b")).expect("made");
        fs::create_dir_all(victim.join("b")).expect("made");
        for folder in [real.join("a"), real.join("a/b"), victim.clone(), victim.join("b")] {
            fs::write(folder.join("file"), "precious").expect("written");
        }
        fs::write(real.join("kept"), "kept").expect("written");
        // The way to the folder may hold a link.
        let root = scratch.path().join("way");
        symlink(&real, &root).expect("linked");
        guard(&root);
        for name in ["a/file", "a/b/file"] {
            let file = root.join(name);
            assert_eq!(read_text(&file).expect("read"), "precious");
            write_atomic(&file, |w| w.write_all(b"written")).expect("written");
            assert_eq!(fs::read_to_string(&file).expect("read"), "written");
        }
        create_folders(&root.join("a/c/d")).expect("made");
        create_folders(&root.join("a/c/d")).expect("there");
        assert!(real.join("a/c/d").is_dir());
        assert_eq!(atomic_file::list(&root.join("a/c")).expect("listed"), [("d".to_string(), root.join("a/c/d"))]);
        for (place, names) in [("a", ["a/file", "a/b/file"]), ("a/b", ["a/b/file", "a/b/new"])] {
            fs::rename(real.join(place), real.join("aside")).expect("moved");
            symlink(victim.join(place.strip_prefix("a").expect("below").trim_start_matches('/')), real.join(place))
                .expect("linked");
            for name in names {
                let file = root.join(name);
                for open in [system::open as Open, by_steps] {
                    assert!(reach_with(&file, open).expect_err("a link").to_string().contains("link"), "{name}");
                }
                assert!(read_text(&file).is_err() && write_atomic(&file, |w| w.write_all(b"lost")).is_err());
                assert!(atomic_file::create(&file).is_err() && atomic_file::remove(&file).is_err());
                assert!(atomic_file::list(file.parent().expect("has one")).is_err());
                assert!(atomic_file::remove_folder(&file).is_err() && atomic_file::append(&file, "lost").is_err());
                assert!(atomic_file::is_empty(file.parent().expect("has one")).is_err());
                assert!(atomic_file::link_or_copy(&file, &root.join("moved")).is_err());
                assert!(atomic_file::link_or_copy(&root.join("kept"), &file).is_err());
                assert!(create_folders(&file).is_err() && atomic_file::rename(&file, &root.join("moved")).is_err());
            }
            fs::remove_file(real.join(place)).expect("removed");
            fs::rename(real.join("aside"), real.join(place)).expect("moved");
        }
        // In place of the file itself.
        fs::remove_file(real.join("a/file")).expect("removed");
        symlink(victim.join("file"), real.join("a/file")).expect("linked");
        let file = root.join("a/file");
        assert!(read_text(&file).is_err() && atomic_file::create(&file).is_err());
        assert!(atomic_file::append(&file, "lost").is_err() && !root.join("moved").exists());
        for folder in [victim.clone(), victim.join("b")] {
            assert_eq!(fs::read_to_string(folder.join("file")).expect("read"), "precious");
        }
        assert_eq!(
            (fs::read_dir(&victim).expect("listed").count(), fs::read_dir(victim.join("b")).expect("listed").count()),
            (2, 1)
        );
        assert_eq!(descriptors(&real), 0);
    }

    /// Files and folders below `folder` that this process has open.
    fn descriptors(folder: &Path) -> usize {
        let open = fs::read_dir("/proc/self/fd").expect("listed").flatten();
        open.filter(|entry| fs::read_link(entry.path()).is_ok_and(|to| to.starts_with(folder))).count()
    }

    /// A process that works on a file below gets the outermost folder, also one with a colon in its name.
    #[test]
    fn a_process_guards_the_folder_of_its_file() {
        let scratch = tempfile::tempdir().expect("scratch");
        let root = scratch.path().join("a:b");
        let given = |file: &Path| {
            let mut command = Command::new("true");
            share(&mut command, file);
            command.get_envs().find_map(|(name, value)| (name == VARIABLE).then(|| value.map(PathBuf::from)).flatten())
        };
        for folder in [root.join("points/1"), root.clone()] {
            assert_eq!(given(&scratch.path().join("log")), None);
            guard(&folder);
            assert_eq!(given(&root.join("points/1/log")), Some(folder));
        }
    }

    /// Another program changes a folder into a link and back, as fast as it can, while files are written, read and removed.
    #[test]
    fn links_that_come_and_go_lead_nowhere() {
        let scratch = tempfile::tempdir().expect("scratch");
        let (root, victim) = (scratch.path().join("root"), scratch.path().join("victim"));
        for folder in [root.join("stage"), victim.clone()] {
            fs::create_dir_all(&folder).expect("made");
            fs::write(folder.join("file"), "precious").expect("written");
        }
        guard(&root);
        let (stage, aside) = (root.join("stage"), root.join("aside"));
        let change = || {
            fs::rename(&stage, &aside).expect("moved");
            symlink(&victim, &stage).expect("linked");
            fs::remove_file(&stage).expect("removed");
            fs::rename(&aside, &stage).expect("moved");
        };
        let use_files = || {
            let file = stage.join("file");
            let _ = write_atomic(&file, |w| w.write_all(b"written"));
            let _ = read_text(&file);
            let _ = atomic_file::put(&stage, "new", "lost").and_then(|new| atomic_file::remove(&new));
            // The folder above is not created where it is not found.
            let deep = stage.join("deep");
            let _ = reach(&deep).and_then(fs::create_dir).is_ok() && atomic_file::remove_folder(&deep).is_ok();
        };
        let users: Vec<_> = std::thread::scope(|scope| {
            let users: Vec<_> = (0..2).map(|_| scope.spawn(|| (0..500).for_each(|_| use_files()))).collect();
            while !users.iter().all(std::thread::ScopedJoinHandle::is_finished) {
                change();
            }
            users.into_iter().map(std::thread::ScopedJoinHandle::join).collect()
        });
        assert!(users.iter().all(Result::is_ok));
        assert_eq!(fs::read_to_string(victim.join("file")).expect("read"), "precious");
        assert_eq!(fs::read_dir(&victim).expect("listed").count(), 1);
        assert_eq!(read_text(&stage.join("file")).expect("read"), "written");
    }

    /// As LAMMPS does, whose files are its own: nothing in place of its folder changes where it works.
    #[test]
    fn a_process_starts_in_the_folder_that_was_opened() {
        let scratch = tempfile::tempdir().expect("scratch");
        let (root, victim) = (scratch.path().join("root"), scratch.path().join("victim"));
        for folder in [root.join("stage/job"), victim.join("job")] {
            fs::create_dir_all(folder).expect("made");
        }
        guard(&root);
        let place = reach_folder(&root.join("stage/job")).expect("opened");
        fs::rename(root.join("stage"), root.join("aside")).expect("moved");
        symlink(&victim, root.join("stage")).expect("linked");
        let ended = Command::new("/bin/sh").args(["-c", "echo text > log"]).current_dir(&place).status();
        assert!(ended.expect("started").success());
        assert!(root.join("aside/job/log").exists() && !victim.join("job/log").exists());
        assert!(reach_folder(&root.join("stage/job")).is_err());
    }

    /// Folders above, and those that make the path absolute, may be reached by `..` and by links, and a file needs no folder.
    #[test]
    fn ways_of_the_user_to_a_folder_stay_as_they_are() {
        let scratch = tempfile::tempdir().expect("scratch");
        fs::create_dir_all(scratch.path().join("a/run")).expect("made");
        symlink(scratch.path().join("a"), scratch.path().join("link")).expect("linked");
        for way in ["a/../a/run", "link/run", "link/../a/./run/"] {
            let root = scratch.path().join(way);
            guard(&root);
            create_folders(&root.join("stage")).expect("made");
            write_atomic(&root.join("stage/file"), |w| w.write_all(way.as_bytes())).expect("written");
            assert_eq!(read_text(&root.join("stage/file")).expect("read"), way);
            assert_eq!(read_text(&scratch.path().join("a/run/../run/stage/file")).expect("read"), way);
            assert!(reach(&root.join("stage/file")).expect("reached").is_guarded(), "{way}");
        }
        create_folders(Path::new("")).expect("the working folder");
        assert!(atomic_file::list(&scratch.path().join("link")).is_ok());
    }

    /// Errors name files as the user does, and not by what leads to them.
    #[test]
    fn errors_name_the_file_and_no_descriptor() {
        let scratch = tempfile::tempdir().expect("scratch");
        guard(scratch.path());
        fs::write(scratch.path().join("file"), "text").expect("written");
        let below = scratch.path().join("file/name");
        let none = scratch.path().join("none/name");
        for file in [&below, &none] {
            let said = [
                write_atomic(file, |_| Ok(())).expect_err("no folder").to_string(),
                read_text(file).expect_err("no file").to_string(),
                atomic_file::list(file).expect_err("no folder").to_string(),
            ];
            for said in said {
                assert!(said.contains(&file.display().to_string()) && !said.contains("/proc/"), "{said}");
            }
        }
    }
}
