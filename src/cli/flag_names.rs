//! Messages about a scene that was made from flags: they name the flag instead of the key.

use crate::Error;

/// A key of scenes and the flag that sets it.
pub type FlagName = (&'static str, &'static str);

/// The error with flags in place of keys. Of keys that begin alike the longest comes first.
pub fn with_flags(error: Error, names: &[FlagName]) -> Error {
    match error {
        Error::Input { place, mut list } => {
            for complaint in &mut list {
                complaint.key = in_flags(&complaint.key, names);
                complaint.found = in_flags(&complaint.found, names);
                complaint.accepted = in_flags(&complaint.accepted, names);
            }
            Error::Input { place, list }
        }
        other => other,
    }
}

/// A text with flags in place of keys, without the index of a list's entry and written as on a command line.
pub fn in_flags(text: &str, names: &[FlagName]) -> String {
    let mut text = text.to_string();
    for (key, flag) in names {
        while let Some(at) = text.find(key) {
            let rest = &text[at + key.len()..];
            let rest = match rest.strip_prefix('[').and_then(|r| r.split_once(']')) {
                Some((index, rest)) if index.parse::<usize>().is_ok() => rest,
                _ => rest,
            };
            let rest = match rest.strip_prefix(" = \"").and_then(|r| r.split_once('"')) {
                Some((value, rest)) => format!(" {value}{rest}"),
                None => rest.to_string(),
            };
            text = format!("{}{flag}{rest}", &text[..at]);
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_become_flags() {
        let names = [("load.pressure_mpa", "--pressure"), ("continuum.wall", "--wall")];
        assert_eq!(in_flags("load.pressure_mpa[12]", &names), "--pressure");
        assert_eq!(
            in_flags("only together with continuum.wall = \"penalty\" here", &names),
            "only together with --wall penalty here"
        );
        let error = Error::input("command line", "load.pressure_mpa[0]", -1, "a positive number");
        assert_eq!(with_flags(error, &names).to_string(), "command line: --pressure = -1; accepted: a positive number");
    }
}
