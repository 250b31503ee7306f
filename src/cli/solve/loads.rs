//! Loads of `solve`, in the units in which people give them.

use super::units::SolveUnits;
use crate::Result;
use crate::cli::file::refused;
use crate::scene::{Dimensional, LoadScene, Quantity};
use asperity_grid::units::{Dimension, Measure, Measures};

/// Loads, one kind of them. Each flag takes numbers and ranges (lin:FROM:TO:COUNT, log:FROM:TO:COUNT), separated by commas.
#[derive(Debug, Clone, clap::Args)]
#[group(required = true, multiple = false)]
#[command(next_help_heading = "Loads")]
pub(super) struct LoadFlags {
    /// Mean pressures, comma-separated or as log:FROM:TO:COUNT, with a unit (20kPa) or in that of the modulus. Negative with
    /// adhesion only.
    #[arg(long, value_name = "P")]
    pub(super) pressure: Option<Measures>,
    /// Normal forces on the map instead: 5mN, or in the unit of modulus times length squared. A mirrored cell carries four times as much.
    #[arg(long, value_name = "F")]
    pub(super) force: Option<Measures>,
    /// Mean pressures over E* times the rms gradient instead.
    #[arg(long, value_name = "P*")]
    p_star: Option<Measures>,
    /// Mean gaps instead. They reach states that are unstable under a prescribed pressure.
    #[arg(long, value_name = "G")]
    pub(super) mean_gap: Option<Measures>,
    /// Displacements from first contact instead: mean gap at first contact minus mean gap.
    #[arg(long, value_name = "D")]
    pub(super) displacement: Option<Measures>,
    /// Contact fractions instead, such as 0.05 or 5%. The pressures that give them are found first.
    #[arg(long, value_name = "A")]
    contact: Option<Measures>,
}

impl LoadFlags {
    /// The loads in consistent units.
    ///
    /// # Errors
    /// Units that cannot be converted.
    pub(super) fn scene(&self, units: &SolveUnits) -> Result<LoadScene> {
        Ok(LoadScene {
            pressure: list("--pressure", &self.pressure, units)?,
            force: list("--force", &self.force, units)?,
            p_star: numbers("--p-star", &self.p_star, Dimension::Number)?,
            mean_gap: list("--mean-gap", &self.mean_gap, units)?,
            displacement: list("--displacement", &self.displacement, units)?,
            contact: numbers("--contact", &self.contact, Dimension::Fraction)?,
            ..LoadScene::default()
        })
    }
}

/// Quantities in consistent units.
pub(super) fn list<D: Dimensional>(
    flag: &str,
    given: &Option<Measures>,
    units: &SolveUnits,
) -> Result<Vec<Quantity<D>>> {
    given.iter().flat_map(|list| &list.0).map(|m| units.plain(flag, *m)).collect()
}

/// Numbers without a unit, or fractions.
fn numbers(flag: &str, given: &Option<Measures>, dimension: Dimension) -> Result<Vec<f64>> {
    let number = |m: &Measure| m.of(dimension).map(Measure::fraction).map_err(|accepted| refused(flag, *m, accepted));
    given.iter().flat_map(|list| &list.0).map(number).collect()
}
