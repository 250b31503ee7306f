use super::{Law, range_on_mesh};

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

    fn steepest(&self, lowest: f64) -> f64 {
        self.slope(lowest.max(Self::DEEP * self.rho)).abs()
    }

    fn range(&self) -> f64 {
        self.rho
    }

    fn softening(&self) -> f64 {
        self.gamma / self.rho.powi(2)
    }

    fn on_mesh(&self, dx: f64) -> Self {
        Exponential { rho: range_on_mesh(self.gamma, self.rho, 1.0, dx), ..*self }
    }
}
