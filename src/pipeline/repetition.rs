//! Whether a finished run comes out again: its numbers and fields against those of a repetition.

use super::run::{OUTSIDE_STAGES, SCENE_FILE};
use crate::Result;
use crate::record::results::{MANIFEST_FILE, Results};
use crate::record::written::{self, WrittenFolder};
use asperity_grid::Error;
use asperity_surface::files::atomic_file::read_text;
use asperity_surface::files::npy;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Keys whose numbers are those of the machine and the moment.
const MEASURED: [&str; 4] = ["stages", "threads", "seconds", "bytes"];

/// Keys of what a solver leaves below its tolerance, which are compared to the bit only.
const REMAINDERS: [&str; 8] = [
    "residual",
    "complementarity",
    "load_error",
    "iterations",
    "fft_pairs",
    "energy_bound",
    "error_estimates",
    "uncertainty",
];

/// A run whose files are as they were written.
pub struct FinishedRun {
    folder: WrittenFolder,
    pub(super) results: Results,
    /// The scene, in its folder.
    pub scene: PathBuf,
    /// The program that made it, with its version.
    pub program: String,
    /// LAMMPS with its version, of a run with atoms.
    pub(super) engine: Option<String>,
    /// BLAKE3 hashes of the files that it read, by the key that names them.
    pub(super) inputs: BTreeMap<String, String>,
}

/// What is read of a manifest.
#[derive(Deserialize)]
struct Manifest {
    program: String,
    engine: Option<String>,
    inputs: BTreeMap<String, String>,
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
    pub changed_fields: Vec<ChangedField>,
}

/// A field that is another one in the repetition.
#[derive(Debug, Serialize)]
pub struct ChangedField {
    pub file: String,
    /// Largest difference over the largest value, of a contact map the share of nodes that differ; none of a file that is no field.
    pub relative: Option<f64>,
}

/// A number that is another one in the repetition; none where it is missing.
#[derive(Debug, Serialize)]
pub struct ChangedNumber {
    pub key: String,
    pub run: Option<f64>,
    pub repetition: Option<f64>,
    /// Over the largest of its key in a list of numbers that belong together; 1 where one is missing.
    pub relative: f64,
}

impl Repetition {
    /// Whether numbers and fields agree to a relative difference, which for 0 is the same bits.
    pub fn agrees(&self, tolerance: f64) -> bool {
        let of_numbers = self.largest.as_ref().map_or(0.0, |l| l.relative);
        let field = |f: &ChangedField| tolerance > 0.0 && f.relative.is_none_or(|relative| relative <= tolerance);
        of_numbers <= tolerance && self.changed_fields.iter().all(field)
    }
}

impl FinishedRun {
    /// # Errors
    /// `Format` for a folder without results, or with a file that is not as the run wrote it; `Io`.
    pub fn open(out: &Path) -> Result<Self> {
        let (folder, results) = WrittenFolder::run(out)?;
        let scene = out.join(SCENE_FILE);
        OUTSIDE_STAGES
            .iter()
            .filter(|name| out.join(name).exists())
            .try_for_each(|name| written::unchanged(out, name))?;
        folder.verify()?;
        let file = out.join(MANIFEST_FILE);
        let Manifest { program, engine, inputs } =
            serde_json::from_str(&read_text(&file)?).map_err(|e| Error::format(&file, e, "the manifest of a run"))?;
        Ok(FinishedRun { folder, results, scene, program, engine, inputs })
    }

    /// What it is based on, to be cited.
    pub fn sources(&self) -> &[String] {
        &self.results.sources
    }

    /// Compares it with a repetition in another folder, `exactly` or without what solvers leave below their tolerance.
    ///
    /// # Errors
    /// Those of [`FinishedRun::open`], and of reading fields.
    pub fn compare(&self, again: &Path, exactly: bool) -> Result<Repetition> {
        let again = FinishedRun::open(again)?;
        let mut numbers = Numbers { exactly, ..Numbers::default() };
        numbers.of(("", ""), &value(&self.results)?, &value(&again.results)?);
        let compared = numbers.list.len();
        let changed_numbers = numbers.changed();
        let fields = self.folder.named(&self.results)?;
        let changed = fields.iter().filter(|name| !self.folder.is_same(&again.folder, name));
        let changed_fields = changed.map(|name| self.changed_field(&again, name)).collect::<Result<_>>()?;
        Ok(Repetition {
            programs: [self.program.clone(), again.program],
            numbers: compared,
            changed_numbers: changed_numbers.len(),
            largest: changed_numbers.into_iter().max_by(|a, b| a.relative.total_cmp(&b.relative)),
            fields: fields.len(),
            changed_fields,
        })
    }

    fn changed_field(&self, again: &FinishedRun, name: &str) -> Result<ChangedField> {
        let file = name.to_string();
        if !name.ends_with(".npy") {
            return Ok(ChangedField { file, relative: None });
        }
        let [run, repetition] =
            [&self.folder, &again.folder].map(|folder| folder.file(name).and_then(|f| npy::read(&f)));
        let (run, repetition) = (run?.values, repetition?.values);
        Ok(ChangedField { file, relative: Some(difference(&run, &repetition)) })
    }
}

/// Largest difference of two fields over the largest value, of maps of 0 and 1 the share of nodes that differ.
fn difference(run: &[f64], repetition: &[f64]) -> f64 {
    if run.len() != repetition.len() {
        return 1.0;
    }
    let differences = run.iter().zip(repetition).map(|(a, b)| (a - b).abs());
    if run.iter().all(|v| *v == 0.0 || *v == 1.0) {
        return differences.sum::<f64>() / run.len() as f64;
    }
    let largest = run.iter().fold(0.0_f64, |largest, v| largest.max(v.abs()));
    differences.fold(0.0, f64::max) / largest
}

fn value(results: &Results) -> Result<Value> {
    serde_json::to_value(results).map_err(|e| Error::format("results", e, "numbers that JSON can hold"))
}

/// Lists whose entries are apart: numbers of other lists are compared with the largest of their key, as those of a spectrum.
const APART: [&str; 4] = ["states", "loads", "load_steps", "methods"];

/// The numbers of two JSON values by their key.
#[derive(Default)]
struct Numbers {
    exactly: bool,
    list: Vec<Number>,
}

struct Number {
    key: String,
    /// The key without the indices of lists whose entries belong together.
    group: String,
    run: Option<f64>,
    repetition: Option<f64>,
}

impl Numbers {
    fn of(&mut self, (key, group): (&str, &str), run: &Value, repetition: &Value) {
        match (run, repetition) {
            (Value::Object(a), b) => {
                a.iter().for_each(|(name, a)| self.below((key, group, name), a, &b[name.as_str()]));
                let added = b.as_object().into_iter().flatten().filter(|(name, _)| !a.contains_key(*name));
                added.for_each(|(name, b)| self.below((key, group, name), &Value::Null, b));
            }
            (Value::Array(a), b) => {
                let longest = a.len().max(b.as_array().map_or(0, Vec::len));
                let entry = |list: &Value, i: usize| list.get(i).cloned().unwrap_or_default();
                let is_apart = APART.iter().any(|list| group.ends_with(list));
                for i in 0..longest {
                    let group = if is_apart { format!("{group}[{i}]") } else { format!("{group}[]") };
                    self.of((&format!("{key}[{i}]"), &group), &entry(run, i), &entry(b, i));
                }
            }
            (_, Value::Object(_)) => self.of((key, group), &Value::Object(Default::default()), repetition),
            (_, Value::Array(_)) => self.of((key, group), &Value::Array(Vec::new()), repetition),
            _ if run.is_number() || repetition.is_number() => {
                let (run, repetition) = (run.as_f64(), repetition.as_f64());
                self.list.push(Number { key: key.into(), group: group.into(), run, repetition });
            }
            _ => {}
        }
    }

    fn below(&mut self, (key, group, name): (&str, &str, &str), run: &Value, repetition: &Value) {
        let is_left_out = |left_out: &str| name == left_out || name.ends_with(&format!("_{left_out}"));
        let remainders = if self.exactly { &[][..] } else { &REMAINDERS };
        if !MEASURED.iter().chain(remainders).any(|key| is_left_out(key)) {
            let joined = |path: &str| if path.is_empty() { name.to_string() } else { format!("{path}.{name}") };
            self.of((&joined(key), &joined(group)), run, repetition);
        }
    }

    /// Those that differ.
    fn changed(self) -> Vec<ChangedNumber> {
        let mut scales: BTreeMap<String, f64> = BTreeMap::new();
        for number in &self.list {
            let scale = scales.entry(number.group.clone()).or_default();
            *scale = [number.run, number.repetition].into_iter().flatten().fold(*scale, |s, v| s.max(v.abs()));
        }
        let changed = self.list.into_iter().filter(|n| n.run != n.repetition);
        let with_difference = |Number { key, group, run, repetition }: Number| {
            let relative = run.zip(repetition).map_or(1.0, |(a, b)| (a - b).abs() / scales[&group]);
            ChangedNumber { key, run, repetition, relative }
        };
        changed.map(with_difference).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn compared(exactly: bool, run: &Value, again: &Value) -> (usize, Vec<(String, f64)>) {
        let mut numbers = Numbers { exactly, ..Numbers::default() };
        numbers.of(("", ""), run, again);
        (numbers.list.len(), numbers.changed().into_iter().map(|c| (c.key, c.relative)).collect())
    }

    #[test]
    fn numbers_are_compared_by_their_keys() {
        let run = json!({"a": [1.0, {"b": 2.0, "seconds": 3.0}], "stages": [4.0], "c": null, "words": "x"});
        let differences = |again: Value| compared(true, &run, &again);
        assert_eq!(differences(run.clone()), (2, vec![]));
        let other = json!({"a": [1.0, {"b": 2.5, "seconds": 9.0}], "stages": [], "c": null, "words": "y"});
        assert_eq!(differences(other), (2, vec![("a[1].b".into(), 0.2)]));
        let (missing, added) = (json!({"a": [1.0]}), json!({"a": [1.0, {"b": 2.0}], "c": {"d": [5.0]}}));
        assert_eq!(differences(missing), (2, vec![("a[1].b".into(), 1.0)]));
        assert_eq!(differences(added), (3, vec![("c.d[0]".into(), 1.0)]));
    }

    /// Rounding of the smallest value of a spectrum is no difference; a load is compared with itself.
    #[test]
    fn lists_have_one_scale_and_loads_their_own() {
        let [run, again] = [1e-30, 2e-30].map(|v| json!({"psd": [4.0, v], "states": [{"area": 0.5}, {"area": v}]}));
        assert_eq!(compared(true, &run, &again).1, [("psd[1]".into(), 2.5e-31), ("states[1].area".into(), 0.5)]);
        let [run, again] = [1e-9, 2e-9].map(|v| json!({"residual": v, "area": 0.5}));
        assert_eq!((compared(true, &run, &again).1.len(), compared(false, &run, &again)), (1, (1, vec![])));
    }

    #[test]
    fn fields_are_compared_by_their_largest_value_and_contact_by_its_nodes() {
        assert_eq!(difference(&[1.0, -4.0, 0.0], &[1.0, -4.0, 0.5]), 0.125);
        assert_eq!(difference(&[1.0, 0.0, 0.0, 1.0], &[1.0, 1.0, 0.0, 1.0]), 0.25);
        assert_eq!(difference(&[1.0], &[1.0, 2.0]), 1.0);
    }
}
