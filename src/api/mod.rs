//! The documented interface of the crate; `lib.rs` re-exports all of it at the crate root.

mod agreement;
mod arrays;
mod body;
mod finished;
mod loads;
mod methods;
mod observables;
mod problem;
mod state;
mod subsurface;
mod surface;

pub use agreement::{MapAgreement, compare_maps};
pub use arrays::Cell;
pub use asperity_contact::results::PullOff;
pub use asperity_contact::state::{Map, State};
pub use asperity_surface::provenance::Provenance;
pub use asperity_surface::{Detrend, Edges, Fill, FilterKind, Preparation};
pub use body::Body;
pub use finished::FinishedRun;
pub use loads::Loads;
pub use methods::{Method, methods};
pub use observables::{
    Clusters, Percolation, clusters, contact_area, gap_distribution, hydraulic_gap, percolation, stress_distribution,
};
pub use problem::{Adhesion, Hardness, Monitor, Problem, Progress};
pub use state::{LoadPath, StateMaps};
pub use subsurface::{StressMap, SubsurfaceStress, subsurface};
pub use surface::{FileOptions, MapOptions, Surface, SynthesisOptions};
