//! Hashes, the lock, and the command line by hand of a job folder.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::time::Duration;

use asperity_grid::{Error, Result};
use asperity_surface::files::atomic_file::put;
use asperity_surface::files::file_lock;
use asperity_surface::files::inside::expect_plain;

/// Command line by hand, and the `-var` arguments of the script in it.
pub(super) const RUN_SCRIPT: &str = "run.sh";
pub(super) const VARIABLES_FILE: &str = "in.vars";

/// Writes `run.sh`, which runs a job from its first step with LAMMPS's own minimisers, and the variables of its script into `in.vars`.
///
/// # Errors
/// `Io`.
pub(super) fn write_run_script(folder: &Path, script: &str, variables: &[(String, String)]) -> Result<()> {
    let variables: String = variables.iter().map(|(name, value)| format!("-var {name} {value}\n")).collect();
    put(folder, VARIABLES_FILE, variables)?;
    put(folder, RUN_SCRIPT, include_str!("run.sh").replace("@SCRIPT@", script)).map(drop)
}

/// Removes what [`write_run_script`] wrote for an earlier job.
pub(super) fn remove_run_script(folder: &Path) {
    for name in [VARIABLES_FILE, RUN_SCRIPT] {
        // Usually there is none.
        let _ = std::fs::remove_file(folder.join(name));
    }
}

/// A writer that also computes the BLAKE3 hash of the bytes written.
pub(super) struct Hashing<W> {
    pub file: W,
    pub hasher: blake3::Hasher,
}

impl<W: Write> Write for Hashing<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.write(bytes)?;
        self.hasher.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Attempts to take the lock before it is assumed to belong to another program. A child process that another thread
/// has just forked keeps all files of this process open until it calls exec.
const ATTEMPTS: usize = 25;
const RETRY_AFTER: Duration = Duration::from_millis(40);

/// Locks a job folder against a second program. The lock ends with the process.
///
/// # Errors
/// `Lammps` if another program has locked the folder, `Format` for a link in it, `Io`.
pub(super) fn lock(folder: &Path) -> Result<File> {
    expect_plain(folder)?;
    let path = folder.join("job.lock");
    let file = file_lock::open(&path).map_err(Error::io("create", &path))?;
    for _ in 0..ATTEMPTS {
        if file_lock::try_lock(&file).map_err(Error::io("lock", &path))? {
            return Ok(file);
        }
        std::thread::sleep(RETRY_AFTER);
    }
    Err(Error::lammps(folder, "another program is writing or running this job"))
}
