//! Mesh convergence without adhesion: orders of convergence, and extrapolated values against closed forms. `analytic`
//! tests the same problems on single grids.

use asperity::contact::interface::AttractionLaw;
use asperity::contact::method::{Equilibrium, Load, NoObserver, ReducedProblem, Stop};
use asperity::contact::observe::{ContactEdges, contact_area};
use asperity::grid::{Grid, mean};
use asperity::methods;
use asperity::surface::{MapOptions, Modes, Spectrum, Surface};
use asperity::{Problem, State, Touching};
use ndarray::Array2;
use std::f64::consts::{PI, SQRT_2};

const METHODS: [&str; 3] = ["gfmd", "bvm", "fast"];

fn problem(grid: Grid, heights: &[f64]) -> ReducedProblem<'_> {
    ReducedProblem { tolerance: 1e-9, max_iterations: 100_000, ..ReducedProblem::new(grid, heights) }
}

fn solve<R>(problem: &ReducedProblem, id: &str, pressure: f64, look: impl FnOnce(&Equilibrium) -> R) -> R {
    let mut run = methods::find(id).unwrap().start(problem, &NoObserver).unwrap().solver().unwrap();
    let state = run.equilibrate(Load::Pressure(pressure)).unwrap();
    assert_eq!(state.stop, Stop::Converged, "{id} at {pressure}: residual {}", state.residual);
    look(&state)
}

/// Order of convergence from two errors, the second at half the mesh size.
fn order(coarse: f64, fine: f64) -> f64 {
    (coarse / fine).abs().log2()
}

/// Richardson extrapolation from two meshes, the second of half the size, for an error of the given order.
fn extrapolated(coarse: f64, fine: f64, order: i32) -> f64 {
    fine + (fine - coarse) / (2f64.powi(order) - 1.0)
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// 1-D wave of Westergaard (1939) at loads whose contact lines are nodes of every grid: the mean gap A(1 - r + r ln r)
/// converges at second order, the free energy, its integral over the load, at third order. Both end nodes of a strip
/// are in contact.
#[test]
fn westergaard_is_of_second_order() {
    /// Tolerances of the orders at 192 to 768 points; measured: 0.05 and 0.01.
    const GAP_ORDER: f64 = 0.1;
    const ENERGY_ORDER: f64 = 0.03;
    /// Extrapolated over raw errors; measured: at most 0.02.
    const GAIN: f64 = 0.05;
    let amplitude = 0.01;
    for (r, fraction) in [(0.25, 1.0 / 3.0), (0.5f64, 0.5), (0.75, 2.0 / 3.0)] {
        let gap = 1.0 - r + r * r.ln();
        let energy = r - 0.75 * r * r + 0.5 * r * r * r.ln();
        let found = [192, 384, 768].map(|n| {
            let grid = Grid { nx: n, ny: 1, lx: 1.0, ly: 1.0 / n as f64 };
            let heights: Vec<f64> = (0..n).map(|i| amplitude * (2.0 * PI * i as f64 / n as f64).cos()).collect();
            solve(&problem(grid, &heights), "fast", r * PI * amplitude, |s| {
                let nodes = contact_area(grid, s.gap, ContactEdges::COUNTED).count;
                assert_eq!(nodes, (fraction * n as f64).round() as usize + 1, "r = {r}, {n} points");
                (s.mean_gap / amplitude, s.energy / (PI * amplitude * amplitude))
            })
        });
        for pair in found.windows(2) {
            let [a, b] = [pair[0], pair[1]];
            let orders = (order(a.0 - gap, b.0 - gap), order(a.1 - energy, b.1 - energy));
            assert!((orders.0 - 2.0).abs() < GAP_ORDER && (orders.1 - 3.0).abs() < ENERGY_ORDER, "{r}: {orders:?}");
            let gains = (
                (extrapolated(a.0, b.0, 2) - gap) / (b.0 - gap),
                (extrapolated(a.1, b.1, 3) - energy) / (b.1 - energy),
            );
            assert!(gains.0.abs() < GAIN && gains.1.abs() < GAIN, "r = {r}: {gains:?}");
        }
    }
}

/// Sums over a square lattice without its origin, with the neutralising background: Σ 1/r and Σ 1/r³.
const LATTICE: f64 = -3.900_264_92;
const LATTICE_CUBED: f64 = 9.033_62;

/// An axisymmetric indenter h = r²/2R + c r⁴ with contact radius a, one per square cell of length L: force, and
/// approach of the mean planes of the bodies. Without images: Hertz, and Galin's solution for r⁴ (δ = 8/3 c a⁴, F =
/// 64/15 c a⁵). Images displace the surface by F/π (Σ1/r + (r² + s²) Σ1/r³/4), with the mean square radius s² = 2a²/5
/// of the Hertzian pressure: a constant and a curvature. The next term is of fifth order in a/L.
fn indenter(a: f64, (radius, quartic): (f64, f64), cell: f64) -> (f64, f64) {
    let images = LATTICE_CUBED / (2.0 * PI * cell.powi(3));
    let force =
        (4.0 / 3.0 * a.powi(3) / radius + 64.0 / 15.0 * quartic * a.powi(5)) / (1.0 - 4.0 / 3.0 * images * a.powi(3));
    let approach = a * a * (1.0 / radius + images * force)
        + 8.0 / 3.0 * quartic * a.powi(4)
        + force / PI * (LATTICE / cell + 0.1 * LATTICE_CUBED * a * a / cell.powi(3));
    (force, approach)
}

/// Contact radius at a force, approach, and the work ∫ F dδ, which is the elastic energy.
fn under_force(force: f64, shape: (f64, f64), cell: f64) -> (f64, f64, f64) {
    let (mut low, mut high) = (0.0, 0.25 * cell);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if indenter(middle, shape, cell).0 < force { low = middle } else { high = middle }
    }
    // The trapezoidal rule is accurate to 1e-7.
    let steps = 2000;
    let points: Vec<_> = (0..=steps).map(|k| indenter(low * k as f64 / steps as f64, shape, cell)).collect();
    let work = points.windows(2).map(|w| 0.5 * (w[0].0 + w[1].0) * (w[1].1 - w[0].1)).sum();
    (low, points[steps].1, work)
}

/// Hertz: approach and elastic energy converge at least at second order, the node count of the area at first order;
/// perimeter correction and extrapolation reduce the error of the area. Errors depend on the position of contact lines
/// on the grid and are averaged over three loads and three positions of the sphere.
#[test]
fn hertz_converges_at_second_order() {
    /// Contact radii of 3.9 to 5.9 nodes on the coarsest grid and 16 to 23 on the finest, at most L/11: the error of
    /// the closed form is 1e-6 of the approach.
    const FORCES: [f64; 3] = [3e-4, 5.5e-4, 1e-3];
    let shape = (1.0, 0.0);
    // Per grid, relative errors of approach, elastic energy, counted and corrected area.
    let errors = [64usize, 128, 256].map(|n| {
        let grid = Grid::unit(n, n);
        let mut found: [Vec<f64>; 4] = Default::default();
        for place in [0.0, 0.25, 0.5] {
            let offset = |i: usize| (i as f64 - place) / n as f64 - 0.5;
            let heights: Vec<f64> = (0..n * n).map(|i| 0.5 * (offset(i % n).powi(2) + offset(i / n).powi(2))).collect();
            let plane = mean(&heights);
            for force in FORCES {
                let (a, approach, work) = under_force(force, shape, 1.0);
                solve(&problem(grid, &heights), "fast", force, |s| {
                    let area = contact_area(grid, s.gap, ContactEdges::ELASTIC);
                    let disc = PI * a * a;
                    // The approach is measured from first contact at height zero.
                    found[0].push((plane - s.mean_gap) / approach - 1.0);
                    found[1].push(s.elastic_energy / work - 1.0);
                    found[2].push(area.contact_nodes / disc - 1.0);
                    found[3].push(area.contact_area / disc - 1.0);
                });
            }
        }
        found
    });
    falls(&errors.map(|found| found.map(|e| rms(&e))));
}

/// Checks the orders of rms errors of approach, elastic energy, counted and corrected area on successively doubled
/// grids.
fn falls(errors: &[[f64; 4]; 3]) {
    /// Smallest orders: approach and energy (measured: 1.85 to 3.0), counted area (measured: 0.8 to 1.4).
    const ORDER: f64 = 1.7;
    const AREA_ORDER: f64 = 0.7;
    /// Error of the corrected over that of the counted area; measured: 0.2 to 0.65.
    const CORRECTION: f64 = 0.75;
    for pair in errors.windows(2) {
        let orders = [0, 1, 2].map(|i| order(pair[0][i], pair[1][i]));
        assert!(orders[0] > ORDER && orders[1] > ORDER && orders[2] > AREA_ORDER, "{orders:?} from {errors:?}");
    }
    assert!(errors.iter().all(|e| e[3] < CORRECTION * e[2]), "{errors:?}");
}

/// h = D cos cos at a small load: contacts at the low points are Hertzian with a quartic term and images.
/// There are two per unit cell, on a square lattice of length 1/√2. Near a low point h = D(q²r²/2 - q⁴r⁴/16), averaged
/// over directions.
#[test]
fn two_dimensional_sinusoid_converges_at_second_order() {
    let (amplitude, q) = (0.02, 2.0 * PI);
    let shape = (1.0 / (amplitude * q * q), -amplitude * q.powi(4) / 16.0);
    falls(&[128usize, 256, 512].map(|n| {
        let grid = Grid::unit(n, n);
        let mut found: [Vec<f64>; 4] = Default::default();
        for light in [0.003, 0.006] {
            let pressure = light * SQRT_2 * PI * amplitude;
            let (a, approach, work) = under_force(0.5 * pressure, shape, 1.0 / SQRT_2);
            let discs = 2.0 * PI * a * a;
            for place in [0.0, 0.25, 0.5] {
                let wave = |i: usize| (q * (i as f64 - place) / n as f64).cos();
                let heights: Vec<f64> = (0..n * n).map(|i| amplitude * wave(i % n) * wave(i / n)).collect();
                solve(&problem(grid, &heights), "fast", pressure, |s| {
                    let area = contact_area(grid, s.gap, ContactEdges::ELASTIC);
                    found[0].push((amplitude - s.mean_gap) / approach - 1.0);
                    found[1].push(s.elastic_energy / (2.0 * work) - 1.0);
                    found[2].push(area.contact_nodes / discs - 1.0);
                    found[3].push(area.contact_area / discs - 1.0);
                });
            }
        }
        found.map(|e| rms(&e))
    }));
}

/// A flat strip of half-width a next to a groove without contact: the pressure of a row of flat punches under the mean
/// pressure p, p cos(πx)/√(sin²πa - sin²πx) (Sadowsky 1928, Koiter 1959 for the cracks between), and the mean gap
/// D(1 - 2a) + (2p/π) ln sin πa.
#[test]
fn flat_punches_in_a_row() {
    /// Tolerance of the first order, due to the singular edges; measured: 0.003 in the mean gap, slightly less in
    /// stresses.
    const ORDER: f64 = 0.05;
    /// Relative difference of energies converged to residuals of 1e-9 of the pressure; measured: 1e-15.
    const AGREEMENT: f64 = 1e-9;
    let (half_width, depth, pressure) = (0.2, 0.1, 0.01);
    let strip = |n: usize| -> (Grid, Vec<f64>) {
        let grid = Grid { nx: n, ny: 1, lx: 1.0, ly: 1.0 / n as f64 };
        let edge = (half_width * n as f64).round() as usize;
        (grid, (0..n).map(|i| if i < edge || i >= n - edge { 0.0 } else { depth }).collect())
    };
    let compliance = 2.0 / PI * (PI * half_width).sin().ln();
    let found = [40, 80, 160, 320, 640].map(|n| {
        let (grid, heights) = strip(n);
        solve(&problem(grid, &heights), "fast", pressure, |s| {
            assert_eq!(contact_area(grid, s.gap, ContactEdges::COUNTED).contact_nodes, 2.0 * half_width);
            let worst = (0..(3 * n) / 20)
                .map(|i| {
                    let x = (i as f64 + 0.5) / n as f64;
                    let root = ((PI * half_width).sin().powi(2) - (PI * x).sin().powi(2)).sqrt();
                    (s.stress.at(i) / (pressure * (PI * x).cos() / root) - 1.0).abs()
                })
                .fold(0.0, f64::max);
            ((s.mean_gap - depth * (1.0 - 2.0 * half_width)) / (pressure * compliance) - 1.0, worst)
        })
    });
    for pair in found.windows(2) {
        let orders = (order(pair[0].0, pair[1].0), order(pair[0].1, pair[1].1));
        assert!((orders.0 - 1.0).abs() < ORDER && orders.1 > 1.0 - ORDER, "{orders:?} from {found:?}");
    }
    let (grid, heights) = strip(160);
    let [a, others @ ..] = METHODS.map(|id| solve(&problem(grid, &heights), id, pressure, |s| s.energy));
    assert!(others.iter().all(|b| (b / a - 1.0).abs() < AGREEMENT), "{a} {others:?}");
}

/// Methods agree in energy on rectangular grids and meshes, at small and large loads, with and without adhesion.
#[test]
fn methods_agree_on_oblong_grids() {
    /// Relative difference of energies converged to residuals of 1e-9 of the pressure.
    const TOLERANCE: f64 = 1e-6;
    let gamma: f64 = 2.7e-4;
    // A half cell of square meshes, and a square cell of oblong ones.
    for (grid, seed) in [(Grid { nx: 192, ny: 96, lx: 1.0, ly: 0.5 }, 3), (Grid::unit(96, 144), 11)] {
        let spectrum = Spectrum { lambda_s: 1.0 / 16.0, ..Spectrum::CHALLENGE };
        let heights: Vec<f64> = Modes::new(spectrum, seed, grid.ly).heights(grid, 0.0);
        // Cohesive resolution 1.4 along the wider mesh.
        let range = 1.4 * (gamma * grid.dx().max(grid.dy())).sqrt();
        for adhesion in [AttractionLaw::None, AttractionLaw::exponential(gamma, range)] {
            for pressure in [0.003, 0.05] {
                let p = ReducedProblem { adhesion, ..problem(grid, &heights) };
                let [a, others @ ..] = METHODS.map(|id| solve(&p, id, pressure, |s| s.energy));
                for b in others {
                    assert!((b / a - 1.0).abs() < TOLERANCE, "{grid:?}, {adhesion}, {pressure}: {a} {others:?}");
                }
            }
        }
    }
}

/// Stated errors of oblong maps, whose sides have 64 to 256 points: of 24 surfaces one or none is missed in each quantity, by a grid six times
/// finer. Of 90 others none was.
#[test]
fn errors_of_oblong_maps_cover_the_truth() {
    const FINER: usize = 6;
    const MISSED: usize = 1;
    let shapes = [(128, 64), (64, 128), (192, 96), (256, 64), (160, 70), (96, 256)];
    let cases = (0..24).map(|i| (shapes[i % 6], [0.01, 0.03, 0.1][i % 3], [0.3, 0.5, 0.8, 1.0][i % 4], 500 + i as u64));
    let mut missed = [0; 3];
    for ((nx, ny), p_star, hurst, seed) in cases {
        let (aspect, short) = (ny as f64 / nx as f64, 8.0 / nx as f64);
        let spectrum = Spectrum { hurst, lambda_r: 0.3, lambda_s: short, rms_gradient: 0.1, ..Spectrum::CHALLENGE };
        let grid = Grid { nx, ny, lx: 1.0, ly: aspect };
        let heights = Array2::from_shape_vec((ny, nx), Modes::new(spectrum, seed, aspect).heights(grid, 0.0));
        let options = MapOptions { length_y: Some(aspect), ..MapOptions::new(1.0, Touching::LowPoints) };
        let map = Surface::from_map(heights.expect("a map").view(), &options).expect("a surface");
        let fine = Problem::new(map.on_nodes(FINER * nx, FINER * ny), 1.0).solve(0.1 * p_star).expect("the truth");
        let state = Problem::new(map, 1.0).solve(0.1 * p_star).expect("an equilibrium");
        let of = |s: &State| [Some(s.contact_area), s.mean_gap, s.stiffness].map(|v| v.expect("a number"));
        let errors = [state.contact_area_error, state.mean_gap_error, state.stiffness_error];
        for (k, (found, truth)) in of(&state).into_iter().zip(of(&fine)).enumerate() {
            let covered = errors[k].is_some_and(|error| (found - truth).abs() <= error);
            missed[k] += usize::from(!covered);
        }
    }
    assert!(missed.iter().all(|n| *n <= MISSED), "{missed:?}");
}
