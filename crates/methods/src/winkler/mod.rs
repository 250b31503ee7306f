//! Winkler foundation with dilation (Müser et al., Tribology Letters 65 (2017) 118, section 3): bearing area on
//! independent springs, with patches enlarged to twice their area.
//!
//! Springs are compressed where the undeformed bodies overlap: `p(r) = κ (d - h(r))₊` at the approach `d`. The
//! foundation modulus is `κ = E*/λ`; the paper prints `k = E*ḡ λ`, which has other units, and with a factor ḡ areas
//! would not be a function of p/(E*ḡ) alone, as for every linear body. Contact is the patches of overlap enlarged to
//! twice their area. For a paraboloid tensile springs in the enlarged patch would cancel the load, so only the
//! overlap carries load. Elsewhere the gap is the undeformed one.

mod growth;

use crate::prelude::*;
use asperity_contact::method::settings::WinklerSettings;
use asperity_grid::sum_rows;
use std::borrow::Cow;

pub(super) struct Winkler;

static CARD: MethodCard = MethodCard {
    id: "winkler",
    paper_name: "Winkler",
    family: "bearing area",
    kind: MethodKind::Estimate,
    needs: Needs::Heights,
    criterion: Criterion::Overlap,
    calibrated_on: Some("3 % of contact at p* = 0.01 on surfaces of another generator (spring length λ)"),
    summary: "independent springs; overlap patches enlarged to twice their area",
    supports,
    capabilities: Capabilities::NONE,
    dois: &["10.1007/s11249-017-0900-2"],
    papers: &[],
    measured_errors: Some(&MEASURED),
};

static ERRORS: [MeasuredError; 2] = [MeasuredError::of_area(1.05), MeasuredError::of_open_gap(2.49)];
static MEASURED: MeasuredErrors = MeasuredErrors::on_the_challenge(&ERRORS, false);

fn supports(quantity: Quantity) -> Support {
    use Quantity::*;
    match quantity {
        Stiffness => Support::Only("as differences between loads"),
        GapMap | GapPdf | MeanGap => Support::Only("undeformed gap, without adhesion"),
        StressMap | StressPdf => Support::Only("springs in the overlap, without adhesion"),
        _ => Support::NoAdhesion,
    }
}

/// λ/L for a contact fraction of 3 % at p* = 0.01 on surfaces with the challenge's spectrum: 0.0034 ± 0.0004 on six
/// surfaces of another generator, 0.0043 ± 0.0011 on eight of this one (1024² points; 0.0079 without dilation). The
/// paper gives 1 µm of 100 µm.
const WAVELENGTH: f64 = 0.0034;

/// p* of the calibration, the reference load of the challenge.
const REFERENCE: f64 = 0.01;

/// Largest relative error of a calibrated area, on surfaces with steps.
const REACHED: f64 = 0.1;

/// Relative load balance, limited by rounding.
const BALANCE: f64 = 1e-13;

/// Processor time of a load, measured by the benchmark `measure`; an order of magnitude.
const SECONDS_PER_POINT: f64 = 5e-7;

impl ContactMethod for Winkler {
    fn card(&self) -> &'static MethodCard {
        &CARD
    }

    fn calibrated_on(&self, settings: &Settings) -> Option<&'static str> {
        match settings.winkler {
            WinklerSettings { spring_length: Some(_), .. } => None,
            WinklerSettings { calibrate_to: Some(_), .. } => {
                Some("contact area at p* = 0.01 in winkler.calibrate_to (spring length λ)")
            }
            _ => CARD.calibrated_on,
        }
    }

    fn plan(&self, problem: &ReducedProblem) -> SolvePlan {
        // Heights, gap and stress, the map, labels and their parents, nearest nodes and their order.
        SolvePlan::per_point(problem, 3 * 8 + 1 + 4 * 4, 10, SECONDS_PER_POINT)
    }

    fn prepare<'p>(&self, problem: &'p ReducedProblem<'p>, observer: &'p dyn Observer) -> Result<StartedMethod<'p>> {
        require::half_space(problem, CARD.id)?;
        require::hard_wall(problem, CARD.id)?;
        require::no_adhesion(problem, CARD.id)?;
        let heights = require::heights_above_lowest(problem);
        let length = spring_length(problem, &heights)?;
        let (contact, gap, stress) = (Vec::new(), Vec::new(), Vec::new());
        Ok(estimating(Springs { problem, observer, heights, length, contact, gap, stress }))
    }
}

/// λ from the settings, by calibration, or the default.
fn spring_length(problem: &ReducedProblem, heights: &[f64]) -> Result<f64> {
    let settings = problem.settings.winkler;
    match (settings.spring_length, settings.calibrate_to) {
        (Some(_), Some(area)) => {
            let accepted = "either winkler.calibrate_to or winkler.spring_length";
            Err(require::refused(CARD.id, "winkler.calibrate_to", area, accepted))
        }
        (Some(length), None) => require::positive(length, CARD.id, "winkler.spring_length"),
        (None, Some(area)) => calibrated(problem, heights, area),
        (None, None) => Ok(WAVELENGTH),
    }
}

/// λ for which this surface has the contact fraction `area` at p* = 0.01. Dilation doubles areas, so half of it must
/// overlap: the approach is a quantile of the heights, and λ follows from the load.
fn calibrated(problem: &ReducedProblem, heights: &[f64], area: f64) -> Result<f64> {
    let refuse = |accepted: &str| Err(require::refused(CARD.id, "winkler.calibrate_to", area, accepted));
    let pressure = REFERENCE * problem.resolved_gradient();
    let nodes = (0.5 * area * heights.len() as f64).round();
    if !(area > 0.0 && area < 1.0) || nodes < 1.0 {
        return refuse("a contact fraction above that of two nodes and below 1");
    }
    if pressure <= 0.0 {
        return refuse("winkler.spring_length: a flat surface cannot be calibrated");
    }
    let mut sorted = heights.to_vec();
    let (lower, above, _) = sorted.select_nth_unstable_by(nodes as usize, f64::total_cmp);
    let depth = *above;
    let touching = 2.0 * lower.iter().filter(|h| **h < depth).count() as f64 / heights.len() as f64;
    if (touching / area - 1.0).abs() > REACHED {
        return refuse(&format!("{touching:.3e} or another area between the steps of this surface"));
    }
    Ok(overlap(problem.grid.nx, heights, depth).0 / pressure)
}

/// Mean of `(depth - h)₊`, and the fraction of nodes where it is positive.
fn overlap(nx: usize, heights: &[f64], depth: f64) -> (f64, f64) {
    let [sum, count] = sum_rows(heights.len() / nx, |y| {
        heights[y * nx..][..nx]
            .iter()
            .fold([0.0; 2], |[sum, count], h| if *h < depth { [sum + (depth - h), count + 1.0] } else { [sum, count] })
    });
    (sum / heights.len() as f64, count / heights.len() as f64)
}

struct Springs<'p> {
    problem: &'p ReducedProblem<'p>,
    observer: &'p dyn Observer,
    /// Above the lowest node.
    heights: Cow<'p, [f64]>,
    length: f64,
    contact: Vec<u8>,
    gap: Vec<f64>,
    stress: Vec<f64>,
}

impl Springs<'_> {
    /// Approach, from first contact, at which the mean overlap is `target`; stop reason; iterations. The mean overlap
    /// is convex and piecewise linear in the approach, so Newton steps from above converge monotonically.
    fn approach(&self, target: f64) -> (f64, Stop, usize) {
        // An upper bound by Jensen's inequality.
        let mut depth = mean(&self.heights) + target;
        for iteration in 0..self.problem.max_iterations {
            let (overlap_volume, fraction) = overlap(self.problem.grid.nx, &self.heights, depth);
            let residual = (overlap_volume - target) / target;
            let step = Iteration { iteration, residual: residual.abs(), tolerance: BALANCE, grid_fraction: 1.0 };
            let next = depth - (overlap_volume - target) / fraction;
            if residual <= BALANCE || next >= depth {
                return (depth, Stop::Converged, iteration);
            }
            if self.observer.iteration(step).is_break() {
                return (depth, Stop::Interrupted, iteration);
            }
            depth = next;
        }
        (depth, Stop::IterationLimit, self.problem.max_iterations)
    }
}

impl Estimator for Springs<'_> {
    fn estimate(&mut self, load: Load) -> Result<MethodEstimate<'_>> {
        let clock = Instant::now();
        let pressure = require::pressure(load, false, CARD.id)?;
        let (depth, stop, iterations) = self.approach(pressure * self.length);
        self.stress.clear();
        self.stress.extend(self.heights.iter().map(|h| (depth - h).max(0.0) / self.length));
        self.contact.clear();
        self.contact.extend(self.stress.iter().map(|s| u8::from(*s > 0.0)));
        growth::double(self.problem.grid, &mut self.contact);
        require::undeformed_gap(&self.heights, depth, &mut self.gap);
        self.gap.iter_mut().zip(&self.contact).filter(|(_, c)| **c != 0).for_each(|(g, _)| *g = 0.0);
        let touching = self.contact.iter().map(|c| usize::from(*c)).sum::<usize>();
        Ok(MethodEstimate {
            contact_area: touching as f64 / self.contact.len() as f64,
            mean_gap: Some(mean(&self.gap)),
            contact: Some(&self.contact),
            gap: Some(&self.gap),
            stress: Some(&self.stress),
            load_error: (mean(&self.stress) / pressure - 1.0).abs(),
            stop,
            iterations,
            seconds: clock.elapsed().as_secs_f64(),
            ..MethodEstimate::at(pressure)
        })
    }
}
