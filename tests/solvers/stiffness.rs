//! Contact stiffness: the derivative along a load path, closed forms, states with a history.

use super::found::problem;
use asperity::contact::interface::{
    AttractionLaw, Base, Elastic, Layer, NodalHardness, PenaltyWall, RangeChoice, Wall,
};
use asperity::contact::method::{Load, NoObserver, ReducedProblem};
use asperity::contact::path::LoadPathSolver;
use asperity::grid::Grid;
use asperity::methods;
use asperity::surface::{Modes, Spectrum};
use std::f64::consts::PI;

/// Pressure, separation, and stiffness at each load.
fn states(problem: ReducedProblem, loads: &[f64]) -> Vec<(f64, f64, Option<f64>)> {
    let loads: Vec<Load> = loads.iter().map(|p| Load::Pressure(*p)).collect();
    let path = LoadPathSolver::new(problem, methods::find("fast").expect("registered"), RangeChoice::True, 0.0, &loads);
    let mut found = Vec::new();
    path.without_error()
        .with_stiffness()
        .walk(None, false, &NoObserver, |_, r| {
            found.push((r.state.pressure, r.state.separation, r.state.stiffness));
            Ok(())
        })
        .expect("solved");
    found
}

fn rough(grid: Grid, seed: u64) -> Vec<f64> {
    let spectrum = Spectrum { lambda_s: 1.0 / 8.0, ..Spectrum::CHALLENGE };
    Modes::new(spectrum, seed, 1.0).heights(grid, 0.0)
}

/// Differences of small load steps, between which single nodes come into contact.
#[test]
fn stiffness_is_the_derivative_along_the_path() {
    /// Half a node of the few in contact; measured up to 0.9 %.
    const NODES: f64 = 0.02;
    /// Load step of the difference.
    const STEP: f64 = 0.03;
    let grid = Grid::unit(128, 128);
    let layer = Elastic::Layer(Layer { thickness: 0.1, poisson: 0.3, base: Base::Bonded });
    let penalty = Wall::Penalty(PenaltyWall { length: 1e-2 });
    for seed in [1, 2] {
        let heights = rough(grid, seed);
        let hard = ReducedProblem { tolerance: 1e-9, ..problem(grid, &heights) };
        let on_layer = ReducedProblem { kernel: layer, ..hard.clone() };
        let soft = ReducedProblem { wall: penalty, ..hard.clone() };
        for (what, problem) in [("half-space", hard), ("layer", on_layer), ("penalty wall", soft)] {
            for p in [0.003, 0.02, 0.1] {
                let loads = [p * (1.0 - STEP), p, p * (1.0 + STEP)];
                let found = states(problem.clone(), &loads);
                let difference = (found[2].0 - found[0].0) / (found[0].1 - found[2].1);
                let k = found[1].2.expect("in contact");
                assert!((k / difference - 1.0).abs() < NODES, "{what}, seed {seed}, {p}: {k} {difference}");
            }
        }
    }
}

/// Full contact of Westergaard's wave has no stiffness, first contact neither.
#[test]
fn states_without_a_stiffness_have_none() {
    let grid = Grid::unit(64, 4);
    let wave: Vec<f64> = (0..256).map(|i| 0.01 * (2.0 * PI * (i % 64) as f64 / 64.0).cos()).collect();
    let full = 0.01 * PI;
    let found = states(problem(grid, &wave), &[0.0, 0.3 * full, 1.2 * full]);
    let known: Vec<bool> = found.iter().map(|s| s.2.is_some()).collect();
    assert_eq!(known, [false, true, false]);
}

/// Westergaard's wave of amplitude A: ū = A (1 - s + s ln s) with s = p/p_full, p_full = π A E*/λ.
#[test]
fn stiffness_of_a_wave() {
    /// Contact lines lie between nodes: second order over the share of the contact.
    const NODES: f64 = 0.02;
    let n = 512;
    let grid = Grid { nx: n, ny: 1, lx: 1.0, ly: 1.0 / n as f64 };
    let amplitude = 0.01;
    let wave: Vec<f64> = (0..n).map(|i| amplitude * (2.0 * PI * i as f64 / n as f64).cos()).collect();
    let full = amplitude * PI;
    let shares = [0.1, 0.4, 0.8];
    for (found, s) in states(problem(grid, &wave), &shares.map(|s| s * full)).iter().zip(shares) {
        // -dū/dp = A ln(1/s) / p_full.
        let expected = full / (amplitude * (1.0 / s).ln());
        let k = found.2.expect("in contact");
        assert!((k / expected - 1.0).abs() < NODES, "{s}: {k} {expected}");
    }
}

/// With a hardness a state unloads elastically: its stiffness is the slope of a small step back.
#[test]
fn a_plastic_contact_has_the_stiffness_of_unloading() {
    const NODES: f64 = 0.02;
    let grid = Grid::unit(128, 128);
    let heights = rough(grid, 3);
    let hard =
        ReducedProblem { hardness: Some(NodalHardness::Uniform(0.08)), tolerance: 1e-9, ..problem(grid, &heights) };
    let found = states(hard, &[0.02, 0.0198]);
    let difference = (found[0].0 - found[1].0) / (found[1].1 - found[0].1);
    let k = found[0].2.expect("in contact");
    assert!((k / difference - 1.0).abs() < NODES, "{k} {difference}");
}

/// With adhesion the attraction of open nodes adds to it; still the slope of a small step on the same branch.
#[test]
fn stiffness_with_adhesion_is_that_of_a_small_step() {
    const NODES: f64 = 0.03;
    let grid = Grid::unit(128, 128);
    let heights = rough(grid, 4);
    let adhesion = AttractionLaw::exponential(2e-4, 6e-3);
    let sticky = ReducedProblem { adhesion, tolerance: 1e-8, ..problem(grid, &heights) };
    let p = 0.02;
    let found = states(sticky, &[p * 0.98, p, p * 1.02]);
    let difference = (found[2].0 - found[0].0) / (found[0].1 - found[2].1);
    let k = found[1].2.expect("stable");
    assert!((k / difference - 1.0).abs() < NODES, "{k} {difference}");
}
