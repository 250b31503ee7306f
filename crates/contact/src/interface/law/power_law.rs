//! The 9-3 law, the interaction of a half-space of Lennard-Jones atoms with a surface: `t = (8γ/3ρ) [x³ - x⁹]` with
//! `x = ρ/(ρ + g)` and the gap counted from the zero of force (Müser et al. 2017, eq. 3). Its largest tension is
//! 1.0264 γ/ρ at `ρ + g = 3^(1/6) ρ`, its stiffness at zero force 16 γ/ρ².
//!
//! The attractive branch is an adhesion law, the repulsive one a wall; together, with the same γ and ρ, they are the
//! whole law, smooth through zero.

use super::{Law, bisect_gap, range_on_mesh};

/// Traction, energy and slope at `x = ρ/(ρ + g)`, in γ/ρ, γ and γ/ρ².
#[inline]
fn traction(x: f64) -> f64 {
    let x3 = x * x * x;
    8.0 / 3.0 * x3 * (1.0 - x3 * x3)
}

#[inline]
fn energy(x: f64) -> f64 {
    let x2 = x * x;
    -8.0 / 3.0 * x2 * (0.5 - x2 * x2 * x2 / 8.0)
}

#[inline]
fn slope(x: f64) -> f64 {
    let x2 = x * x;
    let x4 = x2 * x2;
    8.0 / 3.0 * x4 * (9.0 * x4 * x2 - 3.0)
}

/// Stiffness at zero force over γ/ρ².
const AT_REST: f64 = 16.0;

/// Attractive branch of the 9-3 law, energy -γ at zero gap; no traction at negative gaps, where the wall acts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowerLaw93 {
    /// Work of adhesion γ, units of E*·L.
    pub gamma: f64,
    /// Distance ρ of the zero of force from the singularity, units of L.
    pub rho: f64,
}

impl PowerLaw93 {
    /// Largest softening over γ/ρ²: 4.8 x⁴ at x⁶ = 2/15, where the slope is least.
    fn steepness() -> f64 {
        4.8 * (2f64 / 15.0).powf(2.0 / 3.0)
    }

    #[inline]
    fn x(&self, g: f64) -> f64 {
        self.rho / (self.rho + g.max(0.0))
    }
}

impl Law for PowerLaw93 {
    const ACTIVE: bool = true;
    const HARD: bool = true;

    #[inline]
    fn traction(&self, g: f64) -> f64 {
        self.gamma / self.rho * traction(self.x(g))
    }

    #[inline]
    fn energy(&self, g: f64) -> f64 {
        self.gamma * energy(self.x(g))
    }

    #[inline]
    fn slope(&self, g: f64) -> f64 {
        if g < 0.0 { 0.0 } else { self.gamma / self.rho.powi(2) * slope(self.x(g)) }
    }

    fn max_slope(&self, lowest: f64) -> f64 {
        // The traction rises more steeply than it decreases.
        self.slope(lowest.max(0.0)).abs().max(self.softening())
    }

    fn range(&self) -> f64 {
        self.rho
    }

    fn softening(&self) -> f64 {
        Self::steepness() * self.gamma / self.rho.powi(2)
    }

    fn on_mesh(&self, dx: f64) -> Self {
        PowerLaw93 { rho: range_on_mesh(self.gamma, self.rho, Self::steepness(), dx), ..*self }
    }
}

/// Repulsive branch of the 9-3 law as a soft wall: zero from gap 0 upwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowerLawWall {
    /// Work of adhesion γ of the whole law, units of E*·L.
    pub gamma: f64,
    /// Distance ρ of the zero of force from the singularity, units of L.
    pub rho: f64,
}

impl PowerLawWall {
    /// Smallest distance from the singularity, over ρ, that is evaluated. Below it the traction is extrapolated
    /// linearly, so that trial states have finite forces. The repulsion is 1344 γ/ρ here.
    const FLOOR: f64 = 0.5;

    /// Traction (γ/ρ), energy (γ, zero at zero gap) and slope (γ/ρ²) at `z = 1 + g/ρ` below one.
    #[inline]
    fn at(z: f64) -> (f64, f64, f64) {
        let x = 1.0 / z.max(Self::FLOOR);
        let (t, e, s) = (traction(x), energy(x) - energy(1.0), slope(x));
        let beyond = (z - Self::FLOOR).min(0.0);
        (t + s * beyond, e + beyond * (t + 0.5 * s * beyond), s)
    }
}

impl Law for PowerLawWall {
    const ACTIVE: bool = true;
    const HARD: bool = false;

    #[inline]
    fn traction(&self, g: f64) -> f64 {
        if g >= 0.0 { 0.0 } else { self.gamma / self.rho * Self::at(1.0 + g / self.rho).0 }
    }

    #[inline]
    fn energy(&self, g: f64) -> f64 {
        if g >= 0.0 { 0.0 } else { self.gamma * Self::at(1.0 + g / self.rho).1 }
    }

    #[inline]
    fn slope(&self, g: f64) -> f64 {
        if g >= 0.0 { 0.0 } else { self.gamma / self.rho.powi(2) * Self::at(1.0 + g / self.rho).2 }
    }

    fn gap_at_pressure(&self, pressure: f64) -> f64 {
        let floor = self.adhesion_floor();
        let largest = -self.traction(floor);
        if pressure > largest {
            floor - (pressure - largest) / self.slope(floor)
        } else {
            bisect_gap(self, pressure, floor)
        }
    }

    /// The gap below which the repulsion is linear.
    fn adhesion_floor(&self) -> f64 {
        (Self::FLOOR - 1.0) * self.rho
    }

    fn max_slope(&self, lowest: f64) -> f64 {
        // The slope is finite at zero gap.
        self.slope(lowest).max(AT_REST * self.gamma / self.rho.powi(2))
    }
}
