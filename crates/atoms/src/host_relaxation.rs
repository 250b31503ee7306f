//! The relaxation of [`crate::relaxation`] in a LAMMPS that runs as a library: the steps of a job.

use std::time::Instant;

use asperity_contact::interface::{HarmonicBlock, LayerBase};
use asperity_grid::{Error, Result};

use super::block::BaseKind;
use super::cost::pairs_kept;
use super::force_constants::ForceConstants;
use super::job::Job;
use super::job_spec::{FORCE_TOLERANCE, Minimizer};
use super::lammps_library::{AtomProperty, LammpsInstance};
use super::relaxation::{Control, Criteria, Evaluation, ForceField, Relaxation, Relaxed, RigidWall};
use super::scripts::Script;

/// Evaluations after which a state is left to LAMMPS's minimisers. The third literal load of 25 nm, where the crystal slips, has converged after 41,
/// 76 and 87 on three of four surfaces.
const MOST_EVALUATIONS: usize = 120;
/// Largest decrease of energy that is left, over the energy of the wall.
const ENERGY_TOLERANCE: f64 = 1e-5;
/// As in `prescribed_load.in`: of the forces on indenter and base.
const LOAD_TOLERANCE: f64 = 1e-3;
/// A load is relaxed to this part of the tolerance, as in `prescribed_load.in`.
const LOAD_PART: f64 = 0.25;
/// Displacement of a single atom from its site over the lattice constant at whose harmonic force no state is one of the crystal. 2.5 eV/Å in
/// calcium, where loads that converge have states with up to 1.3 eV/Å on the way.
const LIMIT_OF_DISPLACEMENT: f64 = 0.25;
/// Distance that atoms keep from the ends of the box, Å: LAMMPS loses those beyond.
const MARGIN_ANGSTROM: f64 = 0.5;

/// The parts of a job that do not change from step to step.
pub(super) struct HostRelaxation<'a> {
    job: &'a Job,
    constants: &'a ForceConstants,
    /// Whether steps are relaxed harmonically: not where positions and forces may be on a device.
    relaxes: bool,
}

impl<'a> HostRelaxation<'a> {
    pub(super) fn new(job: &'a Job, constants: &'a ForceConstants, accelerated: bool) -> Self {
        HostRelaxation { job, constants, relaxes: job.relaxes_harmonically() && !accelerated }
    }

    /// Runs a step of the job from the state to which `set_up` brings LAMMPS, at about the mean pressure `pressure` (eV/Å³).
    ///
    /// # Errors
    /// `Lammps`, and those of `set_up`.
    pub(super) fn step(
        &self,
        lammps: &mut LammpsInstance,
        set_up: &dyn Fn(&mut LammpsInstance) -> Result<()>,
        script: &Script,
        (step, pressure): (usize, f64),
    ) -> Result<()> {
        set_up(lammps)?;
        let failed = |description: String| Error::lammps(&self.job.folder, description);
        let Some([start, relax, end]) = script.parts().filter(|_| self.relaxes) else {
            return lammps.file(script.file).map_err(failed);
        };
        let own = if self.job.spec.protocol.ramp().is_some() { "cg" } else { "fire" };
        // A checkpoint is of LAMMPS's own minimiser, to which the step was handed over.
        if lammps.value("v_resume_mid").map_err(failed)? != 0.0 {
            let handed_over = record(lammps, &format!("harmonic+{own}"), 0, None);
            return handed_over.and_then(|()| lammps.file(script.file)).map_err(failed);
        }
        lammps.file(start.file).map_err(failed)?;
        let strict = self.job.spec.settings.minimizer == Minimizer::Harmonic;
        let Some(relaxed) = self.relax(lammps, step, pressure, MOST_EVALUATIONS)? else {
            if strict {
                let text = format!("the crystal of step {step} has no force constants; use minimizer = \"auto\"");
                return Err(failed(text));
            }
            let files = [relax.file, end.file];
            return record(lammps, own, 0, None)
                .and_then(|()| files.iter().try_for_each(|f| lammps.file(f)))
                .map_err(failed);
        };
        if !relaxed.converged {
            if strict {
                let text =
                    format!("the harmonic relaxation of step {step} ended at {relaxed}; use minimizer = \"auto\"");
                return Err(failed(text));
            }
            if !relaxed.is_near() {
                // From the start, as LAMMPS's own minimiser would without this relaxation.
                set_up(lammps)?;
                keep_state(lammps, false).and_then(|()| lammps.file(start.file)).map_err(failed)?;
                keep_state(lammps, self.starts_from_previous()).map_err(failed)?;
            }
            lammps.file(relax.file).map_err(failed)?;
        }
        let Relaxed { converged, evaluations, rejected, .. } = relaxed;
        let minimizer = if converged { "harmonic".to_string() } else { format!("harmonic+{own}") };
        // Of the state at which the other minimiser ended, from one evaluation there.
        let ended = if converged { Some(relaxed) } else { self.relax(lammps, step, pressure, 1)? };
        record(lammps, &minimizer, rejected, ended.map(|e| e.predicted_decrease)).map_err(failed)?;
        // The form in which LAMMPS's minimisers report theirs.
        let counted = format!("print \"Iterations, force evaluations = {evaluations} {evaluations}\"");
        lammps.command(&counted).and_then(|()| lammps.file(end.file)).map_err(failed)
    }

    /// Whether a load starts from the state of the previous one, not from the continuum's displacements: these do not change an elastic state. A
    /// base that the continuum displaces needs them.
    fn starts_from_previous(&self) -> bool {
        self.relaxes && self.job.spec.block.base != BaseKind::Prescribed
    }

    /// Sets what all steps use.
    ///
    /// # Errors
    /// `Lammps`.
    pub(super) fn begin(&self, lammps: &mut LammpsInstance) -> Result<()> {
        keep_state(lammps, self.starts_from_previous()).map_err(|text| Error::lammps(&self.job.folder, text))
    }

    /// Relaxes the state in which LAMMPS is, at step `step` under about the mean pressure `pressure` (eV/Å³), in at most `most` evaluations. `None`:
    /// there is no model of the crystal.
    ///
    /// # Errors
    /// `Lammps`.
    fn relax(&self, lammps: &mut LammpsInstance, step: usize, pressure: f64, most: usize) -> Result<Option<Relaxed>> {
        let started = Instant::now();
        let spec = &self.job.spec;
        let block = self.job.block();
        let failed = |description: String| Error::lammps(&self.job.folder, description);
        let first = if block.base == BaseKind::Elastic { 0 } else { block.base_layers };
        let base = match block.base {
            BaseKind::Elastic => LayerBase::Crystal { missing: block.missing_layers() },
            BaseKind::Rigid | BaseKind::Prescribed => LayerBase::Rigid,
        };
        // Under a tension beyond the measured strains, as at a pull-off, there is no model.
        let Ok(strain) = self.constants.strain_at(pressure) else { return Ok(None) };
        let constants = self.constants.at(strain);
        let layers = block.layers() - first;
        // Neither has a crystal that is not stable at this strain.
        let Ok(crystal) = HarmonicBlock::<f32>::new(block.cells, layers, &constants, base) else {
            return Ok(None);
        };
        let [_, field_bytes] = HarmonicBlock::<f32>::bytes(block.cells, layers, constants.reach);
        let pairs = pairs_kept(field_bytes);
        let force_limit = LIMIT_OF_DISPLACEMENT * block.a0 * constants.stiffness_of_a_site();
        let mut positions = Vec::new();
        lammps.gather(AtomProperty::Position, &mut positions).map_err(failed)?;
        let heights = positions[block.atoms() as usize..].iter().map(|x| x[2]).collect();
        let wall = RigidWall::new(spec.indenter_points, spec.indenter_spacing_angstrom, spec.interaction, heights);
        let indices = (first..block.layers()).map(|l| block.half_cell_indices(l).collect()).collect();
        let relaxation = Relaxation::new(
            crystal,
            indices,
            block.cells,
            (wall, block.base_layers.saturating_sub(first)),
            (pairs, force_limit),
        );
        let load = spec.protocol.prescribed().and_then(|l| Some(l.loads.get(step.checked_sub(1)?)?.load));
        let tolerance = spec.settings.force_tolerance;
        let criteria = Criteria {
            force: match load {
                Some(_) => LOAD_PART * tolerance,
                // A residual force left in the free block would have to be relaxed again at each load.
                None => tolerance.min(FORCE_TOLERANCE),
            },
            balance: LOAD_TOLERANCE,
            energy: ENERGY_TOLERANCE,
            evaluations: most,
        };
        let mut forces = LammpsForces {
            lammps,
            first: first * block.atoms_per_layer() as usize,
            free: layers * block.atoms_per_layer() as usize,
            all: block.atoms() as usize,
            started: false,
            positions,
            seconds: 0.0,
        };
        let control = load.map_or(Control::Height, Control::Load);
        let relaxed = relaxation.relax(&mut forces, control, criteria).map_err(failed)?;
        let seconds = forces.seconds;
        let besides = started.elapsed().as_secs_f64() - seconds;
        let line =
            format!("harmonic relaxation: {relaxed}; {seconds:.3} s of force evaluations, {besides:.3} s besides");
        // LAMMPS cuts letters beyond ASCII.
        lammps.command(&format!("print \"{line}\"").replace('Å', "A")).map_err(failed)?;
        Ok(Some(relaxed))
    }
}

/// Sets what `end_of_step.in` writes of a relaxation.
fn record(
    lammps: &mut LammpsInstance,
    minimizer: &str,
    rejected: usize,
    predicted_decrease: Option<f64>,
) -> std::result::Result<(), String> {
    let decrease = predicted_decrease.map_or("\"\"".to_string(), |d| format!("{d:.3e}"));
    let values =
        [("minimizer", minimizer.to_string()), ("rejected", rejected.to_string()), ("predicted_decrease", decrease)];
    values.iter().try_for_each(|(name, value)| {
        lammps.command(&format!("variable {name} delete"))?;
        lammps.command(&format!("variable {name} index {value}"))
    })
}

/// Whether the next load starts from the state of the previous one.
fn keep_state(lammps: &mut LammpsInstance, keep: bool) -> std::result::Result<(), String> {
    lammps.command("variable keep_state delete")?;
    lammps.command(&format!("variable keep_state index {}", u8::from(keep)))
}

/// A LAMMPS in which `setup.in` and the start of a step have run.
struct LammpsForces<'l> {
    lammps: &'l mut LammpsInstance,
    /// Free atoms: the first, and their number. Atoms of the block.
    first: usize,
    free: usize,
    all: usize,
    /// Whether lists of neighbours exist.
    started: bool,
    positions: Vec<[f64; 3]>,
    /// Of all evaluations.
    seconds: f64,
}

impl ForceField for LammpsForces<'_> {
    fn evaluate(&mut self, displacements: &[[f64; 3]], lift: f64) -> std::result::Result<Option<Evaluation>, String> {
        let started = Instant::now();
        let evaluation = self.evaluate_now(displacements, lift);
        self.seconds += started.elapsed().as_secs_f64();
        evaluation
    }
}

impl LammpsForces<'_> {
    fn evaluate_now(
        &mut self,
        displacements: &[[f64; 3]],
        lift: f64,
    ) -> std::result::Result<Option<Evaluation>, String> {
        if self.started {
            let free = &mut self.positions[self.first..self.first + self.free];
            free.iter_mut().zip(displacements).for_each(|(x, d)| (0..3).for_each(|c| x[c] += d[c]));
            self.positions[self.all..].iter_mut().for_each(|x| x[2] += lift);
            if !self.within_box()? {
                // Back to where LAMMPS has them.
                self.lammps.gather(AtomProperty::Position, &mut self.positions)?;
                return Ok(None);
            }
            self.lammps.scatter_positions(&mut self.positions)?;
            self.lammps.command("run 1 pre no post no")?;
        } else {
            self.lammps.command("run 0 post no")?;
            self.started = true;
        }
        // LAMMPS may have wrapped positions.
        self.lammps.gather(AtomProperty::Position, &mut self.positions)?;
        let mut forces = Vec::new();
        self.lammps.gather(AtomProperty::Force, &mut forces)?;
        Ok(Some(Evaluation {
            energy: self.lammps.value("pe")?,
            positions: self.positions[self.first..self.first + self.free].to_vec(),
            forces: forces[self.first..self.first + self.free].to_vec(),
            on_indenter: self.lammps.value("f_indenter[3]")?,
            on_base: self.lammps.value("f_base[3]")?,
        }))
    }

    /// Whether no atom is near the ends of the box, where LAMMPS would lose it.
    fn within_box(&self) -> std::result::Result<bool, String> {
        let [floor, ceiling] = self.lammps.floor_and_ceiling()?;
        let inside = |x: &[f64; 3]| x[2] >= floor + MARGIN_ANGSTROM && x[2] <= ceiling - MARGIN_ANGSTROM;
        Ok(self.positions.iter().all(inside))
    }
}
