//! Spatially resolved Greenwood-Williamson with JKR summits (Müser et al., Tribology Letters 65 (2017) 118, section
//! 3; Greenwood & Williamson, Proc. R. Soc. A 295 (1966) 300; Johnson, Kendall & Roberts, Proc. R. Soc. A 324 (1971)
//! 301).
//!
//! Every summit is an independent sphere at a common rigid approach. With adhesion a summit jumps into contact at δ =
//! 0, since JKR has no force at a distance, and stays in contact down to its pull-off approach: the contacts are a
//! state of the load path. The gap is that of the undeformed surface.

use crate::prelude::*;
use crate::spots::{Jkr, Spot, hertz_load, paint};
use asperity_grid::sum_rows;
use asperity_surface::{Summit, SummitFit};
use std::borrow::Cow;
use std::f64::consts::PI;

pub(super) struct Srgw;

static CARD: MethodCard = MethodCard {
    id: "srgw",
    paper_name: "SRGW",
    family: "single asperities",
    kind: MethodKind::Estimate,
    needs: Needs::Heights,
    criterion: Criterion::Spots,
    calibrated_on: None,
    summary: "every summit an independent JKR sphere at a common approach",
    supports,
    capabilities: Capabilities::NONE,
    dois: &["10.1007/s11249-017-0900-2", "10.1098/rspa.1966.0242", "10.1098/rspa.1971.0141"],
    papers: &[],
    measured_errors: Some(&MEASURED),
};

static ERRORS: [MeasuredError; 2] = [MeasuredError::of_area(0.11), MeasuredError::of_open_gap(2.17)];
static MEASURED: MeasuredErrors = MeasuredErrors::on_the_challenge(&ERRORS, true);

fn supports(quantity: Quantity) -> Support {
    use Quantity::*;
    match quantity {
        ContactArea => Support::Only("sum of contact spots, which may overlap; JKR adhesion"),
        ClusterPdf | ClusterArea | MedianClusterArea => Support::Only("one spot per summit; JKR adhesion"),
        GapMap | GapPdf | MeanGap => Support::Only("undeformed gap"),
        StressMap | StressPdf => Support::Only("superposed Hertz and JKR profiles"),
        Stiffness => Support::Only("as differences between loads"),
        ContactMap => Support::No("contact spots are areas without nodes"),
    }
}

/// Relative load balance at which the search for the approach ends.
const BALANCE: f64 = 1e-12;

/// Relative load balance at which an approach is accepted when bisection ends at the rounding of the approach.
const ANSWER: f64 = 1e-8;

/// Approaches, down to the detachment of the last summit, at which a tensile load is searched.
const PLACES: usize = 4096;

/// Halvings of the bracket at most.
const HALVINGS: usize = 200;

/// Summits of a block in ordered sums.
const BLOCK: usize = 256;

/// Processor time of a load, measured by the benchmark `measure`; an order of magnitude.
const SECONDS_PER_POINT: f64 = 1e-7;

impl ContactMethod for Srgw {
    fn card(&self) -> &'static MethodCard {
        &CARD
    }

    fn plan(&self, problem: &ReducedProblem) -> SolvePlan {
        // Heights, gap and stress, and one summit per about 20 nodes; for the Fourier fit also a spectrum.
        let fourier = u64::from(problem.settings.srgw.fit == SummitFit::Fourier);
        SolvePlan::per_point(problem, 3 * 8 + 16 * fourier + 4, 50, SECONDS_PER_POINT)
    }

    fn prepare<'p>(&self, problem: &'p ReducedProblem<'p>, observer: &'p dyn Observer) -> Result<StartedMethod<'p>> {
        require::half_space(problem, CARD.id)?;
        require::hard_wall(problem, CARD.id)?;
        let heights = require::heights_above_lowest(problem);
        let settings = problem.settings.srgw;
        let summits = require::summits(problem.grid, &heights, (settings.fit, settings.curvature), CARD.id)?;
        let jkr = Jkr { gamma: problem.adhesion.work_of_adhesion() };
        let depth = summits[0].height;
        let reach = summits.iter().map(|s| jkr.least_approach(s.radius)).fold(0.0, f64::min);
        let asperities = Asperities { grid: problem.grid, touching: vec![false; summits.len()], summits, jkr, reach };
        let (gap, stress) = (Vec::new(), Vec::new());
        Ok(estimating(SrgwRun { problem, observer, heights, asperities, depth, gap, stress }))
    }
}

struct Asperities {
    grid: Grid,
    /// In the order of first contact.
    summits: Vec<Summit>,
    jkr: Jkr,
    /// Approach below which no summit stays in contact.
    reach: f64,
    /// Whether each summit was in contact at the end of the last load.
    touching: Vec<bool>,
}

impl Asperities {
    /// Contact radius of a summit at an approach reached from that of the last load; `None` without contact.
    fn radius(&self, k: usize, depth: f64) -> Option<f64> {
        let Summit { height, radius, .. } = self.summits[k];
        let approach = depth - height;
        let touches = approach >= 0.0 || self.touching[k];
        if touches { self.jkr.radius(approach, radius) } else { None }
    }

    /// Number of summits that may be in contact: the first ones.
    fn candidates(&self, depth: f64) -> usize {
        self.summits.partition_point(|s| s.height <= depth - self.reach)
    }

    /// Mean pressure at an approach.
    fn pressure(&self, depth: f64) -> f64 {
        let n = self.candidates(depth);
        let [load] = sum_rows(n.div_ceil(BLOCK), |b| {
            let block = b * BLOCK..n.min((b + 1) * BLOCK);
            let load = |k: usize| self.radius(k, depth).map_or(0.0, |a| self.jkr.load(a, self.summits[k].radius));
            [block.map(load).sum::<f64>()]
        });
        load / (self.grid.lx * self.grid.ly)
    }

    /// Two approaches, the first with a pressure of at most `target` and the second of at least, on the path from
    /// `depth`; none if the surfaces separate before.
    fn bracket(&self, depth: f64, target: f64) -> Option<(f64, f64)> {
        let last = self.summits.len() - 1;
        let mut step = 1e-6 * (self.summits[last].height - self.summits[0].height + self.summits[0].radius);
        let (mut low, mut high) = (depth, depth);
        if self.pressure(depth) < target {
            while self.pressure(high) < target {
                low = high;
                high += step;
                step *= 2.0;
            }
            return Some((low, high));
        }
        if target > 0.0 {
            while self.pressure(low) > target {
                high = low;
                low -= step;
                step *= 2.0;
            }
            return Some((low, high));
        }
        // Equilibria under tension lie in a short interval before pull-off, which long steps would miss.
        let end = self.summits[0].height + self.reach;
        let place = |k: usize| depth + (end - depth) * k as f64 / PLACES as f64;
        let touches = |depth: f64| (0..self.candidates(depth)).any(|k| self.radius(k, depth).is_some());
        let found = (1..=PLACES).find(|&k| self.pressure(place(k)) <= target && touches(place(k)));
        found.map(|k| (place(k), place(k - 1)))
    }
}

struct SrgwRun<'p> {
    problem: &'p ReducedProblem<'p>,
    observer: &'p dyn Observer,
    /// Above the lowest node.
    heights: Cow<'p, [f64]>,
    asperities: Asperities,
    /// Approach at the end of the last load, from the lowest node; before the first load, that of first contact.
    depth: f64,
    gap: Vec<f64>,
    stress: Vec<f64>,
}

impl SrgwRun<'_> {
    /// Bisection. The force decreases at jumps into contact and increases at detachments, each opposite to the
    /// direction of the search, so the pressure is continuous at the limit. With adhesion several approaches within
    /// the jump of one summit may have the target pressure; one of them is found.
    fn search(&self, (mut low, mut high): (f64, f64), target: f64) -> (f64, Stop, usize) {
        let scale = self.problem.stress_scale(self.problem.heights.rms(), target);
        for iteration in 0..HALVINGS {
            let depth = 0.5 * (low + high);
            let pressure = self.asperities.pressure(depth);
            let residual = (pressure - target).abs() / scale;
            if residual <= BALANCE || depth <= low || depth >= high {
                let stop = if residual <= ANSWER { Stop::Converged } else { Stop::RoundingFloor };
                return (depth, stop, iteration);
            }
            let step = Iteration { iteration, residual, tolerance: BALANCE, grid_fraction: 1.0 };
            if self.observer.iteration(step).is_break() {
                return (depth, Stop::Interrupted, iteration);
            }
            if pressure < target { low = depth } else { high = depth }
        }
        (0.5 * (low + high), Stop::IterationLimit, HALVINGS)
    }
}

impl Estimator for SrgwRun<'_> {
    fn estimate(&mut self, load: Load) -> Result<MethodEstimate<'_>> {
        let clock = Instant::now();
        let adhesive = self.asperities.jkr.gamma > 0.0;
        let pressure = require::pressure(load, adhesive, CARD.id)?;
        let (depth, stop, iterations) = match self.asperities.bracket(self.depth, pressure) {
            Some(bracket) => self.search(bracket, pressure),
            // Separated: no contact, and the next load starts at first contact.
            None => {
                self.asperities.touching.fill(false);
                (self.asperities.summits[0].height.min(0.0) + 2.0 * self.asperities.reach, Stop::Detached, PLACES)
            }
        };
        let asperities = &mut self.asperities;
        let grid = asperities.grid;
        let radii: Vec<Option<f64>> = (0..asperities.summits.len()).map(|k| asperities.radius(k, depth)).collect();
        let jkr = asperities.jkr;
        let spots: Vec<Spot> = (asperities.summits.iter().zip(&radii))
            .filter_map(|(s, a)| {
                a.map(|a| Spot { x: s.x, y: s.y, radius: a, press: hertz_load(a, s.radius), pull: jkr.pull(a) })
            })
            .collect();
        asperities.touching.iter_mut().zip(&radii).for_each(|(t, a)| *t = a.is_some());
        self.depth = if stop == Stop::Detached { asperities.summits[0].height } else { depth };
        paint(grid, spots.iter().copied(), &mut self.stress);
        let clusters: Vec<f64> = spots.iter().map(|s| PI * s.radius.powi(2)).collect();
        let area = clusters.iter().sum::<f64>() / (grid.lx * grid.ly);
        let mean_gap = require::undeformed_gap(&self.heights, depth, &mut self.gap);
        let scale = self.problem.stress_scale(self.problem.heights.rms(), pressure);
        Ok(MethodEstimate {
            contact_area: require::contact_of_spots(area, pressure, CARD.id)?,
            mean_gap: Some(mean_gap),
            gap: Some(&self.gap),
            stress: Some(&self.stress),
            clusters: Some(clusters),
            load_error: (mean(&self.stress) - pressure).abs() / scale,
            stop,
            iterations,
            seconds: clock.elapsed().as_secs_f64(),
            ..MethodEstimate::at(pressure)
        })
    }

    /// With adhesion the contacts of the next load depend on those of this one.
    fn replay(&mut self, load: Load) -> Result<()> {
        if self.asperities.jkr.gamma > 0.0 { self.estimate(load).map(|_| ()) } else { Ok(()) }
    }
}
