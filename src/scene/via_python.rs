//! Files that SurfaceTopography reads: `python -m asperity.convert` writes them as NetCDF into a temporary folder.

use crate::{Error, Result};
use asperity_grid::sys::group;
use asperity_surface::heights::Touching;
use asperity_surface::import::{self, Fourier, ImportOptions, ImportedFile};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// A file of an instrument takes seconds: a converter that takes an hour hangs.
const LIMIT: Duration = Duration::from_secs(3600);

/// Bytes that are read of what the converter prints.
const MOST_BYTES: u64 = 1 << 20;

const INSTALL: &str = "pip install \"asperity[files]\" for it, or ASPERITY_PYTHON = a Python that has both";

/// The Python that converts files, and its options.
#[derive(Debug, Clone, PartialEq)]
pub struct Converter {
    /// The interpreter. Default: the one that the environment variable `ASPERITY_PYTHON` names, or `python3`.
    pub python: PathBuf,
    /// Which points touch first. `None`: the high ones, as files of instruments have them.
    pub touching: Option<Touching>,
}

impl Default for Converter {
    fn default() -> Self {
        let named = std::env::var_os("ASPERITY_PYTHON").filter(|name| !name.is_empty());
        Converter { python: named.unwrap_or_else(|| "python3".into()).into(), touching: None }
    }
}

/// Reads a file of heights or Fourier coefficients, with a converter by SurfaceTopography.
///
/// # Errors
/// Those of [`import::read`]; a Python, asperity or SurfaceTopography that was not found; what the converter says.
pub fn read_heights(path: &Path, options: ImportOptions, converter: Option<&Converter>) -> Result<ImportedFile> {
    let Some(converter) = converter else { return import::read(path, options) };
    let folder = tempfile::tempdir().map_err(Error::io("create a folder in", std::env::temp_dir()))?;
    let map = folder.path().join("map.nc");
    let warnings = converter.convert(path, options, &map)?;
    let fourier = Some(options.fourier.unwrap_or(Fourier::None));
    let mut imported =
        import::read(&map, ImportOptions { fourier, dataset: None, ..options }).map_err(|e| match e {
            Error::Format { found, accepted, .. } => Error::format(path, found, accepted),
            Error::Height { row, column, value, .. } => {
                Error::Height { place: path.display().to_string(), row, column, value }
            }
            other => other,
        })?;
    imported.layout = "through SurfaceTopography".into();
    imported.warnings.splice(0..0, warnings);
    Ok(imported)
}

impl Converter {
    /// Writes `map`, and returns the warnings.
    fn convert(&self, path: &Path, options: ImportOptions, map: &Path) -> Result<Vec<String>> {
        // Relative names are those of this folder; the converter runs in an empty one, from which no module is imported.
        let file = std::path::absolute(path).map_err(Error::io("read", path))?;
        let is_path = self.python.components().nth(1).is_some();
        let python = if is_path { std::path::absolute(&self.python).ok() } else { None };
        let mut command = Command::new(python.as_ref().unwrap_or(&self.python));
        command.args(["-m", "asperity.convert"].map(OsStr::new)).arg(&file).arg(map);
        command.args(options.dataset.map(|name| format!("--dataset={name}")));
        command.args(options.profile.then_some("--profile"));
        let sign = if self.touching == Some(Touching::LowPoints) { "low-points" } else { "high-points" };
        command.arg(format!("--touching={sign}")).current_dir(map.parent().unwrap_or(Path::new("/")));
        command.env("PYTHONIOENCODING", "utf-8");
        let printed = group::probe(command, Some(LIMIT), MOST_BYTES).map_err(|e| match e.kind() {
            std::io::ErrorKind::NotFound => Error::MissingProgram {
                program: self.python.display().to_string(),
                how: "--via-python needs it; ASPERITY_PYTHON = a Python that is installed".into(),
            },
            std::io::ErrorKind::TimedOut => {
                Error::format(path, format!("no end of its conversion within {} s", LIMIT.as_secs()), "a smaller file")
            }
            _ => Error::io("start", &self.python)(e),
        })?;
        let said = String::from_utf8_lossy(&printed.stderr);
        if printed.status.success() && map.exists() {
            return Ok(said.lines().filter_map(|l| Some(l.strip_prefix("warning: ")?.to_string())).collect());
        }
        Err(self.failure(path, &file, &said, printed.status))
    }

    /// The error that the last line of the converter is.
    fn failure(&self, path: &Path, file: &Path, said: &str, status: std::process::ExitStatus) -> Error {
        let last = said.lines().rfind(|l| !l.trim().is_empty()).unwrap_or_default();
        if ["No module named asperity", "No module named 'asperity"].iter().any(|words| last.contains(words)) {
            return Error::MissingProgram {
                program: format!("asperity in {}", self.python.display()),
                how: INSTALL.into(),
            };
        }
        let Some(message) = last.strip_prefix("error: ") else {
            let found = format!("{} -m asperity.convert ended with {status}: {last}", self.python.display());
            return Error::format(path, found, "a file that it converts");
        };
        if let Some((program, _)) = message.split_once(" was not found; ") {
            return Error::MissingProgram { program: program.into(), how: INSTALL.into() };
        }
        let message = message.strip_prefix(&format!("{}: ", file.display())).unwrap_or(message);
        match message.split_once("; accepted: ") {
            Some((found, accepted)) => Error::format(path, found, accepted),
            None => Error::format(path, message, "a file that SurfaceTopography reads"),
        }
    }
}
