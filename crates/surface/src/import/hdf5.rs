use super::array::{MASK, Order, Plane, check_mask, choose, names};
use super::attributes::{Array, Attributes, Coordinate};
use super::content::{ImportOptions, ImportedFile};
use super::declare::Described;
use super::netcdf;
use super::source::check_ratio;
use crate::files::atomic_file::open_regular;
use crate::files::npy::fits;
use crate::files::number::{DType, NumberKind};
use asperity_grid::error::{Error, Result};
use hdf5_reader::{Attribute, ByteOrder, DEFAULT_MAX_CHUNK_BYTES, Dataset, Datatype, Hdf5File};
use std::collections::{HashSet, VecDeque};
use std::path::Path;

/// Maximum number of groups searched for data sets. Each is searched once, because links may form cycles.
const MOST_GROUPS: usize = 10_000;

/// Suggested chunk size along each side: 1024² doubles are 8 MiB.
const ADVISED_CHUNK: u64 = 1024;

const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";

/// Attribute of the variables of a MATLAB file, which has its class.
const MATLAB_CLASS: &str = "MATLAB_class";

/// MATLAB's classes of numbers; other arrays are text, flags or references.
const MATLAB_NUMBERS: [&str; 10] =
    ["double", "single", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64"];

/// Groups of MATLAB with the contents of cells and objects.
const MATLAB_HIDDEN: [&str; 2] = ["#refs#/", "#subsystem#/"];

/// Whether a file starts as HDF5, or as a MATLAB file from version 7.3 on, which is HDF5 after 512 bytes of text.
pub(super) fn starts(start: &[u8]) -> bool {
    let after = |user_block: usize| start.get(user_block..).is_some_and(|remainder| remainder.starts_with(SIGNATURE));
    start.starts_with(b"MATLAB 7.3 MAT") || [0, 512, 1024, 2048].into_iter().any(after)
}

/// Reads a two-dimensional data set, or a plane of one in three dimensions, of an HDF5, NetCDF-4 or MATLAB file: `[ny, nx]` unless its dimensions are named x and y. MATLAB
/// stores matrices by columns, so a matrix with one row per y is an array `[nx, ny]`. `length`: bytes of the file.
pub(super) fn read(path: &Path, options: ImportOptions) -> Result<ImportedFile> {
    let (_, length) = open_regular(path)?;
    let damaged = |e| damaged(path, e);
    let file = Hdf5File::open(path).map_err(damaged)?;
    let end = file.superblock().eof_address;
    if length < end {
        let found = format!("{length} bytes, damaged: its header states {end}");
        return Err(Error::format(path, found, "a whole HDF5 file"));
    }
    // A requested data set is opened directly, without a search of all groups.
    let direct = options.dataset.and_then(|name| {
        let dataset = file.dataset(name).ok().filter(map_like)?;
        Some(Plane::of(name.trim_start_matches('/'), dataset.shape())).filter(|planes| planes.len() == 1)
    });
    let planes = match direct {
        Some(planes) => planes,
        None => collect(path, &file)?.into_iter().filter(|p| last(&p.array) != MASK).collect(),
    };
    let plane = choose(path, &planes, options)?;
    let (name, array, shape) = (&*plane.name, &*plane.array, plane.shape);
    let dataset = file.dataset(array).map_err(damaged)?;
    let kind = stored(dataset.dtype()).expect("chosen among numbers");
    let mut values = numbers(path, length, plane, &dataset, kind)?;
    // Plain HDF5 has no named dimensions and no default fill values.
    let is_netcdf = dataset.attributes().iter().any(|a| a.name == "DIMENSION_LIST");
    let own = attributes(dataset.attributes());
    own.unpack(&Array { path, name, stored: kind }, &mut values, is_netcdf)?;
    let folder = &array[..array.len() - last(array).len()];
    if let Ok(mask) = file.dataset(&format!("{folder}{MASK}"))
        && let Some(kind) = flags(mask.dtype()).or_else(|| stored(mask.dtype()))
        && let masks = Plane::of(MASK, mask.shape())
        && let Some(of) = masks.get(plane.index).or(masks.first())
    {
        check_mask(path, "data set mask", of.shape, (name, shape))?;
        let flags = numbers(path, length, of, &mask, kind)?;
        values.iter_mut().zip(flags).filter(|(_, m)| *m != 0.0).for_each(|(v, _)| *v = f64::NAN);
    }
    let is_matlab = matlab_class(&dataset).is_some();
    let (order, axes) = if is_netcdf {
        scales(path, &file, array, folder)?
    } else if is_matlab {
        (Order::RowsOfY, ["x", "y"].map(|axis| sibling(&file, folder, axis)))
    } else {
        let labels = dataset.attribute("DIMENSION_LABELS").and_then(|a| a.read_strings()).unwrap_or_default();
        let order = if labels == ["x", "y"] { Order::RowsOfY } else { Order::RowsOfX };
        (order, ["x", "y"].map(|axis| sibling(&file, folder, axis)))
    };
    let shared = groups_above(&file, folder).map_err(damaged)?;
    let layout = match is_matlab {
        true => format!("MATLAB matrix {name}, one row per y"),
        false => format!("HDF5 data set {name} {}", order.words()),
    };
    let channels = &names(&planes)[..];
    let described = Described { path, channel: name, channels, shape, order, own: &own, shared: &shared, axes };
    described.imported(values, layout)
}

fn damaged(path: &Path, e: hdf5_reader::error::Error) -> Error {
    Error::format(path, format!("damaged, or not to be understood ({e})"), "an HDF5 file")
}

fn last(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}

/// Stored numbers of a plane of a data set.
fn numbers(path: &Path, length: u64, plane: &Plane, dataset: &Dataset, dtype: DType) -> Result<Vec<f64>> {
    let (damaged, name) = (|e| damaged(path, e), &plane.array);
    refuse_large_chunks(path, name, dataset, dtype)?;
    // Memory of the stored bytes and of the converted numbers.
    let count = dataset.num_elements().map_err(damaged)?;
    check_ratio(path, name, count.saturating_mul(dtype.bytes as u64), length)?;
    fits(path, count.saturating_mul(dtype.bytes as u64 + 8))?;
    let bytes = dataset.read_raw_bytes().map_err(damaged)?;
    let points = plane.shape[0] * plane.shape[1];
    let stored = bytes.chunks_exact(dtype.bytes).skip(plane.index * points).take(points);
    Ok(stored.map(|b| dtype.value(b)).collect())
}

/// Index order and coordinates of a data set with dimension scales, which NetCDF-4 and xarray write.
///
/// # Errors
/// Dimension scales that cannot be read: without them x and y could be swapped.
fn scales(path: &Path, hdf5: &Hdf5File, name: &str, folder: &str) -> Result<(Order, [Option<Coordinate>; 2])> {
    let damaged = |reason: String| {
        let found = format!("dimension scales of {name} are damaged, or not to be understood ({reason})");
        Error::format(path, found, "a whole NetCDF-4 file, or a data set without DIMENSION_LIST")
    };
    let unread = |e: netcdf_reader::Error| damaged(e.to_string());
    let file = netcdf_reader::NcFile::open(path).map_err(unread)?;
    let variable = file.variable(name).map_err(unread)?;
    for dimension in netcdf::map_names(variable) {
        // The reader makes up names of dimensions whose scales it does not find.
        let above = folder.match_indices('/').map(|(i, _)| &folder[..=i]).chain([""]);
        let is_there = |group: &str| hdf5.dataset(&format!("{group}{dimension}")).is_ok_and(|d| d.ndim() == 1);
        if !above.into_iter().any(is_there) {
            return Err(damaged(format!("no data set for dimension {dimension}")));
        }
    }
    Ok((netcdf::order(variable), netcdf::axes(path, &file, variable)?))
}

/// MATLAB's class of a variable.
fn matlab_class(dataset: &Dataset) -> Option<String> {
    dataset.attribute(MATLAB_CLASS).ok()?.read_string().ok()
}

/// Coordinates in a data set of the same group. MATLAB's vectors have a second dimension of 1.
fn sibling(file: &Hdf5File, folder: &str, axis: &str) -> Option<Coordinate> {
    /// Points along one side of the largest maps.
    const MOST: u64 = 1 << 20;
    let dataset = file.dataset(&format!("{folder}{axis}")).ok()?;
    let is_vector = match dataset.shape() {
        [n] => *n <= MOST,
        [n, 1] | [1, n] => *n <= MOST && matlab_class(&dataset).is_some(),
        _ => false,
    };
    let dtype = stored(dataset.dtype()).filter(|_| is_vector)?;
    let bytes = dataset.read_raw_bytes().ok()?;
    let values = bytes.chunks_exact(dtype.bytes).map(|b| dtype.value(b)).collect();
    Some(Coordinate { name: axis.to_string(), attributes: attributes(dataset.attributes()), values })
}

/// Attributes of the group of a data set and of those above it, nearer ones first.
fn groups_above(file: &Hdf5File, folder: &str) -> std::result::Result<Vec<Attributes>, hdf5_reader::error::Error> {
    let mut all = Vec::new();
    let mut folder = folder.trim_end_matches('/');
    while !folder.is_empty() {
        all.push(attributes(file.group(folder)?.attributes()?));
        folder = folder.rsplit_once('/').map_or("", |(above, _)| above);
    }
    all.push(attributes(file.root_group()?.attributes()?));
    Ok(all)
}

fn map_like(d: &Dataset) -> bool {
    // MATLAB's text, numbers and vectors are matrices, too.
    let (smallest, is_number) = match matlab_class(d) {
        Some(class) => (2, MATLAB_NUMBERS.contains(&class.as_str())),
        None => (1, true),
    };
    let large_enough = d.ndim() >= 2 && (d.ndim() > 2 || d.shape().iter().all(|n| *n >= smallest));
    is_number && large_enough && stored(d.dtype()).is_some()
}

/// The maps of the data sets, those of the root group first.
fn collect(path: &Path, file: &Hdf5File) -> Result<Vec<Plane>> {
    let damaged = |e: hdf5_reader::error::Error| {
        let accepted = "an HDF5 file, or a data set of it as --dataset (surface.dataset)";
        Error::format(path, format!("damaged, or not to be understood ({e})"), accepted)
    };
    let root = file.root_group().map_err(damaged)?;
    let mut seen = HashSet::from([root.address()]);
    let mut waiting = VecDeque::from([(root, String::new())]);
    let mut planes = Vec::new();
    while let Some((group, above)) = waiting.pop_front() {
        let (groups, datasets) = group.members().map_err(damaged)?;
        let map_like = datasets.iter().filter(|d| map_like(d));
        planes.extend(map_like.flat_map(|d| Plane::of(&format!("{above}{}", d.name()), d.shape())));
        for g in groups {
            if !seen.insert(g.address()) {
                continue;
            }
            if seen.len() > MOST_GROUPS {
                let accepted = "the name of a two-dimensional data set as --dataset (surface.dataset)";
                return Err(Error::format(path, format!("more than {MOST_GROUPS} groups"), accepted));
            }
            let below = format!("{above}{}/", g.name());
            if MATLAB_HIDDEN.contains(&below.as_str()) {
                continue;
            }
            waiting.push_back((g, below));
        }
    }
    Ok(planes)
}

/// The reader limits the chunk size; its own error message suggests no remedy.
fn refuse_large_chunks(path: &Path, name: &str, dataset: &Dataset, dtype: DType) -> Result<()> {
    let Some(chunks) = dataset.chunks() else { return Ok(()) };
    let bytes = chunks.iter().fold(dtype.bytes as u64, |n, c| n.saturating_mul((*c).into()));
    if bytes <= DEFAULT_MAX_CHUNK_BYTES as u64 {
        return Ok(());
    }
    let times = |list: Vec<u64>| list.iter().map(u64::to_string).collect::<Vec<_>>().join("x");
    let found =
        format!("data set {name} in chunks of {} ({bytes} bytes)", times(chunks.iter().map(|c| (*c).into()).collect()));
    let advised = times(dataset.shape().iter().map(|n| ADVISED_CHUNK.min(*n)).collect());
    let accepted = format!("chunks up to {DEFAULT_MAX_CHUNK_BYTES} bytes: h5repack -l {name}:CHUNK={advised} OLD NEW");
    Err(Error::format(path, found, accepted))
}

fn attributes(list: Vec<Attribute>) -> Attributes {
    let mut all = Attributes::default();
    for a in list {
        if let Some(kind) = flags(&a.datatype).or_else(|| stored(&a.datatype)) {
            let numbers = a.raw_data.chunks_exact(kind.bytes).map(|b| kind.value(b)).collect();
            all.numbers.insert(a.name, numbers);
        } else if let Ok(tokens) = a.read_string() {
            all.words.insert(a.name, tokens);
        }
    }
    all
}

/// Type of flags: h5py stores booleans as an enumeration.
fn flags(kind: &Datatype) -> Option<DType> {
    match kind {
        Datatype::Enum { base, .. } => stored(base),
        _ => None,
    }
}

fn stored(kind: &Datatype) -> Option<DType> {
    let (kind, bytes, order) = match kind {
        Datatype::FloatingPoint { size, byte_order } => (NumberKind::Float, size, byte_order),
        Datatype::FixedPoint { size, signed: true, byte_order } => (NumberKind::Signed, size, byte_order),
        Datatype::FixedPoint { size, byte_order, .. } => (NumberKind::Unsigned, size, byte_order),
        _ => return None,
    };
    DType::new(kind, usize::from(*bytes), *order == ByteOrder::BigEndian)
}
