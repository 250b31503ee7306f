//! Displacements and stresses inside a layer under a pressure on its surface, mode by mode.
//!
//! A pressure `p e^{iqx}` without shear on an isotropic layer bonded to a rigid base causes, at the height `z` above
//! the base, the displacements of the Papkovich-Neuber potentials `B = a cosh qz + b sinh qz` and
//! `β = (3-4ν)(a/q) sinh qz`, which vanish at the base. The two stresses at the surface determine `a` and `b`.
//! With `w = qt`, `t` the thickness,
//!
//! ```text
//! a = (1-2ν) sinh w - w cosh w,   b = 2(1-ν) cosh w + w sinh w,   Δ = 4(1-ν)² + (3-4ν) sinh² w + w²
//! normal   = (1-ν)^-1 /(qΔ) [(3-4ν) b sinh qz - qz (a sinh qz + b cosh qz)]
//! tangential  = i (1-ν)^-1 /(qΔ) [qz (a cosh qz + b sinh qz) + (3-4ν) a sinh qz]
//! ```
//!
//! in units of `p/E*` with `2G = E*(1-ν)`. At the surface `normal` is the compliance of the bonded [`Layer`]
//! (Carbone, Lorenz, Persson & Wohlers 2009). For a deep layer both converge to those of the half-space,
//! `(2/q)[1 + qd/2(1-ν)] e^{-qd}` and `i (2/q)[(1-2ν) - qd]/2(1-ν) e^{-qd}` at the depth `d`.
//!
//! Stresses are those of the Airy function `f(x)/q²`, `x = qz`: the normal stress is `-f`, the stress along the wave
//! vector `f''`, and the shear stress `i f'` with the depth as coordinate. At the surface `f = 1` and `f' = 0`; at the base
//! the displacements vanish (bonded), or `f = f' = 0` (constant stress). With `k = 3-4ν`, `C± = cosh(w ± x)` and
//! `S± = sinh(w ± x)`,
//!
//! ```text
//! bonded:          f Δ = wx C₋ + ½k (w-x) S₊ + ½ (w+x) S₋ + ½k C₊ + ½(5-12ν+8ν²) C₋
//! constant stress: f (sinh² w - w²) = ½ (w-x) S₊ - ½ (w+x) S₋ + ½ C₊ - (½ + wx) C₋
//! ```
//!
//! and for a half-space `f = (1 + qd) e^{-qd}` (Westergaard 1939; Johnson, Contact Mechanics (1985), section 13.2).

use super::{Base, Layer};

/// Amplitudes of the stress at a depth under a pressure wave of unit amplitude, tension positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WaveStress {
    /// Normal stress along the depth, in phase with the pressure.
    pub normal: f64,
    /// Normal stress along the wave vector, in phase with the pressure.
    pub along: f64,
    /// Shear stress of wave vector and depth, a quarter wave ahead: the stress is `i shear` times the pressure.
    pub shear: f64,
}

impl WaveStress {
    /// In a half-space under a wave of the wave number `q`.
    pub fn in_half_space(q: f64, depth: f64) -> Self {
        let (x, fades) = (q * depth, (-q * depth).exp());
        WaveStress { normal: -(1.0 + x) * fades, along: -(1.0 - x) * fades, shear: x * fades }
    }
}

/// Displacement amplitudes inside a layer per unit pressure amplitude, units of L/E*.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerDisplacement {
    /// Towards the base, in phase with the pressure.
    pub normal: f64,
    /// Along the wave vector, a quarter wave ahead: the displacement there is `i tangential` times the pressure.
    pub tangential: f64,
}

impl Layer {
    /// Displacements at the height `z` above the base (0 to the thickness) under a pressure wave of wave number `q` >
    /// 0; `None` for a layer that is not bonded.
    pub fn displacement_at(&self, q: f64, z: f64) -> Option<LayerDisplacement> {
        if self.base != Base::Bonded {
            return None;
        }
        let (nu, w, x) = (self.poisson, q * self.thickness, q * z);
        let (k, shear, press) = (3.0 - 4.0 * nu, 1.0 - 2.0 * nu, 2.0 * (1.0 - nu));
        // Hyperbolic functions of w and x over e^w and e^x, and those of w - x over e^(w+x), so that nothing overflows.
        let (e_w, e_x) = ((-2.0 * w).exp(), (-2.0 * x).exp());
        let (sinh_w, cosh_w) = (-0.5 * (-2.0 * w).exp_m1(), 0.5 * (1.0 + e_w));
        let sinh_x = -0.5 * (-2.0 * x).exp_m1();
        let (sinh_deep, cosh_deep) = (-0.5 * e_x * (2.0 * (x - w)).exp_m1(), 0.5 * (e_x + e_w));
        // With a and b inserted, terms that exceed the result by a factor of w cancel analytically.
        let normal = k * sinh_x * (press * cosh_w + (w - x) * sinh_w) - x * (press * cosh_deep + w * sinh_deep);
        let tangential = k * sinh_x * (shear * sinh_w - (w - x) * cosh_w) + x * (shear * sinh_deep - w * cosh_deep);
        let delta = k * sinh_w * sinh_w + (4.0 * (1.0 - nu).powi(2) + w * w) * e_w;
        let unit = (x - w).exp() / ((1.0 - nu) * q * delta);
        Some(LayerDisplacement { normal: unit * normal, tangential: unit * tangential })
    }

    /// Stresses at a depth (0 to the thickness) under a pressure wave of wave number `q` > 0.
    pub fn stress_at(&self, q: f64, depth: f64) -> WaveStress {
        let (nu, q_thickness, q_depth) = (self.poisson, q * self.thickness, q * depth);
        let q_height = (q_thickness - q_depth).max(0.0);
        // Of the point's mirror image in the base.
        let q_image_depth = q_thickness + q_height;
        // Hyperbolic functions of both depths over e^q_image_depth/2, so that nothing overflows.
        let [e_thickness, e_height, e_image] = [q_thickness, q_height, q_image_depth].map(|x| (-2.0 * x).exp());
        let (cosh_image, sinh_image) = (1.0 + e_image, 1.0 - e_image);
        let (cosh_depth, sinh_depth) = (e_height + e_thickness, e_height - e_thickness);
        let (divisor, [f, slope, bend]) = match self.base {
            Base::Bonded => {
                let (k, product) = (3.0 - 4.0 * nu, 2.0 * (1.0 - nu) * (1.0 - 2.0 * nu));
                let last = 5.0 - 12.0 * nu + 8.0 * nu * nu;
                let f = (q_thickness * q_height + 0.5 * last) * cosh_depth
                    + 0.5 * (k * (q_depth * sinh_image + cosh_image) + q_image_depth * sinh_depth);
                let slope =
                    0.5 * q_depth * (k * cosh_image + cosh_depth) - (q_thickness * q_height + product) * sinh_depth;
                let bend = 0.5 * (q_depth * (k * sinh_image - sinh_depth) - k * cosh_image - cosh_depth)
                    - q_thickness * sinh_depth
                    + (q_thickness * q_height + product) * cosh_depth;
                let delta = k * (1.0 - e_thickness).powi(2)
                    + 4.0 * e_thickness * (4.0 * (1.0 - nu).powi(2) + q_thickness * q_thickness);
                (delta, [f, slope, bend])
            }
            Base::ConstantStress => {
                let f = 0.5 * (q_depth * sinh_image - q_image_depth * sinh_depth + cosh_image)
                    - (0.5 + q_thickness * q_height) * cosh_depth;
                let slope = 0.5 * q_depth * (cosh_image - cosh_depth) + q_thickness * q_height * sinh_depth;
                let bend = 0.5 * (q_depth * (sinh_image + sinh_depth) - cosh_image + cosh_depth)
                    + q_thickness * sinh_depth
                    - q_thickness * q_height * cosh_depth;
                ((1.0 - e_thickness).powi(2) - 4.0 * e_thickness * q_thickness * q_thickness, [f, slope, bend])
            }
        };
        let unit = 2.0 * (-q_depth).exp() / divisor;
        WaveStress { normal: -unit * f, along: unit * bend, shear: unit * slope }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interface::Kernel;

    fn layer(poisson: f64) -> Layer {
        Layer { thickness: 0.143, poisson, base: Base::Bonded }
    }

    fn at(layer: &Layer, q: f64, z: f64) -> LayerDisplacement {
        layer.displacement_at(q, z).expect("bonded")
    }

    #[test]
    fn the_surface_moves_by_the_kernel_and_the_base_is_fixed() {
        for poisson in [0.0, 0.3, 0.45] {
            let layer = layer(poisson);
            for q in [0.01, 1.0, 6.0, 40.0, 174.0, 176.0, 1e4] {
                let compliance = 1.0 / layer.stiffness(q, 0.0);
                let top = at(&layer, q, layer.thickness);
                assert!(
                    (top.normal / compliance - 1.0).abs() < 1e-12,
                    "ν = {poisson}, q = {q}: {} {compliance}",
                    top.normal
                );
                let base = at(&layer, q, 0.0);
                assert!(base.normal.abs() < 1e-15 * compliance && base.tangential.abs() < 1e-15 * compliance);
            }
        }
        assert_eq!(Layer { base: Base::ConstantStress, ..layer(0.3) }.displacement_at(1.0, 0.1), None);
    }

    /// Central differences with a step of 1e-4/q are accurate to 1e-7; stresses are relative to the pressure.
    const DIFFERENCES: f64 = 1e-6;

    /// The displacements `u = -normal`, `v = i tangential` (up, along) obey the equations of equilibrium inside, and
    /// the stresses at the surface are the pressure and no shear.
    #[test]
    fn the_field_in_the_layer_is_in_equilibrium_with_the_pressure() {
        for (nu, q) in [(0.3, 3.0), (0.3, 20.0), (0.1, 9.0)] {
            let layer = layer(nu);
            let (two_g, t) = (1.0 - nu, layer.thickness);
            let lambda = two_g * nu / (1.0 - 2.0 * nu);
            let step = 1e-4 / q;
            let up = |z: f64| -at(&layer, q, z).normal;
            let tangential = |z: f64| at(&layer, q, z).tangential;
            let slope = |f: &dyn Fn(f64) -> f64, z: f64| (f(z + step) - f(z - step)) / (2.0 * step);
            // With e^{iqx}: ∂x(i tangential) = -q tangential, ∂x(up) = iq up.
            let normal = |z: f64| (lambda + two_g) * slope(&up, z) - lambda * q * tangential(z);
            let shear = |z: f64| 0.5 * two_g * (slope(&tangential, z) + q * up(z));
            let side = |z: f64| -(lambda + two_g) * q * tangential(z) + lambda * slope(&up, z);
            // The formulas are also valid just above the surface, where the differences evaluate them.
            assert!((normal(t) + 1.0).abs() < DIFFERENCES, "{nu} {q}: {}", normal(t));
            assert!(shear(t).abs() < DIFFERENCES, "{nu} {q}: {}", shear(t));
            for z in [0.2 * t, 0.5 * t, 0.9 * t] {
                // Second differences lose half of the digits.
                let wide = 1e-3 / q;
                let d = |f: &dyn Fn(f64) -> f64| (f(z + wide) - f(z - wide)) / (2.0 * wide);
                assert!((d(&normal) - q * shear(z)).abs() < 1e-4 * q, "{nu} {q} {z}: {}", d(&normal));
                assert!((d(&shear) + q * side(z)).abs() < 1e-4 * q, "{nu} {q} {z}");
            }
        }
    }

    /// The stresses are those of the displacements, by differences; at a bonded base nothing is strained along it.
    #[test]
    fn stresses_are_those_of_the_displacements() {
        for (nu, q) in [(0.0, 5.0), (0.3, 3.0), (0.3, 20.0), (0.45, 40.0)] {
            let layer = layer(nu);
            let (two_g, t) = (1.0 - nu, layer.thickness);
            let lambda = two_g * nu / (1.0 - 2.0 * nu);
            let step = 1e-4 / q;
            let up = |z: f64| -at(&layer, q, z).normal;
            let tangential = |z: f64| at(&layer, q, z).tangential;
            let slope = |f: &dyn Fn(f64) -> f64, z: f64| (f(z + step) - f(z - step)) / (2.0 * step);
            for depth in [0.0, 0.2 * t, 0.5 * t, 0.9 * t] {
                let (z, actual) = (t - depth, layer.stress_at(q, depth));
                let normal = (lambda + two_g) * slope(&up, z) - lambda * q * tangential(z);
                let side = -(lambda + two_g) * q * tangential(z) + lambda * slope(&up, z);
                // Upwards along z the shear stress has the other sign.
                let shear = -0.5 * two_g * (slope(&tangential, z) + q * up(z));
                for (what, a, b) in
                    [("normal", actual.normal, normal), ("along", actual.along, side), ("shear", actual.shear, shear)]
                {
                    assert!((a - b).abs() < DIFFERENCES, "{nu} {q} {depth} {what}: {a} {b}");
                }
            }
            let base = layer.stress_at(q, t);
            assert!(((1.0 - nu) * base.along - nu * base.normal).abs() < 1e-14, "{nu} {q}: {base:?}");
        }
    }

    /// A free plate: pressure on one face, none on the other, no shear on either; equilibrium inside.
    #[test]
    fn plates_are_loaded_on_one_face() {
        let plate = Layer { base: Base::ConstantStress, ..layer(0.3) };
        let t = plate.thickness;
        for q in [1.0, 6.0, 40.0, 300.0] {
            let (top, base) = (plate.stress_at(q, 0.0), plate.stress_at(q, t));
            // N has the size of (qt)⁴/3 and is a difference of numbers of the size of (qt)².
            let allowed = 1e-13 / (q * t).powi(2).min(1.0);
            for (actual, expected) in [(top.normal, -1.0), (top.shear, 0.0), (base.normal, 0.0), (base.shear, 0.0)] {
                assert!((actual - expected).abs() < allowed, "{q}: {top:?} {base:?}");
            }
            let step = 1e-4 / q;
            let slope = |value: fn(&WaveStress) -> f64, d: f64| {
                (value(&plate.stress_at(q, d + step)) - value(&plate.stress_at(q, d - step))) / (2.0 * step)
            };
            for d in [0.2 * t, 0.7 * t] {
                let here = plate.stress_at(q, d);
                let size = q * here.along.abs().max(1.0);
                assert!((slope(|s| s.shear, d) + q * here.along).abs() < DIFFERENCES * size, "{q} {d}");
                assert!((slope(|s| s.normal, d) - q * here.shear).abs() < DIFFERENCES * size, "{q} {d}");
            }
        }
    }

    #[test]
    fn stresses_of_deep_layers_are_those_of_half_spaces() {
        for base in [Base::Bonded, Base::ConstantStress] {
            let deep = Layer { thickness: 12.0, poisson: 0.3, base };
            for depth in [0.0, 0.1, 0.4, 1.0] {
                let (a, b) = (deep.stress_at(5.0, depth), WaveStress::in_half_space(5.0, depth));
                for (a, b) in [(a.normal, b.normal), (a.along, b.along), (a.shear, b.shear)] {
                    assert!((a - b).abs() < 1e-14, "{depth}: {a} {b}");
                }
            }
            let deeper = Layer { thickness: 1e6, ..deep };
            assert!(
                (deeper.stress_at(5.0, 0.1).normal / WaveStress::in_half_space(5.0, 0.1).normal - 1.0).abs() < 1e-9
            );
        }
    }

    #[test]
    fn deep_layers_are_half_spaces_and_thin_ones_oedometers() {
        let nu = 0.3;
        let deep = Layer { thickness: 12.0, poisson: nu, base: Base::Bonded };
        let q: f64 = 5.0;
        for d in [0.0, 0.1, 0.4, 1.0] {
            let actual = at(&deep, q, deep.thickness - d);
            let fades = (-q * d).exp() / ((1.0 - nu) * q);
            assert!((actual.normal / (fades * (2.0 * (1.0 - nu) + q * d)) - 1.0).abs() < 1e-10, "{d}");
            assert!((actual.tangential - fades * ((1.0 - 2.0 * nu) - q * d)).abs() < 1e-10 * fades, "{d}");
        }
        // A wave much longer than the thickness compresses the layer uniformly.
        let thin = Layer { thickness: 1e-4, poisson: nu, base: Base::Bonded };
        for fraction in [0.25, 0.5, 1.0] {
            let actual = at(&thin, 1e-3, fraction * thin.thickness).normal;
            assert!((actual / (fraction * thin.compression()) - 1.0).abs() < 1e-6, "{fraction}: {actual}");
        }
    }
}
