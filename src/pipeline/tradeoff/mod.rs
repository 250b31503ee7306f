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
pub use request::TradeoffRequest;

use super::methods::MethodRun;
use super::{Listener, OutFolder, run};
use crate::record::tradeoff::TradeoffResults;
use crate::scene::Case;
use crate::{Error, Result, report};
use asperity_contact::interface::AttractionLaw;
use asperity_contact::method::Precision;
use atoms::Blocks;
use bench::{BenchmarkResults, BenchmarkRunner};
use benchmark_point::BenchmarkPoint;
use std::path::PathBuf;

/// What a request makes of a case.
struct Settings {
    /// Without atoms.
    case: Case,
    blocks: Option<Blocks>,
    method_runs: Vec<MethodRun>,
    /// The reference with and without adhesion, as needed by the methods: each on its grids, fine to coarse.
    references: Vec<Vec<BenchmarkPoint>>,
    /// Every setting in the order in which it is measured.
    points: Vec<BenchmarkPoint>,
    warnings: Vec<String>,
}

impl Settings {
    /// # Errors
    /// `Input` for grids that do not fit the surface or each other.
    fn of(case: &Case, request: &TradeoffRequest) -> Result<Self> {
        let has_atoms = request.methods.iter().any(|m| m.card().capabilities.atoms) || request.blocks.is_some();
        let blocks = if has_atoms { Blocks::of(case, request.blocks.as_deref())? } else { None };
        if blocks.is_none() && request.methods.iter().all(|m| m.card().capabilities.atoms) {
            let ids: Vec<&str> = request.methods.iter().map(|m| m.card().id).collect();
            let accepted = "a scene with [atoms], whose first load is one of atoms; or other methods";
            return Err(Error::input(case.file.display(), "--methods", ids.join(","), accepted));
        }
        let case = Case::resolve(benchmark_point::bare(case), &case.file)?;
        let mut warnings = case.warnings.clone();
        let (finest, grids) = request.grids(&case, &mut warnings)?;
        let method_runs = method_runs(&case, request, blocks.as_ref());
        warnings.extend(without_adhesion(&case, &method_runs));
        let adhesive = [true, false].into_iter().filter(|a| method_runs.iter().any(|r| r.adhesive == *a));
        let references = adhesive.map(|a| reference::levels(&case, a, finest)).collect();
        let points = points(&case, &method_runs, &grids, blocks.as_ref())?;
        Ok(Settings { case, blocks, method_runs, references, points, warnings })
    }
}

/// Runs the benchmark of a case in a folder, and writes its report page. Returns the results and the path of the page.
///
/// # Errors
/// `Input` for grids that do not fit the surface or each other, and for the results of another scene in the folder; `AuxiliarySolve` if the reference fails; errors of the
/// stages.
pub fn tradeoff<'a>(
    case: &Case,
    request: &TradeoffRequest,
    out: impl Into<OutFolder<'a>>,
    listener: &dyn Listener,
) -> Result<(TradeoffResults, PathBuf)> {
    let folder = out.into();
    let out = folder.path;
    let Settings { case, blocks, method_runs, references, points, mut warnings } = Settings::of(case, request)?;
    run::expect_scene(&case, folder)?;
    let mut bench = BenchmarkRunner::open(&case, request, blocks, folder, listener)?;
    warnings.iter().for_each(|w| listener.warn(w));
    run::keep_scene(&case, out, listener)?;
    let solved = references.iter().map(|levels| reference::solve_reference(&mut bench, levels, out));
    let references = solved.collect::<Result<Vec<_>>>()?;
    let outcome = bench.measure_all(&points, &references)?;
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

/// Every method on the first grid; then blocks of atoms, in the order of size; then the other grids; then other
/// precisions and tolerances on the first grid.
fn points(
    case: &Case,
    method_runs: &[MethodRun],
    grids: &[usize],
    blocks: Option<&Blocks>,
) -> Result<Vec<BenchmarkPoint>> {
    let tolerance = benchmark_point::base_tolerance(case);
    let on_grid = |n: usize| {
        let runs = method_runs.iter().filter(|r| blocks.is_none() || !r.method.card().capabilities.atoms);
        runs.map(move |&run| BenchmarkPoint::on_grid(run, n, Precision::F64, tolerance))
    };
    let (&first, others) = grids.split_first().expect("at least one grid");
    let mut points: Vec<BenchmarkPoint> = on_grid(first).collect();
    points.extend(blocks.map_or(Vec::new(), Blocks::points));
    points.extend(others.iter().flat_map(|&n| on_grid(n)));
    for point in on_grid(first) {
        points.extend(benchmark_point::refinements(&point, &benchmark_point::at(case, &point)?));
    }
    Ok(points)
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
