/// A number with three digits.
pub(crate) fn digits(value: f64) -> String {
    let rounded: f64 = format!("{value:.2e}").parse().expect("a number that was just written");
    if rounded == 0.0 || (1e-3..1e6).contains(&rounded.abs()) { format!("{rounded}") } else { format!("{rounded:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits_and_exponents_only_where_they_are_shorter() {
        let written = [0.0, 0.01234, -0.003, 1.0167, 123_456.0, 3.2e-7, -1.2345e9].map(digits);
        assert_eq!(written, ["0", "0.0123", "-0.003", "1.02", "123000", "3.2e-7", "-1.23e9"]);
    }
}
