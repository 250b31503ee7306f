//! A job folder: everything one LAMMPS run needs, written so that a person can run it by hand as well.
//!
//! `block.data` (the atoms), `displacement_ramp.in` or `prescribed_load.in` with what they include (the scripts, the same for every job),
//! `potential.eam.alloy` (a copy) and `job.json` (all variables and counts); `move.K.dump` where the continuum says where to
//! start. The run adds `load_steps.csv`, `frame.K.dump`, `restart.K` and its logs.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::block::{Block, FLOOR_GAP_ANGSTROM};
use super::cost::memory_bytes;
use super::engine::lock;
use super::indenter::Indenter;
use super::initial_configuration::{InitialConfiguration, PrescribedLoads};
use super::load_history::{self, LOAD_STEPS_FILE, StepRecord};
use super::minimizer_checkpoint;
use super::nvt::NvtRun;
use super::unloading::MOST_RISEN_ANGSTROM;
use crate::{Error, Result};

/// Scripts of a run, documented in `lammps-inputs/README.md`: the one that LAMMPS is given, and those that it includes.
#[derive(Debug, PartialEq, Eq)]
pub struct Script {
    pub file: &'static str,
    pub text: &'static str,
}

/// Climbs the ladder from first touch.
pub const DISPLACEMENT_RAMP: Script =
    Script { file: "displacement_ramp.in", text: include_str!("../../lammps-inputs/displacement_ramp.in") };

/// Goes from load to load as the continuum does.
pub const PRESCRIBED_LOAD: Script =
    Script { file: "prescribed_load.in", text: include_str!("../../lammps-inputs/prescribed_load.in") };

/// Holds relaxed states at a temperature.
pub const NVT: Script = Script { file: "nvt.in", text: include_str!("../../lammps-inputs/nvt.in") };

/// What they include.
const INCLUDED: [Script; 2] = [
    Script { file: "setup.in", text: include_str!("../../lammps-inputs/setup.in") },
    Script { file: "end_of_step.in", text: include_str!("../../lammps-inputs/end_of_step.in") },
];

impl Script {
    /// Hash of the script with what it includes.
    pub fn hash(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for part in [self.text].into_iter().chain(INCLUDED.map(|s| s.text)) {
            hasher.update(part.as_bytes());
        }
        hasher.finalize().to_hex().to_string()
    }
}

pub const DATA_FILE: &str = "block.data";
pub const POTENTIAL_FILE: &str = "potential.eam.alloy";
pub const RECORD_FILE: &str = "job.json";

/// Largest force that atoms are left with unless told otherwise, eV/Å. With a larger one asked for, loads that start from the continuum
/// end by what indenter and base carry (`prescribed_load.in`).
pub const FORCE_TOLERANCE: f64 = 2e-3;

/// Empty box above the highest atom of an indenter that only moves down, Å.
const HEAD_ROOM_ANGSTROM: f64 = 5.0;

/// Layers of the block in every frame. Contact is decided in the first; two more show where material has flowed.
pub const FRAME_LAYERS: usize = 3;

/// How the indenter's atoms act on the block's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Interaction {
    /// Lennard-Jones, cut at its minimum and shifted to zero there.
    pub epsilon_ev: f64,
    pub sigma_angstrom: f64,
    pub adhesion: Option<Yukawa>,
}

impl Interaction {
    /// The minimum 2^(1/6) σ, beyond which there is no repulsion, Å.
    pub fn touch_angstrom(&self) -> f64 {
        2f64.powf(1.0 / 6.0) * self.sigma_angstrom
    }

    /// Beyond this distance two atoms do not feel each other, Å.
    pub fn reach_angstrom(&self) -> f64 {
        self.adhesion.map_or(0.0, |y| y.cutoff_angstrom).max(self.touch_angstrom())
    }

    /// Force between two atoms over their distance, eV/Å², repulsion positive; `square` is the distance's, Å².
    pub fn force_over_distance(&self, square: f64) -> f64 {
        let touch = self.touch_angstrom();
        let mut force = 0.0;
        if square < touch * touch {
            let s6 = (self.sigma_angstrom * self.sigma_angstrom / square).powi(3);
            force += 24.0 * self.epsilon_ev * (2.0 * s6 * s6 - s6) / square;
        }
        if let Some(y) = self.adhesion.filter(|y| square < y.cutoff_angstrom * y.cutoff_angstrom) {
            let r = square.sqrt();
            let value = y.amplitude_ev_angstrom * (-y.kappa_per_angstrom * r).exp() / r;
            force += value * (y.kappa_per_angstrom + 1.0 / r) / r;
        }
        force
    }
}

/// `amplitude` e^(-κr)/r, the pair form whose sum over a plane of atoms is an exponential.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Yukawa {
    /// Negative attracts, eV·Å.
    pub amplitude_ev_angstrom: f64,
    pub kappa_per_angstrom: f64,
    pub cutoff_angstrom: f64,
}

/// How the indenter comes down, when it stops, and whether it goes back.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RunSettings {
    /// Å per step.
    pub step_angstrom: f64,
    /// The ladder ends with the first step whose load is not below this, eV/Å.
    pub max_load: f64,
    pub max_steps: usize,
    /// Largest force component left on a free atom, eV/Å.
    pub force_tolerance: f64,
    /// Load at p* = 1: cell area × E* × rms gradient, eV/Å.
    pub load_unit: f64,
    /// Distance below which an atom counts as touching, Å.
    pub contact_angstrom: f64,
    /// Layers of the block, from the top, in every frame.
    #[serde(default = "frame_layers")]
    pub frame_layers: usize,
    /// From first touch: after the highest load the indenter rises until nothing touches.
    #[serde(default)]
    pub unload: bool,
    /// The restart file of every step is kept, not of the last two alone.
    #[serde(default)]
    pub keep: bool,
}

fn frame_layers() -> usize {
    FRAME_LAYERS
}

/// Contents of `job.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    pub element: String,
    pub cells: usize,
    pub depth_cells: usize,
    pub base_layers: usize,
    /// Of an elastic foundation, with which the base moves; 0 of a rigid one.
    #[serde(default, skip_serializing_if = "crate::record::json::is_default")]
    pub foundation_cells: usize,
    pub a0_angstrom: f64,
    pub deformable: u64,
    pub fixed: u64,
    pub indenter: u64,
    pub indenter_points: usize,
    pub indenter_spacing_angstrom: f64,
    pub indenter_start_z_angstrom: f64,
    pub frame_depth_angstrom: f64,
    pub interaction: Interaction,
    pub settings: RunSettings,
    /// PrescribedLoads one by one, each started from the continuum; without them the indenter comes down step by step.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loads: Option<PrescribedLoads>,
    /// Relaxed states are held at a temperature; there is no data file then, and no step is a load's first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nvt: Option<NvtRun>,
    /// BLAKE3 of what the run reads: another content makes another run.
    pub data_hash: String,
    pub script_hash: String,
    pub potential_hash: String,
}

/// A folder ready to run.
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    pub folder: PathBuf,
    pub record: Record,
}

impl Job {
    /// Writes the folder. Steps that an earlier run of exactly this job finished there are kept; those of any other are
    /// removed. With `initial_configurations` (loads that rise, and may fall again) each load starts from where they say the atoms are.
    ///
    /// # Errors
    /// `Input` for values LAMMPS could not use, `Io`.
    pub fn write(
        folder: impl AsRef<Path>,
        block: &Block,
        indenter: &Indenter,
        (potential, element, mass_u): (&Path, &str, f64),
        interaction: Interaction,
        settings: RunSettings,
        initial_configurations: Option<&[InitialConfiguration]>,
    ) -> Result<Job> {
        let folder = folder.as_ref();
        check(&interaction, &settings, element, mass_u)?;
        std::fs::create_dir_all(folder).map_err(Error::io("create", folder))?;
        let _lock = lock(folder)?;
        let table = std::fs::read(potential).map_err(Error::io("read", potential))?;
        let file = folder.join(POTENTIAL_FILE);
        std::fs::write(&file, &table).map_err(Error::io("write", &file))?;
        let script = if initial_configurations.is_some() { PRESCRIBED_LOAD } else { DISPLACEMENT_RAMP };
        let data = folder.join(DATA_FILE);
        let data_hash =
            write_data(&data, block, (indenter, settings.unload), mass_u).map_err(Error::io("write", &data))?;
        let loads = initial_configurations
            .map(|list| PrescribedLoads::write(folder, block, indenter, mass_u, list))
            .transpose()?;
        let record = Record {
            element: element.into(),
            cells: block.cells,
            depth_cells: block.depth_cells,
            base_layers: block.base_layers,
            foundation_cells: block.foundation_cells,
            a0_angstrom: block.a0,
            deformable: block.deformable(),
            fixed: block.fixed(),
            indenter: indenter.atoms(),
            indenter_points: indenter.points(),
            indenter_spacing_angstrom: indenter.spacing(),
            indenter_start_z_angstrom: indenter.start_z(),
            frame_depth_angstrom: 0.5 * block.a0 * (settings.frame_layers as f64 - 0.5),
            interaction,
            settings,
            loads,
            nvt: None,
            data_hash,
            script_hash: script.hash(),
            potential_hash: blake3::hash(&table).to_hex().to_string(),
        };
        Job::place(folder, record)
    }

    /// Writes scripts and record into a folder that has all else, and removes what another job has left there.
    pub(super) fn place(folder: &Path, mut record: Record) -> Result<Job> {
        let earlier = Job::open(folder).ok().map(|job| job.record);
        let in_common = match (&mut record.loads, earlier.as_ref().and_then(|r| r.loads.as_ref())) {
            (Some(now), Some(then)) => now.go_on_after(then),
            _ => None,
        };
        let job = Job { folder: folder.to_path_buf(), record };
        let put = |name: &str, bytes: &[u8]| {
            let file = folder.join(name);
            std::fs::write(&file, bytes).map_err(Error::io("write", &file))
        };
        put(job.script().file, job.script().text.as_bytes())?;
        INCLUDED.iter().try_for_each(|s| put(s.file, s.text.as_bytes()))?;
        let (record, file) = (&job.record, folder.join(RECORD_FILE));
        let text = serde_json::to_string_pretty(record).map_err(|e| Error::io("write", &file)(e.into()))?;
        // Where a way down ends does not change its steps: asking for more goes on, asking for less stops earlier. A way back is
        // another one from every load.
        let same = earlier.is_some_and(|earlier| {
            let RunSettings { max_load, max_steps, load_unit, .. } = record.settings;
            let ends = match earlier.settings {
                there_and_back if there_and_back.unload => there_and_back,
                down => RunSettings { max_load, max_steps, load_unit, ..down },
            };
            // More restart files than are needed do no harm.
            let ends = RunSettings { keep: record.settings.keep && ends.keep, ..ends };
            let agree = in_common.is_some() || record.loads == earlier.loads;
            agree && Record { settings: ends, loads: record.loads.clone(), ..earlier } == *record
        });
        match in_common {
            _ if !same => remove_states(folder)?,
            Some(loads) => load_history::keep_first(folder, loads + 1)?,
            None => {}
        }
        put(RECORD_FILE, text.as_bytes())?;
        Ok(job)
    }

    /// A folder that [`Job::write`] made.
    ///
    /// # Errors
    /// `Io`, and `Format` when `job.json` is not one.
    pub fn open(folder: impl AsRef<Path>) -> Result<Job> {
        let folder = folder.as_ref().to_path_buf();
        let file = folder.join(RECORD_FILE);
        let text = std::fs::read_to_string(&file).map_err(Error::io("read", &file))?;
        let record = serde_json::from_str(&text).map_err(|e| Error::format(&file, e, "the record of a job"))?;
        Ok(Job { folder, record })
    }

    /// Deformable, fixed and indenter atoms together.
    pub fn atoms(&self) -> u64 {
        self.record.deformable + self.record.fixed + self.record.indenter
    }

    /// Resident memory of LAMMPS, all ranks together, bytes.
    pub fn memory_bytes(&self, ranks: usize) -> u64 {
        memory_bytes(self.atoms(), ranks, self.record.loads.is_none())
    }

    /// The script that LAMMPS is given.
    pub fn script(&self) -> Script {
        match self.record {
            Record { nvt: Some(_), .. } => NVT,
            Record { loads: Some(_), .. } => PRESCRIBED_LOAD,
            _ => DISPLACEMENT_RAMP,
        }
    }

    /// `-var` pairs of the script: going on after the steps `done`, or from the beginning.
    pub fn variables(&self, done: &[StepRecord], compressed: bool) -> Vec<(String, String)> {
        let Record { interaction, settings, .. } = &self.record;
        let mut list = vec![
            ("potential", POTENTIAL_FILE.to_string()),
            ("element", self.record.element.clone()),
            ("epsilon", interaction.epsilon_ev.to_string()),
            ("sigma", interaction.sigma_angstrom.to_string()),
            ("contact", settings.contact_angstrom.to_string()),
            ("frame_depth", self.record.frame_depth_angstrom.to_string()),
            ("start", done.last().map_or("-1".to_string(), |r| r.step.to_string())),
        ];
        if let Some(yukawa) = interaction.adhesion {
            list.push(("adhesion", "1".into()));
            list.push(("amplitude", yukawa.amplitude_ev_angstrom.to_string()));
            list.push(("kappa", yukawa.kappa_per_angstrom.to_string()));
            list.push(("yukawa_cutoff", yukawa.cutoff_angstrom.to_string()));
        }
        if compressed {
            list.push(("dump_style", "custom/zstd".into()));
            list.push(("dump_end", "dump.zst".into()));
        }
        if self.record.nvt.is_none() {
            list.push(("data", DATA_FILE.to_string()));
            list.push(("ftol", settings.force_tolerance.to_string()));
            list.push(("keep_all", u8::from(settings.keep).to_string()));
        }
        if self.record.loads.is_none() && self.record.nvt.is_none() {
            list.push(("dz", settings.step_angstrom.to_string()));
            list.push(("max_load", settings.max_load.to_string()));
            list.push(("steps", settings.max_steps.to_string()));
            if settings.unload {
                list.extend(self.unloading_variables(done));
            }
        }
        if self.record.foundation_cells > 0 && self.record.loads.is_some() {
            list.push(("moving_base", "1".into()));
        }
        let held = self.record.nvt.iter().flat_map(NvtRun::variables);
        let own = self.record.loads.iter().flat_map(PrescribedLoads::variables).chain(held);
        list.into_iter().map(|(key, value)| (key.to_string(), value)).chain(own).collect()
    }
}

fn check(interaction: &Interaction, settings: &RunSettings, element: &str, mass_u: f64) -> Result<()> {
    let place = "LAMMPS job";
    let mut list = vec![
        ("epsilon", interaction.epsilon_ev),
        ("sigma", interaction.sigma_angstrom),
        ("mass", mass_u),
        ("step", settings.step_angstrom),
        ("largest load", settings.max_load),
        ("load at p* = 1", settings.load_unit),
        ("force tolerance", settings.force_tolerance),
        ("contact distance", settings.contact_angstrom),
    ];
    if let Some(yukawa) = interaction.adhesion {
        list.push(("kappa", yukawa.kappa_per_angstrom));
        list.push(("Yukawa cut-off", yukawa.cutoff_angstrom));
        if !yukawa.amplitude_ev_angstrom.is_finite() {
            return Err(Error::input(place, "amplitude", yukawa.amplitude_ev_angstrom, "a finite number"));
        }
    }
    for (key, value) in list {
        if !(value.is_finite() && value > 0.0) {
            return Err(Error::input(place, key, value, "a positive number"));
        }
    }
    if element.is_empty() || !element.chars().all(|c| c.is_ascii_alphanumeric()) {
        return Err(Error::input(place, "element", element, "a chemical symbol"));
    }
    Ok(())
}

/// Streams the atoms into a LAMMPS data file, with room above for an indenter that `rises`; returns the hash of what was written.
fn write_data(file: &Path, block: &Block, (indenter, rises): (&Indenter, bool), mass_u: f64) -> io::Result<String> {
    let mut out =
        BufWriter::with_capacity(1 << 16, Hashing { file: File::create(file)?, hasher: blake3::Hasher::new() });
    let length = block.length();
    writeln!(out, "fcc block {0} x {0} x {1} cells under a rigid indenter", block.cells, block.depth_cells)?;
    writeln!(out, "\n{} atoms\n3 atom types\n", block.atoms() + indenter.atoms())?;
    writeln!(out, "0.0 {length:.10} xlo xhi\n0.0 {length:.10} ylo yhi")?;
    let room = HEAD_ROOM_ANGSTROM + if rises { MOST_RISEN_ANGSTROM } else { 0.0 };
    writeln!(out, "0.0 {:.10} zlo zhi\n", indenter.highest_z() + room)?;
    // The indenter's mass is never used, but LAMMPS wants one.
    writeln!(out, "Masses\n\n1 {mass_u} # deformable\n2 {mass_u} # indenter\n3 {mass_u} # base\n\nAtoms # atomic\n")?;
    for site in block.sites() {
        let [x, y, z] = site.position;
        debug_assert!(z >= FLOOR_GAP_ANGSTROM);
        writeln!(out, "{} {} {x:.10} {y:.10} {z:.10}", site.id, if site.fixed { 3 } else { 1 })?;
    }
    for (id, [x, y, z]) in (block.atoms() + 1..).zip(indenter.positions()) {
        writeln!(out, "{id} 2 {x:.10} {y:.10} {z:.10}")?;
    }
    let hashing = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    Ok(hashing.hasher.finalize().to_hex().to_string())
}

/// Hashes what it writes.
pub(super) struct Hashing<W> {
    pub file: W,
    pub hasher: blake3::Hasher,
}

impl<W: Write> Write for Hashing<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.write(bytes)?;
        self.hasher.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// What a run leaves behind: ladder, frames, restart files, states from midway and logs.
fn remove_states(folder: &Path) -> Result<()> {
    for entry in std::fs::read_dir(folder).map_err(Error::io("list", folder))? {
        let path = entry.map_err(Error::io("list", folder))?.path();
        let Some(name) = path.file_name().and_then(|n| n.to_str()) else { continue };
        if name == LOAD_STEPS_FILE
            || ["frame.", "restart.", "log.", minimizer_checkpoint::PREFIX].iter().any(|start| name.starts_with(start))
        {
            std::fs::remove_file(&path).map_err(Error::io("remove", &path))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atoms::initial_configuration::PrescribedLoad;
    use crate::atoms::load_history::HEADER;

    fn written(folder: &Path, step: f64) -> Result<Job> {
        let block = Block::new(5, 1, 5.5884, 7.0)?;
        let indenter = Indenter::above(&block, 11, vec![0.5; 121], 4.0327)?;
        let table = folder.join("table");
        std::fs::write(&table, "a table").map_err(Error::io("write", &table))?;
        let interaction = Interaction { epsilon_ev: 0.2145, sigma_angstrom: 3.5927, adhesion: None };
        let settings = RunSettings {
            step_angstrom: step,
            max_load: 5.0,
            max_steps: 10,
            force_tolerance: 2e-3,
            load_unit: 100.0,
            contact_angstrom: 4.0354,
            frame_layers: FRAME_LAYERS,
            unload: false,
            keep: false,
        };
        Job::write(folder.join("job"), &block, &indenter, (&table, "Ca", 40.078), interaction, settings, None)
    }

    #[test]
    fn the_data_file_holds_every_atom_once_and_is_the_same_every_time() {
        let folder = tempfile::tempdir().expect("scratch");
        let job = written(folder.path(), 0.3).expect("written");
        let text = std::fs::read_to_string(job.folder.join(DATA_FILE)).expect("read");
        assert!(text.contains(&format!("\n{} atoms\n3 atom types\n", job.atoms())));
        let lines: Vec<&str> = text.lines().skip_while(|l| !l.starts_with("Atoms")).skip(2).collect();
        assert_eq!(lines.len() as u64, job.atoms());
        let of = |kind: &str| lines.iter().filter(|l| l.split(' ').nth(1) == Some(kind)).count() as u64;
        assert_eq!((of("1"), of("2"), of("3")), (job.record.deformable, job.record.indenter, job.record.fixed));
        assert_eq!(lines[0], "1 3 1.3971000000 1.3971000000 2.0000000000");
        let hash = job.record.data_hash.clone();
        assert_eq!(hash, blake3::hash(text.as_bytes()).to_hex().to_string());
        assert_eq!(written(folder.path(), 0.3).expect("again").record.data_hash, hash);
        assert_eq!(Job::open(&job.folder).expect("opened"), job);
    }

    #[test]
    fn steps_of_the_same_job_are_kept_and_those_of_another_removed() {
        let folder = tempfile::tempdir().expect("scratch");
        let job = written(folder.path(), 0.3).expect("written");
        let settings = job.folder.join(LOAD_STEPS_FILE);
        std::fs::write(&settings, "").expect("written");
        written(folder.path(), 0.3).expect("again");
        assert!(settings.exists());
        written(folder.path(), 0.4).expect("another");
        assert!(!settings.exists());
    }

    /// A list of loads that is cut short and then goes on otherwise must not take the states of the first one for its own.
    #[test]
    fn loads_that_are_asked_for_again_are_kept_and_others_never_taken_for_them() {
        let folder = tempfile::tempdir().expect("scratch");
        let job = written(folder.path(), 0.3).expect("written");
        let path = |name: &str| job.folder.join(name);
        let asked = |load: f64| PrescribedLoad { load, dz_angstrom: 1.0, move_hash: format!("{load}") };
        let place = |loads: &[f64]| {
            let loads = PrescribedLoads {
                indenter_zmin_angstrom: 40.0,
                indenter_mass_u: 0.4,
                compression_stiffness_ev_per_angstrom2: 10.0,
                loads: loads.iter().map(|l| asked(*l)).collect(),
                earlier: Vec::new(),
            };
            Job::place(&job.folder, Record { loads: Some(loads), ..job.record.clone() }).expect("placed")
        };
        let run = |from: usize, to: usize| {
            for k in from..=to {
                let before = std::fs::read_to_string(path(LOAD_STEPS_FILE)).unwrap_or_default();
                let before = if before.is_empty() { format!("{HEADER}\n") } else { before };
                let line = format!("{k},0.3,1,-100.5,12,1.5e-03,{k},44.5,45.5,200,1\n");
                std::fs::write(path(LOAD_STEPS_FILE), before + &line).expect("written");
                let frame = "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS pp pp ff\n0 10\n0 10\n0 50\n\
                             ITEM: ATOMS id type x y z\n1 1 5 5 20\n";
                std::fs::write(path(&format!("frame.{k}.dump")), frame).expect("written");
                std::fs::write(path(&format!("restart.{k}")), "a state").expect("written");
            }
        };
        let steps = || load_history::LoadHistory::read(&job.folder).expect("read").steps.len();
        place(&[1.0, 3.0]);
        run(0, 2);
        std::fs::write(path("checkpoint.3.a"), "a state").expect("written");
        // Cut short: all is kept, should the rest be asked for again; and it is.
        let short = place(&[1.0]);
        assert_eq!((steps(), short.record.loads.expect("loads").earlier.len()), (3, 1));
        assert_eq!((place(&[1.0, 3.0]).record.loads.expect("loads").earlier.len(), steps()), (0, 3));
        place(&[1.0]);
        // Another second load: that of the first list is no state of it.
        place(&[1.0, 2.0]);
        assert_eq!(steps(), 2);
        assert!(path("restart.1").exists() && !path("restart.2").exists() && !path("checkpoint.3.a").exists());
        run(2, 2);
        place(&[1.0, 2.0, 3.0]);
        assert_eq!(steps(), 3);
        std::fs::write(path("checkpoint.3.a"), "a state").expect("written");
        place(&[1.0, 2.0, 4.0]);
        assert!(steps() == 3 && !path("checkpoint.3.a").exists());
        place(&[0.5]);
        assert_eq!(steps(), 1);
    }

    #[test]
    fn without_adhesion_no_variable_speaks_of_it() {
        let folder = tempfile::tempdir().expect("scratch");
        let mut job = written(folder.path(), 0.3).expect("written");
        assert!(!job.variables(&[], false).iter().any(|(k, _)| matches!(k.as_str(), "adhesion" | "kappa")));
        job.record.interaction.adhesion =
            Some(Yukawa { amplitude_ev_angstrom: -1.0, kappa_per_angstrom: 2.0, cutoff_angstrom: 7.0 });
        let list = job.variables(&[], true);
        assert!(list.contains(&("adhesion".into(), "1".into())) && list.contains(&("start".into(), "-1".into())));
        // Every variable is one that the script knows.
        for (key, _) in list {
            assert!(DISPLACEMENT_RAMP.text.contains(&format!("\nvariable {key} ")), "{key}");
        }
    }

    #[test]
    fn the_papers_block_needs_what_was_measured() {
        let folder = tempfile::tempdir().expect("scratch");
        let mut job = written(folder.path(), 0.3).expect("written");
        (job.record.deformable, job.record.fixed, job.record.indenter) = (3_062_500, 0, 148_225);
        let gigabytes = job.memory_bytes(1) as f64 / 1e9;
        assert!((1.93..2.9).contains(&gigabytes), "{gigabytes}");
    }

    #[test]
    fn values_without_meaning_are_refused() {
        let folder = tempfile::tempdir().expect("scratch");
        assert!(written(folder.path(), 0.0).is_err());
        assert!(written(folder.path(), f64::NAN).is_err());
    }
}
