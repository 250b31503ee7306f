//! The documented interface of the crate; `lib.rs` re-exports all of it at the crate root.

mod agreement;
mod arrays;
mod estimate;
mod finished;
mod methods;
mod observables;
mod problem;
mod state;
mod subsurface;
mod surface;

pub use agreement::{MapAgreement, compare_maps};
pub use asperity_contact::interface::HardnessMap;
pub use asperity_contact::problem::{Adhesion, AdhesionLaw, Body, Hardness, LoadKind, Loads, Problem};
pub use asperity_surface::provenance::Provenance;
pub use asperity_surface::{
    Cell, Detrend, Edges, Fill, FilterKind, MapOptions, Preparation, Surface, SynthesisOptions,
};
pub use estimate::Estimate;
pub use finished::{FinishedRun, FinishedState};
pub use methods::{Method, methods};
pub use observables::{
    Clusters, Percolation, PressureDistribution, clusters, contact_area, gap_distribution, hydraulic_gap, percolation,
    pressure_distribution,
};
pub use problem::{Monitor, Progress, Solve, method};
pub use state::{LoadPath, PullOff, State};
pub use subsurface::{StressMap, SubsurfaceStress, subsurface};
pub use surface::{FileOptions, read_surface};
