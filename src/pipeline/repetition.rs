//! Whether a finished run comes out again: its numbers and fields against those of a repetition.

use crate::Result;
use crate::record::results::{MANIFEST_FILE, Results};
use crate::record::written::{self, WrittenFolder};
use asperity_grid::Error;
use asperity_surface::files::atomic_file::read_text;
use serde::Serialize;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Keys whose numbers are those of the machine and the moment.
const MEASURED: [&str; 4] = ["stages", "threads", "seconds", "bytes"];

/// A run whose files are as they were written.
pub struct FinishedRun {
    folder: WrittenFolder,
    results: Results,
    /// The scene, in its folder.
    pub scene: PathBuf,
    /// The program that made it, with its version.
    pub program: String,
}

/// What a repetition has in common with a run.
#[derive(Debug, Serialize)]
pub struct Repetition {
    /// Program and version of the run, and of the repetition.
    pub programs: [String; 2],
    /// Numbers of `results.json` that were compared, without times and memory.
    pub numbers: usize,
    /// Numbers that have other bits.
    pub changed_numbers: usize,
    /// The largest relative difference, with its key.
    pub largest: Option<ChangedNumber>,
    /// Fields that the results name.
    pub fields: usize,
    /// Those of other contents.
    pub changed_fields: Vec<String>,
}

/// A number that is another one in the repetition; none where it is missing.
#[derive(Debug, Serialize)]
pub struct ChangedNumber {
    pub key: String,
    pub run: Option<f64>,
    pub repetition: Option<f64>,
    /// Over the larger of both; 1 where one is missing.
    pub relative: f64,
}

impl Repetition {
    /// Whether all numbers agree to a relative difference, which for 0 is the same bits of numbers and fields.
    pub fn agrees(&self, tolerance: f64) -> bool {
        let worst = self.largest.as_ref().map_or(0.0, |l| l.relative);
        worst <= tolerance && (tolerance > 0.0 || self.changed_fields.is_empty())
    }
}

impl FinishedRun {
    /// # Errors
    /// `Format` for a folder without results, or with a file that is not as the run wrote it; `Io`.
    pub fn open(out: &Path) -> Result<Self> {
        let (folder, results) = WrittenFolder::run(out)?;
        let scene = out.join(super::run::SCENE_FILE);
        for name in [super::run::SCENE_FILE, MANIFEST_FILE] {
            written::unchanged(out, name)?;
        }
        folder.verify()?;
        let file = out.join(MANIFEST_FILE);
        let manifest: Value =
            serde_json::from_str(&read_text(&file)?).map_err(|e| Error::format(&file, e, "the manifest of a run"))?;
        let program = manifest["program"].as_str().unwrap_or("another program").to_string();
        Ok(FinishedRun { folder, results, scene, program })
    }

    /// Compares it with a repetition in another folder.
    ///
    /// # Errors
    /// Those of [`FinishedRun::open`].
    pub fn compare(&self, again: &Path) -> Result<Repetition> {
        let again = FinishedRun::open(again)?;
        let mut numbers = Differences::default();
        numbers.of("", &value(&self.results)?, &value(&again.results)?);
        let fields = self.folder.named(&self.results)?;
        let changed_fields = fields.iter().filter(|name| !self.folder.is_same(&again.folder, name)).cloned().collect();
        Ok(Repetition {
            programs: [self.program.clone(), again.program],
            numbers: numbers.compared,
            changed_numbers: numbers.changed,
            largest: numbers.largest,
            fields: fields.len(),
            changed_fields,
        })
    }
}

fn value(results: &Results) -> Result<Value> {
    serde_json::to_value(results).map_err(|e| Error::format("results", e, "numbers that JSON can hold"))
}

/// Differences of the numbers of two JSON values.
#[derive(Default)]
struct Differences {
    compared: usize,
    changed: usize,
    largest: Option<ChangedNumber>,
}

impl Differences {
    fn of(&mut self, key: &str, run: &Value, repetition: &Value) {
        match (run, repetition) {
            (Value::Object(a), b) => {
                a.iter().for_each(|(name, a)| self.below(key, name, a, &b[name.as_str()]));
                let added = b.as_object().into_iter().flatten().filter(|(name, _)| !a.contains_key(*name));
                added.for_each(|(name, b)| self.below(key, name, &Value::Null, b));
            }
            (Value::Array(a), b) => {
                let longest = a.len().max(b.as_array().map_or(0, Vec::len));
                let entry = |list: &Value, i: usize| list.get(i).cloned().unwrap_or_default();
                (0..longest).for_each(|i| self.of(&format!("{key}[{i}]"), &entry(run, i), &entry(b, i)));
            }
            (_, Value::Object(_) | Value::Array(_)) => self.of_added(key, repetition),
            _ if run.is_number() || repetition.is_number() => self.number(key, run.as_f64(), repetition.as_f64()),
            _ => {}
        }
    }

    fn of_added(&mut self, key: &str, repetition: &Value) {
        let empty = if repetition.is_object() { Value::Object(Default::default()) } else { Value::Array(Vec::new()) };
        self.of(key, &empty, repetition);
    }

    fn below(&mut self, key: &str, name: &str, run: &Value, repetition: &Value) {
        let measured = MEASURED.iter().any(|measured| name == *measured || name.ends_with(&format!("_{measured}")));
        if !measured {
            let key = if key.is_empty() { name.to_string() } else { format!("{key}.{name}") };
            self.of(&key, run, repetition);
        }
    }

    fn number(&mut self, key: &str, run: Option<f64>, repetition: Option<f64>) {
        self.compared += 1;
        let relative = match (run, repetition) {
            (Some(a), Some(b)) if a == b => return,
            (Some(a), Some(b)) => (a - b).abs() / a.abs().max(b.abs()),
            _ => 1.0,
        };
        self.changed += 1;
        if self.largest.as_ref().is_none_or(|l| relative > l.relative) {
            self.largest = Some(ChangedNumber { key: key.into(), run, repetition, relative });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn numbers_are_compared_by_their_keys() {
        let run = json!({"a": [1.0, {"b": 2.0, "seconds": 3.0}], "stages": [4.0], "c": null, "words": "x"});
        let differences = |again: Value| {
            let mut found = Differences::default();
            found.of("", &run, &again);
            (found.compared, found.changed, found.largest.map(|l| (l.key, l.relative)))
        };
        assert_eq!(differences(run.clone()), (2, 0, None));
        let other = json!({"a": [1.0, {"b": 2.5, "seconds": 9.0}], "stages": [], "c": null, "words": "y"});
        assert_eq!(differences(other), (2, 1, Some(("a[1].b".into(), 0.2))));
        let (missing, added) = (json!({"a": [1.0]}), json!({"a": [1.0, {"b": 2.0}], "c": {"d": [5.0]}}));
        assert_eq!(differences(missing), (2, 1, Some(("a[1].b".into(), 1.0))));
        assert_eq!(differences(added), (3, 1, Some(("c.d[0]".into(), 1.0))));
    }
}
