use super::{Load, Run, Stop};
use crate::observe::{Distribution, StressDistribution};
use crate::{Error, Result};

/// What a method finds at a load that knows no equilibrium of the fields: the parts that its card declares, and no others.
/// Lengths in L, stresses in E*, areas in L²; maps `[ny, nx]` on the problem's grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate<'a> {
    pub load: Load,
    /// Mean pressure.
    pub pressure: f64,
    /// Share of the cell that touches by the card's criterion.
    pub contact_fraction: f64,
    pub mean_gap: Option<f64>,
    /// dp/dū, from the method itself; without it neighbouring loads tell.
    pub stiffness: Option<f64>,
    /// 1 where a node touches.
    pub contact: Option<&'a [u8]>,
    pub gap: Option<&'a [f64]>,
    /// Interfacial stress, compression positive.
    pub stress: Option<&'a [f64]>,
    /// Areas of the patches, in any order. A method that lends a contact map leaves them to be counted there.
    pub patches: Option<Vec<f64>>,
    /// A method that lends a field leaves the field's distribution to be counted there.
    pub gap_distribution: Option<Distribution>,
    pub stress_distribution: Option<StressDistribution>,
    /// Relative difference between the pressure and what the parts carry together.
    pub load_error: f64,
    /// What the method misses of its own criterion of convergence, and what it asks there; both 0 of a method without iterations.
    pub residual: f64,
    pub tolerance: f64,
    pub stop: Stop,
    pub iterations: usize,
    /// Forward and inverse transforms of the grid, in pairs.
    pub fft_pairs: f64,
    pub seconds: f64,
}

impl Estimate<'_> {
    /// Nothing but a pressure, and no part of it carried yet.
    pub fn at(pressure: f64) -> Self {
        Estimate {
            load: Load::Pressure(pressure),
            pressure,
            contact_fraction: 0.0,
            mean_gap: None,
            stiffness: None,
            contact: None,
            gap: None,
            stress: None,
            patches: None,
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
}

/// Estimates along a load path, whose order matters to methods that remember.
pub trait Estimator {
    /// # Errors
    /// `Input` for a load that the method cannot impose.
    fn estimate(&mut self, load: Load) -> Result<Estimate<'_>>;

    /// Goes past a load whose estimate is known from before, so that the bits of the next one are those that would have
    /// followed. A method that remembers nothing of its loads has nothing to do.
    ///
    /// # Errors
    /// As [`Estimator::estimate`].
    fn pass(&mut self, _load: Load) -> Result<()> {
        Ok(())
    }
}

/// What has begun: a method of one kind or of the other, as its card says.
pub enum Started<'p> {
    Solver(Box<dyn Run + 'p>),
    Estimator(Box<dyn Estimator + 'p>),
}

impl<'p> Started<'p> {
    /// For callers that need the fields in equilibrium.
    ///
    /// # Errors
    /// `Input` for a method that does not solve for them.
    pub fn solver(self) -> Result<Box<dyn Run + 'p>> {
        match self {
            Started::Solver(run) => Ok(run),
            Started::Estimator(_) => Err(Error::input("method", "kind", "an estimate", "a solver of the fields")),
        }
    }

    /// For callers that need an estimate.
    ///
    /// # Errors
    /// `Input` for a solver of the fields.
    pub fn estimator(self) -> Result<Box<dyn Estimator + 'p>> {
        match self {
            Started::Estimator(run) => Ok(run),
            Started::Solver(_) => Err(Error::input("method", "kind", "a solver of the fields", "an estimate")),
        }
    }
}
