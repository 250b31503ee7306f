//! Bytes of an instrument's file, read in order. Every length is compared with the bytes that are there before anything is
//! allocated.

use crate::files::npy::fits;
use crate::files::number::{DType, NumberKind};
use asperity_grid::error::{Error, Result};
use std::path::Path;

pub(super) const U8: DType = little(NumberKind::Unsigned, 1);
pub(super) const U16: DType = little(NumberKind::Unsigned, 2);
pub(super) const U32: DType = little(NumberKind::Unsigned, 4);
pub(super) const I8: DType = little(NumberKind::Signed, 1);
pub(super) const I16: DType = little(NumberKind::Signed, 2);
pub(super) const I32: DType = little(NumberKind::Signed, 4);
pub(super) const F32: DType = little(NumberKind::Float, 4);
pub(super) const F64: DType = little(NumberKind::Float, 8);

const fn little(kind: NumberKind, bytes: usize) -> DType {
    DType { kind, bytes, big: false }
}

/// The whole file.
pub(super) fn whole(path: &Path) -> Result<Vec<u8>> {
    let length = std::fs::metadata(path).map_err(Error::io("open", path))?.len();
    fits(path, length)?;
    std::fs::read(path).map_err(Error::io("read", path))
}

/// A position in bytes of a file.
#[derive(Clone, Copy)]
pub(super) struct Bytes<'a> {
    path: &'a Path,
    rest: &'a [u8],
}

impl<'a> Bytes<'a> {
    pub(super) fn of(path: &'a Path, rest: &'a [u8]) -> Self {
        Bytes { path, rest }
    }

    pub(super) fn left(&self) -> &'a [u8] {
        self.rest
    }

    /// The next `count` bytes; errors have their `description`.
    pub(super) fn take(&mut self, count: usize, description: &str) -> Result<&'a [u8]> {
        let Some((taken, remainder)) = self.rest.split_at_checked(count) else {
            let found = format!("{} bytes where {description} should be", self.rest.len());
            return Err(Error::format(self.path, found, format!("{count} bytes (the file is cut off or damaged)")));
        };
        self.rest = remainder;
        Ok(taken)
    }

    pub(super) fn number(&mut self, dtype: DType, description: &str) -> Result<f64> {
        Ok(dtype.value(self.take(dtype.bytes, description)?))
    }

    /// An unsigned number of 32 bits.
    pub(super) fn count(&mut self, description: &str) -> Result<usize> {
        Ok(self.number(U32, description)? as usize)
    }

    /// A text up to its terminating zero byte. Other encodings than UTF-8 give replacement characters.
    pub(super) fn text(&mut self, description: &str) -> Result<String> {
        let end = self.rest.iter().position(|b| *b == 0).unwrap_or(self.rest.len());
        let text = self.take(end + 1, description)?;
        Ok(String::from_utf8_lossy(&text[..end]).into_owned())
    }

    /// `ny` rows of `nx` stored numbers.
    pub(super) fn field(&mut self, [nx, ny]: [usize; 2], dtype: DType) -> Result<Vec<f64>> {
        let description = format!("{nx} x {ny} points of {} bytes", dtype.bytes);
        let count = nx.checked_mul(ny).filter(|n| *n > 0).and_then(|n| n.checked_mul(dtype.bytes));
        let Some(count) = count else {
            return Err(Error::format(self.path, description, "at least one point along each"));
        };
        let bytes = self.take(count, &description)?;
        fits(self.path, (nx * ny) as u64 * 8)?;
        Ok(bytes.chunks_exact(dtype.bytes).map(|b| dtype.value(b)).collect())
    }
}

/// `value` if it is a finite number greater than 0.
pub(super) fn positive(path: &Path, key: &str, value: f64) -> Result<f64> {
    let accepted = "a finite number greater than 0 (in Gwyddion set the dimensions and save as .gwy)";
    let good = value.is_finite() && value > 0.0;
    good.then_some(value).ok_or_else(|| Error::format(path, format!("{key} = {value}"), accepted))
}

/// `value` if it is a finite number other than 0.
pub(super) fn factor(path: &Path, key: &str, value: f64) -> Result<f64> {
    let good = value.is_finite() && value != 0.0;
    good.then_some(value).ok_or_else(|| Error::format(path, format!("{key} = {value}"), "a finite number other than 0"))
}
