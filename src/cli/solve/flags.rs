//! Flags of `solve`, and the scene that they make.

use super::loads::{LoadFlags, LoadItem, LoadUnits, expanded};
use crate::cli::file::{COMMAND_LINE, FILE_FLAGS, FileFlags, Lengths, MapFlags, refuse_grid};
use crate::interface::{Base, RangeChoice};
use crate::method::{Precision, Settings};
use crate::scene::KeyName;
use crate::scene::{
    AdhesionLaw, AdhesionScene, ContinuumScene, CrystalScene, Laboratory, LayerScene, LoadScene, Scene,
    SubsurfaceScene, SurfaceScene, Units, WallKind,
};
use crate::surface::Spectrum;
use crate::units::{Measure, pascals_per};
use crate::{Error, Result};
use std::path::{Path, PathBuf};
use std::str::FromStr;

// Headings of the help.
const SURFACE: &str = "Surface";
const MODEL: &str = "Contact model";
const LOADS: &str = "Loads";
const SOLVER: &str = "Solver";
const OUTPUT: &str = "Output";

/// Consistent units: lengths in that of the heights, stresses in that of the modulus.
// A negative value is refused by its flag's own check, not taken for a flag.
#[derive(Debug, Clone, clap::Args)]
#[command(allow_negative_numbers = true)]
pub(crate) struct Solve {
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
    /// Seed of the challenge's surface.
    #[arg(long, value_name = "N", default_value_t = SurfaceScene::default().seed, requires = "challenge", help_heading = SURFACE)]
    pub(super) seed: u64,
    /// Short cut-off wavelength of the challenge's surface, in units of the cell's extent.
    #[arg(long, value_name = "LAMBDA", default_value_t = Spectrum::CHALLENGE.lambda_s, requires = "challenge", help_heading = SURFACE)]
    pub(super) cut_off: f64,
    /// Contact modulus E* = E/(1-ν²), with or without a unit (2MPa); required for a file.
    #[arg(long, value_name = "E", allow_hyphen_values = true, help_heading = MODEL)]
    pub(super) modulus: Option<Measure>,
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
    #[arg(long, value_name = "DEPTHS", value_delimiter = ',', num_args = 1, allow_hyphen_values = true, help_heading = OUTPUT)]
    pub(super) subsurface: Vec<LoadItem>,
    /// Shear stress at which the body yields, with or without a unit: the largest shear stress is stated over it.
    #[arg(long, value_name = "TAU", requires = "subsurface", allow_hyphen_values = true, help_heading = OUTPUT)]
    pub(super) shear_strength: Option<Measure>,
    /// Gap to start from (.npy), in the unit of the heights, as written to --out.
    #[arg(long, value_name = "FILE", help_heading = LOADS)]
    pub(super) initial_gap: Option<PathBuf>,
    /// Work of adhesion γ, with a unit (50mJ/m2) or in that of modulus times length.
    #[arg(long, alias = "gamma", value_name = "GAMMA", allow_hyphen_values = true, help_heading = MODEL)]
    pub(super) work_of_adhesion: Option<Measure>,
    /// Range ρ of the adhesion, with a unit (2nm) or in that of the heights.
    #[arg(long, alias = "rho", requires = "work_of_adhesion", value_name = "RHO", allow_hyphen_values = true, help_heading = MODEL)]
    pub(super) adhesion_range: Option<Measure>,
    /// Treatment of an adhesion range that the grid does not resolve.
    #[arg(long, value_enum, default_value_t = RangeChoice::Mesh, help_heading = MODEL)]
    pub(super) range: RangeChoice,
    /// Decay of the attraction with the gap.
    #[arg(long, value_enum, default_value_t = AdhesionLaw::Exponential, requires = "work_of_adhesion", help_heading = MODEL)]
    pub(super) law: AdhesionLaw,
    /// Repulsion between the surfaces.
    #[arg(long, value_enum, default_value_t = WallKind::Hard, help_heading = MODEL)]
    pub(super) wall: WallKind,
    /// Compression of the penalty wall under a pressure of E*, with or without a unit.
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, help_heading = MODEL)]
    pub(super) penalty_length: Option<Measure>,
    /// Hardness, with or without a unit of stress, or a file with that of every point of the surface: the largest contact stress.
    /// Where it is reached, the surface flows; unloading is elastic. With the methods fast, bvm and gfmd.
    #[arg(long, value_name = "H|FILE", allow_hyphen_values = true, help_heading = MODEL)]
    pub(super) hardness: Option<HardnessFlag>,
    /// Unit of the values in that file, such as GPa. Default: that of the modulus.
    #[arg(long, value_name = "UNIT", requires = "hardness", help_heading = MODEL)]
    pub(super) hardness_unit: Option<String>,
    /// An id from `asperity methods`, or auto.
    #[arg(long, default_value = "auto", value_name = "ID", help_heading = SOLVER)]
    pub(super) method: String,
    /// A setting of a method as KEY=VALUE, such as winkler.spring_length=0.0034; `asperity schema` lists them under methods.
    #[arg(long, value_name = "KEY=VALUE", help_heading = SOLVER)]
    pub(super) set: Vec<String>,
    /// Largest rms KKT residual over the pressure. Default: 1e-8 in f64; 1e-3 in f32, more beyond 1024 x 1024 points.
    #[arg(long, alias = "tol", value_name = "RESIDUAL", help_heading = SOLVER)]
    pub(super) tolerance: Option<f64>,
    /// Largest relative excess of the energy over its minimum, as `fast` estimates it.
    #[arg(long, value_name = "FRACTION", help_heading = SOLVER)]
    pub(super) energy_tolerance: Option<f64>,
    /// Largest estimated relative change of the contact area.
    #[arg(long, value_name = "FRACTION", help_heading = SOLVER)]
    pub(super) area_tolerance: Option<f64>,
    /// Largest estimated relative change of the mean gap.
    #[arg(long, value_name = "FRACTION", help_heading = SOLVER)]
    pub(super) mean_gap_tolerance: Option<f64>,
    /// Floating-point type of the fields; sums are always f64.
    #[arg(long, value_enum, default_value_t = Precision::F64, help_heading = SOLVER)]
    pub(super) precision: Precision,
    /// Limit of iterations per load.
    #[arg(long, default_value_t = 50_000, value_name = "N", help_heading = SOLVER)]
    pub(super) max_iterations: usize,
    /// Elastic layer of this thickness instead of the half-space, with or without a unit (50um).
    #[arg(long, value_name = "T", allow_hyphen_values = true, help_heading = MODEL)]
    pub(super) thickness: Option<Measure>,
    /// Poisson's ratio: of a layer (default: 0.3), or of the half-space, for the stress below its surface.
    #[arg(long, value_name = "NU", help_heading = MODEL)]
    pub(super) poisson: Option<f64>,
    /// The layer's lower face.
    #[arg(long, value_enum, default_value_t = Base::Bonded, requires = "thickness", help_heading = MODEL)]
    pub(super) base: Base,
    /// Elastic constants of a cubic half-space, (001) face, x along [100]. Only their ratios matter: E* is --modulus.
    #[arg(long, value_name = "C11,C12,C44", value_delimiter = ',', num_args = 1, help_heading = MODEL)]
    pub(super) crystal: Vec<f64>,
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

/// A hardness on the command line.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum HardnessFlag {
    Value(Measure),
    Map(PathBuf),
}

impl FromStr for HardnessFlag {
    type Err = <Measure as FromStr>::Err;

    /// What begins as a number is one, unless a file has this name.
    fn from_str(text: &str) -> std::result::Result<Self, Self::Err> {
        let is_number = text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        match text.parse() {
            Ok(measure) => Ok(HardnessFlag::Value(measure)),
            Err(error) if is_number && !Path::new(text).exists() => Err(error),
            Err(_) => Ok(HardnessFlag::Map(text.into())),
        }
    }
}

impl Solve {
    /// The scene of these flags, in consistent units.
    ///
    /// # Errors
    /// What has no value in a scene: a list of the wrong length, an adhesion without its range, settings of no method.
    pub(super) fn scene(&self) -> Result<Scene> {
        refuse_grid(self.grid, self.surface_file(), !self.file_flags.are_waves())?;
        if let Some(flag) = self.map.of_maps().filter(|_| self.challenge.is_some()) {
            return Err(Error::input(COMMAND_LINE, flag, "given", "only together with a file, not with --challenge"));
        }
        let measures = [&self.work_of_adhesion, &self.adhesion_range, &self.penalty_length, &self.thickness];
        let has_unit = |measure: &Option<Measure>| measure.as_ref().is_some_and(|m| m.unit.is_some());
        let depth_unit = self.subsurface.iter().any(|depth| depth.from.unit.is_some());
        let needed = self.loads.need_heights_unit() || depth_unit || measures.into_iter().any(has_unit);
        let lengths = Lengths::new(self.surface_file(), &self.file_flags, &self.map, Units::Consistent, needed)?;
        let mut laboratory = Laboratory {
            contact_modulus_mpa: self.modulus.as_ref().map(|m| m.value),
            units: Units::Consistent,
            ..Laboratory::default()
        };
        if self.challenge.is_some() {
            // Reduced units.
            laboratory.length_um = Some(1.0);
            laboratory.contact_modulus_mpa.get_or_insert(1.0);
        }
        let units = LoadUnits { lengths: &lengths, modulus_pa: self.modulus_pa()? };
        let loads = self.loads.scene(&units)?;
        let adhesion = self.adhesion(&units)?;
        let mut continuum = self.continuum(&units)?;
        let mut surface = self.surface();
        self.map.set(&mut surface, &mut laboratory, &mut continuum, &lengths)?;
        if self.challenge.is_some() {
            surface.cut_off_um = Some(self.cut_off * laboratory.length());
        }
        Ok(Scene {
            load: LoadScene { unload: self.unload, pull_off: self.pull_off, ..loads },
            laboratory,
            adhesion,
            continuum,
            methods: self.settings()?,
            ..Scene::new("solve", surface)
        })
    }

    fn continuum(&self, units: &LoadUnits) -> Result<ContinuumScene> {
        let length =
            |flag: &str, given: &Option<Measure>| given.as_ref().map(|m| units.lengths.of(flag, m)).transpose();
        let thickness = length("--thickness", &self.thickness)?;
        let [hardness_mpa, hardness_map_unit_mpa] = self.hardness(units)?;
        Ok(ContinuumScene {
            method: self.method.clone(),
            precision: self.precision,
            tolerance: self.tolerance,
            max_iterations: self.max_iterations,
            energy_tolerance: self.energy_tolerance,
            area_tolerance: self.area_tolerance,
            mean_gap_tolerance: self.mean_gap_tolerance,
            initial_gap: self.initial_gap.clone(),
            leakage: self.leakage,
            subsurface: self.subsurface(units)?,
            periodic: None,
            layer: thickness.map(|thickness_um| LayerScene {
                thickness_um,
                poisson: self.poisson.unwrap_or(0.3),
                base: self.base,
            }),
            crystal: self.crystal()?,
            wall: self.wall,
            penalty_length_nm: length("--penalty-length", &self.penalty_length)?,
            hardness_mpa,
            hardness_map: self.hardness_file().map(PathBuf::from),
            hardness_map_unit_mpa,
            compare_with: Vec::new(),
        })
    }

    /// Pascals of one unit of the modulus, if it has one.
    fn modulus_pa(&self) -> Result<Option<f64>> {
        let Some(Measure { value, unit: Some(unit) }) = &self.modulus else { return Ok(None) };
        let refused = || {
            Error::input(COMMAND_LINE, "--modulus", format!("{value} {unit}"), "a unit of stress: Pa, kPa, MPa, GPa")
        };
        pascals_per(unit).ok_or_else(refused).map(Some)
    }

    fn surface(&self) -> SurfaceScene {
        let standard = SurfaceScene::default();
        match self.challenge {
            Some(n) => SurfaceScene {
                grid: n,
                seed: self.seed,
                dataset: self.file_flags.dataset.clone(),
                fourier: self.file_flags.fourier,
                fourier_points: self.file_flags.fourier_points,
                ..standard
            },
            None => SurfaceScene {
                grid: self.grid.unwrap_or(0),
                heights: self.surface_file().map(PathBuf::from),
                dataset: self.file_flags.dataset.clone(),
                fourier: self.file_flags.fourier,
                fourier_points: self.file_flags.fourier_points,
                ..standard
            },
        }
    }

    /// Without a range there is no adhesion to check, but for the complaint that the range is missing.
    fn adhesion(&self, units: &LoadUnits) -> Result<Option<AdhesionScene>> {
        let work =
            self.work_of_adhesion.as_ref().map(|m| units.energy_per_area("--work-of-adhesion", m)).transpose()?;
        let range = self.adhesion_range.as_ref().map(|m| units.lengths.of("--adhesion-range", m)).transpose()?;
        let given = work.is_some_and(|work| work != 0.0) || range.is_some();
        Ok(given.then(|| AdhesionScene {
            law: self.law,
            work_of_adhesion_mj_m2: work.unwrap_or(0.0),
            range_nm: range.unwrap_or(f64::NAN),
            range: self.range,
            also_nonadhesive: false,
            other_ranges_nm: Vec::new(),
            table: None,
        }))
    }

    fn crystal(&self) -> Result<Option<CrystalScene>> {
        match self.crystal[..] {
            [] => Ok(None),
            [c11_gpa, c12_gpa, c44_gpa] => Ok(Some(CrystalScene { c11_gpa, c12_gpa, c44_gpa })),
            _ => {
                let found = format!("{} numbers", self.crystal.len());
                Err(Error::input(COMMAND_LINE, "--crystal", found, "three: C11,C12,C44"))
            }
        }
    }

    /// Settings of single methods.
    fn settings(&self) -> Result<Settings> {
        // KEY=VALUE is TOML, except that words have no quotes.
        let quoted = |given: &String| match given.split_once('=') {
            Some((key, value)) if given.parse::<toml::Table>().is_err() => format!("{key} = {:?}", value.trim()),
            _ => given.clone(),
        };
        let lines: Vec<String> = self.set.iter().map(quoted).collect();
        toml::from_str(&lines.join("\n")).map_err(|e| {
            let found = format!("{} ({})", self.set.join(" "), e.message());
            let accepted = "METHOD.KEY=VALUE, as `asperity schema` lists them under methods";
            Error::input(COMMAND_LINE, "--set", found, accepted)
        })
    }

    fn subsurface(&self, units: &LoadUnits) -> Result<Option<SubsurfaceScene>> {
        let has_layer = self.thickness.is_some();
        if self.subsurface.is_empty() {
            return match self.poisson {
                Some(nu) if !has_layer => {
                    let accepted = "only together with --thickness or --subsurface";
                    Err(Error::input(COMMAND_LINE, "--poisson", nu, accepted))
                }
                _ => Ok(None),
            };
        }
        let length = |m: &Measure| units.lengths.of("--subsurface", m);
        let stress = |m: &Measure| units.stress("--shear-strength", m);
        Ok(Some(SubsurfaceScene {
            depths_um: expanded("--subsurface", &self.subsurface, &length)?,
            poisson: self.poisson.filter(|_| !has_layer),
            shear_strength_mpa: self.shear_strength.as_ref().map(stress).transpose()?,
        }))
    }

    /// The file of a hardness map.
    pub(super) fn hardness_file(&self) -> Option<&Path> {
        match &self.hardness {
            Some(HardnessFlag::Map(file)) => Some(file),
            _ => None,
        }
    }

    /// The hardness, and the unit of a map, in that of the modulus.
    fn hardness(&self, units: &LoadUnits) -> Result<[Option<f64>; 2]> {
        let unit = self.hardness_unit.as_ref().map(|unit| Measure { value: 1.0, unit: Some(unit.clone()) });
        let stress = |flag: &'static str, m: &Measure| units.stress(flag, m);
        let value = match &self.hardness {
            Some(HardnessFlag::Value(value)) => Some(stress("--hardness", value)?),
            _ => None,
        };
        Ok([value, unit.map(|m| stress("--hardness-unit", &m)).transpose()?])
    }

    pub(super) fn surface_file(&self) -> Option<&Path> {
        self.file.as_ref().or(self.heights.as_ref()).map(PathBuf::as_path)
    }

    /// The flag of every key that these flags can set.
    pub(super) fn flag_names(&self) -> Vec<KeyName> {
        let grid = if self.challenge.is_some() { "--challenge" } else { "--grid" };
        let mut names = vec![("surface.grid", grid)];
        names.extend(FILE_FLAGS);
        names.extend(FLAGS);
        names
    }
}

/// Keys and their flags beyond those of surface files; of keys that begin alike the longest first.
const FLAGS: [KeyName; 45] = [
    ("laboratory.contact_modulus_mpa", "--modulus"),
    ("surface.seed", "--seed"),
    ("surface.cut_off_um", "--cut-off"),
    ("surface.roll_off_um", "the roll-off wavelength"),
    ("load.pressure_mpa", "--pressure"),
    ("load.mean_gap_um", "--mean-gap"),
    ("load.pull_off", "--pull-off"),
    ("load.force_mn", "--force"),
    ("load.displacement_um", "--displacement"),
    ("load.contact", "--contact"),
    ("load.unload", "--unload"),
    ("load.p_star_range", "--p-star"),
    ("load.p_star", "--p-star"),
    ("adhesion.work_of_adhesion_mj_m2", "--work-of-adhesion"),
    ("adhesion.range_nm", "--adhesion-range"),
    ("adhesion.range", "--range"),
    ("adhesion.law", "--law"),
    ("[adhesion]", "--work-of-adhesion"),
    ("continuum.method", "--method"),
    ("continuum.precision", "--precision"),
    ("continuum.tolerance", "--tolerance"),
    ("continuum.max_iterations", "--max-iterations"),
    ("continuum.energy_tolerance", "--energy-tolerance"),
    ("continuum.area_tolerance", "--area-tolerance"),
    ("continuum.mean_gap_tolerance", "--mean-gap-tolerance"),
    ("continuum.leakage", "--leakage"),
    ("continuum.initial_gap", "--initial-gap"),
    ("continuum.periodic", "--non-periodic"),
    ("continuum.layer.thickness_um", "--thickness"),
    ("continuum.layer.poisson", "--poisson"),
    ("continuum.layer", "--thickness"),
    ("continuum.crystal.c11_gpa", "--crystal, C11"),
    ("continuum.crystal.c12_gpa", "--crystal, C12"),
    ("continuum.crystal.c44_gpa", "--crystal, C44"),
    ("continuum.crystal", "--crystal"),
    ("continuum.wall", "--wall"),
    ("continuum.penalty_length_nm", "--penalty-length"),
    ("continuum.hardness_mpa", "--hardness"),
    ("continuum.subsurface.depths_um", "--subsurface"),
    ("continuum.subsurface.poisson", "--poisson"),
    ("continuum.subsurface.shear_strength_mpa", "--shear-strength"),
    ("continuum.subsurface", "--subsurface"),
    ("continuum.hardness_map_unit_mpa", "--hardness-unit"),
    ("continuum.hardness_map", "--hardness"),
    ("continuum.compare_with", "`run --compare-with`"),
];
