//! Values that take time to find, kept for later runs in the user's cache folder. Whatever is lost there is found again: it may be
//! deleted at any time.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::hashed;

/// A folder of values by key, or none where the user has no folder for caches.
#[derive(Debug, Clone)]
pub struct UserCache {
    folder: Option<PathBuf>,
}

impl UserCache {
    /// `asperity/KIND` in `XDG_CACHE_HOME`, or in `~/.cache`. A relative folder is none, as the XDG specification has it.
    pub fn of_user(kind: &str) -> Self {
        let absolute = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|folder| folder.is_absolute());
        let caches = absolute("XDG_CACHE_HOME").or_else(|| Some(absolute("HOME")?.join(".cache")));
        UserCache { folder: caches.map(|folder| folder.join("asperity").join(kind)) }
    }

    /// The values in a folder.
    pub fn in_folder(folder: &Path) -> Self {
        UserCache { folder: Some(folder.to_path_buf()) }
    }

    fn file(&self, key: &str) -> Option<PathBuf> {
        Some(self.folder.as_ref()?.join(format!("{key}.json")))
    }

    /// The value of a key. A file that cannot be read, is damaged or has another form holds none.
    pub fn read<T: DeserializeOwned>(&self, key: &str) -> Option<T> {
        // Anything else than a file, as a pipe, would have to be waited for.
        let file = self.file(key).filter(|file| file.is_file())?;
        hashed::read(&file, true).valid()
    }

    /// Keeps a value: an object of JSON, which other processes see complete or not at all. Where the folder cannot be written, nothing
    /// is kept.
    pub fn write<T: Serialize>(&self, key: &str, value: &T) {
        let Some((folder, file)) = self.folder.as_ref().zip(self.file(key)) else { return };
        if std::fs::create_dir_all(folder).is_ok() {
            let _ = hashed::write(&file, value, &[]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn value(number: f64) -> BTreeMap<String, f64> {
        BTreeMap::from([("a".to_string(), number)])
    }

    #[test]
    fn values_are_kept_and_damaged_ones_are_none() {
        let folder = tempfile::tempdir().unwrap();
        let cache = UserCache::in_folder(&folder.path().join("new/folder"));
        let read = || cache.read::<BTreeMap<String, f64>>("key");
        assert_eq!(read(), None);
        cache.write("key", &value(4.08165));
        assert_eq!(read(), Some(value(4.08165)));
        // Another number, and no number: what a damaged disk or an editor leaves.
        let file = folder.path().join("new/folder/key.json");
        let text = std::fs::read_to_string(&file).unwrap();
        for damaged in [text.replace("4.08165", "7.08165"), text[..text.len() / 2].to_string(), String::new()] {
            assert_ne!(damaged, text);
            std::fs::write(&file, damaged).unwrap();
            assert_eq!(read(), None);
        }
        cache.write("key", &value(4.0));
        assert_eq!(read(), Some(value(4.0)));
        assert_eq!(cache.read::<BTreeMap<String, f64>>("other"), None);
        assert_eq!(cache.read::<Vec<f64>>("key"), None);
    }

    #[test]
    fn a_folder_that_cannot_be_written_keeps_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, "").unwrap();
        for cache in [UserCache::in_folder(&file.join("below")), UserCache { folder: None }] {
            cache.write("key", &value(1.0));
            assert_eq!(cache.read::<BTreeMap<String, f64>>("key"), None);
        }
        // A folder in place of the file.
        std::fs::create_dir(folder.path().join("key.json")).unwrap();
        let cache = UserCache::in_folder(folder.path());
        cache.write("key", &value(1.0));
        assert_eq!(cache.read::<BTreeMap<String, f64>>("key"), None);
    }
}
