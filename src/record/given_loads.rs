//! The quantity in which loads are named.

use asperity_contact::problem::LoadKind;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A quantity of loads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LoadQuantity {
    PStar,
    /// Mean pressure, Pa.
    Pressure,
    /// Normal force on the map, N.
    Force,
}

/// Loads are named as the scene gave them: by p*, pressure or force at the laboratory scale. Atoms have the same p* under another pressure.
/// Where it gave gaps, displacements or contact areas, loads are named by the pressures that came out.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GivenLoads {
    /// In which they are named.
    pub quantity: LoadQuantity,
    /// The load p* = 1: 1, in Pa or in N.
    pub of_p_star: f64,
    /// What was imposed, if it was no pressure.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub imposed: Option<Imposed>,
}

/// What a scene can impose in place of a pressure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Imposed {
    ContactArea,
    MeanGap,
    Displacement,
}

impl Imposed {
    /// `None` for pressures.
    pub fn of(kind: LoadKind) -> Option<Self> {
        match kind {
            LoadKind::Contact => Some(Imposed::ContactArea),
            LoadKind::MeanGap => Some(Imposed::MeanGap),
            LoadKind::Displacement => Some(Imposed::Displacement),
            LoadKind::PStar | LoadKind::Pressure | LoadKind::Force => None,
        }
    }

    /// Its quantity in the tables of an ensemble.
    pub fn name(self) -> &'static str {
        match self {
            Imposed::ContactArea => "contact_area",
            Imposed::MeanGap => "mean_gap",
            Imposed::Displacement => "displacement",
        }
    }

    /// Whether the mean gap of each load was given.
    pub fn is_gap(self) -> bool {
        self != Imposed::ContactArea
    }
}

impl GivenLoads {
    pub const P_STAR: Self = GivenLoads { quantity: LoadQuantity::PStar, of_p_star: 1.0, imposed: None };
}
