//! Solvers know reduced units alone: what they complain about is shown in the units in which a scene gives its numbers.

use super::model::Scene;
use super::quantity::{Dimensional, Length, Quantity, Stress, Work};
use crate::Error;
use asperity_contact::interface::{Notation, Reduced, in_notation, rounded};
use asperity_contact::load::{Load, LoadStep};
use asperity_contact::problem::LoadKind;
use asperity_grid::units::Scales;

/// Units of a scene's loads, or of its scales where the loads are given as other quantities. The flags of a command line have their own, and
/// until they are known its numbers are reduced.
#[derive(Debug, Clone, Copy)]
pub struct GivenUnits {
    scales: Scales,
    /// How loads are given.
    kind: LoadKind,
    shown: Option<(Length, Stress, Work)>,
}

impl GivenUnits {
    pub(super) fn of(scene: &Scene, scales: Scales) -> Self {
        let (load, lab) = (&scene.load, &scene.laboratory);
        let length = *load.mean_gap.first().or(load.displacement.first()).unwrap_or(&lab.length());
        let stress = load.pressure.first().copied().or(scene.hardness()).unwrap_or(lab.modulus());
        let shown = (!lab.is_plain()).then(|| {
            let work = scene.adhesion.as_ref().map_or(Work::new(1.0, "J/m2"), |adhesion| adhesion.work_of_adhesion);
            (length, stress, work)
        });
        GivenUnits { scales, kind: load.loads().kind, shown }
    }

    /// In the units of these values. Scales are in SI units for those that have one.
    pub fn shown_as(self, scales: Scales, like: (Length, Stress, Work)) -> Self {
        GivenUnits { scales, shown: Some(like), ..self }
    }

    /// The same units for a problem with other scales, such as that of the block of atoms.
    pub fn with(self, scales: Scales) -> Self {
        GivenUnits { scales, ..self }
    }

    /// A load as an error names it.
    pub fn load(&self, step: &LoadStep) -> String {
        match (step.target, step.p_star) {
            (_, Some(p_star)) if self.kind == LoadKind::PStar => format!("p* = {}", rounded(p_star)),
            (Load::Pressure(pressure), _) => format!("a pressure of {}", self.stress(pressure)),
            (Load::MeanGap(gap), _) => format!("a mean gap of {}", self.length(gap)),
        }
    }

    /// An error of a solver in these units.
    pub fn rewrite(&self, error: Error) -> Error {
        error.rewritten(|text| self.text(text))
    }

    /// A message of a solver in these units.
    pub fn text(&self, text: &str) -> String {
        in_notation(text, self)
    }
}

impl Notation for GivenUnits {
    fn length(&self, over_length: f64) -> String {
        let Some((like, ..)) = self.shown else { return Reduced.length(over_length) };
        written(over_length * self.scales.length_m, like)
    }

    fn stress(&self, over_modulus: f64) -> String {
        let Some((_, like, _)) = self.shown else { return Reduced.stress(over_modulus) };
        written(over_modulus * self.scales.modulus_pa, like)
    }

    fn work(&self, reduced: f64) -> String {
        let Some((.., like)) = self.shown else { return Reduced.work(reduced) };
        written(reduced * self.scales.modulus_pa * self.scales.length_m, like)
    }
}

/// A number in SI units, or a plain one, in the unit of a quantity.
fn written<D: Dimensional>(si: f64, like: Quantity<D>) -> String {
    let value = rounded(si / like.with(1.0).si());
    like.with(value).in_words()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn units(scene: &str) -> GivenUnits {
        let scene: Scene = toml::from_str(&format!("surface = {{}}\n{scene}")).expect("a scene");
        GivenUnits::of(&scene, scene.laboratory.scales())
    }

    /// 25 MPa and 100 µm, the defaults.
    #[test]
    fn numbers_have_the_units_in_which_they_are_given() {
        let [pressure, gap, p_star] =
            ["pressure = [\"30 kPa\"]", "mean_gap = [\"20 nm\"]", "p_star = [0.01]"].map(|load| {
                let given = units(&format!("name = \"n\"\nload = {{ {load} }}\n"));
                [given.stress(1e-3), given.length(1e-3), given.work(2e-5), given.stress(4e-40)]
            });
        assert_eq!(pressure, ["25 kPa", "0.1 um", "0.05 J/m2", "1e-35 kPa"]);
        assert_eq!(gap, ["0.025 MPa", "100 nm", "0.05 J/m2", "1e-38 MPa"]);
        assert_eq!(p_star, ["0.025 MPa", "0.1 um", "0.05 J/m2", "1e-38 MPa"]);
    }

    #[test]
    fn errors_of_solvers_are_rewritten() {
        let error =
            Error::input("method fast", "pressure", "1.2e-3 E*", "less than 1e-3 E*, at which every node flows");
        let text = units("name = \"n\"\nload = { pressure = [\"30 kPa\"] }\n").rewrite(error).to_string();
        assert_eq!(text, "method fast: pressure = 30 kPa; accepted: less than 25 kPa, at which every node flows");
    }
}
