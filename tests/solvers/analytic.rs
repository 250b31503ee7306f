//! Solvers against closed forms and against each other.

use asperity::contact::interface::{AttractionLaw, Base, Elastic, Kernel, Layer, Wall};
use asperity::contact::method::{self, Equilibrium, Heights, Load, NoObserver, Precision, ReducedProblem, Stop};
use asperity::contact::observe::{
    Connectivity, ContactEdges, cluster_sizes, contact_area, contact_map, gap_distribution, linear_edges,
    stress_distribution,
};
use asperity::surface::{Modes, Spectrum, moments};
use asperity::{grid::Grid, grid::Transform, methods};
use std::f64::consts::PI;

const METHODS: [&str; 3] = ["gfmd", "bvm", "fast"];

/// Load balance of every converged state.
const LOAD_BALANCE: f64 = 1e-9;

fn problem(grid: Grid, heights: &[f64]) -> ReducedProblem<'_> {
    ReducedProblem { tolerance: 1e-9, max_iterations: 200_000, ..ReducedProblem::new(grid, heights) }
}

fn solve<R>(problem: &ReducedProblem, id: &str, pressure: f64, look: impl FnOnce(&Equilibrium) -> R) -> R {
    let mut run = methods::find(id).unwrap().start(problem, &NoObserver).unwrap().solver().unwrap();
    let state = run.equilibrate(Load::Pressure(pressure)).unwrap();
    assert_eq!(state.stop, Stop::Converged, "{id} at {pressure}: residual {}", state.residual);
    assert!(state.load_error <= LOAD_BALANCE, "{id} at {pressure}: load error {}", state.load_error);
    assert!((asperity::grid::mean(&state.stress.to_vec()) / pressure - 1.0).abs() <= LOAD_BALANCE);
    look(&state)
}

fn fraction(state: &Equilibrium, grid: Grid) -> (f64, f64) {
    let area = contact_area(grid, state.gap, ContactEdges::ELASTIC);
    (area.contact_nodes, area.contact_area)
}

/// 1-D wave h = A cos(2πx), Westergaard (1939): contact fraction (2/π) asin √r and mean gap A(1 - r + r ln r) at
/// r = p/p_fc, p_fc = π E* A/λ.
#[test]
fn westergaard() {
    // The error of the mean gap over the amplitude is of second order; measured: at most 1.9/n². The fraction may differ by one node at either contact line.
    let n = 1024;
    let amplitude = 0.01;
    let grid = Grid { nx: n, ny: 1, lx: 1.0, ly: 1.0 / n as f64 };
    let heights: Vec<f64> = (0..n).map(|i| amplitude * (2.0 * PI * i as f64 / n as f64).cos()).collect();
    for id in METHODS {
        for tenth in 1..10 {
            let r = f64::from(tenth) / 10.0;
            solve(&problem(grid, &heights), id, r * PI * amplitude, |state| {
                let exact = 2.0 / PI * r.sqrt().asin();
                let (found, _) = fraction(state, grid);
                assert!((found - exact).abs() <= 2.0 / n as f64, "{id} r = {r}: {found} {exact}");
                let gap = 1.0 - r + r * r.ln();
                assert!(
                    (state.mean_gap / amplitude - gap).abs() <= 2.0 / (n * n) as f64,
                    "{id} r = {r}: {} {gap}",
                    state.mean_gap
                );
            });
        }
    }
}

/// The mean gap of the 1-D wave converges at second order with the mesh, at a load whose contact lines lie between nodes.
#[test]
fn westergaard_mean_gap_converges() {
    /// Smallest ratio of errors at a quarter of the spacing. Measured: 16.2, 25.3, 25.9.
    const RATIO: f64 = 15.0;
    let error = |n: usize| {
        let heights: Vec<f64> = (0..n).map(|i| 0.01 * (2.0 * PI * i as f64 / n as f64).cos()).collect();
        let grid = Grid { nx: n, ny: 1, lx: 1.0, ly: 1.0 };
        let r = 0.37f64;
        solve(&problem(grid, &heights), "bvm", r * PI * 0.01, |s| (s.mean_gap / 0.01 - (1.0 - r + r * r.ln())).abs())
    };
    let errors = [64, 256, 1024, 4096].map(error);
    for pair in errors.windows(2) {
        assert!(pair[1] < pair[0] / RATIO, "{errors:?}");
    }
}

/// h = D cos cos against another program, Tamaas 2.8 (`PolonskyKeerRey`, tolerance 1e-11): number of contact nodes and mean
/// gap over D against pressure over √2 π E* D/λ, at N = 256. Tamaas converges to other iterates on the same nodes with the
/// same kernel, so that the states agree to the tolerances of both. Closed forms for small loads are in `refinement`.
#[test]
fn two_dimensional_sinusoid() {
    const TABLE: [(f64, usize, f64); 8] = [
        (0.01, 2402, 0.818_291_958_3),
        (0.03, 5202, 0.660_676_694_9),
        (0.1, 12602, 0.384_750_346_7),
        (0.2, 22682, 0.204_647_601_4),
        (0.3, 33910, 0.124_879_756_0),
        (0.5, 46278, 0.045_079_437_3),
        (0.7, 55094, 0.011_130_923_5),
        (0.9, 62334, 0.000_651_464_6),
    ];
    /// Difference of the mean gaps over D. Measured: below 1e-9.
    const GAP: f64 = 1e-8;
    let n = 256;
    let amplitude = 0.02;
    let grid = Grid::unit(n, n);
    let wave = |i: usize| (2.0 * PI * i as f64 / n as f64).cos();
    let heights: Vec<f64> = (0..n * n).map(|i| amplitude * wave(i % n) * wave(i / n)).collect();
    for (x, nodes, gap) in TABLE {
        solve(&problem(grid, &heights), "bvm", x * 2f64.sqrt() * PI * amplitude, |state| {
            assert_eq!(contact_area(grid, state.gap, ContactEdges::COUNTED).count, nodes, "x = {x}");
            assert!((state.mean_gap / amplitude - gap).abs() < GAP, "x = {x}: {} {gap}", state.mean_gap / amplitude);
        });
    }
}

/// Hertz in a periodic cell: contact radius with the correction of the curvature by the images.
#[test]
fn hertz() {
    /// Relative errors of the corrected area and of the highest stress at a radius of 50 nodes. Measured: 4.2e-4 and 1.1e-5.
    const AREA: f64 = 6e-4;
    const STRESS: f64 = 2e-5;
    let n = 512;
    let grid = Grid::unit(n, n);
    let radius = 1.0;
    let heights: Vec<f64> = (0..n * n)
        .map(|i| ((i % n) as f64 / n as f64 - 0.5).powi(2) + ((i / n) as f64 / n as f64 - 0.5).powi(2))
        .map(|r2| r2 / (2.0 * radius))
        .collect();
    for id in METHODS {
        let force = 1.3333e-3;
        solve(&problem(grid, &heights), id, force, |state| {
            // Images flatten the sphere: 1/R_eff = 1/R + 9.03362 F/(2π E* L³).
            let effective = (1.0 / radius + 9.03362 * force / (2.0 * PI)).recip();
            let a = (0.75 * force * effective).cbrt();
            let (_, corrected) = fraction(state, grid);
            assert!((corrected / (PI * a * a) - 1.0).abs() < AREA, "{id}: {corrected} {}", PI * a * a);
            let highest = state.stress.to_vec().into_iter().fold(0.0, f64::max);
            let p0 = 1.5 * force / (PI * a * a);
            assert!((highest / p0 - 1.0).abs() < STRESS, "{id}: {highest} {p0}");
        });
    }
}

fn rough(n: usize, short: f64, seed: u64) -> (Grid, Vec<f64>) {
    let grid = Grid::unit(n, n);
    let spectrum = Spectrum { lambda_s: short, ..Spectrum::CHALLENGE };
    (grid, Modes::new(spectrum, seed, 1.0).heights(grid, 0.0))
}

/// In full contact the stress is exactly p - K h, with the rms E* g/2, and the gap is zero.
#[test]
fn full_contact() {
    // Large enough for `fast` to nest grids.
    let (grid, heights) = rough(144, 1.0 / 16.0, 1);
    let gradient = moments(grid, &heights).rms_gradient;
    for id in METHODS {
        solve(&problem(grid, &heights), id, 10.0, |state| {
            assert_eq!(fraction(state, grid).0, 1.0);
            assert_eq!(state.mean_gap, 0.0);
            let stress = state.stress.to_vec();
            let transform = Transform::<f64>::new(grid);
            let mut spectrum = transform.spectrum();
            transform.forward(&heights, &mut spectrum);
            for j in 0..grid.ny {
                for i in 0..grid.half() {
                    let k = Elastic::HalfSpace.stiffness(grid.qx(i), grid.qy(j)) / grid.points() as f64;
                    spectrum[j * grid.pitch() + i] *= -k;
                }
            }
            let mut exact = vec![0.0; grid.points()];
            transform.inverse(&mut spectrum, &mut exact);
            for (s, e) in stress.iter().zip(&exact) {
                assert!((s - e - 10.0).abs() < 1e-12, "{id}: {s} {}", e + 10.0);
            }
            assert!((asperity::grid::rms(&stress) / (0.5 * gradient) - 1.0).abs() < 1e-12);
        });
    }
}

/// Methods with different unknowns and iterations agree on a rough surface. They have transform, kernel and energy in
/// common, which are tested against the direct sum and closed forms.
#[test]
fn methods_agree_on_a_rough_surface() {
    /// Relative to the rms height; both are converged to residuals of 1e-9 of the pressure.
    const TOLERANCE: f64 = 1e-6;
    let (grid, heights) = rough(512, 1.0 / 64.0, 18);
    let rms = moments(grid, &heights).rms_height;
    let layer = Elastic::Layer(Layer { thickness: 0.143, poisson: 0.3, base: Base::Bonded });
    // Cohesive resolution ρ/√(γ dx) = 1.4 on this grid: the result does not depend on the path.
    let gamma: f64 = 2.7e-4;
    let adhesion = AttractionLaw::exponential(gamma, 1.4 * (gamma / 512.0).sqrt());
    for (kernel, adhesion) in
        [(Elastic::HalfSpace, AttractionLaw::None), (layer, AttractionLaw::None), (Elastic::HalfSpace, adhesion)]
    {
        let p = ReducedProblem { kernel, adhesion, ..problem(grid, &heights) };
        let [a, others @ ..] = METHODS.map(|id| solve(&p, id, 0.01, |s| (s.gap.to_vec(), s.energy)));
        for b in others {
            let largest = a.0.iter().zip(&b.0).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!((a.1 / b.1 - 1.0).abs() < 1e-8, "{kernel}, {adhesion}: energies {} {}", a.1, b.1);
            assert!(largest / rms < TOLERANCE, "{kernel}, {adhesion}: {}", largest / rms);
        }
    }
}

/// Thin bonded layers are stiffest for the longest waves, which limit the step lengths.
#[test]
fn methods_agree_on_a_thin_incompressible_layer() {
    let (grid, heights) = rough(64, 1.0 / 16.0, 3);
    let layer = Layer { thickness: 0.005, poisson: 0.5, base: Base::Bonded };
    // Waves a thousand times stiffer than on a half-space reduce the attainable accuracy of the residual.
    let p = ReducedProblem { kernel: Elastic::Layer(layer), tolerance: 1e-7, ..problem(grid, &heights) };
    let [a, others @ ..] = METHODS.map(|id| {
        let mut run = methods::find(id).unwrap().start(&p, &NoObserver).unwrap().solver().unwrap();
        let state = run.equilibrate(Load::Pressure(0.05)).unwrap();
        assert_eq!(state.stop, Stop::Converged, "{id}: residual {}", state.residual);
        state.energy
    });
    assert!(others.iter().all(|b| (b / a - 1.0).abs() < 1e-7), "{a} {others:?}");
}

/// Nested iteration of `fast` on grids that cannot be halved repeatedly.
#[test]
fn nested_grids_need_not_halve() {
    for (nx, ny) in [(129, 129), (200, 200), (256, 130)] {
        let grid = Grid::unit(nx, ny);
        let spectrum = Spectrum { lambda_s: 1.0 / 24.0, ..Spectrum::CHALLENGE };
        let heights: Vec<f64> = Modes::new(spectrum, 2, grid.ly).heights(grid, 0.0);
        let [a, b] =
            ["bvm", "fast"].map(|id| solve(&problem(grid, &heights), id, 0.02, |s| (s.energy, fraction(s, grid))));
        assert!((a.0 / b.0 - 1.0).abs() < 1e-9 && a.1 == b.1, "{nx} x {ny}: {a:?} {b:?}");
    }
}

/// A rough surface on the Lennard-Jones wall of the atoms, from first contact, where the wall has no force.
#[test]
fn methods_agree_on_a_soft_wall() {
    let (grid, heights) = rough(128, 1.0 / 24.0, 18);
    let wall = Wall::LennardJones(asperity::contact::interface::LennardJonesWall { strength: 20.0, sigma: 0.0143 });
    let p = ReducedProblem { wall, ..problem(grid, &heights) };
    let [a, others @ ..] = METHODS.map(|id| solve(&p, id, 0.02, |s| (s.energy, s.mean_gap)));
    for b in others {
        assert!((b.0 / a.0 - 1.0).abs() < 1e-7 && (b.1 - a.1).abs() < 1e-7, "{a:?} {others:?}");
    }
}

/// Quantities with full support on a method's card are provided, and every id is found.
#[test]
fn cards_agree_with_results() {
    use asperity::contact::method::{MethodKind, Quantity, Support};
    use asperity::methods::REGISTRY;
    let (grid, heights) = rough(128, 1.0 / 24.0, 18);
    // Estimators are tested in tests/program/methods.rs.
    for method in REGISTRY.iter().filter(|m| m.card().kind == MethodKind::Solver) {
        let card = method.card();
        assert!(std::ptr::eq(methods::find(card.id).unwrap().card(), card));
        // Support with or without a limitation.
        let delivers = |q: Quantity| !matches!((card.supports)(q), Support::No(_));
        solve(&problem(grid, &heights), card.id, 0.02, |s| {
            assert_eq!(delivers(Quantity::GapMap), s.gap.len() == grid.points());
            assert_eq!(delivers(Quantity::StressMap), s.stress.len() == grid.points());
            assert_eq!(delivers(Quantity::ContactMap) && delivers(Quantity::ContactArea), fraction(s, grid).0 > 0.0);
            assert_eq!(delivers(Quantity::MeanGap), s.mean_gap > 0.0);
            let map = contact_map(s.gap, 0.0);
            assert_eq!(
                delivers(Quantity::ClusterPdf),
                !cluster_sizes(&map, grid.nx, Connectivity::Eight, true).is_empty()
            );
            let gaps = gap_distribution(s.gap, 0.0, linear_edges(0.0, 1.0, 50));
            assert_eq!(delivers(Quantity::GapPdf), (gaps.total() - 1.0).abs() < 1e-12);
            let stresses = stress_distribution(s.gap, s.stress, (0.0, false), linear_edges(0.0, 5.0, 50));
            assert_eq!(delivers(Quantity::StressPdf), (stresses.all.total() - 1.0).abs() < 1e-12);
            let stiffness = method::contact_stiffness(&problem(grid, &heights), s).unwrap();
            assert_eq!(delivers(Quantity::Stiffness), stiffness.is_some_and(|k| k > 0.0));
        });
    }
}

/// Comparison with the direct sum over modes and points.
#[test]
fn elastic_stress_equals_the_direct_sum() {
    let grid = Grid { nx: 6, ny: 5, lx: 1.0, ly: 0.7 };
    let heights: Vec<f64> = (0..30).map(|i| f64::from((i * 7) % 11) * 0.01).collect();
    let p = problem(grid, &heights);
    solve(&p, "bvm", 50.0, |state| {
        for y in 0..grid.ny {
            for x in 0..grid.nx {
                let mut exact = 50.0;
                for ky in -2..=2i32 {
                    for kx in -2..=3i32 {
                        let (qx, qy) = (2.0 * PI * f64::from(kx), 2.0 * PI / 0.7 * f64::from(ky));
                        for (i, h) in heights.iter().enumerate() {
                            let phase =
                                qx * (x as f64 - (i % 6) as f64) / 6.0 + qy * 0.7 * (y as f64 - (i / 6) as f64) / 5.0;
                            exact -= 0.5 * qx.hypot(qy) * h * phase.cos() / 30.0;
                        }
                    }
                }
                assert!((state.stress.at(y * 6 + x) - exact).abs() < 1e-11);
            }
        }
    });
}

/// γ = 0 is bit-identical to no adhesion.
#[test]
fn no_work_of_adhesion_is_no_adhesion() {
    let (grid, heights) = rough(144, 1.0 / 16.0, 5);
    for id in METHODS {
        let with = ReducedProblem { adhesion: AttractionLaw::exponential(0.0, 1e-3), ..problem(grid, &heights) };
        let bits =
            |p: &ReducedProblem| solve(p, id, 0.02, |s| s.gap.to_vec().iter().map(|g| g.to_bits()).collect::<Vec<_>>());
        assert_eq!(bits(&with), bits(&problem(grid, &heights)));
    }
}

/// Results are bit-identical on one and two threads.
#[test]
fn threads_do_not_change_bits() {
    let (grid, heights) = rough(144, 1.0 / 16.0, 5);
    for id in METHODS {
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                solve(&problem(grid, &heights), id, 0.02, |s| (s.gap.to_vec(), s.energy.to_bits(), s.iterations))
            })
        };
        assert_eq!(on(1), on(2));
    }
}

/// Invariance to an offset, transposition, and the change of units (h, ρ, γ, E*) → (h/2, ρ/2, γ/2, 2E*).
#[test]
fn results_are_invariant_to_offset_transposition_and_units() {
    let (grid, heights) = rough(64, 1.0 / 16.0, 9);
    let gamma: f64 = 1e-3;
    let rho = 2.0 * (gamma / 64.0).sqrt();
    let base = ReducedProblem { adhesion: AttractionLaw::exponential(gamma, rho), ..problem(grid, &heights) };
    let (gap, area) = solve(&base, "bvm", 0.02, |s| (s.mean_gap, fraction(s, grid).0));
    let offset: Vec<f64> = heights.iter().map(|h| h + 1e4).collect();
    let transposed: Vec<f64> = (0..64 * 64).map(|i| heights[(i % 64) * 64 + i / 64]).collect();
    for (name, h, tolerance) in [("offset", &offset, 1e-7), ("transposed", &transposed, 1e-9)] {
        let p = ReducedProblem { heights: h.into(), ..base.clone() };
        let (g, a) = solve(&p, "bvm", 0.02, |s| (s.mean_gap, fraction(s, grid).0));
        assert!((g / gap - 1.0).abs() < tolerance && a == area, "{name}: {g} {gap}, {a} {area}");
    }
    // In units of 2E*: heights, range and gap halve, γ/(E*L) is a quarter, the pressure over E* halves.
    let half: Vec<f64> = heights.iter().map(|h| 0.5 * h).collect();
    let p = ReducedProblem {
        heights: (&half).into(),
        adhesion: AttractionLaw::exponential(gamma / 4.0, rho / 2.0),
        ..base.clone()
    };
    let (g, a) = solve(&p, "bvm", 0.01, |s| (s.mean_gap, fraction(s, grid).0));
    assert!((2.0 * g / gap - 1.0).abs() < 1e-8 && a == area, "{g} {gap}");
}

/// Adhesion adds a negative term, so that the minimum energy with adhesion is below that without. If the grid does not
/// resolve the range (ρ/√(γ dx) = 0.1) there are many equilibria; a method must not end in one above that bound.
#[test]
fn unresolved_adhesion_lowers_the_energy() {
    let (grid, heights) = rough(128, 1.0 / 32.0, 18);
    let gamma: f64 = 2e-4;
    let adhesion = AttractionLaw::exponential(gamma, 0.1 * (gamma / 128.0).sqrt());
    let plain = solve(&problem(grid, &heights), "bvm", 0.003, |s| s.energy);
    for id in METHODS {
        let adhesive = ReducedProblem { adhesion, ..problem(grid, &heights) };
        let energy = solve(&adhesive, id, 0.003, |s| s.energy);
        assert!(energy < plain, "{id}: {energy} with, {plain} without");
    }
}

/// A range far above the roughness is a uniform attraction (DMT): the area is that at the correspondingly larger
/// pressure.
#[test]
fn long_range_adhesion_adds_to_the_pressure() {
    let (grid, heights) = rough(64, 1.0 / 16.0, 4);
    let (gamma, rho) = (50.0, 5000.0);
    let adhesive = ReducedProblem { adhesion: AttractionLaw::exponential(gamma, rho), ..problem(grid, &heights) };
    let (area, stress) = solve(&adhesive, "bvm", 0.01, |s| (fraction(s, grid).0, s.interaction_energy));
    let plain = solve(&problem(grid, &heights), "bvm", 0.01 - stress / rho, |s| fraction(s, grid).0);
    assert_eq!(area, plain);
}

/// Accuracy of f32 fields with f64 sums.
#[test]
fn single_precision() {
    let (grid, heights) = rough(256, 1.0 / 64.0, 18);
    let double = solve(&problem(grid, &heights), "bvm", 0.02, |s| (s.mean_gap, fraction(s, grid).0));
    let p = ReducedProblem { precision: Precision::F32, tolerance: 1e-3, ..problem(grid, &heights) };
    for id in METHODS {
        let mut run = methods::find(id).unwrap().start(&p, &NoObserver).unwrap().solver().unwrap();
        let s = run.equilibrate(Load::Pressure(0.02)).unwrap();
        assert_eq!(s.stop, Stop::Converged);
        // At a residual of 1e-3 of the pressure. Measured: 3e-5, 4e-5, 2e-6; 0, 3e-4 and 1.9e-3 in area.
        assert!((s.mean_gap / double.0 - 1.0).abs() < 6e-5, "{id}: {} {}", s.mean_gap, double.0);
        assert!((fraction(&s, grid).0 / double.1 - 1.0).abs() < 2e-3);
    }
}

/// On a flat surface the gap is that at which the pressure of the wall equals the load.
#[test]
fn soft_wall_on_a_flat_surface() {
    use asperity::contact::interface::{Law, LennardJonesWall};
    let wall = LennardJonesWall { strength: 400.0, sigma: 0.015 };
    let grid = Grid::unit(8, 8);
    let heights = vec![0.3; 64];
    for id in METHODS {
        let p = ReducedProblem { wall: Wall::LennardJones(wall), ..problem(grid, &heights) };
        solve(&p, id, 0.2, |s| assert!((-wall.traction(s.mean_gap) / 0.2 - 1.0).abs() < 1e-8, "{id} {}", s.mean_gap));
    }
}

/// Odd and prime grids, lines and single points.
#[test]
fn any_grid_size_is_solved() {
    for (nx, ny) in [(1, 1), (2, 1), (1, 9), (3, 5), (17, 31), (15, 16)] {
        let grid = Grid::unit(nx, ny);
        let heights: Vec<f64> = (0..nx * ny).map(|i| ((i * 37) % 11) as f64 * 1e-3).collect();
        for id in METHODS {
            solve(&problem(grid, &heights), id, 0.01, |s| {
                assert!(s.gap.to_vec().iter().all(|g| g.is_finite() && *g >= 0.0));
                assert!(fraction(s, grid).0 > 0.0);
            });
        }
    }
}

/// Heights as a Fourier series and on nodes give the same result, also if the grid resolves only part of the series.
#[test]
fn heights_as_a_series() {
    let spectrum = Spectrum { lambda_s: 1.0 / 24.0, ..Spectrum::CHALLENGE };
    let modes = Modes::new(spectrum, 7, 1.0);
    let series = modes.series();
    for n in [144, 40] {
        let grid = Grid::unit(n, n);
        let heights: Vec<f64> = modes.heights(grid, 0.0);
        for id in METHODS {
            let nodes = problem(grid, &heights);
            let waves = ReducedProblem { heights: Heights::Series(series), ..nodes.clone() };
            let [a, b] = [&nodes, &waves].map(|p| solve(p, id, 0.02, |s| (s.energy, s.mean_gap, fraction(s, grid).0)));
            assert!(
                (a.0 / b.0 - 1.0).abs() < 1e-9 && (a.1 / b.1 - 1.0).abs() < 1e-9 && a.2 == b.2,
                "{id}: {a:?} {b:?}"
            );
        }
    }
}

/// Imposing the mean gap at a pressure returns that pressure; with adhesion also for states that are unstable under a
/// pressure.
#[test]
fn mean_gap_control_inverts_load_control() {
    let (grid, heights) = rough(144, 1.0 / 16.0, 5);
    let gamma: f64 = 2.7e-4;
    let adhesion = AttractionLaw::exponential(gamma, 1.4 * (gamma / 144.0).sqrt());
    for adhesion in [AttractionLaw::None, adhesion] {
        let p = ReducedProblem { adhesion, ..problem(grid, &heights) };
        let (gap, energy) = solve(&p, "fast", 0.02, |s| (s.mean_gap, s.energy));
        let mut run = methods::find("fast").unwrap().start(&p, &NoObserver).unwrap().solver().unwrap();
        let state = run.equilibrate(Load::MeanGap(gap)).unwrap();
        assert_eq!(state.stop, Stop::Converged);
        assert!((state.mean_gap / gap - 1.0).abs() < 1e-8, "{adhesion}: {}", state.mean_gap / gap - 1.0);
        assert!((state.pressure / 0.02 - 1.0).abs() < 1e-6, "{adhesion}: {}", state.pressure);
        assert!((state.energy / energy - 1.0).abs() < 1e-7);
        // Residuals of the returned state at its pressure; the force of the constraint counts once.
        assert!(state.load_error < LOAD_BALANCE && state.residual <= p.tolerance, "{}", state.load_error);
        let mean = (0..state.stress.len()).map(|i| state.stress.at(i)).sum::<f64>() / state.stress.len() as f64;
        if adhesion == AttractionLaw::None {
            assert!((mean / state.pressure - 1.0).abs() < LOAD_BALANCE, "{mean} {}", state.pressure);
        }
        // Beyond the range of all forces the pressure is zero.
        let apart = run.equilibrate(Load::MeanGap(1.0)).unwrap();
        assert!(apart.stop == Stop::Converged && apart.pressure.abs() < 1e-9, "{}, {}", apart.stop, apart.pressure);
        // Without adhesion no solve is needed for that.
        if adhesion == AttractionLaw::None {
            assert!((apart.pressure, apart.iterations) == (0.0, 0) && (apart.mean_gap - 1.0).abs() < LOAD_BALANCE);
        }
        for id in ["gfmd", "bvm"] {
            let unavailable_reason = methods::find(id)
                .unwrap()
                .start(&p, &NoObserver)
                .unwrap()
                .solver()
                .unwrap()
                .equilibrate(Load::MeanGap(gap))
                .err();
            assert!(unavailable_reason.unwrap().to_string().contains("mean gap"));
        }
    }
}

/// Zero pressure gives first contact and tension separates the surfaces; with adhesion only above the pull-off stress.
#[test]
fn excessive_tension_separates_the_surfaces() {
    let (grid, heights) = rough(128, 1.0 / 16.0, 5);
    let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
    let p = problem(grid, &heights);
    let mut run = methods::find("fast").unwrap().start(&p, &NoObserver).unwrap().solver().unwrap();
    let touching = run.equilibrate(Load::Pressure(0.0)).unwrap();
    assert_eq!((touching.stop, fraction(&touching, grid).0 > 0.0), (Stop::Converged, true));
    assert!((touching.mean_gap + lowest - asperity::grid::mean(&heights)).abs() < 1e-12);
    let apart = touching.mean_gap;
    assert_eq!(run.equilibrate(Load::Pressure(-1e-3)).unwrap().stop, Stop::Detached);
    // No pressure at mean gaps above that of first contact; positive pressure slightly below.
    for precision in [Precision::F64, Precision::F32] {
        let p = ReducedProblem { precision, tolerance: 1e-3, ..p.clone() };
        let mut run = methods::find("fast").unwrap().start(&p, &NoObserver).unwrap().solver().unwrap();
        let mut pressure = |share: f64| run.equilibrate(Load::MeanGap(share * apart)).unwrap().pressure;
        assert_eq!([1.0001, 2.0].map(&mut pressure), [0.0, 0.0]);
        assert!(pressure(0.9) > 0.0);
    }
    let gamma: f64 = 2.7e-4;
    let p = ReducedProblem { adhesion: AttractionLaw::exponential(gamma, 1.4 * (gamma / 128.0).sqrt()), ..p };
    let mut run = methods::find("fast").unwrap().start(&p, &NoObserver).unwrap().solver().unwrap();
    assert_eq!(run.equilibrate(Load::Pressure(1e-3)).unwrap().stop, Stop::Converged);
    // Half the largest attraction of two flat surfaces, far above that of rough ones.
    assert_eq!(run.equilibrate(Load::Pressure(-0.07)).unwrap().stop, Stop::Detached);
}

/// A gap that was set is the start of the next load; at its own load the solve converges at once.
#[test]
fn solve_starts_from_an_initial_gap() {
    let (grid, heights) = rough(128, 1.0 / 16.0, 5);
    let gamma: f64 = 2.7e-4;
    let p = ReducedProblem {
        adhesion: AttractionLaw::exponential(gamma, 1.4 * (gamma / 128.0).sqrt()),
        tolerance: 1e-8,
        ..problem(grid, &heights)
    };
    for id in METHODS {
        let (gap, first) = solve(&p, id, 0.02, |s| (s.gap.to_vec(), s.iterations));
        let mut run = methods::find(id).unwrap().start(&p, &NoObserver).unwrap().solver().unwrap();
        run.set_gap(&gap);
        let state = run.equilibrate(Load::Pressure(0.02)).unwrap();
        assert!(state.stop == Stop::Converged && state.iterations * 5 < first, "{id}: {} {first}", state.iterations);
    }
}

/// Full contact starts at the pressure that cancels the largest tension of the conforming displacement: πE*A/λ for a
/// wave of amplitude A and wavelength λ (Westergaard). On a rough surface the solver is in full contact above it and
/// not below.
#[test]
fn full_contact_begins_at_its_pressure() {
    /// Rounding of one transform.
    const EXACT: f64 = 1e-12;
    let amplitude = 0.01;
    let wave = |k: f64| -> Vec<f64> {
        (0..64).map(|i| amplitude * (1.0 - (2.0 * PI * k * f64::from(i) / 64.0).cos())).collect()
    };
    let line = Grid { nx: 64, ny: 1, lx: 1.0, ly: 1.0 / 64.0 };
    for k in [1.0, 4.0] {
        let heights = wave(k);
        let found = ReducedProblem::new(line, &heights).full_contact_pressure();
        assert!((found / (PI * amplitude * k) - 1.0).abs() < EXACT, "{found}");
    }
    let (grid, heights) = rough(64, 1.0 / 16.0, 3);
    let problem = ReducedProblem::new(grid, &heights);
    let full = problem.full_contact_pressure();
    let mut run = methods::find("fast").unwrap().start(&problem, &NoObserver).unwrap().solver().unwrap();
    for (share, all) in [(1.001, true), (0.99, false)] {
        let state = run.equilibrate(Load::Pressure(share * full)).unwrap();
        assert_eq!(state.stop, Stop::Converged);
        assert_eq!(contact_area(grid, state.gap, ContactEdges::COUNTED).contact_nodes == 1.0, all, "{share}");
    }
    let refused = run.equilibrate(Load::MeanGap(0.0)).map(|s| s.stop).expect_err("refused").to_string();
    assert!(refused.contains("only under an imposed pressure"), "{refused}");
}
