//! The plan of a run: its stages with estimated memory and time.

use super::atom_stages::AtomStages;
use super::atomistic::LammpsSpeed;
use super::folder::StageKey;
use super::stage::{MachineSpeed, PlannedStage, Stage};
use super::stages::{self, Made, Visitor};
use crate::Result;
use crate::scene::Case;
use asperity_atoms::cost::{self, Relaxer};
use asperity_atoms::results::AuditLine;
use asperity_grid::sys::expect_memory;
use serde::Serialize;
use std::path::Path;

/// Time of the report's maps and curves: s per load, and s per load and point. Measured: three loads took 0.54, 0.63
/// and 1.2 s on 512², 1024² and 2048² grids.
const REPORT: (f64, f64) = (0.17, 6e-8);

/// The plan of a run.
#[derive(Debug, Serialize)]
pub struct RunPlan {
    pub stages: Vec<PlannedStage>,
    /// Largest memory of any stage, bytes.
    pub bytes: u64,
    pub seconds: f64,
    pub atoms: Option<PlannedAtoms>,
    pub audit: Vec<AuditLine>,
    pub warnings: Vec<String>,
}

#[derive(Debug, Clone, Copy, Serialize)]
pub struct PlannedAtoms {
    pub deformable: u64,
    pub fixed: u64,
    pub indenter: u64,
    /// CPU time of LAMMPS, s per atom and force evaluation. `measured` is true if it was measured on this machine.
    pub seconds_per_evaluation: f64,
    pub measured: bool,
}

impl RunPlan {
    /// `Memory` if the plan needs more than the available memory.
    pub fn fits(&self) -> Result<()> {
        expect_memory("the scene".into(), self.bytes, "a smaller surface.grid or atoms.cells needs less")
    }
}

/// Plans a case on `threads` threads. `lammps` is that of this machine ([`super::speed`]). Without it the plan uses
/// `cost::SECONDS_PER_ATOM_EVALUATION`, measured on another machine, and the time of LAMMPS's own minimisers.
pub fn plan(case: &Case, threads: usize, lammps: Option<LammpsSpeed>) -> Result<RunPlan> {
    let relaxer = lammps.map_or_else(Relaxer::default, |l| l.relaxer);
    planned_by(case, threads, lammps.map(|l| l.seconds_per_evaluation), relaxer)
}

/// As [`plan`]; `evaluation` is the CPU time of LAMMPS, s per atom and force evaluation.
pub(super) fn planned_by(case: &Case, threads: usize, evaluation: Option<f64>, relaxer: Relaxer) -> Result<RunPlan> {
    let seconds_per_evaluation = evaluation.unwrap_or(cost::SECONDS_PER_ATOM_EVALUATION);
    let machine = MachineSpeed { threads, seconds_per_evaluation };
    let atoms = AtomStages::planned(case, relaxer);
    let mut planned = Planner { machine, stages: Vec::new() };
    stages::visit((case, atoms), Path::new(""), None, &mut planned)?;
    let mut stages = planned.stages;
    let drawn = case.atoms.as_ref().map_or(case.model.grid.points(), |a| a.matched.points());
    stages.push(PlannedStage {
        name: "report".into(),
        what: "pictures and curves".into(),
        // Gap and stress of a load in f64, and the smaller pictures.
        bytes: 17 * drawn as u64,
        seconds: case.load_steps().len() as f64 * (REPORT.0 + REPORT.1 * drawn as f64),
    });
    Ok(RunPlan {
        bytes: stages.iter().map(|s| s.bytes).max().unwrap_or(0),
        seconds: stages.iter().map(|s| s.seconds).sum(),
        stages,
        atoms: atoms.map(|atom_stages| PlannedAtoms {
            deformable: atom_stages.atoms.block.deformable(),
            fixed: atom_stages.atoms.block.fixed(),
            indenter: atom_stages.atoms.atoms() - atom_stages.atoms.block.atoms(),
            seconds_per_evaluation,
            measured: evaluation.is_some(),
        }),
        audit: case.atoms.as_ref().map_or(Vec::new(), |a| a.audit.clone()),
        warnings: case.warnings.iter().cloned().chain(of_accuracy(case)).collect(),
    })
}

/// What a plan cannot tell where the grid is chosen for an accuracy.
fn of_accuracy(case: &Case) -> Option<String> {
    case.scene.accuracy()?;
    let grids = case.problem.surface.refinements();
    let ([first, _], [last, _]) = (grids.first()?, grids.last()?);
    let own = case.model.grid.nx;
    Some(format!(
        "the grid is chosen for the accuracy while it is solved, from {first} to at most {last} points along x; memory and time are those of {own}"
    ))
}

/// Plans the stages of a run.
struct Planner {
    machine: MachineSpeed,
    stages: Vec<PlannedStage>,
}

impl Visitor for Planner {
    fn visit<S: Stage>(&mut self, stage: &S, _: &[&StageKey], _: Option<S::Input<'_>>) -> Result<Made<S::Output>> {
        self.stages.push(stage.plan(self.machine));
        Ok(None)
    }
}
