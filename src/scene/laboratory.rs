//! `[laboratory]`: scales of the continuum problem, and the units of a scene's numbers.

use crate::units::Scales;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The challenge's extent of the cell, µm, and contact modulus, MPa: those of a synthesised surface by default.
const CHALLENGE_LENGTH_UM: f64 = 100.0;
const CHALLENGE_MODULUS_MPA: f64 = 25.0;

/// Scales of the continuum problem.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Laboratory {
    /// Extent of the cell in x, µm. Default: 100 for a synthesised surface; for an imported one what its file declares;
    /// required where it declares none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_um: Option<f64>,
    /// Extent in y of an imported map's cell, µm. Default: what the file declares, or square pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_y_um: Option<f64>,
    /// Contact modulus E* = E/(1-ν²), MPa. Default: 25 for a synthesised surface; required for an imported one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact_modulus_mpa: Option<f64>,
    /// Not a key of scene files.
    #[serde(skip)]
    pub units: Units,
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
    /// Extent of the cell in x: the given one, or the challenge's.
    pub fn length(&self) -> f64 {
        self.length_um.unwrap_or(CHALLENGE_LENGTH_UM)
    }

    /// Contact modulus: the given one, or the challenge's.
    pub fn contact_modulus(&self) -> f64 {
        self.contact_modulus_mpa.unwrap_or(CHALLENGE_MODULUS_MPA)
    }

    /// Length and stress that reduced numbers are multiples of: in SI, or in consistent units.
    pub fn scales(&self) -> Scales {
        let (length, modulus) = (self.length(), self.contact_modulus());
        match self.units {
            Units::Named => Scales { length_m: length * 1e-6, modulus_pa: modulus * 1e6 },
            Units::Consistent => Scales { length_m: length, modulus_pa: modulus },
        }
    }

    /// A length in µm over the cell's extent.
    pub fn reduced_um(&self, um: f64) -> f64 {
        match self.units {
            Units::Named => um * 1e-6 / self.scales().length_m,
            Units::Consistent => um / self.length(),
        }
    }

    /// A length in nm over the cell's extent.
    pub fn reduced_nm(&self, nm: f64) -> f64 {
        match self.units {
            Units::Named => nm * 1e-9 / self.scales().length_m,
            Units::Consistent => nm / self.length(),
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

    /// A force in mN on the cell, whose extent in y is `aspect` times that in x, as pressure over E*.
    pub fn reduced_force(&self, mn: f64, aspect: f64) -> f64 {
        let scales = self.scales();
        let in_scales = match self.units {
            Units::Named => mn * 1e-3,
            Units::Consistent => mn,
        };
        in_scales / scales.modulus_pa / scales.length_m / (scales.length_m * aspect)
    }

    /// Metres of one unit of the scene's lengths; `heights_m` is that of the heights, where it is known.
    pub fn metres(&self, heights_m: Option<f64>) -> Option<f64> {
        match self.units {
            Units::Named => Some(1e-6),
            Units::Consistent => heights_m,
        }
    }
}
