//! `.npy` fields `[ny, nx]`: row = y, column = x, x fastest.
//!
//! Files are written little-endian in C order from an iterator; both index orders and both byte orders can be read.
//! C-ordered fields are read row by row: the largest fields have 2 GiB, and a picture needs only one row at a time.

use std::fs::File;
use std::io::{BufReader, Read, Write};
use std::ops::Range;
use std::path::Path;

use ndarray_npy::npy::header::{Header, Layout};

use super::atomic_file::{miscount, open_regular, write_atomic, write_atomic_on_ranks};
use super::number::{DType, NumberKind};
use asperity_grid as grid;
use asperity_grid::error::{Error, Result};
use asperity_grid::sys::expect_memory;
use asperity_grid::sys::ranks::{ALONE, Ranks};

/// A map in memory: row-major `[ny, nx]`.
#[derive(Debug, Clone, PartialEq)]
pub struct NpyMap<T> {
    pub nx: usize,
    pub ny: usize,
    pub values: Vec<T>,
}

/// Number types of a field file.
pub trait Element: bytemuck::NoUninit {
    /// NumPy type descriptor: `<f8`, `<f4`, `|u1`.
    const DESCRIPTOR: &'static str;
    /// The value in the byte order of the file.
    fn stored(self) -> Self;
}

impl Element for f64 {
    const DESCRIPTOR: &'static str = "<f8";
    fn stored(self) -> f64 {
        f64::from_bits(self.to_bits().to_le())
    }
}

impl Element for f32 {
    const DESCRIPTOR: &'static str = "<f4";
    fn stored(self) -> f32 {
        f32::from_bits(self.to_bits().to_le())
    }
}

impl Element for u8 {
    const DESCRIPTOR: &'static str = "|u1";
    fn stored(self) -> u8 {
        self
    }
}

/// Number of values written at once; writing single values took 2 % of the time of a solve on 2048².
const BLOCK: usize = 4096;

/// Writes `[ny, nx]` values, row by row from y = 0. Returns an error unless the iterator has exactly `nx·ny` values.
pub fn write<T: Element>(path: &Path, nx: usize, ny: usize, values: impl IntoIterator<Item = T>) -> Result<()> {
    write_on_ranks(&ALONE, path, [nx, ny], values)
}

/// As [`write()`], of the values of the rows of this rank. Collective.
pub fn write_on_ranks<T: Element>(
    ranks: &Ranks,
    path: &Path,
    [nx, ny]: [usize; 2],
    values: impl IntoIterator<Item = T>,
) -> Result<()> {
    let head = header(T::DESCRIPTOR, [nx, ny]).map_err(Error::io("write", path))?;
    let rows = ranks.share(ny);
    let own = rows.len() * nx;
    if !ranks.are_several() {
        return write_atomic(path, |w| w.write_all(&head).and_then(|()| write_values(w, own, values)));
    }
    let place = |row: usize| (head.len() + row * nx * size_of::<T>()) as u64;
    write_atomic_on_ranks(ranks, path, (&head, place(ny)), place(rows.start), |w| write_values(w, own, values))
}

fn header(descriptor: &str, [nx, ny]: [usize; 2]) -> std::io::Result<Vec<u8>> {
    let type_descriptor = format!("'{descriptor}'").parse().map_err(std::io::Error::other)?;
    let mut head = Vec::new();
    let header = Header { type_descriptor, layout: Layout::Standard, shape: vec![ny, nx] };
    header.write(&mut head).map_err(std::io::Error::other)?;
    Ok(head)
}

/// Writes `wanted` values.
fn write_values<T: Element>(
    to: &mut impl Write,
    wanted: usize,
    values: impl IntoIterator<Item = T>,
) -> std::io::Result<()> {
    let mut values = values.into_iter().map(T::stored);
    let mut block = Vec::with_capacity(BLOCK);
    let mut count = 0;
    loop {
        block.clear();
        block.extend(values.by_ref().take(BLOCK));
        count += block.len();
        if count > wanted {
            return Err(miscount("values", "more", wanted));
        }
        to.write_all(bytemuck::cast_slice(&block))?;
        if block.len() < BLOCK {
            break;
        }
    }
    if count < wanted { Err(miscount("values", count, wanted)) } else { Ok(()) }
}

/// Writes a field times `unit` in its own precision. Positive values stay positive, because a zero gap means contact.
pub fn write_field(path: &Path, nx: usize, ny: usize, field: grid::Field, unit: f64) -> Result<()> {
    write_field_on_ranks(&ALONE, path, [nx, ny], field, unit)
}

/// As [`write_field`], of the rows of this rank. Collective.
pub fn write_field_on_ranks(
    ranks: &Ranks,
    path: &Path,
    shape: [usize; 2],
    field: grid::Field,
    unit: f64,
) -> Result<()> {
    match field {
        grid::Field::F32(values) => write_on_ranks(ranks, path, shape, values.iter().map(|v| narrow(*v, unit))),
        grid::Field::F64(values) => write_on_ranks(ranks, path, shape, values.iter().map(|v| v * unit)),
    }
}

/// A value times `unit`; positive values stay positive.
fn narrow(v: f32, unit: f64) -> f32 {
    let scaled = f64::from(v) * unit;
    let rounded = scaled as f32;
    if rounded == 0.0 && scaled > 0.0 { f32::MIN_POSITIVE } else { rounded }
}

/// Writes the contact pressure: the stress where the gap is closed, exactly zero elsewhere. Solvers leave there what their tolerance
/// permits, of either sign. Of fields `[nx, ny]` of which every rank has its rows. Collective.
pub fn write_contact_pressure(
    ranks: &Ranks,
    path: &Path,
    shape: [usize; 2],
    gap: grid::Field,
    stress: grid::Field,
    unit: f64,
) -> Result<()> {
    let closed = |i: usize| gap.at(i) <= 0.0;
    match stress {
        grid::Field::F32(values) => {
            let values = (0..values.len()).map(|i| if closed(i) { narrow(values[i], unit) } else { 0.0 });
            write_on_ranks(ranks, path, shape, values)
        }
        grid::Field::F64(values) => {
            let values = (0..values.len()).map(|i| if closed(i) { values[i] * unit } else { 0.0 });
            write_on_ranks(ranks, path, shape, values)
        }
    }
}

/// An open `.npy` file or archive member with checked header and length.
pub struct NpyReader<R = BufReader<File>> {
    pub nx: usize,
    pub ny: usize,
    stored: DType,
    fortran: bool,
    source: R,
    path: std::path::PathBuf,
}

/// Larger shapes are treated as a damaged header (64 times the largest grid of the challenge).
const MOST_ENTRIES: usize = 1 << 34;

/// Longest header that is read, bytes. NumPy writes 118 for a field; a header of version 2 or 3 may claim 4 GB.
const LONGEST_HEADER: u32 = 1 << 16;

/// The header at the start of a source, and its length in bytes. Its memory is allocated before it is read, so its length is
/// checked.
///
/// # Errors
/// A description of what is damaged.
pub(crate) fn read_header(source: &mut impl Read) -> std::result::Result<(Header, u64), String> {
    let mut start = [0; 12];
    source.read_exact(&mut start).map_err(|e| e.to_string())?;
    let [.., version, _, a, b, c, d] = start;
    let (prefix, length) = match version {
        1 => (10, u16::from_le_bytes([a, b]).into()),
        _ => (12, u32::from_le_bytes([a, b, c, d])),
    };
    if length > LONGEST_HEADER {
        return Err(format!("its length is {length} bytes, above {LONGEST_HEADER}"));
    }
    let header = Header::from_reader(&mut (&start[..]).chain(source)).map_err(|e| e.to_string())?;
    Ok((header, prefix + u64::from(length)))
}

impl NpyReader {
    /// Opens a field of floating-point numbers (f2, f4, f8), integers (i1 to i8, u1 to u8) or flags (b1), in either
    /// byte order and index order.
    pub fn open(path: &Path) -> Result<Self> {
        let (file, length) = open_regular(path)?;
        Self::of(BufReader::with_capacity(1 << 18, file), length, path)
    }

    /// Reads some rows of a field in C order.
    pub fn rows(mut self, rows: Range<usize>) -> Result<Vec<f64>> {
        if self.fortran {
            return Err(Error::format(&self.path, "columns one after another", "rows one after another, C order"));
        }
        fits(&self.path, 8 * (rows.len() * self.nx) as u64)?;
        let previous = (rows.start * self.nx * self.stored.bytes) as i64;
        self.source.seek_relative(previous).map_err(Error::io("read", &self.path))?;
        let mut values = Vec::with_capacity(rows.len() * self.nx);
        NpyReader { ny: rows.len(), ..self }.for_each_row(|_, row| values.extend_from_slice(row))?;
        Ok(values)
    }
}

/// The parser of headers explains syntax errors in several lines; the last one names what was expected.
fn damaged(path: &Path, text: &str) -> Error {
    let what = text.lines().last().unwrap_or_default().trim_start_matches([' ', '=']);
    Error::format(path, format!("a damaged header ({what})"), "a .npy file")
}

impl<R: Read> NpyReader<R> {
    /// Reads `length` bytes of a source; errors name `path`.
    pub(crate) fn of(source: R, length: u64, path: &Path) -> Result<Self> {
        Self::part(source, length, path, None)
    }

    /// As [`NpyReader::of`], of the plane `k` along the first of three dimensions, in C order.
    pub(crate) fn plane(source: R, length: u64, path: &Path, k: usize) -> Result<Self> {
        Self::part(source, length, path, Some(k))
    }

    fn part(mut source: R, length: u64, path: &Path, plane: Option<usize>) -> Result<Self> {
        let (header, start) = read_header(&mut source).map_err(|e| damaged(path, &e))?;
        let descriptor = header.type_descriptor.to_string();
        let name = descriptor.trim_matches(['\'', '"']);
        let dtype = DType::named(name).ok_or_else(|| {
            let accepted = "real numbers: floating-point or integer, 64 bits at most; convert with .astype(float)";
            Error::format(path, format!("entries of type {name}"), accepted)
        })?;
        // Dimensions of length 1 hold nothing.
        let shape: Vec<usize> = header.shape.iter().copied().filter(|n| header.shape.len() == 2 || *n != 1).collect();
        let fortran = header.layout.is_fortran();
        let fits = |n: usize, ny: usize, nx: usize| {
            n.checked_mul(ny).and_then(|n| n.checked_mul(nx)).is_some_and(|n| (1..=MOST_ENTRIES).contains(&n))
        };
        let (planes, ny, nx) = match (&shape[..], plane) {
            (&[ny, nx], _) if fits(1, ny, nx) => (1, ny, nx),
            (&[n, ny, nx], Some(k)) if fits(n, ny, nx) && k < n && !fortran => (n, ny, nx),
            _ => {
                let accepted = "two dimensions, [ny, nx]: numpy.save('map.npy', array[0]) writes a plane of three";
                return Err(Error::format(path, format!("shape {:?}", header.shape), accepted));
            }
        };
        // Checked before allocation: a damaged header must not request more memory than the file has data.
        let bytes = (nx * ny * dtype.bytes) as u64;
        let (available, want) = (length.saturating_sub(start), planes as u64 * bytes);
        if available != want {
            let found =
                format!("{available} bytes of data, {} of them", if available < want { "too few" } else { "too many" });
            return Err(Error::format(path, found, format!("{want} bytes for shape [{ny}, {nx}]")));
        }
        let before = plane.unwrap_or(0) as u64 * bytes;
        std::io::copy(&mut source.by_ref().take(before), &mut std::io::sink()).map_err(Error::io("read", path))?;
        Ok(NpyReader { nx, ny, stored: dtype, fortran, source, path: path.to_path_buf() })
    }

    /// Calls `row(y, values)` for y = 0, 1, …; a Fortran-ordered field is first read as a whole.
    pub fn for_each_row(mut self, mut row: impl FnMut(usize, &[f64])) -> Result<()> {
        if self.fortran {
            let field = self.whole_transposed()?;
            field.chunks_exact(self.nx).enumerate().for_each(|(y, values)| row(y, values));
            return Ok(());
        }
        let mut bytes = vec![0; self.nx * self.stored.bytes];
        let mut values = vec![0.0; self.nx];
        for y in 0..self.ny {
            self.source.read_exact(&mut bytes).map_err(Error::io("read", &self.path))?;
            self.stored.values(&bytes, &mut values);
            row(y, &values);
        }
        Ok(())
    }

    /// Reads the whole field as [`read`] does.
    pub(crate) fn numbers(mut self) -> Result<NpyMap<f64>> {
        if self.stored.kind == NumberKind::Flag {
            return Err(Error::format(&self.path, "entries of type bool", "numbers, floating-point or integer"));
        }
        let (nx, ny) = (self.nx, self.ny);
        fits(&self.path, 8 * (nx * ny) as u64)?;
        if self.fortran {
            // The transposed field is returned without a second copy.
            return Ok(NpyMap { nx, ny, values: self.whole_transposed()? });
        }
        let mut values = Vec::with_capacity(nx * ny);
        self.for_each_row(|_, row| values.extend_from_slice(row))?;
        Ok(NpyMap { nx, ny, values })
    }

    fn whole_transposed(&mut self) -> Result<Vec<f64>> {
        let mut field = vec![0.0; self.nx * self.ny];
        let mut bytes = vec![0; self.ny * self.stored.bytes];
        for x in 0..self.nx {
            self.source.read_exact(&mut bytes).map_err(Error::io("read", &self.path))?;
            for (y, b) in bytes.chunks_exact(self.stored.bytes).enumerate() {
                field[y * self.nx + x] = self.stored.value(b);
            }
        }
        Ok(field)
    }
}

/// Reads a numeric field as f64; integers above 2^53 are rounded. Boolean fields are an error.
pub fn read(path: &Path) -> Result<NpyMap<f64>> {
    NpyReader::open(path)?.numbers()
}

/// The shape of an array in three dimensions and C order, without those of length 1, of which each plane can be read. Otherwise empty.
///
/// # Errors
/// `Io`, and `Format` for a damaged header.
pub(crate) fn stacked_shape(path: &Path) -> Result<Vec<u64>> {
    let (file, _) = open_regular(path)?;
    let (header, _) = read_header(&mut BufReader::new(file)).map_err(|e| damaged(path, &e))?;
    let shape: Vec<u64> = header.shape.iter().filter(|n| **n != 1).map(|n| *n as u64).collect();
    Ok(if shape.len() == 3 && !header.layout.is_fortran() { shape } else { Vec::new() })
}

/// Plane `k` along the first of three dimensions.
///
/// # Errors
/// As [`read`] has.
pub(crate) fn read_plane(path: &Path, k: usize) -> Result<NpyMap<f64>> {
    let (file, length) = open_regular(path)?;
    NpyReader::plane(BufReader::with_capacity(1 << 18, file), length, path, k)?.numbers()
}

/// Opens a map of this shape.
fn open_on(path: &Path, [nx, ny]: [usize; 2]) -> Result<NpyReader> {
    let reader = NpyReader::open(path)?;
    if (reader.nx, reader.ny) != (nx, ny) {
        let found = format!("{} x {} values", reader.nx, reader.ny);
        return Err(Error::format(path, found, format!("{nx} x {ny}, as its grid has")));
    }
    Ok(reader)
}

/// The values of a map of flags with this shape.
///
/// # Errors
/// `Format` for another shape, and for entries that are no flags.
pub fn read_flags_on(path: &Path, shape: [usize; 2]) -> Result<Vec<u8>> {
    open_on(path, shape).and_then(|_| read_flags(path)).map(|map| map.values)
}

/// As [`read`], of a map with this shape and finite values.
///
/// # Errors
/// `Format` for another shape, and for a value that is not finite, with its place.
pub fn read_on(path: &Path, [nx, ny]: [usize; 2]) -> Result<NpyMap<f64>> {
    let map = open_on(path, [nx, ny])?.numbers()?;
    match map.values.iter().position(|v| !v.is_finite()) {
        None => Ok(map),
        Some(i) => {
            let (row, column) = (i / nx + 1, i % nx + 1);
            let found = format!("{} in row {row}, column {column} (counted from 1)", map.values[i]);
            Err(Error::format(path, found, "finite numbers"))
        }
    }
}

/// Returns an error if reading needs more than the available memory.
pub(crate) fn fits(path: &Path, required: u64) -> Result<()> {
    expect_memory(format!("reading {}", path.display()), required, "a coarser map needs less")
}

/// Reads a map of flags (uint8 or bool).
pub fn read_flags(path: &Path) -> Result<NpyMap<u8>> {
    let reader = NpyReader::open(path)?;
    if !matches!(reader.stored, DType { kind: NumberKind::Flag | NumberKind::Unsigned, bytes: 1, .. }) {
        return Err(Error::format(path, "entries that are no flags", "uint8 or bool"));
    }
    let (nx, ny) = (reader.nx, reader.ny);
    let mut values = Vec::with_capacity(nx * ny);
    reader.for_each_row(|_, row| values.extend(row.iter().map(|&v| v as u8)))?;
    Ok(NpyMap { nx, ny, values })
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_grid::sys::ranks::on_threads;
    use ndarray::{Array2, ShapeBuilder};

    fn scratch() -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("field.npy");
        (folder, path)
    }

    /// Files written by ndarray-npy, an independent implementation.
    #[test]
    fn both_orders_and_both_widths_read_alike() {
        let (_folder, path) = scratch();
        let c = Array2::from_shape_fn((2, 3), |(y, x)| (10 * y + x) as f64);
        let expected = vec![0.0, 1.0, 2.0, 10.0, 11.0, 12.0];
        ndarray_npy::write_npy(&path, &c).unwrap();
        assert_eq!(read(&path).unwrap(), NpyMap { nx: 3, ny: 2, values: expected.clone() });
        let mut fortran = Array2::<f32>::zeros((2, 3).f());
        fortran.zip_mut_with(&c, |a, &b| *a = b as f32);
        ndarray_npy::write_npy(&path, &fortran).unwrap();
        assert_eq!(read(&path).unwrap().values, expected);
        write(&path, 3, 2, c.iter().copied()).unwrap();
        assert_eq!(ndarray_npy::read_npy::<_, Array2<f64>>(&path).unwrap(), c);
        write(&path, 3, 2, c.iter().map(|&v| v as u8)).unwrap();
        assert_eq!(read_flags(&path).unwrap().values, [0, 1, 2, 10, 11, 12]);
    }

    /// Fields in f32 are stored in f32, and a positive gap does not become zero by rounding.
    #[test]
    fn fields_keep_their_precision() {
        let (_folder, path) = scratch();
        write_field(&path, 3, 1, grid::Field::F32(&[0.0, 1e-30, 2.5]), 1e-12).unwrap();
        assert!(std::fs::read(&path).unwrap().windows(3).any(|w| w == b"<f4"));
        let read_back = read(&path).unwrap().values;
        assert!(read_back[0] == 0.0 && read_back[1] > 0.0 && (read_back[2] / 2.5e-12 - 1.0).abs() < 1e-7);
        write_field(&path, 2, 1, grid::Field::F64(&[0.1, 3.0]), 2.0).unwrap();
        assert_eq!(read(&path).unwrap().values, [0.2, 6.0]);
    }

    #[test]
    fn big_endian_is_read() {
        let (_folder, path) = scratch();
        write(&path, 2, 1, [1.5_f64, -2.0]).unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        let index = bytes.windows(3).position(|w| w == b"<f8").unwrap();
        bytes[index] = b'>';
        let data = bytes.len() - 16;
        bytes[data..].chunks_exact_mut(8).for_each(|b| b.reverse());
        std::fs::write(&path, bytes).unwrap();
        assert_eq!(read(&path).unwrap().values, [1.5, -2.0]);
    }

    #[test]
    fn integers_are_heights() {
        let (_folder, path) = scratch();
        fn whole<T: ndarray_npy::WritableElement>(path: &Path, values: [T; 2]) -> Vec<f64> {
            ndarray_npy::write_npy(path, &Array2::from_shape_vec((1, 2), values.into()).unwrap()).unwrap();
            read(path).unwrap().values
        }
        assert_eq!(whole(&path, [i8::MIN, i8::MAX]), [-128.0, 127.0]);
        assert_eq!(whole(&path, [i16::MIN, 7]), [-32768.0, 7.0]);
        assert_eq!(whole(&path, [i32::MIN, -1]), [-2147483648.0, -1.0]);
        assert_eq!(whole(&path, [i64::MIN, -3]), [-(2f64.powi(63)), -3.0]);
        assert_eq!(whole(&path, [u8::MAX, 0]), [255.0, 0.0]);
        assert_eq!(whole(&path, [u16::MAX, 1]), [65535.0, 1.0]);
        assert_eq!(whole(&path, [u32::MAX, 1]), [4294967295.0, 1.0]);
        assert_eq!(whole(&path, [u64::MAX, 1]), [2f64.powi(64), 1.0]);
        // Big-endian file made by editing the descriptor, whose length is unchanged.
        ndarray_npy::write_npy(&path, &Array2::from_shape_vec((1, 2), vec![0x0100_i16, 0x00FF]).unwrap()).unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        let at = bytes.windows(3).position(|w| w == b"<i2").unwrap();
        bytes[at] = b'>';
        std::fs::write(&path, bytes).unwrap();
        assert_eq!(read(&path).unwrap().values, [1.0, -256.0]);
    }

    /// Half-precision values with known bits: one, the largest, the smallest positive, and one third.
    #[test]
    fn half_precision_is_read() {
        let words = [0x3C00, 0x7BFF, 0x0001, 0x3555, 0xC000];
        let half = |word: u16| DType::named("<f2").unwrap().value(&word.to_le_bytes());
        assert_eq!(words.map(half), [1.0, 65504.0, 2f64.powi(-24), 0.333251953125, -2.0]);
        assert!(half(0x7C00) == f64::INFINITY && half(0x7E00).is_nan());
    }

    #[test]
    fn damaged_or_foreign_files_are_named() {
        let (_folder, path) = scratch();
        let says = |expected: &str| {
            let message = read(&path).unwrap_err().to_string();
            assert!(message.contains("field.npy") && message.contains(expected), "{message}");
        };
        ndarray_npy::write_npy(&path, &Array2::<bool>::default((2, 2))).unwrap();
        says("entries of type bool");
        let mut complex = std::fs::read(&path).unwrap();
        let index = complex.windows(3).position(|w| w == b"|b1").unwrap();
        complex[index..index + 3].copy_from_slice(b"<c8");
        std::fs::write(&path, complex).unwrap();
        says("entries of type <c8");
        ndarray_npy::write_npy(&path, &ndarray::Array1::<f64>::zeros(4)).unwrap();
        says("shape [4]");
        ndarray_npy::write_npy(&path, &Array2::<f64>::zeros((0, 2))).unwrap();
        says("shape [0, 2]");
        write(&path, 2, 2, [0.0_f64; 4]).unwrap();
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, &whole[..whole.len() - 1]).unwrap();
        says("31 bytes of data, too few");
        std::fs::write(&path, b"oak").unwrap();
        says("accepted: a .npy file");
        write(&path, 2, 2, [0_u8; 4]).unwrap();
        assert!(read_flags(&path).is_ok());
        write(&path, 2, 2, [0.0_f32; 4]).unwrap();
        assert!(read_flags(&path).unwrap_err().to_string().contains("no flags"));
    }

    #[test]
    fn a_miscounted_field_is_not_written() {
        let (_folder, path) = scratch();
        let more = BLOCK + 4;
        for (nx, count) in
            [(2, 3), (2, 5), (BLOCK / 2, BLOCK - 1), (BLOCK / 2, BLOCK + 1), (more / 2, BLOCK), (more / 2, 2 * BLOCK)]
        {
            assert!(write(&path, nx, 2, std::iter::repeat_n(0.0_f32, count)).is_err(), "{count} for {nx} x 2");
        }
        assert!(!path.exists());
    }

    /// Fields shorter than a block, of whole blocks, and with a remainder.
    #[test]
    fn blocks_are_no_seams() {
        let (_folder, path) = scratch();
        for n in [1, BLOCK - 1, BLOCK, BLOCK + 1, 3 * BLOCK] {
            write(&path, n, 1, (0..n).map(|i| i as f64)).unwrap();
            assert!(read(&path).unwrap().values.iter().enumerate().all(|(i, v)| *v == i as f64), "{n}");
        }
    }

    /// The file of one rank on any number; one that fails on a rank is an error of all, and leaves nothing.
    #[test]
    fn ranks_write_their_rows_into_one_file() {
        let folder = tempfile::tempdir().unwrap();
        let values: Vec<f32> = (0..5 * 11).map(|i| i as f32 * 0.37 - 4.0).collect();
        let alone = folder.path().join("alone.npy");
        write(&alone, 5, 11, values.clone()).unwrap();
        for count in [2, 3, 11] {
            let path = folder.path().join(format!("{count}.npy"));
            let read = on_threads(count, |ranks| {
                let rows = ranks.share(11);
                let own = &values[rows.start * 5..rows.end * 5];
                write_on_ranks(&ranks, &path, [5, 11], own.iter().copied()).unwrap();
                let wide: Vec<f64> = own.iter().map(|v| f64::from(*v)).collect();
                (NpyReader::open(&path).unwrap().rows(rows).unwrap(), wide)
            });
            assert!(read.into_iter().all(|(actual, own)| actual == own), "{count} ranks");
            assert!(std::fs::read(&path).unwrap() == std::fs::read(&alone).unwrap(), "{count} ranks");
        }
        let failed = on_threads(3, |ranks| {
            let rows = if ranks.own() == 1 { 0..1 } else { ranks.share(11) };
            write_on_ranks(&ranks, &folder.path().join("short.npy"), [5, 11], values[..rows.len() * 5].iter().copied())
        });
        assert!(failed.into_iter().all(|written| written.is_err()));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 4);
    }
}
