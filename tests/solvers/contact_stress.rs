//! Grids that are solved for the contact stress: the states of the solver for the gap, in a fraction of its transform pairs.

use crate::found::{Found, near, path, problem, rough};
use asperity::contact::interface::{Base, Elastic, Layer, PenaltyWall, Wall};
use asperity::contact::method::{Load, NoObserver, Precision, ReducedProblem, Stop};
use asperity::grid::Grid;
use asperity::methods;

/// State and transform pairs at one pressure.
fn counted(problem: &ReducedProblem, id: &str, pressure: f64) -> (Found, f64) {
    let mut run = methods::find(id).expect("a method").start(problem, &NoObserver).expect("started").solver().unwrap();
    let state = run.equilibrate(Load::Pressure(pressure)).expect("a state");
    assert_eq!(state.stop, Stop::Converged, "{id} at {pressure}");
    (Found::of(problem.grid, &state), state.fft_pairs)
}

/// The nodes in contact are those of `bvm`, the stress differs by the residuals: bodies, walls, oblong cells and pixels, grids of
/// other ratios than two, plateaus, light loads.
#[test]
fn states_are_those_of_the_solver_for_the_gap() {
    /// Difference of stresses over the pressure, at residuals of 1e-8 of it, rms; a change by one node in contact is more.
    const STRESS: f64 = 1e-6;
    let layer = |thickness| Elastic::Layer(Layer { thickness, poisson: 0.4, base: Base::Bonded });
    let soft = |length| Wall::Penalty(PenaltyWall { length });
    for (nx, ny, ly, pressure, kernel, wall, plateau) in [
        (256, 256, 1.0, 0.01, Elastic::HalfSpace, Wall::Hard, false),
        (256, 256, 1.0, 1e-4, Elastic::HalfSpace, Wall::Hard, false),
        (200, 150, 0.75, 0.01, Elastic::HalfSpace, Wall::Hard, false),
        (192, 256, 0.8, 0.01, Elastic::HalfSpace, Wall::Hard, true),
        (192, 192, 1.0, 0.01, layer(0.05), Wall::Hard, false),
        (192, 160, 1.0, 0.01, Elastic::HalfSpace, soft(1e-3), false),
        (192, 160, 1.0, 0.05, layer(0.2), soft(1e-2), false),
    ] {
        let (_, mut heights) = rough(nx, ny, 1.0 / 24.0, 7);
        let grid = Grid { nx, ny, lx: 1.0, ly };
        if plateau {
            let mut sorted = heights.clone();
            sorted.sort_by(f64::total_cmp);
            let limit = sorted[sorted.len() / 50];
            heights.iter_mut().for_each(|h| *h = h.max(limit));
        }
        let p = ReducedProblem { kernel, wall, ..problem(grid, &heights) };
        let ((found, pairs), (expected, more)) = (counted(&p, "fast", pressure), counted(&p, "bvm", pressure));
        let what = format!("{nx} x {ny}, {ly}, {pressure}, {kernel}, {wall}: {pairs} pairs, bvm {more}");
        assert_eq!(found.area, expected.area, "{what}");
        let square: f64 = found.stress.iter().zip(&expected.stress).map(|(a, b)| (a - b).powi(2)).sum();
        let rms = (square / found.stress.len() as f64).sqrt() / pressure;
        assert!(rms < STRESS && near(found.energy, expected.energy, 1e-8), "{what}: {rms:e}");
    }
}

/// A wall takes the pairs of a hard one however stiff it is, and a third of those that the solver for the gap needed (82 and 91 at
/// 256² and 512² for this kind of surface, up to 1830 behind a wall).
#[test]
fn stiff_walls_take_no_more_pairs_than_hard_ones() {
    /// Measured: 24 to 31.
    const PAIRS: f64 = 40.0;
    let (grid, heights) = rough(256, 256, 1.0 / 64.0, 3);
    let p = problem(grid, &heights);
    let (hard, pairs) = counted(&p, "fast", 0.01);
    assert!(pairs < PAIRS, "{pairs}");
    for length in [0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-8] {
        let wall = ReducedProblem { wall: Wall::Penalty(PenaltyWall { length }), ..p.clone() };
        let (found, pairs) = counted(&wall, "fast", 0.01);
        assert!(pairs < PAIRS, "ℓ = {length}: {pairs}");
        assert!(length > 1e-8 || near(found.energy, hard.energy, 1e-6), "{} {}", found.energy, hard.energy);
    }
}

/// The limit of the iterations holds for both solvers together, and a state within it is not called converged.
#[test]
fn iterations_are_limited() {
    let (grid, heights) = rough(256, 256, 1.0 / 24.0, 3);
    for wall in [Wall::Hard, Wall::Penalty(PenaltyWall { length: 1e-4 })] {
        for max_iterations in [1, 12] {
            let p = ReducedProblem { max_iterations, wall, ..problem(grid, &heights) };
            let found = path(&p, "fast", &[0.01]).remove(0);
            assert_eq!(found.stop, Stop::IterationLimit, "{wall}, {max_iterations}");
            assert!(found.iterations <= max_iterations && found.is_finite(), "{wall}: {}", found.iterations);
        }
    }
}

/// A hardness that is not reached changes neither a bit of the state nor its stiffness.
#[test]
fn an_unreached_hardness_keeps_the_stiffness() {
    let (grid, heights) = rough(256, 192, 1.0 / 24.0, 5);
    let elastic = ReducedProblem { stiffness: true, ..problem(grid, &heights) };
    let stiffness = |p: &ReducedProblem| {
        let mut run =
            methods::find("fast").expect("a method").start(p, &NoObserver).expect("started").solver().unwrap();
        let state = run.equilibrate(Load::Pressure(0.01)).expect("a state");
        (state.stiffness.expect("a stiffness"), state.gap.to_vec())
    };
    let yielding = ReducedProblem { hardness: Some(50.0.into()), ..elastic.clone() };
    assert_eq!(stiffness(&yielding), stiffness(&elastic));
}

/// In f32 the state is that of f64, also where the tolerance is below the rounding error.
#[test]
fn single_precision_has_the_same_contact() {
    let (grid, heights) = rough(256, 192, 1.0 / 24.0, 11);
    let p = problem(grid, &heights);
    let (found, _) = counted(&p, "fast", 0.01);
    let single = ReducedProblem { precision: Precision::F32, tolerance: 1e-3, ..p };
    let (narrow, pairs) = counted(&single, "fast", 0.01);
    assert!(near(narrow.area, found.area, 2e-3) && near(narrow.mean_gap, found.mean_gap, 1e-4), "{pairs} pairs");
    assert!(pairs < 25.0, "{pairs}");
    let exact = ReducedProblem { precision: Precision::F32, tolerance: 1e-9, ..problem(grid, &heights) };
    let rounded = path(&exact, "fast", &[0.01]).remove(0);
    assert!(rounded.stop == Stop::RoundingFloor && near(rounded.area, found.area, 2e-3), "{:?}", rounded.stop);
}
