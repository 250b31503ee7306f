//! Behind stiff walls grids are solved for the contact stress: the states of the solver for the gap, in a fraction of its transform pairs.

use crate::found::{Found, near, path, problem, rough};
use asperity::contact::interface::{Base, Elastic, Layer, NonPeriodic, PenaltyWall, Wall};
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
        (192, 192, 1.0, 0.01, Elastic::HalfSpace, soft(1e-4), false),
        (192, 192, 1.0, 1e-4, Elastic::HalfSpace, soft(1e-3), false),
        (200, 150, 0.75, 0.01, Elastic::HalfSpace, soft(1e-3), false),
        (160, 192, 0.8, 0.01, Elastic::HalfSpace, soft(1e-3), true),
        (192, 192, 1.0, 0.01, layer(0.05), soft(1e-3), false),
        (192, 160, 1.0, 0.2, Elastic::HalfSpace, soft(1e-3), false),
        (192, 160, 1.0, 0.05, layer(0.2), soft(5e-3), false),
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

/// A wall takes fewer pairs than a hard one however stiff it is; the solver for the gap took up to 1830.
#[test]
fn stiff_walls_take_no_more_pairs_than_hard_ones() {
    let (grid, heights) = rough(256, 256, 1.0 / 64.0, 3);
    let p = problem(grid, &heights);
    let (hard, most) = counted(&p, "fast", 0.01);
    for length in [3e-3, 1e-3, 1e-4, 1e-5, 1e-8] {
        let wall = ReducedProblem { wall: Wall::Penalty(PenaltyWall { length }), ..p.clone() };
        let (found, pairs) = counted(&wall, "fast", 0.01);
        assert!(pairs < most, "ℓ = {length}: {pairs}, hard {most}");
        assert!(length > 1e-8 || near(found.energy, hard.energy, 1e-6), "{} {}", found.energy, hard.energy);
    }
}

/// A body that is not periodic, on square and oblong patches: the pairs do not grow with the stiffness of the wall, behind which the solver
/// for the gap took 270 to 3500 and reached its limit at 1e-6, and the states approach that of the hard wall. That a state is in equilibrium
/// is decided from its gap.
#[test]
fn stiff_walls_on_bodies_that_are_not_periodic() {
    for (nx, ny) in [(64, 64), (96, 40)] {
        let (_, heights) = rough(nx, ny, 1.0 / 16.0, 3);
        let grid = Grid { nx, ny, lx: 1.0, ly: ny as f64 / nx as f64 };
        let kernel = Elastic::NonPeriodic(NonPeriodic::of_region(grid.lx, grid.ly));
        for pressure in [1e-4, 1e-3, 1e-2] {
            let p = ReducedProblem { kernel, ..problem(grid, &heights) };
            let (hard, _) = counted(&p, "fast", pressure);
            let mut distance = f64::INFINITY;
            for length in [1e-3, 1e-4, 1e-5, 1e-6] {
                let wall = ReducedProblem { wall: Wall::Penalty(PenaltyWall { length }), ..p.clone() };
                let (found, pairs) = counted(&wall, "fast", pressure);
                assert!(pairs < 60.0, "{nx} x {ny}, {pressure}, ℓ = {length}: {pairs}");
                let miss = (found.mean_gap - hard.mean_gap).abs() / hard.mean_gap;
                assert!(miss < 0.5 * distance, "{nx} x {ny}, {pressure}, ℓ = {length}: {miss:e} after {distance:e}");
                assert!(found.area >= hard.area, "{nx} x {ny}, {pressure}, ℓ = {length}");
                distance = miss;
            }
            assert!(distance < 1e-3, "{nx} x {ny}, {pressure}: {distance:e}");
        }
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

/// In f32 the state is that of f64.
#[test]
fn single_precision_has_the_same_contact() {
    let (grid, heights) = rough(256, 192, 1.0 / 24.0, 11);
    let wall = Wall::Penalty(PenaltyWall { length: 1e-4 });
    let p = ReducedProblem { wall, ..problem(grid, &heights) };
    let (found, _) = counted(&p, "fast", 0.01);
    let single = ReducedProblem { precision: Precision::F32, tolerance: 1e-3, ..p };
    let (narrow, pairs) = counted(&single, "fast", 0.01);
    assert!(near(narrow.area, found.area, 2e-3) && near(narrow.mean_gap, found.mean_gap, 1e-4), "{pairs} pairs");
}
