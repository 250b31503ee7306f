//! Measurement of settings, each as a stage of the run folder, within a time budget.

use super::atoms::{self, Blocks};
use super::benchmark_point::{self, BenchmarkPoint};
use super::errors::{self, MapErrors, Roughness};
use super::measured::{MeasuredPoint, ReferenceSolution, measure_repeatedly, total_seconds};
use super::request::{ExactSetting, TradeoffRequest};
use crate::pipeline::folder::{OutFolder, ResumePolicy, RunFolder, StageKey};
use crate::pipeline::methods::MethodRun;
use crate::pipeline::stage::StageContext;
use crate::pipeline::{Listener, run};
use crate::record::results::StageCost;
use crate::report::number::{duration, memory};
use crate::scene::Case;
use crate::{Error, Result};
use asperity_contact::method::Precision;
use asperity_grid::Series;
use asperity_grid::sys;
use asperity_surface::files::atomic_file::{remove, remove_folder};
use std::cell::OnceCell;
use std::time::{Duration, Instant};

/// Time limit of a setting over its fraction of the budget. Expected times are only orders of magnitude.
const PATIENCE: f64 = 2.0;

/// Forwards to a listener, and requests a stop at the deadline.
struct Until<'a> {
    listener: &'a dyn Listener,
    deadline: Option<Instant>,
}

impl Listener for Until<'_> {
    fn begin(&self, stage: &str, description: &str) {
        self.listener.begin(stage, description);
    }
    fn progress(&self, fraction: Option<f64>, message: &str) {
        self.listener.progress(fraction, message);
    }
    fn end(&self, cost: &StageCost) {
        self.listener.end(cost);
    }
    fn warn(&self, text: &str) {
        self.listener.warn(text);
    }
    fn stopping(&self) -> bool {
        self.listener.stopping() || self.deadline.is_some_and(|d| Instant::now() >= d)
    }
}

/// Measured and skipped settings of a benchmark.
#[derive(Default)]
pub(super) struct BenchmarkResults {
    pub done: Vec<(BenchmarkPoint, MeasuredPoint)>,
    pub skipped: Vec<(BenchmarkPoint, String)>,
}

pub(super) struct BenchmarkRunner<'a> {
    case: &'a Case,
    listener: &'a dyn Listener,
    folder: RunFolder,
    repeats: Option<usize>,
    budget: Option<f64>,
    /// Dependencies of every stage: hashes of the program and of the height file.
    common: (String, Option<String>),
    /// Blocks of atoms, if any are requested.
    blocks: Option<Blocks>,
    /// Scales of relative errors.
    pub rough: Roughness,
    /// Fourier series of a synthesised surface, the same on every grid.
    series: OnceCell<Series<f64>>,
    measured: Vec<(BenchmarkPoint, MeasuredPoint)>,
    /// Wall time of one run of each measured setting, and (`stopped_seconds`) total time of stopped settings, s.
    seconds: Vec<(BenchmarkPoint, f64)>,
    stopped_seconds: f64,
}

impl<'a> BenchmarkRunner<'a> {
    pub(super) fn open(
        case: &'a Case,
        request: &TradeoffRequest,
        blocks: Option<Blocks>,
        out: OutFolder,
        listener: &'a dyn Listener,
    ) -> Result<Self> {
        Ok(BenchmarkRunner {
            case,
            listener,
            folder: RunFolder::open(out)?,
            repeats: request.repeats,
            budget: request.budget_seconds,
            common: (StageKey::of_program()?, run::heights_hash(case)?),
            blocks,
            rough: Roughness::of(case),
            series: OnceCell::new(),
            measured: Vec::new(),
            seconds: Vec::new(),
            stopped_seconds: 0.0,
        })
    }

    /// Wall time of all stages, s. Reused stages count with their recorded time.
    pub(super) fn spent_seconds(&self) -> f64 {
        self.folder.costs.iter().map(|c| c.seconds).sum::<f64>() + self.stopped_seconds
    }

    /// Key of the stage of a reference solution.
    pub(super) fn reference_key(&self, point: &BenchmarkPoint) -> Result<StageKey> {
        self.key(point, &self.at(point)?, &[])
    }

    /// The case of a setting.
    fn at(&self, point: &BenchmarkPoint) -> Result<Case> {
        match point.block {
            Some(_) => Ok(self.block(point).1.clone()),
            None => benchmark_point::at(self.case, point),
        }
    }

    fn block(&self, point: &BenchmarkPoint) -> (&Blocks, &Case) {
        let blocks = self.blocks.as_ref().expect("settings of atoms come from blocks");
        (blocks, blocks.case(point).expect("of these blocks"))
    }

    /// The second reference of a block: the solution on the heights that it resolves.
    pub(super) fn on_resolved_heights(&self, point: &BenchmarkPoint, reference: &BenchmarkPoint) -> BenchmarkPoint {
        atoms::on_resolved_heights(reference, self.block(point).1)
    }

    /// Shortest wavelength (units of L) and rms gradient of the heights that a block resolves.
    pub(super) fn resolved(&self, point: &BenchmarkPoint) -> (f64, f64) {
        let atoms = self.block(point).1.atoms.as_ref();
        atoms.map_or((0.0, 0.0), |a| (a.low_pass, a.resolved_gradient))
    }

    /// The result of a setting that is already measured.
    pub(super) fn known(&self, point: &BenchmarkPoint) -> Option<&MeasuredPoint> {
        let stage = point.stage();
        self.measured.iter().find(|(r, _)| r.stage() == stage).map(|(_, known)| known)
    }

    fn key(&self, point: &BenchmarkPoint, case: &Case, dependencies: &[&StageKey]) -> Result<StageKey> {
        let s = &case.scene;
        let problem = (&s.laboratory, &s.surface, &s.load, &s.adhesion, &s.continuum, &s.methods, case.gradient);
        // The cost depends on the number of threads.
        let how = (
            point.method_run.adhesive,
            point.id(),
            case.model.grid.nx,
            point.layer_thickness,
            self.repeats,
            rayon::current_num_threads(),
        );
        match point.block {
            None => StageKey::new(&point.stage(), &(problem, how, point.filter, &self.common), dependencies),
            Some(_) => {
                let of_atoms = self.block(point).0.depends_on(point)?;
                StageKey::new(&point.stage(), &(problem, how, of_atoms, &self.common), dependencies)
            }
        }
    }

    /// Runs a setting, or reads its result if it is complete. Its maps are compared with those of `reference` and then
    /// deleted. `reference` is None for the reference itself, which keeps its maps.
    pub(super) fn measure(
        &mut self,
        point: &BenchmarkPoint,
        reference: Option<(&BenchmarkPoint, (&MeasuredPoint, &StageKey))>,
        deadline: Option<Instant>,
    ) -> Result<MeasuredPoint> {
        let stage = point.stage();
        if let Some(known) = self.known(point) {
            return Ok(known.clone());
        }
        // Solved before the atoms run: a block needs this solution as its second reference.
        let resolved = match (point.block, &reference) {
            (Some(_), Some((reference, _))) => {
                let other = self.on_resolved_heights(point, reference);
                let key = self.reference_key(&other)?;
                Some((self.measure(&other, None, deadline)?, key))
            }
            _ => None,
        };
        let case = self.at(point)?;
        let dependencies: Vec<&StageKey> =
            reference.iter().map(|r| r.1.1).chain(resolved.iter().map(|r| &r.1)).collect();
        let key = self.key(point, &case, &dependencies)?;
        let listener = Until { listener: self.listener, deadline };
        let (series, repeats, blocks, rough) = (&self.series, self.repeats, &self.blocks, self.rough);
        // An interrupted measurement restarts, because a cost summed over attempts is not comparable.
        let measured = self.folder.stage(&listener, (&stage, &point.label()), &key, ResumePolicy::Restart, |dir| {
            let root = dir.parent().unwrap_or(dir);
            let context = StageContext { folder: dir, stage: &stage, key: &key, listener: &listener };
            let measured = match blocks.as_ref().filter(|_| point.block.is_some()) {
                Some(blocks) => {
                    let engine = blocks.engine.as_ref().expect("request for before");
                    atoms::run_block(&case, engine, &context)?
                }
                None => measure_repeatedly(point, &case, series, repeats, &context)?,
            };
            let Some((_, (reference, _))) = reference else { return Ok(measured) };
            let kind = point.method_run.method.card().kind;
            let against = |other: &MeasuredPoint| -> Result<Vec<MapErrors>> {
                let pairs = measured.results.states.iter().zip(&other.results.states);
                pairs.map(|(a, b)| errors::maps(root, (kind, point.block.is_some()), a, b, rough)).collect()
            };
            let maps = against(reference)?;
            let resolved = resolved.as_ref().map_or(Ok(Vec::new()), |(other, _)| against(other))?;
            let states = &measured.results.states;
            for map in states.iter().flat_map(|s| [s.gap_file(), s.stress_file(), s.contact_file()]).flatten() {
                remove(&root.join(map))?;
            }
            if point.block.is_some() {
                remove_folder(&dir.join(atoms::ANALYSIS))?;
            }
            Ok(MeasuredPoint { maps, resolved, ..measured })
        })?;
        self.seconds.push((*point, measured.cost.wall_seconds));
        self.measured.push((*point, measured.clone()));
        Ok(measured)
    }

    /// Runs a setting if it is expected to end within the fraction `share` of the remaining budget. Otherwise returns
    /// the reason.
    fn attempt(
        &mut self,
        point: BenchmarkPoint,
        reference: &ReferenceSolution,
        share: f64,
        outcome: &mut BenchmarkResults,
    ) -> Result<Option<String>> {
        let case = self.at(&point)?;
        let key = self.reference_key(&reference.point)?;
        let mut dependencies = vec![key.clone()];
        let mut planned = None;
        if point.block.is_some() {
            let blocks = self.block(&point).0;
            if let Some(reason) = blocks.refusal(&point) {
                return Ok(Some(reason));
            }
            planned = blocks.engine.as_ref().ok().map(|e| atoms::planned(&case, e)).transpose()?;
            dependencies.push(self.reference_key(&self.on_resolved_heights(&point, &reference.point))?);
        }
        let is_known = self.known(&point).is_some()
            || self
                .folder
                .is_complete(&point.stage(), &self.key(&point, &case, &dependencies.iter().collect::<Vec<_>>())?);
        let mut deadline = None;
        if !is_known {
            let required = planned.map_or_else(|| point.planned_bytes(&case), |p| p.0);
            let available = sys::available_memory_bytes();
            if required > available {
                let (required, available) = (memory(required), memory(available));
                return Ok(Some(format!("needs {required} of memory, of which {available} are available")));
            }
            if let Some(budget) = self.budget {
                let left = budget - self.spent_seconds();
                if left <= 0.0 {
                    return Ok(Some(format!("the budget of {} was spent before", duration(budget))));
                }
                let expected = match planned {
                    Some((_, seconds)) => seconds,
                    None => total_seconds(self.repeats, point.expected_seconds(&self.seconds, &case)),
                };
                if expected > left * share.min(1.0) {
                    let (expected, left) = (duration(expected), duration(left * share.min(1.0)));
                    return Ok(Some(format!("expected to take {expected}, {left} of the budget are left for it")));
                }
                deadline = Some(Instant::now() + Duration::from_secs_f64(left * (PATIENCE * share).min(1.0)));
            }
        }
        let clock = Instant::now();
        match self.measure(&point, Some((&reference.point, (&reference.measured, &key))), deadline) {
            Ok(measured) => {
                outcome.done.push((point, measured));
                Ok(None)
            }
            Err(Error::Interrupted) if !self.listener.stopping() => {
                let seconds = clock.elapsed().as_secs_f64();
                self.stopped_seconds += seconds;
                Ok(Some(format!("stopped after {}, its part of the budget", duration(seconds))))
            }
            Err(e @ (Error::Lammps { .. } | Error::NotConverged { .. } | Error::Format { .. }))
                if point.block.is_some() =>
            {
                Ok(Some(e.to_string().replace('\n', " ")))
            }
            Err(e) => Err(e),
        }
    }

    /// Measures the settings of a list, in its order.
    pub(super) fn measure_all(
        &mut self,
        method_runs: &[MethodRun],
        list: &[ExactSetting],
        references: &[ReferenceSolution],
    ) -> Result<BenchmarkResults> {
        let mut outcome = BenchmarkResults::default();
        for e in list {
            for &method_run in method_runs.iter().filter(|b| b.method.card().id == e.method) {
                let point = BenchmarkPoint::on_grid(method_run, e.n, e.precision, e.tolerance);
                let Some(reference) = ReferenceSolution::of(references, &point) else { continue };
                let reason = self.attempt(point, reference, 1.0, &mut outcome)?;
                outcome.skipped.extend(reason.map(|w| (point, w)));
            }
        }
        Ok(outcome)
    }

    /// Measures every method once, on the first of `grids` or the next coarser one that memory and budget permit; then
    /// blocks of atoms; then the other grids; then other precisions, tolerances and layers. With a budget, the settings
    /// of a group run in the order of expected cost; blocks run in the order of size.
    pub(super) fn measure_grids(
        &mut self,
        method_runs: &[MethodRun],
        grids: &[usize],
        layer_thicknesses: &[f64],
        references: &[ReferenceSolution],
    ) -> Result<BenchmarkResults> {
        let tolerance = benchmark_point::base_tolerance(self.case);
        let point =
            |&method_run: &MethodRun, n: usize| BenchmarkPoint::on_grid(method_run, n, Precision::F64, tolerance);
        let mut outcome = BenchmarkResults::default();
        // Settings that failed. Those that were stopped are not run again.
        let mut refused: Vec<(BenchmarkPoint, String)> = Vec::new();
        let mut first: Vec<BenchmarkPoint> = Vec::new();
        let (&main, remainder) = grids.split_first().expect("at least one grid");
        // Blocks of atoms run separately, not on grids.
        let on_grids = |b: &&MethodRun| self.blocks.is_none() || !b.method.card().capabilities.atoms;
        let method_runs: Vec<MethodRun> = method_runs.iter().filter(on_grids).copied().collect();
        let mut pending: Vec<BenchmarkPoint> = method_runs.iter().map(|b| point(b, main)).collect();
        self.cheap_first(&mut pending)?;
        for (i, start) in pending.iter().enumerate() {
            let fraction = 1.0 / (pending.len() - i) as f64;
            let coarser = remainder.iter().filter(|n| **n < main);
            for r in std::iter::once(*start).chain(coarser.map(|&n| BenchmarkPoint { n, ..*start })) {
                let Some(reference) = ReferenceSolution::of(references, &r) else { continue };
                match self.attempt(r, reference, fraction, &mut outcome)? {
                    None => {
                        first.push(r);
                        break;
                    }
                    Some(reason) => refused.push((r, reason)),
                }
            }
        }
        for r in self.blocks.as_ref().map_or(Vec::new(), Blocks::points) {
            let Some(reference) = ReferenceSolution::of(references, &r) else { continue };
            let reason = self.attempt(r, reference, 1.0, &mut outcome)?;
            outcome.skipped.extend(reason.map(|w| (r, w)));
        }
        let mut others: Vec<BenchmarkPoint> = method_runs
            .iter()
            .flat_map(|b| grids.iter().map(move |&n| point(b, n)))
            .filter(|r| is_new(r, &first))
            .collect();
        self.cheap_first(&mut others)?;
        let mut refined = Vec::new();
        for start in &pending {
            match first.iter().find(|r| r.is_of(start)) {
                Some(r) => refined.extend(benchmark_point::refinements(r, &benchmark_point::at(self.case, r)?)),
                None => {
                    let none = "its method was left out on the grids before";
                    let skipped = benchmark_point::refinements(start, &benchmark_point::at(self.case, start)?);
                    outcome.skipped.extend(skipped.into_iter().map(|r| (r, none.to_string())));
                }
            }
        }
        for t in references {
            let layer = |&thickness: &f64| BenchmarkPoint { n: main, layer_thickness: Some(thickness), ..t.point };
            refined.extend(layer_thicknesses.iter().map(layer));
        }
        self.cheap_first(&mut refined)?;
        for r in others.into_iter().chain(refined) {
            let Some(reference) = ReferenceSolution::of(references, &r) else { continue };
            let stopped =
                |(k, reason): &&(BenchmarkPoint, String)| k.stage() == r.stage() && reason.starts_with("stopped");
            let reason = match refused.iter().find(stopped) {
                Some((_, reason)) => Some(reason.clone()),
                None => self.attempt(r, reference, 1.0, &mut outcome)?,
            };
            outcome.skipped.extend(reason.map(|w| (r, w)));
        }
        Ok(outcome)
    }

    /// Sorts settings by expected cost if there is a budget: cheap settings leave most of it to the others.
    fn cheap_first(&self, points: &mut [BenchmarkPoint]) -> Result<()> {
        if self.budget.is_some() {
            let mut expected = Vec::new();
            for r in points.iter() {
                expected.push((r.expected_seconds(&self.seconds, &benchmark_point::at(self.case, r)?), *r));
            }
            expected.sort_by(|a, b| a.0.total_cmp(&b.0));
            points.iter_mut().zip(expected).for_each(|(r, (_, e))| *r = e);
        }
        Ok(())
    }
}

fn is_new(point: &BenchmarkPoint, done: &[BenchmarkPoint]) -> bool {
    !done.iter().any(|d| d.stage() == point.stage())
}
