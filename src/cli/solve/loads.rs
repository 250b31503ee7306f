//! Loads of `solve`, in the units in which people give them.

use crate::cli::file::{COMMAND_LINE, Lengths};
use crate::scene::{CountedRange, LoadScene, Spacing};
use crate::units::{Measure, newtons_per, newtons_per_metre, pascals_per};
use crate::{Error, Result};
use std::str::FromStr;

/// One load, or a range of them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LoadItem {
    pub from: Measure,
    /// Last load, number of loads, spacing.
    range: Option<(Measure, usize, Spacing)>,
}

impl FromStr for LoadItem {
    type Err = Box<dyn std::error::Error + Send + Sync>;

    fn from_str(text: &str) -> std::result::Result<Self, Self::Err> {
        let (spacing, rest) = match text.split_once(':') {
            Some(("log", rest)) => (Spacing::Log, rest),
            Some(("lin", rest)) => (Spacing::Linear, rest),
            Some(_) => return Err("a range is lin:FROM:TO:COUNT or log:FROM:TO:COUNT".into()),
            None => return Ok(LoadItem { from: text.parse()?, range: None }),
        };
        let [from, to, count] = rest.split(':').collect::<Vec<_>>()[..] else {
            return Err("a range is lin:FROM:TO:COUNT or log:FROM:TO:COUNT".into());
        };
        Ok(LoadItem { from: from.parse()?, range: Some((to.parse()?, count.parse()?, spacing)) })
    }
}

/// Loads, one kind of them. Each flag takes numbers and ranges (lin:FROM:TO:COUNT, log:FROM:TO:COUNT), separated by commas.
#[derive(Debug, Clone, clap::Args)]
#[group(required = true, multiple = false)]
#[command(next_help_heading = "Loads")]
pub(super) struct LoadFlags {
    /// Mean pressures, comma-separated or as log:FROM:TO:COUNT, in the unit of the modulus or with their own (20kPa). Negative with
    /// adhesion only.
    #[arg(long, value_name = "P", value_delimiter = ',', num_args = 1, allow_hyphen_values = true)]
    pressure: Vec<LoadItem>,
    /// Normal forces on the cell instead: 5mN, or in the unit of modulus times length squared.
    #[arg(long, value_name = "F", value_delimiter = ',', num_args = 1, allow_hyphen_values = true)]
    force: Vec<LoadItem>,
    /// Mean pressures over E* times the rms gradient instead.
    #[arg(long, value_name = "P*", value_delimiter = ',', num_args = 1, allow_hyphen_values = true)]
    p_star: Vec<LoadItem>,
    /// Mean gaps instead. They reach states that are unstable under a prescribed pressure.
    #[arg(long, value_name = "G", value_delimiter = ',', num_args = 1, allow_hyphen_values = true)]
    mean_gap: Vec<LoadItem>,
    /// Displacements from first contact instead: mean gap at first contact minus mean gap.
    #[arg(long, value_name = "D", value_delimiter = ',', num_args = 1, allow_hyphen_values = true)]
    displacement: Vec<LoadItem>,
    /// Contact fractions instead, such as 0.05 or 5%. The pressures that give them are found first.
    #[arg(long, value_name = "A", value_delimiter = ',', num_args = 1, allow_hyphen_values = true)]
    contact: Vec<LoadItem>,
}

/// Units that convert loads and material constants.
pub(super) struct LoadUnits<'a> {
    pub lengths: &'a Lengths,
    /// Pascals of one unit of the modulus, if it has one.
    pub modulus_pa: Option<f64>,
}

impl LoadFlags {
    /// Whether a load has a unit that refers to that of the heights.
    pub(super) fn need_heights_unit(&self) -> bool {
        let lists = [&self.force, &self.mean_gap, &self.displacement];
        lists.into_iter().flatten().any(|item| item.from.unit.is_some())
    }

    /// The loads in consistent units.
    ///
    /// # Errors
    /// Units that cannot be converted, ranges that are none.
    pub(super) fn scene(&self, units: &LoadUnits) -> Result<LoadScene> {
        let plain = |flag: &'static str| {
            move |m: &Measure| match &m.unit {
                None => Ok(m.value),
                Some(_) => Err(refused(flag, m, "a number without a unit")),
            }
        };
        Ok(LoadScene {
            pressure_mpa: expanded("--pressure", &self.pressure, &|m| units.stress("--pressure", m))?,
            force_mn: expanded("--force", &self.force, &|m| units.force(m))?,
            p_star: expanded("--p-star", &self.p_star, &plain("--p-star"))?,
            mean_gap_um: expanded("--mean-gap", &self.mean_gap, &|m| units.lengths.of("--mean-gap", m))?,
            displacement_um: expanded("--displacement", &self.displacement, &|m| {
                units.lengths.of("--displacement", m)
            })?,
            contact: expanded("--contact", &self.contact, &|m| match m.unit.as_deref() {
                Some("%") => Ok(m.value / 100.0),
                _ => plain("--contact")(m),
            })?,
            ..LoadScene::default()
        })
    }
}

fn refused(flag: &str, m: &Measure, accepted: &str) -> Error {
    let unit = m.unit.as_deref().unwrap_or_default();
    Error::input(COMMAND_LINE, flag, format!("{} {unit}", m.value), accepted)
}

/// The values of a list of numbers and ranges.
pub(super) fn expanded(flag: &str, items: &[LoadItem], convert: &dyn Fn(&Measure) -> Result<f64>) -> Result<Vec<f64>> {
    let measures = || items.iter().flat_map(|item| [Some(&item.from), item.range.as_ref().map(|r| &r.0)]).flatten();
    if let Some(bare) = measures().find(|m| m.unit.is_none()).filter(|_| measures().any(|m| m.unit.is_some())) {
        let accepted = "units at all loads or at none, and decimal points: commas separate loads";
        return Err(Error::input(COMMAND_LINE, flag, format!("{} without a unit", bare.value), accepted));
    }
    let mut list = Vec::new();
    for item in items {
        let from = convert(&item.from)?;
        match &item.range {
            None => list.push(from),
            Some((to, count, spacing)) => {
                let range = CountedRange { from, to: convert(to)?, count: *count, spacing: *spacing };
                list.extend(range.loads().map_err(|why| refused(flag, &item.from, &why))?);
            }
        }
    }
    Ok(list)
}

impl LoadUnits<'_> {
    /// A stress in the unit of the modulus.
    pub(super) fn stress(&self, flag: &str, m: &Measure) -> Result<f64> {
        let Some(unit) = &m.unit else { return Ok(m.value) };
        let pascals = pascals_per(unit).ok_or_else(|| refused(flag, m, "a unit of stress: Pa, kPa, MPa, GPa"))?;
        let accepted = "a number in the unit of --modulus, or --modulus with a unit, too (--modulus 2MPa)";
        let modulus = self.modulus_pa.ok_or_else(|| refused(flag, m, accepted))?;
        Ok(m.value * (pascals / modulus))
    }

    fn force(&self, m: &Measure) -> Result<f64> {
        let Some(unit) = &m.unit else { return Ok(m.value) };
        let newtons = newtons_per(unit).ok_or_else(|| refused("--force", m, "a unit of force: nN, uN, mN, N"))?;
        let (modulus, length) = self.of_modulus_and_length("--force", m, "length squared")?;
        Ok(m.value * newtons / modulus / length / length)
    }

    /// An energy per area in the unit of modulus times length.
    pub(super) fn energy_per_area(&self, flag: &str, m: &Measure) -> Result<f64> {
        let Some(unit) = &m.unit else { return Ok(m.value) };
        let accepted = "a unit of energy per area: J/m2, mJ/m2, N/m, mN/m";
        let newtons = newtons_per_metre(unit).ok_or_else(|| refused(flag, m, accepted))?;
        let (modulus, length) = self.of_modulus_and_length(flag, m, "length")?;
        Ok(m.value * newtons / modulus / length)
    }

    /// Pascals of one unit of the modulus, metres of one unit of length.
    fn of_modulus_and_length(&self, flag: &str, m: &Measure, times: &str) -> Result<(f64, f64)> {
        let accepted = format!("a number in the unit of --modulus times {times}, or --modulus and --unit with units");
        self.modulus_pa.zip(self.lengths.heights_m).ok_or_else(|| refused(flag, m, &accepted))
    }
}
