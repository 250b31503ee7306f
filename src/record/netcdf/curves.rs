//! Curves of `results.nc`: scalars of the states along the loads, and the separation curve.

use asperity_contact::load::Branch;
use asperity_contact::results::ContinuumResults;
use asperity_contact::results::PullOff;
use asperity_contact::state::State;
use asperity_surface::files::netcdf::{Attribute, Variable, VariableData, counter};

/// Name, unit, long name and value of each scalar.
type Column = (&'static str, &'static str, &'static str, fn(&State) -> Option<f64>);

const COLUMNS: [Column; 32] = [
    ("p_star", "1", "mean pressure over E* times rms gradient", |s| Some(s.p_star)),
    ("pressure", "Pa", "mean pressure", |s| Some(s.pressure)),
    ("contact_area", "1", "relative contact area", |s| Some(s.contact_area)),
    ("contact_area_error", "1", "error of the relative contact area", |s| s.contact_area_error),
    ("contact_nodes", "1", "contact nodes over all nodes", |s| s.contact_nodes),
    ("mean_gap", "m", "mean gap", |s| s.mean_gap),
    ("mean_gap_error", "m", "error of the mean gap", |s| s.mean_gap_error),
    ("stiffness", "Pa m-1", "contact stiffness dp/du", |s| s.stiffness),
    ("stiffness_error", "Pa m-1", "error of the contact stiffness", |s| s.stiffness_error),
    ("energy", "J m-2", "energy per area", |s| s.energy),
    ("interaction_energy", "J m-2", "energy per area of the interaction", |s| s.interaction_energy),
    ("patches", "1", "number of contact clusters", |s| s.patches.map(|n| n as f64)),
    ("unloading", "1", "1 on the unloading branch", |s| Some(f64::from(u8::from(s.branch == Branch::Unloading)))),
    ("residual", "1", "rms KKT residual over the pressure", |s| s.residual),
    ("load_error", "1", "relative error of the load", |s| Some(s.load_error)),
    ("contact_area_extrapolated", "1", "area at the true range of the adhesion", |s| {
        s.extrapolated.map(|e| e.area.value)
    }),
    ("mean_gap_extrapolated", "m", "mean gap at the true range of the adhesion", |s| {
        s.extrapolated.and_then(|e| e.mean_gap).map(|g| g.value)
    }),
    ("mean_contact_pressure", "Pa", "pressure over the contact area", |s| {
        s.observed.as_ref().and_then(|o| o.mean_contact_pressure)
    }),
    ("median_cluster_area", "m2", "median cluster area: half of the contact area is in clusters up to it", |s| {
        s.observed.as_ref().and_then(|o| o.median_cluster_area)
    }),
    ("contact_nodes_compressive", "1", "contact nodes under compression over all nodes", |s| {
        s.contact_nodes_compressive
    }),
    ("median_cluster_area_compressive", "m2", "median cluster area of the contact under compression", |s| {
        s.observed.as_ref().and_then(|o| o.compressive?.median_cluster_area)
    }),
    ("hysteresis_contact_area", "1", "relative change of the area from the same load on the loading branch", |s| {
        s.hysteresis.map(|h| h.area)
    }),
    ("hysteresis_mean_gap", "1", "relative change of the mean gap from the same load on the loading branch", |s| {
        s.hysteresis.map(|h| h.mean_gap)
    }),
    ("constriction_conductance", "m", "electrical conductance times resistivity, clusters as circular spots", |s| {
        s.observed.as_ref()?.constriction_conductance
    }),
    ("hydraulic_gap_effective_medium", "m", "uniform gap with the same leakage, by the effective medium", |s| {
        s.observed.as_ref()?.hydraulic_gap
    }),
    ("hydraulic_gap_x", "m", "uniform gap with the same leakage along x", |s| Some(s.leakage?.hydraulic_gaps()[0])),
    ("hydraulic_gap_y", "m", "uniform gap with the same leakage along y", |s| Some(s.leakage?.hydraulic_gaps()[1])),
    ("flowing_fraction", "1", "nodes whose plastic displacement grows", |s| Some(s.plasticity?.flowing)),
    ("displaced_fraction", "1", "nodes with a plastic displacement", |s| Some(s.plasticity?.displaced)),
    ("plastic_work", "J m-2", "plastic work per area since the first load", |s| Some(s.plasticity?.work)),
    ("von_mises", "Pa", "largest equivalent stress below the surface", |s| {
        Some(s.subsurface.as_ref()?.von_mises.value)
    }),
    ("shear", "Pa", "largest shear stress below the surface", |s| Some(s.subsurface.as_ref()?.shear.value)),
];

/// Curves over the loads. Values that a state does not have are NaN; a curve without any value is omitted.
pub(super) fn curves(c: &ContinuumResults) -> Vec<Variable> {
    let mut variables = vec![counter("load", 1, c.states.len(), "number of the load, in the order of application")];
    for (name, units, long_name, of) in COLUMNS {
        let values: Vec<Option<f64>> = c.states.iter().map(of).collect();
        if values.iter().any(Option::is_some) {
            let numbers = values.iter().map(|v| v.unwrap_or(f64::NAN)).collect();
            variables.push(Variable::new(name, &["load"], VariableData::Numbers(numbers), units, long_name));
        }
    }
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
