//! Measured costs and errors of settings on one surface, per load.

use crate::record::tradeoff::{Setting, Tradeoff, TradeoffPoint, longest_series};
use crate::{Error, Result};
use asperity_contact::interface::Adhesion;
use asperity_contact::quantity::Quantity;
use asperity_surface::files::json;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Errors per load; `null` where a load has none.
type ByLoad = Vec<Option<f64>>;

/// Significant digits of errors and costs in a table.
const DIGITS: usize = 3;

/// The tables included in the program, written by `make measured`.
const SHIPPED: &str = include_str!("../../../data/measured.json");

/// A file of tables.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tables {
    pub schema: u32,
    /// Command and machine of the measurements.
    pub provenance: String,
    pub tables: Vec<Table>,
}

impl Tables {
    /// Increased when a field changes its meaning; files with another schema are refused.
    pub const SCHEMA: u32 = 3;

    /// The tables included in the program, measured on the shipped scenes.
    pub fn shipped() -> Tables {
        serde_json::from_str(SHIPPED).expect("a file of this program, read by its tests")
    }

    /// Tables of a file such as the included one, or the table of a `tradeoff.json`.
    ///
    /// # Errors
    /// Another format or another schema.
    pub fn read(file: &Path) -> Result<Vec<Table>> {
        let found: serde_json::Value = json::read(file)?;
        if found.get("points").is_some() {
            return Tradeoff::read(file).map(|results| vec![Table::of(&results)]);
        }
        if found.get("tables").is_none() {
            let accepted = "a file that `asperity tradeoff` writes, or data/measured.json";
            return Err(Error::format(file, "no measured points and no tables", accepted));
        }
        Ok(json::read_schema::<Tables>(file, Tables::SCHEMA)?.tables)
    }
}

/// Settings measured on one surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Table {
    pub name: String,
    /// Origin of the surface.
    pub surface: String,
    pub shortest_wavelength: f64,
    /// Hurst exponent of the spectrum, if the surface has one that is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hurst: Option<f64>,
    /// Loads; empty if the mean gap is imposed.
    pub p_star: Vec<f64>,
    pub kernel: String,
    pub adhesion: String,
    pub program: String,
    pub threads: usize,
    pub lines: Vec<Line>,
}

/// A setting, its wall time for all loads, and its errors against the reference.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Line {
    #[serde(flatten)]
    pub setting: Setting,
    /// Wall time, s.
    pub seconds: f64,
    /// At least the uncertainty of the reference and the errors of all settings that are finer in every respect: an
    /// error that changes sign between two grids may be small by chance.
    pub errors: BTreeMap<Quantity, ByLoad>,
}

impl Line {
    pub fn points(&self) -> f64 {
        (self.setting.nx * self.setting.ny) as f64
    }
}

impl Table {
    /// The points of a benchmark that have errors.
    pub fn of(results: &Tradeoff) -> Table {
        let has_errors =
            |p: &&TradeoffPoint| p.unavailable_reason.is_none() && p.setting.is_grid() && !p.loads.is_empty();
        let known: Vec<&TradeoffPoint> = results.points.iter().filter(has_errors).collect();
        let lines = known.iter().map(|p| Line {
            setting: p.setting.clone(),
            // On a busy machine the wall time exceeds the sum of the CPU times of all threads.
            seconds: rounded(p.cost.wall_seconds.min(p.cost.cpu_seconds), DIGITS),
            errors: Quantity::COMPARED.into_iter().filter_map(|m| Some((m, reliable(&known, p, m)?))).collect(),
        });
        Table {
            name: results.name.clone(),
            surface: results.surface.clone(),
            shortest_wavelength: results.shortest_wavelength,
            hurst: results.hurst,
            p_star: results.p_star.clone(),
            kernel: results.kernel.clone(),
            adhesion: results.adhesion.clone(),
            program: results.program.clone(),
            threads: results.threads,
            lines: lines.collect(),
        }
    }

    /// Whether the measurements include adhesion.
    pub fn is_adhesive(&self) -> bool {
        self.adhesion != Adhesion::None.to_string()
    }

    /// Grids of a method at one precision and tolerance: the pair with the most grids.
    pub fn grids(&self, method: &str, adhesive: bool) -> Vec<&Line> {
        let of = |l: &&Line| l.setting.method == method && l.setting.adhesive == adhesive;
        longest_series(self.lines.iter().filter(of), |l| &l.setting)
    }
}

/// Rounds to `digits` significant digits.
fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.0$e}", digits - 1).parse().unwrap_or(value)
}

/// Whether `a` has at least the resolution, tolerance and precision of `b`.
fn as_fine(a: &Setting, b: &Setting) -> bool {
    let single = |s: &Setting| s.precision == "f32";
    (&a.method, a.adhesive) == (&b.method, b.adhesive)
        && a.nx >= b.nx
        && a.tolerance <= b.tolerance
        && (single(b) || !single(a))
}

/// Errors of a point per load, without accidentally small ones. `None` if the point does not provide the quantity.
fn reliable(known: &[&TradeoffPoint], point: &TradeoffPoint, quantity: Quantity) -> Option<ByLoad> {
    let found = |p: &TradeoffPoint, i: usize| p.loads.get(i)?.errors.get(&quantity).copied();
    let reference = known.iter().find(|p| p.is_reference && p.setting.adhesive == point.setting.adhesive);
    let at = |i: usize| {
        found(point, i)?;
        let finer = known.iter().filter(|p| as_fine(&p.setting, &point.setting));
        let largest = finer.chain(reference).filter_map(|p| found(p, i)).fold(0.0, f64::max);
        Some(rounded(largest, DIGITS))
    };
    let errors: ByLoad = (0..point.loads.len()).map(at).collect();
    errors.iter().any(Option::is_some).then_some(errors)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::results::ScalesSi;
    use crate::record::tradeoff::{Cost, Errors, LoadErrors, SCHEMA};

    fn results(errors: &[(usize, f64, bool)]) -> Tradeoff {
        let point = |&(nx, error, is_reference): &(usize, f64, bool)| TradeoffPoint {
            setting: Setting {
                method: "fast".into(),
                adhesive: false,
                nx,
                ny: nx,
                precision: "f64".into(),
                tolerance: 1e-8,
                layer_thickness: None,
                block: None,
            },
            paper_name: String::new(),
            criterion: String::new(),
            calibrated_on: None,
            is_reference,
            unavailable_reason: None,
            missing: Vec::new(),
            cost: Cost { wall_seconds: 0.123_456, cpu_seconds: 0.2, ..Cost::default() },
            errors: Errors::new(),
            loads: vec![LoadErrors { p_star: 0.01, errors: Errors::from([(Quantity::MeanGap, error)]) }],
            resolved: None,
        };
        Tradeoff {
            schema: SCHEMA,
            name: "t".into(),
            scales: ScalesSi { length_m: 1e-4, modulus_pa: 2.5e7 },
            surface: "one".into(),
            gradient: 1.0,
            rms_height: 0.01,
            shortest_wavelength: 0.04,
            hurst: None,
            nx: 256,
            ny: 256,
            p_star: vec![0.01],
            kernel: "half-space".into(),
            adhesion: "none".into(),
            program: String::new(),
            threads: 2,
            repeats: Some(1),
            budget_seconds: None,
            spent_seconds: 0.0,
            references: Vec::new(),
            points: errors.iter().map(point).collect(),
            forecasts: Vec::new(),
            skipped: Vec::new(),
            warnings: Vec::new(),
        }
    }

    /// A small error at a change of sign is replaced by the errors of finer grids and of the reference.
    #[test]
    fn errors_by_chance_do_not_count() {
        let table =
            Table::of(&results(&[(64, 0.04, false), (128, 0.0001, false), (256, 0.02, false), (512, 0.03, true)]));
        let errors: Vec<f64> = table.lines.iter().filter_map(|l| l.errors[&Quantity::MeanGap][0]).collect();
        assert_eq!(errors, [0.04, 0.03, 0.03, 0.03]);
        assert_eq!(table.lines[0].seconds, 0.123);
    }

    /// Errors of larger tolerances, of f32 and of references of another kind do not count for a finer setting.
    #[test]
    fn only_finer_settings_count() {
        let mut found = results(&[
            (128, 0.02, false),
            (128, 0.05, false),
            (128, 0.06, false),
            (256, 0.4, true),
            (128, 0.001, false),
        ]);
        found.points[1].setting.tolerance = 1e-2;
        found.points[2].setting.precision = "f32".into();
        found.points[3].setting.adhesive = true;
        (found.points[4].setting.tolerance, found.points[4].setting.precision) = (1e-2, "f32".into());
        let errors: Vec<f64> = Table::of(&found).lines.iter().filter_map(|l| l.errors[&Quantity::MeanGap][0]).collect();
        assert_eq!(errors, [0.02, 0.05, 0.06, 0.4, 0.06]);
    }

    #[test]
    fn other_files_are_refused() {
        let folder = tempfile::tempdir().expect("scratch");
        let file = folder.path().join("tables.json");
        for (text, complaint) in
            [("{\"schema\": 99, \"provenance\": \"\", \"tables\": []}", "99"), ("[]", "asperity tradeoff")]
        {
            std::fs::write(&file, text).expect("written");
            assert!(Tables::read(&file).is_err_and(|e| e.to_string().contains(complaint)), "{text}");
        }
    }

    #[test]
    fn the_shipped_tables_are_read() {
        let shipped = Tables::shipped();
        assert!(!shipped.tables.is_empty() && !shipped.provenance.is_empty());
        assert!(shipped.tables.iter().all(|t| !t.lines.is_empty() && t.hurst == Some(0.8)));
    }
}
