use crate::interface::Adhesion;
use crate::method::{Card, ContactMethod, Estimate, Load, Needs, Observer, Plan, Problem, Stop};
use crate::surface::PowerSpectrum;
use crate::{Error, Result};

/// What a method that estimates is given of a problem.
pub struct EstimatorInput<'a> {
    asked: Problem<'a>,
    method: &'static dyn ContactMethod,
    /// Of the surface, for a method that needs no more of it.
    power: Option<PowerSpectrum>,
}

impl<'a> EstimatorInput<'a> {
    /// What a method takes of a problem, its power where it needs that, before anything is taken.
    pub fn plan(asked: &Problem, method: &dyn ContactMethod) -> Plan {
        let own = method.plan(asked);
        match method.card().needs {
            Needs::Heights => own,
            Needs::Spectrum => Plan { bytes: own.bytes + asked.power_bytes(), ..own },
        }
    }

    /// # Errors
    /// `Memory` before anything is taken.
    pub fn new(asked: Problem<'a>, method: &'static dyn ContactMethod) -> Result<Self> {
        let (need, have) = (Self::plan(&asked, method).bytes, crate::sys::available_memory_bytes());
        if need > have {
            let what = method.card().id.into();
            return Err(Error::Memory { what, need, have, advice: "a coarser grid needs less".into() });
        }
        let power = (method.card().needs == Needs::Spectrum).then(|| asked.power_of_heights()).transpose()?;
        Ok(EstimatorInput { asked, method, power })
    }

    /// The problem as the method sees it: what it does not need it is not given.
    pub fn problem(&self) -> Problem<'_> {
        match &self.power {
            Some(power) => Problem { power: Some(power), heights: (&[][..]).into(), ..self.asked.clone() },
            None => self.asked.clone(),
        }
    }

    pub fn method(&self) -> &'static dyn ContactMethod {
        self.method
    }

    /// The law that the method works with, where it is not the problem's own.
    pub fn changed_adhesion(&self) -> Option<Adhesion> {
        Some(self.method.adhesion(&self.asked)).filter(|used| *used != self.asked.adhesion)
    }

    pub fn card(&self) -> &'static Card {
        self.method.card()
    }

    /// Estimates load by load, but for the first `known` ones; `visit` is given each with the problem. The first that is none
    /// ends the path.
    ///
    /// # Errors
    /// The method's, for what it cannot do; `NotConverged`; `visit`'s.
    pub fn walk(
        &self,
        (loads, known): (&[Load], usize),
        observer: &dyn Observer,
        mut visit: impl FnMut(usize, &Problem, &Estimate) -> Result<()>,
    ) -> Result<()> {
        let problem = self.problem();
        let id = self.method.card().id;
        let mut run = self.method.start(&problem, observer)?.estimator()?;
        // After the last load nothing follows.
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
