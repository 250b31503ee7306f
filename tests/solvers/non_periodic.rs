//! A non-periodic patch on a half-space: Hertzian contact at any position, and adhesion.

use asperity::grid::Grid;
use asperity::interface::{Adhesion, Elastic, NonPeriodic};
use asperity::method::{self, Load, NoObserver, Problem, State, Stop};
use asperity::observe::contact_area;
use std::f64::consts::PI;

fn problem(grid: Grid, heights: &[f64]) -> Problem<'_> {
    let kernel = Elastic::NonPeriodic(NonPeriodic::of_region(grid.lx, grid.ly));
    Problem { kernel, tolerance: 1e-9, max_iterations: 10_000, ..Problem::new(grid, heights) }
}

fn solve<R>(problem: &Problem, load: f64, look: impl FnOnce(&State) -> R) -> R {
    let mut run = method::find("fast").unwrap().start(problem, &NoObserver).unwrap().solver().unwrap();
    let state = run.equilibrate(Load::Pressure(load)).unwrap();
    assert_eq!(state.stop, Stop::Converged, "residual {}", state.residual);
    look(&state)
}

/// The paraboloid r²/2 about the node (x, y).
fn sphere(grid: Grid, (x, y): (usize, usize)) -> Vec<f64> {
    let squared = |i: usize, j: usize| {
        let (dx, dy) = ((i as f64 - x as f64) * grid.dx(), (j as f64 - y as f64) * grid.dy());
        dx * dx + dy * dy
    };
    (0..grid.points()).map(|k| 0.5 * squared(k % grid.nx, k / grid.nx)).collect()
}

/// Hertz (1882), R = E* = 1, with the sphere off the centre of the patch: pressure, gap, elastic and free energy 2/5
/// and -3/5 of the force times the approach. There are no images.
#[test]
fn hertz_without_images() {
    /// Relative tolerances of the pressure away from the edge, the approach, the energies and the area, for contact
    /// radii of 13 nodes.
    const PRESSURE: f64 = 0.01;
    const GAP: f64 = 2e-3;
    const ENERGY: f64 = 2e-3;
    const AREA: f64 = 0.04;
    for (grid, middle) in
        [(Grid::unit(128, 128), (64, 64)), (Grid::unit(128, 128), (20, 30)), (Grid::unit(160, 100), (40, 60))]
    {
        let a = 13.3 * grid.dx();
        let (force, approach, highest) = (4.0 / 3.0 * a.powi(3), a * a, 2.0 * a / PI);
        let heights = sphere(grid, middle);
        let pressure = force / (grid.lx * grid.ly);
        // The slopes of the paraboloid are the coordinates, here midway between nodes.
        let slopes = heights.iter().sum::<f64>() * 2.0 / heights.len() as f64;
        assert!((problem(grid, &heights).resolved_gradient() / slopes.sqrt() - 1.0).abs() < 0.02);
        let load = solve(&problem(grid, &heights), pressure, |s| {
            let mut sum = 0.0;
            for (k, h) in heights.iter().enumerate() {
                let r = (2.0 * h).sqrt();
                sum += s.stress.at(k);
                if (r / a - 1.0).abs() > 0.15 {
                    let expected = highest * (1.0 - (r / a).powi(2)).max(0.0).sqrt();
                    assert!((s.stress.at(k) - expected).abs() < PRESSURE * highest, "{k}: {}", s.stress.at(k));
                }
                if r > 1.15 * a {
                    let lifted = ((2.0 * a * a - r * r) * (a / r).asin() + a * (r * r - a * a).sqrt()) / PI;
                    let expected = h - approach + lifted;
                    assert!((s.gap.at(k) - expected).abs() < GAP * approach, "{k}: {} {expected}", s.gap.at(k));
                }
            }
            let work = force * approach / (grid.lx * grid.ly);
            assert!((s.elastic_energy / (0.4 * work) - 1.0).abs() < ENERGY, "{}", s.elastic_energy / work);
            assert!((s.energy / (-0.6 * work) - 1.0).abs() < ENERGY, "{}", s.energy / work);
            let area = contact_area(grid, s.gap, 0.0).corrected * grid.lx * grid.ly;
            assert!((area / (PI * a * a) - 1.0).abs() < AREA, "{area}");
            sum / grid.points() as f64
        });
        assert!((load / pressure - 1.0).abs() < 1e-9, "{load}");
    }
}

/// The results do not depend on the position of the sphere on the patch, within the tolerance of the solver.
#[test]
fn a_shift_changes_nothing() {
    /// Measured with adhesion: 9e-7 and 6e-6; without: less than a tenth.
    const ENERGY: f64 = 2e-6;
    const ELASTIC: f64 = 1e-5;
    let grid = Grid::unit(96, 96);
    let gamma = 2e-4;
    let adhesion = Adhesion::exponential(gamma, 1.5 * (gamma * grid.dx()).sqrt());
    for adhesion in [Adhesion::None, adhesion] {
        let found = [(48, 48), (24, 24), (70, 40)].map(|middle| {
            let heights = sphere(grid, middle);
            let p = Problem { adhesion, ..problem(grid, &heights) };
            solve(&p, 1e-3, |s| (s.energy, s.elastic_energy, contact_area(grid, s.gap, 0.0).nodes))
        });
        for other in &found[1..] {
            assert!((other.0 / found[0].0 - 1.0).abs() < ENERGY, "{found:?}");
            assert!((other.1 / found[0].1 - 1.0).abs() < ELASTIC && other.2 == found[0].2, "{found:?}");
        }
    }
}

/// Quantities that need a periodic cell are refused; a detached patch is reported.
#[test]
fn what_a_patch_cannot_have() {
    let grid = Grid::unit(32, 32);
    let heights = sphere(grid, (16, 16));
    let p = problem(grid, &heights);
    for id in ["gfmd", "bvm"] {
        let refused = method::find(id).unwrap().start(&p, &NoObserver).err().expect("refused").to_string();
        assert!(refused.contains("non-periodic") && refused.contains("`fast`"), "{refused}");
    }
    let mut run = method::find("fast").unwrap().start(&p, &NoObserver).unwrap().solver().unwrap();
    let refused = run.equilibrate(Load::MeanGap(0.1)).expect_err("refused").to_string();
    assert!(refused.contains("non-periodic"), "{refused}");
    assert_eq!(run.equilibrate(Load::Pressure(-0.1)).unwrap().stop, Stop::Detached);
}
