//! Contact spots of single asperities: Hertz and JKR in closed form, and their stress profiles on a grid. E* = 1.
//!
//! Hertz: K. L. Johnson, Contact Mechanics (1985), chapter 4. JKR: K. L. Johnson, K. Kendall & A. D. Roberts, Proc.
//! R. Soc. A 324 (1971) 301. Lengths in L, forces in E*·L².

use asperity_grid::Grid;
use std::f64::consts::PI;

/// Load of a Hertz contact of radius `a` on a summit of radius `r`: `4a³/3R`.
pub(super) fn hertz_load(a: f64, r: f64) -> f64 {
    4.0 / 3.0 * a.powi(3) / r
}

/// JKR with the work of adhesion `gamma`; Hertz for `gamma` = 0.
#[derive(Debug, Clone, Copy)]
pub(super) struct Jkr {
    pub gamma: f64,
}

impl Jkr {
    /// Tensile load of the flat punch that JKR superposes on Hertz, `√(8πγa³)`.
    pub(super) fn pull(&self, a: f64) -> f64 {
        (8.0 * PI * self.gamma * a.powi(3)).sqrt()
    }

    /// Load of a contact of radius `a`.
    pub(super) fn load(&self, a: f64, r: f64) -> f64 {
        hertz_load(a, r) - self.pull(a)
    }

    /// Approach `δ = a²/R - √(2πγa)`.
    pub(super) fn approach(&self, a: f64, r: f64) -> f64 {
        a * a / r - (2.0 * PI * self.gamma * a).sqrt()
    }

    /// Approach at pull-off under displacement control, `-(3/4)(π²γ²R)^(1/3)`.
    pub(super) fn least_approach(&self, r: f64) -> f64 {
        -0.75 * ((PI * self.gamma).powi(2) * r).cbrt()
    }

    /// Radius on the stable branch, the larger root of [`Jkr::approach`]; `None` below the least approach. The approach
    /// is convex in the radius, so Newton steps from above converge monotonically.
    pub(super) fn radius(&self, approach: f64, r: f64) -> Option<f64> {
        if approach < self.least_approach(r) || (self.gamma == 0.0 && approach <= 0.0) {
            return None;
        }
        let hertz = (r * approach.max(0.0)).sqrt();
        if self.gamma == 0.0 {
            return Some(hertz);
        }
        // An upper bound: each half of a²/R exceeds one of the other two terms.
        let smallest = (PI * self.gamma * r * r / 8.0).cbrt();
        let mut a = (2f64.sqrt() * hertz).max((8.0 * PI * self.gamma * r * r).cbrt());
        loop {
            let slope = 2.0 * a / r - (0.5 * PI * self.gamma / a).sqrt();
            let next = a - (self.approach(a, r) - approach) / slope;
            if next.is_nan() || next >= a || next <= smallest {
                return Some(if next <= smallest { smallest } else { a });
            }
            a = next;
        }
    }
}

/// A contact spot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spot {
    pub x: f64,
    pub y: f64,
    pub radius: f64,
    /// Load of the Hertz part, and tensile load of the punch.
    pub press: f64,
    pub pull: f64,
}

/// Samples per radius of the smallest spots, which may lie within one pixel.
const ACROSS: f64 = 8.0;

/// Lower bound of `1 - r²/a²` in the profile of the punch, which is singular at its edge.
const RIM: f64 = 1e-2;

/// Writes the stress of spots `[ny, nx]`: each profile is averaged over pixels and scaled to its load, so that the
/// mean is the pressure on any grid; overlapping profiles are added.
pub(super) fn paint(grid: Grid, spots: impl IntoIterator<Item = Spot>, stress: &mut Vec<f64>) {
    stress.clear();
    stress.resize(grid.points(), 0.0);
    let (dx, dy) = (grid.dx(), grid.dy());
    let mut nodes = Vec::new();
    for spot in spots {
        nodes.clear();
        let a = spot.radius;
        // Sub-samples of a pixel along each axis.
        let samples = (ACROSS * dx.max(dy) / a).ceil().clamp(1.0, 2.0 * ACROSS) as i64;
        let offset = |k: i64| (k as f64 + 0.5) / samples as f64 - 0.5;
        let (i0, j0) = ((spot.x / dx).round() as i64, (spot.y / dy).round() as i64);
        let (reach_x, reach_y) = ((a / dx).ceil() as i64 + 1, (a / dy).ceil() as i64 + 1);
        let mut sums = [0.0; 2];
        for j in j0 - reach_y..=j0 + reach_y {
            for i in i0 - reach_x..=i0 + reach_x {
                let mut weights = [0.0; 2];
                for s in 0..samples * samples {
                    let x = (i as f64 + offset(s % samples)) * dx - spot.x;
                    let y = (j as f64 + offset(s / samples)) * dy - spot.y;
                    let inside = 1.0 - (x * x + y * y) / (a * a);
                    if inside > 0.0 {
                        weights[0] += inside.sqrt();
                        weights[1] += inside.max(RIM).sqrt().recip();
                    }
                }
                if weights[0] > 0.0 {
                    sums[0] += weights[0];
                    sums[1] += weights[1];
                    nodes.push((i, j, weights));
                }
            }
        }
        if nodes.is_empty() {
            // The spot lies between all samples.
            nodes.push((i0, j0, [1.0; 2]));
            sums = [1.0; 2];
        }
        for &(i, j, [press, pull]) in &nodes {
            let node = (j.rem_euclid(grid.ny as i64) * grid.nx as i64 + i.rem_euclid(grid.nx as i64)) as usize;
            stress[node] += (spot.press * press / sums[0] - spot.pull * pull / sums[1]) / (dx * dy);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_grid::mean;

    /// Rounding of closed forms and of the last Newton step.
    const CLOSED: f64 = 1e-10;

    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() <= CLOSED * b.abs().max(1.0)
    }

    /// R = E* = γ = 1: radius and approach at zero load; pull-off under load control and under displacement control.
    #[test]
    fn jkr_closed_forms() {
        let jkr = Jkr { gamma: 1.0 };
        let free = (4.5 * PI).cbrt();
        assert!(near(jkr.load(free, 1.0), 0.0) && (free - 2.417_988).abs() < 1e-6);
        assert!((jkr.approach(free, 1.0) - 1.948_889).abs() < 1e-6);
        let soft = (9.0 * PI / 8.0).cbrt();
        assert!(near(jkr.load(soft, 1.0), -1.5 * PI) && (jkr.approach(soft, 1.0) + 0.773_417).abs() < 1e-6);
        let stiff = (PI / 8.0).cbrt();
        assert!(near(jkr.load(stiff, 1.0), -5.0 * PI / 6.0) && near(jkr.approach(stiff, 1.0), jkr.least_approach(1.0)));
        // Jump into contact at zero approach.
        assert!(near(jkr.radius(0.0, 1.0).unwrap(), (2.0 * PI).cbrt()));
        assert!(jkr.radius(1.000_1 * jkr.least_approach(1.0), 1.0).is_none());
    }

    /// The root inverts the closed form to ten digits for radii and works of many magnitudes, on the stable branch.
    #[test]
    fn radius_inverts_approach() {
        for gamma in [1e-9, 2e-5, 1.0] {
            let jkr = Jkr { gamma };
            for r in [1e-4, 1.0, 30.0] {
                let smallest = (PI * gamma * r * r / 8.0).cbrt();
                for k in 1..60 {
                    let a = smallest * (1.0 + 1e-2 * 1.2f64.powi(k));
                    let actual = jkr.radius(jkr.approach(a, r), r).unwrap();
                    assert!((actual / a - 1.0).abs() < CLOSED, "γ {gamma}, R {r}: {actual} {a}");
                }
            }
        }
        assert_eq!(Jkr { gamma: 0.0 }.radius(0.04, 0.25), Some(0.1));
        assert_eq!(Jkr { gamma: 0.0 }.radius(-1e-9, 0.25), None);
    }

    /// Painted spots carry their loads to rounding, across the cell boundary, within a pixel and over many; the
    /// profile is Hertz's.
    #[test]
    fn painted_spots_carry_their_loads() {
        let grid = Grid { nx: 64, ny: 48, lx: 1.0, ly: 0.7 };
        let mut stress = Vec::new();
        for radius in [1e-5, 0.004, 0.02, 0.2] {
            let spot = Spot { x: 0.999, y: 0.0031, radius, press: 3.0, pull: 0.5 };
            paint(grid, [spot, Spot { x: 0.3, ..spot }], &mut stress);
            assert!((mean(&stress) * 0.7 - 5.0).abs() < 1e-12, "{radius}");
        }
        let spot = Spot { x: 0.5, y: 24.0 * grid.dy(), radius: 0.2, press: 1.0, pull: 0.0 };
        paint(grid, [spot], &mut stress);
        let highest = 1.5 / (PI * 0.04);
        assert!((stress[24 * 64 + 32] / highest - 1.0).abs() < 0.01, "{} {highest}", stress[24 * 64 + 32]);
        let beside_centre = highest * (1.0 - (6.0 * grid.dx() / 0.2).powi(2)).sqrt();
        assert!((stress[24 * 64 + 38] / beside_centre - 1.0).abs() < 0.01);
    }
}
