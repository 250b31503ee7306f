//! `asperity sweep` and `asperity ensemble`: one scene with varied keys.

use super::cluster::{Request, program_of};
use super::machine::{LammpsFlags, MachineFlags, own_command, submits};
use super::point::PointCommand;
use super::run::StageFlags;
use super::sweep_table::print;
use super::{crystals, output, programs, progress};
use crate::cluster::{Machine, Workflow, WorkflowInput};
use crate::pipeline::Crystals;
use crate::pipeline::sweep::{self, ChangeScene, PointFolder, RANGE, Sweep as Points, SweepListener, whole_numbers};
use crate::record::results;
use crate::report::number::{duration, memory};
use crate::scene::Scene;
use crate::{Error, Result};
use asperity_contact::method::Device;
use asperity_surface::files::atomic_file::{create_folder, put};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU8, Ordering};

#[derive(Debug, clap::Args)]
pub(super) struct SweepArgs {
    /// File of the sweep (TOML): scene = "FILE" and the keys that vary under [over].
    file: PathBuf,
    #[command(flatten)]
    flags: SweepFlags,
}

#[derive(Debug, clap::Args)]
pub(super) struct EnsembleArguments {
    /// Scene file (TOML).
    scene: PathBuf,
    /// Seeds of the surface: "1..12" or "1,5,7".
    #[arg(long, value_name = "SEEDS")]
    seeds: String,
    #[command(flatten)]
    flags: SweepFlags,
}

#[derive(Debug, clap::Args)]
struct SweepFlags {
    /// Folder of the sweep. Default: runs/NAME-sweep.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Points that run at once. Default: one for each core, as many as memory permits.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    #[command(flatten)]
    machine: MachineFlags,
    #[command(flatten)]
    stages: StageFlags,
    #[command(flatten)]
    lammps: LammpsFlags,
    /// Leave out the atoms.
    #[arg(long)]
    no_atoms: bool,
    /// Write the points as the file of a workflow program, without running them: it runs them with the resources of --machine.
    #[arg(long, value_enum, value_name = "PROGRAM", conflicts_with_all = ["dry_run", "jobs"])]
    export: Option<Workflow>,
    /// Print the points with their memory and time, without running them.
    #[arg(long)]
    dry_run: bool,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

impl SweepArgs {
    pub(super) fn execute(self) -> Result<ExitCode> {
        let points = self.flags.with_changes(|changes| Points::read(&self.file, changes))?;
        self.flags.execute(&points)
    }
}

impl EnsembleArguments {
    pub(super) fn execute(self) -> Result<ExitCode> {
        let wrong = || Error::input("command line", "--seeds", &self.seeds, RANGE);
        let seeds = whole_numbers(&self.seeds).filter(|s| s.iter().all(|s| *s >= 0)).ok_or_else(wrong)?;
        let surface = Scene::read(&self.scene)?.surface;
        if let Some(heights) = surface.heights.as_ref().filter(|_| !surface.has_seed()) {
            let found = format!("{} with surface.heights = {}", self.scene.display(), heights.display());
            let accepted = "a scene with a synthesised surface, or with surface.extend_to or surface.isotropic_map";
            return Err(Error::input("command line", "--seeds", found, accepted));
        }
        let points = self.flags.with_changes(|changes| Points::ensemble(&self.scene, &seeds, changes))?;
        self.flags.execute(&points)
    }
}

impl SweepFlags {
    /// Points whose scenes are changed as the flags say, with the constants of their potentials.
    fn with_changes(&self, read: impl FnOnce(&ChangeScene) -> Result<Points>) -> Result<Points> {
        let here = self.machine.find(&self.lammps)?.1.lammps;
        let permit =
            |scene: &Scene, file: &Path| programs::check_scene((scene, file), &here, self.stages.allow_program);
        let measured = Crystals::new(&here, &permit);
        read(&|scene, file| {
            if self.no_atoms {
                scene.atoms = None;
            }
            let warnings = crystals::settle_with(&measured, scene, file)?;
            warnings.iter().for_each(|text| output::warn(text));
            Ok(())
        })
    }

    fn execute(&self, sweep: &Points) -> Result<ExitCode> {
        let out = self.out.clone().unwrap_or_else(|| PathBuf::from("runs").join(format!("{}-sweep", sweep.name)));
        let machine = self.machine.find(&self.lammps)?;
        if let Some(workflow) = self.export {
            return self.export(sweep, &out, &machine.1, workflow).map(|()| ExitCode::SUCCESS);
        }
        if submits(&machine.1) {
            if self.jobs.is_some() {
                let accepted = format!("at_once of the machine {}", machine.0);
                return Err(Error::input("command line", "--jobs", "given", accepted));
            }
            let (flags, overwrite, no_verify) =
                (self.point_flags(), self.stages.folder.overwrite, self.stages.folder.no_verify);
            let (dry_run, json) = (self.dry_run, self.json);
            let request = Request { sweep, out: &out, machine, flags, overwrite, no_verify, dry_run, json };
            return request.submit().map(|()| ExitCode::SUCCESS);
        }
        self.run_here(sweep, &out, &machine.1)
    }

    /// Writes scenes and the file of a workflow program.
    fn export(&self, sweep: &Points, out: &Path, machine: &Machine, workflow: Workflow) -> Result<()> {
        let _locked = sweep::open(sweep, out, self.stages.folder.overwrite, &output::warn)?;
        for point in &sweep.points {
            let folder = PointFolder::of(out, &point.label);
            folder.write_scene(&point.scene)?;
            create_folder(&folder.out)?;
        }
        let command = own_command(results::FILE)?;
        let program = program_of(machine)?;
        let text = workflow.text(&WorkflowInput {
            machine,
            program: &program,
            labels: sweep.points.iter().map(|p| p.label.as_str()).collect(),
            arguments: &PointCommand::arguments(&self.point_flags(), machine.cpus, &machine.lammps),
            bytes: sweep.points.iter().map(|p| p.bytes).max().unwrap_or_default(),
            collect: (&command.folder, command.arguments),
        });
        let path = put(out, workflow.file(), text)?;
        if self.json {
            let (points, file) = (sweep.points.len(), output::path(&path));
            return output::json_line(
                &serde_json::json!({ "out": output::path(out), "points": points, "done": 0, "failed": 0, "file": file }),
            );
        }
        output::print(&format!("{}; start it in that folder with {}", path.display(), workflow.start(machine)));
        Ok(())
    }

    /// Runs the points as processes of this machine.
    fn run_here(&self, sweep: &Points, out: &Path, machine: &Machine) -> Result<ExitCode> {
        let bytes = sweep.points.iter().map(|p| p.bytes).max().unwrap_or_default().max(1);
        let available = asperity_grid::sys::available_memory_bytes();
        let cores = rayon::current_num_threads();
        let fit = usize::try_from(available / bytes).unwrap_or(usize::MAX).max(1);
        let given = self.jobs.map(usize::from).or(machine.at_once);
        let ranks = machine.lammps.ranks.unwrap_or(sweep.ranks()).max(1);
        // Points on a GPU share its memory.
        let gpu = (Device::chosen() == Device::Cuda).then_some(1);
        let at_once = given.or(gpu).unwrap_or((cores / ranks).min(fit)).min(sweep.points.len()).max(1);
        if self.dry_run {
            return self.plan(sweep, at_once).map(|()| ExitCode::SUCCESS);
        }
        let program = std::env::current_exe().map_err(Error::io("find", Path::new("asperity")))?;
        let command = PointCommand::new(program, &self.point_flags(), (cores / at_once).max(1), &machine.lammps);
        let worst = AtomicU8::new(0);
        let runner = |point: &PointFolder| {
            let (outcome, code) = command.run(point, &|| false);
            if !matches!(outcome, sweep::PointOutcome::Interrupted) {
                worst.fetch_max(code, Ordering::Relaxed);
            }
            outcome
        };
        let printer = PointPrinter(Mutex::new(()));
        progress::compute();
        let (ensemble, page) = sweep::run(sweep, out, (at_once, self.stages.folder.overwrite), &runner, &printer)?;
        print(&ensemble, out, &page, self.json)?;
        Ok(ExitCode::from(worst.load(Ordering::Relaxed)))
    }

    /// Flags of `asperity run` for every point.
    fn point_flags(&self) -> Vec<String> {
        let flags = [
            ("--overwrite", self.stages.folder.overwrite),
            ("--no-verify", self.stages.folder.no_verify),
            ("--allow-program", self.stages.allow_program),
        ];
        flags.iter().filter(|f| f.1).map(|f| f.0.to_string()).collect()
    }

    fn plan(&self, sweep: &Points, at_once: usize) -> Result<()> {
        let (bytes, seconds) =
            sweep.points.iter().fold((0, 0.0), |(b, s), p| (p.bytes.max(b), s + p.seconds / at_once as f64));
        if self.json {
            return output::json_line(&serde_json::json!({
                "points": sweep.points.len(), "at_once": at_once, "bytes_of_largest": bytes, "seconds": seconds,
            }));
        }
        let rows = sweep.points.iter().map(|p| vec![p.label.clone(), memory(p.bytes), duration(p.seconds)]);
        output::print(&output::table(&["point", "memory", "time"], rows));
        output::print(&format!(
            "{} points, {at_once} at once: about {} (an order of magnitude)",
            sweep.points.len(),
            duration(seconds)
        ));
        Ok(())
    }
}

/// One line on stderr for each point.
struct PointPrinter(Mutex<()>);

impl SweepListener for PointPrinter {
    fn ended(&self, label: &str, failure: Option<&str>, finished: usize, all: usize) {
        let _one_at_a_time = self.0.lock();
        let remedy = failure.map_or("done".into(), |reason| format!("failed: {reason}"));
        output::eprint(&format!("  {finished} of {all}: {label} {remedy}"));
    }

    fn stopping(&self) -> bool {
        progress::stopping()
    }

    fn warn(&self, text: &str) {
        output::warn(text);
    }
}
