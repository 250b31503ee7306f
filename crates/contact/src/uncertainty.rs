//! Uncertainty budget of a state.

use super::quantity::Quantity;
use serde::{Deserialize, Serialize};

/// Source of an uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum UncertaintySource {
    /// Discretization: the change from the grid with half the points along each side.
    Grid,
    /// Waves of the surface that the grid does not hold.
    Waves,
    /// Range of the adhesion, enlarged to the shortest range that the grid resolves.
    Range,
    /// Residual of the solver, converted to an equal relative change of the load.
    Solver,
    /// Round-off of the fields, converted in the same way.
    Precision,
    /// Finite depth of the atoms' block: the change from a half-space on the same heights.
    Depth,
}

impl UncertaintySource {
    pub const ALL: [UncertaintySource; 6] = [
        UncertaintySource::Grid,
        UncertaintySource::Waves,
        UncertaintySource::Range,
        UncertaintySource::Solver,
        UncertaintySource::Precision,
        UncertaintySource::Depth,
    ];

    pub fn name(self) -> &'static str {
        match self {
            UncertaintySource::Grid => "grid",
            UncertaintySource::Waves => "waves beyond the grid",
            UncertaintySource::Range => "range of the adhesion",
            UncertaintySource::Solver => "solver",
            UncertaintySource::Precision => "precision",
            UncertaintySource::Depth => "finite depth",
        }
    }
}

/// One component of the relative uncertainty of a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct UncertaintyComponent {
    /// Of which quantity.
    pub quantity: Quantity,
    /// Where it comes from.
    pub source: UncertaintySource,
    /// Uncertainty over the value; absent if unknown.
    pub relative: Option<f64>,
    /// Whether `relative` is only a bound.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_bound: bool,
}

/// A value with its error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct ValueWithError {
    /// The value.
    pub value: f64,
    /// Its error, of the same unit.
    pub error: f64,
}

/// Relative error of a quantity: the sum of its components, of which none may be unknown. `None` without the component of the grid, too.
pub fn total(components: &[UncertaintyComponent], quantity: Quantity) -> Option<f64> {
    let of_quantity = || components.iter().filter(|c| c.quantity == quantity);
    of_quantity().find(|c| c.source == UncertaintySource::Grid)?;
    of_quantity().map(|c| c.relative).sum()
}
