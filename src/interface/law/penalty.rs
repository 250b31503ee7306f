use super::Law;

/// A wall that gives way in proportion to the pressure: `P = E* (-g/ℓ)` at negative gaps. As ℓ goes to zero it becomes the
/// hard wall, from which energies differ by ℓ/2 times the mean squared contact stress. An attraction stays at negative gaps
/// what it is at zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PenaltyWall {
    /// Length ℓ by which the wall gives way under a pressure of E*, units of L.
    pub length: f64,
}

impl Law for PenaltyWall {
    const ACTIVE: bool = true;
    const HARD: bool = false;

    #[inline]
    fn traction(&self, g: f64) -> f64 {
        g.min(0.0) / self.length
    }

    #[inline]
    fn energy(&self, g: f64) -> f64 {
        let depth = g.min(0.0);
        0.5 * depth * depth / self.length
    }

    #[inline]
    fn slope(&self, g: f64) -> f64 {
        if g < 0.0 { 1.0 / self.length } else { 0.0 }
    }

    fn gap_at_pressure(&self, pressure: f64) -> f64 {
        -pressure * self.length
    }

    /// It stands for a hard wall, so what is behind it is at zero gap.
    fn adhesion_floor(&self) -> f64 {
        0.0
    }

    fn max_slope(&self, _: f64) -> f64 {
        1.0 / self.length
    }
}
