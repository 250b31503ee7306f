//! The settings of a trade-off with estimated memory and time.

use super::benchmark_point::{self, BenchmarkPoint};
use super::measured::total_seconds;
use super::{Settings, TradeoffRequest};
use crate::Result;
use crate::pipeline::plan::RunPlan;
use crate::pipeline::stage::PlannedStage;
use crate::scene::Case;
use asperity_contact::method::require;

/// The reference solutions and all settings, blocks of atoms last. Settings that the machine's memory or the
/// budget does not permit are left out when they are measured.
///
/// # Errors
/// Those of [`super::tradeoff`] for the scene and the request.
pub fn tradeoff_plan(case: &Case, request: &TradeoffRequest) -> Result<RunPlan> {
    let Settings { case, blocks, references, points, mut warnings, .. } = Settings::of(case, request)?;
    let references: Vec<BenchmarkPoint> = references.concat();
    let is_solved = |point: &BenchmarkPoint| {
        let card = point.method_run.method.card();
        let problem = benchmark_point::problem(&case, &point.method_run);
        !card.capabilities.atoms && require::hardness(&problem, card).is_ok()
    };
    // What a reference has solved is not solved again.
    let is_new = |point: &&BenchmarkPoint| references.iter().all(|r| r.stage() != point.stage());
    let settings = points.iter().filter(|p| is_solved(p)).filter(is_new);
    let named = references.iter().map(|p| ("reference", p)).chain(settings.map(|p| ("setting", p)));
    let mut stages =
        named.map(|(name, p)| planned(name, p, &case, request.repeats)).collect::<Result<Vec<PlannedStage>>>()?;
    if request.budget_seconds.is_some() {
        warnings.push("no setting begins after the budget is spent".into());
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
    let seconds = total_seconds(repeats, point.expected_seconds(&case));
    Ok(PlannedStage { name: name.into(), what: point.label(), bytes: point.planned_bytes(&case), seconds })
}
