//! Settings of the methods.

use asperity_surface::{SummitCurvature, SummitFit};
use serde::{Deserialize, Serialize};

/// Settings of single methods, one table for each under its id. The defaults are those of the challenge.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct Settings {
    pub fft_ia: FftIaSettings,
    pub bicgstab: BicgstabSettings,
    pub bem_bspline: BemBsplineSettings,
    pub winkler: WinklerSettings,
    pub srgw: SrgwSettings,
    pub icha: IchaSettings,
    pub persson: PerssonSettings,
    pub ms_archard: MsArchardSettings,
    pub rl_archard: RlArchardSettings,
    pub experiment: ExperimentSettings,
}

/// Side of the print of `experiment`, nm.
pub const PRINT_SIDE_NM: f64 = 1e8;

/// Largest gap that appears as contact in the images of `experiment` (between 100 and 200 nm), nm.
pub const OPTICAL_GAP_NM: f64 = 150.0;

/// Fitted band ratio; the data are on the card.
pub const FITTED_BAND_RATIO: f64 = 5.0;

/// Energy factor that reproduces solved mean gaps.
pub const FITTED_ENERGY_FACTOR: f64 = 0.45;

/// Settings of the method `fft-ia`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct FftIaSettings {
    /// Relaxation factor of the adhesive pressure, above 0 and at most 1.
    pub relaxation: f64,
}

impl Default for FftIaSettings {
    fn default() -> Self {
        FftIaSettings { relaxation: 0.3 }
    }
}

/// Settings of the method `bicgstab`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct BicgstabSettings {
    /// Range of the wall without adhesion, in mesh spacings times the rms gradient.
    pub wall_range: f64,
    /// Stress `γ/ρ` of the wall without adhesion, units of E* times the rms gradient.
    pub wall_strength: f64,
    /// Smallest resolution `1/√(dx · softening/E*)` of the adhesion law on the mesh; a shorter range is enlarged to
    /// it. 0 leaves the range unchanged.
    pub min_resolution: f64,
}

impl Default for BicgstabSettings {
    /// An exponential law that was itself adapted to the mesh has a resolution of 1.28 after its replacement.
    fn default() -> Self {
        BicgstabSettings { wall_range: 0.25, wall_strength: 1.0, min_resolution: 1.25 }
    }
}

/// Settings of the method `bem-bspline`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct BemBsplineSettings {
    /// Shortest wavelength of the roughness in mesh spacings; 2 disables the filter.
    pub shortest_wavelength: f64,
    /// Penalty r over the stiffness of the stiffest mode.
    pub penalty: f64,
}

impl Default for BemBsplineSettings {
    fn default() -> Self {
        BemBsplineSettings { shortest_wavelength: 4.0, penalty: 2.0 }
    }
}

/// Settings of the method `winkler`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct WinklerSettings {
    /// λ in κ = E*/λ, L. Default 0.0034 without `calibrate_to`.
    pub spring_length: Option<f64>,
    /// Contact fraction of this surface at p* = 0.01 from which λ is determined instead.
    pub calibrate_to: Option<f64>,
}

/// Settings of the method `srgw`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct SrgwSettings {
    /// Fit from which the curvatures of summits are taken.
    pub fit: SummitFit,
    /// Mean of the two principal curvatures.
    pub curvature: SummitCurvature,
}

/// Settings of the method `icha`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct IchaSettings {
    /// Fit from which the curvatures of summits are taken.
    pub fit: SummitFit,
    /// Mean of the two principal curvatures.
    pub curvature: SummitCurvature,
    /// Load steps per decade, starting at p* = 10⁻⁶; spots merge after each. 1 to 1000.
    pub steps_per_decade: u32,
}

impl Default for IchaSettings {
    fn default() -> Self {
        IchaSettings { fit: SummitFit::default(), curvature: SummitCurvature::default(), steps_per_decade: 8 }
    }
}

/// Relation between contact area and pressure.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum PerssonForm {
    /// erf(√2 p*): the original theory.
    #[default]
    Pure,
    /// erf(√π p*): contact fraction 2 p* at small loads, close to numerical solutions.
    Kappa2,
}

/// Settings of the method `persson`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct PerssonSettings {
    /// Relation between contact area and pressure.
    pub form: PerssonForm,
    /// Elastic energy at small contact over that of full contact on the same area, above 0 and at most 1: 1 is the
    /// original theory, 0.45 reproduces solved mean gaps (Yang & Persson, J. Phys.: Condens. Matter 20 (2008)
    /// 215214).
    pub energy_factor: f64,
}

impl Default for PerssonSettings {
    fn default() -> Self {
        PerssonSettings { form: PerssonForm::Pure, energy_factor: FITTED_ENERGY_FACTOR }
    }
}

/// Settings of the method `ms-archard`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct MsArchardSettings {
    /// Longest over shortest wavelength of a band, above 1. With 5 the adhesive surface of the challenge jumps to
    /// full contact from a contact fraction of one third, as in the paper; with 2 from one tenth.
    pub band_ratio: f64,
}

impl Default for MsArchardSettings {
    fn default() -> Self {
        MsArchardSettings { band_ratio: FITTED_BAND_RATIO }
    }
}

/// Settings of the method `rl-archard`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct RlArchardSettings {
    /// Shortest wave that is solved, as the number of waves along x. By default 32, or the largest number that the
    /// grid resolves.
    pub cut_off_modes: Option<usize>,
}

/// Settings of the method `experiment`; lengths in units of L = 0.1 m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct ExperimentSettings {
    /// Resolution of the printer, over which heights are averaged: 16 µm. 0 for none.
    pub print_resolution: f64,
    /// Pixel of the camera: 4900 along a side (36.3 megapixels). 0 for none.
    pub pixel_size: f64,
    /// Largest gap that appears as contact: 0.15 µm (0.1 to 0.2).
    pub optical_gap: f64,
    /// Thickness of the rubber: 15 mm.
    pub thickness: f64,
    /// Poisson's ratio of the rubber.
    pub poisson: f64,
    /// Window of the image correlation, over which displacements are averaged. Assumed: 0.5 mm, about 24 pixels. 0
    /// for none.
    pub correlation_window: f64,
}

impl Default for ExperimentSettings {
    fn default() -> Self {
        ExperimentSettings {
            print_resolution: 1.6e-4,
            pixel_size: 1.0 / 4900.0,
            optical_gap: OPTICAL_GAP_NM / PRINT_SIDE_NM,
            thickness: 0.15,
            poisson: 0.5,
            correlation_window: 5e-3,
        }
    }
}
