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

/// Metres of one unit of length, if it is known: SI prefixes from pm to km, micron, ångström, inch, in the spellings of
/// instruments. Case matters (`Mm` is no millimetre).
pub fn metres_per(unit: &str) -> Option<f64> {
    Some(match unit.trim() {
        "km" => 1e3,
        "m" | "meter" | "metre" | "Meter" => 1.0,
        "dm" => 0.1,
        "cm" => 1e-2,
        "mm" | "millimeter" | "Millimeter" => 1e-3,
        // Micro sign, and Greek letter mu.
        "um" | "\u{b5}m" | "\u{3bc}m" | "micron" | "microns" | "micrometer" | "Mikrometer" => 1e-6,
        "nm" | "nanometer" | "Nanometer" => 1e-9,
        // Letter, and ångström sign.
        "\u{c5}" | "\u{212b}" | "A" | "Ang" | "angstrom" | "Angstrom" => 1e-10,
        "pm" => 1e-12,
        "in" | "inch" => 0.0254,
        _ => return None,
    })
}

/// Pascals of one unit of stress, if it is known.
pub fn pascals_per(unit: &str) -> Option<f64> {
    Some(match unit.trim() {
        "Pa" => 1.0,
        "hPa" => 1e2,
        "kPa" => 1e3,
        "bar" => 1e5,
        "MPa" => 1e6,
        "GPa" => 1e9,
        _ => return None,
    })
}

/// Newtons of one unit of force, if it is known.
pub fn newtons_per(unit: &str) -> Option<f64> {
    Some(match unit.trim() {
        "nN" => 1e-9,
        "uN" | "\u{b5}N" | "\u{3bc}N" => 1e-6,
        "mN" => 1e-3,
        "N" => 1.0,
        "kN" => 1e3,
        _ => return None,
    })
}

/// Newtons per metre of one unit of energy per area, if it is known.
pub fn newtons_per_metre(unit: &str) -> Option<f64> {
    Some(match unit.trim() {
        "J/m2" | "J/m^2" | "J/m²" | "N/m" => 1.0,
        "mJ/m2" | "mJ/m^2" | "mJ/m²" | "mN/m" => 1e-3,
        "uJ/m2" | "uJ/m^2" | "\u{b5}J/m²" | "\u{3bc}J/m²" => 1e-6,
        _ => return None,
    })
}

/// A number with or without a unit, as a person writes it: `20`, `20um`, `20 µm`.
#[derive(Debug, Clone, PartialEq)]
pub struct Measure {
    pub value: f64,
    pub unit: Option<String>,
}

impl std::str::FromStr for Measure {
    type Err = std::num::ParseFloatError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let text = text.trim();
        // The longest start that is a number: `1e3` is one, `1e3m` has a unit.
        let ends = text.char_indices().map(|(i, c)| i + c.len_utf8()).rev();
        for end in ends.filter(|&end| text[..end].ends_with(|c: char| c.is_ascii_digit() || c == '.')) {
            if let Ok(value) = text[..end].parse() {
                let unit = text[end..].trim();
                return Ok(Measure { value, unit: (!unit.is_empty()).then(|| unit.to_string()) });
            }
        }
        // NaN and infinities are refused with the value that they are.
        text.parse().map(|value| Measure { value, unit: None })
    }
}

/// A fraction as a person writes it: `0.05` or `5%`.
pub fn fraction(text: &str) -> Option<f64> {
    let (number, unit) = text.trim().strip_suffix('%').map_or((text.trim(), 1.0), |n| (n, 0.01));
    number.trim().parse::<f64>().ok().map(|n| unit * n)
}

/// Length and stress scales of a dimensionless problem, in the laboratory or for the block of atoms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales {
    /// Extent of the cell in x, metres.
    pub length_m: f64,
    /// Contact modulus E* = E/(1-ν²), pascal.
    pub modulus_pa: f64,
}

impl Scales {
    /// Work of adhesion from J/m² to units of E*·L.
    pub fn reduced_energy_per_area(&self, j_m2: f64) -> f64 {
        j_m2 / (self.modulus_pa * self.length_m)
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
        let laboratory = Scales { length_m: 1e-4, modulus_pa: 25e6 };
        assert!((laboratory.reduced_energy_per_area(0.05) - 2e-5).abs() < 1e-18);
    }

    #[test]
    fn numbers_have_units() {
        let parsed = |text: &str| text.parse::<Measure>().map(|m| (m.value, m.unit.unwrap_or_default()));
        for (text, value, unit) in
            [("20", 20.0, ""), ("20um", 20.0, "um"), ("1e3 µm", 1e3, "µm"), ("1e-3m", 1e-3, "m"), (".5mN", 0.5, "mN")]
        {
            assert_eq!(parsed(text), Ok((value, unit.to_string())), "{text}");
        }
        assert!(parsed("um").is_err() && parsed("").is_err() && parsed("nan").is_ok());
        assert_eq!((pascals_per("kPa"), newtons_per("mN"), pascals_per("N")), (Some(1e3), Some(1e-3), None));
    }

    #[test]
    fn units_of_length_are_known_in_usual_spellings() {
        assert_eq!([" um", "µm", "\u{3bc}m"].map(metres_per), [Some(1e-6); 3]);
        assert_eq!([metres_per("Å"), metres_per("m"), metres_per("V")], [Some(1e-10), Some(1.0), None]);
    }
}
