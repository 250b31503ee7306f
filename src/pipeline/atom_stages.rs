//! Stages of the atoms: LAMMPS run, analysis of frames, constant-temperature runs, and comparison with the continuum.

use super::atomistic::{self, LammpsOutcome};
use super::comparison::compare;
use super::folder::StageKey;
use super::matched::{Matched, MatchedStage, YieldingStage, crystal_key, pair_key, profile_key};
use super::stage::{EstimatedCost, MachineSpeed, Stage, StageContext, StageKeys};
use super::{methods, nvt};
use crate::Result;
use crate::record::methods::MethodResults;
use crate::record::results::ComparisonResults;
use crate::scene::{AtomsCase, AtomsScene, AtomsStart, Case};
use asperity_atoms::cost::{self, LoadingMode, Relaxer, library_bytes, memory_bytes};
use asperity_atoms::engine::LammpsEngine;
use asperity_atoms::job::Job;
use asperity_atoms::nvt::{MD_STEP_COST_RATIO, NvtSettings};
use asperity_atoms::potential::CALCIUM;
use asperity_atoms::results::{AtomsResults, NvtResults};
use asperity_atoms::scripts::{DISPLACEMENT_RAMP, NVT, PRESCRIBED_LOAD};
use asperity_atoms::unloading::STEP_REFINEMENT;
use asperity_contact::load::LoadStep;
use asperity_methods::all_atom;
use std::path::Path;

/// Name of the stage that runs LAMMPS.
pub(super) const LAMMPS: &str = "lammps";

/// Fraction of the mean gap at first contact that is closed at p* of a few per cent. The mean gap ū falls from 2.63 µm to
/// 0.58 µm at p* = 0.03.
const CLOSED: f64 = 0.8;

/// Length of the unloading branch with refined steps, in ranges of adhesion.
const PULLED_RANGES: f64 = 4.0;

/// Time of the comparison: s per load, and s per load and point. Measured with figures: three loads took 2.0, 2.8 and
/// 11 s on 132², 396² and 1540² grids. The time of figures is counted separately, as the report in [`super::plan`].
const COMPARISON: (f64, f64) = (0.43, 1.44e-6);

/// A case with atoms, and the engine that runs them.
#[derive(Clone, Copy)]
pub(super) struct AtomStages<'a> {
    pub case: &'a Case,
    pub atoms: &'a AtomsCase,
    pub scene: &'a AtomsScene,
    /// None if a run is only planned.
    engine: Option<&'a LammpsEngine>,
    /// What relaxes the atoms.
    relaxer: Relaxer,
}

impl<'a> AtomStages<'a> {
    /// The stages of a run. None for a case without atoms.
    pub(super) fn of(case: &'a Case, engine: Option<&'a LammpsEngine>) -> Option<Self> {
        let minimizer = case.scene.atoms.as_ref()?.minimizer;
        let relaxer = engine.map_or_else(Relaxer::default, |e| e.relaxer(minimizer));
        Some(AtomStages { engine, ..AtomStages::planned(case, relaxer)? })
    }

    /// The stages of a plan. None for a case without atoms.
    pub(super) fn planned(case: &'a Case, relaxer: Relaxer) -> Option<Self> {
        let (atoms, scene) = case.atoms.as_ref().zip(case.scene.atoms.as_ref())?;
        Some(AtomStages { case, atoms, scene, engine: None, relaxer })
    }

    pub(super) fn matched(&self) -> MatchedStage<'a> {
        MatchedStage { case: self.case, atoms: self.atoms, scene: self.scene }
    }

    /// None if the scene gives no hardness of the crystal.
    pub(super) fn yielding(&self) -> Option<YieldingStage<'a>> {
        let hardness_gpa = self.scene.hardness?.to("GPa");
        Some(YieldingStage { case: self.case, atoms: self.atoms, hardness_gpa })
    }

    /// None if the scene requests no constant-temperature runs.
    pub(super) fn nvt(&self) -> Option<NvtStage<'a>> {
        Some(NvtStage { stages: *self, settings: self.atoms.nvt.as_ref()? })
    }

    /// None if the atoms are not among the comparison methods.
    pub(super) fn all_atom(&self) -> Option<AllAtomStage<'a>> {
        methods::wants_atoms(self.case).then_some(AllAtomStage(*self))
    }

    fn engine(&self) -> &'a LammpsEngine {
        self.engine.expect("LAMMPS is looked up before a run")
    }

    /// Loading mode, and its description.
    fn loading(&self) -> (LoadingMode, String) {
        match self.atoms.start {
            AtomsStart::Touch => {
                let (steps, step) = (self.ramp_steps(), self.scene.step_or_default());
                let unloading = if self.atoms.unload { ", loading and unloading" } else { "" };
                (LoadingMode::RampSteps(steps), format!("about {steps:.0} steps of {step} Å{unloading}"))
            }
            AtomsStart::Continuum => {
                let number = self.case.rising_steps().len() + self.case.unloading_steps().len();
                let caption = format!("{number} load{} from the continuum", if number == 1 { "" } else { "s" });
                let force_tolerance = self.scene.force_tolerance.to("eV/Å");
                (LoadingMode::PrescribedLoads { number, force_tolerance }, caption)
            }
        }
    }

    /// Expected displacement steps: those of the loading branch; with unloading the same number again, and the refined
    /// steps before separation.
    fn ramp_steps(&self) -> f64 {
        let (atoms, step) = (self.atoms, self.scene.step_or_default());
        let down = CLOSED * atoms.first_touch_gap_angstrom / step;
        let range = atoms.adhesion.map_or(0.0, |a| 1.0 / a.pair.kappa_per_angstrom);
        match atoms.unload {
            true => 2.0 * down + PULLED_RANGES * range / step * STEP_REFINEMENT as f64,
            false => down,
        }
    }

    fn force_evaluations(&self) -> f64 {
        cost::evaluations(self.atoms.block.cells, self.atoms.block.relaxing_cells(), self.loading().0, self.relaxer)
    }
}

/// Runs LAMMPS at all loads.
pub(super) struct LammpsStage<'a>(pub AtomStages<'a>);

impl Stage for LammpsStage<'_> {
    /// The matched continuum, and the run folder to which its file names are relative.
    type Input<'i> = (&'i Matched, &'i Path);
    type Output = LammpsOutcome;

    fn name(&self) -> String {
        LAMMPS.into()
    }

    fn what(&self) -> String {
        let stages = &self.0;
        let slip = if stages.relaxer == Relaxer::Harmonic { ", more where the crystal slips" } else { "" };
        format!(
            "{} atoms, {}, about {:.0} force evaluations{slip}",
            stages.atoms.atoms(),
            stages.loading().1,
            stages.force_evaluations()
        )
    }

    fn cost(&self, machine: MachineSpeed) -> EstimatedCost {
        let AtomStages { case, atoms, scene, relaxer, .. } = self.0;
        let (total, ranks, mode) = (atoms.atoms(), case.ranks(), self.0.loading().0);
        // Whether there is a library may not be known: the larger of the two.
        let library = library_bytes(&atoms.block, scene.minimizer.may_be_harmonic());
        let (count, each) = (self.0.force_evaluations(), machine.seconds_per_evaluation);
        EstimatedCost {
            bytes: memory_bytes(total, ranks, atoms.start == AtomsStart::Touch) + library.saturating_mul(ranks as u64),
            seconds: cost::seconds(total, count, (mode, relaxer), each, ranks),
        }
    }

    /// `dependencies`: keys of the geometry and of the matched continuum.
    fn keys(&self, dependencies: &[&StageKey]) -> Result<StageKeys> {
        let &AtomStages { case, atoms, scene, .. } = &self.0;
        let [geometry, matched] = dependencies else { unreachable!("two keys") };
        let block = (profile_key(scene), scene.depth_cells, atoms.block.foundation_cells, atoms.block.base);
        let potential = match &atoms.potential {
            Some(path) => StageKey::of_file(path)?,
            None => format!("{CALCIUM:?}"),
        };
        let (script, step) = match atoms.start {
            AtomsStart::Continuum => (PRESCRIBED_LOAD, None),
            AtomsStart::Touch => (DISPLACEMENT_RAMP, Some(scene.step_or_default())),
        };
        // The loads are not part of this key: the job folder determines which finished steps are valid for other loads.
        let program = (block, crystal_key(scene, atoms), potential, self.0.engine().describe(), script.hash());
        let steps = (step, scene.force_tolerance, scene.minimizer, scene.plasticity, pair_key(case));
        let history = StageKey::new("load steps", &(program, steps), &[geometry])?;
        let key = match atoms.start {
            AtomsStart::Continuum => {
                let loads: Vec<f64> = case.load_steps().iter().map(LoadStep::imposed_p_star).collect();
                StageKey::new(LAMMPS, &(loads, atoms.nvt.is_some()), &[&history, matched])?
            }
            // A ramp depends on the loads only through the highest one, where the loading branch ends.
            AtomsStart::Touch => StageKey::new(LAMMPS, &(case.highest_p_star(), atoms.unload), &[&history])?,
        };
        Ok(StageKeys { key, resumes: Some(history) })
    }

    fn run(&self, (matched, root): (&Matched, &Path), context: &StageContext) -> Result<LammpsOutcome> {
        let &AtomStages { case, atoms, .. } = &self.0;
        let solved = (atoms.start == AtomsStart::Continuum).then_some((&matched.compliant, root));
        let job = atomistic::write_job(case, atoms, context.folder, solved)?;
        atomistic::run_lammps(self.0.engine(), &job, context.listener)
    }
}

/// Reads contact, gap and stress from the frames at every load step.
pub(super) struct FramesStage<'a>(pub AtomStages<'a>);

impl Stage for FramesStage<'_> {
    /// Output of the LAMMPS stage, and the run folder.
    type Input<'i> = (&'i LammpsOutcome, &'i Path);
    type Output = AtomsResults;

    fn name(&self) -> String {
        "atoms".into()
    }

    fn what(&self) -> String {
        "contact, gap and frames at every load".into()
    }

    fn cost(&self, _: MachineSpeed) -> EstimatedCost {
        let total = self.0.atoms.atoms();
        EstimatedCost { bytes: 200 * total, seconds: 2e-6 * total as f64 * self.0.case.load_steps().len() as f64 }
    }

    fn keys(&self, dependencies: &[&StageKey]) -> Result<StageKeys> {
        let (case, atoms) = (self.0.case, self.0.atoms);
        let depends = (&case.scene.load, atoms.contact_force, atoms.stress_width_angstrom, StageKey::of_program()?);
        StageKey::new("atoms", &depends, dependencies).map(StageKeys::restarted)
    }

    fn run(&self, (outcome, root): (&LammpsOutcome, &Path), context: &StageContext) -> Result<AtomsResults> {
        let job = Job::open(root.join(LAMMPS))?;
        atomistic::read(self.0.case, self.0.atoms, &job, outcome, context.folder, context.stage)
    }
}

/// Runs the relaxed states at constant temperature.
pub(super) struct NvtStage<'a> {
    stages: AtomStages<'a>,
    settings: &'a NvtSettings,
}

impl Stage for NvtStage<'_> {
    /// The run folder.
    type Input<'i> = &'i Path;
    type Output = NvtResults;

    fn name(&self) -> String {
        nvt::STAGE.into()
    }

    fn what(&self) -> String {
        let loads = self.stages.case.rising_steps().len();
        format!(
            "{loads} load{} at {} K, {} ps each, {} time steps",
            if loads == 1 { "" } else { "s" },
            self.settings.temperature_k,
            self.settings.time_ps,
            self.settings.steps() * loads
        )
    }

    fn cost(&self, machine: MachineSpeed) -> EstimatedCost {
        let (total, ranks) = (self.stages.atoms.atoms(), self.stages.case.ranks());
        let steps = self.settings.steps() * self.stages.case.rising_steps().len();
        let each = machine.seconds_per_evaluation;
        EstimatedCost {
            bytes: memory_bytes(total, ranks, true),
            seconds: MD_STEP_COST_RATIO * total as f64 * each * steps as f64 / ranks as f64,
        }
    }

    fn keys(&self, dependencies: &[&StageKey]) -> Result<StageKeys> {
        let samples =
            StageKey::new(nvt::STAGE, &(self.settings, NVT.hash(), self.stages.engine().describe()), dependencies)?;
        let key = StageKey::new("averages", &StageKey::of_program()?, &[&samples])?;
        Ok(StageKeys { key, resumes: Some(samples) })
    }

    fn run(&self, root: &Path, context: &StageContext) -> Result<NvtResults> {
        let job = Job::open(root.join(LAMMPS))?;
        nvt::run_nvt(
            self.stages.case,
            self.stages.atoms,
            (self.stages.engine(), &job),
            self.settings,
            context.folder,
            context.listener,
        )
    }
}

/// Compares atoms and continuum load by load.
pub(super) struct CompareStage<'a>(pub AtomStages<'a>);

impl Stage for CompareStage<'_> {
    /// Atoms and continuum, and the run folder to which their file names are relative.
    type Input<'i> = (&'i AtomsResults, &'i Matched, &'i Path);
    type Output = ComparisonResults;

    fn name(&self) -> String {
        "compare".into()
    }

    fn what(&self) -> String {
        "maps, areas and gaps of atoms and continuum".into()
    }

    fn cost(&self, _: MachineSpeed) -> EstimatedCost {
        let (points, (load, point)) = (self.0.atoms.matched.points(), COMPARISON);
        let loads = self.0.case.load_steps().len() as f64;
        EstimatedCost { bytes: 24 * points as u64, seconds: loads * (load + point * points as f64) }
    }

    fn keys(&self, dependencies: &[&StageKey]) -> Result<StageKeys> {
        StageKey::new(&self.name(), &(), dependencies).map(StageKeys::restarted)
    }

    fn run(
        &self,
        (atoms, matched, root): (&AtomsResults, &Matched, &Path),
        context: &StageContext,
    ) -> Result<ComparisonResults> {
        compare(self.0.case, self.0.atoms, atoms, matched, root, context.stage)
    }
}

/// Lists the atoms among the comparison methods.
pub(super) struct AllAtomStage<'a>(AtomStages<'a>);

impl Stage for AllAtomStage<'_> {
    /// Results of the atoms, time of LAMMPS in s, and the run folder.
    type Input<'i> = (&'i AtomsResults, f64, &'i Path);
    type Output = MethodResults;

    fn name(&self) -> String {
        format!("method-{}", all_atom::ID)
    }

    fn what(&self) -> String {
        "the atoms as one of the methods".into()
    }

    fn cost(&self, machine: MachineSpeed) -> EstimatedCost {
        FramesStage(self.0).cost(machine)
    }

    fn keys(&self, dependencies: &[&StageKey]) -> Result<StageKeys> {
        StageKey::new(&self.name(), &(), dependencies).map(StageKeys::restarted)
    }

    fn run(
        &self,
        (atoms, seconds, root): (&AtomsResults, f64, &Path),
        context: &StageContext,
    ) -> Result<MethodResults> {
        methods::of_atoms(self.0.case, atoms, seconds, (root, context.folder, context.stage))
    }
}
