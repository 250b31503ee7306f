//! Lennard-Jones repulsion between indenter and block, and the distance within which an atom is in contact.
//!
//! The challenge states ε, σ and d_c for calcium. For another fcc crystal they are scaled such that the areal law of the
//! wall is the same in units of the crystal, that is pressure over the contact modulus E* against distance over the
//! lattice constant a₀. By the areal law ([`super::wall`]) and with an indenter whose spacing is a fixed part of a₀,
//!
//! ```text
//! P/E* = Σ_planes ε/(E* a₀³) · 4π (a₀/s)² (z/a₀) v(z/σ),   v = V/ε
//! ```
//!
//! so ε ∝ E* a₀³ and σ ∝ a₀ keep it. The compliance of single atoms, 2/(π E* a) with a ∝ a₀, and the contact distance,
//! d_c ∝ σ, then keep their ratios, too.

use super::potential::{CALCIUM, CALCIUM_MODULUS_GPA};
use asperity_contact::method::CHALLENGE_DISTANCE_ANGSTROM;
use serde::{Deserialize, Serialize};

/// Constants of the repulsion by an atom of the indenter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Repulsion {
    /// Lennard-Jones energy ε of an indenter atom and an atom of the block, eV.
    pub epsilon_ev: f64,
    /// Lennard-Jones length σ, Å.
    pub sigma_angstrom: f64,
    /// An atom within this distance of an indenter atom is in contact, Å. Not below the Lennard-Jones minimum.
    pub contact_distance_angstrom: f64,
}

impl Repulsion {
    /// The challenge's values for calcium. d_c is the Lennard-Jones minimum plus 0.0027 Å, so every atom under repulsion
    /// is in contact.
    pub const CHALLENGE: Repulsion = Repulsion {
        epsilon_ev: 0.2145,
        sigma_angstrom: 3.5927,
        contact_distance_angstrom: CHALLENGE_DISTANCE_ANGSTROM,
    };

    /// The challenge's values scaled to a crystal of lattice constant `a0_angstrom` and contact modulus `modulus_gpa`: the
    /// challenge's own, to the last bit, for its calcium.
    pub fn of_crystal(a0_angstrom: f64, modulus_gpa: f64) -> Self {
        let length = a0_angstrom / CALCIUM.a0;
        let energy = modulus_gpa / CALCIUM_MODULUS_GPA * length.powi(3);
        let Repulsion { epsilon_ev, sigma_angstrom, contact_distance_angstrom } = Repulsion::CHALLENGE;
        Repulsion {
            epsilon_ev: epsilon_ev * energy,
            sigma_angstrom: sigma_angstrom * length,
            contact_distance_angstrom: contact_distance_angstrom * length,
        }
    }

    /// Lennard-Jones minimum r_m = 2^(1/6) σ, which is also the cut-off, Å.
    pub fn minimum_angstrom(&self) -> f64 {
        self.sigma_angstrom * 2f64.powf(1.0 / 6.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compliant_wall::CompliantWall;
    use crate::wall::LatticeWall;
    use asperity_grid::units::GPA_PER_EV_A3;

    #[test]
    fn calcium_has_the_challenges_values() {
        assert_eq!(Repulsion::of_crystal(CALCIUM.a0, CALCIUM_MODULUS_GPA), Repulsion::CHALLENGE);
        assert!(
            (Repulsion::CHALLENGE.contact_distance_angstrom - Repulsion::CHALLENGE.minimum_angstrom() - 0.0027).abs()
                < 1e-4
        );
    }

    /// Rigid and compliant wall of a crystal like copper: P/E* at d/a₀ is that of calcium.
    #[test]
    fn the_wall_is_the_same_in_units_of_the_crystal() {
        let wall = |a0: f64, modulus: f64| {
            let wall = LatticeWall::new(Repulsion::of_crystal(a0, modulus), a0 * 5.0 / 11.0, a0).unwrap();
            (wall, CompliantWall::new(&wall, modulus / GPA_PER_EV_A3, 0.3))
        };
        let (calcium, copper) = ((CALCIUM.a0, CALCIUM_MODULUS_GPA), (3.615, 130.0));
        let ([rigid, other], [soft, softer]) = {
            let ((a, b), (c, d)) = (wall(calcium.0, calcium.1), wall(copper.0, copper.1));
            ([a, c], [b, d])
        };
        let length = copper.0 / calcium.0;
        for d in [0.55, 0.6, 0.65, 0.7, 0.72] {
            let over = |wall: &LatticeWall, (a0, modulus): (f64, f64)| {
                wall.repulsion_pressure(d * a0) * GPA_PER_EV_A3 / modulus
            };
            let (here, there) = (over(&rigid, calcium), over(&other, copper));
            assert!(here > 0.0 && (there / here - 1.0).abs() < 1e-12, "{here} {there}");
        }
        for gap in [-0.5, -0.2, 0.0] {
            let (here, there) = (soft.pressure(gap) / calcium.1, softer.pressure(gap * length) / copper.1);
            assert!((there - here).abs() < 1e-9 * (1.0 + here.abs()) && (gap == 0.0 || here > 0.0), "{here} {there}");
            assert!((softer.rise(gap * length) - length * soft.rise(gap)).abs() < 1e-9);
        }
    }
}
