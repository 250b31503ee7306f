//! `[atoms.nvt]`: constant-temperature runs of the atoms.

use crate::atoms::nvt::NvtSettings;
use crate::atoms::potential::calcium_lattice_constant;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// At each load an NVT run starts from the relaxed atoms and gives the probability of contact of each.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NvtScene {
    /// Temperature.
    pub temperature_k: f64,
    /// Time at each load, ps.
    pub time_ps: f64,
    /// Fraction of the time before averaging starts.
    #[serde(default = "fifth")]
    pub equilibration: f64,
    /// Lattice constant at the temperature and no pressure, Å; required with another potential.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lattice_constant_angstrom: Option<f64>,
}

fn fifth() -> f64 {
    0.2
}

impl NvtScene {
    pub(super) fn settings(&self) -> NvtSettings {
        NvtSettings {
            temperature_k: self.temperature_k,
            time_ps: self.time_ps,
            equilibration: self.equilibration,
            lattice_constant_angstrom: self
                .lattice_constant_angstrom
                .unwrap_or_else(|| calcium_lattice_constant(self.temperature_k)),
        }
    }
}
