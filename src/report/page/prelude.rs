//! What every section of the page uses.

pub(super) use super::figures::{
    Figure, FigureWriter, Values, back, bad, capitalised, columns, distinct, each, figure, load, of_unit, or_dash,
    panel, panels, quiet, row, spread, table,
};
pub(super) use crate::record::given_loads::{GivenLoads, LoadQuantity};
pub(super) use crate::record::results::*;
pub(super) use crate::report::number::{
    UM, count, duration, length, memory, percent, si, si_given, si_scale, significant, stress, trimmed, with_error,
    with_unit, work,
};
pub(super) use crate::report::picture::{self, BLACK, BLUE, ColourRange, GREEN, ORANGE, PURPLE, Rgb, VERMILION};
pub(super) use crate::report::plot::*;
pub(super) use crate::report::scale::ends;
pub(super) use asperity_atoms::results::*;
pub(super) use asperity_contact::load::{Branch, Stop};
pub(super) use asperity_contact::quantity::Quantity;
pub(super) use asperity_contact::results::*;
pub(super) use asperity_contact::state::{Observed, State};
pub(super) use asperity_contact::uncertainty::ValueWithError;
pub(super) use asperity_grid::error::Result;
pub(super) use maud::{Markup, PreEscaped, Render, html};
