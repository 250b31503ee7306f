//! Contact solvers behind one trait.
//!
//! A method receives a [`ReducedProblem`] (grid, heights, kernel, interaction), never a scene. `fast`, `gfmd` and `bvm` are here; the modules
//! that are public serve authors of other methods, which `asperity-methods` registers. States are borrowed, not copied. For a quantity that a method does not support, its card
//! states the reason.

mod bvm;
pub mod card;
mod contact_area;
mod contact_method;
mod device;
pub mod equilibrium_check;
mod estimate;
mod fast;
pub mod fields;
mod gfmd;
pub mod iteration;
mod operator;
mod plastic;
mod problem;
pub mod require;
pub mod residuals;
mod scale;
pub mod settings;
mod snapshot;
mod sweep;

pub use bvm::Bvm;
pub use card::{
    CHALLENGE_DISTANCE_ANGSTROM, Capabilities, Criterion, MethodCard, MethodKind, Needs, Quantity, Support,
};
pub use contact_method::ContactMethod;
pub use device::{Device, gpu};
pub use estimate::{Estimator, MethodEstimate, StartedMethod};
pub use fast::Fast;
pub use fast::tangent::contact_stiffness;
pub use gfmd::Gfmd;
pub use problem::{
    CoarseState, Equilibrium, ErrorEstimates, Heights, Iteration, Machine, NoObserver, Observer, Precision,
    ReducedProblem, SeparationStep, SolvePlan, SolverRun, Stop, cannot_pull,
};
pub use snapshot::{SnapshotRef, SolverSnapshot};

pub use scale::{ProblemScale, ScaledHeights, is_representable};
pub use settings::{
    BemBsplineSettings, BicgstabSettings, ExperimentSettings, FftIaSettings, IchaSettings, MsArchardSettings,
    PerssonForm, PerssonSettings, RlArchardSettings, Settings, SrgwSettings, WinklerSettings,
};

pub use crate::load::Load;
