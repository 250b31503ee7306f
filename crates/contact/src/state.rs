//! One state of a load path as owned numbers: in memory, in `results.json`, in the lines of `solve`.

use crate::load::{AtLoad, Branch, Stop};
use crate::method::ErrorEstimates;
use crate::observe::{Distribution, Leakage, Plasticity, StressDistribution, WorkPoint};
use crate::quantity::Quantity;
use crate::uncertainty::{UncertaintyComponent, ValueWithError, total};
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeMap;

/// A number that is not finite is `null` in JSON.
fn number_or_null<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::NAN))
}

/// An equilibrium of a solver, or what a method estimates at a load: parts that it does not deliver are absent. Lengths, stresses,
/// energies per area (stress times length) and stiffnesses (stress per length) are in the units of the caller, in files of a run in SI units.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct State {
    /// Index of the load step, from 0.
    pub index: usize,
    /// Loading or unloading.
    pub branch: Branch,
    /// Mean pressure over E* times the rms gradient of the full spectrum; not finite, and `null` in files, on a flat surface and on maps whose
    /// transform does not fit into memory.
    #[serde(deserialize_with = "number_or_null")]
    #[cfg_attr(feature = "schemars", schemars(with = "Option<f64>"))]
    pub p_star: f64,
    /// Mean pressure, compression positive.
    pub pressure: f64,
    /// Whether the body ends with its map: clusters and paths do not continue on the opposite side.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub non_periodic: bool,
    /// What counts as contact.
    pub criterion: String,
    /// Contact area over the area of the cell, by this criterion: the best value.
    pub contact_area: f64,
    /// Its error, of the same unit; absent where a part of it is not known, as all errors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_area_error: Option<f64>,
    /// Contact nodes over all nodes: the count from which the contact area is found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_nodes: Option<f64>,
    /// Contact nodes under compression over all nodes; with adhesion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_nodes_compressive: Option<f64>,
    /// Perimeter of the contact over the area of the cell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub perimeter: Option<f64>,
    /// Number of contact clusters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clusters: Option<usize>,
    /// Mean gap over all nodes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_gap: Option<f64>,
    /// Its error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_gap_error: Option<f64>,
    /// Displacement of the far field from first contact on this grid, conjugate of the pressure: of a periodic body the mean gap at first
    /// contact minus the mean gap, plus the mean plastic displacement, else the rigid approach.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub displacement: Option<f64>,
    /// Contact stiffness, the derivative of the pressure by the displacement without change of the contact; absent without contact, at
    /// full contact and where the state is unstable under an imposed pressure. Of estimates as the method defines it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<f64>,
    /// Its error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness_error: Option<f64>,
    /// Free energy per area: elastic, of the interaction, and of the load (pressure times the mean gap less the mean plastic
    /// displacement; of a non-periodic body less pressure times displacement).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub energy: Option<f64>,
    /// Elastic energy per area.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elastic_energy: Option<f64>,
    /// Energy of adhesion and wall per area; 0 without them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interaction_energy: Option<f64>,
    /// Plastic flow up to this load; absent for an elastic body.
    #[serde(flatten)]
    pub plasticity: Option<Plasticity>,
    /// Relative deviation from the imposed load.
    pub load_error: f64,
    /// rms residual over the pressure.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual: Option<f64>,
    /// Mean of |contact stress · gap| over pressure times rms height.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub complementarity: Option<f64>,
    /// Energy above its minimum over the elastic energy, at most; a bound. Without adhesion or flow, with a hard wall and a periodic body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub energy_bound: Option<f64>,
    /// Relative errors as the solver estimates them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error_estimates: Option<ErrorEstimates>,
    /// Errors by the grid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub discretisation: Option<Discretisation>,
    /// Errors of the maps of gap and contact, if they are asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub map_errors: Option<MapErrors>,
    /// Values at the requested range of adhesion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub extrapolated: Option<Extrapolated>,
    /// Uncertainty budget of area, mean gap and stiffness.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub uncertainty: Vec<UncertaintyComponent>,
    /// On the unloading branch: relative changes from the state at the same load on the loading branch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hysteresis: Option<Hysteresis>,
    /// Distributions, clusters and derived observables.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub observed: Option<Observed>,
    /// Solved flow through the gap, if requested; conductivities are cubes of a length.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub leakage: Option<Leakage>,
    /// Stress below the surface, if requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub subsurface: Option<SubsurfaceResults>,
    /// Gap.
    #[serde(default, skip_serializing_if = "is_in_memory")]
    pub gap_map: Option<Map<f64>>,
    /// Interfacial stress, compression positive; adhesive stress is part of it.
    #[serde(default, skip_serializing_if = "is_in_memory")]
    pub stress_map: Option<Map<f64>>,
    /// Whether a node is in contact.
    #[serde(default, skip_serializing_if = "is_in_memory")]
    pub contact_map: Option<Map<bool>>,
    /// Plastic displacement of the surface since the first load; absent before the first flow.
    #[serde(default, skip_serializing_if = "is_in_memory")]
    pub plastic_map: Option<Map<f64>>,
    /// What the method does not deliver at this load, with the reasons.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub missing: Missing,
    /// Why the solver stopped.
    pub stop: Stop,
    /// Iterations of the solver on the full grid.
    pub iterations: usize,
    /// Pairs of forward and inverse transforms of the full grid.
    pub fft_pairs: f64,
    /// Wall time.
    pub seconds: f64,
}

/// Quantities that a method does not deliver, with the reasons.
pub type Missing = BTreeMap<Quantity, String>;

/// A map `[ny, nx]`, x fastest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum Map<T> {
    /// Name of the file.
    File(String),
    /// In memory; never serialised.
    #[serde(skip)]
    Values { nx: usize, ny: usize, values: Vec<T> },
}

/// Whether there is no file to name.
fn is_in_memory<T>(map: &Option<Map<T>>) -> bool {
    !matches!(map, Some(Map::File(_)))
}

impl<T> Map<T> {
    /// Name of the file, of a stored map.
    pub fn file(&self) -> Option<&str> {
        match self {
            Map::File(file) => Some(file),
            Map::Values { .. } => None,
        }
    }
}

impl Map<f64> {
    /// A map in memory in multiples of `unit`; a file stays as it is.
    fn times(self, unit: f64) -> Self {
        match self {
            Map::Values { nx, ny, values } => {
                Map::Values { nx, ny, values: values.into_iter().map(|v| v * unit).collect() }
            }
            file => file,
        }
    }
}

impl AtLoad for State {
    fn index(&self) -> usize {
        self.index
    }
}

impl State {
    /// With lengths in multiples of `length` and stresses of `stress`: the only place that knows the dimensions. `p_star` has none.
    pub fn in_units(self, length: f64, stress: f64) -> State {
        let work = stress * length;
        let times = |value: Option<f64>, unit: f64| value.map(|v| v * unit);
        let over = |value: Option<f64>, unit: f64| value.map(|v| v * stress / unit);
        State {
            pressure: self.pressure * stress,
            perimeter: self.perimeter.map(|p| p / length),
            mean_gap: times(self.mean_gap, length),
            mean_gap_error: times(self.mean_gap_error, length),
            displacement: times(self.displacement, length),
            stiffness: over(self.stiffness, length),
            stiffness_error: over(self.stiffness_error, length),
            energy: times(self.energy, work),
            elastic_energy: times(self.elastic_energy, work),
            interaction_energy: times(self.interaction_energy, work),
            plasticity: self.plasticity.map(|p| Plasticity {
                displacement: p.displacement * length,
                work: p.work * work,
                ..p
            }),
            extrapolated: self.extrapolated.map(|e| Extrapolated {
                mean_gap: e.mean_gap.map(|g| ValueWithError { value: g.value * length, error: g.error * length }),
                ..e
            }),
            observed: self.observed.map(|o| o.in_units(length, stress)),
            leakage: self.leakage.map(|flow| Leakage {
                conductivity: flow.conductivity.map(|k| k * length.powi(3)),
                effective_medium: flow.effective_medium * length.powi(3),
                gap_errors: flow.gap_errors.map(|errors| errors.map(|e| e * length)),
                ..flow
            }),
            subsurface: self.subsurface.map(|s| s.in_units(length, stress)),
            gap_map: self.gap_map.map(|m| m.times(length)),
            stress_map: self.stress_map.map(|m| m.times(stress)),
            plastic_map: self.plastic_map.map(|m| m.times(length)),
            ..self
        }
    }

    /// Name of the file of the gap, if it is stored.
    pub fn gap_file(&self) -> Option<&str> {
        self.gap_map.as_ref()?.file()
    }

    /// Name of the file of the stress, if it is stored.
    pub fn stress_file(&self) -> Option<&str> {
        self.stress_map.as_ref()?.file()
    }

    /// Name of the file of the contact map, if it is stored.
    pub fn contact_file(&self) -> Option<&str> {
        self.contact_map.as_ref()?.file()
    }

    /// Whether nothing touches and nothing attracts: the mean gap is beyond first contact.
    pub fn is_apart(&self) -> bool {
        self.pressure == 0.0 && self.contact_area == 0.0 && self.displacement.is_some_and(|d| d < 0.0)
    }

    /// At full contact, the energy that adhesion gains over the elastic energy, if it is larger.
    fn closed_by_adhesion(&self) -> Option<f64> {
        let gain = -self.interaction_energy? / self.elastic_energy.filter(|e| *e > 0.0)?;
        (self.contact_area >= 1.0 && gain > 1.0).then_some(gain)
    }

    /// Adds components of the uncertainty, which the stated errors then contain.
    pub fn add_uncertainty(&mut self, more: impl IntoIterator<Item = UncertaintyComponent>) {
        self.uncertainty.extend(more);
        let share = |quantity| total(&self.uncertainty, quantity);
        let (area, gap) = (share(Quantity::ContactArea), share(Quantity::MeanGap));
        self.contact_area_error = area.map(|share| share * self.contact_area);
        self.mean_gap_error = gap.zip(self.mean_gap).map(|(share, gap)| share * gap.abs());
    }

    /// The state as the work of its path needs it; `None` for an estimate without energies.
    pub fn work_point(&self) -> Option<WorkPoint> {
        Some(WorkPoint {
            pressure: self.pressure,
            displacement: self.displacement?,
            stored: self.elastic_energy? + self.interaction_energy?,
            plastic_work: self.plasticity.map_or(0.0, |p| p.work),
        })
    }
}

/// Relative errors by the grid, from the changes to the grid with half the points along each side.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Discretisation {
    /// Of the contact area: a share of its change, and a third of the excess of an elastic edge for every edge. Absent if the contact
    /// is too small for a meaningful relative change.
    pub area: Option<f64>,
    /// Whether `area` is only a bound: the error of the coarser solution exceeded the difference of the grids.
    pub area_is_bound: bool,
    /// Of the mean gap: its change, and a share of the error of the contact area. Absent if the mean gap is prescribed or close to zero.
    pub mean_gap: Option<f64>,
    /// The same for `mean_gap`.
    pub mean_gap_is_bound: bool,
    /// Of the contact stiffness: its change and the share by edges of the area, if it is known on both grids.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<f64>,
    /// Points of the coarser grid along x and y.
    pub coarser: [usize; 2],
}

/// Errors of maps by the grid, from the change to the grid with half the points along each side, at the nodes of both.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct MapErrors {
    /// Root mean square error of the gap over the mean gap, or over a hundredth of the rms height if that is larger.
    pub gap: f64,
    /// One minus the Jaccard index of the contact map and the true one.
    pub contact: f64,
}

/// Extrapolation to the requested range of adhesion from several grids, each with the shortest range that it
/// resolves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Extrapolated {
    /// Requested range over the range used on this grid.
    pub range: f64,
    /// Contact area over the area of the cell.
    #[serde(rename = "contact_area")]
    pub area: ValueWithError,
    /// Absent if the mean gap is prescribed.
    pub mean_gap: Option<ValueWithError>,
}

/// Relative change of contact fraction and mean gap from loading to unloading at the same load.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Hysteresis {
    /// Of the contact area.
    pub area: f64,
    /// Of the mean gap.
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

/// Contact by compressive stress, the criterion of methods with a smooth wall or adhesion; [`State::contact_nodes_compressive`] is its
/// area.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Compressive {
    /// Number of clusters.
    pub clusters: usize,
    /// Area-weighted median of the cluster areas; absent without contact.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub median_cluster_area: Option<f64>,
    /// Counting error of the median, of independent clusters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub median_cluster_area_error: Option<f64>,
}

/// Observables of a state.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Observed {
    /// Pressure over the contact area; absent without contact.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_contact_pressure: Option<f64>,
    /// Pr(u) in bins of equal width, and in bins of equal ratio; contact is the delta.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gap: Option<Distribution>,
    /// Pr(u) in bins of equal ratio.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gap_logarithmic: Option<Distribution>,
    /// Pr(σ), compression positive, and its contribution from contact; without adhesion the nodes out of contact are
    /// the delta.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stress: Option<Distribution>,
    /// Contribution of the contact to Pr(σ).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_stress: Option<Distribution>,
    /// Pr(a): cluster area, density, number in the bin.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cluster_density: Vec<[f64; 3]>,
    /// CPr(a): cluster area, fraction of the contact in clusters up to this area.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cluster_area: Vec<[f64; 2]>,
    /// Area-weighted median of the cluster areas, at which CPr(a) is one half.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub median_cluster_area: Option<f64>,
    /// Contact under compression; only with adhesion. Without adhesion all contact is under compression.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compressive: Option<Compressive>,
    /// Electrical conductance times resistivity, a length: clusters as independent circular spots.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub constriction_conductance: Option<f64>,
    /// Uniform gap with the same leakage, from Bruggeman's effective-medium theory.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hydraulic_gap: Option<f64>,
    /// Whether contact (by edges and corners) and gap (by edges) percolate along x and along y.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_percolates: Option<[bool; 2]>,
    /// The same of the gap, by edges.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gap_percolates: Option<[bool; 2]>,
}

impl Observed {
    /// Number of contact clusters.
    pub fn clusters(&self) -> usize {
        self.cluster_density.iter().map(|[.., n]| *n as usize).sum()
    }

    /// With the distributions of the stress.
    pub fn with_stress(self, distributions: Option<StressDistribution>) -> Self {
        let (all, contact) = distributions.map(|s| (s.all, s.contact)).unzip();
        Observed { stress: all, contact_stress: contact, ..self }
    }

    fn in_units(self, length: f64, stress: f64) -> Self {
        let area = length * length;
        let in_unit = |d: Option<Distribution>, unit: f64| d.map(|d| d.in_units(unit));
        Observed {
            mean_contact_pressure: self.mean_contact_pressure.map(|p| p * stress),
            gap: in_unit(self.gap, length),
            gap_logarithmic: in_unit(self.gap_logarithmic, length),
            stress: in_unit(self.stress, stress),
            contact_stress: in_unit(self.contact_stress, stress),
            cluster_density: self.cluster_density.into_iter().map(|[a, d, n]| [a * area, d / area, n]).collect(),
            cluster_area: self.cluster_area.into_iter().map(|[a, fraction]| [a * area, fraction]).collect(),
            median_cluster_area: self.median_cluster_area.map(|a| a * area),
            compressive: self.compressive.map(|c| Compressive {
                median_cluster_area: c.median_cluster_area.map(|a| a * area),
                median_cluster_area_error: c.median_cluster_area_error.map(|a| a * area),
                ..c
            }),
            constriction_conductance: self.constriction_conductance.map(|c| c * length),
            hydraulic_gap: self.hydraulic_gap.map(|g| g * length),
            ..self
        }
    }
}

/// Stresses below the surface under the pressure of a state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct SubsurfaceResults {
    /// Poisson's ratio.
    pub poisson: f64,
    /// One for each depth, in the order of the request.
    pub slices: Vec<SubsurfaceSlice>,
    /// The largest of all slices.
    pub von_mises: Peak,
    /// The largest shear stress of all slices.
    pub shear: Peak,
    /// Largest shear stress over that at which the body yields, if it is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shear_over_strength: Option<f64>,
}

/// Largest stresses at a depth: equivalent stress after von Mises and shear stress.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct SubsurfaceSlice {
    /// Below the surface.
    pub depth: f64,
    /// Equivalent stress after von Mises.
    pub von_mises: Peak,
    /// Largest shear stress.
    pub shear: Peak,
}

/// A largest value, the node and depth where it is, and the file of the `[ny, nx]` map of that depth, if stored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Peak {
    /// The stress.
    pub value: f64,
    /// Place along x.
    pub x: f64,
    /// Place along y.
    pub y: f64,
    /// Depth.
    pub depth: f64,
    /// File of the map of that depth, if stored.
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
    fn in_units(&self, length: f64, stress: f64) -> Self {
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

/// Loads of which a warning says why nothing touches, or everything. They are numbered from 1.
#[derive(Debug, Clone, Default)]
pub struct TrivialLoads {
    loads: usize,
    apart: Vec<usize>,
    closed: Vec<usize>,
    /// Smallest gain of energy by adhesion over the elastic energy, of the closed loads.
    gain: Option<f64>,
}

impl TrivialLoads {
    /// Those of the states of a load path.
    pub fn of<'a>(states: impl IntoIterator<Item = &'a State>) -> Self {
        let mut all = TrivialLoads::default();
        states.into_iter().for_each(|state| all.add(state));
        all
    }

    /// The next state of a load path.
    pub fn add(&mut self, state: &State) {
        self.loads += 1;
        if state.is_apart() {
            self.apart.push(self.loads);
        }
        if let Some(gain) = state.closed_by_adhesion() {
            self.closed.push(self.loads);
            self.gain = Some(self.gain.map_or(gain, |least| least.min(gain)));
        }
    }

    /// At most one warning for each of both.
    pub fn warnings(&self) -> Vec<String> {
        let list = |numbers: &[usize]| numbers.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
        let apart = (!self.apart.is_empty()).then(|| {
            let loads = list(&self.apart);
            format!("load {loads}: the mean gap is beyond first contact, where without adhesion nothing touches")
        });
        let closed = self.gain.map(|gain| {
            let loads = list(&self.closed);
            let decimals = if gain < 10.0 { 1 } else { 0 };
            format!(
                "load {loads}: adhesion closes the gap: it gains {gain:.decimals$} times the elastic energy of full contact, so that the surfaces stick \
                 without any pressure; for partial contact the work of adhesion is smaller, the body stiffer or the surface rougher"
            )
        });
        apart.into_iter().chain(closed).collect()
    }
}

#[cfg(test)]
mod tests;
