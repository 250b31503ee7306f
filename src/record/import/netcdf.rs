use super::array::{self, Order, choose};
use super::{Asked, Found};
use crate::error::{Error, Result};
use crate::record::heights::Declared;
use crate::record::npy::fits;
use netcdf_reader::{NcAttrValue, NcFile, NcType, NcVariable};
use std::path::Path;

/// A variable of a classic NetCDF file (NetCDF-3, as scipy and SurfaceTopography write it): `[ny, nx]`, or `[nx, ny]` where
/// its dimensions are named x and y in this order.
pub(super) fn read(path: &Path, asked: Asked) -> Result<Found> {
    let damaged = |e: netcdf_reader::Error| {
        Error::format(path, format!("damaged, or not to be understood ({e})"), "a NetCDF file")
    };
    let file = NcFile::open(path).map_err(damaged)?;
    let variables = file.variables().map_err(damaged)?;
    let map_like = |v: &&NcVariable| {
        let text = matches!(v.dtype(), NcType::Char | NcType::String);
        v.shape().len() == 2 && v.shape().iter().all(|n| *n > 0) && !text
    };
    let names: Vec<String> = variables.iter().filter(map_like).map(|v| v.name().to_string()).collect();
    // SurfaceTopography marks the points that were not measured beside the heights.
    let (masks, names): (Vec<_>, Vec<_>) = names.into_iter().partition(|n| n == "mask");
    let name = choose(path, &names, asked)?;
    let variable = file.variable(name).map_err(damaged)?;
    let shape = variable.shape();
    let shape = [shape[0] as usize, shape[1] as usize];
    // As numbers, and once more while they are turned.
    fits(path, 16 * (shape[0] as u64).saturating_mul(shape[1] as u64))?;
    let values: Vec<f64> = file.read_variable_as_f64(name).map_err(damaged)?.iter().copied().collect();
    for mask in masks {
        let marked = file.read_variable_as_f64(&mask).map_err(damaged)?;
        if let Some(i) = marked.iter().position(|m| *m != 0.0) {
            let found = format!("no height at [{}, {}] (variable {mask})", i / shape[1], i % shape[1]);
            return Err(Error::format(path, found, "heights at all points; fill them in before"));
        }
    }
    refuse_missing(path, variable, &values)?;
    let (order, unit) = order_and_unit(variable);
    let map = array::map(path, shape, values, order)?;
    Ok(Found::map(map, Declared { sign: None, unit }, format!("NetCDF variable {name} {}", order.words())))
}

/// Which index is x, and the unit that a variable declares.
pub(super) fn order_and_unit(variable: &NcVariable) -> (Order, Option<String>) {
    let names: Vec<&str> = variable.dimensions().iter().map(|d| d.name.as_str()).collect();
    let order = if names == ["x", "y"] { Order::RowsOfY } else { Order::RowsOfX };
    let unit =
        ["units", "unit"].iter().find_map(|a| match variable.attributes().iter().find(|b| b.name == **a)?.value {
            NcAttrValue::Chars(ref text) => Some(text.clone()),
            _ => None,
        });
    (order, unit)
}

/// Values that a variable declares to stand for none.
pub(super) fn refuse_missing(path: &Path, variable: &NcVariable, values: &[f64]) -> Result<()> {
    let missing = ["_FillValue", "missing_value"].iter().find_map(|a| number(variable, a));
    let Some(i) = missing.and_then(|m| values.iter().position(|v| *v == m)) else { return Ok(()) };
    let width = variable.shape().last().map_or(1, |n| *n as usize);
    let found = format!("no height at [{}, {}] of {} ({})", i / width, i % width, variable.name(), values[i]);
    Err(Error::format(path, found, "heights at all points; fill them in before"))
}

fn number(variable: &NcVariable, attribute: &str) -> Option<f64> {
    match &variable.attributes().iter().find(|a| a.name == attribute)?.value {
        NcAttrValue::Doubles(v) => v.first().copied(),
        NcAttrValue::Floats(v) => v.first().map(|f| f64::from(*f)),
        NcAttrValue::Ints(v) => v.first().map(|i| f64::from(*i)),
        _ => None,
    }
}
