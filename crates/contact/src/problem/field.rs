//! Fields of a problem and its loads, and what a face calls them.

use asperity_grid::error::Complaint;

/// A field of a [`Problem`](super::Problem), or of its loads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Field {
    Length,
    Modulus,
    Periodic,
    Layer,
    Thickness,
    LayerPoisson,
    Crystal,
    C11,
    C12,
    C44,
    WorkOfAdhesion,
    Range,
    Resolution,
    Wall,
    PenaltyLength,
    Hardness,
    HardnessMap,
    Method,
    Tolerance,
    MaxIterations,
    InitialGap,
    PStar,
    Pressure,
    Force,
    MeanGap,
    Displacement,
    Contact,
    Unload,
    PullOff,
    /// Of an [`Accuracy`](super::Accuracy).
    Error,
}

/// Words of a face for the fields: keys of a scene, flags, or the arguments of the library.
pub trait Names {
    /// What a field is called.
    fn name(&self, field: Field) -> String;

    /// A choice of a field, as `method = "fast"`.
    fn choice(&self, field: Field, value: &str) -> String {
        format!("{} = {value:?}", self.name(field))
    }

    /// An entry of a list.
    fn entry(&self, field: Field, index: usize) -> String {
        format!("{}[{index}]", self.name(field))
    }

    /// A value as its user gave it; without an index of a list, or of a single field, in the same unit.
    fn value(&self, _: Field, _: Option<usize>, value: f64) -> String {
        value.to_string()
    }

    /// A complaint about a value, of a list about the entry `index`.
    fn complaint(&self, field: Field, index: Option<usize>, value: f64, accepted: String) -> Complaint {
        let key = index.map_or_else(|| self.name(field), |i| self.entry(field, i));
        Complaint::new(key, self.value(field, index, value), accepted)
    }
}

/// Names of the fields of [`Problem`](super::Problem) itself.
pub struct Arguments;

impl Names for Arguments {
    fn name(&self, field: Field) -> String {
        let name = match field {
            Field::Length => "the surface's length",
            Field::Modulus => "modulus",
            Field::Periodic | Field::Layer | Field::Crystal => "body",
            Field::Thickness => "body.thickness",
            Field::LayerPoisson => "body.poisson",
            Field::C11 => "body.c11",
            Field::C12 => "body.c12",
            Field::C44 => "body.c44",
            Field::WorkOfAdhesion => "adhesion.work_of_adhesion",
            Field::Range => "adhesion.range",
            Field::Resolution => "adhesion.resolution",
            Field::Wall | Field::PenaltyLength => "penalty_length",
            Field::Hardness | Field::HardnessMap => "hardness",
            Field::Method => "method",
            Field::Tolerance => "tolerance",
            Field::MaxIterations => "max_iterations",
            Field::InitialGap => "initial_gap",
            Field::PStar => "p_star",
            Field::Pressure => "pressure",
            Field::Force => "force",
            Field::MeanGap => "mean_gap",
            Field::Displacement => "displacement",
            Field::Contact => "contact",
            Field::Unload => "unload",
            Field::PullOff => "pull_off",
            Field::Error => "error",
        };
        name.into()
    }

    /// Loads are given alone, or as a list of one kind.
    fn entry(&self, field: Field, _: usize) -> String {
        self.name(field)
    }
}
