//! Second solvers of the fields against the first ones, and what the challenge's paper says of them.

mod common {
    pub mod found;
}

use asperity::interface::Adhesion;
use asperity::method::Problem;
use common::found::{Found, near, path, problem, rough, solved};

/// Load balance that every converged state keeps.
const LOAD_BALANCE: f64 = 1e-9;

/// rms difference of two fields.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
}

fn balanced(found: &Found, pressure: f64, what: &str) {
    let mean = found.stress.iter().sum::<f64>() / found.stress.len() as f64;
    assert!((mean / pressure - 1.0).abs() < LOAD_BALANCE, "{what}: mean stress {mean} under {pressure}");
}

/// An adhesion that the grid carries without pinning: ρ/√(γ dx) = 1.4.
fn resolved(gamma: f64, n: usize) -> Adhesion {
    Adhesion::exponential(gamma, 1.4 * (gamma / n as f64).sqrt())
}

/// Nothing in common but the equations: transform, sums and minimiser are two. Both are converged to 1e-9 of the pressure.
#[test]
fn the_second_gfmd_agrees_with_bvm() {
    const ENERGY: f64 = 1e-8;
    const GAP: f64 = 1e-7;
    let (grid, heights) = rough(256, 256, 1.0 / 32.0, 18);
    let scale = asperity::grid::rms(&heights);
    for adhesion in [Adhesion::None, resolved(2.7e-4, 256)] {
        let p = Problem { adhesion, tolerance: 1e-9, ..problem(grid, &heights) };
        for pressure in [0.01, 0.05] {
            let [a, b] = ["bvm", "gfmd-fire"].map(|id| solved(&p, id, pressure));
            balanced(&b, pressure, "gfmd-fire");
            let gap = apart(&a.gap, &b.gap) / scale;
            let stress = apart(&a.stress, &b.stress) / pressure;
            println!(
                "{adhesion} {pressure}: energy {:e}, gap {gap:e}, stress {stress:e}, steps {} {}",
                b.energy / a.energy - 1.0,
                a.iterations,
                b.iterations
            );
            assert!(near(b.energy, a.energy, ENERGY), "{adhesion}: {} {}", b.energy, a.energy);
            assert!(gap < GAP && stress < 1e-7 && a.area == b.area, "{adhesion}: {gap} {stress}");
        }
    }
    let _ = path;
}
