use super::bytes::{self, Bytes, F32, F64, I8, I16, I32, U8, U16, U32};
use super::content::ImportedFile;
use crate::declared::{Declared, DeclaredExtent};
use crate::files::npy::fits;
use crate::files::number::{DType, NumberKind};
use crate::heights::HeightMap;
use asperity_grid::error::{Error, Result};
use std::collections::BTreeMap;
use std::path::Path;

/// Header of both variants. Spacings and scale are in metres.
struct SdfHeader {
    nx: usize,
    ny: usize,
    x: f64,
    y: f64,
    z: f64,
    stored: DType,
    type_name: &'static str,
}

/// Whether a file starts as text (`a`) or binary (`b`) variant: the dialects of ISO 25178-71 and of BCR before it.
pub(super) fn starts(start: &[u8]) -> bool {
    matches!(start, [b'a' | b'b', b'B', b'C', b'R', b'-', ..] | [b'a' | b'b', b'I', b'S', b'O', b'-', ..])
}

/// Reads a surface data file (ISO 25178-71), text or binary: `NumProfiles` rows of `NumPoints` heights in units of `Zscale`.
/// Points that were not measured are `BAD` in text, and the value reserved for them in binary.
pub(super) fn read(path: &Path) -> Result<ImportedFile> {
    let bytes = bytes::whole(path)?;
    let mut remainder = Bytes::of(path, &bytes);
    let magic = String::from_utf8_lossy(remainder.take(8, "the name of the format")?).into_owned();
    let (header, mut heights) =
        if magic.starts_with('b') { binary(path, &magic, remainder)? } else { text(path, remainder)? };
    heights.iter_mut().for_each(|h| *h *= header.z);
    let (nx, ny) = (header.nx, header.ny);
    let map = HeightMap::with_missing(&path.display().to_string(), nx, ny, heights)?;
    let extent = DeclaredExtent { x: header.x * nx as f64, y: header.y * ny as f64, unit: Some("m".into()) };
    let declared = Declared { unit: Some("m".into()), extent: Some(extent), ..Declared::default() };
    let layout = format!("surface data file {magic} (ISO 25178-71), {} [ny, nx]", header.type_name);
    Ok(ImportedFile::map(map, declared, layout))
}

/// Values of the header by their names.
type Values = BTreeMap<&'static str, f64>;

impl SdfHeader {
    fn of(path: &Path, values: &Values) -> Result<Self> {
        let value = |key: &str| {
            let accepted = "a header with it (the file is cut off or damaged)";
            values.get(key).copied().ok_or_else(|| Error::format(path, format!("no {key} in the header"), accepted))
        };
        for (key, is) in [("Compression", "compressed heights"), ("CheckType", "a checksum of an unknown kind")] {
            if let Some(code) = values.get(key).filter(|code| **code != 0.0) {
                let accepted = format!("{key} = 0 (in Gwyddion or MountainsMap save without it)");
                return Err(Error::format(path, format!("{key} = {code}: {is}"), accepted));
            }
        }
        let code = value("DataType")?;
        let types = [U8, U16, U32, F32, I8, I16, I32, F64];
        let names = ["uint8", "uint16", "uint32", "float32", "int8", "int16", "int32", "float64"];
        let Some(i) = (0..types.len()).find(|i| *i as f64 == code) else {
            return Err(Error::format(path, format!("DataType = {code}"), "0 to 7 (unsigned, float, signed, double)"));
        };
        let count = |key: &str| {
            let n = value(key)?;
            let is_count = n.fract() == 0.0 && n >= 1.0 && n <= f64::from(u32::MAX);
            let refused = || Error::format(path, format!("{key} = {n}"), "a whole number, 1 or more");
            is_count.then_some(n as usize).ok_or_else(refused)
        };
        Ok(SdfHeader {
            nx: count("NumPoints")?,
            ny: count("NumProfiles")?,
            x: bytes::positive(path, "Xscale", value("Xscale")?)?,
            y: bytes::positive(path, "Yscale", value("Yscale")?)?,
            z: bytes::factor(path, "Zscale", value("Zscale")?)?,
            stored: types[i],
            type_name: names[i],
        })
    }
}

/// Names of the numbers in a header, in their order.
const KEYS: [&str; 9] =
    ["NumPoints", "NumProfiles", "Xscale", "Yscale", "Zscale", "Zresolution", "Compression", "DataType", "CheckType"];

/// Bytes of manufacturer, date of creation and date of modification.
const ORIGIN_BYTES: usize = 10 + 12 + 12;

/// Two additional numbers that Olympus instruments write after the header of `bISO-1.0`.
const OLYMPUS: [u8; 8] = [5, 0, 0, 0, 1, 0, 0, 0];

fn binary(path: &Path, magic: &str, mut remainder: Bytes) -> Result<(SdfHeader, Vec<f64>)> {
    remainder.take(ORIGIN_BYTES, "the header")?;
    // The second edition has 32 bits for the numbers of points.
    let count = if magic.contains("-2") { U32 } else { U16 };
    let types = [count, count, F64, F64, F64, F64, U8, U8, U8];
    let mut values = Values::new();
    for (key, dtype) in KEYS.into_iter().zip(types) {
        values.insert(key, remainder.number(dtype, "the header")?);
    }
    let header = SdfHeader::of(path, &values)?;
    let length = (header.nx * header.ny).checked_mul(header.stored.bytes);
    let left = remainder.left();
    if left.starts_with(&OLYMPUS) && length.and_then(|n| n.checked_add(OLYMPUS.len())) == Some(left.len()) {
        remainder.take(OLYMPUS.len(), "the header")?;
    }
    let mut heights = remainder.field([header.nx, header.ny], header.stored)?;
    if let Some(bad) = reserved(header.stored) {
        heights.iter_mut().filter(|h| **h == bad).for_each(|h| *h = f64::NAN);
    }
    Ok((header, heights))
}

/// Value of points that were not measured: the least one of a signed type, the largest one of the unsigned types of BCR. NaN
/// counts, too.
fn reserved(dtype: DType) -> Option<f64> {
    Some(match (dtype.kind, dtype.bytes) {
        (NumberKind::Signed, bytes) => -(2f64.powi(8 * bytes as i32 - 1)),
        (NumberKind::Unsigned, 2) => u16::MAX.into(),
        (NumberKind::Unsigned, 4) => u32::MAX.into(),
        (NumberKind::Float, 4) => f32::MIN.into(),
        (NumberKind::Float, 8) => f64::MIN,
        _ => return None,
    })
}

fn text(path: &Path, remainder: Bytes) -> Result<(SdfHeader, Vec<f64>)> {
    let text = String::from_utf8_lossy(remainder.left());
    let mut records = text.split('*');
    let mut values = Values::new();
    for line in records.next().unwrap_or("").lines() {
        // `;` starts a comment. Some programs write further keys.
        let Some((key, value)) = line.split_once(['=', ' ', '\t']).filter(|_| !line.starts_with(';')) else { continue };
        let known = KEYS.iter().find(|k| k.eq_ignore_ascii_case(key.trim()));
        let Some(key) = known else { continue };
        let value = value.trim_matches(|c: char| c.is_whitespace() || c == '=');
        let number =
            value.parse().map_err(|_| Error::format(path, format!("{key} = {value:?} in the header"), "a number"))?;
        values.insert(key, number);
    }
    let header = SdfHeader::of(path, &values)?;
    let accepted = "a line of * between header and heights (the file is cut off or damaged)";
    let words = records.next().ok_or_else(|| Error::format(path, "a header without heights", accepted))?;
    let points = header.nx.saturating_mul(header.ny);
    let expected = || format!("{points}, NumPoints x NumProfiles of the header (or the file is cut off)");
    // A number and a blank.
    if points > words.len() / 2 + 1 {
        return Err(Error::format(path, format!("{} characters of heights", words.len()), expected()));
    }
    fits(path, points as u64 * 8)?;
    let mut heights = Vec::with_capacity(points);
    for word in words.split_whitespace() {
        let height = if word.eq_ignore_ascii_case("bad") { Ok(f64::NAN) } else { word.parse() };
        let place = || format!("height {} of {points} = {word:?}", heights.len() + 1);
        heights.push(height.map_err(|_| Error::format(path, place(), "a number, or BAD"))?);
    }
    if heights.len() != points {
        return Err(Error::format(path, format!("{} heights", heights.len()), expected()));
    }
    Ok((header, heights))
}
