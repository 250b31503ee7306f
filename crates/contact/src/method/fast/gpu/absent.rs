use crate::interface::Law;
use crate::method::ReducedProblem;
use asperity_grid::Error;
use asperity_grid::Result;
use asperity_grid::{Grid, Real};

use super::super::fields::LevelFields;
use super::super::host::LevelProblem;

/// The GPU of a program that was built without the feature.
pub(crate) enum GpuLevels {}

impl GpuLevels {
    pub(crate) fn open(_: &ReducedProblem) -> Result<Option<Self>> {
        Ok(None)
    }

    pub(crate) fn takes(&self, _: Grid) -> bool {
        match *self {}
    }

    pub(crate) fn with_gap<'h, T: Real, L: Law + 'h>(
        &'h self,
        _: Grid,
        _: LevelProblem<'h, T, L>,
        _: Vec<T>,
    ) -> Box<dyn LevelFields<T> + 'h> {
        match *self {}
    }

    pub(crate) fn refined<'h, T: Real, L: Law + 'h>(
        &'h self,
        _: Grid,
        _: LevelProblem<'h, T, L>,
        _: (Grid, &[T]),
    ) -> Box<dyn LevelFields<T> + 'h> {
        match *self {}
    }

    pub(crate) fn failure(&self) -> Option<Error> {
        match *self {}
    }
}
