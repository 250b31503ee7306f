//! The three systems of units and the conversions between them.
//!
//! Solvers use *reduced* units: the cell's extent in x is the unit of length, the contact modulus `E*` the unit of stress. Scenes
//! and reports use SI, `atoms` uses LAMMPS `metal` units (Å, eV, ps, bar). A bare number with a unit has it in its name; what people give is a
//! [`Measure`].

use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

/// Longest accepted duration, s: thirty years. `Instant` can still represent it as a deadline.
pub const MAX_SECONDS: f64 = 1e9;

/// 1 eV/Å³ in GPa (CODATA 2018: e = 1.602176634e-19 C).
pub const GPA_PER_EV_A3: f64 = 160.217_663_4;
/// 1 eV/Å² in J/m².
pub const J_M2_PER_EV_A2: f64 = 16.021_766_34;
/// Newtons of a force of 1 eV/Å, in 10⁻⁹ N.
pub const NN_PER_EV_A: f64 = 1.602_176_634;
pub const ANGSTROM_M: f64 = 1e-10;

/// Units of length: SI prefixes from pm to km, micron, ångström, inch, in the spellings of instruments. Case matters (`Mm` is no
/// millimetre).
static LENGTHS: [Unit; 10] = [
    length(&["km"], 1e3),
    length(&["m", "meter", "metre", "Meter"], 1.0),
    length(&["dm"], 0.1),
    length(&["cm"], 1e-2),
    length(&["mm", "millimeter", "Millimeter"], 1e-3),
    // Micro sign, and Greek letter mu.
    length(&["um", "\u{b5}m", "\u{3bc}m", "micron", "microns", "micrometer", "Mikrometer"], 1e-6),
    length(&["nm", "nanometer", "Nanometer"], 1e-9),
    // Letter, and ångström sign.
    length(&["\u{c5}", "\u{212b}", "A", "Ang", "angstrom", "Angstrom"], 1e-10),
    length(&["pm"], 1e-12),
    length(&["in", "inch"], 0.0254),
];

const fn length(spellings: &'static [&'static str], si: f64) -> Unit {
    Unit { spellings, dimension: Dimension::Length, si }
}

/// Metres of one unit of length, if it is known.
pub fn metres_per(unit: &str) -> Option<f64> {
    Unit::find(unit).filter(|unit| unit.dimension == Dimension::Length).map(|unit| unit.si)
}

/// What a quantity measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    Length,
    Stress,
    Force,
    /// Energy per area, such as a work of adhesion.
    Work,
    Area,
    /// Stress per length.
    Stiffness,
    Energy,
    Temperature,
    Time,
    /// A number between 0 and 1, or a percentage.
    Fraction,
    /// Any other number.
    Number,
}

impl Dimension {
    /// With an article.
    pub fn name(self) -> &'static str {
        match self {
            Dimension::Length => "a length",
            Dimension::Stress => "a stress",
            Dimension::Force => "a force",
            Dimension::Work => "an energy per area",
            Dimension::Area => "an area",
            Dimension::Stiffness => "a stress per length",
            Dimension::Energy => "an energy",
            Dimension::Temperature => "a temperature",
            Dimension::Time => "a time",
            Dimension::Fraction => "a fraction",
            Dimension::Number => "a number",
        }
    }

    /// A value as a person writes it.
    pub fn example(self) -> &'static str {
        match self {
            Dimension::Length => "100 um",
            Dimension::Stress => "25 MPa",
            Dimension::Force => "5 mN",
            Dimension::Work => "50 mJ/m2",
            Dimension::Area => "3 um2",
            Dimension::Stiffness => "2 MPa/um",
            Dimension::Energy => "0.2 eV",
            Dimension::Temperature => "300 K",
            Dimension::Time => "60 s",
            Dimension::Fraction => "5 %",
            Dimension::Number => "0.5",
        }
    }

    /// The powers of stress and of length that it is made of; both 0 for others.
    pub fn powers(self) -> [i32; 2] {
        match self {
            Dimension::Length => [0, 1],
            Dimension::Area => [0, 2],
            Dimension::Stress => [1, 0],
            Dimension::Force => [1, 2],
            Dimension::Work => [1, 1],
            Dimension::Energy => [1, 3],
            Dimension::Stiffness => [1, -1],
            Dimension::Temperature | Dimension::Time | Dimension::Fraction | Dimension::Number => [0, 0],
        }
    }

    /// Whether its values are written without a unit, too.
    pub fn may_be_plain(self) -> bool {
        matches!(self, Dimension::Fraction | Dimension::Number)
    }

    /// What is accepted, for messages.
    pub fn accepted(self) -> String {
        match self {
            Dimension::Number => "a number".into(),
            Dimension::Fraction => "a fraction, as 0.05 or \"5 %\"".into(),
            other => format!("{} with its unit, as {:?}", other.name(), other.example()),
        }
    }
}

/// A unit of a quantity.
#[derive(Debug, PartialEq)]
pub struct Unit {
    /// The first one is written.
    spellings: &'static [&'static str],
    pub dimension: Dimension,
    /// SI units of one of it.
    pub si: f64,
}

/// Units other than those of length.
static UNITS: [Unit; 22] = [
    Unit { spellings: &["Pa"], dimension: Dimension::Stress, si: 1.0 },
    Unit { spellings: &["hPa"], dimension: Dimension::Stress, si: 1e2 },
    Unit { spellings: &["kPa"], dimension: Dimension::Stress, si: 1e3 },
    Unit { spellings: &["bar"], dimension: Dimension::Stress, si: 1e5 },
    Unit { spellings: &["MPa"], dimension: Dimension::Stress, si: 1e6 },
    Unit { spellings: &["GPa"], dimension: Dimension::Stress, si: 1e9 },
    Unit { spellings: &["nN"], dimension: Dimension::Force, si: 1e-9 },
    Unit { spellings: &["uN", "\u{b5}N", "\u{3bc}N"], dimension: Dimension::Force, si: 1e-6 },
    Unit { spellings: &["mN"], dimension: Dimension::Force, si: 1e-3 },
    Unit { spellings: &["N"], dimension: Dimension::Force, si: 1.0 },
    Unit { spellings: &["kN"], dimension: Dimension::Force, si: 1e3 },
    Unit { spellings: &["eV/\u{c5}", "eV/\u{212b}", "eV/A"], dimension: Dimension::Force, si: NN_PER_EV_A * 1e-9 },
    Unit { spellings: &["J/m2", "J/m^2", "J/m²", "N/m"], dimension: Dimension::Work, si: 1.0 },
    Unit { spellings: &["mJ/m2", "mJ/m^2", "mJ/m²", "mN/m"], dimension: Dimension::Work, si: 1e-3 },
    Unit { spellings: &["uJ/m2", "uJ/m^2", "\u{b5}J/m²", "\u{3bc}J/m²"], dimension: Dimension::Work, si: 1e-6 },
    Unit { spellings: &["eV"], dimension: Dimension::Energy, si: NN_PER_EV_A * 1e-19 },
    Unit { spellings: &["K"], dimension: Dimension::Temperature, si: 1.0 },
    Unit { spellings: &["s"], dimension: Dimension::Time, si: 1.0 },
    Unit { spellings: &["min"], dimension: Dimension::Time, si: 60.0 },
    Unit { spellings: &["h"], dimension: Dimension::Time, si: 3600.0 },
    Unit { spellings: &["ms"], dimension: Dimension::Time, si: 1e-3 },
    Unit { spellings: &["ps"], dimension: Dimension::Time, si: 1e-12 },
];

/// As [`Dimension::Fraction`]. Values are divided by a hundred: a factor of 0.01 would make 7 % another number than 0.07.
static PERCENT: Unit = Unit { spellings: &["%"], dimension: Dimension::Fraction, si: 0.01 };

impl Unit {
    /// The unit of this spelling.
    pub fn find(text: &str) -> Option<&'static Unit> {
        let text = text.trim();
        let all = LENGTHS.iter().chain(&UNITS).chain([&PERCENT]);
        all.into_iter().find(|unit| unit.spellings.contains(&text))
    }

    /// Why a text is no unit, and what is one: the unit that it is in other letters, or the usual ones.
    fn unknown(text: &str) -> String {
        let mut spellings = LENGTHS.iter().chain(&UNITS).flat_map(|unit| unit.spellings);
        match spellings.find(|s| s.eq_ignore_ascii_case(text)) {
            Some(near) => format!("{text:?} is no known unit, {near:?} is"),
            None => format!(
                "{text:?} is no known unit; units are m, mm, um, nm, Å; Pa, kPa, MPa, GPa, bar; N, mN, uN, nN; J/m2, mJ/m2; s, min, h; %"
            ),
        }
    }
}

impl Display for Unit {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        f.write_str(self.spellings[0])
    }
}

/// A number with or without a unit, as a person writes it: `20`, `20um`, `20 µm`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measure {
    pub value: f64,
    pub unit: Option<&'static Unit>,
}

impl Measure {
    /// A number in the caller's units.
    pub const fn plain(value: f64) -> Self {
        Measure { value, unit: None }
    }

    /// In SI units; a plain number is as it is.
    pub fn si(self) -> f64 {
        self.unit.map_or(self.value, |unit| self.value * unit.si)
    }

    /// As a multiple of another measure of the same dimension. In the same unit no rounding is added to that of the quotient.
    pub fn over(self, other: Measure) -> f64 {
        if self.unit == other.unit { self.value / other.value } else { self.si() / other.si() }
    }

    /// In this unit; a plain number is as it is.
    pub fn to(self, unit: &'static Unit) -> f64 {
        match self.unit {
            Some(own) if own != unit => self.value * (own.si / unit.si),
            _ => self.value,
        }
    }

    /// As a number, where it is a fraction or a plain one.
    pub fn fraction(self) -> f64 {
        if self.unit == Some(&PERCENT) { self.value / 100.0 } else { self.value }
    }

    /// This measure, if it has the dimension, or is plain.
    ///
    /// # Errors
    /// What is accepted.
    pub fn of(self, dimension: Dimension) -> Result<Self, String> {
        match self.unit.is_none_or(|unit| unit.dimension == dimension) {
            true => Ok(self),
            false => Err(dimension.accepted()),
        }
    }
}

impl FromStr for Measure {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let text = text.trim();
        // The longest start that is a number: `1e3` is one, `1e3m` has a unit.
        let ends = text.char_indices().map(|(i, c)| i + c.len_utf8()).rev();
        for end in ends.filter(|&end| text[..end].ends_with(|c: char| c.is_ascii_digit() || c == '.')) {
            let Ok(value) = text[..end].parse::<f64>() else { continue };
            let unit = match text[end..].trim() {
                "" => None,
                unit => Some(Unit::find(unit).ok_or_else(|| Unit::unknown(unit))?),
            };
            return Ok(Measure { value, unit });
        }
        // NaN and infinities are refused with the value that they are.
        text.parse().map(Measure::plain).map_err(|_| "a number, with or without a unit".into())
    }
}

impl Display for Measure {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        match self.unit {
            Some(unit) => write!(f, "{} {unit}", self.value),
            None => write!(f, "{}", self.value),
        }
    }
}

/// Measures in their order, as a person writes them: `1MPa,2MPa`, with ranges `log:1MPa:100MPa:5` and `lin:1MPa:2MPa:5`, both ends
/// included.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Measures(pub Vec<Measure>);

impl FromStr for Measures {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        if text.contains(',') && text.split(',').any(|entry| entry.trim().is_empty()) {
            return Err("a value before and after every comma".into());
        }
        let lists: Result<Vec<_>, _> = text.split(',').map(entry).collect();
        let list = lists?.concat();
        // Also of a zero, as in 0,5MPa: a decimal comma.
        let bare = list.iter().find(|m| m.unit.is_none());
        match bare.filter(|_| list.iter().any(|m| m.unit.is_some())) {
            Some(bare) => Err(format!(
                "{bare} has no unit: units at all values or at none, and decimal points, as commas separate values"
            )),
            None => Ok(Measures(list)),
        }
    }
}

/// Most values of one range.
pub const MOST_OF_A_RANGE: usize = 10_000;

const RANGE: &str = "a range is lin:FROM:TO:COUNT or log:FROM:TO:COUNT";

/// A measure, or those of a range.
fn entry(text: &str) -> Result<Vec<Measure>, String> {
    let (logarithmic, rest) = match text.trim().split_once(':') {
        None => return Ok(vec![text.parse()?]),
        Some(("log", rest)) => (true, rest),
        Some(("lin", rest)) => (false, rest),
        Some(_) => return Err(RANGE.into()),
    };
    let [from, to, count] = rest.split(':').collect::<Vec<_>>()[..] else { return Err(RANGE.into()) };
    let (from, to): (Measure, Measure) = (from.parse()?, to.parse()?);
    let count = count.trim().parse::<usize>().ok().filter(|n| (2..=MOST_OF_A_RANGE).contains(n));
    let count = count.ok_or_else(|| format!("a range has 2 to {MOST_OF_A_RANGE} values"))?;
    if from.unit.map(|u| u.dimension) != to.unit.map(|u| u.dimension) {
        return Err(format!("a range from {from} to {to} has no unit in common"));
    }
    let (a, b) = (from.value, from.unit.map_or(to.value, |unit| to.to(unit)));
    if !(a.is_finite() && b.is_finite()) {
        return Err("a range has finite ends".into());
    }
    if logarithmic && !(a > 0.0 && b > 0.0) {
        return Err("a logarithmic range has positive ends".into());
    }
    let share = |k: usize| k as f64 / (count - 1) as f64;
    let value = |k: usize| match logarithmic {
        _ if k == 0 => a,
        _ if k == count - 1 => b,
        false => a + (b - a) * share(k),
        true => a * (b / a).powf(share(k)),
    };
    Ok((0..count).map(|k| Measure { value: value(k), ..from }).collect())
}

/// A fraction as a person writes it: `0.05` or `5%`.
pub fn fraction(text: &str) -> Option<f64> {
    Some(text.parse::<Measure>().ok()?.of(Dimension::Fraction).ok()?.fraction())
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

    fn parsed(text: &str) -> Result<Measure, String> {
        text.parse()
    }

    #[test]
    fn numbers_have_units() {
        for (text, value, unit, si) in [
            ("100 um", 100.0, "um", 100.0 * 1e-6),
            ("1e3 µm", 1e3, "um", 1e-3),
            ("20um", 20.0, "um", 2e-5),
            ("1e-3m", 1e-3, "m", 1e-3),
            ("0.3 Å", 0.3, "\u{c5}", 0.3e-10),
            ("25 MPa", 25.0, "MPa", 25e6),
            ("2.5 GPa", 2.5, "GPa", 2.5e9),
            (".5mN", 0.5, "mN", 5e-4),
            ("0.5 mJ/m2", 0.5, "mJ/m2", 5e-4),
            ("0.05 N/m", 0.05, "J/m2", 0.05),
            ("-3 kPa", -3.0, "kPa", -3e3),
            ("0.002 eV/Å", 0.002, "eV/\u{c5}", 0.002 * 1.602_176_634e-9),
            ("300 K", 300.0, "K", 300.0),
            ("2 h", 2.0, "h", 7200.0),
        ] {
            let measure = parsed(text).expect(text);
            assert_eq!((measure.value, measure.unit.map(Unit::to_string)), (value, Some(unit.into())), "{text}");
            assert!((measure.si() / si - 1.0).abs() < 1e-15, "{text}: {}", measure.si());
            assert_eq!(parsed(&measure.to_string()), Ok(measure), "{text}");
        }
        assert_eq!(parsed(" 20 "), Ok(Measure::plain(20.0)));
    }

    #[test]
    fn what_is_no_number_with_a_known_unit_is_refused() {
        for text in ["", "um", "nan um", "-inf m", "1e", "1 2 um", "five um", "1,5 um"] {
            assert!(parsed(text).is_err(), "{text}: {:?}", parsed(text));
        }
        let values = ["nan", "inf", "1e400 um"].map(|text| parsed(text).map(|m| m.value.is_finite()));
        assert_eq!(values, [Ok(false), Ok(false), Ok(false)]);
        let usual = "; units are m, mm, um, nm, Å; Pa, kPa, MPa, GPa, bar; N, mN, uN, nN; J/m2, mJ/m2; s, min, h; %";
        for (text, unit, known) in [
            ("1 xm", "xm", usual),
            ("100 Mm", "Mm", ", \"mm\" is"),
            ("3 mpa", "mpa", ", \"MPa\" is"),
            ("2 J", "J", usual),
        ] {
            assert_eq!(parsed(text), Err(format!("{unit:?} is no known unit{known}")));
        }
    }

    #[test]
    fn a_wrong_dimension_is_answered_with_an_example() {
        let stress = parsed("100 MPa").expect("a stress");
        assert_eq!(stress.of(Dimension::Stress), Ok(stress));
        assert_eq!(stress.of(Dimension::Length), Err("a length with its unit, as \"100 um\"".into()));
        for dimension in [
            Dimension::Length,
            Dimension::Stress,
            Dimension::Force,
            Dimension::Work,
            Dimension::Energy,
            Dimension::Temperature,
            Dimension::Time,
            Dimension::Fraction,
            Dimension::Number,
        ] {
            assert!(parsed(dimension.example()).is_ok_and(|m| m.of(dimension).is_ok()), "{dimension:?}");
        }
    }

    #[test]
    fn ratios_in_one_unit_are_those_of_the_numbers() {
        let ratio = |a: &str, b: &str| parsed(a).expect(a).over(parsed(b).expect(b));
        assert_eq!(
            [ratio("20 um", "100 um"), ratio("3", "7"), ratio("0.1 MPa", "25 MPa")],
            [20.0 / 100.0, 3.0 / 7.0, 0.1 / 25.0]
        );
        assert_eq!(ratio("2.071 nm", "100 um"), 2.071 * 1e-9 / (100.0 * 1e-6));
    }

    #[test]
    fn lists_and_ranges_are_read() {
        let values =
            |text: &str| text.parse::<Measures>().map(|list| list.0.iter().map(|m| m.si()).collect::<Vec<_>>());
        assert_eq!(values("1,2.5,-3"), Ok(vec![1.0, 2.5, -3.0]));
        assert_eq!(values("1 kPa, 2kPa"), Ok(vec![1e3, 2e3]));
        assert_eq!(values("lin:0:1:5"), Ok(vec![0.0, 0.25, 0.5, 0.75, 1.0]));
        let logarithmic = values("log:1MPa:100MPa:3").expect("a range");
        assert_eq!((logarithmic[0], logarithmic[2]), (1e6, 1e8));
        assert!((logarithmic[1] / 1e7 - 1.0).abs() < 1e-15);
        assert_eq!(values("lin:1mm:2m:2,5um").map(|v| v.len()), Ok(3));
        for (text, why) in [
            ("log:0:1:5", "positive ends"),
            ("log:1:2:1", "2 to 10000"),
            ("lin:1:2:20000", "2 to 10000"),
            ("lin:1:2", "lin:FROM:TO:COUNT"),
            ("sqrt:1:2:3", "lin:FROM:TO:COUNT"),
            ("lin:1um:2MPa:3", "no unit in common"),
            ("lin:1um:2:3", "no unit in common"),
            ("1um,2", "2 has no unit"),
            ("0,5MPa", "0 has no unit"),
            ("1um,,2um", "a value before and after every comma"),
            ("log:1:inf:3", "finite ends"),
            ("lin:nan:1:3", "finite ends"),
        ] {
            assert!(values(text).is_err_and(|e| e.contains(why)), "{text}: {:?}", values(text));
        }
    }

    #[test]
    fn percentages_are_fractions() {
        assert_eq!(["0.05", "5%", " 7 % "].map(fraction), [Some(0.05), Some(0.05), Some(0.07)]);
        assert_eq!(["5 um", "five", "5 percent"].map(fraction), [None; 3]);
    }

    #[test]
    fn units_of_length_are_known_in_usual_spellings() {
        assert_eq!([" um", "µm", "\u{3bc}m"].map(metres_per), [Some(1e-6); 3]);
        assert_eq!([metres_per("Å"), metres_per("m"), metres_per("V")], [Some(1e-10), Some(1.0), None]);
    }
}
