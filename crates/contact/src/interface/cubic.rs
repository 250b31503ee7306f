//! (001) surface of a cubic crystal: contact modulus, and stiffness of each mode.
//!
//! A pressure wave `p cos(q·x)` on a half-space moves its surface by `G₃₃(θ) p/q`, where θ is the direction of the wave
//! vector. For an isotropic solid `G₃₃ = 2/E*`; a crystal has a different `E*(θ) = 2/G₃₃(θ)` for each direction.
//! Vlassak and Nix (J. Mech. Phys. Solids 42 (1994) 1223) average the compliance over θ for axisymmetric contacts;
//! isotropic roughness has no preferred direction either.
//!
//! `G₃₃ = (L⁻¹)₃₃` with the Barnett-Lothe tensor `L = ⟨Q(ω) - R(ω) T(ω)⁻¹ R(ω)ᵀ⟩`, a mean over the plane of the wave
//! vector and the normal (Barnett and Lothe, Physica Norvegica 7 (1973) 13; Ting, *Anisotropic Elasticity*, 1996). It
//! equals the solution by Stroh's eigenvectors and has no degenerate case: the isotropic limit needs no perturbation.

use nalgebra::Matrix3;

use super::kernel::{Kernel, length};
use asperity_grid::error::{Complaint, Error, Result};

/// Points of the Barnett-Lothe integral over half a turn, and of the in-plane average over a quarter turn. Both
/// integrands are smooth and periodic, so that the trapezoidal rule converges exponentially; tests double both for
/// copper.
const INTEGRAL_POINTS: usize = 256;
const DIRECTIONS: usize = 64;

/// Elastic constants of a cubic crystal in any unit of stress; moduli have the same unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cubic {
    pub c11: f64,
    pub c12: f64,
    pub c44: f64,
}

impl Cubic {
    /// # Errors
    /// `Error::Input` unless the crystal is stable (Born): C44 > 0, C11 > |C12|, C11 + 2 C12 > 0.
    pub fn new(c11: f64, c12: f64, c44: f64) -> Result<Self> {
        let mut list = Vec::new();
        if !(c44 > 0.0 && c44.is_finite()) {
            list.push(Complaint::new("C44", c44, "a positive number"));
        }
        // A comparison with NaN is false, so NaN is refused too.
        if !(c11 > c12.abs() && c11.is_finite()) {
            list.push(Complaint::new("C11", c11, format!("a number above |C12| = {}", c12.abs())));
        }
        if c11.is_finite() && c11 + 2.0 * c12 <= 0.0 {
            list.push(Complaint::new("C11 + 2 C12", c11 + 2.0 * c12, "a positive number"));
        }
        if list.is_empty() {
            Ok(Cubic { c11, c12, c44 })
        } else {
            Err(Error::Input { place: "elastic constants".into(), list })
        }
    }

    /// The matrix `(ab)_jk = a_i C_ijkl b_l`.
    fn contracted(&self, a: [f64; 3], b: [f64; 3]) -> Matrix3<f64> {
        let anisotropy = self.c11 - self.c12 - 2.0 * self.c44;
        let dot: f64 = (0..3).map(|i| a[i] * b[i]).sum();
        Matrix3::from_fn(|j, k| {
            let same = if j == k { self.c44 * dot + anisotropy * a[j] * b[j] } else { 0.0 };
            self.c12 * a[j] * b[k] + self.c44 * a[k] * b[j] + same
        })
    }

    /// `E*(θ) = 2/G₃₃(θ)` for a pressure wave on (001) whose wave vector makes the angle `theta` (radians) with
    /// \[100\].
    pub fn directional_modulus(&self, theta: f64) -> f64 {
        self.directional(theta, INTEGRAL_POINTS)
    }

    fn directional(&self, theta: f64, points: usize) -> f64 {
        let along = [theta.cos(), theta.sin(), 0.0];
        let mut l = Matrix3::zeros();
        for step in 0..points {
            let (s, c) = (std::f64::consts::PI * step as f64 / points as f64).sin_cos();
            let n = [c * along[0], c * along[1], s];
            let m = [-s * along[0], -s * along[1], c];
            let r = self.contracted(n, m);
            // Positive definite for a stable crystal (`Cubic::new`).
            let t = self.contracted(m, m).try_inverse().unwrap_or_else(Matrix3::zeros);
            l += self.contracted(n, n) - r * t * r.transpose();
        }
        l /= points as f64;
        let compliance = l.try_inverse().map_or(f64::INFINITY, |inverse| inverse[(2, 2)]);
        2.0 / compliance
    }

    /// Contact modulus E* of the (001) surface: `1/E* = ⟨1/E*(θ)⟩`.
    pub fn contact_modulus(&self) -> f64 {
        // Four-fold symmetry: a quarter turn is a period.
        let compliance: f64 = (0..DIRECTIONS)
            .map(|i| 1.0 / self.directional_modulus(std::f64::consts::FRAC_PI_2 * i as f64 / DIRECTIONS as f64))
            .sum();
        DIRECTIONS as f64 / compliance
    }
}

/// Semi-infinite cubic crystal under its (001) face, x along \[100\]: stiffness `E* q/2 · f(θ)`.
///
/// `f(θ) = E*(θ)/E*`, θ the direction of the wave vector and E* the face's contact modulus
/// ([`Cubic::contact_modulus`]), so that the mean of 1/f over θ is one: E* is the modulus for axisymmetric and
/// isotropically rough indenters, and only ratios of the elastic constants matter. By four-fold and mirror symmetry f
/// is a cosine series in 4θ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CubicHalfSpace {
    /// Coefficients of cos 4mθ, zero from `terms` on.
    series: [f64; TERMS],
    terms: usize,
    /// Zener's ratio `2 C44/(C11 - C12)`, one for an isotropic solid.
    pub zener: f64,
}

/// Largest number of terms: enough for a Zener ratio of 20. A kernel is passed by value.
const TERMS: usize = 24;
/// Directions between \[100\] and \[110\] from which the series is computed.
const SAMPLES: usize = 128;
/// Largest sum of the omitted terms over E*: far below the uncertainty of elastic constants, with few terms (9 for
/// copper).
const SERIES_ACCURACY: f64 = 1e-7;

impl CubicHalfSpace {
    /// From the elastic constants in any one unit.
    ///
    /// # Errors
    /// `Error::Input` for an unstable crystal, and for one so anisotropic that the series would need more terms.
    pub fn new(c11: f64, c12: f64, c44: f64) -> Result<Self> {
        let crystal = Cubic::new(c11, c12, c44)?;
        let unit = crystal.contact_modulus();
        // Midpoints of 4θ between 0 and π: the discrete cosine transform of a smooth even periodic function.
        let phase = |k: usize| std::f64::consts::PI * (k as f64 + 0.5) / SAMPLES as f64;
        let values: Vec<f64> = (0..SAMPLES).map(|k| crystal.directional_modulus(0.25 * phase(k)) / unit).collect();
        let coefficient = |m: usize| {
            let sum: f64 = values.iter().enumerate().map(|(k, f)| f * (m as f64 * phase(k)).cos()).sum();
            sum * if m == 0 { 1.0 } else { 2.0 } / SAMPLES as f64
        };
        let zener = 2.0 * c44 / (c11 - c12);
        let all: Vec<f64> = (0..SAMPLES).map(coefficient).collect();
        let lost = |terms: usize| all[terms..].iter().map(|c| c.abs()).sum::<f64>();
        let Some(terms) = (1..=TERMS).find(|&terms| lost(terms) <= SERIES_ACCURACY) else {
            let accepted = "a less anisotropic crystal: the stiffness changes too sharply with direction";
            return Err(Error::input("elastic constants", "2 C44/(C11 - C12)", zener, accepted));
        };
        let series = std::array::from_fn(|m| if m < terms { all[m] } else { 0.0 });
        Ok(CubicHalfSpace { series, terms, zener })
    }

    /// `f` for a direction with the given cosine of 4θ. `cos 4mθ` is the Chebyshev polynomial `T_m` of it: Clenshaw's
    /// recurrence.
    #[inline]
    fn over_isotropic(&self, cosine: f64) -> f64 {
        let (mut b1, mut b2) = (0.0, 0.0);
        for &a in self.series[1..self.terms].iter().rev() {
            (b1, b2) = (a + 2.0 * cosine * b1 - b2, b1);
        }
        self.series[0] + cosine * b1 - b2
    }
}

impl Kernel for CubicHalfSpace {
    #[inline]
    fn stiffness(&self, qx: f64, qy: f64) -> f64 {
        let q = length(qx, qy);
        if q == 0.0 {
            return 0.0;
        }
        // cos 4θ = 2 cos² 2θ - 1, without an angle.
        let double = (qx * qx - qy * qy) / (q * q);
        0.5 * q * self.over_isotropic(2.0 * double * double - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The integral is exact for an isotropic solid up to rounding; 1e-6 is the accuracy that the audit relies on.
    const ISOTROPIC_LIMIT: f64 = 1e-6;
    /// Half of the last digit in which the literature values are quoted.
    const QUOTED_DIGIT: f64 = 0.005;

    #[test]
    fn isotropic_limit_is_e_over_one_minus_nu_squared() {
        for nu in [-0.4, 0.0, 0.3, 0.49] {
            let young = 3.7;
            let c44 = young / (2.0 * (1.0 + nu));
            let c12 = young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
            let solid = Cubic::new(c12 + 2.0 * c44, c12, c44).unwrap();
            let expected = young / (1.0 - nu * nu);
            assert!((solid.contact_modulus() / expected - 1.0).abs() < ISOTROPIC_LIMIT, "nu = {nu}");
            assert!((solid.directional_modulus(0.37) / expected - 1.0).abs() < ISOTROPIC_LIMIT, "nu = {nu}");
        }
    }

    #[test]
    fn moduli_of_calcium_equal_published_values() {
        let measured = Cubic::new(27.8, 18.2, 16.3).unwrap();
        assert!((measured.contact_modulus() - 26.01).abs() < QUOTED_DIGIT);
        let k = 1.0985;
        let fitted = Cubic::new(27.8 * k, 18.2 * k, 16.3 * k).unwrap();
        assert!((fitted.contact_modulus() - 28.57).abs() < QUOTED_DIGIT);
        // In-plane range 24.6 to 27.8 GPa.
        let along: Vec<f64> = (0..=45).map(|t| measured.directional_modulus((t as f64).to_radians())).collect();
        let (smallest, largest) = along.iter().fold((f64::MAX, 0.0f64), |(a, b), &e| (a.min(e), b.max(e)));
        assert!((smallest - 24.6).abs() < 0.05 && (largest - 27.8).abs() < 0.05, "{smallest} to {largest}");
    }

    #[test]
    fn zeners_ratio_is_one_for_isotropic_crystals() {
        let zener = |c11, c12, c44| CubicHalfSpace::new(c11, c12, c44).expect("stable").zener;
        assert!((zener(3.0, 1.0, 1.0) - 1.0).abs() < 1e-15 && (zener(168.4, 121.4, 75.4) - 150.8 / 47.0).abs() < 1e-12);
    }

    #[test]
    fn integrals_are_converged() {
        // Copper: strongly anisotropic. Twice the points of the integral or twice the directions change nothing.
        let copper = Cubic::new(168.4, 121.4, 75.4).unwrap();
        let quarter = std::f64::consts::FRAC_PI_2;
        let finer = copper.directional(0.2, 2 * INTEGRAL_POINTS);
        assert!((copper.directional_modulus(0.2) / finer - 1.0).abs() < 1e-12);
        let n = 2 * DIRECTIONS;
        let finer: f64 =
            (0..n).map(|i| 1.0 / copper.directional_modulus(quarter * i as f64 / n as f64)).sum::<f64>() / n as f64;
        assert!((copper.contact_modulus() * finer - 1.0).abs() < 1e-12);
    }

    #[test]
    fn unstable_crystals_are_refused_with_every_reason() {
        let message = Cubic::new(10.0, 12.0, -1.0).unwrap_err().to_string();
        assert!(message.contains("C44 = -1") && message.contains("C11 = 10"), "{message}");
        assert!(Cubic::new(f64::NAN, 1.0, 1.0).is_err());
        assert!(Cubic::new(1.0, -0.6, 1.0).is_err());
    }

    /// Directions of the plane that are not those of the samples.
    fn directions() -> impl Iterator<Item = f64> {
        (0..100).map(|i| 0.0631 * f64::from(i))
    }

    #[test]
    fn the_cosine_series_equals_the_direct_solution() {
        // Calcium, copper, tungsten (nearly isotropic), potassium chloride (Zener below one), lithium, and harder
        // cases.
        for (c11, c12, c44) in [
            (27.8, 18.2, 16.3),
            (168.4, 121.4, 75.4),
            (523.0, 203.0, 160.0),
            (40.7, 7.0, 6.3),
            (13.5, 11.44, 8.78),
            (12.0, 11.0, 10.0),
            (100.0, 10.0, 5.0),
        ] {
            let crystal = Cubic::new(c11, c12, c44).unwrap();
            let kernel = CubicHalfSpace::new(c11, c12, c44).unwrap();
            let unit = crystal.contact_modulus();
            for theta in directions() {
                let q = 7.3;
                let actual = kernel.stiffness(q * theta.cos(), q * theta.sin());
                let exact = 0.5 * q * crystal.directional_modulus(theta) / unit;
                assert!((actual / exact - 1.0).abs() < 1e-6, "{c11} {c12} {c44} at {theta}: {actual} {exact}");
            }
            assert_eq!(kernel.stiffness(0.0, 0.0), 0.0);
        }
    }

    #[test]
    fn an_isotropic_crystal_is_a_half_space() {
        for nu in [-0.4, 0.0, 0.3, 0.49] {
            let (c44, c12) = (0.5 / (1.0 + nu), nu / ((1.0 + nu) * (1.0 - 2.0 * nu)));
            let kernel = CubicHalfSpace::new(c12 + 2.0 * c44, c12, c44).unwrap();
            for theta in directions() {
                let actual = kernel.stiffness(theta.cos(), theta.sin());
                assert!((actual / 0.5 - 1.0).abs() < 1e-7, "ν = {nu}: {actual}");
            }
        }
    }

    /// The compliance of the face, averaged over directions, equals that of the equivalent isotropic body.
    #[test]
    fn the_mean_compliance_is_that_of_the_contact_modulus() {
        let kernel = CubicHalfSpace::new(168.4, 121.4, 75.4).unwrap();
        let n = 360;
        let angle = |i: i32| std::f64::consts::TAU * f64::from(i) / f64::from(n);
        let mean: f64 =
            (0..n).map(|i| 0.5 / kernel.stiffness(angle(i).cos(), angle(i).sin())).sum::<f64>() / f64::from(n);
        assert!((mean - 1.0).abs() < 1e-9, "{mean}");
    }
}
