//! Imports surfaces: all formats of the surface of the contact-mechanics challenge, those of NumPy, NetCDF and contMech, and
//! those of instruments: x3p and SDF (ISO 25178-72 and -71), Digital Surf, Gwyddion. The format is detected from the contents, never from the file name.
//!
//! [`ImportOptions`] specify what the contents do not determine: which of several arrays is read, and how Fourier
//! coefficients are scaled. The caller specifies sign convention and unit, as for every height map.

mod array;
mod attributes;
mod bytes;
mod comments;
mod content;
mod declare;
mod decode;
mod fields;
mod foreign;
mod fourier;
mod gwy;
mod halves;
mod hdf5;
mod header;
mod header_key;
mod headings;
mod konfig;
mod marks;
mod netcdf;
mod npz;
mod packed;
mod profile;
mod sdf;
mod section;
mod source;
mod sur;
mod text;
mod unit;
mod x3p;
mod x3p_header;
mod zygo;

pub use content::{Content, Fourier, ImportOptions, ImportedFile};

use super::declared::Declared;
use super::heights;
use crate::files::atomic_file::open_regular;
use crate::files::npy;
use crate::height_map::HeightMap;
use array::{Plane, choose, names};
use asperity_grid::error::{Error, Result};
use source::{ARCHIVE, plain, without_names};
use std::io::{BufRead, BufReader};
use std::path::Path;

/// Longest part of an error message, and longest name in an [`ImportedFile`], in characters.
const LONGEST_MESSAGE: usize = 500;

/// Reads a file of heights or Fourier coefficients. Heights that were not measured are NaN ([`heights::HeightMap::missing`]).
///
/// # Errors
/// Damaged files; infinite heights; arrays that are not two-dimensional or not numeric; several arrays without a requested name;
/// four columns whose first two are integers without [`ImportOptions::fourier`]; arrays that claim far more numbers than the file has
/// bytes for; folders, pipes and devices. The message names the file, the place in it, and the accepted value.
pub fn read(path: &Path, options: ImportOptions) -> Result<ImportedFile> {
    match read_any(path, options) {
        // Words of a foreign file are quoted without control characters and in limited length.
        Ok(mut found) => {
            let d = &mut found.declared;
            let names = [&mut d.unit, &mut d.channel].into_iter().flatten();
            let lists =
                d.channels.iter_mut().chain(&mut d.history).chain([&mut found.layout]).chain(&mut found.warnings);
            let lists = lists.chain(&mut found.not_understood);
            names.chain(lists).for_each(|word| *word = plain(word, LONGEST_MESSAGE));
            Ok(found)
        }
        Err(Error::Format { file, found, accepted }) => Err(Error::Format {
            file,
            found: plain(&found, LONGEST_MESSAGE),
            accepted: plain(&accepted, LONGEST_MESSAGE),
        }),
        Err(other) => Err(other),
    }
}

fn read_any(path: &Path, options: ImportOptions) -> Result<ImportedFile> {
    let (file, _) = open_regular(path)?;
    let mut source = BufReader::with_capacity(1 << 18, file);
    let start = source.fill_buf().map_err(Error::io("read", path))?;
    let kind = kind(path, start);
    drop(source);
    let waves = options.fourier.is_some_and(Fourier::are_waves);
    let has_names = match kind {
        FileKind::Format(format) => format.has_names,
        FileKind::Konfig { .. } => false,
        FileKind::Text => !waves,
        FileKind::Foreign(..) | FileKind::Binary => true,
    };
    if let Some(name) = options.dataset.filter(|_| !has_names) {
        return Err(without_names(path, name));
    }
    let imported = match kind {
        FileKind::Format(format) => (format.read)(path, options)?,
        FileKind::Binary => {
            return Err(Error::format(path, "a binary file of a kind that is not known", foreign::KINDS));
        }
        FileKind::Foreign(found, accepted) => {
            return Err(Error::format(path, format!("{found}, which is not read"), accepted));
        }
        FileKind::Text if waves => {
            let waves = Content::Waves(fourier::read_text(path)?);
            ImportedFile::of(waves, Declared::default(), "text, qX qY Re Im")
        }
        FileKind::Text => {
            let text_map = text::read(path, options)?;
            if text_map.layout == text::TextLayout::XyzLines {
                // The coordinates determine the format, also of a map four points wide.
                return Ok(text_map.into());
            }
            text_map.into()
        }
        FileKind::Konfig { nx, ny } => konfig::read(path, nx, ny)?,
    };
    if let Some(unit) = imported.declared.unit.as_ref().filter(|unit| unit::is_other(unit)) {
        let found = format!("values in {}, which are no heights", source::quoted(unit));
        return Err(Error::format(path, found, unit::ACCEPTED));
    }
    settle(path, imported, options)
}

/// Converts a profile, or four columns to Fourier coefficients, if requested; returns an error if a table is ambiguous.
fn settle(path: &Path, imported: ImportedFile, options: ImportOptions) -> Result<ImportedFile> {
    if options.profile {
        return profile::read(path, imported);
    }
    let Content::Map(map) = &imported.content else { return Ok(imported) };
    match options.fourier {
        None if map.nx == 4 && imported.declared.extent.is_none() && fourier::may_be(&map.heights) => {
            Err(Error::format(
                path,
                "four columns whose first two are whole numbers: Fourier coefficients qX qY Re Im, or a map 4 points wide",
                "--fourier (surface.fourier) that says which: series, fftw (with --fourier-points), or none",
            ))
        }
        None => profile::refuse(path, map).map(|()| imported),
        Some(Fourier::None) => Ok(imported),
        Some(_) if map.nx == 4 => {
            let content = Content::Waves(fourier::of_columns(path, &map.heights)?);
            let layout = format!("{}, columns qX qY Re Im", imported.layout);
            Ok(ImportedFile { content, layout, ..imported })
        }
        Some(_) => {
            let description = format!("[{}, {}] numbers", map.ny, map.nx);
            Err(Error::format(path, description, "four columns qX qY Re Im, as --fourier (surface.fourier) has it"))
        }
    }
}

/// Whether a file contains heights rather than a scene.
///
/// # Errors
/// Those of opening and reading a regular file.
pub fn holds_numbers(path: &Path) -> Result<bool> {
    let (file, _) = open_regular(path)?;
    let mut source = BufReader::new(file);
    let start = source.fill_buf().map_err(Error::io("read", path))?;
    if !matches!(kind(path, start), FileKind::Text) {
        return Ok(true);
    }
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        return Ok(false);
    }
    let text = decode::start_of_text(path, start);
    let (mut has_words, mut has_table) = (false, false);
    for line in text.lines().map(|l| comments::comment_apart(l).0.trim()).filter(|l| !l.is_empty()) {
        // A scene has tables; before them, keys that no height file has. Height files may have sections of such names, and lines of numbers,
        // which a scene has in lists only.
        let name = line.strip_prefix('[').and_then(|l| l.strip_suffix(']'));
        if name.is_some_and(|n| {
            n.trim_matches(['[', ']']).chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '.' | '-' | ' '))
        }) {
            has_table = true;
            continue;
        }
        let fields = fields::split(line).0;
        let numeric = fields.iter().all(|f| f.parse::<f64>().is_ok() || marks::is_missing(f));
        let in_list = has_table && (fields.len() < 2 || line.ends_with(','));
        if numeric && !in_list || !has_table && header::is_known(line) {
            return Ok(true);
        }
        has_words = true;
    }
    // Assignments without a table: a scene by its name, otherwise a header whose keys are not known.
    Ok(!has_table && has_words)
}

/// Whether a file is not read, and may be one that SurfaceTopography reads: of an instrument, or a container of contact.engineering.
///
/// # Errors
/// Those of opening and reading a regular file.
pub fn is_of_instrument(path: &Path) -> Result<bool> {
    let (file, _) = open_regular(path)?;
    let mut source = BufReader::new(file);
    let start = source.fill_buf().map_err(Error::io("read", path))?;
    Ok(match kind(path, start) {
        FileKind::Foreign(_, accepted) => foreign::is_convertible(accepted),
        FileKind::Binary => true,
        FileKind::Format(_) if start.starts_with(ARCHIVE) => npz::is_of_instrument(path)?,
        FileKind::Format(_) | FileKind::Konfig { .. } | FileKind::Text => false,
    })
}

/// Formats that are read: name, and usual extensions.
pub fn formats() -> impl Iterator<Item = (&'static str, &'static str)> {
    FORMATS.iter().map(|f| (f.name, f.extensions)).chain([
        ("text: a matrix, or lines of x y h", ".txt .csv .asc .xyz .dat"),
        ("konfig of contMech", ".dat"),
        ("Fourier coefficients qX qY Re Im", ".txt .dat"),
    ])
}

/// Kinds of files that are recognised and read neither here nor by SurfaceTopography, with what is accepted instead.
pub fn not_read() -> impl Iterator<Item = (&'static str, &'static str)> {
    foreign::not_converted()
}

/// A format that is no text: how a file of it begins, whether its arrays have names, and its reader.
struct Format {
    name: &'static str,
    extensions: &'static str,
    starts: fn(&Path, &[u8]) -> bool,
    has_names: bool,
    read: fn(&Path, ImportOptions) -> Result<ImportedFile>,
}

static FORMATS: [Format; 10] = [
    Format {
        name: "NumPy array",
        extensions: ".npy",
        starts: |_, s| s.starts_with(b"\x93NUMPY"),
        has_names: true,
        read: npy,
    },
    Format {
        name: "x3p (ISO 25178-72)",
        extensions: ".x3p",
        starts: x3p::starts,
        has_names: false,
        read: |path, _| x3p::read(path),
    },
    Format {
        name: "NumPy archive, or one file in a ZIP archive",
        extensions: ".npz .zip",
        starts: |_, s| s.starts_with(ARCHIVE),
        has_names: true,
        read: |p, o| npz::read(p, o, read_any),
    },
    Format {
        name: "HDF5, MATLAB from 7.3, NetCDF-4",
        extensions: ".h5 .hdf5 .mat .nc",
        starts: |_, s| hdf5::starts(s),
        has_names: true,
        read: hdf5::read,
    },
    Format {
        name: "NetCDF-3",
        extensions: ".nc",
        starts: |_, s| netcdf::starts(s),
        has_names: true,
        read: netcdf::read,
    },
    Format {
        name: "SDF (ISO 25178-71)",
        extensions: ".sdf",
        starts: |_, s| sdf::starts(s),
        has_names: false,
        read: |path, _| sdf::read(path),
    },
    Format {
        name: "Digital Surf",
        extensions: ".sur",
        starts: |_, s| sur::starts(s),
        has_names: false,
        read: |path, _| sur::read(path),
    },
    Format { name: "Gwyddion", extensions: ".gwy", starts: |_, s| gwy::starts(s), has_names: true, read: gwy::read },
    Format {
        name: "Zygo MetroPro in text",
        extensions: ".xyz",
        starts: |_, s| zygo::starts(s),
        has_names: false,
        read: |path, _| zygo::read(path),
    },
    Format {
        name: "a file of these, packed by gzip",
        extensions: ".gz",
        starts: |_, s| packed::starts(s),
        has_names: true,
        read: |p, o| packed::gzip(p, o, read_any),
    },
];

/// One array, or with `--dataset` a plane of three dimensions.
fn npy(path: &Path, options: ImportOptions) -> Result<ImportedFile> {
    /// As numpy's examples name an array.
    const NAME: &str = "array";
    let planes = Plane::of(NAME, &npy::stacked_shape(path)?);
    if planes.is_empty() {
        if let Some(name) = options.dataset {
            return Err(without_names(path, name));
        }
        let (map, declared) = heights::read_npy(path)?;
        return Ok(ImportedFile::map(map, declared, ".npy [ny, nx]"));
    }
    let plane = choose(path, &planes, options)?;
    let field = npy::read_plane(path, plane.index)?;
    let map = HeightMap::with_missing(&path.display().to_string(), field.nx, field.ny, field.values)?;
    let declared = Declared { channel: Some(plane.name.clone()), channels: names(&planes), ..Declared::default() };
    Ok(ImportedFile::map(map, declared, format!(".npy {} [ny, nx]", plane.name)))
}

#[derive(Clone, Copy)]
enum FileKind {
    Format(&'static Format),
    Konfig {
        nx: usize,
        ny: usize,
    },
    Text,
    /// Recognised, and not read: what it is, and what is accepted.
    Foreign(&'static str, &'static str),
    Binary,
}

fn kind(path: &Path, start: &[u8]) -> FileKind {
    if let Some(format) = FORMATS.iter().find(|f| (f.starts)(path, start)) {
        FileKind::Format(format)
    } else if let Some((found, accepted)) = foreign::known(start) {
        FileKind::Foreign(found, accepted)
    } else if start.contains(&0) && !decode::is_utf16(start) {
        FileKind::Binary
    } else {
        let text = decode::start_of_text(path, start);
        konfig::header(&text).map_or(FileKind::Text, |(nx, ny)| FileKind::Konfig { nx, ny })
    }
}
