use crate::interface::Adhesion;
use crate::method::{Card, ContactMethod, Estimate, Load, Needs, Plan, Problem, Stop, Watch};
use crate::surface::Power;
use crate::{Error, Result};

/// What a method that estimates is given of a problem.
pub struct Given<'a> {
    asked: Problem<'a>,
    method: &'static dyn ContactMethod,
    /// Of the surface, for a method that needs no more of it.
    power: Option<Power>,
}

impl<'a> Given<'a> {
    /// # Errors
    /// `Memory` where the power of the heights cannot be taken.
    pub fn new(asked: Problem<'a>, method: &'static dyn ContactMethod) -> Result<Self> {
        let power = (method.card().needs == Needs::Spectrum).then(|| asked.power_of_heights()).transpose()?;
        Ok(Given { asked, method, power })
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

    pub fn plan(&self) -> Plan {
        self.method.plan(&self.problem())
    }

    /// Estimates load by load; `visit` is given each with the problem. The first that is none ends the path.
    ///
    /// # Errors
    /// The method's, for what it cannot do; `Memory` before anything is taken; `NotConverged`; `visit`'s.
    pub fn walk(
        &self,
        loads: &[Load],
        watch: &dyn Watch,
        mut visit: impl FnMut(usize, &Problem, &Estimate) -> Result<()>,
    ) -> Result<()> {
        let problem = self.problem();
        let (id, need, have) = (self.method.card().id, self.plan().bytes, crate::sys::available_memory_bytes());
        if need > have {
            return Err(Error::Memory { what: id.into(), need, have, advice: "a coarser grid needs less".into() });
        }
        let mut run = self.method.start(&problem, watch)?.estimator()?;
        for (i, &load) in loads.iter().enumerate() {
            let found = run.estimate(load)?;
            match found.stop {
                Stop::Converged => visit(i, &problem, &found)?,
                Stop::Interrupted => return Err(Error::Interrupted),
                stop => {
                    return Err(Error::NotConverged {
                        method: id,
                        why: stop.to_string(),
                        iterations: found.iterations,
                        residual: found.load_error,
                        tolerance: problem.tolerance,
                        partial: None,
                    });
                }
            }
        }
        Ok(())
    }
}
