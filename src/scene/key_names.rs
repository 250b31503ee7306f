//! Messages about a scene that was made from flags or arguments: they name these instead of the key.

use crate::Error;

/// Tables whose keys flags and arguments set.
const TABLES: [&str; 6] = ["laboratory.", "surface.", "load.", "adhesion.", "continuum.", "accuracy."];

/// What sets a dotted key, if anything does.
pub type NameOf<'a> = dyn Fn(&str) -> Option<String> + 'a;

/// The error with names in place of keys.
pub fn rename_keys(error: Error, name: &NameOf) -> Error {
    match error {
        Error::Input { place, mut list } => {
            for complaint in &mut list {
                complaint.key = rename_keys_in(&complaint.key, name);
                complaint.found = rename_keys_in(&complaint.found, name);
                complaint.accepted = rename_keys_in(&complaint.accepted, name);
            }
            Error::Input { place, list }
        }
        other => other,
    }
}

/// A text with names in place of keys, without the index of a list's entry and with values as on a command line.
pub fn rename_keys_in(text: &str, name: &NameOf) -> String {
    let mut done = String::new();
    let mut remainder = text;
    while let Some((before, key, after)) = next_key(remainder) {
        done += before;
        match name(key) {
            None => (done, remainder) = (done + key, after),
            Some(name) => {
                done += &name;
                remainder = without_index(after);
                match remainder.strip_prefix(" = \"").and_then(|r| r.split_once('"')) {
                    Some((value, after)) => (done, remainder) = (done + " " + value, after),
                    // A flag that is given has no value.
                    None => remainder = remainder.strip_prefix(" = false").unwrap_or(remainder),
                }
            }
        }
    }
    done + remainder
}

/// The first dotted key of a text, with what is before and after it.
fn next_key(text: &str) -> Option<(&str, &str, &str)> {
    let part_of_word = |c: char| c.is_alphanumeric() || "_./-".contains(c);
    let begins = |at: &usize| !text[..*at].ends_with(part_of_word);
    let goes_on = |(at, table): &(usize, &str)| text[at + table.len()..].starts_with(|c: char| c.is_ascii_lowercase());
    let found = TABLES.iter().flat_map(|table| text.match_indices(table)).filter(goes_on);
    let start = found.map(|(at, _)| at).filter(begins).min()?;
    let of_key = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "_.".contains(c);
    let end = text[start..].find(|c| !of_key(c)).map_or(text.len(), |n| start + n);
    let key = text[start..end].trim_end_matches('.');
    Some((&text[..start], key, &text[start + key.len()..]))
}

/// What follows the index of an entry, and the name of a field of the entry: a flag gives it as a whole.
fn without_index(text: &str) -> &str {
    let index = text.strip_prefix('[').and_then(|rest| rest.split_once(']'));
    let Some((_, rest)) = index.filter(|(index, _)| index.parse::<usize>().is_ok()) else { return text };
    let field = rest.strip_prefix('.').filter(|field| field.starts_with(|c: char| c.is_ascii_lowercase()));
    field.map_or(rest, |field| field.trim_start_matches(|c: char| c.is_ascii_lowercase() || c == '_'))
}

/// The last part of a dotted key.
pub fn last_part(key: &str) -> &str {
    key.rsplit('.').next().unwrap_or(key)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_renamed() {
        let flag = |key: &str| (last_part(key) != "txt").then(|| format!("--{}", last_part(key).replace('_', "-")));
        for (text, renamed) in [
            ("load.pressure[12]", "--pressure"),
            ("laboratory.bodies[0].poisson. It", "--bodies. It"),
            ("only together with continuum.wall = \"penalty\" here", "only together with --wall penalty here"),
            ("continuum.layer.thickness or load.pull_off.", "--thickness or --pull-off."),
            ("continuum.periodic = false", "--periodic"),
            (
                "maps/surface.txt, surface.txt of the surface. A sum",
                "maps/surface.txt, surface.txt of the surface. A sum",
            ),
        ] {
            assert_eq!(rename_keys_in(text, &flag), renamed);
        }
        let error = Error::input("command line", "load.pressure[0]", -1, "a positive number");
        assert_eq!(rename_keys(error, &flag).to_string(), "command line: --pressure = -1; accepted: a positive number");
    }
}
