//! Writes height maps as `.npy` with a JSON sidecar, as NetCDF or as ASCII matrices, and reads the first.
//!
//! An ASCII matrix has one line per y, from y = 0, with the heights along x separated by blanks; `#` starts a comment. The numbers do not
//! determine sign convention, unit and extents, so [`write()`] stores them in comments (`# sign: low points touch first`) or, for
//! `NAME.npy`, in `NAME.npy.json`, and [`super::import`] returns them. Heights are not flipped or shifted unless
//! [`HeightMap::low_first`] is called.

use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

pub use super::declared::{Declared, DeclaredExtent};
pub use super::height_map::{HeightMap, Touching};
use crate::files::atomic_file::write_atomic;
use crate::files::netcdf::{self, Attribute, Variable, VariableData};
use crate::files::{json, npy};
use asperity_grid::error::{Error, Result};

/// JSON sidecar of a `.npy` height map. `nx` and `ny` are those of the field.
#[derive(Debug, Serialize, Deserialize)]
struct Sidecar {
    nx: usize,
    ny: usize,
    /// [`Touching::words`].
    #[serde(skip_serializing_if = "Option::is_none")]
    sign: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    unit: Option<String>,
    #[serde(default)]
    layout: String,
    /// Extents along x and y, points times spacing.
    #[serde(skip_serializing_if = "Option::is_none")]
    length: Option<[f64; 2]>,
    /// Unit of both; without it that of the heights.
    #[serde(skip_serializing_if = "Option::is_none")]
    length_unit: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    periodic: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    channel: Option<String>,
    /// Steps of preparation, in their order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    history: Vec<String>,
}

const LAYOUT: &str = "[ny, nx], row = constant y, x fastest";

/// The sidecar of a map, where there may be one.
pub fn sidecar_path(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_os_string();
    name.push(".json");
    PathBuf::from(name)
}

/// Extensions of written text, besides none.
const TEXT: [&str; 4] = ["", "txt", "dat", "asc"];

/// Writes `.npy` (f64, with a JSON sidecar) or `.nc` (NetCDF-4) if the name has this extension, otherwise an ASCII matrix, with everything
/// that `declared` states except for the list of channels.
///
/// ASCII numbers are read back exactly; missing heights are `NaN`.
///
/// # Errors
/// Other extensions than these and those of text.
pub fn write(path: &Path, map: &HeightMap, declared: &Declared) -> Result<()> {
    let extent = declared.extent.as_ref();
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if extension == "nc" {
        return write_netcdf(path, map, declared);
    }
    if extension != "npy" && !TEXT.contains(&&*extension) {
        let found = format!("a map to be written as .{extension}");
        return Err(Error::format(path, found, "a name that ends in .npy, .nc, .txt, .dat or .asc, or has no ending"));
    }
    if extension == "npy" {
        npy::write(path, map.nx, map.ny, map.heights.iter().copied())?;
        let sidecar = Sidecar {
            nx: map.nx,
            ny: map.ny,
            sign: declared.sign.map(|sign| sign.words().into()),
            unit: declared.unit.clone(),
            layout: LAYOUT.to_string(),
            length: extent.map(|e| [e.x, e.y]),
            length_unit: extent.and_then(|e| e.unit.clone()),
            periodic: declared.periodic,
            channel: declared.channel.clone(),
            history: declared.history.clone(),
        };
        return json::write(&sidecar_path(path), &sidecar);
    }
    let length = extent.map(|e| format!("{:?} {:?} {}", e.x, e.y, e.unit.as_deref().unwrap_or_default()));
    let header = [
        ("nx", Some(map.nx.to_string())),
        ("ny", Some(map.ny.to_string())),
        ("sign", declared.sign.map(|s| s.words().to_string())),
        ("unit", declared.unit.clone()),
        ("length", length),
        ("periodic", declared.periodic.map(|p| if p { "yes" } else { "no" }.to_string())),
        ("channel", declared.channel.clone()),
    ];
    let history = declared.history.iter().map(|step| ("history", Some(step.clone())));
    write_atomic(path, |w| {
        writeln!(w, "# heights {LAYOUT}")?;
        for (key, value) in header.into_iter().chain(history) {
            if let Some(value) = value {
                writeln!(w, "# {key}: {}", value.replace(['\n', '\r'], " ").trim())?;
            }
        }
        for row in map.heights.chunks_exact(map.nx) {
            for (x, h) in row.iter().enumerate() {
                write!(w, "{}{h:e}", if x == 0 { "" } else { " " })?;
            }
            writeln!(w)?;
        }
        Ok(())
    })
}

/// NetCDF-4: `heights[y, x]` with coordinates, what is declared as attributes.
fn write_netcdf(path: &Path, map: &HeightMap, declared: &Declared) -> Result<()> {
    let unit = declared.unit.as_deref().unwrap_or("1");
    let extent = declared.extent.as_ref();
    let lateral = extent.and_then(|e| e.unit.as_deref()).unwrap_or(unit);
    let coordinate = |name: &str, n: usize, length: Option<f64>| {
        let values = (0..n).map(|i| length.map_or(i as f64, |l| i as f64 * l / n as f64)).collect();
        let unit = if length.is_some() { lateral } else { "1" };
        let variable = Variable::new(name, &[name], VariableData::Numbers(values), unit, "position");
        length.into_iter().fold(variable, |v, l| v.with("length", Attribute::Number(l)))
    };
    let heights = Variable::new("heights", &["y", "x"], VariableData::Numbers(map.heights.clone()), unit, "height");
    let stated = [
        ("sign", declared.sign.map(|s| Attribute::Text(s.words().to_string()))),
        ("periodic", declared.periodic.map(|p| Attribute::Number(f64::from(u8::from(p))))),
        ("channel", declared.channel.clone().map(Attribute::Text)),
        ("preparation", Some(declared.history.join("\n")).filter(|h| !h.is_empty()).map(Attribute::Text)),
    ];
    let heights = stated.into_iter().fold(heights, |v, (key, value)| match value {
        Some(value) => v.with(key, value),
        None => v,
    });
    let [x, y] = [("x", map.nx, extent.map(|e| e.x)), ("y", map.ny, extent.map(|e| e.y))];
    let variables = [coordinate(y.0, y.1, y.2), coordinate(x.0, x.1, x.2), heights];
    netcdf::write(path, &[], &variables)
}

/// Reads a `.npy` file with what its sidecar states. Integers are converted to f64 without scaling; NaN is a missing height.
///
/// # Errors
/// [`Error::Height`] for infinite heights; [`Error::Format`] for files that are no `.npy` or have another shape than the sidecar states;
/// sidecars with extents that are not positive.
pub fn read_npy(path: &Path) -> Result<(HeightMap, Declared)> {
    let field = npy::read(path)?;
    let map = HeightMap::with_missing(&path.display().to_string(), field.nx, field.ny, field.values)?;
    let sidecar = sidecar_path(path);
    if !sidecar.exists() {
        return Ok((map, Declared::default()));
    }
    let said: Sidecar = json::read(&sidecar)?;
    if (said.nx, said.ny) != (map.nx, map.ny) {
        let found = format!("shape [{}, {}]", said.ny, said.nx);
        return Err(Error::format(sidecar, found, format!("the shape of its field, [{}, {}]", map.ny, map.nx)));
    }
    if let Some(length) = said.length.filter(|l| !l.iter().all(|l| l.is_finite() && *l > 0.0)) {
        return Err(Error::format(sidecar, format!("length {length:?}"), "positive extents along x and y"));
    }
    let sign = said.sign.map(|words| {
        let wrong = || Error::format(&sidecar, format!("sign {words:?}"), Touching::WORDS);
        Touching::of_words(&words).ok_or_else(wrong)
    });
    let declared = Declared {
        sign: sign.transpose()?,
        unit: said.unit,
        extent: said.length.map(|[x, y]| DeclaredExtent { x, y, unit: said.length_unit }),
        periodic: said.periodic,
        channel: said.channel,
        channels: Vec::new(),
        history: said.history,
    };
    Ok((map, declared))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map() -> HeightMap {
        HeightMap::new("here", 3, 2, vec![0.1, 1.0 / 3.0, -7e-300, 1e22, 5e-324, 0.0]).unwrap()
    }

    #[test]
    fn npy_round_trip_keeps_bits_and_declarations() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.npy");
        let full = Declared {
            sign: Some(Touching::HighPoints),
            unit: Some("µm".into()),
            extent: Some(DeclaredExtent { x: 0.1 + 0.2, y: 1e-7, unit: Some("nm".into()) }),
            periodic: Some(false),
            channel: Some("heights".into()),
            channels: Vec::new(),
            history: vec!["plane removed".into(), "low pass 2 µm".into()],
        };
        for declared in [full, Declared::default()] {
            write(&path, &map(), &declared).unwrap();
            assert_eq!(read_npy(&path).unwrap(), (map(), declared));
        }
    }

    /// Sidecars of earlier versions have five keys.
    #[test]
    fn sidecars_are_checked() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.npy");
        npy::write(&path, 4, 1, [0.0_f64; 4]).unwrap();
        let with = |text: &str| {
            std::fs::write(sidecar_path(&path), text).unwrap();
            read_npy(&path).map(|(_, declared)| declared).map_err(|e| e.to_string())
        };
        let old = r#"{"nx": 4, "ny": 1, "sign": "low points touch first", "unit": "um", "layout": "[ny, nx]"}"#;
        let (sign, unit) = (Some(Touching::LowPoints), Some("um".to_string()));
        assert_eq!(with(old), Ok(Declared { sign, unit, ..Declared::default() }));
        assert!(with(r#"{"nx": 2, "ny": 2}"#).unwrap_err().contains("map.npy.json: shape [2, 2]"));
        assert!(with(r#"{"nx": 4, "ny": 1, "length": [0, 1]}"#).unwrap_err().contains("length [0.0, 1.0]"));
    }
}
