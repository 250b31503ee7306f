//! Solvers at extreme adhesion: ranges from a thousandth of the mesh size to a million times it, sixteen times the
//! challenge's work of adhesion, tension up to and beyond pull-off.
//!
//! `evidence/extremes.md` lists all cases and their results.

use crate::found::{near, path, problem, rough, solved};
use crate::variants::{METHODS, PRECISIONS, in_precision};
use asperity::contact::interface::{AttractionLaw, Base, COHESIVE_RESOLUTION, Elastic, Layer, PenaltyWall, Wall};
use asperity::contact::method::{Load, NoObserver, Precision, ReducedProblem, Stop};
use asperity::grid::{Grid, lowest};
use asperity::methods;
use asperity::surface::Spectrum;
use std::f64::consts::PI;

/// The challenge's adhesion for a surface of curvature radius R: γ = E* R/30, ρ = 0.0345 R.
fn of_the_challenge(radius: f64, times: f64) -> AttractionLaw {
    AttractionLaw::exponential(times * radius / 30.0, 0.0345 * radius)
}

fn radius(lambda_s: f64) -> f64 {
    Spectrum { lambda_s, ..Spectrum::CHALLENGE }.expected(1.0, 0.0).curvature_radius
}

/// For any range each solve converges to finite values, with an energy below that without adhesion. A range far beyond
/// the roughness gives the contact at the larger pressure p + (γ/ρ)⟨exp(-g/ρ)⟩ (Derjaguin, Muller & Toporov).
#[test]
fn ranges_from_far_below_a_pixel_to_far_above_the_roughness() {
    let (lambda_s, load) = (1.0 / 16.0, 0.01);
    let (grid, heights) = rough(128, 128, lambda_s, 5);
    let dx = grid.dx();
    let p = problem(grid, &heights);
    let plain = solved(&p, "fast", load);
    for gamma in [1.0, 16.0].map(|times| times * radius(lambda_s) / 30.0) {
        for pixels in [1e-3, 1e-2, 0.1, 0.5, 1.4, 5.0, 30.0, 1e3, 1e6] {
            let adhesion = AttractionLaw::exponential(gamma, pixels * dx);
            let resolution = adhesion.resolution_on(dx).expect("an adhesive law");
            assert!(near(resolution, pixels * (dx / gamma).sqrt(), 1e-12), "{resolution}");
            let adhesive = ReducedProblem { adhesion, ..p.clone() };
            let [double, _] = PRECISIONS.map(|precision| {
                let found = solved(&in_precision(&adhesive, precision), "fast", load);
                assert!(found.energy < plain.energy && found.area >= plain.area, "{adhesion}");
                found
            });
            if pixels == 1e6 {
                let pressed = solved(&p, "fast", load - double.interaction / (pixels * dx));
                assert_eq!(double.area, pressed.area, "{adhesion}");
            }
        }
    }
}

/// Behind a penalty wall that is up to 35 times as stiff as the stiffest wave `fast` has energy, area and mean gap of `bvm`; on a thin
/// incompressible layer the longest wave is the stiffest.
#[test]
fn adhesion_behind_stiff_walls() {
    /// Relative difference of the energies, and difference of the mean gaps over L, at residuals of 1e-8 of the pressure.
    const SAME_ENERGY: f64 = 1e-8;
    const SAME_GAP: f64 = 1e-8;
    let (grid, heights) = rough(128, 128, 1.0 / 24.0, 18);
    let adhesion = AttractionLaw::exponential(2e-5, 1e-3);
    let thin = Elastic::Layer(Layer { thickness: 0.005, poisson: 0.5, base: Base::Bonded });
    // Transform pairs at most. On the half-space a preconditioner of the waves alone took 100, 302 and 804; measured: 80, 145 and 507, on
    // the layer 55 and 89.
    let half_space =
        [(1e-2, 90.0), (1e-3, 200.0), (1e-4, 650.0)].map(|(length, most)| (Elastic::HalfSpace, length, most));
    let layer = [(1e-2, 70.0), (1e-3, 110.0)].map(|(length, most)| (thin, length, most));
    for (kernel, length, most) in half_space.into_iter().chain(layer) {
        let wall = Wall::Penalty(PenaltyWall { length });
        let p = ReducedProblem { adhesion, wall, kernel, ..problem(grid, &heights) };
        let [fast, bvm] = ["fast", "bvm"].map(|id| solved(&p, id, 0.02));
        assert!(near(fast.energy, bvm.energy, SAME_ENERGY) && fast.area == bvm.area, "{kernel}, ℓ = {length}");
        assert!((fast.mean_gap - bvm.mean_gap).abs() < SAME_GAP * grid.lx, "{kernel}, ℓ = {length}");
        assert!(fast.fft_pairs <= most, "{kernel}, ℓ = {length}: {}", fast.fft_pairs);
    }
}

/// Sixteen times the challenge's work of adhesion on grids that do not resolve it: nearly the whole surface is in
/// contact at any load, and every solve converges.
#[test]
fn sixteenfold_adhesion_unresolved() {
    let lambda_s = 1.0 / 16.0;
    for n in [64, 128, 256] {
        let (grid, heights) = rough(n, n, lambda_s, 5);
        for times in [1.0, 16.0] {
            let adhesion = of_the_challenge(radius(lambda_s), times);
            assert!(adhesion.resolution_on(grid.dx()).expect("adhesive") < COHESIVE_RESOLUTION);
            for load in [0.0, 0.01, 0.1] {
                let found = solved(&ReducedProblem { adhesion, ..problem(grid, &heights) }, "fast", load);
                assert!(found.area > 0.0 && lowest(&found.stress) < 0.0, "{n}, {times}, {load}");
                if times == 16.0 && load > 0.0 {
                    assert!(found.area > 0.85, "{n}, {load}: {}", found.area);
                }
            }
        }
    }
}

/// The same work of adhesion on lines that resolve it: the methods agree, and so do two grids.
#[test]
fn sixteenfold_adhesion_resolved() {
    /// Relative difference of energies on meshes of size dx and dx/2, where contact lines move by one node.
    const MESHES: f64 = 1e-3;
    let profile = |n: usize| -> (Grid, Vec<f64>) {
        let x = |i: usize| 2.0 * PI * i as f64 / n as f64;
        let wave = |i: usize| 0.1 * ((x(i)).cos() + 0.3 * (2.0 * x(i) + 1.0).cos() + 0.1 * (5.0 * x(i) + 2.0).cos());
        (Grid { nx: n, ny: 1, lx: 1.0, ly: 1.0 / n as f64 }, (0..n).map(wave).collect())
    };
    // rms curvature of the three waves.
    let curvature = 0.1 * (2.0 * PI).powi(2) * ((1.0 + 1.2f64.powi(2) + 2.5f64.powi(2)) / 2.0).sqrt();
    for times in [1.0, 16.0] {
        let adhesion = of_the_challenge(curvature.recip(), times);
        let energies = [8192, 16_384].map(|n| {
            let (grid, heights) = profile(n);
            let resolution = adhesion.resolution_on(grid.dx()).expect("adhesive");
            assert!(resolution > COHESIVE_RESOLUTION, "{times}: {resolution}");
            let p = ReducedProblem { adhesion, ..problem(grid, &heights) };
            let fast = solved(&p, "fast", 0.05).energy;
            if n == 8192 {
                let bvm = solved(&p, "bvm", 0.05).energy;
                assert!(near(fast, bvm, 1e-6), "{times}: {fast} {bvm}");
            }
            fast
        });
        assert!(near(energies[0], energies[1], MESHES), "{times}: {energies:?}");
    }
}

/// Mean gaps near separation, where stresses vanish: the pressure balances the fields to a tenth of the tolerance,
/// although the spring that imposes the gap multiplies the rounding error of its mean (up to 1.5 of the tolerance).
#[test]
fn imposed_mean_gaps_near_separation_balance_the_load() {
    /// A tenth of the tolerance of the load balance, and 10 % for another order of the sums.
    const BALANCE: f64 = 1.1e-10;
    let (grid, heights) = rough(512, 512, Spectrum::CHALLENGE.lambda_s, 4);
    let p = ReducedProblem { adhesion: AttractionLaw::exponential(2e-5, 2.767e-4), ..problem(grid, &heights) };
    let mut run = methods::find("fast").unwrap().start(&p, &NoObserver).unwrap().solver().unwrap();
    for i in 0..12 {
        let target = 0.0287 + 1e-4 * f64::from(i);
        let state = run.equilibrate(Load::MeanGap(target)).expect("a mean gap");
        let miss = (state.mean_gap - target).abs() / target;
        assert_eq!(state.stop, Stop::Converged, "{target}");
        assert!(state.load_error <= miss.max(BALANCE), "{target}: {}, {miss}", state.load_error);
    }
}

/// A sphere from the DMT to the JKR limit, during loading, unloading and beyond pull-off.
#[test]
fn tabor_numbers_from_a_hundredth_to_ten() {
    let (n, r, gamma) = (96, 1.0, 2e-4);
    let grid = Grid::unit(n, n);
    let from_middle = |i: usize| i as f64 / n as f64 - 0.5;
    let heights: Vec<f64> =
        (0..n * n).map(|i| (from_middle(i % n).powi(2) + from_middle(i / n).powi(2)) / (2.0 * r)).collect();
    let unit = PI * gamma * r;
    for tabor in [0.01, 0.1, 1.0, 3.0, 10.0] {
        let adhesion = AttractionLaw::exponential(gamma, (r * gamma * gamma).cbrt() / tabor);
        let resolution = adhesion.resolution_on(grid.dx()).expect("adhesive");
        // A tension above the strength γ/ρ of the law over the whole cell.
        let beyond = 1.01 * gamma / adhesion.range() + 2.5 * unit;
        for precision in PRECISIONS {
            let p = in_precision(&ReducedProblem { adhesion, ..problem(grid, &heights) }, precision);
            let found = path(&p, "fast", &[1e-3, 0.0, -0.5 * unit, -2.5 * unit, -beyond]);
            for (i, state) in found[..3].iter().enumerate() {
                // In f32 the small loads may stop at the rounding floor, which does not count as convergence.
                let single = precision == Precision::F32 && state.stop == Stop::RoundingFloor;
                assert!(state.stop == Stop::Converged || single, "{tabor}, {i}: {:?}", state.stop);
                assert!(state.area > 0.0 && lowest(&state.stress) < 0.0 && state.is_finite(), "{tabor}, {i}");
            }
            assert!(found[1].area >= found[2].area && found[0].area >= found[1].area, "{tabor}");
            // JKR: 1.5 units, DMT: 2. A grid that does not resolve the range pins the contact line beyond both.
            if resolution > COHESIVE_RESOLUTION {
                assert_eq!(found[3].stop, Stop::Detached, "{tabor} {precision:?}");
            }
            assert_eq!(found[4].stop, Stop::Detached, "{tabor} {precision:?}");
        }
    }
}

/// A tension above pull-off ends soon as detached, with every method; pressing again restores the contact.
#[test]
fn pulls_beyond_pull_off_are_detached() {
    /// Iterations; `gfmd`, the slowest method, takes 400.
    const SOON: usize = 2000;
    let (grid, heights) = rough(64, 64, 1.0 / 8.0, 5);
    let gamma: f64 = 1e-2;
    let rho = COHESIVE_RESOLUTION * (gamma * grid.dx()).sqrt();
    for (id, precision) in METHODS.into_iter().flat_map(|id| PRECISIONS.map(|p| (id, p))) {
        let adhesion = AttractionLaw::exponential(gamma, rho);
        let p = in_precision(&ReducedProblem { adhesion, ..problem(grid, &heights) }, precision);
        let strength = gamma / rho;
        let found = path(&p, id, &[0.02, -0.1 * strength, -0.5 * strength, -100.0 * strength, 0.02]);
        let stops: Vec<Stop> = found.iter().map(|f| f.stop).collect();
        use Stop::{Converged, Detached};
        assert_eq!(stops, [Converged, Converged, Detached, Detached, Converged], "{id} {precision:?}");
        assert!(found.iter().all(|f| f.is_finite() && f.iterations < SOON), "{id} {precision:?}");
        assert!(near(found[4].area, found[0].area, 1e-3), "{id}: {} {}", found[4].area, found[0].area);
    }
    // Without adhesion, with a compliant wall as well, a tension is detached at once or refused.
    for wall in [Wall::Hard, Wall::Penalty(PenaltyWall { length: 1e-2 })] {
        let p = ReducedProblem { wall, ..problem(grid, &heights) };
        let parted = path(&p, "fast", &[-1e-6, -1.0]);
        assert!(parted.iter().all(|f| f.stop == Stop::Detached && f.iterations == 0), "{wall}");
        for id in ["gfmd", "bvm"] {
            for pull in [-1e-6, 0.0] {
                let mut run = methods::find(id).unwrap().start(&p, &NoObserver).unwrap().solver().unwrap();
                let unavailable_reason = run.equilibrate(Load::Pressure(pull)).err().unwrap().to_string();
                assert!(
                    unavailable_reason.contains("without adhesion no tension"),
                    "{id}, {wall}: {unavailable_reason}"
                );
            }
        }
    }
}

/// A wave stays in full contact, bit by bit, until the lowest stress is -γ/ρ; there it opens, and separates soon after.
#[test]
fn full_contact_opens_at_the_strength_of_the_law() {
    /// Distance of the tested pressures from the opening pressure, over the strength.
    const SIDE: f64 = 1e-4;
    let n = 64;
    let grid = Grid::unit(n, n);
    let amplitude = 1e-4;
    let wave = |i: usize| (2.0 * PI * i as f64 / n as f64).cos();
    let heights: Vec<f64> = (0..n * n).map(|i| amplitude * wave(i % n) * wave(i / n)).collect();
    let (gamma, rho) = (1e-5, 1e-3);
    let strength = gamma / rho;
    // p - K h with the stiffness √2 π of the wave.
    let opening = 2f64.sqrt() * PI * amplitude - strength;
    let p = ReducedProblem { adhesion: AttractionLaw::exponential(gamma, rho), ..problem(grid, &heights) };
    for id in METHODS {
        let held = [0.05, 1e-3, 0.0, 0.5 * opening, opening + SIDE * strength];
        let found = path(&p, id, &[&held[..], &[opening - SIDE * strength, opening - 0.05 * strength]].concat());
        for (state, load) in found.iter().zip(held) {
            assert_eq!((state.stop, state.area, state.mean_gap), (Stop::Converged, 1.0, 0.0), "{id} at {load}");
            let least = load - (opening + strength);
            assert!((lowest(&state.stress) - least).abs() < 1e-12, "{id} at {load}: {}", lowest(&state.stress));
        }
        let open = &found[held.len()];
        assert!(open.stop == Stop::Converged && (0.99..1.0).contains(&open.area), "{id}: {}", open.area);
        assert_eq!(found[held.len() + 1].stop, Stop::Detached, "{id}");
    }
}
