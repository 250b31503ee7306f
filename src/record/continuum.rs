//! Equilibria of the continuum along a load path, as in `results.json`. Lengths in L, areas in L², stresses in E*.

use super::state_numbers::StateNumbers;
use super::uncertainty::{UncertaintyComponent, ValueWithError};
use crate::load::{AtLoad, Branch};
use crate::observe::{Distribution, Leakage, Plasticity};
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
    /// Largest contact stress over E*; absent for an elastic body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hardness: Option<f64>,
    pub nx: usize,
    pub ny: usize,
    /// Absent without adhesion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<RangeResults>,
    /// rms gradient that the grid resolves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resolved_gradient: Option<f64>,
    pub states: Vec<StateResults>,
    /// Work of a loading-unloading cycle per area: -∮ p dū, units of E* L.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hysteresis_work: Option<f64>,
    /// Percolation of the gap along x and y on the loading branch: the last load p* with percolation and the first
    /// without. Absent if the load path does not bracket the transition.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub percolation: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pull_off: Option<PullOff>,
    /// Reason why a requested pull-off was not found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pull_off_failure: Option<String>,
}

/// Range of the adhesion, units of L: as requested and as used on the grid, each with its cohesive resolution (ρ/√(γ
/// dx/E*) for the exponential law).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RangeResults {
    /// Work of adhesion, units of E* L.
    pub gamma: f64,
    pub requested: f64,
    pub used: f64,
    pub resolution_requested: f64,
    pub resolution_used: f64,
}

/// Grid convergence: relative change of a result from the grid with half the points along each side to this grid. It
/// bounds the remaining error of results that converge at first order or faster.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Discretisation {
    /// Change of the perimeter-corrected contact fraction; at least a third of the correction. Absent if the contact
    /// is too small for a meaningful relative change.
    pub area: Option<f64>,
    /// Whether `area` is only a bound: the error of the coarser solution exceeded the difference of the grids.
    pub area_is_bound: bool,
    /// Change of the mean gap; absent if the mean gap is prescribed or close to zero.
    pub mean_gap: Option<f64>,
    pub mean_gap_is_bound: bool,
    /// Points of the coarser grid along x and y.
    pub coarser: [usize; 2],
}

/// Extrapolation to the requested range of adhesion from several grids, each with the shortest range that it
/// resolves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Extrapolated {
    /// Requested range over the range used on this grid.
    pub range: f64,
    /// Perimeter-corrected contact fraction.
    pub area: ValueWithError,
    /// Units of L; absent if the mean gap is prescribed.
    pub mean_gap: Option<ValueWithError>,
}

/// Pull-off: the largest tensile load of an equilibrium.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PullOff {
    /// Lowest mean pressure of an equilibrium on the unloading branch, over E* (negative).
    pub pressure: f64,
    /// Mean gap at that pressure, units of L.
    pub mean_gap: f64,
    /// Change of the pressure from the grid with half the points along each side, or within the last bracket if that
    /// is larger.
    pub pressure_error: f64,
    /// The same for the mean gap.
    pub mean_gap_error: f64,
    /// Points of the coarser grid along x and y; absent if the errors are those of the bracket alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coarser: Option<[usize; 2]>,
    /// Mean gap and pressure of the equilibria found, sorted by mean gap.
    pub curve: Vec<[f64; 2]>,
}

/// One equilibrium of a solver.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct StateResults {
    #[serde(flatten)]
    pub numbers: StateNumbers,
    pub branch: Branch,
    pub criterion: String,
    /// Perimeter-corrected contact fraction.
    pub contact_fraction_corrected: f64,
    pub mean_gap: f64,
    pub energy: f64,
    /// Energy of adhesion and wall; 0 without them.
    pub interaction_energy: f64,
    pub residual: f64,
    pub complementarity: f64,
    /// Error estimates of the solver, where available: relative energy above the minimum, and remaining relative
    /// changes of area and mean gap.
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
    /// Distributions, clusters and derived observables.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub observed: Option<Observed>,
    /// Small load steps next to this load, for its contact stiffness: pressure (E*) and separation (L), the mean gap
    /// without its plastic part; of a body that is not periodic minus the displacement.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub steps: Vec<[f64; 2]>,
    /// Solved flow through the gap, if requested; conductivities in L³.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub leakage: Option<Leakage>,
    /// Plastic flow up to this load; absent for an elastic body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plasticity: Option<Plasticity>,
    /// File of the `[ny, nx]` map of the plastic displacement (L), if stored.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plastic_map: Option<String>,
}

impl StateResults {
    /// Work conjugate of the pressure for a periodic body, L: the mean gap less the mean plastic displacement.
    pub fn separation(&self) -> f64 {
        self.mean_gap - self.plasticity.map_or(0.0, |p| p.displacement)
    }
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
    /// Changes of the area smaller than this are within the solver's tolerance.
    const SOLVER_NOISE: f64 = 1e-3;

    /// Whether the difference between the two states exceeds the solver's tolerance.
    pub fn is_significant(&self) -> bool {
        self.area.abs() > Self::SOLVER_NOISE
    }
}

/// Contact by compressive stress, the criterion of methods with a smooth wall or adhesion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Compressive {
    pub fraction: f64,
    pub patches: usize,
    /// Area-weighted median of the cluster areas; absent without contact.
    pub median_cluster_area: Option<f64>,
}

/// Observables of a state. Lengths in L, areas in L², stresses in E*.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Observed {
    /// Mean pressure over the contact fraction (not perimeter-corrected); absent without contact.
    pub mean_contact_pressure: Option<f64>,
    /// Pr(u) in bins of equal width, and in bins of equal ratio; contact is the delta.
    pub gap: Distribution,
    pub gap_logarithmic: Distribution,
    /// Pr(σ), compression positive, and its contribution from contact; without adhesion the nodes out of contact are
    /// the delta.
    pub stress: Distribution,
    pub contact_stress: Distribution,
    /// Pr(a): cluster area, density, number in the bin.
    pub patch_density: Vec<[f64; 3]>,
    /// CPr(a): cluster area, fraction of the contact in clusters up to this area.
    pub patch_area: Vec<[f64; 2]>,
    /// Area-weighted median of the cluster areas, at which CPr(a) is one half.
    pub median_cluster_area: Option<f64>,
    /// Contact under compression; only with adhesion. Without adhesion all contact is under compression.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compressive: Option<Compressive>,
    /// Electrical conductance times resistivity, units of L: clusters as independent circular spots.
    pub constriction_conductance: f64,
    /// Uniform gap with the same leakage, from Bruggeman's effective-medium theory.
    pub hydraulic_gap: f64,
    /// Whether contact (by edges and corners) and gap (by edges) percolate along x and along y.
    pub contact_percolates: [bool; 2],
    pub gap_percolates: [bool; 2],
}

impl Observed {
    /// Number of contact clusters.
    pub fn patches(&self) -> usize {
        self.patch_density.iter().map(|[.., n]| *n as usize).sum()
    }
}
