//! Curves of `results.nc`: scalars of the states along the loads, and the separation curve.

use asperity_contact::results::{ContinuumResults, PullOff};
use asperity_contact::scalars;
use asperity_grid::units::Dimension;
use asperity_surface::files::netcdf::{Attribute, Variable, VariableData, counter};

/// The SI unit of a dimension, as the CF conventions write it.
fn si_unit(dimension: Dimension) -> &'static str {
    match dimension {
        Dimension::Length => "m",
        Dimension::Area => "m2",
        Dimension::Stress => "Pa",
        Dimension::Force => "N",
        Dimension::Work => "J m-2",
        Dimension::Energy => "J",
        Dimension::Stiffness => "Pa m-1",
        Dimension::Temperature => "K",
        Dimension::Time => "s",
        Dimension::Fraction | Dimension::Number => "1",
    }
}

/// Curves over the loads. Values that a state does not have are NaN; a curve without any value is omitted.
pub(super) fn curves(c: &ContinuumResults) -> Vec<Variable> {
    let mut variables = vec![counter("load", 1, c.states.len(), "number of the load, in the order of application")];
    variables.extend(scalars::columns(&c.states).map(|(scalar, values)| {
        let (values, unit) = (VariableData::Numbers(values), si_unit(scalar.dimension));
        Variable::new(scalar.key, &["load"], values, unit, scalar.words)
    }));
    let criterion = c.states.first().map_or(String::new(), |s| s.criterion.clone());
    for v in variables.iter_mut().filter(|v| v.name.starts_with("contact_area")) {
        v.attributes.push(("criterion".into(), Attribute::Text(criterion.clone())));
    }
    if let Some(p) = c.pull_off.as_ref().filter(|p| !p.curve.is_empty()) {
        variables.extend(separation(p));
    }
    variables
}

/// Mean gap and pressure during separation.
fn separation(p: &PullOff) -> [Variable; 3] {
    let column = |k: usize| VariableData::Numbers(p.curve.iter().map(|point| point[k]).collect());
    let dimensions = ["pull_off_point"];
    [
        counter(dimensions[0], 0, p.curve.len(), "points of the separation curve"),
        Variable::new("pull_off_mean_gap", &dimensions, column(0), "m", "mean gap during separation"),
        Variable::new("pull_off_pressure", &dimensions, column(1), "Pa", "mean pressure during separation")
            .with("lowest_pa", Attribute::Number(p.pressure)),
    ]
}
