//! Files inside of others: gzip, and archives without arrays, of which one file is read.

use super::content::{ImportOptions, ImportedFile};
use super::foreign::is_convertible;
use super::source::{LARGEST_RATIO, SMALL, list, quoted};
use crate::files::atomic_file::open_regular;
use asperity_grid::error::{Error, Result};
use flate2::read::MultiGzDecoder;
use std::io::Read;
use std::path::Path;

const GZIP: &[u8] = b"\x1f\x8b";

pub(super) fn starts(start: &[u8]) -> bool {
    start.starts_with(GZIP)
}

/// Reads a file that is unpacked: `(path, options)` to what it holds.
pub(super) type Reader = fn(&Path, ImportOptions) -> Result<ImportedFile>;

/// Reads a file packed by gzip.
///
/// # Errors
/// Damage; more than 64 MiB that unfold more than a hundredfold; those of the file inside.
pub(super) fn gzip(path: &Path, options: ImportOptions, read: Reader) -> Result<ImportedFile> {
    let (file, stored) = open_regular(path)?;
    let mut imported = inside(path, MultiGzDecoder::new(file), stored, options, read)?;
    imported.layout = format!("gzip, {}", imported.layout);
    Ok(imported)
}

/// Reads the file of an archive that [`ImportOptions::dataset`] names, or the only one. `names`: its files.
///
/// # Errors
/// Several files of which none is named; those of [`gzip`].
pub(super) fn archive<R: Read + std::io::Seek>(
    path: &Path,
    archive: &mut zip::ZipArchive<R>,
    names: &[String],
    options: ImportOptions,
    read: Reader,
) -> Result<ImportedFile> {
    let hidden = |n: &str| {
        n.ends_with('/') || n.starts_with("__MACOSX/") || n.rsplit('/').next().is_some_and(|n| n.starts_with('.'))
    };
    let names: Vec<String> = names.iter().filter(|n| !hidden(n)).cloned().collect();
    let requested = options.dataset.and_then(|d| names.iter().find(|n| *n == d));
    let (name, options) = match (requested, &names[..]) {
        (Some(name), _) => (name, ImportOptions { dataset: None, ..options }),
        (None, [only]) => (only, options),
        (None, []) => return Err(Error::format(path, "an archive without files", "one with a file of heights")),
        (None, _) => {
            let found = match options.dataset {
                Some(wanted) => format!("no file named {} in the archive", quoted(wanted)),
                None => format!("an archive of {} files", names.len()),
            };
            let accepted = format!("the name of one of them as --dataset (surface.dataset): {}", list(&names));
            return Err(Error::format(path, found, accepted));
        }
    };
    let damaged = |e| Error::format(path, format!("a damaged archive ({e})"), "a whole archive");
    let entry = archive.by_name(name).map_err(damaged)?;
    let stored = entry.compressed_size();
    let mut imported = inside(path, entry, stored, options, read)?;
    imported.layout = format!("file {} of the archive, {}", quoted(name), imported.layout);
    Ok(imported)
}

/// Unpacks into a temporary file and reads it; errors name the outer file.
fn inside(path: &Path, source: impl Read, stored: u64, options: ImportOptions, read: Reader) -> Result<ImportedFile> {
    let largest = SMALL.max(LARGEST_RATIO.saturating_mul(stored));
    let mut target = tempfile::NamedTempFile::new().map_err(Error::io("unpack", path))?;
    let damaged = |e| Error::format(path, format!("damaged packed data ({e})"), "a whole file");
    let bytes = std::io::copy(&mut source.take(largest + 1), &mut target).map_err(damaged)?;
    if bytes > largest {
        let found = format!("more than {largest} bytes, packed in {stored}");
        return Err(Error::format(
            path,
            found,
            format!("at most {LARGEST_RATIO} times the packed bytes: unpack the file"),
        ));
    }
    let mut start = [0; 2];
    let named =
        std::fs::File::open(target.path()).and_then(|mut f| f.read(&mut start)).map_err(Error::io("unpack", path))?;
    if named == 2 && starts(&start) {
        return Err(Error::format(path, "packed data inside of packed data", "the file that gunzip unpacks"));
    }
    read(target.path(), options).map_err(|e| renamed(e, target.path(), path))
}

/// An error of the temporary file, as one of the file that was given.
fn renamed(error: Error, temporary: &Path, path: &Path) -> Error {
    match error {
        Error::Format { file, found, accepted } if file == temporary => {
            // The converter reads no packed files.
            let accepted =
                if is_convertible(&accepted) { format!("the file unpacked, and {accepted}") } else { accepted };
            Error::Format { file: path.to_path_buf(), found, accepted }
        }
        Error::Height { row, column, value, .. } => {
            Error::Height { place: path.display().to_string(), row, column, value }
        }
        Error::Io { doing, source, .. } => Error::Io { doing, path: path.to_path_buf(), source },
        other => other,
    }
}
