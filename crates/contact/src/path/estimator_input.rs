use crate::interface::AttractionLaw;
use crate::method::{
    ContactMethod, Heights, Load, MethodCard, MethodEstimate, Needs, Observer, ProblemScale, ReducedProblem,
    ScaledHeights, SolvePlan, Stop,
};
use asperity_grid::Field;
use asperity_grid::sys::expect_memory;
use asperity_grid::{Error, Result};
use asperity_surface::PowerSpectrum;

/// Input of an estimator: only what its card declares it needs.
pub struct EstimatorInput<'a> {
    problem: ReducedProblem<'a>,
    method: &'static dyn ContactMethod,
    /// Unit in which the method works, and the heights in it where it is not 1.
    scale: ProblemScale,
    scaled: Option<ScaledHeights>,
    /// Power spectrum of the surface in that unit, for methods that need no heights.
    power: Option<PowerSpectrum>,
}

impl<'a> EstimatorInput<'a> {
    /// Planned memory of the method, including the power spectrum if the method needs it.
    pub fn plan(problem: &ReducedProblem, method: &dyn ContactMethod) -> SolvePlan {
        let own = method.plan(problem);
        match method.card().needs {
            Needs::Heights => own,
            Needs::Spectrum => SolvePlan { bytes: own.bytes + problem.power_bytes(), ..own },
        }
    }

    /// # Errors
    /// `Memory` if the estimate needs more than the available memory; nothing has been allocated then.
    pub fn new(problem: ReducedProblem<'a>, method: &'static dyn ContactMethod) -> Result<Self> {
        let required = Self::plan(&problem, method).bytes;
        expect_memory(method.card().id.into(), required, "a coarser grid needs less")?;
        let scale = ProblemScale::of(&problem.heights);
        let scaled = (!scale.is_one()).then(|| scale.heights(&problem.heights));
        let power = (method.card().needs == Needs::Spectrum)
            .then(|| match &scaled {
                Some(heights) => scale.problem(&problem, heights).power_of_heights(),
                None => problem.power_of_heights(),
            })
            .transpose()?;
        Ok(EstimatorInput { problem, method, scale, scaled, power })
    }

    /// The problem in the unit of the method, without the data that it does not need.
    fn problem(&self) -> ReducedProblem<'_> {
        let problem = match &self.scaled {
            Some(heights) => self.scale.problem(&self.problem, heights),
            None => self.problem.clone(),
        };
        match &self.power {
            Some(power) => ReducedProblem { power: Some(power), heights: Heights::Planned(None), ..problem },
            None => problem,
        }
    }

    /// The adhesion that the method uses, if it differs from the problem's.
    pub fn changed_adhesion(&self) -> Option<AttractionLaw> {
        Some(self.method.adhesion(&self.problem)).filter(|used| *used != self.problem.adhesion)
    }

    pub fn card(&self) -> &'static MethodCard {
        self.method.card()
    }

    /// Estimates all loads in order, except the first `known` ones, and passes each result to `visit`. The path ends at
    /// the first load that does not converge.
    ///
    /// # Errors
    /// Unsupported loads, `NotConverged`, and the errors of `visit`.
    pub fn walk(
        &self,
        (loads, known): (&[Load], usize),
        observer: &dyn Observer,
        mut visit: impl FnMut(usize, &ReducedProblem, &MethodEstimate) -> Result<()>,
    ) -> Result<()> {
        let problem = self.problem();
        let scale = self.scale;
        // In the unit of the method.
        let scaled_loads = scale.loads(&self.problem, loads)?;
        let id = self.method.card().id;
        let mut run = self.method.start(&problem, observer)?.estimator()?;
        // The method needs previous loads only if further loads follow.
        if known < loads.len() {
            scaled_loads[..known].iter().try_for_each(|&load| run.replay(load))?;
        }
        for (i, &load) in scaled_loads.iter().enumerate().skip(known) {
            let estimate = run.estimate(load)?;
            match estimate.stop {
                Stop::Converged if scale.is_one() => visit(i, &problem, &estimate)?,
                Stop::Converged => {
                    let fields = [estimate.gap, estimate.stress].map(|f| f.map(|f| scale.field(Field::F64(f))));
                    let estimate = scale.estimate(&estimate, loads[i], [fields[0].as_deref(), fields[1].as_deref()]);
                    visit(i, &self.problem, &estimate)?;
                }
                Stop::Interrupted => return Err(Error::Interrupted),
                stop => {
                    return Err(Error::NotConverged {
                        method: id,
                        why: stop.to_string(),
                        iterations: estimate.iterations,
                        residual: estimate.residual,
                        tolerance: estimate.tolerance,
                        partial: None,
                    });
                }
            }
        }
        Ok(())
    }
}
