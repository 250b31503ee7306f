//! The documented interface of the crate; `lib.rs` re-exports all of it at the crate root.

mod agreement;
mod arrays;
mod finished;
mod methods;
mod observables;
mod state;
mod subsurface;
mod surface;

pub use agreement::{MapAgreement, compare_maps};
pub use asperity_contact::interface::HardnessMap;
pub use asperity_contact::problem::{
    Accuracy, AccuracyResults, Adhesion, AdhesionLaw, Body, ErrorTargets, Hardness, LastGrid, LoadKind, LoadPath,
    Loads, Monitor, Problem, Progress, SolvedGrid, StatedQuantity,
};
pub use asperity_contact::results::PullOff;
pub use asperity_contact::state::{Map, State};
pub use asperity_surface::provenance::Provenance;
pub use asperity_surface::{
    Cell, Detrend, Edges, Fill, FilterKind, MapOptions, Preparation, Surface, SynthesisOptions,
};
pub use finished::FinishedRun;
pub use methods::{Method, method, methods};
pub use observables::{
    Clusters, Percolation, clusters, contact_area, gap_distribution, hydraulic_gap, percolation, stress_distribution,
};
pub use state::StateMaps;
pub use subsurface::{StressMap, SubsurfaceStress, subsurface};
pub use surface::{FileOptions, read_surface};
