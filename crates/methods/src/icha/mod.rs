//! Interacting and coalescing Hertzian asperities (Afferrante, Carbone & Demelio, Wear 278-279 (2012) 28; Afferrante,
//! Bottiglione, Putignano, Persson & Carbone, Tribology Letters 66 (2018) 75).
//!
//! Every summit is a Hertzian sphere whose approach is reduced by the displacement due to all other spots.
//! Overlapping spots merge into one of the same area and load. The load increases in small steps, since merging is
//! irreversible. Displacements are those of the periodic half-space with zero mean: closed form of one spot plus
//! Ewald sums over images. The mean gap is therefore the mean height minus the approach, which the published method
//! cannot give, as its approach has no zero. It includes overlap of the bodies away from summits as negative gap.

mod equilibrium;
mod ewald;
mod images;
mod spots;

use crate::prelude::*;
use crate::spots::{Spot, paint};
use asperity_surface::SummitFit;
use equilibrium::EquilibriumSolver;
use spots::{Asperity, Spots};

pub(super) struct Icha;

static CARD: MethodCard = MethodCard {
    id: "icha",
    paper_name: "ICHA",
    family: "single asperities",
    kind: MethodKind::Estimate,
    needs: Needs::Heights,
    criterion: Criterion::Spots,
    calibrated_on: None,
    summary: "elastically interacting Hertz contacts that merge where they overlap",
    supports,
    capabilities: Capabilities::NONE,
    dois: &["10.1007/s11249-017-0900-2", "10.1007/s11249-018-1026-x"],
    papers: &["Afferrante, Carbone & Demelio, Wear 278-279 (2012) 28"],
    measured_errors: Some(&MEASURED),
};

static ERRORS: [MeasuredError; 2] = [MeasuredError::of_area(0.56), MeasuredError::of_mean_gap(0.028, 4)];
static MEASURED: MeasuredErrors = MeasuredErrors::on_the_challenge(&ERRORS, false);

fn supports(quantity: Quantity) -> Support {
    use Quantity::*;
    match quantity {
        ContactArea => Support::NoAdhesion,
        ClusterPdf | ClusterArea | MedianClusterArea => Support::Only("merged discs, without adhesion"),
        MeanGap => Support::Only(
            "from the approach, without adhesion, up to a fifth of the cell in contact; overlap away from summits is not prevented",
        ),
        StressMap | StressPdf => Support::Only("superposed Hertz profiles, without adhesion"),
        Stiffness => Support::Only("as differences between loads"),
        ContactMap => Support::No("contact spots are areas without nodes"),
        GapMap | GapPdf => Support::No("the gap is known only at summits"),
    }
}

/// p* of the first step, at which only the first summit of a typical surface is in contact.
const FIRST: f64 = 1e-6;

/// Tolerance of the relative errors of approaches and load.
const TOLERANCE: f64 = 1e-7;

/// The same for intermediate load steps, which only determine which spots merge.
const INTERMEDIATE_TOLERANCE: f64 = 1e-5;

/// Newton steps after which overlapping spots merge without equilibrium; nearly all solves take fewer than ten.
const PATIENCE: usize = 12;

/// Radius of the widest spot over the shorter side up to which the approach gives the mean gap. For wider spots the
/// periodic images as point loads are inaccurate; above 0.4 the approach decreases with load.
const WIDEST: f64 = 0.25;

/// Contact fraction up to which the approach gives the mean gap. Overlap away from summits counts as negative gap, which makes
/// the mean too small: on eight surfaces by 1 to 11 % at a tenth of the cell in contact, up to 28 % at a fifth, 33 to 83 % at three
/// tenths, and on four of them by all of it before four tenths.
const SPARSE: f64 = 0.2;

/// Processor time of a load over the points, measured by the benchmark `measure`; an order of magnitude.
const SECONDS_PER_POINT: f64 = 7e-6;

impl ContactMethod for Icha {
    fn card(&self) -> &'static MethodCard {
        &CARD
    }

    fn plan(&self, problem: &ReducedProblem) -> SolvePlan {
        // Heights, three lists with one asperity per about 20 nodes, and neighbours of those in contact; for the Fourier fit also a field
        // and a spectrum. Measured without pages of the program: 10, 15 and 16 bytes per point at 512², 1024² and 2048².
        let fourier = u64::from(problem.settings.icha.fit == SummitFit::Fourier);
        SolvePlan::per_point(problem, 8 + 5 + 16 * fourier, 300, SECONDS_PER_POINT)
    }

    fn prepare<'p>(&self, problem: &'p ReducedProblem<'p>, observer: &'p dyn Observer) -> Result<StartedMethod<'p>> {
        require::half_space(problem, CARD.id)?;
        require::hard_wall(problem, CARD.id)?;
        require::no_adhesion(problem, CARD.id)?;
        let settings = problem.settings.icha;
        if !(1..=1000).contains(&settings.steps_per_decade) {
            return Err(require::refused(CARD.id, "icha.steps_per_decade", settings.steps_per_decade, "1 to 1000"));
        }
        let heights = require::heights_above_lowest(problem);
        let summits = require::summits(problem.grid, &heights, (settings.fit, settings.curvature), CARD.id)?;
        let fresh = Spots::new(problem.grid, &summits);
        Ok(estimating(IchaRun {
            problem,
            observer,
            mean_height: mean(&heights),
            first: FIRST * problem.resolved_gradient(),
            spots: fresh.clone(),
            fresh,
            step: 0,
            stress: Vec::new(),
        }))
    }
}

struct IchaRun<'p> {
    problem: &'p ReducedProblem<'p>,
    observer: &'p dyn Observer,
    /// Mean height above the lowest node.
    mean_height: f64,
    /// Pressure of the first step.
    first: f64,
    fresh: Spots,
    /// Spots after the last load step.
    spots: Spots,
    /// Number of load steps so far.
    step: i32,
    stress: Vec<f64>,
}

impl IchaRun<'_> {
    /// Radius of a spot as wide as the cell.
    fn cell(spots: &Spots) -> f64 {
        spots.grid.lx.max(spots.grid.ly)
    }

    fn step_pressure(&self, step: i32) -> f64 {
        self.first * 10f64.powf(f64::from(step) / f64::from(self.problem.settings.icha.steps_per_decade))
    }

    /// Equilibrium at a pressure with all overlapping spots merged: stop reason and residual. Adds the Newton steps
    /// to `steps`.
    fn equilibrate(&self, spots: &mut Spots, (target, tolerance): (f64, f64), steps: &mut usize) -> (Stop, f64) {
        loop {
            let mut solver = EquilibriumSolver::new(spots, target);
            let mut residual = solver.residual(spots);
            if residual <= tolerance && !spots.merge() {
                return (Stop::Converged, residual);
            }
            let start = *steps;
            while residual > tolerance {
                // Coinciding spots would not converge.
                if *steps - start >= PATIENCE && spots.merge() {
                    break;
                }
                if *steps >= self.problem.max_iterations {
                    return (Stop::IterationLimit, residual);
                }
                let step = Iteration { iteration: *steps, residual, tolerance, grid_fraction: 1.0 };
                if self.observer.iteration(step).is_break() {
                    return (Stop::Interrupted, residual);
                }
                solver.step(spots);
                *steps += 1;
                residual = solver.residual(spots);
                if !residual.is_finite() {
                    return (Stop::Diverged, residual);
                }
            }
        }
    }

    /// Load steps up to a pressure. Returns the spots; stop reason, residual and tolerance of the last step; and the
    /// Newton steps. The intermediate steps remain for the next load.
    fn load_to(&mut self, target: f64) -> (Spots, (Stop, f64, f64), usize) {
        let mut steps = 0;
        if self.step > 0 && self.step_pressure(self.step - 1) > target {
            (self.spots, self.step) = (self.fresh.clone(), 0);
        }
        let mut spots = self.spots.clone();
        spots.transformed = 0.0;
        while self.step_pressure(self.step) < target {
            let (stop, residual) =
                self.equilibrate(&mut spots, (self.step_pressure(self.step), INTERMEDIATE_TOLERANCE), &mut steps);
            if stop != Stop::Converged {
                return (spots, (stop, residual, INTERMEDIATE_TOLERANCE), steps);
            }
            self.step += 1;
            self.spots = spots.clone();
            // Refused by the caller; larger loads only widen the spot.
            if widest(&spots) >= Self::cell(&spots) {
                return (spots, (stop, residual, INTERMEDIATE_TOLERANCE), steps);
            }
        }
        let (stop, residual) = self.equilibrate(&mut spots, (target, TOLERANCE), &mut steps);
        (spots, (stop, residual, TOLERANCE), steps)
    }
}

/// Radius of the widest spot.
fn widest(spots: &Spots) -> f64 {
    spots.all.iter().filter(|s| s.approach > 0.0).map(Asperity::spot).fold(0.0, f64::max)
}

impl Estimator for IchaRun<'_> {
    /// The load steps up to the load, so that a path that goes on counts the Newton steps of an uninterrupted one.
    fn replay(&mut self, load: Load) -> Result<()> {
        self.load_to(require::pressure(load, false, CARD.id)?);
        Ok(())
    }

    fn estimate(&mut self, load: Load) -> Result<MethodEstimate<'_>> {
        let clock = Instant::now();
        let pressure = require::pressure(load, false, CARD.id)?;
        let (spots, (stop, residual, tolerance), iterations) = self.load_to(pressure);
        let Grid { lx, ly, .. } = spots.grid;
        let touching: Vec<Asperity> = spots.all.iter().copied().filter(|s| s.approach > 0.0).collect();
        // A spot as wide as the cell is outside the scope of the model.
        let widest = widest(&spots);
        if widest >= Self::cell(&spots) {
            let accepted = "a lower pressure, or a surface with more summits: one contact spot is as large as the cell";
            return Err(require::refused(CARD.id, "pressure", format!("{pressure:e} E*"), accepted));
        }
        let painted = touching.iter().map(|s| Spot { x: s.x, y: s.y, radius: s.spot(), press: s.load(), pull: 0.0 });
        paint(spots.grid, painted, &mut self.stress);
        let clusters: Vec<f64> = touching.iter().map(Asperity::area).collect();
        let area = clusters.iter().sum::<f64>() / (lx * ly);
        let mean_gap = self.mean_height - spots.depth;
        let no_gap = match () {
            () if widest > WIDEST * lx.min(ly) => Some("a contact spot is wider than half of the cell"),
            () if area > SPARSE => {
                Some("more than a fifth of the cell is in contact, and the bodies overlap between the summits")
            }
            () if mean_gap <= 0.0 => {
                Some("the approach exceeds the mean height: the bodies overlap between the summits")
            }
            () => None,
        };
        Ok(MethodEstimate {
            contact_area: require::contact_of_spots(area, pressure, CARD.id)?,
            mean_gap: no_gap.is_none().then_some(mean_gap),
            undelivered: no_gap.map(|reason| (Quantity::MeanGap, reason)).into_iter().collect(),
            stress: Some(&self.stress),
            clusters: Some(clusters),
            load_error: (mean(&self.stress) / pressure - 1.0).abs(),
            residual,
            tolerance,
            stop,
            iterations,
            fft_pairs: spots.transformed / spots.grid.points() as f64,
            seconds: clock.elapsed().as_secs_f64(),
            ..MethodEstimate::at(pressure)
        })
    }
}
