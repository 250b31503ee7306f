//! Energy that load paths dissipate, of every body.

use asperity::contact::interface::RangeChoice;
use asperity::contact::observe::WorkPoint;
use asperity::contact::state::State;
use asperity::{Adhesion, Base, Body, LoadKind, LoadPath, Loads, Problem, Spectrum, Surface, SynthesisOptions};

const BODIES: [Body; 4] = [
    Body::HalfSpace,
    Body::Layer { thickness: 0.2, poisson: 0.4, base: Base::Bonded },
    Body::Cubic { c11: 168.0, c12: 121.0, c44: 75.0 },
    Body::NonPeriodic,
];

fn problem(body: Body, hardness: Option<f64>) -> Problem {
    let spectrum = Spectrum { lambda_s: 0.25, ..Spectrum::CHALLENGE };
    let surface =
        Surface::from_spectrum(spectrum, SynthesisOptions { nodes: 48, length: 1.0, seed: 5 }).expect("heights");
    // A range above the roughness, so that contacts do not jump.
    let (work_of_adhesion, range, resolution) = (0.02, 0.2, RangeChoice::True);
    let adhesion = Adhesion { work_of_adhesion, range, resolution, ..Adhesion::default() };
    let hardness = hardness.map(Into::into);
    Problem { body, adhesion: Some(adhesion), hardness, tolerance: Some(1e-9), ..Problem::new(surface, 1.0) }
}

/// Largest error of trapezoids on a path whose pressure rises with the displacement between two loads.
fn trapezoid_bound(path: &LoadPath) -> f64 {
    let points: Vec<WorkPoint> = path.states.iter().filter_map(State::work_point).collect();
    let between =
        |w: &[WorkPoint]| 0.5 * (w[1].pressure - w[0].pressure).abs() * (w[1].displacement - w[0].displacement).abs();
    points.windows(2).map(between).sum()
}

/// Part of [`trapezoid_bound`] that smooth paths of eight loads keep to; measured: up to 0.064.
const SMOOTH: f64 = 0.1;

/// The same of loading and smooth unloading, on which the errors cancel; measured: 3e-4.
const THERE_AND_BACK: f64 = 1e-3;

/// An elastic body on a smooth path stores all of the work, periodic or not.
#[test]
fn elastic_bodies_dissipate_nothing_without_jumps() {
    for body in BODIES {
        let loads = Loads::new(LoadKind::Pressure, [0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45]);
        let path = problem(body, None).load_path(&loads).expect("solved");
        let (dissipated, bound) = (path.dissipation(), trapezoid_bound(&path));
        assert!(dissipated.abs() < SMOOTH * bound, "{body:?}: {dissipated}, bound {bound}");
        let work = path.states.iter().map(|s| s.elastic_energy.expect("a solver")).fold(0.0, f64::max);
        assert!(bound < 0.2 * work, "{body:?}: a bound of {bound} of {work} tests nothing");
    }
}

/// With plastic flow and a smooth unloading the dissipation is the plastic work.
#[test]
fn flow_dissipates_its_work() {
    for body in [BODIES[0], BODIES[3]] {
        let loads =
            Loads { unload: true, ..Loads::new(LoadKind::Pressure, [0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45]) };
        let path = problem(body, Some(1.2)).load_path(&loads).expect("solved");
        let plastic = path.states[path.states.len() - 1].plasticity.expect("a hardness").work;
        let (dissipated, bound) = (path.dissipation(), trapezoid_bound(&path));
        assert!(
            (dissipated - plastic).abs() < THERE_AND_BACK * bound,
            "{body:?}: {dissipated}, {plastic}, bound {bound}"
        );
        assert!(plastic > 0.1 * bound, "{body:?}: {plastic} of flow, bound {bound}");
    }
}
