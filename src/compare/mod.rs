//! Comparison of two states: contact maps at surface sites, registration, gaps, and deviations against cost.

pub mod accuracy;
pub mod ensemble;
mod overlap;
pub mod pareto;
mod registration;
mod site_contact;

pub use overlap::{MISALIGNMENT, overlap};
pub use registration::registration;
pub use site_contact::{SiteCriterion, SitesOnGrid, wall_offset};
