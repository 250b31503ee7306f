//! The three systems of units, and the numbers that carry one into the other.
//!
//! Inside, everything is *reduced*: the cell's extent in x is the unit of length and the contact modulus `E*` the unit of
//! stress. SI appears at the border of scenes and reports, LAMMPS `metal` (Å, eV, ps, bar) in `atoms`. A quantity with a
//! unit carries it in its name.

/// Longest time that anything can be given, s: thirty years, which clocks can still add to now.
pub const MAX_SECONDS: f64 = 1e9;

/// 1 eV/Å³ in GPa (CODATA 2018: e = 1.602176634e-19 C).
pub const GPA_PER_EV_A3: f64 = 160.217_663_4;
/// 1 eV/Å² in J/m².
pub const J_M2_PER_EV_A2: f64 = 16.021_766_34;
/// Newtons of a force of 1 eV/Å, in 10⁻⁹ N.
pub const NN_PER_EV_A: f64 = 1.602_176_634;
pub const ANGSTROM_M: f64 = 1e-10;

/// Length and stress scales of one realisation of the dimensionless problem: the laboratory's or the atoms'.
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
    fn the_papers_numbers() {
        let block = Scales { length_m: 175.0 * 5.5884e-10, modulus_pa: 28.57e9 };
        assert!((block.energy_per_area_ev_a2(2e-5) - 3.4878e-3).abs() < 1e-6);
        assert!((block.length_angstrom(2.071e-5) - 0.020254).abs() < 1e-6);
        let laboratory = Scales { length_m: 1e-4, modulus_pa: 25e6 };
        assert!((laboratory.reduced_energy_per_area(0.05) - 2e-5).abs() < 1e-18);
        assert_eq!(laboratory.stress_pa(0.01), 250e3);
    }
}
