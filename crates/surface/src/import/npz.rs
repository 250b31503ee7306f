use super::array::{MASK, Order, Plane, check_mask, choose, names};
use super::attributes::{Attributes, Coordinate};
use super::content::{ImportOptions, ImportedFile};
use super::declare::Described;
use super::foreign;
use super::packed;
use super::source::{check_ratio, list};
use crate::files::atomic_file::open_regular;
use crate::files::npy;
use crate::files::number::DType;
use asperity_grid::error::{Error, Result};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use zip::ZipArchive;
use zip::result::ZipError;

/// Largest array that is read besides the heights, in bytes: coordinates of 2^17 points.
const SMALL: u64 = 1 << 20;

type NpzArchive = ZipArchive<BufReader<File>>;

/// Reads one array of a `.npz` archive, stored or deflated, and what arrays without a second dimension state of it. Of an archive
/// without arrays a file is read by `inside`.
pub(super) fn read(path: &Path, options: ImportOptions, inside: packed::Reader) -> Result<ImportedFile> {
    let damaged = |e: ZipError| Error::format(path, format!("a damaged archive ({e})"), "a whole .npz file");
    let mut archive = ZipArchive::new(BufReader::new(open_regular(path)?.0)).map_err(damaged)?;
    let files: Vec<_> = archive.file_names().collect::<std::result::Result<_, _>>().map_err(damaged)?;
    if let Some((found, accepted)) = foreign::archive(files.iter().map(|n| &**n)) {
        return Err(Error::format(path, format!("{found}, which is not read"), accepted));
    }
    if !files.iter().any(|n| n.ends_with(".npy")) {
        let files: Vec<String> = files.iter().map(|n| n.to_string()).collect();
        return packed::archive(path, &mut archive, &files, options, inside);
    }
    let entries: Vec<String> = files.iter().filter_map(|n| n.strip_suffix(".npy").map(str::to_string)).collect();
    let (mut planes, mut stacks, mut others) = (Vec::new(), Vec::new(), Vec::new());
    let (mut has_mask, mut mask_planes) = (false, 1);
    let mut stated = Attributes::default();
    for name in entries {
        let entry = archive.by_name(&format!("{name}.npy")).map_err(damaged)?;
        let length = entry.size();
        // Other arrays cause an error only if they are requested by name.
        match npy::NpyReader::of(entry, length, path).map(|array| [array.ny, array.nx]) {
            Ok(_) if name == MASK => has_mask = true,
            Ok(shape) => planes.push(Plane { name: name.clone(), array: name, index: 0, shape }),
            Err(error) if options.dataset == Some(&name) && !has_planes(&mut archive, &name) => return Err(error),
            Err(_) => {
                let mut entry = archive.by_name(&format!("{name}.npy")).map_err(damaged)?;
                let header = npy::read_header(&mut entry).map(|(header, _)| header);
                let shape = header.as_ref().map(|header| header.shape.clone()).unwrap_or_default();
                let is_read = header.is_ok_and(|header| {
                    let descriptor = header.type_descriptor.to_string();
                    !header.layout.is_fortran() && DType::named(descriptor.trim_matches(['\'', '"'])).is_some()
                });
                let of_array = Plane::of(&name, &shape.iter().map(|n| *n as u64).collect::<Vec<_>>());
                if shape.len() > 2 && is_read && !of_array.is_empty() {
                    if name == MASK {
                        (has_mask, mask_planes) = (true, of_array.len());
                    } else {
                        stacks.extend(of_array);
                    }
                } else if shape.len() > 2 {
                    others.push(format!("{name} of shape {shape:?}"));
                } else if length <= SMALL {
                    drop(entry);
                    let entry = archive.by_name(&format!("{name}.npy")).map_err(damaged)?;
                    take_small(&mut stated, name, entry);
                }
            }
        }
    }
    // A stack beside a map, such as an image in colours, is read by its name only.
    if planes.is_empty() || options.dataset.is_some_and(|d| stacks.iter().any(|plane| plane.name == d)) {
        planes.append(&mut stacks);
    }
    if planes.is_empty() && !others.is_empty() {
        let found = format!("no two-dimensional array, but {}", list(&others));
        return Err(Error::format(
            path,
            found,
            "two dimensions, [ny, nx]: numpy.save('map.npy', array[0]) writes a plane",
        ));
    }
    let plane = choose(path, &planes, options)?;
    let name = &plane.name;
    let field = reader(path, &mut archive, &plane.array, plane.index)?.numbers()?;
    let shape = [field.ny, field.nx];
    let mut values = field.values;
    // That of a stack is no mask of a map beside it.
    if has_mask && (mask_planes == 1 || plane.name != plane.array) {
        let mask = reader(path, &mut archive, MASK, if mask_planes > 1 { plane.index } else { 0 })?;
        check_mask(path, "array mask", [mask.ny, mask.nx], (name, shape))?;
        mask.for_each_row(|y, flags| {
            let row = values[y * field.nx..].iter_mut().zip(flags);
            row.filter(|(_, m)| **m != 0.0).for_each(|(v, _)| *v = f64::NAN);
        })?;
    }
    let axis = |name: &str| {
        let values = stated.numbers.get(name)?.clone();
        Some(Coordinate { name: name.to_string(), attributes: Attributes::default(), values })
    };
    let (axes, order) = ([axis("x"), axis("y")], Order::RowsOfX);
    let channels = &names(&planes)[..];
    let array = Described { path, channel: name, channels, shape, order, own: &stated, shared: &[], axes };
    array.imported(values, format!(".npz array {name} [ny, nx]"))
}

/// Whether an archive is a container of maps, or of one, that SurfaceTopography reads.
pub(super) fn is_of_instrument(path: &Path) -> Result<bool> {
    let damaged = |e: ZipError| Error::format(path, format!("a damaged archive ({e})"), "a whole archive");
    let archive = ZipArchive::new(BufReader::new(open_regular(path)?.0)).map_err(damaged)?;
    let files: Vec<_> = archive.file_names().collect::<std::result::Result<_, _>>().map_err(damaged)?;
    Ok(foreign::archive(files.iter().map(|n| &**n)).is_some_and(|(_, accepted)| foreign::is_convertible(accepted)))
}

/// Whether an array has more than two dimensions.
fn has_planes(archive: &mut NpzArchive, name: &str) -> bool {
    let entry = archive.by_name(&format!("{name}.npy")).ok();
    entry.and_then(|mut entry| npy::read_header(&mut entry).ok()).is_some_and(|(header, _)| header.shape.len() > 2)
}

fn reader<'a>(
    path: &Path,
    archive: &'a mut NpzArchive,
    name: &str,
    plane: usize,
) -> Result<npy::NpyReader<impl Read + use<'a>>> {
    let damaged = |e: ZipError| Error::format(path, format!("a damaged archive ({e})"), "a whole .npz file");
    let entry = archive.by_name(&format!("{name}.npy")).map_err(damaged)?;
    check_ratio(path, name, entry.size(), entry.compressed_size())?;
    let length = entry.size();
    npy::NpyReader::plane(entry, length, path, plane)
}

/// Takes in an array of numbers, flags or words with at most one dimension; others are ignored.
fn take_small(stated: &mut Attributes, name: String, mut entry: impl Read) {
    let Ok((header, _)) = npy::read_header(&mut entry) else { return };
    let mut bytes = Vec::new();
    if header.shape.len() > 1 || entry.take(SMALL).read_to_end(&mut bytes).is_err() {
        return;
    }
    let descriptor = header.type_descriptor.to_string();
    let descriptor = descriptor.trim_matches(['\'', '"']);
    if let Some(dtype) = DType::named(descriptor) {
        let numbers: Vec<f64> = bytes.chunks_exact(dtype.bytes).map(|b| dtype.value(b)).collect();
        stated.numbers.insert(name, numbers);
    } else if let Some(words) = words(descriptor, &bytes) {
        stated.words.insert(name, words);
    }
}

/// A single NumPy string: `<U4` has four bytes a character, `|S4` one.
fn words(descriptor: &str, bytes: &[u8]) -> Option<String> {
    let big = descriptor.starts_with('>');
    let kind = descriptor.trim_start_matches(['<', '>', '|']);
    let count: usize = kind.get(1..)?.parse().ok()?;
    let text: String = match &kind[..1] {
        "U" if bytes.len() == 4 * count => {
            let words =
                bytes.as_chunks().0.iter().map(|b| if big { u32::from_be_bytes(*b) } else { u32::from_le_bytes(*b) });
            words.map(char::from_u32).collect::<Option<_>>()?
        }
        "S" if bytes.len() == count => String::from_utf8(bytes.to_vec()).ok()?,
        _ => return None,
    };
    Some(text.trim_end_matches('\0').to_string())
}
