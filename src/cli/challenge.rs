use super::cluster::CommandRequest;
use super::file::{FileFlags, flag_of, refuse_grid};
use super::machine::{LammpsFlags, MachineFlags, submits};
use super::run::{FolderFlags, plan};
use super::{output, progress::TerminalProgress};
use crate::challenge::MESH_LIMIT;
use crate::pipeline;
use crate::record::results;
use crate::scene::{Case, Scene, SurfaceScene, rename_keys};
use crate::{Error, Result};
use asperity_atoms::lammps_command::LammpsCommand;
use asperity_contact::interface::RangeChoice;
use asperity_surface::heights::Touching;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// The scene of this command, before its options.
const SCENE: &str = include_str!("../../configs/challenge.toml");
const SCENE_NAME: &str = "command line";

/// Least points per side: fewer do not resolve the roll-off.
const COARSEST: usize = 32;

/// Unit of lengths in the challenge's own files, µm.
const FILE_UNIT: &str = "0.1 mm";

#[derive(Debug, clap::Args)]
pub(super) struct ChallengeArgs {
    /// Points per side for a synthesised surface or Fourier coefficients, at least 32. Default: 2048.
    #[arg(long, value_name = "N")]
    grid: Option<usize>,
    /// Seed of a synthesised surface.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// File with the challenge's own surface, instead of a synthesised one.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["seed"])]
    heights: Option<PathBuf>,
    /// Unit of the heights in that file.
    #[arg(long, value_name = "UNIT", default_value = FILE_UNIT, requires = "heights")]
    unit: String,
    /// Which points of that file touch first: the high or the low ones.
    #[arg(long, value_enum, default_value = "low-points", requires = "heights")]
    touching: Touching,
    #[command(flatten)]
    file: FileFlags,
    /// Enlarge a range of adhesion that the grid does not resolve. Default: the challenge's own range, without checks that depend on
    /// its resolution and without unloading.
    #[arg(long)]
    regularise: bool,
    /// Run folder. Default: runs/challenge-N, extended by seed, file name and -regularised.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    folder: FolderFlags,
    /// Further methods for the same loads: comma-separated ids from `asperity methods`, or all.
    #[arg(long, alias = "also", value_name = "IDS", value_delimiter = ',', num_args = 1)]
    compare_with: Vec<String>,
    #[command(flatten)]
    machine: MachineFlags,
    /// Print the stages with their memory and time, without running them; with --machine, the script without submitting it.
    #[arg(long)]
    dry_run: bool,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

impl ChallengeArgs {
    /// Exit code 1 where a statement failed.
    pub(super) fn execute(self) -> Result<ExitCode> {
        let case = Case::resolve(self.scene()?, Path::new(SCENE_NAME)).map_err(|e| rename_keys(e, &flag_of::<Self>))?;
        let out = self.out.clone().unwrap_or_else(|| {
            let file = self.heights.as_ref().and_then(|p| p.file_stem()).map(|s| format!("-{}", s.to_string_lossy()));
            let seed = self.seed.map(|s| format!("-seed-{s}"));
            let kind = if self.regularise { "-regularised" } else { "" };
            let which = file.or(seed).unwrap_or_default();
            PathBuf::from("runs").join(format!("challenge-{}{which}{kind}", case.model.grid.nx))
        });
        let mut machine = self.machine.find(&LammpsFlags::default())?;
        // There are no atoms.
        machine.1.lammps = LammpsCommand::default();
        if submits(&machine.1) {
            let (results, dry_run, json) = (results::FILE, self.dry_run, self.json);
            let request = CommandRequest { case: &case, out: &out, machine, results, seconds: None, dry_run, json };
            return request.submit().map(|()| ExitCode::SUCCESS);
        }
        if self.dry_run {
            return plan(&case, self.json).map(|()| ExitCode::SUCCESS);
        }
        let progress = TerminalProgress::new();
        let (results, page) = pipeline::run(&case, self.folder.folder(&out), &progress)?;
        drop(progress);
        if self.json {
            output::json_line(&serde_json::json!({
                "out": output::path(&out),
                "report": output::path(&page),
                "grid": [case.model.grid.nx, case.model.grid.ny],
                "surface": results.surface.origin,
                "acceptance": results.acceptance,
            }))?;
        } else {
            output::print(&format!(
                "{}, {} x {} points",
                results.surface.origin, case.model.grid.nx, case.model.grid.ny
            ));
            if self.heights.is_none() {
                output::print(
                    "a surface with the challenge's spectrum, not the challenge's own: --heights FILE reads that",
                );
            }
            output::results(&results);
            output::print(&format!("report: {}", page.display()));
        }
        output::ended(&results, page, false)
    }

    fn scene(&self) -> Result<Scene> {
        let mut scene = Scene::parse(SCENE, Path::new(SCENE_NAME))?;
        let s = &mut scene.surface;
        s.grid = self.grid.unwrap_or(s.grid);
        if s.grid < COARSEST {
            return Err(Error::input("command line", "--grid", s.grid, format!("at least {COARSEST} points per side")));
        }
        s.seed = self.seed.unwrap_or(s.seed);
        self.file.set(s);
        scene.continuum.compare_with.extend(self.compare_with.iter().cloned());
        if let Some(path) = &self.heights {
            if !path.exists() {
                let found = format!("{} (no such file)", path.display());
                return Err(Error::input("command line", "--heights", found, "the challenge's surface"));
            }
            s.heights = Some(std::path::absolute(path).unwrap_or_else(|_| path.clone()));
            (s.unit, s.touching) = (Some(self.unit.clone()), Some(self.touching));
            if !self.file.are_waves() {
                s.grid = SurfaceScene::default().grid;
            }
            let lab = &mut scene.laboratory;
            (lab.length, lab.modulus) = (Some(lab.length()), Some(lab.modulus()));
            refuse_grid(self.grid, Some(path), !self.file.are_waves())?;
        }
        if let Some(a) = scene.adhesion.as_mut().filter(|_| !self.regularise) {
            a.resolution = RangeChoice::True;
            let (length, modulus) = (scene.laboratory.length().si(), scene.laboratory.modulus().si());
            let stiff = a.work_of_adhesion.si() / modulus / a.range.si().powi(2);
            // The grid of a file is known once it is read; no distributed file resolves the range.
            scene.load.unload = self.heights.is_none() && length / scene.surface.grid as f64 * stiff <= MESH_LIMIT;
        }
        Ok(scene)
    }
}
