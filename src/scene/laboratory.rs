//! `[laboratory]`: scales of the continuum problem.

use super::quantity::{Length, Stress};
use asperity_grid::units::Scales;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Scales of the continuum problem.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LaboratoryScene {
    /// Extent of the cell in x. Default: 100 µm for a synthesised surface; for an imported one what its file declares;
    /// required where it declares none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length: Option<Length>,
    /// Extent in y of an imported map's cell. Default: what the file declares, or square pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_y: Option<Length>,
    /// Contact modulus E* = E/(1-ν²). Default: 25 MPa for a synthesised surface; required for an imported one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub modulus: Option<Stress>,
}

impl LaboratoryScene {
    /// Extent of the cell in x: the given one, or the challenge's.
    pub fn length(&self) -> Length {
        self.length.unwrap_or(Length::new(100.0, "um"))
    }

    /// Contact modulus: the given one, or the challenge's.
    pub fn modulus(&self) -> Stress {
        self.modulus.unwrap_or(Stress::new(25.0, "MPa"))
    }

    /// Whether the numbers of the scene are plain, as those of `asperity solve` and the library: in consistent units, lengths in that of the
    /// heights, stresses in that of the modulus, a work of adhesion in their product.
    pub fn is_plain(&self) -> bool {
        self.length.is_some_and(Length::is_plain) || self.modulus.is_some_and(Stress::is_plain)
    }

    /// A length of the surface's file, as a number: in µm, or in consistent units.
    pub fn number(&self, length: Length) -> f64 {
        length.to("um")
    }

    /// The length of such a number.
    pub fn of_number(&self, number: f64) -> Length {
        if self.is_plain() { Length::plain(number) } else { Length::new(number, "um") }
    }

    /// Metres of one unit of these numbers; `heights_m` is that of the heights, where it is known.
    pub fn metres(&self, heights_m: Option<f64>) -> Option<f64> {
        if self.is_plain() { heights_m } else { Some(1e-6) }
    }

    /// Length and stress that reduced numbers are multiples of: in SI, or in consistent units.
    pub fn scales(&self) -> Scales {
        Scales { length_m: self.length().si(), modulus_pa: self.modulus().si() }
    }

    /// A length over the cell's extent.
    pub fn reduced(&self, length: Length) -> f64 {
        length.over(self.length())
    }

    /// A stress over the contact modulus.
    pub fn reduced_stress(&self, stress: Stress) -> f64 {
        stress.over(self.modulus())
    }
}
