use super::{Law, range_on_mesh};

/// Constant attraction `γ/ρ` up to the gap ρ, none beyond (Dugdale, J. Mech. Phys. Solids 8 (1960) 100; for adhesion
/// Maugis, J. Colloid Interface Sci. 150 (1992) 243), its edge tapered.
///
/// A jump of the traction is an energy with a kink: a node beyond it and a node before it both have a force, no node has
/// none, and no method that follows gradients comes to rest there. So the traction falls from `γ/ρ` at `ρ(1 - w)` to
/// zero at `ρ(1 + w)` along a cubic with flat ends. The taper is antisymmetric about ρ, which leaves γ and the
/// largest stress exact, and its slope is continuous, which Newton steps need.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dugdale {
    /// Work of adhesion γ, units of E*·L.
    pub gamma: f64,
    /// Range ρ, units of L: the gap at which half of the largest stress is left.
    pub rho: f64,
    /// Half-width w of the taper over ρ, above 0 and up to 1.
    pub taper: f64,
}

impl Dugdale {
    /// Half-width of the taper over the range. What other widths would answer is in `docs/methods.md`.
    pub const TAPER: f64 = 0.25;

    pub fn new(gamma: f64, rho: f64) -> Self {
        Dugdale { gamma, rho, taper: Self::TAPER }
    }

    /// What is left of the taper at gap `g`: one where it begins, zero where it ends.
    #[inline]
    fn left(&self, g: f64) -> f64 {
        (0.5 + (self.rho - g) / self.width()).clamp(0.0, 1.0)
    }

    /// Width of the whole taper, units of L.
    #[inline]
    fn width(&self) -> f64 {
        2.0 * self.taper * self.rho
    }

    /// Largest softening over `γ/ρ²`: the middle of a cubic with flat ends is one and a half times as steep as its chord.
    fn steepness(&self) -> f64 {
        1.5 / (2.0 * self.taper)
    }
}

impl Law for Dugdale {
    const ACTIVE: bool = true;
    const HARD: bool = true;

    #[inline]
    fn traction(&self, g: f64) -> f64 {
        let u = self.left(g);
        self.gamma / self.rho * u * u * (3.0 - 2.0 * u)
    }

    #[inline]
    fn energy(&self, g: f64) -> f64 {
        let u = self.left(g);
        let tapered = self.width() * u * u * u * (1.0 - 0.5 * u);
        // Before the taper, and behind a soft wall, the stress is constant.
        let constant = (self.rho - 0.5 * self.width() - g).max(0.0);
        -self.gamma / self.rho * (tapered + constant)
    }

    #[inline]
    fn slope(&self, g: f64) -> f64 {
        let u = self.left(g);
        -self.gamma / self.rho * 6.0 * u * (1.0 - u) / self.width()
    }

    fn cutoff(&self) -> f64 {
        self.rho + 0.5 * self.width()
    }

    fn max_slope(&self, _: f64) -> f64 {
        self.softening()
    }

    fn range(&self) -> f64 {
        self.rho
    }

    fn softening(&self) -> f64 {
        self.steepness() * self.gamma / self.rho.powi(2)
    }

    fn on_mesh(&self, dx: f64) -> Self {
        Dugdale { rho: range_on_mesh(self.gamma, self.rho, self.steepness(), dx), ..*self }
    }
}
