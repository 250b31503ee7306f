use super::array::choose;
use super::content::{ImportOptions, ImportedFile};
use crate::error::{Error, Result};
use crate::record::heights::{Declared, HeightMap};
use crate::record::npy;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use zip::ZipArchive;

/// Reads one array of a `.npz` archive, stored or deflated.
pub(super) fn read(path: &Path, options: ImportOptions) -> Result<ImportedFile> {
    let file = File::open(path).map_err(Error::io("open", path))?;
    let damaged =
        |e: zip::result::ZipError| Error::format(path, format!("a damaged archive ({e})"), "a whole .npz file");
    let mut archive = ZipArchive::new(BufReader::new(file)).map_err(damaged)?;
    let files: Vec<_> = archive.file_names().collect::<std::result::Result<_, _>>().map_err(damaged)?;
    let entries: Vec<String> = files.iter().filter_map(|n| n.strip_suffix(".npy").map(str::to_string)).collect();
    let mut names = Vec::new();
    for name in entries {
        let entry = archive.by_name(&format!("{name}.npy")).map_err(damaged)?;
        let length = entry.size();
        // Other arrays cause an error only if they are requested by name.
        if options.dataset == Some(&name) || npy::Reader::of(entry, length, path).is_ok() {
            names.push(name);
        }
    }
    let name = choose(path, &names, options)?;
    let entry = archive.by_name(&format!("{name}.npy")).map_err(damaged)?;
    let length = entry.size();
    let field = npy::Reader::of(entry, length, path)?.numbers()?;
    let map = HeightMap::new(&path.display().to_string(), field.nx, field.ny, field.values)?;
    Ok(ImportedFile::map(map, Declared::default(), format!(".npz array {name} [ny, nx]")))
}
