//! The loads of a solve as a table on the terminal: one row per load.

use crate::record::load_table::{Dimension, ResultUnits};
use crate::report::number::significant;
use asperity_contact::method::Stop;
use serde_json::Value;

/// A value with its unit, for people.
pub(super) fn in_unit(units: &ResultUnits, value: f64, dimension: Dimension) -> String {
    let number = significant(value, 6);
    match units.of(dimension) {
        Some(unit) => format!("{number} {}", unit.replace('_', " ")),
        None => number,
    }
}

/// A share of the cell with its error, in percent.
pub(super) fn share(line: &Value, key: &str) -> String {
    let percentage = |v: &Value, digits: usize| v.as_f64().map(|v| significant(100.0 * v, digits));
    let error = percentage(&line[format!("{key}_error")], 2).map_or(String::new(), |e| format!(" ± {e}"));
    format!("{}{error}\u{a0}%", percentage(&line[key], 3).unwrap_or_default())
}

/// Width of the columns on the terminal.
const WIDTH: usize = 22;

/// Head of the table on the terminal, of several loads.
pub(super) fn head(units: &ResultUnits) -> String {
    let named = |name: &str, dimension| {
        units.of(dimension).map_or(name.to_string(), |unit| format!("{name} / {}", unit.replace('_', " ")))
    };
    let cells = [
        "load".to_string(),
        named("pressure", Dimension::Stress),
        "contact area".into(),
        named("mean gap", Dimension::Length),
        named("stiffness", Dimension::Stiffness),
        "residual".into(),
        "iterations".into(),
    ];
    row(&cells)
}

/// A load as a row of that table.
pub(super) fn line(number: usize, state: &Value) -> String {
    let number_of = |key: &str| state[key].as_f64();
    let dash = || "–".to_string();
    // Separated surfaces have no equilibrium: the last iterate is no result.
    let separated = state["stop"] == Stop::Detached.to_string();
    let result = |key: &str| number_of(key).filter(|_| !separated);
    let text = |key: &str, show: &dyn Fn(f64) -> String| result(key).map_or_else(dash, show);
    let error = |key: &str| result(key).map_or(String::new(), |e| format!(" ± {}", significant(e, 2)));
    let power = |v: f64| format!("{v:.1e}");
    let stop = state["stop"].as_str().unwrap_or_default();
    // Of separated surfaces nothing is shown that could be taken for a result.
    let mark = if separated || stop == Stop::Converged.to_string() {
        String::new()
    } else {
        format!("  not converged: {stop}")
    };
    let cells = row(&[
        number.to_string(),
        number_of("pressure").map_or_else(dash, |v| significant(v, 6)),
        result("contact_area").map_or_else(dash, |_| share(state, "contact_area")),
        text("mean_gap", &|v| significant(v, 6)) + &error("mean_gap_error"),
        text("stiffness", &|v| significant(v, 4)) + &error("stiffness_error"),
        text("residual", &power),
        state["iterations"].as_u64().map_or_else(dash, |n| n.to_string()),
    ]);
    cells + &mark
}

fn row(cells: &[String; 7]) -> String {
    let [first, rest @ ..] = cells;
    rest.iter().fold(format!("{first:>5}"), |row, cell| format!("{row} {cell:>WIDTH$}"))
}
