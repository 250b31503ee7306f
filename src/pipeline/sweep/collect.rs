//! Numbers of a finished point.

use crate::record::comparison::ComparisonResults;
use crate::record::ensemble::{EnsembleLoad, Observable, Observation};
use crate::record::given_loads::GivenLoads;
use crate::record::methods::MethodResults;
use crate::record::results::Results;
use asperity_contact::load::Branch;
use asperity_contact::results::ContinuumResults;
use asperity_contact::scalars::{SCALARS, Scalar};
use asperity_contact::state::State;
use asperity_grid::units::Dimension;

/// The numbers of all loads of a run, by source. Lengths and stresses of the laboratory in µm and MPa, of the atoms in Å.
pub(super) fn numbers(results: &Results) -> Vec<Observation> {
    let mut list = Vec::new();
    let solved = [
        ("continuum", &results.continuum),
        ("without adhesion", &results.non_adhesive),
        ("cross check", &results.cross_check),
    ];
    for (source, c) in solved.into_iter().filter_map(|(source, c)| Some((source, c.as_ref()?))) {
        continuum(&mut list, source, c, results.loads);
    }
    results.methods.iter().for_each(|m| method(&mut list, m, results.loads));
    results.comparison.iter().for_each(|c| comparison(&mut list, c, results.loads));
    list.retain(|o| o.value.is_finite());
    list
}

/// Adds values with quantity and unit at a load.
fn add(
    list: &mut Vec<Observation>,
    (source, index, branch, load): (&str, usize, Branch, EnsembleLoad),
    values: &[(&str, &str, Option<f64>)],
) {
    for (quantity, unit, value) in values {
        let observable = Observable {
            source: source.into(),
            load: index,
            branch,
            quantity: quantity.to_string(),
            unit: unit.to_string(),
        };
        list.extend(value.map(|value| Observation { of: observable, load, value }));
    }
}

/// Micrometres of a metre, and megapascals of a pascal.
const UNITS: [f64; 2] = [1e6, 1e-6];

/// The numbers of the contact at a state, with their units.
fn physical(s: &State) -> Vec<(&'static str, &'static str, Option<f64>)> {
    let [um, mpa] = UNITS;
    let scalars = SCALARS.iter().filter(|scalar| scalar.is_physical);
    let value = |scalar: &Scalar| {
        let (unit, factor) = match scalar.dimension {
            Dimension::Length => ("um", um),
            Dimension::Area => ("um2", um * um),
            Dimension::Stress => ("MPa", mpa),
            Dimension::Work => ("J/m2", 1.0),
            Dimension::Stiffness => ("MPa/um", mpa / um),
            _ => ("1", 1.0),
        };
        (scalar.key, unit, (scalar.of)(s).map(|v| v * factor))
    };
    scalars.map(value).collect()
}

fn continuum(list: &mut Vec<Observation>, source: &str, c: &ContinuumResults, loads: GivenLoads) {
    let load_of = |s: &State| (s.index, s.branch, EnsembleLoad::of(loads, s.p_star));
    for s in &c.states {
        let (index, branch, load) = load_of(s);
        add(list, (source, index, branch, load), &physical(s));
    }
    if let (Some(p), Some(last)) = (&c.pull_off, c.states.last()) {
        let (index, _, load) = load_of(last);
        add(
            list,
            (source, index, Branch::Unloading, load),
            &[("pull_off_pressure", "MPa", Some(p.pressure * UNITS[1]))],
        );
    }
}

fn method(list: &mut Vec<Observation>, m: &MethodResults, loads: GivenLoads) {
    for s in &m.states {
        add(list, (&m.method, s.index, Branch::Loading, EnsembleLoad::of(loads, s.p_star)), &physical(s));
    }
}

/// Atoms and continuum at the same loads, with the agreement of their contact maps.
fn comparison(list: &mut Vec<Observation>, c: &ComparisonResults, loads: GivenLoads) {
    for (index, l) in c.loads.iter().enumerate() {
        let load = EnsembleLoad::of(loads, l.p_star);
        let values = [
            ("contact_area", "1", Some(l.atoms.contact_area)),
            ("mean_gap", "angstrom", Some(l.atoms_mean_gap_angstrom)),
            ("clusters", "1", Some(l.atoms_clusters as f64)),
        ];
        add(list, ("atoms", index, Branch::Loading, load), &values);
        for m in &l.continuum {
            let values = [
                ("contact_area", "1", Some(m.contact_area)),
                ("mean_gap", "angstrom", l.mean_gap_angstrom(&m.id)),
                ("kappa", "1", Some(m.overlap.kappa)),
                ("jaccard", "1", Some(m.overlap.jaccard)),
                ("kappa_misaligned", "1", Some(m.shifted.kappa)),
            ];
            add(list, (m.label(), index, Branch::Loading, load), &values);
        }
    }
}
