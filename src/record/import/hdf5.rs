use super::array::{self, Order, choose};
use super::netcdf::{order_and_unit, refuse_missing};
use super::{Asked, Found};
use crate::error::{Error, Result};
use crate::record::heights::Declared;
use crate::record::npy::{Stored, fits};
use hdf5_reader::{ByteOrder, Datatype, Hdf5File};
use std::path::Path;

/// Groups within groups that are looked into: links may go in circles.
const DEPTH: usize = 8;

/// One two-dimensional data set of an HDF5 file, NetCDF-4 included: `[ny, nx]` unless its dimensions are named x and y.
pub(super) fn read(path: &Path, asked: Asked) -> Result<Found> {
    let damaged = |e: hdf5_reader::error::Error| {
        Error::format(path, format!("damaged, or not to be understood ({e})"), "an HDF5 file")
    };
    let file = Hdf5File::open(path).map_err(damaged)?;
    let mut names = Vec::new();
    collect(&file.root_group().map_err(damaged)?, "", DEPTH, &mut names).map_err(damaged)?;
    let name = choose(path, &names, asked)?;
    let dataset = file.dataset(name).map_err(damaged)?;
    let stored = stored(dataset.dtype()).ok_or_else(|| {
        let found = format!("data set {name} of a type that is no real number");
        Error::format(path, found, "floating-point or integer numbers, 64 bits at most")
    })?;
    let shape = [dataset.shape()[0] as usize, dataset.shape()[1] as usize];
    // As bytes, and as numbers.
    let count = dataset.num_elements().map_err(damaged)?;
    fits(path, count.saturating_mul(stored.bytes() as u64 + 8))?;
    let bytes = dataset.read_raw_bytes().map_err(damaged)?;
    let values: Vec<f64> = bytes.chunks_exact(stored.bytes()).map(|b| stored.value(b)).collect();
    drop(bytes);
    // Plain HDF5 does not name its dimensions.
    let (mut order, mut unit) = (Order::RowsOfX, None);
    if let Ok(file) = netcdf_reader::NcFile::open(path)
        && let Ok(variable) = file.variable(name)
    {
        (order, unit) = order_and_unit(variable);
        refuse_missing(path, variable, &values)?;
    }
    let map = array::map(path, shape, values, order)?;
    let declared = Declared { sign: None, unit };
    Ok(Found::map(map, declared, format!("HDF5 data set {name} {}", order.words())))
}

fn collect(
    group: &hdf5_reader::group::Group,
    above: &str,
    depth: usize,
    names: &mut Vec<String>,
) -> hdf5_reader::error::Result<()> {
    let (groups, datasets) = group.members()?;
    for d in datasets {
        if d.ndim() == 2 && d.shape().iter().all(|n| *n > 0) && stored(d.dtype()).is_some() {
            names.push(format!("{above}{}", d.name()));
        }
    }
    for g in groups.iter().filter(|_| depth > 0) {
        collect(g, &format!("{above}{}/", g.name()), depth - 1, names)?;
    }
    Ok(())
}

fn stored(kind: &Datatype) -> Option<Stored> {
    let big = |order: &ByteOrder| *order == ByteOrder::BigEndian;
    match kind {
        Datatype::FloatingPoint { size: 8, byte_order } => Some(Stored::F8 { big: big(byte_order) }),
        Datatype::FloatingPoint { size: 4, byte_order } => Some(Stored::F4 { big: big(byte_order) }),
        Datatype::FloatingPoint { size: 2, byte_order } => Some(Stored::F2 { big: big(byte_order) }),
        Datatype::FixedPoint { size, signed, byte_order } => {
            let (bytes, big) = (usize::from(*size), big(byte_order));
            let known = [1, 2, 4, 8].contains(&bytes);
            known.then_some(if *signed { Stored::Signed { bytes, big } } else { Stored::Unsigned { bytes, big } })
        }
        _ => None,
    }
}
