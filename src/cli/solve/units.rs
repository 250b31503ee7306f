//! Units of a solve: its numbers are in consistent ones, lengths in the unit of the heights and stresses in that of the modulus.

use crate::cli::file::{COMMAND_LINE, refused};
use crate::scene::{Dimensional, Quantity};
use crate::{Error, Result};
use asperity_grid::units::{Dimension, Measure};

/// Units of length and stress, where they are known.
pub(super) struct SolveUnits {
    /// Metres of one unit of the heights.
    pub length_m: Option<f64>,
    /// Pascals of one unit of the modulus.
    pub stress_pa: Option<f64>,
}

/// What is accepted as the modulus.
pub(super) const MODULUS: &str = "the contact modulus E* = E/(1-ν²), such as 25MPa, or --body";

impl SolveUnits {
    /// A measure in consistent units.
    ///
    /// # Errors
    /// Of another dimension; with a unit that cannot be converted.
    pub(super) fn plain<D: Dimensional>(&self, flag: &str, m: Measure) -> Result<Quantity<D>> {
        let m = m.of(D::DIMENSION).map_err(|accepted| refused(flag, m, accepted))?;
        let Some(unit) = m.unit else { return Ok(Quantity::plain(m.value)) };
        let (dimension, length) = (D::DIMENSION, self.length_m);
        let needs_stress = matches!(dimension, Dimension::Stress | Dimension::Force | Dimension::Work);
        let Some(stress) = self.stress_pa.or((!needs_stress).then_some(1.0)) else {
            return Err(Error::input(COMMAND_LINE, "--modulus", "not given with a unit", MODULUS));
        };
        let converted = match dimension {
            Dimension::Length => length.map(|length| m.value * (unit.si / length)),
            Dimension::Stress => Some(m.value * (unit.si / stress)),
            Dimension::Force => length.map(|length| m.value * unit.si / stress / length / length),
            Dimension::Work => length.map(|length| m.value * unit.si / stress / length),
            _ => None,
        };
        let accepted = match dimension {
            Dimension::Length => "a number in the unit of the heights, or --unit, which the file does not declare",
            Dimension::Force | Dimension::Work => "--unit with it, as the file does not declare that of the heights",
            _ => "a number",
        };
        converted.map(Quantity::plain).ok_or_else(|| refused(flag, m, accepted))
    }

    /// # Errors
    /// Where some measures have units and others none. Zero is the same in every unit.
    pub(super) fn refuse_mixed(given: &[(&str, Measure)]) -> Result<()> {
        let find =
            |has_unit: bool| given.iter().find(|(_, m)| m.unit.is_some() == has_unit && (has_unit || m.value != 0.0));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::dimension::{Force, Length, Stress, Work};

    fn measure(text: &str) -> Measure {
        text.parse().expect(text)
    }

    #[test]
    fn measures_become_multiples_of_the_units_of_heights_and_modulus() {
        let units = SolveUnits { length_m: Some(1e-6), stress_pa: Some(1e6) };
        assert_eq!(
            units.plain::<Length>("--length", measure("20 nm")).map(|q| q.to("um")).ok(),
            Some(20.0 * (1e-9 / 1e-6))
        );
        assert_eq!(
            units.plain::<Stress>("--pressure", measure("20 kPa")).map(|q| q.value()).ok(),
            Some(20.0 * (1e3 / 1e6))
        );
        // 1 mN over (1 MPa × 1 µm²), 50 mJ/m² over (1 MPa × 1 µm).
        let force = units.plain::<Force>("--force", measure("1 mN")).expect("a force").value();
        let work = units.plain::<Work>("--work-of-adhesion", measure("50 mJ/m2")).expect("a work").value();
        assert!((force / 1e3 - 1.0).abs() < 1e-14 && (work / 0.05 - 1.0).abs() < 1e-14, "{force} {work}");
        assert_eq!(units.plain::<Force>("--force", measure("3")).map(|q| q.value()).ok(), Some(3.0));
        assert!(units.plain::<Force>("--force", measure("3 MPa")).is_err());
        let unknown = SolveUnits { length_m: None, ..units };
        assert!(unknown.plain::<Length>("--length", measure("20 nm")).is_err_and(|e| e.to_string().contains("--unit")));
        let missing = SolveUnits { stress_pa: None, ..unknown };
        let said =
            missing.plain::<Stress>("--pressure", measure("5 MPa")).map(|_| ()).expect_err("refused").to_string();
        assert!(said.contains("--modulus = not given with a unit; accepted: the contact modulus"), "{said}");
    }

    #[test]
    fn values_have_units_or_none_has() {
        let given = [("--modulus", measure("25")), ("--pressure", measure("1 MPa"))];
        let said = SolveUnits::refuse_mixed(&given).expect_err("mixed").to_string();
        assert_eq!(
            said,
            "command line: --modulus = 25; accepted: a value with its unit, as --pressure 1 MPa has: all values have units, or none"
        );
        let zero = [("--displacement", measure("0")), given[1]];
        assert!(SolveUnits::refuse_mixed(&zero).is_ok());
        assert!(SolveUnits::refuse_mixed(&given[..1]).is_ok() && SolveUnits::refuse_mixed(&given[1..]).is_ok());
    }
}
