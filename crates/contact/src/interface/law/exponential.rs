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
    /// From this many ranges on the traction, below 5e-18 of its maximum, is set to zero: most of a rough interface
    /// lies beyond, and the exponential is the most expensive pointwise operation.
    const FAR: f64 = 40.0;

    /// With a soft wall gaps may be negative. Below this many ranges, which no equilibrium reaches, the attraction is
    /// constant, so that the wall's repulsion bounds the energy of trial states.
    const DEEP: f64 = -10.0;

    #[inline(always)]
    fn boltzmann(&self, g: f64) -> f64 {
        let x = g / self.rho;
        let value = exp(-x.clamp(Self::DEEP, Self::FAR));
        if x >= Self::FAR { 0.0 } else { value }
    }
}

/// The exponential function of `x` between -40 and 10, to 4e-16 of its value. Calls of the library's function took a
/// third of an adhesive solve; this one is vectorised.
#[inline(always)]
fn exp(x: f64) -> f64 {
    /// Adding and subtracting this rounds to the nearest integer and leaves it in the lowest bits.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    /// ln 2 in two parts, the first with zeros enough at its end for exact products with small integers.
    const LN_2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];
    let rounded = x * std::f64::consts::LOG2_E + ROUND;
    let n = rounded - ROUND;
    let r = (x - n * LN_2[0]) - n * LN_2[1];
    // Taylor's series on |r| < 0.35: the next term is 4e-18.
    let mut sum = 1.0 / 6_227_020_800.0;
    for k in
        [479_001_600.0, 39_916_800.0, 3_628_800.0, 362_880.0, 40_320.0, 5_040.0, 720.0, 120.0, 24.0, 6.0, 2.0, 1.0, 1.0]
    {
        sum = sum * r + 1.0 / k;
    }
    sum * f64::from_bits(rounded.to_bits().wrapping_add(1023) << 52)
}

impl Law for Exponential {
    const ACTIVE: bool = true;
    const HARD: bool = true;

    #[inline(always)]
    fn traction(&self, g: f64) -> f64 {
        self.gamma / self.rho * self.boltzmann(g)
    }

    #[inline(always)]
    fn energy(&self, g: f64) -> f64 {
        -self.gamma * self.boltzmann(g) * (1.0 + (Self::DEEP - g / self.rho).max(0.0))
    }

    #[inline(always)]
    fn slope(&self, g: f64) -> f64 {
        if g < Self::DEEP * self.rho { 0.0 } else { -self.gamma / self.rho.powi(2) * self.boltzmann(g) }
    }

    fn cutoff(&self) -> f64 {
        Self::FAR * self.rho
    }

    fn max_slope(&self, lowest: f64) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::exp;

    #[test]
    fn exp_equals_the_library_function_to_two_units_in_the_last_place() {
        /// Two units in the last place.
        const TOLERANCE: f64 = 5e-16;
        for k in -40_000..=10_000 {
            let x = f64::from(k) * 1e-3;
            assert!((exp(x) / x.exp() - 1.0).abs() < TOLERANCE, "{x}: {} {}", exp(x), x.exp());
        }
        assert_eq!(exp(0.0), 1.0);
    }
}
