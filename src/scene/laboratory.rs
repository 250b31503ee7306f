//! `[laboratory]`: scales of the continuum problem, and the units of a scene's numbers.

use crate::units::Scales;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Scales of the continuum problem. The defaults are the challenge's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Laboratory {
    /// Extent of the periodic cell in x, µm.
    pub length_um: f64,
    /// Contact modulus E* = E/(1-ν²), MPa.
    pub contact_modulus_mpa: f64,
    /// Extent in y of a height map's cell, µm. Default: square pixels. Not a key of scene files.
    #[serde(skip)]
    pub length_y_um: Option<f64>,
    /// Not a key of scene files.
    #[serde(skip)]
    pub units: Units,
}

impl Default for Laboratory {
    fn default() -> Self {
        Laboratory { length_um: 100.0, contact_modulus_mpa: 25.0, length_y_um: None, units: Units::Named }
    }
}

/// Units of the numbers in a scene.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Units {
    /// Those in the names of the keys.
    #[default]
    Named,
    /// Any consistent set, as on the command line of `asperity solve`: lengths in the unit of the heights, stresses in that of the
    /// modulus, a work of adhesion in their product. The units in the names of the keys do not apply.
    Consistent,
}

impl Laboratory {
    /// Length and stress that reduced numbers are multiples of: in SI, or in consistent units.
    pub fn scales(&self) -> Scales {
        match self.units {
            Units::Named => Scales { length_m: self.length_um * 1e-6, modulus_pa: self.contact_modulus_mpa * 1e6 },
            Units::Consistent => Scales { length_m: self.length_um, modulus_pa: self.contact_modulus_mpa },
        }
    }

    /// A length in µm over the cell's extent.
    pub fn reduced_um(&self, um: f64) -> f64 {
        match self.units {
            Units::Named => um * 1e-6 / self.scales().length_m,
            Units::Consistent => um / self.length_um,
        }
    }

    /// A length in nm over the cell's extent.
    pub fn reduced_nm(&self, nm: f64) -> f64 {
        match self.units {
            Units::Named => nm * 1e-9 / self.scales().length_m,
            Units::Consistent => nm / self.length_um,
        }
    }

    /// A work of adhesion in mJ/m², in units of E* L.
    pub fn reduced_work(&self, mj_m2: f64) -> f64 {
        let in_scales = match self.units {
            Units::Named => mj_m2 * 1e-3,
            Units::Consistent => mj_m2,
        };
        self.scales().reduced_energy_per_area(in_scales)
    }
}
