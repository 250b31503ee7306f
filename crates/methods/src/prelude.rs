//! Imports of nearly every method.

pub(super) use asperity_contact::interface::{AttractionLaw, Elastic, Kernel, Law, Wall};
pub(super) use asperity_contact::measured_errors::{MeasuredError, MeasuredErrors};
pub(super) use asperity_contact::method::equilibrium_check::{Ending, estimating};
pub(super) use asperity_contact::method::iteration::{IterationControl, LoadCase};
pub(super) use asperity_contact::method::residuals::Residuals;
pub(super) use asperity_contact::method::{
    Capabilities, ContactMethod, Criterion, Equilibrium, Estimator, Fast, Heights, Iteration, Load, MethodCard,
    MethodEstimate, MethodKind, Needs, Observer, Quantity, ReducedProblem, Settings, SolvePlan, SolverRun,
    StartedMethod, Stop, Support, fields, require, settings,
};
pub(super) use asperity_grid::{Grid, Result, lowest, mean, rms};
pub(super) use std::time::Instant;
