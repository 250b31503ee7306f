//! Locks that keep two programs out of one folder. They end with the process.

use std::fs::{File, TryLockError};
use std::io;
use std::path::Path;

use super::atomic_file::create_file;

/// Opens the file of a lock, and creates it if need be. Its contents stay as they are.
///
/// # Errors
/// Those of the file system; a link in its place.
pub fn open(path: &Path) -> io::Result<File> {
    create_file(path, false)
}

/// Locks a file; `false` if another program has locked it. A file system without locks, as some mounts of Lustre, cannot keep two programs
/// apart; there the file counts as locked.
///
/// # Errors
/// Those of the file system.
pub fn try_lock(file: &File) -> io::Result<bool> {
    is_locked(file.try_lock())
}

fn is_locked(answer: Result<(), TryLockError>) -> io::Result<bool> {
    match answer {
        Ok(()) => Ok(true),
        Err(TryLockError::WouldBlock) => Ok(false),
        Err(TryLockError::Error(e)) => match e.raw_os_error() {
            Some(libc::ENOSYS | libc::EOPNOTSUPP | libc::ENOLCK) => Ok(true),
            _ => Err(e),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_lock_is_refused() {
        let folder = tempfile::tempdir().expect("scratch");
        let path = folder.path().join("lock");
        let [first, second] = [(); 2].map(|()| File::create(&path).expect("created"));
        assert!(try_lock(&first).expect("answered"));
        assert!(!try_lock(&second).expect("answered"));
        drop(first);
        assert!(try_lock(&second).expect("answered"));
    }

    #[test]
    fn file_systems_without_locks_do_not_refuse() {
        let failed = |code| is_locked(Err(TryLockError::Error(io::Error::from_raw_os_error(code))));
        for code in [libc::ENOSYS, libc::EOPNOTSUPP, libc::ENOLCK] {
            assert!(failed(code).expect("no refusal"));
        }
        assert!(failed(libc::EIO).is_err());
    }
}
