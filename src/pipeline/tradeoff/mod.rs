//! Benchmark of cost and accuracy: methods, grids, precisions and tolerances are compared with one reference. Each
//! setting is a stage.

mod atoms;
mod bench;
mod benchmark_point;
mod errors;
mod measured;
mod plan;
mod reference;
mod request;
mod results;

pub use plan::tradeoff_plan;
pub use request::{ExactSetting, TradeoffRequest};

use super::methods::MethodRun;
use super::{Listener, OutFolder, run};
use crate::record::tradeoff::TradeoffResults;
use crate::scene::Case;
use crate::{Error, Result, report};
use asperity_contact::interface::{AttractionLaw, Elastic};
use atoms::Blocks;
use bench::{BenchmarkResults, BenchmarkRunner};
use std::path::PathBuf;

/// What a request makes of a case.
struct Settings {
    /// Without atoms.
    case: Case,
    blocks: Option<Blocks>,
    /// Points per side of the reference.
    finest: usize,
    grids: Vec<usize>,
    method_runs: Vec<MethodRun>,
    warnings: Vec<String>,
}

impl Settings {
    /// # Errors
    /// `Input` for grids that do not fit the surface or each other, and for layers in place of another body.
    fn of(case: &Case, request: &TradeoffRequest) -> Result<Self> {
        let has_atoms = request.methods.iter().any(|m| m.card().capabilities.atoms) || request.blocks.is_some();
        let blocks =
            if has_atoms && request.exact.is_none() { Blocks::of(case, request.blocks.as_deref())? } else { None };
        let case = Case::resolve(benchmark_point::bare(case), &case.file)?;
        if !request.layer_thicknesses.is_empty() && case.model.kernel != Elastic::HalfSpace {
            let accepted =
                format!("a scene with a half-space, which the layers replace; this scene has a {}", case.model.kernel);
            return Err(Error::input("command line", "--layer-thickness", "given", accepted));
        }
        let mut warnings = case.warnings.clone();
        let (finest, grids) = request.grids(&case, &mut warnings)?;
        let method_runs = method_runs(&case, request, blocks.as_ref());
        warnings.extend(without_adhesion(&case, &method_runs));
        Ok(Settings { case, blocks, finest, grids, method_runs, warnings })
    }
}

/// Runs the benchmark of a case in a folder, and writes its report page. Returns the results and the path of the page.
///
/// # Errors
/// `Input` for grids that do not fit the surface or each other; `AuxiliarySolve` if the reference fails; errors of the
/// stages.
pub fn tradeoff<'a>(
    case: &Case,
    request: &TradeoffRequest,
    out: impl Into<OutFolder<'a>>,
    listener: &dyn Listener,
) -> Result<(TradeoffResults, PathBuf)> {
    let folder = out.into();
    let out = folder.path;
    let Settings { case, blocks, finest, grids, method_runs, mut warnings } = Settings::of(case, request)?;
    let mut bench = BenchmarkRunner::open(&case, request, blocks, folder, listener)?;
    warnings.iter().for_each(|w| listener.warn(w));
    run::keep_scene(&case, out, listener)?;
    let mut references = Vec::new();
    for adhesive in [true, false] {
        if method_runs.iter().any(|r| r.adhesive == adhesive) {
            references.push(reference::solve_reference(&mut bench, &case, adhesive, finest, out)?);
        }
    }
    let outcome = match &request.exact {
        Some(list) => bench.measure_all(&method_runs, list, &references)?,
        None => bench.measure_grids(&method_runs, &grids, &request.layer_thicknesses, &references)?,
    };
    warnings.extend(notes(&case, &outcome));
    let table = results::table((&case, request), &bench, &method_runs, &references, outcome, warnings);
    table.write(out)?;
    let page = report::write(out)?;
    run::list_files(out)?;
    Ok((table, page))
}

/// The requested methods, with the scene's adhesion where they support it.
fn method_runs(case: &Case, request: &TradeoffRequest, blocks: Option<&Blocks>) -> Vec<MethodRun> {
    let attracts = case.model.adhesion != AttractionLaw::None;
    let run = |&method| MethodRun { method, adhesive: attracts && method.card().supports_adhesion() };
    let mut method_runs: Vec<MethodRun> = request.methods.iter().map(run).collect();
    if let Some(blocks) = blocks {
        method_runs.retain(|r| !r.method.card().capabilities.atoms);
        method_runs.extend(blocks.points().first().map(|p| p.method_run));
    }
    method_runs
}

/// Warning for methods without adhesion in a scene with adhesion.
fn without_adhesion(case: &Case, method_runs: &[MethodRun]) -> Option<String> {
    let without = method_runs.iter().filter(|r| case.model.adhesion != AttractionLaw::None && !r.adhesive);
    let ids: Vec<&str> = without.map(|r| r.method.card().id).collect();
    let compared = "no adhesion, therefore compared with the solution without the scene's adhesion";
    (!ids.is_empty()).then(|| format!("{}: {compared}", ids.join(", ")))
}

/// Warnings about the measured settings.
fn notes(case: &Case, outcome: &BenchmarkResults) -> Vec<String> {
    let mut notes: Vec<String> = outcome.done.iter().flat_map(|(_, measured)| measured.notes.clone()).collect();
    let all = case.loading_steps().len();
    for (point, measured) in outcome.done.iter().filter(|(point, _)| point.block.is_some()) {
        let reached = measured.results.states.len();
        if reached < all {
            notes.push(format!("{}: only the first {reached} of {all} loads were run and compared", point.label()));
        }
    }
    notes
}
