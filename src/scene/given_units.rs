//! Solvers know reduced units alone: what they complain about is shown in the units in which a scene gives its numbers.

use super::model::Scene;
use super::quantity::{Dimensional, Length, Quantity, Stress, Work};
use crate::Error;
use asperity_contact::interface::{Notation, in_notation, is_ordinary, rounded};
use asperity_grid::units::Scales;

/// Units of a scene's loads, or of its scales where the loads are given as other quantities.
#[derive(Debug, Clone, Copy)]
pub struct GivenUnits {
    scales: Scales,
    length: Length,
    stress: Stress,
    work: Work,
}

impl GivenUnits {
    pub(super) fn of(scene: &Scene, scales: Scales) -> Self {
        let (load, lab) = (&scene.load, &scene.laboratory);
        let work = if lab.is_plain() { Work::plain(1.0) } else { Work::new(1.0, "J/m2") };
        GivenUnits {
            scales,
            length: *load.mean_gap.first().or(load.displacement.first()).unwrap_or(&lab.length()),
            stress: load.pressure.first().copied().or(scene.hardness()).unwrap_or(lab.modulus()),
            work: scene.adhesion.as_ref().map_or(work, |adhesion| adhesion.work_of_adhesion),
        }
    }

    /// The same units for a problem with other scales, such as that of the block of atoms.
    pub fn with(self, scales: Scales) -> Self {
        GivenUnits { scales, ..self }
    }

    /// An error of a solver in these units.
    pub fn rewrite(&self, error: Error) -> Error {
        error.rewritten(|text| in_notation(text, self))
    }
}

impl Notation for GivenUnits {
    fn length(&self, over_length: f64) -> String {
        written(over_length * self.scales.length_m, self.length)
    }

    fn stress(&self, over_modulus: f64) -> String {
        written(over_modulus * self.scales.modulus_pa, self.stress)
    }

    fn work(&self, reduced: f64) -> String {
        written(reduced * self.scales.modulus_pa * self.scales.length_m, self.work)
    }
}

/// A number in SI units, or a plain one, in the unit of a quantity.
fn written<D: Dimensional>(si: f64, like: Quantity<D>) -> String {
    let value = rounded(si / like.with(1.0).si());
    let quantity = like.with(value);
    if is_ordinary(value) { quantity.to_string() } else { format!("{quantity:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn units(scene: &str) -> GivenUnits {
        let scene: Scene = toml::from_str(scene).expect("a scene");
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
