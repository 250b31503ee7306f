//! Settings measured one by one, each a stage of the run folder, and the way through all of them within a budget.

use super::judge::{self, MapErrors};
use super::ladder::{self, Rung};
use super::{AskedOfLadder, Exact, Truth};
use crate::grid::Series;
use crate::method::{Heights, Precision};
use crate::pipeline::folder::{Key, Leftovers, RunFolder};
use crate::pipeline::methods::{self, Beside};
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

/// What a setting told and took.
#[derive(Clone, Serialize, Deserialize)]
pub struct Measured {
    pub ny: usize,
    pub results: MethodResults,
    /// Of each load.
    pub maps: Vec<MapErrors>,
    pub cost: Cost,
}

/// By how much a setting may outlast its share of the budget before it is stopped: what is expected of it is an order of
/// magnitude.
const PATIENCE: f64 = 2.0;

/// Passes on, and asks to stop once the time is up.
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

/// All settings of a ladder, as far as it went.
#[derive(Default)]
pub struct Climbed {
    pub done: Vec<(Rung, Measured)>,
    pub left_out: Vec<(Rung, String)>,
}

pub struct Bench<'a> {
    case: &'a Case,
    listener: &'a dyn Listener,
    folder: RunFolder,
    repeats: usize,
    budget: Option<f64>,
    /// What every stage depends on.
    common: (String, Option<String>),
    /// Waves of a synthesised surface, which are the same on every grid.
    series: OnceCell<Series<f64>>,
    measured: Vec<(Rung, Measured)>,
    /// Wall time of each that was measured, and of those that were stopped, s.
    seconds: Vec<(Rung, f64)>,
    stopped_seconds: f64,
}

impl<'a> Bench<'a> {
    pub fn open(case: &'a Case, asked: &AskedOfLadder, out: &Path, listener: &'a dyn Listener) -> Result<Self> {
        Ok(Bench {
            case,
            listener,
            folder: RunFolder::open(out)?,
            repeats: asked.repeats.max(1),
            budget: asked.budget_seconds,
            common: (Key::of_program()?, run::heights_hash(case)?),
            series: OnceCell::new(),
            measured: Vec::new(),
            seconds: Vec::new(),
            stopped_seconds: 0.0,
        })
    }

    /// All stages, those that were found done with what they took then.
    pub fn spent_seconds(&self) -> f64 {
        self.folder.costs.iter().map(|c| c.seconds).sum::<f64>() + self.stopped_seconds
    }

    /// Of the stage that all others are judged against.
    pub fn reference_key(&self, rung: &Rung) -> Result<Key> {
        self.key(rung, &ladder::at(self.case, rung)?, None)
    }

    fn key(&self, rung: &Rung, case: &Case, reference: Option<&Key>) -> Result<Key> {
        let s = &case.scene;
        let problem = (&s.laboratory, &s.surface, &s.load, &s.adhesion, &s.continuum, &s.methods, case.gradient);
        // A cost is that of a number of threads.
        let how =
            (rung.beside.adhesive, rung.id(), case.grid.nx, rung.slab, self.repeats, rayon::current_num_threads());
        Key::new(&rung.stage(), &(problem, how, &self.common), reference.as_slice())
    }

    /// Runs a setting, or reads what is done of it. `reference` is what its maps are compared with; none for the reference
    /// itself, whose maps stay.
    pub fn measure(
        &mut self,
        rung: &Rung,
        reference: Option<(&Measured, &Key)>,
        deadline: Option<Instant>,
    ) -> Result<Measured> {
        let stage = rung.stage();
        if let Some((_, known)) = self.measured.iter().find(|(r, _)| r.stage() == stage) {
            return Ok(known.clone());
        }
        let case = ladder::at(self.case, rung)?;
        let key = self.key(rung, &case, reference.map(|r| r.1))?;
        let listener = Until { listener: self.listener, deadline };
        let (series, repeats) = (&self.series, self.repeats);
        // What is half measured is measured anew: a cost that was put together from parts is none.
        let found = self.folder.stage(&listener, (&stage, &rung.words()), &key, Leftovers::Remove, |dir| {
            let root = dir.parent().unwrap_or(dir);
            let found = measured(rung, &case, series, (dir, &stage), &key, repeats, &listener)?;
            let Some((reference, _)) = reference else { return Ok(found) };
            let kind = rung.beside.method.card().kind;
            let pairs = found.results.states.iter().zip(&reference.results.states);
            let maps = pairs.map(|(a, b)| judge::maps(root, kind, a, b)).collect::<Result<_>>()?;
            let states = &found.results.states;
            for map in states.iter().flat_map(|s| [&s.gap_map, &s.stress_map, &s.contact_map]).flatten() {
                let path = root.join(map);
                std::fs::remove_file(&path).map_err(Error::io("remove", &path))?;
            }
            Ok(Measured { maps, ..found })
        })?;
        self.seconds.push((*rung, found.cost.wall_seconds * self.repeats as f64));
        self.measured.push((*rung, found.clone()));
        Ok(found)
    }

    /// Runs a setting if it can be expected to end within `share` of what is left of the budget; else tells why not.
    fn attempt(&mut self, rung: Rung, truth: &Truth, share: f64, climbed: &mut Climbed) -> Result<Option<String>> {
        let case = ladder::at(self.case, &rung)?;
        let key = self.reference_key(&truth.rung)?;
        let known = self.measured.iter().any(|(r, _)| r.stage() == rung.stage())
            || self.folder.holds(&rung.stage(), &self.key(&rung, &case, Some(&key))?);
        let mut deadline = None;
        if !known {
            let (need, have) = (rung.planned_bytes(&case), sys::available_memory_bytes());
            if need > have {
                return Ok(Some(format!("needs {} of memory, of which {} are available", memory(need), memory(have))));
            }
            if let Some(budget) = self.budget {
                let left = budget - self.spent_seconds();
                if left <= 0.0 {
                    return Ok(Some(format!("the budget of {} was spent before", duration(budget))));
                }
                let expected = rung.expected_seconds(&self.seconds, &case) * self.repeats as f64;
                if expected > left * share.min(1.0) {
                    let (expected, left) = (duration(expected), duration(left * share.min(1.0)));
                    return Ok(Some(format!("expected to take {expected}, {left} of the budget are left for it")));
                }
                deadline = Some(Instant::now() + Duration::from_secs_f64(left * (PATIENCE * share).min(1.0)));
            }
        }
        let clock = Instant::now();
        match self.measure(&rung, Some((&truth.measured, &key)), deadline) {
            Ok(found) => {
                climbed.done.push((rung, found));
                Ok(None)
            }
            Err(Error::Interrupted) if !self.listener.stopping() => {
                let seconds = clock.elapsed().as_secs_f64();
                self.stopped_seconds += seconds;
                Ok(Some(format!("stopped after {}, its part of the budget", duration(seconds))))
            }
            Err(e) => Err(e),
        }
    }

    /// The settings of a list, in its order.
    pub fn measure_all(&mut self, besides: &[Beside], list: &[Exact], truths: &[Truth]) -> Result<Climbed> {
        let mut climbed = Climbed::default();
        for e in list {
            for &beside in besides.iter().filter(|b| b.method.card().id == e.method) {
                let rung = Rung { beside, n: e.n, precision: e.precision, tolerance: e.tolerance, slab: None };
                let Some(truth) = truths.iter().find(|t| t.rung.beside.adhesive == beside.adhesive) else { continue };
                let why = self.attempt(rung, truth, 1.0, &mut climbed)?;
                climbed.left_out.extend(why.map(|w| (rung, w)));
            }
        }
        Ok(climbed)
    }

    /// Every method once, on the first of `grids` or the next one that fits; then on the other grids, coarse ones first; then
    /// in other precisions and to other tolerances.
    pub fn climb(&mut self, besides: &[Beside], grids: &[usize], slabs: &[f64], truths: &[Truth]) -> Result<Climbed> {
        let tolerance = ladder::base_tolerance(self.case);
        let rung = |&beside: &Beside, n: usize| Rung { beside, n, precision: Precision::F64, tolerance, slab: None };
        let truth = |rung: &Rung| truths.iter().find(|t| t.rung.beside.adhesive == rung.beside.adhesive);
        let mut climbed = Climbed::default();
        // What did not fit is not tried again.
        let mut refused: Vec<(Rung, String)> = Vec::new();
        let mut first: Vec<Rung> = Vec::new();
        let (&main, rest) = grids.split_first().expect("at least one grid");
        let mut pending: Vec<Rung> = besides.iter().map(|b| rung(b, main)).collect();
        self.cheap_first(&mut pending)?;
        for (i, start) in pending.iter().enumerate() {
            let share = 1.0 / (pending.len() - i) as f64;
            let coarser = rest.iter().filter(|n| **n < main);
            for r in std::iter::once(*start).chain(coarser.map(|&n| Rung { n, ..*start })) {
                let Some(truth) = truth(&r) else { continue };
                match self.attempt(r, truth, share, &mut climbed)? {
                    None => {
                        first.push(r);
                        break;
                    }
                    Some(why) => refused.push((r, why)),
                }
            }
        }
        let mut others: Vec<Rung> =
            besides.iter().flat_map(|b| grids.iter().map(move |&n| rung(b, n))).filter(|r| is_new(r, &first)).collect();
        self.cheap_first(&mut others)?;
        let mut refined = Vec::new();
        for start in &pending {
            match first.iter().find(|r| r.is_of(start)) {
                Some(r) => refined.extend(ladder::refinements(r, &ladder::at(self.case, r)?)),
                None => {
                    let none = "its method was left out on the grids before";
                    let skipped = ladder::refinements(start, &ladder::at(self.case, start)?);
                    climbed.left_out.extend(skipped.into_iter().map(|r| (r, none.to_string())));
                }
            }
        }
        for t in truths {
            let layer = |&thickness: &f64| Rung { n: main, slab: Some(thickness), ..t.rung };
            refined.extend(slabs.iter().map(layer));
        }
        self.cheap_first(&mut refined)?;
        for r in others.into_iter().chain(refined) {
            let Some(truth) = truth(&r) else { continue };
            let stopped = |(k, why): &&(Rung, String)| k.stage() == r.stage() && why.starts_with("stopped");
            let why = match refused.iter().find(stopped) {
                Some((_, why)) => Some(why.clone()),
                None => self.attempt(r, truth, 1.0, &mut climbed)?,
            };
            climbed.left_out.extend(why.map(|w| (r, w)));
        }
        Ok(climbed)
    }

    /// With a budget, what is expected to cost least comes first: it leaves most of it to the others.
    fn cheap_first(&self, rungs: &mut [Rung]) -> Result<()> {
        if self.budget.is_some() {
            let mut expected = Vec::new();
            for r in rungs.iter() {
                expected.push((r.expected_seconds(&self.seconds, &ladder::at(self.case, r)?), *r));
            }
            expected.sort_by(|a, b| a.0.total_cmp(&b.0));
            rungs.iter_mut().zip(expected).for_each(|(r, (_, e))| *r = e);
        }
        Ok(())
    }
}

fn is_new(rung: &Rung, done: &[Rung]) -> bool {
    !done.iter().any(|d| d.stage() == rung.stage())
}

/// Runs a setting as often as asked; what it told is told once, and the least that it took counts.
fn measured(
    rung: &Rung,
    case: &Case,
    series: &OnceCell<Series<f64>>,
    (dir, stage): (&Path, &str),
    key: &Key,
    repeats: usize,
    listener: &dyn Listener,
) -> Result<Measured> {
    let made: Vec<f64>;
    let heights = match &case.surface {
        Surface::Synthesised { modes, .. } => Heights::Series(series.get_or_init(|| modes.series())),
        Surface::Fourier { modes, .. } => Heights::Series(modes.series()),
        Surface::Imported { .. } => {
            made = case.surface.heights(case.grid, 0.0);
            Heights::Nodes(&made)
        }
    };
    let mut best: Option<Measured> = None;
    for _ in 0..repeats {
        let growth = sys::Growth::begin();
        let (clock, cpu) = (Instant::now(), sys::cpu_seconds());
        let results = methods::run(case, rung.beside, heights, (dir, stage), key, listener)?;
        let cost = Cost {
            wall_seconds: clock.elapsed().as_secs_f64(),
            cpu_seconds: sys::cpu_seconds() - cpu,
            of_reference: 1.0,
            fft_pairs: results.states.iter().map(|s| s.fft_pairs).sum(),
            iterations: results.states.iter().map(|s| s.iterations).sum(),
            planned_bytes: results.planned_bytes,
            measured_bytes: growth.bytes(),
            resident_before_bytes: growth.before_bytes(),
        };
        let refused = results.refusal.is_some();
        match &mut best {
            None => best = Some(Measured { ny: case.grid.ny, results, maps: Vec::new(), cost }),
            Some(b) => {
                b.cost.wall_seconds = b.cost.wall_seconds.min(cost.wall_seconds);
                b.cost.cpu_seconds = b.cost.cpu_seconds.min(cost.cpu_seconds);
                b.cost.measured_bytes = b.cost.measured_bytes.max(cost.measured_bytes);
            }
        }
        if refused {
            break;
        }
    }
    Ok(best.expect("at least one run"))
}
