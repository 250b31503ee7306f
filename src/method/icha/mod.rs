//! Interacting and coalescing Hertzian asperities (Afferrante, Carbone & Demelio, Wear 278-279 (2012) 28; Afferrante,
//! Bottiglione, Putignano, Persson & Carbone, Tribology Letters 66 (2018) 75).
//!
//! Every summit is a Hertzian sphere whose approach is lessened by what all other spots lower the body by; spots that
//! overlap become one of the same area and load. The load rises in small steps, since what has merged stays so. Displacements
//! are those of the periodic half-space: to the closed form of one spot come its images by Ewald's sum, and the mean
//! displacement is zero. So the mean gap is the mean height less the approach, which the published method, whose approach
//! has no zero, does not give; it counts as gap also what bodies away from summits overlap by.

mod balance;
mod images;
mod spots;
mod sums;

use super::spots::{Spot, paint};
use super::{
    Card, ContactMethod, Criterion, Estimate, Estimator, Iteration, Kind, Load, Needs, Observer, Plan, Problem,
    Quantity, Started, Stop, Support, require,
};
use crate::grid::{Grid, mean};
use crate::surface::{SummitCurvature, SummitFit};
use crate::{Error, Result};
use balance::EquilibriumSolver;
use serde::{Deserialize, Serialize};
use spots::{Asperity, Spots};
use std::time::Instant;

pub struct Icha;

static CARD: Card = Card {
    id: "icha",
    paper_name: "ICHA",
    family: "single asperities",
    kind: Kind::Estimate,
    needs: Needs::Heights,
    criterion: Criterion::Spots,
    calibrated_on: None,
    summary: "Hertzian summits that lower the body for each other and merge where they overlap",
    supports,
    dois: &["10.1007/s11249-017-0900-2", "10.1007/s11249-018-1026-x"],
    papers: &["Afferrante, Carbone & Demelio, Wear 278-279 (2012) 28"],
};

fn supports(quantity: Quantity) -> Support {
    match quantity {
        Quantity::ContactArea => Support::NoAdhesion,
        Quantity::PatchPdf | Quantity::PatchArea | Quantity::MedianClusterArea => {
            Support::Only("discs that have merged, without adhesion")
        }
        Quantity::MeanGap => Support::Only(
            "from the approach, without adhesion, while no spot is wider than half of the cell; overlap beside summits not prevented",
        ),
        Quantity::StressMap | Quantity::StressPdf => Support::Only("profiles of spots, without adhesion"),
        Quantity::Stiffness => Support::Only("as differences between loads"),
        Quantity::ContactMap => Support::No("spots are areas, not nodes"),
        Quantity::GapMap | Quantity::GapPdf => Support::No("the gap is known at summits alone"),
    }
}

/// Settings of the method `icha`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct IchaSettings {
    /// Where the curvatures of summits come from.
    pub fit: SummitFit,
    /// Which one number stands for the two principal curvatures.
    pub curvature: SummitCurvature,
    /// Steps of the load per decade, from p* = 10⁻⁶ on; spots merge after each. At most 1000.
    pub steps_per_decade: u32,
}

impl Default for IchaSettings {
    fn default() -> Self {
        IchaSettings { fit: SummitFit::default(), curvature: SummitCurvature::default(), steps_per_decade: 8 }
    }
}

/// p* of the first step: below what the first summit of a surface worth the method carries alone.
const FIRST: f64 = 1e-6;

/// What approaches miss of equilibrium, over the largest one, and load balance at which a load is in equilibrium.
const SETTLED: f64 = 1e-7;

/// The same of the steps on the way to it, which only tell what merges.
const ON_THE_WAY: f64 = 1e-5;

/// Steps of Newton's after which what overlaps merges out of equilibrium; nearly all balances take fewer than ten.
const PATIENCE: usize = 12;

/// Radius of the widest spot over the shorter side up to which the approach says something of the gap. Beyond, one round spot stands for
/// contact that leads around the cell, its images for points press the body up, and from 0.4 on the approach falls as the load rises.
const WIDEST: f64 = 0.25;

/// Processor time of a load over the points, measured by `asperity bench --methods`; an order of magnitude.
const SECONDS_PER_POINT: f64 = 7e-6;

impl ContactMethod for Icha {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn plan(&self, problem: &Problem) -> Plan {
        // Heights from the lowest on and stress, three lists with an asperity for some 20 nodes, and neighbours of those that touch; of
        // the Fourier fit a field and a spectrum more. 17 to 22 bytes a point were measured at 512² and 1024².
        let fourier = u64::from(problem.settings.icha.fit == SummitFit::Fourier);
        let per_point = 2 * 8 + 16 * fourier + 8;
        let points = problem.grid.points();
        let seconds = SECONDS_PER_POINT * points as f64;
        Plan { bytes: per_point * points as u64, iterations: 300, pairs_per_iteration: 0.0, seconds }
    }

    fn start<'p>(&self, problem: &'p Problem<'p>, observer: &'p dyn Observer) -> Result<Started<'p>> {
        require::half_space(problem, CARD.id)?;
        require::hard_wall(problem, CARD.id)?;
        require::no_adhesion(problem, CARD.id)?;
        let settings = problem.settings.icha;
        let refuse = |key: &str, found: f64, accepted: &str| Error::input("method icha", key, found, accepted);
        if !(1..=1000).contains(&settings.steps_per_decade) {
            return Err(refuse("icha.steps_per_decade", f64::from(settings.steps_per_decade), "1 to 1000"));
        }
        let heights = require::from_lowest(problem);
        let summits = require::summits(problem.grid, &heights, (settings.fit, settings.curvature), CARD.id)?;
        let fresh = Spots::new(problem.grid, &summits);
        Ok(Started::Estimator(Box::new(Path {
            problem,
            observer,
            mean_height: mean(&heights),
            first: FIRST * problem.resolved_gradient(),
            spots: fresh.clone(),
            fresh,
            step: 0,
            stress: Vec::new(),
        })))
    }
}

struct Path<'p> {
    problem: &'p Problem<'p>,
    observer: &'p dyn Observer,
    /// Over the lowest node.
    mean_height: f64,
    /// Pressure of the first step.
    first: f64,
    fresh: Spots,
    /// At the last step of the load.
    spots: Spots,
    /// Steps that it has taken.
    step: i32,
    stress: Vec<f64>,
}

impl Path<'_> {
    fn step_pressure(&self, step: i32) -> f64 {
        self.first * 10f64.powf(f64::from(step) / f64::from(self.problem.settings.icha.steps_per_decade))
    }

    /// Equilibrium at a pressure, with all merged that overlaps, and what is missed of it. Counts steps of Newton's on.
    fn settle(&self, spots: &mut Spots, (target, tolerance): (f64, f64), steps: &mut usize) -> (Stop, f64) {
        loop {
            let mut balance = EquilibriumSolver::new(spots, target);
            let mut residual = balance.residual(spots);
            if residual <= tolerance && !spots.merge() {
                return (Stop::Converged, residual);
            }
            let begun = *steps;
            while residual > tolerance {
                // Spots that have come to lie on each other compete for one place, without end.
                if *steps - begun >= PATIENCE && spots.merge() {
                    break;
                }
                if *steps >= self.problem.max_iterations {
                    return (Stop::IterationLimit, residual);
                }
                let step = Iteration { iteration: *steps, residual, tolerance, grid_fraction: 1.0 };
                if self.observer.iteration(step).is_break() {
                    return (Stop::Interrupted, residual);
                }
                balance.step(spots);
                *steps += 1;
                residual = balance.residual(spots);
                if !residual.is_finite() {
                    return (Stop::Diverged, residual);
                }
            }
        }
    }

    /// Steps of the load up to a pressure: how the last one ended, what it missed and what it may miss. What the steps before it
    /// leave is kept for the next load.
    fn raise(&mut self, target: f64) -> (Spots, (Stop, f64, f64), usize) {
        let mut steps = 0;
        if self.step > 0 && self.step_pressure(self.step - 1) > target {
            (self.spots, self.step) = (self.fresh.clone(), 0);
        }
        let mut spots = self.spots.clone();
        spots.transformed = 0.0;
        while self.step_pressure(self.step) < target {
            let (stop, residual) = self.settle(&mut spots, (self.step_pressure(self.step), ON_THE_WAY), &mut steps);
            if stop != Stop::Converged {
                return (spots, (stop, residual, ON_THE_WAY), steps);
            }
            self.step += 1;
            self.spots = spots.clone();
        }
        let (stop, residual) = self.settle(&mut spots, (target, SETTLED), &mut steps);
        (spots, (stop, residual, SETTLED), steps)
    }
}

impl Estimator for Path<'_> {
    fn estimate(&mut self, load: Load) -> Result<Estimate<'_>> {
        let clock = Instant::now();
        let pressure = require::pressure(load, false, CARD.id)?;
        let (spots, (stop, residual, tolerance), iterations) = self.raise(pressure);
        let Grid { lx, ly, .. } = spots.grid;
        let touching: Vec<Asperity> = spots.all.iter().copied().filter(|s| s.approach > 0.0).collect();
        // Summits so wide that one of them takes in the whole cell are none.
        let widest = touching.iter().map(Asperity::spot).fold(0.0, f64::max);
        if widest >= lx.max(ly) {
            let accepted = "a smaller one, or a surface of more summits: a single spot has become as large as the cell";
            return Err(require::refused(CARD.id, "pressure", pressure, accepted));
        }
        let painted = touching.iter().map(|s| Spot { x: s.x, y: s.y, radius: s.spot(), press: s.load(), pull: 0.0 });
        paint(spots.grid, painted, &mut self.stress);
        let patches: Vec<f64> = touching.iter().map(Asperity::area).collect();
        Ok(Estimate {
            contact_fraction: (patches.iter().sum::<f64>() / (lx * ly)).min(1.0),
            mean_gap: (widest <= WIDEST * lx.min(ly)).then(|| (self.mean_height - spots.depth).max(0.0)),
            stress: Some(&self.stress),
            patches: Some(patches),
            load_error: (mean(&self.stress) / pressure - 1.0).abs(),
            residual,
            tolerance,
            stop,
            iterations,
            fft_pairs: spots.transformed / spots.grid.points() as f64,
            seconds: clock.elapsed().as_secs_f64(),
            ..Estimate::at(pressure)
        })
    }
}
