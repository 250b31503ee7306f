use super::file::{FileFlags, refuse_grid};
use super::flag_names::{FlagName, with_flags};
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
    /// Scene, or file of heights or Fourier coefficients. Default: the challenge's surface, changed by the options.
    #[arg(value_name = "SCENE|FILE")]
    given: Option<PathBuf>,
    /// Points per side; a height map has its own.
    #[arg(long, value_name = "N")]
    grid: Option<usize>,
    /// Seed of the random phases. The surface of a seed does not depend on the grid.
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
    /// File instead, with --touching: .npy, .npz, HDF5, NetCDF, ASCII matrix, x y h, or Fourier coefficients.
    #[arg(long, value_name = "FILE")]
    heights: Option<PathBuf>,
    #[command(flatten)]
    file: FileFlags,
    /// Shortest wavelength kept of Fourier coefficients, µm.
    #[arg(long, value_name = "UM")]
    low_pass_um: Option<f64>,
    /// Points of the file that touch first.
    #[arg(long, value_enum)]
    touching: Option<Touching>,
    /// Unit of the heights in the file, µm.
    #[arg(long, value_name = "UM")]
    heights_unit_um: Option<f64>,
    /// Extent of the cell in x, µm.
    #[arg(long, value_name = "UM")]
    length_um: Option<f64>,
    /// Write heights in µm, low points touching first: .npy, otherwise an ASCII matrix.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

/// Keys and their flags, in the order of [`Surface::flag_names`].
const FLAGS: [FlagName; 13] = [
    ("laboratory.length_um", "--length-um"),
    ("surface.grid", "--grid"),
    ("surface.hurst", "--hurst"),
    ("surface.roll_off_um", "--roll-off-um"),
    ("surface.cut_off_um", "--cut-off-um"),
    ("surface.rms_gradient", "--rms-gradient"),
    ("surface.heights_unit_um", "--heights-unit-um"),
    ("surface.heights", "--heights"),
    ("surface.dataset", "--dataset"),
    ("surface.fourier_points", "--fourier-points"),
    ("surface.fourier", "--fourier"),
    ("surface.low_pass_um", "--low-pass-um"),
    ("surface.touching", "--touching"),
];

impl Surface {
    pub fn execute(mut self) -> Result<()> {
        if let Some(path) = self.given.take_if(|p| p.exists() && holds_numbers(p).unwrap_or(false)) {
            if let Some(heights) = &self.heights {
                let found = format!("{} and {}", heights.display(), path.display());
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
        // Nothing is solved, so atoms, adhesion and accuracy are not checked.
        (scene.atoms, scene.adhesion, scene.accuracy) = (None, None, None);
        self.overwrite(&mut scene);
        let waves = scene.surface.fourier.is_some_and(Fourier::are_waves);
        refuse_grid(self.grid, scene.surface.heights.as_deref(), !waves)?;
        let case = Case::resolve(scene, &file).map_err(|e| with_flags(e, &self.flag_names()))?;
        case.warnings.iter().for_each(|w| output::eprint(&format!("warning: {w}")));
        self.report(&case)
    }

    /// Writes the heights and prints the statistics.
    fn report(&self, case: &Case) -> Result<()> {
        // Heights, their half spectrum while it is transformed, and the copy that is written.
        let (need, have) = (4 * 8 * case.grid.points() as u64, crate::sys::available_memory_bytes());
        if need > have {
            let what = format!("a surface of {} x {} points", case.grid.nx, case.grid.ny);
            return Err(Error::Memory { what, need, have, advice: "a smaller --grid needs less".into() });
        }
        let heights = case.surface.heights(case.grid, 0.0);
        let length_um = case.scales.length_m * 1e6;
        let list = statistics(case, &heights);
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

    /// The flag of every key whose value came from a flag: of all where there is no scene.
    fn flag_names(&self) -> Vec<FlagName> {
        let (file, s) = (self.heights.is_some(), &self.file);
        let given = [
            self.length_um.is_some(),
            self.grid.is_some(),
            self.hurst.is_some(),
            self.roll_off_um.is_some(),
            self.cut_off_um.is_some(),
            self.rms_gradient.is_some(),
            self.heights_unit_um.is_some() || file,
            file,
            s.dataset.is_some() || file,
            s.fourier_points.is_some() || s.fourier.is_some(),
            s.fourier.is_some() || file,
            self.low_pass_um.is_some(),
            self.touching.is_some() || file,
        ];
        FLAGS.into_iter().zip(given).filter(|(_, given)| *given || self.given.is_none()).map(|(name, _)| name).collect()
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
            // Properties of the scene's own file do not hold for another.
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
