//! The JSON Schema of scenes.

use super::model::Scene;
use serde_json::Value;

impl Scene {
    /// JSON Schema of scene files, for editors.
    pub fn schema() -> Value {
        schemars::schema_for!(Scene).to_value()
    }
}

/// The definition that a node refers to, or the node itself. `null` stands for a key that is absent.
pub fn resolved<'a>(schema: &'a Value, node: &'a Value) -> &'a Value {
    let present = node["anyOf"].as_array().map(|list| list.iter().filter(|n| n["type"] != "null").collect::<Vec<_>>());
    match (node["$ref"].as_str(), present.as_deref()) {
        (Some(name), _) => schema.pointer(name.trim_start_matches('#')).unwrap_or(node),
        (None, Some([only])) => resolved(schema, only),
        _ => node,
    }
}

/// The tables that have a key of this name.
pub(super) fn tables_with(name: &str) -> Vec<String> {
    fn search(schema: &Value, node: &Value, (path, name): (&str, &str), found: &mut Vec<String>) {
        for (key, value) in node["properties"].as_object().into_iter().flatten() {
            let inner = resolved(schema, value);
            if inner["properties"].is_object() {
                let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                search(schema, inner, (&path, name), found);
            } else if key == name && !path.is_empty() {
                found.push(path.to_string());
            }
        }
    }
    let (schema, mut found) = (Scene::schema(), Vec::new());
    search(&schema, &schema, ("", name), &mut found);
    found
}
