//! `[atoms.nvt]`: constant-temperature runs of the atoms.

use super::quantity::{Length, Temperature, Time};
use asperity_atoms::nvt::NvtSettings;
use asperity_atoms::potential::calcium_lattice_constant;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// At each load an NVT run starts from the relaxed atoms and gives the probability of contact of each.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NvtScene {
    /// Temperature.
    pub temperature: Temperature,
    /// Time at each load.
    pub time: Time,
    /// Fraction of the time before averaging starts.
    #[serde(default = "fifth")]
    pub equilibration: f64,
    /// Lattice constant at the temperature and no pressure; required with another potential.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lattice_constant: Option<Length>,
}

fn fifth() -> f64 {
    0.2
}

impl NvtScene {
    pub(super) fn settings(&self) -> NvtSettings {
        let temperature_k = self.temperature.to("K");
        NvtSettings {
            temperature_k,
            time_ps: self.time.to("ps"),
            equilibration: self.equilibration,
            lattice_constant_angstrom: self
                .lattice_constant
                .map_or_else(|| calcium_lattice_constant(temperature_k), |a| a.to("Å")),
        }
    }
}
