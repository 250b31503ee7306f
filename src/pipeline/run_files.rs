//! Files of a finished run in addition to its results: the manifest and the recording.

use crate::Result;
use crate::record::mcap::{CloudAtom, GapMap, LoadScalars, LoadState, Recorder, RecordingInfo as Recorded};
use crate::record::results::{Results, StageCost};
use crate::scene::{Case, Scene};
use asperity_contact::load::Stop;
use asperity_contact::method::Device;
use asperity_grid::units::ANGSTROM_M;
use asperity_surface::files::atomic_file::write_atomic;
use asperity_surface::files::hashed::file_hash;
use asperity_surface::files::npy;
use asperity_surface::heights::sidecar_path;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

pub(super) const RECORDING_FILE: &str = "run.mcap";
/// Layout of Foxglove for the recording, and script of OVITO that draws the frames of the atoms.
const LAYOUT: (&str, &str) = ("run.foxglove.json", include_str!("../record/foxglove_layout.json"));
const OVITO: (&str, &str) = ("ovito_frames.py", include_str!("../record/ovito_frames.py"));

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

/// Writes the MCAP recording of a run (gap map and scalars per load, and the block atoms as a point cloud), its layout,
/// and the script for the frames.
pub(super) fn record(case: &Case, results: &Results, out: &Path) -> Result<()> {
    let store = |(name, text): (&str, &str)| write_atomic(&out.join(name), |w| w.write_all(text.as_bytes()));
    store(LAYOUT)?;
    if results.atoms.iter().flat_map(|a| &a.states).any(|s| s.frame.is_some()) {
        store(OVITO)?;
    }
    let length = results.atoms.as_ref().map_or(case.scales.length_m * 1e6, |a| a.length_angstrom);
    let (unit, metres) = if results.atoms.is_some() { ("Å", ANGSTROM_M) } else { ("µm", 1e-6) };
    let scene = Recorded {
        name: results.name.clone(),
        length_unit: unit.into(),
        cell: [length, length * case.model.grid.ly / case.model.grid.lx],
        notes: [("program".to_string(), format!("asperity {}", env!("CARGO_PKG_VERSION")))].into(),
    };
    let mut recorder = Recorder::create(&out.join(RECORDING_FILE), scene)?;
    // In a run with atoms, the recorded continuum is the compliant-wall solution, which has the atoms' profile and
    // scale.
    let continuum = results.comparison.as_ref().map(|c| &c.compliant_wall).or(results.continuum.as_ref());
    for state in continuum.iter().flat_map(|c| &c.states) {
        let gap = state.gap_file().map(|g| npy::read(&out.join(g))).transpose()?;
        let scaled: Option<(usize, Vec<f64>)> = gap.map(|g| (g.nx, g.values.iter().map(|v| v * length).collect()));
        recorder.state(&LoadState {
            source: "continuum",
            index: state.index as u32,
            scalars: LoadScalars {
                p_star: state.p_star,
                contact_area: state.contact_area,
                criterion: state.criterion.clone(),
                mean_gap: state.mean_gap.unwrap_or(f64::NAN) / metres,
                patches: state.patches,
                energy: state.energy,
                residual: state.residual,
            },
            gap: scaled.as_ref().map(|(nx, gap)| GapMap { nx: *nx, gap }),
            atoms: &[],
        })?;
    }
    for state in results.atoms.iter().flat_map(|a| &a.states) {
        let gap = npy::read(&out.join(&state.gap_map))?;
        let cloud = match &state.frame {
            Some(frame) => cloud(&out.join(frame))?,
            None => Vec::new(),
        };
        recorder.state(&LoadState {
            source: "atoms",
            index: state.index as u32,
            scalars: LoadScalars {
                p_star: state.p_star,
                contact_area: state.contact_area,
                criterion: "indenter atom within d_c".into(),
                mean_gap: state.mean_gap_angstrom,
                ..LoadScalars::default()
            },
            gap: Some(GapMap { nx: gap.nx, gap: &gap.values }),
            atoms: &cloud,
        })?;
    }
    recorder.finish()
}

/// Block atoms of a frame, with their contact flag.
fn cloud(frame: &Path) -> Result<Vec<CloudAtom>> {
    let atoms = crate::record::xyz::read(frame)?;
    let block = atoms.into_iter().filter(|a| !a.indenter);
    Ok(block.map(|a| CloudAtom { position: a.position_angstrom.map(|c| c as f32), contact: a.contact }).collect())
}
