//! Styles of methods and of models, the same on every page.

use crate::report::picture::{self, Rgb};
use crate::report::plot::{ATOMS, Dash, HARD, LABORATORY, Marker, SOFT, Style, THRESHOLD, YIELDING};
use asperity_methods::REGISTRY;

const COLOURS: [Rgb; 6] =
    [picture::BLUE, picture::VERMILION, picture::GREEN, picture::PURPLE, picture::ORANGE, picture::BLACK];

/// Marker and colour of a method, by its index in the registry; the same on every page.
pub(super) fn method_style(method: &str) -> Style {
    let place = REGISTRY.iter().position(|m| m.card().id == method).unwrap_or(REGISTRY.len());
    let marker = Marker::DISTINCT[place % Marker::DISTINCT.len()];
    Style { colour: COLOURS[place % COLOURS.len()], dash: Dash::None, marker }
}

/// Style of a model of the chain from the full heights to the atoms.
pub(super) fn model_style(id: &str) -> Style {
    match id {
        "full_heights" => LABORATORY,
        "hard_wall" => HARD,
        "offset_wall" => THRESHOLD,
        "compliant_wall" => SOFT,
        "yielding_wall" => YIELDING,
        _ => ATOMS,
    }
}
