//! Equilibria of the continuum along a load path, as in `results.json`: lengths and stresses in the units of the states.

use crate::load::Branch;
use crate::state::State;
use asperity_surface::Surface;
use serde::{Deserialize, Serialize};

/// Continuum states of one problem along its load path.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct ContinuumResults {
    /// Id in `asperity methods`.
    pub method: String,
    /// "half-space" or the layer, in words.
    pub kernel: String,
    /// "none" or the law with its work of adhesion and range, in words.
    pub adhesion: String,
    /// "hard wall" or the name of the compliant wall.
    pub wall: String,
    /// Largest contact stress, of a map the mean; absent for an elastic body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hardness: Option<f64>,
    /// Absent where the hardness is the same everywhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hardness_map: Option<HardnessMapResults>,
    /// Points of the grid along x.
    pub nx: usize,
    /// Points along y.
    pub ny: usize,
    /// Absent without adhesion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<RangeResults>,
    /// rms gradient that the grid resolves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resolved_gradient: Option<f64>,
    /// One for each load, in order.
    pub states: Vec<State>,
    /// Energy per area that the load path dissipates, open or closed: the work of the load less the change of the stored
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
    /// Where requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pull_off: Option<PullOff>,
    /// Reason why the states end before the last load: a tension that separates the surfaces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_lost: Option<String>,
    /// Reason why a requested pull-off was not found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pull_off_failure: Option<String>,
}

impl ContinuumResults {
    /// States of the loading branch.
    pub fn loading(&self) -> impl Iterator<Item = &State> {
        self.states.iter().filter(|s| s.branch == Branch::Loading)
    }
}

/// Loads p* between which plasticity begins: the last before it, 0 if it is the first, and the first with it. Absent if no load
/// reaches it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
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
    pub fn of(states: &[State]) -> Self {
        let between = |begun: &dyn Fn(&State) -> bool| {
            let loading: Vec<&State> = states.iter().take_while(|s| s.branch == Branch::Loading).collect();
            let first = loading.iter().position(|s| begun(s))?;
            let before = first.checked_sub(1).map_or(0.0, |i| loading[i].p_star);
            Some([before, loading[first].p_star])
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

/// A map of the hardness: its file with the BLAKE3 hash, lowest and highest value. No file if it came from a program.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct HardnessMapResults {
    /// Name of the file.
    pub file: String,
    /// Its BLAKE3 hash, hexadecimal.
    pub hash: String,
    /// Lowest hardness.
    pub lowest: f64,
    /// Highest hardness.
    pub highest: f64,
}

/// Range of the adhesion: as requested and as used on the grid, each with its cohesive resolution (ρ/√(γ
/// dx/E*) for the exponential law).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct RangeResults {
    /// Work of adhesion.
    pub gamma: f64,
    /// Requested range.
    pub requested: f64,
    /// Range on the grid.
    pub used: f64,
    /// Cohesive resolution of the requested range.
    pub resolution_requested: f64,
    /// Cohesive resolution of the range on the grid.
    pub resolution_used: f64,
}

/// Pull-off: the largest tensile load of an equilibrium.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct PullOff {
    /// Lowest mean pressure of an equilibrium on the unloading branch (negative).
    pub pressure: f64,
    /// Mean gap at that pressure.
    pub mean_gap: f64,
    /// Normal force on the measured map at that pressure (negative). Absent for a profile.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force: Option<f64>,
    /// Three times the change of the pressure from the grid with half the points along each side, and what the search leaves: how much
    /// larger the tension may be between its states. Absent without a pull-off on that grid.
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

impl PullOff {
    /// With the force on the measured map of a surface in the same units; a profile has no area.
    #[must_use]
    pub fn on(self, surface: &Surface) -> Self {
        let area = (surface.grid().ny > 1).then(|| surface.mapped_area());
        PullOff { force: area.map(|area| self.pressure * area), ..self }
    }

    /// Error of the pressure over its size; `None` where it is not known.
    pub fn relative_error(&self) -> Option<f64> {
        Some(self.pressure_error? / self.pressure.abs())
    }
}

impl HardnessMapResults {
    /// With stresses in multiples of `stress`.
    pub fn in_units(self, stress: f64) -> Self {
        HardnessMapResults { lowest: self.lowest * stress, highest: self.highest * stress, ..self }
    }
}

impl RangeResults {
    /// With lengths in multiples of `length` and stresses of `stress`.
    pub fn in_units(self, length: f64, stress: f64) -> Self {
        let (requested, used) = (self.requested * length, self.used * length);
        RangeResults { gamma: self.gamma * stress * length, requested, used, ..self }
    }
}

impl PullOff {
    /// With lengths in multiples of `length` and stresses of `stress`.
    pub fn in_units(self, length: f64, stress: f64) -> Self {
        PullOff {
            pressure: self.pressure * stress,
            mean_gap: self.mean_gap * length,
            force: self.force.map(|f| f * stress * length * length),
            pressure_error: self.pressure_error.map(|e| e * stress),
            mean_gap_error: self.mean_gap_error.map(|e| e * length),
            curve: self.curve.into_iter().map(|[gap, pressure]| [gap * length, pressure * stress]).collect(),
            ..self
        }
    }
}
