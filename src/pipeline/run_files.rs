//! Files of a finished run in addition to its results: the manifest and the script for the frames.

use crate::Result;
use crate::record::results::{Results, StageCost};
use crate::scene::{Case, Scene};
use asperity_contact::load::Stop;
use asperity_contact::method::Device;
use asperity_surface::files::atomic_file::write_atomic;
use asperity_surface::files::hashed::file_hash;
use asperity_surface::heights::sidecar_path;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Contents of `manifest.json`: program, scene, engine, threads, memory, and time of each stage.
#[derive(serde::Serialize)]
pub(super) struct Manifest<'a> {
    program: String,
    scene: &'a Scene,
    /// BLAKE3 hashes of the files that the scene names, by key.
    inputs: BTreeMap<String, String>,
    engine: Option<&'a str>,
    threads: usize,
    device: Device,
    peak_rss_bytes: u64,
    stages: &'a [StageCost],
    stops: Vec<Stop>,
    warnings: &'a [String],
}

impl<'a> Manifest<'a> {
    /// # Errors
    /// `Io`, of the files that the scene names.
    pub(super) fn of(case: &'a Case, results: &'a Results, engine: Option<&'a str>) -> Result<Self> {
        let mut scene = case.scene.clone();
        let mut inputs = BTreeMap::new();
        for (key, file) in scene.inputs_mut() {
            for (key, file) in with_sidecar(key, &case.resolve_path(file)) {
                inputs.insert(key, file_hash(&file)?);
            }
        }
        Ok(Manifest {
            program: format!("asperity {}", env!("CARGO_PKG_VERSION")),
            scene: &case.scene,
            inputs,
            engine,
            threads: rayon::current_num_threads(),
            device: Device::of(&case.planned_problem(), case.method()),
            peak_rss_bytes: results.stages.iter().map(|s| s.peak_rss_bytes).max().unwrap_or(0),
            stages: &results.stages,
            stops: results.continuum.iter().flat_map(|c| &c.states).map(|s| s.stop).collect(),
            warnings: &results.warnings,
        })
    }
}

/// A file that a key of a scene names, and its sidecar, if there is one, with a key of its own.
pub(super) fn with_sidecar(key: &str, file: &Path) -> Vec<(String, PathBuf)> {
    let sidecar = Some(sidecar_path(file)).filter(|sidecar| sidecar.is_file());
    let sidecar = sidecar.map(|sidecar| (format!("{key} (sidecar)"), sidecar));
    [(key.to_string(), file.to_path_buf())].into_iter().chain(sidecar).collect()
}

/// Writes the script that draws the frames of the atoms, where there are some.
pub(super) fn write_ovito_script(results: &Results, out: &Path) -> Result<()> {
    if results.atoms.iter().flat_map(|a| &a.states).any(|s| s.frame.is_some()) {
        write_atomic(&out.join("ovito_frames.py"), |w| w.write_all(include_bytes!("../record/ovito_frames.py")))?;
    }
    Ok(())
}
