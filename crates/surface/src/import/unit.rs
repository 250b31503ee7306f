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
    }
}
