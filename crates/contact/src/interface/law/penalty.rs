use super::Law;

/// Linear penalty wall: pressure `P = E* (-g/ℓ)` at negative gaps. For ℓ → 0 it converges to the hard wall, from
/// which energies differ by ℓ/2 times the mean squared contact stress. At negative gaps an attraction has its value
/// at zero gap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PenaltyWall {
    /// Compression ℓ of the wall under a pressure of E*, units of L.
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

    /// The wall approximates a hard wall, so the attraction at negative gaps is that at zero gap.
    fn adhesion_floor(&self) -> f64 {
        0.0
    }

    fn max_slope(&self, _: f64) -> f64 {
        1.0 / self.length
    }
}
