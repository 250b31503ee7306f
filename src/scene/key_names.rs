//! Messages about a scene that was made from flags or arguments: they name these instead of the key.

use crate::Error;

/// A key of scenes and the flag or argument that sets it.
pub type KeyName = (&'static str, &'static str);

/// The error with names in place of keys. Of keys that begin alike the longest comes first.
pub fn rename_keys(error: Error, names: &[KeyName]) -> Error {
    match error {
        Error::Input { place, mut list } => {
            for complaint in &mut list {
                complaint.key = rename_keys_in(&complaint.key, names);
                complaint.found = rename_keys_in(&complaint.found, names);
                complaint.accepted = rename_keys_in(&complaint.accepted, names);
            }
            Error::Input { place, list }
        }
        other => other,
    }
}

/// A text with names in place of keys, without the index of a list's entry and written as on a command line.
pub fn rename_keys_in(text: &str, names: &[KeyName]) -> String {
    let mut text = text.to_string();
    for (key, name) in names {
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
            text = format!("{}{name}{rest}", &text[..at]);
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_renamed() {
        let names = [("load.pressure_mpa", "--pressure"), ("continuum.wall", "--wall")];
        assert_eq!(rename_keys_in("load.pressure_mpa[12]", &names), "--pressure");
        assert_eq!(
            rename_keys_in("only together with continuum.wall = \"penalty\" here", &names),
            "only together with --wall penalty here"
        );
        let error = Error::input("command line", "load.pressure_mpa[0]", -1, "a positive number");
        assert_eq!(
            rename_keys(error, &names).to_string(),
            "command line: --pressure = -1; accepted: a positive number"
        );
    }
}
