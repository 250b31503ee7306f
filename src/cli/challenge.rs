use super::{file::FileFlags, output, progress::TerminalProgress};
use crate::challenge::MESH_LIMIT;
use crate::interface::RangeChoice;
use crate::pipeline;
use crate::scene::{Case, Scene, Touching};
use crate::{Error, Result};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// The scene that this command runs, with what its options change.
const SCENE: &str = include_str!("../../configs/challenge.toml");
const SCENE_NAME: &str = "command line";

/// Points a side below which the challenge's surface is hardly one.
const COARSEST: usize = 32;

/// Unit of lengths in the challenge's own files, µm.
const FILE_UNIT_UM: f64 = 100.0;

#[derive(Debug, clap::Args)]
pub struct Challenge {
    /// Points a side of a surface made from the spectrum, or from Fourier coefficients. Default: 2048.
    #[arg(long, value_name = "N")]
    grid: Option<usize>,
    /// Seed of such a surface.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// The challenge's own surface, in any of its formats, instead.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["seed"])]
    heights: Option<PathBuf>,
    /// Unit of the heights in that file, µm; the challenge's own is 0.1 mm.
    #[arg(long, value_name = "UM", default_value_t = FILE_UNIT_UM, requires = "heights")]
    heights_unit_um: f64,
    /// Which points of that file touch first.
    #[arg(long, value_enum, default_value = "low-points", requires = "heights")]
    touching: Touching,
    #[command(flatten)]
    file: FileFlags,
    /// Give a grid that does not resolve the adhesion's range the shortest that it does. Without, the range is the
    /// challenge's own, what depends on it is not judged on such a grid, and the way back, which would be the grid's, is left
    /// out.
    #[arg(long)]
    regularise: bool,
    /// Run folder. Default: runs/challenge-N, with the seed or the file's name where one is given, and -regularised.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Further methods that are given the same loads: ids from `asperity methods` apart by commas, or all.
    #[arg(long, value_name = "IDS", value_delimiter = ',', num_args = 1)]
    compare_with: Vec<String>,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

impl Challenge {
    /// Exit code 1 where a statement failed.
    pub fn execute(self) -> Result<ExitCode> {
        let case = Case::resolve(self.scene()?, Path::new(SCENE_NAME))?;
        let out = self.out.clone().unwrap_or_else(|| {
            let file = self.heights.as_ref().and_then(|p| p.file_stem()).map(|s| format!("-{}", s.to_string_lossy()));
            let seed = self.seed.map(|s| format!("-seed-{s}"));
            let kind = if self.regularise { "-regularised" } else { "" };
            let which = file.or(seed).unwrap_or_default();
            PathBuf::from("runs").join(format!("challenge-{}{which}{kind}", case.grid.nx))
        });
        let progress = TerminalProgress::new();
        let (results, page) = pipeline::run(&case, &out, &progress)?;
        drop(progress);
        if self.json {
            output::json_line(&serde_json::json!({
                "out": out,
                "report": page,
                "grid": [case.grid.nx, case.grid.ny],
                "surface": results.surface.origin,
                "acceptance": results.acceptance,
            }))?;
        } else {
            output::print(&format!("{}, {} x {} points", results.surface.origin, case.grid.nx, case.grid.ny));
            if self.heights.is_none() {
                output::print(
                    "a surface with the challenge's spectrum, not the challenge's own: --heights FILE reads that",
                );
            }
            output::results(&results);
            output::print(&format!("report: {}", page.display()));
        }
        output::ended(&results, page)
    }

    fn scene(&self) -> Result<Scene> {
        let mut scene = Scene::parse(SCENE, Path::new(SCENE_NAME))?;
        let s = &mut scene.surface;
        s.grid = self.grid.unwrap_or(s.grid);
        if s.grid < COARSEST {
            return Err(Error::input("command line", "--grid", s.grid, format!("at least {COARSEST} points a side")));
        }
        s.seed = self.seed.unwrap_or(s.seed);
        scene.continuum.compare_with.extend(self.compare_with.iter().cloned());
        if let Some(path) = &self.heights {
            if !path.exists() {
                let found = format!("{} (no such file)", path.display());
                return Err(Error::input("command line", "--heights", found, "the challenge's surface"));
            }
            s.heights = Some(std::path::absolute(path).unwrap_or_else(|_| path.clone()));
            (s.heights_unit_um, s.touching) = (self.heights_unit_um, Some(self.touching));
            (s.dataset, s.fourier) = (self.file.dataset.clone(), self.file.fourier);
            s.fourier_points = self.file.fourier_points;
            if let Some(n) = self.grid.filter(|_| !self.file.are_waves()) {
                let accepted = format!("none: {} is a height map with points of its own", path.display());
                return Err(Error::input("command line", "--grid", n, accepted));
            }
        }
        let mut complaints = Vec::new();
        self.file.check(self.heights.is_some(), &mut complaints);
        if !complaints.is_empty() {
            return Err(Error::Input { place: "command line".into(), list: complaints });
        }
        if let Some(a) = scene.adhesion.as_mut().filter(|_| !self.regularise) {
            a.range = RangeChoice::True;
            let (length, modulus) = (scene.laboratory.length_um * 1e-6, scene.laboratory.contact_modulus_mpa * 1e6);
            let stiff = a.work_of_adhesion_mj_m2 * 1e-3 / modulus / (a.range_nm * 1e-9).powi(2);
            // Of a file the grid is known once it is read; none of the distributed ones resolves the range.
            scene.load.unload = self.heights.is_none() && length / scene.surface.grid as f64 * stiff <= MESH_LIMIT;
        }
        Ok(scene)
    }
}
