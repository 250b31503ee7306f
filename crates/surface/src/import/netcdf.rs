use super::array::{MASK, Order, Plane, choose, map_dimensions, names};
use super::attributes::{Array, Attributes, Coordinate};
use super::content::{ImportOptions, ImportedFile};
use super::declare::Described;
use super::source::check_ratio;
use crate::files::atomic_file::open_regular;
use crate::files::npy::fits;
use crate::files::number::{DType, NumberKind};
use asperity_grid::error::{Error, Result};
use netcdf_reader::{NcAttribute, NcFile, NcType, NcVariable};
use std::path::Path;

pub(super) fn starts(start: &[u8]) -> bool {
    matches!(start, [b'C', b'D', b'F', 1 | 2 | 5, ..])
}

/// Reads a variable, or a plane of one in three dimensions, of a classic NetCDF file (NetCDF-3, as written by scipy and SurfaceTopography): `[ny, nx]`, or
/// `[nx, ny]` if its dimensions are named x and y in this order. `length`: bytes of the file.
pub(super) fn read(path: &Path, options: ImportOptions) -> Result<ImportedFile> {
    let (_, length) = open_regular(path)?;
    let damaged = |e: netcdf_reader::Error| {
        Error::format(path, format!("damaged, or not to be understood ({e})"), "a NetCDF file")
    };
    let file = NcFile::open(path).map_err(damaged)?;
    let variables = file.variables().map_err(damaged)?;
    let shape_of = |v: &NcVariable| v.shape().to_vec();
    let numeric = variables.iter().filter(|v| v.shape().len() >= 2 && stored(v.dtype()).is_some());
    let all: Vec<Plane> = numeric.flat_map(|v| Plane::of(v.name(), &shape_of(v))).collect();
    let (masks, planes): (Vec<_>, Vec<_>) = all.into_iter().partition(|p| p.array == MASK);
    let plane = choose(path, &planes, options)?;
    let (name, shape) = (&*plane.name, plane.shape);
    let variable = file.variable(&plane.array).map_err(damaged)?;
    let dtype = stored(variable.dtype()).expect("chosen among numbers");
    // Two copies in f64: as read, and transposed.
    let points = shape_of(variable).iter().fold(1_u64, |n, length| n.saturating_mul(*length));
    let bytes = points.saturating_mul(16);
    check_ratio(path, name, bytes / 16 * dtype.bytes as u64, length)?;
    fits(path, bytes)?;
    let stored_values = |name: &str| -> Result<Vec<f64>> {
        Ok(file.read_variable_as_f64(name).map_err(damaged)?.iter().copied().collect())
    };
    let mut values = plane.cut(&stored_values(&plane.array)?);
    let own = attributes(variable.attributes());
    own.unpack(&Array { path, name, stored: dtype }, &mut values, true)?;
    if let Some(mask) = masks.get(plane.index).or(masks.first()) {
        let marked = mask.cut(&stored_values(MASK)?);
        if marked.len() != values.len() {
            let found = format!("variable {MASK} of {} flags", marked.len());
            return Err(Error::format(path, found, format!("one flag for each of {} heights", values.len())));
        }
        values.iter_mut().zip(&marked).filter(|(_, m)| **m != 0.0).for_each(|(v, _)| *v = f64::NAN);
    }
    let order = order(variable);
    let axes = axes(path, &file, variable)?;
    let shared = [attributes(file.global_attributes().map_err(damaged)?)];
    let channels = &names(&planes)[..];
    let array = Described { path, channel: name, channels, shape, order, own: &own, shared: &shared, axes };
    array.imported(values, format!("NetCDF variable {name} {}", order.words()))
}

/// Coordinates along x and y: the variables with the names of the dimensions.
pub(super) fn axes(path: &Path, file: &NcFile, variable: &NcVariable) -> Result<[Option<Coordinate>; 2]> {
    let mut coordinates = [None, None];
    for (k, dimension) in map_names(variable).into_iter().enumerate() {
        let Ok(coordinate) = file.coordinate_variable(dimension) else { continue };
        if coordinate.shape().len() != 1 || stored(coordinate.dtype()).is_none() {
            continue;
        }
        let values = file.read_variable_as_f64(dimension).map_err(|e| {
            let found = format!("coordinates {dimension} damaged, or not to be understood ({e})");
            Error::format(path, found, "a NetCDF file")
        })?;
        let x_first = order(variable) == Order::RowsOfY;
        coordinates[if x_first { k } else { 1 - k }] = Some(Coordinate {
            name: dimension.to_string(),
            attributes: attributes(coordinate.attributes()),
            values: values.iter().copied().collect(),
        });
    }
    Ok(coordinates)
}

/// Names of the two dimensions of a map.
pub(super) fn map_names(variable: &NcVariable) -> Vec<&str> {
    let shape: Vec<u64> = variable.shape().to_vec();
    let kept = map_dimensions(&shape);
    let last = &kept[kept.len().saturating_sub(2)..];
    last.iter().map(|k| variable.dimensions()[*k].name.as_str()).collect()
}

/// Index order of a variable.
pub(super) fn order(variable: &NcVariable) -> Order {
    if map_names(variable) == ["x", "y"] { Order::RowsOfY } else { Order::RowsOfX }
}

fn attributes(list: &[NcAttribute]) -> Attributes {
    let mut all = Attributes::default();
    for a in list {
        if let Some(numbers) = a.value.as_f64_vec() {
            all.numbers.insert(a.name.clone(), numbers);
        } else if let Some(tokens) = a.value.as_string() {
            all.words.insert(a.name.clone(), tokens);
        }
    }
    all
}

/// Type of a stored number; the reader handles the byte order.
fn stored(kind: &NcType) -> Option<DType> {
    use NumberKind::{Float, Signed, Unsigned};
    let (kind, bytes) = match kind {
        NcType::Double => (Float, 8),
        NcType::Float => (Float, 4),
        NcType::Byte => (Signed, 1),
        NcType::Short => (Signed, 2),
        NcType::Int => (Signed, 4),
        NcType::Int64 => (Signed, 8),
        NcType::UByte => (Unsigned, 1),
        NcType::UShort => (Unsigned, 2),
        NcType::UInt => (Unsigned, 4),
        NcType::UInt64 => (Unsigned, 8),
        _ => return None,
    };
    DType::new(kind, bytes, true)
}
