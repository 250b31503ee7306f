//! The three systems of units and the conversions between them.
//!
//! Solvers use *reduced* units: the cell's extent in x is the unit of length, the contact modulus `E*` the unit of stress. Scenes
//! and reports use SI, `atoms` uses LAMMPS `metal` units (Å, eV, ps, bar). A quantity with a unit has it in its name.

/// Longest accepted duration, s: thirty years. `Instant` can still represent it as a deadline.
pub const MAX_SECONDS: f64 = 1e9;

/// 1 eV/Å³ in GPa (CODATA 2018: e = 1.602176634e-19 C).
pub const GPA_PER_EV_A3: f64 = 160.217_663_4;
/// 1 eV/Å² in J/m².
pub const J_M2_PER_EV_A2: f64 = 16.021_766_34;
/// Newtons of a force of 1 eV/Å, in 10⁻⁹ N.
pub const NN_PER_EV_A: f64 = 1.602_176_634;
pub const ANGSTROM_M: f64 = 1e-10;

/// Length and stress scales of a dimensionless problem, in the laboratory or for the block of atoms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales {
    /// Extent of the cell in x, metres.
    pub length_m: f64,
    /// Contact modulus E* = E/(1-ν²), pascal.
    pub modulus_pa: f64,
}

impl Scales {
    pub fn stress_pa(&self, reduced: f64) -> f64 {
        reduced * self.modulus_pa
    }

    pub fn length_um(&self, reduced: f64) -> f64 {
        reduced * self.length_m * 1e6
    }

    /// Work of adhesion from J/m² to units of E*·L.
    pub fn reduced_energy_per_area(&self, j_m2: f64) -> f64 {
        j_m2 / (self.modulus_pa * self.length_m)
    }

    pub fn length_angstrom(&self, reduced: f64) -> f64 {
        reduced * self.length_m / ANGSTROM_M
    }

    /// Stress from reduced units to eV/Å³.
    pub fn stress_ev_a3(&self, reduced: f64) -> f64 {
        reduced * self.modulus_pa * 1e-9 / GPA_PER_EV_A3
    }

    /// Energy per area from reduced units to eV/Å².
    pub fn energy_per_area_ev_a2(&self, reduced: f64) -> f64 {
        reduced * self.modulus_pa * self.length_m / J_M2_PER_EV_A2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The paper's scale-down: L = 97.797 nm, E* = 28.57 GPa, γ/(E*L) = 2e-5 is 0.05588 J/m² = 3.4878e-3 eV/Å².
    #[test]
    fn conversions_reproduce_the_numbers_of_the_paper() {
        let block = Scales { length_m: 175.0 * 5.5884e-10, modulus_pa: 28.57e9 };
        assert!((block.energy_per_area_ev_a2(2e-5) - 3.4878e-3).abs() < 1e-6);
        assert!((block.length_angstrom(2.071e-5) - 0.020254).abs() < 1e-6);
        let laboratory = Scales { length_m: 1e-4, modulus_pa: 25e6 };
        assert!((laboratory.reduced_energy_per_area(0.05) - 2e-5).abs() < 1e-18);
        assert_eq!(laboratory.stress_pa(0.01), 250e3);
    }
}
