//! Measurement of settings, each as a stage of the run folder, within a time budget.

use super::atoms::{self, Blocks};
use super::benchmark_point::{self, BenchmarkPoint, Filter};
use super::errors::{self, MapErrors, Roughness};
use super::{ExactSetting, ReferenceSolution, TradeoffRequest};
use crate::grid::Series;
use crate::method::{Heights, Precision, all_atom};
use crate::pipeline::folder::{Key, ResumePolicy, RunFolder};
use crate::pipeline::methods::{self, MethodRun};
use crate::pipeline::stage::StageContext;
use crate::pipeline::{Listener, run};
use crate::record::methods::MethodResults;
use crate::record::results::StageCost;
use crate::record::tradeoff::Cost;
use crate::report::number::{duration, memory};
use crate::scene::{Case, Surface};
use crate::{Error, Result, sys};
use serde::{Deserialize, Serialize};
use std::cell::OnceCell;
use std::path::Path;
use std::time::{Duration, Instant};

/// Results and cost of a setting.
#[derive(Clone, Serialize, Deserialize)]
pub struct Measured {
    pub ny: usize,
    pub results: MethodResults,
    /// Map errors at each load, relative to the reference.
    pub maps: Vec<MapErrors>,
    /// Map errors at each load of a block, relative to the solution on the heights that it resolves.
    #[serde(default)]
    pub resolved: Vec<MapErrors>,
    pub cost: Cost,
    /// Warnings about the setting.
    #[serde(default)]
    pub notes: Vec<String>,
}

/// Time limit of a setting over its fraction of the budget. Expected times are only orders of magnitude.
const PATIENCE: f64 = 2.0;

/// Settings that take less than this, s, are repeated: other load on the machine distorts short timings.
const SHORT_SECONDS: f64 = 1.0;

/// Smallest and largest number of runs of a short setting. Between them, runs end after [`SHORT_SECONDS`] in total.
const RUNS_OF_SHORT: [usize; 2] = [3, 30];

/// Whether `runs` runs with a total time of `seconds` suffice.
fn enough(repeats: Option<usize>, runs: usize, seconds: f64) -> bool {
    let [least, most] = RUNS_OF_SHORT;
    let is_short = runs > 0 && seconds / (runs as f64) < SHORT_SECONDS;
    match repeats {
        Some(n) => runs >= n.max(1),
        None if !is_short => runs >= 1,
        None => runs >= most || runs >= least && seconds >= SHORT_SECONDS,
    }
}

/// Total time of all runs of a setting, s, if one run takes `seconds`.
fn in_all(repeats: Option<usize>, seconds: f64) -> f64 {
    let runs = (1..).find(|&n| enough(repeats, n, n as f64 * seconds)).unwrap_or(1);
    runs as f64 * seconds
}

/// Forwards to a listener, and requests a stop at the deadline.
struct Until<'a> {
    listener: &'a dyn Listener,
    deadline: Option<Instant>,
}

impl Listener for Until<'_> {
    fn begin(&self, stage: &str, what: &str) {
        self.listener.begin(stage, what);
    }
    fn progress(&self, done: Option<f64>, message: &str) {
        self.listener.progress(done, message);
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
pub struct Climbed {
    pub done: Vec<(BenchmarkPoint, Measured)>,
    pub skipped: Vec<(BenchmarkPoint, String)>,
}

pub struct Bench<'a> {
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
    measured: Vec<(BenchmarkPoint, Measured)>,
    /// Wall time of one run of each measured setting, and (`stopped_seconds`) total time of stopped settings, s.
    seconds: Vec<(BenchmarkPoint, f64)>,
    stopped_seconds: f64,
}

impl<'a> Bench<'a> {
    pub fn open(
        case: &'a Case,
        asked: &TradeoffRequest,
        blocks: Option<Blocks>,
        out: &Path,
        listener: &'a dyn Listener,
    ) -> Result<Self> {
        Ok(Bench {
            case,
            listener,
            folder: RunFolder::open(out)?,
            repeats: asked.repeats,
            budget: asked.budget_seconds,
            common: (Key::of_program()?, run::heights_hash(case)?),
            blocks,
            rough: Roughness::of(case),
            series: OnceCell::new(),
            measured: Vec::new(),
            seconds: Vec::new(),
            stopped_seconds: 0.0,
        })
    }

    /// Wall time of all stages, s. Reused stages count with their recorded time.
    pub fn spent_seconds(&self) -> f64 {
        self.folder.costs.iter().map(|c| c.seconds).sum::<f64>() + self.stopped_seconds
    }

    /// Key of the stage of a reference solution.
    pub fn reference_key(&self, rung: &BenchmarkPoint) -> Result<Key> {
        self.key(rung, &self.at(rung)?, &[])
    }

    /// The case of a setting.
    fn at(&self, rung: &BenchmarkPoint) -> Result<Case> {
        match rung.block {
            Some(_) => Ok(self.block(rung).1.clone()),
            None => benchmark_point::at(self.case, rung),
        }
    }

    fn block(&self, rung: &BenchmarkPoint) -> (&Blocks, &Case) {
        let blocks = self.blocks.as_ref().expect("settings of atoms come from blocks");
        (blocks, blocks.case(rung).expect("of these blocks"))
    }

    /// The second reference of a block: the solution on the heights that it resolves.
    pub fn on_resolved_heights(&self, rung: &BenchmarkPoint, reference: &BenchmarkPoint) -> BenchmarkPoint {
        atoms::on_resolved_heights(reference, self.block(rung).1)
    }

    /// Shortest wavelength (units of L) and rms gradient of the heights that a block resolves.
    pub fn resolved(&self, rung: &BenchmarkPoint) -> (f64, f64) {
        let found = self.block(rung).1.atoms.as_ref();
        found.map_or((0.0, 0.0), |a| (a.low_pass, a.resolved_gradient))
    }

    /// The result of a setting that is already measured.
    pub fn known(&self, rung: &BenchmarkPoint) -> Option<&Measured> {
        let stage = rung.stage();
        self.measured.iter().find(|(r, _)| r.stage() == stage).map(|(_, known)| known)
    }

    fn key(&self, rung: &BenchmarkPoint, case: &Case, after: &[&Key]) -> Result<Key> {
        let s = &case.scene;
        let problem = (&s.laboratory, &s.surface, &s.load, &s.adhesion, &s.continuum, &s.methods, case.gradient);
        // The cost depends on the number of threads.
        let how = (
            rung.beside.adhesive,
            rung.id(),
            case.grid.nx,
            rung.layer_thickness,
            self.repeats,
            rayon::current_num_threads(),
        );
        match rung.block {
            None => Key::new(&rung.stage(), &(problem, how, rung.filter, &self.common), after),
            Some(_) => {
                let of_atoms = self.block(rung).0.depends_on(rung)?;
                Key::new(&rung.stage(), &(problem, how, of_atoms, &self.common), after)
            }
        }
    }

    /// Runs a setting, or reads its result if it is complete. Its maps are compared with those of `reference` and then
    /// deleted. `reference` is None for the reference itself, which keeps its maps.
    pub fn measure(
        &mut self,
        rung: &BenchmarkPoint,
        reference: Option<(&BenchmarkPoint, (&Measured, &Key))>,
        deadline: Option<Instant>,
    ) -> Result<Measured> {
        let stage = rung.stage();
        if let Some(known) = self.known(rung) {
            return Ok(known.clone());
        }
        // Solved before the atoms run: a block needs this solution as its second reference.
        let resolved = match (rung.block, &reference) {
            (Some(_), Some((truth, _))) => {
                let other = self.on_resolved_heights(rung, truth);
                let key = self.reference_key(&other)?;
                Some((self.measure(&other, None, deadline)?, key))
            }
            _ => None,
        };
        let case = self.at(rung)?;
        let after: Vec<&Key> = reference.iter().map(|r| r.1.1).chain(resolved.iter().map(|r| &r.1)).collect();
        let key = self.key(rung, &case, &after)?;
        let listener = Until { listener: self.listener, deadline };
        let (series, repeats, blocks, rough) = (&self.series, self.repeats, &self.blocks, self.rough);
        // An interrupted measurement restarts, because a cost summed over attempts is not comparable.
        let found = self.folder.stage(&listener, (&stage, &rung.words()), &key, ResumePolicy::Restart, |dir| {
            let root = dir.parent().unwrap_or(dir);
            let found = match blocks.as_ref().filter(|_| rung.block.is_some()) {
                Some(blocks) => {
                    let engine = blocks.engine.as_ref().expect("asked for before");
                    atoms::pressed(&case, engine, (dir, &stage), &key, &listener)?
                }
                None => measured(rung, &case, series, (dir, &stage), &key, repeats, &listener)?,
            };
            let Some((_, (reference, _))) = reference else { return Ok(found) };
            let kind = rung.beside.method.card().kind;
            let against = |other: &Measured| -> Result<Vec<MapErrors>> {
                let pairs = found.results.states.iter().zip(&other.results.states);
                pairs.map(|(a, b)| errors::maps(root, (kind, rung.block.is_some()), a, b, rough)).collect()
            };
            let maps = against(reference)?;
            let resolved = resolved.as_ref().map_or(Ok(Vec::new()), |(other, _)| against(other))?;
            let states = &found.results.states;
            for map in states.iter().flat_map(|s| [&s.numbers.gap_map, &s.numbers.stress_map, &s.contact_map]).flatten()
            {
                let path = root.join(map);
                std::fs::remove_file(&path).map_err(Error::io("remove", &path))?;
            }
            if rung.block.is_some() {
                let atoms = dir.join(atoms::READ);
                std::fs::remove_dir_all(&atoms).map_err(Error::io("remove", &atoms))?;
            }
            Ok(Measured { maps, resolved, ..found })
        })?;
        self.seconds.push((*rung, found.cost.wall_seconds));
        self.measured.push((*rung, found.clone()));
        Ok(found)
    }

    /// Runs a setting if it is expected to end within the fraction `share` of the remaining budget. Otherwise returns
    /// the reason.
    fn attempt(
        &mut self,
        rung: BenchmarkPoint,
        truth: &ReferenceSolution,
        share: f64,
        outcome: &mut Climbed,
    ) -> Result<Option<String>> {
        let case = self.at(&rung)?;
        let key = self.reference_key(&truth.rung)?;
        let mut after = vec![key.clone()];
        let mut planned = None;
        if rung.block.is_some() {
            if let Err(why) = &self.block(&rung).0.engine {
                return Ok(Some(why.clone()));
            }
            after.push(self.reference_key(&self.on_resolved_heights(&rung, &truth.rung))?);
            planned = Some(atoms::planned(&case)?);
        }
        let known = self.known(&rung).is_some()
            || self.folder.holds(&rung.stage(), &self.key(&rung, &case, &after.iter().collect::<Vec<_>>())?);
        let mut deadline = None;
        if !known {
            let need = planned.map_or_else(|| rung.planned_bytes(&case), |p| p.0);
            let have = sys::available_memory_bytes();
            if need > have {
                return Ok(Some(format!("needs {} of memory, of which {} are available", memory(need), memory(have))));
            }
            if let Some(budget) = self.budget {
                let left = budget - self.spent_seconds();
                if left <= 0.0 {
                    return Ok(Some(format!("the budget of {} was spent before", duration(budget))));
                }
                let expected = match planned {
                    Some((_, seconds)) => seconds,
                    None => in_all(self.repeats, rung.expected_seconds(&self.seconds, &case)),
                };
                if expected > left * share.min(1.0) {
                    let (expected, left) = (duration(expected), duration(left * share.min(1.0)));
                    return Ok(Some(format!("expected to take {expected}, {left} of the budget are left for it")));
                }
                deadline = Some(Instant::now() + Duration::from_secs_f64(left * (PATIENCE * share).min(1.0)));
            }
        }
        let clock = Instant::now();
        match self.measure(&rung, Some((&truth.rung, (&truth.measured, &key))), deadline) {
            Ok(found) => {
                outcome.done.push((rung, found));
                Ok(None)
            }
            Err(Error::Interrupted) if !self.listener.stopping() => {
                let seconds = clock.elapsed().as_secs_f64();
                self.stopped_seconds += seconds;
                Ok(Some(format!("stopped after {}, its part of the budget", duration(seconds))))
            }
            Err(e @ (Error::Lammps { .. } | Error::NotConverged { .. } | Error::Format { .. }))
                if rung.block.is_some() =>
            {
                Ok(Some(e.to_string().replace('\n', " ")))
            }
            Err(e) => Err(e),
        }
    }

    /// Measures the settings of a list, in its order.
    pub fn measure_all(
        &mut self,
        besides: &[MethodRun],
        list: &[ExactSetting],
        references: &[ReferenceSolution],
    ) -> Result<Climbed> {
        let mut outcome = Climbed::default();
        for e in list {
            for &beside in besides.iter().filter(|b| b.method.card().id == e.method) {
                let rung = BenchmarkPoint::on_grid(beside, e.n, e.precision, e.tolerance);
                let Some(truth) = references.iter().find(|t| t.rung.beside.adhesive == beside.adhesive) else {
                    continue;
                };
                let why = self.attempt(rung, truth, 1.0, &mut outcome)?;
                outcome.skipped.extend(why.map(|w| (rung, w)));
            }
        }
        Ok(outcome)
    }

    /// Measures every method once, on the first of `grids` or the next coarser one that memory and budget permit; then
    /// blocks of atoms; then the other grids; then other precisions, tolerances and layers. With a budget, the settings
    /// of a group run in the order of expected cost; blocks run in the order of size.
    pub fn measure_grids(
        &mut self,
        besides: &[MethodRun],
        grids: &[usize],
        slabs: &[f64],
        references: &[ReferenceSolution],
    ) -> Result<Climbed> {
        let tolerance = benchmark_point::base_tolerance(self.case);
        let rung = |&beside: &MethodRun, n: usize| BenchmarkPoint::on_grid(beside, n, Precision::F64, tolerance);
        let truth = |rung: &BenchmarkPoint| references.iter().find(|t| t.rung.beside.adhesive == rung.beside.adhesive);
        let mut outcome = Climbed::default();
        // Settings that failed. Those that were stopped are not run again.
        let mut refused: Vec<(BenchmarkPoint, String)> = Vec::new();
        let mut first: Vec<BenchmarkPoint> = Vec::new();
        let (&main, rest) = grids.split_first().expect("at least one grid");
        // Blocks of atoms run separately, not on grids.
        let on_grids = |b: &&MethodRun| self.blocks.is_none() || b.method.card().id != all_atom::ID;
        let besides: Vec<MethodRun> = besides.iter().filter(on_grids).copied().collect();
        let mut pending: Vec<BenchmarkPoint> = besides.iter().map(|b| rung(b, main)).collect();
        self.cheap_first(&mut pending)?;
        for (i, start) in pending.iter().enumerate() {
            let share = 1.0 / (pending.len() - i) as f64;
            let coarser = rest.iter().filter(|n| **n < main);
            for r in std::iter::once(*start).chain(coarser.map(|&n| BenchmarkPoint { n, ..*start })) {
                let Some(truth) = truth(&r) else { continue };
                match self.attempt(r, truth, share, &mut outcome)? {
                    None => {
                        first.push(r);
                        break;
                    }
                    Some(why) => refused.push((r, why)),
                }
            }
        }
        for r in self.blocks.as_ref().map_or(Vec::new(), Blocks::points) {
            let Some(truth) = truth(&r) else { continue };
            let why = self.attempt(r, truth, 1.0, &mut outcome)?;
            outcome.skipped.extend(why.map(|w| (r, w)));
        }
        let mut others: Vec<BenchmarkPoint> =
            besides.iter().flat_map(|b| grids.iter().map(move |&n| rung(b, n))).filter(|r| is_new(r, &first)).collect();
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
            let layer = |&thickness: &f64| BenchmarkPoint { n: main, layer_thickness: Some(thickness), ..t.rung };
            refined.extend(slabs.iter().map(layer));
        }
        self.cheap_first(&mut refined)?;
        for r in others.into_iter().chain(refined) {
            let Some(truth) = truth(&r) else { continue };
            let stopped = |(k, why): &&(BenchmarkPoint, String)| k.stage() == r.stage() && why.starts_with("stopped");
            let why = match refused.iter().find(stopped) {
                Some((_, why)) => Some(why.clone()),
                None => self.attempt(r, truth, 1.0, &mut outcome)?,
            };
            outcome.skipped.extend(why.map(|w| (r, w)));
        }
        Ok(outcome)
    }

    /// Sorts settings by expected cost if there is a budget: cheap settings leave most of it to the others.
    fn cheap_first(&self, rungs: &mut [BenchmarkPoint]) -> Result<()> {
        if self.budget.is_some() {
            let mut expected = Vec::new();
            for r in rungs.iter() {
                expected.push((r.expected_seconds(&self.seconds, &benchmark_point::at(self.case, r)?), *r));
            }
            expected.sort_by(|a, b| a.0.total_cmp(&b.0));
            rungs.iter_mut().zip(expected).for_each(|(r, (_, e))| *r = e);
        }
        Ok(())
    }
}

fn is_new(rung: &BenchmarkPoint, done: &[BenchmarkPoint]) -> bool {
    !done.iter().any(|d| d.stage() == rung.stage())
}

/// Runs a setting as often as requested. Results are those of the first run. Times are the minimum over all runs, and
/// memory is the maximum.
fn measured(
    rung: &BenchmarkPoint,
    case: &Case,
    series: &OnceCell<Series<f64>>,
    (dir, stage): (&Path, &str),
    key: &Key,
    repeats: Option<usize>,
    listener: &dyn Listener,
) -> Result<Measured> {
    let made: Vec<f64>;
    let heights = match &case.surface {
        surface if rung.filter.is_some() => {
            let Filter { low_pass, stretch } = rung.filter.expect("just seen");
            made = surface.heights(case.grid, low_pass).into_iter().map(|h| h * stretch).collect();
            Heights::Nodes(&made)
        }
        Surface::Synthesised { modes, .. } => Heights::Series(series.get_or_init(|| modes.series())),
        Surface::Fourier { modes, .. } => Heights::Series(modes.series()),
        Surface::Imported { .. } => {
            made = case.surface.heights(case.grid, 0.0);
            Heights::Nodes(&made)
        }
    };
    let mut best: Option<Measured> = None;
    let (mut runs, mut seconds) = (0, 0.0);
    while !enough(repeats, runs, seconds) {
        let growth = sys::MemoryGrowth::begin();
        let (clock, cpu) = (Instant::now(), sys::cpu_seconds());
        let results = methods::run(case, rung.beside, heights, &StageContext { folder: dir, stage, key, listener })?;
        let cost = Cost {
            wall_seconds: clock.elapsed().as_secs_f64(),
            cpu_seconds: sys::cpu_seconds() - cpu,
            cpu_over_reference: 1.0,
            fft_pairs: results.states.iter().map(|s| s.numbers.fft_pairs).sum(),
            iterations: results.states.iter().map(|s| s.numbers.iterations).sum(),
            planned_bytes: results.planned_bytes,
            measured_bytes: growth.bytes(),
            resident_before_bytes: growth.before_bytes(),
            runs: 1,
            atoms: None,
        };
        // With other load on the machine, the wall time exceeds the CPU time; the smaller of the two counts.
        (runs, seconds) = (runs + 1, seconds + cost.wall_seconds.min(cost.cpu_seconds));
        let refused = results.unavailable_reason.is_some();
        match &mut best {
            None => {
                best = Some(Measured {
                    ny: case.grid.ny,
                    results,
                    maps: Vec::new(),
                    resolved: Vec::new(),
                    cost,
                    notes: Vec::new(),
                });
            }
            Some(b) => {
                b.cost.wall_seconds = b.cost.wall_seconds.min(cost.wall_seconds);
                b.cost.cpu_seconds = b.cost.cpu_seconds.min(cost.cpu_seconds);
                b.cost.measured_bytes = b.cost.measured_bytes.max(cost.measured_bytes);
                b.cost.runs = runs;
            }
        }
        if refused {
            break;
        }
    }
    Ok(best.expect("at least one run"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_settings_run_more_often() {
        let runs = |seconds: f64| (1..).find(|&n| enough(None, n, n as f64 * seconds));
        assert_eq!([0.001, 0.2, 0.3, 0.9, 1.1, 60.0].map(runs), [30, 5, 4, 3, 1, 1].map(Some));
        assert!(enough(Some(2), 2, 0.1) && !enough(Some(2), 1, 100.0));
        assert!(
            (in_all(None, 0.2) - 1.0).abs() < 1e-12 && in_all(Some(4), 60.0) == 240.0 && in_all(None, 60.0) == 60.0
        );
    }
}
