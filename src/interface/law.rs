//! Traction between the surfaces as a function of the gap between them.
//!
//! Laws are type parameters of the solvers, so that a scene without adhesion carries no trace of it. Gaps and ranges are
//! in units of L, tractions in E*, energies per area in E*·L.

/// An interaction energy `v(g)` per area and its traction `dv/dg`: attraction is positive.
pub trait Law: Copy + Sync + Send {
    /// False if every traction is zero wherever the gap is allowed to be: the solvers then skip the law altogether.
    const ACTIVE: bool;
    /// Whether gaps are bounded below by zero. A soft wall has no bound.
    const HARD: bool;

    /// Attractive traction at gap `g` (negative where a soft wall pushes).
    fn traction(&self, g: f64) -> f64;

    /// Interaction energy per area.
    fn energy(&self, g: f64) -> f64;

    /// Slope of the traction, `dt/dg`: negative where attraction fades with the gap, positive where a soft wall pushes.
    fn slope(&self, g: f64) -> f64;

    /// Gap at which the wall pushes with `stress`: zero for a hard one.
    fn closest(&self, _stress: f64) -> f64 {
        0.0
    }

    /// Range ρ of the attraction; 0 without any.
    fn range(&self) -> f64 {
        0.0
    }

    /// Upper bound of `|slope|` over the gaps at which the wall pushes with no more than `stress` (units of E*).
    fn stiffest(&self, stress: f64) -> f64;

    /// The law as a mesh of spacing `dx` can carry it without pinning contact lines: its range no shorter than
    /// [`COHESIVE_RESOLUTION`] times `√(γ dx/E*)`.
    fn on_mesh(&self, _dx: f64) -> Self {
        *self
    }
}

/// Cohesive resolution `ρ/√(γ dx/E*)` from which on the grid itself does not pin contact lines. On the challenge's surface
/// at p* = 0.01, areas found on different paths differ by several per cent at 1.0, and by a tenth of one at 1.4. Stickier
/// or hardly loaded surfaces have branches of their own, which no grid removes.
pub const COHESIVE_RESOLUTION: f64 = 1.4;

/// Impenetrable at zero gap, no adhesion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HardWall;

impl Law for HardWall {
    const ACTIVE: bool = false;
    const HARD: bool = true;

    fn traction(&self, _: f64) -> f64 {
        0.0
    }

    fn energy(&self, _: f64) -> f64 {
        0.0
    }

    fn slope(&self, _: f64) -> f64 {
        0.0
    }

    fn stiffest(&self, _: f64) -> f64 {
        0.0
    }
}

/// The challenge's adhesion, energy `-γ exp(-g/ρ)` per area (Müser et al. 2017, eq. 2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exponential {
    /// Work of adhesion γ, units of E*·L.
    pub gamma: f64,
    /// Range ρ, units of L.
    pub rho: f64,
}

impl Exponential {
    /// Beyond this many ranges the traction is below 2e-22 of its maximum and taken as zero: most of a rough interface
    /// lies beyond, and the exponential is the dearest pointwise operation.
    const FAR: f64 = 50.0;

    /// Behind a soft wall gaps may be negative. Deeper than this many ranges, which no equilibrium reaches, the attraction
    /// stays what it is there, so that the wall's repulsion bounds the energy of a wild trial state.
    const DEEP: f64 = -10.0;

    #[inline]
    fn boltzmann(&self, g: f64) -> f64 {
        let x = g / self.rho;
        if x > Self::FAR { 0.0 } else { (-x.max(Self::DEEP)).exp() }
    }
}

impl Law for Exponential {
    const ACTIVE: bool = true;
    const HARD: bool = true;

    #[inline]
    fn traction(&self, g: f64) -> f64 {
        self.gamma / self.rho * self.boltzmann(g)
    }

    #[inline]
    fn energy(&self, g: f64) -> f64 {
        -self.gamma * self.boltzmann(g) * (1.0 + (Self::DEEP - g / self.rho).max(0.0))
    }

    #[inline]
    fn slope(&self, g: f64) -> f64 {
        if g < Self::DEEP * self.rho { 0.0 } else { -self.gamma / self.rho.powi(2) * self.boltzmann(g) }
    }

    fn stiffest(&self, _: f64) -> f64 {
        self.gamma / self.rho.powi(2)
    }

    fn range(&self) -> f64 {
        self.rho
    }

    fn on_mesh(&self, dx: f64) -> Self {
        Exponential { rho: self.rho.max(COHESIVE_RESOLUTION * (self.gamma * dx).sqrt()), ..*self }
    }
}

/// The areal law of a plane of Lennard-Jones atoms over a crystal surface, truncated and shifted at the pair minimum:
/// purely repulsive, zero from gap 0 upwards, where gap 0 is the plane distance `r_m = 2^(1/6) σ`.
///
/// With `n` wall atoms and `N` surface atoms per area, averaging the pair energy over lateral registry gives the pressure
/// `P(d) = 2π n N d V(d)` at plane distance `d` (one layer of the crystal is within reach).
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

    /// Closest plane distance that is evaluated; nearer points are pushed as if they were here plus a linear spring, so
    /// that a wild trial state has a finite force. At half the pair diameter the wall pushes with thousands of E*.
    fn floor(&self) -> f64 {
        0.5 * self.sigma
    }

    /// Traction, its slope and the energy at the closest distance that is evaluated.
    fn at_floor(&self) -> (f64, f64, f64) {
        let d = self.floor();
        let (v, dv, energy) = self.pair(d);
        (-self.strength * d * v, -self.strength * (v + d * dv), self.strength * energy)
    }

    /// Gap (negative) at which the wall pushes with `pressure`, by bisection; the pressure falls monotonically with the gap.
    pub fn gap_at(&self, pressure: f64) -> f64 {
        let (mut low, mut high) = (self.floor() - self.minimum(), 0.0);
        // Sixty halvings reach the last bit.
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if -self.traction(middle) > pressure { low = middle } else { high = middle }
        }
        high
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

    fn closest(&self, stress: f64) -> f64 {
        self.gap_at(stress)
    }

    fn stiffest(&self, stress: f64) -> f64 {
        self.slope(self.gap_at(stress))
    }
}

/// A wall and an adhesion law acting together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WithAdhesion<W, A> {
    pub wall: W,
    pub adhesion: A,
}

impl<W: Law, A: Law> Law for WithAdhesion<W, A> {
    const ACTIVE: bool = W::ACTIVE || A::ACTIVE;
    const HARD: bool = W::HARD;

    #[inline]
    fn traction(&self, g: f64) -> f64 {
        self.wall.traction(g) + self.adhesion.traction(g)
    }

    fn energy(&self, g: f64) -> f64 {
        self.wall.energy(g) + self.adhesion.energy(g)
    }

    fn slope(&self, g: f64) -> f64 {
        self.wall.slope(g) + self.adhesion.slope(g)
    }

    fn stiffest(&self, stress: f64) -> f64 {
        // Behind a soft wall the attraction is steeper than at zero gap.
        self.wall.stiffest(stress) + self.adhesion.slope(self.wall.closest(stress)).abs()
    }

    fn range(&self) -> f64 {
        self.adhesion.range()
    }

    fn on_mesh(&self, dx: f64) -> Self {
        WithAdhesion { wall: self.wall.on_mesh(dx), adhesion: self.adhesion.on_mesh(dx) }
    }
}

/// Adhesion as a problem chooses it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Adhesion {
    None,
    Exponential(Exponential),
}

impl Adhesion {
    /// Zero work of adhesion is no adhesion: the same code path, bit for bit.
    pub fn exponential(gamma: f64, rho: f64) -> Self {
        if gamma == 0.0 { Adhesion::None } else { Adhesion::Exponential(Exponential { gamma, rho }) }
    }
}

impl std::fmt::Display for Adhesion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Adhesion::None => write!(f, "none"),
            Adhesion::Exponential(e) => write!(f, "exponential, γ = {:.4e} E*L, ρ = {:.4e} L", e.gamma, e.rho),
        }
    }
}

/// The wall as a problem chooses it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wall {
    Hard,
    LennardJones(LennardJonesWall),
}

impl std::fmt::Display for Wall {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Wall::Hard => write!(f, "hard wall"),
            Wall::LennardJones(w) => write!(f, "Lennard-Jones wall, σ = {:.4e} L", w.sigma),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn derivatives_agree(law: impl Law, gaps: &[f64]) {
        /// Central differences with a relative step of 1e-5: second-order error about 1e-9, rounding about 1e-10.
        const TOLERANCE: f64 = 1e-6;
        for &g in gaps {
            let step = 1e-5 * g.abs().max(1e-3);
            let traction = (law.energy(g + step) - law.energy(g - step)) / (2.0 * step);
            let slope = (law.traction(g + step) - law.traction(g - step)) / (2.0 * step);
            // Attraction is positive: it is the slope of the energy with the gap.
            assert!((traction - law.traction(g)).abs() <= TOLERANCE * law.traction(g).abs().max(1e-9), "t at {g}");
            assert!((slope - law.slope(g)).abs() <= TOLERANCE * law.slope(g).abs().max(1e-9), "slope at {g}");
        }
    }

    #[test]
    fn tractions_are_energy_slopes() {
        let adhesion = Exponential { gamma: 2e-5, rho: 2e-2 };
        derivatives_agree(adhesion, &[0.0, 0.01, 0.05, 0.2, -0.15, -0.3]);
        let wall = LennardJonesWall { strength: 30.0, sigma: 0.3 };
        derivatives_agree(wall, &[-0.2, -0.1, -0.03, -0.005, 0.01, -0.3]);
        derivatives_agree(WithAdhesion { wall, adhesion }, &[-0.05, 0.02]);
    }

    /// Whatever σ rounds to, the law is finite and continuous where its table of distances ends.
    #[test]
    fn the_wall_has_no_hole_at_its_floor() {
        for k in 0..2000 {
            let wall = LennardJonesWall { strength: 30.0, sigma: 0.01 + 1e-5 * f64::from(k) };
            let at = wall.floor() - wall.minimum();
            let (above, below) = (wall.traction(at * (1.0 - 1e-9)), wall.traction(at * (1.0 + 1e-9)));
            assert!((above / below - 1.0).abs() < 1e-6 && wall.energy(at).is_finite());
        }
    }

    /// σ = 3.5927 Å, ε = 0.2145 eV, wall spacing a0·5/11, fcc(100) with a0 = 5.5884 Å: about 5 GPa at 3.66 Å.
    #[test]
    fn the_calcium_wall_at_five_gigapascal() {
        let (a0, epsilon, gpa) = (5.5884, 0.2145, 160.2176634);
        let spacing: f64 = a0 * 5.0 / 11.0;
        // Å as unit of length, GPa as unit of stress.
        let wall =
            LennardJonesWall { strength: 2.0 * PI / spacing.powi(2) * 2.0 / (a0 * a0) * epsilon * gpa, sigma: 3.5927 };
        let pressure = -wall.traction(3.66 - wall.minimum());
        assert!((pressure - 4.9).abs() < 0.1, "{pressure}");
        assert_eq!(wall.traction(0.0), 0.0);
    }
}
