use super::cluster::CommandRequest;
use super::file::{accuracy, refuse_grid};
use super::machine::{LammpsFlags, MachineFlags, submits};
use super::{crystals, output, programs, progress::TerminalProgress};
use crate::Result;
use crate::pipeline::{self, OutFolder};
use crate::record::results;
use crate::report::number::{count, si};
use crate::scene::{Case, Scene};
use asperity_atoms::lammps_command::LammpsCommand;
use asperity_contact::method::Precision;
use asperity_contact::problem::ErrorTargets;
use asperity_grid::units::Measure;
use asperity_surface::import::Fourier;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// What is done with the results that a run folder has.
#[derive(Debug, clap::Args)]
pub(super) struct FolderFlags {
    /// Replace the results of another scene in that folder. Stages that the change does not concern are kept.
    #[arg(long)]
    pub(super) overwrite: bool,
    /// Reuse finished parts of the folder without comparing their files with the stored hashes.
    #[arg(long)]
    pub(super) no_verify: bool,
}

impl FolderFlags {
    pub(super) fn folder<'a>(&self, path: &'a Path) -> OutFolder<'a> {
        OutFolder { path, verify: !self.no_verify, overwrite: self.overwrite }
    }
}

/// Flags of the stages of a run folder, which `sweep` passes to each of its runs.
#[derive(Debug, clap::Args)]
pub(super) struct StageFlags {
    #[command(flatten)]
    pub(super) folder: FolderFlags,
    /// Execute the program that the scene names as atoms.program.
    #[arg(long)]
    pub(super) allow_program: bool,
}

#[derive(Debug, clap::Args)]
pub(super) struct RunArgs {
    /// Scene file (TOML).
    scene: PathBuf,
    /// Run folder. Default: runs/NAME with the scene's name.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    stages: StageFlags,
    #[command(flatten)]
    lammps: LammpsFlags,
    #[command(flatten)]
    machine: MachineFlags,
    /// Leave out the atoms.
    #[arg(long)]
    no_atoms: bool,
    /// Print the stages with their memory and time, without running them.
    #[arg(long)]
    dry_run: bool,
    /// Further methods for the same loads: comma-separated ids from `asperity methods`, or all.
    #[arg(long, alias = "also", value_name = "IDS", value_delimiter = ',', num_args = 1)]
    compare_with: Vec<String>,
    /// Points per side, instead of surface.grid.
    #[arg(long, value_name = "N")]
    grid: Option<usize>,
    /// An id from `asperity methods`, instead of continuum.method.
    #[arg(long, value_name = "ID")]
    method: Option<String>,
    /// f32 or f64, instead of continuum.precision.
    #[arg(long, value_enum)]
    precision: Option<Precision>,
    /// Relative residual at which solvers stop, instead of continuum.tolerance.
    #[arg(long, value_name = "RESIDUAL")]
    tolerance: Option<f64>,
    /// Largest accepted errors, instead of accuracy.error: 5%, or area=2%,mean_gap=1%. The grid is chosen for them.
    #[arg(long, value_name = "ERRORS")]
    error: Option<ErrorTargets>,
    /// Time after which no finer grid is begun, instead of accuracy.budget.
    #[arg(long, value_name = "TIME")]
    budget: Option<Measure>,
    /// Warnings about the surface are errors, and so is an accuracy that is not reached.
    #[arg(long)]
    strict: bool,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

/// The case of a scene on this machine. `allowed`: whether the program that it names may be executed.
///
/// # Errors
/// Those of the crystal's constants and of [`Case::resolve`].
pub(super) fn resolved(mut scene: Scene, file: &Path, lammps: &LammpsCommand, allowed: bool) -> Result<Case> {
    let warnings = crystals::settle(&mut scene, file, lammps, allowed)?;
    let mut case = Case::resolve(scene, file)?;
    case.warnings.extend(warnings);
    case.lammps = lammps.clone();
    Ok(case)
}

impl RunArgs {
    pub(super) fn execute(self) -> Result<ExitCode> {
        let mut scene = Scene::read(&self.scene)?;
        scene.continuum.compare_with.extend(self.compare_with.iter().cloned());
        self.overrule(&mut scene)?;
        let (machine_name, machine) = self.machine.find(&self.lammps)?;
        // A dry run does not execute what the scene names.
        let allowed = self.stages.allow_program && !self.dry_run;
        let mut case = resolved(scene, &self.scene, &machine.lammps, allowed)?;
        if let Some(provenance) = case.provenance() {
            output::eprint(&provenance.to_string());
        }
        if self.dry_run && !submits(&machine) {
            return plan(&case, self.json).map(|()| ExitCode::SUCCESS);
        }
        programs::check(&case, self.stages.allow_program)?;
        // A job finds the pressures itself; until then they do not tell whether the scene is another one.
        let is_job = submits(&machine);
        if !is_job {
            let units = case.given_units();
            pipeline::impose_contact(&mut case, units, &asperity_contact::method::NoObserver)?;
        }
        let out = self.out.clone().unwrap_or_else(|| PathBuf::from("runs").join(&case.scene.name));
        let folder = self.stages.folder.folder(&out);
        if is_job {
            if case.scene.load.contact.is_empty() {
                pipeline::expect_scene(&case, folder)?;
            }
            let (results, machine) = (results::FILE, (machine_name, machine));
            let (dry_run, json) = (self.dry_run, self.json);
            let request = CommandRequest { case: &case, out: &out, machine, results, seconds: None, dry_run, json };
            return request.submit().map(|()| ExitCode::SUCCESS);
        }
        let progress = TerminalProgress::new();
        let (results, page) = pipeline::run(&case, folder, &progress)?;
        drop(progress);
        output::finished(self.json, (&out, &page), ("results", &results), || output::results(&results))?;
        output::ended(&results, page, case.scene.surface.strict)
    }

    /// Sets keys of the scene from flags; they are checked with the scene.
    fn overrule(&self, scene: &mut Scene) -> Result<()> {
        let waves = scene.surface.fourier.is_some_and(Fourier::are_waves);
        refuse_grid(self.grid, scene.surface.heights.as_deref(), !waves)?;
        if self.no_atoms {
            scene.atoms = None;
        }
        let c = &mut scene.continuum;
        scene.surface.grid = self.grid.unwrap_or(scene.surface.grid);
        c.method = self.method.clone().unwrap_or(std::mem::take(&mut c.method));
        c.precision = self.precision.unwrap_or(c.precision);
        c.tolerance = self.tolerance.or(c.tolerance);
        scene.surface.strict |= self.strict;
        if let Some(asked) = accuracy(self.error.as_ref(), self.budget)? {
            let own = scene.accuracy.get_or_insert_default();
            own.error = self.error.clone().unwrap_or(std::mem::take(&mut own.error));
            own.budget = asked.budget.or(own.budget);
        }
        Ok(())
    }
}

/// Prints the stages of a case with their memory and time.
///
/// # Errors
/// `Memory` where they do not fit.
pub(super) fn plan(case: &Case, as_json: bool) -> Result<()> {
    // A plan needs no LAMMPS, but an installed one gives the speed of this machine. That of a scene is not executed.
    let here = case.atoms.as_ref().map(|_| programs::check(case, false).and_then(|()| pipeline::speed(case)));
    let unmeasured = here.as_ref().and_then(|h| h.as_ref().err()).map(|e| e.to_string()).unwrap_or_default();
    let evaluation = here.and_then(Result::ok);
    let plan = pipeline::plan(case, rayon::current_num_threads(), evaluation)?;
    if as_json {
        output::json_line(&plan)?;
        return plan.fits();
    }
    output::plan("stage", &plan);
    if let Some(atoms) = plan.atoms {
        output::print(&format!(
            "atoms: {} deformable, {} of the base, {} of the indenter",
            count(atoms.deformable as usize),
            count(atoms.fixed as usize),
            count(atoms.indenter as usize)
        ));
        let each = si(atoms.seconds_per_evaluation, "s", 2);
        output::print(&if atoms.measured {
            format!("measured on this machine: LAMMPS takes {each} per atom and force evaluation on one core")
        } else {
            format!("{each} per atom and force evaluation is the value of another machine: {unmeasured}")
        });
        output::print(&output::audit(&plan.audit));
    }
    plan.warnings.iter().for_each(|w| output::print(&format!("warning: {w}")));
    plan.fits()
}
