//! The keys of a scene and of `results.json` as Markdown tables, from their JSON Schemas.

use crate::scene::schema::resolved;
use serde_json::Value;
use std::fmt::Write;

/// Above the tables of `docs/keys.md`.
const HEAD: &str = "\
# Keys of a scene

Written by `asperity schema --keys` from the [JSON Schema](scene.schema.json). A key without a default is required where its type says
so, and otherwise absent. Lengths, stresses and other quantities are texts with their unit: `length = \"100 um\"`, `modulus = \"25 MPa\"`. Lists
may be texts of ranges, both ends included: `pressure = \"log:1MPa:100MPa:5\"`.
";

/// All tables.
pub(super) fn markdown(schema: &Value) -> String {
    let mut text = HEAD.to_string();
    table(schema, schema, "", &mut text);
    text.trim_end().to_string()
}

/// The keys of `node`, whose path is `path`, and then those of the tables in it.
fn table(schema: &Value, node: &Value, path: &str, text: &mut String) {
    let Some(keys) = node["properties"].as_object() else { return };
    let required = |key: &str| node["required"].as_array().is_some_and(|list| list.iter().any(|k| k == key));
    let (tables, plain): (Vec<_>, Vec<_>) =
        keys.iter().partition(|(_, k)| resolved(schema, k)["properties"].is_object());
    if !path.is_empty() {
        let _ = writeln!(text, "\n## [{path}]");
    }
    match one_line(&node["description"]).as_str() {
        "" => text.push('\n'),
        description => _ = writeln!(text, "\n{description}\n"),
    }
    if !plain.is_empty() {
        text.push_str("| key | type | default | description |\n|---|---|---|---|\n");
    }
    for (key, value) in plain {
        let default = match &value["default"] {
            _ if required(key) => "required".into(),
            // A default that is that of its type is not in the schema; a key that may be null has none.
            Value::Null => match value["type"].as_str() {
                Some("boolean") => "`false`".into(),
                Some("integer") => "`0`".into(),
                Some("array") => "`[]`".into(),
                _ => "–".to_string(),
            },
            default => format!("`{default}`"),
        };
        let (kind, description) = (kind(schema, value).join(" or "), one_line(&value["description"]));
        let _ = writeln!(text, "| `{key}` | {kind} | {default} | {description} |");
    }
    for (key, value) in tables {
        let inner = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        table(schema, resolved(schema, value), &inner, text);
    }
}

/// Above the tables of `docs/result-keys.md`.
const HEAD_OF_RESULTS: &str = "\
# Keys of results.json

Written by `asperity schema --results --keys` from the [JSON Schema](results.schema.json). One table for each structure. Numbers are finite and in SI
units (m, Pa, J/m², Pa/m for a stiffness) unless key or description name another; shares, relative errors and *p\\** have none. Keys with *always* are in
every file, `null` where they are not known; the others are absent where they are not requested or delivered, false or zero. Maps are files
below the folder of the run, f64 `[ny, nx]`: gaps and heights over `scales.length_m`, stresses over `scales.modulus_pa`, contacts as booleans.
";

/// A table for each structure of the results, the outermost first, in the order in which they are met.
pub(super) fn markdown_of_results(schema: &Value) -> String {
    let mut text = HEAD_OF_RESULTS.to_string();
    let mut names = vec![String::new()];
    let mut next = 0;
    while let Some(name) = names.get(next).cloned() {
        next += 1;
        let node = if name.is_empty() { schema } else { &schema["$defs"][&name] };
        let heading = if name.is_empty() { "Results" } else { &name };
        let _ = writeln!(text, "\n## {heading}\n");
        let description = one_line(&node["description"]);
        if !description.is_empty() {
            let _ = writeln!(text, "{description}\n");
        }
        text.push_str("| key | type | always | description |\n|---|---|---|---|\n");
        for (key, value) in node["properties"].as_object().into_iter().flatten() {
            let always = node["required"].as_array().is_some_and(|list| list.iter().any(|k| k == key));
            let kind = structure(schema, value, &mut names).unwrap_or_else(|| kind(schema, value).join(" or "));
            let (always, description) = (if always { "yes" } else { "" }, one_line(&value["description"]));
            let _ = writeln!(text, "| `{key}` | {kind} | {always} | {description} |");
        }
    }
    text.trim_end().to_string()
}

/// A link to the table of a structure, or of those in a list; `None` for other types. Its name is added to those that follow.
fn structure(schema: &Value, node: &Value, names: &mut Vec<String>) -> Option<String> {
    if node["items"].is_object() {
        return Some(format!("list of {}", structure(schema, &node["items"], names)?));
    }
    let options = node["anyOf"].as_array().map_or_else(|| vec![node], |list| list.iter().collect());
    let name = options.iter().find_map(|n| n["$ref"].as_str())?.trim_start_matches("#/$defs/");
    schema["$defs"][name]["properties"].is_object().then(|| {
        if !names.iter().any(|known| known == name) {
            names.push(name.to_string());
        }
        format!("[{name}](#{})", name.to_lowercase())
    })
}

/// Types that a key accepts, and texts with their meaning.
fn kind(schema: &Value, node: &Value) -> Vec<String> {
    let node = resolved(schema, node);
    if let Some(name) = quantity(node) {
        return vec![format!("{name}, as `{}`", node["examples"][0])];
    }
    let phrase_of = |name: &str| match name {
        "integer" => Some("whole number".to_string()),
        "string" => Some("text".to_string()),
        "null" => None,
        "array" => {
            let entry =
                quantity(&node["items"]).map_or_else(|| kind(schema, &node["items"]).join(" or "), String::from);
            Some(match entry.strip_prefix("list of ") {
                Some(of) => format!("list of lists of {of}"),
                None if entry == "quantity" => "list of quantities".into(),
                None => format!("list of {entry}{}", if entry.ends_with('s') { "es" } else { "s" }),
            })
        }
        "object" if node["additionalProperties"].is_object() => {
            let values = kind(schema, &node["additionalProperties"]).join(" or ");
            Some(format!("{values} by name"))
        }
        "object" => {
            let keys = node["properties"].as_object().into_iter().flatten().map(|(key, _)| key.as_str());
            Some(format!("{{ {} }}", keys.collect::<Vec<_>>().join(", ")))
        }
        other => Some(other.to_string()),
    };
    let several = node["oneOf"].as_array().or(node["anyOf"].as_array());
    if let Some(several) = several {
        return several.iter().flat_map(|one| kind(schema, one)).collect();
    }
    if let Some(value) = node.get("const") {
        let meaning = node["description"].as_str().map(|_| format!(" ({})", one_line(&node["description"])));
        return vec![format!("`{value}`{}", meaning.unwrap_or_default().replace(".)", ")"))];
    }
    if let Some(values) = node["enum"].as_array() {
        return values.iter().map(|v| format!("`{v}`")).collect();
    }
    match &node["type"] {
        Value::String(name) => phrase_of(name).into_iter().collect(),
        Value::Array(names) => names.iter().filter_map(|n| phrase_of(n.as_str()?)).collect(),
        _ => Vec::new(),
    }
}

/// The name of a quantity.
fn quantity(node: &Value) -> Option<&str> {
    node["examples"].is_array().then(|| node["format"].as_str()).flatten()
}

/// A description in one cell of a table.
fn one_line(description: &Value) -> String {
    description.as_str().unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|")
}
