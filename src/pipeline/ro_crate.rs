//! `ro-crate-metadata.json`: a run folder as an RO-Crate 1.1 (doi:10.3233/DS-210053), with the files that its scene names.

use super::folder::RunFolder;
use super::repetition::FinishedRun;
use super::run::{CRATE_FILE, INPUTS, SCENE_FILE};
use super::run_files::with_sidecar;
use crate::Result;
use crate::record::results;
use crate::scene::Scene;
use asperity_grid::Error;
use asperity_surface::files::atomic_file::{create_folder, list, read_bytes, write_atomic};
use asperity_surface::files::hashed::{FileHash, file_hash};
use asperity_surface::files::json;
use asperity_surface::heights::sidecar_path;
use serde_json::{Value, json};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// Media types by the end of a name.
const MEDIA_TYPES: [(&str, &str); 9] = [
    (".json", "application/json"),
    (".toml", "application/toml"),
    (".html", "text/html"),
    (".csv", "text/csv"),
    (".txt", "text/plain"),
    (".nc", "application/netcdf"),
    (".xdmf", "application/xml"),
    (".svg", "image/svg+xml"),
    (".png", "image/png"),
];

/// The copy of an input, by the key of the scene that names it.
fn copy_of(key: &str, file: &Path) -> String {
    let ending = file.extension().map_or(String::new(), |e| format!(".{}", e.to_string_lossy()));
    format!("{key}{ending}")
}

/// The scene of a finished run. Its files are those that the run read: where the scene names them, or else their copies in the folder.
///
/// # Errors
/// `Format`, which names a file that is neither; those of reading the scene.
pub fn scene_of(run: &FinishedRun, out: &Path) -> Result<Scene> {
    let mut scene = Scene::read(&run.scene)?;
    for (key, file) in scene.inputs_mut() {
        let copy = out.join(INPUTS).join(copy_of(key, file));
        let copy = std::path::absolute(&copy).map_err(Error::io("find", &copy))?;
        // Of the file and its sidecar, both or neither of which the run read.
        let read = run.inputs.keys().filter(|read| read.split(' ').next() == Some(key)).count();
        let is_same = |file: &Path| {
            let own = with_sidecar(key, file);
            let same = |(key, file): &(String, PathBuf)| file_hash(file).ok().as_ref() == run.inputs.get(key);
            file.is_file() && own.len() == read && own.iter().all(same)
        };
        *file = match (is_same(file), is_same(&copy)) {
            (true, _) => file.clone(),
            (false, true) => copy,
            (false, false) => {
                let what = if file.exists() { "another file than the run read" } else { "no such file" };
                let accepted = "the file as the run read it, there or as a copy of `asperity crate` in the folder";
                return Err(Error::format(&run.scene, format!("{key} = {} ({what})", file.display()), accepted));
            }
        };
    }
    Ok(scene)
}

/// Copies the inputs of a finished run into its folder, and writes the metadata. `license`: an SPDX identifier or an address. Returns the
/// path of the file.
///
/// # Errors
/// `Format` for a folder without results, or with a file that is not as the run wrote or read it; `Io`.
pub fn write(out: &Path, license: &str) -> Result<PathBuf> {
    let run = FinishedRun::open(out)?;
    let _locked = RunFolder::lock(out)?;
    let copies = out.join(INPUTS);
    let mut inputs = Vec::new();
    for (key, file) in scene_of(&run, out)?.inputs_mut() {
        create_folder(&copies)?;
        let copy = copies.join(copy_of(key, file));
        let from = with_sidecar(key, file).into_iter().map(|(_, file)| file);
        for (from, to) in from.zip([copy.clone(), sidecar_path(&copy)]) {
            let bytes = read_bytes(&from)?;
            write_atomic(&to, |w| w.write_all(&bytes))?;
            let name = to.file_name().unwrap_or_default().to_string_lossy();
            inputs.push(json!({ "@id": format!("{INPUTS}/{name}") }));
        }
    }
    let mut files = Vec::new();
    collect(out, "", &mut files)?;
    let path = out.join(CRATE_FILE);
    json::write(&path, &metadata(&run, license, (inputs, files)))?;
    Ok(path)
}

/// Describes all files of a folder but the metadata and hidden ones, by their path.
fn collect(out: &Path, below: &str, files: &mut Vec<Value>) -> Result<()> {
    for (name, path) in list(&out.join(below))? {
        let name = if below.is_empty() { name } else { format!("{below}/{name}") };
        match () {
            () if name.starts_with('.') || name == CRATE_FILE => {}
            () if path.is_dir() => collect(out, &name, files)?,
            () => files.push(described(out, &name)?),
        }
    }
    Ok(())
}

/// The entity of a file.
fn described(out: &Path, name: &str) -> Result<Value> {
    let hash =
        serde_json::to_value(FileHash::of(out, name)?).map_err(|e| Error::format(out.join(name), e, "a file"))?;
    let media = MEDIA_TYPES.iter().find(|(end, _)| name.ends_with(end)).map_or("application/octet-stream", |m| m.1);
    Ok(json!({
        "@id": name,
        "@type": "File",
        "name": name,
        "encodingFormat": media,
        "contentSize": hash["bytes"].to_string(),
        "identifier": format!("blake3:{}", hash["blake3"].as_str().unwrap_or_default()),
    }))
}

fn metadata(run: &FinishedRun, license: &str, (inputs, files): (Vec<Value>, Vec<Value>)) -> Value {
    let (results, program) = (&run.results, &run.program);
    let link = |value: &Value| json!({ "@id": value["@id"] });
    let license = if license.contains("://") { license.into() } else { format!("https://spdx.org/licenses/{license}") };
    let (name, version) = program.split_once(' ').unwrap_or((program, ""));
    let engine = run.engine.as_ref().map(|_| json!({ "@id": "#engine" }));
    let instruments: Vec<Value> = [json!({ "@id": "#program" })].into_iter().chain(engine).collect();
    let used: Vec<Value> = [json!({ "@id": SCENE_FILE })].into_iter().chain(inputs).collect();
    let description = match results.description.trim() {
        "" => format!("Run {} of {program}.", results.name),
        text => text.to_string(),
    };
    let mut graph = vec![
        json!({
            "@id": CRATE_FILE,
            "@type": "CreativeWork",
            "conformsTo": { "@id": "https://w3id.org/ro/crate/1.1" },
            "about": { "@id": "./" },
        }),
        json!({
            "@id": "./",
            "@type": "Dataset",
            "name": results.name,
            "description": description,
            "datePublished": today(),
            "license": { "@id": license },
            "citation": results.sources,
            "hasPart": files.iter().map(link).collect::<Vec<_>>(),
            "mentions": { "@id": "#run" },
        }),
        json!({ "@id": license, "@type": "CreativeWork", "name": license }),
        json!({
            "@id": "#run",
            "@type": "CreateAction",
            "name": format!("asperity run {SCENE_FILE}"),
            "instrument": instruments,
            "object": used,
            "result": [{ "@id": results::FILE }],
        }),
        json!({ "@id": "#program", "@type": "SoftwareApplication", "name": name, "softwareVersion": version }),
    ];
    graph.extend(run.engine.as_ref().map(|engine| {
        json!({ "@id": "#engine", "@type": "SoftwareApplication", "name": "LAMMPS", "softwareVersion": engine })
    }));
    graph.extend(files);
    json!({ "@context": "https://w3id.org/ro/crate/1.1/context", "@graph": graph })
}

/// The date in UTC, as 2026-01-31.
fn today() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    date(seconds / 86_400)
}

/// The Gregorian date so many days after 1970-01-01.
fn date(days: u64) -> String {
    let leap = |year: u64| year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    let (mut year, mut rest) = (1970, days);
    while rest >= 365 + u64::from(leap(year)) {
        rest -= 365 + u64::from(leap(year));
        year += 1;
    }
    let lengths = [31, 28 + u64::from(leap(year)), 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let mut month = 0;
    while rest >= lengths[month] {
        rest -= lengths[month];
        month += 1;
    }
    format!("{year}-{:02}-{:02}", month + 1, rest + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_are_dates() {
        for (days, shown) in [(0, "1970-01-01"), (11_016, "2000-02-29"), (20_513, "2026-03-01"), (47_540, "2100-02-28")]
        {
            assert_eq!(date(days), shown);
        }
        assert_eq!(date(47_541), "2100-03-01");
    }
}
