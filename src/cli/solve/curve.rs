//! The loads of a solve as a table on the terminal: one row per load.

use crate::record::load_table::{ForceUnit, ResultUnits};
use crate::report::number::{percent, si, si_given, significant, to_error, trimmed, with_error};
use asperity_contact::interface::Notation;
use asperity_contact::load::{Branch, Stop};
use asperity_contact::state::State;
use asperity_grid::units::{Dimension, Scales};

/// A value with its unit, for people. Stresses, forces and works have the prefix that suits them, where their units are known.
pub(super) fn in_unit(units: &ResultUnits, value: f64, dimension: Dimension) -> String {
    if let Some((of_unit, unit)) = si_unit(units, dimension) {
        return si(value * of_unit, unit, 6);
    }
    let number = significant(value, 6);
    match units.of(dimension) {
        Some(unit) => format!("{number} {}", unit.replace('_', " ")),
        None => number,
    }
}

/// SI units of one unit of stresses, forces and works, where they are known, and their name.
pub(super) fn si_unit(units: &ResultUnits, dimension: Dimension) -> Option<(f64, &'static str)> {
    let name = match dimension {
        Dimension::Stress => "Pa",
        Dimension::Force => "N",
        Dimension::Work => "J/m²",
        _ => return None,
    };
    Some((units.si(dimension)?, name))
}

/// Constants in the units of a solve.
pub(super) struct SolveNotation<'a> {
    pub units: &'a ResultUnits,
    pub scales: Scales,
}

impl Notation for SolveNotation<'_> {
    fn length(&self, over_length: f64) -> String {
        let unit = self.units.of(Dimension::Length).map_or(String::new(), |unit| format!(" {unit}"));
        trimmed(over_length * self.scales.length_m, 4) + &unit
    }

    fn stress(&self, over_modulus: f64) -> String {
        let stress = over_modulus * self.scales.modulus_pa;
        si_unit(self.units, Dimension::Stress)
            .map_or_else(|| trimmed(stress, 4), |(of_unit, unit)| si_given(stress * of_unit, unit))
    }

    fn work(&self, reduced: f64) -> String {
        let work = reduced * self.scales.modulus_pa * self.scales.length_m;
        si_unit(self.units, Dimension::Work)
            .map_or_else(|| trimmed(work, 4), |(of_unit, unit)| si_given(work * of_unit, unit))
    }
}

/// The contact area with its error, in percent of the cell.
pub(super) fn share(s: &State) -> String {
    match s.contact_area_error {
        Some(error) => {
            let (area, error) = with_error(100.0 * s.contact_area, 100.0 * error, "%");
            area + &error
        }
        None => percent(s.contact_area),
    }
}

/// Width of the columns on the terminal.
const WIDTH: usize = 22;

/// What the table has besides the numbers of every load.
pub(super) struct Further {
    pub leakage: bool,
    pub plasticity: bool,
    pub subsurface: bool,
}

/// Head of the table on the terminal, of several loads.
pub(super) fn head(units: &ResultUnits, further: &Further) -> String {
    let named = |name: &str, dimension| {
        units.of(dimension).map_or(name.to_string(), |unit| format!("{name} / {}", unit.replace('_', " ")))
    };
    let of_force = |force: &ForceUnit| force.unit.as_ref().map_or("force".into(), |unit| format!("force / {unit}"));
    let mut cells = vec![
        "load".to_string(),
        units.force.as_ref().map_or_else(|| named("pressure", Dimension::Stress), of_force),
        "contact area".into(),
        named("mean gap", Dimension::Length),
        named("stiffness", Dimension::Stiffness),
    ];
    if further.leakage {
        cells.extend(["x", "y"].map(|along| named(&format!("flow gap {along}"), Dimension::Length)));
    }
    cells.extend(further.plasticity.then(|| "flowing".into()));
    cells.extend(further.subsurface.then(|| named("von Mises", Dimension::Stress)));
    cells.extend(["residual".into(), "iterations".into()]);
    row(&cells)
}

/// A load as a row of that table.
pub(super) fn line(number: usize, s: &State, units: &ResultUnits, further: &Further) -> String {
    let dash = || "–".to_string();
    // Separated surfaces have no equilibrium: the last iterate is no result.
    let separated = s.stop == Stop::Detached;
    let text = |value: Option<f64>, show: &dyn Fn(f64) -> String| {
        value.filter(|v| v.is_finite() && !separated).map_or_else(dash, show)
    };
    let with_error = |value, error: Option<f64>, digits| {
        text(value, &|v| error.map_or_else(|| significant(v, digits), |error| to_error(v, error)))
    };
    let mut cells = vec![
        number.to_string(),
        significant(units.force.as_ref().map_or(s.pressure, |force| force.of(s)), 6),
        text(Some(s.contact_area), &|_| share(s)),
        with_error(s.mean_gap, s.mean_gap_error, 6),
        with_error(s.stiffness, s.stiffness_error, 4),
    ];
    if further.leakage {
        let gaps = s.leakage.map(|flow| (flow.hydraulic_gaps(), flow.gap_errors));
        cells.extend([0, 1].map(|along| {
            let of_error = gaps.and_then(|(_, errors)| errors.map(|e| e[along]));
            with_error(gaps.map(|(gap, _)| gap[along]), of_error, 4)
        }));
    }
    cells.extend(further.plasticity.then(|| text(s.plasticity.map(|p| p.flowing), &percent)));
    let below = s.subsurface.as_ref().map(|below| below.von_mises.value);
    cells.extend(further.subsurface.then(|| text(below, &|v| significant(v, 4))));
    cells.extend([text(s.residual, &|v| format!("{v:.1e}")), s.iterations.to_string()]);
    let cells = row(&cells);
    // Of separated surfaces nothing is shown that could be taken for a result.
    let converged = separated || s.stop == Stop::Converged;
    let cells = if s.branch == Branch::Unloading { format!("{cells}  unloading") } else { cells };
    if converged { cells } else { format!("{cells}  not converged: {}", s.stop) }
}

fn row(cells: &[String]) -> String {
    let Some((first, rest)) = cells.split_first() else { return String::new() };
    rest.iter().fold(format!("{first:>5}"), |row, cell| format!("{row} {cell:>WIDTH$}"))
}
