//! A scene that TOML or its types refuse, told in the words of scenes: which key, what stands there, what is accepted.

use crate::Error;
use std::ops::Range;
use std::path::Path;
use toml::de::{DeTable, DeValue};

/// Longest piece of the file that a message repeats.
const REPEATED: usize = 60;

pub(super) fn refusal(error: &toml::de::Error, text: &str, file: &Path) -> Error {
    let span = error.span().filter(|s| text.get(s.clone()).is_some()).unwrap_or(0..0);
    let found = short(&text[span.clone()]);
    let line = 1 + text[..span.start].matches('\n').count();
    // No tree where the syntax is at fault, no place in it for what the whole file lacks.
    let tree = DeTable::parse(text).ok().filter(|_| !span.is_empty());
    let key = tree.and_then(|tree| key_at(tree.get_ref(), &span));
    let message = error.message();
    let told = if let Some(field) = message.strip_prefix("missing field ") {
        let table = key.map_or(String::new(), |k| k + ".");
        format!("{table}{} is missing and has no default", field.trim_matches('`'))
    } else if let Some(key) = key {
        match message.rsplit_once(", expected ") {
            Some((what, known)) if what.starts_with("unknown field") => {
                format!("{key} is no key of a scene; accepted: {}", list(known).replace('`', ""))
            }
            Some((what, known)) if what.starts_with("unknown variant") => {
                format!("{key} = {found}; accepted: {}", list(known).replace('`', "\""))
            }
            // A table in double brackets is a list of tables.
            Some(_) if found.starts_with("[[") => format!("{key} = {found}; accepted: one table, [{key}]"),
            Some((_, expected)) => format!("{key} = {found}; accepted: {}", plain(expected)),
            None if message == "wanted string or table" => format!("{key} = {found}; accepted: {}", plain("a string")),
            None => format!("{key} = {found}: {}", message.replace('\n', ", ")),
        }
    } else {
        let whole = text.lines().nth(line - 1).unwrap_or_default();
        format!("{}: {}", short(whole), message.replace('\n', ", "))
    };
    let line = (!span.is_empty() || !message.starts_with("missing field")).then_some(line);
    Error::Syntax { file: file.to_path_buf(), line, message: told }
}

/// Dotted path of what stands at `span`: a key, a value, an entry of a list, or a table by its header.
fn key_at(table: &DeTable, span: &Range<usize>) -> Option<String> {
    let holds = |outer: Range<usize>| outer.start <= span.start && span.end <= outer.end;
    table.iter().find_map(|(key, value)| {
        let name = key.get_ref();
        let deeper = match value.get_ref() {
            DeValue::Table(inner) => key_at(inner, span).map(|path| format!("{name}.{path}")),
            DeValue::Array(entries) => entries
                .iter()
                .position(|e| holds(e.span()) && e.span() != value.span())
                .map(|index| format!("{name}[{index}]")),
            _ => None,
        };
        deeper.or_else(|| (holds(key.span()) || holds(value.span())).then(|| name.to_string()))
    })
}

/// The names of a message, without the words around them.
fn list(known: &str) -> &str {
    known.strip_prefix("one of ").unwrap_or(known)
}

/// What a type of Rust is to somebody who writes a scene.
fn plain(expected: &str) -> &str {
    match expected {
        "f32" | "f64" => "a number",
        "usize" | "u8" | "u16" | "u32" | "u64" => "a whole number, zero or above",
        "i8" | "i16" | "i32" | "i64" => "a whole number",
        "a string" | "path string" => "a text in quotes",
        "a boolean" => "true or false",
        // Loads are the only list that a scene has.
        "a sequence" => "a list of numbers, such as [0.01, 0.03]",
        other if other.starts_with("struct ") => "a table",
        other => other,
    }
}

fn short(text: &str) -> String {
    let first = text.lines().next().unwrap_or_default().trim();
    let whole = first.len() == text.trim().len() && first.chars().count() <= REPEATED;
    if whole { first.to_string() } else { first.chars().take(REPEATED).collect::<String>() + " …" }
}

#[cfg(test)]
mod tests {
    use crate::scene::Scene;
    use std::path::Path;

    #[test]
    fn no_word_of_rust_reaches_the_user() {
        let whole = "a whole number, zero or above";
        for (text, expected) in [
            ("name = 1\n[load]\np_star = [1]", "line 1: name = 1; accepted: a text in quotes"),
            ("name = \"a\"\n[surface]\nhurst = \"x\"", "line 3: surface.hurst = \"x\"; accepted: a number"),
            ("name = \"a\"\n[surface]\ngrid = 1.5", &format!("line 3: surface.grid = 1.5; accepted: {whole}")),
            ("name = \"a\"\n[surface]\nseed = -1", &format!("line 3: surface.seed = -1; accepted: {whole}")),
            ("name = \"a\"\n[surface]\nheights = 3", "line 3: surface.heights = 3; accepted: a text in quotes"),
            ("name = \"a\"\n[surface]\ntouching = 3", "line 3: surface.touching = 3; accepted: a text in quotes"),
            (
                "name = \"a\"\n[surface]\ntouching = \"all\"",
                "line 3: surface.touching = \"all\"; accepted: \"low-points\" or \"high-points\"",
            ),
            (
                "name = \"a\"\n[surface]\n[load]\np_star = 1",
                "line 4: load.p_star = 1; accepted: a list of numbers, such as [0.01, 0.03]",
            ),
            (
                "name = \"a\"\n[surface]\n[load]\np_star = [\n  1,\n  \"x\",\n]",
                "line 6: load.p_star[1] = \"x\"; accepted: a number",
            ),
            ("name = \"a\"\nsurface = 3", "line 2: surface = 3; accepted: a table"),
            ("name = \"a\"\n[surface]\n[[load]]\np_star = [1]", "line 3: load = [[load]]; accepted: one table, [load]"),
            ("name = \"a\"\n[surface]", "a.toml: load is missing and has no default"),
            (
                "name = \"a\"\n[surface]\n[load]\np_star = [1]\n[continuum.layer]\npoisson = 0.3",
                "line 5: continuum.layer.thickness_um is missing and has no default",
            ),
            (
                "name = \"a\"\n[load]\np_stars = [1]",
                "line 3: load.p_stars is no key of a scene; accepted: p_star, mean_gap_um, pull_off",
            ),
            ("name = \"a\"\n[load]\np_star: 1", "line 3: p_star: 1: key with no value, expected `=`"),
        ] {
            let told = Scene::parse(text, Path::new("a.toml")).expect_err(text).to_string();
            assert!(told.starts_with("a.toml") && told.ends_with(expected), "{told}");
        }
    }
}
