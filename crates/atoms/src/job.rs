//! Job folder of one LAMMPS run; it can also be run by hand.
//!
//! Files: `block.data` (the atoms), the script and the scripts that it includes, `potential.eam.alloy` (a copy),
//! `job.json` (all variables and counts), `run.sh` and `in.vars` (its command line with LAMMPS's own minimisers; not with an elastic base), and
//! `move.K.dump` for prescribed loads. The run adds `load_steps.csv`, `frame.K.dump`, `restart.K` and its logs.

use std::path::{Path, PathBuf};

use super::block::{BaseKind, Block};
use super::cost::{library_bytes, memory_bytes};
use super::data_file::write_data;
use super::indenter::Indenter;
use super::initial_configuration::{InitialConfiguration, PrescribedLoad, PrescribedLoads};
use super::interaction::Interaction;
use super::job_files::{lock, remove_run_script, write_run_script};
use super::job_spec::{DisplacementRamp, JobSpec, LoadingProtocol, RelaxationSettings, check, is_symbol};
use super::load_history::{self, Between, Bracket, LOAD_STEPS_FILE, LoadHistory, StepRecord};
use super::minimizer_checkpoint;
use super::nvt::{NvtRun, NvtSettings, RELAXED};
use super::scripts::{self, Script};
use super::unloading::{self, MAX_RISE_ANGSTROM, UnloadingState};
use asperity_grid::{Error, Result};
use asperity_surface::files::atomic_file::{
    self, create_folder, link_or_copy, list, put, read_bytes, read_text, remove,
};
use asperity_surface::files::hashed::file_hash;

pub const DATA_FILE: &str = "block.data";
pub const POTENTIAL_FILE: &str = "potential.eam.alloy";
pub const SPEC_FILE: &str = "job.json";

/// Skin of LAMMPS's lists of neighbours in the scripts, Å.
const SKIN_ANGSTROM: f64 = 0.8;

/// The crystal of the block: file of the EAM table, its element, and the mass of an atom.
#[derive(Debug, Clone, Copy)]
pub struct JobCrystal<'a> {
    pub potential: &'a Path,
    pub element: &'a str,
    pub mass_u: f64,
}

/// Loading of a new job.
#[derive(Debug, Clone, Copy)]
pub enum Loading<'a> {
    Ramp(DisplacementRamp),
    /// Rising loads, optionally followed by falling ones; each step starts from its initial configuration.
    Prescribed(&'a [InitialConfiguration]),
}

/// A job folder that is ready to run.
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    pub folder: PathBuf,
    pub spec: JobSpec,
}

impl Job {
    /// Writes a job folder. Finished steps of an earlier run of the same job are kept; those of any other job are
    /// removed.
    ///
    /// # Errors
    /// `Input` for values that LAMMPS cannot use, `Io`.
    pub fn write(
        folder: impl AsRef<Path>,
        block: &Block,
        indenter: &Indenter,
        crystal: JobCrystal,
        interaction: Interaction,
        settings: RelaxationSettings,
        loading: Loading,
    ) -> Result<Job> {
        let folder = folder.as_ref();
        let ramp = if let Loading::Ramp(ramp) = &loading { Some(ramp) } else { None };
        check(&interaction, &settings, ramp, crystal.element, crystal.mass_u)?;
        create_folder(folder)?;
        let _lock = lock(folder)?;
        let table = read_bytes(crystal.potential)?;
        put(folder, POTENTIAL_FILE, &table)?;
        let data = folder.join(DATA_FILE);
        let max_rise = if ramp.is_some_and(|r| r.unload) { MAX_RISE_ANGSTROM } else { 0.0 };
        let data_hash = write_data(atomic_file::create(&data)?, block, indenter, max_rise, crystal.mass_u)
            .map_err(Error::io("write", &data))?;
        let protocol = match loading {
            Loading::Ramp(ramp) => LoadingProtocol::Ramp(ramp),
            Loading::Prescribed(list) => {
                LoadingProtocol::Prescribed(PrescribedLoads::write(folder, block, indenter, crystal.mass_u, list)?)
            }
        };
        let spec = JobSpec {
            element: crystal.element.into(),
            block: *block,
            deformable: block.deformable(),
            fixed: block.fixed(),
            indenter: indenter.atoms(),
            indenter_points: indenter.points(),
            indenter_spacing_angstrom: indenter.spacing(),
            indenter_start_z_angstrom: indenter.start_z(),
            frame_depth_angstrom: 0.5 * block.a0 * (settings.frame_layers as f64 - 0.5),
            interaction,
            settings,
            script_hash: script(&protocol).hash(),
            protocol,
            data_hash,
            potential_hash: blake3::hash(&table).to_hex().to_string(),
        };
        Job::place(folder, spec)
    }

    /// Writes the folder of an NVT run of the relaxed states of `relaxed` at its rising loads, whose restart files
    /// must exist. Loads finished by an earlier run of the same job are kept.
    ///
    /// # Errors
    /// `Io`; `Format` if `relaxed` has no such states.
    pub fn write_nvt(folder: &Path, relaxed: &Job, block: &Block, settings: &NvtSettings) -> Result<Job> {
        create_folder(folder)?;
        let _lock = lock(folder)?;
        let history = LoadHistory::read(&relaxed.folder)?;
        let loads = relaxed.spec.protocol.prescribed().filter(|l| history.steps.len() > l.peak());
        let loads = loads.ok_or_else(|| {
            let accepted = "a job with prescribed loads that has run";
            Error::format(&relaxed.folder, "no relaxed states at prescribed loads", accepted)
        })?;
        let place = |from: PathBuf, to: PathBuf| link_or_copy(&from, &to);
        let count = loads.peak();
        for k in 0..count {
            let state = relaxed.folder.join(format!("restart.{}", k + 1));
            place(state, folder.join(format!("{RELAXED}.{k}")))?;
        }
        place(relaxed.folder.join(POTENTIAL_FILE), folder.join(POTENTIAL_FILE))?;
        let file = relaxed.folder.join(LOAD_STEPS_FILE);
        let steps = read_bytes(&file)?;
        let hash = blake3::hash(&steps).to_hex().to_string();
        let run = NvtRun::new(settings, block, loads.loads[..count].iter().map(|l| l.load), hash);
        let spec =
            JobSpec { protocol: LoadingProtocol::Nvt(run), script_hash: scripts::NVT.hash(), ..relaxed.spec.clone() };
        Job::place(folder, spec)
    }

    /// Writes scripts and `job.json` into a folder that has all other files. Steps of a different job are removed.
    fn place(folder: &Path, mut spec: JobSpec) -> Result<Job> {
        let earlier = Job::open(folder).ok().map(|job| job.spec);
        let in_common = match (&mut spec.protocol, earlier.as_ref().map(|e| &e.protocol)) {
            (LoadingProtocol::Prescribed(now), Some(LoadingProtocol::Prescribed(then))) => now.go_on_after(then),
            _ => None,
        };
        let job = Job { folder: folder.to_path_buf(), spec };
        for script in std::iter::once(job.script()).chain(job.script().included()) {
            put(folder, script.file, script.text)?;
        }
        let file = folder.join(SPEC_FILE);
        let text = serde_json::to_string_pretty(&job.spec).map_err(|e| Error::io("write", &file)(e.into()))?;
        let same = earlier.is_some_and(|earlier| job.spec.shares_steps_with(earlier, in_common.is_some()));
        match in_common {
            _ if !same => remove_states(folder)?,
            Some(loads) => load_history::keep_first(folder, loads + 1)?,
            None => {}
        }
        put(folder, SPEC_FILE, text)?;
        // `lmp` alone cannot run a block on an elastic base.
        match job.spec.block.base {
            BaseKind::Elastic => remove_run_script(folder),
            _ => write_run_script(folder, job.script().file, &job.variables_by_hand())?,
        }
        Ok(job)
    }

    /// Opens a folder that [`Job::write`] wrote.
    ///
    /// # Errors
    /// `Io`; `Format` if `job.json` does not describe a job.
    pub fn open(folder: impl AsRef<Path>) -> Result<Job> {
        let folder = folder.as_ref().to_path_buf();
        let file = folder.join(SPEC_FILE);
        let text = read_text(&file)?;
        let spec: JobSpec =
            serde_json::from_str(&text).map_err(|e| Error::format(&file, e, "the specification of a job"))?;
        if !is_symbol(&spec.element) {
            return Err(Error::format(&file, format!("the element {:?}", spec.element), "a chemical symbol"));
        }
        Ok(Job { folder, spec })
    }

    /// Checks the atoms and the potential against the hashes of `job.json`. LAMMPS itself reports missing ones.
    ///
    /// # Errors
    /// `Lammps`, which names the file; `Io`.
    pub fn check_inputs(&self) -> Result<()> {
        let atoms = (DATA_FILE, &self.spec.data_hash);
        let relaxes = !matches!(self.spec.protocol, LoadingProtocol::Nvt(_));
        let table = (POTENTIAL_FILE, &self.spec.potential_hash);
        for (name, written) in relaxes.then_some(atoms).into_iter().chain([table]) {
            let file = self.folder.join(name);
            if file.exists() && file_hash(&file)? != *written {
                let description = format!("{name} changed since the job was written; `atoms build` writes it again");
                return Err(Error::lammps(&self.folder, description));
            }
        }
        Ok(())
    }

    /// Checks that the scripts of the folder, which LAMMPS executes, are those of this program: a script can start any
    /// program.
    ///
    /// # Errors
    /// `Format`, which names the file and the remedy; `Io`.
    pub fn check_scripts(&self) -> Result<()> {
        for script in std::iter::once(self.script()).chain(self.script().included()) {
            let file = self.folder.join(script.file);
            if read_text(&file)? != script.text {
                let accepted = "the script that `asperity atoms build` writes (run.sh runs a script of your own)";
                return Err(Error::format(&file, "not the script of this program", accepted));
            }
        }
        Ok(())
    }

    /// Deformable, fixed and indenter atoms together.
    pub fn atoms(&self) -> u64 {
        self.spec.deformable.saturating_add(self.spec.fixed).saturating_add(self.spec.indenter)
    }

    /// Resident memory of all LAMMPS ranks together, bytes; with the harmonic relaxation, unless the job excludes it.
    pub fn memory_bytes(&self, ranks: usize) -> u64 {
        let library = library_bytes(&self.spec.block, self.relaxes_harmonically());
        self.lammps_bytes(ranks).saturating_add(library.saturating_mul(ranks as u64))
    }

    /// The same without what a host adds to LAMMPS.
    pub(super) fn lammps_bytes(&self, ranks: usize) -> u64 {
        memory_bytes(self.atoms(), ranks, self.spec.protocol.prescribed().is_none())
    }

    /// Whether its steps are relaxed harmonically, where the library of LAMMPS can be loaded.
    pub(super) fn relaxes_harmonically(&self) -> bool {
        self.spec.settings.minimizer.may_be_harmonic() && self.spec.protocol.nvt().is_none()
    }

    /// Mean pressure at which the elastic base is linearised in a step, eV/Å³: that of the prescribed load, or of the previous step of a
    /// ramp, `previous` (eV/Å).
    pub fn pressure_at(&self, step: usize, previous: f64) -> f64 {
        let load = match self.spec.protocol.prescribed() {
            Some(loads) => step.checked_sub(1).and_then(|k| loads.loads.get(k)).map_or(0.0, |l| l.load),
            None => previous,
        };
        load / self.block().length().powi(2)
    }

    /// Highest mean pressure of the job, eV/Å³.
    pub fn highest_pressure(&self) -> f64 {
        let load = match &self.spec.protocol {
            LoadingProtocol::Ramp(ramp) => ramp.max_load,
            LoadingProtocol::Prescribed(loads) => loads.loads.iter().map(|l| l.load).fold(0.0, f64::max),
            LoadingProtocol::Nvt(run) => run.loads.iter().copied().fold(0.0, f64::max),
        };
        load / self.block().length().powi(2)
    }

    /// The block of atoms.
    pub fn block(&self) -> Block {
        self.spec.block
    }

    /// The script that LAMMPS runs.
    pub fn script(&self) -> Script {
        script(&self.spec.protocol)
    }

    /// `-var` pairs of the script for a run that continues after `finished_steps`.
    pub fn variables(&self, finished_steps: &[StepRecord], compressed: bool) -> Vec<(String, String)> {
        let JobSpec { interaction, settings, .. } = &self.spec;
        let mut list = vec![
            ("potential", POTENTIAL_FILE.to_string()),
            ("element", self.spec.element.clone()),
            ("epsilon", interaction.epsilon_ev.to_string()),
            ("sigma", interaction.sigma_angstrom.to_string()),
            ("contact", settings.contact_angstrom.to_string()),
            ("frame_depth", self.spec.frame_depth_angstrom.to_string()),
            ("start", finished_steps.last().map_or("-1".to_string(), |r| r.step.to_string())),
        ];
        // Lists of neighbours end a skin beyond the cut-off of the repulsion.
        let skin = settings.contact_angstrom - interaction.touch_angstrom() + 0.5 * SKIN_ANGSTROM;
        if skin > SKIN_ANGSTROM {
            list.push(("skin", skin.to_string()));
        }
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
        if self.spec.block.base == BaseKind::Elastic {
            list.push(("elastic_base", "1".into()));
        }
        let relaxes = !matches!(self.spec.protocol, LoadingProtocol::Nvt(_));
        if relaxes {
            list.push(("data", DATA_FILE.to_string()));
            list.push(("ftol", settings.force_tolerance.to_string()));
            list.push(("keep_all", u8::from(settings.keep_restarts).to_string()));
        }
        let mut own = Vec::new();
        match &self.spec.protocol {
            LoadingProtocol::Ramp(ramp) => {
                list.push(("dz", ramp.step_angstrom.to_string()));
                list.push(("max_load", ramp.max_load.to_string()));
                list.push(("steps", ramp.max_steps.to_string()));
                if ramp.unload {
                    list.extend(unloading::variables(self.unloading_state(finished_steps).zip(finished_steps.last())));
                }
            }
            LoadingProtocol::Prescribed(loads) => {
                if self.spec.block.foundation_cells > 0 {
                    list.push(("moving_base", "1".into()));
                }
                if self.spec.block.base == BaseKind::Elastic {
                    list.push(("base_share", loads.base_share.to_string()));
                }
                own = loads.variables();
            }
            LoadingProtocol::Nvt(run) => own = run.variables(),
        }
        list.into_iter().map(|(key, value)| (key.to_string(), value)).chain(own).collect()
    }

    /// The same for a run from the first step on one rank, checkpoints included.
    fn variables_by_hand(&self) -> Vec<(String, String)> {
        let often = self.spec.protocol.prescribed().map(|_| {
            let often = minimizer_checkpoint::iterations(minimizer_checkpoint::INTERVAL, self.atoms(), 1);
            ("restart_every".to_string(), often.to_string())
        });
        self.variables(&[], false).into_iter().chain(often).collect()
    }

    /// Step of the peak load, if it is finished and the job unloads.
    pub fn reversal_step(&self, records: &[StepRecord]) -> Option<usize> {
        match &self.spec.protocol {
            LoadingProtocol::Ramp(ramp) if ramp.unload => peak_step(ramp, records),
            LoadingProtocol::Prescribed(loads) => {
                let peak = loads.peak();
                (peak < loads.loads.len() && records.len() > peak).then_some(peak)
            }
            _ => None,
        }
    }

    /// Last step of the job, if it is finished.
    pub fn end(&self, records: &[StepRecord]) -> Option<usize> {
        match &self.spec.protocol {
            LoadingProtocol::Ramp(ramp) if ramp.unload => self.unloading_state(records)?.end,
            LoadingProtocol::Ramp(ramp) => peak_step(ramp, records),
            LoadingProtocol::Prescribed(loads) => (records.len() > loads.loads.len()).then_some(loads.loads.len()),
            LoadingProtocol::Nvt(run) => (records.len() >= run.loads.len()).then(|| run.loads.len() - 1),
        }
    }

    /// The atoms at a load (eV/Å) of the loading branch: the step with this prescribed load, or, for a displacement
    /// ramp, interpolated between two steps.
    ///
    /// # Errors
    /// `Format` when the job does not reach the load or a frame is damaged; `Io` when a frame is missing.
    pub fn at_load(&self, history: &LoadHistory, load: f64) -> Result<Between> {
        let bracket = match self.spec.protocol.prescribed() {
            Some(loads) => own_step(history, 1, &loads.loads[..loads.peak()], load),
            None => history.bracket(load, self.reversal_step(&history.steps)),
        };
        history.at(&self.folder, bracket, load)
    }

    /// The atoms at a load (eV/Å) of the unloading branch.
    ///
    /// # Errors
    /// As [`Self::at_load`].
    pub fn at_load_unloading(&self, history: &LoadHistory, load: f64) -> Result<Between> {
        let bracket = match self.spec.protocol.prescribed() {
            Some(loads) => own_step(history, 1 + loads.peak(), &loads.loads[loads.peak()..], load),
            None => self.reversal_step(&history.steps).and_then(|turn| history.bracket_unloading(load, turn)),
        };
        history.at(&self.folder, bracket, load)
    }

    /// The unloading branch of a displacement ramp, as far as it is finished.
    pub fn unloading_state(&self, records: &[StepRecord]) -> Option<UnloadingState> {
        self.spec.protocol.ramp()?;
        let reversal_step = self.reversal_step(records)?;
        Some(UnloadingState::of(records, reversal_step, self.spec.interaction.adhesion.is_some()))
    }
}

fn script(protocol: &LoadingProtocol) -> Script {
    match protocol {
        LoadingProtocol::Ramp(_) => scripts::DISPLACEMENT_RAMP,
        LoadingProtocol::Prescribed(_) => scripts::PRESCRIBED_LOAD,
        LoadingProtocol::Nvt(_) => scripts::NVT,
    }
}

/// The first step of a ramp at its maximum load or number of steps.
fn peak_step(ramp: &DisplacementRamp, records: &[StepRecord]) -> Option<usize> {
    records.iter().find(|r| r.load >= ramp.max_load || r.step >= ramp.max_steps).map(|r| r.step)
}

/// The step of `load` among the `prescribed` loads of the steps from `first` on, if it is finished. Loads are
/// compared exactly: both are computed from the same p*.
fn own_step(history: &LoadHistory, first: usize, prescribed: &[PrescribedLoad], load: f64) -> Option<Bracket> {
    let lower = first + prescribed.iter().position(|a| (a.load - load).abs() <= 1e-9 * load.abs())?;
    (lower < history.steps.len()).then_some(Bracket { lower, weight: 0.0 })
}

/// Removes the files of a run: load steps, frames, restart files, checkpoints and logs.
fn remove_states(folder: &Path) -> Result<()> {
    for (name, path) in list(folder)? {
        if name == LOAD_STEPS_FILE
            || ["frame.", "restart.", "log.", minimizer_checkpoint::PREFIX].iter().any(|start| name.starts_with(start))
        {
            remove(&path)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
