use super::*;
use crate::uncertainty::UncertaintySource;
use serde_json::Value;

/// Powers of length and stress of every number of a state by its key, or by its key and the place in an array. All others have
/// no dimension.
const DIMENSIONS: [(&str, [i32; 2]); 32] = [
    ("pressure", [0, 1]),
    ("perimeter", [-1, 0]),
    ("mean_gap", [1, 0]),
    ("mean_gap_error", [1, 0]),
    ("displacement", [1, 0]),
    ("stiffness", [-1, 1]),
    ("stiffness_error", [-1, 1]),
    ("energy", [1, 1]),
    ("elastic_energy", [1, 1]),
    ("interaction_energy", [1, 1]),
    ("mean_plastic_displacement", [1, 0]),
    ("plastic_work", [1, 1]),
    ("extrapolated.mean_gap.value", [1, 0]),
    ("extrapolated.mean_gap.error", [1, 0]),
    ("observed.mean_contact_pressure", [0, 1]),
    ("observed.gap.edges", [1, 0]),
    ("observed.gap_logarithmic.edges", [1, 0]),
    ("observed.stress.edges", [0, 1]),
    ("observed.contact_stress.edges", [0, 1]),
    ("observed.cluster_density.0", [2, 0]),
    ("observed.cluster_density.1", [-2, 0]),
    ("observed.cluster_area.0", [2, 0]),
    ("observed.median_cluster_area", [2, 0]),
    ("observed.compressive.median_cluster_area", [2, 0]),
    ("observed.compressive.median_cluster_area_error", [2, 0]),
    ("observed.constriction_conductance", [1, 0]),
    ("observed.hydraulic_gap", [1, 0]),
    ("leakage.conductivity", [3, 0]),
    ("leakage.effective_medium", [3, 0]),
    ("leakage.gap_errors", [1, 0]),
    ("subsurface.value", [0, 1]),
    ("subsurface.place", [1, 0]),
];

/// Of everything that has no dimension.
const PLAIN: [&str; 38] = [
    "index",
    "p_star",
    "contact_area",
    "contact_area_error",
    "contact_nodes",
    "contact_nodes_compressive",
    "clusters",
    "flowing_fraction",
    "displaced_fraction",
    "load_error",
    "residual",
    "complementarity",
    "energy_bound",
    "map_errors.gap",
    "map_errors.contact",
    "error_estimates.area",
    "error_estimates.mean_gap",
    "discretisation.area",
    "discretisation.mean_gap",
    "discretisation.stiffness",
    "discretisation.coarser",
    "extrapolated.range",
    "extrapolated.contact_area.value",
    "extrapolated.contact_area.error",
    "uncertainty.relative",
    "hysteresis.area",
    "hysteresis.mean_gap",
    "observed.cluster_density.2",
    "observed.cluster_area.1",
    "observed.compressive.clusters",
    "leakage.ratio",
    "leakage.iterations",
    "subsurface.poisson",
    "subsurface.shear_over_strength",
    "iterations",
    "fft_pairs",
    "seconds",
    "fractions",
];

/// All observables, all numbers one.
fn observed() -> Observed {
    let distribution = || Distribution { edges: vec![1.0], fractions: vec![1.0], delta: 1.0, below: 1.0, above: 1.0 };
    let one = Some(1.0);
    Observed {
        mean_contact_pressure: one,
        gap: Some(distribution()),
        gap_logarithmic: Some(distribution()),
        stress: Some(distribution()),
        contact_stress: Some(distribution()),
        cluster_density: vec![[1.0; 3]],
        cluster_area: vec![[1.0; 2]],
        median_cluster_area: one,
        compressive: Some(Compressive { clusters: 1, median_cluster_area: one, median_cluster_area_error: one }),
        constriction_conductance: one,
        hydraulic_gap: one,
        contact_percolates: Some([true; 2]),
        gap_percolates: Some([true; 2]),
    }
}

/// Every part of a state, all numbers one.
fn whole() -> State {
    let error = ValueWithError { value: 1.0, error: 1.0 };
    let peak = || Peak { value: 1.0, x: 1.0, y: 1.0, depth: 1.0, map: None };
    let values = || Some(Map::Values { nx: 1, ny: 1, values: vec![1.0] });
    let one = Some(1.0);
    State {
        index: 1,
        branch: Branch::Unloading,
        p_star: 1.0,
        pressure: 1.0,
        non_periodic: true,
        criterion: "zero gap".into(),
        contact_area: 1.0,
        contact_area_error: one,
        contact_nodes: one,
        contact_nodes_compressive: one,
        perimeter: one,
        clusters: Some(1),
        mean_gap: one,
        mean_gap_error: one,
        displacement: one,
        stiffness: one,
        stiffness_error: one,
        energy: one,
        elastic_energy: one,
        interaction_energy: one,
        plasticity: Some(Plasticity { flowing: 1.0, displaced: 1.0, displacement: 1.0, work: 1.0 }),
        load_error: 1.0,
        residual: one,
        complementarity: one,
        energy_bound: one,
        error_estimates: Some(ErrorEstimates { area: one, mean_gap: one }),
        discretisation: Some(Discretisation {
            area: one,
            area_is_bound: true,
            mean_gap: one,
            mean_gap_is_bound: true,
            stiffness: one,
            coarser: [1, 1],
        }),
        map_errors: Some(MapErrors { gap: 1.0, contact: 1.0 }),
        extrapolated: Some(Extrapolated { range: 1.0, area: error, mean_gap: Some(error) }),
        uncertainty: vec![UncertaintyComponent {
            quantity: Quantity::MeanGap,
            source: UncertaintySource::Grid,
            relative: one,
            is_bound: false,
        }],
        hysteresis: Some(Hysteresis { area: 1.0, mean_gap: 1.0 }),
        observed: Some(observed()),
        leakage: Some(Leakage {
            conductivity: [1.0; 2],
            effective_medium: 1.0,
            ratio: one,
            iterations: [1; 2],
            gap_errors: Some([1.0; 2]),
        }),
        subsurface: Some(SubsurfaceResults {
            poisson: 1.0,
            slices: vec![SubsurfaceSlice { depth: 1.0, von_mises: peak(), shear: peak() }],
            von_mises: peak(),
            shear: peak(),
            shear_over_strength: one,
        }),
        gap_map: values(),
        stress_map: values(),
        contact_map: Some(Map::File("contact.npy".into())),
        plastic_map: values(),
        missing: Missing::from([(Quantity::StressPdf, "why".into())]),
        stop: Stop::Interrupted,
        iterations: 1,
        fft_pairs: 1.0,
        seconds: 1.0,
    }
}

/// The numbers of a JSON value by their path, without places in lists but the last one in an array of arrays.
fn numbers(value: &Value, path: &str, found: &mut Vec<(String, f64)>) {
    let joined = |key: &str| if path.is_empty() { key.to_string() } else { format!("{path}.{key}") };
    match value {
        Value::Object(map) => map.iter().for_each(|(key, value)| numbers(value, &joined(key), found)),
        Value::Array(list) => list.iter().enumerate().for_each(|(i, value)| {
            let is_row = ["observed.cluster_density", "observed.cluster_area"].contains(&path) && value.is_number();
            numbers(value, &if is_row { joined(&i.to_string()) } else { path.to_string() }, found)
        }),
        value => found.extend(value.as_f64().map(|v| (path.to_string(), v))),
    }
}

/// The key of the tables above that a path stands under.
fn key(path: &str) -> String {
    let last = path.rsplit('.').next().unwrap_or(path);
    match last {
        "fractions" | "delta" | "below" | "above" => "fractions".into(),
        "value" if path.starts_with("subsurface") => "subsurface.value".into(),
        "x" | "y" | "depth" => "subsurface.place".into(),
        _ => path.into(),
    }
}

#[test]
fn every_number_has_the_unit_of_its_dimension() {
    const UNITS: [f64; 2] = [2.0, 3.0];
    let mut found = Vec::new();
    let state = whole().in_units(UNITS[0], UNITS[1]);
    numbers(&serde_json::to_value(&state).expect("JSON"), "", &mut found);
    for (path, value) in &found {
        let key = key(path);
        let dimension = DIMENSIONS.iter().find(|(known, _)| *known == key);
        assert!(dimension.is_some() || PLAIN.contains(&key.as_str()), "{path}: its dimension is not in the tables");
        let [length, stress] = dimension.map_or([0, 0], |(_, powers)| *powers);
        assert_eq!(*value, UNITS[0].powi(length) * UNITS[1].powi(stress), "{path}");
    }
    for (known, _) in &DIMENSIONS {
        assert!(found.iter().any(|(path, _)| key(path) == *known), "{known} is no number of a state");
    }
    let value = |map: &Option<Map<f64>>| match map {
        Some(Map::Values { values, .. }) => values[0],
        _ => panic!("a map in memory"),
    };
    assert_eq!([&state.gap_map, &state.stress_map, &state.plastic_map].map(value), [2.0, 3.0, 2.0]);
}

/// Maps in memory are not written; everything else is read as it was.
#[test]
fn a_state_is_read_as_it_was_written() {
    let state = whole();
    let text = serde_json::to_string(&state).expect("JSON");
    let read: State = serde_json::from_str(&text).expect("a state");
    assert_eq!(read, State { gap_map: None, stress_map: None, plastic_map: None, ..state });
    let least = serde_json::to_string(&State::default()).expect("JSON");
    assert_eq!(serde_json::from_str::<State>(&least).expect("a state"), State::default());
}
