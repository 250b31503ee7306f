/// A number with three digits.
pub(crate) fn digits(value: f64) -> String {
    let rounded: f64 = format!("{value:.2e}").parse().expect("a number that was just written");
    if rounded == 0.0 || (1e-3..1e6).contains(&rounded.abs()) { format!("{rounded}") } else { format!("{rounded:e}") }
}

/// A parameter with all its digits, with an exponent where that is shorter. The sixteenth is that of a change of units.
pub(crate) fn exact(value: f64) -> String {
    let value: f64 = format!("{value:.14e}").parse().expect("a number that was just written");
    let (plain, exponent) = (format!("{value}"), format!("{value:e}"));
    if exponent.len() < plain.len() { exponent } else { plain }
}

/// A number in words with the name of its unit, where that is known.
pub(crate) fn in_unit(number: String, unit: &str) -> String {
    if unit.is_empty() { number } else { format!("{number} {unit}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits_and_exponents_only_where_they_are_shorter() {
        let written = [0.0, 0.01234, -0.003, 1.0167, 123_456.0, 3.2e-7, -1.2345e9].map(digits);
        assert_eq!(written, ["0", "0.0123", "-0.003", "1.02", "123000", "3.2e-7", "-1.23e9"]);
        assert_eq!(
            [1.2345, 0.0000013, 3e8, -0.25, 1000.0000000000001].map(exact),
            ["1.2345", "1.3e-6", "3e8", "-0.25", "1e3"]
        );
    }
}
