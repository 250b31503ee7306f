use super::bytes::{self, Bytes, F32, I16, I32, U16};
use super::content::ImportedFile;
use crate::declared::{Declared, DeclaredExtent};
use crate::files::npy::fits;
use crate::files::number::DType;
use crate::heights::HeightMap;
use asperity_grid::error::{Error, Result};
use flate2::read::ZlibDecoder;
use std::io::Read;
use std::path::Path;

const PLAIN: &[u8] = b"DIGITAL SURF";
const COMPRESSED: &[u8] = b"DSCOMPRESSED";

/// Bytes of the header.
const HEADER: usize = 512;

/// Kinds of object whose first part is a surface: surface, and surface with intensity, colours, or both.
const SURFACES: [u32; 4] = [2, 11, 13, 16];

/// Names of the other kinds.
const OTHER: [(u32, &str); 11] = [
    (1, "profiles"),
    (3, "a binary image"),
    (4, "a series of profiles"),
    (5, "a series of surfaces"),
    (6, "a meridian disc"),
    (7, "a profile of several layers"),
    (8, "a surface of several layers"),
    (9, "a parallel disc"),
    (10, "an image"),
    (12, "an image"),
    (17, "a parametric profile"),
];

/// Bytes of deflate data expand at most 1032-fold.
const EXPANSION: usize = 1032;

/// Programs write one stream, or up to 8.
const MOST_STREAMS: usize = 1024;

pub(super) fn starts(start: &[u8]) -> bool {
    start.starts_with(PLAIN) || start.starts_with(COMPRESSED)
}

/// What the header states about one axis.
struct SurAxis {
    step: f64,
    unit: String,
}

struct SurHeader {
    compressed: bool,
    nx: usize,
    ny: usize,
    stored: DType,
    /// Value of points that were not measured, if there are any.
    missing: Option<f64>,
    axes: [SurAxis; 3],
    offset: f64,
    /// Whether heights, the order of x, and the order of y are to be inverted.
    invert: [bool; 3],
    /// Bytes between header and heights.
    skip: usize,
}

/// Reads a surface of Digital Surf (`.sur`, MountainsMap), plain or compressed: heights `n·dz + offset` in the unit of the
/// step in z.
pub(super) fn read(path: &Path) -> Result<ImportedFile> {
    let bytes = bytes::whole(path)?;
    let mut remainder = Bytes::of(path, &bytes);
    let header = SurHeader::of(path, remainder.take(HEADER, "the header of Digital Surf")?)?;
    remainder.take(header.skip, "the comment of the header")?;
    let (nx, ny) = (header.nx, header.ny);
    let mut heights = if header.compressed {
        let raw = decompress(path, remainder, &header)?;
        Bytes::of(path, &raw).field([nx, ny], header.stored)?
    } else {
        remainder.field([nx, ny], header.stored)?
    };
    let [x, y, z] = header.axes;
    let [invert, flip, flop] = header.invert;
    for h in &mut heights {
        let height = *h * z.step + header.offset;
        *h = match header.missing {
            Some(missing) if *h == missing => f64::NAN,
            _ if invert => -height,
            _ => height,
        };
    }
    if flip {
        heights.chunks_exact_mut(nx).for_each(<[f64]>::reverse);
    }
    if flop {
        // Reversed as a whole and within each row: the rows in reverse order.
        heights.reverse();
        heights.chunks_exact_mut(nx).for_each(<[f64]>::reverse);
    }
    let map = HeightMap::with_missing(&path.display().to_string(), nx, ny, heights)?;
    // Both axes in the unit of x.
    let y_step = match (&x.unit, &y.unit) {
        (ux, uy) if ux == uy => y.step,
        (ux, uy) => match (asperity_grid::units::metres_per(ux), asperity_grid::units::metres_per(uy)) {
            (Some(mx), Some(my)) => y.step * my / mx,
            _ => {
                let found = format!("units {ux:?} along x and {uy:?} along y");
                return Err(Error::format(path, found, "units of length, such as mm and µm"));
            }
        },
    };
    let extent = DeclaredExtent { x: x.step * nx as f64, y: y_step * ny as f64, unit: Some(x.unit) };
    let declared = Declared { unit: Some(z.unit), extent: Some(extent), ..Declared::default() };
    let layout = format!(
        "Digital Surf surface, {}{} bits [ny, nx]{}",
        if header.compressed { "compressed, " } else { "" },
        8 * header.stored.bytes,
        if invert { ", inverted as its header states" } else { "" },
    );
    Ok(ImportedFile::map(map, declared, layout))
}

impl SurHeader {
    /// `header`: its 512 bytes. Offsets: the documentation of the format by Digital Surf, version 1.
    fn of(path: &Path, header: &[u8]) -> Result<Self> {
        let value_at = |offset: usize, dtype: DType| dtype.value(&header[offset..offset + dtype.bytes]);
        let text = |offset: usize| text(&header[offset..offset + 16]);
        if value_at(12, U16) != 0.0 {
            let accepted = "0, the byte order of PCs (in MountainsMap or Gwyddion save it again)";
            return Err(Error::format(path, format!("format {} in the header", value_at(12, U16)), accepted));
        }
        let (kind, nx, ny, points) =
            (value_at(18, U16) as u32, value_at(108, I32), value_at(112, I32), value_at(116, I32));
        // Gwyddion writes the code of profiles for surfaces.
        let surface = SURFACES.contains(&kind) || (kind == 1 && ny > 1.0);
        if !surface {
            let name = OTHER.iter().find(|o| o.0 == kind).map_or("of an unknown kind", |o| o.1);
            let accepted = "a surface; extract one in MountainsMap, or open the file in Gwyddion and save as .gwy";
            return Err(Error::format(path, format!("a Digital Surf file of type {kind} ({name})"), accepted));
        }
        if nx < 1.0 || ny < 1.0 || nx * ny != points {
            let found = format!("{nx} x {ny} points, and {points} in all");
            return Err(Error::format(path, found, "their product, at least 1 (the header is damaged)"));
        }
        let dtype = match value_at(98, I16) as i32 {
            16 => I16,
            32 => I32,
            bits => return Err(Error::format(path, format!("points of {bits} bits"), "16 or 32")),
        };
        let axes = [("x", 120, 180), ("y", 124, 196), ("z", 128, 212)].map(|(name, step, unit)| {
            let key = format!("the spacing along {name}");
            let step = value_at(step, F32);
            let step = if name == "z" { bytes::factor(path, &key, step) } else { bytes::positive(path, &key, step) };
            Ok(SurAxis { step: step?, unit: text(unit) })
        });
        let [x, y, z] = axes;
        let offset = value_at(474, F32);
        if !offset.is_finite() {
            return Err(Error::format(path, format!("the offset of z = {offset}"), "a finite number"));
        }
        // As Gwyddion and SurfaceTopography: 1 heights, 2 heights and x, 3 heights and y.
        let inverted = value_at(290, U16) as u32;
        Ok(SurHeader {
            compressed: header.starts_with(COMPRESSED),
            nx: nx as usize,
            ny: ny as usize,
            stored: dtype,
            missing: (value_at(86, U16) == 1.0).then(|| value_at(100, I32) - 2.0),
            axes: [x?, y?, z?],
            offset,
            invert: [(1..=3).contains(&inverted), inverted == 2, inverted == 3],
            skip: (value_at(334, U16) + value_at(336, U16)) as usize,
        })
    }
}

/// A text of the header: UTF-8, or Latin-1 with the micro sign of MS-DOS.
fn text(field: &[u8]) -> String {
    let field = field.split(|b| *b == 0).next().unwrap_or(field);
    let text = match std::str::from_utf8(field) {
        Ok(text) => text.to_string(),
        Err(_) => field.iter().map(|b| if *b == 0xE6 { 'µ' } else { char::from(*b) }).collect(),
    };
    text.trim().to_string()
}

/// Decompresses the heights: number of streams, raw and compressed length of each, the streams (zlib).
fn decompress(path: &Path, mut remainder: Bytes, header: &SurHeader) -> Result<Vec<u8>> {
    let bytes = header.nx.saturating_mul(header.ny).saturating_mul(header.stored.bytes);
    let damaged = |found: String| {
        Error::format(path, found, format!("{bytes} bytes of compressed heights (the file is cut off or damaged)"))
    };
    let streams = remainder.count("the number of compressed streams")?;
    if streams > MOST_STREAMS {
        return Err(damaged(format!("{streams} compressed streams")));
    }
    let mut directory = Bytes::of(path, remainder.take(streams.saturating_mul(8), "the list of compressed streams")?);
    if bytes > remainder.left().len().saturating_mul(EXPANSION) {
        return Err(damaged(format!("{} bytes for {} x {} points", remainder.left().len(), header.nx, header.ny)));
    }
    fits(path, bytes as u64)?;
    let mut raw = Vec::with_capacity(bytes);
    for _ in 0..streams {
        let (length, zipped) = (directory.count("a length")?, directory.count("a length")?);
        let stream = remainder.take(zipped, "a compressed stream")?;
        let previous = raw.len();
        let largest = bytes.saturating_sub(previous) as u64 + 1;
        ZlibDecoder::new(stream)
            .take(largest)
            .read_to_end(&mut raw)
            .map_err(|e| damaged(format!("a damaged compressed stream ({e})")))?;
        if raw.len() - previous != length || raw.len() > bytes {
            return Err(damaged(format!("a compressed stream of {} bytes instead of {length}", raw.len() - previous)));
        }
    }
    if raw.len() == bytes { Ok(raw) } else { Err(damaged(format!("{} bytes", raw.len()))) }
}
