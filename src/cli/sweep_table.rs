//! Results of a sweep on stdout.

use super::output;
use crate::Result;
use crate::record::ensemble::{Ensemble, EnsembleStatistic, PointStatus};
use crate::report::number::significant;
use std::path::Path;

/// Standard deviation over mean of equal pressures that rounding makes differ.
const SCATTER: f64 = 1e-9;

/// Statistics and failures of a sweep.
pub(super) fn print(ensemble: &Ensemble, out: &Path, page: &Path, json: bool) -> Result<()> {
    let count = |status: PointStatus| ensemble.points.iter().filter(|p| p.status == status).count();
    let (record, failed) = (count(PointStatus::Done), count(PointStatus::Failed));
    if json {
        return output::json_line(&serde_json::json!({
            "out": output::path(out),
            "report": output::path(page),
            "points": ensemble.points.len(),
            "done": record,
            "failed": failed,
        }));
    }
    let shown = ["contact_area", "mean_gap", "kappa"];
    // Imposed gaps and contact areas have another pressure on each realisation.
    let is_shown = |s: &&EnsembleStatistic| {
        let scatters = s.sample.standard_deviation.is_some_and(|d| d > SCATTER * s.sample.mean.abs());
        shown.contains(&s.of.quantity.as_str()) || s.of.quantity == "pressure" && scatters
    };
    let rows = ensemble.statistics.iter().filter(is_shown).map(|s| {
        let group: Vec<String> = s.group.iter().map(|(k, v)| format!("{k} = {v}")).collect();
        let error = s.sample.standard_error.map_or("-".into(), |e| significant(e, 2));
        let scatter = s.sample.standard_deviation.map_or("-".into(), |e| significant(e, 2));
        let (quantity_of_load, load) = s.load.given();
        let (load, mean) = (quantity_of_load.value(load), significant(s.sample.mean, 4));
        let n = s.sample.realisations.to_string();
        let (source, quantity) = (s.of.source.clone(), s.of.quantity.clone());
        vec![group.join(", "), source, load, quantity, mean, error, scatter, n, s.of.unit.clone()]
    });
    let head = [
        "",
        "source",
        ensemble.loads().head(),
        "quantity",
        "mean",
        "standard error",
        "standard deviation",
        "n",
        "unit",
    ];
    output::print(&output::table(&head, rows));
    ensemble.warnings().iter().for_each(|w| output::print(&format!("warning: {w}")));
    let failures = ensemble.points.iter().filter_map(|p| Some((&p.label, p.reason.as_ref()?)));
    failures.for_each(|(label, reason)| output::print(&format!("failed: {label}: {reason}")));
    output::print(&format!("{record} of {} points done, {failed} failed", ensemble.points.len()));
    output::print(&format!("report: {}", page.display()));
    Ok(())
}
