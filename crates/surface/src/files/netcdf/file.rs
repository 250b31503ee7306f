//! Sequential writer of NetCDF-4 files.

use super::layout;
use super::variable::{Attribute, Variable, VariableData};
use crate::files::atomic_file::write_atomic;
use crate::files::npy::NpyReader;
use asperity_grid::error::{Error, Result};
use std::io::{self, Write};
use std::path::Path;

/// Maximum length of a text attribute, bytes; a message of an object header has at most 64 KiB.
const LONGEST_TEXT: usize = 60_000;

/// Writes a file. Every dimension must have a numeric coordinate variable, which defines its size.
///
/// # Errors
/// A dimension without a coordinate; a variable whose values do not match its dimensions; a map whose shape differs
/// from the declared one.
pub fn write(path: &Path, attributes: &[(String, Attribute)], variables: &[Variable]) -> Result<()> {
    let texts = variables.iter().flat_map(|v| &v.attributes).chain(attributes);
    if let Some((name, _)) = texts.into_iter().find(|(_, a)| matches!(a, Attribute::Text(t) if t.len() > LONGEST_TEXT))
    {
        let found = format!("attribute {name} of more than {LONGEST_TEXT} bytes");
        return Err(Error::format(path, found, "a shorter text"));
    }
    let shapes: Vec<Vec<u64>> = variables.iter().map(|v| shape(path, variables, v)).collect::<Result<_>>()?;
    let head = layout::head(attributes, variables, &shapes);
    write_atomic(path, |w| {
        w.write_all(&head)?;
        for (variable, shape) in variables.iter().zip(&shapes) {
            let bytes = put(w, &variable.data, shape)
                .map_err(|e| io::Error::new(e.kind(), format!("variable {}: {e}", variable.name)))?;
            w.write_all(&[0; 8][..layout::padding(bytes)])?;
        }
        Ok(())
    })
}

fn shape(path: &Path, variables: &[Variable], variable: &Variable) -> Result<Vec<u64>> {
    let size = |dimension: &String| {
        let coordinate = variables.iter().find(|v| v.name == *dimension && v.dimensions == [dimension.as_str()]);
        match coordinate.map(|c| &c.data) {
            Some(VariableData::Numbers(values)) if !values.is_empty() => Ok(values.len() as u64),
            _ => {
                let found = format!("variable {} along {dimension}", variable.name);
                Err(Error::format(path, found, "dimensions that have a coordinate"))
            }
        }
    };
    let shape: Vec<u64> = variable.dimensions.iter().map(size).collect::<Result<_>>()?;
    let count: u64 = shape.iter().product();
    let holds = match &variable.data {
        VariableData::Numbers(values) => values.len() as u64 == count,
        VariableData::Scaled(files, _) | VariableData::AtMostZero(files) | VariableData::Flags(files) => {
            shape.len() >= 2 && shape[..shape.len() - 2].iter().product::<u64>() == files.len() as u64
        }
    };
    let found = || format!("values of {} that do not fill its dimensions {shape:?}", variable.name);
    if holds { Ok(shape) } else { Err(Error::format(path, found(), "as many as they have points")) }
}

/// Writes the values of a variable and returns their number of bytes.
fn put(w: &mut impl Write, data: &VariableData, shape: &[u64]) -> io::Result<u64> {
    let count: u64 = shape.iter().product();
    let (files, select): (_, Box<dyn Fn(f64) -> f64>) = match data {
        VariableData::Numbers(values) => {
            values.iter().try_for_each(|v| w.write_all(&v.to_le_bytes()))?;
            return Ok(8 * count);
        }
        VariableData::Scaled(files, factor) => (files, Box::new(move |v| v * factor)),
        VariableData::AtMostZero(files) => (files, Box::new(|v| f64::from(u8::from(v <= 0.0)))),
        VariableData::Flags(files) => (files, Box::new(|v| v)),
    };
    let map = [shape[shape.len() - 2], shape[shape.len() - 1]];
    let wide = data.bytes_each() == 8;
    let mut bytes = Vec::new();
    for file in files {
        let reader = NpyReader::open(file).map_err(io::Error::other)?;
        if [reader.ny as u64, reader.nx as u64] != map {
            let found = format!("{} is [{}, {}], not {map:?}", file.display(), reader.ny, reader.nx);
            return Err(io::Error::new(io::ErrorKind::InvalidInput, found));
        }
        let mut written = Ok(());
        reader
            .for_each_row(|_, row| {
                bytes.clear();
                for &value in row {
                    if wide { bytes.extend(select(value).to_le_bytes()) } else { bytes.push(select(value) as u8) }
                }
                if written.is_ok() {
                    written = w.write_all(&bytes);
                }
            })
            .map_err(io::Error::other)?;
        written?;
    }
    Ok(count * data.bytes_each() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::npy;
    use std::path::PathBuf;

    fn numbers(name: &str, dimensions: &[&str], values: &[f64]) -> Variable {
        Variable::new(name, dimensions, VariableData::Numbers(values.to_vec()), "m", "what it is")
    }

    /// The file is read by an independent implementation of the format.
    #[test]
    fn another_reader_finds_names_numbers_and_units() {
        let folder = tempfile::tempdir().unwrap();
        let maps: Vec<PathBuf> = (0..2).map(|k| folder.path().join(format!("{k}.npy"))).collect();
        for (k, map) in maps.iter().enumerate() {
            npy::write(map, 3, 2, (0..6).map(|i| (10 * k) as f64 + f64::from(i) - 1.0)).unwrap();
        }
        let axes = ["load", "y", "x"];
        let path = folder.path().join("results.nc");
        let variables = [
            numbers("x", &["x"], &[0.0, 1.0, 2.0]),
            numbers("y", &["y"], &[0.0, 1.0]),
            numbers("load", &["load"], &[0.1, 0.2]),
            numbers("curve", &["load"], &[5.0, f64::NAN]).with("answer", Attribute::Number(42.0)),
            Variable::new("gap", &axes, VariableData::Scaled(maps.clone(), 0.5), "m", "gap"),
            Variable::new("contact", &axes, VariableData::AtMostZero(maps), "1", "contact"),
            numbers("scalar", &[], &[7.0]),
        ];
        let title = [("title".to_string(), Attribute::Text("Übersicht".into()))];
        write(&path, &title, &variables).unwrap();
        let file = netcdf_reader::NcFile::open(&path).unwrap();
        assert!(
            matches!(&file.global_attribute("title").unwrap().value, netcdf_reader::NcAttrValue::Chars(t) if t == "Übersicht")
        );
        let gap = file.variable("gap").unwrap();
        assert_eq!(gap.dimensions().iter().map(|d| d.name.as_str()).collect::<Vec<_>>(), axes);
        let values: Vec<f64> = file.read_variable_as_f64("gap").unwrap().iter().copied().collect();
        assert_eq!(values, [-0.5, 0.0, 0.5, 1.0, 1.5, 2.0, 4.5, 5.0, 5.5, 6.0, 6.5, 7.0]);
        let contact: Vec<f64> = file.read_variable_as_f64("contact").unwrap().iter().copied().collect();
        assert_eq!(contact, [1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(file.read_variable_as_f64("scalar").unwrap().iter().copied().collect::<Vec<_>>(), [7.0]);
    }

    #[test]
    fn what_does_not_fit_is_not_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("results.nc");
        let says = |variables: &[Variable], piece: &str| {
            let message = write(&path, &[], variables).unwrap_err().to_string();
            assert!(message.contains("results.nc") && message.contains(piece), "{message}");
            assert!(!path.exists());
        };
        let x = numbers("x", &["x"], &[0.0, 1.0]);
        says(&[numbers("a", &["x"], &[1.0, 2.0])], "variable a along x");
        says(&[x.clone(), numbers("a", &["x"], &[1.0])], "values of a that do not fill");
        let map = folder.path().join("map.npy");
        npy::write(&map, 3, 2, [0.0_f64; 6]).unwrap();
        let y = numbers("y", &["y"], &[0.0, 1.0]);
        says(
            &[x, y, Variable::new("m", &["y", "x"], VariableData::Scaled(vec![map], 1.0), "m", "map")],
            "is [2, 3], not [2, 2]",
        );
    }
}
