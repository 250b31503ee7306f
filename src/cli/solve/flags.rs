//! Flags of `solve`, and the scene that they make.

use super::loads::{LoadFlags, list};
use super::units::SolveUnits;
use crate::cli::body::BodyFlag;
use crate::cli::file::{COMMAND_LINE, FileFlags, MapFlags, accuracy, flag_of, refuse_grid, refused};
use crate::scene::{
    AdhesionScene, ContinuumScene, CrystalScene, LaboratoryScene, LayerScene, Length, LoadScene, Scene, Stress,
    SubsurfaceScene, SurfaceScene, WallKind, Work,
};
use crate::{Error, Result};
use asperity_contact::interface::{Base, RangeChoice};
use asperity_contact::method::{Precision, Settings};
use asperity_contact::problem::{AdhesionLaw, ErrorTargets, MAX_ITERATIONS};
use asperity_grid::units::{Dimension, Measure, Measures, Unit};
use std::path::{Path, PathBuf};

// Headings of the help.
const SURFACE: &str = "Surface";
const MODEL: &str = "Contact model";
const LOADS: &str = "Loads";
const SOLVER: &str = "Solver";
const OUTPUT: &str = "Output";

/// Values have units (100um, 25MPa), or none has: then they are consistent, lengths in the unit of the heights, stresses in that of the
/// modulus.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct SolveArgs {
    /// File of heights or of Fourier coefficients; the same as --heights.
    #[arg(required_unless_present_any = ["challenge", "heights"], conflicts_with_all = ["challenge", "heights"])]
    pub(super) file: Option<PathBuf>,
    /// Height map (.npy, .npz, HDF5, NetCDF, x3p, SDF, .sur, .gwy, ASCII matrix, lines of x y h) or Fourier coefficients qX qY Re Im.
    #[arg(long, value_name = "FILE", conflicts_with = "challenge", help_heading = SURFACE)]
    pub(super) heights: Option<PathBuf>,
    #[command(flatten)]
    pub(super) file_flags: FileFlags,
    #[command(flatten)]
    pub(super) map: MapFlags,
    /// Points per side for Fourier coefficients. A height map keeps its points.
    #[arg(long, value_name = "N", conflicts_with = "challenge", help_heading = SURFACE)]
    pub(super) grid: Option<usize>,
    /// Instead of a file: the challenge's spectrum on an N x N grid. The heights are never stored.
    #[arg(long, value_name = "N", help_heading = SURFACE)]
    pub(super) challenge: Option<usize>,
    /// Seed of the challenge's surface, of the waves of --extend-to, or of --isotropic-map.
    #[arg(long, value_name = "N", help_heading = SURFACE)]
    pub(super) seed: Option<u64>,
    /// Short cut-off wavelength of the challenge's surface. Default: a thousandth of the cell's extent.
    #[arg(long, value_name = "LAMBDA", requires = "challenge", help_heading = SURFACE)]
    pub(super) cut_off: Option<Measure>,
    /// Contact modulus E* = E/(1-ν²), with or without a unit (2MPa); required for a file.
    #[arg(long, value_name = "E", help_heading = MODEL)]
    pub(super) modulus: Option<Measure>,
    /// Instead of the modulus, an elastic body as E,NU or E,NU,HARDNESS (70GPa,0.33): once for a body against a rigid one, twice for two, of
    /// which the first is that of the surface. The hardness of the softer body counts. With --out, the displacement of each of two bodies is
    /// written, too (not on several ranks).
    #[arg(long, value_name = "E,NU", conflicts_with_all = ["modulus", "challenge"], help_heading = MODEL)]
    pub(super) body: Vec<BodyFlag>,
    #[command(flatten)]
    pub(super) loads: LoadFlags,
    /// Append the unloading branch: the same loads in reverse.
    #[arg(long, help_heading = LOADS)]
    pub(super) unload: bool,
    /// After the last load, separate the surfaces and find the pull-off pressure.
    #[arg(long, help_heading = LOADS)]
    pub(super) pull_off: bool,
    /// Solve Reynolds' equation in the gap of each load: leakage along x and y, next to that of the effective medium.
    #[arg(long, help_heading = OUTPUT)]
    pub(super) leakage: bool,
    /// Stress below the surface at these depths, comma-separated or as lin:FROM:TO:COUNT, with a unit or in that of the heights:
    /// equivalent stress after von Mises and largest shear stress. Needs --poisson.
    #[arg(long, value_name = "DEPTHS", help_heading = OUTPUT)]
    pub(super) subsurface: Option<Measures>,
    /// Shear stress at which the body yields, with or without a unit: the largest shear stress is stated over it.
    #[arg(long, value_name = "TAU", requires = "subsurface", help_heading = OUTPUT)]
    pub(super) shear_strength: Option<Measure>,
    /// Gap to start from (.npy), in the unit of the heights, as written to --out.
    #[arg(long, value_name = "FILE", help_heading = LOADS)]
    pub(super) initial_gap: Option<PathBuf>,
    /// Work of adhesion γ, with a unit (50mJ/m2) or in that of modulus times length.
    #[arg(long, alias = "gamma", value_name = "GAMMA", help_heading = MODEL)]
    pub(super) work_of_adhesion: Option<Measure>,
    /// Range ρ of the adhesion, with a unit (2nm) or in that of the heights.
    #[arg(long, alias = "rho", requires = "work_of_adhesion", value_name = "RHO", help_heading = MODEL)]
    pub(super) range: Option<Measure>,
    /// Treatment of an adhesion range that the grid does not resolve.
    #[arg(long, value_enum, default_value_t = RangeChoice::Mesh, help_heading = MODEL)]
    pub(super) resolution: RangeChoice,
    /// Decay of the attraction with the gap.
    #[arg(long, value_enum, default_value_t = AdhesionLaw::Exponential, requires = "work_of_adhesion", help_heading = MODEL)]
    pub(super) law: AdhesionLaw,
    /// Repulsion between the surfaces.
    #[arg(long, value_enum, default_value_t = WallKind::Hard, help_heading = MODEL)]
    pub(super) wall: WallKind,
    /// Compression of the penalty wall under a pressure of E*, with or without a unit.
    #[arg(long, value_name = "LENGTH", help_heading = MODEL)]
    pub(super) penalty_length: Option<Measure>,
    /// Hardness, with or without a unit of stress: the largest contact stress. Where it is reached, the surface flows; unloading is
    /// elastic. With the methods fast, bvm and gfmd.
    #[arg(long, value_name = "H", help_heading = MODEL)]
    pub(super) hardness: Option<Measure>,
    /// File with the hardness of every point of the surface instead.
    #[arg(long, value_name = "FILE", conflicts_with = "hardness", help_heading = MODEL)]
    pub(super) hardness_map: Option<PathBuf>,
    /// Unit of the values in that file, such as GPa. Default: that of the modulus.
    #[arg(long, value_name = "UNIT", requires = "hardness_map", help_heading = MODEL)]
    pub(super) hardness_map_unit: Option<String>,
    /// An id from `asperity methods`, or auto.
    #[arg(long, default_value = "auto", value_name = "ID", help_heading = SOLVER)]
    pub(super) method: String,
    /// A setting of a method as KEY=VALUE, such as winkler.spring_length=0.0034; `asperity schema` lists them under methods.
    #[arg(long, value_name = "KEY=VALUE", help_heading = SOLVER)]
    pub(super) set: Vec<String>,
    /// Largest rms KKT residual over the pressure. Default: 1e-8 in f64; 1e-3 in f32, more beyond 1024 x 1024 points.
    #[arg(long, alias = "tol", value_name = "RESIDUAL", help_heading = SOLVER)]
    pub(super) tolerance: Option<f64>,
    /// Largest accepted errors: 5%, or area=2%,mean_gap=1%,stiffness=5%,leakage=10%,pull_off=5%,gap_map=3%,contact_map=10%. Grids are
    /// solved from coarse to fine until the stated errors are within them; a spectrum goes on beyond its grid, a map ends with its own.
    /// --strict: exit code 3 if they are not reached.
    #[arg(long, value_name = "ERRORS", help_heading = SOLVER)]
    pub(super) error: Option<ErrorTargets>,
    /// Time after which no finer grid is begun (30s, 5min): the least errors within it.
    #[arg(long, value_name = "TIME", help_heading = SOLVER)]
    pub(super) budget: Option<Measure>,
    /// Floating-point type of the fields; sums are always f64.
    #[arg(long, value_enum, default_value_t = Precision::F64, help_heading = SOLVER)]
    pub(super) precision: Precision,
    /// Limit of iterations per load.
    #[arg(long, default_value_t = MAX_ITERATIONS, value_name = "N", help_heading = SOLVER)]
    pub(super) max_iterations: usize,
    /// Elastic layer of this thickness instead of the half-space, with or without a unit (50um).
    #[arg(long, value_name = "T", help_heading = MODEL)]
    pub(super) thickness: Option<Measure>,
    /// Poisson's ratio: of a layer (default: 0.3), or of the half-space, for the stress below its surface.
    #[arg(long, value_name = "NU", help_heading = MODEL)]
    pub(super) poisson: Option<f64>,
    /// The layer's lower face.
    #[arg(long, value_enum, default_value_t = Base::Bonded, requires = "thickness", help_heading = MODEL)]
    pub(super) base: Base,
    /// Elastic constants of a cubic half-space, (001) face, x along [100]. Only their ratios matter: E* is --modulus.
    #[arg(long, value_name = "C11,C12,C44", help_heading = MODEL)]
    pub(super) crystal: Option<Measures>,
    /// Folder for fields, numbers and checkpoints. The same command resumes an interrupted solve.
    #[arg(long, value_name = "DIR", help_heading = OUTPUT)]
    pub(super) out: Option<PathBuf>,
    /// Replace the results of another solve in that folder.
    #[arg(long, requires = "out", help_heading = OUTPUT)]
    pub(super) overwrite: bool,
    /// Reuse finished parts of the folder without comparing their files with the stored hashes.
    #[arg(long, requires = "out", help_heading = OUTPUT)]
    pub(super) no_verify: bool,
    /// Store the stress of the elastic body, too, which has numerical noise outside of contact.
    #[arg(long, requires = "out", help_heading = OUTPUT)]
    pub(super) elastic_stress: bool,
    /// Print the memory needed and stop.
    #[arg(long, help_heading = OUTPUT)]
    pub(super) dry_run: bool,
    /// One line of JSON per load on stdout.
    #[arg(long, help_heading = OUTPUT)]
    pub(super) json: bool,
}

impl SolveArgs {
    /// The scene of these flags, in consistent units.
    ///
    /// # Errors
    /// What has no value in a scene: a list of the wrong length, an adhesion without its range, settings of no method.
    pub(super) fn scene(&self) -> Result<Scene> {
        refuse_grid(self.grid, self.surface_file(), !self.file_flags.are_waves())?;
        if let Some(flag) = self.map.of_maps().filter(|_| self.challenge.is_some()) {
            return Err(Error::input(COMMAND_LINE, flag, "given", "only together with a file, not with --challenge"));
        }
        let units = self.solve_units()?;
        let modulus: Option<Stress> = self.modulus.map(|m| units.plain("--modulus", m)).transpose()?;
        let mut laboratory = LaboratoryScene {
            // A missing modulus is reported with all else that is missing.
            modulus: modulus.or(self.body.is_empty().then(|| Stress::plain(f64::NAN))),
            bodies: self.body.iter().map(|body| body.scene(units.stress_pa)).collect::<Result<_>>()?,
            ..LaboratoryScene::default()
        };
        if self.challenge.is_some() {
            // Reduced units.
            laboratory.length = Some(Length::plain(1.0));
            laboratory.modulus = Some(modulus.unwrap_or(Stress::plain(1.0)));
        }
        let loads = self.loads.scene(&units)?;
        let adhesion = self.adhesion(&units)?;
        let mut continuum = self.continuum(&units)?;
        let mut surface = self.surface();
        surface.cut_off = self.cut_off.map(|m| units.plain("--cut-off", m)).transpose()?;
        self.map.set(&mut surface, &mut laboratory, &mut continuum, &|flag, m| units.plain(flag, m))?;
        if let Some(seed) = self.seed.filter(|_| !surface.has_seed()) {
            let accepted = "only together with --challenge, --extend-to or --isotropic-map";
            return Err(Error::input(COMMAND_LINE, "--seed", seed, accepted));
        }
        Ok(Scene {
            load: LoadScene { unload: self.unload, pull_off: self.pull_off, ..loads },
            laboratory,
            adhesion,
            continuum,
            accuracy: accuracy(self.error.as_ref(), self.budget)?,
            methods: self.settings()?,
            ..Scene::new("solve", surface)
        })
    }

    /// Every measure with a dimension, by its flag.
    fn measures(&self) -> Vec<(&'static str, Measure)> {
        let single = [
            ("--modulus", self.modulus),
            ("--cut-off", self.cut_off),
            ("--shear-strength", self.shear_strength),
            ("--work-of-adhesion", self.work_of_adhesion),
            ("--range", self.range),
            ("--penalty-length", self.penalty_length),
            ("--hardness", self.hardness),
            ("--thickness", self.thickness),
        ];
        let lists = [
            ("--pressure", &self.loads.pressure),
            ("--force", &self.loads.force),
            ("--mean-gap", &self.loads.mean_gap),
            ("--displacement", &self.loads.displacement),
            ("--subsurface", &self.subsurface),
        ];
        let single = self.map.lengths().into_iter().chain(single).filter_map(|(flag, m)| Some((flag, m?)));
        let single = single.chain(self.map.further_lengths());
        let single = single.chain(self.body.iter().flat_map(BodyFlag::stresses).map(|m| ("--body", m)));
        let of_lists = lists
            .into_iter()
            .flat_map(|(flag, list)| list.iter().flat_map(move |l| l.0.iter().map(move |m| (flag, *m))));
        single.chain(of_lists).collect()
    }

    /// The unit of stresses, which is that of the modulus.
    pub(super) fn stress_unit(&self) -> Option<&'static Unit> {
        self.modulus.or(self.body.first().map(|body| body.young))?.unit
    }

    /// # Errors
    /// A modulus that is no stress; values with units together with others without.
    fn solve_units(&self) -> Result<SolveUnits> {
        let measures = self.measures();
        SolveUnits::refuse_mixed(&measures)?;
        let stress_pa = self.stress_unit().map(|unit| unit.si);
        let is_length = |m: &Measure| m.unit.is_some_and(|unit| unit.dimension != Dimension::Stress);
        let needed = measures.iter().any(|(_, m)| is_length(m));
        let length_m = match self.challenge {
            // The unit of the cell's extent.
            Some(_) => self.map.length.and_then(|m| Some(m.unit?.si)),
            None => self.map.heights_m(self.surface_file().filter(|_| needed), &self.file_flags)?,
        };
        Ok(SolveUnits { length_m, stress_pa })
    }

    fn continuum(&self, units: &SolveUnits) -> Result<ContinuumScene> {
        let thickness = self.thickness.map(|m| units.plain("--thickness", m)).transpose()?;
        Ok(ContinuumScene {
            method: self.method.clone(),
            precision: self.precision,
            tolerance: self.tolerance,
            max_iterations: self.max_iterations,
            initial_gap: self.initial_gap.clone(),
            leakage: self.leakage,
            subsurface: self.subsurface(units)?,
            periodic: None,
            layer: thickness.map(|thickness| LayerScene {
                thickness,
                poisson: self.poisson.unwrap_or(0.3),
                base: self.base,
            }),
            crystal: self.crystal()?,
            wall: self.wall,
            penalty_length: self.penalty_length.map(|m| units.plain("--penalty-length", m)).transpose()?,
            hardness: self.hardness.map(|m| units.plain("--hardness", m)).transpose()?,
            hardness_map: self.hardness_map.clone(),
            hardness_map_unit: self.hardness_map_unit(units)?,
            compare_with: Vec::new(),
        })
    }

    fn surface(&self) -> SurfaceScene {
        let standard = SurfaceScene::default();
        let (grid, heights) = match self.challenge {
            Some(n) => (n, None),
            None if self.file_flags.are_waves() => (self.grid.unwrap_or(0), self.surface_file().map(PathBuf::from)),
            None => (standard.grid, self.surface_file().map(PathBuf::from)),
        };
        let mut scene = SurfaceScene { grid, seed: self.seed.unwrap_or(standard.seed), heights, ..standard };
        self.file_flags.set(&mut scene);
        scene
    }

    /// Without a range there is no adhesion to check, but for the complaint that the range is missing.
    fn adhesion(&self, units: &SolveUnits) -> Result<Option<AdhesionScene>> {
        let work = self.work_of_adhesion.map(|m| units.plain("--work-of-adhesion", m)).transpose()?;
        let range = self.range.map(|m| units.plain("--range", m)).transpose()?;
        let given = work.is_some_and(|work: Work| work.value() != 0.0) || range.is_some();
        Ok(given.then(|| AdhesionScene {
            law: self.law,
            work_of_adhesion: work.unwrap_or(Work::plain(0.0)),
            range: range.unwrap_or(Length::plain(f64::NAN)),
            resolution: self.resolution,
            also_nonadhesive: false,
            other_ranges: Vec::new(),
        }))
    }

    /// Only the ratios of the constants count, so that their unit may be another than that of the modulus.
    fn crystal(&self) -> Result<Option<CrystalScene>> {
        let Some(Measures(list)) = &self.crystal else { return Ok(None) };
        let stress = |m: &Measure| m.of(Dimension::Stress).map_err(|accepted| refused("--crystal", *m, accepted));
        let list: Vec<Stress> = list.iter().map(|m| stress(m).map(|m| Stress::plain(m.si()))).collect::<Result<_>>()?;
        match list[..] {
            [c11, c12, c44] => Ok(Some(CrystalScene { c11, c12, c44 })),
            _ => {
                let found = format!("{} numbers", list.len());
                Err(Error::input(COMMAND_LINE, "--crystal", found, "three: C11,C12,C44"))
            }
        }
    }

    /// Settings of single methods.
    fn settings(&self) -> Result<Settings> {
        // KEY=VALUE is TOML, except that words have no quotes.
        let quoted = |given_value: &String| match given_value.split_once('=') {
            Some((key, value)) if given_value.parse::<toml::Table>().is_err() => format!("{key} = {:?}", value.trim()),
            _ => given_value.clone(),
        };
        let lines: Vec<String> = self.set.iter().map(quoted).collect();
        toml::from_str(&lines.join("\n")).map_err(|e| {
            let found = format!("{} ({})", self.set.join(" "), e.message());
            let accepted = "METHOD.KEY=VALUE, as `asperity schema` lists them under methods";
            Error::input(COMMAND_LINE, "--set", found, accepted)
        })
    }

    fn subsurface(&self, units: &SolveUnits) -> Result<Option<SubsurfaceScene>> {
        let has_layer = self.thickness.is_some();
        if self.subsurface.is_none() {
            return match self.poisson {
                Some(nu) if !has_layer => {
                    let accepted = "only together with --thickness or --subsurface";
                    Err(Error::input(COMMAND_LINE, "--poisson", nu, accepted))
                }
                _ => Ok(None),
            };
        }
        Ok(Some(SubsurfaceScene {
            depths: list("--subsurface", &self.subsurface, units)?,
            poisson: self.poisson.filter(|_| !has_layer),
            shear_strength: self.shear_strength.map(|m| units.plain("--shear-strength", m)).transpose()?,
        }))
    }

    /// In the unit of the modulus.
    fn hardness_map_unit(&self, units: &SolveUnits) -> Result<Option<Stress>> {
        let Some(text) = &self.hardness_map_unit else { return Ok(None) };
        let unit = Unit::find(text).ok_or_else(|| {
            Error::input(COMMAND_LINE, "--hardness-map-unit", text, "a unit of stress: Pa, kPa, MPa, GPa")
        })?;
        units.plain("--hardness-map-unit", Measure { value: 1.0, unit: Some(unit) }).map(Some)
    }

    pub(super) fn surface_file(&self) -> Option<&Path> {
        self.file.as_ref().or(self.heights.as_ref()).map(PathBuf::as_path)
    }

    /// The flag of a key that these flags set.
    pub(super) fn flag_of(&self, key: &str) -> Option<String> {
        let flag = match key {
            "surface.grid" if self.challenge.is_some() => "--challenge",
            "surface.roll_off" => "the roll-off wavelength",
            "load.p_star_range" => "--p-star",
            "continuum.layer" => "--thickness",
            "continuum.crystal.c11" => "--crystal, C11",
            "continuum.crystal.c12" => "--crystal, C12",
            "continuum.crystal.c44" => "--crystal, C44",
            "continuum.subsurface.depths" => "--subsurface",
            "continuum.compare_with" => "`run --compare-with`",
            _ => return flag_of::<Self>(key),
        };
        Some(flag.into())
    }
}
