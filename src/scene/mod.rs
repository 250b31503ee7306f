//! A scene: what a TOML file says, as plain data. Units stand in the key names; unknown keys are refused.
//!
//! [`Scene`] is read and printed (`asperity schema`); [`Case`] is the same, checked and resolved into the reduced numbers
//! that surfaces, methods and atoms take.

mod atoms;
mod case;
mod check;
mod nvt;
mod outputs;
mod source;
mod syntax;

pub use atoms::{AtomsCase, PairAdhesion, highest_p_star};
pub use case::{Case, slope_warning};
pub use nvt::NvtScene;
pub use outputs::{AccuracyScene, RequestedOutputs};
pub use source::{Surface, SurfaceFile};

use crate::atoms::job_spec::FORCE_TOLERANCE;
use crate::grid::Grid;
use crate::interface::{Adhesion, Base, RangeChoice};
use crate::method::{Precision, Settings, Targets};
use crate::record::import::Fourier;
use crate::surface::Amplitudes;
use crate::{Error, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A rough surface, its load, and what is to be found out about it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Names the run folder.
    pub name: String,
    /// Printed at the top of the report.
    #[serde(default)]
    pub description: String,
    #[serde(default)]
    pub laboratory: Laboratory,
    pub surface: SurfaceScene,
    pub load: LoadScene,
    /// Left out: no adhesion is computed anywhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adhesion: Option<AdhesionScene>,
    #[serde(default)]
    pub continuum: ContinuumScene,
    /// What single methods are told beside the problem.
    #[serde(default, skip_serializing_if = "crate::record::json::is_default")]
    pub methods: Settings,
    /// Left out: grid, method, precision and tolerance are those of the scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<AccuracyScene>,
    /// Left out: nothing is judged.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub challenge: Option<ChallengeScene>,
    /// Left out: no atoms are built or run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub atoms: Option<AtomsScene>,
}

/// Scales of the continuum problem. The defaults are the challenge's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Laboratory {
    /// Extent of the periodic cell in x, µm.
    pub length_um: f64,
    /// Contact modulus E* = E/(1-ν²), MPa.
    pub contact_modulus_mpa: f64,
}

impl Default for Laboratory {
    fn default() -> Self {
        Laboratory { length_um: 100.0, contact_modulus_mpa: 25.0 }
    }
}

/// A surface made from its spectrum, or read from a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SurfaceScene {
    /// Points per side of the grid on which the continuum is solved (a synthesised surface, or one from Fourier coefficients;
    /// a height map has its own).
    pub grid: usize,
    pub seed: u64,
    /// Hurst exponent H, 0 < H ≤ 1.
    pub hurst: f64,
    /// Roll-off wavelength λ_r, µm. Give this or `roll_off_mode` = L/λ_r.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roll_off_um: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roll_off_mode: Option<f64>,
    /// Short cut-off wavelength λ_s, µm. Give this or `cut_off_mode` = L/λ_s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cut_off_um: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cut_off_mode: Option<f64>,
    /// rms gradient of the whole Fourier sum.
    pub rms_gradient: f64,
    pub amplitudes: Amplitudes,
    /// A file to use instead: a height map (`.npy`, `.npz`, HDF5, NetCDF, an ASCII matrix with one row per line, or lines of
    /// x y h), or Fourier coefficients qX qY Re Im (text, or an array of four columns). Relative to the scene file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heights: Option<PathBuf>,
    /// Unit of the heights in the file, µm.
    pub heights_unit_um: f64,
    /// Name of the array, in a file that holds several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dataset: Option<String>,
    /// What four columns qX qY Re Im are; must be said for them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fourier: Option<Fourier>,
    /// Points per side of the grid whose transform `"fftw"` coefficients are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fourier_points: Option<usize>,
    /// Shortest wavelength that is kept of Fourier coefficients, µm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub low_pass_um: Option<f64>,
    /// Which points of the file touch first; must be said for a file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub touching: Option<Touching>,
}

impl Default for SurfaceScene {
    fn default() -> Self {
        SurfaceScene {
            grid: 512,
            // Of the first 24 seeds the one whose rms height, first-touch gap and range come nearest to what the paper
            // prints for its surface (0.777, 2.69, 5.57 µm against 0.762, 2.633, 5.642 µm).
            seed: 18,
            hurst: 0.8,
            roll_off_um: None,
            roll_off_mode: None,
            cut_off_um: None,
            cut_off_mode: None,
            rms_gradient: 1.0,
            amplitudes: Amplitudes::Gaussian,
            heights: None,
            heights_unit_um: 1.0,
            dataset: None,
            fourier: None,
            fourier_points: None,
            low_pass_um: None,
            touching: None,
        }
    }
}

/// Which heights are nearest to the other body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Touching {
    /// The challenge's sign: dark areas touch first.
    LowPoints,
    /// An indenter's heights, as most instruments and programs store them.
    HighPoints,
}

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LoadScene {
    /// Mean pressures over E* times the rms gradient of the whole spectrum, in the order in which they are applied. With
    /// adhesion, up and down are different branches, and a pull may be negative.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub p_star: Vec<f64>,
    /// Such loads at equal ratios instead of a list.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p_star_range: Option<LoadRange>,
    /// Mean gaps instead, µm: they reach states that no pressure holds.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mean_gap_um: Vec<f64>,
    /// Then the same loads the other way round: with adhesion the way back is another.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub unload: bool,
    /// Loads p* whose maps of gap and stress are kept. Default: all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub maps_at: Option<Vec<f64>>,
    /// After the last load, pull the surfaces apart and find the largest pull on the way.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub pull_off: bool,
}

/// Loads p* that a scene gives in two places are the same up to this relative difference.
const SAME_LOAD: f64 = 1e-9;

/// Loads at equal ratios.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LoadRange {
    pub from: f64,
    pub to: f64,
    /// Loads per factor of ten; both ends are among the loads, so that the ratio may be a little smaller.
    pub per_decade: usize,
}

impl LoadRange {
    /// Widest range of loads that means anything.
    pub const DECADES: f64 = 20.0;

    /// The loads; none where the ends are no positive numbers.
    fn loads(&self) -> Vec<f64> {
        let decades = self.to.log10() - self.from.log10();
        if !(decades.is_finite() && decades.abs() <= Self::DECADES) {
            return Vec::new();
        }
        let steps = (decades.abs() * self.per_decade as f64 - 1e-9).ceil().max(1.0);
        // Powers of ten to the last digit, where the range holds them.
        let at = |k: f64| self.from * 10f64.powf(decades * k / steps);
        (0..=steps as usize).map(|k| if k as f64 == steps { self.to } else { at(k as f64) }).collect()
    }
}

impl LoadScene {
    /// The loads `p*` in the order of their application, the way back with them; none under control of the mean gap.
    pub fn p_star_path(&self) -> Vec<f64> {
        let up = self.p_star_range.map_or_else(|| self.p_star.clone(), |r| r.loads());
        self.with_unloading(up)
    }

    /// The mean gaps, µm, likewise.
    pub fn mean_gap_path(&self) -> Vec<f64> {
        self.with_unloading(self.mean_gap_um.clone())
    }

    fn with_unloading(&self, mut path: Vec<f64>) -> Vec<f64> {
        if self.unload {
            path.extend_from_within(..path.len().saturating_sub(1));
            let there = path.len().div_ceil(2);
            path[there..].reverse();
        }
        path
    }

    /// Whether the path rises to its highest load and comes back by the same ones, asked for or given so.
    pub fn is_closed(&self) -> bool {
        let path = self.p_star_path();
        let (half, n) = (path.len() / 2, path.len());
        let mirrored = n % 2 == 1 && n > 1 && path.iter().eq(path.iter().rev());
        self.unload || mirrored && path[..=half].is_sorted_by(|a, b| a < b)
    }

    pub fn count(&self) -> usize {
        self.p_star_path().len() + self.mean_gap_path().len()
    }

    /// How many loads come before the unloading branch of a closed path: all of any other path.
    pub fn loading_count(&self) -> usize {
        if self.is_closed() { self.count().div_ceil(2) } else { self.count() }
    }

    /// Indices of the loads p* that a scene names by their value.
    pub fn indices_of(&self, p_star: f64) -> Vec<usize> {
        let path = self.p_star_path();
        (0..path.len()).filter(|&i| (path[i] - p_star).abs() <= SAME_LOAD * path[i].abs()).collect()
    }
}

/// Attraction between the surfaces.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AdhesionScene {
    #[serde(default)]
    pub law: AdhesionLaw,
    /// Work of adhesion γ, mJ/m².
    pub work_of_adhesion_mj_m2: f64,
    /// Range ρ, nm.
    pub range_nm: f64,
    /// What is done where the grid is too coarse for it.
    #[serde(default)]
    pub range: RangeChoice,
    /// Solve the same loads without adhesion, too.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub also_nonadhesive: bool,
    /// Further ranges, nm, for which the loads are solved (not the way back): area and mean gap against Tabor's parameter.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub other_ranges_nm: Vec<f64>,
}

/// What `continuum.compare_with` calls every method that there is.
pub const ALL_METHODS: &str = "all";

/// Mean pressure over E* times the rms gradient to which the challenge's statements refer.
pub const REFERENCE_LOAD: f64 = 0.01;

/// Judge the results by the contact-mechanics challenge's statements. Scales, spectrum and adhesion must be the challenge's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ChallengeScene {
    /// Solves the reference load without adhesion once more, to compare stresses with; an id from `asperity methods`.
    pub cross_check_method: String,
}

impl Default for ChallengeScene {
    fn default() -> Self {
        ChallengeScene { cross_check_method: "bvm".into() }
    }
}

/// How the attraction fades with the gap g.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum AdhesionLaw {
    /// Energy -γ exp(-g/ρ) per area, the challenge's.
    #[default]
    Exponential,
    /// Constant stress γ/ρ up to the gap ρ, its edge tapered.
    Dugdale,
    /// Lennard-Jones 9-3 traction, g counted from its zero of force.
    #[serde(rename = "power-9-3")]
    #[value(name = "power-9-3")]
    Power93,
}

impl AdhesionLaw {
    /// The law with work of adhesion γ (units of E*·L) and range ρ (units of L).
    pub fn adhesion(self, gamma: f64, rho: f64) -> Adhesion {
        match self {
            AdhesionLaw::Exponential => Adhesion::exponential(gamma, rho),
            AdhesionLaw::Dugdale => Adhesion::dugdale(gamma, rho),
            AdhesionLaw::Power93 => Adhesion::power_law_93(gamma, rho),
        }
    }
}

/// What keeps the surfaces apart.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum WallKind {
    /// Gaps are never negative.
    #[default]
    Hard,
    /// Gives way in proportion to the pressure: contact is a gap of zero or below.
    Penalty,
}

/// Elastic constants of a cubic crystal under its (001) face, x along `[100]`. Only their ratios matter: the contact modulus
/// E* is the laboratory's, and stands for the mean compliance over all in-plane directions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CrystalScene {
    pub c11_gpa: f64,
    pub c12_gpa: f64,
    pub c44_gpa: f64,
}

/// How the continuum is solved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ContinuumScene {
    /// An id from `asperity methods`, or "auto".
    pub method: String,
    /// Further methods that are given the same loads, on the way there, or "all".
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub compare_with: Vec<String>,
    pub precision: Precision,
    /// Largest rms KKT residual over the pressure. Default: 1e-8 in f64; in f32 1e-3, from 1024 points a side on in proportion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    pub max_iterations: usize,
    /// Go on until the energy is within this part of its minimum, as `fast` estimates it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy_tolerance: Option<f64>,
    /// Go on until the contact area is estimated to change by no more than this part; the same for the mean gap.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area_tolerance: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_gap_tolerance: Option<f64>,
    /// Gap to start the first load from, `.npy` `[ny, nx]` in units of the cell's length, as runs write it. Relative to the
    /// scene file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub initial_gap: Option<PathBuf>,
    /// Whether the surface repeats. If not, it lies alone on a half-space that is free around it.
    pub periodic: bool,
    /// A finite elastic layer instead of the half-space.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layer: Option<LayerScene>,
    /// The half-space of a cubic crystal instead of an isotropic one. The comparison with atoms keeps its own layer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crystal: Option<CrystalScene>,
    pub wall: WallKind,
    /// Length by which the penalty wall yields under a pressure of E*, nm; must be given with one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub penalty_length_nm: Option<f64>,
}

impl Default for ContinuumScene {
    fn default() -> Self {
        ContinuumScene {
            method: "auto".into(),
            compare_with: Vec::new(),
            precision: Precision::F64,
            tolerance: None,
            max_iterations: 50_000,
            energy_tolerance: None,
            area_tolerance: None,
            mean_gap_tolerance: None,
            initial_gap: None,
            periodic: true,
            layer: None,
            crystal: None,
            wall: WallKind::Hard,
            penalty_length_nm: None,
        }
    }
}

impl ContinuumScene {
    pub fn tolerance_or_default(&self, grid: Grid) -> f64 {
        self.tolerance.unwrap_or(default_tolerance(self.precision, grid))
    }

    pub fn targets(&self) -> Targets {
        Targets { energy: self.energy_tolerance, area: self.area_tolerance, mean_gap: self.mean_gap_tolerance }
    }
}

/// The tolerance that a precision can reach: in f32 the displacement's round-off weighs in proportion to the grid's stiffest
/// mode. At p = 0.01 E* and the challenge's rms height it leaves 3e-4 at 1024 points a side and 1.3e-3 at 4096.
pub fn default_tolerance(precision: Precision, grid: Grid) -> f64 {
    match precision {
        Precision::F32 => 1e-3 * (grid.nx.max(grid.ny) as f64 / 1024.0).max(1.0),
        Precision::F64 => 1e-8,
    }
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LayerScene {
    pub thickness_um: f64,
    #[serde(default = "third")]
    pub poisson: f64,
    #[serde(default = "bonded")]
    pub base: Base,
}

fn third() -> f64 {
    0.3
}

fn bonded() -> Base {
    Base::Bonded
}

/// The block of atoms, its indenter and its run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AtomsScene {
    /// Cubic cells along x and along y; the cell of the profile is scaled to this many lattice constants.
    pub cells: usize,
    /// Deformable cubic cells along z.
    pub depth_cells: usize,
    /// Cubic cells of elastic continuum between these and what does not move: the base of the atoms is displaced with every load to
    /// where the continuum has it. 0: the base is rigid.
    #[serde(skip_serializing_if = "crate::record::json::is_default")]
    pub foundation_cells: usize,
    /// An eam/alloy file instead of the shipped calcium-like one. Relative to the scene file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub potential: Option<PathBuf>,
    /// Element of the block in that file.
    pub element: String,
    /// Lattice constant in Å; must be given with another potential.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lattice_constant_angstrom: Option<f64>,
    /// Contact modulus of the (100) face in GPa; must be given with another potential.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact_modulus_gpa: Option<f64>,
    /// Shortest wavelength of the indenter, Å. Default: four spacings of its atoms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub low_pass_angstrom: Option<f64>,
    pub slope: Slope,
    /// Where the atoms start from at each load. Default: the continuum's solution; with adhesion, where the way matters, and with
    /// a step, first touch.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start: Option<Start>,
    /// Descent of the indenter per load step from first touch, Å. Default: 0.3.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_angstrom: Option<f64>,
    /// Largest force on any atom in an equilibrium, eV/Å. Above 0.002 a load that starts from the continuum ends where no force is larger
    /// than a quarter of it and indenter and base carry the load to a thousandth.
    pub force_tolerance_ev_per_angstrom: f64,
    /// Range of the pair adhesion, Å: what atoms can carry where the scaled range is shorter than their softness.
    pub adhesion_range_angstrom: f64,
    /// Normal force from which an atom counts as loaded, eV/Å. Default: ten times the force tolerance, at most 0.02.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact_force_ev_per_angstrom: Option<f64>,
    /// Standard deviation of the Gaussian that makes a stress field of the indenter's forces, Å. Default: the lattice constant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stress_width_angstrom: Option<f64>,
    /// Count the atoms that leave the crystal's order, at every step: frames then hold the whole deformable block.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub plasticity: bool,
    /// Solve the matched continuum on a half-space, too, and tell what the block's finite depth makes of contact and mean gap.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub depth_error: bool,
    /// Left out: the atoms stay at 0 K.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nvt: Option<NvtScene>,
    /// MPI ranks.
    pub ranks: usize,
    /// Wall-clock limit of the LAMMPS stage, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_limit_s: Option<f64>,
    /// The LAMMPS program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub program: Option<PathBuf>,
}

/// Most of an elastic foundation, lattice constants: a half-space to any block.
pub const MOST_FOUNDATION_CELLS: usize = 1_000_000;

impl Default for AtomsScene {
    fn default() -> Self {
        AtomsScene {
            cells: 45,
            depth_cells: 12,
            foundation_cells: 0,
            potential: None,
            element: "Ca".into(),
            lattice_constant_angstrom: None,
            contact_modulus_gpa: None,
            low_pass_angstrom: None,
            slope: Slope::Literal,
            start: None,
            step_angstrom: None,
            force_tolerance_ev_per_angstrom: FORCE_TOLERANCE,
            adhesion_range_angstrom: 0.5,
            contact_force_ev_per_angstrom: None,
            stress_width_angstrom: None,
            plasticity: false,
            depth_error: false,
            nvt: None,
            ranks: 1,
            time_limit_s: None,
            program: None,
        }
    }
}

impl AtomsScene {
    pub fn step_or_default(&self) -> f64 {
        self.step_angstrom.unwrap_or(0.3)
    }

    /// Where the atoms of a load start from, where the bodies attract each other or not.
    pub fn start_or_default(&self, attracts: bool) -> Start {
        let steps = attracts || self.step_angstrom.is_some();
        self.start.unwrap_or(if steps { Start::Touch } else { Start::Continuum })
    }
}

/// What happens to the gradient that atoms cannot resolve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Slope {
    /// The profile as it is, low-passed: the resolved gradient is smaller than the whole spectrum's.
    Literal,
    /// The resolved gradient is scaled back to the whole spectrum's: contact stresses exceed the crystal's strength at once.
    Renormalised,
}

/// Where the atoms of a load start from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// The continuum's solution at that load: the indenter then finds its height under the load itself.
    Continuum,
    /// First touch: the indenter comes down step by step, and the asked loads lie between two steps.
    Touch,
}

impl Scene {
    /// Reads a scene file. Syntax, unknown keys and wrong types are told with their line.
    pub fn read(path: &Path) -> Result<Scene> {
        let text = std::fs::read_to_string(path).map_err(Error::io("read", path))?;
        Self::parse(&text, path)
    }

    pub fn parse(text: &str, path: &Path) -> Result<Scene> {
        toml::from_str(text).map_err(|e| syntax::unavailable_reason(e, text, path))
    }

    /// JSON Schema of scene files, for editors.
    pub fn schema() -> serde_json::Value {
        schemars::schema_for!(Scene).to_value()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_comes_back_if_its_loads_are_a_mirror_image() {
        let is_closed = |p_star: &[f64]| LoadScene { p_star: p_star.to_vec(), ..LoadScene::default() }.is_closed();
        assert!(is_closed(&[0.01, 0.02, 0.05, 0.02, 0.01]));
        for path in [&[0.01][..], &[0.01, 0.02], &[0.01, 0.02, 0.01, 0.02], &[0.02, 0.01, 0.02], &[0.01, 0.03, 0.02]] {
            assert!(!is_closed(path), "{path:?}");
        }
        assert!(LoadScene { p_star: vec![0.01, 0.02], unload: true, ..LoadScene::default() }.is_closed());
    }
}
