//! Boundary elements with integrated adhesion: contact pressure and adhesive pressure are two non-negative fields,
//! computed alternately (Medina & Dini, International Journal of Solids and Structures 51 (2014) 2620; the
//! challenge's FFT-IA).
//!
//! With stress `σ = p_c - p_a` and compliance `C = 1/K` the gap is `g = h - δ + Cσ`. For a given `p_a` the contact
//! pressure minimises `½⟨p_c C p_c⟩ + ⟨p_c (h - C p_a)⟩` among fields that are nowhere negative and carry
//! `p + ⟨p_a⟩`: the constrained conjugate gradients of Polonsky & Keer (Wear 231 (1999) 206), whose approach δ makes
//! the mean gap in contact zero. Then `p_a` is relaxed towards the adhesive pressure of the law at that gap. The
//! inner iteration is no more accurate than the outer one needs. The adhesive pressure of a node is that of the
//! piecewise linear surface around it, integrated exactly ([`element`]), and therefore smooth where a pointwise law
//! changes abruptly from node to node.

mod element;

use crate::prelude::*;
use asperity_contact::interface::Exponential;
use asperity_contact::method::fields::{Convolution, Symbol, add, each, inner, means};
use rayon::prelude::*;

pub(super) struct FftIa;

static CARD: MethodCard = MethodCard {
    id: "fft-ia",
    paper_name: "FFT-IA",
    family: "boundary value",
    kind: MethodKind::Solver,
    needs: Needs::Heights,
    criterion: Criterion::ZeroGapAndStress,
    calibrated_on: None,
    summary: "alternating contact and adhesive pressure, adhesion integrated over the elements",
    supports: asperity_contact::method::card::fields,
    capabilities: Capabilities::NONE,
    dois: &["10.1007/s11249-017-0900-2", "10.1016/S0043-1648(99)00113-1"],
    papers: &["Medina & Dini, Int. J. Solids Struct. 51 (2014) 2620"],
    measured_errors: None,
};

/// Error of the inner iteration over the change of the outer one.
const INNER: f64 = 0.1;

/// Inner iterations per update of the adhesive pressure at most.
const INNER_MOST: usize = 400;

impl ContactMethod for FftIa {
    fn card(&self) -> &'static MethodCard {
        &CARD
    }

    fn plan(&self, problem: &ReducedProblem) -> SolvePlan {
        let grid = problem.grid;
        // Heights, both pressures, gap, direction, its response, stress and traction; two symbols.
        let bytes = 8 * (grid.points() * size_of::<f64>()) as u64 + Convolution::bytes(grid, 2);
        let iterations = (12.0 * (grid.nx.max(grid.ny) as f64).sqrt()) as usize * problem.adhesion_effort();
        SolvePlan { bytes, iterations, pairs_per_iteration: 2.0, seconds: 0.0 }
    }

    fn prepare<'p>(&self, problem: &'p ReducedProblem<'p>, observer: &'p dyn Observer) -> Result<StartedMethod<'p>> {
        let heights = fields::heights(problem, CARD.id)?;
        if problem.wall != Wall::Hard {
            return Err(require::refused(CARD.id, "wall", problem.wall, "the hard wall"));
        }
        let law = match problem.adhesion {
            AttractionLaw::None => None,
            AttractionLaw::Exponential(law) => Some(law),
            other => return Err(require::refused(CARD.id, "adhesion", other, "none or the exponential law")),
        };
        let relaxation = problem.settings.fft_ia.relaxation;
        if !(relaxation > 0.0 && relaxation <= 1.0) {
            return Err(require::refused(CARD.id, "fft-ia.relaxation", relaxation, "above 0 and up to 1"));
        }
        let convolution = Convolution::new(problem.grid);
        let kernel = problem.kernel;
        let stiffness = convolution.symbol(|qx, qy| kernel.stiffness(qx, qy));
        // The mean mode has neither stiffness nor compliance: the approach is free.
        let points = (problem.grid.points() as f64).powi(2);
        let compliance = stiffness.map(|k| if k > 0.0 { 1.0 / (points * k) } else { 0.0 });
        let zero = || vec![0.0; heights.len()];
        Ok(StartedMethod::Solver(Box::new(FftIaRun {
            problem,
            observer,
            law,
            relaxation,
            rms_height: rms(&heights),
            convolution,
            stiffness,
            compliance,
            contact: zero(),
            adhesive: zero(),
            gap: zero(),
            direction: zero(),
            response: zero(),
            stress: zero(),
            traction: zero(),
            gap_is_set: false,
            heights,
        })))
    }
}

struct FftIaRun<'p> {
    problem: &'p ReducedProblem<'p>,
    observer: &'p dyn Observer,
    law: Option<Exponential>,
    relaxation: f64,
    heights: Vec<f64>,
    rms_height: f64,
    convolution: Convolution,
    stiffness: Symbol,
    compliance: Symbol,
    /// `p_c`, and `p_a` below.
    contact: Vec<f64>,
    adhesive: Vec<f64>,
    gap: Vec<f64>,
    direction: Vec<f64>,
    response: Vec<f64>,
    /// `p_c - p_a`; for the residuals, the elastic stress plus pressure of the gap.
    stress: Vec<f64>,
    traction: Vec<f64>,
    /// Whether the next load starts from a gap that was set.
    gap_is_set: bool,
}

/// Scales a pressure to the mean `target`; uniform if it has none.
fn scale_to(contact: &mut [f64], target: f64) {
    let [carried] = means(contact.len(), |i| [contact[i]]);
    if carried > 0.0 {
        each(contact, |_, p| p * target / carried);
    } else {
        contact.fill(target);
    }
}

/// Outcome of an inner iteration.
enum InnerOutcome {
    Done(usize),
    Interrupted,
    /// No contact pressure is needed: the adhesive pressure is smaller than the tension.
    Separated,
}

impl FftIaRun<'_> {
    /// Sets the gap of the present pressures without the approach. Returns the approach, which makes the mean gap in
    /// contact zero.
    fn approach(&mut self) -> f64 {
        let FftIaRun { convolution, compliance, contact, adhesive, stress, gap, heights, .. } = self;
        each(stress, |i, _| contact[i] - adhesive[i]);
        convolution.apply(compliance, stress, gap);
        add(gap, 1.0, heights);
        let [closed, sum] = means(gap.len(), |i| if contact[i] > 0.0 { [1.0, gap[i]] } else { [0.0; 2] });
        if closed > 0.0 { sum / closed } else { lowest(gap) }
    }

    /// Contact pressure with the mean `target` (Polonsky & Keer), until the rms error of the gap is below `tolerance`.
    fn contact(&mut self, target: f64, tolerance: f64) -> InnerOutcome {
        if target <= 0.0 {
            return InnerOutcome::Separated;
        }
        scale_to(&mut self.contact, target);
        self.direction.fill(0.0);
        let mut approach = self.approach();
        each(&mut self.gap, |_, g| g - approach);
        let (mut previous, mut conjugate) = (1.0, false);
        for iteration in 0..INNER_MOST {
            if self.observer.stop_requested() {
                return InnerOutcome::Interrupted;
            }
            let FftIaRun { contact, gap, direction, response, convolution, compliance, .. } = self;
            // Errors: gap in contact, overlap elsewhere.
            let [closed, square, overlap] = means(gap.len(), |i| {
                let g = gap[i];
                if contact[i] > 0.0 { [1.0, g * g, 0.0] } else { [0.0, 0.0, g.min(0.0).powi(2)] }
            });
            if (square + overlap).sqrt() <= tolerance {
                return InnerOutcome::Done(iteration);
            }
            let beta = if conjugate { square / previous } else { 0.0 };
            previous = square;
            each(direction, |i, d| if contact[i] > 0.0 { gap[i] + beta * d } else { 0.0 });
            convolution.apply(compliance, direction, response);
            let [middle] = means(gap.len(), |i| [if contact[i] > 0.0 { response[i] } else { 0.0 }]);
            let middle = middle / closed;
            let [along, curvature] = means(gap.len(), |i| {
                if contact[i] > 0.0 { [gap[i] * direction[i], (response[i] - middle) * direction[i]] } else { [0.0; 2] }
            });
            let step = if curvature > 0.0 { along / curvature } else { 0.0 };
            // Tensile pressures are set to zero; overlapping nodes come into contact.
            let [grown] = means(gap.len(), |i| [f64::from(u8::from(contact[i] <= 0.0 && gap[i] < 0.0))]);
            each(contact, |i, p| {
                if p > 0.0 {
                    (p - step * direction[i]).max(0.0)
                } else if gap[i] < 0.0 {
                    -step * gap[i]
                } else {
                    0.0
                }
            });
            conjugate = grown == 0.0;
            scale_to(contact, target);
            approach = self.approach();
            each(&mut self.gap, |_, g| g - approach);
        }
        InnerOutcome::Done(INNER_MOST)
    }

    /// Adhesive pressure of the law at the present gap.
    fn adhesive_pressure(&mut self) {
        let FftIaRun { law, gap, traction, problem, .. } = self;
        match law {
            None => traction.fill(0.0),
            Some(law) => {
                let nodes = traction.par_iter_mut().enumerate();
                nodes.for_each(|(i, t)| *t = element::traction(problem.grid, *law, gap, i));
            }
        }
    }
}

impl SolverRun for FftIaRun<'_> {
    fn set_gap(&mut self, gap: &[f64]) {
        self.gap.copy_from_slice(gap);
        self.gap_is_set = true;
    }

    fn equilibrate(&mut self, load: Load) -> Result<Equilibrium<'_>> {
        let problem = self.problem;
        let pressure = require::pressure(load, self.law.is_some(), CARD.id)?;
        // A separation is detected by the search for the contact pressure, not by the range.
        let rms_height = self.rms_height;
        let case = LoadCase { pressure, range: 0.0, rms_height, hard: true };
        let mut control = IterationControl::new(problem, self.observer, case);
        let scale = control.scale;
        let fft_pairs_before = self.convolution.fft_pairs;
        if std::mem::take(&mut self.gap_is_set) {
            // Pressures in equilibrium with it.
            let FftIaRun { heights, gap, stress, adhesive, convolution, stiffness, .. } = self;
            each(adhesive, |i, _| gap[i] - heights[i]);
            convolution.apply(stiffness, adhesive, stress);
            self.adhesive_pressure();
            self.adhesive.copy_from_slice(&self.traction);
            let FftIaRun { contact, stress, adhesive, gap, .. } = self;
            each(contact, |i, _| if gap[i] <= 0.0 { (stress[i] + pressure + adhesive[i]).max(0.0) } else { 0.0 });
        }
        let mut change = 1.0_f64;
        let stiffest = problem.stiffest_mode();
        let (ending, residuals) = loop {
            let [pulled] = means(self.adhesive.len(), |i| [self.adhesive[i]]);
            // As accurate as the adhesive pressure and, at the end, as the tolerance: an error of the gap times a
            // stiffness is an error of the stress.
            let inner_tolerance = (INNER * change).clamp(0.1 * problem.tolerance, 1e-2) * scale / stiffest;
            let inner_stop = self.contact(pressure + pulled, inner_tolerance);
            // The gap of the state: closed where the contact pressure is positive, open elsewhere.
            let FftIaRun { gap, contact, .. } = self;
            each(gap, |i, g| if contact[i] > 0.0 { 0.0 } else { g.max(0.0) });
            self.adhesive_pressure();
            let FftIaRun { gap, heights, stress, traction, adhesive, convolution, stiffness, direction, .. } = self;
            each(direction, |i, _| gap[i] - heights[i]);
            convolution.apply(stiffness, direction, stress);
            let elastic = 0.5 * inner(direction, stress);
            each(stress, |_, s| s + pressure);
            let [energy] = match self.law {
                None => [0.0],
                Some(law) => means(gap.len(), |i| [element::energy(problem.grid, law, gap, i)]),
            };
            let residuals = fields::residuals(gap, stress, traction, true, (elastic, energy));
            let [missing] = means(gap.len(), |i| [(traction[i] - adhesive[i]).powi(2)]);
            change = missing.sqrt() / scale;
            control.record(&residuals);
            match inner_stop {
                InnerOutcome::Separated => break (Ending::Stopped(Stop::Detached), residuals),
                InnerOutcome::Interrupted => break (Ending::Stopped(Stop::Interrupted), residuals),
                InnerOutcome::Done(n) => control.iterations += n + 1,
            }
            if control.converged(&residuals) {
                break (Ending::Met, residuals);
            }
            if let Some(ending) = control.failed(&residuals) {
                break (ending, residuals);
            }
            if control.interrupted(&residuals) {
                break (Ending::Stopped(Stop::Interrupted), residuals);
            }
            // Without adhesion only the inner iteration continues, with a smaller tolerance.
            if self.law.is_none() {
                change =
                    (INNER * control.relative(&residuals)).min(0.1 * change.max(inner_tolerance * stiffest / scale));
            }
            let relaxation = self.relaxation;
            each(adhesive, |i, a| a + relaxation * (traction[i] - a));
        };
        let FftIaRun { stress, contact, adhesive, .. } = self;
        each(stress, |i, _| contact[i] - adhesive[i]);
        let fft_pairs = self.convolution.fft_pairs - fft_pairs_before;
        Ok(control.finish(ending, residuals, fft_pairs).state(&self.gap, &self.stress))
    }
}
