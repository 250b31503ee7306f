//! Equilibria of the continuum along a load path, in the terms of `results.json`. Lengths in L, areas in L², stresses in E*.

use super::state_numbers::StateNumbers;
use super::uncertainty::{UncertaintyComponent, ValueWithError};
use crate::load::{AtLoad, Branch};
use crate::observe::Distribution;
use serde::{Deserialize, Serialize};

/// Continuum states of one problem along its load path.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ContinuumResults {
    pub method: String,
    /// "half-space" or "layer 0.143 L thick, bonded, nu = 0.30".
    pub kernel: String,
    /// "none" or "exponential, gamma = 2e-5 E*L, rho = 2.07e-5 L".
    pub adhesion: String,
    /// "hard wall" or the name of the compliant wall.
    pub wall: String,
    pub nx: usize,
    pub ny: usize,
    /// None without adhesion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<RangeResults>,
    /// rms gradient that the grid resolves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resolved_gradient: Option<f64>,
    pub states: Vec<StateResults>,
    /// Work of one cycle of loading and unloading per area: -∮ p dū, units of E* L.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hysteresis_work: Option<f64>,
    /// Percolation of the gap along x and y on the loading branch: the last load p* with it and the first without. None where the
    /// path does not bracket it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub percolation: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pull_off: Option<PullOff>,
    /// Why a requested pull-off was not found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pull_off_failure: Option<String>,
}

/// Range of the adhesion, units of L, as requested by the scene and as used on the grid, with the cohesive resolution of each
/// (ρ/√(γ dx/E*) for the exponential law).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RangeResults {
    /// Work of adhesion, units of E* L.
    pub gamma: f64,
    pub requested: f64,
    pub used: f64,
    pub resolution_requested: f64,
    pub resolution_used: f64,
}

/// Grid convergence: relative change of a result from the grid with half the points per side to this one. It bounds the remaining
/// error of what converges at first order or faster.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Discretisation {
    /// Of the perimeter-corrected contact fraction; at least a third of the correction. None where the contact is too small for a
    /// meaningful relative change.
    pub area: Option<f64>,
    /// Whether the change of the area is only a bound: the coarser solution had an error larger than the difference of the grids.
    pub area_is_bound: bool,
    /// None where the mean gap was imposed or is next to zero.
    pub mean_gap: Option<f64>,
    pub mean_gap_is_bound: bool,
    /// Points of the coarser grid along x and y.
    pub coarser: [usize; 2],
}

/// Extrapolation to the requested range of the adhesion, from grids each with the shortest range that it resolves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Extrapolated {
    /// Requested range over the range used on this grid.
    pub range: f64,
    /// Contact fraction, perimeter-corrected.
    pub area: ValueWithError,
    /// Units of L; none where it was imposed.
    pub mean_gap: Option<ValueWithError>,
}

/// The largest tensile load that the contact sustains.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PullOff {
    /// Lowest mean pressure of an equilibrium on the unloading branch, over E*: negative.
    pub pressure: f64,
    /// At that pressure, units of L.
    pub mean_gap: f64,
    /// Change of the pressure from the grid with half the points per side, or within the last bracket if that is larger.
    pub pressure_error: f64,
    /// The same of the mean gap.
    pub mean_gap_error: f64,
    /// Points of the coarser grid along x and y; none where the errors are those of the bracket alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coarser: Option<[usize; 2]>,
    /// Mean gap and pressure of the equilibria passed, in the order of the mean gap.
    pub curve: Vec<[f64; 2]>,
}

/// One equilibrium of a solver.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct StateResults {
    #[serde(flatten)]
    pub numbers: StateNumbers,
    pub branch: Branch,
    pub criterion: String,
    /// Perimeter-corrected.
    pub contact_fraction_corrected: f64,
    pub mean_gap: f64,
    pub energy: f64,
    /// Part of the energy due to adhesion and wall; 0 without them.
    pub interaction_energy: f64,
    pub residual: f64,
    pub complementarity: f64,
    /// Estimates by the method, none where it has none: relative energy above the minimum, and relative changes of area and mean
    /// gap still to come.
    pub energy_error_estimate: Option<f64>,
    pub area_error_estimate: Option<f64>,
    pub mean_gap_error_estimate: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub discretisation: Option<Discretisation>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub extrapolated: Option<Extrapolated>,
    /// Uncertainty budget of area and mean gap.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub uncertainty: Vec<UncertaintyComponent>,
    /// On the unloading branch: relative changes from the state at the same load on the loading branch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hysteresis: Option<Hysteresis>,
    /// Distributions, patches and what follows from them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub observed: Option<Observed>,
}

impl AtLoad for StateResults {
    fn index(&self) -> usize {
        self.numbers.index
    }
}

/// Relative change of contact fraction and mean gap from loading to unloading at the same load.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Hysteresis {
    pub area: f64,
    pub mean_gap: f64,
}

impl Hysteresis {
    /// Changes of the area that solvers leave are below this.
    const SOLVER_NOISE: f64 = 1e-3;

    /// Whether the two states differ by more than the solver's noise.
    pub fn is_significant(&self) -> bool {
        self.area.abs() > Self::SOLVER_NOISE
    }
}

/// Contact by compressive stress, the criterion of methods with a smooth wall or adhesion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Compressive {
    pub fraction: f64,
    pub patches: usize,
    /// Half of the contact is in patches up to this area; none without contact.
    pub median_cluster_area: Option<f64>,
}

/// Observables of a state. Lengths in L, areas in L², stresses in E*.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Observed {
    /// Mean pressure over the contact fraction, as counted; none without contact.
    pub mean_contact_pressure: Option<f64>,
    /// Pr(u) in bins of equal width, and of equal ratio; contact is the delta.
    pub gap: Distribution,
    pub gap_logarithmic: Distribution,
    /// Pr(σ), compression positive, and the part of it from contact; without adhesion all nodes out of contact are the delta.
    pub stress: Distribution,
    pub contact_stress: Distribution,
    /// Pr(a): area of a patch, density, number in the bin.
    pub patch_density: Vec<[f64; 3]>,
    /// CPr(a): area of a patch, fraction of the contact in patches up to it.
    pub patch_area: Vec<[f64; 2]>,
    /// Area-weighted median: where CPr(a) is one half.
    pub median_cluster_area: Option<f64>,
    /// With adhesion, where parts of the contact are under tension; without, contact and compression are one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compressive: Option<Compressive>,
    /// Electrical conductance times resistivity, units of L: patches as independent circular spots.
    pub constriction_conductance: f64,
    /// Uniform gap with the same leakage, in Bruggeman's effective medium.
    pub hydraulic_gap: f64,
    /// Whether contact (by edges and corners) and gap (by edges) percolate along x and along y.
    pub contact_percolates: [bool; 2],
    pub gap_percolates: [bool; 2],
}

impl Observed {
    /// Number of patches.
    pub fn patches(&self) -> usize {
        self.patch_density.iter().map(|[.., n]| *n as usize).sum()
    }
}
