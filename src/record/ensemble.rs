//! `ensemble.json`: the points of a sweep with their results, and statistics over the realisations.

use super::given_loads::{GivenLoads, Imposed, LoadQuantity};
use asperity_contact::load::Branch;
use asperity_grid::error::Result;
use asperity_surface::files::json;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::path::Path;

/// Name of the file in the folder of a sweep.
pub const FILE: &str = "ensemble.json";

/// Tables next to it.
pub const NUMBERS_FILE: &str = "numbers.csv";
pub const STATISTICS_FILE: &str = "statistics.csv";
pub const DIFFERENCES_FILE: &str = "differences.csv";

/// Increased when a key changes its meaning.
const SCHEMA: u32 = 4;

/// Results of a sweep over keys of a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ensemble {
    pub schema: u32,
    pub name: String,
    /// The varied keys, the slowest first.
    pub keys: Vec<String>,
    /// What the scenes impose, if it is no pressure.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub imposed: Option<Imposed>,
    pub points: Vec<EnsemblePoint>,
    pub statistics: Vec<EnsembleStatistic>,
    pub differences: Vec<Difference>,
}

/// A scene of the sweep.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EnsemblePoint {
    /// Name of its run folder in `points/`.
    pub label: String,
    /// Values of the varied keys.
    pub values: Vec<Value>,
    pub status: PointStatus,
    /// Why it failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Its numbers, once it is done.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub numbers: Vec<Observation>,
    /// Its warnings.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Relative uncertainty of the contact area by grid, solver and so on, the largest over the loads. Realisations share it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub area_uncertainty: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PointStatus {
    Waiting,
    Done,
    Failed,
}

/// What is observed: by which model, at which load, which quantity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Observable {
    /// "continuum", the id of a method, "atoms", "compliant wall" …
    pub source: String,
    /// Index of the load step, from 0.
    pub load: usize,
    pub branch: Branch,
    pub quantity: String,
    pub unit: String,
}

/// A load, also in the quantity in which the scene gave it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct EnsembleLoad {
    pub p_star: f64,
    /// Mean pressure, Pa.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressure: Option<f64>,
    /// Normal force on the map, N.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force: Option<f64>,
}

impl EnsembleLoad {
    pub fn of(loads: GivenLoads, p_star: f64) -> Self {
        let given = |quantity| (loads.quantity == quantity).then_some(p_star * loads.of_p_star);
        EnsembleLoad { p_star, pressure: given(LoadQuantity::Pressure), force: given(LoadQuantity::Force) }
    }

    /// The mean of loads; `None` without any.
    pub fn mean<'a>(
        loads: impl Iterator<Item = &'a EnsembleLoad> + Clone,
        mean: fn(&[f64]) -> Option<f64>,
    ) -> Option<Self> {
        let of = |value: fn(&EnsembleLoad) -> Option<f64>| mean(&loads.clone().filter_map(value).collect::<Vec<_>>());
        Some(EnsembleLoad { p_star: of(|l| Some(l.p_star))?, pressure: of(|l| l.pressure), force: of(|l| l.force) })
    }

    /// Its quantity, and its value in Pa, in N or as p*.
    pub fn given(&self) -> (LoadQuantity, f64) {
        match (self.pressure, self.force) {
            (Some(pascal), _) => (LoadQuantity::Pressure, pascal),
            (_, Some(newton)) => (LoadQuantity::Force, newton),
            _ => (LoadQuantity::PStar, self.p_star),
        }
    }
}

/// A number of one point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Observation {
    #[serde(flatten)]
    pub of: Observable,
    #[serde(flatten)]
    pub load: EnsembleLoad,
    pub value: f64,
}

/// Statistics over the realisations of one combination of the other varied keys.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EnsembleStatistic {
    /// Varied keys besides the seed, with their values.
    pub group: Vec<(String, Value)>,
    #[serde(flatten)]
    pub of: Observable,
    /// Mean over the realisations.
    #[serde(flatten)]
    pub load: EnsembleLoad,
    #[serde(flatten)]
    pub sample: Sample,
}

/// Mean and scatter of a sample. With one value there is no scatter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    pub realisations: usize,
    pub mean: f64,
    /// Of the single value, with n − 1.
    pub standard_deviation: Option<f64>,
    /// Of the mean.
    pub standard_error: Option<f64>,
    /// 95 % confidence interval of the mean by Student's t.
    pub confidence: Option<[f64; 2]>,
    pub min: f64,
    pub max: f64,
}

/// Points that are named in a warning.
const FEW: usize = 3;

/// Standard deviation over mean of equal values that rounding makes differ.
const SCATTER: f64 = 1e-9;

impl Sample {
    /// Whether the values differ by more than rounding.
    pub fn scatters(&self) -> bool {
        self.standard_deviation.is_some_and(|d| d > SCATTER * self.mean.abs())
    }
}

/// Differences between two sources on the same realisations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Difference {
    pub group: Vec<(String, Value)>,
    /// The source whose difference from `reference` is given.
    #[serde(flatten)]
    pub of: Observable,
    pub reference: String,
    #[serde(flatten)]
    pub load: EnsembleLoad,
    pub difference: Sample,
    /// Over the reference; absent where that is zero.
    pub relative: Option<Sample>,
}

impl Ensemble {
    /// The quantity of the loads.
    pub fn loads(&self) -> LoadQuantity {
        self.statistics.first().map_or(LoadQuantity::PStar, |s| s.load.given().0)
    }

    /// Whether any number is a mean over several realisations.
    pub fn has_realisations(&self) -> bool {
        self.statistics.iter().any(|s| s.sample.realisations > 1)
    }

    /// What was imposed at a load instead of a pressure.
    pub fn imposed(&self, group: &[(String, Value)], of: &Observable) -> Option<&EnsembleStatistic> {
        let quantity = self.imposed?.name();
        let at_load = |s: &&EnsembleStatistic| (s.of.load, s.of.branch) == (of.load, of.branch) && s.group == group;
        let here = || self.statistics.iter().filter(at_load);
        let pressure = here().find(|s| s.of.quantity == "pressure")?;
        here().find(|s| s.of.source == pressure.of.source && s.of.quantity == quantity)
    }

    pub fn new(name: String, keys: Vec<String>, imposed: Option<Imposed>, points: Vec<EnsemblePoint>) -> Self {
        Ensemble { schema: SCHEMA, name, keys, imposed, points, statistics: Vec::new(), differences: Vec::new() }
    }

    /// What the standard errors do not contain, a sentence each: the uncertainty that the points share, and their warnings.
    pub fn warnings(&self) -> Vec<String> {
        let largest = self.points.iter().filter_map(|p| p.area_uncertainty).reduce(f64::max);
        let shared = largest.map(|u| {
            let size = format!("each contact area by grid, solver and criterion, up to {:.2} % of it", 100.0 * u);
            if self.has_realisations() {
                format!("standard errors do not contain the uncertainty of {size}")
            } else {
                format!("the numbers do not state the uncertainty of {size}")
            }
        });
        let mut counted: Vec<(Vec<&str>, &str)> = Vec::new();
        for (label, warning) in self.points.iter().flat_map(|p| p.warnings.iter().map(|w| (p.label.as_str(), w))) {
            match counted.iter_mut().find(|(_, known)| known == warning) {
                Some((labels, _)) => labels.push(label),
                None => counted.push((vec![label], warning)),
            }
        }
        let all = self.points.len();
        let of_points = |(labels, warning): &(Vec<&str>, &str)| {
            let named = if labels.len() <= FEW { format!(" ({})", labels.join(", ")) } else { String::new() };
            format!("{} of {all} points{named}: {warning}", labels.len())
        };
        shared.into_iter().chain(counted.iter().map(of_points)).collect()
    }

    /// # Errors
    /// I/O errors.
    pub fn write(&self, folder: &Path) -> Result<()> {
        json::write(&folder.join(FILE), self)
    }

    /// # Errors
    /// I/O errors, another schema, a damaged file.
    pub fn read(folder: &Path) -> Result<Self> {
        json::read_schema(&folder.join(FILE), SCHEMA)
    }
}
