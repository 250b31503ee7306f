//! Hashes, the lock, and the command line by hand of a job folder.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::time::Duration;

use asperity_grid::{Error, Result};
use asperity_surface::files::atomic_file::{put, remove};
use asperity_surface::files::file_lock;
use asperity_surface::files::inside::expect_plain;
use asperity_surface::files::processes;

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
        let _ = remove(&folder.join(name));
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

/// Attempts to take the lock before it is assumed to belong to another program. LAMMPS ends up to three seconds after an asperity that was
/// killed, and has its lock until then.
const ATTEMPTS: usize = 125;
const RETRY_AFTER: Duration = Duration::from_millis(40);

/// Argument of LAMMPS in every run of a job, by `run.sh`, too.
const OF_LAMMPS: &str = "-log";

/// Locks a job folder against a second program. The lock ends with the process, and with the LAMMPS that inherited it. Launchers that close
/// all files of what they start leave LAMMPS without it, as does a run by hand: it is found by its working folder on this machine.
///
/// # Errors
/// `Lammps` if another program has locked the folder, which it names, `Format` for a link in it, `Io`.
pub(super) fn lock(folder: &Path) -> Result<File> {
    expect_plain(folder)?;
    let path = folder.join("job.lock");
    let file = file_lock::open(&path).map_err(Error::io("create", &path))?;
    let mut holder = None;
    for _ in 0..ATTEMPTS {
        let is_locked = file_lock::try_lock(&file).map_err(Error::io("lock", &path))?;
        holder = processes::working_in(folder, OF_LAMMPS);
        if is_locked && holder.is_none() {
            return Ok(file);
        }
        std::thread::sleep(RETRY_AFTER);
    }
    let holder = holder.or_else(|| processes::with_file(&path)).unwrap_or_else(|| "another program".into());
    Err(Error::lammps(folder, format!("{holder} is writing or running this job: wait for its end, or end it")))
}
