use super::file::{FileFlags, MapFlags, flag_of, refuse_grid, refused};
use super::surface_instrument::{Noise, TipMarks};
use super::{output, surface_functions, surface_survey};
use crate::pipeline::{correlation_statistics, statistics};
use crate::record::results::SurfaceStatistic;
use crate::report::number::trimmed;
use crate::scene::{Case, Length, Scene, Stress, SurfaceScene, rename_keys, rename_keys_in};
use crate::{Error, Result};
use asperity_grid::rms;
use asperity_grid::sys::expect_memory;
use asperity_grid::units::{Dimension, Measure};
use asperity_surface::declared::{Declared, DeclaredExtent};
use asperity_surface::heights::{self, HeightMap, Touching};
use asperity_surface::import::{Fourier, holds_numbers};
use asperity_surface::{Tip, range};
use clap::ValueEnum;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub(super) struct SurfaceArgs {
    /// Scene, or file of heights or Fourier coefficients. Default: the challenge's surface, changed by the options.
    #[arg(value_name = "SCENE|FILE")]
    given: Option<PathBuf>,
    /// Points per side. A height map keeps its points.
    #[arg(long, value_name = "N")]
    grid: Option<usize>,
    /// Seed of the random phases. The surface of a seed does not depend on the grid.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Hurst exponent, above 0 and up to 1.
    #[arg(long, value_name = "H")]
    hurst: Option<f64>,
    /// Roll-off wavelength, such as 20um.
    #[arg(long, value_name = "LAMBDA")]
    roll_off: Option<Measure>,
    /// Short cut-off wavelength, such as 0.5um.
    #[arg(long, value_name = "LAMBDA")]
    cut_off: Option<Measure>,
    /// rms gradient of the whole Fourier sum.
    #[arg(long, value_name = "G")]
    rms_gradient: Option<f64>,
    /// File instead: text, .npy, .npz, HDF5, NetCDF, .x3p, .sdf, .sur, .gwy, or Fourier coefficients.
    #[arg(long, value_name = "FILE")]
    heights: Option<PathBuf>,
    #[command(flatten)]
    file: FileFlags,
    #[command(flatten)]
    map: MapFlags,
    /// Write the prepared heights in µm with what they declare: .npy with a JSON file, .nc (NetCDF), otherwise an ASCII matrix with comments.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write power spectra, structure functions, and slope and curvature over distance to tables in this folder.
    #[arg(long, value_name = "DIR")]
    functions: Option<PathBuf>,
    /// Radius of the tip that measured the map, such as 20nm: prints which lengths and points have its shape.
    #[arg(long, value_name = "R")]
    tip_radius: Option<Measure>,
    /// Half of the opening angle of the tip's cone, degrees.
    #[arg(long, value_name = "DEG", default_value_t = 0.0, requires = "tip_radius")]
    tip_angle: f64,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

impl SurfaceArgs {
    pub(super) fn execute(mut self) -> Result<()> {
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
            None => Scene::new("surface", SurfaceScene::default()),
        };
        if let Some(path) = self.heights.as_ref().filter(|p| !p.exists()) {
            let accepted = "a file of heights or of their Fourier coefficients";
            let found = format!("{} (no such file)", path.display());
            return Err(Error::input("command line", "--heights", found, accepted));
        }
        // Nothing is solved, so atoms and adhesion are not checked.
        (scene.atoms, scene.adhesion) = (None, None);
        // Nothing is pressed: statistics need no modulus.
        scene.laboratory.modulus.get_or_insert(Stress::new(1.0, "MPa"));
        self.overwrite(&mut scene)?;
        let waves = scene.surface.fourier.is_some_and(Fourier::are_waves);
        refuse_grid(self.grid, scene.surface.heights.as_deref(), !waves)?;
        let names = &|key: &str| self.flag_of(key);
        let unsigned = self.map.touching.is_none() && !self.json && self.out.is_none();
        let surface = Some(scene.surface.clone()).filter(|_| unsigned);
        let case = Case::resolve(scene, &file).map_err(|e| rename_keys(e, names)).inspect_err(|e| {
            if let Some(surface) = surface.filter(|_| surface_survey::is_incomplete(e)) {
                // What cannot be read is in the error already.
                let _ = surface_survey::print(&surface, &file);
            }
        })?;
        case.warnings.iter().for_each(|w| output::eprint(&format!("warning: {}", rename_keys_in(w, names))));
        if let Some(provenance) = case.provenance().filter(|_| self.json) {
            output::eprint(&provenance.to_string());
        }
        self.report(&case)
    }

    /// Writes the heights and prints the statistics.
    fn report(&self, case: &Case) -> Result<()> {
        // Heights, their half spectrum while it is transformed, and the copy that is written; the autocorrelation, of a patch in a cell of
        // four times its area.
        let description = format!("a surface of {} x {} points", case.model.grid.nx, case.model.grid.ny);
        let fields = if case.is_non_periodic() { 10 } else { 4 };
        expect_memory(description, fields * 8 * case.model.grid.points() as u64, "a smaller --grid needs less")?;
        let heights = case.surface().heights(case.model.grid, 0.0);
        let length_um = case.laboratory.length().to("um");
        let mut list = statistics(case, &heights);
        list.extend(correlation_statistics(case, &heights));
        let (tip, noise) = (self.tip(case, &heights)?, Noise::of(case, &heights));
        if let Some(out) = &self.out {
            let same = |file: &str| {
                std::fs::canonicalize(file).ok().is_some_and(|f| Some(f) == std::fs::canonicalize(out).ok())
            };
            if case.provenance().is_some_and(|p| same(&p.file)) {
                let found = format!("{} (the file that is read)", out.display());
                return Err(Error::input("command line", "--out", found, "another file: the measured one is kept"));
            }
            write(out, case, &heights)?;
        }
        if let Some(folder) = &self.functions {
            surface_functions::write(folder, case, &heights)?;
        }
        if self.json {
            output::json_line(&self.json(case, &heights, &list, (tip, noise)))
        } else {
            let cell =
                format!(", {} x {} points on {} µm", case.model.grid.nx, case.model.grid.ny, trimmed(length_um, 6));
            let cell = if case.provenance().is_some() { String::new() } else { cell };
            output::print(&format!("{}{cell}", case.surface().origin()));
            output::print(&output::statistics(&list));
            tip.map(|tip| tip.words())
                .into_iter()
                .chain(noise.map(|n| n.words()))
                .for_each(|line| output::print(&line));
            if let Some(out) = &self.out {
                output::print(&format!("heights in µm, {}: {}", sign(case).words(), out.display()));
            }
            if let Some(folder) = &self.functions {
                output::print(&format!("functions: {}", folder.display()));
            }
            Ok(())
        }
    }

    /// Everything about the surface, in SI units; low points touch first in a written file.
    fn json(
        &self,
        case: &Case,
        heights: &[f64],
        list: &[SurfaceStatistic],
        (tip, noise): (Option<TipMarks>, Option<Noise>),
    ) -> serde_json::Value {
        let (metres, p) = (case.scales.length_m, case.provenance());
        let values = range(heights);
        let periodic = case.scene.continuum.is_periodic();
        let touching = Touching::LowPoints.to_possible_value().map(|v| v.get_name().to_string());
        serde_json::json!({
            "origin": case.surface().origin(),
            "format": p.as_ref().map_or("synthesised", |p| &p.format),
            "file": p.as_ref().map(|p| &p.file),
            "hash": p.as_ref().map(|p| &p.hash),
            "channel": p.as_ref().and_then(|p| p.channel.clone()),
            "channels": p.as_ref().map(|p| &p.channels),
            "unit": p.as_ref().and_then(|p| p.unit.clone()),
            "nx": case.model.grid.nx,
            "ny": case.model.grid.ny,
            "length_um": case.laboratory.length().to("um"),
            "length_x_m": case.model.grid.lx * metres,
            "length_y_m": case.model.grid.ly * metres,
            "height_range_m": (values.max - values.min) * metres,
            "rms_height_m": rms(heights) * metres,
            "rms_gradient": case.gradient,
            "missing_points": p.as_ref().map_or(0, |p| p.missing_points),
            "filled_points": p.as_ref().map_or(0, |p| p.filled_points),
            "touching": p.as_ref().map(|p| p.touching.clone()).or(touching),
            "periodic": periodic,
            "sign": sign(case).words(),
            "preparation": p.as_ref().map_or(&[][..], |p| &p.preparation),
            "version": env!("CARGO_PKG_VERSION"),
            "out": self.out,
            "functions": self.functions,
            "statistics": list,
            "tip": tip,
            "noise": noise,
            "warnings": case.warnings,
        })
    }

    /// What the tip has left of the surface.
    fn tip(&self, case: &Case, heights: &[f64]) -> Result<Option<TipMarks>> {
        let Some(radius) = self.tip_radius else { return Ok(None) };
        let metres = length("--tip-radius", radius)?.to("m");
        if metres <= 0.0 {
            return Err(refused("--tip-radius", radius, "a length above zero"));
        }
        if !(0.0..90.0).contains(&self.tip_angle) {
            return Err(Error::input("command line", "--tip-angle", self.tip_angle, "0 to below 90 degrees"));
        }
        let tip = Tip { radius: metres / case.scales.length_m, half_angle: self.tip_angle.to_radians() };
        Ok(Some(TipMarks::of(case, heights, tip)))
    }

    /// The flag of a key whose value came from a flag, or could: there is no scene, or another file than its own.
    fn flag_of(&self, key: &str) -> Option<String> {
        let given = match key {
            "surface.grid" => self.grid.is_some(),
            "surface.hurst" => self.hurst.is_some(),
            "surface.roll_off" => self.roll_off.is_some(),
            "surface.cut_off" => self.cut_off.is_some(),
            "surface.rms_gradient" => self.rms_gradient.is_some(),
            "laboratory.length" => self.map.length.is_some(),
            _ => false,
        };
        flag_of::<Self>(key).filter(|_| given || self.heights.is_some() || self.given.is_none())
    }

    /// Sets keys of the scene from flags.
    fn overwrite(&self, scene: &mut Scene) -> Result<()> {
        let s = &mut scene.surface;
        if let Some(path) = &self.heights {
            // Properties of the scene's own surface do not hold for another. A file given here is relative to where the command
            // runs, not to the scene.
            let heights = Some(std::path::absolute(path).unwrap_or_else(|_| path.clone()));
            *s = SurfaceScene { heights, ..SurfaceScene::default() };
            (scene.laboratory.length, scene.laboratory.length_y) = (None, None);
        }
        let set = |to: &mut f64, from: Option<f64>| *to = from.unwrap_or(*to);
        set(&mut s.hurst, self.hurst);
        set(&mut s.rms_gradient, self.rms_gradient);
        s.grid = self.grid.unwrap_or(s.grid);
        s.seed = self.seed.unwrap_or(s.seed);
        if let Some(wave) = self.roll_off {
            (s.roll_off, s.roll_off_mode) = (Some(length("--roll-off", wave)?), None);
        }
        if let Some(wave) = self.cut_off {
            (s.cut_off, s.cut_off_mode) = (Some(length("--cut-off", wave)?), None);
        }
        self.file.set(s);
        // Plain lengths are in the unit of the heights.
        let further = self.map.further_lengths().into_iter().map(|(_, m)| m);
        let plain = self.map.lengths().into_iter().flat_map(|(_, m)| m).chain(further).any(|m| m.unit.is_none());
        let file = s.heights.clone().filter(|_| plain);
        let heights_m = self.map.heights_m(file.as_deref(), &self.file)?;
        let in_scene = |flag: &str, m: Measure| match (m.unit, heights_m) {
            (None, Some(metres)) => Ok(Length::new(m.value * (metres / 1e-6), "um")),
            // Without a unit of the heights the file is refused anyway.
            (None, None) if file.is_some() => Ok(Length::new(m.value, "um")),
            _ => length(flag, m),
        };
        self.map.set(s, &mut scene.laboratory, &mut scene.continuum, &in_scene)?;
        match self.seed.filter(|_| !s.has_seed()) {
            Some(seed) => Err(Error::input(
                "command line",
                "--seed",
                seed,
                "only without a file, or with --extend-to or --isotropic-map",
            )),
            None => Ok(()),
        }
    }
}

/// A length with its unit.
fn length(flag: &str, m: Measure) -> Result<Length> {
    Length::written(m).ok_or_else(|| refused(flag, m, Dimension::Length.accepted()))
}

/// The sign with which a surface is written: that of its file.
fn sign(case: &Case) -> Touching {
    match case.scene.surface.touching {
        Some(Touching::HighPoints) => Touching::HighPoints,
        _ => Touching::LowPoints,
    }
}

/// Writes the prepared heights in µm, with all that `solve` needs to know about them.
fn write(out: &Path, case: &Case, heights: &[f64]) -> Result<()> {
    let (um, sign, highest) = (case.laboratory.length().to("um"), sign(case), range(heights).max);
    let flipped = |h: &f64| if sign == Touching::HighPoints { highest - h } else { *h };
    let map = HeightMap::new(
        "surface",
        case.model.grid.nx,
        case.model.grid.ny,
        heights.iter().map(|h| flipped(h) * um).collect(),
    )?;
    let declared = Declared {
        sign: Some(sign),
        unit: Some("um".into()),
        extent: Some(DeclaredExtent { x: um, y: case.model.grid.ly * um, unit: Some("um".into()) }),
        // Periodicity that nobody stated is not declared.
        periodic: Some(case.scene.continuum.is_periodic())
            .filter(|periodic| !periodic || case.provenance().is_none_or(|p| p.periodicity_is_known)),
        history: case.provenance().map_or(Vec::new(), |p| p.preparation.clone()),
        ..Declared::default()
    };
    heights::write(out, &map, &declared)
}
