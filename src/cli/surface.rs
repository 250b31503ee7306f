use super::file::FileFlags;
use super::output;
use crate::pipeline::statistics;
use crate::record::heights::{self, HeightMap, Sign};
use crate::record::import::{Fourier, holds_numbers};
use crate::report::number::trimmed;
use crate::scene::{Case, LoadScene, REFERENCE_LOAD, Scene, SurfaceScene, Touching};
use crate::{Error, Result};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(allow_negative_numbers = true)]
pub struct Surface {
    /// Scene whose surface is meant, or a file of heights or of Fourier coefficients, as --heights names one. Without any: the
    /// challenge's, changed by the options.
    #[arg(value_name = "SCENE|FILE")]
    given: Option<PathBuf>,
    /// Points per side; a height map has its own.
    #[arg(long, value_name = "N")]
    grid: Option<usize>,
    /// Seed of the random numbers: the same seed is the same surface on every grid.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Hurst exponent, above 0 and up to 1.
    #[arg(long, value_name = "H")]
    hurst: Option<f64>,
    /// Roll-off wavelength, µm.
    #[arg(long, value_name = "UM")]
    roll_off_um: Option<f64>,
    /// Short cut-off wavelength, µm.
    #[arg(long, value_name = "UM")]
    cut_off_um: Option<f64>,
    /// rms gradient of the whole Fourier sum.
    #[arg(long, value_name = "G")]
    rms_gradient: Option<f64>,
    /// File to read instead, with --touching: .npy, .npz, HDF5, NetCDF, ASCII matrix, lines of x y h, or Fourier coefficients.
    #[arg(long, value_name = "FILE")]
    heights: Option<PathBuf>,
    #[command(flatten)]
    file: FileFlags,
    /// Shortest wavelength that is kept of Fourier coefficients, µm.
    #[arg(long, value_name = "UM")]
    low_pass_um: Option<f64>,
    /// Which points of the file touch first.
    #[arg(long, value_enum)]
    touching: Option<Touching>,
    /// Unit of the heights in the file, µm.
    #[arg(long, value_name = "UM")]
    heights_unit_um: Option<f64>,
    /// Extent of the cell in x, µm.
    #[arg(long, value_name = "UM")]
    length_um: Option<f64>,
    /// Write heights in µm, low points touching first: .npy, anything else is an ASCII matrix.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

impl Surface {
    pub fn execute(mut self) -> Result<()> {
        if let Some(path) = self.given.take_if(|p| p.exists() && holds_numbers(p).unwrap_or(false)) {
            if let Some(heights) = &self.heights {
                let found = format!("{} beside {}", heights.display(), path.display());
                return Err(Error::input("command line", "--heights", found, "one file of heights"));
            }
            self.heights = Some(path);
        }
        let file = self.given.clone().unwrap_or_else(|| PathBuf::from("command line"));
        let mut scene = match &self.given {
            Some(path) => Scene::read(path)?,
            None => Scene {
                accuracy: None,
                name: "surface".into(),
                description: String::new(),
                laboratory: Default::default(),
                surface: SurfaceScene::default(),
                load: LoadScene { p_star: vec![REFERENCE_LOAD], ..LoadScene::default() },
                adhesion: None,
                continuum: Default::default(),
                methods: Default::default(),
                challenge: None,
                atoms: None,
            },
        };
        if let Some(path) = self.heights.as_ref().filter(|p| !p.exists()) {
            let accepted = "a file of heights or of their Fourier coefficients";
            return Err(Error::input(
                "command line",
                "--heights",
                format!("{} (no such file)", path.display()),
                accepted,
            ));
        }
        // A surface has no atoms and no adhesion to be checked, and nothing is solved on it.
        (scene.atoms, scene.adhesion, scene.accuracy) = (None, None, None);
        self.overwrite(&mut scene);
        let waves = scene.surface.fourier.is_some_and(Fourier::are_waves);
        if let (Some(n), Some(path), false) = (self.grid, &scene.surface.heights, waves) {
            let accepted = format!("none: {} is a height map with points of its own", path.display());
            return Err(Error::input("command line", "--grid", n, accepted));
        }
        let case = Case::resolve(scene, &file)?;
        case.warnings.iter().for_each(|w| output::eprint(&format!("warning: {w}")));
        // Heights, their half spectrum while it is transformed, and the copy that is written.
        let (need, have) = (4 * 8 * case.grid.points() as u64, crate::sys::available_memory_bytes());
        if need > have {
            let what = format!("a surface of {} x {} points", case.grid.nx, case.grid.ny);
            return Err(Error::Memory { what, need, have, advice: "a smaller --grid needs less".into() });
        }
        let heights = case.surface.heights(case.grid, 0.0);
        let length_um = case.scales.length_m * 1e6;
        let list = statistics(&case, &heights);
        if let Some(out) = &self.out {
            let um = heights.iter().map(|h| h * length_um).collect();
            let map = HeightMap::new("surface", case.grid.nx, case.grid.ny, um)?;
            heights::write(out, &map, Sign::LowFirst, "um")?;
        }
        if self.json {
            output::json_line(&serde_json::json!({
                "origin": case.surface.origin(),
                "nx": case.grid.nx,
                "ny": case.grid.ny,
                "length_um": length_um,
                "sign": Sign::LowFirst.words(),
                "out": self.out,
                "statistics": list,
                "warnings": case.warnings,
            }))
        } else {
            output::print(&format!(
                "{}, {} x {} points on {} µm",
                case.surface.origin(),
                case.grid.nx,
                case.grid.ny,
                trimmed(length_um, 6)
            ));
            output::print(&output::statistics(&list));
            if let Some(out) = &self.out {
                output::print(&format!("heights in µm, {}: {}", Sign::LowFirst.words(), out.display()));
            }
            Ok(())
        }
    }

    fn overwrite(&self, scene: &mut Scene) {
        let s = &mut scene.surface;
        let set = |to: &mut f64, from: Option<f64>| *to = from.unwrap_or(*to);
        set(&mut s.hurst, self.hurst);
        set(&mut s.rms_gradient, self.rms_gradient);
        set(&mut s.heights_unit_um, self.heights_unit_um);
        set(&mut scene.laboratory.length_um, self.length_um);
        s.grid = self.grid.unwrap_or(s.grid);
        s.seed = self.seed.unwrap_or(s.seed);
        if self.roll_off_um.is_some() {
            (s.roll_off_um, s.roll_off_mode) = (self.roll_off_um, None);
        }
        if self.cut_off_um.is_some() {
            (s.cut_off_um, s.cut_off_mode) = (self.cut_off_um, None);
        }
        if let Some(path) = &self.heights {
            // A file given here is relative to where the command runs, not to the scene.
            s.heights = Some(std::path::absolute(path).unwrap_or_else(|_| path.clone()));
        }
        s.touching = self.touching.or(s.touching);
        if self.heights.is_some() {
            // What the scene says of its own file is not true of another.
            (s.dataset, s.fourier, s.fourier_points, s.low_pass_um) = Default::default();
        }
        if self.file.fourier.is_some() {
            s.fourier_points = None;
        }
        s.dataset = self.file.dataset.clone().or(s.dataset.take());
        s.fourier = self.file.fourier.or(s.fourier);
        s.fourier_points = self.file.fourier_points.or(s.fourier_points);
        s.low_pass_um = self.low_pass_um.or(s.low_pass_um);
    }
}
