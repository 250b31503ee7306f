use super::array::{self, Order, choose};
use super::attributes::{Array, Attributes};
use super::content::{ImportOptions, ImportedFile};
use super::netcdf;
use crate::error::{Error, Result};
use crate::record::heights::Declared;
use crate::record::npy::{DType, fits};
use hdf5_reader::{ByteOrder, DEFAULT_MAX_CHUNK_BYTES, Dataset, Datatype, Hdf5File};
use std::collections::{HashSet, VecDeque};
use std::path::Path;

/// Maximum number of groups searched for data sets. Each is searched once, because links may form cycles.
const MOST_GROUPS: usize = 10_000;

/// Suggested chunk size along each side: 1024² doubles are 8 MiB.
const ADVISED_CHUNK: u64 = 1024;

/// Reads a two-dimensional data set of an HDF5 or NetCDF-4 file: `[ny, nx]` unless its dimensions are named x and y.
pub(super) fn read(path: &Path, options: ImportOptions) -> Result<ImportedFile> {
    let damaged = |e: hdf5_reader::error::Error| {
        Error::format(path, format!("damaged, or not to be understood ({e})"), "an HDF5 file")
    };
    let file = Hdf5File::open(path).map_err(damaged)?;
    // A requested data set is opened directly, without a search of all groups.
    let direct = options.dataset.and_then(|name| Some((name, file.dataset(name).ok().filter(map_like)?)));
    let names;
    let (name, dataset) = match direct {
        Some((name, dataset)) => (name.trim_start_matches('/'), dataset),
        None => {
            names = collect(path, &file)?;
            let name = choose(path, &names, options)?;
            (name, file.dataset(name).map_err(damaged)?)
        }
    };
    let stored = stored(dataset.dtype()).expect("chosen among numbers");
    let shape = [dataset.shape()[0] as usize, dataset.shape()[1] as usize];
    refuse_large_chunks(path, name, &dataset, stored)?;
    // Memory of the stored bytes and of the converted numbers.
    let count = dataset.num_elements().map_err(damaged)?;
    fits(path, count.saturating_mul(stored.bytes() as u64 + 8))?;
    let bytes = dataset.read_raw_bytes().map_err(damaged)?;
    let mut values: Vec<f64> = bytes.chunks_exact(stored.bytes()).map(|b| stored.value(b)).collect();
    drop(bytes);
    // Plain HDF5 has no named dimensions and no default fill values.
    let is_netcdf = dataset.attribute("DIMENSION_LIST").is_ok();
    let mut order = Order::RowsOfX;
    if is_netcdf
        && let Ok(file) = netcdf_reader::NcFile::open(path)
        && let Ok(variable) = file.variable(name)
    {
        order = netcdf::order(variable);
    }
    let attributes = attributes(&dataset);
    attributes.unpack(&Array { path, name, width: shape[1], stored }, &mut values, is_netcdf)?;
    let map = array::map(path, shape, values, order)?;
    let declared = Declared { sign: None, unit: attributes.unit() };
    Ok(ImportedFile::map(map, declared, format!("HDF5 data set {name} {}", order.words())))
}

fn map_like(d: &Dataset) -> bool {
    d.ndim() == 2 && d.shape().iter().all(|n| *n > 0) && stored(d.dtype()).is_some()
}

/// Names of the candidate data sets, those of the root group first.
fn collect(path: &Path, file: &Hdf5File) -> Result<Vec<String>> {
    let damaged = |e: hdf5_reader::error::Error| {
        let accepted = "an HDF5 file, or a data set of it as --dataset (surface.dataset)";
        Error::format(path, format!("damaged, or not to be understood ({e})"), accepted)
    };
    let root = file.root_group().map_err(damaged)?;
    let mut seen = HashSet::from([root.address()]);
    let mut waiting = VecDeque::from([(root, String::new())]);
    let mut names = Vec::new();
    while let Some((group, above)) = waiting.pop_front() {
        let (groups, datasets) = group.members().map_err(damaged)?;
        names.extend(datasets.iter().filter(|d| map_like(d)).map(|d| format!("{above}{}", d.name())));
        for g in groups {
            if !seen.insert(g.address()) {
                continue;
            }
            if seen.len() > MOST_GROUPS {
                let accepted = "the name of a two-dimensional data set as --dataset (surface.dataset)";
                return Err(Error::format(path, format!("more than {MOST_GROUPS} groups"), accepted));
            }
            let below = format!("{above}{}/", g.name());
            waiting.push_back((g, below));
        }
    }
    Ok(names)
}

/// The reader limits the chunk size; its own error message suggests no remedy.
fn refuse_large_chunks(path: &Path, name: &str, dataset: &Dataset, stored: DType) -> Result<()> {
    let Some(chunks) = dataset.chunks() else { return Ok(()) };
    let bytes = chunks.iter().fold(stored.bytes() as u64, |n, c| n.saturating_mul((*c).into()));
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

fn attributes(dataset: &Dataset) -> Attributes {
    let mut all = Attributes::default();
    for a in dataset.attributes() {
        if let Some(kind) = stored(&a.datatype) {
            let numbers = a.raw_data.chunks_exact(kind.bytes()).map(|b| kind.value(b)).collect();
            all.numbers.insert(a.name, numbers);
        } else if let Ok(words) = a.read_string() {
            all.words.insert(a.name, words);
        }
    }
    all
}

fn stored(kind: &Datatype) -> Option<DType> {
    let big = |order: &ByteOrder| *order == ByteOrder::BigEndian;
    match kind {
        Datatype::FloatingPoint { size: 8, byte_order } => Some(DType::F8 { big: big(byte_order) }),
        Datatype::FloatingPoint { size: 4, byte_order } => Some(DType::F4 { big: big(byte_order) }),
        Datatype::FloatingPoint { size: 2, byte_order } => Some(DType::F2 { big: big(byte_order) }),
        Datatype::FixedPoint { size, signed, byte_order } => {
            let (bytes, big) = (usize::from(*size), big(byte_order));
            let known = [1, 2, 4, 8].contains(&bytes);
            known.then_some(if *signed { DType::Signed { bytes, big } } else { DType::Unsigned { bytes, big } })
        }
        _ => None,
    }
}
