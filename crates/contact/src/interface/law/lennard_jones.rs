use super::{Law, bisect_gap};

/// The areal law of a plane of Lennard-Jones atoms over a crystal surface, truncated and shifted at the pair minimum:
/// purely repulsive, zero from gap 0 upwards, where gap 0 is the plane distance `r_m = 2^(1/6) σ`.
///
/// With `n` wall atoms and `N` surface atoms per area, averaging the pair energy over lateral registry gives the
/// pressure `P(d) = 2π n N d V(d)` at plane distance `d` (one layer of the crystal is within reach).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LennardJonesWall {
    /// Pair energy ε times `2π n N`, units such that `strength · d · (V/ε)` is a stress in E* with `d` in L.
    pub strength: f64,
    /// Pair diameter σ over L.
    pub sigma: f64,
}

impl LennardJonesWall {
    pub fn minimum(&self) -> f64 {
        2f64.powf(1.0 / 6.0) * self.sigma
    }

    /// Smallest plane distance that is evaluated. Below it the traction is extrapolated linearly, so that trial
    /// states have finite forces. At half the pair diameter the repulsion is thousands of E*.
    pub(super) fn floor(&self) -> f64 {
        0.5 * self.sigma
    }

    /// Traction, its slope and the energy at the closest distance that is evaluated.
    fn at_floor(&self) -> (f64, f64, f64) {
        let d = self.floor();
        let (v, dv, energy) = self.pair(d);
        (-self.strength * d * v, -self.strength * (v + d * dv), self.strength * energy)
    }

    /// V/ε, its slope and the energy integral, at plane distance d below the minimum.
    fn pair(&self, d: f64) -> (f64, f64, f64) {
        let s = self.sigma / d;
        let (s6, s12) = (s.powi(6), s.powi(12));
        let v = 4.0 * (s12 - s6) + 1.0;
        let dv = 4.0 * (-12.0 * s12 + 6.0 * s6) / d;
        // ∫_d^rm r V dr, from the antiderivative of r·V.
        let antiderivative = |r: f64| {
            let t = self.sigma / r;
            4.0 * (-(t.powi(12)) * r * r / 10.0 + t.powi(6) * r * r / 4.0) + r * r / 2.0
        };
        (v, dv, antiderivative(self.minimum()) - antiderivative(d))
    }
}

impl Law for LennardJonesWall {
    const ACTIVE: bool = true;
    const HARD: bool = false;

    #[inline]
    fn traction(&self, g: f64) -> f64 {
        let d = self.minimum() + g;
        if g >= 0.0 {
            0.0
        } else if d < self.floor() {
            let (traction, slope, _) = self.at_floor();
            traction + slope * (d - self.floor())
        } else {
            -self.strength * d * self.pair(d).0
        }
    }

    fn energy(&self, g: f64) -> f64 {
        let d = self.minimum() + g;
        if g >= 0.0 {
            0.0
        } else if d < self.floor() {
            let (traction, slope, energy) = self.at_floor();
            let x = d - self.floor();
            energy + traction * x + 0.5 * slope * x * x
        } else {
            self.strength * self.pair(d).2
        }
    }

    fn slope(&self, g: f64) -> f64 {
        if g >= 0.0 {
            return 0.0;
        }
        let d = (self.minimum() + g).max(self.floor());
        let (v, dv, _) = self.pair(d);
        // d(-P)/dg with P = strength·d·V: V falls with d, so this is positive for a repulsive wall.
        -self.strength * (v + d * dv)
    }

    fn gap_at_pressure(&self, pressure: f64) -> f64 {
        bisect_gap(self, pressure, self.floor() - self.minimum())
    }

    /// The gap below which the repulsion is linear.
    fn adhesion_floor(&self) -> f64 {
        self.floor() - self.minimum()
    }

    fn max_slope(&self, lowest: f64) -> f64 {
        self.slope(lowest)
    }
}
