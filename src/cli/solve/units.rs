//! Units of a solve: its numbers are in consistent ones, lengths in the unit of the heights and stresses in that of the modulus.

use crate::cli::file::{COMMAND_LINE, refused};
use crate::scene::{Dimensional, Quantity};
use crate::units::{Dimension, Measure};
use crate::{Error, Result};

/// Units of length and stress, where they are known.
pub(super) struct SolveUnits {
    /// Metres of one unit of the heights.
    pub length_m: Option<f64>,
    /// Pascals of one unit of the modulus.
    pub stress_pa: Option<f64>,
}

impl SolveUnits {
    /// A measure in consistent units.
    ///
    /// # Errors
    /// Of another dimension; with a unit that cannot be converted.
    pub(super) fn plain<D: Dimensional>(&self, flag: &str, m: Measure) -> Result<Quantity<D>> {
        let m = m.of(D::DIMENSION).map_err(|accepted| refused(flag, m, accepted))?;
        let Some(unit) = m.unit else { return Ok(Quantity::plain(m.value)) };
        let (length, stress) = (self.length_m, self.stress_pa);
        let both = length.zip(stress);
        let (converted, accepted) = match D::DIMENSION {
            Dimension::Length => (
                length.map(|length| m.value * (unit.si / length)),
                "a number in the unit of the heights, or --unit, which the file does not declare",
            ),
            Dimension::Stress => (
                stress.map(|stress| m.value * (unit.si / stress)),
                "a number in the unit of --modulus, or --modulus with a unit, too (--modulus 2MPa)",
            ),
            Dimension::Force => (
                both.map(|(length, stress)| m.value * unit.si / stress / length / length),
                "a number in the unit of --modulus times length squared, or --modulus and --unit with units",
            ),
            Dimension::Work => (
                both.map(|(length, stress)| m.value * unit.si / stress / length),
                "a number in the unit of --modulus times length, or --modulus and --unit with units",
            ),
            _ => (None, "a number"),
        };
        converted.map(Quantity::plain).ok_or_else(|| refused(flag, m, accepted))
    }

    /// # Errors
    /// Where some measures have units and others none.
    pub(super) fn refuse_mixed(given: &[(&str, Measure)]) -> Result<()> {
        let find = |has_unit: bool| given.iter().find(|(_, m)| m.unit.is_some() == has_unit);
        match (find(false), find(true)) {
            (Some((bare, value)), Some((other, with_unit))) => {
                let accepted =
                    format!("a value with its unit, as {other} {with_unit} has: all values have units, or none");
                Err(Error::input(COMMAND_LINE, *bare, value, accepted))
            }
            _ => Ok(()),
        }
    }
}
