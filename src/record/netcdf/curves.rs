//! Curves of `results.nc`: scalars of the states along the loads, and the separation curve.

use asperity_contact::load::Branch;
use asperity_contact::results::PullOff;
use asperity_contact::results::{ContinuumResults, StateResults};
use asperity_surface::files::netcdf::{Attribute, Variable, VariableData, counter};

/// Factor from reduced to SI units.
#[derive(Clone, Copy)]
enum UnitFactor {
    One,
    Length,
    Area,
    Stress,
    /// Stress over length.
    Stiffness,
    /// Energy per area.
    Energy,
}

impl UnitFactor {
    fn factor(self, length: f64, modulus: f64) -> f64 {
        match self {
            UnitFactor::One => 1.0,
            UnitFactor::Length => length,
            UnitFactor::Area => length * length,
            UnitFactor::Stress => modulus,
            UnitFactor::Stiffness => modulus / length,
            UnitFactor::Energy => modulus * length,
        }
    }
}

/// Name, factor, unit, long name and value of each scalar.
type Column = (&'static str, UnitFactor, &'static str, &'static str, fn(&StateResults) -> Option<f64>);

const COLUMNS: [Column; 25] = [
    ("p_star", UnitFactor::One, "1", "mean pressure over E* times rms gradient", |s| Some(s.numbers.p_star)),
    ("pressure", UnitFactor::Stress, "Pa", "mean pressure", |s| Some(s.numbers.pressure)),
    ("contact_area", UnitFactor::One, "1", "relative contact area", |s| Some(s.numbers.contact_area)),
    ("contact_area_error", UnitFactor::One, "1", "error of the relative contact area", |s| {
        s.numbers.contact_area_error
    }),
    ("contact_nodes", UnitFactor::One, "1", "contact nodes over all nodes", |s| Some(s.contact_nodes)),
    ("mean_gap", UnitFactor::Length, "m", "mean gap", |s| Some(s.mean_gap)),
    ("mean_gap_error", UnitFactor::Length, "m", "error of the mean gap", |s| s.mean_gap_error),
    ("stiffness", UnitFactor::Stiffness, "Pa m-1", "contact stiffness dp/du", |s| s.numbers.stiffness),
    ("stiffness_error", UnitFactor::Stiffness, "Pa m-1", "error of the contact stiffness", |s| {
        s.numbers.stiffness_error
    }),
    ("energy", UnitFactor::Energy, "J m-2", "energy per area", |s| Some(s.energy)),
    ("interaction_energy", UnitFactor::Energy, "J m-2", "energy per area of the interaction", |s| {
        Some(s.interaction_energy)
    }),
    ("patches", UnitFactor::One, "1", "number of contact clusters", |s| s.numbers.patches.map(|n| n as f64)),
    ("unloading", UnitFactor::One, "1", "1 on the unloading branch", |s| {
        Some(f64::from(u8::from(s.branch == Branch::Unloading)))
    }),
    ("residual", UnitFactor::One, "1", "rms KKT residual over the pressure", |s| Some(s.residual)),
    ("load_error", UnitFactor::One, "1", "relative error of the load", |s| Some(s.numbers.load_error)),
    ("contact_area_extrapolated", UnitFactor::One, "1", "area at the true range of the adhesion", |s| {
        s.extrapolated.map(|e| e.area.value)
    }),
    ("mean_gap_extrapolated", UnitFactor::Length, "m", "mean gap at the true range of the adhesion", |s| {
        s.extrapolated.and_then(|e| e.mean_gap).map(|g| g.value)
    }),
    ("mean_contact_pressure", UnitFactor::Stress, "Pa", "pressure over the contact area", |s| {
        s.observed.as_ref().and_then(|o| o.mean_contact_pressure)
    }),
    (
        "median_cluster_area",
        UnitFactor::Area,
        "m2",
        "median cluster area: half of the contact area is in clusters up to it",
        |s| s.observed.as_ref().and_then(|o| o.median_cluster_area),
    ),
    ("contact_nodes_compressive", UnitFactor::One, "1", "contact nodes under compression over all nodes", |s| {
        s.observed.as_ref().and_then(|o| Some(o.compressive?.contact_nodes))
    }),
    (
        "median_cluster_area_compressive",
        UnitFactor::Area,
        "m2",
        "median cluster area of the contact under compression",
        |s| s.observed.as_ref().and_then(|o| o.compressive?.median_cluster_area),
    ),
    (
        "hysteresis_contact_area",
        UnitFactor::One,
        "1",
        "relative change of the area from the same load on the loading branch",
        |s| s.hysteresis.map(|h| h.area),
    ),
    (
        "hysteresis_mean_gap",
        UnitFactor::One,
        "1",
        "relative change of the mean gap from the same load on the loading branch",
        |s| s.hysteresis.map(|h| h.mean_gap),
    ),
    (
        "constriction_conductance",
        UnitFactor::Length,
        "m",
        "electrical conductance times resistivity, clusters as circular spots",
        |s| s.observed.as_ref().map(|o| o.constriction_conductance),
    ),
    ("hydraulic_gap", UnitFactor::Length, "m", "uniform gap with the same leakage", |s| {
        s.observed.as_ref().map(|o| o.hydraulic_gap)
    }),
];

/// Curves over the loads. Values that a state does not have are NaN; a curve without any value is omitted.
pub(super) fn curves(c: &ContinuumResults, length: f64, modulus: f64) -> Vec<Variable> {
    let mut variables = vec![counter("load", 1, c.states.len(), "number of the load, in the order of application")];
    for (name, scale, units, long_name, of) in COLUMNS {
        let values: Vec<Option<f64>> = c.states.iter().map(of).collect();
        if values.iter().any(Option::is_some) {
            let factor = scale.factor(length, modulus);
            let numbers = values.iter().map(|v| v.map_or(f64::NAN, |v| v * factor)).collect();
            variables.push(Variable::new(name, &["load"], VariableData::Numbers(numbers), units, long_name));
        }
    }
    let criterion = c.states.first().map_or(String::new(), |s| s.criterion.clone());
    for v in variables.iter_mut().filter(|v| v.name.starts_with("contact_area")) {
        v.attributes.push(("criterion".into(), Attribute::Text(criterion.clone())));
    }
    if let Some(p) = c.pull_off.as_ref().filter(|p| !p.curve.is_empty()) {
        variables.extend(separation(p, length, modulus));
    }
    variables
}

/// Mean gap and pressure during separation.
fn separation(p: &PullOff, length: f64, modulus: f64) -> [Variable; 3] {
    let column = |k: usize, factor: f64| VariableData::Numbers(p.curve.iter().map(|point| point[k] * factor).collect());
    let dimensions = ["pull_off_point"];
    [
        counter(dimensions[0], 0, p.curve.len(), "points of the separation curve"),
        Variable::new("pull_off_mean_gap", &dimensions, column(0, length), "m", "mean gap during separation"),
        Variable::new("pull_off_pressure", &dimensions, column(1, modulus), "Pa", "mean pressure during separation")
            .with("lowest_pa", Attribute::Number(p.pressure * modulus)),
    ]
}
