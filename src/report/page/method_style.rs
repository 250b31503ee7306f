//! Marker and colour of a method, the same on every page.

use crate::method::REGISTRY;
use crate::report::picture::{self, Rgb};
use crate::report::plot::{Dash, Marker, Style};

const COLOURS: [Rgb; 6] =
    [picture::BLUE, picture::VERMILION, picture::GREEN, picture::PURPLE, picture::ORANGE, picture::BLACK];

/// Marker and colour of a method, by its index in the registry; the same on every page.
pub(super) fn method_style(method: &str) -> Style {
    let place = REGISTRY.iter().position(|m| m.card().id == method).unwrap_or(REGISTRY.len());
    let marker = Marker::DISTINCT[place % Marker::DISTINCT.len()];
    Style { colour: COLOURS[place % COLOURS.len()], dash: Dash::None, marker }
}
