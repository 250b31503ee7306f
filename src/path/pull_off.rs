use crate::grid::Grid;
use crate::method::{Load, Problem, Run, State, Stop};
use crate::record::results::PullOff;
use crate::{Error, Result};

/// Step of the mean gap during separation: the first, over the larger of mean gap and range, and the growth factor.
const FIRST_STEP: f64 = 0.02;
const GROWTH: f64 = 1.2;
/// Reduction of the first step if the tension decreases from the start, and smallest first step over the mean gap.
const SHORTER: f64 = 0.2;
const SHORTEST_STEP: f64 = 1e-5;
const MOST_STEPS: usize = 200;

/// The separation ends when there is no contact and the tension has fallen to this fraction of the maximum.
const PASSED: f64 = 0.3;

/// Golden-section steps within the bracket of the maximum tension. They reduce the bracket to a hundredth of its width.
const SECTIONS: usize = 10;
const GOLDEN: f64 = 0.618_033_988_749_895;

/// Largest number of f64 fields in memory during a search: the initial state, the current one, the previous one and the
/// one before the maximum tension.
pub(super) const FIELDS: u64 = 4;

/// A state of the separation curve.
#[derive(Clone, Copy)]
struct Point {
    mean_gap: f64,
    pressure: f64,
}

/// Initial state of a separation.
pub(super) struct SeparationStart {
    pub mean_gap: f64,
    pub pressure: f64,
    pub gap: Vec<f64>,
}

impl SeparationStart {
    pub fn of(state: &State) -> Self {
        SeparationStart { mean_gap: state.mean_gap, pressure: state.pressure, gap: state.gap.to_vec() }
    }
}

/// Separates the surfaces from the current state of `run` and finds the maximum tension. The mean gap is imposed: then
/// states that are unstable under an imposed pressure also have an equilibrium.
pub(super) fn search(run: &mut dyn Run, problem: &Problem, from: SeparationStart) -> Result<PullOff> {
    let SeparationStart { mean_gap, pressure, gap } = from;
    let range = problem.adhesion.range();
    if range == 0.0 {
        return Err(Error::input("pull-off", "adhesion", "none", "an adhesion: nothing else holds surfaces together"));
    }
    let mut first_step = FIRST_STEP * mean_gap.max(range);
    let mut step = first_step;
    let mut curve = vec![Point { mean_gap, pressure }];
    // Gap of the state before the lowest pressure. The search within the bracket starts from it, because a branch that
    // the surfaces have left is not reached again by a smaller separation.
    let mut before: Vec<f64> = Vec::new();
    let start = gap;
    let mut last = start.clone();
    let mut lowest = 0;
    loop {
        let mean_gap = curve[curve.len() - 1].mean_gap + step;
        let (point, gap) = equilibrium(run, problem, mean_gap, None)?;
        curve.push(point);
        if point.pressure < curve[lowest].pressure {
            (lowest, before) = (curve.len() - 1, std::mem::take(&mut last));
        }
        // A rough surface separates asperity by asperity, and the last one may have the maximum tension. The scan
        // therefore ends only without contact and at a small tension.
        let parted = gap.iter().all(|g| *g > 0.0);
        last = gap;
        // For an initial load close to the maximum tension the first step may be too long.
        if curve.len() == 2 && lowest == 0 && first_step > SHORTEST_STEP * mean_gap {
            first_step *= SHORTER;
            step = first_step;
            curve.truncate(1);
            run.set_gap(&start);
            last.clone_from(&start);
            continue;
        }
        if parted && lowest + 1 < curve.len() && -point.pressure < PASSED * -curve[lowest].pressure {
            break;
        }
        if curve.len() > MOST_STEPS {
            let found = format!("still a pull of {:.3e} E* at a mean gap of {mean_gap:.3e} L", -curve[lowest].pressure);
            return Err(Error::input("pull-off", "search", found, "an adhesion that ends"));
        }
        step *= GROWTH;
    }
    if lowest == 0 {
        let found = format!("a pull of {:.3e} E*, from which on it falls", -pressure);
        return Err(Error::input("pull-off", "last load", found, "one before the largest pull"));
    }
    let (mut low, mut high) = (curve[lowest - 1].mean_gap, curve[lowest + 1].mean_gap);
    let mut best = curve[lowest];
    let mut probe = |mean_gap: f64| -> Result<Point> {
        let (point, _) = equilibrium(run, problem, mean_gap, Some(&before))?;
        if point.pressure < best.pressure {
            best = point;
        }
        curve.push(point);
        Ok(point)
    };
    let mut left = probe(high - GOLDEN * (high - low))?;
    let mut right = probe(low + GOLDEN * (high - low))?;
    for _ in 0..SECTIONS {
        if left.pressure < right.pressure {
            (high, right) = (right.mean_gap, left);
            left = probe(high - GOLDEN * (high - low))?;
        } else {
            (low, left) = (left.mean_gap, right);
            right = probe(low + GOLDEN * (high - low))?;
        }
    }
    curve.sort_by(|a, b| a.mean_gap.total_cmp(&b.mean_gap));
    Ok(PullOff {
        pressure: best.pressure,
        mean_gap: best.mean_gap,
        mean_gap_error: (high - best.mean_gap).max(best.mean_gap - low),
        pressure_error: left.pressure.max(right.pressure) - best.pressure,
        coarser: None,
        curve: curve.iter().map(|p| [p.mean_gap, p.pressure]).collect(),
    })
}

/// `found` with errors of at least the change from the coarser grid.
pub(super) fn compared(found: PullOff, grid: Grid, coarse: PullOff) -> PullOff {
    let change = (found.pressure - coarse.pressure).abs();
    PullOff {
        pressure_error: found.pressure_error.max(change),
        mean_gap_error: found.mean_gap_error.max((found.mean_gap - coarse.mean_gap).abs()),
        coarser: Some([grid.nx, grid.ny]),
        ..found
    }
}

/// The state at a mean gap and its gap field, from the gap `start` if given.
fn equilibrium(
    run: &mut dyn Run,
    problem: &Problem,
    mean_gap: f64,
    start: Option<&[f64]>,
) -> Result<(Point, Vec<f64>)> {
    if let Some(gap) = start {
        run.set_gap(gap);
    }
    let state = run.equilibrate(Load::MeanGap(mean_gap))?;
    match state.stop {
        Stop::Converged => Ok((Point { mean_gap, pressure: state.pressure }, state.gap.to_vec())),
        Stop::Interrupted => Err(Error::Interrupted),
        stop => Err(unconverged(problem, &state, stop)),
    }
}

pub(super) fn unconverged(problem: &Problem, state: &State, stop: Stop) -> Error {
    Error::NotConverged {
        method: "fast",
        why: format!("{stop}, on the way to pull-off at a mean gap of {:.6e} L", state.mean_gap),
        iterations: state.iterations,
        residual: state.residual,
        tolerance: problem.tolerance,
        partial: None,
    }
}
