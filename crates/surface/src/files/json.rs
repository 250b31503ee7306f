//! JSON files: written atomically; errors on reading state the position.

use std::collections::BTreeSet;
use std::io::Write;
use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::atomic_file::{read_text, write_atomic};
use asperity_grid::error::{Error, Result};

/// Writes `value` indented, with a final newline. NaN and infinities become `null`.
pub fn write<T: Serialize>(path: &Path, value: &T) -> Result<()> {
    write_atomic(path, |w| {
        serde_json::to_writer_pretty(&mut *w, value)?;
        w.write_all(b"\n")
    })
}

/// Entries that a message names.
const MOST_NAMED: usize = 3;

/// The entries that differ between two values, as `load.p_star = [0.02] (was [0.01])`; empty if there are none.
pub fn differences(old: &Value, new: &Value) -> String {
    let mut list = Vec::new();
    collect(old, new, "", &mut list);
    let more = list.len().saturating_sub(MOST_NAMED);
    list.truncate(MOST_NAMED);
    if more > 0 {
        list.push(format!("{more} more"));
    }
    list.join(", ")
}

fn collect(old: &Value, new: &Value, path: &str, list: &mut Vec<String>) {
    if old == new {
        return;
    }
    let (Value::Object(a), Value::Object(b)) = (old, new) else {
        let shown = |v: &Value| if v.is_null() { "not given".into() } else { v.to_string() };
        list.push(format!("{path} = {} (was {})", shown(new), shown(old)));
        return;
    };
    let keys: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
    for key in keys {
        let below = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        collect(a.get(key).unwrap_or(&Value::Null), b.get(key).unwrap_or(&Value::Null), &below, list);
    }
}

/// Schema number of a file.
#[derive(Deserialize)]
struct Head {
    schema: u32,
}

/// Reads a file with a schema number, which is checked before the other fields.
///
/// # Errors
/// `Format` without a number under "schema", or with another schema.
pub fn read_schema<T: DeserializeOwned>(path: &Path, schema: u32) -> Result<T> {
    let text = read_text(path)?;
    let accepted = format!("schema {schema}, which this program writes");
    let head: Head = serde_json::from_str(&text).map_err(|e| Error::format(path, e, &accepted))?;
    if head.schema != schema {
        return Err(Error::format(path, format!("schema {}", head.schema), accepted));
    }
    serde_json::from_str(&text).map_err(|e| Error::format(path, e, accepted))
}

/// Reads one value; a syntax or type error names file, line and column.
pub fn read<T: DeserializeOwned>(path: &Path) -> Result<T> {
    let text = read_text(path)?;
    serde_json::from_str(&text).map_err(|e| Error::format(path, e, format!("JSON of {}", short_name::<T>())))
}

/// For serde: fields equal to their default are omitted.
pub fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

fn short_name<T>() -> &'static str {
    std::any::type_name::<T>().rsplit("::").next().unwrap_or("the expected shape")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, Serialize, serde::Deserialize)]
    struct Probe {
        load: f64,
    }

    #[test]
    fn what_is_written_is_read_to_the_bit_and_errors_have_a_place() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("probe.json");
        let probe = Probe { load: 0.1 + 0.2 };
        write(&path, &probe).unwrap();
        assert_eq!(read::<Probe>(&path).unwrap(), probe);
        std::fs::write(&path, "{\n  \"load\": oak\n}").unwrap();
        let message = read::<Probe>(&path).unwrap_err().to_string();
        assert!(message.contains("probe.json") && message.contains("line 2") && message.contains("Probe"), "{message}");
    }
}
