//! Errors of the crate. Each message names the file or flag, the key, the value found and the values accepted.
//!
//! Every variant has one exit code ([`Error::exit_code`]). The texts are complete messages: callers only put "error: " in front.

use std::path::{Path, PathBuf};

/// A result with this crate's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

/// One invalid value of a scene, a flag or a file. All of a scene are collected and reported together.
#[derive(Debug, Clone, PartialEq)]
pub struct Complaint {
    /// Dotted path of the key (`surface.hurst`) or the flag (`--tol`).
    pub key: String,
    pub found: String,
    pub accepted: String,
}

impl Complaint {
    pub fn new(key: impl Into<String>, found: impl ToString, accepted: impl Into<String>) -> Self {
        Complaint { key: key.into(), found: found.to_string(), accepted: accepted.into() }
    }
}

impl std::fmt::Display for Complaint {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} = {}; accepted: {}", self.key, self.found, self.accepted)
    }
}

/// Why a LAMMPS run failed ([`Error::Lammps`]).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LammpsFailure {
    #[error("it stopped with: {0}")]
    Message(String),
    #[error("it ended with exit status {0} and no error message")]
    Status(i32),
    #[error("it was killed by signal {0}")]
    Signal(i32),
    #[error("its log has no 'Total wall time' line, so it did not finish")]
    Unfinished,
    #[error("the atom count changed from {before} to {after}")]
    AtomCount { before: u64, after: u64 },
    #[error("it ran past the time limit of {seconds} s")]
    TimeLimit { seconds: f64 },
    #[error("it lacks {missing}, which the scene needs")]
    MissingStyle { missing: String },
    #[error("{0}")]
    Output(String),
}

impl<T: Into<String>> From<T> for LammpsFailure {
    fn from(description: T) -> Self {
        LammpsFailure::Output(description.into())
    }
}

/// Bytes in MB or GB.
fn size(bytes: u64) -> String {
    match bytes as f64 {
        b if b < 1e8 => format!("{:.1} MB", b / 1e6),
        b => format!("{:.2} GB", b / 1e9),
    }
}

#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A scene file or a command line with one or more invalid values.
    #[error("{}", complaints(.place, .list))]
    Input { place: String, list: Vec<Complaint> },
    /// A scene file that is not TOML, or has unknown or missing keys, or values of the wrong type, each with its line.
    #[error("{}", lines(.file, .list))]
    Syntax { file: PathBuf, list: Vec<(Option<usize>, String)> },
    /// A file whose contents are not in the expected format.
    #[error("{}: {found}; accepted: {accepted}", one_line(&.file.display().to_string()))]
    Format { file: PathBuf, found: String, accepted: String },
    /// A height that is not a finite number, by index from 0 (row = y, column = x); the message counts from 1, as for lines of text.
    #[error("{place}: the height in row {}, column {} (counted from 1) is {value}; accepted: finite numbers", .row + 1, .column + 1)]
    Height { place: String, row: usize, column: usize, value: f64 },
    /// A solver stopped before it reached its tolerance. `partial` is the file of the last state, if there is a run folder.
    #[error("{method} stopped without converging ({why}) after {iterations} iterations: residual {residual:.3e}, tolerance {tolerance:.1e}{}", kept(.partial))]
    NotConverged {
        method: &'static str,
        why: String,
        iterations: usize,
        residual: f64,
        tolerance: f64,
        partial: Option<PathBuf>,
    },
    /// An accuracy that was asked for was not reached; the results are complete.
    #[error("{0}")]
    Inaccurate(String),
    /// The loads of a run were solved and its report is complete, but the pull-off was not found.
    #[error("the pull-off was not found: {why}; the loads before it are in {}", .kept.display())]
    PullOff { why: String, kept: PathBuf },
    /// A tension separated the surfaces; the loads of the run before it were solved, and its report has them.
    #[error("{why}; accepted: a smaller tension; the loads before it are in {}", .kept.display())]
    ContactLost { why: String, kept: PathBuf },
    /// The requested loads were solved and the report is complete, but an auxiliary solve (a comparison, a reference) failed.
    #[error("{why}; the rest is in {}", .kept.display())]
    AuxiliarySolve { why: String, kept: PathBuf },
    /// LAMMPS was started and failed.
    #[error("LAMMPS failed in {}: {failure}", .folder.display())]
    Lammps { folder: PathBuf, failure: LammpsFailure },
    /// This machine has too little memory for the request.
    #[error("{what} needs {} of memory and {} are available; {advice}", size(*.need), size(*.have))]
    Memory { what: String, need: u64, have: u64, advice: String },
    /// A program is missing on this machine.
    #[error("{program} was not found; {how}")]
    MissingProgram { program: String, how: String },
    /// A program of this machine does not start, or not as it should.
    #[error("{program}: {}; {how}", one_line(.said))]
    Program { program: String, said: String, how: String },
    /// A GPU failed.
    #[error("{name} failed: {}; --device cpu solves without it", one_line(.said))]
    Gpu { name: String, said: String },
    /// A command of the cluster's scheduler failed.
    #[error("{program}: {}", one_line(.said))]
    Cluster { program: String, said: String },
    #[error("interrupted; `run`, `sweep`, `tradeoff`, `atoms run` and `solve --out` resume after what is finished")]
    Interrupted,
    /// Results could not be written on stdout.
    #[error("cannot write on stdout: {source}; files that the command names are complete")]
    Output { source: std::io::Error },
    /// An operation on a file failed.
    #[error("cannot {doing} {}: {source}", one_line(&.path.display().to_string()))]
    Io { doing: &'static str, path: PathBuf, source: std::io::Error },
}

fn complaints(context: &str, list: &[Complaint]) -> String {
    let lines: Vec<String> = list.iter().map(|c| format!("{context}: {c}")).collect();
    lines.join("\n")
}

fn lines(file: &Path, list: &[(Option<usize>, String)]) -> String {
    let place = |line: &Option<usize>| line.map_or(String::new(), |l| format!(", line {l}"));
    let lines: Vec<String> = list.iter().map(|(l, text)| format!("{}{}: {text}", file.display(), place(l))).collect();
    lines.join("\n")
}

/// At most 1000 characters, control characters escaped.
fn one_line(text: &str) -> String {
    let cut = text.char_indices().nth(1000).map_or(text, |(end, _)| &text[..end]);
    let escape = |c: char| if c.is_control() { c.escape_default().to_string() } else { c.into() };
    cut.chars().map(escape).collect()
}

fn kept(partial: &Option<PathBuf>) -> String {
    partial.as_ref().map_or(String::new(), |p| format!("; the partial result is kept in {}", p.display()))
}

impl Error {
    /// A single invalid value of a scene file or a command line.
    pub fn input(
        place: impl ToString,
        key: impl Into<String>,
        found: impl ToString,
        accepted: impl Into<String>,
    ) -> Self {
        Error::Input { place: place.to_string(), list: vec![Complaint::new(key, found, accepted)] }
    }

    /// The same error with `place` (a file or flag) as its origin, and `key` as the name of the value there, if given.
    pub fn with_context(self, context: impl ToString, key: Option<&str>) -> Self {
        match self {
            Error::Input { mut list, .. } => {
                list.iter_mut().for_each(|c| c.key = key.map_or(std::mem::take(&mut c.key), str::to_string));
                Error::Input { place: context.to_string(), list }
            }
            other => other,
        }
    }

    /// The same error with what was found, what is accepted and why a solver stopped as `text` writes it.
    pub fn rewritten(self, text: impl Fn(&str) -> String) -> Self {
        match self {
            Error::Input { place, mut list } => {
                for complaint in &mut list {
                    complaint.found = text(&complaint.found);
                    complaint.accepted = text(&complaint.accepted);
                }
                Error::Input { place, list }
            }
            Error::NotConverged { method, why, iterations, residual, tolerance, partial } => {
                Error::NotConverged { method, why: text(&why), iterations, residual, tolerance, partial }
            }
            other => other,
        }
    }

    /// A file that cannot be used. What was found there may be any text; the message shows it in one line.
    pub fn format(file: impl AsRef<Path>, found: impl ToString, accepted: impl ToString) -> Self {
        let found = one_line(&found.to_string());
        Error::Format { file: file.as_ref().to_path_buf(), found, accepted: accepted.to_string() }
    }

    /// A failure of LAMMPS, or its description.
    pub fn lammps(folder: impl AsRef<Path>, failure: impl Into<LammpsFailure>) -> Self {
        Error::Lammps { folder: folder.as_ref().to_path_buf(), failure: failure.into() }
    }

    /// For `map_err`: `File::open(p).map_err(Error::io("open", p))`.
    pub fn io(doing: &'static str, path: impl AsRef<Path>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.as_ref().to_path_buf();
        move |source| Error::Io { doing, path, source }
    }

    /// Whether a program of this machine is missing, does not start or fails, as opposed to wrong input.
    pub fn is_of_program(&self) -> bool {
        matches!(self, Error::MissingProgram { .. } | Error::Program { .. } | Error::Lammps { .. })
    }

    /// 2 bad input (also a path that is missing or may not be read or written), 3 not converged, 4 LAMMPS failed, 5 not
    /// possible on this machine (memory, a full disk, a missing program), 130 interrupted.
    pub fn exit_code(&self) -> u8 {
        use std::io::ErrorKind::{OutOfMemory, QuotaExceeded, StorageFull};
        match self {
            Error::Input { .. } | Error::Syntax { .. } | Error::Format { .. } | Error::Height { .. } => 2,
            Error::NotConverged { .. }
            | Error::Inaccurate(_)
            | Error::PullOff { .. }
            | Error::ContactLost { .. }
            | Error::AuxiliarySolve { .. } => 3,
            Error::Lammps { .. } => 4,
            Error::Memory { .. } | Error::MissingProgram { .. } | Error::Program { .. } | Error::Output { .. } => 5,
            Error::Cluster { .. } | Error::Gpu { .. } => 5,
            Error::Io { source, .. } => match source.kind() {
                StorageFull | QuotaExceeded | OutOfMemory => 5,
                // A missing or unwritable path is a wrong argument.
                _ => 2,
            },
            Error::Interrupted => 130,
        }
    }
}
