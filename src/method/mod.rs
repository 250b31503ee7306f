//! Contact solvers behind one trait.
//!
//! A method receives a [`Problem`] (grid, heights, kernel, interaction), never a scene. A new method is one file and
//! one line in [`REGISTRY`]. States are borrowed, not copied. For a quantity that a method does not support, its card
//! states the reason.

pub mod all_atom;
mod bem_bspline;
mod bicgstab;
mod bvm;
mod card;
mod contact_area;
mod contact_method;
mod device;
mod equilibrium_check;
mod estimate;
mod experiment;
mod fast;
mod fft_ia;
mod fields;
mod gfmd;
mod gfmd_fire;
mod icha;
mod iteration;
mod ms_archard;
mod operator;
mod persson;
mod plastic;
mod problem;
mod quadrature;
mod registry;
mod require;
mod residuals;
mod rl_archard;
mod scale;
mod scgw;
mod settings;
mod sinusoid;
mod snapshot;
mod spots;
mod srgw;
mod sweep;
mod winkler;

pub use card::{Card, Criterion, Kind, Needs, Quantity, Support};
pub use contact_method::ContactMethod;
pub use device::{Device, gpu};
pub use estimate::{Estimate, Estimator, Started};
pub use fast::tangent::contact_stiffness;
pub use problem::{
    CoarseState, ErrorEstimates, Heights, Iteration, NoObserver, Observer, Plan, Precision, Problem, Run, State, Stop,
    Targets,
};
pub use snapshot::{SnapshotRef, SolverSnapshot};

pub use registry::{REGISTRY, find, ids};
pub use scale::{Scale, ScaledHeights, is_representable};
pub use settings::{
    BemBsplineSettings, BicgstabSettings, ExperimentSettings, FftIaSettings, IchaSettings, MsArchardSettings,
    PerssonForm, PerssonSettings, RlArchardSettings, Settings, SrgwSettings, WinklerSettings,
};

pub use crate::load::Load;
