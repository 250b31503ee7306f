//! Atomic file writes: a file appears under its name only when it is complete.

use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::beneath::{Reached, create_folders, reach, reach_folder};
use asperity_grid::error::{Error, Result};
use asperity_grid::sys::expect_memory;
use asperity_grid::sys::ranks::Ranks;

/// Beginning of the names of files that are not complete.
pub const PARTIAL: &str = ".partial-";

/// A temporary file next to its final name; deleted unless [`AtomicFile::commit`] succeeds.
pub struct AtomicFile {
    path: PathBuf,
    file: BufWriter<tempfile::NamedTempFile>,
    /// Where it is renamed to; after the file, which is removed by way of this folder.
    reached: Reached,
}

impl AtomicFile {
    /// Opens a temporary file in the folder of `path`: a rename cannot cross file systems.
    pub fn open(path: &Path) -> Result<Self> {
        let reached = reach(path).map_err(Error::io("create", path))?;
        let folder = reached.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let mut builder = tempfile::Builder::new();
        builder.prefix(PARTIAL);
        // The default mode of a temporary file is 0600; these files are for others, so the umask decides.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let file = builder.tempfile_in(folder).map_err(|e| Error::io("create", path)(without_path(&e)))?;
        Ok(AtomicFile { path: path.to_path_buf(), file: BufWriter::with_capacity(1 << 18, file), reached })
    }

    /// Syncs to disk and renames: after a power failure the file has either the old or the new contents, complete.
    pub fn commit(self) -> Result<()> {
        let file = self.file.into_inner().map_err(|e| Error::io("write", &self.path)(e.into_error()))?;
        file.as_file().sync_data().map_err(Error::io("write", &self.path))?;
        file.persist(&self.reached).map_err(|e| Error::io("write", &self.path)(e.error))?;
        Ok(())
    }
}

/// An error of a temporary file without its path, which nobody knows.
fn without_path(error: &io::Error) -> io::Error {
    let text = error.to_string();
    io::Error::new(error.kind(), text.split(" at path ").next().unwrap_or_default())
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for AtomicFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

/// Writes `path` atomically; errors of `fill` are reported with the file name.
pub fn write_atomic(path: &Path, fill: impl FnOnce(&mut AtomicFile) -> io::Result<()>) -> Result<()> {
    let mut file = AtomicFile::open(path)?;
    fill(&mut file).map_err(Error::io("write", path))?;
    file.commit()
}

/// As [`write_atomic`], a file of `bytes` bytes that begins with `head`, of which every rank writes its part at its place: `fill` from
/// byte `start` on. The folder is one that all ranks share. Collective: an error of one rank is one of all.
pub fn write_atomic_on_ranks(
    ranks: &Ranks,
    path: &Path,
    (head, bytes): (&[u8], u64),
    start: u64,
    fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<()> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    // The same on all ranks, and another than that of other runs.
    let run = ranks.gather(&[std::process::id()], &vec![1; ranks.count()])[0];
    let partial = path.with_file_name(format!("{PARTIAL}{run}-{name}"));
    let create = || {
        let mut file = create_file(&partial, true)?;
        file.write_all(head)?;
        file.set_len(bytes)
    };
    let write = || {
        let mut file = create_file(&partial, false)?;
        file.seek(SeekFrom::Start(start))?;
        let mut file = BufWriter::with_capacity(1 << 18, file);
        fill(&mut file)?;
        file.into_inner().map_err(io::IntoInnerError::into_error)?.sync_data()
    };
    let written = of_all(ranks, if ranks.is_first() { create() } else { Ok(()) }).and_then(|()| of_all(ranks, write()));
    let done = match &written {
        _ if !ranks.is_first() => Ok(()),
        Ok(()) => reach(&partial).and_then(|from| std::fs::rename(from, reach(path)?)),
        // There may be none.
        Err(_) => reach(&partial).and_then(std::fs::remove_file).or(Ok(())),
    };
    written.and(of_all(ranks, done)).map_err(Error::io("write", path))
}

/// The own error, or that of another rank.
fn of_all(ranks: &Ranks, own: io::Result<()>) -> io::Result<()> {
    /// Of errors that do not come from the system: an error of input or output.
    const EIO: i32 = 5;
    let number = own.as_ref().err().map_or(0, |e| e.raw_os_error().unwrap_or(EIO));
    let lowest = ranks.lowest(-f64::from(number));
    own.and(if lowest < 0.0 { Err(io::Error::from_raw_os_error(-lowest as i32)) } else { Ok(()) })
}

/// Creates a file, or empties it. A link in its place is an error: what it leads to is not this program's.
///
/// # Errors
/// `Io`.
pub fn create(path: &Path) -> Result<File> {
    create_file(path, true).map_err(Error::io("create", path))
}

/// As [`create`], with the contents as they are.
///
/// # Errors
/// `Io`.
pub fn open_kept(path: &Path) -> Result<File> {
    create_file(path, false).map_err(Error::io("open", path))
}

/// Writes at the end of a file, which is created if need be, without following a link in its place.
///
/// # Errors
/// `Io`.
pub fn append(path: &Path, bytes: impl AsRef<[u8]>) -> Result<()> {
    let write = || open_to_write(File::options().append(true), path)?.write_all(bytes.as_ref());
    write().map_err(Error::io("write", path))
}

/// As [`create`]; without `truncate` the contents stay.
pub(super) fn create_file(path: &Path, truncate: bool) -> io::Result<File> {
    open_to_write(File::options().write(true).truncate(truncate), path)
}

fn open_to_write(options: &mut OpenOptions, path: &Path) -> io::Result<File> {
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(options, libc::O_NOFOLLOW | libc::O_NONBLOCK);
    options.create(true).open(reach(path)?)
}

/// Opens a file for reading and returns its length in bytes. A pipe or a device has no length; opening one may block, and
/// reading one may not end.
///
/// # Errors
/// `Format` for folders, pipes, sockets and devices; `Io`.
pub fn open_regular(path: &Path) -> Result<(File, u64)> {
    let io = || Error::io("read", path);
    let reached = reach(path).map_err(io())?;
    let metadata = if reached.is_guarded() { reached.symlink_metadata() } else { reached.metadata() }.map_err(io())?;
    let mut options = File::options();
    // Something else may have been put in its place.
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(
        &mut options,
        libc::O_NONBLOCK | if reached.is_guarded() { libc::O_NOFOLLOW } else { 0 },
    );
    let opened = metadata.is_file().then(|| options.read(true).open(&reached)).transpose().map_err(io())?;
    let metadata = opened.as_ref().map_or(Ok(metadata), File::metadata).map_err(io())?;
    match opened {
        Some(file) if metadata.is_file() => Ok((file, metadata.len())),
        _ => {
            let kind = match metadata {
                m if m.is_dir() => "a folder",
                m if m.is_symlink() => "a link",
                _ => "a pipe, socket or device",
            };
            Err(Error::format(path, kind, "a regular file (the output of a pipe can be written into one)"))
        }
    }
}

/// Bytes up to which a file is read without a look at the memory.
const SMALL: u64 = 1 << 24;

/// Opens a file that memory can hold with what is made of it.
///
/// # Errors
/// As [`open_regular`]; `Memory`.
fn open_whole(path: &Path) -> Result<File> {
    let (file, bytes) = open_regular(path)?;
    if bytes > SMALL {
        expect_memory(path.display().to_string(), bytes.saturating_mul(2), "it is read whole")?;
    }
    Ok(file)
}

/// Refuses a file that memory cannot hold.
///
/// # Errors
/// As [`open_regular`]; `Memory`.
pub fn expect_to_hold(path: &Path) -> Result<()> {
    open_whole(path).map(drop)
}

/// Reads a file whole.
///
/// # Errors
/// As [`open_regular`]; `Memory`.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    let mut file = open_whole(path)?;
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(Error::io("read", path))?;
    Ok(bytes)
}

/// Reads a text file; errors name the file, also if it is not UTF-8.
///
/// # Errors
/// As [`read_bytes`].
pub fn read_text(path: &Path) -> Result<String> {
    let mut file = open_whole(path)?;
    let mut text = String::new();
    file.read_to_string(&mut text).map_err(Error::io("read", path))?;
    Ok(text)
}

/// Names and paths of what is in a folder, without names that are no text.
///
/// # Errors
/// `Io`.
pub fn list(folder: &Path) -> Result<Vec<(String, PathBuf)>> {
    let named = |entry: io::Result<std::fs::DirEntry>| match entry {
        Ok(entry) => entry.file_name().into_string().ok().map(|name| Ok((name.clone(), folder.join(name)))),
        Err(e) => Some(Err(Error::io("list", folder)(e))),
    };
    let reached = reach_folder(folder).map_err(Error::io("list", folder))?;
    std::fs::read_dir(&reached).map_err(Error::io("list", folder))?.filter_map(named).collect()
}

/// Whether nothing lies in a folder.
///
/// # Errors
/// `Io`.
pub fn is_empty(folder: &Path) -> Result<bool> {
    let entries = reach_folder(folder).and_then(|folder| std::fs::read_dir(&folder));
    entries.map(|mut entries| entries.next().is_none()).map_err(Error::io("list", folder))
}

/// Gives a file a second name in place of what has it, which needs no disk space; file systems without links get a copy.
///
/// # Errors
/// As [`open_regular`]; `Io`. What has the name stays until the other is whole.
pub fn link_or_copy(from: &Path, to: &Path) -> Result<()> {
    let (mut file, _) = open_regular(from)?;
    let name = to.file_name().unwrap_or_default().to_string_lossy();
    let partial = to.with_file_name(format!("{PARTIAL}{name}"));
    remove(&partial)?;
    let link = || std::fs::hard_link(reach(from)?, reach(&partial)?);
    let copy = |_| io::copy(&mut file, &mut create_file(&partial, true)?).map(drop);
    link().or_else(copy).map_err(Error::io("copy", from))?;
    rename(&partial, to)?;
    // Two names of one file stay two.
    remove(&partial)
}

/// Writes a file of a folder, and returns its path.
///
/// # Errors
/// `Io`.
pub fn put(folder: &Path, name: &str, bytes: impl AsRef<[u8]>) -> Result<PathBuf> {
    let file = folder.join(name);
    create(&file)?.write_all(bytes.as_ref()).map_err(Error::io("write", &file)).map(|()| file)
}

/// Removes a file, if it is there.
///
/// # Errors
/// `Io`.
pub fn remove(file: &Path) -> Result<()> {
    match reach(file).and_then(std::fs::remove_file) {
        Err(e) if e.kind() != io::ErrorKind::NotFound => Err(Error::io("remove", file)(e)),
        _ => Ok(()),
    }
}

/// Creates a folder and those above it.
///
/// # Errors
/// `Io`.
pub fn create_folder(folder: &Path) -> Result<()> {
    create_folders(folder).map_err(Error::io("create", folder))
}

/// Removes a folder with what is in it.
///
/// # Errors
/// `Io`.
pub fn remove_folder(folder: &Path) -> Result<()> {
    // Of a link in its place the link is removed.
    reach(folder).and_then(std::fs::remove_dir_all).map_err(Error::io("remove", folder))
}

/// When a file, folder or link of this name was written; `None` where there is none.
pub fn written_at(file: &Path) -> Option<SystemTime> {
    reach(file).and_then(|file| file.symlink_metadata()?.modified()).ok()
}

/// Moves a file or folder within a file system.
///
/// # Errors
/// `Io`.
pub fn rename(from: &Path, to: &Path) -> Result<()> {
    reach(from).and_then(|from| std::fs::rename(from, reach(to)?)).map_err(Error::io("write", to))
}

/// I/O error for an iterator with too few or too many values.
pub fn miscount(description: &str, given: impl std::fmt::Display, requested: usize) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, format!("{given} {description} were given where {requested} belong"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_litter() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_atomic(&path, |w| w.write_all(b"old")).unwrap();
        let failed = write_atomic(&path, |w| {
            w.write_all(b"new")?;
            Err(io::Error::other("the well ran dry"))
        });
        assert!(failed.unwrap_err().to_string().contains("the well ran dry"));
        assert_eq!(read_text(&path).unwrap(), "old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
