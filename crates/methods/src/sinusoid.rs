//! Contact with a two-dimensional sinusoid D cos(kx) cos(ky), without adhesion: area and mean gap from first to full
//! contact. Both limits are known in closed form (Hertz; penny-shaped gaps, after Johnson, Greenwood & Higginson,
//! Int. J. Mech. Sci. 27 (1985) 383); between them a table of solved states is interpolated, which the ignored test
//! below prints.
//!
//! Pressures are relative to that of full contact, √2 π E* D/λ, E* times the rms gradient. The common fit (Jackson &
//! Streator, Wear 261 (2006) 1337) deviates by up to 10 %.

/// Cube root of the pressure; contact area over the pressure to 2/3; mean gap over D and over (1 - pressure)^(5/2).
/// Solved by `fast` on 640² nodes per summit; means over three offsets of the nodes, areas without the excess at edges.
#[rustfmt::skip]
const TABLE: [[f64; 3]; 20] = [
    [0.00, FIRST_AREA, 1.0],
    [0.10, 0.76479, 0.95851],
    [0.15, 0.77208, 0.91353],
    [0.20, 0.78036, 0.85790],
    [0.25, 0.79195, 0.79504],
    [0.30, 0.80661, 0.72774],
    [0.35, 0.82465, 0.65825],
    [0.40, 0.84692, 0.58838],
    [0.45, 0.87505, 0.51970],
    [0.50, 0.91105, 0.45393],
    [0.55, 0.95980, 0.39363],
    [0.60, 1.03896, 0.34420],
    [0.65, 1.13782, 0.31411],
    [0.70, 1.14963, 0.29087],
    [0.75, 1.13726, 0.27073],
    [0.80, 1.11459, 0.25286],
    [0.85, 1.08730, 0.23685],
    [0.90, 1.05825, 0.22248],
    [0.95, 1.02885, 0.20966],
    [1.00, 1.0, LAST_GAP],
];

/// π (3/8π)^(2/3): two Hertz contacts in λ², each of curvature D k².
const FIRST_AREA: f64 = 0.761618473172;

/// 32√2·3^(5/2)/(360 π²): two penny-shaped gaps in λ² with zero stress intensity at their edges.
const LAST_GAP: f64 = 0.198548160047;

/// (9π⁴/8)^(1/3): approach of Hertz contacts over D and the pressure to the power 2/3.
const FIRST_DENT: f64 = 4.785390000314;

/// Contact fraction at a pressure over that of full contact.
pub(super) fn contact_area(pressure: f64) -> f64 {
    if pressure >= 1.0 {
        return 1.0;
    }
    let t = pressure.cbrt();
    (between(t, 1) * t * t).min(1.0)
}

/// Mean gap over D at a pressure over that of full contact.
pub(super) fn mean_gap(pressure: f64) -> f64 {
    if pressure >= 1.0 {
        return 0.0;
    }
    let t = pressure.cbrt();
    let [end, _, value] = TABLE[1];
    let column = if t < end {
        // Hertz and a cubic term, mainly due to the periodic images, matched to the table.
        let cubic = (value - 1.0 + FIRST_DENT * end * end) / (end * end * end);
        1.0 - FIRST_DENT * t * t + cubic * t * t * t
    } else {
        between(t, 2)
    };
    column * (1.0 - pressure).powf(2.5)
}

/// Interpolates a column at a cube root of the pressure by monotone cubics (Fritsch & Carlson,
/// SIAM J. Numer. Anal. 17 (1980) 238, with weighted harmonic means of the slopes).
fn between(t: f64, column: usize) -> f64 {
    let last = TABLE.len() - 2;
    let k = TABLE[1..=last].partition_point(|row| row[0] <= t);
    let step = |k: usize| TABLE[k + 1][0] - TABLE[k][0];
    let rise = |k: usize| (TABLE[k + 1][column] - TABLE[k][column]) / step(k);
    let slope = |k: usize| {
        if k == 0 {
            // Areas have no linear term in t.
            return 0.0;
        }
        if k > last {
            return rise(last);
        }
        let (a, b) = (rise(k - 1), rise(k));
        if a * b <= 0.0 {
            return 0.0;
        }
        let (w, v) = (2.0 * step(k) + step(k - 1), step(k) + 2.0 * step(k - 1));
        (w + v) / (w / a + v / b)
    };
    let h = step(k);
    let s = (t - TABLE[k][0]) / h;
    let (a, b) = (TABLE[k][column], TABLE[k + 1][column]);
    let (da, db) = (slope(k) * h, slope(k + 1) * h);
    let chord = b - a;
    a + s * chord + s * (1.0 - s) * ((1.0 - s) * (da - chord) - s * (db - chord))
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_contact::method::{ContactMethod, Fast, Load, NoObserver, ReducedProblem, Stop};
    use asperity_contact::observe::{self, ContactEdges};
    use asperity_grid::Grid;
    use std::f64::consts::{PI, TAU};

    /// The limits in closed form, and monotony between them.
    #[test]
    fn limits_are_closed_forms_and_curves_are_monotone() {
        assert!((FIRST_AREA / (PI * (3.0 / (8.0 * PI)).powf(2.0 / 3.0)) - 1.0).abs() < 1e-9);
        assert!((LAST_GAP / (32.0 * 2f64.sqrt() * 3f64.powf(2.5) / (360.0 * PI * PI)) - 1.0).abs() < 1e-6);
        assert_eq!((contact_area(0.0), mean_gap(0.0), contact_area(1.0), mean_gap(1.0)), (0.0, 1.0, 1.0, 0.0));
        let states: Vec<_> =
            (0..=1000).map(|k| f64::from(k) / 1000.0).map(|x| (contact_area(x), mean_gap(x))).collect();
        assert!(states.windows(2).all(|w| w[0].0 < w[1].0 && w[0].1 > w[1].1));
    }

    /// Approach of Hertz contacts less that of their images: (9π⁴/8)^(1/3) x^(2/3) - 3.90026 x.
    #[test]
    fn first_contact_is_hertzian() {
        for x in [1e-6f64, 1e-5, 1e-4] {
            let exact = (9.0 * PI.powi(4) / 8.0f64).cbrt() * x.powf(2.0 / 3.0) - 3.90026 * x;
            assert!(((1.0 - mean_gap(x)) / exact - 1.0).abs() < 0.005, "{x}: {} {exact}", 1.0 - mean_gap(x));
            assert!((contact_area(x) / (FIRST_AREA * x.powf(2.0 / 3.0)) - 1.0).abs() < 0.01);
        }
    }

    /// Near full contact the open fraction is 3/(2π) of the missing pressure.
    #[test]
    fn last_gaps_are_penny_shaped() {
        let open = (1.0 - contact_area(0.97)) / 0.03;
        assert!((open / (1.5 / PI) - 1.0).abs() < 0.05, "{open}");
    }

    /// Pressure, contact fraction and mean gap over D from another solver, converged on 256² nodes per two summits:
    /// fractions to 1 %, gaps to 3e-4.
    #[test]
    fn table_agrees_with_another_solver() {
        const OTHER: [(f64, f64, f64); 12] = [
            (0.001, 0.0077, 0.9561),
            (0.01, 0.0361, 0.8183),
            (0.03, 0.0786, 0.66068),
            (0.1, 0.191, 0.38475),
            (0.2, 0.345, 0.2046),
            (0.3, 0.5155, 0.12488),
            (0.4, 0.6196, 0.07691),
            (0.5, 0.7046, 0.04508),
            (0.6, 0.7761, 0.02417),
            (0.7, 0.8395, 0.01113),
            (0.8, 0.8973, 0.00385),
            (0.95, 0.9756, 0.00011),
        ];
        for (x, fraction, gap) in OTHER {
            assert!((contact_area(x) / fraction - 1.0).abs() < 0.015, "{x}: {} {fraction}", contact_area(x));
            assert!((mean_gap(x) - gap).abs() < 5e-4, "{x}: {} {gap}", mean_gap(x));
        }
    }

    /// Contact fraction (perimeter-corrected) and mean gap over D.
    ///
    /// Rotated by 45° the wave is D/2 (cos + cos) in a cell of side λ/√2 with one summit; its full-contact pressure
    /// is π E* D over that side. The mean over a few offsets of the nodes hardly depends on the mesh.
    fn solved(n: usize, x: f64, offsets: &[f64]) -> (f64, f64) {
        const D: f64 = 0.02;
        let grid = Grid::unit(n, n);
        let mut sums = (0.0, 0.0);
        for offset in offsets {
            let wave = |i: usize| (TAU * (i as f64 + offset) / n as f64).cos();
            let heights: Vec<f64> = (0..n * n).map(|i| 0.5 * D * (wave(i % n) + wave(i / n))).collect();
            let problem = ReducedProblem { tolerance: 1e-9, ..ReducedProblem::new(grid, &heights) };
            let mut run = Fast.start(&problem, &NoObserver).unwrap().solver().unwrap();
            let state = run.equilibrate(Load::Pressure(x * PI * D)).unwrap();
            assert!(matches!(state.stop, Stop::Converged | Stop::RoundingFloor), "{x}: {}", state.stop);
            sums.0 += observe::contact_area(grid, state.gap, ContactEdges::ELASTIC).contact_area;
            sums.1 += state.mean_gap / D;
        }
        (sums.0 / offsets.len() as f64, sums.1 / offsets.len() as f64)
    }

    /// At points of the table and between them. The error on 160² nodes is 0.5 % of the area; interpolation adds up
    /// to 1.1 % where patches merge, at about t = 0.62.
    #[test]
    fn table_agrees_with_fast() {
        for t in [0.4f64, 0.575, 0.625, 0.7, 0.925] {
            let x = t.powi(3);
            let (area, gap) = solved(160, x, &[0.0, 0.21, 0.43]);
            assert!((contact_area(x) / area - 1.0).abs() < 0.015, "{t}: {} {area}", contact_area(x));
            assert!((mean_gap(x) - gap).abs() < 1e-3, "{t}: {} {gap}", mean_gap(x));
        }
    }

    /// Prints the table: `cargo test --lib method::sinusoid -- --ignored --nocapture`, half a minute.
    #[test]
    #[ignore = "prints the table"]
    fn print_table() {
        for k in 2..20 {
            let t = 0.05 * f64::from(k);
            let x = t * t * t;
            let (fraction, gap) = solved(640, x, &[0.0, 0.21, 0.43]);
            println!("    [{t:.2}, {:.5}, {:.5}],", fraction / x.powf(2.0 / 3.0), gap / (1.0 - x).powf(2.5));
        }
    }
}
