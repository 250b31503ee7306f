//! Measurement of settings, each as a stage of the run folder, within a time budget.

use super::atoms::{self, Blocks};
use super::benchmark_point::{self, BenchmarkPoint};
use super::errors::{self, MapErrors, Roughness};
use super::measured::{MeasuredPoint, ReferenceSolution, measure_repeatedly};
use super::request::TradeoffRequest;
use crate::pipeline::folder::{OutFolder, RunFolder, StageKey};
use crate::pipeline::stage::StageContext;
use crate::pipeline::{Listener, run};
use crate::report::number::{duration, memory};
use crate::scene::Case;
use crate::{Error, Result};
use asperity_grid::Series;
use asperity_grid::sys;
use asperity_surface::files::atomic_file::{remove, remove_folder};
use std::cell::OnceCell;
use std::time::Instant;

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
    /// Wall time of settings that failed, s.
    failed_seconds: f64,
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
            failed_seconds: 0.0,
        })
    }

    /// Wall time of all stages, s. Reused stages count with their recorded time.
    pub(super) fn spent_seconds(&self) -> f64 {
        self.folder.costs.iter().map(|c| c.seconds).sum::<f64>() + self.failed_seconds
    }

    /// Key of the stage of a reference solution.
    pub(super) fn reference_key(&self, point: &BenchmarkPoint) -> Result<StageKey> {
        self.key(point, &self.case_at(point)?, &[])
    }

    /// The case of a setting.
    fn case_at(&self, point: &BenchmarkPoint) -> Result<Case> {
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
        let how =
            (point.method_run.adhesive, point.id(), case.model.grid.nx, self.repeats, rayon::current_num_threads());
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
                Some((self.measure(&other, None)?, key))
            }
            _ => None,
        };
        let case = self.case_at(point)?;
        let dependencies: Vec<&StageKey> =
            reference.iter().map(|r| r.1.1).chain(resolved.iter().map(|r| &r.1)).collect();
        let key = self.key(point, &case, &dependencies)?;
        let listener = self.listener;
        let (series, repeats, blocks, rough) = (&self.series, self.repeats, &self.blocks, self.rough);
        // An interrupted measurement restarts, because a cost summed over attempts is not comparable.
        let measured = self.folder.stage(listener, (&stage, &point.label()), &key, None, |dir| {
            let root = dir.parent().unwrap_or(dir);
            let context = StageContext { folder: dir, stage: &stage, key: &key, listener };
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
        self.measured.push((*point, measured.clone()));
        Ok(measured)
    }

    /// Measures settings in their order. Those that cannot run here, or are beyond the budget, are skipped with the reason.
    pub(super) fn measure_all(
        &mut self,
        points: &[BenchmarkPoint],
        references: &[ReferenceSolution],
    ) -> Result<BenchmarkResults> {
        let mut outcome = BenchmarkResults::default();
        for &point in points {
            let Some(reference) = ReferenceSolution::of(references, &point) else { continue };
            match self.attempt(&point, reference)? {
                Ok(measured) => outcome.done.push((point, measured)),
                Err(reason) => outcome.skipped.push((point, reason)),
            }
        }
        Ok(outcome)
    }

    /// Runs a setting, or returns why it is left out.
    fn attempt(
        &mut self,
        point: &BenchmarkPoint,
        reference: &ReferenceSolution,
    ) -> Result<std::result::Result<MeasuredPoint, String>> {
        let case = self.case_at(point)?;
        let key = self.reference_key(&reference.point)?;
        let mut dependencies = vec![key.clone()];
        let mut bytes = None;
        if point.block.is_some() {
            let blocks = self.block(point).0;
            if let Some(reason) = blocks.refusal(point) {
                return Ok(Err(reason));
            }
            bytes = blocks.engine.as_ref().ok().map(|e| atoms::planned(&case, e)).transpose()?.map(|p| p.0);
            dependencies.push(self.reference_key(&self.on_resolved_heights(point, &reference.point))?);
        }
        let key_of_point = self.key(point, &case, &dependencies.iter().collect::<Vec<_>>())?;
        if self.known(point).is_none() && !self.folder.is_complete(&point.stage(), &key_of_point) {
            let required = bytes.unwrap_or_else(|| point.planned_bytes(&case));
            let available = sys::available_memory_bytes();
            if required > available {
                let (required, available) = (memory(required), memory(available));
                return Ok(Err(format!("needs {required} of memory, of which {available} are available")));
            }
            if let Some(budget) = self.budget.filter(|b| self.spent_seconds() >= *b) {
                return Ok(Err(format!("the budget of {} was spent before", duration(budget))));
            }
        }
        let clock = Instant::now();
        match self.measure(point, Some((&reference.point, (&reference.measured, &key)))) {
            Err(e @ (Error::Lammps { .. } | Error::NotConverged { .. } | Error::Format { .. }))
                if point.block.is_some() =>
            {
                self.failed_seconds += clock.elapsed().as_secs_f64();
                Ok(Err(e.to_string().replace('\n', " ")))
            }
            other => other.map(Ok),
        }
    }
}
