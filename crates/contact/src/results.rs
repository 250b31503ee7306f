//! Equilibria of the continuum along a load path, as in `results.json`. Lengths in L, areas in L², stresses in E*.

use super::quantity::Quantity;
use super::state_numbers::StateNumbers;
use super::uncertainty::{UncertaintyComponent, ValueWithError, total};
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
    /// Largest contact stress over E*, of a map the mean; absent for an elastic body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hardness: Option<f64>,
    /// Absent where the hardness is the same everywhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hardness_map: Option<HardnessMapResults>,
    pub nx: usize,
    pub ny: usize,
    /// Absent without adhesion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<RangeResults>,
    /// rms gradient that the grid resolves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resolved_gradient: Option<f64>,
    pub states: Vec<StateResults>,
    /// Energy per area that the load path dissipates, open or closed, units of E* L: the work of the load less the change of the stored
    /// energy. With adhesion by trapezoids from the first load on, otherwise the plastic work since first contact. Absent for a
    /// body without history.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dissipation: Option<f64>,
    /// Percolation of the gap along x and y on the loading branch: the last load p* with percolation and the first
    /// without. Absent if the load path does not bracket the transition.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub percolation: Option<[f64; 2]>,
    /// Onset of plasticity on the loading branch.
    #[serde(default, skip_serializing_if = "Onset::is_empty")]
    pub onset: Onset,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pull_off: Option<PullOff>,
    /// Reason why a requested pull-off was not found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pull_off_failure: Option<String>,
}

/// Loads p* between which plasticity begins: the last before it, 0 if it is the first, and the first with it. Absent if no load
/// reaches it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Onset {
    /// The contact stress of a node reaches the hardness.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hardness: Option<[f64; 2]>,
    /// The largest shear stress below the surface reaches the shear strength.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shear_strength: Option<[f64; 2]>,
}

impl Onset {
    /// Of the states of a load path.
    pub fn of(states: &[StateResults]) -> Self {
        let between = |begun: &dyn Fn(&StateResults) -> bool| {
            let loading: Vec<&StateResults> = states.iter().take_while(|s| s.branch == Branch::Loading).collect();
            let first = loading.iter().position(|s| begun(s))?;
            let before = first.checked_sub(1).map_or(0.0, |i| loading[i].numbers.p_star);
            Some([before, loading[first].numbers.p_star])
        };
        Onset {
            hardness: between(&|s| s.plasticity.is_some_and(|p| p.displaced > 0.0)),
            shear_strength: between(&|s| {
                s.subsurface.as_ref().and_then(|b| b.shear_over_strength).is_some_and(|share| share >= 1.0)
            }),
        }
    }

    pub fn is_empty(&self) -> bool {
        *self == Onset::default()
    }
}

/// A map of the hardness: its file with the BLAKE3 hash, lowest and highest value over E*. No file if it came from a program.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HardnessMapResults {
    pub file: String,
    pub hash: String,
    pub lowest: f64,
    pub highest: f64,
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

/// Relative errors by the grid, from the changes to the grid with half the points along each side.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Discretisation {
    /// Of the contact area: its change, and a third of the excess of an elastic edge for every edge. Absent if the contact
    /// is too small for a meaningful relative change.
    pub area: Option<f64>,
    /// Whether `area` is only a bound: the error of the coarser solution exceeded the difference of the grids.
    pub area_is_bound: bool,
    /// Of the mean gap: twice its change, and a twentieth of that of the contact area. Absent if the mean gap is prescribed or close to zero.
    pub mean_gap: Option<f64>,
    pub mean_gap_is_bound: bool,
    /// Of the contact stiffness: three times its change and the error of the area, if it is known on both grids.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<f64>,
    /// Points of the coarser grid along x and y.
    pub coarser: [usize; 2],
}

/// Extrapolation to the requested range of adhesion from several grids, each with the shortest range that it
/// resolves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Extrapolated {
    /// Requested range over the range used on this grid.
    pub range: f64,
    /// Contact area over the area of the cell.
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
    /// Three times the change of the pressure from the grid with half the points along each side, and the change within the last
    /// bracket. Absent without a pull-off on that grid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressure_error: Option<f64>,
    /// The same for the mean gap.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_gap_error: Option<f64>,
    /// Points of the coarser grid along x and y.
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
    /// Contact nodes over all nodes: the count from which the contact area is found.
    pub contact_nodes: f64,
    pub mean_gap: f64,
    /// Error of the mean gap, L; absent where it is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_gap_error: Option<f64>,
    /// Free energy: elastic, of the interaction, and of the load (pressure times mean gap).
    pub energy: f64,
    pub elastic_energy: f64,
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
    /// Solved flow through the gap, if requested; conductivities in L³.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub leakage: Option<Leakage>,
    /// Plastic flow up to this load; absent for an elastic body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plasticity: Option<Plasticity>,
    /// File of the `[ny, nx]` map of the plastic displacement (L), if stored.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plastic_map: Option<String>,
    /// Stress below the surface, if requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub subsurface: Option<SubsurfaceResults>,
}

/// Stresses below the surface under the pressure of a state. Lengths in L, stresses in E*.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SubsurfaceResults {
    pub poisson: f64,
    /// One for each depth, in the order of the request.
    pub slices: Vec<SubsurfaceSlice>,
    /// The largest of all slices.
    pub von_mises: Peak,
    pub shear: Peak,
    /// Largest shear stress over that at which the body yields, if it is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shear_over_strength: Option<f64>,
}

/// Largest stresses at a depth: equivalent stress after von Mises and shear stress.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SubsurfaceSlice {
    pub depth: f64,
    pub von_mises: Peak,
    pub shear: Peak,
}

/// A largest value, the node and depth where it is, and the file of the `[ny, nx]` map of that depth, if stored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Peak {
    pub value: f64,
    pub x: f64,
    pub y: f64,
    pub depth: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub map: Option<String>,
}

impl SubsurfaceResults {
    /// From at least one slice.
    pub fn new(poisson: f64, slices: Vec<SubsurfaceSlice>, shear_strength: Option<f64>) -> Self {
        let highest = |of: fn(&SubsurfaceSlice) -> &Peak| {
            slices.iter().map(of).max_by(|a, b| a.value.total_cmp(&b.value)).expect("a slice").clone()
        };
        let (von_mises, shear) = (highest(|s| &s.von_mises), highest(|s| &s.shear));
        let shear_over_strength = shear_strength.map(|strength| shear.value / strength);
        SubsurfaceResults { poisson, von_mises, shear, shear_over_strength, slices }
    }

    /// With lengths in multiples of `length` and stresses of `stress`.
    pub fn in_units(&self, length: f64, stress: f64) -> Self {
        let peak = |p: &Peak| Peak {
            value: p.value * stress,
            x: p.x * length,
            y: p.y * length,
            depth: p.depth * length,
            map: p.map.clone(),
        };
        let slice = |s: &SubsurfaceSlice| SubsurfaceSlice {
            depth: s.depth * length,
            von_mises: peak(&s.von_mises),
            shear: peak(&s.shear),
        };
        SubsurfaceResults {
            slices: self.slices.iter().map(slice).collect(),
            von_mises: peak(&self.von_mises),
            shear: peak(&self.shear),
            ..self.clone()
        }
    }
}

impl StateResults {
    /// Adds components of the uncertainty, which the stated errors then contain.
    pub fn add_uncertainty(&mut self, more: impl IntoIterator<Item = UncertaintyComponent>) {
        self.uncertainty.extend(more);
        let share = |quantity| total(&self.uncertainty, quantity);
        let (area, gap) = (share(Quantity::ContactArea), share(Quantity::MeanGap));
        self.numbers.contact_area_error = area.map(|share| share * self.numbers.contact_area);
        self.mean_gap_error = gap.map(|share| share * self.mean_gap.abs());
    }

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
    /// Contact nodes under compression over all nodes.
    pub contact_nodes: f64,
    pub patches: usize,
    /// Area-weighted median of the cluster areas; absent without contact.
    pub median_cluster_area: Option<f64>,
    /// Counting error of the median, of independent clusters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub median_cluster_area_error: Option<f64>,
}

/// Observables of a state. Lengths in L, areas in L², stresses in E*.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Observed {
    /// Pressure over the contact area; absent without contact.
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
