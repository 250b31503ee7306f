//! Cost and error of one method's settings as Markdown tables: series over grid, tolerance, precision and layer
//! thickness.

use super::number::{duration, error_of, significant};
use crate::record::quantity::Quantity;
use crate::record::tradeoff::{Tradeoff, TradeoffPoint};

/// Error columns.
const COLUMNS: [Quantity; 7] = [
    Quantity::ContactArea,
    Quantity::MeanGap,
    Quantity::Stiffness,
    Quantity::GapMap,
    Quantity::ContactMap,
    Quantity::GapPdf,
    Quantity::StressPdf,
];

/// Tables of a method's points, one per series in which a single parameter differs from the setting of the reference.
pub fn markdown(tradeoff: &Tradeoff, method: &str) -> String {
    let known: Vec<&TradeoffPoint> =
        tradeoff.points.iter().filter(|p| p.setting.method == method && p.unavailable_reason.is_none()).collect();
    let grids: Vec<&TradeoffPoint> = tradeoff.grids(method);
    let Some(base) = grids.first().map(|p| &p.setting) else { return String::new() };
    let of = |p: &&&TradeoffPoint, n: usize| p.setting.nx == n && p.setting.layer_thickness.is_none();
    // Series over tolerance and precision use the grid with the most settings.
    let settings = |n: usize| known.iter().filter(|p| of(p, n)).count();
    let n = grids.iter().map(|p| p.setting.nx).max_by_key(|n| settings(*n)).unwrap_or(base.nx);
    let mut tolerances: Vec<&TradeoffPoint> =
        known.iter().filter(|p| of(p, n) && p.setting.precision == base.precision).copied().collect();
    tolerances.sort_by(|a, b| b.setting.tolerance.total_cmp(&a.setting.tolerance));
    let precisions: Vec<&TradeoffPoint> =
        known.iter().filter(|p| of(p, n) && p.setting.precision != base.precision).copied().collect();
    let mut layers: Vec<&TradeoffPoint> =
        known.iter().filter(|p| p.setting.layer_thickness.is_some()).copied().collect();
    layers.sort_by(|a, b| {
        a.setting.layer_thickness.partial_cmp(&b.setting.layer_thickness).unwrap_or(std::cmp::Ordering::Equal)
    });
    let mut coarse_first = grids.clone();
    coarse_first.sort_by_key(|p| p.setting.nx);
    let wave = |p: &TradeoffPoint| significant(p.setting.nx as f64 * tradeoff.shortest_wavelength, 3);
    let mut text = String::new();
    let head = ["points per side", "per shortest wave"].map(str::to_string);
    table(&mut text, "Grid", &head, &coarse_first, &|p| vec![p.setting.nx.to_string(), wave(p)]);
    let tolerance = |p: &TradeoffPoint| vec![format!("{:e}", p.setting.tolerance)];
    table(&mut text, "Tolerance", &[format!("tolerance on {n} points per side")], &tolerances, &tolerance);
    let precision = |p: &TradeoffPoint| vec![format!("{} to {:e}", p.setting.precision, p.setting.tolerance)];
    table(&mut text, "Precision", &[format!("precision on {n} points per side")], &precisions, &precision);
    let thickness = |p: &TradeoffPoint| vec![p.setting.layer_thickness.map_or(String::new(), |t| significant(t, 3))];
    table(&mut text, "Finite layer thickness", &["thickness / L".to_string()], &layers, &thickness);
    text
}

fn table(
    text: &mut String,
    title: &str,
    head: &[String],
    points: &[&TradeoffPoint],
    of: &dyn Fn(&TradeoffPoint) -> Vec<String>,
) {
    if points.is_empty() {
        return;
    }
    let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
    let names = COLUMNS.map(|m| m.name().to_string());
    text.push_str(&format!("### {title}\n\n"));
    text.push_str(&line(head.iter().cloned().chain(["CPU".into()]).chain(names).collect()));
    text.push_str(&line(vec!["---".into(); head.len() + 1 + COLUMNS.len()]));
    for p in points {
        let error = |m: Quantity| p.errors.get(&m).map_or("–".into(), |e| error_of(m, *e));
        text.push_str(&line(
            of(p).into_iter().chain([duration(p.cost.cpu_seconds)]).chain(COLUMNS.map(error)).collect(),
        ));
    }
    text.push('\n');
}
