//! The file of a sweep: a scene and the keys that vary.

use crate::pipeline::plan;
use crate::scene::{Case, Scene};
use asperity_grid::error::{Complaint, Error, Result};
use asperity_grid::units::{Measure, Measures};
use asperity_surface::files::atomic_file::read_text;
use serde::Deserialize;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Most points of a sweep.
const MOST_POINTS: usize = 100_000;
/// Longest part of a folder's name for one key, characters.
const LONGEST_VALUE: usize = 24;

/// A sweep as its file has it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct SweepFile {
    /// Scene file, relative to this one.
    scene: PathBuf,
    /// Default: the scene's name.
    name: Option<String>,
    /// All combinations of the values, or the first values, the second values and so on.
    #[serde(default)]
    combine: Combine,
    over: Table,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Combine {
    #[default]
    Product,
    Zip,
}

/// A key with its values.
#[derive(Debug, Clone, PartialEq)]
struct SweepAxis {
    pub key: String,
    pub values: Vec<Value>,
}

/// A scene of a sweep.
#[derive(Debug, Clone)]
pub struct SweepPoint {
    /// Name of its folder.
    pub label: String,
    pub values: Vec<Value>,
    /// The scene's file, with absolute paths.
    pub scene: String,
    /// Planned memory, and an order of magnitude of the time.
    pub bytes: u64,
    pub seconds: f64,
    /// MPI ranks of LAMMPS; 1 without atoms.
    pub ranks: usize,
}

/// Edits a scene before it is resolved. The path is that of its file.
pub type ChangeScene<'a> = dyn Fn(&mut Scene, &Path) -> Result<()> + 'a;

/// A checked sweep.
#[derive(Debug, Clone)]
pub struct Sweep {
    pub name: String,
    pub keys: Vec<String>,
    pub points: Vec<SweepPoint>,
}

impl Sweep {
    /// Most MPI ranks of LAMMPS of a point.
    pub fn ranks(&self) -> usize {
        self.points.iter().map(|p| p.ranks).max().unwrap_or(1)
    }

    /// Reads a sweep's file; `changes` edit every scene.
    ///
    /// # Errors
    /// What is wrong with the file, and the first point whose scene is refused, with its values.
    pub fn read(file: &Path, changes: &ChangeScene) -> Result<Sweep> {
        let text = read_text(file)?;
        let accepted = "scene = \"FILE\" and [over] with lists or ranges of scene keys (docs/ensembles.md)";
        let sweep_file: SweepFile = toml::from_str(&text).map_err(|e| {
            let found = match toml::from_str::<toml::Table>(&text) {
                Ok(table) if table.contains_key("load") => "a scene, which `asperity run` runs".to_string(),
                _ => e.message().lines().next().unwrap_or_default().to_string(),
            };
            Error::format(file, found, accepted)
        })?;
        let mut axes = Vec::new();
        flatten(&mut axes, String::new(), &sweep_file.over)
            .map_err(|c| Error::Input { place: file.display().to_string(), list: vec![c] })?;
        let scene = file.parent().unwrap_or(Path::new("")).join(&sweep_file.scene);
        Self::of((&scene, sweep_file.name), &axes, sweep_file.combine, (&file.display().to_string(), changes))
    }

    /// The realisations of one scene.
    ///
    /// # Errors
    /// As [`Sweep::read`].
    pub fn ensemble(scene: &Path, seeds: &[i64], changes: &ChangeScene) -> Result<Sweep> {
        let values = seeds.iter().map(|s| Value::Integer(*s)).collect();
        let axis = SweepAxis { key: crate::compare::ensemble::SEED.into(), values };
        Self::of((scene, None), &[axis], Combine::Product, (&scene.display().to_string(), changes))
    }

    fn of(
        (scene, name): (&Path, Option<String>),
        axes: &[SweepAxis],
        combine: Combine,
        (place, changes): (&str, &ChangeScene),
    ) -> Result<Sweep> {
        let text = read_text(scene)?;
        // The scene's own reader names line and column.
        Scene::parse(&text, scene)?;
        let base: Table = toml::from_str(&text).map_err(|e| Error::format(scene, e.message(), "a scene file"))?;
        let (mut points, mut own_name): (Vec<SweepPoint>, _) = (Vec::new(), String::new());
        for values in combinations(axes, combine).map_err(|c| Error::Input { place: place.into(), list: vec![c] })? {
            let keys = axes.iter().map(|a| a.key.as_str());
            let named: Vec<String> = keys.clone().zip(&values).map(|(k, v)| format!("{k} = {v}")).collect();
            let named = named.join(", ");
            let mut table = base.clone();
            keys.zip(&values).for_each(|(key, value)| set(&mut table, key, value.clone()));
            let refused = |e: &dyn std::fmt::Display| Error::input(place, "over", &named, e.to_string());
            let text = toml::to_string(&table).map_err(|e| refused(&e))?;
            let mut parsed = Scene::parse(&text, Path::new("scene")).map_err(|e| refused(&accepted_by(&e)))?;
            changes(&mut parsed, scene).map_err(|e| match e {
                // What is missing here is no fault of the values.
                e if e.is_of_program() => e,
                _ => refused(&accepted_by(&e)),
            })?;
            let case = Case::resolve(parsed, scene).map_err(|e| refused(&accepted_by(&e)))?;
            let portable = toml::to_string(&case.portable_scene()).map_err(|e| refused(&e))?;
            let label = label(axes, &values);
            if points.iter().any(|p| p.label == label) {
                return Err(refused(&"each combination of values once"));
            }
            let plan = plan(&case, rayon::current_num_threads(), None)?;
            points.push(SweepPoint {
                label,
                values,
                scene: portable,
                bytes: plan.bytes,
                seconds: plan.seconds,
                ranks: case.ranks(),
            });
            own_name = case.scene.name;
        }
        let name = name.unwrap_or(own_name);
        Ok(Sweep { name, keys: axes.iter().map(|a| a.key.clone()).collect(), points })
    }
}

/// What is accepted, with the message of the scene that is not.
fn accepted_by(error: &Error) -> String {
    format!("keys and values of scenes ({error})")
}

/// Collects the keys of nested tables. Lists, ranges of whole numbers `"1..12"` and of others `"log:1um:10um:5"` are values.
fn flatten(axes: &mut Vec<SweepAxis>, prefix: String, table: &Table) -> std::result::Result<(), Complaint> {
    for (name, value) in table {
        let key = if prefix.is_empty() { name.clone() } else { format!("{prefix}.{name}") };
        let wrong = |accepted: &str| Complaint::new(format!("over.{key}"), value, accepted);
        let values = match value {
            Value::Array(list) => list.clone(),
            Value::String(text) if text.contains(':') => {
                let list = text.parse::<Measures>().map_err(|e| wrong(&e))?.0.into_iter();
                let value =
                    |m: Measure| if m.unit.is_some() { Value::String(m.to_string()) } else { Value::Float(m.value) };
                list.map(value).collect()
            }
            Value::String(text) => {
                whole_numbers(text).ok_or_else(|| wrong(RANGE))?.into_iter().map(Value::Integer).collect()
            }
            Value::Table(inner) => {
                flatten(axes, key, inner)?;
                continue;
            }
            _ => {
                return Err(wrong(
                    "a list of values, a range of whole numbers \"1..12\", or one of numbers \"lin:0.1:0.9:5\"",
                ));
            }
        };
        if values.is_empty() {
            return Err(wrong("at least one value"));
        }
        axes.push(SweepAxis { key, values });
    }
    Ok(())
}

/// What a range of whole numbers looks like.
pub const RANGE: &str = "a range of whole numbers, both ends included: \"1..12\"";

/// `1..12`, both ends included, or a list `1,5,7`.
pub fn whole_numbers(text: &str) -> Option<Vec<i64>> {
    if let Some((first, last)) = text.split_once("..") {
        let [first, last] = [first, last].map(|t| t.trim().trim_start_matches('=').parse::<i64>());
        let (first, last) = (first.ok()?, last.ok()?);
        let within = first <= last && last.checked_sub(first)? < MOST_POINTS as i64;
        return within.then(|| (first..=last).collect());
    }
    text.split(',').map(|t| t.trim().parse().ok()).collect()
}

fn combinations(axes: &[SweepAxis], combine: Combine) -> std::result::Result<Vec<Vec<Value>>, Complaint> {
    let sizes = || axes.iter().map(|a| a.values.len());
    let wrong = |accepted: &str| {
        let counts: Vec<String> = axes.iter().map(|a| format!("{} values of {}", a.values.len(), a.key)).collect();
        Complaint::new("over", counts.join(", "), accepted)
    };
    if axes.is_empty() {
        return Err(wrong("at least one key"));
    }
    match combine {
        Combine::Zip if sizes().any(|n| Some(n) != sizes().next()) => {
            Err(wrong("as many values of each key, with combine = \"zip\""))
        }
        Combine::Zip => {
            Ok((0..axes[0].values.len()).map(|i| axes.iter().map(|a| a.values[i].clone()).collect()).collect())
        }
        Combine::Product if sizes().try_fold(1_usize, usize::checked_mul).is_none_or(|n| n > MOST_POINTS) => {
            Err(wrong(&format!("at most {MOST_POINTS} points")))
        }
        Combine::Product => Ok(axes.iter().fold(vec![Vec::new()], |points, axis| {
            let with = |point: &Vec<Value>| -> Vec<Vec<Value>> {
                axis.values.iter().map(|v| point.iter().cloned().chain([v.clone()]).collect()).collect()
            };
            points.iter().flat_map(with).collect()
        })),
    }
}

/// Sets a dotted key; tables on the way are created.
fn set(table: &mut Table, key: &str, value: Value) {
    match key.split_once('.') {
        None => {
            table.insert(key.into(), value);
        }
        Some((first, rest)) => {
            let inner = table.entry(first).or_insert_with(|| Value::Table(Table::new()));
            if !inner.is_table() {
                *inner = Value::Table(Table::new());
            }
            let Value::Table(inner) = inner else { unreachable!("just made one") };
            set(inner, rest, value);
        }
    }
}

/// `seed-3_hurst-0.5`: the last parts of the keys, and values without what a file name should not have.
fn label(axes: &[SweepAxis], values: &[Value]) -> String {
    let plain = |text: String| -> String {
        let keep = |c: char| if c.is_ascii_alphanumeric() || "+-.".contains(c) { c } else { '-' };
        text.chars().filter(|c| *c != '"').map(keep).take(LONGEST_VALUE).collect()
    };
    let part = |(axis, value): (&SweepAxis, &Value)| {
        let name = axis.key.rsplit('.').next().unwrap_or_default();
        format!("{}-{}", plain(name.into()), plain(value.to_string()))
    };
    axes.iter().zip(values).map(part).collect::<Vec<_>>().join("_")
}
