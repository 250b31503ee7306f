//! JSON files that hold BLAKE3 hashes: of their own contents, and of other files of their folder. A file that changed
//! since it was written is recognised before it is used. The hashes protect against damage, not against forgery.

use std::io::ErrorKind;
use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::atomic_file::{self, open_regular, read_bytes, read_text, write_atomic};
use super::inside::inside;
use super::json;
use asperity_grid::error::{Error, Result};

/// Name of the file that [`write()`] leaves in a finished stage, and in the folder of a solve.
pub const DONE_FILE: &str = "done.json";

/// Keys that [`write`] adds to an object.
const FILES: &str = "files";
const OWN: &str = "blake3";

/// Name, size and hash of a file at one time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FileHash {
    /// Path relative to the folder of the file that lists it.
    pub name: String,
    bytes: u64,
    blake3: String,
}

impl FileHash {
    pub fn of(folder: &Path, name: &str) -> Result<FileHash> {
        let path = folder.join(name);
        let (_, bytes) = open_regular(&path)?;
        Ok(FileHash { name: name.into(), bytes, blake3: file_hash(&path)? })
    }

    /// How the file in `folder` differs from this one; None if it is the same.
    pub fn damage(&self, folder: &Path) -> Option<String> {
        let path = match inside(folder, DONE_FILE, &self.name) {
            Ok(path) => path,
            Err(e) => return Some(e.to_string()),
        };
        let what = match open_regular(&path) {
            Err(Error::Io { source: e, .. }) if e.kind() == ErrorKind::NotFound => "is missing".to_string(),
            Err(e) => return Some(e.to_string()),
            // The size is compared first: it costs no reading.
            Ok((_, bytes)) if bytes != self.bytes => format!("has {bytes} bytes instead of {}", self.bytes),
            Ok(_) => match file_hash(&path) {
                Ok(hash) if hash == self.blake3 => return None,
                Ok(_) => "changed since it was written".to_string(),
                Err(e) => return Some(e.to_string()),
            },
        };
        Some(format!("{} {what}", path.display()))
    }
}

/// Hashes of all files below `folder` whose relative path `keep` accepts, in the order of their names. Hidden
/// files are left out: an interrupted write leaves one.
pub fn hashes(folder: &Path, keep: &dyn Fn(&str) -> bool) -> Result<Vec<FileHash>> {
    let mut names = Vec::new();
    list(folder, "", &mut names)?;
    names.sort();
    names.iter().filter(|name| keep(name)).map(|name| FileHash::of(folder, name)).collect()
}

fn list(folder: &Path, below: &str, names: &mut Vec<String>) -> Result<()> {
    for (name, path) in atomic_file::list(folder)?.into_iter().filter(|(name, _)| !name.starts_with('.')) {
        let name = format!("{below}{name}");
        if path.is_dir() {
            list(&path, &format!("{name}/"), names)?;
        } else {
            names.push(name);
        }
    }
    Ok(())
}

/// A file as found.
#[derive(Debug)]
pub enum Stored<T> {
    Valid(T),
    /// There is no file, or one of an earlier version of this program, which wrote no hashes.
    Absent,
    /// The file, or one that it lists, is not as it was written; in words that name the file.
    Damaged(String),
}

impl<T> Stored<T> {
    /// The value, if the file is valid.
    pub fn valid(self) -> Option<T> {
        match self {
            Stored::Valid(value) => Some(value),
            Stored::Absent | Stored::Damaged(_) => None,
        }
    }
}

fn hash_of(object: &Map<String, Value>) -> String {
    blake3::hash(Value::Object(object.clone()).to_string().as_bytes()).to_hex().to_string()
}

/// Writes `value`, an object of JSON, with its own hash and those of `files`.
pub fn write<T: Serialize>(path: &Path, value: &T, files: &[FileHash]) -> Result<()> {
    let accepted = "an object that JSON can hold";
    let object = serde_json::to_value(value).map_err(|e| Error::format(path, e, accepted))?;
    let Value::Object(mut object) = object else { return Err(Error::format(path, "no object", accepted)) };
    object.insert(FILES.into(), serde_json::to_value(files).map_err(|e| Error::format(path, e, accepted))?);
    object.insert(OWN.into(), Value::String(hash_of(&object)));
    json::write(path, &object)
}

/// Reads a file that [`write()`] wrote, and checks its own hash; with `verify` also the files that it lists.
pub fn read<T: DeserializeOwned>(path: &Path, verify: bool) -> Stored<T> {
    let (object, files) = match read_object(path) {
        Stored::Valid(found) => found,
        Stored::Absent => return Stored::Absent,
        Stored::Damaged(what) => return Stored::Damaged(what),
    };
    if verify {
        let folder = path.parent().unwrap_or(Path::new("."));
        if let Some(description) = files.iter().find_map(|f| f.damage(folder)) {
            return Stored::Damaged(description);
        }
    }
    match serde_json::from_value(Value::Object(object)) {
        Ok(value) => Stored::Valid(value),
        Err(_) => Stored::Absent,
    }
}

/// The files that a file of [`write()`] lists.
pub fn listed(path: &Path) -> Stored<Vec<FileHash>> {
    match read_object(path) {
        Stored::Valid((_, files)) => Stored::Valid(files),
        Stored::Absent => Stored::Absent,
        Stored::Damaged(what) => Stored::Damaged(what),
    }
}

/// The object without its own hash, which is checked, and the files that it lists.
fn read_object(path: &Path) -> Stored<(Map<String, Value>, Vec<FileHash>)> {
    let damaged = |description: &str| Stored::Damaged(format!("{} {description}", path.display()));
    let bytes = match read_bytes(path) {
        Ok(bytes) => bytes,
        Err(Error::Io { source: e, .. }) if matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
            return Stored::Absent;
        }
        Err(e) => return damaged(&format!("cannot be read ({e})")),
    };
    let Ok(mut object) = serde_json::from_slice::<Map<String, Value>>(&bytes) else {
        return damaged("is damaged");
    };
    let Some(own) = object.remove(OWN) else { return Stored::Absent };
    if own != Value::String(hash_of(&object)) {
        return damaged("changed since it was written");
    }
    let files = object.remove(FILES).and_then(|f| serde_json::from_value(f).ok()).unwrap_or_default();
    Stored::Valid((object, files))
}

/// List of the files of a run folder outside its stages, as `b3sum --check` reads it.
pub const CHECKSUMS: &str = "checksums.b3";

/// Writes [`CHECKSUMS`] for those of `names` that exist in `folder`.
pub fn write_checksums(folder: &Path, names: &[&str]) -> Result<()> {
    let mut text = String::new();
    for name in names.iter().filter(|name| folder.join(name).is_file()) {
        text += &format!("{}  {name}\n", file_hash(&folder.join(name))?);
    }
    write_atomic(&folder.join(CHECKSUMS), |w| std::io::Write::write_all(w, text.as_bytes()))
}

/// Those of `names` that differ from [`CHECKSUMS`]. Files that it does not list are not judged.
pub fn changed<'a>(folder: &Path, names: &[&'a str]) -> Vec<&'a str> {
    names.iter().copied().filter(|name| as_listed(folder, name) == Some(false)).collect()
}

/// Whether a file is as [`CHECKSUMS`] lists it; `None` if it does not.
pub fn as_listed(folder: &Path, name: &str) -> Option<bool> {
    let text = read_text(&folder.join(CHECKSUMS)).ok()?;
    let hash = text.lines().filter_map(|l| l.split_once("  ")).find(|(_, n)| *n == name)?.0;
    Some(file_hash(&folder.join(name)).ok().as_deref() == Some(hash))
}

/// BLAKE3 hash of a file, hexadecimal.
pub fn file_hash(path: &Path) -> Result<String> {
    let mut hasher = blake3::Hasher::new();
    let (file, _) = open_regular(path)?;
    hasher.update_reader(file).map_err(Error::io("read", path))?;
    Ok(hasher.finalize().to_hex().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct TestRecord {
        key: String,
        seconds: f64,
    }

    #[test]
    fn changes_of_the_file_and_of_those_it_lists_are_found() {
        let folder = tempfile::tempdir().expect("scratch");
        let path = |name: &str| folder.path().join(name);
        std::fs::create_dir(path("inside")).expect("made");
        for name in ["a.npy", "inside/b.npy", ".partial-x"] {
            std::fs::write(path(name), "contents").expect("written");
        }
        let record = TestRecord { key: "k".into(), seconds: 0.1 + 0.2 };
        let files = hashes(folder.path(), &|_| true).expect("hashed");
        assert_eq!(files.iter().map(|f| f.name.as_str()).collect::<Vec<_>>(), ["a.npy", "inside/b.npy"]);
        write(&path("done.json"), &record, &files).expect("written");
        let actual = |verify| read::<TestRecord>(&path("done.json"), verify);
        assert!(matches!(actual(true), Stored::Valid(d) if d == record));
        let damage = |says: &str| match actual(true) {
            Stored::Damaged(text) => assert!(text.contains(says), "{text}"),
            other => panic!("{other:?} instead of {says}"),
        };
        std::fs::write(path("inside/b.npy"), "kontents").expect("written");
        damage("inside/b.npy changed");
        assert!(actual(false).valid().is_some());
        std::fs::write(path("inside/b.npy"), "cont").expect("written");
        damage("b.npy has 4 bytes instead of 8");
        std::fs::remove_file(path("inside/b.npy")).expect("removed");
        damage("b.npy is missing");
        // Every single bit of the file itself.
        std::fs::write(path("inside/b.npy"), "contents").expect("written");
        let whole = std::fs::read(path("done.json")).expect("read");
        for k in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[k] ^= 1;
            std::fs::write(path("done.json"), &bytes).expect("written");
            // White space that stays white space, or a key that is no longer found, change no value.
            let same = actual(true).valid().is_none_or(|d| d == record);
            assert!(same, "byte {k} of {}", String::from_utf8_lossy(&whole));
        }
        std::fs::remove_file(path("done.json")).expect("removed");
        assert!(matches!(actual(true), Stored::Absent));
    }

    #[test]
    fn checksums_name_the_changed_files() {
        let folder = tempfile::tempdir().expect("scratch");
        let put = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
        put("a.json", "a");
        put("b.html", "b");
        let names = ["a.json", "b.html", "none.nc"];
        write_checksums(folder.path(), &names).expect("written");
        assert_eq!(changed(folder.path(), &names), Vec::<&str>::new());
        put("b.html", "c");
        assert_eq!(changed(folder.path(), &names), ["b.html"]);
        std::fs::remove_file(folder.path().join(CHECKSUMS)).expect("removed");
        assert_eq!(changed(folder.path(), &names), Vec::<&str>::new());
    }
}
