//! Surface stiffness of the elastic body, mode by mode: stress amplitude over displacement amplitude, in units of E*.
//!
//! The mean mode has no stiffness here: under load control the mean displacement is free, and the mean gap does not
//! contain it. The compression of a layer under the mean pressure is [`Layer::compression`].

use serde::{Deserialize, Serialize};

/// Stiffness of the mode with the wave vector (qx, qy) in units of 1/L, in E*/L; even in qy: the axes are symmetry axes
/// of the body.
pub trait Kernel: Copy + Sync + Send {
    fn stiffness(&self, qx: f64, qy: f64) -> f64;

    /// Stiffness of the modes `(qx, (first + k) step)`, `k` = 0, 1, …: part of a column of the spectrum.
    #[inline(always)]
    fn along(&self, qx: f64, first: f64, step: f64, stiffness: &mut [f64]) {
        for (k, s) in stiffness.iter_mut().enumerate() {
            *s = self.stiffness(qx, (first + k as f64) * step);
        }
    }
}

/// Length of a wave vector. `f64::hypot` guards against overflow, which wave vectors do not need, and costs ten times
/// as much.
#[inline(always)]
pub(super) fn length(qx: f64, qy: f64) -> f64 {
    (qx * qx + qy * qy).sqrt()
}

/// Semi-infinite elastic body: `E* q/2`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfSpace;

impl Kernel for HalfSpace {
    #[inline(always)]
    fn stiffness(&self, qx: f64, qy: f64) -> f64 {
        0.5 * length(qx, qy)
    }
}

/// Boundary condition at the lower face of a layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Base {
    /// Bonded to a rigid support: no displacement.
    Bonded,
    /// Constant normal stress, no shear stress, as on a perfectly soft support.
    ConstantStress,
}

/// Elastic layer of finite thickness (Carbone, Lorenz, Persson & Wohlers, Eur. Phys. J. E 29 (2009) 275).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layer {
    /// Thickness over the cell's extent in x.
    pub thickness: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    pub base: Base,
}

impl Layer {
    /// Beyond this `q·t` the correction is below 1e-16, and its hyperbolic functions would soon overflow.
    const DEEP: f64 = 25.0;

    /// Stiffness over that of a half-space, at `w = q·t`.
    pub fn stiffening(&self, w: f64) -> f64 {
        if w > Self::DEEP {
            return 1.0;
        }
        let nu = self.poisson;
        // sinh x - x without cancellation at small x.
        let sinh_minus = |x: f64| {
            if x < 1.0 {
                let x2 = x * x;
                x * x2 / 6.0
                    * (1.0
                        + x2 / 20.0 * (1.0 + x2 / 42.0 * (1.0 + x2 / 72.0 * (1.0 + x2 / 110.0 * (1.0 + x2 / 156.0)))))
            } else {
                x.sinh() - x
            }
        };
        match self.base {
            Base::Bonded => {
                let numerator = (3.0 - 4.0 * nu) * (2.0 * w).cosh() + 2.0 * w * w - 4.0 * nu * (3.0 - 2.0 * nu) + 5.0;
                let denominator = (2.0 - 4.0 * nu) * (2.0 * w).sinh() + sinh_minus(2.0 * w);
                numerator / denominator
            }
            Base::ConstantStress => {
                // cosh 2w - 2w² - 1 = 2 (sinh w - w)(sinh w + w)
                2.0 * sinh_minus(w) * (w.sinh() + w) / ((2.0 * w).sinh() + 2.0 * w)
            }
        }
    }

    /// Compression of the layer per unit mean pressure (L/E*): thickness over the uniaxial-strain modulus
    /// `E*(1-ν)²/(1-2ν)`. Zero for an incompressible layer and for constant stress at the base.
    pub fn compression(&self) -> f64 {
        match self.base {
            Base::Bonded => self.thickness * (1.0 - 2.0 * self.poisson) / (1.0 - self.poisson).powi(2),
            Base::ConstantStress => 0.0,
        }
    }
}

impl Kernel for Layer {
    #[inline]
    fn stiffness(&self, qx: f64, qy: f64) -> f64 {
        let q = length(qx, qy);
        if q == 0.0 { 0.0 } else { 0.5 * q * self.stiffening(q * self.thickness) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn thick_layers_are_half_spaces_and_thin_ones_are_uniaxially_strained() {
        for base in [Base::Bonded, Base::ConstantStress] {
            let layer = Layer { thickness: 10.0, poisson: 0.3, base };
            assert!((layer.stiffness(2.0 * PI, 0.0) / PI - 1.0).abs() < 1e-14);
        }
        // Bonded: q·t → 0 leaves the uniaxial-strain modulus over the thickness.
        for poisson in [0.0, 0.3, 0.45] {
            let thin = Layer { thickness: 1e-6, poisson, base: Base::Bonded };
            assert!((thin.stiffness(1.0, 0.0) * thin.compression() - 1.0).abs() < 1e-8, "{poisson}");
        }
        // Constant stress: a plate bends, k = q⁴t³/12 in units of E*.
        let plate = Layer { thickness: 1e-4, poisson: 0.3, base: Base::ConstantStress };
        assert!((plate.stiffness(0.6, -0.8) / (1e-12 / 12.0) - 1.0).abs() < 1e-6);
    }

    /// Layer of 139.71 Å under a cell of 977.97 Å at ν = 0.3, and a layer of thickness 0.15 L at ν = 0.5.
    #[test]
    fn stiffening_of_the_longest_waves_equals_published_values() {
        let slab = Layer { thickness: 139.71 / 977.97, poisson: 0.3, base: Base::Bonded };
        for (n, factor) in [(1.0, 2.68), (2.0, 1.42), (5.0, 1.007)] {
            assert!((slab.stiffening(2.0 * PI * n * slab.thickness) - factor).abs() < 0.006, "{n}");
        }
        let rubber = Layer { thickness: 0.15, poisson: 0.5, base: Base::Bonded };
        for (n, factor) in [(1.0, 4.61), (2.0, 1.66), (5.0, 1.009)] {
            assert!((rubber.stiffening(2.0 * PI * n * 0.15) - factor).abs() < 0.006, "{n}");
        }
    }

    /// sinh x - x by its series below one: layers on constant stress against the closed form, whose digits are few for small
    /// x alone.
    #[test]
    fn the_series_of_moderate_layers_equals_the_closed_form() {
        /// The first omitted term, 6 x¹²/15!, and rounding.
        const TOLERANCE: f64 = 1e-11;
        let plate = Layer { thickness: 1.0, poisson: 0.3, base: Base::ConstantStress };
        for w in [0.3f64, 0.5, 0.7, 0.9, 0.99, 1.01, 2.0] {
            let closed = 2.0 * (w.sinh().powi(2) - w * w) / ((2.0 * w).sinh() + 2.0 * w);
            assert!((plate.stiffening(w) / closed - 1.0).abs() < TOLERANCE, "{w}");
        }
    }

    /// A thin incompressible layer deforms by lateral flow only, with no slip at one face and no shear at the other:
    /// the flux is -t³∇p/3G, so p = 3G u/(q²t³), and E* = 4G at ν = 1/2. The next term of the series is 9w²/5 of it.
    #[test]
    fn thin_incompressible_layers_suffer_no_cancellation() {
        for w in [1e-5_f64, 1e-4, 1e-3, 1e-2] {
            // One layer under several waves, and several layers under one.
            for q in [1.0, 50.0] {
                let layer = Layer { thickness: w / q, poisson: 0.5, base: Base::Bonded };
                let scaled = layer.stiffness(q, 0.0) * q.powi(2) * layer.thickness.powi(3);
                assert!((scaled / (0.75 * (1.0 + 1.8 * w * w)) - 1.0).abs() < 1e-7, "{w} {q}: {scaled}");
            }
        }
    }
}
