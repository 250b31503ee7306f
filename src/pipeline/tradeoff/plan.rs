//! The settings of a trade-off with estimated memory and time.

use super::benchmark_point::{self, BenchmarkPoint, REFERENCE_TOLERANCE};
use super::measured::total_seconds;
use super::reference::LEVELS_BELOW;
use super::{Settings, TradeoffRequest};
use crate::Result;
use crate::pipeline::methods::MethodRun;
use crate::pipeline::plan::RunPlan;
use crate::pipeline::stage::PlannedStage;
use crate::scene::Case;
use asperity_contact::method::{Precision, require};
use asperity_methods::find;

/// The reference solutions and all settings, in the order of the groups in which they run. Settings that the machine's memory or the budget
/// does not permit are left out when they are measured.
///
/// # Errors
/// Those of [`super::tradeoff`] for the scene and the request.
pub fn tradeoff_plan(case: &Case, request: &TradeoffRequest) -> Result<RunPlan> {
    let Settings { case, blocks, finest, grids, method_runs, mut warnings } = Settings::of(case, request)?;
    let tolerance = benchmark_point::base_tolerance(&case);
    let fast = find("fast").expect("it is registered");
    let (mut stages, mut references, mut layers) = (Vec::new(), Vec::new(), Vec::new());
    for adhesive in [true, false].into_iter().filter(|a| method_runs.iter().any(|r| r.adhesive == *a)) {
        let run = MethodRun { method: fast, adhesive };
        let point = BenchmarkPoint::on_grid(run, finest, Precision::F64, tolerance.min(REFERENCE_TOLERANCE));
        for n in benchmark_point::halves(finest, LEVELS_BELOW) {
            if benchmark_point::on_grid(&case, n).is_ok() {
                stages.push(planned("reference", &BenchmarkPoint { n, ..point }, &case, request.repeats)?);
                references.push(BenchmarkPoint { n, ..point }.stage());
            }
        }
        let n = *grids.first().unwrap_or(&finest);
        let layer = |&thickness: &f64| BenchmarkPoint { n, layer_thickness: Some(thickness), ..point };
        layers.extend(request.layer_thicknesses.iter().map(layer));
    }
    let flows = |r: &MethodRun| require::hardness(&benchmark_point::problem(&case, r), r.method.card()).is_ok();
    let on_grids = |r: &&MethodRun| !r.method.card().capabilities.atoms && flows(r);
    let point = |&run: &MethodRun, n: usize| BenchmarkPoint::on_grid(run, n, Precision::F64, tolerance);
    let own = || method_runs.iter().filter(on_grids);
    let mut points: Vec<BenchmarkPoint> = grids.iter().flat_map(|&n| own().map(move |r| point(r, n))).collect();
    for first in own().filter_map(|r| Some(point(r, *grids.first()?))) {
        points.extend(benchmark_point::refinements(&first, &benchmark_point::at(&case, &first)?));
    }
    points.extend(layers);
    // What a reference has solved is not solved again.
    for p in points.iter().filter(|p| !references.contains(&p.stage())) {
        stages.push(planned("setting", p, &case, request.repeats)?);
    }
    if request.budget_seconds.is_some() {
        warnings.push(
            "settings that the budget does not permit are left out, which ones is known when they are measured".into(),
        );
    }
    for (point, planned) in blocks.iter().flat_map(|blocks| blocks.planned()) {
        match planned {
            Ok((bytes, seconds)) => {
                stages.push(PlannedStage { name: "atoms".into(), what: point.label(), bytes, seconds })
            }
            Err(reason) => warnings.push(format!("{}: left out: {reason}", point.label())),
        }
    }
    Ok(RunPlan {
        bytes: stages.iter().map(|s| s.bytes).max().unwrap_or(0),
        seconds: stages.iter().map(|s| s.seconds).sum(),
        stages,
        atoms: None,
        audit: Vec::new(),
        warnings,
    })
}

fn planned(name: &str, point: &BenchmarkPoint, case: &Case, repeats: Option<usize>) -> Result<PlannedStage> {
    let case = benchmark_point::at(case, point)?;
    let seconds = total_seconds(repeats, point.expected_seconds(&[], &case));
    Ok(PlannedStage { name: name.into(), what: point.label(), bytes: point.planned_bytes(&case), seconds })
}
