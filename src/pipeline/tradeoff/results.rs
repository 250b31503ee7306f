//! Table of a benchmark: measured settings with their cost and errors.

use super::bench::{BenchmarkResults, BenchmarkRunner};
use super::benchmark_point::BenchmarkPoint;
use super::errors;
use super::measured::{MeasuredPoint, ReferenceSolution};
use super::request::TradeoffRequest;
use crate::pipeline::given_loads::given_loads;
use crate::pipeline::methods::MethodRun;
use crate::record::results::ScalesSi;
use crate::record::tradeoff::{
    MeasuredCost, Reference, ResolvedErrors, SCHEMA, SkippedSetting, TradeoffPoint, TradeoffResults,
};
use crate::report::number::SiNotation;
use crate::scene::Case;
use asperity_contact::interface::{AttractionLaw, RangeChoice};
use asperity_surface::HeightSource;

/// `warnings`: those of the benchmark.
pub(super) fn table(
    (case, request): (&Case, &TradeoffRequest),
    bench: &BenchmarkRunner,
    method_runs: &[MethodRun],
    references: &[ReferenceSolution],
    outcome: BenchmarkResults,
    warnings: Vec<String>,
) -> TradeoffResults {
    let mut points: Vec<TradeoffPoint> =
        outcome.done.iter().filter_map(|(point, measured)| row(bench, references, point, measured)).collect();
    // Order of the tables: methods as in the registry, fine grids first.
    let place = |p: &TradeoffPoint| method_runs.iter().position(|r| r.method.card().id == p.setting.method);
    points.sort_by_key(|p| (place(p), std::cmp::Reverse(p.setting.nx)));
    let skipped = outcome.skipped.into_iter().map(|(point, reason)| {
        let ny = point.n * case.model.grid.ny / case.model.grid.nx;
        SkippedSetting { setting: point.setting(ny), reason }
    });
    TradeoffResults {
        schema: SCHEMA,
        name: case.scene.name.clone(),
        scales: ScalesSi { length_m: case.scales.length_m, modulus_pa: case.scales.modulus_pa },
        surface: case.surface().origin(),
        gradient: case.gradient,
        rms_height: case.surface().rms_height(),
        shortest_wavelength: shortest_wavelength(case.surface()),
        hurst: hurst(case.surface()),
        nx: case.model.grid.nx,
        ny: case.model.grid.ny,
        p_star: case.loading_p_star(),
        loads: given_loads(case),
        kernel: case.model.kernel.described(&SiNotation(case.scales)),
        adhesion: adhesion_label(case),
        program: format!("asperity {}", env!("CARGO_PKG_VERSION")),
        threads: rayon::current_num_threads(),
        repeats: request.repeats,
        budget_seconds: request.budget_seconds,
        spent_seconds: bench.spent_seconds(),
        references: references.iter().map(reference).collect(),
        points,
        skipped: skipped.collect(),
        warnings,
    }
}

/// `None` without a reference for the setting.
fn row(
    bench: &BenchmarkRunner,
    references: &[ReferenceSolution],
    point: &BenchmarkPoint,
    measured: &MeasuredPoint,
) -> Option<TradeoffPoint> {
    let reference = ReferenceSolution::of(references, point)?;
    let is_reference = point.stage() == reference.point.stage();
    let load_errors = match &measured.results.unavailable_reason {
        Some(_) => Vec::new(),
        None if is_reference => reference.uncertainty.clone(),
        None => reference.errors(measured, bench.rough),
    };
    let card = point.method_run.method.card();
    Some(TradeoffPoint {
        setting: point.setting(measured.ny),
        paper_name: card.paper_name.into(),
        criterion: measured.results.criterion.clone(),
        calibrated_on: measured.results.calibrated_on.clone(),
        is_reference,
        unavailable_reason: measured.results.unavailable_reason.clone(),
        missing: measured.results.missing.clone(),
        cost: cost(&measured.cost, reference),
        errors: errors::over_loads(&load_errors),
        loads: load_errors,
        resolved: point.block.and_then(|_| resolved_errors(bench, reference, point, measured)),
    })
}

/// Errors of a block against the solution on the heights that it resolves.
fn resolved_errors(
    bench: &BenchmarkRunner,
    reference: &ReferenceSolution,
    point: &BenchmarkPoint,
    measured: &MeasuredPoint,
) -> Option<ResolvedErrors> {
    let on = bench.on_resolved_heights(point, &reference.point);
    let other = &bench.known(&on)?.results.states;
    let numbers = errors::numbers(&[other]);
    let load_errors = errors::errors((&measured.results.states, &measured.resolved), other, &numbers, bench.rough);
    let (shortest_wavelength, gradient) = bench.resolved(point);
    Some(ResolvedErrors {
        shortest_wavelength,
        gradient,
        nx: on.n,
        errors: errors::over_loads(&load_errors),
        loads: load_errors,
    })
}

fn reference(solution: &ReferenceSolution) -> Reference {
    Reference {
        setting: solution.point.setting(solution.measured.ny),
        cost: cost(&solution.measured.cost, solution),
        coarser: solution.coarser.clone(),
        loads: solution.numbers.clone(),
        uncertainty: errors::over_loads(&solution.uncertainty),
    }
}

fn cost(cost: &MeasuredCost, reference: &ReferenceSolution) -> MeasuredCost {
    let of_reference = reference.measured.cost.cpu_seconds.max(f64::MIN_POSITIVE);
    MeasuredCost { cpu_over_reference: cost.cpu_seconds / of_reference, ..*cost }
}

/// Adhesion as named in tables. With a true range on every grid, coarse grids may not resolve it and the problem
/// differs from the default, so the text states it.
fn adhesion_label(case: &Case) -> String {
    let law = case.model.adhesion.described(&SiNotation(case.scales));
    match case.model.resolution {
        RangeChoice::True if case.model.adhesion != AttractionLaw::None => format!("{law}, true on every grid"),
        _ => law,
    }
}

/// Shortest wavelength of a surface, units of L; for a height map, two grid spacings.
fn shortest_wavelength(surface: &HeightSource) -> f64 {
    match surface {
        HeightSource::Synthesised { spectrum, .. } => spectrum.lambda_s,
        HeightSource::Fourier { modes, .. } => modes.shortest(),
        HeightSource::Imported { grid, .. } => 2.0 * grid.dx(),
    }
}

/// Hurst exponent of a surface that is synthesised from a spectrum.
fn hurst(surface: &HeightSource) -> Option<f64> {
    match surface {
        HeightSource::Synthesised { spectrum, .. } => Some(spectrum.hurst),
        _ => None,
    }
}
