//! Results of a sweep on stdout.

use super::output;
use crate::Result;
use crate::record::ensemble::{Ensemble, EnsembleStatistic, PointStatus};
use crate::report::number::significant;
use asperity_contact::load::Branch;
use std::path::Path;

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
        shown.contains(&s.of.quantity.as_str()) || s.of.quantity == "pressure" && s.sample.scatters()
    };
    let several = ensemble.has_realisations();
    let rows = ensemble.statistics.iter().filter(is_shown).map(|s| {
        let group: Vec<String> = s.group.iter().map(|(k, v)| format!("{k} = {v}")).collect();
        let (quantity_of_load, load) = s.load.given();
        let (load, mean) = (quantity_of_load.value(load), significant(s.sample.mean, 4));
        let back = if s.of.branch == Branch::Unloading { ", unloading" } else { "" };
        let (source, quantity) = (format!("{}{back}", s.of.source), s.of.quantity.clone());
        let mut row = vec![group.join(", "), source, load, quantity, mean];
        if several {
            let error = |e: Option<f64>| e.map_or("-".into(), |e| significant(e, 2));
            row.extend([s.sample.standard_error, s.sample.standard_deviation].map(error));
            row.push(s.sample.realisations.to_string());
        }
        row.push(s.of.unit.clone());
        row
    });
    let scatter = ["mean", "standard error", "standard deviation", "n"];
    let value = if several { &scatter[..] } else { &["value"] };
    let head = [&["", "source", ensemble.loads().head(), "quantity"], value, &["unit"]].concat();
    output::print(&output::table(&head, rows));
    ensemble.warnings().iter().for_each(|w| output::print(&format!("warning: {w}")));
    let failures = ensemble.points.iter().filter_map(|p| Some((&p.label, p.reason.as_ref()?)));
    failures.for_each(|(label, reason)| output::print(&format!("failed: {label}: {reason}")));
    output::print(&format!("{record} of {} points done, {failed} failed", ensemble.points.len()));
    output::print(&format!("report: {}", page.display()));
    Ok(())
}
