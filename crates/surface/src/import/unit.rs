//! Names of units of length, as instruments and libraries write them.

use asperity_grid::units::metres_per;

/// Units that messages suggest.
pub(super) const ACCEPTED: &str = "a unit of length: m, mm, µm (um), nm, Å or pm";

/// A unit of length in the spelling of this program, which [`metres_per`] knows; `None` for other units.
pub(super) fn length_unit(text: &str) -> Option<String> {
    let text = text.trim().trim_matches(['[', ']', '(', ')', '"']).trim();
    if metres_per(text).is_some() {
        return Some(text.to_string());
    }
    let lower = text.to_lowercase();
    let known = match lower.strip_suffix('s').unwrap_or(&lower) {
        "~m" | "micrometer" | "micrometre" | "micro_meter" | "mikrometer" | "micron" => "µm",
        "nanometer" | "nanometre" => "nm",
        "millimeter" | "millimetre" => "mm",
        "centimeter" | "centimetre" => "cm",
        "meter" | "metre" => "m",
        "picometer" | "picometre" => "pm",
        "angstrom" | "ångström" | "ångstrom" | "angström" => "Å",
        _ => return None,
    };
    Some(known.to_string())
}

/// Whether a file states by this word that a number has no unit.
pub(super) fn is_none(text: &str) -> bool {
    matches!(text.trim(), "" | "1" | "-" | "none" | "None" | "dimensionless" | "px" | "pixel" | "pixels")
}

/// Whether a unit is of another quantity than a length. Counts and unknown words may be heights whose unit is given.
pub(super) fn is_other(text: &str) -> bool {
    const BASES: [&str; 31] = [
        "V", "A", "Hz", "N", "Pa", "K", "s", "J", "eV", "W", "F", "C", "T", "Ω", "Ohm", "rad", "g", "mol", "%", "°",
        "deg", "degree", "degrees", "Deg", "°C", "dB", "percent", "Volt", "volt", "Volts", "volts",
    ];
    const PREFIXES: [&str; 13] = ["", "f", "p", "n", "u", "µ", "μ", "m", "k", "M", "G", "T", "c"];
    let text = text.trim().trim_matches(['[', ']', '(', ')', '"']).trim();
    let one = |word: &str| PREFIXES.iter().any(|p| word.strip_prefix(p).is_some_and(|base| BASES.contains(&base)));
    // Products and quotients, as `V/m` and `N/m`.
    length_unit(text).is_none() && text.split(['/', '*', '·']).next().is_some_and(|word| one(word.trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spellings() {
        for (text, expected) in
            [("MicroMeters", "µm"), ("[nm]", "nm"), ("(um)", "um"), ("~m", "µm"), ("Metres", "m"), ("Ångström", "Å")]
        {
            let actual = length_unit(text).expect(text);
            assert_eq!(actual, expected);
            assert!(metres_per(&actual).is_some());
        }
        assert_eq!(["V", "deg", "", "cell extent in x"].map(length_unit), [None, None, None, None]);
        ["V", "mV", "%", "[deg]", "°", "nA", "Hz", "V/m", "MPa"].iter().for_each(|u| assert!(is_other(u), "{u}"));
        ["", "nm", "Å", "A", "counts", "a.u.", "cell extent in x", "m", "pm", "cm"]
            .iter()
            .for_each(|u| assert!(!is_other(u), "{u}"));
    }
}
