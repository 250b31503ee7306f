use super::{Law, range_on_mesh};

/// Constant attraction `γ/ρ` up to the gap ρ, none beyond (Dugdale, J. Mech. Phys. Solids 8 (1960) 100; for adhesion
/// Maugis, J. Colloid Interface Sci. 150 (1992) 243), its edge tapered.
///
/// A jump of the traction is a kink of the energy, where gradient methods do not converge: the force is nonzero on
/// either side of it. Here the traction falls from `γ/ρ` at `ρ(1 - w)` to zero at `ρ(1 + w)` along a cubic with flat
/// ends. The taper is antisymmetric about ρ, so γ and the largest stress are exact, and its slope is continuous, as
/// Newton steps require.
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
    /// Half-width of the taper over the range. `evidence/methods-interactions.md` compares other widths.
    pub const TAPER: f64 = 0.25;

    pub fn new(gamma: f64, rho: f64) -> Self {
        Dugdale { gamma, rho, taper: Self::TAPER }
    }

    /// Position in the taper at gap `g`: one at its start, zero at its end.
    #[inline]
    fn taper_position(&self, g: f64) -> f64 {
        (0.5 + (self.rho - g) / self.width()).clamp(0.0, 1.0)
    }

    /// Width of the whole taper, units of L.
    #[inline]
    fn width(&self) -> f64 {
        2.0 * self.taper * self.rho
    }

    /// Largest softening over `γ/ρ²`: the middle of a cubic with flat ends is one and a half times as steep as its
    /// chord.
    fn steepness(&self) -> f64 {
        1.5 / (2.0 * self.taper)
    }
}

impl Law for Dugdale {
    const ACTIVE: bool = true;
    const HARD: bool = true;

    #[inline]
    fn traction(&self, g: f64) -> f64 {
        let u = self.taper_position(g);
        self.gamma / self.rho * u * u * (3.0 - 2.0 * u)
    }

    #[inline]
    fn energy(&self, g: f64) -> f64 {
        let u = self.taper_position(g);
        let tapered = self.width() * u * u * u * (1.0 - 0.5 * u);
        // Constant stress at gaps below the taper, negative ones included.
        let constant = (self.rho - 0.5 * self.width() - g).max(0.0);
        -self.gamma / self.rho * (tapered + constant)
    }

    #[inline]
    fn slope(&self, g: f64) -> f64 {
        let u = self.taper_position(g);
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
