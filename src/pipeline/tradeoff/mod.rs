//! Benchmark of cost and accuracy: methods, grids, precisions and tolerances are compared with one reference. Each
//! setting is a stage.

mod atoms;
mod bench;
mod benchmark_point;
mod errors;
mod verification;

use super::methods::MethodRun;
use super::{Listener, run};
use crate::compare::forecast::{Ran, forecast};
use crate::interface::{Adhesion, Elastic, RangeChoice};
use crate::method::{ContactMethod, Precision, all_atom};
use crate::record::results::ScalesSi;
use crate::record::tradeoff::{
    BlockSize, Forecast, LoadErrors, Reference, ReferenceLoad, ResolvedErrors, SCHEMA, SkippedSetting, Tradeoff,
    TradeoffPoint,
};
use crate::scene::{Case, Surface};
use crate::{Error, Result, report};
use atoms::Blocks;
use bench::{Bench, Measured};
use benchmark_point::{BenchmarkPoint, COARSEST, REFERENCE_TOLERANCE};
use std::path::{Path, PathBuf};
pub use verification::{Verification, verify};

/// Coarser grids of the reference. Three grids in all are the minimum for a test of the order of convergence.
const LEVELS_BELOW: usize = 2;

/// Points per side of the finest grid, as in scenes.
const FINEST: usize = 65_536;

/// Request for a benchmark.
pub struct TradeoffRequest {
    pub methods: Vec<&'static dyn ContactMethod>,
    /// Points per side, each a divisor of the reference's. Default: the scene's, one half and one quarter of it.
    pub grids: Option<Vec<usize>>,
    /// Points per side of the reference. Default: the scene's.
    pub reference: Option<usize>,
    /// Limit on the wall time of all settings, including earlier runs in the same folder, s.
    pub budget_seconds: Option<f64>,
    /// Runs of each setting. Default: one, and more for short settings.
    pub repeats: Option<usize>,
    /// Only these settings, on grids that need not divide the reference's.
    pub exact: Option<Vec<ExactSetting>>,
    /// Thicknesses of bonded layers that replace the half-space, units of L; solved by the reference's method on the
    /// scene's grid.
    pub slabs: Vec<f64>,
    /// Blocks of atoms. Default: those of a scene with atoms, if `all-atom` is among the methods.
    pub blocks: Option<Vec<BlockSize>>,
}

/// A setting that is requested explicitly.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactSetting {
    pub method: String,
    pub n: usize,
    pub precision: Precision,
    pub tolerance: f64,
}

impl ExactSetting {
    /// Whether `point` was measured with this setting.
    pub fn is_of(&self, point: &TradeoffPoint) -> bool {
        let s = &point.setting;
        (&s.method, s.nx, s.precision.as_str(), s.tolerance)
            == (&self.method, self.n, benchmark_point::word(self.precision), self.tolerance)
    }
}

/// The reference solution, with its extrapolated numbers and their uncertainty from coarser grids.
struct ReferenceSolution {
    rung: BenchmarkPoint,
    measured: Measured,
    ny: usize,
    numbers: Vec<ReferenceLoad>,
    uncertainty: Vec<LoadErrors>,
    coarser: Vec<usize>,
}

/// Runs the benchmark of a case in a folder, and writes its report page. Returns the results and the path of the page.
///
/// # Errors
/// `Input` for grids that do not fit the surface or each other; `AuxiliarySolve` if the reference fails; errors of the
/// stages.
pub fn tradeoff(
    case: &Case,
    asked: &TradeoffRequest,
    out: &Path,
    listener: &dyn Listener,
) -> Result<(Tradeoff, PathBuf)> {
    let has_atoms = asked.methods.iter().any(|m| m.card().id == all_atom::ID) || asked.blocks.is_some();
    let blocks = if has_atoms && asked.exact.is_none() { Blocks::of(case, asked.blocks.as_deref())? } else { None };
    let case = Case::resolve(benchmark_point::bare(case), &case.file)?;
    if !asked.slabs.is_empty() && case.kernel != Elastic::HalfSpace {
        let accepted = format!("a scene of a half-space that layers stand for, not of a {}", case.kernel);
        return Err(Error::input("command line", "--layer-thickness", "given", accepted));
    }
    let mut warnings = case.warnings.clone();
    let (reference, grids) = match &asked.exact {
        Some(list) => (asked.reference.unwrap_or(case.grid.nx), list.iter().map(|e| e.n).collect()),
        None => grids(&case, asked, &mut warnings)?,
    };
    let attracts = case.adhesion != Adhesion::None;
    let mut besides: Vec<MethodRun> = asked
        .methods
        .iter()
        .map(|&method| MethodRun { method, adhesive: attracts && method.card().supports_adhesion() })
        .collect();
    if let Some(blocks) = &blocks {
        besides.retain(|b| b.method.card().id != all_atom::ID);
        besides.extend(blocks.points().first().map(|r| r.beside));
    }
    let without: Vec<&str> = besides.iter().filter(|b| attracts && !b.adhesive).map(|b| b.method.card().id).collect();
    if !without.is_empty() {
        warnings.push(format!(
            "{}: knowing no adhesion, compared with the solution without it, and not with that of the scene",
            without.join(", ")
        ));
    }
    let mut bench = Bench::open(&case, asked, blocks, out, listener)?;
    warnings.iter().for_each(|w| listener.warn(w));
    run::keep_scene(&case, out)?;
    let mut references = Vec::new();
    for adhesive in [true, false] {
        if besides.iter().any(|b| b.adhesive == adhesive) {
            references.push(truth(&mut bench, &case, adhesive, reference, out)?);
        }
    }
    let of = |rung: &BenchmarkPoint| references.iter().find(|t| t.rung.beside.adhesive == rung.beside.adhesive);
    let outcome = match &asked.exact {
        Some(list) => bench.measure_all(&besides, list, &references)?,
        None => bench.measure_grids(&besides, &grids, &asked.slabs, &references)?,
    };
    warnings.extend(outcome.done.iter().flat_map(|(_, found)| found.notes.clone()));
    let there = case.loading_steps().len();
    for (rung, found) in outcome.done.iter().filter(|(rung, _)| rung.block.is_some()) {
        let pressed = found.results.states.len();
        if pressed < there {
            warnings.push(format!(
                "{}: pressed at the first {pressed} of {there} loads, which its errors are of",
                rung.words()
            ));
        }
    }
    let cost = |c: &crate::record::tradeoff::Cost, truth: &ReferenceSolution| crate::record::tradeoff::Cost {
        cpu_over_reference: c.cpu_seconds / truth.measured.cost.cpu_seconds.max(f64::MIN_POSITIVE),
        ..*c
    };
    let rough = bench.rough;
    let point = |(rung, found): &(BenchmarkPoint, Measured)| {
        let truth = of(rung)?;
        let is_reference = rung.stage() == truth.rung.stage();
        let loads = match &found.results.unavailable_reason {
            Some(_) => Vec::new(),
            None if is_reference => truth.uncertainty.clone(),
            None => errors::errors((found, &found.maps), &truth.measured, &truth.numbers, rough),
        };
        let resolved = rung.block.and_then(|_| {
            let on = bench.on_resolved_heights(rung, &truth.rung);
            let other = bench.known(&on)?;
            let numbers = errors::numbers(&[&other.results.states]);
            let loads = errors::errors((found, &found.resolved), other, &numbers, rough);
            let (shortest_wavelength, gradient) = bench.resolved(rung);
            let errors = errors::over_loads(loads.iter().map(|l| &l.errors));
            Some(ResolvedErrors { shortest_wavelength, gradient, nx: on.n, errors, loads })
        });
        let card = rung.beside.method.card();
        Some(TradeoffPoint {
            setting: rung.setting(found.ny),
            paper_name: card.paper_name.into(),
            criterion: found.results.criterion.clone(),
            calibrated_on: found.results.calibrated_on.clone(),
            is_reference,
            unavailable_reason: found.results.unavailable_reason.clone(),
            missing: found.results.missing.clone(),
            cost: cost(&found.cost, truth),
            errors: errors::over_loads(loads.iter().map(|l| &l.errors)),
            loads,
            resolved,
        })
    };
    let mut points: Vec<TradeoffPoint> = outcome.done.iter().filter_map(point).collect();
    // Order of the tables: methods as in the registry, fine grids first.
    let place = |p: &TradeoffPoint| besides.iter().position(|b| b.method.card().id == p.setting.method);
    points.sort_by_key(|p| (place(p), p.setting.layer_thickness.is_some(), std::cmp::Reverse(p.setting.nx)));
    let left_out = outcome.skipped.into_iter().map(|(rung, reason)| {
        let ny = rung.n * case.grid.ny / case.grid.nx;
        SkippedSetting { setting: rung.setting(ny), reason }
    });
    let mut told = Tradeoff {
        schema: SCHEMA,
        name: case.scene.name.clone(),
        scales: ScalesSi { length_m: case.scales.length_m, modulus_pa: case.scales.modulus_pa },
        surface: case.surface.origin(),
        gradient: case.gradient,
        rms_height: rough.height,
        shortest_wavelength: shortest_wavelength(&case.surface),
        nx: case.grid.nx,
        ny: case.grid.ny,
        p_star: case.loading_p_star(),
        kernel: case.kernel.to_string(),
        adhesion: adhesion_words(&case),
        program: format!("asperity {}", env!("CARGO_PKG_VERSION")),
        threads: rayon::current_num_threads(),
        repeats: asked.repeats,
        budget_seconds: asked.budget_seconds,
        spent_seconds: bench.spent_seconds(),
        references: references
            .iter()
            .map(|t| Reference {
                setting: t.rung.setting(t.ny),
                cost: cost(&t.measured.cost, t),
                coarser: t.coarser.clone(),
                loads: t.numbers.clone(),
                uncertainty: errors::over_loads(t.uncertainty.iter().map(|l| &l.errors)),
            })
            .collect(),
        points,
        forecasts: Vec::new(),
        skipped: left_out.collect(),
        warnings,
    };
    told.forecasts = besides.iter().filter_map(|b| foreseen(&told.grids(b.method.card().id))).collect();
    told.write(out)?;
    let page = report::write_tradeoff(out)?;
    Ok((told, page))
}

/// Cost forecast of a method: for the finest grid from all coarser ones, and for twice its points per side from all
/// grids. None with fewer than three grids.
fn foreseen(grids: &[&TradeoffPoint]) -> Option<Forecast> {
    let mut grids = grids.to_vec();
    grids.sort_by_key(|p| p.setting.nx);
    let (finest, coarser) = grids.split_last().filter(|(_, coarser)| coarser.len() >= 2)?;
    let ran = |p: &&TradeoffPoint| Ran {
        points: (p.setting.nx * p.setting.ny) as f64,
        pairs: p.cost.fft_pairs,
        seconds: p.cost.cpu_seconds,
    };
    let all: Vec<Ran> = grids.iter().map(ran).collect();
    let points = all.last()?.points;
    let predicted = forecast(&all[..coarser.len()], points)?;
    Some(Forecast {
        setting: finest.setting.clone(),
        coarser: coarser.iter().map(|p| p.setting.nx).collect(),
        predicted_cpu_seconds: predicted,
        cpu_seconds: finest.cost.cpu_seconds,
        ratio: predicted / finest.cost.cpu_seconds,
        doubled_grid_cpu_seconds: forecast(&all, 4.0 * points),
    })
}

/// Points per side of the reference, and of the grids in the order in which they run.
fn grids(case: &Case, asked: &TradeoffRequest, warnings: &mut Vec<String>) -> Result<(usize, Vec<usize>)> {
    const PLACE: &str = "command line";
    let own = case.grid.nx;
    let reference = asked.reference.unwrap_or(own);
    let range = |key: &str, n: usize| match (COARSEST..=FINEST).contains(&n) {
        true => Ok(()),
        false => Err(Error::input(PLACE, key, n, format!("{COARSEST} to {FINEST} points a side"))),
    };
    if asked.reference.is_some() {
        range("--reference", reference)?;
        if matches!(case.surface, Surface::Imported { .. }) && reference != own {
            let accepted = format!("{own}, the map's own: a height map has no finer grid");
            return Err(Error::input(PLACE, "--reference", reference, accepted));
        }
        if asked.grids.is_none() && !reference.is_multiple_of(own) {
            let accepted = format!("a multiple of the scene's {own} points a side, or --grids that divide it");
            return Err(Error::input(PLACE, "--reference", reference, accepted));
        }
    }
    let mut list = Vec::new();
    match &asked.grids {
        Some(given) => {
            for &n in given {
                range("--grids", n)?;
                if !reference.is_multiple_of(n) {
                    let accepted =
                        format!("divisors of the reference's {reference} points a side: nodes must coincide");
                    return Err(Error::input(PLACE, "--grids", n, accepted));
                }
                benchmark_point::on_grid(case, n).map_err(|e| e.with_context(PLACE, Some("--grids")))?;
                if !list.contains(&n) {
                    list.push(n);
                }
            }
        }
        None => {
            for n in benchmark_point::default_grids(own) {
                match benchmark_point::on_grid(case, n) {
                    Ok(_) => list.push(n),
                    Err(e) => warnings.push(format!("no grid of {n} points a side: {e}")),
                }
            }
        }
    }
    list.sort_unstable_by(|a, b| b.cmp(a));
    // The scene's own grid runs first, if it is in the list; the others follow from fine to coarse.
    if let Some(i) = list.iter().position(|n| *n == own) {
        list[..=i].rotate_right(1);
    }
    Ok((reference, list))
}

/// Solves the reference and its coarser grids.
fn truth(bench: &mut Bench, case: &Case, adhesive: bool, n: usize, out: &Path) -> Result<ReferenceSolution> {
    let fast = crate::method::find("fast").expect("it is registered");
    let tolerance = benchmark_point::base_tolerance(case).min(REFERENCE_TOLERANCE);
    let at = |n: usize| BenchmarkPoint::on_grid(MethodRun { method: fast, adhesive }, n, Precision::F64, tolerance);
    let rung = at(n);
    let measured = bench.measure(&rung, None, None)?;
    if let Some(why) = &measured.results.unavailable_reason {
        let why = format!("the reference ({}) is not available: {why}", rung.words());
        return Err(Error::AuxiliarySolve { why, kept: out.to_path_buf() });
    }
    let key = bench.reference_key(&rung)?;
    let mut levels = Vec::new();
    for n in benchmark_point::halves(n, LEVELS_BELOW).into_iter().skip(1) {
        // A grid that does not resolve the surface, or whose solution fails, gives no estimate; nor do coarser grids.
        if benchmark_point::on_grid(case, n).is_err() {
            break;
        }
        let found = bench.measure(&at(n), Some((&rung, (&measured, &key))), None)?;
        if found.results.unavailable_reason.is_some() {
            break;
        }
        levels.push((n, found));
    }
    levels.reverse();
    let states: Vec<_> =
        levels.iter().map(|(_, m)| m).chain([&measured]).map(|m| m.results.states.as_slice()).collect();
    let numbers = errors::numbers(&states);
    let rough = bench.rough;
    let below = levels.iter().rev().map(|(_, m)| errors::errors((m, &m.maps), &measured, &numbers, rough));
    let uncertainty = errors::uncertainty(&numbers, &below.collect::<Vec<_>>(), rough);
    let coarser = levels.iter().map(|(n, _)| *n).collect();
    Ok(ReferenceSolution { rung, ny: measured.ny, measured, numbers, uncertainty, coarser })
}

/// Adhesion as named in tables. With a true range on every grid, coarse grids may not resolve it and the problem
/// differs from the default, so the text states it.
pub fn adhesion_words(case: &Case) -> String {
    match case.range() {
        RangeChoice::True if case.adhesion != Adhesion::None => format!("{}, true on every grid", case.adhesion),
        _ => case.adhesion.to_string(),
    }
}

/// Shortest wavelength of a surface, units of L; for a height map, two grid spacings.
pub fn shortest_wavelength(surface: &Surface) -> f64 {
    match surface {
        Surface::Synthesised { spectrum, .. } => spectrum.lambda_s,
        Surface::Fourier { modes, .. } => modes.shortest(),
        Surface::Imported { grid, .. } => 2.0 * grid.dx(),
    }
}
