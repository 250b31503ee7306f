//! Areal repulsion law of a wall whose surface atoms deform individually: an atom directly below an indenter atom
//! carries more than the mean force and is pushed in, an atom between indenter atoms carries less and protrudes.
//!
//! An atom under the force f, where the mean force is ⟨f⟩, is c (⟨f⟩ - f) above the surface of the continuum.
//! With F(z) the force of the indenter on a rigid atom at the distance z, which depends on the position under the indenter, f =
//! F(z + c f), where z is the distance of an unloaded atom; the distance of the mean surface is z + c ⟨f⟩. Forces on
//! neighbours are taken as independent, as under an indenter that is incommensurate with the crystal. There are no fitted
//! parameters.
//!
//! On a slope the indenter has fewer atoms per area and presses along the normal: with slope angle θ the vertical pressure
//! at the vertical gap g is cos²θ P(g cos θ).

use std::f64::consts::PI;

use super::wall::LatticeWall;
use asperity_contact::interface::{Law, TabulatedWall};

/// Positions under the indenter along half a spacing; the others follow by symmetry. Doubling them changes the pressure by
/// less than one per cent at gaps where it is a thousandth of E*.
const PLACES: usize = 12;

/// Depth of the table over r_m; the pressure there is twice E*.
const DEEPEST: f64 = 0.25;

/// Limit of Newton or bisection steps; ten suffice.
const STEPS: usize = 60;

/// Smallest distance of an atom from the indenter over σ; no load reaches it.
const NEAREST: f64 = 0.3;

/// The areal law, in Å and eV.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CompliantWall {
    law: TabulatedWall,
    /// Compliance c, Å per eV/Å.
    compliance: f64,
    /// Area per surface atom, Å².
    area: f64,
    /// cos θ of the rms gradient.
    cosine: f64,
}

impl CompliantWall {
    /// The law on a crystal of contact modulus `modulus` (eV/Å³) under a profile of this rms gradient.
    pub fn new(wall: &LatticeWall, modulus: f64, rms_gradient: f64) -> Self {
        let area = 0.5 * wall.a0_angstrom * wall.a0_angstrom;
        let compliance = compliance(wall.a0_angstrom, modulus);
        let touch = wall.minimum_angstrom();
        let law = TabulatedWall::new(DEEPEST * touch, |depth| {
            let mut z = touch - depth;
            let (mut force, mut slope) = (0.0, 0.0);
            for _ in 0..STEPS {
                (force, slope) = mean_force(wall, compliance, z);
                // The distance z + c ⟨f⟩ rises with z by 1 + c d⟨f⟩/dz, which is above zero.
                let step = (touch - depth - z - compliance * force) / (1.0 + compliance * slope);
                z += step;
                if step.abs() < 1e-12 * touch {
                    break;
                }
            }
            [force / area, -slope / (1.0 + compliance * slope) / area]
        });
        CompliantWall { law, compliance, area, cosine: 1.0 / rms_gradient.hypot(1.0) }
    }

    /// Vertical pressure at the vertical gap `g` (Å), eV/Å³.
    pub fn pressure(&self, g: f64) -> f64 {
        -self.cosine * self.cosine * self.law.traction(g * self.cosine)
    }

    /// Height of an unloaded atom above the mean surface at the vertical gap `g` (Å), Å.
    pub fn rise(&self, g: f64) -> f64 {
        self.compliance * self.area * self.pressure(g)
    }

    /// The law in units of a length (Å) and a modulus (eV/Å³).
    pub fn reduced(&self, length: f64, modulus: f64) -> TabulatedWall {
        self.law.scaled(self.cosine * length, self.cosine * self.cosine / modulus)
    }
}

/// Compliance of a single surface atom, Å per eV/Å: displacement at the centre of a disc of its area under uniform
/// pressure, 2 f / (π E* a) (Johnson, Contact Mechanics (1985), eq. 3.29a). It is 1.60 for the shipped potential;
/// LAMMPS gives 1.60 to 1.65 (`tests/lammps/modulus.rs`).
pub fn compliance(a0_angstrom: f64, modulus: f64) -> f64 {
    let radius = a0_angstrom / (2.0 * PI).sqrt();
    2.0 / (PI * modulus * radius)
}

/// Mean force on surface atoms whose unloaded distance from the indenter is `z` (Å), eV/Å, and its derivative.
fn mean_force(wall: &LatticeWall, compliance: f64, z: f64) -> (f64, f64) {
    let (mut force, mut slope) = (0.0, 0.0);
    let place = |k: usize| 0.5 * wall.spacing_angstrom * (k as f64 + 0.5) / PLACES as f64;
    for j in 0..PLACES {
        for i in 0..PLACES {
            let (f, df) = pressed(wall, (place(i), place(j)), compliance, z);
            force += f;
            slope += df;
        }
    }
    let count = (PLACES * PLACES) as f64;
    (force / count, slope / count)
}

/// Force f = F(z + c f) on an atom in equilibrium at the distance z + c f, and df/dz.
fn pressed(wall: &LatticeWall, point: (f64, f64), c: f64, z: f64) -> (f64, f64) {
    // The indenter's force increases and the restoring force decreases towards the indenter: there is one intersection.
    let (mut low, mut high) = (z.max(NEAREST * wall.repulsion.sigma_angstrom), wall.minimum_angstrom());
    if low >= high {
        return (0.0, 0.0);
    }
    let mut distance = 0.5 * (low + high);
    for _ in 0..STEPS {
        let (force, slope) = indenter_force(wall, point, distance);
        let excess = force - (distance - z) / c;
        (low, high) = if excess > 0.0 { (distance, high) } else { (low, distance) };
        let next = distance - excess / (slope.min(0.0) - 1.0 / c);
        let next = if next > low && next < high { next } else { 0.5 * (low + high) };
        let settled = (next - distance).abs() <= 1e-14 * high;
        distance = next;
        if settled {
            break;
        }
    }
    let (force, slope) = indenter_force(wall, point, distance);
    (force, slope / (1.0 - c * slope))
}

/// Vertical repulsion of the indenter on an atom at a distance `z` from its plane, eV/Å, and its derivative.
fn indenter_force(wall: &LatticeWall, (x, y): (f64, f64), z: f64) -> (f64, f64) {
    let (s, touch) = (wall.spacing_angstrom, wall.minimum_angstrom());
    let reach = (touch / s).ceil() as i64;
    let (mut force, mut slope) = (0.0, 0.0);
    for j in -reach..=reach + 1 {
        for i in -reach..=reach + 1 {
            let square = (x - i as f64 * s).powi(2) + (y - j as f64 * s).powi(2) + z * z;
            if square < touch * touch {
                let s6 = (wall.repulsion.sigma_angstrom * wall.repulsion.sigma_angstrom / square).powi(3);
                let over_distance = 24.0 * wall.repulsion.epsilon_ev * (2.0 * s6 - 1.0) * s6 / square;
                force += over_distance * z;
                slope +=
                    over_distance - 24.0 * wall.repulsion.epsilon_ev * (28.0 * s6 - 8.0) * s6 / square * z * z / square;
            }
        }
    }
    (force, slope)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::repulsion::Repulsion;

    const A0: f64 = 5.5884;
    const MODULUS: f64 = 0.178_32;

    fn wall() -> LatticeWall {
        LatticeWall::new(Repulsion::CHALLENGE, A0 * 5.0 / 11.0, A0).expect("valid")
    }

    /// For rigid atoms the mean over positions is the integral. At small depths few positions are within range.
    #[test]
    fn rigid_atoms_have_the_areal_law() {
        let wall = wall();
        for (depth, tolerance) in [(0.1, 0.01), (0.2, 0.01), (0.4, 0.005), (0.8, 0.005)] {
            let z = wall.minimum_angstrom() - depth;
            let actual = mean_force(&wall, 1e-9, z).0 / (0.5 * A0 * A0);
            let exact = wall.repulsion_pressure(z);
            assert!((actual / exact - 1.0).abs() < tolerance, "{depth}: {actual} {exact}");
        }
    }

    #[test]
    fn derivatives_agree_with_finite_differences() {
        let (wall, h) = (wall(), 1e-6);
        for (place, z) in [((0.0, 0.0), 3.8), ((0.4, 0.2), 3.6), ((1.2, 1.1), 3.2)] {
            let difference =
                (indenter_force(&wall, place, z + h).0 - indenter_force(&wall, place, z - h).0) / (2.0 * h);
            assert!((indenter_force(&wall, place, z).1 / difference - 1.0).abs() < 1e-6);
            let c = compliance(A0, MODULUS);
            let (f, df) = pressed(&wall, place, c, z);
            assert!((indenter_force(&wall, place, z + c * f).0 - f).abs() < 1e-10);
            let difference = (pressed(&wall, place, c, z + h).0 - pressed(&wall, place, c, z - h).0) / (2.0 * h);
            assert!((df / difference - 1.0).abs() < 1e-5, "{df} {difference}");
        }
    }

    /// Softer than rigid atoms, most at small contact area: 0.43 of their pressure at 0.05 Å and 0.90 at 0.3 Å, from an
    /// independent program (bisection, 144 positions).
    #[test]
    fn compliant_atoms_have_a_softer_law() {
        let wall = wall();
        let compliant = CompliantWall::new(&wall, MODULUS, 0.0);
        let rigid = |g: f64| wall.repulsion_pressure(wall.minimum_angstrom() + g);
        for (g, expected) in [(-0.05, 1.38e-4), (-0.1, 6.43e-4), (-0.2, 4.62e-3), (-0.3, 1.569e-2)] {
            let actual = compliant.pressure(g);
            assert!(actual < rigid(g) && (actual / expected - 1.0).abs() < 0.05, "{g}: {actual} {expected}");
        }
        let sloping = CompliantWall::new(&wall, MODULUS, 0.5);
        assert!((sloping.pressure(-0.2) / (compliant.pressure(-0.2 / 1.25f64.sqrt()) / 1.25) - 1.0).abs() < 1e-12);
        // It rises to the end of its table.
        let pressures: Vec<f64> = (0..200).map(|k| compliant.pressure(-0.006 * f64::from(k))).collect();
        assert!(pressures.windows(2).all(|w| w[1] > w[0]) && pressures[199] > MODULUS, "{pressures:?}");
        let reduced = sloping.reduced(250.0, MODULUS);
        for g in [-0.03, -0.21, -0.4, -2.0] {
            assert!((-reduced.traction(g / 250.0) * MODULUS / sloping.pressure(g) - 1.0).abs() < 1e-12);
        }
        assert_eq!((compliant.pressure(0.0), compliant.rise(0.1)), (0.0, 0.0));
    }
}
