use super::array::{self, Order, choose};
use super::attributes::{Array, Attributes};
use super::content::{ImportOptions, ImportedFile};
use crate::error::{Error, Result};
use crate::record::heights::Declared;
use crate::record::npy::{DType, fits};
use netcdf_reader::{NcFile, NcType, NcVariable};
use std::path::Path;

/// Reads a variable of a classic NetCDF file (NetCDF-3, as written by scipy and SurfaceTopography): `[ny, nx]`, or
/// `[nx, ny]` if its dimensions are named x and y in this order.
pub(super) fn read(path: &Path, options: ImportOptions) -> Result<ImportedFile> {
    let damaged = |e: netcdf_reader::Error| {
        Error::format(path, format!("damaged, or not to be understood ({e})"), "a NetCDF file")
    };
    let file = NcFile::open(path).map_err(damaged)?;
    let variables = file.variables().map_err(damaged)?;
    let map_like =
        |v: &&NcVariable| v.shape().len() == 2 && v.shape().iter().all(|n| *n > 0) && stored(v.dtype()).is_some();
    let names: Vec<String> = variables.iter().filter(map_like).map(|v| v.name().to_string()).collect();
    // SurfaceTopography stores a mask of the points that were not measured as a separate variable.
    let (masks, names): (Vec<_>, Vec<_>) = names.into_iter().partition(|n| n == "mask");
    let name = choose(path, &names, options)?;
    let variable = file.variable(name).map_err(damaged)?;
    let stored = stored(variable.dtype()).expect("chosen among numbers");
    let shape = variable.shape();
    let shape = [shape[0] as usize, shape[1] as usize];
    // Two copies in f64: as read, and transposed.
    fits(path, 16 * (shape[0] as u64).saturating_mul(shape[1] as u64))?;
    let mut values: Vec<f64> = file.read_variable_as_f64(name).map_err(damaged)?.iter().copied().collect();
    for mask in masks {
        let marked = file.read_variable_as_f64(&mask).map_err(damaged)?;
        if let Some(i) = marked.iter().position(|m| *m != 0.0) {
            let found = format!("no height at [{}, {}] (variable {mask})", i / shape[1], i % shape[1]);
            return Err(Error::format(path, found, "heights at all points; fill them in before"));
        }
    }
    let attributes = attributes(variable);
    attributes.unpack(&Array { path, name, width: shape[1], stored }, &mut values, true)?;
    let (order, unit) = (order(variable), attributes.unit());
    let map = array::map(path, shape, values, order)?;
    Ok(ImportedFile::map(map, Declared { sign: None, unit }, format!("NetCDF variable {name} {}", order.words())))
}

/// Index order of a variable.
pub(super) fn order(variable: &NcVariable) -> Order {
    let names: Vec<&str> = variable.dimensions().iter().map(|d| d.name.as_str()).collect();
    if names == ["x", "y"] { Order::RowsOfY } else { Order::RowsOfX }
}

fn attributes(variable: &NcVariable) -> Attributes {
    let mut all = Attributes::default();
    for a in variable.attributes() {
        if let Some(numbers) = a.value.as_f64_vec() {
            all.numbers.insert(a.name.clone(), numbers);
        } else if let Some(words) = a.value.as_string() {
            all.words.insert(a.name.clone(), words);
        }
    }
    all
}

/// Type of a stored number; the reader handles the byte order.
fn stored(kind: &NcType) -> Option<DType> {
    let big = true;
    Some(match kind {
        NcType::Double => DType::F8 { big },
        NcType::Float => DType::F4 { big },
        NcType::Byte => DType::Signed { bytes: 1, big },
        NcType::Short => DType::Signed { bytes: 2, big },
        NcType::Int => DType::Signed { bytes: 4, big },
        NcType::Int64 => DType::Signed { bytes: 8, big },
        NcType::UByte => DType::Unsigned { bytes: 1, big },
        NcType::UShort => DType::Unsigned { bytes: 2, big },
        NcType::UInt => DType::Unsigned { bytes: 4, big },
        NcType::UInt64 => DType::Unsigned { bytes: 8, big },
        _ => return None,
    })
}
