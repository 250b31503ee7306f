use crate::interface::Adhesion;
use crate::method::{Card, ContactMethod, Estimate, Load, Needs, Observer, Plan, Problem, Stop};
use crate::surface::PowerSpectrum;
use crate::{Error, Result};

/// Input of an estimator: only what its card declares it needs.
pub struct EstimatorInput<'a> {
    asked: Problem<'a>,
    method: &'static dyn ContactMethod,
    /// Power spectrum of the surface, for methods that need no heights.
    power: Option<PowerSpectrum>,
}

impl<'a> EstimatorInput<'a> {
    /// Planned memory of the method, including the power spectrum if the method needs it.
    pub fn plan(asked: &Problem, method: &dyn ContactMethod) -> Plan {
        let own = method.plan(asked);
        match method.card().needs {
            Needs::Heights => own,
            Needs::Spectrum => Plan { bytes: own.bytes + asked.power_bytes(), ..own },
        }
    }

    /// # Errors
    /// `Memory` if the estimate needs more than the available memory; nothing has been allocated then.
    pub fn new(asked: Problem<'a>, method: &'static dyn ContactMethod) -> Result<Self> {
        let (need, have) = (Self::plan(&asked, method).bytes, crate::sys::available_memory_bytes());
        if need > have {
            let what = method.card().id.into();
            return Err(Error::Memory { what, need, have, advice: "a coarser grid needs less".into() });
        }
        let power = (method.card().needs == Needs::Spectrum).then(|| asked.power_of_heights()).transpose()?;
        Ok(EstimatorInput { asked, method, power })
    }

    /// The problem without the data that the method does not need.
    pub fn problem(&self) -> Problem<'_> {
        match &self.power {
            Some(power) => Problem { power: Some(power), heights: (&[][..]).into(), ..self.asked.clone() },
            None => self.asked.clone(),
        }
    }

    pub fn method(&self) -> &'static dyn ContactMethod {
        self.method
    }

    /// The adhesion that the method uses, if it differs from the problem's.
    pub fn changed_adhesion(&self) -> Option<Adhesion> {
        Some(self.method.adhesion(&self.asked)).filter(|used| *used != self.asked.adhesion)
    }

    pub fn card(&self) -> &'static Card {
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
        mut visit: impl FnMut(usize, &Problem, &Estimate) -> Result<()>,
    ) -> Result<()> {
        let problem = self.problem();
        let id = self.method.card().id;
        let mut run = self.method.start(&problem, observer)?.estimator()?;
        // The method needs previous loads only if further loads follow.
        if known < loads.len() {
            loads[..known].iter().try_for_each(|&load| run.replay(load))?;
        }
        for (i, &load) in loads.iter().enumerate().skip(known) {
            let found = run.estimate(load)?;
            match found.stop {
                Stop::Converged => visit(i, &problem, &found)?,
                Stop::Interrupted => return Err(Error::Interrupted),
                stop => {
                    return Err(Error::NotConverged {
                        method: id,
                        why: stop.to_string(),
                        iterations: found.iterations,
                        residual: found.residual,
                        tolerance: found.tolerance,
                        partial: None,
                    });
                }
            }
        }
        Ok(())
    }
}
