//! Reading a scene file. Errors of syntax and of types name key, value and accepted values, with the line.

use super::model::Scene;
use super::quantity::REASON;
use super::schema::tables_with;
use crate::{Error, Result};
use asperity_surface::files::atomic_file::read_text;
use asperity_surface::import::holds_numbers;
use serde::Deserialize;
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

impl Scene {
    /// Reads a scene file.
    ///
    /// # Errors
    /// Syntax, unknown keys and wrong types, each with its line.
    pub fn read(path: &Path) -> Result<Scene> {
        if holds_numbers(path)? {
            let accepted =
                "a scene (TOML): `asperity init FILE` writes one for a surface, `asperity solve FILE` needs none";
            return Err(Error::format(path, "a surface file", accepted));
        }
        let text = read_text(path)?;
        if text.trim().is_empty() {
            return Err(Error::format(path, "an empty file", "a scene (TOML), or a surface"));
        }
        if toml::from_str::<toml::Table>(&text).is_ok_and(|table| table.contains_key("over")) {
            return Err(Error::format(path, "a sweep", "a scene: `asperity sweep FILE` runs those of a sweep"));
        }
        Self::parse(&text, path)
    }

    pub fn parse(text: &str, path: &Path) -> Result<Scene> {
        toml::from_str(text).map_err(|e| syntax_error(e, text, path))
    }
}

/// Longest excerpt of the file in a message, characters.
const REPEATED: usize = 60;

/// Most errors of a text that are reported: each costs a deserialisation of the whole text, and nobody reads more.
const MOST_REPORTED: usize = 20;

/// Most changes of the tree of a text: one that does not help is not repeated for ever.
const MOST_REPAIRED: usize = 4 * MOST_REPORTED;

/// The type errors of a text, up to [`MOST_REPORTED`]. Deserialisation stops at the first one, so the tree is repaired there and deserialised again.
pub(super) fn syntax_error(first: toml::de::Error, text: &str, file: &Path) -> Error {
    let whole = DeTable::parse(text).ok();
    let places = whole.as_ref().map(|tree| tree.get_ref());
    let mut list = vec![complaint_of(&first, text, places)];
    let mut error = first;
    let mut more = false;
    let mut stand_ins = StandIns { text, count: 0 };
    if let Some(mut tree) = whole.clone() {
        while stand_ins.repair(tree.get_mut(), &error) {
            more = list.len() == MOST_REPORTED;
            if more {
                break;
            }
            match Scene::deserialize(toml::de::Deserializer::from(tree.clone())) {
                Ok(_) => break,
                Err(next) => error = next,
            }
            if stand_ins.is_about_one(&error) {
                continue;
            }
            let complaint = complaint_of(&error, text, places);
            // An error that cannot be repaired would repeat for ever.
            if list.contains(&complaint) {
                break;
            }
            list.push(complaint);
        }
    }
    // In the order of the file. A missing key has no line and comes last.
    list.sort_by_key(|(line, _)| line.unwrap_or(usize::MAX));
    if more {
        list.push((None, format!("and perhaps more: only the first {MOST_REPORTED} faults found are listed")));
    }
    Error::Syntax { file: file.to_path_buf(), list }
}

/// Values that stand for missing ones. Each has a place of its own behind the text, by which it is found again.
struct StandIns<'t> {
    text: &'t str,
    count: usize,
}

impl StandIns<'_> {
    /// Whether an error is that a stand-in is of another type.
    fn is_about_one(&self, error: &toml::de::Error) -> bool {
        error.span().is_some_and(|span| span.start > self.text.len())
    }

    /// Removes the key or value of an error from the tree, or replaces it by one of the right type. Whether that was possible.
    fn repair<'i>(&mut self, tree: &mut DeTable<'i>, error: &toml::de::Error) -> bool {
        self.count += 1;
        if self.count > MOST_REPAIRED {
            return false;
        }
        let span = error.span().filter(|s| self.is_about_one(error) || self.text.get(s.clone()).is_some());
        let span = span.unwrap_or(0..0);
        let path = if span.is_empty() { None } else { key_at(tree, &span) };
        let message = error.message();
        if let Some(field) = message.strip_prefix("missing field ") {
            let field = field.trim_matches('`').to_string();
            // The required tables and texts; most others are numbers, or else are replaced next.
            let value = match field.as_str() {
                "name" => text_value("repaired"),
                "surface" | "load" => DeValue::Table(DeTable::new()),
                _ => number(),
            };
            let Some(table) = table_at(tree, path.as_deref()) else { return false };
            let place = self.text.len() + self.count..self.text.len() + self.count + 1;
            return table.insert(Spanned::new(0..0, field.into()), Spanned::new(place, value)).is_none();
        }
        let Some(path) = path else { return false };
        let (above, key) = path.rsplit_once('.').map_or((None, path.as_str()), |(above, key)| (Some(above), key));
        // An entry of a list stands for the list.
        let (key, in_list) = key.split_once('[').map_or((key, false), |(key, _)| (key, true));
        let Some(table) = table_at(tree, above) else { return false };
        let stand_in = match message.rsplit_once(", expected ") {
            _ if in_list => Some(DeValue::Array(DeArray::new())),
            Some((what, _)) if what.starts_with("unknown field") => None,
            // Without a value a required key would be reported as missing.
            Some((what, known)) if what.starts_with("unknown variant") => known.split('`').nth(1).map(text_value),
            Some((_, expected)) => of_type(expected),
            None => None,
        };
        let Some(old) = table.remove(key) else { return false };
        // Required keys get a value; the others are left out.
        if let Some(value) = stand_in {
            table.insert(Spanned::new(0..0, key.to_string().into()), Spanned::new(old.span(), value));
        }
        true
    }
}

/// A value of the type that a message expects.
fn of_type<'i>(expected: &str) -> Option<DeValue<'i>> {
    match expected {
        "f32" | "f64" | "usize" | "u8" | "u16" | "u32" | "u64" | "i8" | "i16" | "i32" | "i64" => Some(number()),
        "a string" => Some(text_value("repaired")),
        "a sequence" => Some(DeValue::Array(DeArray::new())),
        list if list.starts_with("a list") => Some(DeValue::Array(DeArray::new())),
        kind if kind.starts_with("struct ") => Some(DeValue::Table(DeTable::new())),
        // A quantity: the example.
        other => other.split('"').nth(1).map(text_value),
    }
}

fn text_value<'i>(text: &str) -> DeValue<'i> {
    DeValue::String(text.to_string().into())
}

/// A number that serves as a whole one, too.
fn number<'i>() -> DeValue<'i> {
    DeValue::parse("1").expect("a number of TOML").into_inner()
}

/// The table at a dotted path.
fn table_at<'t, 'i>(tree: &'t mut DeTable<'i>, path: Option<&str>) -> Option<&'t mut DeTable<'i>> {
    path.into_iter().flat_map(|p| p.split('.')).try_fold(tree, |table, key| match table.get_mut(key)?.get_mut() {
        DeValue::Table(inner) => Some(inner),
        _ => None,
    })
}

/// One error as key, value and accepted values, with its line.
fn complaint_of(error: &toml::de::Error, text: &str, tree: Option<&DeTable>) -> (Option<usize>, String) {
    let span = error.span().filter(|s| text.get(s.clone()).is_some()).unwrap_or(0..0);
    let fragment = short(&text[span.clone()]);
    let line = 1 + text[..span.start].matches('\n').count();
    // There is no tree after a syntax error, and no place in it for a missing top-level table.
    let key = tree.filter(|_| !span.is_empty()).and_then(|tree| key_at(tree, &span));
    let message = error.message();
    let complaint = if let Some(field) = message.strip_prefix("missing field ") {
        let table = key.map_or(String::new(), |k| k + ".");
        format!("{table}{} is missing and has no default", field.trim_matches('`'))
    } else if let Some(key) = key {
        match message.rsplit_once(", expected ") {
            Some((what, known)) if what.starts_with("unknown field") => {
                let known = list(known).replace('`', "");
                let near = nearest(&key, &known).map(str::to_string).or_else(|| elsewhere(&key));
                let suggestion = near.map_or(String::new(), |suggestion| format!(" ({suggestion} is one)"));
                format!("{key} is no key of a scene{suggestion}; accepted: {known}")
            }
            Some((what, known)) if what.starts_with("unknown variant") => {
                format!("{key} = {fragment}; accepted: {}", list(known).replace('`', "\""))
            }
            // A table in double brackets is a list of tables.
            Some(_) if fragment.starts_with("[[") => format!("{key} = {fragment}; accepted: one table, [{key}]"),
            Some((what, expected)) => {
                let reason = what.strip_prefix(REASON).map_or(String::new(), |reason| format!(" ({reason})"));
                format!("{key} = {fragment}{reason}; accepted: {}", plain(expected))
            }
            None if message == "wanted string or table" => {
                format!("{key} = {fragment}; accepted: {}", plain("a string"))
            }
            None => format!("{key} = {fragment}: {}", message.replace('\n', ", ")),
        }
    } else {
        let whole = text.lines().nth(line - 1).unwrap_or_default();
        format!("{}: {}", short(whole), message.replace('\n', ", "))
    };
    ((!span.is_empty() || !message.starts_with("missing field")).then_some(line), complaint)
}

/// Dotted path of the key, value, list entry or table header at `span`.
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

/// The known name that an unknown key, the last of a dotted path, is most like, if it is like one.
fn nearest<'k>(key: &str, known: &'k str) -> Option<&'k str> {
    /// `pstar` and `p_star` have 0.95, `surfaces` and `surface` 0.98, words without relation at most 0.7.
    const LIKE: f64 = 0.85;
    let key = key.rsplit('.').next().unwrap_or(key);
    let names = known.split(", ").flat_map(|name| name.split(" or "));
    let scored = names.map(|name| (strsim::jaro_winkler(key, name), name));
    scored.filter(|(like, _)| *like >= LIKE).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, name)| name)
}

/// The dotted keys of other tables with the name of a misplaced one.
fn elsewhere(key: &str) -> Option<String> {
    let name = key.rsplit('.').next()?;
    let keys: Vec<String> = tables_with(name).into_iter().map(|table| format!("{table}.{name}")).collect();
    (!keys.is_empty()).then(|| keys.join(" or "))
}

/// A Rust type in plain words.
fn plain(expected: &str) -> &str {
    match expected {
        "f32" | "f64" => "a number",
        "usize" | "u8" | "u16" | "u32" | "u64" => "a whole number, zero or above",
        "i8" | "i16" | "i32" | "i64" => "a whole number",
        "a string" | "path string" => "a text in quotes",
        "a boolean" => "true or false",
        "a sequence" => "a list in brackets, as [0.01, 0.03] or [\"1 MPa\", \"2 MPa\"]",
        other if other.starts_with("struct ") => "a table",
        other => other,
    }
}

fn short(text: &str) -> String {
    let first = text.lines().next().unwrap_or_default().trim();
    let is_complete = first.len() == text.trim().len() && first.chars().count() <= REPEATED;
    if is_complete { first.to_string() } else { first.chars().take(REPEATED).collect::<String>() + " …" }
}

#[cfg(test)]
mod tests {
    use crate::scene::Scene;
    use std::path::Path;

    /// Types, unknown keys and missing ones, in the order of the file.
    #[test]
    fn all_complaints_are_reported_at_once() {
        let text = "name = 3\nlaod = 1\n[surface]\ngrid = \"many\"\nhurts = 0.8\nhurst = \"x\"\n[adhesion]\nrange = true\n\
                    law = \"sticky\"\n[continuum]\nmethod = 1\nperiodic = \"no\"\n[load]\np_star = [1, \"x\", \"y\"]\npressure = 3\n";
        let complaint = Scene::parse(text, Path::new("a.toml")).expect_err("refused").to_string();
        let begins = [
            "line 1: name = 3;",
            "line 2: laod is no key",
            "line 4: surface.grid = \"many\";",
            "line 5: surface.hurts is no key",
            "line 6: surface.hurst = \"x\";",
            "line 7: adhesion.work_of_adhesion is missing",
            "line 8: adhesion.range = true;",
            "line 9: adhesion.law = \"sticky\";",
            "line 11: continuum.method = 1;",
            "line 12: continuum.periodic = \"no\";",
            "line 14: load.p_star[1] = \"x\";",
            "line 15: load.pressure = 3;",
        ];
        let lines: Vec<&str> = complaint.lines().collect();
        assert_eq!(lines.len(), begins.len(), "{complaint}");
        for (line, begin) in lines.iter().zip(begins) {
            assert!(line.strip_prefix("a.toml, ").is_some_and(|l| l.starts_with(begin)), "{complaint}");
        }
    }

    #[test]
    fn messages_name_no_rust_types() {
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
                "name = \"a\"\n[surface]\n[load]\np_star = true",
                "line 4: load.p_star = true; accepted: a list of numbers, as [0.01, 0.03], a number, or a range, as \"log:0.01:0.1:5\"",
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
                "line 5: continuum.layer.thickness is missing and has no default",
            ),
            (
                "name = \"a\"\n[laboratory]\nlength = 100",
                "line 3: laboratory.length = 100; accepted: a length with its unit, as \"100 um\"",
            ),
            (
                "name = \"a\"\n[laboratory]\nlength = \"100 MPa\"",
                "line 3: laboratory.length = \"100 MPa\"; accepted: a length with its unit, as \"100 um\"",
            ),
            (
                "name = \"a\"\n[load]\npressure = [\"1 MPa\", 2]",
                "line 3: load.pressure[1] = 2; accepted: a stress with its unit, as \"25 MPa\"",
            ),
            (
                "name = \"a\"\n[load]\np_stars = [1]",
                "line 3: load.p_stars is no key of a scene (p_star is one); accepted: p_star, p_star_range, pressure, force, \
                 mean_gap, displacement, contact, unload, maps_at, pull_off",
            ),
            (
                "name = \"a\"\n[laboratory]\nwork_of_adhesion = \"5 mJ/m2\"",
                "line 3: laboratory.work_of_adhesion is no key of a scene (adhesion.work_of_adhesion is one); accepted: length, length_y, \
                 modulus, bodies",
            ),
            ("name = \"a\"\n[load]\np_star: 1", "line 3: p_star: 1: key with no value, expected `=`"),
        ] {
            let complaint = Scene::parse(text, Path::new("a.toml")).expect_err(text).to_string();
            assert!(complaint.lines().all(|l| l.starts_with("a.toml")), "{complaint}");
            assert!(complaint.lines().any(|l| l.ends_with(expected)), "{complaint}");
        }
    }
}
