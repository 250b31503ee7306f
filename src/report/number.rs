//! Number formatting: significant digits, SI prefixes, powers of ten. The space before a unit is non-breaking.

use crate::record::given_loads::{GivenLoads, LoadQuantity};
use crate::record::results::ScalesSi;
use asperity_contact::interface::Notation;
use asperity_contact::quantity::Quantity;
use asperity_grid::units::Scales;

const SUPERSCRIPTS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];

/// `-12` as `⁻¹²`.
pub fn superscript(exponent: i32) -> String {
    let digits = exponent.unsigned_abs().to_string();
    let sign = if exponent < 0 { "⁻" } else { "" };
    sign.chars().chain(digits.bytes().map(|d| SUPERSCRIPTS[usize::from(d - b'0')])).collect()
}

/// `x` to `n` significant digits: plain between 10⁻³ and 10⁵, otherwise as `1.23×10⁻⁷`. Zero is `0`.
pub fn significant(x: f64, n: usize) -> String {
    if x == 0.0 {
        return "0".into();
    }
    if !x.is_finite() {
        return x.to_string();
    }
    // Rounding can change the exponent: 9.996 to three digits is 10.0.
    let rounded = format!("{:.*e}", n.max(1) - 1, x.abs());
    let (mantissa, exponent) = rounded.split_once('e').unwrap_or((&rounded, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let sign = if x < 0.0 { "−" } else { "" };
    if (-3..5).contains(&exponent) {
        let decimals = (n as i32 - 1 - exponent).max(0) as usize;
        // Rounded digits before the decimal point become zeros.
        let value: f64 = rounded.parse().unwrap_or(x.abs());
        return format!("{sign}{value:.decimals$}");
    }
    format!("{sign}{mantissa}×10{}", superscript(exponent))
}

/// [`significant`] without trailing zeros, for axis ticks and input values.
pub fn trimmed(x: f64, n: usize) -> String {
    let text = significant(x, n);
    let (number, power) = text.split_once('×').map_or((text.as_str(), None), |(m, p)| (m, Some(p)));
    let number =
        if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number }.to_string();
    match power {
        Some(power) if number == "1" => power.to_string(),
        Some(power) => format!("{number}×{power}"),
        None => number,
    }
}

/// [`significant`] with a unit.
pub fn with_unit(x: f64, n: usize, unit: &str) -> String {
    format!("{}\u{a0}{unit}", significant(x, n))
}

impl LoadQuantity {
    /// Head of a column of loads.
    pub fn head(self) -> &'static str {
        match self {
            LoadQuantity::PStar => "p*",
            LoadQuantity::Pressure => "pressure",
            LoadQuantity::Force => "force",
        }
    }

    /// A load, as p*, in Pa or in N, in such a column: `0.01`, `10 MPa`, `5 µN`.
    pub fn value(self, load: f64) -> String {
        self.unit().map_or_else(|| trimmed(load, 4), |unit| si_given(load, unit))
    }

    /// What a value follows in a sentence: `p* = `, or nothing.
    pub fn symbol(self) -> &'static str {
        if self == LoadQuantity::PStar { "p* = " } else { "" }
    }

    /// A load, as p*, in Pa or in N, in a sentence: `p* = 0.01`, `10 MPa`.
    pub fn label(self, load: f64) -> String {
        self.symbol().to_string() + &self.value(load)
    }

    /// The unit of an axis on which `largest` is the largest load, both as p*, in Pa or in N, and its label.
    pub(super) fn axis(self, largest: f64) -> (f64, String) {
        let name = match self {
            LoadQuantity::PStar => "reduced load p*",
            LoadQuantity::Pressure => "mean pressure",
            LoadQuantity::Force => "normal force",
        };
        let Some(unit) = self.unit() else { return (1.0, name.into()) };
        let (scale, prefix) = si_scale(largest);
        (scale, format!("{name} ({prefix}{unit})"))
    }

    fn unit(self) -> Option<&'static str> {
        match self {
            LoadQuantity::PStar => None,
            LoadQuantity::Pressure => Some("Pa"),
            LoadQuantity::Force => Some("N"),
        }
    }
}

impl GivenLoads {
    /// As [`LoadQuantity::head`].
    pub fn head(self) -> &'static str {
        self.quantity.head()
    }

    /// A load p* as [`LoadQuantity::value`].
    pub fn value(self, p_star: f64) -> String {
        self.quantity.value(p_star * self.of_p_star)
    }

    /// A load p* as [`LoadQuantity::label`].
    pub fn label(self, p_star: f64) -> String {
        self.quantity.label(p_star * self.of_p_star)
    }

    /// The load p* = 1 on an axis up to the load `largest`, as p*, and the label of the axis.
    pub(super) fn axis(self, largest: f64) -> (f64, String) {
        let (unit, label) = self.quantity.axis(largest * self.of_p_star);
        (self.of_p_star / unit, label)
    }
}

/// Constants of laws, walls and bodies with SI units.
pub struct SiNotation(pub Scales);

impl Notation for SiNotation {
    fn length(&self, over_length: f64) -> String {
        si_given(over_length * self.0.length_m, "m")
    }

    fn stress(&self, over_modulus: f64) -> String {
        si_given(over_modulus * self.0.modulus_pa, "Pa")
    }

    fn work(&self, reduced: f64) -> String {
        si_given(reduced * self.0.modulus_pa * self.0.length_m, "J/m²")
    }
}

impl ScalesSi {
    /// Pa/m of a stiffness of one E*/L.
    pub(super) fn stiffness(self) -> f64 {
        self.modulus_pa / self.length_m
    }
}

/// Micrometres of a metre.
pub(super) const UM: f64 = 1e6;

/// A length in m.
pub fn length(v: f64, n: usize) -> String {
    si(v, "m", n)
}

/// A stress in Pa.
pub fn stress(v: f64, n: usize) -> String {
    si(v, "Pa", n)
}

/// An energy per area in J/m².
pub fn work(v: f64) -> String {
    si(v, "J/m²", 3)
}

/// A fraction in per cent with three digits; below one in a million as a power of ten.
pub fn percent(fraction: f64) -> String {
    with_unit(100.0 * fraction, 3, "%")
}

/// An error of a quantity in its usual unit.
pub fn error_of(quantity: Quantity, error: f64) -> String {
    if quantity.in_decades() { format!("{} decades", significant(error, 2)) } else { with_unit(100.0 * error, 2, "%") }
}

/// A relative change, or a bound of one. Values above 100 % are not stated exactly.
pub fn change(relative: Option<f64>, is_bound: bool) -> String {
    match relative {
        None => "–".into(),
        Some(c) if c > 1.0 && !is_bound => "more than 100\u{a0}%".into(),
        Some(c) if c > 1.0 => "–".into(),
        Some(c) if is_bound => format!("below {}", percent(c)),
        Some(c) => percent(c),
    }
}

/// `value` (in `unit`, without prefix) with the SI prefix that leaves one to three digits before the point.
pub fn si(value: f64, unit: &str, n: usize) -> String {
    let (scaled, prefix) = si_scale(value);
    format!("{}\u{a0}{prefix}{unit}", significant(value / scaled, n))
}

/// A stiffness in Pa/m with the length unit of a cell of `length_m`: stress per mm, µm or nm, not per metre.
pub fn stiffness(value: f64, length_m: f64, n: usize) -> String {
    let (scale, unit) = unit_of_stiffness(length_m);
    si(value * scale, unit, n)
}

/// A stiffness with its error, as [`with_error`].
pub fn stiffness_with_error(value: f64, error: f64, length_m: f64) -> (String, String) {
    let (scale, unit) = unit_of_stiffness(length_m);
    with_error(value * scale, error * scale, unit)
}

/// The unit of stiffnesses for a cell of `length_m`, over Pa/m, and its name.
pub(super) fn unit_of_stiffness(length_m: f64) -> (f64, &'static str) {
    match length_m {
        l if l >= 0.1 => (1e-3, "Pa/mm"),
        l if l >= 1e-6 => (1e-6, "Pa/µm"),
        _ => (1e-9, "Pa/nm"),
    }
}

/// An error over its value that is rounding.
const ROUNDING: f64 = 1e-12;

/// A value and its error in a unit without prefixes: the error with two digits, the value to the same last digit, and to six at most.
pub fn to_error(value: f64, error: f64) -> String {
    let exponent = |v: f64| format!("{v:.1e}").split_once('e').and_then(|(_, e)| e.parse::<i32>().ok()).unwrap_or(0);
    let error = error.abs();
    if value.abs() < error {
        // To the last digit of the error.
        let last = 10f64.powi(exponent(error) - 1);
        return format!("{} ± {}", significant((value / last).round() * last, 2), significant(error, 2));
    }
    let digits = (exponent(value.abs()) - exponent(error) + 2).clamp(1, 6) as usize;
    format!("{} ± {}", significant(value, if error == 0.0 { 6 } else { digits }), significant(error, 2))
}

/// A value and its error in `unit`, both with the SI prefix of the value and the same last digit: `("633", " ± 11 nm")`. The
/// error has two digits. An error below 10⁻⁴ of the value does not set its digits.
pub fn with_error(value: f64, error: f64, unit: &str) -> (String, String) {
    let larger = value.abs().max(error.abs());
    let (scale, prefix) = if ["", "%"].contains(&unit) { (1.0, "") } else { si_scale(larger) };
    let (value, error) = (value / scale, error.abs() / scale);
    let unit = if unit.is_empty() { String::new() } else { format!("\u{a0}{prefix}{unit}") };
    if error == 0.0 || error < 1e-4 * value.abs() {
        let error = if error < ROUNDING * value.abs() { 0.0 } else { error };
        return (significant(value, 3), format!(" ± {}{unit}", significant(error, 2)));
    }
    // `9.96` to two digits is `10`: the exponent after rounding.
    let exponent: i32 = format!("{error:.1e}").split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0);
    let decimals = (1 - exponent).clamp(0, 6) as usize;
    let plain = |v: f64| format!("{v:.decimals$}").replace('-', "−");
    (plain(value), format!(" ± {}{unit}", plain(error)))
}

/// A value in `unit`, without prefix, with its error where it is known: otherwise to four digits.
pub fn si_with_error(value: f64, error: Option<f64>, unit: &str) -> String {
    let Some(error) = error else { return si(value, unit, 4) };
    let (value, error) = with_error(value, error, unit);
    value + &error
}

/// [`si`] for an input value: up to four digits, without trailing zeros.
pub fn si_given(value: f64, unit: &str) -> String {
    let (scaled, prefix) = si_scale(value);
    format!("{}\u{a0}{prefix}{unit}", trimmed(value / scaled, 4))
}

/// Factor and prefix of [`si`], for axes whose ticks use a common prefix.
pub fn si_scale(value: f64) -> (f64, &'static str) {
    // 0.9995 would be printed as 1000 of the next smaller unit.
    match value.abs() * 1.0005 {
        v if v == 0.0 || !v.is_finite() => (1.0, ""),
        v if v >= 1e12 => (1e12, "T"),
        v if v >= 1e9 => (1e9, "G"),
        v if v >= 1e6 => (1e6, "M"),
        v if v >= 1e3 => (1e3, "k"),
        v if v >= 1.0 => (1.0, ""),
        v if v >= 1e-3 => (1e-3, "m"),
        v if v >= 1e-6 => (1e-6, "µ"),
        v if v >= 1e-9 => (1e-9, "n"),
        _ => (1e-12, "p"),
    }
}

pub fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 0.0005 => "< 1 ms".into(),
        s if s < 1.0 => format!("{:.0}\u{a0}ms", 1e3 * s),
        s if s < 99.5 => format!("{}\u{a0}s", significant(s, 2)),
        s if s < 3600.0 => format!("{}\u{a0}min {:02}\u{a0}s", s.round() as u64 / 60, s.round() as u64 % 60),
        s => format!("{}\u{a0}h {:02}\u{a0}min", (s / 60.0).round() as u64 / 60, (s / 60.0).round() as u64 % 60),
    }
}

pub fn memory(bytes: u64) -> String {
    match bytes as f64 {
        b if b < 1e6 => format!("{:.0}\u{a0}kB", b / 1e3),
        b if b < 1e9 => format!("{:.0}\u{a0}MB", b / 1e6),
        b => format!("{:.1}\u{a0}GB", b / 1e9),
    }
}

/// 1234567 as `1 234 567`, with non-breaking spaces.
pub fn count(n: usize) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, d) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) && digits.len() > 4 {
            text.push('\u{202f}');
        }
        text.push(d);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_and_powers() {
        let cases = [
            (0.0, "0"),
            (1.0, "1.00"),
            (9.996, "10.0"),
            (0.001234, "0.00123"),
            (-0.02, "−0.0200"),
            (12345.0, "12300"),
            (123456.0, "1.23×10⁵"),
            (2e-5, "2.00×10⁻⁵"),
        ];
        for (x, text) in cases {
            assert_eq!(significant(x, 3), text);
        }
        assert_eq!(trimmed(0.02, 3), "0.02");
        assert_eq!(trimmed(2e-5, 3), "2×10⁻⁵");
        assert_eq!(trimmed(1e-5, 3), "10⁻⁵");
        assert_eq!(trimmed(100.0, 3), "100");
        assert_eq!(percent(0.03214), "3.21\u{a0}%");
    }

    #[test]
    fn units_times_and_sizes() {
        assert_eq!(si(1e-4, "m", 3), "100\u{a0}µm");
        assert_eq!(si(0.99999, "m", 3), "1.00\u{a0}m");
        assert_eq!(si(2.857e10, "Pa", 4), "28.57\u{a0}GPa");
        assert_eq!(si(0.0, "m", 3), "0\u{a0}m");
        assert_eq!(si_given(9.7797e-8, "m"), "97.8\u{a0}nm");
        assert_eq!(stiffness(1.93e12, 1e-4, 3), "1.93\u{a0}MPa/µm");
        assert_eq!(stiffness(2.5e18, 2.5e-8, 3), "2.50\u{a0}GPa/nm");
        let errors = [
            (8.104, 2.17, "%"),
            (22.0, 0.686, "%"),
            (6.33e-7, 1.11e-8, "m"),
            (100.0, 0.0996, "%"),
            (1.0, 0.0, "m"),
            (0.849, 0.026, ""),
        ];
        let shown = errors.map(|(v, e, unit)| with_error(v, e, unit)).map(|(v, e)| (v + &e).replace('\u{a0}', " "));
        assert_eq!(
            shown,
            ["8.1 ± 2.2 %", "22.00 ± 0.69 %", "633 ± 11 nm", "100.00 ± 0.10 %", "1.00 ± 0 m", "0.849 ± 0.026"]
        );
        let plain =
            [(157.31, 2.1), (129.71, 75.0), (3.59225e-4, 3.4e-5), (0.1, 1e-9), (-2.6, 30.0), (3e-7, 0.038), (7.0, 0.0)];
        assert_eq!(
            plain.map(|(v, e)| to_error(v, e)),
            [
                "157.3 ± 2.1",
                "130 ± 75",
                "3.59×10⁻⁴ ± 3.4×10⁻⁵",
                "0.100000 ± 1.0×10⁻⁹",
                "−3.0 ± 30",
                "0 ± 0.038",
                "7.00000 ± 0"
            ]
        );
        assert_eq!(with_error(100.0, 1e-14, "%").1, " ± 0\u{a0}%");
        assert_eq!(with_error(1e-13, 3.8e-8, "m"), ("0".into(), " ± 38\u{a0}nm".into()));
        let times = [0.0, 0.25, 12.34, 99.6, 3599.6, 7300.0].map(|s| duration(s).replace('\u{a0}', " "));
        assert_eq!(times, ["< 1 ms", "250 ms", "12 s", "1 min 40 s", "60 min 00 s", "2 h 02 min"]);
        assert_eq!(memory(1_500_000_000), "1.5\u{a0}GB");
        assert_eq!(count(3062500), "3\u{202f}062\u{202f}500");
        assert_eq!(count(1024), "1024");
    }
}
