use super::{Equilibrium, Load, SolverRun, Stop};
use crate::observe::{Distribution, StressDistribution};
use crate::quantity::Quantity;
use asperity_grid::{Error, Result};

/// Result at one load of a method that does not solve for the fields: the quantities that its card declares, and no
/// others. Lengths in L, stresses in E*, areas in L²; maps `[ny, nx]` on the grid of the problem.
#[derive(Debug, Clone, PartialEq)]
pub struct MethodEstimate<'a> {
    pub load: Load,
    /// Mean pressure.
    pub pressure: f64,
    /// Contact fraction by the criterion of the card.
    pub contact_area: f64,
    pub mean_gap: Option<f64>,
    /// Quantities of the card that the method does not deliver at this load, with the reason.
    pub undelivered: Vec<(Quantity, &'static str)>,
    /// dp/dū, if the method provides it; otherwise it follows from neighbouring loads. E*/L.
    pub stiffness: Option<f64>,
    /// 1 at nodes in contact, 0 elsewhere.
    pub contact: Option<&'a [u8]>,
    pub gap: Option<&'a [f64]>,
    /// Interfacial stress, compression positive.
    pub stress: Option<&'a [f64]>,
    /// Areas of the contact patches, in any order. None if they are to be counted on the contact map.
    pub clusters: Option<Vec<f64>>,
    /// None if the distribution is to be computed from the field.
    pub gap_distribution: Option<Distribution>,
    pub stress_distribution: Option<StressDistribution>,
    /// Relative difference between the pressure and the load that the contacts carry.
    pub load_error: f64,
    /// Residual of the method's own convergence criterion and its tolerance; both 0 for a method without iterations.
    pub residual: f64,
    pub tolerance: f64,
    pub stop: Stop,
    pub iterations: usize,
    /// Transform pairs (forward and inverse) of the grid.
    pub fft_pairs: f64,
    pub seconds: f64,
}

impl MethodEstimate<'_> {
    /// An estimate with a pressure and nothing else.
    pub fn at(pressure: f64) -> Self {
        MethodEstimate {
            load: Load::Pressure(pressure),
            pressure,
            contact_area: 0.0,
            mean_gap: None,
            undelivered: Vec::new(),
            stiffness: None,
            contact: None,
            gap: None,
            stress: None,
            clusters: None,
            gap_distribution: None,
            stress_distribution: None,
            load_error: 0.0,
            residual: 0.0,
            tolerance: 0.0,
            stop: Stop::Converged,
            iterations: 0,
            fft_pairs: 0.0,
            seconds: 0.0,
        }
    }

    /// An estimate with the mean gap, convergence and transforms of a solver's state under a pressure, on which the method is based.
    pub fn solved(pressure: f64, state: &Equilibrium, tolerance: f64) -> Self {
        MethodEstimate {
            mean_gap: Some(state.mean_gap),
            load_error: state.load_error,
            residual: state.residual,
            tolerance,
            stop: state.stop,
            iterations: state.iterations,
            fft_pairs: state.fft_pairs,
            ..MethodEstimate::at(pressure)
        }
    }
}

/// Estimates along a load path. The order of the loads matters to methods with hysteresis.
pub trait Estimator {
    /// # Errors
    /// `Input` for a load that the method cannot impose.
    fn estimate(&mut self, load: Load) -> Result<MethodEstimate<'_>>;

    /// Restores the state after a load whose estimate is already stored, so that the next estimate is bit-identical
    /// to that of an uninterrupted path. Nothing to do for a method without hysteresis.
    ///
    /// # Errors
    /// As [`Estimator::estimate`].
    fn replay(&mut self, _load: Load) -> Result<()> {
        Ok(())
    }
}

/// A started method of the kind on its card.
pub enum StartedMethod<'p> {
    Solver(Box<dyn SolverRun + 'p>),
    Estimator(Box<dyn Estimator + 'p>),
}

impl<'p> StartedMethod<'p> {
    /// The field solver.
    ///
    /// # Errors
    /// `Input` for a method that only estimates.
    pub fn solver(self) -> Result<Box<dyn SolverRun + 'p>> {
        match self {
            StartedMethod::Solver(run) => Ok(run),
            StartedMethod::Estimator(_) => Err(Error::input("method", "kind", "an estimator", "a field solver")),
        }
    }

    /// The estimator.
    ///
    /// # Errors
    /// `Input` for a field solver.
    pub fn estimator(self) -> Result<Box<dyn Estimator + 'p>> {
        match self {
            StartedMethod::Estimator(run) => Ok(run),
            StartedMethod::Solver(_) => Err(Error::input("method", "kind", "a field solver", "an estimator")),
        }
    }
}
