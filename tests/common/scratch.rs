//! A temporary folder with maps and other files of a test.

use asperity::surface::files::npy;
use std::path::{Path, PathBuf};

pub(crate) struct Scratch(tempfile::TempDir);

impl Scratch {
    pub(crate) fn new() -> Self {
        Scratch(tempfile::tempdir().expect("scratch"))
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// The path as a word of a command.
    pub(crate) fn word(&self, name: &str) -> String {
        self.path(name).to_str().expect("UTF-8").into()
    }

    /// Writes a map `[ny, nx]` of the value of its column and row; returns its path as a word of a command.
    pub(crate) fn map(&self, name: &str, [nx, ny]: [usize; 2], value: impl Fn(usize, usize) -> f64) -> String {
        npy::write(&self.path(name), nx, ny, (0..nx * ny).map(|i| value(i % nx, i / nx))).expect("written");
        self.word(name)
    }

    pub(crate) fn text(&self, name: &str, contents: &str) -> String {
        std::fs::write(self.path(name), contents).expect("written");
        self.word(name)
    }
}

/// Values of a field.
pub(crate) fn field(path: &Path) -> Vec<f64> {
    npy::read(path).expect("a field").values
}
