//! Tables of a sweep.

use crate::record::ensemble::{
    DIFFERENCES_FILE, Ensemble, EnsembleLoad, NUMBERS_FILE, Observable, STATISTICS_FILE, Sample,
};
use crate::record::given_loads::LoadQuantity;
use asperity_contact::load::Branch;
use asperity_grid::error::Result;
use asperity_surface::files::atomic_file::write_atomic;
use serde_json::Value;
use std::io::Write;
use std::path::Path;

/// `numbers.csv`: one row for each number of each point. `statistics.csv` and `differences.csv`: one for each mean.
pub(super) fn write(out: &Path, ensemble: &Ensemble) -> Result<()> {
    let groups: Vec<&String> = ensemble.keys.iter().filter(|k| *k != crate::compare::ensemble::SEED).collect();
    let loads = ensemble.loads();
    let observable = [&OBSERVABLE[..], column(loads)].concat();
    let mut rows = Vec::new();
    for point in &ensemble.points {
        let values: Vec<String> = point.values.iter().map(cell).collect();
        rows.extend(point.numbers.iter().map(|o| {
            [
                vec![cell(&point.label.clone().into())],
                values.clone(),
                of(&o.of, &o.load, loads),
                vec![format!("{:?}", o.value)],
            ]
            .concat()
        }));
    }
    let keys: Vec<&str> = ensemble.keys.iter().map(String::as_str).collect();
    table(&out.join(NUMBERS_FILE), &[&["point"], &keys[..], &observable, &["value"]].concat(), &rows)?;
    let named = |group: &[(String, Value)]| -> Vec<String> {
        groups.iter().map(|k| group.iter().find(|(g, _)| g == *k).map_or(String::new(), |(_, v)| cell(v))).collect()
    };
    let keys: Vec<&str> = groups.iter().map(|k| k.as_str()).collect();
    let rows: Vec<Vec<String>> = ensemble
        .statistics
        .iter()
        .map(|s| [named(&s.group), of(&s.of, &s.load, loads), sample(Some(&s.sample))].concat())
        .collect();
    table(&out.join(STATISTICS_FILE), &[&keys[..], &observable, &SAMPLE].concat(), &rows)?;
    let rows: Vec<Vec<String>> = ensemble
        .differences
        .iter()
        .map(|d| {
            let parts = [sample(Some(&d.difference)), sample(d.relative.as_ref())].concat();
            [named(&d.group), of(&d.of, &d.load, loads), vec![d.reference.clone()], parts].concat()
        })
        .collect();
    let relative = SAMPLE.map(|name| format!("relative_{name}"));
    let relative: Vec<&str> = relative.iter().map(String::as_str).collect();
    table(&out.join(DIFFERENCES_FILE), &[&keys[..], &observable, &["reference"], &SAMPLE, &relative].concat(), &rows)
}

const OBSERVABLE: [&str; 6] = ["source", "load", "branch", "quantity", "unit", "p_star"];
const SAMPLE: [&str; 8] =
    ["realisations", "mean", "standard_deviation", "standard_error", "confidence_low", "confidence_high", "min", "max"];

/// The load as the scene gave it.
fn column(loads: LoadQuantity) -> &'static [&'static str] {
    match loads {
        LoadQuantity::PStar => &[],
        LoadQuantity::Pressure => &["pressure_Pa"],
        LoadQuantity::Force => &["force_N"],
    }
}

/// The load is counted from 1, as in `curve.csv`.
fn of(o: &Observable, load: &EnsembleLoad, loads: LoadQuantity) -> Vec<String> {
    let branch = match o.branch {
        Branch::Loading => "loading",
        Branch::Unloading => "unloading",
    };
    let number = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:?}"));
    let given = match loads {
        LoadQuantity::PStar => None,
        LoadQuantity::Pressure => Some(number(load.pressure)),
        LoadQuantity::Force => Some(number(load.force)),
    };
    let (index, p_star) = ((o.load + 1).to_string(), format!("{:?}", load.p_star));
    let cells = [o.source.clone(), index, branch.into(), o.quantity.clone(), o.unit.clone(), p_star];
    cells.into_iter().chain(given).collect()
}

/// Empty where there is no value.
fn sample(s: Option<&Sample>) -> Vec<String> {
    let Some(s) = s else { return vec![String::new(); SAMPLE.len()] };
    let number = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:?}"));
    let [low, high] = s.confidence.map_or([None; 2], |[l, h]| [Some(l), Some(h)]);
    let scatter = [Some(s.mean), s.standard_deviation, s.standard_error, low, high, Some(s.min), Some(s.max)];
    [s.realisations.to_string()].into_iter().chain(scatter.map(number)).collect()
}

fn cell(value: &Value) -> String {
    let text = value.as_str().map_or_else(|| value.to_string(), str::to_string);
    let quoted = text.contains([',', '"', '\n']);
    if quoted { format!("\"{}\"", text.replace('"', "\"\"")) } else { text }
}

fn table(path: &Path, header: &[&str], rows: &[Vec<String>]) -> Result<()> {
    write_atomic(path, |w| {
        writeln!(w, "{}", header.join(","))?;
        rows.iter().try_for_each(|row| writeln!(w, "{}", row.join(",")))
    })
}
