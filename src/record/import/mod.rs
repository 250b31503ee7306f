//! Imports surfaces: all formats of the surface of the contact-mechanics challenge, and those of NumPy, NetCDF and
//! contMech. The format is detected from the contents, never from the file name.
//!
//! [`ImportOptions`] specify what the contents do not determine: which of several arrays is read, and how Fourier
//! coefficients are scaled. The caller specifies sign convention and unit, as for every height map.

mod array;
mod attributes;
mod content;
mod fourier;
mod hdf5;
mod konfig;
mod netcdf;
mod npz;

pub use content::{Content, Fourier, ImportOptions, ImportedFile};
pub use fourier::Wave;

use super::heights::{self, BOM, Declared, KINDS, Layout};
use crate::error::{Error, Result};
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// Reads a file of heights or Fourier coefficients.
///
/// # Errors
/// Damaged files; NaN; arrays that are not two-dimensional or not numeric; several arrays without a requested name;
/// four columns whose first two are integers without [`ImportOptions::fourier`]. The message names the file, the
/// place in it, and the accepted value.
pub fn read(path: &Path, options: ImportOptions) -> Result<ImportedFile> {
    let file = File::open(path).map_err(Error::io("open", path))?;
    let mut source = BufReader::with_capacity(1 << 18, file);
    let start = source.fill_buf().map_err(Error::io("read", path))?;
    let kind = kind(start);
    if start.starts_with(BOM) {
        source.consume(BOM.len());
    }
    let named = matches!(kind, Kind::Npz | Kind::Hdf5 | Kind::Netcdf);
    if let Some(name) = options.dataset.filter(|_| !named) {
        let found = format!("--dataset (surface.dataset) = {name:?} for a file without names");
        return Err(Error::format(path, found, "the name only with .npz, HDF5 or NetCDF"));
    }
    let waves = options.fourier.is_some_and(Fourier::are_waves);
    let found = match kind {
        Kind::Npy => {
            let (map, declared) = heights::read_npy(path)?;
            ImportedFile::map(map, declared, ".npy [ny, nx]")
        }
        Kind::Npz => npz::read(path, options)?,
        Kind::Hdf5 => hdf5::read(path, options)?,
        Kind::Netcdf => netcdf::read(path, options)?,
        Kind::Binary => return Err(Error::format(path, "a binary file of a kind that is not known", KINDS)),
        Kind::Text if waves => {
            let waves = fourier::read_text(path, source)?;
            ImportedFile {
                content: Content::Waves(waves),
                declared: Declared::default(),
                layout: "text, qX qY Re Im".into(),
            }
        }
        Kind::Text => {
            let (map, declared, layout) = heights::read_ascii(path, source, options.fourier == Some(Fourier::None))?;
            if layout == Layout::XyzLines {
                // The coordinates determine the format, also of a map four points wide.
                return Ok(ImportedFile::map(map, declared, "text, lines of x y h"));
            }
            ImportedFile::map(map, declared, "text, one line per y")
        }
        Kind::Konfig { nx, ny } => konfig::read(path, source, nx, ny)?,
    };
    settle(path, found, options.fourier)
}

/// Converts four columns to Fourier coefficients if requested; returns an error if they are ambiguous.
fn settle(path: &Path, found: ImportedFile, said: Option<Fourier>) -> Result<ImportedFile> {
    let Content::Map(map) = &found.content else { return Ok(found) };
    match said {
        None if map.nx == 4 && fourier::may_be(&map.heights) => Err(Error::format(
            path,
            "four columns whose first two are whole numbers: Fourier coefficients qX qY Re Im, or a map 4 points wide",
            "--fourier (surface.fourier) that says which: series, fftw (with --fourier-points), or none",
        )),
        None | Some(Fourier::None) => Ok(found),
        Some(_) if map.nx == 4 => {
            let waves = fourier::of_columns(path, &map.heights)?;
            Ok(ImportedFile {
                content: Content::Waves(waves),
                layout: format!("{}, columns qX qY Re Im", found.layout),
                ..found
            })
        }
        Some(_) => {
            let what = format!("[{}, {}] numbers", map.ny, map.nx);
            Err(Error::format(path, what, "four columns qX qY Re Im, as --fourier (surface.fourier) has it"))
        }
    }
}

/// Whether a file contains numbers rather than a scene.
pub fn holds_numbers(path: &Path) -> Result<bool> {
    let file = File::open(path).map_err(Error::io("open", path))?;
    let mut source = BufReader::new(file);
    let start = source.fill_buf().map_err(Error::io("read", path))?;
    if !matches!(kind(start), Kind::Text) {
        return Ok(true);
    }
    let text = String::from_utf8_lossy(start.strip_prefix(BOM).unwrap_or(start));
    let mut lines = text.lines().map(|l| l.split('#').next().unwrap_or("").trim()).filter(|l| !l.is_empty());
    // A scene starts with a table or a key.
    Ok(lines.next().is_some_and(|l| !l.starts_with('[') && !l.contains('=')))
}

enum Kind {
    Npy,
    Npz,
    Hdf5,
    Netcdf,
    Konfig { nx: usize, ny: usize },
    Text,
    Binary,
}

fn kind(start: &[u8]) -> Kind {
    if start.starts_with(b"\x93NUMPY") {
        Kind::Npy
    } else if start.starts_with(b"PK\x03\x04") {
        Kind::Npz
    } else if start.starts_with(b"\x89HDF\r\n\x1a\n") {
        Kind::Hdf5
    } else if matches!(start, [b'C', b'D', b'F', 1 | 2 | 5, ..]) {
        Kind::Netcdf
    } else if start.contains(&0) {
        Kind::Binary
    } else {
        konfig::header(start.strip_prefix(BOM).unwrap_or(start)).map_or(Kind::Text, |(nx, ny)| Kind::Konfig { nx, ny })
    }
}
