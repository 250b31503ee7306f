//! How stresses, lengths and works are written in the descriptions of laws, walls and bodies, and in messages.

/// Writes constants that are given in reduced units.
pub trait Notation {
    /// A length, over L.
    fn length(&self, over_length: f64) -> String;
    /// A stress, over E*.
    fn stress(&self, over_modulus: f64) -> String;
    /// An energy per area, over E* L.
    fn work(&self, reduced: f64) -> String;
}

/// As multiples of L, E* and E* L, with the digits that a number in other units needs.
pub struct Reduced;

/// With nine digits and no zeros behind them.
fn reduced(value: f64) -> String {
    format!("{:e}", format!("{value:.8e}").parse().unwrap_or(value))
}

impl Notation for Reduced {
    fn length(&self, over_length: f64) -> String {
        reduced(over_length) + " L"
    }

    fn stress(&self, over_modulus: f64) -> String {
        reduced(over_modulus) + " E*"
    }

    fn work(&self, work: f64) -> String {
        reduced(work) + " E*L"
    }
}

/// As plain numbers in the units of these scales.
pub struct PlainNotation {
    pub length: f64,
    pub modulus: f64,
}

impl Notation for PlainNotation {
    fn length(&self, over_length: f64) -> String {
        written(over_length * self.length)
    }

    fn stress(&self, over_modulus: f64) -> String {
        written(over_modulus * self.modulus)
    }

    fn work(&self, reduced: f64) -> String {
        written(reduced * self.modulus * self.length)
    }
}

/// With six digits, for a message.
pub fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

/// Whether a person writes a number without a power of ten.
pub fn is_ordinary(value: f64) -> bool {
    value == 0.0 || (1e-4..1e7).contains(&value.abs())
}

fn written(value: f64) -> String {
    let value = rounded(value);
    if is_ordinary(value) { value.to_string() } else { format!("{value:e}") }
}

/// A message of a solver, which knows reduced units alone (`3e-3 E*`, `0.1 L`, `2e-5 E*L`), in this notation. Other words stay.
pub fn in_notation(message: &str, notation: &dyn Notation) -> String {
    let mut words: Vec<String> = message.split(' ').map(str::to_string).collect();
    for i in (1..words.len()).rev() {
        let is_end = |c: char| matches!(c, ',' | ';' | ':' | ')');
        let unit = words[i].trim_end_matches(is_end);
        let write = match unit {
            "E*" => Notation::stress,
            "L" => Notation::length,
            "E*L" => Notation::work,
            _ => continue,
        };
        let number = words[i - 1].trim_start_matches('(');
        let Ok(value) = number.parse::<f64>() else { continue };
        let opening = &words[i - 1][..words[i - 1].len() - number.len()];
        let text = format!("{opening}{}{}", write(notation, value), &words[i][unit.len()..]);
        words.splice(i - 1..=i, [text]);
    }
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reduced_numbers_of_a_message_are_written_in_other_units() {
        let notation = PlainNotation { length: 20.0, modulus: 2.0 };
        for (message, expected) in [
            ("pressure = 1.5e-2 E*", "pressure = 0.03"),
            ("less than 1e-2 E*, at which", "less than 0.02, at which"),
            ("at x = 0.2500 L, y = 0.5 L", "at x = 5, y = 10"),
            ("a law (γ = 2e-5 E*L, ρ = 2.0000e-2 L)", "a law (γ = 0.0008, ρ = 0.4)"),
            ("at least 3.8e-9 E*: rounding", "at least 7.6e-9: rounding"),
            ("(-1e200 E*)", "(-2e200)"),
            // Neither is a number in reduced units.
            (
                "p* is pressure over E* times rms gradient, L 3 E*/10",
                "p* is pressure over E* times rms gradient, L 3 E*/10",
            ),
        ] {
            assert_eq!(in_notation(message, &notation), expected);
            assert_eq!(in_notation(&in_notation(message, &Reduced), &Reduced), in_notation(message, &Reduced));
        }
    }
}
