//! The contact problem as its users state it, in their own units. Reduction to L = E* = 1 is behind it.

mod accuracy;
mod check;
mod error_targets;
mod field;
mod loads;
mod reduced;
mod solve;

pub use accuracy::{ALMOST_FULL, Accuracy, AccuracyResults, ErrorCost, GridErrors, LastGrid, SolvedGrid};
pub use error_targets::{ErrorTargets, StatedQuantity};
pub use field::{Arguments, Field, Names};
pub use loads::{LoadKind, Loads};
pub use reduced::{ReducedModel, Reduction};
pub use solve::{LoadPath, Monitor, Progress};

use crate::interface::{AttractionLaw, Base, HardnessMap, RangeChoice, TabulatedLaw};
use crate::method::{ContactMethod, Fast, Heights, Precision, Settings};
use asperity_grid::sys::ranks::Ranks;
use asperity_grid::{Grid, Series};
use asperity_surface::{HeightSource, Surface};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A rigid rough surface on an elastic body.
///
/// Units are those of the caller: lengths have the unit of the surface, pressures that of the modulus, and energies per area
/// their product. With 1 for the extent of the cell and for the modulus, all results are in reduced units.
#[derive(Clone)]
pub struct Problem {
    /// The rough surface.
    pub surface: Surface,
    /// Contact modulus E* = E/(1-ν²).
    pub modulus: f64,
    /// The elastic body.
    pub body: Body,
    /// Attraction between the surfaces; none by default.
    pub adhesion: Option<Adhesion>,
    /// Compliance of the repulsion: the penetration under a pressure of E*. None, the default, is a hard wall.
    pub penalty_length: Option<f64>,
    /// Hardness, in the unit of the modulus: the largest contact pressure. Where it is reached, the surface flows, and keeps its
    /// shape on unloading (methods fast, bvm and gfmd). None, the default, is an elastic body.
    pub hardness: Option<Hardness>,
    /// The method; [`Fast`] by default.
    pub method: &'static dyn ContactMethod,
    /// Floating-point type of the fields.
    pub precision: Precision,
    /// Largest rms residual over the mean pressure. Default: 1e-8, in single precision what rounding allows.
    pub tolerance: Option<f64>,
    /// Iterations per load after which a solver stops.
    pub max_iterations: usize,
    /// Settings of single methods.
    pub settings: Settings,
    /// Gap `[ny, nx]` from which the first load starts, in the unit of the surface's length. None, the default, is first contact.
    pub initial_gap: Option<Vec<f64>>,
}

impl std::fmt::Debug for Problem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Problem")
            .field("surface", &self.surface)
            .field("modulus", &self.modulus)
            .field("body", &self.body)
            .field("adhesion", &self.adhesion)
            .field("penalty_length", &self.penalty_length)
            .field("hardness", &self.hardness)
            .field("method", &self.method.card().id)
            .finish_non_exhaustive()
    }
}

/// The elastic body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Body {
    /// An isotropic half-space under a periodic surface.
    HalfSpace,
    /// An isotropic layer on a rigid base.
    Layer {
        /// Thickness, in the unit of the surface's length.
        thickness: f64,
        /// Poisson's ratio.
        poisson: f64,
        /// Boundary condition at the base.
        base: Base,
    },
    /// A cubic crystal with an (001) face and x along `[100]`. Only the ratios of the constants matter.
    Cubic {
        /// Elastic constant C11.
        c11: f64,
        /// Elastic constant C12.
        c12: f64,
        /// Elastic constant C44.
        c44: f64,
    },
    /// An isotropic half-space under a surface that is not periodic, free outside of the map.
    NonPeriodic,
}

/// Contact modulus E* of one elastic body against a rigid one, or of two: 1/E* = Σ (1-ν²)/E over `[Young's modulus, Poisson's ratio]`
/// (Johnson, Contact Mechanics, 1985, eq. 4.20). A body's share in the deformation is E* over its own modulus against a rigid one.
///
/// ```
/// use asperity_contact::problem::contact_modulus;
///
/// let steel = [210e9, 0.3];
/// assert!((contact_modulus(&[steel, steel]) / contact_modulus(&[steel]) - 0.5).abs() < 1e-15);
/// ```
pub fn contact_modulus(bodies: &[[f64; 2]]) -> f64 {
    1.0 / bodies.iter().map(|[young, poisson]| (1.0 - poisson * poisson) / young).sum::<f64>()
}

/// Decay of the attraction with the gap g.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum AdhesionLaw {
    /// Energy -γ exp(-g/ρ) per area, the challenge's.
    #[default]
    Exponential,
    /// Constant stress γ/ρ up to the gap ρ, its edge tapered.
    Dugdale,
    /// Lennard-Jones 9-3 traction, g counted from its zero of force.
    #[serde(rename = "power-9-3")]
    #[cfg_attr(feature = "clap", value(name = "power-9-3"))]
    Power93,
}

/// Attraction between the surfaces.
///
/// ```
/// use asperity_contact::interface::RangeChoice;
/// use asperity_contact::problem::{Adhesion, AdhesionLaw};
///
/// let adhesion = Adhesion { work_of_adhesion: 0.05, range: 2e-9, ..Adhesion::default() };
/// assert_eq!((adhesion.law, adhesion.resolution), (AdhesionLaw::Exponential, RangeChoice::Mesh));
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Adhesion {
    /// Work of adhesion γ, in units of modulus times length.
    pub work_of_adhesion: f64,
    /// Range ρ, in the unit of the surface's length.
    pub range: f64,
    /// Decay of the attraction with the gap.
    pub law: AdhesionLaw,
    /// What happens where the grid does not resolve the range.
    pub resolution: RangeChoice,
    /// Another decay in place of `law`: the shape of this table, with the work and range above.
    pub table: Option<Arc<TabulatedLaw>>,
}

/// The law of a table, with its own work of adhesion and range.
impl From<TabulatedLaw> for Adhesion {
    fn from(table: TabulatedLaw) -> Self {
        let (work_of_adhesion, range) = (table.work_of_adhesion(), table.range());
        Adhesion { work_of_adhesion, range, table: Some(Arc::new(table)), ..Adhesion::default() }
    }
}

impl Adhesion {
    /// The law over E* and the extent of the cell.
    pub fn reduced(&self, length: f64, modulus: f64) -> AttractionLaw {
        let (gamma, rho) = (self.work_of_adhesion / (modulus * length), self.range / length);
        match (&self.table, self.law) {
            (Some(table), _) => AttractionLaw::tabulated(table, gamma, rho),
            (None, AdhesionLaw::Exponential) => AttractionLaw::exponential(gamma, rho),
            (None, AdhesionLaw::Dugdale) => AttractionLaw::dugdale(gamma, rho),
            (None, AdhesionLaw::Power93) => AttractionLaw::power_law_93(gamma, rho),
        }
    }
}

/// Largest contact pressure, in the unit of the modulus.
///
/// ```
/// use asperity_contact::problem::Hardness;
///
/// assert!(matches!(Hardness::from(0.3), Hardness::Uniform(value) if value == 0.3));
/// ```
#[derive(Debug, Clone)]
pub enum Hardness {
    /// The same at all nodes.
    Uniform(f64),
    /// Of each node of the surface; only with a hard wall.
    Map(Arc<HardnessMap>),
}

impl From<f64> for Hardness {
    fn from(value: f64) -> Self {
        Hardness::Uniform(value)
    }
}

impl From<HardnessMap> for Hardness {
    fn from(map: HardnessMap) -> Self {
        Hardness::Map(Arc::new(map))
    }
}

/// Iterations per load after which a solver stops, if nothing else is chosen.
pub const MAX_ITERATIONS: usize = 50_000;

impl Problem {
    /// Contact without adhesion on a half-space of contact modulus E* = E/(1-ν²).
    pub fn new(surface: Surface, modulus: f64) -> Self {
        Problem {
            surface,
            modulus,
            body: Body::HalfSpace,
            adhesion: None,
            penalty_length: None,
            hardness: None,
            method: &Fast,
            precision: Precision::F64,
            tolerance: None,
            max_iterations: MAX_ITERATIONS,
            settings: Settings::default(),
            initial_gap: None,
        }
    }

    fn attracts(&self) -> bool {
        self.adhesion.as_ref().is_some_and(|a| a.work_of_adhesion > 0.0)
    }
}

/// The tolerance that a precision can reach: in f32 the displacement's round-off weighs in proportion to the grid's stiffest
/// mode. At p = 0.01 E* and the challenge's rms height the residual is 3e-4 on 1024 × 1024 points and 1.3e-3 on 4096 × 4096, on
/// 3 × 20000 points below 2e-4: the number of points counts, not the longer side.
pub fn default_tolerance(precision: Precision, grid: Grid) -> f64 {
    match precision {
        Precision::F32 => 1e-3 * ((grid.points() as f64).sqrt() / 1024.0).max(1.0),
        Precision::F64 => 1e-8,
    }
}

/// Heights of a surface in the form in which methods take them.
pub enum LentHeights<'a> {
    /// The waves of a series that a grid holds.
    Cut(Series<f64>),
    Lent(Heights<'a>),
}

impl<'a> LentHeights<'a> {
    /// Of a spectrum and of coefficients the series, of which each of `ranks` has its columns; of a map the nodes. Waves that `grid` does not
    /// hold are left out.
    pub fn of(source: &'a HeightSource, grid: Grid, ranks: &Ranks) -> Self {
        let series = match source {
            HeightSource::Synthesised { modes, .. } => modes.series_on(ranks),
            HeightSource::Fourier { modes, .. } => modes.series(),
            HeightSource::Imported { heights, .. } => return LentHeights::Lent(Heights::Nodes(heights)),
        };
        match series.is_held_by(grid) {
            true => LentHeights::Lent(Heights::Series(series)),
            false => LentHeights::Cut(series.cut(grid)),
        }
    }

    pub fn get(&self) -> Heights<'_> {
        match self {
            LentHeights::Cut(series) => Heights::Series(series),
            LentHeights::Lent(heights) => *heights,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_surface::{Spectrum, SynthesisOptions};

    /// A long map needs no looser tolerance than a square one of as many points.
    #[test]
    fn the_tolerance_in_f32_grows_with_the_points_and_not_with_a_side() {
        let of = |nx, ny| default_tolerance(Precision::F32, Grid::unit(nx, ny));
        assert_eq!([of(3, 20_000), of(1024, 1024), of(4096, 4096)], [1e-3, 1e-3, 4e-3]);
    }

    /// The stress of waves on so thin a layer is no finite number.
    #[test]
    fn layers_of_infinite_stiffness_are_refused_in_words() {
        let spectrum = Spectrum { lambda_s: 1.0 / 8.0, ..Spectrum::CHALLENGE };
        let options = SynthesisOptions { nodes: 16, length: 1.0, seed: 1 };
        let surface = Surface::from_spectrum(spectrum, options).expect("a surface");
        let body = Body::Layer { thickness: 1e-310, poisson: 0.3, base: Base::Bonded };
        let error = Problem { body, ..Problem::new(surface, 1.0) }.solve(0.01).expect_err("refused").to_string();
        assert!(error.contains("thickness") && !error.contains("inf"), "{error}");
    }
}
