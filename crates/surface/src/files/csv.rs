//! Curves as comma-separated columns, for spreadsheets and `numpy.genfromtxt(..., names=True)`.

use std::io::{self, Write};
use std::path::Path;

use super::atomic_file::{miscount, write_atomic};
use asperity_grid::error::Result;

/// Writes columns of equal length. The unit is part of the header (`displacement_angstrom`); numbers have enough
/// digits to be read back exactly.
///
/// # Errors
/// Columns of different lengths; a header with a comma, a quote or a line break; I/O errors.
pub fn write(path: &Path, columns: &[(&str, &[f64])]) -> Result<()> {
    write_atomic(path, |w| {
        let rows = columns.first().map_or(0, |c| c.1.len());
        for (header, values) in columns {
            if values.len() != rows {
                return Err(miscount(&format!("values of {header}"), values.len(), rows));
            }
            if header.is_empty() || header.contains([',', '"', '\n', '\r']) {
                return Err(io::Error::new(io::ErrorKind::InvalidInput, format!("{header:?} is no column name")));
            }
        }
        let headers: Vec<&str> = columns.iter().map(|c| c.0).collect();
        writeln!(w, "{}", headers.join(","))?;
        for row in 0..rows {
            for (i, (_, values)) in columns.iter().enumerate() {
                write!(w, "{}{:?}", if i == 0 { "" } else { "," }, values[row])?;
            }
            writeln!(w)?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_keep_their_bits_and_their_lengths() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("table.csv");
        write(&path, &[("displacement_angstrom", &[0.1, 0.2]), ("p_star", &[1e-300, 2.0])]).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text, "displacement_angstrom,p_star\n0.1,1e-300\n0.2,2.0\n");
        assert!(write(&path, &[("a", &[1.0]), ("b", &[])]).unwrap_err().to_string().contains("0 values of b"));
        assert!(write(&path, &[("a,b", &[1.0])]).is_err());
    }
}
