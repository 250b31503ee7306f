//! Results and cost of one setting.

use super::benchmark_point::{BenchmarkPoint, LowPass};
use super::errors::{self, MapErrors, Roughness};
use crate::Result;
use crate::pipeline::methods;
use crate::pipeline::stage::StageContext;
use crate::record::methods::MethodResults;
use crate::record::tradeoff::{LoadErrors, MeasuredCost, ReferenceLoad};
use crate::scene::Case;
use asperity_contact::method::Heights;
use asperity_grid::Series;
use asperity_grid::sys;
use asperity_surface::HeightSource;
use serde::{Deserialize, Serialize};
use std::cell::OnceCell;
use std::time::Instant;

/// Results and cost of a setting.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct MeasuredPoint {
    pub ny: usize,
    pub results: MethodResults,
    /// Map errors at each load, relative to the reference.
    pub maps: Vec<MapErrors>,
    /// Map errors at each load of a block, relative to the solution on the heights that it resolves.
    #[serde(default)]
    pub resolved: Vec<MapErrors>,
    pub cost: MeasuredCost,
    /// Warnings about the setting.
    #[serde(default)]
    pub notes: Vec<String>,
}

impl MeasuredPoint {
    /// Not compared with the reference yet.
    pub(super) fn new(ny: usize, results: MethodResults, cost: MeasuredCost, notes: Vec<String>) -> Self {
        MeasuredPoint { ny, results, maps: Vec::new(), resolved: Vec::new(), cost, notes }
    }
}

/// The reference solution, with its extrapolated numbers and their uncertainty from coarser grids.
pub(super) struct ReferenceSolution {
    pub point: BenchmarkPoint,
    pub measured: MeasuredPoint,
    pub numbers: Vec<ReferenceLoad>,
    pub uncertainty: Vec<LoadErrors>,
    pub coarser: Vec<usize>,
}

impl ReferenceSolution {
    /// The reference of a setting: that with adhesion if the setting has adhesion.
    pub(super) fn of<'a>(references: &'a [ReferenceSolution], point: &BenchmarkPoint) -> Option<&'a ReferenceSolution> {
        references.iter().find(|r| r.point.method_run.adhesive == point.method_run.adhesive)
    }

    /// Errors of a setting at each load.
    pub(super) fn errors(&self, measured: &MeasuredPoint, rough: Roughness) -> Vec<LoadErrors> {
        let states = (measured.results.states.as_slice(), measured.maps.as_slice());
        errors::errors(states, &self.measured.results.states, &self.numbers, rough)
    }
}

/// Settings that take less than this, s, are repeated: other load on the machine distorts short timings.
const SHORT_SECONDS: f64 = 1.0;

/// Smallest and largest number of runs of a short setting. Between them, runs end after [`SHORT_SECONDS`] in total.
const RUNS_OF_SHORT: [usize; 2] = [3, 30];

/// Whether `runs` runs with a total time of `seconds` suffice.
fn enough(repeats: Option<usize>, runs: usize, seconds: f64) -> bool {
    let [least, largest] = RUNS_OF_SHORT;
    let is_short = runs > 0 && seconds / (runs as f64) < SHORT_SECONDS;
    match repeats {
        Some(n) => runs >= n.max(1),
        None if !is_short => runs >= 1,
        None => runs >= largest || runs >= least && seconds >= SHORT_SECONDS,
    }
}

/// Total time of all runs of a setting, s, if one run takes `seconds`.
pub(super) fn total_seconds(repeats: Option<usize>, seconds: f64) -> f64 {
    let runs = (1..).find(|&n| enough(repeats, n, n as f64 * seconds)).unwrap_or(1);
    runs as f64 * seconds
}

/// Runs a setting as often as requested. Results are those of the first run. Times are the minimum over all runs, and
/// memory is the maximum.
pub(super) fn measure_repeatedly(
    point: &BenchmarkPoint,
    case: &Case,
    series: &OnceCell<Series<f64>>,
    repeats: Option<usize>,
    context: &StageContext,
) -> Result<MeasuredPoint> {
    let made: Vec<f64>;
    let heights = match case.surface() {
        surface if point.filter.is_some() => {
            let LowPass { low_pass, stretch } = point.filter.expect("just seen");
            made = surface.heights(case.model.grid, low_pass).into_iter().map(|h| h * stretch).collect();
            Heights::Nodes(&made)
        }
        HeightSource::Synthesised { modes, .. } => Heights::Series(series.get_or_init(|| modes.series().clone())),
        HeightSource::Fourier { modes, .. } => Heights::Series(modes.series()),
        HeightSource::Imported { .. } => {
            made = case.surface().heights(case.model.grid, 0.0);
            Heights::Nodes(&made)
        }
    };
    let mut best: Option<MeasuredPoint> = None;
    let (mut runs, mut seconds) = (0, 0.0);
    while !enough(repeats, runs, seconds) {
        let growth = sys::MemoryGrowth::begin();
        let (clock, cpu) = (Instant::now(), sys::cpu_seconds());
        let results = methods::run(case, point.method_run, heights, context)?;
        let cost = MeasuredCost {
            wall_seconds: clock.elapsed().as_secs_f64(),
            cpu_seconds: sys::cpu_seconds() - cpu,
            cpu_over_reference: 1.0,
            fft_pairs: results.states.iter().map(|s| s.fft_pairs).sum(),
            iterations: results.states.iter().map(|s| s.iterations).sum(),
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
                best = Some(MeasuredPoint::new(case.model.grid.ny, results, cost, Vec::new()));
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
            (total_seconds(None, 0.2) - 1.0).abs() < 1e-12
                && total_seconds(Some(4), 60.0) == 240.0
                && total_seconds(None, 60.0) == 60.0
        );
    }
}
