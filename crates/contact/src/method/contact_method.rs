use super::card::{Criterion, MethodCard};
use super::estimate::StartedMethod;
use super::problem::{Observer, ReducedProblem, SolvePlan};
use super::require;
use super::settings::Settings;
use crate::interface::AttractionLaw;
use asperity_grid::Result;

/// A method for the contact problem.
pub trait ContactMethod: Sync {
    /// Properties of the method: inputs, contact criterion, supported quantities, sources.
    fn card(&self) -> &'static MethodCard;

    /// Contact criterion with these settings; that of the card unless a setting changes it.
    fn criterion(&self, _settings: &Settings) -> Criterion {
        self.card().criterion
    }

    /// Data to which constants were fitted, with these settings; as on the card unless a setting replaces a constant.
    fn calibrated_on(&self, _settings: &Settings) -> Option<&'static str> {
        self.card().calibrated_on
    }

    /// Adhesion law that the method uses; that of the problem unless the method adapts it to the grid.
    fn adhesion(&self, problem: &ReducedProblem) -> AttractionLaw {
        problem.adhesion
    }

    /// Memory and iterations expected, computed before anything is allocated.
    fn plan(&self, problem: &ReducedProblem) -> SolvePlan;

    /// Allocates the fields. The first load starts from first contact or, in `fast`, from coarser grids.
    ///
    /// # Errors
    /// `Input` for a problem that the method does not support.
    fn start<'p>(&self, problem: &'p ReducedProblem<'p>, observer: &'p dyn Observer) -> Result<StartedMethod<'p>> {
        require::hardness(problem, self.card())?;
        require::ranks(problem, self.card())?;
        self.prepare(problem, observer)
    }

    /// [`ContactMethod::start`] of a problem whose hardness the method supports.
    ///
    /// # Errors
    /// As [`ContactMethod::start`].
    fn prepare<'p>(&self, problem: &'p ReducedProblem<'p>, observer: &'p dyn Observer) -> Result<StartedMethod<'p>>;
}
