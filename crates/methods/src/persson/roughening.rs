//! Bands of roughness added from long to short waves, and the mean gap.

use crate::quadrature::{gauss_legendre, integral};
use asperity_surface::PowerSpectrum;
use std::f64::consts::{FRAC_2_SQRT_PI, PI};

/// Waves of about one length, added after all longer ones.
#[derive(Debug, Clone, Copy)]
pub(super) struct SpectralBand {
    pub q: f64,
    /// Mean square height.
    pub height: f64,
    /// Mean square gradient.
    pub gradient: f64,
    /// Mean square gradient of the longer waves.
    pub before: f64,
}

impl SpectralBand {
    /// Mean square gradient including this band.
    pub(super) fn after(&self) -> f64 {
        self.before + self.gradient
    }
}

/// Largest number of bands per shell; needed for the longest waves, which start from zero gradient.
const MOST_PARTS: f64 = 8.0;

/// The shells from long to short waves; those that increase the gradient strongly are divided into bands of equal
/// power.
pub(super) fn bands(power: &PowerSpectrum) -> Vec<SpectralBand> {
    let mut bands = Vec::with_capacity(power.shells.len() + 64);
    let mut previous = 0.0;
    for shell in &power.shells {
        let parts = (MOST_PARTS * shell.gradient / (previous + shell.gradient)).ceil().clamp(1.0, MOST_PARTS);
        let (height, gradient) = (shell.height / parts, shell.gradient / parts);
        for _ in 0..parts as usize {
            bands.push(SpectralBand { q: shell.q, height, gradient, before: previous });
            previous += gradient;
        }
    }
    bands
}

/// Elastic energy in partial contact over that of full contact at the same contact fraction: `γ + (1 - γ) P²` (Yang &
/// Persson, J. Phys.: Condens. Matter 20 (2008) 215214).
pub(super) fn relaxed(gamma: f64, contact_area: f64) -> f64 {
    gamma + (1.0 - gamma) * contact_area * contact_area
}

/// `F(x) = ∫ [γ + 3 (1-γ) erf²t] exp(-t²) dt/t` from x to ∞, the pressure-dependent factor of the mean gap.
///
/// `F + γ ln x` is smooth and tabulated with exact slopes; the error of cubic interpolation is 1e-11.
pub(super) struct Opening {
    gamma: f64,
    /// Values and slopes times the step.
    table: Vec<[f64; 2]>,
}

impl Opening {
    const STEP: f64 = 1.0 / 256.0;
    /// F is below 1e-19 beyond this argument.
    const END: f64 = 6.5;

    pub(super) fn new(gamma: f64) -> Self {
        let rule = gauss_legendre(4);
        let slope = |x: f64| {
            if x == 0.0 {
                return 0.0;
            }
            (-gamma * (-x * x).exp_m1() - 3.0 * (1.0 - gamma) * libm::erf(x).powi(2) * (-x * x).exp()) / x
        };
        let intervals = (Self::END / Self::STEP) as usize;
        let mut table = vec![[0.0; 2]; intervals + 1];
        let mut value = gamma * Self::END.ln();
        for k in (0..=intervals).rev() {
            let x = k as f64 * Self::STEP;
            if k < intervals {
                value -= integral(&rule, x, x + Self::STEP, slope);
            }
            table[k] = [value, slope(x) * Self::STEP];
        }
        Opening { gamma, table }
    }

    /// F(x) for x > 0.
    pub(super) fn at(&self, x: f64) -> f64 {
        if x >= Self::END {
            return 0.0;
        }
        let place = x / Self::STEP;
        let k = (place as usize).min(self.table.len() - 2);
        let t = place - k as f64;
        let ([a, da], [b, db]) = (self.table[k], self.table[k + 1]);
        let (s, rise) = (1.0 - t, b - a);
        // Hermite's cubic about the chord.
        let smooth = a + t * rise + t * s * (s * (da - rise) - t * (db - rise));
        smooth - self.gamma * x.ln()
    }

    /// `-x dF/dx`, the factor in the derivative of the mean gap with respect to ln p.
    pub(super) fn fall(&self, x: f64) -> f64 {
        (self.gamma + 3.0 * (1.0 - self.gamma) * libm::erf(x).powi(2)) * (-x * x).exp()
    }
}

/// Quadrature rules for a band, by its contribution to the gradient.
pub(super) struct Rules([Vec<(f64, f64)>; 3]);

impl Rules {
    pub(super) fn new() -> Self {
        Rules([gauss_legendre(2), gauss_legendre(5), gauss_legendre(24)])
    }

    /// Two points suffice where a band hardly changes the rms gradient; the last rule is for bands that start from
    /// zero.
    fn of(&self, ratio: f64) -> &[(f64, f64)] {
        &self.0[usize::from(ratio >= 0.05) + usize::from(ratio >= 0.5)]
    }
}

/// Sum over bands of the elastic energy times `part(c p/g)`, with g the rms gradient from the first band on:
/// `(c/√π) Σ q ⟨h²⟩/⟨g²⟩ ∫ part(c p/g) dg`. With [`Opening::at`] this is the mean gap of these bands under a pressure
/// (Persson, Phys. Rev. Lett. 99 (2007) 125502, with the factor γ of Yang & Persson 2008; c = √2 there), with
/// [`Opening::fall`] its derivative `-dū/d ln p`. Also returns the number of evaluations of `part`.
pub(super) fn gap_sum(
    bands: &[SpectralBand],
    c: f64,
    pressure: f64,
    rules: &Rules,
    part: impl Fn(f64) -> f64,
) -> (f64, usize) {
    let Some(first) = bands.first() else { return (0.0, 0) };
    let x = c * pressure;
    let (mut sum, mut evaluations) = (0.0, 0);
    for band in bands {
        let (from, to) = ((band.before - first.before).max(0.0), band.after() - first.before);
        let rule = rules.of((to - from) / from.max(f64::MIN_POSITIVE));
        evaluations += rule.len();
        let (from, to) = (from.sqrt(), to.sqrt());
        let over = if from == 0.0 {
            // The substitution g = g₁ t³ resolves the logarithm at small g.
            integral(rule, 0.0, 1.0, |t| 3.0 * t * t * to * part(x / (to * t * t * t)))
        } else {
            integral(rule, from, to, |g| part(x / g))
        };
        sum += band.q * band.height / band.gradient * over;
    }
    (0.5 * FRAC_2_SQRT_PI * c * sum, evaluations)
}

/// Elastic energy per area of full contact with a band, units of E*·L: a quarter of q⟨h²⟩.
pub(super) fn full_contact_energy(band: &SpectralBand) -> f64 {
    0.25 * band.q * band.height
}

/// Contact fraction at a mean square gradient g², `erf(c p/g)`.
pub(super) fn contact_area(c: f64, pressure: f64, gradient: f64) -> f64 {
    if gradient > 0.0 { libm::erf(c * pressure / gradient.sqrt()) } else { 1.0 }
}

/// `c` of the original theory: the variance of the stress in full contact is a quarter of the mean square gradient.
pub(super) const PURE: f64 = std::f64::consts::SQRT_2;

/// `c` with the contact fraction 2 p* at small pressures, the generalisation in the challenge paper.
pub(super) fn kappa2() -> f64 {
    PI.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With γ = 1 the opening is half the exponential integral E₁(x²); tabulated values.
    #[test]
    fn opening_without_relaxation_is_an_exponential_integral() {
        let opening = Opening::new(1.0);
        for (x2, e1) in [(0.01, 4.037_929_576_538_114), (0.25, 1.044_282_634_443_738_2), (1.0, 0.219_383_934_395_520_3)]
        {
            let actual = opening.at(f64::sqrt(x2));
            assert!((actual - 0.5 * e1).abs() < 1e-11, "{x2}: {actual} {}", 0.5 * e1);
        }
        let (opening_at, x) = (|x: f64| Opening::new(0.45).at(x), 0.731);
        let slope = (opening_at(x + 1e-4) - opening_at(x - 1e-4)) / 2e-4;
        let opening = Opening::new(0.45);
        assert!((slope + opening.fall(x) / x).abs() < 1e-7, "{slope}");
    }

    /// One band from zero gradient, compared with the midpoint rule.
    #[test]
    fn one_band_is_integrated_from_zero_gradient() {
        let band = SpectralBand { q: 7.0, height: 0.3, gradient: 0.64, before: 0.0 };
        let opening = Opening::new(0.45);
        for p in [1e-3, 0.05, 0.7] {
            let (actual, _) = gap_sum(&[band], PURE, p, &Rules::new(), |x| opening.at(x));
            // Midpoints of g = 0.8 t³, dense at small g.
            let n = 200_000;
            let sum: f64 = (0..n)
                .map(|k| (f64::from(k) + 0.5) / f64::from(n))
                .map(|t| 2.4 * t * t * opening.at(PURE * p / (0.8 * t.powi(3))) / f64::from(n))
                .sum();
            let exact = PURE / PI.sqrt() * band.q * band.height / band.gradient * sum;
            assert!((actual / exact - 1.0).abs() < 1e-5, "{p}: {actual} {exact}");
        }
    }
}
