//! The tables of a scene file.

use super::accuracy::AccuracyScene;
use super::atoms_scene::AtomsScene;
use super::detrend::DetrendScene;
use super::laboratory::LaboratoryScene;
use super::load::LoadScene;
use super::quantity::{Length, List, Stress, Work, dimension, list, unit};
use asperity_contact::interface::{Base, RangeChoice};
use asperity_contact::method::{Precision, Settings};
use asperity_contact::problem::{Accuracy, AdhesionLaw, MAX_ITERATIONS};
use asperity_surface::heights::Touching;
use asperity_surface::import::Fourier;
use asperity_surface::{Amplitudes, Edges, Fill, FilterKind};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A rough surface, its loads, its material, and the requested methods and outputs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Names the run folder.
    pub name: String,
    /// Printed at the top of the report.
    #[serde(default)]
    pub description: String,
    #[serde(default)]
    pub laboratory: LaboratoryScene,
    pub surface: SurfaceScene,
    pub load: LoadScene,
    /// Default: no adhesion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adhesion: Option<AdhesionScene>,
    #[serde(default)]
    pub continuum: ContinuumScene,
    /// Default: one grid, that of the surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<AccuracyScene>,
    /// Settings of single methods.
    #[serde(default, skip_serializing_if = "asperity_surface::files::json::is_default")]
    pub methods: Settings,
    /// Default: no acceptance checks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub challenge: Option<ChallengeScene>,
    /// Default: no atomistic simulation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub atoms: Option<AtomsScene>,
}

impl Scene {
    /// The files that the scene names, with their keys, besides programs.
    pub fn inputs_mut(&mut self) -> Vec<(&'static str, &mut PathBuf)> {
        let (surface, continuum) = (&mut self.surface, &mut self.continuum);
        let files = [
            ("surface.heights", surface.heights.as_mut()),
            ("surface.other.heights", surface.other.as_mut().map(|other| &mut other.heights)),
            ("continuum.initial_gap", continuum.initial_gap.as_mut()),
            ("continuum.hardness_map", continuum.hardness_map.as_mut()),
            ("atoms.potential", self.atoms.as_mut().and_then(|atoms| atoms.potential.as_mut())),
        ];
        files.into_iter().filter_map(|(key, file)| Some((key, file?))).collect()
    }

    /// The accuracy that the scene asks for.
    pub fn accuracy(&self) -> Option<Accuracy> {
        self.accuracy.as_ref()?.asked()
    }

    /// The hardness, or that of the softer body.
    pub fn hardness(&self) -> Option<Stress> {
        self.continuum.hardness.or(self.laboratory.hardness())
    }

    /// A scene of a surface at the reference load, with all defaults.
    pub fn new(name: &str, surface: SurfaceScene) -> Self {
        Scene {
            name: name.into(),
            description: String::new(),
            laboratory: LaboratoryScene::default(),
            surface,
            load: LoadScene { p_star: vec![REFERENCE_LOAD], ..LoadScene::default() },
            adhesion: None,
            continuum: ContinuumScene::default(),
            accuracy: None,
            methods: Settings::default(),
            challenge: None,
            atoms: None,
        }
    }
}

/// A surface made from its spectrum, or read from a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SurfaceScene {
    /// Points per side of the grid on which the continuum is solved (a synthesised surface, or one from Fourier coefficients;
    /// a height map keeps its points).
    pub grid: usize,
    /// Seed of the random phases and amplitudes: of a synthesised surface, of the waves that `extend_to` adds, or of `isotropic_map`.
    pub seed: u64,
    /// Hurst exponent H, 0 < H ≤ 1.
    pub hurst: f64,
    /// Roll-off wavelength λ_r. Give this or `roll_off_mode` = L/λ_r.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roll_off: Option<Length>,
    /// L/λ_r. Default: 5.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roll_off_mode: Option<f64>,
    /// Short cut-off wavelength λ_s. Give this or `cut_off_mode` = L/λ_s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cut_off: Option<Length>,
    /// L/λ_s. Default: 1000.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cut_off_mode: Option<f64>,
    /// rms gradient of the whole Fourier sum.
    pub rms_gradient: f64,
    /// Moduli of the Fourier coefficients.
    pub amplitudes: Amplitudes,
    /// A file to use instead: a height map (text, `.npy`, `.npz`, HDF5, NetCDF, `.x3p`, `.sdf`, `.sur`, `.gwy`), or Fourier
    /// coefficients qX qY Re Im (text, or an array of four columns). Relative to the scene file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heights: Option<PathBuf>,
    /// Unit of the heights in the file, such as "um", "Å" or "0.1 mm". Default: what the file declares; required if it declares none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Name of the array or channel in a file with several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dataset: Option<String>,
    /// Read the file by SurfaceTopography, in the Python that `ASPERITY_PYTHON` names, or `python3`: files of instruments, containers of
    /// contact.engineering. `dataset` is the name or number of a channel or measurement.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub via_python: bool,
    /// The file is a profile: positions and heights in two columns, or one line of heights. The surface is uniform along y (line contact).
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub profile: bool,
    /// Kind of the coefficients in four columns qX qY Re Im; required for them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fourier: Option<Fourier>,
    /// Points per side of the grid whose transform gave the `"fftw"` coefficients.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fourier_points: Option<usize>,
    /// Points of the file that touch first; required for a file that does not declare it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub touching: Option<Touching>,
    /// Part of a map that is kept: first column, first row, columns, rows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crop: Option<[usize; 4]>,
    /// Points of a map that deviate from the median of their neighbourhood by more than this many robust standard deviations
    /// become missing points.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub remove_outliers: Option<f64>,
    /// How missing points of a map are filled. Default: a map with missing points is refused.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fill: Option<Fill>,
    /// Form that is subtracted from a map. Three points are lengths along x and y from the first point of the map, or of the part that is kept; the
    /// plane goes through the mean heights of the measured points next to them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub detrend: Option<DetrendScene>,
    /// Shortest wavelength kept of Fourier coefficients or of a map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub low_pass: Option<Length>,
    /// Longest wavelength kept of a map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub high_pass: Option<Length>,
    /// Transfer function of these filters for a map. Default: Gaussian.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub filter: Option<FilterKind>,
    /// Columns and rows to which a map is resampled.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resample: Option<[usize; 2]>,
    /// Makes a map periodic that is not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub edges: Option<Edges>,
    /// Shortest of the waves that are added to a map below `low_pass`, down to which it is trusted: a realisation, by `seed`, of the self-affine
    /// spectrum that is fitted to its waves above.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub extend_to: Option<Length>,
    /// Instead of a surface that is uniform along y, of a profile: one realisation, by `seed`, of the isotropic random surface whose profiles have
    /// its spectrum. The cell is a square of its length, and repeats.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub isotropic_map: bool,
    /// A second rough body, which faces this one. Default: it is flat.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub other: Option<OtherScene>,
    /// Warnings about the surface are errors, and so is an accuracy that is not reached.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub strict: bool,
}

/// The height map of a second rough body. Its heights are added to those of the first. A crop is that of the first map, resampling and edges are
/// those of the sum, and all other steps of preparation are applied to both.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OtherScene {
    /// File of its height map. Relative to the scene file.
    pub heights: PathBuf,
    /// Unit of the heights in the file. Default: what the file declares, or `surface.unit`, if that is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Name of the array or channel in a file with several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dataset: Option<String>,
    /// Read the file by SurfaceTopography, as `surface.via_python`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub via_python: bool,
    /// Points of the file that touch first. Default: what the file declares, or `surface.touching`, if that is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub touching: Option<Touching>,
    /// Extent in x. Default: what the file declares, or that of the first map where both have as many points.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length: Option<Length>,
    /// Extent in y. Default: what the file declares, or square pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_y: Option<Length>,
    /// Whether the map, seen as it was measured, is turned over about its y axis, as one that is laid face down: x is mirrored.
    #[serde(default = "yes")]
    pub turned_over: bool,
    /// Quarter turns from x towards y, 0 to 3, after it is turned over.
    #[serde(default)]
    pub quarter_turns: u8,
    /// Shift along x and y, after the turns.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shift: Option<[Length; 2]>,
}

impl OtherScene {
    /// A file, turned over, with what it declares.
    pub fn new(heights: PathBuf) -> Self {
        OtherScene {
            heights,
            unit: None,
            dataset: None,
            via_python: false,
            touching: None,
            length: None,
            length_y: None,
            turned_over: true,
            quarter_turns: 0,
            shift: None,
        }
    }
}

fn yes() -> bool {
    true
}

/// What a surface is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SurfaceKind {
    Spectrum,
    /// A file of heights.
    Map,
    /// A file of Fourier coefficients.
    Waves,
}

impl SurfaceScene {
    /// Whether its seed has a meaning.
    pub fn has_seed(&self) -> bool {
        self.heights.is_none() || self.extend_to.is_some() || self.isotropic_map
    }

    /// Keys with another value than the default's that surfaces of a kind do not have.
    pub fn foreign_keys(&self, kind: SurfaceKind) -> Vec<&'static str> {
        use SurfaceKind::{Map, Spectrum, Waves};
        let usual = SurfaceScene::default();
        let keys: [(&str, bool, &[SurfaceKind]); 28] = [
            ("surface.grid", self.grid != usual.grid, &[Spectrum, Waves]),
            ("surface.seed", self.seed != usual.seed && !self.has_seed(), &[Spectrum]),
            ("surface.hurst", self.hurst != usual.hurst, &[Spectrum]),
            ("surface.roll_off", self.roll_off.is_some(), &[Spectrum]),
            ("surface.roll_off_mode", self.roll_off_mode.is_some(), &[Spectrum]),
            ("surface.cut_off", self.cut_off.is_some(), &[Spectrum]),
            ("surface.cut_off_mode", self.cut_off_mode.is_some(), &[Spectrum]),
            ("surface.rms_gradient", self.rms_gradient != usual.rms_gradient, &[Spectrum]),
            ("surface.amplitudes", self.amplitudes != usual.amplitudes, &[Spectrum]),
            ("surface.unit", self.unit.is_some(), &[Map, Waves]),
            ("surface.dataset", self.dataset.is_some(), &[Map, Waves]),
            ("surface.via_python", self.via_python, &[Map, Waves]),
            ("surface.profile", self.profile, &[Map, Waves]),
            ("surface.fourier", self.fourier.is_some(), &[Map, Waves]),
            ("surface.fourier_points", self.fourier_points.is_some(), &[Map, Waves]),
            ("surface.touching", self.touching.is_some(), &[Map, Waves]),
            ("surface.crop", self.crop.is_some(), &[Map]),
            ("surface.remove_outliers", self.remove_outliers.is_some(), &[Map]),
            ("surface.fill", self.fill.is_some(), &[Map]),
            ("surface.detrend", self.detrend.is_some(), &[Map]),
            ("surface.low_pass", self.low_pass.is_some(), &[Map, Waves]),
            ("surface.high_pass", self.high_pass.is_some(), &[Map]),
            ("surface.filter", self.filter.is_some(), &[Map]),
            ("surface.resample", self.resample.is_some(), &[Map]),
            ("surface.edges", self.edges.is_some(), &[Map]),
            ("surface.extend_to", self.extend_to.is_some(), &[Map]),
            ("surface.isotropic_map", self.isotropic_map, &[Map]),
            ("surface.other", self.other.is_some(), &[Map, Waves]),
        ];
        keys.into_iter().filter(|(_, stated, kinds)| *stated && !kinds.contains(&kind)).map(|(key, ..)| key).collect()
    }
}

impl Default for SurfaceScene {
    fn default() -> Self {
        SurfaceScene {
            grid: 512,
            // Of the first 24 seeds the one whose rms height, gap at first contact and range come nearest to what the paper
            // prints for its surface (0.777, 2.69, 5.57 µm against 0.762, 2.633, 5.642 µm).
            seed: 18,
            hurst: 0.8,
            roll_off: None,
            roll_off_mode: None,
            cut_off: None,
            cut_off_mode: None,
            rms_gradient: 1.0,
            amplitudes: Amplitudes::Gaussian,
            heights: None,
            unit: None,
            dataset: None,
            via_python: false,
            profile: false,
            fourier: None,
            fourier_points: None,
            touching: None,
            crop: None,
            remove_outliers: None,
            fill: None,
            detrend: None,
            low_pass: None,
            high_pass: None,
            filter: None,
            resample: None,
            edges: None,
            extend_to: None,
            isotropic_map: false,
            other: None,
            strict: false,
        }
    }
}

/// Attraction between the surfaces.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AdhesionScene {
    /// Decay of the attraction with the gap.
    #[serde(default)]
    pub law: AdhesionLaw,
    /// Work of adhesion γ.
    pub work_of_adhesion: Work,
    /// Range ρ.
    pub range: Length,
    /// Treatment of a range that the grid does not resolve.
    #[serde(default)]
    pub resolution: RangeChoice,
    /// Repeat the loads without adhesion.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub also_nonadhesive: bool,
    /// Further ranges for which the loading branch is solved: area and mean gap against the Tabor parameter.
    #[serde(default, deserialize_with = "list", skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "List<dimension::Length>")]
    pub other_ranges: Vec<Length>,
}

/// Value of `continuum.compare_with` for all methods.
pub const ALL_METHODS: &str = "all";

/// p* to which the statements of the challenge refer.
pub const REFERENCE_LOAD: f64 = 0.01;

/// Acceptance checks against the statements of the contact-mechanics challenge. Scales, spectrum and adhesion must be the challenge's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ChallengeScene {
    /// Method that solves the reference load without adhesion again, to cross-check stresses; an id from `asperity methods`.
    pub cross_check_method: String,
}

impl Default for ChallengeScene {
    fn default() -> Self {
        ChallengeScene { cross_check_method: "bvm".into() }
    }
}

/// Repulsion between the surfaces.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum WallKind {
    /// Gaps are never negative.
    #[default]
    Hard,
    /// Overlap in proportion to the pressure. Contact is a gap of zero or below.
    Penalty,
}

/// Elastic constants of a cubic crystal under its (001) face, x along `[100]`. Only their ratios matter: the contact modulus
/// E* is `laboratory.modulus`, of the compliance averaged over all in-plane directions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CrystalScene {
    /// Elastic constant C11.
    pub c11: Stress,
    /// Elastic constant C12.
    pub c12: Stress,
    /// Elastic constant C44.
    pub c44: Stress,
}

/// How the continuum is solved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ContinuumScene {
    /// An id from `asperity methods`, or "auto".
    pub method: String,
    /// Further methods for the loading branch: ids from `asperity methods`, or "all".
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub compare_with: Vec<String>,
    /// Floating-point numbers of the solver.
    pub precision: Precision,
    /// Largest rms KKT residual over the pressure. Default: 1e-8 in f64; 1e-3 in f32, above 1024 × 1024 points in proportion to the
    /// root of their number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// Iterations of a load after which the solver gives up.
    pub max_iterations: usize,
    /// Gap from which the first load starts, `.npy` `[ny, nx]` in units of the cell's extent, as runs write it. Relative to the scene
    /// file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub initial_gap: Option<PathBuf>,
    /// Whether the surface is periodic. If not, it is the only rough part of a half-space that is free around it. Default: what the
    /// surface's file declares, or true.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub periodic: Option<bool>,
    /// A finite elastic layer instead of the half-space.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layer: Option<LayerScene>,
    /// The half-space of a cubic crystal instead of an isotropic one. The comparison with atoms keeps its own layer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crystal: Option<CrystalScene>,
    /// Repulsion between the surfaces.
    pub wall: WallKind,
    /// Compression of the penalty wall under a pressure of E*; required with that wall.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub penalty_length: Option<Length>,
    /// Hardness: the largest contact stress; where it is reached, the surface flows and keeps its shape on unloading. With
    /// the methods fast, bvm and gfmd.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hardness: Option<Stress>,
    /// Instead of one hardness a file with that of every point, on the grid of the prepared surface: `.npy` or any other format of
    /// a height map. Relative to the scene file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hardness_map: Option<PathBuf>,
    /// Unit of the values of the hardness map, such as "GPa". Default: MPa.
    #[serde(deserialize_with = "unit", skip_serializing_if = "Option::is_none")]
    pub hardness_map_unit: Option<Stress>,
    /// Solve Reynolds' equation in the gap of each load: leakage along x and y, next to that of the effective medium.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub leakage: bool,
    /// Stress below the surface at each load.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub subsurface: Option<SubsurfaceScene>,
}

impl Default for ContinuumScene {
    fn default() -> Self {
        ContinuumScene {
            method: "auto".into(),
            compare_with: Vec::new(),
            precision: Precision::F64,
            tolerance: None,
            max_iterations: MAX_ITERATIONS,
            initial_gap: None,
            periodic: None,
            layer: None,
            crystal: None,
            wall: WallKind::Hard,
            penalty_length: None,
            hardness: None,
            hardness_map: None,
            hardness_map_unit: None,
            leakage: false,
            subsurface: None,
        }
    }
}

impl ContinuumScene {
    pub fn is_periodic(&self) -> bool {
        self.periodic.unwrap_or(true)
    }
}

/// Stress below the surface: equivalent stress after von Mises and largest shear stress at the given depths.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SubsurfaceScene {
    /// Depths, from 0 to the thickness of a layer.
    #[serde(deserialize_with = "list")]
    #[schemars(with = "List<dimension::Length>")]
    pub depths: Vec<Length>,
    /// Poisson's ratio of the half-space; a layer has its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poisson: Option<f64>,
    /// Shear stress at which the body yields, such as the ideal strength of a crystal: results state the largest shear
    /// stress over it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shear_strength: Option<Stress>,
}

/// A finite elastic layer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LayerScene {
    /// Thickness.
    pub thickness: Length,
    /// Poisson's ratio.
    #[serde(default = "third")]
    pub poisson: f64,
    /// Lower face of the layer.
    #[serde(default = "bonded")]
    pub base: Base,
}

fn third() -> f64 {
    0.3
}

fn bonded() -> Base {
    Base::Bonded
}

/// A path of a scene, relative to the folder of the scene file.
pub(super) fn relative_to(file: &Path, path: &Path) -> PathBuf {
    file.parent().unwrap_or(Path::new("")).join(path)
}
