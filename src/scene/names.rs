//! What a scene calls the fields of its problem.

use super::{Dimensional, Quantity, Scene};
use asperity_contact::problem::{Field, LoadKind, Names};

/// The keys of a scene, with its values as they are written.
pub(super) struct Keys<'s>(pub &'s Scene);

impl Names for Keys<'_> {
    fn name(&self, field: Field) -> String {
        let key = match field {
            Field::Length => "laboratory.length",
            Field::Modulus => "laboratory.modulus",
            Field::Periodic => "continuum.periodic",
            Field::Layer => "continuum.layer",
            Field::Thickness => "continuum.layer.thickness",
            Field::LayerPoisson => "continuum.layer.poisson",
            Field::Crystal => "continuum.crystal",
            Field::C11 => "continuum.crystal.c11",
            Field::C12 => "continuum.crystal.c12",
            Field::C44 => "continuum.crystal.c44",
            Field::WorkOfAdhesion => "adhesion.work_of_adhesion",
            Field::Range => "adhesion.range",
            Field::Resolution => "adhesion.resolution",
            Field::Wall => "continuum.wall",
            Field::PenaltyLength => "continuum.penalty_length",
            Field::Hardness => "continuum.hardness",
            Field::HardnessMap => "continuum.hardness_map",
            Field::Method => "continuum.method",
            Field::Tolerance => "continuum.tolerance",
            Field::MaxIterations => "continuum.max_iterations",
            Field::InitialGap => "continuum.initial_gap",
            Field::PStar => "load.p_star",
            Field::Pressure => "load.pressure",
            Field::Force => "load.force",
            Field::MeanGap => "load.mean_gap",
            Field::Displacement => "load.displacement",
            Field::Contact => "load.contact",
            Field::Unload => "load.unload",
            Field::PullOff => "load.pull_off",
            Field::Error => "accuracy.error",
        };
        key.into()
    }

    fn value(&self, field: Field, index: Option<usize>, value: f64) -> String {
        fn text<D: Dimensional>(quantity: Option<Quantity<D>>) -> Option<String> {
            quantity.map(|q| q.in_words())
        }
        let Scene { laboratory, load, adhesion, continuum, .. } = self.0;
        let (layer, crystal) = (continuum.layer.as_ref(), continuum.crystal.as_ref());
        let written = match (field, index) {
            (Field::Length, _) => text(Some(laboratory.length())),
            (Field::Modulus, _) => text(Some(laboratory.modulus())),
            (Field::Thickness, _) => text(layer.map(|l| l.thickness)),
            (Field::C11, _) => text(crystal.map(|c| c.c11)),
            (Field::C44, _) => text(crystal.map(|c| c.c44)),
            (Field::WorkOfAdhesion, _) => text(adhesion.as_ref().map(|a| a.work_of_adhesion)),
            (Field::Range, _) => text(adhesion.as_ref().map(|a| a.range)),
            (Field::PenaltyLength, _) => text(continuum.penalty_length),
            (Field::Hardness, _) => text(self.0.hardness()),
            (Field::Pressure, Some(i)) => load.text(LoadKind::Pressure, i),
            (Field::Force, Some(i)) => load.text(LoadKind::Force, i),
            (Field::MeanGap, Some(i)) => load.text(LoadKind::MeanGap, i),
            (Field::Displacement, Some(i)) => load.text(LoadKind::Displacement, i),
            // In the unit of the first, with the digits of the value.
            (Field::Displacement, None) => load.displacement.first().map(|first| {
                let in_unit = value / first.with(1.0).si();
                let text = first.with(format!("{in_unit:.5e}").parse().unwrap_or(in_unit)).to_string();
                if first.is_plain() { text + " in the unit of the heights" } else { text }
            }),
            _ => None,
        };
        written.unwrap_or_else(|| value.to_string())
    }
}
