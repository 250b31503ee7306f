//! `[laboratory]`: scales of the continuum problem.

use super::quantity::{Length, Stress};
use asperity_contact::problem::contact_modulus;
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
    /// Contact modulus E* = E/(1-ν²). Default: 25 MPa for a synthesised surface; required for an imported one, unless `bodies` are given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub modulus: Option<Stress>,
    /// Instead of the modulus, one or two elastic bodies: 1/E* = Σ (1-ν²)/E. The first is that of `surface`, the second that of
    /// `surface.other`, or flat; without it the other body is rigid.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub bodies: Vec<BodyScene>,
}

/// One of two elastic bodies.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyScene {
    /// Young's modulus E.
    pub young: Stress,
    /// Poisson's ratio ν.
    pub poisson: f64,
    /// Hardness. That of the softer body counts; instead of `continuum.hardness`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hardness: Option<Stress>,
}

impl LaboratoryScene {
    /// Extent of the cell in x: the given one, or the challenge's.
    pub fn length(&self) -> Length {
        self.length.unwrap_or(Length::new(100.0, "um"))
    }

    /// Contact modulus: the given one, that of the bodies, or the challenge's.
    pub fn modulus(&self) -> Stress {
        self.modulus.or(self.of_bodies()).unwrap_or(Stress::new(25.0, "MPa"))
    }

    /// In the unit of the first body.
    fn of_bodies(&self) -> Option<Stress> {
        let unit = self.bodies.first()?.young.with(1.0);
        Some(unit.with(contact_modulus(&self.constants(unit))))
    }

    /// Young's modulus and Poisson's ratio of each of the bodies.
    fn constants(&self, unit: Stress) -> Vec<[f64; 2]> {
        self.bodies.iter().map(|body| [body.young.over(unit), body.poisson]).collect()
    }

    /// Share of each of the bodies in the deformation.
    pub fn shares(&self) -> Vec<f64> {
        let constants = self.constants(self.modulus());
        constants.iter().map(|body| 1.0 / contact_modulus(&[*body])).collect()
    }

    /// Hardness of the softer body.
    pub fn hardness(&self) -> Option<Stress> {
        self.bodies
            .iter()
            .filter_map(|body| body.hardness)
            .filter(|h| h.value() > 0.0)
            .reduce(|a, b| if a.over(b) <= 1.0 { a } else { b })
    }

    /// Whether the numbers of the scene are plain, as those of `asperity solve` and the library: in consistent units, lengths in that of the
    /// heights, stresses in that of the modulus, a work of adhesion in their product.
    pub fn is_plain(&self) -> bool {
        self.length.is_some_and(Length::is_plain) || self.modulus.or(self.of_bodies()).is_some_and(Stress::is_plain)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compliances_of_bodies_add_up() {
        let body = |young: f64, unit: &str, poisson: f64| BodyScene {
            young: Stress::new(young, unit),
            poisson,
            hardness: Some(Stress::new(young / 100.0, unit)),
        };
        let bodies = vec![body(2e3, "MPa", 0.5), body(70.0, "GPa", 0.3)];
        let lab = LaboratoryScene { bodies, ..LaboratoryScene::default() };
        // 1/E* = 0.75/2 + 0.91/70 per GPa.
        let modulus = 1.0 / (0.375 + 0.013);
        assert!((lab.modulus().to("GPa") / modulus - 1.0).abs() < 1e-14);
        let [soft, stiff] = lab.shares()[..] else { panic!("two") };
        assert!((soft - 0.375 * modulus).abs() < 1e-14 && (soft + stiff - 1.0).abs() < 1e-14);
        assert_eq!(lab.hardness(), Some(Stress::new(20.0, "MPa")));
    }
}
