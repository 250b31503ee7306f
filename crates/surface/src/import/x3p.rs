use super::bytes::{self, Bytes, F32, F64, I16, I32};
use super::content::ImportedFile;
use super::source::ARCHIVE;
use super::x3p_header::{self, Elements};
use crate::declared::{Declared, DeclaredExtent};
use crate::files::npy::fits;
use crate::files::number::DType;
use crate::heights::HeightMap;
use asperity_grid::error::{Error, Result};
use md5::{Digest, Md5};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use zip::ZipArchive;
use zip::read::ZipFile;
use zip::result::ZipError;

const MAIN: &str = "main.xml";

/// Largest accepted description; instruments write some kB.
const MOST_XML: u64 = 1 << 26;

/// Deflate expands at most 1032-fold.
const EXPANSION: u64 = 1032;

/// Whether an archive is a surface file rather than `.npz`. `start`: its first bytes, which decide if it is cut off.
pub(super) fn starts(path: &Path, start: &[u8]) -> bool {
    if !start.starts_with(ARCHIVE) {
        return false;
    }
    match File::open(path).ok().and_then(|file| ZipArchive::new(BufReader::new(file)).ok()) {
        Some(archive) => folder_of(&archive).is_some(),
        None => start.windows(MAIN.len()).any(|w| w == MAIN.as_bytes()),
    }
}

/// The folder of the description in the archive: programs that pack a folder put all files into it. `None` for several surfaces.
fn folder_of(archive: &ZipArchive<BufReader<File>>) -> Option<String> {
    let names: Vec<_> = archive.file_names().collect::<std::result::Result<_, _>>().ok()?;
    let folders = names.iter().filter_map(|n| n.strip_suffix(MAIN)).filter(|f| f.is_empty() || f.ends_with('/'));
    let folders: Vec<&str> = folders.filter(|f| !f.starts_with("__MACOSX/")).collect();
    match folders[..] {
        [only] => Some(only.to_string()),
        _ => folders.contains(&"").then(String::new),
    }
}

/// An open archive.
struct X3pArchive<'a> {
    path: &'a Path,
    /// Folder of the files, with its `/`.
    folder: String,
    zip: ZipArchive<BufReader<File>>,
}

impl<'a> X3pArchive<'a> {
    fn open(path: &'a Path) -> Result<Self> {
        let file = File::open(path).map_err(Error::io("open", path))?;
        let zip = ZipArchive::new(BufReader::new(file)).map_err(|e| damaged(path, e))?;
        let folder = folder_of(&zip).unwrap_or_default();
        Ok(X3pArchive { path, folder, zip })
    }

    fn entry(&mut self, name: &str) -> Result<ZipFile<'_, BufReader<File>>> {
        let path = self.path;
        // Links have either separator, and may start in the archive or in the folder.
        let link = name.replace('\\', "/");
        let link = link.trim_start_matches("./").trim_start_matches('/');
        let inside = format!("{}{link}", self.folder);
        let inside = if self.zip.index_for_name(&inside).is_some() { &inside } else { link };
        self.zip.by_name(inside).map_err(|e| match e {
            ZipError::FileNotFound => Error::format(path, format!("no {name:?} in the archive"), "a whole .x3p file"),
            other => damaged(path, other),
        })
    }

    /// Bytes of a file in the archive, at most `largest`.
    fn bytes(&mut self, name: &str, largest: u64) -> Result<Vec<u8>> {
        let path = self.path;
        let entry = self.entry(name)?;
        let (size, compressed) = (entry.size(), entry.compressed_size());
        if size > largest || size > compressed.saturating_mul(EXPANSION) {
            let found = format!("{name:?} of {size} bytes, {compressed} in the archive");
            let accepted = format!("{largest} bytes at most, compressed at most {EXPANSION}-fold");
            return Err(Error::format(path, found, accepted));
        }
        fits(path, size)?;
        let mut bytes = Vec::new();
        entry.take(largest + 1).read_to_end(&mut bytes).map_err(|e| damaged(path, e))?;
        if bytes.len() as u64 != size {
            let found = format!("{name:?} of {} bytes", bytes.len());
            return Err(Error::format(path, found, format!("{size}, as the archive states")));
        }
        Ok(bytes)
    }

    /// Bytes of a file in the archive, whose length follows from the number of points.
    fn exactly(&mut self, name: &str, length: u64, points: &str) -> Result<Vec<u8>> {
        let size = self.entry(name)?.size();
        if size == length {
            return self.bytes(name, length);
        }
        let accepted = format!("{length}, for {points} (main.xml)");
        Err(Error::format(self.path, format!("{name:?} of {size} bytes"), accepted))
    }
}

fn damaged(path: &Path, e: impl std::fmt::Display) -> Error {
    Error::format(path, format!("a damaged archive ({e})"), "a whole .x3p file")
}

/// Reads a surface of ISO 25178-72 (`.x3p`): an archive with `main.xml` and a matrix of heights, in m. Points that were not
/// measured are NaN or infinite, or marked in a second file.
pub(super) fn read(path: &Path) -> Result<ImportedFile> {
    let mut archive = X3pArchive::open(path)?;
    let main = archive.bytes(MAIN, MOST_XML)?;
    let xml = x3p_header::read(path, &main)?;
    kinds(path, &xml)?;
    let nx = count(path, &xml, "Record3/MatrixDimension/SizeX")?;
    let ny = count(path, &xml, "Record3/MatrixDimension/SizeY")?;
    let layers = count(path, &xml, "Record3/MatrixDimension/SizeZ")?;
    if layers != 1 {
        return Err(Error::format(path, format!("{layers} layers (SizeZ)"), "1; save one layer as a file"));
    }
    let (stored, type_name) = stored(path, &xml)?;
    let increment = |axis: &str| number(path, &xml, &format!("Record1/Axes/{axis}/Increment"));
    let (x, y) = (increment("CX")?, increment("CY")?);
    let extent = DeclaredExtent {
        x: bytes::positive(path, "Increment of CX", x.unwrap_or(0.0))? * nx as f64,
        y: bytes::positive(path, "Increment of CY", y.unwrap_or(0.0))? * ny as f64,
        unit: Some("m".into()),
    };
    let scale = bytes::factor(path, "Increment of CZ", increment("CZ")?.unwrap_or(1.0))?;
    let offset = number(path, &xml, "Record1/Axes/CZ/Offset")?.unwrap_or(0.0);
    let mut heights = heights(&mut archive, &xml, &main, [nx, ny], stored)?;
    // Some programs write infinities for points that were not measured.
    heights.iter_mut().for_each(|h| *h = if h.is_finite() { *h * scale + offset } else { f64::NAN });
    let map = HeightMap::with_missing(&path.display().to_string(), nx, ny, heights)?;
    let declared = Declared { unit: Some("m".into()), extent: Some(extent), ..Declared::default() };
    Ok(ImportedFile::map(map, declared, format!("x3p (ISO 25178-72), {type_name} [ny, nx]")))
}

/// Returns an error for profiles, point clouds, and axes with coordinates of their own.
fn kinds(path: &Path, xml: &Elements) -> Result<()> {
    let refuse = |found: String, accepted: &str| Err(Error::format(path, found, accepted));
    match xml.text("Record1/FeatureType") {
        Some("SUR") => {}
        Some("PRF") => return refuse("profiles (FeatureType PRF)".into(), "a surface (SUR)"),
        Some("PCL") => return refuse("a point cloud (FeatureType PCL)".into(), "a surface (SUR) on an even grid"),
        other => return refuse(format!("FeatureType {:?}", other.unwrap_or("")), "a surface (SUR)"),
    }
    for (axis, accepted) in [("CX", "I"), ("CY", "I"), ("CZ", "A")] {
        let kind = xml.text(&format!("Record1/Axes/{axis}/AxisType")).unwrap_or("");
        if kind != accepted {
            let accepted = format!("{accepted}: heights on an even grid (in Gwyddion save as .gwy)");
            return refuse(format!("AxisType {kind:?} of {axis}"), &accepted);
        }
    }
    Ok(())
}

fn stored(path: &Path, xml: &Elements) -> Result<(DType, &'static str)> {
    Ok(match xml.text("Record1/Axes/CZ/DataType").unwrap_or("") {
        "I" => (I16, "int16"),
        "L" => (I32, "int32"),
        "F" => (F32, "float32"),
        "D" => (F64, "float64"),
        other => return Err(Error::format(path, format!("DataType {other:?} of CZ"), "I, L, F or D")),
    })
}

/// Matrix from its file in the archive, or from the list in `main.xml`.
fn heights(
    archive: &mut X3pArchive,
    xml: &Elements,
    main: &[u8],
    [nx, ny]: [usize; 2],
    stored: DType,
) -> Result<Vec<f64>> {
    let path = archive.path;
    let points = format!("{nx} x {ny} points");
    let count = nx.saturating_mul(ny);
    let Some(link) = xml.text("Record3/DataLink/PointDataLink") else {
        checksum_file(archive, xml, &[(MAIN, main)])?;
        if xml.list.len() == count {
            return Ok(xml.list.clone());
        }
        let found = format!("no PointDataLink, and {} heights in {MAIN}", xml.list.len());
        return Err(Error::format(path, found, format!("{count}, for {points}")));
    };
    let data = archive.exactly(link, count.saturating_mul(stored.bytes) as u64, &points)?;
    checksum(path, xml.text("Record3/DataLink/MD5ChecksumPointData"), link, &data)?;
    checksum_file(archive, xml, &[(MAIN, main), (link, &data)])?;
    let mut heights = Bytes::of(path, &data).field([nx, ny], stored)?;
    if let Some(link) = xml.text("Record3/DataLink/ValidPointsLink") {
        // One bit per point, the lowest first.
        let valid = archive.exactly(link, count.div_ceil(8) as u64, &points)?;
        checksum(path, xml.text("Record3/DataLink/MD5ChecksumValidPoints"), link, &valid)?;
        let unmeasured = heights.iter_mut().enumerate().filter(|(i, _)| valid[i / 8] >> (i % 8) & 1 == 0);
        unmeasured.for_each(|(_, h)| *h = f64::NAN);
    }
    Ok(heights)
}

/// Compares the MD5 sum of `bytes` with the one in hexadecimal digits, if there is one.
fn checksum(path: &Path, stated: Option<&str>, name: &str, bytes: &[u8]) -> Result<()> {
    let Some(stated) = stated.filter(|s| !s.is_empty()) else { return Ok(()) };
    let own: String = Md5::digest(bytes).iter().map(|b| format!("{b:02x}")).collect();
    if own.eq_ignore_ascii_case(stated) {
        return Ok(());
    }
    let found = format!("{name:?} with the MD5 sum {own}");
    Err(Error::format(path, found, format!("{stated:?}, as the file states (it was changed or damaged)")))
}

/// Checks the file of MD5 sums, if there is one: lines of `SUM *NAME`, without a name that of `main.xml`.
fn checksum_file(archive: &mut X3pArchive, xml: &Elements, files: &[(&str, &[u8])]) -> Result<()> {
    const LONGEST: u64 = 1 << 16;
    let name = xml.text("Record4/ChecksumFile").filter(|n| !n.is_empty()).unwrap_or("md5checksum.hex");
    if archive.entry(name).is_err() {
        return Ok(());
    }
    let text = archive.bytes(name, LONGEST)?;
    for line in String::from_utf8_lossy(&text).lines() {
        let Some((md5, listed)) = line.trim().split_once(' ').or(Some((line.trim(), MAIN))) else { continue };
        let listed = listed.trim().trim_start_matches('*');
        if let Some((name, bytes)) = files.iter().find(|(name, _)| *name == listed) {
            checksum(archive.path, Some(md5), name, bytes)?;
        }
    }
    Ok(())
}

fn number(path: &Path, xml: &Elements, key: &str) -> Result<Option<f64>> {
    let Some(text) = xml.text(key).filter(|t| !t.is_empty()) else { return Ok(None) };
    let number = text.parse::<f64>().ok().filter(|n| n.is_finite());
    number.map(Some).ok_or_else(|| Error::format(path, format!("{key} = {text:?} in {MAIN}"), "a finite number"))
}

fn count(path: &Path, xml: &Elements, key: &str) -> Result<usize> {
    let text = xml.text(key).unwrap_or("");
    let number = text.parse::<u32>().ok().filter(|n| *n > 0);
    let accepted = "a whole number, 1 or more (a matrix of heights)";
    number.map(|n| n as usize).ok_or_else(|| Error::format(path, format!("{key} = {text:?} in {MAIN}"), accepted))
}
